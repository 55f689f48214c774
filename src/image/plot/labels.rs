//! Where labels go: beside their points, clear of markers and of each other.

use super::super::text::Align;
use super::scene::Words;

/// White kept around a label, in pixels.
const CLEAR: f64 = 2.0;

/// How far labels begin from the edge of their marker; those beyond the first are led to it.
const DISTANCES: [f64; 4] = [6.0, 16.0, 32.0, 52.0];

/// Directions in order of preference: beside, above and below, the corners.
const DIRECTIONS: [[f64; 2]; 8] = [
    [1.0, 0.0],
    [1.0, -1.0],
    [1.0, 1.0],
    [-1.0, 0.0],
    [-1.0, -1.0],
    [-1.0, 1.0],
    [0.0, -1.0],
    [0.0, 1.0],
];

/// What a place further out costs, and a line under the label, in places of the preference.
const FURTHER: usize = 6;
const CROSSING: usize = 9;

/// A straight line between two points.
type Segment = [[f64; 2]; 2];

/// A rectangle between two corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub from: [f64; 2],
    pub to: [f64; 2],
}

/// What labels keep away from.
pub(super) struct Obstacles {
    /// No label leaves it.
    pub bounds: Area,
    /// No label touches one.
    pub areas: Vec<Area>,
    /// Markers: their centres. No label touches one.
    pub marks: Vec<[f64; 2]>,
    /// Their size.
    pub radius: f64,
    /// Lines that a label covers only where there is no better place.
    pub lines: Vec<Segment>,
}

/// A label in its place.
pub(super) struct Placed {
    /// Where the text hangs on its baseline.
    pub at: [f64; 2],
    /// It hangs at the side of its marker: a viewer's wider font grows away from it.
    pub align: Align,
    /// A line from the marker to the text.
    pub leader: Option<Segment>,
}

impl Obstacles {
    /// The best place for a label beside a marker, which becomes an obstacle to those after it;
    /// `None` where there is no room.
    ///
    /// Greedy over eight directions and four distances. Cost: linear in the obstacles.
    pub fn place(&mut self, words: &Words, mark: [f64; 2], cap: f64) -> Option<Placed> {
        let size = [words.width(cap), cap * 1.3];
        let mut best: Option<(usize, Area, Option<Segment>, f64)> = None;
        for (ring, distance) in DISTANCES.into_iter().enumerate() {
            for (order, direction) in DIRECTIONS.into_iter().enumerate() {
                let cost = ring * FURTHER + order;
                if best.as_ref().is_some_and(|(least, ..)| *least <= cost) {
                    continue;
                }
                let area = beside(mark, direction, self.radius + distance, size);
                let leader = (ring > 0).then(|| self.leader(mark, area));
                if !self.is_free(area, leader, mark) {
                    continue;
                }
                let crossed = self.lines.iter().filter(|l| crosses(**l, area)).count();
                let cost = cost + crossed * CROSSING;
                if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
                    best = Some((cost, area, leader, direction[0]));
                }
            }
        }
        let (_, area, leader, side) = best?;
        self.areas.push(area);
        self.lines.extend(leader);
        let (align, x) = match side {
            s if s > 0.0 => (Align::Left, area.from[0]),
            s if s < 0.0 => (Align::Right, area.to[0]),
            _ => (Align::Centre, mark[0]),
        };
        Some(Placed {
            at: [x, area.from[1] + cap],
            align,
            leader,
        })
    }

    /// From the edge of a marker to the nearest point of a label.
    fn leader(&self, mark: [f64; 2], area: Area) -> Segment {
        let end: [f64; 2] =
            std::array::from_fn(|a| mark[a].clamp(area.from[a] - CLEAR, area.to[a] + CLEAR));
        let along = [end[0] - mark[0], end[1] - mark[1]];
        let length = along[0].hypot(along[1]).max(self.radius);
        let start = std::array::from_fn(|a| mark[a] + along[a] * self.radius / length);
        [start, end]
    }

    fn is_free(&self, area: Area, leader: Option<Segment>, own: [f64; 2]) -> bool {
        let bounds = self.bounds;
        let inside = (0..2).all(|a| area.from[a] >= bounds.from[a] && area.to[a] <= bounds.to[a]);
        let led_over = |other: Area| leader.is_some_and(|l| crosses(l, other));
        inside
            && self
                .areas
                .iter()
                .all(|other| !overlap(area, *other, CLEAR) && !led_over(*other))
            && self.marks.iter().all(|m| {
                let other = Area {
                    from: m.map(|c| c - self.radius),
                    to: m.map(|c| c + self.radius),
                };
                !overlap(area, other, CLEAR) && (*m == own || !led_over(other))
            })
    }
}

/// The area of a text of this size whose nearest edge is `away` from a point in a direction.
fn beside(point: [f64; 2], direction: [f64; 2], away: f64, size: [f64; 2]) -> Area {
    // Along a diagonal each axis takes its share.
    let straight = direction[0] == 0.0 || direction[1] == 0.0;
    let away = if straight { away } else { away * 0.75 };
    let from = std::array::from_fn(|a| {
        let edge = match direction[a] {
            d if d > 0.0 => 0.0,
            d if d < 0.0 => -size[a],
            _ => -size[a] * 0.5,
        };
        point[a] + direction[a] * away + edge
    });
    Area {
        from,
        to: std::array::from_fn(|a| from[a] + size[a]),
    }
}

fn overlap(a: Area, b: Area, clear: f64) -> bool {
    (0..2).all(|axis| a.from[axis] < b.to[axis] + clear && b.from[axis] < a.to[axis] + clear)
}

/// Whether a line enters an area: what is left of it, cut at the four sides, is not empty.
fn crosses([a, b]: Segment, area: Area) -> bool {
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let along = b[axis] - a[axis];
        let (from, to) = (area.from[axis] - a[axis], area.to[axis] - a[axis]);
        if along == 0.0 {
            if from > 0.0 || to < 0.0 {
                return false;
            }
            continue;
        }
        let (enter, leave) = (from / along, to / along);
        first = first.max(enter.min(leave));
        last = last.min(enter.max(leave));
    }
    first < last
}
