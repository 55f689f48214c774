//! binvox: bits of a cubic grid, run-length coded.
//!
//! Voxels run along y fastest, then z, then x. `translate` is the lower corner of the grid and
//! `scale` the edge of the whole cube. Source: Patrick Min, "binvox 3D mesh voxelizer", file format.

use super::header::{Field, Lines, excerpt, join, shortest};
use super::refusal::{RAISE, Refusal, expect_room};
use super::samples;
use crate::error::Fault;
use crate::io::source::Source;
use crate::report::Warning;
use crate::volume::bits::BitGrid;
use crate::volume::octree::Cell;
use crate::volume::{Data, Frame, Volume};
use std::io::{self, Write};

/// How far steps along x, y and z may differ, relative to the step, to count as one: a grid of
/// 4096 voxels is then off by less than a thousandth of a voxel at its far end.
const STEP_TOLERANCE: f64 = 1e-7;

/// Longest run that a pair of bytes holds.
const LONGEST_RUN: usize = 255;

/// Reads a grid of bits; a value other than 0 is set.
///
/// Grids whose dims differ are read too, with `scale` the edge of the longest side. The dims are
/// measured against what the runs can hold before room is made for them.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Volume, Refusal> {
    let bytes = source.bytes();
    let header = Header::parse(bytes)?;
    // dim holds x, z and y, in the order in which indices run.
    let [nx, nz, ny] = header.dims;
    let sizes = [nx, ny, nz];
    let (dims, voxels) = samples::extent(sizes, 1)?;
    let runs = &bytes[header.end..];
    let most = (runs.len() / 2) as u128 * LONGEST_RUN as u128;
    if voxels as u128 > most {
        return Err(Fault::whole(format!(
            "a grid of {nx} x {ny} x {nz} has {voxels} voxels, but {} bytes of runs hold {most} at most",
            runs.len()
        ))
        .into());
    }
    let needed = BitGrid::bytes_for(dims) + BitGrid::bytes_for(Planes::dims(dims));
    let what = || format!("a grid of {nx} x {ny} x {nz} voxels");
    expect_room(what, needed, source.limit(), RAISE)?;
    let mut grid = BitGrid::new(dims);
    let used = fill(&mut grid, runs, header.end)?;
    if used < runs.len() {
        samples::warn_trailing(runs.len() - used, warnings);
    }
    let step = header.scale / dims.into_iter().max().unwrap_or(1) as f64;
    let origin = header.translate.map(|corner| corner + 0.5 * step);
    Ok(Volume {
        frame: Frame::straight(dims, origin, [step; 3]),
        data: Data::Bits(grid),
    })
}

/// Sets the voxels of the runs. Returns how many bytes of them the grid took.
fn fill(grid: &mut BitGrid, runs: &[u8], start: usize) -> Result<usize, Fault> {
    let [nx, ny, nz] = grid.dims();
    let voxels = nx * ny * nz;
    let mut planes = Planes::new([nx, ny, nz]);
    let mut at = 0;
    let mut used = 0;
    let (pairs, _) = runs.as_chunks::<2>();
    for [value, count] in pairs {
        if at == voxels {
            break;
        }
        let end = at + usize::from(*count);
        if end > voxels {
            return Err(Fault::byte(
                start + used,
                format!(
                    "a run of {count} voxels goes past the end of the grid: {} are left",
                    voxels - at
                ),
            ));
        }
        if *value != 0 {
            planes.set(grid, at, end);
        }
        at = end;
        used += 2;
    }
    if at < voxels {
        return Err(Fault::byte(
            start + runs.len(),
            format!("the runs end after {at} of {voxels} voxels"),
        ));
    }
    planes.hand_on(grid);
    Ok(used)
}

/// Up to 64 planes of one x being read, y along rows, then z, then x: runs are runs of a row there,
/// and blocks of 64 x 64 bits are turned into the grid.
struct Planes {
    bits: BitGrid,
    /// Where along x they are: the word of a row of the grid.
    block: usize,
}

impl Planes {
    fn dims([nx, ny, nz]: [usize; 3]) -> [usize; 3] {
        [ny, nz, nx.min(PLANES)]
    }

    fn new(dims: [usize; 3]) -> Self {
        Planes {
            bits: BitGrid::new(Planes::dims(dims)),
            block: 0,
        }
    }

    /// Sets voxels by their place in the file.
    fn set(&mut self, grid: &mut BitGrid, mut at: usize, end: usize) {
        let [ny, nz, _] = self.bits.dims();
        while at < end {
            let (x, z, y) = (at / ny / nz, at / ny % nz, at % ny);
            if x / PLANES != self.block {
                self.hand_on(grid);
                self.bits.clear();
                self.block = x / PLANES;
            }
            let count = (end - at).min(ny - y);
            self.bits.set_run(y, y + count, z, x % PLANES);
            at += count;
        }
    }

