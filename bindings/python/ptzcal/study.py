"""Before and while a rig works: noise study, precision label, plan, next best shots."""

from __future__ import annotations

import enum
from ctypes import byref, c_size_t
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Callable, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _callbacks, _native, _structs
from ._arrays import address_of, member, numbers, rows, unsigned, vector
from ._native import Handle, Path, call, lib, path as encoded
from .adjust import RigParameter
from .calibrate import chosen_options
from .camera import Camera
from .cancel import Cancel, pointer_of
from .rig_model import RigModel
from .scan import Region, Scan


class StudyMethod(enum.IntEnum):
    """How the fixed camera is estimated. See ptzcal.h."""

    DLT_EXACT = 0  #: exact 3D points: no cascade
    DLT_CASCADE_PRINTED = 1  #: eq. (23) as printed: a rigid motion; needs control points
    DLT_CASCADE = 2  #: noisy spots, so noisy points
    CLOSED_FORM = 3
    JOINT_ML = 4


class StudyDraws(enum.IntEnum):
    """Which noise the levels share."""

    COMMON = 0
    INDEPENDENT = 1


class StudyQuantity(enum.IntEnum):
    """The order of every array of four errors: metres, radians, pixels, pixels."""

    POSITION = 0
    ROTATION = 1
    FOCAL = 2
    PRINCIPAL_POINT = 3


class StudyPlot(enum.IntEnum):
    """Charts of a study."""

    ERRORS = 0  #: of a quantity, against noise
    GRID = 1  #: of a method, over the noises of both cameras
    SCATTER = 2  #: of a level, from above


Method = Union[StudyMethod, str, int]
Quantity = Union[StudyQuantity, str, int]
Progress = Callable[[int, int], Any]


@dataclass(frozen=True)
class StudyCell:
    """Errors of one method at one level; arrays in the order of StudyQuantity."""

    head_sigma: float
    fixed_sigma: float
    used: int  #: trials that gave a camera
    failures: int
    mean: np.ndarray
    rms: np.ndarray
    bias: np.ndarray
    expected: np.ndarray  #: rms by the covariance of maximum likelihood


@dataclass(frozen=True)
class LabelRow:
    """Root mean square errors up to a working distance, at a noise level."""

    distance: float
    head_sigma: float
    fixed_sigma: float
    shots: int
    failures: int
    simulated: np.ndarray  #: in the order of StudyQuantity
    expected: np.ndarray
    handoff_simulated: float  #: of a point handed off at the distance, metres
    handoff_expected: float


@dataclass(frozen=True)
class PlannedShots:
    """Shots in the order of their value."""

    pan_tilt: np.ndarray  #: (n, 2) readings, radians
    depth: np.ndarray  #: (n,) expected, metres
    rms: np.ndarray  #: (n,) expected error of the position after each shot, metres
    semi_axis: np.ndarray  #: (n,) its largest semi-axis

    def __len__(self) -> int:
        return len(self.depth)

    @classmethod
    def _of(cls, values: np.ndarray) -> "PlannedShots":
        table = values.reshape(-1, 5)
        return cls(table[:, :2], table[:, 2], table[:, 3], table[:, 4])


def _levels(levels: Any) -> np.ndarray:
    """(n, 2) of head and fixed noise; n numbers are the same noise on both."""
    array = numbers(levels, "levels")
    return np.repeat(array[:, None], 2, axis=1) if array.ndim == 1 else rows(array, 2, "levels")


def _options(methods: Sequence[Method], trials: int, draws: Any, threads: int, seed: int) -> Any:
    options = _native.initial(_structs.ptzcal_study_options)
    options.methods = sum({1 << member(StudyMethod, m, "method") for m in methods})
    options.trials, options.threads = unsigned(trials, "trials"), unsigned(threads, "threads")
    options.draws = member(StudyDraws, draws, "draws")
    options.seed = unsigned(seed, "seed", 64)
    return options


