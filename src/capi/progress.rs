//! Progress
//!
//! Long verbs take a callback that hears how far the work is and can stop it.

use std::ffi::c_void;
use std::ops::ControlFlow;
use std::time::Instant;

use super::log::User;
use super::shot::ptzcal_shot;

/// How far the work is. The library fills it in; `struct_size` says which members there are.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_progress {
    /// Size of the struct as the library knows it. Look at it before you read a member that is
    /// newer than the library you must run with.
    pub struct_size: u32,
    /// Which pass over the work this is, from 1.
    pub pass: u32,
    /// How many passes there will be.
    pub passes: u32,
    /// 1 when the newest step gave a measurement, 0 when it gave none.
    pub measured: u32,
    /// Steps of this pass that are done.
    pub done: u64,
    /// Steps of this pass in all.
    pub total: u64,
    /// Seconds since the work began.
    pub elapsed: f64,
    /// Estimated seconds until it is done; negative while nobody knows.
    pub seconds_left: f64,
    /// A scan's newest shot, safe in the journal if there is one; NULL before the first, and for work
    /// that is no scan.
    pub shot: *const ptzcal_shot,
}

impl ptzcal_progress {
    /// Tells the host; `Break` when it wants the work to stop.
    ///
    /// # Safety
    /// `callback` may be called with `user`.
    pub(super) unsafe fn tell(
        &self,
        callback: unsafe extern "C" fn(*mut c_void, *const Self) -> i32,
        user: User,
    ) -> ControlFlow<()> {
        // SAFETY: by this function's contract; the struct outlives the call.
        match unsafe { callback(user.get(), self) } {
            0 => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        }
    }
}

/// Hears about progress. It runs on the thread that called the verb, never under a lock of the
/// library, and must not throw or longjmp. It may call the library, but not with the handle that is
/// at work (PTZCAL_STATUS_BUSY).
///
/// @param user     What was given with the callback.
/// @param progress Valid during the call.
/// @return 0 to go on; any other number stops the work. A scan that is stopped returns what it has.
pub type ptzcal_progress_fn = Option<unsafe extern "C" fn(user: *mut c_void, progress: *const ptzcal_progress) -> i32>;

/// A reporter of work that is steps done of a total.
pub(super) fn reporter(progress: ptzcal_progress_fn, user: *mut c_void) -> impl FnMut(usize, usize) -> ControlFlow<()> {
    let (begin, user) = (Instant::now(), User::new(user));
    move |done, total| {
        let Some(progress) = progress else { return ControlFlow::Continue(()) };
        let elapsed = begin.elapsed().as_secs_f64();
        let told = ptzcal_progress {
            struct_size: size_of::<ptzcal_progress>() as u32,
            pass: 1,
            passes: 1,
            measured: 1,
            done: done as u64,
            total: total as u64,
            elapsed,
            seconds_left: elapsed / done.max(1) as f64 * total.saturating_sub(done) as f64,
            shot: std::ptr::null(),
        };
        // SAFETY: the caller keeps the header's rules for callbacks.
        unsafe { told.tell(progress, user) }
    }
}
