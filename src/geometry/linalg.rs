//! Small dense linear algebra that must never hang or be silently wrong: one-sided Jacobi SVD for
//! few columns, Cholesky with an honest verdict, the symmetric generalised eigenproblem, and
//! Hartley's normalisation. nalgebra's general SVD is not used (docs/decisions.md).

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, DimDiff, DimSub, Matrix3, Matrix4, OMatrix, OVector, SMatrix, U1, Vector2, Vector3};

/// Singular values (descending) and right singular vectors of a tall matrix with N columns.
pub struct RightSingular<const N: usize> {
    pub values: [f64; N],
    /// `vectors[i]` belongs to `values[i]`.
    pub vectors: [[f64; N]; N],
}

/// One-sided Jacobi SVD (Hestenes) of the matrix with the given rows, after a QR factorisation to
/// N x N. Backward stable, so that null vectors of near-singular systems are accurate to machine
/// precision times the condition, not its square. Finite input; for anything else all is NaN.
pub fn right_singular<const N: usize>(rows: &[[f64; N]]) -> RightSingular<N> {
    if rows.iter().flatten().any(|v| !v.is_finite()) {
        return RightSingular { values: [f64::NAN; N], vectors: [[f64::NAN; N]; N] };
    }
    // Columns of the triangular factor; scaling guards against overflow of the squares.
    let scale = rows.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut columns = triangular_factor(rows, if scale > 0.0 { 1.0 / scale } else { 1.0 });
    let mut v = [[0.0; N]; N];
    for (i, row) in v.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    // v[i] is the i-th column of V, rotated along with column i of the factor.
    for _sweep in 0..60 {
        let mut rotated = false;
        for p in 0..N {
            for q in p + 1..N {
                let (alpha, beta) = (dot(&columns[p], &columns[p]), dot(&columns[q], &columns[q]));
                let gamma = dot(&columns[p], &columns[q]);
                if gamma.abs() <= 1e-15 * (alpha * beta).sqrt() || gamma == 0.0 {
                    continue;
                }
                rotated = true;
                let zeta = (beta - alpha) / (2.0 * gamma);
                let t = if zeta.is_finite() {
                    1f64.copysign(zeta) / (zeta.abs() + (1.0 + zeta * zeta).sqrt())
                } else {
                    0.0
                };
                let c = 1.0 / (1.0 + t * t).sqrt();
                rotate(&mut columns, p, q, c, c * t);
                rotate(&mut v, p, q, c, c * t);
            }
        }
        if !rotated {
            break;
        }
    }
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    let norms: [f64; N] = std::array::from_fn(|i| dot(&columns[i], &columns[i]).sqrt());
    order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
    RightSingular { values: order.map(|i| norms[i] * scale), vectors: order.map(|i| v[i]) }
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn rotate<const N: usize>(m: &mut [[f64; N]; N], p: usize, q: usize, c: f64, s: f64) {
    let (low, high) = m.split_at_mut(q);
    for (x, y) in low[p].iter_mut().zip(&mut high[0]) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
}

/// Columns of R in rows * scale = Q R, by Householder's reflections: rows are folded in blocks of
/// multiples of N, so memory does not grow with their number. All loops run along the rows.
fn triangular_factor<const N: usize>(rows: &[[f64; N]], scale: f64) -> [[f64; N]; N] {
    let mut r = [[0.0f64; N]; N]; // r[i] is row i of R
    let mut block: Vec<[f64; N]> = Vec::with_capacity(9 * N);
    for chunk in rows.chunks(8 * N) {
        block.clear();
        block.extend_from_slice(&r);
        block.extend(chunk.iter().map(|row| row.map(|x| x * scale)));
        for k in 0..N {
            // Column k times every column, from row k on.
            let mut products = [0.0; N];
            for row in &block[k..] {
                let factor = row[k];
                products.iter_mut().zip(row).for_each(|(p, x)| *p += factor * x);
            }
            let norm = products[k].sqrt();
            if norm == 0.0 {
                continue;
            }
            let pivot = block[k];
            let alpha = -norm.copysign(pivot[k]);
            // Householder vector (head, block[k+1..][k]); its squared norm is -2 alpha head.
            let head = pivot[k] - alpha;
            let beta = -1.0 / (alpha * head);
            let mut shares = [0.0; N];
            for j in k + 1..N {
                shares[j] = beta * (products[j] - alpha * pivot[j]);
            }
            for (x, s) in block[k].iter_mut().zip(&shares) {
                *x -= s * head;
            }
            block[k][k] = alpha;
            for row in &mut block[k + 1..] {
                let factor = row[k];
                row.iter_mut().zip(&shares).for_each(|(x, s)| *x -= s * factor);
                row[k] = 0.0;
            }
        }
        r.copy_from_slice(&block[..N]);
    }
    let mut columns = [[0.0; N]; N];
    for (i, row) in r.iter().enumerate() {
        for (j, x) in row.iter().enumerate() {
            columns[j][i] = *x;
        }
    }
    columns
}

/// Normal matrices of the 12 entries of a projection matrix.
pub type Matrix12 = SMatrix<f64, 12, 12>;

/// Eigenvector of N p = mu H p for the LARGEST mu, with H symmetric positive definite and N
/// symmetric, both scaled by diag(H)^-1/2 first. `None` when H is not positive definite.
pub fn largest_generalised_eigenvector<D>(n: &OMatrix<f64, D, D>, h: &OMatrix<f64, D, D>) -> Option<OVector<f64, D>>
where
    D: DimSub<U1>,
    DefaultAllocator: Allocator<D> + Allocator<D, D> + Allocator<DimDiff<D, U1>>,
{
    let (size, _) = h.shape_generic();
    if n.iter().chain(h.iter()).any(|v| !v.is_finite()) || (0..size.value()).any(|i| h[(i, i)] <= 0.0) {
        return None;
    }
    let s = OVector::<f64, D>::from_fn_generic(size, U1, |i, _| 1.0 / h[(i, i)].sqrt());
    let scaled = |m: &OMatrix<f64, D, D>| m.map_with_location(|i, j, v| v * s[i] * s[j]);
    let l = scaled(h).cholesky()?.unpack();
    // C = L^-1 N L^-T is symmetric, and its largest eigenvector y gives p = S L^-T y.
    let half = l.solve_lower_triangular(&scaled(n))?;
    let c = l.solve_lower_triangular(&half.transpose())?;
    let c = (&c + c.transpose()) * 0.5;
    let eigen = c.try_symmetric_eigen(f64::EPSILON, 1000)?;
    let best = (0..size.value()).max_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]))?;
    let y: OVector<f64, D> = eigen.eigenvectors.column(best).into_owned();
    let p = l.tr_solve_lower_triangular(&y)?.component_mul(&s);
    let norm = p.norm();
    let p = p / norm;
    p.iter().all(|v| v.is_finite()).then_some(p)
}

