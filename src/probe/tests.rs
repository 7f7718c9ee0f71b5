//! The probe against the simulator, whose truth is known, and against heads that lie, stall and die.

use std::sync::{Arc, Mutex};

use super::*;
use crate::device::{Frame, Identity, Laser, LaserLimits, Motion, PtzCapabilities, PtzPosition};
use crate::sim::{SimOptions, Simulator};

fn simulator(address: &str) -> Simulator {
    Simulator::new(SimOptions::parse(address).unwrap()).unwrap()
}

fn control(laser: Box<dyn Laser>, clock: &Arc<dyn Clock>) -> LaserControl {
    LaserControl::new(laser, clock.clone(), Log::silent(), &LaserLimits::default()).unwrap()
}

fn run(simulator: &Simulator, head: &mut dyn PanTiltZoom, options: &ProbeOptions) -> Result<ProbeReport> {
    let (mut frames, clock) = (simulator.head_frames(), simulator.clock());
    let laser = control(Box::new(simulator.laser()), &clock);
    let parts = ProbeParts {
        head,
        frames: Some(&mut frames),
        laser: Some(&laser),
        camera: Some(simulator.truth().rig.head_camera(0.0, 0.0)),
        clock: &*clock,
        log: &Log::silent(),
    };
    probe(parts, options, &Cancel::new())
}

/// Within three standard deviations and `slack`.
fn close(figure: &Figure, truth: f64, slack: f64) {
    let m = figure.as_ref().unwrap();
    assert!((m.value - truth).abs() <= 3.0 * m.sigma + slack, "{m:?}, the truth is {truth}");
}

/// Writes down where it is sent.
struct Watched {
    head: Box<dyn PanTiltZoom>,
    targets: Arc<Mutex<Vec<[f64; 2]>>>,
    /// Position is the last target, motion always idle.
    echoes: bool,
    /// Does not move.
    stuck: bool,
    /// What a position takes, seconds.
    slow: f64,
    clock: Arc<dyn Clock>,
}

impl Watched {
    fn new(simulator: &Simulator) -> Self {
        Self {
            head: Box::new(simulator.ptz()),
            targets: Arc::default(),
            echoes: false,
            stuck: false,
            slow: 0.0,
            clock: simulator.clock(),
        }
    }
}

impl PanTiltZoom for Watched {
    fn capabilities(&self) -> PtzCapabilities {
        self.head.capabilities()
    }
    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        self.targets.lock().unwrap().push([pan, tilt]);
        if self.stuck { Ok(()) } else { self.head.move_absolute(pan, tilt) }
    }
    fn position(&mut self) -> Result<PtzPosition> {
        self.clock.sleep(self.slow);
        let at = self.head.position()?;
        match self.targets.lock().unwrap().last() {
            Some([pan, tilt]) if self.echoes => Ok(PtzPosition { pan: *pan, tilt: *tilt, zoom: 0.0 }),
            _ => Ok(at),
        }
    }
    fn motion(&mut self) -> Result<Motion> {
        if self.echoes { Ok(Motion::Idle) } else { self.head.motion() }
    }
    fn stop(&mut self) -> Result<()> {
        self.head.stop()
    }
    fn identity(&mut self) -> Result<Identity> {
        Ok(Identity { vendor: "ptzcal".into(), model: "sim:room".into(), ..Identity::default() })
    }
}

