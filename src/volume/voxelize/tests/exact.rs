//! The three rules against integers of any size, on triangles made to break rounding.
//!
//! The oracle shares nothing with the kernel: it clips the triangle to slabs (Sutherland and
//! Hodgman 1974) in homogeneous integer coordinates, where the kernel asks for orientations.

use super::super::lines::{columns, crossings};
use super::super::overlap::{overlap, touches};
use super::super::span::Span;
use super::super::triangle::{Clip, Triangle};
use crate::numeric::rng::Rng;
use num_bigint::{BigInt, Sign};
use num_traits::{One, Zero};
use proptest::prelude::*;
use std::collections::BTreeSet;

/// A point `(x, y, z) / w` with `w > 0`.
type Point = [BigInt; 4];
type Voxels = BTreeSet<[i32; 3]>;

/// Coordinates are whole multiples of 2^-160, or 0: those below 2^-100 do not reach the kernel.
const SCALE: i32 = 160;

fn scaled(value: f64) -> BigInt {
    let bits = value.to_bits();
    let (mantissa, exponent) = (bits & ((1 << 52) - 1), (bits >> 52 & 0x7ff) as i32);
    if exponent == 0 {
        assert_eq!(mantissa, 0, "{value} is too small to be a grid coordinate");
        return BigInt::zero();
    }
    let shift = exponent - 1075 + SCALE;
    assert!(shift >= 0, "{value} is too small to be a grid coordinate");
    let size = BigInt::from(mantissa | 1 << 52) << shift;
    if value < 0.0 { -size } else { size }
}

fn polygon(q: &Triangle) -> Vec<Point> {
    let point = |p: &[f64; 3]| {
        [
            scaled(p[0]),
            scaled(p[1]),
            scaled(p[2]),
            BigInt::one() << SCALE,
        ]
    };
    q.iter().map(point).collect()
}

/// The part of a convex polygon, be it a segment or a point, whose coordinate is in the closed
/// `[low, high]`, given in halves.
fn slab(polygon: &[Point], axis: usize, low: i32, high: i32) -> Vec<Point> {
    let mut part = polygon.to_vec();
    for (sign, bound) in [(1, low), (-1, high)] {
        let beyond = |p: &Point| -> BigInt { (2 * &p[axis] - bound * &p[3]) * sign };
        let mut kept = Vec::new();
        for (i, p) in part.iter().enumerate() {
            let q = &part[(i + 1) % part.len()];
            let (at_p, at_q) = (beyond(p), beyond(q));
            if at_p.sign() != Sign::Minus {
                kept.push(p.clone());
            }
            if at_p.sign() != at_q.sign() && !at_p.is_zero() && !at_q.is_zero() {
                // Both weights are positive, so the new w is.
                let (of_q, of_p) = (
                    BigInt::from(at_p.magnitude().clone()),
                    BigInt::from(at_q.magnitude().clone()),
                );
                kept.push(std::array::from_fn(|a| &p[a] * &of_p + &q[a] * &of_q));
            }
        }
        part = kept;
    }
    part
}

/// The voxels whose closed cubes of this edge the closed triangle meets.
fn boxes(q: &Triangle, dims: [usize; 3], edge: i32) -> Voxels {
    let [nx, ny, nz] = dims.map(|d| d as i32 / edge);
    let mut found = Voxels::new();
    let whole = polygon(q);
    for z in 0..nz {
        let layer = slab(&whole, 2, 2 * z * edge, 2 * (z + 1) * edge);
        for y in 0..ny {
            let row = slab(&layer, 1, 2 * y * edge, 2 * (y + 1) * edge);
            // The row is convex, so it meets all cubes between its ends.
            found.extend((0..nx).map(|x| [x, y, z]).filter(|[x, ..]| {
                row.iter().any(|p| p[0] <= (x + 1) * edge * &p[3])
                    && row.iter().any(|p| p[0] >= x * edge * &p[3])
            }));
        }
    }
    found
}

