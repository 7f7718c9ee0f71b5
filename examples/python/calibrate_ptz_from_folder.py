"""Calibrates a PTZ camera and the laser on its head from a folder with pictures of a chessboard.

    calibrate_ptz_from_folder.py FOLDER COLUMNSxROWS SQUARE [OUTPUT.json] [--lens radial2] [--pictures TO]

COLUMNSxROWS are the board's inner corners, SQUARE the side of its squares in metres. Each folder in
FOLDER is a zoom position and has the device's number of it for a name (0, 0.25, 4x ...); pictures in
FOLDER itself are of a single position. Two pictures are a view: NAME-off.png with the laser off and
NAME-on.png with it on; any other picture is a view without the laser. LENS is the lens model: none,
radial1, radial2, brown_conrady, division, fisheye.

Prints what became of every view and of every position, writes the rig over zoom, with its covariance,
to OUTPUT.json, and pictures of the corners and their residuals to the folder TO.
"""

import argparse
import re
from pathlib import Path

import numpy as np

import ptzcal

PICTURES = {".pgm", ".ppm", ".png", ".jpg", ".jpeg"}


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("size", type=lambda text: tuple(int(n) for n in text.split("x")))
    parser.add_argument("square", type=float)
    parser.add_argument("output", nargs="?", type=Path)
    parser.add_argument("--lens", default="radial2")
    parser.add_argument("--pictures", type=Path)
    return parser.parse_args()


def positions(folder):
    """(zoom, folder) of every position."""
    inner = [p for p in sorted(folder.iterdir()) if p.is_dir()]
    numbers = [(re.fullmatch(r"(-?\d+(?:\.\d+)?)x?", p.name), p) for p in inner]
    named = [(float(number[1]), p) for number, p in numbers if number]
    return named or [(0.0, folder)]


def views(folder):
    """(path without the laser, path with it or None) of every view of a position."""
    paths = {p.stem: p for p in sorted(folder.iterdir()) if p.suffix.lower() in PICTURES}
    for stem, path in paths.items():
        if stem.endswith("-on") and stem[:-3] + "-off" in paths:
            continue
        on = paths.get(stem[:-4] + "-on") if stem.endswith("-off") else None
        yield path, on


def draw(path, view, to):
    """The corners, and their residuals 50 times as long; outliers are red rings, the spot a ring."""
    picture = ptzcal.Picture.read(path)
    picture.dim(0.6)
    picture.draw_circles(view.corners, 0x50A0FF, radius=3.0, width=1.0)
    picture.draw_residuals(view.corners, view.residuals, view.inliers)
    if view.spot is not None:
        picture.draw_circles([view.spot], 0xFFC800, radius=10.0, width=2.0)
    picture.save(to / f"zoom-{view.zoom:g}-{path.stem}.png")


def main():
    given = arguments()
    calibration = ptzcal.RigCalibration(*given.size, given.square, distortion=given.lens)
    shown = []
    for zoom, inner in positions(given.folder):
        for off, on in views(inner):
            pictures = [ptzcal.read_image(path) for path in (off, on) if path]
            calibration.add_images(zoom, *pictures)
            shown.append((off.name, on or off))
    answer = calibration.solve()

    for (name, path), view in zip(shown, answer.views):
        fate = f"rms {view.rms:.3f} px, {view.inliers.sum()} corners"
        if view.status != ptzcal.Status.OK:
            fate = f"NOT USED: {view.reason}"
        elif view.spot_status != ptzcal.Status.OK:
            fate += f"; no spot: {view.spot_reason}"
        elif view.spot is not None:
            fate += f"; spot {np.hypot(*view.spot_residual):.2f} px off"
        print(f"zoom {view.zoom:g} {name}: {fate}")
        if given.pictures and view.status == ptzcal.Status.OK:
            given.pictures.mkdir(parents=True, exist_ok=True)
            draw(path, view, given.pictures)

    for index, position in enumerate(answer.positions):
        print(f"zoom {position.zoom:g}: {position.views_used} of {position.views} views used, ", end="")
        if position.status != ptzcal.Status.OK:
            print(position.reason)
            continue
        boards = answer.boards(index)
        camera, sigma = boards.camera, boards.calibration.standard_deviations
        if position.has_model:
            camera, covariance = answer.rig(index)
            sigma = np.array([camera.fx, camera.fy, 0, 1, 1]) * np.sqrt(covariance.diagonal()[[4, 4, 4, 5, 6]])
        print(
            f"fx {camera.fx:.2f} +- {sigma[0]:.2f}, fy {camera.fy:.2f} +- {sigma[1]:.2f}, "
            f"cx {camera.cx:.2f} +- {sigma[3]:.2f}, cy {camera.cy:.2f} +- {sigma[4]:.2f} px, rms {position.rms:.3f} px"
        )
        for line in boards.advice:
            print(f"  {line}")
        if not position.has_model:
            print(f"  no laser line: {position.laser_reason}")
            continue
        x0, y0, vx, vy = 1e3 * np.sqrt(covariance.diagonal()[:4])
        print(
            f"  laser x0 {1e3 * camera.laser_x0:.2f} +- {x0:.2f}, y0 {1e3 * camera.laser_y0:.2f} +- {y0:.2f} mm, "
            f"vx {1e3 * camera.laser_vx:.2f} +- {vx:.2f}, vy {1e3 * camera.laser_vy:.2f} +- {vy:.2f} mrad"
        )

    try:
        line = answer.common_line
        verdict = "one line" if line.agrees else "NOT one line: every position keeps its own"
        print(f"the laser at {line.positions} positions: {verdict} (chance {line.probability:.3g})")
    except ptzcal.Error:
        pass  # a single position, or no laser
    try:
        curve = answer.curve
    except ptzcal.Error as error:
        print(f"no rig over zoom: {error}")
        return
    if given.output:
        curve.save(given.output)
        print(f"wrote {given.output}: zoom {curve.range[0]:g} to {curve.range[1]:g}")


if __name__ == "__main__":
    main()
