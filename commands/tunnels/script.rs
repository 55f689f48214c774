//! Scripts that show tunnels in programs for molecules.

mod chimerax;
mod pymol;

use super::plot::colour_of;
use crate::destination::Extra;
use scantle::error::number;
use scantle::io::format::Format;
use scantle::protein::tunnels::Tunnel;
use scantle::protein::{Molecule, Residue};
use std::fmt::Write;

/// The script of `--script`.
pub const SCRIPT: Extra = Extra {
    option: "script",
    what: "a script",
    exactly: "a script for PyMOL or ChimeraX",
    formats: &["pml", "cxc"],
};

/// What a script shows.
pub struct Scene<'a> {
    /// The file of the molecule, where it is one that such programs read ([`is_shown`]).
    pub structure: Option<&'a str>,
    /// The file of the tunnels' spheres, where one is written that holds their radii as temperature factors
    /// ([`holds_radii`]); else the script holds them.
    pub spheres: Option<&'a str>,
    /// The tunnels.
    pub tunnels: &'a [Tunnel],
    /// The molecule.
    pub molecule: &'a Molecule,
    /// Which atom of the molecule each ball is.
    pub atoms: &'a [u32],
}

/// Whether programs that show molecules read files of a format.
pub fn is_shown(format: Format) -> bool {
    matches!(format, Format::Pdb | Format::Cif | Format::Pqr)
}

/// Whether a format holds the radii of spheres as temperature factors.
pub fn holds_radii(format: Format) -> bool {
    matches!(format, Format::Pdb | Format::Cif)
}

/// A script that opens the files of a scene and shows the molecule as a ribbon, tunnels as balls in the colours
/// of all pictures, the residues that line the first as sticks, and those at the narrowest places named.
///
/// `format` is `pml`, for PyMOL, or `cxc`, for ChimeraX from 1.8 on. Files are named as the command line names
/// them: the script is run from the same folder.
pub fn script(scene: &Scene, format: &str) -> Vec<u8> {
    let text = match format {
        "cxc" => chimerax::script(scene),
        _ => pymol::script(scene),
    };
    text.into_bytes()
}

/// The first line: what it is, and how it is run.
fn head(scene: &Scene, how: &str) -> String {
    let of = scene.structure.map_or(String::new(), |file| {
        // A comment is one line.
        format!(" of {}", file.replace(|c: char| c.is_control(), "?"))
    });
    let count = scene.tunnels.len();
    let plural = if count == 1 { "" } else { "s" };
    format!("# {count} tunnel{plural}{of}, the widest first; {how}\n")
}

/// `#rrggbb`, without the sign.
fn hexadecimal([r, g, b]: [u8; 3]) -> String {
    format!("{r:02x}{g:02x}{b:02x}")
}

/// What an object is called after the rank of its tunnel.
fn rank(tunnel: usize) -> usize {
    tunnel + 1
}

/// Text in double quotes, with a backslash before quotes and backslashes.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

impl Scene<'_> {
    /// Residues of balls, each once, in the order of the file.
    fn residues(&self, balls: &[u32]) -> Vec<&Residue> {
        let of = |ball: &u32| self.molecule.atoms[self.atoms[*ball as usize] as usize].residue;
        let mut indices: Vec<u32> = balls.iter().map(of).collect();
        indices.sort_unstable();
        indices.dedup();
        let residue = |index: u32| &self.molecule.residues[index as usize];
        indices.into_iter().map(residue).collect()
    }

    /// Residues around the narrowest places of all tunnels, each once.
    fn narrowest(&self) -> Vec<&Residue> {
        let places = self.tunnels.iter().map(|tunnel| &tunnel.narrowest.balls);
        let balls: Vec<u32> = places.flatten().copied().collect();
        self.residues(&balls)
    }

    /// Runs of residues of one chain that follow one another, each with its chain.
    fn by_chain<'r>(residues: &'r [&'r Residue]) -> impl Iterator<Item = &'r [&'r Residue]> {
        residues.chunk_by(|a, b| a.chain == b.chain)
    }
}

/// `106`, `52A`.
fn number_of(residue: &Residue) -> String {
    let insertion = char::from(residue.insertion).to_string();
    format!("{}{}", residue.number, insertion.trim())
}

/// Coordinates with commas between them.
fn listed(place: [f64; 3]) -> String {
    place.map(number).join(",")
}

