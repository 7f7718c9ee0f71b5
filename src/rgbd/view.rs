//! One view of the auxiliary camera: its features with depth, and those of them that match.

use nalgebra::Vector2;

use super::lift::lift;
use super::{PointPair, RgbdOptions};
use crate::detect::sift::{SiftFeatures, detect_sift, match_sift};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::image::{DepthMap, ImageView};

/// What a view has to offer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ViewCounts {
    /// Features of its image.
    pub features: usize,
    /// Of them, those that look like one of the fixed camera's image.
    pub matches: usize,
    /// Of these, those that have a depth.
    pub pairs: usize,
}

#[derive(Debug, Clone)]
pub(super) struct View {
    pub counts: ViewCounts,
    pub points: Vec<PointPair>,
}

impl View {
    pub fn new(
        number: usize,
        colour: &ImageView<'_>,
        depth: &DepthMap,
        camera: &Camera,
        fixed: &SiftFeatures,
        options: &RgbdOptions,
    ) -> Result<Self> {
        camera.validate()?;
        let [width, height] = [colour.width(), colour.height()];
        let depth_size = [depth.width() as u32, depth.height() as u32];
        for (name, size) in [("depth", depth_size), ("camera", [camera.width, camera.height])] {
            if size != [width, height] {
                let reason = format!("{} x {} pixels for an image of {width} x {height}", size[0], size[1]);
                return Err(Error::invalid(name, reason));
            }
        }
        let features = detect_sift(colour, &options.sift)?;
        let matches = match_sift(&features, fixed, &options.matching)?;
        let place = |f: &SiftFeatures, i: usize| Vector2::new(f.keypoints[i].x, f.keypoints[i].y);
        let pair = |auxiliary: Vector2<f64>, fixed: Vector2<f64>| {
            let depth = depth.inverse_depth(&auxiliary, &options.depth_noise)?;
            let (world, covariance) = lift(camera, &auxiliary, &depth, options.keypoint_sigma)?;
            Some(PointPair { view: number, auxiliary, fixed, world, covariance })
        };
        let points: Vec<PointPair> =
            matches.iter().filter_map(|m| pair(place(&features, m.a), place(fixed, m.b))).collect();
        let counts = ViewCounts { features: features.keypoints.len(), matches: matches.len(), pairs: points.len() };
        Ok(Self { counts, points })
    }
}
