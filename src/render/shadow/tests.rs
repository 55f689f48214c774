//! What the method promises: no leaks, no acne, the same picture at any size and place.

use super::*;
use crate::mesh::shapes;
use crate::progress::Silent;
use crate::volume::voxelize::Mode;

fn small(method: Method) -> Params {
    Params {
        method,
        resolution: 48,
        rays: 4,
        size: [64, 48],
        ..Params::DEFAULT
    }
}

/// Knotted, with creases where balls touch, thin and open.
fn scenes() -> Vec<(&'static str, Mesh)> {
    let balls = shapes::joined(
        shapes::octasphere([-0.9, 0.0, 0.0], 1.0, 12),
        &shapes::octasphere([0.9, 0.3, 0.2], 1.0, 12),
    );
    vec![
        ("knot", shapes::torus_knot(2, 3, 0.4, 80, 16)),
        ("balls", balls),
        ("open box", shapes::open_box([0.0; 3], [1.0, 0.6, 0.8])),
        ("sheet", shapes::sheet(2.0, 1.0, 3, 2)),
    ]
}

fn verified(mesh: &Mesh, params: &Params) -> Verified {
    let params = Params {
        verify: true,
        ..params.clone()
    };
    let (_, stats) = draw(mesh, &params, &Silent).expect("a picture");
    let meant = stats.shaded * u64::from(params.rays);
    assert!(stats.shaded > 100 && (meant / 2..=meant).contains(&stats.shadow_rays));
    stats.verified.expect("was asked for")
}

#[test]
fn conservative_voxels_leak_no_light_at_any_resolution() {
    for (name, mesh) in scenes() {
        for method in [Method::Octree, Method::Dda] {
            for resolution in [8, 32, 64] {
                let params = Params {
                    resolution,
                    ..small(method)
                };
                let found = verified(&mesh, &params);
                let leaks = (found.light_leaks, found.leaking_rays);
                assert_eq!(leaks, (0, 0), "{name} {method:?} {resolution}");
                assert_eq!(found.differing, found.false_shadows);
            }
        }
    }
}

#[test]
#[ignore = "the resolutions of the paper take minutes without optimization"]
fn false_shadow_halves_with_the_voxel_and_nothing_leaks() {
    let mesh = shapes::torus_knot(2, 3, 0.4, 288, 92);
    let mut before: Option<f64> = None;
    for resolution in [32, 64, 128, 256] {
        let params = Params {
            resolution,
            rays: 1,
            size: [512, 384],
            ..small(Method::Octree)
        };
        let found = verified(&mesh, &params);
        assert_eq!(found.leaking_rays, 0, "{resolution}");
        let falsely = found.falsely_blocked_rays as f64;
        if let Some(before) = before {
            let ratio = before / falsely;
            assert!((1.4..2.6).contains(&ratio), "{resolution}: {ratio}");
        }
        before = Some(falsely);
    }
}

#[test]
fn octree_and_walk_give_the_same_picture() {
    for (name, mesh) in scenes() {
        for mode in [Mode::ThreeAxis, Mode::Conservative] {
            for near in [Near::Exact, Near::Skip] {
                let of = |method| {
                    let params = Params {
                        mode,
                        near,
                        ..small(method)
                    };
                    draw(&mesh, &params, &Silent).expect("a picture")
                };
                let (tree, by_tree) = of(Method::Octree);
                let (walk, by_walk) = of(Method::Dda);
                assert!(tree == walk, "{name} {mode:?} {near:?}");
                assert_eq!(by_tree.blocked_rays, by_walk.blocked_rays);
            }
        }
    }
}

#[test]
fn the_mask_saves_nodes_and_the_tree_saves_voxels() {
    let mesh = shapes::torus_knot(2, 3, 0.4, 80, 16);
    let params = Params {
        verify: true,
        ..small(Method::Octree)
    };
    let (_, stats) = draw(&mesh, &params, &Silent).expect("a picture");
    let (voxels, verified) = (
        stats.voxels.expect("an octree"),
        stats.verified.expect("was asked for"),
    );
    assert!(Some(voxels.nodes_visited) < verified.nodes_without_mask);
    assert!(Some(voxels.voxels_visited) < verified.voxels_crossed);
}

