mod diamond;
mod thin;

use super::*;
use crate::numeric::vector::{cross, dot, length, normalize, sub};
use crate::progress::Silent;
use crate::volume::isosurface::{Border, Select, extract};
use crate::volume::{Data, Frame, Volume};

/// The voxels that are inside of a shape, told by their centres.
pub(super) fn shape(n: usize, inside: impl Fn(Vec3) -> bool) -> Volume {
    let mut v = Vec::new();
    for z in 0..n {
        for y in 0..n {
            for x in 0..n {
                v.push(u8::from(inside([x, y, z].map(|c| c as f64))));
            }
        }
    }
    Volume {
        frame: Frame::straight([n; 3], [0.0; 3], [1.0; 3]),
        data: Data::U8(v),
    }
}

pub(super) fn ball(radius: f64, n: usize, at: f64) -> Volume {
    shape(n, |p| {
        let d = p.map(|c| c - at);
        dot(d, d) <= radius * radius
    })
}

/// Root mean square of the angle between triangles and the surface of a shape, by area, in degrees.
///
/// `outward` is the direction of the shape's gradient at a point, of any length.
pub(super) fn normal_rms(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    outward: impl Fn(Vec3) -> Vec3,
) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for t in triangles {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let n = cross(sub(b, a), sub(c, a));
        let m = outward([0, 1, 2].map(|i| (a[i] + b[i] + c[i]) / 3.0));
        let size = length(n);
        if size > 0.0 {
            let cos = dot(normalize(n), normalize(m)).clamp(-1.0, 1.0);
            sum += size * cos.acos().to_degrees().powi(2);
            area += size;
        }
    }
    (sum / area).sqrt()
}

#[test]
fn a_ball_becomes_round_and_keeps_its_volume() {
    let centre = 42.623;
    let ball = ball(40.0, 86, centre);
    let surface = extract(&ball, &Select::Set, Border::Closed, &Silent).expect("a surface");
    let (offsets, triangles, stats) =
        smooth(&surface, None, [1.0; 3], &Params::DEFAULT, &Silent).expect("a smooth surface");
    let positions = surface.positions(&ball.frame, |v| offsets[v]);
    let rms = normal_rms(&positions, &triangles, |p| p.map(|c| c - centre));
    assert!(rms <= 3.0, "{rms}");
    let voxels = stats.voxels.expect("closed") as f64;
    assert_eq!(voxels, ball.count_set() as f64);
    let volume = stats.volume_after.expect("closed");
    assert!((volume / voxels - 1.0).abs() <= 1e-3, "{volume} {voxels}");
    assert!(stats.max_displacement <= 0.5);
}

#[test]
fn nothing_takes_no_steps() {
    let nothing = shape(4, |_| false);
    let surface = extract(&nothing, &Select::Set, Border::Closed, &Silent).expect("no surface");
    let mesh = crate::mesh::Mesh::default();
    for energy in [Energy::Laplacian, Energy::Bilaplacian] {
        let params = Params {
            energy,
            ..Params::DEFAULT
        };
        let (_, _, stats) =
            smooth(&surface, None, [1.0; 3], &params, &Silent).expect("nothing smooth");
        let (_, (_, _, of_net)) =
            smooth_net(&nothing, &Select::Set, Border::Closed, &params, &Silent).expect("no net");
        let (_, in_boxes) =
            smooth_in_boxes(&mesh, [1.0; 3], &params, &Silent).expect("nothing in boxes");
        for stats in [stats, of_net, in_boxes] {
            assert_eq!((stats.iterations, stats.stop_reason), (0, Stop::Still));
            assert_eq!((stats.turning_before_deg, stats.awake_share), (None, 0.0));
        }
    }
}

/// The ball is large enough for several runs of chunks where there are several threads.
#[test]
fn any_number_of_threads_smooths_alike() {
    let ball = ball(40.0, 86, 42.623);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            let surface = extract(&ball, &Select::Set, Border::Closed, &Silent).expect("a surface");
            smooth(&surface, None, [1.0, 1.0, 1.5], &Params::DEFAULT, &Silent).expect("it smooth")
        })
    };
    assert_eq!(on(1), on(3));
}
