"""The pose of one station of a rig in another's frame, from the roof edges that both measured."""

from __future__ import annotations

import enum
import math
from ctypes import byref, c_uint32
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from . import _native, _structs
from ._arrays import (
    address_of,
    address_of_optional,
    member,
    numbers,
    pixel_covariances,
    rows,
    unsigned,
    vector,
)
from ._native import Handle, call, lib
from .rig_model import RigModel
from .scan import Region, Scan


class PoseMethod(enum.IntEnum):
    ROOF_EDGE_PROCRUSTES = 0  #: rigid Procrustes on points of the edges
    PLANE_TO_PLANE = 1  #: closed form on the planes; more accurate
    MAXIMUM_LIKELIHOOD = 2  #: planes weighted by their covariances; the most accurate


@dataclass(frozen=True, eq=False)
class Pose:
    """Station b in station a's frame: X_a = R X_b + t; radians, metres."""

    R: np.ndarray
    t: np.ndarray  #: the position of b in a's frame
    rotation_angle: float
    residual_rms: float  #: metres, between the two stations' points on the edges
    disagreement: float
    condition: float
    #: (6, 6): of w in R <- exp([w]x) R, then of t; None when there is none (a simulator's truth).
    covariance: Optional[np.ndarray] = None

    @classmethod
    def _from_struct(
        cls, s: _structs.ptzcal_pose, covariance: Optional[np.ndarray] = None
    ) -> "Pose":
        return cls(
            np.array(s.rotation).reshape(3, 3),
            np.array(s.translation),
            s.rotation_angle,
            s.residual_rms,
            s.disagreement,
            s.condition,
            covariance,
        )

    def transform(self, xyz: Any) -> np.ndarray:
        """Points (n, 3) or (3,) of b's frame in a's frame."""
        return numbers(xyz, "xyz") @ self.R.T + self.t


class RoofEdges(Handle):
    """The planes of one station, and its edges as pairs of planes.

    Two stations list the same edges in the same order, with their planes in the same order.
    """

    _free = "ptzcal_roof_edges_free"

    def __init__(self) -> None:
        self._make(lib.ptzcal_roof_edges_new)

    def add_plane_shots(
        self, model: RigModel, pan_tilt: Any, spots: Any, spot_covariance: Any = None
    ) -> int:
        """Adds a plane fitted to laser shots (as in RigModel.locate); returns its number."""
        pan_tilt = rows(pan_tilt, 2, "pan_tilt")
        n = len(pan_tilt)
        spots = rows(spots, 2, "spots", n)
        covariance = pixel_covariances(spot_covariance, n, "spot_covariance")
        return self._plane(
            lib.ptzcal_roof_edges_add_plane_shots,
            byref(model._struct),
            address_of(pan_tilt),
            address_of(spots),
            address_of_optional(covariance),
            n,
        )

    def add_plane_points(self, xyz: Any, sigma: float = 0.0) -> int:
        """Adds a plane fitted to points (n, 3), metres, of standard deviation sigma (estimated)."""
        xyz = rows(xyz, 3, "xyz")
        return self._plane(lib.ptzcal_roof_edges_add_plane_points, address_of(xyz), len(xyz), sigma)

    def add_plane(self, normal: Any, distance: float, covariance: Any = None) -> int:
        """Adds a known plane: normal (3,) . X = distance, metres.

        covariance: (3, 3), of normal / distance, 1 / m^2; exact without.
        """
        normal = vector(normal, 3, "normal")
        if covariance is not None:
            covariance = numbers(covariance, "covariance")
            if covariance.shape != (3, 3):
                raise ValueError(f"covariance must be of shape (3, 3), not {covariance.shape}")
        return self._plane(
            lib.ptzcal_roof_edges_add_plane,
            address_of(normal),
            distance,
            address_of_optional(covariance),
        )

    def add_plane_scan(self, scan: Scan, region: Optional[Region] = None) -> int:
        """Adds a plane fitted to a scan's shots, within the readings of `region` or all."""
        within = None if region is None else byref(region._struct())
        return self._plane(lib.ptzcal_roof_edges_add_plane_scan, scan._pointer, within)

    def add_edge(self, first: int, second: int) -> None:
        """Adds the edge where two planes, by their numbers, meet."""
        planes = unsigned(first, "first"), unsigned(second, "second")
        call(lib.ptzcal_roof_edges_add_edge, self._pointer, *planes)

    def _plane(self, function: Any, *arguments: Any) -> int:
        number = c_uint32()
        call(function, self._pointer, *arguments, byref(number))
        return number.value


class _Options(Handle):
    _free = "ptzcal_pose_options_free"

    def __init__(self) -> None:
        self._make(lib.ptzcal_pose_options_new)


class _Estimate(Handle):
    _free = "ptzcal_pose_estimate_free"

    def __init__(self, a: RoofEdges, b: RoofEdges, options: _Options) -> None:
        self._make(lib.ptzcal_estimate_pose_roof_edges, a._pointer, b._pointer, options._pointer)


def estimate_pose_roof_edges(
    station_a: RoofEdges,
    station_b: RoofEdges,
    *,
    method: Union[PoseMethod, str, int] = PoseMethod.ROOF_EDGE_PROCRUSTES,
    lever: float = 0.0,
    min_plane_angle: float = math.radians(5),
    min_edge_angle: float = math.radians(5),
) -> Pose:
    """The pose of station b in station a's frame.

    lever: how far along an edge its second point lies, metres (Procrustes only; 0: the edges' mean
    distance). Planes and edges must be at least the angles apart, radians.

    Raises InvalidArgument for stations that do not fit, Error DEGENERATE for parallel planes or
    edges.
    """
    options = _Options()
    call(
        lib.ptzcal_pose_options_set_method,
        options._pointer,
        member(PoseMethod, method, "method"),
    )
    call(lib.ptzcal_pose_options_set_lever, options._pointer, lever)
    call(lib.ptzcal_pose_options_set_min_angles, options._pointer, min_plane_angle, min_edge_angle)
    estimate = _Estimate(station_a, station_b, options)
    struct, covariance = _native.initial(_structs.ptzcal_pose), np.empty((6, 6))
    call(lib.ptzcal_pose_estimate_get, estimate._pointer, byref(struct))
    call(
        lib.ptzcal_pose_estimate_copy_covariance,
        estimate._pointer,
        address_of(covariance),
        covariance.size,
        None,
    )
    return Pose._from_struct(struct, covariance)
