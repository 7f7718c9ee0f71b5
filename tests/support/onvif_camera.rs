//! A camera on this machine that speaks ONVIF as the standard has it, in real time, and says what
//! it was asked.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use md5::{Digest, Md5};
use sha1::Sha1;
use sha2::Sha256;

pub const USER: &str = "operator";
pub const PASSWORD: &str = "s3cret & <odd>";

/// How the camera wants its user proven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lock {
    Open,
    /// HTTP Digest with MD5 or SHA-256; each nonce serves so many requests.
    Digest {
        sha256: bool,
        uses: u32,
    },
    /// A fault until there is a WS-UsernameToken, as old cameras have it.
    Token,
    /// HTTP Basic for everything.
    Basic,
}

#[derive(Debug, Clone)]
pub struct Habits {
    pub lock: Lock,
    /// Has the space of degrees, and tells its position in it.
    pub degrees: bool,
    /// Answers GetServices; otherwise only GetCapabilities.
    pub services: bool,
    /// Only the second media service.
    pub media2: bool,
    /// What MoveStatus says: the truth, or always the same, or nothing.
    pub move_status: Option<&'static str>,
    pub tells_motion: bool,
    pub tells_position: bool,
    /// Accepts moves and stays where it is.
    pub lame: bool,
    /// Host and port that it gives for its services, as behind a gateway.
    pub calls_itself: Option<&'static str>,
    /// Seconds that its clock is ahead of the host's.
    pub skew: f64,
    /// Answers to these actions are late by so many seconds.
    pub slow: Option<(&'static str, f64)>,
    /// Instead of the answer to an action: this body.
    pub instead: BTreeMap<&'static str, String>,
    /// Closes each connection after its answer, without saying so before.
    pub closes: bool,
}

impl Default for Habits {
    fn default() -> Self {
        Self {
            lock: Lock::Digest { sha256: false, uses: u32::MAX },
            degrees: true,
            services: true,
            media2: false,
            move_status: None,
            tells_motion: true,
            tells_position: true,
            lame: false,
            calls_itself: None,
            skew: 0.0,
            slow: None,
            instead: BTreeMap::new(),
            closes: false,
        }
    }
}

/// Motion of pan, tilt and zoom in the camera's units (shares of its ranges, -1 to 1).
#[derive(Debug, Clone, Copy)]
struct Axes {
    at: [f64; 3],
    target: [Option<f64>; 3],
    velocity: [f64; 3],
    since: Instant,
    /// A drive ends by itself.
    until: Option<Instant>,
}

/// Shares of the range per second.
const SPEED: f64 = 2.0;
/// Half the range of pan and tilt in degrees.
pub const HALF: [f64; 2] = [180.0, 90.0];

impl Axes {
    fn pass(&mut self) {
        let now = Instant::now();
        if let Some(until) = self.until.filter(|u| *u <= now) {
            self.advance(until.saturating_duration_since(self.since).as_secs_f64());
            (self.velocity, self.until) = ([0.0; 3], None);
            self.since = until;
        }
        self.advance(now.saturating_duration_since(self.since).as_secs_f64());
        self.since = now;
    }

    fn advance(&mut self, seconds: f64) {
        for k in 0..3 {
            let step = match self.target[k] {
                Some(target) => (target - self.at[k]).clamp(-SPEED * seconds, SPEED * seconds),
                None => self.velocity[k] * SPEED * seconds,
            };
            self.at[k] = (self.at[k] + step).clamp(if k == 2 { 0.0 } else { -1.0 }, 1.0);
        }
    }

