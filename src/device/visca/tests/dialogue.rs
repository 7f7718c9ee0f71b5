//! What is done about a camera that does not behave.

use super::*;
use crate::device::visca::LONGEST_CALL;
use crate::device::{Motion, PanTiltZoom};

#[test]
fn a_lost_acknowledgement_is_followed_by_an_inquiry_and_the_same_move() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    camera.instead(is_move, Instead::Nothing);
    head.move_absolute(0.1, 0.0).unwrap();
    let heard = camera.heard();
    assert_eq!(heard.len(), 3);
    assert!(is_move(&heard[0]) && is_position(&heard[1]) && heard[2] == heard[0]);
}

#[test]
fn a_relative_move_is_never_repeated() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    let is_relative = |r: &Request| matches!(r, Request::MoveBy { .. });
    camera.instead(is_relative, Instead::Nothing);
    assert!(matches!(head.move_relative(0.1, 0.0), Err(Error::DeviceTimeout { what: "camera", .. })));
    assert_eq!(camera.count(is_relative), 1);
}

#[test]
fn a_syntax_error_is_never_tried_again() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    camera.instead(is_move, Instead::Fault(Fault::Syntax));
    assert!(matches!(head.move_absolute(0.1, 0.0), Err(Error::DeviceRefused { .. })));
    assert_eq!(camera.heard().len(), 1);
}

#[test]
fn what_was_understood_before_was_damaged_on_its_way() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    head.position().unwrap();
    camera.instead(is_position, Instead::Fault(Fault::Syntax)).instead(is_position, Instead::Fault(Fault::Length));
    head.position().unwrap();
    for _ in 0..3 {
        camera.instead(is_position, Instead::Fault(Fault::Syntax));
    }
    assert!(matches!(head.position(), Err(Error::DeviceRefused { .. })));
    assert_eq!(camera.count(is_position), 7);
}

#[test]
fn a_busy_camera_is_tried_three_times() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    camera.instead(is_move, Instead::Fault(Fault::BufferFull)).instead(is_move, Instead::Fault(Fault::BufferFull));
    head.move_absolute(0.1, 0.0).unwrap();
    assert_eq!(camera.count(is_move), 3);
    for _ in 0..3 {
        camera.instead(is_move, Instead::Fault(Fault::BufferFull));
    }
    assert!(matches!(head.move_absolute(0.1, 0.0), Err(Error::DeviceRefused { .. })));
    assert_eq!(camera.count(is_move), 6);
}

#[test]
fn what_is_not_executable_is_stopped_first() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    camera.instead(is_move, Instead::Fault(Fault::NotExecutable));
    head.move_absolute(0.1, 0.0).unwrap();
    let heard = camera.heard();
    assert!(is_move(&heard[0]) && is_stop(&heard[1]) && heard[2] == Request::Inquire(Inquiry::Mode));
    assert!(is_move(&heard[3]) && heard.len() == 4);
    camera.instead(is_move, Instead::Fault(Fault::NotExecutable));
    camera.instead(is_move, Instead::Fault(Fault::NotExecutable));
    assert!(matches!(head.move_absolute(0.1, 0.0), Err(Error::DeviceRefused { .. })));
    // What does not move is not stopped for.
    camera.script().heard.clear();
    camera.instead(any, Instead::Fault(Fault::NotExecutable));
    assert!(matches!(head.set_focus(crate::device::Focus::Auto), Err(Error::DeviceRefused { .. })));
    assert_eq!(camera.heard().len(), 1);
}

#[test]
fn three_silences_set_the_camera_up_anew() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    for _ in 0..3 {
        camera.instead(is_position, Instead::Nothing);
    }
    head.position().unwrap();
    let heard = camera.heard();
    let after: Vec<_> = heard.iter().skip_while(|r| is_position(r)).copied().collect();
    assert_eq!(
        after[..5],
        [
            Request::STOP,
            Request::AddressSet,
            Request::ClearAll,
            Request::Inquire(Inquiry::Version),
            Request::Inquire(Inquiry::Position)
        ]
    );
}

#[test]
fn silence_ends_in_time_and_says_what_to_check() {
    for transport in [Transport::Serial, Transport::Stream, Transport::Datagrams, Transport::OverIp] {
        let camera = Camera::new(&Model::EVI_D100, transport);
        let mut head = camera.head();
        for _ in 0..1000 {
            camera.instead(any, Instead::Nothing);
        }
        let start = camera.now();
        let error = head.position().unwrap_err();
        assert!(matches!(error, Error::DeviceTimeout { what: "camera", .. }), "{error}");
        assert!(error.hint().unwrap().contains("baud"));
        assert!(camera.now() - start < LONGEST_CALL);
        let start = camera.now();
        assert!(head.move_absolute(0.1, 0.1).is_err() && camera.now() - start < LONGEST_CALL);
        let start = camera.now();
        let silent = ViscaHead::open(camera.bus(), 1, None, &camera.surroundings());
        assert!(matches!(silent, Err(Error::DeviceTimeout { .. })));
        assert!(camera.now() - start < LONGEST_CALL);
    }
}

