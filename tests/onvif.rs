//! ONVIF against cameras on this machine: a correct one of our own (its digest is checked with
//! Python's standard library and `requests`), hostile ones, a package that others wrote (ipycam),
//! and real answers of a real camera.
#![cfg(target_os = "linux")]

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use ptzcal::control::Log;
use ptzcal::device::{
    Address, Credentials, Focus, Frame, Motion, PanTiltZoom, PtzVelocity, Surroundings, open_frames, open_ptz,
};
use ptzcal::error::Status;
use ptzcal::image::PixelFormat;

#[path = "support/data.rs"]
mod data;
#[path = "support/onvif_camera.rs"]
mod onvif_camera;

use onvif_camera::{Camera, HALF, Habits, Lock, PASSWORD, USER, envelope, fault};

type Result<T> = ptzcal::Result<T>;

fn surroundings() -> Surroundings {
    let credentials = Credentials { user: USER.into(), password: PASSWORD.into() };
    Surroundings { credentials: Some(credentials), ..Surroundings::default() }
}

fn open_at(port: u16, more: &str, surroundings: &Surroundings) -> Result<Box<dyn PanTiltZoom>> {
    open_ptz(&Address::parse(&format!("onvif://127.0.0.1:{port}{more}")).unwrap(), surroundings)
}

fn open(camera: &Camera) -> Box<dyn PanTiltZoom> {
    open_at(camera.port, "", &surroundings()).unwrap()
}

fn wait(seconds: f64) {
    std::thread::sleep(Duration::from_secs_f64(seconds));
}

fn degrees(values: [f64; 2]) -> [f64; 2] {
    values.map(f64::to_degrees)
}

#[test]
fn a_correct_camera_does_everything() {
    for lock in [
        Lock::Open,
        Lock::Digest { sha256: false, uses: u32::MAX },
        Lock::Digest { sha256: true, uses: 3 },
        Lock::Digest { sha256: false, uses: 1 },
        Lock::Token,
    ] {
        let camera = Camera::start(Habits { lock, skew: 1e7, ..Habits::default() });
        let mut head = open(&camera);
        let can = head.capabilities();
        assert!(
            !can.raw_units && can.reports_position && can.has_zoom && can.has_drive && can.has_home && can.has_focus
        );
        assert_eq!(degrees(can.pan_range).map(f64::round), [-HALF[0], HALF[0]]);
        assert_eq!(degrees(can.tilt_range).map(f64::round), [-HALF[1], HALF[1]]);
        assert_eq!((degrees(can.max_speed).map(f64::round), can.presets), ([90.0, 45.0], 8));
        let identity = head.identity().unwrap();
        assert_eq!(
            [&*identity.protocol, &*identity.vendor, &*identity.model, &*identity.firmware],
            ["ONVIF", "Acme", "Dome & Co", "1.2"]
        );

        assert_eq!(head.motion().unwrap(), Motion::Unknown, "IDLE proves nothing yet");
        head.move_absolute(0.9, -0.4).unwrap();
        assert_eq!(head.motion().unwrap(), Motion::Moving);
        wait(0.4);
        assert_eq!(head.motion().unwrap(), Motion::Idle);
        let at = head.position().unwrap();
        assert!((at.pan - 0.9).abs() < 1e-6 && (at.tilt + 0.4).abs() < 1e-6, "{at:?}");
        let [pan, tilt, _] = camera.state().position();
        assert!((pan.to_radians() - 0.9).abs() < 1e-6 && (tilt.to_radians() + 0.4).abs() < 1e-6, "right and up");

        head.move_relative(-0.5, 0.2).unwrap();
        head.set_zoom(0.25).unwrap();
        wait(0.4);
        let at = head.position().unwrap();
        assert!((at.pan - 0.4).abs() < 1e-5 && (at.tilt + 0.2).abs() < 1e-5 && (at.zoom - 0.25).abs() < 1e-6, "{at:?}");

        // From half way to the left edge and the lower edge to the centre, in a picture of 60 by 40 degrees.
        assert!(can.has_view_moves);
        head.move_in_view(-0.5, -1.0).unwrap();
        wait(0.4);
        let moved = head.position().unwrap();
        let by = [moved.pan - at.pan, moved.tilt - at.tilt].map(f64::to_degrees);
        assert!((by[0] + 15.0).abs() < 1e-3 && (by[1] + 20.0).abs() < 1e-3, "{by:?}");
        head.move_absolute(at.pan, at.tilt).unwrap();
        wait(0.4);

        for number in [7, 3] {
            head.store_preset(number).unwrap();
        }
        head.home().unwrap();
        wait(0.3);
        assert!(head.position().unwrap().pan.abs() < 1e-6);
        head.recall_preset(3).unwrap();
        wait(0.3);
        assert!((head.position().unwrap().pan - 0.4).abs() < 1e-5);
        head.store_preset(3).unwrap();
        head.clear_preset(7).unwrap();
        assert_eq!(head.recall_preset(7).unwrap_err().status(), Status::DeviceRefused);
        head.clear_preset(3).unwrap();
        assert_eq!(head.clear_preset(3).unwrap_err().status(), Status::DeviceRefused);

        head.set_focus(Focus::At(0.75)).unwrap();
        assert_eq!(camera.state().focus, ("MANUAL".into(), 4.0));
        assert!((head.focus().unwrap() - 0.75).abs() < 1e-6);
        head.set_focus(Focus::Auto).unwrap();
        assert_eq!(camera.state().focus.0, "AUTO");
        assert!(matches!(lock, Lock::Open) == (camera.state().refused == 0));
    }
}

