//! The input that is taken to the extremes: read, told from others, and written again.

use crate::machine;
use scantle::error::{Error, Fault, Result};
use scantle::io::format::{Format, Kind};
use scantle::io::sink::Sink;
use scantle::io::source::Source;
use scantle::io::{self, Content};
use scantle::measure::stability::Subject;
use scantle::protein::Molecule;
use scantle::protein::select::{SelectParams, Selected};
use scantle::report::Input;

/// Reads a mesh, or the atoms of a molecule that count: those of the first model.
pub fn read(name: &str, format: Option<Format>) -> Result<(Subject, Input)> {
    let source = Source::open(name, machine::default_memory())?;
    let (content, input, _) = io::read_one_of(&source, format, &[Kind::Mesh, Kind::Molecule])?;
    let subject = match content {
        Content::Mesh(mesh) => Subject::Mesh(mesh),
        Content::Molecule(molecule) => {
            let selected = Selected::of(&molecule, 0, &SelectParams::default());
            let selected = selected.map_err(|error| match error {
                Error::Geometry(fault) => Error::Malformed {
                    path: name.into(),
                    fault,
                },
                other => other,
            })?;
            Subject::Atoms(selected.balls)
        }
        other => {
            let found = other.kind().with_article();
            let problem = format!("holds {found}, but a mesh or a molecule is needed");
            return Err(Error::Malformed {
                path: name.into(),
                fault: Fault::whole(problem),
            });
        }
    };
    Ok((subject, input))
}

/// The format that a changed input is written in: it keeps every number.
pub fn format_of(subject: &Subject) -> Format {
    match subject {
        Subject::Mesh(_) => Format::Ply,
        Subject::Atoms(_) => Format::Xyzr,
    }
}

/// Writes a changed input.
pub fn write(subject: &Subject, sink: &Sink) -> Result<()> {
    let format = format_of(subject);
    let written = match subject {
        Subject::Mesh(mesh) => io::write_mesh(mesh, sink, format)?,
        Subject::Atoms(balls) => {
            let molecule = Molecule::of_spheres(balls).map_err(Error::Geometry)?;
            io::write_molecule(&molecule, sink, format)?
        }
    };
    drop(written);
    Ok(())
}
