//! Frames of a camera at this machine: `v4l2:///dev/video0?size=640x480&format=YUYV&fps=10`.
//!
//! Frames go through the kernel's ring of buffers, are stamped by it, and are judged by their stamps:
//! whatever was exposed before the moment that the caller names is dropped, and so is what the driver
//! calls damaged, what is too short, and JPEG that is not whole.

mod jpeg;
mod jpeg_scan;
mod node;
mod picture;
mod ring;

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{Address, Frame, FrameSource, Surroundings};
use crate::control::LogLevel;
use crate::error::{Error, Result};
use node::{Mode, Node, Wanted};
use picture::Encoding;
use ring::{Ring, Stamp, Taken, monotonic_now};

const OPTIONS: &[&str] = &["size", "format", "fps", "buffers"];
const DEFAULT_BUFFERS: u32 = 4;
/// A camera that was lost is looked for at most this often, seconds.
const REOPEN_PAUSE: f64 = 1.0;
/// Dropped frames are written to the log at most this often, seconds.
const REPORT_PAUSE: f64 = 1.0;
/// Frames' stamps that say when they were complete: exposure and read-out each took at most a frame's
/// time, so exposure began at most so many frame times earlier.
const FRAMES_BEFORE_COMPLETE: f64 = 2.0;

/// Opens a camera and starts its stream.
///
/// # Errors
/// `InvalidAddress`; `DeviceNotFound`, `DevicePermission`; `DeviceBusy` while another process streams;
/// `DeviceMismatch` for what is no camera, and for a size, format or rate that it does not give, with
/// those that it offers.
pub fn open(address: &Address, surroundings: &Surroundings) -> Result<Box<dyn FrameSource>> {
    address.check_options(OPTIONS)?;
    let path = address.need_local_path()?.to_owned();
    let wanted = Wanted { size: size(address)?, encoding: encoding(address)?, rate: rate(address)? };
    let buffers = address.number("buffers", DEFAULT_BUFFERS, 2..=32)?;
    let mut camera = Camera {
        path,
        wanted,
        buffers,
        surroundings: surroundings.clone(),
        stream: None,
        reopen_at: f64::NEG_INFINITY,
        quiet_until: f64::NEG_INFINITY,
    };
    let stream = camera.start()?;
    // After a loss it has to come back as it was.
    let layout = stream.mode.layout;
    camera.wanted.size = Some((layout.width, layout.height));
    camera.wanted.encoding = Some(layout.encoding);
    camera.stream = Some(stream);
    Ok(Box::new(camera))
}

fn size(address: &Address) -> Result<Option<(u32, u32)>> {
    let Some(text) = address.option("size") else { return Ok(None) };
    let side = |s: &str| s.parse::<u32>().ok().filter(|side| (1..=16_384).contains(side));
    text.split_once('x')
        .and_then(|(w, h)| Some((side(w)?, side(h)?)))
        .map(Some)
        .ok_or_else(|| address.wrong(format!("option size={text:?} is not like 640x480")))
}

fn encoding(address: &Address) -> Result<Option<Encoding>> {
    let Some(text) = address.option("format") else { return Ok(None) };
    Encoding::from_name(text)
        .map(Some)
        .ok_or_else(|| address.wrong(format!("option format={text:?} is not among YUYV, NV12, GREY, MJPEG")))
}

fn rate(address: &Address) -> Result<Option<f64>> {
    let rate = address.number("fps", f64::NAN, 0.1..=1000.0)?;
    Ok((!rate.is_nan()).then_some(rate))
}

struct Camera {
    path: String,
    wanted: Wanted,
    buffers: u32,
    surroundings: Surroundings,
    /// `None` after a loss.
    stream: Option<Stream>,
    reopen_at: f64,
    /// Until when no further dropped frame is written to the log.
    quiet_until: f64,
}

struct Stream {
    mode: Mode,
    // Before the node: it stops the stream.
    ring: Ring,
    node: Arc<Node>,
}

impl Camera {
    fn start(&self) -> Result<Stream> {
        let node = Arc::new(Node::open(&self.path)?);
        let mode = node.set(&self.wanted)?;
        let ring = Ring::start(&node, self.buffers).map_err(|e| node.error(&e))?;
        Ok(Stream { mode, ring, node })
    }

    /// The stream, started again if the camera was lost.
    fn stream(&mut self) -> Result<&mut Stream> {
        if self.stream.is_none() {
            let now = self.surroundings.clock.now();
            if now < self.reopen_at {
                return Err(Error::DeviceLost {
                    reason: format!("{}: it was lost; it is looked for in a second", self.path),
                });
            }
            self.reopen_at = now + REOPEN_PAUSE;
            self.stream = Some(self.start()?);
            self.surroundings.log.write(LogLevel::Info, || format!("{}: the camera is back", self.path));
        }
        self.stream.as_mut().ok_or_else(|| Error::Internal { reason: "a stream that was just started".into() })
    }