    /// Copies the planes into the grid.
    fn hand_on(&self, grid: &mut BitGrid) {
        let [ny, nz, depth] = self.bits.dims();
        for z in 0..nz {
            for y0 in (0..ny).step_by(64) {
                let mut block = [0; 64];
                for (x, word) in (0..depth).zip(&mut block) {
                    *word = self.bits.row(z, x)[y0 / 64];
                }
                transpose(&mut block);
                for (y, word) in (y0..ny).zip(block) {
                    grid.row_mut(y, z)[self.block] = word;
                }
            }
        }
    }
}

struct Header {
    /// As they stand in the file: x, z, y.
    dims: [u64; 3],
    translate: [f64; 3],
    scale: f64,
    end: usize,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Header, Fault> {
        let mut lines = Lines::new(bytes);
        let (_, magic) = lines.next().unwrap_or_default();
        if magic.trim_end() != "#binvox 1" {
            return Err(Fault::line(
                1,
                format!(
                    "begins with {:?}, but \"#binvox 1\" is read",
                    excerpt(&magic)
                ),
            ));
        }
        let (mut dims, mut translate, mut scale) = (None, [0.0; 3], 1.0);
        while let Some((line, text)) = lines.next() {
            let (name, value) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
            let field = Field {
                name: name.to_owned(),
                text: value.trim().to_owned(),
                line,
            };
            let three = |field: &Field| -> Result<[f64; 3], Fault> {
                let found: Vec<f64> = field.list(3, "a number")?;
                Ok([found[0], found[1], found[2]])
            };
            match name {
                "dim" => {
                    let found: Vec<u64> = field.list(3, "a size")?;
                    dims = Some([found[0], found[1], found[2]]);
                }
                "translate" => translate = three(&field)?,
                "scale" => scale = field.one("a number")?,
                "data" => {
                    let dims = dims.ok_or_else(|| {
                        Fault::line(line, "the data begins before any line \"dim\"")
                    })?;
                    return Ok(Header {
                        dims,
                        translate,
                        scale,
                        end: lines.offset(),
                    });
                }
                _ if name.is_empty() || name.starts_with('#') => {}
                other => {
                    return Err(Fault::line(
                        line,
                        format!(
                            "{:?} is none of dim, translate, scale and data",
                            excerpt(other)
                        ),
                    ));
                }
            }
        }
        Err(Fault::line(
            lines.number(),
            "the header ends without a line \"data\"",
        ))
    }
}

/// Why a volume cannot be held: binvox files are cubes of as many voxels along each axis, along the
/// coordinate axes, with one step.
pub fn refusal(volume: &Volume) -> Option<String> {
    let frame = &volume.frame;
    let [nx, ny, nz] = frame.dims;
    if nx != ny || ny != nz {
        let edge = nx.max(ny).max(nz);
        return Some(format!(
            "holds cubes only, and the grid is {nx} x {ny} x {nz}; \
             make one of {edge} x {edge} x {edge}, or choose another format"
        ));
    }
    if !frame.is_straight() {
        return Some("holds grids along the coordinate axes only".into());
    }
    let [x, y, z] = frame.spacing();
    let largest = x.max(y).max(z);
    if largest - x.min(y).min(z) > STEP_TOLERANCE * largest {
        return Some(format!(
            "holds one spacing for all axes, and the grid has {x}, {y}, {z}; \
             choose another format"
        ));
    }
    None
}

/// Writes a cube of bits that [`refusal`] has nothing against.
///
/// Memory: 64 planes of bits. Sparse volumes are never expanded whole: their cells are visited
/// once for every 64 planes.
pub fn write(volume: &Volume, out: &mut dyn Write) -> io::Result<()> {
    let frame = &volume.frame;
    let [nx, ny, nz] = frame.dims;
    let spacing = frame.spacing();
    let corner: [f64; 3] = std::array::from_fn(|a| frame.origin[a] - 0.5 * spacing[a]);
    write!(
        out,
        "#binvox 1\ndim {nx} {nz} {ny}\ntranslate {}\nscale {}\ndata\n",
        join(&corner, " "),
        shortest(spacing[0] * nx.max(ny).max(nz) as f64),
    )?;
    let mut runs = Runs::default();
    let mut planes = BitGrid::new([ny, nz, PLANES]);
    for x0 in (0..nx).step_by(PLANES) {
        planes.clear();
        match &volume.data {
            Data::Sparse(tree) => tree.visit(&mut |cell| set_cell(cell, x0, &mut planes)),
            _ => planes_of_slabs(volume, x0, &mut planes),
        }
        for x in 0..PLANES.min(nx - x0) {
            for z in 0..nz {
                runs.row(planes.row(z, x), ny);
            }
            runs.hand_on(out)?;
        }
    }
    runs.finish(out)
}

