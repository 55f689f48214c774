//! Counting the faces of polyhedra in front of, or behind, what each pixel shows.
//!
//! Corners are snapped to 1/256 of a pixel, and a pixel belongs to a triangle by the top-left rule, so that
//! triangles that share an edge share no pixel and leave none out; which way a triangle faces is taken from the
//! snapped corners too. So a closed polyhedron counts 0 for any pixel whose ray passes all of it.

use super::extrude::{Face, Polyhedron};
use crate::camera::{Camera, Lens, Size};
use crate::numeric::vector::{Vec3, add, dot, scale, sub};
use std::ops::Range;

/// Steps of a pixel.
const STEPS: f64 = 256.0;
/// Triangles are cut this many pixels away from the middle of the picture, far outside of it.
const GUARD: f64 = (1u64 << 20) as f64;

/// How faces are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// Those in front: front faces up, back faces down.
    Pass,
    /// Those behind: back faces up, front faces down.
    Fail,
}

/// A triangle on the screen.
#[derive(Debug, Clone, Copy)]
struct Patch {
    /// Corners in steps, clockwise or counter-clockwise such that its area is positive.
    corners: [[i64; 2]; 3],
    /// Whether the corners were turned: it faces away.
    back: bool,
    /// Its key at a place of the screen: grows with the depth.
    key: [f64; 3],
}

/// A polyhedron on the screen.
pub struct Projected {
    patches: Vec<Patch>,
    count: Count,
    /// Columns and rows it may touch.
    pub columns: Range<usize>,
    /// Rows it may touch.
    pub rows: Range<usize>,
}

/// What faces are compared by: a depth for parallel rays, minus its inverse for others, so that it is linear on
/// the screen.
#[inline]
pub fn key(camera: &Camera, depth: f64) -> f64 {
    match camera.lens {
        Lens::Orthographic { .. } => depth,
        Lens::Perspective { .. } => -1.0 / depth,
    }
}

/// The key of a plane through a point of view space, as coefficients of 1, x and y; none for one edge-on.
fn plane_key(camera: &Camera, size: Size, normal: Vec3, through: Vec3) -> Option<[f64; 3]> {
    let n = camera.turn(normal);
    let eye = [0.0, 0.0, camera.distance];
    let away = dot(n, sub(through, eye));
    let (cx, cy) = (size.width as f64 * 0.5, size.height as f64 * 0.5);
    let zoom = camera.magnification(size, 1.0);
    // The ray is (x - cx) / zoom, (cy - y) / zoom, -1.
    let (nx, ny) = (n[0] / zoom, -n[1] / zoom);
    let (constant, divisor) = match camera.lens {
        Lens::Perspective { .. } => (-(nx * cx + ny * cy) - n[2], -away),
        Lens::Orthographic { .. } => (-(nx * cx + ny * cy) - away, n[2]),
    };
    let key = [constant / divisor, nx / divisor, ny / divisor];
    key.iter().all(|c| c.is_finite()).then_some(key)
}

/// A polyhedron brought to the screen; empty where none of it can be seen.
pub fn project(polyhedron: &Polyhedron, camera: &Camera, size: Size, count: Count) -> Projected {
    let mut patches = Vec::with_capacity(polyhedron.triangles() as usize);
    let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
    polyhedron.visit(|face| {
        let Some(key) = plane_key(camera, size, face.normal, camera.to_view(face.corners[0]))
        else {
            return;
        };
        let outline = clipped(&face, camera, size);
        let snapped: Vec<[i64; 2]> = outline
            .iter()
            .map(|p| {
                let screen = camera.to_screen(*p, size);
                [screen[0], screen[1]].map(|c| (c * STEPS).round() as i64)
            })
            .collect();
        for p in &snapped {
            for a in 0..2 {
                low[a] = low[a].min(p[a]);
                high[a] = high[a].max(p[a]);
            }
        }
        for k in 1..snapped.len().saturating_sub(1) {
            let corners = [snapped[0], snapped[k], snapped[k + 1]];
            patches.extend(patch(corners, key));
        }
    });
    let span = |a: usize, most: usize| {
        let pixel = |c: i64| (c.div_euclid(STEPS as i64)).clamp(0, most as i64) as usize;
        if low[a] > high[a] {
            0..0
        } else {
            pixel(low[a])..(pixel(high[a]) + 1).min(most)
        }
    };
    Projected {
        patches,
        count,
        columns: span(0, size.width),
        rows: span(1, size.height),
    }
}

fn patch(mut corners: [[i64; 2]; 3], key: [f64; 3]) -> Option<Patch> {
    let [a, b, c] = corners;
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    // Rows go down: what is counter-clockwise for the viewer has a negative area.
    let back = area > 0;
    if area < 0 {
        corners.swap(1, 2);
    }
    (area != 0).then_some(Patch { corners, back, key })
}

