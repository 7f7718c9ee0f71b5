//! The head behind an ONVIF PTZ service.

use std::sync::Arc;

use super::OnvifOptions;
use super::client::{Client, Keys, bounded};
use super::focus::Lens;
use super::http::{Host, Place};
use super::services::{
    DEVICE, MoveStatus, Node, PTZ, Profile, Services, Space, Status, drive_timeouts, presets, request,
};
use super::time::{device_time, duration};
use super::watch::MotionWatch;
use super::xml::{Element, escaped};
use crate::control::{Clock, Log, LogLevel};
use crate::device::{
    Brake, Credentials, Focus, Identity, Motion, PanTiltZoom, PtzCapabilities, PtzPosition, PtzVelocity, turned_into,
};
use crate::error::{Error, Result};

/// Of a whole stop, seconds.
const STOP_TIMEOUT: f64 = 2.0;
/// More presets than this are of no use here.
const MAX_PRESETS: u32 = 256;
/// The device may round what it is sent to: such a share of a range beyond it is still in reach.
const SLACK: f64 = 1e-9;

/// In what pan and tilt are spoken of.
#[derive(Debug, Clone, PartialEq)]
enum Units {
    Degrees(Space),
    /// Numbers of the device's own, without a known angle.
    Raw(Space),
}

impl Units {
    fn space(&self) -> &Space {
        match self {
            Self::Degrees(space) | Self::Raw(space) => space,
        }
    }

    /// Device units in one of ours.
    fn scale(&self) -> f64 {
        match self {
            Self::Degrees(_) => 180.0 / std::f64::consts::PI,
            Self::Raw(_) => 1.0,
        }
    }
}

/// An opened camera: its services, and the way there.
pub(super) struct Camera {
    pub client: Client,
    pub device: Place,
    pub services: Services,
}

impl Camera {
    pub fn open(
        host: Host,
        path: &str,
        options: &OnvifOptions,
        credentials: Option<Credentials>,
        clock: &Arc<dyn Clock>,
    ) -> Result<Self> {
        let device = Place { port: host.port, path: path.to_owned() };
        let keys = Arc::new(Keys::new(credentials, clock.clone()));
        let client = Client::new(host, options.timeout, keys);
        let action = "GetSystemDateAndTime";
        match client.ask(&device, action, &request(DEVICE, action, "")) {
            Ok(Some(response)) => {
                if let Some(time) = device_time(&response) {
                    client.keys().set_device_time(time);
                }
            }
            // Some keep even this behind their lock: a token then tells the host's time.
            Ok(None) | Err(Error::DeviceRefused { .. }) => {}
            Err(error) => return Err(error),
        }
        let services = Services::get(&client, &device)?;
        Ok(Self { client, device, services })
    }
}

pub struct OnvifHead {
    client: Client,
    device: Place,
    ptz: Place,
    profile: String,
    node: Node,
    units: Units,
    lens: Option<Lens>,
    full_speed: [f64; 2],
    drive_timeouts: Option<[f64; 2]>,
    reports_position: bool,
    /// Where a device that does not tell its position was sent; unknown before that and after a drive.
    sent: Option<[f64; 2]>,
    sent_zoom: f64,
    watch: MotionWatch,
    brake: Arc<OnvifBrake>,
    clock: Arc<dyn Clock>,
    log: Log,
}

/// Stops on a connection of its own.
struct OnvifBrake {
    client: Client,
    ptz: Place,
    request: String,
}

impl Brake for OnvifBrake {
    fn stop(&self) -> Result<()> {
        self.client.call(&self.ptz, "Stop", &self.request).map(drop)
    }
}

