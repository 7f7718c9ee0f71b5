//! A head that counts in numbers of its own, as one that knows angles.

use std::sync::Arc;

use super::{Brake, Focus, Identity, Motion, PanTiltZoom, PtzCapabilities, PtzPosition, PtzVelocity};
use crate::error::{Error, Result};
use crate::geometry::AngleMap;
use crate::geometry::angle_map::AxisMap;

/// Wraps a head with [`raw_units`](PtzCapabilities::raw_units): ranges, steps, speeds, moves and positions
/// are in radians, all else is passed on.
pub struct MappedPtz {
    head: Box<dyn PanTiltZoom>,
    map: AngleMap,
}

impl MappedPtz {
    /// # Errors
    /// `InvalidArgument` for a head that knows angles itself, and one whose range has nothing in common
    /// with the map's.
    pub fn new(head: Box<dyn PanTiltZoom>, map: AngleMap) -> Result<Self> {
        let c = head.capabilities();
        if !c.raw_units {
            return Err(Error::invalid("head", "it knows angles itself: it needs no map"));
        }
        for (name, range, axis) in [("pan", c.pan_range, &map.pan), ("tilt", c.tilt_range, &map.tilt)] {
            let known = axis.raw_range();
            let [low, high] = common(range, known);
            // Also for what is not finite.
            if !matches!(low.partial_cmp(&high), Some(std::cmp::Ordering::Less)) {
                let reason = format!("{name}: the map answers for {known:?}, the head moves over {range:?}");
                return Err(Error::invalid("map", reason));
            }
        }
        Ok(Self { head, map })
    }

    pub fn map(&self) -> &AngleMap {
        &self.map
    }

    /// The head itself.
    pub fn into_inner(self) -> Box<dyn PanTiltZoom> {
        self.head
    }

    /// Where the head is in its own numbers. A reading a step beyond the map's end is the end: it was
    /// rounded there.
    fn raw_position(&mut self) -> Result<PtzPosition> {
        let c = self.head.capabilities();
        let at = self.head.position()?;
        Ok(PtzPosition {
            pan: reading("pan", &self.map.pan, at.pan, c.pan_step)?,
            tilt: reading("tilt", &self.map.tilt, at.tilt, c.tilt_step)?,
            zoom: at.zoom,
        })
    }
}

fn common([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a.max(c), b.min(d)]
}

fn reading(name: &str, axis: &AxisMap, raw: f64, step: f64) -> Result<f64> {
    let [low, high] = axis.raw_range();
    let slack = step.max(1e-6 * (high - low));
    if raw >= low - slack && raw <= high + slack {
        return Ok(raw.clamp(low, high));
    }
    let reason = format!("{name}: the head reports {raw}, its angle map was learned for {low} to {high}");
    Err(Error::Device { reason })
}

/// Range, step and greatest speed of an axis in radians. The step is the greatest that a device's step
/// makes anywhere, the speed what is reached somewhere.
fn in_radians(axis: &AxisMap, range: [f64; 2], step: f64, speed: f64) -> ([f64; 2], f64, f64) {
    let [low, high] = common(range, axis.raw_range());
    let ends = [low, high].map(|raw| axis.angle(raw).unwrap_or(f64::NAN));
    let steepest = axis.steepest();
    ([ends[0].min(ends[1]), ends[0].max(ends[1])], step * steepest, speed * steepest)
}

/// A speed in device's units per second. 0 stops, whatever the slope.
fn raw_speed(axis: &AxisMap, raw: f64, speed: f64) -> Result<f64> {
    if speed == 0.0 {
        return Ok(0.0);
    }
    let slope = axis.slope(raw)?;
    let [low, high] = axis.raw_range();
    let [least, greatest] = axis.angle_range();
    // Where a limited spline is flat, the axis as a whole tells the scale.
    let floor = 0.01 * (greatest - least) / (high - low);
    let sign = if axis.nodes()[0][1] < axis.nodes()[1][1] { 1.0 } else { -1.0 };
    Ok(speed / (sign * slope.abs().max(floor)))
}

