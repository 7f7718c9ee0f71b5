//! How a region is scanned
//!
//! Options for ptzcal_rig_scan_region, and the fixed cameras that watch.

use super::args::{Out, number, string, string_optional};
use super::calibration_options::distortion_model;
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::cancel::ptzcal_cancel;
use super::detect::ptzcal_spot_options;
use super::devices::{HostFrames, ptzcal_frame_fn};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::status::ptzcal_status;
use crate::calibrate::DistortionModel;
use crate::device::{Address, Frame, FrameSource, Surroundings, open_frames};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::rig::{FixedCamera, ScanOptions, WholeRig};
use std::ffi::{c_char, c_void};
use std::path::PathBuf;

/// Where a fixed camera's frames come from.
#[derive(Clone)]
enum Source {
    Host(HostFrames),
    /// A fixed camera of the whole rig that the scan runs on: simulated or recorded.
    OfRig(usize),
    Address(Address),
}

#[derive(Clone)]
pub(super) struct Watched {
    source: Source,
    width: u32,
    height: u32,
    known: Option<Camera>,
    distortion: DistortionModel,
}

impl Watched {
    pub fn open(&self, whole: Option<&WholeRig>, around: &Surroundings) -> Result<FixedCamera> {
        let (frames, (width, height)): (Box<dyn FrameSource>, (u32, u32)) = match &self.source {
            Source::Host(frames) => (Box::new(frames.clone()), (self.width, self.height)),
            Source::OfRig(index) => {
                let none = || Error::invalid("address", "a camera of a simulated or recorded rig, which this is not");
                whole.ok_or_else(none)?.fixed_camera(*index)?
            }
            Source::Address(address) => {
                let mut frames = open_frames(address, around)?;
                // What the camera really gives is in its first frame.
                let mut frame = Frame::empty();
                frames.next_frame(around.clock.now(), FIRST_FRAME_TIMEOUT, &mut frame)?;
                (frames, (frame.image.width, frame.image.height))
            }
        };
        Ok(FixedCamera { frames, width, height, known: self.known, distortion: self.distortion })
    }
}

/// Longest wait for the first frame of a fixed camera, seconds.
const FIRST_FRAME_TIMEOUT: f64 = 5.0;

/// How a region is scanned.
pub struct ptzcal_scan_options(pub(super) Exclusive<Settings>);

#[derive(Default)]
pub(super) struct Settings {
    pub(super) options: ScanOptions,
    pub(super) cameras: Vec<Watched>,
}

impl Handle for ptzcal_scan_options {
    const NAME: &'static str = "options";
}

impl ptzcal_scan_options {
    /// Changes settings.
    ///
    /// # Safety
    /// `options` is NULL or live options.
    unsafe fn change<T>(options: *mut Self, change: impl FnOnce(&mut Settings) -> Result<T>) -> Result<T> {
        // SAFETY: by this function's contract.
        change(&mut *unsafe { borrow(options)? }.0.write(Self::NAME)?)
    }
}

impl Settings {
    fn add(&mut self, camera: Watched) -> Result<u32> {
        if self.cameras.len() >= crate::rig::scan::MAX_FIXED_CAMERAS {
            return Err(Error::invalid("options", format!("{} cameras are the most", self.cameras.len())));
        }
        self.cameras.push(camera);
        Ok(self.cameras.len() as u32 - 1)
    }
}

/// Makes options with their defaults: no fixed cameras, one frame per state, no journal.
///
/// @param options Receives the options; free them with ptzcal_scan_options_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_new(
    options: *mut *mut ptzcal_scan_options,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let options = unsafe { HandleOut::new(options)? };
        options.give(ptzcal_scan_options(Exclusive::new(Settings::default())));
        Ok(())
    })
}

/// Frees options.
///
/// @param options The options; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_free(options: *mut ptzcal_scan_options) {
    // SAFETY: NULL or live options that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(options) });
}

/// Adds a fixed camera of the host to those that the scan watches.
///
/// @param options    The options.
/// @param next_frame Hands over a frame, stamped by the rig's clock.
/// @param user       Handed to the callback.
/// @param width      Image size in pixels, 1 to 65536.
/// @param height     Image size in pixels, 1 to 65536.
/// @param index      Receives the camera's number, from 0 in the order of adding; may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NULL_POINTER.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_add_camera(
    options: *mut ptzcal_scan_options,
    next_frame: ptzcal_frame_fn,
    user: *mut c_void,
    width: u32,
    height: u32,
    index: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        for (name, side) in [("width", width), ("height", height)] {
            if !(1..=65536).contains(&side) {
                return Err(Error::invalid(name, format!("{side} is not in 1 to 65536")));
            }
        }
        // SAFETY: the caller keeps the header's rules for pointers and callbacks.
        unsafe {
            let index = IndexOut::new(index)?;
            let source = Source::Host(HostFrames::new(next_frame, user)?);
            let camera = Watched { source, width, height, known: None, distortion: DistortionModel::Radial1 };
            index.write(ptzcal_scan_options::change(options, |o| o.add(camera))?);
        }
        Ok(())
    })
}

