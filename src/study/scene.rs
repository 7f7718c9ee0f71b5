//! What the laser's light falls on: an assumption about a place before it is scanned, or a model of it.

use nalgebra::Vector3;

use crate::error::{Error, Result};
use crate::geometry::{Plane, Ray};

/// Most boxes in a room.
const MAX_BOXES: usize = 10_000;

/// Surfaces in the rig's frame, metres.
#[derive(Debug, Clone, PartialEq)]
pub enum Scene {
    /// One plane: a wall, a floor.
    Plane(Plane),
    /// A room seen from inside, with boxes in it that also hide what is behind them; [low, high] corners.
    Room { room: [Vector3<f64>; 2], boxes: Vec<[Vector3<f64>; 2]> },
    /// Nothing known but the depths (along the head's axis) that occur: every position gets one
    /// between them, evenly in inverse depth, neighbours different ones. Nothing is hidden.
    Depths { nearest: f64, farthest: f64 },
}

impl Scene {
    /// # Errors
    /// `NotFinite`, `InvalidArgument`: corners in the wrong order, depths that are none.
    pub fn validate(&self) -> Result<()> {
        let finite = |values: &[f64]| match values.iter().position(|v| !v.is_finite()) {
            Some(index) => Err(Error::NotFinite { name: "scene", index }),
            None => Ok(()),
        };
        match self {
            Self::Plane(plane) => {
                finite(plane.normal.as_slice())?;
                finite(&[plane.distance])?;
                if (plane.normal.norm() - 1.0).abs() > 1e-6 {
                    return Err(Error::invalid("scene", "the plane's normal is not of unit length"));
                }
            }
            Self::Room { room, boxes } => {
                if boxes.len() > MAX_BOXES {
                    return Err(Error::invalid("scene", format!("{} boxes; {MAX_BOXES} are possible", boxes.len())));
                }
                for [low, high] in boxes.iter().chain([room]) {
                    finite(low.as_slice())?;
                    finite(high.as_slice())?;
                    if (0..3).any(|i| low[i] >= high[i]) {
                        return Err(Error::invalid(
                            "scene",
                            "a corner's coordinates are not the lower ones: low, high",
                        ));
                    }
                }
            }
            Self::Depths { nearest, farthest } => {
                finite(&[*nearest, *farthest])?;
                if *nearest <= 0.0 || farthest < nearest {
                    return Err(Error::invalid("scene", format!("depths from {nearest} to {farthest} m")));
                }
            }
        }
        Ok(())
    }

    /// Depth Z of the first surface on the laser's line o + Z d; `index` numbers the positions.
    pub fn depth(&self, origin: &Vector3<f64>, direction: &Vector3<f64>, index: usize) -> Option<f64> {
        let depth = match self {
            Self::Plane(plane) => {
                let ray = Ray { origin: *origin, direction: *direction };
                (plane.intersect_ray(&ray)? - origin).dot(direction) / direction.norm_squared()
            }
            Self::Room { room, boxes } => {
                let wall = slab(room, origin, direction).1;
                boxes
                    .iter()
                    .map(|b| slab(b, origin, direction))
                    .filter(|(enter, leave)| enter < leave && *enter > 0.0)
                    .fold(wall, |depth, (enter, _)| depth.min(enter))
            }
            Self::Depths { nearest, farthest } => {
                let s = van_der_corput(index);
                1.0 / ((1.0 - s) / nearest + s / farthest)
            }
        };
        (depth > 0.0 && depth.is_finite()).then_some(depth)
    }

    /// Does something stand between a camera's centre and a point on a surface?
    pub fn hides(&self, centre: &Vector3<f64>, point: &Vector3<f64>) -> bool {
        /// The point's own surface does not hide it.
        const BEFORE: f64 = 1.0 - 1e-9;
        match self {
            Self::Plane(_) | Self::Depths { .. } => false,
            Self::Room { room, boxes } => {
                let way = point - centre;
                let (enter, leave) = slab(room, centre, &way);
                // From outside the room its wall is in between.
                enter > 0.0
                    || leave < BEFORE
                    || boxes
                        .iter()
                        .map(|b| slab(b, centre, &way))
                        .any(|(enter, leave)| enter < leave && leave > 0.0 && enter < BEFORE)
            }
        }
    }
}

