"""A fixed camera's pixel as pan, tilt and zoom of the head, and back, with error ellipses."""

from __future__ import annotations

import enum
import math
from ctypes import byref, c_size_t
from dataclasses import dataclass
from typing import Any, NamedTuple, Optional, Tuple

import numpy as np

from . import _native, _structs
from ._arrays import address_of, address_of_optional, numbers, pixel_covariances, rows, vector
from ._native import Handle, call, lib
from .adjust import Adjusted
from .calibrate import Calibration
from .errors import Error, Status
from .rig_calibration import ZoomCurve
from .rig_model import RigModel


class MeasuredBy(enum.IntEnum):
    OTHERS = 0  #: its errors have nothing to do with the rig's
    THIS_RIG = 1  #: what is wrong with the rig is wrong with the surface too


def _symmetric(three: Any) -> np.ndarray:
    xx, xy, yy = three
    return np.array([[xx, xy], [xy, yy]])


@dataclass(frozen=True, eq=False)
class Aim:
    """Where to turn the head; radians, metres, pixels."""

    pan: float
    tilt: float
    angle_covariance: np.ndarray  #: (2, 2), of the target's direction about pan and tilt
    zoom: Optional[float]  #: the tightest that keeps the target in the picture
    probability: float  #: of the whole target being in the picture
    uv: np.ndarray  #: where the target is in the head camera's picture then
    uv_covariance: np.ndarray  #: (2, 2)
    point: np.ndarray  #: in the world
    point_covariance: np.ndarray  #: (3, 3)
    distance: float  #: from the fixed camera
    edge: bool  #: the surface ends about here
    other_distance: Optional[float]  #: of what the target may be instead


@dataclass(frozen=True, eq=False)
class Located:
    """Where the fixed camera sees what the head camera sees."""

    uv: np.ndarray
    uv_covariance: np.ndarray  #: (2, 2)
    point: np.ndarray
    point_covariance: np.ndarray  #: (3, 3)
    distance: float  #: from the head camera
    edge: bool
    hidden: bool  #: a surface is between the fixed camera and the point


class LocatedAlong(NamedTuple):
    """The fixed camera's picture of a ray whose depth is unknown, nearest first."""

    distance: np.ndarray  #: (n,), from the head camera, metres
    uv: np.ndarray  #: (n, 2)
    uv_covariance: np.ndarray  #: (n, 2, 2)


class Sweep(NamedTuple):
    """What to do about a pixel whose depth is unknown."""

    curve: np.ndarray  #: (n, 3): distance, pan, tilt, nearest first
    steps: np.ndarray  #: (m, 2): pan and tilt of the pictures that show all of it
    middle: Tuple[float, float]
    zoom: Optional[float]
    probability: float


def ellipse(covariance: Any, probability: float = 0.95) -> Tuple[np.ndarray, float]:
    """Half axes (longer first) and the longer one's angle, of the ellipse with a probability."""
    c = pixel_covariances(covariance, 1, "covariance")
    axes, angle = np.empty(2), np.empty(1)
    call(lib.ptzcal_ellipse, address_of_optional(c), probability, address_of(axes), address_of(angle))
    return axes, float(angle[0])


