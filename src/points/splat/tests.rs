use super::*;
use crate::numeric::rng::Rng;
use crate::numeric::vector::{Vec3, cross, dot, length, sub};
use crate::points::test_clouds::{bare, both, placed, shaken, shuffled, slab, sphere, square};
use crate::progress::Silent;

fn made(cloud: &Mesh, params: &Params) -> (Splats, Stats) {
    generate(cloud, params, &Silent).expect("discs")
}

/// No radius is too large: spheres of the paper have discs of over half their radius.
fn within(delta: f64) -> Params {
    Params {
        delta: Length::Absolute(delta),
        max_radius: Length::Absolute(10.0),
        ..Params::DEFAULT
    }
}

/// Every point lies in a disc, within its error and within the bound of its plane.
fn assert_covered(cloud: &Mesh, splats: &Splats, delta: f64) {
    for (i, p) in cloud.positions.iter().enumerate() {
        let covers = splats.splats.iter().any(|s| {
            let d = sub(*p, s.centre);
            let h = dot(d, s.normal).abs();
            let r = (dot(d, d) - h * h).max(0.0).sqrt();
            r <= s.radius * (1.0 + 1e-9) && h <= delta.min(s.error) * (1.0 + 1e-9) + 1e-15
        });
        assert!(covers, "point {i} at {p:?}");
    }
}

#[test]
fn the_sphere_of_the_paper_has_as_many_discs() {
    let cloud = sphere(113_682, 1);
    let counted = |params: Params, wanted: f64| {
        let (splats, stats) = made(&cloud, &params);
        let count = splats.splats.len() as f64;
        assert!((count / wanted - 1.0).abs() <= 0.05, "{params:?} {count}");
        assert!(stats.error.max <= params.delta.value());
        assert_eq!((stats.capped, stats.oversized_first_ring), (0, 0));
        (splats, stats)
    };
    // 703 in the paper, whose order is not known.
    let (splats, stats) = counted(within(0.1), 730.0);
    assert!(stats.ratio <= 0.008);
    let radii = splats.splats.iter().map(|s| s.radius);
    assert!(radii.clone().all(|r| (0.597..=0.6001).contains(&r)));
    let random = Params {
        order: Order::Random(0),
        ..within(0.1)
    };
    counted(random, 579.0);
    for (perc, wanted) in [(0.5, 121.0), (0.8, 46.0)] {
        let params = Params {
            perc,
            ..within(0.1)
        };
        counted(params, wanted);
    }
    for splat in &splats.splats {
        // Half of the height of a cap, whose plane the disc halves.
        let rim = (1.0f64 - 0.1).hypot(splat.radius);
        assert!((length(splat.centre) - 0.9).abs() < 1e-3);
        assert!((rim - 1.0).abs() <= 0.1 && splat.error <= 0.1);
        let worst = rim_error_deg(splat);
        assert!(worst <= 3.25, "{worst}");
    }
}

/// The largest angle on the rim between the field and the normal of the unit sphere at the place that is
/// seen along the disc's normal.
fn rim_error_deg(splat: &Splat) -> f64 {
    let angle = |turn: f64| {
        let (sin, cos) = turn.sin_cos();
        let (u, v) = (splat.radius * cos, splat.radius * sin);
        let found = splat.normal_at(u, v);
        let along = add(scale(splat.tangent, u), scale(splat.bitangent(), v));
        let up = (1.0 - dot(along, along)).max(0.0).sqrt();
        let wanted = add(along, scale(splat.normal, up));
        length(cross(found, wanted))
            .atan2(dot(found, wanted))
            .to_degrees()
    };
    (0..16)
        .map(|k| angle(f64::from(k) * std::f64::consts::FRAC_PI_8))
        .fold(0.0, f64::max)
}

#[test]
fn smaller_bounds_give_smaller_discs_with_better_fields() {
    let cloud = sphere(113_682, 1);
    let (splats, stats) = made(&cloud, &within(0.01));
    assert!(
        (stats.splats as f64 / 5752.0 - 1.0).abs() <= 0.05,
        "{}",
        stats.splats
    );
    let median = stats.radius.median.expect("a radius");
    assert!((median - 0.199).abs() < 1e-3, "{median}");
    let worst = splats.splats.iter().map(rim_error_deg).fold(0.0, f64::max);
    // Few points near the rim: the intercept is a mean over a thousand.
    assert!(worst <= 0.2, "{worst}");
    let typical = splats.splats.iter().map(rim_error_deg).sum::<f64>() / stats.splats as f64;
    assert!(typical <= 0.13, "{typical}");
    let (_, fine) = made(&sphere(28_000, 2), &within(0.001));
    let median = fine.radius.median.expect("a radius");
    assert!((median - 0.0632).abs() < 2e-3, "{median}");
}