#[test]
fn a_drive_turns_as_fast_as_told_and_ends_by_itself() {
    let camera = Camera::start(Habits::default());
    let mut head = open(&camera);
    let start = Instant::now();
    // 45 degrees per second; the camera wants time-outs of at least a second.
    head.drive(PtzVelocity { pan: 45f64.to_radians(), tilt: 0.0, zoom: 0.0 }, 0.2).unwrap();
    wait(0.5);
    let turned = head.position().unwrap().pan.to_degrees();
    let most = 45.0 * start.elapsed().as_secs_f64() + 1.0;
    assert!(turned > 20.0 && turned < most, "{turned} of {most}");
    wait(1.0);
    let end = head.position().unwrap().pan.to_degrees();
    assert!((end - 45.0).abs() < 2.0, "{end}");
    assert_eq!(head.position().unwrap().pan.to_degrees(), end);
    // 0 of everything is a stop.
    head.drive(PtzVelocity::default(), 1.0).unwrap();
    assert_eq!(camera.state().heard.iter().rev().find(|a| *a != "GetStatus").unwrap(), "Stop");
}

#[test]
fn without_degrees_the_numbers_are_the_cameras_own() {
    let camera = Camera::start(Habits { degrees: false, services: false, ..Habits::default() });
    let mut head = open_at(camera.port, "/?pan_speed=90&tilt_speed=45", &surroundings()).unwrap();
    let can = head.capabilities();
    assert!(can.raw_units && !can.has_focus, "GetCapabilities names no imaging here");
    assert!(!can.has_view_moves && head.move_in_view(0.1, 0.1).unwrap_err().status() == Status::Unsupported);
    assert_eq!((can.pan_range, can.tilt_range), ([-1.0, 1.0], [-1.0, 1.0]));
    head.move_absolute(0.25, -0.5).unwrap();
    wait(0.5);
    let at = head.position().unwrap();
    assert!((at.pan - 0.25).abs() < 1e-6 && (at.tilt + 0.5).abs() < 1e-6, "{at:?}");
    head.move_relative(0.5, 0.5).unwrap();
    wait(0.5);
    let at = head.position().unwrap();
    assert!((at.pan - 0.75).abs() < 1e-6 && at.tilt.abs() < 1e-6, "{at:?}");
    // Half of the full speed that the address names.
    head.drive(PtzVelocity { pan: -45f64.to_radians(), tilt: 9.0, zoom: 0.1 }, 5.0).unwrap();
    let body = camera.state().last.0.clone();
    assert!(body.contains("x=\"-0.500000\" y=\"1.000000\"") && body.contains("PT5S"), "{body}");
    head.stop().unwrap();
    assert_eq!(head.move_absolute(1.01, 0.0).unwrap_err().status(), Status::Unreachable);
}

#[test]
fn the_second_media_service_alone_is_enough() {
    let camera = Camera::start(Habits { media2: true, ..Habits::default() });
    let mut head = open(&camera);
    head.move_absolute(0.1, 0.1).unwrap();
    assert!(camera.state().last.0.contains("<q:ProfileToken>p&lt;1</q:ProfileToken>"));
    let error = open_at(camera.port, "/?profile=nine", &surroundings()).err().unwrap();
    assert!(error.status() == Status::DeviceMismatch && error.to_string().contains("p<1"), "{error}");
    let error = open_at(camera.port, "/?profile=fixed", &surroundings()).err().unwrap();
    assert!(error.status() == Status::DeviceMismatch && error.to_string().contains("no PTZ"), "{error}");
}

#[test]
fn services_under_foreign_names_are_sought_at_the_address() {
    let camera = Camera::start(Habits { calls_itself: Some("192.0.2.7:8080"), ..Habits::default() });
    open(&camera).move_absolute(0.1, 0.1).unwrap();
    assert_eq!(camera.state().heard.last().unwrap(), "AbsoluteMove");
}

