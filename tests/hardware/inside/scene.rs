//! A laser's spot at known places, shown on the camera's cable, and found in what the library took.
//! The machine computes slowly: it only takes the frames, and they are judged outside.

use std::fmt::Write;
use std::path::Path;

use ptzcal::detect::spot::{SpotOptions, detect_spot};
use ptzcal::device::Frame;
use ptzcal::image::{Image, PixelFormat};

use super::camera::open;
use super::display::{Display, SIZE, connect};

/// Where spots are drawn, pixels.
const PLACES: [(f64, f64); 6] =
    [(640.0, 360.0), (200.25, 150.5), (1000.7, 600.3), (333.33, 500.9), (900.5, 100.5), (50.1, 680.6)];
const SIGMA: f64 = 2.0;
const PEAK: f64 = 120.0;
const LIST: &str = "places.txt";

/// A background with structure, and a Gaussian spot on it.
fn picture(spot: Option<(f64, f64)>) -> Vec<u8> {
    let (width, height) = SIZE;
    let mut picture: Vec<u8> =
        (0..width * height).map(|i| 60 + ((i % width) / 40 % 2 * 20 + (i / width) / 40 % 2 * 15) as u8).collect();
    if let Some((x0, y0)) = spot {
        for y in (y0 as usize).saturating_sub(12)..(y0 as usize + 13).min(height) {
            for x in (x0 as usize).saturating_sub(12)..(x0 as usize + 13).min(width) {
                let (dx, dy) = (x as f64 - x0, y as f64 - y0);
                let light = PEAK * (-(dx * dx + dy * dy) / (2.0 * SIGMA * SIGMA)).exp();
                let pixel = &mut picture[y * width + x];
                *pixel = (f64::from(*pixel) + light).round() as u8;
            }
        }
    }
    picture
}

/// Takes a frame with the laser on and one with it off for each place, into the shared folder.
#[test]
#[ignore = "in the machine"]
fn spots_are_shown_and_taken() {
    connect();
    let display = Display::new(picture(None));
    let (mut camera, clock) = open("?size=1280x720&format=GREY").unwrap();
    let mut list = String::new();
    // A picture waits in three buffers of the display.
    let mut take = |name: String| {
        clock.sleep(0.5);
        let mut frame = Frame::empty();
        camera.next_frame(clock.now(), 5.0, &mut frame).unwrap();
        std::fs::write(name, &frame.image.data).unwrap();
    };
    for (k, place) in PLACES.into_iter().enumerate() {
        display.show(picture(None));
        take(format!("off{k}.grey"));
        display.show(picture(Some(place)));
        take(format!("on{k}.grey"));
        writeln!(list, "{} {}", place.0, place.1).unwrap();
    }
    std::fs::write(LIST, list).unwrap();
}

/// Outside: each spot is where it was drawn.
pub fn check(folder: &Path) {
    let list = std::fs::read_to_string(folder.join(LIST)).unwrap();
    let read = |name: String| {
        let mut image = Image::new(PixelFormat::Gray8, SIZE.0 as u32, SIZE.1 as u32);
        image.data = std::fs::read(folder.join(name)).unwrap();
        image
    };
    let mut worst: f64 = 0.0;
    let mut seen = 0;
    for (k, line) in list.lines().enumerate() {
        let truth: Vec<f64> = line.split(' ').map(|v| v.parse().unwrap()).collect();
        let (on, off) = (read(format!("on{k}.grey")), read(format!("off{k}.grey")));
        let spot = detect_spot(&[on.view().unwrap()], &[off.view().unwrap()], &SpotOptions::default()).unwrap();
        let error = (spot.x - truth[0]).hypot(spot.y - truth[1]);
        println!("spot at {truth:?}: found at ({:.3}, {:.3}), {error:.4} px off", spot.x, spot.y);
        worst = worst.max(error);
        // With the laser off there is nothing.
        assert!(detect_spot(&[off.view().unwrap()], &[off.view().unwrap()], &SpotOptions::default()).is_err());
        seen += 1;
    }
    assert_eq!(seen, PLACES.len());
    // Rounding to grey levels alone: a Gaussian of this size and height is found to about
    // sqrt(2) * (1 / sqrt(12)) / (PEAK * sqrt(pi)) = 0.002 px an axis; the link adds at most a level.
    assert!(worst < 0.02, "{worst} px");
}
