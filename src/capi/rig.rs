//! Rigs
//!
//! A rig is a pan-tilt head with a camera and a laser. It is opened on the host's callbacks or on an
//! address. The laser is off whenever the library is not sure: while the head moves, on every error,
//! when a call is cancelled, and from the moment a rig is closed.

use super::angle_map::mapped;
use super::args::{Out, number, vectors};
use super::call::{ErrorOut, guard};
use super::cancel::ptzcal_cancel;
use super::error::ptzcal_error;
use super::handle::{Alone, Handle, HandleOut, borrow, take};
use super::rig_model::{model_in, ptzcal_rig_model};
use super::rig_options::ptzcal_rig_options;
use super::simulator::{ptzcal_simulator, switch};
use super::sized::SizedOut;
use super::status::ptzcal_status;
use crate::control::{Cancel, SystemClock};
use crate::device::{Address, Brake, Laser, Surroundings, open_frames, open_laser, open_ptz};
use crate::error::{Error, Result};
use crate::geometry::RigModel;
use crate::rig::{Aim, LaserControl, Rig, RigParts, WholeRig, aim_at_point};
use nalgebra::{Vector2, Vector3};
use std::sync::Arc;

/// An open rig.
pub struct ptzcal_rig {
    pub(super) rig: Alone<Rig>,
    pub(super) whole: Option<WholeRig>,
    /// What devices of a scan are opened with.
    pub(super) around: Surroundings,
    laser: LaserControl,
    brake: Option<Arc<dyn Brake>>,
    model: RigModel,
    /// Set by ptzcal_rig_stop while another call is at work.
    stop: Cancel,
}

impl Handle for ptzcal_rig {
    const NAME: &'static str = "rig";
}

impl ptzcal_rig {
    /// The rig for one call, and a token that both the caller's and ptzcal_rig_stop cancel.
    pub(super) fn work(&self, token: Cancel) -> Result<(std::sync::MutexGuard<'_, Rig>, Cancel)> {
        let rig = self.rig.lock(Self::NAME)?;
        self.stop.reset();
        Ok((rig, token.or(&self.stop)))
    }
}

/// Opens a rig: takes its devices over and switches the laser off; the head does not move.
///
/// @param options What the rig is made of.
/// @param rig     Receives the rig; close it with ptzcal_rig_close.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for missing devices, a missing model and
///         values that make no sense; PTZCAL_STATUS_UNSUPPORTED for an address that this version
///         does not know; PTZCAL_STATUS_DEVICE and its kin when a device fails.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_open(
    options: *const ptzcal_rig_options,
    rig: *mut *mut ptzcal_rig,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, options) = unsafe { (HandleOut::new(rig)?, borrow(options)?) };
        let s = options.0.read(ptzcal_rig_options::NAME)?;
        let whole = s.address.as_deref().map(WholeRig::open).transpose()?;
        let whole = whole.as_ref();
        let clock = match (&s.clock, whole) {
            (Some(clock), _) => clock.clone(),
            (None, Some(whole)) => whole.clock(),
            (None, None) => Arc::new(SystemClock::default()),
        };
        let around = Surroundings { clock: clock.clone(), log: s.log.clone(), credentials: s.credentials.clone() };
        let missing = |what: &str| Error::invalid("options", format!("no {what}: set an address or the callback"));
        let at = |address: &Option<String>| address.as_deref().map(Address::parse).transpose();
        // First, so that a laser left on is off whatever else fails to open.
        let mut laser: Box<dyn Laser> = match (&s.laser, at(&s.laser_address)?, whole) {
            (Some(laser), _, _) => Box::new(laser.clone()),
            (None, Some(address), _) => open_laser(&address, &around)?,
            (None, None, Some(whole)) => whole.laser(),
            (None, None, None) => return Err(missing("laser")),
        };
        laser.set(false)?;
        let model = s.model.or_else(|| whole.map(WholeRig::model));
        let parts = RigParts {
            model: model.ok_or_else(|| Error::invalid("options", "no rig model: set one"))?,
            laser,
            ptz: mapped(
                match (&s.ptz, at(&s.ptz_address)?, whole) {
                    (Some(ptz), _, _) => Box::new(ptz.clone()),
                    (None, Some(address), _) => open_ptz(&address, &around)?,
                    (None, None, Some(whole)) => whole.ptz(s.log.clone())?,
                    (None, None, None) => return Err(missing("head")),
                },
                s.angle_map.as_ref(),
            )?,
            frames: match (&s.frames, at(&s.frames_address)?, whole) {
                (Some(frames), _, _) => Box::new(frames.clone()),
                (None, Some(address), _) => open_frames(&address, &around)?,
                (None, None, Some(whole)) => whole.frames()?,
                (None, None, None) => return Err(missing("head camera")),
            },
            clock,
            log: s.log.clone(),
        };
        let (model, open) = (parts.model, Rig::open(parts, s.options)?);
        let (laser, brake) = (open.laser(), open.brake());
        let whole = whole.cloned();
        out.give(ptzcal_rig { rig: Alone::new(open), whole, around, laser, brake, model, stop: Cancel::new() });
        Ok(())
    })
}

