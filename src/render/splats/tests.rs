//! What tracing discs promises: the same answer from every tree, no false hits, smooth normals, the
//! same picture at any size and place.

use super::cover::Seen;
use super::disc::{Discs, Origin, Plate};
use super::octree::{Octree, SQUARE};
use super::*;
use crate::camera::Size;
use crate::mesh::shapes;
use crate::numeric::rng::Rng;
use crate::numeric::vector::{add, cross, dot, length, normalize, scale, sub};
use crate::points::{Splat, Splats};
use crate::progress::Silent;
use crate::render::view::View;
use crate::spatial::local::CornerFrame;
use crate::spatial::local::times_power_of_two;

/// The unit sphere covered by discs as the paper grows them: exact slopes, the mean normal in the
/// middle, `delta` under and over the sphere.
pub(crate) fn ball(delta: f64) -> Splats {
    let square = 4.0 * delta * (1.0 - delta);
    ball_of((60.0 / square).ceil(), delta)
}

/// The same with so many discs.
fn ball_of(count: f64, delta: f64) -> Splats {
    let square = 4.0 * delta * (1.0 - delta);
    let place = |i: f64| {
        let z = 1.0 - 2.0 * (i + 0.5) / count;
        let (sin, cos) = (i * 2.399_963_229_728_653).sin_cos();
        let across = (1.0 - z * z).sqrt();
        [across * cos, across * sin, z]
    };
    let disc = |i: u32| {
        let normal = normalize(place(f64::from(i)));
        Splat {
            centre: scale(normal, 1.0 - delta),
            normal,
            tangent: super::disc::across(normal),
            radius: square.sqrt(),
            field: scale(normal, 0.5 * (1.0 + (1.0 - square).sqrt())),
            slopes: [1.0; 2],
            error: delta,
            count: 1,
            source: i,
        }
    };
    Splats {
        splats: (0..count as u32).map(disc).collect(),
        ..Splats::default()
    }
}

/// Discs of all sizes and directions, some of them on others.
fn heap(count: u64) -> Splats {
    let vector = |rng: &mut Rng| std::array::from_fn(|_| rng.range(-1.0, 1.0));
    let disc = |i: u64| {
        let mut rng = Rng::new(7, if i.is_multiple_of(17) { i / 2 } else { i });
        let mut normal: Vec3 = normalize(vector(&mut rng));
        if i.is_multiple_of(5) {
            // Along an axis: boxes without thickness, planes that rays lie in.
            normal = [0.0; 3];
            normal[(i / 5 % 3) as usize] = 1.0;
        }
        let radius = 0.3 * rng.unit().powi(4);
        Splat {
            centre: vector(&mut rng),
            normal,
            tangent: super::disc::across(normal),
            radius: if i.is_multiple_of(50) { 0.0 } else { radius },
            field: normal,
            slopes: [rng.unit(), -rng.unit()],
            error: 0.01 * radius,
            count: 1,
            source: i as u32,
        }
    };
    Splats {
        splats: (0..count).map(disc).collect(),
        ..Splats::default()
    }
}

/// The discs with each kind of tree, and the frame they are in.
fn covers(splats: &Splats) -> (CornerFrame, [Cover; 2]) {
    let local = local(splats);
    let cover = |accelerator| Cover::new(Discs::new(splats, &local), accelerator);
    (local, [Accelerator::Bvh, Accelerator::Octree].map(cover))
}

fn local(splats: &Splats) -> CornerFrame {
    let scene = Scene {
        covers: vec![splats.clone()],
        ..Scene::default()
    };
    scene.local().expect("finite")
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray {
        origin,
        direction: normalize(direction),
        least: 0.0,
        from: None,
    }
}

/// A ray from in or around the unit cube: of four one along an axis, and one from the centre of a disc.
fn any_ray(i: u64, discs: &Discs) -> Ray {
    let mut rng = Rng::new(11, i);
    let mut vector =
        |low: f64, high: f64| -> Vec3 { std::array::from_fn(|_| rng.range(low, high)) };
    let mut origin = vector(-0.5, 1.5);
    let mut direction = vector(-1.0, 1.0);
    let disc = &discs.splats[i as usize % discs.splats.len()];
    match i % 4 {
        0 => {
            let axis = (i / 4 % 3) as usize;
            let sign = direction[axis].signum();
            direction = [0.0; 3];
            direction[axis] = sign;
            if i.is_multiple_of(8) {
                // In the planes and through the centres of discs, and along faces of cells.
                origin = disc.centre;
                origin[axis] = -0.25;
            }
        }
        1 => origin = disc.centre,
        _ => {}
    }
    ray(origin, direction)
}

