use super::*;
use crate::numeric::rng::Rng;
use crate::numeric::vector::add;

/// Boxes of all sizes in the cube from -2 to 2, some of them empty, flat or repeated.
fn boxes(count: u32, seed: u64) -> Vec<Aabb> {
    let one = |i: u32| {
        let mut rng = Rng::new(seed, u64::from(i / 2 * 2 + u32::from(i.is_multiple_of(8))));
        let size = 10f64.powf(rng.range(-9.0, -0.5));
        let centre: Vec3 = std::array::from_fn(|_| rng.range(-1.6, 1.6));
        let half: Vec3 = std::array::from_fn(|_| size * rng.unit().max(0.1) - 0.1 * size);
        if i % 11 == 10 {
            return Aabb::EMPTY;
        }
        Aabb {
            lo: std::array::from_fn(|a| centre[a] - half[a]),
            hi: add(centre, half),
        }
    };
    (0..count).map(one).collect()
}

/// Whether the ray meets the box between 0 and `limit`, in `f64`.
fn meets(b: &Aabb, origin: Vec3, direction: Vec3, limit: f64) -> bool {
    let (mut start, mut end) = (0.0f64, limit);
    for a in 0..3 {
        if direction[a] == 0.0 {
            if origin[a] < b.lo[a] || origin[a] > b.hi[a] {
                return false;
            }
            continue;
        }
        let (s, e) = (
            (b.lo[a] - origin[a]) / direction[a],
            (b.hi[a] - origin[a]) / direction[a],
        );
        start = start.max(s.min(e));
        end = end.min(s.max(e));
    }
    start <= end
}

#[test]
fn trees_keep_what_they_promise() {
    for count in [0, 1, 3, 4, 5, 11, 100, 30_000] {
        let boxes = boxes(count, 1);
        let (tree, leaves) = WideBvh::build(count, |i| boxes[i as usize]);
        tree.check(&leaves, count, |i| boxes[i as usize])
            .unwrap_or_else(|fault| panic!("{count} items: {fault:?}"));
    }
}

#[test]
fn equal_boxes_are_shared_out() {
    let same = Aabb {
        lo: [0.25; 3],
        hi: [0.5; 3],
    };
    let (tree, leaves) = WideBvh::build(1000, |_| same);
    assert!(tree.check(&leaves, 1000, |_| same).is_ok());
    assert!(leaves.len() < 400, "{} leaves", leaves.len());
}

#[test]
fn the_tree_ignores_threads() {
    let boxes = boxes(100_000, 2);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads can be started")
            .install(|| WideBvh::build(boxes.len() as u32, |i| boxes[i as usize]))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn no_box_that_a_ray_meets_is_passed_by() {
    let boxes = boxes(3000, 3);
    let (tree, leaves) = WideBvh::build(3000, |i| boxes[i as usize]);
    let mut met = 0;
    for i in 0..2000 {
        let mut rng = Rng::new(4, i);
        let origin: Vec3 = std::array::from_fn(|_| rng.range(-2.0, 2.0));
        // Through a corner of a box, a point on the border of what is met; every third along axes.
        let target = boxes[rng.below(10) + 11 * rng.below(200)].lo;
        let mut direction: Vec3 = std::array::from_fn(|a| target[a] - origin[a]);
        if i % 3 == 0 {
            direction[i as usize / 3 % 3] *= 10f64.powf(rng.range(-60.0, 0.0));
        }
        let size = direction.iter().fold(0.0, |s: f64, d| s.max(d.abs()));
        direction = direction.map(|d| d / size);
        let limit = rng.range(0.5, 4.0);
        let mut found = vec![false; 3000];
        let end = tree.walk(
            &Slabs::new(origin, direction, 0.0),
            (limit as f32).next_up(),
            |leaf, limit| {
                let items = leaves[leaf].iter().filter(|item| **item != NONE);
                items.for_each(|item| found[*item as usize] = true);
                ControlFlow::Continue(limit)
            },
        );
        assert!(end.is_continue());
        for (item, b) in boxes.iter().enumerate().filter(|(_, b)| !b.is_empty()) {
            if meets(b, origin, direction, limit) {
                met += 1;
                assert!(found[item], "ray {i} passed item {item} by");
            }
        }
    }
    assert!(met > 1000, "{met}");
}

#[test]
fn a_walk_breaks_off() {
    let boxes = boxes(1000, 5);
    let (tree, _) = WideBvh::build(1000, |i| boxes[i as usize]);
    let mut visits = 0;
    let ray = Slabs::new([-2.0; 3], [1.0; 3], 0.0);
    let end = tree.walk(&ray, 8.0, |_, _| {
        visits += 1;
        ControlFlow::Break(())
    });
    assert!(end.is_break());
    assert_eq!(visits, 1);
}
