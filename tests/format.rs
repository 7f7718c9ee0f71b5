//! Files: exact round trips, damage that is always noticed, and OpenCV's own verdict.

use std::io::Write;
use std::path::PathBuf;
use std::process::Command;

use nalgebra::{DMatrix, Vector2, Vector3};
use ptzcal::error::{Error, Result, Status};
use ptzcal::format::cameras::opencv;
use ptzcal::format::{
    CalibrationRecord, CameraRecord, OpenCvCamera, model_json, ply, read_camera, read_opencv, read_ply,
    write_atomically, write_camera, write_opencv_yaml, write_ply,
};
use ptzcal::geometry::rigid::exp;
use ptzcal::geometry::{Camera, CloudNoise, Distortion, Intrinsics, PointCloud, Rigid};

/// A folder of its own for each test, removed at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ptzcal-{test}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn names(&self) -> Vec<String> {
        std::fs::read_dir(&self.0).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Numbers without a short decimal form.
fn camera(distortion: Distortion) -> Camera {
    Camera {
        width: 800,
        height: 600,
        intrinsics: Intrinsics { fx: 845.19 / 3.0, fy: 844.56 / 7.0, skew: 0.0, cx: 427.76, cy: 0.1 + 0.2 },
        distortion,
        pose: Rigid {
            rotation: exp(&Vector3::new(0.3, -1.1, 2.0)),
            translation: Vector3::new(1e-17, -4.9e9, 1.0 / 3.0),
        },
    }
}

fn lenses() -> [Distortion; 4] {
    [
        Distortion::None,
        Distortion::BrownConrady([-0.28, 0.1 + 0.2, 1e-3, -2e-4 / 3.0, 1e-300]),
        Distortion::Fisheye([-0.012, 0.1 + 0.2, -1e-3 / 3.0, 1e-300]),
        Distortion::Division(-0.2),
    ]
}

fn calibration() -> CalibrationRecord {
    CalibrationRecord {
        covariance: DMatrix::from_fn(3, 3, |i, j| 1.0 / (1.0 + i as f64 + 10.0 * j as f64)),
        residuals: vec![Vector2::new(0.1, -0.2), Vector2::new(1.0 / 3.0, f64::MIN_POSITIVE)],
        inliers: vec![true, false],
        rms: 0.3,
        noise_factor: 1.01,
        condition: 1e5 / 3.0,
        iterations: 7,
        inputs: None,
    }
}

fn reason(result: Result<CameraRecord>) -> String {
    let e = result.unwrap_err();
    assert_eq!(e.status(), Status::FileFormat, "{e}");
    e.to_string()
}

#[test]
fn json_gives_back_every_bit() {
    let folder = Folder::new("json");
    for lens in lenses() {
        for calibration in [None, Some(calibration())] {
            let record = CameraRecord { camera: camera(lens), calibration };
            write_camera(&folder.file("camera.json"), &record).unwrap();
            assert_eq!(read_camera(&folder.file("camera.json")).unwrap(), record);
        }
    }
    assert_eq!(folder.names(), ["camera.json"]);
    // Numbers whose decimal form is hard to read exactly.
    let mut record = CameraRecord { camera: camera(Distortion::None), calibration: None };
    let mut bits = 0x3ff0_0000_0000_0001u64;
    for _ in 0..2000 {
        bits = bits.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        record.camera.pose.translation.x = f64::from_bits(bits >> 2);
        let text = model_json::to_json(&record).unwrap();
        assert_eq!(model_json::from_json(text.as_bytes(), "camera").unwrap(), record);
    }
}

