//! A small fake rig for tests: a virtual clock, a head that takes time to move, a laser with a
//! history, cameras that draw a Gaussian spot on a smooth background, and faults at any call.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::{Vector2, Vector3};

use super::{RigOptions, RigParts};
use crate::control::{Clock, Log};
use crate::device::{Frame, FrameSource, Laser, Motion, PanTiltZoom, PtzCapabilities, PtzPosition};
use crate::error::{Error, Result};
use crate::geometry::rig_model::{AxisOffsets, Encoders, LaserLine};
use crate::geometry::{Camera, Distortion, Intrinsics, RigModel, Rigid};
use crate::image::{Image, PixelFormat};

/// Numbers that vary; the multiplier is Knuth's.
pub struct Random(pub u64);

impl Random {
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// Mean 0, variance 1, near enough to normal.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.between(-0.5, 0.5)).sum()
    }

    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.between(-1.0, 1.0))
    }
}

/// What happens at the call whose number is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    Error,
    Lost,
    Panic,
    /// The error, at this call and at every later one.
    Dead,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    Move(f64, f64),
    Stop,
    Laser(bool),
    /// A frame of camera 0 (the head) or of fixed camera i - 1.
    Frame(usize),
}

/// How the fake misbehaves.
#[derive(Debug, Clone, Copy)]
pub struct Habits {
    pub reports_motion: bool,
    /// Reports target and idle at once, while the head moves on for its time.
    pub lies: bool,
    /// Does not tell its position: it is where it was sent, and nowhere once it was stopped.
    pub mute: bool,
    /// Stays this far short of targets in pan.
    pub short: f64,
    /// Never stops moving.
    pub restless: bool,
    /// Frames have timestamps; else they come from a ring of two old ones.
    pub stamped: bool,
    /// No frames at all.
    pub blind: bool,
    /// Its positions are numbers without known angles.
    pub raw_units: bool,
}

impl Default for Habits {
    fn default() -> Self {
        Self {
            reports_motion: true,
            lies: false,
            mute: false,
            short: 0.0,
            restless: false,
            stamped: true,
            blind: false,
            raw_units: false,
        }
    }
}

pub struct World {
    pub now: f64,
    pub habits: Habits,
    /// Calls of any device so far, and the one that fails.
    pub calls: usize,
    pub fault: Option<(usize, Fault)>,
    pub history: Vec<Event>,
    /// Start and end of the current move, and when it started.
    from: Vector2<f64>,
    to: Vector2<f64>,
    started: f64,
    toggles: Vec<(f64, bool)>,
    pub laser_lit: bool,
    /// The laser's next calls with false fail this often.
    pub stuck_on: usize,
    /// Start of each camera's newest frame.
    newest: Vec<f64>,
    random: Random,
}

/// The fake's world and clock; clones share it.
#[derive(Clone)]
pub struct Fake(Arc<Mutex<World>>);

pub const STEP: f64 = 0.001;
/// Radians per second.
const SPEED: f64 = 1.5;
const FRAME_TIME: f64 = 1.0 / 30.0;
const EXPOSURE: f64 = 0.01;

impl Fake {
    pub fn new() -> Self {
        Self(Arc::new(Mutex::new(World {
            now: 100.0,
            habits: Habits::default(),
            calls: 0,
            fault: None,
            history: Vec::new(),
            from: Vector2::zeros(),
            to: Vector2::zeros(),
            started: 0.0,
            toggles: Vec::new(),
            laser_lit: false,
            stuck_on: 0,
            newest: vec![0.0; 8],
            random: Random(7),
        })))
    }

    pub fn with(habits: Habits) -> Self {
        let fake = Self::new();
        fake.world().habits = habits;
        fake
    }

    pub fn world(&self) -> MutexGuard<'_, World> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Where the head truly is now.
    pub fn head(&self) -> Vector2<f64> {
        let world = self.world();
        world.head(world.now)
    }

    /// The longest that the laser was on without a break, seconds.
    pub fn longest_time_on(&self) -> f64 {
        let toggles = &self.world().toggles;
        let spans = toggles.windows(2).filter(|w| w[0].1 && !w[1].1).map(|w| w[1].0 - w[0].0);
        spans.fold(0.0, f64::max)
    }

    /// The greatest share of any `window` seconds that the laser was on.
    pub fn greatest_share_on(&self, window: f64) -> f64 {
        let toggles = &self.world().toggles;
        let spans: Vec<[f64; 2]> = toggles.windows(2).filter(|w| w[0].1 && !w[1].1).map(|w| [w[0].0, w[1].0]).collect();
        let within = |end: f64| -> f64 {
            spans.iter().map(|&[on, off]| (off.min(end) - on.max(end - window)).max(0.0)).sum::<f64>() / window
        };
        // The share rises to its peaks where light ends.
        spans.iter().map(|&[_, off]| within(off)).fold(0.0, f64::max)
    }

