"""Where does a fixed camera see the laser at all? Found with a few dozen shots."""

from __future__ import annotations

import math
from ctypes import byref, c_void_p
from dataclasses import dataclass
from typing import Any, Callable, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _callbacks, _native, _structs
from ._arrays import address_of, unsigned
from ._native import Handle, call, lib
from .errors import Error, Status
from .rig import Rig
from .scan import FixedCamera, Progress, Region, Scan, ScanOptions

Range = Tuple[float, float]


@dataclass(frozen=True, eq=False)
class Visible:
    """Where a fixed camera sees the laser's spot."""

    region: Region  #: ready for Rig.scan_region
    mask: np.ndarray  #: (tilt_steps, pan_steps), bool: is it seen there, as far as the shots tell?
    share: float  #: of the mask that is seen
    seen: int  #: shots that the camera saw
    measured: int  #: of them those that the head camera saw too


@dataclass(frozen=True, eq=False)
class Exploration:
    """What exploring came to."""

    visible: List[Optional[Visible]]  #: one for each camera; None: it saw no spot
    scan: Scan  #: all shots, and how it ended (Scan.end)


class _Exploration(Handle):
    _free = "ptzcal_exploration_free"


def explore(
    rig: Rig,
    cameras: Sequence[Union[FixedCamera, str]],
    *,
    pan: Range = (-math.inf, math.inf),
    tilt: Range = (-math.inf, math.inf),
    max_shots: Optional[int] = None,
    tolerance: Optional[float] = None,
    spacing: Optional[float] = None,
    progress: Optional[Callable[[Progress], Any]] = None,
) -> Exploration:
    """Finds the range of pan and tilt in which each fixed camera sees the laser's spot.

    pan, tilt: what to look at, radians; the head's reach is the limit. tolerance: shots are no nearer
    to each other. spacing: steps of the regions that come out. What is None keeps the library's
    default. progress(Progress) after each shot; a true result stops the work, and what was found until
    then is returned. An Error when no camera saw a spot.
    """
    given = _native.initial(_structs.ptzcal_explore_options)
    given.pan_min, given.pan_max = pan
    given.tilt_min, given.tilt_max = tilt
    if max_shots is not None:
        given.max_shots = unsigned(max_shots, "max_shots")
    if tolerance is not None:
        given.tolerance = tolerance
    if spacing is not None:
        given.spacing = spacing
    options = ScanOptions.plain(cameras)

    def heard(state: Any) -> int:
        return progress is not None and bool(progress(Progress._from_struct(state[0])))

    callback = _structs.ptzcal_progress_fn(_callbacks.listener(heard, otherwise=1))
    arguments = (byref(given), options._pointer, callback, None)
    with rig._open() as pointer:
        made = _Exploration._made(_callbacks.call, lib.ptzcal_rig_explore, pointer, *arguments)
    shots = c_void_p()
    call(lib.ptzcal_exploration_get_scan, made._pointer, byref(shots))
    visible = [_visible(made, number) for number in range(len(cameras))]
    return Exploration(visible, Scan._of(shots.value))


def _visible(made: _Exploration, camera: int) -> Optional[Visible]:
    region = _native.initial(_structs.ptzcal_region)
    summary = _native.initial(_structs.ptzcal_visible)
    found = (made._pointer, camera, byref(region), byref(summary))
    try:
        call(lib.ptzcal_exploration_get_visible, *found)
    except Error as error:
        if error.status != Status.NOT_FOUND:
            raise
        return None
    mask = np.empty((region.tilt_steps, region.pan_steps), dtype=np.uint8)
    call(lib.ptzcal_exploration_copy_mask, made._pointer, camera, address_of(mask), mask.size, None)
    return Visible(
        Region._from_struct(region), mask == 1, summary.share, summary.seen, summary.measured
    )
