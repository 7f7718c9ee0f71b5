//! Gradients of a smoothed image, row by row, in rolling buffers: the image is smoothed with a 3 x 3
//! binomial filter or a Gaussian, then differentiated with Sobel's. All of it is exact in 16 bits, so
//! that the compiler makes vector code of it.

use crate::image::pyramid::Grey;

/// Units of the gradients in a grey level per pixel.
pub const UNITS: f64 = 128.0;
/// Standard deviation of a gradient's component from white noise of one grey level, in these units:
/// the root of the filter's sum of squares, 10 x 70.
pub const NOISE_GAIN: f64 = 26.457_513_110_645_905;
/// Grey levels are multiplied by this when they are smoothed.
const SCALE: f32 = 16.0;
/// Largest standard deviation of a Gaussian, pixels.
pub const MAX_SIGMA: f64 = 10.0;

/// Gradients of one row.
#[derive(Debug, Clone, Default)]
pub struct Row {
    pub gx: Vec<i16>,
    pub gy: Vec<i16>,
    /// |gx| + |gy|: not less than the magnitude.
    pub sum: Vec<i16>,
    /// Squared magnitude.
    pub square: Vec<i32>,
}

impl Row {
    fn new(width: usize) -> Self {
        Self { gx: vec![0; width], gy: vec![0; width], sum: vec![0; width], square: vec![0; width] }
    }
}

/// How an image is smoothed.
#[derive(Debug, Clone, PartialEq)]
pub enum Smoothing {
    /// 3 x 3, standard deviation 0.71 pixels.
    Binomial,
    /// Half of a symmetric kernel of sum 1, from its middle on.
    Gaussian(Vec<f32>),
}

