use super::*;
use crate::numeric::predicates::power3d;
use crate::numeric::rng::Rng;
use crate::numeric::vector::{dot, length, scale, sub};

/// Sets of points that triangulations fall over, by name.
fn sets() -> Vec<(&'static str, Vec<[f64; 4]>)> {
    let mut rng = Rng::new(11, 0);
    let mut draw = |count: usize, point: &mut dyn FnMut(&mut Rng, usize) -> [f64; 4]| {
        (0..count).map(|k| point(&mut rng, k)).collect::<Vec<_>>()
    };
    let lattice = |k: usize| [(k % 6) as f64, (k / 6 % 6) as f64, (k / 36) as f64, 0.0];
    let turned = |p: [f64; 4], by: f64| {
        let (x, y) = (p[0] * 0.28 - p[1] * 0.96, p[0] * 0.96 + p[1] * 0.28);
        [x + by, 0.8 * y - 0.6 * p[2], 0.6 * y + 0.8 * p[2], p[3]]
    };
    let on_sphere = |r: &mut Rng| {
        let v = [r.unit() - 0.5, r.unit() - 0.5, r.unit() - 0.5];
        let [x, y, z] = scale(v, 1.0 / length(v));
        [x, y, z, 0.0]
    };
    vec![
        (
            "random",
            draw(500, &mut |r, _| [r.unit(), r.unit(), r.unit(), 0.0]),
        ),
        (
            "weighted",
            draw(500, &mut |r, _| {
                [r.unit(), r.unit(), r.unit(), r.unit() * 0.02]
            }),
        ),
        (
            "heavy",
            draw(500, &mut |r, _| [r.unit(), r.unit(), r.unit(), r.unit()]),
        ),
        ("lattice", draw(216, &mut |_, k| lattice(k))),
        (
            "lattice of sixths",
            draw(216, &mut |_, k| lattice(k).map(|v| v / 6.0)),
        ),
        (
            "weighted lattice",
            draw(216, &mut |r, k| {
                let p = lattice(k);
                [p[0], p[1], p[2], r.below(3) as f64]
            }),
        ),
        (
            "turned lattice",
            draw(216, &mut |_, k| turned(lattice(k), 0.1)),
        ),
        (
            "far lattice",
            draw(216, &mut |_, k| turned(lattice(k), 1e9)),
        ),
        ("on a sphere", draw(300, &mut |r, _| on_sphere(r))),
        (
            "sphere and centre",
            draw(300, &mut |r, k| {
                if k == 0 { [0.0; 4] } else { on_sphere(r) }
            }),
        ),
        (
            "plane and one",
            draw(200, &mut |r, k| {
                [
                    r.below(9) as f64,
                    r.below(9) as f64,
                    f64::from(k == 150),
                    0.0,
                ]
            }),
        ),
        (
            "thrice",
            draw(300, &mut |r, k| {
                let mut own = Rng::new(5, k as u64 / 3);
                [own.unit(), own.unit(), own.unit(), 1e-3 * r.below(3) as f64]
            }),
        ),
        (
            "two lines",
            draw(120, &mut |_, k| {
                let t = (k / 2) as f64;
                if k % 2 == 0 {
                    [t, 0.0, 0.0, 0.0]
                } else {
                    [0.0, t, 1.0, 0.0]
                }
            }),
        ),
        (
            "helix",
            draw(200, &mut |_, k| {
                let t = k as f64 * 0.5;
                [t.cos(), t.sin(), 0.1 * t, 0.0]
            }),
        ),
        (
            "clustered",
            draw(400, &mut |r, k| {
                let size = 10f64.powi(-(k as i32 % 9));
                [r.unit() * size, r.unit() * size, r.unit() * size, 0.0]
            }),
        ),
        (
            "five",
            vec![
                [0.0; 4],
                [2.0, 0.0, 0.0, 0.0],
                [0.0, 2.0, 0.0, 0.0],
                [0.0, 0.0, 2.0, 0.0],
                [0.5, 0.5, 0.5, -9.0],
            ],
        ),
    ]
}

/// The finite cells, as sorted corners by coordinates and weight.
fn shapes(d: &Delaunay3) -> Vec<[[u64; 4]; 4]> {
    let cells = (0u32..).zip(d.cells()).filter(|(_, cell)| cell.is_finite());
    let mut all: Vec<_> = cells
        .map(|(index, _)| {
            let mut corners = d.corners(index).map(|p| p.map(|v| (v + 0.0).to_bits()));
            corners.sort_unstable();
            corners
        })
        .collect();
    all.sort_unstable();
    all
}

