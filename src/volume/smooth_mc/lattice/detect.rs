//! Spacing and origin from coordinates, and the place of each vertex.

use super::{Given, MOST, RESIDUAL, refused};
use crate::error::{Error, Fault, Result, number};
use crate::mesh::Mesh;
use crate::mesh::topology::topology;
use crate::numeric::vector::{Vec3, add, cross, length, sub};
use crate::progress::Progress;
use rayon::prelude::*;

/// Triangles whose edges give the first guess.
const SAMPLE: usize = 1 << 15;

/// Distances below this share of the largest count for none: they are rounding.
const NO_DISTANCE: f64 = 0.125;

/// Two distances this much apart, relatively, are of different kinds.
const KIND: f64 = 0.2;

/// Below this share in percent, vertices off the lattice are exceptions.
const FEW: f64 = 10.0;

/// The names of the axes.
const NAMES: [&str; 3] = ["x", "y", "z"];

/// What was found.
pub(super) struct Found {
    pub spacing: Vec3,
    pub origin: Vec3,
    pub residual: f64,
    /// Twice the place of each vertex in voxels; of those that no triangle uses it says nothing.
    pub places: Vec<[i32; 3]>,
}

/// Half voxels along one axis.
#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    /// Where they are counted from.
    start: f64,
    /// The length of one.
    half: f64,
    /// Whether it may as well be two.
    doubtful: bool,
}

impl Axis {
    #[inline]
    fn at(&self, coordinate: f64) -> f64 {
        (coordinate - self.start) / self.half
    }
}

/// How the counts of half voxels become places: those along some axes are counts of voxels, and
/// voxel centres lie at even places once the odd ones are moved by one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Parity {
    whole: usize,
    odd: usize,
}

impl Parity {
    /// Whether a vertex with these odd counts lies on an edge between voxels.
    #[inline]
    fn fits(self, pattern: usize) -> bool {
        ((pattern & !self.whole) ^ self.odd).count_ones() == 1
    }

    #[inline]
    fn place(self, counts: [i32; 3]) -> [i32; 3] {
        std::array::from_fn(|a| (counts[a] << (self.whole >> a & 1)) + (self.odd >> a & 1) as i32)
    }
}

#[inline]
fn pattern(counts: [i32; 3]) -> usize {
    counts
        .iter()
        .enumerate()
        .map(|(a, k)| ((k & 1) as usize) << a)
        .sum()
}

/// Half voxels of all vertices, and what they have in common.
struct Counts {
    counts: Vec<[i32; 3]>,
    residual: f64,
    /// Vertices on the lattice by which of their counts are odd.
    patterns: [u64; 8],
}

pub(super) fn detect(
    mesh: &Mesh,
    used: &[bool],
    given: &Given,
    progress: &dyn Progress,
) -> Result<Found> {
    let mut axes = [Axis::default(); 3];
    for a in 0..3 {
        axes[a] = find_axis(mesh, used, a, given)?;
    }
    let mut doubtful: usize = (0..3).map(|a| usize::from(axes[a].doubtful) << a).sum();
    // On a closed surface the outermost vertex and its neighbours are half a voxel apart.
    if doubtful != 0 && topology(mesh, progress)?.volume.is_some() {
        doubtful = 0;
    }
    let counts = count(mesh, used, &axes);
    let total = used.iter().filter(|u| **u).count() as u64;
    let (best, fitting) = parities(&counts.patterns, doubtful, given.origin.is_some());
    let spacing = |p: Parity| -> Vec3 {
        std::array::from_fn(|a| {
            let half = axes[a].half;
            given
                .spacing
                .map_or(half * 2.0 / (1 << (p.whole >> a & 1)) as f64, |s| s[a])
        })
    };
    if fitting < total {
        let found = spacing(best[0]);
        return Err(Error::Geometry(off_lattice(
            total - fitting,
            total,
            found,
            given,
        )));
    }
    if let Some(other) = best.iter().find(|p| p.whole != best[0].whole) {
        let a = (other.whole ^ best[0].whole).trailing_zeros() as usize;
        return Err(Error::Geometry(unseen(
            a,
            format!(
                "the open mesh shows but one distance of neighbours along {}, {}: half a voxel or one",
                NAMES[a],
                number(axes[a].half)
            ),
        )));
    }
    let parity = match best[..] {
        [one] => one,
        _ => facing(mesh, &counts.counts, &axes, &best),
    };
    let spacing = spacing(parity);
    let origin =
        std::array::from_fn(|a| axes[a].start - 0.5 * spacing[a] * (parity.odd >> a & 1) as f64);
    let mut places = counts.counts;
    places
        .par_iter_mut()
        .for_each(|counts| *counts = parity.place(*counts));
    Ok(Found {
        spacing,
        origin,
        residual: counts.residual,
        places,
    })
}

fn unseen(axis: usize, problem: String) -> Fault {
    let hint = format!(
        "give the distances of voxels with --spacing; that along {} is missing",
        NAMES[axis]
    );
    Fault::whole(problem).with_hint(hint)
}

