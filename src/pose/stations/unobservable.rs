//! What planes cannot tell of a pose: they move along themselves unseen.

use nalgebra::Vector3;

use crate::error::{Degeneracy, Error, Result};
use crate::geometry::linalg::right_singular;

/// Least extent of normals in a direction, relative to their largest: about 6 degrees.
const MIN_EXTENT: f64 = 0.1;

/// Refuses normals that do not span space, and says what they leave free.
pub(super) fn check_span(station: &str, normals: impl Iterator<Item = Vector3<f64>>) -> Result<()> {
    let rows: Vec<[f64; 3]> = normals.map(|n| n.into()).collect();
    let svd = right_singular(&rows);
    let [first, second, third] = svd.values;
    let direction = |k: usize| numbers(&Vector3::from(svd.vectors[k]));
    let free = if rows.is_empty() {
        "has no planes".to_owned()
    } else if second <= MIN_EXTENT * first {
        format!(
            "has parallel planes only: the translation along {} and {} and the rotation about {} are unobservable",
            direction(1),
            direction(2),
            direction(0)
        )
    } else if third <= MIN_EXTENT * first {
        format!("has planes in two directions only: the translation along {} is unobservable", direction(2))
    } else {
        return Ok(());
    };
    Err(Error::degenerate(Degeneracy::Parallel, format!("{station} {free}")))
}

/// The planes that both stations saw may have two directions only.
pub(super) fn sliding(direction: &Vector3<f64>) -> Error {
    let detail = format!(
        "what the stations saw fits as well if the planes that both saw have two directions only: then the translation \
         along {} in station_a is unobservable",
        numbers(direction)
    );
    Error::degenerate(Degeneracy::Parallel, detail)
}

/// A direction, without its sign.
fn numbers(direction: &Vector3<f64>) -> String {
    let sign = 1f64.copysign(direction[direction.iamax()]);
    let [x, y, z] = <[f64; 3]>::from(direction * sign);
    // No minus before zero.
    let clean = |v: f64| if v.abs() < 5e-4 { 0.0 } else { v };
    format!("({:.3}, {:.3}, {:.3})", clean(x), clean(y), clean(z))
}
