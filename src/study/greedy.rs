//! Which of many possible shots to take: one after the other the one that tells most.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::{DMatrix, Matrix3, SMatrix};

use super::information::{Accuracy, ShotRows, Unknowns, WIDTH};
use crate::error::{Degeneracy, Error, Result};

/// A shot chosen among candidates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chosen {
    pub candidate: usize,
    /// Of the fixed camera's position after this shot and all before it.
    pub after: Accuracy,
}

/// A shot to choose.
pub struct Candidate {
    pub rows: ShotRows,
    /// May it be chosen again and again? The best designs repeat a few shots (Kiefer and Wolfowitz 1959).
    pub again: bool,
}

/// Chooses until `enough` says so, or none is left. `h` is the information that is there already, `seen`
/// the number of shots that it comes from; `first` are taken before all others.
///
/// While shots are fewer than unknowns the one that lowers the volume of the whole covariance most is
/// taken (D-optimal), then the one that lowers the trace of the position's covariance most (A-optimal).
/// A gain is looked up again only when it is the greatest of those known (lazy evaluation, Minoux
/// 1978): exact where gains only fall, as they do for D. For A they can also rise, so all are looked up again
/// every few choices.
///
/// # Errors
/// `Degenerate` when even beliefs of no width do not give a covariance.
pub fn choose(
    unknowns: &Unknowns<'_>,
    h: &DMatrix<f64>,
    seen: usize,
    candidates: &[Candidate],
    first: &[usize],
    mut enough: impl FnMut(&[Chosen], &Accuracy) -> Result<bool>,
) -> Result<Vec<Chosen>> {
    const REFRESH: usize = 8;
    /// Rounding of the updates is swept away so often; while they are few, they are large, and it always is.
    const RENEW: usize = 64;
    let n = unknowns.count();
    let undetermined =
        || Error::degenerate(Degeneracy::IllConditioned, "the shots and beliefs do not determine the unknowns");
    let mut information = h + unknowns.diffuse();
    let mut state = State::new(&unknowns.covariance(&information).ok_or_else(undetermined)?);
    let mut chosen: Vec<Chosen> = Vec::new();
    let mut heap = BinaryHeap::new();
    let mut left = vec![true; candidates.len()];
    let mut accuracy = state.accuracy().ok_or_else(undetermined)?;
    while !enough(&chosen, &accuracy)? {
        let whole = seen + chosen.len() < n;
        if chosen.len().is_multiple_of(REFRESH) || whole {
            let gain =
                |i: usize| Gain { value: state.gain(&candidates[i].rows, whole), candidate: i, at: chosen.len() };
            heap = (0..candidates.len()).filter(|i| left[*i]).map(gain).collect();
        }
        let candidate = match first.get(chosen.len()) {
            Some(candidate) => {
                heap.retain(|gain| gain.candidate != *candidate || candidates[*candidate].again);
                *candidate
            }
            None => {
                let Some(gain) = best(&mut heap, chosen.len(), |i| state.gain(&candidates[i].rows, whole)) else {
                    break;
                };
                let candidate = gain.candidate;
                if candidates[candidate].again {
                    heap.push(gain);
                }
                candidate
            }
        };
        let Candidate { rows, again } = &candidates[candidate];
        left[candidate] = *again;
        unknowns.add(&mut information, rows);
        if seen + chosen.len() < 3 * n || chosen.len().is_multiple_of(RENEW) {
            state = State::new(&unknowns.covariance(&information).ok_or_else(undetermined)?);
        } else {
            state.take(rows);
        }
        accuracy = state.accuracy().ok_or_else(undetermined)?;
        chosen.push(Chosen { candidate, after: accuracy });
    }
    Ok(chosen)
}

/// The candidate with the greatest gain, its gain brought up to date.
fn best(heap: &mut BinaryHeap<Gain>, at: usize, now: impl Fn(usize) -> f64) -> Option<Gain> {
    loop {
        let gain = heap.pop()?;
        if gain.at == at {
            return Some(gain);
        }
        heap.push(Gain { value: now(gain.candidate), at, ..gain });
    }
}

/// What a candidate would gain when `at` were chosen.
struct Gain {
    value: f64,
    candidate: usize,
    at: usize,
}

impl Ord for Gain {
    /// Of equal ones the first candidate.
    fn cmp(&self, other: &Self) -> Ordering {
        self.value.total_cmp(&other.value).then(other.candidate.cmp(&self.candidate))
    }
}

impl PartialOrd for Gain {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Gain {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Gain {}

/// The covariance, kept up to date shot by shot (Woodbury's identity).
pub struct State {
    covariance: Box<SMatrix<f64, WIDTH, WIDTH>>,
    /// Where the position begins.
    position: usize,
}

impl State {
    pub fn new(covariance: &DMatrix<f64>) -> Self {
        let n = covariance.nrows();
        let mut all = Box::new(SMatrix::<f64, WIDTH, WIDTH>::zeros());
        all.view_mut((0, 0), (n, n)).copy_from(covariance);
        Self { covariance: all, position: n - 3 }
    }

    fn accuracy(&self) -> Option<Accuracy> {
        Accuracy::of(&self.covariance.fixed_view::<3, 3>(self.position, self.position).into_owned())
    }

    /// E C and (1 + E C E^T)^-1 of a shot's equations E.
    fn innovation(&self, rows: &ShotRows) -> Option<(ShotRows, Matrix3<f64>)> {
        let product = rows * *self.covariance;
        let s = Matrix3::identity() + product * rows.transpose();
        Some((product, s.cholesky()?.inverse()))
    }

    /// Of the position's covariance, m^2.
    pub fn trace(&self) -> f64 {
        self.covariance.fixed_view::<3, 3>(self.position, self.position).trace()
    }

    /// By how much ln det of the covariance (`whole`) or the position's trace would fall.
    pub fn gain(&self, rows: &ShotRows, whole: bool) -> f64 {
        let Some((product, inverse)) = self.innovation(rows) else { return 0.0 };
        if whole {
            return -inverse.determinant().ln();
        }
        let own = product.fixed_columns::<3>(self.position);
        (inverse * own * own.transpose()).trace()
    }

    fn take(&mut self, rows: &ShotRows) {
        if let Some((product, inverse)) = self.innovation(rows) {
            *self.covariance -= product.transpose() * inverse * product;
            *self.covariance = (*self.covariance + self.covariance.transpose()) * 0.5;
        }
    }
}
