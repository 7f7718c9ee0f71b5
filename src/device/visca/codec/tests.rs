use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::*;
use crate::device::visca::models::Model;
use crate::fuzz::fuzz_inputs;

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(5)
}

fn below(rng: &mut ChaCha8Rng, n: u32) -> u32 {
    ((u64::from(rng.next_u32()) * u64::from(n)) >> 32) as u32
}

fn within(rng: &mut ChaCha8Rng, low: i32, high: i32) -> i32 {
    low + below(rng, (high - low + 1) as u32) as i32
}

fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|b| u8::from_str_radix(b, 16).unwrap()).collect()
}

fn packet(text: &str) -> Packet {
    Packet::from_bytes(&hex(text)).unwrap()
}

/// A request that the model's form holds exactly.
fn any_request(model: &Model, rng: &mut ChaCha8Rng) -> Request {
    let top = [model.pan.max_speed_code(), model.tilt.max_speed_code()].map(i32::from);
    let mut speed = top.map(|top| within(rng, 1, top) as u8);
    if model.one_speed {
        speed[1] = speed[0];
    }
    let [pan, tilt] = [model.pan, model.tilt].map(|axis| {
        let limit = 1 << (4 * axis.nibbles - 1);
        within(rng, -limit, limit - 1)
    });
    let number = below(rng, 0x1_0000) as u16;
    let register = Register::ALL[below(rng, 11) as usize];
    let zoom_speed = (below(rng, 2) == 1).then_some(number as u8 & 7);
    match below(rng, 15) {
        0 => Request::AddressSet,
        1 => Request::ClearAll,
        2 => Request::Clear,
        3 => Request::Cancel(number as u8 & 15),
        4 => Request::Drive { pan: within(rng, -top[0], top[0]) as i8, tilt: within(rng, -top[1], top[1]) as i8 },
        5 => Request::MoveTo { speed, pan, tilt },
        6 => Request::MoveBy { speed, pan, tilt },
        7 => Request::Home,
        8 => Request::Reset,
        9 => {
            Request::Zoom([Zooming::Stop, Zooming::Tele(zoom_speed), Zooming::Wide(zoom_speed)][below(rng, 3) as usize])
        }
        10 => Request::OnePushWhite,
        11 => Request::Preset(
            [PresetAction::Clear, PresetAction::Store, PresetAction::Recall][below(rng, 3) as usize],
            below(rng, model.presets) as u8,
        ),
        12 => Request::Set(register, register_value(register, number)),
        13 => Request::Inquire(Inquiry::Register(register)),
        _ => Request::Inquire(
            [Inquiry::Version, Inquiry::Position, Inquiry::MaxSpeed, Inquiry::Mode][below(rng, 4) as usize],
        ),
    }
}

fn register_value(register: Register, number: u16) -> u16 {
    let byte =
        [Register::Power, Register::WhiteBalance, Register::FocusMode, Register::ExposureMode].contains(&register);
    if byte { number % 0xff } else { number }
}

#[test]
fn every_request_comes_back() {
    let mut rng = rng();
    for model in Model::ALL {
        for _ in 0..20_000 {
            let request = any_request(model, &mut rng);
            let address = 1 + below(&mut rng, 7) as u8;
            let packet = request.encode(model, address);
            assert_eq!(Packet::from_bytes(packet.bytes()), Some(packet));
            assert_eq!(Request::decode(model, &packet), Ok(request), "{packet:?}");
            assert_eq!(packet.receiver(), if request.is_broadcast() { BROADCAST } else { address });
        }
    }
}

