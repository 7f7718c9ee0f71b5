"""SIFT features (Lowe 2004) and their matches."""

from __future__ import annotations

from ctypes import byref, c_size_t
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, contiguous, rows, unsigned
from ._native import Handle, call, lib
from .images import Image, PixelFormat, view

_NUMBERS, _BYTES = 9, 128


class _Features(Handle):
    _free = "ptzcal_sift_features_free"

    def __init__(self, function: Any, *arguments: Any) -> None:
        self._make(function, *arguments)


class SiftFeatures:
    """Keypoints of an image, the strongest first, and their descriptors.

    They can be made again from `keypoints` and `descriptors` that were kept.
    """

    keypoints: np.ndarray  #: (n, 9): xy, scale, angle, response, octave, sigma, elongation, direction
    descriptors: np.ndarray  #: (n, 128), uint8, of length 512

    def __init__(self, keypoints: Any, descriptors: Any) -> None:
        keypoints = rows(keypoints, _NUMBERS, "keypoints")
        descriptors = contiguous(descriptors)
        if descriptors.dtype != np.uint8 or descriptors.shape != (len(keypoints), _BYTES):
            shape = f"({len(keypoints)}, {_BYTES})"
            raise ValueError(f"descriptors must be uint8 of shape {shape}, not {descriptors.shape}")
        self._take(
            _Features(
                lib.ptzcal_sift_features_new,
                address_of(keypoints),
                address_of(descriptors),
                len(keypoints),
            )
        )

    def _take(self, handle: _Features) -> None:
        self._handle = handle
        count = c_size_t()
        call(lib.ptzcal_sift_features_count, handle._pointer, byref(count))
        self.keypoints = np.empty((count.value, _NUMBERS))
        self.descriptors = np.empty((count.value, _BYTES), np.uint8)
        for copy, array in (
            (lib.ptzcal_sift_features_copy_keypoints, self.keypoints),
            (lib.ptzcal_sift_features_copy_descriptors, self.descriptors),
        ):
            call(copy, handle._pointer, address_of(array), array.size, None)
            array.flags.writeable = False

    def __len__(self) -> int:
        return len(self.keypoints)

    @property
    def xy(self) -> np.ndarray:
        """(n, 2), pixels; (0, 0) is the centre of the top-left pixel."""
        return self.keypoints[:, :2]

    @property
    def scale(self) -> np.ndarray:
        """(n,), standard deviation of the Gaussian, pixels; half of OpenCV's size."""
        return self.keypoints[:, 2]

    @property
    def angle(self) -> np.ndarray:
        """(n,), radians from x towards y."""
        return self.keypoints[:, 3]

    @property
    def response(self) -> np.ndarray:
        """(n,), difference of Gaussians of an image from 0 to 1, without its sign."""
        return self.keypoints[:, 4]

    @property
    def octave(self) -> np.ndarray:
        """(n,), -1 for the doubled image, 0 for the image, 1 for half of it, and so on."""
        return self.keypoints[:, 5].astype(int)

    @property
    def sigma(self) -> np.ndarray:
        """(n,), standard deviation of x and of y that is typical of the scale, pixels."""
        return self.keypoints[:, 6]

    @property
    def elongation(self) -> np.ndarray:
        """(n,), 1 or more: standard deviation of the place along `direction` over that across it."""
        return self.keypoints[:, 7]

    @property
    def direction(self) -> np.ndarray:
        """(n,), radians from x towards y: where the place is least sure."""
        return self.keypoints[:, 8]

    def __repr__(self) -> str:
        return f"<ptzcal.SiftFeatures: {len(self)}>"


@dataclass(frozen=True, eq=False)
class SiftMatches:
    """Matches of two images' features, by ascending index in the first."""

    a: np.ndarray  #: (n,), indices in the first image's features
    b: np.ndarray  #: (n,), indices in the second's
    distance: np.ndarray  #: (n,), between descriptors of length 512
    ratio: np.ndarray  #: (n,), to the second nearest's distance

    def __len__(self) -> int:
        return len(self.a)


def detect_sift(
    image: Image,
    *,
    max_features: int = 0,
    contrast_threshold: Optional[float] = None,
    edge_ratio: Optional[float] = None,
    upsample: bool = True,
    format: Union[PixelFormat, str, int, None] = None,
) -> SiftFeatures:
    """Finds and describes the keypoints of an image: all, or the strongest `max_features`.

    upsample: whether the image is doubled first, four times the time for about three times the
    keypoints. The image is a uint8 array, see ptzcal.images.Image; one without contrast has no
    keypoints.
    """
    options = _native.initial(_structs.ptzcal_sift_options)
    options.max_features = unsigned(max_features, "max_features")
    options.upsample = bool(upsample)
    if contrast_threshold is not None:
        options.contrast_threshold = contrast_threshold
    if edge_ratio is not None:
        options.edge_ratio = edge_ratio
    features = SiftFeatures.__new__(SiftFeatures)
    features._take(_Features(lib.ptzcal_detect_sift, view(image, format, "image"), options))
    return features


def match_sift(
    a: SiftFeatures, b: SiftFeatures, *, max_ratio: Optional[float] = None, mutual: bool = True
) -> SiftMatches:
    """Matches features by exact search, Lowe's ratio test (0.8 by default) and a mutual check."""
    options = _native.initial(_structs.ptzcal_sift_match_options)
    options.mutual = bool(mutual)
    if max_ratio is not None:
        options.max_ratio = max_ratio
    pairs, distances = np.empty((len(a), 2), np.uint32), np.empty((len(a), 2))
    count = c_size_t()
    call(
        lib.ptzcal_match_sift,
        a._handle._pointer,
        b._handle._pointer,
        options,
        address_of(pairs),
        address_of(distances),
        len(a),
        byref(count),
    )
    pairs, distances = pairs[: count.value].astype(int), distances[: count.value]
    return SiftMatches(pairs[:, 0], pairs[:, 1], distances[:, 0], distances[:, 1])
