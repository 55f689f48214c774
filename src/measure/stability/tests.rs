use super::*;
use crate::anim::Clip;
use crate::mesh::Mesh;
use crate::mesh::shapes::{octasphere, torus_knot};
use crate::numeric::vector::{Vec3, length, sub};
use crate::protein::clearance::Ball;
use crate::trade::{Change, Part};
use crate::volume::bits::BitGrid;
use crate::volume::{Data, Frame, Volume};

/// A step of a mesh.
fn step(step: Step, mesh: &Mesh, seed: u64) -> Result<Changed, String> {
    step.apply(&Subject::Mesh(mesh.clone()), seed)
}

/// A step of a mesh that moves nothing.
fn rearranged(change: Change, mesh: &Mesh, seed: u64) -> Mesh {
    let changed = step(Step::Plain(change), mesh, seed).expect("a mesh");
    assert_eq!(changed.motion, Motion::NONE);
    mesh_of(changed.subject)
}

fn mesh_of(subject: Subject) -> Mesh {
    match subject {
        Subject::Mesh(mesh) => mesh,
        _ => panic!("no mesh"),
    }
}

fn atoms_of(subject: Subject) -> Vec<Ball> {
    match subject {
        Subject::Atoms(balls) => balls,
        _ => panic!("no atoms"),
    }
}

fn ball() -> Mesh {
    octasphere([0.3, -0.2, 0.1], 1.25, 8)
}

#[test]
fn motions_are_undone() {
    let p = [0.3, -1.7, 2.25];
    let turn = Motion::turn([1.0, 2.0, 3.0], 1.0);
    let both = Motion {
        exponent: 7,
        shift: [4.0, 5.0, -6.0],
        ..turn
    };
    assert!(length(sub(both.undo(both.apply(p)), p)) < 1e-14);
    assert!((length(turn.apply(p)) - length(p)).abs() < 1e-14);
    for axis in 0..3 {
        let quarter = Motion::quarter_turn(axis);
        let full = (0..4).fold(p, |p, _| quarter.apply(p));
        assert_eq!((full, quarter.undo(quarter.apply(p))), (p, p));
        let mut unit = [0.0; 3];
        unit[axis] = 1.0;
        let same = Motion::turn(unit, std::f64::consts::FRAC_PI_2);
        assert!(length(sub(same.apply(p), quarter.apply(p))) < 1e-14);
    }
}

