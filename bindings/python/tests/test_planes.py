import unittest

import numpy as np

import ptzcal
from support import TestCase, rig_model, rotation

#: Corners of a room, a cupboard, a table, a pillar and a crate, metres; y down.
ROOM = ((-3, -1.5, -2), (3, 1.1, 2.4))
FURNITURE = (
    ((-3, -0.7, 1.4), (-1.8, 1.1, 2.4)),
    ((1.2, 0.3, -2), (2.4, 1.1, -1.2)),
    ((2.5, -1.5, 1.7), (3, 1.1, 2.4)),
    ((-2.6, 0.6, -1.8), (-1.9, 1.1, -1.1)),
)
EXACT = {"sigma": 0.005, "flatness": 0.0}


def scan(R, centre, furniture=FURNITURE, n=15000, seed=0):
    """What a station sees whose axes are the columns of R in the room's frame."""
    rng = np.random.default_rng(seed)
    rays = rng.normal(size=(n, 3))
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    world = rays @ R.T

    def slabs(box):
        a, b = ((np.array(corner) - centre) / world for corner in box)
        return np.minimum(a, b).max(1), np.maximum(a, b).min(1)

    ranges = slabs(ROOM)[1]
    for box in furniture:
        near, far = slabs(box)
        ranges = np.where((near < far) & (near > 0), np.minimum(ranges, near), ranges)
    return rays * (ranges + 0.005 * rng.normal(size=n))[:, None]


RA, CA = rotation(0.02, 0.3, -0.03), np.array([-0.6, 0.1, -0.3])
RB, CB = rotation(-0.03, -0.9, 0.02), np.array([0.5, -0.1, 0.6])
R, T = RA.T @ RB, RA.T @ (CB - CA)


class FoundPlanes(TestCase):
    def test_a_room(self):
        points = scan(np.eye(3), np.zeros(3))
        points[7] = np.nan
        planes = ptzcal.Planes.find(points, **EXACT)
        labels = planes.labels
        self.assertEqual((len(labels), labels.dtype, labels[7]), (len(points), np.int32, -1))
        self.assertGreaterEqual(len(planes), 6)
        for i, plane in enumerate(planes):
            self.assertEqual(plane.count, np.count_nonzero(labels == i))
            self.assertClose(plane.n @ plane.centre, 1.0, atol=1e-9)
            off = points[labels == i] @ plane.normal - plane.distance
            self.assertClose(np.sqrt(np.mean(off**2)), plane.rms, atol=1e-9)
        floor = max(planes, key=lambda p: p.normal[1])
        self.assertClose(floor.distance, 1.1, atol=2e-3)
        self.assertEqual(planes[-1].count, planes[len(planes) - 1].count)
        self.assertEqual(planes.sigma, 0.005)
        with self.assertRaises(IndexError):
            planes[len(planes)]

    def test_regions(self):
        points = scan(np.eye(3), np.zeros(3))
        regions = np.where(points[:, 1] > 1.08, 0, np.where(points[:, 1] < -1.48, 1, -1))
        floor, ceiling = ptzcal.Planes.fit(points, regions, **EXACT)
        self.assertClose([floor.distance, ceiling.distance], [1.1, 1.5], atol=2e-3)
        for bad in (regions[:-1], regions.astype(float), regions[:, None]):
            with self.assertRaises(ValueError):
                ptzcal.Planes.fit(points, bad)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.Planes.fit(points, np.full(len(points), -1))
        with self.assertRaises(ptzcal.Error) as caught:
            ptzcal.Planes.fit(points, np.where(np.arange(len(points)) < 3, 1, 0), **EXACT)
        self.assertEqual(caught.exception.status, ptzcal.Status.NO_CONSENSUS)

    def test_shots_and_depths(self):
        model = rig_model()
        rng = np.random.default_rng(2)
        pan_tilt = rng.uniform((-0.3, -0.2), (0.3, 0.2), (200, 2))
        spots = np.tile([[model.cx, model.cy]], (200, 1)) + rng.normal(0, 0.2, (200, 2))
        spots[:, 0] += model.fx * (model.laser_x0 / 4 + model.laser_vx)
        spots[:, 1] += model.fy * (model.laser_y0 / 4 + model.laser_vy)
        with self.assertRaises(ptzcal.Error):  # a part of a sphere
            ptzcal.Planes.find_shots(model, pan_tilt, spots, 1e-6 * np.eye(2), flatness=0.0)
        with self.assertRaises(ptzcal.Error):
            ptzcal.Planes.fit_shots(model, pan_tilt[:2], spots[:2], [0, 0])
        y = (np.arange(60) - 29.5) / 70
        depths = np.tile(np.where(y > 0.25, 0.5 / np.maximum(y, 0.25), 2.0)[:, None], (1, 80))
        camera = ptzcal.Camera(80, 60, 70, 70, 39.5, 29.5)
        planes = ptzcal.Planes.find_depths(ptzcal.DepthMap(depths), camera)
        self.assertEqual(sorted(round(p.distance, 3) for p in planes), [0.5, 2.0])
        self.assertEqual(planes.labels.reshape(60, 80)[0, 0], planes.labels[79])

    def test_nothing_to_find(self):
        clutter = np.random.default_rng(1).uniform(-2, 2, (3000, 3))
        with self.assertRaises(ptzcal.PlanesNotFound):
            ptzcal.Planes.find(clutter, sigma=0.01)
        for points in ([], np.zeros((5, 3)), np.full((100, 3), np.nan)):
            with self.assertRaises(ptzcal.Error):
                ptzcal.Planes.find(points)
        with self.assertRaises(TypeError):
            ptzcal.Planes.find(clutter, flatnes=0.1)
        with self.assertRaises(ValueError):
            ptzcal.Planes.find(clutter, min_points=-1)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.Planes.find(clutter, threshold=np.nan)


