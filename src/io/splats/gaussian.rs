//! The PLY of 3D Gaussians, as Kerbl, Kopanas, Leimkühler and Drettakis write it ("3D Gaussian splatting for
//! real-time radiance field rendering", 2023), of degree 0: what viewers of splats open.
//!
//! A disc of radius r is a Gaussian of standard deviation r / 2 along both axes of its plane, which is that
//! of points spread evenly over the disc, and of the deviation of heights spread evenly over its error
//! along the normal, at least a thousandth of the radius. All numbers are of single precision: centres far
//! from the origin are written relative to a place that a comment names.

use crate::error::{Fault, number};
use crate::io::ply::{self, Table};
use crate::io::source::Source;
use crate::io::text::{self, spill, words};
use crate::numeric::vector::{Vec3, add, cross, dot, scale, sub};
use crate::points::{Splat, Splats};
use crate::report::{Tally, Warning};
use std::io::{self, Write};

/// What a Gaussian must have, in the order in which it is written.
const NAMES: [&str; 17] = [
    "x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1",
    "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
];
/// The spherical harmonic of degree 0: a half of the square root of 1 / pi.
const HARMONIC: f64 = 0.282_094_791_773_878_14;
/// Half a step of eight bits: opacities of 0 and 1 are infinitely far away.
const EDGE: f64 = 1.0 / 510.0;
/// The least standard deviation of a disc along its normal, as a share of its radius.
const THINNEST: f64 = 1e-3;
/// What is told from a circle.
const ROUND: f64 = 1e-3;
/// The direction of a lamp at the left, in front and above, whether y or z is up.
const LAMP: Vec3 = [-2.0 / 7.0, 6.0 / 7.0, 3.0 / 7.0];
/// The comment that names the place of the origin.
const ORIGIN: &str = "origin";

/// Writes discs as Gaussians: position, normal, colour, opacity, scales and rotation.
///
/// Field, counts and classes have no place in it. Viewers have no light: discs without colours are grey
/// as a lamp at the upper left makes them, or nothing but an outline would be seen. Cost: linear.
pub fn write(splats: &Splats, out: &mut dyn Write) -> io::Result<()> {
    let origin = origin_of(splats);
    let mut bytes = header(splats, origin).into_bytes();
    for (i, splat) in splats.splats.iter().enumerate() {
        let color = splats
            .colors
            .as_ref()
            .map_or_else(|| lit(splat.normal), |colors| colors[i]);
        let [red, green, blue, alpha] = color.map(f64::from);
        let direct = [red, green, blue].map(|c| (c - 0.5) / HARMONIC);
        let alpha = alpha.clamp(EDGE, 1.0 - EDGE);
        let opacity = (alpha / (1.0 - alpha)).ln();
        let across = splat.radius / 2.0;
        let along = (splat.error / 3f64.sqrt()).max(splat.radius * THINNEST);
        let scales = [across, across, along].map(|deviation| deviation.max(f64::MIN_POSITIVE).ln());
        let turn = quaternion([splat.tangent, splat.bitangent(), splat.normal]);
        let place = sub(splat.centre, origin);
        let numbers = place.into_iter().chain(splat.normal).chain(direct);
        let numbers = numbers.chain([opacity]).chain(scales).chain(turn);
        numbers.for_each(|c| bytes.extend((c as f32).to_le_bytes()));
        spill(&mut bytes, out)?;
    }
    out.write_all(&bytes)
}

/// The grey of a surface under a lamp; its dark side is not black.
fn lit(normal: Vec3) -> [f32; 4] {
    let light = 0.5 + 0.5 * dot(normal, LAMP);
    let grey = (0.2 + 0.7 * light) as f32;
    [grey, grey, grey, 1.0]
}

fn header(splats: &Splats, origin: Vec3) -> String {
    let mut lines = vec![
        "ply".to_owned(),
        "format binary_little_endian 1.0".to_owned(),
        "comment written by scantle".to_owned(),
    ];
    if origin != [0.0; 3] {
        let [x, y, z] = origin.map(number);
        lines.push(format!("comment {ORIGIN} {x} {y} {z}"));
    }
    lines.push(format!("element vertex {}", splats.splats.len()));
    lines.extend(NAMES.map(|name| format!("property float {name}")));
    lines.push("end_header\n".to_owned());
    lines.join("\n")
}

/// What centres are written relative to: nothing, or the whole numbers next to their middle where they
/// are farther from the origin than four times as far as from each other.
fn origin_of(splats: &Splats) -> Vec3 {
    let bounds = splats.bounds();
    if bounds.is_empty() {
        return [0.0; 3];
    }
    let middle = scale(add(bounds.lo, bounds.hi), 0.5);
    let half = scale(sub(bounds.hi, bounds.lo), 0.5);
    let largest = |v: Vec3| v.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    if largest(middle) > 4.0 * largest(half) {
        middle.map(f64::round)
    } else {
        [0.0; 3]
    }
}

