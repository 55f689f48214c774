//! Numbers of two doubles, whose sum carries 106 bits: the middle step of exact predicates.
//!
//! Sums and products lose at most a few units of 2^-104 of their result or of their terms (Dekker
//! 1971; Joldes, Muller and Popescu 2017).

use std::ops::{Add, Mul, Sub};

/// An unevaluated sum, the larger part first.
#[derive(Debug, Clone, Copy)]
struct Double(f64, f64);

/// `a + b` and what rounding lost of it.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> Double {
    let sum = a + b;
    let of_b = sum - a;
    Double(sum, (a - (sum - of_b)) + (b - of_b))
}

/// `a - b`, exactly.
#[inline(always)]
fn difference(a: f64, b: f64) -> Double {
    two_sum(a, -b)
}

/// `a * b` and what rounding lost of it.
#[inline(always)]
fn two_product(a: f64, b: f64) -> Double {
    // Halves of 26 bits (Veltkamp): a fused multiply would be a call where the processor has none.
    const SPLITTER: f64 = 134_217_729.0;
    let halves = |x: f64| {
        let wide = SPLITTER * x;
        let high = wide - (wide - x);
        (high, x - high)
    };
    let product = a * b;
    let ((ah, al), (bh, bl)) = (halves(a), halves(b));
    let lost = ((ah * bh - product) + ah * bl + al * bh) + al * bl;
    Double(product, lost)
}

impl Add for Double {
    type Output = Double;
    #[inline(always)]
    fn add(self, other: Double) -> Double {
        let Double(high, low) = two_sum(self.0, other.0);
        let Double(of_low, lost) = two_sum(self.1, other.1);
        let Double(high, low) = two_sum(high, low + of_low);
        two_sum(high, low + lost)
    }
}

impl Sub for Double {
    type Output = Double;
    #[inline(always)]
    fn sub(self, other: Double) -> Double {
        self + Double(-other.0, -other.1)
    }
}

impl Mul for Double {
    type Output = Double;
    #[inline(always)]
    fn mul(self, other: Double) -> Double {
        let Double(high, low) = two_product(self.0, other.0);
        two_sum(high, low + (self.0 * other.1 + self.1 * other.0))
    }
}

/// The determinant of four rows `q - p` with a fourth column `|q - p|^2 - (w_q - w_p)`, for points
/// and weights `[x, y, z, w]`, to 2^-96 of the sum of its products.
pub(super) fn power3d(points: [[f64; 4]; 4], p: [f64; 4]) -> f64 {
    let row = |q: [f64; 4]| {
        let [x, y, z, w] = [0, 1, 2, 3].map(|k| difference(q[k], p[k]));
        [x, y, z, x * x + y * y + z * z - w]
    };
    let [a, b, c, d] = points.map(row);
    let minor = |a: [Double; 4], b: [Double; 4]| a[0] * b[1] - a[1] * b[0];
    let (ab, bc, cd) = (minor(a, b), minor(b, c), minor(c, d));
    let (da, ac, bd) = (minor(d, a), minor(a, c), minor(b, d));
    let abc = a[2] * bc - b[2] * ac + c[2] * ab;
    let bcd = b[2] * cd - c[2] * bd + d[2] * bc;
    let cda = c[2] * da + d[2] * ac + a[2] * cd;
    let dab = d[2] * ab + a[2] * bd + b[2] * da;
    ((d[3] * abc - c[3] * dab) + (b[3] * cda - a[3] * bcd)).0
}
