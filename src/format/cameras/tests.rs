use nalgebra::{Vector2, Vector3};

use super::*;
use crate::error::Status;
use crate::geometry::rigid::exp;
use crate::geometry::{Distortion, Intrinsics};

const NONE: Distortion = Distortion::None;
const FIVE: Distortion = Distortion::BrownConrady([-0.28, 0.1 + 0.2, 1e-3, -2e-4 / 3.0, 0.01]);
const FOUR: Distortion = Distortion::BrownConrady([-0.28, 0.1 + 0.2, 1e-3, -2e-4 / 3.0, 0.0]);
const DOME: Distortion = Distortion::Fisheye([-0.012, 0.02, -1e-2 / 3.0, 1e-3]);
const DIVISION: Distortion = Distortion::Division(-0.2);

fn camera(distortion: Distortion) -> Camera {
    Camera {
        width: 800,
        height: 600,
        intrinsics: Intrinsics { fx: 845.19, fy: 2533.0 / 3.0, skew: 0.0, cx: 427.76, cy: 285.53 + 0.1 },
        distortion,
        pose: Rigid { rotation: exp(&Vector3::new(0.3, -1.1, 2.0)), translation: Vector3::new(0.1, -0.05, 10.0 / 3.0) },
    }
}

fn named(distortion: Distortion) -> Vec<NamedCamera> {
    vec![NamedCamera::new("", camera(distortion))]
}

/// What each format holds.
fn holds(format: CameraFormat, lens: &Distortion) -> bool {
    use CameraFormat::{Colmap, Json, Kalibr, Mrcal};
    match lens {
        Distortion::None => true,
        Distortion::BrownConrady([.., k3]) => format != Kalibr || *k3 == 0.0,
        Distortion::Division(_) => matches!(format, Json | Colmap),
        Distortion::Fisheye(_) => format != Mrcal,
    }
}

fn same_lens(a: &Camera, b: &Camera) -> bool {
    (a.width, a.height, a.intrinsics, a.distortion) == (b.width, b.height, b.intrinsics, b.distortion)
}

#[test]
fn what_is_written_is_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    for format in CameraFormat::ALL {
        let path = folder.path().join(format!("{format:?}"));
        for lens in [NONE, FIVE, FOUR, DOME, DIVISION] {
            let cameras = named(lens);
            let written = write_cameras(&path, &cameras, Some(format));
            if !holds(format, &lens) {
                let e = written.unwrap_err();
                assert!(e.status() == Status::Unsupported && e.to_string().contains(format.name()), "{e}");
                continue;
            }
            written.unwrap();
            // By its content alone, and by name.
            for asked in [None, Some(format)] {
                let (told, found) = read_cameras(&path, asked).unwrap();
                let ([found], [wanted]) = (&found[..], &cameras[..]) else { panic!("{found:?}") };
                assert_eq!(told, format);
                assert_eq!(found.has_pose, format != CameraFormat::Ros);
                match format {
                    CameraFormat::Json
                    | CameraFormat::OpenCvYaml
                    | CameraFormat::OpenCvXml
                    | CameraFormat::OpenCvJson => {
                        assert_eq!(found, wanted)
                    }
                    // Half a pixel to and fro, and turns as quaternions.
                    CameraFormat::Colmap => {
                        let (a, b) = (&found.camera, &wanted.camera);
                        assert!((a.intrinsics.cx - b.intrinsics.cx).abs() < 1e-12 && a.distortion == b.distortion);
                        assert!((a.pose.rotation - b.pose.rotation).amax() < 1e-15);
                        assert_eq!((a.pose.translation, found.name.as_str()), (b.pose.translation, "camera0"));
                    }
                    CameraFormat::Mrcal => {
                        assert!(same_lens(&found.camera, &wanted.camera));
                        assert!((found.camera.pose.rotation - wanted.camera.pose.rotation).amax() < 1e-14);
                    }
                    CameraFormat::Ros | CameraFormat::Kalibr => {
                        assert!(same_lens(&found.camera, &wanted.camera) && found.camera.pose == Rigid::identity());
                    }
                }
            }
        }
    }
}

