//! The state that all simulated devices share: the virtual time, the head, the laser, the faults.

use std::collections::VecDeque;
use std::f64::consts::PI;

use super::motion::HeadMotion;
use super::options::{Faults, SimOptions};
use super::rig;
use super::scene::Person;
use super::sensor::{Exposure, split_mix};
use super::spot::{Beam, Glow};
use crate::error::{Error, Result};
use crate::geometry::{Camera, RigModel, Rigid};

/// A camera keeps its frames so long, seconds.
const RING: f64 = 1.0;
/// Longer timeouts are cut to this, seconds.
const LONGEST_WAIT: f64 = 1e6;
/// Moments at which a frame looks at the head and the laser during its exposure.
const MOMENTS: usize = 16;
/// At most so many backgrounds are averaged in a frame that is blurred by motion.
const MAX_BLUR_POSES: usize = 4;
/// Period of the auto-exposure's swing, seconds.
const DRIFT_PERIOD: f64 = 7.3;
/// What one call of the head takes, as a serial line would need, seconds.
pub const PTZ_CALL: f64 = 0.008;
/// From the call to the light, seconds.
const LASER_CALL: f64 = 0.002;

/// Which camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraId {
    Head,
    Fixed(usize),
}

/// A frame's number and when its exposure began, once the waiting is over.
pub struct Wait {
    pub until: f64,
    pub frame: Result<(i64, f64)>,
}

pub struct World {
    pub options: SimOptions,
    pub rig: RigModel,
    /// From the room to the rig frame of the station, and back.
    pub station: Rigid,
    from_station: Rigid,
    /// In the room's frame.
    pub fixed: Vec<Camera>,
    pub faults: Faults,
    pub now: f64,
    pub motion: HeadMotion,
    /// When it was switched, and to what.
    laser: VecDeque<(f64, bool)>,
    ptz_calls: u64,
    rest_errors: u64,
}

impl World {
    pub fn new(options: &SimOptions) -> Self {
        let station = rig::station(options.station);
        Self {
            options: options.clone(),
            rig: rig::true_rig(),
            station,
            from_station: station.inverse(),
            fixed: (0..options.fixed_cameras).map(rig::fixed_camera).collect(),
            faults: options.faults,
            now: 0.0,
            motion: HeadMotion::new(options),
            laser: VecDeque::from([(f64::NEG_INFINITY, false)]),
            ptz_calls: 0,
            rest_errors: options.seed ^ 0x5EED_0F4E_57E4_4045,
        }
    }

    pub fn set_faults(&mut self, faults: Faults) {
        if self.faults.ptz_unplugged_after != faults.ptz_unplugged_after {
            self.ptz_calls = 0;
        }
        self.faults = faults;
    }

    /// Counts a call of the head.
    pub fn call_ptz(&mut self) -> Result<()> {
        self.ptz_calls += 1;
        match self.faults.ptz_unplugged_after {
            Some(calls) if self.ptz_calls > calls => {
                Err(Error::DeviceLost { reason: "the simulated head was unplugged".into() })
            }
            _ => Ok(()),
        }
    }

    /// Starts a move at a moment; says when the head is there.
    pub fn move_head(&mut self, begin: f64, target: [f64; 2], speed: [f64; 2]) -> f64 {
        let errors = [(); 2].map(|()| self.options.repeatability * normal(&mut self.rest_errors));
        self.motion.start_at_speed(begin, target, speed, errors)
    }

    /// Says when the light has changed.
    pub fn set_laser(&mut self, on: bool) -> Result<f64> {
        if on && self.faults.laser_refuses {
            return Err(Error::LaserRefused { reason: "the simulated laser refuses".into() });
        }
        let switched = self.now + LASER_CALL;
        if self.laser_at(switched) != on {
            self.laser.push_back((switched, on));
        }
        Ok(switched)
    }

    pub fn laser_at(&self, t: f64) -> bool {
        self.laser.iter().rev().find(|(since, _)| *since <= t).is_some_and(|(_, on)| *on)
    }

    /// The head camera in the room when the head is at `angles` (the device's).
    pub fn head_camera(&self, [pan, tilt]: [f64; 2]) -> Camera {
        let camera = self.rig.head_camera(pan, tilt);
        Camera { pose: camera.pose.after(&self.station), ..camera }
    }

    /// The laser's beam in the room.
    pub fn beam(&self, [pan, tilt]: [f64; 2]) -> Beam {
        let (origin, direction) = self.rig.laser_in_world(pan, tilt);
        let back = &self.from_station;
        Beam { origin: back.apply(&origin), direction: (back.rotation * direction).normalize() }
    }

    pub fn person(&self, t: f64) -> Option<Person> {
        self.faults.person.then(|| Person::at(t))
    }

