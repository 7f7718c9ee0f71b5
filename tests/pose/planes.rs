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
        let mut seen = vec![0; room.len()];
        made.surfaces.iter().for_each(|k| seen[*k] += 1);
        let mut names = Vec::new();
        for k in 0..found.planes.len() {
            let (name, relative, square) = nearest(&found, k, &planes);
            let f = &found.planes[k];
            let inside = made.surfaces.iter().zip(&found.labels).filter(|(_, l)| **l == Some(k as u16)).fold(vec![0; room.len()], |mut c, (s, _)| { c[*s] += 1; c });
            println!("{seed} {k} name {name} count {} of {} rel {relative:.5} sq {square:.1} rms {:.4} nf {:?} sides {:?} {:?}", f.count, seen[name], f.rms, f.estimate.noise_factor(), f.support.sides(), inside.iter().enumerate().filter(|(_, c)| **c > 0).collect::<Vec<_>>());
            assert!(relative < 1.02, "seed {seed}: plane {k} is off by {relative}");
            nees += square / 3.0;
            counted += 1.0;
            names.push(name);
        }
        // The room's own faces, all large.
        for wall in 0..6 {
            let alike = |n: &usize| planes[*n].normal.dot(&planes[wall].normal) > 0.9999 && (planes[*n].distance - planes[wall].distance).abs() < 1e-9;
            assert!(names.iter().any(alike), "seed {seed}: wall {wall} of {} points", seen[wall]);
        }
        // Labels: what belongs to a found plane has it.
        let right = made.surfaces.iter().zip(&found.labels).filter(|(s, l)| {
            l.is_some_and(|l| {
                let (p, q) = (&planes[names[l as usize]], &planes[**s]);
                p.normal.dot(&q.normal) > 0.9999 && (p.distance - q.distance).abs() < 0.02
            })
        });
        let share = right.count() as f64 / made.surfaces.len() as f64;
        assert!(share > 0.95, "seed {seed}: {share}");
        assert_eq!(found, find_planes_in_points(&made.points, Some(0.005), &exact()).unwrap());
    }
    let nees = (nees / counted).sqrt();
    println!("sqrt(NEES / 3) {nees:.3} of {counted} planes");
    assert!((0.85..1.2).contains(&nees), "{nees}");
}
