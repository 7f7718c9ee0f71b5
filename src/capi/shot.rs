//! Laser shots
//!
//! One position of a scan: where the head stood, and what its camera's spot says.

use super::call::{ErrorOut, guard};
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::rig::Shot;

/// One position of a scan.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_shot {
    /// Set by ptzcal_shot_init.
    pub struct_size: u32,
    /// Position in the region: tilt step * pan_steps + pan step.
    pub index: u32,
    /// The device's reading, radians.
    pub pan: f64,
    /// The device's reading, radians.
    pub tilt: f64,
    /// The device's own zoom scale.
    pub zoom: f64,
    /// Seconds of the rig's clock.
    pub time: f64,
    /// 1 when the head camera saw the spot; point, covariance and inverse depth are 0 otherwise.
    pub found: u32,
    /// 1 when the point has a finite depth; point and covariance are 0 otherwise.
    pub has_point: u32,
    /// How many fixed cameras saw the spot.
    pub fixed_found: u32,
    /// What the head camera saw there without the laser: 0xRRGGBB.
    pub colour: u32,
    /// The point in the rig's world, metres.
    pub point: [f64; 3],
    /// Its covariance, row-major, m^2; of rank one, along the laser's line.
    pub covariance: [f64; 9],
    /// 1 / depth along the head camera's axis, 1 / m; its noise is Gaussian.
    pub inverse_depth: f64,
    /// Its variance, 1 / m^2.
    pub inverse_depth_variance: f64,
    /// Squared distance of the spot from the laser's image line in standard deviations: about 1.
    pub epipolar_chi2: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_shot {
    const NAME: &'static str = "shot";
    const FIRST_SIZE: usize = 8 + 4 * 8 + 16 + 15 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            index: 0,
            pan: 0.0,
            tilt: 0.0,
            zoom: 0.0,
            time: 0.0,
            found: 0,
            has_point: 0,
            fixed_found: 0,
            colour: 0,
            point: [0.0; 3],
            covariance: [0.0; 9],
            inverse_depth: 0.0,
            inverse_depth_variance: 0.0,
            epipolar_chi2: 0.0,
        }
    }
}

impl From<&Shot> for ptzcal_shot {
    fn from(s: &Shot) -> Self {
        let [red, green, blue] = s.colour;
        let mut shot = Self {
            index: s.index,
            pan: s.pan,
            tilt: s.tilt,
            zoom: s.zoom,
            time: s.time,
            fixed_found: s.fixed.iter().filter(|f| f.is_ok()).count() as u32,
            colour: u32::from_be_bytes([0, red, green, blue]),
            ..Self::initial()
        };
        if let Some(measured) = &s.point {
            shot.found = 1;
            shot.inverse_depth = measured.point.rho;
            shot.inverse_depth_variance = measured.point.variance;
            shot.epipolar_chi2 = measured.epipolar_chi2;
            if let (Some(point), Some(covariance)) = (measured.point.point(), measured.point.point_covariance()) {
                shot.has_point = 1;
                shot.point = point.into();
                // Symmetric: by columns is by rows.
                shot.covariance.copy_from_slice(covariance.as_slice());
            }
        }
        shot
    }
}

/// Sets up a shot: everything 0.
///
/// @param shot The struct.
/// @param size sizeof *shot.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_shot_init(shot: *mut ptzcal_shot, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(shot, size) })
}
