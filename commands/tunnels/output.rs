//! What is written of tunnels: spheres or a surface, and beside them a table, a plot, a script, a picture.

use super::picture::picture;
use super::plot::{PLOT, plot};
use super::profile::{PROFILE, profile};
use super::script::{self, SCRIPT, Scene, script};
use crate::context::Files;
use crate::destination::stem;
use crate::job::Job;
use crate::places::drawn;
use crate::shared::Preview;
use scantle::error::Result;
use scantle::io::format::{Format, Kind};
use scantle::protein::Molecule;
use scantle::protein::clearance::{Ball, Clearance};
use scantle::protein::tunnels::{Tunnel, shape};

/// The kinds of results.
pub const KINDS: [Kind; 2] = [Kind::Molecule, Kind::Mesh];

/// What may be written beside the result.
#[derive(Debug, clap::Args)]
pub struct Extras {
    /// Write the radius along the tunnels and the nearest atoms too, as comma-separated values (RFC 4180)
    #[arg(long, value_name = "FILE")]
    profile: Option<String>,
    /// Draw the radius along the tunnels, as an SVG or PNG picture: the extension says which
    #[arg(long, value_name = "FILE")]
    plot: Option<String>,
    /// Write a script that shows molecule and tunnels, for PyMOL (.pml) or ChimeraX (.cxc)
    #[arg(long, value_name = "FILE")]
    script: Option<String>,
    #[command(flatten)]
    preview: Preview,
}

impl Extras {
    /// The files of a run, with these.
    pub fn of<'a>(&'a self, files: Files<'a>) -> Files<'a> {
        files
            .also(PROFILE, &self.profile)
            .also(PLOT, &self.plot)
            .also(SCRIPT, &self.script)
            .preview(&self.preview)
    }
}

/// Tunnels, and what they lead out of.
pub struct Found<'a> {
    /// The molecule as it was read.
    pub molecule: &'a Molecule,
    /// Its atoms that count, as balls.
    pub balls: &'a [Ball],
    /// Which atom of the molecule each ball is.
    pub atoms: &'a [u32],
    /// The tunnels, the widest first.
    pub tunnels: &'a [Tunnel],
    /// Narrower ones were not looked for.
    pub probe_radius: f64,
    /// Bytes that a surface or a picture may take.
    pub memory: u64,
}

/// Writes what the user wants: the spheres along the tunnels, or their surface where the format holds meshes,
/// and all [`Extras`].
pub fn write(job: &mut Job, found: &Found) -> Result<()> {
    let Found {
        molecule,
        balls,
        atoms,
        tunnels,
        probe_radius,
        memory,
    } = *found;
    match job.output_format().map(Format::kind) {
        Some(Kind::Mesh) => {
            let clearance = Clearance::new(balls);
            let spacing = shape::spacing_for(tunnels);
            let mesh = shape::surface(tunnels, &clearance, spacing, memory, job.progress())?;
            job.write_mesh(&mesh)?;
        }
        Some(_) => job.write_molecule(&shape::spheres(tunnels))?,
        None => {}
    }
    let input = job.input();
    let path = input.map_or(String::new(), |input| input.path.clone());
    let is_shown = input
        .and_then(|input| Format::from_name(&input.format))
        .is_some_and(|format| path != "-" && script::is_shown(format));
    let name = stem(&path);
    job.write_also(PROFILE.option, |_, _| Ok(profile(tunnels, molecule, atoms)));
    job.write_also(PLOT.option, |_, format| {
        let plot = plot(tunnels, molecule, atoms, probe_radius, &name);
        Ok(drawn(&plot, format))
    });
    let has_radii = job.output_format().is_some_and(script::holds_radii);
    let spheres = job
        .output_path()
        .filter(|_| has_radii && !tunnels.is_empty());
    let spheres = spheres.map(|path| path.display().to_string());
    let scene = Scene {
        structure: is_shown.then_some(&*path),
        spheres: spheres.as_deref(),
        tunnels,
        molecule,
        atoms,
    };
    job.write_also(SCRIPT.option, |_, format| Ok(script(&scene, format)));
    job.write_preview(|progress| picture(balls, tunnels, &name, memory, progress));
    Ok(())
}
