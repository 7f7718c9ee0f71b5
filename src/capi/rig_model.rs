//! Rig models
//!
//! Everything that turns a laser shot (pan, tilt, the spot's pixel in the head camera) into a point:
//! the head camera's intrinsics and lens, the laser's line, the rotation axes, the encoders. The
//! world of a rig is its head camera's frame at pan = tilt = 0; positive pan turns the view right,
//! positive tilt turns it up.

use nalgebra::{Matrix2, Vector2};

use super::args::{ArrayOut, number, vectors, vectors_optional};
use super::call::{ErrorOut, guard};
use super::camera::{distortion, distortion_members, ptzcal_camera};
use super::error::ptzcal_error;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::geometry::rig_model::{AxisOffsets, Encoders, LaserLine};
use crate::geometry::{Intrinsics, RigModel};

/// A pan-tilt camera with a laser fixed to its moving head.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_rig_model {
    /// Set by ptzcal_rig_model_init.
    pub struct_size: u32,
    /// Image size of the head camera in pixels, 1 to 65536.
    pub width: u32,
    /// Image size of the head camera in pixels, 1 to 65536.
    pub height: u32,
    /// A ptzcal_distortion_model.
    pub distortion_model: u32,
    /// Focal length in pixels of x, positive.
    pub fx: f64,
    /// Focal length in pixels of y, positive.
    pub fy: f64,
    /// K[0][1], pixels.
    pub skew: f64,
    /// Principal point, pixels.
    pub cx: f64,
    /// Principal point, pixels.
    pub cy: f64,
    /// The lens model's coefficients; those that the model does not have are 0.
    pub distortion: [f64; 8],
    /// The laser's line in the head camera's frame is (x0 + vx Z, y0 + vy Z, Z). Metres.
    pub laser_x0: f64,
    /// Metres. (x0, y0) is the baseline: at least 1 mm long.
    pub laser_y0: f64,
    /// Slope, metres per metre of depth.
    pub laser_vx: f64,
    /// Slope, metres per metre of depth.
    pub laser_vy: f64,
    /// The tilt axis (parallel to x) passes through (y, z) = -(tilt_y, tilt_z) of the head camera's
    /// frame. Metres; 0: through the camera's centre.
    pub axis_tilt_y: f64,
    /// Metres.
    pub axis_tilt_z: f64,
    /// The pan axis (parallel to y) is displaced from the tilt axis by (pan_x, pan_z). Metres.
    pub axis_pan_x: f64,
    /// Metres.
    pub axis_pan_z: f64,
    /// True pan = pan_scale * reading + pan_zero. Radians.
    pub pan_zero: f64,
    /// 1 for a true encoder.
    pub pan_scale: f64,
    /// True tilt = tilt_scale * reading + tilt_zero. Radians.
    pub tilt_zero: f64,
    /// 1 for a true encoder.
    pub tilt_scale: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_rig_model {
    const NAME: &'static str = "model";
    const FIRST_SIZE: usize = 16 + 25 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            width: 0,
            height: 0,
            distortion_model: 0,
            fx: 0.0,
            fy: 0.0,
            skew: 0.0,
            cx: 0.0,
            cy: 0.0,
            distortion: [0.0; 8],
            laser_x0: 0.0,
            laser_y0: 0.0,
            laser_vx: 0.0,
            laser_vy: 0.0,
            axis_tilt_y: 0.0,
            axis_tilt_z: 0.0,
            axis_pan_x: 0.0,
            axis_pan_z: 0.0,
            pan_zero: 0.0,
            pan_scale: 1.0,
            tilt_zero: 0.0,
            tilt_scale: 1.0,
        }
    }
}

impl TryFrom<ptzcal_rig_model> for RigModel {
    type Error = Error;

    fn try_from(m: ptzcal_rig_model) -> Result<Self> {
        let model = RigModel {
            width: m.width,
            height: m.height,
            intrinsics: Intrinsics { fx: m.fx, fy: m.fy, skew: m.skew, cx: m.cx, cy: m.cy },
            distortion: distortion(m.distortion_model, &m.distortion)?,
            laser: LaserLine { x0: m.laser_x0, y0: m.laser_y0, vx: m.laser_vx, vy: m.laser_vy },
            offsets: AxisOffsets {
                tilt_y: m.axis_tilt_y,
                tilt_z: m.axis_tilt_z,
                pan_x: m.axis_pan_x,
                pan_z: m.axis_pan_z,
            },
            encoders: Encoders {
                pan_zero: m.pan_zero,
                pan_scale: m.pan_scale,
                tilt_zero: m.tilt_zero,
                tilt_scale: m.tilt_scale,
            },
        };
        model.validate()?;
        Ok(model)
    }
}

