//! SIFT, the scale-invariant feature transform: D. G. Lowe, Distinctive image features from
//! scale-invariant keypoints, International Journal of Computer Vision 60(2), 2004.
//!
//! Octaves of Gaussian levels (`scale_space`; `doubling`, `raised`), extrema of their differences
//! (`extrema`), orientations and descriptors (`descriptor`, `window`). The image flows through all
//! octaves row by row, so that memory grows with its width and not with its height.
//!
//! As in the paper: 3 intervals an octave, blur 1.6 of an octave's first level, 0.5 assumed of the
//! image, the image doubled by linear interpolation, 36 orientation bins, 4 x 4 x 8 descriptor with a
//! Gaussian window of half its width, clipped at 0.2. As in OpenCV, which much data was made with: the
//! contrast threshold is divided by the intervals, the orientation histogram is smoothed, and the
//! descriptor's bytes have length 512 and OpenCV's order. Unlike OpenCV: descriptors and orientations are
//! centred at the refined place, not the nearest pixel, and a gradient is shared by the two orientation bins
//! about it.

mod arctangent;
mod descriptor;
mod distances;
mod doubling;
mod extrema;
mod kernels;
pub mod matching;
mod raised;
mod rows;
mod scale_space;
#[cfg(test)]
mod tests;
mod window;

use std::cmp::Ordering;
use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix2, Vector2};

use crate::error::{Error, Result};
use crate::image::ImageView;
use crate::image::pyramid::Grey;
use descriptor::Place;
pub use descriptor::{DESCRIPTOR_SIZE, Descriptor};
use extrema::{Extremum, Limits, Search};
pub use matching::{SiftMatch, SiftMatchOptions, match_sift};
use scale_space::{INTERVALS, Input, NEAR, Octave, REACH, SIGMA};

/// Shorter image sides hold no keypoint and its surroundings.
pub const MIN_IMAGE_SIDE: u32 = 12;
/// Wider images would need more than 700 MB of rows.
pub const MAX_IMAGE_WIDTH: u32 = 1 << 15;
/// Larger images are refused: they would take minutes.
pub const MAX_IMAGE_PIXELS: u64 = 1 << 28;
/// Most features of an image, whatever the options say: the strongest are kept.
pub const MAX_FEATURES: usize = 1 << 20;
/// Blur of the image as it comes, pixels.
const ASSUMED_BLUR: f64 = 0.5;
/// Variance that interpolating at quarters of a pixel, as OpenCV does, adds beyond ours at halves, in
/// pixels^2 of the doubled image: 3/4 - 1/2. With it the finest keypoints are as many as OpenCV's, and
/// more of them are found again.
const INTERPOLATION_BLUR: f64 = 0.25;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiftOptions {
    /// Most features; the strongest are kept. 0: all, up to [`MAX_FEATURES`].
    pub max_features: u32,
    /// Least contrast of a keypoint: 3 x |difference of Gaussians| of an image from 0 to 1.
    pub contrast_threshold: f64,
    /// Greatest ratio of the principal curvatures, above 1: edges have a larger one.
    pub edge_ratio: f64,
    /// Whether the image is doubled first: four times the time and about three times the keypoints,
    /// among them all whose scale is below 2 pixels.
    pub upsample: bool,
}

impl Default for SiftOptions {
    fn default() -> Self {
        Self { max_features: 0, contrast_threshold: 0.04, edge_ratio: 10.0, upsample: true }
    }
}

impl SiftOptions {
    pub(crate) fn check(&self) -> Result<()> {
        if !(self.contrast_threshold > 0.0 && self.contrast_threshold <= 1.0) {
            let reason = format!("{} is not in (0, 1]", self.contrast_threshold);
            return Err(Error::invalid("contrast_threshold", reason));
        }
        if !(self.edge_ratio > 1.0 && self.edge_ratio <= 1e6) {
            return Err(Error::invalid("edge_ratio", format!("{} is not in (1, 1e6]", self.edge_ratio)));
        }
        Ok(())
    }
}

/// A blob of the image and its dominant orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiftKeypoint {
    /// Pixels; (0, 0) is the centre of the top-left pixel.
    pub x: f64,
    pub y: f64,
    /// Standard deviation of the Gaussian at which it was found, pixels. OpenCV's `size` is twice this.
    pub scale: f64,
    /// Radians from x towards y, 0 to 2 pi.
    pub angle: f64,
    /// |difference of Gaussians| of an image from 0 to 1.
    pub response: f64,
    /// -1: the doubled image, 0: the image, 1: half of it, and so on.
    pub octave: i32,
    /// How much less sure its place is along `direction` than across it: ratio of the standard
    /// deviations, at least 1.
    pub elongation: f64,
    /// Radians from x towards y, -pi/2 to pi/2.
    pub direction: f64,
}

