//! Where the vertices of a node are at a time: morph targets blended, joints applied.

use super::accessor::Reader;
use super::animation::{Animation, Moving, MovingPrimitive};
use super::assemble::Part;
use super::document::Document;
use super::scene::{self, Local, Placed};
use crate::error::Fault;
use crate::io::refusal::{RAISE, Refusal, expect_room};
use crate::numeric::vector::Vec3;
use crate::report::{Tally, Warning};
use nalgebra::Matrix4;

/// The upper three rows of a transform.
type Rows = [[f64; 4]; 3];

/// Vertices as stored, and what poses them.
pub struct Posed {
    /// The first of the vertices.
    pub base: usize,
    node: usize,
    stored: Vec<Vec3>,
    /// Offsets of each morph target; empty where it moves nothing.
    targets: Vec<Vec<Vec3>>,
    /// Weights of the targets where nothing moves them.
    weights: Vec<f64>,
    skin: Option<Skin>,
}

/// Joints and how much each vertex follows them.
struct Skin {
    /// The node of each joint and its inverse bind matrix.
    joints: Vec<(usize, Matrix4<f64>)>,
    /// Vertex `v` follows `follows[starts[v]..starts[v + 1]]`: joints with shares that add up to 1.
    starts: Vec<u32>,
    follows: Vec<(u32, f64)>,
}

/// Reads what poses the vertices of a part. The primitives that share them must be posed alike.
pub fn posed(
    reader: &mut Reader,
    moving: &Moving,
    place: &Placed,
    part: &Part,
    limit: u64,
    weightless: &mut Tally,
) -> Result<Posed, Refusal> {
    let meshes = &reader.document.meshes;
    let primitives = meshes.get(place.mesh).map_or(&[][..], |m| &m.primitives);
    let none = MovingPrimitive {
        targets: Vec::new(),
    };
    let moves = |p: usize| {
        let mesh = moving.meshes.get(place.mesh);
        mesh.and_then(|m| m.primitives.get(p)).unwrap_or(&none)
    };
    let skinned = |name: &str| name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_");
    let joints_of = |p: usize| {
        let attributes = primitives.get(p).into_iter().flat_map(|p| &p.attributes);
        attributes
            .filter(|(name, _)| skinned(name))
            .collect::<Vec<_>>()
    };
    let index = part.primitives.first().copied().unwrap_or_default();
    for other in part.primitives.iter().skip(1) {
        if moves(*other).targets != moves(index).targets || joints_of(*other) != joints_of(index) {
            let problem = format!(
                "primitive {other} shares the vertices of primitive {index}, but is posed otherwise"
            );
            return Err(Fault::element("mesh", place.mesh, problem).into());
        }
    }
    let position = primitives
        .get(index)
        .and_then(|p| p.attributes.get("POSITION"));
    let stored = reader.vectors(position.copied().unwrap_or_default(), 3..=3, [0.0; 3])?;
    let targets = &moves(index).targets;
    let what = || {
        let count = targets.len();
        format!("{count} morph targets of {} vertices", stored.len())
    };
    let needed = targets.len() as u128 * size_of_val(stored.as_slice()) as u128;
    expect_room(what, needed, limit, RAISE)?;
    let mut offsets = Vec::with_capacity(targets.len());
    for target in targets {
        let Some(accessor) = target.get("POSITION").copied() else {
            offsets.push(Vec::new());
            continue;
        };
        let found: Vec<Vec3> = reader.vectors(accessor, 3..=3, [0.0; 3])?;
        same_length(accessor, found.len(), stored.len())?;
        offsets.push(found);
    }
    let joints = joints_of(index).into_iter();
    let joints: Vec<(&str, usize)> = joints.map(|(name, a)| (name.as_str(), *a)).collect();
    let skin = match reader.document.nodes.get(place.node).and_then(|n| n.skin) {
        Some(skin) => {
            let fault = |problem| Fault::element("mesh", place.mesh, problem);
            if joints.is_empty() {
                let node = place.node;
                let problem = format!("primitive {index} has no JOINTS_0, but node {node} a skin");
                return Err(fault(problem).into());
            }
            Some(read_skin(reader, moving, skin, &joints, part, weightless)?)
        }
        None => None,
    };
    Ok(Posed {
        base: part.base,
        node: place.node,
        weights: still_weights(moving, place, targets.len()),
        stored,
        targets: offsets,
        skin,
    })
}

