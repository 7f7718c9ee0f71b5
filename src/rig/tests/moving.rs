//! Moving, settling, aiming and switching by hand.

use nalgebra::{Vector2, Vector3};

use crate::control::{Cancel, Clock};
use crate::error::Error;
use crate::rig::fake::{Event, Fake, Habits, STEP, laser_hit, model};
use crate::rig::{Rig, RigOptions, SettleOptions};

fn rig_with(fake: &Fake, settle: SettleOptions) -> Rig {
    Rig::open(fake.parts(), RigOptions { settle, ..RigOptions::default() }).unwrap()
}

#[test]
fn a_move_ends_when_the_head_stands_at_its_target() {
    for habits in [Habits::default(), Habits { reports_motion: false, ..Habits::default() }] {
        let fake = Fake::with(habits);
        let mut rig = fake.rig();
        let start = fake.now();
        let at = rig.move_to(0.9, -0.2, &Cancel::new()).unwrap();
        assert!((at.pan - 0.9).abs() <= STEP && (at.tilt + 0.2).abs() <= STEP);
        let truth = fake.head();
        assert_eq!((at.pan, at.tilt), (truth.x, truth.y));
        // 0.6 s of travel by way of the point below, which is only passed, 0.15 s of equal readings, and
        // two frames that begin within them.
        assert!((0.75..0.85).contains(&(fake.now() - start)), "{}", fake.now() - start);
    }
}

#[test]
fn a_head_that_lies_about_being_idle_is_caught_by_its_picture() {
    let fake = Fake::with(Habits { lies: true, ..Habits::default() });
    let settle = SettleOptions { overshoot: 0.0, ..SettleOptions::default() };
    let mut rig = rig_with(&fake, settle);
    rig.move_to(1.2, 0.3, &Cancel::new()).unwrap();
    let truth = fake.head();
    assert!((truth - Vector2::new(1.2, 0.3)).amax() <= STEP, "{truth}");
    // Without looking, the lie is believed: the check is what caught it.
    let mut rig = rig_with(&fake, SettleOptions { picture_timeout: 0.0, ..settle });
    rig.move_to(-1.2, 0.3, &Cancel::new()).unwrap();
    assert!(fake.head().x > -0.9);
}

#[test]
fn a_head_that_tells_no_position_is_moved_and_seen_to_arrive() {
    let fake = Fake::with(Habits { mute: true, reports_motion: false, ..Habits::default() });
    let mut rig = fake.rig();
    assert!(matches!(rig.position(), Err(Error::BadState { .. })));
    for target in [Vector2::new(0.9, -0.2), Vector2::new(-1.2, 0.3)] {
        rig.move_to(target.x, target.y, &Cancel::new()).unwrap();
        assert!((fake.head() - target).amax() <= STEP, "{}", fake.head());
        // From here on nobody knows where it is.
        rig.stop().unwrap();
    }
}

#[test]
fn a_head_that_never_stands_still_is_an_error_and_is_stopped() {
    let fake = Fake::with(Habits { restless: true, ..Habits::default() });
    let mut rig = fake.rig();
    let error = rig.move_to(0.5, 0.0, &Cancel::new()).unwrap_err();
    assert!(matches!(error, Error::DeviceTimeout { .. }), "{error}");
    assert_eq!(fake.world().history.last(), Some(&Event::Stop));

    let fake = Fake::with(Habits { restless: true, lies: true, ..Habits::default() });
    let mut rig = fake.rig();
    let error = rig.move_to(0.5, 0.0, &Cancel::new()).unwrap_err();
    assert!(error.to_string().contains("picture keeps moving"), "{error}");
    assert_eq!(fake.world().history.last(), Some(&Event::Stop));
}

#[test]
fn a_head_that_stops_short_is_sent_again_and_then_refused() {
    let fake = Fake::with(Habits { short: 0.02, ..Habits::default() });
    let mut rig = rig_with(&fake, SettleOptions { overshoot: 0.0, ..SettleOptions::default() });
    let error = rig.move_to(0.5, 0.0, &Cancel::new()).unwrap_err();
    assert!(error.to_string().contains("instead of 0.5000, 0.0000, after 3 attempts"), "{error}");
    let moves = fake.world().history.iter().filter(|e| matches!(e, Event::Move(..))).count();
    assert_eq!(moves, 3);
    // Within the tolerance asked for, it has arrived.
    let tolerant = SettleOptions { overshoot: 0.0, tolerance: 0.03, ..SettleOptions::default() };
    rig_with(&fake, tolerant).move_to(0.3, 0.0, &Cancel::new()).unwrap();
}

