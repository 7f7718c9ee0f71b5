//! What the head does with a camera that behaves.

use super::*;
use crate::device::visca::codec::Zooming;
use crate::device::{Focus, Motion, PanTiltZoom, PtzVelocity};

/// Calls `motion` as a workflow does, until it is over.
fn wait(camera: &Camera, head: &mut ViscaHead) -> Motion {
    for _ in 0..200 {
        match head.motion().unwrap() {
            Motion::Moving => camera.pass(0.05),
            other => return other,
        }
    }
    panic!("the move has no end");
}

#[test]
fn every_model_goes_where_it_is_told() {
    for model in Model::ALL {
        let camera = serial(model);
        let mut head = camera.head();
        let identity = head.identity().unwrap();
        assert_eq!((identity.protocol.as_str(), identity.model.as_str()), ("VISCA", model.title));
        assert_eq!(identity.firmware, "0102");
        let c = head.capabilities();
        for share in [0.0, 0.1, 0.5, 0.77, 1.0] {
            let pan = c.pan_range[0] + share * (c.pan_range[1] - c.pan_range[0]);
            let tilt = c.tilt_range[1] - share * (c.tilt_range[1] - c.tilt_range[0]);
            head.move_absolute(pan, tilt).unwrap();
            assert_eq!(head.motion().unwrap(), Motion::Moving);
            assert_eq!(wait(&camera, &mut head), Motion::Idle, "{}", model.name);
            let at = head.position().unwrap();
            assert!((at.pan - pan).abs() <= 0.51 * c.pan_step && (at.tilt - tilt).abs() <= 0.51 * c.tilt_step);
        }
    }
}

#[test]
fn right_and_up_are_the_devices_right_and_up() {
    // BRC-300: positive pan is left, five nibbles.
    let camera = serial(&Model::BRC_300);
    let mut head = camera.head();
    head.move_absolute(170f64.to_radians(), -0.1).unwrap();
    let Some(Request::MoveTo { pan, tilt, speed }) = camera.heard().into_iter().find(is_move) else { panic!() };
    assert!((pan + 0x8a58).abs() <= 1 && tilt < 0 && speed == [0x18; 2]);
    head.drive(PtzVelocity { pan: 0.5, tilt: -0.5, zoom: 0.0 }, f64::INFINITY).unwrap();
    let Some(Request::Drive { pan, tilt }) = camera.heard().pop() else { panic!() };
    assert!(pan > 0 && tilt < 0);
}

#[test]
fn what_is_out_of_reach_is_refused_and_nothing_is_sent() {
    for model in Model::ALL {
        let camera = serial(model);
        let mut head = camera.head();
        let c = head.capabilities();
        let beyond = 3.0 * c.pan_step;
        for (pan, tilt) in [
            (c.pan_range[1] + beyond, 0.0),
            (c.pan_range[0] - beyond, 0.0),
            (0.0, c.tilt_range[1] + beyond),
            (0.0, c.tilt_range[0] - beyond),
            (1e300, 0.0),
        ] {
            assert!(matches!(head.move_absolute(pan, tilt), Err(Error::Unreachable { .. })));
        }
        for bad in [f64::NAN, f64::INFINITY] {
            assert!(matches!(head.move_absolute(bad, 0.0), Err(Error::InvalidArgument { name: "pan", .. })));
            assert!(matches!(head.move_relative(0.0, bad), Err(Error::InvalidArgument { name: "tilt", .. })));
            assert!(matches!(head.set_zoom(bad), Err(Error::InvalidArgument { name: "zoom", .. })));
        }
        let nan = PtzVelocity { pan: f64::NAN, ..PtzVelocity::default() };
        assert!(matches!(head.drive(nan, 1.0), Err(Error::InvalidArgument { name: "pan", .. })));
        let nan = PtzVelocity { zoom: f64::NAN, ..PtzVelocity::default() };
        assert!(matches!(head.drive(nan, 1.0), Err(Error::InvalidArgument { name: "zoom", .. })));
        assert!(matches!(head.set_zoom(1.01), Err(Error::Unreachable { .. })));
        assert!(matches!(head.recall_preset(model.presets), Err(Error::InvalidArgument { name: "preset", .. })));
        assert!(matches!(head.store_preset(u32::MAX), Err(Error::InvalidArgument { name: "preset", .. })));
        assert_eq!(camera.heard(), []);
        // A relative move knows where it would end.
        head.move_absolute(c.pan_range[1], 0.0).unwrap();
        assert_eq!(wait(&camera, &mut head), Motion::Idle);
        assert!(matches!(head.move_relative(beyond, 0.0), Err(Error::Unreachable { .. })));
        head.move_relative(-0.1, 0.05).unwrap();
        assert_eq!(wait(&camera, &mut head), Motion::Idle);
        let at = head.position().unwrap();
        assert!((at.pan - c.pan_range[1] + 0.1).abs() < 2.0 * c.pan_step);
        assert!((at.tilt - 0.05).abs() < 2.0 * c.tilt_step);
    }
}

