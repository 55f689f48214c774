use super::*;
use crate::numeric::rng::Rng;
use crate::numeric::vector::{add, dot, scale};
use crate::progress::Silent;
use crate::volume::isosurface::{Border, Select, axis_of, extract};
use crate::volume::{Data, Volume};

fn volume(dims: [usize; 3], spacing: Vec3, inside: impl Fn([usize; 3]) -> bool) -> Volume {
    let mut v = Vec::new();
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                v.push(u8::from(inside([x, y, z])));
            }
        }
    }
    Volume {
        frame: Frame::straight(dims, [0.0; 3], spacing),
        data: Data::U8(v),
    }
}

fn ball(radius: f64, n: usize, spacing: Vec3) -> Volume {
    let middle = (n - 1) as f64 / 2.0;
    volume([n; 3], spacing, |p| {
        let d = p.map(|c| c as f64 - middle);
        dot(d, d) <= radius * radius
    })
}

fn noise(dims: [usize; 3], density: f64, rng: &mut Rng) -> Volume {
    let bits: Vec<bool> = (0..dims.iter().product::<usize>())
        .map(|_| rng.unit() < density)
        .collect();
    volume(dims, [1.0; 3], |[x, y, z]| {
        bits[(z * dims[1] + y) * dims[0] + x]
    })
}

fn surface_of(volume: &Volume, border: Border) -> Surface {
    extract(volume, &Select::Set, border, &Silent).expect("a surface")
}

fn mesh_of(volume: &Volume, surface: &Surface) -> Mesh {
    let positions = surface.positions(&volume.frame, |_| [0.0; 3]);
    let triangles = surface.triangles(&positions);
    Mesh::from_triangles(positions, triangles)
}

fn recovered(mesh: &Mesh, given: Given) -> Lattice {
    recover(mesh, given, &Silent).expect("a lattice")
}

fn refusal(mesh: &Mesh, given: Given) -> String {
    match recover(mesh, given, &Silent) {
        Err(Error::Geometry(fault)) => {
            format!("{fault}; {}", fault.hint.clone().unwrap_or_default())
        }
        other => panic!("{other:?}"),
    }
}

/// All but the loops, with places counted from another voxel.
#[track_caller]
fn same(found: &Surface, wanted: &Surface) {
    assert_eq!(found.len(), wanted.len());
    let by: [i32; 3] = std::array::from_fn(|a| found.places[0][a] - wanted.places[0][a]);
    assert!(by.iter().all(|b| b % 2 == 0), "{by:?}");
    for v in 0..wanted.len() {
        let place: [i32; 3] = std::array::from_fn(|a| wanted.places[v][a] + by[a]);
        assert_eq!(found.places[v], place, "vertex {v}");
    }
    assert!(found.lower_inside == wanted.lower_inside);
    assert!(found.thin == wanted.thin);
    assert!(found.links == wanted.links);
    assert!(found.steps == wanted.steps);
    assert_eq!(found.cells, wanted.cells);
}

#[test]
fn the_surface_of_closed_meshes_is_recovered() {
    let mut rng = Rng::new(3, 0);
    let mut volumes = vec![
        ball(9.3, 22, [1.0; 3]),
        volume([3, 3, 3], [1.0; 3], |p| p == [1, 1, 1]),
        volume([1, 1, 1], [0.3, 0.7, 4.0], |_| true),
        volume([20, 20, 1], [0.7, 0.7, 3.0], |_| true),
        volume([1, 1, 20], [1.0; 3], |_| true),
        volume([2, 2, 20], [1.0; 3], |_| true),
        volume([200, 200, 1], [1.0; 3], |_| true),
        volume([90, 4, 4], [1.0; 3], |[x, ..]| x == 0 || x == 89),
    ];
    for round in 0..40 {
        let density = 0.1 + 0.8 * f64::from(round % 9) / 8.0;
        volumes.push(noise([11, 9, 13], density, &mut rng));
    }
    for volume in volumes {
        let surface = surface_of(&volume, Border::Closed);
        let mesh = mesh_of(&volume, &surface);
        let lattice = recovered(&mesh, Given::default());
        same(&lattice.surface, &surface);
        assert_eq!(lattice.triangles(), &mesh.triangles[..]);
        assert!(lattice.warnings.is_empty());
        let (found, wanted) = (lattice.spacing, volume.frame.spacing());
        for a in 0..3 {
            assert!((found[a] / wanted[a] - 1.0).abs() <= 1e-12, "{found:?}");
        }
        let least = (0..3).map(|a| lattice.surface.places.iter().map(|p| p[a]).min());
        assert!(least.eq([Some(1); 3]));
    }
}

