//! The emulator against bytes written out as the manuals have them.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::*;
use crate::control::Clock;
use crate::device::visca::models::Model;
use crate::error::Error;
use crate::fuzz::fuzz_inputs;
use crate::sim::VirtualClock;

/// No time on the line.
fn options(models: &[&'static Model]) -> EmulatorOptions {
    EmulatorOptions { models: models.to_vec(), baud: 0.0, ..EmulatorOptions::default() }
}

/// An emulator and the moment.
struct Bench {
    emulator: Emulator,
    now: f64,
}

fn bench(model: &'static Model) -> Bench {
    Bench { emulator: Emulator::new(&options(&[model])).unwrap(), now: 100.0 }
}

fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

fn text(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02X}")).collect::<Vec<_>>().join(" ")
}

impl Bench {
    fn send(&mut self, bytes: &str) {
        self.emulator.feed(&hex(bytes), self.now);
    }

    /// Lets time pass; what was said, and when.
    fn wait(&mut self, seconds: f64) -> Vec<(f64, String)> {
        let begin = self.now;
        self.now += seconds;
        std::iter::from_fn(|| self.emulator.poll(self.now)).map(|o| (o.time - begin, text(&o.bytes))).collect()
    }

    /// Sends, and what is said within so many seconds.
    fn ask(&mut self, bytes: &str, seconds: f64) -> Vec<String> {
        self.send(bytes);
        self.wait(seconds).into_iter().map(|(_, said)| said).collect()
    }

    fn faults(&mut self, faults: &[&str]) {
        let faults: Vec<Fault> = faults.iter().map(|f| f.parse().unwrap()).collect();
        self.emulator.set_faults(&faults).unwrap();
    }
}

const POSITION: &str = "81 09 06 12 FF";
const MODE: &str = "81 09 06 10 FF";
/// To (0x100, 0x80) at full speed.
const MOVE: &str = "81 01 06 02 18 14 00 01 00 00 00 00 08 00 FF";
const STOP: &str = "81 01 06 01 01 01 03 03 FF";

#[test]
fn a_move_is_acknowledged_runs_and_is_completed() {
    let mut b = bench(&Model::EVI_D100);
    assert_eq!(b.ask(POSITION, 0.1), ["90 50 00 00 00 00 00 00 00 00 FF"]);
    assert_eq!(b.ask(MODE, 0.1), ["90 50 00 00 FF"]);
    let far = "81 01 06 02 0C 0C 00 05 0A 00 00 00 08 00 FF";
    b.send(far);
    let said = b.wait(0.1);
    assert_eq!(said.len(), 1);
    // 1 to 4 pictures after it came.
    assert!(said[0].1 == "90 41 FF" && (1.0 / 60.0..=4.0 / 60.0).contains(&said[0].0), "{said:?}");
    assert_eq!(b.ask(MODE, 0.1), ["90 50 04 00 FF"]);
    // Code 0C is 22 degrees a second: 100 degrees take 4.5 s.
    let said = b.wait(10.0);
    assert!(said.len() == 1 && said[0].1 == "90 51 FF" && (said[0].0 - 4.4).abs() < 0.1, "{said:?}");
    assert_eq!(b.ask(POSITION, 0.1), ["90 50 00 05 0A 00 00 00 08 00 FF"]);
    // Completed, and at the right end.
    assert_eq!(b.ask(MODE, 0.1), ["90 50 08 02 FF"]);
    assert_eq!(b.emulator.position(0, b.now), Some([0x5a0, 0x80]));
}

#[test]
fn the_brc_300_counts_to_the_left_in_five_nibbles() {
    let mut b = bench(&Model::BRC_300);
    assert_eq!(b.ask("81 01 06 02 18 00 00 00 01 00 00 00 08 00 00 FF", 9.0), ["90 41 FF", "90 51 FF"]);
    assert_eq!(b.ask(POSITION, 0.1), ["90 50 00 00 01 00 00 00 08 00 00 FF"]);
    // Driving right: the number falls.
    assert_eq!(b.ask("81 01 06 01 10 01 02 03 FF", 1.0).len(), 2);
    assert!(b.emulator.position(0, b.now).unwrap()[0] < 0x100);
    assert_eq!(b.ask("81 01 06 01 00 00 03 03 FF", 0.1), ["90 60 02 FF"]);
    // The same bytes as for a D100 are too few.
    assert_eq!(b.ask(MOVE, 0.1), ["90 60 02 FF"]);
}