#[test]
fn garbage_is_told_from_silence() {
    for (transport, garbled) in [(Transport::Serial, true), (Transport::Stream, false), (Transport::OverIp, false)] {
        let camera = Camera::new(&Model::EVI_D100, transport);
        for _ in 0..1000 {
            camera.instead(any, Instead::Bytes(0.01, b"HTTP/1.0 400 Bad Request".to_vec()));
        }
        let error = ViscaHead::open(camera.bus(), 1, None, &camera.surroundings()).err().unwrap();
        match error {
            Error::DeviceGarbled { .. } => assert!(garbled),
            Error::DeviceMismatch { .. } => assert!(!garbled),
            other => panic!("{other}"),
        }
    }
}

#[test]
fn another_model_than_the_address_says_is_noticed() {
    let camera = serial(&Model::EVI_D100);
    let open = |model| ViscaHead::open(camera.bus(), 1, model, &camera.surroundings());
    let error = open(Some(&Model::EVI_D30)).err().unwrap();
    assert!(matches!(&error, Error::DeviceMismatch { reason, .. } if reason.contains("EVI-D100")), "{error}");
    // Its own, found or given.
    assert_eq!(open(None).unwrap().identity().unwrap().model, "EVI-D100");
    open(Some(&Model::EVI_D100)).unwrap();
    // A number that nobody knows has to be given a model, and is then believed.
    camera.script().ids = vec![0x7777];
    let error = open(None).err().unwrap();
    assert!(
        matches!(&error, Error::DeviceMismatch { reason, .. } if reason.contains("7777") && reason.contains("evi-d70"))
    );
    open(Some(&Model::EVI_D100)).unwrap();
    camera.script().knows_version = false;
    assert!(matches!(open(None), Err(Error::DeviceMismatch { .. })));
    open(Some(&Model::EVI_D100)).unwrap();
    // Positions in another form.
    camera.script().model = &Model::BRC_300;
    let mut head = open(Some(&Model::EVI_D100)).unwrap();
    let error = head.position().unwrap_err();
    assert!(matches!(error, Error::DeviceMismatch { .. }), "{error}");
}

#[test]
fn replies_that_are_not_for_us_change_nothing() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    head.move_absolute(0.3, 0.1).unwrap();
    camera.pass(2.0);
    // Of another camera; an echo of our own; an answer of another form; half a packet.
    for stray in ["A0 50 00 00 00 00 00 00 00 00 FF", "81 09 06 12 FF", "90 50 02 FF", "90 41 90 51 FF", "A0 61 41 FF"]
    {
        camera.instead(is_position, Instead::Before(hex(stray)));
        let at = head.position().unwrap();
        assert!((at.pan - 0.3).abs() < 0.01, "{stray}");
    }
    // An answer that came too late for its question is not the next one's.
    let stale = Answer::Position { pan: 99, tilt: 9 }.encode(&Model::EVI_D100, Inquiry::Position).unwrap();
    camera.say(Reply::Inquiry(stale).encode(1).bytes());
    assert!((head.position().unwrap().pan - 0.3).abs() < 0.01);
}

#[test]
fn completions_come_in_any_order_and_belong_to_their_sockets() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    camera.script().tells_completion = false;
    head.move_absolute(0.3, 0.0).unwrap();
    let of_move = camera.script().sockets;
    head.set_zoom(0.5).unwrap();
    let of_zoom = camera.script().sockets;
    assert_ne!(of_move, of_zoom);
    camera.pass(MOVE);
    // The head stands, but neither has been told to be over.
    assert_eq!(head.motion().unwrap(), Motion::Moving);
    camera.say(Reply::Completion { socket: of_zoom }.encode(1).bytes());
    assert_eq!(head.motion().unwrap(), Motion::Moving);
    // In the middle of an answer to another inquiry.
    camera.instead(is_position, Instead::Before(Reply::Completion { socket: of_move }.encode(1).bytes().to_vec()));
    head.position().unwrap();
    assert_eq!(head.motion().unwrap(), Motion::Idle);
}

#[test]
fn a_completion_without_acknowledgement_is_both() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    camera.instead(is_move, Instead::Before(hex("90 51 FF")));
    head.move_absolute(0.1, 0.0).unwrap();
    assert_eq!(camera.count(is_move), 1);
    // It says that it is there, and is not: the head is still looked at.
    assert_eq!(head.motion().unwrap(), Motion::Moving);
    camera.pass(2.0 * MOVE);
    assert_eq!(head.motion().unwrap(), Motion::Idle);
}