    pub fn parts(&self) -> RigParts {
        RigParts {
            model: model(),
            ptz: Box::new(FakeHead(self.clone())),
            laser: Box::new(FakeLaser(self.clone())),
            frames: Box::new(FakeCamera { fake: self.clone(), index: 0 }),
            clock: Arc::new(self.clone()),
            log: Log::silent(),
        }
    }

    pub fn rig(&self) -> super::Rig {
        super::Rig::open(self.parts(), RigOptions::default()).unwrap()
    }

    pub fn fixed_frames(&self, index: usize) -> Box<dyn FrameSource> {
        Box::new(FakeCamera { fake: self.clone(), index: index + 1 })
    }

    /// Counts a call and lets it fail when its turn has come.
    fn call(&self) -> Result<MutexGuard<'_, World>> {
        let mut world = self.world();
        world.calls += 1;
        match world.fault {
            Some((at, Fault::Dead)) if world.calls >= at => Err(Error::DeviceLost { reason: "dead".into() }),
            Some((at, fault)) if world.calls == at => match fault {
                Fault::Error | Fault::Dead => Err(Error::Device { reason: "injected".into() }),
                Fault::Lost => Err(Error::DeviceLost { reason: "injected".into() }),
                Fault::Panic => {
                    drop(world);
                    panic!("injected");
                }
            },
            _ => Ok(world),
        }
    }
}

impl Clock for Fake {
    fn now(&self) -> f64 {
        self.world().now
    }

    fn sleep(&self, seconds: f64) {
        self.world().now += seconds;
    }
}

impl World {
    fn travel_time(&self) -> f64 {
        (self.to - self.from).amax() / SPEED
    }

    /// Where the head truly is at a time.
    fn head(&self, time: f64) -> Vector2<f64> {
        let wobble = if self.habits.restless { 0.3 * (0.4 * time).fract() } else { 0.0 };
        let s = ((time - self.started) / self.travel_time().max(1e-9)).clamp(0.0, 1.0);
        self.from + (self.to - self.from) * s + Vector2::new(wobble, 0.0)
    }

    fn lit_during(&self, start: f64, end: f64) -> bool {
        let before = self.toggles.iter().rev().find(|(t, _)| *t <= start).is_some_and(|(_, on)| *on);
        before && !self.toggles.iter().any(|(t, _)| *t > start && *t < end)
    }
}

pub struct FakeHead(pub Fake);

impl PanTiltZoom for FakeHead {
    fn capabilities(&self) -> PtzCapabilities {
        let habits = self.0.world().habits;
        PtzCapabilities {
            pan_range: [-1.7, 1.7],
            tilt_range: [-0.5, 0.5],
            pan_step: STEP,
            tilt_step: STEP,
            reports_motion: habits.reports_motion,
            reports_position: !habits.mute,
            raw_units: habits.raw_units,
            ..PtzCapabilities::default()
        }
    }

    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        let mut w = self.0.call()?;
        w.history.push(Event::Move(pan, tilt));
        w.from = w.head(w.now);
        let short = w.habits.short;
        w.to = Vector2::new(pan - short, tilt).map(|v| (v / STEP).round() * STEP);
        w.started = w.now;
        Ok(())
    }

    fn position(&mut self) -> Result<PtzPosition> {
        let mut w = self.0.call()?;
        w.now += 0.002;
        if w.habits.mute {
            let last = w.history.iter().rev().find(|event| matches!(event, Event::Move(..) | Event::Stop));
            let Some(&Event::Move(pan, tilt)) = last else {
                return Err(Error::BadState { reason: "sent nowhere yet".into() });
            };
            return Ok(PtzPosition { pan, tilt, zoom: 0.0 });
        }
        let at = if w.habits.lies { w.to } else { w.head(w.now).map(|v| (v / STEP).round() * STEP) };
        Ok(PtzPosition { pan: at.x, tilt: at.y, zoom: 0.0 })
    }

    fn motion(&mut self) -> Result<Motion> {
        let w = self.0.call()?;
        let moving = w.now < w.started + w.travel_time() && !w.habits.lies;
        Ok(if moving { Motion::Moving } else { Motion::Idle })
    }

    fn stop(&mut self) -> Result<()> {
        let mut w = self.0.call()?;
        w.history.push(Event::Stop);
        let at = w.head(w.now);
        (w.from, w.to) = (at, at);
        Ok(())
    }
}

pub struct FakeLaser(pub Fake);

impl Laser for FakeLaser {
    fn set(&mut self, on: bool) -> Result<()> {
        // The light goes on even when the call then fails: the worst case. It goes off only when
        // the call succeeds.
        if on {
            let mut w = self.0.world();
            let now = w.now;
            w.toggles.push((now, true));
            w.laser_lit = true;
            w.history.push(Event::Laser(true));
        }
        let mut w = self.0.call()?;
        if !on {
            if w.stuck_on > 0 {
                w.stuck_on -= 1;
                return Err(Error::Device { reason: "stuck".into() });
            }
            let now = w.now;
            w.toggles.push((now, false));
            w.laser_lit = false;
            w.history.push(Event::Laser(false));
        }
        Ok(())
    }
}

