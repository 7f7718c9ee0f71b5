use std::fs;
use std::path::Path;

use super::*;
use crate::device::{Frame, FrameSource, Laser, PanTiltZoom, PtzPosition};
use crate::error::Status;
use crate::format::recording_json::{RecordedRegion, RecordingInfo, from_json, shots_from_lines, to_json};
use crate::fuzz::{Random, fuzz_inputs, mutated};
use crate::geometry::rig_model::{AxisOffsets, Encoders, LaserLine};
use crate::geometry::{Distortion, Intrinsics, RigModel};
use crate::image::{Image, PixelFormat};

const SIZE: (u32, u32) = (8, 6);

fn info() -> RecordingInfo {
    RecordingInfo {
        rig: RigModel {
            width: SIZE.0,
            height: SIZE.1,
            intrinsics: Intrinsics { fx: 10.0, fy: 10.0, skew: 0.0, cx: 3.5, cy: 2.5 },
            distortion: Distortion::None,
            laser: LaserLine { x0: 0.1, y0: 0.05, vx: 0.001, vy: -0.002 },
            offsets: AxisOffsets::default(),
            encoders: Encoders::default(),
        },
        pan_range: [-1.7, 1.7],
        tilt_range: [-0.5, 0.5],
        pan_step: 0.001,
        tilt_step: 0.001,
        region: RecordedRegion { pan: [0.0, 0.1], tilt: [0.0, 0.0], pan_steps: 2, tilt_steps: 1 },
        cameras: vec![SIZE, (4, 2)],
    }
}

fn image(format: PixelFormat, (width, height): (u32, u32), value: u8) -> Image {
    let mut image = Image::new(format, width, height);
    image.data.iter_mut().enumerate().for_each(|(i, v)| *v = value.wrapping_add(i as u8));
    image
}

fn at(pan: f64, tilt: f64) -> PtzPosition {
    PtzPosition { pan, tilt, zoom: 0.25 }
}

/// Head: grey frames that begin with `value` (off) and `value` + 100 (on); fixed camera: NV12.
fn add(recorder: &mut Recorder, position: PtzPosition, value: u8) {
    let frames: Vec<[Image; 2]> = [(PixelFormat::Gray8, SIZE), (PixelFormat::Nv12, (4, 2))]
        .map(|(format, size)| [value, value + 100].map(|v| image(format, size, v)))
        .to_vec();
    let views: Vec<_> = frames.iter().map(|[off, on]| (vec![off.view().unwrap()], vec![on.view().unwrap()])).collect();
    recorder.add(position, &views).unwrap();
}

fn recorded(folder: &Path) -> Recorder {
    let mut recorder = Recorder::open(folder, &info()).unwrap();
    add(&mut recorder, at(0.1, 0.0), 10);
    add(&mut recorder, at(0.0, 0.0), 20);
    recorder
}

fn first_byte(recording: &Recording, camera: usize) -> u8 {
    let mut frame = Frame::empty();
    recording.frames(camera).unwrap().next_frame(0.0, 1.0, &mut frame).unwrap();
    frame.image.data[0]
}

#[test]
fn what_is_recorded_comes_back_by_position_and_laser() {
    let folder = tempfile::tempdir().unwrap();
    drop(recorded(folder.path()));
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!(recording.info(), &info());
    let (mut head, mut laser) = (recording.ptz(), recording.laser());
    head.move_absolute(0.1004, -0.0003).unwrap();
    assert_eq!(head.position().unwrap(), at(0.1, 0.0));
    assert_eq!([0, 1].map(|camera| first_byte(&recording, camera)), [10, 10]);
    laser.set(true).unwrap();
    assert_eq!([0, 1].map(|camera| first_byte(&recording, camera)), [110, 110]);
    head.move_absolute(0.0, 0.0).unwrap();
    assert_eq!([0, 1].map(|camera| first_byte(&recording, camera)), [120, 120]);
    // Not recorded: the head goes there, and sees nothing.
    head.move_absolute(0.05, 0.0).unwrap();
    assert_eq!(head.position().unwrap(), at(0.05, 0.0));
    let error = recording.frames(0).unwrap().next_frame(0.0, 1.0, &mut Frame::empty()).unwrap_err();
    assert_eq!(error.status(), Status::NotFound);
    assert!(recording.frames(2).is_err());
}

#[test]
fn frames_come_after_the_moment_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    drop(recorded(folder.path()));
    let recording = Recording::open(folder.path()).unwrap();
    let (clock, mut frames, mut frame) = (recording.clock(), recording.frames(0).unwrap(), Frame::empty());
    clock.sleep(3.0);
    frames.next_frame(2.0, 1.0, &mut frame).unwrap();
    assert_eq!(frame.timestamp, 3.0);
    frames.next_frame(7.0, 1.0, &mut frame).unwrap();
    assert_eq!(frame.timestamp, 7.0);
    assert!(clock.now() > 7.0);
}

