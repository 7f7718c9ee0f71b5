//! G6 over zoom: lens and laser line at 1x, 2x, 4x and 8x against the Cramer-Rao bound with one line for
//! all of them, their covariance, and the rig between those positions.

use nalgebra::{DMatrix, DVector};
use ptzcal::calibrate::CalibrationOptions;
use ptzcal::geometry::Distortion;
use ptzcal::geometry::zoom_curve::ZoomNode;
use ptzcal::rig_calibration::RigCalibration;

use super::figure::Figure;
use super::thesis::Noise;
use super::zoom_truth::{
    PUPIL_SIGMA, TrueView, ZOOMS, add, information, inverse, joint_bound, options, spec, truth, views,
};

const VIEWS: usize = 25;
/// Parameters of a position.
const N: usize = 9;

pub fn run(runs: usize, report: &mut impl FnMut(Vec<Figure>)) {
    for sigma in [0.2, 0.5] {
        report(positions(sigma, runs));
    }
    report(between(0.2, runs.div_ceil(4)));
}

fn head(zooms: &[f64]) -> Vec<(ZoomNode, Vec<TrueView>)> {
    let node = |z: &f64| truth(*z, Distortion::None);
    zooms.iter().map(|z| (node(z), views(&node(z), VIEWS))).collect()
}

fn calibration() -> CalibrationOptions {
    CalibrationOptions {
        skew_sigma: f64::INFINITY,
        aspect_sigma: f64::INFINITY,
        robust: false,
        ..CalibrationOptions::default()
    }
}

fn simulated(head: &[(ZoomNode, Vec<TrueView>)], sigma: f64, seed: u64) -> ptzcal::rig_calibration::RigCalibrated {
    let mut rig = RigCalibration::new(spec(), options(sigma, calibration())).expect("options");
    let mut noise = Noise::new(seed);
    head.iter().for_each(|(node, views)| add(&mut rig, node, views, sigma, &mut noise));
    rig.solve().expect("views")
}

fn positions(sigma: f64, runs: usize) -> Vec<Figure> {
    let head = head(&ZOOMS);
    let informations: Vec<_> = head.iter().map(|(node, views)| information(node, views, sigma)).collect();
    let bound = joint_bound(&informations, PUPIL_SIGMA);
    let mut squares = [0.0; 4 * N];
    let (mut covered, mut chi2) = (0.0, 0.0);
    for run in 0..runs {
        // The bound is that of shifts drawn from their prior.
        let mut head = head.clone();
        let mut noise = Noise::new(1_000_000 + run as u64);
        let line = head[0].0.laser;
        for (node, _) in &mut head[1..] {
            let shift = PUPIL_SIGMA * noise.gaussian();
            (node.laser.x0, node.laser.y0) = (line.x0 + line.vx * shift, line.y0 + line.vy * shift);
        }
        let found = simulated(&head, sigma, run as u64);
        chi2 += found.common.as_ref().expect("four positions").chi2 / (12 * runs) as f64;
        for (k, (zoom, (truth, _))) in found.zooms.iter().zip(&head).enumerate() {
            let e = off(&zoom.node.as_ref().expect("a position").parameters(), truth);
            e.iter().zip(&mut squares[N * k..]).for_each(|(e, s)| *s += e * e / runs as f64);
            covered += nees(&e, &found.covariance.view((N * k, N * k), (N, N)).into_owned()) / (4 * N * runs) as f64;
        }
    }
    let mut figures = Vec::new();
    for (k, name) in ["1x", "2x", "4x", "8x"].into_iter().enumerate() {
        let alone = inverse(&informations[k]);
        for (indices, what, unit, scale) in [
            (vec![0, 1], "f", "px", 1.0),
            (vec![3, 4], "principal point", "px", 1.0),
            (vec![5, 6], "x0 y0", "mm", 1e3),
            (vec![7, 8], "vx vy", "mrad", 1e3),
        ] {
            let root = |value: &dyn Fn(usize) -> f64| indices.iter().map(|i| value(*i)).sum::<f64>().sqrt() * scale;
            let (rms, bound) = (root(&|i| squares[N * k + i]), root(&|i| bound[(N * k + i, N * k + i)]));
            let own = root(&|i| alone[(i, i)]);
            let setup = format!("rig over zoom, {sigma} px, {name}: {what} (by itself {own:.3} {unit})");
            figures.push(Figure { goal: "G6", setup, figure: rms, unit, bound, ratio: rms / bound, limit: 1.10, runs });
        }
    }
    for (value, setup) in [(covered, "sqrt(NEES / 9)"), (chi2, "sqrt(chi2 / 12) of one line")] {
        let root = value.sqrt();
        figures.push(Figure {
            goal: "NEES",
            setup: format!("rig over zoom, {sigma} px: {setup}"),
            figure: root,
            unit: "",
            bound: 1.0,
            ratio: root.max(1.0 / root),
            limit: 1.05,
            runs,
        });
    }
    figures
}

/// Half-way between six positions, and near them: what the covariance says of the error there.
fn between(sigma: f64, runs: usize) -> Vec<Figure> {
    let zooms: Vec<f64> = (0..6).map(|i| f64::from(i) / 5.0).collect();
    let head = head(&zooms);
    let places: Vec<f64> = (0..10).map(|i| 0.05 + f64::from(i) / 10.0).collect();
    let names = ["fx", "fy", "skew", "cx", "cy", "x0", "y0", "vx", "vy"];
    let mut covered = [0.0; N];
    let mut relative = 0.0;
    for run in 0..runs {
        let curve = simulated(&head, sigma, run as u64).curve().expect("a curve");
        for z in &places {
            let at = curve.at(*z).expect("a rig");
            let node = ZoomNode {
                zoom: *z,
                intrinsics: at.model.intrinsics,
                distortion: at.model.distortion,
                laser: at.model.laser,
            };
            let truth = truth(*z, Distortion::None);
            let share = 1.0 / (runs * places.len()) as f64;
            for (i, e) in off(&node.parameters(), &truth).into_iter().enumerate() {
                covered[i] += share * e * e / at.covariance[(i, i)];
            }
            relative += share * (at.model.intrinsics.fx / truth.intrinsics.fx).ln().powi(2);
        }
    }
    let mut figures = vec![Figure {
        goal: "info",
        setup: format!("rig between six zooms, {sigma} px: f off by, rms"),
        figure: 100.0 * relative.sqrt(),
        unit: "%",
        bound: 0.0,
        ratio: 0.0,
        limit: f64::INFINITY,
        runs,
    }];
    for (name, covered) in names.into_iter().zip(covered) {
        // The spline's part is stated like a bound: what counts is that it covers.
        let root = covered.sqrt();
        let setup = format!("rig between six zooms: {name} over its sigma, rms");
        figures.push(Figure {
            goal: "cover",
            setup,
            figure: root,
            unit: "",
            bound: 1.0,
            ratio: root,
            limit: 1.05,
            runs,
        });
    }
    figures
}

fn off(found: &[f64], truth: &ZoomNode) -> Vec<f64> {
    found.iter().zip(truth.parameters()).map(|(a, b)| a - b).collect()
}

fn nees(e: &[f64], c: &DMatrix<f64>) -> f64 {
    let s: Vec<f64> = (0..e.len()).map(|i| c[(i, i)].sqrt()).collect();
    let scaled = DMatrix::from_fn(e.len(), e.len(), |i, j| c[(i, j)] / (s[i] * s[j]));
    let z = DVector::from_fn(e.len(), |i, _| e[i] / s[i]);
    z.dot(&scaled.cholesky().expect("a covariance").solve(&z))
}
