//! Simulated views of boards with the laser on: 15 x 15 corners at 30 mm, 1 to 5 m away, each where
//! the laser of the thesis's rig hits it (maths.md section 2).
#![allow(dead_code)]

use nalgebra::{Vector2, Vector3};
use ptzcal::calibrate::boards::BoardSpot;
use ptzcal::calibrate::{BoardCorner, Boards};
use ptzcal::geometry::{Camera, Distortion, RigModel, Rigid, rigid};

use super::thesis::{Noise, rig};

/// Board to camera.
pub fn poses(n: usize, nearest: f64, farthest: f64) -> Vec<Rigid> {
    let laser = rig().laser;
    let mut noise = Noise::new(3);
    let mut uniform = |half: f64| (2.0 * noise.uniform() - 1.0) * half;
    (0..n)
        .map(|i| {
            let z = nearest + (farthest - nearest) * i as f64 / (n - 1).max(1) as f64;
            let rotation = rigid::exp(&Vector3::new(uniform(0.6), uniform(0.6), uniform(0.18)));
            let hit = Vector3::new(laser.x0 + laser.vx * z, laser.y0 + laser.vy * z, z);
            let at = Vector3::new(uniform(0.12), uniform(0.12), 0.0);
            Rigid { rotation, translation: hit - rotation * at }
        })
        .collect()
}

/// Positions on the board, metres.
pub fn grid(columns: usize, rows: usize, pitch: f64) -> Vec<Vector2<f64>> {
    let middle = Vector2::new((columns - 1) as f64, (rows - 1) as f64) * 0.5;
    (0..columns * rows).map(|i| (Vector2::new((i % columns) as f64, (i / columns) as f64) - middle) * pitch).collect()
}

/// The rig's head camera in its own frame.
pub fn head(distortion: Distortion) -> Camera {
    let rig = RigModel { distortion, ..rig() };
    rig.head_camera(0.0, 0.0)
}

pub fn corners(
    camera: &Camera,
    pose: &Rigid,
    board: &[Vector2<f64>],
    sigma: f64,
    noise: &mut Noise,
) -> Vec<BoardCorner> {
    let at = Camera { pose: *pose, ..*camera };
    board
        .iter()
        .map(|p| BoardCorner {
            board: *p,
            pixel: at.project(&p.push(0.0)).expect("in front") + noise.pixel(sigma),
            pixel_covariance: None,
        })
        .collect()
}

/// Where the laser truly meets a board, in the camera's frame.
pub fn hit(pose: &Rigid) -> Vector3<f64> {
    let l = rig().laser;
    let (o, v) = (Vector3::new(l.x0, l.y0, 0.0), Vector3::new(l.vx, l.vy, 1.0));
    let n: Vector3<f64> = pose.rotation.column(2).into();
    o + v * (n.dot(&(pose.translation - o)) / n.dot(&v))
}

/// All views with their spots, noise `sigma` (px) on everything.
pub fn with_spots(camera: &Camera, poses: &[Rigid], sigma: f64, noise: &mut Noise) -> Boards {
    let board = grid(15, 15, 0.03);
    let mut boards = Boards::new(camera.width, camera.height).expect("a size");
    for pose in poses {
        let view = boards.add_view(&corners(camera, pose, &board, sigma, noise)).expect("a view");
        let pixel = camera.project(&hit(pose)).expect("in front") + noise.pixel(sigma);
        boards.set_spot(view, BoardSpot { pixel, pixel_covariance: None }).expect("a spot");
    }
    boards
}