/// Planes of one x turned at a time: the bits of a word.
pub(super) const PLANES: usize = 64;

/// Turns the voxels with x from `x0` to `x0 + 63` of a dense volume: y along rows, then z, then x.
fn planes_of_slabs(volume: &Volume, x0: usize, planes: &mut BitGrid) {
    let Ok(()): Result<(), std::convert::Infallible> =
        samples::for_each_slab(volume, |z0, slab| {
            let [_, ny, depth] = slab.dims();
            for z in 0..depth {
                for y0 in (0..ny).step_by(64) {
                    let mut block = [0; 64];
                    for (y, word) in (y0..ny).zip(&mut block) {
                        *word = slab.row(y, z)[x0 / 64];
                    }
                    transpose(&mut block);
                    for (x, word) in block.into_iter().enumerate() {
                        planes.row_mut(z0 + z, x)[y0 / 64] = word;
                    }
                }
            }
            Ok(())
        });
}

/// Transposes 64 x 64 bits: bit j of word i becomes bit i of word j.
///
/// Blocks off the diagonal are exchanged, of half the size at each of six steps.
/// Source: H. S. Warren, "Hacker's Delight", 2nd edition (2012), section 7-3.
fn transpose(block: &mut [u64; 64]) {
    let mut size = 32;
    let mut mask = u64::MAX >> 32;
    while size > 0 {
        for i in (0..64).filter(|i| i & size == 0) {
            let swap = (block[i] >> size ^ block[i + size]) & mask;
            block[i] ^= swap << size;
            block[i + size] ^= swap;
        }
        size /= 2;
        mask ^= mask << size;
    }
}

/// Sets the voxels of a cell of an octree that lie in the planes from `x0` on.
fn set_cell(cell: Cell, x0: usize, planes: &mut BitGrid) {
    match cell {
        Cell::Full { min, edge } => {
            let from = min[0].max(x0);
            for x in from..(min[0] + edge).min(x0 + PLANES) {
                for z in min[2]..min[2] + edge {
                    planes.set_run(min[1], min[1] + edge, z, x - x0);
                }
            }
        }
        // Planes begin at a multiple of 4, so a brick is inside them whole or not at all.
        Cell::Brick { min, mut bits } if min[0] / PLANES == x0 / PLANES => {
            while bits != 0 {
                let bit = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                planes.set(
                    min[1] + bit / 4 % 4,
                    min[2] + bit / 16,
                    min[0] - x0 + bit % 4,
                );
            }
        }
        Cell::Brick { .. } => {}
    }
}

/// Codes runs of equal bits as pairs of value and count.
#[derive(Default)]
struct Runs {
    value: bool,
    length: usize,
    bytes: Vec<u8>,
}

impl Runs {
    /// Goes on with the first `count` bits of a row.
    fn row(&mut self, row: &[u64], count: usize) {
        let mut left = count;
        for word in row {
            let mut word = *word;
            let mut bits = left.min(64);
            left -= bits;
            while bits > 0 {
                let equal = if self.value {
                    word.trailing_ones()
                } else {
                    word.trailing_zeros()
                } as usize;
                let equal = equal.min(bits);
                self.length += equal;
                bits -= equal;
                if bits > 0 {
                    word >>= equal;
                    self.end_run();
                    self.value = !self.value;
                }
            }
        }
    }

    fn end_run(&mut self) {
        let value = u8::from(self.value);
        while self.length > 0 {
            let count = self.length.min(LONGEST_RUN);
            self.bytes.extend([value, count as u8]);
            self.length -= count;
        }
    }

    fn hand_on(&mut self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(&self.bytes)?;
        self.bytes.clear();
        Ok(())
    }

