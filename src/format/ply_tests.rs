use super::super::model_tests::{cloud, mesh};
use super::*;
use crate::error::Status;
use crate::fuzz::{Random, fuzz_inputs, mutated};
use nalgebra::Vector3;

fn mesh_bytes() -> Vec<u8> {
    let (mesh, mut bytes) = (mesh(), Vec::new());
    write_to(&mut bytes, &mesh.vertices, Some(&mesh.triangles)).unwrap();
    bytes
}

#[test]
fn normals_covariances_and_faces_come_back() {
    assert_eq!(from_ply(&to_ply(&cloud()).unwrap(), "cloud").unwrap(), CloudFile { cloud: cloud(), skipped: 0 });
    let found = mesh_from_ply(&mesh_bytes(), "mesh").unwrap();
    assert_eq!(found, Mesh { textures: vec![], ..mesh() });
    // The faces of a mesh are passed over for its points.
    assert_eq!(from_ply(&mesh_bytes(), "mesh").unwrap().cloud, cloud());
}

const TEXT: &str = "ply\nformat ascii 1.0\ncomment by hand\nelement camera 1\nproperty float f\n\
    property list uchar int names\nelement vertex 4\nproperty list uchar float quality\nproperty float y\n\
    property double x\nproperty float z\nproperty float red\nproperty float green\nproperty float blue\n\
    element face 2\nproperty uchar flags\nproperty list uchar uint vertex_index\nend_header\n\
    500.5 2 1 -2\n2 0.1 0.2 -0.5 1e-1 3 1 0.5 0\n0 0 0 0 0 0 0\n1 9 1 2 3 0 0 1\n0 4 5 6 1 1 1\n\
    0 4 0 1 2 3\n7 3 3 2 1";

#[test]
fn text_with_lists_is_read() {
    let mesh = mesh_from_ply(TEXT.as_bytes(), "text").unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 1]]);
    assert_eq!(mesh.vertices.positions[0], Vector3::new(0.1, -0.5, 3.0));
    assert_eq!(mesh.vertices.colours, [[255, 128, 0], [0; 3], [0, 0, 255], [255; 3]]);
    let refused = |from: &str, to: &str| {
        assert!(TEXT.contains(from), "{from}");
        mesh_from_ply(TEXT.replacen(from, to, 1).as_bytes(), "text").unwrap_err().status()
    };
    for (from, to) in [
        ("7 3 3 2 1", "7 3 3 2"),
        ("7 3 3 2 1", "7 3 3 2 1 1"),
        ("7 3 3 2 1", "7 3 3 2 4"),
        ("7 3 3 2 1", "7 3 3 2 0.5"),
        ("7 3 3 2 1", "7 -3 3 2 1"),
        ("1e-1", "1e-1x"),
        ("1e-1", "nan"),
        ("vertex 4", "vertex 5"),
        ("vertex 4", "vertex 100000000"),
        ("vertex 4", "vertex 49999999"),
        ("face 2", "face 18446744073709551615"),
        ("property uchar flags", "property list uchar flags"),
        ("comment by hand", "property float x"),
        ("500.5", &"5".repeat(2000)),
    ] {
        assert_eq!(refused(from, to), Status::FileFormat, "{from} -> {to}");
    }
    assert_eq!(refused("ascii 1.0", "ascii 2.0"), Status::Unsupported);
    // Points that are marked as not measured are no reason to lose the others.
    let nan = from_ply(TEXT.replacen("1e-1", "nan", 1).as_bytes(), "text").unwrap();
    assert_eq!((nan.cloud.len(), nan.skipped), (3, 1));
}

