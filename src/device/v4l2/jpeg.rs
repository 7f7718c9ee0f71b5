//! Frames that come as JPEG (Motion JPEG): whole ones become images, others are refused.

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::jpeg_scan::is_complete;
use crate::image::{Image, PixelFormat};

/// Markers (ITU-T T.81, table B.1).
const SOI: [u8; 2] = [0xff, 0xd8];
const EOI: [u8; 2] = [0xff, 0xd9];
const DHT: u8 = 0xc4;
const SOS: u8 = 0xda;

/// The Huffman tables of T.81 annex K.3 as one DHT segment. Cameras may leave them out.
#[rustfmt::skip]
const STANDARD_TABLES: [u8; 420] = [
    0xff, DHT, 0x01, 0xa2,
    // DC of luminance.
    0x00, 0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0,
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11,
    // AC of luminance.
    0x10, 0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 0x7d,
    0x01, 0x02, 0x03, 0x00, 0x04, 0x11, 0x05, 0x12, 0x21, 0x31, 0x41, 0x06, 0x13, 0x51, 0x61, 0x07,
    0x22, 0x71, 0x14, 0x32, 0x81, 0x91, 0xa1, 0x08, 0x23, 0x42, 0xb1, 0xc1, 0x15, 0x52, 0xd1, 0xf0,
    0x24, 0x33, 0x62, 0x72, 0x82, 0x09, 0x0a, 0x16, 0x17, 0x18, 0x19, 0x1a, 0x25, 0x26, 0x27, 0x28,
    0x29, 0x2a, 0x34, 0x35, 0x36, 0x37, 0x38, 0x39, 0x3a, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48, 0x49,
    0x4a, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59, 0x5a, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69,
    0x6a, 0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7a, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89,
    0x8a, 0x92, 0x93, 0x94, 0x95, 0x96, 0x97, 0x98, 0x99, 0x9a, 0xa2, 0xa3, 0xa4, 0xa5, 0xa6, 0xa7,
    0xa8, 0xa9, 0xaa, 0xb2, 0xb3, 0xb4, 0xb5, 0xb6, 0xb7, 0xb8, 0xb9, 0xba, 0xc2, 0xc3, 0xc4, 0xc5,
    0xc6, 0xc7, 0xc8, 0xc9, 0xca, 0xd2, 0xd3, 0xd4, 0xd5, 0xd6, 0xd7, 0xd8, 0xd9, 0xda, 0xe1, 0xe2,
    0xe3, 0xe4, 0xe5, 0xe6, 0xe7, 0xe8, 0xe9, 0xea, 0xf1, 0xf2, 0xf3, 0xf4, 0xf5, 0xf6, 0xf7, 0xf8,
    0xf9, 0xfa,
    // DC of chrominance.
    0x01, 0, 3, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0,
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11,
    // AC of chrominance.
    0x11, 0, 2, 1, 2, 4, 4, 3, 4, 7, 5, 4, 4, 0, 1, 2, 0x77,
    0x00, 0x01, 0x02, 0x03, 0x11, 0x04, 0x05, 0x21, 0x31, 0x06, 0x12, 0x41, 0x51, 0x07, 0x61, 0x71,
    0x13, 0x22, 0x32, 0x81, 0x08, 0x14, 0x42, 0x91, 0xa1, 0xb1, 0xc1, 0x09, 0x23, 0x33, 0x52, 0xf0,
    0x15, 0x62, 0x72, 0xd1, 0x0a, 0x16, 0x24, 0x34, 0xe1, 0x25, 0xf1, 0x17, 0x18, 0x19, 0x1a, 0x26,
    0x27, 0x28, 0x29, 0x2a, 0x35, 0x36, 0x37, 0x38, 0x39, 0x3a, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48,
    0x49, 0x4a, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59, 0x5a, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68,
    0x69, 0x6a, 0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7a, 0x82, 0x83, 0x84, 0x85, 0x86, 0x87,
    0x88, 0x89, 0x8a, 0x92, 0x93, 0x94, 0x95, 0x96, 0x97, 0x98, 0x99, 0x9a, 0xa2, 0xa3, 0xa4, 0xa5,
    0xa6, 0xa7, 0xa8, 0xa9, 0xaa, 0xb2, 0xb3, 0xb4, 0xb5, 0xb6, 0xb7, 0xb8, 0xb9, 0xba, 0xc2, 0xc3,
    0xc4, 0xc5, 0xc6, 0xc7, 0xc8, 0xc9, 0xca, 0xd2, 0xd3, 0xd4, 0xd5, 0xd6, 0xd7, 0xd8, 0xd9, 0xda,
    0xe2, 0xe3, 0xe4, 0xe5, 0xe6, 0xe7, 0xe8, 0xe9, 0xea, 0xf2, 0xf3, 0xf4, 0xf5, 0xf6, 0xf7, 0xf8,
    0xf9, 0xfa,
];

