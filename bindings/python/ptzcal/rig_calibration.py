"""From pictures of a chessboard, with the laser off and on, to a rig at every zoom."""

from __future__ import annotations

from ctypes import byref, c_double, c_size_t, c_uint32
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Optional, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, address_of_optional, pixel_covariances, rows, unsigned, vector
from ._native import Handle, Path, call, lib, path
from .boards import BoardCalibration, LaserCalibration
from .calibrate import chosen_options
from .detect import SpotOptions
from .errors import Status
from .images import Image, PixelFormat, view
from .rig_model import RigModel


class UncertainRig(NamedTuple):
    """A rig model with its covariance (7, 7): of x0, y0, vx, vy of the laser's line (metres, slopes), the
    logarithm of the common scale of fx and fy, cx, cy (pixels)."""

    model: RigModel
    covariance: np.ndarray


def _uncertain_rig(function: Any, pointer: Any, which: Any) -> UncertainRig:
    struct = _native.initial(_structs.ptzcal_rig_model)
    covariance = np.empty((7, 7))
    call(function, pointer, which, byref(struct), address_of(covariance))
    return UncertainRig(RigModel._from_struct(struct), covariance)


class ZoomCurve(Handle):
    """A rig's lens and laser line over zoom. Immutable."""

    _free = "ptzcal_zoom_curve_free"

    @classmethod
    def _made(cls, function: Any, *arguments: Any) -> "ZoomCurve":
        curve = cls.__new__(cls)
        curve._make(function, *arguments)
        return curve

    @classmethod
    def load(cls, file: Path) -> "ZoomCurve":
        """Reads a file of `save`. Raises Error FILE_IO, FILE_FORMAT or FILE_VERSION."""
        return cls._made(lib.ptzcal_zoom_curve_load, path(file))

    def save(self, file: Path) -> None:
        """Writes it as JSON, every number to its last bit."""
        call(lib.ptzcal_zoom_curve_save, self._pointer, path(file))

    @property
    def range(self) -> Tuple[float, float]:
        """The least and the greatest zoom that it answers for."""
        low, high = c_double(), c_double()
        call(lib.ptzcal_zoom_curve_get_range, self._pointer, byref(low), byref(high))
        return low.value, high.value

    def at(self, zoom: float) -> UncertainRig:
        """The rig at a zoom within the range; axes through the camera's centre, true encoders."""
        return _uncertain_rig(lib.ptzcal_zoom_curve_get_rig_model, self._pointer, zoom)


@dataclass(frozen=True)
class RigView:
    """What became of a view.

    status: OK when it was used; `reason` says why not. The same of its spot, which is OK, too, where
    there is no picture with the laser on. corners: pixels (n, 2), board_xy: their places on the board
    (n, 2), metres; residuals: measured minus predicted, (n, 2) pixels, inf where none is predicted;
    inliers (n,) bool. R, t: board to camera, metres; None where they are not known. spot and
    spot_residual: pixels (2,); None where there is none.
    """

    zoom: float
    status: Union[Status, int]
    reason: str
    spot_status: Union[Status, int]
    spot_reason: str
    corners: np.ndarray
    board_xy: np.ndarray
    residuals: np.ndarray
    inliers: np.ndarray
    rms: float
    R: Optional[np.ndarray]
    t: Optional[np.ndarray]
    spot: Optional[np.ndarray]
    spot_residual: Optional[np.ndarray]


@dataclass(frozen=True)
class ZoomPosition:
    """What became of a zoom position.

    status: OK when lens and poses were found, laser_status: when the laser's line was, from this
    position's views; the reasons say why not. has_model: there is a lens, and a line from here or from
    the other positions. views, views_used, spots_used: how many. rms: of the used corners, pixels.
    """

    zoom: float
    status: Union[Status, int]
    reason: str
    laser_status: Union[Status, int]
    laser_reason: str
    has_model: bool
    views: int
    views_used: int
    spots_used: int
    rms: float


@dataclass(frozen=True)
class CommonLine:
    """The laser's line as all zoom positions see it, in the frame of the first that saw the spot.

    line (4,): x0, y0, vx, vy, and their covariance (4, 4). agrees: the positions' lines are one line (a
    chance of 1 in 1000 or more); if not, odd_zoom is the position without which the others agree best
    (None when nobody can tell), and every position keeps its own.
    """

    line: np.ndarray
    covariance: np.ndarray
    agrees: bool
    positions: int
    chi2: float
    degrees_of_freedom: int
    probability: float
    odd_zoom: Optional[float]


