//! Several frames of one scene, read as their mean without ever storing it.

mod kernels;

use std::ops::Range;

use super::{ImageView, PixelFormat};
use crate::error::{Error, Result};

/// Most frames that are averaged: sums fit in 16 bits.
pub const MAX_FRAMES: usize = 256;

/// One channel of plane 0: pixel x is byte `x * step + offset` of its row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Channel {
    pub step: usize,
    pub offset: usize,
}

const fn channel<const STEP: usize>(offset: usize) -> Channel {
    Channel { step: STEP, offset }
}

const RGB24: [Channel; 3] = [channel::<3>(0), channel::<3>(1), channel::<3>(2)];
const BGR24: [Channel; 3] = [channel::<3>(2), channel::<3>(1), channel::<3>(0)];
const RGBA32: [Channel; 3] = [channel::<4>(0), channel::<4>(1), channel::<4>(2)];
const BGRA32: [Channel; 3] = [channel::<4>(2), channel::<4>(1), channel::<4>(0)];
const GREY: [Channel; 1] = [channel::<1>(0)];
const YUYV: [Channel; 1] = [channel::<2>(0)];

/// The channels of plane 0 that measure light: red, green, blue, or luma alone.
pub fn channels(format: PixelFormat) -> &'static [Channel] {
    match format {
        PixelFormat::Rgb24 => &RGB24,
        PixelFormat::Bgr24 => &BGR24,
        PixelFormat::Rgba32 => &RGBA32,
        PixelFormat::Bgra32 => &BGRA32,
        PixelFormat::Yuyv => &YUYV,
        PixelFormat::Gray8 | PixelFormat::Nv12 | PixelFormat::I420 => &GREY,
    }
}

/// The mean of frames of one size and format.
#[derive(Debug, Clone, Copy)]
pub struct FrameMean<'a> {
    frames: &'a [ImageView<'a>],
}

impl<'a> FrameMean<'a> {
    /// # Errors
    /// `InvalidArgument` for no frame, more than 256, or unlike sizes or formats.
    pub fn new(name: &'static str, frames: &'a [ImageView<'a>]) -> Result<Self> {
        let Some(first) = frames.first() else {
            return Err(Error::invalid(name, "no frames"));
        };
        if frames.len() > MAX_FRAMES {
            return Err(Error::invalid(name, format!("{} frames; at most {MAX_FRAMES} are averaged", frames.len())));
        }
        for (i, f) in frames.iter().enumerate() {
            same_kind(name, i, first, f)?;
        }
        Ok(Self { frames })
    }

    pub fn first(&self) -> &'a ImageView<'a> {
        &self.frames[0]
    }

    pub fn count(&self) -> usize {
        self.frames.len()
    }

    /// Values of `out.len()` pixels of row `y` from column `x` on.
    pub fn read(&self, channel: Channel, x: usize, y: usize, out: &mut [f32]) {
        out.fill(0.0);
        for frame in self.frames {
            let bytes = &frame.row(0, y)[x * channel.step..(x + out.len()) * channel.step];
            match channel.step {
                1 => add::<1>(out, bytes, 0),
                2 => add::<2>(out, bytes, channel.offset),
                3 => add::<3>(out, bytes, channel.offset),
                _ => add::<4>(out, bytes, channel.offset),
            }
        }
        if self.frames.len() > 1 {
            let scale = 1.0 / self.frames.len() as f32;
            out.iter_mut().for_each(|v| *v *= scale);
        }
    }

    pub fn at(&self, channel: Channel, x: usize, y: usize) -> f32 {
        let mut value = [0.0];
        self.read(channel, x, y, &mut value);
        value[0]
    }

    /// The greatest values of `out.len()` pixels in any of the frames: a mean hides a clipped one.
    pub fn brightest(&self, channel: Channel, x: usize, y: usize, out: &mut [u8]) {
        out.fill(0);
        for frame in self.frames {
            let bytes = frame.row(0, y)[x * channel.step + channel.offset..].iter().step_by(channel.step);
            out.iter_mut().zip(bytes).for_each(|(most, b)| *most = (*most).max(*b));
        }
    }

    /// Red, green, blue of a pixel.
    pub fn rgb(&self, x: usize, y: usize) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for frame in self.frames {
            let rgb = frame.rgb(x as u32, y as u32);
            sum.iter_mut().zip(rgb).for_each(|(s, c)| *s += c as f32);
        }
        sum.map(|s| s / self.frames.len() as f32)
    }