/// Eigenvalues (descending) and their unit eigenvectors of a symmetric 3x3 matrix; `None` when it is
/// not finite.
pub fn symmetric_eigen3(m: &Matrix3<f64>) -> Option<([f64; 3], [Vector3<f64>; 3])> {
    if m.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let eigen = m.try_symmetric_eigen(f64::EPSILON, 1000)?;
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    Some((order.map(|i| eigen.eigenvalues[i]), order.map(|i| eigen.eigenvectors.column(i).into_owned())))
}

/// Inverse of a symmetric positive definite matrix with its condition number after scaling to unit
/// diagonal; `None` when it is not positive definite to working precision.
pub fn invert_spd(h: &nalgebra::DMatrix<f64>) -> Option<(nalgebra::DMatrix<f64>, f64)> {
    let n = h.nrows();
    if h.iter().any(|v| !v.is_finite()) || (0..n).any(|i| h[(i, i)] <= 0.0) {
        return None;
    }
    let s: Vec<f64> = (0..n).map(|i| 1.0 / h[(i, i)].sqrt()).collect();
    let scaled = nalgebra::DMatrix::from_fn(n, n, |i, j| h[(i, j)] * s[i] * s[j]);
    let inverse = nalgebra::Cholesky::new(scaled.clone())?.inverse();
    let eigen = scaled.try_symmetric_eigen(f64::EPSILON, 10_000)?;
    let (low, high) = (eigen.eigenvalues.min(), eigen.eigenvalues.max());
    if low <= 0.0 || inverse.iter().any(|v| !v.is_finite()) {
        return None;
    }
    Some((nalgebra::DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * s[i] * s[j]), high / low))
}

/// Isotropic scaling about the centroid to a mean distance of sqrt 2 (Hartley 1997).
#[derive(Debug, Clone, Copy)]
pub struct Normalisation2 {
    pub centre: Vector2<f64>,
    pub scale: f64,
}

impl Normalisation2 {
    /// `None` when all points coincide.
    pub fn of(points: &[Vector2<f64>]) -> Option<Self> {
        let n = points.len() as f64;
        let centre = points.iter().sum::<Vector2<f64>>() / n;
        let mean = points.iter().map(|p| (p - centre).norm()).sum::<f64>() / n;
        let size = points.iter().fold(centre.norm(), |m, p| m.max(p.norm()));
        (mean > 1e-12 * size && mean.is_finite()).then(|| Self { centre, scale: 2f64.sqrt() / mean })
    }

    pub fn apply(&self, p: &Vector2<f64>) -> Vector2<f64> {
        (p - self.centre) * self.scale
    }

    pub fn matrix(&self) -> Matrix3<f64> {
        let (s, c) = (self.scale, self.centre);
        Matrix3::new(s, 0.0, -s * c.x, 0.0, s, -s * c.y, 0.0, 0.0, 1.0)
    }

    pub fn inverse_matrix(&self) -> Matrix3<f64> {
        let (s, c) = (1.0 / self.scale, self.centre);
        Matrix3::new(s, 0.0, c.x, 0.0, s, c.y, 0.0, 0.0, 1.0)
    }
}

