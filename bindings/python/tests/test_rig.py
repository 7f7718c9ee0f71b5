"""Rigs on Python objects: what callbacks return, what they raise, and that the laser is off."""

import gc
import threading
import time
import unittest

import numpy as np

import ptzcal
from support import TestCase

QUICK = ptzcal.Settle(readings=2, duration=0.0, picture=0.0)
POINT = (0.6, -0.3, 4.0)


class Devices:
    """A simulator behind Python functions, each of which can be made to misbehave."""

    pan_range, tilt_range = (-1.7, 1.7), (-0.4, 0.4)
    pan_step = tilt_step = 0.00122

    def __init__(self, address="sim:room"):
        self.simulator = ptzcal.Simulator(address)
        self.trouble = {}
        self.calls = []
        self.lit = False

    def heard(self, name):
        self.calls.append(name)
        trouble = self.trouble.get(name)
        if isinstance(trouble, BaseException):
            raise trouble
        return trouble() if callable(trouble) else None

    def move(self, pan, tilt):
        self.heard("move")
        self.simulator.move(pan, tilt)

    def position(self):
        return self.heard("position") or self.simulator.position()

    def motion(self):
        return self.heard("motion") or self.simulator.motion()

    def stop(self):
        self.heard("stop")
        self.simulator.stop()

    def laser(self, on):
        self.lit = on
        self.heard("laser on" if on else "laser off")
        self.simulator.set_laser(on)

    def frames(self, not_before, timeout):
        return self.heard("frames") or self.simulator.next_frame(not_before, timeout)

    def now(self):
        self.heard("now")
        return self.simulator.now()

    def sleep(self, seconds):
        self.heard("sleep")
        self.simulator.sleep(seconds)

    def open(self, **changes):
        arguments = dict(
            model=self.simulator.nominal_rig,
            ptz=self,
            laser=self.laser,
            frames=self.frames,
            clock=self,
        )
        return ptzcal.Rig.open(**{**arguments, **changes})


class ByAddress(TestCase):
    def test_verbs(self):
        with ptzcal.Rig.open("sim:room") as rig:
            self.assertEqual(rig.model, rig.simulator().nominal_rig)
            rig.move(0.2, 0.1)
            self.assertClose(rig.position(), (0.2, 0.1), atol=0.002)
            aimed = rig.aim_at_point(POINT)
            self.assertClose(aimed, rig.model.aim(POINT), atol=1e-6)
            self.assertClose(rig.position(), aimed, atol=0.002)
            aimed = rig.aim_at_pixel(360, 288, 4.0)
            self.assertClose(rig.position(), aimed, atol=0.002)
            rig.set_laser(True)
            rig.set_laser(False)
            rig.stop()
            rig.emergency_off()
            with self.fails("LASER_REFUSED"):
                rig.set_laser(True)
            rig.release()
            rig.set_laser(True)
            self.assertFalse(rig.closed)
        self.assertTrue(rig.closed)

    def test_closing_switches_the_laser_off(self):
        rig = ptzcal.Rig.open("sim:room")
        simulator = rig.simulator()
        dark = simulator.next_frame().image.astype(int)
        rig.set_laser(True)
        lit = simulator.next_frame(simulator.now()).image
        self.assertGreater(np.abs(lit - dark).max(), 60)
        rig.close()
        rig.close()
        again = simulator.next_frame(simulator.now()).image
        self.assertLess(np.abs(again - dark).max(), 40)

    def test_a_closed_rig(self):
        rig = ptzcal.Rig.open("sim:room")
        rig.close()
        for use in (
            rig.position,
            rig.stop,
            rig.emergency_off,
            rig.simulator,
            lambda: rig.move(0, 0),
            lambda: rig.model,
        ):
            with self.assertRaisesRegex(ValueError, "the rig is closed"):
                use()

    def test_wrong_arguments(self):
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Rig.open()
        with self.fails("UNSUPPORTED"):
            ptzcal.Rig.open("visca:///dev/nothing")
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Rig.open("sim:room", laser_max_on=0)
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Rig.open("sim:room", settle=ptzcal.Settle(readings=0))
        with self.assertRaises(ValueError):
            ptzcal.Rig.open("sim:room", stale_frames=-1)
        with ptzcal.Rig.open("sim:room") as rig:
            with self.fails("UNREACHABLE"):
                rig.move(3.1, 0)
            with self.fails("NOT_FINITE"):
                rig.move(np.nan, 0)
            with self.assertRaises(ValueError):
                rig.aim_at_point([1, 2])
            with self.assertRaises(TypeError):
                rig.move(0, 0, cancel="now")

    def test_a_forgotten_rig_is_closed(self):
        rig = ptzcal.Rig.open("sim:room")
        simulator = rig.simulator()
        dark = simulator.next_frame().image.astype(int)
        rig.set_laser(True)
        with self.assertWarns(ResourceWarning):
            del rig
            gc.collect()
        again = simulator.next_frame(simulator.now()).image
        self.assertLess(np.abs(again - dark).max(), 40)


