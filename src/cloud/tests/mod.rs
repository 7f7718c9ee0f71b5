//! Against scenes of planes and balls, whose truth is a formula.

mod depth;
mod surface;
mod texture;

use nalgebra::Vector3;

use super::{GridPoint, RayGrid};
use crate::fuzz::Random;
use crate::geometry::rigid::{rotation_x, rotation_y};
use crate::geometry::{Camera, Distortion, Intrinsics, InverseDepthPoint, Rigid};

/// Distance along a ray from the origin (unit direction) to what it meets.
type Scene<'a> = &'a dyn Fn(&Vector3<f64>) -> Option<f64>;

/// Distance along a ray from the origin to the plane n . x = c.
fn plane(n: Vector3<f64>, c: f64, d: &Vector3<f64>) -> Option<f64> {
    let range = c / n.dot(d);
    (range > 0.0 && range.is_finite()).then_some(range)
}

fn gauss(random: &mut Random) -> f64 {
    (0..12).map(|_| random.below(1 << 30) as f64 / (1u64 << 30) as f64).sum::<f64>() - 6.0
}

/// A scan of a scene from the origin: pan and tilt within +- `half` radians, inverse ranges with
/// standard deviation `sigma`. Rows go up, as tilt does.
fn scan(columns: usize, rows: usize, half: f64, sigma: f64, seed: u64, scene: Scene<'_>) -> RayGrid {
    let mut random = Random(seed);
    let angle = |i: usize, n: usize| half * (2.0 * i as f64 / (n - 1) as f64 - 1.0);
    let points = (0..rows * columns).map(|i| {
        let d = rotation_y(angle(i % columns, columns)) * rotation_x(angle(i / columns, rows)) * Vector3::z();
        let rho = 1.0 / scene(&d)? + sigma * gauss(&mut random);
        let point = InverseDepthPoint { origin: Vector3::zeros(), direction: d, rho, variance: sigma * sigma };
        Some(GridPoint { point, colour: [200, 100, 50] })
    });
    RayGrid::new(columns, rows, points.collect()).unwrap()
}

fn camera(distortion: Distortion) -> Camera {
    Camera {
        width: 320,
        height: 240,
        intrinsics: Intrinsics::new(280.0, 161.0, 118.5),
        distortion,
        pose: Rigid::look_at(&Vector3::new(-0.6, -0.4, 0.2), &Vector3::new(0.1, 0.2, 3.0)).unwrap(),
    }
}

fn lenses() -> [Distortion; 4] {
    [
        Distortion::None,
        Distortion::BrownConrady([-0.28, 0.09, 0.001, -0.002, 0.0]),
        Distortion::Division(-0.2),
        Distortion::Fisheye([-0.012, 0.02, -0.017, 0.0035]),
    ]
}
