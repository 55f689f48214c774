//! The method as a whole, on clips whose answer is known.

use super::pose::Pose;
use super::*;
use crate::mesh::{Mesh, shapes};
use crate::numeric::rng::Rng;
use crate::numeric::vector::{Vec3, add, cross, normalize, scale};

/// A clip of one mesh.
struct Clip {
    positions: Vec<Vec3>,
    vertices: usize,
    triangles: Vec<[u32; 3]>,
    hierarchy: Hierarchy,
}

impl Clip {
    fn new(mesh: &Mesh, frames: usize, at: impl Fn(usize, usize, Vec3) -> Vec3) -> Self {
        let all = (0..frames).flat_map(|f| {
            let at = &at;
            mesh.positions
                .iter()
                .enumerate()
                .map(move |(v, p)| at(f, v, *p))
        });
        let positions = all.collect();
        let edges = mesh
            .triangles
            .iter()
            .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        Clip {
            positions,
            vertices: mesh.positions.len(),
            triangles: mesh.triangles.clone(),
            hierarchy: Hierarchy::new(mesh.positions.len(), edges).unwrap(),
        }
    }

    fn frames(&self) -> usize {
        self.positions.len() / self.vertices
    }

    fn trajectories(&self) -> Trajectories<'_> {
        Trajectories {
            positions: &self.positions,
            vertices: self.vertices,
            origin: [0.0; 3],
            scale: 1.0,
        }
    }

    fn analysis(&self, params: &Params) -> Analysis<'_> {
        Analysis::new(
            self.trajectories(),
            &self.triangles,
            &self.hierarchy,
            params,
        )
        .unwrap()
    }

    /// The squared distances from each frame's centroid.
    fn norm(&self) -> f64 {
        let frames = self.positions.chunks_exact(self.vertices);
        frames
            .map(|all| {
                let n = all.len() as f64;
                let sum = all.iter().fold([0.0; 3], |sum, p| add(sum, *p));
                let centre = scale(sum, 1.0 / n);
                all.iter()
                    .map(|p| dot(sub(*p, centre), sub(*p, centre)))
                    .sum::<f64>()
            })
            .sum()
    }

    /// The error of Karni and Gotsman, in percent.
    fn kg(&self, squared_error: f64) -> f64 {
        100.0 * (squared_error / self.norm()).sqrt()
    }

    fn decode(&self, window: &[u8], parts: &[Vec<u8>]) -> Vec<Vec3> {
        let parts: Vec<&[u8]> = parts.iter().map(Vec::as_slice).collect();
        let decoded = decode(&self.hierarchy, self.frames(), window, &parts).unwrap();
        let mut out = vec![[f64::NAN; 3]; self.positions.len()];
        for (f, out) in out.chunks_exact_mut(self.vertices).enumerate() {
            decoded.frame(f, out);
        }
        assert!(out.iter().flatten().all(|x| x.is_finite()));
        out
    }

    /// The squared error of a stream as far as so many of its parts go, by decoding it.
    fn measured(&self, made: &Encoded, parts: usize) -> f64 {
        let out = self.decode(&made.window, &made.parts[..parts]);
        let pairs = out.iter().zip(&self.positions);
        pairs.map(|(a, b)| dot(sub(*a, *b), sub(*a, *b))).sum()
    }
}

fn turn(p: Vec3, axis: Vec3, angle: f64) -> Vec3 {
    let axis = normalize(axis);
    let (sin, cos) = angle.sin_cos();
    let along = scale(axis, dot(axis, p) * (1.0 - cos));
    add(add(scale(p, cos), scale(cross(axis, p), sin)), along)
}

/// Four boxes of `6 n^2 + 2` vertices that turn and travel each on its own.
fn boxes(n: usize, frames: usize) -> Clip {
    let mut mesh = Mesh::default();
    let mut part = shapes::octasphere([0.0; 3], 0.5, n);
    for p in &mut part.positions {
        // From the sphere to a box of three different sides.
        let largest = p.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        *p = std::array::from_fn(|i| p[i] / largest * [0.5, 0.4, 0.3][i]);
    }
    let each = part.positions.len();
    for _ in 0..4 {
        mesh.append(&part).unwrap();
    }
    let axes = [
        [1.0, 0.2, 0.0],
        [0.0, 1.0, 0.3],
        [0.4, 0.0, 1.0],
        [1.0, -1.0, 0.5],
    ];
    Clip::new(&mesh, frames, |f, v, p| {
        let (k, t) = (v / each, f as f64 / frames as f64);
        let centre = [3.0 * (k % 2) as f64, 3.0 * (k / 2) as f64, 0.0];
        let way = [
            (3.0 * t + k as f64).sin() * 0.3,
            t * 0.4 * (k as f64 - 1.5),
            0.2 * (5.0 * t).cos(),
        ];
        add(add(turn(p, axes[k], (2.0 + k as f64) * t), centre), way)
    })
}

