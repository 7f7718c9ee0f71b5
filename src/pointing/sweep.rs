//! A pixel whose depth is unknown: where the head would have to look along the pixel's ray, a zoom that
//! shows all of it, or the steps that sweep it.

use nalgebra::{Matrix2, Vector3};

use super::chain::{LinearRay, Noise, in_station};
use super::{AimOptions, Click, Lens, Pointer, extent, zoom};
use crate::error::{Error, Result};

/// Samples of the ray at first, evenly spread in inverse distance, and at most.
const FIRST_SAMPLES: usize = 17;
const MAX_SAMPLES: usize = 257;
/// Two neighbouring samples are no further apart than this part of the picture's smaller side.
const FINEST: f64 = 0.05;
/// What is farther than this is as far as anyone can tell, metres.
const FARTHEST: f64 = 1e6;
/// Standard deviations that are as good as certain.
const CERTAIN: f64 = 6.0;

/// The head's readings for one distance along the ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepPoint {
    /// From the fixed camera's centre, metres.
    pub distance: f64,
    /// Radians.
    pub pan: f64,
    pub tilt: f64,
    /// Of the target's direction about them, rad^2.
    pub angles: Matrix2<f64>,
}

/// Where the target of a pixel may be, its depth unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Nearest first, the widest picture's smaller side sampled twenty times or finer.
    pub curve: Vec<SweepPoint>,
    /// Least and greatest readings of the curve, radians.
    pub pan: [f64; 2],
    pub tilt: [f64; 2],
    /// Their middle.
    pub middle: [f64; 2],
    /// Pan and tilt of the pictures that together show the whole curve, nearest first; one, the middle,
    /// where one picture does.
    pub steps: Vec<[f64; 2]>,
    /// The zoom for them: the tightest of one picture, the widest of several; `None` without a zoom
    /// curve.
    pub zoom: Option<f64>,
    /// Of the target being in one of the pictures, at the worst distance.
    pub probability: f64,
}

/// A sample with its place in the rig's frame.
struct Sample {
    point: Vector3<f64>,
    at: SweepPoint,
}

