import tempfile
import threading
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np

import ptzcal
from support import TestCase, rig_model, rotation, shots

NOISE = 0.2
WORLD = (np.eye(3), np.zeros(3))
SECOND = (rotation(0.02, 0.3, -0.01), np.array([-0.6, 0.1, 0.2]))
RIG = len(ptzcal.RigParameter)


def looking(R, centre):
    return ptzcal.Camera(800, 600, 845.0, 845.0, 402.5, 305.25, R=R, t=-R @ np.asarray(centre))


CAMERAS = (looking(rotation(0, -0.25, 0), (0.5, -0.2, -1)), looking(rotation(0, 0.25, 0), (-0.9, 0.3, -0.5)))


def shoot(n, station=WORLD, seed=1, rig=None):
    """Readings, points of the world, noisy spots of the head and of each camera; no axis offsets."""
    rng = np.random.default_rng(seed)
    pan_tilt = rng.uniform([-0.35, -0.2], [0.2, 0.2], (n, 2))
    xyz, spots = shots(rig or rig_model(), pan_tilt, rng.uniform(1.5, 4.5, n))
    xyz = xyz @ station[0].T + station[1]
    uv = [camera.project(xyz) + rng.normal(0, NOISE, (n, 2)) for camera in CAMERAS]
    return pan_tilt, xyz, spots + rng.normal(0, NOISE, (n, 2)), uv


NOISY = NOISE**2 * np.eye(2)


def survey(n, *, model=None, stations=(WORLD,), cameras=2, rig=None):
    adjustment = ptzcal.Adjustment(model or rig_model())
    for number in range(cameras):
        assert adjustment.add_camera(800, 600) == number
    for number, station in enumerate(stations):
        assert adjustment.add_station(*(station if number == 0 else ())) == number
        pan_tilt, _, spots, uv = shoot(n, station, seed=1 + number, rig=rig)
        added = adjustment.add_shots(number, pan_tilt, spots, spot_covariance=NOISY)
        assert added == range(number * n, (number + 1) * n)
        for camera in range(cameras):
            adjustment.add_sightings(camera, added, uv[camera], uv_covariance=NOISY)
    return adjustment


