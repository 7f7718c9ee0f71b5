use super::super::model_tests::{cloud, mesh, same};
use super::*;
use crate::error::{Error, Status};
use crate::fuzz::{Random, fuzz_inputs, mutated};
use crate::geometry::{CloudNoise, Mesh, PointCloud};
use nalgebra::Vector3;
use serde_json::Value;

#[test]
fn what_is_written_is_read() {
    for noise in [CloudNoise::Unknown, CloudNoise::Deviations(vec![0.5, 0.25, 0.0, 1.0, 2.0]), mesh().vertices.noise] {
        let mut mesh = mesh();
        mesh.vertices.noise = noise;
        same(&from_glb(&to_glb(&mesh).unwrap(), "mesh").unwrap(), &mesh, 1e-6);
        let plain = Mesh { textures: vec![], ..mesh.clone() };
        assert_eq!(from_glb(&to_glb(&plain).unwrap(), "mesh").unwrap(), plain);
        let cloud = Mesh::from(mesh.vertices);
        assert_eq!(from_glb(&to_glb(&cloud).unwrap(), "cloud").unwrap(), cloud);
    }
    assert_eq!(from_glb(&to_glb(&Mesh::default()).unwrap(), "none").unwrap(), Mesh::default());
    // Every colour survives linear light.
    let colours: Vec<[u8; 3]> = (0..=255).map(|v| [v, 255 - v, v / 2]).collect();
    let cloud = PointCloud { positions: vec![Vector3::x(); 256], colours, ..Default::default() };
    assert_eq!(from_glb(&to_glb(&cloud.clone().into()).unwrap(), "colours").unwrap().vertices, cloud);
    // Map coordinates.
    let mut far = super::super::model_tests::cloud();
    far.positions.iter_mut().for_each(|p| *p += Vector3::new(487_523.0, 102.0, 4_287_654.0));
    let back = from_glb(&to_glb(&far.clone().into()).unwrap(), "far").unwrap().vertices;
    assert!(back.positions.iter().zip(&far.positions).all(|(a, b)| (a - b).amax() < 1e-4));
}

fn json(bytes: &[u8]) -> Value {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

/// A file with another JSON.
fn with_json(bytes: &[u8], change: &dyn Fn(&mut Value)) -> Vec<u8> {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut json = json(bytes);
    change(&mut json);
    let mut text = serde_json::to_vec(&json).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    let rest = &bytes[20 + length..];
    let total = (20 + text.len() + rest.len()) as u32;
    let head = [&bytes[..8], &total.to_le_bytes(), &(text.len() as u32).to_le_bytes(), &bytes[16..20]].concat();
    [head, text, rest.to_vec()].concat()
}

/// By glTF's own frame: y up, the viewer at +z.
#[test]
fn the_file_stands_upright() {
    let bytes = to_glb(&mesh()).unwrap();
    let json = json(&bytes);
    assert_eq!(json["nodes"][0]["rotation"], serde_json::json!([1.0, 0.0, 0.0, 0.0]));
    // Another's file without the turn: its up is our -y, its back is our forward.
    let turned = with_json(&bytes, &|j| drop(j["nodes"][0].as_object_mut().unwrap().remove("rotation")));
    let (own, other) = (mesh().vertices.positions, from_glb(&turned, "mesh").unwrap().vertices.positions);
    assert!(own.iter().zip(&other).all(|(a, b)| (Vector3::new(a.x, -a.y, -a.z) - b).norm() < 1e-6));
    // The bounds that glTF demands are those of the data.
    let positions = &json["accessors"][0];
    assert_eq!((positions["min"][0].as_f64(), positions["max"][2].as_f64()), (Some(-0.5), Some(2.0)));
}

#[test]
fn node_transforms_are_applied() {
    let bytes = to_glb(&Mesh { textures: vec![], ..mesh() }).unwrap();
    let own = mesh();
    let scaled = with_json(&bytes, &|j| {
        j["nodes"] = serde_json::json!([
            {"children": [1], "matrix": [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 1, -2, -3, 1]},
            {"mesh": 0, "scale": [-2, 2, 2], "translation": [0.5, 0, 0]},
        ]);
    });
    let found = from_glb(&scaled, "mesh").unwrap();
    for (a, b) in own.vertices.positions.iter().zip(&found.vertices.positions) {
        assert!((Vector3::new(-2.0 * a.x + 1.5, 2.0 * a.y + 2.0, 2.0 * a.z + 3.0) - b).norm() < 1e-6);
    }
    // A mirror image has its fronts turned.
    assert_eq!(found.triangles[0], [own.triangles[0][0], own.triangles[0][2], own.triangles[0][1]]);
    let (a, b) = (own.vertices.noise.covariance(1).unwrap(), found.vertices.noise.covariance(1).unwrap());
    assert!((b.m11 - 4.0 * a.m11).abs() < 1e-9 && (b.m12 + 4.0 * a.m12).abs() < 1e-9);
}

#[test]
fn lies_are_refused() {
    let bytes = to_glb(&mesh()).unwrap();
    for length in 0..bytes.len() {
        assert_eq!(from_glb(&bytes[..length], "mesh").unwrap_err().status(), Status::FileFormat, "{length}");
    }
    let refused = |change: &dyn Fn(&mut Value)| from_glb(&with_json(&bytes, change), "mesh").unwrap_err().status();
    for (list, key, value) in [
        ("accessors", "count", serde_json::json!(100_000_000)),
        ("accessors", "count", serde_json::json!(-1)),
        ("accessors", "count", serde_json::json!(u64::MAX)),
        ("accessors", "byteOffset", serde_json::json!(1u64 << 40)),
        ("accessors", "componentType", serde_json::json!(5124)),
        ("bufferViews", "byteLength", serde_json::json!(u64::MAX)),
        ("bufferViews", "byteStride", serde_json::json!(1)),
        ("nodes", "mesh", serde_json::json!(7)),
        ("nodes", "children", serde_json::json!([0])),
        ("nodes", "rotation", serde_json::json!([5, 0, 0, 0])),
        ("images", "bufferView", serde_json::json!(0)),
        ("asset", "version", serde_json::json!("1.0")),
    ] {
        let status = refused(&|j| {
            let item = if list == "asset" { &mut j[list] } else { &mut j[list][0] };
            item[key] = value.clone();
        });
        assert_eq!(status, Status::FileFormat, "{list} {key} {value}");
    }
    assert_eq!(
        refused(&|j| j["extensionsRequired"] = serde_json::json!(["KHR_draco_mesh_compression"])),
        Status::Unsupported
    );
    assert_eq!(refused(&|j| j["buffers"][0]["uri"] = "data.bin".into()), Status::Unsupported);
    assert_eq!(refused(&|j| j["accessors"][0]["sparse"] = serde_json::json!({})), Status::Unsupported);
    let old = [&bytes[..4], &1u32.to_le_bytes(), &bytes[8..]].concat();
    assert!(matches!(from_glb(&old, "mesh").unwrap_err(), Error::FileVersion { found: 1, .. }));
    let bad = Mesh { triangles: vec![[0, 1, 9]], ..mesh() };
    assert!(to_glb(&bad).is_err());
}

#[test]
fn fuzz_glb() {
    let mut random = Random(2);
    let good = [to_glb(&mesh()).unwrap(), to_glb(&cloud().into()).unwrap()];
    // One takes some ten times as long as a packet.
    for i in 0..fuzz_inputs() / 10 {
        if let Ok(mesh) = from_glb(&mutated(&good[i as usize % 2], &mut random), "mesh") {
            mesh.validate().unwrap();
        }
    }
}
