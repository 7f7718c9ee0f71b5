"""Calibration of a fixed camera from views with depth."""

from __future__ import annotations

from ctypes import byref, c_size_t
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, unsigned
from ._native import Handle, call, lib
from .calibrate import Calibration, chosen_options
from .camera import Camera
from .errors import Error, Status
from .images import Image, PixelFormat, view
from .pictures import DepthMap

_POINT_NUMBERS, _LINE_NUMBERS = 8, 15


@dataclass(frozen=True)
class RgbdView:
    """What an auxiliary view has to offer."""

    features: int  #: of its image
    with_depth: int  #: of them, those that have a depth
    matches: int  #: features that look like one of the fixed camera's image
    pairs: int  #: of these, those that have a depth
    lines: int  #: straight edges of its image that have a depth


@dataclass(frozen=True, eq=False)
class RgbdPairs:
    """Pairs of points, in the order of the calibration's residuals."""

    view: np.ndarray  #: (n,), number of the auxiliary view
    auxiliary: np.ndarray  #: (n, 2), pixels of its image
    fixed: np.ndarray  #: (n, 2), pixels of the fixed camera's image
    xyz: np.ndarray  #: (n, 3), metres

    def __len__(self) -> int:
        return len(self.view)


@dataclass(frozen=True, eq=False)
class RgbdLinePairs:
    """Pairs of lines, in the order of the calibration's residuals, after the points."""

    view: np.ndarray  #: (n,), number of the auxiliary view
    auxiliary: np.ndarray  #: (n, 4), x and y of both ends in its image, pixels
    fixed: np.ndarray  #: (n, 4), x and y of both ends in the fixed camera's image, pixels
    point: np.ndarray  #: (n, 3), of the line in the world, metres
    direction: np.ndarray  #: (n, 3), of length 1

    def __len__(self) -> int:
        return len(self.view)


class Rgbd(Handle):
    """A fixed camera's image, and what auxiliary views with depth share with it."""

    _free = "ptzcal_rgbd_free"

    def __init__(
        self,
        fixed: Image,
        *,
        min_pairs: Optional[int] = None,
        guided: bool = True,
        lines: bool = True,
        contrast_threshold: Optional[float] = None,
        edge_ratio: Optional[float] = None,
        max_ratio: Optional[float] = None,
        inverse_depth_sigma: Optional[float] = None,
        depth_sigma: Optional[float] = None,
        keypoint_sigma: Optional[float] = None,
        format: Union[PixelFormat, str, int, None] = None,
    ) -> None:
        """min_pairs: that must agree with the camera. guided: once more with pairs that lie where a
        first camera expects them. lines: with straight edges too. contrast_threshold, edge_ratio, max_ratio: of SIFT features and
        their matches. inverse_depth_sigma (1/m) and depth_sigma (metres): the depth camera's noise, by
        default a Kinect's. keypoint_sigma: of features, pixels; without, it is estimated.
        """
        options = _native.initial(_structs.ptzcal_rgbd_options)
        options.guided, options.lines = bool(guided), bool(lines)
        if min_pairs is not None:
            options.min_pairs = unsigned(min_pairs, "min_pairs")
        for name, value in (
            ("contrast_threshold", contrast_threshold),
            ("edge_ratio", edge_ratio),
            ("max_ratio", max_ratio),
            ("inverse_depth_sigma", inverse_depth_sigma),
            ("depth_sigma", depth_sigma),
            ("keypoint_sigma", keypoint_sigma),
        ):
            if value is not None:
                setattr(options, name, value)
        self._make(lib.ptzcal_rgbd_new, view(fixed, format, "fixed"), options)

    def add_view(
        self,
        colour: Image,
        depth: DepthMap,
        camera: Camera,
        *,
        format: Union[PixelFormat, str, int, None] = None,
    ) -> RgbdView:
        """Adds a view of an auxiliary camera; the cameras' poses say what the world is.

        A view without texture or depth adds nothing. Raises InvalidArgument for sizes that differ.
        """
        counts = _native.initial(_structs.ptzcal_rgbd_view)
        call(
            lib.ptzcal_rgbd_add_view,
            self._pointer,
            view(colour, format, "colour"),
            depth._pointer,
            byref(camera._struct),
            byref(counts),
        )
        return RgbdView(counts.features, counts.with_depth, counts.matches, counts.pairs, counts.lines)

    def calibrate(self, **options: Any) -> Calibration:
        """Calibrates the fixed camera from all views. The options are those of calibrate_camera.

        Raises Error TOO_FEW_POINTS where the images have too little in common, and what
        calibrate_camera raises.
        """
        chosen = chosen_options(**options)
        pointer = None if chosen is None else chosen._pointer
        return Calibration._made(lib.ptzcal_rgbd_calibrate, self._pointer, pointer)

    @property
    def pairs(self) -> RgbdPairs:
        """Of the last calibration. Raises Error BAD_STATE before the first."""
        table = self._table(lib.ptzcal_rgbd_copy_pairs, _POINT_NUMBERS)
        return RgbdPairs(table[:, 0].astype(int), table[:, 1:3], table[:, 3:5], table[:, 5:])

    @property
    def line_pairs(self) -> RgbdLinePairs:
        """Of the last calibration. Raises Error BAD_STATE before the first."""
        table = self._table(lib.ptzcal_rgbd_copy_lines, _LINE_NUMBERS)
        auxiliary, fixed = table[:, 1:5], table[:, 5:9]
        return RgbdLinePairs(table[:, 0].astype(int), auxiliary, fixed, table[:, 9:12], table[:, 12:])

    def _table(self, function: Any, columns: int) -> np.ndarray:
        needed = c_size_t()
        try:
            call(function, self._pointer, None, 0, byref(needed))
        except Error as e:
            if e.status != Status.BUFFER_TOO_SMALL:
                raise
        table = np.empty((needed.value // columns, columns))
        call(function, self._pointer, address_of(table), table.size, None)
        return table
