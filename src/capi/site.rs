//! Sites: what is known before anyone scans
//!
//! A rig, the fixed camera that it will calibrate (its guessed pose and lens, in the rig's frame), what is
//! not known of the rig, and what surrounds both. Studies, labels, plans and next shots begin with it.

use nalgebra::Vector3;

use super::args::{array, number, vectors};
use super::calibration_options::ptzcal_calibration_options;
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::rig_model::{model_in, ptzcal_rig_model};
use super::status::ptzcal_status;
use crate::adjust::Prior;
use crate::error::{Error, Result};
use crate::geometry::{Plane, RIG_PARAMETERS};
use crate::study::{Scene, Site};

/// Rig, fixed camera and surroundings.
pub struct ptzcal_site(pub(super) Exclusive<SiteAndScene>);

pub(super) struct SiteAndScene {
    pub site: Site,
    pub scene: Option<Scene>,
}

impl Handle for ptzcal_site {
    const NAME: &'static str = "site";
}

impl SiteAndScene {
    pub fn scene(&self) -> Result<&Scene> {
        let none = || Error::BadState { reason: "the site has no surroundings: set a plane, a room or depths".into() };
        self.scene.as_ref().ok_or_else(none)
    }
}

impl ptzcal_site {
    /// Changes the surroundings.
    ///
    /// # Safety
    /// `site` is NULL or a live site.
    unsafe fn surround(site: *mut Self, scene: impl FnOnce() -> Result<Scene>) -> Result<()> {
        // SAFETY: by this function's contract.
        let site = unsafe { borrow(site)? };
        let scene = scene()?;
        scene.validate()?;
        site.0.write(Self::NAME)?.scene = Some(scene);
        Ok(())
    }
}

/// Makes a site: a rig that is known exactly, no surroundings yet.
///
/// @param model  The rig.
/// @param camera The fixed camera, its pose in the rig's frame; the lens model that it has is the one that
///               will be fitted.
/// @param site   Receives the site; free it with ptzcal_site_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_LENS_NOT_MONOTONE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_site_new(
    model: *const ptzcal_rig_model,
    camera: *const ptzcal_camera,
    site: *mut *mut ptzcal_site,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, model, camera) = unsafe { (HandleOut::new(site)?, model_in(model)?, camera_in(camera)?) };
        let site = Site::new(model, camera);
        site.validate()?;
        out.give(ptzcal_site(Exclusive::new(SiteAndScene { site, scene: None })));
        Ok(())
    })
}

/// Frees a site.
///
/// @param site The site; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_site_free(site: *mut ptzcal_site) {
    // SAFETY: NULL or a live site that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(site) });
}

/// Says how well the rig's parameters are known.
///
/// @param site   The site.
/// @param sigmas 15 standard deviations in the order of ptzcal_rig_parameter; 0 fixes a parameter (all of
///               them by default), INFINITY frees it.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (the message names the parameter);
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_site_set_rig_sigmas(
    site: *mut ptzcal_site,
    sigmas: *const f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (site, sigmas) = unsafe { (borrow(site)?, array(sigmas, RIG_PARAMETERS, "sigmas")?) };
        if let Some(index) = sigmas.iter().position(|s| s.is_nan() || *s == f64::NEG_INFINITY) {
            return Err(Error::NotFinite { name: "sigmas", index });
        }
        if let Some(i) = sigmas.iter().position(|s| *s < 0.0) {
            let name = crate::geometry::RigParameter::ALL.get(i).map_or("", |p| p.name());
            return Err(Error::invalid("sigmas", format!("{name}: {} is negative", sigmas[i])));
        }
        site.0.write(ptzcal_site::NAME)?.site.rig_prior = Prior::of_sigmas(sigmas);
        Ok(())
    })
}

/// Says how well single moves of the head are known.
///
/// @param site       The site.
/// @param sigma_pan  Standard deviation of the true pan about its readings, radians; the default is 0.
/// @param sigma_tilt The same of tilt.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_site_set_pointing_sigma(
    site: *mut ptzcal_site,
    sigma_pan: f64,
    sigma_tilt: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let site = unsafe { borrow(site)? };
        let sigmas = [number(sigma_pan, "sigma_pan")?, number(sigma_tilt, "sigma_tilt")?];
        if sigmas.iter().any(|s| *s < 0.0) {
            return Err(Error::invalid("pointing sigma", "a standard deviation is not negative"));
        }
        site.0.write(ptzcal_site::NAME)?.site.pointing_sigma = sigmas;
        Ok(())
    })
}

/// Says how the camera will be calibrated: lens model (that of the site's camera), known lens, beliefs
/// about skew and aspect. The options' other settings do not matter here.
///
/// @param site    The site.
/// @param options The options; may be NULL: the defaults with the camera's lens model.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for another lens model than the camera's;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_site_set_estimate(
    site: *mut ptzcal_site,
    options: *const ptzcal_calibration_options,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let site = unsafe { borrow(site)? };
        let mut held = site.0.write(ptzcal_site::NAME)?;
        let mut changed = Site::new(held.site.rig, held.site.camera);
        if !options.is_null() {
            // SAFETY: the caller keeps the header's rules for pointers.
            changed.estimate = unsafe { ptzcal_calibration_options::settings(options)? };
        }
        changed.validate()?;
        held.site.estimate = changed.estimate;
        Ok(())
    })
}

/// Surrounds rig and camera by one plane: a wall, a floor.
///
/// @param site     The site.
/// @param normal   Its normal n, 3 numbers of any length: n . x = distance in the rig's frame.
/// @param distance Metres for a normal of unit length.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_site_set_plane(
    site: *mut ptzcal_site,
    normal: *const f64,
    distance: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let normal = unsafe { vectors::<3>(normal, 1, "normal")? };
        let distance = number(distance, "distance")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_site::surround(site, || {
                let plane = normal.first().and_then(|n| Plane::new(Vector3::from(*n), distance));
                plane.map(Scene::Plane).ok_or_else(|| Error::invalid("normal", "it has no length"))
            })
        }
    })
}

/// Surrounds rig and camera by a room with boxes in it, which also hide what is behind them.
///
/// @param site  The site.
/// @param room  6 numbers: the lower corner x y z, then the higher one; the rig's frame, metres.
/// @param boxes 6 numbers for each box; may be NULL when there is none.
/// @param n     Boxes, 10,000 at most.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for corners in the wrong order;
///         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_site_set_room(
    site: *mut ptzcal_site,
    room: *const f64,
    boxes: *const f64,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (room, boxes) = unsafe {
            let boxes: &[[f64; 6]] = if boxes.is_null() && n == 0 { &[] } else { vectors::<6>(boxes, n, "boxes")? };
            (vectors::<6>(room, 1, "room")?, boxes)
        };
        let corners = |[a, b, c, d, e, f]: &[f64; 6]| [Vector3::new(*a, *b, *c), Vector3::new(*d, *e, *f)];
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_site::surround(site, || {
                let room = room.first().map(corners).ok_or(Error::NullPointer { name: "room" })?;
                Ok(Scene::Room { room, boxes: boxes.iter().map(corners).collect() })
            })
        }
    })
}

/// Says of the surroundings only which depths occur: every position gets one of them.
///
/// @param site     The site.
/// @param nearest  Least depth along the head's axis, metres.
/// @param farthest Greatest depth.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_site_set_depths(
    site: *mut ptzcal_site,
    nearest: f64,
    farthest: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let (nearest, farthest) = (number(nearest, "nearest")?, number(farthest, "farthest")?);
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_site::surround(site, || Ok(Scene::Depths { nearest, farthest })) }
    })
}
