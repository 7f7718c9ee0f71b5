//! A surface from a grid of rays, such as a scan's pan and tilt positions or a depth map's pixels.
//!
//! Neighbours are joined unless the depth jumps between them. Inverse ranges q along rays in one plane
//! are linear on a plane of the world: q_j = (q_i sin(h, j) - q_h sin(i, j)) / sin(h, i) for rays h, i,
//! j in this order. So the two points before an edge of the grid tell what a surface that goes on has behind
//! it, and the two behind tell what it has before. A jump is an edge that is steeper than a surface is
//! usually seen, by more than the noise of its ends, and that neither side explains: both
//! extrapolations miss by more than their noise, and miss towards opposite sides, as those of two
//! surfaces that do not meet in between (where they meet they miss towards one side: a corner). No
//! length is in it: the same scene is cut alike at any scale, and the floor at grazing incidence is not.

use std::f64::consts::FRAC_PI_3;

use nalgebra::Vector3;

use crate::error::{Error, Result};
use crate::geometry::point_cloud::{check_count, pack};
use crate::geometry::{Camera, CloudNoise, InverseDepthPoint, Mesh, PointCloud};
use crate::image::{DepthMap, DepthNoise, ImageView};

/// A measured point of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridPoint {
    pub point: InverseDepthPoint,
    pub colour: [u8; 3],
}

/// Points on a grid of rays from (nearly) one place; `None` where nothing was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct RayGrid {
    columns: usize,
    rows: usize,
    /// Row by row.
    points: Vec<Option<GridPoint>>,
}

/// When neighbours are one surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceOptions {
    /// Angle between ray and normal, radians, up to which a surface needs no support from its
    /// neighbours. At 60 degrees a spot is twice as long as wide.
    pub max_incidence: f64,
    /// Standard deviations beyond which a difference is not noise: 4 take one edge in 16,000 for a jump
    /// that is none.
    pub significance: f64,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self { max_incidence: FRAC_PI_3, significance: 4.0 }
    }
}

impl SurfaceOptions {
    fn check(&self) -> Result<()> {
        if !(self.max_incidence > 0.0 && self.max_incidence < std::f64::consts::FRAC_PI_2) {
            return Err(Error::invalid("max_incidence", format!("{} rad", self.max_incidence)));
        }
        if !(self.significance.is_finite() && self.significance > 0.0) {
            return Err(Error::invalid("significance", format!("{} standard deviations", self.significance)));
        }
        Ok(())
    }
}

impl RayGrid {
    /// # Errors
    /// `InvalidArgument` when the points are not columns x rows, or too many.
    pub fn new(columns: usize, rows: usize, points: Vec<Option<GridPoint>>) -> Result<Self> {
        check_count(points.len())?;
        if columns.checked_mul(rows) != Some(points.len()) {
            return Err(Error::invalid("grid", format!("{} points for {columns} x {rows}", points.len())));
        }
        Ok(Self { columns, rows, points })
    }

    /// Whole rows of `columns` points; what is left over of a row is dropped.
    pub fn of_rows(columns: usize, mut points: Vec<Option<GridPoint>>) -> Self {
        let rows = points.len().checked_div(columns).unwrap_or(0);
        points.truncate(rows * columns);
        Self { columns, rows, points }
    }

    pub fn columns(&self) -> usize {
        self.columns
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    pub fn points(&self) -> &[Option<GridPoint>] {
        &self.points
    }
}

/// The rays of a depth map's pixels in the world, with the colours of its image (white without one).
///
/// # Errors
/// The camera's and noise's own; `InvalidArgument` for sizes that differ.
pub fn depth_grid(
    map: &DepthMap,
    camera: &Camera,
    image: Option<&ImageView<'_>>,
    noise: &DepthNoise,
) -> Result<RayGrid> {
    camera.validate()?;
    noise.check()?;
    let size = (map.width(), map.height());
    let same = |name, width: u32, height: u32| {
        let reason = || format!("{width} x {height} pixels, the depth map has {} x {}", size.0, size.1);
        if (width as usize, height as usize) == size { Ok(()) } else { Err(Error::invalid(name, reason())) }
    };
    same("camera", camera.width, camera.height)?;
    if let Some(image) = image {
        same("image", image.width(), image.height())?;
    }
    check_count(size.0 * size.1)?;
    let (origin, to_world) = (camera.centre(), camera.pose.rotation.transpose());
    let point = |x: usize, y: usize| {
        let rho = 1.0 / map.at(x, y)?;
        let q = camera.intrinsics.to_normalised(&nalgebra::Vector2::new(x as f64, y as f64));
        let d = camera.distortion.direction(&q).filter(|d| d.z > 0.0)?;
        let point = InverseDepthPoint { origin, direction: to_world * (d / d.z), rho, variance: noise.variance(rho) };
        Some(GridPoint { point, colour: image.map_or([255; 3], |i| i.rgb(x as u32, y as u32)) })
    };
    let points = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))).map(|(x, y)| point(x, y)).collect();
    RayGrid::new(size.0, size.1, points)
}

