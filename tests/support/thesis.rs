//! The simulated set-ups NEAR and FAR of the mathematics notes (docs/maths.md): the thesis's cameras
//! in a room with five boxes, seen by its rig. Truth for tests and for `make accuracy`.
#![allow(dead_code)]

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use ptzcal::calibrate::{Correspondences, Observation};
use ptzcal::geometry::rig_model::{AxisOffsets, Encoders, LaserLine};
use ptzcal::geometry::rigid::nearest_rotation;
use ptzcal::geometry::{Camera, Distortion, Intrinsics, RigModel, Rigid};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// Seeded Gaussian noise (Box-Muller).
pub struct Noise {
    rng: ChaCha8Rng,
    spare: Option<f64>,
}

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed), spare: None }
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn gaussian(&mut self) -> f64 {
        if let Some(z) = self.spare.take() {
            return z;
        }
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        let r = (-2.0 * u.ln()).sqrt();
        let (s, c) = (std::f64::consts::TAU * v).sin_cos();
        self.spare = Some(r * s);
        r * c
    }

    pub fn pixel(&mut self, sigma: f64) -> Vector2<f64> {
        Vector2::new(self.gaussian(), self.gaussian()) * sigma
    }
}

pub fn rig() -> RigModel {
    RigModel {
        width: 720,
        height: 576,
        intrinsics: Intrinsics::new(800.0, 360.0, 288.0),
        distortion: Distortion::None,
        laser: LaserLine { x0: 0.1, y0: 0.005, vx: -0.005, vy: 0.003 },
        offsets: AxisOffsets::default(),
        encoders: Encoders::default(),
    }
}

fn camera(pose: Rigid) -> Camera {
    let intrinsics = Intrinsics { fx: 845.19, fy: 844.56, skew: 0.0, cx: 427.76, cy: 285.53 };
    Camera { width: 800, height: 600, intrinsics, distortion: Distortion::None, pose }
}

/// The thesis's camera, eqs (26) and (30), its rotation made orthonormal.
pub fn near() -> Camera {
    let r = Matrix3::new(0.9997, 0.0127, 0.0210, -0.0128, 0.9990, 0.0064, -0.0210, -0.0066, 0.9998);
    let rotation = nearest_rotation(&r).unwrap();
    camera(Rigid { rotation, translation: Vector3::new(0.15680, -0.04997, -0.01664) })
}

/// The same camera two metres off, looking at the boxes.
pub fn far() -> Camera {
    camera(Rigid::look_at(&Vector3::new(-1.6, -0.9, 0.6), &Vector3::new(0.15, 0.15, 2.9)).unwrap())
}

pub const ROOM: [[f64; 3]; 2] = [[-1.9, -1.3, -1.0], [2.0, 1.2, 4.6]];
pub const BOXES: [[[f64; 3]; 2]; 5] = [
    [[-0.7, 0.15, 1.7], [0.2, 1.2, 2.5]],
    [[-0.48, -0.45, 1.05], [-0.28, 0.1, 1.3]],
    [[0.25, 0.3, 1.35], [0.5, 1.2, 1.7]],
    [[-0.9, -0.75, 1.9], [-0.45, -0.1, 2.4]],
    [[0.1, -0.9, 2.9], [0.9, -0.1, 3.5]],
];

/// Distance to the first surface of the room, in lengths of `d`: the depth of what the laser meets.
pub fn depth(o: &Vector3<f64>, d: &Vector3<f64>) -> f64 {
    let slab = |b: &[[f64; 3]; 2]| {
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for i in 0..3 {
            let (a, c) = ((b[0][i] - o[i]) / d[i], (b[1][i] - o[i]) / d[i]);
            enter = enter.max(a.min(c));
            leave = leave.min(a.max(c));
        }
        (enter, leave)
    };
    BOXES
        .iter()
        .map(slab)
        .filter(|(enter, leave)| enter < leave && *enter > 0.0)
        .fold(slab(&ROOM).1, |z, (enter, _)| z.min(enter))
}

/// The axis along which the surface at a point faces.
pub fn axis_of(point: &Vector3<f64>) -> usize {
    let on =
        |axis: &usize| BOXES.iter().chain([&ROOM]).any(|b| b.iter().any(|c| (c[*axis] - point[*axis]).abs() < 1e-9));
    (0..3).find(on).unwrap()
}