class Site(Handle):
    """A rig, the fixed camera that it will calibrate, and what surrounds both.

    The camera is the truth of a study and a guess for a plan; its pose is in the rig's frame.
    """

    _free = "ptzcal_site_free"

    def __init__(
        self,
        model: RigModel,
        camera: Camera,
        *,
        rig_sigmas: Optional[Mapping[str, float]] = None,
        pointing_sigma: Tuple[float, float] = (0.0, 0.0),
        lens: Optional[Camera] = None,
        skew_sigma: Optional[float] = None,
        aspect_sigma: Optional[float] = None,
    ) -> None:
        """rig_sigmas: standard deviations by the names of RigParameter, as laser_x0; the others are
        known exactly. pointing_sigma: of single moves' pan and tilt, radians. lens, skew_sigma,
        aspect_sigma: as in calibrate_camera; the lens model that is fitted is the camera's.
        """
        self._make(lib.ptzcal_site_new, byref(model._struct), byref(camera._struct))
        self._size = camera.width, camera.height
        if rig_sigmas:
            sigmas = np.zeros(len(RigParameter))
            for name, sigma in rig_sigmas.items():
                sigmas[member(RigParameter, name, "rig_sigmas")] = sigma
            call(lib.ptzcal_site_set_rig_sigmas, self._pointer, address_of(sigmas))
        call(lib.ptzcal_site_set_pointing_sigma, self._pointer, *pointing_sigma)
        if (lens, skew_sigma, aspect_sigma) != (None, None, None):
            options = chosen_options(
                distortion=camera.distortion_model,
                lens=lens,
                skew_sigma=skew_sigma,
                aspect_sigma=aspect_sigma,
            )
            assert options is not None
            call(lib.ptzcal_site_set_estimate, self._pointer, options._pointer)

    def set_plane(self, normal: Any, distance: float) -> None:
        """One plane, normal . x = distance."""
        array = vector(normal, 3, "normal")
        call(lib.ptzcal_site_set_plane, self._pointer, address_of(array), distance)

    def set_room(self, low: Any, high: Any, boxes: Any = ()) -> None:
        """A room seen from inside, with boxes (n, 2, 3): low and high corners."""
        room = np.concatenate([vector(low, 3, "low"), vector(high, 3, "high")])
        corners = rows(np.reshape(numbers(boxes, "boxes"), (-1, 6)), 6, "boxes")
        call(lib.ptzcal_site_set_room, self._pointer, address_of(room), address_of(corners), len(corners))

    def set_depths(self, nearest: float, farthest: float) -> None:
        """Nothing but the depths that occur."""
        call(lib.ptzcal_site_set_depths, self._pointer, nearest, farthest)

    def set_up(self, shots: Union[Region, Scan, Any]) -> "SetUp":
        """Noiseless shots: of a region in the surroundings, of a scan, or of points (n, 3)."""
        if isinstance(shots, Region):
            return SetUp._of(lib.ptzcal_set_up_from_region, self._pointer, byref(shots._struct()))
        if isinstance(shots, Scan):
            return SetUp._of(lib.ptzcal_set_up_from_scan, self._pointer, shots._pointer)
        xyz = rows(shots, 3, "shots")
        return SetUp._of(lib.ptzcal_set_up_from_points, self._pointer, address_of(xyz), len(xyz))

    def plan(
        self,
        region: Region,
        target: float,
        *,
        head_sigma: float = 0.2,
        fixed_sigma: float = 0.2,
        max_positions: int = 20_000,
        cancel: Optional[Cancel] = None,
    ) -> "Plan":
        """How many shots of the region, and where, for an rms error of the position of `target` metres.

        The region's steps do not matter. Error (UNREACHABLE) says why it cannot be reached.
        """
        options = _native.initial(_structs.ptzcal_plan_options)
        options.pan_min, options.pan_max = region.pan_min, region.pan_max
        options.tilt_min, options.tilt_max = region.tilt_min, region.tilt_max
        options.head_sigma, options.fixed_sigma, options.target = head_sigma, fixed_sigma, target
        options.max_positions = unsigned(max_positions, "max_positions")
        plan = Plan.__new__(Plan)
        plan._make(lib.ptzcal_plan_make, self._pointer, byref(options), pointer_of(cancel))
        plan._region = region
        return plan

    def next_shots(
        self,
        pan_tilt: Any,
        depth: Any,
        seen: Any,
        candidates: Region,
        count: int = 1,
        *,
        head_sigma: float = 0.2,
        fixed_sigma: float = 0.2,
        target: float = 0.0,
    ) -> Tuple[Tuple[float, float], PlannedShots]:
        """Where to shoot next, given readings (n, 2), depths (n,) and whether the camera saw them (n,).

        Returns the expected error of the position so far (rms and largest semi-axis, metres;
        infinite while it is not determined), and the chosen shots: `count`, or as many as reach
        `target`; the best of those that were seen are shot again and again. With a target the first may be
        a look at a place of which little is known. Asked after every shot, with the target, it needs fewest.
        """
        readings = rows(pan_tilt, 2, "pan_tilt")
        depths = vector(depth, len(readings), "depth")
        flags = vector(np.asarray(seen, dtype=bool), len(readings), "seen")
        scanned = np.ascontiguousarray(np.column_stack([readings, depths, flags]))
        now, needed = np.empty(2), c_size_t()
        shots = np.empty(5 * unsigned(count, "count"))
        call(
            lib.ptzcal_next_shots,
            self._pointer,
            address_of(scanned),
            len(scanned),
            byref(candidates._struct()),
            head_sigma,
            fixed_sigma,
            target,
            count,
            address_of(now),
            address_of(shots),
            len(shots),
            byref(needed),
        )
        return (float(now[0]), float(now[1])), PlannedShots._of(shots[: needed.value])


