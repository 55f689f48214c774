//! `.prj` files: the reference system of the file that they stand beside, in WKT.

use super::source::Source;
use crate::report::Warning;
use crate::vector::crs::Crs;

/// The system that the `.prj` file beside an input defines; none, with a warning, where it cannot be read.
pub fn beside(source: &Source, warnings: &mut Vec<Warning>) -> Option<Crs> {
    let bytes = source.sibling("prj").ok()??;
    match Crs::parse(&String::from_utf8_lossy(&bytes)) {
        Ok(crs) => Some(crs),
        Err(fault) => {
            let message = format!("a .prj file that defines no reference system: {fault}");
            warnings.push(Warning::new("unknown-crs", message, 1, None));
            None
        }
    }
}
