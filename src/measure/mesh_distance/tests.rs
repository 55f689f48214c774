use super::*;
use crate::measure::test_shapes::{cube, moved, soup, sphere, square};
use crate::mesh::distance::point_triangle;
use crate::numeric::vector::{length, lerp, sub};
use crate::progress::Silent;
use crate::spatial::local::times_power_of_two;
use proptest::prelude::*;

const QUICK: Params = Params {
    samples: 2000,
    ..Params::DEFAULT
};

fn of(a: &Mesh, b: &Mesh) -> MeshDifference {
    compare(a, b, &QUICK, &Silent).expect("sound meshes")
}

fn near(found: f64, wanted: f64) {
    assert!(
        (found - wanted).abs() <= 1e-12 * wanted.abs(),
        "{found} is not {wanted}"
    );
}

#[test]
fn parallel_squares_are_one_distance_apart() {
    let d = of(&square(1, 0.0), &square(7, 0.25));
    for figure in [
        d.hausdorff,
        d.mean,
        d.rms,
        d.a_to_b.max,
        d.b_to_a.mean,
        d.b_to_a.max_bound,
    ] {
        near(figure, 0.25);
    }
    // From two large triangles to many small ones the bound has to be searched for.
    assert!(d.hausdorff_bound <= d.hausdorff + 1.001e-4 * d.diagonal);
    assert!(!d.identical && d.hausdorff_bound >= d.hausdorff);
    near(d.a.area.expect("finite"), 1.0);
    assert_eq!((d.volume_difference, d.a.closed), (None, false));
    let accuracy = d.accuracy();
    assert_eq!(
        (accuracy.reached, accuracy.bound),
        (Some(d.hausdorff), Some(d.hausdorff_bound))
    );
}

#[test]
fn a_scaled_sphere_is_off_by_the_scale() {
    let d = of(&sphere(40, 1.0), &sphere(40, 1.5));
    // Vertices of the outer sphere are nearest to the vertices of the inner one.
    near(d.b_to_a.max, 0.5);
    assert!(d.hausdorff >= 0.5 && d.hausdorff_bound <= 0.5 + 1e-4 * d.diagonal * 1.001);
    assert!((d.rms - 0.5).abs() < 0.005 && (d.mean - 0.5).abs() < 0.005);
    near(d.volume_difference.expect("closed"), 1.5f64.powi(3) - 1.0);
    near(d.area_difference.expect("an area"), 1.25);
}

#[test]
fn a_shifted_cube_is_off_by_its_shift() {
    let d = of(&cube([0.0; 3]), &cube([3.0, 0.0, 0.0]));
    near(d.hausdorff, 3.0);
    near(d.a_to_b.max, 3.0);
    let at = d.a_to_b.max_at.expect("measured");
    assert_eq!(at[0], 0.0);
    assert_eq!(d.a_to_b.max_nearest, Some([3.0, at[1], at[2]]));
    assert_eq!(d.a.bounds, Some([[0.0; 3], [1.0; 3]]));
}

#[test]
fn the_farthest_point_need_not_be_a_vertex() {
    // The middle of the large triangle is 0.3 from the small ones at its corners.
    let a = Mesh::from_triangles(
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2]],
    );
    let points = Mesh::from_triangles(a.positions.clone(), vec![]);
    let d = compare(&a, &points, &Params { gap: 1e-9, ..QUICK }, &Silent).expect("sound");
    // The circumcentre of a right triangle is the middle of its hypotenuse.
    let wanted = 0.5f64.sqrt();
    assert!(d.a_to_b.max <= wanted + 1e-15 && wanted <= d.a_to_b.max_bound);
    assert!(d.a_to_b.max_bound - d.a_to_b.max < 2e-9, "{:?}", d.a_to_b);
    assert_eq!(d.b_to_a.max, 0.0);
    assert_eq!((d.b.measured, d.b_to_a.samples), (Kind::Points, 3));
}

#[test]
fn one_surface_in_two_meshes_is_within_the_gap() {
    let d = of(&square(3, 0.5), &square(8, 0.5));
    assert!(d.hausdorff < 1e-15);
    assert!(
        d.hausdorff_bound <= 1.0001e-4 * d.diagonal,
        "{}",
        d.hausdorff_bound
    );
}

#[test]
fn the_same_mesh_is_identical_and_a_reordered_one_is_not() {
    let a = sphere(12, 1.0);
    let same = of(&a, &a);
    assert!(same.identical);
    assert_eq!(
        (same.hausdorff, same.hausdorff_bound, same.rms),
        (0.0, 0.0, 0.0)
    );
    let mut b = a.clone();
    b.triangles.reverse();
    let d = of(&a, &b);
    assert!(!d.identical);
    assert!(d.hausdorff < 1e-15 && d.hausdorff_bound < 1e-12);
    assert!(!of(&a, &moved(&a, |c| -c)).identical);
}

#[test]
fn directions_change_places() {
    let (a, b) = (sphere(10, 1.0), cube([0.3; 3]));
    let (there, back) = (of(&a, &b), of(&b, &a));
    assert_eq!((&there.a_to_b, &there.b_to_a), (&back.b_to_a, &back.a_to_b));
    assert_eq!((there.hausdorff, there.rms), (back.hausdorff, back.rms));
}