fn seen(cover: &Cover, ray: &Ray, blend: Blend) -> Option<Seen> {
    let (mut hits, mut visits) = (Scratch::new(), Visits::default());
    cover.see(0, ray, f64::INFINITY, blend, &mut hits, &mut visits)
}

#[test]
fn both_trees_answer_as_all_discs_do_to_the_bit() {
    let mut hits = 0;
    for splats in [heap(600), ball(0.02), ball(0.1)] {
        let (_, [boxes, octree]) = covers(&splats);
        for i in 0..34_000 {
            let ray = any_ray(i, &boxes.discs);
            let blend = [Blend::None, Blend::Normals, Blend::Depth][i as usize % 3];
            let wanted = boxes.see_one_by_one(&ray, blend);
            hits += u64::from(wanted.is_some());
            assert_eq!(seen(&boxes, &ray, blend), wanted, "boxes, ray {i}");
            assert_eq!(seen(&octree, &ray, blend), wanted, "octree, ray {i}");
            let mut visits = Visits::default();
            for tree in [&boxes, &octree] {
                let blocked = tree.blocks(0, &ray, f64::INFINITY, &mut visits);
                assert_eq!(blocked, wanted.is_some(), "ray {i}");
            }
        }
    }
    assert!(hits > 25_000, "{hits}");
}

#[test]
fn the_corners_that_the_paper_prints_lose_discs() {
    const PRINTED: [[f64; 2]; 4] = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
    let wrong = |corners| {
        let (_, [mut cover, _]) = covers(&ball(0.005));
        let octree = Octree::with_corners(&cover.discs.splats, cover.discs.bounds, corners);
        cover.tree = Tree::Octree(Box::new(octree));
        let differs = |i: &u64| {
            let ray = any_ray(*i, &cover.discs);
            seen(&cover, &ray, Blend::Normals) != cover.see_one_by_one(&ray, Blend::Normals)
        };
        (0..4000).filter(differs).count()
    };
    assert_eq!(wrong(SQUARE), 0);
    let printed = wrong(PRINTED);
    assert!(printed > 40, "{printed}");
}

#[test]
fn the_octree_is_the_same_whether_rays_made_it_or_not() {
    let splats = ball(0.0002);
    let (_, [boxes, octree]) = covers(&splats);
    let Tree::Octree(tree) = &octree.tree else {
        panic!("asked for");
    };
    let extent = || tree.extent(&octree.discs.splats);
    let untouched = extent();
    for i in 0..20 {
        let ray = any_ray(i, &boxes.discs);
        assert_eq!(
            seen(&octree, &ray, Blend::Normals),
            seen(&boxes, &ray, Blend::Normals)
        );
    }
    let touched = extent();
    assert!(untouched.nodes < touched.nodes && touched.nodes < touched.full);
    assert_eq!(untouched.full, touched.full);
    for i in 0..20_000 {
        seen(&octree, &any_ray(i, &boxes.discs), Blend::Normals);
    }
    let whole = extent();
    assert!(whole.nodes * 100 > whole.full * 99 && whole.full == touched.full);
    assert!(whole.refs > splats.splats.len() as u64 && whole.depth >= 4);
}

/// Rays that are mirrored off the outside of a ball of discs: how many meet it again under a rule, and
/// how many there were.
fn mirrored_again(
    delta: f64,
    count: u64,
    rule: impl Fn(&Seen, bool) -> Option<Origin> + Sync,
) -> [u64; 2] {
    let (_, [cover, _]) = covers(&ball(delta));
    let centre = cover.discs.bounds.centre();
    let found = (0..count).into_par_iter().map(|i| {
        let mut rng = Rng::new(5, i);
        let mut vector = |size: f64| -> Vec3 { std::array::from_fn(|_| rng.range(-size, size)) };
        let away = normalize(vector(1.0));
        let origin = add(centre, scale(away, 2.0));
        // All of the ball, its outline too.
        let target = add(centre, vector(0.27));
        let first = ray(origin, sub(target, origin));
        let Some(sight) = seen(&cover, &first, Blend::Normals) else {
            return [0, 0];
        };
        let plane = cover.discs.plates[sight.disc as usize].normal;
        if dot(plane, first.direction) >= 0.0 || dot(sight.normal, first.direction) >= 0.0 {
            return [0, 0];
        }
        let direction = normalize(mirror(first.direction, sight.normal));
        let under = dot(plane, direction) <= 0.0;
        let second = Ray {
            from: rule(&sight, under),
            ..ray(first.at(sight.t), direction)
        };
        [
            u64::from(seen(&cover, &second, Blend::Normals).is_some()),
            1,
        ]
    });
    found.reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
}

