"""Joint adjustment of a rig with the fixed cameras that watched it."""

from __future__ import annotations

import enum
from ctypes import byref, c_size_t, c_uint32
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Optional, Sequence, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import (
    address_of,
    address_of_optional,
    contiguous,
    numbers,
    pixel_covariances,
    rows,
    unsigned,
    vector,
)
from ._native import NO_CAMERA, NO_PLANE, Handle, call, lib
from .calibrate import Calibration, chosen_options
from .camera import Camera, DistortionModel
from .cancel import Cancel, pointer_of
from .errors import Error, Status
from .pose import Pose
from .rig_model import RigModel
from .scan import Scan


class RigParameter(enum.IntEnum):
    """A rig's parameters, in the order of vectors and covariances; the names are RigModel's."""

    LASER_X0 = 0  #: metres
    LASER_Y0 = 1
    LASER_VX = 2  #: slopes
    LASER_VY = 3
    HEAD_FOCAL = 4  #: ln of the head camera's focal length: deviations are relative
    HEAD_CX = 5  #: pixels
    HEAD_CY = 6
    AXIS_TILT_Y = 7  #: metres
    AXIS_TILT_Z = 8
    AXIS_PAN_X = 9
    AXIS_PAN_Z = 10
    PAN_ZERO = 11  #: radians; turns the world of a single station
    PAN_SCALE = 12
    TILT_ZERO = 13
    TILT_SCALE = 14


@dataclass(frozen=True)
class Suspect:
    """A group of parameters that was fixed, and should perhaps not have been."""

    name: str
    parameters: int
    gain: float  #: by how much chi2 would fall if it were free
    probability: float  #: of such a gain when it is rightly fixed


