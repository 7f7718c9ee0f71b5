//! What settling costs: random moves of the simulated head, their true end known from its motors and its
//! swing. Time lost is from there to the rig's word that the head stands; frames that the rig goes on with
//! must show a head at rest.

use std::sync::{Arc, Mutex, PoisonError};

use ptzcal::control::{Cancel, Clock, Log};
use ptzcal::device::{Frame, FrameSource, Motion, PanTiltZoom, PtzCapabilities, PtzPosition};
use ptzcal::rig::{Rig, RigOptions, RigParts, SettleOptions};
use ptzcal::sim::{SimOptions, Simulator};

use super::figure::Figure;

/// A head this far from its rest, in pixels of its camera, moves: five times what spots are found to.
const AT_REST: f64 = 0.5;

/// Motors and swing as the simulator has them (`sim::motion`), rebuilt from the commands.
#[derive(Clone, Copy)]
struct Course {
    begin: f64,
    from: [f64; 2],
    to: [f64; 2],
}

impl Course {
    fn duration(&self, k: usize, speed: f64) -> f64 {
        (self.to[k] - self.from[k]).abs() / speed
    }

    fn motor(&self, k: usize, t: f64, o: &SimOptions) -> f64 {
        let share = ((t - self.begin) / self.duration(k, o.speed).max(1e-12)).clamp(0.0, 1.0);
        self.from[k] + (self.to[k] - self.from[k]) * share
    }

    /// Radians from the rest, about.
    fn off(&self, t: f64, o: &SimOptions) -> f64 {
        let axis = |k: usize| {
            let after = t - self.begin - self.duration(k, o.speed);
            if after < 0.0 {
                return self.to[k] - self.motor(k, t, o);
            }
            let size = ((self.to[k] - self.from[k]) / 10f64.to_radians()).clamp(-1.0, 1.0) * o.overshoot;
            if after < 0.2 { size * (-after / 0.05).exp() * (std::f64::consts::TAU * 8.0 * after).sin() } else { 0.0 }
        };
        axis(0).hypot(axis(1))
    }
}

#[derive(Default)]
struct Seen {
    courses: Vec<Course>,
    stamps: Vec<f64>,
}

type Shared = Arc<Mutex<Seen>>;

struct Head {
    inner: Box<dyn PanTiltZoom>,
    clock: Arc<dyn Clock>,
    options: SimOptions,
    seen: Shared,
}

impl PanTiltZoom for Head {
    fn capabilities(&self) -> PtzCapabilities {
        self.inner.capabilities()
    }
    fn move_absolute(&mut self, pan: f64, tilt: f64) -> ptzcal::Result<()> {
        self.inner.move_absolute(pan, tilt)?;
        let (begin, mut seen) = (self.clock.now(), self.seen.lock().unwrap_or_else(PoisonError::into_inner));
        let from = seen.courses.last().map_or([0.0; 2], |c| [0, 1].map(|k| c.motor(k, begin, &self.options)));
        seen.courses.push(Course { begin, from, to: [pan, tilt] });
        Ok(())
    }
    fn position(&mut self) -> ptzcal::Result<PtzPosition> {
        self.inner.position()
    }
    fn motion(&mut self) -> ptzcal::Result<Motion> {
        self.inner.motion()
    }
    fn stop(&mut self) -> ptzcal::Result<()> {
        self.inner.stop()
    }
}

struct Frames {
    inner: Box<dyn FrameSource>,
    seen: Shared,
}

impl FrameSource for Frames {
    fn next_frame(&mut self, not_before: f64, timeout: f64, frame: &mut Frame) -> ptzcal::Result<()> {
        self.inner.next_frame(not_before, timeout, frame)?;
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).stamps.push(frame.timestamp);
        Ok(())
    }
}

pub fn run(moves: usize, report: &mut impl FnMut(Vec<Figure>)) {
    for (name, address, direct) in [
        ("straight", "sim:room", true),
        ("from below", "sim:room", false),
        ("it lies about its arrival", "sim:room?ptz_lies=1", true),
        ("it swings by 0.5 deg", "sim:room?overshoot_deg=0.5", true),
        ("slow, 30 deg/s", "sim:room?speed_deg=30", true),
        ("a person, drift", "sim:room?person=1&drift=0.1", true),
    ] {
        match settle(name, address, direct, moves) {
            Ok(figures) => report(figures),
            Err(e) => println!("{address}: {e}"),
        }
    }
}

fn settle(name: &str, address: &str, direct: bool, moves: usize) -> ptzcal::Result<Vec<Figure>> {
    let options = SimOptions::parse(address)?;
    let simulator = Simulator::new(options.clone())?;
    let (clock, seen) = (simulator.clock(), Shared::default());
    let parts = RigParts {
        model: simulator.nominal_rig(),
        ptz: Box::new(Head {
            inner: Box::new(simulator.ptz()),
            clock: clock.clone(),
            options: options.clone(),
            seen: seen.clone(),
        }),
        laser: Box::new(simulator.laser()),
        frames: Box::new(Frames { inner: Box::new(simulator.head_frames()), seen: seen.clone() }),
        clock: clock.clone(),
        log: Log::silent(),
    };
    let mut settle = SettleOptions::default();
    if direct {
        settle.overshoot = 0.0;
    }
    let mut rig = Rig::open(parts, RigOptions { settle, ..RigOptions::default() })?;
    let focal = simulator.truth().rig.intrinsics.fx;
    let mut state = 7u64;
    let mut random = move |low: f64, high: f64| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        low + (high - low) * ((state >> 11) as f64 / (1u64 << 53) as f64)
    };
    let (mut lost, mut moving) = (Vec::new(), 0);
    for _ in 0..moves {
        let target = [random(-1.5, 1.5), random(-0.4, 0.4)];
        let begin = clock.now();
        rig.move_to(target[0], target[1], &Cancel::new())?;
        let seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
        let now = clock.now();
        // The last moment at which the head is not at rest.
        let Some(last) = seen.courses.last() else { continue };
        let first = seen.courses.iter().rev().take_while(|c| c.begin >= begin).last().unwrap_or(last);
        let end = |c: &Course| {
            let motors = (0..2).map(|k| c.duration(k, options.speed)).fold(0.0, f64::max);
            let stirs = |t: &f64| focal * c.off(*t, &options) > AT_REST;
            let swing = (0..=200).map(|i| c.begin + motors + 1e-3 * f64::from(i)).rfind(stirs);
            swing.unwrap_or(c.begin + motors)
        };
        // The best that could be done is the straight move.
        let straight = Course { to: target, ..*first };
        lost.push(now - end(&straight));
        let used = seen.stamps.iter().rev().take(2);
        moving += used.filter(|t| focal * last.off(**t + 0.5 * options.exposure, &options) > AT_REST).count();
    }
    lost.sort_by(f64::total_cmp);
    let mean = lost.iter().sum::<f64>() / lost.len() as f64;
    let figure = |what: &str, figure: f64, unit, bound: f64, limit: f64| Figure {
        goal: "settle",
        setup: format!("{name}: {what}"),
        figure,
        unit,
        bound,
        ratio: figure / bound,
        limit,
        runs: moves,
    };
    Ok(vec![
        figure("time lost a move, mean", 1e3 * mean, "ms", 200.0, 1.0),
        figure("time lost, 95 of 100 moves", 1e3 * lost[lost.len() * 95 / 100], "ms", 200.0, 2.0),
        figure("frames of a moving head that were used", f64::from(moving as u32), "", 1.0, 0.0),
    ])
}
