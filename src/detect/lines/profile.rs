//! How an edge looks along one column of pixels (or row) that crosses it: a step, blurred by a
//! Gaussian, between two levels. Its derivatives by level, contrast, position and blur, and the least
//! squares weights that turn a column's pixels into them.

use nalgebra::{Matrix4, Vector4};

/// Greatest number of pixels on either side of the edge.
pub const REACH: usize = 8;
/// A column's pixels, with zeros after them: whole vectors of four.
pub const WIDTH: usize = (2 * REACH + 1).next_multiple_of(4);
pub type Pixels = [f32; WIDTH];
/// Places of the edge between two pixels for which weights are kept; the rest of a pixel is linear.
const PHASES: usize = 16;
/// Blurs, pixels: each the `RATIO` of the one before.
const LEAST_BLUR: f64 = 0.4;
const RATIO: f64 = 1.15;
const BLURS: usize = 18;
/// Fewest pixels of a column whose blur is fitted too.
const MIN_FOR_BLUR: usize = 7;

/// Weights of a column's pixels.
#[derive(Debug, Clone, Copy)]
pub struct Weights {
    /// The least squares answer is the sum of pixels times weights: contrast; minus contrast times
    /// the edge's position; contrast times the relative change of the blur.
    pub contrast: Pixels,
    pub shift: Pixels,
    pub blur: Pixels,
    /// Variances of contrast and shift for pixels of variance 1.
    pub contrast_variance: f64,
    pub shift_variance: f64,
}

/// Sum of products, in four sums that make one vector.
pub fn dot(pixels: &Pixels, weights: &Pixels) -> f64 {
    let mut sums = [0f32; 4];
    for (p, w) in pixels.chunks_exact(4).zip(weights.chunks_exact(4)) {
        sums.iter_mut().zip(p.iter().zip(w)).for_each(|(s, (p, w))| *s += p * w);
    }
    f64::from((sums[0] + sums[2]) + (sums[1] + sums[3]))
}

/// Weights for pixels `-before..=after` about the one in which the edge lies.
#[derive(Debug, Clone)]
pub struct Template {
    pub before: usize,
    pub after: usize,
    phases: Vec<Weights>,
}

impl Template {
    /// For an edge at this offset from the middle pixel's centre (-0.5 to 0.5), and the offset that
    /// the weights are for.
    pub fn at(&self, offset: f64) -> (&Weights, f64) {
        let n = PHASES as f64;
        let i = (((offset + 0.5) * n) as usize).min(PHASES - 1);
        (&self.phases[i], (i as f64 + 0.5) / n - 0.5)
    }

    fn new(blur: f64, before: usize, after: usize) -> Option<Self> {
        let phase = |i: usize| weights(blur, before, after, (i as f64 + 0.5) / PHASES as f64 - 0.5);
        Some(Self { before, after, phases: (0..PHASES).map(phase).collect::<Option<_>>()? })
    }
}

/// Level, step, density and its first moment at each pixel.
fn weights(blur: f64, before: usize, after: usize, offset: f64) -> Option<Weights> {
    let n = before + after + 1;
    let fit_blur = n >= MIN_FOR_BLUR;
    let row = |k: usize| {
        let z = (k as f64 - before as f64 - offset) / blur;
        let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
        Vector4::new(1.0, normal_cdf(z) - 0.5, density / blur, if fit_blur { -z * density } else { 0.0 })
    };
    let mut normal = Matrix4::zeros();
    (0..n).for_each(|k| normal += row(k) * row(k).transpose());
    if !fit_blur {
        normal[(3, 3)] = 1.0;
    }
    let inverse = normal.cholesky()?.inverse();
    let mut w = Weights {
        contrast: [0.0; WIDTH],
        shift: [0.0; WIDTH],
        blur: [0.0; WIDTH],
        contrast_variance: inverse[(1, 1)],
        shift_variance: inverse[(2, 2)],
    };
    for k in 0..n {
        let answer = inverse * row(k);
        (w.contrast[k], w.shift[k], w.blur[k]) = (answer[1] as f32, answer[2] as f32, answer[3] as f32);
    }
    Some(w)
}

/// The templates that were needed so far.
pub struct Templates(Vec<Option<Template>>);

impl Templates {
    pub fn new() -> Self {
        Self((0..BLURS * (REACH + 1) * (REACH + 1)).map(|_| None).collect())
    }

    /// For the nearest blur (pixels along the column), and that blur.
    pub fn get(&mut self, blur: f64, before: usize, after: usize) -> Option<(&Template, f64)> {
        let step = (blur.max(LEAST_BLUR) / LEAST_BLUR).ln() / RATIO.ln();
        let i = (step.round() as usize).min(BLURS - 1);
        let blur = LEAST_BLUR * RATIO.powi(i as i32);
        let slot = self.0.get_mut((i * (REACH + 1) + before) * (REACH + 1) + after)?;
        if slot.is_none() {
            *slot = Template::new(blur, before, after);
        }
        slot.as_ref().map(|t| (t, blur))
    }
}

/// Abramowitz and Stegun 7.1.26, to 1e-7.
fn normal_cdf(z: f64) -> f64 {
    let x = z.abs() * std::f64::consts::FRAC_1_SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let poly =
        t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let upper = 0.5 * poly * (-x * x).exp();
    if z > 0.0 { 1.0 - upper } else { upper }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_distribution_is_that_of_the_tables() {
        for (z, p) in [(0.0, 0.5), (1.0, 0.841_344_746), (-1.96, 0.024_997_895), (3.0, 0.998_650_102)] {
            assert!((normal_cdf(z) - p).abs() < 2e-7, "{z}");
        }
    }

    #[test]
    fn weights_find_contrast_place_and_blur_of_an_edge() {
        let mut templates = Templates::new();
        let (template, blur) = templates.get(1.0, 4, 4).unwrap();
        for (offset, moved, wider) in [(0.0, 0.0, 0.0), (0.3, 0.05, 0.0), (-0.45, -0.05, 0.02)] {
            let (w, at) = template.at(offset);
            assert!((at - offset).abs() <= 0.5 / PHASES as f64 + 1e-12);
            let s = blur * (1.0 + wider);
            let pixel = |k: usize| 40.0 + 60.0 * normal_cdf((k as f64 - 4.0 - at - moved) / s);
            let sum = |weights: &[f32]| (0..9).map(|k| f64::from(weights[k]) * pixel(k)).sum::<f64>();
            let contrast = sum(&w.contrast);
            assert!((contrast - 60.0).abs() < 0.5, "{contrast}");
            assert!((-sum(&w.shift) / contrast - moved).abs() < 2e-3, "{moved}");
            assert!((sum(&w.blur) / contrast - wider).abs() < 5e-3, "{wider}");
        }
    }
}
