//! The radius along tunnels as a plot.

use crate::destination::Extra;
use scantle::image::colour::{INK, Srgb};
use scantle::image::plot::{Axis, Guide, Line, Marker, On, Plot, Point, Scale, Series};
use scantle::protein::Molecule;
use scantle::protein::tunnels::{Stop, Tunnel};

/// The picture of `--plot`.
pub const PLOT: Extra = Extra {
    option: "plot",
    what: "a picture",
    exactly: "an SVG or PNG picture",
    formats: &["svg", "png"],
};

/// Tunnels that are drawn: as many as there are colours and markers.
const MOST: usize = 7;

/// Markers on the longest tunnel, about.
const MARKERS: f64 = 9.0;

/// The colour of a tunnel in all pictures and scripts, which go round after seven.
pub fn colour_of(tunnel: usize) -> Srgb {
    Series::new("", tunnel, Vec::new()).colour
}

/// The radius along the widest tunnels against the way from the start: a line each, told apart by its markers
/// too, with its narrowest place ringed and the radius of the probe as a dashed line.
///
/// `name` is what the tunnels are of. `atoms` says which atom of the molecule each ball is.
pub fn plot(
    tunnels: &[Tunnel],
    molecule: &Molecule,
    atoms: &[u32],
    probe_radius: f64,
    name: &str,
) -> Plot {
    let mut x = Axis::new("way from the start (Å)", Scale::Linear);
    x.reach = Some([0.0, 0.0]);
    let mut y = Axis::new("radius (Å)", Scale::Linear);
    y.reach = Some([0.0, probe_radius]);
    let drawn = &tunnels[..tunnels.len().min(MOST)];
    let left_out = match tunnels.len() - drawn.len() {
        0 => String::new(),
        more => format!(", the first {MOST} of {}", more + MOST),
    };
    let mut plot = Plot::new(format!("radius along tunnels of {name}{left_out}"), x, y);
    plot.caption = caption(tunnels, molecule, atoms);
    plot.guides.push(Guide {
        on: On::Y,
        value: probe_radius,
        text: format!("probe {probe_radius} Å"),
    });
    let longest = drawn.iter().map(|tunnel| tunnel.length).fold(0.0, f64::max);
    let narrowest = drawn.iter().filter_map(bottleneck).collect();
    plot.series.push(Series {
        marker: Marker::Ring,
        colour: INK,
        ..Series::new("", 0, narrowest)
    });
    for (rank, tunnel) in drawn.iter().enumerate() {
        let name = format!("tunnel {}: {:.3} Å", rank + 1, tunnel.narrowest.radius);
        let share = rank as f64 / drawn.len() as f64;
        let marked = marked(tunnel, longest / MARKERS, share);
        plot.series.push(Series::new(name, rank, marked));
        let all = tunnel.stops.iter().map(point).collect();
        plot.series.push(Series {
            line: Line::Straight,
            marker: Marker::None,
            ..Series::new("", rank, all)
        });
    }
    plot
}

fn point(stop: &Stop) -> Point {
    Point {
        x: stop.at,
        y: stop.radius,
        ..Point::default()
    }
}

/// The narrowest stop, with its radius beside it.
fn bottleneck(tunnel: &Tunnel) -> Option<Point> {
    let stop = tunnel
        .stops
        .iter()
        .min_by(|a, b| a.radius.total_cmp(&b.radius))?;
    Some(Point {
        label: format!("{:.3}", stop.radius),
        ..point(stop)
    })
}

/// Stops about every `gap` of the way, from a share of it on, so that those of several tunnels that begin alike
/// stand apart.
fn marked(tunnel: &Tunnel, gap: f64, share: f64) -> Vec<Point> {
    let mut next = gap * share;
    let mut found = Vec::new();
    for stop in &tunnel.stops {
        if stop.at >= next {
            found.push(point(stop));
            next = if gap > 0.0 {
                next + gap * ((stop.at - next) / gap).floor() + gap
            } else {
                f64::INFINITY
            };
        }
    }
    found
}

/// The width of the first tunnel, and the residues around its narrowest place.
fn caption(tunnels: &[Tunnel], molecule: &Molecule, atoms: &[u32]) -> String {
    let Some(tunnel) = tunnels.first() else {
        return "no tunnel".to_owned();
    };
    let mut residues: Vec<String> = Vec::new();
    for ball in &tunnel.narrowest.balls {
        let atom = &molecule.atoms[atoms[*ball as usize] as usize];
        let residue = molecule.residue_of(atom);
        let name = format!("{} {residue}", residue.name);
        if !residues.contains(&name) {
            residues.push(name);
        }
    }
    let radius = tunnel.narrowest.radius;
    format!("bottleneck {radius:.3} Å at {}", residues.join(", "))
}

#[cfg(test)]
mod tests {
    use super::super::sample::sample;
    use super::*;

    #[test]
    fn lines_go_through_all_stops_and_the_narrowest_are_ringed() {
        let (molecule, atoms, tunnels) = sample();
        let plot = plot(&tunnels, &molecule, &atoms, 0.9, "sample.pdb");
        assert_eq!(plot.title, "radius along tunnels of sample.pdb");
        assert_eq!(plot.series.len(), 1 + 2 * tunnels.len());
        let rings = &plot.series[0].points;
        for (rank, tunnel) in tunnels.iter().enumerate() {
            let [marked, line] = [1, 2].map(|k| &plot.series[2 * rank + k]);
            assert_eq!(line.points.len(), tunnel.stops.len());
            assert!(
                (3..=12).contains(&marked.points.len()),
                "{}",
                marked.points.len()
            );
            assert!(marked.points.iter().all(|p| line.points.contains(p)));
            let least = tunnel.narrowest.radius;
            assert!((rings[rank].y - least).abs() < 1e-12);
            assert_eq!(marked.name, format!("tunnel {}: {least:.3} Å", rank + 1));
        }
        let svg = plot.svg();
        assert!(
            svg.contains("probe 0.9 Å") && svg.contains("bottleneck "),
            "{svg}"
        );
        assert!(plot.caption.contains("Å at LIG "), "{}", plot.caption);
    }

    #[test]
    fn no_tunnel_and_many_make_plots_too() {
        let (molecule, atoms, tunnels) = sample();
        let none = plot(&[], &molecule, &atoms, 0.9, "x");
        assert_eq!(none.caption, "no tunnel");
        assert!(none.svg().contains("probe 0.9"));
        let many: Vec<Tunnel> = (0..9).map(|_| tunnels[0].clone()).collect();
        let plot = plot(&many, &molecule, &atoms, 0.9, "x");
        assert_eq!(plot.series.len(), 1 + 2 * MOST);
        assert!(plot.title.ends_with("x, the first 7 of 9"));
    }
}
