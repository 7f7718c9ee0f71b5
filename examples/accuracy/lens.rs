//! G5: lens distortion. The linear start and the refined camera against the Cramer-Rao bound of
//! lambda, at and near zero too, with the thesis's eigenproblem beside them; fisheye lenses.

use nalgebra::{DMatrix, DVector, Vector2, Vector3};
use ptzcal::calibrate::division_camera::DivisionCamera;
use ptzcal::calibrate::division_eigenproblem::division_eigenproblem;
use ptzcal::calibrate::radial_alignment::radial_alignment;
use ptzcal::calibrate::{Calibration, CalibrationOptions, Correspondences, DistortionModel, calibrate_camera};
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Rigid, rigid};

use super::figure::Figure;
use super::simulated::free;
use super::thesis::{Noise, near, world};

/// Radius at which lambda is told, px.
const RADIUS: f64 = 500.0;

pub fn run(runs: usize, report: &mut impl FnMut(Vec<Figure>)) {
    let mut failures = (0, 0);
    for lambda in [0.0, -0.02, -0.08, -0.15] {
        for sigma in [0.2, 1.0] {
            for n in [100, 2021] {
                // Small sets are cheap: more runs, less scatter in the ratio.
                let runs = if n < 1000 { 4 * runs } else { 2 * runs };
                report(division(lambda, sigma, n, runs, &mut failures));
            }
        }
    }
    report(vec![none_of("division lens, all the runs above", failures)]);
    for degrees in [110.0, 170.0] {
        report(fisheye(degrees, runs));
    }
    report(vec![random_fisheyes(1000.min(4 * runs)), outliers("division -0.15", strong(), runs / 4)]);
    report(vec![outliers("fisheye 150 deg", dome(150.0), runs / 4)]);
}

fn none_of(what: &str, (failed, runs): (usize, usize)) -> Figure {
    Figure {
        goal: "G5",
        setup: format!("{what}: failures"),
        figure: failed as f64,
        unit: "",
        bound: 0.0,
        ratio: failed as f64,
        limit: 0.0,
        runs,
    }
}

/// NEAR with square pixels, so that its radial lens is radial in pixels too, and lambda as told.
fn near_with(lambda: f64) -> Camera {
    let camera = near();
    let k = camera.intrinsics;
    let f = (k.fx * k.fy).sqrt();
    let distortion = Distortion::Division(lambda * f * f / (RADIUS * RADIUS));
    Camera { intrinsics: Intrinsics { fx: f, fy: f, ..k }, distortion, ..camera }
}

fn strong() -> (Camera, Vec<Vector3<f64>>) {
    let camera = near_with(-0.15);
    (camera, world(&camera, 300).iter().map(|s| s.point).collect())
}

/// A stereographic-like dome camera with the horizontal field of view `degrees`, and points 1 to 5 m
/// away over its image.
fn dome(degrees: f64) -> (Camera, Vec<Vector3<f64>>) {
    let lens = Distortion::Fisheye([0.03, 0.004, -0.0005, 0.0001]);
    let half = 0.5 * degrees.to_radians();
    let reach = lens.image(&Vector3::new(half.sin(), 0.0, half.cos())).expect("a lens that reaches so far").x;
    let camera = Camera {
        width: 800,
        height: 600,
        intrinsics: Intrinsics::new(400.0 / reach, 410.0, 292.0),
        distortion: lens,
        pose: Rigid::look_at(&Vector3::new(0.0, -2.0, 0.0), &Vector3::new(0.3, 0.0, 0.4)).expect("a view"),
    };
    (camera, points_seen(&camera, 500, &mut Noise::new(11)))
}

fn points_seen(camera: &Camera, n: usize, noise: &mut Noise) -> Vec<Vector3<f64>> {
    let size = Vector2::new(f64::from(camera.width), f64::from(camera.height));
    let mut points = Vec::new();
    while points.len() < n {
        let pixel = Vector2::new(noise.uniform() * size.x, noise.uniform() * size.y);
        let distance = 1.0 + 4.0 * noise.uniform();
        points.extend(camera.back_project(&pixel).map(|ray| ray.at(distance)));
    }
    points
}

