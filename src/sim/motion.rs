//! How the head moves: two motors with a limited rate and whole steps, play in the gears, a swing
//! after each move, and a rest position that is never quite the same.

use std::collections::VecDeque;

use super::options::SimOptions;

/// Decay and frequency of the swing after a move.
const SWING_DECAY: f64 = 0.05;
const SWING_FREQUENCY: f64 = 8.0;
/// The swing is over after so many decay times.
const SWING_END: f64 = 4.0;
/// Moves of this size or more swing with the full amplitude, radians.
const FULL_SWING: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// One axis during one move.
#[derive(Debug, Clone, Copy)]
struct Axis {
    from: f64,
    to: f64,
    /// Seconds.
    duration: f64,
    /// Where the head was within the play when the move began.
    start: f64,
    /// Rest error before and after.
    error: [f64; 2],
}

#[derive(Debug, Clone, Copy)]
struct Move {
    begin: f64,
    axes: [Axis; 2],
}

/// The moves of a head, in the device's angles (pan, tilt): what its encoders read is exact in them,
/// what the head does is not.
#[derive(Debug, Clone)]
pub struct HeadMotion {
    step: f64,
    backlash: f64,
    speed: f64,
    overshoot: f64,
    /// Moves in order; kept as long as a frame may still show them.
    moves: VecDeque<Move>,
}

impl Axis {
    fn standing(at: f64) -> Self {
        Self { from: at, to: at, duration: 0.0, start: at, error: [0.0; 2] }
    }

    /// Share of the move that is done.
    fn progress(&self, since: f64) -> f64 {
        if since >= self.duration { 1.0 } else { (since / self.duration).max(0.0) }
    }

    fn motor(&self, since: f64) -> f64 {
        self.from + (self.to - self.from) * self.progress(since)
    }

    fn head(&self, since: f64, backlash: f64, overshoot: f64) -> f64 {
        let (progress, motor) = (self.progress(since), self.motor(since));
        // The motor pushes upwards directly and downwards once the play is taken up.
        let driven = self.start.clamp(motor, motor + backlash);
        driven + self.error[0] + (self.error[1] - self.error[0]) * progress + self.swing(since, overshoot)
    }

    fn swing(&self, since: f64, overshoot: f64) -> f64 {
        let after = since - self.duration;
        if after <= 0.0 || after >= SWING_END * SWING_DECAY {
            return 0.0;
        }
        let size = ((self.to - self.from) / FULL_SWING).clamp(-1.0, 1.0) * overshoot;
        size * (-after / SWING_DECAY).exp() * (2.0 * std::f64::consts::PI * SWING_FREQUENCY * after).sin()
    }
}

impl HeadMotion {
    /// At rest at zero.
    pub fn new(options: &SimOptions) -> Self {
        let rest = Move { begin: f64::NEG_INFINITY, axes: [Axis::standing(0.0); 2] };
        Self {
            step: options.step,
            backlash: options.backlash,
            speed: options.speed,
            overshoot: options.overshoot,
            moves: VecDeque::from([rest]),
        }
    }

    /// Starts a move to (pan, tilt), rounded to whole steps; `errors` are those of its rest position.
    pub fn start(&mut self, now: f64, target: [f64; 2], errors: [f64; 2]) {
        self.start_at_speed(now, target, [self.speed; 2], errors);
    }

    /// The same, each axis at its own speed (radians per second); one of speed 0 stays where it is.
    /// Moves that were to begin later are forgotten. Says when both axes are there.
    pub fn start_at_speed(&mut self, now: f64, target: [f64; 2], speed: [f64; 2], errors: [f64; 2]) -> f64 {
        while self.moves.len() > 1 && self.moves.back().is_some_and(|m| m.begin > now) {
            self.moves.pop_back();
        }
        let last = *self.current(now);
        let since = now - last.begin;
        let axes = std::array::from_fn(|k| {
            let old = last.axes[k];
            let from = old.motor(since);
            let to = self.round(if speed[k] > 0.0 { target[k] } else { from });
            let error = old.error[0] + (old.error[1] - old.error[0]) * old.progress(since);
            Axis {
                from,
                to,
                duration: (to - from).abs() / if speed[k] > 0.0 { speed[k] } else { self.speed },
                start: old.start.clamp(from, from + self.backlash),
                // An axis that does not turn rests where it was.
                error: [error, if to == from { error } else { errors[k] }],
            }
        });
        self.moves.push_back(Move { begin: now, axes });
        now + axes.iter().fold(0.0, |longest: f64, a: &Axis| longest.max(a.duration))
    }

    /// Stops at the steps next to where the motors are.
    pub fn stop(&mut self, now: f64) {
        let last = *self.current(now);
        let error = last.axes.map(|a| a.error[1]);
        self.start(now, last.axes.map(|a| a.motor(now - last.begin)), error);
    }

    /// What the encoders read.
    pub fn reading(&self, t: f64) -> [f64; 2] {
        let m = self.current(t);
        m.axes.map(|a| self.round(a.motor(t - m.begin)))
    }

    /// Where the head really is, in the device's angles.
    pub fn head(&self, t: f64) -> [f64; 2] {
        let m = self.current(t);
        m.axes.map(|a| a.head(t - m.begin, self.backlash, self.overshoot))
    }

