//! First estimates: homographies, closed-form intrinsics with fall-backs, poses.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::homographies::{self, ViewHomography};
use super::views::{BoardView, Boards};
use super::zhang;
use crate::calibrate::CalibrationOptions;
use crate::calibrate::freedom::blank_distortion;
use crate::calibrate::solve::plausible;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::rigid::nearest_rotation;
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};

/// Beyond this skew prior the closed form finds skew too.
const FREE_SKEW: f64 = 0.05;
/// Median distance from its homography, as a part of the image's diagonal, of a view that may be wrong.
const SUSPICIOUS_VIEW: f64 = 0.01;

pub(crate) struct Start {
    /// In its own frame.
    pub camera: Camera,
    pub poses: Vec<Rigid>,
}

pub(crate) struct Starts<'a> {
    boards: &'a Boards,
    options: &'a CalibrationOptions,
    /// Board to pixels less the image's centre, over the image's width.
    homographies: Vec<ViewHomography>,
    /// Views that look like views of a plane; a strong lens makes others look otherwise too.
    pub plane: Vec<bool>,
}

impl<'a> Starts<'a> {
    /// # Errors
    /// `Degenerate`: a view's corners determine no homography.
    pub fn new(boards: &'a Boards, options: &'a CalibrationOptions) -> Result<Self> {
        let (w, h) = (f64::from(boards.width()), f64::from(boards.height()));
        let centre = Vector2::new((w - 1.0) * 0.5, (h - 1.0) * 0.5);
        let homographies = boards
            .views()
            .iter()
            .enumerate()
            .map(|(i, view)| {
                let pixels: Vec<_> = view.corners.iter().map(|c| (c.pixel - centre) / w).collect();
                homographies::of_view(&positions(view), &pixels, options.robust, options.seed).ok_or_else(|| {
                    let detail = format!("view {i}: the corners determine no homography");
                    Error::degenerate(Degeneracy::Collinear, detail)
                })
            })
            .collect::<Result<Vec<_>>>()?;
        let mut medians: Vec<f64> = homographies.iter().map(|h| h.median).collect();
        let middle = medians.len() / 2;
        let typical = *medians.select_nth_unstable_by(middle, f64::total_cmp).1;
        let limit = (5.0 * typical).max(SUSPICIOUS_VIEW * w.hypot(h) / w);
        let plane = homographies.iter().map(|h| h.median <= limit).collect();
        Ok(Self { boards, options, homographies, plane })
    }

    /// Cameras to begin with, the likeliest first.
    pub fn cameras(&self) -> Vec<Camera> {
        if let Some((intrinsics, distortion)) = self.options.fixed_lens {
            return vec![self.camera(intrinsics, distortion)];
        }
        let blank = blank_distortion(self.options.distortion);
        let likely = self.homographies.iter().zip(self.first()).filter(|(_, first)| *first);
        let h: Vec<Matrix3<f64>> = likely.map(|(h, _)| h.matrix).collect();
        let square = |f: f64| Intrinsics::new(f, 0.0, 0.0);
        let full = if self.options.skew_sigma > FREE_SKEW { zhang::intrinsics(&h) } else { None };
        let closed = [full, zhang::intrinsics_without_skew(&h), zhang::focal_length(&h).map(square)];
        // Tried when all else fails: from a wide to a long lens.
        let guesses = [1.0, 0.6, 1.6, 2.5, 4.0, 0.35].map(|f| Some(square(f)));
        closed
            .into_iter()
            .chain(guesses)
            .flatten()
            .map(|k| self.camera(self.forced(self.to_pixels(k)), blank))
            .filter(plausible)
            .collect()
    }

    /// Views to begin with.
    pub fn first(&self) -> Vec<bool> {
        self.plane.iter().map(|plane| *plane || !self.options.robust).collect()
    }

