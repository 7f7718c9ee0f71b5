//! What was found out, as numbers and as text.

use std::fmt;

use crate::device::{Identity, PtzCapabilities};

/// A figure and its standard deviation, from `count` measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    pub value: f64,
    pub sigma: f64,
    pub count: u32,
}

/// A figure, or why there is none.
pub type Figure = Result<Measured, String>;

/// What a device is and does. Angles are radians, or the device's numbers where
/// [`raw_units`](PtzCapabilities::raw_units); arrays of two are pan and tilt; times are seconds.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeReport {
    pub identity: Identity,
    pub capabilities: PtzCapabilities,
    /// Lowest and highest pan, lowest and highest tilt that were reached, as read.
    pub limits: [Figure; 4],
    /// Greatest speed of moves, from readings and their times.
    pub speed: [Figure; 2],
    /// From a move's command to the first reading that differs.
    pub start_latency: Figure,
    /// How long a call for the position takes.
    pub position_time: Figure,
    /// Do readings follow the head? Else they repeat the command.
    pub position_follows: Result<bool, String>,
    /// Greatest distance of a settled reading from its target.
    pub position_error: [Figure; 2],
    /// Standard deviation of settled readings on returns from the same side.
    pub reading_repeatability: [Figure; 2],
    /// The same of the picture, px and radians.
    pub picture_repeatability_px: [Figure; 2],
    pub picture_repeatability: [Figure; 2],
    /// How far the picture is apart when a place is reached from above and from below, px and radians:
    /// positive when the head lags behind.
    pub backlash_px: [Figure; 2],
    pub backlash: [Figure; 2],
    /// Smallest commanded move that the readings show.
    pub smallest_move: [Figure; 2],
    /// How far and how long the head moves on after STOP, by its readings.
    pub stop_distance: Figure,
    pub stop_time: Figure,
    /// How long the picture moves on after the device reports arrival.
    pub moves_after_arrival: Figure,
    /// Does the head stand (but for its swing) when the device says so?
    pub arrival_honest: Result<bool, String>,
    pub frame_interval: Figure,
    /// From the start of a frame's exposure to its delivery.
    pub frame_age: Figure,
    /// From a move's command to the delivery of the first frame that shows it, seconds and frames.
    pub visible_after: Figure,
    pub visible_after_frames: Figure,
    /// The same from switching the laser.
    pub laser_visible_after: Figure,
    pub laser_visible_after_frames: Figure,
    /// What it took, seconds.
    pub duration: f64,
}

impl ProbeReport {
    pub(super) fn new(identity: Identity, capabilities: PtzCapabilities) -> Self {
        let none = || -> Figure { Err("not measured".into()) };
        let two = || [none(), none()];
        Self {
            identity,
            capabilities,
            limits: [none(), none(), none(), none()],
            speed: two(),
            start_latency: none(),
            position_time: none(),
            position_follows: Err("not measured".into()),
            position_error: two(),
            reading_repeatability: two(),
            picture_repeatability_px: two(),
            picture_repeatability: two(),
            backlash_px: two(),
            backlash: two(),
            smallest_move: two(),
            stop_distance: none(),
            stop_time: none(),
            moves_after_arrival: none(),
            arrival_honest: Err("not measured".into()),
            frame_interval: none(),
            frame_age: none(),
            visible_after: none(),
            visible_after_frames: none(),
            laser_visible_after: none(),
            laser_visible_after_frames: none(),
            duration: 0.0,
        }
    }
}

/// How a quantity is written.
#[derive(Clone, Copy)]
enum Unit {
    /// Degrees, or the device's numbers.
    Angle,
    Speed,
    Pixels,
    Milliseconds,
    Frames,
}

struct Text<'a> {
    figure: &'a Figure,
    unit: Unit,
    raw: bool,
}

impl fmt::Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let m = match self.figure {
            Ok(m) => m,
            Err(reason) => return write!(f, "- ({reason})"),
        };
        let (scale, unit) = match self.unit {
            Unit::Angle if self.raw => (1.0, ""),
            Unit::Speed if self.raw => (1.0, " / s"),
            Unit::Angle => (1f64.to_degrees(), " deg"),
            Unit::Speed => (1f64.to_degrees(), " deg/s"),
            Unit::Pixels => (1.0, " px"),
            Unit::Milliseconds => (1e3, " ms"),
            Unit::Frames => (1.0, " frames"),
        };
        let (value, sigma) = (m.value * scale, m.sigma * scale);
        // One digit of the standard deviation.
        let digits = if sigma > 0.0 { (1.0 - sigma.log10()).floor().clamp(0.0, 6.0) as usize } else { 4 };
        write!(f, "{value:.digits$} +- {sigma:.digits$}{unit}")
    }
}

