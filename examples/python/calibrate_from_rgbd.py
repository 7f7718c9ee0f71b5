"""Calibrates a fixed camera from a view with colour and depth of what it sees.

    calibrate_from_rgbd.py COLOUR DEPTH FIXED FX FY CX CY [--metres 0.001] [--pictures FOLDER]

COLOUR and DEPTH (16 bits) are the depth camera's, registered, FX FY CX CY its intrinsics in pixels;
FIXED is the fixed camera's image. The world is the depth camera's frame.
"""

import argparse
import sys
from pathlib import Path

import ptzcal


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("colour", "depth", "fixed"):
        parser.add_argument(name, type=Path)
    for name in ("fx", "fy", "cx", "cy"):
        parser.add_argument(name, type=float)
    parser.add_argument("--metres", type=float, default=0.001, help="of a unit of DEPTH")
    parser.add_argument("--pictures", type=Path, help="where pictures are written")
    return parser.parse_args()


def main():
    given = arguments()
    colour, fixed = ptzcal.read_image(given.colour), ptzcal.read_image(given.fixed)
    height, width = colour.shape[:2]
    auxiliary = ptzcal.Camera(width, height, given.fx, given.fy, given.cx, given.cy)
    rgbd = ptzcal.Rgbd(fixed)
    view = rgbd.add_view(colour, ptzcal.DepthMap.read(given.depth, given.metres), auxiliary)
    print(f"{view.features} features, {view.matches} matches, {view.pairs} of them with depth; {view.lines} lines")
    try:
        result = rgbd.calibrate()
    except ptzcal.Error as error:
        sys.exit(f"no calibration: {error}")

    camera, sigmas = result.camera, dict(zip(result.parameters, result.standard_deviations))
    for name in ("fx", "fy", "cx", "cy"):
        print(f"{name:2} {getattr(camera, name):9.2f} +- {sigmas[name]:.2f} px")
    for name, value in zip("XYZ", camera.centre):
        print(f"{name:2} {value:9.4f} +- {sigmas[name]:.4f} m")
    print(f"{result.inlier_count} of {result.measurements} pairs of points and lines used, rms {result.rms:.2f} px")

    if given.pictures:
        given.pictures.mkdir(parents=True, exist_ok=True)
        pairs, lines = rgbd.pairs, rgbd.line_pairs
        inliers, residuals = result.inliers[: len(pairs)], result.residuals[: len(pairs)]
        matches = ptzcal.Picture.beside(colour, fixed)
        matches.draw_matches(pairs.auxiliary, pairs.fixed, inliers, offset=width)
        matches.draw_lines(lines.auxiliary, 0xFFC800)
        matches.draw_lines(lines.fixed + [width, 0, width, 0], 0xFFC800)
        matches.save(given.pictures / "matches.png")
        picture = ptzcal.Picture(fixed)
        picture.dim(0.5)
        picture.draw_lines(lines.fixed, 0xFFC800)
        picture.draw_residuals(pairs.fixed, residuals, inliers, scale=20)
        picture.save(given.pictures / "residuals.png")
        print(f"pictures: {given.pictures}")


if __name__ == "__main__":
    main()
