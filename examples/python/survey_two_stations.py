"""The pose of one scan's station in another's frame, from the planes that both saw.

    survey_two_stations.py A B [--sigma 0.01] [--flatness 0.005] [--min-range 0.5]

A and B hold points, a line each: x y z in metres, in the frame of the station that measured them
(.txt, .csv), or are NumPy arrays of shape (n, 3) (.npy). Nothing is known of the pose beforehand. Without
files, two stations in a room of boxes are simulated.
"""

import argparse
import sys

import numpy as np

import ptzcal


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", metavar="A B")
    parser.add_argument("--sigma", type=float, default=0.0, help="of points, metres; estimated without")
    parser.add_argument("--flatness", type=float, default=0.005, help="of walls, metres")
    parser.add_argument("--min-range", type=float, default=0.5, help="nearer points are the station's own")
    return parser.parse_args()


def read(path):
    if path.endswith(".npy"):
        return np.load(path)
    return np.loadtxt(path, delimiter="," if path.endswith(".csv") else None)[:, :3]


def simulated(centre, turn, seed):
    """A room with a cupboard, a table and a pillar, 6 x 2.6 x 4.4 m."""
    boxes = np.array(
        [
            ((-3, -1.5, -2), (3, 1.1, 2.4)),
            ((-3, -0.7, 1.4), (-1.8, 1.1, 2.4)),
            ((1.2, 0.3, -2), (2.4, 1.1, -1.2)),
            ((2.5, -1.5, 1.7), (3, 1.1, 2.4)),
        ]
    )
    rng = np.random.default_rng(seed)
    rays = rng.normal(size=(30000, 3))
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    c, s = np.cos(turn), np.sin(turn)
    world = rays @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
    a, b = (((corner - centre) / world) for corner in boxes.transpose(1, 0, 2)[:, :, None, :])
    near, far = np.minimum(a, b).max(2), np.maximum(a, b).min(2)
    near[0] = far[0]  # seen from inside
    ranges = np.where((near <= far) & (near > 0), near, np.inf).min(0)
    return rays * (ranges + rng.normal(0, 0.005, len(rays)))[:, None]


def main():
    given = arguments()
    if len(given.files) not in (0, 2):
        sys.exit("two files are needed, or none")
    if given.files:
        clouds = [read(path) for path in given.files]
    else:
        clouds = [simulated((-0.6, 0.0, -0.3), 0.2, 1), simulated((0.5, 0.1, 0.6), -0.9, 2)]

    stations = []
    for name, points in zip("AB", clouds):
        options = dict(sigma=given.sigma, flatness=given.flatness, min_range=given.min_range)
        planes = ptzcal.Planes.find(points, **options)
        print(f"station {name}: {len(points)} points, {len(planes)} planes")
        for i, plane in enumerate(planes):
            x, y, z = plane.normal
            print(
                f"  {i:2}: ({x:6.3f}, {y:6.3f}, {z:6.3f}) . X = {plane.distance:.3f} m, {plane.area:5.1f} m2, "
                f"rms {plane.rms * 1e3:.1f} mm, {plane.count} points"
            )
        stations.append(planes)
    try:
        pose = ptzcal.register_stations(*stations)
    except ptzcal.Error as error:
        sys.exit(f"no pose: {error}")

    sigma = np.sqrt(np.diag(pose.covariance))
    print(f"planes that are the same: {', '.join(f'{i} = {j}' for i, j in pose.matches)}")
    print(f"both saw a surface in {100 * pose.agreement:.1f} % of the places that both saw")
    print(f"B is turned by {np.degrees(pose.rotation_angle):.3f} +- {np.degrees(np.linalg.norm(sigma[:3])):.3f} degrees")
    x, y, z = pose.t
    print(f"B is at ({x:.4f}, {y:.4f}, {z:.4f}) +- {np.linalg.norm(sigma[3:]):.4f} m in A")


if __name__ == "__main__":
    main()
