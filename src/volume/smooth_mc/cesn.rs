//! Constrained elastic surface nets, for comparison.
//!
//! A vertex for each cell whose corners are not all on one side, joined to those of the cells beyond
//! the faces that the surface passes, drawn together while each stays in its cell. A square about each
//! edge between voxels lies between them along that edge, wherever its corners are in their cells: no
//! voxel changes sides.
//!
//! Source: S. F. F. Gibson, "Constrained elastic surface nets: generating smooth surfaces from binary
//! segmented data", 1998.

use super::Stop;
use super::region::STRICT;
use crate::error::{Error, Result};
use crate::numeric::vector::{Vec3, add, dot, length, scale, sub};
use crate::progress::Progress;
use crate::volume::isosurface::slab::{Extent, SLAB, Slab, Source};
use crate::volume::isosurface::{Border, NONE, Select};
use crate::volume::{Frame, Volume};
use rayon::prelude::*;

/// Cells that one thread works on at a time.
const CHUNK: usize = 1 << 12;

/// A relaxed net.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Net {
    /// Twice the middle of the cell of each vertex, in voxels from the centre of voxel (0, 0, 0): all
    /// three are odd.
    pub places: Vec<[i32; 3]>,
    /// Where it lies from there, in voxels along the axes of the grid.
    pub offsets: Vec<Vec3>,
    /// Two for each edge between voxels that the surface passes, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Steps done.
    pub iterations: u32,
    /// The longest way of a vertex in the last step, in the smallest spacing.
    pub last_step: f64,
    /// Why it ended.
    pub stop: Stop,
}

impl Net {
    /// Where vertices are in space.
    pub fn positions(&self, frame: &Frame) -> Vec<Vec3> {
        (self.places.par_iter().zip(&self.offsets))
            .map(|(place, offset)| {
                (0..3).fold(frame.origin, |p, a| {
                    let steps = 0.5 * f64::from(place[a]) + offset[a];
                    add(p, scale(frame.axes[a], steps))
                })
            })
            .collect()
    }
}

/// The net of what is selected, relaxed until no vertex moves by `threshold` (in the smallest spacing)
/// or `max_iterations` steps are done, all vertices at once.
///
/// Where the surface ends at an open border, the net ends in the middle of the last cells. Errs where
/// there are over 2^32 - 2 cells. Cost: one pass over the volume, 64 voxels at a time; per cell of the
/// surface and step about a hundred operations; two slices of numbers, and about 100 bytes per cell.
/// Source: Gibson 1998.
pub fn cesn(
    volume: &Volume,
    select: &Select,
    border: Border,
    threshold: f64,
    max_iterations: u32,
    progress: &dyn Progress,
) -> Result<Net> {
    let mut net = Net {
        stop: Stop::Still,
        ..Net::default()
    };
    if volume.frame.is_empty() {
        return Ok(net);
    }
    let extent = Extent::new(volume.frame.dims, border == Border::Closed);
    let cells = find_cells(volume, select, &extent, progress);
    if cells.is_empty() {
        return Ok(net);
    }
    net.stop = Stop::MaxIterations;
    if cells.len() >= NONE as usize {
        return Err(Error::Limit {
            what: "the surface net".into(),
            needed: format!("{} vertices", cells.len()),
            limit: format!("{} vertices", NONE - 1),
            hint: Some("take a part of the volume".into()),
        });
    }
    let joined = join(&cells, &extent);
    // The margin's grid starts one voxel before the volume's.
    let place = |cell: &Cell| cell.at.map(|c| 2 * (c as i32 - 1) + 1);
    net.places = cells.iter().map(place).collect();
    drop(cells);
    let spacing = volume.frame.spacing();
    let smallest = spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let metric = spacing.map(|s| s / smallest);
    progress.stage("relax", u64::from(max_iterations));
    relax(
        &mut net,
        &joined.neighbours,
        metric,
        [threshold, f64::from(max_iterations)],
        progress,
    );
    net.triangles = split(&net, &joined.squares, metric);
    Ok(net)
}

