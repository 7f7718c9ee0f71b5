//! Clouds and meshes against other programs' readers and real scans.

#[path = "support/data.rs"]
mod data;
#[path = "support/python.rs"]
mod python;

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use nalgebra::Vector3;
use ptzcal::cloud::{Picture, RayGrid, SurfaceOptions, mesh_depth, texture, thin, transform, triangulate};
use ptzcal::format::{
    PcdData, read_pcd, read_ply, read_ply_mesh, write_glb, write_mesh, write_pcd, write_ply, write_ply_mesh,
};
use ptzcal::geometry::rigid::{exp, rotation_x, rotation_y};
use ptzcal::geometry::{Camera, CloudNoise, Distortion, Intrinsics, InverseDepthPoint, Mesh, PointCloud, Rigid};
use ptzcal::image::{Image, PixelFormat};

/// A slanted wall seen from the origin, red to the right, green down, with a picture on its left half.
fn mesh() -> Mesh {
    let points = (0..40 * 30).map(|i| {
        let [pan, tilt] = [f64::from(i % 40) - 19.5, f64::from(i / 40) - 14.5].map(|steps| 0.02 * steps);
        let direction = rotation_y(pan) * rotation_x(tilt) * Vector3::z();
        let rho = Vector3::new(0.05, -0.02, 0.3).dot(&direction);
        let point = InverseDepthPoint { origin: Vector3::zeros(), direction, rho, variance: 1e-6 };
        let place = point.point().unwrap();
        let colour = [128.0 + 80.0 * place.x, 128.0 + 80.0 * place.y, 30.0].map(|v| v as u8);
        Some(ptzcal::cloud::GridPoint { point, colour })
    });
    let grid = RayGrid::new(40, 30, points.collect()).unwrap();
    let mut mesh = triangulate(&grid, &SurfaceOptions::default()).unwrap();
    let camera = Camera {
        width: 160,
        height: 240,
        intrinsics: Intrinsics::new(280.0, 160.0, 119.5),
        distortion: Distortion::BrownConrady([-0.1, 0.02, 0.0, 0.0, 0.0]),
        pose: Rigid::identity(),
    };
    let mut image = Image::new(PixelFormat::Rgb24, 160, 240);
    for (i, pixel) in image.data.chunks_mut(3).enumerate() {
        pixel.copy_from_slice(&[(i % 160) as u8, (i / 160) as u8, 200]);
    }
    let covered = texture(&mut mesh, &[Picture { image: image.view().unwrap(), camera: &camera }]).unwrap();
    assert!(covered > 700 && covered < mesh.triangles.len() - 700, "{covered}");
    mesh
}

/// The mesh in numbers that a script reads.
fn write_truth(folder: &Path, mesh: &Mesh) {
    let rows = |list: Vec<String>| format!("[{}]", list.join(","));
    let xyz = mesh.vertices.positions.iter().map(|p| format!("[{},{},{}]", p.x, p.y, p.z)).collect();
    let faces = mesh.triangles.iter().map(|t| format!("{t:?}")).collect();
    let rgb = mesh.vertices.colours.iter().map(|c| format!("{c:?}")).collect();
    let truth = format!("{{\"xyz\": {}, \"faces\": {}, \"rgb\": {}}}", rows(xyz), rows(faces), rows(rgb));
    std::fs::write(folder.join("truth.json"), truth).unwrap();
}

/// What trimesh and pygltflib make of our files: see the script.
const SCRIPT: &str = r#"
import sys, json, numpy as np, trimesh, pygltflib
from pathlib import Path
folder = Path(sys.argv[1])
truth = json.loads((folder / "truth.json").read_text())
xyz, faces, rgb = np.array(truth["xyz"]), np.array(truth["faces"]), np.array(truth["rgb"])
up = xyz * [1, -1, -1]                      # glTF's frame: y up, z to the viewer

gltf = pygltflib.GLTF2().load(str(folder / "mesh.glb"))
assert gltf.asset.version == "2.0" and gltf.extensionsUsed == ["KHR_materials_unlit"]
for view in gltf.bufferViews:               # what the specification demands of alignment and extent
    assert view.byteOffset % 4 == 0 and view.byteOffset + view.byteLength <= gltf.buffers[0].byteLength
