"""Images of every layout: the same spot must be found, in place where the library can."""

import unittest

import numpy as np

try:
    import PIL.Image
except ImportError:
    PIL = None

import ptzcal
from ptzcal import images
from support import TestCase, spot_frames

CENTRE = (180.3, 95.6)


def is_view(array, view):
    """Was nothing copied?"""
    return any(np.shares_memory(plane, array) for plane in view.pixels)


def as_format(grey, name):
    """A grey picture in a layout."""
    if name == "gray8":
        return grey
    if name in ("rgb24", "bgr24"):
        return np.repeat(grey[..., None], 3, axis=2)
    if name in ("rgba32", "bgra32"):
        return np.repeat(grey[..., None], 4, axis=2)
    if name == "yuyv":
        return np.stack([grey, np.full_like(grey, 128)], axis=2)
    chroma = np.full((grey.shape[0] // 2, grey.shape[1]), 128, np.uint8)
    return np.concatenate([grey, chroma])


class Layouts(TestCase):
    def setUp(self):
        self.on, self.off = spot_frames()

    def assertFound(self, on, off, format=None):
        spot = ptzcal.detect_spot(on, off, format=format)
        self.assertClose(spot.centre, CENTRE, atol=0.1)
        return spot

    def test_every_format(self):
        for format in ptzcal.PixelFormat:
            name = format.name.lower()
            with self.subTest(name):
                on, off = as_format(self.on, name), as_format(self.off, name)
                first = self.assertFound(on, off, name)
                self.assertEqual(self.assertFound(on, off, format).x, first.x)
                self.assertEqual(self.assertFound(on, off, int(format)).x, first.x)

    def test_formats_are_guessed_as_in_opencv(self):
        for name in ("gray8", "bgr24", "bgra32"):
            view = images.view(as_format(self.on, name))
            self.assertEqual(view.format, ptzcal.PixelFormat[name.upper()])

    @unittest.skipIf(PIL is None, "Pillow is not installed")
    def test_pillow_knows_its_format(self):
        # A red spot: taken for BGR, its channels would be in the wrong places.
        off = np.repeat(self.off[..., None], 3, axis=2)
        on = off.copy()
        on[..., 0] = self.on
        expected = self.assertFound(on, off, "rgb24")
        on, off = PIL.Image.fromarray(on), PIL.Image.fromarray(off)
        for mode in ("RGB", "RGBA"):
            found = self.assertFound(on.convert(mode), off.convert(mode))
            self.assertEqual((found.x, found.y), (expected.x, expected.y))
        grey = PIL.Image.fromarray(self.on), PIL.Image.fromarray(self.off)
        self.assertEqual(self.assertFound(*grey).x, self.assertFound(self.on, self.off).x)
        with self.assertRaisesRegex(ValueError, "mode P: convert"):
            ptzcal.detect_spot(on.convert("P"), off.convert("P"))
        with self.assertRaisesRegex(ValueError, "must be of shape"):
            ptzcal.detect_spot(on, off, format="gray8")

    def test_colour_order_matters(self):
        # A red spot is in the last channel of BGR and in the first of RGB.
        off = np.repeat(self.off[..., None], 3, axis=2)
        on = off.copy()
        on[..., 2] = self.on
        self.assertFound(on, off)
        spot = ptzcal.detect_spot(on, off, colour="red")
        self.assertClose(spot.centre, CENTRE, atol=0.1)
        with self.assertRaises(ptzcal.SpotNotFound):
            ptzcal.detect_spot(on, off, format="rgb24", colour="red")

    def test_planes(self):
        def planes(grey, name):
            h, w = grey.shape
            half = np.full(((h + 1) // 2, (w + 1) // 2), 128, np.uint8)
            return (grey, np.stack([half, half], axis=2)) if name == "nv12" else (grey, half, half)

        odd_on, odd_off = self.on[:-1, :-1], self.off[:-1, :-1]
        for name in ("nv12", "i420"):
            with self.subTest(name):
                self.assertFound(planes(self.on, name), planes(self.off, name), name)
                self.assertFound(planes(odd_on, name), planes(odd_off, name), name)

    def test_read_in_place(self):
        wide = np.zeros((240, 400, 3), np.uint8)
        cases = {
            "packed": self.on,
            "rows apart": wide[:, 10:330],
            "bottom-up": self.on[::-1],
            "every second row": self.on[::2],
            "every second row, bottom-up": self.on[::-2],
            "one row": self.on[5:6],
            "Fortran rows of one": np.asfortranarray(self.on[:1]),
        }
        for name, array in cases.items():
            with self.subTest(name):
                self.assertTrue(is_view(array, images.view(array)))

    def test_copied_where_it_must_be(self):
        colour = np.repeat(self.on[..., None], 3, axis=2)
        cases = {
            "columns reversed": self.on[:, ::-1],
            "every second column": self.on[:, ::2],
            "channels reversed": colour[..., ::-1],
            "transposed": self.on.T,
            "one channel of three": colour[..., 1],
            "the same row again and again": np.broadcast_to(self.on[0], self.on.shape),
        }
        for name, array in cases.items():
            with self.subTest(name):
                view = images.view(array)
                self.assertFalse(is_view(array, view))
                self.assertTrue(np.array_equal(images.copied(view), array))

    def test_views_mean_what_numpy_means(self):
        for array in (self.on[::-1], self.on[::-2], self.on[10:200:3, 5:90], self.on[::-1, ::-1]):
            self.assertTrue(np.array_equal(images.copied(images.view(array)), array))

    def test_spot_in_strided_images(self):
        upside_down = ptzcal.detect_spot(self.on[::-1], self.off[::-1])
        self.assertClose(upside_down.centre, (CENTRE[0], 239 - CENTRE[1]), atol=0.1)
        cut = ptzcal.detect_spot(self.on[20:, 30:], self.off[20:, 30:])
        self.assertClose(cut.centre, (CENTRE[0] - 30, CENTRE[1] - 20), atol=0.1)
        mirrored = ptzcal.detect_spot(self.on[:, ::-1], self.off[:, ::-1])
        self.assertClose(mirrored.centre, (319 - CENTRE[0], CENTRE[1]), atol=0.1)

    def test_anything_array_like(self):
        self.assertFound(memoryview(self.on), self.off)

        class Picture:
            __array_interface__ = self.on.__array_interface__

        self.assertFound(Picture(), self.off)

    def test_read_only_memory(self):
        self.on.flags.writeable = False
        self.assertFound(self.on, self.off)

    def test_wrong_shapes_and_types(self):
        for wrong in (self.on[0], np.zeros((4, 5, 2), np.uint8), np.zeros((2, 4, 5, 3), np.uint8)):
            with self.assertRaisesRegex(ValueError, "on must be of shape"):
                ptzcal.detect_spot(wrong, self.off)
        for wrong in (self.on.astype(float), self.on.astype(np.int8), self.on > 3, "picture"):
            with self.assertRaisesRegex(TypeError, "uint8"):
                ptzcal.detect_spot(wrong, self.off)
        with self.assertRaisesRegex(ValueError, "gray8.*yuyv"):
            ptzcal.detect_spot(self.on, self.off, format="jpeg")
        with self.assertRaisesRegex(ValueError, r"\(h, w, 3\)"):
            ptzcal.detect_spot(self.on, self.off, format="bgr24")
        with self.assertRaisesRegex(ValueError, "3 h / 2"):
            ptzcal.detect_spot(self.on[:-1], self.off, format="nv12")
        with self.assertRaisesRegex(ValueError, "planes of i420"):
            ptzcal.detect_spot((self.on, self.on), self.off, format="i420")

    def test_what_the_library_refuses(self):
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.detect_spot(np.zeros((0, 0), np.uint8), None)
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.detect_spot(self.on, self.off[:-1])
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.detect_spot(as_format(self.on, "bgr24"), self.off)
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.detect_spot(np.zeros((5, 7, 2), np.uint8), None, format="yuyv")


if __name__ == "__main__":
    unittest.main()
