import dataclasses
import threading
import unittest

import numpy as np

import ptzcal
from support import TestCase

SIZE = (160, 120)


def lens(model="brown_conrady", coefficients=(-0.25, 0.06), f=130.0):
    R = np.array([[0.96, 0, 0.28], [0, 1, 0], [-0.28, 0, 0.96]])
    return ptzcal.Camera(*SIZE, f, f, 80.5, 58.0, 0, model, coefficients, R, (0.1, 0.2, 0.3))


def image(channels=1):
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    grey = 128 + 60 * np.sin(x / 9.0) + 50 * np.cos(y / 7.0)
    planes = [grey, 255 - grey, grey / 2, grey / 3][:channels]
    return np.squeeze(np.stack(planes, axis=-1)).astype(np.uint8)


def sampled(camera, ideal, array):
    """By NumPy: every pixel through both cameras, then bilinear; and where it is inside."""
    x, y = np.meshgrid(np.arange(ideal.width, dtype=float), np.arange(ideal.height, dtype=float))
    uv = np.stack([x.ravel(), y.ravel()], axis=1)
    u, v = camera.project(camera.centre + ideal.back_project(uv)).T.reshape(2, *x.shape)
    inside = (u >= 0) & (v >= 0) & (u < SIZE[0] - 1) & (v < SIZE[1] - 1)
    u, v = np.where(inside, u, 0), np.where(inside, v, 0)
    i, j = u.astype(int), v.astype(int)
    a, b = u - i, v - j
    if array.ndim == 3:
        a, b = a[..., None], b[..., None]
    p = array.astype(float)
    above = p[j, i] * (1 - a) + p[j, i + 1] * a
    below = p[j + 1, i] * (1 - a) + p[j + 1, i + 1] * a
    return above * (1 - b) + below * b, inside


class Undistorting(TestCase):
    def test_pictures_are_the_ideal_cameras(self):
        lenses = [
            lens(),
            lens("division", (-0.2,)),
            lens("fisheye", (-0.01, 0.02, -0.01, 0.003)),
            lens("radial1", (-0.1,)),
        ]
        for camera in lenses:
            for keep in (0.0, 0.5, 1.0):
                undistorter = ptzcal.Undistorter(camera, keep=keep)
                self.assertEqual(undistorter.camera.distortion_model, ptzcal.DistortionModel.NONE)
                for channels in (1, 3, 4):
                    array = image(channels)
                    picture = undistorter.apply(array)
                    self.assertEqual((picture.shape, picture.dtype), (array.shape, np.uint8))
                    wanted, inside = sampled(camera, undistorter.camera, array)
                    self.assertLess(np.abs(picture - wanted)[inside].max(), 1.0)
                self.assertGreater(inside.mean(), 0.6)

    def test_any_view(self):
        camera = lens()
        plain = ptzcal.undistorted_camera(camera)
        turn = np.array([[1, 0, 0], [0, 0.96, 0.28], [0, -0.28, 0.96]])
        turned = dataclasses.replace(plain, width=90, height=70, fx=300, fy=300, R=turn @ camera.R)
        undistorter = ptzcal.Undistorter(camera, turned)
        self.assertClose(undistorter.camera.centre, camera.centre)
        picture = undistorter.apply(image(), border=7)
        wanted, inside = sampled(camera, undistorter.camera, image())
        self.assertLess(np.abs(picture - wanted)[inside].max(), 1.0)
        self.assertTrue(0 < inside.mean() < 1)
        self.assertEqual(picture[~inside].min(), 7)

    def test_where_the_picture_goes(self):
        undistorter = ptzcal.Undistorter(lens(), keep=1.0)
        array = image(3)
        picture = undistorter.apply(array, border=(1, 2, 3))
        self.assertEqual(picture[0, 80].tolist(), [1, 2, 3])
        part = undistorter.apply(array, region=(30, 20, 50, 40), border=(1, 2, 3))
        self.assertTrue((part == picture[20:60, 30:80]).all())
        frame = np.full((120, 200, 3), 99, np.uint8)
        self.assertIs(undistorter.apply(array, out=frame[::-1, :160], border=(1, 2, 3)).base, frame)
        self.assertTrue((frame[::-1, :160] == picture).all())
        self.assertTrue((frame[:, 160:] == 99).all())
        # From rows that are apart and bottom-up.
        padded = np.zeros((120, 170, 3), np.uint8)
        padded[::-1, :160] = array
        self.assertTrue((undistorter.apply(padded[::-1, :160], border=(1, 2, 3)) == picture).all())
        rgb = undistorter.apply(array, format="rgb24", border=(1, 2, 3))
        self.assertTrue((rgb == picture).all())

    def test_threads_share_it(self):
        undistorter = ptzcal.Undistorter(lens())
        pictures = [np.zeros((120, 160), np.uint8) for _ in range(4)]
        threads = [
            threading.Thread(target=undistorter.apply, args=(image(),), kwargs={"out": out})
            for out in pictures
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        wanted = undistorter.apply(image())
        self.assertTrue(all((picture == wanted).all() for picture in pictures))

    def test_what_is_refused(self):
        camera = lens()
        for keep in (-0.1, 1.1):
            with self.assertRaises(ptzcal.InvalidArgument):
                ptzcal.undistorted_camera(camera, keep)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.Undistorter(camera, camera)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.Undistorter(lens("fisheye", (), 40.0), keep=1.0)
        with self.assertRaises(ptzcal.Error) as caught:
            ptzcal.undistorted_camera(lens(coefficients=(-1.5,)), 1.0)
        self.assertEqual(caught.exception.status, ptzcal.Status.LENS_NOT_MONOTONE)
        undistorter = ptzcal.Undistorter(camera)
        with self.assertRaises(ptzcal.InvalidArgument):
            undistorter.apply(np.zeros((120, 161), np.uint8))
        with self.assertRaises(ptzcal.InvalidArgument):
            undistorter.apply(image(), region=(100, 0, 100, 10))
        with self.assertRaises(ptzcal.InvalidArgument):
            undistorter.apply(image(), region=(0, 0, 10, 0))
        with self.assertRaises(ptzcal.Error) as caught:
            undistorter.apply(np.zeros((180, 160), np.uint8), format="nv12")
        self.assertEqual(caught.exception.status, ptzcal.Status.UNSUPPORTED)
        array = image()
        with self.assertRaises(ptzcal.InvalidArgument):
            undistorter.apply(array, out=array)
        for out, error in [
            (np.zeros((120, 160)), TypeError),
            (np.zeros((120, 161), np.uint8), ValueError),
            (np.zeros((120, 160, 1), np.uint8), ValueError),
            (np.zeros((120, 320), np.uint8)[:, ::2], ValueError),
        ]:
            with self.assertRaises(error):
                undistorter.apply(array, out=out)


if __name__ == "__main__":
    unittest.main()