impl PanTiltZoom for MappedPtz {
    fn capabilities(&self) -> PtzCapabilities {
        let c = self.head.capabilities();
        let (pan_range, pan_step, pan_speed) = in_radians(&self.map.pan, c.pan_range, c.pan_step, c.max_speed[0]);
        let (tilt_range, tilt_step, tilt_speed) = in_radians(&self.map.tilt, c.tilt_range, c.tilt_step, c.max_speed[1]);
        PtzCapabilities {
            pan_range,
            tilt_range,
            pan_step,
            tilt_step,
            max_speed: [pan_speed, tilt_speed],
            raw_units: false,
            ..c
        }
    }

    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        let [pan, tilt] = self.map.raw([pan, tilt])?;
        self.head.move_absolute(pan, tilt)
    }

    fn position(&mut self) -> Result<PtzPosition> {
        let raw = self.raw_position()?;
        let [pan, tilt] = self.map.angles([raw.pan, raw.tilt])?;
        Ok(PtzPosition { pan, tilt, zoom: raw.zoom })
    }

    fn motion(&mut self) -> Result<Motion> {
        self.head.motion()
    }

    fn stop(&mut self) -> Result<()> {
        self.head.stop()
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        self.head.brake()
    }

    fn identity(&mut self) -> Result<Identity> {
        self.head.identity()
    }

    fn move_relative(&mut self, pan: f64, tilt: f64) -> Result<()> {
        let from = self.raw_position()?;
        let at = self.map.angles([from.pan, from.tilt])?;
        let to = self.map.raw([at[0] + pan, at[1] + tilt])?;
        self.head.move_relative(to[0] - from.pan, to[1] - from.tilt)
    }

    fn move_in_view(&mut self, x: f64, y: f64) -> Result<()> {
        self.head.move_in_view(x, y)
    }

    /// The speed holds where the head is as it starts: it changes as far as the map's slope does.
    fn drive(&mut self, velocity: PtzVelocity, timeout: f64) -> Result<()> {
        // To stop it must not matter whether the position can be read.
        if velocity.pan == 0.0 && velocity.tilt == 0.0 {
            return self.head.drive(velocity, timeout);
        }
        let at = self.raw_position()?;
        let raw = PtzVelocity {
            pan: raw_speed(&self.map.pan, at.pan, velocity.pan)?,
            tilt: raw_speed(&self.map.tilt, at.tilt, velocity.tilt)?,
            zoom: velocity.zoom,
        };
        self.head.drive(raw, timeout)
    }

    fn home(&mut self) -> Result<()> {
        self.head.home()
    }

    fn set_zoom(&mut self, zoom: f64) -> Result<()> {
        self.head.set_zoom(zoom)
    }

    fn set_focus(&mut self, focus: Focus) -> Result<()> {
        self.head.set_focus(focus)
    }

    fn focus(&mut self) -> Result<f64> {
        self.head.focus()
    }

    fn lock_exposure(&mut self, locked: bool) -> Result<()> {
        self.head.lock_exposure(locked)
    }

    fn store_preset(&mut self, preset: u32) -> Result<()> {
        self.head.store_preset(preset)
    }

    fn recall_preset(&mut self, preset: u32) -> Result<()> {
        self.head.recall_preset(preset)
    }

    fn clear_preset(&mut self, preset: u32) -> Result<()> {
        self.head.clear_preset(preset)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use nalgebra::DMatrix;

    use super::*;
    use crate::geometry::angle_map::Mounting;

    #[derive(Default)]
    struct Said(Mutex<Vec<String>>);

    /// A head from -1 to 1 that writes down what it is told.
    struct Raw {
        said: Arc<Said>,
        at: [f64; 2],
        raw_units: bool,
    }

    impl Raw {
        fn say(&self, what: String) -> Result<()> {
            self.said.0.lock().unwrap().push(what);
            Ok(())
        }
    }

    impl PanTiltZoom for Raw {
        fn capabilities(&self) -> PtzCapabilities {
            PtzCapabilities {
                pan_range: [-1.0, 1.0],
                tilt_range: [-0.5, 1.0],
                pan_step: 0.001,
                tilt_step: 0.002,
                max_speed: [0.5, 0.25],
                raw_units: self.raw_units,
                has_drive: true,
                presets: 3,
                ..PtzCapabilities::default()
            }
        }
        fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
            self.say(format!("to {pan:.3} {tilt:.3}"))
        }
        fn position(&mut self) -> Result<PtzPosition> {
            Ok(PtzPosition { pan: self.at[0], tilt: self.at[1], zoom: 0.25 })
        }
        fn motion(&mut self) -> Result<Motion> {
            Ok(Motion::Failed)
        }
        fn stop(&mut self) -> Result<()> {
            self.say("stop".into())
        }
        fn brake(&self) -> Option<Arc<dyn Brake>> {
            struct B(Arc<Said>);
            impl Brake for B {
                fn stop(&self) -> Result<()> {
                    self.0.0.lock().unwrap().push("brake".into());
                    Ok(())
                }
            }
            Some(Arc::new(B(self.said.clone())))
        }
        fn identity(&mut self) -> Result<Identity> {
            Ok(Identity { model: "raw".into(), ..Identity::default() })
        }
        fn move_relative(&mut self, pan: f64, tilt: f64) -> Result<()> {
            self.say(format!("by {pan:.3} {tilt:.3}"))
        }
        fn drive(&mut self, v: PtzVelocity, timeout: f64) -> Result<()> {
            self.say(format!("drive {:.3} {:.3} {:.1} {timeout}", v.pan, v.tilt, v.zoom))
        }
        fn home(&mut self) -> Result<()> {
            self.say("home".into())
        }
        fn set_zoom(&mut self, zoom: f64) -> Result<()> {
            self.say(format!("zoom {zoom}"))
        }
        fn set_focus(&mut self, focus: Focus) -> Result<()> {
            self.say(format!("focus {focus:?}"))
        }
        fn focus(&mut self) -> Result<f64> {
            Ok(0.125)
        }
        fn lock_exposure(&mut self, locked: bool) -> Result<()> {
            self.say(format!("lock {locked}"))
        }
        fn store_preset(&mut self, preset: u32) -> Result<()> {
            self.say(format!("store {preset}"))
        }
        fn recall_preset(&mut self, preset: u32) -> Result<()> {
            self.say(format!("recall {preset}"))
        }
        fn clear_preset(&mut self, preset: u32) -> Result<()> {
            self.say(format!("clear {preset}"))
        }
    }

    /// Pan = -2 raw, tilt = 0.1 + 0.4 raw.
    fn map() -> AngleMap {
        let axis = |nodes: [[f64; 2]; 2]| AxisMap::new(nodes.to_vec(), DMatrix::zeros(2, 2), 0.0).unwrap();
        let (pan, tilt) = (axis([[-1.0, 2.0], [1.0, -2.0]]), axis([[-0.5, -0.1], [1.0, 0.5]]));
        AngleMap::new(pan, tilt, Mounting::default(), [0.0; 3]).unwrap()
    }

    fn mapped(at: [f64; 2]) -> (MappedPtz, Arc<Said>) {
        let said = Arc::new(Said::default());
        let head = Raw { said: said.clone(), at, raw_units: true };
        (MappedPtz::new(Box::new(head), map()).unwrap(), said)
    }

    #[test]
    fn everything_is_passed_on_in_the_right_units() {
        let (mut head, said) = mapped([0.5, 0.25]);
        let c = head.capabilities();
        assert!(!c.raw_units && c.has_drive && c.presets == 3);
        assert_eq!(c.pan_range, [-2.0, 2.0]);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        close(c.tilt_range[0], -0.1);
        close(c.tilt_range[1], 0.5);
        close(c.pan_step, 0.002);
        close(c.tilt_step, 0.0008);
        close(c.max_speed[0], 1.0);
        close(c.max_speed[1], 0.1);
        let at = head.position().unwrap();
        close(at.pan, -1.0);
        close(at.tilt, 0.2);
        close(at.zoom, 0.25);
        head.move_absolute(1.0, 0.3).unwrap();
        head.move_relative(0.4, -0.04).unwrap();
        head.drive(PtzVelocity { pan: 0.5, tilt: -0.04, zoom: 1.0 }, 2.0).unwrap();
        head.drive(PtzVelocity::default(), 1.0).unwrap();
        head.stop().unwrap();
        head.brake().unwrap().stop().unwrap();
        head.home().unwrap();
        head.set_zoom(0.5).unwrap();
        head.set_focus(Focus::At(0.5)).unwrap();
        head.lock_exposure(true).unwrap();
        head.store_preset(0).unwrap();
        head.recall_preset(1).unwrap();
        head.clear_preset(2).unwrap();
        assert_eq!(
            *said.0.lock().unwrap(),
            [
                "to -0.500 0.500",
                "by -0.200 -0.100",
                "drive -0.250 -0.100 1.0 2",
                "drive 0.000 0.000 0.0 1",
                "stop",
                "brake",
                "home",
                "zoom 0.5",
                "focus At(0.5)",
                "lock true",
                "store 0",
                "recall 1",
                "clear 2"
            ]
        );
        assert_eq!((head.motion().unwrap(), head.focus().unwrap()), (Motion::Failed, 0.125));
        assert_eq!(head.identity().unwrap().model, "raw");
    }

    #[test]
    fn what_the_map_does_not_know_is_refused() {
        let (mut head, said) = mapped([0.5, 0.25]);
        assert!(matches!(head.move_absolute(2.1, 0.0), Err(Error::Unreachable { .. })));
        assert!(matches!(head.move_absolute(0.0, f64::NAN), Err(Error::NotFinite { .. })));
        assert!(matches!(head.move_relative(-1.5, 0.0), Err(Error::Unreachable { .. })));
        assert!(said.0.lock().unwrap().is_empty());
        // A step beyond the end is the end, further is an error; but a stop needs no position.
        assert_eq!(mapped([1.0005, -0.501]).0.position().unwrap().pan, -2.0);
        let (mut lost, _) = mapped([1.2, 0.0]);
        assert!(matches!(lost.position(), Err(Error::Device { .. })));
        assert!(lost.drive(PtzVelocity { pan: 1.0, ..PtzVelocity::default() }, 1.0).is_err());
        lost.drive(PtzVelocity::default(), 1.0).unwrap();
        assert!(mapped([f64::NAN, 0.0]).0.position().is_err());

        let plain = Raw { said: Arc::default(), at: [0.0; 2], raw_units: false };
        assert!(MappedPtz::new(Box::new(plain), map()).is_err());
        let away = AxisMap::new(vec![[2.0, 0.0], [3.0, 1.0]], DMatrix::zeros(2, 2), 0.0).unwrap();
        let head = Raw { said: Arc::default(), at: [0.0; 2], raw_units: true };
        assert!(MappedPtz::new(Box::new(head), AngleMap { pan: away, ..map() }).is_err());
    }
}