#[test]
fn two_sockets_end_out_of_order_and_a_third_is_refused() {
    let mut b = bench(&Model::EVI_D100);
    assert_eq!(b.ask("81 01 06 02 01 01 00 01 00 00 00 00 00 00 FF", 0.1), ["90 41 FF"]);
    assert_eq!(b.ask("81 01 04 47 02 00 00 00 FF", 0.1), ["90 42 FF"]);
    assert_eq!(b.ask(MOVE, 0.1), ["90 60 03 FF"]);
    assert_eq!(b.ask(POSITION, 0.1)[0][..5], *"90 50");
    let said: Vec<String> = b.wait(60.0).into_iter().map(|(_, said)| said).collect();
    assert_eq!(said, ["90 52 FF", "90 51 FF"]);
    assert_eq!(b.ask("81 09 04 47 FF", 0.1), ["90 50 02 00 00 00 FF"]);
    assert_eq!(b.emulator.zoom(0, b.now), Some(0x2000));
}

#[test]
fn cancelling_stops_what_runs_and_says_so() {
    let mut b = bench(&Model::EVI_D100);
    assert_eq!(b.ask("81 21 FF", 0.1), ["90 61 05 FF"]);
    b.ask("81 01 06 02 01 01 00 05 0A 00 00 00 00 00 FF", 1.0);
    assert_eq!(b.ask("81 21 FF", 0.1), ["90 61 04 FF"]);
    let stands = b.emulator.position(0, b.now).unwrap();
    assert!(stands[0] > 0 && stands[0] < 0x5a0);
    assert!(b.wait(60.0).is_empty());
    assert_eq!(b.emulator.position(0, b.now), Some(stands));
    assert_eq!(b.ask(MODE, 0.1), ["90 50 00 00 FF"]);
}

#[test]
fn a_stop_ends_the_move_in_the_other_socket() {
    let mut b = bench(&Model::EVI_D100);
    b.ask("81 01 06 02 01 01 00 05 0A 00 00 00 00 00 FF", 1.0);
    let said = b.ask(STOP, 0.2);
    assert_eq!(said.len(), 3, "{said:?}");
    assert!(["90 42 FF", "90 51 FF", "90 52 FF"].iter().all(|s| said.iter().any(|t| t == s)), "{said:?}");
    let stands = b.emulator.position(0, b.now);
    b.wait(5.0);
    assert_eq!(b.emulator.position(0, b.now), stands);
}

#[test]
fn an_absolute_move_is_refused_until_the_head_is_stopped() {
    for busy in ["81 01 06 01 01 01 02 03 FF", "81 01 06 03 01 01 00 01 00 00 00 00 00 00 FF"] {
        let mut b = bench(&Model::EVI_D100);
        b.ask(busy, 0.5);
        let refused = b.ask(MOVE, 0.1);
        assert!(refused.len() == 1 && ["90 61 41 FF", "90 62 41 FF"].contains(&&refused[0][..]), "{refused:?}");
        b.ask(STOP, 0.2);
        assert_eq!(b.ask(MOVE, 9.0).len(), 2);
        assert_eq!(b.emulator.position(0, b.now), Some([0x100, 0x80]));
    }
    let behaviour = Behaviour { stop_first: false, ..Behaviour::default() };
    let emulator = Emulator::new(&EmulatorOptions { behaviour, ..options(&[&Model::EVI_D100]) }).unwrap();
    let mut b = Bench { emulator, now: 0.0 };
    b.ask("81 01 06 01 01 01 02 03 FF", 0.5);
    assert_eq!(b.ask(MOVE, 9.0).len(), 2);
}

#[test]
fn a_drive_goes_to_the_end_and_says_which() {
    let mut b = bench(&Model::EVI_D100);
    assert_eq!(b.ask("81 01 06 01 18 14 01 02 FF", 9.0), ["90 41 FF", "90 51 FF"]);
    assert_eq!(b.emulator.position(0, b.now), Some([-0x5a0, -0x168]));
    assert_eq!(b.ask(MODE, 0.1), ["90 50 00 09 FF"]);
    // One axis alone, then home.
    b.ask("81 01 06 01 18 14 03 01 FF", 9.0);
    assert_eq!(b.emulator.position(0, b.now), Some([-0x5a0, 0x168]));
    assert_eq!(b.ask("81 01 06 04 FF", 9.0), ["90 41 FF", "90 51 FF"]);
    assert_eq!(b.emulator.position(0, b.now), Some([0, 0]));
    assert_eq!(b.ask("81 01 06 03 18 14 0F 0F 0F 00 00 00 02 00 FF", 9.0).len(), 2);
    assert_eq!(b.emulator.position(0, b.now), Some([-16, 32]));
}

