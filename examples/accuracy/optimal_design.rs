//! The fewest shots that any choice of them could do with: the bound of the next best shots.

use nalgebra::DMatrix;
use ptzcal::study::information::{NoiseLevel, ShotRows, Unknowns};
use ptzcal::study::{NoiselessShot, Site};

/// Shots of the best design on these ones for a root mean square error of the position, `target` metres:
/// fractions and repeats allowed, every depth known beforehand. No beliefs about the camera.
///
/// The A-optimal design by the multiplicative algorithm (Silvey, Titterington and Torsney 1978). With phi the
/// trace that a design of one shot leaves and d the most that any candidate's information would take
/// from it, no design leaves less than phi^2 / d (the equivalence theorem of Kiefer and
/// Wolfowitz, for A-optimality: Fedorov 1972): what is returned holds however far the iteration went.
pub fn fewest_shots(site: &Site, shots: &[NoiselessShot], level: &NoiseLevel, target: f64) -> f64 {
    const ITERATIONS: usize = 2000;
    const CONVERGED: f64 = 1.002;
    let unknowns = Unknowns::of(site).expect("a site");
    let n = unknowns.count();
    let rows: Vec<ShotRows> = shots.iter().filter_map(|s| unknowns.rows(s.pan, s.tilt, s.depth, level)).collect();
    let mut weights = vec![1.0 / rows.len() as f64; rows.len()];
    let mut bound = 0.0f64;
    for _ in 0..ITERATIONS {
        let mut h = DMatrix::zeros(n, n);
        for (r, w) in rows.iter().zip(&weights) {
            unknowns.add(&mut h, &(r * w.sqrt()));
        }
        let covariance = unknowns.covariance(&h).expect("a camera");
        let position = covariance.columns(n - 3, 3).into_owned();
        let phi = position.rows(n - 3, 3).trace();
        let gains: Vec<f64> = rows.iter().map(|r| (r.columns(0, n) * &position).norm_squared()).collect();
        let most = gains.iter().copied().fold(0.0, f64::max);
        bound = bound.max(phi * phi / most);
        if most < CONVERGED * phi {
            break;
        }
        weights.iter_mut().zip(&gains).for_each(|(w, d)| *w *= (d / phi).sqrt());
        let total: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= total);
    }
    bound / (target * target)
}
