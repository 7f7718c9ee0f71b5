//! The simulator as its users meet it: through the ports.

use nalgebra::Vector2;

use super::*;
use crate::device::{Frame, FrameSource, Laser, Motion, PanTiltZoom, PtzVelocity};
use crate::image::PixelFormat;

fn simulator(address: &str) -> Simulator {
    Simulator::new(SimOptions::parse(address).unwrap()).unwrap()
}

/// Moves there from below on both axes and waits until all is quiet.
fn rest_at(sim: &Simulator, pan_deg: f64, tilt_deg: f64) {
    let mut ptz = sim.ptz();
    ptz.move_absolute((pan_deg - 1.0).to_radians(), (tilt_deg - 1.0).to_radians()).unwrap();
    sim.clock().sleep(5.0);
    ptz.move_absolute(pan_deg.to_radians(), tilt_deg.to_radians()).unwrap();
    sim.clock().sleep(1.0);
}

fn at(source: &mut SimFrames, t: f64) -> Frame {
    let mut frame = Frame::empty();
    source.next_frame(t, 2.0, &mut frame).unwrap();
    frame
}

fn next(source: &mut SimFrames, sim: &Simulator) -> Frame {
    at(source, sim.clock().now())
}

/// Frames with the laser off and on.
fn pair(source: &mut SimFrames, laser: &mut SimLaser, sim: &Simulator) -> [Frame; 2] {
    [false, true].map(|on| {
        laser.set(on).unwrap();
        next(source, sim)
    })
}

fn red(frame: &Frame, x: i64, y: i64) -> f64 {
    let inside = x >= 0 && y >= 0 && x < i64::from(frame.image.width) && y < i64::from(frame.image.height);
    if inside {
        f64::from(frame.image.data[3 * (y as usize * frame.image.width as usize + x as usize) + 2])
    } else {
        0.0
    }
}

/// Centre of what the laser adds near `guess`, by the fixed point of a Gaussian-weighted mean;
/// `None` when it is faint or saturated.
fn centroid([off, on]: &[Frame; 2], guess: Vector2<f64>) -> Option<Vector2<f64>> {
    let (x0, y0) = (guess.x.round() as i64, guess.y.round() as i64);
    let pixels: Vec<(Vector2<f64>, f64)> = (-9..=9)
        .flat_map(|dy| (-9..=9).map(move |dx| (x0 + dx, y0 + dy)))
        .map(|(x, y)| (Vector2::new(x as f64, y as f64), red(on, x, y) - red(off, x, y)))
        .collect();
    let brightest = pixels.iter().map(|p| red(on, p.0.x as i64, p.0.y as i64)).fold(0.0, f64::max);
    let peak = pixels.iter().map(|p| p.1).fold(0.0, f64::max);
    if brightest >= 254.0 || peak < 40.0 {
        return None;
    }
    let mut centre = Vector2::new(x0 as f64, y0 as f64);
    for _ in 0..60 {
        let weighted = pixels.iter().map(|(p, light)| (p, light * (-(p - centre).norm_squared() / 8.0).exp()));
        let (sum, total) = weighted.fold((Vector2::zeros(), 0.0), |(s, t), (p, w)| (s + p * w, t + w));
        centre = sum / total;
    }
    Some(centre)
}

