"""The laser's spot in frames with the laser on and off."""

from __future__ import annotations

import enum
from ctypes import POINTER, byref, pointer
from dataclasses import dataclass
from typing import Any, List, Optional, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, member, rows, unsigned
from ._native import Handle, call, lib
from .images import Image, PixelFormat, view


class LaserColour(enum.IntEnum):
    UNKNOWN = 0  #: whichever channel differs most
    RED = 1
    GREEN = 2
    BLUE = 3
    WHITE = 4  #: infrared, or a monochrome camera


@dataclass(frozen=True, eq=False)
class Spot:
    """A laser spot in an image; pixel (0, 0) is the centre of the top-left pixel."""

    x: float
    y: float
    covariance: np.ndarray  #: (2, 2), px^2
    peak: float  #: greatest difference between on and off, grey levels
    signal_to_noise: float
    area: int  #: pixels above the threshold
    saturated: bool  #: pixels of the spot are at the sensor's limit

    @classmethod
    def _from_struct(cls, s: _structs.ptzcal_spot) -> "Spot":
        xx, xy, yy = s.covariance
        covariance = np.array([[xx, xy], [xy, yy]])
        return cls(s.x, s.y, covariance, s.peak, s.signal_to_noise, s.area, bool(s.saturated))

    @property
    def centre(self) -> np.ndarray:
        """(x, y) as an array."""
        return np.array([self.x, self.y])


class SpotOptions(Handle):
    """How a spot is searched; what is None keeps the library's default.

    Make one and hand it to many calls of detect_spot.

    region: (x, y, width, height) in pixels. band: (polyline (n, 2) in pixels, half width in
    pixels), such as an epipolar line. colour: of the laser, a LaserColour or its name.
    min_signal_to_noise: of a spot that is believed. max_area: of a spot, pixels.
    ambiguity_ratio: a second candidate of this share of the best one's strength is ambiguous.
    """

    _free = "ptzcal_spot_options_free"

    def __init__(
        self,
        *,
        region: Optional[Tuple[int, int, int, int]] = None,
        band: Optional[Tuple[Any, float]] = None,
        colour: Union[LaserColour, str, int, None] = None,
        min_signal_to_noise: Optional[float] = None,
        max_area: Optional[int] = None,
        ambiguity_ratio: Optional[float] = None,
    ) -> None:
        self._make(lib.ptzcal_spot_options_new)
        if region is not None:
            x, y, width, height = (unsigned(value, "region") for value in region)
            self._set("region", x, y, width, height)
        if band is not None:
            polyline, half_width = band
            line = rows(polyline, 2, "band's polyline")
            self._set("band", address_of(line), len(line), half_width)
        if colour is not None:
            self._set("colour", member(LaserColour, colour, "colour"))
        if min_signal_to_noise is not None:
            self._set("min_signal_to_noise", min_signal_to_noise)
        if max_area is not None:
            self._set("max_area", unsigned(max_area, "max_area"))
        if ambiguity_ratio is not None:
            self._set("ambiguity_ratio", ambiguity_ratio)

    def _set(self, setting: str, *values: Any) -> None:
        call(getattr(lib, f"ptzcal_spot_options_set_{setting}"), self._pointer, *values)


def detect_spot(
    on: Union[Image, List[Image]],
    off: Union[Image, List[Image], None] = None,
    options: Optional[SpotOptions] = None,
    *,
    format: Union[PixelFormat, str, int, None] = None,
    **settings: Any,
) -> Spot:
    """Finds the laser's spot in a frame with the laser on, against one of the same view with it off.

    Lists of frames are averaged. Without `off` the search is much weaker. The frames are uint8
    arrays, see ptzcal.images.Image; settings are those of SpotOptions, in place of `options`.

    Raises SpotNotFound or SpotAmbiguous: there is never a guess.
    """
    options = _either(options, settings)
    chosen = None if options is None else options._pointer
    spot = _native.initial(_structs.ptzcal_spot)
    if isinstance(on, list) or isinstance(off, list):
        on_images, off_images = _views(on, format, "on"), _views(off, format, "off")
        call(
            lib.ptzcal_detect_spot_averaged,
            _pointers(on_images),
            len(on_images),
            _pointers(off_images),
            len(off_images),
            chosen,
            byref(spot),
        )
    else:
        on_image = view(on, format, "on")
        # Kept in a name of its own: the view must outlive the call.
        off_image = None if off is None else view(off, format, "off")
        call(lib.ptzcal_detect_spot, on_image, off_image, chosen, byref(spot))
    return Spot._from_struct(spot)


class SpotDetector(Handle):
    """detect_spot for every frame of a stream: memory is kept from frame to frame.

    One thread at a time may use it; have one for each camera.
    """

    _free = "ptzcal_spot_detector_free"

    def __init__(self, options: Optional[SpotOptions] = None, **settings: Any) -> None:
        """The settings are those of SpotOptions, in place of `options`."""
        options = _either(options, settings)
        self._make(lib.ptzcal_spot_detector_new, None if options is None else options._pointer)

    def detect(
        self,
        on: Union[Image, List[Image]],
        off: Union[Image, List[Image], None] = None,
        *,
        format: Union[PixelFormat, str, int, None] = None,
    ) -> Spot:
        """As detect_spot."""
        spot = _native.initial(_structs.ptzcal_spot)
        on_images, off_images = _views(on, format, "on"), _views(off, format, "off")
        call(
            lib.ptzcal_spot_detector_detect,
            self._pointer,
            _pointers(on_images),
            len(on_images),
            _pointers(off_images),
            len(off_images),
            byref(spot),
        )
        return Spot._from_struct(spot)


def _either(options: Optional[SpotOptions], settings: Any) -> Optional[SpotOptions]:
    if settings and options is not None:
        raise TypeError("give either options or settings, not both")
    return SpotOptions(**settings) if settings else options


def _views(frames: Any, format: Any, name: str) -> List[_structs.ptzcal_image]:
    if frames is None:
        return []
    if not isinstance(frames, list):
        frames = [frames]
    return [view(frame, format, f"{name}[{i}]") for i, frame in enumerate(frames)]


def _pointers(images: List[_structs.ptzcal_image]) -> Any:
    pointers = [pointer(image) for image in images]
    return (POINTER(_structs.ptzcal_image) * len(pointers))(*pointers)
