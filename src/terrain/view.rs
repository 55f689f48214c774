//! What a camera sees of a surface: for each pixel the exact place, or the sky.

use super::pyramid::{BLOCK, Pyramid};
use super::surface::{Half, Kind, Square, Surface};
use crate::camera::{Camera, Lens, Size};
use crate::numeric::vector::{Vec3, sub};
use crate::progress::Progress;
use crate::vector::Vec2;
use rayon::prelude::*;

/// A visible place: coordinates on the lattice and the height above the surface's base; NaN for the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// The place on the lattice.
    pub at: Vec2,
    /// Local height.
    pub z: f64,
}

impl Seen {
    /// Nothing of the surface.
    pub const SKY: Seen = Seen {
        at: [f64::NAN; 2],
        z: f64::NAN,
    };

    /// Whether there is nothing of the surface.
    #[inline]
    pub fn is_sky(&self) -> bool {
        self.z.is_nan()
    }
}

/// A surface ready to be looked at.
pub struct Scene<'a> {
    /// The surface.
    pub surface: &'a Surface<'a>,
    /// Its pyramid.
    pub pyramid: &'a Pyramid,
}

/// A line of sight in coordinates of the lattice and local heights; its parameter is the depth in the camera's
/// unit.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    from: Vec3,
    step: Vec3,
    /// One over the step.
    inverse: Vec3,
    near: f64,
}

impl Sight {
    /// The place at a depth.
    #[inline]
    pub fn at(&self, depth: f64) -> Vec3 {
        std::array::from_fn(|a| self.from[a] + depth * self.step[a])
    }
}

/// All visible places of a picture, row by row: rays through the places `offset` from each pixel's centre.
///
/// Neighbouring triangles leave no crack between them. Cost: the nodes of the pyramid along each ray, a few dozen.
pub fn look(
    scene: &Scene,
    camera: &Camera,
    size: Size,
    offset: Vec2,
    progress: &dyn Progress,
) -> Vec<Seen> {
    let bands = size.height.div_ceil(TILE);
    progress.stage("terrain", bands as u64);
    let mut out = vec![Seen::SKY; size.width * size.height];
    out.par_chunks_mut((size.width * TILE).max(1))
        .enumerate()
        .for_each(|(band, rows)| {
            let height = rows.len() / size.width.max(1);
            for left in (0..size.width).step_by(TILE) {
                let right = (left + TILE).min(size.width);
                let at = |x: usize, y: usize| {
                    let y = (band * TILE + y) as f64 + 0.5 + offset[1];
                    scene.sight(camera, [x as f64 + 0.5 + offset[0], y], size)
                };
                let (x, y) = (right - 1, height - 1);
                let start = scene.start(&[at(left, 0), at(x, 0), at(left, y), at(x, y)]);
                for y in 0..height {
                    for x in left..right {
                        let mut sight = at(x, y);
                        sight.near = sight.near.max(start);
                        rows[y * size.width + x] = scene.cast(&sight);
                    }
                }
            }
            progress.advance(1);
        });
    out
}

/// Pixels along the side of a tile whose rays set out together.
const TILE: usize = 8;