#[test]
fn connections_that_close_unsaid_are_opened_again() {
    let camera = Camera::start(Habits { closes: true, ..Habits::default() });
    let mut head = open(&camera);
    for _ in 0..20 {
        head.position().unwrap();
    }
}

#[test]
fn wrong_passwords_are_tried_twice_at_most() {
    for (lock, most) in [(Lock::Digest { sha256: true, uses: 9 }, 3), (Lock::Token, 2), (Lock::Basic, 2)] {
        let camera = Camera::start(Habits { lock, ..Habits::default() });
        for (credentials, tries) in [
            (None, 1),
            (Some(Credentials { user: USER.into(), password: "guess".into() }), most),
            (Some(Credentials { user: "nobody".into(), password: PASSWORD.into() }), most),
        ] {
            camera.state().refused = 0;
            let given = Surroundings { credentials, ..Surroundings::default() };
            let error = open_at(camera.port, "", &given).err().unwrap();
            assert_eq!(error.status(), Status::Unauthorised, "{lock:?}: {error}");
            assert!(camera.state().refused <= tries, "{lock:?}: {}", camera.state().refused);
            assert!(!format!("{error:?}").contains(PASSWORD) && !format!("{error:?}").contains("guess"));
        }
    }
    // The user of the address and that of the credentials must agree.
    let address = |user: &str| Address::parse(&format!("onvif://{user}@127.0.0.1:1/")).unwrap();
    assert_eq!(open_ptz(&address("other"), &surroundings()).err().unwrap().status(), Status::InvalidAddress);
    assert_eq!(open_ptz(&address(USER), &surroundings()).err().unwrap().status(), Status::DeviceNotFound);
    let camera = Camera::start(Habits::default());
    let nameless = Credentials { user: String::new(), password: PASSWORD.into() };
    let given = Surroundings { credentials: Some(nameless), ..Surroundings::default() };
    let address = Address::parse(&format!("onvif://{USER}@127.0.0.1:{}", camera.port)).unwrap();
    open_ptz(&address, &given).unwrap();
}

#[test]
fn the_password_is_never_sent() {
    for lock in [Lock::Digest { sha256: true, uses: 9 }, Lock::Token] {
        let camera = Camera::start(Habits { lock, ..Habits::default() });
        let mut head = open(&camera);
        head.move_absolute(0.1, 0.0).unwrap();
        let (body, authorization) = camera.state().last.clone();
        for secret in [PASSWORD, "s3cret", "czNjcmV0"] {
            assert!(!body.contains(secret) && !authorization.contains(secret));
        }
    }
}

#[test]
fn liars_and_the_lame_are_noticed() {
    let logged = Arc::new(Mutex::new(String::new()));
    let sink = logged.clone();
    let listening = Surroundings { log: Log::to(move |_, text| sink.lock().unwrap().push_str(text)), ..surroundings() };
    // Says IDLE while it moves.
    let camera = Camera::start(Habits { move_status: Some("IDLE"), ..Habits::default() });
    let mut head = open_at(camera.port, "", &listening).unwrap();
    head.move_absolute(1.5, 0.0).unwrap();
    for _ in 0..8 {
        assert_eq!(head.motion().unwrap(), Motion::Unknown);
        wait(0.03);
    }
    assert!(!head.capabilities().reports_motion);
    assert!(logged.lock().unwrap().contains("passed over"));
    // Accepts moves and stays: the position says so.
    let camera = Camera::start(Habits { lame: true, ..Habits::default() });
    let mut head = open(&camera);
    head.move_absolute(1.0, 0.0).unwrap();
    wait(0.3);
    assert_eq!(head.position().unwrap().pan, 0.0);
    // Tells nothing.
    let camera =
        Camera::start(Habits { tells_motion: false, tells_position: false, degrees: false, ..Habits::default() });
    let mut head = open(&camera);
    assert!(!head.capabilities().reports_motion && !head.capabilities().reports_position);
    assert_eq!(head.position().unwrap_err().status(), Status::BadState);
    head.move_absolute(0.5, 0.25).unwrap();
    assert_eq!(head.position().unwrap().pan, 0.5);
    assert_eq!(head.motion().unwrap(), Motion::Unknown);
    head.home().unwrap();
    assert_eq!(head.position().unwrap_err().status(), Status::BadState);
}