impl OnvifHead {
    pub(super) fn open(camera: Camera, options: &OnvifOptions, clock: Arc<dyn Clock>, log: Log) -> Result<Self> {
        let Camera { client, device, services } = camera;
        let ptz = services.ptz.clone().ok_or_else(|| client.mismatch("it has no PTZ service"))?;
        let profiles = Profile::list(&client, &services)?;
        let profile = Profile::choose(profiles, options.profile.as_deref(), |p| p.ptz.is_some());
        let profile = profile.map_err(|reason| client.mismatch(reason))?;
        let [node, configuration] =
            profile.ptz.clone().ok_or_else(|| client.mismatch(format!("profile {:?} has no PTZ", profile.token)))?;
        let node = Node::get(&client, &ptz, &node)?;
        let status = match Status::get(&client, &ptz, &profile.token) {
            Err(error @ (Error::DeviceRefused { .. } | Error::DeviceMismatch { .. })) => {
                log.write(LogLevel::Warning, || format!("the camera does not tell its position: {error}"));
                Status::default()
            }
            status => status?,
        };
        let units = units(&node, &status).ok_or_else(|| client.mismatch("it has no absolute pan and tilt"))?;
        let reports_position = status.pan_tilt.is_some() && speaks(&status, &units);
        let drive_timeouts = optional(drive_timeouts(&client, &ptz, &configuration))?.flatten();
        let lens = Lens::find(&client, services.imaging.as_ref(), profile.video_source.as_deref())?;
        let stop = format!("{}<q:PanTilt>true</q:PanTilt><q:Zoom>true</q:Zoom>", profile_token(&profile.token));
        let brake = OnvifBrake {
            client: client.another(STOP_TIMEOUT.min(options.timeout)),
            ptz: ptz.clone(),
            request: request(PTZ, "Stop", &stop),
        };
        Ok(Self {
            client,
            device,
            ptz,
            profile: profile.token,
            units,
            lens,
            full_speed: options.full_speed,
            drive_timeouts,
            reports_position,
            sent: None,
            sent_zoom: 0.0,
            watch: MotionWatch::new(status.motion.is_some()),
            node,
            brake: Arc::new(brake),
            clock,
            log,
        })
    }

    fn call(&self, action: &str, inner: &str) -> Result<Element> {
        let inner = format!("{}{inner}", profile_token(&self.profile));
        self.client.call(&self.ptz, action, &request(PTZ, action, &inner))
    }

    fn status(&mut self) -> Result<Status> {
        let status = Status::get(&self.client, &self.ptz, &self.profile)?;
        let [pan, tilt] = status.pan_tilt.unwrap_or_default();
        let at = status.pan_tilt.map(|_| [pan, tilt, status.zoom.unwrap_or_default()]);
        if let Some(doubt) = self.watch.observe(status.motion, at, self.clock.now()) {
            self.log.write(LogLevel::Warning, || doubt.to_owned());
        }
        Ok(status)
    }

    /// Least and greatest pan and tilt in our units.
    fn ranges(&self) -> [[f64; 2]; 2] {
        let (space, scale) = (self.units.space(), self.units.scale());
        [space.x, space.y].map(|range| range.map(|limit| limit / scale))
    }

    fn check(&self, name: &'static str, value: f64, [low, high]: [f64; 2]) -> Result<()> {
        if !value.is_finite() {
            return Err(Error::NotFinite { name, index: 0 });
        }
        let slack = SLACK * (high - low);
        if value < low - slack || value > high + slack {
            return Err(Error::Unreachable { reason: format!("{name} {value:.4} is not in {low:.4} to {high:.4}") });
        }
        Ok(())
    }

    fn zoom_range(&self) -> [f64; 2] {
        self.node.zoom.as_ref().map_or([0.0, 1.0], |space| space.x)
    }

    fn share_of_zoom(&self, zoom: Option<f64>) -> f64 {
        let [low, high] = self.zoom_range();
        zoom.map_or(self.sent_zoom, |zoom| ((zoom - low) / (high - low)).clamp(0.0, 1.0))
    }

    /// Velocity of pan and tilt in the camera's best space for it.
    fn pan_tilt_velocity(&self, velocity: PtzVelocity) -> Option<String> {
        let (space, values) = match (&self.units, &self.node.velocity_degrees, &self.node.velocity) {
            (Units::Degrees(_), Some(space), _) | (_, Some(space), None) => {
                (space, [velocity.pan, velocity.tilt].map(f64::to_degrees))
            }
            (_, _, Some(space)) => {
                let [pan, tilt] = self.full_speed;
                (space, [share(velocity.pan, pan, space.x), share(velocity.tilt, tilt, space.y)])
            }
            _ => return None,
        };
        let [pan, tilt] = [values[0].clamp(space.x[0], space.x[1]), values[1].clamp(space.y[0], space.y[1])];
        Some(pan_tilt(pan, tilt, &space.uri))
    }