/// The weights of the node, or else of the mesh, or else none.
fn still_weights(moving: &Moving, place: &Placed, targets: usize) -> Vec<f64> {
    let of_node = moving.nodes.get(place.node).and_then(|n| n.weights.clone());
    let of_mesh = || {
        moving
            .meshes
            .get(place.mesh)
            .and_then(|m| m.weights.clone())
    };
    let mut weights = of_node.or_else(of_mesh).unwrap_or_default();
    weights.resize(targets, 0.0);
    weights
}

fn same_length(accessor: usize, found: usize, wanted: usize) -> Result<(), Fault> {
    if found == wanted {
        return Ok(());
    }
    let problem = format!("{found} elements for {wanted} positions");
    Err(Fault::element("accessor", accessor, problem))
}

fn read_skin(
    reader: &mut Reader,
    moving: &Moving,
    index: usize,
    attributes: &[(&str, usize)],
    part: &Part,
    weightless: &mut Tally,
) -> Result<Skin, Refusal> {
    let fault = |problem: String| Fault::element("skin", index, problem);
    let Some(entry) = moving.skins.get(index) else {
        let problem = format!("is referred to, but there are {}", moving.skins.len());
        return Err(fault(problem).into());
    };
    let (count, nodes) = (entry.joints.len(), reader.document.nodes.len());
    if let Some(node) = entry.joints.iter().find(|node| **node >= nodes) {
        let problem = format!("has joint node {node}, but there are {nodes}");
        return Err(fault(problem).into());
    }
    let binds = match entry.inverse_bind_matrices {
        Some(accessor) => {
            let found = reader.vectors::<16>(accessor, 16..=16, [0.0; 16])?;
            if found.len() < count {
                let problem = format!("{} inverse bind matrices, but {count} joints", found.len());
                return Err(fault(problem).into());
            }
            found
                .iter()
                .map(|m| Matrix4::from_column_slice(m))
                .collect()
        }
        None => vec![Matrix4::identity(); count],
    };
    let (starts, follows) = follows(reader, attributes, part, count, weightless)?;
    Ok(Skin {
        joints: entry.joints.iter().copied().zip(binds).collect(),
        starts,
        follows,
    })
}

/// The accessor of joints, and the joints and weights of every vertex.
type Set = (usize, Vec<[f64; 4]>, Vec<[f64; 4]>);
type Follows = (Vec<u32>, Vec<(u32, f64)>);

/// The joints that each vertex follows, with shares that add up to 1.
///
/// A vertex that follows none is held by joint 0, as browsers do it, and counted.
fn follows(
    reader: &mut Reader,
    attributes: &[(&str, usize)],
    part: &Part,
    joints: usize,
    weightless: &mut Tally,
) -> Result<Follows, Refusal> {
    let mut sets: Vec<Set> = Vec::new();
    let accessor = |name: &str| attributes.iter().find(|(n, _)| *n == name).map(|(_, a)| *a);
    for set in 0.. {
        let names = [format!("JOINTS_{set}"), format!("WEIGHTS_{set}")];
        let (Some(joint), Some(weight)) = (accessor(&names[0]), accessor(&names[1])) else {
            break;
        };
        let found = reader.vectors::<4>(joint, 4..=4, [0.0; 4])?;
        same_length(joint, found.len(), part.count)?;
        let weights = reader.vectors::<4>(weight, 4..=4, [0.0; 4])?;
        same_length(weight, weights.len(), part.count)?;
        sets.push((joint, found, weights));
    }
    let mut starts = Vec::with_capacity(part.count + 1);
    let mut follows: Vec<(u32, f64)> = Vec::with_capacity(4 * part.count);
    starts.push(0);
    for v in 0..part.count {
        let first = follows.len();
        for (accessor, numbers, weights) in &sets {
            for (joint, weight) in numbers[v].iter().zip(weights[v]) {
                if weight == 0.0 {
                    continue;
                }
                if *joint >= joints as f64 || *joint < 0.0 {
                    let problem =
                        format!("vertex {v} follows joint {joint}, but there are {joints}");
                    return Err(Fault::element("accessor", *accessor, problem).into());
                }
                follows.push((*joint as u32, weight));
            }
        }
        let sum: f64 = follows[first..].iter().map(|(_, weight)| weight).sum();
        if sum == 0.0 {
            weightless.note((part.base + v) as u64);
            follows.truncate(first);
            follows.extend((joints > 0).then_some((0, 1.0)));
        } else {
            follows[first..]
                .iter_mut()
                .for_each(|(_, weight)| *weight /= sum);
        }
        starts.push(follows.len() as u32);
    }
    Ok((starts, follows))
}

