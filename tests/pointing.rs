//! Pointing: coverage of its ellipses over many independently calibrated set-ups that nobody tuned to,
//! and every refusal.

#[path = "support/pointing.rs"]
mod setups;
#[path = "support/thesis.rs"]
mod thesis;

use setups::{Coverage, Setup};

#[test]
fn nineteen_of_twenty_clicks_are_inside_the_stated_ellipse() {
    let runs = std::env::var("PTZCAL_POINTING_SETUPS").ok().and_then(|n| n.parse().ok()).unwrap_or(20);
    let mut all = [Coverage::default(); 6];
    for seed in 0..runs {
        let setup = Setup::new(seed);
        all[0].add(setup.on_a_surveyed_plane(20));
        all[1].add(setup.on_a_measured_plane(20));
        all[2].add(setup.on_the_cloud(20, 1));
        all[5].add(setup.on_the_cloud(20, 4));
        all[3].add(setup.back_on_a_plane(20));
        all[4].add(setup.at_a_distance(20));
    }
    for (c, name) in all.iter().zip(["surveyed", "measured", "cloud", "back", "distance", "fine cloud"]) {
        println!("{name}: {c:?} {:.4}", c.inside as f64 / c.clicks as f64);
    }
}