struct FakeCamera {
    fake: Fake,
    index: usize,
}

impl FrameSource for FakeCamera {
    fn next_frame(&mut self, not_before: f64, timeout: f64, frame: &mut Frame) -> Result<()> {
        let mut w = self.fake.call()?;
        let newest = w.newest[self.index];
        let earliest = if w.habits.stamped {
            not_before.max(newest + 0.5 * FRAME_TIME)
        } else {
            // Whatever the ring of two holds.
            (newest + 0.5 * FRAME_TIME).max(w.now - 3.0 * FRAME_TIME)
        };
        // Cameras are not synchronised.
        let phase = 0.004 * self.index as f64;
        let start = ((earliest - phase) / FRAME_TIME).ceil() * FRAME_TIME + phase;
        let delivered = start + EXPOSURE;
        if delivered > w.now + timeout || w.habits.blind {
            w.now += timeout;
            return Err(Error::DeviceTimeout { what: "fake camera", seconds: timeout });
        }
        w.now = w.now.max(delivered);
        w.newest[self.index] = start;
        w.history.push(Event::Frame(self.index));
        frame.image = draw(&mut w, self.index, start);
        frame.timestamp = if w.habits.stamped { start } else { f64::NAN };
        Ok(())
    }
}

pub const SIZE: (u32, u32) = (240, 180);

pub fn model() -> RigModel {
    RigModel {
        width: SIZE.0,
        height: SIZE.1,
        intrinsics: Intrinsics::new(300.0, 120.0, 90.0),
        distortion: Distortion::BrownConrady([-0.1, 0.02, 0.001, -0.0005, 0.0]),
        laser: LaserLine { x0: 0.1, y0: 0.005, vx: -0.02, vy: 0.003 },
        offsets: AxisOffsets { tilt_y: 0.01, tilt_z: 0.02, pan_x: 0.005, pan_z: 0.02 },
        encoders: Encoders { pan_zero: 0.01, pan_scale: 1.001, tilt_zero: -0.02, tilt_scale: 0.999 },
    }
}

/// The fixed cameras of the fake.
pub fn fixed_camera(index: usize) -> Camera {
    let centre = [Vector3::new(-1.2, -0.5, 0.2), Vector3::new(1.3, -0.6, 0.4)][index];
    Camera {
        width: SIZE.0,
        height: SIZE.1,
        intrinsics: Intrinsics::new(200.0, 122.0, 88.0),
        distortion: Distortion::None,
        pose: Rigid::look_at(&centre, &Vector3::new(0.0, 0.1, 3.0)).unwrap(),
    }
}

/// Where the laser meets the room: a back wall, a floor and two boxes.
pub fn laser_hit(pan: f64, tilt: f64) -> Vector3<f64> {
    let (o, d) = model().laser_in_world(pan, tilt);
    let wall = o + d * ((4.0 - o.z) / d.z);
    let floor = Some((1.0 - o.y) / d.y).filter(|s| *s > 0.0).map(|s| o + d * s);
    let front = |z: f64, left: f64, right: f64, top: f64| {
        let x = o + d * ((z - o.z) / d.z);
        (x.x > left && x.x < right && x.y > top && x.y < 1.0).then_some(x)
    };
    [Some(wall), floor, front(2.2, -0.8, -0.2, 0.0), front(2.8, 0.3, 0.9, -0.5)]
        .into_iter()
        .flatten()
        .min_by(|a, b| a.z.total_cmp(&b.z))
        .unwrap()
}

fn draw(w: &mut World, index: usize, time: f64) -> Image {
    let at = w.head(time);
    let camera = if index == 0 { model().head_camera(at.x, at.y) } else { fixed_camera(index - 1) };
    let spot = w
        .lit_during(time, time + EXPOSURE)
        .then(|| camera.project(&laser_hit(at.x, at.y)))
        .flatten()
        .unwrap_or(Vector2::new(-1e3, -1e3));
    let view = if index == 0 { at * 300.0 } else { Vector2::zeros() };
    let mut image = Image::new(PixelFormat::Rgb24, SIZE.0, SIZE.1);
    let waves: Vec<f64> = (0..SIZE.0).map(|x| 25.0 * ((f64::from(x) + view.x) / 23.0).sin()).collect();
    for (y, row) in image.data.chunks_exact_mut(3 * SIZE.0 as usize).enumerate() {
        let shade = 90.0 + 20.0 * ((y as f64 - view.y) / 17.0).cos();
        for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
            let offset = Vector2::new(x as f64, y as f64) - spot;
            let light =
                if offset.amax() < 8.0 { 110.0 * (-offset.norm_squared() / (2.0 * 1.3 * 1.3)).exp() } else { 0.0 };
            let value = shade + waves[x] + 2.0 * w.random.between(-1.0, 1.0);
            *pixel.first_chunk_mut::<3>().unwrap() =
                [value + light, value + 0.2 * light, value].map(|v| v.round().clamp(0.0, 255.0) as u8);
        }
    }
    image
}