/// A sheet that waves and bends.
fn sheet(frames: usize) -> Clip {
    let mesh = shapes::sheet(3.0, 2.0, 17, 11);
    Clip::new(&mesh, frames, |f, v, p| {
        let t = f as f64 * 0.1;
        let noise = Rng::new(v as u64, f as u64).range(-1e-3, 1e-3);
        let bent = turn(p, [0.0, 1.0, 0.0], 0.4 * t.sin() * p[0]);
        add(
            bent,
            [
                0.05 * (3.0 * p[1] + t).cos(),
                0.1 * t,
                0.2 * (2.0 * p[0] - 3.0 * t).sin() + noise,
            ],
        )
    })
}

fn params(clusters: usize, bits: u32) -> Params {
    Params {
        clusters,
        bits: Some(bits),
        ..Params::DEFAULT
    }
}

fn uniform(clusters: usize, bits: u32) -> Params {
    Params {
        allocate: Allocate::Uniform,
        ..params(clusters, bits)
    }
}

#[test]
fn rigid_parts_are_clusters_that_stand_still() {
    let clip = boxes(8, 50);
    let each = clip.vertices as u32 / 4;
    let analysis = clip.analysis(&uniform(4, 16));
    let labels = analysis.labels();
    let first: Vec<u32> = (0..4).map(|k| labels[k * each as usize]).collect();
    for (v, label) in labels.iter().enumerate() {
        assert_eq!(*label, first[v / each as usize], "vertex {v}");
    }
    let mut four = first.clone();
    four.sort_unstable();
    assert_eq!(four, [0, 1, 2, 3]);
    // With the corners as they are, one mode is all there is.
    for k in 0..4u32 {
        let corners = analysis.layout.corners[first[k as usize] as usize];
        let trajectories = clip.trajectories();
        let at = |f: usize| corners.map(|v| position(&trajectories, f, v));
        let poses = Pose::follow((0..clip.frames()).map(at));
        let row = |v: u32, axis: usize| {
            let local = |f| poses[f as usize].local(position(&trajectories, f as usize, v))[axis];
            (0..clip.frames() as u32).map(local).collect::<Vec<f64>>()
        };
        let rows = (k * each..(k + 1) * each).flat_map(|v| (0..3).flat_map(move |a| row(v, a)));
        let matrix = Matrix {
            values: rows.collect(),
            frames: clip.frames(),
        };
        let modes = Modes::of(&matrix, 3);
        let second = modes.sigmas.get(1).copied().unwrap_or(0.0);
        assert!(second <= 1e-12 * modes.sigmas[0], "{:?}", modes.sigmas);
    }
}

#[test]
fn small_triangles_tremble_and_seven_components_hold_what_trembles() {
    let clip = boxes(8, 50);
    let error = |frame, components| {
        let params = Params {
            frame,
            ..uniform(4, 16)
        };
        let made = clip
            .analysis(&params)
            .encode(Goal::Components(components))
            .unwrap();
        clip.kg(made.squared_error)
    };
    let (wide, seed) = (error(Frame::Wide, 1), error(Frame::Seed, 1));
    assert!(wide <= 0.02, "{wide}");
    assert!(seed > 2.0 * wide, "{seed} {wide}");
    let (wide, seed) = (error(Frame::Wide, 7), error(Frame::Seed, 7));
    assert!(wide < 5e-3 && seed < 5e-3, "{wide} {seed}");
    let whole = Params {
        space: Space::Whole,
        ..params(1, 16)
    };
    let analysis = clip.analysis(&params(4, 16));
    let made = analysis.encode(Goal::Components(1)).unwrap();
    let budget = Goal::Bits(made.bits_taken());
    let other = clip.analysis(&whole).encode(budget).unwrap();
    assert!(other.squared_error > 400.0 * made.squared_error);
}

