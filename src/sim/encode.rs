//! Blue-green-red pixels to the other formats (YUV: full-range BT.601, as the image views read it).

use crate::image::{Image, PixelFormat};

/// Fills `image` from packed blue, green, red of the same size.
pub fn from_bgr(bgr: &[u8], image: &mut Image) {
    let (width, height) = (image.width as usize, image.height as usize);
    let pixels = bgr.chunks_exact(3);
    match image.format {
        PixelFormat::Bgr24 => image.data.copy_from_slice(bgr),
        PixelFormat::Rgb24 => {
            for (out, p) in image.data.chunks_exact_mut(3).zip(pixels) {
                out.copy_from_slice(&[p[2], p[1], p[0]]);
            }
        }
        PixelFormat::Rgba32 => {
            for (out, p) in image.data.chunks_exact_mut(4).zip(pixels) {
                out.copy_from_slice(&[p[2], p[1], p[0], 255]);
            }
        }
        PixelFormat::Bgra32 => {
            for (out, p) in image.data.chunks_exact_mut(4).zip(pixels) {
                out.copy_from_slice(&[p[0], p[1], p[2], 255]);
            }
        }
        PixelFormat::Gray8 => {
            for (out, p) in image.data.iter_mut().zip(pixels) {
                *out = luma(p);
            }
        }
        PixelFormat::Yuyv => {
            for (out, pair) in image.data.chunks_exact_mut(4).zip(bgr.chunks_exact(6)) {
                let (left, right) = pair.split_at(3);
                let mean = std::array::from_fn(|k| (u32::from(left[k]) + u32::from(right[k])) as f32 / 2.0);
                let [u, v] = chroma(mean);
                out.copy_from_slice(&[luma(left), u, luma(right), v]);
            }
        }
        PixelFormat::Nv12 | PixelFormat::I420 => {
            let (luminance, colour) = image.data.split_at_mut(width * height);
            for (out, p) in luminance.iter_mut().zip(pixels) {
                *out = luma(p);
            }
            let (half_width, half_height) = (width.div_ceil(2), height.div_ceil(2));
            for y in 0..half_height {
                for x in 0..half_width {
                    let [u, v] = chroma(mean_of_four(bgr, width, height, 2 * x, 2 * y));
                    let at = y * half_width + x;
                    if image.format == PixelFormat::Nv12 {
                        colour[2 * at..2 * at + 2].copy_from_slice(&[u, v]);
                    } else {
                        colour[at] = u;
                        colour[half_width * half_height + at] = v;
                    }
                }
            }
        }
    }
}

/// The last column and row stand in for those that an odd size lacks.
fn mean_of_four(bgr: &[u8], width: usize, height: usize, x: usize, y: usize) -> [f32; 3] {
    let (right, below) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
    let corners = [(x, y), (right, y), (x, below), (right, below)];
    std::array::from_fn(|k| corners.iter().map(|(x, y)| f32::from(bgr[3 * (y * width + x) + k])).sum::<f32>() / 4.0)
}

fn luma(p: &[u8]) -> u8 {
    // 0.114, 0.587, 0.299 in parts of 65536.
    ((7471 * u32::from(p[0]) + 38470 * u32::from(p[1]) + 19595 * u32::from(p[2]) + 32768) >> 16) as u8
}

fn chroma([b, g, r]: [f32; 3]) -> [u8; 2] {
    let u = -0.168_736 * r - 0.331_264 * g + 0.5 * b;
    let v = 0.5 * r - 0.418_688 * g - 0.081_312 * b;
    [u, v].map(|c| (c + 128.5).clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_reads_back_as_the_colours_that_went_in() {
        // Colours change every second pixel, so that halved chroma loses nothing; sizes are odd.
        for (width, height) in [(6u32, 4u32), (6, 5)] {
            let mut bgr = Vec::new();
            for y in 0..height {
                for x in 0..width {
                    bgr.extend([(40 + 30 * (x / 2)) as u8, (200 - 25 * (y / 2)) as u8, 120]);
                }
            }
            for code in 1..=8u32 {
                let format = PixelFormat::try_from(code).unwrap();
                let mut image = Image::new(format, width, height);
                from_bgr(&bgr, &mut image);
                for y in 0..height {
                    for x in 0..width {
                        let p = &bgr[3 * (y * width + x) as usize..][..3];
                        let wanted = if format == PixelFormat::Gray8 { [luma(p); 3] } else { [p[2], p[1], p[0]] };
                        let found = image.view().unwrap().rgb(x, y);
                        for k in 0..3 {
                            assert!(found[k].abs_diff(wanted[k]) <= 2, "{format:?} {x} {y}: {found:?} {wanted:?}");
                        }
                    }
                }
            }
        }
    }
}