/// Decodes a whole frame of the size that was agreed, grey or RGB, into `image`, whose memory is used
/// again. The error says what is wrong with the frame.
pub fn decode(bytes: &[u8], width: u32, height: u32, image: &mut Image) -> Result<(), String> {
    // Buffers are filled up with zeros.
    let end = bytes.iter().rposition(|&b| b != 0).map_or(0, |last| last + 1);
    let bytes = &bytes[..end];
    if !bytes.starts_with(&SOI) {
        return Err("it does not begin as a JPEG".into());
    }
    if !bytes.ends_with(&EOI) {
        return Err(format!("its end is missing after {} bytes", bytes.len()));
    }
    let headers = Headers::read(bytes).ok_or("its headers are damaged")?;
    if headers.has_tables {
        return decode_whole(bytes, width, height, image);
    }
    let mut completed = Vec::with_capacity(bytes.len() + STANDARD_TABLES.len());
    completed.extend_from_slice(&bytes[..headers.scan]);
    completed.extend_from_slice(&STANDARD_TABLES);
    completed.extend_from_slice(&bytes[headers.scan..]);
    decode_whole(&completed, width, height, image)
}

struct Headers {
    has_tables: bool,
    /// Where the first scan's segment begins.
    scan: usize,
}

impl Headers {
    /// Walks over the segments up to the first scan.
    fn read(bytes: &[u8]) -> Option<Self> {
        let mut at = SOI.len();
        let mut has_tables = false;
        loop {
            let &[mark, kind] = bytes.get(at..at + 2)? else { return None };
            if mark != 0xff {
                return None;
            }
            match kind {
                // A fill byte.
                0xff => {
                    at += 1;
                    continue;
                }
                SOS => return Some(Self { has_tables, scan: at }),
                DHT => has_tables = true,
                _ => {}
            }
            let &[high, low] = bytes.get(at + 2..at + 4)? else { return None };
            at += 2 + usize::from(u16::from_be_bytes([high, low])).max(2);
        }
    }
}

fn decode_whole(bytes: &[u8], width: u32, height: u32, image: &mut Image) -> Result<(), String> {
    if is_complete(bytes) == Some(false) {
        return Err(format!("a part is missing of its {} bytes", bytes.len()));
    }
    // Strict: otherwise what is missing is filled in grey, and that is taken for a picture.
    let options =
        DecoderOptions::default().set_strict_mode(true).set_max_width(width as usize).set_max_height(height as usize);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|e| e.to_string())?;
    let (format, colours) = match decoder.input_colorspace() {
        Some(ColorSpace::Luma) => (PixelFormat::Gray8, ColorSpace::Luma),
        _ => (PixelFormat::Rgb24, ColorSpace::RGB),
    };
    decoder.set_options(options.jpeg_set_out_colorspace(colours));
    let info = decoder.info().ok_or("it says nothing of its size")?;
    if (u32::from(info.width), u32::from(info.height)) != (width, height) {
        return Err(format!("it is {} x {}, and {width} x {height} was agreed", info.width, info.height));
    }
    if (image.format, image.width, image.height) != (format, width, height)
        || Some(image.data.len()) != decoder.output_buffer_size()
    {
        *image = Image::new(format, width, height);
    }
    if Some(image.data.len()) != decoder.output_buffer_size() {
        return Err("its kind of colour is not supported".into());
    }
    decoder.decode_into(&mut image.data).map_err(|e| e.to_string())
}

