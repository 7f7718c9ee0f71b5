//! Poses between stations by planes
//!
//! The pose of one station in another's frame from the planes that both saw, without being told which
//! are the same. Poses that bring planes together are judged by what the stations saw: a surface of one
//! must not lie where the other saw through. What is ambiguous (an empty room, turned by half a turn, looks
//! like itself), or what nothing confirms, is refused and never guessed; a rough pose as prior settles it.
//! What the planes leave free (parallel walls, a corridor) is refused with directions in the message.

use nalgebra::{Matrix3, Vector3};

use super::args::{BufferOut, array, flag, number};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::planes::ptzcal_planes;
use super::roof_edges::ptzcal_roof_edges;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::geometry::Rigid;
use crate::pose::{PosePrior, StationOptions, StationPose, common_roof_edges, register_matched, register_stations};

/// How two stations are registered.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_station_options {
    /// Set by ptzcal_station_options_init.
    pub struct_size: u32,
    /// 1: only poses within three standard deviations of the prior are considered; 0: all.
    pub has_prior: u32,
    /// Planes are the same that, registered, differ by no more than this angle, radians, to 0.3.
    pub max_angle: f64,
    /// And by no more than this in their distance, metres.
    pub max_distance: f64,
    /// Of the places that both stations saw, the least share where both saw a surface, 0 to 1.
    pub min_agreement: f64,
    /// Another pose that scores this share of the best one's score makes it ambiguous, 0 to 1.
    pub max_runner_up: f64,
    /// R of the prior, row-major, in X_a = R X_b + t.
    pub prior_rotation: [f64; 9],
    /// t of the prior, metres.
    pub prior_translation: [f64; 3],
    /// Standard deviation of the angle by which the prior may be off, radians.
    pub prior_rotation_sigma: f64,
    /// Standard deviation of the distance by which its position may be off, metres.
    pub prior_position_sigma: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_station_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 8 + 18 * 8;
    fn initial() -> Self {
        let defaults = StationOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            has_prior: 0,
            max_angle: defaults.max_angle,
            max_distance: defaults.max_distance,
            min_agreement: defaults.min_agreement,
            max_runner_up: defaults.max_runner_up,
            prior_rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            prior_translation: [0.0; 3],
            prior_rotation_sigma: 0.3,
            prior_position_sigma: 0.5,
        }
    }
}

impl ptzcal_station_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or a struct as long as its `struct_size` says.
    pub(super) unsafe fn settings(options: *const Self) -> Result<StationOptions> {
        if options.is_null() {
            return Ok(StationOptions::default());
        }
        // SAFETY: by this function's contract.
        let options = unsafe { sized::read(options)? };
        let prior = PosePrior {
            b_to_a: Rigid {
                rotation: Matrix3::from_row_slice(&options.prior_rotation),
                translation: Vector3::from(options.prior_translation),
            },
            rotation_sigma: number(options.prior_rotation_sigma, "prior_rotation_sigma")?,
            position_sigma: number(options.prior_position_sigma, "prior_position_sigma")?,
        };
        Ok(StationOptions {
            max_angle: number(options.max_angle, "max_angle")?,
            max_distance: number(options.max_distance, "max_distance")?,
            min_agreement: number(options.min_agreement, "min_agreement")?,
            max_runner_up: number(options.max_runner_up, "max_runner_up")?,
            prior: flag(options.has_prior, "has_prior")?.then_some(prior),
        })
    }
}

/// A pose between two stations, and the planes that it is from. Immutable: any number of threads may
/// read it.
pub struct ptzcal_registration(pub(super) StationPose);

impl Handle for ptzcal_registration {
    const NAME: &'static str = "registration";
}

/// The pose of station b in station a's frame, from planes.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_station_pose {
    /// Set by ptzcal_station_pose_init.
    pub struct_size: u32,
    /// Pairs of planes that are the same.
    pub matches: u32,
    /// R, row-major, in X_a = R X_b + t.
    pub rotation: [f64; 9],
    /// t, metres: the position of station b in station a's frame.
    pub translation: [f64; 3],
    /// 6 x 6, row-major: of the rotation vector w in R <- exp([w]x) R (radians, axes of station a) and of
    /// the translation (metres). Larger where the planes' differences contradict their covariances.
    pub covariance: [f64; 36],
    /// Sum of squares of the planes' differences, in their standard deviations.
    pub chi2: f64,
    /// Three for each pair of planes, less six.
    pub degrees_of_freedom: f64,
    /// How much better the best-determined direction is than the worst; 1 at best.
    pub condition: f64,
    /// Of the places that both stations saw, the share where both saw a surface.
    pub agreement: f64,
    /// The score of the best other pose, relative to this one's; 0 where there is none.
    pub runner_up: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_station_pose {
    const NAME: &'static str = "pose";
    const FIRST_SIZE: usize = 8 + 53 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            matches: 0,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            translation: [0.0; 3],
            covariance: [0.0; 36],
            chi2: 0.0,
            degrees_of_freedom: 0.0,
            condition: 0.0,
            agreement: 0.0,
            runner_up: 0.0,
        }
    }
}

impl From<&StationPose> for ptzcal_station_pose {
    fn from(p: &StationPose) -> Self {
        let (mut rotation, mut covariance) = ([0.0; 9], [0.0; 36]);
        rotation.copy_from_slice(p.b_to_a.rotation.transpose().as_slice());
        // Symmetric: by columns is by rows.
        covariance.copy_from_slice(p.covariance.as_slice());
        Self {
            matches: p.matches.len() as u32,
            rotation,
            translation: p.b_to_a.translation.into(),
            covariance,
            chi2: p.chi_square,
            degrees_of_freedom: p.degrees_of_freedom as f64,
            condition: p.condition,
            agreement: p.agreement,
            runner_up: p.runner_up,
            ..Self::initial()
        }
    }
}

