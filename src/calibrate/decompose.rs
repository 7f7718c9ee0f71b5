//! K, R and t from a projection matrix, with the right signs (maths.md section 2, row Hartley).

use nalgebra::{Matrix3, Matrix3x4, Vector3};

use crate::error::{Degeneracy, Error, Result};
use crate::geometry::{Intrinsics, Rigid};

/// P ~ K [R | t] with positive focal lengths, det R = +1 and t in metres: P is scaled to
/// det(P[:, :3]) > 0, then RQ with a positive diagonal.
pub fn decompose(p: &Matrix3x4<f64>) -> Result<(Intrinsics, Rigid)> {
    let none = || Error::degenerate(Degeneracy::IllConditioned, "the projection matrix has no finite camera centre");
    let m: Matrix3<f64> = p.fixed_columns::<3>(0).into();
    let det = m.determinant();
    if !p.iter().all(|v| v.is_finite()) || det == 0.0 || m.row(2).norm() == 0.0 {
        return Err(none());
    }
    let scale = det.signum() / m.row(2).norm();
    let m = m * scale;
    // RQ by Gram-Schmidt from the last row up: each row of K has a positive diagonal.
    let r3: Vector3<f64> = m.row(2).transpose();
    let row2: Vector3<f64> = m.row(1).transpose();
    let k23 = row2.dot(&r3);
    let rest = row2 - r3 * k23;
    let k22 = rest.norm();
    let r2 = rest / k22;
    let row1: Vector3<f64> = m.row(0).transpose();
    let (k13, k12) = (row1.dot(&r3), row1.dot(&r2));
    // det > 0 and r1 = r2 x r3 make k11 positive.
    let r1 = r2.cross(&r3);
    let k11 = row1.dot(&r1);
    let rotation = Matrix3::from_rows(&[r1.transpose(), r2.transpose(), r3.transpose()]);
    let k = Matrix3::new(k11, k12, k13, 0.0, k22, k23, 0.0, 0.0, 1.0);
    let translation = k.try_inverse().ok_or_else(none)? * p.column(3) * scale;
    let pose = Rigid { rotation, translation };
    let intrinsics = Intrinsics { fx: k11, fy: k22, skew: k12, cx: k13, cy: k23 };
    let good = pose.is_finite() && intrinsics.to_array().iter().all(|v| v.is_finite()) && k11 > 0.0 && k22 > 0.0;
    if good { Ok((intrinsics, pose)) } else { Err(none()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rigid::exp;

    #[test]
    fn recovers_camera_from_either_sign_and_any_scale() {
        let k = Intrinsics { fx: 845.19, fy: 844.56, skew: -4.0, cx: 427.76, cy: 285.53 };
        for angle in [0.1, 1.5, 3.0] {
            let pose = Rigid {
                rotation: exp(&Vector3::new(0.3, -angle, 0.7)),
                translation: Vector3::new(0.14612, -0.04561, -0.03834),
            };
            let mut p = Matrix3x4::zeros();
            p.fixed_columns_mut::<3>(0).copy_from(&(k.matrix() * pose.rotation));
            p.set_column(3, &(k.matrix() * pose.translation));
            for scale in [1.0, -1.0, 1e-6, -3e5] {
                let (intrinsics, found) = decompose(&(p * scale)).unwrap();
                for (a, b) in intrinsics.to_array().iter().zip(k.to_array()) {
                    assert!((a - b).abs() < 1e-9, "{a} {b}");
                }
                assert!((found.rotation - pose.rotation).amax() < 1e-12);
                assert!((found.translation - pose.translation).amax() < 1e-12);
            }
        }
    }

    #[test]
    fn a_camera_at_infinity_is_refused() {
        let mut p = Matrix3x4::zeros();
        p[(0, 0)] = 1.0;
        p[(1, 1)] = 1.0;
        p[(2, 3)] = 1.0;
        assert!(decompose(&p).is_err());
        assert!(decompose(&(p * f64::NAN)).is_err());
    }
}