#[test]
fn open_meshes_are_recovered_where_the_spacing_shows_and_with_it() {
    let mut rng = Rng::new(4, 0);
    for round in 0..40 {
        let density = 0.1 + 0.8 * f64::from(round % 9) / 8.0;
        let volume = noise([12, 9, 10], density, &mut rng);
        let surface = surface_of(&volume, Border::Open);
        let mesh = mesh_of(&volume, &surface);
        for spacing in [None, Some([1.0; 3])] {
            let given = Given {
                spacing,
                origin: None,
            };
            let lattice = recovered(&mesh, given);
            same(&lattice.surface, &surface);
            assert_eq!(lattice.spacing, [1.0; 3]);
        }
        let given = Given {
            spacing: None,
            origin: Some([0.0; 3]),
        };
        let lattice = recovered(&mesh, given);
        assert_eq!(lattice.surface.places, surface.places);
        assert_eq!(lattice.frame().axes, volume.frame.axes);
        assert!((0..3).all(|a| lattice.frame().dims[a] <= volume.frame.dims[a]));
    }
}

#[test]
fn a_flat_cap_asks_for_the_spacing_and_takes_it() {
    let volume = volume([9, 9, 4], [1.0, 2.0, 3.0], |p| p[2] < 2);
    let surface = surface_of(&volume, Border::Open);
    let mesh = mesh_of(&volume, &surface);
    let said = refusal(&mesh, Given::default());
    assert!(said.contains("neighbours all have the same z"), "{said}");
    assert!(said.contains("--spacing"), "{said}");
    let given = Given {
        spacing: Some([1.0, 2.0, 3.0]),
        origin: None,
    };
    same(&recovered(&mesh, given).surface, &surface);
}

#[test]
fn walls_along_an_axis_show_its_spacing_by_where_vertices_lie_across() {
    let volume = volume([16, 16, 12], [0.7, 0.8, 3.0], |[x, y, _]| {
        (x as f64 - 7.2).hypot(y as f64 - 7.4) <= 5.1
    });
    let surface = surface_of(&volume, Border::Open);
    let lattice = recovered(&mesh_of(&volume, &surface), Given::default());
    same(&lattice.surface, &surface);
    assert!((lattice.spacing[2] - 3.0).abs() <= 1e-12);
}

#[test]
fn any_split_of_the_polygons_gives_the_same_curves() {
    // Fans have diagonals within faces of cells, and some whole triangles there.
    let mut rng = Rng::new(5, 0);
    for round in 0..60 {
        let density = 0.2 + 0.6 * f64::from(round % 7) / 6.0;
        let volume = noise([9, 8, 7], density, &mut rng);
        let surface = surface_of(&volume, Border::Closed);
        let mut mesh = mesh_of(&volume, &surface);
        mesh.triangles.clear();
        let mut corners = &surface.loops.corners[..];
        for length in &surface.loops.lengths {
            let (polygon, rest) = corners.split_at(usize::from(*length));
            corners = rest;
            let first = rng.below(polygon.len());
            let at = |i: usize| polygon[(first + i) % polygon.len()];
            for i in 1..polygon.len() - 1 {
                mesh.triangles.push([at(0), at(i), at(i + 1)]);
            }
        }
        let lattice = recovered(&mesh, Given::default());
        assert!(lattice.surface.links == surface.links, "round {round}");
        assert!(lattice.surface.lower_inside == surface.lower_inside);
    }
}