for accessor in gltf.accessors:
    view = gltf.bufferViews[accessor.bufferView]
    size = {5121: 1, 5123: 2, 5125: 4, 5126: 4}[accessor.componentType] * {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor.type]
    assert accessor.count * size == view.byteLength and size % 4 == 0

scene = trimesh.load(str(folder / "mesh.glb"), process=False)
found, textured = 0, 0
for name in scene.graph.nodes_geometry:
    transform, key = scene.graph[name]
    part = scene.geometry[key]
    at = trimesh.transform_points(part.vertices, transform)
    corners = at[part.faces]
    # Fronts: counter-clockwise from the origin, where the rig stood.
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((normals * corners[:, 0]).sum(axis=1) < 0).all()
    found += len(part.faces)
    distance = np.abs(at[:, None, :] - up[None, ::37, :]).max(axis=2).min(axis=0)
    assert distance.max() < 1e-5, distance.max()
    if part.visual.uv is not None:
        picture = np.asarray(part.visual.material.baseColorTexture)
        middle = part.visual.uv[part.faces].mean(axis=1)      # trimesh's v is up from the bottom
        column = middle[:, 0] * picture.shape[1] - 0.5
        row = (1 - middle[:, 1]) * picture.shape[0] - 0.5
        seen = picture[np.rint(row).astype(int), np.rint(column).astype(int)]
        # The picture is red to its right and green down: so is the wall, as the camera saw it.
        centre = corners.mean(axis=1)
        u, v = 280 * centre[:, 0] / -centre[:, 2] + 160, 280 * centre[:, 1] / centre[:, 2] + 119.5
        assert np.abs(seen[:, 0] - u).max() < 9 and np.abs(seen[:, 1] - v).max() < 9, (np.abs(seen[:, 0] - u).max(), np.abs(seen[:, 1] - v).max())
        textured += len(part.faces)
    else:
        linear = np.asarray(part.visual.vertex_attributes["color"])[:, :3] / 65535.0
        srgb = 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)
        nearest = np.abs(at[:, None, :] - up[None]).sum(axis=2).argmin(axis=1)
        assert np.abs(srgb - rgb[nearest]).max() < 0.6
assert found == len(faces) and 700 < textured < found, (found, textured)

for name, frame in (("mesh.ply", xyz), ("cloud.ply", xyz)):
    part = trimesh.load(str(folder / name), process=False)
    assert np.abs(part.vertices - frame).max() < 1e-5
    colours = part.visual.vertex_colors if name == "mesh.ply" else part.colors
    assert (np.asarray(colours)[:, :3] == rgb).all()
assert (trimesh.load(str(folder / "mesh.ply"), process=False).faces == faces).all()
print("agreed", found, textured)
"#;

#[test]
fn others_read_what_we_write() {
    let Some(python) = python::environment(
        "model-venv",
        &["numpy", "scipy", "pillow", "trimesh", "pygltflib"],
        "trimesh, pygltflib, PIL",
    ) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mesh = mesh();
    write_glb(&folder.path().join("mesh.glb"), &mesh).unwrap();
    write_ply_mesh(&folder.path().join("mesh.ply"), &mesh).unwrap();
    write_ply(&folder.path().join("cloud.ply"), &mesh.vertices).unwrap();
    write_truth(folder.path(), &mesh);
    let (success, text) =
        python::output(Command::new(python).args(["-c", SCRIPT]).arg(folder.path()), Duration::from_secs(120));
    assert!(success && text.contains("agreed"), "{text}");
}

