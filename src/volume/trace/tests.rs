//! All methods agree with the rule, to the bit.

use super::*;
use crate::numeric::rng::Rng;
use crate::volume::bits::BitGrid;
use crate::volume::octree::{Octree, RayTree};

/// A grid with about `share` of its voxels set, and one cube of 16^3 that is all set.
fn grid(dims: [usize; 3], share: f64, seed: u64) -> BitGrid {
    let mut grid = BitGrid::new(dims);
    let mut rng = Rng::new(seed, 0);
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                if rng.unit() < share || [x, y, z].iter().all(|c| (16..32).contains(c)) {
                    grid.set(x, y, z);
                }
            }
        }
    }
    grid
}

fn set_voxels(grid: &BitGrid) -> Vec<[usize; 3]> {
    let [nx, ny, nz] = grid.dims();
    let all = (0..nx * ny * nz).map(|i| [i % nx, i / nx % ny, i / nx / ny]);
    all.filter(|[x, y, z]| grid.get(*x, *y, *z)).collect()
}

/// A ray of one of several kinds: any, along an axis, in planes between voxels, along edges, through
/// corners, from inside, from far away.
fn ray(dims: [usize; 3], seed: u64, index: u64) -> GridRay {
    let mut rng = Rng::new(seed, index);
    let kind = index % 8;
    let mut origin = dims.map(|n| rng.range(-0.6, 1.6) * n as f64);
    let target = dims.map(|n| rng.range(0.0, 1.0) * n as f64);
    let whole = |p: Vec3| p.map(f64::round);
    let mut direction: Vec3 = std::array::from_fn(|a| target[a] - origin[a]);
    let axis = rng.below(3);
    match kind {
        1 | 2 => {
            // Along an axis: somewhere, or along edges.
            origin = if kind == 2 { whole(target) } else { target };
            origin[axis] = rng.range(-0.2, 1.2) * dims[axis] as f64;
            direction = [0.0; 3];
            direction[axis] = rng.range(-100.0, 100.0);
        }
        3 => {
            // In a plane between voxels.
            origin[axis] = target[axis].round();
            direction[axis] = 0.0;
        }
        4 => {
            // Along a diagonal through corners.
            origin = whole(target);
            direction = [0, 1, 2].map(|_| if rng.unit() < 0.5 { -3.0 } else { 3.0 });
        }
        5 => {
            // Through a corner, at an angle.
            let corner = whole(target);
            direction = std::array::from_fn(|a| corner[a] - origin[a]);
        }
        6 => origin = dims.map(|n| rng.range(0.2, 0.8) * n as f64),
        7 => {
            let way = rng.range(1.0, 1e6);
            origin = std::array::from_fn(|a| target[a] - way * direction[a]);
        }
        _ => {}
    }
    let reach = match rng.below(3) {
        0 => [0.0, 1.0],
        1 => [f64::NEG_INFINITY, f64::INFINITY],
        _ => [0.0, rng.range(0.0, 3.0)],
    };
    GridRay::new(origin, direction, reach)
}

/// Casts rays by all methods; returns how many hit, and the nodes visited with and without mask.
fn agree(dims: [usize; 3], share: f64, rays: u64) -> (u64, [u64; 2]) {
    let grid = grid(dims, share, rays);
    let voxels = set_voxels(&grid);
    let tree = Octree::from_bits(&grid);
    let rays_of = RayTree::new(&tree);
    let mut hits = 0;
    let mut nodes = [0; 2];
    for index in 0..rays {
        let ray = ray(dims, 7, index);
        let wanted = voxels.iter().any(|voxel| ray.hits(*voxel));
        let (mut with, mut without, mut plain) =
            (Visits::default(), Visits::default(), Visits::default());
        let masked = rays_of.any_hit(&ray, true, &mut with);
        let unmasked = rays_of.any_hit(&ray, false, &mut without);
        let walked = any_set(dims, &ray, |x, y, z| grid.get(x, y, z), &mut plain);
        assert_eq!(
            (masked, unmasked, walked),
            (wanted, wanted, wanted),
            "ray {index} of {dims:?}: {ray:?}"
        );
        assert!(with.nodes <= without.nodes && with.voxels <= without.voxels);
        hits += u64::from(wanted);
        nodes[0] += with.nodes;
        nodes[1] += without.nodes;
    }
    (hits, nodes)
}

