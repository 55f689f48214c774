//! Whether discs cover a cloud: every point against all discs over it.
//!
//! Nothing here is shared with how the discs were made: points are searched through boxes of runs of
//! them along a curve, disc by disc.

use crate::numeric::sums::sum_by;
use crate::numeric::vector::{Vec3, add, cross, dot, length, scale, sub};
use crate::points::Splat;
use crate::spatial::aabb::Aabb;
use crate::spatial::bvh::Bvh;
use crate::spatial::local::LocalFrame;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// Points of the smallest box.
const LEAF: usize = 8;
/// Boxes of one level in one box of the next.
const FAN: usize = 4;
/// A disc is large where the box around it is so many times that of the points.
const LARGE: f32 = 3.0;
/// Points below which a box is searched by one thread.
const PARALLEL: usize = 1 << 12;
/// A rim or a height is met up to this share of the largest coordinate: the roundings of a centre.
const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// How well discs cover the points of a cloud.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Coverage {
    /// Points.
    pub points: u64,
    /// Points in no disc that has them within its own error.
    pub uncovered: u64,
    /// The first of them, from 0.
    pub first_uncovered: Option<u64>,
    /// Points farther than the bound from every disc that covers them, or covered by none.
    pub over_bound: u64,
    /// Discs over a point, on average.
    pub discs_per_point: f64,
    /// The largest distance of a point to the disc that covers it best, or where none does to the
    /// nearest; null where there is no disc.
    pub max_distance: Option<f64>,
    /// The root of the mean square of those distances.
    pub rms_distance: Option<f64>,
    /// Root mean square of the angle between a true normal and the field of the disc that covers the
    /// point best, in degrees; null where true normals are not known.
    pub normal_rms_deg: Option<f64>,
    /// The largest such angle.
    pub normal_max_deg: Option<f64>,
}

/// Points along a curve, and boxes around runs of them.
struct Runs {
    points: Vec<Vec3>,
    indices: Vec<u32>,
    /// Boxes of runs of [`LEAF`], then of [`FAN`] of those, and so on; the last level has one.
    levels: Vec<Vec<Aabb>>,
}

impl Runs {
    fn of(positions: &[Vec3], frame: &LocalFrame) -> Self {
        let local: Vec<Vec3> = positions.par_iter().map(|p| frame.to_local(*p)).collect();
        let mut keys: Vec<(u64, u32)> = local
            .par_iter()
            .zip(0u32..positions.len() as u32)
            .map(|(p, i)| (key(*p), i))
            .collect();
        keys.par_sort_unstable();
        let indices: Vec<u32> = keys.into_iter().map(|(_, i)| i).collect();
        let points: Vec<Vec3> = indices.iter().map(|i| local[*i as usize]).collect();
        let mut levels: Vec<Vec<Aabb>> = vec![points.chunks(LEAF).map(Aabb::around).collect()];
        while levels[levels.len() - 1].len() > 1 {
            let below = &levels[levels.len() - 1];
            let union = |boxes: &[Aabb]| boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
            levels.push(below.chunks(FAN).map(union).collect());
        }
        Runs {
            points,
            indices,
            levels,
        }
    }

    /// What covers each point best, in the order of the curve.
    fn best(&self, discs: &Found) -> Vec<Best> {
        let mut best = vec![Best::NONE; self.points.len()];
        let mut lists: Vec<u32> = (0..discs.discs.len() as u32).collect();
        let top = self.levels.len() - 1;
        self.descend((top, 0), discs, 0, &mut lists, &mut best);
        best
    }

    /// Measures the points of a box against the discs that may reach it, which are among those of
    /// `lists` from `from` on. What is added to the lists is taken off again.
    fn descend(
        &self,
        (level, node): (usize, usize),
        found: &Found,
        from: usize,
        lists: &mut Vec<u32>,
        best: &mut [Best],
    ) {
        let own = &self.levels[level][node];
        let coarse = Coarse::around(own);
        let start = lists.len();
        lists.resize(2 * start - from, 0);
        let (before, list) = lists.split_at_mut(start);
        let mut count = 0;
        for &i in &before[from..] {
            list[count] = i;
            count += usize::from(found.may_reach(i as usize, &coarse, own));
        }
        lists.truncate(start + count);
        if level == 0 {
            let points = &self.points[node * LEAF..];
            for &i in &lists[start..] {
                found.discs[i as usize].measure(i, points, best);
            }
        } else if count > 0 {
            let part = LEAF * FAN.pow(level as u32 - 1);
            let child = |number| (level - 1, node * FAN + number);
            if best.len() >= PARALLEL {
                let list = &lists[start..];
                best.par_chunks_mut(part)
                    .enumerate()
                    .for_each(|(number, best)| {
                        self.descend(child(number), found, 0, &mut list.to_vec(), best);
                    });
            } else {
                for (number, best) in best.chunks_mut(part).enumerate() {
                    self.descend(child(number), found, start, lists, best);
                }
            }
        }
        lists.truncate(start);
    }
}

