"""Images: NumPy arrays that the library reads where they are."""

from __future__ import annotations

import ctypes
import enum
from typing import Any, List, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, member


class PixelFormat(enum.IntEnum):
    """Layouts of pixels in memory, 8 bits per sample."""

    GRAY8 = 1
    RGB24 = 2
    BGR24 = 3
    RGBA32 = 4
    BGRA32 = 5
    YUYV = 6
    NV12 = 7
    I420 = 8


_PACKED = {
    PixelFormat.GRAY8: 1,
    PixelFormat.RGB24: 3,
    PixelFormat.BGR24: 3,
    PixelFormat.RGBA32: 4,
    PixelFormat.BGRA32: 4,
    PixelFormat.YUYV: 2,
}
_PILLOW = {"L": PixelFormat.GRAY8, "RGB": PixelFormat.RGB24, "RGBA": PixelFormat.RGBA32}
_GUESSES = {1: PixelFormat.GRAY8, 3: PixelFormat.BGR24, 4: PixelFormat.BGRA32}

Image = Union[np.ndarray, Tuple[np.ndarray, ...]]
"""uint8. The shape, for a format and its image of height h and width w:

gray8 (h, w); rgb24, bgr24 (h, w, 3); rgba32, bgra32 (h, w, 4); yuyv (h, w, 2);
nv12, i420 (3 h / 2, w) as in OpenCV, or a tuple of the planes (y, uv) or (y, u, v).

Without a format, (h, w) is gray8, (h, w, 3) is bgr24 and (h, w, 4) is bgra32, as in OpenCV. An image
of Pillow (modes L, RGB, RGBA) is one too, and knows its own format.
Rows may be apart, or bottom-up; what the library cannot read in place is copied.
"""


def view(
    image: Image, format: Union[PixelFormat, str, int, None] = None, name: str = "image"
) -> _structs.ptzcal_image:
    """The C view of an image; it keeps the pixels alive."""
    if format is None and _is_pillow(image):
        if image.mode not in _PILLOW:
            raise ValueError(
                f"{name} is of Pillow's mode {image.mode}: convert it to L, RGB or RGBA"
            )
        format = _PILLOW[image.mode]
    if format is not None:
        layout = member(PixelFormat, format, "format")
        if layout not in _PACKED:
            return _planar(image, layout, name)
        wanted = _shape_of(layout)
    array = _samples(image, name)
    shape = array.shape
    channels = shape[2] if array.ndim == 3 else 1
    if format is None:
        layout = _GUESSES.get(channels, PixelFormat.GRAY8)
        wanted = "(h, w), (h, w, 3) or (h, w, 4)"
    if array.ndim not in (2, 3) or channels != _PACKED[layout]:
        raise ValueError(f"{name} must be of shape {wanted}, not {shape}")
    return _fill(layout, shape[1], shape[0], [_rows(array, channels)])


def _is_pillow(image: Any) -> bool:
    """Without loading Pillow: most programs do not have it."""
    return any(base.__module__ == "PIL.Image" for base in type(image).__mro__)


def _samples(image: Any, name: str) -> np.ndarray:
    array = np.asarray(image)
    if array.dtype != np.uint8:
        raise TypeError(f"{name} must hold uint8, not {array.dtype}")
    return array


def _shape_of(layout: PixelFormat) -> str:
    channels = _PACKED[layout]
    return f"(h, w, {channels})" if channels > 1 else "(h, w)"


def _rows(array: np.ndarray, channels: int) -> np.ndarray:
    """The array itself when its rows are whole and do not overlap, else a copy."""
    strides = array.strides
    row = array.shape[1] * channels
    whole = strides[1] == channels and (channels == 1 or strides[2] == 1)
    if whole and (abs(strides[0]) >= row or array.shape[0] == 1):
        return array
    return np.ascontiguousarray(array)


def _planar(image: Image, layout: PixelFormat, name: str) -> _structs.ptzcal_image:
    if isinstance(image, tuple):
        planes = [_samples(plane, name) for plane in image]
        if planes and planes[0].ndim == 2:
            height, width = planes[0].shape
            half = ((height + 1) // 2, (width + 1) // 2)
            chroma = [half + (2,)] if layout == PixelFormat.NV12 else [half, half]
            flat = [(half[0], half[1] * 2)] if layout == PixelFormat.NV12 else chroma
            got = [plane.shape for plane in planes[1:]]
            if got in (chroma, flat):
                planes = [
                    _rows(plane, plane.shape[2] if plane.ndim == 3 else 1) for plane in planes
                ]
                return _fill(layout, width, height, planes)
        shapes = ", ".join(str(plane.shape) for plane in planes)
        raise ValueError(f"{name} has no planes of {layout.name.lower()}: shapes {shapes}")
    array = _samples(image, name)
    if array.ndim != 2 or array.shape[0] % 3 or array.shape[1] % 2 or array.shape[0] == 0:
        raise ValueError(
            f"{name} must be of shape (3 h / 2, w) with h and w even, or a tuple of planes, "
            f"not {array.shape}"
        )
    height, width = array.shape[0] // 3 * 2, array.shape[1]
    if layout == PixelFormat.NV12:
        return _fill(layout, width, height, [_rows(array[:height], 1), _rows(array[height:], 1)])
    # I420 packs two rows of U (and of V) into one row of the array.
    u, v = np.ascontiguousarray(array[height:]).reshape(2, height // 2, width // 2)
    return _fill(layout, width, height, [_rows(array[:height], 1), u, v])


def _fill(
    layout: PixelFormat, width: int, height: int, planes: List[np.ndarray]
) -> _structs.ptzcal_image:
    image = _native.initial(_structs.ptzcal_image)
    image.format, image.width, image.height = layout, width, height
    for i, plane in enumerate(planes):
        rows = plane.shape[0]
        row = plane.size // rows if rows else 0
        stride = plane.strides[0] if rows > 1 else row
        image.plane[i] = address_of(plane)
        image.stride[i] = stride
        image.size[i] = abs(stride) * (rows - 1) + row if rows else 0
    image.pixels = planes
    return image


def fill(target: _structs.ptzcal_image, source: _structs.ptzcal_image) -> None:
    """Copies a view into a struct of the library's, whose size stays its own."""
    target.format, target.width, target.height = source.format, source.width, source.height
    target.plane, target.stride, target.size = source.plane, source.stride, source.size


def copied(image: _structs.ptzcal_image) -> Image:
    """The pixels of an image of the library's, in an array of their own."""
    layout = PixelFormat(image.format)
    width, height = image.width, image.height
    half = ((height + 1) // 2, (width + 1) // 2)
    if layout in _PACKED:
        channels = _PACKED[layout]
        return _plane(image, 0, (height, width) if channels == 1 else (height, width, channels))
    luma = _plane(image, 0, (height, width))
    if layout == PixelFormat.NV12:
        return luma, _plane(image, 1, half + (2,))
    return luma, _plane(image, 1, half), _plane(image, 2, half)


def _plane(image: _structs.ptzcal_image, index: int, shape: Tuple[int, ...]) -> np.ndarray:
    stride = image.stride[index]
    row = int(np.prod(shape[1:]))
    size = abs(stride) * (shape[0] - 1) + row
    lowest = image.plane[index] + min(stride, 0) * (shape[0] - 1)
    memory = np.frombuffer((ctypes.c_uint8 * size).from_address(lowest), np.uint8)
    offset = 0 if stride >= 0 else size - row
    strides = (stride, shape[2], 1) if len(shape) == 3 else (stride, 1)
    return np.ndarray(shape, np.uint8, memory, offset, strides).copy()
