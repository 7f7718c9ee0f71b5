"""Is a fixed camera still where it was calibrated? Where does it see the laser at all?"""

from __future__ import annotations

import enum
from ctypes import byref, c_size_t, c_void_p
from dataclasses import dataclass
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np

from . import _callbacks, _native, _structs
from ._arrays import address_of
from ._native import Handle, call, lib
from .calibrate import Calibration
from .rig import Rig
from .rig_model import RigModel
from .scan import Scan, ScanOptions


class Verdict(enum.IntEnum):
    UNCHANGED = 0
    CAMERA_MOVED = 1  #: its pose is refitted
    RIG_MOVED = 2  #: or its head lost its zero, or its laser moved on the head
    CANNOT_TELL = 3


class ShotState(enum.IntEnum):
    USED = 0
    NOT_SEEN = 1
    SCENE_CHANGED = 2
    OUTLIER = 3


@dataclass(frozen=True, eq=False)
class Health:
    """What a check came to."""

    verdict: Verdict
    reason: str
    #: Chi-square, its degrees of freedom and its probability, were nothing changed.
    statistic: Optional[Tuple[float, float, float]]
    shots: Tuple[ShotState, ...]
    #: (6,): what the refit turned (radians, camera axes) and moved (metres, world) the camera by.
    change: Optional[np.ndarray]
    change_covariance: Optional[np.ndarray]  #: (6, 6)
    refitted: Optional[Calibration]
    head_shift: Optional[np.ndarray]  #: (2,): pan and tilt of a head that lost its zero, radians


class _Report(Handle):
    _free = "ptzcal_health_report_free"

    def __init__(self, *arguments: Any) -> None:
        self._make(lib.ptzcal_health_check, *arguments)


def choose_health_shots(scan: Scan, camera: int = 0, count: int = 10) -> List[int]:
    """Indices of the shots of a scan that are worth firing again."""
    buffer, needed = np.empty(count, dtype=np.uintp), c_size_t()
    arguments = (scan._pointer, camera, count, address_of(buffer), count, byref(needed))
    call(lib.ptzcal_scan_choose_health_shots, *arguments)
    return [int(i) for i in buffer[: needed.value]]


def fire_again(rig: Rig, before: Scan, shots: Sequence[int], cameras: Sequence[Any]) -> Scan:
    """Fires shots of an earlier scan again, watched by the same cameras in the same order."""
    options = ScanOptions(
        cameras,
        {},
        spot=None,
        gate=None,
        journal=None,
        journal_sync=True,
        recording=None,
        reconnect=0.0,
        target_accuracy=0.0,
        cancel=None,
    )
    indices, pointer = np.array(shots, dtype=np.uintp), c_void_p()
    callback = _structs.ptzcal_progress_fn(_callbacks.listener(lambda _: False, otherwise=1))
    with rig._open() as rig_pointer:
        failure = _callbacks.call(
            lib.ptzcal_rig_fire_again,
            rig_pointer,
            before._pointer,
            address_of(indices),
            len(indices),
            options._pointer,
            callback,
            None,
            byref(pointer),
        )
    return Scan._of(pointer.value, failure)


def check_health(
    model: RigModel,
    calibration: Calibration,
    before: Scan,
    again: Scan,
    camera: int = 0,
    false_alarm: float = 0.01,
) -> Health:
    """Compares the shots of a scan with those fired again."""
    options = _native.initial(_structs.ptzcal_health_options)
    options.false_alarm = false_alarm
    report = _Report(
        byref(model._struct),
        calibration._pointer,
        before._pointer,
        again._pointer,
        camera,
        byref(options),
    )
    s = _native.initial(_structs.ptzcal_health)
    call(lib.ptzcal_health_report_get, report._pointer, byref(s))
    states, needed = np.empty(s.shots, dtype=np.uint32), c_size_t()
    arguments = (report._pointer, address_of(states), len(states), byref(needed))
    call(lib.ptzcal_health_report_copy_shots, *arguments)
    refitted = None
    if s.has_refit:
        refitted = Calibration._made(lib.ptzcal_health_report_refitted, report._pointer)
    return Health(
        Verdict(s.verdict),
        lib.ptzcal_health_report_reason(report._pointer).decode(),
        (s.chi2, s.degrees_of_freedom, s.probability) if s.has_statistic else None,
        tuple(ShotState(int(i)) for i in states),
        np.array(s.change) if s.has_refit else None,
        np.array(s.change_covariance).reshape(6, 6) if s.has_refit else None,
        refitted,
        np.array(s.head_shift) if s.has_head_shift else None,
    )
