use std::f64::consts::PI;
use std::sync::Arc;

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::codec::{Dialect, Drive, Framer, Message, Quantity, XorCoverage};
use super::driver::{PelcoHead, PelcoOptions, TiltDirection};
use super::emulator::{Device, Habits, Line};
use crate::control::{Clock, Log};
use crate::device::{Focus, Motion, PanTiltZoom, PtzVelocity};
use crate::error::{Error, Status};
use crate::fuzz::fuzz_inputs;

const P: Dialect = Dialect::P(XorCoverage::Whole);
const DIALECTS: [Dialect; 3] = [Dialect::D, P, Dialect::P(XorCoverage::Inner)];

fn bytes(hex: &str) -> Vec<u8> {
    hex.split(' ').map(|b| u8::from_str_radix(b, 16).unwrap()).collect()
}

fn drive(pan: i8, tilt: i8, zoom: i8, focus: i8) -> Message {
    Message::Drive(Drive { pan, tilt, zoom, focus })
}

/// Byte strings as devices' makers and programs in the field have them.
#[test]
fn published_bytes_are_written_and_read() {
    use Message::*;
    let of_d = [
        ("FF 01 00 00 00 00 01", drive(0, 0, 0, 0)),
        ("FF 01 00 08 00 3F 48", drive(0, 0x3F, 0, 0)),
        ("FF 01 00 10 00 30 41", drive(0, -0x30, 0, 0)),
        ("FF 01 00 02 20 00 23", drive(0x20, 0, 0, 0)),
        ("FF 01 00 04 3F 00 44", drive(-0x3F, 0, 0, 0)),
        ("FF 01 00 20 00 00 21", drive(0, 0, 1, 0)),
        ("FF 01 00 40 00 00 41", drive(0, 0, -1, 0)),
        ("FF 01 00 80 00 00 81", drive(0, 0, 0, -1)),
        ("FF 01 01 00 00 00 02", drive(0, 0, 0, 1)),
        ("FF 01 00 05 00 77 7D", ClearPreset(0x77)),
        ("FF 01 00 07 00 77 7F", GotoPreset(0x77)),
        ("FF 01 00 03 00 69 6D", SetPreset(0x69)),
        ("FF 01 00 4B 30 39 B5", SetPosition(Quantity::Pan, 12345)),
        ("FF 01 00 4B 23 28 97", SetPosition(Quantity::Pan, 9000)),
        ("FF 01 00 4D 11 94 F3", SetPosition(Quantity::Tilt, 4500)),
        ("FF 01 00 51 00 00 52", Query(Quantity::Pan)),
        ("FF 01 00 53 00 00 54", Query(Quantity::Tilt)),
        ("FF 01 00 55 00 00 56", Query(Quantity::Zoom)),
        ("FF 01 00 59 23 28 A5", Position(Quantity::Pan, 9000)),
    ];
    let of_p = [
        // Camera 1 is 0 on the wire.
        (1, "A0 00 00 00 00 00 AF 0F", drive(0, 0, 0, 0)),
        (1, "A0 00 00 04 20 00 AF 2B", drive(-0x20, 0, 0, 0)),
        (1, "A0 00 00 02 20 00 AF 2D", drive(0x20, 0, 0, 0)),
        (1, "A0 00 00 08 00 20 AF 27", drive(0, 0x20, 0, 0)),
        (1, "A0 00 00 10 00 20 AF 3F", drive(0, -0x20, 0, 0)),
        (2, "A0 01 00 51 00 00 AF 5F", Query(Quantity::Pan)),
        (2, "A0 01 00 4B 75 30 AF 00", SetPosition(Quantity::Pan, 30_000)),
    ];
    let all = of_d.map(|(hex, m)| (Dialect::D, 1, hex, m)).into_iter().chain(of_p.map(|(a, hex, m)| (P, a, hex, m)));
    for (dialect, address, hex, message) in all {
        let frame = bytes(hex);
        assert_eq!(dialect.encode(address, &message), frame, "{hex}");
        assert_eq!(dialect.decode(&frame), Some((address, message)), "{hex}");
        // No single damaged byte goes unnoticed.
        for at in 0..frame.len() {
            let mut damaged = frame.clone();
            damaged[at] ^= 0x11;
            assert_eq!(dialect.decode(&damaged), None, "{hex}, byte {at}");
        }
    }
    // Focus far and near of Pelco-P, of the makers' bit table; the other coverage of the xor.
    assert_eq!(P.encode(1, &drive(0, 0, 0, -1))[2..4], [1, 0]);
    assert_eq!(P.encode(1, &drive(0, 0, 0, 1))[2..4], [2, 0]);
    assert_eq!(DIALECTS[2].encode(1, &drive(-0x20, 0, 0, 0)), bytes("A0 00 00 04 20 00 AF 24"));
}

