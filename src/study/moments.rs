//! DLT-Points of the same 3D points under many noises (thesis VII, eqs (17)-(22)).
//!
//! The normal matrix of eq. (2) consists of four 4x4 blocks: sums of x x^T, u x x^T, v x x^T and
//! (u^2 + v^2) x x^T over the points. With exact 3D points x x^T is formed once, and with pixels
//! m + k n the sums are polynomials in the noise's level k: 40 sums of a trial's noise n give the normal
//! matrix at every level. Hartley's normalisation of the noisy pixels is a linear map of the blocks.
//! Noise and its sums over a chunk of points are of single precision: their rounding is to the noise's effect
//! as 1 to 10^7.
//! A rigid motion of the points, which is what the cascade as printed (eq. (23)) does, turns and shifts the
//! answer and nothing else: Hartley's normalisation of the points moves along.

use nalgebra::{Cholesky, Matrix3x4, SVector, Vector2, Vector3};

use super::normals::{Kernel, LANES, Lanes, Normals, run_widest};
use crate::calibrate::dlt;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::Camera;
use crate::geometry::linalg::{Matrix12, Normalisation2, Normalisation3};

/// Distinct entries of x x^T.
const PRODUCTS: usize = 10;
/// Points whose noise is drawn and summed in one go: what fits beside the products into the first cache.
const CHUNK: usize = 32;

type Products = [[Lanes; CHUNK]; PRODUCTS];

/// Blocks of the normal matrix: entries of the upper triangle of sum x x^T w, for a weight w.
type Block = [f64; PRODUCTS];

/// A set of exact points and their noiseless pixels.
pub struct PointSet {
    space: Normalisation3,
    image: Normalisation2,
    count: usize,
    /// x x^T of the normalised points, chunk by chunk, one product after the other; zero beyond the last.
    products: Vec<Products>,
    /// Normalised noiseless pixels.
    pixels: [Vec<Lanes>; 2],
    /// Blocks without noise: of 1, u, v, u^2 + v^2.
    noiseless: [Block; 4],
    /// The answer without noise: where every search begins.
    start: SVector<f64, 12>,
}

/// One trial's noise of a point set, and its sums.
pub struct Draw {
    noise: [Vec<Lanes>; 2],
    /// Of n_u, n_v, u n_u + v n_v, n_u^2 + n_v^2.
    blocks: [Block; 4],
}

impl PointSet {
    /// Points in front of `camera` as it sees them.
    ///
    /// # Errors
    /// `TooFewPoints` below six, `BehindCamera`, and what DLT-Points refuses.
    pub fn new(points: &[Vector3<f64>], camera: &Camera) -> Result<Self> {
        let see = |(index, x)| camera.project(x).ok_or(Error::BehindCamera { index });
        let pixels = points.iter().enumerate().map(see).collect::<Result<Vec<_>>>()?;
        // The method that it stands for says whether the points will do.
        let p = dlt::points(points, &pixels)?;
        let collapsed = || Error::degenerate(Degeneracy::Coincident, "all points coincide");
        let space = Normalisation3::of(points.iter().copied()).ok_or_else(collapsed)?;
        let image = Normalisation2::of(&pixels).ok_or_else(collapsed)?;
        let chunks = points.len().div_ceil(LANES * CHUNK);
        let blocks = chunks * CHUNK;
        let mut set = Self {
            space,
            image,
            count: points.len(),
            products: vec![[[[0.0; LANES]; CHUNK]; PRODUCTS]; chunks],
            pixels: [vec![[0.0; LANES]; blocks], vec![[0.0; LANES]; blocks]],
            noiseless: [[0.0; PRODUCTS]; 4],
            start: SVector::zeros(),
        };
        for (i, (x, pixel)) in points.iter().zip(&pixels).enumerate() {
            let (x, m) = (space.apply(x).push(1.0), image.apply(pixel));
            let (block, lane) = (i / LANES, i % LANES);
            (set.pixels[0][block][lane], set.pixels[1][block][lane]) = (m.x as f32, m.y as f32);
            for (k, (a, b)) in upper().enumerate() {
                set.products[block / CHUNK][k][block % CHUNK][lane] = (x[a] * x[b]) as f32;
                for (sum, w) in set.noiseless.iter_mut().zip([1.0, m.x, m.y, m.norm_squared()]) {
                    sum[k] += w * x[a] * x[b];
                }
            }
        }
        let start = image.matrix() * p * space.matrix().try_inverse().ok_or_else(collapsed)?;
        set.start = SVector::<f64, 12>::from_column_slice(start.transpose().as_slice()).normalize();
        Ok(set)
    }

