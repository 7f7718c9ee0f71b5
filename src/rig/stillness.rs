//! Does the head camera's picture stand still? Heads report that they have arrived while they move.
//!
//! Two frames are reduced to block means, and in each tile of the picture the shift between them is
//! estimated by least squares on the brightness constancy equation (Lucas & Kanade 1981) with an
//! offset for the exposure. Its standard deviation comes from the frames' own residuals, so that no
//! noise level has to be known. Tiles with texture vote: a person moves some of them, the head all.

use nalgebra::{Matrix3, Vector3};

use crate::error::{Error, Result};
use crate::image::{ImageView, PixelFormat};

/// Columns of the reduced picture, about.
const COLUMNS: usize = 128;
/// Samples along each side of a block, at most.
const SAMPLES: usize = 4;
/// Tiles along each side.
const TILES: usize = 4;

/// The shift in pixels between two frames of one camera when the picture moves by more than
/// `max_shift`, `None` when it stands still. A picture without texture counts as still.
///
/// # Errors
/// `InvalidArgument` when sizes or formats differ.
pub(crate) fn shift_between(a: &ImageView<'_>, b: &ImageView<'_>, max_shift: f64) -> Result<Option<f64>> {
    if (a.width(), a.height(), a.format()) != (b.width(), b.height(), b.format()) {
        return Err(Error::invalid("frame", "consecutive frames differ in size or format"));
    }
    let pair = ReducedPair::new(a, b);
    let tiles: Vec<Tile> = (0..TILES * TILES).filter_map(|i| Tile::of(&pair, i % TILES, i / TILES)).collect();
    let moves = |tile: &Tile| tile.mismatch || (tile.shift > max_shift && tile.shift > 4.0 * tile.sigma);
    let mut shifts: Vec<f64> = tiles.iter().filter(|t| moves(t)).map(|t| t.shift).collect();
    if shifts.is_empty() {
        return Ok(None);
    }
    let middle = shifts.len() / 2;
    let shift = *shifts.select_nth_unstable_by(middle, f64::total_cmp).1;
    // Tiles that would have noticed that shift, and did not.
    let against = tiles.iter().filter(|t| !moves(t) && t.shift + 4.0 * t.sigma < shift.max(max_shift)).count();
    Ok((shifts.len() > against).then_some(shift))
}

/// Block means of two frames.
struct ReducedPair {
    /// Pixels along a block's side.
    block: usize,
    columns: usize,
    rows: usize,
    a: Vec<f64>,
    b: Vec<f64>,
    /// Variance of the difference of block means under noise that is white.
    noise: f64,
}

impl ReducedPair {
    fn new(a: &ImageView<'_>, b: &ImageView<'_>) -> Self {
        let (width, height) = (a.width() as usize, a.height() as usize);
        let block = width.div_ceil(COLUMNS).max(1);
        let (columns, rows) = (width / block, height / block);
        let step = block.div_ceil(SAMPLES);
        // Brightness: luma, or green.
        let (stride, offset) = match a.format() {
            PixelFormat::Gray8 | PixelFormat::Nv12 | PixelFormat::I420 => (1, 0),
            PixelFormat::Yuyv => (2, 0),
            PixelFormat::Rgb24 | PixelFormat::Bgr24 => (3, 1),
            PixelFormat::Rgba32 | PixelFormat::Bgra32 => (4, 1),
        };
        let mut pair = Self { block, columns, rows, a: Vec::with_capacity(columns * rows), b: Vec::new(), noise: 0.0 };
        let samples = block.div_ceil(step).pow(2) as f64;
        let mut within = 0.0;
        for row in 0..rows {
            for column in 0..columns {
                let (mut sum_a, mut sum_b, mut square) = (0i32, 0i32, 0i32);
                for y in (row * block..(row + 1) * block).step_by(step) {
                    let (line_a, line_b) = (a.row(0, y), b.row(0, y));
                    for x in (column * block..(column + 1) * block).step_by(step) {
                        let (va, vb) = (line_a[x * stride + offset] as i32, line_b[x * stride + offset] as i32);
                        sum_a += va;
                        sum_b += vb;
                        square += (vb - va) * (vb - va);
                    }
                }
                let mean_difference = f64::from(sum_b - sum_a) / samples;
                within += f64::from(square) / samples - mean_difference * mean_difference;
                pair.a.push(f64::from(sum_a) / samples);
                pair.b.push(f64::from(sum_b) / samples);
            }
        }
        pair.noise = within / (columns * rows).max(1) as f64 / (samples - 1.0).max(1.0);
        pair
    }
}

/// What one tile says.
struct Tile {
    /// Pixels.
    shift: f64,
    sigma: f64,
    /// It differs by as much as its own structure: another view, or a fast move.
    mismatch: bool,
}

