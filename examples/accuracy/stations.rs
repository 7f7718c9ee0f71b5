//! G7: two stations by their planes against the Cramer-Rao bound, the thesis's roof-edge Procrustes beside
//! it; and real rooms, whose planes nobody named.

use nalgebra::{DMatrix, DVector, SMatrix, Vector3};
use ptzcal::format::read_depth;
use ptzcal::geometry::rigid::{exp, log, nearest_rotation};
use ptzcal::geometry::{Camera, Distortion, Intrinsics, InverseDepthPoint, Plane, Rigid};
use ptzcal::image::DepthNoise;
use ptzcal::pose::{
    FindPlanesOptions, PlaneRegion, PoseMethod, PoseOptions, RoofEdges, StationOptions, StationPlanes,
    estimate_pose_roof_edges, find_planes_in_points, find_planes_in_shots, fit_regions_of_shots, register_matched,
    register_stations, shots_of_depth_map,
};

use super::figure::Figure;
use super::thesis::{Noise, rig};
use super::{data, pcd};

/// A rectangle: a corner and two sides, metres.
type Patch = [Vector3<f64>; 3];

/// Thesis eq. (24): station 2's frame to station 1's, 1.0 m and 37.33 degrees apart.
fn motion() -> Rigid {
    let printed = [[0.7958, 0.0295, -0.6049], [-0.0079, 0.9992, 0.0383], [0.6056, -0.0257, 0.7954]];
    let rotation = nearest_rotation(&printed.into()).expect("a rotation");
    Rigid { rotation, translation: Vector3::new(-0.94237, -0.06594, 0.32666) }
}

/// Wall, floor, left and right face of a box; its top and a side wall besides.
fn patches(count: usize) -> Vec<Patch> {
    let (along, corner) = (Vector3::x(), Vector3::new(0.25, 0.4, 1.8));
    let start = Vector3::new(-0.35, 0.9, 2.7);
    let (left, right) = (Vector3::new(-0.5, 0.0, 0.866), Vector3::new(0.866, 0.0, 0.5));
    let all = [
        [start - along * 0.35 - Vector3::y() * 0.02, along * 0.7, Vector3::y() * -0.7],
        [start - along * 0.35, along * 0.7, Vector3::z() * -0.7],
        [corner, left * 0.5, Vector3::y() * 0.5],
        [corner, right * 0.5, Vector3::y() * 0.5],
        [corner + Vector3::y() * 0.005, left * 0.5, right * 0.4],
        [Vector3::new(-1.0, 0.1, 1.5), Vector3::new(0.3, 0.0, 1.0), Vector3::y() * 0.7],
    ];
    all[..count].to_vec()
}

/// The laser's ray through a point, and the depth along it (the rig has no axis offsets).
fn aim(target: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>, f64) {
    let laser = rig().laser;
    let (l, v) = (Vector3::new(laser.x0, laser.y0, 0.0), Vector3::new(laser.vx, laser.vy, 1.0));
    let (vv, lv) = (v.norm_squared(), l.dot(&v));
    let depth = (-lv + (lv * lv - vv * (l.norm_squared() - target.norm_squared())).sqrt()) / vv;
    let q = l + v * depth;
    let tilt = q.y.atan2(q.z) - (target.y / q.y.hypot(q.z)).asin();
    let pan = target.x.atan2(target.z) - q.x.atan2(tilt.sin() * q.y + tilt.cos() * q.z);
    let (origin, direction) = rig().laser_in_world(pan, tilt);
    (origin, direction, depth)
}

/// The shots of each patch from a station, without noise; `sigma`: of the spot, pixels.
fn shots(patches: &[Patch], to_station: &Rigid, sigma: f64) -> Vec<Vec<InverseDepthPoint>> {
    let laser = rig().laser;
    let deviation = sigma / (rig().intrinsics.fx * laser.x0.hypot(laser.y0));
    let mut places = Noise::new(17);
    let places: Vec<_> = (0..100).map(|_| [places.uniform(), places.uniform()]).collect();
    let shot = |patch: &Patch, [u, v]: &[f64; 2]| {
        let (origin, direction, depth) = aim(&to_station.apply(&(patch[0] + patch[1] * *u + patch[2] * *v)));
        InverseDepthPoint { origin, direction, rho: 1.0 / depth, variance: deviation * deviation }
    };
    patches.iter().map(|p| places.iter().map(|place| shot(p, place)).collect()).collect()
}

fn normals(patches: &[Patch]) -> Vec<Vector3<f64>> {
    let normal = |[corner, u, v]: &Patch| {
        let across = u.cross(v);
        across / across.dot(corner)
    };
    patches.iter().map(normal).collect()
}