fn measured(camera: &Camera, points: &[Vector3<f64>], sigma: f64, noise: &mut Noise) -> Correspondences {
    let mut set = Correspondences::new(camera.width, camera.height).expect("an image size");
    let pixels: Vec<_> = points.iter().map(|x| camera.project(x).expect("in view") + noise.pixel(sigma)).collect();
    set.add_points(points, &pixels).expect("finite points");
    set
}

/// The camera at `p` off the truth: intrinsics, lens, rotation, centre.
fn moved(truth: &Camera, p: &[f64]) -> Camera {
    let lens = truth.distortion.coefficients().len();
    let k = truth.intrinsics.to_array();
    let mut c = *truth;
    c.intrinsics = Intrinsics::from_array(std::array::from_fn(|i| k[i] + p[i]));
    for (k, step) in c.distortion.coefficients_mut().iter_mut().zip(&p[5..5 + lens]) {
        *k += step;
    }
    let (turn, shift) = p[5 + lens..].split_at(3);
    let rotation = rigid::exp(&Vector3::from_column_slice(turn)) * truth.pose.rotation;
    c.pose = Rigid::from_centre(rotation, &(truth.centre() + Vector3::from_column_slice(shift)));
    c
}

/// Cramer-Rao bound (covariance) of all parameters for exact points: Fisher information at the truth
/// by central differences of the projection alone, so that it shares no derivative with the solver.
fn bound(truth: &Camera, points: &[Vector3<f64>], sigma: f64) -> DMatrix<f64> {
    let size = 11 + truth.distortion.coefficients().len();
    let mut h = DMatrix::<f64>::zeros(size, size);
    let mut j = DMatrix::<f64>::zeros(2 * points.len(), size);
    for i in 0..size {
        let step = if i < 5 { 1e-3 } else { 1e-6 };
        let mut p = vec![0.0; size];
        p[i] = step;
        let plus = moved(truth, &p);
        p[i] = -step;
        let minus = moved(truth, &p);
        for (k, x) in points.iter().enumerate() {
            let d = (plus.project(x).expect("in view") - minus.project(x).expect("in view")) / (2.0 * step * sigma);
            (j[(2 * k, i)], j[(2 * k + 1, i)]) = (d.x, d.y);
        }
    }
    h.gemm_tr(1.0, &j, &j, 0.0);
    let scale = DVector::from_fn(size, |i, _| 1.0 / h[(i, i)].sqrt());
    let scaled = DMatrix::from_fn(size, size, |i, k| h[(i, k)] * scale[i] * scale[k]);
    let inverse = scaled.cholesky().expect("an observable camera").inverse();
    DMatrix::from_fn(size, size, |i, k| inverse[(i, k)] * scale[i] * scale[k])
}

/// Errors of all parameters, in the covariance's order.
fn errors(c: &Camera, truth: &Camera) -> Vec<f64> {
    let pairs = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
    let mut e = pairs(&c.intrinsics.to_array(), &truth.intrinsics.to_array());
    e.extend(pairs(c.distortion.coefficients(), truth.distortion.coefficients()));
    e.extend(rigid::log(&(c.pose.rotation * truth.pose.rotation.transpose())).iter());
    e.extend((c.centre() - truth.centre()).iter());
    e
}

/// Normalised estimation error squared: e^T C^-1 e with the covariance that was returned.
fn nees(c: &Calibration, truth: &Camera) -> f64 {
    let e = errors(&c.camera, truth);
    let s: Vec<f64> = (0..e.len()).map(|i| 1.0 / c.covariance[(i, i)].sqrt()).collect();
    let scaled = DMatrix::from_fn(e.len(), e.len(), |i, j| c.covariance[(i, j)] * s[i] * s[j]);
    let z = DVector::from_fn(e.len(), |i, _| e[i] * s[i]);
    z.dot(&scaled.cholesky().expect("a covariance").solve(&z))
}