#[test]
fn drive_is_by_speed_and_stop_stops_all() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    let speed = |degrees: f64| degrees.to_radians();
    head.drive(PtzVelocity { pan: speed(-300.0), tilt: speed(9.0), zoom: 0.5 }, 1.0).unwrap();
    assert_eq!(camera.heard(), [Request::Drive { pan: -0x18, tilt: 0x08 }, Request::Zoom(Zooming::Tele(Some(4)))]);
    assert_eq!(head.motion().unwrap(), Motion::Moving);
    camera.script().heard.clear();
    head.drive(PtzVelocity { pan: 1e9, tilt: 0.0, zoom: 0.0 }, f64::INFINITY).unwrap();
    assert_eq!(camera.heard(), [Request::Drive { pan: 0x18, tilt: 0 }, Request::Zoom(Zooming::Stop)]);
    camera.script().heard.clear();
    let before = camera.now();
    head.stop().unwrap();
    assert_eq!(camera.now(), before, "stop waits for nothing");
    let stop = [Request::STOP, Request::Zoom(Zooming::Stop)];
    let cancel = [Request::Cancel(1), Request::Cancel(2)];
    assert_eq!(camera.heard(), [&stop[..], &cancel, &stop].concat());
    // Its replies are taken for no one else's.
    assert_eq!(head.position().unwrap().pan, 0.0);
    assert_eq!(head.motion().unwrap(), Motion::Idle);
    head.move_absolute(0.2, 0.0).unwrap();
    assert_eq!(wait(&camera, &mut head), Motion::Idle);
}

#[test]
fn zoom_and_focus_are_shares_of_the_scale() {
    let camera = serial(&Model::EVI_D30);
    let mut head = camera.head();
    head.set_zoom(1.0).unwrap();
    assert_eq!(camera.heard(), [Request::Set(Register::Zoom, 0x3ff)]);
    assert_eq!(wait(&camera, &mut head), Motion::Idle);
    assert_eq!(head.position().unwrap().zoom, 1.0);
    camera.script().heard.clear();
    head.set_focus(Focus::At(0.5)).unwrap();
    assert_eq!(camera.heard(), [Request::Set(Register::FocusMode, 3), Request::Set(Register::Focus, 0x5800)]);
    assert!((head.focus().unwrap() - 0.5).abs() < 1e-4);
    camera.script().heard.clear();
    head.set_focus(Focus::Auto).unwrap();
    head.set_focus(Focus::Manual).unwrap();
    assert_eq!(camera.heard(), [Request::Set(Register::FocusMode, 2), Request::Set(Register::FocusMode, 3)]);
    assert!(matches!(head.set_focus(Focus::At(-0.1)), Err(Error::Unreachable { .. })));
    assert!(matches!(head.set_focus(Focus::At(f64::NAN)), Err(Error::InvalidArgument { .. })));
    // Where the scale is not documented there is none.
    let mut head = serial(&Model::PTZOPTICS).head();
    assert!(matches!(head.focus(), Err(Error::Unsupported { .. })));
    assert!(matches!(head.set_focus(Focus::At(0.5)), Err(Error::Unsupported { .. })));
    head.set_focus(Focus::Auto).unwrap();
}