#[test]
fn an_honest_head_is_described_as_it_is() {
    let simulator = simulator("sim:room?seed=4");
    let o = SimOptions::default();
    let mut head = Watched::new(&simulator);
    head.move_absolute(0.1, -0.05).unwrap();
    let options = ProbeOptions { reach_limits: true, toggle_laser: true, ..ProbeOptions::default() };
    let report = run(&simulator, &mut head, &options).unwrap();
    println!("{report}");
    let step = o.step;
    for k in 0..2 {
        close(&report.speed[k], o.speed, 0.01 * o.speed);
        close(&report.backlash[k], o.backlash, 0.1 * o.backlash);
        // Half a step of rounding.
        assert!(report.position_error[k].as_ref().unwrap().value <= 0.51 * step);
        assert!(report.reading_repeatability[k].as_ref().unwrap().value < 1e-9);
        close(&report.picture_repeatability[k], o.repeatability, 0.3 * o.repeatability);
        let smallest = report.smallest_move[k].as_ref().unwrap().value;
        assert!(smallest >= 0.5 * step && smallest <= 1.01 * step, "{smallest} {step}");
    }
    // The simulator's head starts at once: its call takes 8 ms, as does one for the position.
    close(&report.position_time, 0.008, 1e-4);
    let start = report.start_latency.as_ref().unwrap();
    assert!(start.value < 0.04, "{start:?}");
    assert_eq!(report.position_follows, Ok(true));
    // It stops where its motors are, within a step: between two readings it turns on for one call's time.
    let stop = report.stop_distance.as_ref().unwrap();
    assert!(stop.value < step + 0.02 * o.speed && report.stop_time.as_ref().unwrap().value < 0.05, "{stop:?}");
    // The swing after the motors' stop: 0.2 s.
    let after = report.moves_after_arrival.as_ref().unwrap();
    assert!(after.value > 0.0 && after.value < 0.25, "{after:?}");
    assert_eq!(report.arrival_honest, Ok(true));
    close(&report.frame_interval, 1.0 / o.frame_rate, 1e-6);
    close(&report.frame_age, o.exposure + o.latency, 1e-3);
    // A move or toggle falls into a frame; the next at the latest shows it in full.
    for (time, count) in [
        (&report.visible_after, &report.visible_after_frames),
        (&report.laser_visible_after, &report.laser_visible_after_frames),
    ] {
        let (time, count) = (time.as_ref().unwrap().value, count.as_ref().unwrap().value);
        let period = 1.0 / o.frame_rate;
        assert!(time > o.latency && time < o.exposure + o.latency + 2.0 * period + 0.02, "{time}");
        assert!((1.0..=4.0).contains(&count), "{count}");
    }
    let c = head.capabilities();
    for (i, truth) in [c.pan_range[0], c.pan_range[1], c.tilt_range[0], c.tilt_range[1]].into_iter().enumerate() {
        close(&report.limits[i], truth, step);
    }
    // Never beyond the limits, and back at the end.
    let targets = head.targets.lock().unwrap();
    assert!(targets.iter().all(|t| (c.pan_range[0]..=c.pan_range[1]).contains(&t[0])));
    assert!(targets.iter().all(|t| (c.tilt_range[0]..=c.tilt_range[1]).contains(&t[1])));
    let last = targets.last().unwrap();
    assert!((last[0] - 0.1).abs() <= step && (last[1] + 0.05).abs() <= step, "{last:?}");
    assert!(report.duration > 10.0 && report.duration <= options.max_time);
    let text = report.to_string();
    for part in ["sim:room", "80.0", "follows the head", "Reported arrival       true"] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
}

#[test]
fn other_heads_are_described_as_they_are() {
    let simulator =
        simulator("sim:room?speed_deg=30&backlash_deg=0.2&latency=0.2&fps=30&step_deg=0.02&repeatability_deg=0.02");
    let report = run(&simulator, &mut simulator.ptz(), &ProbeOptions::default()).unwrap();
    println!("{report}");
    for k in 0..2 {
        close(&report.speed[k], 30f64.to_radians(), 0.003);
        close(&report.backlash[k], 0.2f64.to_radians(), 0.1 * 0.2f64.to_radians());
        close(&report.picture_repeatability[k], 0.02f64.to_radians(), 0.0);
    }
    close(&report.frame_age, 0.22, 1e-3);
    assert!(report.visible_after.as_ref().unwrap().value > 0.2);
    assert!(report.visible_after_frames.as_ref().unwrap().value >= 6.0);
    // Not asked for.
    assert!(report.limits.iter().all(|l| l.as_ref().unwrap_err().contains("not asked")));
    assert!(report.laser_visible_after.as_ref().unwrap_err().contains("not asked"));
}

#[test]
fn lies_are_found_out() {
    // Idle as soon as it was told to move.
    let lying = simulator("sim:room?ptz_lies=1&speed_deg=20");
    let report = run(&lying, &mut lying.ptz(), &ProbeOptions::default()).unwrap();
    assert_eq!((report.arrival_honest, report.position_follows), (Ok(false), Ok(true)));
    // 40 degrees at 20 degrees a second, and the swing.
    close(&report.moves_after_arrival, 2.1, 0.2);

    // Repeats its command.
    let simulator = simulator("sim:room");
    let mut head = Watched { echoes: true, ..Watched::new(&simulator) };
    let report = run(&simulator, &mut head, &ProbeOptions::default()).unwrap();
    println!("{report}");
    assert_eq!(report.position_follows, Ok(false));
    assert_eq!(report.arrival_honest, Ok(false));
    assert!(report.speed[0].as_ref().unwrap_err().contains("repeat"));
    assert!(report.to_string().contains("NOT TRUE"));
}

