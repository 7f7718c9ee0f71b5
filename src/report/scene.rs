//! The view from above: stations, what the laser touched, and the cameras with their fields of view.

use nalgebra::{Vector2, Vector3};

use super::page::{Page, thinned, thinned_note, wide_figure};
use crate::draw::chart::{Axis, Chart, Mark, Series};
use crate::geometry::{Camera, Rigid};

/// Points that are drawn at most.
const MOST: usize = 4000;

/// All that has a place in the world.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Rig to world.
    stations: Vec<(String, Rigid)>,
    cameras: Vec<(String, Camera)>,
    points: Vec<Vector3<f64>>,
}

impl Scene {
    pub fn add_station(&mut self, name: &str, pose: &Rigid) {
        self.stations.push((name.to_owned(), *pose));
    }

    pub fn add_camera(&mut self, name: &str, camera: &Camera) {
        self.cameras.push((name.to_owned(), *camera));
    }

    pub fn add_points(&mut self, points: impl IntoIterator<Item = Vector3<f64>>) {
        self.points.extend(points.into_iter().filter(|p| p.iter().all(|v| v.is_finite())));
    }

    pub fn draw(&self, page: &mut Page, up: &Vector3<f64>) {
        if self.cameras.is_empty() && self.points.is_empty() {
            return;
        }
        let axes = across(up);
        let place = |x: &Vector3<f64>| [axes[0].dot(x), axes[1].dot(x)];
        let dots = thinned(&self.points, MOST).iter().map(place).collect();
        let mut series = vec![Series { name: "measured points".into(), points: dots, mark: Mark::Dots, colour: 5 }];
        let stations = self.stations.iter().map(|(_, pose)| place(&pose.translation)).collect::<Vec<_>>();
        if !stations.is_empty() {
            let name = if stations.len() == 1 { "rig" } else { "stations of the rig" };
            series.push(Series { name: name.into(), points: stations, mark: Mark::Crosses, colour: 6 });
        }
        for (index, (name, camera)) in self.cameras.iter().enumerate() {
            // Line colours of their own: neither the points' nor the stations'.
            let colour = index % 5;
            series.push(Series { name: name.clone(), points: self.view(camera, &place), mark: Mark::Dashed, colour });
            series.push(Series {
                name: String::new(),
                points: vec![place(&camera.centre())],
                mark: Mark::Line,
                colour,
            });
        }
        let title = String::new();
        let (x, y) = (Axis::linear("right (m)"), Axis::linear("forward (m)"));
        let chart = Chart { title, x, y, series, equal: true };
        let note = thinned_note(self.points.len(), MOST);
        page.put("<section><h2>From above</h2>\n");
        let caption = format!("Each camera with the edges of its view, up to the median distance of the points.{note}");
        page.put(&wide_figure(&chart.to_compact_svg(), &caption));
        page.put("</section>\n");
    }

    /// The outline of a camera's view from above: from its centre along its left and right edges.
    fn view(&self, camera: &Camera, place: &impl Fn(&Vector3<f64>) -> [f64; 2]) -> Vec<[f64; 2]> {
        let centre = camera.centre();
        let mut ranges: Vec<f64> = self.points.iter().map(|p| (p - centre).norm()).collect();
        let middle = ranges.len() / 2;
        let range = if ranges.is_empty() { 1.0 } else { *ranges.select_nth_unstable_by(middle, f64::total_cmp).1 };
        let half = 0.5 * f64::from(camera.height) - 0.5;
        let edge = |x: f64| {
            let ray = camera.back_project(&Vector2::new(x, half))?;
            Some(place(&ray.at(range)))
        };
        let outline = [edge(-0.5), Some(place(&centre)), edge(f64::from(camera.width) - 0.5)];
        outline.into_iter().flatten().collect()
    }
}

/// Two axes of the horizontal plane: the world's x, or what is nearest to it, and forward.
fn across(up: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let wanted = if up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let right = (wanted - up * up.dot(&wanted)).normalize();
    [right, up.cross(&right)]
}
