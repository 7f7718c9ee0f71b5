//! Playing a recording back: the scan code cannot tell it from a rig.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

use super::{INFO, SHOTS};
use crate::control::{Clock, unpoisoned};
use crate::device::{Frame, FrameSource, Identity, Laser, Motion, PanTiltZoom, PtzCapabilities, PtzPosition};
use crate::error::{Error, Result};
use crate::format::recording_json::{self, RecordedShot, RecordingInfo, shots_from_lines};
use crate::format::{read_bounded, read_picture};
use crate::image::{Image, PixelFormat};

/// The text files may be this long.
const MAX_INFO_BYTES: u64 = 1 << 20;
const MAX_SHOTS_BYTES: u64 = 1 << 30;
/// A recorded position is found from this far, radians, where the head's step is unknown.
const TOLERANCE: f64 = 1e-3;
/// Time between frames, seconds.
const PERIOD: f64 = 0.04;

/// An opened recording. Its time is virtual: waiting lets it pass at once.
#[derive(Debug, Clone)]
pub struct Recording(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    folder: PathBuf,
    info: RecordingInfo,
    /// By pan.
    shots: Vec<RecordedShot>,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    now: f64,
    at: PtzPosition,
    /// The shot that was recorded where the head is.
    shot: Option<usize>,
    lit: bool,
    /// For each camera, the picture of this state that comes next.
    next: Vec<usize>,
}

impl Recording {
    /// # Errors
    /// `FileIo`; `FileFormat` and `FileVersion` for a folder that is no recording, `NotFound` for a
    /// recording without a shot. Pictures are read when they are asked for.
    pub fn open(folder: &Path) -> Result<Self> {
        let read = |name: &str, limit| {
            let path = folder.join(name);
            read_bounded(&path, limit).map(|bytes| (bytes, path.display().to_string()))
        };
        let (text, name) = read(INFO, MAX_INFO_BYTES)?;
        let info = recording_json::from_json(&text, &name)?;
        let (lines, name) = read(SHOTS, MAX_SHOTS_BYTES)?;
        let (mut shots, _) = shots_from_lines(&lines, info.cameras.len(), &name)?;
        if shots.is_empty() {
            return Err(Error::NotFound { reason: format!("{name}: the recording has no shot") });
        }
        // Stable: of shots at one position the last recorded stays last.
        shots.sort_by(|a, b| a.pan.total_cmp(&b.pan));
        let cameras = info.cameras.len();
        let state = State { now: 0.0, at: PtzPosition::default(), shot: None, lit: false, next: vec![0; cameras] };
        let shared = Shared { folder: folder.into(), info, shots, state: Mutex::new(state) };
        shared.state().go(&shared, 0.0, 0.0);
        Ok(Self(Arc::new(shared)))
    }

    pub fn info(&self) -> &RecordingInfo {
        &self.0.info
    }

    /// Number of recorded shots.
    pub fn shots(&self) -> usize {
        self.0.shots.len()
    }

    pub fn ptz(&self) -> RecordingHead {
        RecordingHead(self.0.clone())
    }

    pub fn laser(&self) -> RecordingLaser {
        RecordingLaser(self.0.clone())
    }

    /// Frames of a camera; 0 is the head's.
    ///
    /// # Errors
    /// `InvalidArgument` when there is no such camera.
    pub fn frames(&self, camera: usize) -> Result<RecordingFrames> {
        let cameras = self.0.info.cameras.len();
        if camera >= cameras {
            return Err(Error::invalid("camera", format!("{camera}: the recording has {cameras} cameras")));
        }
        Ok(RecordingFrames { shared: self.0.clone(), camera })
    }

    pub fn clock(&self) -> Arc<dyn Clock> {
        Arc::new(RecordingClock(self.0.clone()))
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        unpoisoned(&self.state)
    }

    /// The shot nearest to a position, if one was recorded there.
    fn shot_at(&self, pan: f64, tilt: f64) -> Option<usize> {
        let tolerance = |step: f64| if step > 0.0 { 1.01 * step } else { TOLERANCE };
        let (across, up) = (tolerance(self.info.pan_step), tolerance(self.info.tilt_step));
        let first = self.shots.partition_point(|s| s.pan < pan - across);
        let near = self.shots[first..].iter().take_while(|s| s.pan <= pan + across).enumerate();
        near.filter(|(_, s)| (s.tilt - tilt).abs() <= up)
            .map(|(i, s)| (first + i, ((s.pan - pan) / across).hypot((s.tilt - tilt) / up)))
            // The last of equal ones was recorded last.
            .reduce(|best, other| if other.1 <= best.1 { other } else { best })
            .map(|(i, _)| i)
    }
}

