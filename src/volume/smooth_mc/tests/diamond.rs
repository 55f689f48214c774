//! No triangle whose corners stay in their diamonds can reach the centre of a voxel.
//!
//! Lengths are in half voxels, from a corner of the cell: centres of voxels have even coordinates, and a
//! diamond has its corners one step from its middle. All numbers are whole, so that nothing is rounded.

use crate::progress::Silent;
use crate::volume::isosurface::cases::{CASES, doubled_midpoint};
use crate::volume::isosurface::{Labels, extract_labels};
use crate::volume::{Data, Frame, Volume};
use std::collections::BTreeSet;

type Place = [i32; 3];

/// The middles of three diamonds.
type Triple = [Place; 3];

/// Corners of the octahedron around a place.
fn diamond(middle: Place) -> Vec<Place> {
    let tip = |i: usize| {
        let mut tip = middle;
        tip[i / 2] += if i % 2 == 1 { 1 } else { -1 };
        tip
    };
    (0..6).map(tip).collect()
}

/// Corners of the box of a voxel around a place.
fn cube(middle: Place) -> Vec<Place> {
    let corner = |c: usize| [0, 1, 2].map(|a| middle[a] + 2 * (c >> a & 1) as i32 - 1);
    (0..8).map(corner).collect()
}

fn dot(a: Place, b: Place) -> i32 {
    (0..3).map(|axis| a[axis] * b[axis]).sum()
}

/// Whether a point lies in the interior of the hull of others, which fills space.
///
/// Else the directions that no corner lies beyond the point in make a cone with an edge, and to that edge
/// two of the corners, as seen from the point, are perpendicular: it is one of their cross products.
fn is_within(point: Place, corners: &[Place]) -> bool {
    let from: Vec<Place> = corners
        .iter()
        .map(|c| [0, 1, 2].map(|a| c[a] - point[a]))
        .collect();
    let parts = |normal: Place| {
        normal != [0; 3]
            && (from.iter().all(|c| dot(normal, *c) <= 0)
                || from.iter().all(|c| dot(normal, *c) >= 0))
    };
    let cross = |[x, y, z]: Place, [u, v, w]: Place| [y * w - z * v, z * u - x * w, x * v - y * u];
    let pairs = (0..from.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    !pairs.map(|(i, j)| cross(from[i], from[j])).any(parts)
}

/// A centre of a voxel in the interior of the hull of three shapes.
fn centre_within(triple: &Triple, shape: impl Fn(Place) -> Vec<Place>) -> Option<Place> {
    let corners: Vec<Place> = triple.iter().flat_map(|middle| shape(*middle)).collect();
    let along = |a: usize| {
        let all = corners.iter().map(move |c| c[a]);
        let (low, high) = (all.clone().min().unwrap_or(0), all.max().unwrap_or(0));
        (low..=high).filter(|c| c % 2 == 0)
    };
    along(2)
        .flat_map(|z| along(1).map(move |y| [y, z]))
        .flat_map(|[y, z]| along(0).map(move |x| [x, y, z]))
        .find(|centre| is_within(*centre, &corners))
}

/// Every three of a polygon's corners.
fn triples(polygon: &[Place]) -> Vec<Triple> {
    let mut found = Vec::new();
    for k in 0..polygon.len() {
        for j in 0..k {
            found.extend((0..j).map(|i| [polygon[i], polygon[j], polygon[k]]));
        }
    }
    found
}

#[test]
fn a_hull_has_its_interior_and_neither_faces_nor_corners_in_it() {
    let hull = cube([0; 3]);
    assert!(is_within([0; 3], &hull));
    for on_or_out in [[1, 0, 0], [1, 1, 0], [1, 1, 1], [2, 0, 0], [2, 2, 2]] {
        assert!(!is_within(on_or_out, &hull), "{on_or_out:?}");
    }
    assert!(is_within([0; 3], &diamond([0; 3])));
    assert!(!is_within([1, 0, 0], &diamond([0; 3])));
}

/// All 256 cells, and any three corners of a polygon, so that any split of it into triangles is among them.
#[test]
fn no_centre_lies_within_the_hull_of_three_diamonds_of_a_cells_polygon() {
    let mut all = Vec::new();
    for case in CASES.iter() {
        for polygon in case.loops() {
            let places: Vec<Place> = polygon
                .iter()
                .map(|edge| doubled_midpoint(usize::from(*edge)))
                .collect();
            all.extend(triples(&places));
        }
    }
    assert_eq!(all.len(), 3008);
    let different: BTreeSet<Triple> = all.into_iter().collect();
    for triple in &different {
        assert_eq!(centre_within(triple, diamond), None, "{triple:?}");
    }
    // The box of the same extent is too large for that.
    assert!(different.iter().any(|t| centre_within(t, cube).is_some()));
}

/// The corners of a cell shared out among labels in every way there is: where three or more meet, triangles
/// go to the middles of faces and cells.
///
/// The order of labels matters on faces alone where two of them alternate. Faces that share an edge share
/// both labels then, so that two orders of all are enough but where such faces lie opposite each other.
#[test]
fn no_centre_lies_within_the_hull_of_three_diamonds_where_labels_meet() {
    let mut different: BTreeSet<Triple> = BTreeSet::new();
    let mut ways = 0;
    let mut shared = [0u8; 8];
    loop {
        ways += 1;
        collect(&mut different, shared.map(|label| 1 + label));
        collect(&mut different, shared.map(|label| 8 - label));
        // The next way in which no label is named before those below it.
        let named = |to: usize| shared[..to].iter().max().map_or(0, |most| most + 1);
        let Some(at) = (1..8).rev().find(|at| shared[*at] < named(*at)) else {
            break;
        };
        shared[at] += 1;
        shared[at + 1..].fill(0);
    }
    assert_eq!(ways, 4140);
    for (axis, labels) in (0..3).flat_map(|axis| (0..256usize).map(move |labels| (axis, labels))) {
        let value = |corner: usize| {
            let upper = corner >> axis & 1;
            let turn = (corner.count_ones() as usize + upper) % 2;
            1 + (labels >> (4 * upper + 2 * turn) & 3) as u8
        };
        collect(&mut different, std::array::from_fn(value));
    }
    let is_middle = |p: &Place| p.iter().map(|c| c & 1).sum::<i32>() != 1;
    assert!(different.iter().flatten().any(is_middle));
    for triple in &different {
        assert_eq!(centre_within(triple, diamond), None, "{triple:?}");
    }
}

/// Adds the triples of the polygons around eight voxels, each moved by whole voxels to the same place.
fn collect(different: &mut BTreeSet<Triple>, values: [u8; 8]) {
    let volume = Volume {
        frame: Frame::straight([2; 3], [0.0; 3], [1.0; 3]),
        data: Data::U8(values.to_vec()),
    };
    let labels = Labels::new((1..=8).map(f64::from).collect());
    let surface = extract_labels(&volume, &labels, &Silent).expect("walls");
    let mut corners = &surface.loops.corners[..];
    for length in &surface.loops.lengths {
        let (polygon, rest) = corners.split_at(usize::from(*length));
        corners = rest;
        let places: Vec<Place> = polygon
            .iter()
            .map(|v| surface.places[*v as usize])
            .collect();
        for triple in triples(&places) {
            let low: Place = [0, 1, 2].map(|a| {
                let least = triple.iter().map(|p| p[a]).fold(i32::MAX, i32::min);
                least.div_euclid(2) * 2
            });
            different.insert(triple.map(|p| [0, 1, 2].map(|a| p[a] - low[a])));
        }
    }
}
