//! How far a picture has moved, to a small part of a pixel: least squares on the brightness constancy
//! equation (Lucas & Kanade 1981), iterated, from coarse to fine, in tiles whose median counts, so that a
//! person who walks by does not.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::image::ImageView;
use crate::image::pyramid::Grey;

/// Blocks of so many pixels, from coarse to fine.
const BLOCKS: [usize; 3] = [8, 4, 2];
const ITERATIONS: usize = 8;
/// Tiles along each side, and how many must have texture.
const TILES: usize = 4;
const MIN_TILES: usize = 4;

/// Shift of the picture, px, and its standard deviation along x and y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    pub by: Vector2<f64>,
    pub sigma: Vector2<f64>,
}

/// Where the picture `b` is relative to `a`; `None` without texture, for pictures of several sizes and
/// where tiles disagree. Found for shifts up to some 10 px.
pub fn shift(a: &ImageView<'_>, b: &ImageView<'_>) -> Option<Shift> {
    if (a.width(), a.height(), a.format()) != (b.width(), b.height(), b.format()) {
        return None;
    }
    let (a, b) = (Grey::of(a), Grey::of(b));
    let mut by = Vector2::zeros();
    let mut sigma = Vector2::zeros();
    for block in BLOCKS {
        let (a, b) = (Means::new(&a, block), Means::new(&b, block));
        let tiles: Vec<Vector2<f64>> =
            (0..TILES * TILES).filter_map(|i| a.track(&b, i % TILES, i / TILES, by / block as f64)).collect();
        if tiles.len() < MIN_TILES {
            // Fine structure may tell what blocks do not.
            if block == BLOCKS[BLOCKS.len() - 1] {
                return None;
            }
            continue;
        }
        let along = |k: usize| median(tiles.iter().map(|t| t[k]).collect());
        let middle = Vector2::new(along(0), along(1));
        let off = |k: usize| median(tiles.iter().map(|t| (t[k] - middle[k]).abs()).collect());
        // Of a median: pi/2 in variance.
        let scale = block as f64 * 1.4826 * (std::f64::consts::FRAC_PI_2 / tiles.len() as f64).sqrt();
        by = middle * block as f64;
        sigma = Vector2::new(off(0), off(1)) * scale;
    }
    (sigma.amax() < 1.0).then_some(Shift { by, sigma })
}

