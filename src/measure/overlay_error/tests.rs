use super::*;
use crate::numeric::rng::Rng;
use crate::progress::Silent;
use crate::terrain::overlay::{Caps, Light, Method, NearRule, Params, Stats, Style, overlay};
use crate::terrain::pyramid::Pyramid;
use crate::terrain::surface::Kind;
use crate::terrain::view::{Scene, Seen};
use crate::terrain::{Grid, Samples, Transform};
use crate::vector::Polygon;

const SIZE: Size = Size {
    width: 160,
    height: 120,
};

struct Plain;

impl Light for Plain {
    fn ground(&self, _: &Surface, _: &Seen) -> [f32; 3] {
        [0.5; 3]
    }

    fn sky(&self, _: f64) -> [f32; 3] {
        [1.0; 3]
    }
}

/// A grid of cells of 10 with its lower left corner at the origin.
fn grid(cells: usize, z: impl Fn(f64, f64) -> f64) -> Grid {
    let transform = Transform {
        origin: [0.0, cells as f64 * 10.0],
        across: [10.0, 0.0],
        down: [0.0, -10.0],
    };
    let heights = (0..cells * cells).map(|k| {
        let p = transform.place((k % cells) as f64 + 0.5, (k / cells) as f64 + 0.5);
        z(p[0], p[1])
    });
    Grid {
        columns: cells,
        rows: cells,
        transform,
        samples: Samples::F64(heights.collect()),
        nodata: Some(-9999.0),
        crs: None,
    }
}

fn hills(x: f64, y: f64) -> f64 {
    40.0 * (x * 0.021).sin() + 30.0 * (y * 0.033).cos() + 100.0
}

/// Sums of waves of halving length, as heights of rough ground are.
fn fractal(x: f64, y: f64) -> f64 {
    let wave = |k: i32| {
        let f = 0.008 * 2f64.powi(k);
        (x * f * 1.3 + y * f * 0.4 + f64::from(k)).sin() * (y * f - 2.0 * f64::from(k)).cos()
    };
    (0..6).map(|k| 60.0 * 0.5f64.powi(k) * wave(k)).sum()
}

fn polygons(count: u64) -> Vec<Shape> {
    (0..count)
        .map(|k| {
            let mut rng = Rng::new(11, k);
            let centre = [rng.range(60.0, 580.0), rng.range(60.0, 580.0)];
            let size = rng.range(15.0, 90.0);
            let corners = 3 + k as usize % 9;
            let mut ring = |scale: f64| -> Vec<Vec2> {
                (0..corners)
                    .map(|c| {
                        let r = scale * size * rng.range(0.3, 1.0);
                        let angle = (c as f64 + rng.range(0.0, 0.9)) / corners as f64;
                        let (sin, cos) = (angle * std::f64::consts::TAU).sin_cos();
                        [centre[0] + r * cos, centre[1] + r * sin]
                    })
                    .collect()
            };
            let mut outer = ring(1.0);
            let mut rings = Vec::new();
            match k % 4 {
                // Crossing itself, the other way round, with a hole and plain.
                1 if corners > 3 => outer.swap(1, 2),
                2 => outer.reverse(),
                3 => rings.push(ring(0.25)),
                _ => {}
            }
            rings.insert(0, outer);
            Shape::Polygons(vec![Polygon { rings }])
        })
        .collect()
}

fn lines(count: u64) -> Vec<Shape> {
    let walk = |k: u64| {
        let mut rng = Rng::new(12, k);
        let mut at = [rng.range(50.0, 590.0), rng.range(50.0, 590.0)];
        let mut line = vec![at];
        for _ in 0..2 + k % 6 {
            at = at.map(|c| c + rng.range(-90.0, 90.0));
            line.push(at);
        }
        Shape::Lines(vec![line])
    };
    (0..count).map(walk).collect()
}

fn drawn(shapes: &[Shape]) -> Vec<Drawn<'_>> {
    let style = |k: usize| Style {
        width: if k.is_multiple_of(2) { 9.0 } else { 3.0 },
        unit: [Unit::Map, Unit::Pixels][k % 2],
        join: [Join::Round, Join::Mitre][k / 2 % 2],
        cap: [Cap::Butt, Cap::Round][k / 4 % 2],
        fill: [Fill::NonZero, Fill::EvenOdd][k / 3 % 2],
        opacity: 0.75,
        ..Style::of([200, 30, 30])
    };
    shapes
        .iter()
        .enumerate()
        .map(|(k, shape)| Drawn {
            shape,
            style: style(k),
        })
        .collect()
}

