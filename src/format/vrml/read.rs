//! Reading VRML97: the faces and points of its shapes, with their colours and PixelTextures.

use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

use super::super::file::{format_error, read_bounded};
use super::syntax::{Node, Parser};
use crate::error::{Error, Result};
use crate::geometry::mesh::MAX_TEXTURES;
use crate::geometry::point_cloud::MAX_POINTS;
use crate::geometry::rigid::exp;
use crate::geometry::{Mesh, Texture};
use crate::image::view::MAX_SIDE;
use crate::image::{Image, PixelFormat};

/// A number takes 8 bytes of memory and at least 2 of the file.
const MAX_BYTES: u64 = 1 << 29;
/// Nodes of the scene: USE makes many of one.
const MAX_NODES: usize = 1 << 20;

/// Reads the shapes of a file as one mesh in our frame: IndexedFaceSet (faces of more than three
/// corners become fans) and PointSet below any Transform, Group, Anchor or Collision, with one colour a
/// vertex or none (white), and PixelTexture with places of the vertices. What else there is, is passed
/// over.
///
/// # Errors
/// `FileIo`; `FileFormat`, with the line; `Unsupported` above [`MAX_POINTS`] vertices or triangles.
pub fn read_vrml(path: &Path) -> Result<Mesh> {
    from_vrml(&read_bounded(path, MAX_BYTES)?, &path.display().to_string())
}

/// Reads a file's bytes; `name` is what errors call it.
pub fn from_vrml(bytes: &[u8], name: &str) -> Result<Mesh> {
    let wrong = |reason: String| format_error(name, reason);
    let text = std::str::from_utf8(bytes).map_err(|e| wrong(format!("not text at byte {}", e.valid_up_to())))?;
    if !text.starts_with("#VRML V2.0 utf8") {
        return Err(wrong("not a VRML 2.0 file".into()));
    }
    let nodes = Parser::new(text).nodes().map_err(wrong)?;
    let mut scene = Scene { name, mesh: Mesh::default(), bases: BTreeMap::new(), visited: 0 };
    // Half a turn about x, from y up to y down.
    let ours = Matrix4::from_diagonal(&Vector4::new(1.0, -1.0, -1.0, 1.0));
    for node in &nodes {
        scene.node(node, &ours)?;
    }
    let Scene { mut mesh, .. } = scene;
    let count = mesh.vertices.len();
    mesh.textures.iter_mut().for_each(|t| t.places.resize(count, [0.0; 2]));
    mesh.validate().map_err(|e| wrong(e.to_string()))?;
    Ok(mesh)
}

struct Scene<'a> {
    name: &'a str,
    mesh: Mesh,
    /// First vertex of every Coordinate node under a transform: shapes that USE one share it.
    bases: BTreeMap<(*const Node, [u64; 16]), usize>,
    visited: usize,
}

