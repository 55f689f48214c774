//! The motions under which inputs and results are looked at, with their inverses.

use crate::numeric::vector::{Vec3, add, dot, normalize, sub};
use crate::spatial::aabb::Aabb;
use crate::trade::Part;

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

    /// Which length becomes this one.
    pub fn length_back(&self, length: f64) -> f64 {
        length * 2f64.powi(-self.exponent)
    }

    /// What becomes of the numbers of an option. Errs where there are not as many as the parts take,
    /// one of them overflows, or a box would not stand along the axes.
    pub fn place(&self, parts: &[Part], numbers: &[f64]) -> Result<Vec<f64>, String> {
        self.each(parts, numbers, |part, n| match part {
            Part::Length => vec![self.length(n[0])],
            Part::Point => self.apply([n[0], n[1], n[2]]).to_vec(),
            Part::Direction => self.turned([n[0], n[1], n[2]]).to_vec(),
            Part::Box => boxed(n, |corner| self.apply(corner)),
            Part::Number => n.to_vec(),
        })
    }

    /// Where the numbers of an option come from: [`Motion::place`] undone.
    pub fn place_back(&self, parts: &[Part], numbers: &[f64]) -> Result<Vec<f64>, String> {
        self.each(parts, numbers, |part, n| match part {
            Part::Length => vec![self.length_back(n[0])],
            Part::Point => self.undo([n[0], n[1], n[2]]).to_vec(),
            Part::Direction => self.turned_back([n[0], n[1], n[2]]).to_vec(),
            Part::Box => boxed(n, |corner| self.undo(corner)),
            Part::Number => n.to_vec(),
        })
    }

    fn each(
        &self,
        parts: &[Part],
        numbers: &[f64],
        moved: impl Fn(Part, &[f64]) -> Vec<f64>,
    ) -> Result<Vec<f64>, String> {
        let wanted: usize = parts.iter().map(|part| part.numbers()).sum();
        if wanted != numbers.len() {
            return Err(format!(
                "{} numbers, where {wanted} are taken",
                numbers.len()
            ));
        }
        let is_straight = self.turn.as_flattened().iter().all(|c| c.fract() == 0.0);
        if parts.contains(&Part::Box) && !is_straight {
            return Err("a box along the axes cannot be turned".to_owned());
        }
        let mut rest = numbers;
        let mut found = Vec::with_capacity(numbers.len());
        for part in parts {
            let (own, others) = rest.split_at(part.numbers());
            found.extend(moved(*part, own));
            rest = others;
        }
        if found.iter().all(|n| n.is_finite()) {
            Ok(found)
        } else {
            Err("a number overflows".to_owned())
        }
    }
}

/// The box around the moved corners of another: six numbers.
fn boxed(numbers: &[f64], moved: impl Fn(Vec3) -> Vec3) -> Vec<f64> {
    let corners = [0, 3].map(|i| moved([numbers[i], numbers[i + 1], numbers[i + 2]]));
    let around = Aabb::around(&corners);
    [around.lo, around.hi].concat()
}
