//! Chains, unplugged lines, numbered datagrams, real descriptors.

use std::io::{Read, Write};

use serialport::{SerialPort, TTYPort};

use super::*;
use crate::device::{Address, Motion, PanTiltZoom, open_ptz};

#[test]
fn a_chain_is_set_up_once_and_shared() {
    let camera = serial(&Model::EVI_D100);
    camera.script().ids = vec![0x040d; 3];
    let bus = camera.bus();
    let open = |address| ViscaHead::open(bus.clone(), address, None, &camera.surroundings());
    let (mut one, mut three) = (open(1).unwrap(), open(3).unwrap());
    assert_eq!(camera.count(|r| *r == Request::AddressSet), 1);
    assert_eq!(camera.count(|r| *r == Request::ClearAll), 1);
    assert!(matches!(open(3), Err(Error::DeviceBusy { .. })));
    let error = open(5).err().unwrap();
    assert!(matches!(&error, Error::DeviceNotFound { reason, .. } if reason.contains('3')), "{error}");
    // What comes for the other head is kept for it.
    camera.script().heard.clear();
    one.move_absolute(0.1, 0.0).unwrap();
    let socket = camera.script().sockets;
    camera.script().coming.clear();
    camera.pass(MOVE);
    camera.say(Reply::Completion { socket }.encode(1).bytes());
    three.position().unwrap();
    assert_eq!(one.motion().unwrap(), Motion::Idle);
    assert!(camera.script().heard.iter().any(|(address, request)| *address == 3 && is_position(request)));
    // An address is free again after its head.
    drop(three);
    open(3).unwrap();
}

#[test]
fn a_changed_chain_is_set_up_before_the_next_request() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    camera.script().tells_completion = false;
    head.move_absolute(0.2, 0.0).unwrap();
    camera.script().heard.clear();
    camera.say(&hex("90 38 FF"));
    assert_eq!(head.motion().unwrap(), Motion::Moving);
    let start = camera.now();
    let end = loop {
        match head.motion().unwrap() {
            Motion::Moving => camera.pass(0.05),
            other => break other,
        }
    };
    // Its completion was forgotten with the rest; the head arrives all the same.
    assert_eq!(end, Motion::Idle);
    assert!(camera.now() - start < 3.0);
    assert_eq!(camera.count(|r| *r == Request::AddressSet), 1);
    assert_eq!(camera.count(|r| *r == Request::ClearAll), 1);
    assert_eq!(camera.count(|r| *r == Request::Inquire(Inquiry::Version)), 1);
}

#[test]
fn an_unplugged_line_comes_back_by_itself() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    camera.script().plugged = false;
    assert!(matches!(head.position(), Err(Error::DeviceLost { .. })));
    assert!(matches!(head.stop(), Err(Error::DeviceLost { .. })));
    let openings = camera.script().openings;
    // Not tried again at once, and then once a second.
    for _ in 0..100 {
        assert!(matches!(head.position(), Err(Error::DeviceLost { .. })));
        camera.pass(0.025);
    }
    let tried = camera.script().openings - openings;
    assert!((1..=3).contains(&tried), "{tried}");
    camera.script().plugged = true;
    camera.pass(1.0);
    camera.script().heard.clear();
    head.move_absolute(0.1, 0.0).unwrap();
    assert_eq!(camera.heard()[..3], [Request::AddressSet, Request::ClearAll, Request::Inquire(Inquiry::Version)]);
    assert!(is_move(camera.heard().last().unwrap()));
    head.brake().unwrap().stop().unwrap();
    // Another camera in its place.
    camera.script().plugged = false;
    assert!(head.position().is_err());
    camera.script().plugged = true;
    camera.script().ids = vec![0x0402];
    camera.pass(2.0);
    assert!(matches!(head.position(), Err(Error::DeviceMismatch { .. })));
    assert!(matches!(head.position(), Err(Error::DeviceMismatch { .. })));
}

fn numbers(camera: &Camera) -> Vec<u32> {
    camera.script().messages.iter().map(|m| Message::decode(m).unwrap().sequence).collect()
}

#[test]
fn datagrams_are_sent_again_with_the_same_number() {
    let camera = Camera::new(&Model::EVI_D100, Transport::OverIp);
    let mut head = camera.head();
    // Lost on the way there.
    camera.instead(is_move, Instead::Nothing).instead(is_move, Instead::Nothing);
    head.move_absolute(0.1, 0.0).unwrap();
    let sent = numbers(&camera);
    assert_eq!(sent.len(), 3);
    assert!(sent.iter().all(|n| *n == sent[0]));
    // Lost on the way back: it says that it has had this number, and the move is not done twice.
    camera.script().messages.clear();
    camera.instead(is_move, Instead::Silently);
    head.move_absolute(0.2, 0.0).unwrap();
    assert_eq!(numbers(&camera).len(), 2);
    camera.pass(MOVE);
    // Nobody tells its end.
    let end = loop {
        match head.motion().unwrap() {
            Motion::Moving => camera.pass(0.1),
            other => break other,
        }
    };
    assert_eq!(end, Motion::Idle);
    // An inquiry whose answer was lost is asked anew, under a new number.
    camera.script().messages.clear();
    camera.instead(is_position, Instead::Silently);
    assert!((head.position().unwrap().pan - 0.2).abs() < 0.01);
    let sent = numbers(&camera);
    assert!(sent[0] == sent[1] && sent[2] == sent[0] + 1, "{sent:?}");
}

