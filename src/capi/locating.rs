//! Pointing: aim and locate
//!
//! Where to turn the head for a pixel of the fixed camera, where the fixed camera sees what the head
//! camera sees, and the ellipse of a covariance.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::args::{ArrayOut, BufferOut, number, vectors, vectors_optional};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::{Handle, borrow};
use super::pointing::ptzcal_pointing;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::calibrate::{UncertainPixel, UncertainPoint};
use crate::error::{Error, Result};
use crate::pointing::{AimOptions, Click, Edge, ellipse};

/// A click from its pixel and xx, xy, yy.
pub(super) fn click(uv: &[[f64; 2]], covariance: Option<&[[f64; 3]]>) -> Click {
    let [xx, xy, yy] = covariance.and_then(|c| c.first()).copied().unwrap_or([0.0; 3]);
    let pixel = uv.first().map_or_else(Vector2::zeros, |uv| Vector2::from(*uv));
    Click { pixel, covariance: Matrix2::new(xx, xy, xy, yy) }
}

/// A number or infinity.
pub(super) fn not_nan(value: f64, name: &'static str) -> Result<f64> {
    if value.is_nan() { Err(Error::NotFinite { name, index: 0 }) } else { Ok(value) }
}

fn three(c: &Matrix2<f64>) -> [f64; 3] {
    [c.m11, c.m12, c.m22]
}

/// Symmetric: by columns is by rows.
fn nine(c: &Matrix3<f64>) -> [f64; 9] {
    std::array::from_fn(|i| c[(i / 3, i % 3)])
}

/// Where to turn the head, and how surely.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_aim {
    /// Set by ptzcal_aim_init.
    pub struct_size: u32,
    /// 1 when there is a zoom curve, and `zoom` is set.
    pub has_zoom: u32,
    /// 1 when the surface ends or bends about the target, or is sampled too thinly to tell: the target may be what is at `other_distance` instead.
    pub edge: u32,
    /// 0.
    pub reserved: u32,
    /// The device's reading at which the target is at the picture's centre, radians.
    pub pan: f64,
    /// The device's reading, radians.
    pub tilt: f64,
    /// Of the target's direction about them, in readings: pan pan, pan tilt, tilt tilt, rad^2.
    pub angle_covariance: [f64; 3],
    /// The tightest zoom (the curve's own scale) that keeps the whole target in the picture with the probability asked for; the widest when none does.
    pub zoom: f64,
    /// Of the whole target being in the picture.
    pub probability: f64,
    /// Where the target is in the head camera's picture then, pixels.
    pub uv: [f64; 2],
    /// Its covariance: xx, xy, yy, px^2.
    pub uv_covariance: [f64; 3],
    /// The target in the world, metres.
    pub point: [f64; 3],
    /// Its covariance, row-major, m^2.
    pub point_covariance: [f64; 9],
    /// From the fixed camera's centre, metres.
    pub distance: f64,
    /// From the fixed camera's centre, of what the target may be instead, metres; 0: the cloud shows nothing else.
    pub other_distance: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_aim {
    const NAME: &'static str = "aim";
    const FIRST_SIZE: usize = 16 + 26 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            has_zoom: 0,
            edge: 0,
            reserved: 0,
            pan: 0.0,
            tilt: 0.0,
            angle_covariance: [0.0; 3],
            zoom: 0.0,
            probability: 0.0,
            uv: [0.0; 2],
            uv_covariance: [0.0; 3],
            point: [0.0; 3],
            point_covariance: [0.0; 9],
            distance: 0.0,
            other_distance: 0.0,
        }
    }
}

/// Where the fixed camera sees what the head camera sees.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_located {
    /// Set by ptzcal_located_init.
    pub struct_size: u32,
    /// As in ptzcal_aim.
    pub edge: u32,
    /// 1 when the cloud has a surface between the fixed camera and the point.
    pub hidden: u32,
    /// 0.
    pub reserved: u32,
    /// Pixel of the fixed camera.
    pub uv: [f64; 2],
    /// Its covariance: xx, xy, yy, px^2.
    pub uv_covariance: [f64; 3],
    /// In the world, metres.
    pub point: [f64; 3],
    /// Its covariance, row-major, m^2.
    pub point_covariance: [f64; 9],
    /// From the head camera's centre, metres.
    pub distance: f64,
    /// As in ptzcal_aim, from the head camera's centre.
    pub other_distance: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_located {
    const NAME: &'static str = "located";
    const FIRST_SIZE: usize = 16 + 19 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            edge: 0,
            hidden: 0,
            reserved: 0,
            uv: [0.0; 2],
            uv_covariance: [0.0; 3],
            point: [0.0; 3],
            point_covariance: [0.0; 9],
            distance: 0.0,
            other_distance: 0.0,
        }
    }
}

