"""One HTML file that says what was measured and how good it is."""

from __future__ import annotations

from ctypes import byref, c_size_t, create_string_buffer
from typing import Any, Optional, Union

from . import _native
from ._arrays import address_of, vector
from ._native import Handle, call, lib, text
from .adjust import Adjusted
from .boards import BoardCalibration, Boards
from .calibrate import Calibration, Correspondences
from .images import Image, PixelFormat, view
from .scan import Scan


class Report(Handle):
    """Grows by a section for each thing that is added. The file needs no other file and no network."""

    _free = "ptzcal_report_free"

    def __init__(self, title: str, *, up: Any = None) -> None:
        """up: (3,), upwards in the world, for the view from above; without it -y, as in a rig's frame."""
        self._make(lib.ptzcal_report_new, text(title, "title"))
        if up is not None:
            call(lib.ptzcal_report_set_up, self._pointer, address_of(vector(up, 3, "up")))

    def add_note(self, note: str) -> None:
        """A paragraph of your own: who measured, when, where, with what."""
        call(lib.ptzcal_report_add_note, self._pointer, text(note, "note"))

    def add_calibration(
        self,
        name: str,
        calibration: Calibration,
        correspondences: Optional[Correspondences] = None,
        picture: Optional[Image] = None,
        *,
        format: Union[PixelFormat, str, int, None] = None,
    ) -> None:
        """A camera; with what it was calibrated from there are drawings, over its picture if given."""
        call(
            lib.ptzcal_report_add_calibration,
            self._pointer,
            text(name, "name"),
            calibration._pointer,
            None if correspondences is None else correspondences._pointer,
            None if picture is None else view(picture, format, "picture"),
        )

    def add_board_calibration(
        self, name: str, calibration: BoardCalibration, boards: Boards
    ) -> None:
        """A camera calibrated from boards, its views, and what to add to make it better."""
        call(
            lib.ptzcal_report_add_board_calibration,
            self._pointer,
            text(name, "name"),
            calibration._pointer,
            boards._pointer,
        )

    def add_scan(self, name: str, scan: Scan) -> None:
        """What was fired at, who saw it, and why not."""
        call(lib.ptzcal_report_add_scan, self._pointer, text(name, "name"), scan._pointer)

    def add_survey(self, name: str, survey: Adjusted) -> None:
        """Rig, stations and planes of a joint adjustment, and each of its cameras."""
        call(lib.ptzcal_report_add_adjusted, self._pointer, text(name, "name"), survey._pointer)

    def add_input(self, name: str, data: bytes) -> None:
        """Names what the result was made from by its SHA-256."""
        call(lib.ptzcal_report_add_input, self._pointer, text(name, "name"), bytes(data), len(data))

    @property
    def html(self) -> str:
        needed = c_size_t()
        # The first call tells the size, or why there is none.
        try:
            call(lib.ptzcal_report_copy_html, self._pointer, None, 0, byref(needed))
        except _native.Error:
            if not needed.value:
                raise
        buffer = create_string_buffer(needed.value)
        call(lib.ptzcal_report_copy_html, self._pointer, buffer, needed.value, None)
        return buffer.raw.decode()

    def save(self, path: _native.Path) -> None:
        call(lib.ptzcal_report_save, self._pointer, _native.path(path))

    def _repr_html_(self) -> str:
        """For notebooks."""
        return self.html
