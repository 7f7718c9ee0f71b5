"""Calibration of a camera from 2D-3D measurements."""

from __future__ import annotations

from ctypes import byref, c_size_t, c_void_p
from functools import cached_property
from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import (
    address_of,
    address_of_optional,
    member,
    pixel_covariances,
    point_covariances,
    rows,
    shaped,
    unsigned,
    vector,
)
from ._native import Handle, call, lib
from .camera import Camera, DistortionModel
from .cancel import Cancel, pointer_of
from .rig_model import RigModel
from .scan import Scan

_COEFFICIENTS: Dict[int, Tuple[str, ...]] = {
    DistortionModel.NONE: (),
    DistortionModel.BROWN_CONRADY: ("k1", "k2", "p1", "p2", "k3"),
    DistortionModel.DIVISION: ("lambda",),
    DistortionModel.FISHEYE: ("k1", "k2", "k3", "k4"),
}


class Correspondences(Handle):
    """2D-3D measurements of one camera, in any mixture; they keep the order of adding."""

    _free = "ptzcal_correspondences_free"

    def __init__(self, width: int, height: int) -> None:
        """An empty set for a camera of this image size, pixels."""
        size = unsigned(width, "width"), unsigned(height, "height")
        self._make(lib.ptzcal_correspondences_new, *size)

    def add_points(
        self, xyz: Any, uv: Any, *, xyz_covariance: Any = None, uv_covariance: Any = None
    ) -> None:
        """Adds points xyz (n, 3), metres, seen at uv (n, 2), pixels.

        xyz_covariance: (n, 3, 3) or (3, 3), m^2; exact points without. uv_covariance: (n, 3):
        xx, xy, yy, or (n, 2, 2), or (2, 2), px^2; the calibration's pixel noise without.
        """
        xyz = rows(xyz, 3, "xyz")
        n = len(xyz)
        uv = rows(uv, 2, "uv", n)
        if xyz_covariance is None and uv_covariance is None:
            call(
                lib.ptzcal_correspondences_add_points,
                self._pointer,
                address_of(xyz),
                address_of(uv),
                n,
            )
            return
        of_xyz = point_covariances(xyz_covariance, n, "xyz_covariance")
        of_uv = pixel_covariances(uv_covariance, n, "uv_covariance")
        call(
            lib.ptzcal_correspondences_add_points_weighted,
            self._pointer,
            address_of(xyz),
            address_of_optional(of_xyz),
            address_of(uv),
            address_of_optional(of_uv),
            n,
        )

    def add_laser_shots(
        self,
        model: RigModel,
        pan_tilt: Any,
        spots: Any,
        uv: Any,
        *,
        spot_covariance: Any = None,
        uv_covariance: Any = None,
    ) -> None:
        """Adds shots: readings pan_tilt (n, 2), radians, the spot in the head camera, spots (n, 2),
        and in this camera, uv (n, 2), pixels. Covariances as in add_points, 1 px without.
        """
        pan_tilt = rows(pan_tilt, 2, "pan_tilt")
        n = len(pan_tilt)
        spots, uv = rows(spots, 2, "spots", n), rows(uv, 2, "uv", n)
        of_spots = pixel_covariances(spot_covariance, n, "spot_covariance")
        of_uv = pixel_covariances(uv_covariance, n, "uv_covariance")
        call(
            lib.ptzcal_correspondences_add_laser_shots,
            self._pointer,
            byref(model._struct),
            address_of(pan_tilt),
            address_of(spots),
            address_of_optional(of_spots),
            address_of(uv),
            address_of_optional(of_uv),
            n,
        )

    def add_lines(
        self,
        xyz: Any,
        uv: Any,
        *,
        directed: bool = False,
        covariance: Any = None,
        uv_covariance: Any = None,
    ) -> None:
        """Adds straight lines, seen as segments with the ends uv (n, 2, 2), pixels.

        xyz (n, 2, 3): two points of each line, metres, or, with directed, a point and a direction.
        The ends are images of no particular points of the line. covariance: (n, 2, 3, 3) of the two
        points, or, with directed, (n, 6, 6) of point and direction; exact lines without.
        uv_covariance: (n, 2, 2, 2) of the ends, or one (2, 2), px^2; the calibration's pixel noise
        without.
        """
        xyz = shaped(xyz, None, (2, 3), "xyz")
        n = len(xyz)
        uv = shaped(uv, n, (2, 2), "uv")
        if covariance is not None:
            shape = (6, 6) if directed else (2, 3, 3)
            covariance = shaped(covariance, n, shape, "covariance")
        if uv_covariance is not None and np.shape(uv_covariance) != (2, 2):
            uv_covariance = shaped(uv_covariance, n, (2, 2, 2), "uv_covariance").reshape(-1, 2, 2)
        of_uv = pixel_covariances(uv_covariance, 2 * n, "uv_covariance")
        add = (
            lib.ptzcal_correspondences_add_directed_lines
            if directed
            else lib.ptzcal_correspondences_add_lines
        )
        call(
            add,
            self._pointer,
            address_of(xyz),
            address_of_optional(covariance),
            address_of(uv),
            address_of_optional(of_uv),
            n,
        )

    def add_scan(self, scan: Scan, camera: int = 0) -> None:
        """Adds what the head camera and a fixed camera, by its number, saw together in a scan."""
        number = unsigned(camera, "camera")
        call(lib.ptzcal_correspondences_add_scan, self._pointer, scan._pointer, number)

    def add_csv(self, path: _native.Path) -> int:
        """Adds the points of a table and returns how many they are.

        Its first line names the columns: x y z (metres) and u v (pixels); optional sigma_x sigma_y
        sigma_z or cov_xx ... cov_zz, sigma_u sigma_v or cov_uu cov_uv cov_vv, name, comment.
        """
        added = c_size_t()
        call(lib.ptzcal_correspondences_add_csv, self._pointer, _native.path(path), byref(added))
        return added.value

    def save_csv(self, path: _native.Path) -> None:
        """Writes the points as a table; Error UNSUPPORTED for laser shots and lines."""
        call(lib.ptzcal_correspondences_save_csv, self._pointer, _native.path(path))

    def __len__(self) -> int:
        count = c_size_t()
        call(lib.ptzcal_correspondences_count, self._pointer, byref(count))
        return count.value