#[test]
fn estimated_normals_look_outwards_and_cost_half_a_degree() {
    let exact = sphere(20_000, 3);
    let params = within(0.02);
    let (given, _) = made(&exact, &params);
    let (estimated, stats) = made(&bare(exact), &params);
    assert_eq!(stats.normals.origin, Origin::Estimated);
    assert_eq!(stats.normals.islands, 1);
    let mean = |splats: &Splats| {
        let all = splats.splats.iter().map(rim_error_deg);
        all.sum::<f64>() / splats.splats.len() as f64
    };
    assert!(
        estimated
            .splats
            .iter()
            .all(|s| dot(s.normal, s.centre) > 0.0)
    );
    assert!(mean(&estimated) <= mean(&given) + 0.5);
}

#[test]
fn greedy_covers_with_far_fewer_discs() {
    let cloud = sphere(20_000, 4);
    let greedy = Params {
        cover: Cover::Greedy,
        ..within(0.02)
    };
    let (paper, _) = made(&cloud, &within(0.02));
    let (few, stats) = made(&cloud, &greedy);
    assert!(
        4 * few.splats.len() < paper.splats.len(),
        "{}",
        few.splats.len()
    );
    assert!(stats.error.max <= 0.02);
    assert_covered(&cloud, &few, 0.02);
    assert_covered(&cloud, &paper, 0.02);
}

#[test]
fn a_plane_has_a_few_flat_discs_as_large_as_may_be() {
    // As many discs cover any number of points.
    let cloud = square(20_000);
    let params = Params {
        cover: Cover::Greedy,
        ..Params::DEFAULT
    };
    let (splats, stats) = made(&cloud, &params);
    assert!(splats.splats.len() <= 200, "{}", splats.splats.len());
    assert!(stats.error.max <= 1e-12 && stats.capped > 0);
    assert!(stats.radius.max.expect("a radius") <= 0.05 * 2f64.sqrt());
    for splat in &splats.splats {
        assert_eq!(splat.normal_at(splat.radius, 0.0), [0.0, 0.0, 1.0]);
    }
    let (_, estimated) = made(&bare(square(2000)), &Params::DEFAULT);
    assert!(estimated.error.max <= 1e-12 && estimated.lines == 0);
}

#[test]
fn neither_threads_nor_order_nor_place_nor_size_matter() {
    let cloud = shaken(slab(6000, [1.0, 0.5, 0.25]), 0.002);
    let cloud = Mesh {
        // On a lattice that a shift keeps.
        positions: cloud
            .positions
            .iter()
            .map(|p| p.map(|c| (c * 65_536.0).round() / 65_536.0))
            .collect(),
        ..bare(cloud)
    };
    for cover in [Cover::Paper, Cover::Greedy] {
        let params = Params {
            cover,
            ..Params::DEFAULT
        };
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a pool");
            pool.install(|| made(&cloud, &params))
        };
        let (first, stats) = on(1);
        assert_eq!((first.clone(), stats.clone()), on(2));
        assert_eq!((first.clone(), stats), on(8));
        let without_source = |splats: &Splats| -> Vec<Splat> {
            let bare = |s: &Splat| Splat { source: 0, ..*s };
            splats.splats.iter().map(bare).collect()
        };
        let (other, _) = made(&shuffled(&cloud, 9), &params);
        assert_eq!(without_source(&other), without_source(&first));
        for (size, shift) in [
            (1.0, [1e6, -1e6, 1e6]),
            (2f64.powi(-100), [0.0; 3]),
            (2f64.powi(100), [0.0; 3]),
        ] {
            let (moved, _) = made(&placed(&cloud, size, shift), &params);
            assert_eq!(moved.splats.len(), first.splats.len());
            for (a, b) in first.splats.iter().zip(&moved.splats) {
                assert_eq!(
                    (a.normal, a.tangent, a.field),
                    (b.normal, b.tangent, b.field)
                );
                assert_eq!((a.radius * size, a.error * size), (b.radius, b.error));
                assert_eq!((a.source, a.count), (b.source, b.count));
                let off = length(sub(b.centre, add(scale(a.centre, size), shift)));
                assert!(off <= 1e-9 * size, "{off:e}");
            }
        }
    }
}

