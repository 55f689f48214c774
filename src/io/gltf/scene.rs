//! The nodes of the default scene and where they put their meshes.

use super::document::{Document, Node};
use crate::error::Fault;
use crate::numeric::vector::{Vec3, cross, dot};
use nalgebra::{Matrix4, Quaternion, Translation3, UnitQuaternion};

/// A mesh with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// The node that holds it.
    pub node: usize,
    /// The mesh.
    pub mesh: usize,
    /// Whether the node has a skin too.
    pub skinned: bool,
    /// Whether an extension makes several instances of it.
    pub instanced: bool,
    /// From the mesh's coordinates to the scene's.
    pub transform: Matrix4<f64>,
}

impl Placed {
    /// A point of the mesh in the scene.
    pub fn point(&self, p: Vec3) -> Vec3 {
        let m = &self.transform;
        std::array::from_fn(|row| {
            m[(row, 0)] * p[0] + m[(row, 1)] * p[1] + m[(row, 2)] * p[2] + m[(row, 3)]
        })
    }

    /// The columns of the linear part.
    fn columns(&self) -> [Vec3; 3] {
        std::array::from_fn(|column| std::array::from_fn(|row| self.transform[(row, column)]))
    }

    /// Whether it mirrors: the determinant is negative.
    pub fn mirrors(&self) -> bool {
        let [a, b, c] = self.columns();
        dot(a, cross(b, c)) < 0.0
    }

    /// A normal of the mesh in the scene, not of unit length.
    ///
    /// By the cofactors of the linear part: the inverse transpose times the determinant, defined
    /// for a node that flattens too.
    pub fn normal(&self, n: Vec3) -> Vec3 {
        let [a, b, c] = self.columns();
        let sign = if self.mirrors() { -1.0 } else { 1.0 };
        let (x, y, z) = (cross(b, c), cross(c, a), cross(a, b));
        std::array::from_fn(|i| sign * (x[i] * n[0] + y[i] * n[1] + z[i] * n[2]))
    }
}

/// All meshes of the default scene, nodes in the order of a walk from parents to children.
///
/// A child that does not exist, has two parents, or is above itself is a fault.
pub fn placed(document: &Document) -> Result<Vec<Placed>, Fault> {
    let nodes = &document.nodes;
    let roots = roots(document)?;
    let mut found = Vec::new();
    let mut seen = vec![false; nodes.len()];
    let mut stack: Vec<(usize, Matrix4<f64>)> = Vec::new();
    stack.extend(roots.iter().rev().map(|root| (*root, Matrix4::identity())));
    while let Some((index, above)) = stack.pop() {
        let node = nodes.get(index).ok_or_else(|| {
            let problem = format!("is in the scene, but there are {}", nodes.len());
            Fault::element("node", index, problem)
        })?;
        if std::mem::replace(&mut seen[index], true) {
            let problem =
                "is in the scene twice: as a root and below another node, or as two roots";
            return Err(Fault::element("node", index, problem));
        }
        let transform = above * local(node);
        if !transform.iter().all(|v| v.is_finite()) {
            let problem = "its transform is not finite";
            return Err(Fault::element("node", index, problem));
        }
        if let Some(mesh) = node.mesh {
            found.push(Placed {
                node: index,
                mesh,
                skinned: node.skin.is_some(),
                instanced: node.extensions.contains_key("EXT_mesh_gpu_instancing"),
                transform,
            });
        }
        stack.extend(node.children.iter().rev().map(|c| (*c, transform)));
    }
    Ok(found)
}

/// The nodes that the default scene shows with all below them. Errs as [`placed`] does.
fn roots(document: &Document) -> Result<Vec<usize>, Fault> {
    let nodes = &document.nodes;
    let parents = parents(nodes)?;
    match (document.scene, document.scenes.as_slice()) {
        (None, []) => Ok((0..nodes.len()).filter(|n| parents[*n].is_none()).collect()),
        (scene, scenes) => {
            let index = scene.unwrap_or(0);
            let scene = scenes.get(index).ok_or_else(|| {
                let problem = format!("is the default, but there are {}", scenes.len());
                Fault::element("scene", index, problem)
            })?;
            Ok(scene.nodes.clone())
        }
    }
}