#[test]
fn fuzz_framer_finds_what_follows_any_noise() {
    let mut random = ChaCha8Rng::seed_from_u64(51);
    for dialect in DIALECTS {
        let mut framer = Framer::new(dialect);
        for _ in 0..fuzz_inputs() / 3 {
            let noise = random.next_u32() % 24;
            for _ in 0..noise {
                // Half of the bytes look like starts.
                let byte = random.next_u32();
                let byte = if byte & 0x100 == 0 { [0xFF, 0xA0][(byte & 1) as usize] } else { byte as u8 };
                framer.push(byte);
            }
            // A true message, far enough from the noise for no false start to reach into it.
            for _ in 0..dialect.frame_length() {
                framer.push(1);
            }
            let n = random.next_u32();
            let (address, value) = ((n >> 8) as u8 | 1, (n >> 16) as u16);
            let message = match n % 4 {
                0 => Message::Position(Quantity::Pan, value),
                1 => Message::SetPosition(Quantity::Zoom, value),
                2 => Message::GotoPreset(value as u8),
                _ => drive(value as i8 / 3, (value >> 8) as i8 / 3, 1, -1),
            };
            let frame = dialect.encode(address, &message);
            let found: Vec<_> = frame.iter().filter_map(|b| framer.push(*b)).collect();
            assert_eq!(found, [(address, message)], "{frame:?}");
        }
    }
}

fn line(dialect: Dialect, habits: Habits) -> Line {
    let mut device = Device::new(dialect, 3);
    device.habits = habits;
    Line::to(device)
}

fn open(line: &Line, options: PelcoOptions) -> crate::Result<PelcoHead> {
    PelcoHead::open(Box::new(line.clone()), options, Arc::new(line.clone()), &Log::silent())
}

fn options(dialect: Dialect) -> PelcoOptions {
    PelcoOptions { address: 3, ..PelcoOptions::new(dialect) }
}

const HALF_UNIT: f64 = 0.005001 * PI / 180.0;

#[test]
fn moves_arrive_where_they_were_sent_through_all_habits() {
    let habits = [
        Habits::default(),
        Habits { echoes: true, ..Habits::default() },
        Habits { acknowledges: true, ..Habits::default() },
        Habits { loses: 17, ..Habits::default() },
        Habits { no_zoom: true, ..Habits::default() },
    ];
    for (dialect, habits) in DIALECTS.into_iter().flat_map(|d| habits.map(|h| (d, h))) {
        let line = line(dialect, habits);
        let mut head = open(&line, options(dialect)).unwrap();
        assert!(head.capabilities().reports_position && !head.capabilities().reports_motion);
        for [pan, tilt] in [[0.5, -0.3], [-2.0, 0.25], [-PI, -1.5], [3.1, 0.0]] {
            head.move_absolute(pan, tilt).unwrap();
            assert_eq!(head.motion().unwrap(), Motion::Unknown);
            line.sleep(5.0);
            let at = head.position().unwrap();
            assert!((at.pan - pan).abs() < HALF_UNIT && (at.tilt - tilt).abs() < HALF_UNIT, "{habits:?} {at:?}");
        }
        head.set_zoom(0.25).unwrap();
        line.sleep(10.0);
        assert!((head.position().unwrap().zoom - 0.25).abs() < 1e-5);
    }
}

