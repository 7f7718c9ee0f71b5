//! Calibrations and what they were made from, as camera files hold them.

use super::{Calibration, CalibrationOptions, Correspondences, DistortionModel, Observation, ObservedLine};
use crate::error::{Error, Result};
use crate::format::{CalibrationRecord, CameraRecord, InputsRecord, ObservationRecord, OptionsRecord};

const MODELS: [(DistortionModel, &str); 6] = [
    (DistortionModel::None, "none"),
    (DistortionModel::Radial1, "radial1"),
    (DistortionModel::Radial2, "radial2"),
    (DistortionModel::BrownConrady, "brown_conrady"),
    (DistortionModel::Division, "division"),
    (DistortionModel::Fisheye, "fisheye"),
];

impl Calibration {
    /// All of it, as a camera file holds it; with `inputs` the file can be solved again.
    pub fn record(&self, inputs: Option<InputsRecord>) -> CameraRecord {
        let calibration = CalibrationRecord {
            covariance: self.covariance.clone(),
            residuals: self.residuals.clone(),
            inliers: self.inliers.clone(),
            rms: self.rms,
            noise_factor: self.noise_factor,
            condition: self.condition,
            iterations: self.iterations,
            inputs,
        };
        CameraRecord { camera: self.camera, calibration: Some(calibration) }
    }
}

/// What a calibration is made from, as a file holds it.
pub fn inputs_record(set: &Correspondences, options: &CalibrationOptions) -> InputsRecord {
    let CalibrationOptions {
        distortion,
        fixed_lens,
        skew_sigma,
        aspect_sigma,
        robust,
        pixel_sigma,
        max_focal_deviation,
        seed,
        max_iterations,
        cancel: _,
    } = options.clone();
    let name = MODELS.iter().find(|(model, _)| *model == distortion).map_or("none", |(_, name)| name);
    let options = OptionsRecord {
        distortion: name.into(),
        fixed_lens,
        skew_sigma,
        aspect_sigma,
        robust,
        pixel_sigma,
        max_focal_deviation,
        seed,
        max_iterations,
    };
    InputsRecord { options, observations: set.observations().iter().map(Into::into).collect() }
}

/// The measurements and the options of a file. [`calibrate_camera`](super::calibrate_camera) makes the same
/// calibration of them, to the last bit, with the same version of the library on the same kind of machine.
///
/// # Errors
/// `NotFound` for a file without; `InvalidArgument` and `NotFinite` for what no set takes.
pub fn inputs_of(record: &CameraRecord) -> Result<(Correspondences, CalibrationOptions)> {
    let none = || Error::NotFound { reason: "the file holds a camera without what it was calibrated from".into() };
    let inputs = record.calibration.as_ref().and_then(|c| c.inputs.as_ref()).ok_or_else(none)?;
    let mut set = Correspondences::new(record.camera.width, record.camera.height)?;
    set.add_all(inputs.observations.iter().cloned().map(Observation::from))?;
    let o = &inputs.options;
    let model = MODELS.iter().find(|(_, name)| *name == o.distortion);
    let options = CalibrationOptions {
        distortion: model
            .ok_or_else(|| Error::invalid("distortion", format!("'{}' is no lens model", o.distortion)))?
            .0,
        fixed_lens: o.fixed_lens,
        skew_sigma: o.skew_sigma,
        aspect_sigma: o.aspect_sigma,
        robust: o.robust,
        pixel_sigma: o.pixel_sigma,
        max_focal_deviation: o.max_focal_deviation,
        seed: o.seed,
        max_iterations: o.max_iterations,
        ..CalibrationOptions::default()
    };
    options.validate()?;
    Ok((set, options))
}

impl From<&Observation> for ObservationRecord {
    fn from(observation: &Observation) -> Self {
        match observation.clone() {
            Observation::Point { world, world_covariance, pixel, pixel_covariance } => {
                Self::Point { world, world_covariance, pixel, pixel_covariance }
            }
            Observation::Shot { shot, pixel, pixel_covariance } => Self::Shot { shot, pixel, pixel_covariance },
            Observation::Line(line) => {
                let ObservedLine { point, direction, covariance, ends, end_covariances } = *line;
                Self::Line { point, direction, covariance: covariance.map(Box::new), ends, end_covariances }
            }
        }
    }
}

