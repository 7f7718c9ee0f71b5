//! What one corner and one laser spot measure: predicted pixels with their derivatives by everything.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::calibrate::freedom::{DISTORTION, ROTATION};
use crate::geometry::rig_model::LaserLine;
use crate::geometry::rigid::exp;
use crate::geometry::{Camera, Rigid};

/// Parameters that all views share: fx fy skew cx cy and the distortion as in `refine`, then the
/// sheet's three coefficients, then the laser's x0 y0 vx vy.
pub(crate) const BEND: usize = ROTATION;
pub(crate) const LASER: usize = BEND + 3;
pub(crate) const GLOBALS: usize = LASER + 4;
/// Parameters of a view: w in R <- exp([w]x) R, then the camera's centre in the board's frame.
pub(crate) const POSE: usize = 6;

/// A smoothly bent board: z = sum of coefficients times the monomials of the scaled position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sheet {
    pub centre: Vector2<f64>,
    pub scale: f64,
}

impl Sheet {
    pub fn monomials(&self, p: &Vector2<f64>) -> Vector3<f64> {
        let q = (p - self.centre) / self.scale;
        Vector3::new(q.x * q.x, q.x * q.y, q.y * q.y)
    }

    /// Slopes dz/dx and dz/dy.
    fn slopes(&self, bend: &Vector3<f64>, p: &Vector2<f64>) -> Vector2<f64> {
        let q = (p - self.centre) / self.scale;
        Vector2::new(2.0 * bend.x * q.x + bend.y * q.y, bend.y * q.x + 2.0 * bend.z * q.y) / self.scale
    }

    /// The corner's place in the board's frame.
    pub fn point(&self, bend: &Vector3<f64>, p: &Vector2<f64>) -> Vector3<f64> {
        Vector3::new(p.x, p.y, bend.dot(&self.monomials(p)))
    }
}

/// All that is estimated.
#[derive(Debug, Clone)]
pub(crate) struct State {
    /// Its pose is the identity: the frame is the camera's.
    pub camera: Camera,
    pub bend: Vector3<f64>,
    pub laser: LaserLine,
    /// Board to camera, one for each view.
    pub poses: Vec<Rigid>,
}

impl State {
    pub fn globals(&self) -> [f64; GLOBALS] {
        let mut p = [0.0; GLOBALS];
        p[..DISTORTION].copy_from_slice(&self.camera.intrinsics.to_array());
        for (to, from) in p[DISTORTION..ROTATION].iter_mut().zip(self.camera.distortion.coefficients()) {
            *to = *from;
        }
        p[BEND..LASER].copy_from_slice(self.bend.as_slice());
        let l = &self.laser;
        p[LASER..].copy_from_slice(&[l.x0, l.y0, l.vx, l.vy]);
        p
    }

    /// Moved by a change of the shared parameters; `None` when a focal length would not be positive.
    pub fn moved(&self, change: &[f64; GLOBALS]) -> Option<Self> {
        let mut next = self.clone();
        let k = self.camera.intrinsics.to_array();
        next.camera.intrinsics = crate::geometry::Intrinsics::from_array(std::array::from_fn(|i| k[i] + change[i]));
        for (k, c) in next.camera.distortion.coefficients_mut().iter_mut().zip(&change[DISTORTION..ROTATION]) {
            *k += c;
        }
        next.bend += Vector3::from_column_slice(&change[BEND..LASER]);
        let l = &mut next.laser;
        for (value, c) in [&mut l.x0, &mut l.y0, &mut l.vx, &mut l.vy].into_iter().zip(&change[LASER..]) {
            *value += c;
        }
        (next.camera.intrinsics.fx > 0.0 && next.camera.intrinsics.fy > 0.0).then_some(next)
    }
}

/// The pose after a step; `None` for a turn of more than a quarter, which is never a good one.
pub(crate) fn moved_pose(pose: &Rigid, step: &[f64; POSE]) -> Option<Rigid> {
    let turn = Vector3::new(step[0], step[1], step[2]);
    let centre = pose.centre() + Vector3::new(step[3], step[4], step[5]);
    (turn.norm() < 1.5).then(|| Rigid::from_centre(exp(&turn) * pose.rotation, &centre))
}

/// A laser spot's predicted pixel with its derivatives by the view's pose and by the shared parameters.
pub(crate) struct Prediction {
    pub pixel: Vector2<f64>,
    pub by_pose: [Vector2<f64>; POSE],
    pub by_globals: [Vector2<f64>; GLOBALS],
}

/// Where the laser meets a board.
pub(crate) struct Meeting {
    /// In the camera's frame.
    pub point: Vector3<f64>,
    /// The sheet's normal there, in the camera's frame and in the board's (z = 1 before its slopes).
    normal: Vector3<f64>,
    board_normal: Vector3<f64>,
    /// normal . (vx, vy, 1).
    slope: f64,
    monomials: Vector3<f64>,
}