/// VTK reads our VRML: the same triangles where the rig saw them (y up in VRML), on the pictures' places. Its
/// reader knows no PixelTexture and mistakes colours of vertices, so that both stay unread.
#[test]
fn vtk_reads_our_vrml() {
    let Some(python) = python::environment("vtk-venv", &["numpy", "vtk"], "vtk") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mesh = mesh();
    write_mesh(&folder.path().join("mesh.wrl"), &mesh).unwrap();
    write_truth(folder.path(), &mesh);
    let script = r#"
import sys, json, numpy as np, vtk
from pathlib import Path
from vtk.util.numpy_support import vtk_to_numpy
folder = Path(sys.argv[1])
truth = json.loads((folder / "truth.json").read_text())
xyz, faces = np.array(truth["xyz"]), np.array(truth["faces"])
importer = vtk.vtkVRMLImporter()
importer.SetFileName(str(folder / "mesh.wrl"))
importer.Update()
actors = importer.GetRenderer().GetActors()
actors.InitTraversal()
found, pictured = [], 0
for _ in range(actors.GetNumberOfItems()):
    actor = actors.GetNextActor()
    actor.GetMapper().Update()
    data = actor.GetMapper().GetInput()
    matrix = np.array([[actor.GetMatrix().GetElement(i, j) for j in range(4)] for i in range(4)])
    points = vtk_to_numpy(data.GetPoints().GetData()) @ matrix[:3, :3].T + matrix[:3, 3]
    triangles = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    found.append(points[triangles])
    places = data.GetPointData().GetTCoords()
    if places is not None:
        pictured += len(triangles)
        # The camera, without its lens: 280 px focal length, x right, y up; the picture is cut to what is used.
        used = np.unique(triangles)
        ideal = points[used, :2] / -points[used, 2:]
        alike = [np.corrcoef(ideal[:, k], vtk_to_numpy(places)[used, k])[0, 1] for k in range(2)]
        assert min(alike) > 0.999, alike
found = np.concatenate(found) * [1, -1, -1]
wanted = xyz[faces]
assert found.shape == wanted.shape, (found.shape, wanted.shape)
key = lambda corners: corners.mean(axis=1).round(4)
order = [np.lexsort(key(c).T) for c in (found, wanted)]
assert np.abs(found[order[0]].mean(axis=1) - wanted[order[1]].mean(axis=1)).max() < 1e-4
assert 700 < pictured < len(found)
print("agreed", len(found), pictured)
"#;
    let (success, text) =
        python::output(Command::new(python).args(["-c", script]).arg(folder.path()), Duration::from_secs(120));
    assert!(success && text.contains("agreed"), "{text}");
}

/// plyfile reads our clouds and meshes, with every property; what it writes again, as text and in both byte
/// orders, we read back.
#[test]
fn plyfile_reads_and_writes_the_same() {
    let Some(python) = python::environment("ply-venv", &["numpy", "plyfile"], "plyfile") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mesh = mesh();
    let cloud = PointCloud { noise: CloudNoise::Deviations(vec![0.25; mesh.vertices.len()]), ..mesh.vertices.clone() };
    write_ply(&folder.path().join("cloud.ply"), &cloud).unwrap();
    write_ply_mesh(&folder.path().join("mesh.ply"), &mesh).unwrap();
    let script = r#"
import sys
from pathlib import Path
from plyfile import PlyData
folder = Path(sys.argv[1])
for name in ("cloud", "mesh"):
    ply = PlyData.read(str(folder / f"{name}.ply"))
    ply.text = True
    ply.write(str(folder / f"{name}-text.ply"))
    for order, end in (("<", "little"), (">", "big")):
        ply.text, ply.byte_order = False, order
        ply.write(str(folder / f"{name}-{end}.ply"))
    print(name, len(ply["vertex"]), len(ply["face"]) if "face" in ply else 0)
"#;
    let (success, text) =
        python::output(Command::new(python).args(["-c", script]).arg(folder.path()), Duration::from_secs(60));
    let wanted = format!("cloud {0} 0\nmesh {0} {1}\n", cloud.len(), mesh.triangles.len());
    assert!(success && text == wanted, "{text}");
    // Ours is in floats already: nothing more is rounded.
    let [ours_cloud, ours_mesh] = ["cloud.ply", "mesh.ply"].map(|name| folder.path().join(name));
    for way in ["text", "little", "big"] {
        let theirs = |name: &str| folder.path().join(format!("{name}-{way}.ply"));
        assert!(read_ply(&theirs("cloud")).unwrap().cloud == read_ply(&ours_cloud).unwrap().cloud, "{way}");
        assert!(read_ply_mesh(&theirs("mesh")).unwrap() == read_ply_mesh(&ours_mesh).unwrap(), "{way}");
    }
}