#[test]
fn what_components_leave_is_what_singular_values_say() {
    for (clip, clusters) in [(sheet(40), 5), (boxes(3, 30), 4)] {
        let analysis = clip.analysis(&params(clusters, 12));
        let modes = analysis.modes(0);
        for components in [1, 2, 5, 20] {
            let (mut measured, mut foretold) = (0.0, 0.0);
            for (i, modes) in modes.iter().enumerate() {
                let (matrix, poses) = (&analysis.matrices[i], analysis.layout.poses(i));
                let held = components.min(modes.sigmas.len());
                foretold += modes.rest + modes.sigmas[held..].iter().map(|s| s * s).sum::<f64>();
                let columns = &modes.columns[..held];
                let rows: Vec<Vec<f64>> = columns.iter().map(|c| matrix.onto(c)).collect();
                let vertices = &analysis.layout.groups[i].vertices;
                for (f, pose) in poses.iter().enumerate() {
                    for (rank, v) in vertices.iter().enumerate() {
                        let local = std::array::from_fn(|axis| {
                            let at = axis * vertices.len() + rank;
                            columns.iter().zip(&rows).map(|(c, r)| c[at] * r[f]).sum()
                        });
                        let apart = sub(
                            pose.world(local),
                            clip.positions[f * clip.vertices + *v as usize],
                        );
                        measured += dot(apart, apart);
                    }
                }
            }
            let (measured, foretold) = (clip.kg(measured), clip.kg(foretold));
            let allowed = 1e-6 * foretold + 1e-12;
            assert!(
                (measured - foretold).abs() < allowed,
                "{components}: {measured} {foretold}"
            );
        }
    }
}

#[test]
fn a_decoder_gets_what_the_encoder_says() {
    let clip = sheet(30);
    let goals = [
        Goal::Components(4),
        Goal::SquaredError(0.05),
        Goal::Bits(30_000.0),
    ];
    for space in [Space::Relative, Space::World, Space::Whole] {
        for rounding in [Rounding::Balanced, Rounding::Ranges] {
            for (allocate, goal) in [Allocate::RateDistortion, Allocate::Paper, Allocate::Uniform]
                .into_iter()
                .flat_map(|allocate| goals.map(|goal| (allocate, goal)))
            {
                let params = Params {
                    space,
                    rounding,
                    allocate,
                    ..params(4, 13)
                };
                let made = clip.analysis(&params).encode(goal).unwrap();
                let measured = clip.measured(&made, made.parts.len());
                let said = made.squared_error;
                assert!((measured / said - 1.0).abs() < 1e-6, "{params:?} {goal:?}");
                match goal {
                    Goal::SquaredError(wanted) if rounding == Rounding::Balanced => {
                        assert!(said <= wanted, "{params:?} {goal:?}: {said}");
                    }
                    Goal::SquaredError(wanted) => {
                        let foretold = made.predicted_squared_error;
                        assert!(foretold <= 1.001 * wanted, "{params:?}: {foretold}");
                    }
                    Goal::Bits(wanted) => assert!(made.bits_taken() <= wanted, "{params:?}"),
                    Goal::Components(_) => {}
                }
                let counted = made.label_bits
                    + made.seed_bits
                    + made.range_bits
                    + made.basis_bits
                    + made.coefficient_bits;
                let slack = 100.0 + 80.0 * made.parts.len() as f64;
                assert!(
                    (made.bits_taken() - counted).abs() < slack,
                    "{params:?} {goal:?}"
                );
            }
        }
    }
}