#[test]
fn a_half_turn_keeps_its_pose() {
    let folder = tempfile::tempdir().unwrap();
    for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.6, 0.0, -0.8)] {
        for angle in [0.0, 1e-9, std::f64::consts::PI - 1e-7, std::f64::consts::PI, 3.2] {
            let pose = Rigid { rotation: exp(&(axis * angle)), translation: Vector3::new(1.0, 2.0, 3.0) };
            for format in [CameraFormat::Colmap, CameraFormat::Mrcal] {
                let path = folder.path().join(format!("{format:?}"));
                write_cameras(&path, &[NamedCamera::new("", Camera { pose, ..camera(NONE) })], Some(format)).unwrap();
                let found = read_cameras(&path, Some(format)).unwrap().1[0].camera.pose;
                assert!((found.rotation - pose.rotation).amax() < 1e-12, "{format:?} {axis} {angle}");
            }
        }
    }
}

/// Three cameras at places of their own.
fn network() -> Vec<NamedCamera> {
    let mut cameras = Vec::new();
    for (i, lens) in [FOUR, NONE, DOME].into_iter().enumerate() {
        let turn = Vector3::new(0.1 * i as f64, -0.4, 0.2 + i as f64);
        let pose = Rigid { rotation: exp(&turn), translation: Vector3::new(i as f64, 0.5, -0.25) };
        cameras.push(NamedCamera::new(format!("yard/{i}.png"), Camera { pose, ..camera(lens) }));
    }
    cameras
}

#[test]
fn colmap_and_kalibr_hold_many_cameras() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = network();
    let path = folder.path().join("model");
    write_cameras(&path, &cameras, Some(CameraFormat::Colmap)).unwrap();
    for way in [path.clone(), path.join("cameras.txt"), path.join("images.txt")] {
        let (_, found) = read_cameras(&way, None).unwrap();
        assert_eq!(found.len(), 3);
        for (a, b) in found.iter().zip(&cameras) {
            assert!(a.name == b.name && (a.camera.pose.rotation - b.camera.pose.rotation).amax() < 1e-14);
        }
    }
    // A lens without an image has no pose.
    let nowhere = NamedCamera { has_pose: false, name: String::new(), ..cameras[1].clone() };
    write_cameras(&path, &[cameras[0].clone(), nowhere], Some(CameraFormat::Colmap)).unwrap();
    let (_, found) = read_cameras(&path, None).unwrap();
    assert_eq!(found.iter().map(|c| c.has_pose).collect::<Vec<_>>(), [true, false]);

    let chain = folder.path().join("camchain.yaml");
    write_cameras(&chain, &cameras, Some(CameraFormat::Kalibr)).unwrap();
    let (format, found) = read_cameras(&chain, None).unwrap();
    assert_eq!((format, found.len()), (CameraFormat::Kalibr, 3));
    // The world is the first camera's frame: what the cameras see of each other is the same.
    for (a, b) in found.iter().zip(&cameras) {
        let wanted = b.camera.pose.after(&cameras[0].camera.pose.inverse());
        assert!((a.camera.pose.rotation - wanted.rotation).amax() < 1e-14, "{a:?}");
        assert!((a.camera.pose.translation - wanted.translation).amax() < 1e-14 && a.name == b.name);
    }
    for format in CameraFormat::ALL.into_iter().filter(|f| !f.holds_many()) {
        let e = write_cameras(&folder.path().join("many"), &cameras, Some(format)).unwrap_err();
        assert!(e.status() == Status::InvalidArgument && e.to_string().contains("one a file"), "{e}");
    }
}

