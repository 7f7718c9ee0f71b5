"""Rig models: from what the head reads and sees to points, and back."""

from __future__ import annotations

from ctypes import byref, c_double
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple, Sequence, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, address_of_optional, pixel_covariances, rows, vector
from ._native import call, lib
from .camera import Camera, DistortionModel, checked_distortion, lens_into


class PanTilt(NamedTuple):
    """Readings of a head, radians; positive pan is right, positive tilt is up."""

    pan: float
    tilt: float


@dataclass(frozen=True)
class RigModel:
    """A pan-tilt camera with a laser fixed to its head. Immutable, like Camera.

    Lens members as in Camera. The laser's line in the head camera's frame is
    (laser_x0 + laser_vx Z, laser_y0 + laser_vy Z, Z), metres. The axes' offsets (metres) and the
    encoders (radians; true = scale * reading + zero) are as in the header.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    laser_x0: float
    laser_y0: float
    laser_vx: float = 0.0
    laser_vy: float = 0.0
    skew: float = 0.0
    distortion_model: Union[DistortionModel, str, int] = DistortionModel.NONE
    distortion: Sequence[float] = ()
    axis_tilt_y: float = 0.0
    axis_tilt_z: float = 0.0
    axis_pan_x: float = 0.0
    axis_pan_z: float = 0.0
    pan_zero: float = 0.0
    pan_scale: float = 1.0
    tilt_zero: float = 0.0
    tilt_scale: float = 1.0
    _struct: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        model, coefficients = checked_distortion(self.distortion_model, self.distortion)
        object.__setattr__(self, "distortion_model", model)
        object.__setattr__(self, "distortion", coefficients)
        struct = _native.initial(_structs.ptzcal_rig_model)
        lens_into(struct, self)
        for name in _RIG_MEMBERS:
            setattr(struct, name, getattr(self, name))
        object.__setattr__(self, "_struct", struct)

    @classmethod
    def _from_struct(cls, struct: _structs.ptzcal_rig_model) -> "RigModel":
        members = {f.name: getattr(struct, f.name) for f in fields(cls) if f.init}
        members["distortion"] = tuple(struct.distortion)
        return cls(**members)

    def head_camera(self, pan: float, tilt: float) -> Camera:
        """The head camera as a camera of the world, at readings in radians."""
        struct = _native.initial(_structs.ptzcal_camera)
        call(lib.ptzcal_rig_model_head_camera, byref(self._struct), pan, tilt, byref(struct))
        return Camera._from_struct(struct)

    def locate(
        self, pan_tilt: Any, spots: Any, spot_covariance: Any = None
    ) -> Tuple[np.ndarray, np.ndarray]:
        """The points that laser shots hit: xyz (n, 3) in metres, and covariances (n, 3, 3).

        pan_tilt (n, 2) radians, spots (n, 2) pixels of the head camera, spot_covariance (n, 3):
        xx, xy, yy, or (n, 2, 2), or (2, 2), px^2 (1 px without). For a calibration hand over the
        shots themselves: Correspondences.add_laser_shots.
        """
        pan_tilt = rows(pan_tilt, 2, "pan_tilt")
        n = len(pan_tilt)
        spots = rows(spots, 2, "spots", n)
        covariance = pixel_covariances(spot_covariance, n, "spot_covariance")
        xyz, xyz_covariance = np.empty((n, 3)), np.empty((n, 3, 3))
        call(
            lib.ptzcal_rig_model_locate,
            byref(self._struct),
            address_of(pan_tilt),
            address_of(spots),
            address_of_optional(covariance),
            n,
            address_of(xyz),
            address_of(xyz_covariance),
        )
        return xyz, xyz_covariance

    def aim(self, xyz: Any) -> PanTilt:
        """The readings at which the laser hits a point (3,) of the rig's world, metres."""
        point = vector(xyz, 3, "xyz")
        pan, tilt = c_double(), c_double()
        call(
            lib.ptzcal_rig_model_aim,
            byref(self._struct),
            address_of(point),
            byref(pan),
            byref(tilt),
        )
        return PanTilt(pan.value, tilt.value)


_RIG_MEMBERS = [
    f.name for f in fields(RigModel) if f.name.startswith(("laser_", "axis_", "pan_", "tilt_"))
]
