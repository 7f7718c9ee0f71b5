//! Rigid Procrustes: the rotation (determinant +1) and translation, without scale, that take one
//! point set to another (Kabsch 1976; Umeyama 1991 for the sign).

use nalgebra::{Matrix3, Vector3};

use crate::error::{Degeneracy, Error, Result};
use crate::geometry::Rigid;
use crate::geometry::linalg::symmetric_eigen3;

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
    if let Some(w) = weights
        && (w.len() != from.len() || w.iter().any(|w| !(w.is_finite() && *w >= 0.0)))
    {
        return Err(Error::invalid("weights", "one finite weight, not negative, for each point"));
    }
    let moments = Moments::of(from, to, weights);
    if !moments.is_finite() {
        for (name, set) in [("from", from), ("to", to)] {
            if let Some(index) = set.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
                return Err(Error::NotFinite { name, index });
            }
        }
        return Err(Error::invalid("from", "coordinates or weights are beyond measure"));
    }
    let used = weights.map_or(from.len(), |w| w.iter().filter(|w| **w > 0.0).count());
    if used < 3 {
        return Err(Error::TooFewPoints { given: used, needed: 3 });
    }
    let [centre_from, centre_to] = moments.centres();
    let [spread_from, spread_to, correlation] = moments.about_centres();
    for (spread, set) in [(spread_from, from), (spread_to, to)] {
        check_extent(&spread, set)?;
    }
    let (rotation, condition) = kabsch(&correlation)?;
    let transform = Rigid { rotation, translation: centre_to - rotation * centre_from };
    let squares = blocks(from, to, weights, |f, t, w| (transform.apply(f) - t).norm_squared() * w);
    Ok(ProcrustesFit { transform, rms: (squares / moments.weight).sqrt(), condition })
}

/// Points whose sums are added on their own: rounding does not grow with the number of points.
const BLOCK: usize = 256;

/// The sum of a function of each pair of points and its weight.
fn blocks<T: Default + std::ops::AddAssign>(
    from: &[Vector3<f64>],
    to: &[Vector3<f64>],
    weights: Option<&[f64]>,
    of: impl Fn(&Vector3<f64>, &Vector3<f64>, f64) -> T,
) -> T {
    let mut total = T::default();
    for (block, (from, to)) in from.chunks(BLOCK).zip(to.chunks(BLOCK)).enumerate() {
        let mut sum = T::default();
        match weights.map(|w| &w[BLOCK * block..]) {
            None => from.iter().zip(to).for_each(|(f, t)| sum += of(f, t, 1.0)),
            Some(weights) => from.iter().zip(to).zip(weights).for_each(|((f, t), w)| sum += of(f, t, *w)),
        }
        total += sum;
    }
    total
}

/// Weighted sums over pairs of points, about a place in the middle of each set.
struct Moments {
    origins: [Vector3<f64>; 2],
    weight: f64,
    sums: [Vector3<f64>; 2],
    /// Of from from^T, to to^T and to from^T.
    products: [Matrix3<f64>; 3],
}

impl Moments {
    /// Points that tell where the middle is.
    const MIDDLE: usize = 64;

    fn of(from: &[Vector3<f64>], to: &[Vector3<f64>], weights: Option<&[f64]>) -> Self {
        let middle = |set: &[Vector3<f64>]| {
            let some = || set.iter().step_by(set.len() / Self::MIDDLE + 1);
            some().sum::<Vector3<f64>>() / some().count().max(1) as f64
        };
        let origins = [middle(from), middle(to)];
        let mut moments = Self { origins, weight: 0.0, sums: Default::default(), products: Default::default() };
        let sum = blocks(from, to, weights, |f, t, w| {
            let (f, t) = (f - origins[0], t - origins[1]);
            let (wf, wt) = (f * w, t * w);
            Sums { weight: w, from: wf, to: wt, products: [wf * f.transpose(), wt * t.transpose(), wt * f.transpose()] }
        });
        (moments.weight, moments.sums, moments.products) = (sum.weight, [sum.from, sum.to], sum.products);
        moments
    }

    fn is_finite(&self) -> bool {
        self.weight.is_finite() && self.products.iter().all(|m| m.iter().all(|v| v.is_finite()))
    }

    fn centres(&self) -> [Vector3<f64>; 2] {
        [0, 1].map(|k| self.origins[k] + self.sums[k] / self.weight)
    }

    /// Mean products about the centres.
    fn about_centres(&self) -> [Matrix3<f64>; 3] {
        let [from, to] = self.sums.map(|s| s / self.weight);
        let [ff, tt, tf] = self.products.map(|m| m / self.weight);
        [ff - from * from.transpose(), tt - to * to.transpose(), tf - to * from.transpose()]
    }
}

#[derive(Default)]
struct Sums {
    weight: f64,
    from: Vector3<f64>,
    to: Vector3<f64>,
    products: [Matrix3<f64>; 3],
}

impl std::ops::AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        self.weight += other.weight;
        self.from += other.from;
        self.to += other.to;
        self.products.iter_mut().zip(other.products).for_each(|(sum, m)| *sum += m);
    }
}

/// `spread`: a set's mean products about its centre.
fn check_extent(spread: &Matrix3<f64>, set: &[Vector3<f64>]) -> Result<()> {
    let unclear = || Error::degenerate(Degeneracy::IllConditioned, "the extents of a set are beyond measure");
    let (values, _) = symmetric_eigen3(spread).ok_or_else(unclear)?;
    let size = set.iter().fold(0.0f64, |m, p| m.max(p.amax()));
    let extents = values.map(|v| v.max(0.0).sqrt());
    // What rounding leaves of coordinates.
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
