//! Drawings in a camera's own pixels: what was seen where, and how the residuals point.

use nalgebra::Vector2;

use super::seen::Seen;
use crate::draw::svg::{COLOURS, Svg};
use crate::error::{Error, Result};
use crate::format::{base64, encode_jpeg};
use crate::geometry::Camera;
use crate::image::ImageView;

/// Cells of the image in which measurements are looked for.
pub const CELLS: [usize; 2] = [8, 6];
/// Drawings are this wide, whatever the image.
const WIDTH: f64 = 800.0;
const USED: &str = COLOURS[2];
const ASIDE: &str = COLOURS[1];

/// From the camera's pixels to the drawing's.
struct Plane {
    scale: f64,
    size: [f64; 2],
}

impl Plane {
    fn of(camera: &Camera) -> Self {
        let scale = WIDTH / f64::from(camera.width);
        Self { scale, size: [WIDTH, scale * f64::from(camera.height)] }
    }

    /// Pixel (0, 0) is the CENTRE of the top-left pixel.
    fn place(&self, pixel: &Vector2<f64>) -> [f64; 2] {
        [self.scale * (pixel.x + 0.5), self.scale * (pixel.y + 0.5)]
    }

    fn begin(&self) -> Svg {
        Svg::new([0.0, 0.0, self.size[0], self.size[1]], 20.0)
    }

    fn frame(&self, svg: &mut Svg) {
        svg.outline([0.5, 0.5], [self.size[0] - 1.0, self.size[1] - 1.0], "#777");
    }
}

/// Number of used pixels in every cell, row by row.
pub fn cells(camera: &Camera, seen: &Seen) -> Vec<usize> {
    let mut counts = vec![0; CELLS[0] * CELLS[1]];
    for pixel in seen.used_pixels() {
        let cell = |v: f64, size: u32, n: usize| (((v + 0.5) / f64::from(size) * n as f64) as usize).min(n - 1);
        let (x, y) = (cell(pixel.x, camera.width, CELLS[0]), cell(pixel.y, camera.height, CELLS[1]));
        counts[y * CELLS[0] + x] += 1;
    }
    counts
}

/// What was seen over the camera's picture: used green, set aside crossed out, empty cells grey.
///
/// # Errors
/// `InvalidArgument` for a picture of another size.
pub fn measurements(camera: &Camera, seen: &Seen, picture: Option<&ImageView<'_>>) -> Result<String> {
    let plane = Plane::of(camera);
    let mut svg = plane.begin();
    let [width, height] = plane.size;
    if let Some(view) = picture {
        if (view.width(), view.height()) != (camera.width, camera.height) {
            let reason =
                format!("{} x {}, the camera has {} x {}", view.width(), view.height(), camera.width, camera.height);
            return Err(Error::invalid("picture", reason));
        }
        let data = base64(&encode_jpeg(view)?);
        svg.put(format_args!(
            "<image width=\"{width:.1}\" height=\"{height:.1}\" href=\"data:image/jpeg;base64,{data}\"/>\n"
        ));
    }
    let cell = [width / CELLS[0] as f64, height / CELLS[1] as f64];
    for (k, _) in cells(camera, seen).iter().enumerate().filter(|(_, n)| **n == 0) {
        let corner = [(k % CELLS[0]) as f64 * cell[0], (k / CELLS[0]) as f64 * cell[1]];
        svg.rectangle(corner, cell, "rgba(90,90,90,0.35)");
    }
    for line in &seen.lines {
        svg.polyline(&line.ends.map(|e| plane.place(&e)), if line.used { USED } else { ASIDE }, 2.5, !line.used);
    }
    for point in &seen.points {
        let place = plane.place(&point.pixel);
        if point.used { svg.circle(place, 4.0, USED) } else { svg.cross(place, 5.0, ASIDE, 2.0) }
    }
    plane.frame(&mut svg);
    Ok(svg.finish())
}

/// Residuals as strokes from where a point was predicted, so much longer than they are that they can be
/// seen; the factor is written in.
pub fn residuals(camera: &Camera, seen: &Seen) -> String {
    let plane = Plane::of(camera);
    let mut svg = plane.begin();
    let mut lengths: Vec<f64> = seen.used().map(|p| p.residual.norm()).filter(|l| l.is_finite()).collect();
    lengths.sort_by(f64::total_cmp);
    let typical = lengths.get(lengths.len() * 9 / 10).copied().unwrap_or(1.0).max(1e-6);
    let factor = round(0.04 * f64::from(camera.width) / typical);
    for point in seen.used().filter(|p| p.residual.norm().is_finite()) {
        let from = point.pixel - point.residual;
        let [a, b] = [from, from + point.residual * factor].map(|p| plane.place(&p));
        svg.line(a, b, COLOURS[0], 1.5);
        svg.circle(b, 2.0, COLOURS[0]);
    }
    svg.rectangle([4.0, plane.size[1] - 32.0], [250.0, 28.0], "rgba(255,255,255,0.85)");
    svg.text([10.0, plane.size[1] - 11.0], "start", &format!("{factor} times as long"));
    plane.frame(&mut svg);
    svg.finish()
}

/// One, two or five times a power of ten, not above.
fn round(value: f64) -> f64 {
    let unit = 10f64.powf(value.max(1e-9).log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|m| m * unit).find(|v| *v <= value).unwrap_or(unit)
}
