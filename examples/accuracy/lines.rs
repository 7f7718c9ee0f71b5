//! Lines, alone and with points, without and with a lens, against the Cramer-Rao bound; wrong lines.

use nalgebra::{DMatrix, DVector, Vector2, Vector3};
use ptzcal::calibrate::{
    CalibrationOptions, Correspondences, DistortionModel, ObservedLine, calibrate_camera, decompose, dlt,
};
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Line3, Rigid, rigid};

use super::edges::{Edge, edges, line_set, observed};
use super::figure::Figure;
use super::simulated::{free, nees};
use super::thesis::{Noise, Shot, far, near, world};

const SIGMA: f64 = 0.5;
const LENSES: [(&str, Distortion, DistortionModel); 3] = [
    ("no lens", Distortion::None, DistortionModel::None),
    // Two radial coefficients: forty measurements do not determine all five.
    ("Brown-Conrady", Distortion::BrownConrady([-0.28, 0.09, 0.0, 0.0, 0.0]), DistortionModel::Radial2),
    ("division", Distortion::Division(-0.22), DistortionModel::Division),
];

/// What a camera sees.
struct Scene {
    name: String,
    truth: Camera,
    model: DistortionModel,
    points: Vec<Shot>,
    edges: Vec<Edge>,
}

pub fn run(runs: usize, report: &mut impl FnMut(Vec<Figure>)) {
    for (place, camera) in [("NEAR", near()), ("FAR", far())] {
        for (lens, distortion, model) in LENSES {
            for n in [40, 200] {
                for (points, lines) in [(0, n), (n / 2, n / 2)] {
                    let truth = Camera { distortion, ..camera };
                    let name = format!("{place}, {lens}, {points} points, {lines} lines, {SIGMA} px");
                    let points = if points == 0 { Vec::new() } else { world(&truth, points) };
                    let scene = Scene { name, truth, model, points, edges: edges(&truth, lines) };
                    report(scene.against_bound(5 * runs));
                }
            }
        }
    }
    report(vec![outliers(2 * runs, 0.0), outliers(2 * runs, 0.5)]);
}

/// Squared errors: centre (m^2), focal lengths (px^2), principal point (px^2), rotation (rad^2).
type Squares = [f64; 4];
const GROUPS: [(&str, f64, &str); 4] =
    [("centre", 1e3, "mm"), ("f", 1.0, "px"), ("principal point", 1.0, "px"), ("rotation", 1e3, "mr")];

fn squares(camera: &Camera, truth: &Camera) -> Squares {
    let (k, k0) = (camera.intrinsics, truth.intrinsics);
    let turn = rigid::log(&(camera.pose.rotation * truth.pose.rotation.transpose()));
    [
        (camera.centre() - truth.centre()).norm_squared(),
        (k.fx - k0.fx).powi(2) + (k.fy - k0.fy).powi(2),
        (k.cx - k0.cx).powi(2) + (k.cy - k0.cy).powi(2),
        turn.norm_squared(),
    ]
}

impl Scene {
    fn set(&self, noise: &mut Noise) -> Correspondences {
        let mut set = line_set(&self.edges, SIGMA, false, noise);
        for s in &self.points {
            set.add_points(&[s.point], &[s.fixed + noise.pixel(SIGMA)]).expect("a point");
        }
        set
    }

    fn against_bound(&self, runs: usize) -> Vec<Figure> {
        let bound = self.bound();
        let (mut refined, mut linear, mut nees_sum, mut parameters) = ([0.0; 4], 0.0, 0.0, 0);
        let only_lines = self.points.is_empty() && self.model == DistortionModel::None;
        for run in 0..runs {
            let set = self.set(&mut Noise::new(run as u64));
            let options = CalibrationOptions { distortion: self.model, ..free(SIGMA) };
            let c = calibrate_camera(&set, &options).expect("a calibration");
            refined.iter_mut().zip(squares(&c.camera, &self.truth)).for_each(|(sum, s)| *sum += s);
            nees_sum += nees(&c, &self.truth);
            parameters = free_parameters(&c.covariance);
            if only_lines {
                linear += dlt_lines(&self.edges, &mut Noise::new(run as u64), &self.truth);
            }
        }
        let figure = |goal, what: &str, measured: f64, bound: f64, unit, limit| Figure {
            goal,
            setup: format!("{}: {what}", self.name),
            figure: measured,
            unit,
            bound,
            ratio: measured / bound,
            limit,
            runs,
        };
        let mut figures: Vec<Figure> = (0..4)
            .map(|i| {
                let (what, scale, unit) = GROUPS[i];
                let rms = (refined[i] / runs as f64).sqrt();
                figure("lines", what, rms * scale, bound[i] * scale, unit, 1.05)
            })
            .collect();
        if only_lines {
            let rms = (linear / runs as f64).sqrt();
            figures.push(figure("lines", "centre by DLT-Lines", rms * 1e3, bound[0] * 1e3, "mm", f64::INFINITY));
        }
        let root = (nees_sum / (parameters * runs) as f64).sqrt();
        figures.push(Figure { ratio: root.max(1.0 / root), ..figure("lines", "sqrt(NEES / p)", root, 1.0, "", 1.05) });
        figures
    }

