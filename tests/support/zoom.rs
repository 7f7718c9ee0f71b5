//! A simulated head whose camera zooms, 1x to 8x: truth over zoom, views of boards 1 to 5 m away, and
//! the Cramer-Rao bound of lens and laser line at each position, alone and with one line for all.
#![allow(dead_code)]

use nalgebra::{DMatrix, DVector, Vector2, Vector3};
use ptzcal::calibrate::{BoardCorner, BoardSpot, CalibrationOptions};
use ptzcal::geometry::rig_model::LaserLine;
use ptzcal::geometry::zoom_curve::ZoomNode;
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Rigid, rigid};
use ptzcal::rig_calibration::{ChessboardSpec, RigCalibration, RigCalibrationOptions};

use super::thesis::{Noise, rig};

pub const SIZE: [u32; 2] = [720, 576];
/// The device's numbers of nominally 1x, 2x, 4x and 8x.
pub const ZOOMS: [f64; 4] = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0];
/// Of the centre's shift, metres.
pub const PUPIL_SIGMA: f64 = 0.05;

/// The head at a zoom: a focal length that bends a little on a logarithmic scale, a principal point that
/// wanders by some pixels, a centre of projection that moves 30 mm forward.
pub fn truth(zoom: f64, distortion: Distortion) -> ZoomNode {
    let f = 800.0 * 8f64.powf(zoom + 0.03 * (std::f64::consts::PI * zoom).sin());
    let (cx, cy) = (360.0 + 5.0 * zoom - 4.0 * zoom * zoom, 288.0 - 6.0 * zoom);
    let (l, shift) = (rig().laser, 0.03 * zoom);
    // Distortion falls with the field of view.
    let distortion = match distortion {
        Distortion::BrownConrady([k1, ..]) => Distortion::BrownConrady([k1 * (1.0 - 0.3 * zoom), 0.0, 0.0, 0.0, 0.0]),
        other => other,
    };
    ZoomNode {
        zoom,
        intrinsics: Intrinsics { fx: f, fy: f * 1.0005, skew: 0.0, cx, cy },
        distortion,
        laser: LaserLine { x0: l.x0 + l.vx * shift, y0: l.y0 + l.vy * shift, ..l },
    }
}

pub fn camera(node: &ZoomNode) -> Camera {
    let ZoomNode { intrinsics, distortion, .. } = *node;
    Camera { width: SIZE[0], height: SIZE[1], intrinsics, distortion, pose: Rigid::identity() }
}

pub fn meet(line: &LaserLine, pose: &Rigid) -> Vector3<f64> {
    let (o, v) = (Vector3::new(line.x0, line.y0, 0.0), Vector3::new(line.vx, line.vy, 1.0));
    let n: Vector3<f64> = pose.rotation.column(2).into();
    o + v * (n.dot(&(pose.translation - o)) / n.dot(&v))
}

/// One simulated view without noise.
#[derive(Clone)]
pub struct TrueView {
    pub pose: Rigid,
    /// Corners of 15 x 15 at 30 mm that are in the image.
    pub board: Vec<Vector2<f64>>,
}

/// Boards where the laser hits them, as near as 1 m where the spot is still in the image.
pub fn views(node: &ZoomNode, count: usize) -> Vec<TrueView> {
    let camera = camera(node);
    let mut noise = Noise::new(7);
    let inside = |p: &Vector2<f64>| camera.contains(p);
    let spot = |z: f64| {
        let l = node.laser;
        camera.project(&Vector3::new(l.x0 + l.vx * z, l.y0 + l.vy * z, z)).is_some_and(|p| inside(&p))
    };
    let nearest = (100..=500).map(|i| f64::from(i) * 0.01).find(|z| spot(*z)).expect("a depth in view");
    let mut views = Vec::new();
    for i in 0..count {
        let z = nearest + (5.0 - nearest) * (i as f64 + 0.5) / count as f64;
        loop {
            let mut uniform = |half: f64| (2.0 * noise.uniform() - 1.0) * half;
            let rotation = rigid::exp(&Vector3::new(uniform(0.6), uniform(0.6), uniform(0.18)));
            let l = node.laser;
            let hit = Vector3::new(l.x0 + l.vx * z, l.y0 + l.vy * z, z);
            let pose =
                Rigid { rotation, translation: hit - rotation * Vector3::new(uniform(0.12), uniform(0.12), 0.0) };
            let at = Camera { pose, ..camera };
            let mut board: Vec<Vector2<f64>> = super::board::grid(15, 15, 0.03);
            board.retain(|p| at.project(&p.push(0.0)).is_some_and(|q| inside(&q)));
            if board.len() >= 20 {
                views.push(TrueView { pose, board });
                break;
            }
        }
    }
    views
}

pub fn spec() -> ChessboardSpec {
    ChessboardSpec { columns: 15, rows: 15, square: 0.03 }
}

pub fn options(sigma: f64, calibration: CalibrationOptions) -> RigCalibrationOptions {
    RigCalibrationOptions {
        calibration: CalibrationOptions { pixel_sigma: Some(sigma), ..calibration },
        pupil_sigma: PUPIL_SIGMA,
        ..Default::default()
    }
}

