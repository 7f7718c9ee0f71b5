//! What a camera calibrated from boards has beside every other: its views, and what to add.

use nalgebra::Vector3;

use super::camera::uncertainty;
use super::page::{counted, escape, figure, number, table};
use crate::calibrate::{BoardCalibration, BoardPose};
use crate::draw::chart::{Axis, Chart, Mark, Series};

pub fn section(name: &str, found: &BoardCalibration) -> String {
    let used = found.views.iter().filter(|v| v.used).count();
    let mut html = format!("<section><h2>{}: views</h2>\n", escape(name));
    html += &format!("<p>{} of {} were used.", used, counted(found.views.len(), "view"));
    if found.bending != Vector3::zeros() {
        let [x, xy, y] = [found.bending.x, found.bending.y, found.bending.z].map(number);
        html += &format!(" The sheet's rim is off its tangent plane by {x}, {xy} and {y} of the board's unit.");
    }
    html += "</p>\n";
    if !found.advice.is_empty() {
        let items: String = found.advice.iter().map(|a| format!("<li>{}</li>", escape(a))).collect();
        html += &format!("<p>What would make it better, the most needed first:</p><ol>{items}</ol>\n");
    }
    let head = ["view", "corners used", "rms (px)", "distance", "turned (degrees)", ""];
    let rows: Vec<Vec<String>> = found.views.iter().enumerate().map(|(i, v)| row(i, v)).collect();
    html += &table(&head, &rows, 1);
    html += "<div class=\"figures\">\n";
    let points = found.views.iter().filter(|v| v.used).map(|v| [turned(v), distance(v)]).collect();
    let chart = Chart {
        title: "Views".into(),
        x: Axis::linear("turned away from the camera (degrees)"),
        y: Axis::linear("distance (board's unit)"),
        series: vec![Series { name: String::new(), points, mark: Mark::Dots, colour: 0 }],
        equal: false,
    };
    html += &figure(&chart.to_compact_svg(), "Boards that are all seen from the front leave the focal length open.");
    let caption = "By what is not known of focal lengths, principal point and lens.";
    html += &uncertainty(&found.calibration, 1.0, "Standard deviation of a pixel's direction (mrad)".into(), caption);
    html + "</div></section>\n"
}

fn row(i: usize, view: &BoardPose) -> Vec<String> {
    vec![
        i.to_string(),
        format!("{} of {}", view.inliers, view.corners),
        format!("{:.3}", view.rms),
        format!("{:.3}", distance(view)),
        format!("{:.1}", turned(view)),
        if view.used { String::new() } else { "set aside".to_owned() },
    ]
}

fn distance(view: &BoardPose) -> f64 {
    view.pose.translation.norm()
}

/// Between the board's normal and the line of sight to its origin, degrees.
fn turned(view: &BoardPose) -> f64 {
    let normal: Vector3<f64> = view.pose.rotation.column(2).into();
    let sight = view.pose.translation.normalize();
    normal.dot(&sight).abs().min(1.0).acos().to_degrees()
}
