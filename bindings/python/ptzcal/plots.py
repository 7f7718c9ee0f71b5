"""Plots by matplotlib, where it is installed; the package works without it.

    from ptzcal import plots
    plots.residuals(result, uv)

Each function draws on `ax`, or on new axes, and returns them.
"""

from __future__ import annotations

from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np

from ._arrays import numbers, rows
from .calibrate import Calibration
from .camera import Camera
from .detect import Spot
from .pointing import ellipse
from .scan import HEAD_CAMERA, Scan


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    try:
        from matplotlib import pyplot
    except ImportError:
        raise ImportError("plots need matplotlib: pip install matplotlib") from None
    return pyplot.subplots()[1]


def _image(ax: Any, camera: Camera, picture: Optional[np.ndarray] = None) -> None:
    width, height = camera.size
    if picture is not None:
        ax.imshow(picture, cmap="gray", extent=(-0.5, width - 0.5, height - 0.5, -0.5))
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="x (px)", ylabel="y (px)", aspect="equal")


def residuals(
    calibration: Calibration,
    uv: Any,
    *,
    factor: Optional[float] = None,
    picture: Optional[np.ndarray] = None,
    ax: Any = None,
) -> Any:
    """Residuals over the image, `factor` times as long as they are; outliers are crossed out.

    uv: (n, 2), the measured pixels in the order in which they were added. picture: RGB or grey.
    """
    pixels = rows(uv, 2, "uv", calibration.measurements)
    strokes, used = calibration.residuals, calibration.inliers
    ax = _axes(ax)
    _image(ax, calibration.camera, picture)
    if factor is None:
        length = np.quantile(np.linalg.norm(strokes[used], axis=1), 0.9) if used.any() else 1.0
        factor = 0.04 * calibration.camera.size[0] / max(float(length), 1e-9)
    at, along = pixels[used], strokes[used]
    ax.quiver(*(at - along).T, *(factor * along).T, angles="xy", scale_units="xy", scale=1.0, width=0.002, color="C0")
    ax.plot(*pixels[~used].T, "x", color="C1", label=f"{np.count_nonzero(~used)} set aside")
    ax.set_title(f"residuals, {factor:.3g} times as long")
    if not used.all():
        ax.legend()
    return ax


def scan(result: Scan, camera: int = HEAD_CAMERA, *, ax: Any = None) -> Any:
    """Directions of a scan's shots: those whose spot a camera saw, and the others."""
    ax = _axes(ax)
    angles = np.degrees([(shot.pan, shot.tilt) for shot in result]).reshape(-1, 2)
    seen = np.array([isinstance(result.spot(i, camera), Spot) for i in range(len(result))], bool)
    ax.plot(*angles[~seen].T, ".", color="0.7", label="no spot")
    ax.plot(*angles[seen].T, ".", color="C2", label="spot")
    ax.set(xlabel="pan, right (degrees)", ylabel="tilt, up (degrees)", aspect="equal")
    ax.legend()
    return ax


def from_above(
    cameras: Union[Mapping[str, Camera], Sequence[Camera]],
    points: Any = None,
    *,
    reach: Optional[float] = None,
    ax: Any = None,
) -> Any:
    """Cameras with the edges of their views, and points (n, 3), in a world whose y points down.

    reach: length of the edges, metres; without it the points' median distance, or 1 m.
    """
    named = cameras if isinstance(cameras, Mapping) else {f"camera {i}": c for i, c in enumerate(cameras)}
    ax = _axes(ax)
    cloud = rows(points if points is not None else [], 3, "points")
    ax.plot(cloud[:, 0], cloud[:, 2], ".", markersize=2, color="0.6")
    for k, (name, camera) in enumerate(named.items()):
        centre = np.asarray(camera.centre)
        length = reach
        if length is None:
            length = float(np.median(np.linalg.norm(cloud - centre, axis=1))) if len(cloud) else 1.0
        width, height = camera.size
        middle = (height - 1) / 2
        edges = camera.back_project([[-0.5, middle], [width - 0.5, middle]])
        outline = np.array([centre + length * edges[0], centre, centre + length * edges[1]])
        ax.plot(outline[:, 0], outline[:, 2], "-", color=f"C{k}", label=name)
        ax.plot(centre[0], centre[2], "o", color=f"C{k}")
    ax.set(xlabel="x, right (m)", ylabel="z, forward (m)", aspect="equal")
    ax.legend()
    return ax


def error_ellipse(uv: Any, covariance: Any, probability: float = 0.95, *, ax: Any = None) -> Any:
    """The ellipse about a pixel that holds the truth with a probability. covariance: (2, 2), px^2."""
    from matplotlib.patches import Ellipse

    ax = _axes(ax)
    x, y = numbers(uv, "uv")
    (longer, shorter), angle = ellipse(covariance, probability)
    patch = Ellipse((x, y), 2 * longer, 2 * shorter, angle=np.degrees(angle), fill=False, color="C3")
    ax.add_patch(patch)
    return ax