    fn moving(&self) -> bool {
        (0..3).any(|k| self.target[k].map_or(self.velocity[k] != 0.0, |t| t != self.at[k]))
    }
}

pub struct State {
    pub habits: Habits,
    axes: Axes,
    presets: BTreeMap<String, (String, [f64; 3])>,
    nonces: BTreeMap<String, u32>,
    next_nonce: u32,
    pub focus: (String, f64),
    /// Actions that were carried out, and paths that were fetched.
    pub heard: Vec<String>,
    /// Requests that were refused for want of proof.
    pub refused: u32,
    pub connections: u32,
    /// The body of the last request, and its Authorization.
    pub last: (String, String),
    pub picture: Vec<u8>,
}

impl State {
    /// Pan, tilt (degrees) and zoom.
    pub fn position(&mut self) -> [f64; 3] {
        self.axes.pass();
        [self.axes.at[0] * HALF[0], self.axes.at[1] * HALF[1], self.axes.at[2]]
    }
}

#[derive(Clone)]
pub struct Camera {
    pub port: u16,
    state: Arc<Mutex<State>>,
}

impl Camera {
    pub fn start(habits: Habits) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let still = Axes { at: [0.0; 3], target: [None; 3], velocity: [0.0; 3], since: Instant::now(), until: None };
        let state = State {
            habits,
            axes: still,
            presets: BTreeMap::new(),
            nonces: BTreeMap::new(),
            next_nonce: 0,
            focus: ("AUTO".into(), 0.0),
            heard: Vec::new(),
            refused: 0,
            connections: 0,
            last: Default::default(),
            picture: Vec::new(),
        };
        let camera = Self { port, state: Arc::new(Mutex::new(state)) };
        let serving = camera.clone();
        // Ends with the process.
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let camera = serving.clone();
                camera.state().connections += 1;
                std::thread::spawn(move || camera.serve(stream));
            }
        });
        camera
    }

    pub fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }

    fn serve(&self, mut stream: TcpStream) {
        while let Some(request) = Request::read(&mut stream) {
            let (status, extra, body) = self.answer(&request);
            let kind = if request.method == "GET" { "image/jpeg" } else { "application/soap+xml" };
            let head =
                format!("HTTP/1.1 {status} X\r\nContent-Type: {kind}\r\nContent-Length: {}\r\n{extra}\r\n", body.len());
            if stream.write_all(head.as_bytes()).is_err()
                || stream.write_all(&body).is_err()
                || self.state().habits.closes
            {
                return;
            }
        }
    }

    fn answer(&self, request: &Request) -> (u16, String, Vec<u8>) {
        let action = request.action();
        // The standard lets everybody ask for the time.
        let free = action == "GetSystemDateAndTime";
        if !free && let Some(refusal) = self.state().refuse(request) {
            return refusal;
        }
        let slow = self.state().habits.slow;
        if let Some((_, seconds)) = slow.filter(|(slow, _)| *slow == action) {
            std::thread::sleep(Duration::from_secs_f64(seconds));
        }
        let mut state = self.state();
        let picture = request.path.split('?').next() == Some("/snap.jpg");
        state.heard.push(if request.method == "GET" { request.path.clone() } else { action.clone() });
        state.last = (request.body.clone(), request.header("authorization").unwrap_or_default().to_owned());
        if request.method == "GET" {
            return if picture {
                (200, String::new(), state.picture.clone())
            } else {
                (404, String::new(), b"no".to_vec())
            };
        }
        if let Some(body) = state.habits.instead.get(action.as_str()) {
            return (200, String::new(), body.clone().into_bytes());
        }
        match state.respond(&action, &request.body, self.port) {
            Ok(inner) => (200, String::new(), envelope(&inner).into_bytes()),
            Err(reason) => (400, String::new(), fault("ActionNotSupported", &reason).into_bytes()),
        }
    }
}

pub fn envelope(inner: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<e:Envelope xmlns:e=\"http://www.w3.org/2003/05/soap-envelope\" \
         xmlns:tt=\"http://www.onvif.org/ver10/schema\"><e:Body>{inner}</e:Body></e:Envelope>"
    )
}

