//! The pinhole camera with skew and lens distortion: projection, back-projection, derivatives.

use nalgebra::{Matrix2x3, Matrix3, Matrix3x4, SMatrix, Vector2, Vector3};

use super::distortion::{Distortion, MAX_COEFFICIENTS};
use super::line::Ray;
use super::rigid::{Rigid, skew};
use crate::error::{Error, Result};

/// Focal lengths, skew (`K[0][1]`) and principal point, in pixels; pixel (0, 0) is the centre of the
/// top-left pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intrinsics {
    pub fx: f64,
    pub fy: f64,
    pub skew: f64,
    pub cx: f64,
    pub cy: f64,
}

impl Intrinsics {
    pub const COUNT: usize = 5;

    /// Square pixels, no skew.
    pub fn new(f: f64, cx: f64, cy: f64) -> Self {
        Self { fx: f, fy: f, skew: 0.0, cx, cy }
    }

    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx, self.skew, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }

    /// Normalised plane to pixels.
    pub fn to_pixel(&self, p: &Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.fx * p.x + self.skew * p.y + self.cx, self.fy * p.y + self.cy)
    }

    /// Pixels to normalised plane.
    pub fn to_normalised(&self, pixel: &Vector2<f64>) -> Vector2<f64> {
        let y = (pixel.y - self.cy) / self.fy;
        Vector2::new((pixel.x - self.cx - self.skew * y) / self.fx, y)
    }

    pub fn to_array(&self) -> [f64; 5] {
        [self.fx, self.fy, self.skew, self.cx, self.cy]
    }

    pub fn from_array(a: [f64; 5]) -> Self {
        Self { fx: a[0], fy: a[1], skew: a[2], cx: a[3], cy: a[4] }
    }
}

/// A calibrated camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Image size in pixels.
    pub width: u32,
    pub height: u32,
    pub intrinsics: Intrinsics,
    pub distortion: Distortion,
    /// World to camera.
    pub pose: Rigid,
}

/// Derivatives of a projected pixel.
pub struct Projection {
    pub pixel: Vector2<f64>,
    /// By fx, fy, skew, cx, cy.
    pub by_intrinsics: SMatrix<f64, 2, 5>,
    /// By the distortion's coefficients, in their order; the columns past their number are zero.
    pub by_distortion: SMatrix<f64, 2, MAX_COEFFICIENTS>,
    /// By w in `R <- exp([w]x) R`, a small turn about the camera's own axes (centre kept).
    pub by_rotation: Matrix2x3<f64>,
    /// By the camera's centre in the world frame.
    pub by_centre: Matrix2x3<f64>,
    /// By the world point.
    pub by_point: Matrix2x3<f64>,
    /// By the homogeneous point's fourth coordinate.
    pub by_weight: Vector2<f64>,
}

