//! Eigenvalues of symmetric matrices of three rows.

use crate::numeric::vector::{Vec3, cross, dot, scale};

/// A symmetric matrix: xx, yy, zz, xy, xz, yz.
pub type Symmetric = [f64; 6];

/// Below this share of the largest eigenvalue the smallest is too near the next one for the closed form,
/// which loses half of the digits where two are equal.
const CLOSE: f64 = 1e-2;
/// Sweeps of rotations; each squares what is off the diagonal, so that six end any matrix.
const SWEEPS: usize = 12;

/// The eigenvalues, smallest first, and the unit eigenvector of the smallest.
///
/// The two larger ones are right to half of the digits where they are nearly equal.
/// The matrix is positive semidefinite, as one of second moments is. Which of the two directions the
/// vector has means nothing. Where all eigenvalues are 0 the vector is along z. Cost: one arc cosine
/// where the smallest eigenvalue stands apart, else a few dozen rotations. Source: the closed form is
/// that of Smith, "Eigenvalues of a symmetric 3 x 3 matrix", 1961; the rotations are Jacobi's, 1846.
pub fn smallest(m: &Symmetric) -> (Vec3, Vec3) {
    let largest = m.iter().fold(0.0f64, |all, v| all.max(v.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return ([0.0; 3], [0.0, 0.0, 1.0]);
    }
    let m = m.map(|v| v / largest);
    let (values, vector) = closed_form(&m).unwrap_or_else(|| jacobi(&m));
    (scale(values, largest), vector)
}

fn closed_form(m: &Symmetric) -> Option<(Vec3, Vec3)> {
    let [xx, yy, zz, xy, xz, yz] = *m;
    let mean = (xx + yy + zz) / 3.0;
    let (a, b, c) = (xx - mean, yy - mean, zz - mean);
    let spread = ((a * a + b * b + c * c) / 6.0 + (xy * xy + xz * xz + yz * yz) / 3.0).sqrt();
    let half = 0.5 * (a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz));
    let cosine = (half / (spread * spread * spread)).clamp(-1.0, 1.0);
    let angle = cosine.acos() / 3.0;
    let high = mean + 2.0 * spread * angle.cos();
    let low = mean + 2.0 * spread * (angle + std::f64::consts::TAU / 3.0).cos();
    let middle = 3.0 * mean - high - low;
    let gap = middle - low;
    // NaN where all are equal, which is not apart either.
    if gap.is_nan() || gap <= CLOSE * high {
        return None;
    }
    // The rows of what is left are across the vector: two of them span the plane.
    let rows = [[xx - low, xy, xz], [xy, yy - low, yz], [xz, yz, zz - low]];
    let crossed = [
        cross(rows[0], rows[1]),
        cross(rows[1], rows[2]),
        cross(rows[2], rows[0]),
    ];
    let squares = crossed.map(|v| dot(v, v));
    let best = (0..3).fold(
        0,
        |best, i| if squares[i] > squares[best] { i } else { best },
    );
    let vector = scale(crossed[best], 1.0 / squares[best].sqrt());
    Some(([low, middle, high], vector))
}

fn jacobi(m: &Symmetric) -> (Vec3, Vec3) {
    let mut a = [[m[0], m[3], m[4]], [m[3], m[1], m[5]], [m[4], m[5], m[2]]];
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].abs() <= f64::MIN_POSITIVE {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            for k in 0..3 {
                let (kp, kq) = (a[k][p], a[k][q]);
                a[k][p] = c * kp - s * kq;
                a[k][q] = s * kp + c * kq;
            }
            for k in 0..3 {
                let (pk, qk) = (a[p][k], a[q][k]);
                a[p][k] = c * pk - s * qk;
                a[q][k] = s * pk + c * qk;
            }
            for row in &mut v {
                let (p0, q0) = (row[p], row[q]);
                row[p] = c * p0 - s * q0;
                row[q] = s * p0 + c * q0;
            }
        }
    }
    let mut order = [0, 1, 2];
    // Of equal values the last axis comes first, so that a matrix of equals gives z.
    order.sort_by(|i, j| a[*i][*i].total_cmp(&a[*j][*j]).then(j.cmp(i)));
    let values = order.map(|i| a[i][i]);
    (values, std::array::from_fn(|row| v[row][order[0]]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::numeric::vector::{length, normalize, sub};

    /// The matrix with these eigenvalues and random vectors; the first vector too.
    fn made(values: Vec3, seed: u64) -> (Symmetric, Vec3) {
        let mut rng = Rng::new(seed, 0);
        let mut random = || std::array::from_fn(|_| rng.range(-1.0, 1.0));
        let first = normalize(random());
        let second = normalize(cross(first, random()));
        let third = cross(first, second);
        let vectors = [first, second, third];
        let entry =
            |i: usize, j: usize| (0..3).map(move |k| values[k] * vectors[k][i] * vectors[k][j]);
        let at = |i, j| entry(i, j).sum();
        let matrix = [at(0, 0), at(1, 1), at(2, 2), at(0, 1), at(0, 2), at(1, 2)];
        (matrix, first)
    }

    #[test]
    fn the_vector_is_as_exact_as_the_gap_allows() {
        for values in [
            [0.0, 1.0, 1.0],
            [0.0, 0.5, 1.0],
            [1e-12, 1e-6, 1.0],
            [0.0, 1e-10, 1.0],
            [0.3, 0.3 + 1e-9, 1.0],
            [0.9, 1.0, 1.0],
            [0.5, 0.505, 0.51],
        ] {
            for seed in 0..50 {
                let (matrix, first) = made(values, seed);
                for size in [1.0, 1e-200, 1e200] {
                    let (found, vector) = smallest(&matrix.map(|v| v * size));
                    let gap = values[1] - values[0];
                    let off = length(cross(vector, first));
                    assert!(off <= 1e-14 / gap, "{values:?} {off:e}");
                    assert!((length(vector) - 1.0).abs() < 1e-14);
                    let values = scale(values, size);
                    // Of two that are equal the closed form has half of the digits.
                    assert!((found[0] - values[0]).abs() <= 1e-13 * size, "{found:?}");
                    let error = length(sub(found, values));
                    assert!(error <= 1e-7 * size, "{values:?} {found:?}");
                }
            }
        }
    }

    #[test]
    fn equal_eigenvalues_give_some_unit_vector() {
        for m in [[0.0; 6], [2.0, 2.0, 2.0, 0.0, 0.0, 0.0]] {
            assert_eq!(smallest(&m).1, [0.0, 0.0, 1.0]);
        }
        let (matrix, _) = made([0.0, 0.0, 1.0], 3);
        let (values, vector) = smallest(&matrix);
        assert!(values[0].abs() < 1e-15 && values[1].abs() < 1e-15);
        assert!((length(vector) - 1.0).abs() < 1e-14);
    }
}
