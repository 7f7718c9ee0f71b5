"""A rig in a furnished room, rendered: for tests, for learning, and with its truth."""

from __future__ import annotations

import enum
import threading
from ctypes import byref, c_double, c_int32, c_size_t
from typing import Any, NamedTuple

from . import _native, _structs, images
from ._arrays import unsigned
from ._native import HEAD_CAMERA, Handle, call, lib
from .camera import Camera
from .pose import Pose
from .rig_model import PanTilt, RigModel


class Motion(enum.IntEnum):
    """What a head does at the moment."""

    IDLE = 0
    MOVING = 1
    FAILED = 2  #: the last move ended without reaching its target
    UNKNOWN = 3  #: the device does not say


class Frame(NamedTuple):
    """A camera's frame: the image, its layout, and when its exposure began, seconds."""

    image: images.Image
    timestamp: float
    format: images.PixelFormat


class Simulator(Handle):
    """A simulated rig with a clock of its own, which passes as fast as the work is done.

    Its methods also serve as devices for a Rig.
    """

    _free = "ptzcal_simulator_free"

    def __init__(self, address: str = "sim:room") -> None:
        """`address` may have options: "sim:room?seed=3&station=2"."""
        self._make(lib.ptzcal_simulator_new, _native.text(address, "address"))
        self._frames = threading.Lock()

    @classmethod
    def _of_rig(cls, rig_pointer: int) -> "Simulator":
        simulator = cls.__new__(cls)
        simulator._make(lib.ptzcal_rig_simulator, rig_pointer)
        simulator._frames = threading.Lock()
        return simulator

    def _model(self, function: Any) -> RigModel:
        struct = _native.initial(_structs.ptzcal_rig_model)
        call(function, self._pointer, byref(struct))
        return RigModel._from_struct(struct)

    @property
    def nominal_rig(self) -> RigModel:
        """What the owner of such a rig would know of it: the truth less a small misalignment."""
        return self._model(lib.ptzcal_simulator_nominal_rig)

    @property
    def true_rig(self) -> RigModel:
        return self._model(lib.ptzcal_simulator_true_rig)

    @property
    def fixed_cameras(self) -> int:
        """How many fixed cameras there are."""
        count = c_size_t()
        call(lib.ptzcal_simulator_fixed_cameras, self._pointer, byref(count))
        return count.value

    def true_camera(self, index: int) -> Camera:
        """A fixed camera as it truly is, in the rig's frame."""
        struct = _native.initial(_structs.ptzcal_camera)
        number = unsigned(index, "index")
        call(lib.ptzcal_simulator_true_camera, self._pointer, number, byref(struct))
        return Camera._from_struct(struct)

    @property
    def true_station(self) -> Pose:
        """Where the rig stands: X_room = R X_rig + t."""
        struct = _native.initial(_structs.ptzcal_pose)
        call(lib.ptzcal_simulator_true_station, self._pointer, byref(struct))
        return Pose._from_struct(struct)

    def move(self, pan: float, tilt: float) -> None:
        """Starts a move to pan and tilt, radians."""
        call(lib.ptzcal_simulator_move, self._pointer, pan, tilt)

    def position(self) -> PanTilt:
        pan, tilt = c_double(), c_double()
        call(lib.ptzcal_simulator_position, self._pointer, byref(pan), byref(tilt))
        return PanTilt(pan.value, tilt.value)

    def motion(self) -> Motion:
        motion = c_int32()
        call(lib.ptzcal_simulator_motion, self._pointer, byref(motion))
        return Motion(motion.value)

    def stop(self) -> None:
        """Stops the head."""
        call(lib.ptzcal_simulator_stop, self._pointer)

    def set_laser(self, on: bool) -> None:
        call(lib.ptzcal_simulator_set_laser, self._pointer, bool(on))

    def next_frame(
        self, not_before: float = 0.0, timeout: float = 3.0, camera: int = HEAD_CAMERA
    ) -> Frame:
        """Waits for a frame of a fixed camera (from 0) or of the head camera; the clock goes on.

        Its exposure begins at `not_before` or later; seconds of the simulator's clock.
        """
        struct, timestamp = _native.initial(_structs.ptzcal_image), c_double()
        number = unsigned(camera, "camera")
        # The pixels stay only until the next call for the same camera.
        with self._frames:
            call(
                lib.ptzcal_simulator_next_frame,
                self._pointer,
                number,
                not_before,
                timeout,
                byref(struct),
                byref(timestamp),
            )
            image = images.copied(struct)
        return Frame(image, timestamp.value, images.PixelFormat(struct.format))

    def now(self) -> float:
        """Seconds of the simulator's clock."""
        now = c_double()
        call(lib.ptzcal_simulator_now, self._pointer, byref(now))
        return now.value

    def sleep(self, seconds: float) -> None:
        """Lets seconds of the simulator's clock pass, at once."""
        call(lib.ptzcal_simulator_sleep, self._pointer, seconds)
