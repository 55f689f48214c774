//! From an input to its surface, smoothed.

use super::select::{self, Inside};
use super::{Args, output};
use crate::destination::LABEL;
use crate::job::Job;
use scantle::error::{Error, Result, number};
use scantle::measure::smooth_error::Voxels;
use scantle::mesh::Mesh;
use scantle::volume::bits::BitGrid;
use scantle::volume::isosurface::{self, Border, Labels, Surface};
use scantle::volume::smooth_mc::lattice::{self, Given, Lattice};
use scantle::volume::smooth_mc::region::Constraint;
use scantle::volume::smooth_mc::{self, Made, Params};
use scantle::volume::{Frame, Volume};

/// A surface to be smoothed, and what is known of where it comes from.
pub struct Piece {
    /// The surface as it was.
    pub surface: Surface,
    /// The grid that it lies in.
    pub frame: Frame,
    /// What counts as inside.
    pub inside: Inside,
    /// The voxels, where they are needed to verify.
    bits: Option<BitGrid>,
    /// The mesh that it was read from.
    pub mesh: Option<(Mesh, Lattice)>,
    /// The volume that it was taken from.
    pub volume: Option<Volume>,
}

impl Piece {
    /// What its voxels are known from.
    pub fn voxels(&self, border: Border) -> Voxels<'_> {
        match (&self.bits, &self.mesh) {
            (Some(bits), _) if border == Border::Closed => Voxels::Given(bits),
            (_, Some(_)) if self.surface.ends() == 0 => Voxels::Enclosed,
            _ => Voxels::Unknown,
        }
    }

    /// Vertices of the result, as they are in the file.
    pub fn positions(&self, offsets: &[[f64; 3]]) -> Vec<[f64; 3]> {
        match &self.mesh {
            Some((mesh, lattice)) => lattice.positions(mesh, offsets),
            None => self.surface.positions(&self.frame, |v| offsets[v]),
        }
    }
}

/// The surface of a volume, smoothed.
pub fn of_volume(
    job: &mut Job,
    mut volume: Volume,
    params: &Params,
    args: &Args,
) -> Result<(Piece, Made)> {
    place(&mut volume.frame, args);
    volume.check_numbers().map_err(Error::Geometry)?;
    let what = select::inside(&volume, args)?;
    if let Inside::Labels(values) = &what {
        job.expect_each(LABEL, values.iter().copied().map(number))?;
    }
    let one = what.select();
    let dual = params.constraint == Constraint::CellCenter;
    let several = matches!(what, Inside::Labels(_));
    if several && (dual || !args.compare.is_empty()) {
        let option = if dual { "constraint" } else { "compare" };
        let problem = "takes one label, and --labels names several; give --label";
        return Err(Error::parameter(option, params.constraint.name(), problem));
    }
    let steps = volume.frame.spacing();
    let room = |job: &Job, surface: &Surface| {
        // Offsets, the steps' own list and triangles, some of them twice.
        job.expect_room("smoothing the surface", 300 * surface.len() as u128)
    };
    let (surface, made) = match &what {
        Inside::Labels(values) => {
            let labels = Labels::new(values.clone());
            let walls = isosurface::extract_labels(&volume, &labels, job.progress())?;
            room(job, &walls)?;
            let made = smooth_mc::smooth(&walls, None, steps, params, job.progress())?;
            (walls, made)
        }
        _ if dual => smooth_mc::smooth_net(&volume, &one, args.border, params, job.progress())?,
        _ => {
            let surface = isosurface::extract(&volume, &one, args.border, job.progress())?;
            room(job, &surface)?;
            let made = smooth_mc::smooth(&surface, None, steps, params, job.progress())?;
            (surface, made)
        }
    };
    job.warn(output::empty(&surface));
    let needed = !several && (args.verify.verify || !args.compare.is_empty());
    let piece = Piece {
        surface,
        frame: volume.frame,
        bits: needed.then(|| isosurface::inside(&volume, &one)),
        inside: what,
        mesh: None,
        volume: Some(volume),
    };
    Ok((piece, made))
}

/// The grid of a mesh; `None` where it shows none, and none is needed.
pub fn lattice_of(job: &Job, mesh: &Mesh, params: &Params, args: &Args) -> Result<Option<Lattice>> {
    let dual = params.constraint == Constraint::CellCenter;
    let label = args.label.map(number).unwrap_or_default();
    let level = args.threshold_value.map(number).unwrap_or_default();
    let of_volumes = [
        ("label", args.label.is_some(), label.as_str()),
        ("labels", args.labels.is_some(), "K,K"),
        ("threshold-value", args.threshold_value.is_some(), &level),
        ("constraint", dual, "cell-center"),
    ];
    if let Some((option, _, value)) = of_volumes.into_iter().find(|(_, given, _)| *given) {
        let problem = "is for volumes, and this is a mesh";
        return Err(Error::parameter(option, value, problem));
    }
    let given = Given {
        spacing: args.spacing,
        origin: args.origin,
    };
    match lattice::recover(mesh, given, job.progress()) {
        Err(Error::Geometry(_)) if params.constraint == Constraint::CellSize => Ok(None),
        other => other.map(Some),
    }
}

/// A mesh of marching cubes, smoothed.
pub fn of_mesh(
    job: &mut Job,
    mesh: Mesh,
    lattice: Lattice,
    params: &Params,
) -> Result<(Piece, Made)> {
    job.warn(lattice.warnings.clone());
    let frame = lattice.frame();
    let made = smooth_mc::smooth(
        &lattice.surface,
        Some(lattice.triangles()),
        frame.spacing(),
        params,
        job.progress(),
    )?;
    let piece = Piece {
        surface: lattice.surface.clone(),
        frame,
        inside: Inside::Set,
        bits: None,
        volume: None,
        mesh: Some((mesh, lattice)),
    };
    Ok((piece, made))
}

/// The grid where the user says that it is.
fn place(frame: &mut Frame, args: &Args) {
    if let Some(steps) = args.spacing {
        *frame = Frame::straight(frame.dims, frame.origin, steps);
    }
    if let Some(origin) = args.origin {
        frame.origin = origin;
    }
}
