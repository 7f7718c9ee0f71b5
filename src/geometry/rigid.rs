//! Rotations (exponential map, axis rotations, nearest rotation) and rigid transforms.

use nalgebra::{Matrix3, Vector3};

/// The matrix `[w]x` with `[w]x v = w x v`.
pub fn skew(w: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -w.z, w.y, w.z, 0.0, -w.x, -w.y, w.x, 0.0)
}

/// Rotation about x: positive turns the z axis up (towards -y).
pub fn rotation_x(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

/// Rotation about y: positive turns the z axis right (towards +x).
pub fn rotation_y(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
}

/// Rotation matrix of a rotation vector (Rodrigues), accurate for every angle.
pub fn exp(w: &Vector3<f64>) -> Matrix3<f64> {
    let theta2 = w.norm_squared();
    let (a, b) = if theta2 < 1e-8 {
        (1.0 - theta2 / 6.0, 0.5 - theta2 / 24.0)
    } else {
        let theta = theta2.sqrt();
        (theta.sin() / theta, (1.0 - theta.cos()) / theta2)
    };
    let k = skew(w);
    Matrix3::identity() + k * a + k * k * b
}

/// Rotation vector of a rotation matrix, with angle in [0, pi].
pub fn log(r: &Matrix3<f64>) -> Vector3<f64> {
    let axis = Vector3::new(r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12) * 0.5;
    let (sin, cos) = (axis.norm(), (r.trace() - 1.0) * 0.5);
    let angle = sin.atan2(cos);
    if sin > 1e-6 {
        return axis * (angle / sin);
    }
    if cos > 0.0 {
        return axis;
    }
    // Near pi the antisymmetric part vanishes: the axis is the largest column of R + I.
    let b = r + Matrix3::identity();
    let column = (0..3).max_by(|&i, &j| b.column(i).norm().total_cmp(&b.column(j).norm())).unwrap_or(0);
    let direction = Vector3::from(b.column(column)).normalize();
    let sign = if direction.dot(&axis) < 0.0 { -1.0 } else { 1.0 };
    direction * (sign * angle)
}

/// J with log(exp(d) exp(w)) = w + J d for small d: the inverse of the left Jacobian of SO(3).
pub fn log_by_turn(w: &Vector3<f64>) -> Matrix3<f64> {
    let theta = w.norm();
    // Its limit at 0; towards pi, where the logarithm ends, it stays finite.
    let b = if theta < 1e-3 { 1.0 / 12.0 } else { (1.0 - 0.5 * theta / (0.5 * theta).tan()) / (theta * theta) };
    let k = skew(w);
    Matrix3::identity() - k * 0.5 + k * k * b
}

/// The rotation nearest to `m` in the Frobenius norm (polar projection with det +1).
pub fn nearest_rotation(m: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let svd = m.iter().all(|v| v.is_finite()).then(|| m.try_svd(true, true, f64::EPSILON, 200))??;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    Some(u * flip * v_t)
}

/// How far `m` is from a rotation: the largest entry of |M M^T - I|, infinite for a reflection.
pub fn rotation_defect(m: &Matrix3<f64>) -> f64 {
    if m.determinant() <= 0.0 {
        return f64::INFINITY;
    }
    (m * m.transpose() - Matrix3::identity()).amax()
}

/// A rigid transform x_out = R x_in + t. As a camera's pose it is world to camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    pub rotation: Matrix3<f64>,
    /// Metres.
    pub translation: Vector3<f64>,
}

impl Default for Rigid {
    fn default() -> Self {
        Self::identity()
    }
}

impl Rigid {
    pub fn identity() -> Self {
        Self { rotation: Matrix3::identity(), translation: Vector3::zeros() }
    }

    /// World-to-camera pose of a camera at `centre` (world frame).
    pub fn from_centre(rotation: Matrix3<f64>, centre: &Vector3<f64>) -> Self {
        Self { rotation, translation: -(rotation * centre) }
    }

