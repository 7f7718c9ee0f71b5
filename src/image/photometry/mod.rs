//! How frames of one still scene relate: the exposure drift between them and their noise, estimated
//! from a sample of their own pixels, most of which must show the same in both.

mod kernels;
mod line;
mod noise;
mod sample;

use super::area::SearchArea;
use super::frames::{Channel, FrameMean};
pub use sample::Sample;

/// Rounding to whole grey levels.
const QUANTISATION: f32 = 1.0 / 12.0;
/// Above this a pixel may be clipped and tells neither level nor noise.
const CLIPPED: f32 = 252.0;

/// For each off level the least and the greatest on level that are no change.
pub type Limits = [[f32; 256]; 2];

/// on = gain x off + offset, and the noise about it.
#[derive(Debug, Clone)]
pub struct Photometry {
    pub gain: f32,
    pub offset: f32,
    /// Share of the sample that gain and offset explain: the rest changed.
    pub steady: f32,
    /// A frame's noise variance at level l is `read` + `shot` l (photon transfer: read noise and
    /// quantisation, then photon noise).
    pub read: f32,
    pub shot: f32,
    /// Variance of the mean of a few pixels over what independent noise would give; above 1 for
    /// compressed video.
    pub correlation: f32,
    /// Standard deviation of on - predicted by off level.
    deviation: [f32; 256],
    /// 1 / number of on and off frames.
    weight: [f32; 2],
}

impl Photometry {
    /// `sample` is memory to work in.
    pub fn estimate(
        on: &FrameMean<'_>,
        off: &FrameMean<'_>,
        channel: Channel,
        area: &SearchArea,
        sample: &mut Sample,
    ) -> Self {
        let weight = [1.0 / on.count() as f32, 1.0 / off.count() as f32];
        sample.take(on, off, channel, area);
        let floor = QUANTISATION * (weight[0] + weight[1]);
        let line = sample.fit_line(floor.sqrt());
        let noise = sample.noise(&line, floor);

        // From the difference's variance back to a single frame's.
        let [w_on, w_off] = weight;
        let shot = noise.slope / (line.gain * w_on + line.gain * line.gain * w_off);
        let read = (noise.base - shot * line.offset * w_on) / (w_on + line.gain * line.gain * w_off);
        let mut photometry = Self {
            gain: line.gain,
            offset: line.offset,
            steady: line.steady,
            read: read.max(QUANTISATION),
            shot,
            correlation: noise.correlation,
            deviation: [0.0; 256],
            weight,
        };
        kernels::deviations(&mut photometry, &noise.measured);
        photometry
    }

    /// The on level that belongs to an off level when nothing changed.
    #[inline(always)]
    pub fn predict(&self, off: f32) -> f32 {
        (self.gain * off + self.offset).clamp(0.0, 255.0)
    }

    /// Variance of on - predict(off) at these levels.
    #[inline(always)]
    pub fn variance(&self, on: f32, off: f32) -> f32 {
        let single = |level: f32| self.read + self.shot * level;
        self.weight[0] * single(on) + self.gain * self.gain * self.weight[1] * single(off)
    }

    /// What a grey level of signal adds to that variance.
    pub fn signal_variance(&self) -> f32 {
        self.weight[0] * self.shot
    }

    /// Standard deviation of on - predict(off), never below the measured scatter.
    pub fn deviation(&self, off: f32) -> f32 {
        self.deviation[off as usize & 255]
    }

    /// The on levels (least, greatest) within `k` standard deviations for each off level.
    pub fn limits(&self, k: f32) -> Limits {
        let mut limits = [[0.0; 256]; 2];
        kernels::limits(&mut limits, self, k);
        limits
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::frames::channels;
    use crate::image::{Image, PixelFormat};
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    /// Frames of a shaded scene with noise of variance read + shot x level, the sum of 12 uniforms.
    fn frame(gain: f64, offset: f64, read: f64, shot: f64, moved: bool, rng: &mut ChaCha8Rng) -> Image {
        let mut image = Image::new(PixelFormat::Gray8, 400, 300);
        for (i, byte) in image.data.iter_mut().enumerate() {
            let (x, y) = (i % 400, i / 400);
            let mut level = 30.0 + 0.4 * (3 * x % 400) as f64 + 12.0 * ((y / 20) % 2) as f64;
            if moved && x < 100 {
                level = 140.0 - 0.4 * y as f64;
            }
            level = gain * level + offset;
            let normal: f64 = (0..12).map(|_| rng.next_u32() as f64 / 2f64.powi(32) - 0.5).sum();
            *byte = (level + (read + shot * level).sqrt() * normal).round().clamp(0.0, 255.0) as u8;
        }
        image
    }

    #[test]
    fn drift_and_noise_are_measured() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut sample = Sample::default();
        for (gain, offset) in [(1.0, 0.0), (0.8, 6.0), (1.2, -4.0)] {
            // A quarter of the scene is another one.
            for (read, shot, moved) in [(4.0, 0.0, false), (1.0, 0.15, false), (4.0, 0.0, true)] {
                let off = frame(1.0, 0.0, read, shot, false, &mut rng);
                let on = frame(gain, offset, read, shot, moved, &mut rng);
                let (on, off) = ([on.view().unwrap()], [off.view().unwrap()]);
                let [on, off] = [&on, &off].map(|f| FrameMean::new("frames", f).unwrap());
                let area = SearchArea::new([400, 300], None, None).unwrap();
                let p = Photometry::estimate(&on, &off, channels(PixelFormat::Gray8)[0], &area, &mut sample);
                for level in [50.0f32, 120.0, 180.0] {
                    let wanted = gain as f32 * level + offset as f32;
                    assert!(
                        (p.predict(level) - wanted).abs() < 0.8,
                        "{gain} {offset}: {level} -> {}",
                        p.predict(level)
                    );
                    let on_level = wanted as f64;
                    let variance = read + shot * on_level + gain * gain * (read + shot * level as f64);
                    let ratio = p.deviation(level) as f64 / (variance + 0.15).sqrt();
                    let allowed = if moved { 0.8..1.6 } else { 0.92..1.1 };
                    assert!(allowed.contains(&ratio), "{gain} {read} {shot} {moved} at {level}: {ratio}");
                }
                let steady = if moved { 0.65..0.9 } else { 0.97..1.01 };
                assert!(steady.contains(&p.steady), "{}", p.steady);
            }
        }
    }
}