/// The disc that covers a point best.
#[derive(Debug, Clone, Copy)]
struct Best {
    /// How far it is; infinite where none does.
    height: f64,
    /// Its index; of equals the first.
    disc: u32,
    /// How many cover the point.
    count: u32,
}

impl Best {
    const NONE: Best = Best {
        height: f64::INFINITY,
        disc: u32::MAX,
        count: 0,
    };
}

/// The place of a point on a curve through cells of a thousandth of the frame; any would do.
fn key(p: Vec3) -> u64 {
    let mut key = 0;
    let cells = p.map(|c| ((c + 2.0) * 512.0) as u64);
    for bit in (0..12).rev() {
        for cell in cells {
            key = key << 1 | cell >> bit & 1;
        }
    }
    key
}

/// A box in single precision, rounded outwards: a quarter of a disc to read.
#[derive(Debug, Clone, Copy)]
struct Coarse {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Coarse {
    fn around(bounds: &Aabb) -> Self {
        Coarse {
            lo: bounds.lo.map(|c| (c as f32).next_down()),
            hi: bounds.hi.map(|c| (c as f32).next_up()),
        }
    }

    #[inline]
    fn meets(&self, other: &Coarse) -> bool {
        let mut meets = true;
        for a in 0..3 {
            meets &= self.lo[a] <= other.hi[a] && self.hi[a] >= other.lo[a];
        }
        meets
    }

    /// The longest side.
    #[inline]
    fn size(&self) -> f32 {
        let side = |a: usize| self.hi[a] - self.lo[a];
        side(0).max(side(1)).max(side(2))
    }
}

/// The discs, and a box around all that each may cover.
struct Found {
    discs: Vec<Disc>,
    boxes: Vec<Coarse>,
}

impl Found {
    fn of(splats: &[Splat], frame: &LocalFrame, unit: f64, rounding: f64) -> Self {
        let discs: Vec<Disc> = splats
            .par_iter()
            .map(|splat| Disc::of(splat, frame, unit, rounding))
            .collect();
        let around = |disc: &Disc| {
            Coarse::around(&Aabb {
                lo: sub(disc.centre, disc.reach),
                hi: add(disc.centre, disc.reach),
            })
        };
        let boxes = discs.par_iter().map(around).collect();
        Found { discs, boxes }
    }

    /// Whether a disc may cover something in a box. Only those much larger than the box are told by
    /// their plane as well.
    #[inline]
    fn may_reach(&self, i: usize, coarse: &Coarse, bounds: &Aabb) -> bool {
        let own = &self.boxes[i];
        own.meets(coarse) && (own.size() < LARGE * coarse.size() || self.discs[i].reaches(bounds))
    }
}

/// A disc in the frame.
struct Disc {
    centre: Vec3,
    normal: Vec3,
    radius: f64,
    error: f64,
    rounding: f64,
    /// Half the sides of the box around all that it may cover.
    reach: Vec3,
}

impl Disc {
    fn of(splat: &Splat, frame: &LocalFrame, unit: f64, rounding: f64) -> Self {
        let (radius, error) = (splat.radius / unit, splat.error / unit);
        let side = |n: f64| radius * (1.0 - n * n).max(0.0).sqrt() + error * n.abs();
        Disc {
            centre: frame.to_local(splat.centre),
            normal: splat.normal,
            radius,
            error,
            rounding,
            reach: splat.normal.map(|n| side(n) + 2.0 * rounding),
        }
    }

    /// Whether what it covers lies between planes that meet a box.
    #[inline]
    fn reaches(&self, bounds: &Aabb) -> bool {
        let (mut middle, mut extent) = (0.0, self.error + 2.0 * self.rounding);
        for a in 0..3 {
            middle += self.normal[a] * (0.5 * (bounds.lo[a] + bounds.hi[a]) - self.centre[a]);
            extent += self.normal[a].abs() * 0.5 * (bounds.hi[a] - bounds.lo[a]);
        }
        middle.abs() <= extent
    }