fn coverage(setup: String, sum: f64, parameters: usize, runs: usize) -> Figure {
    let root = (sum / (parameters * runs) as f64).sqrt();
    Figure {
        goal: "NEES",
        setup: format!("{setup}: sqrt(NEES / {parameters})"),
        figure: root,
        unit: "",
        bound: 1.0,
        ratio: root.max(1.0 / root),
        limit: 1.05,
        runs,
    }
}

fn division(lambda: f64, sigma: f64, n: usize, runs: usize, failures: &mut (usize, usize)) -> Vec<Figure> {
    let truth = near_with(lambda);
    let points: Vec<_> = world(&truth, n).iter().map(|s| s.point).collect();
    let covariance = bound(&truth, &points, sigma);
    // lambda at RADIUS, lambda_n = lambda RADIUS^2 / (fx fy), to first order.
    let k = truth.intrinsics;
    let (scale, lens) = (RADIUS * RADIUS / (k.fx * k.fy), truth.distortion.coefficients()[0]);
    let mut gradient = DVector::zeros(covariance.nrows());
    (gradient[0], gradient[1], gradient[5]) = (-lens * scale / k.fx, -lens * scale / k.fy, scale);
    let limit = gradient.dot(&(&covariance * &gradient)).sqrt();
    // The linear methods are given the centre of distortion; the refinement finds it.
    let centre = Some(Vector2::new(k.cx, k.cy));
    let (mut start, mut eigen, mut refined, mut covered) = (Vec::new(), Vec::new(), Vec::new(), 0.0);
    for run in 0..runs {
        let set = measured(&truth, &points, sigma, &mut Noise::new(run as u64));
        let linear = |found: ptzcal::Result<DivisionCamera>| found.ok().map(|c| c.lambda * RADIUS * RADIUS - lambda);
        start.extend(linear(radial_alignment(&set, centre)));
        eigen.extend(linear(division_eigenproblem(&set, centre)));
        let options = CalibrationOptions { distortion: DistortionModel::Division, ..free(sigma) };
        if let Ok(c) = calibrate_camera(&set, &options) {
            let f2 = c.camera.intrinsics.fx * c.camera.intrinsics.fy;
            let error = c.camera.distortion.coefficients()[0] * RADIUS * RADIUS / f2 - lambda;
            if error.abs() < 6.0 * limit {
                refined.push(error);
                covered += nees(&c, &truth);
            }
        }
    }
    failures.0 += 2 * runs - start.len() - refined.len();
    failures.1 += 2 * runs;
    let setup = format!("lambda {lambda}, {n} points, {sigma} px");
    let figure = |goal, method: &str, errors: &[f64], allowed| {
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let missing = runs - errors.len();
        let without = if missing > 0 { format!(" ({missing} of {runs} without)") } else { String::new() };
        Figure {
            goal,
            setup: format!("{setup}, {method}: lambda rms{without}"),
            figure: rms * 1e3,
            unit: "e-3",
            bound: limit * 1e3,
            ratio: rms / limit,
            limit: allowed,
            runs,
        }
    };
    vec![
        figure("G5", "radial alignment", &start, 1.35),
        figure("thesis", "eigenproblem (5)", &eigen, f64::INFINITY),
        figure("G5", "refined", &refined, 1.05),
        coverage(setup.clone(), covered, 12, refined.len()),
    ]
}

fn fisheye(degrees: f64, runs: usize) -> Vec<Figure> {
    let (truth, points) = dome(degrees);
    let sigma = 0.5;
    let covariance = bound(&truth, &points, sigma);
    let size = covariance.nrows();
    let limit = (size - 3..size).map(|i| covariance[(i, i)]).sum::<f64>().sqrt();
    let (mut sum, mut covered) = (0.0, 0.0);
    for run in 0..runs {
        let set = measured(&truth, &points, sigma, &mut Noise::new(run as u64));
        let options = CalibrationOptions { distortion: DistortionModel::Fisheye, ..free(sigma) };
        let c = calibrate_camera(&set, &options).expect("a calibration");
        sum += (c.camera.centre() - truth.centre()).norm_squared();
        covered += nees(&c, &truth);
    }
    let rms = (sum / runs as f64).sqrt();
    let setup = format!("fisheye {degrees} deg, {} points, {sigma} px", points.len());
    let centre = Figure {
        goal: "G5",
        setup: format!("{setup}, refined: centre rms"),
        figure: rms * 1e3,
        unit: "mm",
        bound: limit * 1e3,
        ratio: rms / limit,
        limit: 1.05,
        runs,
    };
    vec![centre, coverage(setup, covered, size, runs)]
}

