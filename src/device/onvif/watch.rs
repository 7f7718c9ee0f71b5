//! Whether a camera's word on its motion can be believed.

use super::services::MoveStatus;

/// A camera that says MOVING for this long while its position stays the same is stuck, seconds.
const STUCK: f64 = 3.0;
/// One that says IDLE between so many different positions never looks.
const LIES: u32 = 3;

/// Cameras exist that always say IDLE and such that never leave MOVING. Both are found out by their
/// positions, and not asked again.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionWatch {
    trusted: bool,
    proven: bool,
    last: Option<[f64; 3]>,
    /// Since when it says MOVING at the same position.
    stuck_since: Option<f64>,
    idle_changes: u32,
}

impl MotionWatch {
    /// `speaks`: does the camera say anything of its motion?
    pub fn new(speaks: bool) -> Self {
        Self { trusted: speaks, proven: false, last: None, stuck_since: None, idle_changes: 0 }
    }

    pub fn trusted(&self) -> bool {
        self.trusted
    }

    /// Was the camera once heard to say that it moves?
    pub fn proven(&self) -> bool {
        self.proven
    }

    /// A move was commanded: what was before it proves nothing.
    pub fn restart(&mut self) {
        (self.last, self.stuck_since, self.idle_changes) = (None, None, 0);
    }

    /// Takes in what the camera says, at `now` seconds; the reason when it is no longer believed.
    pub fn observe(&mut self, motion: Option<MoveStatus>, at: Option<[f64; 3]>, now: f64) -> Option<&'static str> {
        let same = at.is_some() && self.last == at;
        let changed = at.is_some() && self.last.is_some() && !same;
        self.last = at.or(self.last);
        match motion {
            Some(MoveStatus::Moving) => {
                self.proven = true;
                self.idle_changes = 0;
                self.stuck_since = if same { self.stuck_since.or(Some(now)) } else { None };
            }
            Some(MoveStatus::Idle) => {
                self.stuck_since = None;
                self.idle_changes += u32::from(changed);
            }
            None => self.stuck_since = None,
        }
        let stuck = self.stuck_since.is_some_and(|since| now - since >= STUCK);
        let blind = self.idle_changes >= LIES;
        if !self.trusted || !(stuck || blind) {
            return None;
        }
        self.trusted = false;
        Some(if stuck {
            "the camera says that it moves, and its position stays: its word on motion is passed over"
        } else {
            "the camera says that it stands, and its position changes: its word on motion is passed over"
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDLE: Option<MoveStatus> = Some(MoveStatus::Idle);
    const MOVING: Option<MoveStatus> = Some(MoveStatus::Moving);

    fn at(pan: f64) -> Option<[f64; 3]> {
        Some([pan, 0.0, 0.0])
    }

    #[test]
    fn an_honest_camera_stays_trusted() {
        let mut watch = MotionWatch::new(true);
        for round in 0..50 {
            let start = 100.0 * f64::from(round);
            watch.restart();
            for i in 0..20 {
                let moving = i < 10;
                let place = at(start + f64::from(i.min(10)));
                let said = watch.observe(if moving { MOVING } else { IDLE }, place, start + f64::from(i));
                assert_eq!(said, None);
            }
        }
        assert!(watch.trusted() && watch.proven());
        // Standing before a move, and at its end: once changed, no lie.
        let mut watch = MotionWatch::new(true);
        assert_eq!(watch.observe(IDLE, at(0.0), 0.0), None);
        assert_eq!(watch.observe(IDLE, at(1.0), 9.0), None);
        assert!(watch.trusted() && !watch.proven());
    }

    #[test]
    fn liars_are_found_out_once() {
        let mut blind = MotionWatch::new(true);
        let said: Vec<_> = (0..9).filter_map(|i| blind.observe(IDLE, at(f64::from(i)), f64::from(i) * 0.1)).collect();
        assert!(said.len() == 1 && said[0].contains("stands"), "{said:?}");
        assert!(!blind.trusted());
        let mut stuck = MotionWatch::new(true);
        let said: Vec<_> = (0..99).filter_map(|i| stuck.observe(MOVING, at(1.0), f64::from(i) * 0.1)).collect();
        assert!(said.len() == 1 && said[0].contains("moves"), "{said:?}");
        // Without positions nothing can be held against it.
        let mut unknown = MotionWatch::new(true);
        assert!((0..99).all(|i| unknown.observe(MOVING, None, f64::from(i)).is_none()));
    }
}
