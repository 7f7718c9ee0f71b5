//! The laser's spot in images with the laser on and off (thesis IV.E).
//!
//! The difference of the frames is taken against the exposure drift and the noise that the frames
//! themselves show; what changed beyond the noise is grouped, and each group is asked whether it is a
//! spot: small, compact, of the laser's colour, with a peak. One that is much stronger than anything
//! else that changed is the answer; all else is an error that says why.

use super::blobs::{Blob, Blobs, Candidate, Cutter, DifferenceSignal, USUAL_BLOBS, examine};
use super::single_image;
use crate::error::{Error, Result};
use crate::image::ImageView;
use crate::image::area::SearchArea;
pub use crate::image::area::{Band, Region};
use crate::image::difference::{Carrier, Changes, Pair};
use crate::image::frames::{Channel, FrameMean, channels, same_kind};
use crate::image::photometry::{Photometry, Sample};

/// Runs of changed pixels beyond which the threshold is raised: bounds memory and time.
const MAX_RUNS: usize = 1 << 15;
/// Groups that are examined closely, the brightest first.
const MAX_EXAMINED: usize = 8;
/// A spot's peak over that of anything else that changed and is no spot. A moving person's pieces are
/// seldom round and peaked, so that one that is needs to stand out less.
const DOMINANCE: f32 = 4.0;
const LASER_DOMINANCE: f32 = 1.3;
/// Fewer changed pixels than this are noise or a hot pixel, not motion.
const MIN_MOTION_AREA: u32 = 3;
/// Share of the scene that must not have changed.
const MIN_STEADY: f32 = 0.5;

/// The laser's colour: which channels carry its light. Luma alone is used of YUV formats, with their
/// chroma as a check of a known colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum LaserColour {
    /// Whichever channel differs most between on and off.
    #[default]
    Unknown = 0,
    Red = 1,
    Green = 2,
    Blue = 3,
    /// Infrared, or no colour to go by: the channel that shows it best, and no check of its colour.
    White = 4,
}

impl LaserColour {
    /// Index into red, green, blue; `None` when it has no colour that is known.
    pub(super) fn index(self) -> Option<usize> {
        match self {
            Self::Red => Some(0),
            Self::Green => Some(1),
            Self::Blue => Some(2),
            Self::Unknown | Self::White => None,
        }
    }