/// Sets up options: planes within 4 degrees and 0.1 m are the same, 93 % of the places agree, no prior.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_station_options_init(
    options: *mut ptzcal_station_options,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Finds the pose between two stations from the planes that both saw. Any number of other planes, and of
/// parallel ones, may be among them.
///
/// @param station_a The first station's planes.
/// @param station_b The second station's, in any order.
/// @param options   The options; may be NULL: the defaults.
/// @param result    Receives the registration; free it with ptzcal_registration_free.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEGENERATE for planes that leave a part of the pose
///         unobservable (the message says which, with directions in station a's or b's frame);
///         PTZCAL_STATUS_NOT_FOUND when no pose brings three planes in three directions together and
///         agrees with what the stations saw; PTZCAL_STATUS_AMBIGUOUS when another pose agrees as well,
///         or when nothing confirms the only one; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_register_stations(
    station_a: *const ptzcal_planes,
    station_b: *const ptzcal_planes,
    options: *const ptzcal_station_options,
    result: *mut *mut ptzcal_registration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (result, a, b, options) = unsafe {
            (
                HandleOut::new(result)?,
                borrow(station_a)?,
                borrow(station_b)?,
                ptzcal_station_options::settings(options)?,
            )
        };
        result.give(ptzcal_registration(register_stations(&a.0, &b.0, &options)?));
        Ok(())
    })
}

/// The pose between two stations from planes that are known to be the same.
///
/// @param station_a The first station's planes.
/// @param station_b The second station's.
/// @param pairs     n x 2 numbers: a plane of station a, and the same one of station b.
/// @param n         Number of pairs, at least 3.
/// @param result    Receives the registration; free it with ptzcal_registration_free.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEGENERATE for planes that leave a part of the pose
///         unobservable (the message says which); PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_register_matched_planes(
    station_a: *const ptzcal_planes,
    station_b: *const ptzcal_planes,
    pairs: *const u32,
    n: usize,
    result: *mut *mut ptzcal_registration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (result, a, b, pairs) = unsafe {
            (
                HandleOut::new(result)?,
                borrow(station_a)?,
                borrow(station_b)?,
                array(pairs.cast::<[u32; 2]>(), n, "pairs")?,
            )
        };
        let matches: Vec<[usize; 2]> = pairs.iter().map(|p| p.map(|i| i as usize)).collect();
        result.give(ptzcal_registration(register_matched(&a.0, &b.0, &matches)?));
        Ok(())
    })
}

/// Frees a registration.
///
/// @param registration The registration; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_registration_free(registration: *mut ptzcal_registration) {
    // SAFETY: NULL or a live handle that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(registration) });
}

/// Sets up a pose: the identity.
///
/// @param pose The struct.
/// @param size sizeof *pose.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_station_pose_init(pose: *mut ptzcal_station_pose, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(pose, size) })
}

/// The pose.
///
/// @param registration The registration.
/// @param pose         Receives the pose; set up by ptzcal_station_pose_init.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_registration_get(
    registration: *const ptzcal_registration,
    pose: *mut ptzcal_station_pose,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (registration, pose) = unsafe { (borrow(registration)?, SizedOut::new(pose)?) };
        pose.write(&(&registration.0).into());
        Ok(())
    })
}

/// Copies the pairs of planes that are the same: of each pair the number in station a, then in station b.
///
/// @param registration The registration.
/// @param buffer       Receives 2 numbers for each pair; may be NULL when capacity is 0.
/// @param capacity     Numbers that fit.
/// @param needed       Receives twice the number of pairs; may be NULL.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_registration_copy_matches(
    registration: *const ptzcal_registration,
    buffer: *mut u32,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (registration, buffer) = unsafe { (borrow(registration)?, BufferOut::new(buffer, capacity, needed)?) };
        buffer.write(&registration.0.matches.iter().flatten().map(|i| *i as u32).collect::<Vec<_>>())
    })
}

/// Makes the roof edges where the matched planes meet, the same ones in the same order for both stations:
/// for ptzcal_estimate_pose_roof_edges.
///
/// @param registration The registration.
/// @param station_a    The planes that it was made from.
/// @param station_b    Those of the other station.
/// @param min_angle    Planes that meet at less than this make no edge, radians, 0 to pi/2.
/// @param edges_a      Receives station a's edges; free them with ptzcal_roof_edges_free.
/// @param edges_b      Receives station b's edges; free them with ptzcal_roof_edges_free.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT, also for planes of another registration.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_registration_roof_edges(
    registration: *const ptzcal_registration,
    station_a: *const ptzcal_planes,
    station_b: *const ptzcal_planes,
    min_angle: f64,
    edges_a: *mut *mut ptzcal_roof_edges,
    edges_b: *mut *mut ptzcal_roof_edges,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (edges_a, edges_b, registration, a, b) = unsafe {
            (
                HandleOut::new(edges_a)?,
                HandleOut::new(edges_b)?,
                borrow(registration)?,
                borrow(station_a)?,
                borrow(station_b)?,
            )
        };
        if !(0.0..=std::f64::consts::FRAC_PI_2).contains(&number(min_angle, "min_angle")?) {
            return Err(Error::invalid("min_angle", format!("{min_angle} is not in 0 to pi/2")));
        }
        let [first, second] = common_roof_edges(&a.0, &b.0, &registration.0.matches, min_angle)?;
        edges_a.give(ptzcal_roof_edges(Exclusive::new(first)));
        edges_b.give(ptzcal_roof_edges(Exclusive::new(second)));
        Ok(())
    })
}
