//! Where a yes-or-no answer over pan and tilt is yes, from few answers: a Gaussian process through them,
//! and where to ask next (the straddle heuristic; Bryan and others, Active learning for identifying
//! function level boundaries, NIPS 2005).

/// Where the field is unknown it is a no: what nobody has looked at is not seen.
const PRIOR: f64 = -1.0;
/// Answers are -1 and 1. What is a little nearer to no than to yes still counts as yes: a range that is
/// too wide costs shots, one too narrow a part of the picture.
const LEVEL: f64 = -0.2;
/// How far answers reach, radians.
const REACH: f64 = 8.0 * std::f64::consts::PI / 180.0;
/// Variance of an answer, so that two at one place may differ.
const NOISE: f64 = 0.01;
/// Standard deviations by which a place may still cross the level.
const STRADDLE: f64 = 1.0;
/// Tilt counts more than pan: pictures are wider than high.
const TILT_WEIGHT: f64 = 1.3;

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(TILT_WEIGHT * (a[1] - b[1]))
}

/// The Matern covariance of smoothness 3/2: of fields with sharp rims.
fn kernel(a: [f64; 2], b: [f64; 2]) -> f64 {
    let r = 3f64.sqrt() * apart(a, b) / REACH;
    (1.0 + r) * (-r).exp()
}

/// A place that may be asked about, with what the answers so far say of it.
#[derive(Debug)]
struct Candidate {
    at: [f64; 2],
    /// The inverse of the answers' Cholesky factor times their covariances with it.
    whitened: Vec<f64>,
    variance: f64,
    /// One for each question.
    means: Vec<f64>,
    /// Distance to the nearest answer.
    nearest: f64,
}

/// The answers to several questions, asked at the same places.
#[derive(Debug)]
pub(super) struct LevelSet {
    places: Vec<[f64; 2]>,
    /// Rows of the Cholesky factor of the answers' covariance, up to the diagonal.
    factor: Vec<Vec<f64>>,
    /// For each question: the factor's inverse times the answers less the prior.
    whitened: Vec<Vec<f64>>,
    candidates: Vec<Candidate>,
}

impl LevelSet {
    pub fn new(questions: usize, candidates: impl Iterator<Item = [f64; 2]>) -> Self {
        let unknown = |at| Candidate {
            at,
            whitened: Vec::new(),
            variance: 1.0,
            means: vec![PRIOR; questions],
            nearest: f64::INFINITY,
        };
        Self {
            places: Vec::new(),
            factor: Vec::new(),
            whitened: vec![Vec::new(); questions],
            candidates: candidates.map(unknown).collect(),
        }
    }

    /// Answers given so far.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Takes in an answer to each question.
    pub fn add(&mut self, at: [f64; 2], answers: impl Iterator<Item = bool>) {
        let mut row: Vec<f64> = Vec::with_capacity(self.places.len() + 1);
        for (place, earlier) in self.places.iter().zip(&self.factor) {
            let known = dot(earlier, &row);
            row.push((kernel(at, *place) - known) / earlier.last().copied().unwrap_or(1.0));
        }
        let diagonal = (1.0 + NOISE - dot(&row, &row)).max(NOISE).sqrt();
        for (whitened, yes) in self.whitened.iter_mut().zip(answers) {
            let answer = if yes { 1.0 } else { -1.0 };
            whitened.push((answer - PRIOR - dot(&row, whitened)) / diagonal);
        }
        for c in &mut self.candidates {
            let new = (kernel(at, c.at) - dot(&row, &c.whitened)) / diagonal;
            c.whitened.push(new);
            c.variance -= new * new;
            for (mean, whitened) in c.means.iter_mut().zip(&self.whitened) {
                *mean += new * whitened.last().copied().unwrap_or(0.0);
            }
            c.nearest = c.nearest.min(apart(at, c.at));
        }
        row.push(diagonal);
        self.factor.push(row);
        self.places.push(at);
    }