#[test]
fn the_truth_is_where_the_spot_is_seen() {
    let mut checked = [0; 3];
    let mut worst = 0.0f64;
    for station in [1, 2] {
        // Near spots need little light not to saturate, far ones much.
        for power in [0.015, 0.04, 0.15, 0.5] {
            let sim = simulator(&format!(
                "sim:room?station={station}&laser={power}&noise=0&shot=0&reflection=0&repeatability_deg=0.05"
            ));
            let (mut laser, mut head) = (sim.laser(), sim.head_frames());
            let mut fixed = [0, 1].map(|i| sim.fixed_frames(i).unwrap());
            for k in 0..30 {
                rest_at(&sim, -29.0 + 1.9 * f64::from(k), -20.0 + 38.0 * (f64::from(k) * 0.618).fract());
                let truth = sim.spot_truth();
                let frames = [pair(&mut head, &mut laser, &sim)]
                    .into_iter()
                    .chain(fixed.iter_mut().map(|f| pair(f, &mut laser, &sim)));
                for (camera, frames) in frames.enumerate() {
                    let pixel = if camera == 0 { truth.head } else { truth.fixed[camera - 1] };
                    // At the border a part of the spot is cut off.
                    let size = Vector2::new(frames[0].image.width as f64, frames[0].image.height as f64);
                    let Some(pixel) = pixel.filter(|p| p.min() > 9.0 && (size - p).min() > 10.0) else { continue };
                    let Some(centre) = centroid(&frames, pixel) else { continue };
                    let error = (centre - pixel).norm();
                    assert!(error < 0.05, "camera {camera} at {k}: {centre} is not {pixel}");
                    worst = worst.max(error);
                    checked[camera] += 1;
                }
            }
        }
    }
    println!("{checked:?} spots checked, the worst is {worst:.4} px off");
    assert!(checked.iter().zip([40, 20, 12]).all(|(n, least)| *n >= least), "{checked:?}");
}

#[test]
fn the_truth_agrees_with_its_own_models_at_both_stations() {
    for station in [1, 2] {
        let sim = simulator(&format!("sim:room?station={station}&repeatability_deg=0&backlash_deg=0"));
        let truth = sim.truth();
        rest_at(&sim, 8.0, 5.0);
        let spot = sim.spot_truth();
        let reading = sim.ptz().position().unwrap();
        let (origin, direction) = truth.rig.laser_in_world(reading.pan, reading.tilt);
        let off_line = (spot.point - origin).cross(&direction.normalize()).norm();
        assert!(off_line < 1e-9, "{off_line}");
        let head = truth.rig.head_camera(reading.pan, reading.tilt).project(&spot.point).unwrap();
        assert!((head - spot.head.unwrap()).norm() < 1e-9);
        for (camera, pixel) in truth.fixed.iter().zip(&spot.fixed) {
            if let Some(pixel) = pixel {
                assert!((camera.project(&spot.point).unwrap() - pixel).norm() < 1e-9);
            }
        }
        // The point is on the surface in the room's frame.
        let in_room = truth.station.inverse().apply(&spot.point);
        assert!(in_room.z > 1.0 && in_room.z < 4.6 + 1e-9);
        assert_ne!(sim.nominal_rig(), truth.rig);
    }
}

#[test]
fn a_hidden_spot_leaves_no_trace() {
    let sim = simulator("sim:room?noise=0&shot=0&reflection=0");
    let (mut laser, mut far) = (sim.laser(), sim.fixed_frames(1).unwrap());
    let (mut hidden, mut seen) = (0, 0);
    for k in 0..16 {
        rest_at(&sim, -28.0 + 3.3 * f64::from(k), -18.0 + 30.0 * (f64::from(k) * 0.618).fract());
        let frames = pair(&mut far, &mut laser, &sim);
        let same = frames[0].image.data == frames[1].image.data;
        match sim.spot_truth().fixed[1] {
            Some(_) => {
                assert!(!same);
                seen += 1;
            }
            // Unless it is just beside the image, whose border its halo reaches.
            None => {
                let pixel = sim.truth().fixed[1].project(&sim.spot_truth().point);
                let near = pixel.is_some_and(|p| p.min() > -40.0 && p.x < 840.0 && p.y < 640.0);
                assert!(same, "shot {k}, {pixel:?}");
                hidden += usize::from(near);
            }
        }
    }
    println!("{seen} seen, {hidden} hidden behind something");
    assert!(seen >= 3 && hidden >= 3, "{seen} {hidden}");
}

