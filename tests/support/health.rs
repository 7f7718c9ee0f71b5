//! Simulated health checks: a rig and a camera that were calibrated with noise, ten shots stored, and
//! the same again after something has changed.
#![allow(dead_code)]

use nalgebra::{Matrix2, Matrix6, Vector2, Vector3, Vector6};
use ptzcal::calibrate::{Calibration, CalibrationOptions, calibrate_camera};
use ptzcal::geometry::rigid::exp;
use ptzcal::geometry::{Camera, RigModel, Rigid};
use ptzcal::health::{HealthOptions, HealthReport, HealthShot, Spot, Verdict, check_health};

use super::thesis::{Noise, Shot, depth, far, laser_set, near, rig, world};

const SIGMA: f64 = 0.15;
const REST: f64 = 1e-4;

/// What has happened since the shots were stored.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    Nothing,
    CameraTurned { degrees: f64 },
    CameraMoved { metres: f64 },
    HeadZero { degrees: f64 },
    RigMoved { degrees: f64, metres: f64 },
    LaserMoved { slope: f64 },
    SceneChanged { shots: usize },
    Outliers { shots: usize },
    TurnedAndScene { degrees: f64, shots: usize },
    Missing { left: usize },
}

#[derive(Debug, Clone, Default)]
pub struct Tally {
    pub runs: usize,
    /// By verdict, in its order.
    pub said: [usize; 4],
    /// Normalised squared error of the refitted change over its six unknowns, mean.
    pub nees: f64,
    pub refitted: usize,
    /// Error of the refitted camera's turn, degrees, and centre, metres: mean squares.
    pub turn: f64,
    pub centre: f64,
}

impl Tally {
    pub fn share(&self, verdict: Verdict) -> f64 {
        self.said[verdict as usize] as f64 / self.runs as f64
    }
}

/// A direction at random.
fn direction(noise: &mut Noise) -> Vector3<f64> {
    Vector3::new(noise.gaussian(), noise.gaussian(), noise.gaussian()).normalize()
}

struct World {
    rig: RigModel,
    station: Rigid,
    camera: Camera,
    /// Taken off the depth of a shot by something in its way, metres.
    obstacle: f64,
}

/// What both cameras see of a shot.
fn fire(world: &World, pan: f64, tilt: f64, noise: &mut Noise) -> (Option<Spot>, Option<Spot>) {
    let (pan, tilt) = (pan + REST * noise.gaussian(), tilt + REST * noise.gaussian());
    let (o, d) = world.rig.laser_in_world(pan, tilt);
    let (o, d) = (world.station.apply(&o), world.station.rotation * d);
    let depth = depth(&o, &d) - world.obstacle;
    let covariance = Matrix2::identity() * (SIGMA * SIGMA);
    let head = world.rig.spot_pixel(1.0 / depth).map(|p| Spot { pixel: p + noise.pixel(SIGMA), covariance });
    let seen = world.camera.project(&(o + d * depth)).filter(|p| world.camera.contains(p));
    (head, seen.map(|p| Spot { pixel: p + noise.pixel(SIGMA), covariance }))
}

/// Many checks after a change, each with its own calibration, shots and noise.
pub fn tally(change: &Change, runs: usize) -> Tally {
    let mut tally = Tally { runs, ..Tally::default() };
    for run in 0..runs {
        let truth = if run % 2 == 0 { near() } else { far() };
        let mut noise = Noise::new(1000 + run as u64);
        let calibration = calibrated(&truth, run as u64 / 10);
        let (report, moved) = check(change, &truth, &calibration, &mut noise);
        tally.said[report.verdict as usize] += 1;
        if let (Some((found, covariance)), Some(moved)) = (report.change, moved) {
            let error = found - moved;
            let inverse: Matrix6<f64> = covariance.try_inverse().expect("a covariance");
            tally.nees += error.dot(&(inverse * error)) / 6.0;
            tally.refitted += 1;
            tally.turn += error.fixed_rows::<3>(0).norm_squared().sqrt().to_degrees().powi(2);
            tally.centre += error.fixed_rows::<3>(3).norm_squared();
        }
    }
    let n = tally.refitted.max(1) as f64;
    (tally.nees, tally.turn, tally.centre) = (tally.nees / n, (tally.turn / n).sqrt(), (tally.centre / n).sqrt());
    tally
}

