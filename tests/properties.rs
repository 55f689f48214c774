//! What must not change under permuted, doubled and split elements, exact shifts and scales.

use proptest::prelude::*;
use scantle::measure::mesh_distance;
use scantle::measure::stability::{Step, Subject};
use scantle::mesh::Mesh;
use scantle::progress::Silent;
use scantle::trade::Change;
use scantle::volume::bits::BitGrid;
use scantle::volume::voxelize::{Fill, Mode, Params, Size, voxelize};

/// Triangles at coordinates of few bits, so that they can be moved exactly.
fn soup() -> impl Strategy<Value = Mesh> {
    let coordinate = (-1024i32..1024).prop_map(|n| f64::from(n) / 256.0);
    let vertex = prop::array::uniform3(coordinate);
    (
        prop::collection::vec(vertex, 3..24),
        1usize..24,
        any::<u64>(),
    )
        .prop_map(|(positions, count, seed)| {
            let pick = |t: usize, c: u64| {
                let mut rng = scantle::numeric::rng::Rng::new(seed ^ c, t as u64);
                rng.below(positions.len()) as u32
            };
            let triangles = (0..count).map(|t| [pick(t, 1), pick(t, 2), pick(t, 3)]);
            let triangles = triangles.collect();
            Mesh::from_triangles(positions, triangles)
        })
}

fn elements() -> impl Strategy<Value = Step> {
    prop::sample::select(vec![
        Step::Plain(Change::VertexOrder),
        Step::Plain(Change::FaceOrder),
        Step::Plain(Change::SplitVertices),
        Step::Plain(Change::DuplicateFaces),
        Step::Plain(Change::DegenerateFaces),
    ])
}

fn motions() -> impl Strategy<Value = Step> {
    prop_oneof![
        (-200i32..200).prop_map(Step::Scale),
        (0u32..30).prop_map(|k| Step::Shift(f64::from(1u32 << k))),
    ]
}

fn bits(mesh: &Mesh, mode: Mode, fill: Fill) -> BitGrid {
    let params = Params {
        size: Size::Resolution(17),
        mode,
        fill,
        ..Params::DEFAULT
    };
    let (volume, _) = voxelize(mesh, &params, &Silent).expect("a grid");
    let mut grid = BitGrid::new(volume.frame.dims);
    volume.read_bit_slices(0, &mut grid);
    grid
}

fn distance(a: &Mesh, b: &Mesh) -> mesh_distance::MeshDifference {
    let params = mesh_distance::Params {
        samples: 500,
        ..mesh_distance::Params::DEFAULT
    };
    mesh_distance::compare(a, b, &params, &Silent).expect("meshes")
}

fn mesh_of(subject: Subject) -> Mesh {
    match subject {
        Subject::Mesh(mesh) => mesh,
        _ => unreachable!("a mesh stays one"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 96,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn voxels_do_not_depend_on_elements_or_place(
        mesh in soup(),
        step in prop_oneof![elements(), motions()],
        mode in prop::sample::select(vec![Mode::Z, Mode::ThreeAxis, Mode::Conservative]),
        fill in prop::sample::select(vec![Fill::None, Fill::Parity, Fill::Winding]),
        seed in any::<u64>(),
    ) {
        // Two surfaces at one place wind twice.
        let fill = if step == Step::Plain(Change::DuplicateFaces) { Fill::None } else { fill };
        let changed = step.apply(&Subject::Mesh(mesh.clone()), seed).expect("a mesh");
        prop_assert_eq!(&changed.rounded, &None);
        prop_assert!(bits(&mesh_of(changed.subject), mode, fill) == bits(&mesh, mode, fill));
    }

    #[test]
    fn no_distance_is_made_by_elements(mesh in soup(), step in elements(), seed in any::<u64>()) {
        let changed = step.apply(&Subject::Mesh(mesh.clone()), seed).expect("a mesh");
        let changed = mesh_of(changed.subject);
        let found = distance(&mesh, &changed);
        // Closest points of slivers lose some digits.
        prop_assert!(found.hausdorff <= 1e-9 * found.diagonal, "{}", found.hausdorff);
    }

    #[test]
    fn distances_move_with_both_meshes(a in soup(), b in soup(), step in motions()) {
        // Both in one mesh, so that both move by the same vector.
        let mut both = a.clone();
        both.positions.extend(&b.positions);
        let moved = step.apply(&Subject::Mesh(both), 0).expect("a mesh");
        let positions = moved.subject.points();
        let (first, second) = positions.split_at(a.positions.len());
        let [moved_a, moved_b] = [(&a, first), (&b, second)].map(|(mesh, positions)| Mesh {
            positions: positions.to_vec(),
            ..mesh.clone()
        });
        let (still, found) = (distance(&a, &b), distance(&moved_a, &moved_b));
        let wanted = moved.motion.length(still.hausdorff);
        prop_assert!(
            (found.hausdorff - wanted).abs() <= 1e-9 * moved.motion.length(still.diagonal),
            "{} for {wanted}", found.hausdorff
        );
    }
}