#[test]
fn noise_over_the_bound_is_said_and_still_covered() {
    let cloud = shaken(sphere(5000, 5), 0.01);
    let params = Params {
        delta: Length::Absolute(0.002),
        ..Params::DEFAULT
    };
    let (splats, stats) = made(&bare(cloud.clone()), &params);
    assert!(stats.oversized_first_ring > 0 && stats.error.max > 0.002);
    assert_covered(&cloud, &splats, 0.002);
    let codes: Vec<String> = stats.warnings().into_iter().map(|w| w.code).collect();
    assert!(codes.contains(&"noise-over-delta".to_owned()), "{codes:?}");
}

#[test]
fn the_sides_of_a_thin_sheet_keep_their_own_discs() {
    let cloud = slab(20_000, [1.0, 1.0, 0.002]);
    let (splats, stats) = made(&cloud, &within(0.01));
    assert_eq!(stats.normals.origin, Origin::Given);
    for splat in splats.splats.iter().filter(|s| s.normal[2] != 0.0) {
        assert!(splat.centre[2] * splat.normal[2] > 0.0, "{splat:?}");
        assert_eq!(splat.error, 0.0);
    }
}

#[test]
fn discs_end_at_gaps() {
    let cloud = both(&square(2000), &square(2000), [1.2, 0.0, 0.0]);
    let (splats, _) = made(&cloud, &within(0.1));
    for splat in &splats.splats {
        let own = f64::from(u8::from(splat.centre[0] > 1.1)) * 1.2;
        let points = cloud.positions.iter().filter(|p| {
            let inside = length(sub(**p, splat.centre)) <= splat.radius * (1.0 - 1e-9);
            inside && (p[0] > 1.1) != (own > 0.0)
        });
        // A disc may hang over the gap, but grows no further into the other part than it is wide.
        assert!(points.count() as u32 <= splat.count, "{splat:?}");
    }
    let (alone, _) = made(&square(2000), &within(0.1));
    assert!(!alone.splats.is_empty());
}

#[test]
fn a_point_far_from_all_is_isolated() {
    let mut cloud = bare(sphere(2000, 6));
    cloud.positions.push([3.0, 0.1, 0.2]);
    let (splats, stats) = made(&cloud, &Params::DEFAULT);
    assert_eq!(stats.isolated, 1);
    let own = splats
        .splats
        .iter()
        .find(|s| s.source == 2000)
        .expect("its disc");
    assert!(
        own.count == 1 && own.radius < 0.2 && own.radius > 0.0,
        "{own:?}"
    );
    assert_covered(&cloud, &splats, stats.delta.abs);
}

#[test]
fn colours_are_averaged_and_classes_counted() {
    let mut cloud = square(500);
    let left = |p: &Vec3| p[0] < 0.5;
    let color = |p: &Vec3| {
        if left(p) {
            [1.0, 0.0, 0.5, 1.0]
        } else {
            [0.0, 1.0, 0.5, 1.0]
        }
    };
    cloud.colors = Some(cloud.positions.iter().map(color).collect());
    cloud.classes = Some(
        cloud
            .positions
            .iter()
            .map(|p| if left(p) { 2 } else { 6 })
            .collect(),
    );
    let (splats, _) = made(&cloud, &within(0.1));
    let colors = splats.colors.expect("colours");
    let classes = splats.classes.expect("classes");
    assert_eq!(
        (colors.len(), classes.len()),
        (splats.splats.len(), splats.splats.len())
    );
    for (color, class) in colors.iter().zip(&classes) {
        assert!((color[0] + color[1] - 1.0).abs() < 1e-6);
        assert_eq!((color[2], color[3]), (0.5, 1.0));
        assert_eq!(*class, if color[0] >= 0.5 { 2 } else { 6 });
    }
}

#[test]
fn flipped_normals_are_turned_unless_trusted() {
    let mut cloud = sphere(5000, 7);
    for (i, n) in cloud.normals.iter_mut().flatten().enumerate() {
        if Rng::new(1, i as u64).unit() < 0.5 {
            *n = scale(*n, -1.0);
        }
    }
    let outward = |splats: &Splats| {
        let out = splats
            .splats
            .iter()
            .filter(|s| dot(s.normal, s.centre) > 0.0);
        out.count() as f64 / splats.splats.len() as f64
    };
    let (turned, stats) = made(&cloud, &Params::DEFAULT);
    assert_eq!(
        (outward(&turned), stats.normals.origin),
        (1.0, Origin::Reoriented)
    );
    assert!(stats.normals.disagreement.expect("a share") > 0.4);
    let trusting = Params {
        trust_normals: true,
        ..Params::DEFAULT
    };
    let (kept, stats) = made(&cloud, &trusting);
    assert_eq!(stats.normals.origin, Origin::Given);
    assert!(outward(&kept) < 0.6);
}