impl Scene<'_> {
    /// The line of sight through a place of the screen.
    pub fn sight(&self, camera: &Camera, at: Vec2, size: Size) -> Sight {
        let near = camera.from_screen(at[0], at[1], 0.0, size);
        let far = camera.from_screen(at[0], at[1], 1.0, size);
        let surface = self.surface;
        let step = camera.turn_back(sub(far, near));
        let from = camera.turn_back(near);
        let world = |v: Vec3| v.map(|c| c * camera.unit);
        let (step, from) = (world(step), world(from));
        let target = surface.to_lattice([camera.target[0], camera.target[1]]);
        let from_target = surface.to_lattice_step([from[0], from[1]]);
        let along = surface.to_lattice_step([step[0], step[1]]);
        Sight {
            from: [
                target[0] + from_target[0],
                target[1] + from_target[1],
                (camera.target[2] - surface.base()) + from[2],
            ],
            step: [along[0], along[1], step[2]],
            inverse: [along[0], along[1], step[2]].map(|c| 1.0 / c),
            near: match camera.lens {
                Lens::Orthographic { .. } => f64::NEG_INFINITY,
                Lens::Perspective { .. } => camera.near().unwrap_or(0.0),
            },
        }
    }

    /// A depth before which no ray between four of one eye meets the surface; infinite where none ever does.
    ///
    /// The rays' steps are taken as intervals, in which those of all rays between the corners lie.
    fn start(&self, corners: &[Sight; 4]) -> f64 {
        let near = corners[0].near;
        if near < 0.0 {
            return near;
        }
        let bound = |pick: fn(f64, f64) -> f64, a: usize| {
            let steps = corners.iter().map(|sight| sight.step[a]);
            steps.reduce(pick).unwrap_or(0.0)
        };
        let low: Vec3 = std::array::from_fn(|a| bound(f64::min, a));
        let high: Vec3 = std::array::from_fn(|a| bound(f64::max, a));
        let from = corners[0].from;
        let mut best = f64::INFINITY;
        let mut stack = vec![(self.pyramid.levels() - 1, 0, 0)];
        let flip = usize::from(low[0] + high[0] < 0.0) | usize::from(low[1] + high[1] < 0.0) << 1;
        while let Some((level, column, row)) = stack.pop() {
            let span = self.pyramid.span(level, column, row);
            if span.is_empty() {
                continue;
            }
            let side = (BLOCK << level) as f64;
            let (mut enter, mut leave) = (near, f64::INFINITY);
            for (a, lo) in [column as f64 * side, row as f64 * side]
                .into_iter()
                .enumerate()
            {
                reach(
                    [low[a], high[a]],
                    lo - from[a],
                    lo + side - from[a],
                    &mut enter,
                    &mut leave,
                );
            }
            if enter > leave || enter >= best {
                continue;
            }
            // Heights of the rays over the node: the least and the greatest.
            let least = (low[2] * enter).min(low[2] * leave) + from[2];
            let most = (high[2] * enter).max(high[2] * leave) + from[2];
            if least > f64::from(span.high) || most < f64::from(span.low) {
                continue;
            }
            if level == 0 {
                best = enter;
                continue;
            }
            for k in [3, 2, 1, 0] {
                let child = flip ^ k;
                stack.push((level - 1, 2 * column + (child & 1), 2 * row + (child >> 1)));
            }
        }
        // A little earlier than rounding may have put it.
        best * (1.0 - 1e-9)
    }

    /// The first place of the surface on a line of sight.
    pub fn cast(&self, sight: &Sight) -> Seen {
        let whole = self.pyramid.whole();
        let [columns, rows] = self.surface.squares().map(|n| n as f64);
        let mut range = [sight.near, f64::INFINITY];
        let box_low = [0.0, 0.0, f64::from(whole.low)];
        let box_high = [columns, rows, f64::from(whole.high)];
        for a in 0..3 {
            clip(sight, a, box_low[a], box_high[a], &mut range);
        }
        // Flat ground lies on its box's side, where rounding may leave nothing.
        let slack = 1e-9 * range[0].abs().max(range[1].abs()).min(f64::MAX);
        let range = [(range[0] - slack).max(sight.near), range[1] + slack];
        if range[0] > range[1] || !range[1].is_finite() {
            return Seen::SKY;
        }
        let mut walk = Walk {
            scene: self,
            sight,
            range,
            above: None,
            tolerance: 256.0
                * f64::EPSILON
                * (sight.from[2].abs() + whole.high.abs().max(whole.low.abs()) as f64),
        };
        walk.descend()
    }
}

/// Cuts a range of depths to where a coordinate may be between two numbers, for a step from an interval.
#[inline]
fn reach(step: [f64; 2], low: f64, high: f64, enter: &mut f64, leave: &mut f64) {
    if step[0] > 0.0 || step[1] < 0.0 {
        // Going up, turned around where it goes down.
        let (slow, fast, low, high) = if step[0] > 0.0 {
            (step[0], step[1], low, high)
        } else {
            (-step[1], -step[0], -high, -low)
        };
        *enter = enter.max(low / if low > 0.0 { fast } else { slow });
        *leave = leave.min(high / if high > 0.0 { slow } else { fast });
    } else if low > 0.0 {
        *enter = enter.max(low / step[1]);
    } else if high < 0.0 {
        *enter = enter.max(high / step[0]);
    }
}

/// Cuts the range of depths to where a coordinate is between two numbers.
#[inline]
fn clip(sight: &Sight, axis: usize, low: f64, high: f64, range: &mut [f64; 2]) {
    let (from, step) = (sight.from[axis], sight.step[axis]);
    if step == 0.0 {
        if from < low || from > high {
            *range = [f64::INFINITY, f64::NEG_INFINITY];
        }
        return;
    }
    let (a, b) = (
        (low - from) * sight.inverse[axis],
        (high - from) * sight.inverse[axis],
    );
    range[0] = range[0].max(a.min(b));
    range[1] = range[1].min(a.max(b));
}

