//! Set-ups for pointing: a random rig in the simulated room, believed wrongly, and a random fixed
//! camera, both adjusted from noisy shots; and how often a target is inside the stated ellipse.
#![allow(dead_code)]

use nalgebra::{Matrix2, Matrix4, SMatrix, SVector, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::adjust::{AdjustOptions, Adjusted, Adjustment, CameraSetup, Prior, Shot, Sighting, Station, adjust};
use ptzcal::geometry::rig_model::{AxisOffsets, Encoders, LaserLine};
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Plane, RIG_PARAMETERS, RigModel, Rigid};
use ptzcal::pointing::{AimOptions, Click, CloudSurface, Depth, MeasuredBy, PointNoise, Pointer, UncertainPlane};
use ptzcal::pose::plane_fit::{PlaneFitOptions, fit_plane_to_shots};

use super::thesis::{Noise, ROOM, SharedShot, choose, depth, grid};

/// Standard deviations: of spots and clicks, px; of the head's coming to rest, radians.
const SPOT: f64 = 0.3;
const CLICK: f64 = 1.0;
const HEAD: f64 = 2e-4;
/// 95 % of chi-square with two degrees of freedom.
const INSIDE: f64 = 5.991_464_547;

pub type RigMatrix = SMatrix<f64, RIG_PARAMETERS, RIG_PARAMETERS>;

/// Of many clicks.
#[derive(Debug, Clone, Copy, Default)]
pub struct Coverage {
    pub clicks: usize,
    pub inside: usize,
    /// Flagged as near an edge: not counted.
    pub edges: usize,
    /// Refused with a reason.
    pub refused: usize,
    /// Sum of the squared normalised errors, 2 each.
    pub sum: f64,
}

impl Coverage {
    pub fn add(&mut self, other: Self) {
        self.clicks += other.clicks;
        self.inside += other.inside;
        self.edges += other.edges;
        self.refused += other.refused;
        self.sum += other.sum;
    }

    fn count(&mut self, error: &Vector2<f64>, covariance: &Matrix2<f64>) {
        let square = error.dot(&(covariance.try_inverse().expect("a covariance") * error));
        self.clicks += 1;
        self.sum += square.min(100.0);
        self.inside += usize::from(square <= INSIDE);
    }
}

pub struct Setup {
    seed: u64,
    pub rig: RigModel,
    pub camera: Camera,
    pub adjusted: Adjusted,
    pub pointer: Pointer,
    /// All shots of the grid, noiseless.
    grid: Vec<SharedShot>,
}

/// What is believed of a rig that boards and data sheets have calibrated.
fn belief() -> RigMatrix {
    let mut p = RigMatrix::zeros();
    let (offset, slope, correlation) = (2.2e-4, 8.2e-5, -0.9);
    for i in 0..2 {
        p[(i, i)] = offset * offset;
        p[(i + 2, i + 2)] = slope * slope;
        p[(i, i + 2)] = correlation * offset * slope;
        p[(i + 2, i)] = p[(i, i + 2)];
    }
    (p[(4, 4)], p[(5, 5)], p[(6, 6)]) = (5e-4 * 5e-4, 0.25, 0.25);
    (7..11).for_each(|i| p[(i, i)] = 5e-3 * 5e-3);
    for (zero, scale) in [(11, 12), (13, 14)] {
        p[(zero, zero)] = 2e-3 * 2e-3;
        p[(scale, scale)] = 1e-3 * 1e-3;
    }
    p
}

impl Setup {
    pub fn new(seed: u64) -> Self {
        let mut noise = Noise::new(seed.wrapping_mul(7919) + 11);
        loop {
            if let Some(setup) = Self::try_new(seed, &mut noise) {
                return setup;
            }
        }
    }

