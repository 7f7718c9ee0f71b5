//! The pan/tilt grid of a scan and the order in which it is visited.

use crate::device::PtzCapabilities;
use crate::error::{Error, Result};

/// Most positions of one scan.
pub const MAX_POSITIONS: u64 = 1_000_000;

/// A grid of pan and tilt positions, as the device reads them: `pan_steps` columns by `tilt_steps`
/// rows, both ends included. A single step stands in the middle of its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanRegion {
    /// Least and greatest, radians.
    pub pan: [f64; 2],
    pub tilt: [f64; 2],
    pub pan_steps: u32,
    pub tilt_steps: u32,
}

impl ScanRegion {
    /// Checks finiteness, order and number.
    pub fn validate(&self) -> Result<()> {
        for (name, interval) in [("region.pan", self.pan), ("region.tilt", self.tilt)] {
            if let Some(index) = interval.iter().position(|v| !v.is_finite()) {
                return Err(Error::NotFinite { name, index });
            }
            if interval[0] > interval[1] {
                return Err(Error::invalid(name, format!("{} > {}: least first", interval[0], interval[1])));
            }
        }
        let count = u64::from(self.pan_steps) * u64::from(self.tilt_steps);
        if count == 0 || count > MAX_POSITIONS {
            return Err(Error::invalid(
                "region",
                format!("{} x {} positions; 1 to {MAX_POSITIONS} are possible", self.pan_steps, self.tilt_steps),
            ));
        }
        Ok(())
    }

    /// Refuses a region that the head cannot reach.
    pub fn check_reach(&self, capabilities: &PtzCapabilities) -> Result<()> {
        for (pan, tilt) in [(self.pan[0], self.tilt[0]), (self.pan[1], self.tilt[1])] {
            super::check_reach(capabilities, pan, tilt)?;
        }
        Ok(())
    }

    /// Number of positions.
    pub fn len(&self) -> usize {
        self.pan_steps as usize * self.tilt_steps as usize
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Pan and tilt of position `index` = row * pan_steps + column.
    pub fn position(&self, index: u32) -> (f64, f64) {
        (at(self.pan, self.pan_steps, index % self.pan_steps), at(self.tilt, self.tilt_steps, index / self.pan_steps))
    }

    /// The order of visits: an evenly spread coarse subset of about `coarse_shots` positions, then
    /// the rest. Returns the order and the number of coarse positions in it; they are all when the
    /// grid is not much larger than the subset.
    ///
    /// Rows are walked in alternating directions (a serpentine), or all in the positive direction
    /// when `one_sided`: a head with backlash is then approached from one side without an extra
    /// move at each position.
    pub fn path(&self, coarse_shots: u32, one_sided: bool) -> (Vec<u32>, usize) {
        let ratio = (self.len() as f64 / f64::from(coarse_shots.max(1))).max(1.0);
        // A stride never passes over a whole side.
        let pan_every = (ratio.sqrt().round() as u32).min(self.pan_steps);
        let tilt_every = ((ratio / f64::from(pan_every)).round() as u32).clamp(1, self.tilt_steps);
        let pan_every = ((ratio / f64::from(tilt_every)).round() as u32).clamp(1, self.pan_steps);
        let is_coarse = |index: u32| {
            (index % self.pan_steps) % pan_every == pan_every / 2
                && (index / self.pan_steps) % tilt_every == tilt_every / 2
        };
        let mut order = self.walk(one_sided, is_coarse);
        let coarse = order.len();
        order.extend(self.walk(one_sided, |index| !is_coarse(index)));
        (order, coarse)
    }

    fn walk(&self, one_sided: bool, wanted: impl Fn(u32) -> bool) -> Vec<u32> {
        let mut order = Vec::new();
        let mut backwards = false;
        for row in 0..self.tilt_steps {
            let start = order.len();
            order.extend((row * self.pan_steps..(row + 1) * self.pan_steps).filter(|i| wanted(*i)));
            if backwards && !one_sided {
                order[start..].reverse();
            }
            // Rows without a wanted position do not turn the serpentine.
            backwards ^= order.len() > start;
        }
        order
    }
}

fn at(interval: [f64; 2], steps: u32, i: u32) -> f64 {
    if steps == 1 {
        return 0.5 * (interval[0] + interval[1]);
    }
    let s = f64::from(i) / f64::from(steps - 1);
    (interval[0] * (1.0 - s) + interval[1] * s).clamp(interval[0], interval[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region(pan_steps: u32, tilt_steps: u32) -> ScanRegion {
        ScanRegion { pan: [-0.5, 0.4], tilt: [-0.3, 0.2], pan_steps, tilt_steps }
    }

    #[test]
    fn every_position_is_visited_once_and_coarse_ones_first() {
        for (w, h) in [(1, 1), (1, 7), (50, 1), (7, 5), (47, 43), (300, 2)] {
            for coarse_shots in [0, 1, 12, 60] {
                for one_sided in [false, true] {
                    let grid = region(w, h);
                    let (order, coarse) = grid.path(coarse_shots, one_sided);
                    let mut sorted = order.clone();
                    sorted.sort_unstable();
                    assert_eq!(sorted, (0..w * h).collect::<Vec<_>>());
                    assert!(coarse >= 1 && coarse <= order.len());
                    assert_eq!(grid.path(coarse_shots, !one_sided).1, coarse);
                }
            }
        }
        let (order, coarse) = region(47, 43).path(60, false);
        assert!((48..=96).contains(&coarse), "{coarse} of {}", order.len());
    }

    #[test]
    fn a_serpentine_turns_and_a_one_sided_path_does_not() {
        let grid = region(4, 3);
        assert_eq!(grid.path(12, false).0, [0, 1, 2, 3, 7, 6, 5, 4, 8, 9, 10, 11]);
        assert_eq!(grid.path(12, true).0, (0..12).collect::<Vec<_>>());
    }

    #[test]
    fn positions_span_the_region_to_both_ends() {
        let grid = region(10, 6);
        assert_eq!(grid.position(0), (-0.5, -0.3));
        assert_eq!(grid.position(59), (0.4, 0.2));
        assert_eq!(region(1, 1).position(0), (0.5 * (-0.5 + 0.4), 0.5 * (-0.3 + 0.2)));
    }

    #[test]
    fn bad_regions_are_refused() {
        assert!(region(3, 3).validate().is_ok());
        assert!(region(0, 3).validate().is_err());
        assert!(region(u32::MAX, u32::MAX).validate().is_err());
        let nan = ScanRegion { pan: [0.0, f64::NAN], ..region(3, 3) };
        assert_eq!(nan.validate(), Err(Error::NotFinite { name: "region.pan", index: 1 }));
        assert!(ScanRegion { tilt: [0.2, 0.1], ..region(3, 3) }.validate().is_err());
    }
}
