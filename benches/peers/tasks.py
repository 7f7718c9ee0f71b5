"""The tasks: ours, the peers as a competent user calls them, and whether the results are right."""

import tempfile
from dataclasses import dataclass
from typing import Any, Callable, Iterator, Optional

import numpy as np

import joint
import noise_study
import ptzcal
import scenes

try:
    import cv2
except ImportError:
    cv2 = None
try:
    import open3d
except ImportError:
    open3d = None
try:
    import plyfile
except ImportError:
    plyfile = None
try:
    import scipy.linalg
    import scipy.optimize
except ImportError:
    scipy = None

#: Difference above which the usual recipe takes a pixel for the laser's.
THRESHOLD = 30


@dataclass
class Task:
    """A comparison. The errors are of the results against the truth, in `unit`."""

    task: str
    size: str
    peer: str
    ours: Callable[[], Any]
    theirs: Optional[Callable[[], Any]]
    ours_error: Callable[[Any], float]
    peer_error: Callable[[Any], float]
    unit: str
    #: Greatest error that passes for right, of ours and of the peer.
    bound: float
    #: The calls are divided by this: loops over several inputs.
    divide: int = 1
    #: Of ours; the peer has one.
    threads: int = 1


def _with(library: Any, function: Callable[[], Any]) -> Optional[Callable[[], Any]]:
    return None if library is None else function


# ---- the laser's spot ---------------------------------------------------------------------------


def _difference(on, off):
    if on.ndim == 3:
        on, off = cv2.cvtColor(on, cv2.COLOR_BGR2GRAY), cv2.cvtColor(off, cv2.COLOR_BGR2GRAY)
    return cv2.absdiff(on, off)


def _largest(on, off):
    """Difference, threshold, components: the largest one."""
    difference = _difference(on, off)
    _, mask = cv2.threshold(difference, THRESHOLD, 255, cv2.THRESH_BINARY)
    _, labels, stats, centroids = cv2.connectedComponentsWithStats(mask, connectivity=8)
    return difference, labels, stats, centroids, 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())


def usual_recipe(on, off):
    """The mean of the largest component's pixels, weighted by the difference."""
    difference, labels, stats, _, largest = _largest(on, off)
    x, y, w, h = stats[largest, :4]
    box = np.s_[y : y + h, x : x + w]
    m = cv2.moments(difference[box] * (labels[box] == largest))
    return np.array([x + m["m10"] / m["m00"], y + m["m01"] / m["m00"]])


def mean_of_mask(on, off):
    """The mean of the largest component's pixels."""
    _, _, _, centroids, largest = _largest(on, off)
    return centroids[largest]


def barest_recipe(on, off):
    """The brightest pixel of the difference, and the weighted mean of a window about it."""
    difference = cv2.subtract(on, off)
    if difference.ndim == 3:
        difference = cv2.cvtColor(difference, cv2.COLOR_BGR2GRAY)
    _, _, _, (px, py) = cv2.minMaxLoc(difference)
    x, y = max(px - 9, 0), max(py - 9, 0)
    window = cv2.threshold(difference[y : py + 10, x : px + 10], THRESHOLD, 255, cv2.THRESH_TOZERO)
    m = cv2.moments(window[1])
    return np.array([x + m["m10"] / m["m00"], y + m["m01"] / m["m00"]])


RECIPES = {
    "OpenCV absdiff, threshold, components": usual_recipe,
    "OpenCV subtract, minMaxLoc": barest_recipe,
}


def _spot(size, ours, theirs, centre, recipes=RECIPES) -> Iterator[Task]:
    """A row for each recipe; `theirs` is what it is called with."""

    def error(found):
        return np.linalg.norm(found - centre)

    for name, recipe in recipes.items():
        call = _with(cv2, lambda recipe=recipe: recipe(*theirs()))
        yield Task("spot", size, name, lambda: ours().centre, call, error, error, "px", 0.5)


def spots() -> Iterator[Task]:
    for width, height in ((640, 480), (1920, 1080), (3840, 2160)):
        for colour in (False, True):
            on, off, centre = scenes.spot_frames(width, height, colour)
            yield from _spot(
                f"{width}x{height} {'BGR' if colour else 'grey'}",
                lambda on=on, off=off: ptzcal.detect_spot(on, off),
                lambda on=on, off=off: (on, off),
                centre,
            )

    # A camera's own layout: luma with chroma below it. OpenCV's recipes get the luma alone.
    on, off, centre = scenes.spot_frames(1920, 1080, True)
    nv12 = [scenes.nv12(frame) for frame in (on, off)]
    yield from _spot(
        "1920x1080 NV12",
        lambda: ptzcal.detect_spot(*nv12, format="nv12"),
        lambda: [frame[:1080] for frame in nv12],
        centre,
    )

    # Where the spot is known to be; OpenCV's recipes get the region.
    on, off, centre = scenes.spot_frames(1920, 1080, False)
    left, top = np.rint(centre).astype(int) - 64
    yield from _spot(
        "128x128 of 1920x1080 grey",
        lambda: ptzcal.detect_spot(on, off, region=(left, top, 128, 128)),
        lambda: [frame[top : top + 128, left : left + 128] for frame in (on, off)],
        centre,
        {name: (lambda on, off, r=recipe: r(on, off) + (left, top)) for name, recipe in RECIPES.items()},
    )

    # Several frames of each kind, averaged.
    pairs = [scenes.spot_frames(1920, 1080, False, seed) for seed in range(3, 7)]
    lit, dark, centre = [p[0] for p in pairs], [p[1] for p in pairs], pairs[0][2]

    def means():
        for frames in (lit, dark):
            total = np.zeros(frames[0].shape, np.float32)
            for frame in frames:
                cv2.accumulate(frame, total)
            yield cv2.convertScaleAbs(total, alpha=1 / len(frames))

    yield from _spot("4 + 4 of 1920x1080 grey", lambda: ptzcal.detect_spot(lit, dark), means, centre)