    fn try_new(seed: u64, noise: &mut Noise) -> Option<Self> {
        let mut between = |low: f64, high: f64| low + (high - low) * noise.uniform();
        let rig = RigModel {
            width: 720,
            height: 576,
            intrinsics: Intrinsics::new(between(700.0, 1000.0), between(350.0, 370.0), between(280.0, 296.0)),
            distortion: Distortion::BrownConrady([between(-0.1, 0.0), between(0.0, 0.02), 3e-4, -2e-4, 0.0]),
            laser: LaserLine {
                x0: between(0.06, 0.15),
                y0: between(-0.03, 0.03),
                vx: between(-0.01, 0.0),
                vy: between(-0.005, 0.005),
            },
            offsets: AxisOffsets {
                tilt_y: between(-0.02, 0.02),
                tilt_z: between(0.0, 0.04),
                pan_x: between(-0.01, 0.01),
                pan_z: between(0.0, 0.04),
            },
            encoders: Encoders {
                pan_zero: between(-0.01, 0.01),
                pan_scale: between(0.999, 1.001),
                tilt_zero: between(-0.01, 0.01),
                tilt_scale: between(0.999, 1.001),
            },
        };
        let centre = Vector3::new(between(-1.7, 1.8), between(-1.2, 0.3), between(-0.8, 0.9));
        let target = Vector3::new(between(-0.8, 0.8), between(-0.2, 0.8), between(2.0, 4.0));
        let f = between(450.0, 900.0);
        let camera = Camera {
            width: 800,
            height: 600,
            intrinsics: Intrinsics::new(f, between(390.0, 410.0), between(290.0, 310.0)),
            distortion: Distortion::None,
            pose: Rigid::look_at(&centre, &target)?,
        };
        let all = grid(&rig, &Rigid::identity(), &[camera]);
        // What boxes hide from the camera is not seen.
        let visible = |s: &SharedShot| s.fixed[0].is_some() && (depth(&centre, &(s.point - centre)) - 1.0).abs() < 1e-6;
        let mut seen: Vec<SharedShot> = all.iter().filter(|s| visible(s)).cloned().collect();
        if seen.len() < 300 {
            return None;
        }
        choose(&mut seen, 200);
        let prior = belief();
        let root = prior.cholesky().expect("a covariance").l();
        let step = root * SVector::<f64, RIG_PARAMETERS>::from_fn(|_, _| noise.gaussian());
        let believed = rig.moved(&std::array::from_fn(|i| step[i]));
        let mut input = Adjustment::new(believed).ok()?;
        let dynamic = nalgebra::DMatrix::from_fn(RIG_PARAMETERS, RIG_PARAMETERS, |i, j| prior[(i, j)]);
        input.set_rig_prior(Prior::of_covariance(dynamic)).ok()?;
        input.add_station(Station::world()).ok()?;
        input.add_camera(CameraSetup::new(800, 600)).ok()?;
        let covariance = Matrix2::identity() * (SPOT * SPOT);
        for s in &seen {
            let pixel = s.fixed[0]? + noise.pixel(SPOT);
            input
                .add_shot(Shot {
                    station: 0,
                    pan: s.pan,
                    tilt: s.tilt,
                    head: Some((s.head + noise.pixel(SPOT), covariance)),
                    sightings: vec![Sighting { camera: 0, pixel, covariance }],
                })
                .ok()?;
        }
        let options = AdjustOptions { max_focal_deviation: f64::INFINITY, ..Default::default() };
        let adjusted = adjust(&input, &options).unwrap_or_else(|e| panic!("set-up {seed}: {e}"));
        let mut pointer = Pointer::of_adjusted(&adjusted, 0, 0).expect("a pointer");
        pointer.set_head_deviation([HEAD; 2]).expect("a deviation");
        Some(Self { seed, rig, camera, adjusted, pointer, grid: all })
    }

    /// The target's true place in the head camera's picture against the stated one.
    fn judge(
        &self,
        coverage: &mut Coverage,
        click: &Click,
        target: &Vector3<f64>,
        depth: &Depth<'_>,
        noise: &mut Noise,
    ) {
        let aim = match self.pointer.aim(click, depth, &AimOptions::default()) {
            Ok(aim) if aim.edge.is_some() => {
                coverage.edges += 1;
                return;
            }
            Ok(aim) => aim,
            Err(Error::Unreachable { .. } | Error::NotFound { .. }) => {
                coverage.refused += 1;
                return;
            }
            Err(error) => panic!("set-up {}: {error}", self.seed),
        };
        let (pan, tilt) = (aim.pan + HEAD * noise.gaussian(), aim.tilt + HEAD * noise.gaussian());
        let Some(seen) = self.rig.head_camera(pan, tilt).project(target) else {
            coverage.clicks += 1;
            return;
        };
        let before = coverage.sum;
        coverage.count(&(seen - aim.pixel.pixel), &aim.pixel.covariance);
        if coverage.sum - before > 12.0 && matches!(depth, Depth::Cloud(_)) && std::env::var("DEBUG_POINTING").is_ok() {
            let true_distance = (target - self.camera.centre()).norm();
            println!(
                "seed {}: square {:.1} true {true_distance:.3} said {:.3} point {:?} normal-dev {:.4} click {:?}",
                self.seed,
                coverage.sum - before,
                aim.distance,
                target.as_slice(),
                aim.point.covariance.trace().sqrt(),
                click.pixel.as_slice()
            );
        }
    }

