import json
import tempfile
import unittest
from pathlib import Path

import numpy as np

import ptzcal
from support import TestCase, rig_model

ROOM = (-1.9, -1.3, -1.0), (2.0, 1.2, 4.6)
BOXES = [[(-0.7, 0.15, 1.7), (0.2, 1.2, 2.5)], [(-0.48, -0.45, 1.05), (-0.28, 0.1, 1.3)]]
CAMERA = ptzcal.Camera(800, 600, 845.0, 845.0, 427.0, 285.0, t=(0.157, -0.05, 0.0))
REGION = ptzcal.Region(-0.5, 0.43, -0.36, 0.33, 16, 12)


def site(**changes):
    made = ptzcal.Site(rig_model(), CAMERA, **changes)
    made.set_room(*ROOM, BOXES)
    return made


class Studies(TestCase):
    @classmethod
    def setUpClass(cls):
        cls.set_up = site().set_up(REGION)

    def test_a_study(self):
        heard = []
        study = self.set_up.study(
            [0.0, 0.2, 1.0],
            trials=10,
            distances=[1.0, 4.0],
            progress=lambda done, total: heard.append((done, total)),
        )
        self.assertEqual(heard, [(i, 10) for i in range(1, 11)])
        self.assertLess(study.cell("joint_ml", 0).rms[ptzcal.StudyQuantity.POSITION], 1e-6)
        joint, cascade = study.cell("joint_ml", 2), study.cell("dlt_cascade", 2)
        self.assertEqual((joint.used, joint.failures, joint.head_sigma), (10, 0, 1.0))
        self.assertTrue(np.all(joint.rms < 3 * joint.expected))
        self.assertGreater(cascade.rms[0], joint.rms[0])
        self.assertEqual(study.handoff("joint_ml", 2).shape, (2,))
        with self.assertRaises(ptzcal.InvalidArgument):
            study.cell("dlt_cascade_printed", 0)
        with tempfile.TemporaryDirectory() as folder:
            study.save_csv(Path(folder, "study.csv"))
            study.save_json(Path(folder, "study.json"))
            read = json.loads(Path(folder, "study.json").read_text())
            self.assertEqual(len(read["cells"]), 12)
            study.save_plot(Path(folder, "a.svg"), "errors", "rotation")
            study.save_plot(Path(folder, "b.svg"), "grid", "joint_ml")
            study.save_plot(Path(folder, "c.svg"), "scatter", 1)
            self.assertIn("rotation error (mrad)", Path(folder, "a.svg").read_text())
            self.assertEqual(len(Path(folder, "study.csv").read_text().splitlines()), 13)

    def test_threads_do_not_matter_and_seeds_do(self):
        def rms(threads, seed):
            study = self.set_up.study([0.5], methods=["closed_form"], trials=20, threads=threads, seed=seed)
            return list(study.cell("closed_form", 0).rms)

        self.assertEqual(rms(1, 1), rms(3, 1))
        self.assertNotEqual(rms(1, 1), rms(1, 2))

    def test_it_can_be_stopped(self):
        with self.assertRaises(ptzcal.Cancelled):
            self.set_up.study([0.5], progress=lambda done, total: True)
        with self.assertRaises(ZeroDivisionError):
            self.set_up.study([0.5], progress=lambda done, total: 1 / 0)

    def test_bad_studies_are_refused(self):
        for bad in ({"trials": 0}, {"threads": 0}, {"methods": []}, {"distances": [-1.0]}):
            with self.subTest(bad), self.assertRaises(ptzcal.InvalidArgument):
                self.set_up.study([0.5], **bad)
        for levels in ([-0.1], [], [[0.1, 1e9]]):
            with self.subTest(levels), self.assertRaises(ptzcal.InvalidArgument):
                self.set_up.study(levels)
        with self.assertRaises(ptzcal.Error):
            self.set_up.study([np.nan])
        with self.assertRaises(ValueError):
            self.set_up.study([0.5], methods=["guess"])
        with self.assertRaises(ptzcal.Error):
            ptzcal.Site(rig_model(), CAMERA).set_up(REGION)  # nothing around it

    def test_set_ups_of_points_and_the_printed_cascade(self):
        rng = np.random.default_rng(1)
        points = rng.uniform((-0.7, -0.5, 2.0), (0.7, 0.5, 4.0), (60, 3))
        set_up = site().set_up(points)
        self.assertGreater(len(set_up), 50)
        set_up.set_control(points)
        methods = ["dlt_exact", "dlt_cascade_printed"]
        study = set_up.study([[0.5, 0.2]], methods=methods, trials=5)
        exact, printed = (study.cell(m, 0) for m in methods)
        np.testing.assert_allclose(exact.rms[2:], printed.rms[2:], rtol=1e-6)  # K is not touched
        self.assertGreater(printed.rms[0], exact.rms[0])

    def test_a_label(self):
        label = self.set_up.label([0.5, 3.0, 5.0], [0.2, 1.0], trials=10)
        self.assertEqual([r.distance for r in label.rows], [3.0, 3.0, 5.0, 5.0])
        row = label.rows[-1]
        self.assertTrue(np.all(row.simulated < 3 * row.expected) and row.handoff_expected > 0)
        with tempfile.TemporaryDirectory() as folder:
            label.save_csv(Path(folder, "label.csv"))
            label.save_json(Path(folder, "label.json"))
            label.save_plot(Path(folder, "label.svg"))
            label.save_plot(Path(folder, "handoff.svg"), "handoff")
            self.assertIn("working distance (m)", Path(folder, "handoff.svg").read_text())
        with self.assertRaises(ptzcal.Error):
            self.set_up.label([0.5], [0.2])


