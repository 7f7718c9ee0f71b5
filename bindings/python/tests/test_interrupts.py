"""Ctrl-C at any moment of a rig's call: it comes out, with the laser off."""

import os
import signal
import threading
import time
import unittest

import numpy as np

import ptzcal
from support import TestCase
from test_rig import Devices


@unittest.skipUnless(hasattr(signal, "pthread_kill"), "needs signals")
class Interrupts(TestCase):
    def check(self, devices, work):
        with devices.open(settle=ptzcal.Settle(move_timeout=3600)) as rig:
            rig.set_laser(True)
            with self.assertRaises(KeyboardInterrupt):
                work(rig)
            self.assertFalse(devices.lit)
            self.assertTrue("stop" in devices.calls)
            self.assertIs(signal.getsignal(signal.SIGINT), signal.default_int_handler)
            devices.trouble.clear()
            devices.simulator.stop()
            self.assertEqual(len(rig.position()), 2)

    def setUp(self):
        if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            # A test runner in the background ignores Ctrl-C.
            previous = signal.signal(signal.SIGINT, signal.default_int_handler)
            self.addCleanup(signal.signal, signal.SIGINT, previous)

    def test_within_a_callback(self):
        devices = Devices()

        def work(rig):
            devices.trouble["motion"] = lambda: signal.raise_signal(signal.SIGINT)
            rig.move(0.3, 0.1)

        self.check(devices, work)

    def test_at_any_moment(self):
        for delay in np.linspace(0.01, 0.1, 12):
            with self.subTest(delay):
                devices = Devices()

                def work(rig, devices=devices, delay=delay):
                    devices.trouble["motion"] = lambda: ptzcal.Motion.MOVING
                    timer = threading.Timer(delay, os.kill, (os.getpid(), signal.SIGINT))
                    timer.start()
                    try:
                        rig.move(1.0, 0.1)
                    finally:
                        timer.join()

                self.check(devices, work)

    def test_a_callback_that_waits(self):
        devices = Devices()

        def work(rig):
            devices.trouble["motion"] = lambda: time.sleep(60)
            timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
            timer.start()
            rig.move(1.0, 0.1)

        began = time.monotonic()
        self.check(devices, work)
        self.assertLess(time.monotonic() - began, 20)

    def test_nested_rigs(self):
        """Ctrl-C inside a rig that a callback of another rig uses."""
        inner_devices = Devices()
        devices = Devices()
        with inner_devices.open() as inner:

            def work(rig):
                inner_devices.trouble["motion"] = lambda: signal.raise_signal(signal.SIGINT)
                devices.trouble["motion"] = lambda: inner.move(0.1, 0.0)
                rig.move(0.3, 0.1)

            self.check(devices, work)
            inner_devices.trouble.clear()


if __name__ == "__main__":
    unittest.main()
