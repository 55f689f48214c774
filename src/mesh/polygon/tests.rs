use super::*;
use crate::numeric::vector::{cross, dot, sub};
use proptest::prelude::*;

fn split(outline: &[Vec3]) -> (Vec<[u32; 3]>, Split) {
    let face: Vec<u32> = (0..outline.len() as u32).collect();
    let mut triangles = Vec::new();
    let split = triangulate(outline, &face, &mut triangles);
    (triangles, split)
}

fn flat(outline: &[[f64; 2]]) -> Vec<Vec3> {
    outline.iter().map(|p| [p[0], p[1], 0.0]).collect()
}

/// Twice the signed area of a triangle seen from above.
fn area(points: &[Vec3], [a, b, c]: [u32; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|v| points[v as usize]);
    cross(sub(b, a), sub(c, a))[2]
}

/// Triangles that all turn left and whose areas add up to the outline's cover it once.
fn assert_covers(points: &[Vec3], triangles: &[[u32; 3]]) {
    let n = points.len();
    assert_eq!(triangles.len(), n - 2);
    let outline: f64 = (0..n)
        .map(|i| {
            let (p, q) = (points[i], points[(i + 1) % n]);
            p[0] * q[1] - p[1] * q[0]
        })
        .sum();
    let sum: f64 = triangles.iter().map(|t| area(points, *t)).sum();
    for t in triangles {
        assert!(area(points, *t) >= 0.0, "{t:?} turns the wrong way");
    }
    assert!(
        (sum - outline).abs() <= 1e-9 * outline,
        "{sum} for {outline}"
    );
}

#[test]
fn a_convex_face_is_a_fan() {
    let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    let fan = (vec![[0, 1, 2], [0, 2, 3]], Split::Covered);
    assert_eq!(split(&square), fan);
    let clockwise: Vec<_> = square.iter().rev().copied().collect();
    assert_eq!(split(&clockwise), fan);
}

#[test]
fn a_dart_is_cut_at_its_notch() {
    let dart = flat(&[[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]]);
    let (triangles, how) = split(&dart);
    assert_eq!(how, Split::Covered);
    assert_covers(&dart, &triangles);
    assert!(triangles.iter().all(|t| t.contains(&2) && t.contains(&0)));
}

#[test]
fn a_corner_in_the_middle_of_a_side_makes_no_flat_triangle() {
    let outline = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
    for turn in 0..5 {
        let mut turned = outline.clone();
        turned.rotate_left(turn);
        let (triangles, how) = split(&turned);
        assert_eq!(how, Split::Covered);
        assert_covers(&turned, &triangles);
        assert!(triangles.iter().all(|t| area(&turned, *t) > 0.0));
    }
}

#[test]
fn a_hole_joined_by_a_bridge_stays_open() {
    // A square of side 4, a bridge from its first corner to a square hole of side 2.
    let outline = flat(&[
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 4.0],
        [0.0, 4.0],
        [0.0, 0.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [3.0, 3.0],
        [3.0, 1.0],
        [1.0, 1.0],
    ]);
    let (triangles, how) = split(&outline);
    assert_eq!(how, Split::Covered);
    assert_covers(&outline, &triangles);
}

#[test]
fn outlines_that_cannot_be_covered_still_give_every_triangle() {
    let star: Vec<_> = (0..5)
        .map(|i| {
            let angle = f64::from(i) * 0.8 * std::f64::consts::PI;
            [angle.cos(), angle.sin()]
        })
        .collect();
    let bow = [[0.0, 0.0], [3.0, 2.0], [3.0, 0.0], [0.0, 1.0]];
    let line = [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0], [1.5, 1.5]];
    for outline in [&star[..], &bow, &line, &[[7.0, 7.0]; 6]] {
        assert_eq!(split(&flat(outline)).0.len(), outline.len() - 2);
    }
    assert_eq!(split(&flat(&line)).1, Split::Fanned);
}

