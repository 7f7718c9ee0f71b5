//! Whether a pose between two stations can be true: surfaces must meet surfaces, and none may lie where
//! the other station saw through.

use nalgebra::Vector3;

use crate::geometry::{Plane, Rigid};
use crate::pose::planes::view::{Sight, View};

/// A surface is met within so many metres and so much of its distance.
const MARGIN: f64 = 0.04;
const TOLERANCE: f64 = 0.02;

/// What two views say of a pose between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Verdict {
    /// Places of one where the other has a surface too.
    pub met: usize,
    /// Places of one through which the other saw.
    pub crossed: usize,
    /// Of those that met, the ones on none of the planes that the pose was made from.
    pub confirmed: usize,
    /// Of those that did not, the ones on none of these planes.
    pub refuted: usize,
    /// All places that were looked up.
    pub asked: usize,
    /// Places through which the other saw, in each part of a and then of b: neighbours are one witness, for what
    /// was moved or badly measured there concerns them all.
    witnesses: Vec<u16>,
}

impl Verdict {
    /// Of the places that both saw, those that agree; 0 where there are none.
    pub fn agreement(&self) -> f64 {
        self.met as f64 / (self.met + self.crossed).max(1) as f64
    }

    /// Of all places, those that agree, less those that do not and weigh more: a true pose has few of
    /// them, a false one many.
    pub fn score(&self) -> f64 {
        (self.met as f64 - 2.0 * self.crossed as f64) / self.asked.max(1) as f64
    }

    /// The probability that chance contradicts another pose of the same views in so many more places than this
    /// one, if it is as good: each witness that prefers one of them then prefers either with equal probability
    /// (the sign test; Dixon and Mood, JASA 1946). How loudly it says so is not counted, for places near each
    /// other are wrong together. Where surfaces meet tells less: poses whose stations are close to each other see
    /// more of the same.
    pub fn chance_over(&self, other: &Self) -> f64 {
        let witnesses = || other.witnesses.iter().zip(&self.witnesses);
        let for_this = witnesses().filter(|(q, p)| q > p).count();
        let all = for_this + witnesses().filter(|(q, p)| q < p).count();
        // P(Binomial(all, 1/2) >= for_this), terms from the top.
        let (mut term, mut tail) = (0.5f64.powi(all as i32), 0.0);
        for k in 0..=all - for_this {
            tail += term;
            term *= (all - k) as f64 / (k + 1) as f64;
        }
        tail.min(1.0)
    }
}

/// Looks up about so many places of each view in the other.
/// `used`: the planes that the pose was made from, in a's frame.
pub(super) fn judge(a: &View, b: &View, b_to_a: &Rigid, used: &[Plane], places: usize) -> Verdict {
    let mut verdict = Verdict { witnesses: vec![0; a.parts() + b.parts()], ..Verdict::default() };
    let off = |x: &Vector3<f64>, range: f64| {
        used.iter().all(|p| p.signed_distance(x).abs() > 2.0 * (MARGIN + TOLERANCE * range))
    };
    let mut ask = |from: &View, to: &View, first: usize, transform: &Rigid, to_a: &Rigid| {
        let step = (from.count() / places).max(1);
        for (part, place, normal) in from.places().step_by(step) {
            verdict.asked += 1;
            let witness = &mut verdict.witnesses[first + part];
            let normal = normal.map(|n| transform.rotation * n);
            match to.sight(&transform.apply(&place), normal.as_ref(), MARGIN, TOLERANCE) {
                Sight::Surface => {
                    verdict.met += 1;
                    verdict.confirmed += usize::from(off(&to_a.apply(&place), place.norm()));
                }
                Sight::Contradiction => {
                    verdict.crossed += 1;
                    *witness += 1;
                    verdict.refuted += usize::from(off(&to_a.apply(&place), place.norm()));
                }
                Sight::Unknown => {}
            }
        }
    };
    ask(b, a, a.parts(), b_to_a, b_to_a);
    ask(a, b, 0, &b_to_a.inverse(), &Rigid::identity());
    verdict
}
