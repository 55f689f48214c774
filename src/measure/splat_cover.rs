//! Whether discs cover a cloud: every point against all discs over it, and what is seen from around.
//!
//! Nothing here is shared with how the discs were made: points are searched through boxes of runs of
//! them along a curve, disc by disc, and holes are looked for on rasters.

use crate::numeric::sums::sum_by;
use crate::numeric::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};
use crate::points::Splat;
use crate::spatial::aabb::Aabb;
use crate::spatial::bvh::{Bvh, Nearest};
use crate::spatial::kdtree::KdTree;
use crate::spatial::local::LocalFrame;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering::Relaxed};

/// Points of the smallest box.
const LEAF: usize = 16;
/// Boxes of one level in one box of the next.
const FAN: usize = 8;
/// Discs of one parallel step.
const CHUNK: usize = 512;
/// A rim or a height is met up to this share of the largest coordinate: the roundings of a centre.
const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// Nearer to the silhouette than this cosine between normal and view nothing is judged.
const GRAZING: f64 = 0.2;

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

    /// Calls `f` with each run of points whose box a disc may reach: where it begins, and its points.
    fn about(&self, disc: &Disc, height: f64, f: &mut impl FnMut(usize, &[Vec3])) {
        let reach = disc.normal.map(|n| {
            disc.radius * (1.0 - n * n).max(0.0).sqrt() + height * n.abs() + disc.rounding
        });
        let bounds = Aabb {
            lo: sub(disc.centre, reach),
            hi: add(disc.centre, reach),
        };
        self.descend(self.levels.len() - 1, 0, &bounds, disc, height, f);
    }

    fn descend(
        &self,
        level: usize,
        node: usize,
        bounds: &Aabb,
        disc: &Disc,
        height: f64,
        f: &mut impl FnMut(usize, &[Vec3]),
    ) {
        let own = &self.levels[level][node];
        let apart = (0..3).any(|a| own.lo[a] > bounds.hi[a] || own.hi[a] < bounds.lo[a]);
        if apart {
            return;
        }
        let (mut middle, mut extent) = (-dot(disc.normal, disc.centre), 0.0);
        for a in 0..3 {
            middle += 0.5 * disc.normal[a] * (own.lo[a] + own.hi[a]);
            extent += 0.5 * disc.normal[a].abs() * (own.hi[a] - own.lo[a]);
        }
        if middle.abs() > extent + height + disc.rounding {
            return;
        }
        if level == 0 {
            let start = node * LEAF;
            let end = (start + LEAF).min(self.points.len());
            f(start, &self.points[start..end]);
            return;
        }
        let end = ((node + 1) * FAN).min(self.levels[level - 1].len());
        for child in node * FAN..end {
            self.descend(level - 1, child, bounds, disc, height, f);
        }
    }
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

/// A disc in the frame.
struct Disc {
    centre: Vec3,
    normal: Vec3,
    radius: f64,
    rounding: f64,
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
    let disc = |splat: &Splat| Disc {
        centre: frame.to_local(splat.centre),
        normal: splat.normal,
        radius: splat.radius / unit,
        rounding,
    };
    let best: Vec<AtomicU64> = (0..positions.len())
        .into_par_iter()
        .map(|_| AtomicU64::new(f64::INFINITY.to_bits()))
        .collect();
    let over: u64 = splats
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut over = 0;
            for splat in chunk {
                each_covered(&runs, &disc(splat), splat.error / unit, |slot, height| {
                    // Bits of numbers that are not negative are in the order of the numbers.
                    best[slot].fetch_min(height.to_bits(), Relaxed);
                    over += 1;
                });
            }
            over
        })
        .sum();
    let heights: Vec<f64> = best
        .into_par_iter()
        .map(|bits| f64::from_bits(bits.into_inner()))
        .collect();
    let angles = truth.map(|truth| angles(&runs, splats, &disc, unit, &heights, truth));
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

