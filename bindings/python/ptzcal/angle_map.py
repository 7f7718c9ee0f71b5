"""Which angles the numbers of a head without angles are."""

from __future__ import annotations

from ctypes import byref, c_double
from dataclasses import dataclass
from typing import NamedTuple, Tuple

from . import _native, _structs
from ._native import Handle, Path, call, lib
from .rig_model import PanTilt


@dataclass(frozen=True)
class AngleSummary:
    """What a map covers, and how well it was learned (0 where it was not)."""

    frames: int  #: pictures
    pairs: int  #: pairs of pictures that were matched
    raw: Tuple[float, ...]  #: numbers covered: least and greatest pan, least and greatest tilt
    angles: Tuple[float, ...]  #: radians covered, in the same order
    mounting: Tuple[float, ...]  #: collimation, roll, trunnion, radians
    mounting_sigma: Tuple[float, ...]
    rms: float  #: of the matches' residuals, px
    outliers: float  #: share of the matches
    repeatability: Tuple[float, ...]  #: of pan and tilt, radians
    parallax: float
    parallax_sigma: float


class SureAngles(NamedTuple):
    """Radians, with standard deviations."""

    pan: float
    tilt: float
    pan_sigma: float
    tilt_sigma: float


class AngleMap(Handle):
    """A map, from `learn_angles` or a file. Immutable."""

    _free = "ptzcal_angle_map_free"

    def __init__(self, path: Path) -> None:
        """Reads a map's file."""
        self._make(lib.ptzcal_angle_map_read, _native.path(path))

    def save(self, path: Path) -> None:
        """Writes the map, with the residuals of its learning, as JSON."""
        call(lib.ptzcal_angle_map_save, self._pointer, _native.path(path))

    def summary(self) -> AngleSummary:
        struct = _native.initial(_structs.ptzcal_angle_summary)
        call(lib.ptzcal_angle_map_get_summary, self._pointer, byref(struct))
        values = {}
        for name in AngleSummary.__annotations__:
            value = getattr(struct, name)
            values[name] = value if isinstance(value, (int, float)) else tuple(value)
        return AngleSummary(**values)

    def to_angles(self, raw_pan: float, raw_tilt: float) -> SureAngles:
        """Radians of the head's numbers."""
        out = [c_double() for _ in range(4)]
        call(
            lib.ptzcal_angle_map_to_angles, self._pointer, raw_pan, raw_tilt, *map(byref, out)
        )
        return SureAngles(*(value.value for value in out))

    def to_raw(self, pan: float, tilt: float) -> PanTilt:
        """The head's numbers of angles, radians."""
        raw_pan, raw_tilt = c_double(), c_double()
        call(
            lib.ptzcal_angle_map_to_raw, self._pointer, pan, tilt, byref(raw_pan), byref(raw_tilt)
        )
        return PanTilt(raw_pan.value, raw_tilt.value)