impl fmt::Display for ProbeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (i, c) = (&self.identity, &self.capabilities);
        let or = |s: &str| if s.is_empty() { "unknown".to_owned() } else { s.to_owned() };
        writeln!(
            f,
            "Device           {} {}, firmware {}, protocol {}",
            or(&i.vendor),
            or(&i.model),
            or(&i.firmware),
            or(&i.protocol)
        )?;
        let raw = c.raw_units;
        let angle = |v: f64| if raw { v } else { v.to_degrees() };
        let unit = if raw { " (numbers without known angles)" } else { " deg" };
        let range = |[low, high]: [f64; 2]| format!("{:.3} to {:.3}", angle(low), angle(high));
        writeln!(f, "Range as reported pan {}, tilt {}{unit}", range(c.pan_range), range(c.tilt_range))?;
        let flags = [
            ("zoom", c.has_zoom),
            ("drive", c.has_drive),
            ("relative moves", c.has_relative),
            ("moves within the picture", c.has_view_moves),
            ("home", c.has_home),
            ("focus", c.has_focus),
            ("exposure lock", c.has_exposure_lock),
            ("motion state", c.reports_motion),
            ("position", c.reports_position),
        ];
        let has: Vec<&str> = flags.iter().filter(|(_, has)| *has).map(|(name, _)| *name).collect();
        writeln!(f, "Says it has       {}; {} presets", has.join(", "), c.presets)?;
        let text = |figure, unit| Text { figure, unit, raw };
        for (name, figure) in ["lowest pan", "highest pan", "lowest tilt", "highest tilt"].iter().zip(&self.limits) {
            writeln!(f, "Reached: {name:<13} {}", text(figure, Unit::Angle))?;
        }
        for (name, figures, unit) in [
            ("Speed", &self.speed, Unit::Speed),
            ("Reading off its target", &self.position_error, Unit::Angle),
            ("Repeats, readings", &self.reading_repeatability, Unit::Angle),
            ("Repeats, picture", &self.picture_repeatability_px, Unit::Pixels),
            ("Repeats, picture", &self.picture_repeatability, Unit::Angle),
            ("Backlash, picture", &self.backlash_px, Unit::Pixels),
            ("Backlash, picture", &self.backlash, Unit::Angle),
            ("Smallest move", &self.smallest_move, Unit::Angle),
        ] {
            writeln!(f, "{name:<23} pan {}, tilt {}", text(&figures[0], unit), text(&figures[1], unit))?;
        }
        for (name, figure, unit) in [
            ("Starts to move after", &self.start_latency, Unit::Milliseconds),
            ("Position call takes", &self.position_time, Unit::Milliseconds),
            ("STOP: moves on by", &self.stop_distance, Unit::Angle),
            ("STOP: moves on for", &self.stop_time, Unit::Milliseconds),
            ("Picture moves on after the reported arrival for", &self.moves_after_arrival, Unit::Milliseconds),
            ("Time between frames", &self.frame_interval, Unit::Milliseconds),
            ("Age of a frame", &self.frame_age, Unit::Milliseconds),
            ("A move is seen after", &self.visible_after, Unit::Milliseconds),
            ("A move is seen after", &self.visible_after_frames, Unit::Frames),
            ("The laser is seen after", &self.laser_visible_after, Unit::Milliseconds),
            ("The laser is seen after", &self.laser_visible_after_frames, Unit::Frames),
        ] {
            writeln!(f, "{name:<23} {}", text(figure, unit))?;
        }
        let honest = |answer: &Result<bool, String>, yes: &str, no: &str| match answer {
            Ok(true) => yes.to_owned(),
            Ok(false) => no.to_owned(),
            Err(reason) => format!("- ({reason})"),
        };
        writeln!(
            f,
            "Position               {}",
            honest(&self.position_follows, "follows the head", "repeats the command: it says nothing of the head")
        )?;
        writeln!(
            f,
            "Reported arrival       {}",
            honest(&self.arrival_honest, "true", "NOT TRUE: the head moves on; go by frames")
        )?;
        write!(f, "Took                   {:.0} s", self.duration)
    }
}