    fn noise(&self, part: u64) -> Noise {
        Noise::new(self.seed.wrapping_mul(1_000_003) + part)
    }

    fn random_pixel(noise: &mut Noise) -> Vector2<f64> {
        Vector2::new(noise.uniform() * 790.0 + 5.0, noise.uniform() * 590.0 + 5.0)
    }

    /// One of the room's sides, in the world.
    fn side(noise: &mut Noise) -> Plane {
        let side = (noise.uniform() * 4.0) as usize;
        match side {
            0 => Plane::new(Vector3::x(), ROOM[0][0]),
            1 => Plane::new(Vector3::x(), ROOM[1][0]),
            2 => Plane::new(Vector3::y(), ROOM[1][1]),
            _ => Plane::new(Vector3::z(), ROOM[1][2]),
        }
        .expect("a plane")
    }

    /// Targets on a side of the room, known with errors of their own.
    pub fn on_a_surveyed_plane(&self, clicks: usize) -> Coverage {
        let (mut coverage, mut noise) = (Coverage::default(), self.noise(1));
        for _ in 0..clicks {
            let truth = Self::side(&mut noise);
            let pixel = Self::random_pixel(&mut noise);
            let Some(target) = truth.intersect_ray(&self.camera.back_project(&pixel).expect("a ray")) else { continue };
            let Some(plane) = surveyed(&truth, &mut noise) else { continue };
            let click = Click::new(pixel + noise.pixel(CLICK), CLICK);
            self.judge(&mut coverage, &click, &target, &Depth::Plane(&plane), &mut noise);
        }
        coverage
    }

    /// Targets on the floor, fitted to shots of the same rig.
    pub fn on_a_measured_plane(&self, clicks: usize) -> Coverage {
        let (mut coverage, mut noise) = (Coverage::default(), self.noise(2));
        let floor = Plane::new(Vector3::y(), ROOM[1][1]).expect("a plane");
        let covariance = Matrix2::identity() * (SPOT * SPOT);
        let mut on_floor: Vec<_> =
            self.grid.iter().filter(|s| floor.signed_distance(&s.point).abs() < 1e-9).cloned().collect();
        choose(&mut on_floor, 100);
        let shots: Vec<_> = on_floor
            .iter()
            .map(|s| {
                let spot = s.head + noise.pixel(SPOT);
                self.adjusted.rig.measure(s.pan, s.tilt, &spot, &covariance).expect("a shot").point
            })
            .collect();
        let plane = UncertainPlane::estimated(
            &fit_plane_to_shots(&shots, &PlaneFitOptions::default()).expect("a floor"),
            MeasuredBy::ThisRig,
        );
        for _ in 0..clicks {
            let pixel = Self::random_pixel(&mut noise);
            let Some(target) = floor.intersect_ray(&self.camera.back_project(&pixel).expect("a ray")) else { continue };
            if target.z > 6.0 || target.xz().norm() > 8.0 {
                continue;
            }
            let click = Click::new(pixel + noise.pixel(CLICK), CLICK);
            self.judge(&mut coverage, &click, &target, &Depth::Plane(&plane), &mut noise);
        }
        coverage
    }

    /// What the rig measures of the room with a grid as fine as the other's divided by `finer`.
    pub fn cloud(&self, finer: u32) -> (Vec<Vector3<f64>>, Vec<nalgebra::Matrix3<f64>>) {
        let mut noise = self.noise(3);
        let covariance = Matrix2::identity() * (SPOT * SPOT);
        let (columns, rows) = (73 * finer, 59 * finer);
        (0..columns * rows)
            .filter_map(|i| {
                let (column, row) = (f64::from(i % columns), f64::from(i / columns));
                let pan = (-29.0 + 54.0 * column / f64::from(columns)).to_radians();
                let tilt = (-21.0 + 40.0 * row / f64::from(rows)).to_radians();
                let (o, d) = self.rig.laser_in_world(pan, tilt);
                let spot = self.rig.spot_pixel(1.0 / depth(&o, &d))? + noise.pixel(SPOT);
                let point = self.adjusted.rig.measure(pan, tilt, &spot, &covariance).ok()?.point;
                Some((point.point()?, point.point_covariance()?))
            })
            .unzip()
    }

