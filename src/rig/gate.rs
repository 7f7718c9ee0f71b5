//! Where a spot can be: on the laser's line in the head camera's image, and about the reprojection
//! of the measured point in a fixed camera's (thesis IV.E).

use nalgebra::{DMatrix, Matrix2, Vector2, Vector3};

use super::shot::spot_covariance;
use crate::calibrate::Calibration;
use crate::detect::spot::{Band, Spot};
use crate::error::{Error, Result};
use crate::geometry::{Camera, InverseDepthPoint, RigModel};

/// Widths of the gates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateOptions {
    /// Nearest and farthest depth of the scene, metres.
    pub depth_range: [f64; 2],
    /// Half width of the search bands, pixels: the spot with its halo has to fit in.
    pub half_width: f64,
    /// Errors of the rig model and of known cameras in their images, pixels (standard deviation).
    pub model_sigma: f64,
    /// Standard deviations at which a spot is refused.
    pub sigmas: f64,
}

impl Default for GateOptions {
    fn default() -> Self {
        Self { depth_range: [0.3, 100.0], half_width: 16.0, model_sigma: 1.0, sigmas: 4.0 }
    }
}

impl GateOptions {
    pub(super) fn validate(&self) -> Result<()> {
        let [near, far] = self.depth_range;
        if !(near > 0.0 && far > near && far.is_finite()) {
            return Err(Error::invalid("depth_range", format!("{near} to {far} m: positive, nearest first")));
        }
        if !(self.half_width >= 1.0 && self.half_width <= 1e5) {
            return Err(Error::invalid("gate.half_width", format!("{} px is not in [1, 1e5]", self.half_width)));
        }
        for (name, value) in [("gate.model_sigma", self.model_sigma), ("gate.sigmas", self.sigmas)] {
            if !(value > 0.0 && value <= 1e3) {
                return Err(Error::invalid(name, format!("{value} is not in (0, 1000]")));
            }
        }
        Ok(())
    }

    fn inverse_depths(&self) -> [f64; 2] {
        [1.0 / self.depth_range[1], 1.0 / self.depth_range[0]]
    }
}

/// Points of a band's polyline: lenses bend it only a little.
const POINTS: usize = 33;

/// The band about the laser's line in the head camera's image.
///
/// # Errors
/// `InvalidArgument` when the line does not cross the image in the depth range.
pub(super) fn head_band(model: &RigModel, options: &GateOptions) -> Result<Band> {
    let camera = model.head_camera(0.0, 0.0);
    let search = search_along(options.inverse_depths(), |rho| model.spot_pixel(rho), &camera, options.half_width);
    match search {
        Search::Band(band) => Ok(band),
        _ => Err(Error::invalid(
            "depth_range",
            format!(
                "the laser is outside the head camera's image from {} to {} m",
                options.depth_range[0], options.depth_range[1]
            ),
        )),
    }
}

/// Is a spot of the head camera on the laser's line?
pub(super) fn on_epipolar_line(model: &RigModel, spot: &Spot, options: &GateOptions) -> bool {
    let covariance = spot_covariance(spot) + Matrix2::identity() * options.model_sigma.powi(2);
    model
        .measure(0.0, 0.0, &Vector2::new(spot.x, spot.y), &covariance)
        .is_ok_and(|m| m.epipolar_chi2 <= options.sigmas.powi(2))
}

/// What is known of a fixed camera during a scan.
pub(super) enum Gate {
    /// Nothing yet.
    Unknown,
    Known(Camera),
    Calibrated(Box<Calibration>),
}

/// Where to look in a fixed camera's image.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Search {
    Everywhere,
    Band(Band),
    /// The laser cannot be seen there.
    OutsideView,
}

