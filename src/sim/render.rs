//! Pictures of the room: what a camera sees, before noise and laser light.
//!
//! The image is cut into blocks. Where one flat face fills a block (most blocks) its texture
//! coordinates are a homography of the pixel; where edges cross a block every pixel gets its own ray,
//! and the block is blurred a little, as the lens would, so that edges are not jagged.

use nalgebra::{Vector2, Vector3};

use super::scene::{self, BOXES, Candidates, FACES, Face, Hit, Person, ROOM};
use super::texture::{self, Texture};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Rigid};

/// Side of a block, px. Between its corners the lens is taken as bilinear, which is off by less than
/// 0.01 px for lenses such as ours.
const BLOCK: usize = 8;

/// Fractional bits of a brightness, grey levels.
pub const FRACTION: u32 = 4;

/// A camera's lens and image, ready to render from any pose.
pub struct Renderer {
    width: usize,
    height: usize,
    colour: bool,
    columns: usize,
    rows: usize,
    /// Ideal position on the normalised plane of the blocks' top-left pixels, row by row.
    nodes: Vec<[f32; 2]>,
}

impl Renderer {
    /// # Errors
    /// `LensNotMonotone` when the lens model does not reach the image's corners.
    pub fn new(camera: &Camera, colour: bool) -> Result<Self> {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
        let mut nodes = Vec::with_capacity((columns + 1) * (rows + 1));
        for j in 0..=rows {
            for i in 0..=columns {
                let pixel = Vector2::new((i * BLOCK) as f64, (j * BLOCK) as f64);
                let centre = Vector2::new(camera.intrinsics.cx, camera.intrinsics.cy);
                let lost = || Error::LensNotMonotone { radius_px: (pixel - centre).norm() };
                nodes.push(camera.undistort_pixel(&pixel).ok_or_else(lost)?.map(|c| c as f32).into());
            }
        }
        Ok(Self { width, height, colour, columns, rows, nodes })
    }

    pub fn channels(&self) -> usize {
        if self.colour { 3 } else { 1 }
    }

    /// Brightness of every pixel from a pose (room to camera): grey levels with [`FRACTION`] bits
    /// below the point, blue, green, red or luma alone.
    pub fn render(&self, pose: &Rigid, out: &mut [u16]) {
        if self.colour { self.render_channels::<3>(pose, out) } else { self.render_channels::<1>(pose, out) }
    }

    fn render_channels<const C: usize>(&self, pose: &Rigid, out: &mut [u16]) {
        let eye = Eye::new(pose);
        let faces: Vec<FaceSampler> = (0..FACES).map(|f| FaceSampler::new(f, &eye)).collect();
        let boxes = eye.box_outlines();
        let hits: Vec<Hit> = self.nodes.iter().map(|n| eye.cast(*n, scene::ALL_BOXES)).collect();
        let mut mixed = Vec::new();
        for j in 0..self.rows {
            for i in 0..self.columns {
                let corners = self.corners(i, j);
                let block = Bounds::of(corners.map(|c| self.nodes[c]));
                let deepest = corners.iter().map(|&c| hits[c].distance).fold(0.0, f64::max);
                let face = hits[corners[0]].face;
                // Faces are convex: one that covers a block's corners covers the block, unless a box
                // reaches in front of it.
                let candidates = candidates(&boxes, &block);
                let hiding = boxes.iter().enumerate().any(|(b, outline)| {
                    let nearer = outline.as_ref().is_some_and(|o| o.nearest < deepest);
                    candidates >> b & 1 == 1 && nearer && face / 6 != b + 1
                });
                if !hiding && corners.iter().all(|&c| hits[c].face == face) {
                    self.fill_flat::<C>(i, j, &faces[face], out);
                } else {
                    self.fill_mixed::<C>(i, j, &eye, &faces, candidates, out);
                    mixed.push((i, j));
                }
            }
        }
        self.blur::<C>(&mixed, out);
    }

    /// Nodes at a block's corners: top left, top right, bottom left, bottom right.
    fn corners(&self, i: usize, j: usize) -> [usize; 4] {
        let at = j * (self.columns + 1) + i;
        [at, at + 1, at + self.columns + 1, at + self.columns + 2]
    }

