//! A head in real time, with faults.

use std::sync::atomic::{AtomicBool, AtomicU32};
use std::sync::mpsc;

use super::*;

/// Radians per second.
const SPEED: f64 = 2.0;
const RANGE: [f64; 2] = [-1.5, 1.5];

struct World {
    /// Where the head was at a moment, and how it goes on: to a target or at a velocity.
    from: [f64; 2],
    since: Instant,
    to: [f64; 2],
    velocity: Option<[f64; 2]>,
    stops: u32,
}

#[derive(Clone)]
struct Fake {
    world: Arc<Mutex<World>>,
    with_brake: bool,
    /// A call holds on for this long, milliseconds.
    slow: Arc<AtomicU32>,
    deaf: Arc<AtomicBool>,
    lost: Arc<AtomicBool>,
    panics: Arc<AtomicBool>,
    capabilities: PtzCapabilities,
}

impl Fake {
    fn new() -> Self {
        let world = World { from: [0.0; 2], since: Instant::now(), to: [0.0; 2], velocity: None, stops: 0 };
        Self {
            world: Arc::new(Mutex::new(world)),
            with_brake: false,
            slow: Arc::default(),
            deaf: Arc::default(),
            lost: Arc::default(),
            panics: Arc::default(),
            capabilities: PtzCapabilities {
                pan_range: RANGE,
                tilt_range: RANGE,
                pan_step: 1e-4,
                tilt_step: 1e-4,
                reports_motion: true,
                reports_position: true,
                has_drive: true,
                has_home: true,
                presets: 4,
                ..PtzCapabilities::default()
            },
        }
    }

    fn head(&self) -> Head {
        Head::new(Box::new(self.clone()), Log::silent(), None)
    }

    fn call(&self) -> Result<()> {
        std::thread::sleep(Duration::from_millis(u64::from(self.slow.load(Ordering::SeqCst))));
        assert!(!self.panics.load(Ordering::SeqCst), "a driver's panic");
        if self.lost.load(Ordering::SeqCst) { Err(Error::DeviceLost { reason: "unplugged".into() }) } else { Ok(()) }
    }

    fn stops(&self) -> u32 {
        unpoisoned(&self.world).stops
    }
}

impl World {
    fn at(&self) -> [f64; 2] {
        let t = self.since.elapsed().as_secs_f64();
        std::array::from_fn(|k| match self.velocity {
            Some(v) => (self.from[k] + v[k] * t).clamp(RANGE[0], RANGE[1]),
            None => self.from[k] + (self.to[k] - self.from[k]).clamp(-SPEED * t, SPEED * t),
        })
    }

    fn go(&mut self, to: [f64; 2], velocity: Option<[f64; 2]>) {
        (self.from, self.since, self.to, self.velocity) = (self.at(), Instant::now(), to, velocity);
    }

    fn stop(&mut self) {
        self.stops += 1;
        self.go(self.at(), None);
    }
}

impl PanTiltZoom for Fake {
    fn capabilities(&self) -> PtzCapabilities {
        self.capabilities
    }

    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        self.call()?;
        if !self.deaf.load(Ordering::SeqCst) {
            unpoisoned(&self.world).go([pan, tilt], None);
        }
        Ok(())
    }

    fn position(&mut self) -> Result<PtzPosition> {
        self.call()?;
        let [pan, tilt] = unpoisoned(&self.world).at();
        Ok(PtzPosition { pan, tilt, zoom: 0.0 })
    }

    fn motion(&mut self) -> Result<Motion> {
        self.call()?;
        let world = unpoisoned(&self.world);
        Ok(if world.velocity.is_some() || world.at() != world.to { Motion::Moving } else { Motion::Idle })
    }

    fn stop(&mut self) -> Result<()> {
        self.call()?;
        unpoisoned(&self.world).stop();
        Ok(())
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        self.with_brake.then(|| Arc::new(FakeBrake(self.world.clone())) as Arc<dyn Brake>)
    }

    fn drive(&mut self, velocity: PtzVelocity, _timeout: f64) -> Result<()> {
        self.call()?;
        unpoisoned(&self.world).go([0.0; 2], Some([velocity.pan, velocity.tilt]));
        Ok(())
    }

    fn home(&mut self) -> Result<()> {
        self.move_absolute(0.0, 0.0)
    }

    fn recall_preset(&mut self, preset: u32) -> Result<()> {
        self.move_absolute(0.1 * f64::from(preset), 0.0)
    }
}

