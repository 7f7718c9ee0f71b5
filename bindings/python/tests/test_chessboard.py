import unittest

import numpy as np

import ptzcal
from support import TestCase

SQUARE, LEFT, TOP = 20.0, 41.3, 33.8


def picture(columns=8, rows=5, width=320, height=240, seed=1):
    """A board of columns x rows inner corners, anti-aliased, with noise; and its corners."""
    fine = (np.arange(4 * width) - 1.5) / 4, (np.arange(4 * height) - 1.5) / 4
    a, b = (np.floor((f - o) / SQUARE) for f, o in zip(fine, (LEFT, TOP)))
    dark = (a[None, :] + b[:, None]) % 2 == 0
    dark &= ((a >= 0) & (a <= columns))[None, :] & ((b >= 0) & (b <= rows))[:, None]
    level = np.where(dark, 40.0, 210.0).reshape(height, 4, width, 4).mean(axis=(1, 3))
    # A blur of one binomial.
    level = np.pad(level, 1, mode="edge")
    level = (level[:-2] + 2 * level[1:-1] + level[2:]) / 4
    level = (level[:, :-2] + 2 * level[:, 1:-1] + level[:, 2:]) / 4
    noise = np.random.default_rng(seed).normal(0, 2, level.shape)
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    truth = np.c_[LEFT + SQUARE * (i.ravel() + 1), TOP + SQUARE * (j.ravel() + 1)]
    return np.clip(np.rint(level + noise), 0, 255).astype(np.uint8), truth


class Chessboards(TestCase):
    def test_a_board(self):
        image, truth = picture()
        board = ptzcal.detect_chessboard(image, (8, 5))
        self.assertEqual((board.columns, board.rows), (8, 5))
        self.assertTrue(board.found.all())
        # Samples at quarters of a pixel put the edges there.
        self.assertClose(board.corners, truth, atol=0.15)
        self.assertEqual(board.covariance.shape, (40, 2, 2))
        self.assertTrue((np.linalg.eigvalsh(board.covariance) > 0).all())
        self.assertGreater(board.blur, 0.4)

    def test_of_any_size_and_in_colour(self):
        image, truth = picture()
        board = ptzcal.detect_chessboard(np.repeat(image[..., None], 3, axis=2))
        self.assertEqual((board.columns, board.rows), (8, 5))
        self.assertClose(board.corners, truth, atol=0.15)

    def test_a_hidden_corner_is_nan(self):
        image, _ = picture()
        image[70:80, 78:86] = 120
        board = ptzcal.detect_chessboard(image, (8, 5))
        self.assertFalse(board.found.all())
        self.assertTrue(np.isnan(board.corners[~board.found]).all())
        self.assertTrue(np.isfinite(board.covariance[board.found]).all())
        with self.assertRaises(ptzcal.ChessboardNotFound):
            ptzcal.detect_chessboard(image, (8, 5), min_found=1.0)

    def test_another_size(self):
        image, _ = picture()
        with self.assertRaises(ptzcal.ChessboardNotFound) as caught:
            ptzcal.detect_chessboard(image, (7, 5))
        self.assertEqual(caught.exception.status, ptzcal.Status.NOT_FOUND)
        self.assertIn("8 x 5", caught.exception.message)
        self.assertTrue(caught.exception.hint)

    def test_two_boards(self):
        image, _ = picture()
        with self.assertRaises(ptzcal.ChessboardAmbiguous):
            ptzcal.detect_chessboard(np.hstack([image, image]), (8, 5))

    def test_impossible_sizes(self):
        image, _ = picture()
        for size in ((2, 5), (0, 5), (129, 5)):
            with self.subTest(size=size), self.assertRaises(ptzcal.InvalidArgument):
                ptzcal.detect_chessboard(image, size)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.detect_chessboard(image, (8, 5), min_found=1.5)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.detect_chessboard(image[:12, :12])
        with self.assertRaises(ValueError):
            ptzcal.detect_chessboard(image, (-1, 5))
        with self.assertRaises(TypeError):
            ptzcal.detect_chessboard(image.astype(float), (8, 5))


if __name__ == "__main__":
    unittest.main()
