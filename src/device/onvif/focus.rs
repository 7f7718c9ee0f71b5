//! Focus over the imaging service.

use super::client::Client;
use super::http::Place;
use super::services::{IMAGING, number, request};
use super::xml::escaped;
use crate::device::Focus;
use crate::error::{Error, Result};

/// A lens whose focus can be sent to a place.
pub struct Lens {
    place: Place,
    video_source: String,
    /// Of the camera's focus position.
    range: [f64; 2],
}

impl Lens {
    /// `None` for a camera without such a lens.
    pub fn find(client: &Client, place: Option<&Place>, video_source: Option<&str>) -> Result<Option<Self>> {
        let (Some(place), Some(source)) = (place, video_source) else { return Ok(None) };
        let inner = token(source);
        match client.call(place, "GetMoveOptions", &request(IMAGING, "GetMoveOptions", &inner)) {
            Ok(response) => {
                let position = response.at(&["MoveOptions", "Absolute", "Position"]);
                let limit = |name| number(position?, name).ok();
                let range = limit("Min").zip(limit("Max")).filter(|(low, high)| low < high);
                let video_source = source.to_owned();
                Ok(range.map(|(low, high)| Self { place: place.clone(), video_source, range: [low, high] }))
            }
            Err(Error::DeviceRefused { .. } | Error::DeviceMismatch { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    pub fn set(&self, client: &Client, focus: Focus) -> Result<()> {
        let at = match focus {
            Focus::At(at) if !(0.0..=1.0).contains(&at) => {
                return Err(Error::invalid("focus", format!("{at} is not in [0, 1]")));
            }
            Focus::At(at) => Some(at),
            Focus::Auto | Focus::Manual => None,
        };
        let mode = if focus == Focus::Auto { "AUTO" } else { "MANUAL" };
        let inner = format!(
            "{}<q:ImagingSettings><tt:Focus><tt:AutoFocusMode>{mode}</tt:AutoFocusMode></tt:Focus>\
             </q:ImagingSettings><q:ForcePersistence>false</q:ForcePersistence>",
            token(&self.video_source)
        );
        client.call(&self.place, "SetImagingSettings", &request(IMAGING, "SetImagingSettings", &inner))?;
        let Some(at) = at else { return Ok(()) };
        let [low, high] = self.range;
        let inner = format!(
            "{}<q:Focus><tt:Absolute><tt:Position>{:.6}</tt:Position></tt:Absolute></q:Focus>",
            token(&self.video_source),
            low + at * (high - low)
        );
        client.call(&self.place, "Move", &request(IMAGING, "Move", &inner)).map(drop)
    }

    pub fn position(&self, client: &Client) -> Result<f64> {
        let inner = token(&self.video_source);
        let response = client.call(&self.place, "GetStatus", &request(IMAGING, "GetStatus", &inner))?;
        let status = response.at(&["Status", "FocusStatus20"]).or_else(|| response.at(&["Status", "FocusStatus"]));
        let at = status.ok_or_else(|| "no focus".to_owned()).and_then(|s| number(s, "Position"));
        let at = at.map_err(|reason| client.mismatch(format!("its imaging status: {reason}")))?;
        let [low, high] = self.range;
        Ok(((at - low) / (high - low)).clamp(0.0, 1.0))
    }
}

fn token(video_source: &str) -> String {
    format!("<q:VideoSourceToken>{}</q:VideoSourceToken>", escaped(video_source))
}
