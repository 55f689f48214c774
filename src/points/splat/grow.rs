//! One disc, grown from a point over its neighbours.

use super::ring::{Cell, across};
use crate::numeric::vector::{Vec3, dot, sub};
use crate::points::normals::Neighbourhoods;
use crate::points::order::distance_squared;
use crate::spatial::kdtree::{KdTree, Neighbour};

/// A neighbour belongs to another side of the surface when the cosine of the normals is at most this:
/// 60 degrees.
const OTHER_SIDE: f64 = 0.5;
/// A disc ends before a gap of so many spacings.
const GAP: f64 = 3.0;
/// A point is isolated when its own spacing is so many times that of its neighbours.
const ISOLATED: f64 = 8.0;
/// Points below which a shell is taken one by one.
const FEW: usize = 24;
/// Each shell is so much farther out at least, and at most, by the square of the distance.
const SHELL: [f64; 2] = [1.5, 8.0];
/// The first tries to end so much beyond the last disc, which was near and as large as a rule.
const GUESS: f64 = 1.05;
/// Bins by which a shell is searched for gaps; more are not worth it.
const BINS: usize = 128;
/// Neighbours whose spacing, with the point's own, has its median taken.
const SAMPLES: usize = 8;

/// The cloud, and what is known of it, in local coordinates.
pub struct Cloud<'a> {
    /// The points.
    pub points: &'a [Vec3],
    /// Their unit normals; zero where there is none.
    pub normals: &'a [Vec3],
    /// The side of the square that each stands for.
    pub spacings: &'a [f64],
    /// A tree over them.
    pub tree: &'a KdTree,
    /// Their nearest neighbours.
    pub near: &'a Neighbourhoods,
}

/// How far a disc may grow, in local coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// The largest height of a point over its disc.
    pub delta: f64,
    /// The largest radius.
    pub radius: f64,
}

/// A disc as it grows. Its memory is used again for the next.
#[derive(Debug, Default)]
pub struct Growth {
    /// Where it was begun.
    pub source: u32,
    /// The points it covers, that one first.
    pub covered: Vec<u32>,
    /// How far its centre is from that point, along the normal.
    pub offset: f64,
    /// The largest height of a covered point over it.
    pub error: f64,
    /// Its radius.
    pub radius: f64,
    /// Two unit vectors in its plane.
    pub axes: [Vec3; 2],
    /// Whether it ended at the largest radius.
    pub capped: bool,
    /// Whether its first ring is higher than the bound.
    pub oversized: bool,
    /// Whether the point has no neighbours at its own scale.
    pub isolated: bool,
    low: f64,
    high: f64,
    /// Square of the largest distance in the plane.
    reach: f64,
    /// Distance of the last point that was looked at, in space.
    last: f64,
    spacing: f64,
    /// Square of the radius of the disc before.
    guess: f64,
    shell: Vec<Neighbour>,
    wide: Vec<u32>,
}

/// What a point is to a disc.
struct Seen {
    height: f64,
    in_plane: f64,
    cosine: f64,
}

impl Cloud<'_> {
    #[inline]
    fn see(&self, source: usize, other: usize) -> Seen {
        let normal = self.normals[source];
        let d = sub(self.points[other], self.points[source]);
        let height = dot(normal, d);
        Seen {
            height,
            in_plane: (dot(d, d) - height * height).max(0.0),
            cosine: dot(normal, self.normals[other]),
        }
    }

    /// The spacing about a point: the median of its own and of its nearest neighbours'.
    fn spacing(&self, i: usize) -> f64 {
        let mut some = [0.0; SAMPLES + 1];
        some[0] = self.spacings[i];
        let row = self.near.row(i);
        let count = row.len().min(SAMPLES);
        for (slot, j) in some[1..].iter_mut().zip(row) {
            *slot = self.spacings[*j as usize];
        }
        let some = &mut some[..=count];
        some.sort_unstable_by(f64::total_cmp);
        some[count / 2]
    }
}

impl Growth {
    /// Grows a disc from point `i`, which has a normal.
    ///
    /// It covers the natural neighbours of the point in any case, so that no hole is left between the
    /// points; then one neighbour after the other, nearest first, while all heights lie within
    /// `2 delta` of each other. It ends before a point of another side, a gap, or the largest radius.
    pub fn grow(&mut self, cloud: &Cloud, i: usize, bounds: &Bounds) {
        self.begin(cloud, i);
        if !self.isolated {
            let row = self.neighbours(cloud, i);
            let (forced, more) = self.first_ring(cloud, &row);
            let within = 0.5 * (self.high - self.low) <= bounds.delta;
            if more && within && !self.rest(cloud, &row[forced..], bounds) {
                let last = row.last().map_or(i, |j| *j as usize);
                let last = Neighbour {
                    distance_squared: distance_squared(cloud.points[i], cloud.points[last]),
                    index: last as u32,
                };
                self.shells(cloud, last, bounds);
            }
            self.wide = row;
        }
        self.finish(cloud, bounds);
    }