    /// A camera in the rig frame of the station.
    pub fn in_station_frame(&self, camera: &Camera) -> Camera {
        Camera { pose: camera.pose.after(&self.from_station), ..*camera }
    }

    /// The first frame that begins at `not_before` or later, is number `at_least` or later, and is
    /// still kept; or, when it does not come in time, when the waiting is over.
    pub fn find_frame(&self, camera: CameraId, at_least: i64, not_before: f64, timeout: f64) -> Result<Wait> {
        if not_before.is_nan() || timeout.is_nan() {
            return Err(Error::invalid(if timeout.is_nan() { "timeout" } else { "not_before" }, "is NaN"));
        }
        let timeout = timeout.clamp(0.0, LONGEST_WAIT);
        let period = 1.0 / self.options.frame_rate;
        // Cameras are not synchronised.
        let phase = match camera {
            CameraId::Head => 0.0,
            CameraId::Fixed(i) => period * 0.31 * (i + 1) as f64,
        };
        let begin = |number: i64| phase + number as f64 * period;
        let earliest = not_before.max(self.now - RING);
        let mut number = at_least.max(((earliest - phase) / period).floor() as i64);
        if begin(number) < earliest {
            number = number.saturating_add(1);
        }
        let ready = begin(number) + self.options.exposure + self.options.latency;
        let found = !self.faults.frames_time_out && ready <= self.now + timeout;
        Ok(Wait {
            until: if found { ready } else { self.now + timeout },
            frame: if found {
                Ok((number, begin(number)))
            } else {
                Err(Error::DeviceTimeout { what: "simulated camera", seconds: timeout })
            },
        })
    }

    /// Drops what no frame can show any more.
    pub fn forget(&mut self) {
        let horizon = self.now - RING - 2.0 / self.options.frame_rate;
        self.motion.forget_before(horizon);
        while self.laser.len() > 1 && self.laser[1].0 <= horizon {
            self.laser.pop_front();
        }
    }

    /// What a camera sees from `begin` on.
    pub fn exposure(&self, camera: CameraId, number: i64, begin: f64) -> Exposure {
        let moments: [f64; MOMENTS] =
            std::array::from_fn(|k| begin + self.options.exposure * (k as f64 + 0.5) / MOMENTS as f64);
        let heads = moments.map(|t| self.motion.head(t));
        let shining = moments.map(|t| self.laser_at(t));
        let person = self.person(begin + 0.5 * self.options.exposure);
        let poses = match camera {
            CameraId::Fixed(i) => vec![self.fixed[i].pose],
            CameraId::Head => self.blur_poses(&heads),
        };
        let mut spots = Vec::new();
        let mut k = 0;
        while k < MOMENTS {
            // Moments at which nothing differs are one.
            let same = (k..MOMENTS).take_while(|&m| heads[m] == heads[k] && shining[m] == shining[k]).count();
            if shining[k] {
                let view = match camera {
                    CameraId::Fixed(i) => self.fixed[i],
                    CameraId::Head => self.head_camera(heads[k]),
                };
                let (main, second) = self.beam(heads[k]).glows(self.faults.reflection, person.as_ref());
                let image = |glow: Glow| {
                    glow.image(&view, self.options.point_spread, self.options.laser_power, person.as_ref())
                };
                let share = same as f64 / MOMENTS as f64;
                spots.extend([Some(main), second].into_iter().flatten().filter_map(image).map(|s| (s, share)));
            }
            k += same;
        }
        let camera_number = match camera {
            CameraId::Head => 0,
            CameraId::Fixed(i) => 1 + i as u64,
        };
        let mut seed = self.options.seed;
        for part in [camera_number, number as u64] {
            seed = split_mix(&mut seed) ^ part;
        }
        let swing = (2.0 * PI * begin / DRIFT_PERIOD).sin();
        Exposure { poses, spots, person, gain: 1.0 + self.faults.exposure_drift * swing, seed }
    }

    /// One pose for a head that stands or moves by less than a pixel, several for a blur.
    fn blur_poses(&self, heads: &[[f64; 2]; MOMENTS]) -> Vec<Rigid> {
        let extent = |k: usize| {
            let (low, high) =
                heads.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(a[k]), h.max(a[k])));
            high - low
        };
        let pixels = self.rig.intrinsics.fx * extent(0).hypot(extent(1));
        let count = (pixels.ceil() as usize).clamp(1, MAX_BLUR_POSES);
        let moment = |k: usize| heads[(2 * k + 1) * MOMENTS / (2 * count)];
        (0..count).map(|k| self.head_camera(moment(k)).pose).collect()
    }
}

/// A standard normal deviate.
fn normal(state: &mut u64) -> f64 {
    let mut uniform = || (split_mix(state) >> 11) as f64 / (1u64 << 53) as f64;
    let (a, b) = (1.0 - uniform(), uniform());
    (-2.0 * a.ln()).sqrt() * (2.0 * PI * b).cos()
}