#[test]
fn a_head_that_answers_too_slowly_is_not_called_a_liar() {
    let simulator = simulator("sim:room");
    let mut head = Watched { slow: 1.0, ..Watched::new(&simulator) };
    let report = run(&simulator, &mut head, &ProbeOptions::default()).unwrap();
    let reason = report.position_follows.unwrap_err();
    assert!(reason.contains("too seldom"), "{reason}");
    assert_eq!(report.speed[0].as_ref().unwrap_err(), &reason);
}

#[test]
fn what_cannot_be_had_carries_its_reason() {
    // No camera, no laser.
    let room = simulator("sim:room");
    let clock = room.clock();
    let mut head = room.ptz();
    let parts =
        ProbeParts { head: &mut head, frames: None, laser: None, camera: None, clock: &*clock, log: &Log::silent() };
    let options = ProbeOptions { toggle_laser: true, ..ProbeOptions::default() };
    let report = probe(parts, &options, &Cancel::new()).unwrap();
    close(&report.speed[0], 80f64.to_radians(), 0.02);
    for figure in [&report.backlash[0], &report.frame_age, &report.visible_after, &report.moves_after_arrival] {
        assert!(figure.as_ref().unwrap_err().contains("no frames"), "{figure:?}");
    }
    assert!(report.laser_visible_after.unwrap_err().contains("no laser"));

    // Without intrinsics: pixels, no angles.
    let mut frames = room.head_frames();
    let parts = ProbeParts {
        head: &mut head,
        frames: Some(&mut frames),
        laser: None,
        camera: None,
        clock: &*clock,
        log: &Log::silent(),
    };
    let report = probe(parts, &ProbeOptions::default(), &Cancel::new()).unwrap();
    assert!(report.backlash_px[0].is_ok() && report.backlash[0].as_ref().unwrap_err().contains("intrinsics"));

    // Frames that do not come.
    let dark = simulator("sim:room?frames_time_out=1");
    let report = run(&dark, &mut dark.ptz(), &ProbeOptions::default()).unwrap();
    assert!(report.frame_interval.is_err() && report.backlash[0].is_err() && report.speed[1].is_ok());

    // A head that does not move: in bounded time.
    let simulator = simulator("sim:room");
    let mut head = Watched { stuck: true, ..Watched::new(&simulator) };
    let report = run(&simulator, &mut head, &ProbeOptions::default()).unwrap();
    assert!(report.speed.iter().chain(&report.backlash).chain([&report.stop_distance]).all(Figure::is_err));
    assert!(report.frame_interval.is_ok() && report.duration < 310.0);
    // No time.
    let report =
        run(&simulator, &mut simulator.ptz(), &ProbeOptions { max_time: 5.0, ..ProbeOptions::default() }).unwrap();
    assert!(report.stop_distance.unwrap_err().contains("in time") && report.duration < 7.0);
}

/// A laser that writes down how it was switched, and may refuse to go off once it was on.
struct Lamp {
    on: Arc<Mutex<Vec<bool>>>,
    stuck: bool,
}

impl Laser for Lamp {
    fn set(&mut self, on: bool) -> Result<()> {
        let mut history = self.on.lock().unwrap();
        history.push(on);
        if self.stuck && !on && history.contains(&true) {
            return Err(Error::Device { reason: "its relay is welded".into() });
        }
        Ok(())
    }
}