/// Adds a fixed camera by its address.
///
/// @param options The options.
/// @param address "sim:fixed/0" or "folder:fixed/0": the first fixed camera of the rig's simulator or
///                recording; "v4l2://...", "onvif://...": a camera of its own (docs/addresses.md).
/// @param index   Receives the camera's number, from 0 in the order of adding; may be NULL.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_add_camera_address(
    options: *mut ptzcal_scan_options,
    address: *const c_char,
    index: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (index, address) = unsafe { (IndexOut::new(index)?, string(address, "address")?) };
        let of_rig = ["sim:", "folder:"].iter().find_map(|scheme| address.strip_prefix(scheme)?.strip_prefix("fixed/"));
        let source = match of_rig {
            Some(number) => Source::OfRig(
                number.parse().map_err(|_| Error::invalid("address", format!("{number:?} is no camera's number")))?,
            ),
            None => Source::Address(Address::parse(address)?),
        };
        let camera = Watched { source, width: 0, height: 0, known: None, distortion: DistortionModel::Radial1 };
        // SAFETY: the caller keeps the header's rules for pointers.
        index.write(unsafe { ptzcal_scan_options::change(options, |o| o.add(camera))? });
        Ok(())
    })
}

/// Where the number of a camera goes, if anywhere.
struct IndexOut(Option<Out<u32>>);

impl IndexOut {
    /// # Safety
    /// `index` is NULL or writable until the call ends.
    unsafe fn new(index: *mut u32) -> Result<Self> {
        // SAFETY: by this function's contract.
        Ok(Self(if index.is_null() { None } else { Some(unsafe { Out::new(index, "index")? }) }))
    }

    fn write(self, index: u32) {
        if let Some(place) = self.0 {
            place.write(index);
        }
    }
}

/// Changes a camera that was added.
///
/// # Safety
/// `options` is NULL or live options.
unsafe fn change_camera(
    options: *mut ptzcal_scan_options,
    index: u32,
    change: impl FnOnce(&mut Watched),
) -> Result<()> {
    // SAFETY: by this function's contract.
    unsafe {
        ptzcal_scan_options::change(options, |o| {
            let count = o.cameras.len();
            let camera = o.cameras.get_mut(index as usize);
            change(camera.ok_or_else(|| Error::invalid("camera", format!("{index} of {count}")))?);
            Ok(())
        })
    }
}

/// Says what is known of a watched camera, so that its spots are looked for in the right place from
/// the first shot.
///
/// @param options The options.
/// @param camera  The camera's number.
/// @param known   The camera, calibrated in the rig's world; may be NULL: nothing is known (the
///                default).
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_known_camera(
    options: *mut ptzcal_scan_options,
    camera: u32,
    known: *const ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let known = if known.is_null() { None } else { Some(camera_in(known)?) };
            change_camera(options, camera, |c| c.known = known)
        }
    })
}

/// Sets the lens model with which a watched camera is calibrated between the two passes.
///
/// @param options The options.
/// @param camera  The camera's number.
/// @param model   A ptzcal_distortion_model; the default is PTZCAL_DISTORTION_MODEL_RADIAL1.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_distortion(
    options: *mut ptzcal_scan_options,
    camera: u32,
    model: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let model = distortion_model(model)?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { change_camera(options, camera, |c| c.distortion = model) }
    })
}

/// Sets how many frames are averaged with the laser off, and with it on.
///
/// @param options The options.
/// @param frames  1 to 256; the default is 1.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_frames_per_state(
    options: *mut ptzcal_scan_options,
    frames: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        if !(1..=256).contains(&frames) {
            return Err(Error::invalid("frames", format!("{frames} is not in 1 to 256")));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_scan_options::change(options, |o| {
                o.options.frames_per_state = frames;
                Ok(())
            })
        }
    })
}

/// Sets about how many positions the coarse pass takes.
///
/// @param options The options.
/// @param shots   The default is 80; 0: no coarse pass.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_coarse_shots(
    options: *mut ptzcal_scan_options,
    shots: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_scan_options::change(options, |o| {
                o.options.coarse_shots = shots;
                Ok(())
            })
        }
    })
}

