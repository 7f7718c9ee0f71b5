//! Pixel formats, strides and colours.

use super::render::*;
use crate::detect::spot::*;
use crate::error::Error;
use crate::image::{Image, ImageView, PixelFormat};

/// Planes with padded rows, and their strides.
type Planes = Vec<(Vec<u8>, isize)>;

/// The grey image in another format, with rows padded and, at will, stored bottom up.
fn convert(grey: &Image, format: PixelFormat, bottom_up: bool) -> Planes {
    let (w, h) = (grey.width as usize, grey.height as usize);
    let plane = |plane: usize| {
        let row_bytes = format.row_bytes(plane, grey.width).unwrap();
        let (rows, stride) = (format.rows(plane, grey.height), row_bytes + 5);
        let mut data = vec![77u8; stride * rows];
        for y in 0..rows {
            let at = if bottom_up { rows - 1 - y } else { y } * stride;
            for (i, byte) in data[at..at + row_bytes].iter_mut().enumerate() {
                *byte = match format {
                    PixelFormat::Rgba32 | PixelFormat::Bgra32 if i % 4 == 3 => 255,
                    PixelFormat::Yuyv if i % 2 == 1 => 128,
                    _ if plane > 0 => 128,
                    _ => grey.data[y.min(h - 1) * w + i * w / row_bytes],
                };
            }
        }
        (data, if bottom_up { -(stride as isize) } else { stride as isize })
    };
    (0..format.planes()).map(plane).collect()
}

fn view(format: PixelFormat, size: [u32; 2], planes: &Planes) -> ImageView<'_> {
    let planes: Vec<(&[u8], isize)> = planes.iter().map(|(data, stride)| (data.as_slice(), *stride)).collect();
    ImageView::new(format, size[0], size[1], &planes).unwrap()
}

#[test]
fn all_formats_and_strides_give_the_same_spot() {
    use PixelFormat::*;
    let mut random = Random::new(8);
    let room = Light::room(98, 75);
    let on = room.with_spot(41.3, 30.8, 90.0, 1.5).shoot(&CAMERA, &mut random);
    let off = room.shoot(&CAMERA, &mut random);
    let wanted = detect(&on, &off, &SpotOptions::default()).unwrap();
    for format in [Gray8, Rgb24, Bgr24, Rgba32, Bgra32, Yuyv, Nv12, I420] {
        for bottom_up in [false, true] {
            let [on, off] = [&on, &off].map(|image| convert(image, format, bottom_up));
            let [on, off] = [&on, &off].map(|planes| view(format, [98, 75], planes));
            let spot = detect_spot(&[on], &[off], &SpotOptions::default()).unwrap();
            assert_eq!(spot, wanted, "{format:?} {bottom_up}");
        }
    }
}

/// Light of one colour, as RGB.
fn shoot_rgb(background: &Light, spots: &[([f64; 2], [f64; 3])], random: &mut Random) -> Image {
    let mut image = Image::new(PixelFormat::Rgb24, background.width as u32, background.height as u32);
    for c in 0..3 {
        let lit = spots.iter().fold(background.clone(), |light, (at, rgb)| light.with_spot(at[0], at[1], rgb[c], 1.5));
        let grey = lit.shoot(&CAMERA, random);
        image.data[c..].iter_mut().step_by(3).zip(grey.data).for_each(|(byte, v)| *byte = v);
    }
    image
}

#[test]
fn the_lasers_colour_counts() {
    let mut random = Random::new(9);
    let room = Light::room(120, 90);
    let off = shoot_rgb(&room, &[], &mut random);
    let red = ([40.3, 50.6], [90.0, 12.0, 6.0]);
    let lamp = ([90.2, 20.7], [100.0, 100.0, 100.0]);
    let with = |colour| SpotOptions { colour, ..SpotOptions::default() };

    let on = shoot_rgb(&room, &[red], &mut random);
    for colour in [LaserColour::Red, LaserColour::Unknown, LaserColour::White] {
        assert_at(&detect(&on, &off, &with(colour)).unwrap(), 40.3, 50.6, 0.15);
    }
    // Another colour is told apart, and so is white light that came on.
    assert!(matches!(detect(&on, &off, &with(LaserColour::Green)), Err(Error::NotFound { .. })));
    let on = shoot_rgb(&room, &[lamp], &mut random);
    assert!(matches!(detect(&on, &off, &with(LaserColour::Red)), Err(Error::NotFound { .. })));
    assert_at(&detect(&on, &off, &with(LaserColour::White)).unwrap(), 90.2, 20.7, 0.15);
}
