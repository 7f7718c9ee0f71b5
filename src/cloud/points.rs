//! Clouds moved, put together, and cut.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::error::{Error, Result};
use crate::geometry::point_cloud::{check_count, pack, unpack};
use crate::geometry::rigid::{rotation_defect, skew};
use crate::geometry::{CloudNoise, PointCloud, Rigid};

/// Moves a cloud: X <- R X + t. Covariances turn with it, C <- R C R^T. With the covariance of the
/// pose, of (w, t) with w the rotation vector (radians) in R <- exp([w]x) R and t in metres (as
/// [`PoseEstimate`](crate::pose::PoseEstimate) has it), each covariance grows by what the pose's error
/// does to the point, J S J^T with J = [-[R X]x, I]. That error is common to all points: two of them
/// are better known relative to each other than their covariances say.
///
/// A cloud whose noise is unknown stays so.
///
/// # Errors
/// `InvalidArgument` for what is no rotation or no covariance; `NotFinite`.
pub fn transform(cloud: &mut PointCloud, pose: &Rigid, pose_covariance: Option<&SMatrix<f64, 6, 6>>) -> Result<()> {
    if !pose.is_finite() {
        return Err(Error::NotFinite { name: "pose", index: 0 });
    }
    let defect = rotation_defect(&pose.rotation);
    if defect > 1e-6 {
        return Err(Error::invalid("pose", format!("not a rotation: R R^T - I has an entry of {defect:.2e}")));
    }
    if let Some(s) = pose_covariance {
        if let Some(index) = s.iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "pose_covariance", index });
        }
        let asymmetry = (s - s.transpose()).amax();
        if asymmetry > 1e-9 * s.amax() || s.diagonal().min() < 0.0 {
            return Err(Error::invalid("pose_covariance", "not symmetric, or a variance is negative"));
        }
        if matches!(cloud.noise, CloudNoise::Deviations(_)) {
            cloud.noise = std::mem::take(&mut cloud.noise).into_covariances();
        }
    }
    let r = &pose.rotation;
    for position in &mut cloud.positions {
        *position = pose.apply(position);
    }
    for normal in cloud.normals.iter_mut().flatten() {
        *normal = r * *normal;
    }
    if let CloudNoise::Covariances(covariances) = &mut cloud.noise {
        for (c, moved) in covariances.iter_mut().zip(&cloud.positions) {
            let mut turned = r * unpack(c) * r.transpose();
            if let Some(s) = pose_covariance {
                let mut j = SMatrix::<f64, 3, 6>::zeros();
                j.fixed_view_mut::<3, 3>(0, 0).copy_from(&-skew(&(moved - pose.translation)));
                j.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
                turned += j * s * j.transpose();
            }
            *c = pack(&turned);
        }
    }
    Ok(())
}

/// Appends the points of `other`. Deviations become covariances where the other cloud has those.
///
/// # Errors
/// `InvalidArgument` when only one of the two has normals or knows its noise, which would be lost, and
/// when they are too many points.
pub fn merge(cloud: &mut PointCloud, other: &PointCloud) -> Result<()> {
    if other.is_empty() {
        return Ok(());
    }
    if cloud.is_empty() {
        cloud.clone_from(other);
        return Ok(());
    }
    check_count(cloud.len().saturating_add(other.len()))?;
    if cloud.normals.is_some() != other.normals.is_some() {
        return Err(Error::invalid("other", "only one of the two clouds has normals: drop them before"));
    }
    // What can fail has to come before what changes.
    match (&mut cloud.noise, &other.noise) {
        (CloudNoise::Unknown, CloudNoise::Unknown) => {}
        (CloudNoise::Unknown, _) | (_, CloudNoise::Unknown) => {
            let reason = "the noise of only one of the two clouds is known: state the other's, or drop it before";
            return Err(Error::invalid("other", reason));
        }
        (CloudNoise::Deviations(own), CloudNoise::Deviations(others)) => own.extend(others),
        (own, others) => {
            let (mine, more) = (std::mem::take(own).into_covariances(), others.clone().into_covariances());
            *own = mine;
            if let (CloudNoise::Covariances(own), CloudNoise::Covariances(more)) = (own, more) {
                own.extend(more);
            }
        }
    }
    cloud.positions.extend(&other.positions);
    cloud.colours.extend(&other.colours);
    if let (Some(own), Some(others)) = (&mut cloud.normals, &other.normals) {
        own.extend(others);
    }
    Ok(())
}

