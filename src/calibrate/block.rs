//! Points under one camera, a block at a time: whitened residuals and derivatives, and their normal
//! equations. Where the time of every adjustment goes.
//!
//! Numbers lie in lanes, one point each, so that the compiler works on as many at once as the processor
//! can: see [`crate::vectors`].
#![allow(unsafe_code)]

use nalgebra::{Matrix2, Vector2, Vector4};

use super::freedom::{ALL, CENTRE, DISTORTION, ROTATION, full_jacobian};
use crate::geometry::distortion::MIN_LENGTH;
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};
use crate::vectors::for_each_processor;

pub(crate) use super::products::Products;

/// Points of a block.
pub(crate) const LANES: usize = 32;
/// One number of every point.
pub(crate) type Lanes = [f64; LANES];
/// Columns of a block's rows: the sixteen parameters, the homogeneous point, the residual.
pub(crate) const POINT: usize = ALL;
pub(crate) const RESIDUAL: usize = ALL + 4;
const COLUMNS: usize = RESIDUAL + 1;

/// What is projected.
#[derive(Clone)]
pub(crate) struct Points {
    point: [Lanes; 4],
    pixel: [Lanes; 2],
    /// Of the lower triangle that whitens a residual: 11, 21, 22. Zero: no point.
    whitening: [Lanes; 3],
}

pub(crate) struct Block {
    points: Points,
    depth: Lanes,
    /// Whitened derivatives of the pixel's two coordinates, and what they leave unexplained.
    pub rows: [[Lanes; COLUMNS]; 2],
}

impl Points {
    pub const NONE: Self = Self { point: [[0.0; LANES]; 4], pixel: [[0.0; LANES]; 2], whitening: [[0.0; LANES]; 3] };

    /// One point in all lanes, where it weighs nothing.
    pub fn all_at(point: &Vector4<f64>, pixel: &Vector2<f64>) -> Self {
        let lanes = |x: f64| [x; LANES];
        Self {
            point: [point.x, point.y, point.z, point.w].map(lanes),
            pixel: [pixel.x, pixel.y].map(lanes),
            whitening: [[0.0; LANES]; 3],
        }
    }

    /// `whitening`: lower triangular.
    pub fn set(&mut self, lane: usize, point: &Vector4<f64>, pixel: &Vector2<f64>, whitening: &Matrix2<f64>) {
        for (to, value) in self.point.iter_mut().zip(point.iter()) {
            to[lane] = *value;
        }
        for (to, value) in self.pixel.iter_mut().zip(pixel.iter()) {
            to[lane] = *value;
        }
        for (to, value) in self.whitening.iter_mut().zip([whitening.m11, whitening.m21, whitening.m22]) {
            to[lane] = value;
        }
    }

    /// Lanes from `count` on have no point: the first one stands in, and weighs nothing.
    pub fn fill(&mut self, count: usize) {
        for lane in count..LANES {
            self.whitening.iter_mut().for_each(|w| w[lane] = 0.0);
            self.point.iter_mut().chain(&mut self.pixel).for_each(|x| x[lane] = x[0]);
        }
    }

    pub fn scale_whitening(&mut self, by: f64) {
        self.whitening.iter_mut().flatten().for_each(|w| *w *= by);
    }

    /// Moves the point of a lane.
    pub fn move_to(&mut self, lane: usize, point: &Vector4<f64>) {
        self.point.iter_mut().zip(point.iter()).for_each(|(to, value)| to[lane] = *value);
    }
}

impl Block {
    pub fn new() -> Box<Self> {
        Box::new(Self { points: Points::NONE, depth: [0.0; LANES], rows: [[[0.0; LANES]; COLUMNS]; 2] })
    }

    /// `whitening`: lower triangular.
    pub fn set(&mut self, lane: usize, point: &Vector4<f64>, pixel: &Vector2<f64>, whitening: &Matrix2<f64>) {
        self.points.set(lane, point, pixel, whitening);
    }

    /// The rows of the first `count` points; those of the others are zero. `None` when the camera does
    /// not see one of them.
    pub fn project(&mut self, camera: &Camera, count: usize) -> Option<()> {
        let mut points = std::mem::replace(&mut self.points, Points::NONE);
        points.fill(count);
        let seen = self.project_points(&points, camera);
        self.points = points;
        seen
    }

