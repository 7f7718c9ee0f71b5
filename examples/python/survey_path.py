"""Every fixed camera of a building in one frame: a rig goes along a path of stations, and each camera sees its
laser from some of them.

    survey_path.py [STATIONS]

A room of boxes is simulated. A robot's odometry says roughly where the rig stands; the walls that the
stations share, which nobody names, say it exactly. Prints how the stations are tied and each camera's pose with
its covariance in the first station's frame, beside the truth.
"""

import sys

import numpy as np

import ptzcal

#: A room with a cupboard, a table, a pillar and a crate: corners, metres; y down.
BOXES = np.array(
    [
        ((-3, -1.5, -2), (3, 1.1, 2.4)),
        ((-3, -0.7, 1.4), (-1.8, 1.1, 2.4)),
        ((1.2, 0.3, -2), (2.4, 1.1, -1.2)),
        ((2.5, -1.5, 1.7), (3, 1.1, 2.4)),
        ((-2.6, 0.6, -1.8), (-1.9, 1.1, -1.1)),
    ]
)
SHOTS = 1800  # from each station, all around
SPOT_SIGMA = 0.1  # px, in all cameras
FLATNESS = 0.001  # of the walls, metres
ODOMETRY = np.array([0.03, 0.03, 0.03, 0.05, 0.05, 0.05])  # radians, metres

RIG = ptzcal.RigModel(720, 576, 800, 800, 360, 288, laser_x0=0.1, laser_y0=0.005, laser_vx=-0.005, laser_vy=0.003)


def rotation(w):
    """exp([w]x)."""
    angle = np.linalg.norm(w)
    x, y, z = np.asarray(w) / max(angle, 1e-12)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def looking(centre, target):
    """A camera at a place that looks at another one."""
    z = np.subtract(target, centre) / np.linalg.norm(np.subtract(target, centre))
    x = np.cross((0, 1, 0), z) / np.linalg.norm(np.cross((0, 1, 0), z))
    R = np.array([x, np.cross(z, x), z])
    return ptzcal.Camera(1280, 960, 900, 900, 639.5, 479.5, R=R, t=-R @ centre)


def depths(origins, rays):
    """How far rays go until they meet something, in lengths of theirs."""
    a, b = ((corner - origins) / rays for corner in BOXES.transpose(1, 0, 2)[:, :, None, :])
    near, far = np.minimum(a, b).max(2), np.maximum(a, b).min(2)
    near[0] = far[0]  # seen from inside
    return np.where((near <= far) & (near > 0), near, np.inf).min(0)


def shoot(R, t, rng):
    """Readings, the spots in the head camera, and where they are, from a station."""
    i = np.arange(SHOTS)
    pan = np.remainder(np.pi * (3 - np.sqrt(5)) * i, 2 * np.pi) - np.pi
    pan_tilt = np.c_[pan, np.arcsin(0.9 * (2 * (i + 0.5) / SHOTS - 1))]

    def spots(depth):
        laser = RIG.laser_x0 / depth + RIG.laser_vx, RIG.laser_y0 / depth + RIG.laser_vy
        return np.c_[RIG.cx + RIG.fx * laser[0], RIG.cy + RIG.fy * laser[1]]

    one, two = (RIG.locate(pan_tilt, spots(np.full(SHOTS, d)))[0] @ R.T + t for d in (1.0, 2.0))
    origins, rays = 2 * one - two, two - one
    depth = depths(origins, rays) + FLATNESS * rng.normal(size=SHOTS)
    return pan_tilt, spots(depth) + rng.normal(0, SPOT_SIGMA, (SHOTS, 2)), origins + depth[:, None] * rays


def seen(camera, points, rng):
    """Which points a camera sees, and where."""
    to = points - camera.centre
    free = depths(np.tile(camera.centre, (len(to), 1)), to) > 0.98
    which = np.flatnonzero(free & (to @ camera.R[2] > 0.1))
    pixels = camera.project(points[which]) + rng.normal(0, SPOT_SIGMA, (len(which), 2))
    inside = (pixels > 0).all(1) & (pixels < camera.size).all(1)
    return which[inside], pixels[inside]


