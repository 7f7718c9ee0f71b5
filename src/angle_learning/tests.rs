//! Learned maps against what they should be: sights drawn with known errors, and the simulator's pictures.

use std::ops::ControlFlow::Continue;

use nalgebra::{Vector2, Vector3};

use super::bundle::camera_pose;
use super::*;
use crate::control::Log;
use crate::device::{Motion, PanTiltZoom, PtzCapabilities, PtzPosition};
use crate::geometry::rigid::Rigid;
use crate::geometry::{Distortion, Intrinsics};
use crate::rig::fake::Random;
use crate::sim::{SimOptions, Simulator};

fn camera() -> Camera {
    Camera {
        width: 720,
        height: 576,
        intrinsics: Intrinsics::new(800.0, 360.0, 288.0),
        distortion: Distortion::BrownConrady([-0.06, 0.015, 3e-4, -2e-4, 0.0]),
        pose: Rigid::identity(),
    }
}

const MOUNTING: Mounting = Mounting { collimation: 0.012, roll: -0.03, trunnion: 0.004 };

/// A head that counts otherwise: radians of its numbers.
fn true_pan(raw: f64) -> f64 {
    -1.6 * raw + 0.1 * (2.0 * raw).sin()
}

fn true_tilt(raw: f64) -> f64 {
    0.45 * raw + 0.06 + 0.03 * raw * raw
}

/// Frames on a grid over the range, points at `near` to 3 `near` metres, errors of `noise` px and
/// `repeatability` rad, and wrong sights.
fn draw(random: &mut Random, levers: [f64; 4], near: f64, noise: f64, repeatability: f64, wrong: f64) -> AngleViews {
    let (columns, rows) = (13, 7);
    let mut views = AngleViews { mounting: Mounting::default(), ..AngleViews::default() };
    let mut cameras = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let raw =
                [-1.0 + 2.0 * f64::from(i) / f64::from(columns - 1), -1.0 + 2.0 * f64::from(j) / f64::from(rows - 1)];
            let angles = [true_pan(raw[0]), true_tilt(raw[1])].map(|a| a + repeatability * random.normal());
            let (rotation, centre) = camera_pose(&MOUNTING, &levers, angles);
            cameras.push(Camera { pose: Rigid::from_centre(rotation.transpose(), &centre), ..camera() });
            views.raw.push(raw);
            views.angles.push(angles.map(|a| a + 0.01 * random.normal()));
        }
    }
    for _ in 0..2500 {
        let (pan, tilt) = (random.between(-2.1, 2.1), random.between(-0.8, 1.0));
        let direction = Vector3::new(pan.sin() * tilt.cos(), -tilt.sin(), pan.cos() * tilt.cos());
        let point = direction * (near * random.between(1.0, 3.0));
        let mut track = Vec::new();
        for (frame, c) in cameras.iter().enumerate() {
            let Some(pixel) = c.project(&point).filter(|p| c.contains(p)) else { continue };
            if random.between(0.0, 1.0) > 0.5 {
                continue;
            }
            let mut pixel = pixel + Vector2::new(random.normal(), random.normal()) * noise;
            if random.between(0.0, 1.0) < wrong {
                pixel += Vector2::new(random.between(-30.0, 30.0), random.between(-30.0, 30.0));
            }
            track.push(Sight { frame, pixel, sigma: 1.0 });
        }
        if track.len() >= 2 {
            views.tracks.push(track);
        }
    }
    views
}

/// Errors of the map in units of its sigma and in radians, at numbers over the range.
fn errors(learned: &LearnedAngles, random: &mut Random) -> Vec<(f64, f64)> {
    let zero = true_pan(0.0);
    let mut all = Vec::new();
    for _ in 0..8 {
        let raw = random.between(-1.0, 1.0);
        for (axis, truth) in [(&learned.map.pan, true_pan(raw) - zero), (&learned.map.tilt, true_tilt(raw))] {
            let error = axis.angle(raw).unwrap() - truth;
            all.push((error / axis.sigma(raw).unwrap(), error));
        }
    }
    all
}

