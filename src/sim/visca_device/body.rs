//! What moves in an emulated camera: its head, its own or that of a [`Simulator`](crate::sim::Simulator),
//! and its lens.

use std::sync::Arc;

use crate::sim::Shared;
use crate::sim::motion::HeadMotion;
use crate::sim::options::SimOptions;

/// Moves are kept so long, seconds.
const MEMORY: f64 = 1.0;

/// The motors of pan and tilt, in radians, positive right and up. Moments may lie a little ahead: a
/// camera that has heard a command starts a moment later.
pub(super) enum Head {
    Own(HeadMotion),
    Simulated(Arc<Shared>),
}

impl Head {
    /// A head without play, swing or error, whose encoders have this step.
    pub fn own(step: f64) -> Self {
        Self::Own(HeadMotion::new(&SimOptions { step, backlash: 0.0, overshoot: 0.0, ..SimOptions::default() }))
    }

    /// Starts a move, each axis at its own speed (radians per second); says when it is there.
    pub fn go(&mut self, begin: f64, target: [f64; 2], speed: [f64; 2]) -> f64 {
        match self {
            Self::Own(motion) => {
                motion.forget_before(begin - MEMORY);
                motion.start_at_speed(begin, target, speed, [0.0; 2])
            }
            Self::Simulated(shared) => {
                let mut world = shared.world();
                let limit = world.options.speed;
                world.move_head(begin, target, speed.map(|s| s.min(limit)))
            }
        }
    }

    pub fn stop(&mut self, at: f64) {
        self.with(|motion| motion.stop(at));
    }

    /// What the encoders read.
    pub fn reading(&mut self, at: f64) -> [f64; 2] {
        self.with(|motion| motion.reading(at))
    }

    pub fn is_moving(&mut self, at: f64) -> bool {
        self.with(|motion| motion.moving(at))
    }

    fn with<T>(&mut self, f: impl FnOnce(&mut HeadMotion) -> T) -> T {
        match self {
            Self::Own(motion) => f(motion),
            Self::Simulated(shared) => f(&mut shared.world().motion),
        }
    }
}

/// A number of the lens that changes at a steady rate: zoom or focus. The simulator's own lens is
/// fixed: its pictures do not show it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Glide {
    from: f64,
    to: f64,
    begin: f64,
    /// Units per second.
    rate: f64,
}

impl Glide {
    pub fn resting(at: u16) -> Self {
        Self { from: at.into(), to: at.into(), begin: 0.0, rate: 1.0 }
    }

    /// Says when it is there.
    pub fn go(&mut self, begin: f64, to: u16, rate: f64) -> f64 {
        *self = Self { from: self.at(begin), to: to.into(), begin, rate: rate.max(1e-6) };
        self.arrival()
    }

    pub fn stop(&mut self, at: f64) {
        *self = Self::resting(self.value(at));
    }

    pub fn value(&self, at: f64) -> u16 {
        self.at(at).round() as u16
    }

    fn arrival(&self) -> f64 {
        self.begin + (self.to - self.from).abs() / self.rate
    }

    fn at(&self, t: f64) -> f64 {
        let way = (self.rate * (t - self.begin)).clamp(0.0, (self.to - self.from).abs());
        self.from + way * (self.to - self.from).signum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_glide_takes_its_time_and_stops() {
        let mut zoom = Glide::resting(0x1000);
        assert_eq!((zoom.value(-1.0), zoom.value(7.0)), (0x1000, 0x1000));
        assert_eq!(zoom.go(10.0, 0x2000, 2048.0), 12.0);
        assert_eq!([9.0, 11.0, 99.0].map(|t| zoom.value(t)), [0x1000, 0x1800, 0x2000]);
        assert_eq!(zoom.go(11.0, 0, 2048.0), 14.0);
        zoom.stop(12.0);
        assert_eq!([12.0, 13.0, 99.0].map(|t| zoom.value(t)), [0x1000; 3]);
    }

    #[test]
    fn an_own_head_moves_exactly() {
        let mut head = Head::own(0.001);
        let there = head.go(1.0, [0.5, -0.25], [0.5, 0.5]);
        assert!((there - 2.0).abs() < 1e-9);
        assert!(!head.is_moving(0.9) && head.is_moving(1.5) && !head.is_moving(2.1));
        assert!((head.reading(1.5)[0] - 0.25).abs() < 1e-9 && (head.reading(3.0)[1] + 0.25).abs() < 1e-9);
        head.stop(1.5);
        assert!((head.reading(9.0)[0] - 0.25).abs() < 1e-9);
    }
}
