//! Whether the inside of a filled model is set, by another winding number than the fill's.

use super::{Cells, Held, SAMPLE_ROUNDING};
use crate::measure::surface::{Elements, Surface};
use crate::measure::winding_number::{Rule, WindingNumber};
use crate::mesh::Mesh;
use crate::numeric::rng::Rng;
use crate::numeric::vector::Vec3;
use crate::spatial::local::LocalFrame;
use crate::volume::Volume;
use crate::volume::voxelize::{Fill, Orientation};
use rayon::prelude::*;

/// Voxels of a filled grid whose centres are judged, set or not, drawn evenly from all by this seed.
pub(super) const INSIDE_SAMPLES: u64 = 1 << 16;
const SEED: u64 = 0;

/// What is inside of a filled model.
pub(super) struct Inside {
    winding: WindingNumber,
    rule: Rule,
}

impl Inside {
    /// Nothing without a fill.
    pub(super) fn of(mesh: &Mesh, fill: Fill, orientation: &Orientation) -> Option<Self> {
        let rule = match fill {
            Fill::None => return None,
            Fill::Parity => Rule::Parity,
            Fill::Winding => Rule::Winding,
        };
        let corners = |t: usize| {
            let [a, b, c] = mesh.corners(t);
            let reversed = orientation.reversed.get(t).copied().unwrap_or(false);
            if reversed != orientation.inverted {
                [a, c, b]
            } else {
                [a, b, c]
            }
        };
        Some(Inside {
            winding: WindingNumber::new((0..mesh.triangles.len()).map(corners).collect()),
            rule,
        })
    }

    /// Whether a point is inside; where that is open, `open`.
    pub(super) fn holds(&self, p: Vec3, open: bool) -> bool {
        self.winding.is_inside(p, self.rule).unwrap_or(open)
    }
}

/// What sampled voxels say of the inside.
pub(super) struct Filled {
    /// Those whose centre is inside.
    pub(super) samples: u64,
    /// Those of them that are not set.
    pub(super) missed: u64,
    /// Largest distance from the centre of one to a set voxel; none where none is set.
    pub(super) farthest: Option<f64>,
}

/// Judges voxels drawn from all of the grid.
pub(super) fn missed_inside(mesh: &Mesh, made: &Volume, cells: &Cells, inside: &Inside) -> Filled {
    let held = Held::of(made);
    let dims = made.frame.dims;
    let elements = Elements::all_of(mesh);
    let frame = LocalFrame::around(elements.bounds(mesh));
    let surface = Surface::new(mesh, elements, &frame);
    // On the surface a centre is neither in nor out.
    let is_clear =
        |p: Vec3| frame.length(surface.nearest(frame.to_local(p), 0).distance) > SAMPLE_ROUNDING;
    let judge = |i: u64| {
        let mut rng = Rng::new(SEED, i);
        let at = dims.map(|d| rng.below(d));
        let p = at.map(|c| c as f64 + 0.5);
        if !inside.holds(p, false) {
            return None;
        }
        let [x, y, z] = at;
        let missed = !held.get(x, y, z) && is_clear(p);
        Some((missed, if missed { cells.distance(p) } else { Some(0.0) }))
    };
    let judged: Vec<(bool, Option<f64>)> = if mesh.triangles.is_empty() {
        Vec::new()
    } else {
        let draws = (0..INSIDE_SAMPLES).into_par_iter();
        draws.filter_map(judge).collect()
    };
    let distances: Option<Vec<f64>> = judged.iter().map(|(_, d)| *d).collect();
    Filled {
        samples: judged.len() as u64,
        missed: judged.iter().filter(|(missed, _)| *missed).count() as u64,
        farthest: distances.and_then(|all| all.into_iter().reduce(f64::max)),
    }
}