#[test]
fn octree_and_walk_agree_with_the_rule_on_every_ray() {
    for (dims, share) in [
        ([33, 40, 37], 0.002),
        ([70, 12, 90], 0.005),
        ([1, 1, 1], 0.5),
        ([5, 70, 3], 0.02),
    ] {
        let (hits, nodes) = agree(dims, share, 6000);
        assert!(hits > 200 || dims == [1; 3], "{dims:?}: {hits} hits");
        assert!(hits < 5800, "{dims:?}: {hits} hits");
        assert!(nodes[0] <= nodes[1]);
    }
}

#[test]
#[ignore = "a million rays by brute force take a minute without optimization"]
fn a_million_rays_agree() {
    let (hits, nodes) = agree([129, 70, 100], 0.001, 1_000_000);
    assert!(hits > 100_000 && nodes[0] < nodes[1], "{hits} {nodes:?}");
}

#[test]
fn a_ray_along_an_edge_meets_all_four_voxels_around_it() {
    let ray = GridRay::new([5.0, 5.0, -3.0], [0.0, 0.0, 1.0], [0.0, 20.0]);
    for [x, y] in [[4, 4], [4, 5], [5, 4], [5, 5]] {
        let mut grid = BitGrid::new([10; 3]);
        grid.set(x, y, 7);
        let tree = Octree::from_bits(&grid);
        let mut visits = Visits::default();
        assert!(
            RayTree::new(&tree).any_hit(&ray, true, &mut visits),
            "{x} {y}"
        );
        let set = |x, y, z| grid.get(x, y, z);
        assert!(any_set([10; 3], &ray, set, &mut visits), "{x} {y}");
    }
    assert!(!ray.hits([3, 5, 7]) && !ray.hits([6, 4, 7]));
}

#[test]
fn a_ray_that_ends_before_a_voxel_does_not_hit_it() {
    let mut grid = BitGrid::new([8; 3]);
    grid.set(6, 2, 2);
    let tree = Octree::from_bits(&grid);
    for (end, wanted) in [(5.4, false), (5.5, true), (6.0, true)] {
        let ray = GridRay::new([0.5, 2.5, 2.5], [1.0, 0.0, 0.0], [0.0, end]);
        let mut visits = Visits::default();
        assert_eq!(RayTree::new(&tree).any_hit(&ray, true, &mut visits), wanted);
        let set = |x, y, z| grid.get(x, y, z);
        assert_eq!(any_set([8; 3], &ray, set, &mut visits), wanted);
        assert_eq!(ray.hits([6, 2, 2]), wanted);
    }
}

#[test]
fn rays_of_no_length_or_no_number_end() {
    let mut grid = BitGrid::new([8; 3]);
    grid.set(2, 2, 2);
    let tree = Octree::from_bits(&grid);
    for (direction, origin, wanted) in [
        ([0.0; 3], [2.5; 3], true),
        ([0.0; 3], [3.5; 3], false),
        ([1e-310, 0.0, 0.0], [2.5; 3], true),
        ([f64::NAN, 1.0, 0.0], [9.5; 3], false),
    ] {
        let ray = GridRay::new(origin, direction, [0.0, 1.0]);
        let mut visits = Visits::default();
        assert_eq!(RayTree::new(&tree).any_hit(&ray, true, &mut visits), wanted);
        let set = |x, y, z| grid.get(x, y, z);
        assert_eq!(any_set([8; 3], &ray, set, &mut visits), wanted);
    }
}

#[test]
fn an_empty_grid_and_a_full_one_answer() {
    let ray = GridRay::new([-1.0, 3.2, 3.3], [1.0, 0.1, 0.2], [0.0, 9.0]);
    let mut visits = Visits::default();
    let empty = Octree::from_bits(&BitGrid::new([64; 3]));
    assert!(!RayTree::new(&empty).any_hit(&ray, true, &mut visits));
    let mut all = BitGrid::new([64; 3]);
    all.words_mut().fill(u64::MAX);
    let full = Octree::from_bits(&all);
    assert!(RayTree::new(&full).any_hit(&ray, true, &mut visits));
    assert_eq!(visits.voxels, 0);
}
