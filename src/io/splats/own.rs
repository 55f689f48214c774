//! The PLY of scantle's splats.
//!
//! A vertex is a disc: `x y z` its centre, `nx ny nz` the unit normal of its plane, `radius`, `ux uy uz` the
//! unit tangent along which the field turns most, `fx fy fz` the field of normals at the centre, not of unit
//! length, `kappa_u kappa_v` how much the field leans along the tangent and across it per unit of length,
//! `err` the largest height of a point it covers, `count` of those points, and `source`, the point it was
//! grown from; then colour and class, where there are some. All but those are doubles and unsigned numbers
//! of 32 bits: reading gives back what was written, to the bit.

use crate::error::Fault;
use crate::io::cloud::{self, from_byte, is_of_bytes, to_byte};
use crate::io::ply::{self, Table};
use crate::io::source::Source;
use crate::io::text::spill;
use crate::points::{Splat, Splats};
use crate::report::Warning;
use std::io::{self, Write};

/// The numbers of a splat, in their order.
const REALS: [&str; 16] = [
    "x", "y", "z", "nx", "ny", "nz", "radius", "ux", "uy", "uz", "fx", "fy", "fz", "kappa_u",
    "kappa_v", "err",
];
const WHOLE: [&str; 2] = ["count", "source"];
const CHANNELS: [&str; 4] = ["red", "green", "blue", "alpha"];
const CLASS: &str = "classification";

/// Reads splats in the order of the file.
///
/// Errs with the place where the header lacks a property, the file ends early, a value is no number, and
/// where there is no splat at all. Cost: linear in the bytes.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Splats, Fault> {
    let names = [&REALS[..], &WHOLE, &CHANNELS, &[CLASS]].concat();
    let Table {
        mut columns,
        rows,
        line,
        comments,
    } = ply::table(source, &names, warnings)?;
    let needed = REALS.len() + WHOLE.len();
    if let Some(missing) = columns[..needed].iter().position(Option::is_none) {
        let problem = format!("the vertex element has no property {}", names[missing]);
        return Err(Fault::line(line, problem));
    }
    if rows == 0 {
        return Err(Fault::whole("holds no splats"));
    }
    let class = columns.pop().flatten();
    let channels = columns.split_off(needed);
    // All are there.
    let columns: Vec<Vec<f64>> = columns.into_iter().flatten().collect();
    let mut splats = Vec::with_capacity(rows);
    for index in 0..rows {
        let real = |column: usize| columns[column][index];
        let triple = |first: usize| [real(first), real(first + 1), real(first + 2)];
        let whole = |column: usize| {
            let value = real(column);
            if f64::from(value as u32) == value {
                return Ok(value as u32);
            }
            let problem = format!(
                "has {} = {value}, which is no whole number of 32 bits",
                names[column]
            );
            Err(Fault::element("splat", index, problem))
        };
        splats.push(Splat {
            centre: triple(0),
            normal: triple(3),
            radius: real(6),
            tangent: triple(7),
            field: triple(10),
            slopes: [real(13), real(14)],
            error: real(15),
            count: whole(16)?,
            source: whole(17)?,
        });
    }
    let of_bytes = !comments.iter().any(|comment| comment == REAL_COLORS);
    Ok(Splats {
        splats,
        colors: colors(&channels, rows, of_bytes),
        classes: class.and_then(|class| cloud::classes(&class, warnings)),
    })
}

/// The comment that says that colours are no bytes.
const REAL_COLORS: &str = "colours from 0 to 1";

/// Colours, where red, green and blue are all there.
fn colors(channels: &[Option<Vec<f64>>], rows: usize, of_bytes: bool) -> Option<Vec<[f32; 4]>> {
    let [Some(red), Some(green), Some(blue), alpha] = channels else {
        return None;
    };
    let channel = |value: f64| match of_bytes {
        true => from_byte(value as u8),
        false => value as f32,
    };
    let color = |i: usize| {
        let alpha = alpha.as_ref().map_or(1.0, |alpha| channel(alpha[i]));
        [channel(red[i]), channel(green[i]), channel(blue[i]), alpha]
    };
    Some((0..rows).map(color).collect())
}

/// Writes splats so that reading gives back every bit. Cost: linear.
pub fn write(splats: &Splats, out: &mut dyn Write) -> io::Result<()> {
    let all = splats.colors.as_deref().unwrap_or_default();
    let of_bytes = is_of_bytes(all.as_flattened());
    let channels = if all.iter().all(|color| color[3] == 1.0) {
        3
    } else {
        4
    };
    let mut bytes = header(splats, of_bytes, channels).into_bytes();
    for (i, splat) in splats.splats.iter().enumerate() {
        let vectors = [splat.tangent, splat.field];
        let reals = splat
            .centre
            .iter()
            .chain(&splat.normal)
            .chain([&splat.radius]);
        let reals = reals.chain(vectors.as_flattened()).chain(&splat.slopes);
        reals
            .chain([&splat.error])
            .for_each(|c| bytes.extend(c.to_le_bytes()));
        bytes.extend(splat.count.to_le_bytes());
        bytes.extend(splat.source.to_le_bytes());
        if let Some(color) = all.get(i) {
            for channel in &color[..channels] {
                if of_bytes {
                    bytes.push(to_byte(*channel));
                } else {
                    bytes.extend(channel.to_le_bytes());
                }
            }
        }
        if let Some(classes) = &splats.classes {
            bytes.push(classes[i]);
        }
        spill(&mut bytes, out)?;
    }
    out.write_all(&bytes)
}

fn header(splats: &Splats, of_bytes: bool, channels: usize) -> String {
    let mut lines = vec![
        "ply".to_owned(),
        "format binary_little_endian 1.0".to_owned(),
        "comment written by scantle".to_owned(),
        "comment splats: centre, plane normal n, radius, tangent u, field of normals f at the centre, \
         which leans by kappa_u along u and by kappa_v along n x u per unit of length"
            .to_owned(),
    ];
    let colors = splats.colors.as_ref();
    if colors.is_some() && !of_bytes {
        lines.push(format!("comment {REAL_COLORS}"));
    }
    lines.push(format!("element vertex {}", splats.splats.len()));
    let mut add = |kind: &str, names: &[&str]| {
        lines.extend(names.iter().map(|name| format!("property {kind} {name}")));
    };
    add("double", &REALS);
    add("uint", &WHOLE);
    if colors.is_some() {
        add(
            if of_bytes { "uchar" } else { "float" },
            &CHANNELS[..channels],
        );
    }
    if splats.classes.is_some() {
        add("uchar", &[CLASS]);
    }
    lines.push("end_header\n".to_owned());
    lines.join("\n")
}