    /// Notes for each of the points whether it covers it.
    #[inline]
    fn measure(&self, index: u32, points: &[Vec3], best: &mut [Best]) {
        let most = self.radius + self.rounding;
        let high = self.error + self.rounding;
        // What a difference of squares may lose is settled by the projection itself.
        let square = most * most;
        let lost = ROUNDING * (square + high * high);
        for (p, best) in points.iter().zip(best) {
            let d = sub(*p, self.centre);
            let height = dot(d, self.normal);
            let rest = dot(d, d) - height * height;
            if (height.abs() > high) | (rest > square + lost) {
                continue;
            }
            let along = || sub(d, scale(self.normal, height));
            if rest <= square - lost || dot(along(), along()) <= square {
                best.count += 1;
                if height.abs() < best.height {
                    best.height = height.abs();
                    best.disc = index;
                }
            }
        }
    }
}

/// Measures every point of a cloud against all discs over it.
///
/// A disc covers a point that lies in it as seen along its normal, and no higher over or below it than
/// its own error. `bound` is what no distance should exceed, in the cloud's unit; `truth` are true
/// normals of the points, where they are known. Positions are finite. Cost: for each disc the points
/// about it; no more than making the discs.
pub fn coverage(
    positions: &[Vec3],
    splats: &[Splat],
    bound: f64,
    truth: Option<&[Vec3]>,
) -> Coverage {
    if positions.is_empty() {
        return Coverage::default();
    }
    let bounds = Aabb::around(positions);
    let frame = LocalFrame::around(bounds);
    let runs = Runs::of(positions, &frame);
    // Lengths in the frame, by the same power of two.
    let unit = frame.length(1.0);
    let corner = bounds.lo.iter().chain(&bounds.hi);
    let largest = corner.fold(0.0f64, |m, c| m.max((c / unit).abs())).max(1.0);
    let rounding = ROUNDING * largest;
    let found = Found::of(splats, &frame, unit, rounding);
    let best = runs.best(&found);
    let over: u64 = best.iter().map(|b| u64::from(b.count)).sum();
    let angles = truth.map(|truth| angles(&runs, splats, (&found.discs, unit), &best, truth));
    let heights = best.into_iter().map(|b| b.height).collect();
    let mut result = judge(&runs, splats, &frame, heights, bound / unit + rounding);
    result.discs_per_point = over as f64 / positions.len() as f64;
    result.max_distance = result.max_distance.map(|d| frame.length(d));
    result.rms_distance = result.rms_distance.map(|d| frame.length(d));
    if let Some(angles) = angles.filter(|angles| !angles.is_empty()) {
        let squares = sum_by(&angles, |a| a * a);
        result.normal_rms_deg = Some((squares / angles.len() as f64).sqrt());
        result.normal_max_deg = Some(angles.iter().fold(0.0, |m, a| a.max(m)));
    }
    result
}

/// Counts what is covered; distances of what is not are those to the nearest disc.
fn judge(
    runs: &Runs,
    splats: &[Splat],
    frame: &LocalFrame,
    mut heights: Vec<f64>,
    bound: f64,
) -> Coverage {
    let missed: Vec<usize> = (0..heights.len())
        .filter(|slot| heights[*slot].is_infinite())
        .collect();
    let first_uncovered = missed.iter().map(|s| u64::from(runs.indices[*s])).min();
    let uncovered = missed.len() as u64;
    if !missed.is_empty() && !splats.is_empty() {
        let near = Discs::new(splats, frame);
        let found: Vec<f64> = missed
            .par_iter()
            .map(|s| near.distance(runs.points[*s]))
            .collect();
        for (slot, distance) in missed.iter().zip(found) {
            heights[*slot] = distance;
        }
    }
    let largest = heights.par_iter().copied().reduce(|| 0.0, f64::max);
    let some = largest.is_finite();
    let rms = (sum_by(&heights, |h| h * h) / heights.len() as f64).sqrt();
    let above = heights.iter().filter(|h| **h > bound).count() as u64;
    Coverage {
        points: heights.len() as u64,
        uncovered,
        first_uncovered,
        over_bound: above.max(uncovered),
        max_distance: some.then_some(largest),
        rms_distance: some.then_some(rms),
        ..Coverage::default()
    }
}

/// Discs in the frame, and a tree over them.
struct Discs {
    splats: Vec<Splat>,
    tree: Bvh,
}

impl Discs {
    fn new(splats: &[Splat], frame: &LocalFrame) -> Self {
        let unit = frame.length(1.0);
        let local = |s: &Splat| Splat {
            centre: frame.to_local(s.centre),
            radius: s.radius / unit,
            ..*s
        };
        let splats: Vec<Splat> = splats.iter().map(local).collect();
        let tree = Bvh::build(splats.len() as u32, |i| splats[i as usize].bounds());
        Discs { splats, tree }
    }

