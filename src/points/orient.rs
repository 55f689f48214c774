//! One outside for the normals of a cloud.

use super::normals::{Neighbourhoods, mirrored};

use crate::numeric::vector::{Vec3, dot, scale, sub};
use crate::spatial::kdtree::KdTree;
use rayon::prelude::*;

/// Classes of weight by which edges are sorted: at this many steps, ties go by index.
const CLASSES: usize = 1 << 12;
/// Neighbours of each point that the tree may run along, nearest first.
const EDGES: usize = 10;
/// Directions whose extremal points vote on what is outside.
const DIRECTIONS: usize = 13;
/// A vote as clear as this settles a part by itself.
const CLEAR: f64 = 0.5;
/// Points of a part that look for another.
const PROBES: usize = 64;
/// Points that each looks at.
const LOOKS: usize = 256;

/// The parts of a cloud whose normals were turned together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parts {
    /// How many there are.
    pub count: u64,
    /// Those whose outside followed that of a larger part beside them.
    pub joined: u64,
}

/// Signs relative to another point, by union and find; bit 0 of a link tells that the sign changes.
struct Forest {
    links: Vec<u32>,
}

impl Forest {
    fn new(count: usize) -> Self {
        Forest {
            links: (0..count as u32).map(|i| i << 1).collect(),
        }
    }

    /// The root of a point's tree, shifted by one, with the sign relative to it in bit 0.
    #[inline]
    fn find(&mut self, i: u32) -> u32 {
        let mut at = i << 1;
        loop {
            let link = self.links[(at >> 1) as usize];
            if link >> 1 == at >> 1 {
                return at;
            }
            let above = self.links[(link >> 1) as usize];
            let shortcut = above ^ (link & 1);
            self.links[(at >> 1) as usize] = shortcut;
            at = shortcut ^ (at & 1);
        }
    }

    /// Joins two trees so that the signs of two points differ or not; whether they were two.
    #[inline]
    fn join(&mut self, i: u32, j: u32, differ: bool) -> bool {
        let (a, b) = (self.find(i), self.find(j));
        if a >> 1 == b >> 1 {
            return false;
        }
        let change = (a ^ b ^ u32::from(differ)) & 1;
        // The smaller index becomes the root: with halving, no rank is needed.
        let (root, other) = if a < b {
            (a >> 1, b >> 1)
        } else {
            (b >> 1, a >> 1)
        };
        self.links[other as usize] = root << 1 | change;
        true
    }
}

/// Turns normals so that neighbours agree, and each part outwards.
pub fn by_tree(
    tree: &KdTree,
    points: &[Vec3],
    normals: &mut [Vec3],
    near: &Neighbourhoods,
) -> Parts {
    let mut forest = spanning(points, normals, near);
    let roots: Vec<u32> = (0..points.len() as u32).map(|i| forest.find(i)).collect();
    drop(forest);
    for (normal, root) in normals.iter_mut().zip(&roots) {
        if root & 1 == 1 {
            *normal = scale(*normal, -1.0);
        }
    }
    let (parts, count) = number(&roots);
    drop(roots);
    outwards(tree, points, normals, &parts, count)
}

/// The forest of the lightest edges: the tighter two normals determine each other, the earlier.
///
/// The edges are counted into classes of their weight, which takes the place of sorting. Source:
/// Kruskal, "On the shortest spanning subtree of a graph", 1956.
fn spanning(points: &[Vec3], normals: &[Vec3], near: &Neighbourhoods) -> Forest {
    let k = near.count;
    let mut forest = Forest::new(points.len());
    if k == 0 {
        return forest;
    }
    // The class of each slot's edge; none where the other end has it too, or has no normal.
    const NONE: u16 = u16::MAX;
    let mut classes = vec![NONE; near.indices.len()];
    classes
        .par_chunks_mut(k)
        .with_min_len(256)
        .enumerate()
        .for_each(|(i, classes)| {
            if normals[i] == [0.0; 3] {
                return;
            }
            for (class, &j) in classes.iter_mut().zip(near.row(i)).take(EDGES) {
                let j = j as usize;
                let twice = j < i && near.row(j)[..k.min(EDGES)].contains(&(i as u32));
                if !twice && normals[j] != [0.0; 3] {
                    let weight = 1.0 - agreement(points, normals, i, j).abs();
                    *class = (weight.clamp(0.0, 1.0) * (CLASSES - 1) as f64) as u16;
                }
            }
        });
    let mut starts = vec![0u32; CLASSES + 1];
    for class in classes.iter().filter(|c| **c != NONE) {
        starts[usize::from(*class) + 1] += 1;
    }
    for c in 0..CLASSES {
        starts[c + 1] += starts[c];
    }
    let mut slots = vec![0u32; starts[CLASSES] as usize];
    for (slot, class) in classes.iter().enumerate().filter(|(_, c)| **c != NONE) {
        let place = &mut starts[usize::from(*class)];
        slots[*place as usize] = slot as u32;
        *place += 1;
    }
    drop(classes);
    for slot in slots {
        let (i, j) = (slot / k as u32, near.indices[slot as usize]);
        let differ = agreement(points, normals, i as usize, j as usize) < 0.0;
        forest.join(i, j, differ);
    }
    forest
}

