//! Detecting the laser's spot
//!
//! Takes frames with the laser on and, much better, frames of the same view with it off. No rig is
//! needed. The answer is a spot with its covariance, or PTZCAL_STATUS_NOT_FOUND or
//! PTZCAL_STATUS_AMBIGUOUS: never a guess.

use super::args::{number, vectors};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, borrow_optional, free};
use super::image::{ptzcal_image, view, views};
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::detect::spot::{Band, LaserColour, Region, Spot, SpotOptions, detect_spot};
use crate::error::{Error, Result};
use crate::image::ImageView;

/// Colours of the laser: the values of ptzcal_spot_options_set_colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_laser_colour {
    /// Whichever channel differs most between on and off.
    Unknown = 0,
    Red = 1,
    Green = 2,
    Blue = 3,
    /// Infrared, or a monochrome camera: all channels alike.
    White = 4,
}

/// A spot found.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_spot {
    /// Set by ptzcal_spot_init.
    pub struct_size: u32,
    /// 1 when pixels of the spot are at the sensor's limit, else 0.
    pub saturated: u32,
    /// Centre, pixels; (0, 0) is the centre of the top-left pixel.
    pub x: f64,
    /// Centre, pixels.
    pub y: f64,
    /// Covariance of the centre, px^2: xx, xy, yy.
    pub covariance: [f64; 3],
    /// Greatest difference between on and off, grey levels (0 to 255).
    pub peak: f64,
    /// Summed signal over its standard deviation under the frames' noise.
    pub signal_to_noise: f64,
    /// Pixels above the threshold.
    pub area: u64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_spot {
    const NAME: &'static str = "spot";
    const FIRST_SIZE: usize = 8 + 8 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            saturated: 0,
            x: 0.0,
            y: 0.0,
            covariance: [0.0; 3],
            peak: 0.0,
            signal_to_noise: 0.0,
            area: 0,
        }
    }
}

impl From<&Spot> for ptzcal_spot {
    fn from(spot: &Spot) -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            saturated: spot.saturated.into(),
            x: spot.x,
            y: spot.y,
            covariance: spot.covariance,
            peak: spot.peak,
            signal_to_noise: spot.signal_to_noise,
            area: spot.area.into(),
        }
    }
}

/// How a spot is searched.
pub struct ptzcal_spot_options(Exclusive<SpotOptions>);

impl Handle for ptzcal_spot_options {
    const NAME: &'static str = "options";
}

impl ptzcal_spot_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or live options.
    pub(super) unsafe fn settings(options: *const Self) -> Result<SpotOptions> {
        // SAFETY: by this function's contract.
        let options = unsafe { borrow_optional(options) };
        options.map_or_else(|| Ok(SpotOptions::default()), |o| Ok(o.0.read(Self::NAME)?.clone()))
    }

    /// Changes one setting.
    ///
    /// # Safety
    /// `options` is NULL or live options.
    unsafe fn change(options: *mut Self, change: impl FnOnce(&mut SpotOptions)) -> Result<()> {
        // SAFETY: by this function's contract.
        change(&mut *unsafe { borrow(options)? }.0.write(Self::NAME)?);
        Ok(())
    }
}

fn colour(value: u32) -> Result<LaserColour> {
    [LaserColour::Unknown, LaserColour::Red, LaserColour::Green, LaserColour::Blue, LaserColour::White]
        .into_iter()
        .find(|c| *c as u32 == value)
        .ok_or_else(|| Error::invalid("colour", format!("{value} is no laser colour")))
}

/// Sets up a spot: everything 0.
///
/// @param spot The struct.
/// @param size sizeof *spot.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_init(spot: *mut ptzcal_spot, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(spot, size) })
}

/// Makes options with their defaults: the whole image, any colour, a signal-to-noise ratio of 8.
///
/// @param options Receives the options; free them with ptzcal_spot_options_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_options_new(
    options: *mut *mut ptzcal_spot_options,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let options = unsafe { HandleOut::new(options)? };
        options.give(ptzcal_spot_options(Exclusive::new(SpotOptions::default())));
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
pub unsafe extern "C" fn ptzcal_spot_options_free(options: *mut ptzcal_spot_options) {
    // SAFETY: NULL or live options that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(options) });
}

/// Searches only a rectangle: columns x to x + width - 1, rows y to y + height - 1. With a band set
/// as well, both must hold.
///
/// @param options The options.
/// @param x       First column.
/// @param y       First row.
/// @param width   Columns, at least 1.
/// @param height  Rows, at least 1.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_options_set_region(
    options: *mut ptzcal_spot_options,
    x: u32,
    y: u32,
    width: u32,
    height: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        if width == 0 || height == 0 || x.checked_add(width).is_none() || y.checked_add(height).is_none() {
            return Err(Error::invalid("region", format!("{width} x {height} at ({x}, {y})")));
        }
        let region = Region { x, y, width, height };
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_spot_options::change(options, |o| o.region = Some(region)) }
    })
}

