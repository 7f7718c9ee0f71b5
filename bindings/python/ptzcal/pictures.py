"""Photographs and depth maps from files, and pictures of what was found."""

from __future__ import annotations

from ctypes import byref, c_size_t, c_uint32
from typing import Any, Optional, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, address_of_optional, contiguous, numbers, rows, unsigned
from ._native import Handle, call, lib
from .errors import Error, Status
from .images import Image, PixelFormat, copied, view


def read_image(path: _native.Path) -> np.ndarray:
    """Reads a PNG, JPEG or PNM as bgr24, (h, w, 3), which is what an array without a format is."""
    return Picture.read(path).image[..., ::-1].copy()


class Picture(Handle):
    """An image to draw on. Places are pixels; what lies outside is left out. Colours: 0xRRGGBB."""

    _free = "ptzcal_picture_free"

    def __init__(
        self, image: Image, format: Union[PixelFormat, str, int, None] = None
    ) -> None:
        """A copy of an image, see ptzcal.images.Image."""
        self._make(lib.ptzcal_picture_new, view(image, format, "image"))

    @classmethod
    def _made(cls, function: Any, *arguments: Any) -> "Picture":
        picture = cls.__new__(cls)
        picture._make(function, *arguments)
        return picture

    @classmethod
    def read(cls, path: _native.Path) -> "Picture":
        """Reads a PNG, JPEG or PNM. Raises Error FILE_IO, FILE_FORMAT."""
        return cls._made(lib.ptzcal_picture_read, _native.path(path))

    @classmethod
    def beside(cls, left: Image, right: Image) -> "Picture":
        """Two images side by side; the right one begins at x = the left one's width."""
        return cls._made(
            lib.ptzcal_picture_beside, view(left, None, "left"), view(right, None, "right")
        )

    @property
    def image(self) -> np.ndarray:
        """A copy of the pixels, rgb24, (h, w, 3)."""
        image = _native.initial(_structs.ptzcal_image)
        call(lib.ptzcal_picture_image, self._pointer, byref(image))
        return copied(image)

    def save(self, path: _native.Path) -> None:
        """Writes a PNG."""
        call(lib.ptzcal_picture_save, self._pointer, _native.path(path))

    def dim(self, light: float) -> None:
        """Leaves this part of the light, so that marks stand out."""
        call(lib.ptzcal_picture_dim, self._pointer, light)

    def draw_lines(self, ends: Any, colour: int = 0x3CFF3C, *, width: float = 1.5) -> None:
        """ends: (n, 4): x, y of the one end and of the other."""
        ends = rows(ends, 4, "ends")
        call(
            lib.ptzcal_picture_draw_lines,
            self._pointer,
            address_of(ends),
            len(ends),
            width,
            unsigned(colour, "colour"),
        )

    def draw_circles(
        self, centres: Any, colour: int = 0x3CFF3C, *, radius: float = 5.0, width: float = 1.5
    ) -> None:
        """centres: (n, 2)."""
        centres = rows(centres, 2, "centres")
        call(
            lib.ptzcal_picture_draw_circles,
            self._pointer,
            address_of(centres),
            len(centres),
            radius,
            width,
            unsigned(colour, "colour"),
        )

    def draw_board(self, corners: Any, columns: int) -> None:
        """A chessboard's corners, row by row; those that are NaN are left out."""
        corners = rows(corners, 2, "corners")
        if columns < 1 or len(corners) % columns:
            raise ValueError(f"{len(corners)} corners make no rows of {columns}")
        found = np.isfinite(corners).all(axis=1)
        corners, flags = np.where(found[:, None], corners, 0.0), found.astype(np.uint8)
        call(
            lib.ptzcal_picture_draw_board,
            self._pointer,
            address_of(corners),
            address_of(flags),
            columns,
            len(corners) // columns,
        )

    def draw_residuals(
        self, uv: Any, residuals: Any, inliers: Any = None, *, scale: float = 50.0
    ) -> None:
        """Residuals (n, 2) as arrows `scale` times as long, from where the points were seen (n, 2);
        outliers, where `inliers` (n,) is false, as red rings."""
        uv = rows(uv, 2, "uv")
        residuals = rows(residuals, 2, "residuals", len(uv))
        flags = _flags(inliers, len(uv), "inliers")
        call(
            lib.ptzcal_picture_draw_residuals,
            self._pointer,
            address_of(uv),
            address_of(residuals),
            address_of_optional(flags),
            len(uv),
            scale,
        )

    def draw_matches(self, left: Any, right: Any, kept: Any = None, *, offset: float) -> None:
        """Pairs of places (n, 2) of two images side by side, the right one from x = offset: joined
        by lines, or red rings where `kept` (n,) is false."""
        left = rows(left, 2, "left")
        right = rows(right, 2, "right", len(left))
        flags = _flags(kept, len(left), "kept")
        call(
            lib.ptzcal_picture_draw_matches,
            self._pointer,
            address_of(left),
            address_of(right),
            address_of_optional(flags),
            len(left),
            offset,
        )


