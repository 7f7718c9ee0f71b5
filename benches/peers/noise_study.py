"""The thesis's noise study (section VII, eqs (22), (23)) in NumPy, twice: as a port of the Matlab code
does it, and as fast as NumPy can. Head camera at the origin; lengths in metres."""

import numpy as np

import ptzcal

LEVELS = np.linspace(0.0, 2.0, 6)
TRIALS = 100
HEAD = np.array([[800.0, 0, 360], [0, 800.0, 288], [0, 0, 1]])
FIXED = np.array([[842.46, 0, 398.11], [0, 889.62, 314.21], [0, 0, 1]])
TURN = np.array([0.01, -0.02, 0.012])
SHIFT = np.array([0.1568, -0.04997, -0.01664])
_UPPER = np.triu_indices(4)


def _rotation(w):
    angle = np.linalg.norm(w)
    k = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]) / angle
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


ROTATION = _rotation(TURN)
CENTRE = -ROTATION.T @ SHIFT


def fixed_camera() -> ptzcal.Camera:
    k = FIXED
    return ptzcal.Camera(800, 600, k[0, 0], k[1, 1], k[0, 2], k[1, 2], R=ROTATION, t=SHIFT)


def _seen(rng, n, k, width, height):
    """Points of a camera's frame, all over its image."""
    pixels = np.c_[rng.uniform((20, 20), (width - 20, height - 20), (n, 2)), np.ones(n)]
    return pixels @ np.linalg.inv(k).T * rng.uniform(1.5, 5.0, (n, 1))


def data(n: int = 2021, seed: int = 21):
    """Points that the fixed camera sees, and the head camera's: (points, control)."""
    rng = np.random.default_rng(seed)
    fixed = (_seen(rng, n, FIXED, 800, 600) - SHIFT) @ ROTATION
    return fixed, _seen(rng, n, HEAD, 720, 576)


def _pixels(k, x):
    q = x @ k.T
    return q[:, :2] / q[:, 2:]


def _hartley(x):
    c = x.mean(0)
    s = np.sqrt(x.shape[1]) / np.linalg.norm(x - c, axis=1).mean()
    t = np.eye(x.shape[1] + 1)
    t[:-1, :-1] *= s
    t[:-1, -1] = -s * c
    return (x - c) * s, t


def _dlt(x, m):
    """Rotation and translation by DLT-Points, null vector by SVD."""
    xn, u = _hartley(x)
    mn, t = _hartley(m)
    n = len(x)
    h = np.c_[xn, np.ones(n)]
    a = np.zeros((2 * n, 12))
    a[0::2, :4] = a[1::2, 4:8] = h
    a[0::2, 8:], a[1::2, 8:] = -mn[:, :1] * h, -mn[:, 1:] * h
    p = np.linalg.inv(t) @ np.linalg.svd(a, full_matrices=False)[2][-1].reshape(3, 4) @ u
    return _pose((p * np.sign(np.linalg.det(p[:, :3])))[None])


def _pose(p):
    """Rotations, translations and centres of projection matrices with positive determinants."""
    q, r = np.linalg.qr(np.linalg.inv(p[:, :, :3]))
    signs = np.sign(np.einsum("nii->ni", r))
    rotation = np.swapaxes(q * signs[:, None, :], 1, 2)
    centre = -np.linalg.solve(p[:, :, :3], p[:, :, 3:])[..., 0]
    return rotation, -np.einsum("nij,nj->ni", rotation, centre), centre


def by_svd(points, control, levels=LEVELS, trials=TRIALS, seed=77):
    """Mean position error of every cell, each trial with its SVDs; (head, fixed)."""
    rng = np.random.default_rng(seed)
    m1, m2 = _pixels(HEAD, control), _pixels(FIXED, points @ ROTATION.T + SHIFT)
    means = np.empty((len(levels), len(levels)))
    for i, a in enumerate(levels):
        for j, b in enumerate(levels):
            errors = np.empty(trials)
            for k in range(trials):
                r, t, _ = _dlt(control, m1 + a * rng.standard_normal(m1.shape))
                moved = points @ r[0].T + t[0]
                _, _, centre = _dlt(moved, m2 + b * rng.standard_normal(m2.shape))
                errors[k] = np.linalg.norm(centre[0] - CENTRE)
            means[i, j] = errors.mean()
    return means