#[test]
fn exact_rays_differ_from_themselves_by_noise_alone() {
    for (name, mesh) in scenes() {
        let found = verified(&mesh, &small(Method::Exact));
        assert_eq!((found.differing, found.mean_difference), (0, 0.0), "{name}");
        let more = Params {
            rays: 64,
            ..small(Method::Exact)
        };
        assert!(
            verified(&mesh, &more).mean_error <= found.mean_error,
            "{name}"
        );
    }
}

#[test]
fn a_lone_convex_model_has_no_shadow_on_itself() {
    // Nothing but acne could block a ray that leaves a ball; from below there is no ground.
    let mesh = shapes::octasphere([0.0; 3], 1.0, 40);
    for (method, near) in [
        (Method::Exact, Near::Exact),
        (Method::Octree, Near::Exact),
        (Method::Octree, Near::Skip),
    ] {
        let params = Params {
            method,
            near,
            resolution: 64,
            camera: Some(View {
                eye: [0.5, -0.3, 4.0],
                target: [0.0; 3],
                up: [0.0, 1.0, 0.0],
                fov_deg: 20.0,
            }),
            ..small(method)
        };
        let (_, stats) = draw(&mesh, &params, &Silent).expect("a picture");
        let share = stats.blocked_rays as f64 / stats.shadow_rays as f64;
        let most = if method == Method::Exact { 0.0 } else { 0.01 };
        assert!(share <= most, "{method:?} {near:?}: {share}");
    }
}

#[test]
fn neither_size_nor_place_changes_the_picture() {
    let base = shapes::torus_knot(2, 3, 0.4, 60, 12);
    let moved = |change: &dyn Fn(f64) -> f64| {
        let mut mesh = base.clone();
        for p in &mut mesh.positions {
            *p = p.map(change);
        }
        mesh
    };
    let of = |mesh: &Mesh| {
        draw(mesh, &small(Method::Octree), &Silent)
            .expect("a picture")
            .0
    };
    let wanted = of(&base);
    for power in [-900, -100, 100, 900] {
        assert!(of(&moved(&|c| c * 2f64.powi(power))) == wanted, "{power}");
    }
    // Coordinates of few bits can be moved exactly.
    let coarse = |c: f64| (c * 1048576.0).round() / 1048576.0;
    let near = of(&moved(&coarse));
    assert!(of(&moved(&|c| coarse(c) + 2f64.powi(30))) == near);
    // Others lose digits: few samples, near edges, show it.
    let far = of(&moved(&|c| c * 1e-30));
    let apart = wanted.pixels().iter().zip(far.pixels());
    let sum: f32 = apart.map(|(a, b)| (a[1] - b[1]).abs()).sum();
    assert!(sum / (wanted.pixels().len() as f32) < 1e-3, "{sum}");
}

#[test]
fn threads_change_no_byte() {
    let mesh = shapes::torus_knot(2, 3, 0.4, 60, 12);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let params = Params {
            verify: true,
            ..small(Method::Octree)
        };
        pool.expect("a pool")
            .install(|| draw(&mesh, &params, &Silent).expect("a picture"))
    };
    let (one, eight) = (on(1), on(8));
    assert!(one.0 == eight.0);
    assert_eq!(one.1, eight.1);
}

#[test]
fn a_vertex_under_a_roof_is_dark_and_one_on_it_is_lit() {
    let mesh = shapes::joined(
        shapes::sheet(4.0, 4.0, 2, 2),
        &shapes::cuboid([-0.9, -0.9, 1.0], [0.9, 0.9, 1.2]),
    );
    let params = Params {
        lights: vec![Light {
            centre: [0.0, 0.0, 9.0],
            radius: 0.2,
        }],
        ..small(Method::Octree)
    };
    let (baked, stats) = bake(&mesh, &params, &Silent).expect("colours");
    assert_eq!(baked.positions, mesh.positions);
    let colors = baked.colors.expect("colours");
    let grey = |p: Vec3| {
        let at = mesh.positions.iter().position(|q| *q == p);
        colors[at.expect("a vertex")][0]
    };
    assert_eq!(grey([0.0; 3]), 0.0, "{:?}", mesh.positions);
    assert!(grey([2.0, 2.0, 0.0]) > 0.9);
    assert_eq!(stats.shadow_rays % 4, 0);
}

