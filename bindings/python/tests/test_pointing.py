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
