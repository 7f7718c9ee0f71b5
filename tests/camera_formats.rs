//! Camera files against the software whose formats they are: OpenCV, COLMAP, mrcal read what we write and
//! project the same points to the same pixels to 1e-9; we read what they write. ROS's and Kalibr's files,
//! whose software pip does not have, are read by PyYAML and projected by OpenCV, whose models they use.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use nalgebra::{Vector2, Vector3};
use ptzcal::format::{CameraFormat, NamedCamera, read_cameras, write_cameras};
use ptzcal::geometry::rigid::exp;
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Rigid};

#[path = "support/python.rs"]
mod python;

/// Pixels; what double precision leaves of some thousand of them is a thousand times less.
const AGREEMENT: f64 = 1e-9;

fn camera(distortion: Distortion, turn: f64) -> Camera {
    Camera {
        width: 1280,
        height: 720,
        intrinsics: Intrinsics { fx: 845.19, fy: 2533.0 / 3.0, skew: 0.0, cx: 627.76, cy: 355.53 },
        distortion,
        pose: Rigid { rotation: exp(&Vector3::new(0.3, turn, 2.0)), translation: Vector3::new(0.1, -0.05, 1.0 / 3.0) },
    }
}

const FOUR: Distortion = Distortion::BrownConrady([-0.28, 0.09, 1e-3, -2e-4 / 3.0, 0.0]);
const FIVE: Distortion = Distortion::BrownConrady([-0.28, 0.09, 1e-3, -2e-4 / 3.0, -0.01]);
const DOME: Distortion = Distortion::Fisheye([-0.012, 0.02, -1e-2 / 3.0, 1e-3]);

/// Points that the camera sees, all over its image.
fn points(camera: &Camera) -> Vec<Vector3<f64>> {
    let grid = (0..63).map(|i| Vector2::new(20.0 + 155.0 * f64::from(i % 9), 15.0 + 113.0 * f64::from(i / 9)));
    grid.enumerate().map(|(i, pixel)| camera.back_project(&pixel).unwrap().at(2.0 + 0.3 * (i % 5) as f64)).collect()
}

/// The cameras of a file with points and our pixels of them, for the scripts.
fn truth(cameras: &[NamedCamera]) -> String {
    let row = |v: &[f64]| v.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(",");
    let mut text = String::from("[");
    for NamedCamera { name, camera, .. } in cameras {
        let points = points(camera);
        let xyz: Vec<f64> = points.iter().flat_map(|p| p.iter().copied()).collect();
        let uv: Vec<f64> =
            points.iter().flat_map(|p| camera.project(p).unwrap().iter().copied().collect::<Vec<_>>()).collect();
        let k = camera.intrinsics;
        let (r, t) = (camera.pose.rotation.transpose(), camera.pose.translation);
        let comma = if text.len() > 1 { "," } else { "" };
        write!(
            text,
            "{comma}{{\"name\": \"{name}\", \"f\": [{}], \"d\": [{}], \"R\": [{}], \"t\": [{}], \"xyz\": [{}], \"uv\": [{}]}}",
            row(&[k.fx, k.fy, k.cx, k.cy]),
            row(camera.distortion.coefficients()),
            row(r.as_slice()),
            row(t.as_slice()),
            row(&xyz),
            row(&uv),
        )
        .unwrap();
    }
    text + "]"
}

/// What the scripts share: the truth, and the comparison.
const BEGIN: &str = "
import json, sys, numpy as np
from pathlib import Path
folder = Path(sys.argv[1])
truth = json.loads((folder / 'truth.json').read_text())
for c in truth:
    for key, shape in dict(R=(3, 3), t=(3,), xyz=(-1, 3), uv=(-1, 2), f=(4,), d=(-1,)).items():
        c[key] = np.array(c[key]).reshape(shape)
worst = 0
def compare(what, uv, wanted):
    global worst
    off = np.abs(np.asarray(uv).reshape(-1, 2) - wanted).max()
    assert off < 1e-9, (what, off)
    worst = max(worst, off)
def K(c): return np.array([[c['f'][0], 0, c['f'][2]], [0, c['f'][1], c['f'][3]], [0, 0, 1.]])
";

