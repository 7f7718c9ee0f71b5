//! Grey images of any format, and their pyramid: each level is half as wide and high as the one
//! before, the mean of 2 x 2 pixels.
#![allow(unsafe_code)]

use super::{ImageView, PixelFormat};
use crate::vectors::for_each_processor;

/// A grey image: rows of one byte a pixel.
#[derive(Debug, Clone)]
pub struct Grey<'a> {
    width: usize,
    height: usize,
    pixels: Pixels<'a>,
}

#[derive(Debug, Clone)]
enum Pixels<'a> {
    /// A view whose plane 0 is grey already.
    View(ImageView<'a>),
    Packed(Vec<u8>),
}

impl<'a> Grey<'a> {
    /// The view itself where its plane 0 is luma, else a copy: BT.601 luma of colours.
    pub fn of(view: &ImageView<'a>) -> Self {
        let (width, height) = (view.width() as usize, view.height() as usize);
        let converted = |pixel_bytes: usize, luma: fn(&[u8]) -> u8| {
            let mut pixels = Vec::with_capacity(width * height);
            for y in 0..height {
                pixels.extend(view.row(0, y).chunks_exact(pixel_bytes).map(luma));
            }
            Pixels::Packed(pixels)
        };
        let pixels = match view.format() {
            PixelFormat::Gray8 | PixelFormat::Nv12 | PixelFormat::I420 => Pixels::View(*view),
            PixelFormat::Yuyv => converted(2, |p| p[0]),
            PixelFormat::Rgb24 => converted(3, |p| luma(p[0], p[1], p[2])),
            PixelFormat::Bgr24 => converted(3, |p| luma(p[2], p[1], p[0])),
            PixelFormat::Rgba32 => converted(4, |p| luma(p[0], p[1], p[2])),
            PixelFormat::Bgra32 => converted(4, |p| luma(p[2], p[1], p[0])),
        };
        Self { width, height, pixels }
    }

    pub fn width(&self) -> usize {
        self.width
    }

    pub fn height(&self) -> usize {
        self.height
    }

    pub fn row(&self, y: usize) -> &[u8] {
        match &self.pixels {
            Pixels::View(view) => view.row(0, y),
            Pixels::Packed(pixels) => &pixels[y * self.width..(y + 1) * self.width],
        }
    }

    /// Half the width and height, rounded down: the mean of 2 x 2 pixels.
    fn halved(&self) -> Grey<'static> {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut pixels = vec![0u8; width * height];
        for (y, out) in pixels.chunks_exact_mut(width.max(1)).enumerate() {
            halve(out, self.row(2 * y), self.row(2 * y + 1));
        }
        Grey { width, height, pixels: Pixels::Packed(pixels) }
    }
}

for_each_processor! {
    /// Means of 2 x 2 pixels of two rows.
    fn halve(out: &mut [u8], upper: &[u8], lower: &[u8]) {
        let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
        for (out, (a, b)) in out.iter_mut().zip(pairs) {
            *out = ((a[0] as u16 + a[1] as u16 + b[0] as u16 + b[1] as u16 + 2) >> 2) as u8;
        }
    }
}

fn luma(r: u8, g: u8, b: u8) -> u8 {
    ((77 * r as u32 + 150 * g as u32 + 29 * b as u32 + 128) >> 8) as u8
}

/// An image at full size, half, a quarter and so on.
#[derive(Debug, Clone)]
pub struct Pyramid<'a> {
    levels: Vec<Grey<'a>>,
}

impl<'a> Pyramid<'a> {
    /// Down to the last level whose sides are both at least `min_side`; the full size is always there.
    pub fn new(image: Grey<'a>, min_side: usize) -> Self {
        let mut levels = vec![image];
        while let Some(last) = levels.last()
            && last.width.min(last.height) / 2 >= min_side.max(1)
        {
            let next = last.halved();
            levels.push(next);
        }
        Self { levels }
    }

    /// Level 0 is the full size.
    pub fn levels(&self) -> &[Grey<'a>] {
        &self.levels
    }
}

/// Where a position of a level lies in level 0. Pixel (0, 0) of level l covers 2^l x 2^l pixels.
pub fn to_full_size(level: usize, [x, y]: [f64; 2]) -> [f64; 2] {
    let scale = (1u64 << level) as f64;
    [scale * (x + 0.5) - 0.5, scale * (y + 0.5) - 0.5]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;

    #[test]
    fn levels_are_means_of_pixels_and_know_where_they_lie() {
        let mut image = Image::new(PixelFormat::Gray8, 37, 21);
        for (i, p) in image.data.iter_mut().enumerate() {
            *p = (3 * (i % 37) + 2 * (i / 37)) as u8;
        }
        let pyramid = Pyramid::new(Grey::of(&image.view().unwrap()), 4);
        let sizes: Vec<_> = pyramid.levels().iter().map(|l| (l.width(), l.height())).collect();
        assert_eq!(sizes, [(37, 21), (18, 10), (9, 5)]);
        for (l, level) in pyramid.levels().iter().enumerate() {
            for y in 0..level.height() {
                for x in 0..level.width() {
                    let [fx, fy] = to_full_size(l, [x as f64, y as f64]);
                    let error = level.row(y)[x] as f64 - (3.0 * fx + 2.0 * fy);
                    assert!(error.abs() <= 0.5 * l as f64, "level {l} ({x}, {y}): {error}");
                }
            }
        }
    }

    #[test]
    fn every_format_is_read_as_its_luma() {
        for format in [
            PixelFormat::Gray8,
            PixelFormat::Rgb24,
            PixelFormat::Bgr24,
            PixelFormat::Rgba32,
            PixelFormat::Bgra32,
            PixelFormat::Yuyv,
            PixelFormat::Nv12,
            PixelFormat::I420,
        ] {
            let mut image = Image::new(format, 4, 2);
            image.data.fill(90);
            let red = match format {
                PixelFormat::Rgb24 | PixelFormat::Rgba32 => Some(0),
                PixelFormat::Bgr24 | PixelFormat::Bgra32 => Some(2),
                _ => None,
            };
            red.into_iter().for_each(|i| image.data[i] = 190);
            let view = image.view().unwrap();
            let grey = Grey::of(&view);
            // 0.299 of the red that was added.
            assert_eq!(grey.row(0)[0], if red.is_some() { 120 } else { 90 }, "{format:?}");
            assert_eq!(grey.row(1), [90; 4]);
        }
        assert_eq!(Pyramid::new(Grey::of(&Image::new(PixelFormat::Gray8, 1, 1).view().unwrap()), 0).levels().len(), 1);
    }
}