#[test]
fn every_reply_comes_back() {
    let mut rng = rng();
    for _ in 0..50_000 {
        let socket = below(&mut rng, 16) as u8;
        let address = 1 + below(&mut rng, 7) as u8;
        let mut bytes = [0; 13];
        rng.fill_bytes(&mut bytes);
        let bytes = bytes.map(|b| b.min(0xfe));
        let payload = Payload::new(&bytes[..1 + below(&mut rng, 13) as usize]).unwrap();
        let fault = [
            Fault::Length,
            Fault::Syntax,
            Fault::BufferFull,
            Fault::Cancelled,
            Fault::NoSocket,
            Fault::NotExecutable,
            Fault::Other(0x77),
        ];
        let replies = [
            (Reply::AddressSet { next: 1 + below(&mut rng, 8) as u8 }, 0),
            (Reply::ClearedAll, 0),
            (Reply::Cleared, address),
            (Reply::NetworkChange, address),
            (Reply::Ack { socket }, address),
            (Reply::Completion { socket: socket.max(1) }, address),
            (Reply::Inquiry(payload), address),
            (Reply::Error { socket, fault: fault[below(&mut rng, 7) as usize] }, address),
        ];
        for (reply, from) in replies {
            let packet = reply.encode(address);
            assert_eq!(Packet::from_bytes(packet.bytes()), Some(packet));
            assert_eq!(Reply::decode(&packet), Some((from, reply)), "{packet:?}");
        }
    }
    assert!(Payload::new(&[]).is_none() && Payload::new(&[0; 14]).is_none() && Payload::new(&[0xff]).is_none());
}

#[test]
fn every_answer_comes_back() {
    let mut rng = rng();
    for model in Model::ALL {
        for _ in 0..5_000 {
            let word = |rng: &mut ChaCha8Rng| (below(rng, 0xff) << 8 | below(rng, 0xff)) as u16;
            let [pan, tilt] = [model.pan, model.tilt].map(|axis| {
                let limit = 1 << (4 * axis.nibbles - 1);
                within(&mut rng, -limit, limit - 1)
            });
            let version = Version { vendor: word(&mut rng), model: word(&mut rng), rom: word(&mut rng), sockets: 2 };
            let register = Register::ALL[below(&mut rng, 11) as usize];
            let value = register_value(register, below(&mut rng, 0x1_0000) as u16);
            let answers = [
                (Inquiry::Version, Answer::Version(version)),
                (Inquiry::Position, Answer::Position { pan, tilt }),
                (Inquiry::MaxSpeed, Answer::MaxSpeed { pan: 0x18, tilt: below(&mut rng, 0x18) as u8 }),
                (Inquiry::Mode, Answer::Mode(ModeWord(word(&mut rng)))),
                (Inquiry::Register(register), Answer::Value(value)),
            ];
            for (inquiry, answer) in answers {
                let payload = answer.encode(model, inquiry).unwrap();
                assert_eq!(Answer::decode(model, inquiry, &payload), Some(answer), "{payload:?}");
            }
            assert!(Answer::MaxSpeed { pan: 1, tilt: 1 }.encode(model, Inquiry::Position).is_none());
        }
    }
}