/// The voxels in which the closed triangle, unless seen edge on, meets the line through the centres
/// along `axis`.
fn line_hits(q: &Triangle, axis: usize, dims: [usize; 3]) -> Voxels {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let whole = polygon(q);
    let area = {
        let d = |i: usize, a: usize| &whole[i][a] - &whole[0][a];
        d(1, u) * d(2, v) - d(1, v) * d(2, u)
    };
    let mut found = Voxels::new();
    if area.is_zero() {
        return found;
    }
    for j in 0..dims[v] as i32 {
        let sheet = slab(&whole, v, 2 * j + 1, 2 * j + 1);
        for i in 0..dims[u] as i32 {
            let Some(p) = slab(&sheet, u, 2 * i + 1, 2 * i + 1).pop() else {
                continue;
            };
            let last = dims[axis] as i32 - 1;
            let holds = |k: &i32| {
                p[axis] >= k * &p[3]
                    && (p[axis] < (k + 1) * &p[3] || *k == last && p[axis] == (k + 1) * &p[3])
            };
            if let Some(k) = (0..=last).find(holds) {
                let mut voxel = [0; 3];
                (voxel[u], voxel[v], voxel[axis]) = (i, j, k);
                found.insert(voxel);
            }
        }
    }
    found
}

/// Where lines along x, moved aside by numbers too small to matter elsewhere, cross the triangle:
/// `(first voxel whose centre is not before, y, z, turn)`, x within `0..=nx`.
fn perturbed(q: &Triangle, dims: [usize; 3]) -> Vec<(i32, i32, i32, i32)> {
    // An area that is not 0 is at least 2^-320; the shift along y moves it by less than 2^-1000, and
    // if at all by more than 2^-1320; that along z by less than 2^-2200.
    const ALONG_Y: i32 = 1160;
    const UNITS: i32 = 2 * ALONG_Y + 100;
    let up = |c: f64| scaled(c) << (UNITS - SCALE);
    let p: [[BigInt; 3]; 3] = q.map(|c| c.map(up));
    let centre = |i: i32, tiny: i32| {
        (BigInt::from(2 * i + 1) << (UNITS - 1)) + (BigInt::one() << (UNITS - tiny))
    };
    let turn = |a: [&BigInt; 2], b: [&BigInt; 2], c: [&BigInt; 2]| {
        ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).sign()
    };
    let yz = |i: usize| [&p[i][1], &p[i][2]];
    let facing = turn(yz(0), yz(1), yz(2));
    if facing == Sign::NoSign {
        return Vec::new();
    }
    let whole = polygon(q);
    let mut found = Vec::new();
    for k in 0..dims[2] as i32 {
        for j in 0..dims[1] as i32 {
            let (y, z) = (centre(j, ALONG_Y), centre(k, 2 * ALONG_Y));
            if (0..3).any(|i| turn(yz(i), yz((i + 1) % 3), [&y, &z]) != facing) {
                continue;
            }
            let line = slab(
                &slab(&whole, 1, 2 * j + 1, 2 * j + 1),
                2,
                2 * k + 1,
                2 * k + 1,
            );
            let [x, _, _, w] = &line[0];
            let nx = dims[0] as i32;
            let first = (0..nx).find(|i| (2 * i + 1) * w >= 2 * x).unwrap_or(nx);
            found.push((first, j, k, if facing == Sign::Plus { 1 } else { -1 }));
        }
    }
    found
}

fn collect(f: impl FnOnce(&mut dyn FnMut([i32; 3]))) -> Voxels {
    let mut found = Voxels::new();
    f(&mut |voxel| {
        found.insert(voxel);
    });
    found
}

/// The wanted voxels within a clip.
fn within(all: &Voxels, clip: &Clip) -> Voxels {
    let held = |v: &&[i32; 3]| (0..3).all(|a| clip.lo()[a] <= v[a] && v[a] <= clip.hi()[a]);
    all.iter().filter(held).copied().collect()
}

const DIMS: [usize; 3] = [6, 8, 7];