/// The rotation that takes the coordinate axes to these, which are of unit length and at right angles:
/// real part first. Source: Shepperd, "Quaternion from rotation matrix", 1978.
fn quaternion([u, v, n]: [Vec3; 3]) -> [f64; 4] {
    let squares = [
        1.0 + u[0] + v[1] + n[2],
        1.0 + u[0] - v[1] - n[2],
        1.0 - u[0] + v[1] - n[2],
        1.0 - u[0] - v[1] + n[2],
    ];
    let sums = [
        [squares[0], v[2] - n[1], n[0] - u[2], u[1] - v[0]],
        [v[2] - n[1], squares[1], u[1] + v[0], n[0] + u[2]],
        [n[0] - u[2], u[1] + v[0], squares[2], v[2] + n[1]],
        [u[1] - v[0], n[0] + u[2], v[2] + n[1], squares[3]],
    ];
    // The row of the largest square has no cancellation.
    let largest = (1..4).fold(
        0,
        |best, i| if squares[i] > squares[best] { i } else { best },
    );
    let row = sums[largest];
    let length = row.iter().map(|c| c * c).sum::<f64>().sqrt();
    row.map(|c| c / length)
}

/// The axes that a rotation takes the coordinate axes to; none where it is 0.
fn axes([w, x, y, z]: [f64; 4]) -> Option<[Vec3; 3]> {
    let norm = w * w + x * x + y * y + z * z;
    if !(norm > 0.0 && norm.is_finite()) {
        return None;
    }
    let s = 2.0 / norm;
    Some([
        [
            1.0 - s * (y * y + z * z),
            s * (x * y + w * z),
            s * (x * z - w * y),
        ],
        [
            s * (x * y - w * z),
            1.0 - s * (x * x + z * z),
            s * (y * z + w * x),
        ],
        [
            s * (x * z + w * y),
            s * (y * z - w * x),
            1.0 - s * (x * x + y * y),
        ],
    ])
}

/// Reads Gaussians as discs: across the shortest axis, with twice the smaller deviation of the other two for
/// a radius; a warning counts those that are no circle. The normal points to the side that `nx ny nz` does.
///
/// Errs with the place where the header lacks a property, the file ends early, a rotation is 0, and where
/// there is nothing at all. Cost: linear in the bytes.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Splats, Fault> {
    let table = ply::table(source, &NAMES, warnings)?;
    let is_needed = |name: &str| !["nx", "ny", "nz"].contains(&name);
    let columns = table.columns.iter().zip(NAMES);
    let missing = columns.filter(|(column, name)| column.is_none() && is_needed(name));
    if let Some((_, name)) = missing.into_iter().next() {
        let problem = format!("the vertex element has no property {name}");
        return Err(Fault::line(table.line, problem));
    }
    if table.rows == 0 {
        return Err(Fault::whole("holds no splats"));
    }
    let origin = stated_origin(&table);
    let mut splats = Splats::default();
    let (mut colors, mut flat) = (Vec::new(), Tally::default());
    for index in 0..table.rows {
        // Normals may not be there.
        let real = |column: usize| table.columns[column].as_ref().map_or(0.0, |all| all[index]);
        let triple = |first: usize| [real(first), real(first + 1), real(first + 2)];
        let Some(axes) = axes([real(13), real(14), real(15), real(16)]) else {
            let problem = "has a rotation that is 0 or not finite";
            return Err(Fault::element("splat", index, problem));
        };
        let gaussian = Gaussian {
            centre: add(triple(0), origin),
            normal: triple(3),
            deviations: triple(10).map(f64::exp),
            axes,
        };
        let (splat, is_round) = gaussian.disc(index);
        if !is_round {
            flat.note(index as u64);
        }
        splats.splats.push(splat);
        let [red, green, blue] = triple(6).map(|c| (c * HARMONIC + 0.5).clamp(0.0, 1.0));
        let alpha = 1.0 / (1.0 + (-real(9)).exp());
        colors.push([red, green, blue, alpha].map(|c| c as f32));
    }
    splats.colors = Some(colors);
    let message = "gaussians that are no circle; the disc within is taken";
    flat.warn("elliptic-gaussians", message, warnings);
    Ok(splats)
}

/// One Gaussian, as it is read.
struct Gaussian {
    centre: Vec3,
    normal: Vec3,
    deviations: Vec3,
    axes: [Vec3; 3],
}

impl Gaussian {
    /// Its disc, and whether it is a circle.
    fn disc(&self, index: usize) -> (Splat, bool) {
        let Gaussian {
            centre,
            deviations,
            axes,
            ..
        } = *self;
        let thin = (0..3).fold(2, |best, i| {
            if deviations[i] < deviations[best] {
                i
            } else {
                best
            }
        });
        let [first, second] = [(thin + 1) % 3, (thin + 2) % 3];
        let side = if dot(axes[thin], self.normal) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let normal = scale(axes[thin], side);
        let [across, other] = [deviations[first], deviations[second]];
        let is_round = (across - other).abs() <= ROUND * across.max(other);
        let splat = Splat {
            centre,
            normal,
            // At right angles to the last bits, whatever the rotation was rounded to.
            tangent: cross(axes[second], axes[thin]),
            radius: 2.0 * across.min(other),
            field: normal,
            slopes: [0.0; 2],
            error: deviations[thin] * 3f64.sqrt(),
            count: 0,
            source: index as u32,
        };
        (splat, is_round)
    }
}

/// The origin that a comment names.
fn stated_origin(table: &Table) -> Vec3 {
    let stated = table.comments.iter().find_map(|comment| {
        let mut found = words(comment.as_bytes());
        if found.next() != Some(ORIGIN.as_bytes()) {
            return None;
        }
        let values: Option<Vec<f64>> = found.map(text::number).collect();
        <[f64; 3]>::try_from(values?).ok()
    });
    stated
        .filter(|origin| origin.iter().all(|c| c.is_finite()))
        .unwrap_or_default()
}
