import tempfile
import unittest
from pathlib import Path

import numpy as np

import ptzcal
from support import TestCase

SQUARE = np.array([[-1, -1, 3], [1, -1, 3], [1, 1, 3], [-1, 1, 3]], float)
FACES = [[0, 2, 1], [0, 3, 2]]


def camera():
    return ptzcal.Camera(64, 48, 40.0, 40.0, 32.0, 24.0)


def sample():
    rng = np.random.default_rng(1)
    rays = rng.normal(size=(100, 3))
    covariance = 1e-4 * rays[:, :, None] * rays[:, None, :]
    rgb = rng.integers(0, 256, (100, 3), np.uint8)
    return ptzcal.Cloud(rays, rgb=rgb, covariance=covariance), rays, rgb, covariance


class Clouds(TestCase):
    def test_arrays_in_and_out(self):
        cloud, xyz, rgb, covariance = sample()
        self.assertEqual((len(cloud), cloud.noise), (100, ptzcal.CloudNoise.COVARIANCES))
        self.assertTrue(np.array_equal(cloud.xyz, xyz) and np.array_equal(cloud.rgb, rgb))
        self.assertClose(cloud.covariances, covariance, atol=1e-18)
        self.assertClose(cloud.deviations, 1e-2 * np.linalg.norm(xyz, axis=1), atol=1e-15)
        self.assertIsNone(cloud.normals)
        empty = ptzcal.Cloud()
        self.assertEqual((len(empty), empty.xyz.shape, empty.covariances), (0, (0, 3), None))

    def test_a_pose_carries_its_covariance(self):
        cloud, xyz, _, covariance = sample()
        R, t = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), np.array([1, 2, 3.0])
        S = np.diag([1e-6] * 3 + [1e-4, 0, 0])
        cloud.transform(R, t, S)
        turned = xyz @ R.T
        self.assertClose(cloud.xyz, turned + t, atol=1e-12)
        x, y, z = turned[0]
        J = np.hstack([-np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.eye(3)])
        self.assertClose(cloud.covariances[0], R @ covariance[0] @ R.T + J @ S @ J.T, atol=1e-15)
        with self.fails("INVALID_ARGUMENT"):
            cloud.transform(2 * R, t)

    def test_merge_thin_crop(self):
        cloud, xyz, _, _ = sample()
        cloud.merge(sample()[0])
        cloud.thin(1e-3)
        self.assertEqual(len(cloud), 100)
        cloud.crop([0, 0, 0], [9, 9, 9])
        self.assertEqual(len(cloud), (xyz > 0).all(axis=1).sum())
        with self.fails("INVALID_ARGUMENT"):
            cloud.merge(ptzcal.Cloud(xyz))
        cloud.strip()
        cloud.merge(ptzcal.Cloud(xyz))
        with self.fails("INVALID_ARGUMENT"):
            cloud.thin(0.0)

    def test_files(self):
        cloud, xyz, rgb, covariance = sample()
        with tempfile.TemporaryDirectory() as folder:
            for ending in ("ply", "pcd", "glb", "wrl"):
                path = Path(folder, "cloud." + ending)
                cloud.save(path)
                back = ptzcal.Cloud.load(path)
                self.assertClose(back.xyz, xyz, atol=1e-6)
                self.assertTrue(np.array_equal(back.rgb, rgb))
                if ending != "wrl":
                    self.assertClose(back.covariances, covariance, atol=1e-9)
            path = Path(folder, "holes.pcd")
            path.write_text(
                "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nDATA ascii\nnan nan nan\n1 2 3\n"
            )
            back = ptzcal.Cloud.load(path)
            self.assertEqual((len(back), back.skipped), (1, 1))
            path.write_text(path.read_text() + "4 5 6\n")
            with self.fails("FILE_FORMAT"):
                ptzcal.Cloud.load(path)
            with self.fails("UNSUPPORTED"):
                cloud.save(Path(folder, "cloud.xyz"))
            with self.fails("FILE_IO"):
                ptzcal.Cloud.load(Path(folder, "none.ply"))

    def test_bad_arrays(self):
        with self.assertRaises(ValueError):
            ptzcal.Cloud([[1, 2]])
        with self.assertRaises(ValueError):
            ptzcal.Cloud(SQUARE, rgb=np.zeros((4, 3)))
        with self.assertRaises(ValueError):
            ptzcal.Cloud(SQUARE, covariance=np.zeros((3, 3, 3)))
        with self.fails("NOT_FINITE"):
            ptzcal.Cloud([[1, 2, np.nan]])


