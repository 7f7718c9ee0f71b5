//! The whole way in the simulator: scan, detect, calibrate, compare with the simulator's truth.

use super::Figure;

pub fn run(_report: &mut impl FnMut(Vec<Figure>)) {}