    /// World-to-camera pose of a camera at `centre` that looks at `target`, its x axis level
    /// (world y down). `None` when it would look straight up or down, or nowhere.
    pub fn look_at(centre: &Vector3<f64>, target: &Vector3<f64>) -> Option<Self> {
        let z = (target - centre).try_normalize(1e-12)?;
        let x = Vector3::y().cross(&z).try_normalize(1e-9)?;
        let y = z.cross(&x);
        let rotation = Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()]);
        Some(Self::from_centre(rotation, centre))
    }

    /// The point that this transform takes to the origin: a camera's centre, -R^T t.
    pub fn centre(&self) -> Vector3<f64> {
        -(self.rotation.transpose() * self.translation)
    }

    pub fn apply(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * x + self.translation
    }

    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// `self` after `first`: x -> self(first(x)).
    pub fn after(&self, first: &Self) -> Self {
        Self {
            rotation: self.rotation * first.rotation,
            translation: self.rotation * first.translation + self.translation,
        }
    }

    pub fn is_finite(&self) -> bool {
        self.rotation.iter().chain(self.translation.iter()).all(|v| v.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn log_inverts_exp_for_every_angle() {
        for angle in [0.0, 1e-9, 1e-5, 1e-3, 0.5, 2.0, 3.0, PI - 1e-3, PI - 1e-8] {
            for axis in [Vector3::x(), -Vector3::y(), Vector3::new(1.0, -2.0, 0.5)] {
                let w = axis.normalize() * angle;
                let back = log(&exp(&w));
                assert!((back - w).norm() < 1e-7, "{angle}: {back} is not {w}");
            }
        }
    }

    #[test]
    fn the_logarithm_changes_with_a_turn_as_stated() {
        for angle in [0.0, 1e-4, 9e-4, 2e-3, 0.5, 2.0, 3.1] {
            let w = Vector3::new(1.0, -2.0, 0.5).normalize() * angle;
            for axis in 0..3 {
                let d = Vector3::ith(axis, 1e-5);
                let difference = (log(&(exp(&d) * exp(&w))) - log(&(exp(&-d) * exp(&w)))) / 2e-5;
                assert!((log_by_turn(&w).column(axis) - difference).norm() < 1e-7 / (PI - angle), "{angle} {axis}");
            }
        }
    }

    #[test]
    fn pan_turns_right_and_tilt_turns_up() {
        assert!((rotation_y(0.3) * Vector3::z()).x > 0.0);
        assert!((rotation_x(0.3) * Vector3::z()).y < 0.0);
    }

    #[test]
    fn exp_is_a_rotation_about_its_vector() {
        let w = Vector3::new(0.0, 0.7, 0.0);
        assert!((exp(&w) - rotation_y(0.7)).amax() < 1e-15);
        assert!(rotation_defect(&exp(&Vector3::new(0.3, -2.0, 1.0))) < 1e-14);
    }

    #[test]
    fn nearest_rotation_restores_a_rotation_and_refuses_nan() {
        let r = exp(&Vector3::new(0.2, 0.4, -0.3));
        assert!((nearest_rotation(&(r * 1.7)).unwrap() - r).amax() < 1e-12);
        let mut bad = r;
        bad[(1, 1)] = f64::NAN;
        assert!(nearest_rotation(&bad).is_none());
    }

    #[test]
    fn look_at_puts_the_target_on_the_axis() {
        let pose = Rigid::look_at(&Vector3::new(-1.6, -0.9, 0.6), &Vector3::new(0.15, 0.15, 2.9)).unwrap();
        let seen = pose.apply(&Vector3::new(0.15, 0.15, 2.9));
        assert!(seen.xy().norm() < 1e-12 && seen.z > 0.0);
        assert!((pose.centre() - Vector3::new(-1.6, -0.9, 0.6)).norm() < 1e-12);
        assert!(rotation_defect(&pose.rotation) < 1e-12);
        assert!(Rigid::look_at(&Vector3::zeros(), &Vector3::y()).is_none());
    }

    #[test]
    fn compose_and_invert() {
        let a = Rigid { rotation: exp(&Vector3::new(0.1, 0.2, 0.3)), translation: Vector3::new(1.0, 2.0, 3.0) };
        let b = Rigid { rotation: exp(&Vector3::new(-1.0, 0.2, 0.5)), translation: Vector3::new(-4.0, 0.0, 1.0) };
        let x = Vector3::new(0.3, -0.8, 5.0);
        assert!((a.after(&b).apply(&x) - a.apply(&b.apply(&x))).norm() < 1e-14);
        assert!((a.inverse().apply(&a.apply(&x)) - x).norm() < 1e-14);
    }
}
