//! The head behind a Pelco line: one-way commands, and positions from those devices that answer.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use super::codec::{Dialect, Drive, FULL_SPEED, Framer, Message, Quantity};
use crate::control::{Clock, Log, LogLevel};
use crate::device::{
    Brake, Focus, Identity, Link, Motion, PanTiltZoom, PtzCapabilities, PtzPosition, PtzVelocity, Sender, turned_into,
};
use crate::error::{Error, Result};

/// Hundredths of a degree in a turn.
const TURN: f64 = 36_000.0;
const ATTEMPTS: u32 = 3;
/// Bytes without a reply among them after which a line counts as garbled.
const MAX_NOISE: usize = 4096;
/// 1 to 32: the numbers behind them move the head or change its set-up.
const PRESETS: u32 = 32;

/// Which way the device's tilt counts. It is 0 at the horizon and wraps at 360 degrees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TiltDirection {
    /// Positive is below the horizon, as Pelco's domes have it.
    Down,
    Up,
}

/// What the line cannot tell. Angles are radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PelcoOptions {
    pub dialect: Dialect,
    /// 1 to 255.
    pub address: u8,
    pub tilt_direction: TiltDirection,
    pub pan_range: [f64; 2],
    pub tilt_range: [f64; 2],
    /// Encoder step; 0: unknown. The protocol's unit of 0.01 degree is mostly finer.
    pub step: f64,
    /// Pan and tilt at full speed, per second; 0: unknown, and 1 radian per second is taken for it.
    pub full_speed: [f64; 2],
    /// How long to wait for each reply, seconds.
    pub reply_timeout: f64,
}

impl PelcoOptions {
    pub fn new(dialect: Dialect) -> Self {
        Self {
            dialect,
            address: 1,
            tilt_direction: TiltDirection::Down,
            // One unit short of the turn, so that every direction has one reading.
            pan_range: [-PI, PI - TAU / TURN],
            tilt_range: [-FRAC_PI_2, FRAC_PI_2],
            step: 0.0,
            full_speed: [0.0; 2],
            reply_timeout: 0.3,
        }
    }
}

pub struct PelcoHead {
    link: Box<dyn Link>,
    sender: Arc<dyn Sender>,
    clock: Arc<dyn Clock>,
    options: PelcoOptions,
    framer: Framer,
    /// Does it answer when asked for pan and tilt, and for zoom?
    answers: bool,
    answers_zoom: bool,
    /// Pan and tilt that a device that never answers was sent to; unknown before that and after a
    /// drive.
    sent: Option<[f64; 2]>,
    /// The same of the zoom; wide at first, where devices start.
    sent_zoom: f64,
}

struct PelcoBrake {
    sender: Arc<dyn Sender>,
    stop: Vec<u8>,
}

impl Brake for PelcoBrake {
    fn stop(&self) -> Result<()> {
        self.sender.send(&self.stop)
    }
}

impl PelcoHead {
    /// Asks for the position once, to learn whether the device answers at all.
    ///
    /// # Errors
    /// `DeviceGarbled` when bytes come back that are no messages; the link's own.
    pub fn open(link: Box<dyn Link>, options: PelcoOptions, clock: Arc<dyn Clock>, log: &Log) -> Result<Self> {
        let sender = link.sender();
        let framer = Framer::new(options.dialect);
        let mut head = Self {
            link,
            sender,
            clock,
            options,
            framer,
            answers: false,
            answers_zoom: false,
            sent: None,
            sent_zoom: 0.0,
        };
        head.answers = head.does_answer(Quantity::Pan)?;
        head.answers_zoom = head.answers && head.does_answer(Quantity::Zoom)?;
        if !head.answers {
            let address = options.address;
            log.write(LogLevel::Warning, || {
                format!("no answer from Pelco address {address}: positions are those it is sent to")
            });
        }
        Ok(head)
    }

    fn does_answer(&mut self, quantity: Quantity) -> Result<bool> {
        match self.query(quantity) {
            Ok(_) => Ok(true),
            Err(Error::DeviceTimeout { .. }) => Ok(false),
            Err(error) => Err(error),
        }
    }

    fn send(&self, message: Message) -> Result<()> {
        self.sender.send(&self.options.dialect.encode(self.options.address, &message))
    }

