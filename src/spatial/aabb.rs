//! Axis-aligned boxes.

use crate::numeric::vector::Vec3;

/// A closed box; empty when a lower corner exceeds the upper one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub lo: Vec3,
    /// Upper corner.
    pub hi: Vec3,
}

impl Aabb {
    /// The box of nothing.
    pub const EMPTY: Aabb = Aabb {
        lo: [f64::INFINITY; 3],
        hi: [f64::NEG_INFINITY; 3],
    };

    /// The smallest box around points; [`Aabb::EMPTY`] around none.
    pub fn around<'a>(points: impl IntoIterator<Item = &'a Vec3>) -> Self {
        points.into_iter().fold(Aabb::EMPTY, |b, p| b.with(*p))
    }

    /// The smallest box around this one and a point.
    #[inline]
    pub fn with(self, p: Vec3) -> Self {
        Aabb {
            lo: [
                self.lo[0].min(p[0]),
                self.lo[1].min(p[1]),
                self.lo[2].min(p[2]),
            ],
            hi: [
                self.hi[0].max(p[0]),
                self.hi[1].max(p[1]),
                self.hi[2].max(p[2]),
            ],
        }
    }

    /// The smallest box around two.
    #[inline]
    pub fn union(self, other: Aabb) -> Self {
        Aabb {
            lo: [
                self.lo[0].min(other.lo[0]),
                self.lo[1].min(other.lo[1]),
                self.lo[2].min(other.lo[2]),
            ],
            hi: [
                self.hi[0].max(other.hi[0]),
                self.hi[1].max(other.hi[1]),
                self.hi[2].max(other.hi[2]),
            ],
        }
    }

    /// Whether it holds no point.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|a| self.lo[a] > self.hi[a])
    }

    /// Side lengths; zeros when empty.
    pub fn extent(&self) -> Vec3 {
        if self.is_empty() {
            [0.0; 3]
        } else {
            std::array::from_fn(|a| self.hi[a] - self.lo[a])
        }
    }

    /// The middle; halves are added, so that it does not overflow.
    pub fn centre(&self) -> Vec3 {
        std::array::from_fn(|a| self.lo[a] * 0.5 + self.hi[a] * 0.5)
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        crate::numeric::vector::length(self.extent())
    }

    /// Square of the distance from a point to the box, 0 inside.
    #[inline]
    pub fn distance_squared(&self, p: Vec3) -> f64 {
        let gap = |a: usize| (self.lo[a] - p[a]).max(p[a] - self.hi[a]).max(0.0);
        gap(0) * gap(0) + gap(1) * gap(1) + gap(2) * gap(2)
    }

    /// Half the surface area.
    pub fn half_area(&self) -> f64 {
        let e = self.extent();
        e[0] * e[1] + e[1] * e[2] + e[2] * e[0]
    }
}
