//! Stations along a path
//!
//! A survey from many stations, of which nobody needs to say which shots hit which wall: every pair of
//! stations is registered by the planes that both saw, planes that are the same become one, loops of stations
//! are closed as a test, and the shots that hit the planes enter the joint adjustment. Solving it puts all
//! stations, and every fixed camera that any of them lit, into one frame with their covariance.

use std::ffi::{CString, c_char, c_void};

use super::adjustment::ptzcal_adjustment;
use super::args::{BufferOut, array, number};
use super::call::{ErrorOut, guard, guard_or};
use super::cancel::ptzcal_cancel;
use super::error::{c_string, ptzcal_error};
use super::handle::{Handle, HandleOut, borrow, free};
use super::planes::ptzcal_planes_options;
use super::progress::{ptzcal_progress_fn, reporter};
use super::registration::{ptzcal_registration, ptzcal_station_options};
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::network::{Link, LoopClosure, TieOptions, Ties, tie_stations};

/// How stations are tied.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_tie_options {
    /// Set by ptzcal_tie_options_init.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// How planes are found; their flatness is that of the survey's planes too, 1e-6 to 1 m. NULL: the
    /// defaults.
    pub planes: *const ptzcal_planes_options,
    /// How two stations are registered; a prior only where there is one pair: what is known of the stations
    /// is said with their poses. NULL: the defaults.
    pub stations: *const ptzcal_station_options,
    /// Pairs of stations to register, 2 numbers a pair, each pair once. NULL: every station with every other.
    pub pairs: *const u32,
    /// Number of pairs; 0 with NULL.
    pub pair_count: usize,
    /// Chance below which a loop of stations does not close and is refused, 0 to 1.
    pub min_closure: f64,
}

// SAFETY: numbers and raw pointers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_tie_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 8 + 3 * size_of::<*const u32>() + size_of::<usize>() + 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            reserved: 0,
            planes: std::ptr::null(),
            stations: std::ptr::null(),
            pairs: std::ptr::null(),
            pair_count: 0,
            min_closure: TieOptions::default().min_closure,
        }
    }
}

impl ptzcal_tie_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or a struct as long as its `struct_size` says, whose pointers are NULL or good.
    unsafe fn settings(options: *const Self) -> Result<TieOptions> {
        if options.is_null() {
            return Ok(TieOptions::default());
        }
        // SAFETY: by this function's contract.
        let options = unsafe { sized::read(options)? };
        if options.pairs.is_null() && options.pair_count > 0 {
            return Err(Error::NullPointer { name: "pairs" });
        }
        // SAFETY: by this function's contract.
        let (planes, stations, pairs) = unsafe {
            (
                ptzcal_planes_options::settings(options.planes)?,
                ptzcal_station_options::settings(options.stations)?,
                array(options.pairs.cast::<[u32; 2]>(), options.pair_count, "pairs")?,
            )
        };
        let named = || pairs.iter().map(|pair| pair.map(|station| station as usize)).collect();
        Ok(TieOptions {
            planes,
            stations,
            pairs: (!options.pairs.is_null()).then(named),
            min_closure: number(options.min_closure, "min_closure")?,
            ..TieOptions::default()
        })
    }
}

/// What ties the stations of a survey. Immutable: any number of threads may read it.
pub struct ptzcal_ties {
    ties: Ties,
    /// Why each link has no pose; "" where it has one.
    reasons: Vec<CString>,
}

impl Handle for ptzcal_ties {
    const NAME: &'static str = "ties";
}

impl ptzcal_ties {
    fn link(&self, index: u32) -> Result<&Link> {
        let links = &self.ties.links;
        links.get(index as usize).ok_or_else(|| Error::invalid("index", format!("{index} of {}", links.len())))
    }

    fn closure(&self, index: u32) -> Result<&LoopClosure> {
        let loops = &self.ties.loops;
        loops.get(index as usize).ok_or_else(|| Error::invalid("index", format!("{index} of {}", loops.len())))
    }
}

