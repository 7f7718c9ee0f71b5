//! Planes of whole scans, found and in named regions, against rooms of known rectangles.

use nalgebra::Vector3;
use ptzcal::error::{Error, Status};
use ptzcal::geometry::{InverseDepthPoint, Plane, Rigid};
use ptzcal::pose::{
    FindPlanesOptions, PlaneRegion, StationPlanes, find_planes_in_points, find_planes_in_shots, fit_regions_of_points,
    fit_regions_of_shots,
};

use crate::room::{Dice, Rectangle, as_shots, cuboid, furnished, scan, somewhere};

/// Surfaces are exactly plane here.
fn exact() -> FindPlanesOptions {
    FindPlanesOptions { flatness: 0.0, ..Default::default() }
}

/// A rectangle's plane in a station's frame, its normal away from the station.
fn truth(rectangle: &Rectangle, station: &Rigid) -> Plane {
    let normal = rectangle.sides[0].cross(&rectangle.sides[1]);
    Plane::new(normal, normal.dot(&rectangle.corner)).unwrap().transform(station).facing_away_from_origin()
}

/// Which true plane a found one is: the nearest; how far it is off, and its squared error in its
/// standard deviations.
fn nearest(found: &StationPlanes, k: usize, planes: &[Plane]) -> (usize, f64, f64) {
    let estimate = &found.planes[k].estimate;
    let off = |p: &Plane| {
        let e = estimate.n - p.normal / p.distance;
        (e.norm() / estimate.n.norm(), e)
    };
    let all = planes.iter().enumerate().map(|(i, p)| (i, off(p)));
    let (i, (relative, e)) = all.min_by(|p, q| p.1.0.total_cmp(&q.1.0)).unwrap();
    (i, relative, e.dot(&estimate.covariance.cholesky().unwrap().solve(&e)))
}

/// Faces of two boxes may lie in one plane.
fn same(p: &Plane, q: &Plane) -> bool {
    p.normal.dot(&q.normal) > 0.9999 && (p.distance - q.distance).abs() < 1e-6
}

#[test]
fn the_planes_of_a_furnished_room_are_found_with_honest_covariances() {
    let room = furnished();
    let (mut nees, mut counted) = (0.0, 0.0);
    for seed in 0..20 {
        let dice = &mut Dice::new(seed);
        let station = somewhere(dice);
        let made = scan(&room, &station, 20_000, 0.005, dice);
        let found = find_planes_in_points(&made.points, Some(0.005), &exact()).unwrap();
        let planes: Vec<Plane> = room.iter().map(|r| truth(r, &station)).collect();
        let mut names = Vec::new();
        for k in 0..found.planes.len() {
            let (name, relative, square) = nearest(&found, k, &planes);
            assert!(relative < 0.03, "seed {seed}: plane {k} is off by {relative}");
            nees += square / 3.0;
            counted += 1.0;
            names.push(name);
        }
        // The room's own faces, all large.
        for wall in 0..6 {
            assert!(names.iter().any(|n| same(&planes[*n], &planes[wall])), "seed {seed}: wall {wall}");
        }
        // Labels: what belongs to a found plane has it.
        let right = made
            .surfaces
            .iter()
            .zip(&found.labels)
            .filter(|(s, l)| l.is_some_and(|l| same(&planes[names[l as usize]], &planes[**s])));
        let share = right.count() as f64 / made.surfaces.len() as f64;
        assert!(share > 0.95, "seed {seed}: {share}");
        assert_eq!(found, find_planes_in_points(&made.points, Some(0.005), &exact()).unwrap());
    }
    let nees = (nees / counted).sqrt();
    println!("sqrt(NEES / 3) {nees:.3} of {counted} planes");
    // 240 planes scatter by 3 %; small ones have a few points of their neighbours.
    assert!((0.85..1.15).contains(&nees), "{nees}");
}

#[test]
fn few_shots_with_gross_outliers_show_the_walls() {
    let room = cuboid([-3.0, -1.5, -2.0], [3.0, 1.1, 2.4]);
    let (mut nees, mut counted) = (0.0, 0.0);
    for seed in 0..20 {
        let dice = &mut Dice::new(seed);
        let station = somewhere(dice);
        let made = scan(&room, &station, 600, 0.0, dice);
        let mut shots = as_shots(&made.points, 0.0025, dice);
        for shot in shots.iter_mut().step_by(7) {
            shot.rho = 1.0 / dice.uniform(0.5, 6.0);
        }
        let found = find_planes_in_shots(&shots, &exact()).unwrap();
        let planes: Vec<Plane> = room.iter().map(|r| truth(r, &station)).collect();
        let largest = (0..6).max_by_key(|w| made.surfaces.iter().filter(|s| *s == w).count()).unwrap();
        let mut names = Vec::new();
        for k in 0..found.planes.len() {
            let (name, relative, square) = nearest(&found, k, &planes);
            assert!(relative < 0.03, "seed {seed}: plane {k} is off by {relative}");
            assert!(!names.contains(&name), "seed {seed}: wall {name} twice");
            names.push(name);
            (nees, counted) = (nees + square / 3.0, counted + 1.0);
        }
        assert!(names.contains(&largest) && names.len() >= 5, "seed {seed}: {names:?}");
    }
    let nees = f64::sqrt(nees / counted);
    println!("sqrt(NEES / 3) {nees:.3} of {counted} planes");
    assert!((0.85..1.2).contains(&nees), "{nees}");
}

