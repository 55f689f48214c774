use super::*;
use crate::mesh::shapes::cuboid;
use crate::progress::Silent;
use proptest::prelude::*;

fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Topology {
    let mesh = Mesh::from_triangles(positions.to_vec(), triangles.to_vec());
    topology(&mesh, &Silent).expect("a sound mesh")
}

const TETRAHEDRON: ([Vec3; 4], [[u32; 3]; 4]) = (
    [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
);

/// A torus of n by m quadrilaterals, each split in two.
fn torus(n: u32, m: u32) -> Mesh {
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    let mut mesh = Mesh::default();
    for i in 0..n {
        for j in 0..m {
            let u = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
            let v = f64::from(j) / f64::from(m) * std::f64::consts::TAU;
            let r = 2.0 + v.cos();
            mesh.positions.push([r * u.cos(), r * u.sin(), v.sin()]);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// The same triangles, each with corners of its own.
fn soup(mesh: &Mesh) -> Mesh {
    let positions: Vec<Vec3> = (0..mesh.triangles.len())
        .flat_map(|t| mesh.corners(t))
        .collect();
    let triangles = (0..mesh.triangles.len() as u32)
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    Mesh::from_triangles(positions, triangles)
}

#[test]
fn area_and_volume_beyond_numbers_are_none_and_said() {
    let of = |side: f64| topology(&cuboid([0.0; 3], [side; 3]), &Silent).expect("sound");
    let codes =
        |t: &Topology| -> Vec<String> { t.warnings().into_iter().map(|w| w.code).collect() };
    let t = of(1e200);
    assert_eq!((t.area, t.volume), (None, None));
    assert_eq!(codes(&t), ["area-overflows", "volume-overflows"]);
    let t = of(1e120);
    assert!(t.area.is_some() && t.volume.is_none());
    assert_eq!(codes(&t), ["volume-overflows"]);
    assert!(codes(&of(1e90)).is_empty());
}

#[test]
fn a_tetrahedron_is_a_sphere() {
    let t = of(&TETRAHEDRON.0, &TETRAHEDRON.1);
    assert!(t.closed && t.oriented && t.manifold);
    assert_eq!((t.edges, t.euler_characteristic, t.genus), (6, 2, Some(0)));
    assert_eq!(t.volume, Some(1.0 / 6.0));
    assert!((t.area.expect("finite") - (1.5 + 3f64.sqrt() / 2.0)).abs() < 1e-15);
    assert_eq!(t.bounds, Some([[0.0; 3], [1.0; 3]]));
    assert_eq!(t.warnings(), []);
}

#[test]
fn a_torus_has_one_handle_as_a_soup_too() {
    let mesh = torus(30, 20);
    for mesh in [mesh.clone(), soup(&mesh)] {
        let t = topology(&mesh, &Silent).expect("sound");
        assert!(t.closed && t.oriented && t.manifold);
        assert_eq!((t.distinct_vertices, t.edges), (600, 1800));
        assert_eq!(
            (t.euler_characteristic, t.genus, t.components),
            (0, Some(1), 1)
        );
        let volume = 2.0 * std::f64::consts::PI.powi(2) * 2.0;
        assert!((t.volume.expect("closed") / volume - 1.0).abs() < 0.03);
    }
}

#[test]
fn an_open_mesh_has_a_boundary_and_no_volume() {
    let t = of(&TETRAHEDRON.0, &TETRAHEDRON.1[1..]);
    assert_eq!(
        t.boundary_edges,
        Found {
            count: 3,
            first: Some(0)
        }
    );
    assert!(!t.closed && t.oriented && t.manifold);
    assert_eq!((t.volume, t.genus, t.euler_characteristic), (None, None, 1));
}

#[test]
fn a_turned_triangle_is_named() {
    let mut triangles = TETRAHEDRON.1;
    triangles[2].reverse();
    let t = of(&TETRAHEDRON.0, &triangles);
    assert_eq!(
        t.inconsistent_edges,
        Found {
            count: 3,
            first: Some(0)
        }
    );
    assert!(t.closed && t.manifold && !t.oriented);
    assert_eq!((t.volume, t.genus), (None, None));
    assert_eq!(t.warnings()[0].code, "inconsistent-winding");
}

#[test]
fn two_tetrahedra_at_one_vertex_or_edge_are_not_manifold() {
    let mut positions = TETRAHEDRON.0.to_vec();
    positions.extend([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
    let mut triangles = TETRAHEDRON.1.to_vec();
    triangles.extend(TETRAHEDRON.1.map(|t| {
        let [a, b, c] = t.map(|v| if v == 0 { 0 } else { v + 3 });
        [a, c, b]
    }));
    let t = of(&positions, &triangles);
    assert_eq!(
        t.non_manifold_vertices,
        Found {
            count: 1,
            first: Some(0)
        }
    );
    assert_eq!((t.non_manifold_edges.count, t.components), (0, 1));
    assert!(t.closed && t.oriented && !t.manifold);
    assert!((t.volume.expect("balanced") - 1.0 / 3.0).abs() < 1e-15);

    let mut positions = TETRAHEDRON.0.to_vec();
    positions.extend([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]);
    let mut triangles = TETRAHEDRON.1.to_vec();
    triangles.extend(TETRAHEDRON.1.map(|t| t.map(|v| [0, 4, 5, 3][v as usize])));
    let t = of(&positions, &triangles);
    assert_eq!(
        t.non_manifold_edges,
        Found {
            count: 1,
            first: Some(1)
        }
    );
    assert!(!t.closed && t.oriented && !t.manifold);
    assert!((t.volume.expect("balanced") - 1.0 / 3.0).abs() < 1e-15);
}

#[test]
fn troubles_are_counted_with_the_first() {
    let mut positions = TETRAHEDRON.0.to_vec();
    positions.extend([
        [0.5, 0.5, 0.0],
        [9.0; 3],
        [-0.0, 0.0, -0.0],
        [0.1, 0.1, 0.1],
        [0.3, 0.3, 0.3],
    ]);
    let mut triangles = TETRAHEDRON.1.to_vec();
    triangles.extend([
        [1, 2, 0],
        [0, 1, 6],
        [1, 4, 2],
        [3, 3, 3],
        // 0.3 is not three times 0.1 in binary, but all three are equal coordinates: on a line.
        [0, 7, 8],
    ]);
    let t = of(&positions, &triangles);
    assert_eq!(
        t.duplicate_triangles,
        Found {
            count: 1,
            first: Some(4)
        }
    );
    assert_eq!(
        t.degenerate_triangles,
        Found {
            count: 2,
            first: Some(5)
        }
    );
    assert_eq!(
        t.zero_area_triangles,
        Found {
            count: 2,
            first: Some(6)
        }
    );
    assert_eq!(
        t.isolated_vertices,
        Found {
            count: 1,
            first: Some(5)
        }
    );
    assert_eq!(
        t.duplicate_vertices,
        Found {
            count: 1,
            first: Some(6)
        }
    );
    let codes: Vec<String> = t.warnings().into_iter().map(|w| w.code).collect();
    assert_eq!(codes.len(), 6, "{codes:?}");
}

#[test]
fn nothing_is_nothing() {
    let t = of(&[], &[]);
    assert!(!t.closed && !t.oriented && !t.manifold);
    assert_eq!((t.components, t.bounds, t.volume), (0, None, None));
    let mut strip = Mesh::from_triangles(vec![[0.0; 3], [1.0; 3], [2.0; 3]], vec![]);
    strip.segments = vec![[0, 1]];
    strip.points = vec![2];
    let t = topology(&strip, &Silent).expect("sound");
    assert_eq!((t.components, t.isolated_vertices.count), (1, 0));
    let wild = Mesh::from_triangles(vec![[0.0; 3]], vec![[0, 0, 1]]);
    assert!(topology(&wild, &Silent).is_err());
}

#[test]
fn size_and_place_change_only_what_they_must() {
    let mesh = torus(24, 12);
    let base = topology(&mesh, &Silent).expect("sound");
    for (exponent, shift) in [(-100, 0.0), (100, 0.0), (0, 2f64.powi(32))] {
        let mut moved = mesh.clone();
        for c in moved.positions.iter_mut().flatten() {
            *c = times_power_of_two(*c, exponent) + shift;
        }
        let t = topology(&moved, &Silent).expect("sound");
        let share = times_power_of_two(t.volume.expect("closed"), -3 * exponent);
        let wanted = base.volume.expect("closed");
        let roundings = if shift == 0.0 { 0.0 } else { 1e-5 };
        assert!(
            (share / wanted - 1.0).abs() <= roundings,
            "{share} {wanted}"
        );
        let figures = Topology {
            area: base.area,
            volume: base.volume,
            bounds: base.bounds,
            ..t
        };
        assert_eq!(figures, base);
    }
}

proptest! {
    #[test]
    fn order_and_threads_change_no_count(seed in any::<u64>(), count in 1usize..200) {
        let mut rng = crate::numeric::rng::Rng::new(seed, 0);
        // Few places for many triangles: every kind of trouble.
        let positions: Vec<Vec3> = (0..30)
            .map(|_| std::array::from_fn(|_| (rng.unit() * 3.0).floor()))
            .collect();
        let mut triangles: Vec<[u32; 3]> = (0..count)
            .map(|_| std::array::from_fn(|_| rng.below(30) as u32))
            .collect();
        let on = |threads, triangles: &[[u32; 3]]| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| of(&positions, triangles))
        };
        let one = on(1, &triangles);
        prop_assert_eq!(&one, &on(5, &triangles));
        triangles.reverse();
        let turned = on(1, &triangles);
        let counts = |t: &Topology| (
            [t.edges, t.components, t.degenerate_triangles.count, t.zero_area_triangles.count],
            [t.duplicate_triangles.count, t.boundary_edges.count, t.non_manifold_edges.count],
            [t.non_manifold_vertices.count, t.inconsistent_edges.count, t.isolated_vertices.count],
            [t.closed, t.oriented, t.manifold],
            t.euler_characteristic,
        );
        prop_assert_eq!(counts(&one), counts(&turned));
        let area = |t: &Topology| t.area.expect("finite");
        prop_assert!((area(&one) - area(&turned)).abs() <= 1e-12 * area(&one));
    }
}