/// What ties the stations of a survey, in numbers.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_ties_summary {
    /// Set by ptzcal_ties_summary_init.
    pub struct_size: u32,
    /// Pairs of stations that were tried: see ptzcal_ties_get_link.
    pub links: u32,
    /// Those of them that have a pose.
    pub linked: u32,
    /// Loops of links: see ptzcal_ties_get_loop.
    pub loops: u32,
    /// Planes that were added to the survey.
    pub planes: u64,
    /// Shots that were said to hit one of them.
    pub shots: u64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_ties_summary {
    const NAME: &'static str = "summary";
    const FIRST_SIZE: usize = 16 + 2 * 8;
    fn initial() -> Self {
        Self { struct_size: size_of::<Self>() as u32, links: 0, linked: 0, loops: 0, planes: 0, shots: 0 }
    }
}

/// Two stations that were tried.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_link {
    /// Set by ptzcal_link_init.
    pub struct_size: u32,
    /// A ptzcal_status: PTZCAL_STATUS_OK where planes tell the pose between them, or why they do not, as
    /// ptzcal_register_stations says it (PTZCAL_STATUS_AMBIGUOUS for instance).
    pub status: i32,
    /// Station a.
    pub station_a: u32,
    /// Station b.
    pub station_b: u32,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_link {
    const NAME: &'static str = "link";
    const FIRST_SIZE: usize = 16;
    fn initial() -> Self {
        Self { struct_size: size_of::<Self>() as u32, status: 0, station_a: 0, station_b: 0 }
    }
}

/// A loop of stations, and what is left when its links are followed all the way around.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_loop {
    /// Set by ptzcal_loop_init.
    pub struct_size: u32,
    /// How many stations it has: see ptzcal_ties_copy_loop.
    pub stations: u32,
    /// Angle that is left, radians.
    pub rotation: f64,
    /// Distance that is left, metres.
    pub position: f64,
    /// Chance of that or more by the links' covariances.
    pub probability: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_loop {
    const NAME: &'static str = "closure";
    const FIRST_SIZE: usize = 8 + 3 * 8;
    fn initial() -> Self {
        Self { struct_size: size_of::<Self>() as u32, stations: 0, rotation: 0.0, position: 0.0, probability: 0.0 }
    }
}

/// Sets up options: all pairs of stations, the defaults of ptzcal_planes_options_init and
/// ptzcal_station_options_init, loops that close by a chance of 1e-6 or more.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_tie_options_init(options: *mut ptzcal_tie_options, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Finds the planes that the stations of a survey share, and adds them to it with the shots that hit them. Of
/// the stations no pose needs to be known; what was said of them (odometry, with its covariance) settles what
/// planes alone leave ambiguous. Shots that the head camera did not see say nothing here. A survey that is
/// refused is left as it was. ptzcal_adjustment_solve then finds stations and cameras together.
///
/// @param adjustment The survey, at most 100 stations. It is in use until the call returns.
/// @param options    The options, set up by ptzcal_tie_options_init; may be NULL: the defaults.
/// @param progress   Hears how many steps are done (each station is one, then each pair), and can stop them;
///                   may be NULL.
/// @param user       Handed to it.
/// @param token      Stops it from another thread; may be NULL. It is looked at before each step.
/// @param ties       Receives what ties the stations; free it with ptzcal_ties_free.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BAD_STATE when a station without a pose shares planes with none of
///         the others (the message has the reason of each pair); PTZCAL_STATUS_AMBIGUOUS when a loop of
///         stations does not close (the message has it); PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_CANCELLED; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_tie_stations(
    adjustment: *mut ptzcal_adjustment,
    options: *const ptzcal_tie_options,
    progress: ptzcal_progress_fn,
    user: *mut c_void,
    token: *const ptzcal_cancel,
    ties: *mut *mut ptzcal_ties,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, adjustment, options, cancel) = unsafe {
            (
                HandleOut::new(ties)?,
                borrow(adjustment)?,
                ptzcal_tie_options::settings(options)?,
                ptzcal_cancel::share(token),
            )
        };
        let mut survey = adjustment.0.write(ptzcal_adjustment::NAME)?;
        let ties = tie_stations(&mut survey, &TieOptions { cancel, ..options }, reporter(progress, user))?;
        let reason = |link: &Link| c_string(&link.pose.as_ref().err().map(Error::to_string).unwrap_or_default());
        out.give(ptzcal_ties { reasons: ties.links.iter().map(reason).collect(), ties });
        Ok(())
    })
}

/// Frees ties. Registrations taken from them live on.
///
/// @param ties The ties; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_ties_free(ties: *mut ptzcal_ties) {
    // SAFETY: NULL or a live handle that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(ties) });
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
pub unsafe extern "C" fn ptzcal_ties_summary_init(summary: *mut ptzcal_ties_summary, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(summary, size) })
}

