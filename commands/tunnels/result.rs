//! What the report says of tunnels.

use super::models::FailedModel;
use super::solve::Model;
use scantle::measure::passage::Passage;
use scantle::protein::select::SelectionCounts;
use scantle::protein::tunnels::{Narrowest, Params, Stop, Tunnel, Widest};
use scantle::protein::{Molecule, Residue};
use scantle::report::Warning;
use schemars::JsonSchema;
use serde::Serialize;

/// What was found.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// The first model that was asked for, of those that did not fail.
    #[serde(flatten)]
    pub own: Solved,
    /// The width of the widest way by other means, with `--verify`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verified: Option<Verified>,
    /// The others, with `--models all`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_models: Option<Vec<Solved>>,
    /// Models that nothing can be found in, with `--models all`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failed_models: Option<Vec<FailedModel>>,
}

/// The width of the widest way, between two bounds each, by two means that share nothing.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Verified {
    /// By regular triangulations.
    pub exact: [f64; 2],
    /// By an octree.
    pub octree: [f64; 2],
    /// Its cells.
    pub octree_cells: u64,
}

impl Verified {
    /// What both say.
    pub fn new(exact: &Widest, octree: &Passage) -> Self {
        Verified {
            exact: [exact.lower, exact.upper],
            octree: [octree.lower, octree.upper],
            octree_cells: octree.cells,
        }
    }

    /// Whether both may be right.
    pub fn agrees(&self) -> bool {
        let room = 1e-9 * self.exact[1].abs();
        self.octree[0] <= self.exact[1] + room && self.exact[0] <= self.octree[1] + room
    }
}

/// A warning where the two do not agree.
pub fn doubts(verified: Option<&Verified>) -> Vec<Warning> {
    let wrong = verified.filter(|v| !v.agrees());
    let warning = |v: &Verified| {
        let [[a, b], [c, d]] = [v.exact, v.octree];
        let message =
            format!("the exact width, {a} to {b}, is not what the octree has, {c} to {d}");
        Warning::new("references-disagree", message, 1, None)
    };
    wrong.map(warning).into_iter().collect()
}

/// What was found in one model.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Solved {
    /// Number of the model.
    model: i32,
    /// What was selected.
    selection: SelectionCounts,
    /// Where ways start.
    /// Null for pores.
    start: Option<StartUsed>,
    /// The widest way out, narrower than the probe or not; null for pores, and where nothing is enclosed.
    widest: Option<Bottleneck>,
    /// Tunnels, or pores, the widest first.
    tunnels: Vec<TunnelFound>,
    /// Ways left out because their mouth or their course is that of a wider one.
    merged: u64,
    /// Mouths that ways as wide as the probe lead to; null but for pores.
    mouths: Option<u64>,
    /// What was searched.
    graph: Searched,
}

/// Where ways start.
#[derive(Debug, Serialize, JsonSchema)]
struct StartUsed {
    /// As asked for, the middle of residues or atoms.
    given: [f64; 3],
    /// The point used.
    used: [f64; 3],
    /// Radius of the largest ball there that enters no atom.
    clearance: f64,
    /// Whether the start is the narrowest place of the widest way.
    limited: bool,
}

/// The narrowest place of a way.
#[derive(Debug, Serialize, JsonSchema)]
struct Bottleneck {
    /// Radius, as the method has it.
    radius: f64,
    /// A ball of this radius passes: the least clearance along the way.
    lower: f64,
    /// No ball larger than this passes by any way; null but for the first tunnel.
    upper: Option<f64>,
    /// Where it is.
    point: [f64; 3],
    /// The nearest atoms there, nearest first.
    atoms: Vec<AtomNamed>,
    /// Their residues, each once.
    residues: Vec<ResidueNamed>,
}

/// An atom.
#[derive(Debug, Serialize, JsonSchema)]
struct AtomNamed {
    /// Index in the file, from 0.
    index: u32,
    /// Its number in the file.
    serial: i64,
    /// Its name.
    name: String,
    /// Its residue, as in `HIS A:272`.
    residue: String,
}

/// A residue.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
struct ResidueNamed {
    /// Its name.
    name: String,
    /// Its chain.
    chain: String,
    /// Its number in the chain.
    number: i32,
    /// Its insertion code, where it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    insertion: Option<char>,
}

/// A tunnel.
#[derive(Debug, Serialize, JsonSchema)]
struct TunnelFound {
    /// Its narrowest place.
    bottleneck: Bottleneck,
    /// Length of its centreline.
    length: f64,
    /// That over the straight way between its ends.
    curvature: f64,
    /// The integral of `1 / r^2` along it.
    cost: f64,
    /// `exp(-cost)`.
    throughput: f64,
    /// Its end.
    exit_point: [f64; 3],
    /// Spheres along it that enter no atom.
    spheres: Vec<Stop>,
    /// Residues with an atom within 3 of its surface, in the order of the file.
    lining_residues: Vec<ResidueNamed>,
}

/// What was searched.
#[derive(Debug, Serialize, JsonSchema)]
struct Searched {
    /// Tetrahedra of the triangulation that was searched last; points of the box, for a grid.
    cells: u64,
    /// Facets whose width was worked out; points, for a grid.
    gates: u64,
    /// Cells or points settled by the searches for the widest way.
    settled: u64,
    /// Cells that the solvent holds.
    outside: u64,
    /// Triangulations made.
    triangulations: u64,
}