#[test]
fn what_cannot_be_drawn_is_refused_with_words() {
    let cube = shapes::cuboid([0.0; 3], [1.0; 3]);
    let why = |mesh: &Mesh, params: Params| {
        let failed = draw(mesh, &params, &Silent);
        failed.expect_err("a refusal").to_string()
    };
    let seen = |eye, up, fov_deg| Params {
        camera: Some(View {
            eye,
            target: [0.5; 3],
            up,
            fov_deg,
        }),
        ..Params::DEFAULT
    };
    let y = [0.0, 1.0, 0.0];
    assert_eq!(
        why(&cube, seen([0.5; 3], y, 40.0)),
        "--camera 0.5,0.5,0.5,0.5,0.5,0.5,0.0,1.0,0.0,40.0: the eye is the target, so there is no direction to look in"
    );
    assert_eq!(
        why(&cube, seen([0.5, 3.5, 0.5], y, 40.0)),
        "--camera 0.5,3.5,0.5,0.5,0.5,0.5,0.0,1.0,0.0,40.0: up is parallel to the direction of view"
    );
    assert!(why(&cube, seen([3.0; 3], [0.0; 3], 40.0)).ends_with("up has no length"));
    assert!(why(&cube, seen([3.0; 3], y, 0.0)).contains("not from 0.1 to 170 degrees"));
    assert!(why(&cube, seen([f64::NAN; 3], y, 9.0)).ends_with("not finite"));
    let none = Params {
        rays: 0,
        ..Params::DEFAULT
    };
    assert_eq!(why(&cube, none), "--rays 0: is not in 1..=1048576");
    let dark = Params {
        lights: vec![Light {
            centre: [0.0; 3],
            radius: -1.0,
        }],
        ..Params::DEFAULT
    };
    assert_eq!(
        why(&cube, dark),
        "--light 0.0,0.0,0.0,-1.0: the radius is negative"
    );
    let far = Params {
        lights: vec![Light {
            centre: [1e200, 0.0, 0.0],
            radius: 1.0,
        }],
        ..Params::DEFAULT
    };
    assert_eq!(
        why(&cube, far),
        "--light 1e200,0.0,0.0,1.0: is over 1e100 times the model's size away from it"
    );
    assert_eq!(
        why(&Mesh::default(), Params::DEFAULT),
        "has no triangles, which alone cast and take shadows"
    );
}

#[test]
fn places_that_make_no_sense_still_give_a_picture() {
    let cube = shapes::cuboid([0.0; 3], [1.0; 3]);
    let point = Mesh::from_triangles(vec![[3.0; 3]], vec![[0, 0, 0]]);
    for method in [Method::Octree, Method::Dda, Method::Exact] {
        // Inside the cube everything is dark.
        let inside = Params {
            camera: Some(View {
                eye: [0.5; 3],
                target: [0.2, 0.4, 0.1],
                up: [0.0, 1.0, 0.0],
                fov_deg: 60.0,
            }),
            lights: vec![Light {
                centre: [3.0, 4.0, 5.0],
                radius: 0.1,
            }],
            ..small(method)
        };
        let (_, stats) = draw(&cube, &inside, &Silent).expect("a picture");
        assert_eq!(stats.blocked_rays, stats.shadow_rays);
        // So is everything outside when the light is in there.
        let buried = Params {
            lights: vec![Light {
                centre: [0.5; 3],
                radius: 0.1,
            }],
            ..small(method)
        };
        let (_, stats) = draw(&cube, &buried, &Silent).expect("a picture");
        assert_eq!(stats.blocked_rays, stats.shadow_rays, "{method:?}");
        let on_face = Params {
            lights: vec![Light {
                centre: [0.5, 1.0, 0.5],
                radius: 0.0,
            }],
            ..small(method)
        };
        let (_, stats) = draw(&cube, &on_face, &Silent).expect("a picture");
        let warned = usize::from(method != Method::Exact);
        assert_eq!(stats.warnings.len(), warned, "{method:?}");
        let (_, stats) = draw(&point, &small(method), &Silent).expect("a picture");
        assert_eq!(stats.triangles, 1);
    }
}