#[test]
fn size_and_place_scale_the_distances() {
    let (a, b) = (sphere(9, 1.0), sphere(14, 0.75));
    let base = of(&a, &b);
    for exponent in [-1000, -100, 100, 1000] {
        let resized = |m: &Mesh| moved(m, |c| times_power_of_two(c, exponent));
        let d = of(&resized(&a), &resized(&b));
        let back = |c: f64| times_power_of_two(c, -exponent);
        assert_eq!(back(d.hausdorff), base.hausdorff);
        assert_eq!(back(d.hausdorff_bound), base.hausdorff_bound);
        assert_eq!((back(d.rms), back(d.mean)), (base.rms, base.mean));
        assert_eq!(d.a_to_b.max_at.map(|p| p.map(back)), base.a_to_b.max_at);
    }
    // Coordinates that the shift does not round: every figure stays, bit for bit.
    let coarse = |m: &Mesh| moved(m, |c| (c * 1024.0).round() / 1024.0);
    let far = |m: &Mesh| moved(m, |c| c + 2f64.powi(31));
    let (a, b) = (coarse(&a), coarse(&b));
    let (here, there) = (of(&a, &b), of(&far(&a), &far(&b)));
    assert_eq!(
        (here.hausdorff, here.hausdorff_bound),
        (there.hausdorff, there.hausdorff_bound)
    );
    assert_eq!((here.rms, here.mean), (there.rms, there.mean));
}

#[test]
fn threads_do_not_change_a_bit() {
    let (a, b) = (sphere(30, 1.0), soup(4, 300));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| of(&a, &b))
    };
    assert_eq!(on(1), on(6));
}

#[test]
fn segments_and_points_are_measured_as_such() {
    let mut line = Mesh::from_triangles(vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![]);
    line.segments = vec![[0, 1]];
    let mut point = Mesh::from_triangles(vec![[9.0; 3], [1.0, 1.0, 0.0]], vec![]);
    point.points = vec![1];
    let d = of(&line, &point);
    near(d.a_to_b.max, 2f64.sqrt());
    near(d.b_to_a.max, 1.0);
    assert_eq!((d.a.measured, d.b.measured), (Kind::Segments, Kind::Points));
    // The mean of sqrt(1 + x^2) over 0 to 1, doubled and halved.
    let mean = (2f64.sqrt() + 1f64.asinh()) / 2.0;
    assert!((d.a_to_b.mean - mean).abs() < 1e-4);
    assert_eq!((d.a_to_b.samples, d.b_to_a.samples), (2000, 1));
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let empty = Mesh::default();
    let error = compare(&cube([0.0; 3]), &empty, &QUICK, &Silent).expect_err("no vertices");
    assert_eq!(
        error.to_string(),
        "mesh B has no vertices, so nothing has a distance to it"
    );
    for params in [
        Params {
            samples: 0,
            ..QUICK
        },
        Params { gap: 0.0, ..QUICK },
        Params {
            gap: f64::NAN,
            ..QUICK
        },
        Params {
            pieces: u64::MAX,
            ..QUICK
        },
    ] {
        assert!(params.check().is_err(), "{params:?}");
    }
}

#[test]
fn a_cap_on_work_leaves_a_wider_but_true_bound() {
    let (a, b) = (square(3, 0.0), square(8, 0.0));
    let mut last = f64::INFINITY;
    for pieces in [0, 100, 10_000, 1_000_000] {
        let d = compare(&a, &b, &Params { pieces, ..QUICK }, &Silent).expect("sound");
        assert!(d.hausdorff_bound <= last);
        assert!(d.a_to_b.pieces <= pieces);
        last = d.hausdorff_bound;
    }
    assert!(last < 1.5e-4);
}

/// The distance from a point to a mesh, by looking at every triangle.
fn brute(p: Vec3, mesh: &Mesh) -> f64 {
    (0..mesh.triangles.len())
        .map(|t| point_triangle(p, mesh.corners(t)).distance_squared)
        .fold(f64::INFINITY, f64::min)
        .sqrt()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn no_point_is_farther_than_the_bound(seed in any::<u64>(), na in 1u64..12, nb in 1u64..40) {
        let (a, b) = (soup(seed, na), soup(seed ^ 1, nb));
        let params = Params { samples: 100, gap: 1e-3, ..Params::DEFAULT };
        let d = compare(&a, &b, &params, &Silent).expect("sound");
        let at = d.a_to_b.max_at.expect("measured");
        let reached = brute(at, &b);
        prop_assert!((reached - d.a_to_b.max).abs() < 1e-14);
        let nearest = d.a_to_b.max_nearest.expect("measured");
        prop_assert!((length(sub(at, nearest)) - d.a_to_b.max).abs() < 1e-14);
        prop_assert!(d.a_to_b.max_bound <= d.a_to_b.max + 1.001e-3 * d.diagonal);
        for t in 0..a.triangles.len() {
            let [p, q, r] = a.corners(t);
            for i in 0..=12 {
                for j in 0..=12 {
                    let x = lerp(lerp(p, q, f64::from(i) / 12.0), r, f64::from(j) / 12.0);
                    prop_assert!(brute(x, &b) <= d.a_to_b.max_bound);
                }
            }
        }
    }
}
