//! Other surfaces beside the smooth one.

use super::Args;
use super::input::Piece;
use crate::job::Job;
use scantle::error::{Error, Result};
use scantle::measure::smooth_error::{self, Judged, Smoothed};
use scantle::mesh::Mesh;
use scantle::volume::Frame;
use scantle::volume::smooth_mc::{Params, cesn, taubin};

/// A method to compare with.
#[derive(Debug, Clone, Copy)]
pub enum Other {
    /// Marching cubes, as it was.
    Mc,
    /// Constrained elastic surface nets.
    Cesn,
    /// Smoothing without a constraint.
    Taubin,
}

impl Other {
    /// All names, in the order of the variants.
    pub const NAMES: &'static [&'static str] = &["mc", "cesn", "taubin"];

    /// The one of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        let all = [Other::Mc, Other::Cesn, Other::Taubin];
        all.into_iter().find(|other| other.name() == name)
    }

    /// Stable name.
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// The surfaces of other methods beside this one, judged alike.
pub fn compare(
    job: &mut Job,
    piece: &Piece,
    smoothed: &Smoothed,
    params: &Params,
    args: &Args,
    memory: u64,
) -> Result<Vec<Judged>> {
    if args.compare.is_empty() {
        return Ok(Vec::new());
    }
    let surface = &piece.surface;
    let spacing = smoothed.spacing;
    let zero = vec![[0.0; 3]; surface.len()];
    let mut before = smooth_error::lattice_mesh(surface, [1.0; 3], &zero, &[]);
    before.triangles = surface.triangles(&before.positions);
    let own = smooth_error::lattice_mesh(surface, [1.0; 3], smoothed.offsets, smoothed.triangles);
    let mut all = vec![("smooth-mc", own)];
    for method in &args.compare {
        let mesh = match method {
            Other::Mc => before.clone(),
            Other::Taubin => {
                let scaled = |p: &[f64; 3]| [0, 1, 2].map(|a| p[a] * spacing[a]);
                let at: Vec<[f64; 3]> = before.positions.iter().map(scaled).collect();
                let (rounds, lambda, mu) = (taubin::ROUNDS, taubin::LAMBDA, taubin::MU);
                let moved = taubin::taubin(&at, &before.triangles, rounds, lambda, mu);
                let voxels = moved.iter().map(|p| [0, 1, 2].map(|a| p[a] / spacing[a]));
                Mesh::from_triangles(voxels.collect(), before.triangles.clone())
            }
            Other::Cesn => {
                let Some(volume) = &piece.volume else {
                    let problem = "is made from a volume, and this is a mesh";
                    return Err(Error::parameter("compare", "cesn", problem));
                };
                let net = cesn::cesn(
                    volume,
                    &piece.inside.select(),
                    args.border,
                    params.threshold,
                    Params::LAPLACIAN_ITERATIONS,
                    job.progress(),
                )?;
                let frame = Frame::straight(volume.frame.dims, [0.0; 3], [1.0; 3]);
                Mesh::from_triangles(net.positions(&frame), net.triangles)
            }
        };
        all.push((method.name(), mesh));
    }
    let voxels = piece.voxels(args.border);
    let judge = |(name, mesh): &(&'static str, Mesh)| {
        smooth_error::judge(name, &before, mesh, spacing, voxels, memory, job.progress())
    };
    all.iter().map(judge).collect()
}