#[test]
fn a_chain_counts_its_cameras_and_each_answers_for_itself() {
    let models = [&Model::EVI_D30, &Model::EVI_D100, &Model::BRC_300];
    let mut b = Bench { emulator: Emulator::new(&options(&models)).unwrap(), now: 0.0 };
    assert_eq!(b.ask("88 30 01 FF", 0.1), ["88 30 04 FF"]);
    assert_eq!(b.ask("88 01 00 01 FF", 0.1), ["88 01 00 01 FF"]);
    assert_eq!(b.ask("81 09 00 02 FF", 0.1), ["90 50 00 01 04 02 01 00 02 FF"]);
    assert_eq!(b.ask("82 09 00 02 FF", 0.1), ["A0 50 00 01 04 0D 01 00 02 FF"]);
    assert_eq!(b.ask("83 09 06 12 FF", 0.1), ["B0 50 00 00 00 00 00 00 00 00 00 FF"]);
    assert!(b.ask("84 09 00 02 FF", 0.1).is_empty());
    assert_eq!(b.ask("82 01 00 01 FF", 0.1), ["A0 50 FF"]);
    b.ask(&MOVE.replace("81 ", "82 "), 9.0);
    assert_eq!(b.emulator.position(1, b.now), Some([0x100, 0x80]));
    assert_eq!((b.emulator.position(0, b.now), b.emulator.position(3, b.now)), (Some([0, 0]), None));
}

#[test]
fn nonsense_is_answered_by_a_syntax_error() {
    let mut b = bench(&Model::EVI_D100);
    for bad in ["81 01 06 FF", "81 09 06 55 FF", "81 01 06 01 19 01 02 03 FF", "81 01 04 39 07 FF", "81 77 FF"] {
        assert_eq!(b.ask(bad, 0.1), ["90 60 02 FF"], "{bad}");
    }
    // Bytes before a packet, and one that is cut: the next is heard.
    assert_eq!(b.ask("00 13 FF 81 09 06 81 09 06 12 FF", 0.1), ["90 60 02 FF"]);
    assert_eq!(b.ask(POSITION, 0.1).len(), 1);
}

#[test]
fn standby_and_automatic_modes_refuse() {
    let mut b = bench(&Model::EVI_D100);
    assert_eq!(b.ask("81 01 04 48 02 00 00 00 FF", 0.1), ["90 61 41 FF"]);
    assert_eq!(b.ask("81 01 04 38 03 FF", 0.2), ["90 41 FF", "90 51 FF"]);
    assert_eq!(b.ask("81 01 04 48 02 00 00 00 FF", 3.0), ["90 41 FF", "90 51 FF"]);
    assert_eq!(b.ask("81 09 04 48 FF", 0.1), ["90 50 02 00 00 00 FF"]);
    assert_eq!(b.ask("81 01 04 00 03 FF", 0.2).len(), 2);
    assert_eq!(b.ask(MOVE, 0.1), ["90 61 41 FF"]);
    assert_eq!(b.ask("81 09 04 00 FF", 0.1), ["90 50 03 FF"]);
    assert_eq!(b.ask("81 01 04 00 02 FF", 0.2).len(), 2);
    assert_eq!(b.ask(MOVE, 9.0).len(), 2);
}

