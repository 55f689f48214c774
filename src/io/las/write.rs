//! Writing: version 1.4, point formats 6 and 7.

use super::header::{LASZIP, LONGEST, MAGIC, RECORD};
use crate::io::text::spill;
use crate::mesh::Mesh;
use crate::numeric::vector::Vec3;
use laz::LazVlrBuilder;
use laz::laszip::LasZipCompressor;
use std::io::{self, Cursor, Write};

/// Bytes of a point without a colour.
const PLAIN: usize = 30;
/// Bytes of a point with a colour.
const COLORED: usize = 36;
/// The finest step that is tried: 10^-12.
const FINEST: i32 = 12;

/// Writes the vertices as LAS 1.4: coordinates, colours and classes.
///
/// Coordinates are whole multiples of a power of ten: the largest that holds all of them exactly, else
/// the smallest that the extent leaves room for; see [`rounded`]. Errs where not even steps of 1e300 would
/// do, or there are 2^32 vertices. Cost: linear.
pub fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let plan = Plan::new(mesh)?;
    out.write_all(&plan.header(mesh, None))?;
    let mut bytes = Vec::new();
    for v in 0..mesh.positions.len() {
        plan.point(mesh, v, &mut bytes);
        spill(&mut bytes, out)?;
    }
    out.write_all(&bytes)
}

/// Writes the vertices as [`write()`] does, with the points packed by LASzip.
///
/// Cost: linear; the packed points are held until all are.
pub fn write_packed(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let plan = Plan::new(mesh)?;
    let failed = |error: laz::LasZipError| io::Error::other(error.to_string());
    let builder = LazVlrBuilder::default();
    let builder = builder
        .with_point_format(plan.format(), 0)
        .map_err(failed)?;
    let vlr = builder.build();
    let mut packing = Vec::new();
    vlr.write_to(&mut packing)?;
    let header = plan.header(mesh, Some(&packing));
    // The table of chunks is found by its place in the whole file.
    let mut file = Cursor::new(header);
    file.set_position(file.get_ref().len() as u64);
    let mut compressor = LasZipCompressor::new(&mut file, vlr).map_err(failed)?;
    let mut point = Vec::with_capacity(COLORED);
    for v in 0..mesh.positions.len() {
        point.clear();
        plan.point(mesh, v, &mut point);
        compressor.compress_one(&point)?;
    }
    compressor.done()?;
    drop(compressor);
    out.write_all(file.get_ref())
}

/// How many coordinates LAS files do not hold exactly, the first vertex that has one, and the step that
/// they are rounded to along the coarsest axis.
pub fn rounded(mesh: &Mesh) -> (u64, Option<u64>, f64) {
    let Ok(plan) = Plan::new(mesh) else {
        return (0, None, 0.0);
    };
    let is_rounded = |p: &Vec3| {
        let axes = plan.axes.iter().zip(p);
        axes.filter(|(axis, c)| axis.back(axis.steps(**c)) != **c)
            .count() as u64
    };
    let counts = mesh.positions.iter().map(is_rounded);
    let (mut count, mut first) = (0, None);
    for (v, here) in (0u64..).zip(counts) {
        first = first.or((here > 0).then_some(v));
        count += here;
    }
    let step = plan
        .axes
        .iter()
        .fold(0.0, |most: f64, axis| most.max(axis.scale));
    (count, first, step)
}

/// How the coordinates along an axis are made whole.
#[derive(Debug, Clone, Copy)]
struct Axis {
    scale: f64,
    offset: f64,
    lo: f64,
    hi: f64,
}

