//! The two stations of the thesis, eq. (24), 1 m and 37 degrees apart, that scan a wall, a floor and
//! two faces of a box with a noisy laser.

use nalgebra::{SMatrix, Vector3};
use ptzcal::geometry::rig_model::LaserLine;
use ptzcal::geometry::rigid::{exp, log, nearest_rotation};
use ptzcal::geometry::{Distortion, Intrinsics, InverseDepthPoint, Plane, RigModel, Rigid};
use ptzcal::pose::{
    PlaneEstimate, PlaneFitOptions, PoseEstimate, PoseMethod, PoseOptions, RoofEdges, estimate_pose_roof_edges,
    fit_plane_to_points, fit_plane_to_shots,
};

use crate::random::Random;

/// Rotation of thesis eq. (24), by columns.
const PRINTED: [[f64; 3]; 3] = [[0.7958, 0.0295, -0.6049], [-0.0079, 0.9992, 0.0383], [0.6056, -0.0257, 0.7954]];

/// Thesis eq. (24), metres: station 2's frame to station 1's.
fn equation_24() -> Rigid {
    Rigid {
        rotation: nearest_rotation(&PRINTED.into()).unwrap(),
        translation: Vector3::new(-0.94237, -0.06594, 0.32666),
    }
}

fn rig() -> RigModel {
    RigModel {
        width: 720,
        height: 576,
        intrinsics: Intrinsics::new(800.0, 360.0, 288.0),
        distortion: Distortion::None,
        laser: LaserLine { x0: 0.1, y0: 0.005, vx: -0.005, vy: 0.003 },
        offsets: Default::default(),
        encoders: Default::default(),
    }
}

/// The laser's ray through a point, and its depth, in closed form (no axis offsets).
fn aim(target: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>, f64) {
    let laser = rig().laser;
    let (l, v) = (Vector3::new(laser.x0, laser.y0, 0.0), Vector3::new(laser.vx, laser.vy, 1.0));
    let (vv, lv) = (v.norm_squared(), l.dot(&v));
    let depth = (-lv + (lv * lv - vv * (l.norm_squared() - target.norm_squared())).sqrt()) / vv;
    let q = l + v * depth;
    let tilt = q.y.atan2(q.z) - (target.y / q.y.hypot(q.z)).asin();
    let pan = target.x.atan2(target.z) - q.x.atan2(tilt.sin() * q.y + tilt.cos() * q.z);
    let (origin, direction) = rig().laser_in_world(pan, tilt);
    assert!((origin + direction * depth - target).norm() < 1e-9);
    (origin, direction, depth)
}

/// A rectangle: a corner and two sides, metres.
type Patch = [Vector3<f64>; 3];

/// Wall, floor, left and right face of the box. The box's edge is vertical, that of wall and floor
/// at `angle` degrees to it.
fn patches(angle: f64) -> [Patch; 4] {
    let (s, c) = angle.to_radians().sin_cos();
    let along = Vector3::new(s, c, 0.0);
    let start = Vector3::new(-0.35 - 1.1 * c, 0.9 - 0.45 * c, 2.7);
    let corner = Vector3::new(0.25, 0.4, 1.8);
    let across = along.cross(&Vector3::z());
    let up = if across.y > 0.0 { -across } else { across };
    let (left, right) = (Vector3::new(-0.5, 0.0, 0.866), Vector3::new(0.866, 0.0, 0.5));
    [
        [start - along * 0.35 + up * 0.02, along * 0.7, up * 0.7],
        [start - along * 0.35, along * 0.7, Vector3::new(0.0, 0.0, -0.7)],
        [corner, left * 0.5, Vector3::y() * 0.5],
        [corner, right * 0.5, Vector3::y() * 0.5],
    ]
}

/// Inverse depth per pixel of the spot.
fn rho_per_pixel() -> f64 {
    1.0 / (800.0 * 0.1f64.hypot(0.005))
}

/// What a station measures of each patch; both stations aim at the same points.
fn shots(
    patches: &[Patch],
    to_station: &Rigid,
    count: usize,
    sigma: f64,
    random: &mut Random,
) -> Vec<Vec<InverseDepthPoint>> {
    let mut places = Random::new(17);
    let places: Vec<(f64, f64)> = (0..count).map(|_| (places.uniform(), places.uniform())).collect();
    let deviation = if sigma > 0.0 { sigma } else { 0.2 } * rho_per_pixel();
    let mut shot = |patch: &Patch, (u, v): &(f64, f64)| {
        let (origin, direction, depth) = aim(&to_station.apply(&(patch[0] + patch[1] * *u + patch[2] * *v)));
        let rho = 1.0 / depth + sigma * rho_per_pixel() * random.gaussian();
        InverseDepthPoint { origin, direction, rho, variance: deviation * deviation }
    };
    patches.iter().map(|p| places.iter().map(|uv| shot(p, uv)).collect()).collect()
}