fn check(name: &str, q: &Triangle) -> usize {
    let clips = [
        Clip::grid(DIMS),
        Clip::new([1, 2, 3], [4, 2, 5]),
        Clip::new([3, 0, 4], [5, 7, 6]),
    ];
    let met = boxes(q, DIMS, 1);
    let mut rows: Vec<Span> = Vec::new();
    let lanes = q.map(|[x, y, z]| wide::f64x4::new([x, y, z, 0.0]));
    for clip in &clips {
        let found = collect(|set| {
            overlap(&lanes, clip, &mut rows, &mut |x0, x1, y, z| {
                (x0..=x1).for_each(|x| set([x, y, z]))
            });
        });
        assert_eq!(found, within(&met, clip), "{name}: overlap {q:?} {clip:?}");
    }
    let by_touch = super::voxels(DIMS)
        .map(|v| v.map(|c| c as i32))
        .filter(|v| touches(q, *v, 1))
        .collect::<Voxels>();
    assert_eq!(by_touch, met, "{name}: touches {q:?}");
    for axis in 0..3 {
        let hit = line_hits(q, axis, DIMS);
        for clip in &clips {
            let found = collect(|set| columns(q, axis, DIMS, clip, &mut |v| set(v)));
            assert_eq!(
                found,
                within(&hit, clip),
                "{name}: columns along {axis} {q:?} {clip:?}"
            );
        }
        assert!(hit.is_subset(&met), "{name}: the oracle contradicts itself");
    }
    let mut crossed = Vec::new();
    crossings(q, &clips[0], &mut |x, y, z, turn| {
        crossed.push((x.clamp(0, DIMS[0] as i32), y, z, turn))
    });
    crossed.sort_by_key(|c| (c.2, c.1));
    assert_eq!(crossed, perturbed(q, DIMS), "{name}: crossings {q:?}");
    met.len()
}

/// A point around the grid whose coordinates are multiples of `step`.
fn on_lattice(rng: &mut Rng, step: f64) -> [f64; 3] {
    DIMS.map(|d| (rng.range(-2.0, d as f64 + 2.0) / step).round() * step)
}

fn anywhere(rng: &mut Rng) -> [f64; 3] {
    DIMS.map(|d| rng.range(-2.0, d as f64 + 2.0))
}

/// A step of one unit in the last place to either side, or none.
fn beside(rng: &mut Rng, p: [f64; 3]) -> [f64; 3] {
    p.map(|c| match rng.below(3) {
        // The neighbours of 0 are below what reaches the kernel.
        0 if c != 0.0 => c.next_up(),
        1 if c != 0.0 => c.next_down(),
        _ => c,
    })
}

fn towards(p: [f64; 3], q: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|a| {
        let c = p[a] + (q[a] - p[a]) * t;
        if c.abs() < 1e-30 { 0.0 } else { c }
    })
}

fn large(rng: &mut Rng, size: f64) -> Triangle {
    let far = |rng: &mut Rng| -> [f64; 3] {
        [0; 3].map(|_| (rng.range(-size, size) * 4.0).round() / 4.0)
    };
    let through = on_lattice(rng, 0.5);
    let (a, b) = (far(rng), far(rng));
    // The third corner is such that the triangle runs by the grid.
    let s = rng.range(0.2, 0.8);
    let c = std::array::from_fn(|i| (through[i] - s * a[i] - (0.9 - s) * b[i]) / 0.1);
    [a, b, c]
}

#[test]
fn random_and_lattice_triangles_set_what_rational_arithmetic_says() {
    let mut met = 0;
    for index in 0..40 {
        let rng = &mut Rng::new(1, index);
        met += check("random", &[0; 3].map(|_| anywhere(rng)));
        for step in [1.0, 0.5, 0.25] {
            met += check("lattice", &[0; 3].map(|_| on_lattice(rng, step)));
            let q = [0; 3].map(|_| on_lattice(rng, step));
            met += check("beside the lattice", &q.map(|p| beside(rng, p)));
        }
    }
    assert!(met > 5_000, "{met}");
}

