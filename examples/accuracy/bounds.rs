//! Cramer-Rao bounds by central differences of the predicted pixels alone, so that they share no
//! derivative with the solvers.

use nalgebra::{DMatrix, DVector, SMatrix, Vector2, Vector3};
use ptzcal::geometry::{Camera, Intrinsics, RIG_PARAMETERS, RigModel, Rigid, rigid};

use super::edges::Edge;
use super::thesis::Shot;

pub type RigMatrix = SMatrix<f64, RIG_PARAMETERS, RIG_PARAMETERS>;

/// The camera with a step of fx fy skew cx cy, lens, rotation, centre.
fn moved(camera: &Camera, p: &[f64]) -> Camera {
    let mut c = *camera;
    let k = camera.intrinsics.to_array();
    c.intrinsics = Intrinsics::from_array(std::array::from_fn(|i| k[i] + p[i]));
    let count = camera.distortion.coefficients().len();
    c.distortion.coefficients_mut().iter_mut().zip(&p[5..]).for_each(|(k, s)| *k += s);
    let pose = &p[5 + count..];
    let turn = rigid::exp(&nalgebra::Vector3::new(pose[0], pose[1], pose[2])) * camera.pose.rotation;
    c.pose = Rigid::from_centre(turn, &(camera.centre() + nalgebra::Vector3::new(pose[3], pose[4], pose[5])));
    c
}

/// Step for a numerical derivative by parameter `i` of a camera: pixels, or metres and radians.
fn step(i: usize) -> f64 {
    if i < 5 { 1e-3 } else { 1e-6 }
}

/// Inverse of an information matrix, by way of unit diagonal.
fn inverse(h: &DMatrix<f64>) -> DMatrix<f64> {
    let n = h.nrows();
    let scale = DVector::from_fn(n, |i, _| 1.0 / h[(i, i)].sqrt());
    let scaled = DMatrix::from_fn(n, n, |i, k| h[(i, k)] * scale[i] * scale[k]);
    let inverse = scaled.cholesky().expect("an observable camera").inverse();
    DMatrix::from_fn(n, n, |i, k| inverse[(i, k)] * scale[i] * scale[k])
}

/// Of all camera parameters from exact 3D points with `sigma` px; only those from `first` on are unknown.
pub fn points(camera: &Camera, world: &[Vector3<f64>], sigma: f64, first: usize) -> DMatrix<f64> {
    let n = 11 + camera.distortion.coefficients().len();
    let mut h = DMatrix::<f64>::zeros(n - first, n - first);
    for x in world {
        let column = |i: usize| {
            let at = |s: f64| {
                let mut p = vec![0.0; n];
                p[i] = s;
                moved(camera, &p).project(x).expect("in view")
            };
            (at(step(i)) - at(-step(i))) / (2.0 * step(i) * sigma)
        };
        let mut j = DMatrix::<f64>::zeros(2, n - first);
        (first..n).for_each(|i| j.set_column(i - first, &column(i)));
        h += j.transpose() * j;
    }
    let mut all = DMatrix::zeros(n, n);
    all.view_mut((first, first), (n - first, n - first)).copy_from(&inverse(&h));
    all
}