fn stations(angle: f64, count: usize, sigma: f64, seed: u64) -> [RoofEdges; 2] {
    let mut random = Random::new(seed);
    [Rigid::identity(), equation_24().inverse()].map(|to_station| {
        let shots = shots(&patches(angle), &to_station, count, sigma, &mut random);
        let mut edges = RoofEdges::new();
        for pair in shots.chunks(2) {
            edges.add_shots(&pair[0], &pair[1], &PlaneFitOptions::default()).unwrap();
        }
        edges
    })
}

fn with(method: PoseMethod) -> PoseOptions {
    PoseOptions { method, lever: Some(1.0), ..Default::default() }
}

const METHODS: [PoseMethod; 3] =
    [PoseMethod::RoofEdgeProcrustes, PoseMethod::PlaneToPlane, PoseMethod::MaximumLikelihood];

/// Error as (w, t) in the order of the covariance.
fn error(estimate: &PoseEstimate) -> SMatrix<f64, 6, 1> {
    let truth = equation_24();
    let w = log(&(estimate.b_to_a.rotation * truth.rotation.transpose()));
    let t = estimate.b_to_a.translation - truth.translation;
    SMatrix::from_iterator(w.iter().chain(t.iter()).copied())
}

#[test]
fn the_thesis_pose_and_its_inverse() {
    // Eq. (25) prints t of (24) again; -R^T t is what the text's 94.94, 4.59 and 30.92 cm are.
    let text = Vector3::new(0.9495, 0.0459, 0.3092);
    let printed = Rigid { rotation: PRINTED.into(), ..equation_24() };
    assert!((printed.centre() - text).amax() < 5e-5);
    // The printed matrix is a rotation to 1e-4.
    assert!((equation_24().inverse().translation - text).amax() < 1e-4);
    let [a, b] = stations(90.0, 50, 0.0, 1);
    let estimate = estimate_pose_roof_edges(&a, &b, &PoseOptions::default()).unwrap();
    assert!((estimate.a_to_b().translation - text).amax() < 1e-4);
    assert!((estimate.position() - Vector3::new(-0.94237, -0.06594, 0.32666)).amax() < 1e-9);
    assert!((estimate.rotation_angle().to_degrees() - 37.33).abs() < 5e-3);
}

#[test]
fn without_noise_every_method_is_exact() {
    for angle in [90.0, 45.0, 20.0, 6.0] {
        let [a, b] = stations(angle, 50, 0.0, 1);
        for method in METHODS {
            let estimate = estimate_pose_roof_edges(&a, &b, &with(method)).unwrap();
            assert!(error(&estimate).amax() < 1e-9, "{angle} {method:?} {}", error(&estimate));
            assert!(estimate.residual_rms < 1e-9 && estimate.disagreement < 1e-9);
            assert!(estimate.covariance.cholesky().is_some());
        }
    }
}

/// Root mean square errors of rotation (mrad) and position (mm), and sqrt(NEES / 6).
fn monte_carlo(runs: &[[RoofEdges; 2]], options: &PoseOptions) -> (f64, f64, f64) {
    let (mut rotation, mut position, mut nees) = (0.0, 0.0, 0.0);
    for [a, b] in runs {
        let estimate = estimate_pose_roof_edges(a, b, options).unwrap();
        let e = error(&estimate);
        rotation += e.fixed_rows::<3>(0).norm_squared() / runs.len() as f64;
        position += e.fixed_rows::<3>(3).norm_squared() / runs.len() as f64;
        let whitened = estimate.covariance.cholesky().map(|c| c.solve(&e));
        nees += whitened.map_or(f64::NAN, |w| e.dot(&w)) / (6 * runs.len()) as f64;
    }
    (rotation.sqrt() * 1e3, position.sqrt() * 1e3, nees.sqrt())
}