#[test]
fn the_brake_does_not_wait_for_a_request_in_flight() {
    let camera = Camera::start(Habits { slow: Some(("GetDeviceInformation", 1.5)), ..Habits::default() });
    let mut head = open(&camera);
    let brake = head.brake().unwrap();
    head.move_absolute(3.0, 0.0).unwrap();
    let busy = std::thread::spawn(move || {
        let start = Instant::now();
        head.identity().unwrap();
        start.elapsed().as_secs_f64()
    });
    wait(0.1);
    let start = Instant::now();
    brake.stop().unwrap();
    let took = start.elapsed().as_secs_f64();
    assert!(took < 0.5, "{took} s");
    let at = camera.state().position();
    wait(0.2);
    assert_eq!(camera.state().position(), at);
    assert!(busy.join().unwrap() > 1.0);
    // Where nobody answers it fails in bounded time.
    let deaf = TcpListener::bind("127.0.0.1:0").unwrap();
    let slow = Camera::start(Habits { slow: Some(("Stop", 30.0)), ..Habits::default() });
    let head = open(&slow);
    let start = Instant::now();
    assert_eq!(head.brake().unwrap().stop().unwrap_err().status(), Status::DeviceTimeout);
    assert!(start.elapsed().as_secs_f64() < 4.0);
    drop(deaf);
}

#[test]
fn faults_come_back_with_the_cameras_words() {
    let long = "x".repeat(100_000);
    let instead = [
        ("AbsoluteMove", fault("PTZInUse", "Somebody else\u{7} steers")),
        ("GotoHomePosition", fault("Y", &long)),
        ("Stop", envelope("<x:StopRespons/>")),
        ("GetPresets", "<html><body>Not here</body></html>".into()),
    ];
    let camera = Camera::start(Habits { instead: instead.into_iter().collect(), ..Habits::default() });
    let mut head = open(&camera);
    let error = head.move_absolute(0.1, 0.1).unwrap_err();
    assert!(
        error.status() == Status::DeviceRefused
            && error.to_string().contains("Somebody else  steers (Sender, PTZInUse)"),
        "{error}"
    );
    let error = head.home().unwrap_err();
    assert!(error.status() == Status::DeviceRefused && error.to_string().len() < 400, "{error}");
    assert_eq!(head.stop().unwrap_err().status(), Status::DeviceMismatch);
    assert_eq!(head.store_preset(0).unwrap_err().status(), Status::DeviceMismatch);
    assert_eq!(head.store_preset(8).unwrap_err().status(), Status::InvalidArgument);
    assert_eq!(head.move_absolute(f64::NAN, 0.1).unwrap_err().status(), Status::NotFinite);
    assert_eq!(head.set_zoom(-0.1).unwrap_err().status(), Status::InvalidArgument);
    assert_eq!(head.set_focus(Focus::At(f64::NAN)).unwrap_err().status(), Status::InvalidArgument);
    let wrong = PtzVelocity { zoom: f64::INFINITY, ..PtzVelocity::default() };
    assert_eq!(head.drive(wrong, 1.0).unwrap_err().status(), Status::NotFinite);
    assert_eq!(head.lock_exposure(true).unwrap_err().status(), Status::Unsupported);
}

#[test]
fn wrong_types_are_no_positions() {
    let status = |x: &str, y: &str| {
        let position = format!(
            "<tt:Position><tt:PanTilt x=\"{x}\" y=\"{y}\" space=\"a/SphericalPositionSpaceDegrees\"/></tt:Position>"
        );
        envelope(&format!("<GetStatusResponse><PTZStatus>{position}</PTZStatus></GetStatusResponse>"))
    };
    let camera = Camera::start(Habits::default());
    let mut head = open(&camera);
    for (x, y) in [
        ("", "0"),
        ("NaN", "0"),
        ("inf", "0"),
        ("0x10", "0"),
        ("1e999", "0"),
        ("0", "1;0"),
        ("5000", "0"),
        ("0", "-1e9"),
    ] {
        camera.state().habits.instead.insert("GetStatus", status(x, y));
        assert_eq!(head.position().unwrap_err().status(), Status::DeviceMismatch, "{x} {y}");
    }
    camera.state().habits.instead.insert("GetStatus", status("-190", "5"));
    assert!((head.position().unwrap().pan.to_degrees() - 170.0).abs() < 1e-9, "the same direction within the range");
    let node = |inner: &str| {
        let space = "<SupportedPTZSpaces><AbsolutePanTiltPositionSpace><URI>x/PositionGenericSpace</URI>";
        let end = "</AbsolutePanTiltPositionSpace></SupportedPTZSpaces>";
        envelope(&format!("<GetNodesResponse><PTZNode token=\"node\">{space}{inner}{end}</PTZNode></GetNodesResponse>"))
    };
    for range in [
        "<XRange><Min>1</Min><Max>1</Max></XRange>",
        "<XRange><Min>a</Min><Max>1</Max></XRange>",
        "<YRange><Max>1</Max></YRange>",
    ] {
        camera.state().habits.instead.insert("GetNodes", node(range));
        assert_eq!(
            open_at(camera.port, "", &surroundings()).err().unwrap().status(),
            Status::DeviceMismatch,
            "{range}"
        );
    }
    camera.state().habits.instead.insert("GetNodes", envelope("<GetNodesResponse/>"));
    assert_eq!(open_at(camera.port, "", &surroundings()).err().unwrap().status(), Status::DeviceMismatch);
}

