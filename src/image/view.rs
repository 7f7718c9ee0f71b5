//! Borrowed image views with any stride (negative too), and owned packed images.

use super::pixel_format::PixelFormat;
use crate::error::{Error, Result};

/// Largest side that is accepted: guards every product of sizes against overflow.
pub const MAX_SIDE: u32 = 1 << 16;

/// One plane of a view: rows of bytes.
#[derive(Debug, Clone, Copy)]
pub struct PlaneView<'a> {
    /// From the plane's lowest address.
    data: &'a [u8],
    /// Bytes from one row to the next; negative means that the first row is at the highest address.
    stride: isize,
    row_bytes: usize,
    rows: usize,
}

impl<'a> PlaneView<'a> {
    /// `data` begins at the plane's lowest address. Checks |stride| >= row bytes and that the last
    /// row ends inside `data`.
    pub fn new(data: &'a [u8], stride: isize, row_bytes: usize, rows: usize) -> Result<Self> {
        let step = stride.unsigned_abs();
        if step < row_bytes {
            return Err(Error::invalid("stride", format!("{stride} bytes for rows of {row_bytes}")));
        }
        let needed = step
            .checked_mul(rows.saturating_sub(1))
            .and_then(|n| n.checked_add(row_bytes))
            .ok_or_else(|| Error::invalid("stride", format!("{stride} x {rows} rows overflows")))?;
        if data.len() < needed {
            return Err(Error::BufferTooSmall { needed, capacity: data.len() });
        }
        Ok(Self { data, stride, row_bytes, rows })
    }

    /// Row `y`, 0 at the top, without padding.
    pub fn row(&self, y: usize) -> &'a [u8] {
        let index = if self.stride < 0 { self.rows - 1 - y } else { y };
        let start = index * self.stride.unsigned_abs();
        &self.data[start..start + self.row_bytes]
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The plane's memory, where its top row begins in it, and the bytes from a row to the one below.
    #[cfg(target_arch = "x86_64")]
    pub(super) fn memory(&self) -> (&'a [u8], usize, isize) {
        let first = if self.stride < 0 { (self.rows.max(1) - 1) * self.stride.unsigned_abs() } else { 0 };
        (self.data, first, self.stride)
    }
}

/// One plane to write to: rows of bytes.
#[derive(Debug)]
pub struct PlaneViewMut<'a> {
    data: &'a mut [u8],
    stride: isize,
    row_bytes: usize,
    rows: usize,
}

impl<'a> PlaneViewMut<'a> {
    /// As [`PlaneView::new`].
    pub fn new(data: &'a mut [u8], stride: isize, row_bytes: usize, rows: usize) -> Result<Self> {
        PlaneView::new(data, stride, row_bytes, rows)?;
        Ok(Self { data, stride, row_bytes, rows })
    }

    /// Row `y`, 0 at the top, without padding.
    pub fn row_mut(&mut self, y: usize) -> &mut [u8] {
        let index = if self.stride < 0 { self.rows - 1 - y } else { y };
        let start = index * self.stride.unsigned_abs();
        &mut self.data[start..start + self.row_bytes]
    }

    pub fn row_bytes(&self) -> usize {
        self.row_bytes
    }

    pub fn rows(&self) -> usize {
        self.rows
    }
}

/// A borrowed image.
#[derive(Debug, Clone, Copy)]
pub struct ImageView<'a> {
    format: PixelFormat,
    width: u32,
    height: u32,
    planes: [Option<PlaneView<'a>>; 3],
}