#[test]
fn presets_remember_head_and_lens() {
    let mut b = bench(&Model::EVI_D100);
    assert_eq!(b.ask("81 01 04 3F 02 03 FF", 0.1), ["90 61 41 FF"]);
    b.ask(MOVE, 9.0);
    b.ask("81 01 04 47 01 00 00 00 FF", 9.0);
    assert_eq!(b.ask("81 01 04 3F 01 03 FF", 0.2).len(), 2);
    b.ask("81 01 06 04 FF", 9.0);
    b.ask("81 01 04 07 37 FF", 9.0);
    assert_eq!((b.emulator.position(0, b.now), b.emulator.zoom(0, b.now)), (Some([0, 0]), Some(0)));
    assert_eq!(b.ask("81 01 04 3F 02 03 FF", 9.0), ["90 41 FF", "90 51 FF"]);
    assert_eq!((b.emulator.position(0, b.now), b.emulator.zoom(0, b.now)), (Some([0x100, 0x80]), Some(0x1000)));
    assert_eq!(b.ask("81 01 04 3F 00 03 FF", 0.2).len(), 2);
    assert_eq!(b.ask("81 01 04 3F 02 03 FF", 0.1), ["90 61 41 FF"]);
    assert_eq!(b.ask("81 01 04 3F 02 06 FF", 0.1), ["90 60 02 FF"]);
}

#[test]
fn some_cameras_answer_old_positions_until_the_move_is_completed() {
    let behaviour = Behaviour { stale_position: true, ..Behaviour::default() };
    let emulator = Emulator::new(&EmulatorOptions { behaviour, ..options(&[&Model::EVI_D100]) }).unwrap();
    let mut b = Bench { emulator, now: 0.0 };
    b.ask("81 01 06 02 08 08 00 05 0A 00 00 00 00 00 FF", 2.0);
    assert!(b.emulator.position(0, b.now).unwrap()[0] > 100);
    assert_eq!(b.ask(POSITION, 0.1), ["90 50 00 00 00 00 00 00 00 00 FF"]);
    b.wait(60.0);
    assert_eq!(b.ask(POSITION, 0.1), ["90 50 00 05 0A 00 00 00 00 00 FF"]);
}

#[test]
fn lies_and_a_blocked_motor() {
    let mut b = bench(&Model::EVI_D100);
    b.faults(&["lie-arrived@0"]);
    assert_eq!(b.ask(MOVE, 0.2), ["90 41 FF", "90 51 FF"]);
    assert_eq!(b.ask(POSITION, 0.1), ["90 50 00 01 00 00 00 00 08 00 FF"]);
    assert_eq!((b.ask(MODE, 0.1), b.emulator.position(0, b.now)), (vec!["90 50 08 00 FF".into()], Some([0, 0])));
    b.faults(&["lie-ignored@0"]);
    b.ask("81 01 06 04 FF", 9.0);
    b.faults(&["lie-ignored@0"]);
    assert_eq!(b.ask(MOVE, 0.2), ["90 41 FF", "90 51 FF"]);
    assert_eq!(b.emulator.position(0, b.now), Some([0, 0]));
    b.faults(&["stall@0"]);
    assert_eq!(b.ask(MOVE, 9.0), ["90 41 FF", "90 51 FF"]);
    assert_eq!(b.ask(MODE, 0.1), ["90 50 0C 00 FF"]);
    assert_eq!(b.emulator.position(0, b.now), Some([0x80, 0x40]));
    // The next one is honest.
    b.ask(MOVE, 9.0);
    assert_eq!(b.ask(POSITION, 0.1), ["90 50 00 01 00 00 00 00 08 00 FF"]);
}

#[test]
fn silence_and_network_changes() {
    let mut b = bench(&Model::EVI_D100);
    b.faults(&["silence@0:2", "network-change@105"]);
    assert!(b.ask(POSITION, 1.0).is_empty());
    assert!(b.ask(POSITION, 2.0).is_empty());
    assert_eq!(b.ask(POSITION, 3.0).len(), 1);
    assert_eq!(b.ask(POSITION, 0.1), ["90 38 FF", "90 50 00 00 00 00 00 00 00 00 FF"]);
}

#[test]
fn a_serial_line_takes_its_time_both_ways() {
    let mut emulator = Emulator::new(&EmulatorOptions::default()).unwrap();
    emulator.feed(&hex(POSITION), 0.0);
    let next = emulator.next_event(0.0).unwrap();
    // 5 bytes there, one picture, 11 bytes back.
    assert!((next - (16.0 * 10.0 / 9600.0 + 1.0 / 60.0)).abs() < 1e-9, "{next}");
    assert!(emulator.poll(next - 1e-6).is_none());
    assert_eq!(emulator.poll(next).unwrap().bytes.len(), 11);
    assert_eq!(emulator.next_event(next), None);
}

