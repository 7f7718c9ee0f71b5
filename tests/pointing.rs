//! Pointing: coverage of its ellipses over many independently calibrated set-ups that nobody tuned to,
//! and every refusal.

#[path = "support/pointing.rs"]
mod setups;
#[path = "support/thesis.rs"]
mod thesis;

use nalgebra::{DMatrix, Matrix3, Matrix6, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::calibrate::{Calibration, FitCheck};
use ptzcal::device::PtzCapabilities;
use ptzcal::geometry::zoom_curve::ZoomNode;
use ptzcal::geometry::{Camera, Intrinsics, Plane, Ray, Rigid, ZoomCurve};
use ptzcal::pointing::{AimOptions, Click, CloudSurface, Depth, MeasuredBy, PointNoise, Pointer, UncertainPlane};
use setups::{Coverage, Setup};
use thesis::{near, rig};

/// `PTZCAL_POINTING_SETUPS=400` for the figures of the README.
fn set_ups() -> u64 {
    std::env::var("PTZCAL_POINTING_SETUPS").ok().and_then(|n| n.parse().ok()).unwrap_or(40)
}

#[test]
fn nineteen_of_twenty_clicks_are_inside_the_stated_ellipse() {
    let mut all = [Coverage::default(); 6];
    for seed in 0..set_ups() {
        let setup = Setup::new(seed);
        all[0].add(setup.on_a_surveyed_plane(20));
        all[1].add(setup.on_a_measured_plane(20));
        all[2].add(setup.back_on_a_plane(20));
        all[3].add(setup.at_a_distance(20));
        all[4].add(setup.on_the_cloud(20, 1));
        if seed < 100 {
            all[5].add(setup.on_the_cloud(20, 3));
        }
    }
    let names = ["surveyed plane", "plane of this rig", "head to fixed", "distance", "cloud", "cloud, 3 x finer"];
    for (c, name) in all.iter().zip(names) {
        let share = c.inside as f64 / c.clicks as f64;
        println!("{name}: {share:.4} of {} inside; {} near edges, {} refused", c.clicks, c.edges, c.refused);
        // 95 %, four standard deviations of counting, and 2 % for silhouettes that a cloud does not show.
        let scatter = 4.0 * (0.95 * 0.05 / c.clicks as f64).sqrt();
        let bends = if name.starts_with("cloud") { 0.02 } else { 0.0 };
        assert!((share - 0.95).abs() < scatter + bends, "{name}: {share}");
    }
}

/// A camera known to 1 px or so.
fn pointer() -> Pointer {
    let mut covariance = DMatrix::zeros(11, 11);
    for (i, sigma) in [0.5, 0.5, 0.1, 0.5, 0.5, 5e-4, 5e-4, 5e-4, 1e-3, 1e-3, 1e-3].into_iter().enumerate() {
        covariance[(i, i)] = sigma * sigma;
    }
    Pointer::new(calibration(near(), covariance), rig()).unwrap()
}

fn calibration(camera: Camera, covariance: DMatrix<f64>) -> Calibration {
    Calibration {
        camera,
        covariance,
        residuals: Vec::new(),
        inliers: Vec::new(),
        rms: 0.0,
        noise_factor: 1.0,
        condition: 1.0,
        iterations: 0,
        check: FitCheck { chi2: 0.0, freedom: 0, probability: 1.0, suspects: Vec::new(), warnings: Vec::new() },
    }
}

fn floor() -> UncertainPlane {
    UncertainPlane::exact(Plane::new(Vector3::y(), 1.2).unwrap())
}

/// Zoom 0 to 1, 800 to 12,000 px, the lens's centre shifting by 8 px.
fn curve() -> ZoomCurve {
    let node = |i: i32| {
        let s = f64::from(i) / 4.0;
        let f = 800.0 * 15f64.powf(s);
        ZoomNode {
            zoom: s,
            intrinsics: Intrinsics::new(f, 360.0 + 8.0 * s, 288.0 - 5.0 * s),
            distortion: rig().distortion,
            laser: rig().laser,
        }
    };
    let nodes: Vec<ZoomNode> = (0..5).map(node).collect();
    let n = nodes.iter().map(|n| n.parameters().len()).sum();
    ZoomCurve::new([720, 576], nodes, DMatrix::identity(n, n) * 1e-8).unwrap()
}

#[test]
fn the_tightest_zoom_holds_the_target_and_no_tighter_one_does() {
    let mut pointer = pointer();
    let plane = floor();
    let click = Click::new(Vector2::new(420.0, 480.0), 1.0);
    let without = pointer.aim(&click, &Depth::Plane(&plane), &AimOptions::default()).unwrap();
    assert_eq!(without.zoom, None);
    pointer.set_zoom_curve(curve()).unwrap();
    let mut tightest = f64::INFINITY;
    for target_size in [0.0, 0.1, 0.3, 1.0] {
        let options = AimOptions { probability: 0.9, target_size };
        let aim = pointer.aim(&click, &Depth::Plane(&plane), &options).unwrap();
        let zoom = aim.zoom.unwrap();
        assert!(zoom <= tightest && (0.9..0.9001).contains(&aim.probability) || zoom == 1.0, "{aim:?}");
        tightest = zoom;
        // The picture's centre, wherever the lens's is at that zoom.
        let there = curve().at(zoom).unwrap().model;
        let model = ptzcal::geometry::RigModel { offsets: rig().offsets, encoders: rig().encoders, ..there };
        let seen = model.head_camera(aim.pan, aim.tilt).project(&aim.point.point).unwrap();
        assert!((seen - Vector2::new(359.5, 287.5)).norm() < 1e-6, "{seen}");
    }
    // A target that no picture holds: the widest, and its probability.
    let huge = AimOptions { probability: 0.9, target_size: 30.0 };
    let aim = pointer.aim(&click, &Depth::Plane(&plane), &huge).unwrap();
    assert_eq!((aim.zoom, aim.probability), (Some(0.0), 0.0));
}

#[test]
fn a_sweep_holds_every_depth_in_one_of_its_pictures() {
    let mut pointer = pointer();
    pointer.set_zoom_curve(curve()).unwrap();
    let click = Click::new(Vector2::new(500.0, 200.0), 1.0);
    for range in [[3.0, f64::INFINITY], [0.4, 50.0]] {
        let sweep = pointer.sweep(&click, range, &AimOptions::default()).unwrap();
        let ray = near().back_project(&click.pixel).unwrap();
        let there = curve().at(sweep.zoom.unwrap()).unwrap().model;
        let model = ptzcal::geometry::RigModel { offsets: rig().offsets, encoders: rig().encoders, ..there };
        for i in 0..200 {
            let distance = 1.0 / (1.0 / range[0] * (1.0 - f64::from(i) / 200.0) + 1e-6);
            let in_one = sweep.steps.iter().any(|[pan, tilt]| {
                let camera = model.head_camera(*pan, *tilt);
                camera.project(&ray.at(distance)).is_some_and(|p| camera.contains(&p))
            });
            assert!(in_one, "{range:?}: {distance} m, {:?}", sweep.steps);
        }
        assert!(sweep.probability >= 0.95, "{}", sweep.probability);
    }
    let wide = pointer.sweep(&click, [2.0, 10.0], &AimOptions::default()).unwrap();
    assert!(wide.steps == [wide.middle] && wide.curve.len() >= 17);
    for bad in [[0.0, 1.0], [2.0, 1.0], [-1.0, 5.0], [f64::NAN, 5.0], [f64::INFINITY, f64::INFINITY]] {
        assert!(pointer.sweep(&click, bad, &AimOptions::default()).is_err(), "{bad:?}");
    }
}

#[test]
fn clicks_that_mean_nothing_are_refused_with_the_reason() {
    let pointer = pointer();
    let plane = floor();
    let aim = |x: f64, y: f64| {
        pointer.aim(&Click::new(Vector2::new(x, y), 1.0), &Depth::Plane(&plane), &AimOptions::default())
    };
    let reason = |r: Result<ptzcal::pointing::Aim, Error>| r.unwrap_err().to_string();
    assert!(aim(400.0, 500.0).is_ok());
    // Above the floor's horizon, so near below it that the distance is anything, and outside.
    assert!(reason(aim(400.0, 100.0)).contains("horizon"));
    assert!(reason(aim(400.0, 286.0)).contains("horizon"));
    assert!(reason(aim(400.0, 600.0)).contains("outside the picture"));
    assert!(matches!(aim(f64::NAN, 1.0), Err(Error::NotFinite { .. })));
    let ceiling = UncertainPlane::exact(Plane::new(Vector3::y(), -20.0).unwrap());
    let click = Click::new(Vector2::new(400.0, 500.0), 1.0);
    let options = AimOptions::default();
    assert!(matches!(pointer.aim(&click, &Depth::Plane(&ceiling), &options), Err(Error::Unreachable { .. })));
    for (metres, sigma) in [(0.0, 0.0), (-1.0, 0.0), (1.0, -1.0), (f64::NAN, 0.0), (1.0, f64::INFINITY)] {
        assert!(pointer.aim(&click, &Depth::Distance { metres, sigma }, &options).is_err());
    }
    let mut slanted = floor();
    slanted.plane.normal *= 2.0;
    assert!(pointer.aim(&click, &Depth::Plane(&slanted), &options).is_err());
    for bad in [0.0, 1.0, f64::NAN] {
        let options = AimOptions { probability: bad, ..options };
        assert!(pointer.aim(&click, &Depth::Plane(&plane), &options).is_err());
    }
    // Set-ups that make no sense.
    let mut pointer = pointer;
    assert!(Pointer::new(calibration(near(), DMatrix::zeros(3, 3)), rig()).is_err());
    assert!(pointer.set_head_deviation([-1.0, 0.0]).is_err());
    assert!(pointer.set_head_deviation([f64::NAN, 0.0]).is_err());
    let mut mirror = Rigid::identity();
    mirror.rotation[(0, 0)] = -1.0;
    assert!(pointer.set_station(mirror, &Matrix6::zeros()).is_err());
    let narrow = PtzCapabilities { pan_range: [1.0, 1.1], tilt_range: [-1.0, 1.0], ..PtzCapabilities::default() };
    pointer.set_reach(&narrow).unwrap();
    assert!(matches!(pointer.aim(&click, &Depth::Plane(&plane), &options), Err(Error::Unreachable { .. })));
}

#[test]
fn a_cloud_answers_with_its_first_surface_or_not_at_all() {
    let grid = |z: f64, x0: f64, x1: f64, step: f64| {
        let steps = move |a: f64, b: f64| (0..=((b - a) / step).round() as u32).map(move |i| a + step * f64::from(i));
        steps(x0, x1).flat_map(move |x| steps(-1.0, 1.0).map(move |y| Vector3::new(x, y, z))).collect::<Vec<_>>()
    };
    // In front half of a wall, thinly sampled; behind it all of another one, densely.
    let mut points = grid(2.0, -1.0, 0.0, 0.05);
    points.extend(grid(4.0, -2.0, 2.0, 0.02));
    let cloud = CloudSurface::new(&points, PointNoise::Unknown, MeasuredBy::Others).unwrap();
    let ray = |x: f64, z: f64| Ray { origin: Vector3::zeros(), direction: Vector3::new(x, 0.013, z).normalize() };
    for i in 0..40 {
        let x = -0.9 + 0.02 * f64::from(i);
        let hit = cloud.hit(&ray(x, 2.0), 0.0).unwrap();
        assert!((ray(x, 2.0).at(hit.distance).z - 2.0).abs() < 1e-9 && hit.edge.is_none(), "{x}: {hit:?}");
        let hit = cloud.hit(&ray(0.1 + 0.02 * f64::from(i), 2.0), 0.0).unwrap();
        assert!((hit.normal - Vector3::z()).norm() < 1e-6 && hit.distance > 3.9, "{hit:?}");
    }
    // At the front wall's rim it says so, and what is behind.
    let rim = cloud.hit(&ray(0.02, 2.0), 0.0).unwrap();
    let edge = rim.edge.expect("an edge");
    assert!(rim.distance < 2.1 && edge.other.is_some_and(|d| (3.9..4.2).contains(&d)), "{rim:?}");
    assert!(matches!(cloud.hit(&ray(9.0, 1.0), 0.0), Err(Error::NotFound { .. })));
    assert!(matches!(cloud.hit(&ray(0.1, -2.0), 0.0), Err(Error::NotFound { .. })));
    // The noise of a plane of n points falls with n.
    let noisy =
        CloudSurface::new(&points, PointNoise::Variances(&vec![1e-4; points.len()]), MeasuredBy::Others).unwrap();
    let variance = noisy.hit(&ray(0.6, 2.0), 0.0).unwrap().variance;
    assert!(variance > 1e-4 / 64.0 && variance < 1e-4 / 5.0, "{variance}");
    let few = |n: usize| CloudSurface::new(&points[..n], PointNoise::Unknown, MeasuredBy::Others);
    assert!(matches!(few(0), Err(Error::TooFewPoints { .. })) && matches!(few(1), Err(Error::TooFewPoints { .. })));
    assert!(CloudSurface::new(&[Vector3::x(); 9], PointNoise::Unknown, MeasuredBy::Others).is_err());
    let mut bad = points.clone();
    bad[7].y = f64::NAN;
    let refused = CloudSurface::new(&bad, PointNoise::Unknown, MeasuredBy::Others);
    assert!(matches!(refused, Err(Error::NotFinite { index: 7, .. })));
    for variances in [vec![1.0; 3], vec![-1.0; points.len()], vec![f64::NAN; points.len()]] {
        assert!(CloudSurface::new(&points, PointNoise::Variances(&variances), MeasuredBy::Others).is_err());
    }
    let lopsided = vec![Matrix3::new(1.0, 9.0, 0.0, 9.0, 1.0, 0.0, 0.0, 0.0, 1.0); points.len()];
    assert!(CloudSurface::new(&points, PointNoise::Covariances(&lopsided), MeasuredBy::Others).is_err());
}
