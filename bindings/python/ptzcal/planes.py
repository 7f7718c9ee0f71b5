"""The planes that a station sees, and the pose between two stations from them alone."""

from __future__ import annotations

import contextlib
import math
from ctypes import byref, c_double, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass
from typing import Any, Iterator, Optional, Tuple, Type

import numpy as np

from . import _native, _structs
from ._arrays import address_of, address_of_optional, contiguous, numbers, pixel_covariances, rows, unsigned
from ._native import Handle, call, lib
from .camera import Camera
from .errors import Error, SpotAmbiguous, SpotNotFound
from .pictures import DepthMap
from .pose import RoofEdges
from .rig_model import RigModel
from .scan import Scan


class PlanesNotFound(Error):
    """The measurements show no plane."""


class StationsNotMatched(Error):
    """The stations share too few planes."""


class StationsAmbiguous(Error):
    """Another pose fits as well, or nothing confirms the only one: there is never a guess."""


@contextlib.contextmanager
def _not_found_is(kind: Type[Error]) -> Iterator[None]:
    try:
        yield
    except SpotNotFound as e:
        raise kind(e.status, e.message, e.index, e.hint) from None
    except SpotAmbiguous as e:
        raise StationsAmbiguous(e.status, e.message, e.index, e.hint) from None


@dataclass(frozen=True, eq=False)
class Plane:
    """One plane n . X = 1 of a station, metres."""

    n: np.ndarray  #: unit normal, away from the station, over the distance
    covariance: np.ndarray  #: (3, 3), of n
    centre: np.ndarray  #: middle of its measurements, on the plane
    axes: np.ndarray  #: (2, 3): unit vectors in the plane
    extent: np.ndarray  #: (2, 2): from where to where it was measured along the axes
    area: float  #: covered by measurements, m^2
    rms: float  #: of its measurements' distances from it
    noise_factor: float  #: about 1 when the stated noise was right
    count: int  #: measurements that belong to it

    @property
    def normal(self) -> np.ndarray:
        return self.n / np.linalg.norm(self.n)

    @property
    def distance(self) -> float:
        return 1.0 / float(np.linalg.norm(self.n))


