//! What a calibration was made from, as files keep it: the measurements and the options.

use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::model_json::{DistortionSchema, IntrinsicsSchema};
use crate::geometry::{Distortion, Intrinsics, InverseDepthPoint};

/// A measurement; the fields mean what those of [`Observation`](crate::calibrate::Observation) and
/// [`ObservedLine`](crate::calibrate::ObservedLine) mean.
#[derive(Debug, Clone, PartialEq)]
pub enum ObservationRecord {
    Point {
        world: Vector3<f64>,
        world_covariance: Option<Matrix3<f64>>,
        pixel: Vector2<f64>,
        pixel_covariance: Option<Matrix2<f64>>,
    },
    Shot {
        shot: InverseDepthPoint,
        pixel: Vector2<f64>,
        pixel_covariance: Matrix2<f64>,
    },
    Line {
        point: Vector3<f64>,
        direction: Vector3<f64>,
        /// Boxed: seven times as large as a point.
        covariance: Option<Box<Matrix6<f64>>>,
        ends: [Vector2<f64>; 2],
        end_covariances: Option<[Matrix2<f64>; 2]>,
    },
}

/// The options of a calibration; the fields mean what those of
/// [`CalibrationOptions`](crate::calibrate::CalibrationOptions) mean.
#[derive(Debug, Clone, PartialEq)]
pub struct OptionsRecord {
    /// none, radial1, radial2, brown_conrady, division or fisheye.
    pub distortion: String,
    pub fixed_lens: Option<(Intrinsics, Distortion)>,
    pub skew_sigma: f64,
    pub aspect_sigma: f64,
    pub robust: bool,
    pub pixel_sigma: Option<f64>,
    pub max_focal_deviation: f64,
    pub seed: u64,
    pub max_iterations: usize,
}

