//! Triangulations, and tunnels: the tables of Medek, Benes and Sochor (2007) in layout, with the error.
//!
//! Words of the form `tunnels=NAME=FILE=X,Y,Z` add a structure (or `...=X,Y,Z=HEM` with a residue kept);
//! with `--manual` the tables of those go to `man/tunnels.md`.

use super::Plan;
use scantle::image::plot::{Axis, Line, Plot, Point, Scale, Series};
use scantle::io;
use scantle::io::source::Source;
use scantle::numeric::rng::Rng;
use scantle::progress::Silent;
use scantle::protein::clearance::Ball;
use scantle::protein::select::{SelectParams, Selected};
use scantle::protein::tunnels::{Exit, Extent, Method, Params, Tunnels, find};
use scantle::spatial::delaunay3::Delaunay3;
use serde_json::json;
use std::fmt::Write;

/// The ladder of methods.
const LADDER: [&str; 7] = [
    "grid:0.8",
    "grid:0.4",
    "grid:0.2",
    "conservative",
    "approximate",
    "balls:12",
    "exact",
];

/// A molecule and where its tunnels start.
struct Structure {
    name: String,
    balls: Vec<Ball>,
    start: [f64; 3],
}

/// One method on one structure.
struct Row {
    method: &'static str,
    radius: f64,
    error: f64,
    seconds: f64,
    asked: u64,
}

pub fn run(plan: &Plan) {
    triangulations(plan);
    let words =
        std::env::args().filter_map(|word| word.strip_prefix("tunnels=").map(str::to_owned));
    let mut structures: Vec<Structure> = words.map(|word| structure(&word)).collect();
    if structures.is_empty() && plan.wants("tunnels") {
        structures.extend(plan.sizes(500).into_iter().map(packing));
    }
    let tables: Vec<(Structure, Vec<Row>, [Search; 2])> = structures
        .into_iter()
        .map(|s| {
            let (rows, searches) = (ladder(plan, &s), searches(plan, &s));
            (s, rows, searches)
        })
        .collect();
    if plan.manual && plan.wants("tunnels") && !tables.is_empty() {
        write_manual(&tables);
    }
}

fn triangulations(plan: &Plan) {
    for (name, weight) in [("delaunay3", 0.0), ("regular3", 0.0004), ("hidden3", 0.02)] {
        for count in plan.sizes(6250) {
            if plan.wants(name) {
                let mut rng = Rng::new(1, 0);
                let mut draw = || [rng.unit(), rng.unit(), rng.unit(), weight * rng.unit()];
                let points: Vec<[f64; 4]> = (0..count).map(|_| draw()).collect();
                plan.measure(name, "point", count, || {
                    Delaunay3::regular(&points).cells().len() * 32
                });
            }
        }
    }
}

/// Atoms at random around a hole, as many as asked for.
fn packing(count: usize) -> Structure {
    let radius = 2.6 * (count as f64).cbrt() * 0.62;
    let mut rng = Rng::new(7, 0);
    let mut balls: Vec<Ball> = Vec::new();
    while balls.len() < count {
        let centre = [0, 1, 2].map(|_| rng.range(-radius, radius));
        let ball = Ball {
            centre,
            radius: [1.52, 1.55, 1.7, 1.8][rng.below(4)],
        };
        let is_near = |other: &Ball| other.distance(centre) < 1.4 - other.radius;
        let inside = centre.iter().map(|c| c * c).sum::<f64>() < radius * radius;
        if inside && ball.distance([0.0; 3]) > 2.0 && !balls.iter().any(is_near) {
            balls.push(ball);
        }
    }
    Structure {
        name: format!("{count} atoms at random"),
        balls,
        start: [0.0; 3],
    }
}

fn structure(word: &str) -> Structure {
    let mut parts = word.split('=');
    let mut next = || parts.next().expect("NAME=FILE=X,Y,Z").to_owned();
    let (name, file, start) = (next(), next(), next());
    let keep = parts.next().map(str::to_owned).into_iter().collect();
    let source = Source::open(&file, u64::MAX).expect("the file is there");
    let (molecule, ..) = io::read_molecule(&source, None).expect("a molecule");
    let select = SelectParams {
        keep,
        ..SelectParams::default()
    };
    let selected = Selected::of(&molecule, 0, &select).expect("atoms");
    let numbers: Vec<f64> = start
        .split(',')
        .map(|n| n.parse().expect("a number"))
        .collect();
    Structure {
        name,
        balls: selected.balls,
        start: numbers.try_into().expect("three numbers"),
    }
}

