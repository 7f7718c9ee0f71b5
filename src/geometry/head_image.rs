//! What the rig's head camera sees of a point, with derivatives by everything that decides it: the
//! counterpart of the laser's ray in `rig_parameters.rs`.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use super::camera::Camera;
use super::rig_model::RigModel;
use super::rig_parameters::RIG_PARAMETERS;
use super::rigid::{Rigid, rotation_x, rotation_y};

/// The image of a point in the head camera, with derivatives.
#[derive(Debug, Clone)]
pub struct HeadImage {
    pub pixel: Vector2<f64>,
    /// Along the head camera's axis, metres.
    pub depth: f64,
    /// By the point in the rig's frame.
    pub by_point: Matrix2x3<f64>,
    /// By the rig's parameters; those of the laser are zero.
    pub by: [Vector2<f64>; RIG_PARAMETERS],
    /// By the device's readings.
    pub by_pan: Vector2<f64>,
    pub by_tilt: Vector2<f64>,
}

impl RigModel {
    /// Where the head camera at the given readings sees a point of the rig's frame (metres); `None`
    /// behind it and outside the lens model.
    pub fn head_image(&self, pan: f64, tilt: f64, point: &Vector3<f64>) -> Option<HeadImage> {
        let (true_pan, true_tilt) = self.true_angles(pan, tilt);
        let (back_pan, back_tilt) = (rotation_y(true_pan).transpose(), rotation_x(true_tilt).transpose());
        let (o, e, k) = (&self.offsets, &self.encoders, &self.intrinsics);
        let (at, ap) = (Vector3::new(0.0, o.tilt_y, o.tilt_z), Vector3::new(o.pan_x, 0.0, o.pan_z));
        // M = R_x^T (R_y^T (M_w + a_t + a_p) - a_p) - a_t, the rig model's equation turned round.
        let before_pan = back_pan * (point + at + ap);
        let before_tilt = back_tilt * (before_pan - ap);
        let lens = Camera {
            width: self.width,
            height: self.height,
            intrinsics: *k,
            distortion: self.distortion,
            pose: Rigid::identity(),
        };
        let x = before_tilt - at;
        let image = lens.project_with_jacobian(&x)?;
        let back = back_tilt * back_pan;
        // d R_y^T / d pan = -[e_y]x R_y^T, d R_x^T / d tilt = -[e_x]x R_x^T.
        let by_true_pan = image.by_point * (back_tilt * before_pan.cross(&Vector3::y()));
        let by_true_tilt = image.by_point * before_tilt.cross(&Vector3::x());
        let mut by = [Vector2::zeros(); RIG_PARAMETERS];
        by[4] = image.pixel - Vector2::new(k.cx, k.cy);
        (by[5], by[6]) = (Vector2::x(), Vector2::y());
        for (i, axis) in [(7, 1), (8, 2)] {
            let unit = Vector3::ith(axis, 1.0);
            by[i] = image.by_point * (back * unit - unit);
        }
        for (i, axis) in [(9, 0), (10, 2)] {
            let unit = Vector3::ith(axis, 1.0);
            by[i] = image.by_point * (back_tilt * (back_pan * unit - unit));
        }
        (by[11], by[12]) = (by_true_pan, by_true_pan * pan);
        (by[13], by[14]) = (by_true_tilt, by_true_tilt * tilt);
        Some(HeadImage {
            pixel: image.pixel,
            depth: x.z,
            by_point: image.by_point * back,
            by,
            by_pan: by_true_pan * e.pan_scale,
            by_tilt: by_true_tilt * e.tilt_scale,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::RigParameter;

    fn rig() -> RigModel {
        RigModel::crooked()
    }

    #[test]
    fn it_is_the_head_camera_image_and_its_derivatives_are_finite_differences() {
        let (pan, tilt, h) = (0.4, -0.3, 1e-6);
        let point = Vector3::new(1.3, 0.9, 2.6);
        let image = rig().head_image(pan, tilt, &point).unwrap();
        let seen = |rig: &RigModel, pan, tilt, p: &Vector3<f64>| rig.head_camera(pan, tilt).project(p).unwrap();
        assert!((image.pixel - seen(&rig(), pan, tilt, &point)).norm() < 1e-9);
        assert!((image.depth - rig().head_camera(pan, tilt).pose.apply(&point).z).abs() < 1e-12);
        let check = |analytic: Vector2<f64>, numeric: Vector2<f64>, what: &str| {
            assert!((analytic - numeric).norm() < 1e-4 * (1.0 + numeric.norm()), "{what}: {analytic} {numeric}");
        };
        for (i, by) in image.by.iter().enumerate() {
            let moved = |s: f64| {
                let mut step = [0.0; RIG_PARAMETERS];
                step[i] = s;
                seen(&rig().moved(&step), pan, tilt, &point)
            };
            check(*by, (moved(h) - moved(-h)) / (2.0 * h), RigParameter::ALL[i].name());
        }
        for i in 0..3 {
            let moved = |s: f64| seen(&rig(), pan, tilt, &(point + Vector3::ith(i, s)));
            check(image.by_point.column(i).into(), (moved(h) - moved(-h)) / (2.0 * h), "point");
        }
        let by_pan = (seen(&rig(), pan + h, tilt, &point) - seen(&rig(), pan - h, tilt, &point)) / (2.0 * h);
        let by_tilt = (seen(&rig(), pan, tilt + h, &point) - seen(&rig(), pan, tilt - h, &point)) / (2.0 * h);
        check(image.by_pan, by_pan, "pan");
        check(image.by_tilt, by_tilt, "tilt");
        assert!(rig().head_image(pan, tilt, &-point).is_none());
    }
}