class Adjustment(Handle):
    """A survey: one rig at one or several stations, and the fixed cameras that watched it.

    Priors are standard deviations or covariances about given values: 0 fixes a parameter, inf
    frees it. Stations, cameras and shots count from 0 in the order of adding. What is refused
    leaves the survey as it was.
    """

    _free = "ptzcal_adjustment_free"

    def __init__(self, model: RigModel) -> None:
        """A survey with a rig as it is believed to be: known exactly until a prior is set."""
        self._make(lib.ptzcal_adjustment_new, byref(model._struct))

    def set_rig_sigmas(
        self,
        *,
        laser_x0: float = 0.0,
        laser_y0: float = 0.0,
        laser_vx: float = 0.0,
        laser_vy: float = 0.0,
        head_focal: float = 0.0,
        head_cx: float = 0.0,
        head_cy: float = 0.0,
        axis_tilt_y: float = 0.0,
        axis_tilt_z: float = 0.0,
        axis_pan_x: float = 0.0,
        axis_pan_z: float = 0.0,
        pan_zero: float = 0.0,
        pan_scale: float = 0.0,
        tilt_zero: float = 0.0,
        tilt_scale: float = 0.0,
    ) -> None:
        """Says how well each parameter of the rig is known; those not named are fixed.

        Units as in RigModel; head_focal is relative.
        """
        given = locals()
        sigmas = np.array([given[p.name.lower()] for p in RigParameter], dtype=np.float64)
        call(lib.ptzcal_adjustment_set_rig_sigmas, self._pointer, address_of(sigmas))

    def set_rig_covariance(self, covariance: Any) -> None:
        """Says how well the rig is known: (15, 15) in the order of RigParameter."""
        array = _square(covariance, len(RigParameter), "covariance")
        call(lib.ptzcal_adjustment_set_rig_covariance, self._pointer, address_of(array))

    def add_station(self, R: Any = None, t: Any = None, covariance: Any = None) -> int:
        """Adds a place where the rig stood, X_world = R X_station + t; returns its index.

        Without R and t nothing is known of it: it is found through the cameras that it shares with
        other stations. covariance (6, 6): of w in R <- exp([w]x) R, then of t, as in Pose; exact
        without. The first station is usually the world: add_station(np.eye(3), np.zeros(3)).
        """
        if (R is None) != (t is None):
            raise ValueError("a station has both R and t, or neither")
        pose = None
        if R is not None:
            pose = _native.initial(_structs.ptzcal_pose)
            pose.rotation = tuple(_square(R, 3, "R").ravel())
            pose.translation = tuple(vector(t, 3, "t"))
        of_pose = None if covariance is None else _square(covariance, 6, "covariance")
        return self._add(
            lib.ptzcal_adjustment_add_station,
            None if pose is None else byref(pose),
            address_of_optional(of_pose),
        )

    def add_camera(
        self,
        width: int,
        height: int,
        *,
        distortion: Union[DistortionModel, str, int, None] = None,
        lens: Optional[Camera] = None,
        skew_sigma: Optional[float] = None,
        aspect_sigma: Optional[float] = None,
    ) -> int:
        """Adds a fixed camera; returns its index. Settings as in calibrate_camera."""
        size = unsigned(width, "width"), unsigned(height, "height")
        options = chosen_options(
            distortion=distortion, lens=lens, skew_sigma=skew_sigma, aspect_sigma=aspect_sigma
        )
        chosen = None if options is None else options._pointer
        return self._add(lib.ptzcal_adjustment_add_camera, *size, chosen)

    def add_calibrated_camera(self, calibration: Calibration) -> int:
        """Adds a fixed camera with an earlier calibration as its prior; returns its index.

        The measurements behind it must not be added again.
        """
        return self._add(lib.ptzcal_adjustment_add_calibrated_camera, calibration._pointer)

    def add_known_camera(self, camera: Camera, sigmas: Any) -> int:
        """Adds a fixed camera that is known to standard deviations; returns its index.

        sigmas (11 + coefficients of the lens,): in the order of Calibration.parameters.
        """
        array = numbers(sigmas, "sigmas").ravel()
        return self._add(
            lib.ptzcal_adjustment_add_known_camera,
            byref(camera._struct),
            address_of(array),
            array.size,
        )

    def add_shots(
        self,
        station: int,
        pan_tilt: Any,
        spots: Any = None,
        *,
        spot_covariance: Any = None,
        seen: Any = None,
    ) -> range:
        """Adds shots: readings pan_tilt (n, 2), radians, and the head camera's spots (n, 2), pixels.

        Returns their indices. seen (n,): where False, the head camera saw nothing, and the spot
        does not matter. spot_covariance: (n, 3): xx, xy, yy, or (n, 2, 2), or (2, 2), px^2; 1 px
        without.
        """
        pan_tilt = rows(pan_tilt, 2, "pan_tilt")
        n = len(pan_tilt)
        spots = None if spots is None else rows(spots, 2, "spots", n)
        covariance = pixel_covariances(spot_covariance, n, "spot_covariance")
        flags = None
        if seen is not None:
            flags = np.ascontiguousarray(np.asarray(seen, dtype=bool).astype(np.uint8))
            if flags.shape != (n,):
                raise ValueError(f"seen must be of shape ({n},), not {flags.shape}")
        return self._added(
            n,
            lib.ptzcal_adjustment_add_shots,
            unsigned(station, "station"),
            address_of(pan_tilt),
            address_of_optional(spots),
            address_of_optional(covariance),
            address_of_optional(flags),
            n,
        )

    def add_sightings(
        self, camera: int, shots: Any, uv: Any, *, uv_covariance: Any = None
    ) -> None:
        """Adds where a fixed camera saw shots, by their indices (n,): uv (n, 2), pixels.

        uv_covariance as in add_shots.
        """
        uv = rows(uv, 2, "uv")
        n = len(uv)
        indices = np.asarray(shots)
        if indices.shape != (n,) or (n and indices.dtype.kind not in "iu"):
            raise ValueError(f"shots must be {n} indices, not {indices.dtype} {indices.shape}")
        if n and indices.min() < 0:
            raise ValueError("shots must not be negative")
        indices = contiguous(indices, np.uintp)
        covariance = pixel_covariances(uv_covariance, n, "uv_covariance")
        call(
            lib.ptzcal_adjustment_add_sightings,
            self._pointer,
            unsigned(camera, "camera"),
            address_of(indices),
            address_of(uv),
            address_of_optional(covariance),
            n,
        )

    def add_scan(
        self, scan: Scan, cameras: Sequence[Optional[int]], *, station: int = 0
    ) -> range:
        """Adds all shots of a scan with what head and fixed cameras saw; returns their indices.

        cameras: for each fixed camera of the scan its index here; None leaves its spots out.
        """
        chosen = [NO_CAMERA if c is None else unsigned(c, "cameras") for c in cameras]
        array = np.array(chosen, dtype=np.uint32)
        return self._added(
            len(scan),
            lib.ptzcal_adjustment_add_scan,
            unsigned(station, "station"),
            scan._pointer,
            address_of(array),
            array.size,
        )

    def add_plane(self, flatness: float = 0.002) -> int:
        """Adds a plane of the scene, whose place is found, and returns its index.

        flatness: how far its surface strays from it, standard deviation, metres.
        """
        return self._add(lib.ptzcal_adjustment_add_plane, flatness)

    def set_planes(self, first: int, planes: Sequence[Optional[int]]) -> None:
        """Says which plane each shot from `first` on hit; None: none."""
        chosen = [NO_PLANE if p is None else unsigned(p, "planes") for p in planes]
        array = np.array(chosen, dtype=np.uint32)
        call(
            lib.ptzcal_adjustment_set_planes,
            self._pointer,
            unsigned(first, "first", 64),
            address_of(array),
            array.size,
        )

    def solve(
        self,
        *,
        pointing_sigma: Tuple[float, float] = (0.0, 0.0),
        robust: Optional[bool] = None,
        huber: Optional[float] = None,
        max_focal_deviation: Optional[float] = None,
        max_station_deviation: Optional[float] = None,
        seed: Optional[int] = None,
        max_iterations: Optional[int] = None,
        cancel: Optional[Cancel] = None,
    ) -> "Adjusted":
        """Estimates everything that is free, with its covariance; sets gross outliers aside.

        What is None keeps the library's default. pointing_sigma: how far the head's true pan and
        tilt are from their readings, from shot to shot, radians. robust: set outliers aside (True).
        huber: longer residuals count linearly (3 standard deviations; inf: least squares).
        max_focal_deviation: greatest relative deviation of a focal length (0.1).
        max_station_deviation: greatest deviation of a free station's rotation, radians, and of its
        position as a share of its shots' median range (0.1).

        Raises Error TOO_FEW_POINTS and the like with the camera's index, DEGENERATE (the message
        says what trades off and what to add), BAD_STATE for a station that shares neither
        a camera nor three planes; Cancelled.
        """
        options = _native.initial(_structs.ptzcal_adjust_options)
        options.pointing_sigma_pan, options.pointing_sigma_tilt = pointing_sigma
        if robust is not None:
            options.robust = bool(robust)
        if huber is not None:
            options.huber = huber
        if max_focal_deviation is not None:
            options.max_focal_deviation = max_focal_deviation
        if max_station_deviation is not None:
            options.max_station_deviation = max_station_deviation
        if seed is not None:
            options.seed = unsigned(seed, "seed", 64)
        if max_iterations is not None:
            options.max_iterations = unsigned(max_iterations, "max_iterations")
        token = pointer_of(cancel)
        return Adjusted(lib.ptzcal_adjustment_solve, self._pointer, byref(options), token)

    def _add(self, function: Any, *arguments: Any) -> int:
        index = c_uint32()
        call(function, self._pointer, *arguments, byref(index))
        return index.value

    def _added(self, count: int, function: Any, *arguments: Any) -> range:
        first = c_size_t()
        call(function, self._pointer, *arguments, byref(first))
        return range(first.value, first.value + count)