    fn query(&mut self, quantity: Quantity) -> Result<u16> {
        let mut noise = 0;
        for _ in 0..ATTEMPTS {
            self.framer.clear();
            self.send(Message::Query(quantity))?;
            if let Some(value) = self.reply(quantity, &mut noise)? {
                return Ok(value);
            }
        }
        if noise > 0 {
            let reason = format!("{noise} bytes came back from it that are no messages");
            return Err(Error::DeviceGarbled { device: self.name(), reason });
        }
        Err(Error::DeviceTimeout { what: "Pelco device", seconds: self.options.reply_timeout * f64::from(ATTEMPTS) })
    }

    /// Waits for one reply. Counts bytes that are no message of this line as noise, unless they
    /// begin like one: devices that only acknowledge do so in a form of their own.
    fn reply(&mut self, quantity: Quantity, noise: &mut usize) -> Result<Option<u16>> {
        let end = self.clock.now() + self.options.reply_timeout;
        let header = self.options.dialect.header(self.options.address);
        let mut seen = Vec::new();
        let mut buffer = [0; 64];
        loop {
            let left = end - self.clock.now();
            let count = if left > 0.0 { self.link.receive(&mut buffer, left)? } else { 0 };
            if count == 0 {
                let alike = seen.is_empty() || seen.windows(2).any(|pair| pair == header);
                *noise += if alike { 0 } else { seen.len() };
                return Ok(None);
            }
            for &byte in buffer.iter().take(count) {
                seen.push(byte);
                match self.framer.push(byte) {
                    Some((address, Message::Position(of, value)))
                        if address == self.options.address && of == quantity =>
                    {
                        return Ok(Some(value));
                    }
                    // An echo of our own, or another device's.
                    Some(_) => seen.clear(),
                    None => {}
                }
            }
            if seen.len() > MAX_NOISE {
                *noise += seen.len();
                return Ok(None);
            }
        }
    }

    fn name(&self) -> String {
        format!("Pelco address {}", self.options.address)
    }

    /// From the horizon up, whichever way the device counts.
    fn tilt_sign(&self) -> f64 {
        match self.options.tilt_direction {
            TiltDirection::Down => -1.0,
            TiltDirection::Up => 1.0,
        }
    }

    fn full_speed(&self) -> [f64; 2] {
        self.options.full_speed.map(|speed| if speed > 0.0 { speed } else { 1.0 })
    }

    fn preset(number: u32) -> Result<u8> {
        match u8::try_from(number) {
            Ok(n) if number < PRESETS => Ok(n + 1),
            _ => Err(Error::invalid("preset", format!("{number} is not from 0 to {}", PRESETS - 1))),
        }
    }
}

/// Hundredths of a degree, 0 to 35999.
fn to_word(angle: f64) -> u16 {
    // Within 0..TURN after the second remainder: rounding may have reached the full turn.
    ((angle / TAU * TURN).round().rem_euclid(TURN)) as u16
}

/// Radians in [-pi, pi).
fn to_angle(word: u16) -> f64 {
    let turned = f64::from(word).rem_euclid(TURN);
    (if turned >= TURN / 2.0 { turned - TURN } else { turned }) / TURN * TAU
}

fn check(name: &'static str, value: f64, [low, high]: [f64; 2]) -> Result<()> {
    if !value.is_finite() {
        return Err(Error::NotFinite { name, index: 0 });
    }
    // A whisker for the rounding of limits given in degrees.
    if value < low - 1e-9 || value > high + 1e-9 {
        return Err(Error::Unreachable { reason: format!("{name} {value:.4} rad is not in {low:.4} to {high:.4}") });
    }
    Ok(())
}

impl PanTiltZoom for PelcoHead {
    fn capabilities(&self) -> PtzCapabilities {
        PtzCapabilities {
            pan_range: self.options.pan_range,
            tilt_range: self.options.tilt_range,
            pan_step: self.options.step,
            tilt_step: self.options.step,
            max_speed: self.options.full_speed,
            reports_position: self.answers,
            has_zoom: true,
            has_drive: true,
            has_relative: true,
            has_home: true,
            has_focus: true,
            presets: PRESETS,
            ..PtzCapabilities::default()
        }
    }