    /// What a failed call on the stream means. A stream that only broke (a fatal fault of the driver, a
    /// signal that was lost) is started again, once in a call.
    fn broken(&mut self, error: &std::io::Error, may_restart: bool) -> Result<()> {
        let Some(Stream { node, .. }) = self.stream.take() else { return Ok(()) };
        let gone = matches!(error.raw_os_error(), Some(libc::ENODEV | libc::ENXIO));
        let error = node.error(error);
        drop(node);
        if !gone && may_restart {
            self.surroundings.log.write(LogLevel::Warning, || format!("the stream is started again: {error}"));
            if let Ok(stream) = self.start() {
                self.stream = Some(stream);
                return Ok(());
            }
        }
        self.reopen_at = self.surroundings.clock.now() + REOPEN_PAUSE;
        self.surroundings.log.write(LogLevel::Error, || error.to_string());
        Err(error)
    }

    /// Takes the frame if it will do.
    fn use_frame(&mut self, taken: &Taken, timestamp: f64, frame: &mut Frame) -> bool {
        let Some(stream) = &self.stream else { return false };
        let fault = if taken.damaged {
            Err("the driver calls it damaged".to_owned())
        } else {
            stream.mode.layout.decode(stream.ring.bytes(taken), &mut frame.image)
        };
        match fault {
            Ok(()) => {
                frame.timestamp = timestamp;
                true
            }
            Err(fault) => {
                let now = self.surroundings.clock.now();
                if now >= self.quiet_until {
                    self.quiet_until = now + REPORT_PAUSE;
                    self.surroundings
                        .log
                        .write(LogLevel::Warning, || format!("{}: a frame is dropped: {fault}", self.path));
                }
                false
            }
        }
    }
}

impl FrameSource for Camera {
    fn next_frame(&mut self, not_before: f64, timeout: f64, frame: &mut Frame) -> Result<()> {
        let limit = Duration::from_secs_f64(if timeout > 0.0 { timeout.min(3600.0) } else { 0.0 });
        let start = Instant::now();
        // Without stamps: whatever the ring may hold from before this call.
        let mut to_skip = self.stream()?.ring.len();
        let mut may_restart = true;
        loop {
            let wait = limit.saturating_sub(start.elapsed());
            let stream = self.stream()?;
            let frame_time = stream.mode.interval.unwrap_or(0.0);
            let taken = match stream.ring.take(wait) {
                Ok(Some(taken)) => taken,
                Ok(None) if start.elapsed() >= limit => {
                    return Err(Error::DeviceTimeout { what: "camera", seconds: timeout });
                }
                Ok(None) => continue,
                Err(error) => {
                    self.broken(&error, may_restart)?;
                    may_restart = false;
                    continue;
                }
            };
            // From the kernel's clock to the workflow's, which may be any.
            let offset = self.surroundings.clock.now() - monotonic_now();
            let timestamp = match taken.stamp {
                Stamp::Exposure(time) => time + offset,
                Stamp::Complete(time) => time + offset - frame_time * FRAMES_BEFORE_COMPLETE,
                Stamp::Unknown => f64::NAN,
            };
            let stale = if timestamp.is_nan() { to_skip > 0 } else { timestamp < not_before };
            to_skip = to_skip.saturating_sub(1);
            let used = !stale && self.use_frame(&taken, timestamp, frame);
            if let Some(Err(error)) = self.stream.as_mut().map(|stream| stream.ring.give_back(taken)) {
                // The frame was copied: it counts, and the next call sees to the stream.
                let mended = self.broken(&error, may_restart);
                may_restart = false;
                if !used {
                    mended?;
                }
            }
            if used {
                return Ok(());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_addresses_are_refused() {
        for (address, part) in [
            ("v4l2://host/dev/video0", "three slashes"),
            ("v4l2:///dev/null?size=640", "640x480"),
            ("v4l2:///dev/null?size=0x480", "640x480"),
            ("v4l2:///dev/null?size=99999x480", "640x480"),
            ("v4l2:///dev/null?format=H264", "YUYV"),
            ("v4l2:///dev/null?fps=0", "fps"),
            ("v4l2:///dev/null?fps=NaN", "fps"),
            ("v4l2:///dev/null?buffers=1", "buffers"),
            ("v4l2:///dev/null?colour=red", "not among"),
        ] {
            let error = open(&Address::parse(address).unwrap(), &Surroundings::default()).map(|_| ()).unwrap_err();
            assert!(matches!(error, Error::InvalidAddress { .. }) && error.to_string().contains(part), "{error}");
        }
        let error =
            |address: &str| open(&Address::parse(address).unwrap(), &Surroundings::default()).map(|_| ()).unwrap_err();
        assert!(matches!(error("v4l2:///dev/no-such-camera"), Error::DeviceNotFound { .. }));
        assert!(matches!(error("v4l2:///dev/null"), Error::DeviceMismatch { .. }));
    }
}