fn modes(camera: &Camera) -> [u16; 4] {
    let script = camera.script();
    [Register::ExposureMode, Register::WhiteBalance, Register::Shutter, Register::RedGain]
        .map(|register| script.registers.iter().find(|r| r.0 == register).unwrap().1)
}

fn set_registers(camera: &Camera) {
    let values = [(Register::ExposureMode, 0x0d), (Register::WhiteBalance, 1), (Register::Shutter, 9)];
    for (register, value) in values.into_iter().chain([(Register::RedGain, 0x80)]) {
        camera.script().registers.iter_mut().find(|r| r.0 == register).unwrap().1 = value;
    }
}

#[test]
fn exposure_is_held_as_it_is_and_given_back_as_it_was() {
    let camera = serial(&Model::EVI_D70);
    set_registers(&camera);
    let mut head = camera.head();
    head.lock_exposure(false).unwrap();
    assert_eq!(camera.heard(), []);
    head.lock_exposure(true).unwrap();
    assert_eq!(modes(&camera), [3, 5, 9, 0x80]);
    assert!(camera.heard().contains(&Request::Set(Register::Shutter, 9)));
    camera.script().heard.clear();
    head.lock_exposure(true).unwrap();
    assert_eq!(camera.heard(), [], "it is locked");
    head.lock_exposure(false).unwrap();
    assert_eq!(modes(&camera)[..2], [0x0d, 1]);
}

#[test]
fn a_lock_that_fails_halfway_is_undone() {
    let camera = serial(&Model::EVI_D70);
    set_registers(&camera);
    let mut head = camera.head();
    for _ in 0..4 {
        camera.instead(|r| matches!(r, Request::Set(Register::WhiteBalance, 5)), Instead::Fault(Fault::BufferFull));
    }
    assert!(matches!(head.lock_exposure(true), Err(Error::DeviceRefused { .. })));
    assert_eq!(modes(&camera)[..2], [0x0d, 1]);
}

#[test]
fn a_camera_without_manual_white_balance_measures_once() {
    let camera = serial(&Model::EVI_D30);
    set_registers(&camera);
    let mut head = camera.head();
    // And one that does not know its gain.
    camera.instead(|r| *r == Request::Inquire(Inquiry::Register(Register::Gain)), Instead::Fault(Fault::Syntax));
    head.lock_exposure(true).unwrap();
    assert_eq!(modes(&camera)[..2], [3, 3]);
    assert_eq!(camera.count(|r| *r == Request::OnePushWhite), 1);
    assert_eq!(camera.count(|r| matches!(r, Request::Set(Register::Gain | Register::RedGain, _))), 0);
}

#[test]
fn presets_and_home_are_moves() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    head.store_preset(5).unwrap();
    head.clear_preset(0).unwrap();
    assert_eq!(head.motion().unwrap(), Motion::Idle);
    head.recall_preset(5).unwrap();
    assert_eq!(head.motion().unwrap(), Motion::Moving);
    assert_eq!(wait(&camera, &mut head), Motion::Idle);
    head.home().unwrap();
    assert_eq!(wait(&camera, &mut head), Motion::Idle);
    assert_eq!(head.position().unwrap().pan, 0.0);
    let presets = [(PresetAction::Store, 5), (PresetAction::Clear, 0), (PresetAction::Recall, 5)];
    for (action, number) in presets {
        assert!(camera.heard().contains(&Request::Preset(action, number)));
    }
}

#[test]
fn a_head_says_when_it_has_failed() {
    let camera = serial(&Model::EVI_D100);
    let mut head = camera.head();
    camera.script().tells_completion = false;
    head.move_absolute(0.3, 0.0).unwrap();
    let socket = camera.script().sockets;
    camera.say(Reply::Error { socket, fault: Fault::NotExecutable }.encode(1).bytes());
    camera.pass(MOVE);
    assert_eq!(head.motion().unwrap(), Motion::Failed);
    assert_eq!(head.motion().unwrap(), Motion::Failed);
    camera.script().tells_completion = true;
    head.move_absolute(0.2, 0.0).unwrap();
    assert_eq!(wait(&camera, &mut head), Motion::Idle);
    camera.script().failed = true;
    assert_eq!(head.motion().unwrap(), Motion::Failed);
}