    /// Do the motors turn?
    pub fn moving(&self, t: f64) -> bool {
        let m = self.current(t);
        m.axes.iter().any(|a| t - m.begin < a.duration)
    }

    /// Forgets moves that were over before `t`.
    pub fn forget_before(&mut self, t: f64) {
        while self.moves.len() > 1 && self.moves[1].begin <= t {
            self.moves.pop_front();
        }
    }

    fn current(&self, t: f64) -> &Move {
        self.moves.iter().rev().find(|m| m.begin <= t).unwrap_or(&self.moves[0])
    }

    fn round(&self, angle: f64) -> f64 {
        if self.step > 0.0 { (angle / self.step).round() * self.step } else { angle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head() -> HeadMotion {
        HeadMotion::new(&SimOptions::default())
    }

    #[test]
    fn the_rate_is_limited_and_the_swing_dies_away() {
        let o = SimOptions::default();
        let mut h = head();
        h.start(1.0, [0.5, -0.2], [0.0; 2]);
        let arrival = 1.0 + h.current(2.0).axes[0].duration;
        assert!((arrival - 1.0 - 0.5 / o.speed).abs() < o.step / o.speed);
        assert!(h.moving(1.1) && h.moving(arrival - 0.01) && !h.moving(arrival + 0.01));
        let mut largest = 0.0f64;
        for k in 0..2000 {
            let t = 1.0 + k as f64 * 1e-3;
            let moved = (h.reading(t)[0] - h.reading(t - 1e-3)[0]).abs();
            assert!(moved <= o.speed * 1e-3 + o.step + 1e-12);
            if t > arrival {
                largest = largest.max((h.head(t)[0] - h.head(9.0)[0]).abs());
            }
        }
        assert!(largest > 0.3 * o.overshoot && largest < o.overshoot, "{largest}");
        assert_eq!(h.head(arrival + 0.4), h.head(9.0));
        assert!((h.head(9.0)[0] - 0.5).abs() <= o.step / 2.0);
    }

    #[test]
    fn readings_are_whole_steps() {
        let o = SimOptions::default();
        let mut h = head();
        h.start(0.0, [0.333, 0.111], [0.0; 2]);
        for k in 0..100 {
            for angle in h.reading(k as f64 * 0.01) {
                let steps = angle / o.step;
                assert!((steps - steps.round()).abs() < 1e-9);
            }
        }
        assert!((h.reading(5.0)[0] - 0.333).abs() <= o.step / 2.0 + 1e-12);
    }

    #[test]
    fn the_play_shows_when_the_angle_was_reached_from_above() {
        let o = SimOptions::default();
        let mut h = head();
        h.start(0.0, [0.3, 0.1], [0.0; 2]);
        let below = h.head(10.0);
        h.start(10.0, [0.5, 0.3], [0.0; 2]);
        h.start(20.0, [0.3, 0.1], [0.0; 2]);
        assert_eq!(h.reading(30.0), h.reading(5.0));
        let above = h.head(30.0);
        for k in 0..2 {
            assert!((above[k] - below[k] - o.backlash).abs() < 1e-12);
        }
        // Again from below, and the play is gone.
        h.start(30.0, [0.2, 0.0], [0.0; 2]);
        h.start(40.0, [0.3, 0.1], [0.0; 2]);
        assert!((h.head(50.0)[0] - below[0]).abs() < 1e-12);
    }

    #[test]
    fn rest_errors_stay_until_the_axis_turns_again() {
        let mut h = head();
        h.start(0.0, [0.3, 0.1], [1e-4, 2e-4]);
        let rest = h.head(10.0);
        h.start(10.0, [0.3, 0.1], [5e-4, 5e-4]);
        assert_eq!(h.head(20.0), rest);
        h.start(20.0, [0.4, 0.1], [0.0; 2]);
        assert!((h.head(30.0)[0] - h.reading(30.0)[0]).abs() < 1e-12);
        assert!((h.head(30.0)[1] - rest[1]).abs() < 1e-12);
    }

    #[test]
    fn each_axis_has_its_own_speed_and_a_move_of_the_future_can_be_overtaken() {
        let mut h = head();
        let arrival = h.start_at_speed(0.0, [1.0, 1.0], [0.5, 0.0], [0.0; 2]);
        assert!((arrival - 2.0).abs() < 0.01, "{arrival}");
        assert!((h.reading(1.0)[0] - 0.5).abs() < 2e-3 && h.reading(5.0)[1] == 0.0);
        h.start(8.0, [-1.0, 0.0], [0.0; 2]);
        h.stop(6.0);
        assert_eq!(h.reading(20.0), h.reading(5.0));
    }

    #[test]
    fn stop_stops_and_the_past_is_kept() {
        let mut h = head();
        h.start(0.0, [1.0, 0.0], [0.0; 2]);
        let before = h.head(0.1);
        h.stop(0.2);
        assert!(!h.moving(0.25));
        assert!((h.reading(9.0)[0] - h.reading(0.2)[0]).abs() < 1e-12 && h.reading(9.0)[0] < 0.5);
        assert_eq!(h.head(0.1), before);
        h.forget_before(0.3);
        assert_eq!(h.moves.len(), 1);
    }
}
