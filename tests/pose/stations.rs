//! Stations registered by the planes that both saw.
use nalgebra::{SMatrix, Vector3};
use ptzcal::error::{Error, Status};
use ptzcal::geometry::Rigid;
use ptzcal::geometry::rigid::{exp, log};
use ptzcal::pose::{
    FindPlanesOptions, PosePrior, StationOptions, StationPlanes, StationPose, find_planes_in_points, register_stations,
};

use crate::room::{Dice, Rectangle, cuboid, furnished, scan, somewhere};

fn planes(room: &[Rectangle], station: &Rigid, count: usize, dice: &mut Dice) -> StationPlanes {
    let points = scan(room, station, count, 0.005, dice).points;
    find_planes_in_points(&points, Some(0.005), &FindPlanesOptions { flatness: 0.0, ..Default::default() }).unwrap()
}

/// Error as (w, t) in the order of the covariance.
fn error(found: &StationPose, truth: &Rigid) -> SMatrix<f64, 6, 1> {
    let w = log(&(found.b_to_a.rotation * truth.rotation.transpose()));
    let t = found.b_to_a.translation - truth.translation;
    SMatrix::from_iterator(w.iter().chain(t.iter()).copied())
}

fn pair(room: &[Rectangle], seed: u64, count: usize) -> ([StationPlanes; 2], Rigid) {
    let dice = &mut Dice::new(seed);
    let poses = [somewhere(dice), somewhere(dice)];
    let stations = [0, 1].map(|k| planes(room, &poses[k], count, dice));
    (stations, poses[0].after(&poses[1].inverse()))
}

#[test]
fn stations_in_a_furnished_room_are_registered_without_a_guess() {
    let room = furnished();
    let (mut nees, mut solved, mut refused) = (0.0, 0, 0);
    for seed in 0..30 {
        let ([a, b], truth) = pair(&room, seed, 20_000);
        match register_stations(&a, &b, &StationOptions::default()) {
            Ok(found) => {
                let e = error(&found, &truth);
                println!("seed {seed}: {:.2} mrad {:.2} mm, {} planes, agreement {:.3}, runner-up {:.3} chi2 {:.1}/{}", e.fixed_rows::<3>(0).norm() * 1e3, e.fixed_rows::<3>(3).norm() * 1e3, found.matches.len(), found.agreement, found.runner_up, found.chi_square, found.degrees_of_freedom);
                assert!(e.fixed_rows::<3>(0).norm() < 0.01 && e.fixed_rows::<3>(3).norm() < 0.02, "seed {seed}: {e}");
                nees += e.dot(&found.covariance.cholesky().unwrap().solve(&e)) / 6.0;
                solved += 1;
            }
            Err(e) => { println!("seed {seed}: {e}"); refused += 1 }
        }
    }
    println!("{solved} solved, {refused} refused, sqrt(NEES / 6) {:.3}", (nees / f64::from(solved)).sqrt());
}

#[test]
fn an_empty_room_is_ambiguous() {
    let room = cuboid([-3.0, -1.5, -2.0], [3.0, 1.1, 2.4]);
    for seed in 0..20 {
        let ([a, b], truth) = pair(&room, seed, 10_000);
        let r = register_stations(&a, &b, &StationOptions::default());
        match r { Ok(f) => println!("WRONG? {}", error(&f, &truth)), Err(e) => println!("{e}") }
        let prior = PosePrior { b_to_a: truth, rotation_sigma: 0.2, position_sigma: 0.3 };
        let f = register_stations(&a, &b, &StationOptions { prior: Some(prior), ..Default::default() }).unwrap();
        assert!(error(&f, &truth).norm() < 0.02);
    }
}

#[test]
fn corridors() {
    // 30 m long corridor with ends
    let dice = &mut Dice::new(3);
    let room = cuboid([-1.2, -1.5, -15.0], [1.2, 1.1, 15.0]);
    let open: Vec<Rectangle> = room[..4].to_vec();
    for (za, zb) in [(-12.0, 12.0), (-12.0, -9.0), (0.0, 3.0)] {
        for r in [&room, &open] {
        let poses = [za, zb].map(|z| Rigid::from_centre(exp(&Vector3::new(0.02, dice.uniform(-1.0, 1.0), 0.01)), &Vector3::new(dice.uniform(-0.4, 0.4), 0.0, z)));
        let [a, b] = [0, 1].map(|k| {
            let p: Vec<_> = scan(r, &poses[k], 10_000, 0.005, dice).points.into_iter().filter(|p| p.norm() < 8.0).collect();
            find_planes_in_points(&p, Some(0.005), &FindPlanesOptions { flatness: 0.0, ..Default::default() }).unwrap() });
        let truth = poses[0].after(&poses[1].inverse());
        println!("{za} {zb} planes {} {}", a.planes.len(), b.planes.len());
        match register_stations(&a, &b, &StationOptions::default()) { Ok(f) => println!("WRONG? {}", error(&f, &truth).transpose()), Err(e) => println!("{e}") }
        }
    }
}
