//! A VISCA camera as a head.

use std::sync::Arc;

use super::bus::{Bus, LineBrake};
use super::codec::{Answer, DriveState, Inquiry, ModeWord, PresetAction, Register, Request, Zooming};
use super::exposure::Modes;
use super::jobs::{Axis, Progress};
use super::models::{Axis as Scale, Model};
use super::session::Session;
use crate::control::LogLevel;
use crate::device::{
    Brake, Focus, Identity, Motion, PanTiltZoom, PtzCapabilities, PtzPosition, PtzVelocity, Surroundings,
};
use crate::error::{Error, Result};

/// A head that stands so long has ended its move, whether it said so or not, seconds.
const STILL: f64 = 1.0;
/// A head that is said to have arrived and is farther from its target than this has not, degrees.
/// More than cheap cameras are off, less than any move that was lost.
const MISS: f64 = 0.25;
/// Greatest code of zoom's speed.
const ZOOM_SPEED: f64 = 7.0;

const AUTO_FOCUS: u16 = 2;
const MANUAL_FOCUS: u16 = 3;

/// A camera's head.
///
/// A move is over when the camera says that it has completed it, that it does not move (where it knows
/// that inquiry), and that it is at its target. Where the line has lost a completion, or the target
/// was missed, a head that stands still for a second has ended its move: well, when it is at its
/// target, else it has failed.
pub struct ViscaHead {
    pub(super) session: Session,
    identity: Identity,
    /// Its model number, where it states one.
    id: Option<u16>,
    /// When it was made sure that this is the camera.
    identified: u64,
    /// Where the last move leads, until it is there.
    target: Option<[i32; 2]>,
    /// The last move ended elsewhere.
    failed: bool,
    /// Last reading without motion, and since when.
    still: Option<([i32; 3], f64)>,
    driving: bool,
    zooming: bool,
    /// Stops so far, its own and those from elsewhere.
    stops: u64,
    /// How the camera was set before exposure was locked.
    pub(super) unlocked: Option<Modes>,
}

impl ViscaHead {
    /// Opens the head of the camera with this address on a line. Without a model the camera is asked.
    ///
    /// # Errors
    /// Those of opening the line; `DeviceTimeout` when nobody answers, `DeviceGarbled` when it cannot
    /// be understood, `DeviceMismatch` when it is another model, or one that is unknown.
    pub fn open(
        bus: Arc<Bus>,
        address: u8,
        model: Option<&'static Model>,
        surroundings: &Surroundings,
    ) -> Result<Self> {
        let device = format!("camera {address} at {}", bus.name());
        let (clock, log) = (surroundings.clock.clone(), surroundings.log.clone());
        let mut session = Session::new(bus, clock, log, model.unwrap_or(&Model::EVI_D100), address)?;
        let version = session.identify()?;
        let found = version.and_then(|version| Model::with_id(version.model));
        let model = match (model, found) {
            (Some(asked), Some(found)) if asked != found => {
                let reason = format!("this is a {}, not a {}", found.title, asked.title);
                return Err(Error::DeviceMismatch { device, reason });
            }
            (Some(asked), _) => asked,
            (None, Some(found)) => found,
            (None, None) => {
                let what = version.map_or("it does not say its model".to_owned(), |version| {
                    format!("its model number {:04X} is not known", version.model)
                });
                let names = Model::ALL.map(|model| model.name).join(", ");
                return Err(Error::DeviceMismatch { device, reason: format!("{what}: give model= one of {names}") });
            }
        };
        session.set_model(model);
        let identity = Identity {
            protocol: "VISCA".into(),
            vendor: model.vendor.into(),
            model: model.title.into(),
            firmware: version.map_or(String::new(), |version| format!("{:04X}", version.rom)),
        };
        surroundings.log.write(LogLevel::Info, || format!("{device}: {} {}", identity.vendor, identity.model));
        Ok(Self {
            identified: session.generation(),
            session,
            identity,
            id: version.map(|version| version.model),
            target: None,
            failed: false,
            still: None,
            driving: false,
            zooming: false,
            stops: 0,
            unlocked: None,
        })
    }

