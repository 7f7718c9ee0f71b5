//! Edges of a disc: every direction, every place between pixels.

use super::gradient::noise_level;
use super::*;
use crate::image::{Image, PixelFormat};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

const CENTRE: [f64; 2] = [60.3, 52.8];
const RADIUS: f64 = 40.0;

/// A bright disc whose rim is a logistic ramp of about a pixel, with noise of this standard deviation.
fn disc(noise: f64) -> Image {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut image = Image::new(PixelFormat::Gray8, 120, 110);
    for (i, pixel) in image.data.iter_mut().enumerate() {
        let d = ((i % 120) as f64 - CENTRE[0]).hypot((i / 120) as f64 - CENTRE[1]) - RADIUS;
        // Twelve uniform variables make a normal one.
        let random: f64 = (0..12).map(|_| rng.next_u32() as f64 / 2f64.powi(32)).sum::<f64>() - 6.0;
        *pixel = (50.0 + 120.0 / (1.0 + (d / 0.6).exp()) + noise * random).round() as u8;
    }
    image
}

fn edges(image: &Image, options: &EdgeOptions) -> Vec<EdgePoint> {
    detect_edges(&image.view().unwrap(), options).unwrap()
}

#[test]
fn the_rim_of_a_disc_is_one_thin_closed_edge() {
    for sigma in [0.0, 1.0, 2.5] {
        let found = edges(&disc(0.0), &EdgeOptions { sigma, ..Default::default() });
        // One in every column where the rim is flat, one in every row where it is steep: 8 / sqrt 2 radii.
        let wanted = 8.0 * RADIUS / 2f64.sqrt();
        assert!((found.len() as f64 - wanted).abs() < 8.0, "sigma {sigma}: {}", found.len());
        let (mut square, mut n) = (0.0, 0.0);
        for e in &found {
            let (dx, dy) = (e.x - CENTRE[0], e.y - CENTRE[1]);
            let r = dx.hypot(dy);
            assert!((r - RADIUS).abs() < 0.25, "sigma {sigma}: {}", r - RADIUS);
            // Towards the bright middle, to a few degrees.
            assert!(-(dx * e.normal[0] + dy * e.normal[1]) / r > 0.99, "{e:?}");
            square += (r - RADIUS).powi(2);
            n += 1.0;
        }
        let rms: f64 = f64::sqrt(square / n);
        assert!(rms < 0.1, "sigma {sigma}: {rms}");
    }
}

#[test]
fn weak_edges_count_only_beside_strong_ones() {
    // A wedge: its upper side gets ever weaker to the right, down to nothing.
    let mut image = Image::new(PixelFormat::Gray8, 200, 40);
    for (i, pixel) in image.data.iter_mut().enumerate() {
        let (x, y) = ((i % 200) as f64, i / 200);
        *pixel = if y >= 20 { (40.0 + 0.5 * (200.0 - x)).round() as u8 } else { 40 };
    }
    let reach = |low: f64, high: f64| {
        let found = edges(&image, &EdgeOptions { sigma: 0.0, low, high });
        found.iter().map(|e| e.x).fold(0.0, f64::max)
    };
    // A step of c has a gradient of 0.375 c here.
    assert!((reach(20.0, 30.0) - (200.0 - 2.0 * 20.0 / 0.375)).abs() < 6.0, "{}", reach(20.0, 30.0));
    assert!((reach(30.0, 30.0) - (200.0 - 2.0 * 30.0 / 0.375)).abs() < 6.0);
    // Nothing reaches the high threshold: nothing at all.
    assert_eq!(reach(5.0, 60.0), 0.0);
}

#[test]
fn noise_is_measured_beside_edges() {
    for noise in [1.0, 3.0, 8.0] {
        let image = disc(noise);
        let view = image.view().unwrap();
        let found = noise_level(&Grey::of(&view));
        // Rounding adds a twelfth; edges make the median a little larger.
        assert!((found / (noise * noise + 1.0 / 12.0).sqrt() - 1.0).abs() < 0.12, "{noise}: {found}");
    }
}

#[test]
fn what_is_refused() {
    let image = disc(0.0);
    let good = EdgeOptions::default();
    for bad in [
        EdgeOptions { sigma: -0.1, ..good },
        EdgeOptions { sigma: 10.1, ..good },
        EdgeOptions { sigma: f64::NAN, ..good },
        EdgeOptions { low: 0.0, ..good },
        EdgeOptions { low: 11.0, ..good },
        EdgeOptions { high: f64::INFINITY, ..good },
        EdgeOptions { low: f64::NAN, ..good },
    ] {
        let e = detect_edges(&image.view().unwrap(), &bad).unwrap_err();
        assert!(matches!(e, Error::InvalidArgument { .. }), "{bad:?}");
    }
    for [w, h] in [[1, 1], [2, 9], [9, 2], [3, 3]] {
        let image = Image::new(PixelFormat::Gray8, w, h);
        assert!(edges(&image, &good).is_empty());
    }
    // 2^28 pixels and a row more. A view may be larger than its memory only if rows lie in each other,
    // which is refused, so that this needs the memory: pages that nobody touches.
    let data = vec![0u8; (1 << 28) + (1 << 14)];
    let view = ImageView::new(PixelFormat::Gray8, 1 << 14, (1 << 14) + 1, &[(&data, 1 << 14)]).unwrap();
    assert!(matches!(detect_edges(&view, &good), Err(Error::InvalidArgument { name: "image", .. })));
}