impl From<&RigModel> for ptzcal_rig_model {
    fn from(model: &RigModel) -> Self {
        let (k, l, o, e) = (&model.intrinsics, &model.laser, &model.offsets, &model.encoders);
        let (distortion_model, distortion) = distortion_members(&model.distortion);
        Self {
            struct_size: size_of::<Self>() as u32,
            width: model.width,
            height: model.height,
            distortion_model,
            fx: k.fx,
            fy: k.fy,
            skew: k.skew,
            cx: k.cx,
            cy: k.cy,
            distortion,
            laser_x0: l.x0,
            laser_y0: l.y0,
            laser_vx: l.vx,
            laser_vy: l.vy,
            axis_tilt_y: o.tilt_y,
            axis_tilt_z: o.tilt_z,
            axis_pan_x: o.pan_x,
            axis_pan_z: o.pan_z,
            pan_zero: e.pan_zero,
            pan_scale: e.pan_scale,
            tilt_zero: e.tilt_zero,
            tilt_scale: e.tilt_scale,
        }
    }
}

/// The caller's rig model.
///
/// # Safety
/// `model` is NULL or a struct as long as its `struct_size` says.
pub(super) unsafe fn model_in(model: *const ptzcal_rig_model) -> Result<RigModel> {
    // SAFETY: by this function's contract.
    unsafe { sized::read(model)? }.try_into()
}

/// xx, xy, yy as a matrix; `None` is the identity (1 px).
pub(super) fn covariance2(members: Option<&[f64; 3]>) -> Matrix2<f64> {
    members.map_or_else(Matrix2::identity, |[xx, xy, yy]| Matrix2::new(*xx, *xy, *xy, *yy))
}

/// Sets up a rig model: true encoders, axes through the camera's centre, no distortion, everything
/// else 0 (image size, focal lengths and the laser's line must still be set).
///
/// @param model The struct.
/// @param size  sizeof *model.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_model_init(model: *mut ptzcal_rig_model, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(model, size) })
}

/// The head camera as a camera of the world, at given encoder readings.
///
/// @param model  The rig model.
/// @param pan    Reading, radians.
/// @param tilt   Reading, radians.
/// @param camera Receives the camera; set up by ptzcal_camera_init.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_model_head_camera(
    model: *const ptzcal_rig_model,
    pan: f64,
    tilt: f64,
    camera: *mut ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (model, camera) = unsafe { (model_in(model)?, SizedOut::new(camera)?) };
        camera.write(&(&model.head_camera(number(pan, "pan")?, number(tilt, "tilt")?)).into());
        Ok(())
    })
}

/// The points that laser shots hit. Depth comes from both coordinates of each spot, weighted by its
/// covariance; far away it is uncertain and skewed, so hand shots to a calibration as shots
/// (ptzcal_correspondences_add_laser_shots), not as these points.
///
/// @param model           The rig model.
/// @param pan_tilt        n x 2 numbers: readings at each shot, radians.
/// @param spots           n x 2 numbers: the spot's pixel in the head camera.
/// @param spot_covariance n x 3 numbers: xx, xy, yy of each spot, px^2; may be NULL: 1 px, uncorrelated.
/// @param n               Number of shots.
/// @param xyz             Receives n x 3 numbers: points, metres, world frame.
/// @param covariance      Receives n x 9 numbers: first-order covariance of each point, row-major,
///                        m^2 (rank one, along the beam); may be NULL.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BEHIND_CAMERA (index: the first shot whose spot lies at or
///         beyond infinity); PTZCAL_STATUS_NOT_FINITE (index: the shot);
///         PTZCAL_STATUS_INVALID_ARGUMENT for a spot outside the lens model or a covariance that is
///         not positive definite.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_model_locate(
    model: *const ptzcal_rig_model,
    pan_tilt: *const f64,
    spots: *const f64,
    spot_covariance: *const f64,
    n: usize,
    xyz: *mut f64,
    covariance: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (model, pan_tilt, spots, spot_covariance, xyz, covariance) = unsafe {
            (
                model_in(model)?,
                vectors::<2>(pan_tilt, n, "pan_tilt")?,
                vectors::<2>(spots, n, "spots")?,
                vectors_optional::<3>(spot_covariance, n, "spot_covariance")?,
                ArrayOut::vectors::<3>(xyz, n, "xyz")?,
                ArrayOut::vectors_optional::<9>(covariance, n, "covariance")?,
            )
        };
        let mut points = Vec::with_capacity(n);
        let mut covariances = Vec::with_capacity(n);
        for (i, ([pan, tilt], spot)) in pan_tilt.iter().zip(spots).enumerate() {
            let noise = covariance2(spot_covariance.map(|c| &c[i]));
            let shot = model.measure(*pan, *tilt, &Vector2::from(*spot), &noise)?.point;
            let lost = Error::BehindCamera { index: i };
            let (point, c) = shot.point().zip(shot.point_covariance()).ok_or(lost)?;
            points.push(point.into());
            covariances.push([c.m11, c.m12, c.m13, c.m21, c.m22, c.m23, c.m31, c.m32, c.m33]);
        }
        xyz.write(&points);
        if let Some(covariance) = covariance {
            covariance.write(&covariances);
        }
        Ok(())
    })
}
