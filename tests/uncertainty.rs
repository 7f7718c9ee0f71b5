//! Projection and back-projection with covariances: against finite differences of the camera alone, and
//! by coverage over repeated calibrations.

#[path = "support/thesis.rs"]
mod thesis;

use nalgebra::{DMatrix, Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::calibrate::{Calibration, CalibrationOptions, DistortionModel, calibrate_camera};
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Plane, Rigid, rigid};
use thesis::{Noise, far, near, point_set, world};

/// The floor of the simulated room.
fn floor() -> Plane {
    Plane::new(Vector3::y(), 1.2).unwrap()
}

fn lenses() -> [(Distortion, DistortionModel); 4] {
    [
        (Distortion::None, DistortionModel::None),
        (Distortion::BrownConrady([-0.28, 0.09, 0.001, -0.0005, 0.01]), DistortionModel::BrownConrady),
        (Distortion::Division(-0.22), DistortionModel::Division),
        (Distortion::Fisheye([-0.05, 0.01, 0.0, 0.0]), DistortionModel::Fisheye),
    ]
}

fn calibrated(truth: &Camera, model: DistortionModel, n: usize, seed: u64) -> Calibration {
    let set = point_set(&world(truth, n), 0.5, &mut Noise::new(seed));
    let options = CalibrationOptions {
        distortion: model,
        skew_sigma: f64::INFINITY,
        aspect_sigma: f64::INFINITY,
        pixel_sigma: Some(0.5),
        robust: false,
        max_focal_deviation: f64::INFINITY,
        ..Default::default()
    };
    calibrate_camera(&set, &options).unwrap()
}

/// The camera with its parameters, in the order of the covariance, moved.
fn moved(camera: &Camera, i: usize, step: f64) -> Camera {
    let k = camera.distortion.coefficients().len();
    let mut delta = vec![0.0; 11 + k];
    delta[i] = step;
    let mut c = *camera;
    let values = camera.intrinsics.to_array();
    c.intrinsics = Intrinsics::from_array(std::array::from_fn(|i| values[i] + delta[i]));
    c.distortion.coefficients_mut().iter_mut().zip(&delta[5..]).for_each(|(c, d)| *c += d);
    let turn = rigid::exp(&Vector3::new(delta[5 + k], delta[6 + k], delta[7 + k])) * camera.pose.rotation;
    c.pose = Rigid::from_centre(turn, &(camera.centre() + Vector3::new(delta[8 + k], delta[9 + k], delta[10 + k])));
    c
}

/// J C J^T with J by central differences.
fn numeric<const N: usize>(c: &Calibration, f: impl Fn(&Camera) -> SVector<f64, N>) -> SMatrix<f64, N, N> {
    let p = c.covariance.nrows();
    let mut j = DMatrix::zeros(N, p);
    for i in 0..p {
        let step = if i < 5 { 1e-3 } else { 1e-6 };
        let d = (f(&moved(&c.camera, i, step)) - f(&moved(&c.camera, i, -step))) / (2.0 * step);
        j.column_mut(i).copy_from(&d);
    }
    let sum = &j * &c.covariance * j.transpose();
    SMatrix::from_fn(|i, k| sum[(i, k)])
}

fn close<const N: usize>(a: &SMatrix<f64, N, N>, b: &SMatrix<f64, N, N>, what: &str) {
    let scale = SVector::<f64, N>::from_fn(|i, _| b[(i, i)].abs().sqrt().max(1e-3 * b.amax().sqrt()));
    for i in 0..N {
        for k in 0..N {
            let off = (a[(i, k)] - b[(i, k)]).abs() / (scale[i] * scale[k]);
            assert!(off < 1e-5, "{what}: ({i}, {k}) {} {}", a[(i, k)], b[(i, k)]);
        }
    }
}

