//! The parts of a document that move, and their values at a time.

use super::accessor::Reader;
use super::scene::Local;
use crate::error::Fault;
use crate::io::header::excerpt;
use crate::io::refusal::Refusal;
use crate::report::{Tally, Warning};
use serde::Deserialize;
use std::collections::BTreeMap;

/// What a file says of motion; read apart from the geometry, which does not depend on it. Indices are
/// as they stand, unchecked.
#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct Moving {
    #[serde(default)]
    pub nodes: Vec<MovingNode>,
    #[serde(default)]
    pub meshes: Vec<MovingMesh>,
    #[serde(default)]
    pub skins: Vec<SkinEntry>,
    #[serde(default)]
    pub animations: Vec<AnimationEntry>,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct MovingNode {
    pub weights: Option<Vec<f64>>,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct MovingMesh {
    pub weights: Option<Vec<f64>>,
    #[serde(default)]
    pub primitives: Vec<MovingPrimitive>,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct MovingPrimitive {
    #[serde(default)]
    pub targets: Vec<BTreeMap<String, usize>>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
#[allow(missing_docs)]
pub struct SkinEntry {
    pub inverse_bind_matrices: Option<usize>,
    pub joints: Vec<usize>,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct AnimationEntry {
    pub name: Option<String>,
    #[serde(default)]
    pub channels: Vec<ChannelEntry>,
    #[serde(default)]
    pub samplers: Vec<SamplerEntry>,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct ChannelEntry {
    pub sampler: usize,
    pub target: TargetEntry,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct TargetEntry {
    pub node: Option<usize>,
    pub path: String,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct SamplerEntry {
    pub input: usize,
    pub output: usize,
    #[serde(default = "linear")]
    pub interpolation: String,
}

fn linear() -> String {
    "LINEAR".to_owned()
}

/// How values between two keys follow from them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Interpolation {
    Step,
    Linear,
    Cubic,
}

/// Values of N numbers over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Track<const N: usize> {
    interpolation: Interpolation,
    /// Rising.
    times: Vec<f64>,
    /// Values in groups of `width`: a group for each key, three (in-tangents, values, out-tangents)
    /// where the interpolation is cubic.
    values: Vec<[f64; N]>,
    /// Values at a time: 1, or the morph targets.
    width: usize,
}

/// Where a time is among the keys.
enum Place {
    /// At a key, before the first, or after the last.
    At(usize),
    /// So far of the way from a key to the next, which are so many seconds apart.
    Between(usize, f64, f64),
}

impl<const N: usize> Track<N> {
    /// The time of the last key.
    pub fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    fn place(&self, time: f64) -> Place {
        let after = self.times.partition_point(|t| *t <= time);
        if after == 0 {
            return Place::At(0);
        }
        let (key, from) = (after - 1, self.times[after - 1]);
        match self.times.get(after) {
            Some(to) if time > from => Place::Between(key, (time - from) / (to - from), to - from),
            _ => Place::At(key),
        }
    }

    /// Value `i` of a key: 0 the in-tangent, 1 the value, 2 the out-tangent.
    fn group(&self, key: usize, which: usize, i: usize) -> [f64; N] {
        let group = match self.interpolation {
            Interpolation::Cubic => 3 * key + which,
            _ => key,
        };
        self.values[group * self.width + i]
    }

    /// Value `i` at a time. Before the first key it is that key's, after the last that one's.
    ///
    /// Source: glTF 2.0, appendix C.
    fn value(
        &self,
        time: f64,
        i: usize,
        between: fn([f64; N], [f64; N], f64) -> [f64; N],
    ) -> [f64; N] {
        let (key, share, seconds) = match self.place(time) {
            Place::At(key) => return self.group(key, 1, i),
            Place::Between(key, share, seconds) => (key, share, seconds),
        };
        let (from, to) = (self.group(key, 1, i), self.group(key + 1, 1, i));
        match self.interpolation {
            Interpolation::Step => from,
            Interpolation::Linear => between(from, to, share),
            Interpolation::Cubic => {
                let (out, into) = (self.group(key, 2, i), self.group(key + 1, 0, i));
                let s = share;
                let (s2, s3) = (s * s, s * s * s);
                std::array::from_fn(|c| {
                    (2.0 * s3 - 3.0 * s2 + 1.0) * from[c]
                        + seconds * (s3 - 2.0 * s2 + s) * out[c]
                        + (3.0 * s2 - 2.0 * s3) * to[c]
                        + seconds * (s3 - s2) * into[c]
                })
            }
        }
    }
}

/// Along a straight line.
fn straight<const N: usize>(a: [f64; N], b: [f64; N], share: f64) -> [f64; N] {
    std::array::from_fn(|c| a[c] * (1.0 - share) + b[c] * share)
}

/// Along the shorter arc between two quaternions. Source: glTF 2.0, appendix C.4.
fn arc(a: [f64; 4], b: [f64; 4], share: f64) -> [f64; 4] {
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let sign = if dot < 0.0 { -1.0 } else { 1.0 };
    let angle = dot.abs().min(1.0).acos();
    if angle < 1e-6 {
        // The arc and its chord differ by less than a rounding.
        return straight(a, b.map(|c| sign * c), share);
    }
    let (u, v) = (((1.0 - share) * angle).sin(), sign * (share * angle).sin());
    std::array::from_fn(|c| (u * a[c] + v * b[c]) / angle.sin())
}

/// What moves in a node.
#[derive(Debug, Default)]
pub struct NodeTracks {
    translation: Option<Track<3>>,
    rotation: Option<Track<4>>,
    scale: Option<Track<3>>,
    weights: Option<Track<1>>,
}

impl NodeTracks {
    /// Whether the node's place changes.
    pub fn move_node(&self) -> bool {
        self.translation.is_some() || self.rotation.is_some() || self.scale.is_some()
    }

    /// The node's place at a time, `still` where nothing moves it.
    pub fn local(&self, still: Local, time: f64) -> Local {
        let three = |track: &Option<Track<3>>| track.as_ref().map(|t| t.value(time, 0, straight));
        let turned = self.rotation.as_ref().map(|t| t.value(time, 0, arc));
        Local {
            translation: three(&self.translation).or(still.translation),
            rotation: turned.or(still.rotation),
            scale: three(&self.scale).or(still.scale),
        }
    }

    /// Weight `i` of its morph targets at a time, where they change.
    pub fn weight(&self, i: usize, time: f64) -> Option<f64> {
        self.weights.as_ref().map(|t| t.value(time, i, straight)[0])
    }

    /// The time of the last key.
    fn end(&self) -> f64 {
        let end = |track: &Option<Track<3>>| track.as_ref().map_or(0.0, Track::end);
        end(&self.translation)
            .max(end(&self.scale))
            .max(self.rotation.as_ref().map_or(0.0, Track::end))
            .max(self.weights.as_ref().map_or(0.0, Track::end))
    }
}

/// An animation: what moves in which node.
#[derive(Debug)]
pub struct Animation {
    /// By the number of the node.
    pub nodes: BTreeMap<usize, NodeTracks>,
}

impl Animation {
    /// The time of the last key, not below 0.
    pub fn end(&self) -> f64 {
        self.nodes.values().map(NodeTracks::end).fold(0.0, f64::max)
    }
}

/// The animation of a name, or of a number where none has it as its name; the first where neither is
/// asked for, with a warning where there are others.
pub fn choose<'m>(
    moving: &'m Moving,
    asked: Option<&str>,
    warnings: &mut Vec<Warning>,
) -> Result<(usize, &'m AnimationEntry), Fault> {
    let all = &moving.animations;
    let count = all.len();
    let Some(first) = all.first() else {
        let fault = Fault::whole("holds no animation");
        return Err(fault.with_hint("scantle convert takes its mesh as it stands"));
    };
    let names: Vec<_> = all.iter().map(|a| a.name.as_deref()).collect();
    let Some(asked) = asked else {
        if count > 1 {
            let message = "animations beside the first, which is taken; name one to take another";
            warnings.push(Warning::new(
                "other-animations",
                message,
                count as u64 - 1,
                None,
            ));
        }
        return Ok((0, first));
    };
    let by_name = names.iter().position(|name| *name == Some(asked));
    let index = by_name.or_else(|| asked.parse().ok());
    if let Some((index, entry)) = index.and_then(|i| Some((i, all.get(i)?))) {
        return Ok((index, entry));
    }
    let names: Vec<_> = names.iter().flatten().map(|name| excerpt(name)).collect();
    let named = match names.is_empty() {
        true => "without names".to_owned(),
        false => names.join(", "),
    };
    Err(Fault::whole(format!(
        "holds no animation {}, but {count}, from 0: {named}",
        excerpt(asked)
    )))
}

/// Reads the tracks of an animation. `targets` is the number of morph targets of each node.
///
/// Channels of what is not known (extensions) and of no node are left out with a warning.
pub fn tracks(
    reader: &mut Reader,
    index: usize,
    entry: &AnimationEntry,
    targets: &[usize],
    warnings: &mut Vec<Warning>,
) -> Result<Animation, Refusal> {
    let mut nodes: BTreeMap<usize, NodeTracks> = BTreeMap::new();
    let mut unknown = Tally::default();
    for (c, channel) in entry.channels.iter().enumerate() {
        let wrong = |problem: String| {
            let problem = format!("channel {c}: {problem}");
            Refusal::Fault(Fault::element("animation", index, problem))
        };
        let path = channel.target.path.as_str();
        let is_known = matches!(path, "translation" | "rotation" | "scale" | "weights");
        let Some(node) = channel.target.node.filter(|_| is_known) else {
            unknown.note(c as u64);
            continue;
        };
        let Some(targets) = targets.get(node).copied() else {
            let problem = format!("moves node {node}, but there are {}", targets.len());
            return Err(wrong(problem));
        };
        let stated = reader.document.nodes.get(node);
        if path != "weights" && stated.is_some_and(|node| node.matrix.is_some()) {
            let problem = format!("moves node {node}, which has a matrix");
            return Err(wrong(problem));
        }
        let Some(sampler) = entry.samplers.get(channel.sampler) else {
            let problem = format!(
                "has sampler {}, but there are {}",
                channel.sampler,
                entry.samplers.len()
            );
            return Err(wrong(problem));
        };
        let into = nodes.entry(node).or_default();
        let twice = match path {
            "translation" => into
                .translation
                .replace(track(reader, sampler, 1)?)
                .is_some(),
            "rotation" => into.rotation.replace(track(reader, sampler, 1)?).is_some(),
            "scale" => into.scale.replace(track(reader, sampler, 1)?).is_some(),
            _ if targets == 0 => {
                let problem = format!("moves morph targets of node {node}, which has none");
                return Err(wrong(problem));
            }
            _ => into
                .weights
                .replace(track(reader, sampler, targets)?)
                .is_some(),
        };
        if twice {
            let problem = format!("moves the {path} of node {node}, which another channel moves");
            return Err(wrong(problem));
        }
    }
    let message = "channels that move no node, or what is not known; left out";
    unknown.warn("ignored-channels", message, warnings);
    Ok(Animation { nodes })
}

/// Reads the keys of a sampler whose values are groups of `width`.
fn track<const N: usize>(
    reader: &mut Reader,
    sampler: &SamplerEntry,
    width: usize,
) -> Result<Track<N>, Refusal> {
    let (input, output) = (sampler.input, sampler.output);
    let fault = |accessor, problem: String| Fault::element("accessor", accessor, problem);
    let interpolation = match sampler.interpolation.as_str() {
        "LINEAR" => Interpolation::Linear,
        "STEP" => Interpolation::Step,
        "CUBICSPLINE" => Interpolation::Cubic,
        other => {
            let problem = format!("is interpolated by {:?}, which is no way", excerpt(other));
            return Err(fault(output, problem).into());
        }
    };
    let times = reader.vectors::<1>(input, 1..=1, [0.0])?;
    let times: Vec<f64> = times.into_iter().flatten().collect();
    if times.is_empty() {
        return Err(fault(input, "holds no times of keys".into()).into());
    }
    if let Some(k) = times.iter().position(|t| !t.is_finite()) {
        let problem = format!("the time {} of key {k} is not finite", times[k]);
        return Err(fault(input, problem).into());
    }
    if let Some(k) = times.windows(2).position(|w| w[0] >= w[1]) {
        let problem = format!(
            "the times of keys do not rise: {} of key {k}, {} of the next",
            times[k],
            times[k + 1]
        );
        return Err(fault(input, problem).into());
    }
    let values = reader.vectors::<N>(output, N..=N, [0.0; N])?;
    let is_broken = |value: &[f64; N]| value.iter().any(|c| !c.is_finite());
    if let Some(at) = values.iter().position(is_broken) {
        let problem = format!("value {at}, {:?}, is not finite", values[at]);
        return Err(fault(output, problem).into());
    }
    let groups = match interpolation {
        Interpolation::Cubic => 3,
        _ => 1,
    };
    let wanted = times.len() as u128 * width as u128 * groups;
    if values.len() as u128 != wanted {
        let problem = format!(
            "{} values for {} keys of {width} each, but {wanted} are needed for {}",
            values.len(),
            times.len(),
            sampler.interpolation
        );
        return Err(fault(output, problem).into());
    }
    Ok(Track {
        interpolation,
        times,
        values,
        width,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track<const N: usize>(interpolation: Interpolation, values: &[[f64; N]]) -> Track<N> {
        Track {
            interpolation,
            times: vec![1.0, 3.0],
            values: values.to_vec(),
            width: 1,
        }
    }

    #[test]
    fn values_between_keys_are_as_by_hand() {
        let at = |track: &Track<1>, time| track.value(time, 0, straight)[0];
        let line = track(Interpolation::Linear, &[[10.0], [20.0]]);
        let found = [0.0, 1.0, 1.5, 3.0, 9.0].map(|t| at(&line, t));
        assert_eq!(found, [10.0, 10.0, 12.5, 20.0, 20.0]);
        let step = track(Interpolation::Step, &[[10.0], [20.0]]);
        let found = [0.0, 1.0, 2.999, 3.0, 9.0].map(|t| at(&step, t));
        assert_eq!(found, [10.0, 10.0, 10.0, 20.0, 20.0]);
        // From 10 with slope 4 a second to 20 with slope -1: Hermite's cubic at half its way is the
        // mean of the ends and an eighth of the slopes' difference times 2 seconds.
        let keys = [[99.0], [10.0], [4.0], [-1.0], [20.0], [99.0]];
        let cubic = track(Interpolation::Cubic, &keys);
        let found = [0.0, 1.0, 2.0, 3.0, 9.0].map(|t| at(&cubic, t));
        assert_eq!(found, [10.0, 10.0, 15.0 + 10.0 / 8.0, 20.0, 20.0]);
        // At a quarter: 27/32 of 10, 5/32 of 20, and 2 (9/64 * 4 - 3/64 * -1).
        let wanted = 270.0 / 32.0 + 100.0 / 32.0 + 2.0 * (36.0 + 3.0) / 64.0;
        assert!((at(&cubic, 1.5) - wanted).abs() < 1e-14);
    }

    #[test]
    fn rotations_go_along_the_shorter_arc() {
        let about_z = |degrees: f64| {
            let half = degrees.to_radians() / 2.0;
            [0.0, 0.0, half.sin(), half.cos()]
        };
        let near = |a: [f64; 4], b: [f64; 4]| {
            let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            assert!((dot.abs() - 1.0).abs() < 1e-14, "{a:?} {b:?}");
        };
        let turn = track(Interpolation::Linear, &[about_z(0.0), about_z(90.0)]);
        near(turn.value(1.5, 0, arc), about_z(22.5));
        // A turn by 270 degrees is the shorter one by 90 the other way round.
        let back = track(Interpolation::Linear, &[about_z(0.0), about_z(270.0)]);
        near(back.value(2.0, 0, arc), about_z(-45.0));
        let still = track(Interpolation::Linear, &[about_z(30.0), about_z(30.0)]);
        near(still.value(2.0, 0, arc), about_z(30.0));
    }
}