    /// The camera's token for one of our numbers: the preset of that name, or else of that token.
    fn preset(&self, number: u32) -> Result<Option<String>> {
        let most = self.capabilities().presets;
        if number >= most {
            return Err(Error::invalid("preset", format!("{number}: the camera has {most}, counted from 0")));
        }
        let all = presets(&self.client, &self.ptz, &self.profile)?;
        let (name, token) = (preset_name(number), number.to_string());
        let named = all.iter().find(|p| p.name == name);
        Ok(named.or_else(|| all.iter().find(|p| p.token == token)).map(|p| p.token.clone()))
    }

    fn need_preset(&self, number: u32) -> Result<String> {
        let found = self.preset(number)?;
        let token =
            found.ok_or_else(|| Error::DeviceRefused { reason: format!("preset {number} was never stored") })?;
        Ok(format!("<q:PresetToken>{}</q:PresetToken>", escaped(&token)))
    }
}

/// Degrees where moves and readings both know them, else the device's own numbers.
fn units(node: &Node, status: &Status) -> Option<Units> {
    let in_degrees = node.degrees.clone().map(Units::Degrees);
    let raw = node.generic.clone().map(Units::Raw);
    match in_degrees {
        Some(degrees) if raw.is_none() || speaks(status, &degrees) => Some(degrees),
        _ => raw,
    }
}

/// Is the status in these units? One that names no space is in the generic one, by the standard.
fn speaks(status: &Status, units: &Units) -> bool {
    let last = |uri: &str| uri.rsplit('/').next().unwrap_or_default().to_owned();
    let degrees = status.space.as_deref().is_some_and(|s| last(s).starts_with("SphericalPositionSpaceDegrees"));
    degrees == matches!(units, Units::Degrees(_))
}