#[test]
fn a_ball_is_not_seen_in_itself() {
    let overlap = |seen: &Seen, under| {
        Some(Origin {
            object: 0,
            item: seen.disc,
            side: 1.0,
            under,
            ball: 0.0,
        })
    };
    for delta in [0.1, 0.02, 0.002] {
        let [again, count] = mirrored_again(delta, 500_000, overlap);
        assert!(count > 320_000, "{count}");
        assert_eq!(again, 0, "delta {delta} of {count}");
    }
    let [again, _] = mirrored_again(0.02, 20_000, |_, _| None);
    assert!(again > 1000, "{again}");
}

#[test]
fn what_stands_on_a_surface_is_seen_in_it() {
    // A floor and a wall on it, of one cover: at right angles, so that no rule of overlap hides it.
    let disc = |centre: Vec3, normal: Vec3| Splat {
        centre,
        normal,
        tangent: super::disc::across(normal),
        radius: 0.15,
        field: normal,
        error: 1e-4,
        ..Splat::default()
    };
    let lattice = (0..400).map(|i| [f64::from(i % 20) * 0.1, f64::from(i / 20) * 0.1]);
    let splats = Splats {
        splats: lattice
            .flat_map(|[x, y]| {
                [
                    disc([x, 0.0, y], [0.0, 1.0, 0.0]),
                    disc([0.0, x, y], [1.0, 0.0, 0.0]),
                ]
            })
            .collect(),
        ..Splats::default()
    };
    let local = local(&splats);
    let cover = Cover::new(Discs::new(&splats, &local), Accelerator::Bvh);
    let mut wall = 0;
    for i in 0..2000 {
        let mut rng = Rng::new(3, i);
        let place = [rng.range(0.02, 1.5), 0.5, rng.range(0.3, 1.5)];
        let down = ray(local.to_local(place), [0.0, -1.0, 0.0]);
        let sight = seen(&cover, &down, Blend::Normals).expect("the floor");
        let second = Ray {
            from: Some(Origin {
                object: 0,
                item: sight.disc,
                side: 1.0,
                under: false,
                ball: 0.0,
            }),
            ..ray(down.at(sight.t), [-1.0, 0.25, 0.0])
        };
        let then = seen(&cover, &second, Blend::Normals);
        let is_wall = |s: Seen| cover.discs.plates[s.disc as usize].normal[0] > 0.5;
        wall += u32::from(then.is_some_and(is_wall));
    }
    assert_eq!(wall, 2000);
}

/// The largest angle between the normals of neighbours in degrees, and how much of it is the sphere's
/// own, with and without blending.
fn jumps(delta: f64, side: usize) -> [f64; 2] {
    // Few discs, of which the nearest centre is often far.
    let sparse = ball_of((14.0 / (4.0 * delta * (1.0 - delta))).ceil(), delta);
    let (local, [cover, _]) = covers(&sparse);
    let step = 1.7 / side as f64;
    let normal = |x: usize, y: usize, blend| {
        let at = [x as f64 * step - 0.85, y as f64 * step - 0.85, 3.0];
        // Where the sphere is steep, neighbours are far from each other.
        let inside = at[0] * at[0] + at[1] * at[1] < 0.64;
        let down = ray(local.to_local(at), [0.0, 0.0, -1.0]);
        inside.then(|| seen(&cover, &down, blend).expect("no holes").normal)
    };
    [Blend::Normals, Blend::None].map(|blend| {
        let rows: Vec<Vec<Option<Vec3>>> = (0..side)
            .into_par_iter()
            .map(|y| (0..side).map(|x| normal(x, y, blend)).collect())
            .collect();
        let angle = |a: Option<Vec3>, b: Option<Vec3>| match (a, b) {
            (Some(a), Some(b)) => length(cross(a, b)).atan2(dot(a, b)).to_degrees(),
            _ => 0.0,
        };
        let pairs = (0..side - 1).flat_map(|y| (0..side - 1).map(move |x| (x, y)));
        pairs.fold(0.0, |most: f64, (x, y)| {
            let here = rows[y][x];
            most.max(angle(here, rows[y][x + 1]))
                .max(angle(here, rows[y + 1][x]))
        })
    })
}

