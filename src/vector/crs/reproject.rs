//! Coordinates of one reference system as those of another.

use super::Crs;
use crate::error::{Error, Fault, Result};
use crate::vector::Vec2;
use proj4rs::Proj;
use proj4rs::transform::transform;

/// From one coordinate reference system to another.
///
/// By the formulas of PROJ 4 (Evenden 1990; Snyder 1987, USGS Professional Paper 1395). Datums are
/// related by the shift of three or seven numbers in the registry, not by grids: some metres where that
/// is all there is, nothing where both are on WGS 84 or its like.
pub struct Reprojector {
    systems: Option<[Proj; 2]>,
}

impl Reprojector {
    /// Readies the way; one between equal systems changes nothing.
    ///
    /// Errs with both names where the definition of one is not known, its projection is none of PROJ 4
    /// that can be undone, or the datum of one alone is not known.
    pub fn new(from: &Crs, to: &Crs) -> Result<Self> {
        if from.same(to) {
            return Ok(Reprojector { systems: None });
        }
        let refused = |crs: &Crs, why: String| {
            let problem = format!("coordinates of {from} cannot be made those of {to}: {why}");
            let hint = format!("reproject the data that is in {crs} with another tool first");
            Error::Geometry(Fault::whole(problem).with_hint(hint))
        };
        let system = |crs: &Crs| {
            let text = crs.proj_string();
            let text =
                text.ok_or_else(|| refused(crs, format!("{crs} has no known definition")))?;
            Proj::from_proj_string(&text).map_err(|e| refused(crs, format!("{crs}: {e}")))
        };
        let systems = [system(from)?, system(to)?];
        if !systems[0].has_inverse() {
            let why = format!("the projection of {from} cannot be undone");
            return Err(refused(from, why));
        }
        for (crs, other) in [(from, to), (to, from)] {
            let is_unknown = |crs: &Crs| crs.definition().is_some_and(|d| d.datum.is_empty());
            if is_unknown(crs) && !is_unknown(other) {
                let why = format!("how the datum of {crs} lies to WGS 84 is not known");
                return Err(refused(crs, why));
            }
        }
        Ok(Reprojector {
            systems: Some(systems),
        })
    }

    /// Whether places stay as they are.
    pub fn is_identity(&self) -> bool {
        self.systems.is_none()
    }

    /// The place in the other system; none where it has no coordinates there.
    ///
    /// Longitudes and latitudes are in degrees.
    pub fn apply(&self, place: Vec2) -> Option<Vec2> {
        let Some([from, to]) = &self.systems else {
            return Some(place);
        };
        let mut at = (place[0], place[1], 0.0);
        if from.is_latlong() {
            at = (at.0.to_radians(), at.1.to_radians(), 0.0);
        }
        transform(from, to, &mut at).ok()?;
        if to.is_latlong() {
            at = (at.0.to_degrees(), at.1.to_degrees(), 0.0);
        }
        (at.0.is_finite() && at.1.is_finite()).then_some([at.0, at.1])
    }
}