#[test]
fn awkward_sets_become_triangulations() {
    for (name, points) in sets() {
        let d = Delaunay3::regular(&points);
        assert_eq!(d.dimension(), 3, "{name}");
        assert!(d.finite_cells() > 0, "{name}");
        assert_eq!(d.check(), Ok(()), "{name}");
        let whole: std::collections::HashSet<u32> =
            (0..points.len() as u32).map(|v| d.input(v)).collect();
        assert_eq!(
            whole.len(),
            points.len(),
            "{name}: every point is a vertex or knows that it is none"
        );
    }
}

#[test]
fn no_point_lies_inside_any_sphere() {
    // By brute force over all points, where `check` looks at neighbours alone.
    for (name, points) in sets() {
        let d = Delaunay3::regular(&points);
        for (index, _) in (0u32..).zip(d.cells()).filter(|(_, cell)| cell.is_finite()) {
            let [a, b, c, e] = d.corners(index);
            let inside = points.iter().find(|p| power3d(a, b, c, e, **p) > 0);
            assert_eq!(inside, None, "{name}, cell {index}");
        }
    }
}

#[test]
fn the_order_of_points_changes_nothing() {
    for (name, mut points) in sets() {
        let first = shapes(&Delaunay3::regular(&points));
        points.reverse();
        assert_eq!(shapes(&Delaunay3::regular(&points)), first, "{name}");
        let middle = points.len() / 3;
        points.rotate_left(middle);
        assert_eq!(shapes(&Delaunay3::regular(&points)), first, "{name}");
    }
}

#[test]
fn sizes_and_exact_shifts_change_nothing() {
    let mut rng = Rng::new(2, 0);
    // Multiples of 2^-20, so that shifts by whole numbers are exact.
    let mut coordinate = || (rng.unit() * 1048576.0).floor() / 1048576.0;
    let points: Vec<[f64; 4]> = (0..300)
        .map(|_| [coordinate(), coordinate(), coordinate(), 0.0])
        .collect();
    let cells = |points: &[[f64; 4]]| Delaunay3::regular(points).cells().to_vec();
    let first = cells(&points);
    for exponent in [-300, -100, -7, 9, 100, 300] {
        let factor = 2f64.powi(exponent);
        let scaled: Vec<_> = points.iter().map(|p| p.map(|v| v * factor)).collect();
        assert_eq!(cells(&scaled), first, "2^{exponent}");
    }
    for by in [1.0, -3.0, 1e6, 1e9] {
        let moved: Vec<_> = points
            .iter()
            .map(|p| [p[0] + by, p[1] - by, p[2] + 2.0 * by, 0.0])
            .collect();
        assert_eq!(cells(&moved), first, "{by}");
    }
}

#[test]
fn flat_sets_have_no_cells() {
    let line: Vec<[f64; 3]> = (0..9)
        .map(|k| [k as f64 * 0.1, k as f64 * 0.2, k as f64 * 0.3])
        .collect();
    let exact: Vec<[f64; 3]> = (0..9).map(|k| [k as f64, 2.0 * k as f64, 0.0]).collect();
    let plane: Vec<[f64; 3]> = (0..9)
        .map(|k| [(k % 3) as f64, (k / 3) as f64, 7.0])
        .collect();
    let cases = [
        (vec![], -1),
        (vec![[1.0, 2.0, 3.0]; 5], 0),
        (exact, 1),
        (plane, 2),
    ];
    for (points, dimension) in cases {
        let d = Delaunay3::new(&points);
        assert_eq!(d.dimension(), dimension);
        assert!(d.cells().is_empty());
        assert_eq!(d.check(), Ok(()));
        assert_eq!(d.locate([0.0; 3], None), None);
    }
    // Rounding takes these off their line, exactly: they span space, or a plane.
    let d = Delaunay3::new(&line);
    assert!(d.dimension() > 1);
    assert_eq!(d.check(), Ok(()));
}

