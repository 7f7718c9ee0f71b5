//! The fisheye model (Kannala, Brandt 2006) with OpenCV's meaning: a ray at the angle theta from the
//! axis is imaged at the radius theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
//! It works on rays, not on the normalised plane, so that it reaches 90 degrees and beyond.

use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};

use super::roots::smallest_positive_root;
use super::{Image, MAX_COEFFICIENTS};

type Coefficients = [f64; 4];

/// theta_d and its derivative by theta.
fn radius([k1, k2, k3, k4]: &Coefficients, theta: f64) -> (f64, f64) {
    let s = theta * theta;
    let value = 1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4)));
    let slope = 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4)));
    (theta * value, slope)
}

/// The angle up to which theta_d grows, at most pi.
pub(super) fn monotone_angle([k1, k2, k3, k4]: &Coefficients) -> f64 {
    let fold = smallest_positive_root(&[1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4]);
    fold.map_or(std::f64::consts::PI, |s| s.sqrt().min(std::f64::consts::PI))
}

/// Does theta_d grow all the way to `theta`? The slope's falling terms alone settle most cases.
fn grows_to(k: &Coefficients, theta: f64) -> bool {
    let s = theta * theta;
    let least = 1.0
        + s * (3.0 * k[0].min(0.0) + s * (5.0 * k[1].min(0.0) + s * (7.0 * k[2].min(0.0) + s * 9.0 * k[3].min(0.0))));
    theta < std::f64::consts::PI && (least > 0.0 || theta < monotone_angle(k))
}

/// Image of the direction `x` (any length); `None` beyond the angle up to which the lens grows.
pub(super) fn image(k: &Coefficients, x: &Vector3<f64>) -> Option<Image> {
    let (xy, z) = (x.xy(), x.z);
    let rho = xy.norm();
    let squared = x.norm_squared();
    let theta = rho.atan2(z);
    if squared.is_nan() || squared < super::MIN_LENGTH * super::MIN_LENGTH || !grows_to(k, theta) {
        return None;
    }
    let (theta_d, slope) = radius(k, theta);
    // On the axis, where 0 / 0 stands for them, the limits; the next terms are below rounding there.
    let on_axis = rho < 1e-8 * z;
    let angle_ratio = if on_axis { 1.0 / z } else { theta / rho };
    let ratio = if on_axis { 1.0 / z } else { theta_d / rho };
    let bend =
        if on_axis { (2.0 * k[0] - 2.0 / 3.0) / (z * z * z) } else { (slope * z / squared - ratio) / (rho * rho) };
    let by_xy = Matrix2::identity() * ratio + xy * xy.transpose() * bend;
    let by_z = xy * (-slope / squared);
    let mut by_coefficient = [Vector2::zeros(); MAX_COEFFICIENTS];
    let mut power = angle_ratio;
    for column in by_coefficient.iter_mut().take(k.len()) {
        power *= theta * theta;
        *column = xy * power;
    }
    let by_direction = Matrix2x3::from_columns(&[by_xy.column(0).into(), by_xy.column(1).into(), by_z]);
    Some(Image { point: xy * ratio, by_direction, by_coefficient })
}

