"""Calibrates many cameras at once on a Dask cluster; every calibration stands alone.

    calibrate_fleet.py                                  200 cameras made up, on a cluster of this machine
    calibrate_fleet.py --scheduler tcp://HOST:8786      the same on a cluster that is there
    calibrate_fleet.py POINTS.csv:1920x1080 ...         one file for each camera, as calibrate_from_points.py reads

A camera that cannot be calibrated keeps its reason and costs the others nothing. Workers need the ptzcal
package; they get arrays and send back numbers. One process for each core: calls release the GIL, but NumPy
and Python around them do not.
"""

import argparse
import sys
import time

import numpy as np
from dask.distributed import Client, LocalCluster, as_completed

import ptzcal


def made_up(number):
    """A camera somewhere in a hall, with 300 measured points; each tenth sees one wall only."""
    rng = np.random.default_rng(number)
    focal = rng.uniform(800, 1600)
    camera = ptzcal.Camera(1920, 1080, focal, focal, 959.5, 539.5, t=[0, 0, rng.uniform(3, 6)])
    flat = number % 10 == 9
    xyz = rng.uniform([-2, -1, 0 if flat else -1.5], [2, 1, 1e-9 if flat else 1.5], (300, 3))
    return xyz, camera.project(xyz) + rng.normal(0, 0.5, (300, 2)), 1920, 1080


def from_file(argument):
    path, _, size = argument.rpartition(":")
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    width, height = (int(value) for value in size.split("x"))
    return rows[:, -5:-2], rows[:, -2:], width, height


def calibrate(name, xyz, uv, width, height):
    """Runs on a worker. Handles of the library stay there: what comes back is plain."""
    points = ptzcal.Correspondences(width, height)
    points.add_points(xyz, uv)
    try:
        result = ptzcal.calibrate_camera(points)
    except ptzcal.Error as error:
        return {"name": name, "refused": str(error)}
    return {
        "name": name,
        "K": result.camera.K,
        "centre": result.camera.centre,
        "sigmas": result.standard_deviations,
        "rms": result.rms,
        "warnings": list(result.warnings),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", help="POINTS.csv:WIDTHxHEIGHT")
    parser.add_argument("--scheduler", help="address of a cluster; without it one of this machine")
    parser.add_argument("--cameras", type=int, default=200, help="cameras to make up")
    parser.add_argument("--workers", type=int, default=None, help="processes on this machine")
    options = parser.parse_args()
    if options.files:
        cameras = {path: from_file(path) for path in options.files}
    else:
        cameras = {f"camera {number}": made_up(number) for number in range(options.cameras)}

    cluster = options.scheduler or LocalCluster(
        n_workers=options.workers, threads_per_worker=1, dashboard_address=None
    )
    refused = 0
    with Client(cluster) as client:
        begun = time.perf_counter()
        tasks = [client.submit(calibrate, name, *sets, pure=False) for name, sets in cameras.items()]
        for done in as_completed(tasks):
            answer = done.result()
            if "refused" in answer:
                refused += 1
                print(f"{answer['name']}: {answer['refused']}")
            else:
                place = 1e3 * max(answer["sigmas"][-3:])
                print(f"{answer['name']}: f {answer['K'][0, 0]:.1f} px, position to {place:.1f} mm")
        seconds = time.perf_counter() - begun
        workers = len(client.scheduler_info()["workers"])
    if not options.scheduler:
        cluster.close()
    print(f"{len(cameras) - refused} of {len(cameras)} cameras in {seconds:.1f} s on {workers} workers")
    return 0 if refused < len(cameras) else 1


if __name__ == "__main__":
    sys.exit(main())
