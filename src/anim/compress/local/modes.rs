//! The principal modes of a cluster: its singular vectors of most energy.
//!
//! They come from the matrix itself, not from its products, which would lose what is below 1e-8 of the
//! largest. Where only some of many are wanted, the span of the largest is found first, by random
//! combinations that the matrix sharpens (N. Halko, P.-G. Martinsson, J. Tropp, "Finding structure with
//! randomness", 2011, algorithms 4.4 and 5.1); the small matrix that is left goes through one-sided
//! Jacobi rotations (J. Demmel, K. Veselić, "Jacobi's method is more accurate than QR", 1992).

use crate::numeric::rng::Rng;
use nalgebra::DMatrix;

/// Random combinations beyond the modes wanted.
const MORE: usize = 8;
/// Times that the span is sharpened.
const SHARPENED: usize = 2;
/// Sweeps of rotations at most; fewer than ten are usual.
const SWEEPS: usize = 60;

/// A matrix whose rows are coordinates, each at all frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    /// Row by row.
    pub values: Vec<f64>,
    /// Frames: the length of a row.
    pub frames: usize,
}

impl Matrix {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.values.len() / self.frames
    }

    /// The sum of all squares.
    pub fn energy(&self) -> f64 {
        let rows = self.values.chunks_exact(self.frames);
        rows.map(|row| row.iter().map(|x| x * x).sum::<f64>()).sum()
    }

    /// The products of a column with every frame.
    pub fn onto(&self, column: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.frames];
        for (x, row) in column.iter().zip(self.values.chunks_exact(self.frames)) {
            add(&mut sums, *x, row);
        }
        sums
    }

    /// Takes the product of a column and a row off; returns the energy that is left.
    pub fn deflate(&mut self, column: &[f64], row: &[f64]) -> f64 {
        let rows = column.iter().zip(self.values.chunks_exact_mut(self.frames));
        rows.map(|(x, values)| {
            add(values, -*x, row);
            product(values, values)
        })
        .sum()
    }

    /// The product with a matrix of `width` columns, given row by row.
    fn times(&self, right: &[f64], width: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.rows() * width];
        let rows = self.values.chunks_exact(self.frames);
        for (out, row) in out.chunks_exact_mut(width).zip(rows) {
            combine(out, row, right);
        }
        out
    }

    /// The product of the transposed matrix with one of `width` columns, row by row.
    fn transposed_times(&self, right: &[f64], width: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.frames * width];
        let rows = self.values.chunks_exact(4 * self.frames);
        let rest = rows.remainder();
        for (four, right) in rows.zip(right.chunks_exact(4 * width)) {
            for (f, out) in out.chunks_exact_mut(width).enumerate() {
                let row: [f64; 4] = std::array::from_fn(|i| four[i * self.frames + f]);
                combine(out, &row, right);
            }
        }
        let from = right.len() - rest.len() / self.frames * width;
        let last = rest
            .chunks_exact(self.frames)
            .zip(right[from..].chunks_exact(width));
        for (row, right) in last {
            for (x, out) in row.iter().zip(out.chunks_exact_mut(width)) {
                add(out, *x, right);
            }
        }
        out
    }
}

/// `out + x * row`.
fn add(out: &mut [f64], x: f64, row: &[f64]) {
    for (out, y) in out.iter_mut().zip(row) {
        *out += x * y;
    }
}

/// `out` and the sum of rows, each times a number; four of them at a time.
fn combine(out: &mut [f64], numbers: &[f64], rows: &[f64]) {
    let width = out.len();
    let fours = numbers.chunks_exact(4);
    let rest = fours.remainder();
    for (x, rows) in fours.zip(rows.chunks_exact(4 * width)) {
        let (a, more) = rows.split_at(width);
        let (b, more) = more.split_at(width);
        let (c, d) = more.split_at(width);
        let terms = a.iter().zip(b).zip(c.iter().zip(d));
        for (out, ((a, b), (c, d))) in out.iter_mut().zip(terms) {
            *out += (x[0] * a + x[1] * b) + (x[2] * c + x[3] * d);
        }
    }
    let from = (numbers.len() - rest.len()) * width;
    for (x, row) in rest.iter().zip(rows[from..].chunks_exact(width)) {
        add(out, *x, row);
    }
}

/// The largest modes of a matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// Singular values, the largest first.
    pub sigmas: Vec<f64>,
    /// The unit vector of each, over the rows; its largest number is above zero.
    pub columns: Vec<Vec<f64>>,
    /// The energy that all of them leave.
    pub rest: f64,
    /// Whether there are no more.
    pub complete: bool,
}