fn other(edge: Option<Edge>) -> f64 {
    edge.and_then(|e| e.other).unwrap_or(0.0)
}

fn pixel_members(p: &UncertainPixel) -> ([f64; 2], [f64; 3]) {
    (p.pixel.into(), three(&p.covariance))
}

fn point_members(p: &UncertainPoint) -> ([f64; 3], [f64; 9]) {
    (p.point.into(), nine(&p.covariance))
}

/// Sets up an aim: everything 0.
///
/// @param aim  The struct.
/// @param size sizeof *aim.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_aim_init(aim: *mut ptzcal_aim, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(aim, size) })
}

/// Sets up a location: everything 0.
///
/// @param located The struct.
/// @param size    sizeof *located.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_located_init(located: *mut ptzcal_located, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(located, size) })
}

/// Where to turn the head, and how far to zoom, so that its camera shows at its picture's centre what the
/// fixed camera shows at a pixel.
///
/// @param pointing      The pointing.
/// @param uv            2 numbers: a pixel of the fixed camera.
/// @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
///                      exact.
/// @param probability   With which the whole target is to be in the picture, between 0 and 1.
/// @param target_size   Diameter of the target, metres; 0 for a point.
/// @param aim           Receives the aim; set up by ptzcal_aim_init.
/// @param error         Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (a pixel outside the picture, a
///         probability or size that is none); PTZCAL_STATUS_OUTSIDE_LENS; PTZCAL_STATUS_UNREACHABLE:
///         a pixel above the plane's horizon, one so near to it that its distance is known to no
///         better than 20 %, or an aim that the head cannot reach; PTZCAL_STATUS_NOT_FOUND: the cloud
///         has no surface near the ray; PTZCAL_STATUS_BAD_STATE: neither plane nor cloud nor distance
///         is set.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_aim(
    pointing: *const ptzcal_pointing,
    uv: *const f64,
    uv_covariance: *const f64,
    probability: f64,
    target_size: f64,
    aim: *mut ptzcal_aim,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        number(probability, "probability")?;
        number(target_size, "target_size")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, uv, c, aim) = unsafe {
            (
                borrow(pointing)?,
                vectors::<2>(uv, 1, "uv")?,
                vectors_optional::<3>(uv_covariance, 1, "uv_covariance")?,
                SizedOut::new(aim)?,
            )
        };
        let state = pointing.0.read(ptzcal_pointing::NAME)?;
        let options = AimOptions { probability, target_size };
        let found = state.pointer.aim(&click(uv, c), &state.depth()?, &options)?;
        let ((uv, uv_covariance), (point, point_covariance)) =
            (pixel_members(&found.pixel), point_members(&found.point));
        aim.write(&ptzcal_aim {
            has_zoom: u32::from(found.zoom.is_some()),
            edge: u32::from(found.edge.is_some()),
            pan: found.pan,
            tilt: found.tilt,
            angle_covariance: three(&found.angles),
            zoom: found.zoom.unwrap_or(0.0),
            probability: found.probability,
            uv,
            uv_covariance,
            point,
            point_covariance,
            distance: found.distance,
            other_distance: other(found.edge),
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// Where the fixed camera sees what the head camera sees at a pixel.
///
/// @param pointing      The pointing.
/// @param pan           Reading of the head, radians.
/// @param tilt          Reading of the head, radians.
/// @param zoom          Zoom on the curve's scale; without a curve it does not matter.
/// @param uv            2 numbers: a pixel of the head camera.
/// @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
///                      exact.
/// @param located       Receives the location; set up by ptzcal_located_init.
/// @param error         Receives the error; may be NULL.
/// @return As ptzcal_pointing_aim; PTZCAL_STATUS_UNREACHABLE also for a point outside the fixed
///         camera's picture, PTZCAL_STATUS_BEHIND_CAMERA for one that it cannot see.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_locate(
    pointing: *const ptzcal_pointing,
    pan: f64,
    tilt: f64,
    zoom: f64,
    uv: *const f64,
    uv_covariance: *const f64,
    located: *mut ptzcal_located,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        number(pan, "pan")?;
        number(tilt, "tilt")?;
        number(zoom, "zoom")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, uv, c, located) = unsafe {
            (
                borrow(pointing)?,
                vectors::<2>(uv, 1, "uv")?,
                vectors_optional::<3>(uv_covariance, 1, "uv_covariance")?,
                SizedOut::new(located)?,
            )
        };
        let state = pointing.0.read(ptzcal_pointing::NAME)?;
        let zoom = state.pointer.zoom_curve().map(|_| zoom);
        let found = state.pointer.locate([pan, tilt], zoom, &click(uv, c), &state.depth()?)?;
        let ((uv, uv_covariance), (point, point_covariance)) =
            (pixel_members(&found.pixel), point_members(&found.point));
        located.write(&ptzcal_located {
            edge: u32::from(found.edge.is_some()),
            hidden: u32::from(found.hidden),
            uv,
            uv_covariance,
            point,
            point_covariance,
            distance: found.distance,
            other_distance: other(found.edge),
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// The part of the fixed camera's picture in which what the head camera sees at a pixel can be, its depth
/// unknown: of 65 places evenly spread in inverse distance those that are in the picture, nearest first.
///
/// @param pointing      The pointing.
/// @param pan           Reading of the head, radians.
/// @param tilt          Reading of the head, radians.
/// @param zoom          Zoom on the curve's scale; without a curve it does not matter.
/// @param uv            2 numbers: a pixel of the head camera.
/// @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
///                      exact.
/// @param nearest       Metres, positive.
/// @param farthest      Metres; INFINITY is far enough.
/// @param buffer        Receives 6 numbers a place: distance from the head camera's centre (metres), u,
///                      v, and xx, xy, yy of the pixel (px^2); may be NULL when capacity is 0.
/// @param capacity      Numbers that fit.
/// @param needed        Receives how many numbers there are; may be NULL.
/// @param error         Receives the error; may be NULL.
/// @return As ptzcal_pointing_locate; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_copy_located_along(
    pointing: *const ptzcal_pointing,
    pan: f64,
    tilt: f64,
    zoom: f64,
    uv: *const f64,
    uv_covariance: *const f64,
    nearest: f64,
    farthest: f64,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        number(pan, "pan")?;
        number(tilt, "tilt")?;
        number(zoom, "zoom")?;
        number(nearest, "nearest")?;
        not_nan(farthest, "farthest")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, uv, c, buffer) = unsafe {
            (
                borrow(pointing)?,
                vectors::<2>(uv, 1, "uv")?,
                vectors_optional::<3>(uv_covariance, 1, "uv_covariance")?,
                BufferOut::new(buffer, capacity, needed)?,
            )
        };
        let state = pointing.0.read(ptzcal_pointing::NAME)?;
        let zoom = state.pointer.zoom_curve().map(|_| zoom);
        let places = state.pointer.locate_along([pan, tilt], zoom, &click(uv, c), [nearest, farthest])?;
        let numbers: Vec<f64> = places
            .iter()
            .flat_map(|p| {
                let ([u, v], [xx, xy, yy]) = pixel_members(&p.pixel);
                [p.distance, u, v, xx, xy, yy]
            })
            .collect();
        buffer.write(&numbers)
    })
}

/// The ellipse about a Gaussian's mean that holds it with a probability: of a pixel, or of pan and tilt.
///
/// @param covariance  3 numbers: xx, xy, yy, positive semi-definite.
/// @param probability Between 0 and 1.
/// @param semi_axes   Receives 2 numbers: the longer half axis and the shorter, in the covariance's
///                    units.
/// @param angle       Receives the longer axis's angle from x towards y, radians, from -pi/2 to pi/2.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_ellipse(
    covariance: *const f64,
    probability: f64,
    semi_axes: *mut f64,
    angle: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        number(probability, "probability")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (c, axes, angle) = unsafe {
            (
                vectors::<3>(covariance, 1, "covariance")?,
                ArrayOut::new(semi_axes, 2, "semi_axes")?,
                ArrayOut::new(angle, 1, "angle")?,
            )
        };
        let [xx, xy, yy] = c[0];
        let found = ellipse(&Matrix2::new(xx, xy, xy, yy), probability)?;
        axes.write(&found.semi_axes);
        angle.write(&[found.angle]);
        Ok(())
    })
}
