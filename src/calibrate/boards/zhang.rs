//! Closed-form intrinsics from homographies of planes (Zhang, A flexible new technique for camera
//! calibration, 2000): two linear equations a view on the image of the absolute conic.

use nalgebra::Matrix3;

use crate::geometry::Intrinsics;
use crate::geometry::linalg::right_singular;

/// h_i^T B h_j as a row of the unknowns B11 B12 B22 B13 B23 B33.
fn row(h: &Matrix3<f64>, i: usize, j: usize) -> [f64; 6] {
    let (a, b) = (h.column(i), h.column(j));
    [
        a[0] * b[0],
        a[0] * b[1] + a[1] * b[0],
        a[1] * b[1],
        a[2] * b[0] + a[0] * b[2],
        a[2] * b[1] + a[1] * b[2],
        a[2] * b[2],
    ]
}

/// The two rows of every view, homographies scaled so that they weigh alike.
fn rows(homographies: &[Matrix3<f64>]) -> Vec<[f64; 6]> {
    let mut out = Vec::with_capacity(2 * homographies.len());
    for h in homographies {
        let h = h / (h.column(0).norm() * h.column(1).norm()).sqrt();
        out.push(row(&h, 0, 1));
        let (first, second) = (row(&h, 0, 0), row(&h, 1, 1));
        out.push(std::array::from_fn(|k| first[k] - second[k]));
    }
    out
}

/// All five intrinsics from three or more views.
pub(crate) fn intrinsics(homographies: &[Matrix3<f64>]) -> Option<Intrinsics> {
    (homographies.len() >= 3).then(|| right_singular(&rows(homographies)).vectors[5]).and_then(from_conic)
}

/// Without skew, from two or more views.
pub(crate) fn intrinsics_without_skew(homographies: &[Matrix3<f64>]) -> Option<Intrinsics> {
    if homographies.len() < 2 {
        return None;
    }
    let rows: Vec<[f64; 5]> = rows(homographies).iter().map(|r| [r[0], r[2], r[3], r[4], r[5]]).collect();
    let [b11, b22, b13, b23, b33] = right_singular(&rows).vectors[4];
    from_conic([b11, 0.0, b22, b13, b23, b33])
}

/// Square pixels and the principal point at the origin, from one or more views: least squares for
/// 1 / f^2 (Bouguet's start). `None` when the views leave f open, as boards parallel to the image do.
pub(crate) fn focal_length(homographies: &[Matrix3<f64>]) -> Option<f64> {
    let (mut aa, mut ab) = (0.0, 0.0);
    for r in rows(homographies) {
        let a = r[0] + r[2];
        aa += a * a;
        ab += a * r[5];
    }
    let f = (-aa / ab).sqrt();
    f.is_finite().then_some(f)
}

/// K from the image of the absolute conic B ~ K^-T K^-1.
fn from_conic([b11, b12, b22, b13, b23, b33]: [f64; 6]) -> Option<Intrinsics> {
    let minor = b11 * b22 - b12 * b12;
    let cy = (b12 * b13 - b11 * b23) / minor;
    let lambda = b33 - (b13 * b13 + cy * (b12 * b13 - b11 * b23)) / b11;
    let fx = (lambda / b11).sqrt();
    let fy = (lambda * b11 / minor).sqrt();
    let skew = -b12 * fx * fx * fy / lambda;
    let cx = skew * cy / fy - b13 * fx * fx / lambda;
    let k = Intrinsics { fx, fy, skew, cx, cy };
    (k.to_array().iter().all(|v| v.is_finite()) && fx > 0.0 && fy > 0.0).then_some(k)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rigid::exp;
    use nalgebra::Vector3;

    fn homography(k: &Intrinsics, turn: Vector3<f64>) -> Matrix3<f64> {
        let r = exp(&turn);
        k.matrix() * Matrix3::from_columns(&[r.column(0).into(), r.column(1).into(), Vector3::new(0.1, -0.2, 2.0)])
    }

    #[test]
    fn exact_homographies_give_exact_intrinsics() {
        let k = Intrinsics { fx: 1.3, fy: 1.25, skew: 0.01, cx: 0.03, cy: -0.02 };
        let turns = [Vector3::new(0.4, 0.1, 0.0), Vector3::new(-0.2, 0.5, 0.3), Vector3::new(0.1, -0.4, 1.0)];
        let h = turns.map(|t| homography(&k, t));
        let found = intrinsics(&h).unwrap();
        assert!(found.to_array().iter().zip(k.to_array()).all(|(a, b)| (a - b).abs() < 1e-10));
        let k = Intrinsics { skew: 0.0, ..k };
        let h = turns.map(|t| homography(&k, t));
        let found = intrinsics_without_skew(&h[..2]).unwrap();
        assert!(found.to_array().iter().zip(k.to_array()).all(|(a, b)| (a - b).abs() < 1e-10));
        let k = Intrinsics::new(1.3, 0.0, 0.0);
        assert!((focal_length(&[homography(&k, turns[0])]).unwrap() - 1.3).abs() < 1e-10);
    }

    #[test]
    fn boards_parallel_to_the_image_give_none() {
        let k = Intrinsics::new(1.3, 0.0, 0.0);
        let flat = [0.0, 0.7, 2.0].map(|a| homography(&k, Vector3::new(0.0, 0.0, a)));
        assert!(focal_length(&flat).is_none_or(|f| !(1e-3..=1e3).contains(&f)));
    }
}
