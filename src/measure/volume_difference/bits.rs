//! Comparing two volumes of bits by words.

use super::{Found, LabelOverlap};
use crate::progress::Progress;
use crate::volume::bits::BitGrid;
use crate::volume::{Data, Volume};
use rayon::prelude::*;

/// Words per parallel step.
const CHUNK: usize = 1 << 13;
/// Words of a sparse volume expanded at a time, where a slice is not larger: 32 MiB.
const BLOCK: usize = 1 << 22;
/// Slices of an octree are read in multiples of the edge of its bricks.
const BRICK: usize = 4;

#[derive(Default, Clone, Copy)]
struct Counts {
    a: u64,
    b: u64,
    both: u64,
    /// Position of the first bit that differs, in bits from the start of the words.
    first: Option<usize>,
}

impl Counts {
    fn of(a: &[u64], b: &[u64], start: usize) -> Counts {
        let mut counts = Counts::default();
        for (i, (a, b)) in a.iter().zip(b).enumerate() {
            counts.a += u64::from(a.count_ones());
            counts.b += u64::from(b.count_ones());
            counts.both += u64::from((a & b).count_ones());
            if a != b && counts.first.is_none() {
                counts.first = Some((start + i) * 64 + (a ^ b).trailing_zeros() as usize);
            }
        }
        counts
    }

    fn then(self, next: Counts) -> Counts {
        Counts {
            a: self.a + next.a,
            b: self.b + next.b,
            both: self.both + next.both,
            first: self.first.or(next.first),
        }
    }
}

/// Compares two volumes of bits of the same dims.
pub fn compare(a: &Volume, b: &Volume, progress: &dyn Progress) -> Found {
    let [nx, ny, nz] = a.frame.dims;
    let slice = nx.div_ceil(64) * ny;
    let depth = (BLOCK / slice.max(1) / BRICK * BRICK).clamp(1, nz.max(1));
    let mut room = [BitGrid::new([0; 3]), BitGrid::new([0; 3])];
    let mut counts = Counts::default();
    for z in (0..nz).step_by(depth) {
        let slices = depth.min(nz - z);
        let [room_a, room_b] = &mut room;
        let words_a = words(a, z, slices, room_a);
        let words_b = words(b, z, slices, room_b);
        let parts: Vec<Counts> = words_a
            .par_chunks(CHUNK)
            .zip(words_b.par_chunks(CHUNK))
            .enumerate()
            .map(|(i, (a, b))| Counts::of(a, b, z * slice + i * CHUNK))
            .collect();
        counts = parts.into_iter().fold(counts, Counts::then);
        progress.advance(slices as u64);
    }
    let total = a.frame.len() as u64;
    let Counts { a, b, both, first } = counts;
    let unset = [total - a, total - b, total - (a + b - both)];
    let labels = [(0, unset), (1, [a, b, both])];
    Found {
        differing: a + b - 2 * both,
        first: first.map(|bit| {
            let row = bit / (nx.div_ceil(64) * 64);
            row * nx + bit % (nx.div_ceil(64) * 64)
        }),
        labels: Some(
            labels
                .into_iter()
                .filter(|(_, [a, b, _])| a + b > 0)
                .map(|(label, counts)| LabelOverlap::new(label, counts))
                .collect(),
        ),
        amounts: None,
    }
}

/// The words of some slices: those of a dense grid as they stand, those of a sparse one in `room`.
fn words<'a>(volume: &'a Volume, z: usize, slices: usize, room: &'a mut BitGrid) -> &'a [u64] {
    let [nx, ny, _] = volume.frame.dims;
    if let Data::Bits(grid) = &volume.data {
        let slice = grid.stride() * ny;
        return &grid.words()[z * slice..(z + slices) * slice];
    }
    if room.dims() != [nx, ny, slices] {
        *room = BitGrid::new([nx, ny, slices]);
    }
    volume.read_bit_slices(z, room);
    room.words()
}
