use super::tests::{floats, glb};
use super::*;
use crate::anim::Clip;
use crate::error::Fault;
use crate::numeric::vector::{Vec3, length, sub};
use proptest::prelude::*;
use serde_json::{Map, Value, json};

/// A document that is put together with its binary chunk.
#[derive(Default)]
struct Document {
    json: Map<String, Value>,
    binary: Vec<u8>,
}

impl Document {
    fn push(&mut self, list: &str, element: Value) -> usize {
        let list = self.json.entry(list).or_insert_with(|| json!([]));
        let list = list.as_array_mut().expect("a list");
        list.push(element);
        list.len() - 1
    }

    fn bytes(&mut self, bytes: Vec<u8>, component: u32, kind: &str, count: usize) -> usize {
        let (offset, length) = (self.binary.len(), bytes.len());
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        let view = self.push("bufferViews", view);
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let accessor =
            json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        self.push("accessors", accessor)
    }

    fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        self.bytes(floats(values), 5126, kind, values.len() / width)
    }

    /// A sampler and the channel that it moves; the animation is the last.
    fn channel(
        &mut self,
        node: usize,
        path: &str,
        way: &str,
        keys: (&[f32], &str, &[f32]),
    ) -> Value {
        let (times, kind, values) = keys;
        let (input, output) = (self.floats("SCALAR", times), self.floats(kind, values));
        json!({
            "samplers": [{ "input": input, "output": output, "interpolation": way }],
            "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
        })
    }

    fn written(mut self) -> Vec<u8> {
        let length = self.binary.len();
        self.push("buffers", json!({ "byteLength": length }));
        let json = serde_json::to_string(&self.json).expect("a document");
        glb(&json[1..json.len() - 1], &self.binary)
    }
}

fn clip_of(bytes: &[u8], fps: f64, asked: Option<&str>) -> Result<(Clip, Vec<Warning>), Fault> {
    let source = Source::from_bytes("a.glb", bytes.to_vec()).expect("a source");
    let mut warnings = Vec::new();
    let clip = read_clip(&source, fps, asked, &mut warnings).map_err(Refusal::fault)?;
    clip.check()?;
    let still = read(&source, &mut Vec::new()).map_err(Refusal::fault)?;
    assert_eq!(clip.vertices(), still.positions.len());
    assert_eq!(clip.mesh.triangles, still.triangles);
    Ok((clip, warnings))
}

fn near(found: &[Vec3], wanted: &[Vec3]) {
    assert_eq!(found.len(), wanted.len());
    for (a, b) in found.iter().zip(wanted) {
        assert!(length(sub(*a, *b)) < 1e-6, "{found:?} is not {wanted:?}");
    }
}