    fn distance(&self, p: Vec3) -> f64 {
        let found = self.tree.nearest(p, f64::INFINITY, |i| {
            let splat = &self.splats[i as usize];
            let d = sub(p, splat.centre);
            let height = dot(d, splat.normal);
            let beyond = (length(sub(d, scale(splat.normal, height))) - splat.radius).max(0.0);
            height * height + beyond * beyond
        });
        found.map_or(f64::INFINITY, |n| n.distance_squared.sqrt())
    }
}

/// The angle in degrees at each covered point between its true normal and the field of the disc that
/// covers it best.
fn angles(
    runs: &Runs,
    splats: &[Splat],
    (discs, unit): (&[Disc], f64),
    best: &[Best],
    truth: &[Vec3],
) -> Vec<f64> {
    let angle = |slot: usize| {
        let disc = best[slot].disc as usize;
        let splat = splats.get(disc)?;
        let d = scale(sub(runs.points[slot], discs[disc].centre), unit);
        let found = splat.normal_at(dot(d, splat.tangent), dot(d, splat.bitangent()));
        let wanted = truth[runs.indices[slot] as usize];
        let angle = length(cross(found, wanted)).atan2(dot(found, wanted));
        Some(angle.to_degrees())
    };
    (0..best.len()).into_par_iter().filter_map(angle).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::numeric::vector::normalize;

    pub fn disc(centre: Vec3, normal: Vec3, radius: f64, error: f64) -> Splat {
        let side = if normal[0].abs() < 0.5 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        Splat {
            centre,
            normal,
            tangent: normalize(cross(side, normal)),
            field: normal,
            radius,
            error,
            ..Splat::default()
        }
    }

    /// The definition, point by point and disc by disc.
    fn by_definition(positions: &[Vec3], splats: &[Splat]) -> Vec<Option<f64>> {
        let height = |p: &Vec3, s: &Splat| {
            let d = sub(*p, s.centre);
            let h = dot(d, s.normal);
            let along = length(sub(d, scale(s.normal, h)));
            (along <= s.radius && h.abs() <= s.error).then_some(h.abs())
        };
        let best = |p| splats.iter().filter_map(|s| height(p, s)).reduce(f64::min);
        positions.iter().map(best).collect()
    }

    #[test]
    fn points_are_measured_as_the_definition_says() {
        let random = |i: u64, a: f64| {
            let mut rng = Rng::new(2, i);
            std::array::from_fn(|_| rng.range(-a, a))
        };
        let positions: Vec<Vec3> = (0..3000).map(|i| random(i, 1.0)).collect();
        let splats: Vec<Splat> = (0..200)
            .map(|i| {
                let mut rng = Rng::new(3, i);
                let normal = normalize(random(10_000 + i, 1.0));
                disc(
                    random(20_000 + i, 1.0),
                    normal,
                    rng.unit(),
                    0.3 * rng.unit(),
                )
            })
            .collect();
        let wanted = by_definition(&positions, &splats);
        for size in [1.0, 2f64.powi(-100), 2f64.powi(100)] {
            let grown = |v: Vec3| scale(v, size);
            let points: Vec<Vec3> = positions.iter().map(|p| grown(*p)).collect();
            let discs: Vec<Splat> = splats
                .iter()
                .map(|s| Splat {
                    centre: grown(s.centre),
                    radius: size * s.radius,
                    error: size * s.error,
                    ..*s
                })
                .collect();
            let found = coverage(&points, &discs, 0.1 * size, None);
            let missed = wanted.iter().filter(|h| h.is_none()).count() as u64;
            assert!(missed > 0 && missed < 3000);
            assert_eq!((found.points, found.uncovered), (3000, missed));
            let first = wanted.iter().position(Option::is_none).map(|i| i as u64);
            assert_eq!(found.first_uncovered, first);
            let over = wanted.iter().filter(|h| h.is_none_or(|h| h > 0.1)).count();
            assert!(found.over_bound <= over as u64 && found.over_bound >= missed);
        }
    }
}