#[test]
fn a_plane_does_not_shade_itself_however_low_the_light() {
    let mesh = shapes::sheet(2.0, 2.0, 3, 3);
    for degrees in [0.5f64, 2.0, 5.0, 10.0, 60.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        for method in [Method::Octree, Method::Dda] {
            let params = Params {
                lights: vec![Light {
                    centre: [1.0 + 6.0 * cos, 1.0 + 2.0 * cos, 6.0 * sin],
                    radius: 0.02,
                }],
                camera: Some(View {
                    eye: [1.0, -2.0, 4.0],
                    target: [1.0, 1.0, 0.0],
                    up: [0.0, 0.0, 1.0],
                    fov_deg: 40.0,
                }),
                ..small(method)
            };
            let (_, stats) = draw(&mesh, &params, &Silent).expect("a picture");
            assert!(stats.shadow_rays > 1000, "{}", stats.shadow_rays);
            assert_eq!(stats.blocked_rays, 0, "{method:?} at {degrees} degrees");
        }
    }
}

#[test]
fn what_stands_on_the_ground_has_no_rim() {
    // The ground beside a slab lies in voxels of the slab's base.
    let slab = shapes::cuboid([-2.0, 0.0, -1.5], [2.0, 0.3, 1.5]);
    let params = Params {
        lights: vec![Light {
            centre: [-60.0, 6.0, 10.0],
            radius: 1.0,
        }],
        ..small(Method::Octree)
    };
    let found = verified(&slab, &params);
    let (_, exact) = draw(
        &slab,
        &Params {
            method: Method::Exact,
            ..params
        },
        &Silent,
    )
    .expect("a picture");
    assert!(exact.blocked_rays > 50, "{}", exact.blocked_rays);
    let falsely = found.falsely_blocked_rays;
    assert!(
        falsely * 4 < exact.blocked_rays,
        "{falsely} {}",
        exact.blocked_rays
    );
}

#[test]
fn a_seed_makes_a_picture_and_another_seed_another() {
    let mesh = shapes::torus_knot(2, 3, 0.4, 60, 12);
    let of = |seed| {
        let params = Params {
            seed,
            ..small(Method::Exact)
        };
        draw(&mesh, &params, &Silent).expect("a picture").0
    };
    assert!(of(3) == of(3));
    assert!(of(3) != of(4));
}

#[test]
fn light_comes_from_where_it_is() {
    // A post on the ground, y up, seen from the front, with light from its left.
    let post = shapes::cuboid([-0.2, 0.0, -0.2], [0.2, 2.0, 0.2]);
    for method in [Method::Octree, Method::Exact] {
        let lit_from = |x: f64| {
            let params = Params {
                lights: vec![Light {
                    centre: [x, 6.0, 0.0],
                    radius: 0.2,
                }],
                camera: Some(View {
                    eye: [0.0, 2.0, 8.0],
                    target: [0.0, 1.0, 0.0],
                    up: [0.0, 1.0, 0.0],
                    fov_deg: 30.0,
                }),
                ..small(method)
            };
            draw(&post, &params, &Silent).expect("a picture").0
        };
        let picture = lit_from(-6.0);
        let at = |x: usize, y: usize| picture.pixels()[y * 64 + x][1];
        // On the ground beside the foot: shadow on the right, light on the left.
        let rows = |x: usize| (34..37).map(move |y| (x, y));
        let left = (16..28).flat_map(rows).map(|(x, y)| at(x, y));
        let right = (36..48).flat_map(rows).map(|(x, y)| at(x, y));
        assert!(left.fold(1.0, f32::min) > 0.99, "{method:?}");
        assert!(right.fold(1.0, f32::min) < 0.6, "{method:?}");
        // The post fills the middle, and the sky the top.
        assert!(at(32, 24) < 0.9 && (0..64).all(|x| at(x, 0) == 1.0));
        // Light from the other side draws the mirror image.
        let mirrored = lit_from(6.0);
        let across = |y: usize| (0..64).map(move |x| (y * 64 + x, y * 64 + 63 - x));
        let apart = (0..48)
            .flat_map(across)
            .map(|(a, b)| (picture.pixels()[a][1] - mirrored.pixels()[b][1]).abs());
        let mean = apart.sum::<f32>() / (64.0 * 48.0);
        assert!(mean < 0.02, "{method:?}: {mean}");
    }
}