#[test]
fn blended_normals_do_not_jump() {
    let side = 1024;
    for (delta, more) in [(0.1, 1.5), (0.02, 1.0)] {
        let [blended, alone] = jumps(delta, side);
        // The normal turns fastest at the border of what is looked at, by step / cos.
        let own = (1.7 / side as f64 / 0.6).to_degrees();
        assert!(blended <= 2.0 * own + 0.5, "{delta}: {blended} of {own}");
        // On a ball fields agree well already.
        assert!(
            alone - own > more * (blended - own),
            "{delta}: {alone} {blended} {own}"
        );
    }
}

fn small(params: Params) -> Params {
    Params {
        size: [60, 44],
        ..params
    }
}

/// A ball of discs beside a mirror ball and a box of triangles.
fn scene() -> Scene {
    Scene {
        covers: vec![ball(0.02)],
        meshes: vec![shapes::cuboid([1.5, -1.0, -0.5], [2.5, 0.5, 0.5])],
        spheres: vec![Sphere {
            centre: [-0.5, -0.5, 1.75],
            radius: 0.5,
        }],
        materials: vec![
            Material {
                mirror: 0.25,
                ..Material::DEFAULT
            },
            Material::DEFAULT,
            Material {
                transparent: 0.875,
                mirror: 0.125,
                ..Material::DEFAULT
            },
        ],
        reference: None,
    }
}

fn drawn(scene: &Scene, params: &Params) -> (Raster, Stats) {
    let (drawing, stats) = draw(scene, params, &Silent).expect("a picture");
    (drawing.light, stats)
}

#[test]
fn both_trees_draw_the_same_picture_on_any_number_of_threads() {
    let by = |accelerator| {
        small(Params {
            accelerator,
            samples: 2,
            seed: 9,
            ..Params::DEFAULT
        })
    };
    let wanted = drawn(&scene(), &by(Accelerator::Bvh));
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("threads can be started");
        pool.install(|| {
            assert_eq!(drawn(&scene(), &by(Accelerator::Bvh)), wanted);
            let (octree, stats) = drawn(&scene(), &by(Accelerator::Octree));
            assert!(octree == wanted.0);
            assert_eq!(stats.rays, wanted.1.rays);
        });
    }
    let other = drawn(
        &scene(),
        &Params {
            seed: 1,
            ..by(Accelerator::Bvh)
        },
    );
    assert!(other.0 != wanted.0);
}

#[test]
fn size_and_place_change_nothing() {
    let view = View {
        eye: [3.0, 2.0, 4.0],
        target: [0.5, -0.25, 0.0],
        up: [0.0, 1.0, 0.0],
        fov_deg: 42.0,
    };
    let lights = vec![
        Light {
            place: [-4.0, 6.0, 5.0],
            colour: [255, 200, 160],
        },
        Light {
            place: [5.0, 4.0, 1.0],
            colour: [90, 140, 255],
        },
    ];
    // Coordinates of few digits, which far places do not round.
    let coarse = |c: f64| (c * 4096.0).round() / 4096.0;
    let mut base = scene();
    for splat in &mut base.covers[0].splats {
        splat.centre = splat.centre.map(coarse);
    }
    for camera in [None, Some(view)] {
        let params = small(Params {
            camera,
            lights: if camera.is_some() {
                lights.clone()
            } else {
                Vec::new()
            },
            ..Params::DEFAULT
        });
        let wanted = drawn(&base, &params).0;
        assert!(wanted.pixels().iter().any(|p| *p != wanted.pixels()[0]));
        for (exponent, offset) in [
            (-100, [0.0; 3]),
            (100, [0.0; 3]),
            (0, [4e9, -3e9, 17.0]),
            (-300, [0.0; 3]),
        ] {
            let long = |c: f64| times_power_of_two(c, exponent);
            let point = |p: Vec3| add(p, offset).map(long);
            let moved = moved(&base, &point, &long);
            let params = Params {
                camera: params.camera.map(|view| View {
                    eye: point(view.eye),
                    target: point(view.target),
                    ..view
                }),
                lights: params
                    .lights
                    .iter()
                    .map(|light| Light {
                        place: point(light.place),
                        ..*light
                    })
                    .collect(),
                ..params.clone()
            };
            assert!(
                drawn(&moved, &params).0 == wanted,
                "2^{exponent} {offset:?}"
            );
        }
    }
}

