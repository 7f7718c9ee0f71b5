//! Learning angles
//!
//! What the numbers of a head without angles mean is found out by turning its camera over a scene with
//! texture: how far the pictures turn tells the angles. The camera's lens has to be known.

use super::angle_map::ptzcal_angle_map;
use super::call::{ErrorOut, guard};
use super::camera::{camera_in, ptzcal_camera};
use super::cancel::ptzcal_cancel;
use super::error::ptzcal_error;
use super::handle::{HandleOut, borrow};
use super::head_options::ptzcal_head_options;
use super::log::User;
use super::progress::{ptzcal_progress, ptzcal_progress_fn};
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::angle_learning::{AngleLearningOptions, LearningParts, learn_angles};
use crate::error::{Error, Result};
use std::ffi::c_void;
use std::ops::ControlFlow;
use std::time::Instant;

/// How angles are learned.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_angle_learning_options {
    /// Set by ptzcal_angle_learning_options_init.
    pub struct_size: u32,
    /// Least number of positions of an axis, 3 to 256; the default is 7.
    pub min_positions: u32,
    /// Most pictures, 9 to 1000; the default is 400.
    pub max_frames: u32,
    /// 0.
    pub reserved: u32,
    /// Share of the picture by which neighbouring pictures are apart; the default is 0.3.
    pub step: f64,
    /// Nearest distance of what is seen, metres; the default is 2.
    pub scene_nearest: f64,
    /// Farthest distance of what is seen, metres; the default is 100.
    pub scene_farthest: f64,
    /// How far the camera's centre is from the axes, metres, as a rig model's tilt_y, tilt_z, pan_x, pan_z;
    /// the default is 0, 0.02, 0, 0.02.
    pub levers: [f64; 4],
    /// Standard deviation of the levers, metres; the default is 0.015.
    pub lever_sigma: f64,
    /// Least share of each axis's range that must be learned; the default is 0.5.
    pub min_cover: f64,
    /// Greatest root mean square of the residuals, px; the default is 2.
    pub max_rms: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_angle_learning_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 16 + 10 * 8;
    fn initial() -> Self {
        let o = AngleLearningOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            min_positions: o.min_positions as u32,
            max_frames: o.max_frames as u32,
            reserved: 0,
            step: o.step,
            scene_nearest: o.scene[0],
            scene_farthest: o.scene[1],
            levers: o.levers,
            lever_sigma: o.lever_sigma,
            min_cover: o.min_cover,
            max_rms: o.max_rms,
        }
    }
}

impl From<&ptzcal_angle_learning_options> for AngleLearningOptions {
    fn from(o: &ptzcal_angle_learning_options) -> Self {
        Self {
            step: o.step,
            min_positions: o.min_positions as usize,
            max_frames: o.max_frames as usize,
            scene: [o.scene_nearest, o.scene_farthest],
            levers: o.levers,
            lever_sigma: o.lever_sigma,
            min_cover: o.min_cover,
            max_rms: o.max_rms,
            ..Self::default()
        }
    }
}

/// Sets up options with their defaults.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_angle_learning_options_init(
    options: *mut ptzcal_angle_learning_options,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Turns a head over its range and learns which angles its numbers are. It takes some minutes. Zoom stays
/// as it is: the camera must be the lens's at this zoom. The head is stopped on every way out that is an
/// error.
///
/// @param head     The head's options: the head, and its camera's frames.
/// @param camera   The lens of the camera on the head; its pose does not matter.
/// @param options  How; may be NULL: the defaults.
/// @param progress Hears of each picture; may be NULL.
/// @param user     Handed to the callback.
/// @param token    Stops the work from another thread; may be NULL.
/// @param map      Receives the map; free it with ptzcal_angle_map_free.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND without texture, and when the picture does not turn;
///         PTZCAL_STATUS_TOO_FEW_POINTS when pictures have too little in common; PTZCAL_STATUS_AMBIGUOUS
///         for an axis that turns both ways; PTZCAL_STATUS_NO_CONSENSUS for a camera that does not turn
///         about two axes; PTZCAL_STATUS_DEGENERATE; PTZCAL_STATUS_CANCELLED;
///         PTZCAL_STATUS_INVALID_ARGUMENT; those of ptzcal_head_open and a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_learn_angles(
    head: *const ptzcal_head_options,
    camera: *const ptzcal_camera,
    options: *const ptzcal_angle_learning_options,
    progress: ptzcal_progress_fn,
    user: *mut c_void,
    token: *const ptzcal_cancel,
    map: *mut *mut ptzcal_angle_map,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, head, camera, token) =
            unsafe { (HandleOut::new(map)?, borrow(head)?, camera_in(camera)?, ptzcal_cancel::share(token)) };
        // SAFETY: the caller keeps the header's rules for pointers.
        let options = if options.is_null() { SizedStruct::initial() } else { unsafe { sized::read(options)? } };
        let settings = head.0.read("head")?;
        let mut opened = settings.open()?;
        let frames = opened.frames.as_deref_mut();
        let frames = frames.ok_or_else(|| Error::invalid("head", "no frames: set their address or the callback"))?;
        let mut parts =
            LearningParts { head: &mut *opened.ptz, frames, camera, clock: &*opened.clock, log: &settings.log };
        let (begin, user) = (Instant::now(), User::new(user));
        let mut report = |p: &crate::angle_learning::LearningProgress| {
            let Some(progress) = progress else { return ControlFlow::Continue(()) };
            let told = ptzcal_progress {
                struct_size: size_of::<ptzcal_progress>() as u32,
                pass: 1,
                passes: 1,
                measured: 1,
                done: p.frames as u64,
                total: p.total as u64,
                elapsed: begin.elapsed().as_secs_f64(),
                seconds_left: -1.0,
                shot: std::ptr::null(),
            };
            // SAFETY: the caller keeps the header's rules for callbacks.
            unsafe { told.tell(progress, user) }
        };
        let learned = learn_angles(&mut parts, &(&options).into(), &token, &mut report)?;
        out.give(ptzcal_angle_map(learned.record()));
        Ok(()) as Result<()>
    })
}
