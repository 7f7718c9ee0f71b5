"""Calibration of cameras and laser lines from views of planar boards."""

from __future__ import annotations

from ctypes import byref, c_size_t
from dataclasses import dataclass
from functools import cached_property
from typing import Any, List, Optional, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import (
    address_of,
    address_of_optional,
    pixel_covariances,
    rows,
    unsigned,
    vector,
)
from ._native import Handle, call, lib
from .calibrate import Calibration, chosen_options
from .camera import Camera
from .rig_model import RigModel


class Boards(Handle):
    """Views of planar boards by one camera, numbered from 0 in the order of adding."""

    _free = "ptzcal_boards_free"

    def __init__(self, width: int, height: int) -> None:
        """An empty set for a camera of this image size, pixels."""
        self._make(lib.ptzcal_boards_new, unsigned(width, "width"), unsigned(height, "height"))

    def add_view(
        self, board_xy: Any, uv: Any, *, uv_covariance: Any = None, spot: Any = None
    ) -> int:
        """Adds corners: places on the board (n, 2), in any unit (metres for a laser), and pixels
        (n, 2); the laser's spot too, a pixel (2,), where it is on. Tells the view's number.

        uv_covariance: (n, 3): xx, xy, yy, or (n, 2, 2), or (2, 2), px^2; without, the common noise
        is estimated. Raises Error TOO_FEW_POINTS, NOT_FINITE, DEGENERATE.
        """
        board_xy = rows(board_xy, 2, "board_xy")
        n = len(board_xy)
        uv = rows(uv, 2, "uv", n)
        covariance = pixel_covariances(uv_covariance, n, "uv_covariance")
        spot = None if spot is None else vector(spot, 2, "spot")
        call(
            lib.ptzcal_boards_add_view,
            self._pointer,
            address_of(board_xy),
            address_of(uv),
            address_of_optional(covariance),
            n,
        )
        view = len(self) - 1
        if spot is not None:
            self.set_spot(view, spot)
        return view

    def set_spot(self, view: int, uv: Any, *, uv_covariance: Any = None) -> None:
        """Sets the pixel (2,) of the laser's spot on the board of a view, with its covariance
        (xx, xy, yy) or (2, 2), px^2; without, it has the corners' common noise."""
        uv = vector(uv, 2, "uv")
        if uv_covariance is not None and np.shape(uv_covariance) == (3,):
            uv_covariance = [uv_covariance]
        covariance = pixel_covariances(uv_covariance, 1, "uv_covariance")
        call(
            lib.ptzcal_boards_set_spot,
            self._pointer,
            unsigned(view, "view"),
            address_of(uv),
            address_of_optional(covariance),
        )

    def set_bending(self, sigma: float) -> None:
        """Lets the board bend: prior standard deviation of its rim, in its unit; 0 keeps it flat."""
        call(lib.ptzcal_boards_set_bending, self._pointer, sigma)

    def __len__(self) -> int:
        count = c_size_t()
        call(lib.ptzcal_boards_count, self._pointer, byref(count))
        return count.value


@dataclass(frozen=True)
class BoardView:
    """What was found about one view.

    R, t: board to camera, t in the board's unit. covariance (6, 6): of w in R <- exp([w]x) R
    (radians, camera axes), then of the camera's centre in the board's frame. used: False for a view
    that was set aside; its covariance is then 0. rms: of the used corners' residuals, pixels.
    """

    R: np.ndarray
    t: np.ndarray
    covariance: np.ndarray
    used: bool
    corners: int
    inliers: int
    rms: float


class BoardCalibration(Handle):
    """A camera calibrated from boards. Immutable."""

    _free = "ptzcal_board_calibration_free"

    @classmethod
    def _made(cls, function: Any, *arguments: Any) -> "BoardCalibration":
        calibration = cls.__new__(cls)
        calibration._make(function, *arguments)
        return calibration

    @cached_property
    def calibration(self) -> Calibration:
        """Intrinsics and lens with their covariance; the pose is the identity. Its measurements
        are all corners, view after view."""
        return Calibration._made(lib.ptzcal_board_calibration_copy_camera, self._pointer)

    @property
    def camera(self) -> Camera:
        return self.calibration.camera

    @cached_property
    def views(self) -> Tuple[BoardView, ...]:
        count = c_size_t()
        call(lib.ptzcal_board_calibration_count, self._pointer, byref(count))
        return tuple(self._view(number) for number in range(count.value))

    def _view(self, number: int) -> BoardView:
        struct = _native.initial(_structs.ptzcal_board_view)
        call(lib.ptzcal_board_calibration_get_view, self._pointer, number, byref(struct))
        return BoardView(
            R=np.array(struct.rotation).reshape(3, 3),
            t=np.array(struct.translation),
            covariance=np.array(struct.covariance).reshape(6, 6),
            used=bool(struct.used),
            corners=struct.corners,
            inliers=struct.inliers,
            rms=struct.rms,
        )

    @cached_property
    def bending(self) -> np.ndarray:
        """b1, b2, b3 of the bent sheet, in the board's unit; 0 for flat boards."""
        bending = np.empty(3)
        call(lib.ptzcal_board_calibration_get_bending, self._pointer, address_of(bending))
        return bending

    @property
    def advice(self) -> List[str]:
        """What to add to make it better, the most needed first."""
        return lib.ptzcal_board_calibration_advice(self._pointer).decode().splitlines()


