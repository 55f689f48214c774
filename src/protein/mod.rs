//! Molecules: atoms with radii, which of them count, and where a search in them begins.
//!
//! Lengths are in the file's unit, which for every molecular format is the angstrom. Indices of
//! atoms, residues and models count from 0 in the order of the file.

mod altlocs;
pub mod builder;
pub mod clearance;
pub mod element;
pub mod inventory;
pub mod molecule;
pub mod name;
pub mod polymer;
pub mod radii;
pub mod select;
mod spacing;
mod spheres;
pub mod start;
pub mod tunnels;

pub use element::Element;
pub use molecule::{Atom, Model, Molecule, Residue};
pub use name::Name;
