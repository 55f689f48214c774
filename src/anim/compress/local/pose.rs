//! Moving frames of reference, each fixed to a triangle of the mesh.

use crate::numeric::vector::{Vec3, add, cross, dot, length, scale, sub};

/// An origin and three orthonormal axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The origin.
    pub origin: Vec3,
    /// The directions of x, y and z.
    pub axes: [Vec3; 3],
}

impl Pose {
    /// The axes of the world about its origin.
    pub const WORLD: Pose = Pose {
        origin: [0.0; 3],
        axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };

    /// The pose of a triangle: the origin in the middle of its first edge, x along it, y in its plane.
    /// None where its corners lie on one line.
    pub fn of(corners: [Vec3; 3]) -> Option<Pose> {
        let [a, b, c] = corners;
        let origin = scale(add(a, b), 0.5);
        let along = sub(b, a);
        let long = length(along);
        if long == 0.0 {
            return None;
        }
        let x = scale(along, 1.0 / long);
        let g = sub(c, origin);
        let aside = sub(g, scale(x, dot(g, x)));
        let wide = length(aside);
        if wide <= 1e-12 * (long + length(g)) {
            return None;
        }
        // Once more, so that y is at right angles to x even where the triangle is thin.
        let y = scale(aside, 1.0 / wide);
        let y = sub(y, scale(x, dot(y, x)));
        let y = scale(y, 1.0 / length(y));
        let axes = [x, y, cross(x, y)];
        Some(Pose { origin, axes })
    }

    /// The poses of a triangle over the frames; where its corners lie on one line, it is as the frame
    /// before turned it.
    pub fn follow(corners: impl Iterator<Item = [Vec3; 3]>) -> Vec<Pose> {
        let mut axes = Pose::WORLD.axes;
        corners
            .map(|corners| {
                let origin = scale(add(corners[0], corners[1]), 0.5);
                let pose = Pose::of(corners).unwrap_or(Pose { origin, axes });
                axes = pose.axes;
                pose
            })
            .collect()
    }

    /// A point in these coordinates.
    #[inline]
    pub fn local(&self, p: Vec3) -> Vec3 {
        let g = sub(p, self.origin);
        self.axes.map(|axis| dot(axis, g))
    }

    /// The point of these coordinates.
    #[inline]
    pub fn world(&self, q: Vec3) -> Vec3 {
        let [x, y, z] = self.axes;
        std::array::from_fn(|i| x[i] * q[0] + y[i] * q[1] + z[i] * q[2] + self.origin[i])
    }
}

/// The smallest height of a triangle: how far it is from having its corners on one line.
pub fn height(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let (ab, ac, bc) = (sub(b, a), sub(c, a), sub(c, b));
    let longest = length(ab).max(length(ac)).max(length(bc));
    if longest > 0.0 {
        length(cross(ab, ac)) / longest
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    fn point(rng: &mut Rng) -> Vec3 {
        std::array::from_fn(|_| rng.range(-3.0, 3.0))
    }

    #[test]
    fn there_and_back_is_the_same_point() {
        let mut rng = Rng::new(2, 0);
        for _ in 0..100 {
            let pose = Pose::of(std::array::from_fn(|_| point(&mut rng))).unwrap();
            for (i, a) in pose.axes.iter().enumerate() {
                for (j, b) in pose.axes.iter().enumerate() {
                    let wanted = f64::from(u8::from(i == j));
                    assert!((dot(*a, *b) - wanted).abs() < 1e-14);
                }
            }
            let p = point(&mut rng);
            let back = pose.world(pose.local(p));
            assert!(length(sub(p, back)) < 1e-14 * 10.0);
        }
    }

    #[test]
    fn a_triangle_that_collapses_keeps_its_turn() {
        let turned = [[0.0; 3], [0.0, 2.0, 0.0], [1.0, 1.0, 0.0]];
        let line = [[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
        let poses = Pose::follow([line, turned, line, [[1.0; 3]; 3]].into_iter());
        assert_eq!(poses[0].axes, Pose::WORLD.axes);
        assert_eq!(poses[1].axes[0], [0.0, 1.0, 0.0]);
        assert_eq!(poses[2].axes, poses[1].axes);
        assert_eq!(poses[3].origin, [1.0; 3]);
        assert_eq!(height(line), 0.0);
        assert!((height(turned) - 1.0).abs() < 1e-15);
    }
}