    fn begin(&mut self, cloud: &Cloud, i: usize) {
        let spacing = cloud.spacing(i);
        let (u, v) = across(cloud.normals[i]);
        self.source = i as u32;
        self.covered.clear();
        self.covered.push(i as u32);
        self.axes = [u, v];
        self.capped = false;
        self.oversized = false;
        self.isolated = cloud.spacings[i] > ISOLATED * spacing;
        (self.low, self.high) = (0.0, 0.0);
        (self.reach, self.last) = (0.0, 0.0);
        self.spacing = spacing;
    }

    /// The nearest neighbours, more of them where those known are on a line.
    fn neighbours(&mut self, cloud: &Cloud, i: usize) -> Vec<u32> {
        let mut wide = std::mem::take(&mut self.wide);
        wide.clear();
        let row = cloud.near.row(i);
        wide.extend_from_slice(row);
        if let Some(last) = row.last() {
            let reach = distance_squared(cloud.points[i], cloud.points[*last as usize]);
            let spacing = cloud.spacings[i];
            if reach < spacing * spacing {
                let count = crate::points::normals::MOST_NEIGHBOURS + 1;
                cloud.tree.nearest(cloud.points[i], count, &mut self.shell);
                wide.clear();
                let others = self.shell.iter().map(|n| n.index);
                wide.extend(others.filter(|j| *j as usize != i));
            }
        }
        wide
    }

    /// Covers all up to the farthest natural neighbour; how many of the row that were, and whether
    /// nothing stood in the way.
    fn first_ring(&mut self, cloud: &Cloud, row: &[u32]) -> (usize, bool) {
        let i = self.source as usize;
        let mut cell = Cell::new(self.spacing);
        let [u, v] = self.axes;
        for (owner, &j) in (0u32..).zip(row) {
            let j = j as usize;
            if dot(cloud.normals[i], cloud.normals[j]) > OTHER_SIDE {
                let d = sub(cloud.points[j], cloud.points[i]);
                cell.cut([dot(d, u), dot(d, v)], owner);
            }
        }
        let forced = cell.owners().max().map_or(0, |last| last as usize + 1);
        let mut clear = true;
        for &j in &row[..forced] {
            let seen = cloud.see(i, j as usize);
            if seen.cosine > OTHER_SIDE {
                self.take(j, &seen);
            } else {
                clear = false;
            }
        }
        if forced > 0 {
            let last = row[forced - 1] as usize;
            self.last = distance_squared(cloud.points[i], cloud.points[last]).sqrt();
        }
        (forced, clear)
    }

    #[inline]
    fn take(&mut self, j: u32, seen: &Seen) {
        self.low = self.low.min(seen.height);
        self.high = self.high.max(seen.height);
        self.reach = self.reach.max(seen.in_plane);
        self.covered.push(j);
    }

    /// Covers points, which are in order, as far as may be; whether it ended.
    fn rest(&mut self, cloud: &Cloud, row: &[u32], bounds: &Bounds) -> bool {
        let i = self.source as usize;
        for &j in row {
            let distance = distance_squared(cloud.points[i], cloud.points[j as usize]).sqrt();
            if self.step(cloud, j, distance, bounds) {
                return true;
            }
        }
        false
    }

    /// Covers one more point if it may; whether it ended instead.
    #[inline]
    fn step(&mut self, cloud: &Cloud, j: u32, distance: f64, bounds: &Bounds) -> bool {
        let seen = cloud.see(self.source as usize, j as usize);
        let spread = self.high.max(seen.height) - self.low.min(seen.height);
        if seen.cosine <= OTHER_SIDE
            || 0.5 * spread > bounds.delta
            || distance > self.last + GAP * self.spacing
        {
            return true;
        }
        if seen.in_plane > bounds.radius * bounds.radius {
            self.capped = true;
            return true;
        }
        self.take(j, &seen);
        self.last = distance;
        false
    }

