use super::*;
use crate::cloud::{SurfaceOptions, depth_grid, grid_cloud, triangulate};
use crate::geometry::{CloudNoise, Mesh};
use crate::image::{DepthMap, DepthNoise, Image, PixelFormat};

/// Spread in range among a triangle's corners, relative.
fn longest_jump(mesh: &Mesh) -> f64 {
    let jump = |t: usize| {
        let r = mesh.corners(t).map(|c| c.norm());
        r.iter().fold(0.0f64, |m, v| m.max(*v)) - r.iter().fold(f64::INFINITY, |m, v| m.min(*v))
    };
    (0..mesh.triangles.len()).map(jump).fold(0.0, f64::max)
}

fn whole(columns: usize, rows: usize) -> usize {
    2 * (columns - 1) * (rows - 1)
}

#[test]
fn a_wall_is_closed_and_faces_the_rig() {
    let grid = scan(23, 17, 0.5, 1e-4, 1, &|d| plane(Vector3::z(), 3.0, d));
    let mesh = triangulate(&grid, &SurfaceOptions::default()).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.vertices.len()), (whole(23, 17), 23 * 17));
    assert!(mesh.validate().is_ok());
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        assert!((b - a).cross(&(c - a)).dot(&a) < 0.0, "triangle {t} shows its back");
    }
    let normals = mesh.vertices.normals.unwrap();
    assert!(normals.iter().all(|n| n.z < -0.95));
    // Along the ray: rank one, sigma_r = sigma r^2.
    let deviation = mesh.vertices.noise.deviation(0).unwrap();
    assert!((deviation - 1e-4 * mesh.vertices.positions[0].norm_squared()).abs() < 1e-8);
}

/// Floor at up to 87 degrees of incidence, corners and balls are whole, with noise and without.
#[test]
fn what_is_steep_but_whole_is_not_cut() {
    let floor = |d: &Vector3<f64>| plane(Vector3::y(), 1.2, d);
    let room = |d: &Vector3<f64>| {
        let walls = [plane(Vector3::x(), 1.0, d), plane(Vector3::z(), 4.0, d), plane(Vector3::y(), 1.2, d)];
        walls.into_iter().flatten().min_by(f64::total_cmp)
    };
    for sigma in [1e-6, 1e-3] {
        // The floor fills the lower rows.
        let grid = scan(31, 41, 0.4, sigma, 2, &|d| if d.y > 0.05 { floor(d) } else { None });
        let measured = grid.points().iter().flatten().count();
        let mesh = triangulate(&grid, &SurfaceOptions::default()).unwrap();
        assert_eq!(mesh.triangles.len(), whole(31, measured / 31), "floor {sigma}");
        let grid = scan(41, 41, 0.7, sigma, 3, &room);
        let mesh = triangulate(&grid, &SurfaceOptions::default()).unwrap();
        let missing = whole(41, 41) - mesh.triangles.len();
        // Where three planes meet a diagonal may find no support.
        assert!(missing <= whole(41, 41) / 200, "room {sigma}: {missing} missing");
    }
}

/// A box before a wall: no triangle bridges the jump, at any scale, and nothing else is lost.
#[test]
fn a_box_before_a_wall_is_cut_off_it() {
    for scale in [0.01, 1.0, 1000.0] {
        let scene = |d: &Vector3<f64>| {
            let near = plane(Vector3::z(), 2.5 * scale, d)?;
            let hit = d * near;
            let on_box = hit.x.abs() < 0.3 * scale && hit.y.abs() < 0.4 * scale;
            if on_box { Some(near) } else { plane(Vector3::z(), 3.0 * scale, d) }
        };
        let grid = scan(61, 61, 0.5, 1e-4 / scale, 4, &scene);
        let mesh = triangulate(&grid, &SurfaceOptions::default()).unwrap();
        assert!(longest_jump(&mesh) < 0.2 * scale, "{scale}: {}", longest_jump(&mesh));
        // The ring of squares around the box, 15 x 20 positions, is what is lost.
        let lost = whole(61, 61) - mesh.triangles.len();
        assert!((80..=180).contains(&lost), "{scale}: {lost}");
    }
}

/// A jump of 8 cm at 3 m, seen at spacings of 5 cm, is kept as long as noise explains it.
#[test]
fn noise_decides_what_is_a_jump() {
    let scene = |d: &Vector3<f64>| plane(Vector3::z(), if d.x > 0.0 { 3.12 } else { 3.0 }, d);
    let triangles = |sigma: f64| {
        let grid = scan(40, 40, 0.33, sigma, 5, &scene);
        triangulate(&grid, &SurfaceOptions::default()).unwrap().triangles.len()
    };
    assert_eq!(triangles(1e-5), whole(40, 40) - 2 * 39);
    // 0.04 1/m is 36 cm at 3 m.
    assert!(triangles(0.04) > whole(40, 40) * 9 / 10);
}

