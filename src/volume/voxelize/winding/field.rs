//! The field of border edges far away, to second order in what is swept.
//!
//! What an edge sweeps as the eye moves is the line integral of the magnetic field of a wire along
//! it (Biot and Savart). Far from the edge the field hardly bends: its value and first derivatives
//! at one point stand for it in a whole box, and those of many edges add up to twelve numbers, which
//! can be moved to another point as the local expansions of Greengard and Rokhlin (1987) are.

use super::edge::Edge;
use crate::numeric::vector::{Vec3, add, cross, dot, length, scale, sub};
use std::f64::consts::PI;

/// Rounding of a field, relative to that of its largest part, generously.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// The summed field of edges near a point, and how wrong it may be.
#[derive(Debug, Clone, Copy, Default)]
pub struct Field {
    value: Vec3,
    /// How `value[i]` changes along `j`.
    derivative: [Vec3; 3],
    /// Bounds on the errors of these two, and on the second derivative of the true field.
    error: [f64; 3],
}

/// Bounds on an edge's field from points that never come nearer to it than some distance.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// The field itself.
    pub field: f64,
    /// Errors as in [`Field`] when the field is taken at one point.
    error: [f64; 3],
}

impl Bounds {
    /// Bounds on an edge from points `distance` or more away from it, one of which is `p`.
    ///
    /// The n-th derivative of the field of a piece of wire is at most (n + 1)! over the (n + 2)-th
    /// power of its distance; it is integrated along the edge, or along the whole line.
    pub fn new(edge: &Edge, p: Vec3, distance: f64) -> Self {
        let span = length(sub(edge.b, edge.a));
        let reach = length(sub(edge.a, p)) + length(sub(edge.b, p));
        let near = 1.0 / distance;
        let times = edge.times.abs() / (4.0 * PI);
        let field = times * near * (span * near).min(2.0);
        let rounding = times * ROUNDING * reach * near * near;
        let second = 6.0 * times * near * near * near * (span * near).min(0.5 * PI);
        Bounds {
            field,
            error: [rounding, rounding * near, second],
        }
    }

    /// The error of the field in what is swept on a straight way of this length.
    pub fn error(&self, way: f64) -> f64 {
        error(self.error, way)
    }
}

/// What errors of a field, its derivative, and its second derivative add up to on a straight way.
fn error(of: [f64; 3], way: f64) -> f64 {
    way * (of[0] + way * (of[1] / 2.0 + way * of[2] / 6.0))
}

impl Field {
    /// Adds the field of one edge at `p`, with its bounds there.
    pub fn add(&mut self, edge: &Edge, p: Vec3, bounds: &Bounds) {
        self.add_exact(edge, p);
        for (sum, error) in self.error.iter_mut().zip(bounds.error) {
            *sum += error;
        }
    }

    /// Adds the field of one edge at `p`, whose errors the caller counts.
    pub fn add_exact(&mut self, edge: &Edge, p: Vec3) {
        let (u, v) = (sub(edge.a, p), sub(edge.b, p));
        let (lu, lv) = (length(u), length(v));
        let normal = cross(u, sub(edge.b, edge.a));
        let cosine = dot(u, v);
        // lu lv + u . v, without cancellation where the edge is long and passes near.
        let opening = if cosine < 0.0 {
            dot(normal, normal) / (lu * lv - cosine)
        } else {
            lu * lv + cosine
        };
        let strength = (1.0 / lu + 1.0 / lv) / opening;
        let (du, dv) = (scale(u, 1.0 / lu), scale(v, 1.0 / lv));
        // The change of the strength as the eye moves.
        let ends = add(scale(du, 1.0 / (lu * lu)), scale(dv, 1.0 / (lv * lv)));
        let wider = add(add(scale(du, lv), scale(dv, lu)), add(u, v));
        let change = scale(add(ends, scale(wider, strength)), 1.0 / opening);
        let unit = -edge.times / (4.0 * PI);
        let [x, y, z] = scale(sub(u, v), strength);
        let turned = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]];
        for i in 0..3 {
            self.value[i] += unit * strength * normal[i];
            for j in 0..3 {
                self.derivative[i][j] += unit * (turned[i][j] + normal[i] * change[j]);
            }
        }
    }

    /// What is swept on the straight way by `way`.
    pub fn swept(&self, way: Vec3) -> f64 {
        dot(self.value, way) + 0.5 * dot(self.bent(way), way)
    }

    /// The error of [`Field::swept`] on ways of this length.
    pub fn error(&self, way: f64) -> f64 {
        error(self.error, way)
    }

    /// A bound on [`Field::swept`] on ways at most this long along each axis, errors not counted.
    pub fn range(&self, way: Vec3) -> f64 {
        let mut bound = 0.0;
        for i in 0..3 {
            bound += self.value[i].abs() * way[i];
            bound += 0.5 * self.derivative[i][i].abs() * way[i] * way[i];
            for j in 0..i {
                let both = self.derivative[i][j] + self.derivative[j][i];
                bound += 0.5 * both.abs() * way[i] * way[j];
            }
        }
        bound
    }

    /// The field as it is after a straight way.
    pub fn moved(&self, way: Vec3) -> Self {
        let l = length(way);
        let [e0, e1, e2] = self.error;
        Field {
            value: add(self.value, self.bent(way)),
            derivative: self.derivative,
            error: [e0 + l * (e1 + l * e2 / 2.0), e1 + l * e2, e2],
        }
    }

    fn bent(&self, way: Vec3) -> Vec3 {
        self.derivative.map(|row| dot(row, way))
    }
}
