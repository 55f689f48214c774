use super::*;
use crate::error::Fault;
use crate::numeric::vector::{Vec3, length, sub};
use proptest::prelude::*;

fn parse(bytes: &[u8]) -> Result<(Mesh, Vec<Warning>), Fault> {
    let source = Source::from_bytes("a.glb", bytes.to_vec()).unwrap();
    let mut warnings = Vec::new();
    let mesh = read(&source, &mut warnings).map_err(Refusal::fault)?;
    mesh.check()?;
    Ok((mesh, warnings))
}

/// A GLB of a document (its asset is added) and a binary chunk.
pub fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = format!("{{\"asset\":{{\"version\":\"2.0\"}},{json}}}").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 28 + json.len() + binary.len();
    let mut bytes = b"glTF".to_vec();
    for word in [2, total as u32, json.len() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// Five points in a row of zigzag: (0,0), (0,1), (1,0), (1,1), (2,0).
const ZIGZAG: [f32; 15] = [
    0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 2.0, 0.0, 0.0,
];

/// A document with one accessor of positions, the zigzag, and what else is given.
fn zigzag(rest: &str) -> Vec<u8> {
    let json = format!(
        "\"buffers\":[{{\"byteLength\":60}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":60}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":5,\"type\":\"VEC3\"}}],\
         {rest}"
    );
    glb(&json, &floats(&ZIGZAG))
}

fn in_mode(mode: u32) -> (Mesh, Vec<Warning>) {
    let rest = format!(
        "\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"mode\":{mode}}}]}}]"
    );
    parse(&zigzag(&rest)).unwrap()
}

