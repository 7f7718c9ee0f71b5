import unittest

import numpy as np

import ptzcal
from support import TestCase, rig_model, rotation
from test_planes import EXACT, FURNITURE, ROOM, scan

#: Centres, and turns about the vertical.
PATH = (((-0.6, 0, -0.3), 0.2), ((-0.1, 0.05, 0.1), 0.5), ((0.4, 0, 0.6), -0.2))
NOISE = 0.05


def walls_hit(origins, rays):
    """Where rays (n, 3) from origins (n, 3) meet the room, in lengths of theirs."""
    with np.errstate(divide="ignore"):
        slabs = [[(np.array(c) - origins) / rays for c in box] for box in (ROOM, *FURNITURE)]
    depth = np.maximum(*slabs[0]).min(1)
    for a, b in slabs[1:]:
        near, far = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
        depth = np.where((near < far) & (near > 0), np.minimum(depth, near), depth)
    return depth


def survey(n=1800, poses=(True,)):
    """Shots all around from every station of the path, of which the first is known."""
    model = rig_model()
    rng = np.random.default_rng(4)
    result = ptzcal.Adjustment(model)
    for k, (centre, turn) in enumerate(PATH):
        R = rotation(0.0, turn, 0.0)
        if k < len(poses):
            result.add_station(R, np.array(centre, float))
        else:
            result.add_station()
        i = np.arange(n)
        pan = np.remainder(2.39996323 * i, 2 * np.pi) - np.pi
        pan_tilt = np.c_[pan, np.arcsin(0.9 * (2 * (i + 0.5) / n - 1))]
        spots = lambda depth: np.c_[
            model.cx + model.fx * (model.laser_x0 / depth + model.laser_vx),
            model.cy + model.fy * (model.laser_y0 / depth + model.laser_vy),
        ]
        near, far = (model.locate(pan_tilt, spots(np.full(n, d)))[0] @ R.T + centre for d in (1.0, 2.0))
        depth = walls_hit(2 * near - far, far - near)
        seen = spots(depth) + rng.normal(0, NOISE, (n, 2))
        result.add_shots(k, pan_tilt, seen, spot_covariance=NOISE**2 * np.eye(2))
    return result


class Ties(TestCase):
    def test_a_path(self):
        adjustment = survey()
        heard = []
        ties = ptzcal.tie_stations(
            adjustment, planes={"flatness": 1e-3}, progress=lambda *steps: heard.append(steps)
        )
        self.assertEqual(heard, [(i, 6) for i in range(7)])
        self.assertEqual([link.stations for link in ties.links], [(0, 1), (0, 2), (1, 2)])
        linked = [link for link in ties.links if link.pose is not None]
        self.assertGreaterEqual(len(linked), 2)
        self.assertEqual(len(ties.loops), len(linked) - 2)
        for link in ties.links:
            self.assertEqual(link.pose is None, bool(link.reason))
            self.assertEqual(link.pose is None, link.status != ptzcal.Status.OK)
        for loop in ties.loops:
            self.assertEqual(sorted(loop.stations), [0, 1, 2])
            self.assertGreater(loop.probability, 1e-4)
            self.assertLess(loop.position, 0.05)
        self.assertGreater(ties.shots, 2700)
        result = adjustment.solve()
        self.assertEqual(len(result.planes), ties.planes)
        for (centre, turn), station in zip(PATH, result.stations):
            self.assertClose(station.t, centre, atol=0.01)
            self.assertClose(station.R, rotation(0, turn, 0), atol=5e-3)

    def test_refusals(self):
        adjustment = survey(n=400)
        for bad in ([[0.5, 1]], [0, 1], [[-1, 0]]):
            with self.assertRaises(ValueError):
                ptzcal.tie_stations(adjustment, pairs=bad)
        for bad in ([[0, 3]], [[1, 1]], [[0, 1], [1, 0]]):
            with self.assertRaises(ptzcal.InvalidArgument):
                ptzcal.tie_stations(adjustment, pairs=bad)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.tie_stations(adjustment, min_closure=2.0)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.tie_stations(adjustment, max_angle=9.0)
        with self.assertRaises(TypeError):
            ptzcal.tie_stations(adjustment, planes={"flatnes": 0.1})
        with self.assertRaises(ptzcal.Error) as caught:
            ptzcal.tie_stations(adjustment, pairs=[])
        self.assertEqual(caught.exception.status, ptzcal.Status.BAD_STATE)
        self.assertIn("station 1", str(caught.exception))
        with self.assertRaises(ptzcal.Cancelled):
            ptzcal.tie_stations(adjustment, progress=lambda done, total: True)
        cancel = ptzcal.Cancel()
        cancel.request()
        with self.assertRaises(ptzcal.Cancelled):
            ptzcal.tie_stations(adjustment, cancel=cancel)

        class Stop(Exception):
            pass

        def raises(done, total):
            raise Stop

        with self.assertRaises(Stop):
            ptzcal.tie_stations(adjustment, progress=raises)


class Regions(TestCase):
    def test_boxes_and_rays(self):
        points = scan(np.eye(3), np.zeros(3))
        boxes = [[(-3.1, 1.05, -2.1), (3.1, 1.15, 2.5)], [(-3.1, -1.55, -2.1), (3.1, -1.45, 2.5)]]
        floor, ceiling = ptzcal.Planes.fit(points, boxes, **EXACT)
        self.assertClose([floor.distance, ceiling.distance], [1.1, 1.5], atol=2e-3)
        planes = ptzcal.Planes.find(points, along_rays=True, **EXACT)
        self.assertClose(max(planes, key=lambda p: p.normal[1]).noise_factor, 1.0, atol=0.1)
        with self.assertRaises(ValueError):
            ptzcal.Planes.fit(points, np.zeros((2, 3, 2)))
        with self.assertRaises(TypeError):
            ptzcal.Planes.fit(points, np.full((1, 2, 3), "x"))
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.Planes.fit(points, np.zeros((1, 2, 3)))
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.Planes.find(points, along_rays=True)

    def test_a_scan(self):
        with ptzcal.Rig.open("sim:room") as rig:
            made = rig.scan_region(ptzcal.Region(-0.45, 0.25, -0.33, 0.28, 12, 8))
        planes = ptzcal.Planes.find_scan(made)
        self.assertEqual(len(planes.labels), len(made))
        # Where the largest plane was hit: by place, and by readings.
        self.assertGreater((planes.labels == 0).sum(), 6)
        box = np.array([planes[0].centre - 0.8, planes[0].centre + 0.8])
        (inside,) = ptzcal.Planes.fit_scan(made, [box], min_points=4)
        self.assertGreater(inside.count, 3)
        with self.assertRaises(ptzcal.Error):
            ptzcal.Planes.fit_scan(made, [[9, 10, 0, 1]])
        for bad in ([[0, 1, 0]], box):
            with self.assertRaises(ValueError):
                ptzcal.Planes.fit_scan(made, bad)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.Planes.fit_scan(made, [[1, 0, 0, 1]])


if __name__ == "__main__":
    unittest.main()