/// Closes a rig: stops the head, switches the laser off for good, frees the handle. The handle is
/// gone whatever is returned. Also right after an earlier call panicked.
///
/// @param rig   The rig; may be NULL: nothing happens. No other call may be at work with it.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; the device's own when the head or the laser could not be switched off.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_close(rig: *mut ptzcal_rig, error: *mut *mut ptzcal_error) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: NULL or a live rig that nobody uses any more, as the header demands.
    guard(error, || unsafe { take(rig) }.map_or(Ok(()), |rig| rig.rig.into_inner().close()))
}

/// The rig's model.
///
/// @param rig   The rig.
/// @param model Receives the model; set up by ptzcal_rig_model_init.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_get_model(
    rig: *const ptzcal_rig,
    model: *mut ptzcal_rig_model,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (rig, model) = unsafe { (borrow(rig)?, SizedOut::new(model)?) };
        model.write(&(&rig.model).into());
        Ok(())
    })
}

/// The simulator behind a rig that was opened with its address: the same room, the same truth.
///
/// @param rig       The rig.
/// @param simulator Receives the simulator; free it with ptzcal_simulator_free.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED when there is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_simulator(
    rig: *const ptzcal_rig,
    simulator: *mut *mut ptzcal_simulator,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, rig) = unsafe { (HandleOut::new(simulator)?, borrow(rig)?) };
        let none = || Error::Unsupported { what: "the simulator of a rig that is not simulated".into() };
        let Some(WholeRig::Simulated(simulator)) = &rig.whole else { return Err(none()) };
        out.give(ptzcal_simulator::of(simulator.clone())?);
        Ok(())
    })
}

/// Moves the head and waits until it stands still. The laser is off before it moves.
///
/// @param rig   The rig.
/// @param pan   Reading of the device, radians; positive is right.
/// @param tilt  Reading of the device, radians; positive is up.
/// @param token Stops the move from another thread; may be NULL.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE outside the head's range;
///         PTZCAL_STATUS_DEVICE_TIMEOUT when it does not arrive; PTZCAL_STATUS_CANCELLED: the head
///         was stopped; PTZCAL_STATUS_BUSY; a device's own.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_move(
    rig: *mut ptzcal_rig,
    pan: f64,
    tilt: f64,
    token: *const ptzcal_cancel,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let (pan, tilt) = (number(pan, "pan")?, number(tilt, "tilt")?);
        // SAFETY: the caller keeps the header's rules for pointers.
        let (mut rig, cancel) = unsafe { borrow(rig)?.work(ptzcal_cancel::share(token))? };
        rig.move_to(pan, tilt, &cancel).map(|_| ())
    })
}

/// Reads where the head is.
///
/// @param rig   The rig.
/// @param pan   Receives the reading, radians.
/// @param tilt  Receives the reading, radians.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY; a device's own.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_position(
    rig: *mut ptzcal_rig,
    pan: *mut f64,
    tilt: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (rig, pan, tilt) = unsafe { (borrow(rig)?, Out::new(pan, "pan")?, Out::new(tilt, "tilt")?) };
        let position = rig.rig.lock(ptzcal_rig::NAME)?.position()?;
        pan.write(position.pan);
        tilt.write(position.tilt);
        Ok(())
    })
}

/// Turns the head so that the laser hits a point, and waits until it stands still.
///
/// @param rig   The rig.
/// @param xyz   3 numbers: the point in the rig's world, metres.
/// @param token Stops the move from another thread; may be NULL.
/// @param pan   Receives the reading aimed at, radians; may be NULL.
/// @param tilt  Receives the reading aimed at, radians; may be NULL.
/// @param error Receives the error; may be NULL.
/// @return As ptzcal_rig_move; PTZCAL_STATUS_UNREACHABLE also for points nearer than the laser's
///         distance from the axes.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_aim_at_point(
    rig: *mut ptzcal_rig,
    xyz: *const f64,
    token: *const ptzcal_cancel,
    pan: *mut f64,
    tilt: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (rig, xyz, token, place) = unsafe {
            (borrow(rig)?, vectors::<3>(xyz, 1, "xyz")?, ptzcal_cancel::share(token), AimOut::new(pan, tilt)?)
        };
        let (mut rig, cancel) = rig.work(token)?;
        place.write(rig.aim_at_point(&Vector3::from(xyz[0]), &cancel)?);
        Ok(())
    })
}

