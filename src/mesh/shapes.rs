//! Shapes made by formula, for fixtures, tests and benches.
//!
//! All are oriented: counter-clockwise from outside. All are closed and share their vertices,
//! unless they say otherwise. Counts that are too small for a shape are raised to the least that
//! makes one.

use super::Mesh;
use crate::numeric::vector::{Vec3, add, cross, normalize, scale, sub};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// A box between two corners: 8 vertices, 12 triangles.
pub fn cuboid(lo: Vec3, hi: Vec3) -> Mesh {
    let positions = (0..8)
        .map(|c: usize| std::array::from_fn(|a| if c >> a & 1 == 1 { hi[a] } else { lo[a] }))
        .collect();
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    Mesh::from_triangles(positions, split(&quads))
}

/// A box without its upper z side: 8 vertices, 10 triangles, open.
pub fn open_box(lo: Vec3, hi: Vec3) -> Mesh {
    let mut mesh = cuboid(lo, hi);
    mesh.triangles.truncate(10);
    mesh
}

/// A plate: a box in the plane of x and y around the origin, `thickness` high in z.
pub fn plate(width: f64, depth: f64, thickness: f64) -> Mesh {
    let half = [width * 0.5, depth * 0.5, thickness * 0.5];
    cuboid(half.map(|h| -h), half)
}

/// A flat open sheet in the plane z = 0 around the origin, `nx` by `ny` squares of two triangles,
/// facing +z.
pub fn sheet(width: f64, depth: f64, nx: usize, ny: usize) -> Mesh {
    let (nx, ny) = (nx.max(1), ny.max(1));
    let mut positions = Vec::with_capacity((nx + 1) * (ny + 1));
    for j in 0..=ny {
        for i in 0..=nx {
            let [x, y] = [i as f64 / nx as f64 - 0.5, j as f64 / ny as f64 - 0.5];
            positions.push([x * width, y * depth, 0.0]);
        }
    }
    let row = nx as u32 + 1;
    let quads: Vec<[u32; 4]> = (0..ny as u32)
        .flat_map(|j| (0..nx as u32).map(move |i| j * row + i))
        .map(|a| [a, a + 1, a + 1 + row, a + row])
        .collect();
    Mesh::from_triangles(positions, split(&quads))
}

/// A regular tetrahedron around a centre, its corners at a distance of `radius`.
pub fn tetrahedron(centre: Vec3, radius: f64) -> Mesh {
    let c = radius / 3f64.sqrt();
    let positions = [[c, c, c], [c, -c, -c], [-c, c, -c], [-c, -c, c]];
    Mesh::from_triangles(
        positions.map(|p| add(centre, p)).to_vec(),
        vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    )
}

/// A sphere of meridians and parallels around the z axis: `slices` around, `stacks` from pole to
/// pole; `2 slices (stacks - 1)` triangles.
pub fn uv_sphere(centre: Vec3, radius: f64, slices: usize, stacks: usize) -> Mesh {
    let (slices, stacks) = (slices.max(3), stacks.max(2));
    let mut positions = vec![add(centre, [0.0, 0.0, -radius])];
    for j in 1..stacks {
        let latitude = PI * (j as f64 / stacks as f64 - 0.5);
        for i in 0..slices {
            let (sin, cos) = (TAU * i as f64 / slices as f64).sin_cos();
            let ring = radius * latitude.cos();
            let p = [ring * cos, ring * sin, radius * latitude.sin()];
            positions.push(add(centre, p));
        }
    }
    positions.push(add(centre, [0.0, 0.0, radius]));
    let at = |j: usize, i: usize| (1 + (j - 1) * slices + i % slices) as u32;
    let top = (positions.len() - 1) as u32;
    let mut triangles = Vec::with_capacity(2 * slices * (stacks - 1));
    for i in 0..slices {
        triangles.push([0, at(1, i + 1), at(1, i)]);
    }
    for j in 1..stacks - 1 {
        for i in 0..slices {
            let quad = [at(j, i), at(j, i + 1), at(j + 1, i + 1), at(j + 1, i)];
            triangles.extend(halves(quad));
        }
    }
    for i in 0..slices {
        triangles.push([top, at(stacks - 1, i), at(stacks - 1, i + 1)]);
    }
    Mesh::from_triangles(positions, triangles)
}