#[test]
fn every_mode_gives_its_elements() {
    assert_eq!(in_mode(0).0.points, [0, 1, 2, 3, 4]);
    assert_eq!(in_mode(1).0.segments, [[0, 1], [2, 3]]);
    assert_eq!(in_mode(1).1[0].code, "incomplete-primitives");
    assert_eq!(
        in_mode(2).0.segments,
        [[0, 1], [1, 2], [2, 3], [3, 4], [4, 0]]
    );
    assert_eq!(in_mode(3).0.segments, [[0, 1], [1, 2], [2, 3], [3, 4]]);
    assert_eq!(in_mode(4).0.triangles, [[0, 1, 2]]);
    assert_eq!(in_mode(4).1[0].count, 2);
    assert_eq!(in_mode(5).0.triangles, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    assert_eq!(in_mode(6).0.triangles, [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
}

#[test]
fn nodes_place_their_meshes_and_mirrors_keep_the_outside() {
    let rest = "\"scene\":1,\"scenes\":[{\"nodes\":[]},{\"nodes\":[0,3]}],\
        \"nodes\":[{\"children\":[1,2],\"translation\":[10,0,0],\"rotation\":[0,0,0.7071067811865476,0.7071067811865476]},\
          {\"mesh\":0,\"scale\":[2,2,-2]},\
          {\"mesh\":0,\"matrix\":[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1]},\
          {\"mesh\":0},{\"mesh\":0}],\
        \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":0},\"mode\":4}]}]";
    let (mesh, _) = parse(&zigzag(rest)).unwrap();
    assert_eq!(mesh.positions.len(), 15);
    assert_eq!(mesh.triangles, [[0, 2, 1], [5, 6, 7], [10, 11, 12]]);
    let near = |a: Vec3, b: Vec3| assert!(length(sub(a, b)) < 1e-15 * 20.0, "{a:?} {b:?}");
    // x turns to y: (1, 1, 0) doubled goes to (-2, 2, 0), then by 10 along x.
    near(mesh.positions[3], [8.0, 2.0, 0.0]);
    near(mesh.positions[8], [9.0, 1.0, 5.0]);
    assert_eq!(mesh.positions[13], [1.0, 1.0, 0.0]);
    let normals = mesh.normals.unwrap();
    near(normals[2], [0.0, 1.0, 0.0]);
    assert_eq!(normals[10], [0.0; 3]);
}

#[test]
fn normals_turn_by_the_inverse_transpose() {
    let rest = "\"nodes\":[{\"mesh\":0,\"scale\":[1,4,1]}],\
        \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":0},\"mode\":0}]}]";
    let (mesh, _) = parse(&zigzag(rest)).unwrap();
    // The normal (1, 1, 0) of a plane x + y = c, which becomes x + y / 4 = c.
    let wanted = [4.0 / 17f64.sqrt(), 1.0 / 17f64.sqrt(), 0.0];
    assert!(length(sub(mesh.normals.unwrap()[3], wanted)) < 1e-15);
}

#[test]
fn primitives_that_share_accessors_share_vertices_and_attributes_some_lack_are_dropped() {
    let rest = "\"nodes\":[{\"mesh\":0,\"skin\":0,\"extensions\":{\"EXT_mesh_gpu_instancing\":{}}}],\
        \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"mode\":0,\"targets\":[{\"POSITION\":0}]},\
          {\"attributes\":{\"POSITION\":0,\"NORMAL\":0,\"COLOR_0\":0},\"mode\":3},{\"attributes\":{}}]}]";
    let (mesh, warnings) = parse(&zigzag(rest)).unwrap();
    assert_eq!(mesh.positions.len(), 5);
    assert_eq!((mesh.points.len(), mesh.segments.len()), (5, 4));
    assert!(mesh.normals.is_none() && mesh.colors.is_none());
    let codes: Vec<_> = warnings.iter().map(|w| w.code.as_str()).collect();
    let wanted = [
        "ignored-skins",
        "ignored-instancing",
        "ignored-morph-targets",
        "primitives-without-positions",
        "dropped-normals",
        "dropped-colours",
    ];
    assert_eq!(codes, wanted);
}

#[test]
fn quantised_strided_and_sparse_accessors_are_decoded() {
    // Positions as normalised 16-bit numbers, 8 bytes apart; colours as bytes; two sparse positions.
    let mut binary = Vec::new();
    for p in [[32767i16, -32768, 0], [-32767, 0, 32767], [0, 0, 0]] {
        binary.extend(p.iter().chain(&[99]).flat_map(|c| c.to_le_bytes()));
    }
    binary.extend([255, 0, 51, 0, 0, 255, 102, 0, 10, 20, 30, 0]);
    binary.extend([1, 2, 0, 0]); // sparse places
    for p in [[7i16, 8, 9], [10, 11, 12]] {
        binary.extend(p.iter().flat_map(|c| c.to_le_bytes()));
    }
    let json = "\"extensionsUsed\":[\"KHR_mesh_quantization\"],\"extensionsRequired\":[\"KHR_mesh_quantization\"],\
        \"buffers\":[{\"byteLength\":52}],\
        \"bufferViews\":[{\"buffer\":0,\"byteLength\":24,\"byteStride\":8},{\"buffer\":0,\"byteOffset\":24,\"byteLength\":12,\"byteStride\":4},\
          {\"buffer\":0,\"byteOffset\":36,\"byteLength\":4},{\"buffer\":0,\"byteOffset\":40,\"byteLength\":12}],\
        \"accessors\":[{\"bufferView\":0,\"componentType\":5122,\"normalized\":true,\"count\":3,\"type\":\"VEC3\"},\
          {\"bufferView\":1,\"componentType\":5121,\"normalized\":true,\"count\":3,\"type\":\"VEC3\"},\
          {\"componentType\":5122,\"count\":3,\"type\":\"VEC3\",\"sparse\":{\"count\":2,\
            \"indices\":{\"bufferView\":2,\"componentType\":5121},\"values\":{\"bufferView\":3}}}],\
        \"nodes\":[{\"mesh\":0}],\
        \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"COLOR_0\":1}},{\"attributes\":{\"POSITION\":2,\"COLOR_0\":1}}]}]";
    let (mesh, _) = parse(&glb(json, &binary)).unwrap();
    let wanted: [Vec3; 6] = [
        [1.0, -1.0, 0.0],
        [-1.0, 0.0, 1.0],
        [0.0; 3],
        [0.0; 3],
        [7.0, 8.0, 9.0],
        [10.0, 11.0, 12.0],
    ];
    assert_eq!(mesh.positions, wanted);
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(mesh.colors.unwrap()[0], [1.0, 0.0, 0.2, 1.0]);
}

#[test]
fn buffers_come_from_uris_and_from_files_beside() {
    let text = |uri: &str| {
        format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},\"buffers\":[{{\"byteLength\":12,\"uri\":\"{uri}\"}}],\
             \"bufferViews\":[{{\"buffer\":0,\"byteLength\":12}}],\
             \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":1,\"type\":\"VEC3\"}}],\
             \"nodes\":[{{\"mesh\":0}}],\
             \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"mode\":0}}]}}]}}"
        )
    };
    let inside = text("data:application/octet-stream;base64,AACAPwAAAEAAAEBA");
    assert_eq!(
        parse(inside.as_bytes()).unwrap().0.positions,
        [[1.0, 2.0, 3.0]]
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a b.bin"), floats(&[1.0, 2.0, 3.0])).unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, text("a%20b.bin")).unwrap();
    let source = Source::open(path.to_str().unwrap(), u64::MAX).unwrap();
    assert_eq!(
        read(&source, &mut Vec::new()).unwrap().positions,
        [[1.0, 2.0, 3.0]]
    );
}