#[test]
fn an_outline_of_many_corners_is_clipped_in_time() {
    // A comb: every second corner is a deep notch.
    let n = 20_000;
    let mut comb: Vec<_> = (0..n)
        .map(|i| [f64::from(i), if i % 2 == 0 { 0.0 } else { 100.0 }])
        .collect();
    comb.push([f64::from(n), -1.0]);
    comb.push([0.0, -1.0]);
    comb.reverse();
    let points = flat(&comb);
    let (triangles, how) = split(&points);
    assert_eq!((triangles.len(), how), (comb.len() - 2, Split::Covered));
}

#[test]
fn faces_are_kept_beside_their_triangles() {
    let mut mesh = Mesh {
        positions: flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
        ..Mesh::default()
    };
    let mut faces = Polygons::default();
    faces.push(&[0, 1]);
    faces.push(&[0, 1, 2, 3]);
    faces.push(&[1, 1, 2]);
    faces.push(&[]);
    let mut warnings = Vec::new();
    set_faces(&mut mesh, faces.clone(), &mut warnings).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [1, 1, 2]]);
    let kept = mesh.polygons.as_ref().unwrap();
    assert_eq!(kept.iter().map(<[u32]>::len).collect::<Vec<_>>(), [4, 3]);
    assert_eq!(warnings.len(), 1);
    assert_eq!((&*warnings[0].code, warnings[0].count), ("short-faces", 2));
    assert_eq!(warnings[0].first, Some(0));

    faces.push(&[3, 4, 0]);
    let fault = set_faces(&mut mesh, faces, &mut warnings).unwrap_err();
    let message = "face 4: refers to vertex 4, but there are 4";
    assert_eq!(fault.to_string(), message);
}

/// Outlines that go round the origin once: star-shaped, often concave.
fn star_shaped() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec(0.1..1.0f64, 4..60).prop_map(|radii| {
        let step = std::f64::consts::TAU / radii.len() as f64;
        let at = |(i, r): (usize, &f64)| [r * (i as f64 * step).cos(), r * (i as f64 * step).sin()];
        radii.iter().enumerate().map(at).collect()
    })
}

proptest! {
    #[test]
    fn star_shaped_outlines_are_covered(outline in star_shaped()) {
        let points = flat(&outline);
        let (triangles, how) = split(&points);
        prop_assert_eq!(how, Split::Covered);
        assert_covers(&points, &triangles);
    }

    #[test]
    fn size_place_and_axis_change_nothing(outline in star_shaped(), power in -900..900i32) {
        // Multiples of 2^-20, so that the move is exact.
        let grid: Vec<Vec3> = outline
            .iter()
            .map(|p| [(p[0] * 1048576.0).round() / 1048576.0, (p[1] * 1048576.0).round() / 1048576.0, 0.0])
            .collect();
        let expected = split(&grid);
        let scaled: Vec<_> = grid.iter().map(|p| p.map(|c| c * 2f64.powi(power))).collect();
        prop_assert_eq!(&split(&scaled), &expected);
        let moved: Vec<_> = grid.iter().map(|p| [p[0] + 3e9, p[1] - 1e9, p[2] + 5.0]).collect();
        prop_assert_eq!(&split(&moved), &expected);
        let turned: Vec<_> = grid.iter().map(|p| [p[1], p[2], p[0]]).collect();
        prop_assert_eq!(&split(&turned), &expected);
    }

    #[test]
    fn any_outline_gives_every_triangle(outline in prop::collection::vec(prop::array::uniform3(-3..3i32), 3..40)) {
        let points: Vec<Vec3> = outline.iter().map(|p| p.map(f64::from)).collect();
        prop_assert_eq!(split(&points).0.len(), points.len() - 2);
        // The area vector does not depend on how a closed outline is split.
        let (mut sum, mut around) = ([0.0; 3], [0.0; 3]);
        for [a, b, c] in split(&points).0 {
            let [a, b, c] = [a, b, c].map(|v| points[v as usize]);
            for (s, n) in sum.iter_mut().zip(cross(sub(b, a), sub(c, a))) {
                *s += n;
            }
        }
        for i in 0..points.len() {
            for (s, n) in around.iter_mut().zip(cross(points[i], points[(i + 1) % points.len()])) {
                *s += n;
            }
        }
        prop_assert!(dot(sub(sum, around), sub(sum, around)) == 0.0);
    }
}
