//! The laser's spot in an image without one to compare: a small bright peak that stands out of its
//! surroundings on all sides, burnt out to white in its core, with a rim of the laser's colour.
//!
//! Much else is small and bright, so this is strict: what it cannot tell apart is ambiguous.

use std::ops::Range;

use super::blobs::{Blob, Blobs, Cutter, Signal, clip_level, examine};
use super::gaussian_fit::{Fit, Pixel};
use super::spot::{LaserColour, Spot, SpotOptions};
use crate::error::{Error, Result};
use crate::image::area::{Region, SearchArea};
use crate::image::components::{Components, Run};
use crate::image::difference::{BRIGHTER, Changes, RunSignal};
use crate::image::frames::{Channel, FrameMean, RowBuffer, channels};

/// Distances at which the surroundings are looked at, the farthest first: a spot is smaller.
const RADII: [usize; 4] = [40, 20, 10, 5];
/// Least height of a seed over all of its surroundings, grey levels and standard deviations.
const MIN_CONTRAST: f32 = 30.0;
const MIN_CONTRAST_NOISE: f32 = 8.0;
/// Least redness (greenness, ...) that light added to the rim, grey levels.
const MIN_TINT: f32 = 15.0;
/// All channels of a burnt-out core are at least this.
const BURNT_OUT: f32 = 225.0;
/// A spot without a burnt-out core must be this high to be believed.
const MIN_PEAK: f32 = 64.0;
/// By how much more a spot must stand out of its surroundings than out of an off frame's noise.
const SIGNAL_TO_NOISE: f64 = 4.0;
/// Seeds beyond which the image has too many bright specks.
const MAX_RUNS: usize = 1 << 14;
/// Share of its height down to which a peak is one region.
const FOOT: f32 = 0.3;

/// The brightest pixel of a speck, and by how much it exceeds all that is about it.
#[derive(Debug, Clone, Copy, Default)]
struct Seed {
    place: [usize; 2],
    level: u8,
    contrast: u8,
}

struct Candidate {
    spot: Spot,
    fit: Fit,
    strength: f64,
    /// Has it a burnt-out core (or is there no colour to see that by)?
    burnt_out: bool,
}

pub fn detect(on: &FrameMean<'_>, area: &SearchArea, options: &SpotOptions) -> Result<Spot> {
    let all = channels(on.first().format());
    let has_colour = on.first().format().has_colour();
    // The colours that the laser may have; None where colour does not count.
    let colours: Vec<Option<usize>> = match options.colour {
        LaserColour::Unknown if has_colour => (0..3).map(Some).collect(),
        colour => vec![colour.index().filter(|_| has_colour)],
    };
    let mut found: Vec<Candidate> = Vec::new();
    let mut specks: Vec<Seed> = Vec::new();
    for colour in colours {
        let carrier = match (all, colour) {
            ([_, green, _], None) => *green,
            ([_, _, _], Some(c)) => all[c],
            _ => all[0],
        };
        let seeds = search(on, area, carrier, colour, options, &mut found)?;
        // Only colour tells a spot from other bright specks.
        if colour.is_none() {
            specks.extend(seeds);
        }
    }
    verdict(&found, &specks, options)
}

