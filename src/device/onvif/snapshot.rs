//! Single pictures over the media service's snapshot address.

use std::io::Cursor;
use std::sync::Arc;

use image::{ImageFormat, ImageReader};

use super::OnvifOptions;
use super::client::Client;
use super::driver::Camera;
use super::http::Place;
use super::services::{MEDIA, MEDIA2, Profile, request};
use super::xml::{Read, escaped};
use crate::control::Clock;
use crate::device::{Frame, FrameSource};
use crate::error::{Error, Result};
use crate::format::picture::{limits, to_image};
use crate::image::Image;

/// Of a compressed picture, bytes.
const MAX_PICTURE: u64 = 32 << 20;
/// Memory that a decoded one may take: 64 megapixels of colour.
const MAX_DECODED: u64 = 192 << 20;

/// Asks for each frame. Cameras do not say when a snapshot was exposed, so frames have no timestamp;
/// those that keep the last one for a while need `latency`.
pub struct OnvifFrames {
    client: Client,
    place: Place,
    /// A snapshot shows what was this long before it was asked for, at most, seconds.
    latency: f64,
    clock: Arc<dyn Clock>,
}

impl OnvifFrames {
    pub(super) fn open(camera: Camera, options: &OnvifOptions, clock: Arc<dyn Clock>) -> Result<Self> {
        let Camera { client, services, .. } = camera;
        let profiles = Profile::list(&client, &services)?;
        let profile = Profile::choose(profiles, options.profile.as_deref(), |_| true);
        let profile = profile.map_err(|reason| client.mismatch(reason))?;
        let token = format!("<q:ProfileToken>{}</q:ProfileToken>", escaped(&profile.token));
        let (media, namespace) = match profile.second {
            true => (services.media2, MEDIA2),
            false => (services.media, MEDIA),
        };
        let media = media.ok_or_else(|| client.mismatch("it names no media service"))?;
        let response = client.call(&media, "GetSnapshotUri", &request(namespace, "GetSnapshotUri", &token))?;
        let uri = response.text_at(&["MediaUri", "Uri"]).or_else(|| response.text_at(&["Uri"])).unwrap_or_default();
        let place = client.host().place(uri);
        let place = place.ok_or_else(|| client.mismatch("it names no HTTP address for its snapshots"))?;
        Ok(Self { client, place, latency: options.latency, clock })
    }
}

impl FrameSource for OnvifFrames {
    fn next_frame(&mut self, not_before: f64, timeout: f64, frame: &mut Frame) -> Result<()> {
        let start = self.clock.now();
        let late = Error::DeviceTimeout { what: "camera", seconds: timeout };
        // NaN and the past: at once.
        let wait = (not_before + self.latency - start).max(0.0);
        if wait >= timeout {
            self.clock.sleep(timeout);
            return Err(late);
        }
        self.clock.sleep(wait);
        let left = timeout - (self.clock.now() - start);
        if left.is_nan() || left <= 0.0 {
            return Err(late);
        }
        let bytes = self.client.get(&self.place, MAX_PICTURE, left)?;
        frame.image = decode(&bytes).map_err(|reason| self.client.mismatch(format!("its snapshot: {reason}")))?;
        frame.timestamp = f64::NAN;
        Ok(())
    }
}

/// GRAY8 or RGB24 of a whole JPEG.
fn decode(bytes: &[u8]) -> Read<Image> {
    // The decoder fills a picture that is cut off with grey.
    let end = bytes.len().saturating_sub(1024);
    if !bytes.starts_with(&[0xFF, 0xD8]) {
        return Err("it is no JPEG".into());
    }
    if !bytes.get(end..).unwrap_or_default().windows(2).any(|pair| pair == [0xFF, 0xD9]) {
        return Err("it is cut off".into());
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Jpeg);
    reader.limits(limits(MAX_DECODED));
    reader.decode().map(to_image).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::image::PixelFormat;

    /// Damaged pictures are decoded or refused, and are as large as they say.
    #[test]
    fn fuzz_pictures() {
        let inputs = crate::fuzz::fuzz_inputs();
        let mut whole = Vec::new();
        let pixels: Vec<u8> = (0..16 * 16 * 3).map(|i| (i * 7) as u8).collect();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new(&mut whole);
        encoder.encode(&pixels, 16, 16, image::ExtendedColorType::Rgb8).unwrap();
        assert_eq!(decode(&whole).unwrap().format, PixelFormat::Rgb24);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut read = 0;
        for _ in 0..inputs / 20 {
            let mut bytes = whole.clone();
            for _ in 0..1 + random.next_u32() % 4 {
                let at = random.next_u32() as usize % bytes.len();
                bytes[at] = random.next_u32() as u8;
            }
            // A size of its own may ask for much memory, within the limit: that takes long, not more.
            let start = bytes.windows(2).position(|w| w == [0xFF, 0xC0]).unwrap_or(0);
            bytes.iter_mut().skip(start + 5).step_by(2).take(2).for_each(|high| *high &= 1);
            if let Ok(image) = decode(&bytes) {
                read += 1;
                let depth = if image.format == PixelFormat::Gray8 { 1 } else { 3 };
                assert_eq!(image.data.len(), image.width as usize * image.height as usize * depth);
            }
        }
        assert!(read > inputs / 1000, "{read}");
    }
}
