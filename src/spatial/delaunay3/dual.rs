//! The dual: power spheres of cells and facets.

use crate::numeric::exact;
use crate::numeric::vector::{add, cross, dot, scale, sub};

/// A sphere, by its centre and the square of its radius; negative where it is orthogonal to points whose
/// own spheres overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// The centre.
    pub centre: [f64; 3],
    /// The radius, squared.
    pub square: f64,
}

/// Cells flatter than this, their volume over that of their box, have their centre computed in whole
/// numbers.
const FLAT: f64 = 1e-5;

/// The sphere orthogonal to four weighted points `[x, y, z, w]`, the vertex of the power diagram that is
/// dual to their cell. With weights 0, the sphere through them.
///
/// The centre is right to about 1e-10 of the radius however flat the cell is; of points in one plane it is
/// not finite. Flat cells cost some 10 microseconds, others a hundredth of that.
pub fn orthosphere(corners: [[f64; 4]; 4]) -> Sphere {
    let [a, b, c, d] = corners;
    let origin = [a[0], a[1], a[2]];
    let edge = |p: [f64; 4]| sub([p[0], p[1], p[2]], origin);
    let (u, v, w) = (edge(b), edge(c), edge(d));
    // |x|^2 - w_a = |x - u|^2 - w_b, with x from the first point: 2 u.x = |u|^2 + w_a - w_b.
    let side = |e: [f64; 3], p: [f64; 4]| dot(e, e) + (a[3] - p[3]);
    let (vw, wu, uv) = (cross(v, w), cross(w, u), cross(u, v));
    let volume = dot(u, vw);
    let of_box: f64 = (0..3)
        .map(|k| u[k].abs().max(v[k].abs()).max(w[k].abs()))
        .product();
    let x = if volume.abs() > FLAT * of_box {
        let sum = add(
            add(scale(vw, side(u, b)), scale(wu, side(v, c))),
            scale(uv, side(w, d)),
        );
        scale(sum, 0.5 / volume)
    } else {
        exact::orthocentre(corners).unwrap_or([f64::NAN; 3])
    };
    Sphere {
        centre: add(origin, x),
        square: dot(x, x) - a[3],
    }
}

/// The smallest sphere orthogonal to three weighted points, its centre in their plane.
///
/// As [`orthosphere`]; for points on a line the centre is not finite.
pub fn orthosphere_of_facet(corners: [[f64; 4]; 3]) -> Sphere {
    let [a, b, c] = corners;
    let origin = [a[0], a[1], a[2]];
    let edge = |p: [f64; 4]| sub([p[0], p[1], p[2]], origin);
    let (u, v) = (edge(b), edge(c));
    let side = |e: [f64; 3], p: [f64; 4]| dot(e, e) + (a[3] - p[3]);
    let normal = cross(u, v);
    // x lies in the plane: 2 u.x and 2 v.x as above.
    let sum = add(
        scale(cross(v, normal), side(u, b)),
        scale(cross(normal, u), side(v, c)),
    );
    let x = scale(sum, 0.5 / dot(normal, normal));
    Sphere {
        centre: add(origin, x),
        square: dot(x, x) - a[3],
    }
}
