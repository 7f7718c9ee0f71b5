//! The lenses of OpenCV, which ROS, COLMAP, mrcal and Kalibr have under names of their own.

use super::super::tree::Place;
use crate::error::Result;
use crate::geometry::Distortion;

/// How many coefficients OpenCV's lenses on the plane have: none, k1 k2 p1 p2, k3, k4 k5 k6 (a rational
/// lens), s1 to s4 (thin prism), tau_x tau_y (a tilted sensor).
const COUNTS: [usize; 6] = [0, 4, 5, 8, 12, 14];

/// k1 k2 p1 p2 [k3 ...]; what stands after k3 must be zero, since our models have none of it.
pub(super) fn on_plane(coefficients: &[f64], place: &Place<'_>) -> Result<Distortion> {
    if !COUNTS.contains(&coefficients.len()) {
        return Err(place.wrong(format!("{} numbers, not 4, 5, 8, 12 or 14", coefficients.len())));
    }
    if coefficients.iter().skip(5).any(|v| *v != 0.0) {
        let kind = match coefficients.iter().rposition(|v| *v != 0.0) {
            Some(5..8) => "rational",
            Some(8..12) => "thin-prism",
            _ => "tilted",
        };
        let count = coefficients.len();
        return Err(place.unsupported(format!("a {kind} lens with {count} coefficients: only k1 k2 p1 p2 k3 are here")));
    }
    let mut five = [0.0; 5];
    five.iter_mut().zip(coefficients).for_each(|(to, from)| *to = *from);
    Ok(if five == [0.0; 5] { Distortion::None } else { Distortion::BrownConrady(five) })
}

/// k1 k2 k3 k4 of the angle.
pub(super) fn fisheye(coefficients: &[f64], place: &Place<'_>) -> Result<Distortion> {
    let four: std::result::Result<[f64; 4], _> = coefficients.try_into();
    four.map(Distortion::Fisheye)
        .map_err(|_| place.wrong(format!("{} numbers of a fisheye lens, not 4", coefficients.len())))
}