impl Tile {
    /// d = -(gx u + gy v) + c over the blocks of a tile; `None` without any texture.
    fn of(pair: &ReducedPair, column: usize, row: usize) -> Option<Self> {
        let (w, h) = (pair.columns, pair.rows);
        let inner = |i: usize, n: usize| (i * n / TILES).max(1)..((i + 1) * n / TILES).min(n.saturating_sub(1));
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        let (mut count, mut square) = (0.0, 0.0);
        for y in inner(row, h) {
            for x in inner(column, w) {
                let i = y * w + x;
                let slope = |p: &[f64], step: usize| (p[i + step] - p[i - step]) * 0.25;
                let g = Vector3::new(slope(&pair.a, 1) + slope(&pair.b, 1), slope(&pair.a, w) + slope(&pair.b, w), 1.0);
                let d = pair.b[i] - pair.a[i];
                normal += g * g.transpose();
                right += g * d;
                count += 1.0;
                square += d * d;
            }
        }
        let inverse = normal.try_inverse().filter(|m| m.iter().all(|v| v.is_finite()))?;
        let solution = inverse * right;
        // Rounding to grey levels leaves its own variance, however still the picture.
        let rest = ((square - right.dot(&solution)) / (count - 3.0f64).max(1.0)).max(1e-4);
        let energy = (normal.m11 + normal.m22) / count;
        let block = pair.block as f64;
        Some(Self {
            shift: block * solution.xy().norm(),
            sigma: block * (rest * inverse.m11.max(inverse.m22)).sqrt(),
            // More than white noise leaves in block means, than a grey level, and as much as neighbours differ.
            mismatch: rest > 10.0 * pair.noise && rest > 1.0 && rest > 0.3 * energy,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use crate::rig::fake::Random;

    const MAX_SHIFT: f64 = 0.2;

    /// A room-like picture: shading, edges and stripes.
    fn scene(x: f64, y: f64) -> f64 {
        let edge = |t: f64| 1.0 / (1.0 + (-t / 0.8).exp());
        90.0 + 20.0 * (x / 90.0).sin()
            + 15.0 * (y / 70.0).cos()
            + 60.0 * (edge(x - 100.0) - edge(x - 180.0)) * (edge(y - 60.0) - edge(y - 200.0))
            - 40.0 * edge(y - 190.0 + 0.2 * x)
    }

    fn render(picture: impl Fn(f64, f64) -> f64, sigma: f64, random: &mut Random) -> Image {
        let mut image = Image::new(PixelFormat::Gray8, 320, 240);
        for y in 0..240 {
            for x in 0..320 {
                let value = picture(x as f64, y as f64) + sigma * random.normal();
                image.data[y * 320 + x] = value.round().clamp(0.0, 255.0) as u8;
            }
        }
        image
    }

    fn shift(a: &Image, b: &Image) -> Option<f64> {
        shift_between(&a.view().unwrap(), &b.view().unwrap(), MAX_SHIFT).unwrap()
    }

    #[test]
    fn noise_people_and_exposure_are_not_motion() {
        let mut random = Random(1);
        for sigma in [0.0, 0.4, 1.0, 3.0, 10.0] {
            for _ in 0..10 {
                let a = render(scene, sigma, &mut random);
                assert_eq!(shift(&a, &render(scene, sigma, &mut random)), None, "noise {sigma}");
                let brighter = render(|x, y| scene(x, y) + 6.0, sigma, &mut random);
                assert_eq!(shift(&a, &brighter), None, "exposure at noise {sigma}");
                let person = |at: f64| {
                    move |x: f64, y: f64| {
                        if (x - at).abs() < 20.0 && y > 40.0 {
                            30.0 + 20.0 * ((x - at) / 3.0).sin()
                        } else {
                            scene(x, y)
                        }
                    }
                };
                let a = render(person(220.0), sigma, &mut random);
                let b = render(person(227.0), sigma, &mut random);
                assert_eq!(shift(&a, &b), None, "person at noise {sigma}");
                // A blank wall cannot be judged, and does not stop the work.
                let [a, b] = [(); 2].map(|()| render(|_, _| 120.0, sigma, &mut random));
                assert_eq!(shift(&a, &b), None, "blank at noise {sigma}");
            }
        }
    }

    #[test]
    fn motion_is_seen_from_half_a_pixel_to_another_view() {
        let mut random = Random(2);
        for sigma in [0.0, 1.0, 3.0] {
            for (u, v) in [(0.5, 0.0), (0.0, -0.5), (1.5, 1.0), (6.0, 0.0), (0.0, 9.0), (25.0, -10.0), (70.0, 0.0)] {
                let a = render(scene, sigma, &mut random);
                let b = render(|x, y| scene(x - u, y - v), sigma, &mut random);
                let seen = shift(&a, &b).unwrap_or_else(|| panic!("({u}, {v}) at noise {sigma} is not seen"));
                if f64::hypot(u, v) < 2.0 {
                    assert!((seen / f64::hypot(u, v) - 1.0).abs() < 0.3, "({u}, {v}) at noise {sigma}: {seen}");
                }
            }
        }
    }

    #[test]
    fn small_and_unequal_pictures_are_survived() {
        let tiny = Image::new(PixelFormat::Gray8, 2, 1);
        assert_eq!(shift(&tiny, &tiny), None);
        let colour = Image::new(PixelFormat::Yuyv, 64, 48);
        assert_eq!(shift(&colour, &colour), None);
        let other = Image::new(PixelFormat::Gray8, 64, 48);
        assert!(shift_between(&colour.view().unwrap(), &other.view().unwrap(), MAX_SHIFT).is_err());
    }
}
