//! Lines through points in space: covariance, outliers, and what is refused.

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector4};
use ptzcal::Error;
use ptzcal::geometry::MeasuredLine;
use ptzcal::pose::{LineFitOptions, PointNoise, fit_line_3d};

use crate::random::Random;

/// Error of a line in the four directions in which it has one, and its covariance there.
fn nees(found: &MeasuredLine, point: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
    let d = found.direction;
    let e = d.cross(&Vector3::ith(d.iamin(), 1.0)).normalize();
    let across = [e, d.cross(&e)];
    // The true line where it passes the plane across the found line's point.
    let at = point + direction * ((found.point - point).dot(&d) / direction.dot(&d));
    let turned = direction / direction.dot(&d);
    let error = Vector4::from_fn(|i, _| {
        let off = if i < 2 { found.point - at } else { d - turned };
        across[i % 2].dot(&off)
    });
    let mut basis = SMatrix::<f64, 4, 6>::zeros();
    for i in 0..4 {
        basis.fixed_view_mut::<1, 3>(i, 3 * (i / 2)).copy_from(&across[i % 2].transpose());
    }
    let covariance = basis * found.covariance * basis.transpose();
    error.dot(&(covariance.try_inverse().unwrap() * error))
}

/// Points of a line as a depth camera at the origin sees them: good across the ray, bad along it and the
/// worse the farther.
fn depth_points(random: &mut Random, n: usize, wrong: f64) -> (Vec<Vector3<f64>>, Vec<Matrix3<f64>>) {
    let [a, b] = [Vector3::new(-1.0, 0.4, 1.5), Vector3::new(1.2, -0.2, 5.0)];
    let mut points = Vec::new();
    let mut covariances = Vec::new();
    for i in 0..n {
        let x = a + (b - a) * ((i as f64 + 0.5) / n as f64);
        let ray = x / x.z;
        let (along, across) = (0.0015 * x.z * x.z, 0.0005 * x.z);
        let c = ray * ray.transpose() * (along * along) + Matrix3::identity() * (across * across);
        let noise = ray * (along * random.gaussian()) + Vector3::from_fn(|_, _| across * random.gaussian());
        // Mixed with what is a metre and more behind.
        let behind = if random.uniform() < wrong { ray * (0.3 + 1.5 * random.uniform()) } else { Vector3::zeros() };
        points.push(x + noise + behind);
        covariances.push(c);
    }
    (points, covariances)
}

#[test]
fn covariances_hold_with_and_without_outliers() {
    let direction = Vector3::new(2.2, -0.6, 3.5).normalize();
    for (n, wrong) in [(30, 0.0), (100, 0.4), (10, 0.0)] {
        let runs = 300;
        let mut random = Random::new(5);
        let mut sum = 0.0;
        for seed in 0..runs {
            let (points, covariances) = depth_points(&mut random, n, wrong);
            let options = LineFitOptions { seed, ..Default::default() };
            let fit = fit_line_3d(&points, PointNoise::Each(&covariances), &options).unwrap();
            let sign = fit.line.direction.dot(&direction).signum();
            sum += nees(&fit.line, &Vector3::new(-1.0, 0.4, 1.5), &(direction * sign));
        }
        // Four degrees of freedom: the mean of 300 is good to 4 %; inliers beyond the threshold are lost.
        let mean = sum / runs as f64 / 4.0;
        println!("{n} points, {wrong} wrong: NEES / 4 = {mean:.3}");
        assert!((0.85..1.15).contains(&mean), "{n} {wrong}: {mean}");
    }
}

