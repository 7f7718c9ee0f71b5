"""The 3D model of what a rig scans: a surface through the laser's points, covered with the head
camera's pictures and a fixed camera's, written for viewers. On the simulated rig.

    export_model.py FOLDER [PAN_STEPS TILT_STEPS]

FOLDER receives model.glb (glTF), model.wrl (VRML), model.ply (the surface without pictures),
cloud.ply and cloud.pcd (the points with their covariances), and depth.png: the depths of the surface
in the fixed camera's view, in millimetres.
"""

import sys
from pathlib import Path

import ptzcal

PAN, TILT = (-0.45, 0.45), (-0.3, 0.3)


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    pan_steps, tilt_steps = (int(n) for n in sys.argv[2:4]) if len(sys.argv) > 3 else (64, 44)
    with ptzcal.Rig.open("sim:room") as rig:
        scan = rig.scan_region(
            ptzcal.Region(*PAN, *TILT, pan_steps, tilt_steps), ["sim:fixed/0"]
        )
        if not scan.complete:
            sys.exit(f"the scan ended early: {scan.end}")
        cloud, mesh = ptzcal.Cloud.from_scan(scan), ptzcal.Mesh.from_scan(scan)

        # What the fixed camera sees, calibrated with the same scan.
        fixed = rig.simulator().true_camera(0)
        shots = ptzcal.Correspondences(*fixed.size)
        shots.add_scan(scan, camera=0)
        fixed = ptzcal.calibrate_camera(shots, distortion="radial2").camera
        frame = rig.simulator().next_frame(camera=0)
        mesh.add_picture(frame.image, fixed, format=frame.format)

        # The head camera's pictures, from where they overlap.
        for tilt in (-0.2, 0.0, 0.2):
            for pan in (-0.36, -0.18, 0.0, 0.18, 0.36):
                rig.move(pan, tilt)
                frame = rig.simulator().next_frame(rig.simulator().now() + 0.5)
                at = rig.position()
                mesh.add_picture(frame.image, rig.model.head_camera(at.pan, at.tilt), format=frame.format)
    covered = mesh.texture()

    for name in ("model.glb", "model.wrl", "model.ply"):
        mesh.save(folder / name)
    for name in ("cloud.ply", "cloud.pcd"):
        cloud.save(folder / name)
    depth = mesh.depth_map(fixed)
    depth.save(folder / "depth.png")
    width, height = depth.size
    print(
        f"{len(cloud)} points; {len(mesh.triangles)} triangles, {covered} of them with one of "
        f"{mesh.textures} pictures; a depth for {100 * depth.known / (width * height):.0f} % of the "
        f"fixed camera's pixels, in {folder}"
    )


if __name__ == "__main__":
    main()