/// Runs a script on a folder of files; the folder.
fn run(python: &Path, script: &str, folder: &Path) {
    let script = format!("{BEGIN}{script}\nprint('agreed to', worst, 'px')");
    let mut command = Command::new(python);
    let (success, text) = python::output(command.args(["-c", &script]).arg(folder), Duration::from_secs(120));
    assert!(success && text.contains("agreed"), "{text}");
    print!("{text}");
}

fn peers() -> Option<PathBuf> {
    python::environment(
        "camera-formats-venv",
        &["numpy", "opencv-python-headless", "pyyaml", "pycolmap"],
        "cv2, yaml, pycolmap",
    )
}

/// What a peer wrote is the camera that it was given: the same points at the same pixels.
fn same(path: &Path, format: CameraFormat, wanted: &[NamedCamera]) {
    let (told, found) = read_cameras(path, None).unwrap();
    assert_eq!((told, found.len()), (format, wanted.len()), "{}", path.display());
    for (found, wanted) in found.iter().zip(wanted) {
        let pose = if found.has_pose { found.camera.pose } else { wanted.camera.pose };
        let camera = Camera { pose, ..found.camera };
        for point in points(&wanted.camera) {
            let off = (camera.project(&point).unwrap() - wanted.camera.project(&point).unwrap()).norm();
            assert!(off < AGREEMENT, "{}: {off}", path.display());
        }
    }
}