/// The study of the same scene in maths.md section 7 (100 points a plane, 0.2 px; 200
/// runs with other points on the same patches) and the honesty of the covariance.
#[test]
fn accuracy_and_covariance_are_those_of_the_study() {
    let runs: Vec<[RoofEdges; 2]> = (0..800).map(|seed| stations(90.0, 100, 0.2, 1000 + seed)).collect();
    // Planes taken as exact weigh alike.
    let unweighted: Vec<[RoofEdges; 2]> = runs
        .iter()
        .map(|pair| {
            pair.each_ref().map(|station| {
                let mut alike = RoofEdges::new();
                for plane in station.planes() {
                    alike.add_plane(PlaneEstimate::given(&plane.plane(), None).unwrap()).unwrap();
                }
                station.edges().iter().for_each(|[i, j]| alike.add_edge(*i, *j).unwrap());
                alike
            })
        })
        .collect();
    let near = |value: f64, wanted: f64| (value / wanted - 1.0).abs() < 0.1;

    let (rotation, position, nees) = monte_carlo(&runs, &with(PoseMethod::RoofEdgeProcrustes));
    println!("roof-edge Procrustes: {rotation:.2} mrad, {position:.2} mm, sqrt(NEES/6) {nees:.3}");
    assert!(near(rotation, 13.2) && near(position, 26.5) && (0.95..1.05).contains(&nees));

    let (rotation, position, _) = monte_carlo(&unweighted, &with(PoseMethod::PlaneToPlane));
    println!("plane-to-plane, unweighted: {rotation:.2} mrad, {position:.2} mm");
    assert!(near(rotation, 8.4) && near(position, 17.3));

    let (rotation, position, nees) = monte_carlo(&runs, &with(PoseMethod::PlaneToPlane));
    println!("plane-to-plane, weighted: {rotation:.2} mrad, {position:.2} mm, sqrt(NEES/6) {nees:.3}");
    assert!(rotation < 8.4 && position < 17.3 && (0.95..1.05).contains(&nees));

    // The bound is 5.7 mrad and 10.1 mm.
    let (rotation, position, nees) = monte_carlo(&runs, &with(PoseMethod::MaximumLikelihood));
    println!("maximum likelihood: {rotation:.2} mrad, {position:.2} mm, sqrt(NEES/6) {nees:.3}");
    assert!(near(rotation, 5.7) && near(position, 10.1) && (0.95..1.05).contains(&nees));
}

/// A third edge, of the floor and the left face of the box, out of planes that are there already.
fn with_shared_planes(station: &RoofEdges) -> RoofEdges {
    let mut more = station.clone();
    more.add_edge(1, 2).unwrap();
    more
}

#[test]
fn a_third_edge_of_the_same_planes_is_used_and_its_covariance_is_honest() {
    let exact = stations(90.0, 50, 0.0, 1).map(|s| with_shared_planes(&s));
    for method in METHODS {
        let estimate = estimate_pose_roof_edges(&exact[0], &exact[1], &with(method)).unwrap();
        assert!(error(&estimate).amax() < 1e-9);
    }
    let runs: Vec<[RoofEdges; 2]> =
        (0..400).map(|seed| stations(90.0, 100, 0.2, seed).map(|s| with_shared_planes(&s))).collect();
    let (rotation, position, nees) = monte_carlo(&runs, &with(PoseMethod::RoofEdgeProcrustes));
    println!("three edges: {rotation:.2} mrad, {position:.2} mm, sqrt(NEES/6) {nees:.3}");
    assert!(rotation < 13.2 && position < 26.5 && (0.94..1.06).contains(&nees));
}

/// The edges of `station` in the given order of edges; `flip[i]` swaps the planes of the i-th.
fn reordered(station: &RoofEdges, order: [usize; 2], flip: [bool; 2]) -> RoofEdges {
    let mut other = RoofEdges::new();
    for plane in station.planes() {
        other.add_plane(plane.clone()).unwrap();
    }
    for (i, flip) in order.into_iter().zip(flip) {
        let [first, second] = station.edges()[i];
        if flip { other.add_edge(second, first).unwrap() } else { other.add_edge(first, second).unwrap() }
    }
    other
}

#[test]
fn another_order_of_edges_or_planes_is_refused() {
    for sigma in [0.0, 0.2, 0.5] {
        let [a, b] = stations(90.0, 100, sigma, 3);
        for method in METHODS {
            let estimate = |b: &RoofEdges| estimate_pose_roof_edges(&a, b, &with(method));
            assert!(estimate(&reordered(&b, [0, 1], [false, false])).is_ok());
            for (order, flip) in [
                ([0, 1], [true, false]),
                ([0, 1], [false, true]),
                // Both flipped, and both exchanged, leave no residual in the points of the edges.
                ([0, 1], [true, true]),
                ([1, 0], [false, false]),
                ([1, 0], [true, true]),
            ] {
                let refused = estimate(&reordered(&b, order, flip));
                assert!(refused.is_err(), "{sigma} {method:?} {order:?} {flip:?}: {refused:?}");
            }
        }
    }
}

