"""A survey of a laser rig and many cameras, and its joint adjustment by SciPy's sparse least squares.

The rig: laser line x0 y0 vx vy; head focal length (ln), cx, cy; axis offsets tilt y z, pan x z;
pan scale, tilt zero, tilt scale. Every camera: fx fy cx cy, a small turn about its start, its centre.
Every shot: an inverse depth. Priors as Gaussian residuals.
"""

from dataclasses import dataclass

import numpy as np

WIDTH, HEIGHT, SIGMA = 800, 600, 0.3
RIG = np.array([0.1, 0.005, -0.005, 0.003, np.log(800.0), 360.0, 288.0, 0.004, 0.012, -0.003, 0.01, 1.0, 0.0, 1.0])
RIG_SIGMA = np.array([1e-4, 1e-4, 1e-4, 1e-4, 5e-4, 0.5, 0.5, 0.05, 0.05, 0.05, 0.05, 0.01, 0.02, 0.01])
#: Places of these fourteen among the library's fifteen parameters; the pan's zero is the frame's.
RIG_PLACES = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 13, 14]
ASPECT_SIGMA = 1e-3


@dataclass
class Survey:
    pan: np.ndarray
    tilt: np.ndarray
    head: np.ndarray
    #: Per sighting: shot, camera, pixel.
    shot: np.ndarray
    camera: np.ndarray
    uv: np.ndarray
    #: Per camera: fx fy cx cy, rotation (world to camera), centre.
    intrinsics: np.ndarray
    rotations: np.ndarray
    centres: np.ndarray
    rho: np.ndarray


def rotation(axis: int, angle: np.ndarray) -> np.ndarray:
    """Rotations about x (0) or y (1), n x 3 x 3."""
    c, s, o, z = np.cos(angle), np.sin(angle), np.ones_like(angle), np.zeros_like(angle)
    rows = [o, z, z, z, c, -s, z, s, c] if axis == 0 else [c, z, s, z, o, z, -s, z, c]
    return np.stack(rows, -1).reshape(*angle.shape, 3, 3)


def rays(rig, pan, tilt):
    """Origin and direction of the laser for every reading: point = o + d / rho."""
    x0, y0, vx, vy = rig[:4]
    at, ap = np.array([0, rig[7], rig[8]]), np.array([rig[9], 0, rig[10]])
    turn_pan, turn_tilt = rotation(1, rig[11] * pan), rotation(0, rig[13] * tilt + rig[12])
    origin = np.einsum("nij,nj->ni", turn_pan, turn_tilt @ (np.array([x0, y0, 0]) + at) + ap) - at - ap
    return origin, np.einsum("nij,nj->ni", turn_pan, turn_tilt @ np.array([vx, vy, 1.0]))


def spots(rig, rho):
    """Image of the laser's point in the head camera."""
    focal = np.exp(rig[4])
    return focal * (rig[2:4] + np.outer(rho, rig[:2])) + rig[5:7]


def project(intrinsics, rotations, centres, xyz, weight):
    """Pixels of homogeneous points, one camera each."""
    x = np.einsum("nij,nj->ni", rotations, xyz - centres * weight[:, None])
    return intrinsics[:, :2] * x[:, :2] / x[:, 2:] + intrinsics[:, 2:]