struct FakeBrake(Arc<Mutex<World>>);

impl Brake for FakeBrake {
    fn stop(&self) -> Result<()> {
        unpoisoned(&self.0).stop();
        Ok(())
    }
}

fn end(head: &Head, number: u64) -> MoveEnd {
    head.wait(number, 10.0, &Cancel::new()).unwrap()
}

fn drive(pan: f64) -> PtzVelocity {
    PtzVelocity { pan, ..PtzVelocity::default() }
}

#[test]
fn moves_end_where_they_were_sent() {
    let head = Fake::new().head();
    let number = head.move_absolute(0.4, -0.2).unwrap();
    assert_eq!(end(&head, number), MoveEnd::Arrived);
    let at = head.position().unwrap();
    assert_eq!((at.pan, at.tilt), (0.4, -0.2));
    // Relative by absolute, where the device has only those.
    let number = head.move_relative(-0.1, 0.1).unwrap();
    assert_eq!(end(&head, number), MoveEnd::Arrived);
    assert!((head.position().unwrap().pan - 0.3).abs() < 1e-9);
    assert_eq!(end(&head, head.home().unwrap()), MoveEnd::Arrived);
    assert_eq!(end(&head, head.recall_preset(3).unwrap()), MoveEnd::Arrived);
    assert!((head.position().unwrap().pan - 0.3).abs() < 1e-9);
}

#[test]
fn a_drive_that_is_not_renewed_stops_by_itself() {
    for with_brake in [false, true] {
        let fake = Fake { with_brake, ..Fake::new() };
        let head = fake.head();
        let number = head.drive(drive(0.5), 0.2).unwrap();
        for _ in 0..4 {
            std::thread::sleep(Duration::from_millis(100));
            assert_eq!(head.drive(drive(0.5), 0.2).unwrap(), number, "a renewed drive is the same move");
        }
        assert_eq!(fake.stops(), 0);
        assert_eq!(end(&head, number), MoveEnd::DeadMan);
        assert_eq!(fake.stops(), 1);
        // 0.4 s of renewals and 0.2 s, and what a loaded machine adds.
        let pan = head.position().unwrap().pan;
        assert!((0.25..0.6).contains(&pan), "{pan}");
    }
}

#[test]
fn a_stop_waits_for_nobody() {
    for with_brake in [false, true] {
        let fake = Fake { with_brake, ..Fake::new() };
        let head = Arc::new(fake.head());
        let number = head.drive(drive(0.5), 30.0).unwrap();
        fake.slow.store(400, Ordering::SeqCst);
        let reader = std::thread::spawn({
            let head = head.clone();
            move || head.position()
        });
        std::thread::sleep(Duration::from_millis(50));
        let begin = Instant::now();
        head.stop().unwrap();
        assert!(begin.elapsed() < Duration::from_millis(200), "{:?}", begin.elapsed());
        if with_brake {
            assert_eq!(fake.stops(), 1);
        }
        reader.join().unwrap().unwrap();
        fake.slow.store(0, Ordering::SeqCst);
        assert_eq!(end(&head, number), MoveEnd::Stopped);
        assert!(fake.stops() >= 1);
    }
}

#[test]
fn a_stop_during_a_command_stops_what_the_command_starts() {
    for with_brake in [false, true] {
        let fake = Fake { with_brake, ..Fake::new() };
        let head = Arc::new(fake.head());
        fake.slow.store(200, Ordering::SeqCst);
        let mover = std::thread::spawn({
            let head = head.clone();
            move || head.move_absolute(1.4, 0.0)
        });
        std::thread::sleep(Duration::from_millis(50));
        head.stop().unwrap();
        let number = mover.join().unwrap().unwrap();
        fake.slow.store(0, Ordering::SeqCst);
        assert_eq!(end(&head, number), MoveEnd::Stopped);
        let at = head.position().unwrap().pan;
        std::thread::sleep(Duration::from_millis(100));
        assert!(at < 1.0 && head.position().unwrap().pan == at, "{at}");
    }
}

