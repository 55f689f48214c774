//! What is found in one model, and how it is verified.

use super::Args;
use super::result::Verified;
use crate::job::Job;
use scantle::error::{At, Error, Result};
use scantle::measure::passage::passage;
use scantle::protein::Molecule;
use scantle::protein::radii::Radii;
use scantle::protein::select::{SelectParams, Selected};
use scantle::protein::tunnels::pores::pores;
use scantle::protein::tunnels::{
    Exit, Method, Origin, Params, Searched, TRADE, Tunnel, Widest, find,
};
use scantle::report::{Accuracy, Measures};

/// One model's atoms that count, and what was found between them.
pub struct Model {
    /// Its number in the file.
    pub number: i32,
    /// The atoms that count.
    pub selected: Selected,
    /// Where ways start; none for pores.
    pub start: Option<Origin>,
    /// The widest way out; none for pores, and where nothing is enclosed.
    pub widest: Option<Widest>,
    /// Tunnels or pores, the widest first.
    pub tunnels: Vec<Tunnel>,
    /// Ways left out because their mouth or their course is that of a wider one.
    pub merged: u64,
    /// Mouths, for pores.
    pub mouths: Option<u64>,
    /// What was searched.
    pub searched: Searched,
}

/// Finds the tunnels of a model, or its pores.
pub fn solve(
    job: &Job,
    molecule: &Molecule,
    index: usize,
    params: &Params,
    args: &Args,
    radii: &Radii,
) -> Result<Model> {
    let start = match args.from() {
        Some(from) => Some(from.resolve(molecule, index)?),
        None => None,
    };
    let select = SelectParams {
        keep: args.keep.clone(),
        drop: start.as_ref().map_or(vec![], |start| start.drop.clone()),
        radii: radii.clone(),
    };
    let selected = Selected::of(molecule, index, &select)?;
    let number = molecule.models[index].number;
    let Some(start) = start else {
        let found = pores(&selected.balls, params, job.progress())?;
        let atoms = selected.balls.len() as u64;
        return Ok(Model {
            number,
            selected,
            start: None,
            widest: None,
            tunnels: found.pores,
            merged: 0,
            mouths: Some(found.mouths),
            searched: Searched {
                cells: found.cells,
                gates: found.gates,
                triangulations: 1,
                atoms,
                bytes: found.bytes,
                ..Searched::default()
            },
        });
    };
    let found = find(&selected.balls, start.position, params, job.progress());
    let found = found.map_err(|error| named_atom(error, molecule, &selected))?;
    Ok(Model {
        number,
        selected,
        start: Some(found.start),
        widest: found.widest,
        tunnels: found.tunnels,
        merged: found.merged,
        mouths: None,
        searched: found.searched,
    })
}

/// An error about one of the balls as one about an atom of the file.
fn named_atom(error: Error, molecule: &Molecule, selected: &Selected) -> Error {
    match error {
        Error::Geometry(mut fault) => {
            if let At::Element("atom", ball) = fault.at {
                let index = selected.atoms[ball as usize];
                let atom = &molecule.atoms[index as usize];
                let residue = molecule.residue_of(atom);
                fault.at = At::Element("atom", u64::from(index));
                fault.problem += &format!(
                    ": {} of {} {residue}, serial {}",
                    atom.name, residue.name, atom.serial
                );
            }
            Error::Geometry(fault)
        }
        other => other,
    }
}

/// How far apart the bounds of the octree may be, over the width of the start.
const OCTREE: f64 = 0.005;

/// Finds the exact width of the widest way, and asks an octree, which shares nothing with that, whether it is
/// right.
///
/// Both go on to infinity. From the solvent that is no narrower: its probe came from there. And the place
/// where ways start, which is held here, may lie in a cell that the solvent holds, though the cell whose dual
/// vertex it is does not.
pub fn verify(job: &Job, model: &Model, params: &Params) -> Result<Option<Verified>> {
    let (Some(start), Some(_)) = (&model.start, &model.widest) else {
        return Ok(None);
    };
    job.progress().stage("verify", 0);
    let exact = Params {
        method: Method::Exact,
        exit: Exit::Hull,
        start_search: 0.0,
        count: 1,
        ..*params
    };
    let balls = &model.selected.balls;
    let exact = find(balls, start.used, &exact, job.progress())?;
    let tolerance = OCTREE * start.clearance;
    let octree = passage(balls, start.used, tolerance, params.memory, job.progress())?;
    Ok(exact.widest.map(|exact| Verified::new(&exact, &octree)))
}

/// By how much a way might be wider than the one found.
pub fn accuracy(model: &Model, verified: Option<&Verified>) -> Measures {
    let widest = model.widest.as_ref();
    let above = |upper: f64| widest.map(|w| (upper - w.narrowest.radius).max(0.0));
    Measures::One(Accuracy {
        measure: TRADE.error.name.to_owned(),
        unit: TRADE.error.unit.to_owned(),
        bound: widest.and_then(|w| above(w.upper)),
        reached: verified.and_then(|v| above(v.exact[1])),
        reference: TRADE.reference.to_owned(),
        verified: verified.is_some_and(Verified::agrees),
    })
}