#[test]
fn sigmas_cover_the_errors() {
    for (near, wrong) in [(30.0, 0.0), (3.0, 0.05)] {
        let (mut square, mut inside, mut count, mut radians) = (0.0, 0, 0, 0.0);
        let runs = 6;
        for run in 0..runs {
            let mut random = Random(17 + run);
            // What is not known is drawn from what is said of it.
            let usual = AngleLearningOptions::default();
            let levers = usual.levers.map(|l| l + usual.lever_sigma * random.normal());
            let views = draw(&mut random, levers, near, 0.2, 1e-4, wrong);
            let options = AngleLearningOptions { scene: [near, 4.0 * near], ..AngleLearningOptions::default() };
            let learned = solve(&views, &camera(), &options, &Cancel::new()).unwrap();
            for (z, error) in errors(&learned, &mut random) {
                square += z * z;
                radians += error * error;
                inside += i32::from(z.abs() < 2.0);
                count += 1;
            }
            assert!(learned.repeatability.iter().all(|r| (0.7e-4..1.4e-4).contains(r)), "{:?}", learned.repeatability);
            // A point takes up to three of its residuals for itself.
            let sights: usize = views.tracks.iter().map(Vec::len).sum();
            let left = 1.0 - 1.5 * views.tracks.len() as f64 / sights as f64;
            assert!((learned.rms / (0.2 * (2.0 * left).sqrt()) - 1.0).abs() < 0.1, "{} {left}", learned.rms);
            assert!((learned.outliers - wrong).abs() < 0.03);
            let m = &learned.map;
            for (got, truth, sigma) in [
                (m.mounting.collimation, MOUNTING.collimation, m.mounting_sigma[0]),
                (m.mounting.roll, MOUNTING.roll, m.mounting_sigma[1]),
                (m.mounting.trunnion, MOUNTING.trunnion, m.mounting_sigma[2]),
            ] {
                // The sigma leaves out what a wrong split of the lever arms does, some 1e-4.
                assert!((got - truth).abs() < 4.0 * sigma + 4e-4 && sigma < 2e-3, "{got} {truth} {sigma}");
            }
        }
        let (rms, inside) = ((square / f64::from(count)).sqrt(), f64::from(inside) / f64::from(count));
        let degrees = (radians / f64::from(count)).sqrt().to_degrees();
        println!("scene from {near} m: errors {degrees:.4} deg rms, {rms:.2} sigma, {inside:.3} within 2 sigma");
        // 6 runs x 2 axes, most of each error one draw of the parallax.
        assert!((0.4..1.6).contains(&rms) && inside > 0.87, "{rms} {inside}");
    }
}

#[test]
fn bad_views_are_refused() {
    let mut random = Random(3);
    let good = draw(&mut random, [0.0; 4], 30.0, 0.2, 0.0, 0.0);
    let with = |change: &dyn Fn(&mut AngleViews)| {
        let mut views = good.clone();
        change(&mut views);
        solve(&views, &camera(), &AngleLearningOptions::default(), &Cancel::new()).err().unwrap()
    };
    assert!(matches!(with(&|v| v.raw.clear()), Error::InvalidArgument { .. }));
    assert!(matches!(with(&|v| v.angles[3][0] = f64::NAN), Error::NotFinite { .. }));
    assert!(matches!(with(&|v| v.tracks[5].truncate(1)), Error::InvalidArgument { .. }));
    assert!(matches!(with(&|v| v.tracks[5][0].frame = 1000), Error::InvalidArgument { .. }));
    assert!(matches!(with(&|v| v.tracks[5][0].sigma = 0.0), Error::InvalidArgument { .. }));
    assert!(matches!(with(&|v| v.tracks[5][0].pixel.x = f64::NAN), Error::InvalidArgument { .. }));
    assert!(matches!(with(&|v| v.tracks.truncate(3)), Error::TooFewMatches { .. }));
    // Numbers of which nothing follows: shuffled against the angles.
    let shuffled = with(&|v| (0..91).for_each(|i| v.raw[i][0] = good.raw[(i * 37) % 91][0]));
    assert!(matches!(shuffled, Error::Ambiguous { .. }), "{shuffled}");
    // A camera with another focal length does not close the pictures.
    let mut other = camera();
    other.intrinsics = Intrinsics::new(500.0, 360.0, 288.0);
    let options = AngleLearningOptions::default();
    let error = solve(&good, &other, &options, &Cancel::new()).err().unwrap();
    assert!(error.to_string().contains("another lens") || matches!(error, Error::NoConvergence { .. }), "{error}");
    let strict = AngleLearningOptions { max_rms: 0.2, ..options };
    assert!(matches!(solve(&good, &camera(), &strict, &Cancel::new()), Err(Error::NoConsensus { .. })));
    let cancel = Cancel::new();
    cancel.cancel();
    assert_eq!(solve(&good, &camera(), &options, &cancel).unwrap_err(), Error::Cancelled);
    for bad in [
        AngleLearningOptions { step: 0.0, ..options },
        AngleLearningOptions { scene: [0.0, 1.0], ..options },
        AngleLearningOptions { scene: [2.0, 1.0], ..options },
        AngleLearningOptions { scene: [2.0, f64::NAN], ..options },
        AngleLearningOptions { levers: [f64::NAN; 4], ..options },
        AngleLearningOptions { lever_sigma: -1.0, ..options },
        AngleLearningOptions { min_positions: 2, ..options },
        AngleLearningOptions { max_frames: 0, ..options },
        AngleLearningOptions { approach: 1.0, ..options },
        AngleLearningOptions { max_rms: f64::NAN, ..options },
    ] {
        assert!(matches!(solve(&good, &camera(), &bad, &Cancel::new()), Err(Error::InvalidArgument { .. })), "{bad:?}");
    }
}