#[test]
fn json_faults_are_named() {
    let record = CameraRecord { camera: camera(lenses()[1]), calibration: Some(calibration()) };
    let text = model_json::to_json(&record).unwrap();
    let read = |text: &str| model_json::from_json(text.as_bytes(), "camera.json");
    let changed = |from: &str, to: &str| {
        assert!(text.contains(from), "{from} is not in {text}");
        read(&text.replacen(from, to, 1))
    };
    assert_eq!(
        changed("\"version\": 1", "\"version\": 2").unwrap_err(),
        Error::FileVersion { path: "camera.json".into(), found: 2, supported: 1 }
    );
    // Another version is told before anything else in it is looked at.
    let later = r#"{"format": "ptzcal-camera", "version": 9, "lenses": [{"deep": null}]}"#;
    assert_eq!(read(later).unwrap_err().status(), Status::FileVersion);
    assert!(reason(changed("ptzcal-camera", "other")).contains("other"));
    for key in ["image_width", "fx", "skew", "model", "coefficients", "rotation", "translation", "covariance", "rms"] {
        let message = reason(changed(&format!("\"{key}\""), "\"renamed\""));
        assert!(message.contains(key) || message.contains("renamed"), "{message}");
    }
    let wrong_type = reason(changed("\"fy\": ", "\"fy\": \"wide\", \"old\": "));
    assert!(wrong_type.contains("line 8") && wrong_type.contains("camera.json"), "{wrong_type}");
    reason(changed("\"image_width\": 800", "\"image_width\": -800"));
    reason(changed("\"image_width\": 800", "\"image_width\": 0"));
    reason(changed("\"skew\": 0.0", "\"skew\": NaN"));
    reason(changed("\"skew\": 0.0", "\"skew\": null"));
    reason(changed("\"skew\": 0.0", "\"skew\": 1e999"));
    reason(changed("\"skew\": 0.0", "\"skew\": 0.0, \"skew\": 1.0"));
    assert!(reason(changed("brown_conrady", "fisheye")).contains("fisheye"));
    assert!(reason(changed("\"coefficients\": [", "\"coefficients\": [1.0,")).contains("6 coefficients"));
    assert!(reason(changed("\"covariance\": [[", "\"covariance\": [[1.0,")).contains("covariance"));
    assert!(reason(changed("[true,", "[true,true,")).contains("inliers"));
    assert!(reason(changed("\"rotation\": [[", "\"rotation\": [[0.0,0.0,0.0],[")).contains("line"));
    let scaled = CameraRecord { camera: camera(Distortion::None), calibration: None };
    let unit = format!("{:?}", scaled.camera.pose.rotation.m11);
    assert!(reason(read(&model_json::to_json(&scaled).unwrap().replace(&unit, "3.0"))).contains("rotation"));
    for nested in ["[".repeat(1_000_000), "{\"a\":".repeat(1_000_000), text.replace("[true,", &"[".repeat(100_000))] {
        reason(read(&nested));
    }
    reason(read(""));
    reason(model_json::from_json(&[0xff, 0xfe, b'{'], "camera.json"));
}

#[test]
fn json_that_is_cut_short_is_refused_at_every_byte() {
    let record = CameraRecord { camera: camera(lenses()[1]), calibration: Some(calibration()) };
    let text = model_json::to_json(&record).unwrap();
    for length in 0..text.trim_end().len() {
        reason(model_json::from_json(&text.as_bytes()[..length], "camera.json"));
    }
}

#[test]
fn what_is_not_finite_is_not_written() {
    let folder = Folder::new("finite");
    let path = folder.file("camera.json");
    let good = CameraRecord { camera: camera(Distortion::None), calibration: Some(calibration()) };
    write_camera(&path, &good).unwrap();
    let mut bad = good.clone();
    bad.camera.intrinsics.cx = f64::NAN;
    assert_eq!(write_camera(&path, &bad).unwrap_err().status(), Status::NotFinite);
    let mut bad = good.clone();
    bad.calibration.as_mut().unwrap().covariance[(1, 2)] = f64::INFINITY;
    assert_eq!(write_camera(&path, &bad).unwrap_err().status(), Status::NotFinite);
    // The old file is still there, and nothing beside it.
    assert_eq!(read_camera(&path).unwrap(), good);
    assert_eq!(folder.names(), ["camera.json"]);
}