class LaserCalibration(Handle):
    """A calibrated laser line: points (x0 + vx Z, y0 + vy Z, Z) of the camera's frame, metres."""

    _free = "ptzcal_laser_calibration_free"

    def __init__(
        self, boards: Boards, lens: Optional[Calibration], options: Optional[Handle]
    ) -> None:
        self._make(
            lib.ptzcal_calibrate_laser_line,
            boards._pointer,
            None if lens is None else lens._pointer,
            None if options is None else options._pointer,
        )
        self._read()

    @classmethod
    def _made(cls, function: Any, *arguments: Any) -> "LaserCalibration":
        laser = cls.__new__(cls)
        laser._make(function, *arguments)
        laser._read()
        return laser

    def _read(self) -> None:
        self._line = _native.initial(_structs.ptzcal_laser_line)
        call(lib.ptzcal_laser_calibration_get_line, self._pointer, byref(self._line))

    @property
    def line(self) -> np.ndarray:
        """(4,): x0, y0 in metres, vx, vy in metres per metre of depth."""
        line = self._line
        return np.array([line.x0, line.y0, line.vx, line.vy])

    @property
    def covariance(self) -> np.ndarray:
        """(7, 7): of x0, y0, vx, vy, the logarithm of the common scale of fx and fy, cx, cy."""
        return np.array(self._line.covariance).reshape(7, 7)

    @property
    def rms(self) -> float:
        """Root mean square length of the used spots' residuals, pixels."""
        return self._line.rms

    @cached_property
    def rig_model(self) -> RigModel:
        """A rig with this lens and laser, axes through the camera's centre, true encoders."""
        struct = _native.initial(_structs.ptzcal_rig_model)
        call(lib.ptzcal_laser_calibration_get_rig_model, self._pointer, byref(struct))
        return RigModel._from_struct(struct)

    @cached_property
    def boards(self) -> BoardCalibration:
        """Lens and poses as the joint adjustment left them."""
        return BoardCalibration._made(lib.ptzcal_laser_calibration_copy_boards, self._pointer)

    @cached_property
    def residuals(self) -> np.ndarray:
        """Measured minus predicted spot of every view, (n, 2), outliers too; inf without a spot."""
        return self._copied("residuals", np.empty((len(self.boards.views), 2)))

    @cached_property
    def inliers(self) -> np.ndarray:
        """Which views' spots were used, (n,) bool."""
        return self._copied("inliers", np.empty(len(self.boards.views), np.uint8)).view(bool)

    def _copied(self, what: str, array: np.ndarray) -> np.ndarray:
        copy = getattr(lib, f"ptzcal_laser_calibration_copy_{what}")
        call(copy, self._pointer, address_of(array), array.size, None)
        array.flags.writeable = False
        return array


def calibrate_from_boards(boards: Boards, **options: Any) -> BoardCalibration:
    """Finds a camera's intrinsics and lens, and the boards' poses; sets wrong corners and views
    aside. The options are those of calibrate_camera; with `lens` only the poses are found.

    Raises Error TOO_FEW_POINTS, DEGENERATE (parallel boards), NO_CONSENSUS, NO_CONVERGENCE or
    LENS_NOT_MONOTONE; InvalidArgument for a view that is mirrored or does not fit; Cancelled.
    """
    chosen = chosen_options(**options)
    pointer = None if chosen is None else chosen._pointer
    return BoardCalibration._made(lib.ptzcal_calibrate_from_boards, boards._pointer, pointer)


def calibrate_laser_line(
    boards: Boards, *, lens: Union[Camera, Calibration, None] = None, **options: Any
) -> LaserCalibration:
    """Finds the laser's line from views with spots, places on the boards in metres.

    lens: a Camera is known exactly; a Calibration was measured from other images and its covariance
    is believed; without, it is found from the same corners. Other options as in calibrate_camera.

    Raises what calibrate_from_boards raises; TOO_FEW_POINTS for fewer than two spots; DEGENERATE
    for boards at one distance, a laser along a board, spots that do not move.
    """
    measured = lens if isinstance(lens, Calibration) else None
    known = None if measured is not None else lens
    return LaserCalibration(boards, measured, chosen_options(lens=known, **options))
