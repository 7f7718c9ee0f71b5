//! Where chessboard corners may be: peaks of the ChESS response (Bennett and Lasenby, "ChESS - Quick
//! and robust detection of chess-board features", CVIU 2014), with a ring of radius 3 in place of 5
//! so that squares of 5 pixels are resolved; larger and blurred ones are for the pyramid's coarser
//! levels.
//!
//! All arithmetic is on bytes, row by row, compiled for the processor at hand: see
//! [`crate::vectors`].
#![allow(unsafe_code)]

use crate::image::pyramid::Grey;
use crate::vectors::for_each_processor;

/// Of the ring.
pub const RADIUS: usize = 3;
/// Peaks are the greatest within this many pixels.
const SUPPRESSION: usize = 2;
/// Rows of the rolling buffers: a power of two that holds a ring's and a neighbourhood's.
const ROWS: usize = 8;
/// Pixels that are worked on together.
const LANES: usize = 64;
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

/// Pixels that are looked at together for one that responds.
const BLOCK: usize = 32;

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
        let rows: [&[u8]; 2 * SUPPRESSION + 1] = std::array::from_fn(|i| &response[slot(middle - SUPPRESSION + i)]);
        collect(&rows, middle as u32, &mut peaks);
    }
    if peaks.len() > limit {
        keep_strongest(&mut peaks, limit);
    }
    peaks
}

for_each_processor! {
    /// A 3 x 3 binomial filter.
    fn smooth_row(rows: [&[u8]; 3], column: &mut [u8], out: &mut [u8]) {
        let n = column.len();
        let [above, here, below] = rows.map(|r| &r[..n]);
        for x in 0..n {
            column[x] = mean(mean(above[x], below[x]), here[x]);
        }
        (out[0], out[n - 1]) = (column[0], column[n - 1]);
        let (left, middle, right) = (&column[..n - 2], &column[1..n - 1], &column[2..]);
        let out = &mut out[1..n - 1];
        for x in 0..n - 2 {
            out[x] = mean(mean(left[x], right[x]), middle[x]);
        }
    }

    /// Sum response minus difference response minus mean response, each as a mean of bytes, in grey levels
    /// above the threshold. Writes zeros up to the end of `out`.
    fn respond(rows: &[&[u8]; 2 * RADIUS + 1], width: usize, threshold: u8, out: &mut [u8]) {
        out[..RADIUS].fill(0);
        let inner = width - 2 * RADIUS;
        for x in (0..inner).step_by(LANES) {
            let mut means = [[0; LANES]; 8];
            let mut differences = [[0; LANES]; 8];
            for k in 0..8 {
                let (a, b) = (lanes(rows, x, RING[k]), lanes(rows, x, RING[k + 8]));
                for l in 0..LANES {
                    // Of opposite samples.
                    means[k][l] = mean(a[l], b[l]);
                    differences[k][l] = a[l].abs_diff(b[l]);
                }
            }
            let [above, left, right, below, middle] = [(3, 2), (2, 3), (4, 3), (3, 4), (3, 3)].map(|p| lanes(rows, x, p));
            let found = &mut out[x + RADIUS..x + RADIUS + LANES];
            for l in 0..LANES {
                let m = [means[0][l], means[1][l], means[2][l], means[3][l]];
                let n = [means[4][l], means[5][l], means[6][l], means[7][l]];
                let d = [differences[0][l], differences[1][l], differences[2][l], differences[3][l]];
                let e = [differences[4][l], differences[5][l], differences[6][l], differences[7][l]];
                let sum = mean4([
                    m[0].abs_diff(n[0]),
                    m[1].abs_diff(n[1]),
                    m[2].abs_diff(n[2]),
                    m[3].abs_diff(n[3]),
                ]);
                let difference = mean(mean4(d), mean4(e));
                let centre = mean(mean4([above[l], left[l], right[l], below[l]]), middle[l]);
                let offset = centre.abs_diff(mean(mean4(m), mean4(n)));
                let above = sum.saturating_sub(difference).saturating_sub(offset).saturating_sub(offset);
                found[l] = above.saturating_sub(threshold);
            }
        }
        out[width - RADIUS..].fill(0);
    }

}

/// The pixels about x of one sample of the ring.
#[inline(always)]
fn lanes<'a>(rows: &[&'a [u8]; 2 * RADIUS + 1], x: usize, (dx, dy): (usize, usize)) -> &'a Lanes {
    rows[dy][x + dx..].first_chunk().unwrap_or(&[0; LANES])
}

#[inline(always)]
fn mean4([a, b, c, d]: [u8; 4]) -> u8 {
    mean(mean(a, b), mean(c, d))
}

/// Rounded up.
#[inline(always)]
fn mean(a: u8, b: u8) -> u8 {
    ((a as u16 + b as u16 + 1) >> 1) as u8
}

/// Peaks of the middle row.
fn collect(rows: &[&[u8]; 2 * SUPPRESSION + 1], y: u32, peaks: &mut Vec<Peak>) {
    let middle = rows[SUPPRESSION];
    // Nearly all are zero, as all beyond the image's width are.
    for (block, bytes) in middle.as_chunks::<BLOCK>().0.iter().enumerate() {
        if bytes.iter().fold(0, |any, b| any | b) == 0 {
            continue;
        }
        for (i, &strength) in bytes.iter().enumerate().filter(|(_, b)| **b > 0) {
            let x = BLOCK * block + i;
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