def spot_centres() -> Iterator[Task]:
    pairs, centres = scenes.small_spots(400)

    def rms(found):
        return np.sqrt(((np.array(found) - centres) ** 2).sum(axis=1).mean())

    def ours():
        return [ptzcal.detect_spot(on, off).centre for on, off in pairs]

    recipes = {
        "OpenCV, intensity-weighted mean": usual_recipe,
        "OpenCV, mean of the mask": mean_of_mask,
    }
    for name, recipe in recipes.items():

        def theirs(recipe=recipe):
            return [recipe(on, off) for on, off in pairs]

        yield Task(
            "spot centre",
            "400 spots, 48x48",
            name,
            ours,
            _with(cv2, theirs),
            rms,
            rms,
            "px rms",
            0.3,
            divide=400,
        )


# ---- chessboards --------------------------------------------------------------------------------


def _classic(image, size):
    """Corners by contours, refined by the gradients about them."""
    found, corners = cv2.findChessboardCorners(image, size)
    until = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 30, 0.01)
    return cv2.cornerSubPix(image, corners, (4, 4), (-1, -1), until) if found else None


def _by_sectors(flags):
    def recipe(image, size):
        found, corners = cv2.findChessboardCornersSB(image, size, flags=flags)[:2]
        return corners if found else None

    return recipe


def chessboards() -> Iterator[Task]:
    size = 14, 10
    turns = ((0, 0, 0.02), (0.35, -0.2, 0.1), (-0.3, 0.5, -0.15), (0.15, -0.7, 0.3))
    recipes = {"OpenCV findChessboardCorners, cornerSubPix": _classic}
    if cv2 is not None:
        recipes["OpenCV findChessboardCornersSB"] = _by_sectors(0)
        recipes["OpenCV findChessboardCornersSB, ACCURACY"] = _by_sectors(cv2.CALIB_CB_ACCURACY)
    for width, height in ((640, 480), (1920, 1080)):
        views = [scenes.chessboard(width, height, turn) for turn in turns]

        def rms(boards, views=views):
            """In any order of the corners; a board that was not found is off by a pixel."""
            squares = []
            for corners, (_, truth) in zip(boards, views):
                if corners is None:
                    squares.append(np.ones(len(truth)))
                else:
                    apart = corners.reshape(-1, 1, 2) - truth[None]
                    squares.append((apart**2).sum(axis=2).min(axis=1))
            return np.sqrt(np.mean(squares))

        def ours(views=views):
            return [ptzcal.detect_chessboard(image, size).corners for image, _ in views]

        for name, recipe in recipes.items():

            def theirs(recipe=recipe, views=views):
                return [recipe(image, size) for image, _ in views]

            where = f"{width}x{height}, {size[0]}x{size[1]}"
            theirs = _with(cv2, theirs)
            # Peers may miss boards: half a pixel is one of four.
            yield Task("chessboard", where, name, ours, theirs, rms, rms, "px rms", 0.8, divide=4)

        picture = scenes.rectangles(width, height)

        def ours_absent(picture=picture):
            try:
                return ptzcal.detect_chessboard(picture, size)
            except ptzcal.ChessboardNotFound:
                return None

        def found(board):
            return float(board is not None)

        recipes_absent = {"OpenCV findChessboardCornersSB": _by_sectors(0)}
        if cv2 is not None:
            fast = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK

            def classic_absent(image, size, fast=fast):
                there, corners = cv2.findChessboardCorners(image, size, flags=fast)
                return corners if there else None

            recipes_absent["OpenCV findChessboardCorners, FAST_CHECK"] = classic_absent
        for name, recipe in recipes_absent.items():

            def theirs(recipe=recipe, picture=picture):
                return recipe(picture, size)

            where = f"{width}x{height}"
            theirs = _with(cv2, theirs)
            yield Task("no chessboard", where, name, ours_absent, theirs, found, found, "", 0.0)


# ---- lines --------------------------------------------------------------------------------------


def _canny_hough(image):
    """Canny and the progressive probabilistic Hough transform; (n, 2, 2)."""
    edges = cv2.Canny(image, 50, 150)
    found = cv2.HoughLinesP(edges, 1, np.pi / 180, 20, minLineLength=15, maxLineGap=3)
    return np.empty((0, 2, 2)) if found is None else found.reshape(-1, 2, 2)


