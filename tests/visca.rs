//! The VISCA driver against the emulated camera, which was written apart from it, while one thing
//! after the other goes wrong: every move ends at its target, or with an error that says why, in time.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ptzcal::control::{Clock, Log};
use ptzcal::device::visca::bus::{Bus, Transport};
use ptzcal::device::visca::models::Model;
use ptzcal::device::visca::{LONGEST_CALL, ViscaHead};
use ptzcal::device::{Address, Motion, PanTiltZoom, Surroundings, open_ptz};
use ptzcal::sim::visca_device::{EmulatorOptions, Fault, FaultKind, ServerBuilder, ViscaDevice, When};
use ptzcal::sim::{ScaledClock, VirtualClock};
use ptzcal::{Error, Result};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// A head that says that it is there is at most so far from its target, degrees.
const TOLERANCE: f64 = 0.25;
/// A workflow waits no longer for a move, virtual seconds.
const PATIENCE: f64 = 60.0;

/// How moves ended.
#[derive(Debug, Default)]
struct Tally {
    arrived: u32,
    failed: u32,
    errors: u32,
    /// Says that it is at its target and is not.
    astray: u32,
    /// Still moves when patience ends: a damaged byte was its speed.
    slow: u32,
    /// Longest single call and longest move, virtual seconds.
    longest_call: f64,
    longest: f64,
}

impl Tally {
    fn add(&mut self, other: &Self) {
        self.arrived += other.arrived;
        self.failed += other.failed;
        self.errors += other.errors;
        self.astray += other.astray;
        self.slow += other.slow;
        self.longest_call = self.longest_call.max(other.longest_call);
        self.longest = self.longest.max(other.longest);
    }
}

struct Rig {
    clock: Arc<VirtualClock>,
    device: ViscaDevice,
    head: ViscaHead,
    model: &'static Model,
}

impl Rig {
    fn new(model: &'static Model, transport: Transport, seed: u64) -> Self {
        let clock = Arc::new(VirtualClock::default());
        let options = EmulatorOptions { models: vec![model], seed, ..EmulatorOptions::default() };
        let device = ViscaDevice::new(&options, clock.clone()).unwrap();
        let far = device.clone();
        let opener = move || if transport == Transport::OverIp { far.ip_link() } else { far.link() };
        let bus = Bus::new("emulator", transport, Box::new(opener));
        let surroundings = Surroundings { clock: clock.clone(), log: Log::silent(), credentials: None };
        let head = ViscaHead::open(bus, 1, Some(model), &surroundings).unwrap();
        Self { clock, device, head, model }
    }

    /// Moves to a random place and waits as a workflow does.
    fn one_move(&mut self, rng: &mut ChaCha8Rng, tally: &mut Tally) {
        let c = self.head.capabilities();
        let target = [c.pan_range, c.tilt_range].map(|[low, high]| {
            let share = f64::from(rng.next_u32()) / f64::from(u32::MAX);
            low + share * (high - low)
        });
        let start = self.clock.now();
        let mut calls = tally.longest_call;
        let mut timed = |rig: &mut Self, call: &mut dyn FnMut(&mut ViscaHead) -> Result<Motion>| {
            let before = rig.clock.now();
            let result = call(&mut rig.head);
            calls = calls.max(rig.clock.now() - before);
            result
        };
        let mut end = timed(self, &mut |head| head.move_absolute(target[0], target[1]).map(|()| Motion::Moving));
        while end == Ok(Motion::Moving) && self.clock.now() - start < PATIENCE {
            self.clock.sleep(0.1);
            end = timed(self, &mut |head| head.motion());
        }
        tally.longest_call = calls;
        let now = self.clock.now();
        tally.longest = tally.longest.max(now - start);
        match end {
            Ok(Motion::Idle) => {
                let [pan, tilt] = self.device.emulator().position(0, now).unwrap();
                let at = [self.model.pan.to_radians(pan), self.model.tilt.to_radians(tilt)];
                let close = (0..2).all(|k| (at[k] - target[k]).abs() < TOLERANCE.to_radians());
                if close {
                    tally.arrived += 1;
                } else {
                    tally.astray += 1;
                }
            }
            Ok(Motion::Failed) => tally.failed += 1,
            Ok(Motion::Moving) => {
                tally.slow += 1;
                self.head.stop().unwrap();
            }
            Ok(Motion::Unknown) => panic!("a VISCA head knows"),
            Err(
                Error::DeviceTimeout { .. }
                | Error::DeviceGarbled { .. }
                | Error::DeviceMismatch { .. }
                | Error::DeviceRefused { .. }
                | Error::DeviceLost { .. },
            ) => {
                tally.errors += 1;
                // As a workflow would, it waits a little before it goes on.
                self.clock.sleep(0.5);
            }
            Err(other) => panic!("{other}"),
        }
    }