/// A bar along x whose second bone, from x = 1 on, turns about z by 90 degrees within a second. The
/// middle vertex follows both bones alike, by weights that add up to 4; the last but one none.
fn bar() -> Document {
    let mut d = Document::default();
    let positions = [
        0.0, 0.0, 0.0, 1.5, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 1.0, 0.0, 2.0, 0.0, 1.0,
    ];
    let position = d.floats("VEC3", &positions);
    let mut joints = vec![0u8; 20];
    joints[4..6].copy_from_slice(&[0, 1]);
    joints[8] = 1;
    joints[16] = 1;
    let joints = d.bytes(joints, 5121, "VEC4", 5);
    let mut weights = [0f32; 20];
    weights[0] = 1.0;
    weights[4..6].copy_from_slice(&[2.0, 2.0]);
    weights[8] = 0.25;
    weights[16] = 1.0;
    let weights = d.floats("VEC4", &weights);
    let mut binds = [0f32; 32];
    for matrix in binds.chunks_mut(16) {
        (0..4).for_each(|i| matrix[5 * i] = 1.0);
    }
    binds[16 + 12] = -1.0;
    let binds = d.floats("MAT4", &binds);
    let attributes = json!({ "POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights });
    d.push(
        "meshes",
        json!({ "primitives": [{ "attributes": attributes, "mode": 0 }] }),
    );
    // The place of a node with a skin counts for nothing.
    d.push(
        "nodes",
        json!({ "mesh": 0, "skin": 0, "translation": [100, 0, 0] }),
    );
    d.push(
        "nodes",
        json!({ "children": [2], "translation": [0, 0, 5] }),
    );
    d.push("nodes", json!({ "translation": [1, 0, 0] }));
    d.push(
        "skins",
        json!({ "joints": [1, 2], "inverseBindMatrices": binds }),
    );
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let keys = (
        &[0.0, 1.0][..],
        "VEC4",
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half][..],
    );
    let animation = d.channel(2, "rotation", "LINEAR", keys);
    d.push("animations", animation);
    d
}

#[test]
fn a_bar_of_two_bones_bends() {
    let (clip, warnings) = clip_of(&bar().written(), 2.0, None).expect("a clip");
    assert_eq!((clip.frames(), clip.rate, clip.start), (3, 2.0, 0.0));
    near(
        clip.frame(0),
        &[
            [0.0, 0.0, 5.0],
            [1.5, 0.0, 5.0],
            [2.0, 0.0, 5.0],
            [2.0, 1.0, 5.0],
            [2.0, 0.0, 6.0],
        ],
    );
    let c = std::f64::consts::FRAC_1_SQRT_2;
    near(
        &clip.frame(1)[1..3],
        &[
            [(1.5 + 1.0 + c / 2.0) / 2.0, c / 4.0, 5.0],
            [1.0 + c, c, 5.0],
        ],
    );
    near(
        clip.frame(2),
        &[
            [0.0, 0.0, 5.0],
            [1.25, 0.25, 5.0],
            [1.0, 1.0, 5.0],
            [2.0, 1.0, 5.0],
            [1.0, 1.0, 6.0],
        ],
    );
    let said: Vec<_> = warnings
        .iter()
        .map(|w| (w.code.as_str(), w.count, w.first))
        .collect();
    assert_eq!(said, [("vertices-without-joints", 1, Some(3))]);
}

/// Three vertices with two morph targets, of which the second is sparse: only vertex 2 moves, by 8
/// along z. The node is scaled by 2.
fn blend() -> Document {
    let mut d = Document::default();
    let position = d.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let up = d.floats("VEC3", &[0.0, 4.0, 0.0, 0.0, 4.0, 0.0, 0.0, 4.0, 0.0]);
    let places = d.bytes(vec![2, 0], 5123, "SCALAR", 1);
    let values = d.floats("VEC3", &[0.0, 0.0, 8.0]);
    let [places, values] = [places, values].map(|a| d.json["accessors"][a]["bufferView"].clone());
    let sparse = d.push(
        "accessors",
        json!({ "componentType": 5126, "count": 3, "type": "VEC3", "sparse": { "count": 1,
            "indices": { "bufferView": places, "componentType": 5123 },
            "values": { "bufferView": values } } }),
    );
    let targets = json!([{ "POSITION": up }, { "POSITION": sparse }]);
    let primitive = json!({ "attributes": { "POSITION": position }, "targets": targets });
    d.push(
        "meshes",
        json!({ "weights": [0.5, 0.25], "primitives": [primitive] }),
    );
    d.push("nodes", json!({ "mesh": 0, "scale": [2, 2, 2] }));
    d
}

#[test]
fn morph_targets_are_blended_by_their_weights() {
    let mut d = blend();
    let keys = (&[0.0, 1.0][..], "SCALAR", &[0.0, 0.0, 1.0, 0.5][..]);
    let animation = d.channel(0, "weights", "LINEAR", keys);
    d.push("animations", animation);
    let (clip, warnings) = clip_of(&d.written(), 2.0, None).expect("a clip");
    assert!(warnings.is_empty(), "{warnings:?}");
    near(clip.frame(0), &[[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
    near(
        clip.frame(1),
        &[[0.0, 4.0, 0.0], [2.0, 4.0, 0.0], [0.0, 6.0, 4.0]],
    );
    near(
        clip.frame(2),
        &[[0.0, 8.0, 0.0], [2.0, 8.0, 0.0], [0.0, 10.0, 8.0]],
    );
}

#[test]
fn what_is_not_moved_keeps_its_place_and_weights() {
    let mut d = blend();
    let steps = (
        &[0.0, 0.75, 1.25][..],
        "VEC3",
        &[0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 9.0, 0.0][..],
    );
    let mut step = d.channel(0, "translation", "STEP", steps);
    step["name"] = json!("hop");
    let slopes = [
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, //
        0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0,
    ];
    let cubic = d.channel(
        0,
        "translation",
        "CUBICSPLINE",
        (&[0.0, 1.0], "VEC3", &slopes),
    );
    d.push("animations", step);
    d.push("animations", cubic);
    let bytes = d.written();
    let (clip, warnings) = clip_of(&bytes, 2.0, None).expect("a clip");
    assert_eq!(warnings[0].code, "other-animations");
    // Weights are the mesh's: half of the first target and a quarter of the second, doubled.
    let still = [[0.0, 4.0, 0.0], [2.0, 4.0, 0.0], [0.0, 6.0, 4.0]];
    let moved = |by: Vec3| still.map(|p| std::array::from_fn(|c| p[c] + by[c]));
    // The end at 1.25 s falls between frames 2 and 3, which shows it.
    assert_eq!(clip.frames(), 4);
    near(clip.frame(1), &still);
    near(clip.frame(2), &moved([9.0, 0.0, 0.0]));
    near(clip.frame(3), &moved([0.0, 9.0, 0.0]));
    let by_name = clip_of(&bytes, 2.0, Some("hop")).expect("a clip");
    assert_eq!((by_name.0, by_name.1.len()), (clip, 0));
    // Halfway: half of 4 along z, and an eighth of the slope of 2 along x.
    let (clip, _) = clip_of(&bytes, 2.0, Some("1")).expect("a clip");
    near(clip.frame(1), &moved([0.25, 0.0, 2.0]));
    let fault = clip_of(&bytes, 2.0, Some("walk")).expect_err("no such animation");
    assert_eq!(fault.problem, "holds no animation walk, but 2, from 0: hop");
    let fault = clip_of(&blend().written(), 2.0, None).expect_err("no animation");
    assert_eq!(fault.problem, "holds no animation");
}

#[test]
fn tracks_that_do_not_fit_are_refused() {
    let said = |node: usize, path: &str, way: &str, keys: (&[f32], &str, &[f32])| {
        let mut d = blend();
        let animation = d.channel(node, path, way, keys);
        d.push("animations", animation);
        let fault = clip_of(&d.written(), 1.0, None).expect_err("a fault");
        format!("{}: {}", fault.at, fault.problem)
    };
    let two = [0.0, 1.0];
    assert_eq!(
        said(0, "translation", "LINEAR", (&[1.0, 1.0], "VEC3", &[0.0; 6])),
        "accessor 5: the times of keys do not rise: 1 of key 0, 1 of the next"
    );
    assert_eq!(
        said(
            0,
            "translation",
            "LINEAR",
            (&[0.0, f32::NAN], "VEC3", &[0.0; 6])
        ),
        "accessor 5: the time NaN of key 1 is not finite"
    );
    assert_eq!(
        said(0, "scale", "CUBICSPLINE", (&two, "VEC3", &[1.0; 6])),
        "accessor 6: 2 values for 2 keys of 1 each, but 6 are needed for CUBICSPLINE"
    );
    assert_eq!(
        said(0, "weights", "LINEAR", (&two, "SCALAR", &[1.0; 2])),
        "accessor 6: 2 values for 2 keys of 2 each, but 4 are needed for LINEAR"
    );
    assert_eq!(
        said(0, "rotation", "SLERP", (&two, "VEC4", &[1.0; 8])),
        "accessor 6: is interpolated by \"SLERP\", which is no way"
    );
    assert_eq!(
        said(7, "rotation", "LINEAR", (&two, "VEC4", &[1.0; 8])),
        "animation 0: channel 0: moves node 7, but there are 1"
    );
    let huge = said(
        0,
        "translation",
        "LINEAR",
        (
            &[0.0, 1.0],
            "VEC3",
            &[0.0, 0.0, 0.0, f32::INFINITY, 0.0, 0.0],
        ),
    );
    assert_eq!(huge, "accessor 6: value 1, [inf, 0.0, 0.0], is not finite");
}

#[test]
fn a_long_animation_is_refused_before_it_is_made() {
    let mut d = blend();
    let keys = (&[0.0, 1e30][..], "VEC3", &[0.0; 6][..]);
    let animation = d.channel(0, "translation", "LINEAR", keys);
    d.push("animations", animation);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.glb");
    std::fs::write(&path, d.written()).expect("a file");
    let source = Source::open(path.to_str().expect("a name"), 1 << 20).expect("a source");
    let refusal = read_clip(&source, 24.0, None, &mut Vec::new()).expect_err("a refusal");
    assert!(matches!(refusal, Refusal::OverMemory { .. }), "{refusal:?}");
}

fn clips() -> impl Strategy<Value = Clip> {
    (1usize..9, 2usize..9, 0usize..4, 1u32..60, any::<u64>()).prop_map(
        |(vertices, frames, far, rate, seed)| {
            let mut rng = crate::numeric::rng::Rng::new(seed, 0);
            let offset = [0.0, 0.5, 1e9, -3e7][far];
            let mut number = || rng.range(-1.0, 1.0) + offset;
            let positions = (0..vertices * frames).map(|_| [number(), number(), number()]);
            let mut clip = Clip::cloud(vertices, positions.collect(), 0.0, f64::from(rate));
            if vertices > 2 {
                clip.mesh.points.clear();
                clip.mesh.triangles = vec![[0, 1, 2]];
                clip.mesh.segments = vec![[2, 0]];
            }
            clip
        },
    )
}

fn glb_of(clip: &Clip) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_clip(clip, &mut bytes).expect("a file");
    bytes
}

proptest! {
    #[test]
    fn what_is_written_comes_back(clip in clips()) {
        let (back, warnings) = clip_of(&glb_of(&clip), clip.rate, None).unwrap();
        prop_assert!(warnings.is_empty());
        prop_assert_eq!((back.frames(), back.rate), (clip.frames(), clip.rate));
        prop_assert_eq!(&back.mesh.segments, &clip.mesh.segments);
        prop_assert_eq!(&back.mesh.points, &clip.mesh.points);
        // Half a unit in the last place of offsets below 4, and the rounding of doubles at 1e9.
        let far = clip.positions[0][0].abs();
        let most = 2.0 * f64::from(f32::EPSILON) + 4.0 * f64::EPSILON * far;
        for (a, b) in back.positions.iter().zip(&clip.positions) {
            for c in 0..3 {
                prop_assert!((a[c] - b[c]).abs() <= most, "{a:?} {b:?}");
            }
        }
    }

    /// The crate `gltf` checks files against the specification before it opens them.
    #[test]
    fn another_reader_takes_what_is_written(clip in clips()) {
        let file = gltf::Gltf::from_slice(&glb_of(&clip)).unwrap();
        let blob = file.blob.as_deref().unwrap();
        let mesh = file.meshes().next().unwrap();
        prop_assert_eq!(mesh.weights().map(<[f32]>::len), Some(clip.frames() - 1));
        for primitive in mesh.primitives() {
            let reader = primitive.reader(|_| Some(blob));
            let targets: Vec<_> = reader.read_morph_targets().collect();
            prop_assert_eq!(targets.len(), clip.frames() - 1);
            for (positions, normals, _) in targets {
                prop_assert_eq!(positions.unwrap().count(), clip.vertices());
                prop_assert!(normals.is_none());
            }
        }
        let animation = file.animations().next().unwrap();
        let channel = animation.channels().next().unwrap();
        let reader = channel.reader(|_| Some(blob));
        let times: Vec<f32> = reader.read_inputs().unwrap().collect();
        prop_assert_eq!(times.len(), clip.frames());
        prop_assert_eq!(times[1], (1.0 / clip.rate) as f32);
        let Some(gltf::animation::util::ReadOutputs::MorphTargetWeights(weights)) = reader.read_outputs() else {
            panic!("no weights");
        };
        let weights: Vec<f32> = weights.into_f32().collect();
        for (f, weights) in weights.chunks(clip.frames() - 1).enumerate() {
            let own = |i: usize| if i + 1 == f { 1.0 } else { 0.0 };
            prop_assert!(weights.iter().enumerate().all(|(i, w)| *w == own(i)));
        }
    }

    #[test]
    fn any_bytes_are_read_or_refused(
        changes in prop::collection::vec((0usize..4000, any::<u8>()), 1..4),
        which in 0usize..2,
    ) {
        let document = if which == 0 { bar() } else {
            let mut d = blend();
            let animation = d.channel(0, "weights", "LINEAR", (&[0.0, 1.0], "SCALAR", &[0.5; 4]));
            d.push("animations", animation);
            d
        };
        let mut bytes = document.written();
        let length = bytes.len();
        for (at, byte) in changes {
            bytes[at % length] = byte;
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        std::fs::write(&path, bytes).unwrap();
        let source = Source::open(path.to_str().unwrap(), 1 << 20).unwrap();
        let _ = read_clip(&source, 10.0, None, &mut Vec::new());
    }
}

#[test]
fn a_clip_of_one_frame_is_a_mesh() {
    let clip = Clip::cloud(1, vec![[1.0, 2.0, 3.0]], 0.0, 24.0);
    let bytes = glb_of(&clip);
    let source = Source::from_bytes("a.glb", bytes.clone()).expect("a source");
    let mesh = read(&source, &mut Vec::new()).expect("a mesh");
    assert_eq!(mesh.positions, clip.positions);
    assert!(clip_of(&bytes, 24.0, None).is_err());
}

#[test]
fn what_glb_cannot_hold_is_named() {
    let clip = Clip::cloud(1, vec![[0.0; 3], [1e300, 0.0, 0.0]], 0.0, 24.0);
    let error = write_clip(&clip, &mut Vec::new())
        .expect_err("an error")
        .to_string();
    assert!(
        error.starts_with("frame 1, vertex 0 at (1000000"),
        "{error}"
    );
}
