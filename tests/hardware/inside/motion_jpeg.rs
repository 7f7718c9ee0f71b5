//! Motion JPEG from a device that this test feeds (v4l2loopback): whole frames arrive, others do not.

use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ptzcal::Error;
use ptzcal::control::Log;
use ptzcal::device::{Address, Frame, Surroundings, open_frames};
use ptzcal::image::PixelFormat;
use v4l::{Device, Format, FourCC};

const DEVICE: &str = "/dev/video10";
const SIZE: (u32, u32) = (320, 240);

/// A frame of one colour; its red says which.
fn jpeg(red: u8) -> Vec<u8> {
    // Stripes, so that it has some length.
    let pixels: Vec<u8> = (0..SIZE.0 * SIZE.1).flat_map(|i| [red, if i / 7 % 2 == 0 { 40 } else { 90 }, 60]).collect();
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 90)
        .encode(&pixels, SIZE.0, SIZE.1, image::ExtendedColorType::Rgb8)
        .unwrap();
    bytes
}

/// As many cameras send it: without the tables.
fn without_tables(jpeg: &[u8]) -> Vec<u8> {
    let mut out = jpeg[..2].to_vec();
    let mut at = 2;
    while jpeg[at + 1] != 0xda {
        let length = 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
        if jpeg[at + 1] != 0xc4 {
            out.extend_from_slice(&jpeg[at..at + length]);
        }
        at += length;
    }
    out.extend_from_slice(&jpeg[at..]);
    out
}

#[test]
#[ignore = "in the machine"]
fn whole_frames_arrive_and_damaged_ones_do_not() {
    let mut output = Device::with_path(DEVICE).unwrap();
    let format = Format::new(SIZE.0, SIZE.1, FourCC::new(b"MJPG"));
    v4l::video::Output::set_format(&output, &format).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let end = stop.clone();
    let feeder = std::thread::spawn(move || {
        let (good, bare, bad) = (jpeg(200), without_tables(&jpeg(120)), jpeg(30));
        let lost = [&bad[..bad.len() / 3], &bad[bad.len() / 2..]].concat();
        let cut = bad[..bad.len() / 2].to_vec();
        // Not as many as the frames that a call takes, which would then always find the same.
        let frames = [good.clone(), cut, bare.clone(), lost, vec![0; 1000], good, bare];
        for k in (0..).take_while(|_| !end.load(Ordering::SeqCst)) {
            output.write_all(&frames[k % frames.len()]).unwrap();
            std::thread::sleep(Duration::from_millis(30));
        }
    });
    std::thread::sleep(Duration::from_millis(200));
    let log = Log::to(|level, message| println!("log {level:?}: {message}"));
    let surroundings = Surroundings { log, ..Surroundings::default() };
    let open =
        |options: &str| open_frames(&Address::parse(&format!("v4l2://{DEVICE}{options}")).unwrap(), &surroundings);
    // The other end sets the format when it first writes, which a busy machine delays.
    let mut opened = open("?format=MJPEG&size=320x240");
    for _ in 0..50 {
        if opened.is_ok() {
            break;
        }
        std::thread::sleep(Duration::from_millis(200));
        opened = open("?format=MJPEG&size=320x240");
    }
    let mut camera = opened.unwrap();
    let (mut whole, mut bare) = (0, 0);
    let mut last = f64::NEG_INFINITY;
    for _ in 0..20 {
        let mut frame = Frame::empty();
        let asked = surroundings.clock.now();
        camera.next_frame(asked, 5.0, &mut frame).unwrap();
        let view = frame.image.view().unwrap();
        assert_eq!((frame.image.format, view.width(), view.height()), (PixelFormat::Rgb24, SIZE.0, SIZE.1));
        // All of it: its last row too.
        for y in [0, SIZE.1 / 2, SIZE.1 - 1] {
            match view.rgb(160, y)[0] {
                190..=210 => whole += 1,
                110..=130 => bare += 1,
                red => panic!("a frame of red {red}"),
            }
        }
        if !frame.timestamp.is_nan() {
            assert!(frame.timestamp >= asked && frame.timestamp > last);
            last = frame.timestamp;
        }
    }
    println!("of 20 frames {} with and {} without tables, last stamp {last:.3}", whole / 3, bare / 3);
    assert!(whole >= 9 && bare >= 9 && whole + bare == 60, "{whole} {bare}");
    let other = open("?format=MJPEG&size=640x480").map(|_| ()).unwrap_err();
    assert!(matches!(other, Error::DeviceMismatch { .. } | Error::DeviceBusy { .. }), "{other}");
    drop(camera);
    stop.store(true, Ordering::SeqCst);
    feeder.join().unwrap();
}
