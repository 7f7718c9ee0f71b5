//! Angle maps
//!
//! Some heads count in numbers of their own, such as ONVIF's generic space from -1 to 1, which have no
//! angles. A map says which angles they are. It is learned once (ptzcal_learn_angles), kept in a file,
//! and set in the options of a rig or head, which then speaks radians.

use super::args::{Out, number, string};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, borrow_optional, free};
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::device::{MappedPtz, PanTiltZoom};
use crate::error::{Error, Result};
use crate::format::{AngleMapRecord, read_angle_map, write_angle_map};
use crate::geometry::AngleMap;
use std::ffi::c_char;
use std::path::Path;

/// Which angles a head's numbers are. Immutable: any number of threads may read it.
pub struct ptzcal_angle_map(pub(super) AngleMapRecord);

impl Handle for ptzcal_angle_map {
    const NAME: &'static str = "map";
}

/// What a map covers, and how well it was learned.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_angle_summary {
    /// Set by ptzcal_angle_summary_init.
    pub struct_size: u32,
    /// Pictures that it was learned from; 0: it was made by other means, and the numbers of the learning
    /// are 0.
    pub frames: u32,
    /// Pairs of pictures that were matched.
    pub pairs: u32,
    /// 0.
    pub reserved: u32,
    /// The device's numbers that are covered: least and greatest pan, least and greatest tilt.
    pub raw: [f64; 4],
    /// The angles that are covered, radians: least and greatest pan, least and greatest tilt.
    pub angles: [f64; 4],
    /// How the camera sits on the axes, radians: collimation, roll, trunnion (as a theodolite's).
    pub mounting: [f64; 3],
    /// Standard deviations of the mounting, radians.
    pub mounting_sigma: [f64; 3],
    /// Root mean square of the matches' residuals, px.
    pub rms: f64,
    /// Share of the matches that agreed with nothing.
    pub outliers: f64,
    /// How far the head is from the map each time, radians (standard deviation): pan, tilt.
    pub repeatability: [f64; 2],
    /// Which share of a turn the camera's distance from the axes looks like; 0.01 is 1 degree of 100.
    pub parallax: f64,
    /// Standard deviation of the parallax.
    pub parallax_sigma: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_angle_summary {
    const NAME: &'static str = "summary";
    const FIRST_SIZE: usize = 16 + 20 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            frames: 0,
            pairs: 0,
            reserved: 0,
            raw: [0.0; 4],
            angles: [0.0; 4],
            mounting: [0.0; 3],
            mounting_sigma: [0.0; 3],
            rms: 0.0,
            outliers: 0.0,
            repeatability: [0.0; 2],
            parallax: 0.0,
            parallax_sigma: 0.0,
        }
    }
}

/// Sets up a summary: everything 0.
///
/// @param summary The struct.
/// @param size    sizeof *summary.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_angle_summary_init(summary: *mut ptzcal_angle_summary, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(summary, size) })
}

/// Reads a map's file.
///
/// @param path  The file.
/// @param map   Receives the map; free it with ptzcal_angle_map_free.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO, _FILE_FORMAT, _FILE_VERSION.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_angle_map_read(
    path: *const c_char,
    map: *mut *mut ptzcal_angle_map,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, path) = unsafe { (HandleOut::new(map)?, string(path, "path")?) };
        out.give(ptzcal_angle_map(read_angle_map(Path::new(path))?));
        Ok(())
    })
}

/// Writes a map as JSON, with the residuals of its learning. The file is at every moment the old one
/// or the whole new one.
///
/// @param map   The map.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_DISK_FULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_angle_map_save(
    map: *const ptzcal_angle_map,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, path) = unsafe { (borrow(map)?, string(path, "path")?) };
        write_angle_map(Path::new(path), &map.0)
    })
}

/// Frees a map. Options that it was set in keep what they need of it.
///
/// @param map The map; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_angle_map_free(map: *mut ptzcal_angle_map) {
    // SAFETY: NULL or a live map that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(map) });
}

