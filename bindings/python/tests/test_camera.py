import dataclasses
import pickle
import tempfile
import unittest
from pathlib import Path

import numpy as np

import ptzcal
from support import TestCase, camera, project, rig_model, room_points, shots

LENS = (-0.2, 0.06, 0.001, -0.0008, -0.01)


class Cameras(TestCase):
    def test_members(self):
        c = camera(LENS)
        self.assertEqual(c.size, (800, 600))
        self.assertClose(c.K, [[845, 0.5, 402.5], [0, 847, 305.25], [0, 0, 1]])
        self.assertClose(c.centre, -c.R.T @ c.t)
        self.assertIs(c.distortion_model, ptzcal.DistortionModel.BROWN_CONRADY)
        self.assertEqual(c.distortion[:5], LENS)

    def test_project(self):
        xyz = room_points(500)
        for c in (camera(), camera(LENS)):
            self.assertClose(c.project(xyz), project(c, xyz), atol=1e-9)

    def test_one_point(self):
        c, point = camera(LENS), np.array([0.1, -0.2, 3.0])
        self.assertEqual(c.project(point).shape, (2,))
        self.assertClose(c.project(point), project(c, point[None])[0], atol=1e-9)
        self.assertEqual(c.back_project([400, 300]).shape, (3,))

    def test_back_project(self):
        for c in (camera(), camera(LENS)):
            xyz = room_points(200)
            xyz = xyz[np.all(np.abs(project(c, xyz) - (400, 300)) < (400, 300), axis=1)]
            self.assertGreater(len(xyz), 50)
            directions = c.back_project(c.project(xyz))
            expected = xyz - c.centre
            expected /= np.linalg.norm(expected, axis=1)[:, None]
            self.assertClose(directions, expected, atol=1e-9)

    def test_division_model(self):
        lens = dict(distortion_model="division", distortion=[-0.1])
        c = ptzcal.Camera(800, 600, 800, 800, 400, 300, **lens)
        a = (c.project([0.3, 0.2, 1.0]) - (400, 300)) / 800
        self.assertClose(a / (1 - 0.1 * (a @ a)), (0.3, 0.2), atol=1e-12)

    def test_fisheye_model(self):
        k = np.array([-0.01, 0.02, -0.015, 0.003])
        c = ptzcal.Camera(800, 600, 300, 310, 400, 300, distortion_model="fisheye", distortion=k)
        theta = np.radians([0, 1, 45, 89, 90, 100])
        xyz = 3 * np.c_[0.6 * np.sin(theta), 0.8 * np.sin(theta), np.cos(theta)]
        radius = theta * (1 + k @ theta ** np.array([[2], [4], [6], [8]]))
        expected = np.c_[300 * 0.6 * radius + 400, 310 * 0.8 * radius + 300]
        self.assertClose(c.project(xyz), expected, atol=1e-9)
        self.assertClose(c.back_project(expected), xyz / 3, atol=1e-12)
        with self.assertRaises(ptzcal.Error) as caught:
            c.project([[0, 0, 1], [0, 0, -1]])
        self.assertIs(caught.exception.status, ptzcal.Status.BEHIND_CAMERA)
        self.assertEqual(caught.exception.index, 1)

    def test_from_matrix(self):
        c = camera(LENS)
        same = ptzcal.Camera.from_matrix(c.K, c.size, LENS, c.R, c.t)
        xyz = room_points(10)
        self.assertClose(same.project(xyz), c.project(xyz))
        plain = ptzcal.Camera.from_matrix(c.K, c.size)
        self.assertIs(plain.distortion_model, ptzcal.DistortionModel.NONE)
        with self.assertRaisesRegex(ValueError, r"\(3, 3\)"):
            ptzcal.Camera.from_matrix(c.K[:2], c.size)
        with self.assertRaisesRegex(ValueError, "k1 k2 p1 p2"):
            ptzcal.Camera.from_matrix(c.K, c.size, np.ones(8))

    def test_arrays_of_all_kinds(self):
        c = camera(LENS)
        xyz = room_points(20)
        uv = c.project(xyz)
        wide = np.zeros((40, 7))
        wide[::2, 1:4] = xyz
        self.assertClose(c.project(wide[::2, 1:4]), uv)
        self.assertClose(c.project(np.asfortranarray(xyz)), uv)
        self.assertClose(c.project(xyz[::-1])[::-1], uv)
        self.assertClose(c.project(xyz.tolist()), uv)
        self.assertClose(c.project(xyz.astype(np.float32)), uv, atol=1e-3)
        self.assertClose(c.project(xyz.astype(">f8")), uv)
        self.assertEqual(c.project([]).shape, (0, 2))
        self.assertEqual(c.project(np.empty((0, 3))).shape, (0, 2))
        self.assertClose(c.project([[0, 0, 4]]), c.project([[0.0, 0.0, 4.0]]))

    def test_wrong_arrays(self):
        c = camera()
        for wrong in (np.zeros((4, 2)), np.zeros((3, 4, 3)), 5.0, np.zeros(4)):
            with self.assertRaisesRegex(ValueError, r"xyz must be of shape \(n, 3\)"):
                c.project(wrong)
        for wrong in ([["a", "b", "c"]], np.zeros((2, 3), complex), [None, 1, 2]):
            with self.assertRaises(TypeError):
                c.project(wrong)

    def test_errors_name_the_point(self):
        xyz = room_points(10)
        xyz[6] = (0, 0, -3)
        with self.fails("BEHIND_CAMERA", index=6):
            camera().project(xyz)
        xyz[4, 1] = np.nan
        with self.fails("NOT_FINITE", index=4):
            camera().project(xyz)
        with self.fails("OUTSIDE_LENS", index=1):
            camera((-0.4, 0, 0, 0, 0)).back_project([[400, 300], [40000, 300]])

    def test_wrong_cameras(self):
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Camera(800, 600, -1, 800, 400, 300).project([0, 0, 1])
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Camera(0, 600, 800, 800, 400, 300).project([0, 0, 1])
        with self.fails("INVALID_ARGUMENT"):
            dataclasses.replace(camera(), R=2 * np.eye(3)).project([0, 0, 1])
        with self.assertRaises(ValueError):
            dataclasses.replace(camera(), R=np.eye(2))
        with self.assertRaises(ValueError):
            dataclasses.replace(camera(), width=-1)
        with self.assertRaises(ValueError):
            dataclasses.replace(camera(), distortion=np.ones(9))
        with self.assertRaisesRegex(ValueError, "brown_conrady"):
            dataclasses.replace(camera(), distortion_model="spherical")

    def test_immutable(self):
        c = camera()
        with self.assertRaises(dataclasses.FrozenInstanceError):
            c.fx = 3
        with self.assertRaises(ValueError):
            c.R[0, 0] = 3
        t = np.zeros(3)
        moved = dataclasses.replace(c, t=t)
        t[0] = 5
        self.assertClose(moved.t, 0)

    def test_files(self):
        c, point = camera(LENS), (0.1, 0.2, 3)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "Kamera ä.json")
            c.save(path)
            loaded = ptzcal.Camera.load(path)
            self.assertEqual(loaded.fx, c.fx)
            self.assertTrue(np.array_equal(loaded.R, c.R))
            square = dataclasses.replace(c, skew=0.0)
            square.save_opencv(str(path))
            self.assertClose(
                ptzcal.Camera.load_opencv(str(path)).project(point), square.project(point)
            )
            with self.fails("FILE_FORMAT"):
                ptzcal.Camera.load(path)
            with self.fails("UNSUPPORTED"):
                c.save_opencv(path)
            with self.fails("FILE_IO"):
                ptzcal.Camera.load(Path(folder, "missing.json"))
            with self.fails("FILE_IO"):
                c.save(Path(folder, "no", "folder.json"))
        with self.assertRaisesRegex(ValueError, "NUL"):
            c.save("a\0b")
        with self.assertRaises(TypeError):
            c.save(5)

    def test_pickles(self):
        c, point = camera(LENS), (0.1, 0.2, 3)
        self.assertClose(pickle.loads(pickle.dumps(c)).project(point), c.project(point))


