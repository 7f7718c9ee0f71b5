"""Scans: what a rig measured over a region."""

from __future__ import annotations

from ctypes import byref, c_size_t, c_uint32, c_void_p
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _callbacks, _native, _structs
from ._arrays import address_of, member, unsigned
from ._native import HEAD_CAMERA, Handle, call, lib
from .camera import Camera, DistortionModel
from .cancel import Cancel, pointer_of
from .detect import Spot, SpotOptions
from .errors import Error, SpotAmbiguous, SpotNotFound


@dataclass(frozen=True)
class Region:
    """A grid of readings, radians, both ends included; a single step stands in the middle."""

    pan_min: float
    pan_max: float
    tilt_min: float
    tilt_max: float
    pan_steps: int = 1
    tilt_steps: int = 1

    @classmethod
    def _from_struct(cls, s: _structs.ptzcal_region) -> "Region":
        return cls(s.pan_min, s.pan_max, s.tilt_min, s.tilt_max, s.pan_steps, s.tilt_steps)

    def _struct(self) -> _structs.ptzcal_region:
        struct = _native.initial(_structs.ptzcal_region)
        struct.pan_min, struct.pan_max = self.pan_min, self.pan_max
        struct.tilt_min, struct.tilt_max = self.tilt_min, self.tilt_max
        struct.pan_steps = unsigned(self.pan_steps, "pan_steps")
        struct.tilt_steps = unsigned(self.tilt_steps, "tilt_steps")
        return struct


@dataclass(frozen=True)
class Gate:
    """Where spots can be; the defaults are the library's."""

    nearest: float = 0.3  #: metres along the head camera's axis
    farthest: float = 100.0
    half_width: float = 16.0  #: half the width of the searched bands, pixels
    model_sigma: float = 1.0  #: standard deviation of the rig model's errors, pixels


@dataclass(frozen=True)
class FixedCamera:
    """A camera that a scan watches.

    frames: an address such as "sim:fixed/0", or a function as for Rig.open, with `size`.
    size: (width, height) of its images. known: the camera, where it is calibrated already.
    distortion: the lens model that it is calibrated with between the passes.
    """

    frames: Union[str, Callable[[float, float], Any]]
    size: Optional[Tuple[int, int]] = None
    known: Optional[Camera] = None
    distortion: Union[DistortionModel, str, int, None] = None


@dataclass(frozen=True, eq=False)
class Shot:
    """One position of a scan; radians, metres, seconds of the rig's clock."""

    index: int  #: tilt step * pan_steps + pan step
    pan: float
    tilt: float
    zoom: float
    time: float
    found: bool  #: the head camera saw the spot
    fixed_found: int  #: how many fixed cameras saw it
    colour: Tuple[int, int, int]  #: red, green, blue of what was hit
    point: Optional[np.ndarray]  #: (3,) in the rig's world
    covariance: Optional[np.ndarray]  #: (3, 3), along the beam
    inverse_depth: Optional[float]  #: 1 / m; its noise is Gaussian
    inverse_depth_variance: Optional[float]
    epipolar_chi2: Optional[float]

    @classmethod
    def _from_struct(cls, s: _structs.ptzcal_shot) -> "Shot":
        found, has_point = bool(s.found), bool(s.has_point)
        return cls(
            s.index,
            s.pan,
            s.tilt,
            s.zoom,
            s.time,
            found,
            s.fixed_found,
            (s.colour >> 16 & 255, s.colour >> 8 & 255, s.colour & 255),
            np.array(s.point) if has_point else None,
            np.array(s.covariance).reshape(3, 3) if has_point else None,
            s.inverse_depth if found else None,
            s.inverse_depth_variance if found else None,
            s.epipolar_chi2 if found else None,
        )