fn memory(options: &EmulatorOptions) -> (ViscaDevice, Arc<VirtualClock>) {
    let clock = Arc::new(VirtualClock::default());
    (ViscaDevice::new(options, clock.clone()).unwrap(), clock)
}

#[test]
fn a_link_in_memory_waits_in_virtual_time() {
    let (device, clock) = memory(&options(&[&Model::EVI_D100]));
    let mut link = device.link().unwrap();
    let mut buffer = [0; 64];
    assert_eq!(link.receive(&mut buffer, 3.0).unwrap(), 0);
    assert!((clock.now() - 3.0).abs() < 1e-3);
    link.sender().send(&hex(POSITION)).unwrap();
    // In pieces that fit.
    let mut said = Vec::new();
    for wanted in [4, 4, 3] {
        let count = link.receive(&mut buffer[..4], 1.0).unwrap();
        assert_eq!(count, wanted);
        said.extend(&buffer[..count]);
    }
    assert_eq!(text(&said), "90 50 00 00 00 00 00 00 00 00 FF");
    assert!(clock.now() < 3.1);
    for bad in [f64::NAN, -1.0, 0.0] {
        assert_eq!(link.receive(&mut buffer, bad).unwrap(), 0);
    }
}

#[test]
fn an_unplugged_link_is_dead_and_a_new_one_works_when_it_is_plugged_in() {
    let faults = vec!["unplug@10:5".parse().unwrap()];
    let (device, clock) = memory(&EmulatorOptions { faults, ..options(&[&Model::EVI_D100]) });
    let mut link = device.link().unwrap();
    let mut buffer = [0; 64];
    let error = link.receive(&mut buffer, 100.0).unwrap_err();
    assert!(matches!(error, Error::DeviceLost { .. }) && (clock.now() - 10.0).abs() < 0.1, "{error}");
    assert!(matches!(link.sender().send(&hex(POSITION)), Err(Error::DeviceLost { .. })));
    assert!(matches!(device.link().map(|_| ()), Err(Error::DeviceNotFound { .. })));
    clock.sleep(5.0);
    assert!(matches!(link.receive(&mut buffer, 0.0), Err(Error::DeviceLost { .. })));
    let mut link = device.link().unwrap();
    link.sender().send(&hex(POSITION)).unwrap();
    assert_eq!(link.receive(&mut buffer, 1.0).unwrap(), 11);
}

#[test]
fn sequence_numbers_are_kept() {
    let (device, _) = memory(&options(&[&Model::EVI_D100]));
    let mut link = device.ip_link().unwrap();
    let mut ask = |datagram: &str| {
        link.sender().send(&hex(datagram)).unwrap();
        let mut buffer = [0; 64];
        let mut said = Vec::new();
        while let Ok(count @ 1..) = link.receive(&mut buffer, 3.0) {
            said.push(text(&buffer[..count]));
        }
        said
    };
    let moved = format!("01 00 00 0F 00 00 00 07 {MOVE}");
    assert_eq!(ask("02 00 00 01 00 00 00 09 01"), ["02 01 00 01 00 00 00 09 01"]);
    assert_eq!(ask(&moved), ["01 11 00 03 00 00 00 07 90 41 FF", "01 11 00 03 00 00 00 07 90 51 FF"]);
    assert_eq!(ask(&moved), ["02 01 00 02 00 00 00 07 0F 01"]);
    assert_eq!(ask("01 10 00 05 00 00 00 06 81 09 06 12 FF"), ["02 01 00 02 00 00 00 06 0F 01"]);
    let position = "01 11 00 0B 00 00 00 08 90 50 00 01 00 00 00 00 08 00 FF";
    assert_eq!(ask("01 10 00 05 00 00 00 08 81 09 06 12 FF"), [position]);
    // What was answered by an error may come again.
    for _ in 0..2 {
        assert_eq!(ask("01 10 00 05 00 00 00 09 81 09 06 55 FF"), ["01 11 00 04 00 00 00 09 90 60 02 FF"]);
    }
    assert_eq!(ask("01 11 00 03 00 00 00 0A 90 41 FF"), ["02 01 00 02 00 00 00 0A 0F 02"]);
    assert_eq!(ask("02 00 00 01 00 00 00 00 01").len(), 1);
    assert_eq!(ask("01 10 00 05 00 00 00 01 81 09 06 12 FF").len(), 1);
    // No such message at all, one whose payload is no packet, and one that is too long.
    assert!(ask("01 10 00").is_empty() && ask("07 07 00 01 00 00 00 02 81").is_empty());
    assert_eq!(ask("01 10 00 03 00 00 00 02 81 09 06"), ["01 11 00 04 00 00 00 02 90 60 02 FF"]);
}