impl Scene<'_> {
    fn wrong<T>(&self, reason: impl Into<String>) -> Result<T> {
        Err(format_error(self.name, reason))
    }

    fn room(&self, have: usize, more: usize, what: &str) -> Result<()> {
        if have.saturating_add(more) > MAX_POINTS {
            return Err(Error::Unsupported { what: format!("{}: more than {MAX_POINTS} {what}", self.name) });
        }
        Ok(())
    }

    fn node(&mut self, node: &Node, parent: &Matrix4<f64>) -> Result<()> {
        self.visited += 1;
        if self.visited > MAX_NODES {
            return Err(Error::Unsupported { what: format!("{}: more than {MAX_NODES} nodes", self.name) });
        }
        match node.kind.as_str() {
            "Transform" => {
                let transform = parent * self.transform(node)?;
                self.children(node, &transform)
            }
            "Group" | "Anchor" | "Collision" => self.children(node, parent),
            "Shape" => match node.node("geometry") {
                Some(geometry) => self.shape(node, &geometry.clone(), parent),
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    fn children(&mut self, node: &Node, transform: &Matrix4<f64>) -> Result<()> {
        node.field("children").map_or(&[][..], |f| &f.nodes).iter().try_for_each(|child| self.node(child, transform))
    }

    /// T C R SR S -SR -C of the specification, of what people use of it.
    fn transform(&self, node: &Node) -> Result<Matrix4<f64>> {
        let vector = |name: &str, default: f64| match node.numbers(name) {
            [] => Ok(Vector3::repeat(default)),
            [x, y, z] => Ok(Vector3::new(*x, *y, *z)),
            other => self.wrong(format!("{name} of {} numbers", other.len())),
        };
        if node.field("scaleOrientation").is_some() {
            return Err(Error::Unsupported { what: format!("{}: scaleOrientation", self.name) });
        }
        let rotation = match node.numbers("rotation") {
            [] => Matrix3::identity(),
            [x, y, z, angle] => match Vector3::new(*x, *y, *z).try_normalize(1e-12) {
                Some(axis) => exp(&(axis * *angle)),
                None => Matrix3::identity(),
            },
            other => return self.wrong(format!("a rotation of {} numbers", other.len())),
        };
        let (t, c, s) = (vector("translation", 0.0)?, vector("center", 0.0)?, vector("scale", 1.0)?);
        let linear = rotation * Matrix3::from_diagonal(&s);
        Ok(linear.to_homogeneous().append_translation(&(t + c - linear * c)))
    }

    fn shape(&mut self, shape: &Node, geometry: &Node, transform: &Matrix4<f64>) -> Result<()> {
        let faces = match geometry.kind.as_str() {
            "IndexedFaceSet" => true,
            "PointSet" => false,
            _ => return Ok(()),
        };
        let Some(coordinate) = geometry.node("coord") else { return Ok(()) };
        let points = coordinate.numbers("point");
        if points.len() % 3 != 0 {
            return self.wrong(format!("{} coordinates of points", points.len()));
        }
        let count = points.len() / 3;
        // The tree lives as long as this: its addresses are its nodes' names.
        let key = (Rc::as_ptr(coordinate), std::array::from_fn(|i| transform.as_slice()[i].to_bits()));
        let base = match self.bases.get(&key) {
            Some(base) => *base,
            None => {
                let base = self.mesh.vertices.len();
                self.room(base, count, "vertices")?;
                for p in points.chunks_exact(3) {
                    let p = transform * Vector4::new(p[0], p[1], p[2], 1.0);
                    self.mesh.vertices.positions.push(p.xyz());
                    self.mesh.vertices.colours.push([255; 3]);
                }
                self.bases.insert(key, base);
                base
            }
        };
        self.colours(geometry, base, count)?;
        if !faces {
            return Ok(());
        }
        let first = self.mesh.triangles.len();
        let mirrored = transform.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        let clockwise = geometry.is("ccw", "FALSE") != mirrored;
        let mut corners = (None, None);
        for index in geometry.numbers("coordIndex") {
            if *index == -1.0 {
                corners = (None, None);
                continue;
            }
            if !(index.fract() == 0.0 && (0.0..count as f64).contains(index)) {
                return self.wrong(format!("a face has point {index} of {count}"));
            }
            let c = (base + *index as usize) as u32;
            corners = match corners {
                (None, _) => (Some(c), None),
                (a, None) => (a, Some(c)),
                (Some(a), Some(b)) => {
                    self.room(self.mesh.triangles.len(), 1, "triangles")?;
                    self.mesh.triangles.push(if clockwise { [a, c, b] } else { [a, b, c] });
                    (Some(a), Some(c))
                }
            };
        }
        self.texture(shape, geometry, base, first, count)
    }

    /// One colour a vertex.
    fn colours(&mut self, geometry: &Node, base: usize, count: usize) -> Result<()> {
        let Some(colour) = geometry.node("color") else { return Ok(()) };
        let colours = colour.numbers("color");
        let indexed = !geometry.numbers("colorIndex").is_empty() || geometry.is("colorPerVertex", "FALSE");
        if indexed || colours.len() < 3 * count {
            return Err(Error::Unsupported { what: format!("{}: colours that are not one a vertex", self.name) });
        }
        for (own, c) in self.mesh.vertices.colours[base..base + count].iter_mut().zip(colours.chunks_exact(3)) {
            *own = std::array::from_fn(|i| (c[i] * 255.0).round() as u8);
        }
        Ok(())
    }

    fn texture(&mut self, shape: &Node, geometry: &Node, base: usize, first: usize, count: usize) -> Result<()> {
        let picture = shape.node("appearance").and_then(|a| a.node("texture")).filter(|t| t.kind == "PixelTexture");
        let (Some(picture), Some(places)) = (picture, geometry.node("texCoord")) else { return Ok(()) };
        let places = places.numbers("point");
        if !geometry.numbers("texCoordIndex").is_empty() || places.len() < 2 * count {
            return Err(Error::Unsupported { what: format!("{}: places that are not one a vertex", self.name) });
        }
        if self.mesh.textures.len() >= MAX_TEXTURES {
            return Err(Error::Unsupported { what: format!("{}: more than {MAX_TEXTURES} textures", self.name) });
        }
        let image = self.picture(picture.numbers("image"))?;
        let [w, h] = [f64::from(image.width), f64::from(image.height)];
        let mut own = vec![[0.0; 2]; base + count];
        for (own, p) in own[base..].iter_mut().zip(places.chunks_exact(2)) {
            *own = [(p[0] * w - 0.5) as f32, ((1.0 - p[1]) * h - 0.5) as f32];
        }
        let triangles = (first as u32..self.mesh.triangles.len() as u32).collect();
        self.mesh.textures.push(Texture { image, places: own, triangles });
        Ok(())
    }

    /// Width, height, channels, and the pixels from the bottom row up.
    fn picture(&self, numbers: &[f64]) -> Result<Image> {
        let (size, pixels) = numbers.split_at(numbers.len().min(3));
        let side = |v: f64| (v.fract() == 0.0 && (1.0..=f64::from(MAX_SIDE)).contains(&v)).then_some(v as u32);
        let size = if let [w, h, c] = size { side(*w).zip(side(*h)).zip(Some(*c)) } else { None };
        let Some(((width, height), channels)) = size else { return self.wrong("a picture without a size") };
        let (format, shift) = match channels {
            1.0 => (PixelFormat::Gray8, 0),
            3.0 => (PixelFormat::Rgb24, 0),
            // With an alpha channel, which is dropped.
            2.0 => (PixelFormat::Gray8, 8),
            4.0 => (PixelFormat::Rgb24, 8),
            other => return self.wrong(format!("a picture of {other} channels")),
        };
        if pixels.len() as u64 != u64::from(width) * u64::from(height) {
            return self.wrong(format!("a picture of {width} x {height} with {} pixels", pixels.len()));
        }
        let mut data = Vec::with_capacity(pixels.len() * 3);
        for row in pixels.chunks_exact(width as usize).rev() {
            for pixel in row {
                let [_, r, g, b] = (*pixel as u32 >> shift).to_be_bytes();
                if format == PixelFormat::Gray8 { data.push(b) } else { data.extend([r, g, b]) }
            }
        }
        Ok(Image { format, width, height, data })
    }
}
