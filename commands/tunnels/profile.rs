//! The radius along tunnels as a table.

use crate::destination::Extra;
use crate::table::Table;
use scantle::error::number;
use scantle::protein::Molecule;
use scantle::protein::tunnels::{Stop, Tunnel};

/// The table of `--profile`.
pub const PROFILE: Extra = Extra {
    option: "profile",
    what: "a table",
    exactly: "a table of comma-separated values",
    formats: &["csv"],
};

const HEADINGS: [&str; 12] = [
    "tunnel",
    "at",
    "x",
    "y",
    "z",
    "radius",
    "atom",
    "element",
    "residue",
    "chain",
    "number",
    "insertion",
];

/// All stops of the tunnels as comma-separated values (RFC 4180): a row each, in order, under headings.
///
/// `tunnel` counts from 1; `at` is the length of the way from the start; `radius` the clearance; the rest is
/// the nearest atom, by its name, and its residue. `atoms` says which atom of the molecule each ball
/// is. Numbers have all their digits.
pub fn profile(tunnels: &[Tunnel], molecule: &Molecule, atoms: &[u32]) -> Vec<u8> {
    let row = |(rank, stop): (usize, &Stop)| {
        let [x, y, z] = stop.centre;
        let mut cells = vec![(rank + 1).to_string()];
        cells.extend([stop.at, x, y, z, stop.radius].map(number));
        let atom = &molecule.atoms[atoms[stop.ball as usize] as usize];
        let residue = molecule.residue_of(atom);
        let insertion = char::from(residue.insertion).to_string();
        cells.extend([
            atom.name.to_string(),
            atom.element.symbol().to_owned(),
            residue.name.to_string(),
            residue.chain.to_string(),
            residue.number.to_string(),
            insertion.trim().to_owned(),
        ]);
        cells
    };
    let stops = tunnels.iter().enumerate();
    let stops = stops.flat_map(|(rank, tunnel)| tunnel.stops.iter().map(move |stop| (rank, stop)));
    let table = Table {
        headings: HEADINGS.map(str::to_owned).to_vec(),
        rows: stops.map(row).collect(),
    };
    table.csv()
}

#[cfg(test)]
mod tests {
    use super::super::sample::sample;
    use super::*;

    #[test]
    fn a_row_for_each_stop_names_its_nearest_atom() {
        let (molecule, atoms, tunnels) = sample();
        let text = String::from_utf8(profile(&tunnels, &molecule, &atoms)).expect("text");
        let lines: Vec<&str> = text.split_terminator("\r\n").collect();
        let stops: usize = tunnels.iter().map(|tunnel| tunnel.stops.len()).sum();
        assert_eq!(lines.len(), 1 + stops);
        assert_eq!(
            lines[0],
            "tunnel,at,x,y,z,radius,atom,element,residue,chain,number,insertion"
        );
        for (line, stop) in lines[1..].iter().zip(tunnels.iter().flat_map(|t| &t.stops)) {
            let cells: Vec<&str> = line.split(',').collect();
            assert_eq!(cells.len(), 12, "{line}");
            let figures: Vec<f64> = cells[1..6]
                .iter()
                .map(|c| c.parse().expect("a number"))
                .collect();
            assert_eq!(figures[0], stop.at);
            assert_eq!(figures[1..4], stop.centre);
            assert_eq!(figures[4], stop.radius);
            let atom = &molecule.atoms[atoms[stop.ball as usize] as usize];
            let apart = (0..3).map(|a| (atom.position[a] - figures[1 + a]).powi(2));
            let gap = apart.sum::<f64>().sqrt() - 1.7;
            assert!((gap - stop.radius).abs() < 1e-9, "{line}");
            let residue = molecule.residue_of(atom);
            assert_eq!(cells[6..9], ["C1", "C", "LIG"]);
            assert_eq!(cells[9], residue.chain.as_str());
            assert_eq!(cells[10], residue.number.to_string());
            assert_eq!(cells[11] == "B", residue.insertion == b'B');
        }
    }
}
