//! The true rig and what its user knows of it; where the stations and the fixed cameras are.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::distortion::Distortion;
use crate::geometry::rig_model::{AxisOffsets, Encoders, LaserLine};
use crate::geometry::rigid::{Rigid, nearest_rotation};
use crate::geometry::{Camera, Intrinsics, RigModel};

/// The head camera, laser and axes as they are.
pub fn true_rig() -> RigModel {
    RigModel {
        width: 720,
        height: 576,
        intrinsics: Intrinsics::new(800.0, 360.0, 288.0),
        distortion: Distortion::BrownConrady([-0.06, 0.015, 3e-4, -2e-4, 0.0]),
        laser: LaserLine { x0: 0.100, y0: 0.005, vx: -0.005, vy: 0.003 },
        offsets: AxisOffsets { tilt_y: 0.008, tilt_z: 0.025, pan_x: 0.003, pan_z: 0.020 },
        encoders: Encoders {
            pan_zero: 0.3f64.to_radians(),
            pan_scale: 1.0004,
            tilt_zero: -0.25f64.to_radians(),
            tilt_scale: 0.9996,
        },
    }
}

/// What a calibration of the rig would have found: the truth less a misalignment. At `amount` 1 the
/// points of a scan are off by 1.5 to 2 mm rms (a test below measures it), and cameras calibrated
/// from them, were nothing else wrong, by 0.1 mm (NEAR) and 0.7 mm (FAR) in their centres.
pub fn nominal_rig(amount: f64) -> RigModel {
    let mut rig = true_rig();
    rig.laser.x0 += 5e-5 * amount;
    rig.laser.y0 -= 5e-5 * amount;
    rig.laser.vx -= 2e-5 * amount;
    rig.laser.vy -= 2e-5 * amount;
    rig.offsets.tilt_y += 2e-4 * amount;
    rig.offsets.tilt_z -= 2e-4 * amount;
    rig.offsets.pan_x -= 2e-4 * amount;
    rig.offsets.pan_z += 2e-4 * amount;
    rig.encoders.tilt_zero += 0.01f64.to_radians() * amount;
    rig
}

/// From the room's frame (station 1) to the rig frame of a station. Station 2 is the thesis's second
/// view point: eq. (24), X_1 = R X_2 + t, its rotation made orthonormal again.
pub fn station(number: u32) -> Rigid {
    if number != 2 {
        return Rigid::identity();
    }
    let printed = Matrix3::new(0.7958, -0.0079, 0.6056, 0.0295, 0.9992, -0.0257, -0.6049, 0.0383, 0.7954);
    let rotation = nearest_rotation(&printed).expect("the printed matrix is finite");
    Rigid { rotation, translation: Vector3::new(-0.94237, -0.06594, 0.32666) }.inverse()
}

/// Fixed cameras in the room's frame: 0 is NEAR, the thesis's (26) and (30), 16 cm beside the rig; 1 is FAR,
/// the same sensor under the ceiling, 2 m to the left.
pub fn fixed_camera(index: usize) -> Camera {
    let (distortion, pose) = if index == 0 {
        // Row 2 is printed with norm 0.9991; the rotation nearest to it is taken.
        let printed = Matrix3::new(0.9997, 0.0127, 0.0210, -0.0128, 0.9990, 0.0064, -0.0210, -0.0066, 0.9998);
        let rotation = nearest_rotation(&printed).expect("the printed matrix is finite");
        let translation = Vector3::new(0.15680, -0.04997, -0.01664);
        (Distortion::BrownConrady([-0.12, 0.03, 0.0, 0.0, 0.0]), Rigid { rotation, translation })
    } else {
        let pose = Rigid::look_at(&Vector3::new(-1.6, -0.9, 0.6), &Vector3::new(0.15, 0.15, 2.9))
            .expect("the target is in front of the camera");
        (Distortion::BrownConrady([-0.08, 0.02, 5e-4, -3e-4, 0.0]), pose)
    };
    let intrinsics = Intrinsics { fx: 845.19, fy: 844.56, skew: 0.0, cx: 427.76, cy: 285.53 };
    Camera { width: 800, height: 600, intrinsics, distortion, pose }
}

#[cfg(test)]
mod tests {
    use super::super::scene;
    use super::*;
    use nalgebra::Matrix2;

    #[test]
    fn everything_stands_where_the_thesis_says_and_in_free_space() {
        let near = fixed_camera(0).centre();
        assert!((near - Vector3::new(-0.15774, 0.04787, 0.01366)).norm() < 2e-5, "{near}");
        let there = station(2).inverse().apply(&Vector3::zeros());
        assert!((there - Vector3::new(-0.94237, -0.06594, 0.32666)).norm() < 1e-12);
        // Maths section 12, T3: 37.33 degrees.
        let turn = crate::geometry::rigid::log(&station(2).rotation).norm().to_degrees();
        assert!((turn - 37.33).abs() < 0.01, "{turn}");
        for place in [Vector3::zeros(), there, near, fixed_camera(1).centre()] {
            let clear = |s: &scene::Solid| (0..3).any(|i| place[i] < s.low[i] - 0.1 || place[i] > s.high[i] + 0.1);
            assert!(scene::BOXES.iter().all(clear));
            assert!((0..3).all(|i| place[i] > scene::ROOM.low[i] + 0.1 && place[i] < scene::ROOM.high[i] - 0.1));
        }
        for camera in [fixed_camera(0), fixed_camera(1), true_rig().head_camera(0.0, 0.0)] {
            camera.validate().unwrap();
            camera.check_lens().unwrap();
        }
        true_rig().validate().unwrap();
    }

    #[test]
    fn the_misalignment_moves_points_by_millimetres() {
        let (truth, nominal) = (true_rig(), nominal_rig(1.0));
        assert_eq!(nominal_rig(0.0), truth);
        let (mut sum, mut worst, mut count) = (0.0, 0.0f64, 0);
        for i in 0..30 {
            for j in 0..20 {
                let (pan, tilt) =
                    ((-29.0 + 54.0 * i as f64 / 29.0f64).to_radians(), (-21.0 + 2.0 * j as f64).to_radians());
                let (origin, direction) = truth.laser_in_world(pan, tilt);
                let depth = scene::cast(&origin, &direction, scene::ALL_BOXES).distance;
                let spot = truth.spot_pixel(1.0 / depth).unwrap();
                let measured = nominal.measure(pan, tilt, &spot, &Matrix2::identity()).unwrap().point.point().unwrap();
                let error = (measured - (origin + direction * depth)).norm();
                sum += error * error;
                worst = worst.max(error);
                count += 1;
            }
        }
        let rms = (sum / f64::from(count)).sqrt();
        println!("misalignment: points off by {:.2} mm rms, {:.2} mm at most", rms * 1e3, worst * 1e3);
        assert!(rms > 0.5e-3 && rms < 2e-3 && worst < 5e-3, "{rms} {worst}");
    }
}