def _lsd(image):
    return cv2.createLineSegmentDetector().detect(image)[0].reshape(-1, 2, 2)


def lines() -> Iterator[Task]:
    recipes = {
        "OpenCV Canny, HoughLinesP": _canny_hough,
        "OpenCV LineSegmentDetector": _lsd,
    }
    for width, height in ((640, 480), (1920, 1080)):
        picture, sides = scenes.line_picture(width, height)

        def rms(found, sides=sides):
            """How far the best segment of each side is off it; a side without one is off by 3 pixels."""
            along = sides[:, 1] - sides[:, 0]
            across = np.stack([-along[:, 1], along[:, 0]], axis=1)
            across /= np.linalg.norm(across, axis=1, keepdims=True)
            off = np.einsum("nik,sk->sni", found, across) - (sides[:, 0] * across).sum(axis=1)[:, None, None]
            off = np.sqrt((off**2).mean(axis=2))
            middle = found.mean(axis=1)[None] - sides[:, None, 0]
            at = (middle * along[:, None]).sum(axis=2) / (along**2).sum(axis=1)[:, None]
            off[(at < 0) | (at > 1)] = np.inf
            return np.sqrt((np.minimum(off.min(axis=1), 3) ** 2).mean())

        def ours(picture=picture):
            return ptzcal.detect_line_segments(picture, min_length=15).uv

        for name, recipe in recipes.items():

            def theirs(recipe=recipe, picture=picture):
                return recipe(picture)

            where = f"{width}x{height}, 160 sides"
            theirs = _with(cv2, theirs)
            yield Task("line segments", where, name, ours, theirs, rms, rms, "px rms", 1.5)


# ---- features -----------------------------------------------------------------------------------


def _opencv_matches(a, b, ratio=0.8):
    """Nearest neighbours by brute force, ratio test and mutual check; index pairs."""
    matcher = cv2.BFMatcher(cv2.NORM_L2)
    back = {m.queryIdx: m.trainIdx for m in matcher.match(b, a)}
    near = [m for m, second in matcher.knnMatch(a, b, k=2) if m.distance < ratio * second.distance]
    return np.array([(m.queryIdx, m.trainIdx) for m in near if back[m.trainIdx] == m.queryIdx])


def _ours_matches(a, b):
    matches = ptzcal.match_sift(a, b)
    return np.c_[matches.a, matches.b]


def features() -> Iterator[Task]:
    for width, height in ((640, 480), (1920, 1080)):
        a, b, H = scenes.warped_pair(width, height)
        size = f"{width}x{height}"

        def ours(a=a, b=b):
            return ptzcal.detect_sift(a), ptzcal.detect_sift(b)

        def theirs(a=a, b=b):
            sift = cv2.SIFT_create()
            return sift.detectAndCompute(a, None), sift.detectAndCompute(b, None)

        def wrong(p, q, H=H):
            """Share of the matches that are off by more than 2 pixels, and how many are not."""
            moved = np.c_[p, np.ones(len(p))] @ H.T
            right = np.hypot(*(moved[:, :2] / moved[:, 2:] - q).T) < 2
            return 1 - right.mean(), right.sum()

        def ours_judged(found, wrong=wrong):
            matches = _ours_matches(*found)
            return wrong(found[0].xy[matches[:, 0]], found[1].xy[matches[:, 1]])

        def opencv_judged(found, wrong=wrong):
            (ka, da), (kb, db) = found
            matches = _opencv_matches(da, db)
            return wrong(
                np.array([ka[i].pt for i in matches[:, 0]]),
                np.array([kb[i].pt for i in matches[:, 1]]),
            )

        fa, fb = ours()
        right = f"{ours_judged((fa, fb))[1]} right matches"
        if cv2 is not None:
            right += f" / {opencv_judged(theirs())[1]}"
        yield Task(
            "SIFT, two images",
            f"{size}, {right}",
            "OpenCV SIFT detectAndCompute",
            ours,
            _with(cv2, theirs),
            lambda found, judged=ours_judged: judged(found)[0],
            lambda found, judged=opencv_judged: judged(found)[0],
            "wrong share",
            0.2,
        )

        da, db = fa.descriptors.astype(np.float32), fb.descriptors.astype(np.float32)
        exact = _exact_matches(fa.descriptors, fb.descriptors)

        def other(found, exact=exact):
            """Share of pairs that differ from the exact ones."""
            return len(exact ^ set(map(tuple, found))) / len(exact)

        yield Task(
            "SIFT matching, mutual",
            f"{len(fa)} x {len(fb)} descriptors",
            "OpenCV BFMatcher, ratio, mutual",
            lambda fa=fa, fb=fb: _ours_matches(fa, fb),
            _with(cv2, lambda da=da, db=db: _opencv_matches(da, db)),
            other,
            other,
            "other pairs",
            0.005,
        )