/// Warns of vertices that follow no joint.
pub fn warn_weightless(weightless: Tally, warnings: &mut Vec<Warning>) {
    let message = "vertices of a skin that follow no joint; held by its first";
    weightless.warn("vertices-without-joints", message, warnings);
}

/// The places of all nodes at a time.
pub struct Stage {
    order: Vec<(usize, Option<usize>)>,
    still: Vec<(Local, Option<Matrix4<f64>>)>,
}

impl Stage {
    /// The nodes of a document.
    pub fn of(document: &Document) -> Result<Stage, Fault> {
        let nodes = document.nodes.iter();
        Ok(Stage {
            order: scene::order(document)?,
            still: nodes
                .map(|node| {
                    let matrix = node.matrix.map(|m| Matrix4::from_column_slice(&m));
                    (Local::of(node), matrix)
                })
                .collect(),
        })
    }

    /// From the coordinates of each node to the scene's.
    pub fn places(&self, animation: &Animation, time: f64) -> Vec<Matrix4<f64>> {
        let mut places = vec![Matrix4::identity(); self.still.len()];
        for (node, above) in &self.order {
            let (still, matrix) = &self.still[*node];
            let tracks = animation.nodes.get(node).filter(|t| t.move_node());
            let local = match (tracks, matrix) {
                (Some(tracks), _) => tracks.local(*still, time).matrix(),
                (None, Some(matrix)) => *matrix,
                (None, None) => still.matrix(),
            };
            places[*node] = match above {
                Some(above) => places[*above] * local,
                None => local,
            };
        }
        places
    }
}

impl Posed {
    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.stored.len()
    }

    /// Where the vertices are at a time, given where the nodes are. Source: glTF 2.0, sections 3.7.2.2
    /// and 3.7.3.3: the place of a node that has a skin counts for nothing.
    pub fn pose(
        &self,
        animation: &Animation,
        places: &[Matrix4<f64>],
        time: f64,
        into: &mut [Vec3],
    ) {
        into.copy_from_slice(&self.stored);
        let tracks = animation.nodes.get(&self.node);
        for (i, offsets) in self.targets.iter().enumerate() {
            let moved = tracks.and_then(|tracks| tracks.weight(i, time));
            let weight = moved.unwrap_or(self.weights[i]);
            if weight == 0.0 {
                continue;
            }
            for (p, offset) in into.iter_mut().zip(offsets) {
                *p = std::array::from_fn(|c| p[c] + weight * offset[c]);
            }
        }
        let Some(skin) = &self.skin else {
            let place = rows(&places[self.node]);
            into.iter_mut().for_each(|p| *p = point(&place, *p));
            return;
        };
        let joints = skin.joints.iter().map(|(node, bind)| places[*node] * bind);
        let joints: Vec<Rows> = joints.map(|place| rows(&place)).collect();
        for (v, p) in into.iter_mut().enumerate() {
            let range = skin.starts[v] as usize..skin.starts[v + 1] as usize;
            let mut sum = [0.0; 3];
            for (joint, share) in &skin.follows[range] {
                let moved = point(&joints[*joint as usize], *p);
                sum = std::array::from_fn(|c| sum[c] + share * moved[c]);
            }
            *p = sum;
        }
    }
}

fn rows(m: &Matrix4<f64>) -> Rows {
    std::array::from_fn(|row| std::array::from_fn(|column| m[(row, column)]))
}

fn point(place: &Rows, p: Vec3) -> Vec3 {
    std::array::from_fn(|row| {
        let [x, y, z, w] = place[row];
        x * p[0] + y * p[1] + z * p[2] + w
    })
}
