//! Molecules of which nothing is known but where their atoms are, and how large.

use super::builder::{Builder, Place};
use super::clearance::Ball;
use super::element::Element;
use super::molecule::{Atom, Molecule};
use super::name::Name;
use super::radii::Radii;
use crate::error::Fault;

impl Molecule {
    /// The molecule that a file of these spheres holds: atoms of one residue, all without a name and of no
    /// known element, with serial numbers from 1.
    ///
    /// Errs at the 2^32nd. Cost: linear.
    pub fn of_spheres(balls: &[Ball]) -> Result<Molecule, Fault> {
        let mut builder = Builder::default();
        let place = Place {
            insertion: b' ',
            ..Place::default()
        };
        for (serial, ball) in (1..).zip(balls) {
            let atom = Atom {
                position: ball.centre,
                radius: Some(ball.radius),
                serial,
                name: Name::EMPTY,
                residue: 0,
                occupancy: 1.0,
                b_factor: 0.0,
                element: Element::UNKNOWN,
                altloc: b' ',
                hetero: false,
            };
            builder.push(&place, atom)?;
        }
        Ok(builder.finish())
    }

    /// The atoms of all models as spheres, in order, with their own radii or else those of their elements.
    ///
    /// Nothing is selected; see [`Selected`](super::select::Selected) for the atoms that count. Cost:
    /// linear.
    pub fn spheres(&self) -> Vec<Ball> {
        let radii = Radii::default();
        let atoms = self.atoms.iter();
        atoms
            .map(|atom| Ball {
                centre: atom.position,
                radius: radii.of(atom, self.residue_of(atom)).0,
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protein::builder::tests::{atom, built};

    #[test]
    fn spheres_come_back_and_atoms_have_radii() {
        let balls = [([1.0, -2.5, 1e300], 1.7), ([0.1, 0.2, 0.3], 0.0)];
        let balls = balls.map(|(centre, radius)| Ball { centre, radius });
        let molecule = Molecule::of_spheres(&balls).expect("room");
        molecule.check().expect("a sound molecule");
        assert_eq!(molecule.spheres(), balls);
        assert_eq!((molecule.residues.len(), molecule.atoms[1].serial), (1, 2));
        let named = built(&[("A:1:GLY", atom("N", 0.0)), ("A:1:GLY", atom("O", 1.5))]);
        let radii: Vec<f64> = named.spheres().iter().map(|ball| ball.radius).collect();
        assert_eq!(radii, [1.55, 1.52]);
    }
}