    fn finish(mut self, out: &mut dyn Write) -> io::Result<()> {
        self.end_run();
        self.hand_on(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::written_volume::{Parsed, damaged, parsed, written};
    use proptest::prelude::*;

    fn parse(bytes: &[u8]) -> Parsed {
        parsed("a.binvox", bytes, read)
    }

    /// Bits by a rule, in a frame whose numbers are exact in binary.
    fn cube(edge: usize, rule: impl Fn([usize; 3]) -> bool) -> Volume {
        let mut grid = BitGrid::new([edge; 3]);
        for i in 0..edge * edge * edge {
            let p = [i % edge, i / edge % edge, i / edge / edge];
            if rule(p) {
                grid.set(p[0], p[1], p[2]);
            }
        }
        let frame = Frame::straight([edge; 3], [10.25, -3.75, 0.25], [0.5; 3]);
        Volume {
            frame,
            data: Data::Bits(grid),
        }
    }

    proptest! {
        #[test]
        fn what_is_written_comes_back(edge in 1usize..80, seed in any::<u64>(), share in 1u64..8) {
            let volume = cube(edge, |[x, y, z]| {
                let i = (x + 100 * y + 10_000 * z) as u64;
                (i ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 61 < share
            });
            prop_assert_eq!(refusal(&volume), None);
            let (back, warnings) = parse(&written(&volume, write)).unwrap();
            prop_assert!(warnings.is_empty());
            prop_assert_eq!(back.data, volume.data);
            prop_assert_eq!(back.frame.dims, volume.frame.dims);
            for a in 0..3 {
                prop_assert!((back.frame.origin[a] - volume.frame.origin[a]).abs() < 1e-12);
                prop_assert!((back.frame.axes[a][a] - 0.5).abs() < 1e-15);
            }
        }

        #[test]
        fn any_bytes_are_read_or_refused(cut in 0usize..90, at in 0usize..90, byte in any::<u8>()) {
            let bytes = written(&cube(5, |[x, y, _]| x > y), write);
            let _ = parse(&damaged(bytes, at, byte, cut));
        }
    }

    #[test]
    fn y_runs_fastest_then_z_then_x() {
        let bytes = b"#binvox 1\ndim 2 2 2\ntranslate 1 2 3\nscale 4\ndata\n\x00\x01\x01\x01\x00\x02\x01\x02\x00\x02";
        let (volume, _) = parse(bytes).unwrap();
        assert_eq!(
            volume.frame,
            Frame::straight([2; 3], [2.0, 3.0, 4.0], [2.0; 3])
        );
        let Data::Bits(grid) = &volume.data else {
            panic!("binvox holds bits");
        };
        let set: Vec<_> = (0..8)
            .map(|i| [i & 1, i >> 1 & 1, i >> 2])
            .filter(|[x, y, z]| grid.get(*x, *y, *z))
            .collect();
        assert_eq!(set, [[1, 0, 0], [0, 1, 0], [1, 1, 0]]);
        assert_eq!(written(&volume, write), bytes);
    }

    #[test]
    fn cells_set_the_same_planes_as_slices() {
        let brick = 0x8000_0000_0400_0201;
        let volume = cube(144, |p| {
            let full = (0..3).all(|a| (64..128).contains(&p[a]));
            let b = [
                p[0].wrapping_sub(60),
                p[1].wrapping_sub(8),
                p[2].wrapping_sub(140),
            ];
            full || (b.iter().all(|c| *c < 4) && brick >> (b[0] + 4 * b[1] + 16 * b[2]) & 1 == 1)
        });
        let cells = [
            Cell::Brick {
                min: [60, 8, 140],
                bits: brick,
            },
            Cell::Full {
                min: [64; 3],
                edge: 64,
            },
        ];
        for x0 in [0, 64, 128] {
            let mut wanted = BitGrid::new([144, 144, PLANES]);
            planes_of_slabs(&volume, x0, &mut wanted);
            let mut found = BitGrid::new([144, 144, PLANES]);
            for cell in cells {
                set_cell(cell, x0, &mut found);
            }
            assert!(found == wanted);
        }
    }

    #[test]
    fn transposing_moves_every_bit() {
        for (i, j) in [(0, 0), (0, 63), (63, 0), (5, 40), (33, 31)] {
            let mut block = [0; 64];
            block[i] = 1 << j;
            transpose(&mut block);
            let mut wanted = [0; 64];
            wanted[j] = 1 << i;
            assert_eq!(block, wanted);
        }
    }

    #[test]
    fn what_is_no_cube_is_refused_with_the_way_out() {
        let mut volume = cube(4, |_| true);
        volume.frame.axes[2][2] = 0.25;
        assert_eq!(
            refusal(&volume).unwrap(),
            "holds one spacing for all axes, and the grid has 0.5, 0.5, 0.25; choose another format"
        );
        volume.frame.dims = [4, 2, 3];
        assert_eq!(
            refusal(&volume).unwrap(),
            "holds cubes only, and the grid is 4 x 2 x 3; make one of 4 x 4 x 4, or choose another format"
        );
    }
}