class Calibration(Handle):
    """A calibrated camera with all that says how good it is. Immutable."""

    _free = "ptzcal_calibration_free"

    def __init__(self, correspondences: Correspondences, options: Optional["_Options"]) -> None:
        chosen = None if options is None else options._pointer
        self._make(lib.ptzcal_calibrate_camera, correspondences._pointer, chosen)

    @classmethod
    def _made(cls, function: Any, *arguments: Any) -> "Calibration":
        calibration = cls.__new__(cls)
        calibration._make(function, *arguments)
        return calibration

    @cached_property
    def _summary(self) -> _structs.ptzcal_calibration_summary:
        summary = _native.initial(_structs.ptzcal_calibration_summary)
        call(lib.ptzcal_calibration_get_summary, self._pointer, byref(summary))
        return summary

    @cached_property
    def camera(self) -> Camera:
        struct = _native.initial(_structs.ptzcal_camera)
        call(lib.ptzcal_calibration_get_camera, self._pointer, byref(struct))
        return Camera._from_struct(struct)

    @property
    def parameters(self) -> Tuple[str, ...]:
        """Names of the parameters, in the order of the covariance.

        rx, ry, rz turn the camera about its own axes (radians); X, Y, Z are its centre (metres).
        """
        coefficients = _COEFFICIENTS[self.camera._struct.distortion_model]
        return ("fx", "fy", "skew", "cx", "cy", *coefficients, "rx", "ry", "rz", "X", "Y", "Z")

    @cached_property
    def covariance(self) -> np.ndarray:
        """(p, p) in the order of `parameters`; 0 where a parameter was not free."""
        side = self._summary.parameters
        return self._copied("covariance", np.empty((side, side)))

    @property
    def standard_deviations(self) -> np.ndarray:
        """(p,) in the order of `parameters`."""
        return np.sqrt(np.diagonal(self.covariance))

    @cached_property
    def residuals(self) -> np.ndarray:
        """Measured minus predicted pixel of every measurement, (n, 2), outliers included.

        Of a line: signed distances of its segment's two ends from the line's image, positive to the
        right of it as seen from the first end to the second.
        """
        return self._copied("residuals", np.empty((self.measurements, 2)))

    @cached_property
    def inliers(self) -> np.ndarray:
        """Which measurements were used, (n,) bool."""
        return self._copied("inliers", np.empty(self.measurements, np.uint8)).view(bool)

    def _copied(self, what: str, array: np.ndarray) -> np.ndarray:
        copy = getattr(lib, f"ptzcal_calibration_copy_{what}")
        call(copy, self._pointer, address_of(array), array.size, None)
        array.flags.writeable = False
        return array

    @property
    def measurements(self) -> int:
        return self._summary.measurements

    @property
    def inlier_count(self) -> int:
        return self._summary.inliers

    @property
    def iterations(self) -> int:
        """Of the last refinement."""
        return self._summary.iterations

    @property
    def rms(self) -> float:
        """Root mean square length of the inliers' residuals, pixels."""
        return self._summary.rms

    @property
    def noise_factor(self) -> float:
        """Noise that the residuals show over noise that was assumed."""
        return self._summary.noise_factor

    @property
    def condition(self) -> float:
        """Condition number of the normal equations, scaled to unit diagonal."""
        return self._summary.condition

    @property
    def chi2(self) -> float:
        """Sum of squared residuals over their stated standard deviations, priors included."""
        return self._summary.chi2

    @property
    def degrees_of_freedom(self) -> int:
        """Of chi2."""
        return self._summary.degrees_of_freedom

    @property
    def probability(self) -> float:
        """Chance of such residuals when model and stated noise are right; nothing to go by where the
        noise was estimated from the residuals."""
        return self._summary.probability

    @property
    def warnings(self) -> List[str]:
        """What a person should know, such as a lens that was left out; empty when all is well."""
        warning = lib.ptzcal_calibration_warning
        return [warning(self._pointer, i).decode() for i in range(self._summary.warnings)]

    @property
    def weakest(self) -> str:
        """What the data determine worst, and what to add."""
        return lib.ptzcal_calibration_weakest(self._pointer).decode()

    def project(self, xyz: Any, *, xyz_covariance: Any = None) -> Tuple[np.ndarray, np.ndarray]:
        """World points (n, 3), metres, to pixels (n, 2) and their covariances (n, 2, 2), px^2.

        The covariance holds the camera's uncertainty and the points' own, (n, 3, 3) or (3, 3), m^2.
        Raises Error BEHIND_CAMERA or OUTSIDE_LENS with the index of the first such point.
        """
        xyz = rows(xyz, 3, "xyz")
        n = len(xyz)
        of_xyz = point_covariances(xyz_covariance, n, "xyz_covariance")
        uv, of_uv = np.empty((n, 2)), np.empty((n, 3))
        call(
            lib.ptzcal_calibration_project,
            self._pointer,
            address_of(xyz),
            address_of_optional(of_xyz),
            n,
            address_of(uv),
            address_of(of_uv),
        )
        return uv, of_uv[:, [0, 1, 1, 2]].reshape(n, 2, 2)

    def back_project(self, uv: Any, *, uv_covariance: Any = None) -> Tuple[np.ndarray, np.ndarray]:
        """Pixels (n, 2) to unit directions (n, 3) in the world, and the covariances (n, 6, 6) of the
        rays: of the camera's centre, metres, and the direction, in that order.

        uv_covariance: (n, 3): xx, xy, yy, or (n, 2, 2), or (2, 2), px^2; exact pixels without.
        Raises Error OUTSIDE_LENS with the index.
        """
        uv = rows(uv, 2, "uv")
        n = len(uv)
        of_uv = pixel_covariances(uv_covariance, n, "uv_covariance")
        directions, of_rays = np.empty((n, 3)), np.empty((n, 6, 6))
        call(
            lib.ptzcal_calibration_back_project,
            self._pointer,
            address_of(uv),
            address_of_optional(of_uv),
            n,
            address_of(directions),
            address_of(of_rays),
        )
        return directions, of_rays

    def back_project_to_plane(
        self, uv: Any, normal: Any, distance: float, *, uv_covariance: Any = None
    ) -> Tuple[np.ndarray, np.ndarray]:
        """Points (n, 3), metres, of the plane normal . x = distance under pixels uv (n, 2), and
        their covariances (n, 3, 3), m^2. The plane is exact.

        uv_covariance as in back_project. Raises Error BEHIND_CAMERA with the index of the first
        pixel whose ray does not meet the plane, or OUTSIDE_LENS.
        """
        uv, normal = rows(uv, 2, "uv"), vector(normal, 3, "normal")
        n = len(uv)
        of_uv = pixel_covariances(uv_covariance, n, "uv_covariance")
        xyz, of_xyz = np.empty((n, 3)), np.empty((n, 3, 3))
        call(
            lib.ptzcal_calibration_back_project_to_plane,
            self._pointer,
            address_of(uv),
            address_of_optional(of_uv),
            n,
            address_of(normal),
            distance,
            address_of(xyz),
            address_of(of_xyz),
        )
        return xyz, of_xyz

    def save(self, path: _native.Path) -> None:
        """Writes everything as JSON, to the last bit; Camera.load reads the camera of it, and
        solved_again solves the measurements in it again."""
        call(lib.ptzcal_calibration_save, self._pointer, _native.path(path))

    @classmethod
    def solved_again(cls, path: _native.Path) -> "Calibration":
        """Calibrates from the measurements and options of a file: the same bits as when it was saved.

        Raises Error NOT_FOUND for a file without measurements, and what calibrate_camera raises.
        """
        made, options = Correspondences.__new__(Correspondences), _Options.__new__(_Options)
        pointers = c_void_p(), c_void_p()
        load = lib.ptzcal_calibration_load_inputs
        call(load, _native.path(path), byref(pointers[0]), byref(pointers[1]))
        made._pointer, options._pointer = pointers[0].value, pointers[1].value
        return cls(made, options)

    def __repr__(self) -> str:
        return (
            f"<ptzcal.Calibration: {self.inlier_count} of {self.measurements} used, "
            f"rms {self.rms:.3g} px>"
        )


