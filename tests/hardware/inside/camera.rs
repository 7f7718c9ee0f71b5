//! The kernel's virtual camera (vivid) through a `v4l2://` address.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ptzcal::control::{Clock, Log, SystemClock};
use ptzcal::device::{Address, Frame, FrameSource, Surroundings, open_frames};
use ptzcal::image::PixelFormat;
use ptzcal::{Error, Result};
use v4l::control::Value;

use super::display::{CAMERA, control, input};

fn surroundings() -> Surroundings {
    let log = Log::to(|level, message| println!("log {level:?}: {message}"));
    Surroundings { clock: Arc::new(SystemClock::default()), log, credentials: None }
}

pub fn open(options: &str) -> Result<(Box<dyn FrameSource>, Arc<dyn Clock>)> {
    let surroundings = surroundings();
    let camera = open_frames(&Address::parse(&format!("v4l2://{CAMERA}{options}"))?, &surroundings)?;
    Ok((camera, surroundings.clock))
}

fn error(options: &str) -> Error {
    open(options).map(|_| ()).unwrap_err()
}

fn next(camera: &mut dyn FrameSource) -> Frame {
    let mut frame = Frame::empty();
    camera.next_frame(f64::NEG_INFINITY, 5.0, &mut frame).unwrap();
    frame
}

#[test]
#[ignore = "in the machine"]
fn formats_sizes_and_rates_are_as_asked() {
    input(0);
    for (format, pixels, size) in [
        ("YUYV", PixelFormat::Yuyv, 640 * 360 * 2),
        ("GREY", PixelFormat::Gray8, 640 * 360),
        ("NV12", PixelFormat::Nv12, 640 * 360 * 3 / 2),
    ] {
        let (mut camera, _) = open(&format!("?size=640x360&format={format}&fps=10&buffers=4")).unwrap();
        let frames: Vec<Frame> = (0..6).map(|_| next(&mut *camera)).collect();
        let mut times = Vec::new();
        for frame in &frames {
            assert_eq!((frame.image.format, frame.image.width, frame.image.height), (pixels, 640, 360));
            assert_eq!(frame.image.data.len(), size);
            times.push(frame.timestamp);
            // Vivid's bars, which are not of one brightness.
            let view = frame.image.view().unwrap();
            assert_ne!(view.rgb(20, 180), view.rgb(300, 180));
        }
        assert!(times.windows(2).all(|t| t[1] > t[0]), "{times:?}");
        // Vivid's first frame is early.
        let rate = 4.0 / (times[5] - times[1]);
        println!("{format}: {rate:.2} frames a second of 10");
        assert!((5.0..10.5).contains(&rate), "{rate}");
    }
    // As it is set, when nothing is asked.
    let (mut camera, _) = open("").unwrap();
    next(&mut *camera);
}

#[test]
#[ignore = "in the machine"]
fn what_is_not_given_is_refused_with_what_is_offered() {
    input(0);
    let size = error("?size=641x361&format=GREY");
    assert!(matches!(size, Error::DeviceMismatch { .. }) && size.to_string().contains("640x360"), "{size}");
    println!("{size}");
    let format = error("?size=640x360&format=MJPEG");
    assert!(matches!(format, Error::DeviceMismatch { .. }) && format.to_string().contains("YUYV"), "{format}");
    let rate = error("?size=640x360&format=GREY&fps=17.3");
    assert!(matches!(rate, Error::DeviceMismatch { .. }) && rate.to_string().contains("offers"), "{rate}");
    println!("{rate}");
    let kind = |path: &str| open_frames(&Address::parse(path).unwrap(), &surroundings()).map(|_| ()).unwrap_err();
    let output = kind("v4l2:///dev/video1");
    assert!(matches!(output, Error::DeviceMismatch { .. }) && output.to_string().contains("no camera"), "{output}");
    assert!(matches!(kind("v4l2:///dev/gpiochip0"), Error::DeviceMismatch { .. }));
    assert!(matches!(kind("v4l2:///dev/video77"), Error::DeviceNotFound { .. }));
    // Another stream.
    let held = open("?size=640x360&format=GREY").unwrap();
    for options in ["", "?size=320x180&format=YUYV"] {
        assert!(matches!(error(options), Error::DeviceBusy { .. }));
    }
    drop(held);
    drop(open("?size=320x180&format=YUYV&fps=10").unwrap());
    // Not root.
    // SAFETY: this thread alone (the system call, not the C library's) changes its user and goes back.
    let denied = unsafe {
        assert_eq!(libc::syscall(libc::SYS_setresuid, -1, 65534, -1), 0);
        let denied = error("");
        assert_eq!(libc::syscall(libc::SYS_setresuid, -1, 0, -1), 0);
        denied
    };
    assert!(matches!(denied, Error::DevicePermission { .. }), "{denied}");
}

