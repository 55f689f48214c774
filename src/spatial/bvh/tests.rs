use super::*;
use crate::numeric::rng::Rng;
use proptest::prelude::*;

fn boxes(seed: u64, count: u64, size: f64) -> Vec<Aabb> {
    (0..count)
        .map(|i| {
            let mut rng = Rng::new(seed, i);
            let lo: Vec3 = std::array::from_fn(|_| rng.unit() * size);
            let hi = lo.map(|c| c + rng.unit() * 0.05 * size);
            Aabb { lo, hi }
        })
        .collect()
}

fn tree(boxes: &[Aabb]) -> Bvh {
    Bvh::build(boxes.len() as u32, |i| boxes[i as usize])
}

fn brute(boxes: &[Aabb], p: Vec3) -> Option<Nearest> {
    let of = |(i, b): (usize, &Aabb)| (b.distance_squared(p), i as u32);
    let best = boxes.iter().enumerate().map(of);
    best.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
        .map(|(distance_squared, item)| Nearest {
            item,
            distance_squared,
        })
}

proptest! {
    #[test]
    fn searches_agree_with_brute_force(seed in 0u64..1000, count in 0u64..300, grid in any::<bool>()) {
        let mut boxes = boxes(seed, count, 1.0);
        if grid {
            // Many equal distances and equal boxes.
            for b in &mut boxes {
                b.lo = b.lo.map(|c| (c * 4.0).floor());
                b.hi = b.lo;
            }
        }
        let bvh = tree(&boxes);
        prop_assert_eq!(bvh.check(|i| boxes[i as usize]), Ok(()));
        for q in 0..20 {
            let mut rng = Rng::new(seed ^ 77, q);
            let p: Vec3 = std::array::from_fn(|_| rng.range(-0.5, 1.5) * if grid { 4.0 } else { 1.0 });
            let p = if grid { p.map(f64::round) } else { p };
            let found = bvh.nearest(p, f64::INFINITY, |i| boxes[i as usize].distance_squared(p));
            prop_assert_eq!(found, brute(&boxes, p));
            let query = Aabb { lo: p, hi: p.map(|c| c + 0.2) };
            let meets = |b: &Aabb| (0..3).all(|a| b.lo[a] <= query.hi[a] && b.hi[a] >= query.lo[a]);
            let mut hit: Vec<u32> = Vec::new();
            let _ = bvh.visit_overlapping(&query, |i| {
                if meets(&boxes[i as usize]) { hit.push(i) }
                ControlFlow::<()>::Continue(())
            });
            hit.sort_unstable();
            let all: Vec<u32> = (0..count as u32).filter(|i| meets(&boxes[*i as usize])).collect();
            prop_assert_eq!(bvh.any_overlapping(&query, |i| meets(&boxes[i as usize])), !all.is_empty());
            prop_assert_eq!(hit, all);
        }
    }
}

#[test]
fn an_upper_bound_is_inclusive_and_hides_what_is_farther() {
    let boxes = boxes(5, 100, 1.0);
    let bvh = tree(&boxes);
    let p = [3.0; 3];
    let of = |i: u32| boxes[i as usize].distance_squared(p);
    let best = bvh.nearest(p, f64::INFINITY, of).expect("there are items");
    assert_eq!(bvh.nearest(p, best.distance_squared, of), Some(best));
    assert_eq!(bvh.nearest(p, best.distance_squared.next_down(), of), None);
    assert_eq!(tree(&[]).nearest(p, f64::INFINITY, |_| 0.0), None);
}

#[test]
fn threads_do_not_change_the_tree() {
    let boxes = boxes(9, 100_000, 1.0);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| tree(&boxes))
    };
    let one = on(1);
    assert_eq!(one.check(|i| boxes[i as usize]), Ok(()));
    assert!(one == on(7));
}

#[test]
fn trees_stand_at_the_ends_of_the_numbers() {
    for size in [5e-324, 1e-300, 1e-160, 1e160, 1e300] {
        let boxes = boxes(3, 2000, size);
        assert_eq!(
            tree(&boxes).check(|i| boxes[i as usize]),
            Ok(()),
            "{size:e}"
        );
    }
    let same = vec![
        Aabb {
            lo: [1.0; 3],
            hi: [2.0; 3]
        };
        1000
    ];
    assert_eq!(tree(&same).check(|i| same[i as usize]), Ok(()));
    // Each split by area takes off one item: the limit of depth has to step in.
    let steps: Vec<Aabb> = (0..900)
        .map(|i| {
            Aabb::around(&[[
                crate::spatial::local::times_power_of_two(1.0, i - 450),
                0.0,
                0.0,
            ]])
        })
        .collect();
    assert_eq!(tree(&steps).check(|i| steps[i as usize]), Ok(()));
    let near = tree(&steps).nearest([0.0; 3], f64::INFINITY, |i| {
        steps[i as usize].distance_squared([0.0; 3])
    });
    assert_eq!(near.map(|n| n.item), Some(0));
}