fn poses() -> Vec<Camera> {
    let up = [0.0, 0.0, 1.0];
    let mut out: Vec<Camera> = (0..8)
        .map(|k| {
            let (sin, cos) = (f64::from(k) * 0.785 + 0.2).sin_cos();
            let far = 250.0 + 90.0 * f64::from(k);
            let eye = [
                320.0 + far * cos,
                320.0 + far * sin,
                190.0 + 40.0 * f64::from(k),
            ];
            Camera::look_at(eye, [320.0, 320.0, 60.0], up, 0.7)
        })
        .collect();
    out.push(Camera::look_at(
        [320.0, 320.0, 900.0],
        [320.0, 321.0, 0.0],
        up,
        0.7,
    ));
    out.push(Camera::look_at(
        [300.0, 310.0, 175.0],
        [420.0, 420.0, 80.0],
        up,
        1.1,
    ));
    out.push(Camera::look_at(
        [-90.0, 320.0, 400.0],
        [320.0, 320.0, 60.0],
        up,
        0.3,
    ));
    let mut parallel = Camera::look_at([320.0, 320.0, 900.0], [320.0, 320.5, 0.0], up, 0.7);
    parallel.lens = Lens::Orthographic {
        height: 600.0 / parallel.unit,
    };
    out.push(parallel);
    out
}

struct Made {
    overlay: Overlay,
    stats: Stats,
    error: OverlayError,
}

fn make(grid: &Grid, features: &[Drawn], camera: &Camera, params: &Params) -> Made {
    let surface = Surface::new(grid, Kind::Tin).unwrap();
    let pyramid = Pyramid::new(&surface);
    let scene = Scene {
        surface: &surface,
        pyramid: &pyramid,
    };
    let (overlay, stats) =
        overlay(&scene, features, camera, SIZE, &Plain, params, &Silent).unwrap();
    let error = overlay_error(&surface, features, camera, SIZE, &overlay);
    Made {
        overlay,
        stats,
        error,
    }
}

fn by(method: Method) -> Params {
    Params {
        method,
        ..Params::DEFAULT
    }
}

#[test]
fn twelve_poses_of_thirty_polygons_and_lines_have_no_wrong_pixel_inside() {
    let mut shapes = polygons(30);
    shapes.extend(lines(30));
    shapes.push(Shape::Points(vec![[200.0, 200.0], [400.0, 333.0]]));
    let features = drawn(&shapes);
    let terrains = [grid(64, |_, _| 50.0), grid(64, hills), grid(64, fractal)];
    let mut boundary = [0; 4];
    let mut near_edge = [0; 4];
    for grid in &terrains {
        for (pose, camera) in poses().iter().enumerate() {
            let fail = make(grid, &features, camera, &by(Method::StencilZfail));
            for (k, method) in [Method::Distance, Method::Stencil, Method::StencilZfail]
                .into_iter()
                .enumerate()
            {
                let made = make(grid, &features, camera, &by(method));
                let error = made.error;
                assert_eq!(
                    (error.interior, error.sky),
                    (0, 0),
                    "{method:?} {pose}: {error:?}"
                );
                assert_eq!(made.stats.stencil_left, 0);
                boundary[k] += error.boundary;
                near_edge[k] += error.near_edge;
                if method == Method::Stencil {
                    // Some of its polyhedra are counted with z-pass, most often all.
                    assert!(made.overlay.ids == fail.overlay.ids, "{pose}");
                    assert_eq!(made.stats.feature_samples, fail.stats.feature_samples);
                }
            }
        }
    }
    assert!(boundary[0] > 10_000, "{boundary:?}");
    assert_eq!(near_edge[0], 0);
    // Corners are on 1/256 of a pixel, discs are polygons.
    assert!(
        near_edge[1] * 50 < boundary[1],
        "{near_edge:?} of {boundary:?}"
    );
}

#[test]
fn only_the_grown_box_is_right_where_the_near_plane_cuts() {
    // The eye is just outside the box of a polygon's polyhedron, its near plane within.
    let grid = grid(64, hills);
    let square = |lo: Vec2, hi: Vec2| vec![lo, [hi[0], lo[1]], hi, [lo[0], hi[1]]];
    let ring = square([300.0, 300.0], [600.0, 400.0]);
    let shapes = [Shape::Polygons(vec![Polygon { rings: vec![ring] }])];
    let features = drawn(&shapes);
    let eye = [299.998, 350.0, 130.0];
    let camera = Camera::look_at(eye, [500.0, 350.0, 60.0], [0.0, 0.0, 1.0], 1.0);
    let right = make(&grid, &features, &camera, &by(Method::Stencil));
    assert_eq!(right.error.interior, 0);
    assert_eq!(right.stats.zfail, 1);
    let paper = Params {
        near_rule: NearRule::Box,
        ..by(Method::Stencil)
    };
    let wrong = make(&grid, &features, &camera, &paper);
    assert_eq!(wrong.stats.zpass, 1);
    assert!(wrong.error.interior > 100, "{:?}", wrong.error);
}

