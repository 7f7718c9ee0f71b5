"""Inputs that nobody tuned to, from fixed seeds, with their truth. Metres, pixels."""

import numpy as np

import ptzcal

#: A fixed camera of 800 x 600 pixels in a room.
WIDTH, HEIGHT = 800, 600


def camera() -> ptzcal.Camera:
    a, b = 0.06, -0.04
    turn_y = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    turn_x = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    return ptzcal.Camera(
        WIDTH, HEIGHT, 845.2, 845.9, 405.1, 296.3, R=turn_y @ turn_x, t=(0.15, -0.05, 0.1)
    )


def points(n: int, seed: int = 1, noise: float = 0.5):
    """n points of the room and where they are seen."""
    rng = np.random.default_rng(seed)
    xyz = rng.uniform([-1.2, -0.9, 1.8], [1.2, 0.9, 5.0], (n, 3))
    return xyz, camera().project(xyz) + rng.normal(0, noise, (n, 2))


def with_outliers(n: int, share: float, seed: int = 2):
    """The same with gross errors anywhere in the image; and which are right."""
    xyz, uv = points(n)
    rng = np.random.default_rng(seed)
    wrong = rng.permutation(n)[: round(share * n)]
    uv[wrong] = rng.uniform((0, 0), (WIDTH, HEIGHT), (len(wrong), 2))
    right = np.ones(n, bool)
    right[wrong] = False
    return xyz, uv, right


def spot_frames(width: int, height: int, colour: bool, seed: int = 3):
    """On, off, and the spot's centre: shading, noise of 2 grey levels, a spot, a weaker reflection."""
    rng = np.random.default_rng(seed)
    x, y = np.arange(width, dtype=float)[None, :], np.arange(height, dtype=float)[:, None]
    shading = 60 + 25 * np.sin(x / 97) * np.cos(y / 71) + 20 * x / width
    centre = 0.61 * width + 0.37, 0.43 * height + 0.71

    def bump(cx, cy, sigma, peak):
        return peak * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * sigma**2))

    light = bump(*centre, 2.2, 120) + bump(0.2 * width, 0.7 * height, 1.2, 50)
    # Blue, green, red: a red laser, which the other channels see too.
    gains = [(0.9, 0.45), (1.0, 0.6), (1.1, 1.0)] if colour else [(1.0, 1.0)]
    frames = []
    for lit in (1.0, 0.0):
        channels = [
            shading * ambient + lit * light * laser + rng.normal(0, 2, shading.shape)
            for ambient, laser in gains
        ]
        frame = np.clip(np.rint(np.stack(channels, axis=2)), 0, 255).astype(np.uint8)
        frames.append(np.ascontiguousarray(frame if colour else frame[..., 0]))
    return frames[0], frames[1], np.array(centre)


def small_spots(n: int, seed: int = 4):
    """n on/off pairs of 48 x 48 pixels with a spot at a place between pixels; and the places."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:48, :48].astype(float)
    centres = rng.uniform(20, 28, (n, 2))
    pairs = []
    for cx, cy in centres:
        spot = 120 * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * 2.2**2))
        frames = [80 + light + rng.normal(0, 2, x.shape) for light in (spot, 0)]
        pairs.append([np.clip(np.rint(f), 0, 255).astype(np.uint8) for f in frames])
    return pairs, centres


def rig() -> ptzcal.RigModel:
    return ptzcal.RigModel(
        720,
        576,
        800.0,
        800.0,
        360.0,
        288.0,
        laser_x0=0.095,
        laser_y0=0.012,
        laser_vx=0.012,
        laser_vy=-0.008,
    )


def targets(n: int, seed: int = 5):
    return np.random.default_rng(seed).uniform([-1.5, -1.0, 1.5], [1.5, 1.0, 5.0], (n, 3))
