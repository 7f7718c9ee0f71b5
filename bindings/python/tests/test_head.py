"""Heads: moves, their ends, and what is refused."""

import os
import tempfile
import threading
import unittest

import ptzcal
from ptzcal import MoveEnd
from support import TestCase


class Heads(TestCase):
    def test_moves_end_and_are_heard(self):
        ends, heard = [], threading.Semaphore(0)

        def on_move_end(event):
            ends.append(event)
            heard.release()

        with ptzcal.Head("sim:room", on_move_end=on_move_end) as head:
            number = head.move(0.05, -0.02)
            self.assertEqual(head.wait(number), MoveEnd.ARRIVED)
            at = head.position()
            self.assertAlmostEqual(at.pan, 0.05, delta=2e-3)
            self.assertAlmostEqual(at.tilt, -0.02, delta=2e-3)
            self.assertEqual(head.wait(head.move_by(-0.03, 0.0)), MoveEnd.ARRIVED)
            self.assertTrue(head.capabilities.has_view_moves)
            for _ in range(2):
                self.assertTrue(heard.acquire(timeout=20.0))
            self.assertEqual([event.end for event in ends], [MoveEnd.ARRIVED] * 2)
            self.assertEqual(ends[0].number, number)
            self.assertAlmostEqual(ends[0].pan, 0.05, delta=2e-3)
            self.assertEqual(head.motion(), ptzcal.Motion.IDLE)
            head.stop()
        with self.assertRaises(ValueError):
            head.position()

    def test_capabilities_and_identity(self):
        with ptzcal.Head("sim:room") as head:
            can = head.capabilities
            self.assertTrue(can.pan_min < -1.7 < 1.7 < can.pan_max and can.pan_step > 0.0)
            self.assertIs(can.raw_units, False)
            self.assertEqual(len(head.identity), 4)

    def test_refusals(self):
        for address, status in (
            ("room", "INVALID_ADDRESS"),
            ("nonsense:///dev/null", "UNSUPPORTED"),
            ("onvif://a:b@camera/", "INVALID_ADDRESS"),
        ):
            with self.fails(status):
                ptzcal.Head(address)
        with ptzcal.Head("sim:room") as head:
            with self.fails("UNREACHABLE"):
                head.move(3.0, 0.0)
            with self.fails("NOT_FINITE"):
                head.move(float("nan"), 0.0)
            with self.fails("INVALID_ARGUMENT"):
                head.drive(0.1, 0.0, dead_man=0.0)
            with self.fails("INVALID_ARGUMENT"):
                head.wait(99, 0.1)


class Recordings(TestCase):
    def test_a_recorded_scan_is_scanned_again(self):
        region = ptzcal.Region(-0.1, 0.1, 0.0, 0.0, 3, 1)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "scan")
            with ptzcal.Rig.open("sim:room?seed=3") as rig:
                scan = rig.scan_region(region, ["sim:fixed/0"], recording=path)
                with self.fails("UNSUPPORTED"):
                    rig.recorded_region()
            with ptzcal.Rig.open(f"folder://{path}") as rig:
                self.assertEqual(rig.recorded_region(), region)
                again = rig.scan_region(rig.recorded_region(), ["folder:fixed/0"])
            self.assertEqual(len(again), 3)
            for a, b in zip(scan, again):
                self.assertEqual((a.pan, a.tilt), (b.pan, b.tilt))
                self.assertTrue((a.point == b.point).all())


if __name__ == "__main__":
    unittest.main()