#[test]
fn a_deep_tree_is_walked_without_recursion() {
    let depth = 100_000;
    let nodes: Vec<String> = (1..depth)
        .map(|child| format!("{{\"children\":[{child}],\"translation\":[1,0,0]}}"))
        .collect();
    let rest = format!(
        "\"nodes\":[{},{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"mode\":0}}]}}]",
        nodes.join(",")
    );
    let (mesh, _) = parse(&zigzag(&rest)).unwrap();
    assert_eq!(mesh.positions[0], [f64::from(depth - 1), 0.0, 0.0]);
}

#[test]
fn instances_over_the_limit_are_refused_before_they_are_made() {
    let nodes = vec!["{\"mesh\":0}"; 1000].join(",");
    let rest = format!(
        "\"nodes\":[{nodes}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"mode\":0}}]}}]"
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, zigzag(&rest)).unwrap();
    let open = |limit| Source::open(path.to_str().unwrap(), limit).unwrap();
    let refusal = read(&open(100_000), &mut Vec::new()).unwrap_err();
    let over = |needed| (100_000..1_000_000).contains(&needed);
    assert!(
        matches!(&refusal, Refusal::OverMemory { needed, limit: 100_000, .. } if over(*needed)),
        "{refusal:?}"
    );
    assert_eq!(
        read(&open(1_000_000), &mut Vec::new())
            .unwrap()
            .positions
            .len(),
        5000
    );
}

/// Meshes of single-precision coordinates, with everything the format holds.
fn meshes() -> impl Strategy<Value = Mesh> {
    let point = || prop::array::uniform3(-1e6f32..1e6f32);
    let index = 0u32..1000;
    (
        prop::collection::vec(point(), 1..40),
        prop::collection::vec(prop::array::uniform3(index.clone()), 0..20),
        prop::collection::vec(prop::array::uniform2(index.clone()), 0..9),
        prop::collection::vec(index, 1..9),
        any::<bool>(),
        any::<bool>(),
    )
        .prop_map(|(points, triangles, segments, singles, normals, colors)| {
            let n = points.len() as u32;
            let positions: Vec<Vec3> = points.iter().map(|p| p.map(f64::from)).collect();
            let unit = |p: &Vec3| crate::numeric::vector::normalize(*p);
            Mesh {
                normals: normals.then(|| positions.iter().map(unit).collect()),
                colors: colors.then(|| {
                    points
                        .iter()
                        .map(|p| [p[0].abs(), 0.5, 1.0, 0.25])
                        .collect()
                }),
                positions,
                triangles: triangles.into_iter().map(|t| t.map(|v| v % n)).collect(),
                segments: segments.into_iter().map(|s| s.map(|v| v % n)).collect(),
                points: singles.into_iter().map(|v| v % n).collect(),
                polygons: None,
                sides: None,
                classes: None,
            }
        })
}

