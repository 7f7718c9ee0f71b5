"""Images without lens distortion: what an ideal camera would see from a camera's place."""

from __future__ import annotations

from ctypes import byref
from typing import Any, Optional, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, unsigned
from ._native import Handle, call, lib
from .camera import Camera
from .images import Image, PixelFormat, view


_CHANNELS = {PixelFormat.GRAY8: 1, PixelFormat.RGB24: 3, PixelFormat.BGR24: 3}


def undistorted_camera(camera: Camera, keep: float = 0.0) -> Camera:
    """The ideal camera that shows what `camera` sees: its size, place and rotation, without a lens.

    `keep` is how much of the image's border is kept, as the alpha of OpenCV's
    getOptimalNewCameraMatrix: 0 is the largest view whose pixels are all inside the image, 1 the
    smallest that holds all pixels of the image, with empty margins. Raises InvalidArgument for a
    lens that sees 180 degrees or more (unless keep is 0), Error LENS_NOT_MONOTONE for one that
    folds back inside the image.
    """
    struct = _native.initial(_structs.ptzcal_camera)
    call(lib.ptzcal_camera_undistorted, byref(camera._struct), float(keep), byref(struct))
    return Camera._from_struct(struct)


class Undistorter(Handle):
    """Takes the lens distortion out of a camera's images.

    `ideal` is the camera whose pictures are drawn: by default `undistorted_camera(camera, keep)`,
    else any camera without a lens. With ``dataclasses.replace`` on the default, or with a camera of
    your own, the view can be turned, zoomed and resized as a pan-tilt-zoom camera's; the place is
    always the calibrated camera's, whatever the ideal camera's t. Made once; threads may share it.
    """

    _free = "ptzcal_undistorter_free"

    def __init__(self, camera: Camera, ideal: Optional[Camera] = None, keep: float = 0.0) -> None:
        ideal = undistorted_camera(camera, keep) if ideal is None else ideal
        self._make(lib.ptzcal_undistorter_new, byref(camera._struct), byref(ideal._struct))
        struct = _native.initial(_structs.ptzcal_camera)
        call(lib.ptzcal_undistorter_get_camera, self._pointer, byref(struct))
        self._camera = Camera._from_struct(struct)

    @property
    def camera(self) -> Camera:
        """The ideal camera: it projects points into the pictures, and their pixels back."""
        return self._camera

    def apply(
        self,
        image: Image,
        *,
        format: Union[PixelFormat, str, int, None] = None,
        region: Optional[Tuple[int, int, int, int]] = None,
        border: Any = 0,
        out: Optional[np.ndarray] = None,
    ) -> np.ndarray:
        """The picture of an image of the camera: uint8 (h, w), (h, w, 3) or (h, w, 4), as the image.

        `region` draws a part of it: x, y, width, height. Pixels outside the image have the value
        `border`, a number or one for each channel. `out` is written to, and returned, instead of a
        new array; its rows may be apart or bottom-up, its pixels not. Raises InvalidArgument for an
        image of another size than the camera's, Error UNSUPPORTED for yuyv, nv12 and i420 (their Y
        plane alone is a grey image).
        """
        source = view(image, format)
        x, y, width, height = (0, 0, *self._camera.size) if region is None else region
        x, y = unsigned(x, "region"), unsigned(y, "region")
        width, height = unsigned(width, "region"), unsigned(height, "region")
        channels = _CHANNELS.get(source.format, 4)
        shape = (height, width) if channels == 1 else (height, width, channels)
        if out is None:
            out = np.empty(shape, np.uint8)
        else:
            _check_out(out, shape, channels)
        value = np.zeros(4, np.uint8)
        value[:channels] = border
        # The lowest address of the rows, whichever way they go.
        rows = out[::-1] if out.strides[0] < 0 else out
        step = abs(out.strides[0]) if height > 1 else width * channels
        size = step * (height - 1) + width * channels if height > 0 else 0
        call(
            lib.ptzcal_undistorter_apply_region,
            self._pointer,
            byref(source),
            x,
            y,
            width,
            height,
            address_of(value),
            address_of(rows),
            size,
            -step if out.strides[0] < 0 else step,
        )
        return out


def _check_out(out: Any, shape: Tuple[int, ...], channels: int) -> None:
    if not isinstance(out, np.ndarray) or out.dtype != np.uint8:
        raise TypeError("out must be an array of uint8")
    if out.shape != shape:
        raise ValueError(f"out must be of shape {shape}, not {out.shape}")
    whole = out.strides[1] == channels and (channels == 1 or out.strides[2] == 1)
    if not out.flags.writeable or not whole:
        raise ValueError("out must be writable, with the pixels of a row one after the other")