    /// Targets anywhere in the picture, on the cloud of the same rig.
    pub fn on_the_cloud(&self, clicks: usize, finer: u32) -> Coverage {
        let (mut coverage, mut noise) = (Coverage::default(), self.noise(4));
        let (points, covariances) = self.cloud(finer);
        let cloud =
            CloudSurface::new(&points, PointNoise::Covariances(&covariances), MeasuredBy::ThisRig).expect("a cloud");
        for _ in 0..clicks {
            let pixel = Self::random_pixel(&mut noise);
            let ray = self.camera.back_project(&pixel).expect("a ray");
            let target = ray.at(depth(&ray.origin, &ray.direction));
            // What the rig saw nothing of is not in the cloud: no shot as near as its grid is wide there.
            let spacing = 0.75f64.to_radians() * target.norm();
            if self.grid.iter().all(|s| (s.point - target).norm() > spacing) {
                continue;
            }
            let click = Click::new(pixel + noise.pixel(CLICK), CLICK);
            self.judge(&mut coverage, &click, &target, &Depth::Cloud(&cloud), &mut noise);
        }
        coverage
    }

    /// Targets at a distance that is known with an error.
    pub fn at_a_distance(&self, clicks: usize) -> Coverage {
        let (mut coverage, mut noise) = (Coverage::default(), self.noise(5));
        for _ in 0..clicks {
            let pixel = Self::random_pixel(&mut noise);
            let ray = self.camera.back_project(&pixel).expect("a ray");
            let distance = 1.5 + 4.0 * noise.uniform();
            let sigma = 0.03 * distance;
            let target = ray.at(distance);
            let click = Click::new(pixel + noise.pixel(CLICK), CLICK);
            let depth = Depth::Distance { metres: distance + sigma * noise.gaussian(), sigma };
            self.judge(&mut coverage, &click, &target, &depth, &mut noise);
        }
        coverage
    }

    /// Pixels of the head camera on a surveyed side of the room, in the fixed camera's picture.
    pub fn back_on_a_plane(&self, clicks: usize) -> Coverage {
        let (mut coverage, mut noise) = (Coverage::default(), self.noise(6));
        for _ in 0..clicks {
            let truth = Self::side(&mut noise);
            // A target that the fixed camera sees, clicked in the head camera's picture.
            let seen = self.camera.back_project(&Self::random_pixel(&mut noise)).expect("a ray");
            let Some(target) = truth.intersect_ray(&seen) else { continue };
            let Some(plane) = surveyed(&truth, &mut noise) else { continue };
            let pan = target.x.atan2(target.z) + 0.3 * (noise.uniform() - 0.5);
            let tilt = (-target.y).atan2(target.xz().norm()) + 0.3 * (noise.uniform() - 0.5);
            let there = (pan + HEAD * noise.gaussian(), tilt + HEAD * noise.gaussian());
            let Some(pixel) = self.rig.head_camera(there.0, there.1).project(&target) else { continue };
            let click = Click::new(pixel + noise.pixel(CLICK), CLICK);
            match self.pointer.locate([pan, tilt], None, &click, &Depth::Plane(&plane)) {
                Ok(located) => {
                    let truth = self.camera.project(&target).expect("it is seen");
                    coverage.count(&(truth - located.pixel.pixel), &located.pixel.covariance);
                }
                Err(Error::Unreachable { .. } | Error::InvalidArgument { .. }) => coverage.refused += 1,
                Err(error) => panic!("set-up {}: {error}", self.seed),
            }
        }
        coverage
    }
}

/// A plane with errors of 2 mrad and 5 mm.
fn surveyed(truth: &Plane, noise: &mut Noise) -> Option<UncertainPlane> {
    let middle = Vector3::new(0.0, 0.0, 2.5);
    let (tilt, shift) = (2e-3, 5e-3);
    let axis = truth.normal.iamin();
    let e1 = truth.normal.cross(&Vector3::ith(axis, 1.0)).normalize();
    let e2 = truth.normal.cross(&e1);
    let normal = (truth.normal + e1 * (tilt * noise.gaussian()) + e2 * (tilt * noise.gaussian())).normalize();
    // About the room's middle: d = n . middle + its distance.
    let own = truth.distance - truth.normal.dot(&middle) + shift * noise.gaussian();
    let plane = Plane::new(normal, own + normal.dot(&middle))?;
    let mut by = SMatrix::<f64, 4, 3>::zeros();
    for (i, e) in [e1, e2].iter().enumerate() {
        by.fixed_view_mut::<3, 1>(0, i).copy_from(&(e * tilt));
        by[(3, i)] = e.dot(&middle) * tilt;
    }
    by[(3, 2)] = shift;
    let covariance: Matrix4<f64> = by * by.transpose();
    Some(UncertainPlane { plane, covariance, measured_by: MeasuredBy::Others })
}
