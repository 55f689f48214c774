//! The surface of a binary volume as a mesh of voxel faces.

use super::bits::BitGrid;
use super::{Data, Frame, Volume};
use crate::error::{Error, Result};
use crate::mesh::{Mesh, Polygons};
use crate::numeric::vector::{Vec3, add, scale};
use rayon::prelude::*;

/// Slices that one thread works on at a time.
const SLAB: usize = 8;

/// A mesh holds this many faces at most: the corners of its quads are counted in 32 bits.
const MOST_FACES: u64 = (u32::MAX / 4) as u64;

/// The six sides of a voxel: the step to the neighbour, and the four corners counter-clockwise
/// from outside, as steps from the voxel's lower corner.
const SIDES: [([isize; 3], [[usize; 3]; 4]); 6] = [
    ([-1, 0, 0], [[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 1, 0]]),
    ([1, 0, 0], [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]]),
    ([0, -1, 0], [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]]),
    ([0, 1, 0], [[0, 1, 0], [0, 1, 1], [1, 1, 1], [1, 1, 0]]),
    ([0, 0, -1], [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]]),
    ([0, 0, 1], [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]),
];

/// Number of faces between a set voxel and one that is not set or is outside of the grid.
///
/// Numbers other than 0 count as set. A sparse volume is read a few slices at a time. Cost: a few
/// operations per 64 voxels.
#[cfg(test)]
fn count_faces(volume: &Volume) -> u64 {
    slabs(volume)
        .into_par_iter()
        .map(|z0| Slab::read(volume, z0).count())
        .map(|counts| counts.faces)
        .sum()
}

/// The faces between set voxels and what is not set, as a mesh of squares.
///
/// Each face is one quad of `polygons` and two of `triangles` (2 f and 2 f + 1 for face f), counter-
/// clockwise from outside, and begins at its corner of lowest lattice place. Voxel (i, j, k) reaches from half a step below to half a
/// step above its centre. Faces follow the voxels, x fastest, and within a voxel the sides -x, +x,
/// -y, +y, -z, +z. Vertices are the lattice corners that faces use, each once, x fastest: voxels
/// that touch along an edge only share its two vertices. The same on any number of threads.
///
/// Numbers other than 0 count as set. An [`Error::Limit`] refuses more than 2^30 - 1 faces. A sparse
/// volume is read a few slices at a time. Cost: a few operations per 64 voxels, and the faces.
pub fn boundary_faces(volume: &Volume) -> Result<Mesh> {
    let starts = slabs(volume);
    let counts: Vec<Counts> = starts
        .par_iter()
        .map(|z0| Slab::read(volume, *z0).count())
        .collect();
    let faces: u64 = counts.iter().map(|c| c.faces).sum();
    let vertices: u64 = counts.iter().map(|c| c.vertices).sum();
    if faces > MOST_FACES {
        return Err(Error::Limit {
            what: "the surface of the voxels".into(),
            needed: format!("{faces} faces"),
            limit: format!("{MOST_FACES} faces"),
            hint: Some("lower the resolution".into()),
        });
    }
    let mut first_vertex = 0u32;
    let bases: Vec<u32> = counts
        .iter()
        .map(|c| {
            let base = first_vertex;
            // There are no more vertices than corners of faces, which fit.
            first_vertex += c.vertices as u32;
            base
        })
        .collect();
    let flip = volume.frame.is_mirrored();
    let parts: Vec<(Vec<Vec3>, Vec<[u32; 4]>)> = starts
        .par_iter()
        .zip(&bases)
        .map(|(z0, base)| Slab::read(volume, *z0).build(&volume.frame, *base, flip))
        .collect();
    let mut mesh = Mesh {
        positions: Vec::with_capacity(vertices as usize),
        triangles: Vec::with_capacity(2 * faces as usize),
        ..Mesh::default()
    };
    let mut corners = Vec::with_capacity(4 * faces as usize);
    for (positions, quads) in parts {
        mesh.positions.extend(positions);
        for [a, b, c, d] in quads {
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
            corners.extend([a, b, c, d]);
        }
    }
    let starts = (0..=faces as u32).map(|f| 4 * f).collect();
    mesh.polygons = Some(Polygons { starts, corners });
    Ok(mesh)
}