/// How many links, loops, planes and shots there are.
///
/// @param ties    The ties.
/// @param summary Receives the numbers; set up by ptzcal_ties_summary_init.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_ties_get_summary(
    ties: *const ptzcal_ties,
    summary: *mut ptzcal_ties_summary,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (ties, summary) = unsafe { (borrow(ties)?, SizedOut::new(summary)?) };
        let Ties { links, loops, planes, shots } = &ties.ties;
        summary.write(&ptzcal_ties_summary {
            links: links.len() as u32,
            linked: links.iter().filter(|link| link.pose.is_ok()).count() as u32,
            loops: loops.len() as u32,
            planes: *planes as u64,
            shots: *shots as u64,
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// Sets up a link: everything 0.
///
/// @param link The struct.
/// @param size sizeof *link.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_link_init(link: *mut ptzcal_link, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(link, size) })
}

/// A pair of stations that was tried: in the order of the options' pairs, or 0 and 1, 0 and 2, and so on.
///
/// @param ties  The ties.
/// @param index Which one, from 0.
/// @param link  Receives the link; set up by ptzcal_link_init.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an index that is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_ties_get_link(
    ties: *const ptzcal_ties,
    index: u32,
    link: *mut ptzcal_link,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (ties, out) = unsafe { (borrow(ties)?, SizedOut::new(link)?) };
        let Link { stations: [a, b], pose } = ties.link(index)?;
        let status = pose.as_ref().map_or_else(|e| e.status().into(), |_| ptzcal_status::Ok);
        out.write(&ptzcal_link {
            status: status as i32,
            station_a: *a as u32,
            station_b: *b as u32,
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// Why planes do not tell the pose between the stations of a link.
///
/// @param ties  The ties; may be NULL.
/// @param index The link.
/// @return A string that lives as long as the ties; "" for a link that has a pose and when there is no such
///         link; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_ties_link_reason(ties: *const ptzcal_ties, index: u32) -> *const c_char {
    // SAFETY: NULL or live ties, as the header demands.
    let reason = unsafe { ties.as_ref() }.and_then(|ties| ties.reasons.get(index as usize));
    reason.map_or(c"".as_ptr(), |reason| reason.as_ptr())
}

/// The pose between the stations of a link, and the planes that it is from.
///
/// @param ties         The ties.
/// @param index        The link.
/// @param registration Receives the registration; free it with ptzcal_registration_free.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an index that is none; the link's status
///         for one that has no pose.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_ties_get_registration(
    ties: *const ptzcal_ties,
    index: u32,
    registration: *mut *mut ptzcal_registration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (registration, ties) = unsafe { (HandleOut::new(registration)?, borrow(ties)?) };
        registration.give(ptzcal_registration(ties.link(index)?.pose.clone()?));
        Ok(())
    })
}

/// Sets up a loop: everything 0.
///
/// @param closure The struct.
/// @param size    sizeof *closure.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_loop_init(closure: *mut ptzcal_loop, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(closure, size) })
}

/// How well a loop of stations closes.
///
/// @param ties    The ties.
/// @param index   Which loop, from 0.
/// @param closure Receives what is left; set up by ptzcal_loop_init.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an index that is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_ties_get_loop(
    ties: *const ptzcal_ties,
    index: u32,
    closure: *mut ptzcal_loop,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (ties, out) = unsafe { (borrow(ties)?, SizedOut::new(closure)?) };
        let LoopClosure { stations, rotation, position, probability } = ties.closure(index)?;
        out.write(&ptzcal_loop {
            stations: stations.len() as u32,
            rotation: *rotation,
            position: *position,
            probability: *probability,
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// Copies the stations of a loop in their order; the last is linked to the first.
///
/// @param ties     The ties.
/// @param index    The loop.
/// @param buffer   Receives the stations; may be NULL when capacity is 0.
/// @param capacity Numbers that fit.
/// @param needed   Receives the number of stations; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an index that is none;
///         PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_ties_copy_loop(
    ties: *const ptzcal_ties,
    index: u32,
    buffer: *mut u32,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (ties, buffer) = unsafe { (borrow(ties)?, BufferOut::new(buffer, capacity, needed)?) };
        buffer.write(&ties.closure(index)?.stations.iter().map(|station| *station as u32).collect::<Vec<_>>())
    })
}