#[test]
fn a_lost_completion_ends_by_what_the_head_does() {
    for reports_mode in [true, false] {
        let camera = serial(if reports_mode { &Model::EVI_D100 } else { &Model::PTZOPTICS });
        let mut head = camera.head();
        camera.script().tells_completion = false;
        for (jammed, expected) in [(false, Motion::Idle), (true, Motion::Failed)] {
            head.move_absolute(if jammed { -0.2 } else { 0.3 }, 0.0).unwrap();
            if jammed {
                camera.script().moving = None;
            }
            let start = camera.now();
            let end = loop {
                match head.motion().unwrap() {
                    Motion::Moving => camera.pass(0.05),
                    other => break other,
                }
            };
            assert_eq!(end, expected);
            assert!(camera.now() - start < 3.0);
        }
    }
}

fn brake_at(camera: &Camera, brake: Arc<dyn crate::device::Brake>, matching: Matching) {
    let mut once = Some(brake);
    camera.script().on_request = Some(Box::new(move |request| {
        if let Some(brake) = once.take_if(|_| matching(request)) {
            brake.stop().unwrap();
        }
    }));
}

#[test]
fn a_stop_before_the_move_is_sent_prevents_it() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    // Between the question where the head is and the move from there.
    brake_at(&camera, head.brake().unwrap(), is_position);
    assert_eq!(head.move_relative(0.1, 0.0), Err(Error::Cancelled));
    assert_eq!(camera.count(|r| matches!(r, Request::MoveBy { .. })), 0);
    head.move_relative(0.1, 0.0).unwrap();
}

#[test]
fn a_stop_from_elsewhere_wins_over_a_move_that_is_being_sent() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    let brake = head.brake().unwrap();
    // While the driver waits for the acknowledgement, which never comes.
    camera.instead(is_move, Instead::Nothing);
    brake_at(&camera, brake, is_move);
    assert_eq!(head.move_absolute(0.5, 0.0), Err(Error::Cancelled));
    assert_eq!(camera.count(is_move), 1, "it is not repeated");
    assert!(is_stop(&camera.heard().into_iter().rfind(|r| is_move(r) || is_stop(r)).unwrap()));
    assert_eq!(head.motion().unwrap(), Motion::Idle);
    head.move_absolute(0.5, 0.0).unwrap();
}

#[test]
fn a_brake_does_not_wait_for_the_driver() {
    let camera = serial(&Model::EVI_D100);
    let head = camera.head();
    let brake = head.brake().unwrap();
    let bus = camera.bus();
    // Somebody holds the line and does not let go.
    let surroundings = camera.surroundings();
    let turn = bus.turn(&*surroundings.clock).unwrap();
    std::thread::scope(|scope| scope.spawn(|| brake.stop().unwrap()).join().unwrap());
    drop(turn);
    assert!(camera.count(is_stop) >= 1);
}

/// Whatever a camera says, every call ends in its time and nothing panics.
#[test]
fn fuzz_dialogue() {
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let transports = [Transport::Serial, Transport::Stream, Transport::Datagrams, Transport::OverIp];
    let mut head = None;
    let mut camera = serial(&Model::EVI_D100);
    // An input is one call with several damaged replies.
    for n in 0..crate::fuzz::fuzz_inputs() / 20 {
        if n % 50 == 0 {
            head = None;
            let model = Model::ALL[(n / 50) as usize % Model::ALL.len()];
            camera = Camera::new(model, transports[(n / 50) as usize % transports.len()]);
        }
        let head = head.get_or_insert_with(|| camera.head());
        camera.script().instead.clear();
        for _ in 0..rng.next_u32() % 6 {
            let kind = rng.next_u32() % 8;
            let mut bytes = vec![0; 1 + rng.next_u32() as usize % 20];
            rng.fill_bytes(&mut bytes);
            if kind < 4 {
                let socket = (rng.next_u32() % 4) as u8;
                let replies = [
                    Reply::Ack { socket },
                    Reply::Completion { socket },
                    Reply::Error {
                        socket,
                        fault: [Fault::Syntax, Fault::BufferFull, Fault::NotExecutable, Fault::Cancelled]
                            [socket as usize],
                    },
                    Reply::NetworkChange,
                ];
                let reply = replies[rng.next_u32() as usize % 4].encode(1 + (rng.next_u32() % 8 / 7) as u8);
                bytes = reply.bytes().to_vec();
                if camera.script().transport == Transport::OverIp {
                    bytes = Message { kind: Kind::Reply, sequence: rng.next_u32() % 8, payload: &bytes }.encode();
                }
            }
            let what = match kind {
                0 => Instead::Nothing,
                1..4 => Instead::Before(bytes),
                4 => Instead::Silently,
                _ => Instead::Bytes(f64::from(rng.next_u32() % 500) * 1e-3, bytes),
            };
            camera.instead(any, what);
        }
        let start = camera.now();
        let _ = match rng.next_u32() % 8 {
            0 => head.move_absolute(0.1, -0.1),
            1 => head.move_relative(0.01, 0.0),
            2 => head.position().map(drop),
            3 => head.motion().map(drop),
            4 => head.set_zoom(0.3),
            5 => head.stop(),
            6 => head.lock_exposure(n % 2 == 0),
            _ => head.home(),
        };
        // A lock is some twenty requests.
        assert!(camera.now() - start < 25.0 * LONGEST_CALL);
    }
}