/// Bytes as manuals print them.
#[test]
fn requests_have_their_printed_bytes() {
    let (d100, brc) = (&Model::EVI_D100, &Model::BRC_300);
    let inquire = |inquiry| Request::Inquire(inquiry);
    let table = [
        (d100, Request::AddressSet, "88 30 01 FF"),
        (d100, Request::ClearAll, "88 01 00 01 FF"),
        (d100, Request::Clear, "81 01 00 01 FF"),
        (d100, inquire(Inquiry::Version), "81 09 00 02 FF"),
        (d100, Request::Cancel(2), "81 22 FF"),
        (d100, Request::STOP, "81 01 06 01 01 01 03 03 FF"),
        (d100, Request::Drive { pan: -3, tilt: 0x14 }, "81 01 06 01 03 14 01 01 FF"),
        (d100, Request::Drive { pan: 0x18, tilt: -1 }, "81 01 06 01 18 01 02 02 FF"),
        (
            d100,
            Request::MoveTo { speed: [0x18, 0x14], pan: -1440, tilt: 360 },
            "81 01 06 02 18 14 0F 0A 06 00 00 01 06 08 FF",
        ),
        (d100, Request::MoveBy { speed: [1, 1], pan: 1, tilt: -1 }, "81 01 06 03 01 01 00 00 00 01 0F 0F 0F 0F FF"),
        (
            brc,
            Request::MoveTo { speed: [0x18, 0x18], pan: -0x8a58, tilt: 0x493d },
            "81 01 06 02 18 00 0F 07 05 0A 08 04 09 03 0D FF",
        ),
        (d100, Request::Home, "81 01 06 04 FF"),
        (d100, Request::Reset, "81 01 06 05 FF"),
        (d100, inquire(Inquiry::Position), "81 09 06 12 FF"),
        (d100, inquire(Inquiry::MaxSpeed), "81 09 06 11 FF"),
        (d100, inquire(Inquiry::Mode), "81 09 06 10 FF"),
        (d100, Request::Set(Register::Zoom, 0x4000), "81 01 04 47 04 00 00 00 FF"),
        (d100, inquire(Inquiry::Register(Register::Zoom)), "81 09 04 47 FF"),
        (d100, Request::Zoom(Zooming::Stop), "81 01 04 07 00 FF"),
        (d100, Request::Zoom(Zooming::Tele(Some(7))), "81 01 04 07 27 FF"),
        (d100, Request::Zoom(Zooming::Wide(None)), "81 01 04 07 03 FF"),
        (d100, Request::Set(Register::FocusMode, 3), "81 01 04 38 03 FF"),
        (d100, Request::Set(Register::Focus, 0x1234), "81 01 04 48 01 02 03 04 FF"),
        (d100, Request::Set(Register::ExposureMode, 3), "81 01 04 39 03 FF"),
        (d100, Request::Set(Register::WhiteBalance, 5), "81 01 04 35 05 FF"),
        (d100, Request::Set(Register::Shutter, 0x11), "81 01 04 4A 00 00 01 01 FF"),
        (d100, Request::Set(Register::Iris, 0x0d), "81 01 04 4B 00 00 00 0D FF"),
        (d100, Request::Set(Register::Gain, 7), "81 01 04 4C 00 00 00 07 FF"),
        (d100, Request::Preset(PresetAction::Store, 5), "81 01 04 3F 01 05 FF"),
        (d100, Request::Preset(PresetAction::Recall, 0), "81 01 04 3F 02 00 FF"),
        (d100, inquire(Inquiry::Register(Register::Power)), "81 09 04 00 FF"),
        (d100, Request::OnePushWhite, "81 01 04 10 05 FF"),
    ];
    for (model, request, bytes) in table {
        assert_eq!(request.encode(model, 1).bytes(), hex(bytes), "{request:?}");
        assert_eq!(Request::decode(model, &packet(bytes)), Ok(request));
    }
    assert_eq!(Request::Home.encode(d100, 7).bytes(), hex("87 01 06 04 FF"));
}

#[test]
fn replies_have_their_printed_bytes() {
    let table = [
        ("88 30 03 FF", 0, Reply::AddressSet { next: 3 }),
        ("88 01 00 01 FF", 0, Reply::ClearedAll),
        ("90 50 FF", 1, Reply::Cleared),
        ("A0 38 FF", 2, Reply::NetworkChange),
        ("90 41 FF", 1, Reply::Ack { socket: 1 }),
        ("F0 52 FF", 7, Reply::Completion { socket: 2 }),
        ("90 60 02 FF", 1, Reply::Error { socket: 0, fault: Fault::Syntax }),
        ("90 60 03 FF", 1, Reply::Error { socket: 0, fault: Fault::BufferFull }),
        ("90 61 04 FF", 1, Reply::Error { socket: 1, fault: Fault::Cancelled }),
        ("90 62 05 FF", 1, Reply::Error { socket: 2, fault: Fault::NoSocket }),
        ("90 61 41 FF", 1, Reply::Error { socket: 1, fault: Fault::NotExecutable }),
        ("90 60 01 FF", 1, Reply::Error { socket: 0, fault: Fault::Length }),
    ];
    for (bytes, from, reply) in table {
        assert_eq!(Reply::decode(&packet(bytes)), Some((from, reply)), "{bytes}");
        assert_eq!(reply.encode(from).bytes(), hex(bytes));
    }
    for request in ["81 01 06 04 FF", "81 09 06 12 FF", "90 71 FF", "90 41 00 FF", "91 41 FF", "88 30 00 FF"] {
        assert_eq!(Reply::decode(&packet(request)), None, "{request}");
    }
}

fn answered(model: &Model, inquiry: Inquiry, bytes: &str) -> Option<Answer> {
    match Reply::decode(&packet(bytes)) {
        Some((1, Reply::Inquiry(payload))) => Answer::decode(model, inquiry, &payload),
        other => panic!("{bytes}: {other:?}"),
    }
}

