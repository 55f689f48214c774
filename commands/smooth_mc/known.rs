//! What a run knows beside its inputs.

use super::input::Piece;
use super::result::Directions;
use super::{Args, names};
use scantle::error::Result;
use scantle::io::read_mesh;
use scantle::io::source::Source;
use scantle::measure::normal_error::normal_rms_deg;
use scantle::mesh::Mesh;
use std::collections::BTreeMap;

/// What options name, read once for all inputs.
pub struct Known {
    /// Bytes that may be taken.
    pub memory: u64,
    /// The true shape.
    pub reference: Option<Mesh>,
    /// Names of labels.
    pub names: BTreeMap<String, String>,
}

impl Known {
    /// Reads what the options name.
    pub fn read(args: &Args, memory: u64) -> Result<Self> {
        let mesh = |file: &String| Ok(read_mesh(&Source::open(file, memory)?, None)?.0);
        let names = args.label_names.as_ref();
        Ok(Known {
            memory,
            reference: args.reference.as_ref().map(mesh).transpose()?,
            names: names.map_or(Ok(BTreeMap::new()), |file| names::read(file, memory))?,
        })
    }

    /// How far triangles are turned from those of the true shape, before and after.
    pub fn directions(&self, piece: &Piece, smooth: &Mesh) -> Result<Option<Directions>> {
        let Some(reference) = &self.reference else {
            return Ok(None);
        };
        let before = Mesh {
            positions: piece.positions(&vec![[0.0; 3]; piece.surface.len()]),
            ..smooth.clone()
        };
        Ok(Some(Directions {
            before: normal_rms_deg(&before, reference)?,
            after: normal_rms_deg(smooth, reference)?,
        }))
    }
}