/// A sphere of nearly equal triangles: an icosahedron, each triangle split in four `levels` times
/// and its vertices moved to the sphere; `20 x 4^levels` triangles (level 7: 327,680). At most 10
/// levels.
pub fn icosphere(centre: Vec3, radius: f64, levels: u32) -> Mesh {
    let golden = (1.0 + 5f64.sqrt()) * 0.5;
    let mut points = Vec::new();
    for (a, b) in [
        (-1.0, golden),
        (1.0, golden),
        (-1.0, -golden),
        (1.0, -golden),
    ] {
        points.extend([[a, b, 0.0], [0.0, a, b], [b, 0.0, a]]);
    }
    let mut points: Vec<Vec3> = points.into_iter().map(normalize).collect();
    let mut triangles = hull_of_icosahedron(&points);
    for _ in 0..levels.min(10) {
        // Looked up only; its order reaches nothing.
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut split = Vec::with_capacity(triangles.len() * 4);
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
                *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    points.push(normalize(add(points[p as usize], points[q as usize])));
                    (points.len() - 1) as u32
                })
            });
            split.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = split;
    }
    let positions = points
        .into_iter()
        .map(|p| add(centre, scale(p, radius)))
        .collect();
    Mesh::from_triangles(positions, triangles)
}

/// The faces of an icosahedron from its 12 corners: the triples of neighbours, outwards.
fn hull_of_icosahedron(points: &[Vec3]) -> Vec<[u32; 3]> {
    use crate::numeric::vector::{dot, length};
    let near = |a: usize, b: usize| length(sub(points[a], points[b])) < 1.2;
    let mut faces = Vec::with_capacity(20);
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = dot(points[a], cross(points[b], points[c])) > 0.0;
                    let (b, c) = if outward { (b, c) } else { (c, b) };
                    faces.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    faces
}

