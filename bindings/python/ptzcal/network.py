"""Stations along a path, tied by the planes that they share."""

from __future__ import annotations

from ctypes import byref, c_size_t, pointer
from dataclasses import dataclass
from typing import Any, Callable, Mapping, Optional, Tuple

import numpy as np

from . import _callbacks, _native, _structs
from ._arrays import address_of
from ._native import Handle, call, lib
from .adjust import Adjustment
from .cancel import Cancel, pointer_of
from .errors import Status
from .planes import Registration, StationPose, planes_options

#: progress(done, total); a true result stops the work.
Progress = Callable[[int, int], Any]


@dataclass(frozen=True, eq=False)
class Link:
    """Two stations and what their planes say of them."""

    stations: Tuple[int, int]
    pose: Optional[StationPose]  #: of the second station in the first one's frame
    status: Status  #: OK, or why there is no pose
    reason: str  #: the same in words; "" when there is one


@dataclass(frozen=True)
class Loop:
    """A loop of links, and what is left when it is followed all the way around."""

    stations: Tuple[int, ...]  #: in order; the last is linked to the first
    rotation: float  #: radians
    position: float  #: metres
    probability: float  #: chance of that or more by the links' covariances


@dataclass(frozen=True, eq=False)
class Ties:
    """What ties the stations of a survey."""

    links: Tuple[Link, ...]  #: every pair that was tried
    loops: Tuple[Loop, ...]
    planes: int  #: added to the survey
    shots: int  #: said to hit one of them


class _Ties(Handle):
    _free = "ptzcal_ties_free"

    def read(self) -> Ties:
        summary = _native.initial(_structs.ptzcal_ties_summary)
        call(lib.ptzcal_ties_get_summary, self._pointer, byref(summary))
        links = tuple(self._link(i) for i in range(summary.links))
        loops = tuple(self._loop(i) for i in range(summary.loops))
        return Ties(links, loops, summary.planes, summary.shots)

    def _link(self, index: int) -> Link:
        s = _native.initial(_structs.ptzcal_link)
        call(lib.ptzcal_ties_get_link, self._pointer, index, byref(s))
        reason = lib.ptzcal_ties_link_reason(self._pointer, index).decode()
        linked = s.status == Status.OK
        get = lib.ptzcal_ties_get_registration
        pose = Registration(get, self._pointer, index).pose() if linked else None
        return Link((s.station_a, s.station_b), pose, Status(s.status), reason)

    def _loop(self, index: int) -> Loop:
        s = _native.initial(_structs.ptzcal_loop)
        call(lib.ptzcal_ties_get_loop, self._pointer, index, byref(s))
        stations, needed = np.empty(s.stations, np.uint32), c_size_t()
        place = address_of(stations), stations.size
        call(lib.ptzcal_ties_copy_loop, self._pointer, index, *place, byref(needed))
        return Loop(tuple(map(int, stations)), s.rotation, s.position, s.probability)


def tie_stations(
    survey: Adjustment,
    *,
    pairs: Any = None,
    planes: Optional[Mapping[str, Any]] = None,
    max_angle: Optional[float] = None,
    max_distance: Optional[float] = None,
    min_agreement: Optional[float] = None,
    max_runner_up: Optional[float] = None,
    min_closure: Optional[float] = None,
    progress: Optional[Progress] = None,
    cancel: Optional[Cancel] = None,
) -> Ties:
    """Finds the planes that the stations of a survey share, and adds them to it with the shots on them.

    Solving the survey then finds the stations, none of whose poses needs to be known; what is said of
    them (odometry) settles what planes alone leave ambiguous. What is None keeps the library's default.

    pairs: (n, 2) stations to register; all without. planes: options of Planes.find; their flatness is
    that of the survey's planes too. The limits are those of register_stations. min_closure: chance below
    which a loop of stations does not close (1e-6). progress: progress(done, total), a step for each
    station and each pair; a true result stops the work (Cancelled).

    Raises Error BAD_STATE for a station that nothing ties (the message has each pair's reason),
    AMBIGUOUS for a loop that does not close; Cancelled. The survey is then as it was.
    """
    options = _native.initial(_structs.ptzcal_tie_options)
    options.planes = pointer(planes_options(dict(planes or {})))
    stations = _native.initial(_structs.ptzcal_station_options)
    limits = dict(
        max_angle=max_angle,
        max_distance=max_distance,
        min_agreement=min_agreement,
        max_runner_up=max_runner_up,
    )
    for name, value in limits.items():
        if value is not None:
            setattr(stations, name, value)
    options.stations = pointer(stations)
    if pairs is not None:
        # The type of an empty list says nothing.
        array = np.asarray(pairs)
        array = array if array.size else np.empty((0, 2), np.uint32)
        if array.dtype.kind not in "iu" or array.ndim != 2 or array.shape[1] != 2 or array.min(initial=0) < 0:
            raise ValueError(f"pairs must be whole numbers of shape (n, 2), not {array.dtype} {array.shape}")
        array = np.ascontiguousarray(array, np.uint32)
        # NULL would be all pairs: no pairs have a place too.
        places = array if array.size else np.empty(2, np.uint32)
        options.pairs, options.pair_count = places.ctypes.data, len(array)
    if min_closure is not None:
        options.min_closure = min_closure
    arguments = survey._pointer, byref(options), _callbacks.reporter(progress), None, pointer_of(cancel)
    return _Ties._made(_callbacks.call, lib.ptzcal_adjustment_tie_stations, *arguments).read()
