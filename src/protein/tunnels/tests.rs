use super::graph::{Graph, Metric};
use super::search::Outside;
use super::*;
use crate::numeric::rng::Rng;
use crate::numeric::vector::{add, cross, dot, length, normalize, scale, sub};
use crate::progress::Silent;
use crate::spatial::delaunay3::Delaunay3;

pub(super) fn ball(centre: [f64; 3], radius: f64) -> Ball {
    Ball { centre, radius }
}

/// The start held, ways to infinity.
pub(super) fn held(method: Method) -> Params {
    Params {
        method,
        exit: Exit::Hull,
        start_search: 0.0,
        probe_radius: 0.0,
        count: 1,
        ..Params::DEFAULT
    }
}

pub(super) fn solve(balls: &[Ball], start: [f64; 3], params: &Params) -> Tunnels {
    find(balls, start, params, &Silent).expect("a start inside")
}

pub(super) fn ideal(balls: &[Ball], start: [f64; 3], method: Method) -> Widest {
    let found = solve(balls, start, &held(method));
    found.widest.expect("there are cells")
}

/// A random rotation, as the images of the axes.
fn turn(rng: &mut Rng) -> [[f64; 3]; 3] {
    let mut draw = || [0, 1, 2].map(|_| rng.range(-1.0, 1.0));
    let x = normalize(draw());
    let z = normalize(cross(x, draw()));
    [x, cross(z, x), z]
}

fn turned(p: [f64; 3], axes: &[[f64; 3]; 3], by: [f64; 3]) -> [f64; 3] {
    (0..3).fold(by, |sum, k| add(sum, scale(axes[k], p[k])))
}