class Pointing(Handle):
    """A fixed camera and a rig. Say where the targets are: set_plane, set_cloud or set_distance."""

    _free = "ptzcal_pointing_free"

    def __init__(self, calibration: Calibration, model: RigModel) -> None:
        self._make(lib.ptzcal_pointing_new, calibration._pointer, byref(model._struct))

    @classmethod
    def of_adjusted(cls, adjusted: Adjusted, camera: int = 0, station: int = 0) -> "Pointing":
        """With all that camera and rig have in common."""
        pointing = cls.__new__(cls)
        pointing._make(lib.ptzcal_pointing_new_adjusted, adjusted._pointer, camera, station)
        return pointing

    def set_rig_covariance(self, covariance: Any) -> None:
        """(15, 15), in the order of RigParameter."""
        c = numbers(covariance, "covariance")
        if c.shape != (15, 15):
            raise ValueError(f"covariance must be of shape (15, 15), not {c.shape}")
        call(lib.ptzcal_pointing_set_rig_covariance, self._pointer, address_of(c))

    def set_station(self, R: Any, t: Any, covariance: Any = None) -> None:
        """Where the rig stands: X_world = R X_station + t, with the covariance (6, 6) of w in
        R <- exp([w]x) R and of t; None: exact."""
        R, t = numbers(R, "R"), vector(t, 3, "t")
        if R.shape != (3, 3):
            raise ValueError(f"R must be of shape (3, 3), not {R.shape}")
        if covariance is not None:
            covariance = numbers(covariance, "covariance")
            if covariance.shape != (6, 6):
                raise ValueError(f"covariance must be of shape (6, 6), not {covariance.shape}")
        pose = _native.initial(_structs.ptzcal_pose)
        pose.rotation[:], pose.translation[:] = R.ravel(), t
        c = address_of_optional(covariance)
        call(lib.ptzcal_pointing_set_station, self._pointer, byref(pose), c)

    def set_zoom_curve(self, curve: ZoomCurve) -> None:
        """The head camera's lens over zoom: aims then have a zoom."""
        call(lib.ptzcal_pointing_set_zoom_curve, self._pointer, curve._pointer)

    def set_head_deviation(self, pan: float, tilt: float) -> None:
        """Standard deviations of where the head comes to rest, radians."""
        call(lib.ptzcal_pointing_set_head_deviation, self._pointer, pan, tilt)

    def set_reach(self, pan: Tuple[float, float], tilt: Tuple[float, float]) -> None:
        call(lib.ptzcal_pointing_set_reach, self._pointer, *pan, *tilt)

    def set_plane(
        self,
        normal: Any,
        distance: float,
        covariance: Any = None,
        measured_by: MeasuredBy = MeasuredBy.OTHERS,
    ) -> None:
        """normal (3,) . X = distance; covariance (4, 4) of the unit normal and the distance."""
        normal = vector(normal, 3, "normal")
        if covariance is not None:
            covariance = numbers(covariance, "covariance")
            if covariance.shape != (4, 4):
                raise ValueError(f"covariance must be of shape (4, 4), not {covariance.shape}")
        c = address_of_optional(covariance)
        n = address_of(normal)
        call(lib.ptzcal_pointing_set_plane, self._pointer, n, distance, c, int(measured_by))

    def set_cloud(
        self, xyz: Any, covariances: Any = None, measured_by: MeasuredBy = MeasuredBy.OTHERS
    ) -> None:
        """Points (n, 3) with covariances (n, 3, 3), or noise estimated from their scatter."""
        xyz = rows(xyz, 3, "xyz")
        if covariances is not None:
            covariances = numbers(covariances, "covariances")
            if covariances.shape != (len(xyz), 3, 3):
                raise ValueError(f"covariances must be of shape ({len(xyz)}, 3, 3)")
        c, n = address_of_optional(covariances), len(xyz)
        call(lib.ptzcal_pointing_set_cloud, self._pointer, address_of(xyz), c, n, int(measured_by))

    def set_distance(self, metres: float, sigma: float = 0.0) -> None:
        call(lib.ptzcal_pointing_set_distance, self._pointer, metres, sigma)

    def aim(
        self, uv: Any, sigma: float = 0.0, probability: float = 0.95, target_size: float = 0.0
    ) -> Aim:
        """Where to turn the head for a pixel of the fixed camera, known to sigma pixels."""
        uv, c = _click(uv, sigma)
        s = _native.initial(_structs.ptzcal_aim)
        arguments = (address_of(uv), address_of(c), probability, target_size, byref(s))
        call(lib.ptzcal_pointing_aim, self._pointer, *arguments)
        return Aim(
            s.pan,
            s.tilt,
            _symmetric(s.angle_covariance),
            s.zoom if s.has_zoom else None,
            s.probability,
            np.array(s.uv),
            _symmetric(s.uv_covariance),
            np.array(s.point),
            np.array(s.point_covariance).reshape(3, 3),
            s.distance,
            bool(s.edge),
            s.other_distance or None,
        )

    def locate(
        self, pan: float, tilt: float, uv: Any, sigma: float = 0.0, zoom: float = 0.0
    ) -> Located:
        """Where the fixed camera sees what the head camera sees at a pixel."""
        uv, c = _click(uv, sigma)
        s = _native.initial(_structs.ptzcal_located)
        arguments = (pan, tilt, zoom, address_of(uv), address_of(c), byref(s))
        call(lib.ptzcal_pointing_locate, self._pointer, *arguments)
        return Located(
            np.array(s.uv),
            _symmetric(s.uv_covariance),
            np.array(s.point),
            np.array(s.point_covariance).reshape(3, 3),
            s.distance,
            bool(s.edge),
            bool(s.hidden),
        )

    def locate_along(
        self,
        pan: float,
        tilt: float,
        uv: Any,
        nearest: float,
        farthest: float = math.inf,
        sigma: float = 0.0,
        zoom: float = 0.0,
    ) -> LocatedAlong:
        """Where the fixed camera can see what the head camera sees at a pixel, its depth unknown."""
        uv, c = _click(uv, sigma)
        pixel = (pan, tilt, zoom, address_of(uv), address_of(c), nearest, farthest)
        along = _copied(lib.ptzcal_pointing_copy_located_along, self._pointer, 6, *pixel)
        return LocatedAlong(along[:, 0], along[:, 1:3], along[:, [3, 4, 4, 5]].reshape(-1, 2, 2))

    def sweep(
        self,
        uv: Any,
        nearest: float,
        farthest: float = math.inf,
        sigma: float = 0.0,
        probability: float = 0.95,
        target_size: float = 0.0,
    ) -> Sweep:
        """What to do about a pixel whose depth is unknown, but for its range (metres)."""
        uv, c = _click(uv, sigma)
        arguments = (address_of(uv), address_of(c), nearest, farthest, probability, target_size)
        made = _Sweep(self._pointer, *arguments)
        s = _native.initial(_structs.ptzcal_sweep_summary)
        call(lib.ptzcal_sweep_get_summary, made._pointer, byref(s))
        curve = _copied(lib.ptzcal_sweep_copy_curve, made._pointer, 6)[:, :3]
        steps = _copied(lib.ptzcal_sweep_copy_steps, made._pointer, 2)
        middle = (s.middle_pan, s.middle_tilt)
        return Sweep(curve, steps, middle, s.zoom if s.has_zoom else None, s.probability)


class _Sweep(Handle):
    _free = "ptzcal_sweep_free"

    def __init__(self, *arguments: Any) -> None:
        self._make(lib.ptzcal_pointing_sweep, *arguments)


def _click(uv: Any, sigma: float) -> Tuple[np.ndarray, np.ndarray]:
    return vector(uv, 2, "uv"), np.array([sigma * sigma, 0.0, sigma * sigma])


def _copied(function: Any, pointer: Any, columns: int, *arguments: Any) -> np.ndarray:
    needed = c_size_t()
    try:
        call(function, pointer, *arguments, None, 0, byref(needed))
    except Error as error:
        if error.status != Status.BUFFER_TOO_SMALL:
            raise
    out = np.empty(needed.value)
    call(function, pointer, *arguments, address_of(out), len(out), byref(needed))
    return out.reshape(-1, columns)
