import math
import unittest

import numpy as np

import ptzcal
from support import TestCase

CENTRE, HALF, TURN = np.array([118.3, 91.7]), np.array([70.0, 45.0]), 0.25

_cdf = np.vectorize(lambda z: 0.5 * math.erfc(-z / math.sqrt(2)))


def rectangle(width=240, height=180):
    """A bright turned rectangle, blurred by 0.9 pixels, with noise."""
    x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    u, v = _place(np.stack([x, y], axis=-1))
    s = math.sqrt(0.81 + 1 / 12)
    level = np.ones_like(u)
    for at, half in ((u, HALF[0]), (v, HALF[1])):
        level *= _cdf((at + half) / s) - _cdf((at - half) / s)
    noise = np.random.default_rng(1).normal(0, 2, level.shape)
    return np.clip(np.rint(60 + 110 * level + noise), 0, 255).astype(np.uint8)


def _place(points):
    """Along and across the rectangle."""
    x, y = np.moveaxis(points - CENTRE, -1, 0)
    return np.cos(TURN) * x + np.sin(TURN) * y, np.cos(TURN) * y - np.sin(TURN) * x


def _off(points):
    u, v = _place(points)
    return np.minimum(abs(abs(u) - HALF[0]), abs(abs(v) - HALF[1]))


def camera():
    K = np.array([[845.0, 0, 410], [0, 845, 290], [0, 0, 1]])
    return ptzcal.Camera.from_matrix(K, (800, 600), (), np.eye(3), (0.1, 0, 0))


