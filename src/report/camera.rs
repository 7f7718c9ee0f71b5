//! The section of one calibrated camera.

use nalgebra::{Matrix3, Vector2};

use super::image_plane::{self, CELLS};
use super::page::{Page, counted, escape, figure, measured, number, table, thinned, thinned_note, verdict};
use super::seen::Seen;
use crate::calibrate::Calibration;
use crate::draw::chart::{Axis, Chart, HeatMap, Mark, Series};
use crate::error::Result;
use crate::geometry::Distortion;
use crate::geometry::linalg::symmetric_eigen3;
use crate::geometry::rigid::log;
use crate::image::ImageView;

/// Dots of one figure.
const MOST: usize = 3000;
/// Part of the image without measurements beyond which lens and covariance are extrapolated there.
const BARE: f64 = 0.4;
/// Least ratio of far to near for which distance and focal length come apart well.
const RELIEF: f64 = 1.3;
/// Share of the measurements set aside beyond which something else than noise is at work.
const ASIDE: f64 = 0.3;

/// A camera in the summary of all.
#[derive(Debug, Clone)]
pub struct Summary {
    pub name: String,
    focal: [String; 2],
    /// Standard deviation of the centre's worst direction, metres; `None` without a pose.
    place: Option<f64>,
    rms: f64,
    used: usize,
    all: usize,
    warnings: usize,
}

/// All cameras in one table.
pub fn summaries(page: &mut Page, cameras: &[Summary]) {
    if cameras.is_empty() {
        return;
    }
    let row = |c: &Summary| {
        let well = if c.warnings == 0 { "none".to_owned() } else { c.warnings.to_string() };
        vec![
            escape(&c.name),
            format!("{} &plusmn; {}", c.focal[0], c.focal[1]),
            c.place.map_or_else(|| "&ndash;".to_owned(), |sigma| number(1e3 * sigma)),
            format!("{:.3}", c.rms),
            format!("{} of {}", c.used, c.all),
            well,
        ]
    };
    let rows: Vec<Vec<String>> = cameras.iter().map(row).collect();
    let head = ["camera", "focal length (px)", "position to (mm)", "rms (px)", "measurements used", "warnings"];
    page.put("<section><h2>Cameras</h2>\n");
    page.put(&table(&head, &rows, 1));
    page.put("</section>\n");
}

pub fn section(
    name: &str,
    calibration: &Calibration,
    seen: Option<&Seen>,
    picture: Option<&ImageView<'_>>,
) -> Result<(String, Summary)> {
    let used = calibration.inliers.iter().filter(|i| **i).count();
    let all = calibration.inliers.len();
    let mut warnings = calibration.check.warnings.clone();
    if let Some(seen) = seen {
        warnings.extend(doubts(calibration, seen));
    }
    if (all - used) as f64 > ASIDE * all as f64 {
        warnings.push(format!("{} of {all} measurements were set aside", all - used));
    }
    let mut html = format!("<section><h2>{}</h2>\n", escape(name));
    let well = "The model explains the measurements, and they cover image and depth.";
    html += &verdict(&warnings, well);
    html += &format!(
        "<p>{} of {} were used; their residuals are {:.3} px (root mean square), the noise {:.2} times what was stated.",
        used,
        counted(all, "measurement"),
        calibration.rms,
        calibration.noise_factor
    );
    if let Some(weakness) = calibration.weakest() {
        html += &format!(" {}.", escape(&sentence_case(&weakness.text)));
    }
    html += "</p>\n";
    html += &parameters(calibration);
    html += "<div class=\"figures\">\n";
    if let Some(seen) = seen {
        html += &figures(calibration, seen, picture)?;
    }
    html += "</div></section>\n";
    let covariance = &calibration.covariance;
    let at = covariance.nrows().checked_sub(3).filter(|_| has_pose(calibration));
    let place = at.map(|at| largest(&covariance.fixed_view::<3, 3>(at, at).into_owned()));
    let focal = measured(calibration.camera.intrinsics.fx, sigma(calibration, 0));
    let summary =
        Summary { name: name.to_owned(), focal, place, rms: calibration.rms, used, all, warnings: warnings.len() };
    Ok((html, summary))
}

/// What the measurements leave open.
fn doubts(calibration: &Calibration, seen: &Seen) -> Vec<String> {
    let mut doubts = Vec::new();
    let cells = image_plane::cells(&calibration.camera, seen);
    let bare = cells.iter().filter(|n| **n == 0).count();
    if bare as f64 > BARE * cells.len() as f64 {
        doubts.push(format!(
            "{:.0} % of the image hold no measurement: lens and stated uncertainty are extrapolated there",
            100.0 * bare as f64 / cells.len() as f64
        ));
    }
    let depths = seen.depths(calibration);
    if let (Some(near), Some(far)) = (percentile(&depths, 0.05), percentile(&depths, 0.95))
        && near > 0.0
        && far < RELIEF * near
    {
        doubts.push(format!(
            "nearly all depths are between {} and {} m: focal length and distance trade off; add nearer or farther points",
            number(near),
            number(far)
        ));
    }
    doubts
}