#[test]
fn errors_do_not_grow_with_time_and_corners_do_not_enter() {
    let clip = sheet(80);
    let errors = |seed_bits: u32| {
        let params = Params {
            seed_bits,
            ..uniform(4, 17)
        };
        let analysis = clip.analysis(&params);
        let made = analysis.encode(Goal::Components(200)).unwrap();
        let out = clip.decode(&made.window, &made.parts);
        let corners: Vec<u32> = analysis.layout.corners.iter().flatten().copied().collect();
        let error = |f: usize| -> f64 {
            let all = (0..clip.vertices).filter(|v| !corners.contains(&(*v as u32)));
            all.map(|v| {
                let apart = sub(
                    out[f * clip.vertices + v],
                    clip.positions[f * clip.vertices + v],
                );
                dot(apart, apart)
            })
            .sum()
        };
        (0..clip.frames()).map(error).collect::<Vec<f64>>()
    };
    let (coarse, fine) = (errors(12), errors(16));
    let ratio = (coarse.iter().sum::<f64>() / fine.iter().sum::<f64>()).sqrt();
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    // The slope of the logarithm of the error against the frame.
    let n = fine.len() as f64;
    let (mut above, mut below) = (0.0, 0.0);
    for (f, e) in fine.iter().enumerate() {
        let t = f as f64 - (n - 1.0) / 2.0;
        above += t * 0.5 * e.ln();
        below += t * t;
    }
    assert!((above / below).abs() < 1e-3, "{}", above / below);
}

#[test]
fn rounding_adds_what_is_foretold() {
    let clip = sheet(40);
    for rounding in [Rounding::Balanced, Rounding::Ranges] {
        for bits in 8..=16 {
            let params = Params {
                rounding,
                seed_bits: 18,
                ..uniform(4, bits)
            };
            let made = clip.analysis(&params).encode(Goal::Components(3)).unwrap();
            let added = made.squared_error - made.truncation_squared_error;
            let foretold = made.predicted_squared_error - made.truncation_squared_error;
            let ratio = added / foretold;
            assert!(ratio > 0.5 && ratio < 2.0, "{rounding:?} {bits}: {ratio}");
        }
    }
}

#[test]
fn more_is_never_worse() {
    let clip = sheet(30);
    for rounding in [Rounding::Balanced, Rounding::Ranges] {
        let params = Params {
            rounding,
            ..uniform(3, 15)
        };
        let analysis = clip.analysis(&params);
        let made: Vec<Encoded> = (1..=10)
            .map(|l| analysis.encode(Goal::Components(l)).unwrap())
            .collect();
        for pair in made.windows(2) {
            assert!(pair[1].squared_error < pair[0].squared_error);
            assert!(pair[1].bits_taken() > pair[0].bits_taken());
        }
    }
    let analysis = clip.analysis(&Params {
        bits: None,
        ..params(3, 12)
    });
    let mut last = f64::INFINITY;
    for bits in [15e3, 20e3, 30e3, 50e3, 90e3] {
        let made = analysis.encode(Goal::Bits(bits)).unwrap();
        assert!(made.bits_taken() <= bits && made.bits_taken() > 0.9 * bits);
        assert!(made.squared_error < last);
        last = made.squared_error;
    }
}

#[test]
fn shares_that_follow_the_error_are_better_than_equal_ones() {
    // A part that is rigid and one that is not.
    let mesh = shapes::sheet(4.0, 1.0, 33, 9);
    let clip = Clip::new(&mesh, 40, |f, _, p| {
        let t = 0.15 * f as f64;
        let soft = (p[0] - 0.9).max(0.0);
        let wave = soft * 0.3 * (4.0 * p[0] - 2.0 * t).sin() * (1.0 + 0.3 * (3.0 * p[1] + t).sin());
        turn(add(p, [0.0, 0.0, wave]), [0.2, 1.0, 0.5], 0.3 * t)
    });
    let error = |allocate, bits| {
        let params = Params {
            allocate,
            ..params(6, 14)
        };
        clip.analysis(&params)
            .encode(Goal::Bits(bits))
            .unwrap()
            .squared_error
    };
    for bits in [24e3, 27e3, 30e3] {
        let (ours, paper, even) = (
            error(Allocate::RateDistortion, bits),
            error(Allocate::Paper, bits),
            error(Allocate::Uniform, bits),
        );
        let most = if bits == 30e3 { 0.8 } else { 1.001 };
        assert!(
            ours < most * even && ours < 1.05 * paper,
            "{ours} {paper} {even}"
        );
    }
}

#[test]
fn a_stream_that_ends_early_is_coarser() {
    let clip = sheet(60);
    let made = clip
        .analysis(&params(4, 18))
        .encode(Goal::SquaredError(1e-3))
        .unwrap();
    assert!(made.parts.len() >= 4, "{}", made.parts.len());
    let errors: Vec<f64> = (0..=made.parts.len())
        .map(|n| clip.measured(&made, n))
        .collect();
    assert!(
        errors.windows(2).all(|pair| pair[1] < pair[0]),
        "{errors:?}"
    );
}

