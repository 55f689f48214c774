//! What is reported of a smooth surface.

use super::input::Piece;
use scantle::measure::smooth_error::{Judged, SmoothError};
use scantle::mesh::Mesh;
use scantle::numeric::vector::length;
use scantle::report::Accuracy;
use scantle::volume::smooth_mc::{self, Params};
use schemars::JsonSchema;
use serde::Serialize;

/// A body.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Body {
    /// Its value.
    pub label: f64,
    /// What `--label-names` calls it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Triangles around it.
    pub triangles: u64,
    /// Its voxels.
    pub voxels: i64,
    /// What marching cubes encloses, in percent of the voxels.
    pub volume_before_percent: f64,
    /// What is enclosed now, in percent of the voxels.
    pub volume_percent: f64,
    /// Voxels of it that lie outside, and others that lie inside; only with `--verify`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub misclassified_voxels: Option<u64>,
}

/// Root mean square of the angle between triangles and those of the reference, by area, in degrees.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Directions {
    /// Of the surface as it was; null where no triangle has area.
    pub before: Option<f64>,
    /// Of the smooth surface; null where no triangle has area.
    pub after: Option<f64>,
}

/// Distances between surfaces.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Hausdorff {
    /// In diagonals of a cell.
    cell_diagonals: f64,
    /// In the smallest spacing.
    voxels: f64,
    /// Whether it was measured; else it is the longest way of a vertex, which is no smaller.
    measured: bool,
}

/// What was made.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// Vertices of the surface.
    vertices: u64,
    /// Its triangles; a wall between two labels counts once.
    triangles: u64,
    /// Steps of the grid along its axes.
    spacing: [f64; 3],
    /// Centre of its first voxel.
    origin: [f64; 3],
    /// Whether the grid was read from a mesh.
    spacing_detected: bool,
    /// How far a coordinate of the mesh lies from that grid, in half voxels; null where there is none.
    lattice_residual_max: Option<f64>,
    #[serde(flatten)]
    smoothing: smooth_mc::Stats,
    /// What is enclosed, in percent of what marching cubes encloses; null where the surface is open.
    volume_percent: Option<f64>,
    /// What is enclosed, in percent of the voxels; null where the surface is open.
    voxel_volume_percent: Option<f64>,
    /// The symmetric distance to the surface as it was.
    hausdorff: Hausdorff,
    /// Angles to the triangles of `--reference`.
    #[serde(skip_serializing_if = "Option::is_none")]
    normal_rms_deg: Option<Directions>,
    /// The bodies, where several labels were asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    labels: Vec<Body>,
    /// The surface beside those of the methods that `--compare` names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    compared: Vec<Judged>,
    /// What `--verify` measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    verified: Option<SmoothError>,
}

impl Hausdorff {
    fn new(distance: f64, spacing: [f64; 3], measured: bool) -> Self {
        let smallest = spacing.iter().copied().fold(f64::INFINITY, f64::min);
        Hausdorff {
            cell_diagonals: distance / length(spacing),
            voxels: distance / smallest,
            measured,
        }
    }
}

impl Stats {
    /// What smoothing found.
    pub fn new(
        piece: &Piece,
        smoothing: smooth_mc::Stats,
        offsets: &[[f64; 3]],
        triangles: usize,
    ) -> Self {
        let spacing = piece.frame.spacing();
        let lattice = piece.mesh.as_ref().map(|(_, lattice)| lattice);
        let way = |o: &[f64; 3]| length([0, 1, 2].map(|a| o[a] * spacing[a]));
        let percent = |of: Option<f64>| Some(100.0 * smoothing.volume_after? / of?);
        Stats {
            vertices: piece.surface.len() as u64,
            triangles: triangles as u64,
            spacing,
            origin: piece.frame.origin,
            spacing_detected: lattice.is_some_and(|l| l.spacing_detected),
            lattice_residual_max: lattice.map(|l| l.residual),
            volume_percent: percent(smoothing.volume_before),
            voxel_volume_percent: percent(smoothing.voxels.map(|v| v as f64)),
            hausdorff: Hausdorff::new(offsets.iter().map(way).fold(0.0, f64::max), spacing, false),
            smoothing,
            normal_rms_deg: None,
            labels: Vec::new(),
            compared: Vec::new(),
            verified: None,
        }
    }