#[test]
fn numbers_that_are_out_of_step_are_reset() {
    let camera = Camera::new(&Model::EVI_D100, Transport::OverIp);
    let mut head = camera.head();
    camera.script().last_number = Some(1_000_000);
    head.position().unwrap();
    let resets = camera.script().messages.iter().filter(|m| Message::decode(m).unwrap().kind == Kind::Control).count();
    assert_eq!(resets, 1);
    // An answer with another number is not ours.
    let stale = Answer::Position { pan: 99, tilt: 9 }.encode(&Model::EVI_D100, Inquiry::Position).unwrap();
    let packet = Reply::Inquiry(stale).encode(1);
    let old = Message { kind: Kind::Reply, sequence: 77_777, payload: packet.bytes() }.encode();
    camera.instead(is_position, Instead::Before(old));
    assert_eq!(head.position().unwrap().pan, 0.0);
}

/// Cameras on a pseudo-terminal, answered by a thread.
fn serve(mut far: TTYPort, ids: &[u16]) -> std::thread::JoinHandle<()> {
    let camera = serial(&Model::EVI_D100);
    camera.script().ids = ids.to_vec();
    far.set_timeout(std::time::Duration::from_millis(500)).unwrap();
    std::thread::spawn(move || {
        let mut buffer = [0; 64];
        // A hang-up or silence ends it.
        while let Ok(count) = far.read(&mut buffer) {
            let mut script = camera.script();
            script.take(&buffer[..count]);
            for (_, bytes) in script.coming.drain(..) {
                far.write_all(&bytes).unwrap();
            }
        }
    })
}

#[test]
fn addresses_open_heads_on_real_lines() {
    let (far, near) = TTYPort::pair().unwrap();
    let path = near.name().unwrap();
    // Another name of the same line.
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("by-id");
    std::os::unix::fs::symlink(&path, &link).unwrap();
    let server = serve(far, &[0x040d, 0x040d]);
    let surroundings = Surroundings::default();
    let open = |text: &str| open_ptz(&Address::parse(text).unwrap(), &surroundings);
    let mut one = open(&format!("visca://{path}")).unwrap();
    let mut two = open(&format!("visca://{}?address=2&model=evi-d100", link.display())).unwrap();
    assert_eq!(one.identity().unwrap().model, "EVI-D100");
    one.move_absolute(0.1, 0.05).unwrap();
    two.position().unwrap();
    assert!(matches!(open(&format!("visca://{path}?address=2")), Err(Error::DeviceBusy { .. })));
    let error = open(&format!("visca://{path}?address=3&baud=38400")).err().unwrap();
    assert!(matches!(error, Error::InvalidAddress { .. }), "{error}");
    drop((one, two));
    // All heads gone, the line is free.
    crate::device::serial::open(&path, 9600).unwrap();
    // The last to hang up.
    drop(near);
    server.join().unwrap();
}

#[test]
fn wrong_addresses_say_what_is_wrong() {
    let surroundings = Surroundings::default();
    for (text, part) in [
        ("visca:///dev/ttyS0?model=vcr", "evi-d100"),
        ("visca:///dev/ttyS0?address=8", "1 to 7"),
        ("visca:///dev/ttyS0?baud=1", "baud"),
        ("visca:///dev/ttyS0?speed=1", "speed"),
        ("visca://host/dev/ttyS0", "three slashes"),
        ("visca+udp:///dev/ttyS0", "host"),
        ("visca+udp://host/path", "path"),
        ("visca+tcp://host?baud=9600", "baud"),
    ] {
        let error = open_ptz(&Address::parse(text).unwrap(), &surroundings).err().unwrap();
        assert!(matches!(error, Error::InvalidAddress { .. }) && error.to_string().contains(part), "{text}: {error}");
    }
    let none = Address::parse("visca:///dev/serial/by-id/none").unwrap();
    assert!(matches!(open_ptz(&none, &surroundings), Err(Error::DeviceNotFound { .. })));
    let closed = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let closed = Address::parse(&format!("visca+tcp://127.0.0.1:{closed}")).unwrap();
    assert!(matches!(open_ptz(&closed, &surroundings), Err(Error::DeviceNotFound { .. })));
}