    /// Covers points beyond the last one known, shell by shell.
    fn shells(&mut self, cloud: &Cloud, mut last: Neighbour, bounds: &Bounds) {
        let centre = cloud.points[self.source as usize];
        let first = last.distance_squared;
        // Above 0 in any case, so that it grows.
        let first = first
            .max(self.spacing * self.spacing)
            .max(f64::MIN_POSITIVE);
        let guess = GUESS * self.guess;
        let next = |reach: f64| guess.clamp(SHELL[0] * reach, SHELL[1] * reach);
        let mut reach = next(first);
        let mut shell = std::mem::take(&mut self.shell);
        loop {
            cloud.tree.within(centre, reach, Some(last), &mut shell);
            let ended = if shell.is_empty() {
                // Nothing up to there: the next point, if any, is across a gap.
                reach.sqrt() > self.last + GAP * self.spacing
            } else {
                self.batch(cloud, &mut shell, bounds)
            };
            if ended || self.covered.len() == cloud.points.len() {
                break;
            }
            let farthest = shell.iter().max_by(|a, b| a.order(b));
            last = farthest.copied().unwrap_or(last);
            reach = next(reach);
        }
        self.shell = shell;
    }

    /// Covers points that are in no order, as far as may be by their order; whether it ended.
    ///
    /// All are taken at once where none is in the way, else the nearer half is tried first: no more
    /// is sorted than the few among which it ends.
    fn batch(&mut self, cloud: &Cloud, batch: &mut [Neighbour], bounds: &Bounds) -> bool {
        if batch.len() <= FEW {
            batch.sort_unstable_by(Neighbour::order);
            return batch
                .iter()
                .any(|n| self.step(cloud, n.index, n.distance_squared.sqrt(), bounds));
        }
        if self.take_all(cloud, batch, bounds) {
            return false;
        }
        let middle = batch.len() / 2;
        batch.select_nth_unstable_by(middle, Neighbour::order);
        let (nearer, farther) = batch.split_at_mut(middle);
        self.batch(cloud, nearer, bounds) || self.batch(cloud, farther, bounds)
    }

    /// Covers all of a batch if nothing is in the way of any; whether it did.
    fn take_all(&mut self, cloud: &Cloud, batch: &[Neighbour], bounds: &Bounds) -> bool {
        let (mut low, mut high, mut reach, mut last) = (self.low, self.high, self.reach, 0.0f64);
        let i = self.source as usize;
        // A gap leaves one bin of half its width empty.
        let width = 0.5 * GAP * self.spacing;
        let farthest = batch
            .iter()
            .fold(0.0, |m: f64, n| m.max(n.distance_squared));
        let bins = ((farthest.sqrt() - self.last) / width).ceil();
        if bins.is_nan() || bins > BINS as f64 {
            return false;
        }
        let all = if bins >= BINS as f64 {
            u128::MAX
        } else {
            (1u128 << bins.max(1.0) as u32) - 1
        };
        let mut filled = 0u128;
        for n in batch {
            let seen = cloud.see(i, n.index as usize);
            low = low.min(seen.height);
            high = high.max(seen.height);
            reach = reach.max(seen.in_plane);
            let distance = n.distance_squared.sqrt();
            last = last.max(distance);
            let bin = ((distance - self.last) / width).clamp(0.0, (BINS - 1) as f64);
            filled |= 1 << bin as u32;
            if seen.cosine <= OTHER_SIDE || 0.5 * (high - low) > bounds.delta {
                return false;
            }
        }
        if reach > bounds.radius * bounds.radius || filled & all != all {
            return false;
        }
        (self.low, self.high, self.reach, self.last) = (low, high, reach, last);
        self.covered.extend(batch.iter().map(|n| n.index));
        true
    }

    fn finish(&mut self, cloud: &Cloud, bounds: &Bounds) {
        let middle = 0.5 * (self.high + self.low);
        self.oversized = 0.5 * (self.high - self.low) > bounds.delta;
        // The point itself stays within the bound, whatever the first ring does.
        self.offset = middle.clamp(-bounds.delta, bounds.delta);
        self.error = (self.high - self.offset).max(self.offset - self.low);
        self.radius = self.reach.sqrt();
        self.guess = self.reach;
        if self.radius == 0.0 && cloud.points.len() > 1 {
            self.radius = self.spacing;
        }
    }

    /// Square of the distance of a point from the centre in the plane, and its height over the disc.
    #[inline]
    pub fn place(&self, cloud: &Cloud, j: u32) -> (f64, f64) {
        let seen = cloud.see(self.source as usize, j as usize);
        (seen.in_plane, seen.height - self.offset)
    }
}