impl ResidueNamed {
    fn new(residue: &Residue) -> Self {
        ResidueNamed {
            name: residue.name.to_string(),
            chain: residue.chain.to_string(),
            number: residue.number,
            insertion: Some(char::from(residue.insertion)).filter(|code| *code != ' '),
        }
    }
}

/// The names of balls in a molecule.
struct Names<'a> {
    molecule: &'a Molecule,
    atoms: &'a [u32],
}

impl Names<'_> {
    fn residues(&self, balls: &[u32]) -> Vec<ResidueNamed> {
        let mut named: Vec<u32> = Vec::new();
        for ball in balls {
            let atom = &self.molecule.atoms[self.atoms[*ball as usize] as usize];
            if !named.contains(&atom.residue) {
                named.push(atom.residue);
            }
        }
        let residue = |index: &u32| ResidueNamed::new(&self.molecule.residues[*index as usize]);
        named.iter().map(residue).collect()
    }

    fn bottleneck(&self, narrowest: &Narrowest, radius: f64, upper: Option<f64>) -> Bottleneck {
        let named = |ball: &u32| {
            let index = self.atoms[*ball as usize];
            let atom = &self.molecule.atoms[index as usize];
            let residue = self.molecule.residue_of(atom);
            AtomNamed {
                index,
                serial: atom.serial,
                name: atom.name.to_string(),
                residue: format!("{} {residue}", residue.name),
            }
        };
        Bottleneck {
            radius,
            lower: narrowest.radius,
            upper,
            point: narrowest.point,
            atoms: narrowest.balls.iter().map(named).collect(),
            residues: self.residues(&narrowest.balls),
        }
    }

    fn tunnel(&self, tunnel: &Tunnel, upper: Option<f64>) -> TunnelFound {
        TunnelFound {
            bottleneck: self.bottleneck(&tunnel.narrowest, tunnel.width, upper),
            length: tunnel.length,
            curvature: tunnel.curvature,
            cost: tunnel.cost,
            throughput: tunnel.throughput,
            exit_point: tunnel.exit(),
            spheres: tunnel.stops.clone(),
            lining_residues: self.residues(&tunnel.lining),
        }
    }
}

impl Solved {
    /// What the report says of one model.
    pub fn new(molecule: &Molecule, model: &Model) -> Self {
        let names = Names {
            molecule,
            atoms: &model.selected.atoms,
        };
        let widest = model.widest.as_ref();
        let upper = widest.map(|w| w.upper);
        let found =
            |(rank, tunnel): (usize, &Tunnel)| names.tunnel(tunnel, upper.filter(|_| rank == 0));
        let searched = &model.searched;
        Solved {
            model: model.number,
            selection: model.selected.counts.clone(),
            start: model.start.map(|start| StartUsed {
                given: start.given,
                used: start.used,
                clearance: start.clearance,
                limited: is_limited(model),
            }),
            widest: widest.map(|w| {
                let own = names.bottleneck(&w.narrowest, w.width, upper);
                Bottleneck {
                    lower: w.lower,
                    ..own
                }
            }),
            tunnels: model.tunnels.iter().enumerate().map(found).collect(),
            merged: model.merged,
            mouths: model.mouths,
            graph: Searched {
                cells: searched.cells,
                gates: searched.gates,
                settled: searched.settled,
                outside: searched.outside,
                triangulations: searched.triangulations,
            },
        }
    }
}

/// Whether the start is the narrowest place of the widest way.
fn is_limited(model: &Model) -> bool {
    let lower = model.widest.as_ref().map(|widest| widest.lower);
    let clearance = model.start.map(|start| start.clearance);
    lower
        .zip(clearance)
        .is_some_and(|(lower, clearance)| lower >= clearance)
}

/// A few words for a person.
pub fn summary(model: &Model) -> String {
    let count = model.tunnels.len();
    let plural = if count == 1 { "" } else { "s" };
    match &model.widest {
        None if model.mouths.is_some() => {
            let widest = model.tunnels.first().map(|pore| pore.narrowest.radius);
            let widest = widest.map_or(String::new(), |w| format!(", the widest {w:.4}"));
            format!("{count} pore{plural}{widest}")
        }
        None => "no space is enclosed".to_owned(),
        Some(w) if count == 0 => format!("closed: the widest way out has radius {:.4}", w.width),
        Some(Widest {
            lower,
            upper,
            width,
            ..
        }) => {
            format!(
                "{count} tunnel{plural}, the widest {width:.4}, between {lower:.4} and {upper:.4}"
            )
        }
    }
}

/// What looks wrong with what was found.
pub fn warnings(found: &Model, params: &Params) -> Vec<Warning> {
    let mut warnings = Vec::new();
    match &found.widest {
        None if found.mouths.is_none() => warnings.push(Warning::new(
            "nothing-enclosed",
            "the atoms enclose no space: they are fewer than four, or lie in one plane",
            1,
            None,
        )),
        Some(w) if found.tunnels.is_empty() => {
            let mut message = format!(
                "no way out is as wide as --probe-radius {}: the widest has {:.4}",
                params.probe_radius, w.width
            );
            if is_limited(found) {
                message += ", and so has its start; a larger --start-search may find a wider place";
            }
            warnings.push(Warning::new("closed", message, 1, None));
        }
        _ => {}
    }
    warnings
}
