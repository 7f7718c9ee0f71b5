"""A precision label of a set-up, and a plan, before anyone scans: what will a rig in this room make of a
fixed camera here, and how many shots does it take?

    precision_label.py [FOLDER]

Writes label.csv, label.json, label.svg, handoff.svg and the noise study's charts into FOLDER (default: .).
"""

import os
import sys
from pathlib import Path

import numpy as np

import ptzcal

ROOM = (-1.9, -1.3, -1.0), (2.0, 1.2, 4.6)  # corners in the rig's frame, metres: x right, y down, z forward
BOXES = [[(-0.7, 0.15, 1.7), (0.2, 1.2, 2.5)], [(0.1, -0.9, 2.9), (0.9, -0.1, 3.5)]]
REGION = ptzcal.Region(-0.5, 0.44, -0.36, 0.33, 40, 30)  # where the rig may point, radians
TARGET = 0.01


def looking_at(centre, target):
    """World to camera of a camera at `centre` that sees `target` in its middle, upright."""
    z = np.subtract(target, centre)
    z = z / np.linalg.norm(z)
    x = np.cross((0, 1, 0), z)
    x /= np.linalg.norm(x)
    R = np.array([x, np.cross(z, x), z])
    return R, -R @ np.asarray(centre)


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    model = ptzcal.RigModel(
        width=720, height=576, fx=800.0, fy=800.0, cx=360.0, cy=288.0,
        laser_x0=0.1, laser_y0=0.005, laser_vx=-0.005, laser_vy=0.003,
    )  # fmt: skip
    R, t = looking_at((-1.6, -0.9, 0.6), (0.15, 0.15, 2.9))
    camera = ptzcal.Camera(800, 600, 845.0, 845.0, 400.0, 300.0, R=R, t=t)

    # What 25 boards tell of the laser's line: its offset to 0.2 mm, its slopes to 0.08 mrad.
    site = ptzcal.Site(
        model,
        camera,
        rig_sigmas={"laser_x0": 2e-4, "laser_y0": 2e-4, "laser_vx": 8e-5, "laser_vy": 8e-5},
    )
    site.set_room(*ROOM, BOXES)

    try:
        plan = site.plan(REGION, TARGET)
        print(
            f"{1e3 * TARGET:g} mm at 0.2 px: a grid of {plan.grid.pan_steps} x {plan.grid.tilt_steps} "
            f"({plan.grid_seen} in view), or {len(plan.shots)} chosen shots; any number leaves "
            f"{1e3 * plan.limit_rms:.1f} mm ({plan.limited_by.name.lower()})"
        )
    except ptzcal.Error as refused:
        print(f"{1e3 * TARGET:g} mm: {refused}")

    # The label is of the laser's line as it is believed; with a rig that is exact it is what noise alone does.
    exact = ptzcal.Site(model, camera)
    exact.set_room(*ROOM, BOXES)
    set_up = exact.set_up(REGION)
    threads = os.cpu_count() or 1
    label = set_up.label([3.0, 4.0, 5.0], [0.1, 0.2, 0.5, 1.0], trials=40, threads=threads)
    print(f"{'distance':>9} {'noise':>6} {'shots':>6} {'position':>18} {'point handed off':>18}")
    for row in label.rows:
        print(
            f"{row.distance:7.1f} m {row.fixed_sigma:3.1f} px {row.shots:6} "
            f"{1e3 * row.simulated[0]:7.2f} ({1e3 * row.expected[0]:6.2f}) mm "
            f"{1e3 * row.handoff_simulated:7.2f} ({1e3 * row.handoff_expected:6.2f}) mm"
        )
    label.save_csv(folder / "label.csv")
    label.save_json(folder / "label.json")
    label.save_plot(folder / "label.svg")
    label.save_plot(folder / "handoff.svg", "handoff")

    grid = [(head, fixed) for head in np.linspace(0, 2, 6) for fixed in np.linspace(0, 2, 6)]
    study = set_up.study(grid, trials=20, threads=threads)
    study.save_plot(folder / "errors.svg", "errors", "position")
    study.save_plot(folder / "thesis_grid.svg", "grid", "dlt_cascade")
    study.save_plot(folder / "grid.svg", "grid", "joint_ml")
    study.save_plot(folder / "scatter.svg", "scatter", 7)  # 0.4 px on both
    print(f"simulated (expected by the covariance); charts in {folder}")


if __name__ == "__main__":
    main()