class _Options(Handle):
    _free = "ptzcal_calibration_options_free"

    def __init__(self, settings: dict) -> None:
        self._make(lib.ptzcal_calibration_options_new)
        for setting, value in settings.items():
            if value is not None:
                setter = getattr(lib, f"ptzcal_calibration_options_set_{setting}")
                call(setter, self._pointer, value)


def calibrate_camera(
    correspondences: Correspondences,
    *,
    distortion: Union[DistortionModel, str, int, None] = None,
    lens: Optional[Camera] = None,
    skew_sigma: Optional[float] = None,
    aspect_sigma: Optional[float] = None,
    pixel_sigma: Optional[float] = None,
    robust: Optional[bool] = None,
    seed: Optional[int] = None,
    max_focal_deviation: Optional[float] = None,
    max_iterations: Optional[int] = None,
    cancel: Optional[Cancel] = None,
) -> Calibration:
    """Finds intrinsics, lens and pose with their covariance; sets gross outliers aside.

    What is None keeps the library's default. distortion: the lens model that is fitted (none).
    lens: a camera whose lens is kept, so that only the pose is found. skew_sigma, aspect_sigma:
    prior standard deviations of skew / f about 0 and of fx / fy about 1 (0.001; 0 forces, inf
    frees). pixel_sigma: noise of pixels added without covariance (estimated). robust: set outliers
    aside (True). max_focal_deviation: greatest relative deviation of the focal length (0.1).

    Raises Error TOO_FEW_POINTS, DEGENERATE (the hint says what to add), NO_CONSENSUS,
    NO_CONVERGENCE or LENS_NOT_MONOTONE; Cancelled.
    """
    options = chosen_options(
        distortion=distortion,
        lens=lens,
        skew_sigma=skew_sigma,
        aspect_sigma=aspect_sigma,
        pixel_sigma=pixel_sigma,
        robust=robust,
        seed=seed,
        max_focal_deviation=max_focal_deviation,
        max_iterations=max_iterations,
        cancel=cancel,
    )
    return Calibration(correspondences, options)