    /// What smoothing found of a mesh of which nothing is known but the size of a cell.
    pub fn of_any_mesh(mesh: &Mesh, spacing: [f64; 3], smoothing: smooth_mc::Stats) -> Self {
        Stats {
            vertices: mesh.positions.len() as u64,
            triangles: mesh.triangles.len() as u64,
            spacing,
            origin: [0.0; 3],
            spacing_detected: false,
            lattice_residual_max: None,
            volume_percent: None,
            voxel_volume_percent: None,
            // No vertex leaves half of its box.
            hausdorff: Hausdorff::new(0.5 * length(spacing), spacing, false),
            smoothing,
            normal_rms_deg: None,
            labels: Vec::new(),
            compared: Vec::new(),
            verified: None,
        }
    }

    /// With the bodies, and what was measured.
    pub fn with(
        mut self,
        labels: Vec<Body>,
        verified: Option<SmoothError>,
        compared: Vec<Judged>,
        normal_rms_deg: Option<Directions>,
    ) -> Self {
        if let Some(found) = &verified {
            let smallest = self.spacing.iter().copied().fold(f64::INFINITY, f64::min);
            // No point goes farther than the vertices of its triangle.
            let most = found.hausdorff_bound.min(self.hausdorff.voxels);
            self.hausdorff = Hausdorff::new(most * smallest, self.spacing, true);
        }
        Stats {
            labels,
            verified,
            compared,
            normal_rms_deg,
            ..self
        }
    }

    /// A few words on the result.
    pub fn summary(&self) -> String {
        let (vertices, triangles) = (self.vertices, self.triangles);
        let (steps, turned) = (self.smoothing.iterations, self.turned());
        format!("{vertices} vertices, {triangles} triangles, {steps} steps; {turned}")
    }

    /// How far the staircase went, in words.
    pub fn turned(&self) -> String {
        let turning = (self.smoothing.turning_before_deg).zip(self.smoothing.turning_after_deg);
        turning.map_or("no slices".to_owned(), |(before, after)| {
            format!("slices turn by {after:.1}°, {before:.1}° before")
        })
    }

    /// Voxels on the wrong side, of all labels.
    fn misclassified(&self) -> Option<u64> {
        if self.labels.is_empty() {
            return self.verified.as_ref()?.misclassified_voxels;
        }
        self.labels
            .iter()
            .map(|body| body.misclassified_voxels)
            .sum()
    }

    /// A voxel on the wrong side, where the constraint rules that out.
    pub fn wrong(&self, params: &Params) -> Option<String> {
        let count = self
            .misclassified()
            .filter(|n| *n > 0 && params.constraint.is_faithful())?;
        Some(format!("{count} voxels changed sides"))
    }

    /// The errors, the one of the trade first.
    pub fn accuracy(&self, params: &Params) -> Vec<Accuracy> {
        let measure = |measure: &str, unit: &str, bound, reached: Option<f64>, by: &str| Accuracy {
            measure: measure.to_owned(),
            unit: unit.to_owned(),
            bound,
            reached,
            reference: by.to_owned(),
            verified: reached.is_some(),
        };
        let verified = self.verified.as_ref();
        let off = self.smoothing.volume_after.zip(self.smoothing.voxels);
        vec![
            measure(
                smooth_mc::TRADE.error.name,
                smooth_mc::TRADE.error.unit,
                None,
                verified.and_then(|v| v.from_fairest),
                smooth_mc::TRADE.reference,
            ),
            measure(
                "voxels on another side",
                "voxel",
                params.constraint.is_faithful().then_some(0.0),
                self.misclassified().map(|n| n as f64),
                "a voxelization of the result",
            ),
            measure(
                "largest distance to the surface as it was",
                "voxel",
                Some(self.hausdorff.voxels),
                verified.map(|v| v.hausdorff),
                "the surface before smoothing",
            ),
            measure(
                "volume enclosed",
                "share of the voxels'",
                None,
                off.map(|(after, voxels)| (after / voxels as f64 - 1.0).abs())
                    .filter(|share| share.is_finite()),
                "the volume of the voxels",
            ),
        ]
    }
}