/// A line; writing to text does not fail.
fn line(text: &mut String, words: std::fmt::Arguments) {
    let _ = writeln!(text, "{words}");
}

#[cfg(test)]
mod tests {
    use super::super::sample::sample;
    use super::*;

    fn written(format: &str, structure: Option<&str>, spheres: Option<&str>) -> String {
        let (molecule, atoms, tunnels) = sample();
        let scene = Scene {
            structure,
            spheres,
            tunnels: &tunnels,
            molecule: &molecule,
            atoms: &atoms,
        };
        String::from_utf8(script(&scene, format)).expect("text")
    }

    #[test]
    fn paths_are_quoted() {
        let path = Some(r#"my "old" data/1 c.pdb"#);
        let pymol = written("pml", path, Some("out dir/t.pdb"));
        assert!(
            pymol.contains(r#"cmd.load("my \"old\" data/1 c.pdb", "structure")"#),
            "{pymol}"
        );
        assert!(pymol.contains(r#"cmd.load("out dir/t.pdb", "tunnels")"#));
        let chimerax = written("cxc", path, Some("out dir/t.pdb"));
        assert!(
            chimerax.contains(r#"open "my \"old\" data/1 c.pdb" id 1"#),
            "{chimerax}"
        );
        assert!(chimerax.contains(r#"open "out dir/t.pdb" id 2"#));
        let hostile = written("pml", Some("a\nquit.pdb"), None);
        assert!(hostile.contains(r#"cmd.load("a\nquit.pdb""#));
        assert!(hostile.lines().all(|line| line != "quit.pdb"), "{hostile}");
    }

    #[test]
    fn each_tunnel_has_its_colour_and_the_narrowest_places_are_named() {
        let colours = [0, 1].map(|k| hexadecimal(colour_of(k)));
        let pymol = written("pml", Some("a.pdb"), Some("t.pdb"));
        let chimerax = written("cxc", Some("a.pdb"), Some("t.pdb"));
        for (k, colour) in colours.iter().enumerate() {
            assert!(pymol.contains(&format!("color 0x{colour}, tunnel_{}\n", k + 1)));
            assert!(chimerax.contains(&format!("color #2:{} #{colour}\n", k + 1)));
        }
        assert!(pymol.contains("alter tunnels, vdw=b\n"));
        assert!(chimerax.contains("size byattribute a:bfactor #2 0:0 1000:1000\n"));
        assert!(pymol.contains("\"LIG "), "{pymol}");
        assert!(chimerax.contains("label #1"), "{chimerax}");
    }

    #[test]
    fn without_files_the_script_holds_the_spheres() {
        let (_, _, tunnels) = sample();
        let stops: usize = tunnels.iter().map(|tunnel| tunnel.stops.len()).sum();
        let pymol = written("pml", None, None);
        assert!(
            !pymol.contains("load") && !pymol.contains("structure"),
            "{pymol}"
        );
        let chimerax = written("cxc", None, None);
        let markers = chimerax
            .lines()
            .filter(|line| line.starts_with("marker #2."));
        assert_eq!(markers.count(), stops);
        assert!(
            !chimerax.contains("open") && !chimerax.contains("#1"),
            "{chimerax}"
        );
        let spheres = pymol
            .lines()
            .filter(|line| line.trim_start().starts_with('('));
        assert_eq!(spheres.count(), stops);
    }

    #[test]
    fn negative_numbers_and_insertion_codes_are_kept() {
        let (molecule, atoms, mut tunnels) = sample();
        let at = |number: i32, insertion: u8| {
            let residue = molecule
                .residues
                .iter()
                .position(|r| (r.number, r.insertion) == (number, insertion) && r.name.is("LIG"));
            let atom = molecule.residues[residue.expect("a residue")].atoms.start;
            atoms.iter().position(|a| *a == atom).expect("a ball") as u32
        };
        tunnels.truncate(1);
        tunnels[0].narrowest.balls = vec![at(-4, b'B')];
        let scene = Scene {
            structure: Some("a.pdb"),
            spheres: None,
            tunnels: &tunnels,
            molecule: &molecule,
            atoms: &atoms,
        };
        let pymol = String::from_utf8(script(&scene, "pml")).expect("text");
        assert!(pymol.contains("chain A and resi \\-4B"), "{pymol}");
        let chimerax = String::from_utf8(script(&scene, "cxc")).expect("text");
        assert!(chimerax.contains("label #1/A:-4B residues"), "{chimerax}");
    }
}
