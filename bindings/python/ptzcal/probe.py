"""What a device really is and does, found out by moving it a little and watching."""

from __future__ import annotations

import enum
from ctypes import byref, c_size_t, create_string_buffer
from typing import Any, Callable, NamedTuple, Optional, Tuple, Union

from . import _callbacks, _native, _structs
from ._arrays import unsigned
from ._native import Handle, call, lib
from .angle_map import AngleMap
from .camera import Camera
from .cancel import Cancel, pointer_of
from .head import HeadOptions


class ProbeFigure(enum.IntEnum):
    """What is measured: radians, pixels, seconds, frames; 1 or 0 for yes and no. See ptzcal.h."""

    PAN_MIN = 0
    PAN_MAX = 1
    TILT_MIN = 2
    TILT_MAX = 3
    PAN_SPEED = 4
    TILT_SPEED = 5
    START_LATENCY = 6
    POSITION_TIME = 7
    POSITION_FOLLOWS = 8
    PAN_ERROR = 9
    TILT_ERROR = 10
    PAN_READING_REPEATABILITY = 11
    TILT_READING_REPEATABILITY = 12
    PAN_REPEATABILITY_PX = 13
    TILT_REPEATABILITY_PX = 14
    PAN_REPEATABILITY = 15
    TILT_REPEATABILITY = 16
    PAN_BACKLASH_PX = 17
    TILT_BACKLASH_PX = 18
    PAN_BACKLASH = 19
    TILT_BACKLASH = 20
    PAN_SMALLEST_MOVE = 21
    TILT_SMALLEST_MOVE = 22
    STOP_DISTANCE = 23
    STOP_TIME = 24
    MOVES_AFTER_ARRIVAL = 25
    ARRIVAL_HONEST = 26
    FRAME_INTERVAL = 27
    FRAME_AGE = 28
    VISIBLE_AFTER = 29
    VISIBLE_AFTER_FRAMES = 30
    LASER_VISIBLE_AFTER = 31
    LASER_VISIBLE_AFTER_FRAMES = 32
    DURATION = 33


class Figure(NamedTuple):
    """A figure, its standard deviation, and the number of measurements."""

    value: float
    sigma: float
    count: int


class ProbeReport(Handle):
    """What was found out. str() is a text that a person understands. Immutable."""

    _free = "ptzcal_probe_report_free"

    def __getitem__(self, which: ProbeFigure) -> Figure:
        """Raises Error (NOT_FOUND) with the reason when the figure could not be had."""
        struct = _native.initial(_structs.ptzcal_figure)
        call(lib.ptzcal_probe_report_get, self._pointer, int(which), byref(struct))
        return Figure(struct.value, struct.sigma, struct.count)

    def __str__(self) -> str:
        text, needed = create_string_buffer(1 << 14), c_size_t()
        call(lib.ptzcal_probe_report_copy_text, self._pointer, text, len(text), byref(needed))
        return text.raw[: needed.value].decode()


def probe(
    address: str,
    *,
    frames: Union[str, Callable[[float, float], Any], None] = None,
    laser: Union[str, Callable[[bool], Any], None] = None,
    camera: Optional[Camera] = None,
    user: Optional[str] = None,
    password: Optional[str] = None,
    angle_map: Optional[AngleMap] = None,
    amplitude: float = 0.1,
    repeats: int = 5,
    reach_limits: bool = False,
    toggle_laser: bool = False,
    max_time: float = 300.0,
    cancel: Optional[Cancel] = None,
) -> ProbeReport:
    """Probes the head at an address. It is back where it was at the end.

    frames: where frames of its camera come from, an address or a function as of a Rig; without,
      what the picture shows is not measured. camera: its lens, for angles instead of pixels.
    laser: switched for a second at most, with toggle_laser.
    amplitude: size of the moves, share of the range. repeats: returns from each side.
    reach_limits: go to the limits, too. max_time: seconds.
    """
    options = HeadOptions(address, user, password, angle_map, frames, laser)
    how = _native.initial(_structs.ptzcal_probe_options)
    how.repeats = unsigned(repeats, "repeats")
    how.reach_limits, how.toggle_laser = bool(reach_limits), bool(toggle_laser)
    how.amplitude, how.max_time = amplitude, max_time
    lens = None if camera is None else byref(camera._struct)
    return ProbeReport._made(
        _callbacks.call, lib.ptzcal_probe, options._pointer, lens, byref(how), pointer_of(cancel)
    )


def learn_angles(
    address: str,
    camera: Camera,
    *,
    frames: Union[str, Callable[[float, float], Any], None] = None,
    user: Optional[str] = None,
    password: Optional[str] = None,
    scene: Tuple[float, float] = (2.0, 100.0),
    progress: Optional[Callable[[int, int], Any]] = None,
    cancel: Optional[Cancel] = None,
) -> AngleMap:
    """Turns a head over its range and learns which angles its numbers are.

    camera: the lens of the camera on the head, at this zoom. frames: as of `probe`.
    scene: nearest and farthest distance of what is seen, metres.
    progress: progress(frames, total); a true result stops the work.
    """
    options = HeadOptions(address, user, password, None, frames)
    how = _native.initial(_structs.ptzcal_angle_learning_options)
    how.scene_nearest, how.scene_farthest = scene

    def heard(report: Any) -> int:
        return bool(progress and progress(report[0].done, report[0].total))

    told = _structs.ptzcal_progress_fn(_callbacks.listener(heard, otherwise=1))
    return AngleMap._made(
        _callbacks.call,
        lib.ptzcal_learn_angles,
        options._pointer,
        byref(camera._struct),
        byref(how),
        told,
        None,
        pointer_of(cancel),
    )
