"""Rig and cameras adjusted together: scans the simulated room, calibrates both fixed cameras with the
rig as its owner believes it to be, then with the rig's laser and axes free within their priors, and
compares both with the truth.

    adjust_rig_and_cameras.py [PAN_STEPS TILT_STEPS]
"""

import sys

import numpy as np

import ptzcal

REPEATABILITY = np.radians(0.005)  # of the simulated head, from shot to shot
#: How well a calibration of the rig would have found it, metres and radians.
PRIOR = {
    **dict.fromkeys(("laser_x0", "laser_y0"), 1e-4),
    **dict.fromkeys(("laser_vx", "laser_vy"), 4e-5),
    **dict.fromkeys(("axis_tilt_y", "axis_tilt_z", "axis_pan_x", "axis_pan_z"), 4e-4),
    "tilt_zero": 4e-4,
}


def main():
    pan_steps, tilt_steps = (int(n) for n in sys.argv[1:3]) if len(sys.argv) > 2 else (32, 20)
    region = ptzcal.Region(-0.5, 0.44, -0.36, 0.33, pan_steps, tilt_steps)
    with ptzcal.Rig.open("sim:room") as rig:
        scan = rig.scan_region(region, ["sim:fixed/0", "sim:fixed/1"])
        simulator = rig.simulator()
        survey = ptzcal.Adjustment(rig.model)
    truth = [simulator.true_camera(i) for i in range(2)]
    survey.add_station(np.eye(3), np.zeros(3))  # the world is the rig's frame
    cameras = [survey.add_camera(*camera.size, distortion="brown_conrady") for camera in truth]
    survey.add_scan(scan, cameras)

    for name, sigmas in (("rig as believed", {}), ("rig adjusted", PRIOR)):
        survey.set_rig_sigmas(**sigmas)
        result = survey.solve(pointing_sigma=(REPEATABILITY, REPEATABILITY))
        print(f"{name}: {result.used} of {result.spots} spots used, probability {result.probability:.2g}")
        for warning in result.warnings:
            print(f"  warning: {warning}")
        for i, calibration in enumerate(result.calibrations):
            camera, sigma = calibration.camera, calibration.standard_deviations
            error = camera.centre - truth[i].centre
            print(
                f"  camera {i}: centre within {1e3 * np.linalg.norm(error):.2f} mm (sigma "
                f"{1e3 * np.linalg.norm(sigma[-3:]):.2f}), f {camera.fx:.2f} +- {sigma[0]:.2f} px "
                f"(truth {truth[i].fx:.2f})"
            )
    print(f"  {result.weakest}")


if __name__ == "__main__":
    main()
