//! Where to look: a rectangle, a band about a polyline, or both.

use std::ops::Range;

use crate::error::{Error, Result};

/// A rectangle of pixels: columns [x, x + width), rows [y, y + height).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

/// A band about a polyline of pixels, such as an epipolar line.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// At least two points; distorted epipolar lines bend.
    pub polyline: Vec<[f64; 2]>,
    /// Half its width in pixels.
    pub half_width: f64,
}

/// Most points of a band's polyline: bounds the work a row.
const MAX_POINTS: usize = 4096;
/// Larger coordinates are no pixels, and their squares would overflow.
const MAX_COORDINATE: f64 = 1e9;

/// The pixels of an image inside a region and a band, as spans of rows.
#[derive(Debug, Clone)]
pub struct SearchArea {
    columns: Range<usize>,
    rows: Range<usize>,
    /// `None`: the whole rectangle.
    band: Option<Vec<Capsule>>,
}

/// All points within `radius` of a segment: convex, so a row cuts it in one interval.
#[derive(Debug, Clone, Copy)]
struct Capsule {
    from: [f64; 2],
    to: [f64; 2],
    /// From the axis to the side, `radius` long; zero for a segment of no length.
    side: [f64; 2],
    radius: f64,
}

impl SearchArea {
    /// A region that sticks out of the image is cut to it.
    ///
    /// # Errors
    /// `InvalidArgument` for a region or band without a pixel of the image, a polyline of fewer than 2
    /// or more than 4096 points, or a half width that is not positive; `NotFinite` for its coordinates.
    pub fn new(size: [u32; 2], region: Option<Region>, band: Option<&Band>) -> Result<Self> {
        let mut area = Self { columns: 0..size[0] as usize, rows: 0..size[1] as usize, band: None };
        if let Some(r) = region {
            let clip = |start: u32, length: u32, size: u32| {
                start as usize..(start as u64 + length as u64).min(size as u64) as usize
            };
            area.columns = clip(r.x, r.width, size[0]);
            area.rows = clip(r.y, r.height, size[1]);
            if area.columns.is_empty() || area.rows.is_empty() {
                let reason = format!("{r:?} has no pixel of the {} x {} image", size[0], size[1]);
                return Err(Error::invalid("region", reason));
            }
        }
        if let Some(band) = band {
            let capsules = capsules(band)?;
            let extent = |axis: usize, side: Range<usize>| {
                let ends = || capsules.iter().flat_map(move |c| [c.from[axis], c.to[axis]]);
                let low = ends().fold(f64::INFINITY, f64::min) - band.half_width;
                let high = ends().fold(f64::NEG_INFINITY, f64::max) + band.half_width;
                let start = (low.ceil().max(0.0) as usize).max(side.start);
                start..((high.floor() + 1.0).max(0.0) as usize).min(side.end).max(start)
            };
            area.columns = extent(0, area.columns);
            area.rows = extent(1, area.rows);
            area.band = Some(capsules);
            let mut spans = Vec::new();
            let hit = area.rows.clone().any(|y| {
                area.spans(y, &mut spans);
                !spans.is_empty()
            });
            if !hit {
                return Err(Error::invalid("band", "it has no pixel of the image or region"));
            }
        }
        Ok(area)
    }

    pub fn columns(&self) -> Range<usize> {
        self.columns.clone()
    }

    pub fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        if self.band.is_none() {
            return self.columns.len() * self.rows.len();
        }
        let mut spans = Vec::new();
        let mut count = |y| {
            self.spans(y, &mut spans);
            spans.iter().map(Range::len).sum::<usize>()
        };
        self.rows().map(&mut count).sum()
    }

    /// The columns of row `y` that belong to the area: ascending, disjoint, not empty.
    pub fn spans(&self, y: usize, spans: &mut Vec<Range<usize>>) {
        spans.clear();
        let Some(band) = &self.band else {
            spans.push(self.columns());
            return;
        };
        for (low, high) in band.iter().filter_map(|c| c.row(y as f64)) {
            let start = (low.ceil().max(0.0) as usize).max(self.columns.start);
            let end = ((high.floor() + 1.0).max(0.0) as usize).min(self.columns.end);
            if start < end {
                spans.push(start..end);
            }
        }
        spans.sort_unstable_by_key(|s| s.start);
        spans.dedup_by(|next, last| {
            let joined = next.start <= last.end;
            if joined {
                last.end = last.end.max(next.end);
            }
            joined
        });
    }
}