#[test]
fn answers_have_their_printed_bytes() {
    let (d100, brc) = (&Model::EVI_D100, &Model::BRC_300);
    let version = Version { vendor: 0x20, model: 0x40d, rom: 0x101, sockets: 2 };
    assert_eq!(answered(d100, Inquiry::Version, "90 50 00 20 04 0D 01 01 02 FF"), Some(Answer::Version(version)));
    let at = |pan, tilt| Some(Answer::Position { pan, tilt });
    assert_eq!(answered(d100, Inquiry::Position, "90 50 0F 0A 06 00 00 01 06 08 FF"), at(-1440, 360));
    assert_eq!(answered(brc, Inquiry::Position, "90 50 00 08 0A 05 08 0E 07 09 06 FF"), at(0x8a58, -0x186a));
    // An answer in another model's form is none.
    assert_eq!(answered(d100, Inquiry::Position, "90 50 00 08 0A 05 08 0E 07 09 06 FF"), None);
    assert_eq!(answered(d100, Inquiry::Position, "90 50 1F 0A 06 00 00 01 06 08 FF"), None);
    assert_eq!(answered(d100, Inquiry::MaxSpeed, "90 50 18 14 FF"), Some(Answer::MaxSpeed { pan: 0x18, tilt: 0x14 }));
    for (bytes, state) in [
        ("90 50 00 00 FF", DriveState::None),
        ("90 50 04 00 FF", DriveState::Moving),
        ("90 50 08 00 FF", DriveState::Completed),
        ("90 50 0C 00 FF", DriveState::Failed),
    ] {
        assert_eq!(answered(d100, Inquiry::Mode, bytes), Some(Answer::Mode(ModeWord::new(state))));
    }
    let word = ModeWord(0x0809);
    assert_eq!(
        (word.state(), word.at_end(), word.is_lost()),
        (DriveState::Completed, [true, false, false, true], false)
    );
    assert!(ModeWord(0x0100).is_lost() && ModeWord(0x0020).is_lost());
    let zoom = Inquiry::Register(Register::Zoom);
    assert_eq!(answered(d100, zoom, "90 50 03 0F 0F 0F FF"), Some(Answer::Value(0x3fff)));
    assert_eq!(answered(d100, zoom, "90 50 03 FF"), None);
    let exposure = Inquiry::Register(Register::ExposureMode);
    assert_eq!(answered(d100, exposure, "90 50 0D FF"), Some(Answer::Value(0x0d)));
}

/// Five poses of a BirdDog P100 (bitfocus/companion-module-birddog-ptz, issue 203): left is negative,
/// up is positive.
#[test]
fn a_captured_dialogue_is_understood() {
    let model = &Model::PTZOPTICS;
    let bytes = hex("01 10 00 05 00 00 00 01 81 09 06 12 ff");
    let request = Request::Inquire(Inquiry::Position);
    let asked = ip::Message::decode(&bytes).unwrap();
    assert_eq!((asked.kind, asked.sequence), (ip::Kind::Inquiry, 1));
    assert_eq!(asked.payload, request.encode(model, 1).bytes());
    assert_eq!(asked.encode(), bytes);
    let poses = [
        ("0f 07 02 06 0f 0e 07 08", [-2266, -392]),
        ("0f 07 02 06 0f 0f 0f 0d", [-2266, -3]),
        ("0f 07 02 06 00 04 09 0c", [-2266, 1180]),
        ("0f 0e 0a 00 00 04 0a 08", [-352, 1192]),
        ("00 08 0d 0a 00 04 0a 08", [2266, 1192]),
    ];
    for (nibbles, [pan, tilt]) in poses {
        let bytes = hex(&format!("01 11 00 0b 00 00 00 01 90 50 {nibbles} ff"));
        let message = ip::Message::decode(&bytes).unwrap();
        assert_eq!((message.kind, message.sequence), (ip::Kind::Reply, 1));
        let Some((1, Reply::Inquiry(payload))) = Reply::decode(&Packet::from_bytes(message.payload).unwrap()) else {
            panic!("{nibbles}");
        };
        assert_eq!(Answer::decode(model, Inquiry::Position, &payload), Some(Answer::Position { pan, tilt }));
    }
}

