import os
import tempfile
import unittest

import numpy as np

import ptzcal
from support import TestCase, rig_model
from test_boards import BOARD, poses, see

SIZE = (720, 576)


def added(calibration, zoom, model, noise=0.2, seed=3, spots=True):
    """Adds the views of test_boards at a zoom."""
    rng = np.random.default_rng(seed)
    o = np.array([model.laser_x0, model.laser_y0, 0])
    v = np.array([model.laser_vx, model.laser_vy, 1])
    for R, t in poses():
        uv = see(model, BOARD @ R[:, :2].T + t) + rng.normal(0, noise, BOARD.shape)
        hit = o + v * (R[:, 2] @ (t - o)) / (R[:, 2] @ v)
        spot = see(model, hit[None])[0] + rng.normal(0, noise, 2)
        calibration.add_corners(zoom, SIZE, BOARD, uv, spot=spot if spots else None)


def calibrated():
    calibration = ptzcal.RigCalibration(8, 6, 0.06, aspect_sigma=np.inf)
    for seed, (zoom, scale) in enumerate([(1.0, 1.0), (2.0, 2.0), (3.0, 4.0)]):
        model = rig_model(fx=800 * scale, fy=805 * scale)
        added(calibration, zoom, model, seed=seed)
    return calibration.solve()


class Rigs(TestCase):
    @classmethod
    def setUpClass(cls):
        cls.answer = calibrated()

    def test_positions(self):
        self.assertEqual([p.zoom for p in self.answer.positions], [1, 2, 3])
        for index, p in enumerate(self.answer.positions):
            self.assertEqual((p.status, p.laser_status), (ptzcal.Status.OK, ptzcal.Status.OK))
            self.assertEqual((p.reason, p.laser_reason, p.has_model), ("", "", True))
            self.assertEqual((p.views, p.views_used), (8, 8))
            self.assertLess(p.rms, 0.4)
            model, covariance = self.answer.rig(index)
            truth = rig_model()
            sigma = np.sqrt(covariance.diagonal())
            off = np.abs(
                [
                    model.laser_x0 - truth.laser_x0,
                    model.laser_y0 - truth.laser_y0,
                    model.laser_vx - truth.laser_vx,
                    model.laser_vy - truth.laser_vy,
                    np.log(model.fx / (800 * 2**index)),
                    model.cx - truth.cx,
                    model.cy - truth.cy,
                ]
            )
            self.assertTrue((off < 4.5 * sigma).all(), (index, off / sigma))
            self.assertLess(covariance[0, 0], self.answer.laser(index).covariance[0, 0])
            self.assertEqual(len(self.answer.boards(index).views), 8)
        line = self.answer.common_line
        self.assertTrue(line.agrees)
        self.assertEqual((line.positions, line.degrees_of_freedom, line.odd_zoom), (3, 8, None))
        self.assertEqual(line.covariance.shape, (4, 4))
        with self.fails("INVALID_ARGUMENT"):
            self.answer.rig(3)

    def test_views(self):
        self.assertEqual(len(self.answer.views), 24)
        view = self.answer.views[9]
        self.assertEqual((view.zoom, view.status, view.reason), (2.0, ptzcal.Status.OK, ""))
        self.assertEqual(view.corners.shape, (48, 2))
        self.assertClose(view.board_xy, BOARD)
        self.assertLess(np.abs(view.residuals[view.inliers]).max(), 1.5)
        R, t = list(poses())[1]
        self.assertClose(view.R, R, atol=0.03)
        self.assertClose(view.t, t, atol=0.05)
        self.assertLess(np.abs(view.spot_residual).max(), 1.5)

    def test_the_curve(self):
        curve = self.answer.curve
        self.assertEqual(curve.range, (1.0, 3.0))
        focal = [curve.at(z).model.fx for z in np.linspace(1, 3, 21)]
        self.assertTrue((np.diff(focal) > 0).all())
        # Exponential here, so that the logarithm is straight.
        model, covariance = curve.at(1.5)
        self.assertLess(abs(np.log(model.fx / (800 * 2**0.5))), 4.5 * covariance[4, 4] ** 0.5)
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "zoom.json")
            curve.save(file)
            again = ptzcal.ZoomCurve.load(file)
            self.assertEqual(again.at(2.2).model, curve.at(2.2).model)
            self.assertClose(again.at(2.2).covariance, curve.at(2.2).covariance, atol=0)
            with self.fails("FILE_IO"):
                ptzcal.ZoomCurve.load(os.path.join(folder, "none"))
        for zoom in (0.99, 3.01):
            with self.fails("INVALID_ARGUMENT"):
                curve.at(zoom)
        with self.fails("NOT_FINITE"):
            curve.at(np.nan)

    def test_what_is_not_found_costs_nothing_else(self):
        calibration = ptzcal.RigCalibration(8, 6, 0.06)
        added(calibration, 1.0, rig_model(), spots=False)
        grey = np.full((576, 720), 90, np.uint8)
        self.assertEqual(calibration.add_images(1.0, grey, grey), 8)
        self.assertEqual(calibration.add_images(2.0, np.stack([grey] * 3, -1)), 9)
        calibration.set_common_line(False)
        answer = calibration.solve()
        self.assertEqual(answer.views[8].status, ptzcal.Status.NOT_FOUND)
        self.assertIn("no chessboard", answer.views[8].reason)
        self.assertIsNone(answer.views[8].R)
        first, second = answer.positions
        self.assertEqual((first.status, first.laser_status), (0, ptzcal.Status.TOO_FEW_POINTS))
        self.assertEqual((second.status, second.views, second.views_used), (ptzcal.Status.NOT_FOUND, 1, 0))
        self.assertIn("no view", second.reason)
        self.assertLess(abs(answer.boards(0).camera.fx - 800), 20)
        with self.fails("TOO_FEW_POINTS"):
            answer.rig(0)
        with self.fails("TOO_FEW_POINTS"):
            answer.laser(0)
        with self.fails("NOT_FOUND"):
            answer.common_line
        with self.fails("TOO_FEW_POINTS"):
            answer.curve

    def test_bad_arguments(self):
        for board in [(2, 6, 0.03), (9, 129, 0.03), (9, 6, 0.0)]:
            with self.fails("INVALID_ARGUMENT"):
                ptzcal.RigCalibration(*board)
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.RigCalibration(9, 6, 0.03, lens=rig_model().head_camera(0, 0))
        calibration = ptzcal.RigCalibration(9, 6, 0.03, spot=ptzcal.SpotOptions(colour="red"))
        with self.fails("TOO_FEW_POINTS"):
            calibration.solve()
        with self.fails("INVALID_ARGUMENT"):
            calibration.set_board(9, 6, -1.0)
        with self.fails("INVALID_ARGUMENT"):
            calibration.set_common_line(True, -0.1)
        grey = np.zeros((48, 64), np.uint8)
        with self.fails("NOT_FINITE"):
            calibration.add_images(np.inf, grey)
        with self.fails("INVALID_ARGUMENT"):
            calibration.add_images(0.0, grey, grey[:-1])
        with self.fails("INVALID_ARGUMENT"):
            calibration.set_spot(0, (1, 2))
        with self.assertRaises(ValueError):
            calibration.add_corners(0.0, SIZE, BOARD, BOARD[:3])
        with self.assertRaises(TypeError):
            calibration.add_images(0.0, grey.astype(float))


if __name__ == "__main__":
    unittest.main()