#[test]
fn right_and_up_are_right_and_up() {
    for (direction, tilt_word) in [(TiltDirection::Down, 36_000 - 1000), (TiltDirection::Up, 1000)] {
        let line = line(Dialect::D, Habits::default());
        let options = PelcoOptions { tilt_direction: direction, ..options(Dialect::D) };
        let mut head = open(&line, options).unwrap();
        // 20 degrees right, 10 up.
        head.move_absolute(20f64.to_radians(), 10f64.to_radians()).unwrap();
        line.sleep(2.0);
        assert_eq!(line.device().words()[..2], [2000, tilt_word]);
        head.move_relative(-30f64.to_radians(), 0.0).unwrap();
        line.sleep(2.0);
        assert_eq!(line.device().words()[..2], [35_000, tilt_word]);
    }
    // The device of these tests tilts as Pelco's domes: driving up reads as up.
    let line = line(Dialect::D, Habits::default());
    let full = PelcoOptions { full_speed: [PI / 2.0; 2], ..options(Dialect::D) };
    let mut head = open(&line, full).unwrap();
    head.drive(PtzVelocity { pan: -PI / 4.0, tilt: PI / 4.0, zoom: 0.0 }, f64::INFINITY).unwrap();
    line.sleep(1.0);
    head.stop().unwrap();
    let at = head.position().unwrap();
    assert!((at.pan + PI / 4.0).abs() < 0.02 && (at.tilt - PI / 4.0).abs() < 0.02, "{at:?}");
    // However slow, it moves; and is cut to what there is.
    head.drive(PtzVelocity { pan: 1e-6, tilt: -100.0, zoom: 0.5 }, 1.0).unwrap();
    let heard = line.device().heard.clone();
    assert_eq!(heard[heard.len() - 2..], [Message::ZoomSpeed(2), drive(1, -63, 1, 0)]);
}

#[test]
fn a_range_of_a_turn_from_zero_reads_within_it() {
    let line = line(Dialect::D, Habits::default());
    let mut head = open(&line, PelcoOptions { pan_range: [0.0, 6.25], ..options(Dialect::D) }).unwrap();
    head.move_absolute(5.0, 0.0).unwrap();
    line.sleep(5.0);
    assert!((head.position().unwrap().pan - 5.0).abs() < HALF_UNIT);
}

#[test]
fn presets_and_home_are_found_again() {
    let line = line(P, Habits::default());
    let mut head = open(&line, options(P)).unwrap();
    assert_eq!(head.capabilities().presets, 32);
    head.move_absolute(1.0, -0.5).unwrap();
    line.sleep(3.0);
    head.store_preset(31).unwrap();
    head.home().unwrap();
    line.sleep(3.0);
    assert_eq!(line.device().words()[..2], [0, 0]);
    head.recall_preset(31).unwrap();
    line.sleep(3.0);
    assert!((head.position().unwrap().pan - 1.0).abs() < HALF_UNIT);
    head.clear_preset(31).unwrap();
    assert_eq!(line.device().heard.last(), Some(&Message::ClearPreset(32)));
    head.set_focus(Focus::Manual).unwrap();
    assert_eq!(line.device().heard.last(), Some(&Message::AutoFocus(false)));
    assert_eq!(head.identity().unwrap().protocol, "Pelco-P");
}

#[test]
fn a_device_that_never_answers_is_noticed_and_usable() {
    for habits in [
        Habits { mute: true, ..Habits::default() },
        Habits { mute: true, echoes: true, ..Habits::default() },
        Habits { mute: true, acknowledges: true, ..Habits::default() },
    ] {
        let line = line(Dialect::D, habits);
        let warned = Arc::new(std::sync::Mutex::new(String::new()));
        let sink = warned.clone();
        let log = Log::to(move |_, text| sink.lock().unwrap().push_str(text));
        let mut head =
            PelcoHead::open(Box::new(line.clone()), options(Dialect::D), Arc::new(line.clone()), &log).unwrap();
        assert!(warned.lock().unwrap().contains("no answer"));
        assert!(!head.capabilities().reports_position);
        assert_eq!(head.position().unwrap_err().status(), Status::BadState);
        head.move_absolute(0.7, 0.1).unwrap();
        head.set_zoom(0.5).unwrap();
        let at = head.position().unwrap();
        assert_eq!([at.pan, at.tilt, at.zoom], [0.7, 0.1, 0.5]);
        // Where a drive ends nobody knows.
        head.drive(PtzVelocity { pan: 0.1, ..PtzVelocity::default() }, 1.0).unwrap();
        head.stop().unwrap();
        assert_eq!(head.position().unwrap_err().status(), Status::BadState);
        assert_eq!(head.move_relative(0.1, 0.0).unwrap_err().status(), Status::BadState);
    }
}

#[test]
fn the_brake_stops_at_once_without_an_answer() {
    for dialect in DIALECTS {
        let line = line(dialect, Habits::default());
        let mut head = open(&line, options(dialect)).unwrap();
        let brake = head.brake().unwrap();
        head.move_absolute(2.0, 0.0).unwrap();
        line.sleep(0.1);
        let before = line.now();
        brake.stop().unwrap();
        assert_eq!(line.now(), before);
        let at = line.device().words();
        line.sleep(5.0);
        assert_eq!(line.device().words(), at);
        line.device().habits.unplugged = true;
        assert_eq!(brake.stop().unwrap_err().status(), Status::DeviceLost);
    }
}

