"""Calibrates a PTZ camera and the laser on its head from a folder with pictures of a chessboard.

    calibrate_ptz_from_folder.py FOLDER COLUMNSxROWS SQUARE [OUTPUT.json] [LENS]

COLUMNSxROWS are the board's inner corners, SQUARE the side of its squares in metres. Each folder in
FOLDER is a zoom position and has the device's number of it for a name (0, 0.25, 4x ...); pictures in
FOLDER itself are of a single position. Two pictures are a view: NAME-off.pgm with the laser off and
NAME-on.pgm with it on; any other picture is a view without the laser. PGM files are read as they
are, others (png, jpg ...) need OpenCV for Python. LENS is the lens model: none, radial1, radial2
(the default), brown_conrady, division, fisheye.

Prints what became of every view and of every position, and writes the rig over zoom, with its
covariance, to OUTPUT.json.
"""

import pathlib
import re
import sys

import numpy as np

import ptzcal

PICTURES = {".pgm", ".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"}


def picture(path):
    if path.suffix.lower() != ".pgm":
        import cv2

        image = cv2.imread(str(path))
        return image if image is not None else sys.exit(f"{path} is no picture")
    data = path.read_bytes()
    header = re.match(rb"P5\s+(?:#.*\n\s*)*(\d+)\s+(\d+)\s+255\s", data)
    if header is None:
        sys.exit(f"{path} is no binary PGM file of 8 bits")
    width, height = int(header[1]), int(header[2])
    return np.frombuffer(data, np.uint8, width * height, header.end()).reshape(height, width)


def positions(folder):
    """(zoom, folder) of every position."""
    inner = [p for p in sorted(folder.iterdir()) if p.is_dir()]
    numbers = [(re.fullmatch(r"(-?\d+(?:\.\d+)?)x?", p.name), p) for p in inner]
    named = [(float(number[1]), p) for number, p in numbers if number]
    return named or [(0.0, folder)]


def views(folder):
    """(name, picture without the laser, picture with it or None) of every view of a position."""
    paths = {p.stem: p for p in sorted(folder.iterdir()) if p.suffix.lower() in PICTURES}
    for stem, path in paths.items():
        if stem.endswith("-on") and stem[:-3] + "-off" in paths:
            continue
        on = paths.get(stem[:-4] + "-on") if stem.endswith("-off") else None
        yield path.name, picture(path), None if on is None else picture(on)


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    folder, square = pathlib.Path(sys.argv[1]), float(sys.argv[3])
    columns, rows = (int(n) for n in sys.argv[2].split("x"))
    lens = sys.argv[5] if len(sys.argv) > 5 else "radial2"
    calibration = ptzcal.RigCalibration(columns, rows, square, distortion=lens)
    names = []
    for zoom, inner in positions(folder):
        for name, off, on in views(inner):
            calibration.add_images(zoom, off, on)
            names.append(name)
    answer = calibration.solve()

    for name, view in zip(names, answer.views):
        fate = f"rms {view.rms:.3f} px, {view.inliers.sum()} corners"
        if view.status != ptzcal.Status.OK:
            fate = f"NOT USED: {view.reason}"
        elif view.spot_status != ptzcal.Status.OK:
            fate += f"; no spot: {view.spot_reason}"
        elif view.spot is not None:
            fate += f"; spot {np.hypot(*view.spot_residual):.2f} px off"
        print(f"zoom {view.zoom:g} {name}: {fate}")

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
    if len(sys.argv) > 4:
        curve.save(sys.argv[4])
        print(f"wrote {sys.argv[4]}: zoom {curve.range[0]:g} to {curve.range[1]:g}")


if __name__ == "__main__":
    main()