impl Gate {
    /// About the image of the measured point, as far along the laser's line as its inverse depth is
    /// uncertain; of the whole line in the depth range, where no point was measured.
    pub fn search(
        &self,
        point: Option<&InverseDepthPoint>,
        laser: (Vector3<f64>, Vector3<f64>),
        options: &GateOptions,
    ) -> Search {
        let (camera, covariance) = match self {
            Self::Unknown => return Search::Everywhere,
            Self::Known(camera) => (camera, None),
            Self::Calibrated(calibration) => (&calibration.camera, Some(&calibration.covariance)),
        };
        let whole = options.inverse_depths();
        let (range, middle) = match point {
            Some(p) => {
                let reach = options.sigmas * p.variance.sqrt();
                // Beyond the horizon there is nothing to see.
                ([(p.rho - reach).max(1e-6), (p.rho + reach).max(2e-6)], p.rho)
            }
            None => (whole, 0.5 * (whole[0] + whole[1])),
        };
        let (origin, direction) = point.map_or(laser, |p| (p.origin, p.direction));
        let at = |rho: f64| origin + direction / rho;
        let camera_sigma = covariance.map_or(0.0, |c| pixel_sigma(camera, c, &at(middle)).unwrap_or(f64::INFINITY));
        let half_width = options.half_width + options.sigmas * camera_sigma.hypot(options.model_sigma);
        if half_width > f64::from(camera.width.max(camera.height)) {
            return Search::Everywhere;
        }
        search_along(range, |rho| camera.project(&at(rho)), camera, half_width)
    }

    /// Does a spot fit the measured point?
    pub fn accepts(&self, spot: &Spot, point: &InverseDepthPoint, options: &GateOptions) -> bool {
        match self.search(Some(point), (point.origin, point.direction), options) {
            Search::Everywhere => true,
            Search::OutsideView => false,
            Search::Band(band) => distance(&band.polyline, [spot.x, spot.y]) <= band.half_width,
        }
    }
}

/// The band about the image of a line's part, sampled in inverse depth, where images are even.
fn search_along(
    [low, high]: [f64; 2],
    pixel: impl Fn(f64) -> Option<Vector2<f64>>,
    camera: &Camera,
    half_width: f64,
) -> Search {
    let size = Vector2::new(f64::from(camera.width), f64::from(camera.height));
    let near = |p: &Vector2<f64>| (p - size * 0.5).abs() <= size * 0.5 + Vector2::repeat(half_width);
    let samples: Vec<Option<Vector2<f64>>> = (0..POINTS)
        .map(|i| pixel(low + (high - low) * i as f64 / (POINTS - 1) as f64))
        // Points far outside are in nobody's view, and their lens model means nothing.
        .map(|p| p.filter(|p| (p - size * 0.5).abs() <= size * 5.0))
        .collect();
    // The longest piece without a gap.
    let piece = samples
        .split(|p| p.is_none())
        .max_by_key(|piece| piece.iter().flatten().filter(|p| near(p)).count())
        .unwrap_or_default();
    let mut polyline: Vec<[f64; 2]> = piece.iter().flatten().map(|p| [p.x, p.y]).collect();
    if polyline.len() == 1 {
        polyline.push(polyline[0]);
    }
    let inside = |p: &[f64; 2]| camera.contains(&Vector2::new(p[0], p[1]));
    if !polyline.iter().any(inside) {
        return Search::OutsideView;
    }
    Search::Band(Band { polyline, half_width })
}

/// Greatest standard deviation of a point's image from the camera's covariance, pixels.
fn pixel_sigma(camera: &Camera, covariance: &DMatrix<f64>, point: &Vector3<f64>) -> Option<f64> {
    let p = camera.project_with_jacobian(point)?;
    let coefficients = camera.distortion.coefficients().len();
    if covariance.nrows() != 5 + coefficients + 6 {
        return None;
    }
    let mut jacobian = DMatrix::zeros(2, covariance.nrows());
    jacobian.view_mut((0, 0), (2, 5)).copy_from(&p.by_intrinsics);
    jacobian.view_mut((0, 5), (2, coefficients)).copy_from(&p.by_distortion.columns(0, coefficients));
    jacobian.view_mut((0, 5 + coefficients), (2, 3)).copy_from(&p.by_rotation);
    jacobian.view_mut((0, 8 + coefficients), (2, 3)).copy_from(&p.by_centre);
    let image = &jacobian * covariance * jacobian.transpose();
    Some((image[(0, 0)] + image[(1, 1)]).max(0.0).sqrt())
}