/// Bound of (w, t): planes and pose together from the inverse depths of both stations.
fn bound(exact: &[Vec<Vec<InverseDepthPoint>>; 2], planes: &[Vector3<f64>]) -> SMatrix<f64, 6, 6> {
    let size = 3 * planes.len() + 6;
    let predict = |x: &DVector<f64>| -> Vec<f64> {
        let w = Vector3::new(x[size - 6], x[size - 5], x[size - 4]);
        let t = Vector3::new(x[size - 3], x[size - 2], x[size - 1]);
        let b_to_a = Rigid { rotation: exp(&w) * motion().rotation, translation: motion().translation + t };
        let mut all = Vec::new();
        for (station, shots) in exact.iter().enumerate() {
            for (k, shots) in shots.iter().enumerate() {
                let n = planes[k] + Vector3::new(x[3 * k], x[3 * k + 1], x[3 * k + 2]);
                let n = if station == 0 {
                    n
                } else {
                    let moved = Plane::new(n, 1.0).expect("a plane").transform(&b_to_a.inverse());
                    moved.normal / moved.distance
                };
                all.extend(shots.iter().map(|s| n.dot(&s.direction) / (1.0 - n.dot(&s.origin)) / s.variance.sqrt()));
            }
        }
        all
    };
    let step = 1e-6;
    let columns: Vec<DVector<f64>> = (0..size)
        .map(|i| {
            let at = |sign: f64| {
                let mut x = DVector::zeros(size);
                x[i] = sign * step;
                DVector::from_vec(predict(&x))
            };
            (at(1.0) - at(-1.0)) / (2.0 * step)
        })
        .collect();
    let j = DMatrix::from_columns(&columns);
    let covariance = (j.transpose() * j).cholesky().expect("observable").inverse();
    covariance.fixed_view::<6, 6>(size - 6, size - 6).into_owned()
}

/// Squared errors of the rotation and of the position, and the normalised error squared.
#[derive(Default)]
struct Sum {
    squares: [f64; 2],
    nees: f64,
    runs: usize,
}

impl Sum {
    fn add(&mut self, b_to_a: &Rigid, covariance: &SMatrix<f64, 6, 6>) {
        let w = log(&(b_to_a.rotation * motion().rotation.transpose()));
        let t = b_to_a.translation - motion().translation;
        let e = SMatrix::<f64, 6, 1>::from_iterator(w.iter().chain(t.iter()).copied());
        self.squares[0] += w.norm_squared();
        self.squares[1] += t.norm_squared();
        self.nees += covariance.cholesky().map_or(f64::NAN, |c| e.dot(&c.solve(&e)));
        self.runs += 1;
    }

    fn figures(&self, goal: &'static str, setup: &str, bound: &SMatrix<f64, 6, 6>, limit: f64) -> Vec<Figure> {
        let trace = |first: usize| (first..first + 3).map(|i| bound[(i, i)]).sum::<f64>().sqrt();
        let figure = |k: usize, what: &str, unit| {
            let (rms, bound) = ((self.squares[k] / self.runs as f64).sqrt(), trace(3 * k));
            let setup = format!("{setup}: {what} rms");
            Figure {
                goal,
                setup,
                figure: rms * 1e3,
                unit,
                bound: bound * 1e3,
                ratio: rms / bound,
                limit,
                runs: self.runs,
            }
        };
        let nees = (self.nees / (6 * self.runs) as f64).sqrt();
        vec![
            figure(0, "rotation", "mrad"),
            figure(1, "position", "mm"),
            Figure {
                goal: "NEES",
                setup: format!("{setup}: sqrt(NEES / 6)"),
                figure: nees,
                unit: "",
                bound: 1.0,
                ratio: nees.max(1.0 / nees),
                limit: if limit.is_finite() { 1.05 } else { limit },
                runs: self.runs,
            },
        ]
    }
}

pub fn run(runs: usize, report: &mut impl FnMut(Vec<Figure>)) {
    for count in [4, 6] {
        for sigma in [0.2, 1.0] {
            report(simulated(count, sigma, 4 * runs));
        }
    }
    for (name, measure) in [("rgbd_icl", depth_images as fn(&std::path::Path) -> _), ("cloud_pcl_room_scans", scans)] {
        if let Some(folder) = data::folder(name) {
            let (found, truth) = measure(&folder);
            report(against(name, &found, &truth));
        }
    }
}