/// A sphere from an octahedron whose faces are split `n` to an edge; `8 n^2` triangles (112:
/// 100,352) and `4 n^2 + 2` vertices.
pub fn octasphere(centre: Vec3, radius: f64, n: usize) -> Mesh {
    let n = n.max(1) as i64;
    let mut positions = Vec::with_capacity((4 * n * n + 2) as usize);
    // Looked up only; its order reaches nothing.
    let mut index: HashMap<[i64; 3], u32> = HashMap::new();
    let mut triangles = Vec::with_capacity((8 * n * n) as usize);
    let mut vertex = |p: [i64; 3]| {
        *index.entry(p).or_insert_with(|| {
            let on = normalize(p.map(|c| c as f64));
            positions.push(add(centre, scale(on, radius)));
            (positions.len() - 1) as u32
        })
    };
    for octant in 0..8 {
        let sign = [0, 1, 2].map(|a| if octant >> a & 1 == 1 { -1 } else { 1 });
        let flip = sign[0] * sign[1] * sign[2] < 0;
        let at = |i: i64, j: i64| [sign[0] * i, sign[1] * j, sign[2] * (n - i - j)];
        for i in 0..n {
            for j in 0..n - i {
                let mut push = |mut t: [[i64; 3]; 3]| {
                    if flip {
                        t.swap(1, 2);
                    }
                    triangles.push(t.map(&mut vertex));
                };
                push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 1 < n {
                    push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
    Mesh::from_triangles(positions, triangles)
}

/// A torus around the z axis: a tube of radius `minor` whose middle is a circle of radius `major`;
/// `2 around sides` triangles.
pub fn torus(centre: Vec3, major: f64, minor: f64, around: usize, sides: usize) -> Mesh {
    tube(around, sides, |t| {
        let (sin, cos) = t.sin_cos();
        let out = [cos, sin, 0.0];
        (add(centre, scale(out, major)), out, [0.0, 0.0, 1.0], minor)
    })
}

/// A tube along the knot that winds `p` times around the z axis and `q` times around the circle in
/// between, on a torus of radii 2 and 1; the tube's radius is `radius`. 288 rings of 92 sides make
/// 52,992 triangles. `p` and `q` are coprime, or the tube runs over itself.
pub fn torus_knot(p: u32, q: u32, radius: f64, rings: usize, sides: usize) -> Mesh {
    let (p, q) = (f64::from(p), f64::from(q));
    tube(rings, sides, |t| {
        let ((sin, cos), (sin_q, cos_q)) = ((p * t).sin_cos(), (q * t).sin_cos());
        let ring = 2.0 + cos_q;
        let centre = [ring * cos, ring * sin, sin_q];
        // The torus' own normal: it stands on the curve everywhere and closes up with it.
        let normal = [cos_q * cos, cos_q * sin, sin_q];
        let tangent = [
            -q * sin_q * cos - p * ring * sin,
            -q * sin_q * sin + p * ring * cos,
            q * cos_q,
        ];
        let across = normalize(cross(normal, tangent));
        (centre, normal, across, radius)
    })
}

/// A closed tube: for each angle of its course the middle, two unit vectors across and the radius.
/// First across second points against the course.
fn tube(rings: usize, sides: usize, course: impl Fn(f64) -> (Vec3, Vec3, Vec3, f64)) -> Mesh {
    let (rings, sides) = (rings.max(3), sides.max(3));
    let mut positions = Vec::with_capacity(rings * sides);
    for i in 0..rings {
        let (centre, u, v, radius) = course(TAU * i as f64 / rings as f64);
        for j in 0..sides {
            let (sin, cos) = (TAU * j as f64 / sides as f64).sin_cos();
            let out = add(scale(u, radius * cos), scale(v, radius * sin));
            positions.push(add(centre, out));
        }
    }
    let at = |i: usize, j: usize| (i % rings * sides + j % sides) as u32;
    let mut triangles = Vec::with_capacity(2 * rings * sides);
    for i in 0..rings {
        for j in 0..sides {
            let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend(halves(quad));
        }
    }
    Mesh::from_triangles(positions, triangles)
}

/// A cylinder around the z axis with flat ends, its middle at `centre`; `4 sides` triangles.
pub fn cylinder(centre: Vec3, radius: f64, height: f64, sides: usize) -> Mesh {
    let sides = sides.max(3);
    let half = height * 0.5;
    let mut positions = vec![
        add(centre, [0.0, 0.0, -half]),
        add(centre, [0.0, 0.0, half]),
    ];
    for i in 0..sides {
        let (sin, cos) = (TAU * i as f64 / sides as f64).sin_cos();
        for z in [-half, half] {
            positions.push(add(centre, [radius * cos, radius * sin, z]));
        }
    }
    let at = |i: usize, end: usize| (2 + 2 * (i % sides) + end) as u32;
    let mut triangles = Vec::with_capacity(4 * sides);
    for i in 0..sides {
        let [a, b, c, d] = [at(i, 0), at(i + 1, 0), at(i + 1, 1), at(i, 1)];
        triangles.extend(halves([a, b, c, d]));
        triangles.extend([[0, b, a], [1, d, c]]);
    }
    Mesh::from_triangles(positions, triangles)
}

/// `n^3` separate spheres of a radius, `spacing` apart along each axis, around the origin; each has
/// `8 detail^2` triangles.
pub fn sphere_grid(n: usize, radius: f64, spacing: f64, detail: usize) -> Mesh {
    let middle = n.saturating_sub(1) as f64 * 0.5;
    let mut mesh = Mesh::default();
    for k in 0..n * n * n {
        let cell = [k % n, k / n % n, k / n / n];
        let centre = cell.map(|c| (c as f64 - middle) * spacing);
        mesh = joined(mesh, &octasphere(centre, radius, detail));
    }
    mesh
}

/// One mesh of the triangles of two, the second's after the first's; nothing is welded.
pub fn joined(mut first: Mesh, second: &Mesh) -> Mesh {
    let shift = first.positions.len() as u32;
    first.positions.extend_from_slice(&second.positions);
    let moved = second.triangles.iter().map(|t| t.map(|v| v + shift));
    first.triangles.extend(moved);
    first
}

fn halves([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

fn split(quads: &[[u32; 4]]) -> Vec<[u32; 3]> {
    quads.iter().copied().flat_map(halves).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::vector::{dot, length};
    use std::collections::BTreeMap;

    /// Sum of signed tetrahedra from the origin.
    fn volume(mesh: &Mesh) -> f64 {
        let six: f64 = (0..mesh.triangles.len())
            .map(|t| mesh.corners(t))
            .map(|[a, b, c]| dot(a, cross(b, c)))
            .sum();
        six / 6.0
    }

    /// How often each directed edge is met.
    fn edges(mesh: &Mesh) -> BTreeMap<(u32, u32), usize> {
        let mut edges = BTreeMap::new();
        for [a, b, c] in &mesh.triangles {
            for edge in [(*a, *b), (*b, *c), (*c, *a)] {
                *edges.entry(edge).or_default() += 1;
            }
        }
        edges
    }

    fn assert_closed(name: &str, mesh: &Mesh, euler: i64) {
        mesh.check().expect(name);
        let edges = edges(mesh);
        for ((a, b), n) in &edges {
            assert_eq!((*n, edges.get(&(*b, *a))), (1, Some(&1)), "{name}: {a} {b}");
        }
        let count = (mesh.positions.len() + mesh.triangles.len()) as i64;
        assert_eq!(count - edges.len() as i64 / 2, euler, "{name}");
    }

    #[test]
    fn closed_shapes_are_closed_with_the_right_volume() {
        let ball = 4.0 / 3.0 * PI;
        let c = [0.3, -0.2, 0.1];
        let shapes = [
            (
                "cuboid",
                cuboid([0.0, 0.0, 0.0], [2.0, 3.0, 4.0]),
                2,
                24.0,
                1e-15,
            ),
            ("plate", plate(5.0, 4.0, 1e-3), 2, 0.02, 1e-12),
            (
                "tetrahedron",
                tetrahedron(c, 1.0),
                2,
                8.0 / 9.0 / 3f64.sqrt(),
                1e-12,
            ),
            ("uv sphere", uv_sphere(c, 1.0, 96, 48), 2, ball, 5e-3),
            (
                "smallest uv sphere",
                uv_sphere([0.0; 3], 1.0, 0, 0),
                2,
                3f64.sqrt() / 2.0,
                1e-12,
            ),
            ("icosphere", icosphere(c, 1.0, 5), 2, ball, 2e-3),
            ("octasphere", octasphere(c, 1.0, 40), 2, ball, 2e-3),
            (
                "torus",
                torus(c, 1.0, 0.25, 128, 64),
                0,
                2.0 * PI * PI * 0.0625,
                5e-3,
            ),
            ("cylinder", cylinder(c, 0.5, 3.0, 200), 2, 0.75 * PI, 1e-3),
            (
                "sphere grid",
                sphere_grid(2, 0.4, 1.0, 20),
                16,
                8.0 * ball * 0.064,
                5e-3,
            ),
        ];
        for (name, mesh, euler, wanted, share) in shapes {
            assert_closed(name, &mesh, euler);
            let found = volume(&mesh);
            assert!(
                (found / wanted - 1.0).abs() < share,
                "{name}: {found} for {wanted}"
            );
        }
    }

    #[test]
    fn a_knot_has_the_volume_of_its_tube() {
        let mesh = torus_knot(2, 3, 0.4, 288, 92);
        assert_eq!(mesh.triangles.len(), 52_992);
        assert_closed("knot", &mesh, 0);
        let middle = |t: f64| {
            let ring = 2.0 + (3.0 * t).cos();
            [
                ring * (2.0 * t).cos(),
                ring * (2.0 * t).sin(),
                (3.0 * t).sin(),
            ]
        };
        let steps = 100_000;
        let at = |i: i32| middle(TAU * f64::from(i) / f64::from(steps));
        let course: f64 = (0..steps).map(|i| length(sub(at(i + 1), at(i)))).sum();
        // Pappus: a tube's volume is its section times the way of its middle.
        let wanted = PI * 0.16 * course;
        assert!(
            (volume(&mesh) / wanted - 1.0).abs() < 3e-3,
            "{}",
            volume(&mesh) / wanted
        );
    }

    #[test]
    fn spheres_have_the_stated_counts_and_radius() {
        let ico = icosphere([1.0, 2.0, 3.0], 0.5, 3);
        assert_eq!(
            (ico.triangles.len(), ico.positions.len()),
            (20 * 64, 10 * 64 + 2)
        );
        let octa = octasphere([1.0, 2.0, 3.0], 0.5, 112);
        assert_eq!(
            (octa.triangles.len(), octa.positions.len()),
            (100_352, 4 * 112 * 112 + 2)
        );
        for p in ico.positions.iter().chain(&octa.positions) {
            assert!((length(sub(*p, [1.0, 2.0, 3.0])) - 0.5).abs() < 1e-14);
        }
        assert_eq!(uv_sphere([0.0; 3], 1.0, 10, 5).triangles.len(), 80);
    }

    #[test]
    fn open_shapes_have_the_rim_they_should() {
        let rim = |mesh: &Mesh| {
            let edges = edges(mesh);
            edges
                .keys()
                .filter(|(a, b)| !edges.contains_key(&(*b, *a)))
                .count()
        };
        assert_eq!(rim(&open_box([0.0; 3], [1.0; 3])), 4);
        let sheet = sheet(2.0, 1.0, 6, 4);
        assert_eq!((sheet.triangles.len(), rim(&sheet)), (48, 20));
        let [a, b, c] = sheet.corners(0);
        assert!(cross(sub(b, a), sub(c, a))[2] > 0.0);
    }
}