class SetUp(Handle):
    """A site with noiseless shots. len() is their number."""

    _free = "ptzcal_set_up_free"

    @classmethod
    def _of(cls, function: Any, *arguments: Any) -> "SetUp":
        made = cls.__new__(cls)
        made._make(function, *arguments)
        return made

    def __len__(self) -> int:
        count = c_size_t()
        call(lib.ptzcal_set_up_get_count, self._pointer, byref(count))
        return count.value

    def set_control(self, xyz: Any) -> None:
        """Points (n, 3) that the head camera sees, for the cascade as printed."""
        array = rows(xyz, 3, "xyz")
        call(lib.ptzcal_set_up_set_control, self._pointer, address_of(array), len(array))

    def study(
        self,
        levels: Any,
        *,
        methods: Sequence[Method] = ("dlt_exact", "dlt_cascade", "closed_form", "joint_ml"),
        distances: Any = (),
        trials: int = 100,
        draws: Union[StudyDraws, str, int] = StudyDraws.COMMON,
        threads: int = 1,
        seed: int = 1,
        progress: Optional[Progress] = None,
        cancel: Optional[Cancel] = None,
    ) -> "Study":
        """Monte Carlo at noise levels (n, 2): head and fixed camera, px; n numbers: the same on both.

        progress: progress(done, total); a true result stops the study (Cancelled).
        """
        noise, far = _levels(levels), np.atleast_1d(numbers(distances, "distances"))
        options = _options(methods, trials, draws, threads, seed)
        return Study._made(
            _callbacks.call,
            lib.ptzcal_study_run,
            self._pointer,
            address_of(noise),
            len(noise),
            address_of(far),
            len(far),
            byref(options),
            _callbacks.reporter(progress),
            None,
            pointer_of(cancel),
        )

    def label(
        self,
        distances: Any,
        levels: Any,
        *,
        method: Method = StudyMethod.JOINT_ML,
        trials: int = 100,
        threads: int = 1,
        seed: int = 1,
        progress: Optional[Progress] = None,
        cancel: Optional[Cancel] = None,
    ) -> "PrecisionLabel":
        """The precision label: errors against working distance (m) and noise (px)."""
        noise, far = _levels(levels), np.atleast_1d(numbers(distances, "distances"))
        options = _options([method], trials, StudyDraws.COMMON, threads, seed)
        return PrecisionLabel._made(
            _callbacks.call,
            lib.ptzcal_label_make,
            self._pointer,
            address_of(far),
            len(far),
            address_of(noise),
            len(noise),
            byref(options),
            _callbacks.reporter(progress),
            None,
            pointer_of(cancel),
        )


