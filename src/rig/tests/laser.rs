//! Laser safety against a laser that records what it was told.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

use crate::control::{Cancel, Clock, Log, LogLevel};
use crate::device::{Laser, LaserLimits};
use crate::error::{Error, Result};
use crate::rig::fake::{Event, Fake, FakeLaser, Fault};
use crate::rig::laser::LaserControl;

fn control(fake: &Fake) -> LaserControl {
    LaserControl::new(Box::new(FakeLaser(fake.clone())), Arc::new(fake.clone()), Log::silent(), &LaserLimits::default())
        .unwrap()
}

fn limited(fake: &Fake, laser: Box<dyn Laser>, limits: &LaserLimits) -> Result<LaserControl> {
    LaserControl::new(laser, Arc::new(fake.clone()), Log::silent(), limits)
}

fn lit(fake: &Fake) -> bool {
    fake.world().laser_lit
}

#[test]
fn the_laser_is_off_at_open_and_lit_only_while_its_guard_lives() {
    let fake = Fake::new();
    let laser = control(&fake);
    assert_eq!(fake.world().history, [Event::Laser(false)]);
    let guard = laser.light().unwrap();
    assert!(lit(&fake) && laser.is_on());
    assert!(matches!(laser.light(), Err(Error::Busy { .. })));
    assert!(lit(&fake));
    drop(guard);
    assert!(!lit(&fake) && !laser.is_on());
    laser.light().unwrap().off().unwrap();
    assert!(!lit(&fake));
    let panicked = catch_unwind(AssertUnwindSafe(|| {
        let _guard = laser.light().unwrap();
        panic!("in the host's code");
    }));
    assert!(panicked.is_err() && !lit(&fake));
    // The last clone to go switches off as well.
    std::mem::forget(laser.light().unwrap());
    assert!(lit(&fake));
}

#[test]
fn the_laser_never_stays_on_longer_than_allowed() {
    let fake = Fake::new();
    let laser = control(&fake);
    let guard = laser.light().unwrap();
    fake.sleep(1.5);
    assert!((guard.time_left().unwrap() - 0.5).abs() < 1e-9);
    laser.enforce().unwrap();
    assert!(lit(&fake));
    fake.sleep(0.5);
    assert!(matches!(guard.time_left(), Err(Error::DeviceTimeout { .. })));
    assert!(!lit(&fake));
    assert!(matches!(guard.time_left(), Err(Error::LaserRefused { .. })));
    drop(guard);
    let guard = laser.light().unwrap();
    fake.sleep(2.5);
    laser.enforce().unwrap();
    assert!(!lit(&fake) && guard.time_left().is_err());
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let limits = LaserLimits { max_on: bad, ..LaserLimits::default() };
        assert!(limited(&fake, Box::new(FakeLaser(fake.clone())), &limits).is_err());
    }
}

#[test]
fn the_laser_never_has_more_than_its_share_of_time() {
    let fake = Fake::new();
    let limits = LaserLimits { max_on: 2.0, duty: 0.1, window: 10.0 };
    let laser = limited(&fake, Box::new(FakeLaser(fake.clone())), &limits).unwrap();
    let guard = laser.light().unwrap();
    fake.sleep(0.6);
    assert!((guard.time_left().unwrap() - 0.4).abs() < 1e-9);
    guard.off().unwrap();
    let guard = laser.light().unwrap();
    fake.sleep(0.4);
    let error = guard.time_left().unwrap_err();
    assert!(matches!(error, Error::LaserRefused { .. }) && error.to_string().contains("0.1 of the last 10 s"));
    assert!(!lit(&fake));
    let error = laser.light().map(|_| ()).unwrap_err();
    assert!(matches!(error, Error::LaserRefused { .. }) && error.to_string().contains("wait"), "{error}");
    assert!(!lit(&fake));
    // A tenth of its second is free 10 s after it was first used; a wait hears of cancels and stops.
    let start = fake.now();
    laser.wait_until_allowed(0.0, &Cancel::new()).unwrap();
    assert!((fake.now() - start - 9.1).abs() < 0.11, "{}", fake.now() - start);
    drop(laser.light().unwrap());
    let cancelled = Cancel::new();
    cancelled.cancel();
    assert_eq!(laser.wait_until_allowed(0.0, &cancelled), Err(Error::Cancelled));
    laser.emergency_off().unwrap();
    assert!(matches!(laser.wait_until_allowed(0.0, &Cancel::new()), Err(Error::LaserRefused { .. })));
    for duty in [0.0, -1.0, 1.5, f64::NAN] {
        assert!(limited(&fake, Box::new(FakeLaser(fake.clone())), &LaserLimits { duty, ..limits }).is_err());
    }
}

