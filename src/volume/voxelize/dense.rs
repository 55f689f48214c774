//! The surface onto a dense grid, whose words the threads share.
//!
//! Fetching corners, deciding and writing wait for memory in different ways, and triangles of
//! different extents take different paths. So a block of triangles is fetched first, sorted by extent,
//! decided extent by extent, and written last.

use super::Mode;
use super::overlap::{Extent, Place, SHAPES, overlap_exact, slices};
use super::raster::{CHUNK, Counts, Surface};
use super::span::Span;
use super::triangle::Clip;
use crate::progress::Progress;
use crate::volume::bits::BitGrid;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Triangles that are worked on together; enough of each shape to foresee branches.
const BLOCK: usize = 512;

/// Words of the grid and bits to set in them.
type Masks = Vec<(usize, u64)>;

/// Where the rows of a grid are in its words.
#[derive(Clone, Copy)]
struct Rows {
    stride: usize,
    ny: usize,
}

impl Rows {
    #[inline(always)]
    fn start(self, y: i32, z: i32) -> usize {
        (z as usize * self.ny + y as usize) * self.stride
    }

    /// How far the rows (y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1) are from the first of them.
    fn offsets(self) -> [usize; 4] {
        let slice = self.ny * self.stride;
        [0, self.stride, slice, slice + self.stride]
    }

    /// Adds the bits `x0..=x1` of a row.
    #[inline(always)]
    fn push(self, masks: &mut Masks, [x0, x1, y, z]: [i32; 4]) {
        let row = self.start(y, z);
        let (first, last) = (x0 as usize / 64, x1 as usize / 64);
        let low = u64::MAX << (x0 % 64);
        let high = u64::MAX >> (63 - x1 % 64);
        if first == last {
            masks.push((row + first, low & high));
        } else {
            masks.push((row + first, low));
            masks.extend((first + 1..last).map(|word| (row + word, u64::MAX)));
            masks.push((row + last, high));
        }
    }
}

/// Numbers of triangles in a block; adding one takes no branch.
struct List {
    numbers: [u16; BLOCK],
    length: usize,
}

impl List {
    const EMPTY: List = List {
        numbers: [0; BLOCK],
        length: 0,
    };

    /// Adds a number, if `really`.
    #[inline(always)]
    fn add(&mut self, number: usize, really: bool) {
        self.numbers[self.length % BLOCK] = number as u16;
        self.length += usize::from(really);
    }

    /// The same numbers, those of the same shape together.
    fn by(&self, shape: impl Fn(usize) -> usize) -> List {
        let mut ends = [0u16; SHAPES + 1];
        for number in self.iter() {
            ends[shape(number) % SHAPES + 1] += 1;
        }
        for i in 0..SHAPES {
            ends[i + 1] += ends[i];
        }
        let mut sorted = List {
            length: self.length,
            ..List::EMPTY
        };
        for number in self.iter() {
            let place = &mut ends[shape(number) % SHAPES];
            sorted.numbers[usize::from(*place) % BLOCK] = number as u16;
            *place += 1;
        }
        sorted
    }

    fn iter(&self) -> impl Iterator<Item = usize> {
        self.numbers[..self.length.min(BLOCK)]
            .iter()
            .map(|n| usize::from(*n))
    }
}

/// Working memory of a thread.
struct Scratch {
    places: Vec<Place>,
    spans: Vec<Span>,
    masks: Masks,
}