/// A cell whose corners are not all on one side: its lower corner in the margin's grid, and which of
/// its corners are inside.
#[derive(Debug, Clone, Copy)]
struct Cell {
    at: [u32; 3],
    case: u8,
}

fn find_cells(
    volume: &Volume,
    select: &Select,
    extent: &Extent,
    progress: &dyn Progress,
) -> Vec<Cell> {
    let starts: Vec<usize> = extent.slices().step_by(SLAB).collect();
    progress.stage("extract", starts.len() as u64);
    let parts: Vec<Vec<Cell>> = starts
        .par_iter()
        .map(|first| {
            let slab = Slab::read(volume, &Source::Select(select), extent, *first);
            let mut cells = Vec::new();
            for k in 0..slab.count {
                if slab.first + k >= extent.end(2) {
                    break;
                }
                for y in extent.first()..extent.end(1) {
                    add_row(&slab, extent, [k, y], &mut cells);
                }
            }
            progress.advance(1);
            cells
        })
        .collect();
    parts.concat()
}

fn add_row(slab: &Slab, extent: &Extent, [k, y]: [usize; 2], cells: &mut Vec<Cell>) {
    let rows = [(k, y), (k, y + 1), (k + 1, y), (k + 1, y + 1)].map(|(k, y)| slab.inside(k, y));
    let (first, end) = (extent.first(), extent.end(0));
    for i in 0..slab.stride {
        let low = rows.map(|row| row[i]);
        let high = rows.map(|row| row[i] >> 1 | row.get(i + 1).map_or(0, |w| w << 63));
        let any = low.iter().chain(&high).fold(0, |or, w| or | w);
        let all = low.iter().chain(&high).fold(u64::MAX, |and, w| and & w);
        let mut mixed = any & !all;
        while mixed != 0 {
            let bit = mixed.trailing_zeros() as usize;
            mixed &= mixed - 1;
            let x = 64 * i + bit;
            if x < first || x >= end {
                continue;
            }
            let mut case = 0;
            for n in 0..4 {
                case |= ((low[n] >> bit & 1) as u8 | ((high[n] >> bit & 1) as u8) << 1) << (2 * n);
            }
            cells.push(Cell {
                at: [x, y, slab.first + k].map(|c| c as u32),
                case,
            });
        }
    }
}

/// How cells are joined.
struct Joined {
    /// Beyond the lower and upper face along x, y, z; [`NONE`] where the surface does not pass it.
    neighbours: Vec<[u32; 6]>,
    /// The cells about each crossed edge, counter-clockwise from outside.
    squares: Vec<[u32; 4]>,
}

/// Cells come slice by slice, and each looks back only: at most into the slice before. Numbers are
/// read of cells alone that the surface passes, so that no slice need be cleared.
fn join(cells: &[Cell], extent: &Extent) -> Joined {
    let [nx, ny, _] = extent.dims;
    let mut slices = [vec![NONE; nx * ny], vec![NONE; nx * ny]];
    let mut joined = Joined {
        neighbours: vec![[NONE; 6]; cells.len()],
        squares: Vec::with_capacity(cells.len()),
    };
    let first = extent.first() as u32;
    for (v, cell) in cells.iter().enumerate() {
        let at = cell.at;
        let row = |at: [u32; 3]| at[1] as usize * nx + at[0] as usize;
        slices[at[2] as usize % 2][row(at)] = v as u32;
        let inside = |corner: usize| cell.case >> corner & 1 == 1;
        let back = |axes: usize| {
            let to: [u32; 3] = std::array::from_fn(|a| at[a] - (axes >> a & 1) as u32);
            slices[to[2] as usize % 2][row(to)]
        };
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            let face = [0, 1 << b, 1 << c, 1 << b | 1 << c].map(inside);
            if at[a] > first && face.contains(&true) && face.contains(&false) {
                let other = back(1 << a);
                joined.neighbours[v][2 * a] = other;
                joined.neighbours[other as usize][2 * a + 1] = v as u32;
            }
            // The edge at the cell's lower corner, when all four cells about it are there.
            if inside(0) != inside(1 << a) && at[b] > first && at[c] > first {
                let square = [back(1 << b | 1 << c), back(1 << c), v as u32, back(1 << b)];
                let [p, q, r, s] = square;
                joined
                    .squares
                    .push(if inside(0) { square } else { [p, s, r, q] });
            }
        }
    }
    joined
}