def _exact_matches(a, b):
    """In integers, all pairs."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * a @ b.T
    near, back = squares.argmin(axis=1), squares.argmin(axis=0)
    two = np.partition(squares, 1, axis=1)[:, :2]
    rows = np.arange(len(a))
    kept = (two[:, 0] <= 0.64 * two[:, 1]) & (back[near] == rows)
    return set(zip(rows[kept].tolist(), near[kept].tolist()))


# ---- calibration --------------------------------------------------------------------------------


def _normalised(points):
    """Centroid 0, mean distance sqrt(dimensions); the points and the matrix that does it."""
    d = points.shape[1]
    centre = points.mean(axis=0)
    moved = points - centre
    scale = np.sqrt(d) / np.sqrt((moved**2).sum(axis=1)).mean()
    T = np.eye(d + 1)
    T[:d, :d] *= scale
    T[:d, d] = -scale * centre
    return moved * scale, T


def _design(xyz, uv):
    A = np.zeros((2 * len(xyz), 12))
    A[0::2, 0:3] = A[1::2, 4:7] = xyz
    A[0::2, 3] = A[1::2, 7] = 1
    A[0::2, 8:11], A[0::2, 11] = -uv[:, :1] * xyz, -uv[:, 0]
    A[1::2, 8:11], A[1::2, 11] = -uv[:, 1:] * xyz, -uv[:, 1]
    return A


def linear(xyz, uv, solve):
    """DLT-Points; the camera's centre."""
    xyz, U = _normalised(xyz)
    uv, T = _normalised(uv)
    P = np.linalg.solve(T, solve(_design(xyz, uv)).reshape(3, 4)) @ U
    return -np.linalg.solve(P[:, :3], P[:, 3])


def by_svd(A):
    return np.linalg.svd(A, full_matrices=False)[2][-1]


def by_normal_equations(A):
    return np.linalg.eigh(A.T @ A)[1][:, 0]


def _set(xyz, uv):
    measurements = ptzcal.Correspondences(scenes.WIDTH, scenes.HEIGHT)
    measurements.add_points(xyz, uv)
    return measurements


def _centre(rotation_vector, translation):
    return -cv2.Rodrigues(rotation_vector)[0].T @ translation.ravel()


def calibrations() -> Iterator[Task]:
    truth = scenes.camera()
    guess = np.array([[800.0, 0, 400], [0, 800, 300], [0, 0, 1]])

    def error(centre):
        return 1e3 * np.linalg.norm(centre - truth.centre)

    for n in (40, 2021, 100_000):
        xyz, uv = scenes.points(n)

        def ours(xyz=xyz, uv=uv):
            return ptzcal.calibrate_camera(_set(xyz, uv), robust=False).camera.centre

        xyz32, uv32 = xyz.astype(np.float32)[:, None], uv.astype(np.float32)[:, None]

        def opencv(xyz32=xyz32, uv32=uv32):
            pinhole = (
                cv2.CALIB_USE_INTRINSIC_GUESS
                | cv2.CALIB_FIX_K1
                | cv2.CALIB_FIX_K2
                | cv2.CALIB_FIX_K3
                | cv2.CALIB_ZERO_TANGENT_DIST
            )
            size = scenes.WIDTH, scenes.HEIGHT
            found = cv2.calibrateCamera(
                [xyz32], [uv32], size, guess.copy(), np.zeros(5), flags=pinhole
            )
            return _centre(found[3][0], found[4][0])

        size, bound = f"{n} points", 1e3 * 3 / np.sqrt(n)
        yield Task(
            "calibrate",
            size,
            "OpenCV calibrateCamera, guess given, no covariance",
            ours,
            _with(cv2, opencv),
            error,
            error,
            "mm",
            bound,
        )
        solvers = {"SVD": by_svd, "normal equations": by_normal_equations}
        for name, solve in solvers.items():

            def numpy_dlt(xyz=xyz, uv=uv, solve=solve):
                return linear(xyz, uv, solve)

            yield Task(
                "calibrate",
                size,
                f"NumPy {name}, linear DLT only",
                ours,
                numpy_dlt,
                error,
                error,
                "mm",
                bound,
            )


def robust_calibrations() -> Iterator[Task]:
    truth = scenes.camera()
    xyz, uv, _ = scenes.with_outliers(2021, 0.3)

    def error(centre):
        return 1e3 * np.linalg.norm(centre - truth.centre)

    def unknown_lens():
        return ptzcal.calibrate_camera(_set(xyz, uv)).camera.centre

    def known_lens():
        return ptzcal.calibrate_camera(_set(xyz, uv), lens=truth).camera.centre

    def ransac():
        _, rotation, translation, _ = cv2.solvePnPRansac(
            xyz, uv, truth.K, None, reprojectionError=2.0
        )
        return _centre(rotation, translation)

    for name, ours in (("lens unknown", unknown_lens), ("lens known", known_lens)):
        yield Task(
            f"robust calibrate, {name}",
            "2021 points, 30 % wrong",
            "OpenCV solvePnPRansac, lens known, pose only",
            ours,
            _with(cv2, ransac),
            error,
            error,
            "mm",
            100.0,
        )


# ---- the rig ------------------------------------------------------------------------------------


