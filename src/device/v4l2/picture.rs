//! From a buffer's bytes to an image.

use super::jpeg;
use crate::image::{Image, ImageView, PixelFormat};

/// The encodings that are understood, in the order in which they are preferred.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Yuyv,
    Nv12,
    Grey,
    Mjpeg,
}

impl Encoding {
    pub const ALL: [Self; 4] = [Self::Yuyv, Self::Nv12, Self::Grey, Self::Mjpeg];

    /// V4L2's four-character code.
    pub fn fourcc(self) -> [u8; 4] {
        match self {
            Self::Yuyv => *b"YUYV",
            Self::Nv12 => *b"NV12",
            Self::Grey => *b"GREY",
            Self::Mjpeg => *b"MJPG",
        }
    }

    pub fn from_fourcc(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|e| u32::from_le_bytes(e.fourcc()) == code)
    }

    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "YUYV" => Some(Self::Yuyv),
            "NV12" => Some(Self::Nv12),
            "GREY" => Some(Self::Grey),
            "MJPG" | "MJPEG" => Some(Self::Mjpeg),
            _ => None,
        }
    }
}

/// How a frame lies in its buffer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    pub encoding: Encoding,
    pub width: u32,
    pub height: u32,
    /// Bytes from one row to the next; of no meaning for JPEG.
    pub stride: u32,
}

impl Layout {
    /// Takes a frame into `image`, whose memory is used again. The error says what is wrong with the
    /// frame.
    pub fn decode(&self, bytes: &[u8], image: &mut Image) -> Result<(), String> {
        let Self { encoding, width, height, stride } = *self;
        let row = stride as usize;
        let luma = row.saturating_mul(height as usize);
        let view = match encoding {
            Encoding::Mjpeg => return jpeg::decode(bytes, width, height, image),
            Encoding::Yuyv => ImageView::new(PixelFormat::Yuyv, width, height, &[(bytes, row as isize)]),
            Encoding::Grey => ImageView::new(PixelFormat::Gray8, width, height, &[(bytes, row as isize)]),
            Encoding::Nv12 => {
                let (y, uv) = bytes.split_at(luma.min(bytes.len()));
                ImageView::new(PixelFormat::Nv12, width, height, &[(y, row as isize), (uv, row as isize)])
            }
        };
        view.map_err(|e| format!("{} bytes: {e}", bytes.len()))?.copy_to(image);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    use super::*;

    #[test]
    fn rows_are_taken_without_their_padding() {
        let bytes: Vec<u8> = (0..60).collect();
        let mut image = Image::new(PixelFormat::Gray8, 0, 0);
        let layout = |encoding, stride| Layout { encoding, width: 4, height: 4, stride };
        layout(Encoding::Grey, 10).decode(&bytes, &mut image).unwrap();
        assert_eq!(image.data, [0, 1, 2, 3, 10, 11, 12, 13, 20, 21, 22, 23, 30, 31, 32, 33]);
        layout(Encoding::Yuyv, 10).decode(&bytes, &mut image).unwrap();
        assert_eq!((image.format, image.data.len(), image.data[8]), (PixelFormat::Yuyv, 32, 10));
        layout(Encoding::Nv12, 10).decode(&bytes, &mut image).unwrap();
        assert_eq!((image.data.len(), image.data[4], image.data[16], image.data[20]), (24, 10, 40, 50));
    }

    #[test]
    fn short_frames_are_refused() {
        let mut image = Image::new(PixelFormat::Gray8, 0, 0);
        for (encoding, needed) in [(Encoding::Grey, 34), (Encoding::Yuyv, 38), (Encoding::Nv12, 54)] {
            let layout = Layout { encoding, width: 4, height: 4, stride: 10 };
            assert!(layout.decode(&vec![0; needed], &mut image).is_ok());
            for short in 0..needed {
                assert!(layout.decode(&vec![0; short], &mut image).is_err(), "{encoding:?} {short}");
            }
        }
    }

    #[test]
    fn encodings_have_their_codes() {
        for encoding in Encoding::ALL {
            assert_eq!(Encoding::from_fourcc(u32::from_le_bytes(encoding.fourcc())), Some(encoding));
            assert_eq!(Encoding::from_name(std::str::from_utf8(&encoding.fourcc()).unwrap()), Some(encoding));
        }
        assert_eq!(Encoding::from_name("MJPEG"), Some(Encoding::Mjpeg));
        assert_eq!((Encoding::from_name("H264"), Encoding::from_fourcc(0)), (None, None));
    }

    /// Any layout that a driver may answer, with any number of bytes.
    #[test]
    fn fuzz_layouts() {
        let inputs = crate::fuzz::fuzz_inputs();
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let bytes: Vec<u8> = (0..4096).map(|_| random.next_u32() as u8).collect();
        let mut image = Image::new(PixelFormat::Gray8, 0, 0);
        for _ in 0..inputs {
            let mut side = || match random.next_u32() % 10 {
                0 => random.next_u32(),
                _ => random.next_u32() % 50,
            };
            let (width, height, stride, length) = (side(), side(), side(), side() as usize * 40 % bytes.len());
            let encoding = Encoding::ALL[random.next_u32() as usize % 4];
            if (Layout { encoding, width, height, stride }).decode(&bytes[..length], &mut image).is_ok() {
                assert_eq!((image.width, image.height), (width, height));
                image.view().unwrap();
            }
        }
    }
}