    /// Poses of all views under a lens, from their homographies.
    pub fn poses(&self, camera: Camera) -> Option<Start> {
        // A pinhole's homography is that of the pixels; another lens is undone first.
        let pinhole = camera.distortion.distort(Vector2::new(0.3, 0.4)) == Some(Vector2::new(0.3, 0.4));
        let to_plane = self.in_widths(&camera.intrinsics).matrix().try_inverse()?;
        let pose = |(view, h): (&BoardView, &ViewHomography)| {
            if pinhole { pose(&(to_plane * h.matrix), view) } else { pose_under(&camera, view, self.options) }
        };
        let poses: Option<Vec<Rigid>> = self.boards.views().iter().zip(&self.homographies).map(pose).collect();
        Some(Start { camera, poses: poses? })
    }

    fn camera(&self, intrinsics: Intrinsics, distortion: Distortion) -> Camera {
        let (width, height) = (self.boards.width(), self.boards.height());
        Camera { width, height, intrinsics, distortion, pose: Rigid::identity() }
    }

    fn centre(&self) -> Vector2<f64> {
        Vector2::new((f64::from(self.boards.width()) - 1.0) * 0.5, (f64::from(self.boards.height()) - 1.0) * 0.5)
    }

    fn to_pixels(&self, k: Intrinsics) -> Intrinsics {
        let (w, c) = (f64::from(self.boards.width()), self.centre());
        Intrinsics { fx: k.fx * w, fy: k.fy * w, skew: k.skew * w, cx: k.cx * w + c.x, cy: k.cy * w + c.y }
    }

    fn in_widths(&self, k: &Intrinsics) -> Intrinsics {
        let (w, c) = (f64::from(self.boards.width()), self.centre());
        Intrinsics { fx: k.fx / w, fy: k.fy / w, skew: k.skew / w, cx: (k.cx - c.x) / w, cy: (k.cy - c.y) / w }
    }

    /// What a prior of no width forces is not among the unknowns: it begins forced.
    fn forced(&self, mut k: Intrinsics) -> Intrinsics {
        if self.options.skew_sigma == 0.0 {
            k.skew = 0.0;
        }
        if self.options.aspect_sigma == 0.0 {
            let f = (k.fx * k.fy).sqrt();
            (k.fx, k.fy) = (f, f);
        }
        k
    }
}

pub(crate) fn positions(view: &BoardView) -> Vec<Vector2<f64>> {
    view.corners.iter().map(|c| c.board).collect()
}

pub(crate) fn centroid(view: &BoardView) -> Vector2<f64> {
    view.corners.iter().map(|c| c.board).sum::<Vector2<f64>>() / view.corners.len() as f64
}

/// The pose of one view under a lens, by the homography of its ideal corners.
pub(crate) fn pose_under(camera: &Camera, view: &BoardView, options: &CalibrationOptions) -> Option<Rigid> {
    let (board, ideal): (Vec<_>, Vec<_>) =
        view.corners.iter().filter_map(|c| camera.undistort_pixel(&c.pixel).map(|ideal| (c.board, ideal))).unzip();
    let h = homographies::of_view(&board, &ideal, options.robust, options.seed)?;
    pose(&h.matrix, view)
}

/// The pose whose [r1 r2 t] is nearest to a homography to the normalised plane, the board in front.
pub(crate) fn pose(h: &Matrix3<f64>, view: &BoardView) -> Option<Rigid> {
    let depth = (h * centroid(view).push(1.0)).z;
    let h = h * (2.0 / (h.column(0).norm() + h.column(1).norm())).copysign(depth);
    let (r1, r2): (Vector3<f64>, Vector3<f64>) = (h.column(0).into(), h.column(1).into());
    let rotation = nearest_rotation(&Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]))?;
    let pose = Rigid { rotation, translation: h.column(2).into() };
    pose.is_finite().then_some(pose)
}

/// The pose that looks the same from afar: the board's tilt reversed about the line of sight to its
/// middle. Weak perspective tells the two apart badly, so that a start may be the wrong one.
pub(crate) fn reversed(pose: &Rigid, view: &BoardView) -> Rigid {
    let middle = centroid(view).push(0.0);
    let place = pose.apply(&middle);
    let sight = place.normalize();
    let mirror = Matrix3::identity() - sight * sight.transpose() * 2.0;
    let rotation = mirror * pose.rotation * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
    Rigid { rotation, translation: place - rotation * middle }
}