    /// The rows of points whose lanes are all filled.
    pub fn project_points(&mut self, points: &Points, camera: &Camera) -> Option<()> {
        match camera.distortion {
            Distortion::None => project(self, points, &camera.pose, &camera.intrinsics, &[0.0; 5]),
            Distortion::BrownConrady(k) => project(self, points, &camera.pose, &camera.intrinsics, &k),
            Distortion::Division(_) | Distortion::Fisheye(_) => self.project_singly(points, camera)?,
        }
        let seen = self.depth.iter().all(|z| *z > MIN_LENGTH);
        let finite = self.rows.iter().all(|row| row[RESIDUAL].iter().all(|r| r.is_finite()));
        (seen && finite).then_some(())
    }

    /// Lenses without a loop of their own here.
    fn project_singly(&mut self, points: &Points, camera: &Camera) -> Option<()> {
        self.depth.fill(1.0);
        for lane in 0..LANES {
            let [w11, w21, w22] = points.whitening.each_ref().map(|w| w[lane]);
            if w11 == 0.0 {
                self.rows.iter_mut().for_each(|row| row.iter_mut().for_each(|column| column[lane] = 0.0));
                continue;
            }
            let [x, y, z, w] = points.point.each_ref().map(|x| x[lane]);
            let p = camera.project_homogeneous(&[x, y, z].into(), w)?;
            let mut put = |column: usize, d: &Vector2<f64>| {
                self.rows[0][column][lane] = w11 * d.x;
                self.rows[1][column][lane] = w21 * d.x + w22 * d.y;
            };
            full_jacobian(&p).iter().enumerate().for_each(|(k, d)| put(k, d));
            p.by_point.column_iter().enumerate().for_each(|(k, d)| put(POINT + k, &d.into()));
            put(POINT + 3, &p.by_weight);
            put(RESIDUAL, &(Vector2::new(points.pixel[0][lane], points.pixel[1][lane]) - p.pixel));
        }
        Some(())
    }

    /// Squared lengths of the residuals.
    pub fn squares(&self) -> Lanes {
        let [x, y] = self.rows.each_ref().map(|row| &row[RESIDUAL]);
        std::array::from_fn(|l| x[l] * x[l] + y[l] * y[l])
    }
}