def chosen_options(
    *,
    distortion: Union[DistortionModel, str, int, None] = None,
    lens: Optional[Camera] = None,
    skew_sigma: Optional[float] = None,
    aspect_sigma: Optional[float] = None,
    pixel_sigma: Optional[float] = None,
    robust: Optional[bool] = None,
    seed: Optional[int] = None,
    max_focal_deviation: Optional[float] = None,
    max_iterations: Optional[int] = None,
    cancel: Optional[Cancel] = None,
) -> Optional[_Options]:
    """The options of calibrate_camera; None when all keep their defaults."""
    settings = {
        "distortion": None
        if distortion is None
        else member(DistortionModel, distortion, "distortion"),
        "lens": None if lens is None else byref(lens._struct),
        "skew_sigma": skew_sigma,
        "aspect_sigma": aspect_sigma,
        "pixel_sigma": pixel_sigma,
        "robust": None if robust is None else bool(robust),
        "seed": None if seed is None else unsigned(seed, "seed", 64),
        "max_focal_deviation": max_focal_deviation,
        "max_iterations": None
        if max_iterations is None
        else unsigned(max_iterations, "max_iterations"),
        "cancel": pointer_of(cancel),
    }
    given = any(value is not None for value in settings.values())
    return _Options(settings) if given else None


def radial_alignment(correspondences: Correspondences, centre: Any = None) -> Camera:
    """Radial alignment (Tsai 1987) with the division model: a camera in two linear steps.

    Takes every measurement as it is. centre: (2,), the centre of distortion, pixels (the image's
    centre). The camera's lambda is in units of its normalised plane: over fx fy in pixels^-2.

    Raises Error TOO_FEW_POINTS (below 7) or DEGENERATE.
    """
    return _linear(lib.ptzcal_radial_alignment, correspondences, centre)


def division_eigenproblem(correspondences: Correspondences, centre: Any = None) -> Camera:
    """The direct linear transform with the division model as a generalised eigenproblem
    (Fitzgibbon 2001): the weaker method, meaningless without distortion. As radial_alignment.

    Raises Error TOO_FEW_POINTS (below 6), DEGENERATE (what was wrong with the eigenvalues) or
    NO_CONVERGENCE.
    """
    return _linear(lib.ptzcal_division_eigenproblem, correspondences, centre)


def _linear(function: Any, correspondences: Correspondences, centre: Any) -> Camera:
    given = None if centre is None else rows([centre], 2, "centre")
    struct = _native.initial(_structs.ptzcal_camera)
    call(function, correspondences._pointer, address_of_optional(given), byref(struct))
    return Camera._from_struct(struct)
