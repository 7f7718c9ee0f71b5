//! Exploring the simulator's room, against where its fixed cameras truly see the spot.
#![allow(dead_code)]

use std::ops::ControlFlow::Continue;

use ptzcal::control::Log;
use ptzcal::device::PanTiltZoom;
use ptzcal::rig::{ExploreOptions, FixedCamera, Rig, RigOptions, RigParts, explore};
use ptzcal::sim::{SimOptions, Simulator};

/// What was found of a camera.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    pub shots: usize,
    pub seen: usize,
    /// Part of the directions (solid angle) in which the camera sees the spot that is in the region, and
    /// that is in its mask.
    pub covered: f64,
    pub in_mask: f64,
    /// Part of the region that the camera truly sees, and what was said of it.
    pub visible: f64,
    pub said: f64,
}

/// Explores with some of the room's fixed cameras.
pub fn explored(seed: u64, station: u32, cameras: &[usize]) -> Vec<Found> {
    let simulator = Simulator::new(SimOptions { seed, station, ..SimOptions::default() }).expect("a room");
    let parts = RigParts {
        model: simulator.nominal_rig(),
        ptz: Box::new(simulator.ptz()),
        laser: Box::new(simulator.laser()),
        frames: Box::new(simulator.head_frames()),
        clock: simulator.clock(),
        log: Log::silent(),
    };
    let mut rig = Rig::open(parts, RigOptions::default()).expect("a rig");
    let sizes: Vec<_> = simulator.truth().fixed.iter().map(|c| (c.width, c.height)).collect();
    let open =
        |c: &usize| FixedCamera::new(Box::new(simulator.fixed_frames(*c).expect("a camera")), sizes[*c].0, sizes[*c].1);
    let mut fixed: Vec<FixedCamera> = cameras.iter().map(open).collect();
    let mut shots = 0;
    let answer = explore(&mut rig, &ExploreOptions::default(), &mut fixed, &mut |p| {
        assert_eq!(p.done, shots);
        shots += 1;
        Continue(())
    })
    .expect("an exploration");
    assert_eq!(shots, answer.scan.shots.len() + 1);
    let truth = truth(&simulator);
    let judge = |(i, camera): (usize, &usize)| {
        let found = answer.cameras[i].as_ref().expect("a range");
        let r = &found.region;
        assert_eq!(found.mask.len(), r.len());
        let place = |range: [f64; 2], steps: u32, value: f64| {
            let at = (value - range[0]) / (range[1] - range[0]) * f64::from(steps - 1);
            (-1e-9..=f64::from(steps - 1) + 1e-9).contains(&at).then(|| at.round() as usize)
        };
        // All directions seen, those of them in region and mask; all of the region.
        let [mut all, mut inside, mut masked, mut region] = [0.0; 4];
        for ([pan, tilt], sees) in &truth {
            let weight = tilt.cos();
            let at = place(r.pan, r.pan_steps, *pan).zip(place(r.tilt, r.tilt_steps, *tilt));
            region += if at.is_some() { weight } else { 0.0 };
            if !sees[*camera] {
                continue;
            }
            all += weight;
            if let Some((column, row)) = at {
                inside += weight;
                masked += if found.mask[row * r.pan_steps as usize + column] { weight } else { 0.0 };
            }
        }
        Found {
            shots: answer.scan.shots.len(),
            seen: found.seen,
            covered: inside / all,
            in_mask: masked / all,
            visible: inside / region,
            said: found.share,
        }
    };
    cameras.iter().enumerate().map(judge).collect()
}

/// Whether each fixed camera sees the spot at readings on a grid of two degrees.
fn truth(simulator: &Simulator) -> Vec<([f64; 2], Vec<bool>)> {
    let (mut ptz, clock) = (simulator.ptz(), simulator.clock());
    let mut all = Vec::new();
    for pan in (-98..=98).step_by(2) {
        for tilt in (-24..=24).step_by(2) {
            let at = [pan, tilt].map(|a| f64::from(a).to_radians());
            ptz.move_absolute(at[0], at[1]).expect("a move");
            clock.sleep(4.0);
            all.push((at, simulator.spot_truth().fixed.iter().map(Option::is_some).collect()));
        }
    }
    all
}
