"""Truth for the tests, computed with NumPy alone, and the header."""

import re
import unittest
from pathlib import Path

import numpy as np

import ptzcal

ROOT = Path(__file__).resolve().parents[3]
HEADER = ROOT / "include" / "ptzcal.h"


def rotation(rx, ry, rz):
    """R_z R_y R_x."""
    (cx, sx), (cy, sy), (cz, sz) = ((np.cos(a), np.sin(a)) for a in (rx, ry, rz))
    X = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    Y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    Z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return Z @ Y @ X


def camera(distortion=()):
    model = "brown_conrady" if len(distortion) else "none"
    return ptzcal.Camera(
        800,
        600,
        845.0,
        847.0,
        402.5,
        305.25,
        0.5,
        model,
        distortion,
        rotation(0.02, -0.1, 0.03),
        (0.2, -0.1, 0.15),
    )


def project(camera, xyz):
    """Brown-Conrady by its definition."""
    k1, k2, p1, p2, k3 = camera.distortion[:5]
    x, y, z = (xyz @ camera.R.T + camera.t).T
    x, y = x / z, y / z
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    a = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    b = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.c_[camera.fx * a + camera.skew * b + camera.cx, camera.fy * b + camera.cy]


def room_points(n, seed=7):
    """Points of a room in front of the camera."""
    return np.random.default_rng(seed).uniform([-1.5, -1.0, 1.5], [1.5, 1.0, 5.0], (n, 3))


def rig_model(**changes):
    members = dict(
        width=720,
        height=576,
        fx=800.0,
        fy=805.0,
        cx=360.0,
        cy=288.0,
        laser_x0=0.1,
        laser_y0=0.005,
        laser_vx=-0.005,
        laser_vy=0.003,
    )
    return ptzcal.RigModel(**{**members, **changes})


def head_rotation(pan, tilt):
    """Head to world: positive pan right, positive tilt up, with y down."""
    (cp, sp), (ct, st) = (np.cos(pan), np.sin(pan)), (np.cos(tilt), np.sin(tilt))
    pan_turn = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    tilt_turn = np.array([[1, 0, 0], [0, ct, -st], [0, st, ct]])
    return pan_turn @ tilt_turn


def shots(model, pan_tilt, depths):
    """The points that an undistorted rig hits, and the spots that its head camera sees."""
    Z = np.asarray(depths)
    beam = np.c_[model.laser_x0 + model.laser_vx * Z, model.laser_y0 + model.laser_vy * Z, Z]
    xyz = np.array([head_rotation(*reading) @ m for reading, m in zip(pan_tilt, beam)])
    spots = np.c_[model.fx * beam[:, 0] / Z + model.cx, model.fy * beam[:, 1] / Z + model.cy]
    return xyz, spots


def spot_frames(height=240, width=320, centre=(180.3, 95.6), peak=120.0, sigma=1.8, seed=1):
    """A grey frame with a Gaussian spot and one without, noise 2."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    background = 70 + 20 * np.sin(x / 40) + 0.05 * y
    spot = peak * np.exp(-((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / (2 * sigma**2))
    noisy = [light + rng.normal(0, 2, x.shape) for light in (background + spot, background)]
    return tuple(np.clip(np.rint(frame), 0, 255).astype(np.uint8) for frame in noisy)


class TestCase(unittest.TestCase):
    def assertClose(self, actual, expected, atol=1e-12, rtol=0.0):
        np.testing.assert_allclose(actual, expected, rtol=rtol, atol=atol)

    def fails(self, status, index=None):
        """A context in which the library must fail with a status, and with an index if it is given."""
        return _Fails(self, ptzcal.Status[status], index)


class _Fails:
    def __init__(self, test, status, index):
        self.test, self.status, self.index = test, status, index
        self.error = None

    def __enter__(self):
        return self

    def __exit__(self, kind, error, _):
        self.test.assertIsInstance(error, ptzcal.Error, f"wanted {self.status!r}")
        self.test.assertEqual(error.status, self.status, error)
        self.test.assertTrue(error.message)
        if self.index is not None:
            self.test.assertEqual(error.index, self.index)
        self.error = error
        return True


class Header:
    """What include/ptzcal.h declares."""

    def __init__(self):
        text = re.sub(r"/\*.*?\*/", " ", HEADER.read_text(), flags=re.S)
        text = re.sub(r"^#.*$", " ", text, flags=re.M)
        text = re.sub(r"PTZCAL_(CALLBACK_)?NOEXCEPT", "", text)
        self.enums, self.structs, self.callbacks, self.functions = {}, {}, {}, {}
        for body, name in re.findall(r"enum\s*\{([^}]*)\};\s*typedef\s+\w+\s+(\w+);", text):
            pairs = re.findall(r"(\w+)\s*=\s*(-?\d+)", body)
            self.enums[name] = {key: int(value) for key, value in pairs}
        for name, body in re.findall(r"typedef\s+struct\s+(\w+)\s*\{([^}]*)\}", text):
            members = [m.strip() for m in body.split(";") if m.strip()]
            self.structs[name] = [re.search(r"(\w+)(\[\d+\])?$", m).group(1) for m in members]
        text = re.sub(r"enum\s*\{[^}]*\};", " ", text)
        text = re.sub(r"typedef\s+struct\s+\w+\s*\{[^}]*\}\s*\w+;", " ", text)
        for result, name, inside in re.findall(
            r"typedef\s+([\w ]+?)\s*\(\*(\w+)\)\(([^)]*)\)\s*;", text
        ):
            self.callbacks[name] = (result, self._kinds(inside))
        text = re.sub(r"typedef[^;]*;", " ", text)
        for result, name, inside in re.findall(r"([\w *]+?)\b(ptzcal_\w+)\(([^)]*)\)\s*;", text):
            self.functions[name] = (" ".join(result.split()), self._kinds(inside))

    @staticmethod
    def _kinds(inside):
        """`const double *xyz` is `const double *`."""
        if inside.strip() == "void":
            return []
        parameters = [" ".join(p.split()) for p in inside.split(",")]
        return [re.sub(r"\w+$", "", p).strip() for p in parameters]