#[test]
fn noise_is_estimated_where_it_is_not_stated() {
    let dice = &mut Dice::new(5);
    for sigma in [0.002, 0.02] {
        let points = scan(&furnished(), &somewhere(dice), 40_000, sigma, dice).points;
        let found = find_planes_in_points(&points, None, &exact()).unwrap();
        // The noise is along the rays, which meet the surfaces at all angles.
        assert!((0.4..1.1).contains(&(found.sigma / sigma)), "{} for {sigma}", found.sigma);
        assert!(found.planes.len() >= 6);
    }
}

#[test]
fn uneven_walls_have_larger_covariances() {
    // A wall 3 m away with waves of 1 cm over 1.6 m, and points that are 5 mm off.
    let dice = &mut Dice::new(8);
    let mut wall = |depth: f64| -> Vec<Vector3<f64>> {
        let mut point = || {
            let (x, y) = (dice.uniform(-2.0, 2.0), dice.uniform(-1.0, 1.0));
            Vector3::new(x, y, 3.0 + depth * (4.0 * x).sin() * (4.0 * y).cos() + 0.005 * dice.gaussian())
        };
        (0..10_000).map(|_| point()).collect()
    };
    let [even, wavy] = [wall(0.0), wall(0.01)].map(|points| {
        let found =
            find_planes_in_points(&points, Some(0.005), &FindPlanesOptions { flatness: 0.008, ..exact() }).unwrap();
        assert_eq!(found.planes.len(), 1);
        found.planes[0].estimate.covariance.trace()
    });
    assert!(wavy > 10.0 * even, "{even} {wavy}");
}

#[test]
fn regions_are_fitted_as_named() {
    let (room, dice) = (furnished(), &mut Dice::new(11));
    let station = Rigid::from_centre(nalgebra::Matrix3::identity(), &Vector3::zeros());
    let made = scan(&room, &station, 20_000, 0.005, dice);
    let of = |k: usize| -> Vec<usize> { (0..20_000).filter(|i| made.surfaces[*i] == k).collect() };
    let floor = PlaneRegion::Box([Vector3::new(-1.0, 1.0, -1.0), Vector3::new(1.0, 1.2, 1.0)]);
    let regions = [PlaneRegion::Indices(of(4)), floor, PlaneRegion::Indices(of(5))];
    let by_points = fit_regions_of_points(&made.points, Some(0.005), &regions, &exact()).unwrap();
    let by_shots = fit_regions_of_shots(&as_shots(&made.points, 1e-4, dice), &regions, &exact()).unwrap();
    let unstated = fit_regions_of_points(&made.points, None, &regions, &exact()).unwrap();
    for found in [&by_points, &by_shots, &unstated] {
        assert_eq!(found.planes.len(), 3);
        for (k, wall) in [4, 3, 5].into_iter().enumerate() {
            let known = truth(&room[wall], &station);
            let plane = found.planes[k].estimate.plane();
            assert!(plane.normal.dot(&known.normal) > 0.999_999 && (plane.distance - known.distance).abs() < 2e-3);
        }
        let floor = found.labels.iter().filter(|l| **l == Some(1)).count();
        assert_eq!(found.planes[1].count, floor);
        assert!((3.5..4.2).contains(&found.planes[1].support.area), "{:?}", found.planes[1].support);
    }
    let status = |regions: &[PlaneRegion]| {
        let e = fit_regions_of_points(&made.points, Some(0.005), regions, &exact()).unwrap_err();
        (e.status(), e.index())
    };
    assert_eq!(status(&[]), (Status::InvalidArgument, None));
    assert_eq!(status(&[PlaneRegion::Indices(vec![20_000])]), (Status::InvalidArgument, Some(0)));
    let few = PlaneRegion::Indices(vec![5, 5, 5, 6]);
    assert_eq!(status(&[regions[0].clone(), few]), (Status::TooFewPoints, Some(1)));
    let empty = PlaneRegion::Box([Vector3::new(50.0, 50.0, 50.0), Vector3::new(51.0, 51.0, 51.0)]);
    assert_eq!(status(&[empty]), (Status::TooFewPoints, Some(0)));
    let inverted = PlaneRegion::Box([Vector3::repeat(1.0), Vector3::repeat(-1.0)]);
    assert_eq!(status(&[inverted]), (Status::InvalidArgument, Some(0)));
    // Half a wall and half a floor are no plane.
    let both: Vec<usize> =
        of(4).into_iter().take(500).chain(of(3).into_iter().take(520)).chain(of(0).into_iter().take(510)).collect();
    assert_eq!(status(&[PlaneRegion::Indices(both)]).0, Status::NoConsensus);
}

