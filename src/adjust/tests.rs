//! The gradient against differences of the cost that it belongs to.

use nalgebra::{DMatrix, Matrix2, Vector2, Vector3};

use super::layout::{Layout, State};
use super::linearise::Problem;
use super::problem::{AdjustOptions, Adjustment, CameraSetup, Shot, Sighting, Station};
use super::{Prior, solve};
use crate::geometry::rigid::exp;
use crate::geometry::{Camera, Distortion, Intrinsics, Plane, RIG_PARAMETERS, RigModel, Rigid};
use crate::rig::fake::Random;

fn moved(pose: &Rigid, random: &mut Random) -> Rigid {
    let rotation = exp(&(random.vector() * 0.3)) * pose.rotation;
    Rigid { rotation, translation: pose.translation + random.vector() * 0.1 }
}

/// A full covariance with these standard deviations.
fn correlated(sigmas: &[f64], random: &mut Random) -> Prior {
    let n = sigmas.len();
    let root = DMatrix::from_fn(n, n, |i, j| sigmas[i] * if i == j { 1.0 } else { random.between(-0.3, 0.3) });
    Prior::of_covariance(&root * root.transpose())
}

/// Two stations, two cameras and two planes, with beliefs that the state is far from; no shots yet.
fn far_from_its_beliefs(random: &mut Random) -> (Adjustment, State) {
    let mut input = Adjustment::new(RigModel::ideal()).unwrap();
    let sigmas: Vec<f64> = (0..RIG_PARAMETERS).map(|i| if (4..7).contains(&i) { 2.0 } else { 0.01 }).collect();
    input.set_rig_prior(correlated(&sigmas, random)).unwrap();
    let second = Rigid { rotation: exp(&Vector3::new(0.1, 0.4, -0.1)), translation: Vector3::new(0.5, 0.1, -0.2) };
    input.add_station(Station::world()).unwrap();
    // Levelled, its heading unknown.
    let prior = Prior::of_sigmas(&[0.05, f64::INFINITY, 0.06, 0.02, 0.03, 0.05]);
    input.add_station(Station { pose: Some(second), prior }).unwrap();
    let camera = Camera {
        width: 800,
        height: 600,
        intrinsics: Intrinsics::new(800.0, 400.0, 300.0),
        distortion: Distortion::Division(-0.1),
        pose: Rigid::look_at(&Vector3::new(-0.8, -0.4, -0.5), &Vector3::new(0.0, 0.0, 2.0)).unwrap(),
    };
    let prior = correlated(&[3.0, 4.0, 1.0, 5.0, 4.0, 0.02, 0.02, 0.03, 0.02, 0.05, 0.05, 0.04], random);
    input.add_camera(CameraSetup::known(camera, prior)).unwrap();
    input.add_camera(CameraSetup { aspect_sigma: 0.01, skew_sigma: 0.01, ..CameraSetup::new(800, 600) }).unwrap();
    for _ in 0..2 {
        input.add_plane(0.01).unwrap();
    }
    let brown_conrady = Distortion::BrownConrady([-0.1, 0.05, 0.001, 0.002, 0.01]);
    let intrinsics = Intrinsics { fx: 805.0, fy: 795.0, skew: 1.0, cx: 405.0, cy: 298.0 };
    let change = std::array::from_fn(|i| sigmas[i] * random.between(-1.0, 1.0));
    let state = State {
        rig: RigModel::ideal().moved(&change),
        stations: vec![Rigid::identity(), moved(&second, random)],
        cameras: vec![
            Camera { pose: moved(&camera.pose, random), ..camera },
            Camera { distortion: brown_conrady, intrinsics, ..camera },
        ],
        planes: vec![
            Plane { normal: Vector3::new(0.1, 0.2, -1.0).normalize(), distance: -2.5 },
            Plane { normal: Vector3::new(0.6, 0.0, -0.8), distance: -2.0 },
        ],
        locals: Vec::new(),
    };
    (input, state)
}

/// Shots that both cameras saw, or one of them, some of which hit a plane, all some pixels from where the state
/// has them.
fn add_shots(input: &mut Adjustment, state: &mut State, random: &mut Random) {
    let covariance = Matrix2::new(0.3, 0.1, 0.1, 0.4);
    for index in 0..60 {
        let station = index % 2;
        let (pan, tilt) = (random.between(-0.2, 0.2), random.between(-0.2, 0.2));
        let rho = 1.0 / (2.0 + random.between(-0.5, 0.5));
        let local = [rho, random.between(-1e-3, 1e-3), random.between(-1e-3, 1e-3)];
        let off = |random: &mut Random| Vector2::from_fn(|_, _| random.between(-3.0, 3.0));
        let head = state.rig.spot_pixel(rho).unwrap() + off(random);
        let ray = state.rig.laser_ray(pan, tilt, [local[1], local[2]]);
        let point = state.stations[station].apply(&(ray.origin + ray.direction / rho));
        let saw = |camera: &usize| index % 3 == 2 || index % 3 == *camera;
        let sightings = (0..2).filter(saw).map(|camera| {
            let pixel = state.cameras[camera].project(&point).unwrap() + off(random);
            Sighting { camera, pixel, covariance }
        });
        let sightings = sightings.collect();
        let shot = Shot { station, pan, tilt, head: Some((head, covariance)), sightings };
        let shot = input.add_shot(shot).unwrap();
        if index % 4 < 2 {
            input.set_plane(shot, index % 4).unwrap();
        }
        state.locals.push(local);
    }
}

#[test]
fn the_gradient_is_that_of_the_cost() {
    for (seed, huber) in [(1, f64::INFINITY), (2, 3.0), (3, 1.0)] {
        let random = &mut Random(seed);
        let (mut input, mut state) = far_from_its_beliefs(random);
        add_shots(&mut input, &mut state, random);
        let layout = Layout::of(&input).unwrap();
        let options = AdjustOptions { huber, pointing_sigma: [1e-3, 2e-3], ..AdjustOptions::default() };
        let problem = Problem::new(&input, &layout, &state, &options).unwrap();
        let used = vec![true; problem.views.len()];
        let system = problem.linearise(&state, &used).unwrap();
        let stepped = |step: &[f64]| solve::stepped(&problem, &state, &system, step).unwrap();
        let still = stepped(&vec![0.0; layout.count]);
        for (i, name) in layout.names(&state).iter().enumerate() {
            let unit = system.h[(i, i)].sqrt();
            // The shots' own unknowns go along with the column, without the step of their own.
            let cost = |length: f64| {
                let mut step = vec![0.0; layout.count];
                step[i] = length / unit;
                let mut there = stepped(&step);
                for ((local, still), start) in there.locals.iter_mut().zip(&still.locals).zip(&state.locals) {
                    (0..3).for_each(|k| local[k] += start[k] - still[k]);
                }
                problem.linearise(&there, &used).unwrap().cost
            };
            let (gradient, difference) = (system.g[i] / unit, (cost(-1e-3) - cost(1e-3)) / 4e-3);
            assert!((gradient - difference).abs() < 1e-4, "huber {huber}, {name}: {gradient} is not {difference}");
        }
    }
}
