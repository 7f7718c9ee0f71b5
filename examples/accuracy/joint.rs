//! G3, G4: rig and cameras adjusted together from a cold start, against the Cramer-Rao bound by
//! numerical derivatives, with coverage of the whole covariance; the thesis's method beside it.

use nalgebra::{DMatrix, DVector, Matrix2};
use ptzcal::adjust::{AdjustOptions, Adjustment, CameraSetup, Prior, Shot as AdjustShot, Sighting, Station, adjust};
use ptzcal::calibrate::{DistortionModel, decompose, dlt};
use ptzcal::geometry::rig_model::AxisOffsets;
use ptzcal::geometry::{Camera, Distortion, RIG_PARAMETERS, RigModel};

use super::bounds::{self, RigMatrix};
use super::figure::Figure;
use super::groups::{GROUPS, error, nees, roots, squared};
use super::thesis::{Noise, Shot, far, near, rig, world_of};

/// One set-up: a rig whose parameters are believed within a covariance, one camera.
struct Case {
    goal: &'static str,
    name: String,
    rig: RigModel,
    /// Zero rows: known. The believed rig is drawn from it, but for the axis offsets, believed 0.
    prior: RigMatrix,
    camera: Camera,
    shots: Vec<Shot>,
    sigma: f64,
}

pub fn run(runs: usize, report: &mut impl FnMut(Vec<Figure>)) {
    for (name, camera) in [("NEAR", near()), ("FAR", far())] {
        let large = RigModel { offsets: AxisOffsets { tilt_y: 0.0, tilt_z: 0.04, pan_x: 0.0, pan_z: 0.04 }, ..rig() };
        let mut prior = RigMatrix::zeros();
        (7..11).for_each(|i| prior[(i, i)] = 0.1 * 0.1);
        let shots = world_of(&large, &camera, 2021);
        let case = Case {
            goal: "G4",
            name: format!("{name}, offsets 40+40 mm"),
            rig: large,
            prior,
            camera,
            shots,
            sigma: 0.5,
        };
        report(case.measure(runs));

        let offsets = AxisOffsets { tilt_y: 0.008, tilt_z: 0.025, pan_x: 0.003, pan_z: 0.020 };
        let truth = RigModel { offsets, ..rig() };
        let mut lens = camera;
        // -0.08 at 500 px from the centre.
        lens.distortion = Distortion::Division(-0.08 * (845.0f64 / 500.0).powi(2));
        let shots = world_of(&truth, &lens, 2021);
        let prior = all_nuisances();
        let case = Case {
            goal: "G3",
            name: format!("{name}, all nuisances free"),
            rig: truth,
            prior,
            camera: lens,
            shots,
            sigma: 0.2,
        };
        report(case.measure(runs));
    }
}

/// Laser line as 25 boards give it at 0.2 px, head intrinsics to 0.05 % and 0.5 px, offsets to 100 mm.
fn all_nuisances() -> RigMatrix {
    let mut p = RigMatrix::zeros();
    let (offset, slope, correlation) = (2.2e-4, 8.2e-5, -0.9);
    for i in 0..2 {
        p[(i, i)] = offset * offset;
        p[(i + 2, i + 2)] = slope * slope;
        p[(i, i + 2)] = correlation * offset * slope;
        p[(i + 2, i)] = p[(i, i + 2)];
    }
    (p[(4, 4)], p[(5, 5)], p[(6, 6)]) = (5e-4 * 5e-4, 0.25, 0.25);
    (7..11).for_each(|i| p[(i, i)] = 0.1 * 0.1);
    p
}

