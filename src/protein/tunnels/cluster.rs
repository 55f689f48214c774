//! The same tunnel in many frames: clusters by average link.

use super::Tunnel;
use crate::numeric::vector::{add, length, scale, sub};

/// Points that a centreline is compared by.
const POINTS: usize = 16;

/// A centreline as sixteen points an equal way apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Course([[f64; 3]; POINTS]);

impl Course {
    /// The course of a tunnel.
    pub fn of(tunnel: &Tunnel) -> Self {
        let stops = &tunnel.stops;
        let step = tunnel.length / (POINTS - 1) as f64;
        Course(std::array::from_fn(|k| {
            let at = step * k as f64;
            let next = stops
                .partition_point(|stop| stop.at < at)
                .clamp(1, stops.len() - 1);
            let (a, b) = (stops[next - 1], stops[next]);
            let along = if b.at > a.at {
                (at - a.at) / (b.at - a.at)
            } else {
                0.0
            };
            add(
                a.centre,
                scale(sub(b.centre, a.centre), along.clamp(0.0, 1.0)),
            )
        }))
    }

    /// The mean distance of the points of either course to the nearest of the other.
    pub fn distance(&self, other: &Course) -> f64 {
        let one_sided = |a: &Course, b: &Course| -> f64 {
            let nearest = |p: &[f64; 3]| {
                let gaps = b.0.iter().map(|q| length(sub(*p, *q)));
                gaps.fold(f64::INFINITY, f64::min)
            };
            a.0.iter().map(nearest).sum::<f64>() / POINTS as f64
        };
        0.5 * (one_sided(self, other) + one_sided(other, self))
    }
}

/// Numbers the clusters of courses: two are joined while the mean distance between their members is at most
/// `most`, the nearest first (average link).
///
/// Clusters are numbered in the order of their first members. By chains of nearest neighbours (Benzecri
/// 1982; Juan 1982): `O(n^2)` time and room for `n` courses.
pub fn clusters(courses: &[Course], most: f64) -> Vec<usize> {
    let count = courses.len();
    let mut gap = vec![0.0f64; count * count];
    for a in 0..count {
        for b in 0..a {
            let distance = courses[a].distance(&courses[b]);
            gap[a * count + b] = distance;
            gap[b * count + a] = distance;
        }
    }
    let mut size = vec![1.0f64; count];
    let mut joins = Vec::new();
    let mut chain: Vec<usize> = Vec::new();
    for _ in 1..count {
        if chain.is_empty() {
            chain.extend((0..count).find(|k| size[*k] > 0.0));
        }
        let (a, b) = loop {
            let top = chain[chain.len() - 1];
            let before = chain.len().checked_sub(2).map(|k| chain[k]);
            let others = (0..count).filter(|k| *k != top && size[*k] > 0.0);
            // Of equally near ones that which the chain comes from, else the first.
            let key = |k: &usize| (gap[top * count + k], Some(*k) != before, *k);
            let Some(near) = others.min_by(|a, b| {
                let (a, b) = (key(a), key(b));
                a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2)))
            }) else {
                unreachable!("two clusters at least are left");
            };
            if Some(near) == before {
                break (top, near);
            }
            chain.push(near);
        };
        chain.truncate(chain.len() - 2);
        let (keep, gone) = (a.min(b), a.max(b));
        joins.push((gap[keep * count + gone], keep, gone));
        let total = size[keep] + size[gone];
        for k in 0..count {
            let mean =
                (size[keep] * gap[keep * count + k] + size[gone] * gap[gone * count + k]) / total;
            gap[keep * count + k] = mean;
            gap[k * count + keep] = mean;
        }
        size[keep] = total;
        size[gone] = 0.0;
    }
    // Distances at which clusters are joined do not fall, so those up to `most` can be taken alone.
    let mut label: Vec<usize> = (0..count).collect();
    for (_, keep, gone) in joins.into_iter().filter(|join| join.0 <= most) {
        let (keep, gone) = (label[keep], label[gone]);
        label
            .iter_mut()
            .filter(|l| **l == gone)
            .for_each(|l| *l = keep);
    }
    let mut seen = Vec::new();
    let number = |l: usize| {
        seen.iter()
            .position(|other| *other == l)
            .unwrap_or_else(|| {
                seen.push(l);
                seen.len() - 1
            })
    };
    label.into_iter().map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    fn straight(from: [f64; 3], to: [f64; 3]) -> Course {
        Course(std::array::from_fn(|k| {
            add(from, scale(sub(to, from), k as f64 / (POINTS - 1) as f64))
        }))
    }

    #[test]
    fn courses_of_three_tunnels_in_many_frames_are_three_clusters() {
        let mut rng = Rng::new(4, 0);
        let ends = [[20.0, 0.0, 0.0], [0.0, 20.0, 0.0], [-15.0, 0.0, 10.0]];
        let (mut courses, mut truth) = (vec![], vec![]);
        for frame in 0..20 {
            for (which, end) in ends.iter().enumerate() {
                if (frame + which) % 4 != 0 {
                    let shaken = end.map(|v| v + rng.range(-1.0, 1.0));
                    courses.push(straight([0, 1, 2].map(|_| rng.range(-0.5, 0.5)), shaken));
                    truth.push(which);
                }
            }
        }
        let found = clusters(&courses, 3.5);
        let mut seen = vec![];
        for t in &truth {
            if !seen.contains(t) {
                seen.push(*t);
            }
        }
        let expected: Vec<usize> = truth
            .iter()
            .map(|t| seen.iter().position(|s| s == t).expect("seen"))
            .collect();
        assert_eq!(found, expected);
        assert_eq!(clusters(&courses, 1e9), vec![0; courses.len()]);
        let alone: Vec<usize> = (0..courses.len()).collect();
        assert_eq!(clusters(&courses, -1.0), alone);
    }

    #[test]
    fn average_link_is_what_its_definition_says() {
        // By brute force: join the two clusters of least mean distance until it is too large.
        let mut rng = Rng::new(9, 0);
        for _ in 0..20 {
            let courses: Vec<Course> = (0..14)
                .map(|_| {
                    let p = [0, 1, 2].map(|_| rng.range(-5.0, 5.0));
                    straight(p, add(p, [1.0, 0.0, 0.0]))
                })
                .collect();
            let most = rng.range(1.0, 6.0);
            let mut sets: Vec<Vec<usize>> = (0..courses.len()).map(|k| vec![k]).collect();
            let mean = |a: &[usize], b: &[usize]| {
                let sum: f64 = a
                    .iter()
                    .flat_map(|i| b.iter().map(|j| courses[*i].distance(&courses[*j])))
                    .sum();
                sum / (a.len() * b.len()) as f64
            };
            loop {
                let pairs = (0..sets.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
                let near = |p: &(usize, usize)| mean(&sets[p.0], &sets[p.1]);
                let best = pairs.min_by(|p, q| near(p).total_cmp(&near(q)));
                let Some((a, b)) = best.filter(|p| near(p) <= most) else {
                    break;
                };
                let joined = sets.remove(a);
                sets[b].extend(joined);
            }
            let found = clusters(&courses, most);
            for i in 0..courses.len() {
                for j in 0..i {
                    let together = sets.iter().any(|s| s.contains(&i) && s.contains(&j));
                    assert_eq!(found[i] == found[j], together);
                }
            }
        }
    }

    #[test]
    fn no_and_one_course_have_their_cluster() {
        assert!(clusters(&[], 1.0).is_empty());
        assert_eq!(clusters(&[straight([0.0; 3], [1.0; 3])], 1.0), [0]);
    }
}
