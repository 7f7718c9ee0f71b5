"""Calibrates a camera from points whose positions are known.

    calibrate_from_points.py                          points made up for the example
    calibrate_from_points.py POINTS.csv WIDTH HEIGHT  a line of headings, then ..., X, Y, Z, u, v

X, Y, Z are metres, u, v pixels; (0, 0) is the centre of the top-left pixel.
"""

import sys

import numpy as np

import ptzcal


def made_up():
    """60 points of a room, clicked with an error of half a pixel."""
    truth = ptzcal.Simulator("sim:room").true_camera(0)
    truth = ptzcal.Camera.from_matrix(truth.K, truth.size, R=truth.R, t=truth.t)
    rng = np.random.default_rng(1)
    xyz = rng.uniform([-1.0, -0.8, 2.5], [1.0, 0.8, 5.0], (60, 3))
    return xyz, truth.project(xyz) + rng.normal(0, 0.5, (60, 2)), *truth.size


def from_file(path, width, height):
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    return rows[:, -5:-2], rows[:, -2:], int(width), int(height)


def main():
    xyz, uv, width, height = from_file(*sys.argv[1:]) if len(sys.argv) > 1 else made_up()
    points = ptzcal.Correspondences(width, height)
    points.add_points(xyz, uv)
    try:
        result = ptzcal.calibrate_camera(points)
    except ptzcal.Error as error:
        sys.exit(f"no calibration: {error}")

    camera = result.camera
    values = [camera.fx, camera.fy, camera.skew, camera.cx, camera.cy]
    for name, value, sigma in zip(result.parameters, values, result.standard_deviations):
        print(f"{name:5} {value:10.3f} +- {sigma:.3f} px")
    for name, value, sigma in zip("XYZ", camera.centre, result.standard_deviations[-3:]):
        print(f"{name:5} {value:10.3f} +- {sigma:.3f} m")
    print(f"{result.inlier_count} of {len(points)} points used, rms {result.rms:.2f} px")


if __name__ == "__main__":
    main()
