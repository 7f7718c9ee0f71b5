//! Exploring: the range of pan and tilt in which each fixed camera of the simulator's room sees the laser,
//! alone and together with the other.

#[path = "support/explore.rs"]
mod exploring;

use exploring::explored;

/// `PTZCAL_EXPLORE_SEEDS=5` for all seeds of the issue.
fn seeds() -> u64 {
    std::env::var("PTZCAL_EXPLORE_SEEDS").ok().and_then(|n| n.parse().ok()).unwrap_or(2)
}

#[test]
fn nine_tenths_of_what_each_camera_sees_are_found_with_under_sixty_shots() {
    for seed in 1..=seeds() {
        for cameras in [&[0][..], &[1], &[0, 1]] {
            for (camera, f) in cameras.iter().zip(explored(seed, 1, cameras)) {
                println!("seed {seed}, camera {camera} of {cameras:?}: {f:.3?}");
                assert!(f.shots < 60 && f.seen > 8 && f.covered >= 0.9, "{f:?}");
                // The boxes hide much of the range; the mask says so, as far as so few shots tell.
                assert!(f.in_mask > 0.5 && (f.said - f.visible).abs() < 0.2, "{f:?}");
            }
        }
    }
}
