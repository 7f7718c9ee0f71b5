//! The pixel formats that cameras and decoders hand over.

/// Values are the C API's and never change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u32)]
#[non_exhaustive]
pub enum PixelFormat {
    Gray8 = 1,
    Rgb24 = 2,
    Bgr24 = 3,
    Rgba32 = 4,
    Bgra32 = 5,
    /// Y0 U Y1 V; the width is even.
    Yuyv = 6,
    /// Plane 0: Y; plane 1: interleaved U V at half size, rounded up.
    Nv12 = 7,
    /// Plane 0: Y; planes 1 and 2: U, V at half size, rounded up.
    I420 = 8,
}

impl PixelFormat {
    pub fn planes(self) -> usize {
        match self {
            Self::Nv12 => 2,
            Self::I420 => 3,
            _ => 1,
        }
    }

    /// Bytes that one row of a plane needs, without padding; `None` on overflow.
    pub fn row_bytes(self, plane: usize, width: u32) -> Option<usize> {
        let width = width as usize;
        match (self, plane) {
            (Self::Gray8 | Self::Nv12 | Self::I420, 0) => Some(width),
            (Self::Rgb24 | Self::Bgr24, 0) => width.checked_mul(3),
            (Self::Rgba32 | Self::Bgra32, 0) => width.checked_mul(4),
            (Self::Yuyv, 0) => width.checked_mul(2),
            (Self::Nv12, 1) => width.div_ceil(2).checked_mul(2),
            (Self::I420, 1 | 2) => Some(width.div_ceil(2)),
            _ => None,
        }
    }

    /// Rows of a plane.
    pub fn rows(self, plane: usize, height: u32) -> usize {
        if plane == 0 { height as usize } else { (height as usize).div_ceil(2) }
    }

    pub fn has_colour(self) -> bool {
        self != Self::Gray8
    }
}

impl TryFrom<u32> for PixelFormat {
    type Error = crate::error::Error;

    fn try_from(value: u32) -> Result<Self, Self::Error> {
        [Self::Gray8, Self::Rgb24, Self::Bgr24, Self::Rgba32, Self::Bgra32, Self::Yuyv, Self::Nv12, Self::I420]
            .into_iter()
            .find(|f| *f as u32 == value)
            .ok_or_else(|| crate::error::Error::invalid("format", format!("{value} is no pixel format")))
    }
}