def _beam(model, pan, tilt):
    """Two points of the laser's beam."""
    (cp, sp), (ct, st) = (np.cos(pan), np.sin(pan)), (np.cos(tilt), np.sin(tilt))
    R = np.array([[cp, sp * st, sp * ct], [0, ct, -st], [-sp, cp * st, cp * ct]])
    start = np.array([model.laser_x0, model.laser_y0, 0.0])
    return R @ start, R @ (start + [model.laser_vx, model.laser_vy, 1.0])


def _miss(model, pan_tilt, point):
    """How far the beam passes by a point."""
    a, b = _beam(model, *pan_tilt)
    along, to = b - a, point - a
    across = to - along * ((to @ along) / (along @ along))
    return np.sqrt(across @ across)


def aiming() -> Iterator[Task]:
    model, points = scenes.rig(), scenes.targets(50)

    def ours():
        return [model.aim(point) for point in points]

    def miss(pan_tilt, point):
        return _miss(model, pan_tilt, point)

    def nelder_mead():
        found = []
        for point in points:
            x, y, z = point
            start = np.arctan2(x, z), -np.arctan2(y, np.hypot(x, z))
            options = {"xatol": 1e-7, "fatol": 1e-7}
            best = scipy.optimize.minimize(
                miss, start, args=(point,), method="Nelder-Mead", options=options
            )
            found.append(best.x)
        return found

    def worst(found):
        return 1e3 * max(miss(pan_tilt, point) for pan_tilt, point in zip(found, points))

    yield Task(
        "aim the laser",
        "1 point",
        "SciPy Nelder-Mead",
        ours,
        _with(scipy, nelder_mead),
        worst,
        worst,
        "mm",
        0.1,
        divide=50,
    )


# ---- what a call costs --------------------------------------------------------------------------


def calls() -> Iterator[Task]:
    pixel = np.zeros((1, 1), np.uint8)

    def nothing_wrong(_):
        return 0.0

    yield Task(
        "a call from Python",
        "no arguments",
        "OpenCV absdiff, 1x1",
        ptzcal.abi_version,
        _with(cv2, lambda: cv2.absdiff(pixel, pixel)),
        nothing_wrong,
        nothing_wrong,
        "",
        0.0,
    )
    camera = ptzcal.Camera.from_matrix(
        scenes.camera().K,
        scenes.camera().size,
        (-0.2, 0.06, 0.001, -0.0008, 0.0),
        scenes.camera().R,
        scenes.camera().t,
    )
    K, lens = camera.K, np.array(camera.distortion[:5])
    rotation = cv2.Rodrigues(np.array(camera.R))[0] if cv2 is not None else None
    for n in (1, 100_000):
        xyz, _ = scenes.points(n)
        expected = _brown_conrady(camera, xyz)

        def ours(xyz=xyz):
            return camera.project(xyz)

        def opencv(xyz=xyz):
            return cv2.projectPoints(xyz, rotation, camera.t, K, lens)[0].reshape(-1, 2)

        def error(uv, expected=expected):
            return np.abs(uv - expected).max()

        yield Task(
            "project points",
            str(n),
            "OpenCV projectPoints",
            ours,
            _with(cv2, opencv),
            error,
            error,
            "px",
            1e-6,
        )


def _brown_conrady(camera, xyz):
    k1, k2, p1, p2, k3 = camera.distortion[:5]
    x, y, z = (xyz @ camera.R.T + camera.t).T
    x, y = x / z, y / z
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    a = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    b = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.c_[camera.fx * a + camera.cx, camera.fy * b + camera.cy]


# ---- cameras from boards -------------------------------------------------------------------------


def boards() -> Iterator[Task]:
    """Ours sets outliers aside and gives the covariance of lens and poses; OpenCV gives neither here."""
    for views, columns, rows in ((14, 9, 6), (50, 14, 14)):
        truth, board, seen = scenes.board_views(views, columns, rows)
        flat = np.c_[board, np.zeros(len(board))].astype(np.float32)

        def ours(board=board, seen=seen):
            given = ptzcal.Boards(scenes.WIDTH, scenes.HEIGHT)
            for uv in seen:
                given.add_view(board, uv)
            camera = ptzcal.calibrate_from_boards(given, distortion="brown_conrady").camera
            return np.array([camera.fx, camera.fy, camera.cx, camera.cy])

        def opencv(flat=flat, seen=seen):
            pixels = [uv.astype(np.float32) for uv in seen]
            size = scenes.WIDTH, scenes.HEIGHT
            k = cv2.calibrateCamera([flat] * len(seen), pixels, size, None, None)[1]
            return k[[0, 1, 0, 1], [0, 1, 2, 2]]

        def error(found, truth=truth):
            return np.abs(found - [truth.fx, truth.fy, truth.cx, truth.cy]).max()

        yield Task(
            "camera from boards",
            f"{views} views of {columns * rows} corners",
            "OpenCV calibrateCamera",
            ours,
            _with(cv2, opencv),
            error,
            error,
            "px",
            2.0,
        )


# ---- rig and cameras together ------------------------------------------------------------------


