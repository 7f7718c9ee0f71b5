//! Against truth: blobs whose scale space is known in closed form, and scenes of blobs, of which a
//! similarity is exact.

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::*;
use crate::error::Status;
use crate::image::{Image, PixelFormat};
use crate::vectors::tests::of_each_processor;

/// x, y, standard deviation (pixels) and height (grey levels) of a Gaussian.
type Blob = [f64; 4];

fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    f64::from(rng.next_u32()) / f64::from(u32::MAX)
}

/// Sum of twelve uniform numbers.
fn gaussian(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| uniform(rng)).sum::<f64>() - 6.0
}

fn render(width: u32, height: u32, blobs: &[Blob], noise: f64, seed: u64) -> Image {
    let mut level = vec![120.0; (width * height) as usize];
    for [cx, cy, sigma, peak] in blobs {
        let reach = 5.0 * sigma;
        let span = |c: f64, n: u32| (c - reach).max(0.0) as usize..((c + reach).max(0.0) as usize + 1).min(n as usize);
        for y in span(*cy, height) {
            for x in span(*cx, width) {
                let r2 = (x as f64 - cx).powi(2) + (y as f64 - cy).powi(2);
                level[y * width as usize + x] += peak * (-0.5 * r2 / (sigma * sigma)).exp();
            }
        }
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let data = level.iter().map(|l| (l + noise * gaussian(&mut rng)).round().clamp(0.0, 255.0) as u8).collect();
    Image { format: PixelFormat::Gray8, width, height, data }
}

fn detect(image: &Image, options: &SiftOptions) -> SiftFeatures {
    detect_sift(&image.view().unwrap(), options).unwrap()
}

fn everything(image: &Image) -> SiftFeatures {
    detect(image, &SiftOptions::default())
}

/// Many blobs of all sizes about the origin.
fn scene(n: usize, reach: f64, seed: u64) -> Vec<Blob> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n)
        .map(|_| {
            let [x, y, size, height] = [0; 4].map(|_| uniform(&mut rng));
            let sigma = 1.2 * 8f64.powf(size);
            [reach * (2.0 * x - 1.0), reach * (2.0 * y - 1.0), sigma, 110.0 * (2.0 * height - 1.0)]
        })
        .collect()
}

/// x -> s R(angle) x + t.
#[derive(Clone, Copy)]
struct Similarity {
    scale: f64,
    angle: f64,
    t: [f64; 2],
}

impl Similarity {
    fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.angle.sin_cos();
        [self.scale * (c * x - s * y) + self.t[0], self.scale * (s * x + c * y) + self.t[1]]
    }

    fn blobs(&self, blobs: &[Blob]) -> Vec<Blob> {
        let moved = |[x, y, sigma, height]: &Blob| {
            let [x, y] = self.apply([*x, *y]);
            [x, y, self.scale * sigma, *height]
        };
        blobs.iter().map(moved).collect()
    }
}

fn turn(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle + PI).rem_euclid(TAU) - PI
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// A blob of standard deviation t, blurred to sigma (of which 0.5 is taken to be in the image), is
/// G t^2 / v with v = t^2 - 0.25 + sigma^2 at its centre. The difference to k sigma is extreme where
/// sigma^2 = (t^2 - 0.25) / k.
#[test]
fn a_blob_is_found_at_its_centre_and_scale() {
    let k = (1.0 / INTERVALS as f64).exp2();
    for upsample in [true, false] {
        let options = SiftOptions { upsample, ..SiftOptions::default() };
        for (i, t) in [1.7, 2.4, 3.3, 4.7, 7.0, 11.0].into_iter().enumerate() {
            if !upsample && t < 2.4 {
                continue;
            }
            // Interpolation and its counterweight blur a doubled image more than is assumed.
            let extra = if upsample { (0.5 + INTERPOLATION_BLUR) / 4.0 } else { 0.0 };
            let scale = ((t * t - 0.25 + extra) / k).sqrt();
            for step in 0..7 {
                let shift = [0.13 * f64::from(step), 0.37 - 0.11 * f64::from(step)];
                let [x, y] = [80.0 + shift[0], 70.0 + shift[1]];
                let sign = if step % 2 == 0 { 1.0 } else { -1.0 };
                let image = render(160, 144, &[[x, y, t, 100.0 * sign]], 0.0, i as u64);
                let found = detect(&image, &options);
                let key = found.keypoints.first().unwrap_or_else(|| panic!("{t} at {x} {y}"));
                // Halfway between two samples the quadratic is off by 2 % of the scale.
                let tolerance = 0.01 + 0.02 * t;
                assert!((key.x - x).abs() < tolerance && (key.y - y).abs() < tolerance, "{t} {key:?} at {x} {y}");
                assert!((key.scale / scale).ln().abs() < 0.04, "{t}: {} for {scale}", key.scale);
            }
        }
    }
}