    fn moves(&mut self, count: u32, seed: u64) -> Tally {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut tally = Tally::default();
        for _ in 0..count {
            self.one_move(&mut rng, &mut tally);
        }
        tally
    }
}

const MOVES: u32 = 10_000;
const MODELS: [&Model; 4] = [&Model::EVI_D100, &Model::EVI_D70, &Model::BRC_300, &Model::PTZOPTICS];

fn with_fault(kind: FaultKind, probability: f64, transport: Transport) -> Tally {
    let mut all = Tally::default();
    for (i, model) in MODELS.into_iter().enumerate() {
        let mut rig = Rig::new(model, transport, 7 + i as u64);
        rig.device.emulator().set_faults(&[Fault::new(kind, When::Chance(probability))]).unwrap();
        let tally = rig.moves(MOVES / MODELS.len() as u32, i as u64);
        all.add(&tally);
        // And afterwards all is as ever.
        rig.device.emulator().set_faults(&[]).unwrap();
        rig.clock.sleep(10.0);
        let after = rig.moves(20, 99);
        assert!(after.arrived >= 19 && after.astray == 0, "{} {}: {after:?}", kind.name(), model.name);
    }
    all
}

#[test]
fn without_faults_every_move_arrives() {
    for model in Model::ALL {
        for transport in [Transport::Serial, Transport::OverIp] {
            let tally = Rig::new(model, transport, 3).moves(200, 1);
            assert_eq!(tally.arrived, 200, "{} {transport:?}: {tally:?}", model.name);
        }
    }
}

/// What must be so at least, of [`MOVES`]: moves that arrive, and that the camera says have failed.
fn expected(kind: FaultKind, transport: Transport) -> (u32, u32) {
    let over_ip = transport == Transport::OverIp;
    match kind {
        // What is only late, twice or astray costs time and nothing else.
        FaultKind::Split
        | FaultKind::Delay
        | FaultKind::WrongAddress
        | FaultKind::Duplicate
        | FaultKind::Reorder
        | FaultKind::SequenceError => (MOVES, 0),
        FaultKind::Lose => (MOVES, 0),
        FaultKind::NetworkChange if over_ip => (MOVES, 0),
        // One packet in six is damaged; a move is some twenty of them and their replies.
        FaultKind::DropByte | FaultKind::GarbleByte => (MOVES * 95 / 100, 0),
        FaultKind::Silence => (MOVES * 95 / 100, 0),
        // Setting the chain up stops what moves: each has some ten requests to be struck at.
        FaultKind::NetworkChange => (MOVES * 85 / 100, 0),
        // Away for five seconds each time.
        FaultKind::Unplug => (MOVES * 30 / 100, 0),
        // 1 % of the moves, within five standard deviations.
        FaultKind::LieIgnored | FaultKind::Stall => (MOVES - 150, 50),
        FaultKind::LieArrived => (MOVES - 150, 0),
    }
}

fn check(kind: FaultKind, transport: Transport) {
    let tally = with_fault(kind, 0.01, transport);
    let (arrived, failed) = expected(kind, transport);
    let context = format!("{} {transport:?}: {tally:?}", kind.name());
    println!("{context}");
    assert!(tally.arrived >= arrived && tally.failed >= failed, "{context}");
    // A camera that lies about its position as well is found out by the pictures only.
    let astray = if kind == FaultKind::LieArrived { 150 } else { 0 };
    assert!(tally.astray <= astray, "{context}");
    assert!(tally.slow == 0 || kind == FaultKind::GarbleByte && tally.slow < 20, "{context}");
    assert!(tally.longest_call <= LONGEST_CALL, "{context}");
}