    /// Ideal position of pixel (0, y) of a block (y counted in the block) and its step along the row.
    fn block_row(&self, i: usize, j: usize, y: usize) -> ([f32; 2], [f32; 2]) {
        let [top_left, top_right, bottom_left, bottom_right] = self.corners(i, j).map(|c| self.nodes[c]);
        let down = y as f32 / BLOCK as f32;
        let side = |top: [f32; 2], bottom: [f32; 2]| -> [f32; 2] {
            std::array::from_fn(|k| top[k] + (bottom[k] - top[k]) * down)
        };
        let (left, right) = (side(top_left, bottom_left), side(top_right, bottom_right));
        (left, std::array::from_fn(|k| (right[k] - left[k]) / BLOCK as f32))
    }

    /// Pixels of a block: its left column, its top row, its width and height.
    fn block_extent(&self, i: usize, j: usize) -> (usize, usize, usize, usize) {
        let (x, y) = (i * BLOCK, j * BLOCK);
        (x, y, BLOCK.min(self.width - x), BLOCK.min(self.height - y))
    }

    fn fill_flat<const C: usize>(&self, i: usize, j: usize, face: &FaceSampler, out: &mut [u16]) {
        let (x, y, w, h) = self.block_extent(i, j);
        for row in 0..h {
            let (start, step) = self.block_row(i, j, row);
            let (u, v) = face.run::<BLOCK>(start, step);
            let at = C * ((y + row) * self.width + x);
            for (pixel, (u, v)) in out[at..at + C * w].chunks_exact_mut(C).zip(u.into_iter().zip(v)) {
                put::<C>(pixel, face.sample(u, v));
            }
        }
    }

    fn fill_mixed<const C: usize>(
        &self,
        i: usize,
        j: usize,
        eye: &Eye,
        faces: &[FaceSampler],
        candidates: Candidates,
        out: &mut [u16],
    ) {
        let (x, y, w, h) = self.block_extent(i, j);
        for row in 0..h {
            let (start, step) = self.block_row(i, j, row);
            let at = C * ((y + row) * self.width + x);
            for (column, pixel) in out[at..at + C * w].chunks_exact_mut(C).enumerate() {
                let ideal = std::array::from_fn(|k| start[k] + step[k] * column as f32);
                let face = &faces[eye.cast(ideal, candidates).face];
                let ([u], [v]) = face.run(ideal, [0.0; 2]);
                put::<C>(pixel, face.sample(u, v));
            }
        }
    }

    /// Binomial 3x3 blur of the given blocks.
    fn blur<const C: usize>(&self, blocks: &[(usize, usize)], image: &mut [u16]) {
        let stride = C * self.width;
        // All are blurred before any is written, so that none is blurred from a blurred neighbour.
        let mut blurred = Vec::with_capacity(blocks.len() * BLOCK * BLOCK * C);
        for &(i, j) in blocks {
            let (x, y, w, h) = self.block_extent(i, j);
            for row in y..y + h {
                let rows = [row.saturating_sub(1), row, (row + 1).min(self.height - 1)].map(|r| &image[r * stride..]);
                for column in x..x + w {
                    let near = [column.saturating_sub(1), column, (column + 1).min(self.width - 1)].map(|c| C * c);
                    for c in 0..C {
                        let line = |r: &[u16]| {
                            let [left, middle, right] = near.map(|at| u32::from(r[at + c]));
                            left + 2 * middle + right
                        };
                        let sum = line(rows[0]) + 2 * line(rows[1]) + line(rows[2]);
                        blurred.push(((sum + 8) / 16) as u16);
                    }
                }
            }
        }
        let mut next = blurred.into_iter();
        for &(i, j) in blocks {
            let (x, y, w, h) = self.block_extent(i, j);
            for row in y..y + h {
                let pixels = &mut image[row * stride + C * x..][..C * w];
                pixels.iter_mut().zip(&mut next).for_each(|(pixel, value)| *pixel = value);
            }
        }
    }

