//! Which of many areas cover a place, without asking each.
//!
//! A grid of square cells lies over all areas. A cell knows, for each area that reaches it, how often the
//! area's rings go around the cell's centre and which edges pass through the cell; the count at a place is
//! the count at the centre, changed by the edges between the two. All counts are exact.

use super::Vec2;
use super::rings::{Fill, crossing, edges, side};
use crate::spatial::aabb::Aabb;
use rayon::prelude::*;

/// What a feature covers on the map: what its rings go around, and discs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Area {
    /// Rings; outer ones counter-clockwise, holes clockwise.
    pub rings: Vec<Vec<Vec2>>,
    /// Discs: centres and radii.
    pub discs: Vec<(Vec2, f64)>,
    /// Which points the rings cover.
    pub fill: Fill,
}

impl Area {
    /// Whether it has neither rings nor discs.
    pub fn is_empty(&self) -> bool {
        self.rings.is_empty() && self.discs.is_empty()
    }

    /// The box around it, flat in z; empty for nothing.
    pub fn bounds(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        for p in self.rings.iter().flatten() {
            bounds = bounds.with([p[0], p[1], 0.0]);
        }
        for (c, r) in &self.discs {
            bounds = bounds.with([c[0] - r, c[1] - r, 0.0]);
            bounds = bounds.with([c[0] + r, c[1] + r, 0.0]);
        }
        bounds
    }
}

/// An area in a cell.
#[derive(Debug, Clone, Copy)]
struct Record {
    area: u32,
    /// Count at the centre of the cell.
    winding: i32,
    /// Its pieces in this cell.
    first: u32,
    count: u32,
}

#[derive(Debug, Clone, Copy)]
enum Piece {
    Edge(Vec2, Vec2),
    Disc(Vec2, f64),
}

/// Cells of a piece-wise grid, and their places.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cells {
    lo: Vec2,
    hi: Vec2,
    size: f64,
    columns: usize,
    rows: usize,
    /// More than the rounding of a cell's border.
    slack: f64,
}

/// Most cells of an index.
const MOST_CELLS: f64 = 4_194_304.0;

impl Cells {
    fn new(bounds: Aabb, target: f64) -> Self {
        let (lo, hi) = ([bounds.lo[0], bounds.lo[1]], [bounds.hi[0], bounds.hi[1]]);
        let extent = [hi[0] - lo[0], hi[1] - lo[1]];
        let longest = extent[0].max(extent[1]);
        let farthest = [lo, hi]
            .iter()
            .flatten()
            .fold(0.0, |m: f64, c| m.max(c.abs()));
        // Cells stay far larger than the roundings of coordinates.
        let least = (4096.0 * f64::EPSILON * farthest).max(longest / target.max(1.0));
        let even = (extent[0] * extent[1] / target.max(1.0)).sqrt();
        let size = even.max(least).max(f64::MIN_POSITIVE);
        let count = |extent: f64| ((extent / size).ceil() as usize).max(1);
        Cells {
            lo,
            hi,
            size,
            columns: count(extent[0]),
            rows: count(extent[1]),
            slack: 1e-9 * size + 8.0 * f64::EPSILON * farthest,
        }
    }

    #[inline]
    fn along(&self, axis: usize, coordinate: f64) -> usize {
        let most = if axis == 0 { self.columns } else { self.rows } - 1;
        // A negative number becomes 0.
        (((coordinate - self.lo[axis]) / self.size) as usize).min(most)
    }

    fn range(&self, axis: usize, low: f64, high: f64) -> std::ops::RangeInclusive<usize> {
        self.along(axis, low - self.slack)..=self.along(axis, high + self.slack)
    }

    #[inline]
    fn centre(&self, column: usize, row: usize) -> Vec2 {
        let at = |axis: usize, cell: usize| self.lo[axis] + (cell as f64 + 0.5) * self.size;
        [at(0, column), at(1, row)]
    }

    /// Calls with all cells that a segment may pass through.
    fn visit_segment(&self, a: Vec2, b: Vec2, mut call: impl FnMut(usize)) {
        let (low, high) = if a[1] <= b[1] { (a, b) } else { (b, a) };
        let slope = (high[0] - low[0]) / (high[1] - low[1]);
        for row in self.range(1, low[1], high[1]) {
            let border = |r: usize| self.lo[1] + r as f64 * self.size;
            let from = (border(row) - self.slack).clamp(low[1], high[1]);
            let to = (border(row + 1) + self.slack).clamp(low[1], high[1]);
            let (mut x0, mut x1) = (low[0], high[0]);
            // A level segment, or one too steep for its slope, takes its whole width.
            if slope.is_finite() && row + 1 < self.rows && row > 0 {
                x0 = low[0] + (from - low[1]) * slope;
                x1 = low[0] + (to - low[1]) * slope;
            }
            let (least, most) = (low[0].min(high[0]), low[0].max(high[0]));
            let left = x0.min(x1).clamp(least, most);
            let right = x0.max(x1).clamp(least, most);
            for column in self.range(0, left, right) {
                call(row * self.columns + column);
            }
        }
    }
}