/// Searches only a band about a line of pixels, such as the epipolar line on which the laser's spot
/// must lie. The line may bend, as epipolar lines do behind a lens.
///
/// @param options    The options.
/// @param polyline   n x 2 numbers: corners of the line, pixels.
/// @param n          Number of corners, at least 2.
/// @param half_width Greatest distance from the line, pixels, positive.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the corner).
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_options_set_band(
    options: *mut ptzcal_spot_options,
    polyline: *const f64,
    n: usize,
    half_width: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let polyline = unsafe { vectors::<2>(polyline, n, "polyline")? }.to_vec();
        if polyline.len() < 2 {
            return Err(Error::invalid("polyline", format!("{n} corners make no line")));
        }
        let half_width = positive(half_width, "half_width")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_spot_options::change(options, |o| o.band = Some(Band { polyline, half_width })) }
    })
}

/// Tells the laser's colour, so that other changes in the image weigh less.
///
/// @param options The options.
/// @param colour  A ptzcal_laser_colour.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_options_set_colour(
    options: *mut ptzcal_spot_options,
    colour: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let colour = self::colour(colour)?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_spot_options::change(options, |o| o.colour = colour) }
    })
}

/// Sets the least signal-to-noise ratio of a spot that is believed.
///
/// @param options The options.
/// @param ratio   Positive; the default is 8.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_options_set_min_signal_to_noise(
    options: *mut ptzcal_spot_options,
    ratio: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let ratio = positive(ratio, "ratio")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_spot_options::change(options, |o| o.min_signal_to_noise = ratio) }
    })
}

/// Sets the greatest area of a spot; larger changes are people, lamps or shadows.
///
/// @param options The options.
/// @param area    Pixels, at least 1; the default is 5000.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_options_set_max_area(
    options: *mut ptzcal_spot_options,
    area: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        if area == 0 {
            return Err(Error::invalid("area", "0 pixels"));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_spot_options::change(options, |o| o.max_area = area) }
    })
}

/// Sets how strong a second candidate may be: at this fraction of the best one's strength or more
/// the answer is PTZCAL_STATUS_AMBIGUOUS.
///
/// @param options The options.
/// @param ratio   Above 0, at most 1; the default is 0.5.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_options_set_ambiguity_ratio(
    options: *mut ptzcal_spot_options,
    ratio: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let ratio = positive(ratio, "ratio")?;
        if ratio > 1.0 {
            return Err(Error::invalid("ratio", format!("{ratio} is above 1")));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_spot_options::change(options, |o| o.ambiguity_ratio = ratio) }
    })
}

/// Finds the laser's spot in one frame with the laser on, against one with it off.
///
/// @param on      The frame with the laser on.
/// @param off     The same view with the laser off, of the same size and format; may be NULL: the
///                search then knows no background and is much weaker.
/// @param options The options; may be NULL: the defaults.
/// @param spot    Receives the spot; set up by ptzcal_spot_init.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND; PTZCAL_STATUS_AMBIGUOUS;
///         PTZCAL_STATUS_BUFFER_TOO_SMALL when a plane's size cannot hold the image;
///         PTZCAL_STATUS_INVALID_ARGUMENT for images that are malformed or do not match.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_detect_spot(
    on: *const ptzcal_image,
    off: *const ptzcal_image,
    options: *const ptzcal_spot_options,
    spot: *mut ptzcal_spot,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (on, off, options, spot) = unsafe {
            let off = if off.is_null() { Vec::new() } else { vec![view(off)?] };
            (view(on)?, off, ptzcal_spot_options::settings(options)?, SizedOut::new(spot)?)
        };
        detect_into(&[on], &off, &options, spot)
    })
}

/// Finds the laser's spot in several frames with the laser on, averaged, against several with it
/// off, averaged: noise falls with the square root of their number.
///
/// @param on      n_on frames with the laser on, all of one size and format.
/// @param n_on    Number of frames, at least 1.
/// @param off     n_off frames of the same view with the laser off; may be NULL when n_off is 0.
/// @param n_off   Number of frames; 0: a much weaker search, without a background.
/// @param options The options; may be NULL: the defaults.
/// @param spot    Receives the spot; set up by ptzcal_spot_init.
/// @param error   Receives the error; may be NULL.
/// @return As ptzcal_detect_spot.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_detect_spot_averaged(
    on: *const *const ptzcal_image,
    n_on: usize,
    off: *const *const ptzcal_image,
    n_off: usize,
    options: *const ptzcal_spot_options,
    spot: *mut ptzcal_spot,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        if n_on == 0 {
            return Err(Error::invalid("n_on", "no frame with the laser on"));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        let (on, off, options, spot) = unsafe {
            let (on, off) = (views(on, n_on, "on")?, views(off, n_off, "off")?);
            (on, off, ptzcal_spot_options::settings(options)?, SizedOut::new(spot)?)
        };
        detect_into(&on, &off, &options, spot)
    })
}

fn detect_into(
    on: &[ImageView<'_>],
    off: &[ImageView<'_>],
    options: &SpotOptions,
    spot: SizedOut<ptzcal_spot>,
) -> Result<()> {
    spot.write(&(&detect_spot(on, off, options)?).into());
    Ok(())
}

fn positive(value: f64, name: &'static str) -> Result<f64> {
    if number(value, name)? > 0.0 { Ok(value) } else { Err(Error::invalid(name, format!("{value} is not positive"))) }
}
