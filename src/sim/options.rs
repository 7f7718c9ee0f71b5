//! What a simulated rig is like, and its address `sim:room?key=value&...`.

use crate::device::visca::models::Model;
use crate::error::{Error, Result};
use crate::image::PixelFormat;

/// A simulated rig. [`Default`] is a realistic one in the first station with two fixed cameras.
#[derive(Debug, Clone, PartialEq)]
pub struct SimOptions {
    /// Everything random follows from it.
    pub seed: u64,
    /// Where the rig stands: 1, or 2 for the thesis's second view point (eq. 24).
    pub station: u32,
    /// Fixed cameras that exist: 0, 1 (NEAR) or 2 (NEAR and FAR).
    pub fixed_cameras: usize,
    /// Of every camera's frames.
    pub format: PixelFormat,

    /// Standard deviation of the read noise, grey levels.
    pub read_noise: f64,
    /// Variance of the shot noise per grey level of signal.
    pub shot_noise: f64,
    /// Standard deviation of the point spread (pixel aperture included), px.
    pub point_spread: f64,
    /// Factor on all light.
    pub gain: f64,
    /// Frames per second.
    pub frame_rate: f64,
    /// Exposure time, seconds.
    pub exposure: f64,
    /// From the end of exposure until the frame is delivered, seconds.
    pub latency: f64,

    /// Factor on the laser's light. At 1 it saturates a light surface up to about 4 m.
    pub laser_power: f64,
    /// Share of the spot's light in the halo that the lens spreads around it.
    pub halo: f64,

    /// Encoder step, radians; 0 for a continuous encoder.
    pub step: f64,
    /// Play between motor and head, radians. The head follows exactly when the angles grow, and lags
    /// by the play when they shrink.
    pub backlash: f64,
    /// Radians per second, both axes.
    pub speed: f64,
    /// Amplitude of the swing after a move of 10 degrees or more, radians.
    pub overshoot: f64,
    /// Standard deviation of where the head comes to rest, radians.
    pub repeatability: f64,
    /// Factor on the difference between the true and the nominal rig model; 0 makes them equal.
    pub misalignment: f64,

    /// The head is a VISCA camera of this model and reached through its bytes
    /// ([`super::Simulator::open_ptz`]). Its units are the encoder's steps then, whatever `step` says.
    pub visca: Option<&'static Model>,

    /// 0: virtual time, which passes as fast as the work is done. Else the simulator waits for the
    /// system's clock, and its time runs this many times as fast.
    pub real_time: f64,

    pub faults: Faults,
}

/// What can go wrong, in options and at run time ([`super::Simulator::set_faults`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Faults {
    /// The head is unplugged once it was called this many times (counted from when this was set).
    pub ptz_unplugged_after: Option<u64>,
    /// No camera delivers a frame.
    pub frames_time_out: bool,
    /// Switching the laser on is refused.
    pub laser_refuses: bool,
    /// The head reports Idle as soon as a move was accepted.
    pub ptz_lies: bool,
    /// A person walks through the room.
    pub person: bool,
    /// Auto-exposure drift: relative amplitude of a slow swing of the gain.
    pub exposure_drift: f64,
    /// Share of the laser's light that the glossy faces throw on to make a second spot.
    pub reflection: f64,
}

impl Default for Faults {
    fn default() -> Self {
        Self {
            ptz_unplugged_after: None,
            frames_time_out: false,
            laser_refuses: false,
            ptz_lies: false,
            person: false,
            exposure_drift: 0.0,
            reflection: 0.1,
        }
    }
}

