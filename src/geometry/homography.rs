//! Plane-to-plane homographies: eqs (8)-(9) of the thesis with Hartley's normalisation.

use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};

use super::linalg::{Normalisation2, right_singular};
use crate::error::{Degeneracy, Error, Result};

/// The homography with `to` ~ H `from`, scaled to |H| = 1 and positive at the first point. At least
/// 4 pairs, no three of four on a line; all pairs are used, equally weighted (normalised DLT).
pub fn estimate(from: &[Vector2<f64>], to: &[Vector2<f64>]) -> Result<Matrix3<f64>> {
    if from.len() != to.len() {
        return Err(Error::invalid("to", format!("{} points for {} in `from`", to.len(), from.len())));
    }
    if from.len() < 4 {
        return Err(Error::TooFewPoints { given: from.len(), needed: 4 });
    }
    for (name, points) in [("from", from), ("to", to)] {
        if let Some(index) = points.iter().position(|p| !(p.x.is_finite() && p.y.is_finite())) {
            return Err(Error::NotFinite { name, index });
        }
    }
    let degenerate = || Error::degenerate(Degeneracy::Collinear, "the points do not span a plane");
    let nf = Normalisation2::of(from).ok_or_else(degenerate)?;
    let nt = Normalisation2::of(to).ok_or_else(degenerate)?;
    let normalised = || from.iter().zip(to).map(|(p, q)| (nf.apply(p), nt.apply(q)));
    let summed = if from.len() >= MANY { by_moments(normalised()) } else { None };
    let h = match summed {
        Some(h) => h,
        None => {
            let rows = normalised().flat_map(|(p, q)| {
                let row = |m: f64| [-m * p.x, -m * p.y, -m];
                let ([a, b, c], [d, e, f]) = (row(q.x), row(q.y));
                [[p.x, p.y, 1.0, 0.0, 0.0, 0.0, a, b, c], [0.0, 0.0, 0.0, p.x, p.y, 1.0, d, e, f]]
            });
            let svd = right_singular(&rows.collect::<Vec<[f64; 9]>>());
            // The null space must be one-dimensional: with three points on a line it is not.
            if svd.values[7] <= 1e-9 * svd.values[0] {
                return Err(degenerate());
            }
            Matrix3::from_row_slice(&svd.vectors[8])
        }
    };
    let h = nt.inverse_matrix() * h * nf.matrix();
    let sign = (h * Vector3::new(from[0].x, from[0].y, 1.0)).z.signum();
    Ok(h * (sign / h.norm()))
}

/// Pairs from which on their moments are summed.
const MANY: usize = 24;

/// The null vector of all rows from their normal equations, which are sums over the pairs. They square the
/// condition: `None` where more than six digits would be lost.
fn by_moments(pairs: impl Iterator<Item = (Vector2<f64>, Vector2<f64>)>) -> Option<Matrix3<f64>> {
    const LOST: f64 = 1e-6;
    // Of p p^T, upper triangle, times 1, u, v and u^2 + v^2.
    let mut moments = [[0.0; 6]; 4];
    for (p, q) in pairs {
        let products = [p.x * p.x, p.x * p.y, p.x, p.y * p.y, p.y, 1.0];
        for (sums, factor) in moments.iter_mut().zip([1.0, q.x, q.y, q.norm_squared()]) {
            sums.iter_mut().zip(&products).for_each(|(sum, product)| *sum += factor * product);
        }
    }
    let [plain, u, v, squares] = moments.map(|[xx, xy, x, yy, y, one]| Matrix3::new(xx, xy, x, xy, yy, y, x, y, one));
    let mut h = SMatrix::<f64, 9, 9>::zeros();
    for (i, j, block) in [(0, 0, plain), (1, 1, plain), (0, 2, -u), (2, 0, -u), (1, 2, -v), (2, 1, -v), (2, 2, squares)]
    {
        h.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&block);
    }
    let eigen = h.try_symmetric_eigen(f64::EPSILON, 1000)?;
    let mut order: [usize; 9] = std::array::from_fn(|i| i);
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let sound = eigen.eigenvalues[order[1]] > LOST * eigen.eigenvalues[order[8]];
    sound.then(|| Matrix3::from_row_slice(eigen.eigenvectors.column(order[0]).as_slice()))
}

/// The homography of four pairs, scaled like that of [`estimate`]: both quadrilaterals are images of the
/// standard projective frame (Hartley and Zisserman, Multiple View Geometry, 2nd ed., 2004, section 2.3).
/// `None` when three of the four points are on a line, as good as, in either plane.
pub fn of_four(from: &[Vector2<f64>; 4], to: &[Vector2<f64>; 4]) -> Option<Matrix3<f64>> {
    let h = frame(to)? * frame(from)?.try_inverse()?;
    let sign = (h * from[0].push(1.0)).z.signum();
    let h = h * (sign / h.norm());
    h.iter().all(|v| v.is_finite()).then_some(h)
}

