//! The requests of ONVIF that a head needs, and what is taken from the answers. Sources: ONVIF Core,
//! Media, Media2, PTZ and Imaging service specifications.

use super::client::Client;
use super::http::Place;
use super::time;
use super::xml::{Element, Read};
use crate::error::{Error, Result};

pub const DEVICE: &str = "http://www.onvif.org/ver10/device/wsdl";
pub const MEDIA: &str = "http://www.onvif.org/ver10/media/wsdl";
pub const MEDIA2: &str = "http://www.onvif.org/ver20/media/wsdl";
pub const PTZ: &str = "http://www.onvif.org/ver20/ptz/wsdl";
pub const IMAGING: &str = "http://www.onvif.org/ver20/imaging/wsdl";
pub const SCHEMA: &str = "http://www.onvif.org/ver10/schema";

/// `<q:action xmlns:q="namespace">inner</q:action>`, with the schema's types as `tt`.
pub fn request(namespace: &str, action: &str, inner: &str) -> String {
    format!("<q:{action} xmlns:q=\"{namespace}\" xmlns:tt=\"{SCHEMA}\">{inner}</q:{action}>")
}

/// Where a camera's services are.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Services {
    pub media: Option<Place>,
    pub media2: Option<Place>,
    pub ptz: Option<Place>,
    pub imaging: Option<Place>,
}

impl Services {
    /// From GetServices, or GetCapabilities of cameras that do not know that.
    pub fn get(client: &Client, device: &Place) -> Result<Self> {
        let inner = "<q:IncludeCapability>false</q:IncludeCapability>";
        match client.call(device, "GetServices", &request(DEVICE, "GetServices", inner)) {
            Ok(response) => Ok(Self::from_services(&response, client)),
            Err(Error::DeviceRefused { .. } | Error::DeviceMismatch { .. }) => {
                let inner = "<q:Category>All</q:Category>";
                let response = client.call(device, "GetCapabilities", &request(DEVICE, "GetCapabilities", inner))?;
                Ok(Self::from_capabilities(&response, client))
            }
            Err(error) => Err(error),
        }
    }

    fn from_services(response: &Element, client: &Client) -> Self {
        let place = |namespace: &str| {
            let mut services = response.all("Service");
            let service = services.find(|s| s.text_at(&["Namespace"]) == Some(namespace))?;
            client.host().place(service.text_at(&["XAddr"])?)
        };
        Self { media: place(MEDIA), media2: place(MEDIA2), ptz: place(PTZ), imaging: place(IMAGING) }
    }

    fn from_capabilities(response: &Element, client: &Client) -> Self {
        let place = |name| client.host().place(response.text_at(&["Capabilities", name, "XAddr"])?);
        Self { media: place("Media"), media2: None, ptz: place("PTZ"), imaging: place("Imaging") }
    }
}

/// A media profile: what belongs together of a camera's parts.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Profile {
    pub token: String,
    pub video_source: Option<String>,
    /// Token of the PTZ node, and of its configuration; `None` without PTZ.
    pub ptz: Option<[String; 2]>,
    /// From the second media service.
    pub second: bool,
}

impl Profile {
    pub fn list(client: &Client, services: &Services) -> Result<Vec<Self>> {
        let (place, namespace, inner, second) = match (&services.media, &services.media2) {
            (Some(media), _) => (media, MEDIA, "", false),
            (None, Some(media)) => (media, MEDIA2, "<q:Type>All</q:Type>", true),
            (None, None) => return Err(client.mismatch("it names no media service")),
        };
        let response = client.call(place, "GetProfiles", &request(namespace, "GetProfiles", inner))?;
        Ok(response.all("Profiles").filter_map(|p| Self::read(p, second)).collect())
    }

    fn read(profile: &Element, second: bool) -> Option<Self> {
        let token = profile.attribute("token").filter(|t| !t.is_empty())?.to_owned();
        let (source, ptz) = if second {
            (profile.at(&["Configurations", "VideoSource"]), profile.at(&["Configurations", "PTZ"]))
        } else {
            (profile.child("VideoSourceConfiguration"), profile.child("PTZConfiguration"))
        };
        let ptz = ptz.map(|c| {
            [
                c.text_at(&["NodeToken"]).unwrap_or_default().to_owned(),
                c.attribute("token").unwrap_or_default().to_owned(),
            ]
        });
        Some(Self {
            token,
            video_source: source.and_then(|s| s.text_at(&["SourceToken"])).map(str::to_owned),
            ptz,
            second,
        })
    }

