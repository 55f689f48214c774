//! Streams as a whole: what goes in comes out, as far off as was asked for.

use super::*;
use crate::mesh::{Mesh, shapes};
use crate::numeric::rng::Rng;
use crate::numeric::vector::Vec3;
use crate::progress::Silent;

/// A clip of a mesh whose vertices go where a function of vertex and frame says.
fn clip_of(mesh: &Mesh, frames: usize, place: impl Fn(Vec3, usize) -> Vec3) -> Clip {
    let positions: Vec<Vec3> = (0..frames)
        .flat_map(|f| mesh.positions.iter().map(move |p| (*p, f)))
        .map(|(p, f)| place(p, f))
        .collect();
    let mut mesh = mesh.clone();
    mesh.positions = positions[..mesh.positions.len()].to_vec();
    Clip {
        mesh,
        positions,
        start: 0.5,
        rate: 25.0,
    }
}

/// A sphere that travels, bends and beats.
fn swimmer(frames: usize) -> Clip {
    let mesh = shapes::icosphere([0.0; 3], 1.0, 3);
    clip_of(&mesh, frames, |[x, y, z], f| {
        let t = f as f64 * 0.3;
        let bend = 0.5 * (t + 2.0 * x).sin();
        let beat = 1.0 + 0.1 * (3.0 * t).cos();
        [x + 0.05 * t, y * beat + bend, z * beat]
    })
}

fn params(method: Method, target: Target) -> Params {
    Params {
        method,
        target,
        ..Params::DEFAULT
    }
}

fn made(clip: &Clip, params: &Params) -> Made {
    let ground = Ground::new(&clip.mesh).expect("a ground");
    let encoder = Encoder::new(clip, &ground, params, &Silent).expect("an encoder");
    encoder.make(params.target, &Silent).expect("a stream")
}

fn decoded(bytes: &[u8]) -> Clip {
    let stream = Stream::open(bytes, None).expect("a stream");
    let frames = stream.header().frames;
    stream.clip(0..frames).expect("a clip")
}

/// The squared error, and the largest distance.
fn errors(clip: &Clip, other: &Clip) -> (f64, f64) {
    let apart = clip.positions.iter().zip(&other.positions);
    let apart = apart.map(|(p, q)| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>());
    apart.fold((0.0, 0.0), |(sum, most), x| {
        (sum + x, f64::max(most, x.sqrt()))
    })
}

/// The error of Karni and Gotsman about the centroids, in percent.
fn kg(clip: &Clip, other: &Clip) -> f64 {
    let norm: f64 = (0..clip.frames())
        .map(|f| {
            let frame = clip.frame(f);
            (0..3)
                .map(|i| {
                    let mean = frame.iter().map(|p| p[i]).sum::<f64>() / frame.len() as f64;
                    frame.iter().map(|p| (p[i] - mean).powi(2)).sum::<f64>()
                })
                .sum::<f64>()
        })
        .sum();
    100.0 * (errors(clip, other).0 / norm).sqrt()
}

#[test]
fn every_target_is_met_and_not_by_far() {
    let clip = swimmer(30);
    for method in [Method::Trajectory, Method::Delta] {
        for percent in [2.0, 0.1, 0.001] {
            let made = made(&clip, &params(method, Target::Kg(percent)));
            let back = decoded(&made.bytes);
            let reached = kg(&clip, &back);
            // Where components are few, one more or less is a jump.
            let least = if percent < 1.0 { 0.97 } else { 0.7 } * percent;
            assert!(
                reached <= percent && reached > least,
                "{percent}: {reached}"
            );
            // What the encoder expects is what a decoder gets.
            let (squared, _) = errors(&clip, &back);
            let expected = made.stats.predicted_squared_error;
            assert!(
                (squared / expected - 1.0).abs() < 1e-6,
                "{squared} {expected}"
            );
            assert_eq!(back.mesh.triangles, clip.mesh.triangles);
            assert_eq!((back.start, back.rate), (clip.start, clip.rate));
        }
        let count = clip.positions.len() as f64;
        let rmse = made(&clip, &params(method, Target::Rmse(1e-3)));
        let (squared, _) = errors(&clip, &decoded(&rmse.bytes));
        let reached = (squared / count).sqrt();
        assert!(reached <= 1e-3 && reached > 0.97e-3);
        let bound = made(&clip, &params(method, Target::Max(2e-3)));
        let (_, most) = errors(&clip, &decoded(&bound.bytes));
        assert!(most <= 2e-3 && most > 1e-3, "{most}");
        let bits = made(&clip, &params(method, Target::Bpvf(6.0)));
        let geometry = bits.stats.bits.total - bits.stats.bits.faces;
        assert!(
            geometry <= 6.0 * count && geometry > 5.2 * count,
            "{}",
            geometry / count
        );
    }
}