fn off_lattice(off: u64, total: u64, spacing: Vec3, given: &Given) -> Fault {
    let share = 100.0 * off as f64 / total as f64;
    let whose = if given.spacing.is_some() {
        "given"
    } else {
        "that was guessed"
    };
    let why = if share < FEW {
        "marching cubes 33 puts some into the cells; or a few were moved"
    } else {
        "a mesh of a grey-valued volume, or one simplified, turned or smoothed"
    };
    refused(format!(
        "{off} of {total} vertices ({share:.1} %) do not lie halfway between two voxels of the lattice {whose}, spacing {}, to {RESIDUAL} half voxels: {why}",
        spacing.map(number).join(",")
    ))
}

/// Half voxels along an axis, from the coordinates of all vertices.
fn find_axis(mesh: &Mesh, used: &[bool], axis: usize, given: &Given) -> Result<Axis> {
    let mut sorted: Vec<f64> = (mesh.positions.par_iter().zip(used))
        .filter(|(_, used)| **used)
        .map(|(p, _)| p[axis])
        .collect();
    sorted.par_sort_unstable_by(f64::total_cmp);
    let origin = given.origin.map(|o| o[axis]);
    if let Some(spacing) = given.spacing {
        let half = 0.5 * spacing[axis];
        let planes = planes(&sorted, 0.5 * half);
        return Ok(Axis {
            start: origin.unwrap_or_else(|| start_of(&planes, half)),
            half,
            doubtful: false,
        });
    }
    let Some(typical) = typical_distance(mesh, axis) else {
        let problem = format!("neighbours all have the same {}", NAMES[axis]);
        return Err(Error::Geometry(unseen(axis, problem)));
    };
    let planes = planes(&sorted, 0.25 * typical);
    let gap = planes
        .windows(2)
        .map(|w| w[1] - w[0])
        .fold(typical, f64::min);
    let alike = |value: f64, to: f64| (value / to - 1.0).abs() < KIND;
    let halved = alike(gap, 0.5 * typical);
    let guess = if halved { 0.5 * typical } else { typical };
    let twice = |t: &[u32; 3]| {
        distances(mesh, t, axis)
            .iter()
            .any(|d| alike(*d, 2.0 * typical))
    };
    let doubtful = !halved && !mesh.triangles.par_iter().any(twice);
    let (start, half) = fit(&planes, guess);
    Ok(match origin {
        None => Axis {
            start,
            half,
            doubtful,
        },
        Some(origin) => Axis {
            start: origin,
            half: fit_to(origin, &planes, half),
            doubtful,
        },
    })
}

#[inline]
fn distances(mesh: &Mesh, triangle: &[u32; 3], axis: usize) -> [f64; 3] {
    let [a, b, c] = triangle.map(|v| mesh.positions[v as usize][axis]);
    [(a - b).abs(), (b - c).abs(), (c - a).abs()]
}

/// The middle one of the distances of neighbours along an axis: half a voxel or one. `None` where all
/// are 0.
fn typical_distance(mesh: &Mesh, axis: usize) -> Option<f64> {
    let stride = (mesh.triangles.len() / SAMPLE).max(1);
    // Where an axis is flat but for a few vertices, the sample may not hold them.
    for stride in [stride, 1] {
        let mut found: Vec<f64> = mesh
            .triangles
            .iter()
            .step_by(stride)
            .flat_map(|t| distances(mesh, t, axis))
            .collect();
        let largest = found.iter().copied().fold(0.0, f64::max);
        found.retain(|d| *d > NO_DISTANCE * largest);
        if !found.is_empty() {
            let middle = found.len() / 2;
            return Some(*found.select_nth_unstable_by(middle, f64::total_cmp).1);
        }
    }
    None
}

/// The coordinates that vertices share: the middle one of each run with no gap over `apart`.
fn planes(sorted: &[f64], apart: f64) -> Vec<f64> {
    sorted
        .chunk_by(|a, b| b - a <= apart)
        .map(|run| run[run.len() / 2])
        .collect()
}

/// First plane and length of half a voxel.
///
/// Each plane is counted from the one before with what is known so far, so that an error of the guess
/// does not add up. From the first plane to the last, if that is the better fit, because it is exact
/// where the numbers are; else by least squares.
fn fit(planes: &[f64], guess: f64) -> (f64, f64) {
    let (first, last) = (planes[0], planes[planes.len() - 1]);
    let mut at = Vec::with_capacity(planes.len());
    let (mut k, mut half) = (0.0, guess);
    at.push(0.0);
    for w in planes.windows(2) {
        k += ((w[1] - w[0]) / half).round().max(1.0);
        at.push(k);
        if k >= 8.0 {
            half = (w[1] - first) / k;
        }
    }
    if k == 0.0 {
        return (first, guess);
    }
    let ends = (first, (last - first) / k);
    let n = planes.len() as f64;
    let mean_k = at.iter().sum::<f64>() / n;
    let mean_x = planes.iter().map(|x| x - first).sum::<f64>() / n;
    let (mut kk, mut kx) = (0.0, 0.0);
    for (k, x) in at.iter().zip(planes) {
        kk += (k - mean_k) * (k - mean_k);
        kx += (k - mean_k) * (x - first - mean_x);
    }
    let slope = kx / kk;
    let squares = (first + (mean_x - slope * mean_k), slope);
    let worst = |(start, half): (f64, f64)| {
        let off = at
            .iter()
            .zip(planes)
            .map(|(k, x)| (x - (start + k * half)).abs());
        off.fold(0.0, f64::max)
    };
    // What rounding alone does to the numbers is no reason to leave the exact one.
    let rounding = 4.0 * f64::EPSILON * first.abs().max(last.abs());
    if worst(ends) <= worst(squares).max(rounding) {
        ends
    } else {
        squares
    }
}