/// A head that hides its angles behind numbers of its own.
struct Hidden {
    head: Box<dyn PanTiltZoom>,
    /// Number of an angle, pan and tilt, and back.
    to_raw: [fn(f64) -> f64; 2],
    to_angle: [fn(f64) -> f64; 2],
    /// Does not move at all.
    stuck: bool,
}

impl PanTiltZoom for Hidden {
    fn capabilities(&self) -> PtzCapabilities {
        let c = self.head.capabilities();
        let range = |[low, high]: [f64; 2], f: fn(f64) -> f64| {
            let ends = [f(low), f(high)];
            // Within, so that rounding does not lead out of the head's own.
            let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            [low + 1e-9 * (high - low), high - 1e-9 * (high - low)]
        };
        PtzCapabilities {
            pan_range: range(c.pan_range, self.to_raw[0]),
            tilt_range: range(c.tilt_range, self.to_raw[1]),
            pan_step: 0.0,
            tilt_step: 0.0,
            raw_units: true,
            ..c
        }
    }
    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        if self.stuck { Ok(()) } else { self.head.move_absolute(self.to_angle[0](pan), self.to_angle[1](tilt)) }
    }
    fn position(&mut self) -> Result<PtzPosition> {
        let at = self.head.position()?;
        Ok(PtzPosition { pan: self.to_raw[0](at.pan), tilt: self.to_raw[1](at.tilt), zoom: 0.0 })
    }
    fn motion(&mut self) -> Result<Motion> {
        self.head.motion()
    }
    fn stop(&mut self) -> Result<()> {
        self.head.stop()
    }
}

