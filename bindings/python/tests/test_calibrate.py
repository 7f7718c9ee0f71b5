import dataclasses
import json
import tempfile
import threading
import unittest
from pathlib import Path

import numpy as np

import ptzcal
from support import TestCase, camera, project, rig_model, room_points, shots

LENS = (-0.2, 0.06, 0.001, -0.0008, -0.01)


def visible(truth, n, noise=0.3, seed=7):
    """n points inside the image, and their noisy pixels."""
    xyz = room_points(20 * n, seed)
    uv = project(truth, xyz)
    inside = np.all((uv > 0) & (uv < truth.size), axis=1)
    xyz, uv = xyz[inside][:n], uv[inside][:n]
    assert len(xyz) == n
    return xyz, uv + np.random.default_rng(seed).normal(0, noise, uv.shape)


def measured(truth, n, noise=0.3, **settings):
    measurements = ptzcal.Correspondences(*truth.size)
    xyz, uv = visible(truth, n, noise)
    measurements.add_points(xyz, uv, **settings)
    return measurements


class Points(TestCase):
    def assertIs_within(self, calibration, truth, deviations=5):
        camera = calibration.camera
        error = np.r_[
            camera.fx - truth.fx,
            camera.fy - truth.fy,
            camera.skew - truth.skew,
            camera.cx - truth.cx,
            camera.cy - truth.cy,
            camera.centre - truth.centre,
        ]
        sigma = calibration.standard_deviations
        sigma = np.r_[sigma[:5], sigma[-3:]]
        self.assertTrue((np.abs(error) < deviations * sigma + 1e-9).all(), (error, sigma))

    def test_arrays_that_are_not_aligned_are_copied(self):
        """As they come out of messages and packed files."""
        raw = np.zeros(8 * 3 * 40 + 1, np.uint8)
        xyz = np.frombuffer(raw.data, np.float64, 3 * 40, offset=1).reshape(40, 3)
        self.assertFalse(xyz.flags.aligned)
        points = ptzcal.Correspondences(640, 480)
        points.add_points(xyz, np.zeros((40, 2)))
        self.assertEqual(len(points), 40)

    def test_a_camera(self):
        truth = camera()
        result = ptzcal.calibrate_camera(measured(truth, 400))
        self.assertIs_within(result, truth)
        self.assertClose(result.rms, 0.3 * np.sqrt(2), atol=0.05)
        self.assertEqual(result.parameters[:5], ("fx", "fy", "skew", "cx", "cy"))
        self.assertEqual(result.parameters[-3:], ("X", "Y", "Z"))
        self.assertEqual(result.covariance.shape, (11, 11))
        self.assertClose(result.covariance, result.covariance.T)
        self.assertEqual(result.residuals.shape, (400, 2))
        self.assertEqual(result.inliers.dtype, bool)
        self.assertEqual(result.inliers.sum(), result.inlier_count)
        self.assertEqual(result.measurements, 400)
        self.assertGreater(result.condition, 1)
        self.assertGreater(result.iterations, 0)
        self.assertIn("of 400 used", repr(result))

    def test_residuals_are_measured_minus_predicted(self):
        truth = camera()
        xyz, uv = visible(truth, 100)
        measurements = ptzcal.Correspondences(*truth.size)
        measurements.add_points(xyz, uv)
        result = ptzcal.calibrate_camera(measurements)
        self.assertClose(result.residuals, uv - result.camera.project(xyz), atol=1e-9)

    def test_lenses(self):
        truth = camera(LENS)
        names = {"radial1": 16, "radial2": 16, "brown_conrady": 16, "division": 12, "fisheye": 15}
        for model, parameters in names.items():
            with self.subTest(model):
                result = ptzcal.calibrate_camera(measured(truth, 800), distortion=model)
                self.assertEqual(len(result.parameters), parameters)
                self.assertEqual(result.covariance.shape, (parameters, parameters))
        result = ptzcal.calibrate_camera(measured(truth, 800), distortion="brown_conrady")
        self.assertIs_within(result, truth)
        k1, sigma = result.camera.distortion[0], result.standard_deviations[5]
        self.assertLess(abs(k1 - LENS[0]), 5 * sigma)

    def test_a_lens_that_was_left_out_is_named(self):
        for lens, kept in ((LENS, "none"), (LENS, "brown_conrady")):
            truth = camera(lens)
            result = ptzcal.calibrate_camera(measured(truth, 400), distortion=kept, pixel_sigma=0.3)
            fits = kept != "none"
            self.assertEqual(result.probability > 1e-3, fits, result.warnings)
            self.assertEqual(not result.warnings, fits)
            if not fits:
                self.assertIn("lens distortion", result.warnings[-1])
            self.assertGreater(result.degrees_of_freedom, 600)
            self.assertTrue(result.weakest.startswith("weakest: camera "), result.weakest)

    def test_linear_methods(self):
        lens = dict(distortion_model="division", distortion=[-0.2])
        truth = dataclasses.replace(camera(), **lens)
        xyz, _ = visible(camera(), 400)
        uv = truth.project(xyz) + np.random.default_rng(3).normal(0, 0.2, (400, 2))
        measurements = ptzcal.Correspondences(*truth.size)
        measurements.add_points(xyz, uv)
        for method, within in ((ptzcal.radial_alignment, 0.01), (ptzcal.division_eigenproblem, 0.05)):
            with self.subTest(method.__name__):
                found = method(measurements, (truth.cx, truth.cy))
                self.assertIs(found.distortion_model, ptzcal.DistortionModel.DIVISION)
                self.assertLess(abs(found.distortion[0] + 0.2), within)
                self.assertClose(found.centre, truth.centre, atol=0.05)
                self.assertEqual(method(measurements).size, truth.size)
                with self.assertRaises(ptzcal.Error) as caught:
                    method(ptzcal.Correspondences(800, 600))
                self.assertIs(caught.exception.status, ptzcal.Status.TOO_FEW_POINTS)
                with self.assertRaises(ValueError):
                    method(measurements, (1.0, 2.0, 3.0))

    def test_known_lens(self):
        truth = camera(LENS)
        result = ptzcal.calibrate_camera(measured(truth, 60), lens=truth)
        self.assertEqual(result.camera.fx, truth.fx)
        self.assertEqual(result.camera.distortion, truth.distortion)
        self.assertClose(result.camera.centre, truth.centre, atol=0.01)
        self.assertClose(result.standard_deviations[:10], 0)

    def test_outliers(self):
        truth = camera()
        xyz, uv = visible(truth, 300)
        wrong = np.random.default_rng(1).permutation(300)[:90]
        uv[wrong] = np.random.default_rng(2).uniform((0, 0), truth.size, (90, 2))
        measurements = ptzcal.Correspondences(*truth.size)
        measurements.add_points(xyz, uv)
        result = ptzcal.calibrate_camera(measurements)
        self.assertIs_within(result, truth, 6)
        self.assertGreaterEqual((~result.inliers[wrong]).sum(), 85)
        again = ptzcal.calibrate_camera(measurements)
        self.assertTrue(np.array_equal(again.covariance, result.covariance))
        other = ptzcal.calibrate_camera(measurements, seed=2**64 - 1)
        self.assertClose(other.camera.fx, result.camera.fx, rtol=1e-3)

    def test_without_search_for_outliers(self):
        truth = camera()
        xyz, uv = visible(truth, 300)
        uv[5] += 30
        measurements = ptzcal.Correspondences(*truth.size)
        measurements.add_points(xyz, uv)
        everything = ptzcal.calibrate_camera(measurements, robust=False)
        self.assertEqual(everything.inlier_count, 300)
        self.assertGreater(np.linalg.norm(everything.residuals[5]), 30)
        self.assertEqual(ptzcal.calibrate_camera(measurements, robust=True).inliers[5], False)

    def test_covariances(self):
        truth = camera()
        n = 200
        plain = ptzcal.calibrate_camera(measured(truth, n), pixel_sigma=0.3).covariance
        forms = [
            0.09 * np.eye(2),
            np.tile(0.09 * np.eye(2), (n, 1, 1)),
            np.tile([0.09, 0.0, 0.09], (n, 1)),
        ]
        for form in forms:
            result = ptzcal.calibrate_camera(measured(truth, n, uv_covariance=form))
            self.assertClose(result.covariance, plain, rtol=1e-6, atol=1e-15)
        for form in (
            1e-4 * np.eye(3),
            np.tile(1e-4 * np.eye(3), (n, 1, 1)),
            np.tile(1e-4 * np.eye(3).ravel(), (n, 1)),
        ):
            result = ptzcal.calibrate_camera(
                measured(truth, n, uv_covariance=forms[0], xyz_covariance=form)
            )
            self.assertGreater(result.covariance[0, 0], 2 * plain[0, 0])

    def test_priors(self):
        truth = camera()
        square = ptzcal.calibrate_camera(measured(truth, 200), aspect_sigma=0, skew_sigma=0)
        self.assertEqual(square.camera.skew, 0)
        self.assertClose(square.camera.fx, square.camera.fy)
        free = ptzcal.calibrate_camera(measured(truth, 200), aspect_sigma=np.inf, skew_sigma=np.inf)
        self.assertIs_within(free, truth)

    def test_count(self):
        measurements = ptzcal.Correspondences(800, 600)
        self.assertEqual(len(measurements), 0)
        measurements.add_points([], [])
        measurements.add_points(np.ones((3, 3)), np.ones((3, 2)))
        measurements.add_points(np.ones((2, 3)), np.ones((2, 2)), uv_covariance=np.eye(2))
        self.assertEqual(len(measurements), 5)

    def test_file(self):
        result = ptzcal.calibrate_camera(measured(camera(), 50))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "calibration.json")
            result.save(path)
            loaded = ptzcal.Camera.load(path)
            written = json.loads(path.read_text())
        self.assertTrue(np.array_equal(loaded.K, result.camera.K))
        self.assertTrue(np.array_equal(loaded.t, result.camera.t))
        self.assertIn("covariance", json.dumps(written))

    def test_results_outlive_their_makers(self):
        truth = camera()
        measurements = measured(truth, 50)
        result = ptzcal.calibrate_camera(measurements)
        residuals = result.residuals
        del measurements, result
        self.assertLess(np.abs(residuals).max(), 3)

    def test_refusals(self):
        truth = camera()
        with self.fails("TOO_FEW_POINTS") as refused:
            ptzcal.calibrate_camera(measured(truth, 3))
        self.assertTrue(refused.error.hint)
        with self.fails("TOO_FEW_POINTS"):
            ptzcal.calibrate_camera(ptzcal.Correspondences(800, 600))
        plane = room_points(100)
        plane[:, 2] = 4
        flat = ptzcal.Correspondences(800, 600)
        flat.add_points(plane, project(truth, plane))
        with self.fails("DEGENERATE") as refused:
            ptzcal.calibrate_camera(flat)
        self.assertTrue(refused.error.hint)
        with self.fails("NO_CONVERGENCE"):
            ptzcal.calibrate_camera(measured(camera(LENS), 100), distortion=3, max_iterations=1)
        noise = ptzcal.Correspondences(800, 600)
        rng = np.random.default_rng(0)
        noise.add_points(room_points(50), rng.uniform((0, 0), (800, 600), (50, 2)))
        with self.assertRaises(ptzcal.Error):
            ptzcal.calibrate_camera(noise)

    def test_cancel(self):
        token = ptzcal.Cancel()
        token.request()
        with self.assertRaises(ptzcal.Cancelled):
            ptzcal.calibrate_camera(measured(camera(), 100), cancel=token)
        token.reset()
        ptzcal.calibrate_camera(measured(camera(), 100), cancel=token)

    def test_wrong_arguments(self):
        m = ptzcal.Correspondences(800, 600)
        points, pixels = np.ones((4, 3)), np.ones((4, 2))
        with self.assertRaisesRegex(ValueError, r"uv must be of shape \(4, 2\)"):
            m.add_points(points, np.ones((5, 2)))
        with self.assertRaisesRegex(ValueError, "xyz must be of shape"):
            m.add_points(points.T, pixels)
        with self.assertRaisesRegex(ValueError, "uv_covariance must be"):
            m.add_points(points, pixels, uv_covariance=np.ones((5, 3)))
        with self.assertRaisesRegex(ValueError, "xyz_covariance must be"):
            m.add_points(points, pixels, xyz_covariance=np.ones((4, 6)))
        with self.fails("NOT_FINITE", index=2):
            m.add_points([[1, 2, 3], [1, 2, 3], [1, np.inf, 3]], pixels[:3])
        with self.fails("INVALID_ARGUMENT"):
            m.add_points(points, pixels, uv_covariance=-np.eye(2))
        self.assertEqual(len(m), 0, "a refused call adds nothing")
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Correspondences(0, 600)
        with self.assertRaises(ValueError):
            ptzcal.Correspondences(-1, 600)
        with self.assertRaises(ValueError):
            ptzcal.Correspondences(2**32 + 800, 600)
        with self.assertRaisesRegex(ValueError, "division"):
            ptzcal.calibrate_camera(m, distortion="wavy")
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.calibrate_camera(m, skew_sigma=-1)
        with self.assertRaises(ValueError):
            ptzcal.calibrate_camera(m, seed=-1)
        with self.assertRaisesRegex(TypeError, "ptzcal.Cancel"):
            ptzcal.calibrate_camera(m, cancel=threading.Event())
        with self.assertRaises(TypeError):
            ptzcal.calibrate_camera(m, tolerance=1)

    def test_threads_share_a_set(self):
        measurements = measured(camera(), 2000)
        results = []

        def work():
            results.append(ptzcal.calibrate_camera(measurements).camera.fx)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(results), 4)
        self.assertEqual(len(set(results)), 1)


