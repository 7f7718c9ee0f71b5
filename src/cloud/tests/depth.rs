use super::*;
use crate::cloud::{cloud_depth, mesh_depth};
use crate::geometry::point_cloud::pack;
use crate::geometry::{CloudNoise, Mesh, PointCloud};
use nalgebra::Vector2;

/// A triangle whose plane is n . x = 1, far larger than any view.
fn huge(n: Vector3<f64>) -> Mesh {
    let across = n.cross(&Vector3::new(0.3, 1.0, 0.2)).normalize();
    let along = n.cross(&across).normalize();
    let foot = n / n.norm_squared();
    let corner = |a: f64| foot + (across * a.cos() + along * a.sin()) * 400.0;
    let vertices = PointCloud {
        positions: vec![corner(0.3), corner(2.4), corner(4.5)],
        colours: vec![[255; 3]; 3],
        ..Default::default()
    };
    Mesh { vertices, triangles: vec![[0, 1, 2]], textures: vec![] }
}

/// Every pixel whose ray meets the plane in front has its depth, exactly, whatever the lens; corners
/// behind the camera and beyond the lens's fold do not matter.
#[test]
fn a_plane_is_exact_at_every_pixel_of_every_lens() {
    for lens in lenses() {
        let camera = camera(lens);
        for n in [Vector3::new(0.05, 0.02, 0.3), Vector3::new(0.1, 0.8, 0.1), Vector3::new(-0.9, 0.1, 0.2)] {
            let view = mesh_depth(&huge(n), &camera).unwrap();
            let (mut known, mut wrong) = (0, 0);
            for (y, x) in (0..240).flat_map(|y| (0..320).map(move |x| (y, x))) {
                let ray = camera.back_project(&Vector2::new(x as f64, y as f64)).unwrap();
                let t = (1.0 - n.dot(&ray.origin)) / n.dot(&ray.direction);
                // The triangle ends at 200 m at the least.
                let truth = (t > 0.0 && t < 150.0).then(|| camera.pose.apply(&ray.at(t)).z);
                let Some(z) = truth else { continue };
                known += 1;
                let seen = view.map.at(x, y);
                // Depths are floats.
                wrong += usize::from(seen.is_none_or(|s| (s / z - 1.0).abs() > 1e-6));
            }
            assert!(known > 5000, "{lens:?} {n}: {known}");
            assert_eq!(wrong, 0, "{lens:?} {n}: of {known}");
        }
    }
}

#[test]
fn the_nearer_surface_hides_the_farther_and_gaps_stay_unknown() {
    let camera =
        Camera { pose: Rigid::identity(), ..camera(Distortion::BrownConrady([-0.28, 0.09, 0.001, -0.002, 0.0])) };
    let square = |x: f64, half: f64, z: f64| {
        [(-1, -1), (1, -1), (1, 1), (-1, 1)].map(|(a, b)| Vector3::new(x + half * f64::from(a), half * f64::from(b), z))
    };
    let positions = [square(0.0, 0.4, 3.0), square(0.1, 0.1, 2.0), square(0.0, 5.0, -2.0)].concat();
    let vertices = PointCloud { colours: vec![[0; 3]; 12], positions, ..Default::default() };
    let triangles = [0, 4, 8].iter().flat_map(|i| [[*i, i + 1, i + 2], [*i, i + 2, i + 3]]).collect();
    let view = mesh_depth(&Mesh { vertices, triangles, textures: vec![] }, &camera).unwrap();
    let depth = |x: f64, y: f64, z: f64| {
        let p = camera.project(&Vector3::new(x, y, z)).unwrap();
        view.map.at(p.x.round() as usize, p.y.round() as usize)
    };
    assert_eq!((depth(0.1, 0.0, 2.0), depth(-0.2, 0.1, 3.0)), (Some(2.0), Some(3.0)));
    assert_eq!((depth(0.6, 0.0, 3.0), depth(0.0, -0.6, 3.0)), (None, None));
    assert_eq!(view.variance, None);
    // No cracks: inside the far square's outline all pixels are known.
    let [low, high] = [-0.39, 0.39].map(|c| camera.project(&Vector3::new(c, c, 3.0)).unwrap());
    for y in low.y.ceil() as usize..high.y as usize {
        assert!((low.x.ceil() as usize + 1..high.x as usize).all(|x| view.map.at(x, y).is_some()));
    }
}