#[test]
fn what_cannot_be_reached_names_the_least() {
    let clip = swimmer(8);
    let ground = Ground::new(&clip.mesh).unwrap();
    let encoder = Encoder::new(&clip, &ground, &Params::DEFAULT, &Silent).unwrap();
    for target in [Target::Bpvf(0.01), Target::Kg(1e-13)] {
        let said = encoder
            .make(target, &Silent)
            .expect_err("an error")
            .to_string();
        assert!(said.contains("cannot be reached; the least"), "{said}");
    }
    let nothing = Params {
        target: Target::Kg(0.0),
        ..Params::DEFAULT
    };
    assert!(Encoder::new(&clip, &ground, &nothing, &Silent).is_err());
}

#[test]
fn bits_are_counted_by_what_they_tell() {
    let clip = swimmer(30);
    let made = made(&clip, &params(Method::Auto, Target::Kg(0.1)));
    let bits = made.stats.bits;
    assert_eq!(bits.total, 8.0 * made.bytes.len() as f64);
    assert!((bits.told() + bits.framing - bits.total).abs() < 1e-6 * bits.total);
    // Framing is what heads, lengths, checksums and ends of sections take, and no more.
    let sections = summary(&made.bytes).unwrap().sections;
    let count: u64 = sections.iter().map(|s| s.count).sum();
    assert!(
        bits.framing > 0.0 && bits.framing < 1000.0 + 160.0 * count as f64,
        "{bits:?}"
    );
}

#[test]
fn rigid_parts_and_still_ones_take_few_components() {
    // Four balls, each on a way of its own: three numbers of place and three of turn each.
    let mut mesh = Mesh::default();
    let mut rng = Rng::new(1, 0);
    for i in 0..4 {
        let ball = shapes::icosphere([3.0 * f64::from(i), 0.0, 0.0], 1.0, 2);
        mesh.append(&ball).unwrap();
    }
    let each = mesh.positions.len() / 4;
    let axes: Vec<f64> = (0..4).map(|_| rng.range(0.1, 0.3)).collect();
    let centre = |i: usize| [3.0 * i as f64, 0.0, 0.0];
    let mut clip = clip_of(&mesh, 60, |p, _| p);
    for (at, p) in clip.positions.iter_mut().enumerate() {
        let (f, i) = (at / (4 * each), at % (4 * each) / each);
        let (c, angle) = (centre(i), axes[i] * f as f64);
        let (sin, cos) = angle.sin_cos();
        let [x, y, z] = [p[0] - c[0], p[1], p[2]];
        *p = [c[0] + cos * x - sin * y, sin * x + cos * y + angle, z];
    }
    let moving = made(&clip, &params(Method::Trajectory, Target::Kg(0.05)));
    assert!(
        moving.stats.components[0] <= 16,
        "{:?}",
        moving.stats.components
    );
    let still = clip_of(&mesh, 60, |p, _| p);
    let held = made(&still, &params(Method::Auto, Target::Kg(0.05)));
    assert_eq!(held.stats.components.iter().sum::<u64>(), 0);
    let moving_bits = moving.stats.bits.total - moving.stats.bits.faces;
    let held_bits = held.stats.bits.total - held.stats.bits.faces;
    assert!(held_bits < 0.7 * moving_bits, "{held_bits} {moving_bits}");
}

#[test]
fn any_range_of_frames_is_that_of_the_whole() {
    let clip = swimmer(50);
    for (method, target) in [
        (Method::Trajectory, Target::Kg(0.1)),
        (Method::Delta, Target::Kg(0.1)),
        (Method::Trajectory, Target::Max(1e-2)),
    ] {
        let made = made(
            &clip,
            &Params {
                window: 16,
                ..params(method, target)
            },
        );
        assert_eq!(made.stats.windows, 4);
        let whole = decoded(&made.bytes);
        for range in [0..50, 0..1, 15..17, 20..21, 33..50, 49..50] {
            let stream = Stream::open(&made.bytes, Some(range.clone())).unwrap();
            let part = stream.clip(range.clone()).unwrap();
            for (i, f) in range.clone().enumerate() {
                assert_eq!(
                    part.frame(i),
                    whole.frame(f),
                    "{method:?} {range:?} frame {f}"
                );
            }
            assert_eq!(part.start, clip.start + range.start as f64 / clip.rate);
        }
        for range in [0..51, 3..3, 60..70] {
            assert!(Stream::open(&made.bytes, Some(range)).is_err());
        }
    }
}

