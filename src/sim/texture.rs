//! What the surfaces look like: procedural reflectance, and light from a lamp with soft shadows,
//! baked once per process into one texture for each face.

use std::sync::OnceLock;

use nalgebra::Vector3;

use super::scene::{self, FACES, Face};

/// A face's brightness, one grey level per unit, packed red | green << 8 | blue << 16.
pub struct Texture {
    pub texels_per_metre: f64,
    pub width: usize,
    pub height: usize,
    pub texels: Vec<u32>,
}

/// Walls are seen from afar, boxes from near.
const WALL_DENSITY: f64 = 150.0;
const BOX_DENSITY: f64 = 250.0;

/// The textures of all faces. They depend on nothing, so they are made once.
pub fn all() -> &'static [Texture] {
    static TEXTURES: OnceLock<Vec<Texture>> = OnceLock::new();
    TEXTURES.get_or_init(|| (0..FACES).map(bake).collect())
}

fn bake(index: usize) -> Texture {
    let face = Face::new(index);
    let density = if index < 6 { WALL_DENSITY } else { BOX_DENSITY };
    let [width, height] = face.size.map(|s| (s * density).ceil().max(2.0) as usize);
    let light = LightMap::new(&face);
    let mut texels = Vec::with_capacity(width * height);
    for j in 0..height {
        let v = (j as f32 + 0.5) / density as f32;
        for i in 0..width {
            let u = (i as f32 + 0.5) / density as f32;
            let lit = 255.0 * light.at(u, v);
            let [r, g, b] = albedo(index, [u, v]).map(|a| (a * lit + 0.5).clamp(0.0, 250.0) as u32);
            texels.push(r | g << 8 | b << 16);
        }
    }
    Texture { texels_per_metre: density, width, height, texels }
}

/// Light on a face, on a coarse grid.
struct LightMap {
    width: usize,
    spacing: f32,
    values: Vec<f32>,
}

impl LightMap {
    const SPACING: f64 = 0.04;

    fn new(face: &Face) -> Self {
        let [width, height] = face.size.map(|s| (s / Self::SPACING).ceil() as usize + 2);
        let mut values = Vec::with_capacity(width * height);
        for j in 0..height {
            for i in 0..width {
                // Just above the face, and just inside its border.
                let mut point = face.normal * 1e-4;
                point[face.axis] += face.plane;
                for (axis, k, side) in [(face.u_axis, i, 0), (face.v_axis, j, 1)] {
                    let along = (k as f64 * Self::SPACING).clamp(1e-3, face.size[side] - 1e-3);
                    point[axis] = face.corner[side] + along;
                }
                values.push(illumination(&point, &face.normal) as f32);
            }
        }
        Self { width, spacing: Self::SPACING as f32, values }
    }

    fn at(&self, u: f32, v: f32) -> f32 {
        let (x, y) = (u / self.spacing, v / self.spacing);
        let (i, j) = (x as usize, y as usize);
        let (fx, fy) = (x - i as f32, y - j as f32);
        let row = |j: usize| {
            let at = j * self.width + i;
            self.values[at] * (1.0 - fx) + self.values[at + 1] * fx
        };
        row(j) * (1.0 - fy) + row(j + 1) * fy
    }
}

/// Ambient light and a square lamp under the ceiling. About 0.5 in the shade, 1.2 near the lamp.
fn illumination(point: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    const LAMP: Vector3<f64> = Vector3::new(0.3, -1.25, 0.9);
    const HALF_SIDE: f64 = 0.5;
    const SAMPLES: i32 = 2;
    let mut direct = 0.0;
    for i in -SAMPLES..=SAMPLES {
        for j in -SAMPLES..=SAMPLES {
            let step = HALF_SIDE / SAMPLES as f64;
            let way = LAMP + Vector3::new(i as f64 * step, 0.0, j as f64 * step) - point;
            let distance2 = way.norm_squared().max(0.05);
            let cosines = (normal.dot(&way) * -way.y / distance2).max(0.0);
            if cosines > 0.0 && scene::cast(point, &way, scene::ALL_BOXES).distance >= 1.0 - 1e-6 {
                direct += cosines / distance2;
            }
        }
    }
    let samples = f64::from(2 * SAMPLES + 1).powi(2);
    // Light from above is a little stronger than light from the floor.
    let ambient = 0.52 - 0.08 * normal.y;
    ambient + 0.9 * (1.0 - (-4.0 * direct / samples).exp())
}

