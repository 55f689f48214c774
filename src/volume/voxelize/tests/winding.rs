//! The fill against the generalised winding number summed over all triangles.

use super::*;
use crate::mesh::distance::point_triangle;
use crate::mesh::shapes::{cuboid, icosphere, joined, octasphere, open_box, sheet};
use crate::numeric::rng::Rng;
use crate::numeric::vector::{Vec3, cross, dot, length, sub};
use std::f64::consts::{PI, TAU};

/// The winding number of a mesh at a point: the solid angles of its triangles (Van Oosterom and
/// Strackee 1983) over that of the sphere.
fn winding_number(mesh: &Mesh, p: Vec3) -> f64 {
    let angle = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(|q| sub(q, p));
        let [la, lb, lc] = [a, b, c].map(length);
        let volume = dot(a, cross(b, c));
        volume.atan2(la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
    };
    (0..mesh.triangles.len()).map(angle).sum::<f64>() / TAU
}

fn distance(mesh: &Mesh, p: Vec3) -> f64 {
    (0..mesh.triangles.len())
        .map(|t| point_triangle(p, mesh.corners(t)).distance_squared)
        .fold(f64::INFINITY, f64::min)
        .sqrt()
}

/// Fills `mesh` and compares every centre with the winding number of `oriented`, which is the mesh
/// with its patches wound as the fill should wind them. Centres on the surface or with a winding
/// number of one half have no right answer. Returns what was found.
fn check(name: &str, mesh: &Mesh, oriented: &Mesh, dims: [usize; 3]) -> Stats {
    let params = unit(dims, Mode::None, Fill::Winding);
    let (found, stats) = run(mesh, &params);
    let sparse = run(
        mesh,
        &Params {
            grid: Storage::Sparse,
            ..params.clone()
        },
    );
    assert!(sparse.0 == found, "{name}: sparse");
    let sign = if warned(&stats, "inside-out").is_some() {
        -1.0
    } else {
        1.0
    };
    let mut compared = 0;
    for [x, y, z] in voxels(dims) {
        let p = [x, y, z].map(|c| c as f64 + 0.5);
        let w = sign * winding_number(oriented, p);
        if (w - 0.5).abs() > 1e-9 && distance(oriented, p) > 1e-9 {
            compared += 1;
            assert_eq!(found.get(x, y, z), w > 0.5, "{name}: {w} at {p:?}");
        }
    }
    let all = dims.iter().product::<usize>();
    assert!(2 * compared > all, "{name}: {compared} of {all}");
    let parity = run(
        mesh,
        &Params {
            fill: Fill::Parity,
            ..params
        },
    );
    let differ = parity.0.words().iter().zip(found.words());
    let differ: u64 = differ.map(|(a, b)| u64::from((a ^ b).count_ones())).sum();
    assert_eq!(stats.fill_disagreement, Some(differ), "{name}");
    assert_eq!(parity.1.fill_disagreement, Some(differ), "{name}");
    stats
}

fn same(name: &str, mesh: &Mesh, dims: [usize; 3]) -> Stats {
    check(name, mesh, mesh, dims)
}

