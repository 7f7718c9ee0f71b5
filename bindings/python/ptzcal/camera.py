"""Cameras: projection with lens distortion and back, vectorised."""

from __future__ import annotations

import enum
from ctypes import byref
from dataclasses import dataclass, field
from typing import Any, Sequence, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, member, numbers, rows_or_one, unsigned
from ._native import call, lib


class DistortionModel(enum.IntEnum):
    """Lens models; the order of the coefficients is beside each."""

    NONE = 0
    RADIAL1 = 1  #: k1
    RADIAL2 = 2  #: k1 k2
    BROWN_CONRADY = 3  #: k1 k2 p1 p2 k3, with OpenCV's meaning
    DIVISION = 4  #: lambda; negative is barrel distortion
    FISHEYE = 5  #: k1 k2 k3 k4 of the angle from the axis, with OpenCV's meaning


def lens_into(struct: Any, lens: Any) -> None:
    """The members that cameras and rig models share."""
    struct.width = unsigned(lens.width, "width")
    struct.height = unsigned(lens.height, "height")
    struct.distortion_model = lens.distortion_model
    struct.fx, struct.fy, struct.skew = lens.fx, lens.fy, lens.skew
    struct.cx, struct.cy = lens.cx, lens.cy
    struct.distortion = lens.distortion


def checked_distortion(model: Any, coefficients: Any) -> Tuple[DistortionModel, Tuple[float, ...]]:
    """The model as an enum, the coefficients as 8 floats."""
    values = numbers(coefficients, "distortion").ravel().tolist()
    if len(values) > 8:
        raise ValueError(f"distortion has {len(values)} coefficients; there are at most 8")
    values += [0.0] * (8 - len(values))
    return member(DistortionModel, model, "distortion_model"), tuple(values)


@dataclass(frozen=True, eq=False)
class Camera:
    """A calibrated camera. Immutable; ``dataclasses.replace`` makes a changed one.

    Pixels, metres. Pixel (0, 0) is the centre of the top-left pixel. The pose is world to camera,
    x = R X + t, with x right, y down, z forward.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    skew: float = 0.0
    distortion_model: Union[DistortionModel, str, int] = DistortionModel.NONE
    distortion: Sequence[float] = ()
    R: np.ndarray = ((1, 0, 0), (0, 1, 0), (0, 0, 1))  # type: ignore[assignment]
    t: np.ndarray = (0, 0, 0)  # type: ignore[assignment]
    _struct: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        model, coefficients = checked_distortion(self.distortion_model, self.distortion)
        R, t = numbers(self.R, "R"), numbers(self.t, "t").ravel()
        if R.shape != (3, 3) or t.shape != (3,):
            raise ValueError(
                f"R must be of shape (3, 3) and t (3,), not {R.shape} and {np.shape(self.t)}"
            )
        for name, array in (("R", R), ("t", t)):
            array = array.copy()
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        object.__setattr__(self, "distortion_model", model)
        object.__setattr__(self, "distortion", coefficients)
        struct = _native.initial(_structs.ptzcal_camera)
        lens_into(struct, self)
        struct.rotation = tuple(self.R.ravel())
        struct.translation = tuple(self.t)
        object.__setattr__(self, "_struct", struct)

    @classmethod
    def from_matrix(
        cls,
        K: Any,
        size: Tuple[int, int],
        distortion: Any = (),
        R: Any = ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        t: Any = (0, 0, 0),
    ) -> "Camera":
        """From a 3 x 3 matrix, (width, height) and OpenCV's k1 k2 p1 p2 [k3]."""
        K = numbers(K, "K")
        if K.shape != (3, 3):
            raise ValueError(f"K must be of shape (3, 3), not {K.shape}")
        coefficients = numbers(distortion, "distortion").ravel().tolist()
        if len(coefficients) > 5:
            raise ValueError("distortion must be k1 k2 p1 p2 [k3]: other lens models are not here")
        known = any(coefficients)
        model = DistortionModel.BROWN_CONRADY if known else DistortionModel.NONE
        fx, skew, cx, fy, cy = K[0, 0], K[0, 1], K[0, 2], K[1, 1], K[1, 2]
        return cls(*size, fx, fy, cx, cy, skew, model, coefficients if known else (), R, t)

    @classmethod
    def _from_struct(cls, s: _structs.ptzcal_camera) -> "Camera":
        return cls(
            s.width,
            s.height,
            s.fx,
            s.fy,
            s.cx,
            s.cy,
            s.skew,
            s.distortion_model,
            tuple(s.distortion),
            np.array(s.rotation).reshape(3, 3),
            np.array(s.translation),
        )

    @property
    def size(self) -> Tuple[int, int]:
        """(width, height) in pixels."""
        return self.width, self.height

    @property
    def K(self) -> np.ndarray:
        """The 3 x 3 intrinsic matrix, pixels."""
        return np.array([[self.fx, self.skew, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def centre(self) -> np.ndarray:
        """The camera's centre in the world, -R^T t, metres."""
        centre = np.empty(3)
        call(lib.ptzcal_camera_centre, byref(self._struct), address_of(centre))
        return centre

    def project(self, xyz: Any) -> np.ndarray:
        """World points (n, 3) in metres, or one (3,), to pixels (n, 2) or (2,).

        Raises Error BEHIND_CAMERA or OUTSIDE_LENS with the index of the first such point.
        """
        points, one = rows_or_one(xyz, 3, "xyz")
        uv = np.empty((len(points), 2))
        call(
            lib.ptzcal_camera_project,
            byref(self._struct),
            address_of(points),
            len(points),
            address_of(uv),
        )
        return uv[0] if one else uv

    def back_project(self, uv: Any) -> np.ndarray:
        """Pixels (n, 2), or one (2,), to unit directions (n, 3) or (3,) in the world.

        The rays begin at the camera's centre. Raises Error OUTSIDE_LENS with the index.
        """
        pixels, one = rows_or_one(uv, 2, "uv")
        directions = np.empty((len(pixels), 3))
        call(
            lib.ptzcal_camera_back_project,
            byref(self._struct),
            address_of(pixels),
            len(pixels),
            address_of(directions),
        )
        return directions[0] if one else directions

    def save(self, path: _native.Path) -> None:
        """Writes the camera as JSON."""
        call(lib.ptzcal_camera_save, byref(self._struct), _native.path(path))

    def save_opencv(self, path: _native.Path) -> None:
        """Writes the camera as OpenCV's YAML, with the pose in keys of our own."""
        call(lib.ptzcal_camera_save_opencv, byref(self._struct), _native.path(path))

    @classmethod
    def load(cls, path: _native.Path) -> "Camera":
        """Reads the camera of a file that Camera.save or Calibration.save wrote."""
        return cls._loaded(lib.ptzcal_camera_load, path)

    @classmethod
    def load_opencv(cls, path: _native.Path) -> "Camera":
        """Reads a camera from OpenCV's YAML; without our keys its pose is the identity."""
        return cls._loaded(lib.ptzcal_camera_load_opencv, path)

    @classmethod
    def _loaded(cls, function: Any, path: _native.Path) -> "Camera":
        struct = _native.initial(_structs.ptzcal_camera)
        call(function, _native.path(path), byref(struct))
        return cls._from_struct(struct)
