//! Fixtures of animations are what the formulas make, and are read as what they are.
//!
//! `UPDATE_FIXTURES=1 cargo test animations` writes them anew, but for streams, which stay as they were
//! written first: they hold the readers to the format. One that is not there is made.

use crate::support::{Workplace, files_below, root, updating};
use scantle::anim::Clip;
use scantle::anim::compress::container::{self, Kind};
use scantle::anim::compress::stream::Header;
use scantle::anim::compress::{Encoder, Ground, Params, Target, summary};
use scantle::error::Result;
use scantle::io::format::Format;
use scantle::io::sink::Sink;
use scantle::io::source::Source;
use scantle::io::{self, sequence};
use scantle::measure::animation_error::animation_error;
use scantle::mesh::{Mesh, shapes};
use scantle::progress::Silent;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// Frames of the wave.
const FRAMES: usize = 12;

/// A wave that runs along a sheet; coordinates are multiples of 2^-10, so every format holds them.
fn wave(frames: usize) -> Clip {
    let mesh = shapes::sheet(2.0, 1.0, 8, 4);
    let at = |f: usize| {
        let turn = f as f64 / FRAMES as f64;
        let raised = mesh.positions.iter().map(move |[x, y, _]| {
            let z = 0.125 * (std::f64::consts::TAU * (x - turn)).sin();
            [*x, *y, (z * 1024.0).round() / 1024.0]
        });
        raised.collect::<Vec<_>>()
    };
    let positions: Vec<_> = (0..frames).flat_map(at).collect();
    let first = positions[..mesh.positions.len()].to_vec();
    Clip {
        mesh: Mesh {
            positions: first,
            normals: None,
            ..mesh
        },
        positions,
        start: 0.0,
        rate: 24.0,
    }
}

/// The wave at rest.
fn still() -> Clip {
    let clip = wave(1);
    Clip {
        positions: clip.positions.repeat(3),
        ..clip
    }
}

fn bytes_of(clip: &Clip, format: Format) -> Vec<u8> {
    let place = Workplace::new();
    let path = place.path("a");
    io::write_animation(clip, &Sink::File(path.clone()), format).expect("a file");
    fs::read(path).expect("the file")
}

/// A cache with some bytes changed.
fn broken(format: Format, change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut clip = wave(3);
    clip.mesh.positions.truncate(4);
    clip.positions.truncate(12);
    let mut bytes = bytes_of(&clip, format);
    change(&mut bytes);
    bytes
}

/// A float in place of another.
fn put(bytes: &mut [u8], at: usize, word: [u8; 4]) {
    bytes[at..at + 4].copy_from_slice(&word);
}

