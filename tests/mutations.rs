//! Files with bytes changed, lost or doubled: read or refused with words, in little memory.
//!
//! The changes are random but the same on every run. One process reads all the variants of a file,
//! so that a reader that panics, hangs or takes too much memory ends the test.

use crate::support::{Workplace, packed, root};
use scantle::numeric::rng::Rng;
use std::fs;

/// Variants of each file.
const VARIANTS: u64 = 250;
/// Kibibytes of address space for the process: some 20 MB are its code and its threads' stacks.
const ADDRESS_SPACE: u32 = 128 * 1024;

/// A file, and the words after `scantle` that make it, if it is no fixture.
const MADE: &[(&str, &str)] = &[
    ("a.obj", "convert fixtures/shapes/cube.ply -o a.obj"),
    ("b.obj", "convert fixtures/shapes/polyline.obj -o b.obj"),
    ("a.ply", "convert fixtures/shapes/cube.obj -o a.ply"),
    ("b.ply", "convert fixtures/shapes/points.ply -o b.ply"),
    ("a.stl", "convert fixtures/shapes/cube.obj -o a.stl"),
    ("a.off", "convert fixtures/shapes/open-box.obj -o a.off"),
    ("a.glb", "convert fixtures/shapes/open-box.obj -o a.glb"),
    (
        "a.nrrd",
        "voxelize fixtures/shapes/cube.obj --resolution 5 -o a.nrrd",
    ),
    (
        "a.mha",
        "voxelize fixtures/shapes/cube.obj --resolution 5 -o a.mha",
    ),
    (
        "a.mhd",
        "voxelize fixtures/shapes/cube.obj --resolution 5 -o a.mhd",
    ),
    (
        "a.nii",
        "voxelize fixtures/shapes/cube.obj --resolution 5 -o a.nii",
    ),
    (
        "b.nii",
        "convert fixtures/volumes/nibabel-qform.nii -o b.nii",
    ),
    (
        "a.vti",
        "voxelize fixtures/shapes/cube.obj --resolution 5 -o a.vti",
    ),
    (
        "a.npy",
        "voxelize fixtures/shapes/cube.obj --resolution 5 -o a.npy",
    ),
    (
        "a.binvox",
        "voxelize fixtures/shapes/cube.obj --resolution 5 -o a.binvox",
    ),
    (
        "a.svo",
        "voxelize fixtures/shapes/torus.obj --resolution 70 -o a.svo",
    ),
    (
        "b.svo",
        "voxelize fixtures/shapes/torus.obj --resolution 40 --fill winding -o b.svo",
    ),
    ("a.png", "convert fixtures/images/pattern.png -o a.png"),
    ("b.png", "convert fixtures/images/ramp16.png -o b.png"),
    ("a.pdb", "convert fixtures/molecules/helix.cif -o a.pdb"),
    ("a.cif", "convert fixtures/molecules/helix.pdb -o a.cif"),
    ("a.xyzr", "convert fixtures/molecules/ring.csv -o a.xyzr"),
    ("a.csv", "convert fixtures/molecules/ring.xyzr -o a.csv"),
    ("a.pc2", "convert fixtures/animations/wave.mdd -o a.pc2"),
    ("a.mdd", "convert fixtures/animations/wave.pc2 -o a.mdd"),
    ("a.pcd", "convert fixtures/clouds/hills.ply -o a.pcd"),
    ("a.las", "convert fixtures/clouds/hills.ply -o a.las"),
    ("a.laz", "convert fixtures/clouds/hills.ply -o a.laz"),
    ("b.laz", "convert fixtures/shapes/points.ply -o b.laz"),
    ("a.xyz", "convert fixtures/clouds/hills.ply -o a.xyz"),
    (
        "a.points-csv",
        "convert fixtures/clouds/hills.ply -o a.points-csv --output-format points-csv",
    ),
    (
        "a.splats",
        "convert fixtures/clouds/splats.ply -o a.splats --output-format splats",
    ),
    (
        "a.gaussians",
        "convert fixtures/clouds/splats.ply -o a.gaussians --output-format gaussians",
    ),
    (
        "a.geotiff",
        "convert fixtures/terrain/hills.asc -o a.geotiff --output-format geotiff",
    ),
    (
        "b.geotiff",
        "convert fixtures/terrain/gdal-tiled-lzw.tif -o b.geotiff --output-format geotiff",
    ),
    (
        "a.ascii-grid",
        "convert fixtures/terrain/hills.tif -o a.ascii-grid --output-format ascii-grid",
    ),
    (
        "a.geojson",
        "convert fixtures/vectors/parcels.shp -o a.geojson",
    ),
];

