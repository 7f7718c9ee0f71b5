//! The joint adjustment of rig and cameras on the simulated set-ups, from a cold start.

#[path = "support/thesis.rs"]
mod thesis;

use nalgebra::Matrix2;
use ptzcal::adjust::{AdjustOptions, Adjusted, Adjustment, CameraSetup, Prior, Shot, Sighting, Station, adjust};
use ptzcal::geometry::rig_model::AxisOffsets;
use ptzcal::geometry::{Camera, RIG_PARAMETERS, RigModel};
use thesis::{Noise, far, near, rig, world_of};

/// Sigmas of a rig prior: laser line, head, offsets, encoders.
fn prior(laser: f64, head: f64, offsets: f64, encoders: f64) -> Prior {
    let mut s = [0.0; RIG_PARAMETERS];
    s[..4].copy_from_slice(&[laser * 2e-4, laser * 2e-4, laser * 8e-5, laser * 8e-5]);
    s[4..7].copy_from_slice(&[head * 5e-4, head * 0.5, head * 0.5]);
    s[7..11].fill(offsets);
    s[12..].copy_from_slice(&[encoders * 0.02, encoders * 3f64.to_radians(), encoders * 0.02]);
    Prior::of_sigmas(&s)
}

/// Shots of one station seen by one camera.
fn survey(believed: RigModel, truth: &RigModel, camera: &Camera, n: usize, sigma: f64, seed: u64) -> Adjustment {
    let mut input = Adjustment::new(believed).unwrap();
    let station = input.add_station(Station::world()).unwrap();
    let index = input.add_camera(CameraSetup::new(camera.width, camera.height)).unwrap();
    let mut noise = Noise::new(seed);
    let covariance = Matrix2::identity() * (sigma * sigma);
    for s in world_of(truth, camera, n) {
        let head = Some((s.head + noise.pixel(sigma), covariance));
        let sightings = vec![Sighting { camera: index, pixel: s.fixed + noise.pixel(sigma), covariance }];
        input.add_shot(Shot { station, pan: s.pan, tilt: s.tilt, head, sightings }).unwrap();
    }
    input
}

fn centre_error(a: &Adjusted, camera: usize, truth: &Camera) -> f64 {
    (a.cameras[camera].camera.centre() - truth.centre()).norm()
}

#[test]
fn axis_offsets_are_calibrated_from_a_cold_start() {
    let truth = RigModel { offsets: AxisOffsets { tilt_y: 0.0, tilt_z: 0.04, pan_x: 0.0, pan_z: 0.04 }, ..rig() };
    for camera in [near(), far()] {
        let mut input = survey(rig(), &truth, &camera, 2021, 0.5, 1);
        let ignoring = adjust(&input, &AdjustOptions::default()).unwrap();
        input.set_rig_prior(prior(0.0, 0.0, 0.1, 0.0)).unwrap();
        let t = std::time::Instant::now();
        let freed = adjust(&input, &AdjustOptions::default()).unwrap();
        eprintln!("{:?}", t.elapsed());
        let (a, b) = (centre_error(&ignoring, 0, &camera), centre_error(&freed, 0, &camera));
        eprintln!("{a} {b} {:?} {:?} it {}", freed.rig.offsets, freed.check, freed.iterations);
        eprintln!("{:?}", ignoring.check);
        eprintln!("{:?}", freed.weakest());
        let sigma = freed.cameras[0].covariance.view((8, 8), (3, 3)).trace().sqrt();
        eprintln!("sigma {sigma}");
        assert!(b < 3.0 * sigma && a > 2.0 * b);
    }
}
