//! Cameras
//!
//! A calibrated camera is plain data: fill it in yourself or take it from a calibration. A world
//! point X is at x = R X + t in the camera frame (x right, y down, z forward), at (x/z, y/z) on the
//! normalised plane, there distorted by the lens to (a, b), and at u = fx a + skew b + cx,
//! v = fy b + cy in the image. A fisheye lens gives (a, b) from the ray itself, also at and beyond
//! 90 degrees from the axis, where z is not positive.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::args::{ArrayOut, vectors};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};

/// Lens models: the values of ptzcal_camera.distortion_model and ptzcal_rig_model.distortion_model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_distortion_model {
    /// No distortion, no coefficients.
    None = 0,
    /// The Brown-Conrady model with k1 only. A calibration that fits it returns a BROWN_CONRADY
    /// camera whose other coefficients are 0.
    Radial1 = 1,
    /// The Brown-Conrady model with k1 and k2 only.
    Radial2 = 2,
    /// Brown-Conrady, the five coefficients k1 k2 p1 p2 k3 with OpenCV's meaning and order:
    /// a = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2),
    /// b = y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y.
    BrownConrady = 3,
    /// Division model, one coefficient lambda: (x, y) = (a, b) / (1 + lambda (a^2 + b^2)).
    /// Negative is barrel distortion. In units of the normalised plane.
    Division = 4,
    /// Fisheye (Kannala-Brandt), the four coefficients k1 k2 k3 k4 with OpenCV's meaning and order: a
    /// ray at the angle theta from the axis is imaged at the radius
    /// theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8) on the normalised plane. Sees
    /// beyond 90 degrees, up to the angle at which the radius stops growing.
    Fisheye = 5,
}

/// A calibrated camera.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_camera {
    /// Set by ptzcal_camera_init.
    pub struct_size: u32,
    /// Image size in pixels, 1 to 65536.
    pub width: u32,
    /// Image size in pixels, 1 to 65536.
    pub height: u32,
    /// A ptzcal_distortion_model.
    pub distortion_model: u32,
    /// Focal length in pixels of x, positive.
    pub fx: f64,
    /// Focal length in pixels of y, positive.
    pub fy: f64,
    /// K[0][1], pixels; 0 for practically all cameras.
    pub skew: f64,
    /// Principal point, pixels; (0, 0) is the centre of the top-left pixel.
    pub cx: f64,
    /// Principal point, pixels.
    pub cy: f64,
    /// The model's coefficients in the model's order; those that the model does not have are 0.
    pub distortion: [f64; 8],
    /// R, row-major: world axes to camera axes, a rotation to within 1e-6.
    pub rotation: [f64; 9],
    /// t, metres: the world's origin in the camera frame. The camera's centre is -R^T t.
    pub translation: [f64; 3],
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_camera {
    const NAME: &'static str = "camera";
    const FIRST_SIZE: usize = 16 + 25 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            width: 0,
            height: 0,
            distortion_model: ptzcal_distortion_model::None as u32,
            fx: 0.0,
            fy: 0.0,
            skew: 0.0,
            cx: 0.0,
            cy: 0.0,
            distortion: [0.0; 8],
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            translation: [0.0; 3],
        }
    }
}

/// A lens from its model's number and its coefficients.
pub(super) fn distortion(model: u32, coefficients: &[f64; 8]) -> Result<Distortion> {
    use ptzcal_distortion_model::{BrownConrady, Division, Fisheye, None, Radial1, Radial2};
    let [c0, c1, c2, c3, c4, ..] = *coefficients;
    let (lens, known) = match model {
        m if m == None as u32 => (Distortion::None, 0),
        m if m == Radial1 as u32 => (Distortion::BrownConrady([c0, 0.0, 0.0, 0.0, 0.0]), 1),
        m if m == Radial2 as u32 => (Distortion::BrownConrady([c0, c1, 0.0, 0.0, 0.0]), 2),
        m if m == BrownConrady as u32 => (Distortion::BrownConrady([c0, c1, c2, c3, c4]), 5),
        m if m == Division as u32 => (Distortion::Division(c0), 1),
        m if m == Fisheye as u32 => (Distortion::Fisheye([c0, c1, c2, c3]), 4),
        m => return Err(Error::invalid("distortion_model", format!("{m} is no lens model"))),
    };
    // A coefficient that is not used would be ignored: somebody means another model.
    match coefficients[known..].iter().position(|k| *k != 0.0) {
        Some(i) => Err(Error::invalid("distortion", format!("coefficient {} is not of this model", known + i))),
        Option::None => Ok(lens),
    }
}

/// A lens as its model's number and its coefficients.
pub(super) fn distortion_members(lens: &Distortion) -> (u32, [f64; 8]) {
    let model = match lens {
        Distortion::None => ptzcal_distortion_model::None,
        Distortion::BrownConrady(_) => ptzcal_distortion_model::BrownConrady,
        Distortion::Division(_) => ptzcal_distortion_model::Division,
        Distortion::Fisheye(_) => ptzcal_distortion_model::Fisheye,
    };
    let mut coefficients = [0.0; 8];
    for (to, from) in coefficients.iter_mut().zip(lens.coefficients()) {
        *to = *from;
    }
    (model as u32, coefficients)
}