/// Inverse of a growing function by halving.
fn inverse(f: fn(f64) -> f64, y: f64) -> f64 {
    let (mut low, mut high) = (-10.0, 10.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle) < y { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

fn bent(angle: f64) -> f64 {
    (angle + 0.08 * (2.0 * angle).sin()) / 1.8
}

/// Learns the simulator's head behind `to_raw` and compares over the whole range: greatest and rms
/// errors of pan and tilt in degrees.
fn learn(address: &str, to_raw: [fn(f64) -> f64; 2], to_angle: [fn(f64) -> f64; 2]) -> (LearnedAngles, [f64; 4]) {
    let simulator = Simulator::new(SimOptions::parse(address).unwrap()).unwrap();
    let rig = simulator.truth().rig;
    let mut head = Hidden { head: Box::new(simulator.ptz()), to_raw, to_angle, stuck: false };
    let clock = simulator.clock();
    let o = rig.offsets;
    let options = AngleLearningOptions {
        scene: [1.0, 5.0],
        levers: [o.tilt_y, o.tilt_z, o.pan_x, o.pan_z],
        lever_sigma: 0.002,
        ..AngleLearningOptions::default()
    };
    let start = std::time::Instant::now();
    let learned = learn_angles(
        &mut LearningParts {
            head: &mut head,
            frames: &mut simulator.head_frames(),
            camera: rig.head_camera(0.0, 0.0),
            clock: &*clock,
            log: &Log::silent(),
        },
        &options,
        &Cancel::new(),
        &mut |_| Continue(()),
    )
    .unwrap();
    let mut worst = [0.0f64; 4];
    let (e, map) = (rig.encoders, &learned.map);
    for (k, axis, scale, zero) in [(0, &map.pan, e.pan_scale, 0.0), (1, &map.tilt, e.tilt_scale, e.tilt_zero)] {
        let [low, high] = axis.raw_range();
        let at_zero = scale * to_angle[k](0.0);
        for i in 0..=400 {
            let raw = (low + (high - low) * f64::from(i) / 400.0).min(high);
            let truth = scale * to_angle[k](raw) + zero - if k == 0 { at_zero } else { 0.0 };
            let error = (axis.angle(raw).unwrap() - truth).to_degrees();
            worst[k] = worst[k].max(error.abs());
            worst[2 + k] += error * error / 401.0;
        }
        worst[2 + k] = worst[2 + k].sqrt();
    }
    let sigma = |axis: &AxisMap| axis.raw_range().map(|r| axis.sigma(r).unwrap().to_degrees());
    println!(
        "{address}: {} frames, {} pairs, rms {:.2} px, {:.1} % outliers, pan within {:.3} deg (rms {:.3}, sigma at the ends {:.3?}), \
         tilt within {:.3} deg (rms {:.3}, sigma {:.3?}), repeatability {:.4?} deg, {:?} sigmas {:?}, parallax {:.4} +- {:.4}, {:.1} s ({:.0} s of the head's time)",
        learned.frames.len(),
        learned.pairs.len(),
        learned.rms,
        100.0 * learned.outliers,
        worst[0],
        worst[2],
        sigma(&map.pan),
        worst[1],
        worst[3],
        sigma(&map.tilt),
        learned.repeatability.map(f64::to_degrees),
        map.mounting,
        map.mounting_sigma,
        learned.parallax,
        learned.parallax_sigma,
        start.elapsed().as_secs_f64(),
        clock.now(),
    );
    (learned, worst)
}

/// Refusals of a head in the simulator.
fn refused(address: &str, stuck: bool, scene_options: impl Fn(&mut AngleLearningOptions), cancel: &Cancel) -> Error {
    let simulator = Simulator::new(SimOptions::parse(address).unwrap()).unwrap();
    let same: [fn(f64) -> f64; 2] = [|a| a, |a| a];
    let mut head = Hidden { head: Box::new(simulator.ptz()), to_raw: same, to_angle: same, stuck };
    let mut options = AngleLearningOptions::default();
    scene_options(&mut options);
    let clock = simulator.clock();
    let mut parts = LearningParts {
        head: &mut head,
        frames: &mut simulator.head_frames(),
        camera: simulator.truth().rig.head_camera(0.0, 0.0),
        clock: &*clock,
        log: &Log::silent(),
    };
    learn_angles(&mut parts, &options, cancel, &mut |_| Continue(())).err().unwrap()
}

#[test]
fn heads_that_teach_nothing_are_refused() {
    let none = |_: &mut AngleLearningOptions| {};
    let go = Cancel::new();
    // No light, no texture.
    let error = refused("sim:room?gain=0.1&noise=0&shot=0&psf=5", false, none, &go);
    assert!(matches!(error, Error::NotFound { .. } | Error::TooFewMatches { .. }), "{error}");
    // A head that stands still: it never comes to its target.
    let error = refused("sim:room", true, none, &go);
    assert!(error.to_string().contains("stands at"), "{error}");
    let error = refused("sim:room?frames_time_out=1", false, none, &go);
    assert!(matches!(error, Error::DeviceTimeout { .. }), "{error}");
    let error = refused("sim:room?unplug_after=60", false, none, &go);
    assert!(matches!(error, Error::DeviceLost { .. }), "{error}");
    let error = refused("sim:room", false, |o| o.max_frames = 20, &go);
    assert!(error.to_string().contains("frames are needed"), "{error}");
    let error = refused("sim:room", false, |o| o.step = 0.0, &go);
    assert!(matches!(error, Error::InvalidArgument { .. }), "{error}");
    let cancel = Cancel::new();
    cancel.cancel();
    assert_eq!(refused("sim:room", false, none, &cancel), Error::Cancelled);
}

/// Turns between the frames of a 3 x 3 grid; `twist` changes the pan turns.
fn grid(twist: impl Fn(usize) -> f64) -> (Vec<[f64; 2]>, Vec<[usize; 2]>, Vec<Pair>) {
    let cells: Vec<[usize; 2]> = (0..9).map(|k| [k % 3, k / 3]).collect();
    let raw: Vec<[f64; 2]> = cells.iter().map(|c| c.map(|i| i as f64)).collect();
    let at = |c: [usize; 2]| camera_pose(&MOUNTING, &[0.0; 4], [0.2 * c[0] as f64, 0.15 * c[1] as f64 - 0.1]).0;
    let mut pairs = Vec::new();
    for a in 0..9 {
        for by in [[1, 0], [0, 1]] {
            let there = [cells[a][0] + by[0], cells[a][1] + by[1]];
            let Some(b) = cells.iter().position(|c| *c == there) else { continue };
            let mut rotation = at(there).transpose() * at(cells[a]);
            if by == [1, 0] && twist(a) < 0.0 {
                rotation.transpose_mut();
            }
            pairs.push(Pair { a, b, matches: vec![[0, 0]; 30], rotation });
        }
    }
    (raw, cells, pairs)
}

#[test]
fn a_start_is_found_from_turns_and_contradictions_are_refused() {
    let (raw, cells, pairs) = grid(|_| 1.0);
    let found = start::start(&raw, &cells, &pairs, 4).unwrap();
    assert!(found.frames.len() == 9 && found.frames[0] == 4);
    for (k, angles) in found.frames.iter().zip(&found.angles) {
        let pan = angles[0] - found.angles[0][0] - 0.2 * (cells[*k][0] as f64 - 1.0);
        let tilt = angles[1] - (0.15 * cells[*k][1] as f64 - 0.1);
        assert!(pan.abs() < 3e-3 && tilt.abs() < 3e-3, "{k}: {pan} {tilt}");
    }
    assert!((found.mounting.roll - MOUNTING.roll).abs() < 1e-6);
    // The first of the three columns' steps against the second.
    let (raw, cells, pairs) = grid(|a| if cells[a][0] == 0 { -1.0 } else { 1.0 });
    assert!(matches!(start::start(&raw, &cells, &pairs, 4), Err(Error::Ambiguous { .. })));
    // Pan that does not turn anything.
    let (raw, cells, mut pairs) = grid(|_| 1.0);
    pairs.iter_mut().filter(|p| p.b == p.a + 1).for_each(|p| p.rotation.fill_with_identity());
    assert!(matches!(start::start(&raw, &cells, &pairs, 4), Err(Error::NotFound { .. })));
    // Both axes the same.
    let (raw, cells, mut pairs) = grid(|_| 1.0);
    let pan = pairs[0].rotation;
    pairs.iter_mut().for_each(|p| p.rotation = pan);
    assert!(matches!(start::start(&raw, &cells, &pairs, 4), Err(Error::Degenerate { .. })));
}

#[test]
fn the_simulators_head_is_learned_behind_a_line() {
    let to_raw: [fn(f64) -> f64; 2] = [|a| -a / 1.8 + 0.03, |a| a / 0.5 - 0.1];
    let to_angle: [fn(f64) -> f64; 2] = [|r| (0.03 - r) * 1.8, |r| (r + 0.1) * 0.5];
    let (_, worst) = learn("sim:room?seed=2", to_raw, to_angle);
    assert!(worst[0] < 0.3 && worst[1] < 0.15, "{worst:?}");
}

#[test]
fn the_simulators_head_is_learned_behind_a_curve_among_people() {
    let to_raw: [fn(f64) -> f64; 2] = [|a| 2400.0 * bent(a), |a| -1000.0 * (a + 0.3 * a * a)];
    let to_angle: [fn(f64) -> f64; 2] =
        [|r| inverse(bent, r / 2400.0), |r| (-1.0 + (1.0 - 1.2 * r / 1000.0).max(0.0).sqrt()) / 0.6];
    let (_, worst) = learn("sim:room?seed=3&person=1", to_raw, to_angle);
    assert!(worst[0] < 0.3 && worst[1] < 0.15, "{worst:?}");
}