pub fn fault(code: &str, reason: &str) -> String {
    envelope(&format!(
        "<e:Fault><e:Code><e:Value>e:Sender</e:Value><e:Subcode><e:Value>ter:{code}</e:Value></e:Subcode></e:Code>\
         <e:Reason><e:Text xml:lang=\"en\">{reason}</e:Text></e:Reason></e:Fault>"
    ))
}

struct Request {
    method: String,
    path: String,
    headers: Vec<(String, String)>,
    body: String,
}

impl Request {
    fn read(stream: &mut TcpStream) -> Option<Self> {
        let mut head = Vec::new();
        let mut byte = [0];
        while !head.ends_with(b"\r\n\r\n") {
            stream.read_exact(&mut byte).ok()?;
            head.push(byte[0]);
        }
        let head = String::from_utf8(head).unwrap();
        let mut lines = head.lines();
        let mut first = lines.next()?.split(' ');
        let (method, path) = (first.next()?.to_owned(), first.next()?.to_owned());
        let headers: Vec<_> = lines
            .filter_map(|l| l.split_once(':'))
            .map(|(n, v)| (n.trim().to_ascii_lowercase(), v.trim().to_owned()))
            .collect();
        let mut request = Self { method, path, headers, body: String::new() };
        let length: usize = request.header("content-length").and_then(|n| n.parse().ok()).unwrap_or(0);
        let mut body = vec![0; length];
        stream.read_exact(&mut body).ok()?;
        request.body = String::from_utf8(body).unwrap();
        Some(request)
    }

    fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_str())
    }

    /// The name of the first element in the SOAP body.
    fn action(&self) -> String {
        let Some((_, body)) = self.body.split_once(":Body>") else { return String::new() };
        let name = body.trim_start_matches('<').split([' ', '>', '/']).next().unwrap();
        name.rsplit(':').next().unwrap().to_owned()
    }
}

/// What stands between `>` and `</` of the first element of that name.
fn text<'a>(body: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = body.split_once(&format!("{name}>"))?;
    Some(rest.split('<').next().unwrap())
}