    fn identity(&mut self) -> Result<Identity> {
        let protocol = match self.options.dialect {
            Dialect::D => "Pelco-D",
            Dialect::P(_) => "Pelco-P",
        };
        Ok(Identity { protocol: protocol.into(), ..Identity::default() })
    }

    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        check("pan", pan, self.options.pan_range)?;
        check("tilt", tilt, self.options.tilt_range)?;
        // Half sent is nowhere.
        self.sent = None;
        self.send(Message::SetPosition(Quantity::Pan, to_word(pan)))?;
        self.send(Message::SetPosition(Quantity::Tilt, to_word(self.tilt_sign() * tilt)))?;
        self.sent = Some([pan, tilt]);
        Ok(())
    }

    fn move_relative(&mut self, pan: f64, tilt: f64) -> Result<()> {
        let from = self.position()?;
        self.move_absolute(from.pan + pan, from.tilt + tilt)
    }

    /// # Errors
    /// `BadState` from a device that never answers and was not sent to an absolute position since
    /// it was opened, driven, stopped or sent to a preset.
    fn position(&mut self) -> Result<PtzPosition> {
        if !self.answers {
            let [pan, tilt] = self.sent.ok_or_else(|| Error::BadState {
                reason: format!("{} does not tell its position: send it somewhere first", self.name()),
            })?;
            return Ok(PtzPosition { pan, tilt, zoom: self.sent_zoom });
        }
        let pan = turned_into(self.options.pan_range, to_angle(self.query(Quantity::Pan)?));
        let tilt = self.tilt_sign() * to_angle(self.query(Quantity::Tilt)?);
        let zoom = match self.answers_zoom {
            true => f64::from(self.query(Quantity::Zoom)?) / f64::from(u16::MAX),
            false => self.sent_zoom,
        };
        Ok(PtzPosition { pan, tilt, zoom })
    }

    fn motion(&mut self) -> Result<Motion> {
        Ok(Motion::Unknown)
    }

    fn stop(&mut self) -> Result<()> {
        self.sent = None;
        self.send(Message::Drive(Drive::default()))
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        let stop = self.options.dialect.encode(self.options.address, &Message::Drive(Drive::default()));
        Some(Arc::new(PelcoBrake { sender: self.sender.clone(), stop }))
    }

    fn drive(&mut self, velocity: PtzVelocity, _timeout: f64) -> Result<()> {
        let given = [velocity.pan, velocity.tilt, velocity.zoom];
        if let Some(index) = given.iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "velocity", index });
        }
        let [pan, tilt] = self.full_speed();
        // The slowest is 1: with 0 many devices do not move at all.
        let speed = |share: f64| -> i8 {
            let size = (share.abs().min(1.0) * f64::from(FULL_SPEED)).round().max(1.0) as i8;
            if share == 0.0 { 0 } else { size * share.signum() as i8 }
        };
        self.sent = None;
        if velocity.zoom != 0.0 {
            let speed = (velocity.zoom.abs().min(1.0) * 3.0).round() as u8;
            self.send(Message::ZoomSpeed(speed))?;
        }
        self.send(Message::Drive(Drive {
            pan: speed(velocity.pan / pan),
            tilt: speed(velocity.tilt / tilt),
            zoom: if velocity.zoom == 0.0 { 0 } else { velocity.zoom.signum() as i8 },
            focus: 0,
        }))
    }

    /// To pan 0, tilt 0.
    fn home(&mut self) -> Result<()> {
        self.move_absolute(0.0, 0.0)
    }

    fn set_zoom(&mut self, zoom: f64) -> Result<()> {
        if !(0.0..=1.0).contains(&zoom) {
            return Err(Error::invalid("zoom", format!("{zoom} is not in [0, 1]")));
        }
        self.send(Message::SetPosition(Quantity::Zoom, (zoom * f64::from(u16::MAX)).round() as u16))?;
        self.sent_zoom = zoom;
        Ok(())
    }

    fn set_focus(&mut self, focus: Focus) -> Result<()> {
        match focus {
            Focus::Auto => self.send(Message::AutoFocus(true)),
            Focus::Manual => self.send(Message::AutoFocus(false)),
            Focus::At(_) => Err(Error::Unsupported { what: "a place of the focus in Pelco's protocols".into() }),
        }
    }

    fn store_preset(&mut self, preset: u32) -> Result<()> {
        self.send(Message::SetPreset(Self::preset(preset)?))
    }

    fn recall_preset(&mut self, preset: u32) -> Result<()> {
        let number = Self::preset(preset)?;
        self.sent = None;
        self.send(Message::GotoPreset(number))
    }

    fn clear_preset(&mut self, preset: u32) -> Result<()> {
        self.send(Message::ClearPreset(Self::preset(preset)?))
    }
}
