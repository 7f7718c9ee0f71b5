"""A pan-tilt-zoom head, driven as an operator does."""

from __future__ import annotations

import enum
import weakref
from ctypes import byref, c_char, c_double, c_int32, c_size_t, c_uint64, c_void_p
from dataclasses import dataclass
from typing import Any, Callable, List, NamedTuple, Optional, Union

from . import _callbacks, _native, _structs
from ._arrays import unsigned
from ._native import Handle, call, lib
from .angle_map import AngleMap
from .cancel import Cancel, pointer_of
from .errors import Status
from .rig import LogLevel
from .simulator import Motion


class MoveEnd(enum.IntEnum):
    """How a move ended."""

    ARRIVED = 0
    MISSED = 1  #: it stands elsewhere: at a limit, blocked, or the device gave up
    STOPPED = 2
    DEAD_MAN = 3  #: a drive was not renewed in time, and was stopped
    REPLACED = 4  #: a later move took its place
    UNKNOWN = 5  #: the device tells neither its position nor whether it moves
    FAILED = 6  #: the device failed


class Focus(enum.IntEnum):
    AUTO = 0
    MANUAL = 1  #: stays where it is
    AT = 2  #: goes to a place and stays there


class Identity(enum.IntEnum):
    """What a device can be asked of itself."""

    PROTOCOL = 0
    VENDOR = 1
    MODEL = 2
    FIRMWARE = 3


class PanTiltZoom(NamedTuple):
    """Readings: radians, positive right and up; zoom 0 (wide) to 1 (tele)."""

    pan: float
    tilt: float
    zoom: float


@dataclass(frozen=True)
class MoveEvent:
    """The end of a move: pan and tilt are NaN where the position is not known."""

    number: int
    end: MoveEnd
    status: int  #: how the device failed, or Status.OK
    pan: float
    tilt: float


@dataclass(frozen=True)
class HeadCapabilities:
    """What a head can do. Angles are radians, speeds radians per second; 0: not known."""

    raw_units: bool  #: pan and tilt are numbers without a known angle
    pan_min: float
    pan_max: float
    tilt_min: float
    tilt_max: float
    pan_step: float
    tilt_step: float
    pan_speed: float
    tilt_speed: float
    presets: int
    reports_motion: bool
    reports_position: bool
    has_drive: bool
    has_relative: bool
    has_home: bool
    has_zoom: bool
    has_focus: bool
    has_exposure_lock: bool
    has_view_moves: bool


class HeadIdentity(NamedTuple):
    """What a device says of itself; empty where it does not say."""

    protocol: str
    vendor: str
    model: str
    firmware: str


class HeadOptions(Handle):
    """What a head is opened with. `frames` and `laser` are addresses or functions, as of a Rig."""

    _free = "ptzcal_head_options_free"

    def __init__(
        self,
        address: str,
        user: Optional[str],
        password: Optional[str],
        angle_map: Optional[AngleMap],
        frames: Union[str, Callable[[float, float], Any], None] = None,
        laser: Union[str, Callable[[bool], Any], None] = None,
    ) -> None:
        self._make(lib.ptzcal_head_options_new)
        self.callbacks: List[Any] = []
        self.set("address", _native.text(address, "address"))
        if user is not None:
            secret = None if password is None else _native.text(password, "password")
            self.set("credentials", _native.text(user, "user"), secret)
        if angle_map is not None:
            self.set("angle_map", angle_map._pointer)
        if isinstance(frames, str):
            self.set("frames_address", _native.text(frames, "frames"))
        elif frames is not None:
            self.callbacks.append(_callbacks.frames(frames))
            self.set("frames", self.callbacks[-1], None)
        if isinstance(laser, str):
            self.set("laser_address", _native.text(laser, "laser"))
        elif laser is not None:
            switch = laser
            self.callbacks.append(
                _structs.ptzcal_laser_fn(
                    _callbacks.device(lambda on: switch(bool(on)), always=lambda on: not on)
                )
            )
            self.set("laser", self.callbacks[-1], None)

    def set(self, setting: str, *values: Any) -> None:
        call(getattr(lib, f"ptzcal_head_options_set_{setting}"), self._pointer, *values)


def _close(pointer: int, _callbacks_alive: Any) -> None:
    # What it could not stop it has logged; there is nobody left to hear of it.
    lib.ptzcal_head_close(pointer, None)