pub fn calibrated(truth: &Camera, seed: u64) -> Calibration {
    let mut noise = Noise::new(seed);
    let set = laser_set(&world(truth, 300), SIGMA, SIGMA, &mut noise);
    calibrate_camera(&set, &CalibrationOptions { max_focal_deviation: 1.0, ..Default::default() }).expect("a camera")
}

fn check(
    change: &Change,
    truth: &Camera,
    calibration: &Calibration,
    noise: &mut Noise,
) -> (HealthReport, Option<Vector6<f64>>) {
    let mut shots: Vec<Shot> = world(truth, 2000);
    let skip = (noise.uniform() * shots.len() as f64) as usize;
    shots.rotate_left(skip);
    shots.truncate(10);
    let before = World { rig: rig(), station: Rigid::identity(), camera: *truth, obstacle: 0.0 };
    let mut after = World { rig: rig(), station: Rigid::identity(), camera: *truth, obstacle: 0.0 };
    let (mut moved, mut obstacles, mut outliers, mut left) = (None, 0, 0, 10);
    let mut turn = |camera: &mut Camera, angle: Vector3<f64>, shift: Vector3<f64>| {
        let centre = camera.centre() + shift;
        camera.pose = Rigid::from_centre(exp(&angle) * camera.pose.rotation, &centre);
        let mut x = Vector6::zeros();
        x.fixed_rows_mut::<3>(0).copy_from(&angle);
        x.fixed_rows_mut::<3>(3).copy_from(&shift);
        moved = Some(x);
    };
    match *change {
        Change::Nothing => {}
        Change::CameraTurned { degrees } => {
            let angle = direction(noise) * degrees.to_radians();
            turn(&mut after.camera, angle, Vector3::zeros());
        }
        Change::CameraMoved { metres } => {
            let shift = direction(noise) * metres;
            turn(&mut after.camera, Vector3::zeros(), shift);
        }
        Change::HeadZero { degrees } => {
            let to = noise.uniform() * std::f64::consts::TAU;
            after.rig.encoders.pan_zero += degrees.to_radians() * to.cos();
            after.rig.encoders.tilt_zero += degrees.to_radians() * to.sin();
        }
        Change::RigMoved { degrees, metres } => {
            let turn = exp(&(direction(noise) * degrees.to_radians()));
            after.station = Rigid { rotation: turn, translation: direction(noise) * metres };
        }
        Change::LaserMoved { slope } => after.rig.laser.vx += slope,
        Change::SceneChanged { shots } => obstacles = shots,
        Change::Outliers { shots } => outliers = shots,
        Change::TurnedAndScene { degrees, shots } => {
            let angle = direction(noise) * degrees.to_radians();
            turn(&mut after.camera, angle, Vector3::zeros());
            obstacles = shots;
        }
        Change::Missing { left: n } => left = n,
    }
    let mut list = Vec::new();
    for s in &shots {
        let (Some(head), Some(fixed)) = fire(&before, s.pan, s.tilt, noise) else { continue };
        let i = list.len();
        after.obstacle = if i < obstacles { 0.5 } else { 0.0 };
        let (head_again, mut fixed_again) = fire(&after, s.pan, s.tilt, noise);
        if i < outliers
            && let Some(f) = &mut fixed_again
        {
            f.pixel += Vector2::new(30.0, -20.0) * (1.0 + noise.uniform());
        }
        if i >= left {
            fixed_again = None;
        }
        list.push(HealthShot { pan: s.pan, tilt: s.tilt, head, fixed, head_again, fixed_again });
    }
    let options = HealthOptions { pointing_sigma: [REST; 2], ..HealthOptions::default() };
    (check_health(&rig(), calibration, &list, &options).expect("a report"), moved)
}