#[cfg(test)]
pub(super) mod tests {
    use image::ExtendedColorType;
    use image::codecs::jpeg::JpegEncoder;
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    use super::*;

    pub fn encoded(width: u32, height: u32, colour: bool) -> Vec<u8> {
        let channels = if colour { 3 } else { 1 };
        let pixels: Vec<u8> =
            (0..width * height * channels).map(|i| (128.0 + 90.0 * (f64::from(i) * 0.01).sin()) as u8).collect();
        let mut bytes = Vec::new();
        let kind = if colour { ExtendedColorType::Rgb8 } else { ExtendedColorType::L8 };
        JpegEncoder::new_with_quality(&mut bytes, 90).encode(&pixels, width, height, kind).unwrap();
        bytes
    }

    /// 40x24 frames of libjpeg-turbo: colour at half size with restart markers, at half width as cameras
    /// have it, and with tables of its own.
    const OTHER_ENCODERS: [(&str, &[u8]); 3] = [
        ("restarts", include_bytes!("../../../tests/hardware/frames/restarts.jpg")),
        ("422", include_bytes!("../../../tests/hardware/frames/422.jpg")),
        ("optimised", include_bytes!("../../../tests/hardware/frames/optimised.jpg")),
    ];

    /// Without the tables' segments, which are given as well.
    fn stripped(jpeg: &[u8]) -> (Vec<u8>, Vec<u8>) {
        let (mut rest, mut tables) = (jpeg[..2].to_vec(), Vec::new());
        let mut at = 2;
        while jpeg[at + 1] != SOS {
            let length = 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
            let segment = &jpeg[at..at + length];
            if segment[1] == DHT {
                tables.extend_from_slice(&segment[4..])
            } else {
                rest.extend_from_slice(segment)
            }
            at += length;
        }
        rest.extend_from_slice(&jpeg[at..]);
        (rest, tables)
    }

    #[test]
    fn frames_are_decoded_with_and_without_their_tables() {
        for colour in [true, false] {
            let jpeg = encoded(64, 48, colour);
            let expected = image::load_from_memory(&jpeg).unwrap();
            let mut whole = Image::new(PixelFormat::Gray8, 0, 0);
            decode(&jpeg, 64, 48, &mut whole).unwrap();
            let format = if colour { PixelFormat::Rgb24 } else { PixelFormat::Gray8 };
            assert_eq!((whole.format, whole.width, whole.height), (format, 64, 48));
            assert_eq!(whole.data, expected.into_bytes());
            let (without, tables) = stripped(&jpeg);
            assert!(without.len() < jpeg.len() && !Headers::read(&without).unwrap().has_tables);
            let mut completed = Image::new(PixelFormat::Gray8, 0, 0);
            decode(&without, 64, 48, &mut completed).unwrap();
            assert_eq!(completed, whole);
            // Another encoder's copy of the same annex.
            if colour {
                assert_eq!(tables.len(), STANDARD_TABLES.len() - 4);
                for table in tables_of(&tables) {
                    assert!(tables_of(&STANDARD_TABLES[4..]).contains(&table));
                }
            }
            // Zeros behind the end, as buffers have them.
            let mut padded = jpeg.clone();
            padded.extend_from_slice(&[0; 1000]);
            decode(&padded, 64, 48, &mut completed).unwrap();
            assert_eq!(completed, whole);
        }
    }