fn verdict(found: &[Candidate], specks: &[Seed], options: &SpotOptions) -> Result<Spot> {
    let mut order: Vec<&Candidate> = found.iter().collect();
    order.sort_by(|a, b| b.burnt_out.cmp(&a.burnt_out).then(b.strength.total_cmp(&a.strength)));
    let Some(best) = order.first() else {
        let reason = "no bright peak of the laser's colour stands out of its surroundings in the single image";
        return Err(Error::NotFound { reason: reason.into() });
    };
    let place = |c: &Candidate| format!("({:.1}, {:.1})", c.spot.x, c.spot.y);
    // A burnt-out core tells the spot from its own reflections, which are fainter.
    let rival = order[1..]
        .iter()
        .find(|c| c.burnt_out == best.burnt_out && c.strength >= 0.5 * options.ambiguity_ratio * best.strength);
    if let Some(rival) = rival {
        let reason = format!("two spots in the single image, at {} and {}", place(best), place(rival));
        return Err(Error::Ambiguous { reason });
    }
    let is_rival = |s: &&Seed| {
        let [x, y] = s.place.map(|c| c as f64);
        s.contrast as f64 >= 0.5 * options.ambiguity_ratio * best.spot.peak
            && (x - best.spot.x).hypot(y - best.spot.y) > 3.0 + 4.0 * best.fit.gaussian.axes()[0]
    };
    if let Some(speck) = specks.iter().find(is_rival) {
        let [x, y] = speck.place;
        let reason = format!("without a colour, the spot at {} is not told from the speck at ({x}, {y})", place(best));
        return Err(Error::Ambiguous { reason });
    }
    if !best.burnt_out && (best.spot.peak < MIN_PEAK as f64 || !best.fit.is_laser_like()) {
        let reason = format!("the spot at {} is too faint or ill-shaped to be told from a reflection", place(best));
        return Err(Error::Ambiguous { reason });
    }
    Ok(best.spot)
}

/// Adds the spots of one colour; returns all bright specks.
fn search(
    on: &FrameMean<'_>,
    area: &SearchArea,
    carrier: Channel,
    colour: Option<usize>,
    options: &SpotOptions,
    found: &mut Vec<Candidate>,
) -> Result<Vec<Seed>> {
    let plane = Plane::new(on, area, carrier);
    let contrast = (MIN_CONTRAST_NOISE * plane.noise()).clamp(MIN_CONTRAST, 200.0) as u8;
    let first = found.len();
    let mut all = Vec::new();
    for radius in RADII {
        let Some(seeds) = plane.seeds(area, radius, contrast) else {
            let reason = "the single image has too many bright specks to tell a spot from them";
            return Err(Error::Ambiguous { reason: reason.into() });
        };
        for Seed { place: [x, y], .. } in seeds.iter().copied() {
            // Already found with surroundings farther away?
            let known = |c: &Candidate| (c.spot.x - x as f64).hypot(c.spot.y - y as f64) < radius.max(10) as f64;
            if found[first..].iter().any(known) {
                continue;
            }
            if let Some(candidate) = inspect(on, area, carrier, colour, options, [x, y], radius)
                && !found.iter().any(|c| (c.spot.x - candidate.spot.x).hypot(c.spot.y - candidate.spot.y) < 5.0)
            {
                found.push(candidate);
            }
        }
        all.extend(seeds);
    }
    Ok(all)
}

/// One channel of the search rectangle.
struct Plane {
    columns: Range<usize>,
    rows: Range<usize>,
    data: Vec<u8>,
}

impl Plane {
    fn new(on: &FrameMean<'_>, area: &SearchArea, channel: Channel) -> Self {
        let (columns, rows) = (area.columns(), area.rows());
        let mut data = Vec::with_capacity(columns.len() * rows.len());
        let mut buffer = RowBuffer::default();
        let bytes = columns.start * channel.step..columns.end * channel.step;
        for y in rows.clone() {
            let row = on.bytes(y, bytes.clone(), &mut buffer);
            data.extend(row[channel.offset..].iter().step_by(channel.step));
        }
        Self { columns, rows, data }
    }

    fn row(&self, y: usize) -> &[u8] {
        let width = self.columns.len();
        &self.data[y * width..(y + 1) * width]
    }

    /// Standard deviation of a pixel: robust, from neighbours.
    fn noise(&self) -> f32 {
        let mut histogram = [0u32; 256];
        for y in (0..self.rows.len()).step_by(8) {
            let row = self.row(y);
            row.iter().zip(row.iter().skip(1)).for_each(|(a, b)| histogram[a.abs_diff(*b) as usize] += 1);
        }
        let total: u32 = histogram.iter().sum();
        let mut below = 0;
        let middle = histogram.iter().position(|n| {
            below += n;
            2 * below >= total
        });
        1.4826 * (middle.unwrap_or(0) as f32 + 0.5) / std::f32::consts::SQRT_2
    }

