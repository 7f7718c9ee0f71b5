//! The 3D model: a box before a wall, scanned with the noise of real spots. Are stated variances the
//! true ones, and is the box cut off the wall and nothing else?

use nalgebra::{Vector2, Vector3};
use ptzcal::cloud::{GridPoint, RayGrid, SurfaceOptions, grid_cloud, mesh_depth, thin, triangulate};
use ptzcal::geometry::rigid::{rotation_x, rotation_y};
use ptzcal::geometry::{Camera, Distortion, Intrinsics, InverseDepthPoint, Rigid};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::figure::Figure;

const COLUMNS: usize = 47;
const ROWS: usize = 43;
/// A tenth of a pixel over 800 px and a baseline of 0.1 m, 1/m.
const SIGMA: f64 = 0.1 / (800.0 * 0.1);
const BOX: f64 = 2.2;
const WALL: f64 = 3.0;

fn gauss(rng: &mut ChaCha8Rng) -> f64 {
    let mut uniform = || (f64::from(rng.next_u32()) + 0.5) / 2f64.powi(32);
    (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
}

fn on_box(x: f64, y: f64) -> bool {
    x.abs() < 0.35 && y.abs() < 0.3
}

/// z of what is seen along a ray from the origin.
fn depth(d: &Vector3<f64>) -> f64 {
    if on_box(d.x / d.z * BOX, d.y / d.z * BOX) { BOX } else { WALL }
}

fn scan(rng: &mut ChaCha8Rng) -> RayGrid {
    let angle = |i: usize, n: usize| 0.45 * (2.0 * i as f64 / (n - 1) as f64 - 1.0);
    let point = |i: usize| {
        let d = rotation_y(angle(i % COLUMNS, COLUMNS)) * rotation_x(angle(i / COLUMNS, ROWS)) * Vector3::z();
        let rho = d.z / depth(&d) + SIGMA * gauss(rng);
        let point = InverseDepthPoint { origin: Vector3::zeros(), direction: d, rho, variance: SIGMA * SIGMA };
        Some(GridPoint { point, colour: [255; 3] })
    };
    RayGrid::new(COLUMNS, ROWS, (0..COLUMNS * ROWS).map(point).collect()).expect("a grid")
}

pub fn run(runs: usize, report: &mut impl FnMut(Vec<Figure>)) {
    let runs = (runs / 10).max(10);
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let camera = Camera {
        width: 160,
        height: 120,
        intrinsics: Intrinsics::new(120.0, 79.5, 59.5),
        distortion: Distortion::BrownConrady([-0.2, 0.05, 0.0, 0.0, 0.0]),
        pose: Rigid::look_at(&Vector3::new(-0.8, -0.3, 0.0), &Vector3::new(0.0, 0.0, 2.8)).expect("a view"),
    };
    // Box and wall in the middle of voxels, and on their borders, where their noise splits them.
    let sides = [0.26, 0.2];
    let (mut pixels, mut pixel_nees, mut points, mut point_nees) = (0.0, 0.0, [0.0; 2], [0.0; 2]);
    let (mut bridges, mut triangles, mut lost) = (0.0, 0.0, 0.0);
    for _ in 0..runs {
        let grid = scan(&mut rng);
        let mesh = triangulate(&grid, &SurfaceOptions::default()).expect("a surface");
        let near = |t: &[u32; 3]| t.map(|v| mesh.vertices.positions[v as usize].z < 0.5 * (BOX + WALL));
        bridges += mesh.triangles.iter().map(near).filter(|n| n.iter().any(|v| *v != n[0])).count() as f64;
        triangles += mesh.triangles.len() as f64;
        lost += (expected() - mesh.triangles.len() as f64).max(0.0);
        let view = mesh_depth(&mesh, &camera).expect("a view");
        let variance = view.variance.expect("known noise");
        for (i, variance) in variance.iter().enumerate().filter(|(_, v)| **v > 0.0) {
            let (x, y) = (i % 160, i / 160);
            let Some(z) = view.map.at(x, y) else { continue };
            let ray = camera.back_project(&Vector2::new(x as f64, y as f64)).expect("a ray");
            let axis = camera.pose.rotation.row(2).transpose().dot(&ray.direction);
            // Whichever plane is nearer to what was measured; the two are 0.8 m apart.
            let at = |plane: f64| (plane - ray.origin.z) / ray.direction.z * axis;
            let error = [BOX, WALL]
                .map(|plane| z - at(plane))
                .into_iter()
                .fold(f64::INFINITY, |a, b| if b.abs() < a.abs() { b } else { a });
            pixel_nees += error * error / f64::from(*variance);
            pixels += 1.0;
        }
        for (k, side) in sides.into_iter().enumerate() {
            let thinned = thin(&grid_cloud(&grid), side).expect("a cloud");
            for (i, p) in thinned.positions.iter().enumerate() {
                let variance = thinned.noise.covariance(i).expect("known noise").m33;
                let error = [BOX, WALL].map(|plane| (p.z - plane).abs()).into_iter().fold(f64::INFINITY, f64::min);
                point_nees[k] += error * error / variance;
                points[k] += 1.0;
            }
        }
    }
    let figure = |setup: &str, figure: f64, unit, bound: f64, ratio: f64, limit: f64| Figure {
        goal: "model",
        setup: format!("box before a wall, 47 x 43 shots: {setup}"),
        figure,
        unit,
        bound,
        ratio,
        limit,
        runs,
    };
    let nees = |sum: f64, n: f64| (sum / n).sqrt();
    let p = nees(pixel_nees, pixels);
    let [q, border] = [0, 1].map(|k| nees(point_nees[k], points[k]));
    report(vec![
        figure("depth map of the surface, error / stated", p, "", 1.0, p, 1.1),
        figure("cloud thinned to 0.26 m, error / stated", q, "", 1.0, q, 1.1),
        figure("cloud thinned to 0.2 m, surfaces on voxels' borders", border, "", 1.0, border, 2.0),
        figure("triangles from the box to the wall", bridges / runs as f64, "", 1.0, bridges / runs as f64, 0.0),
        figure("triangles lost besides, of a thousand", 1e3 * lost / triangles, "", 1.0, 1e3 * lost / triangles, 5.0),
    ]);
}

/// Triangles of all squares that are on one plane, and of the corners with three shots on one.
fn expected() -> f64 {
    let angle = |i: usize, n: usize| 0.45 * (2.0 * i as f64 / (n - 1) as f64 - 1.0);
    let near = |column: usize, row: usize| {
        let d = rotation_y(angle(column, COLUMNS)) * rotation_x(angle(row, ROWS)) * Vector3::z();
        depth(&d) < WALL
    };
    let mut count = 0.0;
    for (row, column) in (0..ROWS - 1).flat_map(|r| (0..COLUMNS - 1).map(move |c| (r, c))) {
        let on = [near(column, row), near(column + 1, row), near(column, row + 1), near(column + 1, row + 1)];
        count += match on.iter().filter(|n| **n).count() {
            0 | 4 => 2.0,
            1 | 3 => 1.0,
            _ => 0.0,
        };
    }
    count
}