    /// The one that is named, or the first that `fits`.
    pub fn choose(all: Vec<Self>, named: Option<&str>, fits: impl Fn(&Self) -> bool) -> Read<Self> {
        let tokens: Vec<String> = all.iter().map(|p| super::client::bounded(&p.token)).collect();
        let found = match named {
            Some(token) => all.into_iter().find(|p| p.token == token),
            None => all.into_iter().find(fits),
        };
        found.ok_or_else(|| match named {
            Some(token) => format!("it has no profile {token:?}, only {}", tokens.join(", ")),
            None => format!("none of its profiles ({}) has what is needed", tokens.join(", ")),
        })
    }
}

/// A space of pan and tilt, or of zoom (then `y` is that of nothing).
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    pub uri: String,
    pub x: [f64; 2],
    pub y: [f64; 2],
}

impl Space {
    /// `name` (behind .../PanTiltSpaces/ or .../ZoomSpaces/) among spaces of the kind `element`.
    fn find(spaces: &Element, element: &str, name: &str, default: [f64; 2]) -> Read<Option<Self>> {
        for space in spaces.all(element) {
            let Some(uri) = space.text_at(&["URI"]) else { continue };
            // Versions of a space append to its name.
            if uri.rsplit('/').next().is_some_and(|last| last.starts_with(name)) {
                let range = |axis: &str| match space.child(axis) {
                    None => Ok(default),
                    Some(range) => {
                        let [low, high] = [number(range, "Min")?, number(range, "Max")?];
                        if low < high { Ok([low, high]) } else { Err(format!("{axis} of {name} is empty")) }
                    }
                };
                return Ok(Some(Self { uri: uri.to_owned(), x: range("XRange")?, y: range("YRange")? }));
            }
        }
        Ok(None)
    }
}

/// What a PTZ node can do.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Node {
    pub generic: Option<Space>,
    pub degrees: Option<Space>,
    pub zoom: Option<Space>,
    pub relative_degrees: Option<Space>,
    pub relative_view: Option<Space>,
    pub velocity: Option<Space>,
    pub velocity_degrees: Option<Space>,
    pub zoom_velocity: Option<Space>,
    pub presets: u32,
    pub home: bool,
}

impl Node {
    pub fn get(client: &Client, ptz: &Place, token: &str) -> Result<Self> {
        let response = client.call(ptz, "GetNodes", &request(PTZ, "GetNodes", ""))?;
        let mut nodes = response.all("PTZNode");
        let first = nodes.next().ok_or_else(|| client.mismatch("it has no PTZ node"))?;
        let named = response.all("PTZNode").find(|n| n.attribute("token") == Some(token));
        Self::read(named.unwrap_or(first)).map_err(|reason| client.mismatch(format!("its PTZ node: {reason}")))
    }

    pub fn read(node: &Element) -> Read<Self> {
        let none = Element::default();
        let spaces = node.child("SupportedPTZSpaces").unwrap_or(&none);
        let find = |element, name, default| Space::find(spaces, element, name, default);
        let (unit, turn) = ([-1.0, 1.0], [-180.0, 180.0]);
        Ok(Self {
            generic: find("AbsolutePanTiltPositionSpace", "PositionGenericSpace", unit)?,
            degrees: find("AbsolutePanTiltPositionSpace", "SphericalPositionSpaceDegrees", turn)?,
            zoom: find("AbsoluteZoomPositionSpace", "PositionGenericSpace", [0.0, 1.0])?,
            relative_degrees: find("RelativePanTiltTranslationSpace", "SphericalTranslationSpaceDegrees", turn)?,
            relative_view: find("RelativePanTiltTranslationSpace", "TranslationSpaceFov", unit)?,
            velocity: find("ContinuousPanTiltVelocitySpace", "VelocityGenericSpace", unit)?,
            velocity_degrees: find("ContinuousPanTiltVelocitySpace", "VelocitySpaceDegrees", turn)?,
            zoom_velocity: find("ContinuousZoomVelocitySpace", "VelocityGenericSpace", unit)?,
            presets: match node.text_at(&["MaximumNumberOfPresets"]) {
                None => 0,
                Some(text) => text.parse().map_err(|_| format!("{:?} presets", super::client::bounded(text)))?,
            },
            home: matches!(node.text_at(&["HomeSupported"]), Some("true" | "1")),
        })
    }
}

