//! A camera's sensor: adds the laser's light to a background, then noise, and makes bytes of it.

use std::sync::Arc;

use nalgebra::Matrix2;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::encode;
use super::options::SimOptions;
use super::render::{FRACTION, Renderer};
use super::scene::Person;
use super::spot::SpotImage;
use crate::error::Result;
use crate::geometry::{Camera, Rigid};
use crate::image::{Image, PixelFormat};

/// Brightness that a pixel can hold before it is cut at 255 grey levels; keeps sums inside 16 bits.
const CEILING: f64 = 2000.0;
const UNIT: f64 = (1 << FRACTION) as f64;
/// Standard deviation of the halo, px.
const HALO_DEVIATION: f64 = 4.0;
/// A spot is drawn out to where it adds less than this, grey levels.
const FAINT: f64 = 0.03;

/// Normal deviates to draw noise from: a frame's rows each begin at a random place in it.
pub struct NoiseTable(Vec<i16>);

impl NoiseTable {
    const STARTS: usize = 1 << 16;
    /// One standard deviation.
    const ONE: f64 = 4096.0;

    /// Serves rows of up to `longest_row` values.
    pub fn new(seed: u64, longest_row: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform = move || (f64::from(rng.next_u32()) + 0.5) / 4_294_967_296.0;
        let count = (Self::STARTS + longest_row).next_multiple_of(2);
        let mut values = Vec::with_capacity(count);
        for _ in 0..count / 2 {
            // Box-Muller.
            let (radius, angle) = ((-2.0 * uniform().ln()).sqrt(), 2.0 * std::f64::consts::PI * uniform());
            values.extend([radius * angle.cos(), radius * angle.sin()]);
        }
        Self(values.iter().map(|v| (v * Self::ONE).round() as i16).collect())
    }

    fn row(&self, random: u64, length: usize) -> &[i16] {
        &self.0[random as usize % Self::STARTS..][..length]
    }
}

/// What happened in front of the camera during one exposure.
pub struct Exposure {
    /// Poses from the room to the camera over the exposure, evenly in time; one when it stood still.
    pub poses: Vec<Rigid>,
    /// Spots with the share of the exposure for which they shone there.
    pub spots: Vec<(SpotImage, f64)>,
    pub person: Option<Person>,
    /// Auto-exposure's factor on all light.
    pub gain: f64,
    /// Different for every frame of every camera.
    pub seed: u64,
}

pub struct Sensor {
    renderer: Renderer,
    format: PixelFormat,
    width: usize,
    height: usize,
    noise: Arc<NoiseTable>,
    read_variance: f64,
    shot_noise: f64,
    halo: f64,
    gain: f64,
    /// Background and its noise for one standing pose.
    pose: Option<Rigid>,
    background: Vec<u16>,
    deviation: Vec<u8>,
    deviation_of_level: [u8; 256],
    bgr: Vec<u8>,
}

impl Sensor {
    pub fn new(camera: &Camera, options: &SimOptions, noise: Arc<NoiseTable>) -> Result<Self> {
        let renderer = Renderer::new(camera, options.format.has_colour())?;
        let (width, height) = (camera.width as usize, camera.height as usize);
        let values = width * height * renderer.channels();
        let read_variance = options.read_noise * options.read_noise;
        let deviation_of_level =
            std::array::from_fn(|level| deviation(read_variance, options.shot_noise, level as f64));
        Ok(Self {
            renderer,
            format: options.format,
            width,
            height,
            noise,
            read_variance,
            shot_noise: options.shot_noise,
            halo: options.halo,
            gain: options.gain,
            pose: None,
            background: vec![0; values],
            deviation: vec![0; values],
            deviation_of_level,
            bgr: Vec::new(),
        })
    }