impl Camera {
    /// Checks sizes, finiteness, positive focal lengths and that the pose is a rotation.
    pub fn validate(&self) -> Result<()> {
        let k = &self.intrinsics;
        if self.width == 0 || self.height == 0 || self.width > 1 << 16 || self.height > 1 << 16 {
            return Err(Error::invalid("camera", format!("image size {} x {}", self.width, self.height)));
        }
        if let Some(index) = k.to_array().iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "intrinsics", index });
        }
        if k.fx <= 0.0 || k.fy <= 0.0 {
            return Err(Error::invalid("intrinsics", format!("focal length {} x {} is not positive", k.fx, k.fy)));
        }
        if let Some(index) = self.distortion.coefficients().iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "distortion", index });
        }
        if !self.pose.is_finite() {
            return Err(Error::NotFinite { name: "pose", index: 0 });
        }
        let defect = super::rigid::rotation_defect(&self.pose.rotation);
        if defect > 1e-6 {
            return Err(Error::invalid("pose", format!("not a rotation: R R^T - I has an entry of {defect:.2e}")));
        }
        Ok(())
    }

    /// Camera centre in the world frame, -R^T t.
    pub fn centre(&self) -> Vector3<f64> {
        self.pose.centre()
    }

    /// The 3x4 matrix K [R | t] of eq. (1); lens distortion is not in it.
    pub fn projection_matrix(&self) -> Matrix3x4<f64> {
        let k = self.intrinsics.matrix();
        let mut p = Matrix3x4::zeros();
        p.fixed_view_mut::<3, 3>(0, 0).copy_from(&(k * self.pose.rotation));
        p.set_column(3, &(k * self.pose.translation));
        p
    }

    /// Pixel of a world point; `None` behind the camera or outside the lens model.
    pub fn project(&self, world: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.project_camera_point(&self.pose.apply(world))
    }

    /// Pixel of a point in the camera frame.
    pub fn project_camera_point(&self, x: &Vector3<f64>) -> Option<Vector2<f64>> {
        let pixel = self.intrinsics.to_pixel(&self.distortion.image(x)?);
        (pixel.x.is_finite() && pixel.y.is_finite()).then_some(pixel)
    }

    /// Like [`project`](Self::project), with derivatives by everything.
    pub fn project_with_jacobian(&self, world: &Vector3<f64>) -> Option<Projection> {
        self.project_homogeneous(world, 1.0)
    }

    /// Projects the homogeneous point (xyz; weight), of the scale that keeps xyz in its own direction
    /// (points in front of the camera at positive depth). Weights at or below zero are points at or
    /// beyond infinity, as noisy inverse depths give them.
    pub fn project_homogeneous(&self, xyz: &Vector3<f64>, weight: f64) -> Option<Projection> {
        let x = self.pose.rotation * xyz + self.pose.translation * weight;
        let d = self.distortion.image_with_jacobian(&x)?;
        let k = &self.intrinsics;
        let k2 = nalgebra::Matrix2::new(k.fx, k.skew, 0.0, k.fy);
        let by_x = k2 * d.by_direction;
        let mut by_distortion = SMatrix::<f64, 2, MAX_COEFFICIENTS>::zeros();
        for (i, column) in d.by_coefficient.iter().enumerate() {
            by_distortion.set_column(i, &(k2 * column));
        }
        let (u, v) = (d.point.x, d.point.y);
        let by_point = by_x * self.pose.rotation;
        Some(Projection {
            pixel: k.to_pixel(&d.point),
            by_intrinsics: SMatrix::<f64, 2, 5>::new(u, 0.0, v, 1.0, 0.0, 0.0, v, 0.0, 0.0, 1.0),
            by_distortion,
            by_rotation: -(by_x * skew(&x)),
            by_centre: by_point * -weight,
            by_point,
            by_weight: by_x * self.pose.translation,
        })
    }

    /// Ideal (undistorted) position on the normalised plane of a pixel; `None` also from 90 degrees on.
    pub fn undistort_pixel(&self, pixel: &Vector2<f64>) -> Option<Vector2<f64>> {
        let p = self.distortion.undistort(self.intrinsics.to_normalised(pixel))?;
        (p.x.is_finite() && p.y.is_finite()).then_some(p)
    }

    /// The ray through a pixel, in the world frame, from the camera's centre.
    pub fn back_project(&self, pixel: &Vector2<f64>) -> Option<Ray> {
        let direction = self.distortion.direction(&self.intrinsics.to_normalised(pixel))?;
        let direction = self.pose.rotation.transpose() * direction;
        direction.iter().all(|v| v.is_finite()).then(|| Ray { origin: self.centre(), direction })
    }

    /// Is the pixel inside the image (its border included)?
    pub fn contains(&self, pixel: &Vector2<f64>) -> bool {
        pixel.x >= -0.5 && pixel.y >= -0.5 && pixel.x <= self.width as f64 - 0.5 && pixel.y <= self.height as f64 - 0.5
    }

    /// Refuses a lens that folds back inside the image: every pixel on the border must have its ray
    /// on the monotone part of the lens, with a positive Jacobian there. The image circle of a fisheye
    /// lens may end inside the image, but not before 90 degrees from the axis.
    pub fn check_lens(&self) -> Result<()> {
        let (w, h) = (self.width as f64 - 1.0, self.height as f64 - 1.0);
        const STEPS: usize = 16;
        let may_end_early = matches!(self.distortion, Distortion::Fisheye(_));
        let limit = self.distortion.monotone_radius();
        for i in 0..=STEPS {
            let s = i as f64 / STEPS as f64;
            for pixel in
                [Vector2::new(s * w, 0.0), Vector2::new(s * w, h), Vector2::new(0.0, s * h), Vector2::new(w, s * h)]
            {
                let ok = match self.distortion.direction(&self.intrinsics.to_normalised(&pixel)) {
                    None => may_end_early && limit.is_infinite(),
                    Some(x) => self.grows_at(&x),
                };
                if !ok {
                    let centre = Vector2::new(self.intrinsics.cx, self.intrinsics.cy);
                    return Err(Error::LensNotMonotone { radius_px: (pixel - centre).norm() });
                }
            }
        }
        Ok(())
    }

    /// Is the lens orientation-preserving where it images the direction `x`, and before its fold?
    fn grows_at(&self, x: &Vector3<f64>) -> bool {
        if matches!(self.distortion, Distortion::Fisheye(_)) {
            // Has a direction only where it grows.
            return true;
        }
        let p = x.xy() / x.z;
        p.norm() <= self.distortion.monotone_radius()
            && self
                .distortion
                .distort_with_jacobian(p)
                .is_some_and(|d| d.by_point.determinant() > 0.0 && d.by_point.trace() > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rigid::exp;

    fn camera(distortion: Distortion) -> Camera {
        Camera {
            width: 800,
            height: 600,
            intrinsics: Intrinsics { fx: 845.19, fy: 844.56, skew: 0.7, cx: 427.76, cy: 285.53 },
            distortion,
            pose: Rigid { rotation: exp(&Vector3::new(0.05, -0.2, 0.1)), translation: Vector3::new(0.1, -0.05, 0.3) },
        }
    }

    fn lenses() -> [Distortion; 4] {
        [
            Distortion::None,
            Distortion::BrownConrady([-0.28, 0.09, 0.001, -0.002, 0.01]),
            Distortion::Division(-0.2),
            Distortion::Fisheye([-0.012, 0.02, -0.017, 0.0035]),
        ]
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let x = Vector3::new(0.4, -0.3, 2.5);
        for lens in lenses() {
            let camera = camera(lens);
            let p = camera.project_with_jacobian(&x).unwrap();
            assert!((p.pixel - camera.project(&x).unwrap()).norm() < 1e-12);
            let h = 1e-6;
            let check = |name: &str, analytic: Vector2<f64>, f: &dyn Fn(f64) -> Camera, dx: Vector3<f64>| {
                let plus = f(h).project(&(x + dx * h)).unwrap();
                let minus = f(-h).project(&(x - dx * h)).unwrap();
                let numeric = (plus - minus) / (2.0 * h);
                assert!((analytic - numeric).norm() < 1e-5 * (1.0 + numeric.norm()), "{name}: {analytic} {numeric}");
            };
            for i in 0..5 {
                let step = |s: f64| {
                    let mut a = camera.intrinsics.to_array();
                    a[i] += s;
                    Camera { intrinsics: Intrinsics::from_array(a), ..camera }
                };
                check("intrinsics", p.by_intrinsics.column(i).into(), &step, Vector3::zeros());
            }
            for i in 0..lens.coefficients().len() {
                let step = |s: f64| {
                    let mut c = camera;
                    c.distortion.coefficients_mut()[i] += s;
                    c
                };
                check("distortion", p.by_distortion.column(i).into(), &step, Vector3::zeros());
            }
            for i in 0..3 {
                let e = Vector3::ith(i, 1.0);
                let turn = |s: f64| {
                    let pose = Rigid::from_centre(exp(&(e * s)) * camera.pose.rotation, &camera.centre());
                    Camera { pose, ..camera }
                };
                check("rotation", p.by_rotation.column(i).into(), &turn, Vector3::zeros());
                let shift = |s: f64| {
                    let pose = Rigid::from_centre(camera.pose.rotation, &(camera.centre() + e * s));
                    Camera { pose, ..camera }
                };
                check("centre", p.by_centre.column(i).into(), &shift, Vector3::zeros());
                check("point", p.by_point.column(i).into(), &|_| camera, e);
            }
        }
    }

    #[test]
    fn a_dome_camera_sees_beside_and_behind_its_image_plane() {
        let lens = Distortion::Fisheye([-0.012, 0.02, -0.017, 0.0035]);
        let dome = Camera { intrinsics: Intrinsics::new(340.0, 399.5, 299.5), ..camera(lens) };
        for beyond in [Vector3::new(1.0, 0.4, 0.0), Vector3::new(-1.0, 0.4, -0.15)] {
            let x = dome.pose.inverse().apply(&beyond);
            let p = dome.project_with_jacobian(&x).unwrap();
            let ray = dome.back_project(&p.pixel).unwrap();
            assert!((ray.at(beyond.norm()) - x).norm() < 1e-9);
            assert!(dome.undistort_pixel(&p.pixel).is_none());
            let h = 1e-6;
            for i in 0..3 {
                let e = Vector3::ith(i, h);
                let numeric = (dome.project(&(x + e)).unwrap() - dome.project(&(x - e)).unwrap()) / (2.0 * h);
                assert!((p.by_point.column(i) - numeric).norm() < 1e-5 * (1.0 + numeric.norm()));
            }
            // The same direction at infinity, and beyond.
            for weight in [1.0, 0.0, -0.01] {
                let h = dome.project_homogeneous(&(x - dome.centre() * (1.0 - weight)), weight).unwrap();
                assert!((h.pixel - p.pixel).norm() < 1e-9, "{weight}");
            }
        }
    }

    #[test]
    fn homogeneous_points_project_alike_and_reach_beyond_infinity() {
        let camera = camera(Distortion::Division(-0.1));
        let x = Vector3::new(0.4, -0.3, 2.5);
        let p = camera.project_homogeneous(&(x * 0.3), 0.3).unwrap();
        assert!((p.pixel - camera.project(&x).unwrap()).norm() < 1e-10);
        for weight in [0.3, 0.0, -0.01] {
            let at = |w: f64| camera.project_homogeneous(&(x * 0.3), w).unwrap();
            let numeric = (at(weight + 1e-7).pixel - at(weight - 1e-7).pixel) / 2e-7;
            assert!((at(weight).by_weight - numeric).norm() < 1e-5 * (1.0 + numeric.norm()));
        }
    }

    #[test]
    fn back_projection_inverts_projection() {
        for lens in lenses() {
            let camera = camera(lens);
            for pixel in [Vector2::new(0.0, 0.0), Vector2::new(799.0, 599.0), Vector2::new(312.5, 77.25)] {
                let ray = camera.back_project(&pixel).unwrap();
                let again = camera.project(&ray.at(3.0)).unwrap();
                assert!((again - pixel).norm() < 1e-8, "{lens:?} {again}");
            }
        }
    }

    #[test]
    fn projection_matrix_agrees_with_project() {
        let camera = camera(Distortion::None);
        let x = Vector3::new(0.4, -0.3, 2.5);
        let h = camera.projection_matrix() * x.push(1.0);
        assert!((h.xy() / h.z - camera.project(&x).unwrap()).norm() < 1e-10);
    }

    #[test]
    fn behind_the_camera_has_no_image() {
        let camera = camera(Distortion::None);
        let behind = camera.pose.inverse().apply(&Vector3::new(0.0, 0.0, -1.0));
        assert!(camera.project(&behind).is_none());
        assert!(camera.project(&camera.centre()).is_none());
        assert!(camera.project(&Vector3::new(f64::NAN, 0.0, 1.0)).is_none());
    }

    #[test]
    fn a_lens_that_folds_inside_the_image_is_refused() {
        assert!(camera(Distortion::BrownConrady([-0.28, 0.09, 0.0, 0.0, 0.0])).check_lens().is_ok());
        // Folds at r = sqrt(1 / 1.8) = 0.745; the far corner is at 0.66 distorted, the fold at 0.497.
        let e = camera(Distortion::BrownConrady([-0.6, 0.0, 0.0, 0.0, 0.0])).check_lens().unwrap_err();
        assert!(matches!(e, Error::LensNotMonotone { .. }));
        assert!(camera(Distortion::Division(-0.2)).check_lens().is_ok());
        assert!(camera(Distortion::Division(-6.0)).check_lens().is_err());
        // A fisheye lens that folds at 1.18 rad, 498 px, inside the image.
        let fisheye = |k1, f| {
            let lens = camera(Distortion::Fisheye([k1, 0.0, 0.0, 0.0]));
            Camera { intrinsics: Intrinsics::new(f, 399.5, 299.5), ..lens }.check_lens()
        };
        assert!(matches!(fisheye(-0.24, 500.0), Err(Error::LensNotMonotone { .. })));
        assert!(fisheye(-0.1, 500.0).is_ok());
        // An image circle of 180 degrees inside the image, and a fold beyond 90 degrees in the dark.
        assert!(fisheye(0.0, 150.0).is_ok() && fisheye(-0.1, 190.0).is_ok());
    }

    #[test]
    fn validate_names_the_fault() {
        let mut c = camera(Distortion::None);
        c.intrinsics.fx = -1.0;
        assert!(matches!(c.validate(), Err(Error::InvalidArgument { name: "intrinsics", .. })));
        let mut c = camera(Distortion::None);
        c.pose.rotation *= 1.1;
        assert!(matches!(c.validate(), Err(Error::InvalidArgument { name: "pose", .. })));
        let mut c = camera(Distortion::BrownConrady([0.0; 5]));
        c.distortion.coefficients_mut()[3] = f64::NAN;
        assert_eq!(c.validate(), Err(Error::NotFinite { name: "distortion", index: 3 }));
    }
}