fn capsules(band: &Band) -> Result<Vec<Capsule>> {
    let n = band.polyline.len();
    if !(2..=MAX_POINTS).contains(&n) {
        return Err(Error::invalid("band", format!("a polyline of {n} points; 2 to {MAX_POINTS} are possible")));
    }
    if let Some(index) = band.polyline.iter().position(|p| !(p[0].is_finite() && p[1].is_finite())) {
        return Err(Error::NotFinite { name: "band", index });
    }
    if band.polyline.iter().flatten().any(|c| c.abs() > MAX_COORDINATE) {
        return Err(Error::invalid("band", "coordinates beyond 1e9 pixels"));
    }
    let radius = band.half_width;
    if !(radius > 0.0 && radius <= MAX_COORDINATE) {
        return Err(Error::invalid("band", format!("half width {radius}")));
    }
    Ok(band
        .polyline
        .windows(2)
        .map(|p| {
            let [dx, dy] = [p[1][0] - p[0][0], p[1][1] - p[0][1]];
            let length = dx.hypot(dy);
            let scale = if length > 0.0 { radius / length } else { 0.0 };
            Capsule { from: p[0], to: p[1], side: [-dy * scale, dx * scale], radius }
        })
        .collect())
}

impl Capsule {
    /// The interval in which the row cuts it.
    fn row(&self, y: f64) -> Option<(f64, f64)> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut add = |x: f64| (low, high) = (low.min(x), high.max(x));
        for centre in [self.from, self.to] {
            let dy = (y - centre[1]).abs();
            if dy <= self.radius {
                let half = ((self.radius - dy) * (self.radius + dy)).sqrt();
                add(centre[0] - half);
                add(centre[0] + half);
            }
        }
        for sign in [-1.0, 1.0] {
            let shifted = |p: [f64; 2]| [p[0] + sign * self.side[0], p[1] + sign * self.side[1]];
            let (a, b) = (shifted(self.from), shifted(self.to));
            if (a[1] - y) * (b[1] - y) < 0.0 {
                add(a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1])));
            }
        }
        (low <= high).then_some((low, high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
        let d = [b[0] - a[0], b[1] - a[1]];
        let square = d[0] * d[0] + d[1] * d[1];
        let t = if square > 0.0 { ((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / square } else { 0.0 };
        let t = t.clamp(0.0, 1.0);
        (p[0] - a[0] - t * d[0]).hypot(p[1] - a[1] - t * d[1])
    }

    #[test]
    fn band_spans_hold_the_pixels_near_the_polyline() {
        let lines: [Vec<[f64; 2]>; 4] = [
            vec![[-20.0, 5.3], [30.2, 31.7], [30.2, 60.0], [80.0, 10.0]],
            vec![[10.5, 20.0], [50.5, 20.0]],
            vec![[33.0, 33.0], [33.0, 33.0]],
            vec![[0.0, 0.0], [39.0, 47.0], [2.0, 3.0]],
        ];
        for polyline in lines {
            let band = Band { polyline, half_width: 3.4 };
            let region = Region { x: 4, y: 2, width: 100, height: 40 };
            let area = SearchArea::new([60, 50], Some(region), Some(&band)).unwrap();
            let (mut spans, mut count) = (Vec::new(), 0);
            for y in 0..50usize {
                if area.rows().contains(&y) {
                    area.spans(y, &mut spans);
                } else {
                    spans.clear();
                }
                for x in 0..60usize {
                    let p = [x as f64, y as f64];
                    let near = band.polyline.windows(2).any(|s| distance(p, s[0], s[1]) <= 3.4);
                    let wanted = near && x >= 4 && (2..42).contains(&y);
                    assert_eq!(spans.iter().any(|s| s.contains(&x)), wanted, "{x} {y}");
                    count += wanted as usize;
                }
            }
            assert_eq!(area.pixels(), count);
        }
    }

    #[test]
    fn senseless_areas_are_refused() {
        let size = [64, 48];
        let region = |x, y, width, height| SearchArea::new(size, Some(Region { x, y, width, height }), None);
        assert!(region(63, 47, u32::MAX, u32::MAX).is_ok_and(|a| a.pixels() == 1));
        for (x, y, width, height) in [(64, 0, 1, 1), (0, 48, 1, 1), (u32::MAX, 0, u32::MAX, 1), (0, 0, 0, 5)] {
            assert!(matches!(region(x, y, width, height), Err(Error::InvalidArgument { name: "region", .. })));
        }
        let band = |polyline: &[[f64; 2]], half_width| {
            SearchArea::new(size, None, Some(&Band { polyline: polyline.to_vec(), half_width }))
        };
        assert!(matches!(band(&[[0.0, 0.0], [f64::NAN, 1.0]], 2.0), Err(Error::NotFinite { name: "band", index: 1 })));
        for (line, half_width) in [
            (vec![[0.0, 0.0]], 2.0),
            (vec![[0.0, 0.0]; 5000], 2.0),
            (vec![[0.0, 0.0], [1e300, 0.0]], 2.0),
            (vec![[0.0, 0.0], [9.0, 0.0]], f64::NAN),
            (vec![[0.0, 0.0], [9.0, 0.0]], -1.0),
            (vec![[0.0, 0.0], [9.0, 0.0]], f64::INFINITY),
            (vec![[0.0, -9.0], [9.0, -9.0]], 2.0),
            (vec![[5.5, 5.5], [5.5, 5.5]], 0.1),
        ] {
            assert!(matches!(band(&line, half_width), Err(Error::InvalidArgument { name: "band", .. })), "{line:?}");
        }
    }
}