def _flags(value: Any, count: int, name: str) -> Optional[np.ndarray]:
    if value is None:
        return None
    flags = np.ascontiguousarray(np.asarray(value).astype(bool), np.uint8)
    if flags.shape != (count,):
        raise ValueError(f"{name} must be of shape ({count},), not {flags.shape}")
    return flags


class DepthMap(Handle):
    """Depths of an image's pixels along the optical axis. What is not positive and finite is none."""

    _free = "ptzcal_depth_map_free"

    def __init__(self, depths: Any, metres: float = 1.0) -> None:
        """depths: (h, w), uint16 or real numbers; metres: of one unit, 0.001 for millimetres."""
        array = np.asarray(depths)
        if array.ndim != 2:
            raise ValueError(f"depths must be of shape (h, w), not {array.shape}")
        function = lib.ptzcal_depth_map_new_u16
        if array.dtype != np.uint16:
            array, function = numbers(array, "depths").astype(np.float32), lib.ptzcal_depth_map_new_f32
        array = contiguous(array)
        height, width = array.shape
        self._make(
            function,
            address_of(array),
            unsigned(width, "width"),
            unsigned(height, "height"),
            width,
            metres,
        )

    @classmethod
    def read(cls, path: _native.Path, metres: float = 0.001) -> "DepthMap":
        """Reads a PNG or PGM with one channel of 16 bits. Raises Error FILE_IO, FILE_FORMAT."""
        depth = cls.__new__(cls)
        depth._make(lib.ptzcal_depth_map_read, _native.path(path), metres)
        return depth

    def _sizes(self) -> tuple:
        width, height, known = c_uint32(), c_uint32(), c_size_t()
        call(lib.ptzcal_depth_map_size, self._pointer, byref(width), byref(height), byref(known))
        return width.value, height.value, known.value

    @property
    def size(self) -> tuple:
        """(width, height), pixels."""
        return self._sizes()[:2]

    @property
    def known(self) -> int:
        """Pixels that have a depth."""
        return self._sizes()[2]

    @property
    def metres(self) -> np.ndarray:
        """(h, w), float32; 0 where there is no depth."""
        return self._copied(lib.ptzcal_depth_map_copy_metres)

    @property
    def variances(self) -> Optional[np.ndarray]:
        """(h, w), float32, m^2, of a map made of a cloud or mesh; 0 where there is no depth. None
        where the noise is unknown."""
        try:
            return self._copied(lib.ptzcal_depth_map_copy_variances)
        except Error as error:
            if error.status == Status.BAD_STATE:
                return None
            raise

    def _copied(self, function: Any) -> np.ndarray:
        width, height = self.size
        values = np.empty((height, width), np.float32)
        call(function, self._pointer, address_of(values), values.size, None)
        return values

    def save(self, path: _native.Path, metres: float = 0.001) -> None:
        """Writes a PNG with one channel of 16 bits, `metres` per unit."""
        call(lib.ptzcal_depth_map_save, self._pointer, _native.path(path), metres)