/// Of ascending values.
fn percentile(values: &[f64], share: f64) -> Option<f64> {
    values.get((share * values.len().saturating_sub(1) as f64).round() as usize).copied()
}

fn sentence_case(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A camera calibrated from boards alone has none: its covariance is zero there.
fn has_pose(calibration: &Calibration) -> bool {
    (0..6).any(|i| calibration.covariance.nrows().checked_sub(6 - i).is_some_and(|at| sigma(calibration, at) != 0.0))
}

fn sigma(calibration: &Calibration, i: usize) -> f64 {
    calibration.covariance.get((i, i)).map_or(f64::NAN, |v| v.max(0.0).sqrt())
}

/// Standard deviation of the worst direction.
fn largest(c: &Matrix3<f64>) -> f64 {
    symmetric_eigen3(c).map_or(f64::NAN, |(values, _)| values.iter().copied().fold(0.0, f64::max).sqrt())
}

/// Every parameter with its standard deviation.
fn parameters(calibration: &Calibration) -> String {
    let camera = &calibration.camera;
    let mut rows = Vec::new();
    let mut row = |name: &str, value: f64, sigma: f64, unit: &str| {
        // What was left out of the model.
        if value == 0.0 && sigma == 0.0 {
            return;
        }
        let [value, sigma] = measured(value, sigma);
        rows.push(vec![name.to_owned(), value, sigma, unit.to_owned()]);
    };
    let names = ["focal length x", "focal length y", "skew", "principal point x", "principal point y"];
    for (i, (name, value)) in names.into_iter().zip(camera.intrinsics.to_array()).enumerate() {
        row(name, value, sigma(calibration, i), "px");
    }
    let lens: &[&str] = match camera.distortion {
        Distortion::None => &[],
        Distortion::BrownConrady(_) => &["k1", "k2", "p1", "p2", "k3"],
        Distortion::Division(_) => &["lambda"],
        Distortion::Fisheye(_) => &["k1", "k2", "k3", "k4"],
    };
    let coefficients = camera.distortion.coefficients();
    for (i, (name, value)) in lens.iter().zip(coefficients).enumerate() {
        row(&format!("lens {name}"), *value, sigma(calibration, 5 + i), "");
    }
    let pose = 5 + coefficients.len();
    let turn = log(&camera.pose.rotation);
    let centre = camera.centre();
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let name = format!("rotation {axis}");
        row(&name, turn[i].to_degrees(), sigma(calibration, pose + i).to_degrees(), "&deg;");
    }
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        row(&format!("position {axis}"), centre[i], sigma(calibration, pose + 3 + i), "m");
    }
    let table = table(&["", "estimate", "standard deviation", "unit"], &rows, 1);
    if !has_pose(calibration) {
        return table;
    }
    table + "<p>The rotation is a vector, world to camera; the position is the camera's centre in the world.</p>\n"
}

fn figures(calibration: &Calibration, seen: &Seen, picture: Option<&ImageView<'_>>) -> Result<String> {
    let camera = &calibration.camera;
    let cells = image_plane::cells(camera, seen);
    let covered = 100 * cells.iter().filter(|n| **n > 0).count() / cells.len();
    let mut html = figure(
        &image_plane::measurements(camera, seen, picture)?,
        &format!(
            "Where it was measured: used (green), set aside (crosses). {covered} % of {} x {} parts of the image hold \
             a measurement; those without are grey.",
            CELLS[0], CELLS[1]
        ),
    );
    if seen.used().next().is_none() {
        return Ok(html);
    }
    html += &figure(
        &image_plane::residuals(camera, seen),
        "Measured against predicted. Strokes that point the same way in a part of the image show what the model does not know.",
    );
    html += &scatter(seen);
    html += &radial(calibration, seen);
    html += &depths(calibration, seen);
    html += &across(calibration, seen);
    Ok(html)
}

fn series(points: Vec<[f64; 2]>, mark: Mark, colour: usize) -> Series {
    Series { name: String::new(), points, mark, colour }
}

fn scatter(seen: &Seen) -> String {
    let all: Vec<[f64; 2]> = seen.used().map(|p| [p.residual.x, p.residual.y]).collect();
    let chart = Chart {
        title: "Residuals".into(),
        x: Axis::linear("right (px)"),
        y: Axis::linear("down (px)"),
        series: vec![series(thinned(&all, MOST), Mark::Dots, 0)],
        equal: true,
    };
    let caption = format!("Round, and about zero, where only noise is left.{}", thinned_note(all.len(), MOST));
    figure(&chart.to_compact_svg(), &caption)
}