/// Turns the head so that the laser hits what the head camera sees now at a pixel.
///
/// @param rig   The rig.
/// @param u     Pixel in the head camera's image.
/// @param v     Pixel in the head camera's image.
/// @param depth Distance of what is seen along the camera's axis, metres, positive.
/// @param token Stops the move from another thread; may be NULL.
/// @param pan   Receives the reading aimed at, radians; may be NULL.
/// @param tilt  Receives the reading aimed at, radians; may be NULL.
/// @param error Receives the error; may be NULL.
/// @return As ptzcal_rig_aim_at_point.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_aim_at_pixel(
    rig: *mut ptzcal_rig,
    u: f64,
    v: f64,
    depth: f64,
    token: *const ptzcal_cancel,
    pan: *mut f64,
    tilt: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let pixel = Vector2::new(number(u, "u")?, number(v, "v")?);
        let depth = number(depth, "depth")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (rig, token, place) = unsafe { (borrow(rig)?, ptzcal_cancel::share(token), AimOut::new(pan, tilt)?) };
        let (mut rig, cancel) = rig.work(token)?;
        place.write(rig.aim_at_pixel(&pixel, depth, &cancel)?);
        Ok(())
    })
}

/// Where the angles of an aim go; either place may be NULL.
struct AimOut([Option<Out<f64>>; 2]);

impl AimOut {
    /// # Safety
    /// Both are NULL or writable until the call ends.
    unsafe fn new(pan: *mut f64, tilt: *mut f64) -> Result<Self> {
        let place = |ptr: *mut f64, name| {
            // SAFETY: by this function's contract.
            if ptr.is_null() { Ok(None) } else { unsafe { Out::new(ptr, name) }.map(Some) }
        };
        Ok(Self([place(pan, "pan")?, place(tilt, "tilt")?]))
    }

    fn write(self, aim: Aim) {
        for (place, angle) in self.0.into_iter().zip([aim.pan, aim.tilt]) {
            if let Some(place) = place {
                place.write(angle);
            }
        }
    }
}

/// The readings at which the laser of a rig hits a point, without moving anything.
///
/// @param model The rig's model.
/// @param xyz   3 numbers: the point in the rig's world, metres.
/// @param pan   Receives the reading, radians; may be NULL.
/// @param tilt  Receives the reading, radians; may be NULL.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_INVALID_ARGUMENT for a model that makes no sense.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_model_aim(
    model: *const ptzcal_rig_model,
    xyz: *const f64,
    pan: *mut f64,
    tilt: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (model, xyz, place) = unsafe { (model_in(model)?, vectors::<3>(xyz, 1, "xyz")?, AimOut::new(pan, tilt)?) };
        place.write(aim_at_point(&model, &Vector3::from(xyz[0]))?);
        Ok(())
    })
}

/// Switches the laser by hand. On is refused while the head moves. It goes off again by itself only
/// when a call on this rig finds that its longest time on is over; the next move switches it off.
///
/// @param rig   The rig.
/// @param on    1 or 0.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_LASER_REFUSED; PTZCAL_STATUS_BUSY; a device's own.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_set_laser(
    rig: *mut ptzcal_rig,
    on: i32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let on = switch(on)?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { borrow(rig)? }.rig.lock(ptzcal_rig::NAME)?.set_laser(on)
    })
}

/// Stops the head and switches the laser off, now. While another thread's call is at work with the
/// rig, that call is cancelled: it stops the head and switches the laser off on its way out. Heads
/// opened by address are stopped beside it at once.
///
/// @param rig   The rig.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; a device's own when it did not obey.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_stop(rig: *const ptzcal_rig, error: *mut *mut ptzcal_error) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let rig = unsafe { borrow(rig)? };
        rig.stop.cancel();
        match rig.rig.lock(ptzcal_rig::NAME) {
            Ok(mut alone) => alone.stop(),
            Err(Error::Busy { .. }) => rig.brake.as_ref().map_or(Ok(()), |brake| brake.stop()),
            Err(e) => Err(e),
        }
    })
}

/// Switches the laser off and keeps it off until ptzcal_rig_release, from any thread and whatever
/// else is going on. Call it from an interlock, a timer, a button.
///
/// @param rig   The rig.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; the laser's own when it did not obey: cut its power.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_emergency_off(
    rig: *const ptzcal_rig,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(error, || unsafe { borrow(rig)? }.laser.emergency_off())
}

/// Ends an emergency: the laser may be switched on again.
///
/// @param rig   The rig.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_LASER_REFUSED when the laser cannot be trusted.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_release(rig: *const ptzcal_rig, error: *mut *mut ptzcal_error) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(error, || unsafe { borrow(rig)? }.laser.release())
}