    /// The pixels where a person is seen: calls `paint` with x, y and red, green, blue in grey levels.
    pub fn person(&self, pose: &Rigid, person: &Person, mut paint: impl FnMut(usize, usize, [f64; 3])) {
        let eye = Eye::new(pose);
        let (left, right) = (person.x - Person::HALF_WIDTH, person.x + Person::HALF_WIDTH);
        let (top, bottom) = (ROOM.high[1] - Person::HEIGHT, ROOM.high[1]);
        let corners = [[left, top], [right, top], [left, bottom], [right, bottom]];
        let Some(bounds) = eye.bounds(corners.map(|[x, y]| Vector3::new(x, y, Person::DEPTH))) else { return };
        for j in 0..self.rows {
            for i in 0..self.columns {
                if !bounds.touches(&Bounds::of(self.corners(i, j).map(|c| self.nodes[c]))) {
                    continue;
                }
                let (x, y, w, h) = self.block_extent(i, j);
                for row in 0..h {
                    let (start, step) = self.block_row(i, j, row);
                    for column in 0..w {
                        let way = eye.direction(std::array::from_fn(|k| start[k] + step[k] * column as f32));
                        let distance = (Person::DEPTH - eye.centre.z) / way.z;
                        let p = eye.centre + way * distance;
                        let Some(albedo) = person.albedo(p.x, p.y) else { continue };
                        if distance > 0.0 && scene::cast(&eye.centre, &way, scene::ALL_BOXES).distance > distance {
                            paint(x + column, y + row, albedo.map(|a| 230.0 * a));
                        }
                    }
                }
            }
        }
    }
}

fn put<const C: usize>(pixel: &mut [u16], [r, g, b]: [u16; 3]) {
    if C == 3 {
        (pixel[0], pixel[1], pixel[2]) = (b, g, r);
    } else {
        pixel[0] = luma([r, g, b]);
    }
}

/// BT.601 luma.
fn luma([r, g, b]: [u16; 3]) -> u16 {
    ((77 * u32::from(r) + 150 * u32::from(g) + 29 * u32::from(b)) >> 8) as u16
}

/// A camera's place in the room.
struct Eye {
    centre: Vector3<f64>,
    pose: Rigid,
}

impl Eye {
    fn new(pose: &Rigid) -> Self {
        Self { centre: pose.centre(), pose: *pose }
    }

    /// Direction in the room of an ideal image point.
    fn direction(&self, [x, y]: [f32; 2]) -> Vector3<f64> {
        self.pose.rotation.tr_mul(&Vector3::new(f64::from(x), f64::from(y), 1.0))
    }

    /// Along the ray of an ideal image point; the distance is the depth along the optical axis.
    fn cast(&self, ideal: [f32; 2], candidates: Candidates) -> Hit {
        scene::cast(&self.centre, &self.direction(ideal), candidates)
    }

    /// Bounding rectangle of points on the normalised plane: everything when some are behind the
    /// camera, `None` when all are.
    fn bounds<const N: usize>(&self, points: [Vector3<f64>; N]) -> Option<Bounds> {
        const NEAR: f64 = 0.02;
        let seen = points.map(|p| self.pose.apply(&p));
        match seen.iter().filter(|p| p.z > NEAR).count() {
            0 => None,
            n if n < N => Some(Bounds::EVERYTHING),
            _ => Some(Bounds::of(seen.map(|p| [(p.x / p.z) as f32, (p.y / p.z) as f32]))),
        }
    }

    /// `None` for boxes behind the camera.
    fn box_outlines(&self) -> [Option<Outline>; BOXES.len()] {
        BOXES.map(|solid| {
            let corners: [Vector3<f64>; 8] = std::array::from_fn(|k| {
                Vector3::from_fn(|axis, _| if k >> axis & 1 == 0 { solid.low[axis] } else { solid.high[axis] })
            });
            let nearest = corners.iter().map(|c| self.pose.apply(c).z).fold(f64::INFINITY, f64::min);
            Some(Outline { bounds: self.bounds(corners)?, nearest })
        })
    }
}

/// Where a box may be seen, and its least depth.
struct Outline {
    bounds: Bounds,
    nearest: f64,
}

/// A rectangle on the normalised plane.
#[derive(Clone, Copy)]
struct Bounds {
    low: [f32; 2],
    high: [f32; 2],
}

impl Bounds {
    const EVERYTHING: Self = Self { low: [f32::NEG_INFINITY; 2], high: [f32::INFINITY; 2] };
    /// Guards against blocks whose edges bend outwards by a fraction of a pixel.
    const MARGIN: f32 = 2e-4;

