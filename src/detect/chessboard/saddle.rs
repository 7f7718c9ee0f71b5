//! From a peak of the response to a corner with its two edges: a quadratic surface fitted to 5 x 5
//! pixels must be a saddle, and the edges are where a ring about it turns from dark to bright and back.

use super::response::{Peak, RADIUS as RING_RADIUS, RING};
use crate::image::pyramid::Grey;

/// Of the window that the quadratic is fitted to.
const RADIUS: usize = 2;
/// A saddle farther than this from its peak belongs to something else, pixels.
const MAX_SHIFT: f32 = 1.6;

/// Where four squares may meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Saddle {
    /// Pixels of the level.
    pub position: [f32; 2],
    /// Unit vectors along the two edges. Turning from the first to the second, by less than pi and
    /// in the sense of x to y, one passes through a bright square.
    pub edges: [[f32; 2]; 2],
}

impl Saddle {
    /// `None` when the surface is no saddle, or its middle is elsewhere.
    pub fn at(image: &Grey<'_>, peak: Peak) -> Option<Self> {
        let (mut x, mut y) = (peak.x as usize, peak.y as usize);
        let mut fit = Quadratic::fit(image, x, y)?;
        let [sx, sy] = fit.middle()?;
        // Once more about the pixel that is nearest.
        let [rx, ry] = [sx, sy].map(|s| s.round().clamp(-2.0, 2.0));
        if rx != 0.0 || ry != 0.0 {
            x = x.checked_add_signed(rx as isize)?;
            y = y.checked_add_signed(ry as isize)?;
            fit = Quadratic::fit(image, x, y)?;
        }
        let [sx, sy] = fit.middle()?;
        let position = [x as f32 + sx, y as f32 + sy];
        let shift = [position[0] - peak.x as f32, position[1] - peak.y as f32];
        let near = sx.abs().max(sy.abs()) <= 1.0 && shift[0].abs().max(shift[1].abs()) <= MAX_SHIFT;
        if near { Some(Self { position, edges: edges(image, x, y)? }) } else { None }
    }
}

/// gx x + gy y + (a x^2 + 2 b x y + c y^2) / 2 about a pixel.
struct Quadratic {
    gradient: [f32; 2],
    a: f32,
    b: f32,
    c: f32,
}

impl Quadratic {
    /// By least squares; the monomials x^2 - 2, x y, y^2 - 2 are orthogonal over the window.
    fn fit(image: &Grey<'_>, x: usize, y: usize) -> Option<Self> {
        if x < RADIUS || y < RADIUS || x + RADIUS >= image.width() || y + RADIUS >= image.height() {
            return None;
        }
        let [mut gx, mut gy, mut xx, mut xy, mut yy] = [0i32; 5];
        for dy in -2i32..=2 {
            let row = &image.row(y.wrapping_add_signed(dy as isize))[x - RADIUS..=x + RADIUS];
            let [p, q, r, s, t] = [0, 1, 2, 3, 4].map(|i| row[i] as i32);
            let (sum, slope, bend) = (p + q + r + s + t, 2 * (t - p) + s - q, 2 * (p + t - r) - q - s);
            gx += slope;
            gy += dy * sum;
            xx += bend;
            xy += dy * slope;
            yy += (dy * dy - 2) * sum;
        }
        let gradient = [gx, gy].map(|g| g as f32 / 50.0);
        Some(Self { gradient, a: xx as f32 / 35.0, b: xy as f32 / 100.0, c: yy as f32 / 35.0 })
    }

    /// Where the gradient vanishes.
    fn middle(&self) -> Option<[f32; 2]> {
        let determinant = self.a * self.c - self.b * self.b;
        let [gx, gy] = self.gradient;
        let shift = [(self.b * gy - self.c * gx) / determinant, (self.b * gx - self.a * gy) / determinant];
        (determinant < 0.0 && shift.iter().all(|s| s.is_finite())).then_some(shift)
    }
}

