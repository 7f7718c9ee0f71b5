//! Whatever fails, whenever: the laser ends off, or it is said that it may be on; the head is told
//! to stop; what was measured is kept.

use std::ops::ControlFlow::{Break, Continue};
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::scan::{Scratch, check_history, fixed, journalled, region};
use crate::error::{Error, Result};
use crate::rig::fake::{Event, Fake, Fault};
use crate::rig::*;

fn scan_with_fault(fault: Option<(usize, Fault)>) -> (Fake, std::thread::Result<Result<Scan>>) {
    let fake = Fake::new();
    let mut rig = fake.rig();
    fake.world().calls = 0;
    fake.world().fault = fault;
    let mut cameras = fixed(&fake, 1);
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        scan_region(&mut rig, &region(2, 1), &ScanOptions::default(), &mut cameras, &mut |_| Continue(()))
    }));
    // The state that the scan leaves behind, not that of a dropped rig.
    std::mem::forget(rig);
    (fake, outcome)
}

fn stopped_after_its_last_move(fake: &Fake) -> bool {
    let world = fake.world();
    world.history.iter().rev().find(|e| matches!(e, Event::Move(..) | Event::Stop)) == Some(&Event::Stop)
}

#[test]
fn an_error_or_a_panic_at_any_call_leaves_the_laser_off_and_the_head_stopped() {
    let (fake, outcome) = scan_with_fault(None);
    let complete = outcome.unwrap().unwrap();
    assert!(complete.is_complete() && complete.shots.len() == 2);
    let calls = fake.world().calls;
    assert!(calls > 30);
    let mut ends = [0; 3];
    for at in 1..=calls {
        for fault in [Fault::Error, Fault::Lost, Fault::Panic] {
            let (fake, outcome) = scan_with_fault(Some((at, fault)));
            assert!(!fake.world().laser_lit, "{fault:?} at {at}");
            // The very last call is the stop itself.
            assert!(stopped_after_its_last_move(&fake) || at == calls, "{fault:?} at {at}");
            match outcome {
                Err(_) => {
                    assert_eq!(fault, Fault::Panic);
                    ends[0] += 1;
                }
                Ok(scan) => {
                    let scan = scan.unwrap();
                    check_history(&fake);
                    assert!(scan.shots.iter().all(|s| s.head.is_ok()));
                    match scan.end {
                        ScanEnd::Complete => ends[1] += 1,
                        ScanEnd::Failed(Error::DeviceLost { .. }) if fault == Fault::Lost => ends[2] += 1,
                        other => panic!("{fault:?} at {at}: {other:?}"),
                    }
                }
            }
        }
    }
    // Single errors are survived, lost devices and panics are not (but for those of switching off).
    assert!(ends[0] > calls / 2 && ends[1] >= calls && ends[2] > calls / 2, "{ends:?}");
}

#[test]
fn devices_that_die_for_good_leave_the_laser_off_or_say_so() {
    let calls = scan_with_fault(None).0.world().calls;
    let mut said = 0;
    for at in 1..calls {
        let (fake, outcome) = scan_with_fault(Some((at, Fault::Dead)));
        let scan = outcome.unwrap().unwrap();
        let ScanEnd::Failed(error) = &scan.end else { panic!("{:?} at {at}", scan.end) };
        if fake.world().laser_lit {
            assert!(error.to_string().contains("THE LASER MAY BE ON"), "{at}: {error}");
            said += 1;
        }
    }
    assert!(said > 0);
}

/// A device that is gone at any call and comes back costs nothing but time.
#[test]
fn devices_that_come_back_are_waited_for() {
    let calls = scan_with_fault(None).0.world().calls;
    let options = ScanOptions { reconnect: 5.0, ..ScanOptions::default() };
    for at in 1..calls {
        let fake = Fake::new();
        let mut rig = fake.rig();
        fake.world().calls = 0;
        fake.world().fault = Some((at, Fault::Lost));
        let scan = scan_region(&mut rig, &region(2, 1), &options, &mut fixed(&fake, 1), &mut |_| Continue(())).unwrap();
        assert!(scan.is_complete() && scan.shots.len() == 2, "{at}: {:?}", scan.end);
        check_history(&fake);
    }
    // One that does not come back ends the scan when the patience is over.
    let fake = Fake::new();
    let mut rig = fake.rig();
    fake.world().calls = 0;
    fake.world().fault = Some((2, Fault::Dead));
    let before = fake.world().now;
    let scan = scan_region(&mut rig, &region(2, 1), &options, &mut fixed(&fake, 1), &mut |_| Continue(())).unwrap();
    assert!(matches!(scan.end, ScanEnd::Failed(_)));
    assert!(fake.world().now - before < 7.0);
}