#[test]
fn parallel_edges_and_wrong_counts_are_refused() {
    // The floor's edge turned until it is vertical like the box's.
    let [a, b] = stations(4.0, 100, 0.2, 3);
    let e = estimate_pose_roof_edges(&a, &b, &PoseOptions::default()).unwrap_err();
    assert_eq!(e.status(), ptzcal::error::Status::Degenerate);
    assert!(e.to_string().contains("Parallel") && e.to_string().contains("unobservable"), "{e}");
    let narrow = PoseOptions { min_edge_angle: 0.02, ..Default::default() };
    assert!(estimate_pose_roof_edges(&a, &b, &narrow).is_ok());

    let [a, b] = stations(90.0, 100, 0.2, 3);
    let three = with_shared_planes(&a);
    assert!(estimate_pose_roof_edges(&three, &b, &PoseOptions::default()).is_err());
    let mut one = RoofEdges::new();
    a.planes()[..2].iter().for_each(|p| assert!(one.add_plane(p.clone()).is_ok()));
    one.add_edge(0, 1).unwrap();
    assert!(estimate_pose_roof_edges(&one, &one, &PoseOptions::default()).is_err());
    assert!(estimate_pose_roof_edges(&RoofEdges::new(), &RoofEdges::new(), &PoseOptions::default()).is_err());
    for lever in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = PoseOptions { lever: Some(lever), ..Default::default() };
        assert!(estimate_pose_roof_edges(&a, &b, &options).is_err());
    }
    for angle in [0.0, f64::NAN, 2.0] {
        let options = PoseOptions { min_edge_angle: angle, ..Default::default() };
        assert!(estimate_pose_roof_edges(&a, &b, &options).is_err());
    }
}

#[test]
fn given_planes_are_exact_and_maximum_likelihood_says_what_it_lacks() {
    let truth = equation_24();
    let planes = [
        Plane::new(Vector3::new(0.0, 0.1, 1.0), 3.0),
        Plane::new(Vector3::y(), 1.2),
        Plane::new(Vector3::new(-0.8, 0.0, 0.6), 1.0),
        Plane::new(Vector3::new(0.8, 0.1, 0.7), 1.5),
    ];
    let station = |frame: &Rigid| {
        let mut edges = RoofEdges::new();
        for plane in planes {
            edges.add_plane(PlaneEstimate::given(&plane.unwrap().transform(frame), None).unwrap()).unwrap();
        }
        edges.add_edge(0, 1).unwrap();
        edges.add_edge(2, 3).unwrap();
        edges
    };
    let (a, b) = (station(&Rigid::identity()), station(&truth.inverse()));
    for method in [PoseMethod::RoofEdgeProcrustes, PoseMethod::PlaneToPlane] {
        let estimate = estimate_pose_roof_edges(&a, &b, &with(method)).unwrap();
        assert!(error(&estimate).amax() < 1e-12);
        assert_eq!(estimate.covariance.amax(), 0.0);
    }
    assert!(estimate_pose_roof_edges(&a, &b, &with(PoseMethod::MaximumLikelihood)).is_err());
    // Stations that see other planes: no order of theirs fits.
    let elsewhere = station(&Rigid { rotation: exp(&Vector3::new(0.0, 0.1, 0.0)), ..truth.inverse() });
    assert!(estimate_pose_roof_edges(&a, &elsewhere, &PoseOptions::default()).is_ok());
    assert!(estimate_pose_roof_edges(&a, &reordered(&b, [1, 0], [false, true]), &PoseOptions::default()).is_err());
}

/// Points at the noise of the laser have errors along the ray that grow with the square of the
/// depth; the fit to points takes them for noise in every direction and is biased.
#[test]
fn planes_fitted_in_inverse_depth_are_not_biased() {
    let mut random = Random::new(5);
    let floor = patches(90.0)[1];
    let truth = Vector3::new(0.0, 1.0 / 0.9, 0.0);
    let (mut bias, mut bias_of_points) = (Vector3::zeros(), Vector3::zeros());
    for _ in 0..100 {
        let shots = &shots(&[floor], &Rigid::identity(), 400, 1.0, &mut random)[0];
        let points: Vec<_> = shots.iter().map(|s| s.point().unwrap()).collect();
        bias += (fit_plane_to_shots(shots, &PlaneFitOptions::default()).unwrap().n - truth) / 100.0;
        bias_of_points += (fit_plane_to_points(&points, None, &PlaneFitOptions::default()).unwrap().n - truth) / 100.0;
    }
    println!("bias of n: {:.4} by shots, {:.4} by points", bias.norm(), bias_of_points.norm());
    assert!(bias.norm() < 0.01 && bias_of_points.norm() > 5.0 * bias.norm());
}