#[test]
fn a_recorder_goes_on_and_cuts_what_was_not_finished() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = recorded(folder.path());
    assert_eq!(Recorder::open(folder.path(), &info()).unwrap_err().status(), Status::Busy);
    drop(recorder);
    let lines = folder.path().join(SHOTS);
    let mut text = fs::read(&lines).unwrap();
    text.extend(b"{\"pan\":0.0");
    fs::write(&lines, &text).unwrap();
    assert_eq!(Recording::open(folder.path()).unwrap().shots(), 2);
    let mut recorder = Recorder::open(folder.path(), &info()).unwrap();
    // A position that is measured again replaces the old shot.
    add(&mut recorder, at(0.0, 0.0), 30);
    drop(recorder);
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!((recording.shots(), first_byte(&recording, 0)), (3, 30));
}

#[test]
fn other_folders_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("holiday.jpg"), b"x").unwrap();
    let other = RecordingInfo { pan_step: 0.002, ..info() };
    assert_eq!(Recorder::open(folder.path(), &info()).unwrap_err().status(), Status::FileMismatch);
    assert_eq!(Recording::open(folder.path()).unwrap_err().status(), Status::FileIo);
    let folder = tempfile::tempdir().unwrap();
    drop(Recorder::open(folder.path(), &info()).unwrap());
    assert_eq!(Recorder::open(folder.path(), &other).unwrap_err().status(), Status::FileMismatch);
    assert_eq!(Recording::open(folder.path()).unwrap_err().status(), Status::NotFound);
}

#[test]
fn damage_is_named() {
    let folder = tempfile::tempdir().unwrap();
    drop(recorded(folder.path()));
    let raw = folder.path().join("000001-camera1-on0.nv12");
    fs::write(&raw, [0; 5]).unwrap();
    let recording = Recording::open(folder.path()).unwrap();
    recording.laser().set(true).unwrap();
    let error = recording.frames(1).unwrap().next_frame(0.0, 1.0, &mut Frame::empty()).unwrap_err();
    assert!(matches!(error.status(), Status::FileFormat) && error.to_string().contains("nv12"), "{error}");

    let shot = |off: &str| format!(r#"{{"pan":0,"tilt":0,"cameras":[{{"off":[{off}],"on":["a.png"]}}]}}"#) + "\n";
    let read = |text: &str| shots_from_lines(text.as_bytes(), 1, "shots.jsonl");
    assert_eq!(read(&shot(r#""sub/b.png""#)).unwrap().0.len(), 1);
    let wrong = [
        shot(""),
        shot(r#""../b.png""#),
        shot(r#""/etc/passwd""#),
        shot(r#""a//b.png""#),
        shot(r#""a\\b.png""#),
        "{\"pan\":1e999,\"tilt\":0,\"cameras\":[]}\n".into(),
        "{\"pan\":0,\"tilt\":0,\"cameras\":[]}\n".into(),
        "[\n".into(),
    ];
    for text in wrong {
        let error = read(&text).unwrap_err();
        assert!(error.status() == Status::FileFormat && error.to_string().contains("line 1"), "{text}: {error}");
    }
    let text = to_json(&info()).unwrap();
    for (from, to, part) in [
        ("\"version\": 1", "\"version\": 2", "version"),
        ("ptzcal-recording", "ptzcal-camera", "format"),
        ("\"fx\": 10.0", "\"fx\": 0.0", "f"),
        ("\"pan_step\": 0.001", "\"pan_step\": -1", "step"),
        ("\"image_width\": 4", "\"image_width\": 0", "image"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = from_json(text.replacen(from, to, 1).as_bytes(), "recording.json").unwrap_err();
        assert!(error.to_string().contains(part), "{to}: {error}");
    }
}

/// Damaged texts: read or refused, in bounded memory; what is read is valid.
#[test]
fn fuzz_recordings() {
    let mut random = Random(78);
    let text = to_json(&info()).unwrap();
    let pictures = r#"{"off":["000000-camera0-off0.png"],"on":["sub/on.png","b.nv12"]}"#;
    let line = format!("{{\"pan\":0.25,\"tilt\":-1e-3,\"zoom\":0.5,\"cameras\":[{pictures},{pictures}]}}\n");
    let lines = line.repeat(3);
    for i in 0..fuzz_inputs() {
        if i % 2 == 0 {
            if let Ok(info) = from_json(&mutated(text.as_bytes(), &mut random), "fuzz") {
                info.validate().unwrap();
            }
        } else {
            let bytes = mutated(lines.as_bytes(), &mut random);
            if let Ok((shots, whole)) = shots_from_lines(&bytes, 2, "fuzz") {
                assert!(whole <= bytes.len() && shots.iter().all(|s| s.cameras.len() == 2 && s.pan.is_finite()));
            }
        }
    }
}