/// The same for points in space, to a mean distance of sqrt 3.
#[derive(Debug, Clone, Copy)]
pub struct Normalisation3 {
    pub centre: Vector3<f64>,
    pub scale: f64,
}

impl Normalisation3 {
    /// `None` when all points coincide.
    pub fn of(points: impl Iterator<Item = Vector3<f64>> + Clone) -> Option<Self> {
        let (mut n, mut sum, mut size) = (0.0, Vector3::zeros(), 0.0f64);
        for p in points.clone() {
            n += 1.0;
            sum += p;
            size = size.max(p.norm());
        }
        let centre = sum / n;
        let mean = points.map(|p| (p - centre).norm()).sum::<f64>() / n;
        (mean > 1e-12 * size && mean.is_finite()).then(|| Self { centre, scale: 3f64.sqrt() / mean })
    }

    pub fn apply(&self, p: &Vector3<f64>) -> Vector3<f64> {
        (p - self.centre) * self.scale
    }

    pub fn matrix(&self) -> Matrix4<f64> {
        let (s, c) = (self.scale, self.centre * -self.scale);
        Matrix4::new(s, 0.0, 0.0, c.x, 0.0, s, 0.0, c.y, 0.0, 0.0, s, c.z, 0.0, 0.0, 0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::SVector;

    use super::*;

    fn frobenius<const N: usize>(rows: &[[f64; N]]) -> f64 {
        rows.iter().flatten().map(|v| v * v).sum::<f64>().sqrt()
    }

    /// A small multiplicative generator, enough to vary test matrices.
    fn noise(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((*seed >> 33) as f64) / (1u64 << 31) as f64 - 0.5
    }

    #[test]
    fn all_ones_has_one_singular_value() {
        let svd = right_singular(&[[1.0; 5]; 3]);
        assert!((svd.values[0] - 15f64.sqrt()).abs() < 1e-14);
        assert!(svd.values[1..].iter().all(|v| *v < 1e-14));
    }

    #[test]
    fn factorisation_holds_on_random_and_repeated_values() {
        let mut seed = 7;
        for case in 0..2000 {
            let rows: Vec<[f64; 12]> = (0..12 + case % 90)
                .map(|i| std::array::from_fn(|j| if case % 3 == 0 && i % 5 == j % 5 { 1.0 } else { noise(&mut seed) }))
                .collect();
            let svd = right_singular(&rows);
            let total = svd.values.iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!((total - frobenius(&rows)).abs() < 1e-12 * total);
            for (value, vector) in svd.values.iter().zip(&svd.vectors) {
                assert!((dot(vector, vector) - 1.0).abs() < 1e-13);
                let image = rows.iter().map(|r| dot(r, vector).powi(2)).sum::<f64>().sqrt();
                assert!((image - value).abs() < 1e-12 * total);
            }
        }
    }

    #[test]
    fn huge_and_tiny_entries_do_not_overflow() {
        for scale in [1e300, 1e-300, 1e150] {
            let svd = right_singular(&[[scale, 0.0, 0.0], [0.0, 2.0 * scale, 0.0], [0.0, 0.0, scale]]);
            assert!((svd.values[0] / scale - 2.0).abs() < 1e-14);
        }
        assert!(right_singular(&[[f64::NAN, 0.0]]).values[0].is_nan());
        assert_eq!(right_singular::<3>(&[]).values, [0.0; 3]);
    }

    #[test]
    fn generalised_eigenvector_satisfies_its_equation() {
        let mut seed = 3;
        let a = SMatrix::<f64, 12, 12>::from_fn(|_, _| noise(&mut seed));
        let b = SMatrix::<f64, 12, 12>::from_fn(|_, _| noise(&mut seed));
        let (n, h) = (a * a.transpose(), b * b.transpose() + SMatrix::identity() * 0.1);
        let p = largest_generalised_eigenvector(&n, &h).unwrap();
        let mu = p.dot(&(n * p)) / p.dot(&(h * p));
        assert!((n * p - h * p * mu).norm() < 1e-9 * mu);
        for _ in 0..100 {
            let q = SVector::<f64, 12>::from_fn(|_, _| noise(&mut seed));
            assert!(q.dot(&(n * q)) <= mu * q.dot(&(h * q)) * (1.0 + 1e-9));
        }
        assert!(largest_generalised_eigenvector(&n, &(h * -1.0)).is_none());
        assert!(largest_generalised_eigenvector(&(n * f64::NAN), &h).is_none());
    }

    #[test]
    fn invert_spd_inverts_and_refuses() {
        let mut seed = 5;
        let a = nalgebra::DMatrix::from_fn(7, 7, |_, _| noise(&mut seed));
        let h = &a * a.transpose() * 1e6;
        let (inverse, condition) = invert_spd(&h).unwrap();
        assert!((h.clone() * inverse - nalgebra::DMatrix::identity(7, 7)).amax() < 1e-6);
        assert!(condition >= 1.0);
        assert!(invert_spd(&(h * -1.0)).is_none());
    }
}