    /// A trial's noise, unit variance.
    pub fn draw(&self, normals: &mut Normals) -> Draw {
        let blocks = self.products.len() * CHUNK;
        let mut draw =
            Draw { noise: [vec![[0.0; LANES]; blocks], vec![[0.0; LANES]; blocks]], blocks: [[0.0; PRODUCTS]; 4] };
        let mut sums = [[[0.0; LANES]; 4]; PRODUCTS];
        let [u, v] = &mut draw.noise;
        let scale = self.image.scale as f32;
        for ((i, products), (u, v)) in
            self.products.iter().enumerate().zip(u.chunks_mut(CHUNK).zip(v.chunks_mut(CHUNK)))
        {
            normals.fill(u, v);
            let chunk = i * CHUNK..(i + 1) * CHUNK;
            let pixels = [&self.pixels[0][chunk.clone()], &self.pixels[1][chunk]];
            run_widest(AddSums { sums: &mut sums, products, pixels, scale, noise: [u, v] });
        }
        for (k, sums) in sums.iter().enumerate() {
            for (block, lanes) in draw.blocks.iter_mut().zip(sums) {
                block[k] = lanes.iter().sum();
            }
        }
        draw
    }

    /// DLT-Points from the pixels with noise of `sigma` px; `None` when there is no answer.
    pub fn solve(&self, draw: &Draw, sigma: f64) -> Option<Matrix3x4<f64>> {
        let [s0, su0, sv0, sw0] = &self.noiseless;
        let [nu, nv, cross, square] = &draw.blocks;
        let n = self.count as f64;
        // The last product is 1: the sums of the noise itself, and with it the centroid's shift.
        let shift = Vector2::new(nu[PRODUCTS - 1], nv[PRODUCTS - 1]) * (sigma / n);
        let mut distances = [0.0; LANES];
        let centre = [shift.x as f32, shift.y as f32];
        for (i, products) in self.products.iter().enumerate() {
            let chunk = i * CHUNK..(i + 1) * CHUNK;
            let [pixels, noise] = [&self.pixels, &draw.noise].map(|xy| [&xy[0][chunk.clone()], &xy[1][chunk.clone()]]);
            let sums = &mut distances;
            run_widest(AddDistances { sums, products, pixels, noise, sigma: sigma as f32, centre });
        }
        let scale = 2f64.sqrt() * n / distances.iter().sum::<f64>();
        let mut normal = Matrix12::zeros();
        for (k, (a, b)) in upper().enumerate() {
            let (u, v) = (su0[k] + sigma * nu[k], sv0[k] + sigma * nv[k]);
            let w = sw0[k] + 2.0 * sigma * cross[k] + sigma * sigma * square[k];
            let mut set = |row: usize, column: usize, value: f64| {
                for (i, j) in [(a, b), (b, a)] {
                    normal[(4 * row + i, 4 * column + j)] = value;
                    normal[(4 * column + j, 4 * row + i)] = value;
                }
            };
            set(0, 0, s0[k]);
            set(1, 1, s0[k]);
            set(0, 2, -scale * (u - shift.x * s0[k]));
            set(1, 2, -scale * (v - shift.y * s0[k]));
            set(2, 2, scale * scale * (w - 2.0 * (shift.x * u + shift.y * v) + shift.norm_squared() * s0[k]));
        }
        let p = smallest_eigenvector(&normal, &self.start)?;
        let image =
            Normalisation2 { centre: self.image.centre + shift / self.image.scale, scale: self.image.scale * scale };
        Some(image.inverse_matrix() * Matrix3x4::from_row_slice(p.as_slice()) * self.space.matrix())
    }
}