def _adjustment(s: joint.Survey) -> ptzcal.Adjustment:
    values = joint.RIG
    focal = np.exp(values[4])
    believed = ptzcal.RigModel(720, 576, focal, focal, *values[5:7], *values[:4])
    survey = ptzcal.Adjustment(believed)
    sigmas = np.zeros(15)
    sigmas[joint.RIG_PLACES] = joint.RIG_SIGMA
    survey.set_rig_covariance(np.diag(sigmas**2))
    survey.add_station(np.eye(3), np.zeros(3))
    covariance = np.eye(2) * joint.SIGMA**2
    survey.add_shots(0, np.c_[s.pan, s.tilt], s.head, spot_covariance=covariance)
    for i in range(len(s.intrinsics)):
        survey.add_camera(joint.WIDTH, joint.HEIGHT, skew_sigma=0.0, aspect_sigma=joint.ASPECT_SIGMA)
        own = s.camera == i
        survey.add_sightings(i, s.shot[own], s.uv[own], uv_covariance=covariance)
    return survey


def studies() -> Iterator[Task]:
    """The thesis's noise study with the cascade as printed: 6 x 6 noises of both cameras, 100 trials, two DLTs
    of 2021 points each. With noise of its own for every cell ours does the peers' work; common noise
    is what the library does unless it is told otherwise."""
    points, control = noise_study.data()
    made = noise_study.set_up(points, control)
    assert len(made) == len(points)
    # Of the corner where both are noisy; 100 trials scatter by a twentieth.
    reference = noise_study.batched(points, control, np.array([2.0]), 1000, seed=5)[0, 0]

    def error(means):
        return abs(means[-1, -1] / reference - 1)

    for draws, threads, peer, theirs in (
        ("independent", 1, "NumPy, SVD for each trial", noise_study.by_svd),
        ("independent", 1, "NumPy, all trials of a cell at once", noise_study.batched),
        ("independent", 2, "NumPy, all trials of a cell at once", noise_study.batched),
        ("common", 1, "NumPy, all trials of a cell at once", noise_study.batched),
    ):
        yield Task(
            "noise study, cascade as printed",
            f"6x6 x 100 x 2 DLT x 2021, {draws} noise",
            peer,
            lambda draws=draws, threads=threads: noise_study.ours(made, draws, threads),
            lambda theirs=theirs: theirs(points, control),
            error,
            error,
            "",
            0.2,
            threads=threads,
        )


def adjustments() -> Iterator[Task]:
    """Ours from a cold start, with its covariance and outliers looked for; SciPy from the truth
    shifted by a few pixels and centimetres, with the Jacobian's sparsity given, without covariance."""
    for cameras in (1, 20):
        s = joint.survey(2021 if cameras == 1 else 2000, cameras)
        survey = _adjustment(s)

        def ours(survey=survey):
            return survey.solve()

        def scipy_solve(s=s, cameras=cameras):
            rng = np.random.default_rng(9)
            rig = joint.RIG.copy()
            rig[7:11] = 0
            start = np.c_[
                s.intrinsics + rng.normal(0, 5, s.intrinsics.shape),
                rng.normal(0, 0.01, (cameras, 3)),
                s.centres + rng.normal(0, 0.03, (cameras, 3)),
            ]
            # Inverse depths by the spots' place on their line.
            line = np.exp(rig[4]) * rig[:2]
            off = s.head - (np.exp(rig[4]) * rig[2:4] + rig[5:7])
            rho = off @ line / (line @ line)
            p = np.concatenate([rig, start.ravel(), rho])
            residuals, sparsity = joint.scipy_adjustment(s, s.rotations, p)
            return scipy.optimize.least_squares(
                residuals, p, jac_sparsity=sparsity, x_scale="jac", method="trf", ftol=1e-10, xtol=1e-12
            )

        def ours_error(result, s=s):
            found = np.array([c.camera.centre for c in result.calibrations])
            return 1e3 * np.sqrt(np.mean(np.sum((found - s.centres) ** 2, axis=1)))

        def scipy_error(result, s=s, cameras=cameras):
            n = len(joint.RIG)
            found = result.x[n : n + 10 * cameras].reshape(cameras, 10)[:, 7:]
            return 1e3 * np.sqrt(np.mean(np.sum((found - s.centres) ** 2, axis=1)))

        yield Task(
            "adjust rig and cameras",
            f"{len(s.pan)} shots, {cameras} camera{'s' * (cameras > 1)}",
            "SciPy least_squares, sparse",
            ours,
            _with(scipy, scipy_solve),
            ours_error,
            scipy_error,
            "mm",
            30.0,
        )


# ---- planes -------------------------------------------------------------------------------------