#[test]
fn near_spots_saturate_and_far_ones_do_not() {
    let sim = simulator("sim:room?noise=0&shot=0");
    let (mut laser, mut head) = (sim.laser(), sim.head_frames());
    let mut brightest = |pan, tilt| {
        rest_at(&sim, pan, tilt);
        let truth = sim.spot_truth();
        let frames = pair(&mut head, &mut laser, &sim);
        let pixel = truth.head.unwrap();
        let around = (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy)));
        let values = around.map(|(dx, dy)| red(&frames[1], pixel.x as i64 + dx, pixel.y as i64 + dy));
        (truth.point.norm(), values.fold(0.0, f64::max))
    };
    let (near, far) = (brightest(-20.0, 10.0), brightest(0.0, 0.0));
    assert!(near.0 < 1.3 && near.1 == 255.0, "{near:?}");
    assert!(far.0 > 4.5 && far.1 > 120.0 && far.1 < 255.0, "{far:?}");
}

#[test]
fn frames_show_motion_until_the_head_has_settled() {
    let sim = simulator("sim:room?noise=0&shot=0");
    let (mut ptz, mut head) = (sim.ptz(), sim.head_frames());
    rest_at(&sim, 0.0, 0.0);
    let still = next(&mut head, &sim);
    assert_eq!(next(&mut head, &sim).image, still.image);
    ptz.move_absolute(0.3, 0.1).unwrap();
    assert_eq!(ptz.motion().unwrap(), Motion::Moving);
    let moving = [next(&mut head, &sim), next(&mut head, &sim)];
    assert_ne!(moving[0].image, still.image);
    assert_ne!(moving[0].image, moving[1].image);
    while ptz.motion().unwrap() == Motion::Moving {}
    // The motors have stopped, the head still swings.
    let swinging = next(&mut head, &sim);
    sim.clock().sleep(1.0);
    let settled = next(&mut head, &sim);
    assert_ne!(swinging.image, settled.image);
    assert_eq!(next(&mut head, &sim).image, settled.image);
}

#[test]
fn a_frame_exposed_while_the_laser_switches_shows_half_the_spot() {
    let sim = simulator("sim:room?noise=0&shot=0&laser=0.3&halo=0");
    let (mut laser, mut head, clock) = (sim.laser(), sim.head_frames(), sim.clock());
    rest_at(&sim, 0.0, 0.0);
    let frames = pair(&mut head, &mut laser, &sim);
    laser.set(false).unwrap();
    let begin = next(&mut head, &sim).timestamp + 1.0;
    // The laser comes on 2 ms after the call, in the middle of the exposure.
    clock.sleep(begin + 0.008 - clock.now());
    laser.set(true).unwrap();
    let mut half = Frame::empty();
    head.next_frame(begin - 1e-6, 1.0, &mut half).unwrap();
    assert!((half.timestamp - begin).abs() < 1e-9);
    let truth = sim.spot_truth().head.unwrap().map(|c| c.round() as i64);
    let light = |f: &Frame| red(f, truth.x, truth.y) - red(&frames[0], truth.x, truth.y);
    let ratio = light(&half) / light(&frames[1]);
    assert!((ratio - 0.5).abs() < 0.04, "{ratio}");
}

#[test]
fn the_same_calls_give_the_same_bytes() {
    let run = |seed: u32| {
        let sim = simulator(&format!("sim:room?seed={seed}&person=1&drift=0.1"));
        let (mut ptz, mut laser, mut head) = (sim.ptz(), sim.laser(), sim.head_frames());
        let mut fixed = sim.fixed_frames(1).unwrap();
        let mut all = Vec::new();
        for k in 0..4 {
            ptz.move_absolute(0.1 * f64::from(k), -0.05).unwrap();
            all.push(next(&mut head, &sim));
            sim.clock().sleep(0.7);
            laser.set(k % 2 == 0).unwrap();
            all.push(next(&mut head, &sim));
            all.push(next(&mut fixed, &sim));
        }
        all
    };
    let (first, again, other) = (run(5), run(5), run(6));
    assert!(first == again);
    assert!(first.iter().zip(&other).all(|(a, b)| a.image != b.image));
}