impl Default for SimOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            station: 1,
            fixed_cameras: 2,
            format: PixelFormat::Bgr24,
            read_noise: 2.0,
            shot_noise: 0.02,
            point_spread: 1.0,
            gain: 1.0,
            frame_rate: 25.0,
            exposure: 0.02,
            latency: 0.03,
            laser_power: 1.0,
            halo: 0.2,
            step: 0.07f64.to_radians(),
            backlash: 0.05f64.to_radians(),
            speed: 80f64.to_radians(),
            overshoot: 0.1f64.to_radians(),
            repeatability: 0.005f64.to_radians(),
            misalignment: 1.0,
            visca: None,
            real_time: 0.0,
            faults: Faults::default(),
        }
    }
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const ADDRESS: &str = "sim address";

/// A numeric option: its key, its range in the key's unit, the unit, its field.
struct Number {
    key: &'static str,
    range: [f64; 2],
    unit: f64,
    field: fn(&mut SimOptions) -> &mut f64,
}

const fn number(key: &'static str, range: [f64; 2], unit: f64, field: fn(&mut SimOptions) -> &mut f64) -> Number {
    Number { key, range, unit, field }
}

const NUMBERS: [Number; 18] = [
    number("noise", [0.0, 12.0], 1.0, |o| &mut o.read_noise),
    number("shot", [0.0, 0.3], 1.0, |o| &mut o.shot_noise),
    number("psf", [0.5, 5.0], 1.0, |o| &mut o.point_spread),
    number("gain", [0.1, 3.0], 1.0, |o| &mut o.gain),
    number("fps", [1.0, 200.0], 1.0, |o| &mut o.frame_rate),
    number("exposure", [0.0, 1.0], 1.0, |o| &mut o.exposure),
    number("latency", [0.0, 2.0], 1.0, |o| &mut o.latency),
    number("laser", [0.0, 100.0], 1.0, |o| &mut o.laser_power),
    number("halo", [0.0, 0.9], 1.0, |o| &mut o.halo),
    number("step_deg", [0.0, 5.0], DEGREE, |o| &mut o.step),
    number("backlash_deg", [0.0, 5.0], DEGREE, |o| &mut o.backlash),
    number("speed_deg", [0.1, 1000.0], DEGREE, |o| &mut o.speed),
    number("overshoot_deg", [0.0, 5.0], DEGREE, |o| &mut o.overshoot),
    number("repeatability_deg", [0.0, 5.0], DEGREE, |o| &mut o.repeatability),
    number("real_time", [0.0, 1000.0], 1.0, |o| &mut o.real_time),
    number("misalignment", [-20.0, 20.0], 1.0, |o| &mut o.misalignment),
    number("drift", [0.0, 0.9], 1.0, |o| &mut o.faults.exposure_drift),
    number("reflection", [0.0, 1.0], 1.0, |o| &mut o.faults.reflection),
];