#[test]
fn half_shadow_is_the_share_of_the_disc_that_is_seen() {
    // Under the edge x = 0 of a roof at height 5 and a light at height 10, a place at x sees the part
    // of the light's disc right of -x: beyond a chord (each distance from the roof is the same).
    let floor = shapes::sheet(0.6, 0.2, 30, 2);
    let mut mesh = floor.clone();
    mesh.positions
        .iter_mut()
        .for_each(|p| *p = sub(*p, [0.3, 0.1, 0.0]));
    let roof = shapes::cuboid([-4.0, -4.0, 5.0], [0.0, 4.0, 5.01]);
    let places = mesh.positions.len();
    let mesh = shapes::joined(mesh, &roof);
    let radius = 0.25;
    for (method, resolution, most) in [(Method::Exact, 1, 0.01), (Method::Octree, 512, 0.04)] {
        let params = Params {
            lights: vec![Light {
                centre: [0.0, 0.0, 10.0],
                radius,
            }],
            rays: 1024,
            resolution,
            ..small(method)
        };
        let (baked, _) = bake(&mesh, &params, &Silent).expect("colours");
        let colors = baked.colors.expect("colours");
        let mut half = 0;
        for (p, color) in mesh.positions.iter().zip(&colors).take(places) {
            let chord = (-p[0] / radius).clamp(-1.0, 1.0);
            let seen = (chord.acos() - chord * (1.0 - chord * chord).sqrt()) / std::f64::consts::PI;
            let apart = (f64::from(color[0]) - seen).abs();
            assert!(apart < most, "{method:?} at {}: {} {seen}", p[0], color[0]);
            half += u64::from((0.1..0.9).contains(&seen));
        }
        assert!(half > 20, "{half}");
    }
}

#[test]
fn an_octree_made_where_rays_go_gives_the_same_picture_from_fewer_nodes() {
    // A look at one place of a large model.
    let mesh = shapes::torus_knot(2, 3, 0.4, 80, 16);
    let place = mesh.positions[0];
    for mode in [Mode::ThreeAxis, Mode::Conservative] {
        let of = |lazy| {
            let params = Params {
                lazy,
                mode,
                resolution: 128,
                verify: true,
                camera: Some(View {
                    eye: add(place, [3.0, 4.0, 9.0]),
                    target: place,
                    up: [0.0, 1.0, 0.0],
                    fov_deg: 4.0,
                }),
                ..small(Method::Octree)
            };
            draw(&mesh, &params, &Silent).expect("a picture")
        };
        let (whole, lazy) = (of(false), of(true));
        assert!(whole.0 == lazy.0, "{mode:?}");
        let made = |stats: &Stats| stats.modelled().made;
        let nodes = (made(&lazy.1), made(&whole.1));
        assert!(
            100 < nodes.0 && nodes.0 * 2 < nodes.1,
            "{mode:?}: {nodes:?}"
        );
        assert_eq!(whole.1.modelled().full, lazy.1.modelled().full);
        assert_eq!(whole.1.blocked_rays, lazy.1.blocked_rays);
    }
    let by_walk = Params {
        lazy: true,
        ..small(Method::Dda)
    };
    let why = draw(&mesh, &by_walk, &Silent)
        .expect_err("a refusal")
        .to_string();
    assert_eq!(
        why,
        "--lazy true: makes the octree, which --method octree alone goes by"
    );
}