    fn of<const N: usize>(points: [[f32; 2]; N]) -> Self {
        let start = Self { low: [f32::INFINITY; 2], high: [f32::NEG_INFINITY; 2] };
        points.iter().fold(start, |b, p| Self {
            low: std::array::from_fn(|k| b.low[k].min(p[k])),
            high: std::array::from_fn(|k| b.high[k].max(p[k])),
        })
    }

    fn touches(&self, other: &Self) -> bool {
        (0..2).all(|k| self.low[k] <= other.high[k] + Self::MARGIN && other.low[k] <= self.high[k] + Self::MARGIN)
    }
}

fn candidates(boxes: &[Option<Outline>], block: &Bounds) -> Candidates {
    let touched = |outline: &Option<Outline>| outline.as_ref().is_some_and(|o| o.bounds.touches(block));
    boxes.iter().enumerate().filter(|(_, outline)| touched(outline)).fold(0, |set, (b, _)| set | 1 << b)
}

/// A face's texture seen from one eye: texel = (u, v) / w with u, v, w linear in the ideal image
/// position (x, y, 1).
struct FaceSampler {
    u: [f32; 3],
    v: [f32; 3],
    w: [f32; 3],
    texture: &'static Texture,
    limit: [f32; 2],
}

impl FaceSampler {
    fn new(index: usize, eye: &Eye) -> Self {
        let face = Face::new(index);
        let texture = &texture::all()[index];
        // A ray meets the face at 1 / w of its direction's length.
        let to_plane = face.plane - eye.centre[face.axis];
        let form = |axis: usize| -> [f64; 3] { std::array::from_fn(|k| eye.pose.rotation[(k, axis)]) };
        let w = form(face.axis).map(|c| c / to_plane);
        let along = |axis: usize, corner: f64| -> [f32; 3] {
            let start = (eye.centre[axis] - corner) * texture.texels_per_metre - 0.5;
            let slope = form(axis).map(|c| c * texture.texels_per_metre);
            std::array::from_fn(|k| (slope[k] + start * w[k]) as f32)
        };
        Self {
            u: along(face.u_axis, face.corner[0]),
            v: along(face.v_axis, face.corner[1]),
            w: w.map(|c| c as f32),
            texture,
            limit: [texture.width, texture.height].map(|n| (n - 1) as f32 * 256.0 - 1.0),
        }
    }

    /// Texel coordinates u and v, 8 fractional bits, of `N` pixels in a row.
    #[inline(always)]
    fn run<const N: usize>(&self, start: [f32; 2], step: [f32; 2]) -> ([u32; N], [u32; N]) {
        // Adding 2^23 leaves the rounded whole number in the low bits: a conversion that vectorises.
        const MAGIC: f32 = 8_388_608.0;
        let along = |form: &[f32; 3]| -> [f32; N] {
            let first = form[0] * start[0] + form[1] * start[1] + form[2];
            let slope = form[0] * step[0] + form[1] * step[1];
            std::array::from_fn(|i| first + slope * i as f32)
        };
        let (u, v, w) = (along(&self.u), along(&self.v), along(&self.w));
        let scale = w.map(|w| 256.0 / w);
        let fixed = |c: [f32; N], limit: f32| -> [u32; N] {
            std::array::from_fn(|i| ((c[i] * scale[i]).min(limit).max(0.0) + MAGIC).to_bits() & 0x7F_FFFF)
        };
        (fixed(u, self.limit[0]), fixed(v, self.limit[1]))
    }

    /// Bilinear interpolation: red, green, blue in grey levels with [`FRACTION`] bits.
    #[inline(always)]
    fn sample(&self, u: u32, v: u32) -> [u16; 3] {
        let (fu, fv) = (u & 255, v & 255);
        let at = (v >> 8) as usize * self.texture.width + (u >> 8) as usize;
        let top = &self.texture.texels[at..at + 2];
        let bottom = &self.texture.texels[at + self.texture.width..][..2];
        // The weights sum to 256, so that red and blue, 16 bits apart, do not run into each other.
        let both = (fu * fv) >> 8;
        let parts = [(top[0], 256 + both - fu - fv), (top[1], fu - both), (bottom[0], fv - both), (bottom[1], both)];
        let red_blue: u32 = parts.iter().map(|(t, weight)| (t & 0xFF_00FF) * weight).sum();
        let green: u32 = parts.iter().map(|(t, weight)| (t >> 8 & 0xFF) * weight).sum();
        [red_blue & 0xFFFF, green, red_blue >> 16].map(|sum| sum as u16 >> (8 - FRACTION))
    }
}