/// A switch: its key and its field; written `1` or `0`.
type Switch = (&'static str, fn(&mut SimOptions) -> &mut bool);

const SWITCHES: [Switch; 4] = [
    ("frames_time_out", |o| &mut o.faults.frames_time_out),
    ("laser_refuses", |o| &mut o.faults.laser_refuses),
    ("ptz_lies", |o| &mut o.faults.ptz_lies),
    ("person", |o| &mut o.faults.person),
];

const FORMATS: [(&str, PixelFormat); 8] = [
    ("gray8", PixelFormat::Gray8),
    ("rgb24", PixelFormat::Rgb24),
    ("bgr24", PixelFormat::Bgr24),
    ("rgba32", PixelFormat::Rgba32),
    ("bgra32", PixelFormat::Bgra32),
    ("yuyv", PixelFormat::Yuyv),
    ("nv12", PixelFormat::Nv12),
    ("i420", PixelFormat::I420),
];

/// Keys that are neither numbers nor switches.
const OTHER_KEYS: [&str; 6] = ["seed", "station", "cameras", "format", "unplug_after", "visca"];

impl SimOptions {
    /// Reads `sim:room` or `sim:room?key=value&...`. Keys not given keep their default; angles are
    /// in degrees (`_deg`), times in seconds, switches 0 or 1.
    ///
    /// # Errors
    /// `InvalidArgument` that names the bad scene, key or value and lists what is known.
    pub fn parse(address: &str) -> Result<Self> {
        let invalid = |reason: String| Error::invalid(ADDRESS, reason);
        let rest =
            address.strip_prefix("sim:").ok_or_else(|| invalid(format!("`{address}` does not begin with `sim:`")))?;
        let (scene, query) = rest.split_once('?').unwrap_or((rest, ""));
        if scene != "room" {
            return Err(invalid(format!("unknown scene `{scene}`; known scenes: room")));
        }
        let mut options = Self::default();
        let mut seen: Vec<&str> = Vec::new();
        for pair in query.split('&').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').ok_or_else(|| invalid(format!("`{pair}` is not key=value")))?;
            if seen.contains(&key) {
                return Err(invalid(format!("key `{key}` is given twice")));
            }
            seen.push(key);
            options.set(key, value).map_err(invalid)?;
        }
        Ok(options)
    }

    fn set(&mut self, key: &str, value: &str) -> std::result::Result<(), String> {
        let wants = |what: &str| format!("{key}={value}: {key} wants {what}");
        if let Some(n) = NUMBERS.iter().find(|n| n.key == key) {
            let [low, high] = n.range;
            let parsed = value.parse().ok().filter(|v: &f64| (low..=high).contains(v));
            *(n.field)(self) = n.unit * parsed.ok_or_else(|| wants(&format!("a number from {low} to {high}")))?;
            return Ok(());
        }
        if let Some((_, field)) = SWITCHES.iter().find(|(name, _)| *name == key) {
            *field(self) = match value {
                "0" => false,
                "1" => true,
                _ => return Err(wants("0 or 1")),
            };
            return Ok(());
        }
        match key {
            "seed" => self.seed = value.parse().map_err(|_| wants("a whole number"))?,
            "station" => {
                self.station = value.parse().ok().filter(|s| (1..=2).contains(s)).ok_or_else(|| wants("1 or 2"))?;
            }
            "cameras" => {
                self.fixed_cameras = value.parse().ok().filter(|n| *n <= 2).ok_or_else(|| wants("0, 1 or 2"))?;
            }
            "format" => {
                let names = || FORMATS.map(|(name, _)| name).join(", ");
                let known = FORMATS.iter().find(|(name, _)| *name == value);
                self.format = known.ok_or_else(|| wants(&format!("one of {}", names())))?.1;
            }
            "visca" => {
                let names = || Model::ALL.map(|model| model.name).join(", ");
                self.visca = Some(Model::named(value).ok_or_else(|| wants(&format!("one of {}", names())))?);
            }
            "unplug_after" => {
                let calls = value.parse().map_err(|_| wants("a whole number of calls"))?;
                self.faults.ptz_unplugged_after = Some(calls);
            }
            _ => return Err(format!("unknown key `{key}`; known keys: {}", Self::known_keys().join(", "))),
        }
        Ok(())
    }

    /// Every key of an address.
    pub fn known_keys() -> Vec<&'static str> {
        let numbers = NUMBERS.iter().map(|n| n.key);
        let switches = SWITCHES.iter().map(|(name, _)| *name);
        OTHER_KEYS.into_iter().chain(numbers).chain(switches).collect()
    }

    /// Checks options that were not parsed.
    ///
    /// # Errors
    /// `InvalidArgument` that names the option.
    pub fn validate(&self) -> Result<()> {
        let mut copy = self.clone();
        for n in &NUMBERS {
            let (value, [low, high]) = (*(n.field)(&mut copy) / n.unit, n.range);
            // Converting a degree to radians and back may move a limit by a rounding error.
            let slack = 1e-9 * high;
            if !(value >= low - slack && value <= high + slack) {
                return Err(Error::invalid(n.key, format!("{value} is not from {low} to {high}")));
            }
        }
        if !(1..=2).contains(&self.station) {
            return Err(Error::invalid("station", format!("{} is neither 1 nor 2", self.station)));
        }
        if self.fixed_cameras > 2 {
            return Err(Error::invalid("cameras", format!("{} fixed cameras, there are 2", self.fixed_cameras)));
        }
        if self.exposure > 1.0 / self.frame_rate {
            return Err(Error::invalid(
                "exposure",
                format!("{} s is longer than a frame at {} per second", self.exposure, self.frame_rate),
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reason(address: &str) -> String {
        SimOptions::parse(address).unwrap_err().to_string()
    }

    #[test]
    fn an_address_sets_what_it_names_and_nothing_else() {
        assert_eq!(SimOptions::parse("sim:room").unwrap(), SimOptions::default());
        assert_eq!(SimOptions::parse("sim:room?").unwrap(), SimOptions::default());
        let o =
            SimOptions::parse("sim:room?seed=3&station=2&noise=2.5&step_deg=0.1&person=1&format=nv12&unplug_after=9")
                .unwrap();
        let wanted = SimOptions {
            seed: 3,
            station: 2,
            read_noise: 2.5,
            step: 0.1 * DEGREE,
            format: PixelFormat::Nv12,
            faults: Faults { person: true, ptz_unplugged_after: Some(9), ..Faults::default() },
            ..SimOptions::default()
        };
        assert_eq!(o, wanted);
    }

    #[test]
    fn errors_name_what_is_wrong_and_what_is_known() {
        assert!(reason("visca:///dev/x").contains("`visca:///dev/x`"));
        assert!(reason("sim:garden").contains("`garden`") && reason("sim:garden").contains("room"));
        assert!(reason("sim:room?sead=3").contains("`sead`") && reason("sim:room?sead=3").contains("seed, station"));
        assert!(
            reason("sim:room?noise=loud").contains("noise=loud") && reason("sim:room?noise=loud").contains("0 to 12")
        );
        assert!(reason("sim:room?noise=-1").contains("noise=-1"));
        assert!(reason("sim:room?noise=NaN").contains("noise=NaN"));
        assert!(reason("sim:room?station=3").contains("1 or 2"));
        assert!(reason("sim:room?cameras=3").contains("0, 1 or 2"));
        assert!(reason("sim:room?person=yes").contains("0 or 1"));
        assert!(reason("sim:room?format=jpeg").contains("bgr24"));
        assert!(reason("sim:room?visca=vcr").contains("evi-d100"));
        assert!(reason("sim:room?seed").contains("`seed`"));
        assert!(reason("sim:room?seed=1&seed=2").contains("twice"));
        assert!(reason("sim:room?seed=-1").contains("whole number"));
    }

    #[test]
    fn every_known_key_is_accepted() {
        for key in SimOptions::known_keys() {
            let least = NUMBERS.iter().find(|n| n.key == key).map(|n| n.range[0].to_string());
            let value = least.unwrap_or_else(|| {
                let word = match key {
                    "format" => "rgb24",
                    "visca" => "evi-d100",
                    _ => "1",
                };
                word.into()
            });
            SimOptions::parse(&format!("sim:room?{key}={value}")).unwrap();
        }
    }

    #[test]
    fn options_made_by_hand_are_checked() {
        assert!(SimOptions::default().validate().is_ok());
        let limits = SimOptions::parse("sim:room?step_deg=5&backlash_deg=5&speed_deg=0.1").unwrap();
        assert!(limits.validate().is_ok());
        let bad = [
            SimOptions { read_noise: f64::NAN, ..SimOptions::default() },
            SimOptions { speed: 0.0, ..SimOptions::default() },
            SimOptions { station: 0, ..SimOptions::default() },
            SimOptions { fixed_cameras: 3, ..SimOptions::default() },
            SimOptions { exposure: 0.05, ..SimOptions::default() },
        ];
        for options in bad {
            assert!(matches!(options.validate(), Err(Error::InvalidArgument { .. })), "{options:?}");
        }
    }
}