impl Smoothing {
    /// A Gaussian of this standard deviation in pixels; 0: the binomial filter.
    pub fn of(sigma: f64) -> Self {
        if sigma <= 0.0 {
            return Self::Binomial;
        }
        let reach = (4.0 * sigma.min(MAX_SIGMA)).ceil() as usize;
        let half: Vec<f64> = (0..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
        let sum = 2.0 * half.iter().sum::<f64>() - half[0];
        Self::Gaussian(half.iter().map(|k| (k / sum) as f32).collect())
    }

    /// Row `y` of the smoothed image, in 16ths of a grey level; what is outside is like the border.
    fn row(&self, image: &Grey<'_>, y: usize, column: &mut [f32], bytes: &mut [i16], out: &mut [i16]) {
        let last = image.height() - 1;
        match self {
            Self::Binomial => {
                let rows = [y.saturating_sub(1), y, (y + 1).min(last)].map(|y| image.row(y));
                let columns = bytes.iter_mut().zip(rows[0]).zip(rows[1]).zip(rows[2]);
                columns.for_each(|(((sum, a), b), c)| *sum = i16::from(*a) + 2 * i16::from(*b) + i16::from(*c));
                three(bytes, out, |a, b, c| a + 2 * b + c);
            }
            Self::Gaussian(half) => {
                column.fill(0.0);
                for (i, k) in half.iter().enumerate() {
                    let above = image.row(y.saturating_sub(i));
                    let below = image.row((y + i).min(last));
                    let k = if i == 0 { 0.5 * k } else { *k };
                    let sums = column.iter_mut().zip(above).zip(below);
                    sums.for_each(|((sum, a), b)| *sum += k * (f32::from(*a) + f32::from(*b)));
                }
                let n = column.len();
                for (x, out) in out.iter_mut().enumerate() {
                    let side = half.iter().enumerate().skip(1);
                    let sum = half[0] * column[x]
                        + side
                            .map(|(i, k)| k * (column[x.saturating_sub(i)] + column[(x + i).min(n - 1)]))
                            .sum::<f32>();
                    *out = (SCALE * sum + 0.5) as i16;
                }
            }
        }
    }
}

/// `f` of each element and its two neighbours; beyond the ends it goes on as at the ends.
fn three(values: &[i16], out: &mut [i16], f: impl Fn(i16, i16, i16) -> i16) {
    let n = values.len();
    for (out, v) in out[1..].iter_mut().zip(values.windows(3)) {
        *out = f(v[0], v[1], v[2]);
    }
    out[0] = f(values[0], values[0], values[1.min(n - 1)]);
    out[n - 1] = f(values[n.saturating_sub(2)], values[n - 1], values[n - 1]);
}

/// Calls `visit` with each row and the rows above and below it. The first and last row of the image
/// are not visited: half of their gradient is unknown.
pub fn scan(image: &Grey<'_>, smoothing: &Smoothing, mut visit: impl FnMut(usize, [&Row; 3])) {
    let (width, height) = (image.width(), image.height());
    if width < 3 || height < 3 {
        return;
    }
    let mut column = vec![0f32; width];
    let mut bytes = vec![0i16; width];
    let mut across = vec![0i16; width];
    let mut smooth: [Vec<i16>; 3] = std::array::from_fn(|_| vec![0; width]);
    let mut rows: [Row; 3] = std::array::from_fn(|_| Row::new(width));
    smoothing.row(image, 0, &mut column, &mut bytes, &mut smooth[0]);
    for y in 0..height {
        let next = (y + 1).min(height - 1);
        smoothing.row(image, next, &mut column, &mut bytes, &mut smooth[(y + 1) % 3]);
        let [above, here, below] = [y.saturating_sub(1) % 3, y % 3, (y + 1) % 3].map(|i| &smooth[i]);
        let row = &mut rows[y % 3];
        for (((v, a), h), b) in across.iter_mut().zip(above).zip(here).zip(below) {
            *v = a + 2 * h + b;
        }
        three(&across, &mut row.gx, |a, _, c| c - a);
        for ((v, a), b) in across.iter_mut().zip(above).zip(below) {
            *v = b - a;
        }
        three(&across, &mut row.gy, |a, b, c| a + 2 * b + c);
        for ((sum, gx), gy) in row.sum.iter_mut().zip(&row.gx).zip(&row.gy) {
            *sum = gx.abs() + gy.abs();
        }
        for ((square, gx), gy) in row.square.iter_mut().zip(&row.gx).zip(&row.gy) {
            let (gx, gy) = (i32::from(*gx), i32::from(*gy));
            *square = gx * gx + gy * gy;
        }
        if y >= 2 {
            visit(y - 1, [&rows[(y - 2) % 3], &rows[(y - 1) % 3], &rows[y % 3]]);
        }
    }
}

/// A pixel whose gradient is a local maximum along the axis nearer to its direction (Devernay, INRIA
/// RR-2724, 1995): an edge that runs along x has one in every column, others one in every row.
#[derive(Debug, Clone, Copy)]
pub struct Maximum {
    pub x: usize,
    pub y: usize,
    /// Gradient in `UNITS`, towards the bright side.
    pub gx: i32,
    pub gy: i32,
    /// Squared magnitudes here and at the neighbours before and after along the axis.
    pub squares: [i32; 3],
}

impl Maximum {
    /// Does the edge run along x (rather than y)?
    pub fn along_x(&self) -> bool {
        self.gy.abs() > self.gx.abs()
    }