/// Where a line enters and leaves a box.
fn slab([low, high]: &[Vector3<f64>; 2], origin: &Vector3<f64>, direction: &Vector3<f64>) -> (f64, f64) {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for i in 0..3 {
        let (a, b) = ((low[i] - origin[i]) / direction[i], (high[i] - origin[i]) / direction[i]);
        // Along a face that it lies in, a line has no limit: 0 / 0.
        if !(a.is_nan() || b.is_nan()) {
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
    }
    (enter, leave)
}

/// Evenly spread in [0, 1) from the first number on: an index's bits behind the point, reversed.
fn van_der_corput(index: usize) -> f64 {
    (index as u64).reverse_bits() as f64 / 2f64.powi(64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room() -> Scene {
        let boxes = vec![[Vector3::new(-0.5, -0.5, 2.0), Vector3::new(0.5, 0.5, 2.5)]];
        Scene::Room { room: [Vector3::new(-2.0, -2.0, -1.0), Vector3::new(2.0, 2.0, 5.0)], boxes }
    }

    #[test]
    fn the_first_surface_gives_the_depth_and_hides_what_is_behind() {
        let (origin, ahead) = (Vector3::zeros(), Vector3::z());
        assert_eq!(room().depth(&origin, &ahead, 0), Some(2.0));
        let beside = Vector3::new(0.3, 0.0, 1.0);
        assert_eq!(room().depth(&origin, &beside, 0), Some(5.0));
        let seen = Vector3::new(0.4, 0.0, 2.0);
        assert!(!room().hides(&origin, &seen));
        assert!(room().hides(&Vector3::new(0.0, 0.0, 4.0), &seen));
        assert!(room().hides(&Vector3::new(3.0, 0.0, 2.0), &Vector3::new(-2.0, 1.5, 2.0)));
        let wall = Scene::Plane(Plane { normal: Vector3::z(), distance: 3.0 });
        assert_eq!(wall.depth(&origin, &Vector3::new(0.1, 0.2, 1.0), 0), Some(3.0));
        assert_eq!(wall.depth(&origin, &Vector3::x(), 0), None);
        assert_eq!(wall.depth(&origin, &-ahead, 0), None);
    }

    #[test]
    fn depths_fill_their_range() {
        let scene = Scene::Depths { nearest: 1.0, farthest: 4.0 };
        let mut inverse: Vec<f64> =
            (0..64).map(|i| 1.0 / scene.depth(&Vector3::zeros(), &Vector3::z(), i).unwrap()).collect();
        inverse.sort_by(f64::total_cmp);
        assert!(inverse.windows(2).all(|w| (w[1] - w[0] - 0.75 / 64.0).abs() < 1e-12));
        assert!(inverse[0] > 0.25 && inverse[63] <= 1.0);
    }

    #[test]
    fn impossible_scenes_are_refused() {
        let plane = |normal, distance| Scene::Plane(Plane { normal, distance });
        let depths = |nearest, farthest| Scene::Depths { nearest, farthest };
        let corners =
            |low: f64, high: f64| Scene::Room { room: [Vector3::repeat(low), Vector3::repeat(high)], boxes: vec![] };
        for scene in [
            plane(Vector3::zeros(), 1.0),
            plane(Vector3::new(f64::NAN, 0.0, 1.0), 1.0),
            plane(Vector3::z(), f64::INFINITY),
            depths(0.0, 1.0),
            depths(-1.0, 1.0),
            depths(3.0, 2.0),
            depths(1.0, f64::NAN),
            corners(1.0, -1.0),
            corners(f64::NAN, 1.0),
            Scene::Room { room: [Vector3::repeat(-1.0), Vector3::repeat(1.0)], boxes: vec![[Vector3::zeros(); 2]] },
        ] {
            assert!(scene.validate().is_err(), "{scene:?}");
        }
        assert!(room().validate().is_ok() && depths(1.0, 1.0).validate().is_ok());
    }
}
