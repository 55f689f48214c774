//! Cameras and the projection of triangles onto a raster.
//!
//! Three spaces follow each other. *World* is the file's own. *View* is the camera's: the target is
//! its origin, x points right, y up, z towards the viewer, and lengths are in the camera's unit, so
//! that models of 1e-30 and 1e30 and models far from the origin look alike to all that follows.
//! *Screen* is in pixels, x right and y down from the top left corner, with the centre of the first
//! pixel at (0.5, 0.5), and a depth along the viewing axis in the camera's unit.

pub mod raster;

use crate::numeric::vector::{Vec3, cross, dot, length, normalize, scale, sub};
use crate::spatial::aabb::Aabb;

/// The direction from a model to the viewer of a three-quarter view: right of the front, above,
/// for models whose up is +y.
pub const THREE_QUARTER: Vec3 = [0.55, 0.42, 1.0];

/// White around a framed model, as a share of the picture.
const MARGIN: f64 = 0.04;

/// The eye stands this far from the target of a framing view, in units (the radius of the model is 1).
const DISTANCE: f64 = 8.0;

/// What is nearer to the eye than this share of its distance to the target is cut off.
const NEAR: f64 = 1e-4;

/// How a camera projects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// Parallel rays; the picture is this high, in the camera's unit.
    Orthographic {
        /// Height of what is seen.
        height: f64,
    },
    /// Rays through the eye.
    Perspective {
        /// Angle from the bottom of the picture to its top, in radians.
        fov_y: f64,
    },
}

/// A place to look from, a place to look at and a lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The point in the middle of the picture, in the world.
    pub target: Vec3,
    /// The length in the world that is 1 in view space.
    pub unit: f64,
    /// Unit vectors in the world: right, up, towards the viewer.
    pub axes: [Vec3; 3],
    /// From the target to the eye, in units.
    pub distance: f64,
    /// How it projects.
    pub lens: Lens,
}

/// Pixels of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Size {
    /// Width over height.
    pub fn aspect(self) -> f64 {
        self.width as f64 / self.height.max(1) as f64
    }
}

/// Right, up and back of a viewer at `direction` from the target. A direction of 0 is along z; an
/// up along the direction gives way to the coordinate axis furthest from it.
fn axes(direction: Vec3, up: Vec3) -> [Vec3; 3] {
    let back = normalize(direction);
    let back = if length(back) > 0.5 {
        back
    } else {
        [0.0, 0.0, 1.0]
    };
    let mut right = cross(normalize(up), back);
    if length(right) < 1e-6 {
        let least = (0..3).fold(0, |l, a| if back[a].abs() < back[l].abs() { a } else { l });
        let mut other = [0.0; 3];
        other[least] = 1.0;
        right = cross(other, back);
    }
    let right = normalize(right);
    [right, cross(back, right), back]
}

impl Camera {
    /// A perspective camera at `eye` that looks at `target`; its unit is the distance of the two.
    ///
    /// `fov_y` is in radians and held between 1e-3 and 3.1. An eye on the target looks along -z.
    pub fn look_at(eye: Vec3, target: Vec3, up: Vec3, fov_y: f64) -> Self {
        let to_eye = sub(eye, target);
        let distance = length(to_eye);
        Camera {
            target,
            unit: if distance > 0.0 { distance } else { 1.0 },
            axes: axes(to_eye, up),
            distance: 1.0,
            lens: Lens::Perspective {
                fov_y: fov_y.clamp(1e-3, 3.1),
            },
        }
    }

    /// An orthographic camera that has all of a box in a picture of the given aspect (width over
    /// height), seen from `direction`.
    ///
    /// The unit is half the diagonal of the box; for a box of one point, or none, it is 1.
    pub fn framing(bounds: &Aabb, direction: Vec3, up: Vec3, aspect: f64) -> Self {
        let bounds = if bounds.is_empty() {
            Aabb {
                lo: [-0.5; 3],
                hi: [0.5; 3],
            }
        } else {
            *bounds
        };
        // Halves first: the extent itself may overflow.
        let half: Vec3 = std::array::from_fn(|a| bounds.hi[a] * 0.5 - bounds.lo[a] * 0.5);
        let radius = length(half).min(f64::MAX);
        let camera = Camera {
            target: bounds.centre(),
            unit: if radius > 0.0 { radius } else { 1.0 },
            axes: axes(direction, up),
            distance: DISTANCE,
            lens: Lens::Orthographic { height: 2.0 },
        };
        let corners: [Vec3; 8] = std::array::from_fn(|c| {
            std::array::from_fn(|a| {
                if c >> a & 1 == 1 {
                    bounds.hi[a]
                } else {
                    bounds.lo[a]
                }
            })
        });
        camera.fitted(camera.seen(&corners), aspect)
    }