impl Case {
    fn measure(&self, runs: usize) -> Vec<Figure> {
        let bound = roots(&bounds::shots(&self.camera, &self.shots, self.sigma, &self.rig, &self.prior));
        let (mut sums, mut thesis, mut total, mut free) = ([0.0; 4], 0.0, 0.0, 0);
        let mut failures = 0;
        for run in 0..runs {
            let mut noise = Noise::new(run as u64);
            let (input, believed) = self.draw(&mut noise);
            let Ok(answer) =
                adjust(&input, &AdjustOptions { max_focal_deviation: f64::INFINITY, ..Default::default() })
            else {
                failures += 1;
                continue;
            };
            let camera = error(&answer.cameras[0].camera, &self.camera);
            squared(&camera).iter().zip(&mut sums).for_each(|(e, s)| *s += e);
            let (now, truth) = (answer.rig.parameters(), self.rig.parameters());
            let mut all: Vec<f64> = now.iter().zip(&truth).map(|(a, b)| a - b).collect();
            all.extend([0.0; 6]);
            all.extend(camera.iter());
            let (squares, count) = nees(&DVector::from_vec(all), &answer.covariance);
            total += squares;
            free = count;
            thesis += thesis_error(&input, &believed, &self.camera);
        }
        let done = (runs - failures) as f64;
        let setup = |what: &str| format!("{}, {} shots, {} px: {what}", self.name, self.shots.len(), self.sigma);
        let mut figures: Vec<Figure> = (0..4)
            .map(|g| {
                let (what, unit, factor) = GROUPS[g];
                let rms = (sums[g] / done).sqrt();
                Figure {
                    goal: self.goal,
                    setup: setup(&format!("{what} rms")),
                    figure: rms * factor,
                    unit,
                    bound: bound[g] * factor,
                    ratio: rms / bound[g],
                    limit: 1.10,
                    runs,
                }
            })
            .collect();
        let plain = |goal, what: &str, figure: f64, unit, ratio, limit| Figure {
            goal,
            setup: setup(what),
            figure,
            unit,
            bound: 1.0,
            ratio,
            limit,
            runs,
        };
        let root = (total / (done * free as f64)).sqrt();
        figures.push(plain("NEES", &format!("sqrt(NEES / {free})"), root, "", root.max(1.0 / root), 1.05));
        figures.push(plain(self.goal, "failures", failures as f64, "", failures as f64, 0.0));
        let mean = (thesis / done).sqrt();
        figures.push(plain(
            "thesis",
            "centre rms by DLT, rig as believed",
            mean * 1e3,
            "mm",
            mean / bound[0],
            f64::INFINITY,
        ));
        figures
    }

    /// Noisy spots, and a rig believed wrongly.
    fn draw(&self, noise: &mut Noise) -> (Adjustment, RigModel) {
        let free: Vec<usize> = (0..RIG_PARAMETERS).filter(|i| self.prior[(*i, *i)] > 0.0).collect();
        let block = DMatrix::from_fn(free.len(), free.len(), |i, j| self.prior[(free[i], free[j])]);
        let root = block.cholesky().expect("a covariance").l();
        let drawn = &root * DVector::from_fn(free.len(), |_, _| noise.gaussian());
        let mut step = [0.0; RIG_PARAMETERS];
        free.iter().zip(drawn.iter()).for_each(|(i, d)| step[*i] = *d);
        let truth = self.rig.parameters();
        (7..11).for_each(|i| step[i] = -truth[i]);
        let believed = self.rig.moved(&step);
        let mut input = Adjustment::new(believed).expect("a rig");
        let all = DMatrix::from_fn(RIG_PARAMETERS, RIG_PARAMETERS, |i, j| self.prior[(i, j)]);
        input.set_rig_prior(Prior::of_covariance(all)).expect("a prior");
        let station = input.add_station(Station::world()).expect("a station");
        let distortion = match self.camera.distortion {
            Distortion::None => DistortionModel::None,
            _ => DistortionModel::Division,
        };
        let free = CameraSetup {
            distortion,
            skew_sigma: f64::INFINITY,
            aspect_sigma: f64::INFINITY,
            ..CameraSetup::new(800, 600)
        };
        let camera = input.add_camera(free).expect("a camera");
        let covariance = Matrix2::identity() * (self.sigma * self.sigma);
        for s in &self.shots {
            let head = Some((s.head + noise.pixel(self.sigma), covariance));
            let sightings = vec![Sighting { camera, pixel: s.fixed + noise.pixel(self.sigma), covariance }];
            input.add_shot(AdjustShot { station, pan: s.pan, tilt: s.tilt, head, sightings }).expect("a shot");
        }
        (input, believed)
    }
}

/// Squared error of the centre by eqs (14)-(16) and DLT-Points with the rig as it is believed.
fn thesis_error(input: &Adjustment, believed: &RigModel, truth: &Camera) -> f64 {
    let (mut world, mut pixels) = (Vec::new(), Vec::new());
    for shot in input.shots() {
        let measured = shot.head.as_ref().and_then(|(spot, c)| believed.measure(shot.pan, shot.tilt, spot, c).ok());
        if let Some(point) = measured.and_then(|m| m.point.point()) {
            world.push(point);
            pixels.push(shot.sightings[0].pixel);
        }
    }
    let p = dlt::points(&world, &pixels).expect("a projection matrix");
    let (_, pose) = decompose::decompose(&p).expect("a camera");
    (pose.centre() - truth.centre()).norm_squared()
}