class Adjusted(Handle):
    """A survey solved. Immutable; it holds its input."""

    _free = "ptzcal_adjusted_free"

    def __init__(self, function: Any, *arguments: Any) -> None:
        """Use Adjustment.solve."""
        self._make(function, *arguments)
        self._summary = _native.initial(_structs.ptzcal_adjusted_summary)
        call(lib.ptzcal_adjusted_get_summary, self._pointer, byref(self._summary))

    @cached_property
    def rig_model(self) -> RigModel:
        struct = _native.initial(_structs.ptzcal_rig_model)
        call(lib.ptzcal_adjusted_get_rig_model, self._pointer, byref(struct))
        return RigModel._from_struct(struct)

    @cached_property
    def calibrations(self) -> Tuple[Calibration, ...]:
        """Each camera; its covariance contains what is not known of rig and stations."""
        get = lib.ptzcal_adjusted_get_calibration
        count = self._summary.cameras
        return tuple(Calibration._made(get, self._pointer, i) for i in range(count))

    @cached_property
    def stations(self) -> Tuple[Pose, ...]:
        """Where the rig stood, X_world = R X_station + t, with covariances (6, 6)."""
        return tuple(self._station(i) for i in range(self._summary.stations))

    def _station(self, index: int) -> Pose:
        struct = _native.initial(_structs.ptzcal_pose)
        call(lib.ptzcal_adjusted_get_station, self._pointer, index, byref(struct))
        first = len(RigParameter) + 6 * index
        return Pose._from_struct(struct, self.covariance[first : first + 6, first : first + 6])

    @cached_property
    def parameters(self) -> Tuple[str, ...]:
        """Names of the parameters: the rig's, six of every station, then every camera's."""
        return self._texts(lib.ptzcal_adjusted_parameter_name, self._summary.parameters)

    @cached_property
    def covariance(self) -> np.ndarray:
        """(p, p) in the order of `parameters`; 0 where a parameter was fixed."""
        side = self._summary.parameters
        return self._copied(lib.ptzcal_adjusted_copy_covariance, np.empty((side, side)))

    @property
    def standard_deviations(self) -> np.ndarray:
        """(p,) in the order of `parameters`."""
        return np.sqrt(np.diagonal(self.covariance))

    @cached_property
    def warnings(self) -> Tuple[str, ...]:
        """What a person should know; empty when model and stated noise fit."""
        return self._texts(lib.ptzcal_adjusted_warning, self._summary.warnings)

    @cached_property
    def suspects(self) -> Tuple[Suspect, ...]:
        """Groups of fixed parameters that the data want to move, the most wanted first."""
        names = self._texts(lib.ptzcal_adjusted_suspect_name, self._summary.suspects)
        struct = _native.initial(_structs.ptzcal_suspect)
        found = []
        for index, name in enumerate(names):
            call(lib.ptzcal_adjusted_get_suspect, self._pointer, index, byref(struct))
            found.append(Suspect(name, struct.parameters, struct.gain, struct.probability))
        return tuple(found)

    @property
    def weakest(self) -> str:
        """What the data determine worst, and what to add."""
        return lib.ptzcal_adjusted_weakest(self._pointer).decode()

    @cached_property
    def prior_only(self) -> Tuple[str, ...]:
        """Parameters of which the data say next to nothing."""
        return self._texts(lib.ptzcal_adjusted_prior_only, self._summary.prior_only)

    @cached_property
    def head_inliers(self) -> np.ndarray:
        """Whose spot in the head camera was used, (shots,) bool."""
        flags = np.empty(self.shots, np.uint8)
        return self._copied(lib.ptzcal_adjusted_copy_head_inliers, flags).view(bool)

    @cached_property
    def planes(self) -> Tuple[Tuple[np.ndarray, np.ndarray], ...]:
        """Each plane normal . X = distance, (4,), in metres, with its covariance (4, 4)."""
        return tuple(self._plane(i) for i in range(self._summary.planes))

    def _plane(self, index: int) -> Tuple[np.ndarray, np.ndarray]:
        values, covariance = np.empty(4), np.empty((4, 4))
        places = address_of(values), address_of(covariance)
        call(lib.ptzcal_adjusted_get_plane, self._pointer, index, *places)
        return values, covariance

    @cached_property
    def plane_inliers(self) -> np.ndarray:
        """Which shots hit the plane they were said to hit, (shots,) bool."""
        flags = np.empty(self.shots, np.uint8)
        return self._copied(lib.ptzcal_adjusted_copy_plane_inliers, flags).view(bool)

    def shot_point(self, shot: int) -> Optional[Tuple[np.ndarray, np.ndarray]]:
        """Where a shot hit, by all who saw it: (3,) of the world, metres, and covariance (3, 3).

        None for a shot at infinity or one of which no spot was used.
        """
        xyz, covariance = np.empty(3), np.empty((3, 3))
        places = address_of(xyz), address_of(covariance)
        try:
            call(lib.ptzcal_adjusted_shot_point, self._pointer, unsigned(shot, "shot", 64), *places)
        except Error as error:
            if error.status != Status.UNREACHABLE:
                raise
            return None
        return xyz, covariance

    def measure(
        self, station: int, pan_tilt: Any, spots: Any, spot_covariance: Any = None
    ) -> Tuple[np.ndarray, np.ndarray]:
        """Measures new spots of the head camera: xyz (n, 3), metres, and covariances (n, 3, 3).

        Arguments as in RigModel.locate; the covariances contain those of rig and station.
        """
        pan_tilt = rows(pan_tilt, 2, "pan_tilt")
        n = len(pan_tilt)
        spots = rows(spots, 2, "spots", n)
        covariance = pixel_covariances(spot_covariance, n, "spot_covariance")
        xyz, xyz_covariance = np.empty((n, 3)), np.empty((n, 3, 3))
        call(
            lib.ptzcal_adjusted_measure,
            self._pointer,
            unsigned(station, "station"),
            address_of(pan_tilt),
            address_of(spots),
            address_of_optional(covariance),
            n,
            address_of(xyz),
            address_of(xyz_covariance),
        )
        return xyz, xyz_covariance

    def resolve(self, *, cancel: Optional[Cancel] = None) -> "Adjusted":
        """Solves the same survey again: the same bits."""
        return Adjusted(lib.ptzcal_adjusted_resolve, self._pointer, pointer_of(cancel))

    @property
    def shots(self) -> int:
        return self._summary.shots

    @property
    def spots(self) -> int:
        """Spots given, of the head camera and of the fixed ones."""
        return self._summary.spots

    @property
    def used(self) -> int:
        """Spots used; the others are outliers."""
        return self._summary.used

    @property
    def iterations(self) -> int:
        return self._summary.iterations

    @property
    def noise_factor(self) -> float:
        """Noise that the residuals' median shows over the stated one, at least 1."""
        return self._summary.noise_factor

    @property
    def chi2(self) -> float:
        """Sum of squared residuals in units of their standard deviations, priors included."""
        return self._summary.chi2

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom of chi2."""
        return self._summary.degrees_of_freedom

    @property
    def probability(self) -> float:
        """Chance of such residuals or larger when model and stated noise are right."""
        return self._summary.probability

    @property
    def condition(self) -> float:
        """Condition number of the normal equations, scaled to unit diagonal."""
        return self._summary.condition

    def _texts(self, function: Any, count: int) -> Tuple[str, ...]:
        return tuple(function(self._pointer, i).decode() for i in range(count))

    def _copied(self, copy: Any, array: np.ndarray) -> np.ndarray:
        call(copy, self._pointer, address_of(array), array.size, None)
        array.flags.writeable = False
        return array

    def __repr__(self) -> str:
        return (
            f"<ptzcal.Adjusted: {self._summary.stations} stations, {self._summary.cameras} cameras, "
            f"{self.used} of {self.spots} spots used, {len(self.warnings)} warnings>"
        )


def _square(value: Any, side: int, name: str) -> np.ndarray:
    array = numbers(value, name)
    if array.shape != (side, side):
        raise ValueError(f"{name} must be of shape ({side}, {side}), not {array.shape}")
    return array