#[test]
fn a_panic_of_the_progress_callback_leaves_all_off() {
    for at in 0..3 {
        let fake = Fake::new();
        let mut rig = fake.rig();
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            scan_region(&mut rig, &region(3, 1), &ScanOptions::default(), &mut fixed(&fake, 1), &mut |p| {
                assert!(p.done < at, "the host's bug");
                Continue(())
            })
        }));
        assert!(outcome.is_err());
        check_history(&fake);
        assert!(stopped_after_its_last_move(&fake));
        // The rig is still of use.
        rig.move_to(0.1, 0.0, &crate::control::Cancel::new()).unwrap();
    }
}

#[test]
fn a_cancelled_scan_keeps_its_shots() {
    for at in 0..4 {
        let fake = Fake::new();
        let options = ScanOptions::default();
        let cancel = options.cancel.clone();
        let scan = scan_region(&mut fake.rig(), &region(2, 2), &options, &mut fixed(&fake, 1), &mut |p| {
            if p.done == at {
                cancel.cancel();
            }
            Continue(())
        })
        .unwrap();
        assert_eq!((scan.end, scan.shots.len()), (ScanEnd::Cancelled, at));
        check_history(&fake);
        assert!(stopped_after_its_last_move(&fake));
    }
}

#[test]
fn an_emergency_stop_ends_the_scan_until_it_is_released() {
    let fake = Fake::new();
    let mut rig = fake.rig();
    let control = rig.laser();
    let scratch = Scratch::new();
    let scan = scan_region(&mut rig, &region(3, 1), &journalled(&scratch), &mut [], &mut |p| {
        if p.done == 2 {
            control.emergency_off().unwrap();
        }
        Continue(())
    })
    .unwrap();
    assert!(matches!(scan.end, ScanEnd::Failed(Error::LaserRefused { .. })), "{:?}", scan.end);
    assert_eq!(scan.shots.len(), 2);
    check_history(&fake);
    control.release().unwrap();
    let scan = scan_region(&mut rig, &region(3, 1), &journalled(&scratch), &mut [], &mut |_| Continue(())).unwrap();
    assert!(scan.is_complete() && scan.resumed == 2 && scan.shots.len() == 3);
}

/// Set for a process whose files cannot grow.
const SMALL_FILES: &str = "PTZCAL_TEST_SMALL_FILES";

/// The half of the next test that runs in such a process; elsewhere it has nothing to do.
#[test]
fn scan_on_a_full_disk() {
    if std::env::var_os(SMALL_FILES).is_none() {
        return;
    }
    let fake = Fake::new();
    let scratch = Scratch::new();
    let mut announced = 0;
    let scan = scan_region(&mut fake.rig(), &region(10, 1), &journalled(&scratch), &mut fixed(&fake, 1), &mut |p| {
        announced = p.done;
        if p.done > 8 { Break(()) } else { Continue(()) }
    })
    .unwrap();
    assert!(matches!(scan.end, ScanEnd::Failed(Error::FileIo { .. })), "{:?}", scan.end);
    assert!(announced > 1 && scan.shots.len() == announced + 1, "the shot is kept, and was not acknowledged");
    check_history(&fake);
    assert!(stopped_after_its_last_move(&fake));
    println!("the disk was full");
}

#[test]
#[cfg(unix)]
fn a_full_disk_ends_the_scan_with_the_laser_off() {
    let command = "trap '' XFSZ; ulimit -f 2; exec \"$0\" --exact rig::tests::faults::scan_on_a_full_disk --nocapture";
    let output = std::process::Command::new("sh")
        .args(["-c", command])
        .arg(std::env::current_exe().unwrap())
        .env(SMALL_FILES, "1")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success() && said.contains("the disk was full"),
        "{said}{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
