//! A few slices of a volume as bits: what is inside, and where the surface crosses an edge.

use super::Select;
use crate::volume::bits::BitGrid;
use crate::volume::{Data, Volume};
use crate::with_samples;
use wide::u8x16;

/// Slices that one thread works on at a time.
pub(in crate::volume) const SLAB: usize = 8;

/// Labels to be told apart, ascending; each is known by its number in the list plus one, and all others
/// by 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Labels {
    values: Vec<f64>,
    /// For whole numbers from 0 to 65535.
    table: Vec<u16>,
}

/// Most labels: one number of 16 bits is that of the rest.
pub const MOST_LABELS: usize = u16::MAX as usize - 1;

impl Labels {
    /// Labels of these values, each once, in any order; at most 65534.
    pub fn new(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        values.dedup();
        values.truncate(MOST_LABELS);
        let mut table = vec![0; 1 << 16];
        for (i, value) in values.iter().enumerate() {
            if value.fract() == 0.0 && (0.0..65_536.0).contains(value) {
                table[*value as usize] = i as u16 + 1;
            }
        }
        Labels { values, table }
    }

    /// The values, ascending: label `i + 1` is the i-th.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    #[inline]
    fn number(&self, value: f64) -> u16 {
        let whole = value as usize;
        if whole as f64 == value && whole < self.table.len() {
            return self.table[whole];
        }
        let found = self.values.binary_search_by(|v| v.total_cmp(&value));
        found.map_or(0, |i| i as u16 + 1)
    }
}