#[test]
fn polyhedra_do_not_depend_on_the_terrain() {
    let mut shapes = polygons(10);
    shapes.extend(lines(10));
    let mut features = drawn(&shapes);
    for drawn in &mut features {
        drawn.style.unit = Unit::Map;
        drawn.style.join = Join::Mitre;
        drawn.style.cap = Cap::Butt;
    }
    let camera = poses()[0];
    let coarse = make(&grid(64, hills), &features, &camera, &by(Method::Stencil));
    let mut fine = grid(256, |x, y| hills(x / 4.0, y / 4.0));
    fine.transform.origin[1] /= 4.0;
    fine.transform.across[0] /= 4.0;
    fine.transform.down[1] /= 4.0;
    let fine = make(&fine, &features, &camera, &by(Method::Stencil));
    assert_eq!(
        coarse.stats.polyhedron_triangles,
        fine.stats.polyhedron_triangles
    );
    assert!(coarse.stats.nodes < fine.stats.nodes);
}

#[test]
fn tight_caps_count_far_fewer_fragments() {
    let mountain = |x: f64, y: f64| {
        let r = (x - 320.0).hypot(y - 320.0);
        900.0 * (-r * r / 30_000.0).exp()
    };
    let grid = grid(64, mountain);
    let road = (0..40).map(|k| [20.0 + 15.0 * f64::from(k), 60.0 + 7.0 * f64::from(k % 3)]);
    let shapes = [Shape::Lines(vec![road.collect()])];
    let features = drawn(&shapes);
    let camera = Camera::look_at(
        [320.0, -700.0, 500.0],
        [320.0, 320.0, 300.0],
        [0.0, 0.0, 1.0],
        0.9,
    );
    let tight = make(&grid, &features, &camera, &by(Method::Stencil));
    let global = Params {
        caps: Caps::Global,
        ..by(Method::Stencil)
    };
    let global = make(&grid, &features, &camera, &global);
    assert!(tight.overlay.ids == global.overlay.ids);
    let (few, many) = (tight.stats.fragments, global.stats.fragments);
    assert!(few * 5 <= many, "{few} {many}");
}

#[test]
fn eight_bits_lose_two_hundred_and_fifty_six_parts() {
    let grid = grid(16, |_, _| 0.0);
    let camera = Camera::look_at([80.0, 60.0, 200.0], [80.0, 80.0, 0.0], [0.0, 0.0, 1.0], 0.8);
    let ring = vec![[40.0, 40.0], [120.0, 40.0], [120.0, 120.0], [40.0, 120.0]];
    for (parts, lost) in [(255, false), (256, true), (257, false)] {
        let part = Polygon {
            rings: vec![ring.clone()],
        };
        let shapes = [Shape::Polygons(vec![part; parts])];
        let features = drawn(&shapes);
        for bits in [32, 8] {
            let params = Params {
                stencil_bits: bits,
                ..by(Method::Stencil)
            };
            let made = make(&grid, &features, &camera, &params);
            let gone = lost && bits == 8;
            assert_eq!(made.error.wrong > 1000, gone, "{parts} {bits}");
            assert_eq!(made.error.interior == 0, !gone);
            assert_eq!(made.stats.stencil_lost > 0, gone);
            assert_eq!(made.stats.stencil_max, parts as u32);
            assert_eq!(made.stats.stencil_left, 0);
        }
    }
}

#[test]
fn a_texture_errs_by_its_texels() {
    let grid = grid(65, |_, _| 0.0);
    let (radius, height) = (100.0f64, 320.0);
    let ring = (0..720).map(|k| {
        let (sin, cos) = (f64::from(k) / 720.0 * std::f64::consts::TAU).sin_cos();
        [320.0 + radius * cos, 320.0 + radius * sin]
    });
    let shapes = [Shape::Polygons(vec![Polygon {
        rings: vec![ring.collect()],
    }])];
    let features = drawn(&shapes);
    let mut camera = Camera::look_at(
        [320.0, 320.0, 900.0],
        [320.0, 320.01, 0.0],
        [0.0, 0.0, 1.0],
        0.7,
    );
    camera.lens = Lens::Orthographic {
        height: height / camera.unit,
    };
    // A pixel's area on the map; picture pixels are far smaller than the texels.
    let pixel = height / SIZE.height as f64;
    for texels in [16, 32, 40] {
        let made = make(&grid, &features, &camera, &by(Method::Texture(texels)));
        let texel = 640.0 / f64::from(texels);
        let expected = 0.24 * texel * std::f64::consts::TAU * radius / (pixel * pixel);
        let share = made.error.wrong as f64 / expected;
        assert!((0.85..1.15).contains(&share), "{texels}: {share}");
        let exact = make(&grid, &features, &camera, &by(Method::Distance));
        assert_eq!(exact.error.wrong, 0);
    }
}

