//! Meshes and molecules made at random, for the tests that read back what they wrote.

use crate::mesh::polygon::set_faces;
use crate::mesh::{Mesh, Polygons};
use crate::protein::builder::{Builder, Place};
use crate::protein::{Atom, Element, Molecule, Name};
use crate::report::Warning;
use proptest::prelude::*;

/// What the meshes may have beside vertices and faces.
#[derive(Debug, Clone, Copy)]
pub struct Content {
    pub normals: bool,
    pub colors: bool,
    pub classes: bool,
    pub segments: bool,
    pub points: bool,
}

impl Content {
    pub const ALL: Content = Content {
        normals: true,
        colors: true,
        classes: true,
        segments: true,
        points: true,
    };
}

/// Any finite number, half of them exactly 32-bit ones.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f32>()
            .prop_filter("finite", |c| c.is_finite())
            .prop_map(f64::from),
        any::<f64>().prop_filter("finite", |c| c.is_finite()),
        -100.0..100.0f64,
        Just(-0.0),
    ]
}

/// Positions of which, in half of the meshes, all are 32-bit numbers.
fn positions() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let wide = prop::collection::vec(prop::array::uniform3(number()), 1..30);
    (wide, any::<bool>()).prop_map(|(mut positions, narrow)| {
        if narrow {
            for c in positions.as_flattened_mut() {
                *c = f64::from(c.clamp(-3e38, 3e38) as f32);
            }
        }
        positions
    })
}

fn colors(count: usize) -> impl Strategy<Value = Vec<[f32; 4]>> {
    let byte = any::<u8>().prop_map(|b| (f64::from(b) / 255.0) as f32);
    let bytes = prop::collection::vec(prop::array::uniform4(byte), count);
    let reals = prop::collection::vec(prop::array::uniform4(0.0..=1.0f32), count);
    let opaque = |colors: Vec<[f32; 4]>| colors.iter().map(|c| [c[0], c[1], c[2], 1.0]).collect();
    prop_oneof![
        bytes.clone(),
        reals.clone(),
        bytes.prop_map(opaque),
        reals.prop_map(opaque)
    ]
}

/// A mesh as a reader gives it: triangles or faces of up to seven corners, or a cloud.
pub fn mesh(content: Content) -> impl Strategy<Value = Mesh> {
    positions().prop_flat_map(move |positions| {
        let n = positions.len();
        let vertex = 0..n as u32;
        let face = prop_oneof![
            prop::collection::vec(vertex.clone(), 3),
            prop::collection::vec(vertex.clone(), 3..8)
        ];
        let triangle = prop::collection::vec(vertex.clone(), 3);
        let faces = prop_oneof![
            prop::collection::vec(face, 0..20),
            prop::collection::vec(triangle, 0..20)
        ];
        let up_to = |most: usize, has: bool| 0..=if has { most } else { 0 };
        let segments = prop::collection::vec(
            prop::array::uniform2(vertex.clone()),
            up_to(9, content.segments),
        );
        let points = prop::collection::vec(vertex, up_to(9, content.points));
        let normals = prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), n);
        let attributes = (
            prop::option::of(normals).prop_map(move |n| n.filter(|_| content.normals)),
            prop::option::of(colors(n)).prop_map(move |c| c.filter(|_| content.colors)),
            prop::option::of(prop::collection::vec(any::<u8>(), n))
                .prop_map(move |c| c.filter(|_| content.classes)),
        );
        (Just(positions), faces, segments, points, attributes)
            .prop_map(|(p, f, s, o, a)| assembled(p, &f, s, o, a))
    })
}

type Attributes = (
    Option<Vec<[f64; 3]>>,
    Option<Vec<[f32; 4]>>,
    Option<Vec<u8>>,
);

fn assembled(
    positions: Vec<[f64; 3]>,
    faces: &[Vec<u32>],
    segments: Vec<[u32; 2]>,
    points: Vec<u32>,
    (normals, colors, classes): Attributes,
) -> Mesh {
    let mut mesh = Mesh {
        positions,
        segments,
        points,
        normals,
        colors,
        classes,
        ..Mesh::default()
    };
    let mut polygons = Polygons::default();
    faces.iter().for_each(|face| polygons.push(face));
    set_faces(&mut mesh, polygons, &mut Vec::new()).unwrap();
    if mesh.is_empty() {
        mesh.points = (0..mesh.positions.len() as u32).collect();
    }
    mesh.check().unwrap();
    mesh
}

/// Faces made at random cross themselves; nothing else is to be warned of.
pub fn only_about_faces(warnings: &[Warning]) -> bool {
    warnings.iter().all(|w| w.code == "fanned-faces")
}

/// A word of a few printable characters without blanks.
fn word(least: usize, most: usize) -> impl Strategy<Value = Name> {
    prop::collection::vec(b'!'..=b'~', least..=most)
        .prop_map(|bytes| Name::new(&bytes).expect("a short word"))
}

/// An atom as a reader gives it, of a residue held as `hetero`.
fn atom(hetero: bool) -> impl Strategy<Value = Atom> {
    let thousandths = prop::array::uniform3(-999_999..9_999_999i32);
    let figures = (0..=100i32, 0..=99_999i32, 1..=118u8, -9999..87_440_032i64);
    let letter = prop_oneof![Just(b' '), b'A'..=b'Z'];
    (thousandths, figures, word(1, 4), letter).prop_map(move |(at, figures, name, altloc)| {
        let (occupancy, b_factor, element, serial) = figures;
        Atom {
            position: at.map(|c| f64::from(c) / 1000.0),
            serial,
            name,
            occupancy: (f64::from(occupancy) / 100.0) as f32,
            b_factor: (f64::from(b_factor) / 100.0) as f32,
            element: Element(element),
            altloc,
            hetero,
            ..super::gather::BLANK
        }
    })
}

/// A molecule that PDB files hold as it is.
pub fn molecule() -> impl Strategy<Value = Molecule> {
    let place = (word(1, 3), word(0, 1), -999..2_436_112i32, any::<bool>());
    let letter = prop_oneof![Just(b' '), b'A'..=b'Z'];
    let residue = (place, letter, any::<bool>()).prop_flat_map(|(place, insertion, hetero)| {
        let (name, chain, number, in_polymer) = place;
        let place = Place {
            name,
            chain,
            number,
            insertion,
            in_polymer: in_polymer && hetero,
        };
        (Just(place), prop::collection::vec(atom(hetero), 1..4))
    });
    let models = prop::collection::vec(prop::collection::vec(residue, 1..6), 1..4);
    models.prop_map(|models| {
        let mut builder = Builder::default();
        for (number, residues) in (1..).zip(models) {
            builder.begin_model(number);
            for (place, atoms) in residues {
                for atom in atoms {
                    builder.push(&place, atom).expect("room");
                }
            }
        }
        builder.set_id("1ABC".to_owned());
        builder.finish()
    })
}
