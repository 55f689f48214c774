//! Scripts for ChimeraX.

use super::{Scene, colour_of, head, hexadecimal, line, listed, number_of, quoted, rank};
use scantle::error::number;
use scantle::image::colour::CLAY;
use scantle::protein::Residue;
use scantle::protein::tunnels::Tunnel;

/// The script: the molecule is model 1, the tunnels are model 2.
pub fn script(scene: &Scene) -> String {
    let mut text = head(scene, "run as: chimerax FILE.cxc");
    if let Some(file) = scene.structure {
        line(&mut text, format_args!("open {} id 1", quoted(file)));
    }
    if let Some(file) = scene.spheres {
        line(&mut text, format_args!("open {} id 2", quoted(file)));
    }
    text.push_str("set bgColor white\n");
    if scene.structure.is_some() {
        let clay = hexadecimal(CLAY);
        text.push_str("hide #1 atoms\nshow #1 cartoons\n");
        line(&mut text, format_args!("color #1 #{clay}"));
        text.push_str("transparency #1 50 target c\n");
    }
    if scene.spheres.is_some() {
        text.push_str("show #2 atoms\nstyle #2 sphere\n");
        // Every radius stands for itself.
        text.push_str("size byattribute a:bfactor #2 0:0 1000:1000\n");
    }
    for (tunnel, found) in scene.tunnels.iter().enumerate() {
        let (rank, colour) = (rank(tunnel), hexadecimal(colour_of(tunnel)));
        match scene.spheres {
            Some(_) => line(&mut text, format_args!("color #2:{rank} #{colour}")),
            None => make(&mut text, rank, &colour, found),
        }
    }
    if scene.structure.is_some() {
        lining(&mut text, scene);
    }
    match (scene.tunnels.is_empty(), scene.spheres) {
        (true, _) => {}
        (_, Some(_)) => text.push_str("view #2:1\n"),
        (_, None) => text.push_str("view #2.1\n"),
    }
    text
}

fn make(text: &mut String, rank: usize, colour: &str, tunnel: &Tunnel) {
    for stop in tunnel.stops.iter().filter(|stop| stop.radius > 0.0) {
        let (place, radius) = (listed(stop.centre), number(stop.radius));
        line(
            text,
            format_args!("marker #2.{rank} position {place} radius {radius} color #{colour}"),
        );
    }
}

/// Names what lines each tunnel, shows that of the first as sticks, and labels the narrowest places.
fn lining(text: &mut String, scene: &Scene) {
    for (tunnel, found) in scene.tunnels.iter().enumerate() {
        let residues = scene.residues(&found.lining);
        if !residues.is_empty() {
            let (rank, chosen) = (rank(tunnel), selection(&residues));
            line(text, format_args!("name lining_{rank} {chosen}"));
        }
    }
    let first = scene
        .tunnels
        .first()
        .map(|tunnel| scene.residues(&tunnel.lining));
    if first.is_some_and(|residues| !residues.is_empty()) {
        text.push_str("show lining_1 atoms\nstyle lining_1 stick\ncolor lining_1 byhetero\n");
    }
    let narrowest = scene.narrowest();
    if !narrowest.is_empty() {
        let chosen = selection(&narrowest);
        line(text, format_args!("label {chosen} residues color black"));
    }
}

/// Residues as ChimeraX specifies them.
fn selection(residues: &[&Residue]) -> String {
    let mut text = "#1".to_owned();
    for run in Scene::by_chain(residues) {
        let numbers: Vec<String> = run.iter().map(|residue| number_of(residue)).collect();
        if !run[0].chain.is_empty() {
            text.push('/');
            text.push_str(run[0].chain.as_str());
        }
        text.push(':');
        text.push_str(&numbers.join(","));
    }
    text
}