struct Walk<'a> {
    scene: &'a Scene<'a>,
    sight: &'a Sight,
    range: [f64; 2],
    /// Whether the ray was last above the surface; none at first.
    above: Option<bool>,
    /// More than the rounding of a height.
    tolerance: f64,
}

impl Walk<'_> {
    fn descend(&mut self) -> Seen {
        let pyramid = self.scene.pyramid;
        // Three siblings wait on each level.
        let mut stack = [(0u32, 0u32, 0u32); 128];
        let mut depth = 1;
        stack[0] = (pyramid.levels() as u32 - 1, 0, 0);
        let near = u32::from(self.sight.step[0] < 0.0) | u32::from(self.sight.step[1] < 0.0) << 1;
        while depth > 0 {
            depth -= 1;
            let (level, column, row) = stack[depth];
            let span = pyramid.span(level as usize, column as usize, row as usize);
            if span.is_empty() {
                continue;
            }
            let side = (BLOCK << level) as f64;
            let lo = [f64::from(column) * side, f64::from(row) * side];
            let mut range = self.range;
            clip(self.sight, 0, lo[0], lo[0] + side, &mut range);
            clip(self.sight, 1, lo[1], lo[1] + side, &mut range);
            if range[0] > range[1] {
                continue;
            }
            let z = range.map(|t| self.sight.from[2] + t * self.sight.step[2]);
            let (low, high) = (z[0].min(z[1]), z[0].max(z[1]));
            if low > f64::from(span.high) + self.tolerance
                || high < f64::from(span.low) - self.tolerance
            {
                continue;
            }
            if level == 0 {
                if let Some(seen) = self.block(column as usize, row as usize, range) {
                    return seen;
                }
                continue;
            }
            // The nearest is on top.
            for k in [3, 2, 1, 0] {
                let child = near ^ k;
                let (x, y) = (child & 1, child >> 1);
                stack[depth] = (level - 1, 2 * column + x, 2 * row + y);
                depth += 1;
            }
        }
        Seen::SKY
    }

    /// Walks through the squares of a block.
    fn block(&mut self, column: usize, row: usize, range: [f64; 2]) -> Option<Seen> {
        let squares = self.scene.surface.squares();
        let first = [column * BLOCK, row * BLOCK];
        let last = [0, 1].map(|a| (first[a] + BLOCK).min(squares[a]) - 1);
        let sight = self.sight;
        let start = sight.at(range[0]);
        let mut cell = [0, 1].map(|a| (start[a].max(0.0) as usize).clamp(first[a], last[a]));
        let mut t = range[0];
        loop {
            // Where the ray leaves the square.
            let mut leave = [f64::INFINITY; 2];
            for a in 0..2 {
                let step = sight.step[a];
                if step != 0.0 {
                    let border = cell[a] as f64 + f64::from(u8::from(step > 0.0));
                    leave[a] = (border - sight.from[a]) * sight.inverse[a];
                }
            }
            let axis = usize::from(leave[1] < leave[0]);
            let end = leave[axis].min(range[1]).max(t);
            if let Some(seen) = self.square(cell, t, end) {
                return Some(seen);
            }
            if leave[axis] >= range[1] {
                return None;
            }
            t = end;
            if sight.step[axis] > 0.0 {
                if cell[axis] == last[axis] {
                    return None;
                }
                cell[axis] += 1;
            } else {
                if cell[axis] == first[axis] {
                    return None;
                }
                cell[axis] -= 1;
            }
        }
    }

    fn square(&mut self, cell: [usize; 2], t0: f64, t1: f64) -> Option<Seen> {
        let square = self.scene.surface.square(cell[0], cell[1]);
        if self.scene.surface.kind() == Kind::Bilinear {
            return self.patch(&square, cell, t0, t1);
        }
        let sight = self.sight;
        let z = [t0, t1].map(|t| sight.from[2] + t * sight.step[2]);
        let [a, b, c, d] = square.z;
        // With a missing height the sum is no number, and the test fails.
        let clear = z[0].min(z[1]) - self.tolerance;
        if a.max(b).max(c.max(d)) + 0.0 * (a + b + c + d) < clear {
            self.above = Some(true);
            return None;
        }
        let (sum, step) = (sight.from[0] + sight.from[1], sight.step[0] + sight.step[1]);
        let level = (cell[0] + cell[1] + 1) as f64;
        let is_first = |t: f64| sum + t * step < level;
        let cut = if step == 0.0 {
            t1
        } else {
            (level - sum) / step
        };
        let cut = cut.clamp(t0, t1);
        let early = is_first(0.5 * (t0 + cut));
        let late = if cut < t1 {
            is_first(0.5 * (cut + t1))
        } else {
            early
        };
        for (first, from, to) in [(early, t0, cut), (late, cut, t1)] {
            if from < to || (from == to && t0 == t1) {
                let half = if first { Half::First } else { Half::Last };
                if let Some(seen) = self.triangle(&square, half, cell, from, to) {
                    return Some(seen);
                }
            }
        }
        None
    }

    fn triangle(
        &mut self,
        square: &Square,
        half: Half,
        cell: [usize; 2],
        t0: f64,
        t1: f64,
    ) -> Option<Seen> {
        if !square.has(half) {
            self.above = None;
            return None;
        }
        let [z, du, dv] = square.plane(half);
        let height = |p: Vec3| z + ((p[0] - cell[0] as f64) * du + (p[1] - cell[1] as f64) * dv);
        let over = |t: f64| {
            let p = self.sight.at(t);
            p[2] - height(p)
        };
        let (f0, f1) = (over(t0), over(t1));
        let t = self.meets(f0, f1, t0, |_| t0 + (t1 - t0) * (f0 / (f0 - f1)))?;
        let p = self.sight.at(t);
        Some(Seen {
            at: [p[0], p[1]],
            z: height(p),
        })
    }

    /// Where the ray comes through between two differences, as `root` says, or at the start where rounding
    /// put the crossing between two pieces.
    fn meets(&mut self, f0: f64, f1: f64, start: f64, root: impl FnOnce(()) -> f64) -> Option<f64> {
        let is_above = |f: f64| f > 0.0;
        let is_other_side = self.above.is_some_and(|above| above != is_above(f0));
        if is_other_side && f0.abs() <= self.tolerance {
            return Some(start);
        }
        if f0 == 0.0 {
            return Some(start);
        }
        if is_above(f0) != is_above(f1) {
            return Some(root(()));
        }
        self.above = Some(is_above(f1));
        None
    }

    fn patch(&mut self, square: &Square, cell: [usize; 2], t0: f64, t1: f64) -> Option<Seen> {
        let [a, b, c, d] = square.z;
        if (a + b + c + d).is_nan() {
            self.above = None;
            return None;
        }
        let sight = self.sight;
        let height = |p: Vec3| {
            let (s, t) = (p[0] - cell[0] as f64, p[1] - cell[1] as f64);
            let first = a + s * (b - a);
            first + t * (c + s * (d - c) - first)
        };
        let over = |t: f64| {
            let p = sight.at(t);
            p[2] - height(p)
        };
        let (f0, fm, f1) = (over(t0), over(0.5 * (t0 + t1)), over(t1));
        // Along a straight line a patch is a parabola, which may dip through the ray and come back.
        let (second, slope) = (2.0 * (f0 + f1) - 4.0 * fm, 4.0 * fm - 3.0 * f0 - f1);
        let root = first_root(second, slope, f0).filter(|r| *r <= 1.0);
        let t = match (root, self.above.is_some_and(|above| above != (f0 > 0.0))) {
            (Some(r), false) if f0 != 0.0 => {
                self.above = Some(f1 > 0.0);
                Some(t0 + r * (t1 - t0))
            }
            _ => self.meets(f0, f1, t0, |()| t0 + (t1 - t0) * (f0 / (f0 - f1))),
        }?;
        let p = sight.at(t);
        Some(Seen {
            at: [p[0], p[1]],
            z: height(p),
        })
    }
}