#[test]
fn a_cut_stream_is_coarser_the_shorter_it_is() {
    let clip = swimmer(60);
    let made = made(&clip, &params(Method::Trajectory, Target::Kg(1e-5)));
    let mut ends = Vec::new();
    let mut at = container::MAGIC.len() + 1;
    for section in container::parse(&made.bytes).unwrap().list {
        at += section.whole;
        ends.push(at);
    }
    assert!(ends.len() >= 5, "{ends:?}");
    let mut last = f64::INFINITY;
    // Header, faces and the mean shape have to be there.
    for end in &ends[2..] {
        for more in [0, 3] {
            let stream = Stream::open(&made.bytes[..end + more], None).unwrap();
            assert_eq!(stream.cut_off_at(), Some(*end));
            let reached = kg(&clip, &stream.clip(0..60).unwrap());
            assert!(reached <= last, "{reached} after {last}");
            last = reached;
        }
    }
    assert!(last <= 1e-5);
    for end in [3, 6, 20, ends[0], ends[1]] {
        let said = Stream::open(&made.bytes[..end], None).expect_err("an error");
        assert!(!said.problem.is_empty());
    }
}

#[test]
fn every_flipped_byte_is_refused() {
    let clip = swimmer(6);
    for target in [Target::Kg(1.0), Target::Max(0.02)] {
        let made = made(&clip, &params(Method::Auto, target));
        for at in 0..made.bytes.len() {
            let mut damaged = made.bytes.clone();
            damaged[at] ^= 1 << (at % 8);
            assert!(Stream::open(&damaged, None).is_err(), "byte {at}");
        }
    }
}

#[test]
fn noise_in_sections_is_read_without_a_panic() {
    // With sound checksums, as no accident makes it.
    let clip = swimmer(6);
    let mut rng = Rng::new(8, 0);
    for method in [Method::Trajectory, Method::Delta] {
        let whole = made(&clip, &params(method, Target::Max(0.01)));
        let sections = container::parse(&whole.bytes).unwrap().list;
        for _ in 0..200 {
            let mut bytes = container::begin();
            let broken = rng.below(sections.len());
            for (i, section) in sections.iter().enumerate() {
                let mut payload = section.payload.to_vec();
                if i == broken {
                    for _ in 0..1 + rng.below(4) {
                        let at = rng.below(payload.len());
                        payload[at] = rng.below(256) as u8;
                    }
                    payload.truncate(1 + rng.below(payload.len()));
                }
                container::push(&mut bytes, section.kind, &payload);
            }
            container::push(&mut bytes, container::Kind::End, &[]);
            // A header of very many vertices is what the limit of memory is for.
            if summary(&bytes).is_ok_and(|told| room_to_decode(&told, 6) < 1 << 24)
                && let Ok(stream) = Stream::open(&bytes, None)
            {
                let frames = stream.header().frames.min(10);
                let _ = stream.each_frame(0..frames, |_, _| {});
            }
        }
    }
}

#[test]
fn odd_clips_come_back_too() {
    let sheet = shapes::sheet(1.0, 1.0, 6, 6);
    let cloud = |count: usize| Mesh {
        positions: (0..count)
            .map(|i| [i as f64, (i * i % 7) as f64, 0.5])
            .collect(),
        points: (0..count as u32).collect(),
        ..Mesh::default()
    };
    let sway = |p: Vec3, f: usize| [p[0] + (f as f64).sin(), p[1], p[2] * f as f64];
    let mut loose = sheet.clone();
    loose.positions.extend([[5.0; 3], [-5.0, 0.0, 1.0]]);
    let clips = [
        ("one frame", clip_of(&sheet, 1, |p, _| p)),
        ("two frames", clip_of(&sheet, 2, sway)),
        ("one vertex", clip_of(&cloud(1), 9, sway)),
        ("two vertices", clip_of(&cloud(2), 9, sway)),
        ("a cloud", clip_of(&cloud(50), 9, sway)),
        ("vertices no face uses", clip_of(&loose, 9, sway)),
        (
            "all at one place",
            clip_of(&sheet, 9, |_, _| [3.0, 2.0, 1.0]),
        ),
        (
            "a point that moves",
            clip_of(&sheet, 9, |_, f| [f as f64; 3]),
        ),
        (
            "flat",
            clip_of(&sheet, 9, |p, f| [p[0] * f as f64, 0.0, 0.0]),
        ),
        ("noise", {
            let rng = std::cell::RefCell::new(Rng::new(2, 2));
            clip_of(&sheet, 9, move |_, _| {
                std::array::from_fn(|_| rng.borrow_mut().unit())
            })
        }),
    ];
    for (name, clip) in clips {
        for method in [Method::Auto, Method::Trajectory, Method::Delta] {
            for target in [Target::Kg(0.1), Target::Max(1e-3), Target::Rmse(1e-3)] {
                let ground = Ground::new(&clip.mesh).unwrap();
                let params = params(method, target);
                let encoder = Encoder::new(&clip, &ground, &params, &Silent).unwrap();
                let made = encoder.make(target, &Silent);
                let made = made.unwrap_or_else(|e| panic!("{name} {method:?} {target:?}: {e}"));
                let back = decoded(&made.bytes);
                assert_eq!(back.mesh.triangles, clip.mesh.triangles, "{name}");
                assert_eq!(back.mesh.points, clip.mesh.points, "{name}");
                let (squared, most) = errors(&clip, &back);
                let rmse = (squared / clip.positions.len() as f64).sqrt();
                let held = match target {
                    Target::Max(bound) => most <= bound,
                    Target::Rmse(bound) => rmse <= bound,
                    // Points that move have no share; they are within one of their way.
                    _ => kg(&clip, &back) <= 0.1 || rmse <= 1e-3 * 8.0,
                };
                assert!(held, "{name} {method:?} {target:?}: {rmse} {most}");
            }
        }
    }
}

