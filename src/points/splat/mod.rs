//! Discs that cover a cloud, each with a field of normals.
//!
//! From a point a disc grows along the point's normal, over one neighbour after the other, until the
//! heights of those it covers no longer lie within twice the bound `delta`; its centre moves along the
//! normal to the middle of them. Points that it covers near its centre start no disc of their own. So
//! every point with a normal lies in a disc and at most `delta` above or below it: it is covered by
//! one that settled it, or by its own.
//!
//! Source: Linsen, Müller and Rosenthal, "Splat-based ray tracing of point clouds", 2007, section 3.
//! What it leaves open is decided thus:
//! - The bound is half of the interval of heights, in which the point's own height 0 is.
//! - The radius is the largest distance in the plane of any point covered, as those do not rise with the
//!   distances in space.
//! - A disc ends before a point whose normal is 60 degrees off or more, before a gap of three times the
//!   spacing, and at a largest radius.
//! - It covers the point's natural neighbours even where they are higher than the bound; the centre then
//!   stays within the bound of the point itself, the disc states its true error, and what it settles is
//!   within the bound still.
//! - Points are taken along Morton's curve, so that their order in the file changes nothing.
//! - Coordinates are relative to the corner of the cloud's box and of unit size: neither place nor size
//!   changes anything.

mod cover;
mod disc;
mod field;
mod grow;
mod params;
mod prepare;
mod ring;
mod stats;
#[cfg(test)]
mod tests;
mod trade;

pub use disc::{Splat, Splats};
pub use params::{Cover, Length, Order, Orient, Params};
pub use prepare::{NormalStats, Origin};
pub use stats::{Bin, Delta, Heights, Radius, Stats};
pub use trade::TRADE;

use crate::error::{Error, Fault, Result};
use crate::mesh::Mesh;
use crate::numeric::vector::{add, scale};
use crate::points::normals::Neighbourhoods;
use crate::points::order::Ordered;
use crate::progress::Progress;
use crate::spatial::aabb::Aabb;
use crate::spatial::kdtree::KdTree;
use crate::spatial::local::CornerFrame;
use field::Field;
use grow::{Bounds, Cloud, Growth};
use prepare::{Prepared, prepare};

/// Most points: the orientation keeps a bit of each index.
const MOST_POINTS: usize = (1 << 31) - 1;

/// Covers the vertices of a cloud by discs.
///
/// Normals are those given, or estimated from neighbours and turned outwards. Colours are averaged over
/// what a disc covers; of classes the one that most of it have is kept. Points in one place count once;
/// points on a line have no normal and are left out, which the counts say.
///
/// Errs for parameters out of range, for coordinates that are not finite, for fewer than three points
/// without normals, and for 2^31 points or more. Cost: O(n log n); some 6 microseconds and 300 bytes per
/// point.
pub fn generate(cloud: &Mesh, params: &Params, progress: &dyn Progress) -> Result<(Splats, Stats)> {
    params.check()?;
    cloud.check().map_err(Error::Geometry)?;
    let count = cloud.positions.len();
    if count > MOST_POINTS {
        return Err(Error::Limit {
            what: "a cloud".into(),
            needed: format!("{count} points"),
            limit: format!("{MOST_POINTS} points"),
            hint: None,
        });
    }
    if (1..3).contains(&count) && cloud.normals.is_none() {
        let problem =
            format!("{count} points without normals span no plane: at least 3 are needed");
        return Err(Error::Geometry(Fault::whole(problem)));
    }
    progress.stage("order", 0);
    let ordered = Ordered::of(cloud);
    progress.stage("neighbours", 0);
    let tree = KdTree::build(&ordered.points);
    let near = Neighbourhoods::of(&tree, &ordered.points, params.neighbors);
    let mut prepared = prepare(cloud, &ordered, &tree, &near, params, progress);
    if ordered.points.len() == 1 && prepared.normals[0] == [0.0; 3] {
        // All in one place: a disc without extent looks up.
        prepared.normals[0] = [0.0, 0.0, 1.0];
    }
    let diagonal = Aabb::around(&ordered.points).diagonal();
    let made = Maker::make(
        cloud,
        &ordered,
        (&tree, &near),
        &prepared,
        params,
        diagonal,
        progress,
    );
    let stats = stats(&made, &ordered, &prepared, params, diagonal, count);
    Ok((made.splats, stats))
}

/// Makes discs of what is grown.
struct Maker<'a> {
    cloud: &'a Mesh,
    ordered: &'a Ordered,
    splats: Splats,
    capped: u64,
    oversized: u64,
    isolated: u64,
    covered: u64,
    residual: f64,
    fitted: u64,
}