impl<'a> ImageView<'a> {
    /// `planes[i]` is (data from the lowest address, stride in bytes), one for each plane of the format.
    pub fn new(format: PixelFormat, width: u32, height: u32, planes: &[(&'a [u8], isize)]) -> Result<Self> {
        if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
            return Err(Error::invalid("image", format!("{width} x {height} pixels")));
        }
        if format == PixelFormat::Yuyv && !width.is_multiple_of(2) {
            return Err(Error::invalid("image", format!("YUYV with an odd width of {width}")));
        }
        if planes.len() != format.planes() {
            return Err(Error::invalid("image", format!("{} planes for {format:?}", planes.len())));
        }
        let mut views = [None; 3];
        for (i, (data, stride)) in planes.iter().enumerate() {
            let row_bytes = format
                .row_bytes(i, width)
                .ok_or_else(|| Error::invalid("image", format!("width {width} overflows")))?;
            views[i] = Some(PlaneView::new(data, *stride, row_bytes, format.rows(i, height))?);
        }
        Ok(Self { format, width, height, planes: views })
    }

    pub fn format(&self) -> PixelFormat {
        self.format
    }

    pub fn width(&self) -> u32 {
        self.width
    }

    pub fn height(&self) -> u32 {
        self.height
    }

    pub(super) fn plane(&self, plane: usize) -> Option<&PlaneView<'a>> {
        self.planes.get(plane)?.as_ref()
    }

    /// Row `y` of plane `plane`; empty for a plane that the format does not have.
    pub fn row(&self, plane: usize, y: usize) -> &'a [u8] {
        self.planes[plane].as_ref().map_or(&[], |p| p.row(y))
    }

    /// Red, green, blue of a pixel (YUV formats: full-range BT.601). The pixel is inside the image.
    pub fn rgb(&self, x: u32, y: u32) -> [u8; 3] {
        let (x, y) = (x as usize, y as usize);
        let row = self.row(0, y);
        let yuv = |luma: u8, u: u8, v: u8| {
            let (l, u, v) = (luma as f32, u as f32 - 128.0, v as f32 - 128.0);
            [l + 1.402 * v, l - 0.344_136 * u - 0.714_136 * v, l + 1.772 * u].map(|c| (c + 0.5).clamp(0.0, 255.0) as u8)
        };
        match self.format {
            PixelFormat::Gray8 => [row[x]; 3],
            PixelFormat::Rgb24 => [row[3 * x], row[3 * x + 1], row[3 * x + 2]],
            PixelFormat::Bgr24 => [row[3 * x + 2], row[3 * x + 1], row[3 * x]],
            PixelFormat::Rgba32 => [row[4 * x], row[4 * x + 1], row[4 * x + 2]],
            PixelFormat::Bgra32 => [row[4 * x + 2], row[4 * x + 1], row[4 * x]],
            PixelFormat::Yuyv => {
                let pair = 4 * (x / 2);
                yuv(row[2 * x], row[pair + 1], row[pair + 3])
            }
            PixelFormat::Nv12 => {
                let uv = self.row(1, y / 2);
                yuv(row[x], uv[2 * (x / 2)], uv[2 * (x / 2) + 1])
            }
            PixelFormat::I420 => yuv(row[x], self.row(1, y / 2)[x / 2], self.row(2, y / 2)[x / 2]),
        }
    }

    /// A packed copy.
    pub fn to_image(&self) -> Image {
        let mut image = Image { format: self.format, width: 0, height: 0, data: Vec::new() };
        self.copy_to(&mut image);
        image
    }

    /// A packed copy in place of `image`, whose memory is used again.
    pub fn copy_to(&self, image: &mut Image) {
        (image.format, image.width, image.height) = (self.format, self.width, self.height);
        image.data.clear();
        for plane in 0..self.format.planes() {
            for y in 0..self.format.rows(plane, self.height) {
                image.data.extend_from_slice(self.row(plane, y));
            }
        }
    }
}

/// An owned image: planes one after the other, rows without padding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    pub format: PixelFormat,
    pub width: u32,
    pub height: u32,
    pub data: Vec<u8>,
}

impl Image {
    /// A black (all zero bytes) image; sides above [`MAX_SIDE`] are cut to it.
    pub fn new(format: PixelFormat, width: u32, height: u32) -> Self {
        let (width, height) = (width.min(MAX_SIDE), height.min(MAX_SIDE));
        let size = (0..format.planes()).map(|p| format.row_bytes(p, width).unwrap_or(0) * format.rows(p, height)).sum();
        Self { format, width, height, data: vec![0; size] }
    }

