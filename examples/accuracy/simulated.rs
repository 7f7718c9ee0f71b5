//! G1, G2: closed form and refinement on NEAR and FAR against the Cramer-Rao bound; G8: the thesis's
//! own geometry; coverage of the returned covariance.

use nalgebra::Vector3;
use ptzcal::calibrate::{CalibrationOptions, Correspondences, calibrate_camera, decompose, dlt};
use ptzcal::geometry::{Camera, rigid};

use super::bounds::{self, RigMatrix};
use super::figure::Figure;
use super::groups::{GROUPS, error, nees, roots, squared};
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
            // As many runs as keep the ratio's own scatter (1 / sqrt(2 runs) a coordinate) far below
            // the limit's distance from 1.
            let runs = if n < 1000 { 10 * runs } else { 4 * runs };
            for sigma in [0.2, 1.0, 2.0] {
                report(shots_against_bound(name, &truth, &shots, sigma, runs));
            }
        }
        for n in [40, 200, 2021] {
            let shots = world(&truth, n);
            for sigma in [0.2, 1.0] {
                report(vec![coverage(name, &truth, &shots, sigma, 2 * runs)]);
            }
        }
    }
    for degrees in [1.0, 5.0] {
        report(thesis_geometry(degrees, 5 * runs));
    }
}

fn shots_against_bound(name: &str, truth: &Camera, shots: &[Shot], sigma: f64, runs: usize) -> Vec<Figure> {
    let bound = roots(&bounds::shots(truth, shots, sigma, &rig(), &RigMatrix::zeros()));
    let (mut closed, mut refined, mut covered, mut thesis) = (0.0, [0.0; 4], 0.0, 0.0);
    for run in 0..runs {
        let set = laser_set(shots, sigma, sigma, &mut Noise::new(run as u64));
        let p = dlt::closed_form(&set).expect("a projection matrix");
        let (_, pose) = decompose::decompose(&p).expect("a camera");
        closed += (pose.centre() - truth.centre()).norm_squared();
        let c = calibrate_camera(&set, &free(sigma)).expect("a calibration");
        let e = error(&c.camera, truth);
        squared(&e).iter().zip(&mut refined).for_each(|(e, s)| *s += e);
        covered += nees(&e, &c.covariance).0;
        thesis += thesis_error(&set, truth);
    }
    let root = |sum: f64| (sum / runs as f64).sqrt();
    let setup = |what: &str| format!("{name}, {} shots, {sigma} px, {what}", shots.len());
    let figure = |goal, what: String, rms: f64, group: usize, limit| {
        let (_, unit, factor) = GROUPS[group];
        let (figure, ratio) = (rms * factor, rms / bound[group]);
        Figure { goal, setup: setup(&what), figure, unit, bound: bound[group] * factor, ratio, limit, runs }
    };
    let mut figures = vec![figure("G2", "closed form: centre rms".into(), root(closed), 0, 1.10)];
    figures.extend((0..4).map(|g| figure("G1", format!("refined: {} rms", GROUPS[g].0), root(refined[g]), g, 1.05)));
    figures.push(figure("thesis", "eqs (14)-(16) + DLT: centre rms".into(), root(thesis), 0, f64::INFINITY));
    let covered = root(covered / 11.0);
    let ratio = covered.max(1.0 / covered);
    let setup = setup("sqrt(NEES / 11)");
    figures.push(Figure { goal: "NEES", setup, figure: covered, unit: "", bound: 1.0, ratio, limit: 1.05, runs });
    figures
}

/// Squared error of the centre by the thesis's method: 3D points from depths, then DLT-Points.
fn thesis_error(set: &Correspondences, truth: &Camera) -> f64 {
    let (mut world, mut pixels) = (Vec::new(), Vec::new());
    for o in set.observations() {
        if let ptzcal::calibrate::Observation::Shot { shot, pixel, .. } = o
            && let Some(point) = shot.point()
        {
            world.push(point);
            pixels.push(*pixel);
        }
    }
    let p = dlt::points(&world, &pixels).expect("a projection matrix");
    let (_, pose) = decompose::decompose(&p).expect("a camera");
    (pose.centre() - truth.centre()).norm_squared()
}

fn coverage(name: &str, truth: &Camera, shots: &[Shot], sigma: f64, runs: usize) -> Figure {
    let sum: f64 = (0..runs)
        .map(|run| {
            let set = point_set(shots, sigma, &mut Noise::new(run as u64));
            let c = calibrate_camera(&set, &free(sigma)).expect("a calibration");
            nees(&error(&c.camera, truth), &c.covariance).0
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

/// Section VII of the thesis: 25 depths of one laser ray, turned by four small pan/tilt steps.
fn thesis_geometry(degrees: f64, runs: usize) -> Vec<Figure> {
    let (truth, laser, sigma) = (near(), rig().laser, 0.2);
    let mut points = Vec::new();
    for (pan, tilt) in [(0.0, 0.0), (degrees, 0.0), (0.0, degrees), (degrees, degrees)] {
        let turn = rigid::rotation_y(f64::to_radians(pan)) * rigid::rotation_x(f64::to_radians(tilt));
        for i in 0..25 {
            let z = 1.0 + 4.0 * f64::from(i) / 24.0;
            points.push(turn * Vector3::new(laser.x0 + laser.vx * z, laser.y0 + laser.vy * z, z));
        }
    }
    let known = CalibrationOptions { fixed_lens: Some((truth.intrinsics, truth.distortion)), ..free(sigma) };
    let bound = [0, 5].map(|first| roots(&bounds::points(&truth, &points, sigma, first))[0]);
    let mut sums = [0.0; 3];
    for run in 0..runs {
        let mut noise = Noise::new(run as u64);
        let pixels: Vec<_> = points.iter().map(|x| truth.project(x).expect("in view") + noise.pixel(sigma)).collect();
        let mut set = Correspondences::new(800, 600).expect("an image");
        set.add_points(&points, &pixels).expect("points");
        let off = |c: &Camera| (c.centre() - truth.centre()).norm_squared();
        sums[0] += off(&calibrate_camera(&set, &free(sigma)).expect("a calibration").camera);
        sums[1] += off(&calibrate_camera(&set, &known).expect("a pose").camera);
        let p = dlt::points(&points, &pixels).expect("a projection matrix");
        let (_, pose) = decompose::decompose(&p).expect("a camera");
        sums[2] += (pose.centre() - truth.centre()).norm_squared();
    }
    let figure = |goal, what: &str, sum: f64, bound: f64, limit| {
        let rms = (sum / runs as f64).sqrt();
        let setup = format!("thesis VII, {degrees} degrees, {sigma} px, {what}: centre rms");
        Figure { goal, setup, figure: rms * 1e3, unit: "mm", bound: bound * 1e3, ratio: rms / bound, limit, runs }
    };
    vec![
        figure("G8", "all 11 free", sums[0], bound[0], 1.05),
        figure("G8", "K known", sums[1], bound[1], 1.05),
        figure("thesis", "DLT", sums[2], bound[0], f64::INFINITY),
    ]
}
