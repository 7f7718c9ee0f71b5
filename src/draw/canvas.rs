//! Points, lines and circles with smooth edges on an RGB image.

use nalgebra::Vector2;

use crate::error::{Error, Result};
use crate::image::view::MAX_SIDE;
use crate::image::{Image, ImageView, PixelFormat};

/// Red, green, blue.
pub type Colour = [u8; 3];

/// An RGB image to draw on. Positions are pixels, (0, 0) the centre of the top-left one; what lies
/// outside the image, or is not finite, is left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Canvas {
    image: Image,
}

impl Canvas {
    /// A copy of an image.
    pub fn new(view: &ImageView<'_>) -> Self {
        let mut image = Image::new(PixelFormat::Rgb24, view.width(), view.height());
        let width = view.width();
        for (y, row) in image.data.chunks_exact_mut(3 * width as usize).enumerate() {
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                pixel.copy_from_slice(&view.rgb(x as u32, y as u32));
            }
        }
        Self { image }
    }

    /// An image itself, where it can be drawn on.
    pub fn from_image(image: Image) -> Result<Self> {
        if image.format == PixelFormat::Rgb24 && image.view().is_ok() {
            Ok(Self { image })
        } else {
            Ok(Self::new(&image.view()?))
        }
    }

    /// Two images side by side on black; the second begins at x = the first one's width.
    ///
    /// # Errors
    /// `InvalidArgument` where they are together too wide.
    pub fn beside(left: &ImageView<'_>, right: &ImageView<'_>) -> Result<Self> {
        let (width, height) = (left.width() + right.width(), left.height().max(right.height()));
        if width > MAX_SIDE {
            return Err(Error::invalid("image", format!("{width} pixels are too wide")));
        }
        let mut image = Image::new(PixelFormat::Rgb24, width, height);
        let row_bytes = 3 * image.width as usize;
        for (view, x) in [(left, 0), (right, left.width())] {
            let part = Self::new(view).image;
            for (from, to) in
                part.data.chunks_exact(3 * view.width() as usize).zip(image.data.chunks_exact_mut(row_bytes))
            {
                let start = 3 * x as usize;
                to[start..start + from.len()].copy_from_slice(from);
            }
        }
        Ok(Self { image })
    }

    pub fn image(&self) -> &Image {
        &self.image
    }

    pub fn view(&self) -> Result<ImageView<'_>> {
        self.image.view()
    }

    /// Darkens the picture to this part of its light, so that marks stand out.
    pub fn dim(&mut self, light: f64) {
        let light = light.clamp(0.0, 1.0);
        self.image.data.iter_mut().for_each(|v| *v = (f64::from(*v) * light).round() as u8);
    }

    /// A line of some width, pixels, with round ends.
    pub fn line(&mut self, from: Vector2<f64>, to: Vector2<f64>, width: f64, colour: Colour) {
        let Some((from, to)) = self.clip(from, to, width) else { return };
        let along = to - from;
        let square = along.norm_squared();
        self.shade(from.inf(&to), from.sup(&to), width, colour, |p| {
            let t = if square > 0.0 { ((p - from).dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
            (p - from - along * t).norm() - 0.5 * width
        });
    }

    /// A circle's line of some width, pixels.
    pub fn circle(&mut self, centre: Vector2<f64>, radius: f64, width: f64, colour: Colour) {
        let reach = Vector2::repeat(radius);
        self.shade(centre - reach, centre + reach, width, colour, |p| {
            ((p - centre).norm() - radius).abs() - 0.5 * width
        });
    }

    /// A full disc.
    pub fn disc(&mut self, centre: Vector2<f64>, radius: f64, colour: Colour) {
        self.line(centre, centre, 2.0 * radius, colour);
    }

    /// An upright cross of two lines, each twice `reach` long.
    pub fn cross(&mut self, centre: Vector2<f64>, reach: f64, width: f64, colour: Colour) {
        for arm in [Vector2::new(reach, 0.0), Vector2::new(0.0, reach)] {
            self.line(centre - arm, centre + arm, width, colour);
        }
    }

    /// A line with a head at `to`.
    pub fn arrow(&mut self, from: Vector2<f64>, to: Vector2<f64>, width: f64, colour: Colour) {
        self.line(from, to, width, colour);
        let along = to - from;
        let head = (0.3 * along.norm()).min(5.0 * width);
        if let Some(along) = along.try_normalize(1e-9) {
            let across = Vector2::new(-along.y, along.x);
            for side in [0.5, -0.5] {
                self.line(to, to - (along - across * side) * head, width, colour);
            }
        }
    }

    /// The part of a line that the picture shows (Liang and Barsky 1984), a little more for its width.
    fn clip(&self, from: Vector2<f64>, to: Vector2<f64>, width: f64) -> Option<(Vector2<f64>, Vector2<f64>)> {
        let margin = width + 2.0;
        let limits = [self.image.width as f64 + margin, self.image.height as f64 + margin];
        let along = to - from;
        let (mut t0, mut t1) = (0.0f64, 1.0f64);
        for (i, limit) in limits.into_iter().enumerate() {
            let [low, high] = [(-margin - from[i]) / along[i], (limit - from[i]) / along[i]];
            if along[i] == 0.0 {
                if !(from[i] >= -margin && from[i] <= limit) {
                    return None;
                }
            } else {
                t0 = t0.max(low.min(high));
                t1 = t1.min(low.max(high));
            }
        }
        let ends = (from + along * t0, from + along * t1);
        let finite = |p: &Vector2<f64>| p.x.is_finite() && p.y.is_finite();
        (t0 <= t1 && finite(&ends.0) && finite(&ends.1)).then_some(ends)
    }

    /// Blends `colour` in wherever the signed distance from the shape is negative, with an edge of one
    /// pixel, within the box from `low` to `high` and `width` around it.
    fn shade(
        &mut self,
        low: Vector2<f64>,
        high: Vector2<f64>,
        width: f64,
        colour: Colour,
        distance: impl Fn(Vector2<f64>) -> f64,
    ) {
        let reach = 0.5 * width + 1.0;
        let range = |low: f64, high: f64, size: u32| {
            let last = f64::from(size) - 1.0;
            // Not a number fails the comparison.
            let seen = low - reach <= last && high + reach >= 0.0;
            seen.then(|| ((low - reach).max(0.0) as usize, (high + reach).min(last) as usize))
        };
        let Some((left, right)) = range(low.x, high.x, self.image.width) else { return };
        let Some((top, bottom)) = range(low.y, high.y, self.image.height) else { return };
        let row_bytes = 3 * self.image.width as usize;
        for y in top..=bottom {
            for x in left..=right {
                let cover = (0.5 - distance(Vector2::new(x as f64, y as f64))).clamp(0.0, 1.0);
                let at = y * row_bytes + 3 * x;
                for (value, colour) in self.image.data[at..at + 3].iter_mut().zip(colour) {
                    let mixed = f64::from(*value) + (f64::from(colour) - f64::from(*value)) * cover;
                    *value = mixed.round() as u8;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: Colour = [255, 0, 0];

    fn black(width: u32, height: u32) -> Canvas {
        Canvas { image: Image::new(PixelFormat::Rgb24, width, height) }
    }

    fn light(canvas: &Canvas) -> f64 {
        canvas.image.data.iter().map(|v| f64::from(*v) / 255.0).sum()
    }

    #[test]
    fn a_line_covers_its_area_wherever_it_lies() {
        for (from, to) in [([10.0, 20.0], [50.0, 20.0]), ([10.3, 8.1], [34.3, 40.1])] {
            let mut canvas = black(64, 48);
            canvas.line(from.into(), to.into(), 3.0, RED);
            let length = Vector2::from(to).metric_distance(&Vector2::from(from));
            let area = 3.0 * length + std::f64::consts::PI * 1.5f64.powi(2);
            assert!((light(&canvas) - area).abs() < 0.03 * area, "{} {area}", light(&canvas));
        }
        let mut canvas = black(64, 48);
        canvas.circle(Vector2::new(30.0, 20.0), 10.0, 2.0, RED);
        let area = 40.0 * std::f64::consts::PI;
        assert!((light(&canvas) - area).abs() < 0.03 * area);
    }

    #[test]
    fn what_is_outside_or_no_number_is_left_out() {
        let blank = black(20, 10);
        let mut canvas = blank.clone();
        let far = Vector2::new(1e300, -1e300);
        canvas.line(Vector2::new(30.0, 0.0), Vector2::new(30.0, 9.0), 2.0, RED);
        canvas.line(Vector2::new(f64::NAN, 0.0), Vector2::new(3.0, 4.0), 2.0, RED);
        canvas.line(far, far, 2.0, RED);
        canvas.circle(far, 3.0, 1.0, RED);
        canvas.circle(Vector2::repeat(f64::NAN), 3.0, 1.0, RED);
        canvas.arrow(Vector2::repeat(f64::INFINITY), Vector2::zeros(), 1.0, RED);
        assert_eq!(canvas, blank);
        // A line from far away crosses the picture.
        canvas.line(Vector2::new(-1e9, 5.0), Vector2::new(1e9, 5.0), 1.0, RED);
        assert_eq!(light(&canvas), 20.0);
    }

    #[test]
    fn images_stand_side_by_side() {
        let (mut left, mut right) = (Image::new(PixelFormat::Gray8, 3, 2), Image::new(PixelFormat::Gray8, 2, 4));
        left.data.fill(10);
        right.data.fill(20);
        let both = Canvas::beside(&left.view().unwrap(), &right.view().unwrap()).unwrap();
        let view = both.view().unwrap();
        assert_eq!((view.width(), view.height()), (5, 4));
        assert_eq!([view.rgb(2, 1)[0], view.rgb(2, 2)[0], view.rgb(3, 0)[0], view.rgb(4, 3)[0]], [10, 0, 20, 20]);
    }
}
