use super::super::model_tests::{cloud, mesh, same};
use super::*;
use crate::error::{Error, Status};
use crate::fuzz::{Random, fuzz_inputs, mutated};
use crate::geometry::{CloudNoise, Mesh, PointCloud};
use nalgebra::Vector3;

/// What VRML holds of it.
fn bare(mesh: Mesh) -> Mesh {
    Mesh { vertices: PointCloud { normals: None, noise: CloudNoise::Unknown, ..mesh.vertices }, ..mesh }
}

#[test]
fn what_is_written_is_read() {
    // Half a turn twice is the identity but for the rounding of sin(pi).
    let near = |found: Mesh, wanted: &Mesh| {
        let off = found.vertices.positions.iter().zip(&wanted.vertices.positions).map(|(a, b)| (a - b).amax());
        assert!(off.fold(0.0, f64::max) < 1e-7);
        let vertices = PointCloud { positions: wanted.vertices.positions.clone(), ..found.vertices };
        same(&Mesh { vertices, ..found }, wanted, 1e-5);
    };
    let mut whole = bare(mesh());
    near(
        from_vrml(&to_vrml(&Mesh { textures: vec![], ..whole.clone() }).unwrap(), "mesh").unwrap(),
        &Mesh { textures: vec![], ..whole.clone() },
    );
    near(from_vrml(&to_vrml(&whole).unwrap(), "mesh").unwrap(), &whole);
    let points = bare(cloud().into());
    near(from_vrml(&to_vrml(&points).unwrap(), "cloud").unwrap(), &points);
    assert_eq!(from_vrml(&to_vrml(&Mesh::default()).unwrap(), "none").unwrap(), Mesh::default());
    whole.textures[0].triangles = vec![0, 1];
    whole.vertices.colours = vec![[255; 3]; 5];
    // All covered: the vertices' colours are in no shape.
    near(from_vrml(&to_vrml(&whole).unwrap(), "mesh").unwrap(), &whole);
}

#[test]
fn files_of_others_are_read() {
    let text = "#VRML V2.0 utf8\nWorldInfo { title \"a \\\" b # no comment\" info [ \"x\" ] }\n\
        NavigationInfo { type [ \"EXAMINE\" ] headlight TRUE }\n\
        Transform { translation 1 2, 3 scale 2 2 2 children [\n\
          DEF S Shape { appearance Appearance { material Material { diffuseColor 1 0 0 } }\n\
            geometry IndexedFaceSet { ccw FALSE coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] }\n\
              coordIndex [ 0, 1, 2, 3, -1 ] } }\n\
          Group { children USE S } ] }\nROUTE A.b TO C.d\nShape { geometry Box { size 1 1 1 } }\n";
    let mesh = from_vrml(text.as_bytes(), "mesh").unwrap();
    assert_eq!(mesh.triangles, [[0, 2, 1], [0, 3, 2], [0, 2, 1], [0, 3, 2]]);
    assert_eq!(mesh.vertices.positions[2], Vector3::new(3.0, -4.0, -3.0));
    assert_eq!((mesh.vertices.len(), mesh.vertices.colours[0]), (4, [255; 3]));
}

#[test]
fn lies_are_refused() {
    let bytes = to_vrml(&mesh()).unwrap();
    let text = String::from_utf8(bytes.clone()).unwrap();
    // Before the first node it is a file without any.
    for length in (0..15).chain(text.find("Transform {").unwrap() + 1..bytes.len() - 2) {
        assert_eq!(from_vrml(&bytes[..length], "mesh").unwrap_err().status(), Status::FileFormat, "{length}");
    }
    let refused = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        from_vrml(text.replacen(from, to, 1).as_bytes(), "mesh").unwrap_err().status()
    };
    for (from, to) in [
        ("#VRML V2.0", "#VRML V1.0"),
        ("0 3 1 -1", "0 3 5 -1"),
        ("0 3 1 -1", "0 3 -2 -1"),
        ("0 3 1 -1", "0 3 1e400 -1"),
        ("USE POINTS", "USE OTHER"),
        ("image 8 4 3", "image 8 5 3"),
        ("image 8 4 3", "image 65537 65537 3"),
        ("image 8 4 3", "image 8 4 9"),
        ("rotation 1 0 0", "rotation 1 0"),
        ("-0.5000000", "nan"),
        ("Transform {", "PROTO {"),
    ] {
        assert_eq!(refused(from, to), Status::FileFormat, "{from} -> {to}");
    }
    assert_eq!(refused("color [\n1.0000", "color [\n"), Status::Unsupported);
    // Nodes in nodes: by nesting, by USE, and doubled at each step.
    let deep = format!("#VRML V2.0 utf8\n{}", "Group { children ".repeat(100_000));
    let chain: String = (1..10_000).map(|i| format!("DEF N{i} Group {{ children USE N{} }}\n", i - 1)).collect();
    let chain = format!("#VRML V2.0 utf8\nDEF N0 Group {{ }}\n{chain}");
    let doubled: String =
        (1..60).map(|i| format!("DEF N{i} Group {{ children [ USE N{0} USE N{0} ] }}\n", i - 1)).collect();
    let doubled = format!("#VRML V2.0 utf8\nDEF N0 Group {{ }}\n{doubled}");
    assert_eq!(from_vrml(deep.as_bytes(), "deep").unwrap_err().status(), Status::FileFormat);
    assert_eq!(from_vrml(chain.as_bytes(), "chain").unwrap_err().status(), Status::FileFormat);
    assert!(matches!(from_vrml(doubled.as_bytes(), "doubled"), Err(Error::Unsupported { .. })));
    assert!(to_vrml(&Mesh { triangles: vec![[0, 1, 9]], ..mesh() }).is_err());
}

#[test]
fn fuzz_vrml() {
    let mut random = Random(4);
    let good = [to_vrml(&mesh()).unwrap(), to_vrml(&cloud().into()).unwrap()];
    // One takes some ten times as long as a packet.
    for i in 0..fuzz_inputs() / 10 {
        if let Ok(mesh) = from_vrml(&mutated(&good[i as usize % 2], &mut random), "mesh") {
            mesh.validate().unwrap();
        }
    }
}