#[test]
fn the_laser_is_off_at_the_end_and_untouched_unless_asked_for() {
    for (asked, blind) in [(false, false), (true, false), (true, true)] {
        let simulator = simulator("sim:room");
        let (mut frames, clock, mut head) = (simulator.head_frames(), simulator.clock(), simulator.ptz());
        let on = Arc::new(Mutex::new(Vec::new()));
        let lamp = control(Box::new(Lamp { on: on.clone(), stuck: false }), &clock);
        let parts = ProbeParts {
            head: &mut head,
            frames: (!blind).then_some(&mut frames as &mut dyn FrameSource),
            laser: Some(&lamp),
            camera: None,
            clock: &*clock,
            log: &Log::silent(),
        };
        let options = ProbeOptions { toggle_laser: asked, ..ProbeOptions::default() };
        let report = probe(parts, &options, &Cancel::new()).unwrap();
        // This lamp is not the simulator's: nothing is seen of it.
        assert!(report.laser_visible_after.is_err());
        let history = on.lock().unwrap();
        if asked && !blind {
            assert!(history.contains(&true) && history.last() == Some(&false), "{history:?}");
        } else {
            assert!(!history.contains(&true), "{history:?}");
        }
    }
}

#[test]
fn a_laser_that_stays_on_ends_the_probe_and_a_panic_switches_it_off() {
    /// Frames that panic while the laser is on.
    struct Panicking(crate::sim::SimFrames, Arc<Mutex<Vec<bool>>>);
    impl FrameSource for Panicking {
        fn next_frame(&mut self, not_before: f64, timeout: f64, frame: &mut Frame) -> Result<()> {
            let lit = self.1.lock().unwrap().last() == Some(&true);
            assert!(!lit, "a bug");
            self.0.next_frame(not_before, timeout, frame)
        }
    }
    for stuck in [true, false] {
        let (simulator, on) = (simulator("sim:room"), Arc::new(Mutex::new(Vec::new())));
        let (clock, mut head, mut frames) = (simulator.clock(), simulator.ptz(), simulator.head_frames());
        let mut panicking = Panicking(simulator.head_frames(), on.clone());
        let lamp = control(Box::new(Lamp { on: on.clone(), stuck }), &clock);
        let parts = ProbeParts {
            head: &mut head,
            frames: Some(if stuck { &mut frames } else { &mut panicking }),
            laser: Some(&lamp),
            camera: None,
            clock: &*clock,
            log: &Log::silent(),
        };
        let options = ProbeOptions { toggle_laser: true, ..ProbeOptions::default() };
        let cancel = Cancel::new();
        let probed = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| probe(parts, &options, &cancel)));
        if stuck {
            let error = probed.unwrap().unwrap_err().to_string();
            assert!(error.contains("THE LASER MAY BE ON") && error.contains("welded"), "{error}");
        } else {
            assert!(probed.is_err());
        }
        let history = on.lock().unwrap();
        assert!(history.contains(&true) && history.last() == Some(&false), "{history:?}");
    }
}

#[test]
fn a_probe_ends_with_its_device_and_with_its_caller() {
    for calls in [0, 1, 7, 60, 300] {
        let simulator = simulator(&format!("sim:room?unplug_after={calls}"));
        let error = run(&simulator, &mut simulator.ptz(), &ProbeOptions::default()).unwrap_err();
        assert!(matches!(error, Error::DeviceLost { .. }), "{calls}: {error}");
    }
    // Cancelled by the camera's thread in the middle of a measurement.
    struct Cancelling<'a>(crate::sim::SimFrames, &'a Cancel, u32);
    impl FrameSource for Cancelling<'_> {
        fn next_frame(&mut self, not_before: f64, timeout: f64, frame: &mut Frame) -> Result<()> {
            self.2 -= 1;
            if self.2 == 0 {
                self.1.cancel();
            }
            self.0.next_frame(not_before, timeout, frame)
        }
    }
    let (simulator, cancel) = (simulator("sim:room"), Cancel::new());
    let clock = simulator.clock();
    let mut frames = Cancelling(simulator.head_frames(), &cancel, 20);
    let parts = ProbeParts {
        head: &mut simulator.ptz(),
        frames: Some(&mut frames),
        laser: None,
        camera: None,
        clock: &*clock,
        log: &Log::silent(),
    };
    assert_eq!(probe(parts, &ProbeOptions::default(), &cancel).unwrap_err(), Error::Cancelled);
    for bad in [
        ProbeOptions { amplitude: 0.0, ..ProbeOptions::default() },
        ProbeOptions { amplitude: f64::NAN, ..ProbeOptions::default() },
        ProbeOptions { repeats: 1, ..ProbeOptions::default() },
        ProbeOptions { max_time: 0.0, ..ProbeOptions::default() },
    ] {
        assert!(matches!(run(&simulator, &mut simulator.ptz(), &bad), Err(Error::InvalidArgument { .. })));
    }
}