class ByCallbacks(TestCase):
    def setUp(self):
        self.devices = Devices()

    def test_everything_is_called(self):
        with self.devices.open() as rig:
            aimed = rig.aim_at_point(POINT)
            self.assertClose(self.devices.simulator.position(), aimed, atol=0.002)
            rig.set_laser(True)
            self.assertTrue(self.devices.lit)
        self.assertFalse(self.devices.lit)
        expected = {
            "move",
            "position",
            "motion",
            "stop",
            "laser off",
            "laser on",
            "frames",
            "now",
            "sleep",
        }
        self.assertEqual(set(self.devices.calls), expected)

    def test_images_of_all_kinds_are_frames(self):
        def simulated(kind):
            def frames(not_before, timeout):
                frame = self.devices.simulator.next_frame(not_before, timeout)
                return {
                    "frame": frame,
                    "image and time": (frame.image, frame.timestamp),
                    "image": frame.image,
                    "image without time": (frame.image, None),
                    "bottom-up": (frame.image[::-1], frame.timestamp, "bgr24"),
                    "to be copied": (frame.image[..., 1], frame.timestamp),
                }[kind]

            return frames

        for kind in (
            "frame",
            "image and time",
            "image",
            "image without time",
            "bottom-up",
            "to be copied",
        ):
            with self.subTest(kind), self.devices.open(frames=simulated(kind)) as rig:
                rig.move(0.1, 0.05)
                rig.move(0.0, 0.0)

    def test_optional_parts(self):
        class Silent:
            """Does not tell its motion or its steps; tells its zoom."""

            pan_range, tilt_range = (-1.7, 1.7), (-0.4, 0.4)
            move, stop = self.devices.move, self.devices.stop

            def position(_self):
                return (*self.devices.position(), 0.5)

        with self.devices.open(ptz=Silent()) as rig:
            rig.move(0.1, 0.05)
            self.assertClose(rig.position(), (0.1, 0.05), atol=0.002)

    def test_devices_over_an_address(self):
        lit = []
        with ptzcal.Rig.open("sim:room", laser=lit.append) as rig:
            rig.set_laser(True)
        self.assertIn(True, lit)
        self.assertFalse(lit[-1])

    def test_a_bug_in_a_callback_comes_out(self):
        for name in ("move", "position", "motion", "frames", "now", "sleep"):
            with self.subTest(name):
                devices = Devices()
                with devices.open() as rig:
                    rig.set_laser(True)
                    bug = ZeroDivisionError(name)
                    devices.trouble[name] = bug
                    with self.assertRaises(ZeroDivisionError) as caught:
                        rig.move(0.3, 0.1)
                    self.assertIs(caught.exception, bug)
                    self.assertFalse(devices.lit)
                    devices.trouble.clear()
                    rig.move(-0.1, 0.1)

    def test_device_failures_are_the_librarys(self):
        failures = {
            "DEVICE_LOST": [ConnectionResetError("unplugged"), ptzcal.Error(-301, "gone")],
            "DEVICE": [OSError("bus"), ptzcal.Error(-300, "broken"), ptzcal.Error(-4711, "odd")],
            "UNSUPPORTED": [NotImplementedError()],
        }
        for status, exceptions in failures.items():
            for exception in exceptions:
                with self.subTest(repr(exception)), self.devices.open() as rig:
                    self.devices.trouble["move"] = exception
                    with self.fails(status) as failed:
                        rig.move(0.3, 0.1)
                    self.assertIs(failed.error.__cause__, exception)
                    self.devices.trouble.clear()

    def test_a_time_out_of_the_frames(self):
        with self.devices.open() as rig:
            self.devices.trouble["frames"] = TimeoutError("no frame")
            with self.fails("DEVICE_TIMEOUT") as failed:
                rig.move(0.3, 0.1)
            self.assertIsInstance(failed.error.__cause__, TimeoutError)

    def test_nonsense_from_callbacks(self):
        nonsense = {
            "position": [lambda: (1.0,), lambda: "ab", lambda: (None, None)],
            "frames": [
                lambda: "picture",
                lambda: np.zeros((4, 4)),
                lambda: (np.zeros(3, np.uint8), 0.0),
            ],
        }
        for name, results in nonsense.items():
            for result in results:
                with self.subTest(name), self.devices.open() as rig:
                    self.devices.trouble[name] = result
                    with self.assertRaises((TypeError, ValueError)):
                        rig.move(0.3, 0.1)
                    self.devices.trouble.clear()
        with self.devices.open() as rig:
            self.devices.trouble["position"] = lambda: (float("nan"), 0.0)
            with self.assertRaises(ptzcal.Error):
                rig.move(0.3, 0.1)
            self.devices.trouble.clear()

    def test_an_open_that_fails(self):
        self.devices.trouble["laser off"] = RuntimeError("stuck")
        with self.assertRaisesRegex(RuntimeError, "stuck"):
            self.devices.open()
        self.devices.trouble["laser off"] = OSError("stuck")
        with self.fails("DEVICE") as failed:
            self.devices.open()
        self.assertIsInstance(failed.error.__cause__, OSError)
        with self.assertRaises(AttributeError):
            self.devices.open(ptz=object())

    def test_a_close_that_fails_closes(self):
        rig = self.devices.open()
        self.devices.trouble["laser off"] = OSError("stuck")
        with self.assertRaises(ptzcal.Error):
            rig.close()
        self.assertTrue(rig.closed)
        rig.close()

    def test_an_exception_passes_through_with(self):
        with self.assertRaisesRegex(RuntimeError, "mine"):
            with self.devices.open() as rig:
                rig.set_laser(True)
                raise RuntimeError("mine")
        self.assertTrue(rig.closed)
        self.assertFalse(self.devices.lit)

    def test_callbacks_may_use_the_library(self):
        with self.devices.open() as rig:
            busy = []

            def again():
                try:
                    rig.move(0, 0)
                except ptzcal.Error as error:
                    busy.append(error.status)
                try:
                    rig.close()
                except ptzcal.Error as error:
                    busy.append(error.status)

            self.devices.trouble["motion"] = again
            rig.move(0.2, 0.1)
            self.assertEqual(set(busy), {ptzcal.Status.BUSY})
            self.devices.trouble.clear()
            self.assertClose(rig.position(), (0.2, 0.1), atol=0.002)

    def test_callbacks_live_as_long_as_the_rig(self):
        rig = self.devices.open()
        gc.collect()
        [bytearray(1000) for _ in range(1000)]
        rig.move(0.1, 0.1)
        rig.close()