#[test]
fn a_quarter_turn_turns_the_features() {
    // Sizes of 1 more than a multiple of 128 let the samples of all octaves fall on each other.
    let n = 257u32;
    let blobs = Similarity { scale: 1.0, angle: 0.0, t: [128.0; 2] }.blobs(&scene(260, 150.0, 3));
    let image = render(n, n, &blobs, 2.0, 4);
    let at = |x: u32, y: u32| image.data[(y * n + x) as usize];
    // (x, y) goes to (n - 1 - y, x).
    let data = (0..n).flat_map(|y| (0..n).map(move |x| (x, y))).map(|(x, y)| at(y, n - 1 - x)).collect();
    let turned = Image { format: PixelFormat::Gray8, width: n, height: n, data };
    let (a, b) = (everything(&image), everything(&turned));
    assert!(a.keypoints.len() > 150, "{}", a.keypoints.len());
    // Near the border the octaves end elsewhere.
    let inside = |k: &SiftKeypoint| {
        let (least, most) = (12.0 * k.scale, f64::from(n - 1) - 12.0 * k.scale);
        k.x.min(k.y) > least && k.x.max(k.y) < most
    };
    let (mut same, mut all) = (0, 0);
    for (k, d) in a.keypoints.iter().zip(&a.descriptors).filter(|(k, _)| inside(k)) {
        all += 1;
        let (x, y) = (f64::from(n - 1) - k.y, k.x);
        let twin = b.keypoints.iter().zip(&b.descriptors).find(|(o, _)| {
            let angle = turn(o.angle - k.angle - std::f64::consts::FRAC_PI_2);
            (o.x - x).abs() < 2e-3
                && (o.y - y).abs() < 2e-3
                && angle.abs() < 2e-3
                && (o.scale / k.scale - 1.0).abs() < 1e-3
        });
        // Rounding may differ by one.
        same += usize::from(twin.is_some_and(|(_, other)| d.iter().zip(other).all(|(a, b)| a.abs_diff(*b) <= 2)));
    }
    assert!(all > 100 && same as f64 > 0.97 * f64::from(all), "{same} of {all}");
}