impl<'a> Maker<'a> {
    fn make(
        cloud: &'a Mesh,
        ordered: &'a Ordered,
        (tree, near): (&KdTree, &Neighbourhoods),
        prepared: &Prepared,
        params: &Params,
        diagonal: f64,
        progress: &dyn Progress,
    ) -> Self {
        let mut maker = Maker {
            cloud,
            ordered,
            splats: Splats {
                splats: Vec::new(),
                colors: cloud.colors.as_ref().map(|_| Vec::new()),
                classes: cloud.classes.as_ref().map(|_| Vec::new()),
            },
            capped: 0,
            oversized: 0,
            isolated: 0,
            covered: 0,
            residual: 0.0,
            fitted: 0,
        };
        let known = Cloud {
            points: &ordered.points,
            normals: &prepared.normals,
            spacings: &prepared.spacings,
            tree,
            near,
        };
        let bounds = Bounds {
            delta: local_length(params.delta, &ordered.local, diagonal),
            radius: local_length(params.max_radius, &ordered.local, diagonal),
        };
        let order = cover::order(params.order, &ordered.sources);
        let what = (params.cover, params.perc);
        cover::cover(
            &known,
            &order,
            &bounds,
            what,
            progress,
            &mut |growth, field| {
                maker.keep(&known, growth, field);
            },
        );
        maker
    }

    fn keep(&mut self, known: &Cloud, growth: &Growth, field: &Field) {
        let local = &self.ordered.local;
        let i = growth.source as usize;
        let source = self.ordered.sources[i];
        let normal = known.normals[i];
        let step = scale(normal, local.length_from_local(growth.offset));
        self.splats.splats.push(Splat {
            centre: add(self.cloud.positions[source as usize], step),
            normal,
            tangent: field.tangent,
            radius: local.length_from_local(growth.radius),
            field: field.centre,
            // Per local length: the other way than a length.
            slopes: field.slopes.map(|s| local.length_to_local(s)),
            error: local.length_from_local(growth.error),
            count: growth.covered.len() as u32,
            source,
        });
        let sources = growth
            .covered
            .iter()
            .map(|j| self.ordered.sources[*j as usize] as usize);
        if let (Some(of), Some(colors)) = (&self.cloud.colors, &mut self.splats.colors) {
            let mut sum = [0.0; 4];
            for s in sources.clone() {
                for (sum, c) in sum.iter_mut().zip(of[s]) {
                    *sum += f64::from(c);
                }
            }
            let share = 1.0 / growth.covered.len() as f64;
            colors.push(sum.map(|c| (c * share) as f32));
        }
        if let (Some(of), Some(classes)) = (&self.cloud.classes, &mut self.splats.classes) {
            classes.push(majority(sources.map(|s| of[s])));
        }
        self.capped += u64::from(growth.capped);
        self.oversized += u64::from(growth.oversized);
        self.isolated += u64::from(growth.isolated);
        self.covered += growth.covered.len() as u64;
        self.residual += field.residual;
        self.fitted += u64::from(field.points);
    }
}

/// The value that most have; of several the smallest.
fn majority(values: impl Iterator<Item = u8>) -> u8 {
    let mut counts = [0u32; 256];
    for value in values {
        counts[usize::from(value)] += 1;
    }
    let most = (0..256).fold(0, |best, v| if counts[v] > counts[best] { v } else { best });
    most as u8
}

/// A length in local coordinates, where the diagonal is known in them.
fn local_length(length: Length, local: &CornerFrame, diagonal: f64) -> f64 {
    match length {
        Length::Absolute(length) => local.length_to_local(length),
        Length::OfDiagonal(_) => length.of(diagonal),
    }
}

fn stats(
    made: &Maker,
    ordered: &Ordered,
    prepared: &Prepared,
    params: &Params,
    diagonal: f64,
    count: usize,
) -> Stats {
    let splats = &made.splats.splats;
    let local = &ordered.local;
    let delta = local_length(params.delta, local, diagonal);
    let without = prepared.normals.iter().filter(|n| **n == [0.0; 3]).count();
    let share = |part: f64, whole: u64| if whole == 0 { 0.0 } else { part / whole as f64 };
    Stats {
        points: count as u64,
        duplicates: (count - ordered.points.len()) as u64,
        lines: without as u64,
        splats: splats.len() as u64,
        ratio: share(splats.len() as f64, count as u64),
        delta: Delta {
            abs: local.length_from_local(delta),
            diag: (diagonal > 0.0).then(|| delta / diagonal),
        },
        k: params.neighbors as u64,
        covered_mean: share(made.covered as f64, splats.len() as u64),
        radius: Radius::of(splats.iter().map(|s| s.radius).collect()),
        error: Heights::of(splats.iter().map(|s| s.error)),
        capped: made.capped,
        oversized_first_ring: made.oversized,
        isolated: made.isolated,
        normals: prepared.stats.clone(),
        field_rms_deg: share(made.residual, made.fitted).sqrt().to_degrees(),
        bytes_before: 48 * count as u64,
        bytes_after: size_of_val(&splats[..]) as u64,
    }
}
