//! Pictures: the frames of a shot with their spots, and the residuals of the calibration.

use std::path::Path;

use image::{Rgb, RgbImage};
use nalgebra::Vector2;
use ptzcal::calibrate::{Calibration, Correspondences};
use ptzcal::control::Cancel;
use ptzcal::detect::spot::{SpotOptions, detect_spot};
use ptzcal::device::{Frame, FrameSource};
use ptzcal::geometry::Camera;
use ptzcal::rig::Rig;
use ptzcal::sim::Simulator;

use super::Outcome;

const GREEN: Rgb<u8> = Rgb([60, 255, 60]);
const YELLOW: Rgb<u8> = Rgb([255, 220, 0]);

/// Residual arrows are this much longer than the residuals.
const EXAGGERATION: f64 = 150.0;

fn to_rgb(frame: &Frame) -> Outcome<RgbImage> {
    let view = frame.image.view()?;
    Ok(RgbImage::from_fn(view.width(), view.height(), |x, y| Rgb(view.rgb(x, y))))
}

fn line(picture: &mut RgbImage, from: Vector2<f64>, to: Vector2<f64>, colour: Rgb<u8>) {
    let steps = ((to - from).amax().ceil() as usize).clamp(1, 10_000);
    for i in 0..=steps {
        let p = from + (to - from) * (i as f64 / steps as f64);
        let (x, y) = (p.x.round(), p.y.round());
        if x >= 0.0 && y >= 0.0 && x < picture.width() as f64 && y < picture.height() as f64 {
            picture.put_pixel(x as u32, y as u32, colour);
        }
    }
}

fn circle(picture: &mut RgbImage, centre: Vector2<f64>, radius: f64, colour: Rgb<u8>) {
    let at = |i: usize| {
        let (s, c) = (i as f64 * std::f64::consts::TAU / 48.0).sin_cos();
        centre + Vector2::new(c, s) * radius
    };
    for i in 0..48 {
        line(picture, at(i), at(i + 1), colour);
    }
}

/// One shot aimed at the near box: both cameras' frames with the spot circled, in the fixed camera
/// with a cross where the calibrated camera expects it.
pub fn spots(folder: &Path, simulator: &Simulator, rig: &mut Rig, camera: &Camera) -> Outcome<()> {
    rig.move_to(-0.12, 0.08, &Cancel::new())?;
    let mut sources: [(&str, Box<dyn FrameSource>); 2] =
        [("head.png", Box::new(simulator.head_frames())), ("fixed.png", Box::new(simulator.fixed_frames(0)?))];
    let position = rig.position()?;
    let mut expected = None;
    for (name, source) in &mut sources {
        let (mut off, mut on) = (Frame::empty(), Frame::empty());
        source.next_frame(simulator.clock().now(), 1.0, &mut off)?;
        rig.set_laser(true)?;
        source.next_frame(simulator.clock().now(), 1.0, &mut on)?;
        rig.set_laser(false)?;
        let spot = detect_spot(&[on.image.view()?], &[off.image.view()?], &SpotOptions::default())?;
        let centre = Vector2::new(spot.x, spot.y);
        let mut picture = to_rgb(&on)?;
        circle(&mut picture, centre, 14.0, GREEN);
        circle(&mut picture, centre, 15.0, GREEN);
        if let Some(p) = expected {
            let (h, v) = (Vector2::new(24.0, 0.0), Vector2::new(0.0, 24.0));
            line(&mut picture, p - h, p + h, YELLOW);
            line(&mut picture, p - v, p + v, YELLOW);
        } else {
            let covariance =
                nalgebra::Matrix2::new(spot.covariance[0], spot.covariance[1], spot.covariance[1], spot.covariance[2]);
            let measured = rig.model().measure(position.pan, position.tilt, &centre, &covariance)?;
            expected = measured.point.point().and_then(|x| camera.project(&x));
        }
        picture.save(folder.join(name))?;
    }
    println!("   head.png, fixed.png: one shot, spots circled; the cross is where the calibrated camera expects it");
    Ok(())
}

/// The fixed camera's view with the residuals as arrows: used shots green, outliers red.
pub fn residuals(folder: &Path, simulator: &Simulator, set: &Correspondences, c: &Calibration) -> Outcome<()> {
    let mut frame = Frame::empty();
    simulator.fixed_frames(0)?.next_frame(simulator.clock().now(), 1.0, &mut frame)?;
    let mut picture = to_rgb(&frame)?;
    // Darker, so that the arrows stand out.
    picture.pixels_mut().for_each(|p| p.0 = p.0.map(|v| v / 2));
    for ((observation, residual), inlier) in set.observations().iter().zip(&c.residuals).zip(&c.inliers) {
        let at = observation.pixels()[0];
        if *inlier {
            line(&mut picture, at, at + residual * EXAGGERATION, GREEN);
            circle(&mut picture, at, 1.0, YELLOW);
        } else {
            circle(&mut picture, at, 4.0, Rgb([255, 40, 40]));
        }
    }
    picture.save(folder.join("residuals.png"))?;
    println!("   residuals.png: residuals times {EXAGGERATION:.0}, outliers circled in red");
    Ok(())
}
