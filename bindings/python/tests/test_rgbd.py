import unittest

import numpy as np

import ptzcal
from support import TestCase

WIDTH, HEIGHT = 320, 240
#: Left, right, top, bottom, depth, metres; the nearest first: boxes before a wall.
LAYERS = (
    (-0.7, -0.2, -0.6, 0.1, 1.4),
    (0.1, 0.6, 0.0, 0.6, 1.6),
    (-0.1, 0.7, -0.8, -0.25, 2.0),
    (-1.0, -0.35, 0.2, 0.8, 2.3),
    (0.7, 1.4, -0.5, 0.7, 2.6),
    (-9, 9, -9, 9, 3.2),
)


def texture(layer, x, y):
    """Smooth between random corners of cells of 4 cm."""
    corners = np.random.default_rng(layer).uniform(0, 230, (512, 512))
    u, v = x / 0.04, y / 0.04
    i, j = np.floor(u).astype(int), np.floor(v).astype(int)
    s, t = u - i, v - j
    s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
    at = lambda i, j: corners[i % 512, j % 512]
    top = at(i, j) * (1 - s) + at(i + 1, j) * s
    return top * (1 - t) + (at(i, j + 1) * (1 - s) + at(i + 1, j + 1) * s) * t


def paint(f, centre, seed):
    """What a camera sees that looks along z, and the depths."""
    u, v = np.meshgrid(np.arange(WIDTH) - 159.5, np.arange(HEIGHT) - 119.5)
    level, depth = np.zeros(u.shape), np.zeros(u.shape)
    for number, (left, right, top, bottom, z) in enumerate(LAYERS):
        d = z - centre[2]
        x, y = centre[0] + u / f * d, centre[1] + v / f * d
        here = (depth == 0) & (x >= left) & (x <= right) & (y >= top) & (y <= bottom)
        level[here], depth[here] = texture(number, x[here], y[here]), d
    level += np.random.default_rng(seed).normal(12, 1, level.shape)
    return np.clip(np.rint(level), 0, 255).astype(np.uint8), depth


def auxiliary():
    return ptzcal.Camera(WIDTH, HEIGHT, 300.0, 300.0, 159.5, 119.5)


class RgbdCalibration(TestCase):
    def test_a_camera_is_found(self):
        centre = np.array([0.15, -0.05, 0.1])
        colour, depth = paint(300.0, (0, 0, 0), 1)
        rgbd = ptzcal.Rgbd(paint(340.0, centre, 2)[0])
        counts = rgbd.add_view(colour, ptzcal.DepthMap(depth), auxiliary())
        self.assertGreater(counts.pairs, 60)
        self.assertLessEqual(counts.pairs, counts.matches)
        found = rgbd.calibrate()
        self.assertClose(found.camera.centre, centre, atol=0.02)
        self.assertClose([found.camera.fx, found.camera.fy], 340.0, atol=3.4)
        pairs, lines = rgbd.pairs, rgbd.line_pairs
        self.assertEqual(len(pairs) + len(lines), found.measurements)
        self.assertEqual(lines.direction.shape, (len(lines), 3))
        self.assertEqual(pairs.xyz.shape, (len(pairs), 3))
        self.assertTrue((pairs.view == 0).all())
        off = found.camera.project(pairs.xyz) - pairs.fixed
        self.assertClose(off, -found.residuals[: len(pairs)], atol=1e-9)

    def test_nothing_in_common(self):
        colour, depth = paint(300.0, (0, 0, 0), 1)
        rgbd = ptzcal.Rgbd(np.full((HEIGHT, WIDTH), 90, np.uint8))
        with self.assertRaises(ptzcal.Error) as caught:
            rgbd.pairs
        self.assertEqual(caught.exception.status, ptzcal.Status.BAD_STATE)
        counts = rgbd.add_view(colour, ptzcal.DepthMap(depth), auxiliary())
        self.assertEqual(counts.pairs, 0)
        with self.assertRaises(ptzcal.Error) as caught:
            rgbd.calibrate()
        self.assertEqual(caught.exception.status, ptzcal.Status.TOO_FEW_POINTS)
        self.assertIn("0 features in the fixed camera's image", caught.exception.message)
        self.assertTrue(caught.exception.hint)

    def test_what_does_not_fit(self):
        colour, depth = paint(300.0, (0, 0, 0), 1)
        rgbd = ptzcal.Rgbd(colour)
        with self.assertRaises(ptzcal.InvalidArgument):
            rgbd.add_view(colour, ptzcal.DepthMap(depth[:-1]), auxiliary())
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.Rgbd(colour, min_pairs=2)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.Rgbd(colour, max_ratio=0.0)


if __name__ == "__main__":
    unittest.main()
