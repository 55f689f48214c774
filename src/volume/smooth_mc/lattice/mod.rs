//! What a mesh alone tells of the binary volume that it was taken from.
//!
//! Vertices of marching cubes lie halfway between two voxel centres, whence their coordinates are
//! whole numbers of half voxels; which of the three is odd tells the axis of the vertex's edge. Spacing
//! and origin are read from the coordinates (`detect`), all vertices are held to that rule, and the
//! net of curves that the smoothing works on is found in the triangles (`net`). Any mesh that marching
//! cubes made will do, however its cells were split and however its vertices are numbered or repeated.
//!
//! Source: "Constrained smoothing of marching cubes surfaces" (WSCG), section 3, with these repairs:
//! the distances of neighbours give no more than a first guess, for many meshes show but one of the
//! two; spacing and origin are fitted to all coordinates; the edge of a vertex follows from parity,
//! where rounding to cells meets ties.

mod detect;
mod net;
#[cfg(test)]
mod tests;

use crate::error::{Error, Fault, Result, number};
use crate::mesh::Mesh;
use crate::numeric::vector::Vec3;
use crate::progress::Progress;
use crate::report::Warning;
use crate::volume::Frame;
use crate::volume::isosurface::{NONE, Surface};
use rayon::prelude::*;

/// The largest distance from the lattice that a coordinate may have, in half voxels.
pub const RESIDUAL: f64 = 0.02;

/// Places stay below this, so that three of them and more fit into one key.
const MOST: i32 = (1 << 30) - 4;

/// Corners are numbered in 32 bits, vertices in 30.
const MOST_TRIANGLES: usize = (u32::MAX / 3) as usize;

/// What is known of the volume beforehand.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Given {
    /// Distance of voxels along x, y, z.
    pub spacing: Option<Vec3>,
    /// Centre of voxel (0, 0, 0).
    pub origin: Option<Vec3>,
}

/// The volume's lattice and the surface on it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lattice {
    /// The surface: its loops are the triangles of the mesh in their order, less those that are
    /// degenerate or repeated, counter-clockwise from outside.
    pub surface: Surface,
    /// The vertex of the surface that each vertex of the mesh is; `NONE` for those that no triangle
    /// uses. Vertices of the surface are in the order of the first that stand for them, so that the
    /// numbers are equal where the mesh repeats none and uses all.
    pub vertex_of: Vec<u32>,
    /// Distance of voxels along x, y, z.
    pub spacing: Vec3,
    /// Centre of voxel (0, 0, 0); where it was not given, no place on the surface is below 0, and some
    /// are 0 or 1 along each axis.
    pub origin: Vec3,
    /// Whether the spacing was read from the mesh.
    pub spacing_detected: bool,
    /// The largest distance of a coordinate from the lattice, in half voxels.
    pub residual: f64,
    /// Vertices of the mesh at the place of an earlier one.
    pub duplicate_vertices: u64,
    /// Whether the mesh is inside out; the surface is not.
    pub inverted: bool,
    /// What looks wrong.
    pub warnings: Vec<Warning>,
}

impl Lattice {
    /// The triangles of the surface.
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.surface.loops.corners.as_chunks::<3>().0
    }

    /// The grid from voxel (0, 0, 0) to the last voxel beside the surface.
    pub fn frame(&self) -> Frame {
        let mut dims = [0; 3];
        for place in &self.surface.places {
            for a in 0..3 {
                dims[a] = dims[a].max((place[a] + 3).max(0) as usize / 2);
            }
        }
        Frame::straight(dims, self.origin, self.spacing)
    }

    /// The places of the mesh's vertices, each moved by so many voxels from the middle of its edge;
    /// those that no triangle uses stay. `moved` counts as the surface does.
    pub fn positions(&self, mesh: &Mesh, moved: &[Vec3]) -> Vec<Vec3> {
        (mesh.positions.par_iter())
            .zip(&self.vertex_of)
            .map(|(old, v)| {
                if *v == NONE {
                    return *old;
                }
                let (place, offset) = (self.surface.places[*v as usize], moved[*v as usize]);
                std::array::from_fn(|a| {
                    self.origin[a] + (0.5 * f64::from(place[a]) + offset[a]) * self.spacing[a]
                })
            })
            .collect()
    }
}

/// Finds the lattice of the binary volume that a mesh was taken from by marching cubes.
///
/// The unit is the mesh's. A closed mesh that is inside out as a whole is turned, with a warning; of an
/// open one that cannot be told. Errs for parameters out of range; where a vertex does not lie in the
/// middle of an edge of the lattice or a triangle reaches over more than one cell, with the share of
/// those; where triangles beside each other are turned opposite ways; and where an open mesh does not
/// show the spacing. Cost: two sorts of the vertices, all else linear; some 200 bytes per vertex.
pub fn recover(mesh: &Mesh, given: Given, progress: &dyn Progress) -> Result<Lattice> {
    check(mesh, &given)?;
    let mut lattice = Lattice {
        vertex_of: vec![NONE; mesh.positions.len()],
        spacing: given.spacing.unwrap_or([1.0; 3]),
        origin: given.origin.unwrap_or([0.0; 3]),
        spacing_detected: given.spacing.is_none(),
        ..Lattice::default()
    };
    if mesh.triangles.is_empty() {
        return Ok(lattice);
    }
    progress.stage("detect", 0);
    let mut used = vec![false; mesh.positions.len()];
    for v in mesh.triangles.iter().flatten() {
        used[*v as usize] = true;
    }
    let found = detect::detect(mesh, &used, &given, progress)?;
    lattice.spacing = found.spacing;
    lattice.origin = found.origin;
    lattice.residual = found.residual;
    progress.stage("link", 0);
    let welded = net::weld(&found.places, &used);
    lattice.duplicate_vertices = welded.duplicates;
    let net = net::Net::new(mesh, welded).map_err(Error::Geometry)?;
    net.give(&mut lattice);
    Ok(lattice)
}

fn check(mesh: &Mesh, given: &Given) -> Result<()> {
    let text = |v: Vec3| v.map(number).join(",");
    if let Some(spacing) = given.spacing
        && !spacing.iter().all(|s| s.is_finite() && *s > 0.0)
    {
        let problem = "has a number that is not positive";
        return Err(Error::parameter("spacing", text(spacing), problem));
    }
    if let Some(origin) = given.origin
        && !origin.iter().all(|s| s.is_finite())
    {
        let problem = "has a number that is not finite";
        return Err(Error::parameter("origin", text(origin), problem));
    }
    let most_vertices = (NONE >> 2) as usize;
    if mesh.triangles.len() > MOST_TRIANGLES || mesh.positions.len() > most_vertices {
        return Err(Error::Limit {
            what: "the surface".into(),
            needed: format!(
                "{} triangles and {} vertices",
                mesh.triangles.len(),
                mesh.positions.len()
            ),
            limit: format!("{MOST_TRIANGLES} triangles and {most_vertices} vertices"),
            hint: None,
        });
    }
    Ok(())
}

/// What is left for a mesh that is none of marching cubes.
fn refused(problem: String) -> Fault {
    let hint = "--constraint cell-size with --spacing takes any mesh";
    Fault::whole(problem).with_hint(hint)
}
