//! The input that is taken to the extremes: read, told from others, and written again.

use crate::compress_anim::sources::{self, Sampling};
use crate::machine;
use crate::wrapped::Wrapped;
use scantle::error::{Error, Fault, Result};
use scantle::io::format::{Format, Kind};
use scantle::io::sink::Sink;
use scantle::io::source::Source;
use scantle::io::{self, Content, sequence};
use scantle::measure::stability::Subject;
use scantle::protein::Molecule;
use scantle::protein::select::{SelectParams, Selected};
use scantle::report::Input;
use std::path::Path;

/// Options that say how animations are read: what they say is in the frames that are written.
const OF_ANIMATIONS: &[&str] = &["base", "animation", "input-format"];

/// Reads the input of a command: an animation where it makes one, else a mesh, or the atoms of a
/// molecule that count.
pub fn read(name: &str, wrapped: &Wrapped) -> Result<(Subject, Vec<Input>)> {
    let made = Format::from_name(wrapped.trade.result).map(Format::kind);
    match made {
        Some(Kind::Animation) => read_animation(name, wrapped),
        _ => read_still(name, wrapped.format()).map(|(subject, input)| (subject, vec![input])),
    }
}

/// Reads an animation, with the faces of the mesh that `--base` names.
fn read_animation(name: &str, wrapped: &Wrapped) -> Result<(Subject, Vec<Input>)> {
    let (animation, base) = (wrapped.value("animation"), wrapped.value("base"));
    let sampling = Sampling {
        rate: wrapped.value("fps").and_then(|rate| rate.parse().ok()),
        animation: animation.as_deref(),
    };
    let memory = machine::default_memory();
    let (clip, mut inputs, _) = sources::animation(name, wrapped.format(), sampling, memory)?;
    let Some(base) = base else {
        return Ok((Subject::Clip(clip), inputs));
    };
    let (mesh, input, _) = io::read_mesh(&Source::open(&base, memory)?, None)?;
    inputs.push(input);
    Ok((
        Subject::Clip(sources::with_base(clip, mesh, &base)?),
        inputs,
    ))
}

/// Reads a mesh, splats, or the atoms of a molecule that count: those of the first model.
fn read_still(name: &str, format: Option<Format>) -> Result<(Subject, Input)> {
    let source = Source::open(name, machine::default_memory())?;
    let (content, input, _) =
        io::read_one_of(&source, format, &[Kind::Mesh, Kind::Molecule, Kind::Splats])?;
    let subject = match content {
        Content::Mesh(mesh) => Subject::Mesh(mesh),
        Content::Splats(splats) => Subject::Splats(splats),
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
            let problem = format!("holds {found}, but a mesh, splats or a molecule is needed");
            return Err(Error::Malformed {
                path: name.into(),
                fault: Fault::whole(problem),
            });
        }
    };
    Ok((subject, input))
}

/// The format that a changed input is written in, or each of its frames: it keeps every number.
pub fn format_of(subject: &Subject) -> Format {
    match subject {
        Subject::Mesh(_) | Subject::Clip(_) => Format::Ply,
        Subject::Atoms(_) => Format::Xyzr,
        Subject::Splats(_) => Format::Splats,
    }
}

/// The options that a changed input stands for, and that its run has not.
pub fn stands_for(subject: &Subject) -> &'static [&'static str] {
    match subject {
        Subject::Clip(_) => OF_ANIMATIONS,
        Subject::Mesh(_) | Subject::Atoms(_) | Subject::Splats(_) => &[],
    }
}

/// Writes a changed input: to a file, or frame by frame to a folder.
pub fn write(subject: &Subject, path: &Path) -> Result<()> {
    let (format, sink) = (format_of(subject), Sink::File(path.to_owned()));
    let written = match subject {
        Subject::Mesh(mesh) => io::write_mesh(mesh, &sink, format)?,
        Subject::Atoms(balls) => {
            let molecule = Molecule::of_spheres(balls).map_err(Error::Geometry)?;
            io::write_molecule(&molecule, &sink, format)?
        }
        Subject::Splats(splats) => io::write_splats(splats, &sink, format)?,
        Subject::Clip(clip) => sequence::write(clip, &format!("{}/", path.display()), format)?,
    };
    drop(written);
    Ok(())
}
