"""Click into a fixed camera's picture, and the pan-tilt camera looks there; on the simulated rig.

The head finds out where the fixed camera sees its laser, surveys that part of the room and calibrates
the camera with it; each click on the floor then turns the head. The simulator's truth says what the head
camera has at its picture's centre.

    click_to_point.py [PAN_STEPS TILT_STEPS]
"""

import sys
from dataclasses import replace

import numpy as np

import ptzcal

CLICKS = [(150, 500), (430, 560), (640, 520), (560, 590)]
FLOOR = 1.2  # metres below the rig


def main():
    pan_steps, tilt_steps = (int(n) for n in sys.argv[1:3]) if len(sys.argv) > 2 else (24, 16)
    worst = 0.0
    with ptzcal.Rig.open("sim:room") as rig:
        found = ptzcal.explore(rig, ["sim:fixed/0"])
        visible = found.visible[0]
        region = replace(visible.region, pan_steps=pan_steps, tilt_steps=tilt_steps)
        low, high = np.degrees([(region.pan_min, region.tilt_min), (region.pan_max, region.tilt_max)])
        print(
            f"{len(found.scan)} shots: visible from pan {low[0]:.0f} to {high[0]:.0f}, "
            f"tilt {low[1]:.0f} to {high[1]:.0f} degrees, {visible.share:.0%} of that"
        )
        scan = rig.scan_region(region, ["sim:fixed/0"])
        simulator = rig.simulator()
        truth = simulator.true_camera(0)
        shots = ptzcal.Correspondences(*truth.size)
        shots.add_scan(scan, camera=0)
        calibration = ptzcal.calibrate_camera(shots, distortion="radial2")

        pointing = ptzcal.Pointing(calibration, rig.model)
        pointing.set_head_deviation(4e-4, 4e-4)  # steps of 0.07 degrees
        pointing.set_plane([0, 1, 0], FLOOR)
        for click in CLICKS:
            aim = pointing.aim(click, sigma=0.5)
            axes, _ = ptzcal.ellipse(aim.uv_covariance)
            rig.move(aim.pan, aim.tilt)

            # What was truly clicked on, and where the true head camera sees it now.
            ray = truth.back_project(np.array(click, float))
            target = truth.centre + ray * (FLOOR - truth.centre[1]) / ray[1]
            head = simulator.true_rig.head_camera(*rig.position())
            off = float(np.linalg.norm(head.project(target) - [359.5, 287.5]))
            worst = max(worst, off)
            print(
                f"click {click}: {aim.distance:.2f} m away, pan {np.degrees(aim.pan):.2f}, "
                f"tilt {np.degrees(aim.tilt):.2f} degrees; {off:.1f} px from the picture's centre, "
                f"95 % within {axes[0]:.1f} x {axes[1]:.1f} px"
            )
    print(f"the head looks there: within {worst:.1f} px of 720 x 576")


if __name__ == "__main__":
    main()
