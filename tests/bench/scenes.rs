//! Scenes by formula for shadow rays.

use scantle::mesh::{Mesh, shapes};
use scantle::numeric::rng::Rng;
use scantle::numeric::vector::{Vec3, add, cross, normalize, scale};

/// Sides of a twig: with its ends 4 times as many triangles.
const SIDES: usize = 5;

/// Forks from the stem to the tips.
const FORKS: u32 = 9;

/// The paper's scenes, or what is like them: its knot, its spheres, its tree.
pub fn all() -> Vec<(&'static str, Mesh)> {
    vec![
        ("knot", shapes::torus_knot(2, 3, 0.4, 288, 92)),
        ("spheres", shapes::sphere_grid(3, 0.8, 2.0, 6)),
        ("tree", tree()),
    ]
}

/// A stem that forks in three over and over: 29,524 closed twigs, 590,480 triangles.
pub fn tree() -> Mesh {
    let mut mesh = Mesh::default();
    let mut count = 0;
    grow(&mut mesh, &mut count, [0.0; 3], [0.0, 1.0, 0.0], 1.0, 0);
    mesh
}

fn grow(mesh: &mut Mesh, count: &mut u64, from: Vec3, way: Vec3, length: f64, depth: u32) {
    let to = add(from, scale(way, length));
    twig(mesh, from, to, 0.06 * length);
    if depth == FORKS {
        return;
    }
    *count += 1;
    let mut rng = Rng::new(0, *count);
    let [e, f] = across(way);
    let turn = rng.range(0.0, std::f64::consts::TAU);
    for fork in 0..3 {
        let angle = turn + f64::from(fork) * std::f64::consts::TAU / 3.0 + rng.range(-0.3, 0.3);
        let (sin, cos) = angle.sin_cos();
        let aside = add(scale(e, cos), scale(f, sin));
        let next = normalize(add(way, scale(aside, rng.range(0.5, 0.9))));
        grow(
            mesh,
            count,
            to,
            next,
            length * rng.range(0.66, 0.8),
            depth + 1,
        );
    }
}

fn across(way: Vec3) -> [Vec3; 2] {
    let other = if way[0].abs() < 0.5 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let e = normalize(cross(other, way));
    [e, cross(way, e)]
}

fn twig(mesh: &mut Mesh, from: Vec3, to: Vec3, radius: f64) {
    let first = mesh.positions.len() as u32;
    let [e, f] = across(normalize(scantle::numeric::vector::sub(to, from)));
    mesh.positions.extend([from, to]);
    for i in 0..SIDES {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / SIDES as f64).sin_cos();
        let aside = add(scale(e, cos), scale(f, sin));
        mesh.positions.push(add(from, scale(aside, radius)));
        mesh.positions.push(add(to, scale(aside, 0.7 * radius)));
    }
    let at = |i: usize, end: u32| first + 2 + 2 * (i % SIDES) as u32 + end;
    for i in 0..SIDES {
        let [a, b, c, d] = [at(i, 0), at(i + 1, 0), at(i + 1, 1), at(i, 1)];
        mesh.triangles
            .extend([[a, b, c], [a, c, d], [first, b, a], [first + 1, d, c]]);
    }
}
