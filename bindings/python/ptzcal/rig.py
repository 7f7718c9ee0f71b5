"""An open rig: a pan-tilt head with a camera and a laser."""

from __future__ import annotations

import contextlib
import enum
import math
import threading
import warnings
import weakref
from ctypes import byref, c_double, c_void_p
from dataclasses import astuple, dataclass
from typing import Any, Callable, Iterator, List, Optional, Sequence, Union

from . import _callbacks, _native, _structs
from ._arrays import address_of, unsigned, vector
from ._native import Handle, lib
from .angle_map import AngleMap
from .cancel import Cancel, pointer_of
from .detect import SpotOptions
from .errors import Status, error
from .rig_model import PanTilt, RigModel
from .scan import FixedCamera, Gate, Progress, Region, Scan, ScanOptions
from .simulator import Simulator


class LogLevel(enum.IntEnum):
    ERROR = 1
    WARNING = 2
    INFO = 3
    DEBUG = 4


@dataclass(frozen=True)
class Settle:
    """When a move is finished; the defaults are the library's."""

    readings: int = 3  #: equal readings in a row
    duration: float = 0.15  #: seconds that they span
    overshoot: float = 0.01  #: radians past the target when it is approached from above
    move_timeout: float = 30.0  #: seconds
    picture: float = 5.0  #: longest wait for a still picture, seconds; 0 does not look


class _Options(Handle):
    _free = "ptzcal_rig_options_free"

    def __init__(self) -> None:
        self._make(lib.ptzcal_rig_options_new)

    def set(self, setting: str, *values: Any) -> None:
        setter = getattr(lib, f"ptzcal_rig_options_set_{setting}")
        _native.call(setter, self._pointer, *values)


def _is_off(on: int) -> bool:
    return not on


def _ptz(head: Any) -> _structs.ptzcal_ptz:
    """The callbacks of a head."""

    def position(pan: Any, tilt: Any, zoom: Any) -> None:
        values = head.position()
        pan[0], tilt[0], zoom[0] = values if len(values) == 3 else (*values, 0.0)

    def motion(out: Any) -> None:
        out[0] = head.motion()

    def stop() -> None:
        head.stop()

    struct = _native.initial(_structs.ptzcal_ptz)
    struct.pan_min, struct.pan_max = head.pan_range
    struct.tilt_min, struct.tilt_max = head.tilt_range
    struct.raw_units = bool(getattr(head, "raw_units", False))
    struct.pan_step = getattr(head, "pan_step", 0.0)
    struct.tilt_step = getattr(head, "tilt_step", 0.0)
    struct.move_absolute = _structs.ptzcal_ptz_move_fn(_callbacks.device(head.move))
    struct.position = _structs.ptzcal_ptz_position_fn(_callbacks.device(position))
    if getattr(head, "motion", None) is not None:
        struct.motion = _structs.ptzcal_ptz_motion_fn(_callbacks.device(motion))
    struct.stop = _structs.ptzcal_ptz_stop_fn(_callbacks.device(stop, always=lambda: True))
    return struct


