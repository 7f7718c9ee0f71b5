//! Stub.
use super::spot::{Spot, SpotOptions};
use crate::error::{Error, Result};
use crate::image::area::SearchArea;
use crate::image::frames::FrameMean;
pub fn detect(_on: &FrameMean<'_>, _area: &SearchArea, _options: &SpotOptions) -> Result<Spot> {
    Err(Error::NotFound { reason: "".into() })
}