/// What a camera need not have.
fn optional<T>(result: Result<T>) -> Result<Option<T>> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Error::DeviceRefused { .. } | Error::DeviceMismatch { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

fn profile_token(token: &str) -> String {
    format!("<q:ProfileToken>{}</q:ProfileToken>", escaped(token))
}

fn preset_name(number: u32) -> String {
    format!("ptzcal-{number}")
}

/// A value as a share of the full one, in a space of this range.
fn share(value: f64, full: f64, [low, high]: [f64; 2]) -> f64 {
    let share = (value / if full > 0.0 { full } else { 1.0 }).clamp(-1.0, 1.0);
    share * if share < 0.0 { -low } else { high }
}

fn pan_tilt(x: f64, y: f64, space: &str) -> String {
    format!("<tt:PanTilt x=\"{x:.6}\" y=\"{y:.6}\" space=\"{}\"/>", escaped(space))
}

fn zoom_to(x: f64, space: &Space) -> String {
    format!("<tt:Zoom x=\"{x:.6}\" space=\"{}\"/>", escaped(&space.uri))
}

impl PanTiltZoom for OnvifHead {
    fn capabilities(&self) -> PtzCapabilities {
        let [pan_range, tilt_range] = self.ranges();
        let known = |space: &Option<Space>| space.is_some();
        let fastest = match (&self.units, &self.node.velocity_degrees) {
            (Units::Degrees(_), Some(space)) => [space.x[1], space.y[1]].map(f64::to_radians),
            _ => self.full_speed,
        };
        PtzCapabilities {
            pan_range,
            tilt_range,
            max_speed: fastest,
            raw_units: matches!(self.units, Units::Raw(_)),
            reports_motion: self.watch.trusted(),
            reports_position: self.reports_position,
            has_zoom: known(&self.node.zoom),
            has_drive: known(&self.node.velocity) || known(&self.node.velocity_degrees),
            has_relative: true,
            has_view_moves: known(&self.node.relative_view),
            has_home: self.node.home,
            has_focus: self.lens.is_some(),
            presets: self.node.presets.min(MAX_PRESETS),
            ..PtzCapabilities::default()
        }
    }

    fn identity(&mut self) -> Result<Identity> {
        let action = "GetDeviceInformation";
        let response = self.client.call(&self.device, action, &request(DEVICE, action, ""))?;
        let text = |name| bounded(response.text_at(&[name]).unwrap_or_default());
        let (vendor, model, firmware) = (text("Manufacturer"), text("Model"), text("FirmwareVersion"));
        Ok(Identity { protocol: "ONVIF".into(), vendor, model, firmware })
    }

    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        let [pan_range, tilt_range] = self.ranges();
        self.check("pan", pan, pan_range)?;
        self.check("tilt", tilt, tilt_range)?;
        let (space, scale) = (self.units.space(), self.units.scale());
        let x = (pan * scale).clamp(space.x[0], space.x[1]);
        let y = (tilt * scale).clamp(space.y[0], space.y[1]);
        let position = format!("<q:Position>{}</q:Position>", pan_tilt(x, y, &space.uri));
        self.sent = None;
        self.watch.restart();
        self.call("AbsoluteMove", &position)?;
        self.sent = Some([pan, tilt]);
        Ok(())
    }

    fn move_relative(&mut self, pan: f64, tilt: f64) -> Result<()> {
        match (&self.units, &self.node.relative_degrees) {
            (Units::Degrees(_), Some(space)) if pan.is_finite() && tilt.is_finite() => {
                let by = pan_tilt(pan.to_degrees(), tilt.to_degrees(), &space.uri);
                let by = format!("<q:Translation>{by}</q:Translation>");
                self.sent = self.sent.map(|[p, t]| [p + pan, t + tilt]);
                self.watch.restart();
                self.call("RelativeMove", &by).map(drop)
            }
            // The generic translation space has no unit that could be told.
            _ => {
                let from = self.position()?;
                self.move_absolute(from.pan + pan, from.tilt + tilt)
            }
        }
    }

    fn move_in_view(&mut self, x: f64, y: f64) -> Result<()> {
        let Some(space) = &self.node.relative_view else {
            return Err(Error::Unsupported { what: "moves within the picture by this camera".into() });
        };
        // The space ends at the picture's edges, which some cameras call 1 and others 100.
        let by = pan_tilt(share(x, 1.0, space.x), share(y, 1.0, space.y), &space.uri);
        let by = format!("<q:Translation>{by}</q:Translation>");
        self.sent = None;
        self.watch.restart();
        self.call("RelativeMove", &by).map(drop)
    }

    /// # Errors
    /// `BadState` from a camera that does not tell its position and was not sent to an absolute one
    /// since it was opened, driven or sent to a preset.
    fn position(&mut self) -> Result<PtzPosition> {
        if !self.reports_position {
            let [pan, tilt] = self.sent.ok_or_else(|| Error::BadState {
                reason: "the camera does not tell its position: send it somewhere first".into(),
            })?;
            return Ok(PtzPosition { pan, tilt, zoom: self.sent_zoom });
        }
        let status = self.status()?;
        let Some(at) = status.pan_tilt.filter(|_| speaks(&status, &self.units)) else {
            return Err(self.client.mismatch("its status no longer tells the position as it did"));
        };
        let [pan_range, tilt_range] = self.ranges();
        let mut pan = at[0] / self.units.scale();
        if let Units::Degrees(_) = self.units {
            pan = turned_into(pan_range, pan);
        }
        let tilt = at[1] / self.units.scale();
        let far = |value: f64, [low, high]: [f64; 2]| !(low - (high - low)..=high + (high - low)).contains(&value);
        if far(pan, pan_range) || far(tilt, tilt_range) {
            return Err(self.client.mismatch(format!("it says to be at {at:?}, far outside its range")));
        }
        Ok(PtzPosition { pan, tilt, zoom: self.share_of_zoom(status.zoom) })
    }

    fn motion(&mut self) -> Result<Motion> {
        if !self.watch.trusted() {
            return Ok(Motion::Unknown);
        }
        let status = self.status()?;
        Ok(match status.motion {
            Some(MoveStatus::Moving) if self.watch.trusted() => Motion::Moving,
            // Idle counts only from a camera that was once seen to say otherwise.
            Some(MoveStatus::Idle) if self.watch.trusted() && self.watch.proven() => Motion::Idle,
            _ => Motion::Unknown,
        })
    }

    fn stop(&mut self) -> Result<()> {
        self.sent = None;
        self.brake.stop()
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        Some(self.brake.clone())
    }

    fn drive(&mut self, velocity: PtzVelocity, timeout: f64) -> Result<()> {
        let given = [velocity.pan, velocity.tilt, velocity.zoom];
        if let Some(index) = given.iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "velocity", index });
        }
        if given == [0.0; 3] {
            return self.stop();
        }
        let pan_tilt = self.pan_tilt_velocity(velocity).unwrap_or_default();
        let zoom = self.node.zoom_velocity.as_ref().map_or(String::new(), |space| {
            let [low, high] = space.x;
            let zoom = velocity.zoom.clamp(-1.0, 1.0);
            zoom_to(zoom * if zoom < 0.0 { -low } else { high }, space)
        });
        if pan_tilt.is_empty() && zoom.is_empty() {
            return Err(Error::Unsupported { what: "continuous drive by this camera".into() });
        }
        let mut inner = format!("<q:Velocity>{pan_tilt}{zoom}</q:Velocity>");
        if timeout.is_finite() {
            let [low, high] = self.drive_timeouts.unwrap_or([0.0, f64::INFINITY]);
            inner += &format!("<q:Timeout>{}</q:Timeout>", duration(timeout.clamp(low, high)));
        }
        self.sent = None;
        self.watch.restart();
        self.call("ContinuousMove", &inner).map(drop)
    }

    fn home(&mut self) -> Result<()> {
        if !self.node.home {
            return Err(Error::Unsupported { what: "home by this camera".into() });
        }
        self.sent = None;
        self.watch.restart();
        self.call("GotoHomePosition", "").map(drop)
    }

    fn set_zoom(&mut self, zoom: f64) -> Result<()> {
        let Some(space) = &self.node.zoom else {
            return Err(Error::Unsupported { what: "zoom by this camera".into() });
        };
        if !(0.0..=1.0).contains(&zoom) {
            return Err(Error::invalid("zoom", format!("{zoom} is not in [0, 1]")));
        }
        let [low, high] = space.x;
        let position = format!("<q:Position>{}</q:Position>", zoom_to(low + zoom * (high - low), space));
        self.watch.restart();
        self.call("AbsoluteMove", &position)?;
        self.sent_zoom = zoom;
        Ok(())
    }

    fn set_focus(&mut self, focus: Focus) -> Result<()> {
        match &self.lens {
            Some(lens) => lens.set(&self.client, focus),
            None => Err(Error::Unsupported { what: "focus by this camera".into() }),
        }
    }

    fn focus(&mut self) -> Result<f64> {
        match &self.lens {
            Some(lens) => lens.position(&self.client),
            None => Err(Error::Unsupported { what: "focus by this camera".into() }),
        }
    }

    fn store_preset(&mut self, preset: u32) -> Result<()> {
        let token = self.preset(preset)?;
        let token = token.map(|t| format!("<q:PresetToken>{}</q:PresetToken>", escaped(&t))).unwrap_or_default();
        let name = preset_name(preset);
        self.call("SetPreset", &format!("<q:PresetName>{name}</q:PresetName>{token}")).map(drop)
    }

    fn recall_preset(&mut self, preset: u32) -> Result<()> {
        let token = self.need_preset(preset)?;
        self.sent = None;
        self.watch.restart();
        self.call("GotoPreset", &token).map(drop)
    }

    fn clear_preset(&mut self, preset: u32) -> Result<()> {
        let token = self.need_preset(preset)?;
        self.call("RemovePreset", &token).map(drop)
    }
}
