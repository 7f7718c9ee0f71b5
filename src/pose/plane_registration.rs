//! Registration of two stations by matched planes: in closed form, and by maximum likelihood.

use nalgebra::{Matrix3, SMatrix, Vector3, Vector6};

use super::procrustes::kabsch;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::Rigid;
use crate::geometry::linalg::right_singular;
use crate::geometry::rigid::{exp, skew};

/// The same plane n . X = 1 in the frames of station a and station b, with covariances.
#[derive(Debug, Clone, PartialEq)]
pub struct MatchedPlane {
    pub a: Vector3<f64>,
    pub b: Vector3<f64>,
    pub covariance_a: Matrix3<f64>,
    pub covariance_b: Matrix3<f64>,
}

impl MatchedPlane {
    /// n in a's frame as b's estimate and a pose predict it, its derivatives by n in b's, by m = R n_b
    /// and the covariance of the difference. n_a = m / (1 + m . t).
    fn predicted(&self, b_to_a: &Rigid) -> Prediction {
        let m = b_to_a.rotation * self.b;
        let scale = 1.0 + m.dot(&b_to_a.translation);
        let n = m / scale;
        let by_m = (Matrix3::identity() - n * b_to_a.translation.transpose()) / scale;
        let by_b = by_m * b_to_a.rotation;
        Prediction { n, m, by_m, covariance: self.covariance_a + by_b * self.covariance_b * by_b.transpose() }
    }

    /// Squared difference of the two estimates by a pose, in standard deviations; infinite without a
    /// covariance.
    pub(super) fn distance(&self, b_to_a: &Rigid) -> f64 {
        let p = self.predicted(b_to_a);
        let difference = self.a - p.n;
        p.covariance.cholesky().map_or(f64::INFINITY, |c| difference.dot(&c.solve(&difference)))
    }

    /// The same planes with other variances.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self { covariance_a: self.covariance_a * factor, covariance_b: self.covariance_b * factor, ..*self }
    }

    /// Angular variance of the two unit normals together (radians^2) and variance of the
    /// difference of the distances (metres^2).
    fn variances(&self) -> (f64, f64) {
        let one = |n: &Vector3<f64>, c: &Matrix3<f64>| {
            let (norm2, along) = (n.norm_squared(), n.dot(&(c * n)) / n.norm_squared());
            ((c.trace() - along) / norm2, along / (norm2 * norm2))
        };
        let ((angle_a, distance_a), (angle_b, distance_b)) =
            (one(&self.a, &self.covariance_a), one(&self.b, &self.covariance_b));
        (angle_a + angle_b, distance_a + distance_b)
    }
}

struct Prediction {
    n: Vector3<f64>,
    m: Vector3<f64>,
    by_m: Matrix3<f64>,
    covariance: Matrix3<f64>,
}

/// Smallest ratio of the least to the largest extent of the normals.
const MIN_SPAN: f64 = 1e-3;

/// Station b's frame to station a's from three or more planes: Kabsch on the unit normals, then
/// linear least squares for the translation, each weighted by the planes' variances (alike when
/// any plane is exact). Returns the condition too. Refuses normals that do not span space.
pub fn plane_to_plane(planes: &[MatchedPlane]) -> Result<(Rigid, f64)> {
    let units = || planes.iter().map(|p| (p.a.normalize(), p.b.normalize()));
    let span = |rows: Vec<[f64; 3]>| right_singular(&rows).values;
    let values = span(units().map(|(a, _)| a.into()).collect());
    if values[2] <= MIN_SPAN * values[0] || span(units().map(|(_, b)| b.into()).collect())[2] <= MIN_SPAN * values[0] {
        return Err(Error::degenerate(
            Degeneracy::Parallel,
            "the planes' normals do not span space: a translation along all planes is unobservable",
        ));
    }
    let weigh = |variances: Vec<f64>| -> Vec<f64> {
        let exact = variances.iter().any(|v| *v <= 0.0);
        variances.iter().map(|v| if exact { 1.0 } else { 1.0 / v }).collect()
    };
    let angular = weigh(planes.iter().map(|p| p.variances().0).collect());
    let distance = weigh(planes.iter().map(|p| p.variances().1).collect());
    let correlation: Matrix3<f64> = units().zip(&angular).map(|((a, b), w)| a * b.transpose() * *w).sum();
    let (rotation, condition) = kabsch(&correlation)?;
    // u . X = h in frame a with u = R u_b gives u . t = h_a - h_b.
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for ((p, (_, unit_b)), w) in planes.iter().zip(units()).zip(distance) {
        let u = rotation * unit_b;
        normal += u * u.transpose() * w;
        right += u * ((1.0 / p.a.norm() - 1.0 / p.b.norm()) * w);
    }
    let translation = normal
        .cholesky()
        .map(|c| c.solve(&right))
        .filter(|t| t.iter().all(|v| v.is_finite()))
        .ok_or_else(|| Error::degenerate(Degeneracy::Parallel, "the planes leave a translation free"))?;
    Ok((Rigid { rotation, translation }, condition.max((values[0] / values[2]).powi(2))))
}

/// A pose by maximum likelihood.
pub struct PlanePose {
    pub b_to_a: Rigid,
    /// Covariance of (w, t), as in [`PoseEstimate`](super::PoseEstimate).
    pub covariance: SMatrix<f64, 6, 6>,
    /// Sum of squares of the planes' differences, in their standard deviations.
    pub chi_square: f64,
}

/// Maximum likelihood from the planes' estimates and covariances, by Gauss-Newton from `start`.
/// A plane fit in inverse depth is nearly Gaussian in n, so that little is lost against a joint
/// fit to all shots. Refuses planes without covariance.
pub fn maximum_likelihood(planes: &[MatchedPlane], start: Rigid) -> Result<PlanePose> {
    const MAX_ITERATIONS: usize = 50;
    let singular =
        || Error::degenerate(Degeneracy::IllConditioned, "the planes, with their covariances, do not fix the pose");
    let mut pose = start;
    for _ in 0..MAX_ITERATIONS {
        let (mut information, mut gradient) = (SMatrix::<f64, 6, 6>::zeros(), Vector6::zeros());
        let mut chi_square = 0.0;
        for p in planes {
            let Prediction { n, m, by_m, covariance } = p.predicted(&pose);
            let weight = covariance.cholesky().ok_or_else(|| {
                Error::invalid("method", "maximum likelihood needs planes with a covariance of full rank")
            })?;
            let mut jacobian = SMatrix::<f64, 3, 6>::zeros();
            jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&(by_m * -skew(&m)));
            jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-n * n.transpose()));
            let difference = p.a - n;
            let weighted = weight.solve(&difference);
            information += jacobian.transpose() * weight.solve(&jacobian);
            gradient += jacobian.transpose() * weighted;
            chi_square += difference.dot(&weighted);
        }
        let factor = information.cholesky().ok_or_else(singular)?;
        let step = factor.solve(&gradient);
        let (turn, shift) = (Vector3::new(step[0], step[1], step[2]), Vector3::new(step[3], step[4], step[5]));
        pose.rotation = exp(&turn) * pose.rotation;
        pose.translation += shift;
        if !pose.is_finite() {
            break;
        }
        if turn.norm() <= 1e-13 && shift.norm() <= 1e-13 * (1.0 + pose.translation.norm()) {
            return Ok(PlanePose { b_to_a: pose, covariance: factor.inverse(), chi_square });
        }
    }
    Err(Error::NoConvergence { iterations: MAX_ITERATIONS, detail: "registration of planes".into() })
}