/// What is found of one scene in two views, under noise of 2 grey levels in each.
#[test]
fn features_survive_rotation_scale_and_noise() {
    let size = [360u32, 320];
    let centre = Similarity { scale: 1.0, angle: 0.0, t: [180.0, 160.0] };
    let (mut chi2, mut degrees) = (0.0, 0);
    for (seed, (scale, angle)) in [(1.0, 0.3), (1.0, 2.0), (0.8, -0.7), (0.6, 1.1), (1.25, 3.0)].into_iter().enumerate()
    {
        let blobs = scene(700, 230.0, seed as u64 + 10);
        let view = Similarity { scale, angle, t: [182.3, 158.6] };
        let a = everything(&render(size[0], size[1], &centre.blobs(&blobs), 2.0, 100 + seed as u64));
        let b = everything(&render(size[0], size[1], &view.blobs(&blobs), 2.0, 200 + seed as u64));
        let to_b = |k: &SiftKeypoint| view.apply([k.x - centre.t[0], k.y - centre.t[1]]);
        let off = |k: &SiftKeypoint, o: &SiftKeypoint| {
            let [x, y] = to_b(k);
            (o.x - x).hypot(o.y - y)
        };
        let seen = |k: &&SiftKeypoint| {
            let [x, y] = to_b(k);
            x > 12.0
                && y > 12.0
                && x < f64::from(size[0]) - 13.0
                && y < f64::from(size[1]) - 13.0
                && k.scale * scale > 1.3
        };
        let visible: Vec<&SiftKeypoint> = a.keypoints.iter().filter(seen).collect();
        let again = |k: &&&SiftKeypoint| {
            let alike = |o: &SiftKeypoint| (o.scale / (k.scale * scale)).ln().abs() < 0.35;
            b.keypoints.iter().any(|o| off(k, o) < 0.5 * o.scale.max(2.0) && alike(o))
        };
        let repeated = visible.iter().filter(again).count() as f64 / visible.len() as f64;
        let matches = match_sift(&a, &b, &SiftMatchOptions::default()).unwrap();
        let pair = |m: &SiftMatch| (a.keypoints[m.a], b.keypoints[m.b]);
        let right: Vec<_> = matches.iter().map(pair).filter(|(k, o)| off(k, o) < (0.5 * o.scale).max(2.0)).collect();
        let share = right.len() as f64 / matches.len() as f64;
        let angles = median(right.iter().map(|(k, o)| turn(o.angle - k.angle - angle).abs()).collect());
        let scales = median(right.iter().map(|(k, o)| (o.scale / (k.scale * scale)).ln().abs()).collect());
        println!(
            "x {scale}, {angle} rad: {} and {} keypoints, {repeated:.3} repeated, {} matches, {share:.3} right, \
             angle {angles:.4}, scale {scales:.4}",
            a.keypoints.len(),
            b.keypoints.len(),
            matches.len()
        );
        assert!(repeated > 0.7 && share > 0.93 && right.len() > visible.len() / 3);
        assert!(angles < 0.04 && scales < 0.05);
        for (k, o) in &right {
            let variance = (scale * k.position_sigma()).powi(2) + o.position_sigma().powi(2);
            chi2 += off(k, o).powi(2) / variance;
            degrees += 2;
        }
    }
    // The stated deviation was measured on photographs; blobs are better places.
    let ratio = (chi2 / f64::from(degrees)).sqrt();
    println!("deviation over the stated one: {ratio:.2}");
    assert!(ratio > 0.4 && ratio < 1.2);
}

#[test]
fn every_processor_finds_the_same() {
    let blobs = Similarity { scale: 1.0, angle: 0.0, t: [90.0, 70.0] }.blobs(&scene(200, 100.0, 5));
    let image = render(181, 143, &blobs, 2.0, 6);
    let found = of_each_processor(|| everything(&image));
    assert!(found[0].keypoints.len() > 50);
    assert!(found.iter().all(|f| *f == found[0]));
}

#[test]
fn colours_are_read_as_luma() {
    let blobs = Similarity { scale: 1.0, angle: 0.0, t: [60.0, 50.0] }.blobs(&scene(120, 80.0, 8));
    let grey = render(120, 100, &blobs, 1.0, 9);
    let data = grey.data.iter().flat_map(|p| [*p; 3]).collect();
    let colour = Image { format: PixelFormat::Bgr24, data, ..grey.clone() };
    assert_eq!(everything(&grey), everything(&colour));
}