/// Distance of a pixel from a polyline.
fn distance(polyline: &[[f64; 2]], pixel: [f64; 2]) -> f64 {
    let q = Vector2::from(pixel);
    let to_segment = |ends: &[[f64; 2]]| {
        let (a, b) = (Vector2::from(ends[0]), Vector2::from(ends[1]));
        let along = b - a;
        let s =
            if along == Vector2::zeros() { 0.0 } else { ((q - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0) };
        (q - a - along * s).norm()
    };
    polyline.windows(2).map(to_segment).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::fake::{Random, fixed_camera, laser_hit, model};

    fn spot_at(pixel: Vector2<f64>) -> Spot {
        Spot {
            x: pixel.x,
            y: pixel.y,
            covariance: [0.01, 0.0, 0.01],
            peak: 100.0,
            signal_to_noise: 50.0,
            area: 20,
            saturated: false,
        }
    }

    fn shot(pan: f64, tilt: f64) -> (InverseDepthPoint, Vector3<f64>) {
        let (model, hit) = (model(), laser_hit(pan, tilt));
        let pixel = model.head_camera(pan, tilt).project(&hit).unwrap();
        (model.measure(pan, tilt, &pixel, &(Matrix2::identity() * 0.01)).unwrap().point, hit)
    }

    #[test]
    fn the_spot_is_on_the_head_band_and_reflections_are_not_on_the_line() {
        let (model, options) = (model(), GateOptions::default());
        let band = head_band(&model, &options).unwrap();
        for (pan, tilt) in [(0.0, 0.0), (0.3, -0.2), (-0.25, 0.1)] {
            let pixel = model.head_camera(pan, tilt).project(&laser_hit(pan, tilt)).unwrap();
            assert!(distance(&band.polyline, [pixel.x, pixel.y]) < 0.05);
            assert!(on_epipolar_line(&model, &spot_at(pixel), &options));
            assert!(!on_epipolar_line(&model, &spot_at(pixel + Vector2::new(0.0, 6.0)), &options));
            // Along the line it is another depth, which may be true.
            assert!(on_epipolar_line(&model, &spot_at(model.spot_pixel(0.8).unwrap()), &options));
        }
        let too_near = GateOptions { depth_range: [1e-3, 2e-3], ..options };
        assert!(matches!(head_band(&model, &too_near), Err(Error::InvalidArgument { .. })));
    }

    #[test]
    fn a_fixed_camera_is_searched_about_the_reprojection() {
        let (options, camera) = (GateOptions::default(), fixed_camera(0));
        let gate = Gate::Known(camera);
        let mut random = Random(3);
        for _ in 0..200 {
            let (pan, tilt) = (random.between(-0.3, 0.3), random.between(-0.2, 0.2));
            let (point, hit) = shot(pan, tilt);
            let pixel = camera.project(&hit).unwrap();
            let laser = model().laser_in_world(pan, tilt);
            let Search::Band(narrow) = gate.search(Some(&point), laser, &options) else { panic!("not seen") };
            let Search::Band(wide) = gate.search(None, laser, &options) else { panic!("not seen") };
            assert!(distance(&narrow.polyline, [pixel.x, pixel.y]) < 0.5);
            assert!(distance(&wide.polyline, [pixel.x, pixel.y]) < 0.5);
            let length =
                |b: &Band| (Vector2::from(b.polyline[0]) - Vector2::from(b.polyline[b.polyline.len() - 1])).norm();
            assert!(length(&narrow) < length(&wide));
            assert!(gate.accepts(&spot_at(pixel), &point, &options));
            assert!(!gate.accepts(&spot_at(pixel + Vector2::new(0.0, 40.0)), &point, &options));
        }
        assert_eq!(Gate::Unknown.search(None, model().laser_in_world(0.0, 0.0), &options), Search::Everywhere);
    }

    #[test]
    fn what_is_behind_or_beside_a_camera_is_outside_its_view() {
        let options = GateOptions::default();
        let mut camera = fixed_camera(0);
        camera.pose = crate::geometry::Rigid::look_at(&camera.centre(), &Vector3::new(0.0, 0.1, -3.0)).unwrap();
        let (point, _) = shot(0.0, 0.0);
        let laser = model().laser_in_world(0.0, 0.0);
        assert_eq!(Gate::Known(camera).search(Some(&point), laser, &options), Search::OutsideView);
        assert_eq!(Gate::Known(camera).search(None, laser, &options), Search::OutsideView);
        // A negative inverse depth is beyond the horizon, not behind the head.
        let beyond = InverseDepthPoint { rho: -0.01, variance: 1e-6, ..point };
        let _ = Gate::Known(fixed_camera(0)).search(Some(&beyond), laser, &options);
    }
}