fn slabs(volume: &Volume) -> Vec<usize> {
    if volume.frame.is_empty() {
        return Vec::new();
    }
    (0..volume.frame.dims[2]).step_by(SLAB).collect()
}

#[derive(Clone, Copy)]
struct Counts {
    faces: u64,
    /// Of the lattice planes below the slab's slices, and of the last plane above the last slab.
    vertices: u64,
}

/// Some slices of a volume, with a neighbour on either side.
struct Slab {
    /// Slices from `z0 - 1` on (0 below the volume).
    bits: BitGrid,
    z0: usize,
    /// Slices of its own.
    depth: usize,
    /// Whether it holds the uppermost slice.
    last: bool,
}

impl Slab {
    fn read(volume: &Volume, z0: usize) -> Slab {
        let [nx, ny, nz] = volume.frame.dims;
        let depth = SLAB.min(nz - z0);
        let (from, to) = (z0.saturating_sub(1), (z0 + depth + 1).min(nz));
        let mut read = BitGrid::new([nx, ny, to - from]);
        volume.read_bit_slices(from, &mut read);
        let bits = if to - from == depth + 2 {
            read
        } else {
            // An empty slice where the volume has none.
            let mut padded = BitGrid::new([nx, ny, depth + 2]);
            let slice = padded.stride() * ny;
            let at = usize::from(z0 == 0) * slice;
            padded.words_mut()[at..at + read.words().len()].copy_from_slice(read.words());
            padded
        };
        Slab {
            bits,
            z0,
            depth,
            last: z0 + depth == nz,
        }
    }

    /// Word `w` of a row; 0 outside of the grid. Slice 0 is the one below the slab.
    fn word(&self, w: usize, y: isize, slice: usize) -> u64 {
        match usize::try_from(y) {
            Ok(y) if y < self.bits.dims()[1] => {
                self.bits.row(y, slice).get(w).copied().unwrap_or(0)
            }
            _ => 0,
        }
    }

    /// For 64 voxels of a row, which have each side exposed.
    fn exposed(&self, w: usize, y: usize, slice: usize) -> [u64; 6] {
        let row = self.bits.row(y, slice);
        let set = row[w];
        if set == 0 {
            return [0; 6];
        }
        let y = y as isize;
        let below = if w > 0 { row[w - 1] >> 63 } else { 0 };
        let above = row.get(w + 1).copied().unwrap_or(0) << 63;
        let neighbours = [
            set << 1 | below,
            set >> 1 | above,
            self.word(w, y - 1, slice),
            self.word(w, y + 1, slice),
            self.word(w, y, slice - 1),
            self.word(w, y, slice + 1),
        ];
        neighbours.map(|n| set & !n)
    }

    /// The corners of a lattice plane that faces use, a bit each: those whose eight voxels are not
    /// all alike. The plane is the one below `slice`.
    fn used(&self, slice: usize) -> Ranks {
        let [nx, ny, _] = self.bits.dims();
        let stride = (nx + 1).div_ceil(64);
        let mut words = vec![0u64; stride * (ny + 1)];
        for y in 0..=ny {
            let mut carried = (0, 0);
            for w in 0..stride {
                let four = [(0, 1), (0, 0), (1, 1), (1, 0)]
                    .map(|(dz, dy)| self.word(w, y as isize - dy, slice - dz));
                let any = four[0] | four[1] | four[2] | four[3];
                let all = four[0] & four[1] & four[2] & four[3];
                let any_left = any << 1 | carried.0;
                let all_left = all << 1 | carried.1;
                words[y * stride + w] = (any | any_left) & !(all & all_left);
                carried = (any >> 63, all >> 63);
            }
        }
        let mut total = 0;
        let before = words
            .iter()
            .map(|w| {
                let before = total;
                total += w.count_ones();
                before
            })
            .collect();
        Ranks {
            stride,
            words,
            before,
            total,
        }
    }

    /// The planes whose vertices are this slab's own.
    fn own_planes(&self) -> usize {
        self.depth + usize::from(self.last)
    }

