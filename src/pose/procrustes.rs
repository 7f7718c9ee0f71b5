//! Rigid Procrustes: the rotation (determinant +1) and translation, without scale, that take one
//! point set to another (Kabsch 1976; Umeyama 1991 for the sign).

use nalgebra::{Matrix3, Vector3};

use crate::error::{Degeneracy, Error, Result};
use crate::geometry::Rigid;
use crate::geometry::linalg::right_singular;

/// A fitted rigid transform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProcrustesFit {
    /// to = transform(from).
    pub transform: Rigid,
    /// Weighted root mean square distance that is left, metres.
    pub rms: f64,
    /// Ratio of the largest to the smallest curvature of the rotation, 1 at best.
    pub condition: f64,
}

/// Smallest ratio of a set's second to its first extent.
const MIN_EXTENT: f64 = 1e-6;

/// Fits to = R from + t in the (weighted) least-squares sense.
///
/// Errors: `InvalidArgument` for sets of unequal size or bad weights, `NotFinite`, `TooFewPoints`
/// below three points of positive weight, `Degenerate` for coincident or collinear points, which
/// leave a rotation free, and where no single rotation is best (a symmetric set and its mirror image).
pub fn procrustes(from: &[Vector3<f64>], to: &[Vector3<f64>], weights: Option<&[f64]>) -> Result<ProcrustesFit> {
    if from.len() != to.len() {
        return Err(Error::invalid("to", format!("{} points for {}", to.len(), from.len())));
    }
    for (name, set) in [("from", from), ("to", to)] {
        if let Some(index) = set.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
            return Err(Error::NotFinite { name, index });
        }
    }
    if let Some(w) = weights
        && (w.len() != from.len() || w.iter().any(|w| !(w.is_finite() && *w >= 0.0)))
    {
        return Err(Error::invalid("weights", "one finite weight, not negative, for each point"));
    }
    let weight = |i: usize| weights.map_or(1.0, |w| w[i]);
    let used = (0..from.len()).filter(|i| weight(*i) > 0.0).count();
    if used < 3 {
        return Err(Error::TooFewPoints { given: used, needed: 3 });
    }
    let total: f64 = (0..from.len()).map(weight).sum();
    let centre =
        |set: &[Vector3<f64>]| set.iter().enumerate().map(|(i, p)| p * (weight(i) / total)).sum::<Vector3<f64>>();
    let (centre_from, centre_to) = (centre(from), centre(to));
    for (set, centre) in [(from, centre_from), (to, centre_to)] {
        check_extent(set, &centre, weight)?;
    }
    let correlation: Matrix3<f64> =
        (0..from.len()).map(|i| (to[i] - centre_to) * (from[i] - centre_from).transpose() * (weight(i) / total)).sum();
    let (rotation, condition) = kabsch(&correlation)?;
    let transform = Rigid { rotation, translation: centre_to - rotation * centre_from };
    let square = |i: usize| (transform.apply(&from[i]) - to[i]).norm_squared() * weight(i) / total;
    let rms = (0..from.len()).map(square).sum::<f64>().sqrt();
    Ok(ProcrustesFit { transform, rms, condition })
}

fn check_extent(set: &[Vector3<f64>], centre: &Vector3<f64>, weight: impl Fn(usize) -> f64) -> Result<()> {
    let rows: Vec<[f64; 3]> = set.iter().enumerate().map(|(i, p)| ((p - centre) * weight(i).sqrt()).into()).collect();
    let extents = right_singular(&rows).values;
    let size = set.iter().enumerate().fold(0.0f64, |m, (i, p)| m.max(p.amax() * weight(i).sqrt()));
    if extents[0] <= 1e-12 * size || extents[0] == 0.0 {
        return Err(Error::degenerate(Degeneracy::Coincident, "all points of a set coincide"));
    }
    if extents[1] <= MIN_EXTENT * extents[0] {
        return Err(Error::degenerate(Degeneracy::Collinear, "the rotation about the points' line is free"));
    }
    Ok(())
}