fn held(method: Method) -> Params {
    Params {
        method,
        exit: Exit::Hull,
        start_search: 0.0,
        probe_radius: 0.0,
        count: 1,
        ..Params::DEFAULT
    }
}

fn solve(structure: &Structure, params: &Params) -> Tunnels {
    find(&structure.balls, structure.start, params, &Silent).expect("a start inside")
}

fn ladder(plan: &Plan, structure: &Structure) -> Vec<Row> {
    let exact = solve(structure, &held(Method::Exact))
        .widest
        .expect("a way");
    let row = |method: &'static str| {
        let params = held(Method::from_name(method).expect("a method"));
        let (seconds, found) = plan.time(plan.repeats(), || solve(structure, &params));
        let radius = found.widest.expect("a way").narrowest.radius;
        let row = Row {
            method,
            radius,
            error: (exact.upper - radius).max(0.0),
            seconds,
            asked: found.searched.gates,
        };
        let line = json!({
            "bench": format!("tunnels, {}", structure.name),
            "method": method,
            "atoms": structure.balls.len(),
            "radius": row.radius,
            "error": row.error,
            "seconds": row.seconds,
            "asked": row.asked,
        });
        println!("{line}");
        row
    };
    LADDER.into_iter().map(row).collect()
}

/// A search, full or reduced.
struct Search {
    seconds: f64,
    settled: u64,
    cells: u64,
}

fn searches(plan: &Plan, structure: &Structure) -> [Search; 2] {
    [Extent::Full, Extent::Reduced].map(|extent| {
        let params = Params {
            extent,
            ..held(Method::Conservative)
        };
        let (seconds, found) = plan.time(plan.repeats(), || solve(structure, &params));
        let search = Search {
            seconds,
            settled: found.searched.settled,
            cells: found.searched.cells,
        };
        let line = json!({
            "bench": format!("tunnels, {}", structure.name),
            "search": extent.name(),
            "seconds": search.seconds,
            "settled": search.settled,
            "cells": search.cells,
        });
        println!("{line}");
        search
    })
}

fn write_manual(tables: &[(Structure, Vec<Row>, [Search; 2])]) {
    let mut page = String::from(
        "# Tunnels: what each method costs, and how far it is from the truth\n\n\
         Radius is that of the narrowest place of the way found, measured exactly on its centreline; the\n\
         error is what the widest way has more, by the exact method. Seconds are the least of five, from\n\
         atoms to tunnel, one thread. The start is held, and ways end at the hull, as in the paper. Written\n\
         by `cargo bench --bench throughput -- tunnels --manual tunnels=NAME=FILE=X,Y,Z ...`.\n\n\
         ![error against seconds](tunnels.svg)\n",
    );
    let mut plot = Plot::new(
        "Error of the widest way, by method",
        Axis::new("time (s)", Scale::Log),
        Axis::new("error (angstrom)", Scale::Log),
    );
    for (index, (structure, rows, searches)) in tables.iter().enumerate() {
        let atoms = structure.balls.len();
        write!(page, "\n## {}, {atoms} atoms\n\n", structure.name).expect("to memory");
        page +=
            "| method | radius (Å) | error (Å) | seconds | widths asked |\n|---|---|---|---|---|\n";
        for Row {
            method,
            radius,
            error,
            seconds,
            asked,
        } in rows
        {
            writeln!(
                page,
                "| {method} | {radius:.6} | {error:.6} | {seconds:.4} | {asked} |"
            )
            .expect("to memory");
        }
        page += "\n| search | seconds | settled | of cells |\n|---|---|---|---|\n";
        for (
            name,
            Search {
                seconds,
                settled,
                cells,
            },
        ) in ["full", "reduced"].iter().zip(searches)
        {
            writeln!(page, "| {name} | {seconds:.4} | {settled} | {cells} |").expect("to memory");
        }
        // Errors below the tolerance of the exact method are no more than that.
        let point = |row: &Row| Point {
            x: row.seconds,
            y: row.error.max(1e-7),
            label: if index == 0 {
                row.method.to_owned()
            } else {
                String::new()
            },
            ..Point::default()
        };
        plot.series.push(Series {
            line: Line::None,
            ..Series::new(
                structure.name.clone(),
                index,
                rows.iter().map(point).collect(),
            )
        });
    }
    std::fs::write("man/tunnels.md", page).expect("the folder of the manual");
    std::fs::write("man/tunnels.svg", plot.svg()).expect("the folder of the manual");
}