impl TryFrom<ptzcal_camera> for Camera {
    type Error = Error;

    fn try_from(c: ptzcal_camera) -> Result<Self> {
        let camera = Camera {
            width: c.width,
            height: c.height,
            intrinsics: Intrinsics { fx: c.fx, fy: c.fy, skew: c.skew, cx: c.cx, cy: c.cy },
            distortion: distortion(c.distortion_model, &c.distortion)?,
            pose: Rigid { rotation: Matrix3::from_row_slice(&c.rotation), translation: Vector3::from(c.translation) },
        };
        camera.validate()?;
        Ok(camera)
    }
}

impl From<&Camera> for ptzcal_camera {
    fn from(camera: &Camera) -> Self {
        let (k, r) = (&camera.intrinsics, &camera.pose.rotation);
        let (distortion_model, distortion) = distortion_members(&camera.distortion);
        Self {
            struct_size: size_of::<Self>() as u32,
            width: camera.width,
            height: camera.height,
            distortion_model,
            fx: k.fx,
            fy: k.fy,
            skew: k.skew,
            cx: k.cx,
            cy: k.cy,
            distortion,
            rotation: [r.m11, r.m12, r.m13, r.m21, r.m22, r.m23, r.m31, r.m32, r.m33],
            translation: camera.pose.translation.into(),
        }
    }
}

/// The caller's camera.
///
/// # Safety
/// `camera` is NULL or a struct as long as its `struct_size` says.
pub(super) unsafe fn camera_in(camera: *const ptzcal_camera) -> Result<Camera> {
    // SAFETY: by this function's contract.
    unsafe { sized::read(camera)? }.try_into()
}

/// Sets up a camera: rotation 1, no distortion, everything else 0 (image size and focal lengths
/// must still be set).
///
/// @param camera The struct.
/// @param size   sizeof *camera.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_init(camera: *mut ptzcal_camera, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(camera, size) })
}

/// Centre of a camera in the world, -R^T t.
///
/// @param camera The camera.
/// @param centre Receives 3 numbers, metres, world frame.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_centre(
    camera: *const ptzcal_camera,
    centre: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (camera, centre) = unsafe { (camera_in(camera)?, ArrayOut::new(centre, 3, "centre")?) };
        centre.write(camera.centre().as_slice());
        Ok(())
    })
}

/// Projects world points into the image, lens distortion included. Pixels outside the image are not
/// an error: compare them with the image size.
///
/// @param camera The camera.
/// @param xyz    n x 3 numbers: points, metres, world frame.
/// @param n      Number of points.
/// @param uv     Receives n x 2 numbers: pixels. May be the same memory as xyz.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BEHIND_CAMERA (index: the first point that is behind the
///         camera); PTZCAL_STATUS_OUTSIDE_LENS (index: the first point that the lens model has no
///         image of); PTZCAL_STATUS_NOT_FINITE (index: the point).
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_project(
    camera: *const ptzcal_camera,
    xyz: *const f64,
    n: usize,
    uv: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (camera, points, uv) =
            unsafe { (camera_in(camera)?, vectors::<3>(xyz, n, "xyz")?, ArrayOut::vectors::<2>(uv, n, "uv")?) };
        let pixel = |(index, point): (usize, &[f64; 3])| {
            let point = Vector3::from(*point);
            let pixel = camera.project(&point).ok_or_else(|| {
                let in_front = camera.pose.apply(&point).z > 0.0;
                if in_front { Error::OutsideLens { index } } else { Error::BehindCamera { index } }
            })?;
            Ok(pixel.into())
        };
        uv.write(&points.iter().enumerate().map(pixel).collect::<Result<Vec<[f64; 2]>>>()?);
        Ok(())
    })
}

/// The viewing rays of pixels: from the camera's centre (ptzcal_camera_centre), lens distortion
/// removed.
///
/// @param camera     The camera.
/// @param uv         n x 2 numbers: pixels.
/// @param n          Number of pixels.
/// @param directions Receives n x 3 numbers: unit vectors in the world frame.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_OUTSIDE_LENS (index: the first pixel that no ray reaches
///         through the lens model); PTZCAL_STATUS_NOT_FINITE (index: the pixel).
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_back_project(
    camera: *const ptzcal_camera,
    uv: *const f64,
    n: usize,
    directions: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (camera, pixels, directions) = unsafe {
            (camera_in(camera)?, vectors::<2>(uv, n, "uv")?, ArrayOut::vectors::<3>(directions, n, "directions")?)
        };
        let ray = |(index, pixel): (usize, &[f64; 2])| {
            let ray = camera.back_project(&Vector2::from(*pixel)).ok_or(Error::OutsideLens { index })?;
            Ok(ray.direction.into())
        };
        directions.write(&pixels.iter().enumerate().map(ray).collect::<Result<Vec<[f64; 3]>>>()?);
        Ok(())
    })
}