impl Modes {
    /// The `most` largest modes; those of no energy are left out.
    ///
    /// Cost: `12 rows frames most`, or `rows frames min(rows, frames)` and some cubes of the smaller
    /// where nearly all are wanted.
    pub fn of(matrix: &Matrix, most: usize) -> Modes {
        let (rows, frames) = (matrix.rows(), matrix.frames);
        let side = rows.min(frames);
        let energy = matrix.energy();
        if side == 0 || energy == 0.0 {
            return Modes {
                sigmas: Vec::new(),
                columns: Vec::new(),
                rest: energy,
                complete: true,
            };
        }
        let few = 2 * (most + MORE) < side;
        let (vectors, values) = if few {
            // Orthonormal columns that span the largest modes; what they see of the matrix.
            let span = span(matrix, most + MORE);
            let width = most + MORE;
            let seen =
                DMatrix::from_row_slice(frames, width, &matrix.transposed_times(&span, width));
            let (inner, values) = left_of_transposed(seen);
            (turned(&span, &inner), values)
        } else if rows >= frames {
            // A = Q R, and the singular vectors of R from those of its transposed.
            let qr = DMatrix::from_row_slice(rows, frames, &matrix.values).qr();
            let (inner, values) = left_of_transposed(qr.r().transpose());
            (turned(qr.q().transpose().as_slice(), &inner), values)
        } else {
            let transposed = DMatrix::from_column_slice(frames, rows, &matrix.values);
            let (inner, values) = left_of_transposed(transposed);
            (inner.transpose().as_slice().to_vec(), values)
        };
        let width = values.len();
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| values[*b].total_cmp(&values[*a]).then(a.cmp(b)));
        order.truncate(most);
        order.retain(|i| values[*i] > 1e-15 * energy.sqrt());
        let column = |i: &usize| {
            let mut column: Vec<f64> = vectors.iter().skip(*i).step_by(width).copied().collect();
            let largest = column
                .iter()
                .copied()
                .max_by(|a, b| a.abs().total_cmp(&b.abs()));
            if largest.is_some_and(|largest| largest < 0.0) {
                column.iter_mut().for_each(|x| *x = -*x);
            }
            column
        };
        let mut made = Modes {
            sigmas: order.iter().map(|i| values[*i]).collect(),
            columns: order.iter().map(column).collect(),
            rest: 0.0,
            complete: order.len() < most || order.len() == side,
        };
        made.rest = made.left(matrix, energy);
        made
    }

    /// The energy that the modes leave.
    fn left(&self, matrix: &Matrix, energy: f64) -> f64 {
        let held: f64 = self.sigmas.iter().map(|s| s * s).sum();
        if energy - held > 1e-6 * energy {
            return energy - held;
        }
        // The difference has lost its digits.
        let mut left = matrix.clone();
        for column in &self.columns {
            let row = left.onto(column);
            left.deflate(column, &row);
        }
        left.energy()
    }
}

/// Orthonormal columns, row by row, whose span holds the largest modes.
fn span(matrix: &Matrix, width: usize) -> Vec<f64> {
    let mut rng = Rng::new(1, 0);
    let random: Vec<f64> = (0..matrix.frames * width)
        .map(|_| rng.range(-1.0, 1.0))
        .collect();
    let mut span = orthonormal(&matrix.times(&random, width), width);
    for _ in 0..SHARPENED {
        let back = orthonormal(&matrix.transposed_times(&span, width), width);
        span = orthonormal(&matrix.times(&back, width), width);
    }
    span
}

/// Orthonormal columns of the same span, all row by row.
fn orthonormal(columns: &[f64], width: usize) -> Vec<f64> {
    let q = DMatrix::from_row_slice(columns.len() / width, width, columns)
        .qr()
        .q();
    q.transpose().as_slice().to_vec()
}

/// The product of two matrices, the first and the result row by row.
fn turned(rows: &[f64], inner: &DMatrix<f64>) -> Vec<f64> {
    let width = inner.ncols();
    let inner = inner.transpose();
    let mut out = vec![0.0; rows.len()];
    for (out, row) in out.chunks_exact_mut(width).zip(rows.chunks_exact(width)) {
        combine(out, row, inner.as_slice());
    }
    out
}