/// Files that are read but not written like this.
const WRITTEN: &[(&str, &str)] = &[
    (
        "text.ply",
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face 2\nproperty list uchar int vertex_indices\nend_header\n\
         0 0 0 255 0 0\n1 0 0 0 255 0\n1 1 0 0 0 255\n0 1 0 1 2 3\n3 0 1 2\n4 0 1 2 3\n",
    ),
    (
        "text.stl",
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
         endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\n\
         vertex 0 1 0\nendloop\nendfacet\nendsolid s\n",
    ),
    (
        "text.gltf",
        r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"mesh":0,"translation":[1,2,3],"children":[1]},{"mesh":0,"scale":[2,2,2]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
        {"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":3}],
        "buffers":[{"byteLength":39,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAEC"}]}"#,
    ),
    (
        "text.pqr",
        "REMARK   1 PQR\nATOM      1  N   GLY A   1       0.000   0.000   0.000  0.2943 1.8240\n\
         ATOM      2  CA  GLY A   1       1.450   0.000   0.000 -0.0100 1.9080\nTER\n\
         HETATM    3 ZN   ZN      2       5.000   0.000   0.000  2.0000 1.1000\nEND\n",
    ),
    (
        "text.wkt-csv",
        "wkt,name\n\"LINESTRING(0 0, 1 1)\",a\n\"POLYGON((0 0, 4 0, 4 4, 0 0), (1 1, 2 1, 2 2, 1 1))\",b\n\
         \"MULTIPOINT((1 2), 3 4)\",\n",
    ),
    (
        "text.gpx",
        "<gpx version=\"1.1\"><wpt lat=\"47.5\" lon=\"8\"><name>Hut</name></wpt><trk><trkseg>\
         <trkpt lat=\"1\" lon=\"2\"/><trkpt lat=\"3\" lon=\"4\"><ele>5</ele></trkpt></trkseg></trk></gpx>",
    ),
    (
        "text.json",
        "{\"schema\": 1, \"scantle\": \"0.1.0\", \"command\": \"info\", \"input\": [\n\
         {\"path\": \"a/\\u00e9.obj\", \"bytes\": 394}], \"warnings\": [],\n\
         \"result\": {\"area\": -6.25e-3, \"closed\": true, \"at\": null}}\n{\"b\": [[1], 2]}\n",
    ),
    (
        "text.pcd",
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z normal_x normal_y \
         normal_z rgb label\nSIZE 4 4 8 4 4 4 4 2\nTYPE F F F F F F U U\nCOUNT 1 1 1 1 1 1 1 2\n\
         WIDTH 2\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA ascii\n\
         0 0 0 0 0 1 16711935 1 2\n1 0 0.5 0 0 1 255 1 2\n0 1 -2e3 0 0.6 0.8 0 1 2\n1 1 7 1 0 0 9 1 2\n",
    ),
    (
        "text.nrrd",
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 3 2\nencoding: ascii\n\
         space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n\
         space origin: (0,0,0)\n\n1 2 3 4 5 6 7 8 9 10 11 12\n",
    ),
    (
        "text.mha",
        "ObjectType = Image\nNDims = 3\nBinaryData = False\nOffset = 0 0 0\n\
         ElementSpacing = 1 1 1\nDimSize = 2 3 2\nElementType = MET_SHORT\n\
         ElementDataFile = LOCAL\n1 2 3 4 5 6 7 8 9 10 11 12\n",
    ),
];

/// Files that are read but not written like this, as they lie from `fixtures/volumes/`.
const FIXTURES: &[&str] = &[
    "nibabel-qform.nii",
    "nibabel-sform.nii.gz",
    "vtk-inline-zlib.vti",
    "vtk-base64.vti",
    "vtk-raw-zlib.vti",
    "../clouds/packed.pcd",
];

/// Values that have broken readers: the ends of ranges, and numbers that are none.
const WORDS: &[&[u8]] = &[
    &[0xff; 8],
    &[0x00; 8],
    &[0xff, 0xff, 0xff, 0x7f],
    &[0, 0, 0, 0x80],
    &[0, 0, 0xc0, 0x7f],
    b"4294967296",
    b"-1",
    b"1e999",
    b"nan",
    b"99999999999999999999",
    b"\n",
    b" ",
];

/// Variant `index` of a file: one to three changes.
fn variant(bytes: &[u8], seed: u64, index: u64) -> Vec<u8> {
    let mut rng = Rng::new(seed, index);
    let mut bytes = bytes.to_vec();
    for _ in 0..1 + rng.below(3) {
        let at = rng.below(bytes.len().max(1));
        let length = rng.below(16).min(bytes.len() - at);
        match rng.below(7) {
            0 => bytes.truncate(at),
            1 | 2 if at < bytes.len() => bytes[at] ^= 1 << rng.below(8),
            3 if at < bytes.len() => bytes[at] = rng.bits() as u8,
            4 => drop(bytes.drain(at..at + length)),
            5 => {
                let doubled = bytes[at..at + length].to_vec();
                bytes.splice(at..at, doubled);
            }
            _ => {
                let word = WORDS[rng.below(WORDS.len())];
                let end = (at + word.len()).min(bytes.len());
                bytes.splice(at..end, word.iter().copied());
            }
        }
    }
    bytes
}

/// Makes the checksums of a PNG right again, or most changes are seen by nothing else.
fn set_checksums(png: &mut [u8]) {
    let mut at = 8;
    while let Some(head) = png.get(at..at + 4) {
        let length = u32::from_be_bytes(head.try_into().expect("four bytes")) as usize;
        let end = at + 8 + length;
        let Some(body) = png.get(at + 4..end) else {
            return;
        };
        let mut sum = flate2::Crc::new();
        sum.update(body);
        let Some(place) = png.get_mut(end..end + 4) else {
            return;
        };
        place.copy_from_slice(&sum.sum().to_be_bytes());
        at = end + 4;
    }
}

/// Reads the variants of a file in one process; returns how many were read and how many refused.
fn read_variants(place: &Workplace, name: &str, bytes: &[u8], seed: u64) -> [usize; 2] {
    let (stem, extension) = name.split_once('.').expect("an extension");
    let format = match extension.trim_end_matches(".gz") {
        "csv" => "spheres-csv",
        format => format,
    };
    for index in 0..VARIANTS {
        let name = format!("{stem}-{index:03}-.{extension}");
        let mut changed = variant(bytes, seed, index);
        if format == "png" && index % 2 == 0 {
            set_checksums(&mut changed);
        }
        place.put(&name, changed);
    }
    let ran = place.shell(&format!(
        "ulimit -v {ADDRESS_SPACE}; MALLOC_ARENA_MAX=1 scantle info {stem}-???-.{extension} \
         --input-format {format} --quiet --threads 1 --report report.jsonl"
    ));
    assert!(
        [0, 3].contains(&ran.code),
        "{name}: {} {}",
        ran.code,
        ran.stderr
    );
    let report = fs::read_to_string(place.path("report.jsonl")).unwrap_or_default();
    let complaints = ran
        .stderr
        .lines()
        .filter(|line| line.starts_with("scantle: "));
    let counts = [report.lines().count(), complaints.count()];
    assert_eq!(
        counts[0] + counts[1],
        VARIANTS as usize,
        "{name}: {}",
        ran.stderr
    );
    counts
}

#[test]
fn damaged_files_are_read_or_refused() {
    let place = Workplace::new();
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    for (name, line) in MADE {
        let ran = place.run(line);
        assert_eq!(ran.code, 0, "{line}: {}", ran.stderr);
        files.push((
            name.to_string(),
            fs::read(place.path(name)).expect("a file"),
        ));
    }
    files.extend(
        WRITTEN
            .iter()
            .map(|(name, text)| (name.to_string(), text.as_bytes().to_vec())),
    );
    files.push(("packed.off.gz".to_owned(), packed(&files[5].1)));
    for name in FIXTURES {
        let path = root().join("fixtures/volumes").join(name);
        let name = name.trim_start_matches("../clouds/").to_owned();
        files.push((name, fs::read(path).expect("a fixture")));
    }
    let mut total = [0; 2];
    for (seed, (name, bytes)) in (0..).zip(&files) {
        place.put(&format!("whole-{name}"), bytes);
        let ran = place.run(&format!("info whole-{name}"));
        assert_eq!(ran.code, 0, "{name}: {}", ran.stderr);
        let [read, refused] = read_variants(&place, name, bytes, seed);
        total = [total[0] + read, total[1] + refused];
    }
    // Both happen often, or the changes are too small or too large to find anything.
    assert!(total.iter().all(|count| *count > 500), "{total:?}");
}