def _status(value: int) -> Union[Status, int]:
    try:
        return Status(value)
    except ValueError:
        return value


class RigCalibrated(Handle):
    """A calibrated rig: what became of every zoom position and of every view. Immutable."""

    _free = "ptzcal_rig_calibrated_free"

    def __init__(self, calibration: "RigCalibration") -> None:
        self._make(lib.ptzcal_rig_calibration_solve, calibration._pointer)

    @cached_property
    def _counts(self) -> Tuple[int, int]:
        positions, views = c_uint32(), c_uint32()
        call(lib.ptzcal_rig_calibrated_count, self._pointer, byref(positions), byref(views))
        return positions.value, views.value

    @cached_property
    def positions(self) -> Tuple[ZoomPosition, ...]:
        """Zoom positions, ascending."""
        return tuple(self._position(index) for index in range(self._counts[0]))

    @cached_property
    def views(self) -> Tuple[RigView, ...]:
        """Views, in the order of adding."""
        return tuple(self._view(number) for number in range(self._counts[1]))

    def _reason(self, what: str, number: int) -> str:
        return getattr(lib, f"ptzcal_rig_calibrated_{what}_reason")(self._pointer, number).decode()

    def _position(self, index: int) -> ZoomPosition:
        struct = _native.initial(_structs.ptzcal_zoom_position)
        call(lib.ptzcal_rig_calibrated_get_position, self._pointer, index, byref(struct))
        return ZoomPosition(
            zoom=struct.zoom,
            status=_status(struct.status),
            reason=self._reason("position", index),
            laser_status=_status(struct.laser_status),
            laser_reason=self._reason("laser", index),
            has_model=bool(struct.has_model),
            views=struct.views,
            views_used=struct.views_used,
            spots_used=struct.spots_used,
            rms=struct.rms,
        )

    def _view(self, number: int) -> RigView:
        struct = _native.initial(_structs.ptzcal_rig_view)
        call(lib.ptzcal_rig_calibrated_get_view, self._pointer, number, byref(struct))
        n = struct.corners
        board_xy, corners, residuals = np.empty((n, 2)), np.empty((n, 2)), np.empty((n, 2))
        inliers = np.empty(n, np.uint8)
        call(
            lib.ptzcal_rig_calibrated_copy_corners,
            self._pointer,
            number,
            address_of(board_xy),
            address_of(corners),
            address_of(residuals),
            address_of(inliers),
            n,
            byref(c_size_t()),
        )
        return RigView(
            zoom=struct.zoom,
            status=_status(struct.status),
            reason=self._reason("view", number),
            spot_status=_status(struct.spot_status),
            spot_reason=self._reason("spot", number),
            corners=corners,
            board_xy=board_xy,
            residuals=residuals,
            inliers=inliers.view(bool),
            rms=struct.rms,
            R=np.array(struct.rotation).reshape(3, 3) if struct.has_pose else None,
            t=np.array(struct.translation) if struct.has_pose else None,
            spot=np.array(struct.spot) if struct.has_spot else None,
            spot_residual=np.array(struct.spot_residual) if struct.has_spot else None,
        )

    def rig(self, index: int) -> UncertainRig:
        """The rig at a zoom position; axes through the camera's centre, true encoders.

        Raises what went wrong there; InvalidArgument for no such position.
        """
        function = lib.ptzcal_rig_calibrated_get_rig_model
        return _uncertain_rig(function, self._pointer, unsigned(index, "index"))

    def boards(self, index: int) -> BoardCalibration:
        """Lens and poses of a zoom position from its own views alone; raises why there are none."""
        index = unsigned(index, "index")
        return BoardCalibration._made(lib.ptzcal_rig_calibrated_copy_boards, self._pointer, index)

    def laser(self, index: int) -> LaserCalibration:
        """The same with the laser's line; raises why there is none."""
        index = unsigned(index, "index")
        return LaserCalibration._made(lib.ptzcal_rig_calibrated_copy_laser, self._pointer, index)

    @cached_property
    def common_line(self) -> CommonLine:
        """Raises Error NOT_FOUND when fewer than two positions saw the spot."""
        struct = _native.initial(_structs.ptzcal_common_line)
        call(lib.ptzcal_rig_calibrated_get_common_line, self._pointer, byref(struct))
        return CommonLine(
            line=np.array([struct.x0, struct.y0, struct.vx, struct.vy]),
            covariance=np.array(struct.covariance).reshape(4, 4),
            agrees=bool(struct.agrees),
            positions=struct.positions,
            chi2=struct.chi2,
            degrees_of_freedom=struct.degrees_of_freedom,
            probability=struct.probability,
            odd_zoom=None if np.isnan(struct.odd_zoom) else struct.odd_zoom,
        )

    @cached_property
    def curve(self) -> ZoomCurve:
        """The rig over zoom. Raises Error TOO_FEW_POINTS (no position has a rig model); InvalidArgument
        (the focal length does not grow or fall from position to position)."""
        return ZoomCurve._made(lib.ptzcal_rig_calibrated_get_curve, self._pointer)