/// Records that most files have are read without asking for each number's type: the same as one by one.
#[test]
fn common_records_are_read_as_others() {
    let other = |bytes: &[u8]| {
        // A property more makes them unusual: read one number after the other.
        let start = bytes.windows(11).position(|w| w == b"end_header\n").unwrap();
        let header = String::from_utf8(bytes[..start].to_vec()).unwrap();
        let records = &bytes[start + 11..];
        let count: usize = header.split("vertex ").nth(1).unwrap().lines().next().unwrap().parse().unwrap();
        let mut all = format!("{header}property float {DEVIATION}\nend_header\n").into_bytes();
        for record in records.chunks(records.len() / count) {
            all.extend(record);
            all.extend(0.0f32.to_le_bytes());
        }
        from_ply(&all, "other").unwrap()
    };
    let at = |i: usize| Vector3::new(i as f64 * 0.25, -1.0 - i as f64, (i % 7) as f64);
    for far in [0.0, 5000.0] {
        let positions: Vec<_> = (0..20_000).map(|i| at(i % 500) + Vector3::repeat(far)).collect();
        let colours = (0..positions.len()).map(|i| [i as u8, (i / 3) as u8, 255]).collect();
        let cloud = PointCloud { positions, colours, ..Default::default() };
        let mut bytes = to_ply(&cloud).unwrap();
        assert_eq!(from_ply(&bytes, "common").unwrap(), CloudFile { cloud: cloud.clone(), skipped: 0 });
        assert_eq!(other(&bytes).cloud.positions, cloud.positions);
        // Two points without a place, in one of the chunks.
        let (stride, size) = if far > 0.0 { (27, 8) } else { (15, 4) };
        let first = bytes.len() - 20_000 * stride;
        for (record, value) in [(12_345, f64::NAN), (12_350, f64::NEG_INFINITY)] {
            let place = first + record * stride + size;
            let (float, double) = ((value as f32).to_le_bytes(), value.to_le_bytes());
            bytes[place..place + size].copy_from_slice(if size == 4 { &float } else { &double });
        }
        let found = from_ply(&bytes, "holes").unwrap();
        assert!(found.skipped == 2 && found.cloud.len() == 19_998);
        assert_eq!(found.cloud.positions[12_345], cloud.positions[12_346]);
        let other = other(&bytes);
        assert_eq!((&found.cloud.positions, &found.cloud.colours), (&other.cloud.positions, &other.cloud.colours));
        assert_eq!(from_ply(&bytes[..bytes.len() - 1], "short").unwrap_err().status(), Status::FileFormat);
        bytes.push(0);
        assert_eq!(from_ply(&bytes, "long").unwrap_err().status(), Status::FileFormat);
    }
}

#[test]
fn big_endian_is_read() {
    let own = to_ply(&PointCloud { normals: None, noise: CloudNoise::Unknown, ..cloud() }).unwrap();
    let start = own.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let mut other = String::from_utf8(own[..start].to_vec()).unwrap().replace("little", "big").into_bytes();
    for record in own[start..].chunks(15) {
        record[..12].chunks(4).for_each(|v| other.extend(v.iter().rev()));
        other.extend(&record[12..]);
    }
    assert_eq!(from_ply(&other, "big").unwrap().cloud.positions, cloud().positions);
}

/// A header of a few bytes is found out before memory is taken for what it promises.
#[test]
fn a_hundred_million_points_are_refused() {
    let lie = |count: u64| {
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        )
    };
    for count in [100_000_000, u64::MAX / 12, u64::MAX] {
        assert_eq!(from_ply(lie(count).as_bytes(), "lie").unwrap_err().status(), Status::FileFormat);
    }
    // One that does have them, of nothing but zeros.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.ply");
    std::fs::write(&path, lie(100_000_000)).unwrap();
    let length = lie(100_000_000).len() as u64 + 1_200_000_000;
    std::fs::File::options().write(true).open(&path).unwrap().set_len(length).unwrap();
    let e = read_ply(&path).unwrap_err();
    assert!(e.status() == Status::Unsupported && e.to_string().contains("50000000"), "{e}");
    assert_eq!(read_ply(folder.path()).unwrap_err().status(), Status::FileIo);
}

#[test]
fn fuzz_ply() {
    let mut random = Random(1);
    let good = [to_ply(&cloud()).unwrap(), mesh_bytes(), TEXT.as_bytes().to_vec()];
    for i in 0..fuzz_inputs() {
        let bad = mutated(&good[i as usize % 3], &mut random);
        if let Ok(mesh) = mesh_from_ply(&bad, "mesh") {
            mesh.validate().unwrap();
        }
        if let Ok(file) = from_ply(&bad, "cloud") {
            file.cloud.validate().unwrap();
        }
    }
}

#[test]
#[ignore = "a measurement; run it in release"]
fn measure_a_million() {
    let folder = tempfile::tempdir().unwrap();
    let n = 1_000_000;
    let at = |i: usize| Vector3::new(i as f64 * 1e-3, (i % 1000) as f64 * 1e-2, 3.0);
    let cloud = PointCloud { positions: (0..n).map(at).collect(), colours: vec![[1, 2, 3]; n], ..Default::default() };
    let covariances = CloudNoise::Covariances(vec![[1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4]; n]);
    for cloud in [&cloud, &PointCloud { noise: covariances, ..cloud.clone() }] {
        for ending in ["ply", "pcd", "glb", "wrl"] {
            let path = folder.path().join(format!("cloud.{ending}"));
            let begun = std::time::Instant::now();
            super::super::write_cloud(&path, cloud).unwrap();
            let written = begun.elapsed().as_secs_f64();
            let found = super::super::read_cloud(&path).unwrap();
            assert_eq!(found.cloud.len(), n);
            println!(
                "{ending}: write {:.0} ms, read {:.0} ms, {} MB",
                written * 1e3,
                (begun.elapsed().as_secs_f64() - written) * 1e3,
                std::fs::metadata(&path).unwrap().len() / 1_000_000
            );
        }
    }
}