#[test]
fn what_a_file_cannot_hold_is_refused_before_it_is_touched() {
    let folder = tempfile::tempdir().unwrap();
    let status = |cameras: &[NamedCamera], format| {
        let path = folder.path().join("refused");
        let status = write_cameras(&path, cameras, Some(format)).unwrap_err().status();
        assert!(!path.exists());
        status
    };
    let changed = |change: fn(&mut NamedCamera)| {
        let mut cameras = network();
        change(&mut cameras[1]);
        cameras
    };
    use CameraFormat::{Colmap, Json, Kalibr};
    for format in CameraFormat::ALL {
        assert_eq!(status(&[], format), Status::InvalidArgument);
        let mut one = named(NONE);
        one[0].camera.intrinsics.fx = f64::NAN;
        assert_eq!(status(&one, format), Status::NotFinite);
        one = named(NONE);
        one[0].camera.intrinsics.skew = 0.5;
        if format != Json {
            assert_eq!(status(&one, format), Status::Unsupported, "{format:?}");
        }
    }
    for (format, wanted, cameras) in [
        (Colmap, Status::InvalidArgument, changed(|c| c.name = "two words".into())),
        (Colmap, Status::InvalidArgument, changed(|c| c.name = "yard/0.png".into())),
        (Colmap, Status::Unsupported, changed(|c| c.camera.intrinsics.skew = 1.0)),
        (Kalibr, Status::Unsupported, changed(|c| c.camera.distortion = FIVE)),
        (Kalibr, Status::Unsupported, changed(|c| c.camera.distortion = DIVISION)),
        (Kalibr, Status::Unsupported, changed(|c| c.has_pose = false)),
    ] {
        assert_eq!(status(&cameras, format), wanted);
    }
    for ending in ["txt", "", "png"] {
        let path = folder.path().join("refused").with_extension(ending);
        assert_eq!(write_cameras(&path, &named(NONE), None).unwrap_err().status(), Status::InvalidArgument);
    }
    for (ending, wanted) in [
        ("json", Json),
        ("YML", CameraFormat::OpenCvYaml),
        ("xml", CameraFormat::OpenCvXml),
        ("cameramodel", CameraFormat::Mrcal),
    ] {
        let path = folder.path().join("camera").with_extension(ending);
        write_cameras(&path, &named(FIVE), None).unwrap();
        assert_eq!(read_cameras(&path, None).unwrap().0, wanted);
    }
}

/// Names of any kind go through the formats that have names.
#[test]
fn names_are_kept() {
    for name in ["wide", "a \"b\" \\ # c: d", "- x", "é€", "tab\there", "'", "[1, 2]"] {
        let camera = NamedCamera::new(name, camera(NONE));
        for format in [CameraFormat::Ros, CameraFormat::Kalibr] {
            let text = to_text(std::slice::from_ref(&camera), format).unwrap();
            assert_eq!(from_text(&text, format, "file").unwrap()[0].name, name, "{text}");
        }
    }
}

fn texts() -> Vec<(CameraFormat, String)> {
    let written = |format| to_text(&named(if format == CameraFormat::Kalibr { FOUR } else { FIVE }), format).unwrap();
    let single = CameraFormat::ALL.into_iter().filter(|f| *f != CameraFormat::Colmap);
    let mut texts: Vec<_> = single.map(|f| (f, written(f))).collect();
    texts.push((CameraFormat::Kalibr, to_text(&network(), CameraFormat::Kalibr).unwrap()));
    texts
}

#[test]
fn what_is_cut_short_is_refused_at_every_byte() {
    for (format, text) in texts() {
        let whole = from_text(&text, format, "file").unwrap().len();
        for length in 0..text.trim_end().len() {
            match from_text(&text[..length], format, "file") {
                // Half the name of a model is a model that is not known.
                Err(e) => assert!(matches!(e.status(), Status::FileFormat | Status::Unsupported), "{length}: {e}"),
                // A chain of fewer cameras is a chain.
                Ok(found) => assert!(format == CameraFormat::Kalibr && found.len() < whole, "{format:?} {length}"),
            }
        }
    }
    let [lenses, images] = colmap::texts(&network());
    for length in 0..lenses.len() {
        assert!(colmap::from_text(&lenses[..length], &images).is_err(), "{length}");
    }
    for length in 0..images.len() {
        match colmap::from_text(&lenses, &images[..length]) {
            Err(e) => assert_eq!(e.status(), Status::FileFormat),
            Ok(found) => assert!(found.len() < 3 && (length == 0 || images[..length].ends_with('\n')), "{length}"),
        }
    }
}

