import unittest

import numpy as np

import ptzcal
from support import TestCase, head_rotation, rig_model, rotation

#: Three planes through a corner of a room, normal . X = distance, and the edges between them.
PLANES = [((0.1, 0.0, 1.0), 4.0), ((1.0, 0.05, 0.1), 1.8), ((0.0, 1.0, 0.02), 1.2)]
EDGES = [(0, 1), (0, 2), (1, 2)]
R, T = rotation(0.05, 0.6, -0.1), np.array([0.9, 0.05, 0.3])


def planes_in(station):
    """The planes in the frame of station a, or of station b at X_a = R X_b + T."""
    for normal, distance in PLANES:
        normal = np.array(normal) / np.linalg.norm(normal)
        yield (normal, distance) if station == "a" else (R.T @ normal, distance - normal @ T)


def points_on(normal, distance, n=60, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    u = np.linalg.svd(normal[None])[2][1:]
    points = distance * normal + rng.uniform(-1, 1, (n, 2)) @ u
    return points + noise * rng.normal(size=(n, 1)) * normal


def station(name, add):
    edges = ptzcal.RoofEdges()
    numbers = [add(edges, normal, distance) for normal, distance in planes_in(name)]
    assert numbers == [0, 1, 2]
    for edge in EDGES:
        edges.add_edge(*edge)
    return edges


class Poses(TestCase):
    def assertPose(self, pose, atol):
        self.assertClose(pose.R, R, atol=atol)
        self.assertClose(pose.t, T, atol=atol)
        angle = np.arccos((np.trace(R) - 1) / 2)
        self.assertClose(pose.rotation_angle, angle, atol=atol)

    def test_known_planes(self):
        def exact(edges, normal, distance):
            return edges.add_plane(normal, distance)

        def known(edges, normal, distance):
            return edges.add_plane(normal, distance, 1e-6 * np.eye(3))

        for method in ptzcal.PoseMethod:
            add = known if method == ptzcal.PoseMethod.MAXIMUM_LIKELIHOOD else exact
            with self.subTest(method.name):
                a, b = station("a", add), station("b", add)
                pose = ptzcal.estimate_pose_roof_edges(a, b, method=method)
                self.assertPose(pose, 1e-9)
                self.assertEqual(pose.covariance.shape, (6, 6))
                self.assertClose(pose.transform([0, 0, 0]), T, atol=1e-9)

    def test_planes_of_points(self):
        def add(edges, normal, distance):
            return edges.add_plane_points(points_on(normal, distance, noise=0.002), 0.002)

        a, b = station("a", add), station("b", add)
        for method in ("roof_edge_procrustes", "plane_to_plane", "maximum_likelihood"):
            with self.subTest(method):
                pose = ptzcal.estimate_pose_roof_edges(a, b, method=method, lever=2.0)
                self.assertPose(pose, 0.02)
                sigma = np.sqrt(np.diagonal(pose.covariance))
                self.assertTrue((np.abs(pose.t - T) < 6 * sigma[3:]).all())

    def test_planes_of_shots(self):
        model = rig_model()

        def add(edges, normal, distance):
            rng = np.random.default_rng(4)
            towards = np.linalg.lstsq(normal[None], [distance], rcond=None)[0]
            pan, tilt = model.aim(towards + 0.3 * np.array([0, 0, 1.0]) * (abs(normal[2]) < 0.5))
            readings = (pan, tilt) + rng.uniform(-0.1, 0.1, (80, 2))
            spots = []
            for reading in readings:
                turn = head_rotation(*reading)
                start = turn @ (model.laser_x0, model.laser_y0, 0.0)
                slope = turn @ (model.laser_vx, model.laser_vy, 1.0)
                Z = (distance - normal @ start) / (normal @ slope)
                assert Z > 0
                spots.append(
                    (
                        model.fx * (model.laser_x0 / Z + model.laser_vx) + model.cx,
                        model.fy * (model.laser_y0 / Z + model.laser_vy) + model.cy,
                    )
                )
            return edges.add_plane_shots(model, readings, spots, 0.0025 * np.eye(2))

        pose = ptzcal.estimate_pose_roof_edges(station("a", add), station("b", add))
        self.assertPose(pose, 1e-6)

    def test_refusals(self):
        def add(edges, normal, distance):
            return edges.add_plane(normal, distance)

        a, b = station("a", add), ptzcal.RoofEdges()
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.estimate_pose_roof_edges(a, b)
        b.add_plane([0, 0, 1], 4)
        b.add_plane([0, 0.01, 1], 5)
        for _ in EDGES:
            b.add_edge(0, 1)
        with self.fails("DEGENERATE"):
            ptzcal.estimate_pose_roof_edges(b, b)
        with self.fails("INVALID_ARGUMENT"):
            b.add_edge(0, 7)
        with self.fails("DEGENERATE"):
            b.add_plane([0, 0, 1], 0.0)
        with self.fails("NOT_FINITE"):
            b.add_plane([0, 0, np.nan], 1.0)
        with self.fails("TOO_FEW_POINTS"):
            b.add_plane_points([[0, 0, 1], [1, 0, 1]])
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.estimate_pose_roof_edges(a, a, lever=-1)
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.estimate_pose_roof_edges(a, a, min_edge_angle=9)

    def test_wrong_arguments(self):
        edges = ptzcal.RoofEdges()
        with self.assertRaisesRegex(ValueError, "normal must be 3 numbers"):
            edges.add_plane([1, 2], 3)
        with self.assertRaisesRegex(ValueError, "covariance"):
            edges.add_plane([1, 2, 3], 3, np.eye(2))
        with self.assertRaisesRegex(ValueError, "plane_to_plane"):
            ptzcal.estimate_pose_roof_edges(edges, edges, method="guess")
        with self.assertRaises(ValueError):
            edges.add_edge(-1, 0)


if __name__ == "__main__":
    unittest.main()
