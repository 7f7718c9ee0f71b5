"""Edges, straight line segments, lines in space, and which is which."""

from __future__ import annotations

from ctypes import byref, c_double, c_size_t
from dataclasses import dataclass
from typing import Any, Optional, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import (
    address_of,
    address_of_optional,
    pixel_covariances,
    point_covariances,
    rows,
    shaped,
    unsigned,
)
from ._native import call, lib
from .camera import Camera
from .images import Image, PixelFormat, view
from .pictures import DepthMap

Format = Union[PixelFormat, str, int, None]


def detect_edges(
    image: Image,
    low: float = 4.0,
    high: float = 10.0,
    *,
    sigma: float = 0.0,
    format: Format = None,
) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Canny's edges: their places (n, 2), pixels, the unit vectors across them towards the bright
    side (n, 2), and the gradients (n,), grey levels per pixel.

    Edges begin where the gradient reaches `high` and go on while it is at least `low`. sigma: of
    the Gaussian that smooths the image first, pixels; 0: a 3 x 3 binomial filter.
    """
    seen, count, capacity = view(image, format, "image"), c_size_t(), 1 << 16
    while True:
        edges = np.empty((capacity, 5))
        try:
            call(
                lib.ptzcal_detect_edges,
                seen,
                sigma,
                low,
                high,
                address_of(edges),
                capacity,
                byref(count),
            )
            break
        except _native.Error:
            # Too small is the only reason that comes with a count.
            if count.value <= capacity:
                raise
            capacity = count.value
    edges = edges[: count.value]
    return edges[:, :2].copy(), edges[:, 2:4].copy(), edges[:, 4].copy()


@dataclass(frozen=True, eq=False)
class LineSegments:
    """Straight edges of an image, the longest first. On the way from the first point (or end) to
    the second the bright side is on the right.

    `uv` and `uv_covariance` are what Correspondences.add_lines takes.
    """

    uv: np.ndarray  #: (n, 2, 2), two points of each with independent errors, pixels
    uv_covariance: np.ndarray  #: (n, 2, 2, 2), px^2: that across the line, in all directions
    ends: np.ndarray  #: (n, 2, 2), from where to where each is seen, pixels
    contrast: np.ndarray  #: (n,), step from dark to bright, grey levels
    blur: np.ndarray  #: (n,), standard deviation of the edge's blur, pixels
    support: np.ndarray  #: (n,), length less gaps, pixels

    def __len__(self) -> int:
        return len(self.uv)


def detect_line_segments(
    image: Image,
    *,
    min_length: Optional[float] = None,
    min_contrast: Optional[float] = None,
    max_gap: Optional[float] = None,
    max_segments: Optional[int] = None,
    format: Format = None,
) -> LineSegments:
    """Finds straight edges to a few hundredths of a pixel, with their covariances.

    min_length: pixels, 20 by default; min_contrast: grey levels, 12; max_gap: between pieces of one
    line that are joined, pixels, 40. The image is a uint8 array, see ptzcal.images.Image.
    """
    options = _native.initial(_structs.ptzcal_line_options)
    if max_segments is not None:
        options.max_segments = unsigned(max_segments, "max_segments")
    if min_length is not None:
        options.min_length = min_length
    if min_contrast is not None:
        options.min_contrast = min_contrast
    if max_gap is not None:
        options.max_gap = max_gap
    capacity, count = min(options.max_segments, 4096), c_size_t()
    seen = view(image, format, "image")
    while True:
        uv, covariance = np.empty((capacity, 2, 2)), np.empty((capacity, 2, 3))
        ends, details = np.empty((capacity, 2, 2)), np.empty((capacity, 3))
        arrays = [address_of(a) for a in (uv, covariance, ends, details)]
        try:
            call(lib.ptzcal_detect_line_segments, seen, options, *arrays, capacity, byref(count))
            break
        except _native.Error:
            if count.value <= capacity:
                raise
            capacity = count.value
    uv, covariance, ends, details = (a[: count.value] for a in (uv, covariance, ends, details))
    matrices = covariance[..., [0, 1, 1, 2]].reshape(-1, 2, 2, 2)
    return LineSegments(uv.copy(), matrices, ends.copy(), *details.T.copy())


@dataclass(frozen=True, eq=False)
class LineFit:
    """A line through points in space."""

    line: np.ndarray  #: (2, 3): a point, metres, and the unit direction
    covariance: np.ndarray  #: (6, 6), of point and direction
    extent: np.ndarray  #: (2,), from where to where points are on it, metres from the point
    inliers: np.ndarray  #: (n,), bool
    noise_factor: float  #: about 1 where the noise is as stated; 0 without redundancy


def fit_line_3d(
    xyz: Any,
    *,
    covariance: Any = None,
    sigma: Optional[float] = None,
    robust: bool = True,
    outlier_threshold: Optional[float] = None,
    min_inliers: Optional[float] = None,
    seed: int = 1,
) -> LineFit:
    """Fits a straight line to points (n, 3), metres, of which some may be of other things.

    covariance: (n, 3, 3) or one (3, 3); without it every coordinate has the standard deviation
    sigma, 0.01 m by default. Points that are not finite (pixels without depth) are passed over.
    """
    xyz = rows(xyz, 3, "xyz")
    of_points = point_covariances(covariance, len(xyz), "covariance")
    options = _native.initial(_structs.ptzcal_line_fit_options)
    options.robust, options.seed = bool(robust), unsigned(seed, "seed", 64)
    if sigma is not None:
        options.sigma = sigma
    if outlier_threshold is not None:
        options.outlier_threshold = outlier_threshold
    if min_inliers is not None:
        options.min_inliers = min_inliers
    known = np.isfinite(xyz).all(axis=1)
    given = np.ascontiguousarray(xyz[known])
    if of_points is not None:
        of_points = np.ascontiguousarray(of_points[known])
    line, of_line, extent = np.empty((2, 3)), np.empty((6, 6)), np.empty(2)
    inliers, factor = np.zeros(len(given), np.uint8), c_double()
    call(
        lib.ptzcal_fit_line_3d,
        address_of(given),
        address_of_optional(of_points),
        len(given),
        options,
        address_of(line),
        address_of(of_line),
        address_of(extent),
        address_of(inliers),
        byref(factor),
    )
    agree = np.zeros(len(xyz), bool)
    agree[known] = inliers.astype(bool)
    return LineFit(line, of_line, extent, agree, factor.value)


def _arrays_of(segments: LineSegments) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    uv = shaped(segments.uv, None, (2, 2), "segments.uv")
    ends = shaped(segments.ends, len(uv), (2, 2), "segments.ends")
    covariance = shaped(segments.uv_covariance, len(uv), (2, 2, 2), "segments.uv_covariance")
    packed = pixel_covariances(covariance.reshape(-1, 2, 2), 2 * len(uv), "segments.uv_covariance")
    assert packed is not None
    return uv, packed, ends


def lift_line_segments(
    segments: LineSegments,
    camera: Camera,
    depths: DepthMap,
    *,
    inverse_depth_sigma: float = 1.425e-3,
    depth_sigma: float = 1e-3,
) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Finds where line segments of an image with depths lie in space: lines (n, 2, 3), point and
    direction, their covariances (n, 6, 6), extents (n, 2), and which were found (n,), bool.

    Where the depth differs from side to side, the line is the edge of what is in front. The sigmas, of
    inverse depths and of depths besides, are those of a Kinect.
    """
    uv, of_uv, ends = _arrays_of(segments)
    n = len(uv)
    lines, covariance = np.empty((n, 2, 3)), np.empty((n, 6, 6))
    extents, found = np.empty((n, 2)), np.empty(n, np.uint8)
    call(
        lib.ptzcal_lift_line_segments,
        address_of(uv),
        address_of(of_uv),
        address_of(ends),
        n,
        byref(camera._struct),
        depths._pointer,
        inverse_depth_sigma,
        depth_sigma,
        address_of(lines),
        address_of(covariance),
        address_of(extents),
        address_of(found),
    )
    return lines, covariance, extents, found.astype(bool)