    /// Bytes of row `y` of plane 0: those of the only frame, or the frames' rounded mean in `buffer`.
    pub fn bytes<'b>(&self, y: usize, range: Range<usize>, buffer: &'b mut RowBuffer) -> &'b [u8]
    where
        'a: 'b,
    {
        if let [frame] = self.frames {
            return &frame.row(0, y)[range];
        }
        buffer.sums.clear();
        buffer.sums.resize(range.len(), 0);
        for frame in self.frames {
            kernels::add_bytes(&mut buffer.sums, &frame.row(0, y)[range.clone()]);
        }
        buffer.mean.resize(range.len(), 0);
        kernels::scale_to_bytes(&mut buffer.mean, &buffer.sums, (1 << 24) / self.frames.len() as u32);
        &buffer.mean
    }
}

/// Adds one byte of each pixel.
fn add<const STEP: usize>(out: &mut [f32], bytes: &[u8], offset: usize) {
    for (sum, pixel) in out.iter_mut().zip(bytes.as_chunks::<STEP>().0) {
        *sum += pixel[offset % STEP] as f32;
    }
}

/// Scratch for [`FrameMean::bytes`].
#[derive(Debug, Default)]
pub struct RowBuffer {
    sums: Vec<u16>,
    mean: Vec<u8>,
}

/// `InvalidArgument` unless both have one size and format.
pub fn same_kind(name: &'static str, index: usize, wanted: &ImageView<'_>, given: &ImageView<'_>) -> Result<()> {
    let kind = |v: &ImageView<'_>| (v.format(), v.width(), v.height());
    if kind(wanted) == kind(given) {
        return Ok(());
    }
    let (format, w, h) = kind(given);
    let (format0, w0, h0) = kind(wanted);
    let reason = format!("frame {index} is {format:?} {w} x {h}, the first on frame {format0:?} {w0} x {h0}");
    Err(Error::invalid(name, reason))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use crate::vectors::tests::of_each_processor;

    #[test]
    fn means_of_bytes_are_rounded_alike_on_every_processor() {
        for count in [2usize, 3, 7, 256] {
            let frames: Vec<Image> = (0..count)
                .map(|k| {
                    let mut image = Image::new(PixelFormat::Gray8, 301, 1);
                    let level = |x: usize| if x < 4 { 255 } else { (x * (k + 3) * 37 + k * k) as u8 };
                    image.data.iter_mut().enumerate().for_each(|(x, v)| *v = level(x));
                    image
                })
                .collect();
            let views: Vec<ImageView<'_>> = frames.iter().map(|f| f.view().unwrap()).collect();
            let mean = FrameMean::new("frames", &views).unwrap();
            for range in [0..301, 5..6, 17..300] {
                let wanted: Vec<u8> = range
                    .clone()
                    .map(|x| frames.iter().map(|f| f.data[x] as usize).sum::<usize>())
                    .map(|sum| ((2 * sum + count) / (2 * count)) as u8)
                    .collect();
                for bytes in of_each_processor(|| mean.bytes(0, range.clone(), &mut RowBuffer::default()).to_vec()) {
                    // Halves may be rounded either way.
                    assert_eq!(bytes.len(), wanted.len());
                    assert!(bytes.iter().zip(&wanted).all(|(a, b)| a.abs_diff(*b) <= 1));
                    let off = bytes.iter().zip(&wanted).filter(|(a, b)| a != b).count();
                    assert!(off == 0 || count % 2 == 0 && off < 20, "{count}: {off}");
                }
            }
        }
    }
}