/// Calls `f` with the slot of each point that a disc covers and its height.
#[inline]
fn each_covered(runs: &Runs, disc: &Disc, error: f64, mut f: impl FnMut(usize, f64)) {
    let most = disc.radius + disc.rounding;
    let high = error + disc.rounding;
    runs.about(disc, error, &mut |start, points| {
        for (slot, p) in (start..).zip(points) {
            let d = sub(*p, disc.centre);
            let height = dot(d, disc.normal).abs();
            // Over the plane: the rest of the way, which a difference of squares would lose.
            let along = sub(d, scale(disc.normal, dot(d, disc.normal)));
            if height <= high && dot(along, along) <= most * most {
                f(slot, height);
            }
        }
    });
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

    fn find(&self, p: Vec3) -> Option<Nearest> {
        self.tree.nearest(p, f64::INFINITY, |i| {
            let splat = &self.splats[i as usize];
            let d = sub(p, splat.centre);
            let height = dot(d, splat.normal);
            let beyond = (length(sub(d, scale(splat.normal, height))) - splat.radius).max(0.0);
            height * height + beyond * beyond
        })
    }

    fn distance(&self, p: Vec3) -> f64 {
        let found = self.find(p);
        found.map_or(f64::INFINITY, |n| n.distance_squared.sqrt())
    }

    fn nearest(&self, p: Vec3) -> Option<usize> {
        self.find(p).map(|n| n.item as usize)
    }
}

/// The angle in degrees at each covered point between its true normal and the field of the disc that
/// covers it best, of equals the first.
fn angles(
    runs: &Runs,
    splats: &[Splat],
    disc: &(impl Fn(&Splat) -> Disc + Sync),
    unit: f64,
    heights: &[f64],
    truth: &[Vec3],
) -> Vec<f64> {
    let choice: Vec<AtomicU32> = heights.iter().map(|_| AtomicU32::new(u32::MAX)).collect();
    splats
        .par_iter()
        .zip(0..splats.len() as u32)
        .for_each(|(splat, i)| {
            each_covered(runs, &disc(splat), splat.error / unit, |slot, height| {
                if height == heights[slot] {
                    choice[slot].fetch_min(i, Relaxed);
                }
            });
        });
    let angle = |slot: usize| {
        let splat = splats.get(choice[slot].load(Relaxed) as usize)?;
        let d = scale(sub(runs.points[slot], disc(splat).centre), unit);
        let found = splat.normal_at(dot(d, splat.tangent), dot(d, splat.bitangent()));
        let wanted = truth[runs.indices[slot] as usize];
        let angle = length(cross(found, wanted)).atan2(dot(found, wanted));
        Some(angle.to_degrees())
    };
    (0..heights.len())
        .into_par_iter()
        .filter_map(angle)
        .collect()
}

/// A round piece of the surface that discs should cover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Its centre.
    pub centre: Vec3,
    /// Its unit normal.
    pub normal: Vec3,
    /// Its radius.
    pub radius: f64,
}

/// A piece of surface around each point of a cloud, in the plane of the disc nearest to it, of half the
/// mean distance to its six nearest neighbours; none where there is no disc.
///
/// Positions are finite. Cost: O(n log n).
pub fn pieces(positions: &[Vec3], splats: &[Splat]) -> Vec<Piece> {
    let frame = LocalFrame::around(Aabb::around(positions));
    let local: Vec<Vec3> = positions.par_iter().map(|p| frame.to_local(*p)).collect();
    let count = local.len().saturating_sub(1).min(6);
    let near = KdTree::build(&local).neighbours(&local, count);
    let discs = Discs::new(splats, &frame);
    let piece = |(i, p): (usize, &Vec3)| {
        let disc = discs.nearest(*p)?;
        let others = near[i * count..(i + 1) * count].iter();
        let ways = others.map(|o| length(sub(local[*o as usize], *p)));
        let mean = ways.sum::<f64>() / count.max(1) as f64;
        Some(Piece {
            centre: positions[i],
            normal: splats[disc].normal,
            radius: frame.length(0.5 * mean),
        })
    };
    local.par_iter().enumerate().filter_map(piece).collect()
}

/// What the surface is where holes are looked for.
pub enum Truth<'a> {
    /// Pieces, such as a disc of the spacing around each point.
    Pieces(&'a [Piece]),
    /// The first hit of a ray from a point in a unit direction: its distance and unit normal.
    Rays(&'a (dyn Fn(Vec3, Vec3) -> Option<(f64, Vec3)> + Sync)),
}

/// Views to look from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Views {
    /// How many directions, spread evenly.
    pub count: usize,
    /// Pixels along each side of a picture.
    pub pixels: usize,
}

