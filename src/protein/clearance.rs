//! How far a point is from the nearest ball: the clearance that a tunnel is measured by.

use crate::numeric::vector::{add, dot, length, scale, sub};

/// An atom as a hard ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Its centre.
    pub centre: [f64; 3],
    /// Its radius, of the van der Waals sphere.
    pub radius: f64,
}

impl Ball {
    /// How far `p` is from its surface; negative inside.
    #[inline]
    pub fn distance(&self, p: [f64; 3]) -> f64 {
        length(sub(p, self.centre)) - self.radius
    }
}

/// Balls at a point, and how far their surfaces are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near {
    /// The distance to the surface, negative inside.
    pub distance: f64,
    /// The ball.
    pub ball: u32,
}

/// Balls of a leaf at most.
const LEAF: usize = 8;

/// A part of the tree: the box of its centres and the largest of its radii.
#[derive(Debug, Clone, Copy)]
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    radius: f64,
    /// Its balls, in the order of the tree.
    start: u32,
    end: u32,
    /// The first of its two parts; 0 for a leaf.
    parts: u32,
}

impl Node {
    /// No ball in here is nearer than this.
    #[inline]
    fn bound(&self, p: [f64; 3]) -> f64 {
        let mut square = 0.0;
        for axis in 0..3 {
            let out = (self.low[axis] - p[axis])
                .max(p[axis] - self.high[axis])
                .max(0.0);
            square += out * out;
        }
        square.sqrt() - self.radius
    }
}

/// The distance to the nearest of many balls, over a tree of boxes.
///
/// The clearance `r(x) = min |x - c| - r` changes by no more than the way that `x` goes.
#[derive(Debug, Clone)]
pub struct Clearance {
    nodes: Vec<Node>,
    balls: Vec<Ball>,
    /// The index that each of them was given with.
    given: Vec<u32>,
}

impl Clearance {
    /// Sorts balls into a tree: `O(n log n)`.
    pub fn new(balls: &[Ball]) -> Self {
        let mut order: Vec<u32> = (0..balls.len() as u32).collect();
        let mut nodes = vec![];
        if !balls.is_empty() {
            nodes.push(node(balls, &order, 0, balls.len()));
        }
        let mut next = 0;
        while next < nodes.len() {
            let Node {
                low,
                high,
                start,
                end,
                ..
            } = nodes[next];
            let (start, end) = (start as usize, end as usize);
            if end - start > LEAF {
                let widest =
                    |a: &usize, b: &usize| (high[*a] - low[*a]).total_cmp(&(high[*b] - low[*b]));
                let axis = (0..3).max_by(widest).unwrap_or(0);
                let half = (end - start) / 2;
                order[start..end].select_nth_unstable_by(half, |a, b| {
                    let along = |k: u32| balls[k as usize].centre[axis];
                    along(*a).total_cmp(&along(*b)).then(a.cmp(b))
                });
                nodes[next].parts = nodes.len() as u32;
                nodes.push(node(balls, &order, start, start + half));
                nodes.push(node(balls, &order, start + half, end));
            }
            next += 1;
        }
        Clearance {
            nodes,
            balls: order.iter().map(|k| balls[*k as usize]).collect(),
            given: order,
        }
    }

    /// The largest radius; 0 without balls.
    pub fn largest(&self) -> f64 {
        self.nodes.first().map_or(0.0, |root| root.radius)
    }

    /// The nearest ball; the first given of those equally near. None without balls.
    pub fn nearest(&self, p: [f64; 3]) -> Option<Near> {
        let mut best: Option<Near> = None;
        self.visit(p, f64::INFINITY, |near, _| {
            let is_better = best.is_none_or(|b| (near.distance, near.ball) < (b.distance, b.ball));
            if is_better {
                best = Some(near);
            }
            best.map_or(f64::INFINITY, |b| b.distance)
        });
        best
    }

    /// The distance to the nearest ball; infinite without any.
    pub fn at(&self, p: [f64; 3]) -> f64 {
        self.between(p, f64::NEG_INFINITY, f64::INFINITY)
    }

    /// The distance to the nearest ball, where it is known to be at least `floor` and at most `best`:
    /// the search ends with the first ball at the floor, of many that are equally near.
    pub fn between(&self, p: [f64; 3], floor: f64, mut best: f64) -> f64 {
        if best > floor {
            self.visit(p, best, |near, _| {
                best = best.min(near.distance);
                if best > floor {
                    best
                } else {
                    f64::NEG_INFINITY
                }
            });
        }
        best
    }

    /// The least distance along the straight way from `a` to `b`, and the ball it is to: exact but for
    /// rounding, however long the way is.
    pub fn along(&self, a: [f64; 3], b: [f64; 3]) -> Near {
        let middle = scale(add(a, b), 0.5);
        let half = 0.5 * length(sub(b, a));
        let mut best = Near {
            distance: f64::INFINITY,
            ball: u32::MAX,
        };
        // Seen from the middle, what is nearest somewhere on the way is no further than this.
        self.visit(middle, f64::INFINITY, |near, ball| {
            let distance = ball.distance(Self::closest_on_way(a, b, ball));
            if (distance, near.ball) < (best.distance, best.ball) {
                best = Near {
                    distance,
                    ball: near.ball,
                };
            }
            best.distance + half
        });
        best
    }