/// Moves all vertices at once to the mean of their neighbours, clipped to their cells.
fn relax(
    net: &mut Net,
    neighbours: &[[u32; 6]],
    metric: Vec3,
    [threshold, most]: [f64; 2],
    progress: &dyn Progress,
) {
    let reach = 0.5 * (1.0 - STRICT);
    let mut offsets = vec![[0.0; 3]; net.places.len()];
    let mut next = offsets.clone();
    while f64::from(net.iterations) < most {
        let longest = next
            .par_iter_mut()
            .enumerate()
            .with_min_len(CHUNK)
            .map(|(v, to)| {
                *to = mean(&neighbours[v], &offsets)
                    .unwrap_or(offsets[v])
                    .map(|c| c.clamp(-reach, reach));
                let way = sub(*to, offsets[v]);
                length(std::array::from_fn(|a| way[a] * metric[a]))
            })
            .reduce(|| 0.0, f64::max);
        std::mem::swap(&mut offsets, &mut next);
        net.iterations += 1;
        net.last_step = longest;
        progress.advance(1);
        if longest < threshold {
            net.stop = Stop::Threshold;
            break;
        }
    }
    net.offsets = offsets;
}

/// The mean of the neighbours, from the middle of the cell between them.
#[inline]
fn mean(neighbours: &[u32; 6], offsets: &[Vec3]) -> Option<Vec3> {
    let (mut sum, mut count) = ([0.0; 3], 0);
    for (side, w) in neighbours.iter().enumerate() {
        if *w != NONE {
            sum = add(sum, offsets[*w as usize]);
            sum[side / 2] += if side % 2 == 1 { 1.0 } else { -1.0 };
            count += 1;
        }
    }
    (count > 0).then(|| scale(sum, 1.0 / f64::from(count)))
}

/// The squares as triangles, along their shorter diagonals.
fn split(net: &Net, squares: &[[u32; 4]], metric: Vec3) -> Vec<[u32; 3]> {
    let square_of_length = |v: u32, w: u32| {
        let (v, w) = (v as usize, w as usize);
        let way = std::array::from_fn(|a| {
            let steps = 0.5 * f64::from(net.places[w][a] - net.places[v][a]);
            (steps + net.offsets[w][a] - net.offsets[v][a]) * metric[a]
        });
        dot(way, way)
    };
    let halves: Vec<[[u32; 3]; 2]> = squares
        .par_iter()
        .with_min_len(CHUNK)
        .map(|[p, q, r, s]| {
            if square_of_length(*p, *r) <= square_of_length(*q, *s) {
                [[*p, *q, *r], [*p, *r, *s]]
            } else {
                [[*p, *q, *s], [*q, *r, *s]]
            }
        })
        .collect();
    halves.into_flattened()
}

#[cfg(test)]
mod tests {
    use super::super::tests::ball;
    use super::*;
    use crate::mesh::Mesh;
    use crate::mesh::topology::topology;
    use crate::numeric::rng::Rng;
    use crate::progress::Silent;
    use crate::volume::Data;
    use crate::volume::isosurface::extract;
    use crate::volume::voxelize::{Fill, Mode, Params, Size, voxelize};

    fn mesh(net: &Net, frame: &Frame) -> Mesh {
        Mesh::from_triangles(net.positions(frame), net.triangles.clone())
    }

    fn enclosed(mesh: &Mesh) -> f64 {
        let report = topology(mesh, &Silent).expect("a report");
        report.volume.expect("a closed mesh")
    }