/// The cosine between two normals times what of them is across the way between their points.
///
/// Along that way nothing is known: two sheets face each other there as often as one bends. What is
/// across it is the mean of the plain product and of that with the mirror image, which is right for
/// edges, where the plain one has the wrong sign.
#[inline]
fn agreement(points: &[Vec3], normals: &[Vec3], i: usize, j: usize) -> f64 {
    0.5 * (dot(normals[i], normals[j]) + mirrored(points, normals, i, j))
}

/// The part of each point, and how many there are, in the order of their first points; points without
/// a normal are in none, which is the last.
fn number(roots: &[u32]) -> (Vec<u32>, usize) {
    let mut numbers = vec![u32::MAX; roots.len()];
    let mut count = 0;
    let parts = roots
        .iter()
        .map(|root| {
            let number = &mut numbers[(root >> 1) as usize];
            if *number == u32::MAX {
                *number = count;
                count += 1;
            }
            *number
        })
        .collect();
    (parts, count as usize)
}

/// What is known of one part before it is turned.
#[derive(Debug, Clone, Copy)]
struct Extremes {
    size: u32,
    sum: Vec3,
    /// Along each direction the least and the greatest coordinate, and whose it is.
    ends: [[(f64, u32); 2]; DIRECTIONS],
}

fn directions() -> [Vec3; DIRECTIONS] {
    let mut all = [[0.0; 3]; DIRECTIONS];
    let mut count = 0;
    for code in 0..27 {
        let d = [code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1].map(f64::from);
        // One of each pair of opposites.
        if code > 13 {
            all[count] = scale(d, 1.0 / dot(d, d).sqrt());
            count += 1;
        }
    }
    all
}

/// Turns each part so that its extremal points look outwards.
fn outwards(
    tree: &KdTree,
    points: &[Vec3],
    normals: &mut [Vec3],
    parts: &[u32],
    count: usize,
) -> Parts {
    let directions = directions();
    let none = Extremes {
        size: 0,
        sum: [0.0; 3],
        ends: [[(f64::INFINITY, 0), (f64::NEG_INFINITY, 0)]; DIRECTIONS],
    };
    let mut extremes = vec![none; count];
    for (i, part) in parts.iter().enumerate() {
        if normals[i] == [0.0; 3] {
            continue;
        }
        let part = &mut extremes[*part as usize];
        part.size += 1;
        for a in 0..3 {
            part.sum[a] += normals[i][a];
        }
        for (d, [low, high]) in directions.iter().zip(&mut part.ends) {
            let along = dot(*d, points[i]);
            if along < low.0 {
                *low = (along, i as u32);
            }
            if along > high.0 {
                *high = (along, i as u32);
            }
        }
    }
    let members = Members::of(parts, count);
    let mut order: Vec<usize> = (0..count).filter(|p| extremes[*p].size > 0).collect();
    order.sort_by_key(|p| std::cmp::Reverse(extremes[*p].size));
    let mut settled = vec![false; count];
    let mut result = Parts {
        count: order.len() as u64,
        joined: 0,
    };
    for part in order {
        let known = &extremes[part];
        let vote = vote(known, &directions, normals);
        let beside = if vote.abs() < CLEAR {
            beside(
                tree,
                points,
                normals,
                parts,
                members.of_part(part),
                &settled,
            )
        } else {
            0.0
        };
        let flip = if vote.abs() >= CLEAR {
            vote < 0.0
        } else if beside != 0.0 {
            result.joined += 1;
            beside < 0.0
        } else {
            let [x, y, z] = known.sum;
            [z, y, x].into_iter().find(|c| *c != 0.0).unwrap_or(0.0) < 0.0
        };
        if flip {
            for i in members.of_part(part) {
                let normal = &mut normals[*i as usize];
                *normal = scale(*normal, -1.0);
            }
        }
        settled[part] = true;
    }
    result
}

