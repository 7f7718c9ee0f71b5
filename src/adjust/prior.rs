//! What is believed beforehand of a group of parameters.

use nalgebra::DMatrix;

use crate::error::{Error, Result};

/// A Gaussian about given values: the covariance of a group of parameters, in their order. A
/// parameter with variance 0 is fixed, one with infinite variance is free.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    covariance: DMatrix<f64>,
}

impl Prior {
    /// `count` parameters that keep their values.
    pub fn fixed(count: usize) -> Self {
        Self { covariance: DMatrix::zeros(count, count) }
    }

    /// `count` parameters of which nothing is known.
    pub fn free(count: usize) -> Self {
        Self::of_sigmas(&vec![f64::INFINITY; count])
    }

    /// Independent parameters with these standard deviations; 0 fixes, infinity frees.
    pub fn of_sigmas(sigmas: &[f64]) -> Self {
        // A negative one stays negative, to be refused with its name.
        let variance = |s: &f64| s * s.abs();
        let diagonal = nalgebra::DVector::from_iterator(sigmas.len(), sigmas.iter().map(variance));
        Self { covariance: DMatrix::from_diagonal(&diagonal) }
    }

    /// A full covariance, row and column for each parameter.
    pub fn of_covariance(covariance: DMatrix<f64>) -> Self {
        Self { covariance }
    }

    /// Replaces the block that begins at parameter `first`.
    ///
    /// # Panics
    /// When the block reaches past the last parameter.
    pub fn with_block(mut self, first: usize, covariance: &DMatrix<f64>) -> Self {
        let n = covariance.nrows();
        self.covariance.view_mut((first, first), (n, n)).copy_from(covariance);
        self
    }

    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    pub fn count(&self) -> usize {
        self.covariance.nrows()
    }

    /// The belief in information form. `name` names parameter i in errors.
    pub(crate) fn belief(&self, name: impl Fn(usize) -> String) -> Result<Belief> {
        let c = &self.covariance;
        let n = c.nrows();
        let bad = |i: usize, why: String| Err(Error::invalid("prior", format!("{}: {why}", name(i))));
        if c.ncols() != n {
            return Err(Error::invalid("prior", format!("a covariance of {n} x {}", c.ncols())));
        }
        let mut held = Vec::new();
        let mut free = vec![true; n];
        for i in 0..n {
            let v = c[(i, i)];
            if v.is_nan() || v < 0.0 {
                return bad(i, format!("a variance of {v}"));
            }
            free[i] = v > 0.0;
            if v > 0.0 && v.is_finite() {
                held.push(i);
            }
            for j in (0..n).filter(|j| *j != i) {
                let scale = (v * c[(j, j)]).sqrt();
                let skewed = (c[(i, j)] - c[(j, i)]).abs();
                if skewed.is_nan() || (scale.is_finite() && skewed > 1e-9 * scale) {
                    return bad(i, format!("its covariance with {} is not symmetric", name(j)));
                }
                if c[(i, j)] != 0.0 && (v == 0.0 || v.is_infinite()) {
                    return bad(i, format!("it is fixed or free, and yet correlated with {}", name(j)));
                }
            }
        }
        let block =
            DMatrix::from_fn(held.len(), held.len(), |i, j| 0.5 * (c[(held[i], held[j])] + c[(held[j], held[i])]));
        let mut information = DMatrix::zeros(n, n);
        if !held.is_empty() {
            let Some((inverse, _)) = crate::geometry::linalg::invert_spd(&block) else {
                let i = first_dependent(&block).map_or(held[0], |k| held[k]);
                return bad(i, "its covariance contradicts the others (not positive definite)".into());
            };
            for (a, &i) in held.iter().enumerate() {
                for (b, &j) in held.iter().enumerate() {
                    information[(i, j)] = inverse[(a, b)];
                }
            }
        }
        Ok(Belief { free, held, information })
    }
}

/// The first parameter whose leading minor is not positive definite.
fn first_dependent(m: &DMatrix<f64>) -> Option<usize> {
    (1..=m.nrows())
        .find(|k| crate::geometry::linalg::invert_spd(&m.view((0, 0), (*k, *k)).into_owned()).is_none())
        .map(|k| k - 1)
}

/// A prior in information form.
#[derive(Debug, Clone)]
pub(crate) struct Belief {
    /// Not fixed.
    pub free: Vec<bool>,
    /// Free with a finite variance.
    pub held: Vec<usize>,
    /// Zero where nothing is known, and where the parameter is fixed.
    pub information: DMatrix<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(prior: &Prior) -> String {
        prior.belief(|i| format!("parameter {i}")).unwrap_err().to_string()
    }

    #[test]
    fn zero_fixes_and_infinity_frees() {
        let belief = Prior::of_sigmas(&[0.0, 0.5, f64::INFINITY]).belief(|i| i.to_string()).unwrap();
        assert_eq!(belief.free, [false, true, true]);
        assert_eq!(belief.held, [1]);
        assert_eq!(belief.information[(1, 1)], 4.0);
        assert_eq!(belief.information.sum(), 4.0);
    }

    #[test]
    fn bad_covariances_are_refused_by_name() {
        assert!(fault(&Prior::of_sigmas(&[1.0, -2.0])).contains("parameter 1"));
        assert!(fault(&Prior::of_sigmas(&[f64::NAN])).contains("parameter 0"));
        let m = |rows: &[f64]| Prior::of_covariance(DMatrix::from_row_slice(2, 2, rows));
        assert!(fault(&m(&[1.0, 2.0, 2.0, 1.0])).contains("parameter 1: its covariance contradicts"));
        assert!(fault(&m(&[1.0, 0.5, 0.4, 1.0])).contains("not symmetric"));
        assert!(
            fault(&m(&[1.0, 0.5, 0.5, 0.0])).contains("parameter 0")
                || fault(&m(&[1.0, 0.5, 0.5, 0.0])).contains("parameter 1")
        );
        assert!(Prior::of_covariance(DMatrix::zeros(2, 3)).belief(|_| String::new()).is_err());
    }
}