class RigCalibration(Handle):
    """Views of chessboards by the camera of a rig, numbered from 0 in the order of adding."""

    _free = "ptzcal_rig_calibration_free"

    def __init__(
        self,
        columns: int,
        rows: int,
        square: float,
        *,
        spot: Optional[SpotOptions] = None,
        **options: Any,
    ) -> None:
        """columns, rows: inner corners of the board; square: its squares' side, metres. spot: how the
        spot is searched, which is looked for on the board only. Other options as in calibrate_camera,
        without a lens."""
        chosen = chosen_options(**options)
        self._make(
            lib.ptzcal_rig_calibration_new,
            unsigned(columns, "columns"),
            unsigned(rows, "rows"),
            square,
            None if chosen is None else chosen._pointer,
            None if spot is None else spot._pointer,
        )

    def set_board(self, columns: int, rows: int, square: float) -> None:
        """The board of the views that are added from now on."""
        size = unsigned(columns, "columns"), unsigned(rows, "rows")
        call(lib.ptzcal_rig_calibration_set_board, self._pointer, *size, square)

    def set_common_line(self, share: bool, pupil_sigma: float = 0.05) -> None:
        """Whether the zoom positions share one laser line (they do, where the data do not contradict it),
        and how far the camera's centre moves with the zoom: a standard deviation, metres."""
        call(lib.ptzcal_rig_calibration_set_common_line, self._pointer, bool(share), pupil_sigma)

    def add_images(
        self,
        zoom: float,
        off: Image,
        on: Optional[Image] = None,
        *,
        format: Union[PixelFormat, str, int, None] = None,
    ) -> int:
        """Adds a picture of the board with the laser off and, if there is one, the same with it on; tells
        the view's number. zoom: the device's own number of the position. That nothing is found in a
        picture is no error: see RigCalibrated.views."""
        off_image = view(off, format, "off")
        # Kept in a name of its own: the view must outlive the call.
        on_image = None if on is None else view(on, format, "on")
        number = c_uint32()
        function = lib.ptzcal_rig_calibration_add_images
        call(function, self._pointer, zoom, off_image, on_image, byref(number))
        return number.value

    def add_corners(
        self,
        zoom: float,
        image_size: Tuple[int, int],
        board_xy: Any,
        uv: Any,
        *,
        uv_covariance: Any = None,
        spot: Any = None,
        spot_covariance: Any = None,
    ) -> int:
        """Adds corners that were found elsewhere, as Boards.add_view, in an image of image_size = (width,
        height); tells the view's number."""
        board_xy = rows(board_xy, 2, "board_xy")
        n = len(board_xy)
        uv = rows(uv, 2, "uv", n)
        covariance = pixel_covariances(uv_covariance, n, "uv_covariance")
        width, height = (unsigned(side, "image_size") for side in image_size)
        number = c_uint32()
        call(
            lib.ptzcal_rig_calibration_add_corners,
            self._pointer,
            zoom,
            width,
            height,
            address_of(board_xy),
            address_of(uv),
            address_of_optional(covariance),
            n,
            byref(number),
        )
        if spot is not None:
            self.set_spot(number.value, spot, uv_covariance=spot_covariance)
        return number.value

    def set_spot(self, view: int, uv: Any, *, uv_covariance: Any = None) -> None:
        """As Boards.set_spot; replaces what was found."""
        uv = vector(uv, 2, "uv")
        if uv_covariance is not None and np.shape(uv_covariance) == (3,):
            uv_covariance = [uv_covariance]
        covariance = pixel_covariances(uv_covariance, 1, "uv_covariance")
        call(
            lib.ptzcal_rig_calibration_set_spot,
            self._pointer,
            unsigned(view, "view"),
            address_of(uv),
            address_of_optional(covariance),
        )

    def solve(self) -> RigCalibrated:
        """Calibrates every zoom position; what fails at one is said there. Raises Error TOO_FEW_POINTS (no
        views); Cancelled."""
        return RigCalibrated(self)