#[test]
fn datagrams_get_lost_and_numbers_are_called_abnormal() {
    let (device, _) = memory(&options(&[&Model::EVI_D100]));
    let mut link = device.ip_link().unwrap();
    let mut buffer = [0; 64];
    let mut answered = 0;
    device.emulator().set_faults(&["lose=0.1".parse().unwrap()]).unwrap();
    for sequence in 0..1000u32 {
        let mut datagram = hex("01 10 00 05 00 00 00 00 81 09 06 12 FF");
        datagram[4..8].copy_from_slice(&sequence.to_be_bytes());
        link.sender().send(&datagram).unwrap();
        answered += usize::from(link.receive(&mut buffer, 0.1).unwrap() > 0);
    }
    // Lost on neither way: 0.81, standard deviation 12.4.
    assert!((760..860).contains(&answered), "{answered}");
    device.emulator().set_faults(&["sequence-error=1".parse().unwrap()]).unwrap();
    link.sender().send(&hex("01 10 00 05 00 00 10 00 81 09 06 12 FF")).unwrap();
    let count = link.receive(&mut buffer, 0.1).unwrap();
    assert_eq!(text(&buffer[..count]), "02 01 00 02 00 00 10 00 0F 01");
}

#[test]
fn options_out_of_range_are_refused() {
    let good = options(&[&Model::EVI_D30]);
    let behaviour = Behaviour { frame_time: f64::NAN, ..Behaviour::default() };
    for bad in [
        EmulatorOptions { models: Vec::new(), ..good.clone() },
        EmulatorOptions { models: vec![&Model::EVI_D30; 8], ..good.clone() },
        EmulatorOptions { baud: f64::NAN, ..good.clone() },
        EmulatorOptions { baud: 10.0, ..good.clone() },
        EmulatorOptions { behaviour, ..good.clone() },
        EmulatorOptions { faults: vec![Fault::new(FaultKind::Lose, When::Chance(2.0))], ..good },
    ] {
        assert!(matches!(Emulator::new(&bad), Err(Error::InvalidArgument { .. })), "{bad:?}");
    }
}

/// The same bytes come out of the same calls, and ten thousand moves take seconds.
#[test]
fn ten_thousand_moves_in_virtual_time() {
    let run = || {
        let faults = vec!["drop-byte=0.001".parse().unwrap(), "garble-byte=0.001".parse().unwrap()];
        let (device, clock) = memory(&EmulatorOptions { faults, ..EmulatorOptions::default() });
        let (mut link, mut random) = (device.link().unwrap(), ChaCha8Rng::seed_from_u64(4));
        let (mut buffer, mut all, mut completed) = ([0; 64], 0u64, 0);
        for _ in 0..10_000 {
            let (pan, tilt) = (random.next_u32() % 0x500, random.next_u32() % 0x100);
            let nibbles = |v: u32| [12, 8, 4, 0].map(|k| (v >> k & 15) as u8);
            let packet = [&[0x81, 1, 6, 2, 0x18, 0x14][..], &nibbles(pan), &nibbles(tilt), &[0xff]].concat();
            link.sender().send(&packet).unwrap();
            loop {
                let count = link.receive(&mut buffer, 2.0).unwrap();
                all = buffer[..count].iter().fold(all, |sum, &b| sum.wrapping_mul(31).wrapping_add(b.into()));
                completed += usize::from(count == 3 && buffer[1] & 0xf0 == 0x50);
                if count == 0 || buffer[1] & 0xf0 == 0x50 {
                    break;
                }
            }
        }
        (all, completed, clock.now())
    };
    let start = std::time::Instant::now();
    let first = run();
    println!("{} completed, {:.0} s of virtual time in {:?}", first.1, first.2, start.elapsed());
    // 21 bytes of each move may be hit, at 0.2 % each.
    assert!(first.1 > 9000 && first.1 < 9900, "{first:?}");
    assert_eq!(first, run());
}