    fn count(&self) -> Counts {
        let [_, ny, _] = self.bits.dims();
        let mut faces = 0;
        for slice in 1..=self.depth {
            for y in 0..ny {
                for w in 0..self.bits.stride() {
                    let sides = self.exposed(w, y, slice);
                    faces += sides.map(u64::count_ones).iter().sum::<u32>() as u64;
                }
            }
        }
        let vertices = (1..=self.own_planes())
            .map(|plane| u64::from(self.used(plane).total))
            .sum();
        Counts { faces, vertices }
    }

    /// Vertices and quads, with vertices counted from `base`.
    fn build(&self, frame: &Frame, base: u32, flip: bool) -> (Vec<Vec3>, Vec<[u32; 4]>) {
        let [_, ny, _] = self.bits.dims();
        let mut positions = Vec::new();
        let mut quads = Vec::new();
        let (mut lower, mut first) = (self.used(1), base);
        lower.place(frame, self.z0, &mut positions);
        for slice in 1..=self.depth {
            let upper = self.used(slice + 1);
            if slice < self.own_planes() {
                upper.place(frame, self.z0 + slice, &mut positions);
            }
            let planes = [(&lower, first), (&upper, first + lower.total)];
            for y in 0..ny {
                for w in 0..self.bits.stride() {
                    let sides = self.exposed(w, y, slice);
                    let mut left = sides.iter().fold(0, |all, s| all | s);
                    while left != 0 {
                        let bit = left.trailing_zeros() as usize;
                        left &= left - 1;
                        for (side, (_, corners)) in sides.iter().zip(&SIDES) {
                            if side >> bit & 1 == 0 {
                                continue;
                            }
                            let mut quad = corners.map(|[dx, dy, dz]| {
                                let (ranks, first) = planes[dz];
                                first + ranks.of(w * 64 + bit + dx, y + dy)
                            });
                            if flip {
                                quad.swap(1, 3);
                            }
                            quads.push(quad);
                        }
                    }
                }
            }
            first += lower.total;
            lower = upper;
        }
        (positions, quads)
    }
}

/// A plane of bits in which the number of bits before a place can be asked.
struct Ranks {
    stride: usize,
    words: Vec<u64>,
    before: Vec<u32>,
    total: u32,
}

impl Ranks {
    fn of(&self, x: usize, y: usize) -> u32 {
        let at = y * self.stride + x / 64;
        self.before[at] + (self.words[at] & ((1 << (x % 64)) - 1)).count_ones()
    }

    /// Appends the places of its corners, those of lattice plane `z`.
    fn place(&self, frame: &Frame, z: usize, positions: &mut Vec<Vec3>) {
        for (at, word) in self.words.iter().enumerate() {
            let mut left = *word;
            while left != 0 {
                let x = at % self.stride * 64 + left.trailing_zeros() as usize;
                left &= left - 1;
                positions.push(lattice(frame, [x, at / self.stride, z]));
            }
        }
    }
}

/// The lower corner of a voxel.
fn lattice(frame: &Frame, at: [usize; 3]) -> Vec3 {
    (0..3).fold(frame.origin, |p, a| {
        add(p, scale(frame.axes[a], at[a] as f64 - 0.5))
    })
}

/// The volume with blocks of `factor^3` voxels made one, which is set when any of them is.
///
/// `factor` is the least power of two that leaves at most `max_edge` voxels on the longest side; it
/// is returned too, 1 where nothing had to be done. Numbers other than 0 count as set. The new
/// voxels lie over the old ones: the lower corner of the grid stays, the upper one may move out. A
/// sparse volume is read `factor` slices at a time. Cost: linear in the stored voxels.
pub fn reduced(volume: &Volume, max_edge: usize) -> (Volume, usize) {
    let frame = volume.frame;
    let longest = frame.dims.into_iter().max().unwrap_or(0);
    let mut shift = 0;
    while longest.div_ceil(1 << shift) > max_edge.max(1) {
        shift += 1;
    }
    let factor = 1usize << shift;
    let dims = frame.dims.map(|d| d.div_ceil(factor));
    let mut small = BitGrid::new(dims);
    if !frame.is_empty() {
        let slice = small.stride() * dims[1];
        small
            .words_mut()
            .par_chunks_mut(slice)
            .enumerate()
            .for_each(|(z, words)| reduce_slice(volume, z, shift, words));
    }
    // The centre of the first block, half a block less half a voxel further.
    let move_by = (factor - 1) as f64 * 0.5;
    let origin = frame
        .axes
        .iter()
        .fold(frame.origin, |p, axis| add(p, scale(*axis, move_by)));
    let reduced = Volume {
        frame: Frame {
            dims,
            origin,
            axes: frame.axes.map(|axis| scale(axis, factor as f64)),
        },
        data: Data::Bits(small),
    };
    (reduced, factor)
}