/// A lattice's name, points in a cell of side 1, place to start and gate.
type Lattice = (&'static str, Vec<[f64; 3]>, [f64; 3], f64);

/// Lattices: their points in a cell of side 1, a place to start, the gate and the clearance there.
fn lattices() -> Vec<Lattice> {
    let half = 0.5;
    vec![
        ("simple", vec![[0.0; 3]], [half; 3], 0.5f64.sqrt()),
        (
            "body-centred",
            vec![[0.0; 3], [half; 3]],
            [half, 0.25, 0.0],
            3.0 * 2f64.sqrt() / 8.0,
        ),
        (
            "face-centred",
            vec![
                [0.0; 3],
                [half, half, 0.0],
                [half, 0.0, half],
                [0.0, half, half],
            ],
            [half; 3],
            // Nearest neighbours are half a face diagonal apart.
            0.5f64.sqrt() / 3f64.sqrt(),
        ),
    ]
}

pub(super) fn crystal(cell: &[[f64; 3]], side: i32, size: f64, radius: f64) -> Vec<Ball> {
    let mut balls = Vec::new();
    for index in 0..side.pow(3) {
        let corner = [index % side, index / side % side, index / side / side].map(f64::from);
        balls.extend(
            cell.iter()
                .map(|p| ball(scale(add(corner, *p), size), radius)),
        );
    }
    balls
}

#[test]
fn gates_of_lattices_are_those_of_theory() {
    let (size, radius) = (6.0, 1.7);
    let methods = [
        Method::Conservative,
        Method::Approximate,
        Method::Balls(12),
        Method::Exact,
    ];
    let mut rng = Rng::new(6, 0);
    for (name, cell, start, gate) in lattices() {
        let side = if cell.len() == 1 { 9 } else { 6 };
        let balls = crystal(&cell, side, size, radius);
        let inside = f64::from(side / 2);
        let start = scale(add(start, [inside; 3]), size);
        let truth = gate * size - radius;
        let rounds = if cell.len() == 1 { 5 } else { 1 };
        for round in 0..=rounds {
            let axes = turn(&mut rng);
            let by = [0, 1, 2].map(|_| rng.range(-50.0, 50.0));
            let place = |p| if round == 0 { p } else { turned(p, &axes, by) };
            let balls: Vec<Ball> = balls
                .iter()
                .map(|b| ball(place(b.centre), radius))
                .collect();
            let start = place(start);
            for method in methods {
                let widest = ideal(&balls, start, method);
                let off = (widest.width - truth).abs();
                let room = if method == Method::Exact { 1e-6 } else { 1e-9 };
                assert!(
                    off < room,
                    "{name} {round} {method:?}: {} for {truth}",
                    widest.width
                );
                assert!(
                    widest.lower < truth + 1e-9 && widest.upper > truth - 1e-9,
                    "{name}"
                );
                assert!(
                    widest.lower > truth - 1e-6,
                    "{name} {round} {method:?}: {widest:?}"
                );
            }
            let h = 0.4;
            let found = solve(&balls, start, &held(Method::Grid(h)));
            let raw = found.widest.expect("a way").width;
            assert!(
                (raw - truth).abs() < grid::REACH * h,
                "{name} {round}: {raw} for {truth}"
            );
            let certain = found.tunnels[0].narrowest.radius;
            assert!(
                certain < truth + 1e-9 && certain > truth - 3f64.sqrt() * h,
                "{name}: {certain}"
            );
        }
    }
}

/// Balls at random, none deeper in another than real atoms are, around a hole of radius `hole`.
fn packing(seed: u64, count: usize, hole: f64, radii: &[f64]) -> Vec<Ball> {
    let mut rng = Rng::new(seed, 0);
    let mut balls: Vec<Ball> = Vec::new();
    while balls.len() < count {
        let centre = [0, 1, 2].map(|_| rng.range(-9.0, 9.0));
        let radius = radii[rng.below(radii.len())];
        let made = ball(centre, radius);
        let is_free = made.distance([0.0; 3]) > hole && length(centre) < 9.0;
        if is_free && balls.iter().all(|b| length(sub(b.centre, centre)) > 1.6) {
            balls.push(made);
        }
    }
    balls
}

#[test]
fn equal_balls_are_solved_exactly_by_all_triangulations() {
    for seed in 0..50 {
        let balls = packing(seed, 150, 1.5, &[1.7]);
        let exact = ideal(&balls, [0.0; 3], Method::Exact);
        assert!(exact.upper - exact.lower <= 1e-6, "{seed}: {exact:?}");
        for method in [Method::Conservative, Method::Approximate, Method::Balls(6)] {
            let other = ideal(&balls, [0.0; 3], method);
            assert!(
                (other.width - exact.lower).abs() < 1.1e-6,
                "{seed} {method:?}: {other:?} {exact:?}"
            );
            assert!(
                other.upper - other.lower < 1e-9,
                "{seed} {method:?}: {other:?}"
            );
        }
    }
}

#[test]
fn bounds_of_all_methods_hold_for_mixed_balls() {
    let radii = [1.2, 1.52, 1.55, 1.7, 1.8];
    let mut differ = 0;
    for seed in 100..150 {
        let balls = packing(seed, 150, 1.5, &radii);
        let exact = ideal(&balls, [0.0; 3], Method::Exact);
        assert!(exact.upper - exact.lower <= 1e-6, "{seed}: {exact:?}");
        let conservative = ideal(&balls, [0.0; 3], Method::Conservative);
        let approximate = ideal(&balls, [0.0; 3], Method::Approximate);
        let twelve = ideal(&balls, [0.0; 3], Method::Balls(12));
        let room = 1e-6;
        assert!(conservative.width <= conservative.lower + room, "{seed}");
        assert!(conservative.lower <= approximate.lower + room, "{seed}");
        for widest in [&conservative, &approximate, &twelve] {
            assert!(
                widest.lower <= exact.upper + room,
                "{seed}: {widest:?} {exact:?}"
            );
            assert!(
                widest.upper >= exact.lower - room,
                "{seed}: {widest:?} {exact:?}"
            );
        }
        assert!(
            exact.lower <= twelve.width + room,
            "{seed}: {twelve:?} {exact:?}"
        );
        assert!(twelve.width <= conservative.width + 0.6 + room, "{seed}");
        let grid = ideal(&balls, [0.0; 3], Method::Grid(0.4));
        assert!(
            (grid.width - exact.lower).abs() <= grid::REACH * 0.4 + room,
            "{seed}: {grid:?}"
        );
        differ += usize::from(conservative.width < exact.lower - 0.01);
    }
    assert!(
        differ > 25,
        "{differ}: the sets should tell the methods apart"
    );
}

#[test]
fn the_narrow_gate_before_a_wide_one_counts() {
    // A room with a narrow gate to another, which has a wide way out.
    let mut balls = Vec::new();
    for (at, hole) in [(-8.0, -1.0), (0.0, 1.2), (8.0, 3.0)] {
        for y in -8..=8 {
            for z in -8..=8 {
                let centre = [at, f64::from(y), f64::from(z)];
                if centre[1].hypot(centre[2]) > hole + 1.0 {
                    balls.push(ball(centre, 1.0));
                }
            }
        }
    }
    for x in -8..=8 {
        for k in -8..=8 {
            for side in [-8.0, 8.0] {
                balls.push(ball([f64::from(x), f64::from(k), side], 1.0));
                balls.push(ball([f64::from(x), side, f64::from(k)], 1.0));
            }
        }
    }
    // The balls left standing around the holes are at (2, 1) and (4, 1) on the walls.
    let [narrow, wide] = [5f64.sqrt() - 1.0, 17f64.sqrt() - 1.0];
    let start = [-4.0, 0.0, 0.0];
    let found = solve(&balls, start, &held(Method::Conservative));
    assert!(
        (found.tunnels[0].width - narrow).abs() < 1e-9,
        "{}",
        found.tunnels[0].width
    );
    assert!(found.tunnels[0].exit()[0] > 7.0);
    // As printed, the search forgets the narrow gate, and its way back to the start runs in a circle.
    let (width, is_circle) = as_printed(&balls, start);
    assert!((width - wide).abs() < 1e-9, "{width}");
    assert!(is_circle);
}

/// What the paper's pseudocode takes for the width of its way, and whether its way back is a circle.
fn as_printed(balls: &[Ball], start: [f64; 3]) -> (f64, bool) {
    let clearance = Clearance::new(balls);
    let centres: Vec<[f64; 3]> = balls.iter().map(|b| b.centre).collect();
    let mut graph = Graph::new(
        Delaunay3::new(&centres),
        Metric::Uniform(1.0),
        balls,
        &clearance,
    );
    let outside = Outside::hull(&graph);
    let first = graph.triangulation.locate(start, None).expect("cells") as usize;
    let count = graph.triangulation.cells().len();
    let (mut best, mut previous) = (vec![f64::NEG_INFINITY; count], vec![None; count]);
    let mut settled = vec![false; count];
    best[first] = f64::INFINITY;
    let mut last = first;
    while !outside.has(last as u32) {
        let open = (0..count).filter(|k| !settled[*k]);
        last = open
            .max_by(|a, b| best[*a].total_cmp(&best[*b]))
            .expect("some cell is outside");
        settled[last] = true;
        for slot in 0..4 {
            let beyond = graph.cell(last as u32).neighbours[slot] as usize;
            let gate = graph.gate(last as u32, slot);
            if best[beyond] < best[beyond].max(gate) {
                best[beyond] = gate;
                previous[beyond] = Some(last);
            }
        }
    }
    let mut at = Some(last);
    let steps = (0..count).take_while(|_| {
        at = at.and_then(|cell| previous[cell]);
        at.is_some_and(|cell| cell != first)
    });
    let is_circle = steps.count() == count;
    (best[last], is_circle)
}

#[test]
fn the_last_gate_counts() {
    // Four balls around a hole that only facets of the hull close.
    let radius = 1.7;
    let corners = [
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
    ];
    let balls = corners.map(|c| ball(scale(c, 1.2), radius));
    // Edges are 1.2 sqrt 8 long, a gate 1/sqrt 3 of that from its corners.
    let gate = 1.2 * 8f64.sqrt() / 3f64.sqrt() - radius;
    let clearance = 1.2 * 3f64.sqrt() - radius;
    assert!(gate > 0.0 && gate < clearance);
    for method in [Method::Conservative, Method::Approximate, Method::Exact] {
        let widest = ideal(&balls, [0.0; 3], method);
        assert!((widest.width - gate).abs() < 1e-6, "{method:?}: {widest:?}");
    }
    // Larger balls close it: the width is negative, and there is no tunnel.
    let closed = corners.map(|c| ball(scale(c, 1.2), 1.97));
    let found = solve(&closed, [0.0; 3], &held(Method::Approximate));
    let widest = found.widest.expect("a way, if thin");
    assert!((widest.width - (gate + radius - 1.97)).abs() < 1e-9 && widest.width < 0.0);
    assert!(found.tunnels.is_empty());
}

#[test]
fn dense_samples_find_nothing_narrower() {
    let radii = [1.2, 1.52, 1.55, 1.7, 1.8];
    for (seed, method) in [
        (1, Method::Approximate),
        (2, Method::Exact),
        (3, Method::Grid(0.4)),
        (4, Method::Balls(12)),
    ] {
        let balls = packing(seed, 200, 1.5, &radii);
        let clearance = Clearance::new(&balls);
        let params = Params {
            count: 3,
            probe_radius: 0.2,
            ..held(method)
        };
        let found = solve(&balls, [0.0; 3], &params);
        assert!(!found.tunnels.is_empty());
        for tunnel in &found.tunnels {
            let mut least = f64::INFINITY;
            for pair in tunnel.centreline.windows(2) {
                let way = sub(pair[1], pair[0]);
                let steps = (length(way) / 0.001).ceil().min(1e5);
                for k in 0..=steps as usize {
                    least = least
                        .min(clearance.at(add(pair[0], scale(way, k as f64 / steps.max(1.0)))));
                }
            }
            let narrowest = tunnel.narrowest.radius;
            assert!(least >= narrowest - 1e-9, "{method:?}: {least} {narrowest}");
            assert!(least <= narrowest + 1e-3, "{method:?}: {least} {narrowest}");
            for stop in &tunnel.stops {
                let depth = balls.iter().map(|b| stop.radius - b.distance(stop.centre));
                assert!(depth.fold(f64::NEG_INFINITY, f64::max) <= 1e-12);
                assert_eq!(stop.radius, balls[stop.ball as usize].distance(stop.centre));
            }
            let steps = tunnel.stops.windows(2).map(|pair| pair[1].at - pair[0].at);
            assert!(steps.fold(0.0, f64::max) <= params.step + 1e-12);
            assert!(
                tunnel
                    .stops
                    .iter()
                    .any(|stop| stop.radius <= narrowest + 1e-12)
            );
        }
    }
}

/// A hollow sphere of small balls with round portholes: direction and radius each.
fn hollow(holes: &[([f64; 3], f64)]) -> Vec<Ball> {
    let (radius, small, count) = (10.0, 0.3, 6000);
    let mut balls = Vec::new();
    for layer in 0..3 {
        let radius = radius + 0.35 * f64::from(layer);
        for k in 0..count {
            // A spiral of equal steps in height.
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
            let angle = 2.399_963_229_728_653 * f64::from(k);
            let around = (1.0 - z * z).sqrt();
            let centre = scale([around * angle.cos(), around * angle.sin(), z], radius);
            let is_open = holes.iter().any(|(direction, hole)| {
                let along = dot(centre, normalize(*direction));
                let off = sub(centre, scale(normalize(*direction), along));
                along > 0.0 && length(off) < hole + small
            });
            if !is_open {
                balls.push(ball(centre, small));
            }
        }
    }
    balls
}

#[test]
fn portholes_come_in_the_order_of_their_width() {
    let holes = [
        ([0.0, 0.0, 1.0], 1.6),
        ([1.0, 0.2, 0.0], 2.0),
        ([-1.0, 1.0, -0.5], 1.3),
    ];
    let balls = hollow(&holes);
    for (method, exit) in [
        (Method::Approximate, Exit::Hull),
        (Method::Exact, Exit::Shell),
        (Method::Conservative, Exit::Shell),
    ] {
        let params = Params {
            method,
            exit,
            count: 3,
            ..Params::DEFAULT
        };
        let found = solve(&balls, [0.5, 0.5, 0.5], &params);
        let widths: Vec<f64> = found.tunnels.iter().map(|t| t.narrowest.radius).collect();
        assert_eq!(widths.len(), 3, "{method:?}: {widths:?}");
        // The rim is made of balls a third apart, so that holes are up to that much wider.
        for ((tunnel, which), rim) in found.tunnels.iter().zip([1, 0, 2]).zip([0.35; 3]) {
            let (direction, hole) = holes[which];
            let exit = normalize(tunnel.exit());
            assert!(
                dot(exit, normalize(direction)) > 0.9,
                "{method:?} {which}: {exit:?}"
            );
            let width = tunnel.narrowest.radius;
            assert!(
                width > hole - 0.01 && width < hole + rim,
                "{method:?} {which}: {width}"
            );
        }
    }
    // What the other removals find is no less wide than what is left, and never the same mouth twice.
    for removal in [Removal::Narrowest, Removal::Around] {
        let params = Params {
            removal,
            count: 3,
            ..Params::DEFAULT
        };
        let found = solve(&balls, [0.5, 0.5, 0.5], &params);
        assert!(!found.tunnels.is_empty());
        for (k, tunnel) in found.tunnels.iter().enumerate() {
            for other in &found.tunnels[..k] {
                assert!(length(sub(tunnel.exit(), other.exit())) > params.mouth);
                assert!(tunnel.narrowest.radius <= other.narrowest.radius);
            }
        }
    }
}

#[test]
fn motions_and_orders_change_nothing() {
    let radii = [1.2, 1.52, 1.55, 1.7, 1.8];
    let mut rng = Rng::new(77, 0);
    for seed in 0..5 {
        let balls = packing(seed, 300, 1.5, &radii);
        for method in [Method::Approximate, Method::Conservative, Method::Exact] {
            let params = Params {
                count: 3,
                probe_radius: 0.2,
                ..held(method)
            };
            let first = solve(&balls, [0.0; 3], &params);
            let mut other = balls.clone();
            other.reverse();
            other.rotate_left(99);
            let same = solve(&other, [0.0; 3], &params);
            assert_eq!(first.searched, same.searched, "{method:?}");
            let ways = |t: &Tunnels| {
                t.tunnels
                    .iter()
                    .map(|t| (t.width, t.centreline.clone()))
                    .collect::<Vec<_>>()
            };
            assert_eq!(ways(&first), ways(&same), "{method:?}");
            let axes = turn(&mut rng);
            let by = [0, 1, 2].map(|_| rng.range(-500.0, 500.0));
            let moved: Vec<Ball> = balls
                .iter()
                .map(|b| ball(turned(b.centre, &axes, by), b.radius))
                .collect();
            let moved = solve(&moved, turned([0.0; 3], &axes, by), &params);
            let (a, b) = (first.widest.expect("a way"), moved.widest.expect("a way"));
            let room = if method == Method::Exact { 1e-6 } else { 1e-9 };
            assert!(
                (a.width - b.width).abs() < room,
                "{method:?}: {} {}",
                a.width,
                b.width
            );
        }
    }
}

#[test]
fn the_full_search_finds_what_the_reduced_one_does() {
    let balls = packing(3, 500, 1.5, &[1.5, 1.7]);
    let reduced = solve(&balls, [0.0; 3], &held(Method::Approximate));
    let params = Params {
        extent: Extent::Full,
        ..held(Method::Approximate)
    };
    let full = solve(&balls, [0.0; 3], &params);
    assert_eq!(full.tunnels, reduced.tunnels);
    assert!(full.searched.settled > 2 * reduced.searched.settled);
}

#[test]
fn atoms_far_from_the_way_out_are_not_triangulated() {
    // A thick wall with a hole that ends in it, near the start.
    let mut rng = Rng::new(21, 0);
    let mut balls = Vec::new();
    for index in 0..32 * 56 * 56 {
        let at = [index % 32 - 4, index / 32 % 56, index / 1792].map(|k| f64::from(k - 28));
        let [x, y, z] = at.map(|k| 1.6 * (k + rng.range(-0.3, 0.3)));
        if !(x > -20.0 && y.hypot(z) < 3.7) {
            balls.push(ball([x, y, z], [1.52, 1.55, 1.7][rng.below(3)]));
        }
    }
    for method in [
        Method::Approximate,
        Method::Conservative,
        Method::Exact,
        Method::Balls(4),
    ] {
        let params = Params {
            method,
            count: 1,
            whole: 20_000,
            ..Params::DEFAULT
        };
        let part = solve(&balls, [-10.0, 0.0, 0.0], &params);
        assert!(
            part.searched.atoms < balls.len() as u64 / 2,
            "{method:?}: {:?}",
            part.searched
        );
        if !matches!(method, Method::Approximate | Method::Conservative) {
            continue;
        }
        let whole = solve(
            &balls,
            [-10.0, 0.0, 0.0],
            &Params {
                whole: usize::MAX,
                ..params
            },
        );
        assert_eq!(whole.searched.atoms, balls.len() as u64);
        assert!(
            length(sub(part.start.used, whole.start.used)) < 1e-9,
            "{method:?}"
        );
        let (a, b) = (part.widest.expect("a way"), whole.widest.expect("a way"));
        assert!(
            (a.width - b.width).abs() < 1e-6 && (a.upper - b.upper).abs() < 1e-6,
            "{a:?} {b:?}"
        );
    }
}

#[test]
fn the_start_is_the_widest_place_near() {
    let balls = crystal(&[[0.0; 3]], 7, 6.0, 1.7);
    let given = [16.5, 20.2, 21.9];
    let params = Params {
        start_search: 5.0,
        ..held(Method::Approximate)
    };
    let start = solve(&balls, given, &params).start;
    assert!(
        length(sub(start.used, [15.0, 21.0, 21.0])) < 1e-9,
        "{start:?}"
    );
    assert!((start.clearance - (27f64.sqrt() - 1.7)).abs() < 1e-9);
    let kept = solve(&balls, given, &held(Method::Approximate)).start;
    assert_eq!((kept.used, kept.given), (given, given));
}

#[test]
fn a_start_that_is_nowhere_is_told_from_one_in_an_atom() {
    let balls = crystal(&[[0.0; 3]], 5, 6.0, 1.7);
    let error = |start: [f64; 3]| {
        find(&balls, start, &held(Method::Approximate), &Silent)
            .expect_err("no start")
            .to_string()
    };
    assert!(
        error([12.0, 12.5, 12.0])
            .starts_with("atom 62: the start [12.0, 12.5, 12.0] lies 1.200 deep")
    );
    assert!(error([100.0, 0.0, 0.0]).contains("outside of the molecule"));
    let none = find(&[], [0.0; 3], &held(Method::Approximate), &Silent);
    assert!(none.expect_err("no atoms").to_string().contains("no atoms"));
}

#[test]
fn few_and_flat_sets_have_no_space_inside() {
    let flat: Vec<Ball> = (0..25)
        .map(|k| ball([f64::from(k % 5), f64::from(k / 5), 0.0], 0.3))
        .collect();
    let line: Vec<Ball> = (0..5)
        .map(|k| ball([f64::from(k), 0.0, 0.0], 0.3))
        .collect();
    for balls in [&flat[..1], &flat[..3], &line, &flat] {
        for method in [Method::Approximate, Method::Exact, Method::Grid(0.5)] {
            let found = solve(balls, [0.5, 0.5, 0.5], &held(method));
            assert_eq!(
                (found.tunnels.len(), found.widest),
                (0, None),
                "{}",
                balls.len()
            );
        }
    }
}

#[test]
fn sizes_change_nothing_but_the_size() {
    let balls = packing(9, 200, 1.5, &[1.2, 1.7]);
    for method in [Method::Approximate, Method::Conservative, Method::Exact] {
        let first = ideal(&balls, [0.0; 3], method);
        for exponent in [-100, 100] {
            let factor = 2f64.powi(exponent);
            let scaled: Vec<Ball> = balls
                .iter()
                .map(|b| ball(scale(b.centre, factor), b.radius * factor))
                .collect();
            let params = Params {
                tolerance: 1e-6 * factor,
                ..held(method)
            };
            let other = solve(&scaled, [0.0; 3], &params).widest.expect("a way");
            assert_eq!(other.width, first.width * factor, "{method:?} 2^{exponent}");
            assert_eq!(other.lower, first.lower * factor, "{method:?} 2^{exponent}");
        }
    }
}

#[test]
fn radii_of_all_sizes_are_handled() {
    let mut balls = crystal(&[[0.0; 3]], 5, 6.0, 0.0);
    let truth = 6.0 / 2f64.sqrt();
    for method in [Method::Approximate, Method::Conservative, Method::Exact] {
        assert!(
            (ideal(&balls, [15.0; 3], method).width - truth).abs() < 1e-6,
            "points, {method:?}"
        );
    }
    // One giant among points, on the way.
    balls[0].radius = 3.0;
    let exact = ideal(&balls, [15.0; 3], Method::Exact);
    assert!((exact.width - truth).abs() < 1e-6, "{exact:?}");
    // Twice the same atoms.
    let twice: Vec<Ball> = crystal(&[[0.0; 3], [0.0; 3]], 5, 6.0, 1.7);
    for method in [Method::Approximate, Method::Conservative, Method::Exact] {
        let width = ideal(&twice, [15.0; 3], method).width;
        assert!((width - (truth - 1.7)).abs() < 1e-6, "{method:?}");
    }
}