#[test]
fn addresses_are_checked() {
    let camera = Camera::start(Habits::default());
    for more in ["/?model=x", "/?timeout=0", "/?timeout=1e9", "/?latency=-1", "/a%20b", "/a%0Ab", "/?pan_speed=fast"] {
        let error = Address::parse(&format!("onvif://127.0.0.1:{}{more}", camera.port))
            .and_then(|a| open_ptz(&a, &surroundings()).map(drop))
            .unwrap_err();
        assert_eq!(error.status(), Status::InvalidAddress, "{more}: {error}");
    }
    for (address, status) in [
        ("onvif:///path", Status::InvalidAddress),
        ("onvif://no-such-host.invalid/", Status::DeviceNotFound),
        ("onvif://127.0.0.1:1/", Status::DeviceNotFound),
        ("onvifs://127.0.0.1/", Status::Unsupported),
        ("onvif+https://127.0.0.1/", Status::Unsupported),
    ] {
        let address = Address::parse(address).unwrap();
        assert_eq!(open_ptz(&address, &surroundings()).err().unwrap().status(), status, "{address}");
        assert_eq!(open_frames(&address, &surroundings()).err().unwrap().status(), status, "{address}");
    }
    let error = open_ptz(&Address::parse("onvifs://127.0.0.1/").unwrap(), &surroundings()).err().unwrap();
    assert!(error.to_string().contains("https"), "{error}");
}

/// A JPEG of one grey, without a library that the driver uses for reading.
fn jpeg(width: u32, height: u32, grey: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixels = vec![grey; (width * height) as usize];
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 95);
    encoder.encode(&pixels, width, height, image::ExtendedColorType::L8).unwrap();
    bytes
}

#[test]
fn snapshots_are_asked_for_after_the_moment() {
    for habits in [
        Habits::default(),
        Habits { lock: Lock::Digest { sha256: true, uses: 1 }, media2: true, ..Habits::default() },
        Habits { lock: Lock::Token, services: false, ..Habits::default() },
    ] {
        let camera = Camera::start(habits);
        camera.state().picture = jpeg(64, 48, 99);
        let given = surroundings();
        let address = Address::parse(&format!("onvif://127.0.0.1:{}/?latency=0.2", camera.port)).unwrap();
        let mut frames = open_frames(&address, &given).unwrap();
        assert!(!camera.state().heard.iter().any(|h| h.starts_with("/snap")));
        let mut frame = Frame::empty();
        let moment = given.clock.now() + 0.3;
        frames.next_frame(moment, 3.0, &mut frame).unwrap();
        assert!(given.clock.now() >= moment + 0.2);
        assert_eq!(camera.state().heard.last().unwrap(), "/snap.jpg?a=1&b=2");
        assert!(frame.timestamp.is_nan());
        assert_eq!((frame.image.format, frame.image.width, frame.image.height), (PixelFormat::Gray8, 64, 48));
        assert!(frame.image.data.iter().all(|v| v.abs_diff(99) <= 1));
        frames.next_frame(f64::NAN, 3.0, &mut frame).unwrap();
        // Not before the time is up: no request at all.
        camera.state().heard.clear();
        let start = Instant::now();
        let error = frames.next_frame(given.clock.now() + 60.0, 0.1, &mut frame).unwrap_err();
        assert!(error.status() == Status::DeviceTimeout && start.elapsed().as_secs_f64() < 1.0);
        assert!(camera.state().heard.is_empty());
    }
}

#[test]
fn snapshots_that_are_none_are_refused() {
    let camera = Camera::start(Habits::default());
    let address = Address::parse(&format!("onvif://127.0.0.1:{}", camera.port)).unwrap();
    let mut frames = open_frames(&address, &surroundings()).unwrap();
    let whole = jpeg(640, 480, 50);
    // The size in the start of frame: 65535 x 65535.
    let mut huge = whole.clone();
    let start = huge.windows(2).position(|w| w == [0xFF, 0xC0]).unwrap();
    huge[start + 5..start + 9].fill(0xFF);
    let mut noise = whole.clone();
    noise[30..whole.len() - 30].fill(0xFF);
    for (bytes, part) in [
        (b"".to_vec(), "no JPEG"),
        (b"<html>".to_vec(), "no JPEG"),
        (whole[..whole.len() / 2].to_vec(), "cut off"),
        (huge, ""),
        (noise, ""),
    ] {
        camera.state().picture = bytes;
        let error = frames.next_frame(0.0, 3.0, &mut Frame::empty()).unwrap_err();
        assert!(error.status() == Status::DeviceMismatch && error.to_string().contains(part), "{error}");
    }
    camera.state().habits.lock = Lock::Basic;
    let error = frames.next_frame(0.0, 3.0, &mut Frame::empty()).unwrap_err();
    assert!(error.status() == Status::Unauthorised && error.to_string().contains("Basic"), "{error}");
}