#[test]
fn a_pole_one_ray_wide_hangs_on_nothing() {
    let columns = 21;
    let mut count = 0;
    let grid = scan(columns, 15, 0.4, 1e-4, 6, &|d| {
        let pan = d.x.atan2(d.z);
        if pan.abs() < 0.01 { Some(1.0) } else { plane(Vector3::z(), 3.0, d) }
    });
    let mesh = triangulate(&grid, &SurfaceOptions::default()).unwrap();
    for t in 0..mesh.triangles.len() {
        let near = mesh.corners(t).iter().filter(|c| c.norm() < 1.5).count();
        assert!(near == 0, "a triangle on the pole");
        count += 1;
    }
    assert_eq!(count, whole(columns, 15) - 2 * 2 * 14);
}

#[test]
fn missing_shots_are_holes_and_lonely_points_stay() {
    let full = scan(9, 7, 0.3, 1e-4, 7, &|d| plane(Vector3::z(), 2.0, d));
    let mut points = full.points().to_vec();
    points[3 * 9 + 4] = None;
    // Beyond infinity, and not told from it.
    points[9 + 1].as_mut().unwrap().point.rho = -0.1;
    points[5 * 9 + 7].as_mut().unwrap().point.rho = 2e-4;
    let grid = RayGrid::new(9, 7, points).unwrap();
    let mesh = triangulate(&grid, &SurfaceOptions::default()).unwrap();
    // Each hole takes six triangles or the eight of its squares, of which two are kept across.
    assert!(mesh.validate().is_ok());
    assert_eq!(mesh.triangles.len(), whole(9, 7) - 3 * 4);
    assert_eq!((mesh.vertices.len(), grid_cloud(&grid).len()), (9 * 7 - 3, 9 * 7 - 2));
    let alone = RayGrid::new(1, 1, full.points()[..1].to_vec()).unwrap();
    let mesh = triangulate(&alone, &SurfaceOptions::default()).unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (1, 0));
    let none = RayGrid::new(0, 0, vec![]).unwrap();
    assert!(triangulate(&none, &SurfaceOptions::default()).unwrap().vertices.is_empty());
}

#[test]
fn a_depth_map_becomes_a_surface_that_it_is_the_depth_of() {
    for lens in lenses() {
        let camera = camera(lens);
        let mut depths = Vec::new();
        for i in 0..320 * 240 {
            let ray = camera.back_project(&[f64::from(i % 320), f64::from(i / 320)].into()).unwrap();
            let t = (3.5 - ray.origin.z) / ray.direction.z;
            depths.push(camera.pose.apply(&ray.at(t)).z as f32);
        }
        depths[100 * 320 + 100] = 0.0;
        let map = DepthMap::new(320, 240, depths).unwrap();
        let mut image = Image::new(PixelFormat::Rgb24, 320, 240);
        image.data[3] = 77;
        let noise = DepthNoise::default();
        let grid = depth_grid(&map, &camera, Some(&image.view().unwrap()), &noise).unwrap();
        let mesh = triangulate(&grid, &SurfaceOptions::default()).unwrap();
        assert_eq!(mesh.triangles.len(), whole(320, 240) - 4);
        assert_eq!(mesh.vertices.colours[1], [77, 0, 0]);
        assert!(mesh.vertices.positions.iter().all(|p| (p.z - 3.5).abs() < 1e-6));
        // And back: the hole has grown to its neighbours.
        let view = crate::cloud::mesh_depth(&mesh, &camera).unwrap();
        for (x, y) in [(0usize, 0usize), (5, 200), (160, 120), (318, 238)] {
            let (seen, wanted) = (view.map.at(x, y).unwrap(), map.at(x, y).unwrap());
            assert!((seen - wanted).abs() < 1e-5 * wanted, "{lens:?} {x} {y}");
            let sigma = f64::from(view.variance.as_ref().unwrap()[y * 320 + x]).sqrt();
            let stated = noise.variance(1.0 / wanted).sqrt() * wanted * wanted;
            assert!((sigma / stated - 1.0).abs() < 0.05, "{lens:?} {x} {y}: {sigma} {stated}");
        }
        assert_eq!(view.map.at(100, 100), None);
        assert!(view.map.known() > 320 * 240 - 1200, "{}", view.map.known());
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let map = DepthMap::new(4, 3, vec![1.0; 12]).unwrap();
    let camera = camera(Distortion::None);
    assert!(depth_grid(&map, &camera, None, &DepthNoise::default()).is_err());
    let small = Camera { width: 4, height: 3, ..camera };
    assert!(depth_grid(&map, &small, None, &DepthNoise::default()).is_ok());
    let image = Image::new(PixelFormat::Gray8, 3, 3);
    assert!(depth_grid(&map, &small, Some(&image.view().unwrap()), &DepthNoise::default()).is_err());
    assert!(RayGrid::new(2, 2, vec![None; 3]).is_err());
    assert!(RayGrid::new(usize::MAX, usize::MAX, vec![None; 1]).is_err());
    let grid = RayGrid::new(2, 2, vec![None; 4]).unwrap();
    for options in [
        SurfaceOptions { max_incidence: 1.6, ..Default::default() },
        SurfaceOptions { max_incidence: f64::NAN, ..Default::default() },
        SurfaceOptions { significance: 0.0, ..Default::default() },
    ] {
        assert!(triangulate(&grid, &options).is_err());
    }
    assert_eq!(grid_cloud(&grid).noise, CloudNoise::Covariances(vec![]));
}