    pub(super) fn model(&self) -> &'static Model {
        self.session.model()
    }

    /// Opens the line again where that is needed, and makes sure that it is still this camera.
    fn ready(&mut self) -> Result<()> {
        self.session.begin_call()?;
        let stops = self.session.bus().outlet().stops(self.session.address());
        if std::mem::replace(&mut self.stops, stops) != stops {
            self.driving = false;
            self.zooming = false;
            self.failed = false;
            self.target = None;
        }
        if self.session.generation() == self.identified {
            return Ok(());
        }
        let version = self.session.identify()?;
        if version.map(|version| version.model) != self.id {
            return Err(Error::DeviceMismatch {
                device: format!("camera {} at {}", self.session.address(), self.session.bus().name()),
                reason: format!("this is not the {} that was opened", self.identity.model),
            });
        }
        self.identified = self.session.generation();
        Ok(())
    }

    fn units(&mut self) -> Result<[i32; 2]> {
        match self.session.inquire(Inquiry::Position)? {
            Answer::Position { pan, tilt } => Ok([pan, tilt]),
            other => Err(unexpected(other)),
        }
    }

    pub(super) fn register(&mut self, register: Register) -> Result<u16> {
        match self.session.inquire(Inquiry::Register(register))? {
            Answer::Value(value) => Ok(value),
            other => Err(unexpected(other)),
        }
    }

    /// The number, where this camera knows it.
    pub(super) fn optional_register(&mut self, register: Register) -> Result<Option<u16>> {
        match self.register(register) {
            Ok(value) => Ok(Some(value)),
            Err(Error::DeviceRefused { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    pub(super) fn set(&mut self, register: Register, value: u16) -> Result<()> {
        self.session.command(Request::Set(register, value))
    }

    fn mode(&mut self) -> Result<Option<ModeWord>> {
        if !self.model().reports_mode {
            return Ok(None);
        }
        match self.session.inquire(Inquiry::Mode)? {
            Answer::Mode(mode) => Ok(Some(mode)),
            other => Err(unexpected(other)),
        }
    }

    /// Moves at full speed. The pan and tilt are the model's units.
    fn start(&mut self, request: Request, target: Option<[i32; 2]>) -> Result<()> {
        self.driving = false;
        self.failed = false;
        self.still = None;
        self.target = target;
        self.session.command(request)
    }

    fn full_speed(&self) -> [u8; 2] {
        [self.model().pan.max_speed_code(), self.model().tilt.max_speed_code()]
    }

    fn misses(&self, at: [i32; 2]) -> bool {
        let model = self.model();
        let Some(target) = self.target else { return false };
        let far =
            |axis: &Scale, k: usize| f64::from(target[k].abs_diff(at[k])) > (MISS * axis.units_per_degree).max(1.0);
        far(&model.pan, 0) || far(&model.tilt, 1)
    }

    /// Nobody tells how the move ended: does the head stand?
    fn watch(&mut self, [pan, tilt]: [i32; 2]) -> Result<Motion> {
        let zoom = i32::from(self.register(Register::Zoom)?);
        let (reading, now) = ([pan, tilt, zoom], self.session.now());
        match self.still {
            Some((last, since)) if last == reading => {
                if now - since < STILL {
                    return Ok(Motion::Moving);
                }
            }
            _ => {
                self.still = Some((reading, now));
                return Ok(Motion::Moving);
            }
        }
        self.session.set_done();
        let failed = self.misses([pan, tilt]);
        self.target = None;
        self.failed = failed;
        Ok(if failed { Motion::Failed } else { Motion::Idle })
    }

    fn preset(&mut self, action: PresetAction, preset: u32) -> Result<()> {
        let count = self.model().presets;
        let Some(number) = u8::try_from(preset).ok().filter(|_| preset < count) else {
            return Err(Error::invalid("preset", format!("{preset} is not among the presets 0 to {}", count - 1)));
        };
        self.ready()?;
        let request = Request::Preset(action, number);
        if action == PresetAction::Recall { self.start(request, None) } else { self.session.command(request) }
    }
}

impl PanTiltZoom for ViscaHead {
    fn capabilities(&self) -> PtzCapabilities {
        let model = self.model();
        let speed = |axis: &Scale| axis.speed(axis.max_speed_code());
        PtzCapabilities {
            pan_range: model.pan.range_radians(),
            tilt_range: model.tilt.range_radians(),
            pan_step: model.pan.step(),
            tilt_step: model.tilt.step(),
            max_speed: [speed(&model.pan), speed(&model.tilt)],
            raw_units: false,
            reports_motion: true,
            reports_position: true,
            has_zoom: true,
            has_drive: true,
            has_relative: true,
            has_view_moves: false,
            has_home: true,
            has_focus: true,
            has_exposure_lock: true,
            presets: model.presets,
        }
    }

    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        let model = self.model();
        let target = [model.pan.to_units("pan", pan)?, model.tilt.to_units("tilt", tilt)?];
        within_reach(model, target)?;
        self.ready()?;
        let [pan, tilt] = target;
        self.start(Request::MoveTo { speed: self.full_speed(), pan, tilt }, Some(target))
    }

    fn move_relative(&mut self, pan: f64, tilt: f64) -> Result<()> {
        let model = self.model();
        let [pan, tilt] = [model.pan.to_units("pan", pan)?, model.tilt.to_units("tilt", tilt)?];
        self.ready()?;
        let [from_pan, from_tilt] = self.units()?;
        let target = [from_pan.saturating_add(pan), from_tilt.saturating_add(tilt)];
        within_reach(model, target)?;
        self.start(Request::MoveBy { speed: self.full_speed(), pan, tilt }, Some(target))
    }

    fn position(&mut self) -> Result<PtzPosition> {
        self.ready()?;
        let model = self.model();
        let [pan, tilt] = self.units()?;
        let [wide, tele] = model.zoom.map(f64::from);
        let zoom = (f64::from(self.register(Register::Zoom)?) - wide) / (tele - wide);
        Ok(PtzPosition {
            pan: model.pan.to_radians(pan),
            tilt: model.tilt.to_radians(tilt),
            // Beyond 1 there is digital zoom.
            zoom: zoom.clamp(0.0, 1.0),
        })
    }

    fn motion(&mut self) -> Result<Motion> {
        self.ready()?;
        let progress = [Axis::Head, Axis::Zoom].map(|axis| self.session.progress(axis));
        if self.failed || progress.contains(&Progress::Failed) {
            return Ok(Motion::Failed);
        }
        let state = self.mode()?.map(ModeWord::state);
        if state == Some(DriveState::Moving) || (state.is_none() && self.driving) || self.zooming {
            self.still = None;
            return Ok(Motion::Moving);
        }
        if progress != [Progress::Done; 2] {
            let at = self.units()?;
            return self.watch(at);
        }
        if state == Some(DriveState::Failed) {
            return Ok(Motion::Failed);
        }
        if self.target.is_some() {
            let at = self.units()?;
            if self.misses(at) {
                return self.watch(at);
            }
            self.target = None;
        }
        Ok(Motion::Idle)
    }

    fn stop(&mut self) -> Result<()> {
        self.still = None;
        self.session.set_done();
        self.session.bus().outlet().stop(self.model(), self.session.address())
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        let outlet = self.session.bus().outlet().clone();
        Some(Arc::new(LineBrake { outlet, model: self.model(), address: self.session.address() }))
    }

    fn identity(&mut self) -> Result<Identity> {
        self.ready()?;
        Ok(self.identity.clone())
    }

    fn drive(&mut self, velocity: PtzVelocity, _timeout: f64) -> Result<()> {
        let model = self.model();
        let code = |axis: &Scale, name, speed: f64| -> Result<i8> {
            let code = axis.speed_code(name, speed)? as i8;
            Ok(if speed == 0.0 { 0 } else { code * speed.signum() as i8 })
        };
        let pan = code(&model.pan, "pan", velocity.pan)?;
        let tilt = code(&model.tilt, "tilt", velocity.tilt)?;
        if velocity.zoom.is_nan() {
            return Err(Error::invalid("zoom", "NaN is no speed"));
        }
        let zoom_speed = Some((velocity.zoom.abs().min(1.0) * ZOOM_SPEED).round() as u8);
        self.ready()?;
        self.session.set_done();
        self.start(Request::Drive { pan, tilt }, None)?;
        self.driving = pan != 0 || tilt != 0;
        if velocity.zoom != 0.0 || self.zooming {
            let zooming = match velocity.zoom {
                0.0 => Zooming::Stop,
                speed if speed > 0.0 => Zooming::Tele(zoom_speed),
                _ => Zooming::Wide(zoom_speed),
            };
            self.session.command(Request::Zoom(zooming))?;
            self.zooming = velocity.zoom != 0.0;
        }
        Ok(())
    }

    fn home(&mut self) -> Result<()> {
        self.ready()?;
        // Where that is, some cameras let their users choose.
        self.start(Request::Home, None)
    }

    fn set_zoom(&mut self, zoom: f64) -> Result<()> {
        let [wide, tele] = self.model().zoom;
        let value = share_of("zoom", zoom, wide, tele)?;
        self.ready()?;
        self.zooming = false;
        self.still = None;
        self.set(Register::Zoom, value)
    }

    fn set_focus(&mut self, focus: Focus) -> Result<()> {
        let place = match focus {
            Focus::At(place) => Some(self.focus_place(place)?),
            Focus::Auto | Focus::Manual => None,
        };
        self.ready()?;
        self.set(Register::FocusMode, if focus == Focus::Auto { AUTO_FOCUS } else { MANUAL_FOCUS })?;
        place.map_or(Ok(()), |place| self.set(Register::Focus, place))
    }

    fn focus(&mut self) -> Result<f64> {
        let [far, near] = self.focus_scale()?.map(f64::from);
        self.ready()?;
        let at = f64::from(self.register(Register::Focus)?);
        Ok(((at - far) / (near - far)).clamp(0.0, 1.0))
    }

    fn lock_exposure(&mut self, locked: bool) -> Result<()> {
        self.ready()?;
        match (locked, self.unlocked) {
            (false, _) => self.unlock(),
            (true, Some(_)) => Ok(()),
            (true, None) => self.lock().inspect_err(|_| {
                // Half locked is neither; the first error is the one to tell.
                let _ = self.unlock();
            }),
        }
    }

    fn store_preset(&mut self, preset: u32) -> Result<()> {
        self.preset(PresetAction::Store, preset)
    }

    fn recall_preset(&mut self, preset: u32) -> Result<()> {
        self.preset(PresetAction::Recall, preset)
    }

    fn clear_preset(&mut self, preset: u32) -> Result<()> {
        self.preset(PresetAction::Clear, preset)
    }
}

impl ViscaHead {
    fn focus_scale(&self) -> Result<[u16; 2]> {
        let what = || format!("places of focus by {}: its manual does not tell the scale", self.model().title);
        self.model().focus.ok_or_else(|| Error::Unsupported { what: what() })
    }

    fn focus_place(&self, place: f64) -> Result<u16> {
        let [far, near] = self.focus_scale()?;
        share_of("focus", place, far, near)
    }
}

/// The number that lies a share of the way from one to another.
fn share_of(name: &'static str, share: f64, from: u16, to: u16) -> Result<u16> {
    if !share.is_finite() {
        return Err(Error::invalid(name, format!("{share} is no number from 0 to 1")));
    }
    if !(0.0..=1.0).contains(&share) {
        return Err(Error::Unreachable { reason: format!("{name} {share} is not within 0 to 1") });
    }
    Ok((f64::from(from) + share * (f64::from(to) - f64::from(from))).round() as u16)
}

/// A camera would go to the end of its travel and say nothing.
fn within_reach(model: &Model, target: [i32; 2]) -> Result<()> {
    for (name, axis, units) in [("pan", &model.pan, target[0]), ("tilt", &model.tilt, target[1])] {
        if !axis.contains(units) {
            let [low, high] = axis.range_radians().map(f64::to_degrees);
            let angle = axis.to_radians(units).to_degrees();
            return Err(Error::Unreachable {
                reason: format!("{name} {angle:.2} deg is not within {low:.2} to {high:.2} deg"),
            });
        }
    }
    Ok(())
}

fn unexpected(answer: Answer) -> Error {
    Error::Internal { reason: format!("{answer:?} answers another inquiry") }
}
