//! Hostile input to the calibration: whatever comes, an answer or an error in bounded time.

#[path = "support/thesis.rs"]
mod thesis;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::calibrate::{
    CalibrationOptions, Correspondences, DistortionModel, Observation, ObservedLine, calibrate_camera,
};
use ptzcal::geometry::{Distortion, Intrinsics, InverseDepthPoint};
use thesis::Noise;

/// A number from a mixture of the ordinary and the extreme.
fn value(noise: &mut Noise) -> f64 {
    match (noise.uniform() * 14.0) as u32 {
        0 => 0.0,
        1 => 1e12 * (noise.uniform() - 0.5),
        2 => 1e-12 * noise.gaussian(),
        3 => 1e-300,
        4 => (noise.uniform() * 5.0).floor(),
        _ => noise.gaussian() * 10f64.powf(noise.uniform() * 6.0 - 2.0),
    }
}

fn vector(noise: &mut Noise) -> Vector3<f64> {
    Vector3::new(value(noise), value(noise), value(noise))
}

fn observation(noise: &mut Noise, sane: f64) -> Observation {
    let sane_now = noise.uniform() < sane;
    let pixel = if sane_now {
        Vector2::new(noise.uniform() * 800.0, noise.uniform() * 600.0)
    } else {
        Vector2::new(value(noise), value(noise))
    };
    let covariance = Matrix2::identity() * 10f64.powf(noise.uniform() * 20.0 - 10.0);
    match (noise.uniform() * 4.0) as u32 {
        0 => Observation::Point { world: vector(noise), world_covariance: None, pixel, pixel_covariance: None },
        1 => {
            let e = vector(noise);
            Observation::Point {
                world: vector(noise),
                world_covariance: Some(e * e.transpose() + Matrix3::identity() * noise.uniform()),
                pixel,
                pixel_covariance: Some(covariance),
            }
        }
        2 => {
            let end = if sane_now { pixel.yx() + Vector2::new(30.0, 0.0) } else { vector(noise).xy() };
            let covariances = (noise.uniform() < 0.5).then(|| [Matrix3::identity() * noise.uniform(); 2]);
            ObservedLine::through([vector(noise), vector(noise)], covariances, [pixel, end]).into()
        }
        _ => Observation::Shot {
            shot: InverseDepthPoint {
                origin: vector(noise),
                direction: vector(noise),
                rho: value(noise),
                variance: value(noise).abs() + 1e-9,
            },
            pixel,
            pixel_covariance: covariance,
        },
    }
}

#[test]
fn random_nonsense_never_panics_hangs_or_returns_nan() {
    let (mut answers, mut refusals) = (0, 0);
    for seed in 0..600 {
        let mut noise = Noise::new(seed);
        let mut set = Correspondences::new(800, 600).unwrap();
        let n = (noise.uniform() * 40.0) as usize;
        let sane = noise.uniform();
        for _ in 0..n {
            let _ = set.add(observation(&mut noise, sane));
        }
        let distortion = [
            DistortionModel::None,
            DistortionModel::Radial1,
            DistortionModel::Radial2,
            DistortionModel::BrownConrady,
            DistortionModel::Division,
            DistortionModel::Fisheye,
        ][(seed % 6) as usize];
        let lens = (Intrinsics::new(500.0, 400.0, 300.0), Distortion::Division(-0.1));
        let options = CalibrationOptions {
            distortion,
            robust: seed % 3 != 0,
            fixed_lens: (seed % 7 == 0).then_some(lens),
            skew_sigma: [0.0, 1e-3, f64::INFINITY][(seed % 3) as usize],
            aspect_sigma: [0.0, 1e-3, f64::INFINITY][(seed / 3 % 3) as usize],
            pixel_sigma: (seed % 2 == 0).then_some(0.5),
            ..Default::default()
        };
        match calibrate_camera(&set, &options) {
            Ok(c) => {
                answers += 1;
                assert!(c.camera.validate().is_ok(), "{seed}: {:?}", c.camera);
                assert!(c.covariance.iter().all(|v| v.is_finite()), "{seed}");
                assert!(c.residuals.iter().all(|r| !r.x.is_nan() && !r.y.is_nan()), "{seed}");
                assert!(c.rms.is_finite() && c.condition.is_finite());
            }
            Err(Error::Internal { reason }) => panic!("{seed}: {reason}"),
            Err(_) => refusals += 1,
        }
    }
    println!("{answers} answers, {refusals} refusals");
    assert!(refusals > 500);
}

#[test]
fn what_is_not_finite_or_not_positive_is_refused_with_its_index() {
    let mut set = Correspondences::new(800, 600).unwrap();
    let ok = Vector3::new(1.0, 2.0, 3.0);
    set.add_points(&[ok], &[Vector2::zeros()]).unwrap();
    let e = set.add_points(&[ok, Vector3::new(0.0, f64::NAN, 0.0)], &[Vector2::zeros(); 2]).unwrap_err();
    assert_eq!(e, Error::NotFinite { name: "xyz", index: 2 });
    assert_eq!(set.len(), 1, "all or nothing");
    let e = set.add_points(&[ok], &[Vector2::new(f64::INFINITY, 0.0)]).unwrap_err();
    assert_eq!(e, Error::NotFinite { name: "uv", index: 1 });
    assert!(set.add_points(&[ok * 1e13], &[Vector2::zeros()]).is_err());
    assert!(set.add_points(&[ok, ok], &[Vector2::zeros()]).is_err());
    let weighted = |world_covariance, pixel_covariance| Observation::Point {
        world: ok,
        world_covariance,
        pixel: Vector2::zeros(),
        pixel_covariance,
    };
    assert!(set.add(weighted(Some(Matrix3::identity() * -1.0), None)).is_err());
    assert!(set.add(weighted(None, Some(Matrix2::zeros()))).is_err());
    assert!(set.add(weighted(Some(Matrix3::zeros()), Some(Matrix2::identity()))).is_ok());
    assert!(Correspondences::new(0, 600).is_err());
    assert!(Correspondences::new(800, 1 << 20).is_err());
}

#[test]
fn bad_options_are_named() {
    let set = thesis::point_set(&thesis::world(&thesis::near(), 30), 0.1, &mut Noise::new(1));
    let named = |options: CalibrationOptions| match calibrate_camera(&set, &options) {
        Err(Error::InvalidArgument { name, .. } | Error::NotFinite { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    let base = CalibrationOptions::default;
    assert_eq!(named(CalibrationOptions { skew_sigma: -1.0, ..base() }), "skew_sigma");
    assert_eq!(named(CalibrationOptions { aspect_sigma: f64::NAN, ..base() }), "aspect_sigma");
    assert_eq!(named(CalibrationOptions { pixel_sigma: Some(0.0), ..base() }), "pixel_sigma");
    assert_eq!(named(CalibrationOptions { max_iterations: 0, ..base() }), "max_iterations");
    let lens = (Intrinsics::new(-5.0, 0.0, 0.0), Distortion::None);
    assert_eq!(named(CalibrationOptions { fixed_lens: Some(lens), ..base() }), "intrinsics");
}