/// The length of half a voxel for planes that are counted from a given origin.
fn fit_to(origin: f64, planes: &[f64], guess: f64) -> f64 {
    let far = planes
        .iter()
        .map(|x| x - origin)
        .fold(0.0f64, |m, d| if d.abs() > m.abs() { d } else { m });
    let k = (far / guess).round();
    if k == 0.0 { guess } else { far / k }
}

/// The first plane, moved so that all are as near to whole numbers of half voxels as can be.
fn start_of(planes: &[f64], half: f64) -> f64 {
    let first = planes[0];
    let (mut low, mut high) = (0.0f64, 0.0f64);
    for x in planes {
        let k = ((x - first) / half).round();
        let off = x - (first + k * half);
        low = low.min(off);
        high = high.max(off);
    }
    first + 0.5 * (low + high)
}

fn count(mesh: &Mesh, used: &[bool], axes: &[Axis; 3]) -> Counts {
    const CHUNK: usize = 1 << 13;
    let most = f64::from(MOST / 2 - 1);
    let mut counts = vec![[0; 3]; mesh.positions.len()];
    let parts: Vec<(f64, [u64; 8])> = counts
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(chunk, out)| {
            let (mut largest, mut patterns) = (0.0f64, [0; 8]);
            for (i, counts) in out.iter_mut().enumerate() {
                let v = chunk * CHUNK + i;
                if !used[v] {
                    continue;
                }
                let mut residual = 0.0f64;
                for a in 0..3 {
                    let at = axes[a].at(mesh.positions[v][a]);
                    let whole = at.round();
                    let off = if whole.abs() <= most {
                        (at - whole).abs()
                    } else {
                        f64::INFINITY
                    };
                    residual = residual.max(off);
                    counts[a] = whole as i32;
                }
                largest = largest.max(residual);
                if residual <= RESIDUAL {
                    patterns[pattern(*counts)] += 1;
                }
            }
            (largest, patterns)
        })
        .collect();
    let mut all = Counts {
        counts,
        residual: 0.0,
        patterns: [0; 8],
    };
    for (residual, patterns) in parts {
        all.residual = all.residual.max(residual);
        for (sum, n) in all.patterns.iter_mut().zip(patterns) {
            *sum += n;
        }
    }
    all
}

/// Those parities that most vertices fit, and how many do.
fn parities(patterns: &[u64; 8], doubtful: usize, anchored: bool) -> (Vec<Parity>, u64) {
    let mut best = Vec::new();
    let mut most = 0;
    for whole in (0..8).filter(|w| w & !doubtful == 0) {
        for odd in 0..if anchored { 1 } else { 8 } {
            let parity = Parity { whole, odd };
            let fitting = (0..8)
                .filter(|p| parity.fits(*p))
                .map(|p| patterns[p])
                .sum();
            if best.is_empty() || fitting > most {
                best.clear();
                most = fitting;
            }
            if fitting == most {
                best.push(parity);
            }
        }
    }
    (best, most)
}

/// Of parities that fit alike, the one with which vertices lie on edges across the surface.
fn facing(mesh: &Mesh, counts: &[[i32; 3]], axes: &[Axis; 3], among: &[Parity]) -> Parity {
    let mut normals = vec![[0.0; 3]; mesh.positions.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [p, q, r] = mesh
            .corners(t)
            .map(|p| std::array::from_fn(|a| axes[a].at(p[a])));
        let normal = cross(sub(q, p), sub(r, p));
        for v in triangle {
            normals[*v as usize] = add(normals[*v as usize], normal);
        }
    }
    let score = |parity: &Parity| -> f64 {
        normals
            .iter()
            .zip(counts)
            .map(|(normal, counts)| {
                let size = length(*normal);
                let axis = pattern(parity.place(*counts)).trailing_zeros() as usize;
                if size > 0.0 {
                    normal[axis.min(2)].abs() / size
                } else {
                    0.0
                }
            })
            .sum()
    };
    let mut best = (among[0], score(&among[0]));
    for parity in &among[1..] {
        let score = score(parity);
        if score > best.1 {
            best = (*parity, score);
        }
    }
    best.0
}