/// The points of a grid as a cloud with covariances: those at a finite distance.
pub fn grid_cloud(grid: &RayGrid) -> PointCloud {
    let (mut cloud, mut covariances) = (PointCloud::default(), Vec::new());
    for point in grid.points.iter().flatten() {
        let (Some(position), Some(covariance)) = (point.point.point(), point.point.point_covariance()) else {
            continue;
        };
        cloud.positions.push(position);
        cloud.colours.push(point.colour);
        covariances.push(pack(&covariance));
    }
    cloud.noise = CloudNoise::Covariances(covariances);
    cloud
}

/// A measured point as the tests of edges need it.
#[derive(Clone, Copy)]
struct Cell {
    position: Vector3<f64>,
    /// Index of its vertex.
    vertex: u32,
    /// Unit vector along the ray.
    direction: Vector3<f64>,
    origin: Vector3<f64>,
    /// Inverse distance along the ray, 1/m, and its variance.
    q: f64,
    variance: f64,
}

struct Surface<'a> {
    cells: Vec<Option<Cell>>,
    columns: isize,
    rows: isize,
    tan_incidence: f64,
    options: &'a SurfaceOptions,
}

/// The surface through a grid's points, its front towards where they were measured from, with normals.
/// Shots that are missing, and points that their noise does not tell from infinity, are holes; jumps
/// of depth are cut.
///
/// # Errors
/// `InvalidArgument` for options out of range.
pub fn triangulate(grid: &RayGrid, options: &SurfaceOptions) -> Result<Mesh> {
    options.check()?;
    let (mut mesh, mut covariances) = (Mesh::default(), Vec::new());
    let mut cell = |point: &Option<GridPoint>| {
        let GridPoint { point, colour } = point.as_ref()?;
        let (position, covariance) = (point.point()?, point.point_covariance()?);
        let length = point.direction.norm();
        let cell = Cell {
            position,
            vertex: mesh.vertices.len() as u32,
            direction: point.direction / length,
            origin: point.origin,
            q: point.rho / length,
            variance: point.variance / (length * length),
        };
        let finite = cell.q * cell.q > cell.variance * options.significance.powi(2);
        if !(finite && cell.direction.iter().all(|v| v.is_finite())) {
            return None;
        }
        mesh.vertices.positions.push(position);
        mesh.vertices.colours.push(*colour);
        covariances.push(pack(&covariance));
        Some(cell)
    };
    let cells = grid.points.iter().map(&mut cell).collect();
    mesh.vertices.noise = CloudNoise::Covariances(covariances);
    let surface = Surface {
        cells,
        columns: grid.columns as isize,
        rows: grid.rows as isize,
        tan_incidence: options.max_incidence.tan(),
        options,
    };
    for row in 0..surface.rows - 1 {
        for column in 0..surface.columns - 1 {
            surface.square(column, row, &mut mesh.triangles);
        }
    }
    mesh.estimate_normals();
    Ok(mesh)
}

type Place = (isize, isize);