/// A laser with limits of its own that goes off by itself.
struct Independent(FakeLaser, Arc<AtomicBool>);

impl Laser for Independent {
    fn set(&mut self, on: bool) -> Result<()> {
        self.0.set(on)
    }
    fn check(&mut self) -> Result<()> {
        match self.1.load(Ordering::SeqCst) {
            true => Err(Error::DeviceLost { reason: "the guard has ended".into() }),
            false => Ok(()),
        }
    }
    fn limits(&self) -> LaserLimits {
        LaserLimits { max_on: 0.5, ..LaserLimits::NONE }
    }
}

#[test]
fn a_laser_that_goes_off_by_itself_is_noticed_and_its_own_limits_are_kept() {
    let fake = Fake::new();
    let gone = Arc::new(AtomicBool::new(false));
    let laser = Box::new(Independent(FakeLaser(fake.clone()), gone.clone()));
    let laser = limited(&fake, laser, &LaserLimits::default()).unwrap();
    let guard = laser.light().unwrap();
    assert!((guard.time_left().unwrap() - 0.5).abs() < 1e-9);
    gone.store(true, Ordering::SeqCst);
    assert!(matches!(guard.time_left(), Err(Error::DeviceLost { .. })));
    assert!(!lit(&fake));
    gone.store(false, Ordering::SeqCst);
    let _guard = laser.light().unwrap();
    laser.enforce().unwrap();
    assert!(lit(&fake));
    gone.store(true, Ordering::SeqCst);
    laser.enforce().unwrap();
    assert!(!lit(&fake) && !laser.is_on());
}

#[test]
fn a_stale_guard_does_not_end_a_newer_period() {
    let fake = Fake::new();
    let laser = control(&fake);
    let old = laser.light().unwrap();
    laser.off().unwrap();
    let new = laser.light().unwrap();
    drop(old);
    assert!(lit(&fake) && new.time_left().is_ok());
    drop(new);
    assert!(!lit(&fake));
}

#[test]
fn an_emergency_stop_holds_until_released() {
    let fake = Fake::new();
    let laser = control(&fake);
    let guard = laser.light().unwrap();
    let other = laser.clone();
    std::thread::spawn(move || other.emergency_off().unwrap()).join().unwrap();
    assert!(!lit(&fake) && laser.is_emergency());
    assert!(matches!(guard.time_left(), Err(Error::LaserRefused { .. })));
    drop(guard);
    assert!(matches!(laser.light(), Err(Error::LaserRefused { .. })));
    assert!(!lit(&fake));
    laser.release().unwrap();
    assert!(!lit(&fake));
    laser.light().unwrap().off().unwrap();
}

/// A laser whose call with `true` does something before it returns.
struct Hooked<F: FnMut() + Send>(FakeLaser, F);

impl<F: FnMut() + Send> Laser for Hooked<F> {
    fn set(&mut self, on: bool) -> Result<()> {
        self.0.set(on)?;
        if on {
            (self.1)();
        }
        Ok(())
    }
}

#[test]
fn an_emergency_stop_from_inside_the_lasers_own_call_does_not_deadlock() {
    let fake = Fake::new();
    let (send, receive) = channel::<LaserControl>();
    let hook = move || receive.recv().unwrap().emergency_off().unwrap();
    let laser = Box::new(Hooked(FakeLaser(fake.clone()), hook));
    let laser = LaserControl::new(laser, Arc::new(fake.clone()), Log::silent(), &LaserLimits::default()).unwrap();
    send.send(laser.clone()).unwrap();
    assert!(matches!(laser.light(), Err(Error::LaserRefused { .. })));
    assert!(!lit(&fake) && laser.is_emergency());
}