class Threads(TestCase):
    def setUp(self):
        self.devices = Devices()
        self.moving = threading.Event()

        def for_ever():
            self.moving.set()
            time.sleep(0.002)
            return ptzcal.Motion.MOVING

        self.devices.trouble["motion"] = for_ever

    def endless_move(self, rig, **arguments):
        """A move in another thread that does not end by itself; its exceptions."""
        caught = []

        def work():
            try:
                rig.move(1.0, 0.1, **arguments)
            except Exception as error:
                caught.append(error)

        thread = threading.Thread(target=work)
        thread.start()
        self.assertTrue(self.moving.wait(5))
        return thread, caught

    def check_cancelled(self, thread, caught):
        thread.join(10)
        self.assertFalse(thread.is_alive())
        self.assertEqual([type(e) for e in caught], [ptzcal.Cancelled])
        self.assertFalse(self.devices.lit)

    def settle(self):
        return ptzcal.Settle(move_timeout=3600)

    def test_cancel(self):
        token = ptzcal.Cancel()
        with self.devices.open(settle=self.settle()) as rig:
            thread, caught = self.endless_move(rig, cancel=token)
            token.request()
            self.check_cancelled(thread, caught)
            self.assertTrue("stop" in self.devices.calls)

    def test_stop(self):
        with self.devices.open(settle=self.settle()) as rig:
            thread, caught = self.endless_move(rig)
            rig.stop()
            self.check_cancelled(thread, caught)

    def test_close(self):
        rig = self.devices.open(settle=self.settle())
        thread, caught = self.endless_move(rig)
        rig.close()
        self.assertTrue(rig.closed)
        self.check_cancelled(thread, caught)

    def test_busy(self):
        with self.devices.open(settle=self.settle()) as rig:
            thread, caught = self.endless_move(rig)
            with self.fails("BUSY"):
                rig.position()
            rig.stop()
            self.check_cancelled(thread, caught)

    def test_emergency_off_from_another_thread(self):
        with self.devices.open(settle=self.settle()) as rig:
            thread, caught = self.endless_move(rig)
            before = self.devices.calls.count("laser off")
            rig.emergency_off()
            self.assertGreater(self.devices.calls.count("laser off"), before)
            rig.stop()
            thread.join(10)
            self.assertEqual(len(caught), 1)

    def test_python_goes_on_meanwhile(self):
        """Calls release the GIL."""
        measurements = ptzcal.Correspondences(800, 600)
        camera = ptzcal.Simulator().true_camera(0)
        xyz = np.random.default_rng(0).uniform([-1.5, -1, 2], [1.5, 1, 5], (100_000, 3))
        measurements.add_points(xyz, camera.project(xyz))
        worker = threading.Thread(target=ptzcal.calibrate_camera, args=(measurements,))
        turns = 0
        worker.start()
        while worker.is_alive():
            turns += 1
            time.sleep(0)
        self.assertGreater(turns, 20)


if __name__ == "__main__":
    unittest.main()