for_each_processor! {
    /// [`Camera::project_homogeneous`] of every lane with a Brown-Conrady lens, whitened.
    fn project(block: &mut Block, points: &Points, pose: &Rigid, k: &Intrinsics, lens: &[f64; 5]) {
        let (r, t) = (&pose.rotation, &pose.translation);
        let [k1, k2, p1, p2, k3] = *lens;
        let Points { point, pixel, whitening } = points;
        let Block { depth, rows, .. } = block;
        let [row_x, row_y] = rows;
        for l in 0..LANES {
            let (px, py, pz, weight) = (point[0][l], point[1][l], point[2][l], point[3][l]);
            let x = r.m11 * px + r.m12 * py + r.m13 * pz + t.x * weight;
            let y = r.m21 * px + r.m22 * py + r.m23 * pz + t.y * weight;
            let z = r.m31 * px + r.m32 * py + r.m33 * pz + t.z * weight;
            depth[l] = z;
            // Ideal, then distorted, on the normalised plane.
            let iz = 1.0 / z;
            let (u, v) = (x * iz, y * iz);
            let r2 = u * u + v * v;
            let r4 = r2 * r2;
            let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
            let (uv, tx, ty) = (2.0 * u * v, r2 + 2.0 * u * u, r2 + 2.0 * v * v);
            let (a, b) = (u * radial + p1 * uv + p2 * tx, v * radial + p1 * ty + p2 * uv);
            let aa = radial + u * u * slope + 2.0 * p1 * v + 6.0 * p2 * u;
            let ab = u * v * slope + 2.0 * (p1 * u + p2 * v);
            let bb = radial + v * v * slope + 6.0 * p1 * v + 2.0 * p2 * u;
            // d pixel / d ideal, then / d (x, y, z).
            let (xu, xv) = (k.fx * aa + k.skew * ab, k.fx * ab + k.skew * bb);
            let (yu, yv) = (k.fy * ab, k.fy * bb);
            let gx = [xu * iz, xv * iz, -(xu * u + xv * v) * iz];
            let gy = [yu * iz, yv * iz, -(yu * u + yv * v) * iz];

            let (w11, w21, w22) = (whitening[0][l], whitening[1][l], whitening[2][l]);
            let mut put = |column: usize, dx: f64, dy: f64| {
                row_x[column][l] = w11 * dx;
                row_y[column][l] = w21 * dx + w22 * dy;
            };
            put(0, a, 0.0);
            put(1, 0.0, b);
            put(2, b, 0.0);
            put(3, 1.0, 0.0);
            put(4, 0.0, 1.0);
            put(DISTORTION, (k.fx * u + k.skew * v) * r2, k.fy * v * r2);
            put(DISTORTION + 1, (k.fx * u + k.skew * v) * r4, k.fy * v * r4);
            put(DISTORTION + 2, k.fx * uv + k.skew * ty, k.fy * ty);
            put(DISTORTION + 3, k.fx * tx + k.skew * uv, k.fy * uv);
            put(DISTORTION + 4, (k.fx * u + k.skew * v) * (r4 * r2), k.fy * v * (r4 * r2));
            // -g^T [X]x = (X x g)^T.
            put(ROTATION, y * gx[2] - z * gx[1], y * gy[2] - z * gy[1]);
            put(ROTATION + 1, z * gx[0] - x * gx[2], z * gy[0] - x * gy[2]);
            put(ROTATION + 2, x * gx[1] - y * gx[0], x * gy[1] - y * gy[0]);
            let (ax, ay, az) = (
                gx[0] * r.m11 + gx[1] * r.m21 + gx[2] * r.m31,
                gx[0] * r.m12 + gx[1] * r.m22 + gx[2] * r.m32,
                gx[0] * r.m13 + gx[1] * r.m23 + gx[2] * r.m33,
            );
            let (bx, by, bz) = (
                gy[0] * r.m11 + gy[1] * r.m21 + gy[2] * r.m31,
                gy[0] * r.m12 + gy[1] * r.m22 + gy[2] * r.m32,
                gy[0] * r.m13 + gy[1] * r.m23 + gy[2] * r.m33,
            );
            put(CENTRE, -weight * ax, -weight * bx);
            put(CENTRE + 1, -weight * ay, -weight * by);
            put(CENTRE + 2, -weight * az, -weight * bz);
            put(POINT, ax, bx);
            put(POINT + 1, ay, by);
            put(POINT + 2, az, bz);
            put(POINT + 3, gx[0] * t.x + gx[1] * t.y + gx[2] * t.z, gy[0] * t.x + gy[1] * t.y + gy[2] * t.z);
            let (pixel_x, pixel_y) = (k.fx * a + k.skew * b + k.cx, k.fy * b + k.cy);
            put(RESIDUAL, pixel[0][l] - pixel_x, pixel[1][l] - pixel_y);
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::calibrate::freedom::Unknown;
    use crate::geometry::rigid::exp;
    use crate::vectors::tests::of_each_processor;

    fn camera(distortion: Distortion) -> Camera {
        let pose = Rigid { rotation: exp(&Vector3::new(0.05, -0.2, 0.1)), translation: Vector3::new(0.1, -0.05, 0.3) };
        let intrinsics = Intrinsics { fx: 845.19, fy: 844.56, skew: 0.7, cx: 427.76, cy: 285.53 };
        Camera { width: 800, height: 600, intrinsics, distortion, pose }
    }

    fn lenses() -> [Distortion; 4] {
        [
            Distortion::None,
            Distortion::BrownConrady([-0.28, 0.09, 0.001, -0.002, 0.01]),
            Distortion::Division(-0.2),
            Distortion::Fisheye([-0.012, 0.02, -0.017, 0.0035]),
        ]
    }

    /// Points before the camera, some nearly at infinity, with their pixels' whitening.
    fn points(count: usize) -> Vec<(Vector4<f64>, Vector2<f64>, Matrix2<f64>)> {
        let at = |i: usize| {
            let (a, b) = ((i * 7 % 11) as f64 / 11.0 - 0.5, (i * 5 % 13) as f64 / 13.0 - 0.5);
            let whitening = Matrix2::new(2.0 + a, 0.0, 0.3 * b, 1.5 - b);
            (Vector4::new(a, b, 2.0 + a * b, 1.0 - 0.9 * (i % 3) as f64 / 2.0), Vector2::new(300.0 * a, b), whitening)
        };
        (0..count).map(at).collect()
    }

    fn filled(camera: &Camera, count: usize) -> Box<Block> {
        let mut block = Block::new();
        for (lane, (x, pixel, whitening)) in points(count).iter().enumerate() {
            block.set(lane, x, pixel, whitening);
        }
        block.project(camera, count).unwrap();
        block
    }

    #[test]
    fn rows_are_those_of_single_points() {
        for lens in lenses() {
            let (camera, count) = (camera(lens), 21);
            let block = filled(&camera, count);
            for (lane, (x, pixel, whitening)) in points(count).iter().enumerate() {
                let p = camera.project_homogeneous(&x.xyz(), x.w).unwrap();
                let mut wanted = full_jacobian(&p).to_vec();
                wanted.extend(p.by_point.column_iter().map(Vector2::from));
                wanted.extend([p.by_weight, pixel - p.pixel]);
                for (column, wanted) in wanted.iter().enumerate() {
                    // Without a lens nobody asks for derivatives by its coefficients.
                    if lens == Distortion::None && (DISTORTION..ROTATION).contains(&column) {
                        continue;
                    }
                    let found = Vector2::new(block.rows[0][column][lane], block.rows[1][column][lane]);
                    let wanted = whitening * wanted;
                    assert!((found - wanted).norm() <= 1e-13 * (1.0 + wanted.norm()), "{lens:?} {column}");
                }
            }
            assert!(block.rows.iter().flatten().all(|column| column[count..].iter().all(|x| *x == 0.0)));
        }
    }

    #[test]
    fn products_are_sums_over_all_points() {
        let block = filled(&camera(lenses()[1]), 21);
        let mut sums = Products::new(7);
        let unknowns: Vec<Unknown> =
            (0..6).map(|k| Unknown { parameter: 3 * k, tied: (k == 0).then_some(1) }).collect();
        for _ in 0..2 {
            sums.take(&block, &unknowns, 0);
            sums.column(6).into_iter().zip(&block.rows).for_each(|(to, row)| *to = row[RESIDUAL]);
            sums.add();
        }
        let column = |row: usize, k: usize, l: usize| match k {
            0 => block.rows[row][0][l] + block.rows[row][1][l],
            6 => block.rows[row][RESIDUAL][l],
            k => block.rows[row][3 * k][l],
        };
        for a in 0..7 {
            for b in a..7 {
                let all = (0..LANES).flat_map(|l| [(0, l), (1, l)]);
                let wanted: f64 = 2.0 * all.map(|(row, l)| column(row, a, l) * column(row, b, l)).sum::<f64>();
                assert!((sums.at(a, b) - wanted).abs() <= 1e-12 * wanted.abs().max(1e6), "{a} {b}");
            }
        }
        sums.clear();
        assert_eq!(sums.at(0, 0), 0.0);
    }

    #[test]
    fn every_processor_gives_the_same_bits() {
        let results = of_each_processor(|| {
            let block = filled(&camera(lenses()[1]), 30);
            let mut sums = Products::new(11);
            let unknowns: Vec<Unknown> = (0..11).map(|parameter| Unknown { parameter, tied: None }).collect();
            sums.take(&block, &unknowns, 0);
            sums.add();
            let rows = block.rows.iter().flatten().flatten().copied().chain((0..121).map(|k| sums.at(k % 11, k / 11)));
            rows.map(|x| x.to_bits()).collect::<Vec<_>>()
        });
        assert!(results.iter().all(|bits| *bits == results[0]));
    }

    #[test]
    fn what_is_not_seen_is_none() {
        for lens in lenses() {
            let camera = camera(lens);
            for z in [-2.0, f64::NAN] {
                if z < 0.0 && matches!(lens, Distortion::Fisheye(_)) {
                    continue;
                }
                let mut block = Block::new();
                let x = Vector4::new(0.1, 0.2, z, 1.0);
                block.set(0, &x, &Vector2::zeros(), &Matrix2::identity());
                assert!(block.project(&camera, 1).is_none(), "{lens:?} {z}");
            }
        }
    }
}