class LaserShots(TestCase):
    def test_a_camera_from_shots(self):
        rng = np.random.default_rng(5)
        truth, model = camera(), rig_model()
        pan_tilt = rng.uniform([-0.35, -0.25], [0.35, 0.25], (600, 2))
        xyz, spots = shots(model, pan_tilt, rng.uniform(1.5, 4.5, 600))
        uv = project(truth, xyz)
        inside = np.all((uv > 0) & (uv < truth.size), axis=1)
        pan_tilt, spots, uv = pan_tilt[inside], spots[inside], uv[inside]
        self.assertGreater(len(uv), 300)
        noise = dict(spot_covariance=0.01 * np.eye(2), uv_covariance=0.04 * np.eye(2))
        measurements = ptzcal.Correspondences(*truth.size)
        measurements.add_laser_shots(
            model,
            pan_tilt,
            spots + rng.normal(0, 0.1, spots.shape),
            uv + rng.normal(0, 0.2, uv.shape),
            **noise,
        )
        self.assertEqual(len(measurements), len(uv))
        result = ptzcal.calibrate_camera(measurements)
        error = result.camera.centre - truth.centre
        self.assertTrue((np.abs(error) < 5 * result.standard_deviations[-3:]).all())
        self.assertLess(np.linalg.norm(error), 0.02)
        self.assertClose(result.noise_factor, 1, atol=0.15)

    def test_wrong_shots(self):
        m = ptzcal.Correspondences(800, 600)
        with self.assertRaisesRegex(ValueError, r"spots must be of shape \(3, 2\)"):
            m.add_laser_shots(rig_model(), np.zeros((3, 2)), np.zeros((2, 2)), np.zeros((3, 2)))
        with self.fails("NOT_FINITE", index=1):
            m.add_laser_shots(rig_model(), [[0, 0], [0, np.nan]], np.ones((2, 2)), np.ones((2, 2)))


