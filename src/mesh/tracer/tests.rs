use super::triangle::Difference;
use super::*;
use crate::mesh::shapes;
use crate::numeric::rng::Rng;
use crate::numeric::vector::{add, cross, dot, lerp, normalize, scale, sub};
use num_rational::BigRational;
use num_traits::Signed;
use std::cmp::Ordering;

const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
const AHEAD: [f64; 2] = [0.0, f64::INFINITY];

fn random_point(rng: &mut Rng, size: f64) -> Vec3 {
    std::array::from_fn(|_| rng.range(-size, size))
}

/// Every triangle tried in turn, without tree or packets.
fn closest_of_all(tracer: &Tracer, mesh: &Mesh, ray: &Ray) -> Option<Hit> {
    let aim = tracer.aim(ray)?;
    let mut best: Option<(Meeting, u32)> = None;
    for t in 0..mesh.triangles.len() {
        let corners = mesh.corners(t).map(|p| tracer.frame.to_local(p));
        if is_degenerate(corners) {
            continue;
        }
        if let Some(m) = aim.ray.meet(corners)
            && (aim.reach[0]..=aim.reach[1]).contains(&m.t)
            && best.is_none_or(|(b, _)| m.t < b.t)
        {
            best = Some((m, t as u32));
        }
    }
    best.map(|(m, t)| aim.hit(m, t))
}