#[test]
fn a_goal_below_the_floor_names_it() {
    let clip = sheet(20);
    let analysis = clip.analysis(&params(3, 8));
    let floor = analysis.encode(Goal::SquaredError(1e-6)).unwrap_err();
    assert!(floor.squared_error > 1e-6);
    let bits = floor.bits.unwrap();
    assert!(bits > 8);
    let made = clip
        .analysis(&params(3, bits))
        .encode(Goal::SquaredError(1e-6));
    assert!(made.unwrap().squared_error <= 1e-6);
    let free = Params {
        bits: None,
        ..params(3, 8)
    };
    let made = clip
        .analysis(&free)
        .encode(Goal::SquaredError(1e-6))
        .unwrap();
    assert!(made.squared_error <= 1e-6 && made.bits <= f64::from(bits) + 1.0);
    // No bits of columns and rows help against points that are too coarse.
    let coarse = Params {
        seed_bits: 4,
        ..free
    };
    let floor = clip
        .analysis(&coarse)
        .encode(Goal::SquaredError(1e-6))
        .unwrap_err();
    assert!(floor.bits.is_none() && floor.seed_squared_error > 1e-6);
}

#[test]
fn threads_do_not_change_a_byte() {
    let clip = sheet(30);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let free = Params {
                bits: None,
                ..params(4, 12)
            };
            let made = clip
                .analysis(&free)
                .encode(Goal::SquaredError(0.01))
                .unwrap();
            (made.window, made.parts)
        })
    };
    assert_eq!(on(1), on(7));
}

#[test]
fn damaged_bytes_are_read_or_refused() {
    let clip = sheet(12);
    let mut rng = Rng::new(11, 0);
    for rounding in [Rounding::Balanced, Rounding::Ranges] {
        let params = Params {
            rounding,
            ..params(3, 10)
        };
        let made = clip.analysis(&params).encode(Goal::Components(3)).unwrap();
        let mut refused = 0;
        for _ in 0..150 {
            let mut window = made.window.clone();
            let mut parts = made.parts.clone();
            for _ in 0..1 + rng.below(3) {
                let bit = 1 << rng.below(8);
                if rng.below(2) == 0 {
                    let at = rng.below(window.len());
                    window[at] ^= bit;
                } else {
                    let at = rng.below(parts[0].len());
                    parts[0][at] ^= bit;
                }
            }
            if rng.below(4) == 0 {
                window.truncate(rng.below(window.len()));
            }
            let parts: Vec<&[u8]> = parts.iter().map(Vec::as_slice).collect();
            match decode(&clip.hierarchy, 12, &window, &parts) {
                Ok(decoded) => {
                    let mut out = vec![[0.0; 3]; clip.vertices];
                    (0..12).for_each(|f| decoded.frame(f, &mut out));
                }
                Err(_) => refused += 1,
            }
        }
        assert!(refused > 0);
    }
    assert!(decode(&clip.hierarchy, 12, &[], &[]).is_err());
}