fn moved(scene: &Scene, point: &impl Fn(Vec3) -> Vec3, long: &impl Fn(f64) -> f64) -> Scene {
    let mut scene = scene.clone();
    for s in &mut scene.covers[0].splats {
        s.centre = point(s.centre);
        s.radius = long(s.radius);
        s.error = long(s.error);
        // Slopes are per length.
        s.slopes = s.slopes.map(|slope| slope / long(1.0));
    }
    for p in &mut scene.meshes[0].positions {
        *p = point(*p);
    }
    for s in &mut scene.spheres {
        s.centre = point(s.centre);
        s.radius = long(s.radius);
    }
    scene
}

#[test]
fn rays_grow_with_pixels_and_with_depth() {
    let rays = |size: [u32; 2], depth| {
        let params = Params {
            size,
            depth,
            ..Params::DEFAULT
        };
        drawn(&scene(), &params).1.rays.sum() as f64
    };
    let ratio = rays([128, 96], 2) / rays([64, 48], 2);
    assert!((3.6..4.4).contains(&ratio), "{ratio}");
    let ladder: Vec<f64> = (0..5).map(|depth| rays([64, 48], depth)).collect();
    assert!(
        ladder.windows(2).all(|pair| pair[0] < pair[1]),
        "{ladder:?}"
    );
}

#[test]
fn a_ball_of_fine_discs_looks_like_the_ball() {
    let params = small(Params::DEFAULT);
    let looks = [
        Material::DEFAULT,
        scene().materials[2],
        scene().materials[0],
    ];
    for material in looks {
        let of = |covers, spheres| Scene {
            covers,
            spheres,
            materials: vec![material],
            ..Scene::default()
        };
        // The frames are one: the box of the discs is larger than the ball's.
        let view = View {
            eye: [1.5, 2.0, 4.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            fov_deg: 40.0,
        };
        let params = Params {
            camera: Some(view),
            ground: Ground::None,
            lights: vec![Light {
                place: [-4.0, 6.0, 5.0],
                colour: [255; 3],
            }],
            ..params.clone()
        };
        let sphere = Sphere {
            centre: [0.0; 3],
            radius: 1.0,
        };
        let (discs, _) = drawn(&of(vec![ball(0.0005)], vec![]), &params);
        let (exact, _) = drawn(&of(vec![], vec![sphere]), &params);
        let pairs = discs.pixels().iter().zip(exact.pixels());
        let off = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > 0.03);
        let wrong = pairs.filter(|pair| off(*pair)).count() as f64 / discs.pixels().len() as f64;
        assert!(wrong < 0.015, "{material:?}: {wrong}");
    }
}

