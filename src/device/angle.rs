//! Angles as devices count them.

use std::f64::consts::TAU;

/// The same direction within a range, where it has it; radians.
pub(crate) fn turned_into([low, high]: [f64; 2], angle: f64) -> f64 {
    // A whisker for limits given in degrees.
    let within = |a: &f64| (low - 1e-9..=high + 1e-9).contains(a);
    [angle, angle + TAU, angle - TAU].into_iter().find(within).unwrap_or(angle)
}