    #[test]
    fn a_ball_keeps_the_share_of_the_card() {
        let ball = ball(30.0, 64, 31.5);
        let surface = extract(&ball, &Select::Set, Border::Closed, &Silent).expect("a surface");
        let positions = surface.positions(&ball.frame, |_| [0.0; 3]);
        let triangles = surface.triangles(&positions);
        let before = enclosed(&Mesh::from_triangles(positions, triangles));
        let net = cesn(&ball, &Select::Set, Border::Closed, 0.002, 2000, &Silent).expect("a net");
        let share = 100.0 * enclosed(&mesh(&net, &ball.frame)) / before;
        assert!((97.3..=98.0).contains(&share), "{share}");
        assert_eq!(net.stop, Stop::Threshold);
        assert!(net.last_step < 0.002);
        assert_eq!(net.places.len() as u64, surface.cells);
        assert_eq!(net.triangles.len(), 2 * surface.len());
    }

    #[test]
    fn no_voxel_of_random_volumes_changes_sides() {
        let mut rng = Rng::new(11, 0);
        for round in 0..40 {
            let dims = [[16; 3], [70, 5, 9], [3, 4, 20], [1, 1, 1]][round % 4];
            let density = 0.1 + 0.8 * (round % 9) as f64 / 8.0;
            let n = dims.iter().product();
            let mut bits: Vec<u8> = (0..n).map(|_| u8::from(rng.unit() < density)).collect();
            bits[0] = 1;
            let volume = Volume {
                frame: Frame::straight(dims, [0.0; 3], [1.0; 3]),
                data: Data::U8(bits),
            };
            let net =
                cesn(&volume, &Select::Set, Border::Closed, 0.002, 100, &Silent).expect("a net");
            let mesh = mesh(&net, &volume.frame);
            assert!(enclosed(&mesh) > 0.0, "round {round}");
            let [x, y, z] = dims.map(|n| n as f64 - 0.5);
            let params = Params {
                size: Size::VoxelSize(1.0),
                mode: Mode::None,
                fill: Fill::Parity,
                bounds: Some([-0.5, -0.5, -0.5, x, y, z]),
                ..Params::DEFAULT
            };
            let (again, _) = voxelize(&mesh, &params, &Silent).expect("voxels");
            assert_eq!(again.frame.dims, dims);
            let [mut found, mut wanted] = [(); 2].map(|()| crate::volume::bits::BitGrid::new(dims));
            again.read_bit_slices(0, &mut found);
            volume.read_bit_slices(0, &mut wanted);
            assert!(found == wanted, "round {round}");
            for (place, offset) in net.places.iter().zip(&net.offsets) {
                assert!(place.iter().all(|c| c % 2 != 0));
                assert!(offset.iter().all(|c| c.abs() < 0.5));
            }
        }
    }

    #[test]
    fn an_open_net_ends_within_the_volume_and_nothing_has_none() {
        let dims = [7, 6, 5];
        let slab = (0..dims.iter().product()).map(|i: usize| u8::from(i / 42 < 3));
        let volume = Volume {
            frame: Frame::straight(dims, [0.0; 3], [1.0; 3]),
            data: Data::U8(slab.collect()),
        };
        let net = cesn(&volume, &Select::Set, Border::Open, 0.002, 100, &Silent).expect("a net");
        assert_eq!(net.places.len(), 6 * 5);
        assert_eq!(net.triangles.len(), 2 * 5 * 4);
        assert!(net.places.iter().all(|p| p[2] == 5));
        assert!(net.offsets.iter().all(|o| o[2] == 0.0));
        let none = cesn(
            &volume,
            &Select::Equal(7.0),
            Border::Closed,
            0.1,
            9,
            &Silent,
        );
        assert!(none.expect("a net").places.is_empty());
    }

    #[test]
    fn any_number_of_threads_makes_the_same_net() {
        let ball = ball(20.3, 44, 21.4);
        let on = |threads: usize| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a pool")
                .install(|| cesn(&ball, &Select::Set, Border::Closed, 0.002, 30, &Silent))
                .expect("a net")
        };
        let one = on(1);
        for threads in [2, 8] {
            assert!(on(threads) == one);
        }
    }
}