/// What is seen of a surface through its discs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Holes {
    /// Pixels, of all views, that show the surface.
    pub seen: u64,
    /// Those of them that show no disc there: nothing, or something behind.
    pub holes: u64,
    /// Their share.
    pub share: f64,
    /// Their area, in the square of the unit: as the views see them, on average.
    pub area: f64,
}

/// Looks at discs from around, along parallel rays, for places where the surface shows and no disc does.
///
/// A disc is there when it is no farther behind the surface than `tolerance` along the surface's normal.
/// Pixels beside the silhouette, and those that see the surface at less than some 12 degrees, are not
/// judged. The views are spread as the seeds of a sunflower. Cost: for each view the pixels that discs
/// and pieces cover.
pub fn holes(truth: &Truth, splats: &[Splat], tolerance: f64, views: Views) -> Holes {
    let bounds = splats
        .iter()
        .fold(Aabb::EMPTY, |all, s| all.union(s.bounds()));
    let bounds = match truth {
        Truth::Pieces(pieces) => pieces.iter().fold(bounds, |all, p| all.with(p.centre)),
        Truth::Rays(_) => bounds,
    };
    if bounds.is_empty() || views.count == 0 || views.pixels == 0 {
        return Holes::default();
    }
    let half = 0.5 * bounds.diagonal();
    let pixel = 2.0 * half / views.pixels as f64;
    let (mut seen, mut missing) = (0u64, 0u64);
    for view in 0..views.count {
        let screen = Screen::new(spread(view, views.count), &bounds, half, views.pixels);
        let (s, m) = screen.judge(truth, splats, tolerance);
        seen += s;
        missing += m;
    }
    Holes {
        seen,
        holes: missing,
        share: missing as f64 / seen.max(1) as f64,
        area: missing as f64 / views.count as f64 * pixel * pixel,
    }
}

/// One of directions spread evenly over the sphere.
fn spread(i: usize, count: usize) -> Vec3 {
    let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
    let turn = i as f64 * std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let r = (1.0 - z * z).sqrt();
    [r * turn.cos(), r * turn.sin(), z]
}

/// A picture by parallel rays.
struct Screen {
    /// Right, up, and the way the rays go.
    axes: [Vec3; 3],
    /// Where the ray of the lower left corner begins.
    origin: Vec3,
    pixel: f64,
    size: usize,
}

/// What is nearest in a pixel: its depth, and the normal of it.
type Seen = Option<(f64, Vec3)>;

impl Screen {
    fn new(way: Vec3, bounds: &Aabb, half: f64, size: usize) -> Self {
        let side = if way[2].abs() < 0.9 {
            [0.0, 0.0, 1.0]
        } else {
            [1.0, 0.0, 0.0]
        };
        let right = normalize(cross(way, side));
        let up = cross(right, way);
        let back = add(scale(way, 2.0), add(right, up));
        Screen {
            axes: [right, up, way],
            origin: sub(bounds.centre(), scale(back, half)),
            pixel: 2.0 * half / size as f64,
            size,
        }
    }

    fn ray(&self, x: usize, y: usize) -> Vec3 {
        let at = |p: usize, axis: Vec3| scale(axis, (p as f64 + 0.5) * self.pixel);
        add(self.origin, add(at(x, self.axes[0]), at(y, self.axes[1])))
    }

    fn judge(&self, truth: &Truth, splats: &[Splat], tolerance: f64) -> (u64, u64) {
        let wanted = match truth {
            Truth::Pieces(pieces) => self.draw(pieces.iter().copied()),
            Truth::Rays(hit) => (0..self.size * self.size)
                .into_par_iter()
                .map(|i| hit(self.ray(i % self.size, i / self.size), self.axes[2]))
                .collect(),
        };
        let found = self.draw(splats.iter().map(|s| Piece {
            centre: s.centre,
            normal: s.normal,
            radius: s.radius,
        }));
        let (mut seen, mut missing) = (0, 0);
        for y in 1..self.size.saturating_sub(1) {
            for x in 1..self.size - 1 {
                let at = |dx: usize, dy: usize| wanted[(y + dy - 1) * self.size + x + dx - 1];
                let Some((depth, normal)) = at(1, 1) else {
                    continue;
                };
                let slant = dot(normal, self.axes[2]).abs();
                let inside = (0..9).all(|k| at(k % 3, k / 3).is_some());
                if !inside || slant < GRAZING {
                    continue;
                }
                seen += 1;
                let there = found[y * self.size + x]
                    .is_some_and(|(other, _)| (other - depth) * slant <= tolerance);
                missing += u64::from(!there);
            }
        }
        (seen, missing)
    }