class Lines(TestCase):
    def seen(self, n=40, noise=0.2):
        """n lines by two points, and the noisy ends of segments that other points of them end."""
        truth, rng = camera(), np.random.default_rng(3)
        xyz = room_points(2 * n).reshape(n, 2, 3)
        a, b = xyz[:, :1], xyz[:, 1:]
        shown = np.concatenate([a + 0.1 * (b - a), a + 0.7 * (b - a)], axis=1)
        uv = project(truth, shown.reshape(-1, 3)).reshape(n, 2, 2)
        return truth, xyz, uv + rng.normal(0, noise, uv.shape)

    def test_a_camera_from_lines(self):
        truth, xyz, uv = self.seen(200)
        by_points, directed = (ptzcal.Correspondences(*truth.size) for _ in range(2))
        by_points.add_lines(xyz, uv)
        directed.add_lines(np.stack([xyz[:, 1], xyz[:, 0] - xyz[:, 1]], axis=1), uv, directed=True)
        results = [ptzcal.calibrate_camera(m) for m in (by_points, directed)]
        for result in results:
            error = result.camera.centre - truth.centre
            self.assertTrue((np.abs(error) < 5 * result.standard_deviations[-3:]).all())
            self.assertClose(result.noise_factor, 0.2, atol=0.03)
            self.assertEqual(result.residuals.shape, (200, 2))
        self.assertClose(results[0].camera.centre, results[1].camera.centre, atol=1e-7)

    def test_covariances_count(self):
        truth, xyz, uv = self.seen(200)
        of_points = np.tile(1e-4 * np.eye(3), (200, 2, 1, 1))
        deviations = []
        for covariance in (None, of_points):
            m = ptzcal.Correspondences(*truth.size)
            m.add_lines(xyz, uv, covariance=covariance, uv_covariance=0.04 * np.eye(2))
            deviations.append(ptzcal.calibrate_camera(m).standard_deviations[-1])
        self.assertGreater(deviations[1], 3 * deviations[0])
        m.add_lines(
            xyz.reshape(200, 2, 3),
            uv,
            directed=True,
            covariance=np.zeros((200, 6, 6)),
            uv_covariance=np.tile(np.eye(2), (200, 2, 1, 1)),
        )
        self.assertEqual(len(m), 400)

    def test_wrong_lines(self):
        m = ptzcal.Correspondences(800, 600)
        _, xyz, uv = self.seen(3)
        with self.assertRaisesRegex(ValueError, r"xyz must be of shape \(n, 2, 3\)"):
            m.add_lines(xyz.reshape(3, 6), uv)
        with self.assertRaisesRegex(ValueError, r"uv must be of shape \(3, 2, 2\)"):
            m.add_lines(xyz, uv[:2])
        with self.assertRaisesRegex(ValueError, r"covariance must be of shape \(3, 6, 6\)"):
            m.add_lines(xyz, uv, directed=True, covariance=np.zeros((3, 2, 3, 3)))
        with self.fails("INVALID_ARGUMENT"):
            m.add_lines(np.zeros((3, 2, 3)), uv)
        with self.fails("NOT_FINITE", index=1):
            m.add_lines(xyz * [[[1]], [[np.nan]], [[1]]], uv)
        m.add_lines([], [])
        self.assertEqual(len(m), 0)