    /// The candidate about which an answer is the most doubtful, farther than `tolerance` from all
    /// answers; `None` when nothing is in doubt.
    pub fn most_doubtful(&self, question: usize, tolerance: f64) -> Option<[f64; 2]> {
        let doubt = |c: &Candidate| STRADDLE * c.variance.max(0.0).sqrt() - (c.means[question] - LEVEL).abs();
        let open = self.candidates.iter().filter(|c| c.nearest > tolerance).map(|c| (doubt(c), c.at));
        let best = open.max_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.0 > 0.0).then_some(best.1)
    }

    /// Says of any place whether the answer to a question is yes.
    pub fn rule(&self, question: usize) -> impl Fn([f64; 2]) -> bool {
        // The transposed factor's inverse times the whitened answers.
        let mut weights = self.whitened[question].clone();
        for i in (0..weights.len()).rev() {
            weights[i] /= self.factor[i][i];
            let (above, w) = (&self.factor[i], weights[i]);
            weights[..i].iter_mut().zip(above).for_each(|(x, l)| *x -= l * w);
        }
        move |at| {
            let sum: f64 = self.places.iter().zip(&weights).map(|(p, w)| kernel(*p, at) * w).sum();
            PRIOR + sum > LEVEL
        }
    }
}

/// Of as many members as the shorter has.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn grid() -> impl Iterator<Item = [f64; 2]> {
        (0..21 * 21).map(|i| [f64::from(i % 21) * 0.05 - 0.5, f64::from(i / 21) * 0.05 - 0.5])
    }

    /// Against the textbook's formulas with dense matrices (Rasmussen and Williams 2006, eqs 2.25, 2.26).
    #[test]
    fn means_and_variances_are_those_of_dense_matrices() {
        let mut field = LevelSet::new(2, grid());
        let places: Vec<[f64; 2]> =
            (0..12).map(|i| [(f64::from(i) * 0.37).sin() * 0.4, (f64::from(i) * 0.81).cos() * 0.4]).collect();
        let answers = |at: &[f64; 2]| [at[0] > 0.0, at[0] + at[1] > 0.1];
        places.iter().for_each(|p| field.add(*p, answers(p).into_iter()));
        let n = places.len();
        let k = DMatrix::from_fn(n, n, |i, j| kernel(places[i], places[j]) + if i == j { NOISE } else { 0.0 });
        let inverse = k.try_inverse().unwrap();
        for q in 0..2 {
            let y = DVector::from_fn(n, |i, _| if answers(&places[i])[q] { 1.0 } else { -1.0 } - PRIOR);
            let rule = field.rule(q);
            for c in &field.candidates {
                let cross = DVector::from_fn(n, |i, _| kernel(places[i], c.at));
                let mean = PRIOR + cross.dot(&(&inverse * &y));
                assert!((c.means[q] - mean).abs() < 1e-9 && c.means[q].is_finite());
                assert!((c.variance - (1.0 - cross.dot(&(&inverse * &cross)))).abs() < 1e-9);
                assert!((mean - LEVEL).abs() < 1e-9 || rule(c.at) == (mean > LEVEL));
            }
        }
    }

    #[test]
    fn a_disc_is_found_with_few_questions() {
        let yes = |at: [f64; 2]| at[0].hypot(at[1] - 0.1) < 0.3;
        let mut field = LevelSet::new(1, grid());
        field.add([0.0, 0.0], std::iter::once(true));
        while let Some(at) = field.most_doubtful(0, 0.04).filter(|_| field.len() < 60) {
            field.add(at, std::iter::once(yes(at)));
        }
        let wrong = |field: &LevelSet| {
            let rule = field.rule(0);
            grid().filter(|at| rule(*at) != yes(*at)).count()
        };
        let wrong = wrong(&field);
        println!("{} questions, {wrong} of 441 wrong", field.len());
        assert!(wrong < 441 / 20);
        // Twice the same question is no harm, and one that nobody answered is a no.
        field.add([0.0, 0.0], std::iter::once(true));
        assert!(field.rule(0)([0.0, 0.0]) && !LevelSet::new(1, grid()).rule(0)([0.0, 0.0]));
    }
}