#[test]
fn pixels_from_straight_above_have_the_area() {
    let grid = grid(65, hills);
    let mut camera = Camera::look_at(
        [320.0, 320.0, 900.0],
        [320.0, 320.01, 0.0],
        [0.0, 0.0, 1.0],
        0.7,
    );
    camera.axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    camera.target = [320.0, 320.0, 0.0];
    camera.lens = Lens::Orthographic {
        height: 240.0 / camera.unit,
    };
    // Pixels of two units; the rectangle is on their borders.
    let ring = vec![
        [300.0, 280.0],
        [340.0, 280.0],
        [340.0, 400.0],
        [300.0, 400.0],
    ];
    let shapes = [Shape::Polygons(vec![Polygon { rings: vec![ring] }])];
    let features = drawn(&shapes);
    for method in [Method::Distance, Method::StencilZpass, Method::StencilZfail] {
        let made = make(&grid, &features, &camera, &by(method));
        assert_eq!(made.stats.covered_samples, 20 * 60, "{method:?}");
    }
}

#[test]
fn far_coordinates_and_threads_change_nothing() {
    let mut shapes = polygons(12);
    shapes.extend(lines(12));
    let camera = poses()[1];
    let params = Params {
        samples: 2,
        ..by(Method::Stencil)
    };
    let near_grid = grid(64, hills);
    let run = || make(&near_grid, &drawn(&shapes), &camera, &params).overlay;
    let near = run();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(3)
        .build()
        .unwrap();
    let other = pool.install(run);
    assert!(near.ids == other.ids && near.raster == other.raster);
    let shift = 4_194_304.0;
    let moved = |p: &Vec2| p.map(|c| c + shift);
    let far_shapes: Vec<Shape> = shapes
        .iter()
        .map(|shape| match shape {
            Shape::Polygons(all) => {
                let rings = |p: &Polygon| Polygon {
                    rings: p
                        .rings
                        .iter()
                        .map(|r| r.iter().map(moved).collect())
                        .collect(),
                };
                Shape::Polygons(all.iter().map(rings).collect())
            }
            Shape::Lines(all) => {
                Shape::Lines(all.iter().map(|l| l.iter().map(moved).collect()).collect())
            }
            other => other.clone(),
        })
        .collect();
    let mut far_grid = grid(64, hills);
    far_grid.transform.origin = moved(&far_grid.transform.origin);
    let mut far_camera = camera;
    far_camera.target[0] += shift;
    far_camera.target[1] += shift;
    let far = make(&far_grid, &drawn(&far_shapes), &far_camera, &params);
    let differ = near
        .ids
        .iter()
        .zip(&far.overlay.ids)
        .filter(|(a, b)| a != b)
        .count();
    assert!(differ <= 2, "{differ}");
}

#[test]
fn nothing_and_odd_things_are_drawn_without_harm() {
    let mut holed = grid(32, hills);
    if let Samples::F64(all) = &mut holed.samples {
        for k in 0..1024 {
            if k % 32 > 10 && k % 32 < 20 && k / 32 > 10 && k / 32 < 20 {
                all[k] = -9999.0;
            }
        }
    }
    let ring = |all: &[Vec2]| {
        Shape::Polygons(vec![Polygon {
            rings: vec![all.to_vec()],
        }])
    };
    let shapes = [
        Shape::Empty,
        ring(&[[0.0, 0.0], [1.0, 1.0]]),
        ring(&[[5.0, 5.0], [6.0, 6.0], [9.0, 9.0]]),
        ring(&[[-900.0, -900.0], [-800.0, -900.0], [-800.0, -800.0]]),
        Shape::Lines(vec![vec![[7.0, 7.0]; 4]]),
        ring(&[[20.0, 20.0], [300.0, 20.0], [300.0, 300.0], [20.0, 300.0]]),
    ];
    let features = drawn(&shapes);
    let up = [0.0, 0.0, 1.0];
    for camera in [
        Camera::look_at([160.0, -100.0, 250.0], [160.0, 160.0, 60.0], up, 0.9),
        Camera::look_at([160.0, 160.0, -50.0], [160.0, 161.0, 60.0], up, 0.9),
        Camera::look_at([50.0, 50.0, 110.0], [160.0, 160.0, 70.0], up, 0.9),
    ] {
        let plain = make(&holed, &[], &camera, &by(Method::Stencil));
        assert!(plain.overlay.ids.iter().all(|id| *id == 0));
        for method in [Method::Distance, Method::Stencil, Method::StencilZfail] {
            let made = make(&holed, &features, &camera, &by(method));
            assert_eq!((made.error.interior, made.error.sky), (0, 0), "{method:?}");
            assert_eq!((made.stats.empty, made.stats.stencil_left), (4, 0));
            assert!(made.stats.covered_samples > 0);
        }
    }
}