/// Adds a position's views, with noise on corners and spots.
pub fn add(rig: &mut RigCalibration, node: &ZoomNode, views: &[TrueView], sigma: f64, noise: &mut Noise) {
    let first = add_corners(rig, node, views, sigma, noise);
    for (i, view) in views.iter().enumerate() {
        let pixel = camera(node).project(&meet(&node.laser, &view.pose)).expect("in front") + noise.pixel(sigma);
        rig.set_spot(first + i, BoardSpot { pixel, pixel_covariance: None }).expect("a spot");
    }
}

/// The corners alone; answers the first view's number.
pub fn add_corners(
    rig: &mut RigCalibration,
    node: &ZoomNode,
    views: &[TrueView],
    sigma: f64,
    noise: &mut Noise,
) -> usize {
    let first = rig.len();
    for TrueView { pose, board } in views {
        let at = Camera { pose: *pose, ..camera(node) };
        let corner = |p: &Vector2<f64>, noise: &mut Noise| BoardCorner {
            board: *p,
            pixel: at.project(&p.push(0.0)).expect("in front") + noise.pixel(sigma),
            pixel_covariance: None,
        };
        let corners: Vec<BoardCorner> = board.iter().map(|p| corner(p, noise)).collect();
        rig.add_corners(node.zoom, SIZE, &corners).expect("a view");
    }
    first
}

/// Fisher information of fx fy skew cx cy x0 y0 vx vy at one position, every pose eliminated: central
/// differences of the projection alone.
pub fn information(node: &ZoomNode, views: &[TrueView], sigma: f64) -> DMatrix<f64> {
    const SHARED: usize = 9;
    let mut total = DMatrix::<f64>::zeros(SHARED, SHARED);
    for view in views {
        let predict = |p: &[f64]| -> Vec<Vector2<f64>> {
            let k = node.intrinsics.to_array();
            let intrinsics = Intrinsics::from_array(std::array::from_fn(|i| k[i] + p[i]));
            let q = &p[SHARED..];
            let pose = Rigid {
                rotation: rigid::exp(&Vector3::new(q[0], q[1], q[2])) * view.pose.rotation,
                translation: view.pose.translation + Vector3::new(q[3], q[4], q[5]),
            };
            let l = node.laser;
            let line = LaserLine { x0: l.x0 + p[5], y0: l.y0 + p[6], vx: l.vx + p[7], vy: l.vy + p[8] };
            let camera = Camera { intrinsics, ..camera(node) };
            let corners = view.board.iter().map(|b| pose.apply(&b.push(0.0)));
            corners.chain([meet(&line, &pose)]).map(|x| camera.project(&x).expect("in front")).collect()
        };
        let n = SHARED + 6;
        let mut j = DMatrix::<f64>::zeros(2 * (view.board.len() + 1), n);
        for i in 0..n {
            let step = if i < 5 { 1e-3 } else { 1e-6 };
            let at = |h: f64| {
                let mut p = vec![0.0; n];
                p[i] = h;
                predict(&p)
            };
            for (row, (a, b)) in at(step).iter().zip(&at(-step)).enumerate() {
                let slope = (a - b) / (2.0 * step * sigma);
                (j[(2 * row, i)], j[(2 * row + 1, i)]) = (slope.x, slope.y);
            }
        }
        let h = j.transpose() * &j;
        let own = h.view((SHARED, SHARED), (6, 6)).into_owned().cholesky().expect("a pose");
        let w = h.view((SHARED, 0), (6, SHARED)).into_owned();
        total += h.view((0, 0), (SHARED, SHARED)) - w.transpose() * own.solve(&w);
    }
    total
}

pub fn inverse(h: &DMatrix<f64>) -> DMatrix<f64> {
    let n = h.nrows();
    let s = DVector::from_fn(n, |i, _| 1.0 / h[(i, i)].sqrt());
    let scaled = DMatrix::from_fn(n, n, |i, k| h[(i, k)] * s[i] * s[k]);
    let inverse = scaled.cholesky().expect("determined").inverse();
    DMatrix::from_fn(n, n, |i, k| inverse[(i, k)] * s[i] * s[k])
}

/// Bound of the nodes' parameters with one line: the unknowns are all lenses, the line of the first
/// position and the shifts of the others, about which a prior is known. Node after node.
pub fn joint_bound(informations: &[DMatrix<f64>], pupil: f64) -> DMatrix<f64> {
    let n = informations.len();
    let unknowns = 5 * n + 4 + (n - 1);
    let line = rig().laser;
    // Of all nodes' parameters by the unknowns.
    let mut by = DMatrix::<f64>::zeros(9 * n, unknowns);
    let mut h = DMatrix::<f64>::zeros(unknowns, unknowns);
    for k in 0..n {
        (0..5).for_each(|i| by[(9 * k + i, 5 * k + i)] = 1.0);
        (0..4).for_each(|i| by[(9 * k + 5 + i, 5 * n + i)] = 1.0);
        if k > 0 {
            let shift = 5 * n + 4 + k - 1;
            // The true shift changes what x0 gets of vx too: 30 mm, next to nothing.
            (by[(9 * k + 5, shift)], by[(9 * k + 6, shift)]) = (line.vx, line.vy);
            h[(shift, shift)] += 1.0 / (pupil * pupil);
        }
        let rows = by.rows(9 * k, 9).into_owned();
        h += rows.transpose() * &informations[k] * rows;
    }
    &by * inverse(&h) * by.transpose()
}
