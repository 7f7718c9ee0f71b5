//! Which view to add next, in words.

use nalgebra::Vector3;

use super::fit::Selection;
use super::start::centroid;
use super::views::Boards;
use crate::geometry::Rigid;

/// A board is tilted about an axis when its normal leans by this much (radians, 15 degrees).
const TILTED: f64 = 0.26;
/// Farthest over nearest board below which all are at one distance.
const RANGE: f64 = 1.3;
/// Zhang: the error falls fast up to about this many views.
const FEW_VIEWS: usize = 5;
/// Parts of the image, three by three.
const CELLS: [[&str; 3]; 3] = [
    ["the upper left", "the upper middle", "the upper right"],
    ["the left", "the middle", "the right"],
    ["the lower left", "the lower middle", "the lower right"],
];

/// Sentences without a full stop, the most needed first; none when nothing is missing.
pub(crate) fn advise(boards: &Boards, poses: &[Rigid], used: &Selection) -> Vec<String> {
    let used_views = || (0..poses.len()).filter(|v| used.views[*v]);
    let mut advice = Vec::new();
    let count = used_views().count();
    // The normal turned away from the camera, about the line of sight to the board's middle.
    let normal = |v: usize| -> Vector3<f64> {
        let n: Vector3<f64> = poses[v].rotation.column(2).into();
        n * n.z.signum()
    };
    let tilt = |axis: usize| used_views().map(|v| (normal(v)[axis] / normal(v).z).atan().abs()).fold(0.0, f64::max);
    if tilt(0) < TILTED {
        advice
            .push("no view is tilted about the vertical axis: turn the board left or right by 20 to 40 degrees".into());
    }
    if tilt(1) < TILTED {
        advice.push(
            "no view is tilted about the horizontal axis: lean the board forwards or backwards by 20 to 40 degrees"
                .into(),
        );
    }
    let empty = empty_cells(boards, used);
    if !empty.is_empty() {
        advice.push(format!("no corners in {} of the image", list(&empty)));
    }
    let depths: Vec<f64> = used_views().map(|v| poses[v].apply(&centroid(&boards.views()[v]).push(0.0)).z).collect();
    let (near, far) = depths.iter().fold((f64::MAX, 0.0f64), |(n, f), d| (n.min(*d), f.max(*d)));
    if far < RANGE * near {
        advice.push("all views are at about the same distance: add some nearer and some farther".into());
    }
    if count < FEW_VIEWS {
        let views = if count == 1 { "one view".into() } else { format!("{count} views") };
        advice.push(format!("only {views}: {FEW_VIEWS} or more make the result much surer"));
    }
    advice
}

fn empty_cells(boards: &Boards, used: &Selection) -> Vec<&'static str> {
    let mut seen = [[false; 3]; 3];
    let (w, h) = (f64::from(boards.width()), f64::from(boards.height()));
    for (view, mask) in boards.views().iter().zip(&used.corners) {
        for (corner, _) in view.corners.iter().zip(mask).filter(|(_, used)| **used) {
            let third = |x: f64, size: f64| (((x + 0.5) / size * 3.0).max(0.0) as usize).min(2);
            seen[third(corner.pixel.y, h)][third(corner.pixel.x, w)] = true;
        }
    }
    let cells = seen.iter().flatten().zip(CELLS.iter().flatten());
    cells.filter(|(seen, _)| !**seen).map(|(_, name)| *name).collect()
}

fn list(items: &[&str]) -> String {
    match items {
        [] => String::new(),
        [one] => (*one).into(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