#[test]
#[ignore = "in the machine"]
fn frames_from_before_a_moment_are_dropped() {
    input(0);
    let (mut camera, clock) = open("?size=320x180&format=GREY&fps=10").unwrap();
    let mut frame = Frame::empty();
    for _ in 0..3 {
        // The ring fills with old frames meanwhile.
        clock.sleep(1.0);
        let asked = clock.now();
        camera.next_frame(asked, 3.0, &mut frame).unwrap();
        let now = clock.now();
        println!("asked at {asked:.3}, a frame of {:.3} at {now:.3}", frame.timestamp);
        // Vivid stamps frames when they are complete: two frame times are taken off.
        assert!(frame.timestamp >= asked && frame.timestamp < now);
        assert!(now - asked < 0.7);
    }
    // The first one there is, whatever its age.
    clock.sleep(1.0);
    let asked = clock.now();
    camera.next_frame(f64::NEG_INFINITY, 0.0, &mut frame).unwrap();
    assert!(frame.timestamp < asked - 0.3);
    // In time or not at all.
    let start = Instant::now();
    assert!(matches!(camera.next_frame(clock.now() + 100.0, 0.5, &mut frame), Err(Error::DeviceTimeout { .. })));
    assert!((0.45..0.8).contains(&start.elapsed().as_secs_f64()), "{:?}", start.elapsed());
    // Nothing is broken by that.
    camera.next_frame(clock.now(), 2.0, &mut frame).unwrap();
}

#[test]
#[ignore = "in the machine"]
fn damaged_frames_are_dropped_and_a_broken_stream_is_started_again() {
    input(0);
    let (mut camera, _) = open("?size=320x180&format=GREY&fps=10").unwrap();
    next(&mut *camera);
    assert!(control("Inject V4L2_BUF_FLAG_ERROR", Value::None));
    let times: Vec<f64> = (0..5).map(|_| next(&mut *camera).timestamp).collect();
    assert!(times.windows(2).all(|t| t[1] > t[0]), "{times:?}");
    assert!(control("Inject Fatal Streaming Error", Value::None));
    // What was in the ring is lost; the caller sees a pause.
    let start = Instant::now();
    for _ in 0..5 {
        next(&mut *camera);
    }
    println!("five frames after a fatal error: {:?}", start.elapsed());
}

/// Last by name: it comes back, and others should not notice.
#[test]
#[ignore = "in the machine"]
fn unplugging_is_reported_at_once_and_plugging_in_again_is_enough() {
    input(0);
    let (mut camera, clock) = open("?size=320x180&format=GREY&fps=10").unwrap();
    next(&mut *camera);
    assert!(control("Disconnect", Value::None));
    let start = Instant::now();
    let mut frame = Frame::empty();
    let lost = loop {
        match camera.next_frame(clock.now(), 2.0, &mut frame) {
            Ok(()) => {}
            Err(error) => break error,
        }
    };
    println!("unplugged: {lost} after {:?}", start.elapsed());
    assert!(matches!(lost, Error::DeviceLost { .. }) && start.elapsed() < Duration::from_secs(1));
    // Looked for at most once a second.
    let start = Instant::now();
    assert!(matches!(camera.next_frame(clock.now(), 2.0, &mut frame), Err(Error::DeviceLost { .. })));
    assert!(start.elapsed() < Duration::from_millis(100));
    clock.sleep(1.1);
    // Vivid is there again as soon as nobody holds it.
    let asked = clock.now();
    camera.next_frame(asked, 3.0, &mut frame).unwrap();
    assert!(frame.timestamp >= asked && (frame.image.width, frame.image.height) == (320, 180));
}
