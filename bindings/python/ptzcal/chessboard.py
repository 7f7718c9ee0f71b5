"""Chessboards: their inner corners, in order."""

from __future__ import annotations

from ctypes import byref, c_size_t
from dataclasses import dataclass
from typing import Optional, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, unsigned
from ._native import call, lib
from .errors import ChessboardAmbiguous, ChessboardNotFound, SpotAmbiguous, SpotNotFound
from .images import Image, PixelFormat, view

#: Inner corners of the largest board: 128 x 128.
_MOST = 128 * 128


@dataclass(frozen=True, eq=False)
class Chessboard:
    """A chessboard in an image, its corners row by row; their order is that of include/ptzcal.h.

    Corners that were not found are NaN in `corners` and `covariance`.
    """

    columns: int  #: inner corners in a row
    rows: int  #: inner corners in a column
    corners: np.ndarray  #: (rows * columns, 2), pixels; (0, 0) is the centre of the top-left pixel
    covariance: np.ndarray  #: (rows * columns, 2, 2), px^2
    found: np.ndarray  #: (rows * columns,), bool
    blur: float  #: standard deviation of the image's blur, pixels


def detect_chessboard(
    image: Image,
    size: Optional[Tuple[int, int]] = None,
    *,
    min_found: Optional[float] = None,
    format: Union[PixelFormat, str, int, None] = None,
) -> Chessboard:
    """Finds a chessboard of `size` = (columns, rows) inner corners; without it one of any size.

    min_found: the least share of the corners that must be found, by default one half. The image is
    a uint8 array, see ptzcal.images.Image.

    Raises ChessboardNotFound or ChessboardAmbiguous: there is never a guess.
    """
    options = _native.initial(_structs.ptzcal_chessboard_options)
    capacity = _MOST
    if size is not None:
        options.columns, options.rows = (unsigned(n, "size") for n in size)
        capacity = min(options.columns * options.rows, _MOST)
    if min_found is not None:
        options.min_found = min_found
    board = _native.initial(_structs.ptzcal_chessboard)
    corners, covariance = np.zeros((capacity, 2)), np.zeros((capacity, 3))
    found, needed = np.zeros(capacity, np.uint8), c_size_t()
    try:
        call(
            lib.ptzcal_detect_chessboard,
            view(image, format, "image"),
            options,
            byref(board),
            address_of(corners),
            address_of(covariance),
            address_of(found),
            capacity,
            byref(needed),
        )
    except SpotNotFound as e:
        raise ChessboardNotFound(e.status, e.message, e.index, e.hint) from None
    except SpotAmbiguous as e:
        raise ChessboardAmbiguous(e.status, e.message, e.index, e.hint) from None
    seen = found[: needed.value].astype(bool)
    corners, covariance = corners[: needed.value].copy(), covariance[: needed.value]
    corners[~seen], covariance[~seen] = np.nan, np.nan
    matrices = covariance[:, [0, 1, 1, 2]].reshape(-1, 2, 2)
    return Chessboard(board.columns, board.rows, corners, matrices, seen, board.blur)
