//! How far the triangles of a mesh are turned from those of another.

use super::surface::{Elements, Surface};
use crate::error::{Error, Fault, Result};
use crate::mesh::Mesh;
use crate::numeric::sums::sum_by;
use crate::numeric::vector::{Vec3, add, cross, dot, length, scale, sub};
use crate::spatial::local::LocalFrame;

/// Root mean square, by area, of the angle between each triangle and the triangle of the reference that is
/// nearest to its middle, in degrees from 0 to 90: which side is the outer one does not matter.
///
/// Triangles without area are left aside. `None` where no triangle of the mesh has one. Errs where the
/// reference has no triangle. Cost: a search for each triangle.
pub fn normal_rms_deg(mesh: &Mesh, reference: &Mesh) -> Result<Option<f64>> {
    if reference.triangles.is_empty() {
        let problem = "the reference has no triangles, so nothing has an angle to it";
        return Err(Error::Geometry(Fault::whole(problem)));
    }
    let elements = Elements::of(reference, "reference")?;
    let frame = LocalFrame::around(elements.bounds(reference).union(mesh.used_bounds()));
    let surface = Surface::new(reference, elements, &frame);
    let local = |t: &[u32; 3]| t.map(|v| frame.to_local(mesh.positions[v as usize]));
    let middle = |t: &[u32; 3]| {
        let [a, b, c] = local(t);
        scale(add(a, add(b, c)), 1.0 / 3.0)
    };
    let hits = surface.nearest_of(&mesh.triangles, middle);
    let pairs: Vec<(f64, f64)> = mesh
        .triangles
        .iter()
        .zip(hits)
        .map(|(t, hit)| {
            let own = normal(local(t));
            let other = normal(surface.corners[hit.element as usize]);
            let angle = length(cross(own, other)).atan2(dot(own, other).abs());
            let flat = length(other) == 0.0;
            (if flat { 0.0 } else { length(own) }, angle.to_degrees())
        })
        .collect();
    let area = sum_by(&pairs, |(area, _)| *area);
    let squares = sum_by(&pairs, |(area, angle)| area * angle * angle);
    Ok((area > 0.0).then(|| (squares / area).sqrt()))
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    cross(sub(b, a), sub(c, a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn a_turned_sheet_differs_by_its_angle() {
        let sheet = shapes::sheet(4.0, 4.0, 3, 5);
        for degrees in [0.0f64, 1e-6, 10.0, 60.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let turn = |p: &Vec3| [p[0], cos * p[1] - sin * p[2], sin * p[1] + cos * p[2]];
            let turned = Mesh {
                positions: sheet.positions.iter().map(turn).collect(),
                ..sheet.clone()
            };
            let found = normal_rms_deg(&turned, &sheet)
                .expect("an angle")
                .expect("area");
            assert!((found - degrees).abs() < 1e-9, "{degrees}: {found}");
        }
        let over = Mesh {
            triangles: sheet
                .triangles
                .iter()
                .map(|[a, b, c]| [*a, *c, *b])
                .collect(),
            ..sheet.clone()
        };
        assert_eq!(normal_rms_deg(&over, &sheet).expect("an angle"), Some(0.0));
        assert_eq!(
            normal_rms_deg(&Mesh::default(), &sheet).expect("none"),
            None
        );
        assert!(normal_rms_deg(&sheet, &Mesh::default()).is_err());
    }
}
