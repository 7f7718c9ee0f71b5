//! Pointing: targets inside the stated 95 % ellipse over many set-ups, the range that exploring finds, and
//! how long a cloud of a million points takes.

use std::time::Instant;

use nalgebra::Vector3;
use ptzcal::geometry::Ray;
use ptzcal::pointing::{CloudSurface, MeasuredBy, PointNoise};

use super::exploring::explored;
use super::figure::Figure;
use super::setups::{Coverage, Setup};
use super::thesis::{Noise, depth};

/// Set-ups that the tests do not use.
const FIRST: u64 = 10_000;
const CLICKS: usize = 20;

pub fn run(runs: usize, report: &mut impl FnMut(Vec<Figure>)) {
    coverage(runs, report);
    for cameras in [&[0][..], &[1], &[0, 1]] {
        report(ranges(cameras));
    }
    report(times());
}

fn coverage(runs: usize, report: &mut impl FnMut(Vec<Figure>)) {
    let mut all = [Coverage::default(); 6];
    let fine = runs.div_ceil(4);
    for (i, seed) in (FIRST..FIRST + runs as u64).enumerate() {
        let setup = Setup::new(seed);
        all[0].add(setup.on_a_surveyed_plane(CLICKS));
        all[1].add(setup.on_a_measured_plane(CLICKS));
        all[2].add(setup.back_on_a_plane(CLICKS));
        all[3].add(setup.at_a_distance(CLICKS));
        all[4].add(setup.on_the_cloud(CLICKS, 1));
        if i < fine {
            all[5].add(setup.on_the_cloud(CLICKS, 3));
        }
    }
    let names = [
        "a surveyed plane",
        "a plane of this rig",
        "head camera to fixed",
        "a known distance",
        "a cloud of 0.7 degrees",
        "a cloud of 0.25 degrees",
    ];
    for (c, name) in all.iter().zip(names) {
        let share = c.inside as f64 / c.clicks.max(1) as f64;
        let edges = c.edges as f64 / (c.clicks + c.edges).max(1) as f64;
        let setup = match c.edges {
            0 => format!("clicks inside the 95 % ellipse, {name}"),
            _ => format!("clicks inside the 95 % ellipse, {name} ({:.0} % said to be at edges)", 100.0 * edges),
        };
        // Within 2 % of 95 %.
        let ratio = (share - 0.95).abs() / 0.02;
        let figure = 100.0 * share;
        report(vec![Figure {
            goal: "point",
            setup,
            figure,
            unit: "%",
            bound: 95.0,
            ratio,
            limit: 1.0,
            runs: c.clicks,
        }]);
    }
}

fn ranges(cameras: &[usize]) -> Vec<Figure> {
    let found: Vec<_> = (1..=5).flat_map(|seed| explored(seed, 1, cameras)).collect();
    let least = |of: &dyn Fn(&super::exploring::Found) -> f64| found.iter().map(of).fold(f64::INFINITY, f64::min);
    let shots = found.iter().map(|f| f.shots).max().unwrap_or(0) as f64;
    let figure = |setup: String, figure: f64, unit, bound: f64, ratio: f64, limit: f64| Figure {
        goal: "range",
        setup,
        figure,
        unit,
        bound,
        ratio,
        limit,
        runs: found.len(),
    };
    let covered = least(&|f| f.covered);
    let who = format!("exploring for fixed camera {cameras:?}, seeds 1 to 5");
    vec![
        figure(format!("{who}: shots, most"), shots, "", 59.0, shots / 59.0, 1.0),
        figure(
            format!("{who}: visible directions in the range, least"),
            100.0 * covered,
            "%",
            90.0,
            0.9 / covered,
            1.0,
        ),
        figure(format!("{who}: of them in the mask"), 100.0 * least(&|f| f.in_mask), "%", 0.0, 0.0, f64::INFINITY),
        figure(format!("{who}: of the range visible"), 100.0 * least(&|f| f.visible), "%", 0.0, 0.0, f64::INFINITY),
    ]
}

/// A million points of the room.
fn times() -> Vec<Figure> {
    let mut noise = Noise::new(7);
    let mut direction = || Vector3::new(noise.uniform() - 0.5, noise.uniform() - 0.5, 0.7).normalize();
    let points: Vec<_> = (0..1_000_000)
        .map(|_| {
            let d = direction();
            d * depth(&Vector3::zeros(), &d)
        })
        .collect();
    let begun = Instant::now();
    let cloud = CloudSurface::new(&points, PointNoise::Unknown, MeasuredBy::Others).expect("a cloud");
    let built = begun.elapsed().as_secs_f64();
    let origin = Vector3::new(-0.3, 0.1, 0.0);
    let rays: Vec<Ray> = (0..1000).map(|_| Ray { origin, direction: direction() }).collect();
    let begun = Instant::now();
    let met = rays.iter().filter(|r| cloud.hit(r, 1e-3).is_ok()).count();
    let each = begun.elapsed().as_secs_f64() / rays.len() as f64;
    let time = |setup: &str, figure, unit, runs| Figure {
        goal: "time",
        setup: setup.into(),
        figure,
        unit,
        bound: 0.0,
        ratio: 0.0,
        limit: f64::INFINITY,
        runs,
    };
    vec![time("arranging a cloud of 10^6 points", built, "s", 1), time("where a ray meets it", each * 1e3, "ms", met)]
}
