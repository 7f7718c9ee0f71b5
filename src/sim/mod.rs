//! A simulated rig in a room: a head with camera and laser, and fixed cameras, behind the same ports
//! as real devices. Addresses are `sim:room?key=value&...` ([`SimOptions::parse`]).
//!
//! The room (textured walls, floor, five boxes) is rendered with lens distortion, noise, saturation,
//! a halo about the spot, reflections on glossy faces and true occlusion. Time is virtual: waiting
//! for a frame or sleeping lets it pass at once. A frame shows what happened during its exposure, so
//! that one taken while the head swings or the laser switches shows a streak or half a spot.
//! The same options and the same sequence of calls give the same bytes.
//!
//! ```
//! use ptzcal::device::{Frame, FrameSource, Laser};
//! use ptzcal::sim::{SimOptions, Simulator};
//!
//! let simulator = Simulator::new(SimOptions::parse("sim:room?seed=3&noise=2.5")?)?;
//! let (mut laser, mut head) = (simulator.laser(), simulator.head_frames());
//! laser.set(true)?;
//! let mut frame = Frame::empty();
//! head.next_frame(simulator.clock().now(), 1.0, &mut frame)?;
//! let truth = simulator.spot_truth().head.expect("the head camera sees the spot");
//! let [red, ..] = frame.image.view()?.rgb(truth.x.round() as u32, truth.y.round() as u32);
//! assert!(red > 150);
//! # Ok::<(), ptzcal::Error>(())
//! ```

mod clock;
mod devices;
mod encode;
mod motion;
mod options;
mod render;
mod rig;
mod scene;
mod sensor;
mod spot;
mod texture;
pub mod visca_device;
mod world;

#[cfg(test)]
mod tests;

pub use clock::{ScaledClock, VirtualClock};
pub use devices::{SimClock, SimFrames, SimLaser, SimPtz};
pub use options::{Faults, SimOptions};

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use nalgebra::{Vector2, Vector3};

use crate::control::{Clock, Log, unpoisoned};
use crate::device::PanTiltZoom;
use crate::error::{Error, Result};
use crate::geometry::{Camera, RigModel, Rigid, rigid};
use sensor::{NoiseTable, Sensor};
use visca_device::{EmulatorOptions, ViscaDevice};
use world::{CameraId, World};

/// A simulated rig. Clones share the same rig.
#[derive(Clone)]
pub struct Simulator(Arc<Shared>);

/// What the devices share. The world's lock is never taken while a sensor's is held.
struct Shared {
    world: Mutex<World>,
    /// In real time.
    pace: Option<ScaledClock>,
    head: Mutex<Sensor>,
    fixed: Vec<Mutex<Sensor>>,
    frames: AtomicU64,
}

/// How things really are.
#[derive(Debug, Clone, PartialEq)]
pub struct SimTruth {
    pub rig: RigModel,
    /// Fixed cameras in the rig frame of the station.
    pub fixed: Vec<Camera>,
    /// From the room's frame (the rig frame of station 1) to the rig frame of the station.
    pub station: Rigid,
}

/// Where the laser's spot is now, or would be were the laser on.
#[derive(Debug, Clone, PartialEq)]
pub struct SpotTruth {
    /// In the rig frame of the station, metres.
    pub point: Vector3<f64>,
    /// Pixel in the head camera; `None` when hidden from it or outside its image.
    pub head: Option<Vector2<f64>>,
    /// The same for each fixed camera.
    pub fixed: Vec<Option<Vector2<f64>>>,
}

impl Simulator {
    /// # Errors
    /// `InvalidArgument` for options out of range.
    pub fn new(mut options: SimOptions) -> Result<Self> {
        options.validate()?;
        if options.visca.is_some() {
            options.step = 0.0;
        }
        let world = World::new(&options);
        let head_camera = world.head_camera([0.0; 2]);
        let widest = world.fixed.iter().map(|c| c.width).fold(head_camera.width, u32::max);
        let noise = Arc::new(NoiseTable::new(options.seed, 3 * widest as usize));
        let sensor = |camera: &Camera| Sensor::new(camera, &options, noise.clone()).map(Mutex::new);
        let head = sensor(&head_camera)?;
        let fixed = world.fixed.iter().map(sensor).collect::<Result<_>>()?;
        let pace = (options.real_time > 0.0).then(|| ScaledClock::new(options.real_time));
        Ok(Self(Arc::new(Shared { world: Mutex::new(world), pace, head, fixed, frames: AtomicU64::new(0) })))
    }

    pub fn ptz(&self) -> SimPtz {
        SimPtz(self.0.clone())
    }

    /// The head as the options have it: with `visca` an emulated camera and the library's driver, which
    /// talk to each other in bytes over a serial line in memory; else the same as [`ptz`](Self::ptz).
    ///
    /// # Errors
    /// The driver's.
    pub fn open_ptz(&self, log: Log) -> Result<Box<dyn PanTiltZoom>> {
        let model = self.0.world().options.visca;
        let Some(model) = model else { return Ok(Box::new(self.ptz())) };
        let seed = self.0.world().options.seed;
        let options = EmulatorOptions { models: vec![model], seed, ..EmulatorOptions::default() };
        Ok(Box::new(ViscaDevice::with_simulator(&options, self)?.head(1, Some(model), log)?))
    }