impl From<ObservationRecord> for Observation {
    fn from(record: ObservationRecord) -> Self {
        match record {
            ObservationRecord::Point { world, world_covariance, pixel, pixel_covariance } => {
                Self::Point { world, world_covariance, pixel, pixel_covariance }
            }
            ObservationRecord::Shot { shot, pixel, pixel_covariance } => Self::Shot { shot, pixel, pixel_covariance },
            ObservationRecord::Line { point, direction, covariance, ends, end_covariances } => {
                ObservedLine { point, direction, covariance: covariance.map(|c| *c), ends, end_covariances }.into()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, Matrix2, Matrix3, Vector2, Vector3};

    use super::*;
    use crate::calibrate::calibrate_camera;
    use crate::error::Status;
    use crate::format::{model_json, read_camera, write_camera};
    use crate::geometry::rigid::exp;
    use crate::geometry::{Camera, Distortion, Intrinsics, InverseDepthPoint, Rigid};

    /// Points with and without covariances, shots and lines, none of them of round numbers.
    fn mixed() -> (Correspondences, Camera) {
        let camera = Camera {
            width: 800,
            height: 600,
            intrinsics: Intrinsics { fx: 845.19, fy: 844.56, skew: 0.0, cx: 427.76, cy: 285.53 },
            distortion: Distortion::None,
            pose: Rigid { rotation: exp(&Vector3::new(0.05, -0.2, 0.1)), translation: Vector3::new(0.1, -0.05, 0.3) },
        };
        let mut set = Correspondences::new(800, 600).unwrap();
        // Some disorder of a fraction of a pixel.
        let noise = |i: usize, k: f64| 0.3 * (k * (i * i + 3 * i + 1) as f64).sin();
        for i in 0..60 {
            let (a, b, c) = ((i % 5) as f64, (i / 5 % 4) as f64, (i % 7) as f64);
            let world = Vector3::new(-0.8 + 0.37 * a, -0.6 + 0.31 * b, 2.0 + 0.41 * c);
            let pixel = camera.project(&world).unwrap() + Vector2::new(noise(i, 1.7), noise(i, 2.3));
            let pixel_covariance = Matrix2::new(0.1, 0.01, 0.01, 0.1 + 0.2);
            let observation = match i % 4 {
                0 => Observation::Point { world, world_covariance: None, pixel, pixel_covariance: None },
                1 => Observation::Point {
                    world,
                    world_covariance: Some(Matrix3::identity() * (1e-6 / 3.0)),
                    pixel,
                    pixel_covariance: Some(pixel_covariance),
                },
                2 => {
                    let origin = Vector3::new(0.01, 0.02, 0.0);
                    let direction = (world - origin) / world.z;
                    let shot = InverseDepthPoint { origin, direction, rho: 1.0 / world.z, variance: 1e-8 / 3.0 };
                    Observation::Shot { shot, pixel, pixel_covariance }
                }
                _ => {
                    let other = world + Vector3::new(0.3, 0.1 * a, 0.2);
                    let ends = [pixel, camera.project(&other).unwrap()];
                    let covariances = [Matrix3::identity() * 1e-6, Matrix3::identity() * (1e-6 / 7.0)];
                    let line = ObservedLine::through([world, other], (i % 8 == 3).then_some(covariances), ends);
                    ObservedLine { end_covariances: Some([pixel_covariance; 2]), ..line }.into()
                }
            };
            set.add(observation).unwrap();
        }
        (set, camera)
    }

    /// The matrix's bits: 0 and -0 differ too.
    fn bits(m: &DMatrix<f64>) -> Vec<u64> {
        m.iter().map(|v| v.to_bits()).collect()
    }

    #[test]
    fn a_calibration_is_solved_again_from_its_file_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.json");
        let (set, camera) = mixed();
        let lens = Some((camera.intrinsics, camera.distortion));
        let free = f64::INFINITY;
        for options in [
            CalibrationOptions::default(),
            CalibrationOptions { pixel_sigma: Some(0.1 + 0.2), seed: u64::MAX, skew_sigma: 0.0, ..Default::default() },
            CalibrationOptions { aspect_sigma: free, max_focal_deviation: free, robust: false, ..Default::default() },
            CalibrationOptions { distortion: DistortionModel::Radial1, max_iterations: 77, ..Default::default() },
            CalibrationOptions { fixed_lens: lens, ..Default::default() },
        ] {
            let first = calibrate_camera(&set, &options).unwrap();
            let inputs = inputs_record(&set, &options);
            write_camera(&path, &first.record(Some(inputs.clone()))).unwrap();
            let (read_set, read_options) = inputs_of(&read_camera(&path).unwrap()).unwrap();
            assert_eq!(read_set, set);
            assert_eq!(inputs_record(&read_set, &read_options), inputs);
            let second = calibrate_camera(&read_set, &read_options).unwrap();
            assert_eq!(second.record(None), first.record(None));
            assert_eq!(bits(&second.covariance), bits(&first.covariance));
        }
    }

    #[test]
    fn inputs_that_are_none_are_refused() {
        let (set, _) = mixed();
        let options = CalibrationOptions::default();
        let first = calibrate_camera(&set, &options).unwrap();
        let alone = inputs_of(&first.record(None)).unwrap_err();
        assert_eq!(alone.status(), Status::NotFound, "{alone}");
        let text = model_json::to_json(&first.record(Some(inputs_record(&set, &options)))).unwrap();
        let read = |from: &str, to: &str| {
            assert!(text.contains(from), "{from} is not there");
            model_json::from_json(text.replacen(from, to, 1).as_bytes(), "file").and_then(|r| inputs_of(&r).map(|_| ()))
        };
        for (from, to, word) in [
            ("\"skew_sigma\": 0.001", "\"skew_sigma\": -1", "skew_sigma"),
            ("\"max_iterations\": 100", "\"max_iterations\": 0", "max_iterations"),
            ("\"distortion\": \"none\"", "\"distortion\": \"spherical\"", "spherical"),
            ("\"seed\": 1", "\"seed\": -1", "line"),
            ("\"point\": {", "\"pint\": {", "pint"),
            ("\"inverse_depth\"", "\"depth\"", "depth"),
            ("\"variance\": ", "\"variance\": -", "positive"),
            ("\"xyz\": [", "\"xyz\": [1.0, ", "line"),
            ("\"xyz\": [", "\"xyz\": [1e300, ", "line"),
        ] {
            let e = read(from, to).unwrap_err();
            assert!(e.to_string().contains(word), "{to}: {e}");
        }
        // One measurement fewer than residuals.
        let mut record = first.record(Some(inputs_record(&set, &options)));
        record.calibration.as_mut().unwrap().inputs.as_mut().unwrap().observations.pop();
        assert_eq!(model_json::to_json(&record).unwrap_err().status(), Status::InvalidArgument);
    }

    #[test]
    fn fuzz_calibration_files() {
        use crate::fuzz::{Random, fuzz_inputs, mutated};
        let (set, _) = mixed();
        let options = CalibrationOptions::default();
        let first = calibrate_camera(&set, &options).unwrap();
        let text = model_json::to_json(&first.record(Some(inputs_record(&set, &options)))).unwrap();
        let mut random = Random(3);
        let (mut read, mut refused) = (0, 0u64);
        // A file takes some hundred times as long as a packet.
        for _ in 0..fuzz_inputs() / 50 {
            match model_json::from_json(&mutated(text.as_bytes(), &mut random), "file") {
                Ok(record) => {
                    read += 1;
                    assert!(record.camera.validate().is_ok());
                    let c = record.calibration.as_ref().unwrap();
                    assert!(c.covariance.iter().chain(c.residuals.iter().flatten()).all(|v| v.is_finite()));
                    // A changed number may be one that no set takes: that is an error too, never a panic.
                    let _ = inputs_of(&record);
                }
                Err(e) => {
                    refused += 1;
                    assert!(matches!(e.status(), Status::FileFormat | Status::FileVersion), "{e}");
                }
            }
        }
        assert!(read > fuzz_inputs() / 5000 && refused > fuzz_inputs() / 200, "{read} {refused}");
    }
}