impl State {
    fn go(&mut self, shared: &Shared, pan: f64, tilt: f64) {
        self.shot = shared.shot_at(pan, tilt);
        self.at = match self.shot {
            Some(i) => PtzPosition { pan: shared.shots[i].pan, tilt: shared.shots[i].tilt, zoom: shared.shots[i].zoom },
            None => PtzPosition { pan, tilt, zoom: shared.shots[0].zoom },
        };
        self.next.fill(0);
    }
}

/// The recorded head: it is where it is sent at once, and reads what was read there.
#[derive(Debug)]
pub struct RecordingHead(Arc<Shared>);

impl PanTiltZoom for RecordingHead {
    fn capabilities(&self) -> PtzCapabilities {
        let info = &self.0.info;
        PtzCapabilities {
            pan_range: info.pan_range,
            tilt_range: info.tilt_range,
            pan_step: info.pan_step,
            tilt_step: info.tilt_step,
            reports_motion: true,
            reports_position: true,
            ..PtzCapabilities::default()
        }
    }

    fn identity(&mut self) -> Result<Identity> {
        Ok(Identity { protocol: "recording".into(), ..Identity::default() })
    }

    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        if let Some(index) = [pan, tilt].iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "pan, tilt", index });
        }
        self.0.state().go(&self.0, pan, tilt);
        Ok(())
    }

    fn position(&mut self) -> Result<PtzPosition> {
        Ok(self.0.state().at)
    }

    fn motion(&mut self) -> Result<Motion> {
        Ok(Motion::Idle)
    }

    fn stop(&mut self) -> Result<()> {
        Ok(())
    }
}

/// The recorded laser: it chooses which pictures come.
#[derive(Debug)]
pub struct RecordingLaser(Arc<Shared>);

impl Laser for RecordingLaser {
    fn set(&mut self, on: bool) -> Result<()> {
        let mut state = self.0.state();
        state.lit = on;
        state.next.fill(0);
        Ok(())
    }
}

/// The recorded frames of a camera; where more are asked for than were recorded they come again.
#[derive(Debug)]
pub struct RecordingFrames {
    shared: Arc<Shared>,
    camera: usize,
}

impl FrameSource for RecordingFrames {
    /// # Errors
    /// `NotFound` where nothing was recorded.
    fn next_frame(&mut self, not_before: f64, _timeout: f64, frame: &mut Frame) -> Result<()> {
        let shared = &self.shared;
        let mut state = shared.state();
        let Some(shot) = state.shot else {
            let PtzPosition { pan, tilt, .. } = state.at;
            return Err(Error::NotFound {
                reason: format!("nothing was recorded at pan {pan:.4}, tilt {tilt:.4} rad"),
            });
        };
        let pictures = &shared.shots[shot].cameras[self.camera];
        let names = if state.lit { &pictures.on } else { &pictures.off };
        let name = &names[state.next[self.camera] % names.len()];
        frame.image = read_frame(&shared.folder.join(name), shared.info.cameras[self.camera])?;
        state.next[self.camera] += 1;
        frame.timestamp = if not_before.is_finite() { state.now.max(not_before) } else { state.now };
        state.now = frame.timestamp + PERIOD;
        Ok(())
    }
}

/// A picture, or the bare samples of one of the camera's size.
fn read_frame(path: &Path, (width, height): (u32, u32)) -> Result<Image> {
    let format = match path.extension().and_then(|e| e.to_str()) {
        Some("yuyv") => PixelFormat::Yuyv,
        Some("nv12") => PixelFormat::Nv12,
        Some("i420") => PixelFormat::I420,
        _ => return read_picture(path),
    };
    // Both sides are at most 2^16.
    let bytes = |plane| format.row_bytes(plane, width).map_or(0, |n| n * format.rows(plane, height));
    let needed: usize = (0..format.planes()).map(bytes).sum();
    let data = read_bounded(path, needed as u64)?;
    if data.len() != needed {
        let reason = format!("{} bytes, {needed} are needed for {width} x {height}", data.len());
        return Err(Error::FileFormat { path: path.display().to_string(), reason });
    }
    Ok(Image { format, width, height, data })
}

struct RecordingClock(Arc<Shared>);

impl Clock for RecordingClock {
    fn now(&self) -> f64 {
        self.0.state().now
    }

    fn sleep(&self, seconds: f64) {
        if seconds > 0.0 && seconds.is_finite() {
            self.0.state().now += seconds;
        }
    }
}