    /// The box around points in view space.
    pub fn seen(&self, points: &[Vec3]) -> Aabb {
        use rayon::prelude::*;
        points
            .par_chunks(1 << 14)
            .map(|chunk| {
                chunk
                    .iter()
                    .fold(Aabb::EMPTY, |seen, p| seen.with(self.to_view(*p)))
            })
            .reduce(|| Aabb::EMPTY, Aabb::union)
    }

    /// The orthographic camera of the same direction and unit that frames what lies in a box of
    /// view space, in a picture of the given aspect with a small margin.
    pub fn fitted(&self, seen: Aabb, aspect: f64) -> Self {
        if seen.is_empty() {
            return *self;
        }
        let middle = seen.centre();
        let mut target = self.target;
        for (axis, shift) in self.axes.iter().zip(middle) {
            for a in 0..3 {
                target[a] += axis[a] * (shift * self.unit);
            }
        }
        let extent = seen.extent();
        let height = extent[1].max(extent[0] / aspect.max(1e-6)).max(1e-3);
        Camera {
            target,
            lens: Lens::Orthographic {
                height: height / (1.0 - 2.0 * MARGIN),
            },
            ..*self
        }
    }

    /// A point of the world in view space.
    #[inline]
    pub fn to_view(&self, p: Vec3) -> Vec3 {
        let d = sub(p, self.target);
        let d = [d[0] / self.unit, d[1] / self.unit, d[2] / self.unit];
        self.axes.map(|axis| dot(axis, d))
    }

    /// A direction of the world in view space, not made longer or shorter.
    #[inline]
    pub fn turn(&self, direction: Vec3) -> Vec3 {
        self.axes.map(|axis| dot(axis, direction))
    }

    /// A direction of view space in the world.
    pub fn turn_back(&self, direction: Vec3) -> Vec3 {
        let [r, u, b] = self.axes;
        std::array::from_fn(|a| r[a] * direction[0] + u[a] * direction[1] + b[a] * direction[2])
    }

    /// The depth below which nothing is drawn; none for parallel rays.
    pub fn near(&self) -> Option<f64> {
        match self.lens {
            Lens::Orthographic { .. } => None,
            Lens::Perspective { .. } => Some(NEAR * self.distance),
        }
    }

    /// Pixels per unit across the viewing axis, at a depth.
    #[inline]
    pub fn magnification(&self, size: Size, depth: f64) -> f64 {
        match self.lens {
            Lens::Orthographic { height } => size.height as f64 / height,
            Lens::Perspective { fov_y } => size.height as f64 / (2.0 * (fov_y * 0.5).tan() * depth),
        }
    }

    /// Length of a pixel in the world, at the depth of the target.
    pub fn pixel(&self, size: Size) -> f64 {
        self.unit / self.magnification(size, self.distance)
    }

    /// A point of view space on the screen: x, y in pixels and depth in units.
    ///
    /// A perspective camera gives a point at or behind its eye a place without meaning.
    #[inline]
    pub fn to_screen(&self, p: Vec3, size: Size) -> Vec3 {
        let depth = self.distance - p[2];
        let zoom = self.magnification(size, depth);
        [
            size.width as f64 * 0.5 + p[0] * zoom,
            size.height as f64 * 0.5 - p[1] * zoom,
            depth,
        ]
    }

    /// The point of view space at a place and depth on the screen.
    #[inline]
    pub fn from_screen(&self, x: f64, y: f64, depth: f64, size: Size) -> Vec3 {
        let zoom = self.magnification(size, depth);
        [
            (x - size.width as f64 * 0.5) / zoom,
            (size.height as f64 * 0.5 - y) / zoom,
            self.distance - depth,
        ]
    }

    /// The unit vector from a point of view space towards the viewer.
    #[inline]
    pub fn to_viewer(&self, p: Vec3) -> Vec3 {
        match self.lens {
            Lens::Orthographic { .. } => [0.0, 0.0, 1.0],
            Lens::Perspective { .. } => normalize(sub([0.0, 0.0, self.distance], p)),
        }
    }

    /// The view space of this camera seen from another's: a turn (rows) and a shift, in this one's
    /// unit. Both cameras have one unit.
    pub fn from_other(&self, other: &Camera) -> ([Vec3; 3], Vec3) {
        let turn = self.axes.map(|own| other.axes.map(|axis| dot(own, axis)));
        (turn, self.to_view(other.target))
    }