impl SiftKeypoint {
    /// Covariance of the place in units of its variance across `direction`: 1 across, elongation^2 along.
    ///
    /// It is the inverse of the curvature's matrix (B. Zeisl et al., Estimation of location uncertainty
    /// for scale invariant feature points, BMVC 2009). Measured on rendered rooms: errors across are alike
    /// for all keypoints, and those along grow with the root of the curvatures' ratio.
    pub fn shape(&self) -> Matrix2<f64> {
        let (s, c) = self.direction.sin_cos();
        let along = Vector2::new(c, s);
        Matrix2::identity() + along * along.transpose() * (self.elongation.powi(2) - 1.0)
    }

    /// Standard deviation of `x` and of `y`, pixels, from the scale alone: sqrt(0.08^2 + (0.02 scale)^2).
    ///
    /// Measured: 1.48 times the median deviation of right matches of warped photographs, noise of 2 grey
    /// levels, over sqrt(2), at scales of 1 to 20. Below a scale of 4 it is 0.04 pixels with a quarter of that
    /// noise and 0.14 with 2.5 times as much. The tails are long (textures, edges): the root mean square of all
    /// that lie within 2 pixels is 1.7 times as much, so matches want a robust estimator.
    pub fn position_sigma(&self) -> f64 {
        0.08f64.hypot(0.02 * self.scale)
    }
}

/// Keypoints, the strongest first, and their descriptors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SiftFeatures {
    pub keypoints: Vec<SiftKeypoint>,
    pub descriptors: Vec<Descriptor>,
}

impl SiftFeatures {
    /// Features that were kept elsewhere.
    ///
    /// # Errors
    /// `NotFinite`; `InvalidArgument` where keypoints and descriptors differ in number, for more than
    /// [`MAX_FEATURES`], for a scale that is not positive and an elongation below 1 or above 1000.
    pub fn new(keypoints: Vec<SiftKeypoint>, descriptors: Vec<Descriptor>) -> Result<Self> {
        let n = keypoints.len();
        if n != descriptors.len() {
            return Err(Error::invalid("descriptors", format!("{} for {n} keypoints", descriptors.len())));
        }
        if n > MAX_FEATURES {
            return Err(Error::invalid("keypoints", format!("{n}; at most {MAX_FEATURES} are possible")));
        }
        for (index, k) in keypoints.iter().enumerate() {
            if [k.x, k.y, k.scale, k.angle, k.response, k.elongation, k.direction].iter().any(|v| !v.is_finite()) {
                return Err(Error::NotFinite { name: "keypoints", index });
            }
            if k.scale <= 0.0 {
                return Err(Error::invalid("keypoints", format!("keypoint {index} has scale {}", k.scale)));
            }
            if !(1.0..=1e3).contains(&k.elongation) {
                return Err(Error::invalid("keypoints", format!("keypoint {index} has elongation {}", k.elongation)));
            }
        }
        Ok(Self { keypoints, descriptors })
    }
}

/// Finds and describes the keypoints of an image's luma. An image without contrast has none.
///
/// Memory: about 11 kB for each column of the image (6 kB without upsampling), and 0.2 kB a feature.
///
/// # Errors
/// `InvalidArgument` for options out of range and images too small or too large.
pub fn detect_sift(image: &ImageView<'_>, options: &SiftOptions) -> Result<SiftFeatures> {
    options.check()?;
    let (width, height) = (image.width(), image.height());
    if width.min(height) < MIN_IMAGE_SIDE {
        let reason = format!("{width} x {height} pixels; {MIN_IMAGE_SIDE} x {MIN_IMAGE_SIDE} are needed");
        return Err(Error::invalid("image", reason));
    }
    if width > MAX_IMAGE_WIDTH || u64::from(width) * u64::from(height) > MAX_IMAGE_PIXELS {
        let reason = format!("{width} x {height} pixels; at most {MAX_IMAGE_PIXELS}, {MAX_IMAGE_WIDTH} wide");
        return Err(Error::invalid("image", reason));
    }
    let mut detector = Detector::new([width as usize, height as usize], options);
    detector.run(&Grey::of(image));
    Ok(detector.found.into_features())
}

struct Detector {
    octaves: Vec<Stage>,
    found: Found,
}

/// An octave on its way down the image.
struct Stage {
    octave: Octave,
    search: Search,
    /// Rows searched, and rows of the next octave that it was handed.
    searched: usize,
    handed: usize,
    number: i32,
}

impl Detector {
    fn new([width, height]: [usize; 2], options: &SiftOptions) -> Self {
        let (first, factor) = if options.upsample { (-1, 2) } else { (0, 1) };
        let (mut width, mut height) = (factor * width, factor * height);
        let lacking = SIGMA.powi(2) - (factor as f64 * ASSUMED_BLUR).powi(2);
        let mut input = match options.upsample {
            true => Input::Doubled((lacking + INTERPOLATION_BLUR).sqrt()),
            false => Input::Blurred(lacking.sqrt()),
        };
        let mut octaves = Vec::new();
        let mut large = true;
        // After the last octave that is searched there is one for its upper levels.
        while large {
            large = width.min(height) >= MIN_IMAGE_SIDE as usize;
            octaves.push(Stage {
                octave: Octave::new(width, height, std::mem::replace(&mut input, Input::Level)),
                search: Search::new(width),
                searched: 0,
                handed: 0,
                number: first + octaves.len() as i32,
            });
            (width, height) = (Octave::half(width), Octave::half(height));
        }
        Self { octaves, found: Found::new(options) }
    }