class Head:
    """An open head; any number of threads may use it. Close it, or use it in a `with`.

    Moves return their number at once; `wait` waits for their end.
    """

    def __init__(
        self,
        address: str,
        *,
        user: Optional[str] = None,
        password: Optional[str] = None,
        angle_map: Optional[AngleMap] = None,
        on_move_end: Optional[Callable[[MoveEvent], Any]] = None,
        log: Optional[Callable[[LogLevel, str], Any]] = None,
    ) -> None:
        """Opens the head at an address (docs/addresses.md); it does not move.

        angle_map: what the numbers of a head without angles mean.
        on_move_end, log: run on the head's own thread; what they raise is printed.
        """
        options = HeadOptions(address, user, password, angle_map)
        callbacks = []
        if on_move_end is not None:
            heard = _structs.ptzcal_move_end_fn(
                lambda _user, number, end, status, pan, tilt: on_move_end(
                    MoveEvent(number, MoveEnd(end), status, pan, tilt)
                )
            )
            callbacks.append(heard)
            options.set("on_move_end", heard, None)
        if log is not None:
            written = _structs.ptzcal_log_fn(
                lambda _user, level, text: log(LogLevel(level), text.decode())
            )
            callbacks.append(written)
            options.set("log", written, None)
        pointer = c_void_p()
        call(lib.ptzcal_head_open, options._pointer, byref(pointer))
        assert pointer.value is not None
        self._open: Optional[int] = pointer.value
        self._finalizer = weakref.finalize(self, _close, pointer.value, callbacks)

    def close(self) -> None:
        """Stops the head. No other thread may be using it."""
        self._open = None
        self._finalizer()

    def __enter__(self) -> "Head":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def _call(self, verb: str, *arguments: Any) -> None:
        if self._open is None:
            raise ValueError("the head is closed")
        call(getattr(lib, f"ptzcal_head_{verb}"), self._open, *arguments)

    def _start(self, verb: str, *arguments: Any) -> int:
        number = c_uint64()
        self._call(verb, *arguments, byref(number))
        return number.value

    @property
    def capabilities(self) -> HeadCapabilities:
        struct = _native.initial(_structs.ptzcal_head_capabilities)
        self._call("get_capabilities", byref(struct))
        values = {}
        for name, kind in HeadCapabilities.__annotations__.items():
            value = getattr(struct, name)
            values[name] = bool(value) if kind == "bool" else value
        return HeadCapabilities(**values)

    @property
    def identity(self) -> HeadIdentity:
        """What the device says it is."""

        def text(which: Identity) -> str:
            buffer, needed = (c_char * 256)(), c_size_t()
            self._call("copy_identity", int(which), buffer, len(buffer), byref(needed))
            return buffer.raw[: needed.value].decode()

        return HeadIdentity(*(text(which) for which in Identity))

    def position(self) -> PanTiltZoom:
        """Where the head is."""
        pan, tilt, zoom = c_double(), c_double(), c_double()
        self._call("position", byref(pan), byref(tilt), byref(zoom))
        return PanTiltZoom(pan.value, tilt.value, zoom.value)

    def motion(self) -> Motion:
        """Whether it moves."""
        motion = c_int32()
        self._call("motion", byref(motion))
        return Motion(motion.value)

    def move(self, pan: float, tilt: float) -> int:
        """Starts a move, radians."""
        return self._start("move", pan, tilt)

    def move_by(self, pan: float, tilt: float) -> int:
        """Starts a move from where the head is, radians."""
        return self._start("move_by", pan, tilt)

    def move_in_view(self, x: float, y: float) -> int:
        """Starts a move that brings a place of the present picture to its centre: from -1 to 1, from the
        centre to the picture's right and upper edge."""
        return self._start("move_in_view", x, y)

    def drive(self, pan: float, tilt: float, zoom: float = 0.0, *, dead_man: float = 1.0) -> int:
        """Drives at a speed, radians per second (zoom: -1 to 1), until told otherwise and no
        longer than `dead_man` seconds after the last call."""
        return self._start("drive", pan, tilt, zoom, dead_man)

    def stop(self) -> None:
        """Stops pan, tilt and zoom. It waits for nobody."""
        self._call("stop")

    def home(self) -> int:
        return self._start("home")

    def set_zoom(self, zoom: float) -> int:
        """Starts zooming, 0 (wide) to 1 (tele)."""
        return self._start("set_zoom", zoom)

    def set_focus(self, focus: Focus, at: float = 0.0) -> None:
        """`at`: 0 (far) to 1 (near), for Focus.AT."""
        self._call("set_focus", int(focus), at)

    def focus(self) -> float:
        """Where the focus is, 0 (far) to 1 (near)."""
        at = c_double()
        self._call("focus", byref(at))
        return at.value

    def lock_exposure(self, locked: bool = True) -> None:
        """Holds exposure and white balance as they are."""
        self._call("lock_exposure", bool(locked))

    def store_preset(self, preset: int) -> None:
        self._call("store_preset", unsigned(preset, "preset"))

    def recall_preset(self, preset: int) -> int:
        return self._start("recall_preset", unsigned(preset, "preset"))

    def clear_preset(self, preset: int) -> None:
        self._call("clear_preset", unsigned(preset, "preset"))

    def wait(
        self, number: int, timeout: float = 60.0, *, cancel: Optional[Cancel] = None
    ) -> MoveEnd:
        """Waits until a move has ended. Raises Error (DEVICE_TIMEOUT) when it goes on."""
        end, status = c_int32(), c_int32(int(Status.OK))
        self._call("wait", number, timeout, pointer_of(cancel), byref(end), byref(status))
        return MoveEnd(end.value)