#[test]
fn noise_is_as_configured_and_new_in_every_frame() {
    let (read, shot) = (2.5, 0.05);
    let clean = next(&mut simulator("sim:room?noise=0&shot=0").fixed_frames(0).unwrap(), &simulator("sim:room"));
    let sim = simulator(&format!("sim:room?noise={read}&shot={shot}"));
    let mut source = sim.fixed_frames(0).unwrap();
    let noise: Vec<Vec<f64>> = (0..3)
        .map(|_| {
            let frame = next(&mut source, &sim);
            frame.image.data.iter().zip(&clean.image.data).map(|(n, c)| f64::from(*n) - f64::from(*c)).collect()
        })
        .collect();
    let count = noise[0].len() as f64;
    for n in &noise {
        assert!((n.iter().sum::<f64>() / count).abs() < 0.05);
        for low in [30u8, 60, 90, 120] {
            let band: Vec<(f64, f64)> = (clean.image.data.iter().zip(n))
                .filter(|(c, _)| (low..low + 25).contains(c))
                .map(|(c, n)| (f64::from(*c), *n))
                .collect();
            assert!(band.len() > 5000);
            let mean = |f: &dyn Fn(&(f64, f64)) -> f64| band.iter().map(f).sum::<f64>() / band.len() as f64;
            // Rounding to whole grey levels happens twice, in the clean frame and in the noisy one.
            let wanted = read * read + shot * mean(&|b| b.0) + 2.0 / 12.0;
            let found = mean(&|b| b.1 * b.1);
            assert!((found / wanted - 1.0).abs() < 0.04, "level {low}: variance {found} is not {wanted}");
        }
    }
    let product = |a: usize, b: usize| noise[a].iter().zip(&noise[b]).map(|(a, b)| a * b).sum::<f64>() / count;
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        // The rounding of the clean frame is common to both, and that is 1/12.
        let correlation = (product(a, b) - 1.0 / 12.0) / product(a, a);
        assert!(correlation.abs() < 0.01, "{correlation}");
    }
}

#[test]
fn frames_come_in_order_and_waiting_takes_virtual_time_only() {
    let sim = simulator("sim:room?fps=25&exposure=0.02&latency=0.03");
    let (clock, mut head) = (sim.clock(), sim.head_frames());
    let mut frame = Frame::empty();
    head.next_frame(1.0, 2.0, &mut frame).unwrap();
    assert!((1.0..1.04).contains(&frame.timestamp));
    assert!((clock.now() - frame.timestamp - 0.05).abs() < 1e-9);
    // The next one, although an older one is asked for; a frame of the past costs no time.
    let before = frame.timestamp;
    head.next_frame(0.0, 1.0, &mut frame).unwrap();
    assert!((frame.timestamp - before - 0.04).abs() < 1e-9);
    clock.sleep(0.5);
    let now = clock.now();
    head.next_frame(now - 0.3, 0.0, &mut frame).unwrap();
    assert!(frame.timestamp >= now - 0.3 && clock.now() == now);
    // Only the last second is kept.
    clock.sleep(10.0);
    head.next_frame(f64::NEG_INFINITY, 0.0, &mut frame).unwrap();
    assert!((clock.now() - frame.timestamp) <= 1.0);
    // Too short a wait passes and fails.
    let now = clock.now();
    let late = head.next_frame(now + 0.5, 0.2, &mut frame);
    assert!(matches!(late, Err(Error::DeviceTimeout { .. })));
    assert!((clock.now() - now - 0.2).abs() < 1e-12);
    for (not_before, timeout) in [(f64::NAN, 1.0), (0.0, f64::NAN)] {
        assert!(matches!(head.next_frame(not_before, timeout, &mut frame), Err(Error::InvalidArgument { .. })));
    }
    assert!(matches!(head.next_frame(f64::INFINITY, f64::INFINITY, &mut frame), Err(Error::DeviceTimeout { .. })));
}

#[test]
fn the_head_reads_whole_steps_and_refuses_what_it_cannot_reach() {
    let sim = simulator("sim:room?step_deg=0.1");
    let mut ptz = sim.ptz();
    ptz.move_absolute(0.2, -0.1).unwrap();
    sim.clock().sleep(2.0);
    let step = ptz.capabilities().pan_step;
    let position = ptz.position().unwrap();
    for (angle, wanted) in [(position.pan, 0.2), (position.tilt, -0.1)] {
        assert!((angle - wanted).abs() <= step / 2.0 + 1e-12);
        assert!(((angle / step) - (angle / step).round()).abs() < 1e-9);
    }
    assert!(matches!(ptz.move_absolute(2.0, 0.0), Err(Error::Unreachable { .. })));
    assert!(matches!(ptz.move_absolute(0.0, f64::NAN), Err(Error::InvalidArgument { .. })));
    assert_eq!(ptz.position().unwrap(), position);
}