    /// The brightest pixels of the groups that exceed all pixels `radius` away, in eight directions, by
    /// `contrast`; `None` when there are too many.
    fn seeds(&self, area: &SearchArea, radius: usize, contrast: u8) -> Option<Vec<Seed>> {
        let (width, height) = (self.columns.len(), self.rows.len());
        let r = radius as isize;
        let diagonal = (radius as f64 * std::f64::consts::FRAC_1_SQRT_2).round() as isize;
        let around = [
            [r, 0],
            [-r, 0],
            [0, r],
            [0, -r],
            [diagonal, diagonal],
            [diagonal, -diagonal],
            [-diagonal, diagonal],
            [-diagonal, -diagonal],
        ];
        let mut brightest = vec![0u8; width];
        let mut runs: Vec<Run> = Vec::new();
        let mut tops: Vec<Seed> = Vec::new();
        let mut spans = Vec::new();
        for y in 0..height {
            brightest.fill(0);
            for [dx, dy] in around {
                let Some(other) = y.checked_add_signed(dy).filter(|y| *y < height) else { continue };
                // Where x + dx is inside; beyond the border nothing is brighter.
                let start = (-dx).max(0) as usize;
                let end = (width as isize - dx).clamp(0, width as isize) as usize;
                if start < end {
                    let shifted = &self.row(other)[(start as isize + dx) as usize..];
                    brightest[start..end].iter_mut().zip(shifted).for_each(|(b, v)| *b = (*b).max(*v));
                }
            }
            let row = self.row(y);
            // Most rows have none.
            if !row.iter().zip(&brightest).fold(false, |any, (v, b)| any | (v.saturating_sub(*b) >= contrast)) {
                continue;
            }
            area.spans(y + self.rows.start, &mut spans);
            for x in spans.iter().flat_map(|s| s.clone()).map(|x| x - self.columns.start) {
                let height = row[x].saturating_sub(brightest[x]);
                if height < contrast {
                    continue;
                }
                let (at, y, x) = (x, y as u32, x as u32);
                match runs.last_mut() {
                    Some(run) if run.row == y && run.end == x => run.end += 1,
                    _ => {
                        runs.push(Run { row: y, start: x, end: x + 1, class: BRIGHTER });
                        tops.push(Seed::default());
                    }
                }
                if let Some(top) = tops.last_mut().filter(|t| t.level < row[at]) {
                    let place = [x as usize + self.columns.start, y as usize + self.rows.start];
                    *top = Seed { place, level: row[at], contrast: height };
                }
            }
            if runs.len() > MAX_RUNS {
                return None;
            }
        }
        let mut components = Components::default();
        let (labels, count) = components.label(&runs);
        let mut seeds = vec![Seed::default(); count];
        for (top, label) in tops.into_iter().zip(labels) {
            let seed = &mut seeds[*label as usize];
            if top.level > seed.level {
                *seed = top;
            }
        }
        Some(seeds)
    }
}

/// A channel's height over its surroundings.
struct LocalSignal<'a> {
    on: &'a FrameMean<'a>,
    channel: Channel,
    background: f32,
    deviation: f32,
}

impl Signal for LocalSignal<'_> {
    fn read(&self, x: usize, y: usize, row: &mut [Pixel]) {
        let clip = clip_level(self.on.first().format());
        for (x, pixel) in (x..).zip(row) {
            let mut brightest = [0];
            self.on.brightest(self.channel, x, y, &mut brightest);
            let signal = self.on.at(self.channel, x, y) - self.background;
            let variance = self.deviation * self.deviation;
            *pixel = Pixel { signal, variance, clipped: brightest[0] >= clip };
        }
    }

    fn signal_variance(&self) -> f32 {
        0.0
    }
}