#[test]
fn work_grows_with_the_points_alone() {
    let work = |count| {
        let (_, stats) = made(&sphere(count, 8), &within(0.1));
        stats.covered_mean * stats.splats as f64
    };
    let ratio = work(32_000) / work(8000);
    assert!(ratio <= 5.0, "{ratio}");
}

#[test]
fn what_is_degenerate_has_its_documented_result() {
    let of = |positions: Vec<Vec3>| Mesh {
        positions,
        ..Mesh::default()
    };
    let (none, stats) = made(&of(Vec::new()), &Params::DEFAULT);
    assert!(none.splats.is_empty() && stats.points == 0 && stats.radius.max.is_none());
    for count in [1, 2] {
        let points = (0..count).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let mut few = of(points);
        let error = generate(&few, &Params::DEFAULT, &Silent).expect_err("no plane");
        assert!(
            error
                .to_string()
                .starts_with(&format!("{count} points without normals"))
        );
        few.normals = Some(vec![[0.0, 0.0, 2.0]; count as usize]);
        let (splats, _) = made(&few, &Params::DEFAULT);
        assert_eq!(splats.splats.len(), count as usize);
        assert_eq!(splats.splats[0].normal, [0.0, 0.0, 1.0]);
        assert_eq!(splats.splats[0].radius > 0.0, count > 1);
    }
    let (one, stats) = made(&of(vec![[7.0, 8.0, 9.0]; 50]), &Params::DEFAULT);
    assert_eq!(
        (one.splats.len(), stats.duplicates, stats.lines),
        (1, 49, 0)
    );
    assert_eq!(
        (one.splats[0].centre, one.splats[0].radius),
        ([7.0, 8.0, 9.0], 0.0)
    );
    assert!(stats.warnings().iter().any(|w| w.code == "one-place"));
    let line = (0..100).map(|i| [f64::from(i), 2.0 * f64::from(i), -f64::from(i)]);
    let (none, stats) = made(&of(line.collect()), &Params::DEFAULT);
    assert_eq!((none.splats.len(), stats.lines), (0, 100));
    assert!(stats.warnings().iter().any(|w| w.code == "points-on-lines"));
    let bad = generate(
        &of(vec![[0.0, f64::NAN, 0.0]; 5]),
        &Params::DEFAULT,
        &Silent,
    );
    assert!(
        bad.expect_err("not finite")
            .to_string()
            .starts_with("vertex 0")
    );
}

#[test]
fn parameters_out_of_range_are_refused() {
    let refused = |params: Params| params.check().expect_err("refused").to_string();
    for delta in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let params = Params {
            delta: Length::Absolute(delta),
            ..Params::DEFAULT
        };
        assert!(refused(params).starts_with("--delta "));
    }
    let params = Params {
        perc: 1.5,
        ..Params::DEFAULT
    };
    assert!(refused(params).starts_with("--perc 1.5"));
    let params = Params {
        neighbors: 2,
        ..Params::DEFAULT
    };
    assert!(refused(params).starts_with("--neighbors 2"));
    assert!(Params::DEFAULT.check().is_ok());
}

#[test]
fn names_are_read_as_they_are_written() {
    for length in [Length::Absolute(0.1), Length::OfDiagonal(0.005)] {
        assert_eq!(Length::from_name(&length.name()), Some(length));
    }
    for order in [Order::Morton, Order::File, Order::Random(7)] {
        assert_eq!(Order::from_name(&order.name()), Some(order));
    }
    let view = Orient::Viewpoint([1.0, -2.5, 1e9]);
    for orient in [Orient::Mst, view, Orient::Keep] {
        assert_eq!(Orient::from_name(&orient.name()), Some(orient));
    }
    for bad in [
        "",
        "x",
        "5%%",
        "random:",
        "viewpoint:1,2",
        "viewpoint:1,2,nan",
    ] {
        assert_eq!(Length::from_name(bad), None);
        assert_eq!(Order::from_name(bad), None);
        assert_eq!(Orient::from_name(bad), None);
    }
}
