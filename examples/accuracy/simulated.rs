//! G2: closed form and refinement on NEAR and FAR against the Cramer-Rao bound; coverage of the
//! returned covariance.

use nalgebra::{DMatrix, DVector};
use ptzcal::calibrate::{Calibration, CalibrationOptions, calibrate_camera, dlt};
use ptzcal::geometry::{Camera, rigid};

use super::figure::Figure;
use super::thesis::{Noise, Shot, far, laser_set, near, point_set, rig, world};

/// All eleven parameters free.
pub fn free(sigma: f64) -> CalibrationOptions {
    CalibrationOptions {
        skew_sigma: f64::INFINITY,
        aspect_sigma: f64::INFINITY,
        pixel_sigma: Some(sigma),
        robust: false,
        max_focal_deviation: f64::INFINITY,
        ..Default::default()
    }
}

pub fn run(runs: usize, report: &mut impl FnMut(Vec<Figure>)) {
    for (name, truth) in [("NEAR", near()), ("FAR", far())] {
        for n in [40, 200, 2021] {
            let shots = world(&truth, n);
            // Small sets are cheap: more runs, less scatter in the ratio.
            let runs = if n < 1000 { 5 * runs } else { runs };
            for sigma in [0.2, 1.0] {
                report(shots_against_bound(name, &truth, &shots, sigma, runs));
            }
        }
        for n in [40, 200, 2021] {
            let shots = world(&truth, n);
            for sigma in [0.2, 1.0] {
                report(vec![coverage(name, &truth, &shots, sigma, runs)]);
            }
        }
    }
}

fn shots_against_bound(name: &str, truth: &Camera, shots: &[Shot], sigma: f64, runs: usize) -> Vec<Figure> {
    let bound = bound(truth, shots, sigma);
    let (mut closed, mut refined) = (0.0, 0.0);
    for run in 0..runs {
        let set = laser_set(shots, sigma, sigma, &mut Noise::new(run as u64));
        let p = dlt::closed_form(&set).expect("a projection matrix");
        let (_, pose) = ptzcal::calibrate::decompose::decompose(&p).expect("a camera");
        closed += (pose.centre() - truth.centre()).norm_squared();
        let c = calibrate_camera(&set, &free(sigma)).expect("a calibration");
        refined += (c.camera.centre() - truth.centre()).norm_squared();
    }
    let figure = |goal, method: &str, sum: f64, limit| {
        let rms = (sum / runs as f64).sqrt();
        Figure {
            goal,
            setup: format!("{name}, {} shots, {sigma} px, {method}: centre rms", shots.len()),
            figure: rms * 1e3,
            unit: "mm",
            bound: bound * 1e3,
            ratio: rms / bound,
            limit,
            runs,
        }
    };
    vec![figure("G2", "closed form", closed, 1.10), figure("G1", "refined", refined, 1.05)]
}

/// Cramer-Rao bound of the centre (rms length) for shots whose depths are measured: Fisher
/// information at the truth with one unknown inverse depth a shot, by central differences of the
/// projection alone, so that it shares no derivative with the solver.
fn bound(truth: &Camera, shots: &[Shot], sigma: f64) -> f64 {
    let rig = rig();
    let camera = |p: &[f64; 11]| {
        let mut c = *truth;
        let k = truth.intrinsics.to_array();
        c.intrinsics = ptzcal::geometry::Intrinsics::from_array(std::array::from_fn(|i| k[i] + p[i]));
        let turn = rigid::exp(&nalgebra::Vector3::new(p[5], p[6], p[7])) * truth.pose.rotation;
        let centre = truth.centre() + nalgebra::Vector3::new(p[8], p[9], p[10]);
        c.pose = ptzcal::geometry::Rigid::from_centre(turn, &centre);
        c
    };
    let baseline = rig.laser.x0.hypot(rig.laser.y0) * rig.intrinsics.fx;
    let mut h = DMatrix::<f64>::zeros(11, 11);
    for s in shots {
        let (o, d) = rig.laser_in_world(s.pan, s.tilt);
        let z = (s.point - o).dot(&d) / d.dot(&d);
        let at = |p: &[f64; 11], rho: f64| camera(p).project(&(o + d / rho)).expect("in view");
        let mut j = DMatrix::<f64>::zeros(2, 11);
        let zero = [0.0; 11];
        for i in 0..11 {
            let step = if i < 5 { 1e-3 } else { 1e-6 };
            let (mut plus, mut minus) = (zero, zero);
            plus[i] = step;
            minus[i] = -step;
            j.set_column(i, &((at(&plus, 1.0 / z) - at(&minus, 1.0 / z)) / (2.0 * step)));
        }
        let slope = (at(&zero, 1.0 / z + 1e-6) - at(&zero, 1.0 / z - 1e-6)) / 2e-6;
        let b = j.transpose() * slope;
        h += j.transpose() * &j - &b * b.transpose() / (slope.norm_squared() + baseline * baseline);
    }
    let scale = DVector::from_fn(11, |i, _| 1.0 / h[(i, i)].sqrt());
    let inverse = DMatrix::from_fn(11, 11, |i, k| h[(i, k)] * scale[i] * scale[k])
        .cholesky()
        .expect("an observable camera")
        .inverse();
    sigma * (8..11).map(|i| inverse[(i, i)] * scale[i] * scale[i]).sum::<f64>().sqrt()
}

/// Normalised estimation error squared: e^T C^-1 e over all parameters that were free.
pub fn nees(c: &Calibration, truth: &Camera) -> f64 {
    let turn = rigid::log(&(c.camera.pose.rotation * truth.pose.rotation.transpose()));
    let off = c.camera.centre() - truth.centre();
    let lens = |camera: &Camera| [&camera.intrinsics.to_array()[..], camera.distortion.coefficients()].concat();
    let (k, k0) = (lens(&c.camera), lens(truth));
    let e: Vec<f64> =
        k.iter().zip(&k0).map(|(a, b)| a - b).chain(turn.iter().copied()).chain(off.iter().copied()).collect();
    let free: Vec<usize> = (0..e.len()).filter(|i| c.covariance[(*i, *i)] > 0.0).collect();
    let s: Vec<f64> = free.iter().map(|i| 1.0 / c.covariance[(*i, *i)].sqrt()).collect();
    let scaled = DMatrix::from_fn(s.len(), s.len(), |i, j| c.covariance[(free[i], free[j])] * s[i] * s[j]);
    let z = DVector::from_fn(s.len(), |i, _| e[free[i]] * s[i]);
    z.dot(&scaled.cholesky().expect("a covariance").solve(&z))
}

fn coverage(name: &str, truth: &Camera, shots: &[Shot], sigma: f64, runs: usize) -> Figure {
    let sum: f64 = (0..runs)
        .map(|run| {
            let set = point_set(shots, sigma, &mut Noise::new(run as u64));
            nees(&calibrate_camera(&set, &free(sigma)).expect("a calibration"), truth)
        })
        .sum();
    let root = (sum / (11 * runs) as f64).sqrt();
    Figure {
        goal: "NEES",
        setup: format!("{name}, {} exact points, {sigma} px: sqrt(NEES / 11)", shots.len()),
        figure: root,
        unit: "",
        bound: 1.0,
        ratio: root.max(1.0 / root),
        limit: 1.05,
        runs,
    }
}
