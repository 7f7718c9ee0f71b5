//! Returns to one place from both sides: what readings and pictures repeat, and backlash.

use super::super::report::{Measured, ProbeReport};
use super::super::shift::{Shift, shift};
use super::super::statistics::{deviation, mean};
use super::Session;
use crate::error::Result;

/// Readings and pictures on returns from below and above.
#[derive(Default)]
pub(super) struct Returns {
    readings: [Vec<f64>; 2],
    shifts: [Vec<Shift>; 2],
    error: f64,
}

impl Session<'_, '_> {
    /// Returns to a place from below and from above in turn.
    pub(super) fn returns(&mut self, k: usize) -> Result<Returns> {
        let mut found = Returns::default();
        let look = self.frames.is_some();
        let mut reference = None;
        for _ in 0..self.options.repeats {
            for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
                self.settle(self.with(k, self.base[k] + sign * self.amplitude[k]), false)?;
                let at = self.settle(self.base, look)?;
                found.readings[side].push(at[k]);
                found.error = found.error.max((at[k] - self.base[k]).abs());
                if !look {
                    continue;
                }
                let reference = reference.get_or_insert_with(|| self.pictures[1].clone());
                if let Some(s) = shift(&reference.image.view()?, &self.pictures[1].image.view()?) {
                    found.shifts[side].push(s);
                }
            }
        }
        Ok(found)
    }

    pub(super) fn no_picture(&self, k: usize, reason: &str, report: &mut ProbeReport) {
        for figures in [
            &mut report.picture_repeatability_px,
            &mut report.picture_repeatability,
            &mut report.backlash_px,
            &mut report.backlash,
        ] {
            figures[k] = Err(reason.to_owned());
        }
    }

    pub(super) fn report_returns(&self, k: usize, found: &Returns, report: &mut ProbeReport) {
        let all = found.readings[0].len() + found.readings[1].len();
        report.position_error[k] =
            Ok(Measured { value: found.error, sigma: 0.5 * self.step(k) / 3f64.sqrt(), count: all as u32 });
        report.reading_repeatability[k] = Ok(deviation(&found.readings[0], &found.readings[1]));
        if self.frames.is_none() {
            return self.no_picture(k, "no frames were given", report);
        }
        let [below, above] = [0, 1].map(|side| found.shifts[side].iter().map(|s| s.by[k]).collect::<Vec<f64>>());
        if below.len() < 2 || above.len() < 2 {
            return self.no_picture(k, "the picture has no texture to measure shifts by", report);
        }
        let repeat = deviation(&below, &above);
        let (low, high) = (mean(&below), mean(&above));
        // What is turned further right or up moves the picture left or down.
        let sense = [-1.0, 1.0][k];
        let shifts = found.shifts.iter().flatten();
        let own = shifts.map(|s| s.sigma[k].powi(2)).sum::<f64>().sqrt() / all as f64;
        let backlash = Measured {
            value: sense * (high.value - low.value),
            sigma: low.sigma.hypot(high.sigma).hypot(own),
            count: all as u32,
        };
        report.picture_repeatability_px[k] = Ok(repeat);
        report.backlash_px[k] = Ok(backlash);
        let focal = self.camera.map(|c| [c.intrinsics.fx, c.intrinsics.fy][k]);
        let angle = |m: Measured| match focal {
            Some(f) => Ok(Measured { value: m.value / f, sigma: m.sigma / f, count: m.count }),
            None => Err("the camera's intrinsics were not given".to_owned()),
        };
        (report.picture_repeatability[k], report.backlash[k]) = (angle(repeat), angle(backlash));
    }
}
