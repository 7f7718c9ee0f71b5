//! Simulator
//!
//! A rig in a furnished room, for tests and for learning: a head with camera and laser, and fixed
//! cameras, all rendered, with noise, motion, backlash, reflections and a clock of its own that runs
//! as fast as the work is done. A rig opened with the address of a simulator uses one; the functions
//! here also serve as devices for a host that tries out its own callbacks, and tell the truth that
//! results are compared with. Angles are radians, times are seconds of the simulator's clock.

use std::ffi::{c_char, c_void};

use super::args::{Out, number, string};
use super::call::{ErrorOut, guard, guard_or};
use super::camera::ptzcal_camera;
use super::devices::ptzcal_motion;
use super::error::ptzcal_error;
use super::handle::{Alone, Handle, HandleOut, borrow, free};
use super::image::ptzcal_image;
use super::pose::ptzcal_pose;
use super::rig_model::ptzcal_rig_model;
use super::sized::SizedOut;
use super::status::ptzcal_status;
use crate::device::{Frame, FrameSource, Laser, PanTiltZoom};
use crate::error::{Error, Result};
use crate::sim::{SimFrames, SimLaser, SimOptions, Simulator};

/// The number of the head camera where a camera is asked for; fixed cameras count from 0.
pub const PTZCAL_HEAD_CAMERA: u32 = 4294967295;

/// A simulated rig. The functions may be called from several threads at a time.
pub struct ptzcal_simulator {
    pub(super) simulator: Simulator,
    head: Alone<Source>,
    fixed: Vec<Alone<Source>>,
    /// Once it was switched by hand; like every laser port it goes off with its owner.
    laser: Alone<Option<SimLaser>>,
}

/// A camera's frames, and the one that was handed out last.
struct Source {
    frames: SimFrames,
    frame: Frame,
}

impl Handle for ptzcal_simulator {
    const NAME: &'static str = "simulator";
}

impl ptzcal_simulator {
    pub(super) fn of(simulator: Simulator) -> Result<Self> {
        let source = |frames| Alone::new(Source { frames, frame: Frame::empty() });
        let head = source(simulator.head_frames());
        let fixed =
            (0..simulator.fixed_cameras()).map(|i| simulator.fixed_frames(i).map(source)).collect::<Result<_>>()?;
        Ok(Self { simulator, head, fixed, laser: Alone::new(None) })
    }

    fn source(&self, camera: u32) -> Result<&Alone<Source>> {
        if camera == PTZCAL_HEAD_CAMERA {
            return Ok(&self.head);
        }
        self.fixed
            .get(camera as usize)
            .ok_or_else(|| Error::invalid("camera", format!("{camera}: there are {} fixed cameras", self.fixed.len())))
    }
}

/// Makes a simulator.
///
/// @param address   "sim:room", with options behind a question mark: "sim:room?seed=3&station=2".
///                  An unknown option is refused with a list of the known ones.
/// @param simulator Receives the simulator; free it with ptzcal_simulator_free.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_new(
    address: *const c_char,
    simulator: *mut *mut ptzcal_simulator,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (simulator, address) = unsafe { (HandleOut::new(simulator)?, string(address, "address")?) };
        simulator.give(ptzcal_simulator::of(Simulator::new(SimOptions::parse(address)?)?)?);
        Ok(())
    })
}

/// Frees a simulator. A rig that uses it keeps it alive for itself.
///
/// @param simulator The simulator; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_free(simulator: *mut ptzcal_simulator) {
    // SAFETY: NULL or a live simulator that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(simulator) });
}

/// What the owner of such a rig would know of it: the truth less a small misalignment.
///
/// @param simulator The simulator.
/// @param model     Receives the model; set up by ptzcal_rig_model_init.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_nominal_rig(
    simulator: *const ptzcal_simulator,
    model: *mut ptzcal_rig_model,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (simulator, model) = unsafe { (borrow(simulator)?, SizedOut::new(model)?) };
        model.write(&(&simulator.simulator.nominal_rig()).into());
        Ok(())
    })
}

/// The true rig.
///
/// @param simulator The simulator.
/// @param model     Receives the model; set up by ptzcal_rig_model_init.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_true_rig(
    simulator: *const ptzcal_simulator,
    model: *mut ptzcal_rig_model,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (simulator, model) = unsafe { (borrow(simulator)?, SizedOut::new(model)?) };
        model.write(&(&simulator.simulator.truth().rig).into());
        Ok(())
    })
}

/// How many fixed cameras there are.
///
/// @param simulator The simulator.
/// @param count     Receives the number.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_fixed_cameras(
    simulator: *const ptzcal_simulator,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (simulator, count) = unsafe { (borrow(simulator)?, Out::new(count, "count")?) };
        count.write(simulator.fixed.len());
        Ok(())
    })
}

/// A fixed camera as it truly is, in the rig's frame.
///
/// @param simulator The simulator.
/// @param index     Which fixed camera, from 0.
/// @param camera    Receives the camera; set up by ptzcal_camera_init.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such camera.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_true_camera(
    simulator: *const ptzcal_simulator,
    index: u32,
    camera: *mut ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (simulator, camera) = unsafe { (borrow(simulator)?, SizedOut::new(camera)?) };
        let truth = simulator.simulator.truth();
        let found = truth.fixed.get(index as usize);
        let found = found.ok_or_else(|| Error::invalid("index", format!("{index} of {}", truth.fixed.len())))?;
        camera.write(&found.into());
        Ok(())
    })
}

