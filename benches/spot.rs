//! Times of a `SpotDetector` on rendered frames: least and median of many calls, one thread.
//! `cargo bench --bench spot -- NAME` runs those whose names contain NAME.

use std::hint::black_box;
use std::time::Instant;

use ptzcal::detect::spot::{LaserColour, Region, SpotDetector, SpotOptions};
use ptzcal::image::{Image, PixelFormat};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// Shading, noise of about two grey levels, and with the laser a spot and a weaker reflection.
fn frame(format: PixelFormat, width: u32, height: u32, laser: bool, gain: f64, rng: &mut ChaCha8Rng) -> Image {
    let mut image = Image::new(format, width, height);
    let channels = if format == PixelFormat::Bgr24 { 3 } else { 1 };
    let (cx, cy) = (0.61 * width as f64 + 0.37, 0.43 * height as f64 + 0.71);
    for (i, byte) in image.data.iter_mut().enumerate() {
        let (x, y) = ((i / channels % width as usize) as f64, (i / channels / width as usize) as f64);
        let bump = |cx: f64, cy: f64, s: f64| (-((x - cx).powi(2) + (y - cy).powi(2)) / (2.0 * s * s)).exp();
        let mut level = 60.0 + 25.0 * (x / 97.0).sin() * (y / 71.0).cos() + 20.0 * x / width as f64;
        if laser {
            level += 120.0 * bump(cx, cy, 2.2) + 50.0 * bump(0.2 * width as f64, 0.7 * height as f64, 1.2);
        }
        // The sum of four uniform numbers is normal enough here.
        let uniform: f64 = (0..4).map(|_| rng.next_u32() as f64 / 2f64.powi(32) - 0.5).sum();
        *byte = (gain * level + 2.0 * 3f64.sqrt() * uniform).round().clamp(0.0, 255.0) as u8;
    }
    image
}

fn main() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let wanted = std::env::args().skip(1).find(|a| !a.starts_with('-')).unwrap_or_default();
    let (grey, bgr) = (PixelFormat::Gray8, PixelFormat::Bgr24);
    for (name, format, [width, height], region, gain) in [
        ("640x480 grey", grey, [640, 480], 0, 1.0),
        ("640x480 BGR", bgr, [640, 480], 0, 1.0),
        ("1920x1080 grey", grey, [1920, 1080], 0, 1.0),
        ("1920x1080 grey, drift", grey, [1920, 1080], 0, 0.8),
        ("1920x1080 BGR", bgr, [1920, 1080], 0, 1.0),
        ("3840x2160 grey", grey, [3840, 2160], 0, 1.0),
        ("64x64 region, grey", grey, [1920, 1080], 64, 1.0),
        ("64x64 region, BGR", bgr, [1920, 1080], 64, 1.0),
        ("128x128 region, grey", grey, [1920, 1080], 128, 1.0),
    ] {
        if !name.contains(&wanted) {
            continue;
        }
        let on = frame(format, width, height, true, gain, &mut rng);
        let off = frame(format, width, height, false, 1.0, &mut rng);
        let (on, off) = (on.view().expect("packed"), off.view().expect("packed"));
        let (cx, cy) = ((0.61 * width as f64) as u32, (0.43 * height as f64) as u32);
        let region =
            (region > 0).then(|| Region { x: cx - region / 2, y: cy - region / 2, width: region, height: region });
        let options = SpotOptions { region, colour: LaserColour::Unknown, ..SpotOptions::default() };
        let mut detector = SpotDetector::default();
        let mut times: Vec<f64> = Vec::new();
        let begin = Instant::now();
        while begin.elapsed().as_secs_f64() < 0.7 {
            let start = Instant::now();
            black_box(detector.detect(black_box(&[on]), black_box(&[off]), &options)).expect("a spot");
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        println!("{name:24} least {:8.4} ms, median {:8.4} ms", times[0], times[times.len() / 2]);
    }
}