    /// `None` when `data` does not match the format and size (it is private nowhere, so it may have
    /// been changed).
    pub fn view(&self) -> Result<ImageView<'_>> {
        let mut planes: [(&[u8], isize); 3] = [(&[], 0); 3];
        let mut rest = self.data.as_slice();
        for (p, plane) in planes.iter_mut().enumerate().take(self.format.planes()) {
            let row = self.format.row_bytes(p, self.width).unwrap_or(usize::MAX);
            let size = row.saturating_mul(self.format.rows(p, self.height));
            if rest.len() < size {
                return Err(Error::BufferTooSmall { needed: size, capacity: rest.len() });
            }
            let (head, tail) = rest.split_at(size);
            *plane = (head, row as isize);
            rest = tail;
        }
        ImageView::new(self.format, self.width, self.height, &planes[..self.format.planes()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_stride_reads_bottom_up() {
        let data = [1, 2, 0, 3, 4, 0];
        let view = ImageView::new(PixelFormat::Gray8, 2, 2, &[(&data, -3)]).unwrap();
        assert_eq!(view.row(0, 0), &[3, 4]);
        assert_eq!(view.row(0, 1), &[1, 2]);
        assert_eq!(view.to_image().data, vec![3, 4, 1, 2]);
    }

    #[test]
    fn sizes_and_strides_are_checked() {
        let data = [0u8; 12];
        let gray = PixelFormat::Gray8;
        assert!(ImageView::new(gray, 4, 3, &[(&data, 4)]).is_ok());
        assert!(matches!(ImageView::new(gray, 4, 4, &[(&data, 4)]), Err(Error::BufferTooSmall { needed: 16, .. })));
        assert!(ImageView::new(gray, 4, 3, &[(&data, 3)]).is_err());
        assert!(ImageView::new(gray, 0, 3, &[(&data, 4)]).is_err());
        assert!(ImageView::new(gray, 4, u32::MAX, &[(&data, 4)]).is_err());
        assert!(ImageView::new(gray, 4, 3, &[(&data, isize::MIN)]).is_err());
        assert!(ImageView::new(gray, 4, 3, &[(&data, 4), (&data, 4)]).is_err());
        // The last row needs no padding behind it.
        assert!(ImageView::new(gray, 2, 4, &[(&data[..11], 3)]).is_ok());
        assert!(ImageView::new(PixelFormat::Yuyv, 3, 1, &[(&data, 6)]).is_err());
    }

    #[test]
    fn colours_are_read_in_every_format() {
        let cases: [(PixelFormat, &[u8]); 5] = [
            (PixelFormat::Gray8, &[7, 9]),
            (PixelFormat::Rgb24, &[1, 2, 3, 200, 100, 50]),
            (PixelFormat::Bgr24, &[3, 2, 1, 50, 100, 200]),
            (PixelFormat::Rgba32, &[1, 2, 3, 0, 200, 100, 50, 0]),
            (PixelFormat::Bgra32, &[3, 2, 1, 0, 50, 100, 200, 0]),
        ];
        for (format, data) in cases {
            let view = ImageView::new(format, 2, 1, &[(data, data.len() as isize)]).unwrap();
            let wanted = if format == PixelFormat::Gray8 { [9; 3] } else { [200, 100, 50] };
            assert_eq!(view.rgb(1, 0), wanted, "{format:?}");
        }
        let yuyv = ImageView::new(PixelFormat::Yuyv, 2, 1, &[(&[80, 90, 81, 240], 4)]).unwrap();
        assert_eq!(yuyv.rgb(0, 0), [237, 13, 13]);
        let mut nv12 = Image::new(PixelFormat::Nv12, 3, 3);
        assert_eq!(nv12.data.len(), 9 + 8);
        nv12.data[8] = 80;
        nv12.data[15..17].copy_from_slice(&[90, 240]);
        assert_eq!(nv12.view().unwrap().rgb(2, 2), [237, 13, 13]);
        let mut i420 = Image::new(PixelFormat::I420, 3, 3);
        i420.data[8] = 80;
        i420.data[12] = 90;
        i420.data[16] = 240;
        assert_eq!(i420.view().unwrap().rgb(2, 2), [237, 13, 13]);
    }
}
