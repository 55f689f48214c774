//! Points spread evenly over elements, by area or by length.

use super::Mesh;
use crate::error::{Error, Result};
use crate::numeric::rng::Rng;
use crate::numeric::vector::{Vec3, add, cross, length, scale, sub};
use rayon::prelude::*;

/// Where a point lies: in which element, and two numbers from 0 to 1 that are spread evenly in there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The element, from 0.
    pub element: usize,
    /// The first number.
    pub along: f64,
    /// The second.
    pub across: f64,
}

/// Exactly `count` places spread evenly over elements of these extents, one in each of `count` equal
/// shares; none where nothing has an extent.
///
/// Each depends on the seed and its index alone. Cost: linear in the elements, and a search for each place.
pub fn spread(extents: &[f64], count: u64, seed: u64) -> Vec<Place> {
    let mut total = 0.0;
    let up_to: Vec<f64> = extents
        .iter()
        .map(|e| {
            total += e;
            total
        })
        .collect();
    if total == 0.0 {
        return Vec::new();
    }
    let last = up_to.partition_point(|sum| *sum < total);
    (0..count)
        .into_par_iter()
        .map(|i| {
            let mut rng = Rng::new(seed, i);
            let place = (i as f64 + rng.unit()) / count as f64 * total;
            let element = up_to.partition_point(|sum| *sum <= place).min(last);
            // How far into the element the place is: places are spread evenly in there too.
            let share = 1.0 - (up_to[element] - place) / extents[element];
            Place {
                element,
                along: share.clamp(0.0, 1.0),
                across: rng.unit(),
            }
        })
        .collect()
}

/// The weights of a triangle's second and third corner at a place in it; equal areas for equal areas.
///
/// Source: Osada, Funkhouser, Chazelle, Dobkin 2002, "Shape distributions", section 4.2.
pub fn in_triangle(place: &Place) -> [f64; 2] {
    let root = place.along.sqrt();
    [root * (1.0 - place.across), root * place.across]
}

/// A cloud of `count` points spread evenly over a mesh's triangles by area.
///
/// Each has the unit normal of its triangle, and colours and classes where the mesh has them: colours of
/// corners are mixed, the class is that of the nearest corner. Equal input and seed give equal points on
/// any number of threads. Errs where the mesh has no triangle with an area. Cost: linear.
pub fn sample(mesh: &Mesh, count: u64, seed: u64) -> Result<Mesh> {
    // Shares of the largest side, as products of tiny or huge ones would be lost.
    let extent = mesh.bounds().extent();
    let unit = extent[0].max(extent[1]).max(extent[2]);
    let triangles = 0..mesh.triangles.len();
    let twice = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let [e, f] = [sub(b, a), sub(c, a)].map(|side| side.map(|x| x / unit));
        cross(e, f)
    };
    let area = |t: usize| length(twice(t));
    let areas: Vec<f64> = if unit > 0.0 && unit.is_finite() {
        triangles.into_par_iter().map(area).collect()
    } else {
        Vec::new()
    };
    let places = spread(&areas, count, seed);
    if places.is_empty() && count > 0 {
        return Err(Error::Geometry(crate::error::Fault::whole(
            "has no triangle with an area, so no points can be sampled on it",
        )));
    }
    let at = |place: &Place| {
        let [a, b, c] = mesh.corners(place.element);
        let [u, v] = in_triangle(place);
        add(a, add(scale(sub(b, a), u), scale(sub(c, a), v)))
    };
    let normal = |place: &Place| -> Vec3 {
        let normal = twice(place.element);
        let largest = normal.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let normal = normal.map(|x| x / largest);
        scale(normal, 1.0 / length(normal))
    };
    let mixed = |colors: &[[f32; 4]], place: &Place| -> [f32; 4] {
        let [u, v] = in_triangle(place);
        let corners = mesh.triangles[place.element].map(|corner| colors[corner as usize]);
        let shares = [1.0 - u - v, u, v];
        std::array::from_fn(|i| {
            (0..3)
                .map(|c| (shares[c] * f64::from(corners[c][i])) as f32)
                .sum()
        })
    };
    let class = |classes: &[u8], place: &Place| {
        let [u, v] = in_triangle(place);
        let shares = [1.0 - u - v, u, v];
        let nearest = (0..3).fold(0, |best, c| if shares[c] > shares[best] { c } else { best });
        classes[mesh.triangles[place.element][nearest] as usize]
    };
    Ok(Mesh {
        positions: places.par_iter().map(at).collect(),
        points: (0..places.len() as u32).collect(),
        normals: Some(places.par_iter().map(normal).collect()),
        colors: mesh
            .colors
            .as_deref()
            .map(|colors| places.par_iter().map(|p| mixed(colors, p)).collect()),
        classes: mesh
            .classes
            .as_deref()
            .map(|classes| places.par_iter().map(|p| class(classes, p)).collect()),
        ..Mesh::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::numeric::vector::dot;

    #[test]
    fn samples_lie_on_the_mesh_and_are_even() {
        let mesh = shapes::icosphere([1.0, 2.0, 3.0], 2.0, 3);
        let cloud = sample(&mesh, 8000, 5).unwrap();
        assert_eq!(cloud.positions.len(), 8000);
        let normals = cloud.normals.as_deref().unwrap();
        let mut octants = [0; 8];
        for (p, n) in cloud.positions.iter().zip(normals) {
            let out = sub(*p, [1.0, 2.0, 3.0]);
            assert!(length(out) <= 2.0 && length(out) > 1.97, "{out:?}");
            assert!(dot(out, *n) > 0.98 * length(out) && (length(*n) - 1.0).abs() < 1e-14);
            octants[(0..3)
                .map(|a| usize::from(out[a] > 0.0) << a)
                .sum::<usize>()] += 1;
        }
        assert!(
            octants.iter().all(|n| (960..1040).contains(n)),
            "{octants:?}"
        );
    }

    #[test]
    fn what_has_no_area_has_no_samples() {
        let flat = Mesh::from_triangles(vec![[0.0; 3], [1.0; 3], [2.0; 3]], vec![[0, 1, 2]]);
        assert!(sample(&flat, 10, 0).is_err());
        assert!(sample(&Mesh::default(), 10, 0).is_err());
    }

    #[test]
    fn size_changes_nothing() {
        let mesh = shapes::icosphere([0.0; 3], 1.0, 2);
        let tiny = Mesh {
            positions: mesh
                .positions
                .iter()
                .map(|p| p.map(|x| x * 2f64.powi(-600)))
                .collect(),
            ..mesh.clone()
        };
        let (a, b) = (
            sample(&mesh, 100, 1).unwrap(),
            sample(&tiny, 100, 1).unwrap(),
        );
        for (p, q) in a.positions.iter().zip(&b.positions) {
            assert_eq!(p.map(|x| x * 2f64.powi(-600)), *q);
        }
        assert_eq!(a.normals, b.normals);
    }
}