#[test]
fn faults_name_the_line_and_the_key() {
    use CameraFormat::{Kalibr, Mrcal, OpenCvJson, OpenCvXml, Ros};
    use Status::{FileFormat, Unsupported};
    let texts = texts();
    let chain = &texts.last().unwrap().1;
    let of = |format| if format == Kalibr { chain } else { &texts.iter().find(|(f, _)| *f == format).unwrap().1 };
    for (format, from, to, status, word) in [
        (Ros, "plumb_bob", "spherical", Unsupported, "line 9: distortion_model: the lens model 'spherical'"),
        (Ros, "plumb_bob", "equidistant", FileFormat, "5 numbers of a fisheye lens"),
        (Ros, "rectification_matrix", "other", FileFormat, "rectification_matrix is missing"),
        (Ros, "projection_matrix:\n  rows: 3", "projection_matrix:\n  rows: 4", FileFormat, "projection_matrix"),
        (Ros, "image_width: 800", "image_width: 800.5", FileFormat, "line 2: image_width: '800.5'"),
        (Ros, "image_width: 800", "image_width: -800", FileFormat, "image_width"),
        (Ros, "image_width: 800", "image_width: 99999999999", FileFormat, "image_width"),
        (Ros, "image_width: 800", "image_width: [800]", FileFormat, "image_width"),
        (Ros, "image_width: 800", "image_width: 0", FileFormat, "image size"),
        (Ros, "8.4519e+02", "1e999", FileFormat, "camera_matrix.data.0"),
        (Ros, "8.4519e+02", "-1.0", FileFormat, "focal"),
        (Ros, "8.4519e+02", "nan", FileFormat, "camera_matrix.data.0"),
        (OpenCvXml, "<cols>3</cols>", "<cols>4</cols>", FileFormat, "rotation_matrix: 9 numbers in 3 x 4"),
        (OpenCvXml, "<rows>5</rows>", "<rows>x</rows>", FileFormat, "distortion_coefficients.rows"),
        (OpenCvXml, "-2.8e-01", "0x1p3", FileFormat, "'0x1p3'"),
        (OpenCvXml, "camera_matrix", "kamera", FileFormat, "not XML"),
        (OpenCvJson, "\"image_width\": 800", "\"image_width\": null", FileFormat, "line 2: image_width: 'null'"),
        (OpenCvJson, "\"camera_matrix\": {", "\"camera_matrix\": [", FileFormat, "line 2"),
        (OpenCvJson, "\"camera_matrix\"", "\"Camera\"", FileFormat, "camera_matrix is missing"),
        (OpenCvJson, "\"image_width\"", "\"image_height\"", FileFormat, "twice"),
        (
            Mrcal,
            "LENSMODEL_OPENCV5",
            "LENSMODEL_CAHVOR",
            Unsupported,
            "line 2: lensmodel: the lens model 'LENSMODEL_CAHVOR'",
        ),
        (
            Mrcal,
            "LENSMODEL_OPENCV5",
            "LENSMODEL_OPENCV8",
            FileFormat,
            "line 5: intrinsics: 5 numbers of a lens that has 8",
        ),
        (Mrcal, "'imagersize': [ 800, 600 ]", "'imagersize': [ 800 ]", FileFormat, "imagersize: not two"),
        (Mrcal, "'imagersize': [ 800, 600 ]", "'imagersize': 800", FileFormat, "imagersize: not a list"),
        (Mrcal, "'extrinsics': [ ", "'extrinsics': [ 1, ", FileFormat, "extrinsics: 7 numbers, not 6"),
        (Mrcal, "'extrinsics': [ ", "'extrinsics': [ 1", FileFormat, "not what rt_cam_ref is"),
        (
            Kalibr,
            "camera_model: pinhole",
            "camera_model: omni",
            Unsupported,
            "line 2: cam0.camera_model: the camera model 'omni'",
        ),
        (Kalibr, "radtan", "fov", Unsupported, "distortion model 'fov'"),
        (Kalibr, "radtan", "none", FileFormat, "coefficients of no distortion"),
        (Kalibr, "cam1:", "cam7:", FileFormat, "cam1 is missing"),
        (Kalibr, "cam0:", "imu0:", FileFormat, "cam0 is missing"),
        (Kalibr, "[0.0, 0.0, 0.0, 1.0]", "[0.0, 0.0, 0.1, 1.0]", FileFormat, "cam1.T_cn_cnm1.3: not 0 0 0 1"),
        (Kalibr, "T_cn_cnm1:\n", "T_cn_cnm1:\n  - [9.0, 0.0, 0.0, 0.0]\n", FileFormat, "5 rows"),
        (Kalibr, "T_cn_cnm1:\n  - [", "T_cn_cnm1:\n  - [1", FileFormat, "rotation"),
        (Kalibr, "resolution: [800,", "resolution: [70000,", FileFormat, "image size"),
    ] {
        let text = of(format);
        assert!(text.contains(from), "{from} is not in {text}");
        let e = match from_text(&text.replacen(from, to, 1), format, "file") {
            Err(e) => e,
            Ok(_) => panic!("{format:?}: {to} was read"),
        };
        assert!(e.status() == status && e.to_string().contains(word), "{to}: {e}");
    }
}

