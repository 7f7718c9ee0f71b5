import importlib.util
import unittest

import numpy as np

import ptzcal
from support import TestCase

HAS_MATPLOTLIB = importlib.util.find_spec("matplotlib") is not None


@unittest.skipUnless(HAS_MATPLOTLIB, "matplotlib is not installed")
class Plots(TestCase):
    @classmethod
    def setUpClass(cls):
        import matplotlib

        matplotlib.use("Agg")
        from ptzcal import plots

        cls.plots = plots

    def tearDown(self):
        from matplotlib import pyplot

        pyplot.close("all")

    def test_residuals_are_drawn_where_they_are(self):
        rng = np.random.default_rng(1)
        camera = ptzcal.Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
        xyz = rng.uniform([-1, -1, 3], [1, 1, 6], (200, 3))
        uv = camera.project(xyz) + rng.normal(scale=0.3, size=(200, 2))
        uv[:5] += 40
        points = ptzcal.Correspondences(640, 480)
        points.add_points(xyz, uv)
        result = ptzcal.calibrate_camera(points)
        ax = self.plots.residuals(result, uv, factor=10, picture=np.zeros((480, 640), np.uint8))
        (quiver,) = [c for c in ax.collections if hasattr(c, "U")]
        self.assertEqual(len(quiver.U), result.inlier_count)
        self.assertClose(quiver.U, 10 * result.residuals[result.inliers][:, 0], atol=1e-9)
        self.assertEqual(len(ax.lines[0].get_xdata()), 200 - result.inlier_count)
        with self.assertRaises(ValueError):
            self.plots.residuals(result, uv[:10])

    def test_a_view_from_above(self):
        camera = ptzcal.Camera(640, 480, 320.0, 320.0, 319.5, 239.5)
        ax = self.plots.from_above({"gate": camera}, [[0, 0, 4], [1, 0, 4]], reach=2.0)
        x, z = ax.lines[1].get_data()
        # Half of the image is one focal length wide: 45 degrees.
        self.assertClose([x[0], z[0], x[1], z[1], x[2]], [-2**0.5, 2**0.5, 0, 0, 2**0.5], atol=1e-9)

    def test_an_ellipse_holds_what_it_says(self):
        ax = self.plots.error_ellipse((10, 20), [[4, 0], [0, 1]])
        (patch,) = ax.patches
        # 95 % of two Gaussian numbers: 2.4477 standard deviations.
        self.assertClose([patch.width, patch.height], [4 * 2.4477, 2 * 2.4477], atol=1e-3)

    def test_a_scan(self):
        with ptzcal.Rig.open("sim:room") as rig:
            result = rig.scan_region(ptzcal.Region(-0.2, 0.2, -0.1, 0.1, 4, 3), ["sim:fixed/0"])
        ax = self.plots.scan(result)
        lost, seen = (len(line.get_xdata()) for line in ax.lines)
        self.assertEqual((lost + seen, seen), (len(result), result.found))


if __name__ == "__main__":
    unittest.main()