#[cfg(test)]
mod tests {
    use super::super::rig;
    use super::*;

    /// One ray and one bilinear look-up for each pixel, in double precision.
    fn plain(camera: &Camera, pose: &Rigid) -> Vec<[f64; 3]> {
        let mut image = Vec::new();
        for y in 0..camera.height {
            for x in 0..camera.width {
                let ideal = camera.undistort_pixel(&Vector2::new(f64::from(x), f64::from(y))).unwrap();
                let way = pose.rotation.tr_mul(&ideal.push(1.0));
                let hit = scene::cast(&pose.centre(), &way, scene::ALL_BOXES);
                let texture = &texture::all()[hit.face];
                let uv = Face::new(hit.face).coordinates(&(pose.centre() + way * hit.distance));
                let limit = [texture.width, texture.height].map(|n| (n - 1) as f64 - 1e-9);
                let [u, v]: [f64; 2] =
                    std::array::from_fn(|k| (uv[k] * texture.texels_per_metre - 0.5).clamp(0.0, limit[k]));
                let (fu, fv) = (u.fract(), v.fract());
                let at = v as usize * texture.width + u as usize;
                let texel = |at: usize, k: usize| f64::from(texture.texels[at] >> (8 * k) & 255);
                image.push(std::array::from_fn(|k| {
                    let row = |at: usize| texel(at, k) * (1.0 - fu) + texel(at + 1, k) * fu;
                    row(at) * (1.0 - fv) + row(at + texture.width) * fv
                }));
            }
        }
        image
    }

    #[test]
    fn the_blocks_show_what_one_ray_a_pixel_shows() {
        let head = rig::true_rig();
        let poses = [(0.0, 0.0), (-0.4, 0.2), (0.35, -0.3), (1.2, 0.1), (-1.7, -0.4)];
        let mut views: Vec<Camera> = poses.iter().map(|&(pan, tilt)| head.head_camera(pan, tilt)).collect();
        views.extend((0..2).map(rig::fixed_camera));
        for camera in views {
            let renderer = Renderer::new(&camera, true).unwrap();
            let mut image = vec![0; 3 * (camera.width * camera.height) as usize];
            renderer.render(&camera.pose, &mut image);
            let wanted = plain(&camera, &camera.pose);
            let (w, h) = (camera.width as usize, camera.height as usize);
            let mut off = 0;
            for (at, pixel) in image.chunks_exact(3).enumerate() {
                // Where the image is blurred, a pixel lies between its neighbours.
                let near = |c: usize, n: usize| c.saturating_sub(1)..(c + 2).min(n);
                let around = near(at / w, h).flat_map(|y| near(at % w, w).map(move |x| y * w + x));
                let (low, high) = around.fold(([f64::INFINITY; 3], [0.0f64; 3]), |(low, high), at| {
                    let p: [f64; 3] = wanted[at];
                    (std::array::from_fn(|k| low[k].min(p[k])), std::array::from_fn(|k| high[k].max(p[k])))
                });
                let fits = |k: usize| {
                    let value = f64::from(pixel[2 - k]) / 16.0;
                    value > low[k] - 0.5 && value < high[k] + 0.5
                };
                off += usize::from(!(0..3).all(fits));
            }
            assert!(off < w * h / 10_000, "{off} pixels differ");
        }
    }

    #[test]
    fn grey_is_the_luma_of_colour() {
        let camera = rig::fixed_camera(0);
        let mut colour = vec![0; 3 * 800 * 600];
        let mut grey = vec![0; 800 * 600];
        Renderer::new(&camera, true).unwrap().render(&camera.pose, &mut colour);
        Renderer::new(&camera, false).unwrap().render(&camera.pose, &mut grey);
        for (c, g) in colour.chunks_exact(3).zip(&grey) {
            assert!(luma([c[2], c[1], c[0]]).abs_diff(*g) <= 16);
        }
    }
}
