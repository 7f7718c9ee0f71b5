import copy
import pickle
import unittest

import ptzcal
from ptzcal import errors
from support import TestCase


class Errors(TestCase):
    def test_classes(self):
        self.assertIsInstance(errors.error(-1, "m"), ptzcal.InvalidArgument)
        self.assertIsInstance(errors.error(-1, "m"), ValueError)
        self.assertIsInstance(errors.error(-3, "m"), ValueError)
        self.assertIsInstance(errors.error(-500, "m"), ptzcal.Cancelled)
        self.assertIs(type(errors.error(-300, "m")), ptzcal.Error)

    def test_what_it_says(self):
        error = errors.error(-107, "point 3 is outside", 3, "use another model")
        self.assertEqual(str(error), "point 3 is outside (use another model)")
        self.assertEqual(error.status_name, "OUTSIDE_LENS")
        self.assertEqual(error.index, 3)
        self.assertEqual(str(ptzcal.Error(-300)), "DEVICE")

    def test_a_status_of_a_newer_library(self):
        error = errors.error(-4711, "news")
        self.assertEqual((error.status, error.status_name), (-4711, "UNKNOWN"))

    def test_pickles_and_copies(self):
        error = errors.error(-3, "m", 7, "h")
        for other in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
            self.assertIs(type(other), ptzcal.InvalidArgument)
            self.assertEqual(
                (other.status, other.message, other.index, other.hint), (-3, "m", 7, "h")
            )


class Cancelling(TestCase):
    def test_token(self):
        token = ptzcal.Cancel()
        self.assertFalse(token.requested)
        token.request()
        self.assertTrue(token.requested)
        token.reset()
        self.assertFalse(token.requested)

    def test_handles_are_neither_copied_nor_pickled(self):
        token = ptzcal.Cancel()
        for spoil in (copy.copy, copy.deepcopy, pickle.dumps):
            with self.assertRaisesRegex(TypeError, "Cancel cannot be"):
                spoil(token)


if __name__ == "__main__":
    unittest.main()