/// Residuals outwards against the distance from the principal point, with their means: what a wrong lens
/// model leaves.
fn radial(calibration: &Calibration, seen: &Seen) -> String {
    let k = &calibration.camera.intrinsics;
    let centre = Vector2::new(k.cx, k.cy);
    let outwards = |pixel: &Vector2<f64>, residual: &Vector2<f64>| {
        let from = pixel - centre;
        let radius = from.norm();
        (radius > 0.0).then(|| [radius, residual.dot(&from) / radius])
    };
    let all: Vec<[f64; 2]> = seen.used().filter_map(|p| outwards(&p.pixel, &p.residual)).collect();
    let greatest = all.iter().fold(0.0f64, |most, [radius, _]| most.max(*radius));
    let bins = 8;
    let mut sums = vec![[0.0; 2]; bins];
    for [radius, value] in all.iter().filter(|[_, value]| value.is_finite()) {
        let sum = &mut sums[((radius / greatest * bins as f64) as usize).min(bins - 1)];
        *sum = [sum[0] + value, sum[1] + 1.0];
    }
    let middle = |bin: usize| (bin as f64 + 0.5) / bins as f64 * greatest;
    // A mean of a few says nothing.
    let means = sums.iter().enumerate().filter(|(_, s)| s[1] >= 5.0).map(|(bin, [sum, n])| [middle(bin), sum / n]);
    let mean = Series { name: "mean".into(), points: means.collect(), mark: Mark::Line, colour: 1 };
    let chart = Chart {
        title: "Residuals outwards".into(),
        x: Axis::linear("distance from the principal point (px)"),
        y: Axis::linear("outwards (px)"),
        series: vec![series(thinned(&all, MOST), Mark::Dots, 5), mean],
        equal: false,
    };
    figure(&chart.to_compact_svg(), "A mean that bends away from zero is a lens that the model does not describe.")
}

fn depths(calibration: &Calibration, seen: &Seen) -> String {
    let depths = seen.depths(calibration);
    let (Some(low), Some(high)) = (depths.first().copied(), depths.last().copied()) else { return String::new() };
    let bins = 24;
    let width = ((high - low) / bins as f64).max(1e-9);
    let mut counts = vec![0usize; bins];
    for depth in &depths {
        counts[(((depth - low) / width) as usize).min(bins - 1)] += 1;
    }
    let bars = counts.iter().enumerate().map(|(i, n)| [low + (i as f64 + 0.5) * width, *n as f64]).collect();
    let chart = Chart {
        title: "Depths".into(),
        x: Axis::linear("depth along the camera's axis (m)"),
        y: Axis::linear("measurements"),
        series: vec![series(bars, Mark::Bars, 0)],
        equal: false,
    };
    figure(&chart.to_compact_svg(), "Focal length and distance come apart by depths that differ.")
}

/// How far off a click is, across its ray, by what is not known of the camera.
fn across(calibration: &Calibration, seen: &Seen) -> String {
    let centre = calibration.camera.centre();
    let mut ranges: Vec<f64> = seen.used().filter_map(|p| p.world).map(|x| (x - centre).norm()).collect();
    ranges.sort_by(f64::total_cmp);
    let Some(range) = percentile(&ranges, 0.5) else { return String::new() };
    let title = format!("Standard deviation of a click's place at {} m (mm)", number((100.0 * range).round() / 100.0));
    let caption = "Across the ray, in its worst direction, by what is not known of the camera; the noise of the click itself is not in it.";
    uncertainty(calibration, range, title, caption)
}

/// A map over the image of the standard deviation across a pixel's ray at a range, thousandths of its unit.
pub fn uncertainty(calibration: &Calibration, range: f64, title: String, caption: &str) -> String {
    let middle = |k: usize, n: usize, size: u32| (k as f64 + 0.5) / n as f64 * f64::from(size) - 0.5;
    let value = |x: f64, y: f64| {
        let ray = calibration.back_project(&Vector2::new(x, y), None).ok()?;
        let point = ray.point_at(range, 0.0).ok()?;
        let side = Matrix3::identity() - ray.ray.direction * ray.ray.direction.transpose();
        Some(1e3 * largest(&(side * point.covariance * side)))
    };
    let (width, height) = (calibration.camera.width, calibration.camera.height);
    let x: Vec<f64> = (0..CELLS[0]).map(|i| middle(i, CELLS[0], width)).collect();
    // From the bottom up, as axes go, with the image's own rows written beside.
    let y: Vec<f64> = (0..CELLS[1]).rev().map(|j| middle(j, CELLS[1], height)).collect();
    let values = y.iter().map(|y| x.iter().map(|x| value(*x, *y).unwrap_or(f64::NAN)).collect()).collect();
    let map = HeatMap { title, x_label: "pixel, right".into(), y_label: "pixel, down".into(), x, y, values };
    figure(&map.to_compact_svg(), caption)
}