/// `None` when the laser runs along the board or meets it behind the camera.
pub(crate) fn meet(laser: &LaserLine, pose: &Rigid, sheet: &Sheet, bend: &Vector3<f64>) -> Option<Meeting> {
    let origin = Vector3::new(laser.x0, laser.y0, 0.0);
    let v = Vector3::new(laser.vx, laser.vy, 1.0);
    let mut board_normal = Vector3::z();
    let mut normal: Vector3<f64> = pose.rotation.column(2).into();
    let mut z = normal.dot(&(pose.translation - origin)) / normal.dot(&v);
    let back: Matrix3<f64> = pose.rotation.transpose();
    let mut monomials = Vector3::zeros();
    if *bend != Vector3::zeros() {
        // Newton on the height above the sheet: it is quadratic and nearly flat.
        for _ in 0..8 {
            let at = back * (origin + v * z - pose.translation);
            monomials = sheet.monomials(&at.xy());
            let slopes = sheet.slopes(bend, &at.xy());
            board_normal = Vector3::new(-slopes.x, -slopes.y, 1.0);
            normal = pose.rotation * board_normal;
            z -= (at.z - bend.dot(&monomials)) / normal.dot(&v);
        }
    } else {
        monomials = sheet.monomials(&(back * (origin + v * z - pose.translation)).xy());
    }
    let slope = normal.dot(&v);
    let met = slope.abs() > 1e-9 * v.norm() && z.is_finite() && z > 0.0;
    met.then(|| Meeting { point: origin + v * z, normal, board_normal, slope, monomials })
}

/// The pixel of the laser's spot on the board at `pose`; the state's camera stands in its own frame.
pub(crate) fn spot(state: &State, sheet: &Sheet, pose: &Rigid) -> Option<Prediction> {
    let met = meet(&state.laser, pose, sheet, &state.bend)?;
    let p = state.camera.project_with_jacobian(&met.point)?;
    let along: Vector2<f64> = p.by_point * Vector3::new(state.laser.vx, state.laser.vy, 1.0);
    // The height above the sheet stays 0: depth moves by -(its change) / slope.
    let by_height = |change: f64| along * (-change / met.slope);
    let by_turn = met.normal.cross(&met.point);
    let z = met.point.z;
    Some(Prediction {
        pixel: p.pixel,
        by_pose: std::array::from_fn(|i| by_height(if i < 3 { by_turn[i] } else { met.board_normal[i - 3] })),
        by_globals: std::array::from_fn(|i| match i {
            0..DISTORTION => p.by_intrinsics.column(i).into(),
            DISTORTION..ROTATION => p.by_distortion.column(i - DISTORTION).into(),
            BEND..LASER => by_height(-met.monomials[i - BEND]),
            _ => {
                let (axis, lever) = ((i - LASER) % 2, if i - LASER < 2 { 1.0 } else { z });
                let own: Vector2<f64> = p.by_point.column(axis).into();
                own * lever + by_height(lever * met.normal[axis])
            }
        }),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Distortion, Intrinsics};

    fn state() -> State {
        let camera = Camera {
            width: 720,
            height: 576,
            intrinsics: Intrinsics { fx: 800.0, fy: 795.0, skew: 0.7, cx: 360.0, cy: 288.0 },
            distortion: Distortion::BrownConrady([-0.2, 0.05, 0.001, -0.002, 0.01]),
            pose: Rigid::identity(),
        };
        let pose = Rigid { rotation: exp(&Vector3::new(0.4, -0.5, 0.2)), translation: Vector3::new(0.1, -0.05, 2.0) };
        State {
            camera,
            bend: Vector3::new(0.004, -0.003, 0.002),
            laser: LaserLine { x0: 0.1, y0: 0.005, vx: -0.005, vy: 0.003 },
            poses: vec![pose],
        }
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let sheet = Sheet { centre: Vector2::new(0.02, -0.01), scale: 0.3 };
        let (s, h) = (state(), 1e-6);
        let exact = spot(&s, &sheet, &s.poses[0]).unwrap();
        for i in 0..GLOBALS {
            let at = |h: f64| {
                let mut change = [0.0; GLOBALS];
                change[i] = h;
                spot(&s.moved(&change).unwrap(), &sheet, &s.poses[0]).unwrap().pixel
            };
            let numeric = (at(h) - at(-h)) / (2.0 * h);
            assert!((numeric - exact.by_globals[i]).norm() < 1e-5 * (1.0 + numeric.norm()), "global {i}");
        }
        for i in 0..POSE {
            let at = |h: f64| {
                let mut step = [0.0; POSE];
                step[i] = h;
                spot(&s, &sheet, &moved_pose(&s.poses[0], &step).unwrap()).unwrap().pixel
            };
            let numeric = (at(h) - at(-h)) / (2.0 * h);
            assert!((numeric - exact.by_pose[i]).norm() < 1e-5 * (1.0 + numeric.norm()), "pose {i}");
        }
    }

    #[test]
    fn a_laser_along_the_board_does_not_meet_it() {
        let sheet = Sheet { centre: Vector2::zeros(), scale: 1.0 };
        let along =
            Rigid { rotation: crate::geometry::rigid::rotation_y(std::f64::consts::FRAC_PI_2), ..state().poses[0] };
        let straight = LaserLine { x0: 0.1, y0: 0.0, vx: 0.0, vy: 0.0 };
        assert!(meet(&straight, &along, &sheet, &Vector3::zeros()).is_none());
        let behind = Rigid { translation: Vector3::new(0.0, 0.0, -1.0), ..Rigid::identity() };
        assert!(meet(&straight, &behind, &sheet, &Vector3::zeros()).is_none());
    }
}
