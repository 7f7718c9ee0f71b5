//! Planes from laser shots and from points.

use nalgebra::{Matrix3, Vector3};
use ptzcal::error::{Degeneracy, Error, Result};
use ptzcal::geometry::{InverseDepthPoint, Plane};
use ptzcal::pose::{PlaneEstimate, PlaneFitOptions, fit_plane_to_points, fit_plane_to_shots};

use crate::random::Random;

const SIGMA: f64 = 2.5e-3;

fn truth() -> Vector3<f64> {
    Vector3::new(0.12, -0.2, 0.35)
}

/// Shots spread over a field of 0.6 x 0.4, from a laser 10 cm beside the origin.
fn shots(n: &Vector3<f64>, count: usize, noise: f64, random: &mut Random) -> Vec<InverseDepthPoint> {
    (0..count)
        .map(|_| {
            let origin = Vector3::new(0.1, 0.005, 0.0);
            let direction = Vector3::new(0.6 * random.uniform() - 0.3, 0.4 * random.uniform() - 0.2, 1.0);
            let rho = n.dot(&direction) / (1.0 - n.dot(&origin)) + noise * random.gaussian();
            InverseDepthPoint { origin, direction, rho, variance: SIGMA * SIGMA }
        })
        .collect()
}

fn kind(result: Result<PlaneEstimate>) -> Option<Degeneracy> {
    match result {
        Err(Error::Degenerate { kind, .. }) => Some(kind),
        _ => None,
    }
}

#[test]
fn exact_shots_and_points_give_the_plane() {
    for (count, robust) in [(3, false), (50, false), (50, true)] {
        let shots = shots(&truth(), count, 0.0, &mut Random::new(1));
        let options = PlaneFitOptions { robust, ..Default::default() };
        let fit = fit_plane_to_shots(&shots, &options).unwrap();
        assert!((fit.n - truth()).norm() < 1e-12 && fit.chi_square < 1e-12);
        assert_eq!(fit.degrees_of_freedom, count - 3);
        let points: Vec<_> = shots.iter().map(|s| s.point().unwrap()).collect();
        let fit = fit_plane_to_points(&points, Some(1e-3), &options).unwrap();
        assert!((fit.n - truth()).norm() < 1e-12);
        let plane = fit.plane();
        assert!(plane.distance > 0.0 && points.iter().all(|p| plane.signed_distance(p).abs() < 1e-12));
    }
}

/// Runs whose errors are whitened by their own covariance: sqrt(NEES / 3) and mean chi-square
/// over its degrees of freedom.
fn honesty(fit: impl Fn(&mut Random) -> PlaneEstimate) -> (f64, f64) {
    let (mut nees, mut chi, mut random) = (0.0, 0.0, Random::new(11));
    for _ in 0..600 {
        let fit = fit(&mut random);
        let e = fit.n - truth();
        nees += e.dot(&fit.covariance.cholesky().unwrap().solve(&e)) / 1800.0;
        chi += fit.chi_square / fit.degrees_of_freedom as f64 / 600.0;
    }
    (nees.sqrt(), chi)
}

#[test]
fn the_covariance_is_honest() {
    let (nees, chi) =
        honesty(|random| fit_plane_to_shots(&shots(&truth(), 80, SIGMA, random), &PlaneFitOptions::default()).unwrap());
    assert!((0.95..1.05).contains(&nees) && (0.95..1.05).contains(&chi), "{nees} {chi}");
    for sigma in [Some(0.01), None] {
        let (nees, _) = honesty(|random| {
            let exact = shots(&truth(), 80, 0.0, random);
            let points: Vec<_> =
                exact.iter().map(|s| s.point().unwrap() + Vector3::from_fn(|_, _| 0.01 * random.gaussian())).collect();
            fit_plane_to_points(&points, sigma, &PlaneFitOptions::default()).unwrap()
        });
        assert!((0.93..1.07).contains(&nees), "{sigma:?} {nees}");
    }
}

#[test]
fn outliers_are_set_aside() {
    for seed in 0..50 {
        let mut random = Random::new(seed);
        let mut shots = shots(&truth(), 100, SIGMA, &mut random);
        // Shots that hit something else, in front or behind.
        let bad = (0..100).filter(|i| i % 10 < 4).collect::<Vec<_>>();
        for i in &bad {
            shots[*i].rho *= if i % 2 == 0 { 1.2 + random.uniform() } else { 0.7 * random.uniform() };
        }
        let fit = fit_plane_to_shots(&shots, &PlaneFitOptions::default()).unwrap();
        assert!(bad.iter().all(|i| !fit.inliers[*i]), "seed {seed}");
        assert!(fit.degrees_of_freedom >= 100 - bad.len() - 4);
        let e = fit.n - truth();
        assert!(e.dot(&fit.covariance.cholesky().unwrap().solve(&e)) < 30.0, "seed {seed}");
        assert_eq!(fit, fit_plane_to_shots(&shots, &PlaneFitOptions::default()).unwrap());

        let points: Vec<_> = shots.iter().map(|s| s.point().unwrap()).collect();
        let fit = fit_plane_to_points(&points, None, &PlaneFitOptions::default()).unwrap();
        assert!((fit.n - truth()).norm() < 0.1 * truth().norm(), "seed {seed}");
    }
}

