"""What calls fail with."""

from __future__ import annotations

import enum
from typing import Dict, Optional, Type, Union


class Status(enum.IntEnum):
    """Results of calls; the numbers never change."""

    OK = 0
    INVALID_ARGUMENT = -1
    NULL_POINTER = -2
    NOT_FINITE = -3
    BUFFER_TOO_SMALL = -4
    UNSUPPORTED = -5
    BUSY = -6
    BAD_STATE = -7
    INVALID_ADDRESS = -8
    TOO_FEW_POINTS = -100
    DEGENERATE = -101
    NO_CONVERGENCE = -102
    NO_CONSENSUS = -103
    LENS_NOT_MONOTONE = -104
    BEHIND_CAMERA = -105
    UNREACHABLE = -106
    OUTSIDE_LENS = -107
    NOT_FOUND = -200
    AMBIGUOUS = -201
    DEVICE = -300
    DEVICE_LOST = -301
    DEVICE_TIMEOUT = -302
    LASER_REFUSED = -303
    DEVICE_NOT_FOUND = -304
    DEVICE_PERMISSION = -305
    DEVICE_BUSY = -306
    DEVICE_MISMATCH = -307
    DEVICE_GARBLED = -308
    DEVICE_REFUSED = -309
    UNAUTHORISED = -310
    FILE_IO = -400
    FILE_FORMAT = -401
    FILE_VERSION = -402
    FILE_MISMATCH = -403
    DISK_FULL = -404
    CANCELLED = -500
    INTERNAL = -900
    PANIC = -901


class Error(Exception):
    """A call of the library failed.

    ``status`` says what kind of failure it was (decide by it: messages may change), ``index`` which
    point, view or sample is at fault (None when no single one is), ``hint`` what to do about it.
    """

    status: Union[Status, int]
    message: str
    index: Optional[int]
    hint: str

    def __init__(
        self, status: int, message: str = "", index: Optional[int] = None, hint: str = ""
    ) -> None:
        super().__init__(status, message, index, hint)
        try:
            self.status = Status(status)
        except ValueError:
            self.status = int(status)
        self.message, self.index, self.hint = message, index, hint

    @property
    def status_name(self) -> str:
        """Such as "NOT_FOUND"; "UNKNOWN" for a status of a newer library."""
        return self.status.name if isinstance(self.status, Status) else "UNKNOWN"

    def __str__(self) -> str:
        text = self.message or self.status_name
        return f"{text} ({self.hint})" if self.hint else text


class InvalidArgument(Error, ValueError):
    """An argument is not acceptable."""


class SpotNotFound(Error):
    """No laser spot stands out from the noise."""


class SpotAmbiguous(Error):
    """More than one spot could be the laser's."""


class ChessboardNotFound(Error):
    """There is no chessboard of the size, or too little of it is seen."""


class ChessboardAmbiguous(Error):
    """There is more than one chessboard of the size."""


class Cancelled(Error):
    """The work was stopped by a Cancel token or by a progress callback."""


_CLASSES: Dict[int, Type[Error]] = {
    Status.INVALID_ARGUMENT: InvalidArgument,
    Status.NOT_FINITE: InvalidArgument,
    Status.NOT_FOUND: SpotNotFound,
    Status.AMBIGUOUS: SpotAmbiguous,
    Status.CANCELLED: Cancelled,
}


def error(status: int, message: str, index: Optional[int] = None, hint: str = "") -> Error:
    """The exception for a status, of the class that fits it."""
    return _CLASSES.get(status, Error)(status, message, index, hint)