class Planes(Handle):
    """The planes of one station, in its frame: find or fit them by the class methods."""

    _free = "ptzcal_planes_free"

    @classmethod
    def find(
        cls, xyz: Any, sigma: float = 0.0, *, along_rays: bool = False, **options: Any
    ) -> "Planes":
        """Finds the planes in points (n, 3), metres; those that are not finite are passed over.

        sigma: their standard deviation in each direction; estimated without. along_rays: it is that of
        their ranges only, as a scanner's is: slanted walls are known better then. Options: threshold
        (standard deviations), flatness (of real surfaces, and systematic errors, metres), min_share
        (of the measurements), min_points, max_planes, min_range, max_range (metres), seed.

        Raises PlanesNotFound; Error TOO_FEW_POINTS, DEGENERATE.
        """
        xyz = rows(xyz, 3, "xyz")
        function = lib.ptzcal_planes_find_ranges if along_rays else lib.ptzcal_planes_find_points
        return cls._new(function, address_of(xyz), len(xyz), sigma, _options(options))

    @classmethod
    def find_shots(
        cls, model: RigModel, pan_tilt: Any, spots: Any, spot_covariance: Any = None, **options: Any
    ) -> "Planes":
        """Finds the planes in laser shots (as in RigModel.locate)."""
        shots, _arrays = _shots(model, pan_tilt, spots, spot_covariance)
        return cls._new(lib.ptzcal_planes_find_shots, *shots, _options(options))

    @classmethod
    def find_scan(cls, scan: Scan, **options: Any) -> "Planes":
        """Finds the planes that a scan shows, in the rig's frame. Labels are those of its shots."""
        return cls._new(lib.ptzcal_planes_find_scan, scan._pointer, _options(options))

    @classmethod
    def find_depths(
        cls,
        depths: DepthMap,
        camera: Camera,
        inverse_depth_sigma: float = 0.001425,
        depth_sigma: float = 0.001,
        **options: Any,
    ) -> "Planes":
        """Finds the planes in a depth image, in the camera's frame. Labels are those of its pixels.

        inverse_depth_sigma: 1/m, for cameras that triangulate; depth_sigma: metres, besides.
        """
        sigmas = inverse_depth_sigma, depth_sigma
        arguments = depths._pointer, byref(camera._struct), *sigmas, _options(options)
        return cls._new(lib.ptzcal_planes_find_depths, *arguments)

    @classmethod
    def fit(cls, xyz: Any, regions: Any, sigma: float = 0.0, **options: Any) -> "Planes":
        """Fits a plane to each region of points (n, 3).

        regions: (n,) numbers them, -1 is none; or boxes (m, 2, 3), the least and the greatest corner of
        each, metres.
        """
        xyz = rows(xyz, 3, "xyz")
        arguments = address_of(xyz), len(xyz), sigma
        boxes = _boxes(regions)
        region, count = _regions(regions, len(xyz)) if boxes is None else (boxes, len(boxes))
        function = lib.ptzcal_planes_fit_points if boxes is None else lib.ptzcal_planes_fit_points_in_boxes
        return cls._new(function, *arguments, address_of(region), count, _options(options))

    @classmethod
    def fit_shots(
        cls,
        model: RigModel,
        pan_tilt: Any,
        spots: Any,
        regions: Any,
        spot_covariance: Any = None,
        **options: Any,
    ) -> "Planes":
        """Fits a plane to each region of laser shots: numbers or boxes as in fit, in the rig's frame."""
        shots, _arrays = _shots(model, pan_tilt, spots, spot_covariance)
        boxes = _boxes(regions)
        region, count = _regions(regions, shots[-1]) if boxes is None else (boxes, len(boxes))
        function = lib.ptzcal_planes_fit_shots if boxes is None else lib.ptzcal_planes_fit_shots_in_boxes
        return cls._new(function, *shots, address_of(region), count, _options(options))

    @classmethod
    def fit_scan(cls, scan: Scan, regions: Any, **options: Any) -> "Planes":
        """Fits a plane to each region of a scan.

        regions: (m, 4), the least and greatest pan, the least and greatest tilt of each, radians; or
        boxes (m, 2, 3) as in fit, in the rig's frame.
        """
        boxes = _boxes(regions)
        region = rows(regions, 4, "regions") if boxes is None else boxes
        function = lib.ptzcal_planes_fit_scan if boxes is None else lib.ptzcal_planes_fit_scan_in_boxes
        arguments = scan._pointer, address_of(region), len(region)
        return cls._new(function, *arguments, _options(options))

    @classmethod
    def _new(cls, function: Any, *arguments: Any) -> "Planes":
        planes = cls.__new__(cls)
        with _not_found_is(PlanesNotFound):
            planes._make(function, *arguments)
        return planes

    def __len__(self) -> int:
        count = c_uint32()
        call(lib.ptzcal_planes_count, self._pointer, byref(count))
        return count.value

    def __getitem__(self, index: int) -> Plane:
        count = len(self)
        if not -count <= index < count:
            raise IndexError(f"plane {index} of {count}")
        s = _native.initial(_structs.ptzcal_plane)
        call(lib.ptzcal_planes_get, self._pointer, unsigned(index % count, "index"), byref(s))
        return Plane(
            np.array(s.n),
            np.array(s.covariance).reshape(3, 3),
            np.array(s.centre),
            np.array(s.axes).reshape(2, 3),
            np.array(s.extent).reshape(2, 2),
            s.area,
            s.rms,
            s.noise_factor,
            s.count,
        )

    def __iter__(self) -> Iterator[Plane]:
        return (self[i] for i in range(len(self)))

    @property
    def labels(self) -> np.ndarray:
        """(n,) int32: the plane of each measurement that was handed in, -1 for none."""
        needed = c_size_t()
        lib.ptzcal_planes_copy_labels(self._pointer, None, 0, byref(needed), None)
        labels = np.empty(needed.value, np.int32)
        call(lib.ptzcal_planes_copy_labels, self._pointer, address_of(labels), labels.size, None)
        return labels

    @property
    def sigma(self) -> float:
        """Standard deviation of the points, as stated or estimated; 0 for shots and depths."""
        sigma = c_double()
        call(lib.ptzcal_planes_sigma, self._pointer, byref(sigma))
        return sigma.value