/// Answers every connection by `play`, which is given the stream after the request's head.
fn hostile(play: impl Fn(&mut TcpStream) + Send + Sync + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let play = Arc::new(play);
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            let play = play.clone();
            std::thread::spawn(move || {
                // The whole request, or closing would reset the connection.
                let _ = stream.set_read_timeout(Some(Duration::from_millis(50)));
                while stream.read(&mut [0; 4096]).is_ok_and(|count| count > 0) {}
                play(&mut stream);
            });
        }
    });
    port
}

fn body(text: &str) -> String {
    format!("HTTP/1.1 200 OK\r\nContent-Type: application/soap+xml\r\nContent-Length: {}\r\n\r\n{text}", text.len())
}

#[test]
fn hostile_servers_end_in_bounded_time_with_an_error() {
    use Status::{DeviceLost, DeviceMismatch, DeviceTimeout};
    const HEAD: &[u8] = b"HTTP/1.1 200 OK\r\n";
    type Play = Box<dyn Fn(&mut TcpStream) + Send + Sync>;
    let once = |text: String| -> Play {
        Box::new(move |s| {
            let _ = s.write_all(text.as_bytes());
        })
    };
    let flood = |start: &'static [u8], more: Vec<u8>, pause: f64| -> Play {
        Box::new(move |s| {
            let _ = s.write_all(start);
            while s.write_all(&more).is_ok() {
                wait(pause);
            }
        })
    };
    let bomb = {
        let levels: String =
            (1..12).map(|i| format!("<!ENTITY l{i} \"{}\">", format!("&l{};", i - 1).repeat(10))).collect();
        format!("<!DOCTYPE x [<!ENTITY l0 \"ha\">{levels}]><e:Envelope><e:Body>&l11;</e:Body></e:Envelope>")
    };
    let cases: Vec<(&str, Play, &[Status])> = vec![
        ("silence", Box::new(|_| wait(20.0)), &[DeviceTimeout]),
        ("closed at once", Box::new(|_| {}), &[DeviceLost]),
        ("slow head", flood(HEAD, b"X".to_vec(), 0.05), &[DeviceTimeout]),
        ("slow body", flood(b"HTTP/1.1 200 OK\r\nContent-Length: 1000\r\n\r\n", b"<".to_vec(), 0.05), &[DeviceTimeout]),
        ("endless head", flood(HEAD, b"X: yyyyyyyyyyyyyyyyyyyyyyy\r\n".repeat(100), 0.0), &[DeviceMismatch, DeviceTimeout]),
        ("endless line", flood(HEAD, vec![b'x'; 4096], 0.0), &[DeviceMismatch, DeviceTimeout]),
        ("1xx flood", flood(b"", b"HTTP/1.1 100 Continue\r\n\r\n".repeat(50), 0.0), &[DeviceMismatch, DeviceTimeout]),
        ("102 flood", flood(b"", b"HTTP/1.1 102 Processing\r\n\r\n".repeat(50), 0.001), &[DeviceMismatch, DeviceTimeout]),
        ("oversize", flood(b"HTTP/1.1 200 OK\r\nContent-Length: 99999999999\r\n\r\n", vec![b'a'; 65536], 0.0), &[DeviceMismatch]),
        ("endless body", flood(b"HTTP/1.1 200 OK\r\n\r\n", vec![b'a'; 65536], 0.0), &[DeviceMismatch]),
        (
            "endless chunks",
            flood(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n", b"5\r\n<aaa>\r\n".repeat(5000), 0.0),
            &[DeviceMismatch],
        ),
        (
            "chunked garbage",
            once("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n-5\r\n".into()),
            &[DeviceMismatch, DeviceLost],
        ),
        (
            "chunk of all memory",
            once("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\nabc".into()),
            &[DeviceMismatch, DeviceLost],
        ),
        ("truncated", once("HTTP/1.1 200 OK\r\nContent-Length: 500\r\n\r\n<e:Envelope>".into()), &[DeviceMismatch, DeviceLost]),
        ("truncated XML", once(body("<e:Envelope><e:Body>")), &[DeviceMismatch]),
        ("no HTTP", once("\u{0}\u{1}RTSP/1.0 garbage\r\n\r\n".into()), &[DeviceMismatch, DeviceLost]),
        ("nothing", once(body("")), &[DeviceMismatch]),
        ("a web page", once(body("<!doctype html><html><p>Login")), &[DeviceMismatch]),
        ("entity bomb", once(body(&bomb)), &[DeviceMismatch]),
        ("external entity", once(body("<!DOCTYPE a [<!ENTITY x SYSTEM 'file:///etc/passwd'>]><a>&x;</a>")), &[DeviceMismatch]),
        ("deep", once(body(&"<a>".repeat(300_000))), &[DeviceMismatch]),
        ("other envelope", once(body(&envelope("<x:WrongResponse/>"))), &[DeviceMismatch]),
        ("redirect loop", once("HTTP/1.1 302 Found\r\nLocation: /\r\nContent-Length: 0\r\n\r\n".into()), &[DeviceMismatch]),
        (
            "redirect elsewhere",
            once("HTTP/1.1 307 Moved\r\nLocation: http://127.0.0.2:1/\r\nContent-Length: 0\r\n\r\n".into()),
            &[DeviceMismatch],
        ),
        (
            "endless lock",
            once("HTTP/1.1 401 No\r\nWWW-Authenticate: Digest realm=\"r\", nonce=\"n\", stale=true\r\nContent-Length: 0\r\n\r\n".into()),
            &[Status::Unauthorised, DeviceMismatch],
        ),
    ];
    // At the same time: most of them are waits.
    std::thread::scope(|scope| {
        for (name, play, allowed) in cases {
            let port = hostile(play);
            for frames in [false, true] {
                scope.spawn(move || {
                    let start = Instant::now();
                    let address = Address::parse(&format!("onvif://127.0.0.1:{port}/?timeout=0.6")).unwrap();
                    let error = match frames {
                        false => open_ptz(&address, &surroundings()).err(),
                        true => open_frames(&address, &surroundings()).err(),
                    };
                    let error = error.unwrap_or_else(|| panic!("{name} was accepted"));
                    let took = start.elapsed().as_secs_f64();
                    assert!(allowed.contains(&error.status()), "{name}: {error:?}");
                    assert!(took < 5.0, "{name}: {took} s");
                    assert!(error.to_string().len() < 1000, "{name}: {error}");
                });
            }
        }
    });
}