#[test]
fn a_failed_write_leaves_nothing_behind() {
    let folder = Folder::new("atomic");
    let e = write_atomically(&folder.file("missing").join("a.txt"), b"new").unwrap_err();
    assert_eq!(e.status(), Status::FileIo);
    assert!(e.to_string().contains("a.txt"));
    // A folder cannot be replaced by a file: the last step fails.
    std::fs::create_dir_all(folder.file("taken").join("inner")).unwrap();
    assert_eq!(write_atomically(&folder.file("taken"), b"new").unwrap_err().status(), Status::FileIo);
    assert_eq!(folder.names(), ["taken"]);
    assert!(write_atomically(&folder.0.join(".."), b"new").is_err());
    write_atomically(&folder.file("a.txt"), b"old").unwrap();
    write_atomically(&folder.file("a.txt"), b"new").unwrap();
    assert_eq!(std::fs::read(folder.file("a.txt")).unwrap(), b"new");
    assert_eq!(read_camera(&folder.file("none.json")).unwrap_err().status(), Status::FileIo);
    assert_eq!(read_camera(&folder.0).unwrap_err().status(), Status::FileIo);
}

#[test]
fn yaml_gives_back_every_bit() {
    let folder = Folder::new("yaml");
    for lens in &lenses()[..3] {
        for rms in [None, Some(0.1 + 0.2)] {
            let file = OpenCvCamera { camera: camera(*lens), rms };
            write_opencv_yaml(&folder.file("camera.yaml"), &file).unwrap();
            assert_eq!(read_opencv(&folder.file("camera.yaml")).unwrap(), file);
        }
    }
    let with = |change: fn(&mut Camera)| {
        let mut file = OpenCvCamera { camera: camera(Distortion::None), rms: None };
        change(&mut file.camera);
        opencv::to_yaml(&file).unwrap_err().status()
    };
    assert_eq!(with(|c| c.distortion = Distortion::Division(-0.1)), Status::Unsupported);
    assert_eq!(with(|c| c.intrinsics.skew = 0.5), Status::Unsupported);
    assert_eq!(with(|c| c.intrinsics.fx = f64::NAN), Status::NotFinite);
}

#[test]
fn yaml_that_is_cut_short_is_refused_at_every_byte() {
    let text = opencv::to_yaml(&OpenCvCamera { camera: camera(lenses()[1]), rms: Some(0.3) }).unwrap();
    for length in 0..text.trim_end().len() {
        let e = opencv::from_yaml(&text.as_bytes()[..length], "camera.yaml").unwrap_err();
        assert_eq!(e.status(), Status::FileFormat, "{length}: {e}");
    }
}

