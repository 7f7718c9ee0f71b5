import threading
import unittest

import numpy as np

import ptzcal
from support import TestCase


class Simulators(TestCase):
    def test_truth(self):
        s = ptzcal.Simulator()
        self.assertEqual(s.fixed_cameras, 2)
        self.assertEqual(s.true_camera(0).size, (800, 600))
        self.assertNotEqual(s.true_rig, s.nominal_rig)
        self.assertEqual(
            ptzcal.Simulator("sim:room?misalignment=0").true_rig.pan_zero,
            ptzcal.Simulator("sim:room?misalignment=0").nominal_rig.pan_zero,
        )
        self.assertClose(s.true_station.R, np.eye(3))
        self.assertIsNone(s.true_station.covariance)
        moved = ptzcal.Simulator("sim:room?station=2").true_station
        self.assertClose(np.degrees(moved.rotation_angle), 37.33, atol=0.01)
        # The same camera, seen from the two stations.
        there = ptzcal.Simulator("sim:room?station=2").true_camera(0)
        for point in ([0.1, 0.2, 3.0], [-0.5, 0.0, 4.0]):
            here = s.true_camera(0).project(moved.transform(point))
            self.assertClose(there.project(point), here, atol=1e-6)

    def test_head(self):
        s = ptzcal.Simulator()
        s.move(0.3, -0.1)
        self.assertIs(s.motion(), ptzcal.Motion.MOVING)
        s.stop()
        s.sleep(1.0)
        self.assertIs(s.motion(), ptzcal.Motion.IDLE)
        self.assertLess(s.position().pan, 0.29)
        s.move(0.3, -0.1)
        before = s.now()
        s.sleep(5.0)
        self.assertGreaterEqual(s.now(), before + 5)
        self.assertClose(s.position(), (0.3, -0.1), atol=0.01)

    def test_a_spot_is_where_the_truth_says(self):
        s = ptzcal.Simulator("sim:room?noise=1&repeatability_deg=0&step_deg=0&backlash_deg=0")
        s.sleep(1)
        off = s.next_frame(s.now())
        s.set_laser(True)
        on = s.next_frame(s.now())
        s.set_laser(False)
        spot = ptzcal.detect_spot(on.image, off.image)
        point, _ = s.true_rig.locate([s.position()], [spot.centre])
        fixed_off = s.next_frame(s.now(), camera=0)
        s.set_laser(True)
        fixed_on = s.next_frame(s.now(), camera=0)
        seen = ptzcal.detect_spot(fixed_on.image, fixed_off.image)
        self.assertClose(s.true_camera(0).project(point[0]), seen.centre, atol=0.5)

    def test_frames_of_every_format(self):
        shapes = {
            "gray8": [(576, 720)],
            "rgb24": [(576, 720, 3)],
            "bgr24": [(576, 720, 3)],
            "rgba32": [(576, 720, 4)],
            "bgra32": [(576, 720, 4)],
            "yuyv": [(576, 720, 2)],
            "nv12": [(576, 720), (288, 360, 2)],
            "i420": [(576, 720), (288, 360), (288, 360)],
        }
        for name, expected in shapes.items():
            with self.subTest(name):
                s = ptzcal.Simulator(f"sim:room?format={name}")
                frame = s.next_frame()
                self.assertEqual(frame.format, ptzcal.PixelFormat[name.upper()])
                planes = frame.image if isinstance(frame.image, tuple) else (frame.image,)
                self.assertEqual([p.shape for p in planes], expected)
                self.assertGreater(planes[0].std(), 5)
                s.set_laser(True)
                on = s.next_frame(s.now())
                spot = ptzcal.detect_spot(on.image, frame.image, format=frame.format)
                self.assertGreater(spot.signal_to_noise, 8)

    def test_frames_are_copies(self):
        s = ptzcal.Simulator()
        first = s.next_frame()
        kept = first.image.copy()
        s.set_laser(True)
        second = s.next_frame(s.now())
        self.assertGreater(second.timestamp, first.timestamp)
        del s
        self.assertTrue(np.array_equal(first.image, kept))

    def test_threads(self):
        s = ptzcal.Simulator()
        failures, stamps = [], {0: [], 1: []}

        def watch(camera):
            try:
                for _ in range(10):
                    stamps[camera].append(s.next_frame(0.0, 3.0, camera).timestamp)
            except Exception as error:
                failures.append(error)

        threads = [threading.Thread(target=watch, args=(n % 2,)) for n in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])
        self.assertEqual([len(set(times)) for times in stamps.values()], [20, 20])

    def test_errors(self):
        with self.fails("INVALID_ARGUMENT") as refused:
            ptzcal.Simulator("sim:room?colour=green")
        self.assertIn("noise", str(refused.error))
        with self.assertRaisesRegex(ValueError, "NUL"):
            ptzcal.Simulator("sim:room\0")
        s = ptzcal.Simulator()
        with self.fails("INVALID_ARGUMENT"):
            s.true_camera(2)
        with self.fails("INVALID_ARGUMENT"):
            s.next_frame(camera=5)
        with self.fails("UNREACHABLE"):
            s.move(3.0, 0)
        with self.fails("INVALID_ARGUMENT"):
            s.sleep(-1)
        with self.fails("DEVICE_TIMEOUT"):
            s.next_frame(not_before=s.now() + 100, timeout=0.1)
        with self.fails("LASER_REFUSED"):
            ptzcal.Simulator("sim:room?laser_refuses=1").set_laser(True)
        lost = ptzcal.Simulator("sim:room?unplug_after=1")
        lost.position()
        with self.fails("DEVICE_LOST"):
            lost.position()


if __name__ == "__main__":
    unittest.main()
