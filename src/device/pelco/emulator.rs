//! A Pelco device for tests: motors of limited speed, and the habits that drivers have to survive.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};

use super::codec::{Dialect, Drive, Framer, Message, Quantity};
use crate::control::Clock;
use crate::device::{Link, Sender};
use crate::error::{Error, Result};

/// Hundredths of a degree per second, of all axes (zoom: units per second).
const SPEED: f64 = 9000.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Habits {
    /// Never answers.
    pub mute: bool,
    /// Answers nothing about the zoom.
    pub no_zoom: bool,
    /// Every command is acknowledged with Pelco's general response of four bytes.
    pub acknowledges: bool,
    /// The line repeats what is sent, as two-wire adapters do.
    pub echoes: bool,
    /// Every so many bytes one is lost on the way back; 0: none.
    pub loses: usize,
    /// Answers with bytes that mean nothing, as at a wrong rate.
    pub garbles: bool,
    /// The line is dead: the plug is pulled.
    pub unplugged: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    at: f64,
    target: Option<f64>,
    velocity: f64,
}

impl Axis {
    fn pass(&mut self, seconds: f64) {
        match self.target {
            Some(target) => {
                let step = (target - self.at).clamp(-SPEED * seconds, SPEED * seconds);
                self.at += step;
            }
            None => self.at += self.velocity * seconds,
        }
    }
}

pub struct Device {
    dialect: Dialect,
    address: u8,
    pub habits: Habits,
    framer: Framer,
    /// Pan, tilt (unwrapped hundredths of a degree) and zoom.
    axes: [Axis; 3],
    time: f64,
    presets: [Option<[f64; 2]>; 256],
    /// Everything understood, in order.
    pub heard: Vec<Message>,
    out: VecDeque<u8>,
    sent: usize,
}

impl Device {
    pub fn new(dialect: Dialect, address: u8) -> Self {
        Self {
            dialect,
            address,
            habits: Habits::default(),
            framer: Framer::new(dialect),
            axes: [Axis::default(); 3],
            time: 0.0,
            presets: [None; 256],
            heard: Vec::new(),
            out: VecDeque::new(),
            sent: 0,
        }
    }

    /// What the device shows: pan and tilt as it counts them, and zoom.
    pub fn words(&self) -> [u16; 3] {
        let [pan, tilt, zoom] = self.axes.map(|a| a.at.round());
        [pan.rem_euclid(36_000.0) as u16, tilt.rem_euclid(36_000.0) as u16, zoom.clamp(0.0, 65535.0) as u16]
    }

    pub fn pass_to(&mut self, now: f64) {
        let seconds = (now - self.time).max(0.0);
        self.axes.iter_mut().for_each(|axis| axis.pass(seconds));
        self.time = now;
    }

    pub fn take(&mut self, bytes: &[u8]) {
        if self.habits.echoes {
            self.out.extend(bytes);
        }
        for &byte in bytes {
            if let Some((address, message)) = self.framer.push(byte)
                && address == self.address
            {
                self.heard.push(message);
                self.obey(message);
            }
        }
    }

    pub fn give(&mut self, buffer: &mut [u8]) -> usize {
        let mut count = 0;
        while count < buffer.len()
            && let Some(byte) = self.out.pop_front()
        {
            self.sent += 1;
            if self.habits.loses == 0 || !self.sent.is_multiple_of(self.habits.loses) {
                buffer[count] = byte;
                count += 1;
            }
        }
        count
    }

    fn obey(&mut self, message: Message) {
        let go_to = |axis: &mut Axis, target: f64| *axis = Axis { at: axis.at, target: Some(target), velocity: 0.0 };
        // The short way round.
        let near = |at: f64, word: f64| at + (word - at + 18_000.0).rem_euclid(36_000.0) - 18_000.0;
        match message {
            Message::SetPosition(Quantity::Zoom, value) => go_to(&mut self.axes[2], f64::from(value)),
            Message::SetPosition(quantity, value) => {
                let axis = &mut self.axes[usize::from(quantity == Quantity::Tilt)];
                let target = near(axis.at, f64::from(value));
                go_to(axis, target);
            }
            Message::Drive(Drive { pan, tilt, zoom, .. }) => {
                // Up is less: Pelco's tilt grows downwards.
                let velocities = [f64::from(pan) / 63.0, -f64::from(tilt) / 63.0, f64::from(zoom)];
                for (axis, velocity) in self.axes.iter_mut().zip(velocities) {
                    *axis = Axis { at: axis.at, target: None, velocity: velocity * SPEED };
                }
            }
            Message::SetPreset(n) => self.presets[usize::from(n)] = Some([self.axes[0].at, self.axes[1].at]),
            Message::ClearPreset(n) => self.presets[usize::from(n)] = None,
            Message::GotoPreset(n) => {
                if let Some(at) = self.presets[usize::from(n)] {
                    self.axes.iter_mut().zip(at).for_each(|(axis, at)| go_to(axis, at));
                }
            }
            Message::Query(quantity) => return self.answer(quantity),
            Message::ZoomSpeed(_) | Message::AutoFocus(_) | Message::Position(..) => return,
        }
        if self.habits.acknowledges {
            self.out.extend([0xFF, self.address, 0, self.address]);
        }
    }

    fn answer(&mut self, quantity: Quantity) {
        if self.habits.mute || (self.habits.no_zoom && quantity == Quantity::Zoom) {
            return;
        }
        if self.habits.garbles {
            self.out.extend([0x7E, 0x31, 0x80, 0xF8, 0x06, 0x66, 0x1E, 0x98]);
            return;
        }
        let value = self.words()[quantity as usize];
        self.out.extend(self.dialect.encode(self.address, &Message::Position(quantity, value)));
    }
}

/// Both ends of a line in memory, and the clock that passes while somebody waits on it.
#[derive(Clone)]
pub struct Line {
    device: Arc<Mutex<Device>>,
    now: Arc<Mutex<f64>>,
}

impl Line {
    pub fn to(device: Device) -> Self {
        Self { device: Arc::new(Mutex::new(device)), now: Arc::default() }
    }

    pub fn device(&self) -> MutexGuard<'_, Device> {
        let mut device = self.device.lock().unwrap();
        device.pass_to(self.now());
        device
    }
}

impl Clock for Line {
    fn now(&self) -> f64 {
        *self.now.lock().unwrap()
    }

    fn sleep(&self, seconds: f64) {
        *self.now.lock().unwrap() += seconds.max(0.0);
    }
}

fn gone(device: &Device) -> Result<()> {
    if device.habits.unplugged { Err(Error::DeviceLost { reason: "unplugged".into() }) } else { Ok(()) }
}

impl Link for Line {
    fn receive(&mut self, buffer: &mut [u8], timeout: f64) -> Result<usize> {
        gone(&self.device())?;
        let count = self.device().give(buffer);
        // A byte's time, or the whole wait.
        self.sleep(if count > 0 { 0.001 } else { timeout });
        Ok(count)
    }

    fn sender(&self) -> Arc<dyn Sender> {
        Arc::new(self.clone())
    }
}

impl Sender for Line {
    fn send(&self, message: &[u8]) -> Result<()> {
        let mut device = self.device();
        gone(&device)?;
        device.take(message);
        Ok(())
    }
}
