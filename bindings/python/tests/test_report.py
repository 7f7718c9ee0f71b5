import re
import tempfile
import unittest
from html.parser import HTMLParser
from pathlib import Path

import numpy as np

import ptzcal
from support import TestCase, rig_model
from test_boards import TILTS, views

#: Elements without an end.
VOID = {"meta"}


class Nesting(HTMLParser):
    """Every element that begins ends, in order."""

    def __init__(self):
        super().__init__()
        self.open, self.text = [], []

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag

    def handle_data(self, data):
        self.text.append(data)


class Reports(TestCase):
    def test_a_camera_from_boards(self):
        boards = views(rig_model())
        report = ptzcal.Report("Head")
        report.add_board_calibration("head", ptzcal.calibrate_from_boards(boards), boards)
        parser = Nesting()
        parser.feed(report.html)
        self.assertEqual(parser.open, [])
        self.assertIn(f"{len(TILTS)} of {len(TILTS)} views were used", " ".join(parser.text))
        self.assertNotIn("nan", report.html.lower())
        others = ptzcal.Boards(640, 480)
        with self.assertRaisesRegex(ptzcal.Error, "0 corners in 0 views"):
            report.add_board_calibration("head", ptzcal.calibrate_from_boards(boards), others)

    def test_a_camera_with_its_picture(self):
        rng = np.random.default_rng(1)
        camera = ptzcal.Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
        xyz = rng.uniform([-1, -1, 3], [1, 1, 6], (300, 3))
        uv = camera.project(xyz) + rng.normal(scale=0.3, size=(300, 2))
        points = ptzcal.Correspondences(640, 480)
        points.add_points(xyz, uv)
        result = ptzcal.calibrate_camera(points)
        report = ptzcal.Report("Gate & <hall>", up=(0, -1, 0))
        report.add_note("Nothing was left out.")
        picture = np.zeros((480, 640, 3), np.uint8)
        report.add_calibration("gate", result, points, picture, format="rgb24")
        html = report.html
        parser = Nesting()
        parser.feed(html)
        self.assertEqual(parser.open, [])
        text = " ".join(parser.text)
        self.assertIn("Gate & <hall>", text)
        self.assertIn("300 of 300 measurements were used", text)
        # What is written is what was found.
        fx = float(re.search(r"focal length x</td><td class=\"n\">([\d.]+)", html)[1])
        self.assertClose(fx, result.camera.fx, atol=0.01 * 500)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "report.html"
            report.save(path)
            self.assertEqual(path.read_text(), html)
        self.assertEqual(report._repr_html_(), html)

    def test_what_does_not_belong_is_refused(self):
        points = ptzcal.Correspondences(640, 480)
        rng = np.random.default_rng(2)
        xyz = rng.uniform([-1, -1, 3], [1, 1, 6], (50, 3))
        camera = ptzcal.Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
        points.add_points(xyz, camera.project(xyz) + rng.normal(scale=0.3, size=(50, 2)))
        result = ptzcal.calibrate_camera(points)
        report = ptzcal.Report("x")
        with self.fails("INVALID_ARGUMENT"):
            report.add_calibration("x", result, ptzcal.Correspondences(640, 480))
        with self.fails("INVALID_ARGUMENT"):
            report.add_calibration("x", result, points, np.zeros((8, 8), np.uint8))
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.Report("x", up=(0, 0, 0))


if __name__ == "__main__":
    unittest.main()