/// All nodes, each after the one above it, with that one: those of the default scene first, whose
/// roots have none, then the others.
///
/// Errs as [`placed`] does; what that takes is taken.
pub fn order(document: &Document) -> Result<Vec<(usize, Option<usize>)>, Fault> {
    let nodes = &document.nodes;
    let parents = parents(nodes)?;
    let others = (0..nodes.len()).filter(|n| parents[*n].is_none());
    let mut seen = vec![false; nodes.len()];
    let mut order = Vec::with_capacity(nodes.len());
    for root in roots(document)?.into_iter().chain(others) {
        let mut stack = vec![(root, None)];
        while let Some((node, above)) = stack.pop() {
            if std::mem::replace(&mut seen[node], true) {
                continue;
            }
            order.push((node, above));
            stack.extend(nodes[node].children.iter().map(|c| (*c, Some(node))));
        }
    }
    Ok(order)
}

/// The parent of every node; each has one at most and none is above itself.
fn parents(nodes: &[Node]) -> Result<Vec<Option<usize>>, Fault> {
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for child in &node.children {
            let Some(parent) = parents.get_mut(*child) else {
                let problem = format!("has child {child}, but there are {} nodes", nodes.len());
                return Err(Fault::element("node", index, problem));
            };
            if let Some(first) = parent.replace(index) {
                let problem = format!("is a child of both node {first} and node {index}");
                return Err(Fault::element("node", *child, problem));
            }
        }
    }
    // Upwards from each node to one that is known to end at a root. A node that this walk meets
    // again is above itself.
    let mut walk_of = vec![usize::MAX; nodes.len()];
    for start in 0..nodes.len() {
        let mut at = Some(start);
        while let Some(node) = at.filter(|n| walk_of[*n] != start) {
            if walk_of[node] != usize::MAX {
                break;
            }
            walk_of[node] = start;
            at = parents[node];
        }
        if let Some(node) = at.filter(|n| walk_of[*n] == start) {
            return Err(Fault::element(
                "node",
                node,
                "is among the nodes below itself",
            ));
        }
    }
    Ok(parents)
}

/// The transform of a node: its matrix, or scale, then rotation, then translation.
fn local(node: &Node) -> Matrix4<f64> {
    match node.matrix {
        Some(matrix) => Matrix4::from_column_slice(&matrix),
        None => Local::of(node).matrix(),
    }
}

/// Where a node is in the one above it, in parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Local {
    /// What it is moved by, at last.
    pub translation: Option<[f64; 3]>,
    /// What it is turned by: x, y, z, w of a quaternion of any length.
    pub rotation: Option<[f64; 4]>,
    /// What it is scaled by, at first.
    pub scale: Option<[f64; 3]>,
}

impl Local {
    /// The parts that the node states.
    pub fn of(node: &Node) -> Local {
        Local {
            translation: node.translation,
            rotation: node.rotation,
            scale: node.scale,
        }
    }

    /// All in one.
    pub fn matrix(&self) -> Matrix4<f64> {
        let [x, y, z] = self.translation.unwrap_or([0.0; 3]);
        let mut transform = Translation3::new(x, y, z).to_homogeneous();
        if let Some([x, y, z, w]) = self.rotation {
            // A file holds rotations in single precision, of unit length as far as that goes; one of
            // zero length turns nothing.
            let rotation = Quaternion::new(w, x, y, z);
            if let Some(unit) = UnitQuaternion::try_new(rotation, 0.0) {
                transform *= unit.to_homogeneous();
            }
        }
        if let Some([x, y, z]) = self.scale {
            transform *= Matrix4::new_nonuniform_scaling(&nalgebra::Vector3::new(x, y, z));
        }
        transform
    }
}