    /// The channels that carry its light.
    pub(super) fn carriers(self, all: &'static [Channel]) -> &'static [Channel] {
        match self.index() {
            Some(i) if all.len() == 3 => &all[i..=i],
            _ => all,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct SpotOptions {
    /// Search only here (both, when both are given).
    pub region: Option<Region>,
    pub band: Option<Band>,
    pub colour: LaserColour,
    /// Least signal-to-noise ratio of an accepted spot.
    pub min_signal_to_noise: f64,
    /// Greatest area of an accepted spot in pixels.
    pub max_area: u32,
    /// A second candidate at least this fraction as strong makes the result ambiguous.
    pub ambiguity_ratio: f64,
}

impl Default for SpotOptions {
    fn default() -> Self {
        Self {
            region: None,
            band: None,
            colour: LaserColour::Unknown,
            min_signal_to_noise: 8.0,
            max_area: 5000,
            ambiguity_ratio: 0.5,
        }
    }
}

impl SpotOptions {
    pub(crate) fn check(&self) -> Result<()> {
        let snr = self.min_signal_to_noise;
        if !(snr >= 0.0 && snr.is_finite()) {
            return Err(Error::invalid("min_signal_to_noise", format!("{snr}")));
        }
        if !(self.ambiguity_ratio > 0.0 && self.ambiguity_ratio.is_finite()) {
            return Err(Error::invalid("ambiguity_ratio", format!("{}", self.ambiguity_ratio)));
        }
        if self.max_area == 0 {
            return Err(Error::invalid("max_area", "0 pixels"));
        }
        Ok(())
    }
}

/// A spot found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Centre in pixels.
    pub x: f64,
    pub y: f64,
    /// Covariance of the centre, px^2: xx, xy, yy. From the frames' noise; larger where the spot is
    /// not the ellipse that it is fitted with.
    pub covariance: [f64; 3],
    /// Greatest difference between on and off, grey levels.
    pub peak: f64,
    /// Signal, summed with the weights of the fitted shape, over its standard deviation under the
    /// frames' noise.
    pub signal_to_noise: f64,
    /// Pixels above the threshold.
    pub area: u32,
    /// Some of its pixels are clipped.
    pub saturated: bool,
}

/// The spot in `on` (one or more frames with the laser on, averaged) against `off` (the same number
/// or any other of frames with it off; empty for a single-image search, which is weaker). All frames
/// have one size and format; at most 256 of each. For frame after frame, [`SpotDetector`] is faster.
///
/// # Errors
/// `NotFound`: nothing changed beyond the noise, or nothing that is like a spot. `Ambiguous`: several
/// spots of similar strength, or changes all about that a spot does not clearly stand out of.
/// `InvalidArgument` for frames that do not match, an area without a pixel of the image and options
/// out of range; `NotFinite` for the band.
pub fn detect_spot(on: &[ImageView<'_>], off: &[ImageView<'_>], options: &SpotOptions) -> Result<Spot> {
    SpotDetector::default().detect(on, off, options)
}

/// [`detect_spot`] with memory of its own: once it has seen frames like those to come, it allocates no
/// more for a spot that it finds. A band, a search in a single image and an error's text still do.
#[derive(Debug, Default)]
pub struct SpotDetector {
    sample: Sample,
    carriers: Vec<Carrier>,
    changes: Changes,
    blobs: Blobs,
    cutter: Cutter,
    verdict: Verdict,
}

impl SpotDetector {
    /// # Errors
    /// As [`detect_spot`].
    pub fn detect(&mut self, on: &[ImageView<'_>], off: &[ImageView<'_>], options: &SpotOptions) -> Result<Spot> {
        options.check()?;
        let on = &FrameMean::new("on", on)?;
        let first = on.first();
        let area = &SearchArea::new([first.width(), first.height()], options.region, options.band.as_ref())?;
        if off.is_empty() {
            return single_image::detect(on, area, options);
        }
        let off = &FrameMean::new("off", off)?;
        same_kind("off", 0, first, off.first())?;

        let Self { sample, carriers, changes, blobs, cutter, verdict } = self;
        carriers.clear();
        carriers.extend(options.colour.carriers(channels(first.format())).iter().map(|channel| {
            let photometry = Photometry::estimate(on, off, *channel, area, sample);
            Carrier { channel: *channel, photometry }
        }));
        let frames = Pair { on, off, carriers };
        let mut k = threshold(area.pixels());
        let mut raised = 0;
        while !changes.find(frames, area, k, MAX_RUNS) {
            // Too much to look at: only what stands out of it can be a spot.
            raised += 1;
            k *= 2.0;
            if raised > 4 {
                return Err(Error::Ambiguous { reason: "the frames differ almost everywhere".into() });
            }
        }
        blobs.find(changes);
        verdict.consider(
            &blobs.all,
            |blob, carrier| {
                if options.colour.index().is_some_and(|c| !has_colour(frames, blob, c, carrier)) {
                    return Err("it has not the laser's colour");
                }
                let mut candidate = examine(blob, carrier, &DifferenceSignal { frames, carrier }, area, cutter)?;
                let correlation = carriers[carrier].photometry.correlation as f64;
                candidate.fit.covariance.iter_mut().for_each(|c| *c *= correlation);
                candidate.fit.signal_to_noise /= correlation.sqrt();
                Ok(candidate)
            },
            carriers,
            options,
        );
        verdict.spot(&blobs.all, carriers, options, k)
    }
}

/// Standard deviations above which a quarter of a pixel is expected of `pixels` of normal noise.
fn threshold(pixels: usize) -> f32 {
    let mut k = 5.0f64;
    for _ in 0..3 {
        k = (2.0 * (4.0 * pixels as f64 / (k * 2.507)).ln().max(1.0)).sqrt();
    }
    k.max(3.5) as f32
}

/// Is the light that was added mostly of this colour? Pixels with the colour's channel clipped cannot
/// tell; when there are no others it may be.
fn has_colour(frames: Pair<'_>, blob: &Blob, colour: usize, carrier: usize) -> bool {
    let Pair { on, off, carriers } = frames;
    if !on.first().format().has_colour() {
        return true;
    }
    let mut added = [0.0f32; 3];
    let step = (blob.size() as usize).div_ceil(64);
    for y in (blob.low[1] as usize..=blob.high[1] as usize).step_by(step) {
        for x in (blob.low[0] as usize..=blob.high[0] as usize).step_by(step) {
            let (a, b) = (on.rgb(x, y), off.rgb(x, y));
            if a[colour] < 250.0 {
                (0..3).for_each(|c| added[c] += a[c] - carriers[carrier].photometry.predict(b[c]));
            }
        }
    }
    (0..3).all(|c| c == colour || added[colour] >= 1.2 * added[c])
}

/// What the changed regions say together; memory that serves one verdict after the other.
#[derive(Debug, Default)]
struct Verdict {
    /// Spots with the index of their blob: those most like a laser's first, then by strength.
    spots: Vec<(usize, Candidate)>,
    /// Regions that are no spots, with why not; `None` when there were too many to examine all.
    others: Vec<(usize, Option<&'static str>)>,
    order: Vec<usize>,
}

impl Verdict {
    fn consider(
        &mut self,
        blobs: &[Blob],
        mut examine: impl FnMut(&Blob, usize) -> std::result::Result<Candidate, &'static str>,
        carriers: &[Carrier],
        options: &SpotOptions,
    ) {
        let Self { spots, others, order } = self;
        spots.clear();
        others.clear();
        order.clear();
        others.reserve(USUAL_BLOBS);
        order.reserve(USUAL_BLOBS);
        spots.reserve(MAX_EXAMINED);
        order.extend(0..blobs.len());
        let brightness = |i: usize| blobs[i].sum.iter().fold(0.0f32, |m, s| m.max(*s));
        order.sort_unstable_by(|&i, &j| brightness(j).total_cmp(&brightness(i)).then(i.cmp(&j)));
        let mut examined = 0;
        for &i in &*order {
            let blob = &blobs[i];
            let result = if !blob.brighter {
                Err(Some("it became darker"))
            } else if blob.area > options.max_area {
                Err(Some("it is too large"))
            } else if examined >= MAX_EXAMINED {
                Err(None)
            } else {
                examined += 1;
                examine(blob, blob.carrier(carriers)).map_err(Some)
            };
            match result {
                Ok(candidate) => spots.push((i, candidate)),
                Err(reason) => others.push((i, reason)),
            }
        }
        // A piece of a moving person may hold more light than the spot, but it is seldom round and peaked.
        spots.sort_by(|(_, a), (_, b)| {
            let order = b.fit.is_laser_like().cmp(&a.fit.is_laser_like());
            order.then(b.strength.total_cmp(&a.strength))
        });
    }

    fn spot(&self, blobs: &[Blob], carriers: &[Carrier], options: &SpotOptions, k: f32) -> Result<Spot> {
        let Some((i, best)) = self.spots.iter().find(|s| s.1.fit.signal_to_noise >= options.min_signal_to_noise) else {
            return Err(Error::NotFound { reason: self.why_none(blobs, carriers, options, k) });
        };
        let blob = &blobs[*i];
        let fit = &best.fit;
        let centre = [fit.gaussian.x, fit.gaussian.y];
        // A piece of its own rim is no rival.
        let margin = 3.0 + fit.gaussian.axes()[0];
        let elsewhere = |j: &usize| j != i && !blob.is_near(blobs[*j].centre(), margin);

        let rival = self.spots.iter().find(|(j, s)| {
            elsewhere(j)
                && (s.fit.is_laser_like() || !fit.is_laser_like())
                && s.strength >= options.ambiguity_ratio * best.strength
                && s.fit.signal_to_noise >= 0.75 * options.min_signal_to_noise
        });
        if let Some((_, other)) = rival {
            let g = &other.fit.gaussian;
            let percent = 100.0 * other.strength / best.strength;
            let reason = format!(
                "two spots, at ({:.1}, {:.1}) and, {percent:.0} % as strong, at ({:.1}, {:.1})",
                centre[0], centre[1], g.x, g.y
            );
            return Err(Error::Ambiguous { reason });
        }
        let peak = blob.peak[best.carrier];
        // Single pixels flicker, which only matters when the spot is no larger.
        let least = blob.area.min(MIN_MOTION_AREA);
        let motion = || {
            let unlike = self.spots.iter().filter(|(j, s)| elsewhere(j) && !s.fit.is_laser_like()).map(|s| s.0);
            let regions = self.others.iter().map(|o| o.0).chain(unlike).map(|j| &blobs[j]);
            regions.filter(|b| b.area >= least)
        };
        let strongest = motion().max_by(|a, b| a.greatest().total_cmp(&b.greatest()));
        let dominance = if fit.is_laser_like() { LASER_DOMINANCE } else { DOMINANCE };
        if let Some(other) = strongest.filter(|b| dominance * b.greatest() > peak) {
            let [x, y] = other.centre();
            let reason = format!(
                "{} other regions of {} pixels changed, by up to {:.0} grey levels (at ({x:.0}, {y:.0})); \
                 the spot-like one at ({:.1}, {:.1}), {peak:.0} grey levels, does not clearly stand out",
                motion().count(),
                motion().map(|b| b.area as u64).sum::<u64>(),
                other.greatest(),
                centre[0],
                centre[1]
            );
            return Err(Error::Ambiguous { reason });
        }
        let steady = carriers[best.carrier].photometry.steady;
        if steady < MIN_STEADY {
            let percent = 100.0 * steady;
            let reason = format!("only {percent:.0} % of the scene is the same with the laser on and off");
            return Err(Error::Ambiguous { reason });
        }
        Ok(Spot {
            x: centre[0],
            y: centre[1],
            covariance: fit.covariance,
            peak: peak as f64,
            signal_to_noise: fit.signal_to_noise,
            area: blob.area,
            saturated: best.clipped,
        })
    }

    fn why_none(&self, blobs: &[Blob], carriers: &[Carrier], options: &SpotOptions, k: f32) -> String {
        if let Some((_, s)) = self.spots.first() {
            let (g, snr) = (&s.fit.gaussian, s.fit.signal_to_noise);
            let least = options.min_signal_to_noise;
            return format!(
                "the strongest spot, at ({:.1}, {:.1}), has a signal to noise of {snr:.1} < {least}",
                g.x, g.y
            );
        }
        let worth = |o: &&(usize, Option<&'static str>)| blobs[o.0].area >= MIN_MOTION_AREA;
        let order = |a: &&(usize, _), b: &&(usize, _)| blobs[a.0].greatest().total_cmp(&blobs[b.0].greatest());
        if let Some((i, reason)) = self.others.iter().filter(worth).max_by(order) {
            let blob = &blobs[*i];
            let [x, y] = blob.centre();
            let (area, peak) = (blob.area, blob.greatest());
            let why = reason.unwrap_or("there are too many");
            let count = self.others.iter().filter(worth).count();
            return format!(
                "{count} regions changed, none like a spot; the strongest at ({x:.0}, {y:.0}), {area} pixels, \
                 {peak:.0} grey levels: {why}"
            );
        }
        let noise = carriers.iter().map(|c| c.photometry.deviation(128.0)).fold(0.0, f32::max);
        format!("nothing changed by more than {:.1} grey levels (noise {noise:.2})", k * noise)
    }
}
