"""The whole job on the simulated rig: scans a region of the room with the laser, calibrates a fixed
camera from what it saw of it, compares it with the truth, and points the laser at what it sees.

    scan_simulator.py [PAN_STEPS TILT_STEPS]
"""

import sys

import numpy as np

import ptzcal


def show(progress):
    if progress.done % 10 == 0 or progress.done == progress.total:
        print(f"\r{progress.done} of {progress.total} shots", end="", file=sys.stderr, flush=True)


def main():
    pan_steps, tilt_steps = (int(n) for n in sys.argv[1:3]) if len(sys.argv) > 2 else (32, 20)
    region = ptzcal.Region(-0.45, 0.45, -0.3, 0.3, pan_steps, tilt_steps)
    with ptzcal.Rig.open("sim:room") as rig:
        scan = rig.scan_region(region, ["sim:fixed/0"], progress=show)
        print(file=sys.stderr)
        if not scan.complete:
            sys.exit(f"the scan ended early: {scan.end}")

        truth = rig.simulator().true_camera(0)
        shots = ptzcal.Correspondences(*scan.camera_size(0))
        shots.add_scan(scan, camera=0)
        result = ptzcal.calibrate_camera(shots, distortion="radial2")
        camera = result.camera

        # A click in the fixed camera turns the rig there: the measured point that is nearest to it.
        click = np.array([400.0, 300.0])
        seen = camera.project(scan.points)
        aim = rig.aim_at_point(scan.points[np.argmin(np.linalg.norm(seen - click, axis=1))])

    error = np.linalg.norm(camera.centre - truth.centre)
    print(
        f"fixed camera: f {camera.fx:.1f} px (truth {truth.fx:.1f}), centre within {1e3 * error:.1f} mm, "
        f"{result.inlier_count} of {len(scan)} shots used; the laser points at pan "
        f"{np.degrees(aim.pan):.1f}, tilt {np.degrees(aim.tilt):.1f} degrees"
    )


if __name__ == "__main__":
    main()