    /// The frame of one exposure.
    pub fn expose(&mut self, exposure: &Exposure, image: &mut Image) {
        self.see(&exposure.poses);
        if image.format != self.format || image.width as usize != self.width || image.height as usize != self.height {
            *image = Image::new(self.format, self.width as u32, self.height as u32);
        }
        if matches!(self.format, PixelFormat::Gray8 | PixelFormat::Bgr24) {
            self.develop(exposure, &mut image.data);
        } else {
            let mut bgr = std::mem::take(&mut self.bgr);
            bgr.resize(self.background.len(), 0);
            self.develop(exposure, &mut bgr);
            encode::from_bgr(&bgr, image);
            self.bgr = bgr;
        }
    }

    /// Makes the background of the given poses, averaged; keeps that of a standing camera.
    fn see(&mut self, poses: &[Rigid]) {
        if poses.len() == 1 && self.pose == Some(poses[0]) {
            return;
        }
        self.renderer.render(&poses[0], &mut self.background);
        if poses.len() > 1 {
            let mut other = vec![0; self.background.len()];
            for pose in &poses[1..] {
                self.renderer.render(pose, &mut other);
                self.background.iter_mut().zip(&other).for_each(|(sum, v)| *sum += v);
            }
            self.background.iter_mut().for_each(|sum| *sum /= poses.len() as u16);
        }
        self.pose = (poses.len() == 1).then_some(poses[0]);
        let gain = (self.gain * UNIT) as u32;
        for (deviation, level) in self.deviation.iter_mut().zip(&self.background) {
            let level = (u32::from(*level) * gain) >> (2 * FRACTION);
            *deviation = self.deviation_of_level[level.min(255) as usize];
        }
    }

    fn develop(&self, exposure: &Exposure, out: &mut [u8]) {
        let stride = self.width * self.renderer.channels();
        let gain = (self.gain * exposure.gain * 4096.0).round().clamp(0.0, 65535.0) as u16;
        let extra = ExtraLight::new(self, exposure);
        let mut random = exposure.seed;
        let mut signal = vec![0i16; stride];
        let mut deviation = vec![0u8; stride];
        for (y, out) in out.chunks_exact_mut(stride).enumerate() {
            let row = y * stride..(y + 1) * stride;
            let noise = self.noise.row(split_mix(&mut random), stride);
            for (signal, level) in signal.iter_mut().zip(&self.background[row.clone()]) {
                *signal = ((u32::from(*level << 4) * u32::from(gain)) >> 16) as i16;
            }
            let mut row_deviation = &self.deviation[row.clone()];
            if extra.touches(y) {
                deviation.copy_from_slice(row_deviation);
                extra.add(self, y, &mut signal, &mut deviation);
                row_deviation = &deviation;
            }
            add_noise(&signal, row_deviation, noise, out);
        }
    }
}

/// In sixteenths of a grey level.
fn deviation(read_variance: f64, shot_noise: f64, level: f64) -> u8 {
    ((read_variance + shot_noise * level.clamp(0.0, 255.0)).sqrt() * UNIT).round().min(255.0) as u8
}

/// Written so that it vectorises: 16-bit products of which the upper half is kept.
fn add_noise(signal: &[i16], deviation: &[u8], noise: &[i16], out: &mut [u8]) {
    const HALF: i16 = 1 << (FRACTION - 1);
    for (((out, &signal), &deviation), &noise) in out.iter_mut().zip(signal).zip(deviation).zip(noise) {
        let noise = ((i32::from(noise) * i32::from(i16::from(deviation) << 4)) >> 16) as i16;
        *out = (signal.saturating_add(noise).saturating_add(HALF) >> FRACTION).clamp(0, 255) as u8;
    }
}

/// SplitMix64: the next of a sequence of well mixed numbers.
pub fn split_mix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// What a frame holds beside its background: laser spots, and a person in front of it.
struct ExtraLight {
    gaussians: Vec<Gaussian>,
    /// x and channel values (grey levels) of the pixels where the person is seen, row by row.
    person: Vec<Vec<(usize, [f64; 3])>>,
}

struct Gaussian {
    centre: [f64; 2],
    /// Inverse covariance xx, xy, yy.
    information: [f64; 3],
    peak: [f64; 3],
    reach: f64,
}