class Plans(TestCase):
    def test_a_plan_and_what_comes_next(self):
        room = site()
        plan = room.plan(REGION, 0.002)
        self.assertLessEqual(plan.grid_rms, 0.002)
        self.assertLess(len(plan.shots), plan.grid_seen)
        self.assertLessEqual(plan.shots.rms[-1], 0.002)
        self.assertIsNone(plan.limited_by)
        self.assertLess(plan.limit_rms, 1e-4)
        self.assertGreater(plan.grid.pan_steps, 2)
        taken = plan.shots
        seen = np.ones(len(taken))
        now, more = room.next_shots(taken.pan_tilt, taken.depth, seen, REGION, 5)
        self.assertAlmostEqual(now[0], taken.rms[-1], delta=1e-3 * taken.rms[-1])
        self.assertEqual(len(more), 5)
        self.assertTrue(np.all(np.diff(more.rms) < 0) and more.rms[0] < now[0])
        self.assertTrue(np.all(more.semi_axis <= more.rms))

    def test_what_cannot_be_reached_says_why(self):
        unsure = site(rig_sigmas={"laser_x0": 0.005, "laser_y0": 0.005})
        with self.assertRaises(ptzcal.Error) as refused:
            unsure.plan(REGION, 0.001)
        self.assertEqual(refused.exception.status, ptzcal.Status.UNREACHABLE)
        self.assertIn("laser", str(refused.exception))
        plan = unsure.plan(REGION, 0.05)
        self.assertIn(plan.limited_by, (ptzcal.RigParameter.LASER_X0, ptzcal.RigParameter.LASER_Y0))

    def test_a_wall_wants_a_known_lens(self):
        wall = ptzcal.Site(rig_model(), CAMERA)
        wall.set_plane((0, 0, 1), 3.0)
        with self.assertRaises(ptzcal.Error) as refused:
            wall.plan(REGION, 0.01)
        self.assertEqual(refused.exception.status, ptzcal.Status.DEGENERATE)
        known = ptzcal.Site(rig_model(), CAMERA, lens=CAMERA, pointing_sigma=(1e-4, 1e-4))
        known.set_plane((0, 0, 1), 3.0)
        self.assertGreater(len(known.plan(REGION, 0.01).shots), 3)
        known.set_depths(1.0, 5.0)
        self.assertLess(known.plan(REGION, 0.01).grid_rms, 0.01)

    def test_bad_questions_are_refused(self):
        room = site()
        one = np.array([[0.0, 0.0]])
        for bad in ({"target": -1.0}, {"head_sigma": 0.0}, {"count": 0}):
            with self.subTest(bad), self.assertRaises(ptzcal.InvalidArgument):
                room.next_shots(one, [2.0], [True], REGION, **{"count": 1, **bad})
        with self.assertRaises(ptzcal.Error):
            room.next_shots(np.empty((0, 2)), [], [], REGION)
        with self.assertRaises(ValueError):
            room.next_shots(one, [2.0, 3.0], [True], REGION)
        with self.assertRaises(ValueError):
            site(rig_sigmas={"nothing": 1.0})


class Watched(TestCase):
    def test_a_scan_ends_once_its_camera_is_known_well_enough(self):
        region = ptzcal.Region(-0.5, 0.43, -0.36, 0.33, 20, 16)
        with ptzcal.Rig.open("sim:room") as rig:
            camera = ptzcal.FixedCamera("sim:fixed/0", distortion="radial2")
            scan = rig.scan_region(region, [camera], target_accuracy=0.002)
            self.assertTrue(80 < len(scan) < 300, len(scan))
            self.assertFalse(scan.complete)
            self.assertIsNone(scan.end)
            with self.assertRaises(ptzcal.InvalidArgument):
                rig.scan_region(region, [camera], target_accuracy=-1.0)


if __name__ == "__main__":
    unittest.main()