#[test]
fn events_tell_how_each_move_ended() {
    let (sender, events) = mpsc::channel();
    let sender = Mutex::new(sender);
    let fake = Fake::new();
    let on_end: OnMoveEnd = Box::new(move |event| unpoisoned(&sender).send(event.clone()).unwrap());
    let head = Head::new(Box::new(fake.clone()), Log::silent(), Some(on_end));
    let next = || events.recv_timeout(Duration::from_secs(10)).unwrap();
    let first = head.move_absolute(1.0, 0.0).unwrap();
    let second = head.move_absolute(-0.2, 0.0).unwrap();
    assert_eq!(next(), MoveEvent { number: first, end: MoveEnd::Replaced, position: None });
    let event = next();
    assert_eq!((event.number, event.end), (second, MoveEnd::Arrived));
    assert_eq!(event.position.unwrap().pan, -0.2);
    // It takes the command, and does not move.
    fake.deaf.store(true, Ordering::SeqCst);
    head.move_absolute(0.5, 0.0).unwrap();
    assert_eq!(next().end, MoveEnd::Missed);
    fake.deaf.store(false, Ordering::SeqCst);
    head.move_absolute(1.0, 0.0).unwrap();
    fake.lost.store(true, Ordering::SeqCst);
    assert!(matches!(next().end, MoveEnd::Failed(Error::DeviceLost { .. })));
    fake.lost.store(false, Ordering::SeqCst);
    head.move_absolute(0.0, 0.0).unwrap();
    fake.panics.store(true, Ordering::SeqCst);
    assert!(matches!(next().end, MoveEnd::Failed(Error::Panic { .. })));
    fake.panics.store(false, Ordering::SeqCst);
    let number = head.move_absolute(0.0, 0.0).unwrap();
    assert_eq!((next().number, end(&head, number)), (number, MoveEnd::Arrived));
}

#[test]
fn a_drive_is_stopped_again_until_it_obeys() {
    let fake = Fake::new();
    let head = fake.head();
    let number = head.drive(drive(0.2), 0.1).unwrap();
    fake.lost.store(true, Ordering::SeqCst);
    // Watching gives up on a lost device; the drive must not be forgotten with it.
    std::thread::sleep(Duration::from_millis(300));
    fake.lost.store(false, Ordering::SeqCst);
    let end = end(&head, number);
    std::thread::sleep(Duration::from_millis(200));
    let at = head.position().unwrap().pan;
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(head.position().unwrap().pan, at, "{end:?}");
}

#[test]
fn a_dropped_head_is_stopped() {
    let fake = Fake::new();
    let head = fake.head();
    head.drive(drive(0.5), 30.0).unwrap();
    drop(head);
    assert!(fake.stops() >= 1);
    let at = unpoisoned(&fake.world).at();
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(unpoisoned(&fake.world).at(), at);
}

#[test]
fn nonsense_is_refused_and_nothing_moves() {
    let fake = Fake::new();
    let head = fake.head();
    assert!(matches!(head.move_absolute(f64::NAN, 0.0), Err(Error::NotFinite { .. })));
    assert!(matches!(head.move_absolute(1.6, 0.0), Err(Error::Unreachable { .. })));
    assert!(matches!(head.move_relative(0.0, f64::INFINITY), Err(Error::NotFinite { .. })));
    assert!(matches!(head.move_relative(0.0, 1.6), Err(Error::Unreachable { .. })));
    for (velocity, dead_man) in [(0.1, 0.0), (0.1, f64::NAN), (0.1, 61.0)] {
        assert!(matches!(head.drive(drive(velocity), dead_man), Err(Error::InvalidArgument { .. })));
    }
    assert!(matches!(head.drive(drive(f64::NAN), 1.0), Err(Error::NotFinite { .. })));
    assert!(head.drive(PtzVelocity { zoom: 1.5, ..PtzVelocity::default() }, 1.0).is_err());
    assert!(matches!(head.recall_preset(4), Err(Error::InvalidArgument { .. })));
    assert!(matches!(head.set_zoom(0.5), Err(Error::Unsupported { .. })));
    assert!(matches!(head.set_focus(Focus::At(2.0)), Err(Error::InvalidArgument { .. })));
    for number in [0, 7] {
        assert!(matches!(head.wait(number, 1.0, &Cancel::new()), Err(Error::InvalidArgument { .. })));
    }
    assert_eq!(unpoisoned(&fake.world).at(), [0.0; 2]);
    let number = head.move_absolute(1.4, 0.0).unwrap();
    assert!(matches!(head.wait(number, 0.01, &Cancel::new()), Err(Error::DeviceTimeout { .. })));
    let cancel = Cancel::new();
    cancel.cancel();
    assert_eq!(head.wait(number, 10.0, &cancel), Err(Error::Cancelled));
}