#[test]
fn an_emergency_stop_during_another_threads_call_wins() {
    let fake = Fake::new();
    let (entered, wait_entered) = channel::<()>();
    let (go_on, wait_go_on) = channel::<()>();
    let hook = move || {
        entered.send(()).unwrap();
        wait_go_on.recv().unwrap();
    };
    let laser = Box::new(Hooked(FakeLaser(fake.clone()), hook));
    let laser = LaserControl::new(laser, Arc::new(fake.clone()), Log::silent(), &LaserLimits::default()).unwrap();
    let other = laser.clone();
    let lighting = std::thread::spawn(move || other.light().map(|guard| guard.time_left().is_ok()));
    wait_entered.recv().unwrap();
    let other = laser.clone();
    let stopping = std::thread::spawn(move || other.emergency_off());
    while !laser.is_emergency() {
        std::thread::yield_now();
    }
    go_on.send(()).unwrap();
    stopping.join().unwrap().unwrap();
    assert!(matches!(lighting.join().unwrap(), Err(Error::LaserRefused { .. })));
    assert!(!lit(&fake));
}

#[test]
fn a_failed_light_is_switched_off() {
    for fault in [Fault::Error, Fault::Lost, Fault::Panic] {
        let fake = Fake::new();
        let laser = control(&fake);
        let calls = fake.world().calls;
        fake.world().fault = Some((calls + 1, fault));
        let outcome = catch_unwind(AssertUnwindSafe(|| laser.light().map(|_| ())));
        assert!(!matches!(outcome, Ok(Ok(()))), "{fault:?}");
        assert!(!lit(&fake), "{fault:?}");
        // It works again.
        laser.light().unwrap().off().unwrap();
    }
}

#[test]
fn switching_off_is_repeated_and_a_failure_is_loud() {
    let messages = Arc::new(std::sync::Mutex::new(Vec::new()));
    let sink = messages.clone();
    let log = Log::to(move |level, message| sink.lock().unwrap().push((level, message.to_owned())));
    let fake = Fake::new();
    let laser =
        LaserControl::new(Box::new(FakeLaser(fake.clone())), Arc::new(fake.clone()), log, &LaserLimits::default())
            .unwrap();

    let guard = laser.light().unwrap();
    fake.world().stuck_on = 3;
    guard.off().unwrap();
    assert!(!lit(&fake) && messages.lock().unwrap().is_empty());

    let guard = laser.light().unwrap();
    fake.world().stuck_on = 4;
    let error = guard.off().unwrap_err();
    assert!(error.to_string().contains("THE LASER MAY BE ON"), "{error}");
    // The guard's drop tried again, and that worked.
    assert!(laser.fault().is_none() && !lit(&fake));
    assert_eq!(messages.lock().unwrap().len(), 1);
    assert_eq!(messages.lock().unwrap()[0].0, LogLevel::Error);

    let guard = laser.light().unwrap();
    fake.world().stuck_on = 1000;
    drop(guard);
    assert!(lit(&fake) && laser.is_on() && laser.fault().is_some() && messages.lock().unwrap().len() >= 2);
    // While that lasts the laser is not lit, and the head is not moved.
    assert!(matches!(laser.light(), Err(Error::LaserRefused { .. } | Error::Busy { .. })));
    assert!(laser.begin_move().is_err());
    fake.world().stuck_on = 0;
    laser.off().unwrap();
    assert!(!lit(&fake) && laser.fault().is_none());
}

#[test]
fn a_panic_of_the_driver_while_unwinding_does_not_abort() {
    let fake = Fake::new();
    let laser = control(&fake);
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let _guard = laser.light().unwrap();
        let calls = fake.world().calls;
        fake.world().fault = Some((calls + 1, Fault::Panic));
        panic!("first");
    }));
    assert!(outcome.is_err() && !lit(&fake));
}
