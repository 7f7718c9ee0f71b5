"""Probing, and heads whose numbers have no angles."""

import os
import tempfile
import unittest

import numpy as np

import ptzcal
from ptzcal import ProbeFigure
from support import TestCase


class Probes(TestCase):
    def test_a_simulated_head(self):
        report = ptzcal.probe("sim:room?real_time=20", amplitude=0.02, repeats=2)
        self.assertEqual(report[ProbeFigure.POSITION_FOLLOWS].value, 1.0)
        self.assertGreater(report[ProbeFigure.DURATION].value, 0.0)
        self.assertIn("Backlash", str(report))
        with self.fails("NOT_FOUND"):
            report[ProbeFigure.LASER_VISIBLE_AFTER]
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.probe("sim:room", amplitude=2.0)


class Maps(TestCase):
    TEXT = (
        '{"format": "ptzcal-angle-map", "version": 1,'
        '"pan": {"nodes": [[-1, -1.5], [1, 1.5]], "covariance": [[1e-8, 0], [0, 1e-8]],'
        '"roughness": 0},'
        '"tilt": {"nodes": [[-1, 0.4], [1, -0.4]], "covariance": [[1e-8, 0], [0, 1e-8]],'
        '"roughness": 0},'
        '"mounting": {"collimation": 0, "roll": 0, "trunnion": 0, "sigma": [0, 0, 0]}}'
    )

    def test_files_and_angles(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "angles.json")
            with open(path, "w") as file:
                file.write(self.TEXT)
            angle_map = ptzcal.AngleMap(path)
            angle_map.save(path)
            angle_map = ptzcal.AngleMap(path)
        angles = angle_map.to_angles(0.5, 0.5)
        self.assertAlmostEqual(angles.pan, 0.75)
        self.assertAlmostEqual(angles.tilt, -0.2)
        self.assertTrue(0.0 < angles.pan_sigma < 2e-4)
        self.assertAlmostEqual(angle_map.to_raw(0.75, -0.2).tilt, 0.5)
        summary = angle_map.summary()
        self.assertEqual(summary.frames, 0)
        self.assertEqual(summary.angles[:2], (-1.5, 1.5))
        with self.fails("FILE_IO"):
            ptzcal.AngleMap(os.path.join(folder, "nothing.json"))
        # The simulated head knows its angles.
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Head("sim:room", angle_map=angle_map)

    def test_nothing_is_learned_from_a_blank_wall(self):
        blank = np.zeros((48, 64), np.uint8)
        camera = ptzcal.Camera(width=64, height=48, fx=60.0, fy=60.0, cx=31.5, cy=23.5)
        with self.fails("NOT_FOUND"):
            ptzcal.learn_angles(
                "sim:room?real_time=100", camera, frames=lambda not_before, timeout: blank
            )


if __name__ == "__main__":
    unittest.main()