#[test]
fn flat_and_degenerate_triangles_set_what_rational_arithmetic_says() {
    for index in 0..40 {
        let rng = &mut Rng::new(2, index);
        let step = [1.0, 0.5, 0.25, 0.01][rng.below(4)];
        let mut q = [0; 3].map(|_| on_lattice(rng, step));
        let axis = rng.below(3);
        let level = q[0][axis];
        q.iter_mut().for_each(|p| p[axis] = level);
        check("in a coordinate plane", &q);
        let [a, b, _] = [0; 3].map(|_| on_lattice(rng, step));
        // Exact on a lattice of powers of two, an ulp or so off elsewhere.
        let t = [0.0, 0.25, 0.5, 2.0, 0.3][rng.below(5)];
        let c = towards(a, b, t);
        for q in [[a, b, c], [a, a, b], [b, b, b], [a, c, b]] {
            check("degenerate", &q);
        }
        let a = anywhere(rng);
        let b = anywhere(rng);
        let c = towards(a, b, rng.unit());
        check("sliver", &[a, b, beside(rng, c)]);
        check("sliver", &[beside(rng, c), a, b]);
    }
}

#[test]
fn triangles_larger_than_the_grid_set_what_rational_arithmetic_says() {
    let mut met = 0;
    for index in 0..25 {
        let rng = &mut Rng::new(3, index);
        for size in [1e3, 1e6, 1e9, 1e12, 1e15] {
            let q = large(rng, size);
            met += check("large", &q);
            met += check("large", &q.map(|p| p.map(|c| (c * 4.0).round() / 4.0)));
        }
        // Large along one axis only, and at negative coordinates for the most part.
        let mut q = [0; 3].map(|_| on_lattice(rng, 0.5));
        let axis = rng.below(3);
        q[0][axis] -= 1e7;
        q[1][axis] -= 1e12;
        met += check("long", &q);
    }
    assert!(met > 1_000, "{met}");
}

#[test]
fn triangles_smaller_than_a_voxel_set_what_rational_arithmetic_says() {
    for index in 0..60 {
        let rng = &mut Rng::new(4, index);
        let step = [0.5, 1.0][rng.below(2)];
        let base = on_lattice(rng, step);
        for size in [1e-9, 1e-3, 0.4] {
            let q = [0; 3].map(|_| base.map(|c| c + rng.range(-size, size)));
            check("tiny", &q);
        }
        let near = [0; 3].map(|_| beside(rng, base));
        check("ulps", &near);
        let one_way = [0, 1, 2].map(|i| {
            let mut p = base;
            p[i] += 0.3;
            beside(rng, p)
        });
        check("ulps", &one_way);
    }
}

#[test]
fn a_cube_of_voxels_is_touched_when_one_of_its_voxels_is() {
    let dims = [8; 3];
    for index in 0..60 {
        let rng = &mut Rng::new(5, index);
        let step = [0.25, 1.0][rng.below(2)];
        let q = [0; 3].map(|_| on_lattice(rng, step));
        for edge in [2, 4, 8] {
            let wanted = boxes(&q, dims, edge);
            let found = super::voxels(dims.map(|d| d / edge as usize))
                .map(|v| v.map(|c| c as i32))
                .filter(|v| touches(&q, v.map(|c| c * edge), edge))
                .collect::<Voxels>();
            assert_eq!(found, wanted, "edge {edge}: {q:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    /// Small whole numbers of quarters, so that a failure shrinks to a triangle one can draw.
    #[test]
    fn any_triangle_on_quarters_sets_what_rational_arithmetic_says(
        corners in prop::array::uniform3(prop::array::uniform3(-8..40i32)),
        ulps in prop::array::uniform3(-1..=1i32),
    ) {
        let mut q = corners.map(|p| p.map(|c| f64::from(c) / 4.0));
        for (p, ulp) in q.iter_mut().zip(ulps) {
            if p[0] != 0.0 {
                p[0] = match ulp { 1 => p[0].next_up(), -1 => p[0].next_down(), _ => p[0] };
            }
        }
        check("quarters", &q);
    }
}