#[test]
fn the_strongest_are_kept() {
    let blobs = Similarity { scale: 1.0, angle: 0.0, t: [100.0; 2] }.blobs(&scene(300, 110.0, 1));
    let image = render(200, 200, &blobs, 2.0, 2);
    let all = everything(&image);
    assert!(all.keypoints.is_sorted_by(|a, b| a.response >= b.response));
    for most in [1, 40, 1 << 30] {
        let some = detect(&image, &SiftOptions { max_features: most, ..SiftOptions::default() });
        let n = (most as usize).min(all.keypoints.len());
        assert_eq!(some.keypoints, all.keypoints[..n]);
        assert_eq!(some.descriptors, all.descriptors[..n]);
    }
    let contrast = SiftOptions { contrast_threshold: 0.1, ..SiftOptions::default() };
    let strong = detect(&image, &contrast).keypoints;
    assert!(!strong.is_empty() && strong.len() < all.keypoints.len());
    assert!(strong.iter().all(|k| k.response * INTERVALS as f64 >= 0.1));
    let round = detect(&image, &SiftOptions { edge_ratio: 1.5, ..SiftOptions::default() });
    assert!(round.keypoints.len() < all.keypoints.len());
}

#[test]
fn descriptors_are_of_length_512() {
    let blobs = Similarity { scale: 1.0, angle: 0.0, t: [100.0; 2] }.blobs(&scene(300, 110.0, 1));
    for d in everything(&render(200, 200, &blobs, 2.0, 2)).descriptors {
        let length = d.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt();
        assert!((length - 512.0).abs() < 6.0, "{length}");
    }
}

#[test]
fn images_without_contrast_and_the_smallest_have_none() {
    for level in [0, 128, 255] {
        for (width, height) in [(12, 12), (64, 48), (13, 300), (300, 13)] {
            let data = vec![level; (width * height) as usize];
            let image = Image { format: PixelFormat::Gray8, width, height, data };
            assert_eq!(everything(&image), SiftFeatures::default());
        }
    }
    // An edge is no blob.
    let mut edge = Image::new(PixelFormat::Gray8, 100, 80);
    edge.data.chunks_mut(100).for_each(|row| row[50..].fill(200));
    assert_eq!(everything(&edge), SiftFeatures::default());
}

#[test]
fn what_cannot_be_is_refused() {
    let refused = |width, height, options: SiftOptions| {
        let image = Image::new(PixelFormat::Gray8, width, height);
        let answer = detect_sift(&image.view().unwrap(), &options);
        assert_eq!(answer.unwrap_err().status(), Status::InvalidArgument, "{width} x {height}, {options:?}");
    };
    let usual = SiftOptions::default();
    for (width, height) in [(1, 1), (11, 400), (400, 11), (MAX_IMAGE_WIDTH + 1, 12), (1 << 14, (1 << 14) + 1)] {
        refused(width, height, usual);
    }
    for contrast_threshold in [0.0, -0.1, 1.1, f64::NAN, f64::INFINITY] {
        refused(64, 64, SiftOptions { contrast_threshold, ..usual });
    }
    for edge_ratio in [1.0, 0.0, -5.0, 1e7, f64::NAN, f64::INFINITY] {
        refused(64, 64, SiftOptions { edge_ratio, ..usual });
    }
    let key = keypoint(2.0);
    let made = |k: SiftKeypoint| SiftFeatures::new(vec![key, k], vec![[0; DESCRIPTOR_SIZE]; 2]);
    assert_eq!(made(key).unwrap().keypoints.len(), 2);
    assert_eq!(made(SiftKeypoint { scale: 0.0, ..key }).unwrap_err().status(), Status::InvalidArgument);
    for elongation in [0.9, 1001.0] {
        let answer = made(SiftKeypoint { elongation, ..key });
        assert_eq!(answer.unwrap_err().status(), Status::InvalidArgument);
    }
    let nan = SiftKeypoint { angle: f64::NAN, ..key };
    assert_eq!(made(nan).unwrap_err(), Error::NotFinite { name: "keypoints", index: 1 });
    assert_eq!(SiftFeatures::new(vec![key], vec![]).unwrap_err().status(), Status::InvalidArgument);
}

fn keypoint(scale: f64) -> SiftKeypoint {
    SiftKeypoint { x: 1.0, y: 1.0, scale, angle: 0.0, response: 0.1, octave: 0, elongation: 1.0, direction: 0.0 }
}