def _consensus(points, samples=200, threshold=0.015):
    """The plane through three points that most agree with, fitted to those."""
    rng = np.random.default_rng(1)
    three = points[rng.integers(0, len(points), (samples, 3))]
    normals = np.cross(three[:, 1] - three[:, 0], three[:, 2] - three[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-300
    offsets = -(normals * three[:, 0]).sum(1)
    counts = np.zeros(samples, np.int64)
    for s in range(0, len(points), 4096):  # blocks that stay in the cache
        distances = points[s : s + 4096] @ normals.T + offsets
        counts += np.count_nonzero(np.abs(distances) < threshold, axis=0)
    best = counts.argmax()
    inliers = points[np.abs(points @ normals[best] + offsets[best]) < threshold]
    inliers = inliers - inliers.mean(0)
    return np.linalg.eigh(inliers.T @ inliers)[1][:, 0]


def planes() -> Iterator[Task]:
    """One plane with 5 mm of noise that holds 70 % of the points, the others anywhere; samples for a plane as
    many as the peers' 200. Ours besides: covariance, extents, the view from the station."""
    sigma = 0.005
    normal = np.array([0.1, 0.2, -1.0]) / np.linalg.norm([0.1, 0.2, -1.0])
    for n in (10_000, 100_000, 1_000_000):
        rng = np.random.default_rng(n)
        xyz = rng.uniform((-2, -2, 0), (2, 2, 5), (n, 3))
        k = int(0.7 * n)
        xyz[:k, 2] = 0.1 * xyz[:k, 0] + 0.2 * xyz[:k, 1] + 3 + rng.normal(0, sigma, k)
        rng.shuffle(xyz)

        def ours(xyz=xyz):
            return ptzcal.Planes.find(xyz, sigma=sigma, flatness=0.0, max_planes=1)[0].normal

        def numpy_consensus(xyz=xyz):
            return _consensus(xyz)

        def open3d_segment(xyz=xyz):
            cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(xyz))
            return cloud.segment_plane(3 * sigma, 3, 200, 1.0)[0][:3]

        def error(found):
            return np.degrees(np.arccos(min(1.0, abs(np.dot(found, normal)))))

        for peer, theirs in (
            ("NumPy, 200 samples", numpy_consensus),
            ("Open3D segment_plane, 200 samples", _with(open3d, open3d_segment)),
        ):
            yield Task("plane", str(n), peer, ours, theirs, error, error, "degrees", 0.1)


# ---- clouds -------------------------------------------------------------------------------------


_PLY_VERTEX = np.dtype([(n, "<f4") for n in "xyz"] + [(n, "u1") for n in ("red", "green", "blue")])
_PLY_HEADER = b"""ply
format binary_little_endian 1.0
element vertex %d
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
end_header
"""


def clouds() -> Iterator[Task]:
    """A million coloured points: to a PLY file, from it, and thinned to voxels of 5 cm."""
    n, voxel = 1_000_000, 0.05
    rng = np.random.default_rng(5)
    xyz = rng.uniform((-4, -1.5, 1), (4, 1.5, 9), (n, 3)).astype(np.float32).astype(float)
    rgb = rng.integers(0, 256, (n, 3), np.uint8)
    own = ptzcal.Cloud(xyz, rgb=rgb)
    other = None
    if open3d is not None:
        other = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(xyz))
        other.colors = open3d.utility.Vector3dVector(rgb / 255.0)
    folder = tempfile.TemporaryDirectory()
    own_path, other_path = f"{folder.name}/own.ply", f"{folder.name}/other.ply"
    own.save(own_path)

    def points(found):
        return np.abs(np.asarray(found.points if hasattr(found, "points") else found.xyz) - xyz).max()

    def write_other():
        assert open3d.io.write_point_cloud(other_path, other)

    yield Task(
        "write a PLY cloud",
        str(n),
        "Open3D",
        lambda: own.save(own_path),
        _with(open3d, write_other),
        lambda _: points(ptzcal.Cloud.load(own_path)),
        lambda _: points(open3d.io.read_point_cloud(other_path)),
        "m",
        1e-6,
    )
    yield Task(
        "read a PLY cloud",
        str(n),
        "Open3D",
        lambda: ptzcal.Cloud.load(own_path),
        # Not while `folder` is gone.
        _with(open3d, lambda folder=folder: open3d.io.read_point_cloud(own_path)),
        points,
        points,
        "m",
        1e-6,
    )

    packed = np.empty(n, _PLY_VERTEX)
    for k, name in enumerate("xyz"):
        packed[name] = xyz[:, k]
    for k, name in enumerate(("red", "green", "blue")):
        packed[name] = rgb[:, k]

    def numpy_write():
        # What knows the layout beforehand can hardly be beaten: a header, and one array.
        with open(other_path, "wb") as file:
            file.write(_PLY_HEADER % n)
            for k, name in enumerate("xyz"):
                packed[name] = xyz[:, k]
            for k, name in enumerate(("red", "green", "blue")):
                packed[name] = rgb[:, k]
            packed.tofile(file)

    def numpy_read(folder=folder):
        with open(own_path, "rb") as file:
            while file.readline() != b"end_header\n":
                pass
            records = np.fromfile(file, _PLY_VERTEX)
        found = np.column_stack([records[name] for name in "xyz"]).astype(float)
        return found, np.column_stack([records[name] for name in ("red", "green", "blue")])

    def plyfile_write():
        plyfile.PlyData([plyfile.PlyElement.describe(packed, "vertex")]).write(other_path)

    def plyfile_read(folder=folder):
        vertices = plyfile.PlyData.read(own_path)["vertex"].data
        return np.column_stack([vertices[name] for name in "xyz"]).astype(float), None

    def saved(_):
        return points(ptzcal.Cloud.load(other_path))

    def loaded(found):
        return np.abs(found[0] - xyz).max()

    for name, write, read in (
        ("NumPy, of this layout only", numpy_write, numpy_read),
        ("plyfile", _with(plyfile, plyfile_write), _with(plyfile, plyfile_read)),
    ):
        yield Task(
            "write a PLY cloud",
            str(n),
            name,
            lambda: own.save(own_path),
            write,
            lambda _: points(ptzcal.Cloud.load(own_path)),
            saved,
            "m",
            1e-6,
        )
        yield Task(
            "read a PLY cloud",
            str(n),
            name,
            lambda: ptzcal.Cloud.load(own_path),
            read,
            points,
            loaded,
            "m",
            1e-6,
        )

    # Every voxel's mean, and how many there are; Open3D's grid begins half a voxel before the least.
    voxels = len(np.unique(np.floor(xyz / voxel).astype(np.int64) @ (1, 1 << 20, 1 << 40)))

    def ours_thin():
        cloud = ptzcal.Cloud()
        cloud.merge(own)
        cloud.thin(voxel)
        return cloud

    yield Task(
        "thin a cloud to 5 cm",
        str(n),
        "Open3D voxel_down_sample",
        ours_thin,
        _with(open3d, lambda: other.voxel_down_sample(voxel)),
        lambda found: abs(len(found) / voxels - 1),
        lambda found: abs(len(found.points) / voxels - 1),
        "of the voxels",
        0.02,
    )