#[test]
fn options_move_as_what_they_are() {
    let place = |motion: Motion, parts: &[Part], numbers: &[f64]| {
        let there = motion.place(parts, numbers).expect("a place");
        assert_eq!(
            motion.place_back(parts, &there).as_deref(),
            Ok(numbers),
            "{motion:?} {parts:?}"
        );
        there
    };
    let scaled = place(
        Motion::scale(-3),
        &[Part::Box],
        &[8.0, 16.0, 0.0, 9.0, 17.0, 1.0],
    );
    assert_eq!(scaled, [1.0, 2.0, 0.0, 1.125, 2.125, 0.125]);
    let quarter = Motion::quarter_turn(2);
    let turned = place(quarter, &[Part::Box], &[1.0, 2.0, 3.0, 4.0, 6.0, 9.0]);
    assert_eq!(turned, [-6.0, 1.0, 3.0, -2.0, 4.0, 9.0]);
    let both = Motion {
        exponent: 1,
        shift: [10.0, 20.0, 30.0],
        ..quarter
    };
    let parts = [Part::Point, Part::Length, Part::Direction, Part::Number];
    let moved = place(both, &parts, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    assert_eq!(moved, [6.0, 22.0, 36.0, 8.0, -6.0, 5.0, 7.0, 8.0]);
    let turn = Motion::turn([1.0, 2.0, 3.0], 1.0);
    assert!(
        turn.place(&[Part::Box], &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
            .is_err()
    );
    assert!(turn.place(&[Part::Point], &[1.0]).is_err());
    assert!(Motion::scale(900).place(&[Part::Length], &[1e300]).is_err());
}

#[test]
fn a_shift_that_rounds_says_what_was_moved_exactly() {
    let mesh = ball();
    let near = step(Step::Scale(-100), &mesh, 0).expect("a mesh");
    assert_eq!((near.rounding, &near.rounded), (Rounding::default(), &None));
    let far = step(Step::Shift(1e9), &mesh, 0).expect("a mesh");
    let rounded = mesh_of(far.rounded.expect("coordinates that are rounded"));
    assert!(far.rounding.relative > 1e-10 && far.rounding.relative < 1e-6);
    assert!(far.rounding.ulps > 1.0);
    for (there, here) in mesh_of(far.subject)
        .positions
        .iter()
        .zip(&rounded.positions)
    {
        assert_eq!(far.motion.apply(*here), *there);
        assert_eq!(far.motion.undo(*there), *here);
    }
    let again = step(Step::Shift(1e9), &rounded, 0).expect("a mesh");
    assert_eq!((again.rounding, again.rounded), (Rounding::default(), None));
    let huge = Mesh {
        positions: vec![[1e10; 3]],
        ..Mesh::default()
    };
    assert!(step(Step::Scale(1020), &huge, 0).is_err());
}

#[test]
fn elements_are_rearranged_and_stay_the_same() {
    let mesh = ball();
    let corners = |mesh: &Mesh| {
        let triangles =
            (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|p| p.map(f64::to_bits)));
        let mut all: Vec<_> = triangles.collect();
        all.sort_unstable();
        all
    };
    let wanted = corners(&mesh);
    for change in [
        Change::VertexOrder,
        Change::FaceOrder,
        Change::SplitVertices,
    ] {
        let changed = rearranged(change, &mesh, 7);
        assert_eq!(changed.check(), Ok(()));
        assert_eq!(corners(&changed), wanted, "{change:?}");
        assert!(changed != mesh, "{change:?}");
    }
    let split = rearranged(Change::SplitVertices, &mesh, 0);
    assert_eq!(split.positions.len(), 3 * mesh.triangles.len());
    let twice = rearranged(Change::DuplicateFaces, &mesh, 0);
    assert_eq!(twice.triangles.len(), 2 * mesh.triangles.len());
    let more = rearranged(Change::DegenerateFaces, &mesh, 0);
    let flat = &more.triangles[mesh.triangles.len()..];
    assert!(flat.len() == 64 && flat.iter().all(|[a, b, c]| b == c || a == b));
    assert!(step(Step::Plain(Change::DegenerateFaces), &Mesh::default(), 0).is_err());
    let jitter = step(Step::Plain(Change::Jitter), &mesh, 0).expect("a mesh");
    assert_eq!(jitter.rounding.ulps, 1.0);
}

fn atoms() -> Vec<Ball> {
    let atom = |k: u32| {
        let at = f64::from(k);
        Ball {
            centre: [at.sin() * 9.0, at.cos() * 7.0, 0.1 * at],
            radius: 1.2 + 0.01 * at,
        }
    };
    (0..60).map(atom).collect()
}

#[test]
fn clips_move_in_all_frames_and_their_drift_knows_the_order() {
    let mesh = ball();
    let raised = mesh.positions.iter().map(|[x, y, z]| [*x, *y, z + x * y]);
    let positions: Vec<Vec3> = mesh.positions.iter().copied().chain(raised).collect();
    let clip = Clip {
        mesh,
        positions,
        start: 0.5,
        rate: 25.0,
    };
    let apply = |step: Step| {
        let changed = step.apply(&Subject::Clip(clip.clone()), 3);
        let changed = changed.expect("a clip");
        let Subject::Clip(moved) = changed.subject.clone() else {
            panic!("no clip");
        };
        moved.check().expect("a sound clip");
        assert_eq!(moved.mesh.positions, moved.frame(0));
        assert_eq!((moved.frames(), moved.start, moved.rate), (2, 0.5, 25.0));
        (changed, moved)
    };
    let drift = |changed: &Changed, moved: &Clip| {
        let drift = clip_drift(&clip, moved, &changed.motion, changed.order.as_deref());
        drift.expect("as many of all").distance.expect("an extent")
    };
    for step in [
        Step::Scale(-60),
        Step::QuarterTurn(1),
        Step::Plain(Change::VertexOrder),
        Step::Plain(Change::FaceOrder),
        Step::Plain(Change::SplitVertices),
        Step::Plain(Change::DuplicateFaces),
        Step::Plain(Change::DegenerateFaces),
    ] {
        let (changed, moved) = apply(step);
        assert_eq!(drift(&changed, &moved), 0.0, "{step:?}");
        assert_eq!(changed.rounding, Rounding::default(), "{step:?}");
    }
    let (_, shuffled) = apply(Step::Plain(Change::VertexOrder));
    let (_, split) = apply(Step::Plain(Change::SplitVertices));
    assert!(shuffled.positions != clip.positions);
    assert_eq!(split.vertices(), 3 * clip.mesh.triangles.len());
    let (far, moved) = apply(Step::Shift(1e9));
    assert!(far.rounded.is_some() && far.rounding.max > 0.0);
    let off = drift(&far, &moved);
    assert!(off > 0.0 && off < 1e-4, "{off}");
    // A vertex of the second frame that is moved shows, whatever its number is.
    let (changed, mut moved) = apply(Step::Plain(Change::VertexOrder));
    moved.positions[clip.vertices() + 5][0] += 0.5;
    assert!(drift(&changed, &moved) > 0.1);
    let fewer = Clip::cloud(clip.vertices(), clip.frame(0).to_vec(), 0.0, 25.0);
    assert!(clip_drift(&clip, &fewer, &Motion::NONE, None).is_err());
}

#[test]
fn atoms_move_with_their_radii_and_are_reordered_and_doubled() {
    let balls = atoms();
    let subject = Subject::Atoms(balls.clone());
    let apply = |step: Step| step.apply(&subject, 3).expect("atoms");
    let small = apply(Step::Scale(-60));
    assert_eq!(
        (small.rounding, &small.rounded),
        (Rounding::default(), &None)
    );
    let factor = 2f64.powi(-60);
    for (a, b) in atoms_of(small.subject).iter().zip(&balls) {
        assert_eq!(
            (a.centre, a.radius),
            (b.centre.map(|c| c * factor), b.radius * factor)
        );
    }
    let far = apply(Step::Shift(1e9));
    let rounded = atoms_of(far.rounded.expect("centres that are rounded"));
    assert!(far.rounding.max > 0.0 && far.rounding.relative < 1e-6);
    for ((there, here), given) in atoms_of(far.subject).iter().zip(&rounded).zip(&balls) {
        assert_eq!(far.motion.apply(here.centre), there.centre);
        assert_eq!([there.radius, here.radius], [given.radius; 2]);
    }
    let quarter = atoms_of(apply(Step::QuarterTurn(2)).subject);
    let [x, y, z] = balls[7].centre;
    assert_eq!(
        (quarter[7].centre, quarter[7].radius),
        ([-y, x, z], balls[7].radius)
    );
    let other = atoms_of(apply(Step::Plain(Change::VertexOrder)).subject);
    assert!(other != balls && balls.iter().all(|ball| other.contains(ball)));
    let twice = atoms_of(apply(Step::Plain(Change::DuplicateFaces)).subject);
    assert_eq!(twice, [&balls[..], &balls].concat());
    let jitter = apply(Step::Plain(Change::Jitter));
    assert!(jitter.rounding.max > 0.0 && jitter.rounding.ulps <= 1.0);
    for change in [
        Change::FaceOrder,
        Change::SplitVertices,
        Change::DegenerateFaces,
    ] {
        let refused = Step::Plain(change).apply(&subject, 3);
        assert_eq!(refused, Err("atoms have no faces".to_owned()), "{change:?}");
    }
    // A radius that becomes too small for all its digits is rounded, as a coordinate is.
    let tiny = Ball {
        centre: [0.0; 3],
        radius: 1.7 * 2f64.powi(-60),
    };
    let lost = Step::Scale(-1000).apply(&Subject::Atoms(vec![tiny]), 0);
    let rounded = atoms_of(
        lost.expect("an atom")
            .rounded
            .expect("a radius that is rounded"),
    );
    assert!(rounded[0].radius != tiny.radius);
}

#[test]
fn spheres_drift_by_centres_and_radii() {
    let balls = atoms();
    let distance = |a: &[Ball], b: &[Ball], motion: &Motion| sphere_drift(a, b, motion).distance;
    let both = Motion {
        exponent: -7,
        shift: [8.0, -4.0, 2.0],
        ..Motion::quarter_turn(1)
    };
    let moved: Vec<Ball> = balls
        .iter()
        .map(|ball| Ball {
            centre: both.apply(ball.centre),
            radius: both.length(ball.radius),
        })
        .collect();
    assert!(distance(&balls, &moved, &both).is_some_and(|d| d < 1e-12));
    let mut wrong = balls.clone();
    wrong[5].radius += 0.25;
    assert_eq!(distance(&balls, &wrong, &Motion::NONE), Some(0.25));
    wrong[9].centre[2] += 0.5;
    let drift = distance(&balls, &wrong, &Motion::NONE);
    assert!(drift.is_some_and(|d| (d - 0.5).abs() < 1e-12), "{drift:?}");
    // One more beside another is as far as that, wherever it stands in the order.
    let mut more = balls.clone();
    let near = Ball {
        centre: [
            balls[30].centre[0],
            balls[30].centre[1],
            balls[30].centre[2] + 0.125,
        ],
        ..balls[30]
    };
    more.insert(0, near);
    let drift = distance(&balls, &more, &Motion::NONE);
    assert!(
        drift.is_some_and(|d| (d - 0.125).abs() < 1e-12),
        "{drift:?}"
    );
    assert_eq!(drift, distance(&more, &balls, &Motion::NONE));
    assert_eq!(distance(&balls, &[], &Motion::NONE), None);
    assert_eq!(distance(&[], &balls, &Motion::NONE), None);
    assert_eq!(distance(&[], &[], &Motion::NONE), Some(0.0));
}

fn volume(dims: [usize; 3], origin: Vec3, set: &[[usize; 3]]) -> Volume {
    let mut grid = BitGrid::new(dims);
    set.iter().for_each(|[x, y, z]| grid.set(*x, *y, *z));
    Volume {
        frame: Frame::straight(dims, origin, [0.5; 3]),
        data: Data::Bits(grid),
    }
}

#[test]
fn voxels_drift_by_those_that_differ_and_by_how_far() {
    let a = volume([8; 3], [0.25; 3], &[[1, 1, 1], [4, 4, 4]]);
    let same = volume_drift(&a, &a, &Motion::NONE);
    assert_eq!(
        (same.differing, same.distance, same.place),
        (Some(0), Some(0.0), 0.0)
    );
    let b = volume([8; 3], [0.25; 3], &[[1, 1, 1], [4, 4, 6]]);
    let drift = volume_drift(&a, &b, &Motion::NONE);
    assert_eq!((drift.differing, drift.distance), (Some(2), Some(1.0)));
    // The same voxels in a larger grid that starts two voxels before.
    let wider = volume([12; 3], [-0.75; 3], &[[3, 3, 3], [6, 6, 6]]);
    assert_eq!(volume_drift(&a, &wider, &Motion::NONE), same);
    let empty = volume([8; 3], [0.25; 3], &[]);
    let drift = volume_drift(&a, &empty, &Motion::NONE);
    assert_eq!((drift.differing, drift.distance), (Some(2), None));
    assert_eq!(volume_drift(&empty, &empty, &Motion::NONE), same);
}

#[test]
fn voxels_that_moved_along_did_not_drift() {
    let a = volume([8; 3], [0.25; 3], &[[1, 2, 3], [4, 4, 4], [7, 0, 5]]);
    let mut b = a.clone();
    let motion = Motion {
        exponent: -80,
        shift: [3.0, -1.0, 2f64.powi(-70)],
        ..Motion::NONE
    };
    b.frame = Frame::straight([8; 3], motion.apply([0.25; 3]), [2f64.powi(-81); 3]);
    // At 3 the origin keeps no digit of a grid this small.
    assert!(
        volume_drift(
            &a,
            &b,
            &Motion {
                shift: [0.0; 3],
                ..motion
            }
        )
        .differing
            > Some(0)
    );
    let motion = Motion::scale(-80);
    b.frame = Frame::straight([8; 3], motion.apply([0.25; 3]), [2f64.powi(-81); 3]);
    let drift = volume_drift(&a, &b, &motion);
    assert_eq!((drift.differing, drift.place), (Some(0), 0.0));
    let turn = Motion::quarter_turn(2);
    // (x, y) goes to (-y, x): the grid's lower corner moves to x = -4.
    let c = volume(
        [8; 3],
        [-3.75, 0.25, 0.25],
        &[[5, 1, 3], [3, 4, 4], [7, 7, 5]],
    );
    assert_eq!(volume_drift(&a, &c, &turn).differing, Some(0));
}

#[test]
fn meshes_drift_by_their_distance() {
    let mesh = torus_knot(2, 3, 3.0, 32, 6);
    let changed = step(Step::Plain(Change::Turn), &mesh, 0).expect("a mesh");
    let turned = mesh_of(changed.subject);
    let drift = mesh_drift(&mesh, &turned, &changed.motion).expect("meshes");
    assert!(drift.distance.is_some_and(|d| d < 1e-12), "{drift:?}");
    let off = Motion::shift([0.0, 0.0, 0.5]);
    let drift = mesh_drift(&mesh, &mesh, &off).expect("meshes");
    assert!(
        drift.distance.is_some_and(|d| d > 0.1 && d <= 0.5),
        "{drift:?}"
    );
}

#[test]
fn results_reach_as_far_as_all_nearer_steps_hold() {
    let steps = [
        (Step::Scale(-5), true),
        (Step::Scale(-50), false),
        (Step::Scale(-100), true),
        (Step::Scale(7), true),
        (Step::Shift(1e3), true),
        (Step::Shift(1.0), true),
    ];
    let wanted = Reach {
        smallest_scale: Some(-5),
        largest_scale: Some(7),
        offset: Some(1e3),
    };
    assert_eq!(Reach::of(&steps), wanted);
    assert_eq!(Reach::of(&[(Step::Scale(1), false)]).largest_scale, None);
}