/// Ends a scan once every fixed camera's position is expected to be known well enough, by the covariance
/// of its calibration from the shots so far; the rig is taken as exact. Positions are then visited in
/// eight passes over the region, so that a scan that ends early has covered it. Such a scan is not complete
/// (ptzcal_scan_summary), and ptzcal_scan_end is PTZCAL_STATUS_OK.
///
/// @param options The options.
/// @param metres  Root mean square error of the position; 0, the default: the whole region is scanned.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a negative one.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_target_accuracy(
    options: *mut ptzcal_scan_options,
    metres: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let metres = number(metres, "metres")?;
        if metres < 0.0 {
            return Err(Error::invalid("metres", format!("{metres} is negative")));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_scan_options::change(options, |o| {
                o.options.target_accuracy = metres;
                Ok(())
            })
        }
    })
}

/// Sets how long a device that is gone (unplugged, switched off) is waited for; the drivers of the
/// library open theirs again when it is back. The laser is off meanwhile.
///
/// @param options The options.
/// @param seconds 0 to 86400; the default is 0: the scan ends at once, and its journal keeps what it
///                has.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_reconnect(
    options: *mut ptzcal_scan_options,
    seconds: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        if !(0.0..=86_400.0).contains(&number(seconds, "seconds")?) {
            return Err(Error::invalid("seconds", format!("{seconds} is not in 0 to 86400")));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_scan_options::change(options, |o| {
                o.options.reconnect = seconds;
                Ok(())
            })
        }
    })
}

/// Sets how spots are found; region and band of the spot options are set by the scan.
///
/// @param options The options.
/// @param spot    The spot options, copied; may be NULL: the defaults.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_spot(
    options: *mut ptzcal_scan_options,
    spot: *const ptzcal_spot_options,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let spot = ptzcal_spot_options::settings(spot)?;
            ptzcal_scan_options::change(options, |o| {
                o.options.spot = spot;
                Ok(())
            })
        }
    })
}

/// Sets where spots can be: the depths of the scene, and how far from its predicted place a spot may
/// be.
///
/// @param options     The options.
/// @param nearest     Metres along the head camera's axis, positive; the default is 0.3.
/// @param farthest    Metres; the default is 100.
/// @param half_width  Half the width of the bands that are searched, pixels; the default is 16: the
///                    spot with its halo has to fit in.
/// @param model_sigma Standard deviation of the rig model's errors in its images, pixels; the default
///                    is 1.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; the scan refuses values that make no sense.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_gate(
    options: *mut ptzcal_scan_options,
    nearest: f64,
    farthest: f64,
    half_width: f64,
    model_sigma: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let depth_range = [number(nearest, "nearest")?, number(farthest, "farthest")?];
        let (half_width, model_sigma) = (number(half_width, "half_width")?, number(model_sigma, "model_sigma")?);
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_scan_options::change(options, |o| {
                let gate = &mut o.options.gate;
                gate.depth_range = depth_range;
                gate.half_width = half_width;
                gate.model_sigma = model_sigma;
                Ok(())
            })
        }
    })
}

/// Sets the journal: each shot is in it before it is reported. When the file is there and belongs to
/// the same scan, the scan goes on from it; a file that is no journal is never touched.
///
/// @param options The options.
/// @param path    The file; may be NULL: none (the default).
/// @param sync    1: wait for the disk at each shot, so that a power cut loses none either; 0: do not.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_journal(
    options: *mut ptzcal_scan_options,
    path: *const c_char,
    sync: i32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let sync = super::simulator::switch(sync)?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let path = string_optional(path, "path")?.map(PathBuf::from);
            ptzcal_scan_options::change(options, |o| {
                o.options.journal = path;
                o.options.journal_sync = sync;
                Ok(())
            })
        }
    })
}

/// Sets a folder where all frames of the scan are written, so that it can be scanned again without the
/// rig: open it as "folder:///path". A scan of the same region by the same rig goes on with what is
/// recorded there already; a folder with anything else in it is never touched. docs/recordings.md
/// tells the format.
///
/// @param options The options.
/// @param path    The folder; may be NULL: none (the default).
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_recording(
    options: *mut ptzcal_scan_options,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let path = string_optional(path, "path")?.map(PathBuf::from);
            ptzcal_scan_options::change(options, |o| {
                o.options.record = path;
                Ok(())
            })
        }
    })
}

/// Sets the token that stops the scan.
///
/// @param options The options.
/// @param token   The token; may be NULL: none (the default). It may be freed before the options.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_options_set_cancel(
    options: *mut ptzcal_scan_options,
    token: *const ptzcal_cancel,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let token = ptzcal_cancel::share(token);
            ptzcal_scan_options::change(options, |o| {
                o.options.cancel = token;
                Ok(())
            })
        }
    })
}