/// Two real scans of a room, compressed by PCL: read, written in every way, registered, thinned.
#[test]
fn real_scans_are_read_and_written() {
    let Some(folder) = data::folder("cloud_pcl_room_scans") else { return };
    let scans = ["room_scan1.pcd", "room_scan2.pcd"].map(|name| read_pcd(&folder.join(name)).unwrap());
    assert_eq!([scans[0].cloud.len(), scans[1].cloud.len()], [112_586, 112_624]);
    assert_eq!([scans[0].skipped, scans[1].skipped], [0, 0]);
    // A room: metres, and not one point far away.
    assert!(scans[0].cloud.reach() > 5.0 && scans[0].cloud.reach() < 100.0, "{}", scans[0].cloud.reach());
    let own = tempfile::tempdir().unwrap();
    for data in [PcdData::Text, PcdData::Binary, PcdData::Compressed] {
        let path = own.path().join("scan.pcd");
        write_pcd(&path, &scans[0].cloud, data).unwrap();
        assert!(read_pcd(&path).unwrap().cloud == scans[0].cloud, "{data:?}");
    }
    let compressed = std::fs::metadata(own.path().join("scan.pcd")).unwrap().len();
    // The colours are one; the coordinates shrink as with PCL, to a half.
    let theirs = std::fs::metadata(folder.join("room_scan1.pcd")).unwrap().len();
    assert!(compressed < theirs * 11 / 10, "{compressed} {theirs}");

    let thinned = thin(&scans[0].cloud, 0.1).unwrap();
    assert!(thinned.len() > 5000 && thinned.len() < 60_000, "{}", thinned.len());
    // Thinning twice changes little: every voxel has its point.
    assert!(thin(&thinned, 0.1).unwrap() == thinned);
}

/// A cloud beside the one it was moved from, for the pose's covariance on real coordinates.
#[test]
fn a_move_and_its_inverse_are_nothing_on_real_points() {
    let Some(folder) = data::folder("cloud_pcl_room_scans") else { return };
    let cloud = read_pcd(&folder.join("room_scan2.pcd")).unwrap().cloud;
    let pose = Rigid { rotation: exp(&Vector3::new(0.0, 0.0, 0.7)), translation: Vector3::new(1.79387, 0.720047, 0.0) };
    let noise = CloudNoise::Deviations(vec![0.02; cloud.len()]);
    let mut moved = PointCloud { noise, ..cloud.clone() };
    let covariance = nalgebra::SMatrix::<f64, 6, 6>::identity() * 1e-6;
    transform(&mut moved, &pose, Some(&covariance)).unwrap();
    // Along the ray the pose's turn does nothing; across it grows with the distance.
    for i in (0..cloud.len()).step_by(997) {
        let r2 = cloud.positions[i].norm_squared();
        let wanted = (0.02f64.powi(2) + 3e-6 + 2e-6 * r2).sqrt();
        assert!((moved.noise.deviation(i).unwrap() - wanted).abs() < 1e-9);
    }
    transform(&mut moved, &pose.inverse(), None).unwrap();
    let off = moved.positions.iter().zip(&cloud.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(off < 1e-12, "{off}");
}

/// A file is written whole or not at all.
#[test]
fn a_failed_write_leaves_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = mesh();
    for name in ["mesh.glb", "mesh.wrl", "mesh.ply"] {
        let path = folder.path().join(name);
        write_mesh(&path, &mesh).unwrap();
        let old = std::fs::read(&path).unwrap();
        let bad = Mesh { triangles: vec![[0, 1, u32::MAX]], ..mesh.clone() };
        assert!(write_mesh(&path, &bad).is_err());
        assert_eq!(std::fs::read(&path).unwrap(), old, "{name}");
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3);
    assert!(mesh_depth(&mesh, &Camera { width: 0, ..camera() }).is_err());
}

fn camera() -> Camera {
    Camera {
        width: 64,
        height: 48,
        intrinsics: Intrinsics::new(40.0, 32.0, 24.0),
        distortion: Distortion::None,
        pose: Rigid::identity(),
    }
}