def look_at(centre, target):
    z = (target - centre) / np.linalg.norm(target - centre)
    x = np.cross([0, 1.0, 0], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def survey(shots: int, cameras: int, seed: int = 6) -> Survey:
    rng = np.random.default_rng(seed)
    intrinsics = np.tile([845.0, 844.6, 400.0, 300.0], (cameras, 1))
    intrinsics += rng.normal(0, [40, 0.3, 8, 8], (cameras, 4)) * [1, 0, 1, 1]
    intrinsics[:, 1] = intrinsics[:, 0] * (1 + rng.normal(0, 5e-4, cameras))
    centres = rng.uniform([-1.6, -1.0, -0.5], [1.6, 0.6, 0.8], (cameras, 3))
    rotations = np.stack([look_at(c, np.array([0.1, 0.1, 3.0])) for c in centres])
    pan, tilt = rng.uniform(-0.35, 0.35, shots), rng.uniform(-0.3, 0.3, shots)
    rho = 1 / rng.uniform(1.8, 5.0, shots)
    origin, direction = rays(RIG, pan, tilt)
    xyz = origin * rho[:, None] + direction
    shot, camera = (a.ravel() for a in np.meshgrid(np.arange(shots), np.arange(cameras), indexing="ij"))
    uv = project(intrinsics[camera], rotations[camera], centres[camera], xyz[shot], rho[shot])
    seen = ((uv > 0) & (uv < [WIDTH, HEIGHT])).all(1)
    shot, camera, uv = shot[seen], camera[seen], uv[seen]
    head = spots(RIG, rho) + rng.normal(0, SIGMA, (shots, 2))
    return Survey(
        pan, tilt, head, shot, camera, uv + rng.normal(0, SIGMA, uv.shape), intrinsics, rotations, centres, rho
    )


def turned(rotations, w):
    """exp([w]x) R for small turns, by Rodrigues' formula."""
    angle = np.linalg.norm(w, axis=1) + 1e-300
    zero = np.zeros(len(w))
    k = np.stack([zero, -w[:, 2], w[:, 1], w[:, 2], zero, -w[:, 0], -w[:, 1], w[:, 0], zero], 1).reshape(-1, 3, 3)
    a, b = (np.sin(angle) / angle)[:, None, None], ((1 - np.cos(angle)) / angle**2)[:, None, None]
    return (np.eye(3) + a * k + b * (k @ k)) @ rotations


def scipy_adjustment(s: Survey, start_rotations, start):
    """The problem for scipy.optimize.least_squares: residuals, start, sparsity of the Jacobian."""
    import scipy.sparse

    cameras, shots, n = len(s.intrinsics), len(s.pan), len(RIG)
    first_rho = n + 10 * cameras

    def residuals(p):
        rig, c, rho = p[:n], p[n:first_rho].reshape(cameras, 10), p[first_rho:]
        origin, direction = rays(rig, s.pan, s.tilt)
        xyz = origin * rho[:, None] + direction
        rotations = turned(start_rotations, c[:, 4:7])
        uv = project(c[s.camera, :4], rotations[s.camera], c[s.camera, 7:], xyz[s.shot], rho[s.shot])
        return np.concatenate(
            [
                ((spots(rig, rho) - s.head) / SIGMA).ravel(),
                ((uv - s.uv) / SIGMA).ravel(),
                (rig - start[:n]) / RIG_SIGMA,
                (c[:, 0] / c[:, 1] - 1) / ASPECT_SIGMA,
            ]
        )

    sparsity = scipy.sparse.lil_matrix((2 * shots + 2 * len(s.shot) + n + cameras, first_rho + shots), dtype=int)
    rows = np.arange(2 * shots)
    sparsity[:, :n] = 0
    sparsity[np.repeat(rows, 7), np.tile(np.arange(7), len(rows))] = 1
    sparsity[rows, first_rho + rows // 2] = 1
    rows = 2 * shots + np.arange(2 * len(s.shot))
    sparsity[np.repeat(rows, n), np.tile(np.arange(n), len(rows))] = 1
    sparsity[rows, first_rho + np.repeat(s.shot, 2)] = 1
    columns = n + 10 * np.repeat(s.camera, 2)[:, None] + np.arange(10)
    sparsity[np.repeat(rows, 10), columns.ravel()] = 1
    rows = 2 * shots + 2 * len(s.shot)
    sparsity[rows + np.arange(n), np.arange(n)] = 1
    for i in (0, 1):
        sparsity[rows + n + np.arange(cameras), n + 10 * np.arange(cameras) + i] = 1
    return residuals, sparsity.tocsr()