/// What the map covers, and how well it was learned.
///
/// @param map     The map.
/// @param summary Receives the summary; set up by ptzcal_angle_summary_init.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_angle_map_get_summary(
    map: *const ptzcal_angle_map,
    summary: *mut ptzcal_angle_summary,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, out) = unsafe { (borrow(map)?, SizedOut::new(summary)?) };
        let (m, learned) = (&map.0.map, map.0.learned.as_ref());
        let both = |pan: [f64; 2], tilt: [f64; 2]| [pan[0], pan[1], tilt[0], tilt[1]];
        let mut summary = ptzcal_angle_summary {
            raw: both(m.pan.raw_range(), m.tilt.raw_range()),
            angles: both(m.pan.angle_range(), m.tilt.angle_range()),
            mounting: [m.mounting.collimation, m.mounting.roll, m.mounting.trunnion],
            mounting_sigma: m.mounting_sigma,
            ..SizedStruct::initial()
        };
        if let Some(learned) = learned {
            summary.frames = learned.frames.len() as u32;
            summary.pairs = learned.pairs.len() as u32;
            summary.rms = learned.rms;
            summary.outliers = learned.outliers;
            summary.repeatability = learned.repeatability;
            summary.parallax = learned.parallax;
            summary.parallax_sigma = learned.parallax_sigma;
        }
        out.write(&summary);
        Ok(())
    })
}

/// Angles of a head's numbers.
///
/// @param map        The map.
/// @param raw_pan    The device's number.
/// @param raw_tilt   The device's number.
/// @param pan        Receives radians, positive right.
/// @param tilt       Receives radians, positive up.
/// @param pan_sigma  Receives the standard deviation of pan, radians; may be NULL.
/// @param tilt_sigma Receives the standard deviation of tilt, radians; may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE or PTZCAL_STATUS_INVALID_ARGUMENT for numbers that
///         the map does not cover.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_angle_map_to_angles(
    map: *const ptzcal_angle_map,
    raw_pan: f64,
    raw_tilt: f64,
    pan: *mut f64,
    tilt: *mut f64,
    pan_sigma: *mut f64,
    tilt_sigma: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let raw = [number(raw_pan, "raw_pan")?, number(raw_tilt, "raw_tilt")?];
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, pan, tilt) = unsafe { (borrow(map)?, Out::new(pan, "pan")?, Out::new(tilt, "tilt")?) };
        // SAFETY: the caller keeps the header's rules for pointers.
        let sigmas = unsafe { [Out::optional(pan_sigma, "pan_sigma")?, Out::optional(tilt_sigma, "tilt_sigma")?] };
        let m = &map.0.map;
        let angles = m.angles(raw)?;
        let values = [m.pan.sigma(raw[0])?, m.tilt.sigma(raw[1])?];
        pan.write(angles[0]);
        tilt.write(angles[1]);
        for (out, value) in sigmas.into_iter().zip(values) {
            if let Some(out) = out {
                out.write(value);
            }
        }
        Ok(())
    })
}

/// A head's numbers of angles.
///
/// @param map      The map.
/// @param pan      Radians, positive right.
/// @param tilt     Radians, positive up.
/// @param raw_pan  Receives the device's number.
/// @param raw_tilt Receives the device's number.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE or PTZCAL_STATUS_INVALID_ARGUMENT for angles that
///         the map does not cover.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_angle_map_to_raw(
    map: *const ptzcal_angle_map,
    pan: f64,
    tilt: f64,
    raw_pan: *mut f64,
    raw_tilt: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let angles = [number(pan, "pan")?, number(tilt, "tilt")?];
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, out) = unsafe { (borrow(map)?, [Out::new(raw_pan, "raw_pan")?, Out::new(raw_tilt, "raw_tilt")?]) };
        let raw = map.0.map.raw(angles)?;
        out.into_iter().zip(raw).for_each(|(out, value)| out.write(value));
        Ok(())
    })
}

/// A copy of the map of options, none for NULL.
///
/// # Safety
/// `map` is NULL or a live map.
pub(super) unsafe fn map_of(map: *const ptzcal_angle_map) -> Option<AngleMap> {
    // SAFETY: by this function's contract.
    unsafe { borrow_optional(map) }.map(|map| map.0.map.clone())
}

/// The head in radians.
pub(super) fn mapped(ptz: Box<dyn PanTiltZoom>, map: Option<&AngleMap>) -> Result<Box<dyn PanTiltZoom>> {
    match map {
        None => Ok(ptz),
        Some(map) => {
            MappedPtz::new(ptz, map.clone()).map(|head| Box::new(head) as Box<dyn PanTiltZoom>).map_err(|error| {
                match error {
                    Error::InvalidArgument { reason, .. } => Error::invalid("angle map", reason),
                    other => other,
                }
            })
        }
    }
}