impl Axis {
    /// The first of these that holds all coordinates exactly, else the finest that they fit: steps of
    /// powers of ten from 1 down, about zero and about their middle.
    fn new(values: impl Iterator<Item = f64> + Clone) -> io::Result<Axis> {
        let (lo, hi) = values
            .clone()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), c| {
                (lo.min(c), hi.max(c))
            });
        // Adding 0 takes the sign of a zero away.
        let middle = (lo / 2.0 + hi / 2.0).round() + 0.0;
        let mut finest = None;
        for power in 0..=FINEST {
            // As the shortest decimal reads, and not a product of rounded factors.
            let scale = 1.0 / 10f64.powi(power);
            for offset in [0.0, middle] {
                let axis = Axis {
                    scale,
                    offset,
                    lo,
                    hi,
                };
                if !axis.fits() {
                    continue;
                }
                if values.clone().all(|c| axis.back(axis.steps(c)) == c) {
                    return Ok(axis);
                }
                finest = Some(axis);
            }
        }
        // Coordinates too far apart for steps of 1.
        let mut coarse = (1..=300).map(|power| Axis {
            scale: 10f64.powi(power),
            offset: 0.0,
            lo,
            hi,
        });
        let found = finest.or_else(|| coarse.find(Axis::fits));
        found.ok_or_else(|| {
            io::Error::other(format!("coordinates from {lo} to {hi} are too far apart"))
        })
    }

    fn fits(&self) -> bool {
        [self.lo, self.hi].iter().all(|c| {
            let steps = ((c - self.offset) / self.scale).round();
            steps >= f64::from(i32::MIN) && steps <= f64::from(i32::MAX)
        })
    }

    fn steps(&self, coordinate: f64) -> i32 {
        ((coordinate - self.offset) / self.scale).round() as i32
    }

    /// The coordinate that is read.
    fn back(&self, steps: i32) -> f64 {
        f64::from(steps) * self.scale + self.offset
    }
}

/// How a cloud is written.
struct Plan {
    axes: [Axis; 3],
    has_colors: bool,
}

impl Plan {
    fn new(mesh: &Mesh) -> io::Result<Plan> {
        let along = |axis: usize| Axis::new(mesh.positions.iter().map(move |p| p[axis]));
        Ok(Plan {
            axes: [along(0)?, along(1)?, along(2)?],
            has_colors: mesh.colors.is_some(),
        })
    }

    fn format(&self) -> u8 {
        if self.has_colors { 7 } else { 6 }
    }

    fn length(&self) -> usize {
        if self.has_colors { COLORED } else { PLAIN }
    }

    /// The header, and the record of LASzip where there is one.
    fn header(&self, mesh: &Mesh, packing: Option<&[u8]>) -> Vec<u8> {
        let mut bytes = vec![0; LONGEST];
        let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
        let count = mesh.positions.len() as u64;
        let data = LONGEST + packing.map_or(0, |packing| RECORD + packing.len());
        let packed = if packing.is_some() { 0x80 } else { 0 };
        put(0, MAGIC);
        // Of its bits one is set for every file of this version: coordinate systems are in WKT.
        put(6, &16u16.to_le_bytes());
        put(24, &[1, 4]);
        put(26, b"scantle");
        put(58, b"scantle");
        put(94, &(LONGEST as u16).to_le_bytes());
        put(96, &(data as u32).to_le_bytes());
        put(100, &u32::from(packing.is_some()).to_le_bytes());
        put(104, &[self.format() | packed]);
        put(105, &(self.length() as u16).to_le_bytes());
        for (i, axis) in self.axes.iter().enumerate() {
            put(131 + 8 * i, &axis.scale.to_le_bytes());
            put(155 + 8 * i, &axis.offset.to_le_bytes());
            put(179 + 16 * i, &axis.back(axis.steps(axis.hi)).to_le_bytes());
            put(187 + 16 * i, &axis.back(axis.steps(axis.lo)).to_le_bytes());
        }
        put(247, &count.to_le_bytes());
        // All are first returns.
        put(255, &count.to_le_bytes());
        if let Some(packing) = packing {
            let (user, number) = LASZIP;
            let mut record = [0; RECORD];
            record[2..2 + user.len()].copy_from_slice(user);
            record[18..20].copy_from_slice(&number.to_le_bytes());
            record[20..22].copy_from_slice(&(packing.len() as u16).to_le_bytes());
            bytes.extend(record);
            bytes.extend(packing);
        }
        bytes
    }

    fn point(&self, mesh: &Mesh, v: usize, bytes: &mut Vec<u8>) {
        let start = bytes.len();
        bytes.resize(start + self.length(), 0);
        let mut put = |at: usize, value: &[u8]| {
            bytes[start + at..start + at + value.len()].copy_from_slice(value);
        };
        for (i, axis) in self.axes.iter().enumerate() {
            put(4 * i, &axis.steps(mesh.positions[v][i]).to_le_bytes());
        }
        // The first return of one.
        put(14, &[0x11]);
        put(16, &[mesh.classes.as_ref().map_or(0, |classes| classes[v])]);
        if let Some(colors) = &mesh.colors {
            let [red, green, blue, _] = colors[v].map(|c| (f64::from(c) * 65535.0).round() as u16);
            for (i, channel) in [red, green, blue].into_iter().enumerate() {
                put(30 + 2 * i, &channel.to_le_bytes());
            }
        }
    }
}
