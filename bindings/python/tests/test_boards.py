import unittest

import numpy as np

import ptzcal
from support import TestCase, rig_model, rotation

BOARD = np.stack(np.meshgrid(np.arange(8) - 3.5, np.arange(6) - 2.5), -1).reshape(-1, 2) * 0.06
TILTS = [(0.5, 0.1), (-0.4, 0.3), (0.1, -0.5), (0.6, 0.5), (-0.2, -0.4), (0.3, 0.6), (0, -0.3), (-0.6, 0)]


def poses(nearest=1.0, farthest=3.0):
    for i, (rx, ry) in enumerate(TILTS):
        z = nearest + (farthest - nearest) * i / (len(TILTS) - 1)
        yield rotation(rx, ry, 0.1 * i), np.array([0.1 * (i % 3 - 1) * z, 0.08 * (i % 2 - 0.5) * z, z])


def see(model, points):
    """Pinhole pixels of points of the camera's frame."""
    x, y, z = points.T
    return np.c_[model.fx * x / z + model.cx, model.fy * y / z + model.cy]


def views(model, noise=0.2, spots=True, seed=3, **distances):
    rng = np.random.default_rng(seed)
    boards = ptzcal.Boards(model.width, model.height)
    o, v = np.array([model.laser_x0, model.laser_y0, 0]), np.array([model.laser_vx, model.laser_vy, 1])
    for R, t in poses(**distances):
        uv = see(model, BOARD @ R[:, :2].T + t) + rng.normal(0, noise, BOARD.shape)
        n = R[:, 2]
        hit = o + v * (n @ (t - o)) / (n @ v)
        spot = see(model, hit[None])[0] + rng.normal(0, noise, 2)
        boards.add_view(BOARD, uv, spot=spot if spots else None)
    return boards


class FromBoards(TestCase):
    def test_a_camera(self):
        model = rig_model()
        boards = views(model)
        self.assertEqual(len(boards), len(TILTS))
        result = ptzcal.calibrate_from_boards(boards, aspect_sigma=np.inf)
        c = result.calibration
        found = [c.camera.fx, c.camera.fy, c.camera.cx, c.camera.cy]
        sigma = c.standard_deviations[[0, 1, 3, 4]]
        self.assertTrue((np.abs(np.subtract(found, [800, 805, 360, 288])) < 4.5 * sigma).all(), (found, sigma))
        self.assertEqual(c.measurements, len(TILTS) * len(BOARD))
        self.assertEqual(c.residuals.shape, (c.measurements, 2))
        self.assertIs(result.camera, c.camera)
        for view, (R, t) in zip(result.views, poses()):
            self.assertTrue(view.used)
            self.assertEqual(view.corners, len(BOARD))
            self.assertClose(view.R, R, atol=0.02)
            self.assertClose(view.t, t, atol=0.03)
            self.assertClose(view.covariance, view.covariance.T, atol=1e-12)
            self.assertLess(view.rms, 0.4)
        self.assertClose(result.bending, np.zeros(3))
        self.assertTrue(all(isinstance(line, str) for line in result.advice))

    def test_a_known_lens_gives_poses_alone(self):
        model = rig_model()
        lens = model.head_camera(0, 0)
        result = ptzcal.calibrate_from_boards(views(model), lens=lens)
        self.assertEqual(result.camera.fx, 800)
        self.assertEqual(result.calibration.covariance[0, 0], 0)

    def test_bad_views(self):
        boards = ptzcal.Boards(720, 576)
        uv = BOARD * 800 + [360, 288]
        with self.fails("TOO_FEW_POINTS"):
            boards.add_view(BOARD[:3], uv[:3])
        with self.fails("DEGENERATE"):
            boards.add_view(BOARD[:8], uv[:8])
        bad = uv.copy()
        bad[5, 1] = np.nan
        with self.fails("NOT_FINITE", 5):
            boards.add_view(BOARD, bad)
        with self.assertRaises(ValueError):
            boards.add_view(BOARD, uv[:4])
        with self.assertRaises(ValueError):
            boards.add_view(BOARD, uv, spot=[1, 2, 3])
        with self.fails("INVALID_ARGUMENT"):
            boards.set_spot(0, [1, 2])
        with self.fails("INVALID_ARGUMENT"):
            boards.set_bending(-1)
        self.assertEqual(len(boards), 0)
        with self.fails("TOO_FEW_POINTS"):
            ptzcal.calibrate_from_boards(boards)
        boards.add_view(BOARD, uv, uv_covariance=np.eye(2))
        with self.fails("DEGENERATE") as failure:
            ptzcal.calibrate_from_boards(boards)
        self.assertIn("tilted", failure.error.hint)
        with self.assertRaises(TypeError):
            ptzcal.calibrate_from_boards(boards, colour="red")


class LaserLine(TestCase):
    def assertIs_within(self, laser, model):
        truth = [model.laser_x0, model.laser_y0, model.laser_vx, model.laser_vy]
        sigma = np.sqrt(np.diagonal(laser.covariance)[:4])
        self.assertTrue((np.abs(laser.line - truth) < 4.5 * sigma).all(), (laser.line - truth, sigma))

    def test_with_every_kind_of_lens(self):
        model = rig_model()
        boards = views(model)
        alone = ptzcal.calibrate_laser_line(boards, aspect_sigma=np.inf)
        other = ptzcal.calibrate_from_boards(views(model, seed=5, nearest=0.7), aspect_sigma=np.inf)
        measured = ptzcal.calibrate_laser_line(boards, lens=other.calibration)
        exact = ptzcal.calibrate_laser_line(boards, lens=model.head_camera(0, 0))
        for laser in (alone, measured, exact):
            self.assertIs_within(laser, model)
            self.assertEqual(laser.covariance.shape, (7, 7))
            self.assertEqual(laser.residuals.shape, (len(TILTS), 2))
            self.assertGreaterEqual(laser.inliers.sum(), 7)
            self.assertEqual(laser.rig_model.laser_x0, laser.line[0])
            self.assertEqual(len(laser.boards.views), len(TILTS))
        variances = [laser.covariance[0, 0] for laser in (exact, measured, alone)]
        self.assertEqual(variances, sorted(variances))
        self.assertEqual(exact.covariance[4, 4], 0)
        self.assertNotEqual(alone.covariance[0, 4], 0)

    def test_a_wrong_spot_is_named(self):
        model = rig_model()
        boards = views(model)
        boards.set_spot(4, [500, 100], uv_covariance=[0.04, 0, 0.04])
        laser = ptzcal.calibrate_laser_line(boards, lens=model.head_camera(0, 0))
        self.assertFalse(laser.inliers[4])
        self.assertGreater(np.linalg.norm(laser.residuals[4]), 50)
        self.assertIs_within(laser, model)

    def test_refusals(self):
        model = rig_model()
        lens = model.head_camera(0, 0)
        with self.fails("TOO_FEW_POINTS"):
            ptzcal.calibrate_laser_line(views(model, spots=False), lens=lens)
        with self.fails("DEGENERATE"):
            centred = rig_model(laser_x0=0.0, laser_y0=0.0)
            ptzcal.calibrate_laser_line(views(centred, noise=0.05), lens=lens)


if __name__ == "__main__":
    unittest.main()