impl Surface<'_> {
    /// Sets the voxels of the surface in a dense grid. Cost: the primitives, the rows they span.
    pub fn rasterize(&self, grid: &mut BitGrid, progress: &dyn Progress) -> Counts {
        let rows = Rows {
            stride: grid.stride(),
            ny: grid.dims()[1],
        };
        let clip = Clip::grid(grid.dims());
        let words = grid.atomic_words();
        let count = self.len();
        let in_blocks = match self.mode() {
            Mode::Conservative => self.triangle_count(),
            _ => 0,
        };
        (0..count.div_ceil(CHUNK))
            .into_par_iter()
            .map_init(Scratch::new, |scratch, chunk| {
                let mut counts = Counts::default();
                let last = ((chunk + 1) * CHUNK).min(count);
                for block in (chunk * CHUNK..last).step_by(BLOCK) {
                    let (middle, end) = (in_blocks.max(block), (block + BLOCK).min(last));
                    let triangles = block..middle.min(end);
                    let others = triangles.end..end;
                    counts = counts.and(self.block(triangles, &clip, rows, scratch));
                    counts = counts.and(self.each(others, &clip, rows, scratch));
                    write(words, &mut scratch.masks);
                }
                progress.advance((last - chunk * CHUNK) as u64);
                counts
            })
            .reduce(Counts::default, Counts::and)
    }

    /// The voxels of primitives one by one.
    fn each(
        &self,
        indices: Range<usize>,
        clip: &Clip,
        rows: Rows,
        scratch: &mut Scratch,
    ) -> Counts {
        let Scratch { spans, masks, .. } = scratch;
        indices.fold(Counts::default(), |counts, index| {
            let lanes = self.lanes(index);
            self.set(index, &lanes, clip, spans, &mut |x0, x1, y, z| {
                rows.push(masks, [x0, x1, y, z]);
            });
            counts.and(self.count(index, &lanes))
        })
    }

    /// The voxels that a block of triangles touches.
    fn block(
        &self,
        triangles: Range<usize>,
        clip: &Clip,
        rows: Rows,
        scratch: &mut Scratch,
    ) -> Counts {
        let Scratch {
            places,
            spans,
            masks,
        } = scratch;
        places.clear();
        let first = triangles.start;
        places.extend(
            self.near_lanes(triangles)
                .map(|lanes| Place::new(&lanes, clip)),
        );
        let (mut pairs, mut few, mut many) = (List::EMPTY, List::EMPTY, List::EMPTY);
        for (number, place) in places.iter().enumerate() {
            // Pairs of voxels in one word each are the most, and the simplest.
            let straddles = place.first[0] & 63 == 63;
            let is_pairs = place.extent == Extent::Pairs;
            pairs.add(number, is_pairs & !straddles);
            few.add(
                number,
                (is_pairs & straddles) | (place.extent == Extent::Few),
            );
            many.add(number, place.extent == Extent::Many);
        }
        // Triangles that may have no area.
        let mut flat = List::EMPTY;
        let mut length = masks.len();
        masks.resize(length + 4 * pairs.length, (0, 0));
        let offsets = rows.offsets();
        for number in pairs.iter() {
            let place = &places[number];
            let seen = place.small.pairs();
            many.add(number, seen.doubtful);
            flat.add(number, !seen.has_area & !seen.doubtful);
            let octants = if seen.doubtful {
                0
            } else {
                u64::from(seen.octants)
            };
            let [x, y, z] = place.first;
            let word = rows.start(y, z) + x as usize / 64;
            for (row, offset) in offsets.into_iter().enumerate() {
                let bits = (octants >> (2 * row) & 3) << (x & 63);
                masks[length] = (word + offset, bits);
                length += usize::from(bits != 0);
            }
        }
        masks.truncate(length);
        for number in few.by(|number| places[number].shape()).iter() {
            let place = &places[number];
            let Some((cells, has_area)) = place.cells() else {
                many.add(number, true);
                continue;
            };
            flat.add(number, !has_area);
            let [x, y, z] = place.first;
            let [sx, sy, sz] = place.size();
            if (x & 63) as usize + sx > 64 {
                slices(&cells, place.first, &mut |x0, x1, y, z| {
                    rows.push(masks, [x0, x1, y, z]);
                });
                continue;
            }
            let mut length = masks.len();
            masks.resize(length + sy * sz, (0, 0));
            let word = rows.start(y, z) + x as usize / 64;
            for (k, slice) in cells.into_iter().enumerate().take(sz) {
                for j in 0..sy {
                    let bits = (slice >> (8 * j) & 0xff) << (x & 63);
                    masks[length] = (word + j * rows.stride + k * offsets[2], bits);
                    length += usize::from(bits != 0);
                }
            }
            masks.truncate(length);
        }
        for number in many.iter() {
            let lanes = self.lanes(first + number);
            overlap_exact(&lanes, clip, spans, &mut |x0, x1, y, z| {
                rows.push(masks, [x0, x1, y, z]);
            });
            flat.add(number, true);
        }
        flat.iter().fold(Counts::default(), |counts, number| {
            counts.and(self.count(first + number, &self.lanes(first + number)))
        })
    }
}

impl Scratch {
    fn new() -> Self {
        Scratch {
            places: Vec::with_capacity(BLOCK),
            spans: Vec::new(),
            masks: Vec::with_capacity(8 * BLOCK),
        }
    }
}

/// Sets the bits and forgets them.
fn write(words: &[AtomicU64], masks: &mut Masks) {
    // Most voxels are met by several triangles: looking first is far cheaper than a locked write.
    // Looking at all of them before writing lets the reads wait for memory together.
    let mut kept = 0;
    for at in 0..masks.len() {
        let (word, mask) = masks[at];
        masks[kept] = (word, mask);
        kept += usize::from(words[word].load(Ordering::Relaxed) & mask != mask);
    }
    for (word, mask) in &masks[..kept] {
        words[*word].fetch_or(*mask, Ordering::Relaxed);
    }
    masks.clear();
}
