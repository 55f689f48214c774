//! Which discs are kept.

use super::field::{Field, fit};
use super::grow::{Bounds, Cloud, Growth};
use super::params::{Cover, Order};
use crate::numeric::rng::Rng;
use crate::progress::Progress;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The natural neighbours of a point are within so many spacings, as a rule.
const RING: f64 = 1.5;
/// Points done between two words of progress.
const STEP: usize = 1 << 12;

/// Hears of each disc that is kept, with its field.
pub type Keep<'a> = dyn FnMut(&Growth, &Field) + 'a;

/// The indices of the points, which are along Morton's curve, in the order in which they start discs.
pub fn order(order: Order, sources: &[u32]) -> Vec<u32> {
    let mut all: Vec<u32> = (0..sources.len() as u32).collect();
    match order {
        Order::Morton => {}
        Order::File => all.sort_unstable_by_key(|i| sources[*i as usize]),
        Order::Random(seed) => {
            all.sort_by_cached_key(|i| (Rng::new(seed, u64::from(*i)).bits(), *i));
        }
    }
    all
}

/// Covers all points that have a normal, so that each lies in a disc and at most `delta` from it.
pub fn cover(
    cloud: &Cloud,
    order: &[u32],
    bounds: &Bounds,
    (cover, perc): (Cover, f64),
    progress: &dyn Progress,
    keep: &mut Keep,
) {
    match cover {
        Cover::Paper => {
            progress.stage("grow", order.len() as u64);
            let mut done = vec![false; order.len()];
            sweep(
                cloud,
                order,
                bounds,
                progress,
                &mut done,
                &mut |growth, done| {
                    keep(growth, &fit(cloud, growth));
                    settle(cloud, growth, bounds, perc, done);
                },
            );
        }
        Cover::Greedy => greedy(cloud, order, bounds, perc, progress, keep),
    }
}

/// Grows a disc from each point in turn that is not done.
fn sweep(
    cloud: &Cloud,
    order: &[u32],
    bounds: &Bounds,
    progress: &dyn Progress,
    done: &mut [bool],
    found: &mut dyn FnMut(&Growth, &mut [bool]),
) {
    let mut growth = Growth::default();
    for chunk in order.chunks(STEP) {
        for &i in chunk {
            let i = i as usize;
            if !done[i] && cloud.normals[i] != [0.0; 3] {
                growth.grow(cloud, i, bounds);
                found(&growth, done);
                done[i] = true;
            }
        }
        progress.advance(chunk.len() as u64);
    }
}

/// The points that start no disc after this one: those it covers near its centre, within the bound.
fn settle(cloud: &Cloud, growth: &Growth, bounds: &Bounds, perc: f64, done: &mut [bool]) {
    let near = perc * growth.radius;
    for &j in &growth.covered {
        let (in_plane, height) = growth.place(cloud, j);
        if in_plane <= near * near && height.abs() <= bounds.delta {
            done[j as usize] = true;
        }
    }
}

/// Calls `f` for the points that need no other disc beside this one: those near its centre, as in the
/// paper, and those whose natural neighbours it covers too, so that there is no hole about them.
fn served(cloud: &Cloud, growth: &Growth, bounds: &Bounds, perc: f64, mut f: impl FnMut(usize)) {
    for &j in &growth.covered {
        let (in_plane, height) = growth.place(cloud, j);
        let j = j as usize;
        let inner = (growth.radius - RING * cloud.spacings[j]).max(perc * growth.radius);
        if j == growth.source as usize
            || (in_plane <= inner * inner && height.abs() <= bounds.delta)
        {
            f(j);
        }
    }
}

/// Takes discs by what they serve that no other does, most first; gains only fall, so that one is
/// counted anew only when it comes to the top.
///
/// Nothing is kept of a disc but where it begins: it is grown again when it is counted. Source: Minoux,
/// "Accelerated greedy algorithms for maximizing submodular set functions", 1978.
fn greedy(
    cloud: &Cloud,
    order: &[u32],
    bounds: &Bounds,
    perc: f64,
    progress: &dyn Progress,
    keep: &mut Keep,
) {
    progress.stage("candidates", order.len() as u64);
    let mut done = vec![false; order.len()];
    let mut heap = BinaryHeap::new();
    let mut rank = 0u32;
    sweep(
        cloud,
        order,
        bounds,
        progress,
        &mut done,
        &mut |growth, done| {
            let mut gain = 0u32;
            served(cloud, growth, bounds, perc, |_| gain += 1);
            heap.push((gain, Reverse(rank), growth.source));
            rank += 1;
            settle(cloud, growth, bounds, perc, done);
        },
    );
    progress.stage("grow", u64::from(rank));
    done.fill(false);
    let mut growth = Growth::default();
    while let Some((_, rank, i)) = heap.pop() {
        growth.grow(cloud, i as usize, bounds);
        let mut gain = 0u32;
        served(cloud, &growth, bounds, perc, |j| {
            gain += u32::from(!done[j])
        });
        if gain == 0 {
            progress.advance(1);
        } else if heap.peek().is_some_and(|top| (gain, rank, i) < *top) {
            heap.push((gain, rank, i));
        } else {
            keep(&growth, &fit(cloud, &growth));
            served(cloud, &growth, bounds, perc, |j| done[j] = true);
            progress.advance(1);
        }
    }
    // What no candidate serves, as candidates begin nowhere near it.
    progress.stage("rest", order.len() as u64);
    sweep(
        cloud,
        order,
        bounds,
        progress,
        &mut done,
        &mut |growth, done| {
            keep(growth, &fit(cloud, growth));
            served(cloud, growth, bounds, perc, |j| done[j] = true);
        },
    );
}