#[test]
fn size_and_place_change_only_the_header() {
    let clip = swimmer(12);
    let grid = |x: f64| (x * 2f64.powi(20)).round() / 2f64.powi(20);
    let moved = |scale: f64, shift: f64| Clip {
        positions: clip
            .positions
            .iter()
            .map(|p| p.map(|x| grid(x) * scale + shift))
            .collect(),
        ..clip.clone()
    };
    let told = |clip: &Clip| {
        let mut clip = clip.clone();
        clip.mesh.positions = clip.frame(0).to_vec();
        let made = made(&clip, &params(Method::Auto, Target::Kg(0.1)));
        let sections = container::parse(&made.bytes).unwrap();
        let rest: Vec<Vec<u8>> = sections.list[1..]
            .iter()
            .map(|s| s.payload.to_vec())
            .collect();
        (rest, made.bytes)
    };
    let (base, _) = told(&moved(1.0, 0.0));
    for exponent in [-100, -30, 7, 100] {
        let (other, bytes) = told(&moved(2f64.powi(exponent), 0.0));
        assert_eq!(other, base, "2^{exponent}");
        let reached = kg(&moved(2f64.powi(exponent), 0.0), &decoded(&bytes));
        assert!(reached <= 0.1 && reached > 0.09, "{reached}");
    }
    for shift in [1.0, -1024.0, 2f64.powi(30)] {
        assert_eq!(told(&moved(1.0, shift)).0, base, "{shift}");
    }
    for extreme in [1e-30, 1e30] {
        let clip = moved(extreme, 0.0);
        let reached = kg(
            &clip,
            &decoded(&made(&clip, &params(Method::Auto, Target::Kg(0.1))).bytes),
        );
        assert!(reached <= 0.1 && reached > 0.09, "{reached}");
    }
}

#[test]
fn streams_are_the_same_on_any_number_of_threads() {
    let clip = swimmer(40);
    let bytes: Vec<Vec<u8>> = [1, 2, 5]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| made(&clip, &params(Method::Auto, Target::Kg(0.05))).bytes)
        })
        .collect();
    assert!(bytes.windows(2).all(|w| w[0] == w[1]));
}

#[test]
fn the_shorter_method_is_taken() {
    let clip = swimmer(40);
    let length = |clip: &Clip, method| {
        let made = made(clip, &params(method, Target::Kg(0.1)));
        (made.bytes.len(), made.stats.method)
    };
    let (auto, name) = length(&clip, Method::Auto);
    assert_eq!(name, "trajectory");
    assert!(auto < length(&clip, Method::Delta).0);
    // Ten frames in which no two vertices and no two frames have anything in common.
    let mut rng = Rng::new(6, 0);
    let noise: Vec<Vec3> = (0..40)
        .map(|_| std::array::from_fn(|_| rng.unit()))
        .collect();
    let mesh = shapes::sheet(1.0, 1.0, 3, 3);
    let rng = std::cell::RefCell::new(rng);
    let clip = clip_of(&mesh, 100, |_, f| {
        noise[f % 40].map(|x| x + rng.borrow_mut().unit())
    });
    let (auto, _) = length(&clip, Method::Auto);
    let least = length(&clip, Method::Delta)
        .0
        .min(length(&clip, Method::Trajectory).0);
    assert!(auto <= least + least / 50, "{auto} {least}");
}