def _prepared(x):
    xn, u = _hartley(x)
    h = np.c_[xn, np.ones(len(x))]
    return h[:, _UPPER[0]] * h[:, _UPPER[1]], u


def _symmetric(v):
    s = np.empty(v.shape[:-1] + (4, 4))
    s[..., _UPPER[0], _UPPER[1]] = v
    s[..., _UPPER[1], _UPPER[0]] = v
    return s


def _batch(prepared, m):
    """All trials at once: the products of the fixed points are formed once, three matrix products give the
    normal matrices, one batched eigendecomposition the answers."""
    products, space = prepared
    u, v = m[..., 0], m[..., 1]
    cu, cv = u.mean(1), v.mean(1)
    du, dv = u - cu[:, None], v - cv[:, None]
    w = du * du + dv * dv
    s = np.sqrt(2) / np.sqrt(w).mean(1)
    s0, su = _symmetric(products.sum(0)), _symmetric((du @ products) * s[:, None])
    sv, sw = _symmetric((dv @ products) * s[:, None]), _symmetric((w @ products) * (s * s)[:, None])
    a = np.zeros((len(m), 12, 12))
    a[:, :4, :4] = a[:, 4:8, 4:8] = s0
    a[:, :4, 8:] = a[:, 8:, :4] = -su
    a[:, 4:8, 8:] = a[:, 8:, 4:8] = -sv
    a[:, 8:, 8:] = sw
    p = np.linalg.eigh(a)[1][:, :, 0].reshape(-1, 3, 4)
    image = np.zeros((len(m), 3, 3))
    image[:, 0, 0] = image[:, 1, 1] = 1 / s
    image[:, 0, 2], image[:, 1, 2], image[:, 2, 2] = cu, cv, 1
    p = image @ p @ space
    return _pose(p * np.sign(np.linalg.det(p[:, :, :3]))[:, None, None])


def batched(points, control, levels=LEVELS, trials=TRIALS, seed=77):
    """The same as by_svd: under the rigid motion the normalised DLT of the points moves along."""
    rng = np.random.default_rng(seed)
    m1, m2 = _pixels(HEAD, control), _pixels(FIXED, points @ ROTATION.T + SHIFT)
    head, fixed = _prepared(control), _prepared(points)
    means = np.empty((len(levels), len(levels)))
    for i, a in enumerate(levels):
        for j, b in enumerate(levels):
            r, t, _ = _batch(head, m1 + a * rng.standard_normal((trials, *m1.shape)))
            _, _, centre = _batch(fixed, m2 + b * rng.standard_normal((trials, *m2.shape)))
            moved = np.einsum("nij,nj->ni", r, centre) + t
            means[i, j] = np.linalg.norm(moved - CENTRE, axis=1).mean()
    return means


def set_up(points, control) -> ptzcal.SetUp:
    """Ours of the same data."""
    model = ptzcal.RigModel(
        width=720, height=576, fx=800.0, fy=800.0, cx=360.0, cy=288.0,
        laser_x0=0.1, laser_y0=0.005, laser_vx=-0.005, laser_vy=0.003,
    )  # fmt: skip
    made = ptzcal.Site(model, fixed_camera()).set_up(points)
    made.set_control(control)
    return made


def ours(made: ptzcal.SetUp, draws: str, threads: int = 1):
    """The library's study as (head, fixed) means."""
    grid = [(a, b) for a in LEVELS for b in LEVELS]
    method = "dlt_cascade_printed"
    study = made.study(grid, methods=[method], trials=TRIALS, draws=draws, threads=threads)
    means = [study.cell(method, i).mean[0] for i in range(len(grid))]
    return np.reshape(means, (len(LEVELS), len(LEVELS)))