def main():
    stations = int(sys.argv[1]) if len(sys.argv) > 1 else 4
    rng = np.random.default_rng(3)
    along = np.linspace(0, 2 * np.pi, stations, endpoint=False)
    places = np.c_[0.6 * np.cos(along) - 0.2, 0.05 * np.sin(3 * along), 0.5 * np.sin(along) + 0.1]
    turns = [rotation((0, 0.4 * np.sin(a), 0)) for a in along]
    cameras = [looking((2.3, -1.3, -1.0), (-1.5, 0.6, 0.8)), looking((-2.6, -1.2, -0.4), (1.5, 0.5, 0.2))]
    # The world is the first station's frame.
    R0, t0 = turns[0], places[0]
    truth = [ptzcal.Camera(*c.size, c.fx, c.fy, c.cx, c.cy, R=c.R @ R0, t=c.R @ t0 + c.t) for c in cameras]

    survey = ptzcal.Adjustment(RIG)
    for camera in cameras:
        survey.add_camera(*camera.size)
    lit = np.zeros((len(cameras), stations), int)
    for k, (R, t) in enumerate(zip(turns, places)):
        if k == 0:
            survey.add_station(np.eye(3), np.zeros(3))
        else:
            off = ODOMETRY * rng.normal(size=6)
            told = rotation(off[:3]) @ R0.T @ R, R0.T @ (t - t0) + off[3:]
            survey.add_station(*told, np.diag(ODOMETRY**2))
        pan_tilt, spots, points = shoot(R, t, rng)
        shots = survey.add_shots(k, pan_tilt, spots, spot_covariance=SPOT_SIGMA**2 * np.eye(2))
        for i, camera in enumerate(cameras):
            which, pixels = seen(camera, points, rng)
            lit[i, k] = len(which)
            survey.add_sightings(i, shots[0] + which, pixels, uv_covariance=SPOT_SIGMA**2 * np.eye(2))

    # Neighbours along the path, and around.
    pairs = [(k, (k + 1) % stations) for k in range(stations if stations > 2 else 1)]
    try:
        ties = ptzcal.tie_stations(survey, pairs=pairs, planes={"flatness": FLATNESS})
        result = survey.solve()
    except ptzcal.Error as error:
        sys.exit(f"no answer: {error}")
    for link in ties.links:
        if link.pose is None:
            print(f"stations {link.stations[0]} and {link.stations[1]}: {link.reason}")
        else:
            print(f"stations {link.stations[0]} and {link.stations[1]}: {len(link.pose.matches)} planes are the same")
    for i, loop in enumerate(ties.loops):
        print(
            f"loop {i} of stations {', '.join(map(str, loop.stations))}: {1e3 * loop.rotation:.2f} mrad and "
            f"{1e3 * loop.position:.1f} mm are left, chance {loop.probability:.2f}"
        )
    print(f"{ties.shots} shots on {ties.planes} planes; {result.used} of {result.spots} spots used")
    for warning in result.warnings:
        print(f"  warning: {warning}")
    for k, station in enumerate(result.stations[1:], 1):
        sigma = np.sqrt(np.diag(station.covariance))
        off = station.t - R0.T @ (places[k] - t0)
        print(f"station {k}: off {1e3 * np.linalg.norm(off):.1f} mm, {1e3 * np.linalg.norm(sigma[3:]):.1f} expected")
    for i, calibration in enumerate(result.calibrations):
        centre, covariance = calibration.camera.centre, calibration.covariance[-6:, -6:]
        sigma = np.sqrt(np.diag(covariance))
        off = centre - truth[i].centre
        print(
            f"camera {i}, lit from {np.count_nonzero(lit[i])} stations by {lit[i].sum()} shots, is at ({centre[0]:.4f}, "
            f"{centre[1]:.4f}, {centre[2]:.4f}): off {1e3 * np.linalg.norm(off):.1f} mm, "
            f"{1e3 * np.linalg.norm(sigma[3:]):.1f} expected"
        )
        print("  covariance of its turn about its own axes (mrad^2) and of its centre (mm^2):")
        for row in 1e6 * covariance:
            print("  " + " ".join(f"{value:9.4f}" for value in row))


if __name__ == "__main__":
    main()