/// Index pairs of a symmetric 4x4 matrix's upper triangle.
fn upper() -> impl Iterator<Item = (usize, usize)> {
    (0..4).flat_map(|a| (a..4).map(move |b| (a, b)))
}

/// Scales a chunk's noise to the normalised image, and adds its products.
struct AddSums<'a> {
    sums: &'a mut [[[f64; LANES]; 4]; PRODUCTS],
    products: &'a Products,
    pixels: [&'a [Lanes]; 2],
    scale: f32,
    noise: [&'a mut [Lanes]; 2],
}

impl Kernel for AddSums<'_> {
    #[inline(always)]
    fn run(self) {
        let [nu, nv] = self.noise;
        let mut weights = [[[0.0; LANES]; CHUNK]; 4];
        let [wu, wv, cross, square] = &mut weights;
        let points = self.pixels[0].iter().zip(self.pixels[1]).zip(nu.iter_mut().zip(nv));
        for (((wu, wv), (cross, square)), ((mu, mv), (nu, nv))) in
            wu.iter_mut().zip(wv).zip(cross.iter_mut().zip(square)).zip(points)
        {
            for l in 0..LANES {
                (nu[l], nv[l]) = (self.scale * nu[l], self.scale * nv[l]);
                (wu[l], wv[l]) = (nu[l], nv[l]);
                cross[l] = mu[l] * nu[l] + mv[l] * nv[l];
                square[l] = nu[l] * nu[l] + nv[l] * nv[l];
            }
        }
        for (products, sums) in self.products.iter().zip(self.sums.iter_mut()) {
            // A plain loop for each weight is what the compiler keeps in vector registers.
            for (sum, weights) in sums.iter_mut().zip(&weights) {
                let mut s = [0.0; LANES];
                for (p, w) in products.iter().zip(weights) {
                    for l in 0..LANES {
                        s[l] += p[l] * w[l];
                    }
                }
                add(sum, &s);
            }
        }
    }
}

/// Adds the distances of a chunk's noisy pixels from their centroid.
struct AddDistances<'a> {
    sums: &'a mut [f64; LANES],
    products: &'a Products,
    pixels: [&'a [Lanes]; 2],
    noise: [&'a [Lanes]; 2],
    sigma: f32,
    centre: [f32; 2],
}

impl Kernel for AddDistances<'_> {
    #[inline(always)]
    fn run(self) {
        let (sigma, [cx, cy]) = (self.sigma, self.centre);
        let mut s = [0.0; LANES];
        let points = self.pixels[0].iter().zip(self.pixels[1]).zip(self.noise[0].iter().zip(self.noise[1]));
        // The last product is 1 for a point and 0 beyond the last one.
        for (one, ((mu, mv), (nu, nv))) in self.products[PRODUCTS - 1].iter().zip(points) {
            for l in 0..LANES {
                let (x, y) = (mu[l] + sigma * nu[l] - cx, mv[l] + sigma * nv[l] - cy);
                s[l] += one[l] * (x * x + y * y).sqrt();
            }
        }
        add(self.sums, &s);
    }
}

#[inline(always)]
fn add(sums: &mut [f64; LANES], more: &Lanes) {
    for l in 0..LANES {
        sums[l] += f64::from(more[l]);
    }
}

