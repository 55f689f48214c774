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
    assert!(stats.shaded > 100 && stats.shadow_rays > stats.shaded);
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
    assert!(why(&cube, seen([3.0; 3], y, 0.0)).contains("not above 0 and below 170 degrees"));
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