@dataclass(frozen=True, eq=False)
class Progress:
    """How far a scan is."""

    pass_: int  #: from 1
    passes: int
    done: int  #: steps of this pass
    total: int
    measured: bool  #: the newest step gave a measurement
    elapsed: float  #: seconds
    seconds_left: Optional[float]  #: None while nobody knows
    shot: Optional[Shot]  #: the newest

    @classmethod
    def _from_struct(cls, s: _structs.ptzcal_progress) -> "Progress":
        return cls(
            getattr(s, "pass"),
            s.passes,
            s.done,
            s.total,
            bool(s.measured),
            s.elapsed,
            s.seconds_left if s.seconds_left >= 0 else None,
            Shot._from_struct(s.shot[0]) if s.shot else None,
        )


class ScanOptions(Handle):
    """See Rig.scan_region."""

    _free = "ptzcal_scan_options_free"

    def __init__(
        self,
        cameras: Sequence[Union[FixedCamera, str]],
        settings: Dict[str, Optional[int]],
        *,
        spot: Optional[SpotOptions],
        gate: Optional[Gate],
        journal: Optional[_native.Path],
        journal_sync: bool,
        recording: Optional[_native.Path],
        reconnect: float,
        target_accuracy: float,
        cancel: Optional[Cancel],
    ) -> None:
        self._make(lib.ptzcal_scan_options_new)
        self._callbacks: List[Any] = []
        if isinstance(cameras, (str, FixedCamera)):
            raise TypeError("cameras must be a list of cameras")
        for number, camera in enumerate(cameras):
            self._add(number, camera if isinstance(camera, FixedCamera) else FixedCamera(camera))
        for setting, value in settings.items():
            if value is not None:
                self._set(setting, unsigned(value, setting))
        if spot is not None:
            self._set("spot", spot._pointer)
        if gate is not None:
            self._set("gate", *astuple(gate))
        if journal is not None:
            self._set("journal", _native.path(journal), bool(journal_sync))
        self._set("reconnect", reconnect)
        self._set("target_accuracy", target_accuracy)
        if recording is not None:
            self._set("recording", _native.path(recording))
        self._set("cancel", pointer_of(cancel))

    @classmethod
    def plain(cls, cameras: Sequence[Union[FixedCamera, str]]) -> "ScanOptions":
        """Of single shots: nothing but the cameras."""
        return cls(
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

    def _set(self, setting: str, *values: Any) -> None:
        call(getattr(lib, f"ptzcal_scan_options_set_{setting}"), self._pointer, *values)

    def _add(self, number: int, camera: FixedCamera) -> None:
        if isinstance(camera.frames, str):
            address = _native.text(camera.frames, "address")
            call(lib.ptzcal_scan_options_add_camera_address, self._pointer, address, None)
        else:
            if camera.size is None:
                raise ValueError("a fixed camera with a function for its frames needs its size")
            width, height = (unsigned(value, "size") for value in camera.size)
            next_frame = _callbacks.frames(camera.frames)
            self._callbacks.append(next_frame)
            call(
                lib.ptzcal_scan_options_add_camera,
                self._pointer,
                next_frame,
                None,
                width,
                height,
                None,
            )
        if camera.known is not None:
            self._set("known_camera", number, byref(camera.known._struct))
        if camera.distortion is not None:
            model = member(DistortionModel, camera.distortion, "distortion")
            self._set("distortion", number, model)


class Scan(Handle):
    """What a scan measured; len() is the number of shots. Immutable."""

    _free = "ptzcal_scan_free"

    def __init__(
        self,
        rig_pointer: int,
        region: Region,
        options: ScanOptions,
        progress: Optional[Callable[[Progress], Any]],
    ) -> None:
        """Use Rig.scan_region."""

        def heard(state: Any) -> int:
            # Also without the host's function, so that Ctrl-C is noticed at each shot.
            return progress is not None and bool(progress(Progress._from_struct(state[0])))

        callback = _structs.ptzcal_progress_fn(_callbacks.listener(heard, otherwise=1))
        pointer = c_void_p()
        try:
            failure = _callbacks.call(
                lib.ptzcal_rig_scan_region,
                rig_pointer,
                byref(region._struct()),
                options._pointer,
                callback,
                None,
                byref(pointer),
            )
        finally:
            self._pointer = pointer.value
        self._read(failure)

    @classmethod
    def _of(cls, pointer: Optional[int], failure: Optional[BaseException] = None) -> "Scan":
        """Takes over a scan that the library made."""
        scan = cls.__new__(cls)
        scan._pointer = pointer
        scan._read(failure)
        return scan

    def _read(self, failure: Optional[BaseException]) -> None:
        self.end: Optional[Error] = None
        """Why the scan is not complete; None when it is."""
        try:
            call(lib.ptzcal_scan_end, self._pointer)
        except Error as error:
            error.__cause__ = failure
            self.end = error
        self._summary = _native.initial(_structs.ptzcal_scan_summary)
        call(lib.ptzcal_scan_get_summary, self._pointer, byref(self._summary))

    def __len__(self) -> int:
        return self._summary.shots

    def __getitem__(self, index: int) -> Shot:
        number = index + len(self) if index < 0 else index
        if not 0 <= number < len(self):
            raise IndexError(f"there is no shot {index}: there are {len(self)}")
        struct = _native.initial(_structs.ptzcal_shot)
        call(lib.ptzcal_scan_get_shot, self._pointer, number, byref(struct))
        return Shot._from_struct(struct)

    def __iter__(self) -> Iterator[Shot]:
        return (self[i] for i in range(len(self)))

    @property
    def complete(self) -> bool:
        """Every position was visited; `end` says why not."""
        return bool(self._summary.complete)

    @property
    def positions(self) -> int:
        """Positions of the region."""
        return self._summary.positions

    @property
    def found(self) -> int:
        """Shots whose spot the head camera saw."""
        return self._summary.found

    @property
    def fixed_cameras(self) -> int:
        return self._summary.fixed_cameras

    @property
    def resumed(self) -> int:
        """Shots read from the journal."""
        return self._summary.resumed

    @property
    def journal_damaged(self) -> int:
        """Records of the journal that were damaged, and measured again."""
        return self._summary.journal_damaged

    @property
    def journal_cut(self) -> int:
        """Bytes of an unfinished record that were cut off the journal's end."""
        return self._summary.journal_cut

    def camera_size(self, camera: int = 0) -> Tuple[int, int]:
        """(width, height) of a fixed camera's images, by its number: `Correspondences` wants it."""
        width, height = c_uint32(), c_uint32()
        number = unsigned(camera, "camera")
        call(lib.ptzcal_scan_camera_size, self._pointer, number, byref(width), byref(height))
        return width.value, height.value

    def spot(self, index: int, camera: int = HEAD_CAMERA) -> Optional[Spot]:
        """Where a camera (a fixed one by its number) saw the spot of a shot; None: nowhere."""
        struct = _native.initial(_structs.ptzcal_spot)
        shot, number = unsigned(index, "index", 64), unsigned(camera, "camera")
        try:
            call(lib.ptzcal_scan_get_spot, self._pointer, shot, number, byref(struct))
        except (SpotNotFound, SpotAmbiguous):
            return None
        return Spot._from_struct(struct)

    @cached_property
    def points(self) -> np.ndarray:
        """The measured points (n, 3) of the rig's world, metres; shots without one are left out."""
        needed = c_size_t()
        # The first call only tells the size.
        lib.ptzcal_scan_copy_points(self._pointer, None, 0, byref(needed), None)
        points = np.empty((needed.value // 3, 3))
        call(lib.ptzcal_scan_copy_points, self._pointer, address_of(points), points.size, None)
        points.flags.writeable = False
        return points

    def save_ply(self, path: _native.Path) -> None:
        """Writes the points as binary PLY, with their colours and covariances."""
        call(lib.ptzcal_scan_save_ply, self._pointer, _native.path(path))

    def __repr__(self) -> str:
        return f"<ptzcal.Scan: {len(self)} of {self.positions} shots, {self.found} with a spot>"