fn written(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(mesh, &mut bytes).unwrap();
    bytes
}

proptest! {
    #[test]
    fn what_is_written_comes_back(mesh in meshes()) {
        let bytes = written(&mesh);
        prop_assert_eq!(bytes.len() % 4, 0);
        let (mut back, warnings) = parse(&bytes).unwrap();
        prop_assert!(warnings.is_empty());
        let (found, wanted) = (back.normals.take(), mesh.normals.clone());
        prop_assert_eq!(found.is_some(), wanted.is_some());
        for (a, b) in found.unwrap_or_default().iter().zip(wanted.unwrap_or_default()) {
            prop_assert!(length(sub(*a, b)) < 1e-7);
        }
        prop_assert_eq!(back, Mesh { normals: None, ..mesh });
    }

    /// The crate `gltf` checks files against the specification before it opens them.
    #[test]
    fn another_reader_takes_what_is_written(mesh in meshes()) {
        let file = gltf::Gltf::from_slice(&written(&mesh)).unwrap();
        let blob = file.blob.as_deref().unwrap();
        let primitives: Vec<_> = file.meshes().flat_map(|m| m.primitives()).collect();
        let wanted = [!mesh.triangles.is_empty(), !mesh.segments.is_empty(), true];
        prop_assert_eq!(primitives.len(), wanted.iter().filter(|w| **w).count());
        for primitive in primitives {
            let reader = primitive.reader(|_| Some(blob));
            let positions: Vec<_> = reader.read_positions().unwrap().map(|p| p.map(f64::from)).collect();
            prop_assert_eq!(&positions, &mesh.positions);
            let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            let stored = match primitive.mode() {
                gltf::mesh::Mode::Triangles => mesh.triangles.as_flattened(),
                gltf::mesh::Mode::Lines => mesh.segments.as_flattened(),
                _ => &mesh.points,
            };
            prop_assert_eq!(indices, stored);
            prop_assert_eq!(reader.read_normals().is_some(), mesh.normals.is_some());
            if let Some(colors) = &mesh.colors {
                let found: Vec<_> = reader.read_colors(0).unwrap().into_rgba_f32().collect();
                prop_assert_eq!(&found, colors);
            }
        }
    }

    #[test]
    fn any_bytes_are_read_or_refused(
        changes in prop::collection::vec((0usize..2000, any::<u8>()), 1..4),
        cut in 0usize..50,
    ) {
        let rest = "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"children\":[1]},{\"mesh\":0}],\
            \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":0},\"mode\":4}]}]";
        let mut bytes = zigzag(rest);
        let length = bytes.len();
        for (at, byte) in changes {
            bytes[at % length] = byte;
        }
        bytes.truncate(length - cut / 2);
        let _ = parse(&bytes);
    }
}

#[test]
fn far_meshes_keep_their_shape() {
    let corner = [1e9 + 0.123, -3e8 + 0.4, 0.7];
    let positions: Vec<Vec3> = (0..4)
        .map(|i| std::array::from_fn(|a| corner[a] + if a == i { 0.001 } else { 0.0 }))
        .collect();
    let mesh = Mesh::from_triangles(positions.clone(), vec![[0, 1, 2], [0, 2, 3]]);
    let (back, _) = parse(&written(&mesh)).unwrap();
    for (a, b) in back.positions.iter().zip(positions) {
        // Two units in the last place of a double at 1e9; a float there has steps of 64.
        assert!(length(sub(*a, b)) < 2.5e-7, "{a:?} {b:?}");
    }
}

#[test]
fn what_glb_cannot_hold_is_said() {
    let mesh = Mesh::from_triangles(vec![[0.0; 3], [1e300, 0.0, 0.0]], vec![[0, 1, 1]]);
    let error = write(&mesh, &mut Vec::new()).unwrap_err();
    assert!(error.to_string().contains("vertex 1 at"), "{error}");
    let loose = Mesh {
        positions: vec![[1.0; 3]],
        ..Mesh::default()
    };
    assert!(parse(&written(&loose)).unwrap().0.positions.is_empty());
}
