use super::*;
use crate::cloud::{Picture, SurfaceOptions, mesh_depth, texture, triangulate};
use crate::geometry::Mesh;
use crate::image::{Image, PixelFormat};
use nalgebra::Vector2;

/// What the world looks like at a point: no two directions alike, so that a mirror image shows.
fn paint(x: &Vector3<f64>) -> [u8; 3] {
    [128.0 + 60.0 * x.x, 128.0 + 60.0 * x.y, 128.0 + 40.0 * (3.0 * x.x - x.y).sin()].map(|v| v.clamp(0.0, 255.0) as u8)
}

/// The camera's picture of a painted mesh.
fn photograph(mesh: &Mesh, camera: &Camera) -> Image {
    let view = mesh_depth(mesh, camera).unwrap();
    let mut image = Image::new(PixelFormat::Rgb24, camera.width, camera.height);
    for (y, x) in (0..camera.height as usize).flat_map(|y| (0..camera.width as usize).map(move |x| (y, x))) {
        let Some(z) = view.map.at(x, y) else { continue };
        let ray = camera.back_project(&Vector2::new(x as f64, y as f64)).unwrap();
        let point = ray.at(z / camera.pose.rotation.row(2).transpose().dot(&ray.direction));
        let at = 3 * (y * camera.width as usize + x);
        image.data[at..at + 3].copy_from_slice(&paint(&point));
    }
    image
}

/// A wall with a box before it.
fn scene() -> Mesh {
    let grid = scan(81, 61, 0.45, 1e-6, 8, &|d| {
        let near = plane(Vector3::z(), 2.0, d)?;
        if (d.x * near + 0.1).abs() < 0.25 && (d.y * near).abs() < 0.3 {
            Some(near)
        } else {
            plane(Vector3::z(), 3.0, d)
        }
    });
    triangulate(&grid, &SurfaceOptions::default()).unwrap()
}

#[test]
fn what_a_triangle_shows_is_what_is_there() {
    for lens in lenses() {
        let camera = camera(lens);
        let mut mesh = scene();
        let image = photograph(&mesh, &camera);
        let covered = texture(&mut mesh, &[Picture { image: image.view().unwrap(), camera: &camera }]).unwrap();
        assert!(covered > mesh.triangles.len() / 3, "{lens:?} {covered} of {}", mesh.triangles.len());
        assert!(mesh.validate().is_ok());
        let texture = &mesh.textures[0];
        let view = mesh_depth(&mesh, &camera).unwrap();
        // Does a sample rounded to its pixel lie on the outline of the box?
        let outline = |at: &Vector2<f64>| {
            let [x, y] = [at.x.round() as usize, at.y.round() as usize];
            let around = (y..y + 3).flat_map(|y| (x..x + 3).map(move |x| (x.max(1) - 1, y.max(1) - 1)));
            let depths: Vec<_> = around.map(|(x, y)| view.map.at(x, y).unwrap_or(0.0)).collect();
            depths.iter().any(|z| (z - depths[4]).abs() > 0.3)
        };
        let (mut worst, mut samples) = (0, 0);
        for t in &texture.triangles {
            let corners = mesh.triangles[*t as usize];
            for weights in [[0.6, 0.2, 0.2], [0.2, 0.2, 0.6], [1.0 / 3.0; 3]] {
                let (mut at, mut point) = (Vector2::zeros(), Vector3::zeros());
                for (v, w) in corners.iter().zip(weights) {
                    let [x, y] = texture.places[*v as usize].map(f64::from);
                    at += Vector2::new(x, y) * w;
                    point += mesh.vertices.positions[*v as usize] * w;
                }
                if outline(&camera.project(&point).unwrap()) {
                    continue;
                }
                samples += 1;
                let picture = &texture.image;
                let i = 3 * (at.y.round() as usize * picture.width as usize + at.x.round() as usize);
                let truth = paint(&point);
                worst = (0..3).map(|c| picture.data[i + c].abs_diff(truth[c])).fold(worst, u8::max);
            }
        }
        // Half a pixel is 8 mm, or one and a half grey levels; the scene spans 200 of them.
        assert!(samples > 2 * texture.triangles.len());
        assert!(worst <= 4, "{lens:?}: {worst} grey levels");
    }
}

