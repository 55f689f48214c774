use super::*;
use crate::mesh::Mesh;
use crate::mesh::topology::topology;
use crate::numeric::rng::Rng;
use crate::progress::Silent;
use crate::volume::{Data, Volume};

fn volume(dims: [usize; 3], inside: impl Fn([usize; 3]) -> bool) -> Volume {
    let mut v = Vec::new();
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                v.push(u8::from(inside([x, y, z])));
            }
        }
    }
    Volume {
        frame: Frame::straight(dims, [0.0; 3], [1.0; 3]),
        data: Data::U8(v),
    }
}

fn mesh(volume: &Volume, surface: &Surface) -> Mesh {
    let positions = surface.positions(&volume.frame, |_| [0.0; 3]);
    let triangles = surface.triangles(&positions);
    Mesh::from_triangles(positions, triangles)
}

fn ball(radius: f64, n: usize, at: f64) -> Volume {
    volume([n; 3], |p| {
        p.iter().map(|c| (*c as f64 - at).powi(2)).sum::<f64>() <= radius * radius
    })
}

#[test]
fn spheres_of_the_card_have_its_counts() {
    for (radius, vertices, triangles) in [(30.0, 16_968, 33_932), (30.5, 17_472, 34_940)] {
        let ball = ball(radius, 64, 31.5);
        let surface = extract(&ball, &Select::Set, Border::Closed, &Silent).expect("a surface");
        assert_eq!(surface.len(), vertices);
        assert_eq!(surface.loops.triangle_count(), triangles);
    }
}

#[test]
fn random_volumes_give_closed_manifold_surfaces_with_links_that_name_each_other() {
    let mut rng = Rng::new(7, 0);
    for round in 0..60u32 {
        let density = 0.1 + 0.8 * f64::from(round % 9) / 8.0;
        let dims = [3 + round as usize * 2, 9, 12];
        let bits: Vec<bool> = (0..dims[0] * dims[1] * dims[2])
            .map(|_| rng.unit() < density)
            .collect();
        let v = volume(dims, |[x, y, z]| bits[(z * dims[1] + y) * dims[0] + x]);
        let surface = extract(&v, &Select::Set, Border::Closed, &Silent).expect("a surface");
        let report = topology(&mesh(&v, &surface), &Silent).expect("a report");
        assert!(
            report.closed && report.oriented && report.manifold,
            "round {round}: {report:?}"
        );
        assert!(report.volume.expect("a volume") > 0.0, "round {round}");
        links_hold(&surface, false);
        let open = extract(&v, &Select::Set, Border::Open, &Silent).expect("a surface");
        links_hold(&open, true);
        for place in &open.places {
            for a in 0..3 {
                assert!((0..=2 * (dims[a] as i32 - 1)).contains(&place[a]));
            }
        }
    }
}

fn links_hold(surface: &Surface, may_end: bool) {
    for v in 0..surface.len() {
        for slot in 0..4 {
            let link = surface.links[v][slot];
            if link == NONE {
                assert!(may_end);
                continue;
            }
            let (to, back) = ((link >> 2) as usize, (link & 3) as usize);
            assert_eq!(surface.links[to][back], (v as u32) << 2 | slot as u32);
            let step = cases::step_of(surface.steps[v][slot]);
            let there = std::array::from_fn(|a| surface.places[v][a] + step[a]);
            assert_eq!(there, surface.places[to]);
        }
    }
}

#[test]
fn labels_share_their_walls_and_leave_no_gap() {
    let mut rng = Rng::new(11, 0);
    for round in 0..40u32 {
        let kinds = 2 + round as usize % 6;
        let dims = [6, 7, 5 + round as usize % 9];
        let values: Vec<u8> = (0..dims[0] * dims[1] * dims[2])
            .map(|_| rng.below(kinds) as u8)
            .collect();
        let v = Volume {
            frame: Frame::straight(dims, [0.0; 3], [1.0; 3]),
            data: Data::U8(values.clone()),
        };
        let labels = Labels::new((1..kinds).map(|k| k as f64).collect());
        let surface = extract_labels(&v, &labels, &Silent).expect("walls");
        let positions = surface.positions(&v.frame, |_| [0.0; 3]);
        let triangles = surface.triangles(&positions);
        let mut whole = 0.0;
        for label in 1..kinds {
            let own = surface.triangles_around(label as u16, &triangles);
            let mesh = Mesh::from_triangles(positions.clone(), own);
            let report = topology(&mesh, &Silent).expect("a report");
            assert_eq!(
                report.boundary_edges.count, 0,
                "round {round}, label {label}"
            );
            assert_eq!(
                report.inconsistent_edges.count, 0,
                "round {round}, label {label}"
            );
            whole += volume_of(&positions, &mesh.triangles);
        }
        // What all hold together is what the walls to the rest enclose.
        let outer: Vec<_> = triangles
            .iter()
            .filter(|t| surface.sides_of(*t).expect("labels")[1] == 0)
            .copied()
            .collect();
        let enclosed = volume_of(&positions, &outer);
        assert!((whole - enclosed).abs() < 1e-9 * enclosed, "round {round}");
    }
}

#[test]
fn one_label_alone_is_cut_as_a_binary_volume() {
    let mut rng = Rng::new(5, 0);
    let values: Vec<u8> = (0..1000).map(|_| 3 * rng.below(2) as u8).collect();
    let v = Volume {
        frame: Frame::straight([10; 3], [0.0; 3], [1.0; 3]),
        data: Data::U8(values),
    };
    let mut labels = extract_labels(&v, &Labels::new(vec![3.0]), &Silent).expect("walls");
    let binary = extract(&v, &Select::Equal(3.0), Border::Closed, &Silent).expect("a surface");
    assert!(labels.sides.iter().all(|s| *s == [1, 0]));
    labels.sides.clear();
    assert_eq!(labels, binary);
}

fn volume_of(positions: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let six = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        crate::numeric::vector::dot(a, crate::numeric::vector::cross(b, c))
    };
    triangles.iter().map(six).sum::<f64>() / 6.0
}