/// Triangles of all sizes and shapes, some of them twice.
fn soup(count: usize) -> Mesh {
    let mut positions = Vec::new();
    for i in 0..count {
        let mut rng = Rng::new(11, (i - i % 10 / 9) as u64);
        let centre = random_point(&mut rng, 1.0);
        let size = 10f64.powf(rng.range(-4.0, 0.0));
        let mut t: [Vec3; 3] = std::array::from_fn(|_| add(centre, random_point(&mut rng, size)));
        if i % 3 == 0 {
            t[2] = lerp(
                lerp(t[0], t[1], 0.3),
                t[2],
                10f64.powf(rng.range(-12.0, 0.0)),
            );
        }
        positions.extend(t);
    }
    let triangles = (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    Mesh::from_triangles(positions, triangles.collect())
}

/// A ray for number `i`: from near or far, half of them at a corner, some along an axis.
fn random_ray(mesh: &Mesh, i: u64) -> Ray {
    let mut rng = Rng::new(5, i);
    let distance = [0.5, 2.0, 1e3, 1e9][rng.below(4)];
    let origin = random_point(&mut rng, distance);
    let vertex = mesh.positions[rng.below(mesh.positions.len())];
    let target = match i % 4 {
        0 | 1 => vertex,
        _ => random_point(&mut rng, 1.0),
    };
    let mut ray = Ray {
        origin,
        direction: scale(sub(target, origin), 10f64.powf(rng.range(-3.0, 3.0))),
        reach: if i.is_multiple_of(5) {
            EVERYWHERE
        } else {
            AHEAD
        },
    };
    if i.is_multiple_of(16) {
        let axis = rng.below(3);
        ray.direction = [0.0; 3];
        ray.direction[axis] = if i.is_multiple_of(32) { 1.0 } else { -1.0 };
        ray.origin = target;
        ray.origin[axis] = -4.0 * ray.direction[axis];
    }
    ray
}

fn assert_as_all(mesh: &Mesh, rays: u64) {
    let tracer = Tracer::new(mesh);
    let hits: usize = (0..rays)
        .into_par_iter()
        .map(|i| {
            let mut ray = random_ray(mesh, i);
            let found = tracer.closest(&ray);
            assert_eq!(
                found,
                closest_of_all(&tracer, mesh, &ray),
                "ray {i}: {ray:?}"
            );
            assert_eq!(tracer.any(&ray), found.is_some(), "ray {i}");
            let Some(hit) = found else { return 0 };
            // Reach includes its ends, and what is just closer is left out.
            ray.reach = [hit.t, hit.t];
            assert_eq!(tracer.closest(&ray), Some(hit), "ray {i}");
            assert!(tracer.any(&ray), "ray {i}");
            ray.reach = [hit.t.next_up(), f64::INFINITY];
            let next = tracer.closest(&ray);
            assert_eq!(tracer.any(&ray), next.is_some(), "ray {i}");
            assert_eq!(next, closest_of_all(&tracer, mesh, &ray), "ray {i}");
            1
        })
        .sum();
    assert!(hits as u64 > rays / 5, "{hits} hits");
}

#[test]
fn hits_are_those_of_trying_every_triangle() {
    assert_as_all(&shapes::torus_knot(2, 3, 0.15, 100, 8), 2000);
    assert_as_all(&shapes::octasphere([0.1, 0.2, 0.3], 1.0, 16), 2000);
    assert_as_all(&soup(700), 4000);
}

#[test]
#[ignore = "a minute"]
fn many_hits_are_those_of_trying_every_triangle() {
    assert_as_all(&shapes::torus_knot(2, 3, 0.15, 400, 12), 100_000);
    assert_as_all(&soup(5000), 100_000);
}

#[test]
fn hits_lie_on_the_ray_and_on_the_triangle() {
    let mesh = shapes::torus([0.0; 3], 1.0, 0.4, 40, 20);
    let tracer = Tracer::new(&mesh);
    for i in 0..1000 {
        let mut rng = Rng::new(6, i);
        let ray = Ray {
            origin: random_point(&mut rng, 3.0),
            direction: random_point(&mut rng, 1.0),
            reach: EVERYWHERE,
        };
        let Some(hit) = tracer.closest(&ray) else {
            continue;
        };
        let [a, b, c] = mesh.corners(hit.triangle as usize);
        let inside = add(a, add(scale(sub(b, a), hit.u), scale(sub(c, a), hit.v)));
        let gap = sub(add(ray.origin, scale(ray.direction, hit.t)), inside);
        assert!(dot(gap, gap).sqrt() < 1e-13, "ray {i}: {gap:?}");
        assert!(hit.u >= 0.0 && hit.v >= 0.0 && hit.u + hit.v <= 1.0 + 1e-15);
    }
}

/// Rays at corners and edges from both sides, which must not pass; returns how many were shot.
fn shoot_at_seams(mesh: &Mesh, height: f64, rays: u64) {
    let tracer = Tracer::new(mesh);
    let mut normals = vec![[0.0; 3]; mesh.positions.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        let normal = cross(sub(b, a), sub(c, a));
        corners
            .iter()
            .for_each(|v| normals[*v as usize] = add(normals[*v as usize], normal));
    }
    (0..rays).into_par_iter().for_each(|i| {
        let mut rng = Rng::new(8, i);
        let corners = mesh.triangles[rng.below(mesh.triangles.len())];
        let [a, b] = [0, 1].map(|k| corners[(rng.below(3) + k) % 3] as usize);
        let along = if i % 2 == 0 { 0.0 } else { rng.unit() };
        let target = lerp(mesh.positions[a], mesh.positions[b], along);
        let normal = normalize(lerp(normals[a], normals[b], along));
        let side = if i % 4 < 2 { 1.0 } else { -1.0 };
        let tilted = add(scale(normal, side), random_point(&mut rng, 0.4));
        let origin = add(target, scale(tilted, height * rng.range(0.01, 1.0)));
        let ray = Ray {
            origin,
            direction: sub(target, origin),
            reach: AHEAD,
        };
        let hit = tracer.closest(&ray);
        assert!(
            hit.is_some_and(|hit| hit.t <= 1.0 + 1e-9),
            "ray {i} passed between triangles: {hit:?} {ray:?}"
        );
    });
}

fn closed_meshes() -> [(Mesh, f64); 4] {
    [
        (shapes::icosphere([0.0; 3], 1.0, 4), 0.8),
        (shapes::octasphere([0.3, 0.1, -0.2], 1.0, 24), 0.8),
        (shapes::torus([5.0, 0.0, 0.0], 1.0, 0.3, 60, 40), 0.2),
        (shapes::torus_knot(2, 3, 0.15, 400, 30), 0.05),
    ]
}

#[test]
fn no_ray_passes_between_triangles() {
    for (mesh, height) in closed_meshes() {
        shoot_at_seams(&mesh, height, 20_000);
    }
}

#[test]
#[ignore = "ten million rays"]
fn no_ray_of_ten_million_passes_between_triangles() {
    for (mesh, height) in closed_meshes() {
        shoot_at_seams(&mesh, height, 2_500_000);
    }
}

#[test]
fn no_ray_along_the_axes_passes_between_the_triangles_of_a_grid() {
    let mesh = shapes::sheet(2.0, 2.0, 64, 64);
    let tracer = Tracer::new(&mesh);
    for i in 0..=256 {
        for j in 0..=256 {
            let at = |k: i32| f64::from(k) / 128.0 - 1.0;
            for z in [1.0, -1.0] {
                let ray = Ray {
                    origin: [at(i), at(j), z],
                    direction: [0.0, 0.0, -z],
                    reach: AHEAD,
                };
                assert_eq!(tracer.closest(&ray).map(|hit| hit.t), Some(1.0));
            }
        }
    }
}

/// A mesh and rays with coordinates that are multiples of 2^-20.
fn on_a_lattice() -> (Mesh, Vec<Ray>) {
    let step = f64::from(1 << 20);
    let round = |p: Vec3| p.map(|c| (c * step).round() / step);
    let mut mesh = shapes::torus_knot(2, 3, 0.15, 100, 10);
    mesh.positions.iter_mut().for_each(|p| *p = round(*p));
    let rays = (0..2000).map(|i| {
        let mut rng = Rng::new(9, i);
        let origin = round(random_point(&mut rng, 3.0));
        let target = round(scale(mesh.positions[rng.below(mesh.positions.len())], 1.01));
        Ray {
            origin,
            direction: sub(target, origin),
            reach: [0.0, 4.0],
        }
    });
    let rays = rays.collect();
    (mesh, rays)
}

#[test]
fn moved_and_scaled_models_are_hit_alike() {
    let (mesh, rays) = on_a_lattice();
    let tracer = Tracer::new(&mesh);
    let wanted: Vec<_> = rays.iter().map(|ray| tracer.closest(ray)).collect();
    assert!(wanted.iter().flatten().count() > 200);
    for (exponent, offset) in [
        (0, [4e9f64.round(), -3e9, 17.0]),
        (-100, [0.0; 3]),
        (100, [0.0; 3]),
        (-1000, [0.0; 3]),
        (1000, [0.0; 3]),
    ] {
        let placed = |p: Vec3| add(p, offset).map(|c| times_power_of_two(c, exponent));
        let mut other = mesh.clone();
        other.positions.iter_mut().for_each(|p| *p = placed(*p));
        let tracer = Tracer::new(&other);
        for (ray, wanted) in rays.iter().zip(&wanted) {
            let moved = Ray {
                origin: placed(ray.origin),
                direction: ray.direction.map(|c| times_power_of_two(c, exponent)),
                ..*ray
            };
            assert_eq!(tracer.closest(&moved), *wanted, "2^{exponent} {offset:?}");
            let stretched = Ray {
                direction: moved.direction.map(|c| c * 0.25),
                reach: [0.0, 16.0],
                ..moved
            };
            let wanted = wanted.map(|hit| Hit {
                t: hit.t * 4.0,
                ..hit
            });
            assert_eq!(tracer.closest(&stretched), wanted, "2^{exponent}");
        }
    }
}

#[test]
fn the_order_of_triangles_changes_only_indices() {
    let (mesh, rays) = on_a_lattice();
    let mut reversed = mesh.clone();
    reversed.triangles.reverse();
    let last = mesh.triangles.len() as u32 - 1;
    let (tracer, other) = (Tracer::new(&mesh), Tracer::new(&reversed));
    for ray in &rays {
        let (a, b) = (tracer.closest(ray), other.closest(ray));
        assert_eq!(a.map(|hit| hit.t), b.map(|hit| hit.t));
        if let (Some(a), Some(b)) = (a, b) {
            // Of triangles hit at one `t` each order has its own first.
            assert!(a.triangle <= last - b.triangle);
        }
    }
}

#[test]
fn of_equal_hits_the_first_triangle_is_named() {
    let mut mesh = shapes::cuboid([-1.0; 3], [1.0; 3]);
    let copies = mesh.triangles.repeat(9);
    mesh.triangles = copies;
    let tracer = Tracer::new(&mesh);
    for i in 0..500 {
        let mut rng = Rng::new(10, i);
        let ray = Ray {
            origin: random_point(&mut rng, 0.9),
            direction: random_point(&mut rng, 1.0),
            reach: AHEAD,
        };
        assert!(tracer.closest(&ray).expect("the box is closed").triangle < 12);
    }
}

#[test]
fn triangles_on_a_line_are_never_hit() {
    let (a, b) = ([0.1, 0.2, 0.3], [0.7, -0.4, 0.5]);
    let step = [0.375, -0.25, 0.125];
    let flat = [[a, b, b], [a, a, a], [a, b, a]];
    let flat = flat.into_iter().chain((1..20).map(|k| {
        let at = |n: i32| scale(step, f64::from(n));
        [at(0), at(k), at(3 * k + 1)]
    }));
    let positions: Vec<Vec3> = flat.flatten().collect();
    let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    let mesh = Mesh::from_triangles(positions, triangles.collect());
    let tracer = Tracer::new(&mesh);
    for i in 0..2000 {
        let mut rng = Rng::new(12, i);
        let origin = random_point(&mut rng, 2.0);
        let on_line = lerp([0.0; 3], scale(step, 20.0), rng.unit());
        let ray = Ray {
            origin,
            direction: sub(on_line, origin),
            reach: EVERYWHERE,
        };
        assert_eq!(tracer.closest(&ray), None, "ray {i}");
    }
}

#[test]
fn triangles_of_nearly_no_size_are_hit() {
    for exponent in [-40, -300, -1000] {
        let tiny = |p: Vec3| p.map(|c| times_power_of_two(c, exponent));
        let corners = [[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]].map(tiny);
        let far = [[1.0, 1.0, 1.0], [1.0, 2.0, 1.0], [2.0, 1.0, 1.0]];
        let positions = corners.into_iter().chain(far).collect();
        let mesh = Mesh::from_triangles(positions, vec![[0, 1, 2], [3, 4, 5]]);
        let ray = Ray {
            origin: [0.0, 0.0, 1.0],
            direction: [0.0, 0.0, -1.0],
            reach: AHEAD,
        };
        let hit = Tracer::new(&mesh).closest(&ray);
        assert_eq!(
            hit.map(|hit| (hit.triangle, hit.t)),
            Some((0, 1.0)),
            "2^{exponent}"
        );
    }
}

#[test]
fn rays_that_are_none_hit_nothing() {
    let tracer = Tracer::new(&shapes::cuboid([-1.0; 3], [1.0; 3]));
    let good = Ray {
        origin: [0.0; 3],
        direction: [0.0, 0.0, 1.0],
        reach: AHEAD,
    };
    assert!(tracer.any(&good));
    for (origin, direction, reach) in [
        ([0.0; 3], [0.0; 3], AHEAD),
        ([0.0; 3], [f64::NAN, 0.0, 1.0], AHEAD),
        ([0.0; 3], [f64::INFINITY, 0.0, 0.0], AHEAD),
        ([f64::NAN, 0.0, 0.0], [0.0, 0.0, 1.0], AHEAD),
        ([0.0; 3], [0.0, 0.0, 1.0], [0.0, f64::NAN]),
        ([0.0; 3], [0.0, 0.0, 1.0], [f64::NAN, 2.0]),
        ([0.0; 3], [0.0, 0.0, 1.0], [2.0, 0.0]),
        ([0.0; 3], [0.0, 0.0, 1.0], [0.0, 1f64.next_down()]),
    ] {
        let ray = Ray {
            origin,
            direction,
            reach,
        };
        assert_eq!(tracer.closest(&ray), None, "{ray:?}");
        assert!(!tracer.any(&ray), "{ray:?}");
    }
    let nothing = Tracer::new(&Mesh::default());
    assert_eq!(nothing.closest(&good), None);
    assert_eq!(nothing.bytes(), 0);
}

#[test]
fn vertices_of_no_triangle_have_no_influence() {
    let (mut mesh, rays) = on_a_lattice();
    let wanted: Vec<_> = {
        let tracer = Tracer::new(&mesh);
        rays.iter().map(|ray| tracer.closest(ray)).collect()
    };
    mesh.positions.push([1e300; 3]);
    let tracer = Tracer::new(&mesh);
    let found: Vec<_> = rays.iter().map(|ray| tracer.closest(ray)).collect();
    assert_eq!(found, wanted);
}

#[test]
fn the_layout_ignores_threads() {
    let mesh = shapes::torus([0.0; 3], 1.0, 0.3, 200, 100);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("threads can be started");
        let tracer = pool.install(|| Tracer::new(&mesh));
        (tracer.tree, tracer.packets, tracer.faces, tracer.corners)
    };
    assert!(on(1) == on(3));
}

#[test]
fn differences_of_products_have_the_exact_sign() {
    let exact = |a: f64, b: f64| {
        let big = |v| BigRational::from_float(v).expect("finite");
        big(a) * big(b)
    };
    let mut cancelled = 0;
    for i in 0..2000 {
        let mut rng = Rng::new(13, i);
        let [a, b, k] = [0; 3].map(|_| rng.range(-2.0, 2.0));
        let size = 2f64.powi(rng.below(1000) as i32 - 500);
        // Products that are equal up to the rounding of their factors.
        let p = [a * k * size, b];
        let mut q = [a * size, b * k];
        if i % 3 == 0 {
            q = [p[1], p[0]];
        }
        let difference = exact(p[0], p[1]) - exact(q[0], q[1]);
        let wanted = match (difference.is_positive(), difference.is_negative()) {
            (true, _) => Ordering::Greater,
            (_, true) => Ordering::Less,
            _ => Ordering::Equal,
        };
        cancelled += usize::from(p[0] * p[1] == q[0] * q[1]);
        let found = Difference::of_products(p, q).value;
        assert_eq!(found.total_cmp(&0.0), wanted, "{p:?} {q:?}");
    }
    assert!(cancelled > 900, "{cancelled}");
}