@dataclass(frozen=True, eq=False)
class LineMatches:
    """Lines in space and their segments, by ascending line."""

    line: np.ndarray  #: (n,), indices of lines
    segment: np.ndarray  #: (n,), indices of segments
    residual: np.ndarray  #: (n, 2), of the segments' points from the lines' images, pixels

    def __len__(self) -> int:
        return len(self.line)


def match_lines(
    lines: Any,
    extents: Any,
    camera: Camera,
    segments: LineSegments,
    *,
    covariance: Any = None,
    same_polarity: bool = True,
    camera_sigma: Optional[float] = None,
    max_distance: Optional[float] = None,
    min_lead: Optional[float] = None,
    min_overlap: Optional[float] = None,
) -> LineMatches:
    """Matches lines in space with segments of a camera's image, by a first estimate of the camera.

    lines (n, 2, 3): point and direction; extents (n, 2): from where to where each was seen,
    multiples of the direction; covariance (n, 6, 6), exact lines without. camera_sigma: standard
    deviation of the camera's projections, pixels, 2 by default. What is not certain is not matched.
    """
    lines = shaped(lines, None, (2, 3), "lines")
    extents = shaped(extents, len(lines), (2,), "extents")
    if covariance is not None:
        covariance = shaped(covariance, len(lines), (6, 6), "covariance")
    uv, of_uv, ends = _arrays_of(segments)
    options = _native.initial(_structs.ptzcal_line_match_options)
    options.same_polarity = bool(same_polarity)
    given = {
        "camera_sigma": camera_sigma,
        "max_distance": max_distance,
        "min_lead": min_lead,
        "min_overlap": min_overlap,
    }
    for name, value in given.items():
        if value is not None:
            setattr(options, name, value)
    pairs, residuals = np.empty((len(lines), 2), np.uint32), np.empty((len(lines), 2))
    count = c_size_t()
    call(
        lib.ptzcal_match_lines,
        address_of(lines),
        address_of_optional(covariance),
        address_of(extents),
        len(lines),
        byref(camera._struct),
        address_of(uv),
        address_of(of_uv),
        address_of(ends),
        len(uv),
        options,
        address_of(pairs),
        address_of(residuals),
        len(lines),
        byref(count),
    )
    pairs, residuals = pairs[: count.value].astype(int), residuals[: count.value]
    return LineMatches(pairs[:, 0], pairs[:, 1], residuals)