/// Against 4000 noisy copies of a slanted triangle.
#[test]
fn the_variance_is_that_of_noisy_copies() {
    let camera = camera(Distortion::None);
    let mut random = Random(11);
    let positions: Vec<_> = [[-1.0, -0.8, 2.5], [1.3, -0.5, 3.5], [0.1, 1.4, 3.0]].map(Vector3::from).to_vec();
    let (sigma, mut covariances) = ([0.002, 0.004, 0.003], Vec::new());
    covariances.extend((0..3).map(|i| pack(&(positions[i] * positions[i].transpose() * f64::powi(sigma[i], 2)))));
    let mesh = |positions: Vec<Vector3<f64>>| {
        let noise = CloudNoise::Covariances(covariances.clone());
        let vertices = PointCloud { positions, colours: vec![[0; 3]; 3], normals: None, noise };
        Mesh { vertices, triangles: vec![[0, 1, 2]], textures: vec![] }
    };
    let small = Camera { width: 32, height: 24, intrinsics: Intrinsics::new(28.0, 16.1, 11.85), ..camera };
    let stated = mesh_depth(&mesh(positions.clone()), &small).unwrap();
    let pixels: Vec<(usize, usize)> = vec![(16, 12), (12, 10), (19, 9), (15, 15)];
    let mut sums = vec![0.0; pixels.len()];
    for _ in 0..4000 {
        let noisy = (0..3).map(|i| positions[i] * (1.0 + sigma[i] * gauss(&mut random))).collect();
        let view = mesh_depth(&mesh(noisy), &small).unwrap();
        for (sum, (x, y)) in sums.iter_mut().zip(&pixels) {
            *sum += (view.map.at(*x, *y).unwrap() - stated.map.at(*x, *y).unwrap()).powi(2) / 4000.0;
        }
    }
    for (sum, (x, y)) in sums.iter().zip(&pixels) {
        let variance = f64::from(stated.variance.as_ref().unwrap()[y * 32 + x]);
        // 3 standard deviations of a sample variance: 7 %.
        assert!((sum / variance - 1.0).abs() < 0.08, "{x} {y}: {sum} {variance}");
    }
}

#[test]
fn points_fall_into_their_pixels_and_the_nearest_counts() {
    for lens in lenses() {
        let camera = camera(lens);
        let ray = camera.back_project(&Vector2::new(200.3, 99.6)).unwrap();
        let behind = camera.pose.inverse().apply(&Vector3::new(0.0, 0.0, -2.0));
        // Beyond the fold a polynomial comes back into the image.
        let aside = camera.pose.inverse().apply(&Vector3::new(9.0, 0.0, 3.0));
        let positions = vec![ray.at(3.0), ray.at(2.0), behind, aside];
        let sigma = 0.01;
        let noise =
            CloudNoise::Covariances(vec![pack(&(ray.direction * ray.direction.transpose() * sigma * sigma)); 4]);
        let cloud = PointCloud { colours: vec![[0; 3]; 4], positions, normals: None, noise };
        let view = cloud_depth(&cloud, &camera).unwrap();
        let wanted = camera.pose.apply(&ray.at(2.0)).z;
        assert!((view.map.at(200, 100).unwrap() - wanted).abs() < 1e-6, "{lens:?}");
        assert_eq!(view.map.known(), 1, "{lens:?}");
        let variance = view.variance.unwrap();
        let along = (camera.pose.rotation * ray.direction).z * sigma;
        assert!((f64::from(variance[100 * 320 + 200]).sqrt() - along).abs() < 1e-6);
        assert_eq!(variance.iter().filter(|v| **v > 0.0).count(), 1);
    }
}

#[test]
fn bad_cameras_and_clouds_are_refused() {
    let camera = camera(Distortion::None);
    let mesh = huge(Vector3::z());
    let wide = Camera { width: 65_536, height: 65_536, ..camera };
    assert!(mesh_depth(&mesh, &wide).unwrap_err().to_string().contains("pixels"));
    let broken = Camera { intrinsics: Intrinsics::new(f64::NAN, 1.0, 1.0), ..camera };
    assert!(mesh_depth(&mesh, &broken).is_err() && cloud_depth(&mesh.vertices, &broken).is_err());
    let nan = PointCloud { positions: vec![Vector3::repeat(f64::NAN)], colours: vec![[0; 3]], ..Default::default() };
    assert!(cloud_depth(&nan, &camera).is_err());
    assert_eq!(cloud_depth(&PointCloud::default(), &camera).unwrap().map.known(), 0);
    assert_eq!(mesh_depth(&Mesh::default(), &camera).unwrap().map.known(), 0);
    // Degenerate triangles have no depth.
    let flat = Mesh { triangles: vec![[0, 0, 1], [2, 2, 2]], ..mesh };
    assert_eq!(mesh_depth(&flat, &camera).unwrap().map.known(), 0);
}