/// A camera's real answers, through the whole driver.
#[test]
fn real_answers_are_read() {
    let Some(folder) = data::folder("onvif_replies") else { return };
    let real = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let camera = Camera::start(Habits { lock: Lock::Open, degrees: false, ..Habits::default() });
    for (action, name) in
        [("GetNodes", "GetNodes.xml"), ("GetStatus", "GetStatus.xml"), ("AbsoluteMove", "ptz.AbsoluteMove.xml")]
    {
        camera.state().habits.instead.insert(action, real(name));
    }
    camera.state().habits.instead.insert("GotoHomePosition", real("Error.xml"));
    let mut head = open(&camera);
    let can = head.capabilities();
    // Its ranges are 0 to 1, and its pan is outside of them: generic spaces mean little.
    assert!(can.raw_units && can.pan_range == [0.0, 1.0] && can.presets == 256 && can.has_home, "{can:?}");
    let at = head.position().unwrap();
    assert_eq!([at.pan, at.tilt, at.zoom], [-0.864665985, 0.267444015, 0.211861998]);
    head.move_absolute(0.5, 0.5).unwrap();
    let error = head.home().unwrap_err();
    assert!(
        error.status() == Status::DeviceRefused
            && error.to_string().contains("fault reason (fault code, fault subcode"),
        "{error}"
    );
}

struct Served(Child);

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A Python with these packages, in a folder of its own under target/; `None`, with a line that says
/// so, where they are not to be had.
fn python_with(folder: &str, packages: &[&str], check: &str) -> Option<PathBuf> {
    // One test fills the folder, the other waits for it.
    static FILLING: Mutex<()> = Mutex::new(());
    let _alone = FILLING.lock();
    let python = data::target().join(folder).join("bin/python");
    let works = || {
        let run = Command::new(&python).args(["-c", check]).stdout(Stdio::null()).stderr(Stdio::null()).status();
        run.is_ok_and(|s| s.success())
    };
    if !works() {
        let system = std::env::var_os("PYTHON").unwrap_or("python3".into());
        let quiet = |command: &mut Command| {
            command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|s| s.success())
        };
        let made = quiet(Command::new(system).args(["-m", "venv"]).arg(data::target().join(folder)));
        let pip = ["-m", "pip", "install", "--quiet", "--retries", "1", "--timeout", "15"];
        let filled = made && quiet(Command::new(&python).args(pip).args(packages));
        if !filled || !works() {
            let _ = writeln!(std::io::stderr(), "SKIPPED: {} cannot be had", packages.join(", "));
            return None;
        }
    }
    Some(python)
}