impl Surface<'_> {
    fn at(&self, (column, row): Place) -> Option<&Cell> {
        let inside = (0..self.columns).contains(&column) && (0..self.rows).contains(&row);
        inside.then(|| self.cells.get((row * self.columns + column) as usize))??.as_ref()
    }

    /// The triangles between four neighbours: along the diagonal that gives more of them, or is shorter.
    fn square(&self, column: isize, row: isize, triangles: &mut Vec<[u32; 3]>) {
        let [a, b, c, d] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| (column + x, row + y));
        let falling = [[a, d, b], [a, c, d]].map(|t| self.triangle(t));
        let rising = [[a, c, b], [b, c, d]].map(|t| self.triangle(t));
        let count = |pair: &[Option<[u32; 3]>; 2]| pair.iter().flatten().count();
        let length = |from, to| match (self.at(from), self.at(to)) {
            (Some(from), Some(to)) => (from.position - to.position).norm_squared(),
            _ => f64::INFINITY,
        };
        let better = match count(&falling).cmp(&count(&rising)) {
            std::cmp::Ordering::Greater => falling,
            std::cmp::Ordering::Less => rising,
            std::cmp::Ordering::Equal if length(a, d) <= length(b, c) => falling,
            std::cmp::Ordering::Equal => rising,
        };
        triangles.extend(better.into_iter().flatten());
    }

    /// A triangle whose corners are all measured and one surface, with its front to the rays' origin.
    fn triangle(&self, [a, b, c]: [Place; 3]) -> Option<[u32; 3]> {
        let corners = [self.at(a)?, self.at(b)?, self.at(c)?];
        if !(self.joined(a, b)? && self.joined(b, c)? && self.joined(c, a)?) {
            return None;
        }
        let normal = (corners[1].position - corners[0].position).cross(&(corners[2].position - corners[0].position));
        let front = normal.dot(&(corners[0].origin - corners[0].position));
        let [a, b, c] = corners.map(|c| c.vertex);
        if front > 0.0 {
            Some([a, b, c])
        } else if front < 0.0 {
            Some([a, c, b])
        } else {
            // No area, or seen from its edge.
            None
        }
    }

    /// Are two neighbours one surface? `None` where one was not measured.
    fn joined(&self, from: Place, to: Place) -> Option<bool> {
        let (a, b) = (self.at(from)?, self.at(to)?);
        let k = self.options.significance;
        let [range_a, range_b] = [1.0 / a.q, 1.0 / b.q];
        let noise = (a.variance * range_a.powi(4) + b.variance * range_b.powi(4)).sqrt();
        let spacing = a.direction.cross(&b.direction).norm() * (range_a * range_b).sqrt();
        if (range_a - range_b).abs() - k * noise <= self.tan_incidence * spacing {
            return Some(true);
        }
        let step = (to.0 - from.0, to.1 - from.1);
        let before = self.at((from.0 - step.0, from.1 - step.1));
        let after = self.at((to.0 + step.0, to.1 + step.1));
        let miss = |outer: Option<&Cell>, inner: &Cell, other: &Cell| extrapolation_miss(outer?, inner, other);
        // By how much each side's extrapolation misses the other end, and what of that noise explains.
        Some(match (miss(before, a, b), miss(after, b, a)) {
            (Some((left, left_noise)), Some((right, right_noise))) => {
                left.abs() <= k * left_noise || right.abs() <= k * right_noise || left * right > 0.0
            }
            (Some((one, noise)), None) | (None, Some((one, noise))) => one.abs() <= k * noise,
            (None, None) => false,
        })
    }
}

/// What a surface that goes on through two points has at a third ray, less what was measured there,
/// 1/m; and the standard deviation of the difference, with what the rays' not lying in one plane adds.
fn extrapolation_miss(outer: &Cell, inner: &Cell, other: &Cell) -> Option<(f64, f64)> {
    // d_other = a d_inner + b d_outer + e n, where n is normal to the first two.
    let normal = outer.direction.cross(&inner.direction);
    let square = normal.norm_squared();
    let by_inner = outer.direction.cross(&other.direction).dot(&normal) / square;
    let by_outer = other.direction.cross(&inner.direction).dot(&normal) / square;
    let miss = inner.q * by_inner + outer.q * by_outer - other.q;
    let variance = inner.variance * by_inner.powi(2) + outer.variance * by_outer.powi(2) + other.variance;
    // On a plane q = g . d. Of g the part along n is unknown, and taken to be as large as the rest.
    let aside = normal.dot(&other.direction).powi(2) / square;
    let slope = (outer.direction * inner.q - inner.direction * outer.q).norm_squared() / square;
    let variance = variance + slope * aside;
    (miss.is_finite() && variance.is_finite()).then(|| (miss, variance.sqrt()))
}