#[test]
fn opencv_ros_and_kalibr() {
    let Some(python) = peers() else { return };
    let folder = tempfile::tempdir().unwrap();
    let cameras = [
        NamedCamera::new("none", camera(Distortion::None, -1.1)),
        NamedCamera::new("four", camera(FOUR, -1.1)),
        NamedCamera::new("five", camera(FIVE, 0.4)),
        NamedCamera::new("dome", camera(DOME, 0.4)),
    ];
    std::fs::write(folder.path().join("truth.json"), truth(&cameras)).unwrap();
    for named in &cameras {
        for (ending, format) in [
            ("yaml", CameraFormat::OpenCvYaml),
            ("xml", CameraFormat::OpenCvXml),
            ("json", CameraFormat::OpenCvJson),
            ("ros", CameraFormat::Ros),
        ] {
            write_cameras(
                &folder.path().join(format!("{}.{ending}", named.name)),
                std::slice::from_ref(named),
                Some(format),
            )
            .unwrap();
        }
    }
    let chain = [cameras[1].clone(), cameras[3].clone(), cameras[0].clone()];
    write_cameras(&folder.path().join("chain.kalibr"), &chain, Some(CameraFormat::Kalibr)).unwrap();
    let script = "
import cv2, yaml
def project(xyz, rotation, t, k, d, fisheye):
    rvec = cv2.Rodrigues(rotation)[0]
    if fisheye:
        return cv2.fisheye.projectPoints(xyz[:, None], rvec, t, k, d)[0]
    return cv2.projectPoints(xyz, rvec, t, k, d)[0]
for c in truth:
    for ending in ('yaml', 'xml', 'json'):
        f = cv2.FileStorage(str(folder / f\"{c['name']}.{ending}\"), cv2.FILE_STORAGE_READ)
        node = lambda key: f.getNode(key).mat()
        assert (f.getNode('image_width').real(), f.getNode('image_height').real()) == (1280, 720)
        fisheye = f.getNode('fisheye_model').real() if not f.getNode('fisheye_model').empty() else 0
        assert bool(fisheye) == (c['name'] == 'dome')
        uv = project(c['xyz'], node('rotation_matrix'), node('translation_vector'), node('camera_matrix'), node('distortion_coefficients'), fisheye)
        compare((c['name'], ending), uv, c['uv'])
        w = cv2.FileStorage(str(folder / f\"theirs-{c['name']}.{ending}\"), cv2.FILE_STORAGE_WRITE)
        w.write('calibration_time', 'Thu 01 Jan 2015 # \"noon\"')
        w.write('image_width', 1280)
        w.write('image_height', 720)
        w.write('flags', 0)
        if fisheye:
            w.write('fisheye_model', 1)
        w.write('camera_matrix', K(c))
        w.write('distortion_coefficients', c['d'].reshape(-1, 1) if len(c['d']) else np.zeros((5, 1)))
        w.write('per_view_reprojection_errors', np.array([[.1, .2]], np.float32))
        w.write('grid_points', np.zeros((4, 1, 3), np.float32))
        w.release()
    ros = yaml.safe_load((folder / f\"{c['name']}.ros\").read_text())
    array = lambda key: np.array(ros[key]['data'], float).reshape(ros[key]['rows'], ros[key]['cols'])
    assert ros['camera_name'] == c['name'] and (array('rectification_matrix') == np.eye(3)).all()
    assert (array('projection_matrix') == np.column_stack([array('camera_matrix'), np.zeros(3)])).all()
    assert ros['distortion_model'] == ('equidistant' if c['name'] == 'dome' else 'plumb_bob')
    uv = project(c['xyz'], c['R'], c['t'], array('camera_matrix'), array('distortion_coefficients').ravel(), c['name'] == 'dome')
    compare((c['name'], 'ros'), uv, c['uv'])
    (folder / f\"theirs-{c['name']}.ros\").write_text(yaml.safe_dump(ros))

chain = yaml.safe_load((folder / 'chain.kalibr').read_text())
by_name = {c['name']: c for c in truth}
world = None
for i, name in enumerate(('four', 'dome', 'none')):
    c, cam = by_name[name], chain[f'cam{i}']
    here = np.eye(4)
    here[:3, :3], here[:3, 3] = c['R'], c['t']
    first = here if world is None else first
    world = np.eye(4) if world is None else np.array(cam['T_cn_cnm1']) @ world
    fx, fy, cx, cy = cam['intrinsics']
    assert cam['rostopic'] == name and cam['resolution'] == [1280, 720] and cam['camera_model'] == 'pinhole'
    d = np.array(cam['distortion_coeffs'] or [0.0] * 4)
    pose = world @ first
    uv = project(c['xyz'], pose[:3, :3], pose[:3, 3], np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), d, cam['distortion_model'] == 'equidistant')
    compare((name, 'kalibr'), uv, c['uv'])
(folder / 'theirs.kalibr').write_text(yaml.safe_dump(chain))
";
    run(&python, script, folder.path());
    for named in &cameras {
        for (ending, format) in [
            ("yaml", CameraFormat::OpenCvYaml),
            ("xml", CameraFormat::OpenCvXml),
            ("json", CameraFormat::OpenCvJson),
            ("ros", CameraFormat::Ros),
        ] {
            same(&folder.path().join(format!("theirs-{}.{ending}", named.name)), format, std::slice::from_ref(named));
        }
    }
    // PyYAML writes keys in another order and lists in blocks.
    let (_, ours) = read_cameras(&folder.path().join("chain.kalibr"), None).unwrap();
    assert_eq!(read_cameras(&folder.path().join("theirs.kalibr"), None).unwrap(), (CameraFormat::Kalibr, ours));
}

#[test]
fn colmap() {
    let Some(python) = peers() else { return };
    let folder = tempfile::tempdir().unwrap();
    let cameras: Vec<NamedCamera> = [Distortion::None, FOUR, FIVE, DOME, Distortion::Division(-0.2)]
        .into_iter()
        .enumerate()
        .map(|(i, lens)| NamedCamera::new(format!("yard/{i}.png"), camera(lens, 0.4 * i as f64)))
        .collect();
    std::fs::write(folder.path().join("truth.json"), truth(&cameras)).unwrap();
    write_cameras(&folder.path().join("ours"), &cameras, Some(CameraFormat::Colmap)).unwrap();
    let script = "
import pycolmap
model = pycolmap.Reconstruction(str(folder / 'ours'))
assert len(model.cameras) == len(model.images) == len(truth)
images = {image.name: image for image in model.images.values()}
for c in truth:
    image = images[c['name']]
    pose = image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world
    inside = np.array([pose * x for x in c['xyz']])
    camera = model.cameras[image.camera_id]
    uv = np.array([camera.img_from_cam(x) for x in inside])
    # COLMAP's (0.5, 0.5) is the centre of the first pixel.
    compare((c['name'], camera.model.name), uv - 0.5, c['uv'])
(folder / 'theirs').mkdir()
model.write_text(str(folder / 'theirs'))
";
    run(&python, script, folder.path());
    let theirs = folder.path().join("theirs");
    let (_, mut found) = read_cameras(&theirs, None).unwrap();
    found.sort_by(|a, b| a.name.cmp(&b.name));
    for (found, wanted) in found.iter().zip(&cameras) {
        assert_eq!(found.name, wanted.name);
        for point in points(&wanted.camera) {
            let off = (found.camera.project(&point).unwrap() - wanted.camera.project(&point).unwrap()).norm();
            assert!(off < AGREEMENT, "{}: {off}", found.name);
        }
    }
    assert_eq!(found.len(), cameras.len());
}

/// mrcal is a package of Debian and Ubuntu (python3-mrcal), for the system's own Python.
#[test]
fn mrcal() {
    let candidates = [python::system_python(), "/usr/bin/python3".into()];
    let has = |p: &PathBuf| python::output(Command::new(p).args(["-c", "import mrcal"]), Duration::from_secs(60)).0;
    let Some(python) = candidates.into_iter().find(has) else {
        let _ = writeln!(std::io::stderr(), "SKIPPED: no python3 has mrcal (python3-mrcal)");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let cameras = [
        NamedCamera::new("none", camera(Distortion::None, -1.1)),
        NamedCamera::new("four", camera(FOUR, -1.1)),
        NamedCamera::new("five", camera(FIVE, 0.4)),
    ];
    std::fs::write(folder.path().join("truth.json"), truth(&cameras)).unwrap();
    for named in &cameras {
        let path = folder.path().join(&named.name).with_extension("cameramodel");
        write_cameras(&path, std::slice::from_ref(named), None).unwrap();
    }
    let script = "
import mrcal
for c in truth:
    model = mrcal.cameramodel(str(folder / f\"{c['name']}.cameramodel\"))
    assert list(model.imagersize()) == [1280, 720]
    inside = mrcal.transform_point_rt(model.extrinsics_rt_fromref(), c['xyz'])
    compare(c['name'], mrcal.project(inside, *model.intrinsics()), c['uv'])
    lens = {0: 'LENSMODEL_PINHOLE', 5: 'LENSMODEL_OPENCV8' if c['name'] == 'four' else 'LENSMODEL_OPENCV5'}[len(c['d'])]
    d = np.concatenate([c['d'], np.zeros(3)]) if lens.endswith('8') else c['d']
    rt = np.concatenate([mrcal.r_from_R(c['R']), c['t']])
    theirs = mrcal.cameramodel(intrinsics=(lens, np.concatenate([c['f'], d])), imagersize=[1280, 720], extrinsics_rt_fromref=rt)
    path = str(folder / f\"theirs-{c['name']}.cameramodel\")
    theirs.write(path)
    # It writes ten digits: the pixels are those of what it reads again.
    theirs = mrcal.cameramodel(path)
    inside = mrcal.transform_point_rt(theirs.extrinsics_rt_fromref(), c['xyz'])
    np.savetxt(folder / f\"theirs-{c['name']}.txt\", mrcal.project(inside, *theirs.intrinsics()), fmt='%.17g')
";
    run(&python, script, folder.path());
    for named in &cameras {
        let path = folder.path().join(format!("theirs-{}.cameramodel", named.name));
        let (format, found) = read_cameras(&path, None).unwrap();
        assert!(format == CameraFormat::Mrcal && found[0].has_pose);
        let pixels = std::fs::read_to_string(path.with_extension("txt")).unwrap();
        let pixels = pixels.lines().map(|line| {
            let numbers: Vec<f64> = line.split_whitespace().map(|v| v.parse().unwrap()).collect();
            Vector2::from_column_slice(&numbers)
        });
        let points = points(&named.camera);
        assert_eq!(pixels.clone().count(), points.len());
        for (point, pixel) in points.iter().zip(pixels) {
            let off = (found[0].camera.project(point).unwrap() - pixel).norm();
            assert!(off < AGREEMENT, "{}: {off}", named.name);
        }
    }
}