class RigModels(TestCase):
    def setUp(self):
        rng = np.random.default_rng(3)
        self.model = rig_model()
        self.pan_tilt = rng.uniform([-0.5, -0.3], [0.5, 0.3], (50, 2))
        self.xyz, self.spots = shots(self.model, self.pan_tilt, rng.uniform(1, 5, 50))

    def test_locate(self):
        xyz, covariance = self.model.locate(self.pan_tilt, self.spots)
        self.assertClose(xyz, self.xyz, atol=1e-9)
        self.assertEqual(covariance.shape, (50, 3, 3))
        self.assertTrue((np.trace(covariance, axis1=1, axis2=2) > 0).all())
        quarter = self.model.locate(self.pan_tilt, self.spots, 0.25 * np.eye(2))[1]
        self.assertClose(quarter, covariance / 4, atol=1e-12)
        rows = np.tile([0.25, 0.0, 0.25], (50, 1))
        self.assertClose(self.model.locate(self.pan_tilt, self.spots, rows)[1], quarter)
        full = np.tile(0.25 * np.eye(2), (50, 1, 1))
        self.assertClose(self.model.locate(self.pan_tilt, self.spots, full)[1], quarter)

    def test_aim(self):
        for (pan, tilt), point in zip(self.pan_tilt, self.xyz):
            self.assertClose(self.model.aim(point), (pan, tilt), atol=1e-9)
        aimed = self.model.aim([0.3, 0.1, 3])
        self.assertEqual((aimed.pan, aimed.tilt), tuple(aimed))

    def test_head_camera(self):
        for (pan, tilt), point, spot in zip(self.pan_tilt, self.xyz, self.spots):
            head = self.model.head_camera(pan, tilt)
            self.assertClose(head.project(point), spot, atol=1e-8)
        self.assertEqual(self.model.head_camera(0, 0).size, (720, 576))

    def test_encoders_and_axes_are_passed_on(self):
        turned = dataclasses.replace(self.model, pan_zero=0.1, pan_scale=1.1, tilt_zero=-0.05)
        pan, tilt = turned.aim([0.3, 0.1, 3])
        true = self.model.aim([0.3, 0.1, 3])
        self.assertClose((1.1 * pan + 0.1, tilt - 0.05), true, atol=1e-9)
        offset = dataclasses.replace(self.model, axis_pan_x=0.02, axis_tilt_z=0.03)
        self.assertGreater(np.linalg.norm(offset.head_camera(0.3, 0.2).centre), 1e-3)

    def test_values_compare(self):
        self.assertEqual(self.model, rig_model())
        self.assertNotEqual(self.model, rig_model(laser_vx=0.0))

    def test_errors(self):
        self.spots[17] = (self.model.cx - 30, self.model.cy)
        with self.fails("BEHIND_CAMERA", index=17):
            self.model.locate(self.pan_tilt, self.spots)
        self.spots[9] = np.inf
        with self.fails("NOT_FINITE", index=9):
            self.model.locate(self.pan_tilt, self.spots)
        with self.fails("UNREACHABLE"):
            self.model.aim([0, 0, 0.01])
        with self.fails("NOT_FINITE"):
            self.model.aim([0, np.nan, 3])
        with self.fails("INVALID_ARGUMENT"):
            rig_model(laser_x0=0.0, laser_y0=0.0).aim([0, 0, 3])
        with self.assertRaisesRegex(ValueError, r"spots must be of shape \(50, 2\)"):
            self.model.locate(self.pan_tilt, self.spots[:-1])
        with self.assertRaisesRegex(ValueError, "spot_covariance"):
            self.model.locate(self.pan_tilt, self.spots, np.eye(3))
        with self.assertRaisesRegex(ValueError, "symmetric"):
            self.model.locate(self.pan_tilt, self.spots, [[1, 0.5], [0, 1]])
        with self.assertRaisesRegex(ValueError, "xyz must be 3 numbers"):
            self.model.aim([1, 2])


if __name__ == "__main__":
    unittest.main()
