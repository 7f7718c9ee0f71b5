import tempfile
import unittest
from pathlib import Path

import numpy as np

import ptzcal
from ptzcal import CameraFormat, NamedCamera, Status
from support import TestCase, camera, room_points

FORMATS = [f for f in CameraFormat if f is not CameraFormat.AUTO]


def square(lens=()):
    """A camera without skew, which no format of others holds."""
    c = camera(lens)
    return ptzcal.Camera.from_matrix(c.K * [[1, 0, 1], [0, 1, 1], [0, 0, 1]], c.size, lens, c.R, c.t)


class CameraFiles(TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def refused(self, status, function, *arguments):
        with self.assertRaises(ptzcal.Error) as caught:
            function(*arguments)
        self.assertEqual(caught.exception.status, status)
        return str(caught.exception)

    def test_every_format(self):
        c, xyz = square((-0.2, 0.06, 0.001, -0.0008)), room_points(50)
        for format in FORMATS:
            with self.subTest(format):
                path = self.folder / format.name
                ptzcal.write_cameras(path, c, format)
                for told in (CameraFormat.AUTO, format, format.name):
                    [found] = ptzcal.read_cameras(path, told)
                    self.assertEqual(found.has_pose, format is not CameraFormat.ROS)
                    if format not in (CameraFormat.ROS, CameraFormat.KALIBR):
                        off = np.abs(found.camera.project(xyz) - c.project(xyz)).max()
                        self.assertLess(off, 1e-9)
                self.assertEqual(ptzcal.read_camera(path).size, c.size)

    def test_lists(self):
        cameras = [NamedCamera(square(), "gate"), NamedCamera(square((-0.1, 0, 0, 0)), "yard")]
        for format in (CameraFormat.COLMAP, CameraFormat.KALIBR):
            path = self.folder / format.name
            ptzcal.write_cameras(path, cameras, format)
            self.assertEqual([c.name for c in ptzcal.read_cameras(path)], ["gate", "yard"])
            self.refused(Status.AMBIGUOUS, ptzcal.read_camera, path)
        path = self.folder / "two.xml"
        self.refused(Status.INVALID_ARGUMENT, ptzcal.write_cameras, path, cameras)
        self.refused(Status.INVALID_ARGUMENT, ptzcal.write_cameras, path, [])

    def test_refusals(self):
        self.refused(Status.UNSUPPORTED, ptzcal.write_cameras, self.folder / "c.xml", camera())
        path = self.folder / "c.yaml"
        path.write_text("image_width: 640\nimage_height: tall\ncamera_matrix: 1\n")
        message = self.refused(Status.FILE_FORMAT, ptzcal.read_camera, path)
        self.assertIn("line 2: image_height", message)
        self.refused(Status.FILE_IO, ptzcal.read_camera, self.folder / "none")
        with self.assertRaises(ValueError):
            ptzcal.read_camera(path, "spherical")

    def test_tables(self):
        c, xyz = square(), room_points(40)
        points, again = ptzcal.Correspondences(*c.size), ptzcal.Correspondences(*c.size)
        points.add_points(xyz, c.project(xyz), uv_covariance=np.eye(2) / 3)
        path = self.folder / "points.csv"
        points.save_csv(path)
        self.assertEqual((again.add_csv(path), len(again)), (40, 40))
        (self.folder / "bad.csv").write_text("x,y,z,u,v\n1,2,3,4,wide\n")
        message = self.refused(Status.FILE_FORMAT, again.add_csv, self.folder / "bad.csv")
        self.assertIn("line 2: v: 'wide'", message)

    def test_solved_again(self):
        c, xyz = square(), room_points(60)
        points = ptzcal.Correspondences(*c.size)
        points.add_points(xyz, c.project(xyz) + np.random.default_rng(3).normal(0, 0.3, (60, 2)))
        first = ptzcal.calibrate_camera(points, seed=5, skew_sigma=float("inf"))
        path = self.folder / "camera.json"
        first.save(path)
        second = ptzcal.Calibration.solved_again(path)
        self.assertEqual(first.covariance.tobytes(), second.covariance.tobytes())
        self.assertEqual(first.camera.K.tobytes(), second.camera.K.tobytes())
        self.assertEqual(first.residuals.tobytes(), second.residuals.tobytes())
        c.save(path)
        self.refused(Status.NOT_FOUND, ptzcal.Calibration.solved_again, path)


if __name__ == "__main__":
    unittest.main()
