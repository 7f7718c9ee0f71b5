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


def nv12(bgr):
    """Luma (BT.601) over interleaved chroma of half the size; (height * 3 / 2, width)."""
    height, width = bgr.shape[:2]
    b, g, r = np.moveaxis(bgr.astype(float), 2, 0)
    luma = 0.299 * r + 0.587 * g + 0.114 * b

    def halved(plane):
        return plane.reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3))

    u, v = 128 + 0.564 * halved(b - luma), 128 + 0.713 * halved(r - luma)
    chroma = np.stack([u, v], axis=2).reshape(height // 2, width)
    return np.clip(np.rint(np.concatenate([luma, chroma])), 0, 255).astype(np.uint8)


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


def chessboard(width: int, height: int, turn, columns: int = 14, rows: int = 10, seed: int = 6):
    """A board of columns x rows inner corners in perspective, and its corners.

    turn: rotation about x, y and z, radians. Edges are exact to a third of a pixel before a blur of
    one pixel; noise of 3 grey levels.
    """
    (cx, cy, cz), (sx, sy, sz) = np.cos(turn), np.sin(turn)
    R = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    R = R @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    R = R @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    f, place = 0.9 * width, np.array([0.0, 0.0, 1.7 * (columns + 1)])
    H = np.diag([f, f, 1.0]) @ np.c_[R[:, :2], place]
    H = np.array([[1, 0, width / 2], [0, 1, height / 2], [0, 0, 1]]) @ H
    # From squares, counted from the board's corner; from there to the middles of a pixel's thirds.
    H = H @ np.array([[1, 0, -(columns + 1) / 2], [0, 1, -(rows + 1) / 2], [0, 0, 1]])
    fine = (np.arange(3 * n) + 0.5 for n in (width, height))
    u, v = np.meshgrid(*(t / 3 for t in fine))
    a, b, w = np.tensordot(np.linalg.inv(H), np.stack([u, v, np.ones_like(u)]), 1)
    a, b = a / w, b / w

    def wave(t):
        near, (down, across) = np.rint(t), np.gradient(t)
        ramp = np.clip(2 * (t - near) / np.hypot(down, across), -1, 1)
        return np.where(near % 2 == 0, ramp, -ramp)

    def on(margin):
        return (abs(a - (columns + 1) / 2) < (columns + 1) / 2 + margin) & (
            abs(b - (rows + 1) / 2) < (rows + 1) / 2 + margin
        )

    level = np.where(on(0), 125 - 100 * wave(a) * wave(b), np.where(on(1), 225.0, 120.0))
    kernel = np.exp(-0.5 * (np.arange(-12, 13) / 3) ** 2)
    for axis in (0, 1):
        level = _filter(level, kernel / kernel.sum(), axis)
    level = level.reshape(height, 3, width, 3).mean(axis=(1, 3)) + 15 * np.linspace(-1, 1, width)
    level += np.random.default_rng(seed).normal(0, 3, level.shape)
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    corners = H @ np.stack([i.ravel() + 1, j.ravel() + 1, np.ones(columns * rows)])
    return np.clip(np.rint(level), 0, 255).astype(np.uint8), (corners[:2] / corners[2]).T - 0.5


def board_views(views: int, columns: int, rows: int, seed: int = 12, noise: float = 0.2):
    """A camera with a lens, and corners of boards of 30 mm squares: (board_xy, uv of each view)."""
    rng = np.random.default_rng(seed)
    lens = (-0.28, 0.1, 1e-3, -5e-4, 0.0)
    truth = ptzcal.Camera(WIDTH, HEIGHT, 700.0, 702.0, 395.0, 305.0, 0.0, "brown_conrady", lens)
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    board = 0.03 * np.c_[i.ravel() - (columns - 1) / 2, j.ravel() - (rows - 1) / 2]
    seen = []
    while len(seen) < views:
        x, y, z = rng.uniform((-0.6, -0.6, -0.3), (0.6, 0.6, 0.3))
        (cx, sx), (cy, sy), (cz, sz) = ((np.cos(a), np.sin(a)) for a in (x, y, z))
        turn = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
        turn = turn @ [[1, 0, 0], [0, cx, -sx], [0, sx, cx]]
        at = rng.uniform((-0.12, -0.09, 0.5), (0.12, 0.09, 1.0)) * np.sqrt(columns / 9)
        uv = truth.project(np.c_[board, np.zeros(len(board))] @ turn.T + at)
        if (uv > 0).all() and (uv < (WIDTH, HEIGHT)).all():
            seen.append(uv + rng.normal(0, noise, uv.shape))
    return truth, board, seen


def _filter(image, kernel, axis):
    reach = len(kernel) // 2
    padded = np.pad(image, [(reach, reach) if k == axis else (0, 0) for k in (0, 1)], mode="edge")
    n = image.shape[axis]
    return sum(weight * padded.take(range(k, k + n), axis) for k, weight in enumerate(kernel))


def rectangles(width: int, height: int, n: int = 600, seed: int = 7):
    """A picture of n rectangles, one over the other, with noise: many corners and no chessboard."""
    rng = np.random.default_rng(seed)
    picture = np.full((height, width), 120.0)
    for x, y, w, h, level in rng.uniform(0, 1, (n, 5)):
        x, y = int(x * width), int(y * height)
        picture[y : y + 4 + int(0.15 * h * height), x : x + 4 + int(0.15 * w * width)] = 255 * level
    return np.clip(picture + rng.normal(0, 3, picture.shape), 0, 255).astype(np.uint8)


def line_picture(width: int, height: int, seed: int = 9):
    """Forty turned bright rectangles with soft sides and noise; the sides' ends, (160, 2, 2)."""
    rng = np.random.default_rng(seed)
    picture = np.full((height, width), 70.0)
    columns, rows = 8, 5
    w, h = width // columns, height // rows
    x, y = np.meshgrid(np.arange(w, dtype=float), np.arange(h, dtype=float))
    sides = []
    for i in range(columns * rows):
        corner = np.array([(i % columns) * w, (i // columns) * h], float)
        centre = np.array([w, h]) / 2 + rng.uniform(-2, 2, 2)
        half = np.array([0.3, 0.25]) * min(w, h) * rng.uniform(0.8, 1.1, 2)
        turn = rng.uniform(0, np.pi)
        axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        inside = np.ones_like(x)
        for axis, reach in zip(axes, half):
            d = axis[0] * (x - centre[0]) + axis[1] * (y - centre[1])
            # Any even ramp is half bright on the side; this one is about a pixel wide.
            inside *= 1 / (1 + np.exp(-1.7 * (d + reach))) - 1 / (1 + np.exp(-1.7 * (d - reach)))
        block = np.s_[int(corner[1]) : int(corner[1]) + h, int(corner[0]) : int(corner[0]) + w]
        picture[block] += rng.uniform(50, 120) * inside
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)] * half @ axes + centre + corner
        sides += [np.stack([corners[k], corners[(k + 1) % 4]]) for k in range(4)]
    noisy = picture + rng.normal(0, 2, picture.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8), np.array(sides)


def dead_leaves(width: int, height: int, seed: int = 10):
    """Discs of all sizes, one over the other: the statistics of natural images (Lee, Mumford 2001)."""
    rng = np.random.default_rng(seed)
    picture = np.full((height, width), 120.0, np.float32)
    n = width * height // 2500
    # Radii with density r^-3.
    radii = 8 / np.sqrt(rng.uniform((8 / 150) ** 2, 1, n))
    for r, x, y, level in np.c_[radii, rng.uniform((0, 0, 20), (width, height, 235), (n, 3))]:
        left, top = max(int(x - r), 0), max(int(y - r), 0)
        box = picture[top : int(y + r) + 2, left : int(x + r) + 2]
        down, across = np.ogrid[top : top + box.shape[0], left : left + box.shape[1]]
        box[(across - x) ** 2 + (down - y) ** 2 < r * r] = level
    return picture


def _sampled(picture, x, y):
    """Bilinear."""
    x, y = np.clip(x, 0, picture.shape[1] - 1.001), np.clip(y, 0, picture.shape[0] - 1.001)
    i, j = y.astype(int), x.astype(int)
    fy, fx = y - i, x - j
    upper = picture[i, j] * (1 - fx) + picture[i, j + 1] * fx
    return upper * (1 - fy) + (picture[i + 1, j] * (1 - fx) + picture[i + 1, j + 1] * fx) * fy


def warped_pair(width: int, height: int, seed: int = 11):
    """Two views of a picture, turned by 7 degrees, 0.93 as large and a little tilted, and the homography.

    Pixels are means of four samples; blur of 0.7 pixels, noise of 2 grey levels, other light.
    """
    picture = dead_leaves(2 * width + 400, 2 * height + 400, seed)
    kernel = np.exp(-0.5 * (np.arange(-5, 6) / 1.4) ** 2)
    for axis in (0, 1):
        picture = _filter(picture, kernel / kernel.sum(), axis)
    c, s = 0.93 * np.cos(0.12), 0.93 * np.sin(0.12)
    middle = np.array([[1, 0, width / 2], [0, 1, height / 2], [0, 0, 1]])
    tilted = np.array([[c, -s, 6], [s, c, -4], [0.04 / width, -0.03 / height, 1]])
    H = middle @ tilted @ np.linalg.inv(middle)
    rng = np.random.default_rng(seed)
    views = []
    for warp, gain, offset in ((np.eye(3), 1.0, 0.0), (np.linalg.inv(H), 0.95, 6.0)):
        level = np.zeros((height, width))
        for dx, dy in ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)):
            u, v = np.meshgrid(np.arange(width) + dx, np.arange(height) + dy)
            x, y, w = np.tensordot(warp, np.stack([u, v, np.ones_like(u)]), 1)
            level += _sampled(picture, 2 * x / w + 200, 2 * y / w + 200) / 4
        level = gain * level + offset + rng.normal(0, 2, level.shape)
        views.append(np.clip(np.rint(level), 0, 255).astype(np.uint8))
    return views[0], views[1], H


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
