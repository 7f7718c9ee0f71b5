//! SIFT on real photographs of ../shared/data (or $PTZCAL_DATA) with depth and poses; skipped when they
//! are absent. What OpenCV 5.0 finds was had with SIFT_create().detectAndCompute on
//! imread(..., IMREAD_GRAYSCALE), matched and judged in the same way: mutual nearest neighbours, ratio 0.8.

#[path = "support/data.rs"]
mod data;

use std::path::Path;

use data::{folder, numbers, picture};
use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector4};
use ptzcal::detect::sift::{SiftFeatures, SiftMatchOptions, SiftOptions, detect_sift, match_sift};

struct Frame {
    features: SiftFeatures,
    /// Millimetres, 0 where unknown.
    depth: image::ImageBuffer<image::Luma<u16>, Vec<u16>>,
    camera_to_world: Matrix4<f64>,
}

impl Frame {
    fn load(colour: &Path, depth: &Path, camera_to_world: Matrix4<f64>) -> Self {
        let open = |path: &Path| image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let features = detect_sift(&picture(colour).view().unwrap(), &SiftOptions::default()).unwrap();
        Self { features, depth: open(depth).to_luma16(), camera_to_world }
    }
}

#[derive(Debug, Default)]
struct Count {
    matches: usize,
    with_depth: usize,
    right: usize,
}

/// Matches from a to b, and how many lie within `tolerance` pixels of where depth and poses put them.
fn count(a: &Frame, b: &Frame, [fx, fy, cx, cy]: [f64; 4], tolerance: f64) -> Count {
    let a_to_b = b.camera_to_world.try_inverse().unwrap() * a.camera_to_world;
    let matches = match_sift(&a.features, &b.features, &SiftMatchOptions::default()).unwrap();
    let mut count = Count { matches: matches.len(), ..Count::default() };
    for m in matches {
        let (p, q) = (&a.features.keypoints[m.a], &b.features.keypoints[m.b]);
        let z = f64::from(a.depth.get_pixel(p.x.round() as u32, p.y.round() as u32).0[0]) / 1000.0;
        if z > 0.0 {
            count.with_depth += 1;
            let seen = a_to_b * Vector4::new((p.x - cx) / fx * z, (p.y - cy) / fy * z, z, 1.0);
            let (u, v) = (fx * seen.x / seen.z + cx, fy * seen.y / seen.z + cy);
            count.right += usize::from((u - q.x).hypot(v - q.y) < tolerance);
        }
    }
    count
}

/// All 20 pairs of five rendered frames, whose poses are exact.
#[test]
fn redwood_frames() {
    let Some(folder) = folder("rgbd_redwood_open3d") else { return };
    let rows = numbers(&folder.join("trajectory.log")).unwrap();
    let pose = |i: usize| Matrix4::from_fn(|r, c| rows[5 * i + 1 + r][c]);
    let frame = |i| Frame::load(&folder.join(format!("color{i}.jpg")), &folder.join(format!("depth{i}.png")), pose(i));
    let frames: Vec<Frame> = (0..5).map(frame).collect();
    let lens = [525.0, 525.0, 319.5, 239.5];
    let mut all = Count::default();
    for a in 0..5 {
        for b in (0..5).filter(|b| *b != a) {
            let pair = count(&frames[a], &frames[b], lens, 2.0);
            if (a, b) == (0, 4) {
                println!("0 -> 4: {pair:?}");
                // OpenCV: 258 matches, 207 right.
                assert!(pair.matches > 258 && pair.right > 207);
            }
            all.matches += pair.matches;
            all.with_depth += pair.with_depth;
            all.right += pair.right;
        }
    }
    println!("all: {all:?}");
    // OpenCV: 6317 matches, 5666 with depth, of which 5150 (0.909) are right. Edges of depth are among
    // the rest: right matches of which the depth is the background's.
    assert!(all.matches > 6317 && all.right > 5150);
    assert!(all.right as f64 / all.with_depth as f64 > 0.90);
}

/// Three frames of a Kinect; the poses are a tracker's, off by several pixels.
#[test]
fn nyu_frames() {
    let Some(folder) = folder("rgbd_nyu") else { return };
    let rows = numbers(&folder.join("pose.txt")).unwrap();
    let frame = |i: usize| {
        let [tx, ty, tz, x, y, z, w] = rows[i - 3][..] else { panic!("7 numbers a pose") };
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let pose = turn.to_homogeneous().append_translation(&nalgebra::Vector3::new(tx, ty, tz));
        Frame::load(&folder.join(format!("color{i}.png")), &folder.join(format!("depth{i}.pgm")), pose)
    };
    let frames = [frame(3), frame(4), frame(5)];
    // OpenCV: matches, and right ones of the 77 and 128 with depth.
    for (pair, matches, right) in [(0, 121, 66), (1, 187, 125)] {
        let found = count(&frames[pair], &frames[pair + 1], [518.0, 519.0, 325.5, 253.5], 15.0);
        println!("{} -> {}: {found:?}", pair + 3, pair + 4);
        assert!(found.matches >= matches && found.right >= right);
        assert!(found.right as f64 / found.with_depth as f64 > 0.84);
    }
}

/// Two views about a metre and 40 degrees apart of walls without texture: hardly anything matches, and
/// nothing breaks.
#[test]
fn frames_without_texture() {
    let Some(folder) = folder("rgbd_icl") else { return };
    let features =
        |name: &str| detect_sift(&picture(&folder.join(name)).view().unwrap(), &SiftOptions::default()).unwrap();
    let (a, b) = (features("color1.png"), features("color4.png"));
    let matches = match_sift(&a, &b, &SiftMatchOptions::default()).unwrap();
    println!("{} and {} features, {} matches", a.keypoints.len(), b.keypoints.len(), matches.len());
    assert!(matches.len() < a.keypoints.len() / 5);
}
