//! What is taken to the extremes: a mesh, the atoms of a molecule, an animation, or discs.

use super::motion::Motion;
use crate::anim::Clip;
use crate::mesh::Mesh;
use crate::numeric::vector::Vec3;
use crate::points::Splats;
use crate::protein::clearance::Ball;
use crate::spatial::aabb::Aabb;

/// What a command reads.
#[derive(Debug, Clone, PartialEq)]
pub enum Subject {
    /// Triangles, polylines, points.
    Mesh(Mesh),
    /// Atoms: points with radii, which are lengths.
    Atoms(Vec<Ball>),
    /// Frames of one mesh.
    Clip(Clip),
    /// Discs with fields of normals: points, directions and lengths.
    Splats(Splats),
}

impl Subject {
    /// The points that are moved: vertices, frame by frame where there are several, or centres of atoms.
    /// Cost: a copy of them.
    pub fn points(&self) -> Vec<Vec3> {
        match self {
            Subject::Mesh(mesh) => mesh.positions.clone(),
            Subject::Atoms(balls) => balls.iter().map(|ball| ball.centre).collect(),
            Subject::Clip(clip) => clip.positions.clone(),
            Subject::Splats(splats) => splats.splats.iter().map(|s| s.centre).collect(),
        }
    }

    /// The longest side of the box around its points, in its unit; 1 where it has none. Cost: linear.
    pub fn extent(&self) -> f64 {
        let bounds = match self {
            Subject::Mesh(mesh) => mesh.bounds(),
            Subject::Atoms(balls) => Aabb::around(balls.iter().map(|ball| &ball.centre)),
            Subject::Clip(clip) => clip.bounds(),
            Subject::Splats(splats) => splats.bounds(),
        };
        let sides = bounds.extent();
        let longest = sides[0].max(sides[1]).max(sides[2]);
        if longest > 0.0 { longest } else { 1.0 }
    }

    /// The same with its points changed, given the index of each. Cost: a copy.
    pub(super) fn with_points(&self, change: impl Fn(usize, Vec3) -> Vec3) -> Subject {
        let mut changed = self.clone();
        let each = |(index, p): (usize, &mut Vec3)| *p = change(index, *p);
        match &mut changed {
            Subject::Mesh(mesh) => mesh.positions.iter_mut().enumerate().for_each(each),
            Subject::Atoms(balls) => {
                let centres = balls.iter_mut().map(|ball| &mut ball.centre);
                centres.enumerate().for_each(each);
            }
            Subject::Clip(clip) => {
                clip.positions.iter_mut().enumerate().for_each(each);
                let first = clip.positions.iter();
                let here = clip.mesh.positions.iter_mut().zip(first);
                here.for_each(|(here, p)| *here = *p);
            }
            Subject::Splats(splats) => {
                let centres = splats.splats.iter_mut().map(|s| &mut s.centre);
                centres.enumerate().for_each(each);
            }
        }
        changed
    }

    /// The same moved: points, directions and lengths.
    pub(super) fn moved(&self, motion: &Motion) -> Subject {
        let mut changed = self.with_points(|_, p| motion.apply(p));
        match &mut changed {
            Subject::Mesh(mesh) | Subject::Clip(Clip { mesh, .. }) => {
                let normals = mesh.normals.iter_mut().flatten();
                normals.for_each(|n| *n = motion.turned(*n));
            }
            Subject::Atoms(balls) => {
                let radii = balls.iter_mut().map(|ball| &mut ball.radius);
                radii.for_each(|r| *r = motion.length(*r));
            }
            Subject::Splats(splats) => {
                for splat in &mut splats.splats {
                    for direction in [&mut splat.normal, &mut splat.tangent, &mut splat.field] {
                        *direction = motion.turned(*direction);
                    }
                    for length in [&mut splat.radius, &mut splat.error] {
                        *length = motion.length(*length);
                    }
                    // Per unit of length.
                    splat.slopes = splat.slopes.map(|slope| motion.length_back(slope));
                }
            }
        }
        changed
    }

    /// The same with the points and lengths that `moved` has, taken back.
    pub(super) fn taken_back(&self, moved: &Subject, motion: &Motion) -> Subject {
        match moved {
            Subject::Atoms(balls) => {
                let back = |ball: &Ball| Ball {
                    centre: motion.undo(ball.centre),
                    radius: motion.length_back(ball.radius),
                };
                Subject::Atoms(balls.iter().map(back).collect())
            }
            // What else a mesh or a clip has is as it was.
            Subject::Clip(clip) => self.with_points(|i, _| motion.undo(clip.positions[i])),
            Subject::Mesh(mesh) => self.with_points(|v, _| motion.undo(mesh.positions[v])),
            Subject::Splats(splats) => {
                self.with_points(|v, _| motion.undo(splats.splats[v].centre))
            }
        }
    }

    /// Whether all points and lengths are where they are in the other.
    pub(super) fn stands_as(&self, other: &Subject) -> bool {
        match (self, other) {
            (Subject::Mesh(a), Subject::Mesh(b)) => a.positions == b.positions,
            (Subject::Clip(a), Subject::Clip(b)) => a.positions == b.positions,
            (a, b) => a == b,
        }
    }

    /// Whether all points and lengths are finite.
    pub(super) fn is_finite(&self) -> bool {
        let finite = |points: &[Vec3]| points.as_flattened().iter().all(|c| c.is_finite());
        match self {
            Subject::Mesh(mesh) => finite(&mesh.positions),
            Subject::Clip(clip) => finite(&clip.positions),
            Subject::Splats(splats) => splats.splats.iter().all(|splat| {
                let [u, v] = splat.slopes;
                let numbers = [splat.radius, splat.error, u, v];
                splat.centre.iter().chain(&numbers).all(|c| c.is_finite())
            }),
            Subject::Atoms(balls) => balls
                .iter()
                .all(|ball| ball.radius.is_finite() && ball.centre.iter().all(|c| c.is_finite())),
        }
    }
}