/// Cameras with lenses between the equisolid and the stereographic one, 90 to 170 degrees wide, in any
/// attitude, their principal point off the middle: is each found?
fn random_fisheyes(runs: usize) -> Figure {
    let failed = (0..runs).filter(|seed| !random_fisheye(*seed as u64)).count();
    none_of("fisheye lenses at random, 90 to 170 deg, 200 points, 0.5 px", (failed, runs))
}

fn random_fisheye(seed: u64) -> bool {
    let mut noise = Noise::new(seed);
    let (kind, half) = (noise.uniform(), (45.0 + 40.0 * noise.uniform()).to_radians());
    // 2 sin(theta / 2) and 2 tan(theta / 2) as far as theta^5.
    let (k1, k2) = (-1.0 / 24.0 + kind / 8.0, 1.0 / 1920.0 + kind / 128.0);
    let lens = Distortion::Fisheye([k1 + 0.01 * noise.gaussian(), k2, 0.001 * noise.gaussian(), 0.0]);
    let reach = lens.image(&Vector3::new(half.sin(), 0.0, half.cos())).expect("a lens that reaches so far");
    let off = noise.pixel(20.0);
    let turn = Vector3::from_fn(|_, _| noise.gaussian()).normalize() * (3.1 * noise.uniform());
    let truth = Camera {
        width: 1280,
        height: 960,
        intrinsics: Intrinsics::new(640.0 / reach.x, 639.5 + off.x, 479.5 + off.y),
        distortion: lens,
        pose: Rigid::from_centre(rigid::exp(&turn), &Vector3::from_fn(|_, _| 2.0 * noise.gaussian())),
    };
    let points = points_seen(&truth, 200, &mut noise);
    let set = measured(&truth, &points, 0.5, &mut noise);
    let options = CalibrationOptions { distortion: DistortionModel::Fisheye, ..Default::default() };
    found(&set, &options, &truth)
}

/// Was the camera's centre found to within six of its standard deviations?
fn found(set: &Correspondences, options: &CalibrationOptions, truth: &Camera) -> bool {
    calibrate_camera(set, options).is_ok_and(|c| {
        let size = c.covariance.nrows();
        let sigma = (size - 3..size).map(|i| c.covariance[(i, i)]).sum::<f64>().sqrt();
        (c.camera.centre() - truth.centre()).norm() < 6.0 * sigma
    })
}

/// 30 % of the pixels anywhere in the image.
fn outliers(name: &str, (truth, points): (Camera, Vec<Vector3<f64>>), runs: usize) -> Figure {
    let model = if matches!(truth.distortion, Distortion::Division(_)) {
        DistortionModel::Division
    } else {
        DistortionModel::Fisheye
    };
    let failed = (0..runs).filter(|run| {
        let mut noise = Noise::new(*run as u64);
        let mut set = Correspondences::new(truth.width, truth.height).expect("an image size");
        for x in &points {
            let seen = truth.project(x).expect("in view") + noise.pixel(0.5);
            let stray = Vector2::new(noise.uniform() * 800.0, noise.uniform() * 600.0);
            let pixel = if noise.uniform() < 0.3 { stray } else { seen };
            set.add_points(&[*x], &[pixel]).expect("finite points");
        }
        !found(&set, &CalibrationOptions { distortion: model, ..Default::default() }, &truth)
    });
    none_of(&format!("{name}, {} points, 0.5 px, 30 % outliers", points.len()), (failed.count(), runs))
}