class Rig:
    """An open rig. Close it, or use it in a `with`: the laser is then off.

    The laser is off whenever the library is not sure: while the head moves, on every error, when a
    call is cancelled or a callback raises, and from the moment that the rig is closed.
    """

    @classmethod
    def open(
        cls,
        address: Optional[str] = None,
        *,
        model: Optional[RigModel] = None,
        ptz: Any = None,
        laser: Union[str, Callable[[bool], Any], None] = None,
        frames: Union[str, Callable[[float, float], Any], None] = None,
        user: Optional[str] = None,
        password: Optional[str] = None,
        clock: Any = None,
        log: Optional[Callable[[LogLevel, str], Any]] = None,
        settle: Optional[Settle] = None,
        frame_timeout: float = 3.0,
        stale_frames: int = 4,
        laser_max_on: float = 2.0,
        laser_duty: float = 1.0,
        laser_duty_window: float = 10.0,
        angle_map: Optional[AngleMap] = None,
    ) -> "Rig":
        """Opens a rig on an address ("sim:room", "folder:///path/of/a/recording"), on its devices
        (addresses or Python objects), or on both: a device takes the place of the address's. The
        laser is switched off; the head does not move.

        model: the rig model; only simulators and recordings bring their own.
        ptz, laser, frames: addresses (docs/addresses.md), opened as user with password, or:
        ptz: an object with move(pan, tilt), position() -> (pan, tilt), stop(), motion() -> Motion
          where the device tells it, and the attributes pan_range and tilt_range, (least, greatest),
          and pan_step and tilt_step where they are known. Radians.
        laser: laser(on) switches it. emergency_off calls it from its own thread.
        frames: frames(not_before, timeout) returns an image whose exposure began at not_before or
          later, or (image, timestamp), or (image, timestamp, format); see ptzcal.images.Image.
          Without a timestamp: the newest image; the first `stale_frames` after a change are
          dropped.
        clock: an object with now() and sleep(seconds); the system's clock without.
        log: log(level, message).
        frame_timeout, laser_max_on: seconds. laser_duty: greatest share of any laser_duty_window
          seconds that the laser is on.
        angle_map: what the numbers of a head without angles mean (ptz.raw_units is true).

        These functions run on the thread that calls the rig. OSError, TimeoutError,
        ConnectionError, NotImplementedError or ptzcal.Error tell the library that the device
        failed; anything else that they raise ends the call with the laser off, and goes on from
        there.
        """
        options = _Options()
        callbacks: List[Any] = []
        if address is not None:
            options.set("address", _native.text(address, "address"))
        if model is not None:
            options.set("model", byref(model._struct))
        if user is not None:
            secret = None if password is None else _native.text(password, "password")
            options.set("credentials", _native.text(user, "user"), secret)
        for device, place in (("ptz", ptz), ("laser", laser), ("frames", frames)):
            if isinstance(place, str):
                options.set(f"{device}_address", _native.text(place, device))
        if ptz is not None and not isinstance(ptz, str):
            struct = _ptz(ptz)
            callbacks.append(struct)
            options.set("ptz", byref(struct))
        if laser is not None and not isinstance(laser, str):
            switch = _structs.ptzcal_laser_fn(
                _callbacks.device(lambda on: laser(bool(on)), always=_is_off)
            )
            callbacks.append(switch)
            options.set("laser", switch, None)
        if frames is not None and not isinstance(frames, str):
            next_frame = _callbacks.frames(frames)
            callbacks.append(next_frame)
            options.set("frames", next_frame, None)
        if clock is not None:
            # When it fails, all waiting is over.
            now = _structs.ptzcal_clock_now_fn(_callbacks.listener(clock.now, otherwise=math.inf))
            sleep = _structs.ptzcal_clock_sleep_fn(_callbacks.listener(clock.sleep))
            callbacks += [now, sleep]
            options.set("clock", now, sleep, None)
        if log is not None:
            heard = _structs.ptzcal_log_fn(
                _callbacks.listener(lambda level, text: log(LogLevel(level), text.decode()))
            )
            callbacks.append(heard)
            options.set("log", heard, None)
        if settle is not None:
            options.set("settle", *astuple(settle))
        options.set("frame_wait", frame_timeout, unsigned(stale_frames, "stale_frames"))
        options.set("laser_max_on", laser_max_on)
        options.set("laser_duty", laser_duty, laser_duty_window)
        if angle_map is not None:
            options.set("angle_map", angle_map._pointer)
        return cls(options, callbacks)

    def __init__(self, options: _Options, callbacks: List[Any]) -> None:
        """Use Rig.open."""
        self._users: List[int] = []  # threads that are in a call
        self._idle = threading.Condition()
        self._closing = False
        pointer = c_void_p()
        try:
            _callbacks.call(lib.ptzcal_rig_open, options._pointer, byref(pointer))
        except BaseException:
            # A callback may have raised although the rig was opened.
            if pointer.value is not None:
                _close(pointer.value, callbacks)
            raise
        assert pointer.value is not None
        self._pointer: Optional[int] = pointer.value
        self._finalizer = weakref.finalize(self, _forgotten, pointer.value, callbacks)
        self._callbacks = callbacks

    def close(self) -> None:
        """Stops the head and switches the laser off for good; ends a call of another thread.

        Raises the device's Error when it did not obey; the rig is closed all the same.
        """
        with self._idle:
            if self._pointer is None:
                return
            if threading.get_ident() in self._users:
                raise error(Status.BUSY, "the rig cannot be closed from within its own callbacks")
            self._closing = True
            while not self._idle.wait_for(lambda: not self._users, timeout=0.05):
                self._end_call(self._pointer)
            pointer, self._pointer = self._pointer, None
            self._finalizer.detach()
        _close(pointer, self._callbacks)

    @staticmethod
    def _end_call(pointer: Optional[int]) -> None:
        # What fails here fails again, and is told, when the rig is closed.
        with contextlib.suppress(Exception):
            _callbacks.call(lib.ptzcal_rig_stop, pointer)

    @property
    def closed(self) -> bool:
        return self._pointer is None

    def __enter__(self) -> "Rig":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    @contextlib.contextmanager
    def _open(self) -> Iterator[int]:
        """The handle for one call: it is not closed meanwhile."""
        with self._idle:
            if self._pointer is None or self._closing:
                raise ValueError("the rig is closed")
            self._users.append(threading.get_ident())
            pointer = self._pointer
        try:
            yield pointer
        finally:
            with self._idle:
                self._users.remove(threading.get_ident())
                self._idle.notify_all()

    def _call(self, verb: str, *arguments: Any) -> None:
        with self._open() as pointer:
            _callbacks.call(getattr(lib, f"ptzcal_rig_{verb}"), pointer, *arguments)

    @property
    def model(self) -> RigModel:
        """The rig's model."""
        struct = _native.initial(_structs.ptzcal_rig_model)
        self._call("get_model", byref(struct))
        return RigModel._from_struct(struct)

    def simulator(self) -> Simulator:
        """The simulator behind a rig that was opened with its address."""
        with self._open() as pointer:
            return Simulator._of_rig(pointer)

    def recorded_region(self) -> Region:
        """The region of a rig that was opened on a recorded scan."""
        struct = _native.initial(_structs.ptzcal_region)
        self._call("recorded_region", byref(struct))
        return Region._from_struct(struct)

    def move(self, pan: float, tilt: float, *, cancel: Optional[Cancel] = None) -> None:
        """Moves the head, radians, and waits until it stands still. The laser is off meanwhile."""
        self._call("move", pan, tilt, pointer_of(cancel))

    def position(self) -> PanTilt:
        """Where the head is, radians."""
        return self._pan_tilt("position")

    def aim_at_point(self, xyz: Any, *, cancel: Optional[Cancel] = None) -> PanTilt:
        """Turns the head so that the laser hits a point (3,) of the rig's world, metres.

        Returns the readings aimed at.
        """
        point = vector(xyz, 3, "xyz")
        return self._pan_tilt("aim_at_point", address_of(point), pointer_of(cancel))

    def aim_at_pixel(
        self, u: float, v: float, depth: float, *, cancel: Optional[Cancel] = None
    ) -> PanTilt:
        """Turns the head so that the laser hits what its camera sees now at pixel (u, v).

        depth: along the camera's axis, metres. Returns the readings aimed at.
        """
        return self._pan_tilt("aim_at_pixel", u, v, depth, pointer_of(cancel))

    def _pan_tilt(self, verb: str, *arguments: Any) -> PanTilt:
        pan, tilt = c_double(), c_double()
        self._call(verb, *arguments, byref(pan), byref(tilt))
        return PanTilt(pan.value, tilt.value)

    def scan_region(
        self,
        region: Region,
        cameras: Sequence[Union[FixedCamera, str]] = (),
        *,
        frames_per_state: Optional[int] = None,
        coarse_shots: Optional[int] = None,
        spot: Optional[SpotOptions] = None,
        gate: Optional[Gate] = None,
        journal: Optional[_native.Path] = None,
        journal_sync: bool = True,
        recording: Optional[_native.Path] = None,
        reconnect: float = 0.0,
        target_accuracy: float = 0.0,
        progress: Optional[Callable[[Progress], Any]] = None,
        cancel: Optional[Cancel] = None,
    ) -> Scan:
        """Measures a point with the laser at each position of a region, and watches fixed cameras.

        What is None keeps the library's default. cameras: FixedCamera objects, or addresses such as
        "sim:fixed/0". frames_per_state: frames averaged with the laser off, and with it on.
        coarse_shots: positions of the first pass. spot: how spots are found. journal: a file from
        which a scan that was killed goes on; journal_sync waits for the disk at each shot.
        recording: a folder for all frames, to be opened as "folder:///path" and scanned again.
        reconnect: how long an unplugged device is waited for, seconds.
        target_accuracy: ends the scan once every fixed camera's position is expected to be known to
        this rms error, metres, the rig taken as exact; 0: the whole region.
        progress: progress(Progress) after each shot; a true result stops the scan.

        A scan that ends early (stopped, cancelled, a device failed) still returns what it measured:
        see Scan.end. An exception of `progress`, and Ctrl-C, go on from here. The laser is off and
        the head stopped however it ends.
        """
        options = ScanOptions(
            cameras,
            {
                "frames_per_state": frames_per_state,
                "coarse_shots": coarse_shots,
            },
            spot=spot,
            gate=gate,
            journal=journal,
            journal_sync=journal_sync,
            recording=recording,
            reconnect=reconnect,
            target_accuracy=target_accuracy,
            cancel=cancel,
        )
        with self._open() as pointer:
            return Scan(pointer, region, options, progress)

    def set_laser(self, on: bool) -> None:
        """Switches the laser by hand. On is refused while the head moves."""
        self._call("set_laser", bool(on))

    def stop(self) -> None:
        """Stops the head and switches the laser off; ends a call of another thread."""
        self._call("stop")

    def emergency_off(self) -> None:
        """Switches the laser off and keeps it off until `release`. From any thread."""
        self._call("emergency_off")

    def release(self) -> None:
        """Ends an emergency."""
        self._call("release")


def _close(pointer: int, _callbacks_alive: List[Any]) -> None:
    _callbacks.call(lib.ptzcal_rig_close, pointer)


def _forgotten(pointer: int, callbacks: List[Any]) -> None:
    warnings.warn("a ptzcal.Rig was not closed", ResourceWarning, stacklevel=2)
    _close(pointer, callbacks)
