//! Simulated pairs: the covariance covers the truth. What is no input is refused.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::lift::lift;
use super::robust::RobustFit;
use super::*;
use crate::calibrate::CalibrationOptions;
use crate::error::Status;
use crate::geometry::{Distortion, Intrinsics, Rigid, rigid};
use crate::image::{DepthNoise, Image, InverseDepth, PixelFormat};

struct Noise(ChaCha8Rng);

impl Noise {
    /// In [0, 1).
    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let (a, b) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }

    /// Two numbers of Student's t with four degrees of freedom, scale 1.
    fn student(&mut self) -> Vector2<f64> {
        let chi2: f64 = (0..4).map(|_| self.normal().powi(2)).sum();
        Vector2::new(self.normal(), self.normal()) / (chi2 / 4.0).sqrt()
    }
}

fn camera(pose: Rigid) -> Camera {
    Camera {
        width: 640,
        height: 480,
        intrinsics: Intrinsics::new(520.0, 318.0, 242.0),
        distortion: Distortion::None,
        pose,
    }
}

/// Pairs of a scene 1 to 4 m away: the fixed camera half a metre aside, errors as the fit takes them.
fn pairs(noise: &mut Noise, fixed: &Camera, scale: f64) -> Vec<PointPair> {
    let auxiliary = camera(Rigid::identity());
    let depth_noise = DepthNoise::default();
    let mut points = Vec::new();
    while points.len() < 150 {
        let pixel = Vector2::new(640.0 * noise.uniform(), 480.0 * noise.uniform());
        let z = 1.0 + 3.0 * noise.uniform();
        let world = auxiliary.back_project(&pixel).unwrap();
        let world = world.origin + world.direction * (z / world.direction.z);
        let Some(seen) = fixed.project(&world).filter(|p| fixed.contains(p)) else { continue };
        let (elongation, direction) = (1.0 + 2.0 * noise.uniform(), 3.0 * noise.uniform());
        let along = Vector2::new(f64::cos(direction), f64::sin(direction));
        let root = Matrix2::identity() + along * along.transpose() * (elongation - 1.0);
        let shape = root * root;
        let variance = depth_noise.variance(1.0 / z);
        let depth = InverseDepth { rho: 1.0 / z + variance.sqrt() * noise.normal(), variance };
        let lifted = lift(&auxiliary, &(pixel + root * noise.student() * scale), &shape, &depth).unwrap();
        points.push(PointPair { view: 0, lifted, fixed: seen + root * noise.student() * scale, shape });
    }
    points
}

/// The estimates' errors over what their covariance says: 1 where it is right. The sum of two t errors
/// has thinner tails than one, so that it is a little on the safe side.
#[test]
fn the_covariance_covers_the_truth() {
    let mut noise = Noise(ChaCha8Rng::seed_from_u64(4));
    let pose = Rigid::look_at(&Vector3::new(0.5, -0.1, 0.2), &Vector3::new(0.0, 0.0, 3.0)).unwrap();
    let truth = camera(pose);
    let options = CalibrationOptions::default();
    let fit = RobustFit { size: [640, 480], options: &options, estimate: true };
    let (mut sum, mut sigmas, mut count) = (0.0, 0.0, 0.0);
    for _ in 0..60 {
        let points = pairs(&mut noise, &truth, 0.3);
        let Fitted { calibration: found, sigma, .. } = fit.run(&points, &[], 0.7).unwrap();
        let k = |c: &Camera| c.intrinsics.to_array();
        let turn = rigid::log(&(truth.pose.rotation * found.camera.pose.rotation.transpose()));
        let mut error = DVector::zeros(11);
        for i in 0..5 {
            error[i] = k(&truth)[i] - k(&found.camera)[i];
        }
        error.rows_mut(5, 3).copy_from(&turn);
        error.rows_mut(8, 3).copy_from(&(truth.pose.centre() - found.camera.pose.centre()));
        // Without the skew, whose prior is its own.
        let kept: Vec<usize> = (0..11).filter(|i| *i != 2).collect();
        let covariance = DMatrix::from_fn(10, 10, |r, c| found.covariance[(kept[r], kept[c])]);
        let error = DVector::from_fn(10, |r, _| error[kept[r]]);
        sum += error.dot(&covariance.cholesky().unwrap().solve(&error)) / 10.0;
        sigmas += sigma;
        count += 1.0;
    }
    let (ratio, sigma) = ((sum / count).sqrt(), sigmas / count);
    assert!((0.8..1.1).contains(&ratio), "{ratio}");
    // Of scale 0.3, a standard deviation of 0.42.
    assert!((0.36..0.46).contains(&sigma), "{sigma}");
}