    fn tables_of(mut bytes: &[u8]) -> Vec<Vec<u8>> {
        let mut tables = Vec::new();
        while bytes.len() > 17 {
            let length = 17 + bytes[1..17].iter().map(|&n| usize::from(n)).sum::<usize>();
            tables.push(bytes[..length].to_vec());
            bytes = &bytes[length..];
        }
        tables
    }

    #[test]
    fn whole_frames_of_every_size_are_complete() {
        for (width, height) in [(1, 1), (8, 8), (9, 17), (16, 16), (33, 15), (640, 480)] {
            for colour in [true, false] {
                let jpeg = encoded(width, height, colour);
                assert_eq!(is_complete(&jpeg), Some(true), "{width} x {height}");
                // One scan's data byte less, end and all.
                let short = [&jpeg[..jpeg.len() - 3], &EOI].concat();
                assert!(is_complete(&short) == Some(false) || jpeg.len() < 1000);
            }
        }
        let mut image = Image::new(PixelFormat::Gray8, 0, 0);
        for (name, bytes) in OTHER_ENCODERS {
            assert_eq!(is_complete(bytes), Some(true), "{name}");
            decode(bytes, 40, 24, &mut image).unwrap();
            let other = image::load_from_memory(bytes).unwrap();
            assert_eq!(image.data, other.into_bytes(), "{name}");
            let short = [&bytes[..bytes.len() - 4], &EOI].concat();
            assert!(decode(&short, 40, 24, &mut image).is_err(), "{name}");
        }
    }

    #[test]
    fn a_frame_cut_anywhere_or_of_another_size_is_refused() {
        let jpeg = encoded(64, 48, true);
        let mut image = Image::new(PixelFormat::Gray8, 0, 0);
        for length in 0..jpeg.len() {
            assert!(decode(&jpeg[..length], 64, 48, &mut image).is_err(), "cut to {length} of {}", jpeg.len());
        }
        // Bytes missing within, the end there: a transfer that lost packets.
        let scan = Headers::read(&jpeg).unwrap().scan + 14;
        let data = jpeg.len() - 2 - scan;
        for share in [2, 4, 8] {
            for start in (0..data - data / share).step_by(7) {
                let cut = [&jpeg[..scan + start], &jpeg[scan + start + data / share..]].concat();
                assert!(decode(&cut, 64, 48, &mut image).is_err(), "1/{share} missing from {start} on");
            }
        }
        let error = decode(&jpeg, 32, 48, &mut image).unwrap_err();
        assert!(!error.is_empty());
        assert!(decode(&jpeg, 128, 48, &mut image).unwrap_err().contains("agreed"));
    }

    /// Bytes of whole frames changed at random: an image of the size agreed or a reason, nothing else.
    #[test]
    fn fuzz_damaged_frames() {
        let inputs = crate::fuzz::fuzz_inputs() as usize;
        let seeds = [encoded(16, 16, true), encoded(16, 16, false), stripped(&encoded(16, 8, true)).0];
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut image = Image::new(PixelFormat::Gray8, 0, 0);
        let mut whole = 0;
        for k in 0..inputs {
            let mut bytes = seeds[k % seeds.len()].clone();
            for _ in 0..1 + random.next_u32() % 4 {
                let at = random.next_u32() as usize % bytes.len();
                match random.next_u32() % 8 {
                    0 => bytes.truncate(at.max(1)),
                    1 => {
                        bytes.remove(at);
                    }
                    2 => bytes.insert(at, random.next_u32() as u8),
                    _ => bytes[at] = random.next_u32() as u8,
                }
                if bytes.is_empty() {
                    bytes.push(0xff);
                }
            }
            if decode(&bytes, 16, 16, &mut image).is_ok() {
                whole += 1;
                assert_eq!((image.width, image.height), (16, 16));
                image.view().unwrap();
            }
        }
        assert!(whole > 0 && whole < inputs, "{whole} of {inputs}");
    }
}
