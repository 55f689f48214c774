//! Where pictures are taken from, and the frame in which their rays are traced.

use crate::camera::{Camera, Lens, Size};
use crate::error::{Error, Fault, Result};
use crate::numeric::vector::{Vec3, add, cross, length, normalize, scale, sub};
use crate::spatial::aabb::Aabb;
use crate::spatial::local::CornerFrame;
use schemars::JsonSchema;
use serde::Serialize;

/// Most pixels along a side of a picture.
pub const MOST_PIXELS: u32 = 16_384;

/// Where a picture is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct View {
    /// Where the viewer is, in the file's unit.
    pub eye: [f64; 3],
    /// The point in the middle of the picture.
    pub target: [f64; 3],
    /// The direction that is up in the picture, and across the ground.
    pub up: [f64; 3],
    /// Angle from the bottom of the picture to its top, in degrees.
    pub fov_deg: f64,
}

/// What is said of places that coordinates of the model's size cannot reach.
pub(super) const TOO_FAR: &str = "is over 1e100 times the model's size away from it";

/// Lights and cameras may be this far from the model, in its own lengths.
const FARTHEST: f64 = 1e100;

impl View {
    fn wrong(&self, problem: &str) -> Error {
        let numbers = [self.eye, self.target, self.up].concat();
        let mut words: Vec<String> = numbers.iter().map(|v| format!("{v:?}")).collect();
        words.push(format!("{:?}", self.fov_deg));
        Error::parameter("camera", words.join(","), problem)
    }

    /// The camera in a frame; errs where it is too far away for its coordinates.
    pub(super) fn camera(&self, local: &CornerFrame) -> Result<Camera> {
        let (eye, target) = (local.to_local(self.eye), local.to_local(self.target));
        if !is_near(eye) || !is_near(target) {
            return Err(self.wrong(TOO_FAR));
        }
        let (up, fov) = (normalize(self.up), self.fov_deg.to_radians());
        Ok(Camera::look_at(eye, target, up, fov))
    }

    /// Errs where it has numbers that are not finite, or no direction.
    pub fn check(&self) -> Result<()> {
        let all = [self.eye, self.target, self.up].concat();
        let wrong = |problem: &str| Err(self.wrong(problem));
        if !all.iter().all(|v| v.is_finite()) || !self.fov_deg.is_finite() {
            return wrong("has a number that is not finite");
        }
        let back = sub(self.eye, self.target);
        if length(back) == 0.0 {
            return wrong("the eye is the target, so there is no direction to look in");
        }
        if !length(back).is_finite() {
            return wrong("the distance from the eye to the target overflows");
        }
        if length(self.up) == 0.0 {
            return wrong("up has no length");
        }
        if length(cross(normalize(self.up), normalize(back))) < 1e-6 {
            return wrong("up is parallel to the direction of view");
        }
        if !(0.1..=170.0).contains(&self.fov_deg) {
            return wrong("the angle of view is not from 0.1 to 170 degrees");
        }
        Ok(())
    }
}

/// Where a picture was taken from, in the file's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Shot {
    /// Where the viewer was.
    pub eye: [f64; 3],
    /// The point in the middle of the picture.
    pub target: [f64; 3],
    /// The direction that is up in the picture.
    pub up: [f64; 3],
    /// Angle from the bottom of the picture to its top, in degrees; null for parallel lines of sight.
    pub fov_deg: Option<f64>,
    /// Height of what is seen with parallel lines of sight; null for others.
    pub height: Option<f64>,
}

impl From<View> for Shot {
    fn from(view: View) -> Self {
        Shot {
            eye: view.eye,
            target: view.target,
            up: view.up,
            fov_deg: Some(view.fov_deg),
            height: None,
        }
    }
}

impl Shot {
    /// What a camera in a frame sees, in the file's unit.
    pub(super) fn of(camera: &Camera, local: &CornerFrame) -> Shot {
        let Camera {
            target,
            unit,
            axes,
            distance,
            lens,
        } = *camera;
        let (fov_deg, height) = match lens {
            Lens::Perspective { fov_y } => (Some(fov_y.to_degrees()), None),
            Lens::Orthographic { height } => (None, Some(local.length_from_local(height * unit))),
        };
        Shot {
            eye: local.from_local(add(target, scale(axes[2], distance * unit))),
            target: local.from_local(target),
            up: axes[1],
            fov_deg,
            height,
        }
    }
}

/// The frame of points in a box, each with something this long around it; errs where that overflows.
///
/// The margin moves no coordinate: where points are exact, so is the frame.
pub(super) fn frame(points: Aabb, margin: f64) -> Result<CornerFrame> {
    let longest = points.extent().into_iter().fold(0.0, f64::max) + 2.0 * margin;
    if !longest.is_finite() {
        return Err(Error::Geometry(Fault::whole(format!(
            "the model spans {:?} to {:?}: its extent overflows",
            points.lo, points.hi
        ))));
    }
    Ok(CornerFrame::with_margin(points, margin))
}

/// Whether products of local coordinates like these stay far from overflow.
pub(super) fn is_near(p: Vec3) -> bool {
    p.iter().all(|c| c.abs() < FARTHEST)
}

/// The line of sight through a place of the screen: where it starts, its direction, not of unit
/// length, and how many of it are cut off in front of the viewer.
pub(super) fn sight(camera: &Camera, x: f64, y: f64, size: Size) -> (Vec3, Vec3, f64) {
    let from = camera.from_screen(x, y, 0.0, size);
    let to = camera.from_screen(x, y, camera.distance, size);
    let world = |v: Vec3| scale(camera.turn_back(v), camera.unit);
    let near = match camera.lens {
        Lens::Orthographic { .. } => 0.0,
        Lens::Perspective { .. } => camera.near().unwrap_or(0.0) / camera.distance,
    };
    (add(camera.target, world(from)), world(sub(to, from)), near)
}

/// From the middle of a model to a lamp at the upper left of the viewer of a framing camera, one long.
pub(super) fn upper_left(framing: &Camera, up: Vec3) -> Vec3 {
    let right = normalize(cross(up, framing.axes[2]));
    let front = cross(right, up);
    normalize(add(up, add(scale(right, -0.5), scale(front, 0.3))))
}