#[test]
fn hidden_triangles_keep_their_colours_and_the_nearer_picture_wins() {
    let mut mesh = scene();
    // From the left the box hides a strip of the wall on its right.
    let side = Camera {
        pose: Rigid::look_at(&Vector3::new(-1.5, 0.0, 0.5), &Vector3::new(0.0, 0.0, 2.8)).unwrap(),
        ..camera(Distortion::None)
    };
    let image = photograph(&mesh, &side);
    let picture = Picture { image: image.view().unwrap(), camera: &side };
    texture(&mut mesh, &[picture]).unwrap();
    let shadow = |p: &Vector3<f64>| {
        // Does the segment from the camera meet the box? Its mesh is up to a step of 23 mm smaller.
        let c = side.centre();
        let s = (2.0 - c.z) / (p.z - c.z);
        let hit = c + (p - c) * s;
        p.z > 2.5 && (hit.x + 0.1).abs() < 0.22 && hit.y.abs() < 0.27
    };
    let mut hidden = 0;
    let seen: std::collections::BTreeSet<u32> = mesh.textures[0].triangles.iter().copied().collect();
    for t in 0..mesh.triangles.len() {
        if shadow(&(mesh.corners(t).iter().sum::<Vector3<f64>>() / 3.0)) {
            hidden += 1;
            assert!(!seen.contains(&(t as u32)), "triangle {t} is behind the box");
        }
    }
    assert!(hidden > 50, "{hidden}");
    // Twice as near: more pixels for each triangle that both show.
    let near =
        Camera { pose: Rigid::look_at(&Vector3::new(0.0, 0.0, 1.2), &Vector3::new(0.0, 0.0, 3.0)).unwrap(), ..side };
    let close = photograph(&mesh, &near);
    let both = [picture, Picture { image: close.view().unwrap(), camera: &near }];
    let covered = texture(&mut mesh, &both).unwrap();
    assert_eq!(mesh.textures.len(), 2);
    assert_eq!(covered + mesh.untextured().len(), mesh.triangles.len());
    let alone = texture(&mut mesh.clone(), &both[1..]).unwrap();
    assert!(mesh.textures[1].triangles.len() * 10 > alone * 9);
    // From behind nothing is seen.
    let behind = Camera { pose: Rigid::look_at(&Vector3::new(0.0, 0.0, 6.0), &Vector3::zeros()).unwrap(), ..side };
    let back = photograph(&mesh, &behind);
    assert_eq!(texture(&mut mesh, &[Picture { image: back.view().unwrap(), camera: &behind }]), Ok(0));
    assert!(mesh.textures.is_empty());
}

/// More triangles than pixels: a depth map's own picture.
#[test]
fn triangles_finer_than_pixels_are_seen_too() {
    let grid = scan(201, 151, 0.3, 1e-9, 9, &|d| plane(Vector3::z(), 3.0, d));
    let mut mesh = triangulate(&grid, &SurfaceOptions::default()).unwrap();
    let coarse = Camera {
        width: 64,
        height: 48,
        intrinsics: Intrinsics::new(50.0, 31.5, 23.5),
        pose: Rigid::identity(),
        ..camera(Distortion::None)
    };
    let image = photograph(&mesh, &coarse);
    let covered = texture(&mut mesh, &[Picture { image: image.view().unwrap(), camera: &coarse }]).unwrap();
    assert_eq!(covered, mesh.triangles.len());
}

#[test]
fn pictures_of_other_cameras_are_refused() {
    let mut mesh = scene();
    let camera = camera(Distortion::None);
    let image = Image::new(PixelFormat::Gray8, 64, 48);
    let e = texture(&mut mesh, &[Picture { image: image.view().unwrap(), camera: &camera }]).unwrap_err();
    assert_eq!(e.index(), Some(0));
    assert_eq!(texture(&mut mesh, &[]), Ok(0));
}