def _options(given: dict) -> Any:
    return byref(planes_options(given))


def planes_options(given: dict) -> _structs.ptzcal_planes_options:
    options = _native.initial(_structs.ptzcal_planes_options)
    bits = {"min_points": 32, "max_planes": 32, "seed": 64}
    known = {name for name, _ in options._fields_} - {"struct_size", "reserved"}
    for name, value in given.items():
        if name not in known:
            raise TypeError(f"there is no option {name!r}: {', '.join(sorted(known))}")
        setattr(options, name, unsigned(value, name, bits[name]) if name in bits else float(value))
    return options


def _shots(model: RigModel, pan_tilt: Any, spots: Any, covariance: Any) -> Tuple[tuple, tuple]:
    """The arguments of shots, and the arrays that they point to."""
    pan_tilt = rows(pan_tilt, 2, "pan_tilt")
    n = len(pan_tilt)
    spots = rows(spots, 2, "spots", n)
    covariance = pixel_covariances(covariance, n, "spot_covariance")
    pointers = address_of(pan_tilt), address_of(spots), address_of_optional(covariance)
    return (byref(model._struct), *pointers, n), (pan_tilt, spots, covariance)


def _boxes(regions: Any) -> Optional[np.ndarray]:
    """Regions (m, 2, 3) as boxes; None for what is not of three dimensions."""
    if np.ndim(regions) != 3:
        return None
    if np.shape(regions)[1:] != (2, 3):
        raise ValueError(f"boxes must be of shape (m, 2, 3), not {np.shape(regions)}")
    return numbers(regions, "regions")


def _regions(regions: Any, n: int) -> Tuple[np.ndarray, int]:
    array = np.asarray(regions)
    if array.dtype.kind not in "iu" or array.shape != (n,):
        raise ValueError(f"regions must be {n} whole numbers, not {array.dtype} {array.shape}")
    array = contiguous(array, np.int32)
    return array, int(max(array.max(initial=-1), -1)) + 1


@dataclass(frozen=True, eq=False)
class StationPose:
    """Station b in station a's frame: X_a = R X_b + t; radians, metres."""

    R: np.ndarray
    t: np.ndarray  #: the position of b in a's frame
    covariance: np.ndarray  #: (6, 6): of w in R <- exp([w]x) R, then of t
    matches: np.ndarray  #: (m, 2): the planes that are the same, in a and in b
    chi2: float
    degrees_of_freedom: float
    condition: float
    agreement: float  #: of the places that both saw, the share where both saw a surface
    runner_up: float  #: the score of the best other pose, relative to this one's

    @property
    def rotation_angle(self) -> float:
        return math.acos(min(1.0, max(-1.0, (float(np.trace(self.R)) - 1.0) / 2.0)))

    def transform(self, xyz: Any) -> np.ndarray:
        """Points (n, 3) or (3,) of b's frame in a's frame."""
        return numbers(xyz, "xyz") @ self.R.T + self.t