/// A face cut at the near plane and far outside the picture, in view space.
fn clipped(face: &Face, camera: &Camera, size: Size) -> Vec<Vec3> {
    let mut outline: Vec<Vec3> = face.corners.iter().map(|p| camera.to_view(*p)).collect();
    let reach = GUARD / camera.magnification(size, 1.0);
    let near = camera.near();
    // Positive inside.
    let side = |p: Vec3, plane: usize| {
        let depth = camera.distance - p[2];
        let edge = if near.is_some() { reach * depth } else { reach };
        match plane {
            0 => near.map_or(1.0, |near| depth - near),
            1 => edge - p[0],
            2 => edge + p[0],
            3 => edge - p[1],
            _ => edge + p[1],
        }
    };
    for plane in 0..5 {
        if outline.iter().all(|p| side(*p, plane) >= 0.0) {
            continue;
        }
        let mut kept = Vec::with_capacity(outline.len() + 1);
        for k in 0..outline.len() {
            let (p, q) = (outline[k], outline[(k + 1) % outline.len()]);
            let (a, b) = (side(p, plane), side(q, plane));
            if a >= 0.0 {
                kept.push(p);
            }
            if (a >= 0.0) != (b >= 0.0) {
                // From the inner end, so that both faces of an edge cut it at the same place.
                let (p, q, a, b) = if a >= 0.0 { (p, q, a, b) } else { (q, p, b, a) };
                kept.push(add(p, scale(sub(q, p), a / (a - b))));
            }
        }
        outline = kept;
    }
    outline
}

impl Projected {
    /// Moves it so that the centres of pixels are at an offset from where they were, from -0.5 to 0.5.
    pub fn shift(&mut self, offset: [f64; 2], size: Size) {
        if offset == [0.0; 2] {
            return;
        }
        let steps = offset.map(|c| (c * STEPS).round() as i64);
        for patch in &mut self.patches {
            for corner in &mut patch.corners {
                corner[0] -= steps[0];
                corner[1] -= steps[1];
            }
            patch.key[0] += patch.key[1] * offset[0] + patch.key[2] * offset[1];
        }
        let wider = |range: &Range<usize>, most: usize| {
            range.start.saturating_sub(1)..(range.end + 1).min(most)
        };
        self.columns = wider(&self.columns, size.width);
        self.rows = wider(&self.rows, size.height);
    }
}

/// Counters of some rows of a picture, and what its pixels show.
pub struct Band<'a> {
    /// Columns of the picture.
    pub width: usize,
    /// Its rows.
    pub rows: Range<usize>,
    /// Key of what each pixel shows; infinite for the sky.
    pub keys: &'a [f64],
    /// Counters, all zero between features.
    pub counters: &'a mut [i32],
    /// Fragments counted so far.
    pub fragments: u64,
}

impl Band<'_> {
    /// Counts the faces of a polyhedron.
    pub fn count(&mut self, projected: &Projected) {
        if projected.rows.end <= self.rows.start || self.rows.end <= projected.rows.start {
            return;
        }
        for patch in &projected.patches {
            self.patch(patch, projected.count);
        }
    }

    fn patch(&mut self, patch: &Patch, count: Count) {
        let ys = patch.corners.map(|p| p[1]);
        let (top, bottom) = (ys[0].min(ys[1]).min(ys[2]), ys[0].max(ys[1]).max(ys[2]));
        let steps = STEPS as i64;
        let first = top.div_euclid(steps).max(self.rows.start as i64);
        let last = bottom.div_euclid(steps).min(self.rows.end as i64 - 1);
        let up = match (count, patch.back) {
            (Count::Pass, false) | (Count::Fail, true) => 1,
            _ => -1,
        };
        for row in first..=last {
            let columns = self.columns(patch, row * steps + steps / 2);
            if columns.is_empty() {
                continue;
            }
            self.fragments += columns.len() as u64;
            let start = (row as usize - self.rows.start) * self.width;
            let y = row as f64 + 0.5;
            let constant = patch.key[0] + patch.key[2] * y;
            for column in columns {
                let key = constant + patch.key[1] * (column as f64 + 0.5);
                let passes = key < self.keys[start + column];
                if passes == (count == Count::Pass) {
                    self.counters[start + column] += up;
                }
            }
        }
    }

    /// The columns of a triangle on a level, in steps.
    fn columns(&self, patch: &Patch, y: i64) -> Range<usize> {
        let steps = STEPS as i64;
        let (mut from, mut to) = (0, self.width as i64 - 1);
        for k in 0..3 {
            let (a, b) = (patch.corners[k], patch.corners[(k + 1) % 3]);
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            // Inside where dx (y - ay) - dy (x - ax) is above 0, or 0 on a top or left edge.
            let is_top_left = dy < 0 || (dy == 0 && dx > 0);
            let constant = dx * (y - a[1]) + dy * a[0] - i64::from(!is_top_left);
            // At column c, x is c steps and a half.
            let at = constant - dy * (steps / 2);
            let slope = dy * steps;
            match slope.signum() {
                0 if at < 0 => return 0..0,
                0 => {}
                1 => to = to.min(at.div_euclid(slope)),
                _ => from = from.max(-at.div_euclid(-slope)),
            }
        }
        if from > to {
            return 0..0;
        }
        from as usize..to as usize + 1
    }
}