#[test]
fn a_broken_triangulation_is_told_from_a_whole_one() {
    let points: Vec<[f64; 4]> = sets().swap_remove(0).1;
    let good = Delaunay3::regular(&points);
    let finite = (0..good.cells.len())
        .find(|k| good.cells[*k].is_finite())
        .expect("there are cells");
    let mut turned = good.clone();
    turned.cells[finite].vertices.swap(0, 1);
    turned.cells[finite].neighbours.swap(0, 1);
    assert!(matches!(
        turned.check(),
        Err(Broken::Neighbour { .. } | Broken::Orientation { .. })
    ));
    let mut forgetful = good.clone();
    forgetful.cells[finite].neighbours[2] = finite as u32;
    assert!(matches!(forgetful.check(), Err(Broken::Neighbour { .. })));
    let mut moved = good.clone();
    let inner = (0..moved.points.len() as u32)
        .find(|v| {
            !good
                .cells
                .iter()
                .any(|c| !c.is_finite() && c.vertices.contains(v))
        })
        .expect("some vertex is not on the hull");
    let p = &mut moved.points[inner as usize];
    (p[0], p[1], p[2]) = (p[0] + 0.05, p[1] + 0.05, p[2]);
    assert!(matches!(
        moved.check(),
        Err(Broken::Orientation { .. } | Broken::Sphere { .. })
    ));
    let mut heavier = good.clone();
    heavier.points[inner as usize][3] = 1.0;
    assert!(matches!(heavier.check(), Err(Broken::Sphere { .. })));
    let mut forgotten = good;
    forgotten.points.push([0.5, 0.5, 0.5, 0.0]);
    forgotten.inputs.push(500);
    forgotten.cell_of.push(NONE);
    assert!(matches!(
        forgotten.check(),
        Err(Broken::Hidden { vertex: 500 })
    ));
}

#[test]
fn hidden_points_are_no_vertices() {
    let d = Delaunay3::regular(&sets().pop().expect("the last").1);
    let hidden: Vec<u32> = (0..5)
        .filter(|v| d.cell_of(*v).is_none())
        .map(|v| d.input(v))
        .collect();
    assert_eq!(hidden, [4]);
    assert_eq!(d.finite_cells(), 1);
    // The heavier of two in one place stays, whichever comes first.
    let mut points = vec![
        [0.0; 4],
        [2.0, 0.0, 0.0, 0.0],
        [0.0, 2.0, 0.0, 0.0],
        [0.0, 0.0, 2.0, 0.0],
    ];
    points.extend([[0.5, 0.5, 0.5, 0.1], [0.5, 0.5, 0.5, 0.2]]);
    for expected in [5, 4] {
        let d = Delaunay3::regular(&points);
        assert_eq!(d.check(), Ok(()));
        let vertices: Vec<u32> = (0..6)
            .filter(|v| d.cell_of(*v).is_some())
            .map(|v| d.input(v))
            .collect();
        assert!(
            vertices.contains(&expected) && vertices.len() == 5,
            "{vertices:?}"
        );
        points.swap(4, 5);
    }
}

#[test]
fn points_are_found_in_the_cell_that_holds_them() {
    for (name, points) in sets() {
        let d = Delaunay3::regular(&points);
        let mut rng = Rng::new(4, 0);
        let mut near = None;
        for _ in 0..100 {
            let p = [
                rng.range(-0.2, 1.2),
                rng.range(-0.2, 1.2),
                rng.range(-0.2, 1.2),
            ];
            let cell = d.locate(p, near).expect("there are cells");
            near = Some(cell);
            let Cell { vertices, .. } = d.cells()[cell as usize];
            let beyond = vertices.iter().position(|v| *v == INFINITE);
            for slot in 0..4 {
                let others = FACET[slot].map(|k| vertices[k]);
                if others.contains(&INFINITE) {
                    continue;
                }
                let [a, b, c] = others.map(|v| place(d.points()[v as usize]));
                let on_its_side = side_of_plane(a, b, c, p);
                match beyond {
                    None => assert!(on_its_side >= 0, "{name}"),
                    Some(_) => assert_eq!(on_its_side, 1, "{name}"),
                }
            }
        }
    }
}

#[test]
fn orthospheres_have_one_power_to_their_corners() {
    for (name, points) in sets()
        .into_iter()
        .filter(|(name, _)| ["random", "weighted"].contains(name))
    {
        let d = Delaunay3::regular(&points);
        for (index, _) in (0u32..).zip(d.cells()).filter(|(_, cell)| cell.is_finite()) {
            let corners = d.corners(index);
            let power = |centre: [f64; 3], p: [f64; 4]| {
                let from = sub(centre, place(p));
                dot(from, from) - p[3]
            };
            let sphere = orthosphere(corners);
            let room = 1e-9 * (1.0 + sphere.square.abs());
            let flat = orthosphere_of_facet([corners[0], corners[1], corners[2]]);
            // The condition of slivers costs digits; most cells are far from flat.
            if sphere.square < 1.0 {
                for p in corners {
                    assert!(
                        (power(sphere.centre, p) - sphere.square).abs() < room,
                        "{name} {index}"
                    );
                }
            }
            for p in &corners[..3] {
                assert!(
                    (power(flat.centre, *p) - flat.square).abs() < 1e-9,
                    "{name} {index}"
                );
            }
            assert!(flat.square <= sphere.square + room, "{name} {index}");
        }
    }
}