#[test]
fn yaml_of_others_is_read() {
    // As OpenCV 2's calibration sample wrote it.
    let old = "%YAML:1.0\ncalibration_Time: \"Thu Jan  1 00:00:00 2015\"\nimage_Width: 640\nimage_Height: 480\n\
        # flags:  +fix_aspectRatio\nflagValue: 2\nCamera_Matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   \
        data: [ 6.57e+02, 0., 3.195e+02, 0., 6.58e+02,\n       2.395e+02, 0., 0., 1. ]\n\
        Distortion_Coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ -4.1e-01, 5.7e-01, 0., 0., \
        -.5 ]\nAvg_Reprojection_Error: 3.4e-01\nPer_View_Reprojection_Errors: !!opencv-matrix\n   rows: 1\n   cols: 2\n   \
        dt: f\n   data: [ .3, 3.7e-01 ]\n...\n";
    let read = |text: &str| opencv::from_yaml(text.as_bytes(), "other.yaml");
    let file = read(old).unwrap();
    assert_eq!(file.camera.intrinsics, Intrinsics { fx: 657.0, fy: 658.0, skew: 0.0, cx: 319.5, cy: 239.5 });
    assert_eq!(file.camera.distortion, Distortion::BrownConrady([-0.41, 0.57, 0.0, 0.0, -0.5]));
    assert_eq!((file.camera.width, file.rms, file.camera.pose), (640, Some(0.34), Rigid::identity()));
    assert_eq!(read(&old.replace('\n', "\r\n")).unwrap(), file);

    // ROS camera_info.
    let ros = "image_width: 640\nimage_height: 480\ncamera_name: narrow\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: \
        [657, 0, 319.5, 0, 658, 239.5, 0, 0, 1]  # px\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  \
        cols: 5\n  data: [-0.41, 0.57, 0, 0, -0.5]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, \
        0, 1]\n";
    assert_eq!(read(ros).unwrap().camera, file.camera);

    // A fisheye lens, as ROS and as OpenCV's sample write it.
    let four = ros.replace("cols: 5\n  data: [-0.41, 0.57, 0, 0, -0.5]", "cols: 4\n  data: [-0.01, 0.02, 0, 0.5]");
    let fisheye = Distortion::Fisheye([-0.01, 0.02, 0.0, 0.5]);
    assert_eq!(read(&four.replace("plumb_bob", "equidistant")).unwrap().camera.distortion, fisheye);
    let flagged = |flag: &str| read(&four.replace("distortion_model: plumb_bob", flag)).unwrap().camera.distortion;
    assert_eq!(flagged("fisheye_model: 1"), fisheye);
    assert_eq!(flagged("fisheye_model: 0"), Distortion::BrownConrady([-0.01, 0.02, 0.0, 0.5, 0.0]));

    for (from, to, status, word) in [
        ("plumb_bob", "spherical", Status::Unsupported, "spherical"),
        ("plumb_bob", "equidistant", Status::FileFormat, "5 numbers of a fisheye lens"),
        ("cols: 5\n  data: [-0.41,", "cols: 8\n  data: [1, 0, 0, -0.41,", Status::Unsupported, "8 coefficients"),
        ("data: [-0.41,", "data: [", Status::FileFormat, "4 numbers"),
        ("data: [-0.41,", "data: [.Nan,", Status::FileFormat, "distortion_coefficients"),
        ("data: [-0.41,", "data: [inf,", Status::FileFormat, "line 12: distortion_coefficients.data.0"),
        ("rows: 3", "rows: 99999999999999999999", Status::FileFormat, "camera_matrix"),
        ("rows: 3", "rows: 6148914691236517207", Status::FileFormat, "camera_matrix"),
        ("[657, 0, 319.5, 0,", "[657, 0, 319.5, 4,", Status::FileFormat, "camera_matrix"),
        ("[657,", "[-657,", Status::FileFormat, "focal"),
        ("camera_matrix:\n", "camera_matrix: none\nother:\n", Status::FileFormat, "line 4"),
        ("image_width: 640", "image_width: wide", Status::FileFormat, "image_width"),
        ("image_width: 640\n", "", Status::FileFormat, "image_width"),
        ("image_height: 480", "image_width: 480", Status::FileFormat, "twice"),
        ("image_width: 640\n", "  - 640\n", Status::FileFormat, "line 2"),
        ("image_width: 640\n", "<xml>\n", Status::FileFormat, "line 1"),
    ] {
        assert!(ros.contains(from), "{from}");
        let e = read(&ros.replacen(from, to, 1)).unwrap_err();
        assert!(e.status() == status && e.to_string().contains(word), "{to}: {e}");
    }
}