/// What a camera says of its motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MoveStatus {
    Idle,
    Moving,
}

/// Where the camera says it is, in its own units.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Status {
    pub pan_tilt: Option<[f64; 2]>,
    /// URI of the space of `pan_tilt`.
    pub space: Option<String>,
    pub zoom: Option<f64>,
    /// `None`: it does not say, or not in the standard's words.
    pub motion: Option<MoveStatus>,
}

impl Status {
    pub fn get(client: &Client, ptz: &Place, profile: &str) -> Result<Self> {
        let inner = format!("<q:ProfileToken>{}</q:ProfileToken>", super::xml::escaped(profile));
        let response = client.call(ptz, "GetStatus", &request(PTZ, "GetStatus", &inner))?;
        Self::read(&response).map_err(|reason| client.mismatch(format!("its PTZ status: {reason}")))
    }

    pub fn read(response: &Element) -> Read<Self> {
        let status = response.child("PTZStatus").ok_or("it is empty")?;
        let attribute = |element: &Element, name: &str| finite(element.attribute(name).unwrap_or_default());
        let pan_tilt = status.at(&["Position", "PanTilt"]);
        let axes = ["PanTilt", "Zoom"].map(|axis| status.text_at(&["MoveStatus", axis]));
        let motion = if axes.contains(&Some("MOVING")) {
            Some(MoveStatus::Moving)
        } else if axes[0] == Some("IDLE") {
            Some(MoveStatus::Idle)
        } else {
            None
        };
        Ok(Self {
            pan_tilt: pan_tilt.map(|p| Ok::<_, String>([attribute(p, "x")?, attribute(p, "y")?])).transpose()?,
            space: pan_tilt.and_then(|p| p.attribute("space")).map(str::to_owned),
            zoom: status.at(&["Position", "Zoom"]).map(|z| attribute(z, "x")).transpose()?,
            motion,
        })
    }
}

/// Shortest and longest time-out of a drive, seconds, where the camera tells.
pub fn drive_timeouts(client: &Client, ptz: &Place, configuration: &str) -> Result<Option<[f64; 2]>> {
    let inner = format!("<q:ConfigurationToken>{}</q:ConfigurationToken>", super::xml::escaped(configuration));
    let response = client.call(ptz, "GetConfigurationOptions", &request(PTZ, "GetConfigurationOptions", &inner))?;
    let range = response.at(&["PTZConfigurationOptions", "PTZTimeout"]);
    let limit = |name| time::seconds(range?.text_at(&[name])?);
    Ok(limit("Min").zip(limit("Max")).map(|(low, high)| [low, high]).filter(|[low, high]| low <= high))
}

/// A stored position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Preset {
    pub token: String,
    pub name: String,
}

/// All presets that have a token.
pub fn presets(client: &Client, ptz: &Place, profile: &str) -> Result<Vec<Preset>> {
    let inner = format!("<q:ProfileToken>{}</q:ProfileToken>", super::xml::escaped(profile));
    let response = client.call(ptz, "GetPresets", &request(PTZ, "GetPresets", &inner))?;
    let read = |preset: &Element| {
        let token = preset.attribute("token")?.to_owned();
        Some(Preset { token, name: preset.text_at(&["Name"]).unwrap_or_default().to_owned() })
    };
    Ok(response.all("Preset").filter_map(read).collect())
}

/// The number in a child element.
pub fn number(parent: &Element, child: &str) -> Read<f64> {
    finite(parent.text_at(&[child]).unwrap_or_default())
}

fn finite(text: &str) -> Read<f64> {
    let number = text.parse::<f64>().ok().filter(|n| n.is_finite());
    number.ok_or_else(|| format!("{:?} is no number", super::client::bounded(text)))
}