    /// The same camera looking from elsewhere at the same target, with the same unit and parallel rays.
    pub fn from_direction(&self, direction: Vec3, up: Vec3, height: f64) -> Self {
        Camera {
            axes: axes(direction, up),
            lens: Lens::Orthographic { height },
            ..*self
        }
    }

    /// The eye in the world; a stand-in far away where rays are parallel.
    pub fn eye(&self) -> Vec3 {
        let step = scale(self.axes[2], self.distance * self.unit);
        crate::numeric::vector::add(self.target, step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size {
        width: 320,
        height: 200,
    };

    fn unit_box(offset: f64, size: f64) -> Aabb {
        Aabb {
            lo: [offset - size; 3],
            hi: [offset + size; 3],
        }
    }

    #[test]
    fn axes_are_right_handed_whatever_is_asked() {
        for (direction, up) in [
            (THREE_QUARTER, [0.0, 1.0, 0.0]),
            ([0.0, 1.0, 0.0], [0.0, 1.0, 0.0]),
            ([0.0; 3], [0.0; 3]),
            ([1e-200, 0.0, 0.0], [0.0, 0.0, 1e200]),
        ] {
            let [r, u, b] = axes(direction, up);
            assert!((dot(cross(r, u), b) - 1.0).abs() < 1e-12, "{direction:?}");
            assert!((length(r) - 1.0).abs() < 1e-12 && dot(r, u).abs() < 1e-12);
        }
    }

    #[test]
    fn a_framed_box_fills_the_picture_at_any_size_and_place() {
        for (offset, size) in [
            (0.0, 1.0),
            (0.0, 1e-30),
            (0.0, 1e30),
            (1e9, 1.0),
            (0.0, 1e300),
        ] {
            let bounds = unit_box(offset, size);
            let camera = Camera::framing(&bounds, THREE_QUARTER, [0.0, 1.0, 0.0], SIZE.aspect());
            let mut seen = Aabb::EMPTY;
            for corner in 0..8 {
                let p = std::array::from_fn(|a| [bounds.lo, bounds.hi][corner >> a & 1][a]);
                seen = seen.with(camera.to_screen(camera.to_view(p), SIZE));
            }
            assert!(seen.lo[1] > 4.0 && seen.lo[1] < 12.0, "{size}: {seen:?}");
            assert!(seen.hi[1] > 188.0 && seen.hi[1] < 196.0, "{size}: {seen:?}");
            assert!(seen.lo[0] > 0.0 && seen.hi[0] < 320.0, "{size}: {seen:?}");
        }
    }

    #[test]
    fn a_point_or_nothing_is_framed_too() {
        for bounds in [Aabb::EMPTY, unit_box(7.0, 0.0)] {
            let camera = Camera::framing(&bounds, THREE_QUARTER, [0.0, 1.0, 0.0], 1.0);
            let p = camera.to_screen(camera.to_view(camera.target), SIZE);
            assert!((p[0] - 160.0).abs() < 1e-9 && (p[1] - 100.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_screen_can_be_undone() {
        let look = Camera::look_at([3.0, 2.0, 5.0], [0.5, 0.1, 0.0], [0.0, 0.0, 1.0], 0.6);
        let frame = Camera::framing(&unit_box(2.0, 3.0), THREE_QUARTER, [0.0, 1.0, 0.0], 1.6);
        for camera in [look, frame] {
            let p = camera.to_view([0.7, -0.2, 0.4]);
            let s = camera.to_screen(p, SIZE);
            let q = camera.from_screen(s[0], s[1], s[2], SIZE);
            assert!(length(sub(p, q)) < 1e-12);
        }
        let eye = look.eye();
        assert!(length(sub(eye, [3.0, 2.0, 5.0])) < 1e-12);
        let middle = look.to_screen(look.to_view(look.target), SIZE);
        assert!((middle[2] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_pixel_has_the_stated_length() {
        let camera = Camera::framing(&unit_box(0.0, 2e-5), THREE_QUARTER, [0.0, 1.0, 0.0], 1.6);
        let moved = std::array::from_fn(|a| camera.target[a] + camera.axes[0][a] * 1e-6);
        let screen = camera.to_screen(camera.to_view(moved), SIZE);
        let pixels = screen[0] - 160.0;
        assert!((pixels * camera.pixel(SIZE) - 1e-6).abs() < 1e-15);
    }
}
