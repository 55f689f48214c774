//! A molecule with tunnels, for tests of what is written of them.

use scantle::numeric::vector::{length, sub};
use scantle::progress::Silent;
use scantle::protein::builder::{Builder, Place};
use scantle::protein::clearance::Ball;
use scantle::protein::tunnels::{Params, Tunnel, find};
use scantle::protein::{Atom, Element, Molecule, Name};

/// A cubic crystal of carbons in residues of two with a hole in its middle, the atoms that its balls are, and two
/// tunnels. Every other atom is no ball.
pub fn sample() -> (Molecule, Vec<u32>, Vec<Tunnel>) {
    let name = |text: &str| Name::new(text.as_bytes()).expect("a name");
    let mut builder = Builder::default();
    let (mut balls, mut atoms) = (Vec::new(), Vec::new());
    for k in 0..432 {
        let index: usize = k / 2;
        let centre = [index % 6, index / 6 % 6, index / 36].map(|c| 4.2 * c as f64);
        if length(sub(centre, [10.5; 3])) < 4.0 {
            continue;
        }
        let counts = !k.is_multiple_of(2);
        let place = Place {
            name: name(if counts { "LIG" } else { "HOH" }),
            chain: name(if index < 108 { "A" } else { "B" }),
            number: index as i32 / 2 - 10,
            insertion: if index.is_multiple_of(2) { b' ' } else { b'B' },
            in_polymer: false,
        };
        let atom = Atom {
            position: centre,
            radius: None,
            serial: k as i64,
            name: name("C1"),
            residue: 0,
            occupancy: 1.0,
            b_factor: 0.0,
            element: Element(6),
            altloc: b' ',
            hetero: true,
        };
        if counts {
            atoms.push(builder.len() as u32);
            balls.push(Ball {
                centre,
                radius: 1.7,
            });
        }
        builder.push(&place, atom).expect("room");
    }
    let params = Params {
        count: 2,
        ..Params::DEFAULT
    };
    let found = find(&balls, [10.5; 3], &params, &Silent).expect("tunnels");
    (builder.finish(), atoms, found.tunnels)
}
