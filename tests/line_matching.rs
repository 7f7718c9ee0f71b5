//! Lines lifted from an image with depths, and matched with the segments of another camera by a first
//! estimate of it: simulated rooms with known answers, and real and rendered RGB-D frames.

#[path = "support/data.rs"]
mod data;
#[path = "support/thesis.rs"]
mod thesis;

use nalgebra::{Matrix2, Matrix4, Matrix6, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::calibrate::{CalibrationOptions, Correspondences, Observation, calibrate_camera};
use ptzcal::detect::lines::{
    LineMatchOptions, LineOptions, LineSegment, detect_line_segments, lift_segments, match_lines,
};
use ptzcal::format::read_depth;
use ptzcal::geometry::{Camera, Distortion, Intrinsics, MeasuredLine, Rigid};
use ptzcal::image::{DepthMap, DepthNoise, ImageView, PixelFormat};
use thesis::{Noise, far};

/// The camera as a first P might have it: focal length, centre and direction slightly off.
fn first(camera: &Camera) -> Camera {
    let k = camera.intrinsics;
    let turn = ptzcal::geometry::rigid::exp(&Vector3::new(0.002, -0.002, 0.001));
    let pose = Rigid::from_centre(turn * camera.pose.rotation, &(camera.centre() + Vector3::new(0.003, -0.002, 0.004)));
    Camera { intrinsics: Intrinsics { fx: k.fx * 1.002, fy: k.fy * 1.002, ..k }, pose, ..*camera }
}

/// Random lines in front of a camera, measured with noise, and their segments, measured with noise.
fn scene(camera: &Camera, n: usize, noise: &mut Noise) -> (Vec<MeasuredLine>, Vec<LineSegment>) {
    let (mut lines, mut segments) = (Vec::new(), Vec::new());
    let (of_line, of_segment) = (0.002, 0.05);
    while lines.len() < n {
        let mut place =
            || Vector3::new(2.4, 1.8, 3.0).map(|s| s * (noise.uniform() - 0.5)) + Vector3::new(0.1, 0.1, 2.8);
        let [a, b] = [place(), place()];
        let seen = [a, b].map(|x| camera.project(&x).filter(|p| camera.contains(p)));
        let [Some(p), Some(q)] = seen else { continue };
        let points = [0.2, 0.8].map(|s| camera.project(&(a + (b - a) * s)));
        let [Some(r), Some(s)] = points else { continue };
        if (p - q).norm() < 60.0 || (r - s).norm() < 20.0 {
            continue;
        }
        let direction = (b - a).normalize();
        let mut off = |sigma: f64| Vector3::from_fn(|_, _| sigma * noise.gaussian());
        let point = (a + b) * 0.5 + off(of_line);
        let turned = (direction + off(of_line)).normalize();
        let half = 0.5 * (b - a).norm();
        let covariance = Matrix6::identity() * (of_line * of_line);
        lines.push(MeasuredLine { point, direction: turned, covariance, extent: [-half, half] });
        segments.push(LineSegment {
            ends: [p, q],
            points: [r + noise.pixel(of_segment), s + noise.pixel(of_segment)],
            variance: of_segment * of_segment,
            contrast: 50.0,
            blur: 1.0,
            support: (p - q).norm(),
        });
    }
    (lines, segments)
}

#[test]
fn matches_of_a_simulated_room_are_right_and_give_the_camera() {
    for lens in [Distortion::None, Distortion::BrownConrady([-0.2, 0.05, 0.001, -0.001, 0.0])] {
        let truth = Camera { distortion: lens, ..far() };
        let mut noise = Noise::new(3);
        let (mut found, mut wrong, mut all, mut nees) = (0, 0, 0, 0.0);
        for round in 0..10 {
            let (lines, mut segments) = scene(&truth, 60, &mut noise);
            // A third of the segments show other lines, and the order says nothing.
            let (_, others) = scene(&truth, 20, &mut noise);
            segments.splice(0..20, others);
            segments.reverse();
            let options = LineMatchOptions { camera_sigma: 3.0, ..Default::default() };
            let matches = match_lines(&lines, &first(&truth), &segments, &options).unwrap();
            found += matches.len();
            wrong += matches.iter().filter(|m| m.segment != 59 - m.line || m.line < 20).count();
            all += 40;
            assert!(matches.windows(2).all(|w| w[0].line < w[1].line));
            let mut set = Correspondences::new(truth.width, truth.height).unwrap();
            let observed = matches.iter().map(|m| Observation::from(m.observation(&lines, &segments).unwrap()));
            set.add_all(observed).unwrap();
            let options =
                CalibrationOptions { fixed_lens: Some((truth.intrinsics, truth.distortion)), ..Default::default() };
            let calibration = calibrate_camera(&set, &options).unwrap();
            // The centre's covariance is the last block.
            let off = calibration.camera.centre() - truth.centre();
            let from = calibration.covariance.nrows() - 3;
            let c = calibration.covariance.fixed_view::<3, 3>(from, from).into_owned();
            nees += off.dot(&(c.try_inverse().unwrap() * off)) / 3.0;
            println!("{round}: centre {:.1} mm off, sigma {:.1}", 1e3 * off.norm(), 1e3 * c.trace().sqrt());
            assert!(off.norm() < 0.03, "{lens:?} {round}: {off}");
        }
        println!("{lens:?}: {found} of {all} matched, {wrong} wrong, NEES of the centre {:.2}", nees / 10.0);
        // Thirty squares: their mean is good to 26 %.
        assert!((0.3..2.2).contains(&(nees / 10.0)), "{nees}");
        assert!(found * 2 > all && wrong * 200 <= found, "{found} of {all}, {wrong} wrong");
    }
}

#[test]
fn what_is_uncertain_is_not_matched() {
    let camera = far();
    let mut noise = Noise::new(8);
    let (lines, segments) = scene(&camera, 1, &mut noise);
    let options = LineMatchOptions::default();
    let count = |lines: &[MeasuredLine], segments: &[LineSegment]| {
        match_lines(lines, &camera, segments, &options).unwrap().len()
    };
    assert_eq!(count(&lines, &segments), 1);
    assert_eq!(count(&[], &segments) + count(&lines, &[]), 0);
    // A parallel neighbour three pixels away is as likely; one 30 pixels away is not.
    let shifted = |by: f64| {
        let s = segments[0];
        let move_it = |p: Vector2<f64>| p + s.normal() * by;
        LineSegment { ends: s.ends.map(move_it), points: s.points.map(move_it), ..s }
    };
    assert_eq!(count(&lines, &[segments[0], shifted(3.0)]), 0);
    assert_eq!(count(&lines, &[segments[0], shifted(30.0)]), 1);
    assert_eq!(count(&lines, &[shifted(30.0)]), 0);
    // Of two pieces of one line the longer.
    let s = segments[0];
    let piece = |from: f64, to: f64| {
        let at = |t: f64| s.ends[0] + (s.ends[1] - s.ends[0]) * t;
        let points = [at(from + 0.2 * (to - from)), at(from + 0.8 * (to - from))];
        LineSegment { ends: [at(from), at(to)], points, support: s.support * (to - from), ..s }
    };
    let pieces = [piece(0.0, 0.4), piece(0.45, 1.0)];
    let matches = match_lines(&lines, &camera, &pieces, &options).unwrap();
    assert_eq!(matches.iter().map(|m| m.segment).collect::<Vec<_>>(), [1]);
    // The other way round, bright and dark have changed sides.
    let turned = LineSegment { ends: [s.ends[1], s.ends[0]], points: [s.points[1], s.points[0]], ..s };
    assert_eq!(count(&lines, &[turned]), 0);
    let either = LineMatchOptions { same_polarity: false, ..options };
    assert_eq!(match_lines(&lines, &camera, &[turned], &either).unwrap().len(), 1);
    // Behind the camera.
    let mut behind = lines[0];
    behind.point = camera.centre() - (behind.point - camera.centre());
    assert_eq!(count(&[behind], &segments), 0);
}

#[test]
fn what_is_no_input_for_matching_is_refused() {
    let camera = far();
    let (lines, segments) = scene(&camera, 3, &mut Noise::new(8));
    let good = LineMatchOptions::default();
    for bad in [
        LineMatchOptions { camera_sigma: 0.0, ..good },
        LineMatchOptions { camera_sigma: f64::NAN, ..good },
        LineMatchOptions { max_distance: -1.0, ..good },
        LineMatchOptions { min_lead: f64::INFINITY, ..good },
        LineMatchOptions { min_overlap: 1.1, ..good },
    ] {
        assert!(matches!(match_lines(&lines, &camera, &segments, &bad), Err(Error::InvalidArgument { .. })), "{bad:?}");
    }
    let mut broken = lines.clone();
    broken[2].extent[1] = f64::NAN;
    assert_eq!(match_lines(&broken, &camera, &segments, &good).unwrap_err().index(), Some(2));
    let mut broken = segments.clone();
    broken[1].points[0].x = f64::INFINITY;
    assert_eq!(match_lines(&lines, &camera, &broken, &good).unwrap_err().index(), Some(1));
    broken[1].points[0] = broken[1].points[1];
    assert!(matches!(match_lines(&lines, &camera, &broken, &good), Err(Error::InvalidArgument { .. })));
    let flat = Camera { width: 0, ..camera };
    assert!(match_lines(&lines, &flat, &segments, &good).is_err());
}

/// A camera at the world's origin.
fn depth_camera() -> Camera {
    Camera {
        width: 320,
        height: 240,
        intrinsics: Intrinsics::new(260.0, 159.5, 119.5),
        distortion: Distortion::None,
        pose: Rigid::identity(),
    }
}

/// Inverse depth n . (x, y, 1) of planes n . X = 1.
fn map(noise: &mut Noise, sigma: f64, plane: impl Fn(f64, f64) -> Vector3<f64>) -> DepthMap {
    let camera = depth_camera();
    let depth = |i: usize| {
        let (u, v) = ((i % 320) as f64, (i / 320) as f64);
        let m = camera.intrinsics.to_normalised(&Vector2::new(u, v));
        (1.0 / (plane(u, v).dot(&m.push(1.0)) + sigma * noise.gaussian())) as f32
    };
    DepthMap::new(320, 240, (0..320 * 240).map(depth).collect()).unwrap()
}

fn segment(a: [f64; 2], b: [f64; 2]) -> LineSegment {
    let [a, b] = [Vector2::from(a), Vector2::from(b)];
    let points = [a + (b - a) * 0.2, a + (b - a) * 0.8];
    LineSegment { ends: [a, b], points, variance: 4e-4, contrast: 60.0, blur: 1.0, support: (b - a).norm() }
}

#[test]
fn lines_lie_on_the_surface_in_front() {
    let camera = depth_camera();
    let noise = DepthNoise { inverse_depth: 1.5e-3, depth: 0.0 };
    let (wall, slanted) = (Vector3::new(0.02, -0.01, 0.3), Vector3::new(0.1, 0.05, 0.5));
    let line = segment([160.3, 30.0], [150.6, 200.0]);
    let right_of = |u: f64, v: f64| (u - 160.3) + (v - 30.0) * (9.7 / 170.0) > 0.0;
    let mut random = Noise::new(4);
    let (mut sum, mut runs) = (0.0, 0.0);
    for _ in 0..60 {
        // A thing in front of a wall; a mark on the thing; a roof edge, where two planes meet.
        let roof = {
            // Through the same image line at the same inverse depths: slanted plus a multiple of the line.
            let [a, b] = line.ends.map(|p| camera.intrinsics.to_normalised(&p).push(1.0));
            slanted + a.cross(&b).normalize() * 0.2
        };
        let maps = [
            map(&mut random, noise.inverse_depth, |u, v| if right_of(u, v) { slanted } else { wall }),
            map(&mut random, noise.inverse_depth, |u, v| if right_of(u, v) { wall } else { slanted }),
            map(&mut random, noise.inverse_depth, |_, _| slanted),
            map(&mut random, noise.inverse_depth, |u, v| if right_of(u, v) { slanted } else { roof }),
        ];
        for (i, depth) in maps.iter().enumerate() {
            let lifted =
                lift_segments(&[line], &camera, depth, &noise).unwrap()[0].unwrap_or_else(|| panic!("map {i}"));
            for x in lifted.ends() {
                // On the plane in front, n . X = 1.
                let off = slanted.dot(&x) - 1.0;
                assert!(off.abs() < 0.01, "map {i}: {off}");
                assert!(
                    (camera.project(&x).unwrap() - line.ends[0]).norm() < 0.05
                        || (camera.project(&x).unwrap() - line.ends[1]).norm() < 0.05
                );
            }
            let c = lifted.covariance.fixed_view::<3, 3>(0, 0).into_owned();
            let off = slanted.dot(&lifted.point) - 1.0;
            sum += off * off / (slanted.transpose() * c * slanted)[0];
            runs += 1.0;
            // The segment's direction, and the bright side on its right.
            assert!(lifted.direction.y > 0.9 && lifted.extent[0] < 0.0 && lifted.extent[1] > 0.0);
        }
    }
    // Here the depths' errors are independent; they are taken to be alike within 5 x 5 pixels, as those of
    // depth cameras are, so that what is stated is larger by up to 25.
    let nees: f64 = sum / runs;
    println!("NEES {nees}");
    assert!(nees < 1.0 && nees > 0.02, "{nees}");
}

#[test]
fn lines_without_certain_depth_are_left_out() {
    let camera = depth_camera();
    let noise = DepthNoise { inverse_depth: 1.5e-3, depth: 0.0 };
    let line = segment([160.3, 30.0], [160.3, 200.0]);
    let mut random = Noise::new(4);
    let plane = Vector3::new(0.0, 0.0, 0.4);
    let lifted = |depth: &DepthMap| lift_segments(&[line], &camera, depth, &noise).unwrap()[0];
    assert!(lifted(&map(&mut random, 1e-3, |_, _| plane)).is_some());
    // No depth on the right: NaN, as some cameras say it. What is there may be in front.
    let holes = map(&mut random, 1e-3, |u, _| if u > 160.0 { plane * f64::NAN } else { plane });
    assert!(lifted(&holes).is_none());
    assert!(lifted(&DepthMap::new(320, 240, vec![0.0; 320 * 240]).unwrap()).is_none());
    // In front above, behind below: two surfaces that cross on the image line.
    let crossing = map(&mut random, 1e-3, |u, _| if u > 160.0 { Vector3::new(0.0, 0.3, 0.4) } else { plane });
    assert!(lifted(&crossing).is_none());
    // Depths that are no plane at all.
    let rough = map(&mut random, 0.05, |_, _| plane);
    assert!(lifted(&rough).is_none());
    let flat = map(&mut random, 1e-3, |_, _| plane);
    let bad = DepthNoise { inverse_depth: 0.0, depth: 0.0 };
    assert!(lift_segments(&[line], &camera, &flat, &bad).is_err());
    let small = DepthMap::new(319, 240, vec![1.0; 319 * 240]).unwrap();
    assert!(matches!(lift_segments(&[line], &camera, &small, &noise), Err(Error::InvalidArgument { .. })));
    let nan = LineSegment { variance: f64::NAN, ..line };
    assert!(matches!(lift_segments(&[nan], &camera, &flat, &noise), Err(Error::NotFinite { index: 0, .. })));
    // At the border there is nothing on one side.
    let border = segment([0.4, 30.0], [0.4, 200.0]);
    assert!(lift_segments(&[border], &camera, &flat, &noise).unwrap()[0].is_none());
}

/// Segments, depths and camera of a frame of `rgbd_redwood_open3d`: rendered rooms with a depth camera's
/// noise, and exact poses.
fn redwood(folder: &std::path::Path, i: usize) -> (Vec<LineSegment>, DepthMap, Camera) {
    let numbers = data::numbers(&folder.join("trajectory.log")).unwrap();
    let rows: Vec<f64> = numbers[5 * i + 1..5 * i + 5].iter().flatten().copied().collect();
    let m = Matrix4::from_row_slice(&rows);
    let to_world =
        Rigid { rotation: m.fixed_view::<3, 3>(0, 0).into(), translation: m.fixed_view::<3, 1>(0, 3).into() };
    let camera = Camera {
        width: 640,
        height: 480,
        intrinsics: Intrinsics::new(525.0, 319.5, 239.5),
        distortion: Distortion::None,
        pose: to_world.inverse(),
    };
    let colour = image::open(folder.join(format!("color{i}.jpg"))).unwrap().to_luma8();
    let view = ImageView::new(PixelFormat::Gray8, 640, 480, &[(colour.as_raw(), 640)]).unwrap();
    let segments = detect_line_segments(&view, &LineOptions::default()).unwrap();
    (segments, read_depth(&folder.join(format!("depth{i}.png")), 1e-3).unwrap(), camera)
}

#[test]
fn lines_of_a_rendered_room_are_found_again_from_elsewhere() {
    let Some(folder) = data::folder("rgbd_redwood_open3d") else { return };
    let frames: Vec<_> = (0..5).map(|i| redwood(&folder, i)).collect();
    for [from, to] in [[0, 4], [4, 0], [1, 3]] {
        let (segments, depth, camera) = &frames[from];
        let (there, _, truth) = &frames[to];
        let lines: Vec<_> = lift_segments(segments, camera, depth, &DepthNoise::default()).unwrap();
        let lines: Vec<_> = lines.into_iter().flatten().collect();
        assert!(lines.len() * 2 > segments.len(), "{} of {}", lines.len(), segments.len());
        // By a camera that is off by some pixels, as a first P is; judged by the true one.
        let options = LineMatchOptions { camera_sigma: 3.0, ..Default::default() };
        let matches = match_lines(&lines, &first(truth), there, &options).unwrap();
        let judge = LineMatchOptions { camera_sigma: 1e-3, max_distance: 1e3, min_lead: 0.0, ..options };
        let mut residuals: Vec<f64> = Vec::new();
        for m in &matches {
            let alone = match_lines(&lines[m.line..=m.line], truth, &there[m.segment..=m.segment], &judge).unwrap();
            residuals.extend(alone.iter().flat_map(|m| m.residual.iter().map(|r| r.abs()).collect::<Vec<_>>()));
        }
        residuals.sort_by(f64::total_cmp);
        let wrong = residuals.iter().filter(|r| **r > 2.0).count();
        let median = residuals[residuals.len() / 2];
        println!(
            "{from} -> {to}: {} lines, {} matches, median {median:.3} px, {wrong} beyond 2 px",
            lines.len(),
            matches.len()
        );
        assert!(matches.len() >= 40, "{}", matches.len());
        assert!(median < 0.4, "{median}");
        // Outlines of round things (there is a lamp, and a sofa) are other lines from elsewhere.
        assert!(wrong * 10 <= residuals.len(), "{wrong} of {}", residuals.len());
        // The camera's pose from these lines alone.
        let mut set = Correspondences::new(640, 480).unwrap();
        let observed = matches.iter().map(|m| Observation::from(m.observation(&lines, there).unwrap()));
        set.add_all(observed).unwrap();
        let calibration = calibrate_camera(
            &set,
            &CalibrationOptions { fixed_lens: Some((truth.intrinsics, truth.distortion)), ..Default::default() },
        )
        .unwrap();
        let off = (calibration.camera.centre() - truth.centre()).norm();
        println!("centre {:.1} mm off", 1e3 * off);
        assert!(off < 0.02, "{off}");
    }
}

#[test]
fn real_frames_have_lines_and_most_can_be_lifted() {
    let Some(folder) = data::folder("rgbd_nyu") else { return };
    for i in [3, 4, 5] {
        let colour = image::open(folder.join(format!("color{i}.png"))).unwrap().to_luma8();
        let (w, h) = colour.dimensions();
        let view = ImageView::new(PixelFormat::Gray8, w, h, &[(colour.as_raw(), w as isize)]).unwrap();
        let segments = detect_line_segments(&view, &LineOptions::default()).unwrap();
        let intrinsics = Intrinsics { fx: 518.0, fy: 519.0, skew: 0.0, cx: 325.5, cy: 253.5 };
        let camera = Camera { width: w, height: h, intrinsics, distortion: Distortion::None, pose: Rigid::identity() };
        let depth = read_depth(&folder.join(format!("depth{i}.pgm")), 1e-3).unwrap();
        let lines = lift_segments(&segments, &camera, &depth, &DepthNoise::default()).unwrap();
        let lifted: Vec<_> = segments.iter().zip(&lines).filter_map(|(s, l)| Some((s, (*l)?))).collect();
        println!("{i}: {} segments, {} lifted", segments.len(), lifted.len());
        assert!(segments.len() > 60 && lifted.len() * 3 > segments.len());
        for (s, l) in &lifted {
            // A line is seen where it came from, and indoors.
            let seen = l.ends().map(|x| camera.project(&x).unwrap());
            assert!((seen[0] - s.ends[0]).norm() < 1.5 && (seen[1] - s.ends[1]).norm() < 1.5);
            assert!(l.ends().iter().all(|x| x.z > 0.3 && x.z < 12.0));
            let c =
                Matrix2::new(l.covariance[(0, 0)], l.covariance[(0, 2)], l.covariance[(2, 0)], l.covariance[(2, 2)]);
            assert!(c.trace().sqrt() < 0.5 * l.point.z, "{c}");
        }
    }
}