#[test]
fn faults_do_what_they_say() {
    let sim = simulator("sim:room?unplug_after=2&noise=0&shot=0");
    let (mut ptz, mut laser, mut head) = (sim.ptz(), sim.laser(), sim.head_frames());
    let quiet = Faults { reflection: 0.0, ..Faults::default() };
    assert!(ptz.position().is_ok() && ptz.motion().is_ok());
    assert!(matches!(ptz.position(), Err(Error::DeviceLost { .. })));
    assert!(matches!(ptz.stop(), Err(Error::DeviceLost { .. })));
    sim.set_faults(quiet);
    assert!(ptz.position().is_ok());

    sim.set_faults(Faults { laser_refuses: true, ..quiet });
    assert!(matches!(laser.set(true), Err(Error::LaserRefused { .. })));
    assert!(laser.set(false).is_ok());

    sim.set_faults(Faults { frames_time_out: true, ..quiet });
    let before = sim.clock().now();
    let mut frame = Frame::empty();
    assert!(matches!(head.next_frame(before, 0.7, &mut frame), Err(Error::DeviceTimeout { .. })));
    assert!((sim.clock().now() - before - 0.7).abs() < 1e-12);

    sim.set_faults(Faults { ptz_lies: true, ..quiet });
    ptz.move_absolute(0.5, 0.0).unwrap();
    assert_eq!(ptz.motion().unwrap(), Motion::Idle);
    let early = ptz.position().unwrap().pan;
    assert!(early < 0.4);

    sim.set_faults(quiet);
    sim.clock().sleep(3.0);
    let calm = next(&mut head, &sim);
    let mean = |f: &Frame| f.image.data.iter().map(|v| f64::from(*v)).sum::<f64>() / f.image.data.len() as f64;
    sim.set_faults(Faults { exposure_drift: 0.2, ..quiet });
    let drifted: Vec<f64> = (0..8)
        .map(|_| {
            sim.clock().sleep(0.9);
            mean(&next(&mut head, &sim)) / mean(&calm)
        })
        .collect();
    let (low, high) = drifted.iter().fold((9.0f64, 0.0f64), |(l, h), v| (l.min(*v), h.max(*v)));
    assert!(low < 0.9 && low > 0.79 && high > 1.1 && high < 1.21, "{drifted:?}");
    assert_eq!(sim.faults().exposure_drift, 0.2);
}

#[test]
fn a_person_walks_through_the_fixed_cameras_picture() {
    let sim = simulator("sim:room?noise=0&shot=0&person=1");
    let mut near = sim.fixed_frames(0).unwrap();
    let mut changed = 0;
    let mut last = next(&mut near, &sim);
    for _ in 0..12 {
        sim.clock().sleep(0.5);
        let frame = next(&mut near, &sim);
        let different = frame.image.data.iter().zip(&last.image.data).filter(|(a, b)| a != b).count();
        changed = changed.max(different);
        assert!(different < frame.image.data.len() / 4, "most of the room stands still");
        last = frame;
    }
    assert!(changed > 10_000, "{changed}");
}