/// From -1, all extremal points look inwards, to 1, all look outwards.
fn vote(part: &Extremes, directions: &[Vec3; DIRECTIONS], normals: &[Vec3]) -> f64 {
    let (mut sum, mut all) = (0.0, 0.0);
    for (d, [low, high]) in directions.iter().zip(&part.ends) {
        for outward in [
            -dot(*d, normals[low.1 as usize]),
            dot(*d, normals[high.1 as usize]),
        ] {
            sum += outward;
            all += outward.abs();
        }
    }
    if all > 0.0 { sum / all } else { 0.0 }
}

/// Whether a part goes on in one that is settled: above 0 where they agree, below where they do not, and
/// 0 where nothing tells.
///
/// Only pairs count that lie in one sheet: there a normal is much the same whether carried over
/// straight or mirrored.
fn beside(
    tree: &KdTree,
    points: &[Vec3],
    normals: &[Vec3],
    parts: &[u32],
    members: &[u32],
    settled: &[bool],
) -> f64 {
    let (mut sum, mut all) = (0.0, 0.0);
    let step = members.len().div_ceil(PROBES).max(1);
    for &i in members.iter().step_by(step) {
        let i = i as usize;
        let mut near = Vec::new();
        tree.nearest(points[i], 2, &mut near);
        let first = near
            .last()
            .map_or(1.0, |n| n.distance_squared)
            .max(f64::MIN_POSITIVE);
        let other = tree
            .stream(points[i], 64.0 * first)
            .take(LOOKS)
            .map(|n| n.index as usize)
            .find(|j| parts[*j] != parts[i] && settled[parts[*j] as usize]);
        if let Some(j) = other {
            let (plain, mirror) = (dot(normals[i], normals[j]), mirrored(points, normals, i, j));
            if plain * mirror > 0.0 && plain.abs().min(mirror.abs()) > CLEAR {
                sum += plain;
                all += plain.abs();
            }
        }
    }
    if f64::abs(sum) > CLEAR * all {
        sum
    } else {
        0.0
    }
}

/// The points of each part.
struct Members {
    starts: Vec<u32>,
    points: Vec<u32>,
}

impl Members {
    fn of(parts: &[u32], count: usize) -> Self {
        let mut starts = vec![0u32; count + 1];
        for part in parts {
            starts[*part as usize + 1] += 1;
        }
        for p in 0..count {
            starts[p + 1] += starts[p];
        }
        let mut next = starts.clone();
        let mut points = vec![0; parts.len()];
        for (i, part) in parts.iter().enumerate() {
            let place = &mut next[*part as usize];
            points[*place as usize] = i as u32;
            *place += 1;
        }
        Members { starts, points }
    }

    fn of_part(&self, part: usize) -> &[u32] {
        &self.points[self.starts[part] as usize..self.starts[part + 1] as usize]
    }
}

/// Turns each normal towards a place from which the points were seen.
pub fn to_viewpoint(points: &[Vec3], normals: &mut [Vec3], viewpoint: Vec3) {
    normals.par_iter_mut().zip(points).for_each(|(normal, p)| {
        if dot(*normal, sub(viewpoint, *p)) < 0.0 {
            *normal = scale(*normal, -1.0);
        }
    });
}

/// Turns each normal up: along z, or where it has no part of it y, then x.
pub fn upwards(normals: &mut [Vec3]) {
    normals.par_iter_mut().for_each(|normal| {
        let [x, y, z] = *normal;
        if [z, y, x].into_iter().find(|c| *c != 0.0).unwrap_or(0.0) < 0.0 {
            *normal = scale(*normal, -1.0);
        }
    });
}

/// The parts of a cloud that neighbours connect, where nothing is turned.
pub fn connected(normals: &[Vec3], near: &Neighbourhoods) -> Parts {
    let mut forest = Forest::new(normals.len());
    for i in 0..normals.len() {
        for &j in near.row(i).iter().take(EDGES) {
            if normals[i] != [0.0; 3] && normals[j as usize] != [0.0; 3] {
                forest.join(i as u32, j, false);
            }
        }
    }
    let is_root =
        |i: &u32| normals[*i as usize] != [0.0; 3] && forest.links[*i as usize] >> 1 == *i;
    Parts {
        count: (0..normals.len() as u32).filter(is_root).count() as u64,
        joined: 0,
    }
}