    /// Where between the neighbours the magnitude is greatest: the vertex of a parabola, -0.5 to 0.5.
    pub fn offset(&self) -> f64 {
        let [here, before, after] = self.squares.map(|s| f64::from(s).sqrt());
        let bend = before - 2.0 * here + after;
        if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
    }
}

/// Pixels of a row that are looked at together.
const BLOCK: usize = 32;

/// Calls `visit` with all maxima of at least the magnitude `least` (in `UNITS`), row by row.
pub fn maxima(image: &Grey<'_>, smoothing: &Smoothing, least: f64, mut visit: impl FnMut(Maximum)) {
    let least = least.max(1.0);
    let least_sum = least.floor().min(f64::from(i16::MAX)) as i16;
    let least_square = (least * least).min(f64::from(i32::MAX)) as i32;
    let mut found = [false; BLOCK];
    scan(image, smoothing, |y, rows @ [_, here, _]| {
        let last = here.sum.len() - 1;
        for from in (1..last).step_by(BLOCK) {
            let to = (from + BLOCK).min(last);
            if here.sum[from..to].iter().fold(0, |m: i16, s| m.max(*s)) < least_sum {
                continue;
            }
            let found = &mut found[..to - from];
            mark(rows, from, least_square, found);
            for x in found.iter().enumerate().filter(|(_, f)| **f).map(|(i, _)| from + i) {
                let (gx, gy) = (i32::from(here.gx[x]), i32::from(here.gy[x]));
                let [before, after] = neighbours(rows, x, gy.abs() > gx.abs());
                visit(Maximum { x, y, gx, gy, squares: [here.square[x], before, after] });
            }
        }
    });
}

fn neighbours([above, here, below]: [&Row; 3], x: usize, along_x: bool) -> [i32; 2] {
    if along_x { [above.square[x], below.square[x]] } else { [here.square[x - 1], here.square[x + 1]] }
}

/// Which pixels are maxima. No branches: four at a time.
fn mark([above, here, below]: [&Row; 3], from: usize, least: i32, found: &mut [bool]) {
    let n = found.len();
    let (gx, gy) = (&here.gx[from..][..n], &here.gy[from..][..n]);
    let (above, below) = (&above.square[from..][..n], &below.square[from..][..n]);
    let (left, middle, right) =
        (&here.square[from - 1..][..n], &here.square[from..][..n], &here.square[from + 1..][..n]);
    for i in 0..n {
        // All is read before the choice: what is chosen between must not be a branch.
        let (a, b, l, r) = (above[i], below[i], left[i], right[i]);
        let along_x = -i32::from(i32::from(gy[i]).abs() > i32::from(gx[i]).abs());
        let before = (a & along_x) | (l & !along_x);
        let after = (b & along_x) | (r & !along_x);
        // Of two equals the second: one of them, whichever.
        found[i] = (middle[i] >= least) & (middle[i] >= before) & (middle[i] > after);
    }
}

/// Standard deviation of white noise, grey levels, by the median response of a filter that ignores
/// planes (Immerkaer, CVIU 1996), over a part of the pixels; at least that of rounding.
pub fn noise_level(image: &Grey<'_>) -> f64 {
    const ROUNDING: f64 = 0.288_675;
    let (width, height) = (image.width(), image.height());
    if width < 3 || height < 3 {
        return ROUNDING;
    }
    let rows = height.div_ceil(64).max(1);
    let mut histogram = [0u32; 4081];
    let mut count = 0u32;
    for y in (1..height - 1).step_by(rows.max(3)) {
        let rows = [image.row(y - 1), image.row(y), image.row(y + 1)];
        let second = |r: &[u8], x: usize| i32::from(r[x - 1]) - 2 * i32::from(r[x]) + i32::from(r[x + 1]);
        for x in (1..width - 1).step_by(2) {
            let [a, b, c] = rows.map(|r| second(r, x));
            histogram[(a - 2 * b + c).unsigned_abs() as usize] += 1;
            count += 1;
        }
    }
    // Median of |N(0, 6 sigma)|, between whole numbers by linear interpolation.
    let mut below = 0;
    for (value, n) in histogram.iter().enumerate() {
        if 2 * (below + n) >= count {
            let part = (0.5 * f64::from(count) - f64::from(below)) / f64::from(*n).max(1.0);
            let median = (value as f64 - 0.5 + part).max(0.0);
            return (median / (0.674_49 * 6.0)).max(ROUNDING);
        }
        below += n;
    }
    ROUNDING
}