#[test]
fn targets_are_approached_from_one_side() {
    let fake = Fake::new();
    let mut rig = fake.rig();
    let cancel = Cancel::new();
    for (pan, tilt) in [(0.2, 0.1), (0.5, 0.1), (0.1, 0.2), (0.3, -0.1), (0.3, -0.1), (-1.7, -0.5)] {
        rig.move_to(pan, tilt, &cancel).unwrap();
    }
    let moves: Vec<_> = fake
        .world()
        .history
        .iter()
        .filter_map(|e| match e {
            Event::Move(pan, tilt) => Some(((pan * 1e3).round() as i32, (tilt * 1e3).round() as i32)),
            _ => None,
        })
        .collect();
    let wanted = [
        (190, 90),
        (200, 100), // from an unknown side
        (500, 100),
        (90, 190),
        (100, 200),
        (290, -110),
        (300, -100),
        (300, -100),
        (-1700, -500),
        (-1700, -500), // there is no other side at the end of the range
    ];
    assert_eq!(moves, wanted);
}

#[test]
fn angles_are_checked_before_anything_moves() {
    let fake = Fake::new();
    let mut rig = fake.rig();
    let cancel = Cancel::new();
    let calls = fake.world().calls;
    let error = rig.move_to(1.8, 0.0, &cancel).unwrap_err();
    assert!(matches!(&error, Error::Unreachable { reason } if reason.contains("-1.7000 to 1.7000 rad")), "{error}");
    assert_eq!(rig.move_to(f64::NAN, 0.0, &cancel), Err(Error::NotFinite { name: "pan", index: 0 }));
    assert_eq!(rig.move_to(0.0, f64::NEG_INFINITY, &cancel), Err(Error::NotFinite { name: "tilt", index: 0 }));
    cancel.cancel();
    assert_eq!(rig.move_to(0.1, 0.1, &cancel), Err(Error::Cancelled));
    assert_eq!(fake.world().calls, calls);
    let bad = SettleOptions { poll_interval: 0.0, ..SettleOptions::default() };
    assert!(Rig::open(fake.parts(), RigOptions { settle: bad, ..RigOptions::default() }).is_err());
}

#[test]
fn a_head_without_known_angles_is_refused_with_the_laser_off() {
    let fake = Fake::with(Habits { raw_units: true, ..Habits::default() });
    fake.world().laser_lit = true;
    let error = Rig::open(fake.parts(), RigOptions::default()).err().unwrap();
    assert!(matches!(&error, Error::Unsupported { what } if what.contains("angle map")), "{error}");
    assert!(!fake.world().laser_lit);
}

#[test]
fn the_laser_is_off_before_the_head_moves_and_after_it_is_closed() {
    let fake = Fake::new();
    let mut rig = fake.rig();
    let cancel = Cancel::new();
    rig.move_to(0.2, 0.0, &cancel).unwrap();
    rig.set_laser(true).unwrap();
    rig.set_laser(true).unwrap();
    assert!(fake.world().laser_lit);
    rig.move_to(0.4, 0.0, &cancel).unwrap();
    let mut on = false;
    for event in &fake.world().history {
        match event {
            Event::Laser(state) => on = *state,
            Event::Move(..) => assert!(!on),
            _ => {}
        }
    }
    rig.set_laser(true).unwrap();
    fake.sleep(2.5);
    rig.position().unwrap();
    assert!(!fake.world().laser_lit, "on for longer than its limit");
    rig.set_laser(true).unwrap();
    let control = rig.laser();
    rig.close().unwrap();
    assert!(!fake.world().laser_lit);
    assert!(matches!(control.light(), Err(Error::LaserRefused { .. })));
    assert_eq!(fake.world().history.last(), Some(&Event::Stop));
}

#[test]
fn the_laser_is_refused_while_the_head_moves_and_after_an_emergency_stop() {
    let fake = Fake::with(Habits { restless: true, ..Habits::default() });
    let mut rig = fake.rig();
    assert!(matches!(rig.set_laser(true), Err(Error::LaserRefused { .. })));
    fake.world().habits.restless = false;
    rig.set_laser(true).unwrap();
    rig.laser().emergency_off().unwrap();
    assert!(!fake.world().laser_lit);
    assert!(matches!(rig.set_laser(true), Err(Error::LaserRefused { .. })));
    rig.laser().release().unwrap();
    rig.set_laser(true).unwrap();
    drop(rig);
    assert!(!fake.world().laser_lit);
}

#[test]
fn the_aimed_laser_hits_the_point() {
    let fake = Fake::new();
    let mut rig = fake.rig();
    let cancel = Cancel::new();
    let point = laser_hit(0.4, -0.1);
    let aim = rig.aim_at_point(&point, &cancel).unwrap();
    assert!((aim.pan - 0.4).abs() < 1e-9 && (aim.tilt + 0.1).abs() < 1e-9);
    // What the head sees at the spot, with its depth, is that point.
    let pixel = model().spot_pixel(1.0 / aim.depth).unwrap();
    let again = rig.aim_at_pixel(&pixel, aim.depth, &cancel).unwrap();
    assert!((again.pan - 0.4).abs() < STEP && (again.tilt + 0.1).abs() < STEP);
    assert!(matches!(rig.aim_at_point(&Vector3::new(0.0, 0.0, -5.0), &cancel), Err(Error::Unreachable { .. })));
    assert!(rig.aim_at_point(&Vector3::new(f64::NAN, 0.0, 1.0), &cancel).is_err());
}