#[test]
fn a_glossy_face_throws_a_second_spot() {
    let sim = simulator("sim:room?noise=0&shot=0&reflection=0.5");
    let (mut laser, mut head) = (sim.laser(), sim.head_frames());
    // Onto the top of the first box, from there to the back wall.
    rest_at(&sim, -6.0, -3.7);
    let truth = sim.spot_truth();
    assert!((truth.point.y - 0.15).abs() < 0.03, "{}", truth.point);
    let frames = pair(&mut head, &mut laser, &sim);
    let main = truth.head.unwrap();
    let far_away = |x: i64, y: i64| (x as f64 - main.x).hypot(y as f64 - main.y) > 25.0;
    let second = (0..576)
        .flat_map(|y| (0..720).map(move |x| (x, y)))
        .filter(|(x, y)| far_away(*x, *y))
        .map(|(x, y)| red(&frames[1], x, y) - red(&frames[0], x, y))
        .fold(0.0, f64::max);
    assert!(second > 20.0, "{second}");
    sim.set_faults(Faults { reflection: 0.0, ..sim.faults() });
    let frames = pair(&mut head, &mut laser, &sim);
    let rest = (0..576).flat_map(|y| (0..720).map(move |x| (x, y))).filter(|(x, y)| far_away(*x, *y));
    assert!(rest.map(|(x, y)| red(&frames[1], x, y) - red(&frames[0], x, y)).fold(0.0, f64::max) < 1.0);
}

#[test]
fn the_laser_goes_off_when_it_is_dropped() {
    let sim = simulator("sim:room?noise=0&shot=0");
    let mut head = sim.head_frames();
    let dark = next(&mut head, &sim);
    let mut laser = sim.laser();
    laser.set(true).unwrap();
    assert_ne!(next(&mut head, &sim).image, dark.image);
    drop(laser);
    assert_eq!(next(&mut head, &sim).image, dark.image);
}

#[test]
fn every_format_shows_the_same_picture() {
    let bgr = next(&mut simulator("sim:room?noise=0&shot=0").head_frames(), &simulator("sim:room"));
    let names = ["gray8", "rgb24", "bgr24", "rgba32", "bgra32", "yuyv", "nv12", "i420"];
    for (code, name) in (1..).zip(names) {
        let sim = simulator(&format!("sim:room?noise=0&shot=0&format={name}"));
        let frame = next(&mut sim.head_frames(), &sim);
        assert_eq!(frame.image.format, PixelFormat::try_from(code).unwrap());
        let (view, wanted) = (frame.image.view().unwrap(), bgr.image.view().unwrap());
        let mut error = 0.0;
        for y in (0..576).step_by(7) {
            for x in (0..720).step_by(7) {
                let [r, g, b] = wanted.rgb(x, y).map(f64::from);
                let luma = |[r, g, b]: [f64; 3]| 0.299 * r + 0.587 * g + 0.114 * b;
                error += (luma(view.rgb(x, y).map(f64::from)) - luma([r, g, b])).abs();
            }
        }
        assert!(error / (83.0 * 103.0) < 0.8, "{name}: {error}");
    }
}

#[test]
fn cameras_that_do_not_exist_are_refused() {
    let sim = simulator("sim:room?cameras=1");
    assert_eq!(sim.fixed_cameras(), 1);
    assert!(sim.fixed_frames(0).is_ok());
    assert!(matches!(sim.fixed_frames(1), Err(Error::InvalidArgument { name: "camera", .. })));
    assert_eq!(sim.truth().fixed.len(), 1);
    assert!(Simulator::new(SimOptions { station: 3, ..SimOptions::default() }).is_err());
}

#[test]
fn cameras_may_be_read_from_several_threads() {
    fn shared_between_threads<T: Send + Sync>(_: &T) {}
    let sim = simulator("sim:room?cameras=2");
    shared_between_threads(&sim);
    let alone: Vec<Frame> = {
        let sim = simulator("sim:room?cameras=2");
        (0..2).map(|i| at(&mut sim.fixed_frames(i).unwrap(), 1.0)).collect()
    };
    let together: Vec<Frame> = std::thread::scope(|scope| {
        let threads = [0, 1].map(|i| {
            let mut source = sim.fixed_frames(i).unwrap();
            scope.spawn(move || at(&mut source, 1.0))
        });
        threads.map(|t| t.join().unwrap()).into_iter().collect()
    });
    assert!(alone == together);
}