#[test]
fn shadows_lie_where_they_must_and_take_the_colours_of_lamps() {
    // A lamp straight above a ball: a place of the ground right under it is dark, one beside is not.
    let stage = |material: Material, lights: Vec<Light>| {
        let scene = Scene {
            covers: vec![ball(0.01)],
            materials: vec![material],
            ..Scene::default()
        };
        let params = Params {
            lights,
            ..Params::DEFAULT
        };
        (
            Stage::new(&scene, &params, &Silent).expect("a scene"),
            params,
        )
    };
    let light = |place, colour| Light { place, colour };
    let passing = |stage: &Stage, from: Vec3, to: Vec3| {
        let (from, to) = (stage.local.to_local(from), stage.local.to_local(to));
        let way = sub(to, from);
        let ray = ray(from, way);
        stage.passes(&ray, length(way), &mut Visits::default())
    };
    let above = [0.0, 9.0, 0.0];
    let (opaque, _) = stage(Material::DEFAULT, vec![light(above, [255; 3])]);
    assert_eq!(passing(&opaque, [0.0, -1.1, 0.0], above), 0.0);
    assert_eq!(passing(&opaque, [2.0, -1.1, 0.0], above), 1.0);
    // Nothing behind a lamp is in the way.
    assert_eq!(passing(&opaque, [0.0, 3.0, 0.0], above), 1.0);
    let glass = Material {
        transparent: 0.75,
        ..Material::DEFAULT
    };
    let (glass, _) = stage(glass, vec![light(above, [255; 3])]);
    assert_eq!(passing(&glass, [0.0, -1.1, 0.0], above), 0.75);
    // Of a red and a blue lamp each casts a shadow in its own colour.
    let lamps = vec![
        light(above, [255, 0, 0]),
        light([9.0, 2.0, 0.0], [0, 0, 255]),
    ];
    let (two, params) = stage(Material::DEFAULT, lamps);
    let params = small(params);
    let (raster, _) = picture::draw(&two, &params, &Silent);
    let reddish = |p: &&[f32; 3]| p[0] < 0.6 && p[1] == 1.0 && p[2] == 1.0;
    let bluish = |p: &&[f32; 3]| p[2] < 0.6 && p[1] == 1.0 && p[0] == 1.0;
    assert!(raster.pixels().iter().filter(reddish).count() > 5);
    assert!(raster.pixels().iter().filter(bluish).count() > 5);
}

#[test]
fn light_is_bent_by_snells_law() {
    let normal = [0.0, 1.0, 0.0];
    for degrees in [0.0_f64, 10.0, 45.0, 80.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let inside = trace::bent([sin, -cos, 0.0], normal, 1.0 / 1.5).expect("it passes");
        assert!((inside[0] - sin / 1.5).abs() < 1e-15 && inside[1] < 0.0);
        let back = trace::bent(inside, normal, 1.5).expect("it passes");
        assert!(length(sub(back, [sin, -cos, 0.0])) < 1e-14);
    }
    let steep = trace::bent(normalize([1.0, -0.5, 0.0]), normal, 1.5);
    assert_eq!(steep, None);
}

#[test]
fn discs_on_their_rims_and_edges_are_met_or_missed_without_numbers_that_are_none() {
    let flat = Plate {
        centre: [0.5, 0.5, 0.5],
        normal: [0.0, 0.0, 1.0],
        square: 0.0625,
    };
    let down = |x: f64| ray([x, 0.5, 2.0], [0.0, 0.0, -1.0]);
    assert_eq!(flat.meet(&down(0.75)), Some((1.5, 1.0)));
    assert_eq!(flat.meet(&down(0.75_f64.next_up())), None);
    assert_eq!(flat.meet(&ray([0.0, 0.5, 0.5], [1.0, 0.0, 0.0])), None);
    assert_eq!(flat.meet(&ray([0.0, 0.5, 0.7], [1.0, 0.0, 0.0])), None);
    let point = Plate {
        square: 0.0,
        ..flat
    };
    assert_eq!(point.meet(&down(0.5)), None);
}

#[test]
fn checking_finds_nothing_and_the_finest_picture_is_there() {
    let params = small(Params {
        verify: true,
        ..Params::DEFAULT
    });
    let (drawing, stats) = draw(&scene(), &params, &Silent).expect("a picture");
    let checked = stats.checked.expect("was asked for");
    assert!(checked.rays > 2640 && checked.differing == 0, "{checked:?}");
    assert_eq!(stats.accuracy().reached, Some(0.0));
    let exact = drawing.exact.expect("was asked for");
    assert_eq!(exact.width(), 60);
    assert!(exact != drawing.light && drawing.looks.is_empty());
}

#[test]
fn a_reference_is_drawn_in_place_of_the_discs() {
    let with = |reference| Scene {
        reference,
        ..scene()
    };
    let sphere = shapes::octasphere([0.0; 3], 1.0, 64);
    let params = small(Params::DEFAULT);
    let (drawing, _) = draw(&with(Some(sphere)), &params, &Silent).expect("a picture");
    let (alone, _) = drawn(&with(None), &params);
    assert!(drawing.light == alone, "the reference changes the picture");
    let exact = drawing.exact.expect("there is a reference");
    assert!(exact != alone);
    assert_eq!(drawing.looks.len(), 60 * 44);
    assert_eq!(
        drawing.surface.map(|mesh| mesh.triangles.len()),
        Some(8 * 64 * 64)
    );
    let hits = drawing.looks.iter().filter(|look| look.depth.is_finite());
    // Discs that stand out at the outline show their back, which counts as outside.
    assert!(hits.clone().count() > 200 && hits.clone().all(|look| look.outside));
}