/// `PYTHON` names the interpreter; python3 by default.
#[test]
fn opencv_reads_our_yaml() {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let available = Command::new(&python).args(["-c", "import cv2"]).output().is_ok_and(|o| o.status.success());
    if !available {
        let _ = writeln!(std::io::stderr(), "SKIPPED reading the YAML back with OpenCV: {python} has no cv2");
        return;
    }
    let folder = Folder::new("opencv");
    let path = folder.file("camera.yaml");
    let camera = camera(lenses()[1]);
    write_opencv_yaml(&path, &OpenCvCamera { camera, rms: Some(0.1 + 0.2) }).unwrap();
    let script = "import cv2, sys\n\
        f = cv2.FileStorage(sys.argv[1], cv2.FILE_STORAGE_READ)\n\
        print(int(f.getNode('image_width').real()), int(f.getNode('image_height').real()))\n\
        print(repr(f.getNode('avg_reprojection_error').real()))\n\
        for k in ['camera_matrix', 'distortion_coefficients', 'rotation_matrix', 'translation_vector']:\n    \
            print(*[repr(float(v)) for v in f.getNode(k).mat().ravel()])\n";
    let output = Command::new(&python).args(["-c", script]).arg(&path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let rows: Vec<Vec<f64>> =
        text.lines().map(|l| l.split_whitespace().map(|v| v.parse().unwrap()).collect()).collect();
    let k = camera.intrinsics;
    let wanted = [
        vec![800.0, 600.0],
        vec![0.1 + 0.2],
        vec![k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0],
        camera.distortion.coefficients().to_vec(),
        camera.pose.rotation.transpose().as_slice().to_vec(),
        camera.pose.translation.as_slice().to_vec(),
    ];
    for (row, wanted) in rows.iter().zip(&wanted) {
        // OpenCV's own number reader is good to one unit in the last place.
        let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 4.0 * f64::EPSILON * b.abs();
        assert!(row.len() == wanted.len() && row.iter().zip(wanted).all(near), "{row:?} is not {wanted:?}");
    }
    assert_eq!(rows.len(), wanted.len());
}

fn cloud() -> PointCloud {
    PointCloud {
        positions: vec![Vector3::new(0.5, -1.25, 3.0), Vector3::new(-0.125, 2.0, 4.5), Vector3::zeros()],
        colours: vec![[255, 0, 7], [10, 20, 30], [0, 0, 0]],
        normals: None,
        noise: CloudNoise::Deviations(vec![0.25, 0.5, 0.0]),
    }
}

#[test]
fn ply_gives_back_the_cloud() {
    let folder = Folder::new("ply");
    let path = folder.file("cloud.ply");
    for cloud in [cloud(), PointCloud { noise: CloudNoise::Unknown, ..cloud() }, PointCloud::default()] {
        write_ply(&path, &cloud).unwrap();
        assert_eq!(read_ply(&path).unwrap().cloud, cloud);
    }
    // Map coordinates: a float would be off by a quarter of a metre.
    let mut far = cloud();
    far.positions[1] = Vector3::new(487_523.123_456_7, 4_287_654.987_654_3, 102.1);
    write_ply(&path, &far).unwrap();
    assert_eq!(read_ply(&path).unwrap().cloud, far);
    let mut fine = cloud();
    fine.positions[0] = Vector3::new(0.1, 999.9, -5.3);
    write_ply(&path, &fine).unwrap();
    assert!((read_ply(&path).unwrap().cloud.positions[0] - fine.positions[0]).amax() < 5e-5);
}

#[test]
fn ply_header_is_what_viewers_expect() {
    let bytes = ply::to_ply(&cloud()).unwrap();
    let wanted = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
        property float standard_deviation\nend_header\n";
    assert!(bytes.starts_with(wanted.as_bytes()));
    assert_eq!(bytes.len(), wanted.len() + 3 * 19);
    assert_eq!(bytes[wanted.len()..wanted.len() + 4], 0.5f32.to_le_bytes());
    assert_eq!(bytes[wanted.len() + 12..wanted.len() + 15], [255, 0, 7]);
}

#[test]
fn ply_that_is_cut_short_or_too_long_is_refused() {
    let bytes = ply::to_ply(&cloud()).unwrap();
    for length in 0..bytes.len() {
        assert_eq!(ply::from_ply(&bytes[..length], "cloud").unwrap_err().status(), Status::FileFormat, "{length}");
    }
    let longer = [bytes.as_slice(), &[0]].concat();
    assert_eq!(ply::from_ply(&longer, "cloud").unwrap_err().status(), Status::FileFormat);
}

#[test]
fn ply_of_others_is_read_and_lies_are_refused() {
    let mut bytes = b"ply\r\nformat binary_little_endian 1.0\r\ncomment made elsewhere\r\nelement vertex 2\r\n\
        property double z\r\nproperty short quality\r\nproperty float y\r\nproperty int8 x\r\nelement face 1\r\n\
        property list uchar int vertex_indices\r\nend_header\r\n"
        .to_vec();
    for z in [1.5f64, -2.5] {
        bytes.extend(z.to_le_bytes());
        bytes.extend((-3i16).to_le_bytes());
        bytes.extend(0.25f32.to_le_bytes());
        bytes.push(-4i8 as u8);
    }
    bytes.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
    let cloud = ply::from_ply(&bytes, "mesh").unwrap().cloud;
    assert_eq!(cloud.positions, [Vector3::new(-4.0, 0.25, 1.5), Vector3::new(-4.0, 0.25, -2.5)]);
    assert_eq!((cloud.colours, cloud.noise), (vec![[255; 3]; 2], CloudNoise::Unknown));

    let own = ply::to_ply(&self::cloud()).unwrap();
    let changed = |from: &str, to: &str| {
        let at = own.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        let bytes = [&own[..at], to.as_bytes(), &own[at + from.len()..]].concat();
        ply::from_ply(&bytes, "cloud").unwrap_err().status()
    };
    assert_eq!(changed("vertex 3", "vertex 18446744073709551615"), Status::FileFormat);
    assert_eq!(changed("vertex 3", "vertex 99999999999999999999"), Status::FileFormat);
    assert_eq!(changed("vertex 3", "vertex -3"), Status::FileFormat);
    assert_eq!(changed("vertex 3", "vertex 2"), Status::FileFormat);
    assert_eq!(changed("property float z\n", ""), Status::FileFormat);
    assert_eq!(changed("float z", "quad z"), Status::FileFormat);
    assert_eq!(changed("binary_little_endian", "ascii"), Status::FileFormat);
    assert_eq!(changed("binary_little_endian", "binary_middle_endian"), Status::Unsupported);
    assert_eq!(changed("property float z", "property list uchar float z"), Status::FileFormat);
    assert_eq!(changed("property uchar red", "property int red"), Status::FileFormat);
    assert_eq!(changed("ply\n", "plx\n"), Status::FileFormat);
    assert_eq!(changed("end_header\n", ""), Status::FileFormat);
    assert_eq!(ply::from_ply(&[b'a'; 100_000], "cloud").unwrap_err().status(), Status::FileFormat);

    let mut nan = own.clone();
    let z = own.len() - 19 + 8;
    nan[z..z + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    // A point that was not measured.
    let file = ply::from_ply(&nan, "cloud").unwrap();
    assert_eq!((file.cloud.len(), file.skipped), (2, 1));

    let folder = Folder::new("bad-ply");
    for bad in [
        PointCloud { colours: vec![], ..self::cloud() },
        PointCloud { noise: CloudNoise::Deviations(vec![0.1]), ..self::cloud() },
        PointCloud { noise: CloudNoise::Deviations(vec![0.1, f64::INFINITY, 0.2]), ..self::cloud() },
        PointCloud { positions: vec![Vector3::new(f64::NAN, 0.0, 0.0); 3], ..self::cloud() },
    ] {
        assert!(write_ply(&folder.file("cloud.ply"), &bad).is_err());
    }
    assert!(folder.names().is_empty());
}