impl Gaussian {
    fn new(spot: &SpotImage, covariance: &Matrix2<f64>, light: [f64; 3]) -> Option<Self> {
        let inverse = covariance.try_inverse()?;
        let area = 2.0 * std::f64::consts::PI * covariance.determinant().sqrt();
        let peak = light.map(|l| l / area);
        let brightest = peak.iter().copied().fold(0.0, f64::max);
        let widest = 0.5
            * (covariance.trace() + ((covariance.m11 - covariance.m22).powi(2) + 4.0 * covariance.m12.powi(2)).sqrt());
        let reach = (2.0 * widest * (brightest / FAINT).ln()).max(0.0).sqrt();
        (brightest > FAINT).then_some(Self {
            centre: spot.centre.into(),
            information: [inverse.m11, inverse.m12, inverse.m22],
            peak,
            reach,
        })
    }
}

impl ExtraLight {
    fn new(sensor: &Sensor, exposure: &Exposure) -> Self {
        let wide = Matrix2::identity() * (HALO_DEVIATION * HALO_DEVIATION);
        let gain = sensor.gain * exposure.gain;
        let gaussians = exposure
            .spots
            .iter()
            .flat_map(|(spot, share)| {
                let part = |p: f64| spot.light.map(|l| l * share * p * gain);
                [
                    Gaussian::new(spot, &spot.covariance, part(1.0 - sensor.halo)),
                    Gaussian::new(spot, &(spot.covariance + wide), part(sensor.halo)),
                ]
            })
            .flatten()
            .collect();
        let mut person = Vec::new();
        if let Some(walker) = &exposure.person {
            person.resize_with(sensor.height, Vec::new);
            let middle = exposure.poses[exposure.poses.len() / 2];
            sensor.renderer.person(&middle, walker, |x, y, [r, g, b]| {
                person[y].push((x, [b, g, r].map(|c| c * gain)));
            });
        }
        Self { gaussians, person }
    }

    fn touches(&self, y: usize) -> bool {
        self.person.get(y).is_some_and(|row| !row.is_empty())
            || self.gaussians.iter().any(|g| (y as f64 - g.centre[1]).abs() <= g.reach)
    }

    /// Changes one row's signal, and its noise with it.
    fn add(&self, sensor: &Sensor, y: usize, signal: &mut [i16], deviation: &mut [u8]) {
        let channels = sensor.renderer.channels();
        let grey = |c: [f64; 3]| 0.114 * c[0] + 0.587 * c[1] + 0.299 * c[2];
        let mut put = |x: usize, light: [f64; 3], over: bool| {
            let luma = [grey(light); 3];
            let light = if channels == 1 { &luma } else { &light };
            for (k, light) in light.iter().enumerate().take(channels) {
                let at = channels * x + k;
                let before = if over { 0.0 } else { f64::from(signal[at]) / UNIT };
                let level = (before + light).min(CEILING);
                signal[at] = (level * UNIT).round() as i16;
                deviation[at] = self::deviation(sensor.read_variance, sensor.shot_noise, level);
            }
        };
        for (x, colour) in self.person.get(y).into_iter().flatten() {
            put(*x, *colour, true);
        }
        for g in &self.gaussians {
            let dy = y as f64 - g.centre[1];
            if dy.abs() > g.reach {
                continue;
            }
            // Casts to usize saturate: nothing is left of a spot beside the image.
            let first = (g.centre[0] - g.reach).ceil() as usize;
            let end = ((g.centre[0] + g.reach).floor() + 1.0) as usize;
            for x in first..end.min(sensor.width) {
                let dx = x as f64 - g.centre[0];
                let [xx, xy, yy] = g.information;
                let falloff = (-0.5 * (xx * dx * dx + 2.0 * xy * dx * dy + yy * dy * dy)).exp();
                put(x, g.peak.map(|p| p * falloff), false);
            }
        }
    }
}