/// What a slab is read for.
pub(in crate::volume) enum Source<'a> {
    Select(&'a Select),
    Labels(&'a Labels),
}

/// Slices of a grid with a margin of one voxel all around that is outside.
///
/// Plane `p` is slice `first + p - 1` of the margin's grid: one below and two above those that the
/// slab stands for are held too. An edge is crossed between a voxel and the next one along its axis.
pub(in crate::volume) struct Slab {
    /// Slices that the slab stands for, in the margin's grid.
    pub first: usize,
    pub count: usize,
    /// Voxels of the margin's grid along y.
    pub ny: usize,
    /// Words of a row.
    pub stride: usize,
    /// Voxels of the margin's grid along x.
    nx: usize,
    inside: Vec<u64>,
    /// Where there are labels, their numbers; else empty.
    labels: Vec<u16>,
    crossed: [Vec<u64>; 3],
}

/// Which part of the margin's grid has cells: all of it, or what lies within the volume.
#[derive(Debug, Clone, Copy)]
pub(in crate::volume) struct Extent {
    /// Voxels of the margin's grid.
    pub dims: [usize; 3],
    /// Voxels left away on each side.
    pub ring: usize,
}

impl Extent {
    pub(in crate::volume) fn new(dims: [usize; 3], closed: bool) -> Self {
        Extent {
            dims: dims.map(|n| n + 2),
            ring: usize::from(!closed),
        }
    }

    /// The first cell along an axis.
    pub(in crate::volume) fn first(&self) -> usize {
        self.ring
    }

    /// One past the last cell along an axis.
    pub(in crate::volume) fn end(&self, axis: usize) -> usize {
        (self.dims[axis] - 1).saturating_sub(self.ring)
    }

    /// Slices that a slab may stand for, the last one with no cell above it.
    pub(in crate::volume) fn slices(&self) -> std::ops::Range<usize> {
        self.first()..self.end(2) + 1
    }

    fn holds_voxel(&self, axis: usize, at: usize) -> bool {
        self.ring <= at && at + self.ring < self.dims[axis]
    }

    fn holds_edge(&self, axis: usize, at: usize) -> bool {
        self.ring <= at && at + 1 + self.ring < self.dims[axis]
    }
}

impl Slab {
    /// Reads the slices from `first` on.
    pub(in crate::volume) fn read(
        volume: &Volume,
        source: &Source,
        extent: &Extent,
        first: usize,
    ) -> Slab {
        let [nx, ny, _] = extent.dims;
        let count = SLAB.min(extent.slices().end - first);
        let stride = nx.div_ceil(64);
        let rows = (count + 3) * ny;
        let mut slab = Slab {
            first,
            count,
            ny,
            stride,
            nx,
            inside: vec![0; rows * stride],
            labels: Vec::new(),
            crossed: [(); 3].map(|()| vec![0; rows * stride]),
        };
        match source {
            Source::Select(select) => {
                slab.fill(volume, select);
                slab.cross(extent);
            }
            Source::Labels(labels) => {
                slab.labels = vec![0; rows * nx];
                slab.fill_labels(volume, labels);
                slab.cross_labels();
            }
        }
        slab
    }

    fn fill_labels(&mut self, volume: &Volume, labels: &Labels) {
        let [nx, ny, nz] = volume.frame.dims;
        let width = self.nx;
        for plane in 0..self.count + 3 {
            let Some(z) = (self.first + plane).checked_sub(2).filter(|z| *z < nz) else {
                continue;
            };
            for y in 0..ny {
                let at = (plane * self.ny + y + 1) * width + 1;
                let to = &mut self.labels[at..at + nx];
                with_samples!(&volume.data, v => {
                    let from = &v[(z * ny + y) * nx..][..nx];
                    for (to, from) in to.iter_mut().zip(from) {
                        *to = labels.number(*from as f64);
                    }
                }, _ => {
                    let mut row = BitGrid::new([nx, ny, 1]);
                    volume.read_bit_slices(z, &mut row);
                    for (x, to) in to.iter_mut().enumerate() {
                        *to = labels.number(f64::from(u8::from(row.get(x, y, 0))));
                    }
                });
            }
        }
    }

    fn cross_labels(&mut self) {
        let (width, stride) = (self.nx, self.stride);
        let rows = self.labels.len() / width;
        for row in 0..rows {
            let at = row * width;
            let own = &self.labels[at..at + width];
            for axis in 0..3 {
                let from = at + [1, width, self.ny * width][axis];
                let in_plane = (row + 1) % self.ny != 0;
                let Some(other) = self.labels.get(from..from + width - usize::from(axis == 0))
                else {
                    continue;
                };
                if axis == 1 && !in_plane {
                    continue;
                }
                let to = &mut self.crossed[axis][row * stride..][..stride];
                for ((a, b), to) in own.chunks(64).zip(other.chunks(64)).zip(to) {
                    if a[..b.len()] != *b {
                        for (i, (a, b)) in a.iter().zip(b).enumerate() {
                            *to |= u64::from(a != b) << i;
                        }
                    }
                }
            }
        }
    }

    /// The numbers of the labels at both ends of an edge that starts at voxel `[x, y, first + k]`.
    #[inline]
    pub(in crate::volume) fn labels_at(
        &self,
        [x, y, k]: [usize; 3],
        axis: usize,
    ) -> Option<[u16; 2]> {
        if self.labels.is_empty() {
            return None;
        }
        let at = ((k + 1) * self.ny + y) * self.nx + x;
        let step = [1, self.nx, self.ny * self.nx][axis];
        Some([self.labels[at], self.labels[at + step]])
    }

    /// The numbers of the labels at the corners of a cell.
    #[inline]
    pub(in crate::volume) fn labels_of_cell(&self, [x, y, k]: [usize; 3]) -> Option<[u16; 8]> {
        if self.labels.is_empty() {
            return None;
        }
        let at = ((k + 1) * self.ny + y) * self.nx + x;
        let (row, plane) = (self.nx, self.ny * self.nx);
        Some(std::array::from_fn(|c| {
            self.labels[at + (c & 1) + (c >> 1 & 1) * row + (c >> 2) * plane]
        }))
    }

    fn fill(&mut self, volume: &Volume, select: &Select) {
        let [nx, ny, nz] = volume.frame.dims;
        let mut slice = BitGrid::new([nx, ny, 1]);
        for plane in 0..self.count + 3 {
            // Plane 0 is slice first - 1 of the margin's grid, which is slice first - 2 of the volume.
            let Some(z) = (self.first + plane).checked_sub(2).filter(|z| *z < nz) else {
                continue;
            };
            if let (Data::U8(v), Select::Equal(label)) = (&volume.data, select) {
                for y in 0..ny {
                    let row = &v[(z * ny + y) * nx..][..nx];
                    equal_bytes(row, *label, slice.row_mut(y, 0));
                }
            } else {
                select.read(volume, z, &mut slice);
            }
            for y in 0..ny {
                let from = slice.row(y, 0);
                let at = (plane * self.ny + y + 1) * self.stride;
                let to = &mut self.inside[at..at + self.stride];
                let mut carry = 0;
                for (i, word) in from.iter().enumerate() {
                    to[i] = word << 1 | carry;
                    carry = word >> 63;
                }
                if from.len() < to.len() {
                    to[from.len()] = carry;
                }
            }
        }
    }

    fn cross(&mut self, extent: &Extent) {
        let stride = self.stride;
        let bits = |axis: usize, edge: bool| -> Vec<u64> {
            let mut words = vec![0; stride];
            for at in 0..extent.dims[axis] {
                let holds = if edge {
                    extent.holds_edge(axis, at)
                } else {
                    extent.holds_voxel(axis, at)
                };
                words[at / 64] |= u64::from(holds) << (at % 64);
            }
            words
        };
        let (along, across) = (bits(0, true), bits(0, false));
        let planes = self.count + 3;
        let ny = self.ny;
        for plane in 0..planes {
            let Some(z) = (self.first + plane).checked_sub(1) else {
                continue;
            };
            for y in 0..ny {
                let at = (plane * ny + y) * stride;
                let (own_y, own_z) = (extent.holds_voxel(1, y), extent.holds_voxel(2, z));
                let next_y = own_z && extent.holds_edge(1, y);
                let next_z = own_y && plane + 1 < planes && extent.holds_edge(2, z);
                for i in 0..stride {
                    let word = self.inside[at + i];
                    let after = if i + 1 < stride {
                        self.inside[at + i + 1] << 63
                    } else {
                        0
                    };
                    if own_y && own_z {
                        self.crossed[0][at + i] = (word ^ (word >> 1 | after)) & along[i];
                    }
                    if next_y {
                        self.crossed[1][at + i] = (word ^ self.inside[at + stride + i]) & across[i];
                    }
                    if next_z {
                        self.crossed[2][at + i] =
                            (word ^ self.inside[at + ny * stride + i]) & across[i];
                    }
                }
            }
        }
    }

    /// What is inside in row `y` of slice `first + k`.
    #[inline]
    pub(in crate::volume) fn inside(&self, k: usize, y: usize) -> &[u64] {
        let at = ((k + 1) * self.ny + y) * self.stride;
        &self.inside[at..at + self.stride]
    }

    /// Which edges along `axis` that start in row `y` of slice `first + k` are crossed; `k` may be -1.
    #[inline]
    pub(in crate::volume) fn crossed(&self, axis: usize, k: isize, y: usize) -> &[u64] {
        let at = ((k + 1) as usize * self.ny + y) * self.stride;
        &self.crossed[axis][at..at + self.stride]
    }

    /// Those crossed edges whose next one along the axis, on either side, is crossed too: a part of
    /// one voxel's thickness lies between.
    pub(in crate::volume) fn thin(&self, axis: usize, k: usize, y: usize, word: usize) -> u64 {
        let k = k as isize;
        let own = self.crossed(axis, k, y);
        let at = own[word];
        if at == 0 {
            return 0;
        }
        let beside = match axis {
            0 => {
                let before = if word > 0 { own[word - 1] >> 63 } else { 0 };
                let after = own.get(word + 1).map_or(0, |w| w << 63);
                (at << 1 | before) | (at >> 1 | after)
            }
            1 => {
                let before = if y > 0 {
                    self.crossed(1, k, y - 1)[word]
                } else {
                    0
                };
                let after = if y + 1 < self.ny {
                    self.crossed(1, k, y + 1)[word]
                } else {
                    0
                };
                before | after
            }
            _ => self.crossed(2, k - 1, y)[word] | self.crossed(2, k + 1, y)[word],
        };
        at & beside
    }
}

/// Bits of the bytes that equal a label.
fn equal_bytes(row: &[u8], label: f64, to: &mut [u64]) {
    to.fill(0);
    if !(0.0..=255.0).contains(&label) || label.fract() != 0.0 {
        return;
    }
    let label = label as u8;
    let wanted = u8x16::splat(label);
    let (chunks, rest) = row.as_chunks::<16>();
    for (i, chunk) in chunks.iter().enumerate() {
        let mask = u8x16::from(*chunk).simd_eq(wanted).to_bitmask();
        to[i / 4] |= u64::from(mask) << (16 * (i % 4));
    }
    let done = row.len() - rest.len();
    for (i, value) in rest.iter().enumerate() {
        let x = done + i;
        to[x / 64] |= u64::from(*value == label) << (x % 64);
    }
}

impl Select {
    /// Sets the bits of one slice; `out` is one slice deep.
    pub(super) fn read(&self, volume: &Volume, z: usize, out: &mut BitGrid) {
        let [nx, ny, _] = out.dims();
        with_samples!(&volume.data, v => {
            out.clear();
            let rows = v[z * nx * ny..][..nx * ny].chunks_exact(nx);
            for (y, row) in rows.enumerate() {
                let to = out.row_mut(y, 0);
                for (values, word) in row.chunks(64).zip(to) {
                    for (i, value) in values.iter().enumerate() {
                        *word |= u64::from(self.takes(*value as f64)) << i;
                    }
                }
            }
        }, _ => {
            volume.read_bit_slices(z, out);
            if !self.takes(1.0) {
                let row_bits = nx;
                for y in 0..ny {
                    for (i, word) in out.row_mut(y, 0).iter_mut().enumerate() {
                        let held = u64::MAX >> (64 - (row_bits - 64 * i).min(64));
                        *word = if self.takes(0.0) { !*word & held } else { 0 };
                    }
                }
            } else if self.takes(0.0) {
                for y in 0..ny {
                    crate::volume::bits::set_run(out.row_mut(y, 0), 0, nx);
                }
            }
        });
    }
}
