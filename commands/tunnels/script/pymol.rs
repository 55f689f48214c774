//! Scripts for PyMOL.

use super::{Scene, colour_of, head, hexadecimal, line, listed, number_of, quoted, rank};
use scantle::error::number;
use scantle::image::colour::CLAY;
use scantle::protein::Residue;
use scantle::protein::tunnels::Tunnel;

/// The script, as lines of commands; what holds names of files and figures is a block of Python, where
/// quotes mean the same as everywhere.
pub fn script(scene: &Scene) -> String {
    let mut text = head(scene, "run as: pymol FILE.pml");
    open(&mut text, scene);
    text.push_str("hide everything\nbg_color white\n");
    if scene.structure.is_some() {
        let clay = hexadecimal(CLAY);
        line(&mut text, format_args!("color 0x{clay}, structure"));
        text.push_str("show cartoon, structure\nset cartoon_transparency, 0.5, structure\n");
    }
    for (tunnel, _) in scene.tunnels.iter().enumerate() {
        let (rank, colour) = (rank(tunnel), hexadecimal(colour_of(tunnel)));
        if scene.spheres.is_some() {
            line(
                &mut text,
                format_args!("create tunnel_{rank}, tunnels and resi {rank}"),
            );
        }
        line(&mut text, format_args!("color 0x{colour}, tunnel_{rank}"));
        line(&mut text, format_args!("show spheres, tunnel_{rank}"));
    }
    if scene.spheres.is_some() {
        text.push_str("delete tunnels\n");
    }
    if scene.structure.is_some() {
        lining(&mut text, scene);
    }
    if !scene.tunnels.is_empty() {
        text.push_str("orient tunnel_1\nzoom tunnel_1, 8\n");
    }
    text.push_str("deselect\n");
    text
}

/// Opens the files, or makes the spheres.
fn open(text: &mut String, scene: &Scene) {
    text.push_str("python\n");
    if let Some(file) = scene.structure {
        let file = quoted(file);
        line(text, format_args!("cmd.load({file}, \"structure\")"));
    }
    match scene.spheres {
        Some(file) => {
            let file = quoted(file);
            line(text, format_args!("cmd.load({file}, \"tunnels\")"));
        }
        None => {
            for (tunnel, found) in scene.tunnels.iter().enumerate() {
                make(text, rank(tunnel), found);
            }
        }
    }
    text.push_str("python end\n");
    if scene.spheres.is_some() {
        text.push_str("alter tunnels, vdw=b\n");
    }
}

fn make(text: &mut String, rank: usize, tunnel: &Tunnel) {
    text.push_str("for x, y, z, r in [\n");
    for stop in &tunnel.stops {
        let (place, radius) = (listed(stop.centre), number(stop.radius.max(0.0)));
        line(text, format_args!("    ({place},{radius}),"));
    }
    text.push_str("]:\n");
    line(
        text,
        format_args!("    cmd.pseudoatom(\"tunnel_{rank}\", pos=[x, y, z], vdw=r, b=r)\n"),
    );
}

/// Selects what lines each tunnel, shows that of the first as sticks, and names the narrowest places.
fn lining(text: &mut String, scene: &Scene) {
    for (tunnel, found) in scene.tunnels.iter().enumerate() {
        let (rank, residues) = (rank(tunnel), scene.residues(&found.lining));
        let chosen = selection(&residues);
        line(text, format_args!("select lining_{rank}, {chosen}"));
    }
    if !scene.tunnels.is_empty() {
        text.push_str("show sticks, lining_1 and not (polymer and name C+N+O)\n");
        text.push_str("util.cnc lining_1\nset label_color, black\nset label_size, 18\nset label_position, [0, 0, 10]\n");
    }
    for residue in scene.narrowest() {
        let one = selection(&[residue]);
        let label = quoted(&format!("{} {}", residue.name, number_of(residue)));
        let has_alpha = scene
            .molecule
            .atoms_in(&residue.atoms)
            .iter()
            .any(|atom| atom.name.is("CA"));
        let atom = if has_alpha && !residue.name.is("CA") {
            format!("{one} and name CA")
        } else {
            format!("first ({one})")
        };
        line(text, format_args!("label {atom}, {label}"));
    }
}

/// Residues in the words of a selection.
fn selection(residues: &[&Residue]) -> String {
    let chains: Vec<String> = Scene::by_chain(residues)
        .map(|run| {
            // A dash is a range.
            let numbers = run.iter().map(|r| number_of(r).replace('-', "\\-"));
            let numbers = numbers.collect::<Vec<_>>().join("+");
            let chain = run[0].chain;
            let chain = if chain.is_empty() {
                "''"
            } else {
                chain.as_str()
            };
            format!("(chain {chain} and resi {numbers})")
        })
        .collect();
    match chains.is_empty() {
        true => "none".to_owned(),
        false => format!("structure and ({})", chains.join(" or ")),
    }
}