#[test]
fn colmap_faults_name_the_line() {
    let [lenses, images] = colmap::texts(&network());
    let refused = |lenses: &str, images: &str, status: Status, word: &str| {
        let e = colmap::from_text(lenses, images).map(|_| ()).unwrap_err();
        assert!(e.status() == status && e.to_string().contains(word), "{e}");
    };
    for (from, to, status, word) in [
        ("2 PINHOLE", "1 PINHOLE", Status::FileFormat, "line 3: camera 1 is there twice"),
        ("2 PINHOLE", "-2 PINHOLE", Status::FileFormat, "line 3: '-2'"),
        ("PINHOLE", "THIN_PRISM_FISHEYE", Status::Unsupported, "line 3"),
        ("PINHOLE", "SIMPLE_PINHOLE", Status::FileFormat, "SIMPLE_PINHOLE with 4 parameters"),
        ("8.4519e+02", "inf", Status::FileFormat, "'inf'"),
        ("800 600", "800", Status::FileFormat, "'8.4519e+02' is not a whole number"),
        ("3 OPENCV_FISHEYE", "4 OPENCV_FISHEYE", Status::FileFormat, "there is no camera 3"),
    ] {
        assert!(lenses.contains(from), "{from} is not in {lenses}");
        refused(&lenses.replacen(from, to, 1), &images, status, word);
    }
    let full = "1 FULL_OPENCV 640 480 1 1 0 0 0 0 0 0 0 0.1 0 0\n";
    refused(full, "", Status::Unsupported, "k4 k5 k6");
    let lens = "1 PINHOLE 640 480 1 1 0 0\n";
    for (image, word) in [
        ("1 1 0 0 0 0 0 0 1 a", "line 1: the file ends before the line does"),
        ("1 1 0 0 0 0 0 0 1 a\n", "keypoints"),
        ("1 1 0 0 0 0 0 0 1\n\n", "NAME is missing"),
        ("1 1 0 0 0 0 0 0 7 a\n\n", "there is no camera 7"),
        ("1 2 0 0 0 0 0 0 1 a\n\n", "length 2"),
        ("1 nan 0 0 0 0 0 0 1 a\n\n", "'nan'"),
        ("# x\n\n1 1 0 0\n\n", "line 3: QZ is missing"),
    ] {
        refused(lens, image, Status::FileFormat, word);
    }
    // Keypoints are passed over, also where the line of an image has spaces in its name.
    let found = colmap::from_text(lens, "# a comment\n7 1 0 0 0 1 2 3 1 a b.png\n1.5 2.5 -1 3.5 4.5 2\n").unwrap();
    assert_eq!((found[0].name.as_str(), found[0].camera.intrinsics.cx), ("a b.png", -0.5));
}