/// Everything that the answer of a calibration follows from, bit for bit.
#[derive(Debug, Clone, PartialEq)]
pub struct InputsRecord {
    pub options: OptionsRecord,
    pub observations: Vec<ObservationRecord>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InputsSchema {
    options: OptionsSchema,
    observations: Vec<ObservationSchema>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OptionsSchema {
    distortion: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    fixed_lens: Option<LensSchema>,
    /// JSON has no infinity: null, which frees the parameter.
    skew_sigma: Option<f64>,
    aspect_sigma: Option<f64>,
    max_focal_deviation: Option<f64>,
    robust: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pixel_sigma: Option<f64>,
    seed: u64,
    max_iterations: usize,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LensSchema {
    intrinsics: IntrinsicsSchema,
    distortion: DistortionSchema,
}

/// A covariance of a pixel is xx, xy, yy; the others are by rows.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum ObservationSchema {
    Point {
        xyz: [f64; 3],
        #[serde(skip_serializing_if = "Option::is_none")]
        xyz_covariance: Option<[[f64; 3]; 3]>,
        uv: [f64; 2],
        #[serde(skip_serializing_if = "Option::is_none")]
        uv_covariance: Option<[f64; 3]>,
    },
    Shot {
        origin: [f64; 3],
        direction: [f64; 3],
        inverse_depth: f64,
        variance: f64,
        uv: [f64; 2],
        uv_covariance: [f64; 3],
    },
    Line {
        point: [f64; 3],
        direction: [f64; 3],
        #[serde(skip_serializing_if = "Option::is_none")]
        covariance: Option<Box<[[f64; 6]; 6]>>,
        ends: [[f64; 2]; 2],
        #[serde(skip_serializing_if = "Option::is_none")]
        end_covariances: Option<[[f64; 3]; 2]>,
    },
}

fn three(c: &Matrix2<f64>) -> [f64; 3] {
    [c.m11, c.m12, c.m22]
}

fn square([xx, xy, yy]: [f64; 3]) -> Matrix2<f64> {
    Matrix2::new(xx, xy, xy, yy)
}

impl From<&ObservationRecord> for ObservationSchema {
    fn from(record: &ObservationRecord) -> Self {
        match record {
            ObservationRecord::Point { world, world_covariance, pixel, pixel_covariance } => Self::Point {
                xyz: (*world).into(),
                // nalgebra keeps columns.
                xyz_covariance: world_covariance.map(|c| c.transpose().into()),
                uv: (*pixel).into(),
                uv_covariance: pixel_covariance.as_ref().map(three),
            },
            ObservationRecord::Shot { shot, pixel, pixel_covariance } => Self::Shot {
                origin: shot.origin.into(),
                direction: shot.direction.into(),
                inverse_depth: shot.rho,
                variance: shot.variance,
                uv: (*pixel).into(),
                uv_covariance: three(pixel_covariance),
            },
            ObservationRecord::Line { point, direction, covariance, ends, end_covariances } => Self::Line {
                point: (*point).into(),
                direction: (*direction).into(),
                covariance: covariance.as_ref().map(|c| Box::new(c.transpose().into())),
                ends: ends.map(Into::into),
                end_covariances: end_covariances.as_ref().map(|c| c.each_ref().map(three)),
            },
        }
    }
}

impl From<ObservationSchema> for ObservationRecord {
    fn from(schema: ObservationSchema) -> Self {
        match schema {
            ObservationSchema::Point { xyz, xyz_covariance, uv, uv_covariance } => Self::Point {
                world: xyz.into(),
                world_covariance: xyz_covariance.map(|c| Matrix3::from(c).transpose()),
                pixel: uv.into(),
                pixel_covariance: uv_covariance.map(square),
            },
            ObservationSchema::Shot { origin, direction, inverse_depth, variance, uv, uv_covariance } => Self::Shot {
                shot: InverseDepthPoint {
                    origin: origin.into(),
                    direction: direction.into(),
                    rho: inverse_depth,
                    variance,
                },
                pixel: uv.into(),
                pixel_covariance: square(uv_covariance),
            },
            ObservationSchema::Line { point, direction, covariance, ends, end_covariances } => Self::Line {
                point: point.into(),
                direction: direction.into(),
                covariance: covariance.map(|c| Box::new(Matrix6::from(*c).transpose())),
                ends: ends.map(Into::into),
                end_covariances: end_covariances.map(|c| c.map(square)),
            },
        }
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl From<&InputsRecord> for InputsSchema {
    fn from(inputs: &InputsRecord) -> Self {
        let o = &inputs.options;
        let lens = |(k, d): &(Intrinsics, Distortion)| LensSchema { intrinsics: k.into(), distortion: d.into() };
        let options = OptionsSchema {
            distortion: o.distortion.clone(),
            fixed_lens: o.fixed_lens.as_ref().map(lens),
            skew_sigma: finite(o.skew_sigma),
            aspect_sigma: finite(o.aspect_sigma),
            max_focal_deviation: finite(o.max_focal_deviation),
            robust: o.robust,
            pixel_sigma: o.pixel_sigma,
            seed: o.seed,
            max_iterations: o.max_iterations,
        };
        Self { options, observations: inputs.observations.iter().map(Into::into).collect() }
    }
}

impl TryFrom<InputsSchema> for InputsRecord {
    type Error = String;

    fn try_from(schema: InputsSchema) -> Result<Self, String> {
        let o = schema.options;
        let lens = |lens: LensSchema| -> Result<_, String> {
            Ok((Intrinsics::from(&lens.intrinsics), Distortion::try_from(&lens.distortion)?))
        };
        let options = OptionsRecord {
            distortion: o.distortion,
            fixed_lens: o.fixed_lens.map(lens).transpose()?,
            skew_sigma: o.skew_sigma.unwrap_or(f64::INFINITY),
            aspect_sigma: o.aspect_sigma.unwrap_or(f64::INFINITY),
            max_focal_deviation: o.max_focal_deviation.unwrap_or(f64::INFINITY),
            robust: o.robust,
            pixel_sigma: o.pixel_sigma,
            seed: o.seed,
            max_iterations: o.max_iterations,
        };
        Ok(Self { options, observations: schema.observations.into_iter().map(Into::into).collect() })
    }
}