class Study(Handle):
    """The answer of a study. Immutable."""

    _free = "ptzcal_study_free"

    def cell(self, method: Method, level: int) -> StudyCell:
        struct = _native.initial(_structs.ptzcal_study_cell)
        which = member(StudyMethod, method, "method")
        call(lib.ptzcal_study_get_cell, self._pointer, which, unsigned(level, "level"), byref(struct))
        four = [np.array(a) for a in (struct.mean, struct.rms, struct.bias, struct.expected)]
        return StudyCell(struct.head_sigma, struct.fixed_sigma, struct.used, struct.failures, *four)

    def handoff(self, method: Method, level: int) -> np.ndarray:
        """Rms errors of points handed off at each of the study's distances, metres."""
        which, needed = member(StudyMethod, method, "method"), c_size_t()
        values = np.empty(1000)
        place = unsigned(level, "level")
        call(
            lib.ptzcal_study_copy_handoff,
            self._pointer,
            which,
            place,
            address_of(values),
            len(values),
            byref(needed),
        )
        return values[: needed.value]

    def save_csv(self, path: Path) -> None:
        call(lib.ptzcal_study_save_csv, self._pointer, encoded(path))

    def save_json(self, path: Path) -> None:
        call(lib.ptzcal_study_save_json, self._pointer, encoded(path))

    def save_plot(self, path: Path, plot: Union[StudyPlot, str, int], of: Any = 0) -> None:
        """An SVG: of a quantity (errors), of a method (grid), of a level's index (scatter)."""
        kind = member(StudyPlot, plot, "plot")
        kinds = {StudyPlot.ERRORS: StudyQuantity, StudyPlot.GRID: StudyMethod}
        which = member(kinds[kind], of, "of") if kind in kinds else unsigned(of, "of")
        call(lib.ptzcal_study_save_plot, self._pointer, kind, which, encoded(path))


class PrecisionLabel(Handle):
    """What can be expected of a set-up. Immutable."""

    _free = "ptzcal_label_free"

    @cached_property
    def rows(self) -> List[LabelRow]:
        """Distance by distance, level by level within; none for distances without enough shots."""
        count, struct = c_size_t(), _native.initial(_structs.ptzcal_label_row)
        call(lib.ptzcal_label_get_count, self._pointer, byref(count))
        found = []
        for index in range(count.value):
            call(lib.ptzcal_label_get_row, self._pointer, index, byref(struct))
            noise = struct.head_sigma, struct.fixed_sigma
            errors = np.array(struct.simulated), np.array(struct.expected)
            handoff = struct.handoff_simulated, struct.handoff_expected
            row = struct.distance, *noise, struct.shots, struct.failures, *errors, *handoff
            found.append(LabelRow(*row))
        return found

    def save_csv(self, path: Path) -> None:
        call(lib.ptzcal_label_save_csv, self._pointer, encoded(path))

    def save_json(self, path: Path) -> None:
        call(lib.ptzcal_label_save_json, self._pointer, encoded(path))

    def save_plot(self, path: Path, of: Quantity = StudyQuantity.POSITION) -> None:
        """An SVG: a quantity against the working distance, or "handoff"."""
        handoff = isinstance(of, str) and of.lower() == "handoff"
        which = _native.LABEL_HANDOFF if handoff else member(StudyQuantity, of, "of")
        call(lib.ptzcal_label_save_plot, self._pointer, which, encoded(path))


class Plan(Handle):
    """How to reach a target accuracy. Immutable."""

    _free = "ptzcal_plan_free"
    _region: Region

    @cached_property
    def _summary(self) -> Any:
        struct = _native.initial(_structs.ptzcal_plan_summary)
        call(lib.ptzcal_plan_get_summary, self._pointer, byref(struct))
        return struct

    @property
    def grid(self) -> Region:
        """The coarsest grid that reaches the target."""
        r, s = self._region, self._summary
        return Region(r.pan_min, r.pan_max, r.tilt_min, r.tilt_max, s.pan_steps, s.tilt_steps)

    @property
    def grid_seen(self) -> int:
        """Of its positions those that both cameras see."""
        return self._summary.grid_seen

    @property
    def grid_rms(self) -> float:
        """Expected error of the position after it, metres."""
        return self._summary.grid_rms

    @property
    def limit_rms(self) -> float:
        """What any number of shots would leave."""
        return self._summary.limit_rms

    @property
    def limited_by(self) -> Optional[RigParameter]:
        """The rig's parameter to blame for it; None when the rig is known exactly."""
        number = self._summary.limited_by
        return None if number < 0 else RigParameter(number)

    @cached_property
    def shots(self) -> PlannedShots:
        """Chosen shots that reach the target too."""
        values, needed = np.empty(5 * self._summary.shots), c_size_t()
        call(
            lib.ptzcal_plan_copy_shots,
            self._pointer,
            address_of(values),
            len(values),
            byref(needed),
        )
        return PlannedShots._of(values)
