//! Pixels of an ideal picture out of the source image: bilinear interpolation, in integers, so that
//! every processor gives the same bytes.

use super::map::{Cell, Content, CubicRow, FRACTION_BITS, LARGEST};
use crate::image::area::Region;
use crate::image::view::{PlaneView, PlaneViewMut};

const ONE: i32 = 1 << FRACTION_BITS;
/// Added before a position in a row is cut to seven bits.
pub const HALF_STEP: i32 = 1 << (FRACTION_BITS - 8);

/// The source image, of `N` bytes a pixel.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a, const N: usize> {
    plane: &'a PlaneView<'a>,
    width: i32,
    height: i32,
    border: [u8; N],
}

impl<'a, const N: usize> Source<'a, N> {
    /// `plane` has `height` rows of `width` pixels, at most 65536 each.
    pub fn new(plane: &'a PlaneView<'a>, width: u32, height: u32, border: [u8; N]) -> Self {
        Self { plane, width: width as i32, height: height as i32, border }
    }

    #[cfg(target_arch = "x86_64")]
    pub fn plane(&self) -> &'a PlaneView<'a> {
        self.plane
    }

    #[cfg(target_arch = "x86_64")]
    pub fn size(&self) -> [i32; 2] {
        [self.width, self.height]
    }

    #[cfg(target_arch = "x86_64")]
    pub fn border(&self) -> [u8; N] {
        self.border
    }

    /// The pixel, or the border's outside the image.
    fn pixel(&self, x: i32, y: i32) -> [u8; N] {
        if x < 0 || y < 0 || x >= self.width || y >= self.height {
            return self.border;
        }
        let start = x as usize * N;
        self.plane.row(y as usize).get(start..start + N).and_then(|p| p.try_into().ok()).unwrap_or(self.border)
    }

    /// The image between its pixels, at a position in units of 2^-14 pixels. In a row the position is
    /// rounded to 2^-7 pixels, so that products with samples fit 16 bits.
    pub fn sample(&self, [x, y]: [i32; 2]) -> [u8; N] {
        let x = x.saturating_add(HALF_STEP);
        let [fx, fy] = [(x & (ONE - 1)) >> (FRACTION_BITS - 7), (y & (ONE - 1)) << (15 - FRACTION_BITS)];
        let [x, y] = [x >> FRACTION_BITS, y >> FRACTION_BITS];
        let (a, b) = (self.pixel(x, y), self.pixel(x + 1, y));
        let (c, d) = (self.pixel(x, y + 1), self.pixel(x + 1, y + 1));
        std::array::from_fn(|i| {
            let between = |a: u8, b: u8| (128 - fx) * i32::from(a) + fx * i32::from(b);
            let (above, below) = (between(a[i], b[i]), between(c[i], d[i]));
            let value = above + (((below - above) * fy + (1 << 14)) >> 15);
            ((value + 64) >> 7) as u8
        })
    }
}

/// A row of a cubic cell from its pixel `first` on, pixel by pixel.
pub fn cubic_row<const N: usize>(source: &Source<N>, row: &CubicRow, first: usize, out: &mut [u8]) {
    for (x, pixel) in out.as_chunks_mut::<N>().0.iter_mut().enumerate() {
        *pixel = source.sample(row.position(first + x));
    }
}

/// Draws rows of cubic cells, by the widest vectors of the processor.
struct Rows<'a, const N: usize> {
    source: &'a Source<'a, N>,
    #[cfg(target_arch = "x86_64")]
    wide: Option<super::avx2::Wide<'a, N>>,
}

impl<'a, const N: usize> Rows<'a, N> {
    fn new(source: &'a Source<'a, N>, vectors: bool) -> Self {
        #[cfg(not(target_arch = "x86_64"))]
        let _ = vectors;
        Self {
            source,
            #[cfg(target_arch = "x86_64")]
            wide: vectors.then(|| super::avx2::Wide::new(source)).flatten(),
        }
    }

    fn cubic(&self, row: &CubicRow, first: usize, out: &mut [u8]) {
        #[cfg(target_arch = "x86_64")]
        if let Some(wide) = &self.wide {
            return wide.cubic_row(row, first, out);
        }
        cubic_row(self.source, row, first, out);
    }
}

/// Draws the region of the ideal picture that these bands cover, with `vectors` where the processor
/// has them. `out` has the region's size.
pub fn draw<const N: usize>(
    bands: &[Vec<Cell>],
    source: &Source<N>,
    region: &Region,
    vectors: bool,
    out: &mut PlaneViewMut,
) {
    let draw = Rows::new(source, vectors);
    let end = region.x + region.width;
    // Whole rows, one after the other: the processor fetches ahead of them.
    for y in region.y..region.y + region.height {
        let out = out.row_mut((y - region.y) as usize);
        for cell in bands.get((y / LARGEST) as usize).into_iter().flatten() {
            let columns = cell.x.max(region.x)..(cell.x + cell.size).min(end);
            if columns.is_empty() || !(cell.y..cell.y + cell.size).contains(&y) {
                continue;
            }
            let first = (columns.start - cell.x) as usize;
            let out = &mut out[(columns.start - region.x) as usize * N..(columns.end - region.x) as usize * N];
            match &cell.content {
                Content::Outside => out.as_chunks_mut::<N>().0.fill(source.border),
                Content::Cubic(cubic) => draw.cubic(&cubic.row(y - cell.y, cell.size), first, out),
                Content::Exact(positions) => {
                    let from = ((y - cell.y) * cell.size) as usize + first;
                    let pixels = out.as_chunks_mut::<N>().0;
                    for (pixel, position) in pixels.iter_mut().zip(positions.iter().skip(from)) {
                        *pixel = source.sample(*position);
                    }
                }
            }
        }
    }
}