class Registration(Handle):
    _free = "ptzcal_registration_free"

    def __init__(self, function: Any, *arguments: Any) -> None:
        with _not_found_is(StationsNotMatched):
            self._make(function, *arguments)

    def pose(self) -> StationPose:
        s = _native.initial(_structs.ptzcal_station_pose)
        call(lib.ptzcal_registration_get, self._pointer, byref(s))
        matches = np.empty((s.matches, 2), np.uint32)
        call(
            lib.ptzcal_registration_copy_matches,
            self._pointer,
            address_of(matches),
            matches.size,
            None,
        )
        return StationPose(
            np.array(s.rotation).reshape(3, 3),
            np.array(s.translation),
            np.array(s.covariance).reshape(6, 6),
            matches,
            s.chi2,
            s.degrees_of_freedom,
            s.condition,
            s.agreement,
            s.runner_up,
        )


def register_stations(
    station_a: Planes,
    station_b: Planes,
    *,
    prior: Optional[Tuple[Any, Any]] = None,
    prior_rotation_sigma: float = 0.3,
    prior_position_sigma: float = 0.5,
    max_angle: float = math.radians(4),
    max_distance: float = 0.1,
    min_agreement: float = 0.93,
    max_runner_up: float = 0.93,
) -> StationPose:
    """The pose of station b in station a's frame from the planes that both saw; no guess is needed.

    prior: a rough pose (R, t), off by the sigmas (radians, metres). Planes that differ by no more than
    max_angle and max_distance are the same.

    Raises StationsNotMatched; StationsAmbiguous (an empty room, turned by half a turn, looks like
    itself); Error DEGENERATE for planes that leave a part of the pose free, and says which.
    """
    options = _native.initial(_structs.ptzcal_station_options)
    options.max_angle, options.max_distance = max_angle, max_distance
    options.min_agreement, options.max_runner_up = min_agreement, max_runner_up
    options.prior_rotation_sigma = prior_rotation_sigma
    options.prior_position_sigma = prior_position_sigma
    if prior is not None:
        rotation, translation = (numbers(p, "prior") for p in prior)
        if rotation.shape != (3, 3) or translation.shape != (3,):
            raise ValueError("prior must be R of shape (3, 3) and t of shape (3,)")
        options.has_prior = 1
        options.prior_rotation[:] = rotation.ravel()
        options.prior_translation[:] = translation
    stations = station_a._pointer, station_b._pointer
    return Registration(lib.ptzcal_register_stations, *stations, byref(options)).pose()


def register_matched_planes(station_a: Planes, station_b: Planes, pairs: Any) -> StationPose:
    """The pose from planes known to be the same: pairs (n, 2) of their numbers in a and in b."""
    return _matched(station_a, station_b, pairs).pose()


def common_roof_edges(
    station_a: Planes, station_b: Planes, pairs: Any, min_angle: float = math.radians(20)
) -> Tuple[RoofEdges, RoofEdges]:
    """The same edges of both stations, where matched planes meet: for estimate_pose_roof_edges."""
    matched = _matched(station_a, station_b, pairs)
    edges = RoofEdges.__new__(RoofEdges), RoofEdges.__new__(RoofEdges)
    pointers = c_void_p(), c_void_p()
    call(
        lib.ptzcal_registration_roof_edges,
        matched._pointer,
        station_a._pointer,
        station_b._pointer,
        min_angle,
        byref(pointers[0]),
        byref(pointers[1]),
    )
    for handle, pointer in zip(edges, pointers):
        handle._pointer = pointer.value
    return edges


def _matched(station_a: Planes, station_b: Planes, pairs: Any) -> Registration:
    array = np.asarray(pairs)
    if array.dtype.kind not in "iu" or array.ndim != 2 or array.shape[1] != 2 or array.min(initial=0) < 0:
        raise ValueError(f"pairs must be whole numbers of shape (n, 2), not {array.dtype} {array.shape}")
    array = contiguous(array, np.uint32)
    stations = station_a._pointer, station_b._pointer
    function = lib.ptzcal_register_matched_planes
    return Registration(function, *stations, address_of(array), len(array))