    /// The nearest of round pieces in each pixel.
    fn draw(&self, pieces: impl Iterator<Item = Piece>) -> Vec<Seen> {
        let mut picture: Vec<Seen> = vec![None; self.size * self.size];
        for piece in pieces {
            let d = sub(piece.centre, self.origin);
            let [x, y, depth] = self.axes.map(|a| dot(d, a));
            let [nx, ny, nz] = self.axes.map(|a| dot(piece.normal, a));
            if nz == 0.0 {
                continue;
            }
            let span = |at: f64, n: f64| {
                let reach = piece.radius * (1.0 - n * n).max(0.0).sqrt();
                let cell = |c: f64| (c / self.pixel - 0.5).clamp(-1.0, self.size as f64);
                let first = cell(at - reach).ceil().max(0.0) as usize;
                let last = cell(at + reach).floor();
                first..(last + 1.0).clamp(0.0, self.size as f64) as usize
            };
            for row in span(y, ny) {
                let dy = (row as f64 + 0.5) * self.pixel - y;
                for column in span(x, nx) {
                    let dx = (column as f64 + 0.5) * self.pixel - x;
                    let dz = -(nx * dx + ny * dy) / nz;
                    if dx * dx + dy * dy + dz * dz > piece.radius * piece.radius {
                        continue;
                    }
                    let pixel = &mut picture[row * self.size + column];
                    if pixel.is_none_or(|(nearest, _)| depth + dz < nearest) {
                        *pixel = Some((depth + dz, piece.normal));
                    }
                }
            }
        }
        picture
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    fn disc(centre: Vec3, normal: Vec3, radius: f64, error: f64) -> Splat {
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

    #[test]
    fn a_missing_disc_is_found_by_points_and_by_views() {
        let grid = |i: i32| [f64::from(i % 20), f64::from(i / 20), 0.0];
        let positions: Vec<Vec3> = (0..400).map(grid).collect();
        let up = [0.0, 0.0, 1.0];
        let all: Vec<Splat> = positions.iter().map(|p| disc(*p, up, 0.75, 0.0)).collect();
        let pieces: Vec<Piece> = positions
            .iter()
            .map(|p| Piece {
                centre: *p,
                normal: up,
                radius: 0.75,
            })
            .collect();
        let views = Views {
            count: 6,
            pixels: 200,
        };
        let found = coverage(&positions, &all, 0.0, Some(&vec![up; 400]));
        assert_eq!((found.uncovered, found.over_bound), (0, 0));
        assert_eq!(found.max_distance, Some(0.0));
        assert_eq!(found.normal_max_deg, Some(0.0));
        let truth = Truth::Pieces(&pieces);
        let whole = holes(&truth, &all, 0.1, views);
        assert!(whole.holes == 0 && whole.seen > 1000, "{whole:?}");
        let mut some = all.clone();
        some.remove(210);
        let found = coverage(&positions, &some, 0.0, None);
        assert_eq!((found.uncovered, found.first_uncovered), (1, Some(210)));
        let gap = found.max_distance.expect("a distance");
        assert!((gap - 0.25).abs() < 1e-12, "{gap}");
        let open = holes(&truth, &some, 0.1, views);
        assert!(open.holes > 0 && open.seen == whole.seen, "{open:?}");
        // A disc that is there but too far behind fills no hole.
        some.push(disc([10.0, 10.0, -1.0], up, 0.75, 0.0));
        some.push(disc([10.0, 10.0, 1.0], up, 0.0, 0.0));
        assert!(holes(&truth, &some, 0.1, views).holes > 0);
    }
}
