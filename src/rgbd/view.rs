//! One view of the auxiliary camera: its features, and the points that they are where it has depth.

use nalgebra::Vector2;

use super::RgbdOptions;
use super::lift::{Lifted, lift};
use crate::detect::lines::{LineOptions, LineSegment, detect_line_segments, lift_segments};
use crate::detect::sift::{SiftFeatures, SiftMatch, SiftMatchOptions, detect_sift, match_sift};
use crate::error::{Error, Result};
use crate::geometry::{Camera, MeasuredLine};
use crate::image::{DepthMap, ImageView};

/// What a view has to offer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ViewCounts {
    /// Features of its image.
    pub features: usize,
    /// Of them, those that have a depth.
    pub with_depth: usize,
    /// Features that look like one of the fixed camera's image.
    pub matches: usize,
    /// Of these, those that have a depth.
    pub pairs: usize,
    /// Straight edges of its image that are lines in space.
    pub lines: usize,
}

#[derive(Debug, Clone)]
pub(super) struct View {
    pub counts: ViewCounts,
    pub features: SiftFeatures,
    /// One for each feature.
    pub lifted: Vec<Option<Lifted>>,
    /// Pairs of its features and the fixed camera's that look alike, where there is depth.
    pub pairs: Vec<(usize, usize)>,
    /// Pairs with depth that are each other's nearest, distinct from the next or not.
    pub candidates: Vec<(usize, usize)>,
    /// Its straight edges that have a depth, each with the segment that it is in its image.
    pub lines: Vec<(MeasuredLine, LineSegment)>,
}

impl View {
    pub fn new(
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
        let lifted = features.keypoints.iter().map(|k| {
            let pixel = Vector2::new(k.x, k.y);
            lift(camera, &pixel, &k.shape(), &depth.inverse_depth(&pixel, &options.depth_noise)?)
        });
        let lifted: Vec<Option<Lifted>> = lifted.collect();
        let matches = match_sift(&features, fixed, &options.matching)?;
        let with_depth = |matches: &[SiftMatch]| -> Vec<(usize, usize)> {
            matches.iter().filter(|m| lifted[m.a].is_some()).map(|m| (m.a, m.b)).collect()
        };
        let pairs = with_depth(&matches);
        let every = SiftMatchOptions { max_ratio: 1.0, mutual: true };
        let candidates = if options.guided { with_depth(&match_sift(&features, fixed, &every)?) } else { Vec::new() };
        let mut lines = Vec::new();
        if options.lines {
            let segments = detect_line_segments(colour, &LineOptions::default())?;
            let lifted = lift_segments(&segments, camera, depth, &options.depth_noise)?;
            lines.extend(lifted.into_iter().zip(segments).filter_map(|(line, segment)| Some((line?, segment))));
        }
        let counts = ViewCounts {
            features: features.keypoints.len(),
            with_depth: lifted.iter().flatten().count(),
            matches: matches.len(),
            pairs: pairs.len(),
            lines: lines.len(),
        };
        Ok(Self { counts, features, lifted, pairs, candidates, lines })
    }
}