#[test]
fn speed() {
    let sim = simulator("sim:room");
    let (mut laser, mut head, mut fixed) = (sim.laser(), sim.head_frames(), sim.fixed_frames(0).unwrap());
    let started = std::time::Instant::now();
    next(&mut head, &sim);
    println!("{:.0} ms until the first frame", started.elapsed().as_secs_f64() * 1e3);
    let started = std::time::Instant::now();
    let shots = 30;
    for k in 0..shots {
        rest_at(&sim, -28.0 + 1.7 * f64::from(k), 15.0 - f64::from(k));
        pair(&mut head, &mut laser, &sim);
        pair(&mut fixed, &mut laser, &sim);
    }
    let milliseconds = started.elapsed().as_secs_f64() * 1e3;
    println!("{:.1} ms a shot (two head frames, two fixed frames)", milliseconds / f64::from(shots));
    assert_eq!(sim.frames_delivered(), 1 + 4 * shots as u64);
}

#[test]
fn the_head_drives_goes_home_and_moves_relatively() {
    let sim = simulator("sim:room");
    let (mut ptz, clock, step) = (sim.ptz(), sim.clock(), SimOptions::default().step);
    let velocity = PtzVelocity { pan: 0.2, tilt: -0.1, zoom: 0.0 };
    ptz.drive(velocity, f64::INFINITY).unwrap();
    clock.sleep(1.0);
    let at = ptz.position().unwrap();
    assert!((at.pan - 0.2).abs() < 0.005 && (at.tilt + 0.1).abs() < 0.005, "{at:?}");
    ptz.drive(PtzVelocity::default(), f64::INFINITY).unwrap();
    let stopped = ptz.position().unwrap();
    clock.sleep(1.0);
    assert_eq!(ptz.position().unwrap(), stopped);
    // One that ends by itself, and one that goes to the end.
    ptz.drive(PtzVelocity { pan: -0.2, ..velocity }, 0.5).unwrap();
    clock.sleep(3.0);
    assert!((ptz.position().unwrap().pan - stopped.pan + 0.1).abs() < 0.005);
    ptz.drive(PtzVelocity { pan: 9.0, ..velocity }, f64::INFINITY).unwrap();
    clock.sleep(10.0);
    let at = ptz.position().unwrap();
    assert!((at.pan - 100f64.to_radians()).abs() <= step && (at.tilt + 25f64.to_radians()).abs() <= step, "{at:?}");
    ptz.home().unwrap();
    clock.sleep(5.0);
    ptz.move_relative(0.1, -0.05).unwrap();
    clock.sleep(5.0);
    let at = ptz.position().unwrap();
    assert!((at.pan - 0.1).abs() <= step && (at.tilt + 0.05).abs() <= step, "{at:?}");
    assert!(matches!(ptz.move_relative(3.0, 0.0), Err(Error::Unreachable { .. })));
    for bad in [PtzVelocity { pan: f64::NAN, ..velocity }, PtzVelocity { tilt: f64::INFINITY, ..velocity }] {
        assert!(matches!(ptz.drive(bad, 1.0), Err(Error::InvalidArgument { .. })));
    }
    assert!(matches!(ptz.drive(velocity, f64::NAN), Err(Error::InvalidArgument { .. })));
    assert!(matches!(ptz.drive(PtzVelocity { zoom: 1.0, ..velocity }, 1.0), Err(Error::Unsupported { .. })));
}

#[test]
fn in_real_time_waiting_takes_time() {
    let sim = simulator("sim:room?real_time=20&cameras=0");
    let (mut ptz, mut laser, mut frames) = (sim.ptz(), sim.laser(), sim.head_frames());
    let (start, begin) = (std::time::Instant::now(), sim.clock().now());
    let mut frame = Frame::empty();
    for _ in 0..5 {
        frames.next_frame(sim.clock().now(), 1.0, &mut frame).unwrap();
        laser.set(true).unwrap();
        ptz.position().unwrap();
    }
    sim.clock().sleep(1.0);
    let late = frames.next_frame(sim.clock().now() + 9.0, 0.5, &mut frame);
    assert!(matches!(late, Err(Error::DeviceTimeout { .. })));
    let (virtual_time, real) = (sim.clock().now() - begin, start.elapsed().as_secs_f64());
    // Five frames of 25 a second, each begun and exposed, a second, and half of one in vain.
    assert!(virtual_time > 1.5 + 5.0 * 0.05 && virtual_time <= 20.0 * real, "{virtual_time} s in {real} s");
}
