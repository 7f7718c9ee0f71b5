//! Triangulated surfaces, with pictures on them.

use nalgebra::Vector3;

use super::point_cloud::{PointCloud, check_count};
use crate::error::{Error, Result};
use crate::image::{Image, PixelFormat};

/// Most pictures on one mesh.
pub const MAX_TEXTURES: usize = 256;

/// A picture on some of a mesh's triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// GRAY8 or RGB24.
    pub image: Image,
    /// For each vertex of the mesh where it is in the image, pixels ((0, 0) is the centre of the
    /// top-left one); any finite numbers for those of no triangle below.
    pub places: Vec<[f32; 2]>,
    /// Indices of the triangles that it covers.
    pub triangles: Vec<u32>,
}

/// Triangles between the points of a cloud. Triangles that no texture covers have their vertices'
/// colours.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    pub vertices: PointCloud,
    /// Indices of vertices, counter-clockwise for who sees the front.
    pub triangles: Vec<[u32; 3]>,
    pub textures: Vec<Texture>,
}

/// A cloud is a mesh without triangles.
impl From<PointCloud> for Mesh {
    fn from(vertices: PointCloud) -> Self {
        Self { vertices, ..Self::default() }
    }
}

impl Mesh {
    /// Checks the vertices, that every index exists, and that no triangle has two textures.
    pub fn validate(&self) -> Result<()> {
        self.vertices.validate()?;
        check_count(self.triangles.len())?;
        let (vertices, triangles) = (self.vertices.len(), self.triangles.len());
        if let Some(i) = self.triangles.iter().position(|t| t.iter().any(|v| *v as usize >= vertices)) {
            let reason = format!("triangle {i} is of vertices {:?} of {vertices}", self.triangles[i]);
            return Err(Error::invalid("triangles", reason));
        }
        if self.textures.len() > MAX_TEXTURES {
            return Err(Error::invalid("textures", format!("{}, at most {MAX_TEXTURES}", self.textures.len())));
        }
        let mut covered = vec![false; if self.textures.is_empty() { 0 } else { triangles }];
        for (i, texture) in self.textures.iter().enumerate() {
            let wrong = |reason: String| Err(Error::invalid("textures", format!("texture {i}: {reason}")));
            if !matches!(texture.image.format, PixelFormat::Gray8 | PixelFormat::Rgb24) {
                return wrong(format!("its image is {:?}, not GRAY8 or RGB24", texture.image.format));
            }
            texture.image.view()?;
            if texture.places.len() != vertices {
                return wrong(format!("{} places for {vertices} vertices", texture.places.len()));
            }
            if texture.places.iter().flatten().any(|v| !v.is_finite()) {
                return wrong("a place is NaN or infinite".into());
            }
            for t in &texture.triangles {
                match covered.get_mut(*t as usize) {
                    Some(covered) if !*covered => *covered = true,
                    Some(_) => return wrong(format!("triangle {t} is covered twice")),
                    None => return wrong(format!("triangle {t} of {triangles}")),
                }
            }
        }
        Ok(())
    }

    /// The corners of a triangle that exists.
    pub fn corners(&self, triangle: usize) -> [Vector3<f64>; 3] {
        self.triangles[triangle].map(|v| self.vertices.positions[v as usize])
    }

    /// Indices of the triangles that no texture covers.
    pub fn untextured(&self) -> Vec<u32> {
        let mut covered = vec![false; self.triangles.len()];
        self.textures.iter().flat_map(|t| &t.triangles).for_each(|t| covered[*t as usize] = true);
        (0..self.triangles.len() as u32).filter(|t| !covered[*t as usize]).collect()
    }

    /// Gives the vertices normals: the mean of their triangles', weighted by area; zero for vertices
    /// of none.
    pub fn estimate_normals(&mut self) {
        let mut normals = vec![Vector3::zeros(); self.vertices.len()];
        for triangle in 0..self.triangles.len() {
            let [a, b, c] = self.corners(triangle);
            // Twice the area long.
            let normal = (b - a).cross(&(c - a));
            self.triangles[triangle].iter().for_each(|v| normals[*v as usize] += normal);
        }
        self.vertices.normals =
            Some(normals.iter().map(|n: &Vector3<f64>| n.try_normalize(0.0).unwrap_or_default()).collect());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Mesh {
        let corner = |x: f64, y: f64| Vector3::new(x, y, 1.0);
        let positions = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0), corner(5.0, 5.0)];
        let vertices = PointCloud { colours: vec![[9; 3]; 5], positions, ..Default::default() };
        Mesh { vertices, triangles: vec![[0, 3, 1], [1, 3, 2]], textures: vec![] }
    }

    #[test]
    fn normals_point_to_who_sees_counter_clockwise() {
        let mut mesh = square();
        mesh.estimate_normals();
        let normals = mesh.vertices.normals.as_ref().unwrap();
        // y is down: 0, 3, 1 turns counter-clockwise as seen from the origin.
        assert!(normals[..4].iter().all(|n| (n + Vector3::z()).norm() < 1e-12));
        assert_eq!(normals[4], Vector3::zeros());
        assert!(mesh.validate().is_ok());
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let texture =
            Texture { image: Image::new(PixelFormat::Rgb24, 4, 4), places: vec![[0.0; 2]; 5], triangles: vec![1] };
        let with = |change: &dyn Fn(&mut Texture)| {
            let mut mesh = Mesh { textures: vec![texture.clone()], ..square() };
            change(&mut mesh.textures[0]);
            mesh.validate()
        };
        assert!(with(&|_| {}).is_ok());
        assert!(with(&|t| t.triangles = vec![2]).is_err());
        assert!(with(&|t| t.triangles = vec![1, 1]).is_err());
        assert!(with(&|t| t.places[2][0] = f32::NAN).is_err());
        assert!(with(&|t| t.places.truncate(4)).is_err());
        assert!(with(&|t| t.image.format = PixelFormat::Bgr24).is_err());
        assert!(with(&|t| t.image.data.truncate(5)).is_err());
        let mesh = Mesh { triangles: vec![[0, 1, 5]], ..square() };
        assert!(mesh.validate().unwrap_err().to_string().contains("triangle 0"));
        let mesh = Mesh { textures: vec![texture], ..square() };
        assert_eq!(mesh.untextured(), [0]);
    }
}