#[test]
fn what_cannot_be_drawn_is_refused_with_words() {
    let refused = |scene: &Scene, params: &Params| {
        let error = draw(scene, params, &Silent).expect_err("an error");
        error.to_string()
    };
    let nothing = refused(&Scene::default(), &Params::DEFAULT);
    assert!(nothing.contains("nothing to draw"), "{nothing}");
    let with = |change: fn(&mut Splat)| {
        let mut scene = scene();
        change(&mut scene.covers[0].splats[3]);
        refused(&scene, &Params::DEFAULT)
    };
    assert_eq!(
        with(|s| s.centre[1] = f64::NAN),
        "splat 3: has a number that is not finite"
    );
    assert_eq!(
        with(|s| s.radius = -0.5),
        "splat 3: the radius is -0.5, below 0"
    );
    assert_eq!(
        with(|s| s.normal = [0.0; 3]),
        "splat 3: the normal has no length"
    );
    let mut many = scene();
    many.materials.resize(8, Material::DEFAULT);
    assert_eq!(
        refused(&many, &Params::DEFAULT),
        "--material 7: there are 3 objects, counted from 0"
    );
    many.materials.truncate(1);
    many.materials[0].transparent = 0.9;
    assert_eq!(
        refused(&many, &Params::DEFAULT),
        "--material 0: mirror and transparent together are 1.15, over 1"
    );
    let deep = Params {
        depth: 65,
        ..Params::DEFAULT
    };
    assert_eq!(refused(&scene(), &deep), "--depth 65: is not in 0..=64");
}

#[test]
fn one_disc_and_a_camera_inside_are_drawn() {
    let one = Scene {
        covers: vec![Splats {
            splats: ball(0.1).splats[..1].to_vec(),
            ..Splats::default()
        }],
        ..Scene::default()
    };
    assert!(drawn(&one, &small(Params::DEFAULT)).1.hits > 20);
    let inside = small(Params {
        camera: Some(View {
            eye: [0.0; 3],
            target: [0.0, 0.0, -1.0],
            up: [0.0, 1.0, 0.0],
            fov_deg: 90.0,
        }),
        ..Params::DEFAULT
    });
    let only = Scene {
        covers: vec![ball(0.02)],
        ..Scene::default()
    };
    let size = Size {
        width: 60,
        height: 44,
    };
    assert_eq!(
        drawn(&only, &inside).1.hits as usize,
        size.width * size.height
    );
}

#[test]
fn backs_of_discs_at_an_outline_are_not_seen_but_those_of_open_surfaces_are() {
    let (local, [cover, _]) = covers(&ball(0.05));
    let scene = Scene {
        covers: vec![ball(0.05)],
        ..Scene::default()
    };
    let stage = Stage::new(&scene, &Params::DEFAULT, &Silent).expect("a scene");
    let params = Params::DEFAULT;
    let mut follower = trace::Follower::new(&stage, &params);
    let (mut backs, mut from_within) = (0, 0);
    for i in 0..40_000 {
        let mut rng = Rng::new(21, i);
        let place = [rng.range(-1.1, 1.1), rng.range(-1.1, 1.1), 3.0];
        let down = ray(local.to_local(place), [0.0, 0.0, -1.0]);
        if let Some(sight) = follower.see(&down) {
            let plane = cover.discs.plates[sight.item as usize].normal;
            backs += u32::from(dot(plane, down.direction) > 0.0);
            assert!(sight.is_outside(&down), "{place:?}");
        }
        let out = ray(local.to_local([0.0; 3]), sub(place, [0.0, 0.0, 2.0]));
        from_within += u32::from(follower.see(&out).is_some_and(|s| !s.is_outside(&out)));
    }
    assert!(backs > 20, "{backs}");
    assert_eq!(from_within, 40_000);
}
