import os
import signal
import tempfile
import threading
import unittest
from pathlib import Path

import numpy as np

import ptzcal
from support import TestCase
from test_rig import Devices

REGION = ptzcal.Region(-0.35, 0.35, -0.25, 0.25, 12, 8)
#: A rig whose model is true and whose encoders are perfect.
TRUE = "sim:room?misalignment=0&step_deg=0&backlash_deg=0&repeatability_deg=0"


class Scans(TestCase):
    @classmethod
    def setUpClass(cls):
        cls.progress = []
        with ptzcal.Rig.open(TRUE) as rig:
            cls.simulator = rig.simulator()
            cls.scan = rig.scan_region(
                REGION, ["sim:fixed/0", "sim:fixed/1"], progress=cls.progress.append
            )

    def test_it_is_complete(self):
        self.assertTrue(self.scan.complete)
        self.assertIsNone(self.scan.end)
        self.assertEqual((len(self.scan), self.scan.positions), (96, 96))
        self.assertGreater(self.scan.found, 80)
        self.assertEqual(self.scan.fixed_cameras, 2)
        self.assertEqual(
            (self.scan.resumed, self.scan.journal_damaged, self.scan.journal_cut), (0, 0, 0)
        )
        self.assertIn("96 of 96", repr(self.scan))

    def test_progress(self):
        last = self.progress[-1]
        self.assertEqual((last.done, last.total), (96, 96))
        self.assertGreater(last.elapsed, 0)
        self.assertIsInstance(last.measured, bool)
        shots = [p.shot for p in self.progress if p.shot is not None]
        self.assertEqual({s.index for s in shots}, set(range(96)))
        # What progress heard is what the scan holds, also after the call.
        by_index = {shot.index: shot for shot in self.scan}
        for heard in shots:
            kept = by_index[heard.index]
            self.assertEqual(
                (heard.pan, heard.tilt, heard.found), (kept.pan, kept.tilt, kept.found)
            )
            if heard.point is not None:
                self.assertClose(heard.covariance, kept.covariance)

    def test_shots(self):
        for shot in self.scan:
            tilt_step, pan_step = divmod(shot.index, REGION.pan_steps)
            expected = (
                np.linspace(-0.35, 0.35, 12)[pan_step],
                np.linspace(-0.25, 0.25, 8)[tilt_step],
            )
            self.assertClose((shot.pan, shot.tilt), expected, atol=0.003)
            self.assertEqual(shot.found, shot.inverse_depth is not None)
            if shot.point is not None:
                self.assertEqual(shot.covariance.shape, (3, 3))
                self.assertTrue(0.5 < 1 / shot.inverse_depth < 6)
        self.assertEqual(self.scan[-1].index, self.scan[95].index)
        with self.assertRaises(IndexError):
            self.scan[96]

    def test_spots_are_where_the_truth_says(self):
        errors = []
        for number, shot in enumerate(self.scan):
            head = self.scan.spot(number)
            self.assertEqual(head is not None, shot.found)
            fixed = self.scan.spot(number, 0)
            if fixed is not None and shot.point is not None:
                seen = self.simulator.true_camera(0).project(shot.point)
                errors.append(np.linalg.norm(seen - fixed.centre))
        self.assertGreater(len(errors), 50)
        self.assertLess(np.median(errors), 1.0)
        with self.fails("INVALID_ARGUMENT"):
            self.scan.spot(0, 5)
        with self.fails("INVALID_ARGUMENT"):
            self.scan.spot(96)

    def test_points(self):
        expected = [shot.point for shot in self.scan if shot.point is not None]
        self.assertTrue(np.array_equal(self.scan.points, expected))

    def test_cloud(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "cloud.ply")
            self.scan.save_ply(path)
            header = path.read_bytes().split(b"end_header")[0]
        self.assertIn(b"element vertex %d\n" % len(self.scan.points), header)

    def test_calibration(self):
        for number in (0, 1):
            truth = self.simulator.true_camera(number)
            measurements = ptzcal.Correspondences(*truth.size)
            measurements.add_scan(self.scan, number)
            result = ptzcal.calibrate_camera(measurements, distortion="brown_conrady")
            error = result.camera.centre - truth.centre
            self.assertTrue((np.abs(error) < 6 * result.standard_deviations[-3:]).all())
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Correspondences(800, 600).add_scan(self.scan, 2)
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Correspondences(640, 480).add_scan(self.scan, 0)

    def test_a_plane(self):
        edges = ptzcal.RoofEdges()
        back_wall = ptzcal.Region(0.1, 0.35, 0.0, 0.25)
        self.assertEqual(edges.add_plane_scan(self.scan, back_wall), 0)
        with self.fails("TOO_FEW_POINTS"):
            edges.add_plane_scan(self.scan, ptzcal.Region(1.0, 1.1, 0, 0.1))