class Survey(TestCase):
    @classmethod
    def setUpClass(cls):
        cls.truth = rig_model()
        cls.believed = rig_model(laser_vx=-0.0045, laser_vy=0.0035)
        cls.adjustment = survey(300, model=cls.believed, stations=(WORLD, SECOND))
        cls.adjustment.set_rig_sigmas(laser_vx=1e-3, laser_vy=1e-3)
        cls.result = cls.adjustment.solve()

    def test_the_rig(self):
        rig, sigma = self.result.rig_model, self.result.standard_deviations
        for name in ("laser_vx", "laser_vy"):
            deviation = sigma[ptzcal.RigParameter[name.upper()]]
            self.assertLess(abs(getattr(rig, name) - getattr(self.truth, name)), 4.5 * deviation)
            self.assertLess(deviation, 4e-4)
        self.assertEqual(rig.laser_x0, self.truth.laser_x0)
        self.assertEqual(sigma[ptzcal.RigParameter.LASER_X0], 0)

    def test_the_stations(self):
        first, second = self.result.stations
        self.assertTrue(np.array_equal(first.R, np.eye(3)) and not first.t.any())
        self.assertFalse(first.covariance.any())
        sigma = np.sqrt(np.diagonal(second.covariance))
        self.assertTrue((np.abs(second.t - SECOND[1]) < 4.5 * sigma[3:]).all())
        turn = second.R @ SECOND[0].T
        self.assertLess(abs(turn[0, 2] - turn[2, 0]) / 2, 4.5 * sigma[1])
        self.assertLess(sigma.max(), 0.02)

    def test_the_cameras(self):
        for i, calibration in enumerate(self.result.calibrations):
            error = calibration.camera.centre - CAMERAS[i].centre
            self.assertTrue((np.abs(error) < 4.5 * calibration.standard_deviations[-3:]).all())
            self.assertEqual(calibration.measurements, 600)
            self.assertEqual(calibration.residuals.shape, (600, 2))
            first = RIG + 12 + 11 * i
            own = self.result.covariance[first : first + 11, first : first + 11]
            self.assertTrue(np.array_equal(own, calibration.covariance))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "camera.json")
            self.result.calibrations[1].save(path)
            self.assertEqual(ptzcal.Camera.load(path).fx, self.result.calibrations[1].camera.fx)

    def test_the_points(self):
        pan_tilt, xyz, spots, _ = shoot(300, SECOND, seed=2)
        point, covariance = self.result.shot_point(300)
        self.assertLess(self.distance(point - xyz[0], covariance), 25)
        measured, covariances = self.result.measure(1, pan_tilt, spots, NOISY)
        near = [self.distance(e, c) for e, c in zip(measured - xyz, covariances)]
        # Points share the rig's error: not 3, but not far from it either.
        self.assertTrue(0.5 < np.mean(near) < 8, np.mean(near))
        # sigma_Z = Z^2 sigma / (f b) is 0.051 m at 4.5 m; the rest is the rig's.
        self.assertTrue((np.trace(covariances, axis1=1, axis2=2) < 0.07**2).all())

    @staticmethod
    def distance(error, covariance):
        return error @ np.linalg.solve(covariance, error)

    def test_what_it_says(self):
        result = self.result
        self.assertEqual((result.shots, result.spots), (600, 1800))
        self.assertGreater(result.used, 1780)
        self.assertEqual(result.head_inliers.shape, (600,))
        self.assertEqual((result.warnings, result.suspects), ((), ()))
        self.assertGreater(result.probability, 1e-3)
        self.assertClose(result.chi2 / result.degrees_of_freedom, 1, atol=0.15)
        self.assertGreater(result.condition, 1)
        self.assertGreater(result.iterations, 0)
        self.assertGreaterEqual(result.noise_factor, 1)
        self.assertTrue(result.weakest.startswith("weakest: "))
        self.assertIsInstance(result.prior_only, tuple)
        self.assertEqual(len(result.parameters), RIG + 12 + 22)
        self.assertEqual(result.parameters[2], "laser vx")
        self.assertEqual(result.parameters[-1], "camera 1 position z")
        self.assertClose(result.covariance, result.covariance.T)
        self.assertIn("2 stations, 2 cameras", repr(result))

    def test_solved_again(self):
        again = self.result.resolve()
        self.assertTrue(np.array_equal(again.covariance, self.result.covariance))
        self.assertEqual(again.rig_model, self.result.rig_model)

    def test_cancel(self):
        token = ptzcal.Cancel()
        token.request()
        with self.assertRaises(ptzcal.Cancelled):
            self.adjustment.solve(cancel=token)
        with self.assertRaises(ptzcal.Cancelled):
            self.result.resolve(cancel=token)
        with self.assertRaisesRegex(TypeError, "ptzcal.Cancel"):
            self.adjustment.solve(cancel=threading.Event())

    def test_threads_share_a_survey(self):
        results = []
        solve = lambda: results.append(self.adjustment.solve().chi2)  # noqa: E731
        threads = [threading.Thread(target=solve) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(results, [self.result.chi2] * 3)


class Priors(TestCase):
    def test_what_was_wrongly_fixed_is_named(self):
        result = survey(200, model=rig_model(laser_vx=-0.002)).solve()
        # The head's principal point would explain a slope of the laser as well.
        suspects = {s.name: s for s in result.suspects}
        self.assertIn("the head camera's intrinsics", suspects)
        laser = suspects["the laser line"]
        self.assertGreater(laser.gain, 30)
        self.assertLess(laser.probability, 1e-5)
        self.assertTrue(0 < laser.parameters <= 4)
        self.assertIn("the laser line should not be fixed", " ".join(result.warnings))

    def test_a_covariance(self):
        adjustment = survey(100)
        covariance = np.zeros((RIG, RIG))
        covariance[2:4, 2:4] = [[1e-6, 5e-7], [5e-7, 1e-6]]
        adjustment.set_rig_covariance(covariance)
        sigma = adjustment.solve().standard_deviations
        self.assertTrue((sigma[2:4] > 0).all() and not sigma[4:RIG].any())

    def test_an_earlier_calibration(self):
        first = survey(300, cameras=1).solve().calibrations[0]
        adjustment = ptzcal.Adjustment(rig_model())
        adjustment.add_station(*WORLD)
        self.assertEqual(adjustment.add_calibrated_camera(first), 0)
        sigmas = np.r_[np.zeros(5), np.full(6, np.inf)]
        self.assertEqual(adjustment.add_known_camera(CAMERAS[1], sigmas), 1)
        pan_tilt, _, spots, uv = shoot(60, seed=8)
        added = adjustment.add_shots(0, pan_tilt, spots, spot_covariance=NOISY)
        for camera in range(2):
            adjustment.add_sightings(camera, added, uv[camera], uv_covariance=NOISY)
        near, known = adjustment.solve().calibrations
        self.assertLess(near.standard_deviations[-1], first.standard_deviations[-1])
        self.assertFalse(known.standard_deviations[:5].any())
        self.assertTrue(known.standard_deviations[5:].all())

    def test_a_known_station_and_lens(self):
        adjustment = ptzcal.Adjustment(rig_model())
        adjustment.add_station(*WORLD)
        adjustment.add_station(*SECOND, 1e-8 * np.eye(6))
        adjustment.add_camera(800, 600, lens=CAMERAS[0], distortion="none", skew_sigma=0, aspect_sigma=0)
        pan_tilt, _, spots, uv = shoot(60, SECOND)
        added = adjustment.add_shots(1, pan_tilt, spots, spot_covariance=NOISY)
        adjustment.add_sightings(0, added, uv[0], uv_covariance=NOISY)
        camera = adjustment.solve().calibrations[0].camera
        self.assertEqual(camera.fx, CAMERAS[0].fx)
        self.assertClose(camera.centre, CAMERAS[0].centre, atol=0.01)

    def test_shots_that_the_head_did_not_see(self):
        adjustment = survey(150)
        pan_tilt, xyz, spots, uv = shoot(4, seed=9)
        seen = [True, False, True, True]
        added = adjustment.add_shots(0, pan_tilt, spots, seen=seen)
        for camera in range(2):
            adjustment.add_sightings(camera, added[:2], uv[camera][:2], uv_covariance=NOISY)
        unseen = adjustment.add_shots(0, pan_tilt)
        result = adjustment.solve()
        self.assertEqual((result.shots, result.spots), (158, 450 + 3 + 4))
        point, covariance = result.shot_point(added[1])
        # The rig is exact: all that is uncertain lies along the beam.
        self.assertLess(np.linalg.norm(point - xyz[1]), 5 * np.sqrt(np.trace(covariance)))
        self.assertClose(np.linalg.eigvalsh(covariance)[:2], 0, atol=1e-12)
        self.assertIsNone(result.shot_point(unseen[0]))
        self.assertFalse(result.head_inliers[added[1]])

    def test_options(self):
        adjustment = survey(100)
        settings = dict(huber=np.inf, max_focal_deviation=np.inf, seed=9, max_iterations=200)
        plain = adjustment.solve(robust=False, **settings)
        self.assertEqual(plain.used, plain.spots)
        loose = adjustment.solve(pointing_sigma=(1e-3, 1e-3), **settings)
        self.assertGreater(
            loose.calibrations[0].standard_deviations[-1],
            1.1 * plain.calibrations[0].standard_deviations[-1],
        )


class Planes(TestCase):
    def test_walls_tie_stations(self):
        walls = np.array([[0, 0, 1, 4], [0.6, 0, 0.8, 2.6], [0, 0.6, 0.8, 2.2], [0, -0.8, 0.6, 2.5]])
        rng = np.random.default_rng(3)
        adjustment = ptzcal.Adjustment(rig_model())
        adjustment.add_station(*WORLD)
        adjustment.add_station()
        for _ in walls:
            adjustment.add_plane(0.001)
        for station, (R, t) in enumerate((WORLD, SECOND)):
            pan_tilt = rng.uniform([-0.3, -0.25], [0.3, 0.25], (240, 2))
            near, _ = shots(rig_model(), pan_tilt, np.full(240, 1.0))
            far, _ = shots(rig_model(), pan_tilt, np.full(240, 2.0))
            near, far = near @ R.T + t, far @ R.T + t
            chosen = np.arange(240) % len(walls)
            normal, distance = walls[chosen, :3], walls[chosen, 3]
            share = (distance - (normal * near).sum(1)) / (normal * (far - near)).sum(1)
            _, spots = shots(rig_model(), pan_tilt, 1.0 + share)
            spots += rng.normal(0, NOISE, spots.shape)
            added = adjustment.add_shots(station, pan_tilt, spots, spot_covariance=NOISY)
            named = [None if i == 7 else int(plane) for i, plane in enumerate(chosen)]
            adjustment.set_planes(added[0], named)
        result = adjustment.solve()
        second = result.stations[1]
        sigma = np.sqrt(np.diagonal(second.covariance))
        self.assertTrue((np.abs(second.t - SECOND[1]) < 4.5 * sigma[3:]).all())
        self.assertLess(sigma[3:].max(), 0.1)
        for (found, covariance), wall in zip(result.planes, walls):
            side = np.sign(found[3])
            deviation = np.sqrt(np.diagonal(covariance))
            self.assertTrue((np.abs(side * found - wall) < 4.5 * deviation + 1e-9).all())
        self.assertFalse(result.plane_inliers[7])
        self.assertGreater(result.plane_inliers.mean(), 0.98)
        with self.assertRaises(ptzcal.Error):
            adjustment.set_planes(0, [0])
        with self.assertRaises(ptzcal.Error):
            adjustment.add_plane(0.0)
        with self.assertRaises(ptzcal.Error):
            adjustment.solve(max_station_deviation=1e-6)


class Refusals(TestCase):
    def test_what_cannot_be_told(self):
        empty = ptzcal.Adjustment(rig_model())
        with self.fails("BAD_STATE"):
            empty.solve()
        empty.add_camera(800, 600)
        with self.fails("TOO_FEW_POINTS"):
            empty.solve()
        with self.fails("TOO_FEW_POINTS", index=0) as refused:
            survey(4).solve()
        self.assertTrue(refused.error.hint)
        adjustment = survey(80)
        adjustment.set_rig_sigmas(pan_zero=np.inf)
        with self.fails("DEGENERATE") as refused:
            adjustment.solve()
        self.assertIn("pan encoder", refused.error.message)
        adjustment.set_rig_sigmas()
        adjustment.add_station()
        with self.fails("BAD_STATE") as refused:
            adjustment.solve()
        self.assertIn("station 1", refused.error.message)
        adjustment.add_camera(640, 480)
        with self.fails("TOO_FEW_POINTS", index=2):
            adjustment.solve()
        for setting in ("huber", "max_focal_deviation"):
            with self.fails("INVALID_ARGUMENT"):
                adjustment.solve(**{setting: -1.0})
        with self.fails("INVALID_ARGUMENT"):
            adjustment.solve(max_iterations=0)
        with self.fails("INVALID_ARGUMENT"):
            adjustment.solve(pointing_sigma=(np.nan, 0))

    def test_priors(self):
        adjustment = ptzcal.Adjustment(rig_model())
        with self.fails("INVALID_ARGUMENT") as refused:
            adjustment.set_rig_sigmas(axis_tilt_z=-0.1)
        self.assertIn("tilt axis z", refused.error.message)
        with self.fails("NOT_FINITE", index=ptzcal.RigParameter.TILT_SCALE):
            adjustment.set_rig_sigmas(tilt_scale=np.nan)
        with self.assertRaises(TypeError):
            adjustment.set_rig_sigmas(laser_z0=1.0)
        with self.assertRaisesRegex(ValueError, r"covariance must be of shape \(15, 15\)"):
            adjustment.set_rig_covariance(np.eye(6))
        with self.fails("INVALID_ARGUMENT"):
            adjustment.set_rig_covariance(-np.eye(RIG))
        with self.fails("INVALID_ARGUMENT"):
            adjustment.add_station(-np.eye(3), np.zeros(3))
        with self.fails("INVALID_ARGUMENT"):
            adjustment.add_station(covariance=np.eye(6))
        with self.assertRaisesRegex(ValueError, "both R and t"):
            adjustment.add_station(np.eye(3))
        with self.fails("INVALID_ARGUMENT"):
            adjustment.add_known_camera(CAMERAS[0], np.ones(10))
        with self.fails("INVALID_ARGUMENT"):
            adjustment.add_camera(0, 600)
        with self.assertRaisesRegex(ValueError, "division"):
            adjustment.add_camera(800, 600, distortion="wavy")
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Adjustment(replace(rig_model(), laser_x0=0.0, laser_y0=0.0))

    def test_shots(self):
        adjustment = ptzcal.Adjustment(rig_model())
        adjustment.add_station(*WORLD)
        adjustment.add_camera(800, 600)
        pan_tilt, spots = np.zeros((3, 2)), np.full((3, 2), 400.0)
        with self.assertRaisesRegex(ValueError, r"spots must be of shape \(3, 2\)"):
            adjustment.add_shots(0, pan_tilt, spots[:2])
        with self.assertRaisesRegex(ValueError, r"seen must be of shape \(3,\)"):
            adjustment.add_shots(0, pan_tilt, spots, seen=[True])
        with self.fails("INVALID_ARGUMENT"):
            adjustment.add_shots(1, pan_tilt, spots)
        with self.fails("NOT_FINITE", index=2):
            adjustment.add_shots(0, [[0, 0], [0, 0], [0, np.inf]], spots)
        with self.fails("INVALID_ARGUMENT"):
            adjustment.add_shots(0, pan_tilt, spots, spot_covariance=-np.eye(2))
        added = adjustment.add_shots(0, pan_tilt, spots)
        self.assertEqual(added, range(3), "refused calls add nothing")
        with self.assertRaisesRegex(ValueError, "shots must be 3 indices"):
            adjustment.add_sightings(0, [0.0, 1.0, 2.0], spots)
        with self.assertRaisesRegex(ValueError, "negative"):
            adjustment.add_sightings(0, [-1, 0, 1], spots)
        for camera, indices in ((1, added), (0, [0, 1, 3]), (0, [0, 1, 1])):
            with self.fails("INVALID_ARGUMENT"):
                adjustment.add_sightings(camera, indices, spots)
        adjustment.add_sightings(0, added, spots)
        with self.fails("INVALID_ARGUMENT"):
            adjustment.add_sightings(0, added, spots)


class Scans(TestCase):
    def test_a_scan(self):
        with ptzcal.Rig.open("sim:room?misalignment=0&seed=3") as rig:
            scan = rig.scan_region(
                ptzcal.Region(-0.4, 0.3, -0.25, 0.25, 9, 6), ["sim:fixed/0", "sim:fixed/1"]
            )
            truth, model = rig.simulator().true_camera(0), rig.model
        adjustment = ptzcal.Adjustment(model)
        adjustment.add_station(*WORLD)
        adjustment.add_camera(*truth.size, distortion="radial1")
        with self.fails("INVALID_ARGUMENT"):
            adjustment.add_scan(scan, [0])
        with self.fails("INVALID_ARGUMENT"):
            adjustment.add_scan(scan, [0, 1])
        with self.fails("INVALID_ARGUMENT"):
            adjustment.add_scan(scan, [0, None], station=1)
        added = adjustment.add_scan(scan, [0, None])
        self.assertEqual(added, range(len(scan)))
        pointing = np.radians(0.005)
        result = adjustment.solve(pointing_sigma=(pointing, pointing))
        calibration = result.calibrations[0]
        error = calibration.camera.centre - truth.centre
        self.assertTrue((np.abs(error) < 5 * calibration.standard_deviations[-3:]).all())
        self.assertLess(np.linalg.norm(error), 0.005)


if __name__ == "__main__":
    unittest.main()