/// Attribute `name` of the first element `element`.
fn attribute(body: &str, element: &str, name: &str) -> Option<f64> {
    let (_, rest) = body.split_once(&format!(":{element} "))?;
    let tag = rest.split('>').next().unwrap();
    tag.split_once(&format!("{name}=\""))?.1.split('"').next().unwrap().parse().ok()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

fn from_base64(text: &str) -> Vec<u8> {
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = text.bytes().filter(|b| *b != b'=').map(|b| alphabet.iter().position(|a| *a == b).unwrap() as u32);
    let (mut bytes, mut word, mut bits) = (Vec::new(), 0u32, 0);
    for digit in digits {
        (word, bits) = ((word << 6) | digit, bits + 6);
        if bits >= 8 {
            bits -= 8;
            bytes.push((word >> bits) as u8);
        }
    }
    bytes
}

impl State {
    fn refuse(&mut self, request: &Request) -> Option<(u16, String, Vec<u8>)> {
        let (status, extra) = match self.habits.lock {
            Lock::Open => return None,
            Lock::Digest { sha256, uses } => match self.check_digest(request, sha256, uses) {
                Ok(()) => return None,
                Err(stale) => (401, self.challenge(sha256, stale)),
            },
            // Snapshots of old cameras are open.
            Lock::Token if request.method == "GET" || self.check_token(&request.body) => return None,
            Lock::Token => (400, String::new()),
            Lock::Basic => (401, "WWW-Authenticate: Basic realm=\"camera\"\r\n".into()),
        };
        self.refused += 1;
        Some((status, extra, fault("NotAuthorized", "Sender not authorized").into_bytes()))
    }

    fn challenge(&mut self, sha256: bool, stale: bool) -> String {
        self.next_nonce += 1;
        let nonce = format!("nonce=/{}==", self.next_nonce);
        self.nonces.insert(nonce.clone(), 0);
        let mut text = String::new();
        let stale = if stale { ", stale=true" } else { "" };
        if sha256 {
            // Both are offered, the weak one first.
            let _ = write!(text, "WWW-Authenticate: Basic realm=\"camera, old\"\r\n");
            let _ = write!(
                text,
                "WWW-Authenticate: Digest realm=\"the cam\", qop=\"auth\", algorithm=SHA-256, \
                 nonce=\"{nonce}\", opaque=\"o\"{stale}\r\n"
            );
        } else {
            let _ =
                write!(text, "WWW-Authenticate: Digest realm=\"the cam\",qop=\"auth\",nonce=\"{nonce}\"{stale}\r\n");
        }
        text
    }

    /// `Err(true)`: right, but for a nonce that is used up.
    fn check_digest(&mut self, request: &Request, sha256: bool, uses: u32) -> Result<(), bool> {
        let header = request.header("authorization").and_then(|h| h.strip_prefix("Digest ")).ok_or(false)?;
        // In order: quoted values may hold commas in other cameras, not in this one's.
        let fields: BTreeMap<_, _> = header
            .split(", ")
            .filter_map(|f| f.split_once('='))
            .map(|(n, v)| (n, v.trim_matches('"').replace("\\\"", "\"")))
            .collect();
        let get = |name: &str| fields.get(name).map(String::as_str).ok_or(false);
        let hash = |text: String| if sha256 { hex(&Sha256::digest(text)) } else { hex(&Md5::digest(text)) };
        let (nonce, nc, cnonce, realm) = (get("nonce")?, get("nc")?, get("cnonce")?, get("realm")?);
        let secret = hash(format!("{USER}:the cam:{PASSWORD}"));
        let asked = hash(format!("{}:{}", request.method, request.path));
        let right = hash(format!("{secret}:{nonce}:{nc}:{cnonce}:auth:{asked}"));
        let same =
            get("uri")? == request.path && get("username")? == USER && get("qop")? == "auth" && realm == "the cam";
        if !same || get("response")? != right || cnonce.len() < 8 {
            return Err(false);
        }
        let count = u32::from_str_radix(nc, 16).map_err(|_| false)?;
        let seen = self.nonces.get_mut(nonce).ok_or(true)?;
        // No request twice.
        if count <= *seen || count > uses {
            return Err(true);
        }
        *seen = count;
        Ok(())
    }

    fn check_token(&self, body: &str) -> bool {
        let found = (text(body, "wsse:Username"), text(body, "wsu:Created"));
        let (Some(user), Some(created)) = found else { return false };
        let nonce = body.split_once("<wsse:Nonce").and_then(|(_, rest)| text(rest, "\""));
        let sent = body.split_once("#PasswordDigest\"").and_then(|(_, rest)| rest.strip_prefix('>')?.split('<').next());
        let (Some(nonce), Some(sent)) = (nonce, sent) else { return false };
        let mut hash = Sha1::new();
        hash.update(from_base64(nonce));
        hash.update(created);
        hash.update(PASSWORD);
        // Within 5 s of the camera's own clock.
        let own = calendar(now() + self.habits.skew);
        let near = (-5..=5).any(|s| calendar(now() + self.habits.skew + f64::from(s)).2 == created);
        user == USER && from_base64(sent) == hash.finalize().to_vec() && (near || created == own.2)
    }

    fn respond(&mut self, action: &str, body: &str, port: u16) -> Result<String, String> {
        self.axes.pass();
        let me = self.habits.calls_itself.map_or(format!("127.0.0.1:{port}"), str::to_owned);
        let pan_tilt = || Some([attribute(body, "PanTilt", "x")?, attribute(body, "PanTilt", "y")?]);
        let degrees = body.contains("Degrees");
        let share = |[x, y]: [f64; 2]| if degrees { [x / HALF[0], y / HALF[1]] } else { [x, y] };
        let inner = match action {
            "GetSystemDateAndTime" => {
                let (date, time, _) = calendar(now() + self.habits.skew);
                format!(
                    "<SystemDateAndTime><tt:UTCDateTime><tt:Time><tt:Hour>{}</tt:Hour><tt:Minute>{}</tt:Minute>\
                     <tt:Second>{}</tt:Second></tt:Time><tt:Date><tt:Year>{}</tt:Year><tt:Month>{}</tt:Month>\
                     <tt:Day>{}</tt:Day></tt:Date></tt:UTCDateTime></SystemDateAndTime>",
                    time[0], time[1], time[2], date[0], date[1], date[2]
                )
            }
            "GetServices" if self.habits.services => {
                let media = if self.habits.media2 { "ver20/media" } else { "ver10/media" };
                ["ver10/device", media, "ver20/ptz", "ver20/imaging"]
                    .map(|s| {
                        let path = s.rsplit('/').next().unwrap();
                        format!(
                            "<Service><Namespace>http://www.onvif.org/{s}/wsdl</Namespace>\
                             <XAddr>http://{me}/onvif/{path}?x=1&amp;y=2</XAddr></Service>"
                        )
                    })
                    .concat()
            }
            "GetCapabilities" => format!(
                "<Capabilities><tt:Media><tt:XAddr>http://{me}/onvif/media</tt:XAddr></tt:Media>\
                 <tt:PTZ><tt:XAddr>http://{me}/onvif/ptz</tt:XAddr></tt:PTZ></Capabilities>"
            ),
            "GetProfiles" if self.habits.media2 => {
                "<Profiles token=\"fixed\"/><Profiles token=\"p&lt;1\"><Configurations>\
                 <VideoSource token=\"v\"><tt:SourceToken>source</tt:SourceToken></VideoSource>\
                 <PTZ token=\"c\"><tt:NodeToken>node</tt:NodeToken></PTZ></Configurations></Profiles>"
                    .into()
            }
            "GetProfiles" => {
                "<Profiles token=\"fixed\"/><Profiles token=\"p&lt;1\"><tt:VideoSourceConfiguration token=\"v\">\
                 <tt:SourceToken>source</tt:SourceToken></tt:VideoSourceConfiguration>\
                 <tt:PTZConfiguration token=\"c\"><tt:NodeToken>node</tt:NodeToken></tt:PTZConfiguration></Profiles>"
                    .into()
            }
            "GetNodes" => self.nodes(),
            "GetConfigurationOptions" => "<PTZConfigurationOptions><tt:PTZTimeout><tt:Min>PT1S</tt:Min>\
                 <tt:Max>PT1M</tt:Max></tt:PTZTimeout></PTZConfigurationOptions>"
                .into(),
            "GetStatus" if body.contains("VideoSourceToken") => format!(
                "<Status><tt:FocusStatus20><tt:Position>{}</tt:Position></tt:FocusStatus20></Status>",
                self.focus.1
            ),
            "GetStatus" => self.status(),
            "GetDeviceInformation" => "<Manufacturer>Acme\n</Manufacturer><Model>Dome &amp; Co</Model>\
                 <FirmwareVersion>1.2</FirmwareVersion>"
                .into(),
            "AbsoluteMove" if self.habits.lame => String::new(),
            "AbsoluteMove" => {
                if let Some([pan, tilt]) = pan_tilt().map(share) {
                    if pan.abs() > 1.0 || tilt.abs() > 1.0 {
                        return Err("Invalid position".into());
                    }
                    (self.axes.target[0], self.axes.target[1]) = (Some(pan), Some(tilt));
                }
                if let Some(zoom) = attribute(body, "Zoom", "x") {
                    self.axes.target[2] = Some(zoom);
                }
                String::new()
            }
            "RelativeMove" => {
                let by = pan_tilt().map(|by| match body.contains("/TranslationSpaceFov") {
                    // Percents of half a picture of 60 by 40 degrees.
                    true => [0.3 * by[0] / HALF[0], 0.2 * by[1] / HALF[1]],
                    false => share(by),
                });
                let [pan, tilt] = by.ok_or("no translation")?;
                let [p, t, _] = self.axes.at;
                (self.axes.target[0], self.axes.target[1]) = (Some(p + pan), Some(t + tilt));
                String::new()
            }
            "ContinuousMove" => {
                let [pan, tilt] = pan_tilt().map(share).ok_or("no velocity")?;
                self.axes.target = [None; 3];
                // In degrees per second: a share of the range; else of the full speed.
                let scale = if degrees { 1.0 / SPEED } else { 1.0 };
                self.axes.velocity = [pan * scale, tilt * scale, attribute(body, "Zoom", "x").unwrap_or(0.0)];
                let seconds = text(body, "Timeout").map(|t| t.trim_matches(['P', 'T', 'S']).parse::<f64>().unwrap());
                self.axes.until = Some(Instant::now() + Duration::from_secs_f64(seconds.unwrap_or(10.0)));
                String::new()
            }
            "Stop" => {
                (self.axes.target, self.axes.velocity) = ([None; 3], [0.0; 3]);
                String::new()
            }
            "GotoHomePosition" => {
                self.axes.target = [Some(0.0), Some(0.0), None];
                String::new()
            }
            "GetPresets" => self
                .presets
                .iter()
                .map(|(token, (name, _))| format!("<Preset token=\"{token}\"><tt:Name>{name}</tt:Name></Preset>"))
                .collect(),
            "SetPreset" => {
                let new = format!("Preset-{}", self.presets.len() + 100);
                let token = text(body, "PresetToken").map_or(new, str::to_owned);
                let name = text(body, "PresetName").ok_or("no name")?.to_owned();
                self.presets.insert(token.clone(), (name, self.axes.at));
                format!("<PresetToken>{token}</PresetToken>")
            }
            "GotoPreset" => {
                let token = text(body, "PresetToken").ok_or("no token")?;
                let (_, at) = self.presets.get(token).ok_or("no such preset")?;
                self.axes.target = at.map(Some);
                String::new()
            }
            "RemovePreset" => {
                let token = text(body, "PresetToken").ok_or("no token")?;
                self.presets.remove(token).map(|_| String::new()).ok_or("no such preset")?
            }
            "GetMoveOptions" => "<MoveOptions><tt:Absolute><tt:Position><tt:Min>-2</tt:Min><tt:Max>6</tt:Max>\
                 </tt:Position></tt:Absolute></MoveOptions>"
                .into(),
            "SetImagingSettings" => {
                self.focus.0 = text(body, "AutoFocusMode").ok_or("no mode")?.to_owned();
                String::new()
            }
            "Move" => {
                self.focus.1 = text(body, "tt:Position").and_then(|p| p.parse().ok()).ok_or("no position")?;
                String::new()
            }
            "GetSnapshotUri" if self.habits.media2 => format!("<Uri>http://{me}/snap.jpg?a=1&amp;b=2</Uri>"),
            "GetSnapshotUri" => format!("<MediaUri><tt:Uri>http://{me}/snap.jpg?a=1&amp;b=2</tt:Uri></MediaUri>"),
            other => return Err(format!("{other} is optional")),
        };
        Ok(format!("<x:{action}Response xmlns:x=\"urn:x\">{inner}</x:{action}Response>"))
    }

    fn nodes(&self) -> String {
        let range = |axis: &str, low: f64, high: f64| {
            format!("<tt:{axis}Range><tt:Min>{low}</tt:Min><tt:Max>{high}</tt:Max></tt:{axis}Range>")
        };
        let space = |kind: &str, uri: &str, half: [f64; 2]| {
            let ranges = range("X", -half[0], half[0]) + &range("Y", -half[1], half[1]);
            format!(
                "<tt:{kind}><tt:URI>http://www.onvif.org/ver10/tptz/PanTiltSpaces/{uri}</tt:URI>{ranges}</tt:{kind}>"
            )
        };
        let mut spaces = space("AbsolutePanTiltPositionSpace", "PositionGenericSpace", [1.0; 2])
            + &space("ContinuousPanTiltVelocitySpace", "VelocityGenericSpace", [1.0; 2]);
        if self.habits.degrees {
            spaces +=
                &space("AbsolutePanTiltPositionSpace", "SphericalPositionSpaceDegrees/v2", HALF).replace("/v2", "V2");
            spaces += &space("RelativePanTiltTranslationSpace", "SphericalTranslationSpaceDegrees", HALF);
            spaces += &space("ContinuousPanTiltVelocitySpace", "VelocitySpaceDegrees", [90.0, 45.0]);
            spaces += &space("RelativePanTiltTranslationSpace", "TranslationSpaceFov", [100.0; 2]);
        }
        let zoom = |kind: &str, uri: &str, low: f64| {
            let uri = format!("http://www.onvif.org/ver10/tptz/ZoomSpaces/{uri}");
            format!("<tt:{kind}><tt:URI>{uri}</tt:URI>{}</tt:{kind}>", range("X", low, 1.0))
        };
        spaces += &zoom("AbsoluteZoomPositionSpace", "PositionGenericSpace", 0.0);
        spaces += &zoom("ContinuousZoomVelocitySpace", "VelocityGenericSpace", -1.0);
        format!(
            "<PTZNode token=\"other\"/><PTZNode token=\"node\"><tt:SupportedPTZSpaces>{spaces}</tt:SupportedPTZSpaces>\
             <tt:MaximumNumberOfPresets>8</tt:MaximumNumberOfPresets><tt:HomeSupported>true</tt:HomeSupported></PTZNode>"
        )
    }

    fn status(&mut self) -> String {
        let [pan, tilt, zoom] = self.position();
        let (x, y, space) = match self.habits.degrees {
            true => (pan, tilt, "SphericalPositionSpaceDegreesV2"),
            false => (pan / HALF[0], tilt / HALF[1], "PositionGenericSpace"),
        };
        let mut inner = String::new();
        if self.habits.tells_position {
            let space = format!("http://www.onvif.org/ver10/tptz/PanTiltSpaces/{space}");
            let _ = write!(
                inner,
                "<tt:Position><tt:PanTilt x=\"{x}\" y=\"{y}\" space=\"{space}\"/><tt:Zoom x=\"{zoom}\"/></tt:Position>"
            );
        }
        if self.habits.tells_motion {
            let truth = if self.axes.moving() { "MOVING" } else { "IDLE" };
            let says = self.habits.move_status.unwrap_or(truth);
            let _ =
                write!(inner, "<tt:MoveStatus><tt:PanTilt>{says}</tt:PanTilt><tt:Zoom>IDLE</tt:Zoom></tt:MoveStatus>");
        }
        format!("<PTZStatus>{inner}<tt:UtcTime>2026-01-01T00:00:00Z</tt:UtcTime></PTZStatus>")
    }
}

fn now() -> f64 {
    std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs_f64()
}

/// Date, time, and both as ISO 8601, by counting days.
fn calendar(unix: f64) -> ([u64; 3], [u64; 3], String) {
    let seconds = unix as u64;
    let (mut days, rest) = (seconds / 86_400, seconds % 86_400);
    let leap = |y: u64| y.is_multiple_of(4) && (!y.is_multiple_of(100) || y.is_multiple_of(400));
    let mut year = 1970;
    while days >= 365 + u64::from(leap(year)) {
        days -= 365 + u64::from(leap(year));
        year += 1;
    }
    let mut month = 1;
    for length in [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31] {
        if days < length {
            break;
        }
        days -= length;
        month += 1;
    }
    let (date, time) = ([year, month, days + 1], [rest / 3600, rest / 60 % 60, rest % 60]);
    let [h, m, s] = time;
    (date, time, format!("{year:04}-{month:02}-{:02}T{h:02}:{m:02}:{s:02}Z", days + 1))
}
