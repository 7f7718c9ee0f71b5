//! Probing devices
//!
//! What a device really is and does: limits, speeds, repeatability, backlash, latencies, and whether what
//! it reports is true. It is moved a little, and watched.

use super::args::{BufferOut, flag};
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::cancel::ptzcal_cancel;
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, free};
use super::head_options::ptzcal_head_options;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::device::LaserLimits;
use crate::error::{Error, Result};
use crate::probe::{Figure, Measured, ProbeOptions, ProbeParts, ProbeReport, probe};
use crate::rig::LaserControl;
use std::ffi::c_char;

/// How a device is probed.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_probe_options {
    /// Set by ptzcal_probe_options_init.
    pub struct_size: u32,
    /// Returns to a place from each side, 2 to 100; the default is 5.
    pub repeats: u32,
    /// 1: go to the four limits of the reported range, too; the default is 0.
    pub reach_limits: u32,
    /// 1: switch the laser, where the options name one, for a second at most; the default is 0.
    pub toggle_laser: u32,
    /// Size of the moves, share of each axis's range, 0.005 to 0.4; the default is 0.1.
    pub amplitude: f64,
    /// Longest time, seconds: what is not measured then stays open; the default is 300.
    pub max_time: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_probe_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 16 + 2 * 8;
    fn initial() -> Self {
        let o = ProbeOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            repeats: o.repeats,
            reach_limits: o.reach_limits.into(),
            toggle_laser: o.toggle_laser.into(),
            amplitude: o.amplitude,
            max_time: o.max_time,
        }
    }
}

/// A figure that was measured.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_figure {
    /// Set by ptzcal_figure_init.
    pub struct_size: u32,
    /// Measurements that it comes from.
    pub count: u32,
    /// Radians (the device's own numbers where it knows no angles), radians per second, pixels, seconds,
    /// frames; 1 or 0 for yes and no.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_figure {
    const NAME: &'static str = "figure";
    const FIRST_SIZE: usize = 24;
    fn initial() -> Self {
        Self { struct_size: size_of::<Self>() as u32, count: 0, value: 0.0, sigma: 0.0 }
    }
}

/// What is measured of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_probe_figure {
    /// Least pan that was reached, as read; with reach_limits.
    PanMin = 0,
    /// Greatest pan that was reached.
    PanMax = 1,
    /// Least tilt that was reached.
    TiltMin = 2,
    /// Greatest tilt that was reached.
    TiltMax = 3,
    /// Greatest speed of moves in pan.
    PanSpeed = 4,
    /// Greatest speed of moves in tilt.
    TiltSpeed = 5,
    /// From a move's command to the first reading that differs, seconds.
    StartLatency = 6,
    /// How long a call for the position takes, seconds.
    PositionTime = 7,
    /// 1: readings follow the head; 0: they repeat the command.
    PositionFollows = 8,
    /// Greatest distance of a settled pan reading from its target.
    PanError = 9,
    /// Greatest distance of a settled tilt reading from its target.
    TiltError = 10,
    /// Standard deviation of settled pan readings on returns from one side.
    PanReadingRepeatability = 11,
    /// The same of tilt.
    TiltReadingRepeatability = 12,
    /// The same of the picture across, pixels.
    PanRepeatabilityPx = 13,
    /// The same of the picture up and down, pixels.
    TiltRepeatabilityPx = 14,
    /// The same as an angle of pan; with a camera.
    PanRepeatability = 15,
    /// The same as an angle of tilt; with a camera.
    TiltRepeatability = 16,
    /// How far the picture is apart when a place is reached from above and from below, pixels; positive
    /// when the head lags behind.
    PanBacklashPx = 17,
    /// The same of tilt.
    TiltBacklashPx = 18,
    /// The same as an angle of pan; with a camera.
    PanBacklash = 19,
    /// The same as an angle of tilt; with a camera.
    TiltBacklash = 20,
    /// Smallest commanded move of pan that the readings show.
    PanSmallestMove = 21,
    /// Smallest commanded move of tilt that the readings show.
    TiltSmallestMove = 22,
    /// How far the head moves on after a stop, by its readings.
    StopDistance = 23,
    /// How long it moves on after a stop, seconds.
    StopTime = 24,
    /// How long the picture moves on after the device reports arrival, seconds.
    MovesAfterArrival = 25,
    /// 1: the head stands (but for its swing) when the device says so; 0: it does not.
    ArrivalHonest = 26,
    /// Time between frames, seconds.
    FrameInterval = 27,
    /// From the start of a frame's exposure to its delivery, seconds.
    FrameAge = 28,
    /// From a move's command to the delivery of the first frame that shows it, seconds.
    VisibleAfter = 29,
    /// The same in frames.
    VisibleAfterFrames = 30,
    /// From switching the laser to the delivery of the first frame that shows it, seconds.
    LaserVisibleAfter = 31,
    /// The same in frames.
    LaserVisibleAfterFrames = 32,
    /// How long probing took, seconds.
    Duration = 33,
}

/// What was found out about a device. Immutable: any number of threads may read it.
pub struct ptzcal_probe_report(ProbeReport);

impl Handle for ptzcal_probe_report {
    const NAME: &'static str = "report";
}