fn reversed(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

/// Each triangle with three vertices of its own, as STL files have it.
fn unshared(mesh: &Mesh) -> Mesh {
    let positions = (0..mesh.triangles.len())
        .flat_map(|t| mesh.corners(t))
        .collect();
    let triangles = (0..mesh.triangles.len() as u32)
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    Mesh::from_triangles(positions, triangles)
}

/// The triangles that `keep` accepts.
fn kept(mut mesh: Mesh, keep: impl Fn(usize, [Vec3; 3]) -> bool) -> Mesh {
    let triangles = (0..mesh.triangles.len())
        .filter(|t| keep(*t, mesh.corners(*t)))
        .map(|t| mesh.triangles[t])
        .collect();
    mesh.triangles = triangles;
    mesh
}

#[test]
fn open_boxes_fill_as_their_winding_number_says() {
    let boxes = [
        open_box([3.2, 4.1, 2.7], [15.3, 12.8, 13.4]),
        // The border on lines through voxel centres, and on lattice planes.
        open_box([3.5, 4.5, 2.5], [15.5, 12.5, 13.5]),
        open_box([3.0, 4.0, 2.0], [15.0, 12.0, 13.0]),
        open_box([3.0, 4.5, 2.5], [15.5, 12.0, 13.0]),
        // A border outside of the grid.
        open_box([3.2, 4.1, 2.7], [15.3, 12.8, 40.0]),
        open_box([-5.0, -5.0, -5.0], [30.0, 30.0, 9.0]),
    ];
    for mesh in boxes {
        // The opening faces each way along each axis.
        for turn in 0..6 {
            let place = |mut p: Vec3| {
                if turn >= 3 {
                    // A half turn around y, which keeps the winding.
                    p = [18.0 - p[0], p[1], 18.0 - p[2]];
                }
                p.rotate_left(turn % 3);
                p
            };
            let mut mesh = mesh.clone();
            mesh.positions.iter_mut().for_each(|p| *p = place(*p));
            let stats = same("open box", &mesh, [18, 18, 18]);
            assert_eq!(warned(&stats, "inside-out"), None);
            assert!(stats.set_voxels > 100, "{}", stats.set_voxels);
            assert_eq!(
                (stats.border_edges, warned(&stats, "open-surface")),
                (Some(4), Some(4))
            );
        }
    }
}

#[test]
fn open_sheets_fill_as_their_winding_number_says() {
    for (offset, turns) in [
        (0.0, 0.5),
        (0.13, 0.5),
        (0.5, 0.5),
        (0.13, 0.75),
        (0.13, 0.95),
    ] {
        let mut bent = sheet(1.0, 12.0, 24, 6);
        for p in &mut bent.positions {
            let angle = TAU * turns * (p[0] + 0.5);
            *p = [
                9.0 + offset - 6.0 * angle.cos(),
                9.0 + offset + p[1],
                9.0 + offset + 6.0 * angle.sin(),
            ];
        }
        let stats = same("bent sheet", &bent, [18, 19, 17]);
        assert_eq!(stats.border_edges, Some(60));
        // Behind the other face the number is the same, below zero.
        let other = same("bent sheet, reversed", &reversed(bent), [18, 19, 17]);
        assert!(warned(&stats, "inside-out") != warned(&other, "inside-out"));
    }
}

#[test]
fn spheres_with_holes_fill_as_their_winding_number_says() {
    for normal in [[0.0, 0.0, 1.0], [1.0, 0.2, -0.3], [-0.7, 0.7, 0.1]] {
        let centre = [9.1, 8.9, 9.05];
        let hole = |size: f64| {
            kept(icosphere(centre, 7.0, 2), |_, [a, ..]| {
                dot(sub(a, centre), normal) < size * length(normal)
            })
        };
        for size in [5.5, 1.0, -3.0] {
            let mesh = hole(size);
            let stats = same("sphere with a hole", &mesh, [18, 18, 18]);
            assert!(stats.border_edges > Some(4));
            let apart = unshared(&mesh);
            let other = check("unshared vertices", &apart, &mesh, [18, 18, 18]);
            assert_eq!(other.border_edges, stats.border_edges);
            assert_eq!(other.set_voxels, stats.set_voxels);
        }
    }
}

#[test]
fn overlapping_and_nested_spheres_fill_as_their_winding_number_says() {
    let dims = [24, 18, 18];
    let (first, second) = (
        octasphere([8.6, 9.1, 9.2], 6.3, 5),
        octasphere([14.2, 8.8, 9.1], 6.1, 5),
    );
    let both = joined(first.clone(), &second);
    let stats = same("overlapping spheres", &both, dims);
    let twice = voxels(dims)
        .filter(|v| winding_number(&both, v.map(|c| c as f64 + 0.5)) > 1.5)
        .count();
    assert!(twice > 50);
    assert_eq!(stats.fill_disagreement, Some(twice as u64));
    assert_eq!((stats.border_edges, stats.warnings.len()), (Some(0), 0));
    let inner = octasphere([8.6, 9.1, 9.2], 3.3, 5);
    let cavity = same(
        "a cavity",
        &joined(first.clone(), &reversed(inner.clone())),
        dims,
    );
    let solid = same("a nested sphere", &joined(first, &inner), dims);
    assert!(solid.set_voxels - cavity.set_voxels > 100);
    assert_eq!(
        solid.fill_disagreement,
        Some(solid.set_voxels - cavity.set_voxels)
    );
    assert_eq!(cavity.fill_disagreement, Some(0));
}

#[test]
fn patches_are_wound_one_way_before_they_are_filled() {
    let dims = [18, 18, 18];
    let sphere = octasphere([9.1, 8.9, 9.05], 7.0, 6);
    let wanted = same("sphere", &sphere, dims);
    for seed in 0..4 {
        let mut mixed = sphere.clone();
        let mut turned = 0;
        for (i, t) in mixed.triangles.iter_mut().enumerate() {
            if Rng::new(seed, i as u64).below(3) == 0 {
                t.swap(0, 1);
                turned += 1;
            }
        }
        for mesh in [mixed.clone(), unshared(&mixed)] {
            let stats = check("a third reversed", &mesh, &sphere, dims);
            assert_eq!(stats.set_voxels, wanted.set_voxels);
            assert_eq!(warned(&stats, "reversed-triangles"), Some(turned));
            assert_eq!(stats.border_edges, Some(0));
        }
        // The same with a hole: the rest of the border still counts.
        let upper = |mesh: Mesh| kept(mesh, |_, [a, b, c]| a[2].max(b[2]).max(c[2]) < 13.0);
        check(
            "a third of an open one",
            &upper(mixed),
            &upper(sphere.clone()),
            dims,
        );
    }
    let stats = check(
        "inside out",
        &reversed(sphere.clone()),
        &reversed(sphere),
        dims,
    );
    assert_eq!(
        (stats.set_voxels, warned(&stats, "inside-out")),
        (wanted.set_voxels, Some(1))
    );
}

#[test]
fn a_soup_of_triangles_fills_as_its_winding_number_says() {
    let dims = [16, 17, 18];
    for seed in 0..6 {
        // Large triangles, of which several wind around many centres; on odd seeds their corners are
        // on lattice planes and on lines through centres.
        let corner = |i: u64| {
            let mut rng = Rng::new(100 + seed, i);
            let p = dims.map(|d| rng.range(-4.0, d as f64 + 4.0));
            if seed % 2 == 1 {
                p.map(|c: f64| (2.0 * c).round() / 2.0)
            } else {
                p
            }
        };
        let soup = Mesh::from_triangles(
            (0..90).map(corner).collect(),
            (0..30).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        );
        let stats = same("soup", &soup, dims);
        assert_eq!(stats.border_edges, Some(90));
    }
}

#[test]
fn edges_of_several_sheets_count_as_often_as_they_are_passed() {
    // Three half planes at one edge, and the same sheet three times over.
    let blade = |angle: f64| {
        let (s, c) = angle.sin_cos();
        Mesh::from_triangles(
            vec![
                [9.2, 9.1, 2.3],
                [9.2, 9.1, 15.6],
                [9.2 + 7.0 * c, 9.1 + 7.0 * s, 15.6],
                [9.2 + 7.0 * c, 9.1 + 7.0 * s, 2.3],
            ],
            vec![[0, 1, 2], [0, 2, 3]],
        )
    };
    let three = joined(joined(blade(0.1), &blade(2.2)), &blade(PI + 1.0));
    same("three blades", &three, [18; 3]);
    let one = kept(octasphere([9.1, 8.9, 9.05], 7.0, 4), |_, c| c[0][0] < 6.0);
    let thrice = joined(joined(one.clone(), &one), &one);
    let stats = same("a cap three times", &thrice, [18; 3]);
    assert!(stats.set_voxels > same("a cap", &one, [18; 3]).set_voxels);
    // A box whose top is there twice is closed with a lid too many.
    let mut lid = cuboid([3.2, 4.1, 2.7], [15.3, 12.8, 13.4]);
    lid.triangles.extend_from_within(10..);
    let stats = same("two lids", &lid, [18; 3]);
    assert_eq!(stats.border_edges, Some(4));
}

/// A soup of triangles whose corners are drawn by `corner`.
fn soup(triangles: u32, seed: u64, corner: impl Fn(&mut Rng) -> Vec3) -> Mesh {
    Mesh::from_triangles(
        (0..3 * triangles)
            .map(|i| corner(&mut Rng::new(seed, u64::from(i))))
            .collect(),
        (0..triangles)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect(),
    )
}

#[test]
fn soups_across_tiles_fill_as_their_winding_number_says() {
    let dims = [70, 67, 13];
    for seed in 0..4 {
        let mesh = soup(25, 200 + seed, |rng| {
            let p = dims.map(|d| rng.range(-6.0, d as f64 + 6.0));
            if seed % 2 == 1 {
                p.map(|c: f64| (2.0 * c).round() / 2.0)
            } else {
                p
            }
        });
        assert_eq!(same("soup", &mesh, dims).border_edges, Some(75));
    }
    // The same in small pieces, whose edges are soon too far to be followed.
    let mesh = soup(60, 300, |rng| dims.map(|d| rng.range(0.0, d as f64)));
    let small = Mesh::from_triangles(
        (0..180usize)
            .map(|i| {
                let (p, q) = (mesh.positions[i], mesh.positions[i / 3 * 3]);
                std::array::from_fn(|a| q[a] + 0.1 * (p[a] - q[a]))
            })
            .collect(),
        mesh.triangles.clone(),
    );
    same("small pieces", &small, dims);
}

#[test]
fn spheres_with_scattered_holes_fill_as_their_winding_number_says() {
    let dims = [29, 30, 28];
    for (seed, share) in [(0, 20), (1, 4), (2, 2)] {
        let sphere = icosphere([14.3, 14.6, 14.1], 12.5, 2);
        let mesh = kept(sphere, |t, _| Rng::new(seed, t as u64).below(share) != 0);
        let stats = same("scattered holes", &mesh, dims);
        assert!(stats.border_edges > Some(30));
        assert!(stats.set_voxels > 1000, "{}", stats.set_voxels);
    }
}

#[test]
fn borders_along_the_lattice_fill_as_their_winding_number_says() {
    let dims = [17, 16, 18];
    for seed in 0..6 {
        // Right triangles in planes across an axis: every edge but one along an axis, many along x
        // and through the centres of a row, on even seeds in the planes between voxels.
        let step = if seed % 2 == 0 { 1.0 } else { 0.5 };
        let mut mesh = Mesh::default();
        for i in 0..14 {
            let mut rng = Rng::new(400 + seed, i);
            let mut at = |d: usize| (rng.range(-2.0, d as f64 + 2.0) / step).round() * step;
            let (p, q) = (dims.map(&mut at), dims.map(&mut at));
            let across = i as usize % 3;
            let (u, v) = ((across + 1) % 3, (across + 2) % 3);
            if p[u] == q[u] || p[v] == q[v] {
                continue;
            }
            let (mut b, mut c) = (p, p);
            b[u] = q[u];
            c[v] = q[v];
            mesh = joined(mesh, &Mesh::from_triangles(vec![p, b, c], vec![[0, 1, 2]]));
        }
        same("lattice", &mesh, dims);
    }
}

#[test]
fn long_thin_triangles_fill_as_their_winding_number_says() {
    let dims = [18, 17, 16];
    for seed in 0..4 {
        let far = [30.0, 1e3, 1e5, 1e7][seed as usize];
        // One corner near, one far off, and one beside either.
        let ends = soup(12, 500 + seed, |rng| dims.map(|d| rng.range(0.0, d as f64)));
        let mut mesh = ends.clone();
        for t in 0..12 {
            let [a, b, c] = [0, 1, 2].map(|i| ends.positions[3 * t + i]);
            let out = sub(b, a);
            let aside = sub(c, a);
            let far = far / length(out);
            mesh.positions[3 * t + 1] = std::array::from_fn(|i| a[i] + far * out[i]);
            let from = if t % 2 == 0 {
                a
            } else {
                mesh.positions[3 * t + 1]
            };
            mesh.positions[3 * t + 2] = std::array::from_fn(|i| from[i] + 0.3 * aside[i]);
        }
        same("needles", &mesh, dims);
    }
}

#[test]
fn doubled_borders_count_twice() {
    let dims = [18, 18, 18];
    // Three one way and one the other: twice the same in all, and no two that hang together.
    let twice = |mesh: &Mesh| {
        let more = joined(mesh.clone(), &reversed(mesh.clone()));
        joined(joined(mesh.clone(), mesh), &more)
    };
    let open = twice(&open_box([3.2, 4.1, 2.7], [15.3, 12.8, 13.4]));
    assert_eq!(same("an open box", &open, dims).border_edges, Some(4));
    let pieces = twice(&soup(10, 600, |rng| {
        dims.map(|d| rng.range(-3.0, d as f64 + 3.0))
    }));
    assert_eq!(same("a soup", &pieces, dims).border_edges, Some(30));
    same("a soup around an open box", &joined(pieces, &open), dims);
}

#[test]
fn work_grows_with_the_surface_where_the_winding_number_is_one_half() {
    let pieces = soup(40, 700, |rng| [0; 3].map(|_| rng.range(0.0, 1.0)));
    let work = |n: usize| {
        let mut mesh = pieces.clone();
        for p in &mut mesh.positions {
            *p = p.map(|c| c * n as f64);
        }
        let lattice = Lattice {
            anchor: [0.0; 3],
            margin: [0.0; 3],
            h: 1.0,
            dims: [n; 3],
        };
        super::winding::Border::of(&mesh, &lattice).work([0, 0], lattice.dims)
    };
    let (coarse, fine) = (work(32), work(64));
    // Eight times as many voxels, and four times as many near the surface.
    assert!(fine < 5 * coarse, "{coarse} and {fine}");
    // A direct sum looks at 120 edges for each voxel.
    assert!(5 * fine < 120 * 64 * 64 * 64, "{fine}");
}
