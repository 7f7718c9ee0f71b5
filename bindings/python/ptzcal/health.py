"""Is a fixed camera still where it was calibrated?"""

from __future__ import annotations

import enum
from ctypes import byref, c_size_t, c_void_p
from dataclasses import dataclass
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np

from . import _callbacks, _native, _structs
from ._arrays import address_of, rows
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

    def __init__(self, function: Any, *arguments: Any) -> None:
        self._make(function, *arguments)


def choose_health_shots(scan: Scan, camera: int = 0, count: int = 10) -> List[int]:
    """Indices of the shots of a scan that are worth firing again."""
    buffer, needed = np.empty(count, dtype=np.uintp), c_size_t()
    arguments = (scan._pointer, camera, count, address_of(buffer), count, byref(needed))
    call(lib.ptzcal_scan_choose_health_shots, *arguments)
    return [int(i) for i in buffer[: needed.value]]


def fire_again(rig: Rig, before: Scan, shots: Sequence[int], cameras: Sequence[Any]) -> Scan:
    """Fires shots of an earlier scan again, watched by the same cameras in the same order."""
    options = ScanOptions.plain(cameras)
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
    pointing_sigma: Tuple[float, float] = (1e-4, 1e-4),
) -> Health:
    """Compares the shots of a scan with those fired again.

    false_alarm: probability of not saying unchanged when nothing has changed. pointing_sigma: standard
    deviations of where the head comes to rest, pan and tilt, radians.
    """
    report = _Report(
        lib.ptzcal_health_check,
        byref(model._struct),
        calibration._pointer,
        before._pointer,
        again._pointer,
        camera,
        byref(_options(false_alarm, pointing_sigma)),
    )
    return _health(report)


def check_health_spots(
    model: RigModel,
    calibration: Calibration,
    readings: Any,
    head: Any,
    fixed: Any,
    head_again: Any,
    fixed_again: Any,
    sigma: float = 0.3,
    false_alarm: float = 0.01,
    pointing_sigma: Tuple[float, float] = (1e-4, 1e-4),
) -> Health:
    """The same from spots that the host measured itself, without a rig.

    readings (n, 2): pan and tilt of each shot, radians. head, fixed (n, 2): its spots before, pixels;
    head_again, fixed_again (n, 2): now, a row of NaN where it was not seen. sigma: standard deviation
    of all of them, pixels.
    """
    readings = rows(readings, 2, "readings")
    n = len(readings)
    pixels = [
        rows(head, 2, "head", n),
        rows(fixed, 2, "fixed", n),
        rows(head_again, 2, "head_again", n),
        rows(fixed_again, 2, "fixed_again", n),
    ]
    seen = np.stack([~np.isnan(p).any(axis=1) for p in pixels[2:]], axis=1).astype(np.uint8)
    spots = np.zeros((n, 4, 5))
    spots[:, :2, :2] = np.stack(pixels[:2], axis=1)
    spots[:, 2:, :2] = np.where(seen[:, :, None] == 1, np.stack(pixels[2:], axis=1), 0.0)
    spots[:, :, [2, 4]] = sigma * sigma
    report = _Report(
        lib.ptzcal_health_check_spots,
        byref(model._struct),
        calibration._pointer,
        address_of(readings),
        address_of(spots),
        address_of(seen),
        n,
        byref(_options(false_alarm, pointing_sigma)),
    )
    return _health(report)


def _options(
    false_alarm: float, pointing_sigma: Tuple[float, float]
) -> _structs.ptzcal_health_options:
    options = _native.initial(_structs.ptzcal_health_options)
    options.false_alarm = false_alarm
    options.pan_sigma, options.tilt_sigma = pointing_sigma
    return options


def _health(report: _Report) -> Health:
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