#[test]
fn covariances_are_those_of_finite_differences() {
    for (lens, model) in lenses() {
        for truth in [near(), far()].map(|c| Camera { distortion: lens, ..c }) {
            let c = calibrated(&truth, model, 100, 3);
            let point = world(&truth, 3)[2].point;
            let seen = c.project(&point, None).unwrap();
            // Two ways to round the same projection.
            assert!((seen.pixel - c.camera.project(&point).unwrap()).norm() < 1e-10);
            close(&seen.covariance, &numeric(&c, |camera| camera.project(&point).unwrap()), "pixel");

            for pixel in [Vector2::new(90.0, 420.0), Vector2::new(700.5, 560.0), Vector2::new(400.0, 500.0)] {
                let seen = c.back_project(&pixel, None).unwrap();
                let ray = |camera: &Camera| {
                    let ray = camera.back_project(&pixel).unwrap();
                    SVector::<f64, 6>::from_iterator(ray.origin.iter().chain(&ray.direction).copied())
                };
                close(&seen.covariance, &numeric(&c, ray), "ray");
                let at = |camera: &Camera| camera.back_project(&pixel).unwrap().at(2.5);
                close(&seen.point_at(2.5, 0.0).unwrap().covariance, &numeric(&c, at), "point at a distance");
                let on_floor = |camera: &Camera| floor().intersect_ray(&camera.back_project(&pixel).unwrap()).unwrap();
                let hit = seen.intersect(&floor()).unwrap();
                assert!((hit.point - on_floor(&c.camera)).norm() < 1e-12);
                close(&hit.covariance, &numeric(&c, on_floor), "point on the floor");
            }
        }
    }
}

#[test]
fn what_the_caller_is_unsure_of_is_added() {
    let c = calibrated(&near(), DistortionModel::None, 100, 3);
    let (point, pixel) = (Vector3::new(0.2, 0.1, 3.0), Vector2::new(300.0, 450.0));
    let of_point = Matrix3::new(4.0, 1.0, 0.0, 1.0, 3.0, -1.0, 0.0, -1.0, 9.0) * 1e-4;
    let of_pixel = Matrix2::new(2.0, 0.5, 0.5, 1.0);
    let gained = c.project(&point, Some(&of_point)).unwrap().covariance - c.project(&point, None).unwrap().covariance;
    let h = 1e-6;
    let j = SMatrix::<f64, 2, 3>::from_columns(&[0, 1, 2].map(|i| {
        let e = Vector3::ith(i, h);
        (c.camera.project(&(point + e)).unwrap() - c.camera.project(&(point - e)).unwrap()) / (2.0 * h)
    }));
    close(&gained, &(j * of_point * j.transpose()), "point");
    let floor = floor();
    let click = |m: &Vector2<f64>| floor.intersect_ray(&c.camera.back_project(m).unwrap()).unwrap();
    let with = c.back_project(&pixel, Some(&of_pixel)).unwrap().intersect(&floor).unwrap().covariance;
    let without = c.back_project(&pixel, None).unwrap().intersect(&floor).unwrap().covariance;
    let h = 1e-4;
    let j = SMatrix::<f64, 3, 2>::from_columns(&[0, 1].map(|i| {
        let e = Vector2::ith(i, h);
        (click(&(pixel + e)) - click(&(pixel - e))) / (2.0 * h)
    }));
    close(&(with - without), &(j * of_pixel * j.transpose()), "click");
    // A distance of its own noise lengthens the ellipsoid along the ray only.
    let ray = c.back_project(&pixel, None).unwrap();
    let gained = ray.point_at(2.0, 0.01).unwrap().covariance - ray.point_at(2.0, 0.0).unwrap().covariance;
    close(&gained, &(ray.ray.direction * ray.ray.direction.transpose() * 0.01), "distance");
}

/// 95 % of a chi-square variable with two degrees of freedom.
const CHI2_95: f64 = 5.991;

fn inside(off: &Vector2<f64>, covariance: &Matrix2<f64>) -> f64 {
    let distance = off.dot(&(covariance.try_inverse().unwrap() * off));
    if distance <= CHI2_95 { 1.0 } else { 0.0 }
}