fn grey(width: u32, height: u32, value: impl Fn(u32, u32) -> u8) -> Image {
    let mut image = Image::new(PixelFormat::Gray8, width, height);
    image.data.iter_mut().enumerate().for_each(|(i, v)| *v = value(i as u32 % width, i as u32 / width));
    image
}

/// Blobs in all places of a grid that a hash picks.
fn blobs(width: u32, height: u32) -> Image {
    grey(width, height, |x, y| {
        let cell = (x / 12).wrapping_mul(2_654_435_761) ^ (y / 12).wrapping_mul(40_503);
        ((cell.wrapping_mul(2_246_822_519) >> 16) & 0xff) as u8
    })
}

#[test]
fn views_that_do_not_fit_together_are_refused() {
    let image = blobs(64, 48);
    let view = image.view().unwrap();
    let options = RgbdOptions::default();
    let fails = |options: &RgbdOptions| RgbdCalibrator::new(&view, *options).unwrap_err().to_string();
    let bad = RgbdOptions { keypoint_sigma: Some(-1.0), ..options };
    assert!(fails(&bad).starts_with("keypoint_sigma"));
    let bad = RgbdOptions { depth_noise: DepthNoise { inverse_depth: f64::NAN, depth: 0.0 }, ..options };
    assert!(fails(&bad).starts_with("inverse_depth_sigma"));
    let mut bad = options;
    bad.matching.max_ratio = 0.0;
    assert!(fails(&bad).starts_with("max_ratio"));
    let dot = grey(1, 1, |_, _| 7);
    assert_eq!(RgbdCalibrator::new(&dot.view().unwrap(), options).unwrap_err().status(), Status::InvalidArgument);

    let mut calibrator = RgbdCalibrator::new(&view, options).unwrap();
    let depth = DepthMap::new(64, 48, vec![2.0; 64 * 48]).unwrap();
    let own = Camera { width: 64, height: 48, ..camera(Rigid::identity()) };
    let other = DepthMap::new(48, 64, vec![2.0; 64 * 48]).unwrap();
    assert!(calibrator.add_view(&view, &other, &own).unwrap_err().to_string().starts_with("depth"));
    assert!(
        calibrator.add_view(&view, &depth, &camera(Rigid::identity())).unwrap_err().to_string().starts_with("camera")
    );
    let mut broken = own;
    broken.intrinsics.fx = f64::NAN;
    assert!(calibrator.add_view(&view, &depth, &broken).is_err());
    // Nothing was added by all that.
    let e = calibrator.calibrate(&CalibrationOptions::default()).unwrap_err();
    assert_eq!(e.status(), Status::TooFewPoints);
    assert!(e.to_string().contains("0 auxiliary"), "{e}");
}

#[test]
fn too_little_in_common_says_what_there_is() {
    let image = blobs(240, 180);
    let view = image.view().unwrap();
    let own = Camera { width: 240, height: 180, ..camera(Rigid::identity()) };
    let refused = |colour: &Image, metres: f32| {
        let mut calibrator = RgbdCalibrator::new(&view, RgbdOptions::default()).unwrap();
        let depth = DepthMap::new(240, 180, vec![metres; 240 * 180]).unwrap();
        let counts = calibrator.add_view(&colour.view().unwrap(), &depth, &own).unwrap();
        (counts, calibrator.calibrate(&CalibrationOptions::default()).unwrap_err())
    };
    let (counts, e) = refused(&grey(240, 180, |_, _| 90), 2.0);
    assert_eq!((counts.features, e.status()), (0, Status::TooFewPoints));
    let (counts, e) = refused(&image, f32::NAN);
    assert!(counts.matches > 20 && counts.with_depth == 0, "{counts:?}");
    assert!(e.to_string().contains("0 of them with depth"), "{e}");
    // The same image on a wall: no relief, whatever the number of pairs.
    let (counts, e) = refused(&image, 2.0);
    assert!(counts.pairs > 20);
    assert_eq!(e.status(), Status::Degenerate, "{e}");
}