/// Features with these descriptors' first numbers.
fn labelled(first: &[u8]) -> SiftFeatures {
    let descriptor = |v: &u8| {
        let mut d = [0; DESCRIPTOR_SIZE];
        d[0] = *v;
        d
    };
    let key = keypoint(1.0);
    SiftFeatures::new(vec![key; first.len()], first.iter().map(descriptor).collect()).unwrap()
}

#[test]
fn the_ratio_test_and_the_mutual_check() {
    let pairs = |a: &[u8], b: &[u8], max_ratio, mutual| -> Vec<(usize, usize)> {
        let options = SiftMatchOptions { max_ratio, mutual };
        match_sift(&labelled(a), &labelled(b), &options).unwrap().iter().map(|m| (m.a, m.b)).collect()
    };
    // 10 is 1 from 11 and 20 from 30; 34 is 4 from 30 and 23 from 11.
    assert_eq!(pairs(&[10, 34], &[11, 30], 0.8, true), [(0, 0), (1, 1)]);
    assert_eq!(pairs(&[10, 34], &[11, 30], 0.1, true), [(0, 0)]);
    // Both of the first are nearest to 11, which is nearer to 12.
    assert_eq!(pairs(&[8, 12], &[11, 50], 0.8, false), [(0, 0), (1, 0)]);
    assert_eq!(pairs(&[8, 12], &[11, 50], 0.8, true), [(1, 0)]);
    // Twins, even exact ones, are told apart by nothing.
    assert_eq!(pairs(&[10], &[10, 10], 0.99, true), []);
    assert_eq!(pairs(&[10], &[10, 10], 1.0, true), [(0, 0)]);
    // Without a second nearest there is no ratio.
    assert_eq!(pairs(&[10], &[10], 0.8, true), []);
    assert_eq!(pairs(&[10], &[10], 1.0, true), [(0, 0)]);
    assert_eq!(pairs(&[], &[1, 2], 1.0, true), []);
    assert_eq!(pairs(&[1, 2], &[], 1.0, false), []);
    let found = match_sift(&labelled(&[10]), &labelled(&[50, 13]), &SiftMatchOptions::default()).unwrap();
    assert_eq!(found, [SiftMatch { a: 0, b: 1, distance: 3.0, ratio: 3.0 / 40.0 }]);
    for max_ratio in [0.0, -1.0, 1.1, f64::NAN, f64::INFINITY] {
        let options = SiftMatchOptions { max_ratio, mutual: true };
        let answer = match_sift(&labelled(&[1]), &labelled(&[2]), &options);
        assert_eq!(answer.unwrap_err().status(), Status::InvalidArgument);
    }
}

/// Against the eigenvectors of the curvature's matrix.
#[test]
fn a_keypoint_is_elongated_along_its_lesser_curvature() {
    for (i, sign) in [(0, 1.0), (1, 1.0), (2, -1.0), (3, -1.0), (4, 1.0), (5, -1.0)] {
        let angle = -1.4 + 0.55 * f64::from(i);
        let along = Vector2::new(angle.cos(), angle.sin());
        let across = Vector2::new(-along.y, along.x);
        let h = (along * along.transpose() * 0.5 + across * across.transpose() * 4.5) * sign;
        let (elongation, direction) = elongation([h.m11, h.m12, h.m22]);
        assert!((elongation - 3.0).abs() < 1e-12);
        assert!((direction - angle).sin().abs() < 1e-12 && direction.abs() <= FRAC_PI_2, "{direction} {angle}");
        let k = SiftKeypoint { elongation, direction, ..keypoint(1.0) };
        // The inverse curvature, in units of the greater one's.
        assert!((k.shape() - h.try_inverse().unwrap() * (4.5 * sign)).amax() < 1e-9);
    }
    assert_eq!(super::elongation([2.0, 0.0, 2.0]).0, 1.0);
}