/// Is there a spot at the seed?
fn inspect(
    on: &FrameMean<'_>,
    area: &SearchArea,
    carrier: Channel,
    colour: Option<usize>,
    options: &SpotOptions,
    seed: [usize; 2],
    radius: usize,
) -> Option<Candidate> {
    let side = |centre: usize, limit: Range<usize>| {
        centre.saturating_sub(radius).max(limit.start)..(centre + radius + 1).min(limit.end)
    };
    let (columns, rows) = (side(seed[0], area.columns()), side(seed[1], area.rows()));
    let (mut channel, mut burnt_out) = (carrier, true);
    if let Some(colour) = colour {
        burnt_out = tint(on, &columns, &rows, seed, radius, colour)?;
        let all = channels(on.first().format());
        if burnt_out && all.len() == 3 {
            // The laser's own channel is clipped far and wide; one that hardly sees it shows the core.
            channel = all[if colour == 1 { 0 } else { 1 }];
        }
    }
    let (background, deviation) = surroundings(on, channel, &columns, &rows, seed, radius);
    let signal = LocalSignal { on, channel, background, deviation };
    let blob = region(&signal, &columns, &rows, seed)?;
    if blob.area > options.max_area || blob.size() as usize > radius {
        return None;
    }
    let window = Region {
        x: columns.start as u32,
        y: rows.start as u32,
        width: columns.len() as u32,
        height: rows.len() as u32,
    };
    let size = [on.first().width(), on.first().height()];
    let window = SearchArea::new(size, Some(window), None).ok()?;
    let found = examine(&blob, 0, &signal, &window, &mut Cutter::default()).ok()?;
    let fit = found.fit;
    if fit.signal_to_noise < SIGNAL_TO_NOISE * options.min_signal_to_noise {
        return None;
    }
    burnt_out &= fit.is_laser_like();
    let spot = Spot {
        x: fit.gaussian.x,
        y: fit.gaussian.y,
        covariance: fit.covariance,
        peak: blob.peak[0] as f64,
        signal_to_noise: fit.signal_to_noise,
        area: blob.area,
        saturated: found.clipped,
    };
    Some(Candidate { spot, fit, strength: found.strength, burnt_out })
}

/// Pixels at 0.7 to 1 radius from the seed.
fn ring<'r>(
    columns: &'r Range<usize>,
    rows: &'r Range<usize>,
    seed: [usize; 2],
    radius: usize,
) -> impl Iterator<Item = [usize; 2]> + 'r {
    let outer = radius * radius;
    rows.clone().flat_map(move |y| columns.clone().map(move |x| [x, y])).filter(move |[x, y]| {
        let (dx, dy) = (x.abs_diff(seed[0]), y.abs_diff(seed[1]));
        (outer / 2..=outer).contains(&(dx * dx + dy * dy))
    })
}

/// Median and robust standard deviation of the ring about the seed, texture and all.
fn surroundings(
    on: &FrameMean<'_>,
    channel: Channel,
    columns: &Range<usize>,
    rows: &Range<usize>,
    seed: [usize; 2],
    radius: usize,
) -> (f32, f32) {
    let mut values: Vec<f32> = ring(columns, rows, seed, radius).map(|[x, y]| on.at(channel, x, y)).collect();
    let middle = median(&mut values);
    values.iter_mut().for_each(|v| *v = (*v - middle).abs());
    (middle, (1.4826 * median(&mut values)).max(0.5))
}