/// ipycam 1.3.0's ONVIF service, without its video.
const IPYCAM: &str = r#"
import sys, http.server
from ipycam.config import CameraConfig
from ipycam.http import IPCameraHTTPHandler
from ipycam.onvif import ONVIFService
from ipycam.ptz import PTZController
class Camera: pass
server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), IPCameraHTTPHandler)
port = server.server_address[1]
camera = Camera()
camera.config = CameraConfig(local_ip="127.0.0.1", onvif_port=port, username=sys.argv[1], password=sys.argv[2])
camera.onvif = ONVIFService(camera.config, PTZController())
IPCameraHTTPHandler.camera = camera
print(port, flush=True)
server.serve_forever()
"#;

/// Somebody else's server. Its GetStatus leaves the template of MoveStatus unfilled and uses a prefix
/// that it does not declare; positions are right all the same, and motion is unknown.
#[test]
fn ipycam_is_driven() {
    let check = "import ipycam.onvif, ipycam.ptz, ipycam.http, requests";
    let Some(python) = python_with("onvif-venv", &["ipycam==1.3.0", "requests"], check) else { return };
    // It writes its presets to where it stands.
    let folder = tempfile::tempdir().unwrap();
    let mut child = Command::new(&python)
        .args(["-c", IPYCAM, USER, PASSWORD])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    let out = child.stdout.take().unwrap();
    let _served = Served(child);
    std::io::BufRead::read_line(&mut std::io::BufReader::new(out), &mut line).unwrap();
    let port: u16 = line.trim().parse().unwrap();
    let mut head = open_at(port, "", &surroundings()).unwrap();
    let can = head.capabilities();
    assert!(can.raw_units && can.reports_position && !can.reports_motion && can.presets == 10, "{can:?}");
    assert_eq!(head.motion().unwrap(), Motion::Unknown);
    assert_eq!(head.identity().unwrap().vendor, "PythonCam");
    head.move_absolute(0.5, -0.25).unwrap();
    let arrived = (0..100).any(|_| {
        wait(0.1);
        let at = head.position().unwrap();
        (at.pan - 0.5).abs() < 0.01 && (at.tilt + 0.25).abs() < 0.01
    });
    assert!(arrived, "{:?}", head.position());
    head.store_preset(3).unwrap();
    head.home().unwrap();
    head.recall_preset(3).unwrap();
    head.drive(PtzVelocity { pan: 0.5, ..PtzVelocity::default() }, 2.0).unwrap();
    head.brake().unwrap().stop().unwrap();
    assert_eq!(head.clear_preset(3).unwrap_err().status(), Status::DeviceRefused, "it has no RemovePreset");
    let guess = Credentials { user: USER.into(), password: "guess".into() };
    let given = Surroundings { credentials: Some(guess), ..Surroundings::default() };
    assert_eq!(open_at(port, "", &given).err().unwrap().status(), Status::Unauthorised);
}

/// The camera of these tests is no friend of the driver: others' clients prove themselves to it too.
#[test]
fn the_test_cameras_digest_is_the_one_of_python() {
    let check = "import ipycam.onvif, requests";
    let Some(python) = python_with("onvif-venv", &["ipycam==1.3.0", "requests"], check) else { return };
    for sha256 in [false, true] {
        let camera = Camera::start(Habits { lock: Lock::Digest { sha256, uses: 2 }, ..Habits::default() });
        camera.state().picture = b"picture".to_vec();
        let script = "import sys, requests, requests.auth as a\n\
            s = requests.Session(); s.auth = a.HTTPDigestAuth(sys.argv[2], sys.argv[3])\n\
            print(*[s.get(sys.argv[1]).text for _ in range(4)])\n\
            s.auth = a.HTTPDigestAuth(sys.argv[2], 'guess'); print(s.get(sys.argv[1]).status_code)";
        let url = format!("http://127.0.0.1:{}/snap.jpg?a=1&b=2", camera.port);
        let run = Command::new(&python).args(["-c", script, &url, USER, PASSWORD]).output().unwrap();
        let text = String::from_utf8_lossy(&run.stdout).into_owned();
        assert_eq!(
            text.split_whitespace().collect::<Vec<_>>(),
            ["picture", "picture", "picture", "picture", "401"],
            "{run:?}"
        );
    }
}