#[test]
fn ellipses_of_95_percent_hold_95_percent() {
    // Many calibrations of the same camera: how often is the truth inside what each of them says?
    let lens = Distortion::Division(-0.1);
    for truth in [near(), far()].map(|c| Camera { distortion: lens, ..c }) {
        let places: Vec<_> = world(&truth, 200)[100..140].iter().map(|s| s.point).collect();
        let clicks = [[150.0, 450.0], [400.0, 520.0], [650.0, 580.0], [300.0, 590.0]].map(Vector2::from);
        let (mut pixels, mut points, runs) = (0.0, 0.0, 1500);
        let mut noise = Noise::new(77);
        for run in 0..runs {
            let c = calibrated(&truth, DistortionModel::Division, 100, run);
            // One place a calibration, so that the trials are independent.
            let point = places[run as usize % places.len()];
            let seen = c.project(&point, None).unwrap();
            pixels += inside(&(seen.pixel - truth.project(&point).unwrap()), &seen.covariance);
            let click = clicks[run as usize % clicks.len()];
            let true_point = floor().intersect_ray(&truth.back_project(&click).unwrap()).unwrap();
            // Clicked with 1 px of noise.
            let found = c.back_project(&(click + noise.pixel(1.0)), Some(&Matrix2::identity())).unwrap();
            let found = found.intersect(&floor()).unwrap();
            let off = found.point - true_point;
            let covariance =
                Matrix2::new(found.covariance.m11, found.covariance.m13, found.covariance.m31, found.covariance.m33);
            points += inside(&Vector2::new(off.x, off.z), &covariance);
            assert!(found.covariance.m22.abs() < 1e-18, "nothing varies across the floor");
        }
        // 1500 trials: a scatter of 0.6 %.
        for (what, held) in [("pixels", pixels), ("points on the floor", points)] {
            let held = held / runs as f64;
            assert!((0.93..=0.97).contains(&held), "{what}: {held}");
        }
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let c = calibrated(&near(), DistortionModel::None, 100, 3);
    let (front, pixel) = (Vector3::new(0.0, 0.0, 3.0), Vector2::new(400.0, 300.0));
    assert_eq!(c.project(&-front, None), Err(Error::BehindCamera { index: 0 }));
    assert_eq!(c.project(&(front * f64::NAN), None), Err(Error::NotFinite { name: "xyz", index: 0 }));
    let name = |e: Result<(), Error>| match e {
        Err(Error::InvalidArgument { name, .. } | Error::NotFinite { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    for bad in [Matrix3::identity() * -1.0, Matrix3::repeat(1.0) - Matrix3::identity(), Matrix3::repeat(f64::NAN)] {
        assert_eq!(name(c.project(&front, Some(&bad)).map(|_| ())), "xyz covariance");
    }
    let lopsided = Matrix2::new(1.0, 0.5, -0.5, 1.0);
    assert_eq!(name(c.back_project(&pixel, Some(&lopsided)).map(|_| ())), "uv covariance");
    assert_eq!(name(c.back_project(&(pixel * f64::INFINITY), None).map(|_| ())), "uv");
    let ray = c.back_project(&pixel, Some(&Matrix2::zeros())).unwrap();
    assert_eq!(ray, c.back_project(&pixel, None).unwrap());
    for (distance, variance) in [(0.0, 0.0), (-1.0, 0.0), (1.0, -1.0), (f64::NAN, 0.0), (1.0, f64::INFINITY)] {
        assert_eq!(name(ray.point_at(distance, variance).map(|_| ())), "distance");
    }
    // The horizon and above: the floor is not there.
    assert!(c.back_project(&Vector2::new(400.0, -500.0), None).unwrap().intersect(&floor()).is_none());
    let lens = Distortion::BrownConrady([-0.3, 0.0, 0.0, 0.0, 0.0]);
    let folding = Calibration { camera: Camera { distortion: lens, ..c.camera }, ..c };
    assert_eq!(folding.back_project(&Vector2::new(4000.0, 300.0), None), Err(Error::OutsideLens { index: 0 }));
}