#[test]
fn failures_end_in_bounded_time_with_their_own_errors() {
    let fresh = |habits| line(Dialect::D, habits);
    let garbled = fresh(Habits { garbles: true, ..Habits::default() });
    let error = open(&garbled, options(Dialect::D)).err().unwrap();
    assert_eq!(error.status(), Status::DeviceGarbled);
    assert!(error.hint().unwrap().contains("baud"), "{error}");
    assert!(garbled.now() < 2.0);
    // The other dialect of Pelco-P, another address: nothing understands.
    let inner = line(DIALECTS[2], Habits::default());
    assert!(!open(&inner, options(P)).unwrap().capabilities().reports_position);
    let other = fresh(Habits::default());
    let two = PelcoOptions { address: 2, ..options(Dialect::D) };
    assert!(!open(&other, two).unwrap().capabilities().reports_position);
    // Silent after it had answered.
    let line = fresh(Habits::default());
    let mut head = open(&line, options(Dialect::D)).unwrap();
    line.device().habits.mute = true;
    let before = line.now();
    assert_eq!(head.position().unwrap_err().status(), Status::DeviceTimeout);
    assert!(line.now() - before < 1.0);
    line.device().habits.unplugged = true;
    assert_eq!(head.position().unwrap_err().status(), Status::DeviceLost);
    assert_eq!(head.move_absolute(0.0, 0.0).unwrap_err().status(), Status::DeviceLost);
    assert_eq!(head.stop().unwrap_err().status(), Status::DeviceLost);
}

#[test]
fn nonsense_is_refused_before_it_is_sent() {
    let line = line(Dialect::D, Habits::default());
    let tight = PelcoOptions { pan_range: [-1.0, 1.0], tilt_range: [-0.5, 0.2], ..options(Dialect::D) };
    let mut head = open(&line, tight).unwrap();
    line.device().heard.clear();
    let still = PtzVelocity::default();
    let refused: Vec<(Error, Status)> = vec![
        (head.move_absolute(f64::NAN, 0.0).unwrap_err(), Status::NotFinite),
        (head.move_absolute(0.0, f64::INFINITY).unwrap_err(), Status::NotFinite),
        (head.move_absolute(1.1, 0.0).unwrap_err(), Status::Unreachable),
        (head.move_absolute(0.0, 0.3).unwrap_err(), Status::Unreachable),
        (head.set_zoom(1.5).unwrap_err(), Status::InvalidArgument),
        (head.set_zoom(f64::NAN).unwrap_err(), Status::InvalidArgument),
        (head.drive(PtzVelocity { tilt: f64::NAN, ..still }, 1.0).unwrap_err(), Status::NotFinite),
        (head.store_preset(32).unwrap_err(), Status::InvalidArgument),
        (head.recall_preset(u32::MAX).unwrap_err(), Status::InvalidArgument),
        (head.clear_preset(256).unwrap_err(), Status::InvalidArgument),
        (head.set_focus(Focus::At(0.5)).unwrap_err(), Status::Unsupported),
        (head.focus().unwrap_err(), Status::Unsupported),
        (head.lock_exposure(true).unwrap_err(), Status::Unsupported),
    ];
    for (error, status) in refused {
        assert_eq!(error.status(), status, "{error}");
    }
    assert!(line.device().heard.is_empty());
}

/// Random bytes back from the device: no panic, bounded time, a position or an error.
#[test]
fn fuzz_replies() {
    struct Noise(ChaCha8Rng, Line);
    impl crate::device::Link for Noise {
        fn receive(&mut self, buffer: &mut [u8], timeout: f64) -> crate::Result<usize> {
            let n = self.0.next_u32();
            if n.is_multiple_of(3) {
                self.1.sleep(timeout);
                return Ok(0);
            }
            self.1.sleep(0.01);
            let count = (n >> 8) as usize % buffer.len();
            self.0.fill_bytes(&mut buffer[..count]);
            buffer[..count].iter_mut().step_by(3).for_each(|b| *b = [0xFF, 3, 0, 0x59, 0x5B][*b as usize % 5]);
            Ok(count)
        }
        fn sender(&self) -> Arc<dyn crate::device::Sender> {
            Arc::new(self.1.clone())
        }
    }
    let line = line(Dialect::D, Habits { mute: true, ..Habits::default() });
    let mut opened = 0;
    for seed in 0..fuzz_inputs() / 50 {
        let noise = Noise(ChaCha8Rng::seed_from_u64(seed), line.clone());
        let before = line.now();
        line.device().heard.clear();
        if let Ok(mut head) =
            PelcoHead::open(Box::new(noise), options(Dialect::D), Arc::new(line.clone()), &Log::silent())
        {
            opened += 1;
            if let Ok(at) = head.position() {
                assert!(at.pan.abs() <= PI && at.tilt.abs() <= PI && (0.0..=1.0).contains(&at.zoom));
            }
        }
        assert!(line.now() - before < 10.0);
    }
    assert!(opened > 0);
}