class Lines(TestCase):
    def test_the_sides_of_a_rectangle(self):
        segments = ptzcal.detect_line_segments(rectangle())
        self.assertEqual(len(segments), 4)
        sigma = np.sqrt(segments.uv_covariance[:, :, 0, 0])
        self.assertLess((_off(segments.uv) / sigma).max(), 5)
        self.assertLess(sigma.max(), 0.05)
        self.assertTrue((abs(segments.contrast - 110) < 6).all())
        self.assertTrue((abs(segments.blur - 0.94) < 0.2).all())
        along, to = segments.ends[:, 1] - segments.ends[:, 0], CENTRE - segments.ends[:, 0]
        self.assertTrue((along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0] > 0).all())
        self.assertEqual(len(ptzcal.detect_line_segments(rectangle(), max_segments=3)), 3)
        self.assertEqual(len(ptzcal.detect_line_segments(rectangle(), min_contrast=200)), 0)

    def test_edges_are_on_the_rectangle(self):
        places, normals, gradients = ptzcal.detect_edges(rectangle(), 8, 16)
        self.assertTrue(350 < len(places) < 600)
        self.assertLess(np.median(_off(places)), 0.1)
        self.assertTrue(np.allclose(np.hypot(*normals.T), 1) and (gradients >= 8).all())
        # More than one guess of the number holds.
        noise = np.random.default_rng(2).integers(0, 255, (600, 800)).astype(np.uint8)
        self.assertGreater(len(ptzcal.detect_edges(noise, 0.5, 0.5)[0]), 1 << 16)

    def test_a_line_among_other_points(self):
        rng = np.random.default_rng(3)
        s = np.linspace(0, 2, 80)
        xyz = np.array([1, 2, 3]) + s[:, None] * [0.6, 0, 0.8] + rng.normal(0, 0.003, (80, 3))
        xyz[::4, 1] += 0.4
        xyz[5] = np.nan
        fit = ptzcal.fit_line_3d(xyz, sigma=0.003)
        self.assertTrue((fit.inliers[::4] == 0).all() and not fit.inliers[5])
        self.assertGreaterEqual(fit.inliers.sum(), 57)
        self.assertGreater(abs(fit.line[1] @ [0.6, 0, 0.8]), 1 - 1e-5)
        self.assertAlmostEqual(np.ptp(fit.extent), 2, delta=0.1)
        self.assertTrue(0.7 < fit.noise_factor < 1.3)
        each = np.tile(np.eye(3) * 0.003**2, (80, 1, 1))
        self.assertTrue(np.allclose(ptzcal.fit_line_3d(xyz, covariance=each).line, fit.line))

    def test_matches_calibrate_a_camera(self):
        truth, rng = camera(), np.random.default_rng(4)
        a, b = rng.uniform(-1, 1, (2, 300, 3)) * [1.2, 0.9, 1.2] + [0, 0, 3.5]
        ends = np.stack([truth.project(a), truth.project(b)], axis=1)
        seen = ((ends > 0) & (ends < [800, 600])).all(axis=(1, 2))
        seen &= np.hypot(*(ends[:, 1] - ends[:, 0]).T) > 80
        a, b, ends = a[seen][:40], b[seen][:40], ends[seen][:40]
        n = len(a)
        order = rng.permutation(n)
        noise = np.tile(np.eye(2) * 0.05**2, (n, 2, 1, 1))
        uv = (ends + rng.normal(0, 0.05, ends.shape))[order]
        segments = ptzcal.LineSegments(uv, noise, ends[order], np.ones(n), np.ones(n), np.ones(n))
        lines, extents = np.stack([a, b - a], axis=1), np.tile([0.0, 1.0], (n, 1))
        K = truth.K + [[3, 0, 1.5], [0, 3, 0], [0, 0, 0]]
        first = ptzcal.Camera.from_matrix(K, (800, 600), (), np.eye(3), (0.1, -0.004, 0))
        exact = np.zeros((n, 6, 6))
        matches = ptzcal.match_lines(lines, extents, first, segments, covariance=exact)
        self.assertGreater(len(matches), n / 2)
        self.assertTrue((order[matches.segment] == matches.line).all())
        self.assertEqual(matches.residual.shape, (len(matches), 2))
        points = ptzcal.Correspondences(800, 600)
        points.add_points(a[:10], ends[:10, 0])
        points.add_lines(
            lines[matches.line],
            segments.uv[matches.segment],
            directed=True,
            uv_covariance=segments.uv_covariance[matches.segment],
        )
        result = ptzcal.calibrate_camera(points)
        self.assertAlmostEqual(result.camera.fx, 845, delta=1)
        # Against the light.
        turned = np.stack([b, a - b], axis=1)
        self.assertEqual(len(ptzcal.match_lines(turned, extents, truth, segments)), 0)
        either = ptzcal.match_lines(turned, extents, truth, segments, same_polarity=False)
        self.assertGreater(len(either), n / 2)

    def test_segments_with_depths_are_lines_in_space(self):
        # The rectangle is a card, 2 m away, before a wall at 3 m.
        K = np.array([[260.0, 0, 119.5], [0, 260, 89.5], [0, 0, 1]])
        eye = ptzcal.Camera.from_matrix(K, (240, 180), (), np.eye(3), (0, 0, 0))
        x, y = np.meshgrid(np.arange(240.0), np.arange(180.0))
        u, v = _place(np.stack([x, y], axis=-1))
        depths = np.where((abs(u) < HALF[0]) & (abs(v) < HALF[1]), 2.0, 3.0)
        depths += np.random.default_rng(5).normal(0, 0.004, depths.shape)
        segments = ptzcal.detect_line_segments(rectangle())
        lines, covariance, extents, found = ptzcal.lift_line_segments(
            segments, eye, ptzcal.DepthMap(depths)
        )
        self.assertTrue(found.all())
        self.assertLess(abs(lines[:, 0, 2] - 2).max(), 0.01)
        ends = lines[:, None, 0] + extents[:, :, None] * lines[:, None, 1]
        seen = eye.project(ends.reshape(-1, 3)).reshape(-1, 2, 2)
        self.assertLess(abs(seen - segments.ends).max(), 0.05)
        self.assertEqual(len(ptzcal.match_lines(lines, extents, eye, segments)), 4)
        self.assertTrue((np.linalg.eigvalsh(covariance) > -1e-12).all())
        # Nothing is known on the wall's side.
        nothing = ptzcal.DepthMap(np.where(depths < 2.5, depths, 0.0))
        self.assertFalse(ptzcal.lift_line_segments(segments, eye, nothing)[3].any())
        for wrong in ({"depth_sigma": -1.0}, {"depth_sigma": 0.0, "inverse_depth_sigma": 0.0}):
            with self.subTest(wrong), self.assertRaises(ptzcal.InvalidArgument):
                ptzcal.lift_line_segments(segments, eye, ptzcal.DepthMap(depths), **wrong)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.lift_line_segments(segments, eye, ptzcal.DepthMap(depths[:, 1:]))

    def test_what_is_refused(self):
        image = rectangle()
        for wrong in (
            {"min_length": 5.0},
            {"min_contrast": float("nan")},
            {"max_gap": -1.0},
            {"max_segments": 0},
        ):
            with self.subTest(wrong), self.assertRaises(ptzcal.Error):
                ptzcal.detect_line_segments(image, **wrong)
        with self.assertRaises(ValueError):
            ptzcal.detect_line_segments(image, max_segments=-1)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.detect_edges(image, 10, 4)
        for wrong in ({"sigma": 0.0}, {"min_inliers": 2.0}, {"outlier_threshold": 0.0}):
            with self.subTest(wrong), self.assertRaises(ptzcal.InvalidArgument):
                ptzcal.fit_line_3d(np.random.default_rng(1).normal(size=(9, 3)), **wrong)
        with self.assertRaises(ptzcal.Error):
            ptzcal.fit_line_3d(np.full((9, 3), np.nan))
        with self.assertRaises(ptzcal.Error):
            ptzcal.fit_line_3d(np.ones((9, 3)))
        with self.assertRaises(ValueError):
            ptzcal.fit_line_3d(np.ones((9, 2)))
        segments = ptzcal.detect_line_segments(image)
        for wrong in ({"camera_sigma": 0.0}, {"min_overlap": 2.0}, {"min_lead": -1.0}):
            with self.subTest(wrong), self.assertRaises(ptzcal.InvalidArgument):
                ptzcal.match_lines(np.ones((1, 2, 3)), [[0, 1]], camera(), segments, **wrong)
        with self.assertRaises(ValueError):
            ptzcal.match_lines(np.ones((2, 2, 3)), [[0, 1]], camera(), segments)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.match_lines(np.zeros((1, 2, 3)), [[0, 1]], camera(), segments)


if __name__ == "__main__":
    unittest.main()
