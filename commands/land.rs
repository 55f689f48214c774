//! Land and the features on it, as commands read them: one terrain and any number of layers.

use crate::job::Job;
use crate::shared::parsed;
use clap::Args;
use scantle::error::{Error, Fault, Result};
use scantle::report::Warning;
use scantle::terrain::Grid;
use scantle::terrain::surface::{Kind, Surface};
use scantle::vector::crs::{Crs, Reprojector};
use scantle::vector::{Layer, Polygon, Shape, Vec2};

/// Where land and features are read from.
#[derive(Debug, Args)]
pub struct Land {
    /// Heights on a map: GeoTIFF, ESRI grid, HGT; with --cell also a 16-bit PNG or an NPY array
    #[arg(long, value_name = "DEM")]
    terrain: String,
    /// Features on a map, in any number of files: GeoJSON, shapefiles, CSV of well-known text, GPX
    #[arg(
        long,
        value_name = "FILE[,FILE...]",
        value_delimiter = ',',
        required = true
    )]
    vectors: Vec<String>,
    /// Width and height of a cell, for terrain that does not say
    #[arg(long, value_name = "W,H", value_parser = parsed(cell, "two numbers above 0 such as 30,30"))]
    cell: Option<[f64; 2]>,
    /// The surface between heights: `tin`, two triangles for each square of them, parted from the lower
    /// left to the upper right; `bilinear`, a patch for each square
    #[arg(long, value_name = "SURFACE", default_value = "tin", value_parser = crate::shared::named(&["tin", "bilinear"], kind))]
    surface: Kind,
}

fn cell(text: &str) -> Option<[f64; 2]> {
    let (width, height) = text.split_once(',')?;
    let length = |text: &str| text.trim().parse::<f64>().ok();
    let sides = [length(width)?, length(height)?];
    sides
        .iter()
        .all(|s| *s > 0.0 && s.is_finite())
        .then_some(sides)
}

fn kind(name: &str) -> Option<Kind> {
    match name {
        "tin" => Some(Kind::Tin),
        "bilinear" => Some(Kind::Bilinear),
        _ => None,
    }
}

impl Land {
    /// The files: the terrain, then the layers.
    pub fn words(&self) -> Vec<String> {
        let all = std::iter::once(&self.terrain).chain(&self.vectors);
        all.cloned().collect()
    }

    /// The surface between heights.
    pub fn surface(&self) -> Kind {
        self.surface
    }

    /// The surface of the terrain; errs, naming its file, where it has none.
    pub fn surface_of<'a>(&self, grid: &'a Grid) -> Result<Surface<'a>> {
        Surface::new(grid, self.surface).map_err(|error| match error {
            Error::Geometry(fault) => of_file(&self.terrain, fault),
            other => other,
        })
    }

    /// Reads all, with the layers in the reference system of the terrain.
    ///
    /// Errs where a layer is in another system from which there is no way, and names both.
    pub fn read(&self, job: &mut Job) -> Result<(Grid, Vec<Layer>)> {
        let grid = job.read_terrain(self.cell)?;
        if grid.crs.is_none() {
            let message = "the terrain does not say what its coordinates mean; layers are taken to be \
                           in the same system";
            job.warn(vec![Warning::new("no-crs", message, 1, None)]);
        }
        if grid.crs.as_ref().and_then(Crs::is_geographic) == Some(true) {
            let message = "the terrain is in degrees, its heights are not: slopes, lengths and areas are \
                           of no unit; reproject it first";
            job.warn(vec![Warning::new("degrees", message, 1, None)]);
        }
        let mut layers = Vec::with_capacity(self.vectors.len());
        for word in &self.vectors {
            let layer = job.read_vectors()?;
            layers.push(in_system_of(&grid, layer, word, job)?);
        }
        Ok((grid, layers))
    }
}

/// A layer in the reference system of the terrain.
fn in_system_of(grid: &Grid, layer: Layer, word: &str, job: &mut Job) -> Result<Layer> {
    let (Some(to), Some(from)) = (&grid.crs, &layer.crs) else {
        if grid.crs.is_some() {
            let message = "does not say what its coordinates mean; they are taken to be those of the \
                           terrain";
            job.warn(vec![Warning::new(
                "no-crs",
                format!("{word}: {message}"),
                1,
                None,
            )]);
        }
        return Ok(layer);
    };
    if from.same(to) {
        return Ok(layer);
    }
    let way = Reprojector::new(from, to).map_err(|error| match error {
        Error::Geometry(fault) => of_file(word, fault),
        other => other,
    })?;
    if way.is_identity() {
        return Ok(layer);
    }
    let count = layer.features.len() as u64;
    let message = format!("{word}: features are brought from {from} to {to}");
    job.warn(vec![Warning::new("reprojected", message, count, None)]);
    reprojected(layer, &way, to, word)
}

fn of_file(word: &str, fault: Fault) -> Error {
    Error::Malformed {
        path: word.into(),
        fault,
    }
}

fn reprojected(layer: Layer, way: &Reprojector, to: &Crs, word: &str) -> Result<Layer> {
    let mut out = Layer {
        crs: Some(to.clone()),
        name: layer.name,
        features: layer.features,
    };
    for (number, feature) in out.features.iter_mut().enumerate() {
        let mut place = |p: &mut Vec2| match way.apply(*p) {
            Some(q) => {
                *p = q;
                Ok(())
            }
            None => {
                let problem = format!("{p:?} has no place in {to}");
                Err(of_file(word, Fault::element("feature", number, problem)))
            }
        };
        match &mut feature.shape {
            Shape::Empty => {}
            Shape::Points(points) => points.iter_mut().try_for_each(&mut place)?,
            Shape::Lines(lines) => lines.iter_mut().flatten().try_for_each(&mut place)?,
            Shape::Polygons(areas) => {
                let rings = areas.iter_mut().flat_map(|Polygon { rings }| rings);
                rings.flatten().try_for_each(&mut place)?;
            }
        }
    }
    Ok(out)
}
