//! Signs of determinants of coordinates, in whole numbers: never wrong, whatever the exponents.
//!
//! Finite floating-point numbers are whole multiples of one power of two, so a determinant of their
//! differences is a whole number times a power of two. Where the numbers are short, as on lattices, 128
//! bits hold it; else big integers do. This is what the filters of [`super::predicates`] fall back on.

use num_bigint::{BigInt, Sign};

/// What a determinant needs of whole numbers.
trait Whole: Sized + Default {
    fn plus(&self, other: &Self) -> Self;
    fn minus(&self, other: &Self) -> Self;
    fn times(&self, other: &Self) -> Self;
    fn sign(&self) -> i32;
    /// `mantissa * 2^shift`.
    fn shifted(mantissa: i64, shift: u32) -> Self;
}

impl Whole for i128 {
    #[inline]
    fn plus(&self, other: &Self) -> Self {
        self + other
    }
    #[inline]
    fn minus(&self, other: &Self) -> Self {
        self - other
    }
    #[inline]
    fn times(&self, other: &Self) -> Self {
        self * other
    }
    #[inline]
    fn sign(&self) -> i32 {
        self.signum() as i32
    }
    #[inline]
    fn shifted(mantissa: i64, shift: u32) -> Self {
        i128::from(mantissa) << shift
    }
}

