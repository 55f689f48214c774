//! Meshes with known distances.

use crate::mesh::Mesh;
use crate::numeric::rng::Rng;
use crate::numeric::vector::Vec3;

/// A square of side 1 in the plane `z`, of 2 n^2 triangles.
pub fn square(n: u32, z: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=n {
        for j in 0..=n {
            mesh.positions
                .push([f64::from(i) / f64::from(n), f64::from(j) / f64::from(n), z]);
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j;
            mesh.triangles
                .extend([[a, a + n + 1, a + n + 2], [a, a + n + 2, a + 1]]);
        }
    }
    mesh
}

/// A sphere around the origin: n bands of 2 n quadrilaterals, about 4 n^2 triangles.
pub fn sphere(n: u32, radius: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let around = 2 * n;
    let turn = std::f64::consts::PI / f64::from(n);
    mesh.positions.push([0.0, 0.0, radius]);
    for i in 1..n {
        for j in 0..around {
            let (u, v) = (turn * f64::from(i), turn * f64::from(j));
            mesh.positions
                .push([u.sin() * v.cos(), u.sin() * v.sin(), u.cos()].map(|c| c * radius));
        }
    }
    mesh.positions.push([0.0, 0.0, -radius]);
    let last = mesh.positions.len() as u32 - 1;
    let at = |i: u32, j: u32| match i {
        0 => 0,
        i if i == n => last,
        i => 1 + (i - 1) * around + j % around,
    };
    for i in 0..n {
        for j in 0..around {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if i + 1 < n {
                mesh.triangles.push([a, b, c]);
            }
            if i > 0 {
                mesh.triangles.push([a, c, d]);
            }
        }
    }
    mesh
}

/// The box from `lo` to `lo + 1`, of 12 triangles.
pub fn cube(lo: Vec3) -> Mesh {
    let positions = (0..8)
        .map(|c| std::array::from_fn(|a| lo[a] + f64::from(c >> a & 1)))
        .collect();
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    Mesh::from_triangles(positions, triangles)
}

/// Triangles anywhere in the unit box, some of them segments or points.
pub fn soup(seed: u64, count: u64) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..count {
        let mut rng = Rng::new(seed, i);
        let mut corners: [Vec3; 3] = std::array::from_fn(|_| std::array::from_fn(|_| rng.unit()));
        match rng.below(8) {
            0 => corners[2] = corners[1],
            1 => corners = [corners[0]; 3],
            _ => {}
        }
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

/// The same mesh with every coordinate changed.
pub fn moved(mesh: &Mesh, f: impl Fn(f64) -> f64) -> Mesh {
    let mut mesh = mesh.clone();
    for c in mesh.positions.iter_mut().flatten() {
        *c = f(*c);
    }
    mesh
}