    /// Cramer-Rao bound of the four groups: Fisher information of the distances of the true ends from
    /// the line's image, by central differences of the projection of two neighbouring points alone.
    fn bound(&self) -> Squares {
        let k = self.truth.intrinsics.to_array();
        // As many coefficients as are fitted.
        let coefficients = match self.model {
            DistortionModel::None => 0,
            DistortionModel::Division => 1,
            _ => 2,
        };
        let p = 11 + coefficients;
        let moved = |i: usize, step: f64| {
            let mut q = vec![0.0; p];
            q[i] = step;
            let mut c = self.truth;
            c.intrinsics = Intrinsics::from_array(std::array::from_fn(|i| k[i] + q[i]));
            c.distortion.coefficients_mut().iter_mut().zip(&q[11..]).for_each(|(k, q)| *k += q);
            let turn = rigid::exp(&Vector3::new(q[5], q[6], q[7])) * self.truth.pose.rotation;
            c.pose = Rigid::from_centre(turn, &(self.truth.centre() + Vector3::new(q[8], q[9], q[10])));
            c
        };
        let steps: Vec<(Camera, Camera, f64)> = (0..p)
            .map(|i| {
                let step = if i < 5 { 1e-3 } else { 1e-6 };
                (moved(i, step), moved(i, -step), step)
            })
            .collect();
        let derivative = |f: &dyn Fn(&Camera) -> f64| {
            DVector::from_iterator(p, steps.iter().map(|(plus, minus, step)| (f(plus) - f(minus)) / (2.0 * step)))
        };
        let mut h = DMatrix::<f64>::zeros(p, p);
        let mut add = |j: DVector<f64>| h += &j * j.transpose();
        for s in &self.points {
            (0..2).for_each(|i| add(derivative(&|c| c.project(&s.point).expect("in view")[i])));
        }
        for e in &self.edges {
            let along = (e.ends[1] - e.ends[0]).normalize() * 1e-4;
            for (x, m) in e.ends.iter().zip(&e.pixels) {
                add(derivative(&|c| {
                    let [a, b] = [x - along, x + along].map(|x| c.project(&x).expect("in view"));
                    let t = (b - a).normalize();
                    t.perp(&(m - a))
                }));
            }
        }
        let scale = DVector::from_fn(p, |i, _| 1.0 / h[(i, i)].sqrt());
        let inverse = DMatrix::from_fn(p, p, |i, k| h[(i, k)] * scale[i] * scale[k])
            .cholesky()
            .expect("an observable camera")
            .inverse();
        let group = |from: usize, to: usize| {
            SIGMA * (from..to).map(|i| inverse[(i, i)] * scale[i] * scale[i]).sum::<f64>().sqrt()
        };
        [group(8, 11), group(0, 2), group(3, 5), group(5, 8)]
    }
}

/// Parameters with a variance.
fn free_parameters(covariance: &DMatrix<f64>) -> usize {
    covariance.diagonal().iter().filter(|v| **v > 0.0).count()
}

/// Squared error of the centre by the linear method.
fn dlt_lines(edges: &[Edge], noise: &mut Noise, truth: &Camera) -> f64 {
    let world: Vec<Line3> =
        edges.iter().map(|e| Line3::new(e.ends[0], e.ends[1] - e.ends[0]).expect("a line")).collect();
    let segments: Vec<[Vector2<f64>; 2]> = edges.iter().map(|e| observed(e, noise, SIGMA, false).ends).collect();
    let p = dlt::lines(&world, &segments).expect("a projection matrix");
    squares(&truth_with(&p, truth), truth)[0]
}

fn truth_with(p: &ptzcal::geometry::Matrix3x4<f64>, truth: &Camera) -> Camera {
    let (intrinsics, pose) = decompose::decompose(p).expect("a camera");
    Camera { intrinsics, pose, ..*truth }
}

/// 200 lines, or a part of them points: 30 % of each are wrong. How often does it fail?
fn outliers(runs: usize, part_points: f64) -> Figure {
    let truth = near();
    let (mut failures, mut worst) = (0, 0.0f64);
    let n_points = (200.0 * part_points) as usize;
    for run in 0..runs {
        let mut noise = Noise::new(9000 + run as u64);
        let mut set = Correspondences::new(800, 600).expect("a size");
        let random = |noise: &mut Noise| Vector2::new(noise.uniform() * 800.0, noise.uniform() * 600.0);
        for e in edges(&truth, 200 - n_points) {
            let good = observed(&e, &mut noise, SIGMA, false);
            // A segment somewhere else, like that of a wrong pairing.
            let bad = [random(&mut noise), random(&mut noise)];
            let ends = if noise.uniform() < 0.3 { bad } else { good.ends };
            set.add(ObservedLine { ends, ..good }.into()).expect("a line");
        }
        for s in world(&truth, n_points) {
            let pixel = if noise.uniform() < 0.3 { random(&mut noise) } else { s.fixed + noise.pixel(SIGMA) };
            set.add_points(&[s.point], &[pixel]).expect("a point");
        }
        let options = CalibrationOptions { seed: run as u64, ..Default::default() };
        match calibrate_camera(&set, &options) {
            Ok(c) => {
                let error = squares(&c.camera, &truth)[0].sqrt();
                worst = worst.max(error);
                // Ten times what the good ones give on average.
                failures += usize::from(error > 10e-3);
            }
            Err(_) => failures += 1,
        }
    }
    Figure {
        goal: "30 %",
        setup: format!(
            "NEAR, {} lines, {n_points} points, {SIGMA} px, worst centre {:.2} mm: failures",
            200 - n_points,
            worst * 1e3
        ),
        figure: failures as f64,
        unit: "",
        bound: 0.0,
        ratio: failures as f64,
        limit: 0.0,
        runs,
    }
}