    pub fn laser(&self) -> SimLaser {
        SimLaser(self.0.clone())
    }

    /// Frames of the camera on the head, from now on.
    pub fn head_frames(&self) -> SimFrames {
        SimFrames { shared: self.0.clone(), camera: CameraId::Head, next: i64::MIN }
    }

    /// Frames of a fixed camera, from now on.
    ///
    /// # Errors
    /// `InvalidArgument` when there is no such camera.
    pub fn fixed_frames(&self, camera: usize) -> Result<SimFrames> {
        if camera >= self.fixed_cameras() {
            let reason = format!("{camera}: there are {} fixed cameras", self.fixed_cameras());
            return Err(Error::invalid("camera", reason));
        }
        Ok(SimFrames { shared: self.0.clone(), camera: CameraId::Fixed(camera), next: i64::MIN })
    }

    /// The virtual clock: frames are stamped with it, and waiting moves it on.
    pub fn clock(&self) -> Arc<dyn Clock> {
        Arc::new(SimClock(self.0.clone()))
    }

    pub fn fixed_cameras(&self) -> usize {
        self.0.fixed.len()
    }

    /// What the user would know of the rig: the truth less a small misalignment.
    pub fn nominal_rig(&self) -> RigModel {
        rig::nominal_rig(self.0.world().options.misalignment)
    }

    pub fn truth(&self) -> SimTruth {
        let world = self.0.world();
        let fixed = world.fixed.iter().map(|c| world.in_station_frame(c)).collect();
        SimTruth { rig: world.rig, fixed, station: world.station }
    }

    /// For where the head is at this moment of virtual time.
    pub fn spot_truth(&self) -> SpotTruth {
        let world = self.0.world();
        let (angles, person) = (world.motion.head(world.now), world.person(world.now));
        let (glow, _) = world.beam(angles).glows(world.faults.reflection, person.as_ref());
        SpotTruth {
            point: world.station.apply(&glow.surface.position),
            head: glow.pixel(&world.head_camera(angles), person.as_ref()),
            fixed: world.fixed.iter().map(|c| glow.pixel(c, person.as_ref())).collect(),
        }
    }

    pub fn faults(&self) -> Faults {
        self.0.world().faults
    }

    /// Changes what goes wrong from now on.
    pub fn set_faults(&self, faults: Faults) {
        self.0.world().set_faults(faults);
    }

    /// Somebody turns and moves a fixed camera: `turn` (axis times radians, its own axes) and `shift`
    /// (metres, room).
    ///
    /// # Errors
    /// `InvalidArgument` when there is no such camera, `NotFinite`.
    pub fn move_fixed_camera(&self, camera: usize, turn: &Vector3<f64>, shift: &Vector3<f64>) -> Result<()> {
        if let Some(index) = turn.iter().chain(shift).position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "move", index });
        }
        let mut world = self.0.world();
        let count = world.fixed.len();
        let moved = world.fixed.get_mut(camera);
        let moved =
            moved.ok_or_else(|| Error::invalid("camera", format!("{camera}: there are {count} fixed cameras")))?;
        moved.pose = Rigid::from_centre(rigid::exp(turn) * moved.pose.rotation, &(moved.centre() + shift));
        Ok(())
    }

    /// Frames delivered so far by all cameras.
    pub fn frames_delivered(&self) -> u64 {
        self.0.frames.load(Ordering::Relaxed)
    }
}

impl fmt::Debug for Simulator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Simulator").field(&self.0.world().options).finish()
    }
}

impl Shared {
    fn world(&self) -> MutexGuard<'_, World> {
        let mut world = unpoisoned(&self.world);
        if let Some(pace) = &self.pace {
            world.now = world.now.max(pace.now());
        }
        world
    }

    /// Lets time pass until a moment: at once, or in real time, with the world free for others.
    fn pass<'a>(&'a self, mut world: MutexGuard<'a, World>, until: f64) -> MutexGuard<'a, World> {
        let Some(pace) = &self.pace else {
            world.now = world.now.max(until);
            return world;
        };
        drop(world);
        pace.sleep(until - pace.now());
        self.world()
    }

    /// Every call of the head comes through here.
    fn call_ptz(&self) -> Result<MutexGuard<'_, World>> {
        let mut world = self.world();
        let called = world.call_ptz();
        let until = world.now + world::PTZ_CALL;
        let world = self.pass(world, until);
        called.map(|()| world)
    }

    fn set_laser(&self, on: bool) -> Result<()> {
        let mut world = self.world();
        let switched = world.set_laser(on)?;
        drop(self.pass(world, switched));
        Ok(())
    }

    fn sensor(&self, camera: CameraId) -> MutexGuard<'_, Sensor> {
        let sensor = match camera {
            CameraId::Head => &self.head,
            CameraId::Fixed(i) => &self.fixed[i],
        };
        unpoisoned(sensor)
    }

    fn count_frame(&self) {
        self.frames.fetch_add(1, Ordering::Relaxed);
    }
}