/// One noiseless shot.
#[derive(Clone, Copy)]
pub struct Shot {
    pub pan: f64,
    pub tilt: f64,
    pub point: Vector3<f64>,
    pub head: Vector2<f64>,
    pub fixed: Vector2<f64>,
}

/// Noiseless shots on the pan/tilt grid that the camera sees; `n` of them chosen at random.
pub fn world(camera: &Camera, n: usize) -> Vec<Shot> {
    world_of(&rig(), camera, n)
}

/// The same with another rig.
pub fn world_of(rig: &RigModel, camera: &Camera, n: usize) -> Vec<Shot> {
    let single =
        |s: &SharedShot| s.fixed[0].map(|fixed| Shot { pan: s.pan, tilt: s.tilt, point: s.point, head: s.head, fixed });
    let mut shots: Vec<Shot> = grid(rig, &Rigid::identity(), &[*camera]).iter().filter_map(single).collect();
    choose(&mut shots, n);
    shots
}

/// One noiseless shot with what each of several cameras sees.
#[derive(Clone)]
pub struct SharedShot {
    pub pan: f64,
    pub tilt: f64,
    pub point: Vector3<f64>,
    pub head: Vector2<f64>,
    pub fixed: Vec<Option<Vector2<f64>>>,
}

/// All noiseless shots of the pan/tilt grid with the rig at a station (its frame to the world).
pub fn grid(rig: &RigModel, station: &Rigid, cameras: &[Camera]) -> Vec<SharedShot> {
    let mut shots = Vec::new();
    for j in 0..59 {
        for i in 0..73 {
            let pan = (-29.0 + 54.0 * i as f64 / 72.0).to_radians();
            let tilt = (-21.0 + 40.0 * j as f64 / 58.0).to_radians();
            let (o, d) = rig.laser_in_world(pan, tilt);
            let (o, d) = (station.apply(&o), station.rotation * d);
            let z = depth(&o, &d);
            let point = o + d * z;
            let inside = |m: &Vector2<f64>| m.x > 0.0 && m.y > 0.0 && m.x < 800.0 && m.y < 600.0;
            let fixed = cameras.iter().map(|c| c.project(&point).filter(inside)).collect();
            shots.push(SharedShot { pan, tilt, point, head: rig.spot_pixel(1.0 / z).unwrap(), fixed });
        }
    }
    shots
}

/// Keeps `n` at random, always the same ones.
pub fn choose<T>(shots: &mut Vec<T>, n: usize) {
    let mut noise = Noise::new(5);
    for i in 0..n.min(shots.len()) {
        let j = i + ((shots.len() - i) as f64 * noise.uniform()) as usize;
        shots.swap(i, j);
    }
    shots.truncate(n);
}

/// The shots with noise `sigma_head` and `sigma_fixed` (px) as the library's observations.
pub fn laser_set(shots: &[Shot], sigma_head: f64, sigma_fixed: f64, noise: &mut Noise) -> Correspondences {
    let rig = rig();
    let mut set = Correspondences::new(800, 600).unwrap();
    for s in shots {
        let spot = s.head + noise.pixel(sigma_head);
        let covariance = Matrix2::identity() * (sigma_head * sigma_head);
        let shot = rig.measure(s.pan, s.tilt, &spot, &covariance).unwrap().point;
        let pixel_covariance = Matrix2::identity() * (sigma_fixed * sigma_fixed);
        set.add(Observation::Shot { shot, pixel: s.fixed + noise.pixel(sigma_fixed), pixel_covariance }).unwrap();
    }
    set
}

/// The shots' true points with noisy pixels.
pub fn point_set(shots: &[Shot], sigma: f64, noise: &mut Noise) -> Correspondences {
    let mut set = Correspondences::new(800, 600).unwrap();
    let world: Vec<_> = shots.iter().map(|s| s.point).collect();
    let pixels: Vec<_> = shots.iter().map(|s| s.fixed + noise.pixel(sigma)).collect();
    set.add_points(&world, &pixels).unwrap();
    set
}