impl Whole for BigInt {
    fn plus(&self, other: &Self) -> Self {
        self + other
    }
    fn minus(&self, other: &Self) -> Self {
        self - other
    }
    fn times(&self, other: &Self) -> Self {
        self * other
    }
    fn sign(&self) -> i32 {
        match BigInt::sign(self) {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }
    fn shifted(mantissa: i64, shift: u32) -> Self {
        BigInt::from(mantissa) << shift
    }
}

/// `value` as `mantissa * 2^exponent`, the mantissa odd; a zero has none.
fn parts(value: f64) -> Option<(i64, i32)> {
    if value == 0.0 {
        return None;
    }
    let bits = value.to_bits();
    let field = ((bits >> 52) & 0x7ff) as i32;
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let (mantissa, exponent) = match field {
        0 => (fraction, -1074),
        _ => (fraction | 1 << 52, field - 1075),
    };
    let zeros = mantissa.trailing_zeros();
    let odd = mantissa >> zeros;
    let signed = if value < 0.0 { -odd } else { odd };
    Some((signed, exponent + zeros as i32))
}

/// The smallest exponent of the values and, above it, the bits that the largest needs.
fn span(values: impl Iterator<Item = f64> + Clone) -> Option<(i32, u32)> {
    let parts = values.filter_map(parts);
    let low = parts.clone().map(|(_, exponent)| exponent).min()?;
    let bits = parts.map(|(m, e)| 64 - m.unsigned_abs().leading_zeros() + (e - low) as u32);
    Some((low, bits.max()?))
}

fn whole<T: Whole>(value: f64, unit: i32) -> T {
    parts(value).map_or_else(
        || T::shifted(0, 0),
        |(m, e)| T::shifted(m, (e - unit) as u32),
    )
}

/// The 2x2 determinant of columns `i` and `j` of two rows.
fn minor2<T: Whole>(a: &[T], b: &[T], i: usize, j: usize) -> T {
    a[i].times(&b[j]).minus(&a[j].times(&b[i]))
}

/// The determinant of the first three columns of three rows.
fn minor3<T: Whole>(a: &[T], b: &[T], c: &[T]) -> T {
    let from_a = a[0].times(&minor2(b, c, 1, 2));
    let from_b = b[0].times(&minor2(a, c, 1, 2));
    let from_c = c[0].times(&minor2(a, b, 1, 2));
    from_a.minus(&from_b).plus(&from_c)
}

/// Rows `q - p`, and room for a fourth column.
fn rows<T: Whole, const N: usize>(points: [[f64; 3]; N], p: [f64; 3], unit: i32) -> [[T; 4]; N] {
    let origin = p.map(|value| whole::<T>(value, unit));
    points.map(|point| {
        let from = |axis: usize| whole::<T>(point[axis], unit).minus(&origin[axis]);
        [from(0), from(1), from(2), T::default()]
    })
}

/// The sign of the determinant of the rows `a - p`, `b - p`, `c - p`.
pub(super) fn orient3d(points: [[f64; 3]; 3], p: [f64; 3]) -> i32 {
    let all = points.into_iter().flatten().chain(p);
    let Some((unit, bits)) = span(all) else {
        return 0;
    };
    fn sign<T: Whole>(points: [[f64; 3]; 3], p: [f64; 3], unit: i32) -> i32 {
        let [a, b, c] = rows::<T, 3>(points, p, unit);
        minor3(&a, &b, &c).sign()
    }
    // Differences have a bit more; six products of three of them fit 3 (bits + 1) + 3 bits.
    if 3 * (bits + 1) + 3 < 127 {
        sign::<i128>(points, p, unit)
    } else {
        sign::<BigInt>(points, p, unit)
    }
}

/// The sign of the determinant of four rows `q - p` with a fourth column `|q - p|^2 - (w_q - w_p)`,
/// for points and weights `[x, y, z, w]`.
pub(super) fn power3d(points: [[f64; 4]; 4], p: [f64; 4]) -> i32 {
    let places = points
        .into_iter()
        .chain([p])
        .flat_map(|[x, y, z, _]| [x, y, z]);
    let weights = points.into_iter().chain([p]).map(|q| q[3]);
    let (of_places, of_weights) = (span(places), span(weights));
    // Weights are counted in the square of the unit of coordinates.
    let low_weight = of_weights.map_or(i32::MAX, |(low, _)| low.div_euclid(2));
    let low_place = of_places.map_or(i32::MAX, |(low, _)| low);
    let unit = low_place.min(low_weight);
    let Some((low, bits)) = of_places else {
        return 0;
    };
    let bits = bits + (low - unit) as u32;
    let weight_bits = of_weights.map_or(0, |(low, bits)| bits + (low - 2 * unit) as u32);
    fn sign<T: Whole>(points: [[f64; 4]; 4], p: [f64; 4], unit: i32) -> i32 {
        let place = |[x, y, z, _]: [f64; 4]| [x, y, z];
        let mut rows = rows::<T, 4>(points.map(place), place(p), unit);
        let own: T = whole(p[3], 2 * unit);
        for (row, point) in rows.iter_mut().zip(points) {
            let square = row[0].times(&row[0]);
            let square = square
                .plus(&row[1].times(&row[1]))
                .plus(&row[2].times(&row[2]));
            row[3] = square.minus(&whole::<T>(point[3], 2 * unit).minus(&own));
        }
        let [a, b, c, d] = &rows;
        let from_d = d[3].times(&minor3(a, b, c));
        let from_c = c[3].times(&minor3(a, b, d));
        let from_b = b[3].times(&minor3(a, c, d));
        let from_a = a[3].times(&minor3(b, c, d));
        from_d.minus(&from_c).plus(&from_b.minus(&from_a)).sign()
    }
    let lifted = (2 * (bits + 1) + 2).max(weight_bits + 2) + 1;
    if 3 * (bits + 1) + 3 + lifted + 2 < 127 {
        sign::<i128>(points, p, unit)
    } else {
        sign::<BigInt>(points, p, unit)
    }
}

/// The centre of the sphere orthogonal to four weighted points `[x, y, z, w]`, as the way to it from the
/// first: each coordinate exact but for one rounding. None when they lie in one plane.
pub(crate) fn orthocentre(corners: [[f64; 4]; 4]) -> Option<[f64; 3]> {
    let places = corners.into_iter().flat_map(|[x, y, z, _]| [x, y, z]);
    let (low, _) = span(places)?;
    let weights = corners.into_iter().map(|q| q[3]);
    let unit = span(weights).map_or(low, |(of_weights, _)| low.min(of_weights.div_euclid(2)));
    let place = |[x, y, z, _]: [f64; 4]| [x, y, z];
    let [a, b, c, d] = corners;
    let own: BigInt = whole(a[3], 2 * unit);
    let mut edges = rows::<BigInt, 3>([place(b), place(c), place(d)], place(a), unit);
    for (edge, corner) in edges.iter_mut().zip([b, c, d]) {
        let square = &edge[0] * &edge[0] + &edge[1] * &edge[1] + &edge[2] * &edge[2];
        edge[3] = square + &own - whole::<BigInt>(corner[3], 2 * unit);
    }
    // Cramer's rule for 2 e.x = |e|^2 + w_a - w_e over the three edges e.
    let [u, v, w] = &edges;
    let volume = minor3(u, v, w);
    if volume.sign() == Sign::NoSign {
        return None;
    }
    let mut offset = [0.0; 3];
    for axis in 0..3 {
        let with = |edge: &[BigInt; 4]| {
            let mut row = edge.clone();
            row[axis] = edge[3].clone();
            row
        };
        let part = minor3(&with(u), &with(v), &with(w));
        offset[axis] = ratio(part, &volume, unit - 1);
    }
    Some(offset)
}

/// `above / below * 2^exponent`, cut to 63 bits and rounded.
fn ratio(above: BigInt, below: &BigInt, exponent: i32) -> f64 {
    // Quotients of 64 bits or one more: what is cut is below half a unit of the double.
    let shift = 64 + below.bits() as i64 - above.bits() as i64;
    let quotient = if shift >= 0 {
        (above << shift as u64) / below
    } else {
        (above >> shift.unsigned_abs()) / below
    };
    let cut = quotient.bits().saturating_sub(63);
    let digits = (&quotient >> cut).magnitude().iter_u64_digits().next();
    let magnitude = digits.unwrap_or(0) as f64;
    let signed = if quotient.sign() == Sign::Minus {
        -magnitude
    } else {
        magnitude
    };
    // In two steps, as a power of two may be too small or large for a double where the result is not.
    let exponent = (i64::from(exponent) - shift + cut as i64).clamp(-4000, 4000) as i32;
    signed * 2f64.powi(exponent / 2) * 2f64.powi(exponent - exponent / 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centres_of_flat_cells_are_exact() {
        let corner = |x: f64, y: f64, z: f64| [x, y, z, 0.0];
        // Three corners of a square and the fourth, raised by one part in 2^50: x^2 + y^2 + z^2 = 2 z c.
        let high = 2f64.powi(-50);
        let corners = [
            corner(0.0, 0.0, 0.0),
            corner(1.0, 0.0, 0.0),
            corner(0.0, 1.0, 0.0),
            corner(1.0, 1.0, high),
        ];
        // (1, 1, h) is as far from (1/2, 1/2, c) as the origin: 2 h c = h^2.
        assert_eq!(orthocentre(corners), Some([0.5, 0.5, high / 2.0]));
        let mut flat = corners;
        flat[3][2] = 0.0;
        assert_eq!(orthocentre(flat), None);
        // A heavier fourth point draws the centre away: 2 h c = h^2 - w.
        let mut heavy = corners;
        heavy[3][3] = 2f64.powi(-60);
        let c = high / 2.0 - 2f64.powi(-61) / high;
        assert_eq!(orthocentre(heavy), Some([0.5, 0.5, c]));
        let tiny = corners.map(|p| p.map(|v| v * 2f64.powi(-900)));
        let [x, _, z] = orthocentre(tiny).expect("not flat");
        assert_eq!([x, z], [2f64.powi(-901), 2f64.powi(-951)]);
    }

    #[test]
    fn parts_make_the_number_again() {
        for value in [1.0, -0.75, 1e300, -3.5e-310, 5e-324, f64::MAX, 0.1] {
            let (mantissa, exponent) = parts(value).expect("none is zero");
            assert_eq!(mantissa % 2, if value < 0.0 { -1 } else { 1 });
            // In two steps: a power of two below the smallest double would round to zero.
            let half = exponent / 2;
            let made = mantissa as f64 * 2f64.powi(half) * 2f64.powi(exponent - half);
            assert_eq!(made, value);
        }
        assert_eq!(parts(0.0), None);
        assert_eq!(parts(-0.0), None);
    }
}