/// The edges through the middle of a ring. Opposite samples are added, so that a middle that is off by
/// part of a pixel does not turn them.
fn edges(image: &Grey<'_>, x: usize, y: usize) -> Option<[[f32; 2]; 2]> {
    let (left, top) = (x.checked_sub(RING_RADIUS)?, y.checked_sub(RING_RADIUS)?);
    if x + RING_RADIUS >= image.width() || y + RING_RADIUS >= image.height() {
        return None;
    }
    let sample = |k: usize| image.row(top + RING[k].1)[left + RING[k].0] as f32;
    let sums: [f32; HALF] = std::array::from_fn(|k| sample(k) + sample(k + HALF));
    let total: f32 = sums.iter().sum();
    // The arc that is brightest against the rest (Otsu's criterion): its first sample and its length.
    let (mut best, mut arc, mut middle) = (0.0, None, 0.0);
    for start in 0..HALF {
        let mut inside = 0.0;
        for length in 1..HALF {
            inside += sums[(start + length - 1) % HALF];
            let [n, rest] = [length, HALF - length].map(|n| n as f32);
            let (bright, dark) = (inside / n, (total - inside) / rest);
            let score = n * rest * (bright - dark) * (bright - dark);
            if bright > dark && score > best {
                (best, arc, middle) = (score, Some((start, length)), 0.5 * (bright + dark));
            }
        }
    }
    let (start, length) = arc?;
    // Between a sample and the one before it in the ring.
    let crossing = |k: usize| {
        let (before, after) = (sums[(k + HALF - 1) % HALF], sums[k % HALF]);
        let share = ((middle - before) / (after - before)).clamp(0.0, 1.0);
        let place = |k: usize| {
            let (dx, dy) = RING[k % RING.len()];
            [dx, dy].map(|d| d as f32 - RING_RADIUS as f32)
        };
        let (p, q) = (place(k + RING.len() - 1), place(k));
        let way = [0, 1].map(|i| p[i] + share * (q[i] - p[i]));
        let length = way[0].hypot(way[1]);
        way.map(|w| w / length)
    };
    let edges = [crossing(start), crossing(start + length)];
    edges.iter().flatten().all(|e| e.is_finite()).then_some(edges)
}

/// Samples of half the ring.
const HALF: usize = RING.len() / 2;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Image, PixelFormat};

    /// In any direction and with any angle between the edges, sharp or blurred.
    #[test]
    fn a_corner_is_found_with_its_edges() {
        for (first, second) in [(0.3f32, 1.7f32), (-0.9, 0.1), (1.2, 2.0), (2.0, 4.2)] {
            let mut image = Image::new(PixelFormat::Gray8, 16, 12);
            let middle = [7.35f32, 5.8];
            for (i, p) in image.data.iter_mut().enumerate() {
                let [dx, dy] = [(i % 16) as f32 - middle[0], (i / 16) as f32 - middle[1]];
                // Positive between the edges.
                let across = |angle: f32| dy * angle.cos() - dx * angle.sin();
                *p = (128.0 - 100.0 * across(first).tanh() * across(second).tanh()).round() as u8;
            }
            let view = image.view().unwrap();
            let saddle = Saddle::at(&Grey::of(&view), Peak { x: 8, y: 5, strength: 1 }).unwrap();
            for (found, angle) in saddle.edges.iter().zip([first, second]) {
                let sine = found[1] * angle.cos() - found[0] * angle.sin();
                // The ring has a sample every 0.4 radians.
                assert!(sine.abs() < 0.25, "{first} {second}: {saddle:?}");
            }
            let error = (saddle.position[0] - middle[0]).hypot(saddle.position[1] - middle[1]);
            assert!(error < 0.25, "{first} {second}: {saddle:?}");
        }
        let flat = Image::new(PixelFormat::Gray8, 9, 9);
        assert_eq!(Saddle::at(&Grey::of(&flat.view().unwrap()), Peak { x: 4, y: 4, strength: 1 }), None);
    }
}