#[test]
fn files_of_others_are_read() {
    let one = |text: &str| {
        let format = guess(text, "file").unwrap();
        (format, from_text(text, format, "file").unwrap().remove(0))
    };
    // As cameracalibrator writes it, rectified with its own K in P.
    let ros = "image_width: 640\nimage_height: 480\ncamera_name: narrow_stereo/left\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
        data: [ 434.8,    0. ,  322.2,\n            0. ,  435.1,  240.2,\n            0. ,    0. ,    1. ]\n\
        distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.27, 0.06, 0., 0., 0.]\n\
        rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]\nprojection_matrix:\n  \
        rows: 3\n  cols: 4\n  data: [ 343.2, 0., 324.6, 0., 0., 393.5, 241.1, 0., 0., 0., 1., 0.]\n";
    let (format, found) = one(ros);
    assert_eq!((format, found.name.as_str(), found.has_pose), (CameraFormat::Ros, "narrow_stereo/left", false));
    assert_eq!(found.camera.intrinsics, Intrinsics { fx: 434.8, fy: 435.1, skew: 0.0, cx: 322.2, cy: 240.2 });
    assert_eq!(found.camera.distortion, Distortion::BrownConrady([-0.27, 0.06, 0.0, 0.0, 0.0]));
    let rational = ros.replace("plumb_bob", "rational_polynomial").replace("cols: 5", "cols: 8");
    let rational = rational.replace("0., 0., 0.]\nrect", "0., 0., 0., 0., 0., 0.]\nrect");
    assert_eq!(one(&rational).1.camera, found.camera);
    let e = from_text(&rational.replace("0., 0.]\nrect", "0., 1e-9]\nrect"), CameraFormat::Ros, "file").unwrap_err();
    assert!(e.status() == Status::Unsupported && e.to_string().contains("a rational lens with 8"), "{e}");

    // As Kalibr writes it.
    let kalibr = "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [-0.28, 0.07, 0.0002, 1.8e-05]\n  \
        distortion_model: radtan\n  intrinsics: [458.6, 457.3, 367.2, 248.4]\n  resolution: [752, 480]\n  rostopic: /cam0/image_raw\n\
        cam1:\n  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, -0.11]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n  \
        - [0.0, 0.0, 0.0, 1.0]\n  cam_overlaps: [0]\n  camera_model: pinhole\n  distortion_coeffs: [0.1, 0.0, 0.0, 0.0]\n  \
        distortion_model: equidistant\n  intrinsics: [457.6, 456.1, 379.9, 255.2]\n  resolution: [752, 480]\n  \
        rostopic: /cam1/image_raw\n";
    let found = from_text(kalibr, guess(kalibr, "file").unwrap(), "file").unwrap();
    assert_eq!((found.len(), found[1].name.as_str()), (2, "/cam1/image_raw"));
    assert_eq!(
        (found[1].camera.centre().x, found[1].camera.distortion),
        (0.11, Distortion::Fisheye([0.1, 0.0, 0.0, 0.0]))
    );

    // As mrcal writes it, its inputs and all.
    let mrcal = "{\n    'lensmodel':  'LENSMODEL_OPENCV4',\n\n    # intrinsics are fx,fy,cx,cy,distortion0,....\n    \
        'intrinsics': [ 1000,1001,319.5,239.5,0.1,-0.2,0.01,0.02,],\n\n    'valid_intrinsics_region': [\n    [ 1, 2 ],\n    [ 3, 4 ],\n    ],\n\n    \
        # extrinsics are rt_fromref\n    'extrinsics': [ 0,0,0.1,1,2,3,],\n\n    'imagersize': [ 640,480,],\n    'icam_intrinsics': 0,\n    \
        # The optimization inputs\n    'optimization_inputs': b'QlpoOTFBWSZT+/=',\n}\n";
    let (format, found) = one(mrcal);
    assert_eq!((format, found.camera.pose.translation), (CameraFormat::Mrcal, Vector3::new(1.0, 2.0, 3.0)));
    assert_eq!(found.camera.distortion, Distortion::BrownConrady([0.1, -0.2, 0.01, 0.02, 0.0]));
    assert!((found.camera.pose.rotation[(1, 0)] - 0.1f64.sin()).abs() < 1e-15);

    // A mark of Windows' editors, and files that are none of all.
    assert_eq!(text_of("\u{feff}a".as_bytes(), "file").unwrap(), "a");
    let latin = text_of(b"camera:\n  name: caf\xe9\n", "file").unwrap_err();
    assert!(latin.to_string().contains("line 2: not UTF-8"), "{latin}");
    for text in ["", "a: 1\n", "- 1\n", "\u{0}\u{1}", "PK\u{3}\u{4}", "cam0: 3\n"] {
        assert_eq!(guess(text, "file").unwrap_err().status(), Status::FileFormat, "{text:?}");
    }
    let wide: Vec<u8> = "image_width: 3\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert!(guess(text_of(&wide, "file").unwrap(), "file").is_err());
}

