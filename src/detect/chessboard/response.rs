//! Where chessboard corners may be: peaks of the ChESS response (Bennett and Lasenby, "ChESS - Quick
//! and robust detection of chess-board features", CVIU 2014), with a ring of radius 3 in place of 5
//! so that squares of 5 pixels are resolved; larger and blurred ones are for the pyramid's coarser
//! levels.
//!
//! All arithmetic is on bytes, 16 pixels at a time, row by row: the compiler makes vector code of it.

use crate::image::pyramid::Grey;

/// Of the ring.
pub const RADIUS: usize = 3;
/// Peaks are the greatest within this many pixels.
const SUPPRESSION: usize = 2;
/// Rows of the rolling buffers: a power of two that holds a ring's and a neighbourhood's.
const ROWS: usize = 8;
const LANES: usize = 16;
/// In the square about the ring, clockwise; opposite samples are 8 apart, perpendicular ones 4.
pub const RING: [(usize, usize); 16] = [
    (3, 0),
    (4, 0),
    (5, 1),
    (6, 2),
    (6, 3),
    (6, 4),
    (5, 5),
    (4, 6),
    (3, 6),
    (2, 6),
    (1, 5),
    (0, 4),
    (0, 3),
    (0, 2),
    (1, 1),
    (2, 0),
];

type Lanes = [u8; LANES];

/// A pixel whose response is a local maximum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Peak {
    pub x: u32,
    pub y: u32,
    /// Grey levels above the threshold: about half of the contrast of an ideal corner.
    pub strength: u8,
}

/// The peaks above `threshold`, row by row, and at most `limit` of them: the strongest.
pub fn peaks(image: &Grey<'_>, threshold: u8, limit: usize) -> Vec<Peak> {
    let (width, height) = (image.width(), image.height());
    let mut peaks = Vec::new();
    if width <= 2 * RADIUS || height <= 2 * RADIUS {
        return peaks;
    }
    // A block may read and write past the row's end.
    let padded = width + 2 * LANES;
    let mut smooth = vec![0u8; ROWS * padded];
    let mut response = vec![0u8; ROWS * padded];
    let mut column = vec![0u8; width];
    let slot = |y: usize| (y % ROWS) * padded..(y % ROWS + 1) * padded;
    for y in 0..height + SUPPRESSION {
        if y < height {
            let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|y| image.row(y));
            smooth_row(rows, &mut column, &mut smooth[slot(y)][..width]);
        }
        // The ring about row y - 3 is there now.
        let Some(centre) = y.checked_sub(RADIUS).filter(|c| *c >= RADIUS) else { continue };
        let out = &mut response[slot(centre)];
        if y < height {
            let ring: [&[u8]; 2 * RADIUS + 1] = std::array::from_fn(|i| &smooth[slot(centre - RADIUS + i)]);
            respond(&ring, width, threshold, out);
        } else {
            out.fill(0);
        }
        let Some(middle) = centre.checked_sub(SUPPRESSION).filter(|m| *m >= RADIUS + SUPPRESSION) else { continue };
        let rows: [&[u8]; 2 * SUPPRESSION + 1] =
            std::array::from_fn(|i| &response[slot(middle - SUPPRESSION + i)][..width]);
        collect(&rows, middle as u32, &mut peaks);
    }
    if peaks.len() > limit {
        keep_strongest(&mut peaks, limit);
    }
    peaks
}

/// A 3 x 3 binomial filter.
fn smooth_row([above, here, below]: [&[u8]; 3], column: &mut [u8], out: &mut [u8]) {
    for (((c, a), h), b) in column.iter_mut().zip(above).zip(here).zip(below) {
        *c = mean(mean(*a, *b), *h);
    }
    let last = column.len() - 1;
    (out[0], out[last]) = (column[0], column[last]);
    let (left, right) = (&column[..last - 1], &column[2..]);
    for (((o, l), c), r) in out[1..last].iter_mut().zip(left).zip(&column[1..last]).zip(right) {
        *o = mean(mean(*l, *r), *c);
    }
}