/// Where the rig truly stands: X_room = R X_rig + t, the room's frame being that of station 1.
///
/// @param simulator The simulator.
/// @param pose      Receives rotation, translation and angle; set up by ptzcal_pose_init.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_true_station(
    simulator: *const ptzcal_simulator,
    pose: *mut ptzcal_pose,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (simulator, pose) = unsafe { (borrow(simulator)?, SizedOut::new(pose)?) };
        pose.write(&ptzcal_pose::of(&simulator.simulator.truth().station.inverse()));
        Ok(())
    })
}

/// Moves the simulated head: as a PTZ callback does.
///
/// @param simulator The simulator.
/// @param pan       Radians.
/// @param tilt      Radians.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE; PTZCAL_STATUS_DEVICE_LOST.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_move(
    simulator: *const ptzcal_simulator,
    pan: f64,
    tilt: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(error, || {
        unsafe { borrow(simulator)? }.simulator.ptz().move_absolute(number(pan, "pan")?, number(tilt, "tilt")?)
    })
}

/// Reads the simulated head's position.
///
/// @param simulator The simulator.
/// @param pan       Receives radians.
/// @param tilt      Receives radians.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE_LOST.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_position(
    simulator: *const ptzcal_simulator,
    pan: *mut f64,
    tilt: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (simulator, pan, tilt) = unsafe { (borrow(simulator)?, Out::new(pan, "pan")?, Out::new(tilt, "tilt")?) };
        let position = simulator.simulator.ptz().position()?;
        pan.write(position.pan);
        tilt.write(position.tilt);
        Ok(())
    })
}

/// Says whether the simulated head moves.
///
/// @param simulator The simulator.
/// @param motion    Receives a ptzcal_motion.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE_LOST.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_motion(
    simulator: *const ptzcal_simulator,
    motion: *mut i32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (simulator, motion) = unsafe { (borrow(simulator)?, Out::new(motion, "motion")?) };
        motion.write(ptzcal_motion::from(simulator.simulator.ptz().motion()?) as i32);
        Ok(())
    })
}

/// Stops the simulated head.
///
/// @param simulator The simulator.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE_LOST.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_stop(
    simulator: *const ptzcal_simulator,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(error, || unsafe { borrow(simulator)? }.simulator.ptz().stop())
}

/// Switches the simulated laser. What was switched on here goes off when the simulator is freed.
///
/// @param simulator The simulator.
/// @param on        1 or 0.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_set_laser(
    simulator: *const ptzcal_simulator,
    on: i32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let simulator = unsafe { borrow(simulator)? };
        let on = switch(on)?;
        simulator.laser.lock("simulated laser")?.get_or_insert_with(|| simulator.simulator.laser()).set(on)
    })
}

/// 0 or 1, nothing else.
pub(super) fn switch(on: i32) -> Result<bool> {
    match on {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(Error::invalid("on", format!("{other} is neither 0 nor 1"))),
    }
}

/// Waits for a frame of a simulated camera; waiting moves the clock.
///
/// @param simulator  The simulator.
/// @param camera     A fixed camera from 0, or PTZCAL_HEAD_CAMERA.
/// @param not_before The frame's exposure begins then or later.
/// @param timeout    Longest wait, seconds.
/// @param image      Receives the frame; set up by ptzcal_image_init. Its pixels stay until the next
///                   call for the same camera, and until the simulator is freed.
/// @param timestamp  Receives when the exposure began.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE_TIMEOUT; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_next_frame(
    simulator: *const ptzcal_simulator,
    camera: u32,
    not_before: f64,
    timeout: f64,
    image: *mut ptzcal_image,
    timestamp: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (simulator, image, timestamp) =
            unsafe { (borrow(simulator)?, SizedOut::new(image)?, Out::new(timestamp, "timestamp")?) };
        let (not_before, timeout) = (number(not_before, "not_before")?, number(timeout, "timeout")?);
        let mut source = simulator.source(camera)?.lock("simulated camera")?;
        let Source { frames, frame } = &mut *source;
        frames.next_frame(not_before, timeout, frame)?;
        image.write(&image_of(frame)?);
        timestamp.write(frame.timestamp);
        Ok(())
    })
}

/// The C view of a frame, whose planes follow one another.
fn image_of(frame: &Frame) -> Result<ptzcal_image> {
    let view = frame.image.view()?;
    let mut image = ptzcal_image {
        format: frame.image.format as u32,
        width: frame.image.width,
        height: frame.image.height,
        ..super::sized::SizedStruct::initial()
    };
    for plane in 0..frame.image.format.planes() {
        let first = view.row(plane, 0);
        let rows = frame.image.format.rows(plane, frame.image.height);
        image.plane[plane] = first.as_ptr().cast::<c_void>();
        image.stride[plane] = first.len() as isize;
        image.size[plane] = first.len() * rows;
    }
    Ok(image)
}

/// The simulator's clock.
///
/// @param simulator The simulator.
/// @param now       Receives seconds.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_now(
    simulator: *const ptzcal_simulator,
    now: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (simulator, now) = unsafe { (borrow(simulator)?, Out::new(now, "now")?) };
        now.write(simulator.simulator.clock().now());
        Ok(())
    })
}

/// Lets seconds of the simulator's clock pass, at once.
///
/// @param simulator The simulator.
/// @param seconds   0 or more.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_simulator_sleep(
    simulator: *const ptzcal_simulator,
    seconds: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let simulator = unsafe { borrow(simulator)? };
        if number(seconds, "seconds")? < 0.0 {
            return Err(Error::invalid("seconds", format!("{seconds} is negative")));
        }
        simulator.simulator.clock().sleep(seconds);
        Ok(())
    })
}