class Ends(TestCase):
    def test_options(self):
        with ptzcal.Rig.open(TRUE) as rig:
            fixed = ptzcal.FixedCamera(
                "sim:fixed/0", known=rig.simulator().true_camera(0), distortion="brown_conrady"
            )
            scan = rig.scan_region(
                ptzcal.Region(0.1, 0.2, 0.0, 0.1, 3, 2),
                [fixed],
                frames_per_state=2,
                coarse_shots=0,
                spot=ptzcal.SpotOptions(colour="red"),
                gate=ptzcal.Gate(nearest=0.5, farthest=20.0),
            )
            self.assertEqual(len(scan), 6)

    def test_stopped_by_progress(self):
        with ptzcal.Rig.open(TRUE) as rig:
            scan = rig.scan_region(REGION, progress=lambda p: p.done >= 10)
            self.assertFalse(scan.complete)
            self.assertIsInstance(scan.end, ptzcal.Cancelled)
            self.assertTrue(10 <= len(scan) <= 12)
            self.assertLessEqual(len(scan.points), len(scan))

    def test_cancelled(self):
        token = ptzcal.Cancel()
        with ptzcal.Rig.open(TRUE) as rig:
            scan = rig.scan_region(REGION, progress=lambda p: token.request(), cancel=token)
            self.assertIsInstance(scan.end, ptzcal.Cancelled)

    def test_an_exception_of_progress(self):
        with ptzcal.Rig.open(TRUE) as rig:

            def progress(state):
                if state.done == 5:
                    raise LookupError("enough")

            with self.assertRaisesRegex(LookupError, "enough"):
                rig.scan_region(REGION, progress=progress)
            rig.move(0, 0)

    def test_interrupted_without_any_callback(self):
        if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            previous = signal.signal(signal.SIGINT, signal.default_int_handler)
            self.addCleanup(signal.signal, signal.SIGINT, previous)
        with ptzcal.Rig.open(TRUE) as rig:
            threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
            with self.assertRaises(KeyboardInterrupt):
                rig.scan_region(ptzcal.Region(-0.35, 0.35, -0.25, 0.25, 100, 100))
            rig.move(0, 0)

    def test_a_device_that_is_lost(self):
        devices = Devices()
        calls = []

        def frames(not_before, timeout):
            calls.append(None)
            if len(calls) > 60:
                raise ConnectionError("the cable")
            return devices.simulator.next_frame(not_before, timeout)

        with devices.open(frames=frames) as rig:
            scan = rig.scan_region(REGION)
        self.assertFalse(scan.complete)
        self.assertEqual(scan.end.status, ptzcal.Status.DEVICE_LOST)
        self.assertIsInstance(scan.end.__cause__, ConnectionError)
        self.assertGreater(len(scan), 1)
        self.assertFalse(devices.lit)

    def once_without_a_frame(self, log):
        """Scans with a source of frames that fails once."""
        devices = Devices(TRUE)
        calls = []

        def frames(not_before, timeout):
            calls.append(None)
            if len(calls) == 60:
                raise OSError("a glitch")
            return devices.simulator.next_frame(not_before, timeout)

        with devices.open(frames=frames, log=log) as rig:
            return rig.scan_region(ptzcal.Region(-0.2, 0.2, -0.1, 0.1, 5, 4))

    def test_a_failure_that_does_not_matter(self):
        messages = []
        scan = self.once_without_a_frame(lambda *message: messages.append(message))
        self.assertTrue(scan.complete)
        self.assertIsNone(scan.end)
        self.assertTrue(messages)
        for level, text in messages:
            self.assertIsInstance(level, ptzcal.LogLevel)
            self.assertIsInstance(text, str)

    def test_a_bug_in_the_log_comes_out(self):
        def log(level, text):
            raise KeyError("log")

        with self.assertRaisesRegex(KeyError, "log"):
            self.once_without_a_frame(log)

    def test_fixed_cameras_of_the_host(self):
        devices = Devices(TRUE)
        region = ptzcal.Region(-0.2, 0.3, -0.2, 0.2, 5, 4)

        def fixed(not_before, timeout):
            return devices.simulator.next_frame(not_before, timeout, 0)

        with devices.open() as rig:
            scan = rig.scan_region(region, [ptzcal.FixedCamera(fixed, (800, 600))])
            self.assertTrue(scan.complete)
            self.assertGreater(sum(shot.fixed_found for shot in scan), 5)

            def broken(not_before, timeout):
                raise ArithmeticError("a bug")

            with self.assertRaisesRegex(ArithmeticError, "a bug"):
                rig.scan_region(region, [ptzcal.FixedCamera(broken, (800, 600))])
            self.assertFalse(devices.lit)

    def test_journal(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "tägliche shots.journal")
            with ptzcal.Rig.open(TRUE) as rig:
                first = rig.scan_region(REGION, journal=path, progress=lambda p: p.done >= 20)
                self.assertFalse(first.complete)
            with open(path, "ab") as journal:
                journal.write(b"half a rec")
            with ptzcal.Rig.open(TRUE) as rig:
                second = rig.scan_region(REGION, journal=path, journal_sync=False)
            self.assertTrue(second.complete)
            self.assertEqual(second.resumed, len(first))
            self.assertGreater(second.journal_cut, 0)
            with ptzcal.Rig.open(TRUE) as rig, self.fails("FILE_MISMATCH"):
                rig.scan_region(ptzcal.Region(0, 0.1, 0, 0.1, 3, 3), journal=path)
            no_journal = os.path.join(folder, "letter.txt")
            with open(no_journal, "w") as letter:
                letter.write("Dear reader")
            with ptzcal.Rig.open(TRUE) as rig, self.fails("FILE_FORMAT"):
                rig.scan_region(REGION, journal=no_journal)

    def test_wrong_arguments(self):
        with ptzcal.Rig.open(TRUE) as rig:
            with self.fails("UNREACHABLE"):
                rig.scan_region(ptzcal.Region(0, 3.0, 0, 0.1, 3, 3))
            with self.fails("INVALID_ARGUMENT"):
                rig.scan_region(ptzcal.Region(0, 0.1, 0, 0.1, 0, 3))
            with self.fails("INVALID_ARGUMENT"):
                rig.scan_region(REGION, frames_per_state=0)
            with self.fails("INVALID_ARGUMENT"):
                rig.scan_region(REGION, ["sim:fixed/7"])
            with self.assertRaises(TypeError):
                rig.scan_region(REGION, "sim:fixed/0")
            with self.assertRaisesRegex(ValueError, "needs its size"):
                rig.scan_region(REGION, [ptzcal.FixedCamera(lambda a, b: None)])
            with self.assertRaises(ValueError):
                rig.scan_region(ptzcal.Region(0, 0.1, 0, 0.1, -1, 3))
            rig.close()
            with self.assertRaisesRegex(ValueError, "closed"):
                rig.scan_region(REGION)


if __name__ == "__main__":
    unittest.main()