/// Does the noise of the pictures not explain their difference? Something was switched on or off, if only
/// a spot: 4 samples of the first plane (all colours, or luma) that differ by 10 standard deviations, and
/// 15 grey levels at least.
pub fn differs(a: &ImageView<'_>, b: &ImageView<'_>) -> bool {
    if (a.width(), a.height(), a.format()) != (b.width(), b.height(), b.format()) {
        return true;
    }
    let mut histogram = [0usize; 256];
    for y in 0..a.height() as usize {
        a.row(0, y).iter().zip(b.row(0, y)).for_each(|(p, q)| histogram[usize::from(p.abs_diff(*q))] += 1);
    }
    let total: usize = histogram.iter().sum();
    let mut below = 0;
    let median = histogram.iter().position(|n| {
        below += n;
        2 * below >= total
    });
    let limit = (15.0 + 10.0 * 1.4826 * median.unwrap_or(0) as f64).min(255.0) as usize;
    histogram[limit..].iter().sum::<usize>() >= 4
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Block means.
struct Means {
    width: usize,
    height: usize,
    values: Vec<f64>,
}

impl Means {
    fn new(image: &Grey<'_>, block: usize) -> Self {
        let (width, height) = (image.width() / block, image.height() / block);
        let mut values = vec![0.0; width * height];
        for y in 0..height * block {
            let row = image.row(y);
            for (x, p) in row.iter().take(width * block).enumerate() {
                values[y / block * width + x / block] += f64::from(*p);
            }
        }
        let area = (block * block) as f64;
        values.iter_mut().for_each(|v| *v /= area);
        Self { width, height, values }
    }

    /// Bilinear.
    fn at(&self, x: f64, y: f64) -> Option<f64> {
        let (i, j) = (x.floor(), y.floor());
        if i < 0.0 || j < 0.0 || i + 1.0 >= self.width as f64 || j + 1.0 >= self.height as f64 {
            return None;
        }
        let (s, t, k) = (x - i, y - j, j as usize * self.width + i as usize);
        let v = &self.values;
        let (top, bottom) =
            (v[k] * (1.0 - s) + v[k + 1] * s, v[k + self.width] * (1.0 - s) + v[k + self.width + 1] * s);
        Some(top * (1.0 - t) + bottom * t)
    }

    /// Shift of a tile from here to `other`, blocks.
    fn track(&self, other: &Self, column: usize, row: usize, start: Vector2<f64>) -> Option<Vector2<f64>> {
        let range = |i: usize, n: usize| (i * n / TILES).max(1)..((i + 1) * n / TILES).min(n.saturating_sub(1));
        let mut by = start;
        let mut last = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let (mut normal, mut right, mut count) = (Matrix3::<f64>::zeros(), Vector3::zeros(), 0.0);
            let mut square = 0.0;
            for y in range(row, self.height) {
                for x in range(column, self.width) {
                    let i = y * self.width + x;
                    let Some(there) = other.at(x as f64 + by.x, y as f64 + by.y) else { continue };
                    let v = &self.values;
                    let g =
                        Vector3::new(0.5 * (v[i + 1] - v[i - 1]), 0.5 * (v[i + self.width] - v[i - self.width]), 1.0);
                    let d = there - v[i];
                    normal += g * g.transpose();
                    right += g * d;
                    square += d * d;
                    count += 1.0;
                }
            }
            let area = (range(row, self.height).len() * range(column, self.width).len()) as f64;
            if count < 0.5 * area || count < 16.0 {
                return None;
            }
            let inverse = normal.try_inverse()?;
            let solution = inverse * right;
            let step = Vector2::new(-solution.x, -solution.y);
            let rest = ((square - right.dot(&solution)) / count).max(1e-3);
            let covariance: Matrix2<f64> = inverse.fixed_view::<2, 2>(0, 0) * rest;
            // Worse than a tenth of a block: no texture to speak of.
            if !(covariance.trace() < 0.02 && step.norm() < 4.0) {
                return None;
            }
            by += step;
            last = step.norm();
            if last < 1e-4 {
                break;
            }
        }
        (last < 0.05).then_some(by)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Image, PixelFormat};
    use crate::rig::fake::Random;

    fn draw(u: f64, v: f64, noise: f64, random: &mut Random) -> Image {
        let mut image = Image::new(PixelFormat::Gray8, 320, 240);
        for y in 0..240 {
            for x in 0..320 {
                let (s, t) = (f64::from(x) - u, f64::from(y) - v);
                let value = 110.0 + 30.0 * (s / 9.0).sin() * (t / 13.0).cos() + 25.0 * ((s + 2.0 * t) / 31.0).sin();
                image.data[y as usize * 320 + x as usize] =
                    (value + noise * random.normal()).round().clamp(0.0, 255.0) as u8;
            }
        }
        image
    }

    #[test]
    fn shifts_are_found_to_a_hundredth_of_a_pixel() {
        let mut random = Random(1);
        for (u, v) in [(0.0, 0.0), (0.3, -0.7), (2.4, 1.1), (-8.0, 5.5)] {
            let (a, b) = (draw(0.0, 0.0, 2.0, &mut random), draw(u, v, 2.0, &mut random));
            let s = shift(&a.view().unwrap(), &b.view().unwrap()).unwrap();
            let off = s.by - Vector2::new(u, v);
            assert!(off.amax() < 0.03 && s.sigma.amax() < 0.03, "({u}, {v}): {off} {}", s.sigma);
        }
        let blank = Image::new(PixelFormat::Gray8, 320, 240);
        assert_eq!(shift(&blank.view().unwrap(), &blank.view().unwrap()), None);
        let other = Image::new(PixelFormat::Gray8, 100, 100);
        assert_eq!(shift(&blank.view().unwrap(), &other.view().unwrap()), None);
    }

    #[test]
    fn a_spot_differs_and_noise_does_not() {
        let mut random = Random(2);
        let (a, mut b) = (draw(0.0, 0.0, 3.0, &mut random), draw(0.0, 0.0, 3.0, &mut random));
        assert!(!differs(&a.view().unwrap(), &b.view().unwrap()));
        for i in 0..16 {
            b.data[(100 + i / 4) * 320 + 100 + i % 4] = 255;
        }
        assert!(differs(&a.view().unwrap(), &b.view().unwrap()));
    }
}
