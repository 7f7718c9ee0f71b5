//! A rig calibrated at several zoom positions: truth, the bound, coverage between the positions,
//! refusals.

#[path = "support/boards.rs"]
mod board;
#[path = "support/thesis.rs"]
mod thesis;
#[path = "support/zoom.rs"]
mod zoom;

use nalgebra::{DMatrix, DVector};
use ptzcal::calibrate::{CalibrationOptions, DistortionModel};
use ptzcal::geometry::zoom_curve::ZoomNode;
use ptzcal::geometry::{Distortion, ZoomCurve};
use ptzcal::rig_calibration::{RigCalibrated, RigCalibration};
use thesis::Noise;
use zoom::{PUPIL_SIGMA, SIZE, TrueView, ZOOMS, add, information, joint_bound, options, spec, truth, views};

fn free() -> CalibrationOptions {
    CalibrationOptions { skew_sigma: f64::INFINITY, aspect_sigma: f64::INFINITY, ..Default::default() }
}

fn head(zooms: &[f64], count: usize) -> Vec<(ZoomNode, Vec<TrueView>)> {
    zooms
        .iter()
        .map(|z| {
            let node = truth(*z, Distortion::None);
            let views = views(&node, count);
            (node, views)
        })
        .collect()
}

fn simulate(head: &[(ZoomNode, Vec<TrueView>)], sigma: f64, calibration: CalibrationOptions, seed: u64) -> RigCalibrated {
    let mut rig = RigCalibration::new(spec(), options(sigma, calibration)).unwrap();
    let mut noise = Noise::new(seed);
    head.iter().for_each(|(node, views)| add(&mut rig, node, views, sigma, &mut noise));
    rig.solve().unwrap()
}

fn nees(e: &[f64], c: &DMatrix<f64>) -> f64 {
    let s: Vec<f64> = (0..e.len()).map(|i| c[(i, i)].sqrt()).collect();
    let scaled = DMatrix::from_fn(e.len(), e.len(), |i, j| c[(i, j)] / (s[i] * s[j]));
    let z = DVector::from_fn(e.len(), |i, _| e[i] / s[i]);
    z.dot(&scaled.cholesky().expect("positive definite").solve(&z))
}

fn off(found: &[f64], truth: &ZoomNode) -> Vec<f64> {
    found.iter().zip(truth.parameters()).map(|(a, b)| a - b).collect()
}

#[test]
fn one_line_at_all_zooms_is_on_the_joint_bound() {
    let head = head(&ZOOMS, 12);
    let sigma = 0.3;
    let informations: Vec<_> = head.iter().map(|(node, views)| information(node, views, sigma)).collect();
    let bound = joint_bound(&informations, PUPIL_SIGMA);
    let runs = 30;
    let mut squares = vec![0.0; 36];
    let (mut covered, mut agreed) = (0.0, 0);
    for run in 0..runs {
        let found = simulate(&head, sigma, CalibrationOptions { robust: false, ..free() }, run);
        let common = found.common.clone().unwrap();
        println!("chi2 {} of {}", common.chi2, common.freedom);
        agreed += usize::from(common.agrees);
        let e: Vec<f64> = found
            .zooms
            .iter()
            .zip(&head)
            .flat_map(|(z, (truth, _))| off(&z.node.as_ref().unwrap().parameters(), truth))
            .collect();
        e.iter().zip(&mut squares).for_each(|(e, s)| *s += e * e / runs as f64);
        for k in 0..4 {
            let own = found.covariance.view((9 * k, 9 * k), (9, 9)).into_owned();
            covered += nees(&e[9 * k..9 * k + 9], &own) / (36 * runs) as f64;
        }
    }
    for k in 0..4 {
        for i in 0..9 {
            let j = 9 * k + i;
            let alone = zoom::inverse(&informations[k])[(i, i)].sqrt();
            println!("zoom {k} parameter {i}: rms {:.3e} bound {:.3e} alone {alone:.3e}", squares[j].sqrt(), bound[(j, j)].sqrt());
        }
    }
    println!("{agreed} agree; sqrt(NEES/p) {}", covered.sqrt());
}