/// Fills one slice of the reduced grid.
fn reduce_slice(volume: &Volume, z: usize, shift: u32, words: &mut [u64]) {
    let [nx, ny, nz] = volume.frame.dims;
    let z0 = z << shift;
    let mut read = BitGrid::new([nx, ny, (1usize << shift).min(nz - z0)]);
    volume.read_bit_slices(z0, &mut read);
    let stride = nx.div_ceil(1 << shift).div_ceil(64);
    for slice in 0..read.dims()[2] {
        for y in 0..ny {
            let row = &mut words[(y >> shift) * stride..][..stride];
            for (w, word) in read.row(y, slice).iter().enumerate() {
                let mut left = *word;
                while left != 0 {
                    let x = (w * 64 + left.trailing_zeros() as usize) >> shift;
                    row[x / 64] |= 1 << (x % 64);
                    // The rest of the block adds nothing.
                    let next = ((x + 1) << shift) - w * 64;
                    left = if next < 64 { left >> next << next } else { 0 };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::numeric::vector::{cross, dot};
    use std::collections::BTreeMap;

    fn random(dims: [usize; 3], share: f64, seed: u64) -> Volume {
        let mut rng = Rng::new(seed, 1);
        let mut bits = BitGrid::new(dims);
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                for x in 0..dims[0] {
                    if rng.unit() < share {
                        bits.set(x, y, z);
                    }
                }
            }
        }
        Volume {
            frame: Frame::straight(dims, [10.0, -3.0, 0.5], [0.5, 1.0, 2.0]),
            data: Data::Bits(bits),
        }
    }

    fn is_set(volume: &Volume, at: [isize; 3]) -> bool {
        let dims = volume.frame.dims;
        let Data::Bits(bits) = &volume.data else {
            return false;
        };
        (0..3).all(|a| (0..dims[a] as isize).contains(&at[a]))
            && bits.get(at[0] as usize, at[1] as usize, at[2] as usize)
    }

    fn signed_volume(mesh: &Mesh) -> f64 {
        let six: f64 = (0..mesh.triangles.len())
            .map(|t| mesh.corners(t))
            .map(|[a, b, c]| dot(a, cross(b, c)))
            .sum();
        six / 6.0
    }

    /// Quads found voxel by voxel, as corner positions.
    fn plain(volume: &Volume) -> Vec<[Vec3; 4]> {
        let [nx, ny, nz] = volume.frame.dims;
        let mut quads = Vec::new();
        for i in 0..nx * ny * nz {
            let at = [i % nx, i / nx % ny, i / nx / ny];
            if !is_set(volume, at.map(|c| c as isize)) {
                continue;
            }
            for (step, corners) in SIDES {
                if !is_set(volume, std::array::from_fn(|a| at[a] as isize + step[a])) {
                    quads
                        .push(corners.map(|c| {
                            lattice(&volume.frame, std::array::from_fn(|a| at[a] + c[a]))
                        }));
                }
            }
        }
        quads
    }

    #[test]
    fn faces_are_those_found_one_by_one_and_in_their_order() {
        for (dims, share) in [
            ([1, 1, 1], 1.0),
            ([5, 4, 3], 0.5),
            ([64, 3, 9], 0.9),
            ([65, 2, 17], 0.3),
            ([130, 5, 8], 0.97),
            ([63, 1, 1], 0.5),
            ([7, 7, 16], 0.0),
        ] {
            let volume = random(dims, share, dims[0] as u64);
            let mesh = boundary_faces(&volume).expect("few faces");
            mesh.check().expect("a sound mesh");
            let polygons = mesh.polygons.as_ref().expect("quads");
            let found: Vec<[Vec3; 4]> = polygons
                .iter()
                .map(|q| [0, 1, 2, 3].map(|i| mesh.positions[q[i] as usize]))
                .collect();
            assert_eq!(found, plain(&volume), "{dims:?}");
            assert_eq!(count_faces(&volume), found.len() as u64);
            assert_eq!(mesh.triangles.len(), 2 * found.len());
            // Every vertex is used, and none is there twice.
            let mut places: Vec<_> = mesh.positions.iter().map(|p| p.map(f64::to_bits)).collect();
            places.sort_unstable();
            places.dedup();
            assert_eq!(places.len(), mesh.positions.len());
            let mut used = vec![false; places.len()];
            mesh.triangles
                .iter()
                .flatten()
                .for_each(|v| used[*v as usize] = true);
            assert!(used.iter().all(|u| *u));
        }
    }

    #[test]
    fn the_surface_is_balanced_and_holds_the_voxels() {
        let volume = random([20, 21, 22], 0.4, 3);
        let mesh = boundary_faces(&volume).expect("few faces");
        let mut edges: BTreeMap<(u32, u32), i32> = BTreeMap::new();
        for [a, b, c] in &mesh.triangles {
            for (a, b) in [(*a, *b), (*b, *c), (*c, *a)] {
                *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|n| *n == 0));
        let wanted = volume.count_set() as f64;
        assert!((signed_volume(&mesh) - wanted).abs() < 1e-6 * wanted);
    }

    #[test]
    fn a_mirrored_frame_still_faces_outwards() {
        let mut volume = random([4, 5, 6], 0.5, 9);
        volume.frame.axes[1] = [0.0, -1.0, 0.0];
        let mesh = boundary_faces(&volume).expect("few faces");
        let wanted = volume.count_set() as f64;
        assert!((signed_volume(&mesh) - wanted).abs() < 1e-9 * wanted);
    }

    #[test]
    fn numbers_and_threads_change_nothing() {
        let volume = random([33, 20, 19], 0.5, 4);
        let mut bytes = Vec::new();
        volume
            .for_each_slice(|_, slice| {
                bytes.extend(slice.iter().map(|v| *v as u8));
                Ok::<(), ()>(())
            })
            .expect("no error is made");
        let numbers = Volume {
            data: Data::U8(bytes),
            ..volume.clone()
        };
        let on = |threads, volume: &Volume| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a pool");
            pool.install(|| boundary_faces(volume)).expect("few faces")
        };
        let one = on(1, &volume);
        assert_eq!(one, on(4, &volume));
        assert_eq!(one, on(2, &numbers));
    }

    #[test]
    fn an_empty_grid_has_no_faces() {
        let volume = random([0, 4, 4], 0.0, 0);
        assert_eq!(count_faces(&volume), 0);
        let mesh = boundary_faces(&volume).expect("none");
        assert!(mesh.is_empty() && mesh.face_count() == 0);
        assert_eq!(reduced(&volume, 2).0.frame.dims, [0, 2, 2]);
    }

    #[test]
    fn a_block_is_set_when_a_voxel_in_it_is() {
        for (dims, share, edge) in [
            ([130, 9, 21], 0.02, 40),
            ([70, 70, 3], 0.3, 9),
            ([5, 5, 5], 0.5, 5),
            ([200, 2, 2], 0.01, 1),
        ] {
            let volume = random(dims, share, 5);
            let (small, factor) = reduced(&volume, edge);
            small.check().expect("a sound volume");
            assert!(small.frame.dims.iter().all(|d| *d <= edge));
            assert_eq!(factor == 1, dims.iter().all(|d| *d <= edge));
            let mut wanted = BitGrid::new(small.frame.dims);
            for i in 0..volume.frame.len() {
                let at = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
                if is_set(&volume, at.map(|c| c as isize)) {
                    let [x, y, z] = at.map(|c| c / factor);
                    wanted.set(x, y, z);
                }
            }
            assert_eq!(small.data, Data::Bits(wanted), "{dims:?}");
            assert_eq!(
                lattice(&small.frame, [0; 3]),
                lattice(&volume.frame, [0; 3])
            );
        }
    }
}
