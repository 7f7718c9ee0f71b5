//! The section of a joint adjustment: rig, stations and planes. Its cameras have sections of their own.

use super::page::{counted, escape, measured, number, table, verdict};
use crate::adjust::Adjusted;
use crate::geometry::rigid::log;

pub fn section(name: &str, survey: &Adjusted) -> String {
    let names = survey.parameter_names();
    let places = survey.places();
    let sigma = |i: usize| survey.covariance.get((i, i)).map_or(f64::NAN, |v| v.max(0.0).sqrt());
    let mut html = format!("<section><h2>{}</h2>\n", escape(name));
    html += &verdict(&survey.check.warnings, "Model and stated noise explain all measurements.");
    let head = survey.head_inliers.iter().filter(|i| **i).count();
    html += &format!(
        "<p>{} from {}, seen by {}; the head's spot was used of {head}. Chi-square {} for {} degrees of freedom \
         (chance {}).",
        counted(survey.input.shots().len(), "shot"),
        counted(survey.stations.len(), "station"),
        counted(survey.cameras.len(), "camera"),
        number(survey.check.chi2.round()),
        survey.check.freedom,
        number((1e4 * survey.check.probability).round() / 1e4)
    );
    if let Some(weakest) = survey.weakest() {
        html += &format!(" What the data determine worst: {}.", escape(weakest.text.trim_start_matches("weakest: ")));
        if !weakest.prior_only.is_empty() {
            html += &format!(" Known by what was stated beforehand only: {}.", escape(&weakest.prior_only.join(", ")));
        }
    }
    html += "</p>\n<h3>Rig</h3>\n";
    let values = survey.rig.parameters();
    let rows: Vec<Vec<String>> = places[0]
        .clone()
        .zip(values)
        .map(|(i, value)| {
            let [value, sigma] = measured(value, sigma(i));
            vec![escape(&names[i]), value, sigma]
        })
        .collect();
    html += &table(&["", "estimate", "standard deviation"], &rows, 1);
    html += "<h3>Stations</h3>\n";
    let mut rows = Vec::new();
    for (index, (pose, place)) in survey.stations.iter().zip(&places[1..]).enumerate() {
        let turn = log(&pose.rotation);
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let [angle, angle_sigma] = measured(turn[k].to_degrees(), sigma(place.start + k).to_degrees());
            let [position, position_sigma] = measured(pose.translation[k], sigma(place.start + 3 + k));
            rows.push(vec![format!("station {index} {axis}"), angle, angle_sigma, position, position_sigma]);
        }
    }
    let head = ["", "rotation (°)", "to", "position (m)", "to"];
    html += &table(&head, &rows, 1);
    if !survey.planes.is_empty() {
        html += "<h3>Planes</h3>\n";
        html += &planes(survey);
    }
    html + "</section>\n"
}

fn planes(survey: &Adjusted) -> String {
    let row = |(index, plane): (usize, &crate::geometry::Plane)| {
        let n = plane.normal;
        let hits = (0..survey.input.shots().len()).filter(|s| survey.input.plane_of(*s) == Some(index));
        let used = hits.clone().filter(|s| survey.plane_inliers[*s]).count();
        let sigma = survey.plane_covariance(index).map_or(f64::NAN, |c| c[(3, 3)].max(0.0).sqrt());
        let [distance, sigma] = measured(plane.distance, sigma);
        let normal = format!("{:.4} {:.4} {:.4}", n.x, n.y, n.z);
        vec![format!("plane {index}"), normal, distance, sigma, format!("{used} of {}", hits.count())]
    };
    let rows: Vec<Vec<String>> = survey.planes.iter().enumerate().map(row).collect();
    table(&["", "normal", "distance (m)", "to", "hits used"], &rows, 1)
}