impl Pointer {
    /// What to do about a pixel of the fixed camera whose depth is unknown, but for its nearest and
    /// farthest distance from the camera (metres; the farthest may be infinite).
    ///
    /// # Errors
    /// As [`aim`](Self::aim) but for those of the depth; `InvalidArgument` for a range that is none.
    pub fn sweep(&self, click: &Click, range: [f64; 2], options: &AimOptions) -> Result<Sweep> {
        options.validate()?;
        let seen = self.clicked(click)?;
        let widest = self.lens(self.widest()?)?;
        let noise = widest.noise(&Noise::new(&self.joint, &click.covariance, self.head_sigma));
        let samples = self.samples(&noise, &noise.fixed_ray(&seen), &widest, range)?;
        let whole = |lens: &Lens| self.least(lens, middle(&samples), &samples, options);
        let fixed_lens = || whole(&widest);
        let (zoom, probability) = match &self.zoom {
            None => (None, fixed_lens()),
            Some(curve) => {
                let hold = |zoom| Ok((whole(&self.lens(Some(zoom))?), ()));
                let (zoom, probability, ()) = zoom::tightest(curve, options.probability, hold)?;
                (Some(zoom), probability)
            }
        };
        let range_of = |angle: fn(&SweepPoint) -> f64| {
            let values = samples.iter().map(|s| angle(&s.at));
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)])
        };
        let (steps, probability) = if probability >= options.probability {
            (vec![middle(&samples)], probability)
        } else {
            self.steps(&widest, &samples, options)
        };
        Ok(Sweep {
            pan: range_of(|p| p.pan),
            tilt: range_of(|p| p.tilt),
            middle: middle(&samples),
            curve: samples.iter().map(|s| s.at).collect(),
            steps,
            zoom,
            probability,
        })
    }

    fn widest(&self) -> Result<Option<f64>> {
        let Some(curve) = &self.zoom else { return Ok(None) };
        let [low, high] = curve.range();
        let focal = |zoom| curve.at(zoom).map(|z| z.model.intrinsics.fx);
        Ok(Some(if focal(low)? <= focal(high)? { low } else { high }))
    }

    /// Along the ray, halved where the head turns fast.
    fn samples(&self, noise: &Noise, ray: &LinearRay, lens: &Lens, range: [f64; 2]) -> Result<Vec<Sample>> {
        let sample = |distance: f64| -> Result<Sample> {
            let point = noise.at(ray, distance);
            let [pan, tilt] = self.angles(&lens.model, &point.value)?;
            let (image, pixel) = noise
                .head_pixel(&lens.model, &self.station, [pan, tilt], &point)
                .ok_or_else(|| Error::Unreachable { reason: "the ray is outside the head camera's lens".into() })?;
            let back = Matrix2::from_columns(&[image.by_pan, image.by_tilt])
                .try_inverse()
                .ok_or_else(|| Error::Unreachable { reason: "the ray crosses the head's axis".into() })?;
            let angles = back * noise.pixel(&pixel).covariance * back.transpose();
            let at = SweepPoint { distance, pan, tilt, angles };
            Ok(Sample { point: in_station(&self.station, &point.value), at })
        };
        let picture = lens.half_picture();
        let finest = FINEST * 2.0 * picture.min() / lens.model.intrinsics.fx;
        let apart = |a: &SweepPoint, b: &SweepPoint| {
            ((a.pan - b.pan) * (0.5 * (a.tilt + b.tilt)).cos()).hypot(a.tilt - b.tilt) > finest
        };
        let mut samples: Vec<Sample> =
            distances(range, FIRST_SAMPLES)?.into_iter().map(sample).collect::<Result<_>>()?;
        let mut i = 1;
        while i < samples.len() {
            let (a, b) = (&samples[i - 1].at, &samples[i].at);
            if samples.len() < MAX_SAMPLES && apart(a, b) {
                let between = 2.0 / (1.0 / a.distance + 1.0 / b.distance);
                let new = sample(between)?;
                samples.insert(i, new);
            } else {
                i += 1;
            }
        }
        Ok(samples)
    }

    /// The probability of the target being in the picture at these readings, at the worst distance.
    fn least(&self, lens: &Lens, at: [f64; 2], samples: &[Sample], options: &AimOptions) -> f64 {
        samples.iter().map(|s| shows(lens, at, s, options)).fold(1.0, f64::min)
    }

    /// As few pictures as show the whole curve, and the probability at the worst distance.
    fn steps(&self, lens: &Lens, samples: &[Sample], options: &AimOptions) -> (Vec<[f64; 2]>, f64) {
        let (mut steps, mut probability, mut first) = (Vec::new(), 1.0f64, 0);
        while first < samples.len() {
            let show = |last: usize| {
                let part = &samples[first..=last];
                self.least(lens, middle(part), part, options)
            };
            let mut last = first;
            while last + 1 < samples.len() && show(last + 1) >= options.probability {
                last += 1;
            }
            probability = probability.min(show(last));
            steps.push(middle(&samples[first..=last]));
            // The next begins where this one ends, so that nothing between two samples is lost.
            first = if last + 1 == samples.len() { samples.len() } else { last.max(first + 1) };
        }
        (steps, probability)
    }
}

/// The middle of the samples' ranges of readings.
fn middle(samples: &[Sample]) -> [f64; 2] {
    [|p: &SweepPoint| p.pan, |p: &SweepPoint| p.tilt].map(|angle| {
        let (low, high) = samples
            .iter()
            .map(|s| angle(&s.at))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        0.5 * (low + high)
    })
}

/// The probability of a sample being in the picture.
fn shows(lens: &Lens, [pan, tilt]: [f64; 2], sample: &Sample, options: &AimOptions) -> f64 {
    let Some(image) = lens.model.head_image(pan, tilt, &sample.point) else { return 0.0 };
    let by_angles = Matrix2::from_columns(&[image.by_pan, image.by_tilt]);
    let covariance = by_angles * sample.at.angles * by_angles.transpose();
    let mean = image.pixel - lens.centre();
    let half = lens.half_picture() - extent(&image.by_point, options.target_size);
    let room = half - mean.abs();
    let sigma = covariance.diagonal().map(|v| v.max(0.0).sqrt());
    if (0..2).all(|i| room[i] > CERTAIN * sigma[i]) {
        return 1.0;
    }
    zoom::in_rectangle(&mean, &covariance, &half)
}

/// Distances from the nearest to the farthest, evenly spread in their inverse.
pub(super) fn distances([near, far]: [f64; 2], count: usize) -> Result<Vec<f64>> {
    if near.is_nan() || far.is_nan() {
        return Err(Error::NotFinite { name: "range", index: usize::from(!near.is_nan()) });
    }
    if !(near > 0.0 && near <= far && near < FARTHEST) {
        return Err(Error::invalid("range", format!("{near} to {far} m: positive, nearest first")));
    }
    let (most, least) = (1.0 / near, 1.0 / far.min(FARTHEST));
    Ok((0..count).map(|i| 1.0 / (most + (least - most) * i as f64 / (count - 1) as f64)).collect())
}