/// Maps (1, 0, 0), (0, 1, 0), (0, 0, 1) and (1, 1, 1) to four points.
fn frame(points: &[Vector2<f64>; 4]) -> Option<Matrix3<f64>> {
    let [a, b, c, d] = points.map(|p| p.push(1.0));
    // Cramer's rule: triangles' areas, none of which may vanish beside the largest.
    let weights = [d.dot(&b.cross(&c)), d.dot(&c.cross(&a)), d.dot(&a.cross(&b)), a.dot(&b.cross(&c))].map(f64::abs);
    let largest = weights.iter().copied().fold(0.0, f64::max);
    if !weights.iter().all(|w| *w > 1e-9 * largest) {
        return None;
    }
    Some(Matrix3::from_columns(&[a * d.dot(&b.cross(&c)), b * d.dot(&c.cross(&a)), c * d.dot(&a.cross(&b))]))
}

/// Maps a point; `None` when it goes to infinity.
pub fn apply(h: &Matrix3<f64>, p: &Vector2<f64>) -> Option<Vector2<f64>> {
    let q = h * Vector3::new(p.x, p.y, 1.0);
    let r = q.xy() / q.z;
    (q.z.abs() > 1e-300 && r.x.is_finite() && r.y.is_finite()).then_some(r)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recovers_a_homography_exactly() {
        let truth = Matrix3::new(0.9, 0.1, 20.0, -0.05, 1.1, -7.0, 1e-4, -3e-4, 1.0);
        let from: Vec<_> = (0..12).map(|i| Vector2::new((i % 4) as f64 * 100.0, (i / 4) as f64 * 80.0)).collect();
        let to: Vec<_> = from.iter().map(|p| apply(&truth, p).unwrap()).collect();
        let h = estimate(&from, &to).unwrap();
        assert!((h / h.m33 - truth).amax() < 1e-9);
        assert!((estimate(&from[..4], &to[..4])).is_err(), "four points on one line");
    }

    #[test]
    fn many_pairs_give_the_same_by_their_moments() {
        let truth = Matrix3::new(0.9, 0.1, 20.0, -0.05, 1.1, -7.0, 1e-4, -3e-4, 1.0);
        let from: Vec<_> = (0..54).map(|i| Vector2::new((i % 9) as f64 * 100.0, (i / 9) as f64 * 80.0)).collect();
        let to: Vec<_> = from.iter().map(|p| apply(&truth, p).unwrap()).collect();
        let h = estimate(&from, &to).unwrap();
        assert!((h / h.m33 - truth).amax() < 1e-8);
        let line: Vec<_> = (0..54).map(|i| Vector2::new(i as f64, 2.0 * i as f64)).collect();
        assert!(estimate(&line, &to).is_err(), "all on one line");
    }

    #[test]
    fn four_pairs_give_the_same_as_any_number() {
        let truth = Matrix3::new(0.9, 0.1, 20.0, -0.05, 1.1, -7.0, 1e-4, -3e-4, 1.0);
        let from = [(0.0, 0.0), (300.0, 20.0), (280.0, 190.0), (-10.0, 240.0)].map(|(x, y)| Vector2::new(x, y));
        let to = from.map(|p| apply(&truth, &p).unwrap());
        let h = of_four(&from, &to).unwrap();
        assert!((h - estimate(&from, &to).unwrap()).amax() < 1e-12);
        let line = [from[0], from[1], (from[0] + from[1]) * 0.5, from[3]];
        assert!(of_four(&line, &to).is_none() && of_four(&from, &line).is_none());
        assert!(of_four(&from, &[Vector2::repeat(f64::NAN); 4]).is_none());
    }

    #[test]
    fn refuses_bad_input() {
        let p = [Vector2::new(0.0, 0.0), Vector2::new(1.0, 0.0), Vector2::new(1.0, 1.0), Vector2::new(0.0, 1.0)];
        assert!(estimate(&p, &p).is_ok());
        assert!(matches!(estimate(&p[..3], &p[..3]), Err(Error::TooFewPoints { .. })));
        assert!(estimate(&p, &p[..3]).is_err());
        assert!(matches!(estimate(&[p[0]; 4], &p), Err(Error::Degenerate { .. })));
        let mut nan = p;
        nan[2].y = f64::NAN;
        assert_eq!(estimate(&p, &nan), Err(Error::NotFinite { name: "to", index: 2 }));
    }
}