/// Of the camera parameters `free` from exact points and lines: of a segment's end counts the distance
/// from the line's image, which the images of two neighbouring points give.
pub fn points_and_edges(
    camera: &Camera,
    world: &[Vector3<f64>],
    edges: &[Edge],
    sigma: f64,
    free: &[usize],
) -> DMatrix<f64> {
    let n = 11 + camera.distortion.coefficients().len();
    let mut h = DMatrix::<f64>::zeros(free.len(), free.len());
    let mut add = |predict: &dyn Fn(&Camera) -> f64| {
        let derivative = |i: usize| {
            let at = |s: f64| {
                let mut p = vec![0.0; n];
                p[i] = s;
                predict(&moved(camera, &p))
            };
            (at(step(i)) - at(-step(i))) / (2.0 * step(i) * sigma)
        };
        let j = DVector::from_iterator(free.len(), free.iter().map(|i| derivative(*i)));
        h += &j * j.transpose();
    };
    for x in world {
        (0..2).for_each(|axis| add(&|c| c.project(x).expect("in view")[axis]));
    }
    for e in edges {
        let along = (e.ends[1] - e.ends[0]).normalize() * 1e-4;
        for (x, end) in e.ends.iter().zip(&e.pixels) {
            add(&|c| {
                let [a, b] = [x - along, x + along].map(|x| c.project(&x).expect("in view"));
                (b - a).normalize().perp(&(end - a))
            });
        }
    }
    let inverse = inverse(&h);
    let mut all = DMatrix::zeros(n, n);
    for (i, row) in free.iter().enumerate() {
        free.iter().enumerate().for_each(|(k, column)| all[(*row, *column)] = inverse[(i, k)]);
    }
    all
}

/// Of all camera parameters from laser shots with `sigma` px in both cameras and one unknown inverse
/// depth each; the rig's parameters with a variance in `prior` are unknown as well.
pub fn shots(camera: &Camera, shots: &[Shot], sigma: f64, rig: &RigModel, prior: &RigMatrix) -> DMatrix<f64> {
    let free: Vec<usize> = (0..RIG_PARAMETERS).filter(|i| prior[(*i, *i)] > 0.0).collect();
    let (r, n) = (free.len(), free.len() + 11 + camera.distortion.coefficients().len());
    let predict = |shot: &Shot, p: &[f64], rho: f64| -> [Vector2<f64>; 2] {
        let mut step = [0.0; RIG_PARAMETERS];
        free.iter().zip(p).for_each(|(i, v)| step[*i] = *v);
        let rig = rig.moved(&step);
        let (o, d) = rig.laser_in_world(shot.pan, shot.tilt);
        let seen = moved(camera, &p[r..]).project(&(o + d / rho));
        [rig.spot_pixel(rho).expect("in the lens"), seen.expect("in view")]
    };
    let mut h = DMatrix::<f64>::zeros(n, n);
    for shot in shots {
        let (o, d) = rig.laser_in_world(shot.pan, shot.tilt);
        let rho = d.dot(&d) / (shot.point - o).dot(&d);
        // By parameter i, or by the inverse depth.
        let difference = |i: Option<usize>, size: f64| -> [Vector2<f64>; 2] {
            let at = |s: f64| {
                let mut p = vec![0.0; n];
                i.into_iter().for_each(|i| p[i] = s);
                predict(shot, &p, if i.is_none() { rho + s } else { rho })
            };
            let (plus, minus) = (at(size), at(-size));
            std::array::from_fn(|k| (plus[k] - minus[k]) / (2.0 * size * sigma))
        };
        let slope = difference(None, 1e-6);
        let own: f64 = slope.iter().map(Vector2::norm_squared).sum();
        let mut b = DVector::<f64>::zeros(n);
        let mut j = DMatrix::<f64>::zeros(4, n);
        for i in 0..n {
            let size = if i >= r {
                step(i - r)
            } else if (5..7).contains(&free[i]) {
                1e-3
            } else {
                1e-6
            };
            let by = difference(Some(i), size);
            for k in 0..2 {
                j.fixed_view_mut::<2, 1>(2 * k, i).copy_from(&by[k]);
                b[i] += by[k].dot(&slope[k]);
            }
        }
        h += j.transpose() * &j - &b * b.transpose() / own;
    }
    if r > 0 {
        let block = DMatrix::from_fn(r, r, |i, k| prior[(free[i], free[k])]);
        let information = block.cholesky().expect("a covariance").inverse();
        let mut corner = h.view_mut((0, 0), (r, r));
        corner += information;
    }
    inverse(&h).view((r, r), (n - r, n - r)).into_owned()
}