class Uncertainty(TestCase):
    def test_there_and_back(self):
        truth = camera()
        result = ptzcal.calibrate_camera(measured(truth, 100))
        xyz, _ = visible(truth, 10)
        uv, of_uv = result.project(xyz)
        self.assertClose(uv, result.camera.project(xyz))
        self.assertEqual(of_uv.shape, (10, 2, 2))
        self.assertTrue((np.linalg.eigvalsh(of_uv) > 0).all())
        _, wider = result.project(xyz, xyz_covariance=1e-4 * np.eye(3))
        self.assertTrue((np.linalg.eigvalsh(wider - of_uv) > 1).all())
        directions, of_rays = result.back_project(uv, uv_covariance=np.eye(2))
        self.assertClose(directions, result.camera.back_project(uv))
        self.assertEqual(of_rays.shape, (10, 6, 6))
        self.assertClose(of_rays[4, :3, :3], result.covariance[-3:, -3:])
        with self.fails("BEHIND_CAMERA", index=1):
            result.project([[0, 0, 3], [0, 0, -9]])
        with self.fails("INVALID_ARGUMENT"):
            result.project(xyz, xyz_covariance=-np.eye(3))

    def test_clicks_on_the_floor(self):
        result = ptzcal.calibrate_camera(measured(camera(), 100))
        uv = [[300, 500], [500, 550]]
        xyz, exact = result.back_project_to_plane(uv, (0, 1, 0), 1.2)
        _, noisy = result.back_project_to_plane(uv, (0, 1, 0), 1.2, uv_covariance=np.eye(2))
        self.assertClose(xyz[:, 1], 1.2)
        self.assertClose(result.camera.project(xyz), uv, atol=1e-8)
        self.assertTrue((noisy[:, [0, 2], [0, 2]] > exact[:, [0, 2], [0, 2]]).all())
        with self.fails("BEHIND_CAMERA", index=1):
            result.back_project_to_plane([[300, 500], [300, -3000]], (0, 1, 0), 1.2)
        with self.fails("INVALID_ARGUMENT"):
            result.back_project_to_plane(uv, (0, 0, 0), 1.2)


if __name__ == "__main__":
    unittest.main()