#[test]
fn spacing_and_origin_are_exact_to_a_millionth() {
    for spacing in [[1.0; 3], [0.7, 0.7, 3.0], [1e-4, 2e-4, 1e5]] {
        let volume = ball(15.2, 34, spacing);
        let surface = surface_of(&volume, Border::Closed);
        let mesh = mesh_of(&volume, &surface);
        for (shift, single) in [(0.0, false), (0.0, true), (1e5, false), (1e5, true)] {
            let mut moved = mesh.clone();
            for p in &mut moved.positions {
                *p = add(*p, scale(spacing, shift));
                if single {
                    *p = p.map(|c| f64::from(c as f32));
                }
            }
            let lattice = recovered(&moved, Given::default());
            // Single precision leaves a voxel of 1e5 others few digits; what it holds is found.
            let close = if single && shift > 0.0 { 1e-3 } else { 1e-6 };
            for a in 0..3 {
                let off = lattice.spacing[a] / spacing[a] - 1.0;
                assert!(off.abs() <= close, "{spacing:?} {shift} {single}: {off}");
                let voxel = lattice.surface.places[0][a] - surface.places[0][a];
                let origin = lattice.origin[a] + 0.5 * f64::from(voxel) * lattice.spacing[a];
                let off = origin / spacing[a] - shift;
                assert!(
                    off.abs() <= 20.0 * close,
                    "{spacing:?} {shift} {single}: {off}"
                );
            }
            same(&lattice.surface, &surface);
            assert!(lattice.residual <= RESIDUAL);
        }
        let given = Given {
            spacing: Some(spacing),
            origin: Some([0.0; 3]),
        };
        let lattice = recovered(&mesh, given);
        assert_eq!(lattice.surface.places, surface.places);
        assert!(!lattice.spacing_detected);
    }
}

#[test]
fn soups_are_welded_and_every_vertex_follows() {
    let volume = ball(6.4, 16, [0.7, 1.0, 2.0]);
    let surface = surface_of(&volume, Border::Closed);
    let mesh = mesh_of(&volume, &surface);
    let mut soup = Mesh::default();
    // One vertex that nothing uses, off the lattice.
    soup.positions.push([0.123; 3]);
    for t in &mesh.triangles {
        let first = soup.positions.len() as u32;
        soup.positions.extend(t.map(|v| mesh.positions[v as usize]));
        soup.triangles.push([first, first + 1, first + 2]);
    }
    let lattice = recovered(&soup, Given::default());
    assert_eq!(lattice.surface.len(), surface.len());
    let corners = 3 * mesh.triangles.len() as u64;
    assert_eq!(lattice.duplicate_vertices, corners - surface.len() as u64);
    assert_eq!(lattice.vertex_of[0], NONE);
    let moved: Vec<Vec3> = (0..surface.len()).map(|v| [v as f64 * 1e-5; 3]).collect();
    let positions = lattice.positions(&soup, &moved);
    assert_eq!(positions[0], soup.positions[0]);
    for (v, own) in lattice.vertex_of.iter().enumerate().skip(1) {
        for a in 0..3 {
            let by = (positions[v][a] - soup.positions[v][a]) / lattice.spacing[a];
            assert!((by - moved[*own as usize][a]).abs() <= 1e-12);
        }
    }
    assert_eq!(lattice.triangles().len(), mesh.triangles.len());
}

#[test]
fn a_mesh_that_is_inside_out_is_turned_and_repeated_triangles_are_left_away() {
    let volume = ball(6.4, 16, [1.0; 3]);
    let surface = surface_of(&volume, Border::Closed);
    let mesh = mesh_of(&volume, &surface);
    let mut turned = mesh.clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    turned.triangles.push(turned.triangles[7]);
    let [a, b, _] = turned.triangles[3];
    turned.triangles.push([a, b, b]);
    let lattice = recovered(&turned, Given::default());
    assert!(lattice.inverted);
    same(&lattice.surface, &surface);
    assert_eq!(lattice.triangles(), &mesh.triangles[..]);
    let codes: Vec<&str> = lattice.warnings.iter().map(|w| &w.code[..]).collect();
    assert_eq!(
        codes,
        ["degenerate-triangles", "duplicate-triangles", "inside-out"]
    );
}