    fn run(&mut self, image: &Grey<'_>) {
        for y in 0..image.height() {
            let Some(first) = self.octaves.first_mut() else { return };
            first.octave.push(|row| row.iter_mut().zip(image.row(y)).for_each(|(out, p)| *out = f32::from(*p)));
            advance(&mut self.octaves, &mut self.found);
        }
    }
}

/// Works out and searches what the first octave's last row allows, and hands every second pixel of the
/// level with twice the first one's blur to the next octave.
fn advance(octaves: &mut [Stage], found: &mut Found) {
    let Some((stage, rest)) = octaves.split_first_mut() else { return };
    while stage.octave.advance() {
        while let Some(next) = rest.first_mut()
            && stage.handed < next.octave.height()
            && stage.octave.hand(stage.handed, &mut next.octave)
        {
            stage.handed += 1;
            advance(rest, found);
        }
        if let Some(next) = rest.first() {
            stage.search(&next.octave, found);
        }
    }
}

impl Stage {
    /// Searches the rows whose surroundings are there.
    fn search(&mut self, next: &Octave, found: &mut Found) {
        let height = self.octave.height();
        let mut extrema = Vec::new();
        while self.searched < height
            && self.octave.rows(INTERVALS) >= (self.searched + REACH + 1).min(height)
            && self.octave.raise(next, (self.searched + NEAR + 1).min(height))
        {
            self.search.extrema(&self.octave, self.searched, &found.limits, &mut extrema);
            self.searched += 1;
        }
        for extremum in &extrema {
            found.add(&self.octave, self.number, extremum);
        }
    }
}

/// The features found so far.
struct Found {
    limits: Limits,
    most: usize,
    features: Vec<(SiftKeypoint, Descriptor)>,
    orientations: Vec<f32>,
}

impl Found {
    fn new(options: &SiftOptions) -> Self {
        let most = options.max_features as usize;
        Self {
            limits: Limits {
                contrast: options.contrast_threshold * 255.0 / INTERVALS as f64,
                edge_ratio: options.edge_ratio,
            },
            most: if most == 0 { MAX_FEATURES } else { most.min(MAX_FEATURES) },
            features: Vec::new(),
            orientations: Vec::new(),
        }
    }

    fn add(&mut self, octave: &Octave, number: i32, extremum: &Extremum) {
        let sigma = SIGMA * (extremum.level / INTERVALS as f64).exp2();
        let place = Place { level: extremum.layer, x: extremum.x as f32, y: extremum.y as f32, sigma: sigma as f32 };
        descriptor::orientations(octave, &place, &mut self.orientations);
        let pixel = f64::from(number).exp2();
        let (elongation, direction) = elongation(extremum.curvature);
        for &angle in &self.orientations {
            let keypoint = SiftKeypoint {
                x: pixel * extremum.x,
                y: pixel * extremum.y,
                scale: pixel * sigma,
                angle: f64::from(angle),
                response: extremum.value.abs() / 255.0,
                octave: number,
                elongation,
                direction,
            };
            self.features.push((keypoint, descriptor::describe(octave, &place, angle)));
        }
        if self.features.len() >= 2 * self.most + 1024 {
            self.keep_strongest();
        }
    }

    /// In order, without those that were found twice from different samples.
    fn keep_strongest(&mut self) {
        self.features.sort_by(|(a, _), (b, _)| order(a, b));
        self.features.dedup_by(|(a, _), (b, _)| order(a, b) == Ordering::Equal);
        self.features.truncate(self.most);
    }

    fn into_features(mut self) -> SiftFeatures {
        self.keep_strongest();
        let (keypoints, descriptors) = self.features.into_iter().unzip();
        SiftFeatures { keypoints, descriptors }
    }
}

/// Root of the ratio of the principal curvatures, and the direction of the lesser one.
fn elongation([xx, xy, yy]: [f64; 3]) -> (f64, f64) {
    // At an extremum both curvatures have one sign; the lesser one is nearer to 0.
    let (middle, half) = (0.5 * (xx + yy).abs(), (0.5 * (xx - yy)).hypot(xy));
    // Of the greater one.
    let steep = 0.5 * (2.0 * xy).atan2(xx - yy) + if xx + yy < 0.0 { FRAC_PI_2 } else { 0.0 };
    let direction = (steep + FRAC_PI_2).sin().atan2((steep + FRAC_PI_2).cos());
    let ratio = (middle + half) / (middle - half);
    // A direction and its opposite are one.
    let direction = if direction.abs() > FRAC_PI_2 { direction - PI.copysign(direction) } else { direction };
    (ratio.max(1.0).sqrt(), direction)
}

/// The strongest first; of equals, by place.
fn order(a: &SiftKeypoint, b: &SiftKeypoint) -> Ordering {
    let key = |k: &SiftKeypoint| [-k.response, k.y, k.x, k.scale, k.angle];
    let (a, b) = (key(a), key(b));
    a.iter().zip(&b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
}
