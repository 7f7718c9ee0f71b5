"""Rig and cameras adjusted together: scans the simulated room, calibrates both fixed cameras with the
rig as its owner believes it to be, then with the rig's laser and axes free within their priors, and
compares both with the truth.

    adjust_rig_and_cameras.py [PAN_STEPS TILT_STEPS]
"""

import sys

import numpy as np

import ptzcal

ENCODER_STEP = np.radians(0.01)  # of the simulated head, and its repeatability
KNOWN = dict(
    laser_x0=1e-4, laser_y0=1e-4, laser_vx=4e-5, laser_vy=4e-5,
    axis_tilt_y=4e-4, axis_tilt_z=4e-4, axis_pan_x=4e-4, axis_pan_z=4e-4, tilt_zero=4e-4,
)  # fmt: skip


def main():
    pan_steps, tilt_steps = (int(n) for n in sys.argv[1:3]) if len(sys.argv) > 2 else (32, 20)
    region = ptzcal.Region(-0.5, 0.44, -0.36, 0.33, pan_steps, tilt_steps)
    with ptzcal.Rig.open("sim:room") as rig:
        scan = rig.scan_region(region, ["sim:fixed/0", "sim:fixed/1"])
        simulator = rig.simulator()
        survey = ptzcal.Adjustment(rig.model)
    truth = [simulator.true_camera(i) for i in range(2)]
    survey.add_station(np.eye(3), np.zeros(3))  # the world is the rig's frame
    cameras = [survey.add_camera(*camera.size, distortion="radial2") for camera in truth]
    survey.add_scan(scan, cameras)

    for name, sigmas in (("rig as believed", {}), ("rig adjusted", KNOWN)):
        survey.set_rig_sigmas(**sigmas)
        result = survey.solve(pointing_sigma=(ENCODER_STEP, ENCODER_STEP))
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