/// Areas on a grid of cells.
#[derive(Debug, Clone)]
pub struct Index {
    cells: Option<Cells>,
    /// The first record of each cell.
    starts: Vec<u32>,
    records: Vec<Record>,
    pieces: Vec<Piece>,
    fills: Vec<Fill>,
}

/// What one area puts into the cells.
struct Entry {
    cell: u32,
    winding: i32,
    pieces: Vec<Piece>,
}

impl Index {
    /// The index of areas; coordinates are finite.
    ///
    /// Cost: O(n log n) for areas that lie beside each other, with about two cells for each edge; areas that
    /// cover each other many times get larger cells, so that the memory stays in proportion to the edges.
    pub fn build(areas: &[Area]) -> Index {
        let fills = areas.iter().map(|area| area.fill).collect();
        let bounds: Vec<Aabb> = areas.par_iter().map(Area::bounds).collect();
        let all = bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
        if all.is_empty() {
            return Index {
                cells: None,
                starts: Vec::new(),
                records: Vec::new(),
                pieces: Vec::new(),
                fills,
            };
        }
        let cells = fitting(areas, &bounds, all);
        let entries: Vec<Vec<Entry>> = areas
            .par_iter()
            .zip(&bounds)
            .map(|(area, bounds)| entries(area, bounds, &cells))
            .collect();
        let mut starts = vec![0u32; cells.columns * cells.rows + 1];
        for entry in entries.iter().flatten() {
            starts[entry.cell as usize + 1] += 1;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        let empty = Record {
            area: 0,
            winding: 0,
            first: 0,
            count: 0,
        };
        let mut records = vec![empty; entries.iter().map(Vec::len).sum()];
        let mut pieces = Vec::new();
        // Areas in order, so that the records of a cell are too.
        for (area, entries) in entries.into_iter().enumerate() {
            for entry in entries {
                let slot = &mut next[entry.cell as usize];
                records[*slot as usize] = Record {
                    area: area as u32,
                    winding: entry.winding,
                    first: pieces.len() as u32,
                    count: entry.pieces.len() as u32,
                };
                *slot += 1;
                pieces.extend(entry.pieces);
            }
        }
        Index {
            cells: Some(cells),
            starts,
            records,
            pieces,
            fills,
        }
    }

    /// Calls with the index of each area that covers a place, in order.
    ///
    /// Borders are as for [`super::rings::winding`]; discs have their rim. Cost: the edges in one cell, a few
    /// for areas beside each other.
    #[inline]
    pub fn visit(&self, p: Vec2, mut call: impl FnMut(usize)) {
        let Some(cells) = &self.cells else {
            return;
        };
        let inside = (0..2).all(|a| cells.lo[a] <= p[a] && p[a] <= cells.hi[a]);
        if !inside {
            return;
        }
        let (column, row) = (cells.along(0, p[0]), cells.along(1, p[1]));
        let cell = row * cells.columns + column;
        let (from, to) = (self.starts[cell] as usize, self.starts[cell + 1] as usize);
        for record in &self.records[from..to] {
            if self.covers(record, || cells.centre(column, row), p) {
                call(record.area as usize);
            }
        }
    }

    /// The last area that covers a place.
    #[inline]
    pub fn topmost(&self, p: Vec2) -> Option<usize> {
        let mut last = None;
        self.visit(p, |area| last = Some(area));
        last
    }

    /// Bytes it holds.
    pub fn bytes(&self) -> usize {
        self.starts.len() * size_of::<u32>()
            + self.records.len() * size_of::<Record>()
            + self.pieces.len() * size_of::<Piece>()
    }

    #[inline]
    fn covers(&self, record: &Record, centre: impl Fn() -> Vec2, p: Vec2) -> bool {
        let fill = self.fills[record.area as usize];
        if record.count == 0 {
            return fill.covers(record.winding);
        }
        let c = centre();
        // From the centre up or down to the height of the place, then across to it.
        let corner = [c[0], p[1]];
        let mut winding = record.winding;
        let (first, count) = (record.first as usize, record.count as usize);
        for piece in &self.pieces[first..first + count] {
            match *piece {
                Piece::Edge(a, b) => {
                    winding += crossing(a, b, p) - crossing(a, b, corner);
                    winding += crossing_up(a, b, corner) - crossing_up(a, b, c);
                }
                Piece::Disc(centre, radius) => {
                    let d = [p[0] - centre[0], p[1] - centre[1]];
                    if d[0] * d[0] + d[1] * d[1] <= radius * radius {
                        return true;
                    }
                }
            }
        }
        fill.covers(winding)
    }
}

/// As [`crossing`], for a ray that runs up: the same number on closed rings.
#[inline]
fn crossing_up(a: Vec2, b: Vec2, p: Vec2) -> i32 {
    if b[0] <= p[0] && p[0] < a[0] {
        i32::from(side(a, b, p) > 0)
    } else if a[0] <= p[0] && p[0] < b[0] {
        -i32::from(side(a, b, p) < 0)
    } else {
        0
    }
}

/// Cells of which the areas' boxes together cover no more than a few for each edge.
fn fitting(areas: &[Area], bounds: &[Aabb], all: Aabb) -> Cells {
    let count = |area: &Area| area.rings.iter().map(Vec::len).sum::<usize>() + area.discs.len();
    let pieces: usize = areas.iter().map(count).sum();
    let mut target = (2.0 * pieces as f64).clamp(16.0, MOST_CELLS);
    loop {
        let cells = Cells::new(all, target);
        let covered = |b: &Aabb| {
            let side = |axis: usize| (b.hi[axis] - b.lo[axis]) / cells.size + 1.0;
            if b.is_empty() { 0.0 } else { side(0) * side(1) }
        };
        let sum: f64 = bounds.iter().map(covered).sum();
        if sum <= 16.0 * pieces as f64 + 65_536.0 || target <= 16.0 {
            return cells;
        }
        target *= 0.5;
    }
}

fn entries(area: &Area, bounds: &Aabb, cells: &Cells) -> Vec<Entry> {
    if bounds.is_empty() {
        return Vec::new();
    }
    let rows = cells.range(1, bounds.lo[1], bounds.hi[1]);
    let columns = cells.range(0, bounds.lo[0], bounds.hi[0]);
    let first = (*columns.start(), *rows.start());
    let width = columns.end() - columns.start() + 1;
    let at = |column: usize, row: usize| (row - first.1) * width + column - first.0;
    let windings = windings_at_centres(area, cells, first, width, rows.clone());
    let mut placed: Vec<(u32, Piece)> = Vec::new();
    for (a, b) in area.rings.iter().flat_map(|ring| edges(ring)) {
        cells.visit_segment(a, b, |cell| placed.push((cell as u32, Piece::Edge(a, b))));
    }
    for &(c, r) in &area.discs {
        for row in cells.range(1, c[1] - r, c[1] + r) {
            for column in cells.range(0, c[0] - r, c[0] + r) {
                placed.push(((row * cells.columns + column) as u32, Piece::Disc(c, r)));
            }
        }
    }
    placed.sort_by_key(|(cell, _)| *cell);
    let mut placed = placed.into_iter().peekable();
    let mut out = Vec::new();
    for row in rows {
        for column in columns.clone() {
            let cell = (row * cells.columns + column) as u32;
            let mut pieces = Vec::new();
            while let Some((_, piece)) = placed.next_if(|(at, _)| *at == cell) {
                pieces.push(piece);
            }
            let winding = windings[at(column, row)];
            if winding != 0 || !pieces.is_empty() {
                out.push(Entry {
                    cell,
                    winding,
                    pieces,
                });
            }
        }
    }
    out
}

/// Counts at the centres of the cells around an area, row by row.
fn windings_at_centres(
    area: &Area,
    cells: &Cells,
    first: (usize, usize),
    width: usize,
    rows: std::ops::RangeInclusive<usize>,
) -> Vec<i32> {
    let height = rows.end() - rows.start() + 1;
    // Each edge changes all centres to its left: added where they end, and summed from the right.
    let mut sums = vec![0i32; height * (width + 1)];
    for (a, b) in area.rings.iter().flat_map(|ring| edges(ring)) {
        for row in cells.range(1, a[1].min(b[1]), a[1].max(b[1])) {
            let y = cells.centre(0, row)[1];
            let is_left = |k: usize| crossing(a, b, [cells.centre(first.0 + k, row)[0], y]) != 0;
            let straddles = (a[1] <= y && y < b[1]) || (b[1] <= y && y < a[1]);
            if !straddles {
                continue;
            }
            let x = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            let mut end = (cells.along(0, x).max(first.0) - first.0).min(width);
            while end < width && is_left(end) {
                end += 1;
            }
            while end > 0 && !is_left(end - 1) {
                end -= 1;
            }
            sums[(row - first.1) * (width + 1) + end] += if b[1] > a[1] { 1 } else { -1 };
        }
    }
    let mut out = vec![0; height * width];
    for row in 0..height {
        let mut sum = 0;
        for column in (0..width).rev() {
            sum += sums[row * (width + 1) + column + 1];
            out[row * width + column] = sum;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::vector::rings::{distance_squared, winding};

    /// Random rings on a coarse lattice, where places on edges and corners are common.
    fn areas(seed: u64, count: u64, lattice: f64) -> Vec<Area> {
        let mut rng = Rng::new(seed, 0);
        let mut place = |spread: f64| {
            let mut c = || (rng.unit() * spread * lattice).floor() / lattice;
            [c(), c()]
        };
        let ring = |k: u64, place: &mut dyn FnMut(f64) -> Vec2| {
            let base = place(8.0);
            let near = |p: Vec2| [p[0] + base[0], p[1] + base[1]];
            (0..3 + k % 9).map(|_| near(place(4.0))).collect::<Vec<_>>()
        };
        (0..count)
            .map(|k| Area {
                rings: (0..1 + k % 3).map(|_| ring(k, &mut place)).collect(),
                discs: (0..k % 2).map(|_| (place(10.0), place(2.0)[0])).collect(),
                fill: [Fill::NonZero, Fill::EvenOdd][(k / 2 % 2) as usize],
            })
            .collect()
    }

    fn by_definition(area: &Area, p: Vec2) -> bool {
        let count = winding(area.rings.iter().map(Vec::as_slice), p);
        let discs = &mut area.discs.iter();
        area.fill.covers(count) || discs.any(|(c, r)| distance_squared(*c, *c, p).0 <= r * r)
    }

    #[test]
    fn every_place_is_as_by_definition() {
        for (seed, lattice) in [(1, 2.0), (2, 8.0), (3, 1e9), (4, 1.0)] {
            let areas = areas(seed, 40, lattice);
            let index = Index::build(&areas);
            let mut rng = Rng::new(seed, 1);
            let mut covered = 0;
            for _ in 0..4000 {
                let p = [0, 1].map(|_| (rng.range(-1.0, 13.0) * lattice).floor() / lattice);
                let mut got = Vec::new();
                index.visit(p, |area| got.push(area));
                let expected: Vec<usize> = (0..areas.len())
                    .filter(|k| by_definition(&areas[*k], p))
                    .collect();
                assert_eq!(got, expected, "seed {seed} at {p:?}");
                assert_eq!(index.topmost(p), expected.last().copied());
                covered += expected.len();
            }
            assert!(covered > 1000);
        }
    }

    #[test]
    fn far_away_and_tiny_areas_are_the_same() {
        let base = areas(7, 20, 1024.0);
        let index = Index::build(&base);
        for (scale, shift) in [
            (1.0, 4_194_304.0),
            (2f64.powi(-40), 0.0),
            (2f64.powi(60), 0.0),
        ] {
            let moved = |p: Vec2| p.map(|c| c * scale + shift);
            let other: Vec<Area> = base
                .iter()
                .map(|area| Area {
                    rings: area
                        .rings
                        .iter()
                        .map(|r| r.iter().map(|p| moved(*p)).collect())
                        .collect(),
                    discs: area
                        .discs
                        .iter()
                        .map(|d| (moved(d.0), d.1 * scale))
                        .collect(),
                    fill: area.fill,
                })
                .collect();
            let other = Index::build(&other);
            let mut rng = Rng::new(7, 2);
            for _ in 0..2000 {
                let p = [0, 1].map(|_| (rng.range(-1.0, 13.0) * 1024.0).floor() / 1024.0);
                assert_eq!(index.topmost(p), other.topmost(moved(p)), "{p:?}");
            }
        }
    }

    #[test]
    fn nothing_covers_nothing() {
        for areas in [Vec::new(), vec![Area::default(); 3]] {
            let index = Index::build(&areas);
            assert_eq!(index.topmost([0.0, 0.0]), None);
            assert_eq!(index.bytes(), 0);
        }
    }

    #[test]
    fn areas_on_top_of_each_other_take_little_room() {
        let ring = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let one = Area {
            rings: vec![ring],
            ..Area::default()
        };
        let index = Index::build(&vec![one; 2000]);
        let mut count = 0;
        index.visit([0.3, 0.7], |_| count += 1);
        assert_eq!(count, 2000);
        assert!(index.bytes() < 16_000_000, "{}", index.bytes());
    }
}