/// The left singular vectors, as columns, of the transposed of a matrix, and the singular values: the
/// rotations that make its columns orthogonal.
fn left_of_transposed(matrix: DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let width = matrix.ncols();
    // Fewer rows do the same.
    let matrix = if matrix.nrows() > width {
        matrix.qr().r()
    } else {
        matrix
    };
    let height = matrix.nrows();
    let mut columns = matrix.as_slice().to_vec();
    let mut turns = DMatrix::<f64>::identity(width, width).as_slice().to_vec();
    for _ in 0..SWEEPS {
        let mut turned = false;
        for i in 0..width {
            for j in i + 1..width {
                turned |= rotate(&mut columns, &mut turns, height, width, i, j);
            }
        }
        if !turned {
            break;
        }
    }
    let values = columns
        .chunks_exact(height)
        .map(|c| product(c, c).sqrt())
        .collect();
    (DMatrix::from_vec(width, width, turns), values)
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a, b) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    for (a, b) in a.0.iter().zip(b.0) {
        for i in 0..4 {
            lanes[i] += a[i] * b[i];
        }
    }
    let rest: f64 = a.1.iter().zip(b.1).map(|(a, b)| a * b).sum();
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}

/// Makes two columns orthogonal; whether they were not.
fn rotate(
    columns: &mut [f64],
    turns: &mut [f64],
    height: usize,
    width: usize,
    i: usize,
    j: usize,
) -> bool {
    let (a, b) = pair(columns, height, i, j);
    let (aa, bb, ab) = (product(a, a), product(b, b), product(a, b));
    if !(ab.abs() > 1e-15 * (aa * bb).sqrt() && ab.abs() > 1e-300) {
        return false;
    }
    let zeta = (bb - aa) / (2.0 * ab);
    let tangent = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = cosine * tangent;
    let turn = |(a, b): (&mut [f64], &mut [f64])| {
        for (a, b) in a.iter_mut().zip(b) {
            (*a, *b) = (cosine * *a - sine * *b, sine * *a + cosine * *b);
        }
    };
    turn((a, b));
    turn(pair(turns, width, i, j));
    true
}

/// Columns `i < j`.
fn pair(columns: &mut [f64], height: usize, i: usize, j: usize) -> (&mut [f64], &mut [f64]) {
    let (low, high) = columns.split_at_mut(j * height);
    (&mut low[i * height..(i + 1) * height], &mut high[..height])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(rows: usize, frames: usize, decay: f64) -> Matrix {
        let mut rng = Rng::new(4, rows as u64);
        let rank = rows.min(frames);
        let factor = |n: usize, rng: &mut Rng| -> Vec<f64> {
            let x: Vec<f64> = (0..n * rank).map(|_| rng.range(-1.0, 1.0)).collect();
            orthonormal(&x, rank)
        };
        let (u, v) = (factor(rows, &mut rng), factor(frames, &mut rng));
        let value = |i: usize| {
            let (m, f) = (i / frames, i % frames);
            let term = |l: usize| u[m * rank + l] * v[f * rank + l] * decay.powi(l as i32);
            (0..rank).map(term).sum()
        };
        Matrix {
            values: (0..rows * frames).map(value).collect(),
            frames,
        }
    }

    fn check(matrix: &Matrix, most: usize, decay: f64, allowed: f64) {
        let modes = Modes::of(matrix, most);
        assert_eq!(
            modes.sigmas.len(),
            most.min(matrix.rows().min(matrix.frames))
        );
        for (l, sigma) in modes.sigmas.iter().enumerate() {
            let exact = decay.powi(l as i32);
            assert!(
                (sigma / exact - 1.0).abs() < allowed,
                "{l}: {sigma} for {exact}"
            );
            for k in 0..=l {
                let wanted = f64::from(u8::from(k == l));
                let product = product(&modes.columns[k], &modes.columns[l]);
                assert!((product - wanted).abs() < 1e-12, "{k} {l}: {product}");
            }
        }
        let mut left = matrix.clone();
        for column in &modes.columns {
            let row = left.onto(column);
            left.deflate(column, &row);
        }
        assert!((left.energy() - modes.rest).abs() <= 1e-6 * modes.rest + 1e-28);
    }

    #[test]
    fn small_matrices_have_all_their_modes_to_high_accuracy() {
        check(&matrix(30, 12, 0.3), 40, 0.3, 1e-8);
        check(&matrix(12, 30, 0.3), 40, 0.3, 1e-8);
        check(&matrix(1, 5, 0.3), 40, 0.3, 1e-12);
        check(&matrix(5, 1, 0.3), 40, 0.3, 1e-12);
    }

    #[test]
    fn large_matrices_have_their_largest_modes() {
        check(&matrix(150, 90, 0.7), 20, 0.7, 1e-3);
        check(&matrix(90, 150, 0.7), 20, 0.7, 1e-3);
    }

    #[test]
    fn nothing_has_no_modes() {
        let zero = Matrix {
            values: vec![0.0; 12],
            frames: 4,
        };
        assert_eq!(Modes::of(&zero, 5).sigmas.len(), 0);
        let none = Matrix {
            values: Vec::new(),
            frames: 4,
        };
        assert_eq!(Modes::of(&none, 5).rest, 0.0);
    }
}
