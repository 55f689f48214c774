//! Rays voxel by voxel.

use super::{GridRay, Visits};

/// The slabs across one axis that a ray is in: one, or several where they overlap.
struct Walk {
    axis: usize,
    step: i64,
    count: i64,
    /// The slab that it has been in longest.
    first: i64,
    /// The slab that it has entered last.
    last: i64,
}

impl Walk {
    /// The slabs that a ray is in at parameter `t`, at which it is in the grid.
    fn at(ray: &GridRay, axis: usize, count: usize, t: f64) -> Walk {
        let step = i64::from(ray.sign(axis));
        let count = count as i64;
        let mut walk = Walk {
            axis,
            step,
            count,
            first: 0,
            last: 0,
        };
        let near = ray.at(t, axis).floor().clamp(0.0, (count - 1) as f64) as i64;
        let back = if step == 0 { 1 } else { step };
        // The place is only near the truth: the slabs themselves decide.
        let (mut first, mut last) = (near, near);
        while walk.is_in_grid(first) && walk.slab(ray, first)[1] < t {
            first += back;
        }
        while walk.is_in_grid(first - back) && walk.holds(ray, first - back, t, 1) {
            first -= back;
        }
        last = if back > 0 {
            last.max(first)
        } else {
            last.min(first)
        };
        while last != first && walk.slab(ray, last)[0] > t {
            last -= back;
        }
        while walk.is_in_grid(last + back) && walk.holds(ray, last + back, t, 0) {
            last += back;
        }
        walk.first = first;
        walk.last = last;
        walk
    }

    /// Whether a slab has not been left yet (`end` 1) or been entered (`end` 0) at `t`.
    fn holds(&self, ray: &GridRay, slab: i64, t: f64, end: usize) -> bool {
        let interval = self.slab(ray, slab);
        if end == 1 {
            interval[1] >= t
        } else {
            interval[0] <= t
        }
    }

    fn is_in_grid(&self, slab: i64) -> bool {
        (0..self.count).contains(&slab)
    }

    #[inline]
    fn slab(&self, ray: &GridRay, slab: i64) -> [f64; 2] {
        ray.slab(self.axis, slab as f64, (slab + 1) as f64)
    }

    /// The parameter at which the next slab is entered; infinite where there is none.
    #[inline]
    fn next(&self, ray: &GridRay) -> f64 {
        let next = self.last + self.step;
        if self.step == 0 || !self.is_in_grid(next) {
            return f64::INFINITY;
        }
        self.slab(ray, next)[0]
    }

    /// Forgets the slabs that are left before `t`.
    #[inline]
    fn leave(&mut self, ray: &GridRay, t: f64) {
        while self.step != 0 && self.first != self.last && self.slab(ray, self.first)[1] < t {
            self.first += self.step;
        }
    }

    fn range(&self) -> std::ops::RangeInclusive<usize> {
        let (a, b) = (self.first as usize, self.last as usize);
        a.min(b)..=a.max(b)
    }
}

/// Whether a ray hits a voxel for which `is_set` is true, by the rule of [`GridRay::hits`].
///
/// Walks from voxel to voxel: whenever the ray enters a slab across an axis, the voxels of that slab
/// in which it then is are looked at; they are several where it runs along a face or an edge. Cost:
/// one step per voxel crossed.
///
/// Amanatides and Woo, "A fast voxel traversal algorithm for ray tracing" (1987), with slabs that
/// overlap.
pub fn any_set(
    dims: [usize; 3],
    ray: &GridRay,
    is_set: impl Fn(usize, usize, usize) -> bool,
    visits: &mut Visits,
) -> bool {
    if dims.contains(&0) {
        return false;
    }
    let [start, end] = ray.cuboid([0.0; 3], dims.map(|d| d as f64));
    if start.is_nan() || end.is_nan() || start > end {
        return false;
    }
    let mut walks: [Walk; 3] = std::array::from_fn(|a| Walk::at(ray, a, dims[a], start));
    let mut looks = |walks: &[Walk; 3], fixed: Option<(usize, usize)>| {
        let range = |a: usize| match fixed {
            Some((axis, slab)) if axis == a => slab..=slab,
            _ => walks[a].range(),
        };
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    visits.voxels += 1;
                    if is_set(x, y, z) && ray.hits([x, y, z]) {
                        return true;
                    }
                }
            }
        }
        false
    };
    if looks(&walks, None) {
        return true;
    }
    loop {
        let next = [0, 1, 2].map(|a| walks[a].next(ray));
        let mut axis = 0;
        for a in 1..3 {
            if next[a] < next[axis] {
                axis = a;
            }
        }
        let t = next[axis];
        if t > end {
            return false;
        }
        walks[axis].last += walks[axis].step;
        for walk in &mut walks {
            walk.leave(ray, t);
        }
        let slab = walks[axis].last as usize;
        if looks(&walks, Some((axis, slab))) {
            return true;
        }
    }
}
