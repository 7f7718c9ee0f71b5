"""Stopping long work from another thread."""

from __future__ import annotations

from typing import Optional

from ._native import Handle, lib


class Cancel(Handle):
    """Stops the work that it was handed to: that call then raises Cancelled."""

    _free = "ptzcal_cancel_free"

    def __init__(self) -> None:
        self._make(lib.ptzcal_cancel_new)

    def request(self) -> None:
        """Requests that all work which has this token stops. From any thread."""
        lib.ptzcal_cancel_request(self._pointer)

    def reset(self) -> None:
        """Takes a request back, so that the token can be used again."""
        lib.ptzcal_cancel_reset(self._pointer)

    @property
    def requested(self) -> bool:
        return bool(lib.ptzcal_cancel_is_requested(self._pointer))


def pointer_of(cancel: Optional[Cancel]) -> Optional[int]:
    if cancel is not None and not isinstance(cancel, Cancel):
        raise TypeError(f"cancel must be a ptzcal.Cancel, not {cancel!r}")
    return None if cancel is None else cancel._pointer