#[test]
fn moves_arrive_or_say_why_whatever_goes_wrong_on_a_serial_line() {
    for kind in FaultKind::ALL {
        check(kind, Transport::Serial);
    }
}

#[test]
fn moves_arrive_or_say_why_whatever_goes_wrong_over_ip() {
    for kind in FaultKind::ALL {
        check(kind, Transport::OverIp);
    }
}

/// And all at once.
#[test]
fn moves_end_when_everything_goes_wrong() {
    for transport in [Transport::Serial, Transport::OverIp] {
        let mut rig = Rig::new(&Model::EVI_D100, transport, 1);
        let faults = FaultKind::ALL.map(|kind| Fault::new(kind, When::Chance(0.01)));
        rig.device.emulator().set_faults(&faults).unwrap();
        let tally = rig.moves(MOVES, 2);
        let context = format!("{transport:?}: {tally:?}");
        assert!(tally.arrived > MOVES / 10 && tally.astray <= 150, "{context}");
        assert!(tally.longest_call <= LONGEST_CALL, "{context}");
        rig.device.emulator().set_faults(&[]).unwrap();
        rig.clock.sleep(10.0);
        assert!(rig.moves(20, 3).arrived >= 19);
    }
}

/// Three heads on one line, all at work, while replies come under wrong addresses and the chain is
/// set up again and again: none takes another's replies for its own.
#[test]
fn heads_on_one_chain_do_not_disturb_each_other() {
    const ROUNDS: u32 = 1000;
    let models = [&Model::EVI_D100, &Model::EVI_D70, &Model::EVI_D30];
    let clock = Arc::new(VirtualClock::default());
    let options = EmulatorOptions { models: models.to_vec(), ..EmulatorOptions::default() };
    let device = ViscaDevice::new(&options, clock.clone()).unwrap();
    let far = device.clone();
    let bus = Bus::new("chain", Transport::Serial, Box::new(move || far.link()));
    let surroundings = Surroundings { clock: clock.clone(), log: Log::silent(), credentials: None };
    let mut heads = [1, 2, 3].map(|address| ViscaHead::open(bus.clone(), address, None, &surroundings).unwrap());
    let kinds = [FaultKind::WrongAddress, FaultKind::Duplicate, FaultKind::Delay, FaultKind::Lose];
    let mut faults = kinds.map(|kind| Fault::new(kind, When::Chance(0.01))).to_vec();
    faults.push(Fault::new(FaultKind::NetworkChange, When::Chance(0.001)));
    device.emulator().set_faults(&faults).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut arrived = 0;
    for _ in 0..ROUNDS {
        let mut targets = [[0.0; 2]; 3];
        let mut ends = [const { Ok(Motion::Moving) }; 3];
        for (head, (target, end)) in heads.iter_mut().zip(targets.iter_mut().zip(&mut ends)) {
            *target = [0.8, 0.4].map(|most| most * (f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5));
            *end = head.move_absolute(target[0], target[1]).map(|()| Motion::Moving);
        }
        let start = clock.now();
        while ends.contains(&Ok(Motion::Moving)) {
            assert!(clock.now() - start < PATIENCE);
            clock.sleep(0.05);
            for (head, end) in heads.iter_mut().zip(&mut ends).filter(|(_, end)| **end == Ok(Motion::Moving)) {
                *end = head.motion();
            }
        }
        for (i, (end, target)) in ends.into_iter().zip(targets).enumerate() {
            match end {
                Ok(Motion::Idle) => {
                    let [pan, tilt] = device.emulator().position(i, clock.now()).unwrap();
                    let at = [models[i].pan.to_radians(pan), models[i].tilt.to_radians(tilt)];
                    assert!((0..2).all(|k| (at[k] - target[k]).abs() < TOLERANCE.to_radians()), "{at:?} {target:?}");
                    arrived += 1;
                }
                Ok(Motion::Failed) => (),
                other => panic!("head {i}: {other:?}"),
            }
        }
    }
    // A set-up stops all three.
    assert!(arrived > 3 * ROUNDS * 90 / 100, "{arrived}");
}