/// The least root from 0 on of `a x^2 + b x + c`.
fn first_root(a: f64, b: f64, c: f64) -> Option<f64> {
    if a == 0.0 {
        return (b != 0.0).then(|| -c / b).filter(|x| *x >= 0.0);
    }
    let square = b * b - 4.0 * a * c;
    if square < 0.0 {
        return None;
    }
    // Without cancellation (Press et al. 2007, "Numerical Recipes", section 5.6).
    let q = -0.5 * (b + square.sqrt().copysign(b));
    let roots = [q / a, if q == 0.0 { 0.0 } else { c / q }];
    let positive = roots.into_iter().filter(|x| *x >= 0.0);
    positive.fold(None, |least: Option<f64>, x| {
        Some(least.map_or(x, |l| l.min(x)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;
    use crate::terrain::surface::tests::grid;

    const SIZE: Size = Size {
        width: 120,
        height: 90,
    };

    fn rough(x: f64, y: f64) -> f64 {
        (x * 0.7).sin() * 2.0 + (y * 0.9).cos() * 1.5 + 10.0
    }

    /// The first place along a ray by small steps.
    fn by_steps(scene: &Scene, sight: &Sight, far: f64) -> Option<Vec3> {
        let mut before = None;
        for k in 0..40_000 {
            let t = sight.near.max(0.0) + far * f64::from(k) / 40_000.0;
            let p = sight.at(t);
            let over = scene.surface.local_height([p[0], p[1]]).map(|z| p[2] > z);
            if before.is_some() && over.is_some() && before != over {
                return Some(p);
            }
            before = over;
        }
        None
    }

    #[test]
    fn places_are_on_the_surface_and_the_first_on_their_rays() {
        let grid = grid(40, 30, 1.0, |x, y| {
            if (12.0..15.0).contains(&x) && (12.0..16.0).contains(&y) {
                -9999.0
            } else {
                rough(x, y)
            }
        });
        for kind in [Kind::Tin, Kind::Bilinear] {
            let surface = Surface::new(&grid, kind).unwrap();
            let pyramid = Pyramid::new(&surface);
            let scene = Scene {
                surface: &surface,
                pyramid: &pyramid,
            };
            let up = [0.0, 0.0, 1.0];
            for (eye, target) in [
                ([-5.0, -10.0, 25.0], [20.0, 15.0, 10.0]),
                ([20.0, 15.0, 14.0], [35.0, 20.0, 10.0]),
                ([20.2, 15.1, 60.0], [20.0, 15.0, 10.0]),
                ([20.0, 15.0, -20.0], [22.0, 20.0, 10.0]),
            ] {
                let camera = Camera::look_at(eye, target, up, 0.9);
                let seen = look(&scene, &camera, SIZE, [0.0; 2], &Silent);
                let mut ground = 0;
                for (k, seen) in seen.iter().enumerate().step_by(7) {
                    let (x, y) = (k % SIZE.width, k / SIZE.width);
                    let at = [x as f64 + 0.5, y as f64 + 0.5];
                    let sight = scene.sight(&camera, at, SIZE);
                    let expected = by_steps(&scene, &sight, 6.0);
                    assert_eq!(seen.is_sky(), expected.is_none(), "{kind:?} {x} {y}");
                    if let Some(p) = expected {
                        ground += 1;
                        let off = (p[0] - seen.at[0]).hypot(p[1] - seen.at[1]);
                        assert!(off < 0.05, "{kind:?} {x} {y}: {off}");
                        let z = surface.local_height(seen.at).unwrap();
                        assert!((z - seen.z).abs() < 1e-9);
                    }
                }
                assert!(ground > 200, "{ground}");
            }
        }
    }

    #[test]
    fn there_are_no_cracks() {
        // Rays through corners, edges and diagonals, from straight above and at 45 degrees.
        let grid = grid(17, 17, 1.0, rough);
        let surface = Surface::new(&grid, Kind::Tin).unwrap();
        let pyramid = Pyramid::new(&surface);
        let scene = Scene {
            surface: &surface,
            pyramid: &pyramid,
        };
        let size = Size {
            width: 64,
            height: 64,
        };
        for eye in [[8.5, 8.5, 40.0], [8.5, -21.5, 40.0], [38.5, 8.5, 40.0]] {
            let mut camera = Camera::look_at(eye, [8.5, 8.5, 10.0], [0.0, 1.0, 1e-3], 0.5);
            camera.lens = Lens::Orthographic {
                height: 4.0 / camera.unit,
            };
            for shift in [-0.5, 0.0] {
                let seen = look(&scene, &camera, size, [shift; 2], &Silent);
                let sky = seen.iter().position(Seen::is_sky);
                let sight = |k: usize| {
                    scene.sight(
                        &camera,
                        [(k % 64) as f64 + 0.5 + shift, (k / 64) as f64 + 0.5 + shift],
                        size,
                    )
                };
                assert_eq!(sky, None, "{eye:?} {shift} {:?}", sky.map(sight));
            }
        }
    }

    #[test]
    fn flat_ground_is_seen() {
        let grid = grid(9, 9, 1.0, |_, _| 5.0);
        let surface = Surface::new(&grid, Kind::Tin).unwrap();
        let pyramid = Pyramid::new(&surface);
        let scene = Scene {
            surface: &surface,
            pyramid: &pyramid,
        };
        let camera = Camera::look_at([4.0, -3.0, 9.0], [4.0, 4.0, 5.0], [0.0, 0.0, 1.0], 0.3);
        let seen = look(&scene, &camera, SIZE, [0.0; 2], &Silent);
        assert!(seen.iter().all(|s| s.z == 0.0));
    }
}
