//! Edges: pixels where the light changes fastest (Canny, PAMI 1986), to a fraction of a pixel.

pub(crate) mod gradient;
#[cfg(test)]
mod tests;

use crate::error::{Error, Result};
use crate::image::ImageView;
use crate::image::pyramid::Grey;
use gradient::{MAX_SIGMA, Maximum, Smoothing, UNITS, maxima};

/// Most pixels of an image in which edges or lines are looked for: 16384 x 16384. What is needed
/// besides the image is a byte a pixel, and what is found.
pub const MAX_PIXELS: usize = 1 << 28;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeOptions {
    /// Standard deviation of the Gaussian that smooths the image first, pixels, at most 10; 0: a 3 x 3
    /// binomial filter (0.71 pixels), which is faster.
    pub sigma: f64,
    /// Edges begin where the gradient reaches `high` and go on while it is at least `low`, grey levels
    /// per pixel of the smoothed image.
    pub low: f64,
    pub high: f64,
}

impl Default for EdgeOptions {
    fn default() -> Self {
        Self { sigma: 0.0, low: 4.0, high: 10.0 }
    }
}

impl EdgeOptions {
    fn check(&self) -> Result<()> {
        if !(0.0..=MAX_SIGMA).contains(&self.sigma) {
            return Err(Error::invalid("sigma", format!("{} is not between 0 and {MAX_SIGMA} pixels", self.sigma)));
        }
        if !(self.low > 0.0 && self.low <= self.high && self.high.is_finite()) {
            return Err(Error::invalid("low", format!("thresholds {} and {}: 0 < low <= high", self.low, self.high)));
        }
        Ok(())
    }
}

/// A place on an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgePoint {
    /// Pixels: the vertex of a parabola through the gradient's magnitude at three pixels.
    pub x: f64,
    pub y: f64,
    /// Unit vector across the edge, towards its bright side.
    pub normal: [f64; 2],
    /// Magnitude of the gradient, grey levels per pixel of the smoothed image.
    pub gradient: f64,
}

pub(crate) fn check_size(image: &ImageView<'_>) -> Result<()> {
    let pixels = image.width() as usize * image.height() as usize;
    if pixels > MAX_PIXELS {
        let reason = format!("{} x {} pixels; {MAX_PIXELS} are the most", image.width(), image.height());
        return Err(Error::invalid("image", reason));
    }
    Ok(())
}

/// Canny's edges, row by row: maxima of the gradient, those above the low threshold as far as they are
/// connected (8 neighbours) to one above the high one. Images below 3 x 3 pixels have none.
///
/// Each maximum is taken along x or y, whichever is nearer to the gradient's direction, and so is its
/// fraction of a pixel.
///
/// # Errors
/// `InvalidArgument` for impossible options and images of more than [`MAX_PIXELS`].
pub fn detect_edges(image: &ImageView<'_>, options: &EdgeOptions) -> Result<Vec<EdgePoint>> {
    options.check()?;
    check_size(image)?;
    let grey = Grey::of(image);
    let width = grey.width();
    let mut found: Vec<Maximum> = Vec::new();
    // 1: weak, 2: strong or connected to a strong one.
    let mut state = vec![0u8; width * grey.height()];
    let mut open = Vec::new();
    let high = (options.high * UNITS).powi(2);
    maxima(&grey, &Smoothing::of(options.sigma), options.low * UNITS, |m| {
        let index = m.y * width + m.x;
        state[index] = 1;
        if f64::from(m.squares[0]) >= high {
            state[index] = 2;
            open.push(index);
        }
        found.push(m);
    });
    // No maximum lies on the border, so that all neighbours exist.
    while let Some(index) = open.pop() {
        for row in [index - width, index, index + width] {
            for (i, cell) in state[row - 1..=row + 1].iter_mut().enumerate().filter(|(_, cell)| **cell == 1) {
                *cell = 2;
                open.push(row - 1 + i);
            }
        }
    }
    Ok(found.iter().filter(|m| state[m.y * width + m.x] == 2).map(point).collect())
}

fn point(m: &Maximum) -> EdgePoint {
    let (gx, gy) = (f64::from(m.gx), f64::from(m.gy));
    let magnitude = gx.hypot(gy);
    let (x, y) = (m.x as f64, m.y as f64);
    let (x, y) = if m.along_x() { (x, y + m.offset()) } else { (x + m.offset(), y) };
    EdgePoint { x, y, normal: [gx / magnitude, gy / magnitude], gradient: magnitude / UNITS }
}