fn wait(head: &mut dyn PanTiltZoom) -> Motion {
    let start = Instant::now();
    loop {
        match head.motion().unwrap() {
            Motion::Moving => assert!(start.elapsed() < Duration::from_secs(20)),
            other => return other,
        }
    }
}

/// In real time, through the system's descriptors.
#[test]
fn addresses_reach_cameras_on_every_kind_of_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera");
    let device = ViscaDevice::new(&EmulatorOptions::default(), Arc::new(ScaledClock::new(1.0))).unwrap();
    let mut server = ServerBuilder::new(&device);
    server.pty(&path).unwrap();
    let any = "127.0.0.1:0".parse().unwrap();
    let (ip, raw, tcp) = (server.ip(any).unwrap(), server.raw_udp(any).unwrap(), server.raw_tcp(any).unwrap());
    let server = server.start().unwrap();
    let addresses = [
        format!("visca://{}", path.display()),
        format!("visca+udp://{ip}"),
        format!("visca+udp-raw://{raw}"),
        format!("visca+tcp://{tcp}"),
    ];
    let surroundings = Surroundings::default();
    for (i, address) in addresses.iter().enumerate() {
        let mut head = open_ptz(&Address::parse(address).unwrap(), &surroundings).unwrap();
        assert_eq!(head.identity().unwrap().model, "EVI-D100", "{address}");
        let pan = 0.1 * (i as f64 + 1.0);
        head.move_absolute(pan, -0.05).unwrap();
        assert_eq!(wait(&mut *head), Motion::Idle, "{address}");
        let at = head.position().unwrap();
        assert!((at.pan - pan).abs() < 2e-3 && (at.tilt + 0.05).abs() < 2e-3, "{address}: {at:?}");
    }
    drop(server);
}

#[test]
fn an_unplugged_camera_comes_back_under_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera");
    let device = ViscaDevice::new(&EmulatorOptions::default(), Arc::new(ScaledClock::new(1.0))).unwrap();
    let mut server = ServerBuilder::new(&device);
    server.pty(&path).unwrap();
    let server = server.start().unwrap();
    let address = Address::parse(&format!("visca://{}", path.display())).unwrap();
    let mut head = open_ptz(&address, &Surroundings::default()).unwrap();
    let unplug = Fault { kind: FaultKind::Unplug, when: When::At(0.0), seconds: 0.5 };
    device.emulator().set_faults(&[unplug]).unwrap();
    let start = Instant::now();
    let patience = Duration::from_secs(20);
    let lost = loop {
        assert!(start.elapsed() < patience);
        if let Err(error) = head.position() {
            break error;
        }
    };
    assert!(matches!(lost, Error::DeviceLost { .. }), "{lost}");
    while head.position().is_err() {
        assert!(start.elapsed() < patience);
        std::thread::sleep(Duration::from_millis(20));
    }
    head.move_absolute(0.1, 0.0).unwrap();
    assert_eq!(wait(&mut *head), Motion::Idle);
    drop(server);
}

#[test]
fn a_brake_stops_a_move_from_another_thread() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera");
    let options = EmulatorOptions { models: vec![&Model::EVI_D30], ..EmulatorOptions::default() };
    let device = ViscaDevice::new(&options, Arc::new(ScaledClock::new(1.0))).unwrap();
    let mut server = ServerBuilder::new(&device);
    server.pty(&path).unwrap();
    let server = server.start().unwrap();
    let address = Address::parse(&format!("visca://{}", path.display())).unwrap();
    let mut head = open_ptz(&address, &Surroundings::default()).unwrap();
    let brake = head.brake().unwrap();
    // Two seconds and more at 80 degrees per second.
    let target = head.capabilities().pan_range[1];
    let driver = std::thread::spawn(move || {
        head.move_absolute(target, 0.0).unwrap();
        let end = wait(&mut *head);
        (end, head.position().unwrap().pan, head)
    });
    std::thread::sleep(Duration::from_millis(400));
    brake.stop().unwrap();
    let (end, pan, mut head) = driver.join().unwrap();
    assert_eq!(end, Motion::Idle, "stopped, not failed");
    assert!(pan < target - 0.3, "{pan}");
    head.move_absolute(pan - 0.1, 0.0).unwrap();
    assert_eq!(wait(&mut *head), Motion::Idle);
    drop(server);
}