/// Reflectance (red, green, blue; 0 to 1) of a face at (u, v) metres from its corner.
pub fn albedo(face: usize, [u, v]: [f32; 2]) -> [f32; 3] {
    let seed = face as u32 * 101;
    // Unevenness that every surface has, about 0 on average.
    let grain = 0.6 * noise(u * 9.0, v * 9.0, seed) + 0.4 * noise(u * 27.0, v * 27.0, seed + 1) - 0.5;
    let plain = |c: [f32; 3], amount: f32| c.map(|c| c * (1.0 + amount * grain));
    match (face / 6, face % 6) {
        // Side walls: plaster with a painted dado and a poster; floor: tiles; ceiling: panels.
        (0, 0 | 1) => {
            let dado = edge(v, 1.75, 0.02);
            let base = mix([0.74, 0.70, 0.60], [0.45, 0.52, 0.46], dado);
            let rail = band(v, 1.70, 1.77, 0.01);
            let wall = plain(mix(base, [0.36, 0.26, 0.18], rail), 0.12);
            poster(wall, [u - 3.3, v - 0.45], [0.9, 0.8], seed)
        }
        (0, 2) => {
            let joint = 1.0 - line(u, 0.6, 0.012) * line(v, 0.6, 0.012);
            plain(mix([0.80, 0.80, 0.77], [0.55, 0.55, 0.53], joint), 0.05)
        }
        (0, 3) => {
            let tile = checks(u, v, 0.325);
            let joint = 1.0 - line(u, 0.325, 0.01) * line(v, 0.325, 0.01);
            let vein = noise(u * 3.0 + 4.0 * grain, v * 3.0, seed + 2) - 0.5;
            let stone = mix([0.58, 0.50, 0.42], [0.36, 0.31, 0.28], tile);
            plain(mix(stone.map(|c| c * (1.0 + 0.25 * vein)), [0.25, 0.24, 0.22], joint), 0.12)
        }
        (0, 5) => {
            let stripe = wave(u, 0.26);
            let paper = mix([0.70, 0.66, 0.58], [0.58, 0.60, 0.60], stripe);
            let skirting = edge(v, 2.40, 0.01);
            let wall = plain(mix(paper, [0.40, 0.30, 0.22], skirting), 0.10);
            let wall = poster(wall, [u - 0.35, v - 0.55], [0.85, 0.65], seed + 5);
            poster(wall, [u - 2.95, v - 0.85], [0.7, 0.95], seed + 9)
        }
        (0, _) => plain([0.68, 0.66, 0.62], 0.12),
        // A cardboard box with tape; a banded post; a wooden cabinet; a checked and a blue one.
        (1, _) => {
            let tape = band(u, 0.40, 0.47, 0.006);
            let rib = 0.03 * (noise(u * 60.0, v * 4.0, seed + 3) - 0.5);
            plain(mix([0.58 + rib, 0.44 + rib, 0.30 + rib], [0.70, 0.62, 0.48], tape), 0.15)
        }
        (2, _) => plain(mix([0.72, 0.68, 0.30], [0.30, 0.28, 0.28], wave(v + 0.4 * u, 0.16)), 0.10),
        (3, _) => {
            let ring = noise(u * 22.0 + 2.0 * grain, v * 2.5, seed + 4);
            plain(mix([0.52, 0.34, 0.20], [0.38, 0.23, 0.13], smooth(ring)), 0.10)
        }
        (4, _) => plain(mix([0.66, 0.32, 0.28], [0.72, 0.70, 0.66], checks(u, v, 0.11)), 0.10),
        _ => {
            let panel = band(u, 0.06, 0.74, 0.01) * band(v, 0.06, 0.74, 0.01);
            let knob = 1.0 - edge((u - 0.66).hypot(v - 0.40), 0.03, 0.01);
            let paint = mix([0.28, 0.36, 0.52], [0.36, 0.46, 0.62], panel);
            plain(mix(paint, [0.70, 0.66, 0.55], knob), 0.14)
        }
    }
}