#[test]
fn sets_that_fix_no_plane_are_refused() {
    let options = PlaneFitOptions::default();
    let good = shots(&truth(), 20, 0.0, &mut Random::new(1));
    assert!(matches!(fit_plane_to_shots(&good[..2], &options), Err(Error::TooFewPoints { given: 2, needed: 3 })));
    assert!(matches!(fit_plane_to_points(&[], None, &options), Err(Error::TooFewPoints { .. })));
    assert_eq!(kind(fit_plane_to_shots(&[good[0]; 10], &options)), Some(Degeneracy::Coincident));
    assert_eq!(kind(fit_plane_to_points(&[Vector3::x(); 10], None, &options)), Some(Degeneracy::Coincident));

    // One sweep of the pan axis: the same height everywhere, with and without noise.
    for noise in [0.0, SIGMA] {
        let mut random = Random::new(2);
        let line: Vec<_> = (0..20)
            .map(|i| {
                let origin = Vector3::new(0.1, 0.0, 0.0);
                let direction = Vector3::new(0.03 * i as f64 - 0.3, 0.0, 1.0);
                let rho = truth().dot(&direction) / (1.0 - truth().dot(&origin)) + noise * random.gaussian();
                InverseDepthPoint { origin, direction, rho, variance: SIGMA * SIGMA }
            })
            .collect();
        assert_eq!(kind(fit_plane_to_shots(&line, &options)), Some(Degeneracy::Collinear));
        if noise == 0.0 {
            let points: Vec<_> = line.iter().map(|s| s.point().unwrap()).collect();
            assert_eq!(kind(fit_plane_to_points(&points, None, &options)), Some(Degeneracy::Collinear));
        }
    }
    // Too small a patch for the noise: half a millimetre at three metres.
    let mut random = Random::new(4);
    let tiny: Vec<_> = shots(&truth(), 20, 0.0, &mut random)
        .into_iter()
        .map(|s| {
            let direction = Vector3::new(s.direction.x * 1e-3, s.direction.y * 1e-3, 1.0);
            let rho = truth().dot(&direction) / (1.0 - truth().dot(&s.origin)) + SIGMA * random.gaussian();
            InverseDepthPoint { direction, rho, ..s }
        })
        .collect();
    assert_eq!(kind(fit_plane_to_shots(&tiny, &options)), Some(Degeneracy::IllConditioned));
}

#[test]
fn a_plane_through_the_origin_is_refused() {
    let options = PlaneFitOptions::default();
    // The floor of a rig whose head stands on it: y = 0.2 x, lit by a laser 10 cm above.
    let on_plane = |distance: f64, noise: f64, random: &mut Random| -> Vec<InverseDepthPoint> {
        (0..40)
            .map(|_| {
                let (origin, x, z) = (Vector3::new(0.0, -0.1, 0.0), random.uniform() - 0.5, 1.0 + random.uniform());
                let target = Vector3::new(x, 0.2 * x + distance, z);
                let direction = (target - origin) / z;
                InverseDepthPoint {
                    origin,
                    direction,
                    rho: 1.0 / z + noise * random.gaussian(),
                    variance: SIGMA * SIGMA,
                }
            })
            .collect()
    };
    for (distance, noise) in [(0.0, 0.0), (0.0, SIGMA), (1e-4, SIGMA)] {
        let shots = on_plane(distance, noise, &mut Random::new(6));
        let e = fit_plane_to_shots(&shots, &options).unwrap_err();
        assert!(e.to_string().contains("origin"), "{distance} {noise}: {e}");
    }
    let exact: Vec<_> = on_plane(0.0, 0.0, &mut Random::new(7)).iter().map(|s| s.point().unwrap()).collect();
    assert!(fit_plane_to_points(&exact, None, &options).unwrap_err().to_string().contains("origin"));
    assert!(PlaneEstimate::given(&Plane { normal: Vector3::y(), distance: 0.0 }, None).is_err());
    assert!(fit_plane_to_shots(&on_plane(0.3, SIGMA, &mut Random::new(6)), &options).is_ok());
}

#[test]
fn bad_input_is_named() {
    let options = PlaneFitOptions::default();
    let good = shots(&truth(), 20, SIGMA, &mut Random::new(1));
    let spoilt = |change: fn(&mut InverseDepthPoint)| {
        let mut bad = good.clone();
        change(&mut bad[7]);
        fit_plane_to_shots(&bad, &options).unwrap_err()
    };
    assert_eq!(spoilt(|s| s.rho = f64::NAN), Error::NotFinite { name: "shots", index: 7 });
    assert_eq!(spoilt(|s| s.origin.y = f64::INFINITY), Error::NotFinite { name: "shots", index: 7 });
    assert!(spoilt(|s| s.variance = 0.0).to_string().contains("shot 7"));
    assert!(spoilt(|s| s.direction = Vector3::zeros()).to_string().contains("shot 7"));
    // Turned the wrong way round, the plane is behind the rig.
    let behind: Vec<_> = good.iter().map(|s| InverseDepthPoint { rho: -s.rho, ..*s }).collect();
    assert!(matches!(fit_plane_to_shots(&behind, &options), Err(Error::BehindCamera { .. })));
    // Two thirds of the shots are anywhere.
    let mut random = Random::new(3);
    let mut astray = good.clone();
    astray.iter_mut().skip(6).for_each(|s| s.rho = random.uniform());
    assert!(fit_plane_to_shots(&astray, &options).map_or(true, |fit| fit.noise_factor().unwrap() > 5.0));
    let nan = PlaneFitOptions { outlier_threshold: f64::NAN, ..options.clone() };
    assert!(fit_plane_to_shots(&good, &nan).is_err());
    let indefinite = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
    assert!(PlaneEstimate::given(&Plane::new(Vector3::z(), 2.0).unwrap(), Some(indefinite)).is_err());
}
