//! Triangles drawn as a camera sees them, lens distortion included.
//!
//! Each pixel's own ray is intersected with the triangles around it: with homogeneous edge functions
//! (Olano and Greer, "Triangle scan conversion using 2D homogeneous coordinates", 1997) there is no
//! clipping, depth is exact at every pixel of any lens, and neighbours leave no gap, since both have
//! the same numbers for the edge between them.

use nalgebra::{Vector2, Vector3};

use super::lens::Lens;
use crate::geometry::Mesh;

/// Times that a triangle is halved where only part of it is in front of the lens.
const MAX_HALVINGS: u32 = 10;
/// Pixels along an edge after which a bent one is looked at again.
const EDGE_STEP: f64 = 32.0;
/// By what a bent edge bulges in between, pixels.
const BULGE: f64 = 1.0;
/// Rounding of projected corners, pixels.
const MARGIN: f64 = 1e-6;

/// Share of a triangle by which rays may pass it: those through the corners of a depth map's surface
/// meet it in its own camera.
const ROUNDING: f64 = 1e-9;

/// Where the ray meets the triangle: depth along the optical axis.
pub struct Hit {
    pub triangle: usize,
    /// y * width + x.
    pub pixel: usize,
    /// Metres.
    pub depth: f64,
}

/// Tells `draw` of every pixel of every triangle, seen from either side, hidden or not.
pub fn rasterise(mesh: &Mesh, lens: &Lens<'_>, draw: &mut dyn FnMut(Hit)) {
    for triangle in 0..mesh.triangles.len() {
        let corners = mesh.corners(triangle).map(|v| lens.camera.pose.apply(&v));
        piece(&corners, lens, 0, &mut |pixel, depth| draw(Hit { triangle, pixel, depth }));
    }
}

/// Weights of a triangle's corners where the ray `d` meets its plane, and how many times `d` that is
/// away; `None` for a ray that misses the triangle.
pub fn meet(corners: &[Vector3<f64>; 3], d: &Vector3<f64>) -> Option<([f64; 3], f64)> {
    let [a, b, c] = corners;
    meet_edges(&[b.cross(c), c.cross(a), a.cross(b)], a.dot(&b.cross(c)), d)
}

fn meet_edges(edges: &[Vector3<f64>; 3], volume: f64, d: &Vector3<f64>) -> Option<([f64; 3], f64)> {
    let e = [edges[0].dot(d), edges[1].dot(d), edges[2].dot(d)];
    let sum = e[0] + e[1] + e[2];
    let slack = -ROUNDING * sum.abs();
    let inside = if sum > 0.0 { e.iter().all(|e| *e >= slack) } else { e.iter().all(|e| -*e >= slack) };
    let length = volume / sum;
    (inside && length > 0.0 && length.is_finite()).then(|| (e.map(|e| e / sum), length))
}

fn piece(corners: &[Vector3<f64>; 3], lens: &Lens<'_>, halvings: u32, draw: &mut dyn FnMut(usize, f64)) {
    if let Some([low, high]) = bounds(corners, lens) {
        return fill(corners, lens, low, high, draw);
    }
    let [a, b, c] = corners;
    let centre = (a + b + c) / 3.0;
    let radius = corners.iter().map(|v| (v - centre).norm()).fold(0.0, f64::max);
    if halvings == MAX_HALVINGS || radius < lens.fine * centre.norm() || lens.misses(&centre, radius) {
        return;
    }
    let [ab, bc, ca] = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5];
    for part in [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]] {
        piece(&part, lens, halvings + 1, draw);
    }
}

/// Least and greatest pixels of a triangle; `None` when not all of its border has an image.
fn bounds(corners: &[Vector3<f64>; 3], lens: &Lens<'_>) -> Option<[Vector2<f64>; 2]> {
    let at = [lens.pixel(&corners[0])?, lens.pixel(&corners[1])?, lens.pixel(&corners[2])?];
    let mut low = at[0].inf(&at[1]).inf(&at[2]);
    let mut high = at[0].sup(&at[1]).sup(&at[2]);
    if !matches!(lens.camera.distortion, crate::geometry::Distortion::None) {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let steps = ((at[j] - at[i]).norm() / EDGE_STEP).min(1e3).ceil() as usize;
            for step in 1..steps {
                let s = step as f64 / steps as f64;
                let p = lens.pixel(&(corners[i] * (1.0 - s) + corners[j] * s))?;
                low = low.inf(&p);
                high = high.sup(&p);
            }
        }
        low.add_scalar_mut(-BULGE);
        high.add_scalar_mut(BULGE);
    }
    Some([low.add_scalar(-MARGIN), high.add_scalar(MARGIN)])
}

fn fill(
    corners: &[Vector3<f64>; 3],
    lens: &Lens<'_>,
    low: Vector2<f64>,
    high: Vector2<f64>,
    draw: &mut dyn FnMut(usize, f64),
) {
    // Saturating: what is left of or above the image begins at 0, what is beyond it ends there.
    let [x0, y0] = [low.x.ceil() as usize, low.y.ceil() as usize];
    let end = |v: f64, side: usize| if v < 0.0 { 0 } else { (v.floor() as usize).saturating_add(1).min(side) };
    let [x1, y1] = [end(high.x, lens.width), end(high.y, lens.height)];
    let [a, b, c] = corners;
    let edges = [b.cross(c), c.cross(a), a.cross(b)];
    let volume = a.dot(&edges[0]);
    for y in y0..y1 {
        for pixel in (y * lens.width + x0)..(y * lens.width + x1.max(x0)) {
            let Some(d) = lens.direction(pixel) else { continue };
            if let Some((_, length)) = meet_edges(&edges, volume, &d) {
                draw(pixel, length);
            }
        }
    }
}
