//! What a scan writes down of itself, for those who go on with it.

use super::super::acquire::FixedCamera;
use super::super::journal::{Fingerprint, Identity};
use super::super::region::ScanRegion;
use super::super::{Rig, RigModel};
use super::ScanOptions;
use crate::format::recording_json::{RecordedRegion, RecordingInfo};

/// What a journal has to agree in: all that decides what a shot is.
pub(super) fn identity(
    region: &ScanRegion,
    model: &RigModel,
    options: &ScanOptions,
    fixed: &[FixedCamera],
) -> Identity {
    let ScanRegion { pan, tilt, pan_steps, tilt_steps } = region;
    let (l, o, e) = (&model.laser, &model.offsets, &model.encoders);
    let (gate, spot) = (&options.gate, &options.spot);
    let mut settings = Fingerprint::new()
        .integers(&[options.frames_per_state, options.coarse_shots, spot.colour as u32, spot.max_area].map(u64::from))
        .numbers(&[spot.min_signal_to_noise, spot.ambiguity_ratio])
        .numbers(&gate.depth_range)
        .numbers(&[gate.half_width, gate.model_sigma, gate.sigmas]);
    for camera in fixed {
        settings = settings.integers(&[camera.width, camera.height, camera.distortion as u32].map(u64::from));
        settings = settings.integers(&[u64::from(camera.known.is_some())]);
        if let Some(known) = &camera.known {
            settings = settings
                .numbers(&known.intrinsics.to_array())
                .numbers(known.distortion.coefficients())
                .numbers(known.pose.rotation.as_slice())
                .numbers(known.pose.translation.as_slice());
        }
    }
    Identity {
        fixed_cameras: fixed.len() as u32,
        region: Fingerprint::new()
            .numbers(pan)
            .numbers(tilt)
            .integers(&[*pan_steps, *tilt_steps].map(u64::from))
            .finish(),
        model: Fingerprint::new()
            .integers(&[model.width, model.height].map(u64::from))
            .numbers(&model.intrinsics.to_array())
            .numbers(model.distortion.coefficients())
            .numbers(&[l.x0, l.y0, l.vx, l.vy])
            .numbers(&[o.tilt_y, o.tilt_z, o.pan_x, o.pan_z])
            .numbers(&[e.pan_zero, e.pan_scale, e.tilt_zero, e.tilt_scale])
            .finish(),
        options: settings.finish(),
    }
}

/// What a recording of the scan holds.
pub(super) fn recording_info(region: &ScanRegion, rig: &Rig, fixed: &[FixedCamera]) -> RecordingInfo {
    let ScanRegion { pan, tilt, pan_steps, tilt_steps } = *region;
    let head = (rig.model.width, rig.model.height);
    RecordingInfo {
        rig: rig.model,
        pan_range: rig.capabilities.pan_range,
        tilt_range: rig.capabilities.tilt_range,
        pan_step: rig.capabilities.pan_step,
        tilt_step: rig.capabilities.tilt_step,
        region: RecordedRegion { pan, tilt, pan_steps, tilt_steps },
        cameras: std::iter::once(head).chain(fixed.iter().map(|c| (c.width, c.height))).collect(),
    }
}