impl ptzcal_probe_report {
    fn figure(&self, which: u32) -> Option<Figure> {
        let r = &self.0;
        let truth = |answer: &std::result::Result<bool, String>| {
            answer.clone().map(|yes| Measured { value: f64::from(u8::from(yes)), sigma: 0.0, count: 1 })
        };
        // In the enum's order.
        let figures = [
            r.limits[0].clone(),
            r.limits[1].clone(),
            r.limits[2].clone(),
            r.limits[3].clone(),
            r.speed[0].clone(),
            r.speed[1].clone(),
            r.start_latency.clone(),
            r.position_time.clone(),
            truth(&r.position_follows),
            r.position_error[0].clone(),
            r.position_error[1].clone(),
            r.reading_repeatability[0].clone(),
            r.reading_repeatability[1].clone(),
            r.picture_repeatability_px[0].clone(),
            r.picture_repeatability_px[1].clone(),
            r.picture_repeatability[0].clone(),
            r.picture_repeatability[1].clone(),
            r.backlash_px[0].clone(),
            r.backlash_px[1].clone(),
            r.backlash[0].clone(),
            r.backlash[1].clone(),
            r.smallest_move[0].clone(),
            r.smallest_move[1].clone(),
            r.stop_distance.clone(),
            r.stop_time.clone(),
            r.moves_after_arrival.clone(),
            truth(&r.arrival_honest),
            r.frame_interval.clone(),
            r.frame_age.clone(),
            r.visible_after.clone(),
            r.visible_after_frames.clone(),
            r.laser_visible_after.clone(),
            r.laser_visible_after_frames.clone(),
            Ok(Measured { value: r.duration, sigma: 0.0, count: 1 }),
        ];
        figures.into_iter().nth(which as usize)
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
pub unsafe extern "C" fn ptzcal_probe_options_init(options: *mut ptzcal_probe_options, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Sets up a figure: everything 0.
///
/// @param figure The struct.
/// @param size   sizeof *figure.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_figure_init(figure: *mut ptzcal_figure, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(figure, size) })
}

/// Finds out what a device is and does. It takes some minutes at most. The head stays within a part of
/// its range about where it stands (unless the limits are asked for) and comes back; it is stopped on
/// every way out that is an error.
///
/// @param head    The head's options: the head, and where they are set its camera's frames and its laser.
/// @param camera  Lens of the camera on the head, for angles instead of pixels; may be NULL.
/// @param options How; may be NULL: the defaults.
/// @param token   Stops the work from another thread; may be NULL.
/// @param report  Receives the report; free it with ptzcal_probe_report_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK, also when some figures could not be had: the report says why;
///         PTZCAL_STATUS_CANCELLED; PTZCAL_STATUS_INVALID_ARGUMENT; those of ptzcal_head_open and a
///         device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_probe(
    head: *const ptzcal_head_options,
    camera: *const ptzcal_camera,
    options: *const ptzcal_probe_options,
    token: *const ptzcal_cancel,
    report: *mut *mut ptzcal_probe_report,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, head, token) = unsafe { (HandleOut::new(report)?, borrow(head)?, ptzcal_cancel::share(token)) };
        // SAFETY: the caller keeps the header's rules for pointers.
        let camera = if camera.is_null() { None } else { Some(unsafe { camera_in(camera)? }) };
        // SAFETY: the caller keeps the header's rules for pointers.
        let o: ptzcal_probe_options =
            if options.is_null() { SizedStruct::initial() } else { unsafe { sized::read(options)? } };
        let options = ProbeOptions {
            amplitude: o.amplitude,
            repeats: o.repeats,
            reach_limits: flag(o.reach_limits, "reach_limits")?,
            toggle_laser: flag(o.toggle_laser, "toggle_laser")?,
            max_time: o.max_time,
            ..ProbeOptions::default()
        };
        let settings = head.0.read("head")?;
        let mut opened = settings.open()?;
        let laser = if options.toggle_laser { settings.open_laser(&opened)? } else { None };
        let (clock, log) = (opened.clock.clone(), settings.log.clone());
        let laser = laser.map(|laser| LaserControl::new(laser, clock, log, &LaserLimits::default())).transpose()?;
        let parts = ProbeParts {
            head: &mut *opened.ptz,
            frames: opened.frames.as_mut().map(|frames| &mut **frames as _),
            laser: laser.as_ref(),
            camera,
            clock: &*opened.clock,
            log: &settings.log,
        };
        out.give(ptzcal_probe_report(probe(parts, &options, &token)?));
        Ok(()) as Result<()>
    })
}

/// A figure of a report.
///
/// @param report The report.
/// @param which  A ptzcal_probe_figure.
/// @param figure Receives the figure; set up by ptzcal_figure_init.
/// @param error  Receives the error, whose message says why there is no figure; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND when it could not be had;
///         PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_probe_report_get(
    report: *const ptzcal_probe_report,
    which: u32,
    figure: *mut ptzcal_figure,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, out) = unsafe { (borrow(report)?, SizedOut::new(figure)?) };
        let found = report.figure(which);
        let found = found.ok_or_else(|| Error::invalid("which", format!("{which} is no ptzcal_probe_figure")))?;
        let Measured { value, sigma, count } = found.map_err(|reason| Error::NotFound { reason })?;
        out.write(&ptzcal_figure { count, value, sigma, ..SizedStruct::initial() });
        Ok(())
    })
}

/// The report as text that a person understands, in UTF-8 without a NUL.
///
/// @param report   The report.
/// @param buffer   Receives the text; may be NULL when capacity is 0.
/// @param capacity Bytes of the buffer.
/// @param needed   Receives the number of bytes; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: needed says the size.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_probe_report_copy_text(
    report: *const ptzcal_probe_report,
    buffer: *mut c_char,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, out) = unsafe { (borrow(report)?, BufferOut::new(buffer.cast::<u8>(), capacity, needed)?) };
        out.write(report.0.to_string().as_bytes())
    })
}

/// Frees a report.
///
/// @param report The report; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_probe_report_free(report: *mut ptzcal_probe_report) {
    // SAFETY: NULL or a live report that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(report) });
}