/// Sum response minus difference response minus mean response, each as a mean of bytes, in grey levels
/// above the threshold.
fn respond(rows: &[&[u8]; 2 * RADIUS + 1], width: usize, threshold: u8, out: &mut [u8]) {
    out[..RADIUS].fill(0);
    let inner = width - 2 * RADIUS;
    for x in (0..inner).step_by(LANES) {
        let at = |(dx, dy): (usize, usize)| -> Lanes {
            let mut lanes = [0; LANES];
            lanes.copy_from_slice(&rows[dy][x + dx..x + dx + LANES]);
            lanes
        };
        let ring: [Lanes; 16] = RING.map(at);
        // Of opposite samples.
        let means: [Lanes; 8] = std::array::from_fn(|k| each(ring[k], ring[k + 8], mean));
        let differences: [Lanes; 8] = std::array::from_fn(|k| each(ring[k], ring[k + 8], u8::abs_diff));
        let sums: [Lanes; 4] = std::array::from_fn(|k| each(means[k], means[k + 4], u8::abs_diff));
        let sum = mean4(sums);
        let difference = mean8(differences);
        let around = mean4([at((3, 2)), at((2, 3)), at((4, 3)), at((3, 4))]);
        let centre = each(around, at((3, 3)), mean);
        let offset = each(centre, mean8(means), u8::abs_diff);
        let found = each(each(sum, difference, u8::saturating_sub), offset, |s, o| {
            s.saturating_sub(o).saturating_sub(o).saturating_sub(threshold)
        });
        out[x + RADIUS..x + RADIUS + LANES].copy_from_slice(&found);
    }
    out[width - RADIUS..].fill(0);
}

#[inline(always)]
fn each(a: Lanes, b: Lanes, f: impl Fn(u8, u8) -> u8) -> Lanes {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn mean4([a, b, c, d]: [Lanes; 4]) -> Lanes {
    each(each(a, b, mean), each(c, d, mean), mean)
}

#[inline(always)]
fn mean8([a, b, c, d, e, f, g, h]: [Lanes; 8]) -> Lanes {
    each(mean4([a, b, c, d]), mean4([e, f, g, h]), mean)
}

/// Rounded up.
#[inline(always)]
fn mean(a: u8, b: u8) -> u8 {
    ((a as u16 + b as u16 + 1) >> 1) as u8
}

/// Peaks of the middle row.
fn collect(rows: &[&[u8]; 2 * SUPPRESSION + 1], y: u32, peaks: &mut Vec<Peak>) {
    let middle = rows[SUPPRESSION];
    // Nearly all are zero: eight at a time.
    for (block, bytes) in middle.chunks(8).enumerate() {
        if bytes.iter().fold(0, |any, b| any | b) == 0 {
            continue;
        }
        for (i, &strength) in bytes.iter().enumerate().filter(|(_, b)| **b > 0) {
            let x = 8 * block + i;
            let columns = x.saturating_sub(SUPPRESSION)..(x + SUPPRESSION + 1).min(middle.len());
            let before = |row: &[u8], columns: std::ops::Range<usize>| row[columns].iter().all(|b| *b < strength);
            let after = |row: &[u8], columns: std::ops::Range<usize>| row[columns].iter().all(|b| *b <= strength);
            // Of equal ones the first is the peak.
            let is_peak = rows[..SUPPRESSION].iter().all(|r| before(r, columns.clone()))
                && before(middle, columns.start..x)
                && after(middle, x..columns.end)
                && rows[SUPPRESSION + 1..].iter().all(|r| after(r, columns.clone()));
            if is_peak {
                peaks.push(Peak { x: x as u32, y, strength });
            }
        }
    }
}

/// In place and in order; of the weakest that fit, the first.
fn keep_strongest(peaks: &mut Vec<Peak>, limit: usize) {
    let mut counts = [0usize; 256];
    peaks.iter().for_each(|p| counts[p.strength as usize] += 1);
    let (mut above, mut least) = (0, 255usize);
    while above + counts[least] <= limit {
        above += counts[least];
        least -= 1;
    }
    let mut spare = limit - above;
    peaks.retain(|p| match (p.strength as usize).cmp(&least) {
        std::cmp::Ordering::Greater => true,
        std::cmp::Ordering::Less => false,
        std::cmp::Ordering::Equal => {
            let kept = spare > 0;
            spare -= kept as usize;
            kept
        }
    });
}