#[test]
fn an_empty_mesh_has_an_empty_lattice() {
    let mesh = Mesh {
        positions: vec![[1.5; 3]; 3],
        ..Mesh::default()
    };
    let lattice = recovered(&mesh, Given::default());
    assert!(lattice.surface.is_empty());
    assert_eq!(lattice.positions(&mesh, &[]), mesh.positions);
}

#[test]
fn meshes_that_are_of_no_binary_volume_are_refused_with_their_share() {
    let volume = ball(12.3, 28, [1.0; 3]);
    let surface = surface_of(&volume, Border::Closed);
    let mesh = mesh_of(&volume, &surface);
    let none = Given::default();
    let spaced = Given {
        spacing: Some([1.0; 3]),
        origin: None,
    };
    // As interpolation in a grey-valued volume would have it: each vertex on the sphere.
    let mut grey = mesh.clone();
    for (p, place) in grey.positions.iter_mut().zip(&surface.places) {
        let a = axis_of(*place);
        let d = p.map(|c| c - 13.5);
        let across = dot(d, d) - d[a] * d[a];
        p[a] = 13.5 + (12.3f64 * 12.3 - across).max(0.0).sqrt().copysign(d[a]);
    }
    let turn = |p: &mut Vec3, [a, b]: [usize; 2]| {
        let (sin, cos) = 0.4f64.sin_cos();
        (p[a], p[b]) = (cos * p[a] - sin * p[b], sin * p[a] + cos * p[b]);
    };
    let mut about_z = mesh.clone();
    about_z.positions.iter_mut().for_each(|p| turn(p, [0, 1]));
    let mut turned = about_z.clone();
    turned.positions.iter_mut().for_each(|p| turn(p, [1, 2]));
    let mut smoothed = mesh.clone();
    for t in &mesh.triangles {
        smoothed.positions[t[0] as usize] = mesh.positions[t[1] as usize].map(|c| c + 0.1);
    }
    for other in [&grey, &about_z, &turned, &smoothed] {
        for given in [none, spaced] {
            let said = refusal(other, given);
            assert!(said.contains("do not lie halfway"), "{said}");
            assert!(said.contains("--constraint cell-size"), "{said}");
            let share: f64 = said
                .split(['(', '%'])
                .nth(1)
                .and_then(|s| s.trim().parse().ok())
                .expect("a share");
            assert!(share > 20.0, "{said}");
        }
    }
    // Every eleventh edge gone, its lower end taken for both.
    let mut decimated = mesh.clone();
    for t in decimated.triangles.clone().iter().step_by(11) {
        let [from, to, _] = *t;
        for v in decimated.triangles.iter_mut().flatten() {
            if *v == from {
                *v = to;
            }
        }
    }
    decimated
        .triangles
        .retain(|[a, b, c]| a != b && b != c && c != a);
    let said = refusal(&decimated, none);
    assert!(said.contains("reach over more than one cell"), "{said}");
    let mut wrong = mesh.clone();
    wrong
        .triangles
        .iter_mut()
        .step_by(3)
        .for_each(|t| t.swap(0, 1));
    let said = refusal(&wrong, none);
    assert!(said.contains("turned opposite ways"), "{said}");
    let said = refusal(
        &mesh,
        Given {
            spacing: Some([1.1; 3]),
            origin: None,
        },
    );
    assert!(said.contains("given"), "{said}");
    let said = recover(
        &mesh,
        Given {
            spacing: Some([1.0, 0.0, 1.0]),
            origin: None,
        },
        &Silent,
    );
    assert!(matches!(
        said,
        Err(Error::Parameter {
            option: "spacing",
            ..
        })
    ));
}

#[test]
fn any_number_of_threads_recovers_the_same() {
    let volume = noise([40, 30, 35], 0.4, &mut Rng::new(6, 0));
    let mesh = mesh_of(&volume, &surface_of(&volume, Border::Open));
    let on = |threads: usize| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool")
            .install(|| recovered(&mesh, Given::default()))
    };
    let one = on(1);
    for threads in [2, 8] {
        assert!(on(threads) == one);
    }
}