class Meshes(TestCase):
    def test_what_a_camera_sees(self):
        mesh = ptzcal.Mesh(ptzcal.Cloud(SQUARE, covariance=1e-4 * np.eye(3)), FACES)
        depth = mesh.depth_map(camera())
        metres, variances = depth.metres, depth.variances
        self.assertAlmostEqual(metres[24, 32], 3.0, places=6)
        self.assertEqual(metres[0, 0], 0.0)
        self.assertClose(variances[24, 32], 0.5e-4, atol=1e-9)
        self.assertIsNone(ptzcal.DepthMap(metres).variances)
        surface = ptzcal.Mesh.from_depth(depth, camera())
        self.assertEqual(len(surface.vertices), depth.known)
        self.assertClose(surface.vertices.normals[:, 2], -1.0, atol=1e-3)
        self.assertEqual(len(ptzcal.Cloud.from_depth(depth, camera())), depth.known)
        self.assertEqual(ptzcal.Cloud(SQUARE).depth_map(camera()).known, 4)
        with tempfile.TemporaryDirectory() as folder:
            depth.save(Path(folder, "depth.png"))
            again = ptzcal.DepthMap.read(Path(folder, "depth.png")).metres
        self.assertClose(again, metres, atol=5e-4)

    def test_a_picture_on_it(self):
        mesh = ptzcal.Mesh(ptzcal.Cloud(SQUARE), FACES)
        image = np.arange(48 * 64, dtype=np.uint32).astype(np.uint8).reshape(48, 64)
        self.assertEqual(mesh.texture(), 0)
        mesh.add_picture(image, camera())
        self.assertEqual((mesh.texture(), mesh.textures), (2, 1))
        with tempfile.TemporaryDirectory() as folder:
            for ending, textures in (("glb", 1), ("wrl", 1), ("ply", 0)):
                path = Path(folder, "mesh." + ending)
                mesh.save(path)
                back = ptzcal.Mesh.load(path)
                self.assertEqual(back.textures, textures)
                self.assertEqual(back.triangles.tolist(), FACES)
            with self.fails("UNSUPPORTED"):
                mesh.save(Path(folder, "mesh.pcd"))
        with self.fails("INVALID_ARGUMENT"):
            mesh.add_picture(image[:-1], camera())

    def test_bad_triangles(self):
        with self.assertRaises(ValueError):
            ptzcal.Mesh(ptzcal.Cloud(SQUARE), [[0, 1, 4]])
        with self.assertRaises(ValueError):
            ptzcal.Mesh(ptzcal.Cloud(SQUARE), [[0, 1, -1]])
        self.assertEqual(len(ptzcal.Mesh(ptzcal.Cloud(SQUARE), []).triangles), 0)

    def test_a_scan(self):
        with ptzcal.Rig.open("sim:room") as rig:
            scan = rig.scan_region(ptzcal.Region(-0.1, 0.1, -0.05, 0.05, 6, 4))
        cloud = ptzcal.Cloud.from_scan(scan)
        self.assertClose(cloud.xyz, scan.points, atol=0)
        mesh = ptzcal.Mesh.from_scan(scan)
        self.assertEqual(len(mesh.vertices), len(cloud))
        self.assertGreater(len(mesh.triangles), 20)
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Mesh.from_scan(scan, max_incidence=2.0)


if __name__ == "__main__":
    unittest.main()