type Row = (&'static str, fn() -> Vec<u8>);

/// Files whose bytes follow from the formula alone.
const FILES: &[Row] = &[
    ("animations/wave.pc2", || {
        bytes_of(&wave(FRAMES), Format::Pc2)
    }),
    ("animations/wave.mdd", || {
        bytes_of(&wave(FRAMES), Format::Mdd)
    }),
    ("animations/wave-morph.glb", || {
        bytes_of(&wave(FRAMES), Format::Glb)
    }),
    ("animations/one-frame.pc2", || {
        bytes_of(&wave(1), Format::Pc2)
    }),
    ("animations/resting.glb", resting),
    ("animations/static.pc2", || bytes_of(&still(), Format::Pc2)),
    ("malformed/pc2-nan.pc2", || {
        // Frame 2, vertex 1, y.
        broken(Format::Pc2, |b| {
            put(b, 32 + 12 * 9 + 4, f32::NAN.to_le_bytes());
        })
    }),
    ("malformed/pc2-short.pc2", || {
        broken(Format::Pc2, |b| b.truncate(32 + 12 * 7 + 5))
    }),
    ("malformed/pc2-header.pc2", || {
        broken(Format::Pc2, |b| b.truncate(20))
    }),
    ("malformed/pc2-version.pc2", || {
        broken(Format::Pc2, |b| put(b, 12, 2i32.to_le_bytes()))
    }),
    ("malformed/pc2-points.pc2", || {
        broken(Format::Pc2, |b| put(b, 16, (-4i32).to_le_bytes()))
    }),
    ("malformed/pc2-huge.pc2", || {
        broken(Format::Pc2, |b| {
            put(b, 16, i32::MAX.to_le_bytes());
            put(b, 28, i32::MAX.to_le_bytes());
        })
    }),
    ("malformed/pc2-not.pc2", || b"POINTCACHE1\0".to_vec()),
    ("malformed/mdd-infinite.mdd", || {
        // Frame 1, vertex 3, z.
        broken(Format::Mdd, |b| {
            put(b, 8 + 12 + 12 * 7 + 8, f32::INFINITY.to_be_bytes());
        })
    }),
    ("malformed/mdd-short.mdd", || {
        broken(Format::Mdd, |b| b.truncate(8 + 12 + 12 * 5))
    }),
    ("malformed/mdd-header.mdd", || {
        broken(Format::Mdd, |b| b.truncate(7))
    }),
    ("malformed/mdd-frames.mdd", || {
        broken(Format::Mdd, |b| put(b, 0, 0i32.to_be_bytes()))
    }),
    ("malformed/mdd-huge.mdd", || {
        broken(Format::Mdd, |b| put(b, 0, i32::MAX.to_be_bytes()))
    }),
];

/// A stream: its file, the clip that it is of, and what it was made to.
type Streamed = (&'static str, fn() -> Clip, Target);

/// Streams: what each is of, and the error that it was made to.
const STREAMS: &[Streamed] = &[
    ("animations/wave.sanim", || wave(FRAMES), Target::Kg(0.1)),
    ("animations/bar.sanim", sampled_bar, Target::Max(0.001)),
];

/// The bar at thirty frames a second.
fn sampled_bar() -> Clip {
    let source = open("animations/bar-skin.glb");
    let read = io::read_gltf_clip(&source, None, 30.0, None);
    read.expect("an animation").0
}

fn stream_of(clip: &Clip, target: Target) -> Vec<u8> {
    let params = Params {
        target,
        ..Params::DEFAULT
    };
    let ground = Ground::new(&clip.mesh).expect("a mesh");
    let encoder = Encoder::new(clip, &ground, &params, &Silent).expect("a clip");
    let made = encoder.make(target, &Silent);
    made.expect("an error that can be reached").bytes
}

/// The stream of the wave.
fn stream() -> Vec<u8> {
    fs::read(fixture("animations/wave.sanim")).expect("a fixture")
}

/// The stream with a byte in the middle of the first payload of a kind turned over.
fn flipped(kind: Kind) -> Vec<u8> {
    let mut bytes = stream();
    let (from, section) = find(&bytes, kind);
    // Four bytes of checksum stand behind the payload.
    bytes[from + section.1 - 4 - section.0 / 2] ^= 0x10;
    bytes
}

/// Where the first section of a kind begins, the length of its payload, and its own.
fn find(bytes: &[u8], kind: Kind) -> (usize, (usize, usize)) {
    let sections = container::parse(bytes).expect("a stream").list;
    let at = sections.iter().position(|section| section.kind == kind);
    let at = at.expect("a section of this kind");
    let before: usize = sections[..at].iter().map(|section| section.whole).sum();
    let lengths = (sections[at].payload.len(), sections[at].whole);
    (container::MAGIC.len() + 1 + before, lengths)
}

/// The stream as far as it goes before the middle of the first section of a kind.
fn cut_in(kind: Kind) -> Vec<u8> {
    let mut bytes = stream();
    let (from, (_, whole)) = find(&bytes, kind);
    bytes.truncate(from + whole / 2);
    bytes
}

/// The stream with another header, whose checksum is right.
fn claiming(vertices: usize) -> Vec<u8> {
    let bytes = stream();
    let header = Header {
        vertices,
        frames: FRAMES,
        faces: 64,
        window: FRAMES,
        rate: 24.0,
        start: 0.0,
        origin: [0.0; 3],
        exponent: 0,
    };
    let mut out = container::begin();
    container::push(&mut out, Kind::Header, &header.write());
    let (from, _) = find(&bytes, Kind::Faces);
    out.extend_from_slice(&bytes[from..]);
    out
}

/// Files whose bytes follow from the stream of the wave.
const OF_THE_STREAM: &[Row] = &[
    ("animations/cut.sanim", || cut_in(Kind::Part)),
    ("animations/claims.sanim", || claiming(1 << 30)),
    ("malformed/sanim-not.sanim", || b"SANIMATION".to_vec()),
    ("malformed/sanim-short.sanim", || b"SANIM".to_vec()),
    ("malformed/sanim-other.sanim", || b"SAMIN\x01".to_vec()),
    ("malformed/sanim-version.sanim", || {
        let mut bytes = stream();
        bytes[container::MAGIC.len()] = 2;
        bytes
    }),
    ("malformed/sanim-header.sanim", || flipped(Kind::Header)),
    ("malformed/sanim-faces.sanim", || flipped(Kind::Faces)),
    ("malformed/sanim-window.sanim", || flipped(Kind::Window)),
    ("malformed/sanim-part.sanim", || flipped(Kind::Part)),
    ("malformed/sanim-head.sanim", || {
        let mut bytes = stream();
        let (from, _) = find(&bytes, Kind::Window);
        bytes[from + 1] ^= 1;
        bytes
    }),
    ("malformed/sanim-cut.sanim", || cut_in(Kind::Window)),
    ("malformed/sanim-trailing.sanim", || {
        [stream(), b"more".to_vec()].concat()
    }),
    ("malformed/sanim-vertices.sanim", || claiming(1 << 40)),
];

/// A cube that rests, in a file that could hold what moves.
fn resting() -> Vec<u8> {
    let place = Workplace::new();
    let path = place.path("a.glb");
    let cube = shapes::cuboid([0.0; 3], [1.0; 3]);
    io::write_mesh(&cube, &Sink::File(path.clone()), Format::Glb).expect("a file");
    fs::read(path).expect("the file")
}

fn fixture(name: &str) -> PathBuf {
    root().join("fixtures").join(name)
}

fn keep(path: &Path, bytes: Vec<u8>) {
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    fs::write(path, bytes).expect("a fixture is written");
}

/// Writes the sequences, and the first frame of the wave with its faces.
fn write_meshes() -> Result<()> {
    let obj = fixture("animations/wave.obj");
    io::write_mesh(&wave(1).mesh, &Sink::File(obj), Format::Obj)?;
    for (folder, frames) in [("frames", 5), ("changing", 3), ("gap", 4)] {
        let folder = fixture("animations").join(folder);
        let word = format!("{}/", folder.display());
        sequence::write(&wave(frames), &word, Format::Obj)?;
    }
    fs::remove_file(fixture("animations/gap/frame2.obj")).expect("a file less");
    let last = fixture("animations/changing/frame2.obj");
    let mut mesh = wave(3).mesh_at(2);
    mesh.positions.pop();
    let count = mesh.positions.len() as u32;
    mesh.triangles.retain(|t| t.iter().all(|v| *v < count));
    io::write_mesh(&mesh, &Sink::File(last), Format::Obj).map(drop)
}

#[test]
fn fixtures_are_what_the_formulas_make() {
    if updating("UPDATE_FIXTURES") {
        fs::create_dir_all(fixture("animations")).expect("a folder");
        write_meshes().expect("meshes");
        keep(&fixture("animations/bar-skin.glb"), bar());
    }
    for (name, make, target) in STREAMS {
        if updating("UPDATE_FIXTURES") && !fixture(name).exists() {
            keep(&fixture(name), stream_of(&make(), *target));
        }
    }
    for (name, make) in FILES.iter().chain(OF_THE_STREAM) {
        if updating("UPDATE_FIXTURES") {
            keep(&fixture(name), make());
        }
        let kept = fs::read(fixture(name)).expect("a fixture");
        assert!(kept == make(), "{name} is not what the formula makes");
    }
    let bytes = files_below(&fixture("animations"))
        .into_iter()
        .map(|file| fs::metadata(file).map_or(0, |about| about.len()));
    assert!(bytes.sum::<u64>() < 300_000);
}

fn open(name: &str) -> Source {
    let path = fixture(name);
    Source::open(path.to_str().expect("a name"), u64::MAX).expect("a fixture")
}

#[test]
fn streams_of_old_are_read_to_within_their_error() {
    for (name, make, target) in STREAMS {
        let bytes = fs::read(fixture(name)).expect("a fixture");
        let told = summary(&bytes).expect("a stream");
        assert_eq!((told.version, told.cut_off_at), (1, None), "{name}");
        let (clip, ..) = io::read_animation(&open(name), None).expect("an animation");
        let wanted = make();
        assert_eq!(clip.mesh.triangles, wanted.mesh.triangles, "{name}");
        assert_eq!((clip.start, clip.rate), (wanted.start, wanted.rate));
        let error = animation_error(&wanted, &clip).expect("as many of all");
        let (reached, most) = match target {
            Target::Kg(most) => (error.kg_centroid_percent.expect("an extent"), *most),
            Target::Max(most) => (error.max_error.distance, *most),
            other => panic!("{name} is made to {other:?}"),
        };
        assert!(reached > 0.0 && reached <= most, "{name}: {reached}");
    }
}

#[test]
fn one_wave_is_read_from_every_format() {
    let wanted = wave(FRAMES);
    let (base, _, _) = io::read_mesh(&open("animations/wave.obj"), None).expect("a mesh");
    for name in ["wave.pc2", "wave.mdd"] {
        let source = open(&format!("animations/{name}"));
        let (clip, input, warnings) = io::read_animation(&source, None).expect("an animation");
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!(input.content.frames, Some(FRAMES as u64));
        let clip = clip.with_base(base.clone()).expect("as many vertices");
        assert_eq!(clip.positions, wanted.positions, "{name}");
        assert_eq!(clip.mesh.triangles, wanted.mesh.triangles, "{name}");
        assert_eq!((clip.start, clip.rate), (0.0, 24.0), "{name}");
    }
    let source = open("animations/wave-morph.glb");
    let (clip, input, _) = io::read_gltf_clip(&source, None, 24.0, None).expect("an animation");
    assert_eq!(input.format, "glb");
    assert_eq!(clip.positions, wanted.positions);
    assert_eq!(clip.mesh.triangles, wanted.mesh.triangles);
    let frames = fixture("animations/frames");
    let paths = sequence::find(frames.to_str().expect("a name"), None).expect("files");
    let (clip, inputs, _) = sequence::read(&paths, None, 24.0, u64::MAX).expect("a clip");
    assert_eq!((clip.frames(), inputs.len()), (5, 5));
    assert_eq!(clip.positions, wave(5).positions);
}

#[test]
fn a_vertex_less_is_named_with_its_file() {
    let folder = fixture("animations/changing");
    let paths = sequence::find(folder.to_str().expect("a name"), None).expect("files");
    let error = sequence::read(&paths, None, 24.0, u64::MAX).expect_err("a vertex less");
    let said = error
        .to_string()
        .replace(folder.to_str().expect("a name"), "");
    assert_eq!(
        said,
        "/frame2.obj: 44 vertices, but frame 0 (/frame0.obj) has 45"
    );
}

/// Rings of the bar, and vertices of each.
const RINGS: usize = 9;
const SIDES: usize = 8;

/// A document of glTF and its binary chunk.
fn bar() -> Vec<u8> {
    let mut binary: Vec<u8> = Vec::new();
    let (mut views, mut accessors) = (Vec::new(), Vec::new());
    let mut add = |bytes: Vec<u8>, component: u32, kind: &str, count: usize, range: Value| {
        let view = json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() });
        views.push(view);
        binary.extend(bytes);
        let mut accessor = json!({ "bufferView": views.len() - 1, "componentType": component,
            "count": count, "type": kind });
        if let [min, max] = range.as_array().map_or(&[][..], Vec::as_slice) {
            (accessor["min"], accessor["max"]) = (min.clone(), max.clone());
        }
        accessors.push(accessor);
        accessors.len() - 1
    };
    let floats = |values: &[f32]| {
        values
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    // Offsets around a ring, 3-4-5 and its like: no sine differs between systems.
    let around: [[f32; 2]; SIDES] = [
        [0.25, 0.0],
        [0.1875, 0.1875],
        [0.0, 0.25],
        [-0.1875, 0.1875],
        [-0.25, 0.0],
        [-0.1875, -0.1875],
        [0.0, -0.25],
        [0.1875, -0.1875],
    ];
    let (mut positions, mut joints, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    for ring in 0..RINGS {
        let x = 2.0 * ring as f32 / (RINGS - 1) as f32;
        // Rings around the middle follow both joints.
        let second = (x - 0.5).clamp(0.0, 1.0);
        for [y, z] in around {
            positions.extend([x, y, z]);
            joints.extend([0u8, 1, 0, 0]);
            weights.extend([1.0 - second, second, 0.0, 0.0]);
        }
    }
    let mut triangles: Vec<u16> = Vec::new();
    for ring in 0..RINGS - 1 {
        for side in 0..SIDES {
            let [a, b] = [side, (side + 1) % SIDES].map(|s| (ring * SIDES + s) as u16);
            let [c, d] = [a, b].map(|v| v + SIDES as u16);
            triangles.extend([a, b, c, b, d, c]);
        }
    }
    let count = RINGS * SIDES;
    let range = json!([[0.0, -0.25, -0.25], [2.0, 0.25, 0.25]]);
    let position = add(floats(&positions), 5126, "VEC3", count, range);
    let joint = add(joints, 5121, "VEC4", count, Value::Null);
    let weight = add(floats(&weights), 5126, "VEC4", count, Value::Null);
    let indices: Vec<u8> = triangles.iter().flat_map(|t| t.to_le_bytes()).collect();
    let index = add(indices, 5123, "SCALAR", triangles.len(), Value::Null);
    let mut binds = [0f32; 32];
    for matrix in binds.chunks_mut(16) {
        (0..4).for_each(|i| matrix[5 * i] = 1.0);
    }
    binds[16 + 12] = -1.0;
    let bind = add(floats(&binds), 5126, "MAT4", 2, Value::Null);
    let times = add(
        floats(&[0.0, 0.5, 1.0]),
        5126,
        "SCALAR",
        3,
        json!([[0.0], [1.0]]),
    );
    // 60 degrees about z: half of that has sine 1/2.
    let bent = [0.0, 0.0, 0.5, 0.75f32.sqrt()];
    let turns = [[0.0, 0.0, 0.0, 1.0], bent, [0.0, 0.0, 0.0, 1.0]].concat();
    let turns = add(floats(&turns), 5126, "VEC4", 3, Value::Null);
    let attributes = json!({ "POSITION": position, "JOINTS_0": joint, "WEIGHTS_0": weight });
    let document = json!({
        "asset": { "version": "2.0", "generator": "scantle" },
        "scene": 0,
        "scenes": [{ "nodes": [0, 1] }],
        "nodes": [
            { "mesh": 0, "skin": 0, "translation": [0.0, 100.0, 0.0] },
            { "children": [2] },
            { "translation": [1.0, 0.0, 0.0] },
        ],
        "meshes": [{ "primitives": [{ "attributes": attributes, "indices": index }] }],
        "skins": [{ "joints": [1, 2], "inverseBindMatrices": bind }],
        "animations": [{ "name": "bend",
            "channels": [{ "sampler": 0, "target": { "node": 2, "path": "rotation" } }],
            "samplers": [{ "input": times, "output": turns, "interpolation": "LINEAR" }] }],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": binary.len() }],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 28 + text.len() + binary.len();
    let mut bytes = b"glTF".to_vec();
    bytes.extend(
        [2, total as u32, text.len() as u32]
            .iter()
            .flat_map(|w| w.to_le_bytes()),
    );
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

#[test]
fn the_bar_bends_by_sixty_degrees_and_back() {
    assert_eq!(
        fs::read(fixture("animations/bar-skin.glb")).ok(),
        Some(bar())
    );
    let source = open("animations/bar-skin.glb");
    let (clip, _, warnings) = io::read_gltf_clip(&source, None, 24.0, None).expect("a clip");
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((clip.frames(), clip.vertices()), (25, RINGS * SIDES));
    let near = |f: usize, v: usize, wanted: [f64; 3]| {
        let found = clip.frame(f)[v];
        let off = (0..3)
            .map(|c| (found[c] - wanted[c]).abs())
            .fold(0.0, f64::max);
        assert!(
            off < 1e-6,
            "frame {f}, vertex {v}: {found:?} is not {wanted:?}"
        );
    };
    // The last ring is at x = 2; its third vertex 0.25 above in z. It turns about (1, 0).
    let last = (RINGS - 1) * SIDES + 2;
    for (f, degrees) in [(0, 0.0f64), (6, 30.0), (12, 60.0), (18, 30.0), (24, 0.0)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        near(f, last, [1.0 + cos, sin, 0.25]);
        near(f, 2, [0.0, 0.0, 0.25]);
        // The middle follows both joints alike, and is on the axis.
        near(f, (RINGS / 2) * SIDES + 2, [1.0, 0.0, 0.25]);
    }
}

#[test]
fn caches_are_converted_without_loss() {
    let place = Workplace::new();
    for line in [
        "convert fixtures/animations/wave.pc2 -o a.mdd",
        "convert a.mdd -o b.pc2",
    ] {
        let ran = place.run(line);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        assert!(ran.text().contains("\"warnings\": []"), "{}", ran.text());
    }
    let read = |path: PathBuf| fs::read(path).expect("a file");
    assert_eq!(
        read(place.path("a.mdd")),
        read(fixture("animations/wave.mdd"))
    );
    assert_eq!(
        read(place.path("b.pc2")),
        read(fixture("animations/wave.pc2"))
    );
}