#[test]
fn what_shows_no_plane_is_refused() {
    let dice = &mut Dice::new(2);
    let find = |points: &[Vector3<f64>]| find_planes_in_points(points, Some(0.005), &exact());
    // Clutter, at several densities.
    for count in [30, 200, 2000, 30_000] {
        let clutter: Vec<_> = (0..count).map(|_| Vector3::from_fn(|_, _| dice.uniform(-2.0, 2.0))).collect();
        let found = find(&clutter);
        assert_eq!(found.map(|f| f.planes.len()), Err(Error::NoPlanes { measurements: count }), "{count}");
    }
    // Nothing, one point, one point often, one line.
    assert_eq!(find(&[]), Err(Error::TooFewPoints { given: 0, needed: 25 }));
    assert_eq!(find(&[Vector3::z()]), Err(Error::TooFewPoints { given: 1, needed: 25 }));
    assert_eq!(find(&[Vector3::z(); 1000]).unwrap_err().status(), Status::NotFound);
    assert!(find_planes_in_points(&[Vector3::z(); 1000], None, &exact()).is_err());
    let line: Vec<_> = (0..1000).map(|i| Vector3::new(f64::from(i) * 0.01, 1.0, 2.0)).collect();
    assert_eq!(find(&line).unwrap_err().status(), Status::NotFound);
    assert_eq!(find_planes_in_points(&line, None, &exact()).unwrap_err().status(), Status::Degenerate);
    // What is not finite is passed over, and what is left is too little.
    let mut wall: Vec<_> =
        (0..2000).map(|_| Vector3::new(dice.uniform(-1.0, 1.0), dice.uniform(-1.0, 1.0), 3.0)).collect();
    for point in wall.iter_mut().step_by(3) {
        point.y = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][dice.uniform(0.0, 3.0) as usize];
    }
    let found = find(&wall).unwrap();
    assert_eq!((found.planes.len(), found.labels.len()), (1, 2000));
    assert!((0..2000).all(|i| (found.labels[i].is_none()) == (i % 3 == 0)));
    assert!(find(&vec![Vector3::repeat(f64::NAN); 100]).is_err());
    // Every point twice is as good as once.
    let twice: Vec<_> = wall.iter().chain(&wall).copied().collect();
    assert_eq!(find(&twice).unwrap().planes.len(), 1);
    // Numbers of any size.
    for scale in [1e-150, 1e150, f64::MAX / 4.0] {
        let far: Vec<_> = wall.iter().map(|p| p * scale).collect();
        let _ = find(&far);
        let _ = find_planes_in_points(&far, None, &exact());
    }
    let nothing = InverseDepthPoint { origin: Vector3::zeros(), direction: Vector3::z(), rho: 0.5, variance: 0.0 };
    let e = find_planes_in_shots(&[nothing; 100], &exact()).unwrap_err();
    assert_eq!(e, Error::TooFewPoints { given: 0, needed: 25 });
}

#[test]
fn bad_options_are_named() {
    let points = vec![Vector3::z(); 100];
    let bad = [
        ("threshold", FindPlanesOptions { threshold: 0.0, ..exact() }),
        ("threshold", FindPlanesOptions { threshold: f64::NAN, ..exact() }),
        ("flatness", FindPlanesOptions { flatness: -1.0, ..exact() }),
        ("min_share", FindPlanesOptions { min_share: 1.5, ..exact() }),
        ("min_points", FindPlanesOptions { min_points: 3, ..exact() }),
        ("max_planes", FindPlanesOptions { max_planes: 0, ..exact() }),
        ("max_planes", FindPlanesOptions { max_planes: 1001, ..exact() }),
        ("range", FindPlanesOptions { range: [2.0, 1.0], ..exact() }),
        ("range", FindPlanesOptions { range: [f64::NAN, 1.0], ..exact() }),
    ];
    for (name, options) in bad {
        let e = find_planes_in_points(&points, Some(0.01), &options).unwrap_err();
        assert!(matches!(e, Error::InvalidArgument { name: n, .. } if n == name), "{name}: {e}");
    }
    for sigma in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(find_planes_in_points(&points, Some(sigma), &exact()).is_err());
    }
}