# ---- images without lens distortion ---------------------------------------------------------------


def undistortions() -> Iterator[Task]:
    width, height = 1920, 1080
    K = np.array([[1100.0, 0.0, 962.0], [0.0, 1098.0, 537.0], [0.0, 0.0, 1.0]])
    coefficients = np.array([-0.3, 0.1, 0.0005, -0.0007, -0.01])
    camera = ptzcal.Camera.from_matrix(K, (width, height), coefficients)
    undistorter = ptzcal.Undistorter(camera)
    ideal = undistorter.camera

    # The truth: exact positions, bilinear values without rounding.
    x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    rays = ideal.back_project(np.stack([x.ravel(), y.ravel()], axis=1))
    u, v = camera.project(rays).T.reshape(2, height, width)
    inside = (u >= 0) & (v >= 0) & (u < width - 1) & (v < height - 1)
    u, v = np.where(inside, u, 0.0), np.where(inside, v, 0.0)

    def truth(image):
        i, j = u.astype(int), v.astype(int)
        shape = u.shape + (1,) * (image.ndim - 2)
        a, b = (u - i).reshape(shape), (v - j).reshape(shape)
        p = image.astype(float)
        above = p[j, i] * (1 - a) + p[j, i + 1] * a
        below = p[j + 1, i] * (1 - a) + p[j + 1, i + 1] * a
        return above * (1 - b) + below * b

    def maps(kind):
        if cv2 is None:
            return None
        size = (width, height)
        return cv2.initUndistortRectifyMap(K, coefficients, None, ideal.K, size, kind)

    kinds = {} if cv2 is None else {"fixed-point": cv2.CV_16SC2, "float": cv2.CV_32FC1}
    # Waves with noise on them: edges everywhere, and nothing that hides a shift.
    rng = np.random.default_rng(1)
    waves = 120 + 60 * np.sin(x / 11) * np.cos(y / 13)
    images = {
        "grey": (waves + rng.normal(0, 12, x.shape)).clip(0, 255).astype(np.uint8),
        "BGR": (waves[..., None] + rng.normal(0, 12, (*x.shape, 3))).clip(0, 255).astype(np.uint8),
    }
    for name, image in images.items():
        wanted = truth(image)
        drawn, remapped = np.empty_like(image), np.empty_like(image)

        def error(picture, wanted=wanted):
            return np.abs(picture - wanted)[inside].mean()

        def ours(image=image, drawn=drawn):
            return undistorter.apply(image, out=drawn)

        for kind, number in kinds.items():
            ready = maps(number)

            def theirs(image=image, remapped=remapped, ready=ready):
                return cv2.remap(image, *ready, cv2.INTER_LINEAR, dst=remapped)

            peer = f"OpenCV remap, {kind} maps"
            size = f"{width}x{height} {name}"
            yield Task("undistort", size, peer, ours, theirs, error, error, "grey levels", 1.0)

    image, wanted = images["grey"], truth(images["grey"])

    def by_ours(made):
        return np.abs(made.apply(image) - wanted)[inside].mean()

    def by_theirs(ready):
        return np.abs(cv2.remap(image, *ready, cv2.INTER_LINEAR) - wanted)[inside].mean()

    for kind, number in kinds.items():
        yield Task(
            "undistort, making the maps",
            f"{width}x{height}",
            f"OpenCV initUndistortRectifyMap, {kind}",
            lambda: ptzcal.Undistorter(camera, ideal),
            lambda number=number: maps(number),
            by_ours,
            by_theirs,
            "grey levels",
            1.0,
        )


GROUPS = (
    spots,
    spot_centres,
    chessboards,
    undistortions,
    features,
    lines,
    calibrations,
    robust_calibrations,
    boards,
    adjustments,
    studies,
    aiming,
    calls,
    planes,
    clouds,
)