/// COLMAP's origin: its (0.5, 0.5) is our (0, 0).
#[test]
fn half_a_pixel_is_where_it_belongs() {
    let [lenses, _] = colmap::texts(&named(NONE));
    assert!(lenses.contains("4.2826e+02"), "{lenses}");
    let found = colmap::from_text("1 SIMPLE_PINHOLE 640 480 500 320 240\n", "1 1 0 0 0 0 0 0 1 a\n\n").unwrap();
    // The image's middle, for both.
    assert_eq!(found[0].camera.project(&Vector3::new(0.0, 0.0, 1.0)), Some(Vector2::new(319.5, 239.5)));
}

/// Damaged files end in an error or in cameras that are valid.
#[test]
fn fuzz_camera_files() {
    use crate::fuzz::{Random, fuzz_inputs, mutated};
    let mut random = Random(7);
    let [lenses, images] = colmap::texts(&network());
    let valid = |cameras: &[NamedCamera]| assert!(cameras.iter().all(|c| c.camera.validate().is_ok()));
    let (mut read, mut refused) = (0, 0u64);
    let texts = texts();
    // A file takes some fifty times as long as a packet.
    for i in 0..fuzz_inputs() / 10 {
        let (format, good) = &texts[i as usize % texts.len()];
        let bytes = mutated(good.as_bytes(), &mut random);
        let Ok(text) = text_of(&bytes, "file") else { continue };
        for format in [Ok(*format), guess(text, "file")].into_iter().flatten() {
            match from_text(text, format, "file") {
                Ok(cameras) => {
                    read += 1;
                    valid(&cameras);
                    if format != CameraFormat::Json {
                        // What was read can be written, but for what only the text can say.
                        let again = to_text(&cameras, format);
                        assert!(
                            again.is_ok() || matches!(again, Err(Error::Unsupported { .. } | Error::Camera { .. })),
                            "{again:?}"
                        );
                    }
                }
                Err(e) => {
                    refused += 1;
                    let place = e.to_string();
                    assert!(place.starts_with("file: ") || place.starts_with("not supported: file: "), "{place}");
                }
            }
        }
        let both =
            [&lenses, &images].map(|t| String::from_utf8_lossy(&mutated(t.as_bytes(), &mut random)).into_owned());
        for [lenses, images] in [[&both[0], &images], [&lenses, &both[1]]] {
            if let Ok(cameras) = colmap::from_text(lenses, images) {
                valid(&cameras);
            }
        }
    }
    assert!(read > fuzz_inputs() / 200 && refused > fuzz_inputs() / 200, "{read} {refused}");
}