/// Unit direction of what is imaged at `q`; `None` outside the lens's largest radius.
pub(super) fn direction(k: &Coefficients, q: &Vector2<f64>) -> Option<Vector3<f64>> {
    let r = q.norm();
    if r == 0.0 {
        return Some(Vector3::z());
    }
    let (mut low, mut high) = (0.0, monotone_angle(k));
    if r.is_nan() || r >= radius(k, high).0 {
        return None;
    }
    // Newton's method, kept inside the bracket by bisection.
    let mut theta = r.min(0.5 * high);
    for _ in 0..100 {
        let (value, slope) = radius(k, theta);
        if value < r {
            low = theta
        } else {
            high = theta
        }
        let newton = theta - (value - r) / slope;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        let step = (next - theta).abs();
        theta = next;
        if step <= 1e-15 * theta {
            break;
        }
    }
    let (sin, cos) = theta.sin_cos();
    Some((q * (sin / r)).push(cos))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENSES: [Coefficients; 4] =
        [[0.0; 4], [-0.012, 0.02, -0.017, 0.0035], [0.05, -0.01, 0.002, -0.0002], [-0.1, 0.0, 0.0, 0.0]];

    fn ray(theta: f64, azimuth: f64) -> Vector3<f64> {
        Vector3::new(theta.sin() * azimuth.cos(), theta.sin() * azimuth.sin(), theta.cos())
    }

    #[test]
    fn theta_d_is_the_image_radius() {
        // The equidistant lens: the radius is the angle itself, also beyond 90 degrees.
        for degrees in [0.0f64, 1e-7, 1.0, 45.0, 89.9999, 90.0, 120.0, 179.0] {
            let theta = degrees.to_radians();
            let q = image(&[0.0; 4], &(ray(theta, 0.7) * 3.0)).unwrap().point;
            assert!((q.norm() - theta).abs() < 1e-14 && (theta == 0.0 || (q.y.atan2(q.x) - 0.7).abs() < 1e-12));
        }
        // OpenCV's polynomial, term by term.
        let k = [0.1, 0.02, 0.003, 0.0004];
        let theta: f64 = 1.2;
        let expected =
            theta + 0.1 * theta.powi(3) + 0.02 * theta.powi(5) + 0.003 * theta.powi(7) + 0.0004 * theta.powi(9);
        assert!((image(&k, &ray(theta, 0.0)).unwrap().point.x - expected).abs() < 1e-14);
    }

    #[test]
    fn opencv_images_the_same() {
        // cv2.fisheye.projectPoints of OpenCV 5.0.0, fx 300, fy 310, cx 400, cy 300.
        for (x, pixel) in [
            ([0.3, -0.2, 1.0], [486.27672431, 240.56492326]),
            ([2.0, 1.5, 1.0], [682.49870097, 518.93649325]),
            ([-1.0, 0.1, 0.05], [-40.00391745, 345.46707147]),
        ] {
            let q = image(&LENSES[1], &Vector3::from(x)).unwrap().point;
            assert!((q.x * 300.0 + 400.0 - pixel[0]).abs() < 1e-8 && (q.y * 310.0 + 300.0 - pixel[1]).abs() < 1e-8);
        }
    }

    #[test]
    fn direction_inverts_image() {
        for k in LENSES {
            let limit = monotone_angle(&k);
            for i in 0..200 {
                let theta = limit * (i as f64 / 200.0);
                let x = ray(theta, 0.3 * i as f64);
                let back = direction(&k, &image(&k, &(x * 2.5)).unwrap().point).unwrap();
                // Near the limit the inverse is steep.
                let slope = radius(&k, theta).1.min(1.0);
                assert!((back - x).norm() < 1e-13 / slope, "{k:?} {theta} {}", (back - x).norm());
            }
        }
    }

    #[test]
    fn derivatives_match_finite_differences_from_the_axis_to_beyond_90_degrees() {
        for k in LENSES {
            for theta in [0.0, 1e-9, 1e-6, 1e-3, 0.5, 1.3, std::f64::consts::FRAC_PI_2, 1.65] {
                let x = ray(theta, 2.1) * 1.7;
                let at = image(&k, &x).unwrap();
                let h = 1e-6;
                for i in 0..3 {
                    let e = Vector3::ith(i, h);
                    let numeric = (image(&k, &(x + e)).unwrap().point - image(&k, &(x - e)).unwrap().point) / (2.0 * h);
                    assert!((at.by_direction.column(i) - numeric).norm() < 1e-8, "{k:?} {theta} {i}");
                }
                for i in 0..4 {
                    let (mut plus, mut minus) = (k, k);
                    plus[i] += h;
                    minus[i] -= h;
                    let numeric = (image(&plus, &x).unwrap().point - image(&minus, &x).unwrap().point) / (2.0 * h);
                    assert!((at.by_coefficient[i] - numeric).norm() < 1e-7, "{k:?} {theta} {i}");
                }
            }
        }
    }

    #[test]
    fn the_lens_ends_where_it_folds_back() {
        // theta - 0.1 theta^3 grows up to sqrt(1 / 0.3).
        let k = [-0.1, 0.0, 0.0, 0.0];
        let limit = (1.0f64 / 0.3).sqrt();
        assert!((monotone_angle(&k) - limit).abs() < 1e-12);
        assert!(image(&k, &ray(limit - 1e-6, 0.4)).is_some() && image(&k, &ray(limit + 1e-6, 0.4)).is_none());
        let largest = radius(&k, limit).0;
        assert!(direction(&k, &Vector2::new(largest - 1e-9, 0.0)).is_some());
        assert!(direction(&k, &Vector2::new(largest + 1e-9, 0.0)).is_none());
        // A lens that grows again beyond its fold has no second image there.
        let again = [-0.5, 0.1, 0.0, 0.0];
        assert!(radius(&again, 2.5).1 > 0.0 && image(&again, &ray(2.5, 0.0)).is_none());
    }

    #[test]
    fn no_direction_has_no_image() {
        assert!(image(&[0.0; 4], &Vector3::zeros()).is_none());
        assert!(image(&[0.0; 4], &Vector3::new(0.0, 0.0, -1.0)).is_none());
        assert!(image(&[0.0; 4], &Vector3::new(f64::NAN, 0.0, 1.0)).is_none());
        assert!(direction(&[0.0; 4], &Vector2::new(f64::NAN, 0.0)).is_none());
    }
}