fn at(address: &str) -> crate::Result<PelcoHead> {
    super::open_head(&crate::device::Address::parse(address).unwrap(), &crate::device::Surroundings::default())
}

#[test]
fn every_wrong_address_says_what_is_wrong() {
    let wrong = [
        ("pelco-d:///dev/x?address=0", "address"),
        ("pelco-d:///dev/x?address=256", "address"),
        ("pelco-d:///dev/x?model=y", "model"),
        ("pelco-d:///dev/x?tilt=left", "tilt"),
        ("pelco-d:///dev/x?xor=whole", "xor"),
        ("pelco-p:///dev/x?xor=some", "xor"),
        ("pelco-d:///dev/x?pan_range=5..-5", "low..high"),
        ("pelco-d:///dev/x?pan_range=-360..360", "low..high"),
        ("pelco-d:///dev/x?tilt_range=nan..5", "low..high"),
        ("pelco-d:///dev/x?baud=9", "baud"),
        ("pelco-d://host/dev/x", "three slashes"),
        ("pelco-d+tcp://host/", "port"),
        ("pelco-d+tcp:///", "host"),
        ("pelco-d+udp://host:5?baud=9600", "baud"),
    ];
    for (address, part) in wrong {
        let error = at(address).err().unwrap();
        assert!(error.status() == Status::InvalidAddress && error.to_string().contains(part), "{address}: {error}");
    }
    for address in ["pelco-x:///dev/x", "pelco-d+can:///dev/x"] {
        assert_eq!(at(address).err().unwrap().status(), Status::Unsupported, "{address}");
    }
    assert_eq!(at("pelco-d:///dev/serial/by-id/none").err().unwrap().status(), Status::DeviceNotFound);
}

/// Plays the device on a stream of bytes, in real time, until it ends.
fn play(mut device: Device, mut stream: impl std::io::Read + std::io::Write) -> Device {
    let start = std::time::Instant::now();
    let mut buffer = [0; 64];
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return device,
            Ok(count) => {
                device.pass_to(start.elapsed().as_secs_f64());
                device.take(&buffer[..count]);
                let count = device.give(&mut buffer);
                stream.write_all(&buffer[..count]).unwrap();
            }
            Err(e) if e.kind() == std::io::ErrorKind::TimedOut => {}
            Err(_) => return device,
        }
    }
}

/// Moves there and stops half way back.
fn there_and_back(address: &str) {
    let mut head = at(address).unwrap();
    assert!(head.capabilities().reports_position, "{address}");
    head.move_absolute(0.2, -0.1).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(300));
    let there = head.position().unwrap();
    assert!((there.pan - 0.2).abs() < HALF_UNIT && (there.tilt + 0.1).abs() < HALF_UNIT, "{there:?}");
    head.move_absolute(2.0, 0.0).unwrap();
    head.brake().unwrap().stop().unwrap();
    let a = head.position().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(100));
    assert_eq!(head.position().unwrap(), a);
    assert!(a.pan < 1.5);
}

#[test]
fn a_device_on_a_pseudo_terminal_and_one_behind_a_device_server() {
    use serialport::SerialPort;
    let (mut far, near) = serialport::TTYPort::pair().unwrap();
    far.set_timeout(std::time::Duration::from_millis(50)).unwrap();
    let name = near.name().unwrap();
    drop(near);
    let device = Device::new(Dialect::D, 3);
    let playing = std::thread::spawn(move || play(device, far));
    there_and_back(&format!("pelco-d://{name}?address=3&baud=9600"));
    drop(playing);

    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let playing = std::thread::spawn(move || play(Device::new(DIALECTS[2], 7), listener.accept().unwrap().0));
    there_and_back(&format!("pelco-p+tcp://127.0.0.1:{port}?address=7&xor=inner"));
    let device = playing.join().unwrap();
    assert!(device.heard.contains(&drive(0, 0, 0, 0)));
}
