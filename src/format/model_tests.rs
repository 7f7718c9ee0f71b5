//! A cloud and a mesh with everything that the formats can hold.

use nalgebra::Vector3;

use crate::geometry::{CloudNoise, Mesh, PointCloud, Texture};
use crate::image::{Image, PixelFormat};

/// Numbers that floats hold exactly.
pub fn cloud() -> PointCloud {
    let ray = [0.25, 0.125, 0.5, 0.0625, 0.25, 1.0];
    PointCloud {
        positions: vec![
            Vector3::new(-0.5, -0.25, 2.0),
            Vector3::new(0.5, -0.25, 2.0),
            Vector3::new(0.5, 0.5, 1.5),
            Vector3::new(-0.5, 0.5, 1.5),
            Vector3::new(0.0, 0.0, 1.0),
        ],
        colours: vec![[255, 0, 7], [10, 20, 30], [0, 0, 0], [255, 255, 255], [1, 2, 3]],
        normals: Some(vec![Vector3::new(0.0, 0.0, -1.0); 5]),
        noise: CloudNoise::Covariances(vec![ray, ray, [0.5, 0.0, 0.0, 0.5, 0.0, 0.5], ray, ray]),
    }
}

/// A square of one plain and one textured triangle, and a point of none.
pub fn mesh() -> Mesh {
    let mut image = Image::new(PixelFormat::Rgb24, 8, 4);
    image.data.iter_mut().enumerate().for_each(|(i, v)| *v = (i * 5 % 251) as u8);
    let places = vec![[0.0, 0.0], [7.0, 0.0], [7.0, 3.0], [0.0, 3.0], [0.0, 0.0]];
    let texture = Texture { image, places, triangles: vec![1] };
    Mesh { vertices: cloud(), triangles: vec![[0, 3, 1], [1, 3, 2]], textures: vec![texture] }
}

/// Equal but for the places' rounding.
pub fn same(found: &Mesh, wanted: &Mesh, rounding: f32) {
    assert_eq!(found.vertices, wanted.vertices);
    assert_eq!((&found.triangles, found.textures.len()), (&wanted.triangles, wanted.textures.len()));
    for (a, b) in found.textures.iter().zip(&wanted.textures) {
        assert_eq!((&a.image, &a.triangles), (&b.image, &b.triangles));
        let near = |a: &[f32; 2], b: &[f32; 2]| (a[0] - b[0]).abs() <= rounding && (a[1] - b[1]).abs() <= rounding;
        assert!(a.places.iter().zip(&b.places).all(|(a, b)| near(a, b)), "{:?} {:?}", a.places, b.places);
    }
}