#[test]
fn of_two_lines_the_one_with_more_points_is_taken() {
    let mut random = Random::new(2);
    let mut points = Vec::new();
    for i in 0..60 {
        let s = f64::from(i) / 60.0;
        // Every third point lies on the surface behind.
        let y = if i % 3 == 0 { 0.5 } else { 0.0 };
        points.push(Vector3::new(s, y, 2.0 + 2.0 * y) + Vector3::from_fn(|_, _| 0.002 * random.gaussian()));
    }
    let fit = fit_line_3d(&points, PointNoise::Same(0.002), &LineFitOptions::default()).unwrap();
    assert!(fit.line.direction.x.abs() > 0.9999 && fit.line.point.y.abs() < 0.002, "{:?}", fit.line);
    // One in a thousand of the right ones is beyond 3.7 standard deviations.
    let count =
        |wrong: bool| fit.inliers.iter().enumerate().filter(|(i, used)| **used && (i % 3 == 0) == wrong).count();
    assert!(count(true) == 0 && count(false) >= 38, "{} {}", count(true), count(false));
    let [from, to] = fit.line.extent;
    assert!((to - from - 58.0 / 60.0).abs() < 0.02 && (from + to).abs() < 0.1, "{from} {to}");
}

#[test]
fn noise_that_is_larger_than_stated_is_believed() {
    let mut random = Random::new(3);
    let points: Vec<_> =
        (0..50).map(|i| Vector3::new(f64::from(i) * 0.02, 0.0, 3.0).map(|v| v + 0.01 * random.gaussian())).collect();
    let options = LineFitOptions { robust: false, ..Default::default() };
    let fit = |sigma| fit_line_3d(&points, PointNoise::Same(sigma), &options).unwrap();
    let (right, wrong) = (fit(0.01), fit(0.002));
    let size = |c: &Matrix6<f64>| c.trace();
    let ratio = size(&wrong.line.covariance) / size(&right.line.covariance);
    assert!((0.6..1.6).contains(&ratio), "{ratio}");
    assert!((wrong.chi_square / right.chi_square / 25.0 - 1.0).abs() < 1e-6);
}

#[test]
fn what_is_no_line_is_refused() {
    let options = LineFitOptions::default();
    let same = PointNoise::Same(0.01);
    let nan = Vector3::new(0.0, f64::NAN, 1.0);
    let [a, b] = [Vector3::zeros(), Vector3::new(1.0, 2.0, 3.0)];
    let few = |points: &[Vector3<f64>]| matches!(fit_line_3d(points, same, &options), Err(Error::TooFewPoints { .. }));
    assert!(few(&[]) && few(&[a]) && few(&[a, nan, nan]));
    // Two points are a line without redundancy; what has no depth is passed over.
    let fit = fit_line_3d(&[a, nan, b], same, &options).unwrap();
    assert_eq!((fit.degrees_of_freedom, fit.inliers), (0, vec![true, false, true]));
    let degenerate =
        |points: &[Vector3<f64>]| matches!(fit_line_3d(points, same, &options), Err(Error::Degenerate { .. }));
    let mut random = Random::new(4);
    let blob: Vec<_> = (0..40).map(|_| Vector3::from_fn(|_, _| 0.01 * random.gaussian())).collect();
    assert!(degenerate(&[b, b]) && degenerate(&[b; 20]) && degenerate(&blob));
    // A cube full of points: no line has a third of them.
    let cube: Vec<_> = (0..200).map(|_| Vector3::from_fn(|_, _| random.uniform())).collect();
    assert!(matches!(fit_line_3d(&cube, same, &options), Err(Error::NoConsensus { .. })));
    let invalid =
        |noise: PointNoise<'_>| matches!(fit_line_3d(&[a, b], noise, &options), Err(Error::InvalidArgument { .. }));
    assert!(invalid(PointNoise::Same(0.0)) && invalid(PointNoise::Same(f64::NAN)) && invalid(PointNoise::Same(1e-200)));
    let one = Matrix3::identity();
    assert!(invalid(PointNoise::Each(&[one])) && invalid(PointNoise::Each(&[one, one * 0.0])));
    assert!(invalid(PointNoise::Each(&[one, one * f64::NAN])) && invalid(PointNoise::Each(&[one, -one])));
    for bad in [
        LineFitOptions { outlier_threshold: 0.0, ..options.clone() },
        LineFitOptions { outlier_threshold: f64::NAN, ..options.clone() },
        LineFitOptions { min_inliers: -0.1, ..options.clone() },
        LineFitOptions { min_inliers: f64::NAN, ..options.clone() },
    ] {
        assert!(matches!(fit_line_3d(&[a, b], same, &bad), Err(Error::InvalidArgument { .. })), "{bad:?}");
    }
}