/// A framed picture of soft coloured clouds, with its corner at (0, 0).
fn poster(wall: [f32; 3], [u, v]: [f32; 2], [width, height]: [f32; 2], seed: u32) -> [f32; 3] {
    let inside = |border: f32| band(u, border, width - border, 0.008) * band(v, border, height - border, 0.008);
    let channel = |k: u32| {
        let coarse = noise(u * 5.0, v * 5.0, seed + 20 + k);
        let fine = noise(u * 14.0, v * 14.0, seed + 30 + k);
        0.15 + 0.6 * (0.65 * coarse + 0.35 * fine)
    };
    let frame = mix(wall, [0.22, 0.18, 0.15], inside(0.0));
    if inside(0.03) == 0.0 { frame } else { mix(frame, [channel(0), channel(1), channel(2)], inside(0.03)) }
}

fn mix(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
}

fn smooth(x: f32) -> f32 {
    x * x * (3.0 - 2.0 * x)
}

/// 0 below `at`, 1 above it, soft over `width`.
fn edge(x: f32, at: f32, width: f32) -> f32 {
    smooth(((x - at) / width + 0.5).clamp(0.0, 1.0))
}

/// 1 between `low` and `high`.
fn band(x: f32, low: f32, high: f32, width: f32) -> f32 {
    edge(x, low, width) * (1.0 - edge(x, high, width))
}

/// 0 on lines at multiples of `period`, 1 between them.
fn line(x: f32, period: f32, width: f32) -> f32 {
    let off = (x / period - (x / period).round()).abs() * period;
    edge(off, width, width)
}

/// Soft stripes between 0 and 1.
fn wave(x: f32, period: f32) -> f32 {
    let across = (x / period).rem_euclid(1.0);
    let softness = 0.012 / period;
    band(across, 0.25, 0.75, softness)
}

/// Soft checks with squares of side `side`.
fn checks(u: f32, v: f32, side: f32) -> f32 {
    let (a, b) = (wave(u + 0.5 * side, 2.0 * side), wave(v + 0.5 * side, 2.0 * side));
    a + b - 2.0 * a * b
}

/// Value noise: random values at the whole numbers, smooth between them, 0 to 1.
fn noise(x: f32, y: f32, seed: u32) -> f32 {
    let (i, j) = (x.floor(), y.floor());
    let (fx, fy) = (smooth(x - i), smooth(y - j));
    let (i, j) = (i as i32, j as i32);
    let row = |j: i32| {
        let (a, b) = (lattice(i, j, seed), lattice(i + 1, j, seed));
        a + (b - a) * fx
    };
    let (a, b) = (row(j), row(j + 1));
    a + (b - a) * fy
}

fn lattice(i: i32, j: i32, seed: u32) -> f32 {
    let mut h =
        (i as u32).wrapping_mul(0x9E37_79B1) ^ (j as u32).wrapping_mul(0x85EB_CA77) ^ seed.wrapping_mul(0xC2B2_AE3D);
    h ^= h >> 15;
    h = h.wrapping_mul(0x2C1B_3C6D);
    h ^= h >> 12;
    h = h.wrapping_mul(0x297A_2D39);
    h ^= h >> 15;
    (h >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reflectance_is_physical_and_smooth() {
        for index in 0..FACES {
            let [w, h] = Face::new(index).size.map(|s| s as f32);
            let mut previous = albedo(index, [0.0, 0.4 * h]);
            let mut u = 0.0;
            while u < w {
                let a = albedo(index, [u, 0.4 * h]);
                for (now, before) in a.iter().zip(previous) {
                    assert!((0.05..=0.95).contains(now), "face {index}: {a:?}");
                    assert!((now - before).abs() < 0.15, "face {index} jumps at u = {u}");
                }
                previous = a;
                u += 0.001;
            }
        }
    }

    #[test]
    fn no_texture_is_flat_black_or_blown_out() {
        for (index, t) in all().iter().enumerate() {
            let green: Vec<f64> = t.texels.iter().map(|t| f64::from(t >> 8 & 255)).collect();
            let mean = green.iter().sum::<f64>() / green.len() as f64;
            let variance = green.iter().map(|g| (g - mean) * (g - mean)).sum::<f64>() / green.len() as f64;
            assert!((20.0..210.0).contains(&mean) && variance > 1.0, "face {index}: {mean} {variance}");
        }
    }
}