/// 100 shots a plane, in named regions.
fn simulated(count: usize, sigma: f64, runs: usize) -> Vec<Figure> {
    let patches = patches(count);
    let exact = [Rigid::identity(), motion().inverse()].map(|to| shots(&patches, &to, sigma));
    let bound = bound(&exact, &normals(&patches));
    let regions: Vec<PlaneRegion> =
        (0..count).map(|k| PlaneRegion::Indices((100 * k..100 * (k + 1)).collect())).collect();
    let options = FindPlanesOptions { flatness: 0.0, threshold: 5.0, ..Default::default() };
    let matches: Vec<[usize; 2]> = (0..count).map(|k| [k, k]).collect();
    let (mut likelihood, mut thesis) = (Sum::default(), Sum::default());
    for run in 0..runs {
        let mut noise = Noise::new(run as u64);
        let [a, b] = exact.each_ref().map(|station| {
            let noisy: Vec<_> = station
                .iter()
                .flatten()
                .map(|s| InverseDepthPoint { rho: s.rho + s.variance.sqrt() * noise.gaussian(), ..*s })
                .collect();
            fit_regions_of_shots(&noisy, &regions, &options).expect("planes")
        });
        let pose = register_matched(&a, &b, &matches).expect("a pose");
        likelihood.add(&pose.b_to_a, &pose.covariance);
        // The thesis's two edges, with levers of the scene's size.
        let edges = [&a, &b].map(|station| {
            let mut edges = RoofEdges::new();
            station.planes[..4].iter().for_each(|p| {
                edges.add_plane(p.estimate.clone()).expect("a plane");
            });
            [(0, 1), (2, 3)].iter().for_each(|(i, j)| edges.add_edge(*i, *j).expect("an edge"));
            edges
        });
        let options = PoseOptions { method: PoseMethod::RoofEdgeProcrustes, lever: Some(1.0), ..Default::default() };
        if let Ok(pose) = estimate_pose_roof_edges(&edges[0], &edges[1], &options) {
            thesis.add(&pose.b_to_a, &pose.covariance);
        }
    }
    let setup = |what: &str| format!("{count} planes, {sigma} px, {what}");
    let mut figures = likelihood.figures("G7", &setup("planes by ML"), &bound, 1.06);
    figures.extend(thesis.figures("thesis", &setup("roof-edge Procrustes"), &bound, f64::INFINITY));
    figures
}

fn registered([a, b]: [StationPlanes; 2]) -> Result<Rigid, String> {
    register_stations(&a, &b, &StationOptions::default()).map(|p| p.b_to_a).map_err(|e| e.to_string())
}

/// Rendered depth images; y points up. The published poses are off by about one frame.
fn depth_images(folder: &std::path::Path) -> (Result<Rigid, String>, (Rigid, [f64; 2])) {
    let intrinsics = Intrinsics { fx: 481.2, fy: -480.0, skew: 0.0, cx: 319.5, cy: 239.5 };
    let camera = Camera { width: 640, height: 480, intrinsics, distortion: Distortion::None, pose: Rigid::identity() };
    let rows = data::numbers(&folder.join("pose.txt")).expect("poses");
    let pose = |v: &[f64]| {
        let rotation = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(v[6], v[3], v[4], v[5]));
        Rigid { rotation: *rotation.to_rotation_matrix().matrix(), translation: Vector3::new(v[0], v[1], v[2]) }
    };
    let stations = ["depth1.png", "depth4.png"].map(|name| {
        let map = read_depth(&folder.join(name), 1.0 / 5000.0).expect("depths");
        let shots = shots_of_depth_map(&map, &camera, &DepthNoise::default()).expect("a camera");
        find_planes_in_shots(&shots, &FindPlanesOptions::default()).expect("planes")
    });
    (registered(stations), (pose(&rows[0]).inverse().after(&pose(&rows[1])), [1.5, 0.03]))
}

/// Laser scans of 112,000 points, whose nearest half metre is the robot and whose scanner is good to a
/// centimetre; against ICP of all points (truth.json).
fn scans(folder: &std::path::Path) -> (Result<Rigid, String>, (Rigid, [f64; 2])) {
    let options = FindPlanesOptions { flatness: 0.01, range: [0.5, f64::INFINITY], ..Default::default() };
    let stations = ["room_scan1.pcd", "room_scan2.pcd"]
        .map(|name| find_planes_in_points(&pcd::read(&folder.join(name)), None, &options).expect("planes"));
    let rotation =
        nalgebra::Matrix3::new(0.75671, -0.65347, 0.01917, 0.65331, 0.75695, 0.01459, -0.02404, 0.00149, 0.99971);
    (registered(stations), (Rigid { rotation, translation: Vector3::new(1.97048, 0.05691, 0.03037) }, [1.0, 0.05]))
}

fn against(name: &str, found: &Result<Rigid, String>, (truth, limits): &(Rigid, [f64; 2])) -> Vec<Figure> {
    let figure = |what: &str, figure: f64, limit: f64, unit| Figure {
        goal: "real",
        setup: format!("{name}, planes nobody named, no prior: {what}"),
        figure,
        unit,
        bound: limit,
        ratio: figure / limit,
        limit: 1.0,
        runs: 1,
    };
    let (angle, off) = match found {
        Ok(pose) => (
            log(&(pose.rotation * truth.rotation.transpose())).norm().to_degrees(),
            (pose.translation - truth.translation).norm(),
        ),
        Err(e) => {
            println!("{name}: {e}");
            (f64::INFINITY, f64::INFINITY)
        }
    };
    vec![figure("rotation", angle, limits[0], "deg"), figure("position", off * 1e3, limits[1] * 1e3, "mm")]
}
