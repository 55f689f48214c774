//! The motions under which inputs and results are looked at, with their inverses.

use crate::numeric::vector::{Vec3, add, dot, normalize, sub};
use crate::spatial::aabb::Aabb;

/// A turn, then a scaling by a power of two, then a shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Rows of the matrix of the turn.
    pub turn: [Vec3; 3],
    /// Exponent of the scaling.
    pub exponent: i32,
    /// The shift.
    pub shift: Vec3,
}

impl Motion {
    /// None at all.
    pub const NONE: Motion = Motion {
        turn: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        exponent: 0,
        shift: [0.0; 3],
    };

    /// A scaling by 2^`exponent`, which is from -1022 to 1023.
    pub fn scale(exponent: i32) -> Self {
        Motion {
            exponent,
            ..Motion::NONE
        }
    }

    /// A shift.
    pub fn shift(shift: Vec3) -> Self {
        Motion {
            shift,
            ..Motion::NONE
        }
    }

    /// A turn by 90 degrees about an axis of the coordinates (0, 1, 2), counter-clockwise: exact.
    pub fn quarter_turn(axis: usize) -> Self {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut turn = Motion::NONE.turn;
        turn[b] = [0.0; 3];
        turn[c] = [0.0; 3];
        turn[b][c] = -1.0;
        turn[c][b] = 1.0;
        Motion {
            turn,
            ..Motion::NONE
        }
    }

    /// A turn by `angle` (radians) about any axis, which need not have unit length (Rodrigues 1840).
    pub fn turn(axis: Vec3, angle: f64) -> Self {
        let u = normalize(axis);
        let (sin, cos) = angle.sin_cos();
        let turn = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let (next, last) = ((i + 1) % 3, (i + 2) % 3);
                let across = if i == j {
                    0.0
                } else if j == next {
                    -u[last]
                } else {
                    u[next]
                };
                let along = if i == j { cos } else { 0.0 };
                along + sin * across + (1.0 - cos) * u[i] * u[j]
            })
        });
        Motion {
            turn,
            ..Motion::NONE
        }
    }

    /// Where a point goes.
    pub fn apply(&self, p: Vec3) -> Vec3 {
        let turned = self.turned(p);
        let factor = 2f64.powi(self.exponent);
        add(turned.map(|c| c * factor), self.shift)
    }

    /// Where a point comes from.
    pub fn undo(&self, p: Vec3) -> Vec3 {
        let factor = 2f64.powi(-self.exponent);
        self.turned_back(sub(p, self.shift).map(|c| c * factor))
    }

    /// A direction, turned.
    pub fn turned(&self, v: Vec3) -> Vec3 {
        if self.turn == Motion::NONE.turn {
            return v;
        }
        self.turn.map(|row| dot(row, v))
    }

    /// A direction, turned back.
    fn turned_back(&self, v: Vec3) -> Vec3 {
        if self.turn == Motion::NONE.turn {
            return v;
        }
        std::array::from_fn(|j| (0..3).map(|i| self.turn[i][j] * v[i]).sum())
    }

    /// What becomes of a length.
    pub fn length(&self, length: f64) -> f64 {
        length * 2f64.powi(self.exponent)
    }

    /// What becomes of a point (three numbers) or of a box along the axes (six: its lower corner,
    /// then its upper). Errs for other counts, and where the box would not stand along the axes.
    pub fn place(&self, numbers: &[f64]) -> Result<Vec<f64>, String> {
        match *numbers {
            [x, y, z] => Ok(self.apply([x, y, z]).to_vec()),
            [x0, y0, z0, x1, y1, z1] => {
                let is_straight = self.turn.as_flattened().iter().all(|c| c.fract() == 0.0);
                if !is_straight {
                    return Err("a box along the axes cannot be turned".to_owned());
                }
                let corners = [[x0, y0, z0], [x1, y1, z1]].map(|p| self.apply(p));
                let moved = Aabb::around(&corners);
                Ok([moved.lo, moved.hi].concat())
            }
            _ => Err(format!("{} numbers are no place", numbers.len())),
        }
    }
}