/// The points inside a box, its faces included.
///
/// # Errors
/// `NotFinite`; `InvalidArgument` for a least coordinate above the greatest.
pub fn crop(cloud: &PointCloud, least: &Vector3<f64>, greatest: &Vector3<f64>) -> Result<PointCloud> {
    for (name, corner) in [("least", least), ("greatest", greatest)] {
        if let Some(index) = corner.iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name, index });
        }
    }
    if (0..3).any(|i| least[i] > greatest[i]) {
        return Err(Error::invalid("least", "above the greatest"));
    }
    let inside = |p: &Vector3<f64>| (0..3).all(|i| (least[i]..=greatest[i]).contains(&p[i]));
    let kept: Vec<usize> = (0..cloud.len()).filter(|i| inside(&cloud.positions[*i])).collect();
    Ok(cloud.select(&kept))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rigid::exp;

    fn cloud() -> PointCloud {
        let ray = Vector3::new(0.2, -0.1, 3.0);
        PointCloud {
            positions: vec![ray, Vector3::new(-1.0, 0.5, 2.0)],
            colours: vec![[255, 0, 0], [0, 0, 255]],
            normals: Some(vec![-Vector3::z(), Vector3::x()]),
            noise: CloudNoise::Covariances(vec![
                pack(&(ray * ray.transpose() * 1e-4)),
                [1e-4, 0.0, 0.0, 1e-4, 0.0, 4e-4],
            ]),
        }
    }

    fn pose() -> Rigid {
        Rigid { rotation: exp(&Vector3::new(0.3, -1.0, 0.2)), translation: Vector3::new(4.0, -1.0, 0.5) }
    }

    #[test]
    fn a_move_and_its_inverse_change_nothing() {
        let mut moved = cloud();
        transform(&mut moved, &pose(), None).unwrap();
        assert!((moved.positions[0] - pose().apply(&cloud().positions[0])).norm() < 1e-15);
        // Along the ray it stays.
        let ray = pose().rotation * cloud().positions[0];
        assert!((moved.noise.covariance(0).unwrap() - ray * ray.transpose() * 1e-4).amax() < 1e-15);
        transform(&mut moved, &pose().inverse(), None).unwrap();
        for i in 0..2 {
            assert!((moved.positions[i] - cloud().positions[i]).norm() < 1e-14);
            let (a, b) = (moved.noise.covariance(i).unwrap(), cloud().noise.covariance(i).unwrap());
            assert!((a - b).amax() < 1e-16, "{a} {b}");
        }
        assert!((moved.normals.unwrap()[1] - Vector3::x()).norm() < 1e-14);
    }

    /// Against the covariance of 40,000 points moved by noisy poses.
    #[test]
    fn the_poses_covariance_is_that_of_moved_points() {
        use crate::fuzz::Random;
        let mut random = Random(7);
        // Twelve uniform numbers have variance 1.
        let mut gauss = || (0..12).map(|_| random.below(1 << 30) as f64 / (1u64 << 30) as f64).sum::<f64>() - 6.0;
        let root =
            SMatrix::<f64, 6, 6>::from_fn(
                |i, j| if i >= j { 0.002 * (1.0 + (i * 5 + j * 3) as f64 % 4.0) } else { 0.0 },
            );
        let mut moved = cloud();
        transform(&mut moved, &pose(), Some(&(root * root.transpose()))).unwrap();
        let wanted = moved.noise.covariance(1).unwrap();
        let (x, n) = (cloud().positions[1], 40_000);
        let own = [0.01, 0.01, 0.02];
        let mut sum = Matrix3::zeros();
        for _ in 0..n {
            let e = root * nalgebra::SVector::<f64, 6>::from_fn(|_, _| gauss());
            let noisy = x + Vector3::from_fn(|i, _| own[i] * gauss());
            let turned = exp(&e.fixed_rows::<3>(0).into()) * pose().rotation;
            let at = turned * noisy + pose().translation + e.fixed_rows::<3>(3);
            let d = at - moved.positions[1];
            sum += d * d.transpose() / f64::from(n);
        }
        // 3 standard deviations of a sample variance are 2 %; curvature and covariances add.
        assert!((sum - wanted).amax() < 0.04 * wanted.amax(), "{sum} {wanted}");
    }

    #[test]
    fn clouds_merge_without_loss_or_not_at_all() {
        let mut both = cloud();
        merge(&mut both, &cloud()).unwrap();
        assert_eq!((both.len(), both.validate()), (4, Ok(())));
        let mut mixed = PointCloud { noise: CloudNoise::Deviations(vec![0.1, 0.2]), ..cloud() };
        merge(&mut mixed, &cloud()).unwrap();
        assert!((mixed.noise.deviation(1).unwrap() - 0.2).abs() < 1e-15 && mixed.validate().is_ok());
        for other in [PointCloud { noise: CloudNoise::Unknown, ..cloud() }, PointCloud { normals: None, ..cloud() }] {
            let mut same = cloud();
            assert!(merge(&mut same, &other).is_err());
            assert_eq!(same, cloud());
        }
        let mut empty = PointCloud::default();
        merge(&mut empty, &cloud()).unwrap();
        merge(&mut empty, &PointCloud::default()).unwrap();
        assert_eq!(empty, cloud());
    }

    #[test]
    fn a_box_keeps_what_is_inside() {
        let kept = crop(&cloud(), &Vector3::new(-1.0, 0.0, 0.0), &Vector3::new(0.0, 0.5, 2.0)).unwrap();
        assert_eq!((kept.positions, kept.colours), (vec![cloud().positions[1]], vec![[0, 0, 255]]));
        assert!(crop(&cloud(), &Vector3::z(), &Vector3::zeros()).is_err());
        assert!(crop(&cloud(), &Vector3::repeat(f64::NAN), &Vector3::zeros()).is_err());
    }

    #[test]
    fn what_is_no_pose_is_refused() {
        let refused = |pose: Rigid, s: Option<SMatrix<f64, 6, 6>>| {
            let mut same = cloud();
            let refused = transform(&mut same, &pose, s.as_ref()).is_err();
            refused && same == cloud()
        };
        assert!(refused(Rigid { rotation: Matrix3::identity() * 1.1, ..pose() }, None));
        assert!(refused(Rigid { translation: Vector3::repeat(f64::INFINITY), ..pose() }, None));
        assert!(refused(pose(), Some(SMatrix::repeat(f64::NAN))));
        assert!(refused(pose(), Some(-SMatrix::identity())));
        assert!(refused(pose(), Some(SMatrix::from_fn(|i, j| if i == 0 && j == 1 { 1.0 } else { 0.0 }))));
    }
}