/// Whatever comes in, nothing panics, time goes on and memory stays bounded.
#[test]
fn fuzz_bytes_and_datagrams() {
    let inputs = fuzz_inputs();
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut emulator = None;
    let (mut ip, mut now, mut said) = (super::ip::IpSession::default(), 0.0, 0u64);
    for i in 0..inputs {
        if i % 4096 == 0 {
            let models: Vec<&'static Model> = (0..1 + random.next_u32() % 7)
                .map(|_| Model::ALL[random.next_u32() as usize % Model::ALL.len()])
                .collect();
            let faults: Vec<Fault> =
                FaultKind::ALL.map(|kind| Fault { seconds: 0.2, ..Fault::new(kind, When::Chance(0.02)) }).to_vec();
            emulator = Some(Emulator::new(&EmulatorOptions { faults, ..options(&models) }).unwrap());
        }
        let emulator = emulator.as_mut().unwrap();
        // Packets with a good head and a body that is often nearly right.
        let mut bytes = [0u8; 20];
        random.fill_bytes(&mut bytes);
        let length = 3 + bytes[19] as usize % 15;
        bytes[0] = 0x80 | bytes[0] & 0x0f;
        bytes[1] = [0x01, 0x09, 0x21, bytes[1]][bytes[18] as usize % 4];
        bytes[2] = [0x04, 0x06, 0x00, bytes[2]][bytes[17] as usize % 4];
        if random.next_u32() % 4 > 0 {
            bytes[4..].iter_mut().for_each(|b| *b &= 0x0f);
        }
        bytes[length - 1] = 0xff;
        let packet = &bytes[..length];
        match random.next_u32() % 3 {
            0 => emulator.feed(packet, now),
            1 => emulator.feed_packet(packet, Origin { peer: 7, ..Origin::default() }, now),
            _ => {
                let mut datagram = [&[1, 0, 0, length as u8][..], &(i as u32).to_be_bytes(), packet].concat();
                if random.next_u32() % 8 == 0 {
                    datagram[random.next_u32() as usize % 8] ^= random.next_u32() as u8;
                }
                let _ = ip.hear(Origin { peer: 3, ..Origin::default() }, &datagram, emulator, now);
            }
        }
        now += f64::from(random.next_u32() % 100) * 1e-3;
        while let Some(outgoing) = emulator.poll(now) {
            assert!(!outgoing.bytes.is_empty() && outgoing.bytes.len() <= 16 && outgoing.time <= now);
            said += 1;
        }
        assert!(emulator.next_event(now).is_none_or(|t| t > now));
    }
    // Half of the addresses are nobody's, and much is lost.
    assert!(said > inputs / 10, "{said} of {inputs}");
}

/// The library's own driver on the line in memory.
#[test]
fn the_driver_moves_the_simulators_head() {
    use crate::control::Log;
    use crate::device::Motion;
    use crate::sim::{SimOptions, Simulator};
    for model in Model::ALL {
        let address = format!("sim:room?visca={}&backlash_deg=0&repeatability_deg=0", model.name);
        let simulator = Simulator::new(SimOptions::parse(&address).unwrap()).unwrap();
        let mut head = simulator.open_ptz(Log::silent()).unwrap();
        let (start, clock) = (std::time::Instant::now(), simulator.clock());
        for [pan, tilt] in [[0.3, -0.2], [-0.5, 0.3], [0.0, 0.0]] {
            head.move_absolute(pan, tilt).unwrap();
            let begin = clock.now();
            while head.motion().unwrap() != Motion::Idle {
                assert!(clock.now() - begin < 30.0, "{}", model.name);
                clock.sleep(0.05);
            }
            let at = head.position().unwrap();
            assert!((at.pan - pan).abs() <= 0.51 * model.pan.step(), "{} {at:?}", model.name);
            assert!((at.tilt - tilt).abs() <= 0.51 * model.tilt.step(), "{} {at:?}", model.name);
            // The picture shows it there.
            clock.sleep(1.0);
            let truth = simulator.spot_truth().point;
            let (origin, direction) = simulator.truth().rig.laser_in_world(at.pan, at.tilt);
            let off = (truth - origin).cross(&direction.normalize()).norm();
            assert!(off < 1e-6, "{}: {off}", model.name);
        }
        println!("{}: {:.1} s of virtual time in {:?}", model.name, clock.now(), start.elapsed());
    }
}
