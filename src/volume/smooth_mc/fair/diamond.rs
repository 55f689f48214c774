//! The octahedra of all vertices that are as most of them are.

use wide::f32x4;

/// The octahedron of one reach, in the unit of the offsets.
pub(super) struct Diamond {
    pub(super) reach: f32,
    /// One over the metric.
    inverse: [f32; 3],
    /// One over the sum of the squares of that over each set of axes, by its bits.
    totals: [f32; 8],
}

impl Diamond {
    pub(super) fn new(metric: [f32; 3], reach: f32) -> Self {
        let inverse = metric.map(|m| 1.0 / m);
        let total = |set: usize| {
            let of = |a: usize| {
                if set >> a & 1 == 1 {
                    inverse[a] * inverse[a]
                } else {
                    0.0
                }
            };
            1.0 / (of(0) + of(1) + of(2))
        };
        Diamond {
            reach,
            inverse,
            totals: std::array::from_fn(total),
        }
    }

    /// The closest points of the octahedron to four points, given and returned by component; see
    /// [`super::Region::project`].
    #[inline]
    pub(super) fn closest(&self, points: [f32x4; 3]) -> [f32x4; 3] {
        let size = points.map(f32x4::abs);
        let inverse = self.inverse.map(f32x4::splat);
        let [x, y, z] = [0, 1, 2].map(|a| size[a] * inverse[a]);
        let (t, reach) = (self.totals.map(f32x4::splat), f32x4::splat(self.reach));
        let (yz, x_less) = (y + z, x - reach);
        // No lane is a number that is none: offsets are finite, and so is what they are made of.
        let singles = (x_less * t[1])
            .fast_max((y - reach) * t[2])
            .fast_max((z - reach) * t[4]);
        let pairs = ((x_less + y) * t[3])
            .fast_max((x_less + z) * t[5])
            .fast_max((yz - reach) * t[6]);
        // Nothing is above 0 within: no branch is needed, which could not be foretold.
        let most = singles.fast_max(pairs).fast_max((x_less + yz) * t[7]);
        let most = most.fast_max(f32x4::ZERO);
        std::array::from_fn(|a| {
            let left = (size[a] - inverse[a] * most).fast_max(f32x4::ZERO);
            left.copysign(points[a])
        })
    }
}