#[test]
fn what_a_camera_refuses_is_refused() {
    let (d30, brc) = (&Model::EVI_D30, &Model::BRC_300);
    // Speed 0.
    assert_eq!(Request::decode(brc, &packet("81 01 06 01 00 00 03 03 FF")), Err(Fault::Syntax));
    assert_eq!(Request::decode(d30, &packet("81 01 06 01 00 00 03 03 FF")), Ok(Request::STOP));
    assert_eq!(Request::decode(brc, &packet("81 01 06 01 01 01 03 03 FF")), Ok(Request::STOP));
    // Four nibbles where five belong, and the other way round.
    assert!(Request::decode(brc, &packet("81 01 06 02 01 00 00 00 00 00 00 00 00 00 FF")).is_err());
    assert!(Request::decode(d30, &packet("81 01 06 02 01 01 00 00 00 00 00 00 00 00 00 FF")).is_err());
    for bad in [
        "81 01 06 01 19 01 03 03 FF",
        "81 01 06 01 01 01 00 03 FF",
        "81 01 06 02 01 01 10 00 00 00 00 00 00 00 FF",
        "81 01 04 3F 03 00 FF",
        "81 01 04 3F 02 06 FF",
        "81 01 04 07 28 FF",
        "81 09 06 13 FF",
        "81 55 FF",
        "88 01 06 04 FF",
    ] {
        assert_eq!(Request::decode(d30, &packet(bad)), Err(Fault::Syntax), "{bad}");
    }
}

#[test]
fn packets_are_what_the_protocol_says() {
    for bad in [
        "",
        "81 FF",
        "01 01 FF",
        "81 01 FF FF",
        "FF 01 FF",
        "81 01 06",
        "81 01 02 03 04 05 06 07 08 09 0A 0B 0C 0D 0E 0F FF",
    ] {
        assert!(Packet::from_bytes(&hex(bad)).is_none(), "{bad}");
    }
    let longest = packet("81 01 02 03 04 05 06 07 08 09 0A 0B 0C 0D 0E FF");
    assert_eq!((longest.bytes().len(), longest.body().len()), (16, 14));
    assert_eq!(format!("{:?}", packet("90 41 ff")), "90 41 FF");
    assert_eq!((packet("A0 38 FF").sender(), packet("A0 38 FF").receiver()), (2, 0));
}

#[test]
fn a_stream_is_cut_into_packets_whatever_is_between_them() {
    let stream = hex("12 34 90 FF 90 41 FF FF 90 51 FF 00 90 52 FF 90 50 00 FF");
    let mut framer = Framer::new();
    let packets: Vec<_> = stream.iter().filter_map(|&b| framer.push(b)).collect();
    // "12 34 90 FF", "FF" and "00 90 52 FF" are lost.
    assert_eq!(packets, [packet("90 41 FF"), packet("90 51 FF"), packet("90 50 00 FF")]);
    assert_eq!(framer.garbage(), 9);
    // Two packets that a lost end glued together, and one that is too long.
    let mut framer = Framer::new();
    let long = [&[0x90; 40][..], &[0xff, 0x90, 0x41, 0xff]].concat();
    assert_eq!(long.iter().filter_map(|&b| framer.push(b)).collect::<Vec<_>>(), [packet("90 41 FF")]);
    assert_eq!(framer.garbage(), 41);
    // Half a packet, then silence.
    assert!(framer.push(0x90).is_none());
    framer.restart();
    assert_eq!(hex("90 42 FF").into_iter().filter_map(|b| framer.push(b)).count(), 1);
}

/// Whatever arrives, every byte is in one packet or counted, and nothing panics.
#[test]
fn fuzz_framer() {
    let mut rng = rng();
    let mut framer = Framer::new();
    let (mut fed, mut framed) = (0, 0);
    let mut damaged = Vec::new();
    for _ in 0..fuzz_inputs() {
        if damaged.is_empty() {
            let packet = any_request(&Model::EVI_D70, &mut rng).encode(&Model::EVI_D70, 1);
            damaged = packet.bytes().to_vec();
            match below(&mut rng, 4) {
                0 => damaged[0] = below(&mut rng, 256) as u8,
                1 => drop(damaged.pop()),
                2 => damaged.push(below(&mut rng, 256) as u8),
                _ => (),
            }
            damaged.reverse();
        }
        let byte = damaged.pop().unwrap_or(0);
        fed += 1;
        if let Some(packet) = framer.push(byte) {
            framed += packet.bytes().len() as u64;
            assert_eq!(Packet::from_bytes(packet.bytes()), Some(packet));
        }
        assert!(fed - framed - framer.garbage() < MAX_PACKET as u64);
    }
    assert!(framed > fed / 10 && framer.garbage() > 0);
}

