//! Comparing two volumes of which at least one holds numbers.

use super::{Amounts, Found, LabelOverlap, place};
use crate::progress::Progress;
use crate::volume::bits::BitGrid;
use crate::volume::{Data, Volume};
use crate::with_samples;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// Voxels of a parallel step, where a row is not longer.
const STEP: usize = 1 << 16;
/// Voxels between two merges, where a slice is not larger.
const BLOCK: usize = 1 << 24;
/// Fractions of a type of 64 bits are whole and exact up to here.
const EXACT: f64 = (1u64 << 53) as f64;

/// Voxels that have a label in the first volume, in the second, in both.
type Counts = [u64; 3];

/// Some slices of a volume, ready to be read by rows.
enum Slices<'a> {
    Numbers(&'a Data),
    /// Slices from the given one on.
    Bits(&'a BitGrid, usize),
}

/// What some voxels say, in a fixed order of additions.
#[derive(Default)]
struct Tally {
    differing: u64,
    first: Option<usize>,
    undefined: u64,
    max: f64,
    max_at: Option<usize>,
    sum: f64,
    squares: f64,
}

impl Tally {
    fn then(&mut self, next: &Tally) {
        self.differing += next.differing;
        self.first = self.first.or(next.first);
        self.undefined += next.undefined;
        if next.max > self.max {
            self.max = next.max;
            self.max_at = next.max_at;
        }
        self.sum += next.sum;
        self.squares += next.squares;
    }

    /// Voxel `at` differs by `gap`, which is not 0.
    #[inline]
    fn differs(&mut self, at: usize, gap: f64) {
        self.differing += 1;
        self.first = self.first.or(Some(at));
        if !gap.is_finite() {
            self.undefined += 1;
            return;
        }
        if gap > self.max {
            self.max = gap;
            self.max_at = Some(at);
        }
        self.sum += gap;
        self.squares += gap * gap;
    }
}

/// Counts of labels, as long as they are whole numbers and not too many.
struct Labels {
    counts: HashMap<i128, Counts>,
    most: usize,
    /// The pair that the voxels just seen have, and how many in a row.
    run: (i128, i128, u64),
}

impl Labels {
    fn new(most: usize) -> Self {
        Labels {
            counts: HashMap::new(),
            most,
            run: (0, 0, 0),
        }
    }

    #[inline]
    fn add(&mut self, a: i128, b: i128) {
        if (a, b) == (self.run.0, self.run.1) {
            self.run.2 += 1;
        } else {
            self.end_run();
            self.run = (a, b, 1);
        }
    }

    fn end_run(&mut self) {
        let (a, b, count) = self.run;
        if count > 0 {
            self.counts.entry(a).or_default()[0] += count;
            self.counts.entry(b).or_default()[1] += count;
            if a == b {
                self.counts.entry(a).or_default()[2] += count;
            }
        }
        self.run.2 = 0;
    }

    fn are_too_many(&self) -> bool {
        self.counts.len() > self.most
    }
}

/// Compares two volumes of the same dims; with more than `most` labels they are amounts alone.
pub fn compare(a: &Volume, b: &Volume, most: usize, progress: &dyn Progress) -> Found {
    let [nx, ny, nz] = a.frame.dims;
    let whole = is_whole(&a.data) && is_whole(&b.data);
    let depth = (BLOCK / (nx * ny).max(1)).clamp(1, nz.max(1));
    let rows_in_step = (STEP / nx.max(1)).max(1);
    let mut total = Tally::default();
    let mut labels = Some(BTreeMap::new());
    let mut room = [BitGrid::new([0; 3]), BitGrid::new([0; 3])];
    for z in (0..nz).step_by(depth) {
        let rows = z * ny..(z + depth).min(nz) * ny;
        let [room_a, room_b] = &mut room;
        let from_a = slices(a, z, rows.len() / ny.max(1), room_a);
        let from_b = slices(b, z, rows.len() / ny.max(1), room_b);
        let steps: Vec<usize> = rows.clone().step_by(rows_in_step).collect();
        let wanted = labels.is_some();
        let parts: Vec<(Tally, Option<Labels>)> = steps
            .into_par_iter()
            .map(|first| {
                let step = first..(first + rows_in_step).min(rows.end);
                let labels = wanted.then(|| Labels::new(most));
                if whole {
                    compare_rows(
                        step,
                        [nx, ny],
                        [&from_a, &from_b],
                        labels,
                        whole_row,
                        tally_whole,
                    )
                } else {
                    compare_rows(
                        step,
                        [nx, ny],
                        [&from_a, &from_b],
                        labels,
                        real_row,
                        tally_real,
                    )
                }
            })
            .collect();
        for (tally, part) in parts {
            total.then(&tally);
            labels = merge(labels, part, most);
        }
        progress.advance(depth.min(nz - z) as u64);
    }
    found(&total, labels, a.frame.dims)
}

fn found(total: &Tally, labels: Option<BTreeMap<i128, Counts>>, dims: [usize; 3]) -> Found {
    let voxels = dims.iter().product::<usize>() as u64;
    let count = (voxels - total.undefined).max(1) as f64;
    Found {
        differing: total.differing,
        first: total.first,
        labels: labels.map(|labels| {
            labels
                .into_iter()
                .map(|(label, counts)| LabelOverlap::new(label, counts))
                .collect()
        }),
        amounts: Some(Amounts {
            max: total.max,
            max_at: total.max_at.map(|at| place(at, dims)),
            mean: total.sum / count,
            rms: (total.squares / count).sqrt(),
            undefined: total.undefined,
        }),
    }
}

/// All counts so far and those of the next part, unless either has given up or they are too many.
fn merge(
    all: Option<BTreeMap<i128, Counts>>,
    part: Option<Labels>,
    most: usize,
) -> Option<BTreeMap<i128, Counts>> {
    let (mut all, part) = all.zip(part)?;
    for (label, counts) in part.counts {
        let sum = all.entry(label).or_insert([0; 3]);
        for (sum, count) in sum.iter_mut().zip(counts) {
            *sum += count;
        }
    }
    (all.len() <= most).then_some(all)
}

fn is_whole(data: &Data) -> bool {
    !matches!(data, Data::F32(_) | Data::F64(_))
}

fn slices<'a>(volume: &'a Volume, z: usize, count: usize, room: &'a mut BitGrid) -> Slices<'a> {
    let [nx, ny, _] = volume.frame.dims;
    match &volume.data {
        Data::Bits(grid) => Slices::Bits(grid, 0),
        Data::Sparse(_) => {
            if room.dims() != [nx, ny, count] {
                *room = BitGrid::new([nx, ny, count]);
            }
            volume.read_bit_slices(z, room);
            Slices::Bits(room, z)
        }
        data => Slices::Numbers(data),
    }
}

/// Compares rows (counted through all slices) one after the other.
fn compare_rows<T>(
    rows: std::ops::Range<usize>,
    [nx, ny]: [usize; 2],
    [a, b]: [&Slices; 2],
    mut labels: Option<Labels>,
    read: impl Fn(&Slices, usize, [usize; 2], &mut Vec<T>),
    tally: impl Fn(&[T], &[T], usize, &mut Tally, &mut Option<Labels>),
) -> (Tally, Option<Labels>) {
    let mut total = Tally::default();
    let (mut row_a, mut row_b) = (Vec::with_capacity(nx), Vec::with_capacity(nx));
    for row in rows {
        row_a.clear();
        row_b.clear();
        read(a, row, [nx, ny], &mut row_a);
        read(b, row, [nx, ny], &mut row_b);
        tally(&row_a, &row_b, row * nx, &mut total, &mut labels);
        if labels.as_ref().is_some_and(Labels::are_too_many) {
            labels = None;
        }
    }
    if let Some(labels) = &mut labels {
        labels.end_run();
    }
    (total, labels)
}

/// A row of bits or of whole numbers; fractions are cut off.
fn whole_row(slices: &Slices, row: usize, [nx, ny]: [usize; 2], out: &mut Vec<i128>) {
    match slices {
        Slices::Bits(grid, z0) => {
            let (y, z) = (row % ny, row / ny - z0);
            out.extend((0..nx).map(|x| i128::from(grid.get(x, y, z))));
        }
        Slices::Numbers(data) => with_samples!(data, v => {
            out.extend(v[row * nx..][..nx].iter().map(|s| *s as i128));
        }, _ => {}),
    }
}

#[allow(clippy::unnecessary_cast)] // one of the ten types is f64 already
fn real_row(slices: &Slices, row: usize, [nx, ny]: [usize; 2], out: &mut Vec<f64>) {
    match slices {
        Slices::Bits(grid, z0) => {
            let (y, z) = (row % ny, row / ny - z0);
            out.extend((0..nx).map(|x| f64::from(u8::from(grid.get(x, y, z)))));
        }
        Slices::Numbers(data) => with_samples!(data, v => {
            out.extend(v[row * nx..][..nx].iter().map(|s| *s as f64));
        }, _ => {}),
    }
}

fn tally_whole(
    a: &[i128],
    b: &[i128],
    start: usize,
    tally: &mut Tally,
    labels: &mut Option<Labels>,
) {
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        if a != b {
            tally.differs(start + i, (a - b).unsigned_abs() as f64);
        }
        if let Some(labels) = labels {
            labels.add(*a, *b);
        }
    }
}

fn tally_real(a: &[f64], b: &[f64], start: usize, tally: &mut Tally, labels: &mut Option<Labels>) {
    let is_label = |v: f64| v.abs() <= EXACT && v.trunc() == v;
    for (i, (&a, &b)) in a.iter().zip(b).enumerate() {
        if a != b && !(a.is_nan() && b.is_nan()) {
            tally.differs(start + i, (a - b).abs());
        }
        match labels {
            Some(labels) if is_label(a) && is_label(b) => labels.add(a as i128, b as i128),
            _ => *labels = None,
        }
    }
}