    /// Where the straight way from `a` to `b` is nearest to a ball.
    pub fn closest_on_way(a: [f64; 3], b: [f64; 3], ball: &Ball) -> [f64; 3] {
        let way = sub(b, a);
        let square = dot(way, way);
        if square == 0.0 {
            return a;
        }
        let along = (dot(sub(ball.centre, a), way) / square).clamp(0.0, 1.0);
        add(a, scale(way, along))
    }

    /// The `count` nearest balls, nearest first.
    pub fn several(&self, p: [f64; 3], count: usize) -> Vec<Near> {
        let mut best: Vec<Near> = Vec::with_capacity(count + 1);
        self.visit(p, f64::INFINITY, |near, _| {
            let key = |n: &Near| (n.distance, n.ball);
            let at = best.partition_point(|other| key(other) < key(&near));
            best.insert(at, near);
            best.truncate(count);
            match best.last() {
                Some(last) if best.len() == count => last.distance,
                _ => f64::INFINITY,
            }
        });
        best
    }

    /// All balls whose surface is within `reach` of `p`, in no particular order.
    pub fn within(&self, p: [f64; 3], reach: f64, found: &mut Vec<u32>) {
        self.visit(p, reach, |near, _| {
            found.push(near.ball);
            reach
        });
    }

    /// Shows the balls no further than `reach`, which the visitor may draw in.
    fn visit(&self, p: [f64; 3], mut reach: f64, mut visitor: impl FnMut(Near, &Ball) -> f64) {
        let Some(root) = self.nodes.first() else {
            return;
        };
        let mut waiting = [(0.0, 0u32); 64];
        waiting[0] = (root.bound(p), 0);
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (bound, index) = waiting[count];
            if bound > reach {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.parts == 0 {
                for k in node.start as usize..node.end as usize {
                    let distance = self.balls[k].distance(p);
                    if distance <= reach {
                        reach = visitor(
                            Near {
                                distance,
                                ball: self.given[k],
                            },
                            &self.balls[k],
                        );
                    }
                }
                continue;
            }
            let a = (self.nodes[node.parts as usize].bound(p), node.parts);
            let b = (self.nodes[node.parts as usize + 1].bound(p), node.parts + 1);
            let (near, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
            waiting[count] = far;
            waiting[count + 1] = near;
            count += 2;
        }
    }
}

fn node(balls: &[Ball], order: &[u32], start: usize, end: usize) -> Node {
    let mut made = Node {
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
        radius: f64::NEG_INFINITY,
        start: start as u32,
        end: end as u32,
        parts: 0,
    };
    for index in &order[start..end] {
        let Ball { centre, radius } = balls[*index as usize];
        made.radius = made.radius.max(radius);
        for axis in 0..3 {
            made.low[axis] = made.low[axis].min(centre[axis]);
            made.high[axis] = made.high[axis].max(centre[axis]);
        }
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    #[test]
    fn the_tree_answers_as_a_scan_does() {
        let mut rng = Rng::new(1, 0);
        for count in [0, 1, 7, 9, 300] {
            let balls: Vec<Ball> = (0..count)
                .map(|k| Ball {
                    // Every third stands where another does.
                    centre: match k % 3 {
                        0 => [0.25, 0.5, 0.75],
                        _ => [rng.unit(), rng.unit(), rng.unit() * 0.1],
                    },
                    radius: rng.range(-0.1, 0.3),
                })
                .collect();
            let tree = Clearance::new(&balls);
            for _ in 0..200 {
                let p = [rng.range(-2.0, 3.0), rng.unit(), rng.unit()];
                let mut all: Vec<Near> = (0u32..)
                    .zip(&balls)
                    .map(|(ball, b)| Near {
                        distance: b.distance(p),
                        ball,
                    })
                    .collect();
                all.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.ball.cmp(&b.ball)));
                assert_eq!(tree.nearest(p), all.first().copied());
                assert_eq!(
                    tree.at(p),
                    all.first().map_or(f64::INFINITY, |n| n.distance)
                );
                let [floor, best] = all
                    .first()
                    .map_or([0.0; 2], |n| [n.distance - 0.1, n.distance + 0.1]);
                assert_eq!(
                    tree.between(p, floor, best),
                    all.first().map_or(best, |n| n.distance)
                );
                assert_eq!(tree.several(p, 4), all[..count.min(4)]);
                let q = [rng.range(-2.0, 3.0), rng.unit(), rng.unit()];
                let along = tree.along(p, q);
                let step = |k: usize| add(p, scale(sub(q, p), k as f64 / 256.0));
                let sampled = (0..=256)
                    .map(|k| tree.at(step(k)))
                    .fold(f64::INFINITY, f64::min);
                let gap = length(sub(q, p)) / 512.0;
                assert!(along.distance <= sampled + 1e-12, "{along:?} {sampled}");
                assert!(
                    count == 0 || along.distance >= sampled - gap,
                    "{along:?} {sampled}"
                );
                let mut within = Vec::new();
                tree.within(p, 0.4, &mut within);
                within.sort_unstable();
                let mut expected: Vec<u32> = all
                    .iter()
                    .filter(|n| n.distance <= 0.4)
                    .map(|n| n.ball)
                    .collect();
                expected.sort_unstable();
                assert_eq!(within, expected);
            }
        }
    }
}