class Stations(TestCase):
    def test_a_furnished_room(self):
        a = ptzcal.Planes.find(scan(RA, CA), **EXACT)
        b = ptzcal.Planes.find(scan(RB, CB, seed=1), **EXACT)
        pose = ptzcal.register_stations(a, b)
        self.assertClose(pose.R, R, atol=2e-3)
        self.assertClose(pose.t, T, atol=2e-3)
        self.assertClose(pose.transform(np.zeros(3)), pose.t)
        self.assertClose(pose.covariance, pose.covariance.T)
        self.assertEqual(pose.degrees_of_freedom, 3 * len(pose.matches) - 6)
        named = ptzcal.register_matched_planes(a, b, pose.matches)
        self.assertClose(named.t, pose.t, atol=1e-9)
        edges = ptzcal.common_roof_edges(a, b, pose.matches)
        thesis = ptzcal.estimate_pose_roof_edges(*edges)
        self.assertClose(thesis.t, T, atol=1e-2)
        for bad in ([[0.5, 1]], [0, 1], [[-1, 0]]):
            with self.assertRaises(ValueError):
                ptzcal.register_matched_planes(a, b, bad)
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.register_matched_planes(a, b, [[0, 99]] * 3)

    def test_an_empty_room_needs_a_prior(self):
        a = ptzcal.Planes.find(scan(RA, CA, ()), **EXACT)
        b = ptzcal.Planes.find(scan(RB, CB, (), seed=1), **EXACT)
        with self.assertRaises(ptzcal.StationsAmbiguous):
            ptzcal.register_stations(a, b)
        pose = ptzcal.register_stations(a, b, prior=(R @ rotation(0.1, 0.2, 0), T + 0.2))
        self.assertClose(pose.t, T, atol=2e-3)
        with self.assertRaises(ptzcal.StationsNotMatched):
            ptzcal.register_stations(a, b, prior=(R, T + 9))
        with self.assertRaises(ValueError):
            ptzcal.register_stations(a, b, prior=(R, T[:2]))
        with self.assertRaises(ptzcal.InvalidArgument):
            ptzcal.register_stations(a, b, max_angle=2.0)

    def test_what_is_free_is_told(self):
        points = scan(np.eye(3), np.zeros(3), ())
        planes = ptzcal.Planes.find(points[abs(points[:, 1] + 0.2) > 1.28], **EXACT)
        with self.assertRaises(ptzcal.Error) as caught:
            ptzcal.register_stations(planes, planes)
        self.assertEqual(caught.exception.status, ptzcal.Status.DEGENERATE)
        self.assertIn("rotation about (0.000, 1.000, 0.000)", str(caught.exception))


if __name__ == "__main__":
    unittest.main()
