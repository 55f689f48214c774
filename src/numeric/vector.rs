//! Arithmetic on points and vectors held as `[f64; 3]`, the form in which meshes are stored.

/// A point or a vector in space.
pub type Vec3 = [f64; 3];

/// `a + b`.
#[inline]
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`.
#[inline]
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a` times the number `s`.
#[inline]
pub fn scale(a: Vec3, s: f64) -> Vec3 {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// The scalar product.
#[inline]
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
#[inline]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The length of `a`; right for lengths whose square over- or underflows.
#[inline]
pub fn length(a: Vec3) -> f64 {
    let square = dot(a, a);
    if square.is_finite() && square > f64::MIN_POSITIVE {
        return square.sqrt();
    }
    let largest = a[0].abs().max(a[1].abs()).max(a[2].abs());
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    let unit = [a[0] / largest, a[1] / largest, a[2] / largest];
    largest * dot(unit, unit).sqrt()
}

/// `a` made one long; a zero vector stays zero.
#[inline]
pub fn normalize(a: Vec3) -> Vec3 {
    let length = length(a);
    if length == 0.0 {
        a
    } else {
        [a[0] / length, a[1] / length, a[2] / length]
    }
}

/// `a + t (b - a)`.
#[inline]
pub fn lerp(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    add(a, scale(sub(b, a), t))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn length_survives_squares_that_do_not() {
        assert!((length([3e-200, 4e-200, 0.0]) / 5e-200 - 1.0).abs() <= f64::EPSILON);
        assert!((length([3e200, 0.0, 4e200]) / 5e200 - 1.0).abs() <= f64::EPSILON);
        assert_eq!(length([0.0; 3]), 0.0);
        assert_eq!(normalize([0.0; 3]), [0.0; 3]);
    }
}
