//! Pictures of calibrated cameras on a surface.

use nalgebra::Vector2;

use super::depth::{NONE, Nearest};
use super::lens::Lens;
use super::raster::rasterise;
use crate::error::{Error, Result};
use crate::geometry::mesh::MAX_TEXTURES;
use crate::geometry::{Camera, Mesh, Texture};
use crate::image::{Image, ImageView, PixelFormat};

/// Rounding of depths, relative.
const SAME_DEPTH: f32 = 1e-5;

/// A camera and what it saw.
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    pub image: ImageView<'a>,
    pub camera: &'a Camera,
}

/// Covers a surface with pictures, instead of what covers it now. Each triangle gets the picture that
/// shows its whole front, unhidden, with the most pixels; one that no picture shows keeps its vertices'
/// colours. Of each picture the part that is needed stays, of one that no triangle takes nothing. Returns how many triangles are covered.
///
/// A triangle's corners are where the lens images them; inside it the picture is stretched evenly,
/// which leaves out what perspective and distortion bend within one triangle.
///
/// # Errors
/// The mesh's and the cameras' own; `InvalidArgument` for an image of another size than its camera, and
/// for more than 256 pictures.
pub fn texture(mesh: &mut Mesh, pictures: &[Picture<'_>]) -> Result<usize> {
    mesh.textures.clear();
    mesh.validate()?;
    if pictures.len() > MAX_TEXTURES {
        return Err(Error::invalid("pictures", format!("{}, at most {MAX_TEXTURES}", pictures.len())));
    }
    let mut best = vec![(0u32, usize::MAX); mesh.triangles.len()];
    for (number, picture) in pictures.iter().enumerate() {
        let Picture { image, camera } = picture;
        if (image.width(), image.height()) != (camera.width, camera.height) {
            let (w, h) = (image.width(), image.height());
            let reason = format!("{w} x {h} pixels, its camera has {} x {}", camera.width, camera.height);
            return Err(Error::in_camera(number, Error::invalid("image", reason)));
        }
        let lens = Lens::new(camera, true).map_err(|e| Error::in_camera(number, e))?;
        for (best, score) in best.iter_mut().zip(scores(mesh, &lens)) {
            if score > best.0 {
                *best = (score, number);
            }
        }
    }
    for (number, picture) in pictures.iter().enumerate() {
        let triangles: Vec<u32> = (0u32..).zip(&best).filter(|(_, b)| b.1 == number).map(|(t, _)| t).collect();
        if triangles.is_empty() {
            continue;
        }
        mesh.textures.push(cut_out(mesh, picture, triangles));
    }
    Ok(mesh.textures.iter().map(|t| t.triangles.len()).sum())
}

/// The part of a picture that the triangles need.
fn cut_out(mesh: &Mesh, picture: &Picture<'_>, triangles: Vec<u32>) -> Texture {
    let mut places = vec![[0f32; 2]; mesh.vertices.len()];
    let (mut low, mut high) = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
    for vertex in triangles.iter().flat_map(|t| mesh.triangles[*t as usize]) {
        if let Some(at) = picture.camera.project(&mesh.vertices.positions[vertex as usize]) {
            places[vertex as usize] = [at.x as f32, at.y as f32];
            low = low.inf(&at);
            high = high.sup(&at);
        }
    }
    // With the pixels around, between which a viewer interpolates.
    let side = |low: f64, high: f64, size: u32| {
        let first = ((low.floor() - 1.0).max(0.0) as u32).min(size - 1);
        (first, ((high.ceil() + 2.0).max(0.0) as u32).clamp(first + 1, size))
    };
    let ((x0, x1), (y0, y1)) =
        (side(low.x, high.x, picture.image.width()), side(low.y, high.y, picture.image.height()));
    for place in &mut places {
        *place = [place[0] - x0 as f32, place[1] - y0 as f32];
    }
    Texture { image: packed(&picture.image, [x0, x1], [y0, y1]), places, triangles }
}

/// A part of an image as GRAY8 or RGB24.
fn packed(view: &ImageView<'_>, [x0, x1]: [u32; 2], [y0, y1]: [u32; 2]) -> Image {
    let grey = view.format() == PixelFormat::Gray8;
    let (format, channels) = if grey { (PixelFormat::Gray8, 1) } else { (PixelFormat::Rgb24, 3) };
    let pixels = (y0..y1).flat_map(|y| (x0..x1).map(move |x| view.rgb(x, y)));
    let data = pixels.flat_map(|rgb| rgb.into_iter().take(channels)).collect();
    Image { format, width: x1 - x0, height: y1 - y0, data }
}

/// For each triangle how well a picture shows it: 0 for not, else 1 + its pixels.
fn scores(mesh: &Mesh, lens: &Lens<'_>) -> Vec<u32> {
    let nearest = Nearest::of(mesh, lens);
    let (mut drawn, mut hidden) = (vec![0u32; mesh.triangles.len()], vec![false; mesh.triangles.len()]);
    rasterise(mesh, lens, &mut |hit| {
        drawn[hit.triangle] += 1;
        hidden[hit.triangle] |= hit.depth as f32 > nearest.depth[hit.pixel] * (1.0 + SAME_DEPTH);
    });
    let shown = |t: usize| {
        let corners = mesh.corners(t).map(|v| lens.camera.pose.apply(&v));
        let front = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).dot(&corners[0]) < 0.0;
        let inside = |at: Vector2<f64>| lens.camera.contains(&at);
        let whole = corners.iter().all(|c| lens.pixel(c).is_some_and(inside));
        front && whole && !hidden[t] && (drawn[t] > 0 || fine_triangle_is_seen(&corners, lens, &nearest))
    };
    (0..mesh.triangles.len()).map(|t| if shown(t) { 1 + drawn[t] } else { 0 }).collect()
}

/// A triangle between the pixels' centres: it is seen when what its pixel shows is no nearer than a
/// pixel is wide there.
fn fine_triangle_is_seen(corners: &[nalgebra::Vector3<f64>; 3], lens: &Lens<'_>, nearest: &Nearest) -> bool {
    let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    let Some(at) = lens.pixel(&centre) else { return false };
    let pixel = (at.y.round().max(0.0) as usize).min(lens.height - 1) * lens.width
        + (at.x.round().max(0.0) as usize).min(lens.width - 1);
    let footprint = centre.norm() * 2.0 * lens.fine;
    nearest.triangle[pixel] == NONE || f64::from(nearest.depth[pixel]) >= centre.z - footprint
}