/// Unit eigenvector of the least eigenvalue of a positive semi-definite matrix, by inverse iteration
/// from a guess: two or three steps where noise is far below the second eigenvalue, as it is of a
/// camera that can be calibrated. Slow progress is left to a full decomposition.
fn smallest_eigenvector(m: &Matrix12, guess: &SVector<f64, 12>) -> Option<SVector<f64, 12>> {
    const TOLERANCE: f64 = 1e-13;
    if m.iter().any(|v| !v.is_finite()) {
        return None;
    }
    // A ridge at rounding keeps the factorisation definite where there is no noise.
    let ridge = m.trace() * 1e-16;
    if let Some(factor) = Cholesky::new(m + Matrix12::identity() * ridge) {
        let mut p = *guess;
        for _ in 0..60 {
            let next = factor.solve(&p).normalize();
            let change = (next - p * next.dot(&p).signum()).norm();
            p = next;
            if change < TOLERANCE {
                return Some(p);
            }
        }
    }
    let eigen = m.try_symmetric_eigen(f64::EPSILON, 10_000)?;
    Some(eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::decompose;
    use crate::geometry::{Distortion, Intrinsics, Rigid, rigid};

    fn camera() -> Camera {
        Camera {
            width: 800,
            height: 600,
            intrinsics: Intrinsics { fx: 842.46, fy: 889.62, skew: 0.0, cx: 398.11, cy: 314.21 },
            distortion: Distortion::None,
            pose: Rigid {
                rotation: rigid::exp(&Vector3::new(0.01, -0.02, 0.012)),
                translation: Vector3::new(0.16, -0.05, 0.02),
            },
        }
    }

    fn points(count: usize) -> Vec<Vector3<f64>> {
        let spread = |[x, y]: [f64; 2]| [x.clamp(-1.5, 1.5), y.clamp(-1.5, 1.5)];
        let (a, b) = (Normals::new(1, 0).pairs(count), Normals::new(1, 1).pairs(count));
        a.into_iter()
            .zip(b)
            .map(|(a, b)| {
                let ([x, y], [z, _]) = (spread(a), spread(b));
                Vector3::new(x, 0.7 * y, 3.2 + z)
            })
            .collect()
    }

    #[test]
    fn equals_dlt_points_of_the_same_pixels_at_every_level() {
        for count in [6, 7, 40, 301] {
            let (points, camera) = (points(count), camera());
            let set = PointSet::new(&points, &camera).unwrap();
            let draw = set.draw(&mut Normals::new(9, 4));
            let noise = Normals::new(9, 4).pairs(count.next_multiple_of(LANES * CHUNK));
            for sigma in [0.0, 0.2, 2.0] {
                // Noise is drawn in the order of the points.
                let pixels: Vec<_> = points
                    .iter()
                    .zip(&noise)
                    .map(|(x, n)| camera.project(x).unwrap() + Vector2::from(*n) * sigma)
                    .collect();
                let wanted = dlt::points(&points, &pixels).unwrap();
                let (_, wanted) = decompose::decompose(&wanted).unwrap();
                let found = set.solve(&draw, sigma).unwrap();
                let (_, found) = decompose::decompose(&found).unwrap();
                // The normal matrix has the squared condition, and its noise seven digits.
                assert!(
                    (found.centre() - wanted.centre()).norm() < 1e-6,
                    "{count} {sigma} {} {}",
                    found.centre(),
                    wanted.centre()
                );
                assert!((found.rotation - wanted.rotation).norm() < 1e-6);
            }
        }
    }

    #[test]
    fn points_that_dlt_refuses_are_refused() {
        let flat: Vec<_> = points(40).iter().map(|x| Vector3::new(x.x, x.y, 3.0)).collect();
        assert!(matches!(PointSet::new(&flat, &camera()), Err(Error::Degenerate { .. })));
        assert!(matches!(PointSet::new(&points(5), &camera()), Err(Error::TooFewPoints { .. })));
        let behind = [Vector3::new(0.0, 0.0, -3.0)];
        assert!(matches!(PointSet::new(&behind, &camera()), Err(Error::BehindCamera { index: 0 })));
    }
}