/// What decodes also encodes to something that decodes to the same.
#[test]
fn fuzz_packets() {
    let mut rng = rng();
    let (mut requests, mut replies) = (0, 0);
    for n in 0..fuzz_inputs() {
        let model = Model::ALL[n as usize % Model::ALL.len()];
        let mut bytes = [0; MAX_PACKET];
        rng.fill_bytes(&mut bytes);
        let length = 3 + below(&mut rng, 14) as usize;
        // Half of the inputs begin as real ones do.
        if bytes[15] & 1 == 0 {
            let start: &[u8] =
                [&[0x81, 0x01, 0x04][..], &[0x81, 0x01, 0x06], &[0x81, 0x09], &[0x90], &[0x88], &[0x90, 0x50]]
                    [below(&mut rng, 6) as usize];
            bytes[..start.len()].copy_from_slice(start);
            bytes.iter_mut().skip(3).for_each(|b| *b &= 0x1f);
        }
        bytes[length - 1] = END;
        let Some(packet) = Packet::from_bytes(&bytes[..length]) else { continue };
        if let Ok(request) = Request::decode(model, &packet) {
            requests += 1;
            assert_eq!(Request::decode(model, &request.encode(model, packet.receiver())), Ok(request), "{packet:?}");
        }
        if let Some((from, reply)) = Reply::decode(&packet) {
            replies += 1;
            assert_eq!(Reply::decode(&reply.encode(from)), Some((from, reply)), "{packet:?}");
            if let Reply::Inquiry(payload) = reply {
                for inquiry in [Inquiry::Version, Inquiry::Position, Inquiry::Mode, Inquiry::Register(Register::Zoom)] {
                    if let Some(answer) = Answer::decode(model, inquiry, &payload) {
                        assert_eq!(answer.encode(model, inquiry), Some(payload));
                    }
                }
            }
        }
    }
    assert!(requests > 0 && replies > 0);
}

#[test]
fn fuzz_ip_header() {
    let mut rng = rng();
    let mut decoded = 0;
    for _ in 0..fuzz_inputs() {
        let mut bytes = [0; 40];
        rng.fill_bytes(&mut bytes);
        if bytes[39] & 3 != 0 {
            let kind = ip::Kind::ALL[below(&mut rng, 6) as usize];
            let start = ip::Message { kind, sequence: rng.next_u32(), payload: &[0; 16] }.encode();
            bytes[..8].copy_from_slice(&start[..8]);
            bytes[3] = below(&mut rng, 40) as u8;
        }
        let bytes = &bytes[..below(&mut rng, 41) as usize];
        if let Some(message) = ip::Message::decode(bytes) {
            decoded += 1;
            let again = message.encode();
            assert!(bytes.starts_with(&again) && again.len() <= ip::MAX_MESSAGE);
            let _ = ip::Control::from_payload(message.payload);
            let _ = Packet::from_bytes(message.payload);
        }
    }
    assert!(decoded > 0);
}

#[test]
fn ip_controls_have_their_bytes() {
    let reset = ip::Message { kind: ip::Kind::Control, sequence: 0, payload: ip::Control::Reset.payload() };
    assert_eq!(reset.encode(), hex("02 00 00 01 00 00 00 00 01"));
    for (bytes, control) in [
        ("01", Some(ip::Control::Reset)),
        ("0f 01", Some(ip::Control::BadSequence)),
        ("0f 02", Some(ip::Control::BadMessage)),
        ("0f 03", None),
    ] {
        assert_eq!(ip::Control::from_payload(&hex(bytes)), control);
    }
    assert!(ip::Message::decode(&hex("01 11 00 00 00 00 00 01")).is_none());
    assert!(ip::Message::decode(&hex("01 11 00 04 00 00 00 01 90 41 ff")).is_none());
    assert!(ip::Message::decode(&hex("03 11 00 03 00 00 00 01 90 41 ff")).is_none());
}
