//! What two frames have in common, and the turn from one to the other.

use nalgebra::{Matrix3, Vector2, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use crate::detect::sift::{SiftFeatures, SiftMatchOptions, SiftOptions, detect_sift, match_sift};
use crate::error::Result;
use crate::geometry::rigid::nearest_rotation;
use crate::geometry::{Camera, Rigid};
use crate::image::ImageView;

/// Features of a frame, at most: the strongest.
const MAX_FEATURES: u32 = 800;
/// Matches that a turn must explain before it is believed, and their share of all.
pub const MIN_MATCHES: usize = 12;
const MIN_SHARE: f64 = 0.3;
const TRIALS: usize = 400;
/// Accepted deviation of a match from a pure turn, share of the image's width: what near things shift
/// against far ones when the camera is a few centimetres off the axes.
const PARALLAX: f64 = 0.012;

/// A frame's features and their rays.
pub struct Features {
    sift: SiftFeatures,
    /// In the camera's frame, unit.
    pub rays: Vec<Vector3<f64>>,
    pub pixels: Vec<Vector2<f64>>,
    /// px.
    pub sigmas: Vec<f64>,
}

/// Two frames that see the same things.
#[derive(Debug, Clone)]
pub struct Pair {
    pub a: usize,
    pub b: usize,
    /// Features of a and of b.
    pub matches: Vec<[usize; 2]>,
    /// From camera a to camera b.
    pub rotation: Matrix3<f64>,
}

pub fn features(image: &ImageView<'_>, camera: &Camera) -> Result<Features> {
    // Doubling the image would add features that are smaller than a pixel's error.
    let options =
        SiftOptions { max_features: MAX_FEATURES, upsample: false, contrast_threshold: 0.02, ..SiftOptions::default() };
    let found = detect_sift(image, &options)?;
    let lens = Camera { pose: Rigid::identity(), ..*camera };
    let mut kept = Features { sift: SiftFeatures::default(), rays: vec![], pixels: vec![], sigmas: vec![] };
    for (keypoint, descriptor) in found.keypoints.into_iter().zip(found.descriptors) {
        let pixel = Vector2::new(keypoint.x, keypoint.y);
        // One place may have several orientations: it is one sight.
        if kept.pixels.last().is_some_and(|p| (p - pixel).norm() < 1e-6) {
            continue;
        }
        let Some(ray) = lens.back_project(&pixel) else { continue };
        kept.rays.push(ray.direction.normalize());
        kept.pixels.push(pixel);
        kept.sigmas.push(keypoint.position_sigma());
        kept.sift.keypoints.push(keypoint);
        kept.sift.descriptors.push(descriptor);
    }
    Ok(kept)
}

/// The pair of frames `ids`; `None` when too little is common.
pub fn pair(ids: [usize; 2], a: &Features, b: &Features, camera: &Camera) -> Result<Option<Pair>> {
    let matches: Vec<[usize; 2]> =
        match_sift(&a.sift, &b.sift, &SiftMatchOptions::default())?.iter().map(|m| [m.a, m.b]).collect();
    let tolerance = PARALLAX * f64::from(camera.width) / camera.intrinsics.fx;
    let rays: Vec<(Vector3<f64>, Vector3<f64>)> = matches.iter().map(|[i, j]| (a.rays[*i], b.rays[*j])).collect();
    let Some((rotation, inliers)) = turn(&rays, tolerance) else { return Ok(None) };
    let matches = inliers.into_iter().map(|i| matches[i]).collect();
    Ok(Some(Pair { a: ids[0], b: ids[1], matches, rotation }))
}

/// The rotation that most pairs of rays agree with, and which do.
fn turn(rays: &[(Vector3<f64>, Vector3<f64>)], tolerance: f64) -> Option<(Matrix3<f64>, Vec<usize>)> {
    let n = rays.len();
    if n < MIN_MATCHES {
        return None;
    }
    let agree = |r: &Matrix3<f64>| -> Vec<usize> {
        (0..n).filter(|i| (r * rays[*i].0 - rays[*i].1).norm() < tolerance).collect()
    };
    let mut random = ChaCha8Rng::seed_from_u64(n as u64);
    let mut best: Vec<usize> = Vec::new();
    for _ in 0..TRIALS {
        let (i, j) = (random.next_u32() as usize % n, random.next_u32() as usize % n);
        let ([a, b], [c, d]) = ([rays[i].0, rays[j].0], [rays[i].1, rays[j].1]);
        // Two rays that are near each other fix no roll.
        if a.cross(&b).norm() < 5.0 * tolerance || (a.dot(&b) - c.dot(&d)).abs() > 2.0 * tolerance {
            continue;
        }
        let (Some(from), Some(to)) = (triad(&a, &b), triad(&c, &d)) else { continue };
        let found = agree(&(to * from.transpose()));
        if found.len() > best.len() {
            best = found;
        }
    }
    let mut rotation = Matrix3::identity();
    for _ in 0..3 {
        if best.len() < MIN_MATCHES || (best.len() as f64) < MIN_SHARE * n as f64 {
            return None;
        }
        let sum = best.iter().fold(Matrix3::zeros(), |sum, i| sum + rays[*i].1 * rays[*i].0.transpose());
        rotation = nearest_rotation(&sum)?;
        best = agree(&rotation);
    }
    (best.len() >= MIN_MATCHES).then_some((rotation, best))
}

/// An orthonormal frame from two directions.
fn triad(a: &Vector3<f64>, b: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let middle = (a + b).try_normalize(1e-9)?;
    let across = (b - a).try_normalize(1e-9)?;
    Some(Matrix3::from_columns(&[middle, across, middle.cross(&across)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rigid::{exp, log};
    use crate::rig::fake::Random;

    #[test]
    fn a_turn_is_found_among_wrong_matches_and_none_where_there_is_none() {
        let mut random = Random(5);
        let mut ray = || Vector3::new(random.between(-0.4, 0.4), random.between(-0.3, 0.3), 1.0).normalize();
        let truth = exp(&Vector3::new(0.02, 0.25, -0.01));
        let mut rays: Vec<_> = (0..60).map(|_| ray()).map(|a| (a, truth * a)).collect();
        rays.extend((0..60).map(|_| (ray(), ray())));
        let (rotation, inliers) = turn(&rays, 0.01).unwrap();
        assert!(log(&(rotation * truth.transpose())).norm() < 1e-3);
        assert!((0..60).all(|i| inliers.contains(&i)) && inliers.len() < 64);
        let wrong: Vec<_> = (0..200).map(|_| (ray(), ray())).collect();
        assert!(turn(&wrong, 0.01).is_none());
        assert!(turn(&rays[..MIN_MATCHES - 1], 0.01).is_none());
    }
}
