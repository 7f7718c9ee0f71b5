import tempfile
import unittest
from pathlib import Path

import numpy as np

import ptzcal
from support import TestCase


class Pictures(TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def test_what_is_written_is_read(self):
        image = np.arange(6 * 8 * 3, dtype=np.uint8).reshape(6, 8, 3)
        ptzcal.Picture(image).save(self.folder / "picture.png")
        self.assertTrue((ptzcal.read_image(self.folder / "picture.png") == image).all())
        # Arrays are bgr24, pictures rgb24.
        self.assertTrue((ptzcal.Picture(image).image == image[..., ::-1]).all())

    def test_marks(self):
        picture = ptzcal.Picture(np.full((40, 60), 100, np.uint8))
        picture.dim(0.5)
        self.assertEqual(picture.image[5, 5].tolist(), [50, 50, 50])
        picture.draw_lines([[5, 10, 50, 10]], 0xFF8000, width=3.0)
        self.assertEqual(picture.image[10, 30].tolist(), [255, 128, 0])
        picture.draw_circles([[30, 25]], 0x0000FF, radius=6.0, width=2.0)
        self.assertEqual(picture.image[25, 36].tolist(), [0, 0, 255])
        before = picture.image
        corners = np.array([[5.0, 30], [15, 30], [np.nan, np.nan], [15, 36]])
        picture.draw_board(corners, 2)
        picture.draw_residuals([[40, 30], [50, 30]], [[0.1, 0.1], [np.inf, np.nan]], [True, False])
        self.assertTrue((picture.image != before).any())
        both = ptzcal.Picture.beside(before, before)
        self.assertEqual(both.image.shape, (40, 120, 3))
        both.draw_matches([[5, 5]], [[9, 9]], [True], offset=60)
        self.assertTrue((both.image[:, 50:] != ptzcal.Picture.beside(before, before).image[:, 50:]).any())

    def test_what_is_refused(self):
        picture = ptzcal.Picture(np.zeros((4, 4), np.uint8))
        with self.assertRaises(ptzcal.InvalidArgument):
            picture.dim(2.0)
        with self.assertRaises(ptzcal.InvalidArgument):
            picture.draw_lines([[0, 0, 1, 1]], 0x1000000)
        with self.assertRaises(ValueError):
            picture.draw_board(np.zeros((5, 2)), 2)
        with self.assertRaises(ValueError):
            picture.draw_matches([[0, 0]], [[0, 0]], [True, False], offset=4)
        with self.assertRaises(ptzcal.Error) as caught:
            ptzcal.Picture.read(self.folder / "nowhere.png")
        self.assertEqual(caught.exception.status, ptzcal.Status.FILE_IO)
        (self.folder / "text.png").write_text("no picture")
        with self.assertRaises(ptzcal.Error) as caught:
            ptzcal.read_image(self.folder / "text.png")
        self.assertEqual(caught.exception.status, ptzcal.Status.FILE_FORMAT)

    def test_depths(self):
        depth = ptzcal.DepthMap(np.array([[1000, 0, 2000]], np.uint16), 0.001)
        self.assertEqual((depth.size, depth.known), ((3, 1), 2))
        depth = ptzcal.DepthMap([[1.0, np.nan], [-1.0, 2.5]])
        self.assertEqual((depth.size, depth.known), ((2, 2), 2))
        (self.folder / "depth.pgm").write_bytes(b"P5\n2 1\n65535\n\x03\xe8\x00\x00")
        depth = ptzcal.DepthMap.read(self.folder / "depth.pgm")
        self.assertEqual((depth.size, depth.known), ((2, 1), 1))
        with self.assertRaises(ValueError):
            ptzcal.DepthMap(np.zeros(5))
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.DepthMap(np.ones((2, 2)), 0.0)


if __name__ == "__main__":
    unittest.main()