#[test]
fn clips_of_nothing_much_come_back() {
    let points = |points: &[Vec3]| Mesh {
        positions: points.to_vec(),
        ..Mesh::default()
    };
    let triangle = Mesh::from_triangles(
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2]],
    );
    let line: Vec<Vec3> = (0..9)
        .map(|i| [f64::from(i), 2.0 * f64::from(i), 0.0])
        .collect();
    let fly = |f: usize, _: usize, p: Vec3| add(p, [0.1 * f as f64, 0.02 * (f * f) as f64, 0.0]);
    let still = |_: usize, _: usize, p: Vec3| p;
    let flat = |f: usize, v: usize, p: Vec3| {
        // At one frame all vertices lie on one line.
        if f == 2 {
            [p[0], 0.0, 0.0]
        } else {
            add(p, [0.0, 0.0, 0.01 * (f * v) as f64])
        }
    };
    let sphere = shapes::icosphere([0.0; 3], 1.0, 2);
    let clips = [
        ("one point", Clip::new(&points(&[[1.0, 2.0, 3.0]]), 5, fly)),
        (
            "two points",
            Clip::new(&points(&[[0.0; 3], [1.0; 3]]), 5, fly),
        ),
        ("three in a line", Clip::new(&points(&line[..3]), 5, fly)),
        ("a line", Clip::new(&points(&line), 7, fly)),
        (
            "all in one point",
            Clip::new(&points(&[[5.0; 3]; 8]), 4, still),
        ),
        (
            "all in one point that flies",
            Clip::new(&points(&[[5.0; 3]; 8]), 4, fly),
        ),
        ("a triangle", Clip::new(&triangle, 6, fly)),
        ("one frame", Clip::new(&sphere, 1, still)),
        ("two frames", Clip::new(&sphere, 2, fly)),
        ("still", Clip::new(&sphere, 9, still)),
        ("flat at one frame", Clip::new(&sphere, 5, flat)),
        ("a cloud", Clip::new(&points(&sphere.positions), 6, fly)),
    ];
    for (name, clip) in &clips {
        for space in [Space::Relative, Space::World, Space::Whole] {
            for rounding in [Rounding::Balanced, Rounding::Ranges] {
                for allocate in [Allocate::RateDistortion, Allocate::Paper, Allocate::Uniform] {
                    let params = Params {
                        space,
                        rounding,
                        allocate,
                        ..params(6, 14)
                    };
                    let made = clip.analysis(&params).encode(Goal::Components(50)).unwrap();
                    let measured = clip.measured(&made, made.parts.len());
                    let side = bounds(&clip.trajectories()).1;
                    let each = (measured / clip.positions.len() as f64).sqrt();
                    assert!(each <= 2e-3 * side, "{name} {params:?}: {each} of {side}");
                    assert!(
                        (measured - made.squared_error).abs() <= 1e-6 * measured + 1e-18,
                        "{name}"
                    );
                    let few = clip.analysis(&params).encode(Goal::Bits(10.0)).unwrap();
                    clip.measured(&few, few.parts.len());
                }
            }
        }
    }
    // A part that stands still costs next to nothing more with time.
    let bits = |frames| {
        let clip = Clip::new(&sphere, frames, still);
        clip.analysis(&params(2, 12))
            .encode(Goal::Components(1))
            .unwrap()
            .bits_taken()
    };
    assert!(bits(200) < 1.3 * bits(20), "{} {}", bits(200), bits(20));
}

#[test]
fn sizes_and_places_far_off_change_little() {
    let clip = sheet(20);
    let reached = |size: f64, away: f64| {
        let mut moved = sheet(20);
        let origin = [away; 3];
        for p in &mut moved.positions {
            *p = std::array::from_fn(|i| p[i] * size + away);
        }
        let trajectories = Trajectories {
            origin,
            ..moved.trajectories()
        };
        let analysis = Analysis::new(
            trajectories,
            &moved.triangles,
            &moved.hierarchy,
            &params(4, 12),
        );
        let made = analysis.unwrap().encode(Goal::Components(4)).unwrap();
        (made.bits_taken(), made.squared_error.sqrt() / size)
    };
    let (bits, error) = reached(1.0, 0.0);
    assert!(clip.kg(error * error) < 2.0);
    for (size, away) in [(1e-6, 0.0), (1e6, 0.0), (2f64.powi(40), 0.0), (1.0, 1e7)] {
        let (other, off) = reached(size, away);
        assert!(
            (other / bits - 1.0).abs() < 0.02,
            "{size} {away}: {other} {bits}"
        );
        assert!(
            (off / error - 1.0).abs() < 0.02,
            "{size} {away}: {off} {error}"
        );
    }
}

#[test]
fn clusters_that_cannot_be_had_are_fewer() {
    let clip = boxes(2, 10);
    let analysis = clip.analysis(&params(500, 12));
    assert!(analysis.clusters() < 500 && analysis.clusters() > 4);
    assert!(3 * analysis.clusters() <= clip.vertices);
    assert!(!analysis.is_without_frames());
    assert!(
        Params {
            clusters: 0,
            ..Params::DEFAULT
        }
        .check()
        .is_err()
    );
    assert!(
        Params {
            bits: Some(40),
            ..Params::DEFAULT
        }
        .check()
        .is_err()
    );
    assert!(
        Params {
            seed_bits: 1,
            ..Params::DEFAULT
        }
        .check()
        .is_err()
    );
}