fn median(values: &mut [f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Looks for the laser's colour about the seed: `None` without a tinted rim on at least three sides;
/// else whether the core is burnt out. Light only adds: a red dye, which takes green and blue away,
/// is no rim.
fn tint(
    on: &FrameMean<'_>,
    columns: &Range<usize>,
    rows: &Range<usize>,
    seed: [usize; 2],
    radius: usize,
    colour: usize,
) -> Option<bool> {
    let [mut red, mut green, mut blue] = [const { Vec::new() }; 3];
    for [x, y] in ring(columns, rows, seed, radius) {
        let [r, g, b] = on.rgb(x, y);
        red.push(r);
        green.push(g);
        blue.push(b);
    }
    let background = [median(&mut red), median(&mut green), median(&mut blue)];
    let excess = |rgb: [f32; 3]| {
        let others = (0..3).filter(|c| *c != colour).fold(0.0f32, |m, c| m.max(rgb[c]));
        rgb[colour] - others
    };
    let plain = excess(background);
    let (mut sides, mut tinted, mut other, mut core) = ([0u32; 4], 0u32, 0u32, 0u32);
    for (x, y) in rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y))) {
        let (dx, dy) = (x as i64 - seed[0] as i64, y as i64 - seed[1] as i64);
        if 4 * (dx * dx + dy * dy) > (radius * radius) as i64 {
            continue;
        }
        let rgb = on.rgb(x, y);
        if rgb.iter().all(|v| *v >= BURNT_OUT) {
            core += 1;
            continue;
        }
        // Redder than what is about it, and red.
        let tint = (excess(rgb) - plain).min(4.0 * excess(rgb));
        let added = rgb[colour] - background[colour];
        if tint < MIN_TINT || added < 0.8 * tint {
            // Dyed, or lit by something else.
            other += (tint >= MIN_TINT || (0..3).any(|c| rgb[c] - background[c] >= 2.0 * MIN_TINT)) as u32;
        } else {
            tinted += 1;
            sides[if dx.abs() >= dy.abs() { (dx > 0) as usize } else { 2 + (dy > 0) as usize }] += 1;
        }
    }
    let surrounded = sides.iter().filter(|n| 10 * **n >= tinted).count() >= 3;
    (tinted >= 6 && 2 * tinted >= 3 * other && surrounded)
        .then_some(core >= 3 && background.iter().any(|b| *b < BURNT_OUT))
}

/// The connected pixels about the seed that are higher than a share of it.
fn region(signal: &LocalSignal<'_>, columns: &Range<usize>, rows: &Range<usize>, seed: [usize; 2]) -> Option<Blob> {
    let mut pixels = vec![Pixel::default(); columns.len()];
    let mut peak = 0.0f32;
    for y in seed[1].saturating_sub(2).max(rows.start)..(seed[1] + 3).min(rows.end) {
        signal.read(columns.start, y, &mut pixels);
        let near = seed[0].saturating_sub(2).max(columns.start)..(seed[0] + 3).min(columns.end);
        peak = near.map(|x| pixels[x - columns.start].signal).fold(peak, f32::max);
    }
    let foot = (FOOT * peak).max(4.0 * signal.deviation);
    let mut changes = Changes::default();
    for y in rows.clone() {
        signal.read(columns.start, y, &mut pixels);
        for (x, value) in columns.clone().zip(pixels.iter().map(|p| p.signal)).filter(|(_, v)| *v > foot) {
            let (row, column) = (y as u32, x as u32);
            match changes.runs.last_mut() {
                Some(run) if run.row == row && run.end == column => run.end += 1,
                _ => {
                    changes.runs.push(Run { row, start: column, end: column + 1, class: BRIGHTER });
                    changes.signals.push(RunSignal::default());
                }
            }
            if let Some(signal) = changes.signals.last_mut() {
                signal.sum[0] += value;
                signal.peak[0] = signal.peak[0].max(value);
            }
        }
    }
    let centre = [seed[0] as f64, seed[1] as f64];
    let mut blobs = Blobs::default();
    blobs.find(&changes);
    blobs.all.into_iter().filter(|b| b.is_near(centre, 2.0)).max_by(|a, b| a.peak[0].total_cmp(&b.peak[0]))
}