/// The rotation R with the largest trace(R^T m) and the condition of its curvature.
pub(super) fn kabsch(m: &Matrix3<f64>) -> Result<(Matrix3<f64>, f64)> {
    let unclear = || {
        Error::degenerate(
            Degeneracy::IllConditioned,
            "the two sets do not fix a rotation: do they match, in this order?",
        )
    };
    let size = m.amax();
    if !(size.is_finite() && size > 0.0) {
        return Err(unclear());
    }
    let svd = (m / size).try_svd(true, true, f64::EPSILON, 200).ok_or_else(unclear)?;
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Err(unclear()) };
    let sign = (u * v_t).determinant().signum();
    let (s, least) = (svd.singular_values, svd.singular_values[2] * sign);
    // The curvatures of the cost about the three axes are s0 + s1, s0 + s2 and s1 + s2.
    let (high, low) = (s[0] + s[1], s[1] + least);
    if low <= 1e-12 * high {
        return Err(unclear());
    }
    Ok((u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t, high / low))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rigid::exp;

    fn cloud() -> Vec<Vector3<f64>> {
        [[0.3, -1.0, 2.0], [1.4, 0.2, 2.5], [-0.7, 0.9, 3.1], [0.1, 0.4, 4.0], [2.0, -0.6, 1.2]]
            .map(Vector3::from)
            .into()
    }

    fn motion() -> Rigid {
        Rigid { rotation: exp(&Vector3::new(0.3, -1.2, 2.0)), translation: Vector3::new(5.0, -0.2, 0.7) }
    }

    fn moved(set: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        set.iter().map(|p| motion().apply(p)).collect()
    }

    #[test]
    fn a_motion_is_found_from_any_set_that_is_not_a_line() {
        // Five points, and three, which lie in a plane.
        for count in [5, 3] {
            let from = &cloud()[..count];
            let fit = procrustes(from, &moved(from), None).unwrap();
            assert!((fit.transform.rotation - motion().rotation).amax() < 1e-13);
            assert!((fit.transform.translation - motion().translation).norm() < 1e-12);
            assert!(fit.rms < 1e-13 && fit.condition >= 1.0);
        }
    }

    #[test]
    fn the_optimum_beats_its_neighbours() {
        let from = cloud();
        let mut to = moved(&from);
        to[0].x += 0.3;
        to[3].y -= 0.2;
        let weights = [1.0, 2.0, 0.5, 3.0, 0.0];
        let fit = procrustes(&from, &to, Some(&weights)).unwrap();
        let cost = |t: &Rigid| -> f64 {
            from.iter().zip(&to).zip(weights).map(|((f, t2), w)| w * (t.apply(f) - t2).norm_squared()).sum()
        };
        assert!((fit.rms - (cost(&fit.transform) / 6.5).sqrt()).abs() < 1e-14);
        for i in 0..6 {
            for s in [1e-4, -1e-4] {
                let e = Vector3::ith(i % 3, s);
                let mut other = fit.transform;
                if i < 3 {
                    other.rotation = exp(&e) * other.rotation
                } else {
                    other.translation += e
                }
                assert!(cost(&other) > cost(&fit.transform));
            }
        }
    }

    #[test]
    fn a_mirrored_set_gives_a_rotation_and_a_residual() {
        let from = cloud();
        let mirrored: Vec<_> = from.iter().map(|p| Vector3::new(-p.x, p.y, p.z)).collect();
        let fit = procrustes(&from, &mirrored, None).unwrap();
        assert!((fit.transform.rotation.determinant() - 1.0).abs() < 1e-12);
        assert!(fit.rms > 0.1);
    }

    #[test]
    fn degenerate_and_bad_sets_are_refused() {
        let from = cloud();
        let kind = |e: Error| match e {
            Error::Degenerate { kind, .. } => Some(kind),
            _ => None,
        };
        let line: Vec<_> = (0..5).map(|i| Vector3::new(1.0, 2.0, 3.0) * i as f64).collect();
        assert_eq!(kind(procrustes(&from, &line, None).unwrap_err()), Some(Degeneracy::Collinear));
        assert_eq!(kind(procrustes(&line, &from, None).unwrap_err()), Some(Degeneracy::Collinear));
        let one = vec![Vector3::new(1.0, 2.0, 3.0); 5];
        assert_eq!(kind(procrustes(&from, &one, None).unwrap_err()), Some(Degeneracy::Coincident));
        assert!(matches!(procrustes(&from[..2], &from[..2], None), Err(Error::TooFewPoints { given: 2, needed: 3 })));
        assert!(matches!(
            procrustes(&from, &from, Some(&[1.0, 1.0, 0.0, 0.0, 0.0])),
            Err(Error::TooFewPoints { given: 2, .. })
        ));
        assert!(procrustes(&from, &from[1..], None).is_err());
        assert!(procrustes(&from, &from, Some(&[1.0, -1.0, 1.0, 1.0, 1.0])).is_err());
        let mut bad = from.clone();
        bad[3].z = f64::NAN;
        assert_eq!(procrustes(&from, &bad, None).unwrap_err(), Error::NotFinite { name: "to", index: 3 });
        // A regular tetrahedron and its mirror image: every rotation is as bad as another.
        let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]].map(Vector3::from);
        let mirrored = corners.map(|p| -p);
        assert_eq!(kind(procrustes(&corners, &mirrored, None).unwrap_err()), Some(Degeneracy::IllConditioned));
    }
}
