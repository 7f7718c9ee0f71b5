import unittest

import numpy as np

import ptzcal
from support import TestCase

DEGREE = np.pi / 180


class PointingInTheSimulator(TestCase):
    """Scan, calibrate, click, turn, look; and the check of the same camera."""

    @classmethod
    def setUpClass(cls):
        cls.rig = ptzcal.Rig.open("sim:room?seed=3")
        cls.addClassCleanup(cls.rig.close)
        region = ptzcal.Region(-25 * DEGREE, 20 * DEGREE, -18 * DEGREE, 15 * DEGREE, 12, 9)
        cls.cameras = ["sim:fixed/0"]
        cls.scan = cls.rig.scan_region(region, cls.cameras)
        points = ptzcal.Correspondences(800, 600)
        points.add_scan(cls.scan, 0)
        cls.calibration = ptzcal.calibrate_camera(points)

    def test_a_click_and_back(self):
        pointing = ptzcal.Pointing(self.calibration, self.rig.model)
        with self.assertRaises(ptzcal.Error):
            pointing.aim([400, 300])
        pointing.set_plane([0, 1, 0], 1.2)
        aim = pointing.aim([450, 520], sigma=1.0)
        self.assertClose(aim.point[1], 1.2, atol=1e-9)
        self.assertClose(aim.uv, [359.5, 287.5], atol=1e-6)
        self.assertIsNone(aim.zoom)
        axes, _ = ptzcal.ellipse(aim.uv_covariance)
        self.assertGreater(axes[0], axes[1])
        self.assertClose(pointing.locate(aim.pan, aim.tilt, aim.uv).uv, [450, 520], atol=1e-6)
        sweep = pointing.sweep([450, 400], 2.0)
        self.assertEqual(sweep.curve.shape[1], 3)
        self.assertGreaterEqual(len(sweep.steps), 1)
        for bad in ([450, 20], [900, 20]):
            with self.assertRaises(ptzcal.Error):
                pointing.aim(bad)

    def test_where_the_rig_stands_and_how_its_camera_zooms(self):
        pointing = ptzcal.Pointing(self.calibration, self.rig.model)
        pointing.set_plane([0, 1, 0], 1.2)
        before = pointing.aim([450, 520])
        # The rig turned to the right by 0.1: the same place is as much further left, but for the pan
        # axis standing 2 cm beside the frame's origin, 2 m away.
        c, s = np.cos(0.1), np.sin(0.1)
        R = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        pointing.set_station(R, [0, 0, 0])
        self.assertClose(pointing.aim([450, 520]).pan, before.pan - 0.1, atol=2e-3)
        pointing.set_station(R, [0, 0, 0], np.eye(6) * 1e-6)
        self.assertGreater(pointing.aim([450, 520]).angle_covariance[0, 0], 1e-6)
        for bad in (np.eye(2), np.zeros((3, 3)), np.full((3, 3), np.nan)):
            with self.assertRaises((ptzcal.Error, ValueError)):
                pointing.set_station(bad, [0, 0, 0])
        with self.assertRaises(ValueError):
            pointing.set_station(np.eye(3), [0, 0, 0], np.eye(3))
        with self.assertRaises(AttributeError):
            pointing.set_zoom_curve(None)

    def test_the_way_back_with_unknown_depth(self):
        pointing = ptzcal.Pointing(self.calibration, self.rig.model)
        pointing.set_plane([0, 1, 0], 1.2)
        aim = pointing.aim([450, 520])
        along = pointing.locate_along(aim.pan, aim.tilt, aim.uv, 1.0, sigma=1.0)
        self.assertTrue(np.all(np.diff(along.distance) > 0) and along.distance[0] >= 1.0)
        self.assertEqual(along.uv_covariance.shape, (len(along.distance), 2, 2))
        # The clicked pixel is on it.
        self.assertLess(np.min(np.linalg.norm(along.uv - [450, 520], axis=1)), 10.0)
        with self.assertRaises(ptzcal.Error):
            pointing.locate_along(aim.pan, aim.tilt, aim.uv, 0.0)

    def test_exploring(self):
        limits = {"pan": (-0.6, 0.6), "tilt": (-0.4, 0.4)}
        heard = []
        found = ptzcal.explore(
            self.rig, self.cameras, max_shots=25, progress=lambda p: heard.append(p.done), **limits
        )
        self.assertIsNone(found.scan.end)
        self.assertEqual(heard[-1], len(found.scan))
        self.assertLessEqual(len(found.scan), 25)
        (visible,) = found.visible
        region = visible.region
        self.assertEqual(visible.mask.shape, (region.tilt_steps, region.pan_steps))
        self.assertClose(visible.mask.mean(), visible.share, atol=1e-12)
        self.assertTrue(region.pan_min < -0.4 and region.pan_max > 0.25 and visible.seen > 5)
        stopped = ptzcal.explore(self.rig, self.cameras, progress=lambda p: p.done == 2)
        self.assertEqual((len(stopped.scan), stopped.visible), (2, [None]))
        with self.assertRaises(ptzcal.Error) as caught:  # where the camera sees nothing
            ptzcal.explore(self.rig, self.cameras, pan=(1.4, 1.7), max_shots=8)
        self.assertEqual(caught.exception.status, ptzcal.Status.NOT_FOUND)
        for bad in ({"max_shots": 1}, {"tolerance": 0.0}, {"pan": (1.0, 0.5)}, {"spacing": np.nan}):
            with self.assertRaises(ptzcal.Error):
                ptzcal.explore(self.rig, self.cameras, **bad)
        with self.assertRaises(ZeroDivisionError):
            ptzcal.explore(self.rig, self.cameras, progress=lambda p: 1 / 0)

    def test_health_of_spots_that_the_host_measured(self):
        chosen = ptzcal.choose_health_shots(self.scan)
        shots = [self.scan[i] for i in chosen]
        readings = [(s.pan, s.tilt) for s in shots]
        head, fixed = ([self.scan.spot(i, c) for i in chosen] for c in (ptzcal.HEAD_CAMERA, 0))
        head, fixed = ([(s.x, s.y) for s in spots] for spots in (head, fixed))
        before = (self.rig.model, self.calibration, readings, head, fixed, head)
        same = ptzcal.check_health_spots(*before, fixed)
        self.assertEqual(same.verdict, ptzcal.Verdict.UNCHANGED)
        moved = ptzcal.check_health_spots(*before, np.add(fixed, [6, 2]))
        self.assertEqual(moved.verdict, ptzcal.Verdict.CAMERA_MOVED, moved.reason)
        self.assertIsNotNone(moved.refitted)
        gone = np.array(fixed)
        gone[3:] = np.nan
        few = ptzcal.check_health_spots(*before, gone)
        self.assertEqual(few.verdict, ptzcal.Verdict.CANNOT_TELL)
        self.assertEqual(few.shots.count(ptzcal.ShotState.NOT_SEEN), 7)
        with self.assertRaises(ValueError):
            ptzcal.check_health_spots(*before, fixed[:3])
        with self.assertRaises(ptzcal.Error):
            ptzcal.check_health_spots(*before, fixed, sigma=0.0)

    def test_health(self):
        shots = ptzcal.choose_health_shots(self.scan)
        self.assertEqual(len(shots), 10)
        again = ptzcal.fire_again(self.rig, self.scan, shots, self.cameras)
        health = ptzcal.check_health(self.rig.model, self.calibration, self.scan, again)
        self.assertEqual(health.verdict, ptzcal.Verdict.UNCHANGED, health.reason)
        self.assertEqual(len(health.shots), 10)
        self.assertIsNone(health.refitted)


if __name__ == "__main__":
    unittest.main()
