//! Files: opening, telling formats apart, one reader or writer per format.
//!
//! Readers keep what a file holds, in its order, and never repair. They refuse what a header
//! claims but the bytes do not hold before they make room for it. A gzip layer is taken off
//! whatever the file is called. Nothing outside the named file is read, but for the data file
//! that a glTF, OBJ, NRRD, MetaImage or NIfTI header names in the same folder or below, and the files
//! that stand beside rasters and shapefiles under the same name.

pub mod ascii_grid;
mod base64;
pub mod binvox;
mod cloud;
pub mod format;
mod gather;
pub mod geojson;
pub mod geotiff;
pub mod gltf;
pub mod gpx;
mod header;
pub mod heights;
pub mod hgt;
mod holds;
mod hybrid36;
pub mod json;
pub mod las;
mod lost;
pub mod mdd;
pub mod metaimage;
pub mod mmcif;
pub mod nifti;
pub mod npy;
pub mod nrrd;
pub mod obj;
pub mod off;
pub mod pc2;
pub mod pcd;
pub mod pdb;
#[cfg(test)]
mod peers;
pub mod ply;
pub mod png;
mod pointcache;
pub mod pqr;
mod prj;
pub mod refusal;
mod samples;
mod sanim;
pub mod sequence;
pub mod shapefile;
pub mod sink;
mod sniff;
pub mod source;
pub mod splats;
pub mod stl;
pub mod svo;
mod text;
pub mod vdb;
pub mod vti;
mod wkt_csv;
mod world;
mod xml;
pub mod xyz;
pub mod xyzr;

#[cfg(test)]
mod roundtrip;
#[cfg(test)]
mod written_volume;

use crate::anim::Clip;
use crate::error::{Error, Fault, Result};
use crate::image::samples::Image;
use crate::mesh::Mesh;
use crate::points::Splats;
use crate::protein::Molecule;
use crate::report::{self, Input, Output, Tally, Warning};
use crate::terrain::Grid;
use crate::terrain::Transform;
use crate::terrain::style::Sheet;
use crate::vector::{Layer, Raised};
use crate::volume::Volume;
use crate::volume::bits::BitGrid;
use format::{Format, Kind};
use lost::{dropped, dropped_of_clip, dropped_of_molecule, dropped_of_splats, dropped_of_terrain};
use refusal::Refusal;
use serde_json::Value;
use sink::Sink;
use source::Source;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What a file holds, as one of the kinds that scantle knows.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Triangles, polylines, points.
    Mesh(Mesh),
    /// Discs with a field of normals.
    Splats(Splats),
    /// Voxels.
    Volume(Volume),
    /// Pixels.
    Image(Image),
    /// Atoms.
    Molecule(Molecule),
    /// A mesh, or a cloud, whose vertices move.
    Animation(Clip),
    /// Heights on a map.
    Terrain(Grid),
    /// Features on a map.
    Vectors(Layer),
    /// JSON documents, in the order of the file.
    Report(Vec<Value>),
}

impl Content {
    /// Its kind.
    pub fn kind(&self) -> Kind {
        match self {
            Content::Mesh(_) => Kind::Mesh,
            Content::Splats(_) => Kind::Splats,
            Content::Volume(_) => Kind::Volume,
            Content::Image(_) => Kind::Image,
            Content::Molecule(_) => Kind::Molecule,
            Content::Animation(_) => Kind::Animation,
            Content::Terrain(_) => Kind::Terrain,
            Content::Vectors(_) => Kind::Vectors,
            Content::Report(_) => Kind::Report,
        }
    }
}

/// Reads a file of any kind.
///
/// Returns what it holds, its line for the report, and counted warnings about what looks wrong. Errs
/// with [`Error::Malformed`] where the file is not what its format asks for, and with
/// [`Error::Limit`] where what it holds takes more memory than the source may use.
pub fn read(source: &Source, format: Option<Format>) -> Result<(Content, Input, Vec<Warning>)> {
    let malformed = |fault| Refusal::Fault(fault).of(source);
    if source.bytes().is_empty() {
        return Err(malformed(Fault::whole("the file is empty")));
    }
    let format = match format {
        Some(format) => format,
        None => format::sniff(source.bytes(), source.extension()).map_err(malformed)?,
    };
    let mut warnings = Vec::new();
    let (content, digest) =
        rayon::join(|| parse(source, format, &mut warnings), || source.sha256());
    let content = content.map_err(|refusal| refusal.of(source))?;
    let described = match &content {
        Content::Mesh(mesh) => mesh.content(),
        Content::Splats(splats) => splats::content(splats),
        Content::Volume(volume) => volume.content(),
        Content::Image(image) => image.content(),
        Content::Molecule(molecule) => molecule.content(),
        Content::Animation(clip) => clip.content(),
        Content::Terrain(grid) => grid.content(),
        Content::Vectors(layer) => layer.content(),
        Content::Report(documents) => report::Content {
            documents: Some(documents.len() as u64),
            ..report::Content::default()
        },
    };
    let input = input(source, format, digest, described);
    Ok((content, input, warnings))
}

/// The line of an input for the report.
fn input(source: &Source, format: Format, digest: String, content: report::Content) -> Input {
    Input {
        path: source.name().to_owned(),
        format: format.name().to_owned(),
        bytes: source.stored_bytes(),
        sha256: digest,
        content,
    }
}

fn parse(source: &Source, format: Format, warnings: &mut Vec<Warning>) -> Result<Content, Refusal> {
    let mut content = match format {
        Format::Obj => Content::Mesh(obj::read(source, warnings)?),
        Format::Ply => Content::Mesh(ply::read(source, warnings)?),
        Format::Stl => Content::Mesh(stl::read(source, warnings)?),
        Format::Off => Content::Mesh(off::read(source, warnings)?),
        Format::Gltf | Format::Glb => Content::Mesh(gltf::read(source, warnings)?),
        Format::Pcd => Content::Mesh(pcd::read(source, warnings)?),
        Format::Las | Format::Laz => Content::Mesh(las::read(source, warnings)?),
        Format::Xyz | Format::PointsCsv => Content::Mesh(xyz::read(source, warnings)?),
        Format::Splats => Content::Splats(splats::read(source, warnings)?),
        Format::Gaussians => Content::Splats(splats::read_gaussians(source, warnings)?),
        Format::Nrrd => Content::Volume(nrrd::read(source, warnings)?),
        Format::Mhd | Format::Mha => Content::Volume(metaimage::read(source, warnings)?),
        Format::Nifti => Content::Volume(nifti::read(source, warnings)?),
        Format::Npy => Content::Volume(npy::read(source, warnings)?),
        Format::Binvox => Content::Volume(binvox::read(source, warnings)?),
        Format::Svo => Content::Volume(svo::read(source, warnings)?),
        Format::Vti => Content::Volume(vti::read(source, warnings)?),
        Format::Png => Content::Image(png::read(source)?),
        Format::Pdb => Content::Molecule(pdb::read(source, warnings)?),
        Format::Cif => Content::Molecule(mmcif::read(source, warnings)?),
        Format::Pqr => Content::Molecule(pqr::read(source, warnings)?),
        Format::Xyzr => Content::Molecule(xyzr::read(source, warnings)?),
        Format::SpheresCsv => Content::Molecule(xyzr::read_csv(source, warnings)?),
        Format::Pc2 => Content::Animation(pc2::read(source, warnings)?),
        Format::Mdd => Content::Animation(mdd::read(source, warnings)?),
        Format::Sanim => Content::Animation(sanim::read(source, warnings)?),
        Format::GeoTiff => Content::Terrain(geotiff::read(source, warnings)?),
        Format::AsciiGrid => Content::Terrain(ascii_grid::read(source, warnings)?),
        Format::Hgt => Content::Terrain(hgt::read(source)?),
        Format::GeoJson => Content::Vectors(geojson::read(source, warnings)?),
        Format::Shapefile => Content::Vectors(shapefile::read(source, warnings)?),
        Format::WktCsv => Content::Vectors(wkt_csv::read(source, warnings)?),
        Format::Gpx => Content::Vectors(gpx::read(source, warnings)?),
        Format::Json => Content::Report(json::read(source, warnings)?),
        Format::Vdb => return Err(Fault::whole("vdb files are written, not read").into()),
    };
    match &mut content {
        Content::Mesh(mesh) => settle(mesh, source, warnings)?,
        Content::Splats(splats) => splats::check(splats)?,
        Content::Volume(volume) => volume.check()?,
        Content::Image(image) => image.check()?,
        Content::Molecule(molecule) => molecule.check()?,
        Content::Animation(clip) => clip.check()?,
        Content::Terrain(grid) => grid.check()?,
        Content::Vectors(layer) => layer.check()?,
        Content::Report(_) => {}
    }
    Ok(content)
}

/// Holds a mesh to what every reader promises, once bad points of a cloud are left out where the source
/// asks for that.
fn settle(mesh: &mut Mesh, source: &Source, warnings: &mut Vec<Warning>) -> Result<(), Fault> {
    if !mesh.is_cloud() {
        return mesh.check();
    }
    if source.skips_bad() {
        cloud::skip_bad(mesh, warnings);
        if mesh.positions.is_empty() {
            return Err(Fault::whole("holds no points that are finite"));
        }
    }
    mesh.check().map_err(|fault| fault.with_hint(cloud::SKIP))?;
    let normals = mesh.normals.iter().flatten().zip(0u64..);
    let mut zero = Tally::default();
    normals
        .filter(|(normal, _)| **normal == [0.0; 3])
        .for_each(|(_, v)| zero.note(v));
    zero.warn("zero-normals", "normals without a direction", warnings);
    Ok(())
}

/// The files beside an input that reading it opens too: those its header names.
///
/// None where the header is not sound: then nothing is read. Cost: that of the header, which is
/// all of a glTF document.
pub fn companions(source: &Source, format: Option<Format>) -> Vec<PathBuf> {
    let bytes = source.bytes();
    let sniffed = || format::sniff(bytes, source.extension()).ok();
    let there = |extensions: &[&str]| {
        let names = extensions.iter().filter_map(|e| source.sibling_name(e));
        names.collect()
    };
    let names = match format.or_else(sniffed) {
        Some(Format::Nrrd) => nrrd::named_file(bytes).into_iter().collect(),
        Some(Format::Mhd | Format::Mha) => metaimage::named_file(bytes).into_iter().collect(),
        Some(Format::Nifti) => nifti::named_file(source).into_iter().collect(),
        Some(Format::Gltf | Format::Glb) => gltf::named_files(bytes),
        Some(Format::Shapefile) => there(&shapefile::BESIDE),
        Some(Format::AsciiGrid | Format::WktCsv) => there(&["prj"]),
        Some(Format::GeoTiff) => there(geotiff::BESIDE),
        _ => Vec::new(),
    };
    let paths = names.iter().filter_map(|name| source.beside(name).ok());
    paths.collect()
}

/// The file that is written beside `path` when it is written in this format, if there is one.
pub fn written_beside(path: &Path, format: Format) -> Option<PathBuf> {
    (format == Format::Mhd).then(|| metaimage::data_path(path))
}

/// Reads a file of one of these kinds; a file of another kind is an error.
pub fn read_one_of(
    source: &Source,
    format: Option<Format>,
    kinds: &[Kind],
) -> Result<(Content, Input, Vec<Warning>)> {
    let read = read(source, format)?;
    match kinds.contains(&read.0.kind()) {
        true => Ok(read),
        false => Err(wrong_kind(source, &read.1.format, &read.0, kinds)),
    }
}

/// Reads a mesh; a file of another kind is an error.
pub fn read_mesh(source: &Source, format: Option<Format>) -> Result<(Mesh, Input, Vec<Warning>)> {
    match read(source, format)? {
        (Content::Mesh(mesh), input, warnings) => Ok((mesh, input, warnings)),
        (other, input, _) => Err(wrong_kind(source, &input.format, &other, &[Kind::Mesh])),
    }
}

/// Reads splats; a file of another kind is an error.
pub fn read_splats(
    source: &Source,
    format: Option<Format>,
) -> Result<(Splats, Input, Vec<Warning>)> {
    match read(source, format)? {
        (Content::Splats(splats), input, warnings) => Ok((splats, input, warnings)),
        (other, input, _) => Err(wrong_kind(source, &input.format, &other, &[Kind::Splats])),
    }
}

/// Reads a volume; a file of another kind is an error.
pub fn read_volume(
    source: &Source,
    format: Option<Format>,
) -> Result<(Volume, Input, Vec<Warning>)> {
    match read(source, format)? {
        (Content::Volume(volume), input, warnings) => Ok((volume, input, warnings)),
        (other, input, _) => Err(wrong_kind(source, &input.format, &other, &[Kind::Volume])),
    }
}

/// Reads an image; a file of another kind is an error.
pub fn read_image(source: &Source, format: Option<Format>) -> Result<(Image, Input, Vec<Warning>)> {
    match read(source, format)? {
        (Content::Image(image), input, warnings) => Ok((image, input, warnings)),
        (other, input, _) => Err(wrong_kind(source, &input.format, &other, &[Kind::Image])),
    }
}

/// Reads a molecule; a file of another kind is an error.
pub fn read_molecule(
    source: &Source,
    format: Option<Format>,
) -> Result<(Molecule, Input, Vec<Warning>)> {
    match read(source, format)? {
        (Content::Molecule(molecule), input, warnings) => Ok((molecule, input, warnings)),
        (other, input, _) => Err(wrong_kind(source, &input.format, &other, &[Kind::Molecule])),
    }
}

/// Reads heights on a map; a file of another kind is an error.
///
/// Grey images and arrays of two axes are heights too where `cell` says the width and height of their
/// cells.
pub fn read_terrain(
    source: &Source,
    format: Option<Format>,
    cell: Option<[f64; 2]>,
) -> Result<(Grid, Input, Vec<Warning>)> {
    let (content, mut input, warnings) = read(source, format)?;
    let refused = |refusal: Refusal| refusal.of(source);
    let grid = match (content, cell) {
        (Content::Terrain(grid), _) => return Ok((grid, input, warnings)),
        (Content::Image(image), Some(_)) => {
            heights::of_image(&image, cell).map_err(|fault| refused(fault.into()))?
        }
        (Content::Volume(volume), Some(_)) => {
            heights::of_volume(&volume, cell, source.limit()).map_err(refused)?
        }
        (other, None) if matches!(other, Content::Image(_) | Content::Volume(_)) => {
            let (found, format) = (other.kind().with_article(), &input.format);
            let fault = Fault::whole(format!(
                "holds {found} ({format}), whose cells have no size"
            ));
            let hint = "say how large a cell is, or use a format of terrain";
            return Err(refused(fault.with_hint(hint).into()));
        }
        (other, _) => {
            return Err(wrong_kind(source, &input.format, &other, &[Kind::Terrain]));
        }
    };
    grid.check().map_err(|fault| refused(fault.into()))?;
    input.content = grid.content();
    Ok((grid, input, warnings))
}

/// Reads features on a map; a file of another kind is an error.
pub fn read_vectors(
    source: &Source,
    format: Option<Format>,
) -> Result<(Layer, Input, Vec<Warning>)> {
    match read(source, format)? {
        (Content::Vectors(layer), input, warnings) => Ok((layer, input, warnings)),
        (other, input, _) => Err(wrong_kind(source, &input.format, &other, &[Kind::Vectors])),
    }
}

/// Reads an animation; a file of another kind is an error.
pub fn read_animation(
    source: &Source,
    format: Option<Format>,
) -> Result<(Clip, Input, Vec<Warning>)> {
    match read(source, format)? {
        (Content::Animation(clip), input, warnings) => Ok((clip, input, warnings)),
        (other, input, _) => Err(wrong_kind(
            source,
            &input.format,
            &other,
            &[Kind::Animation],
        )),
    }
}

/// Reads an animation of a glTF file, sampled `fps` times a second; see [`gltf::read_clip`].
///
/// `animation` names one or is its number, the first is taken without it. Errs for a file of any other
/// format too.
pub fn read_gltf_clip(
    source: &Source,
    format: Option<Format>,
    fps: f64,
    animation: Option<&str>,
) -> Result<(Clip, Input, Vec<Warning>)> {
    let failed = |refusal: Refusal| refusal.of(source);
    let format = match format {
        Some(format) => format,
        None => format::sniff(source.bytes(), source.extension()).map_err(|f| failed(f.into()))?,
    };
    if !matches!(format, Format::Gltf | Format::Glb) {
        let problem = format!("is {}, but glTF is needed", format.name());
        return Err(failed(Fault::whole(problem).into()));
    }
    let mut warnings = Vec::new();
    let clip = gltf::read_clip(source, fps, animation, &mut warnings).map_err(failed)?;
    clip.check().map_err(|fault| failed(fault.into()))?;
    let input = input(source, format, source.sha256(), clip.content());
    Ok((clip, input, warnings))
}

/// Reads JSON documents; a file of another kind is an error.
pub fn read_report(
    source: &Source,
    format: Option<Format>,
) -> Result<(Vec<Value>, Input, Vec<Warning>)> {
    match read(source, format)? {
        (Content::Report(documents), input, warnings) => Ok((documents, input, warnings)),
        (other, input, _) => Err(wrong_kind(source, &input.format, &other, &[Kind::Report])),
    }
}

fn wrong_kind(source: &Source, format: &str, found: &Content, wanted: &[Kind]) -> Error {
    let wanted: Vec<_> = wanted.iter().map(|kind| kind.with_article()).collect();
    let (found, wanted) = (found.kind().with_article(), wanted.join(" or "));
    let fault = Fault::whole(format!("holds {found} ({format}), but {wanted} is needed"));
    Refusal::Fault(fault).of(source)
}

/// Writes a mesh. Returns the lines for the report and warnings about what the format cannot hold.
pub fn write_mesh(mesh: &Mesh, sink: &Sink, format: Format) -> Result<(Vec<Output>, Vec<Warning>)> {
    let writer: fn(&Mesh, &mut dyn Write) -> std::io::Result<()> = match format {
        Format::Obj => obj::write,
        Format::Ply => ply::write,
        Format::Stl => stl::write,
        Format::Off => off::write,
        Format::Glb => gltf::write,
        Format::Pcd => pcd::write,
        Format::Las => las::write,
        Format::Laz => las::write_packed,
        Format::Xyz => xyz::write,
        Format::PointsCsv => xyz::write_csv,
        _ => return Err(cannot_hold(format, Kind::Mesh)),
    };
    let output = sink.write(format, |out| writer(mesh, out))?;
    Ok((vec![output], dropped(mesh, format)))
}

/// Writes splats. Returns the lines for the report and warnings about what the format cannot hold.
pub fn write_splats(
    splats: &Splats,
    sink: &Sink,
    format: Format,
) -> Result<(Vec<Output>, Vec<Warning>)> {
    let writer: fn(&Splats, &mut dyn Write) -> std::io::Result<()> = match format {
        Format::Splats => splats::write,
        Format::Gaussians => splats::write_gaussians,
        _ => return Err(cannot_hold(format, Kind::Splats)),
    };
    let output = sink.write(format, |out| writer(splats, out))?;
    Ok((vec![output], dropped_of_splats(splats, format)))
}

/// Writes an image. Returns the lines for the report; nothing is lost.
pub fn write_image(image: &Image, sink: &Sink, format: Format) -> Result<Vec<Output>> {
    match format {
        Format::Png => Ok(vec![sink.write(format, |out| png::write(image, out))?]),
        _ => Err(cannot_hold(format, Kind::Image)),
    }
}

/// Writes a picture that may have a place on the map: then a file beside it says where its pixels are,
/// for all but standard output.
pub fn write_map(
    image: &Image,
    place: Option<&Transform>,
    sink: &Sink,
    format: Format,
) -> Result<Vec<Output>> {
    let mut outputs = write_image(image, sink, format)?;
    if let (Some(transform), Sink::File(path)) = (place, sink) {
        let beside = Sink::File(path.with_extension("pgw"));
        let text = world::write(transform);
        outputs.push(beside.write_as("world", |out| out.write_all(text.as_bytes()))?);
    }
    Ok(outputs)
}

/// Writes a raster of one band on the map.
pub fn write_raster(raster: &geotiff::Raster, sink: &Sink, format: Format) -> Result<Vec<Output>> {
    match format {
        Format::GeoTiff => Ok(vec![
            sink.write(format, |out| geotiff::write_raster(raster, out))?,
        ]),
        _ => Err(cannot_hold(format, Kind::Terrain)),
    }
}

/// Reads a style sheet; see [`Sheet`].
pub fn read_style(source: &Source) -> Result<(Sheet, Input)> {
    let refused = |fault: Fault| Refusal::from(fault).of(source);
    let text = std::str::from_utf8(source.bytes())
        .map_err(|error| refused(Fault::byte(error.valid_up_to(), "is no UTF-8 text")))?;
    let sheet = Sheet::from_json(text).map_err(refused)?;
    let content = report::Content {
        documents: Some(1),
        ..report::Content::default()
    };
    Ok((sheet, input(source, Format::Json, source.sha256(), content)))
}

/// Writes a molecule. Returns the lines for the report and warnings about what the format cannot hold.
///
/// Formats of spheres alone take the first model, with the radii of the elements where atoms have none
/// of their own.
pub fn write_molecule(
    molecule: &Molecule,
    sink: &Sink,
    format: Format,
) -> Result<(Vec<Output>, Vec<Warning>)> {
    let writer: fn(&Molecule, &mut dyn Write) -> std::io::Result<()> = match format {
        Format::Pdb => pdb::write,
        Format::Cif => mmcif::write,
        Format::Xyzr => xyzr::write,
        Format::SpheresCsv => xyzr::write_csv,
        _ => return Err(cannot_hold(format, Kind::Molecule)),
    };
    if let Some(problem) = pdb::refusal(molecule).filter(|_| format == Format::Pdb) {
        return Err(Error::parameter("output-format", format.name(), problem));
    }
    let output = sink.write(format, |out| writer(molecule, out))?;
    Ok((vec![output], dropped_of_molecule(molecule, format)))
}

/// Writes heights. Returns the lines for the report and warnings about what the format cannot hold.
pub fn write_terrain(
    grid: &Grid,
    sink: &Sink,
    format: Format,
) -> Result<(Vec<Output>, Vec<Warning>)> {
    let writer: fn(&Grid, &mut dyn Write) -> std::io::Result<()> = match format {
        Format::GeoTiff => geotiff::write,
        Format::AsciiGrid => ascii_grid::write,
        _ => return Err(cannot_hold(format, Kind::Terrain)),
    };
    if let Some(problem) = ascii_grid::refusal(grid).filter(|_| format == Format::AsciiGrid) {
        return Err(Error::parameter("output-format", format.name(), problem));
    }
    let output = sink.write(format, |out| writer(grid, out))?;
    Ok((vec![output], dropped_of_terrain(grid, format)))
}

/// Writes features. Returns the lines for the report; nothing is lost.
pub fn write_vectors(layer: &Layer, sink: &Sink, format: Format) -> Result<Vec<Output>> {
    match format {
        Format::GeoJson => Ok(vec![sink.write(format, |out| geojson::write(layer, out))?]),
        _ => Err(cannot_hold(format, Kind::Vectors)),
    }
}

/// Writes features with other shapes, which have heights; see [`geojson::write_raised`].
pub fn write_raised_vectors(
    layer: &Layer,
    shapes: &[Raised],
    sink: &Sink,
    format: Format,
) -> Result<Vec<Output>> {
    match format {
        Format::GeoJson => {
            let output = sink.write(format, |out| geojson::write_raised(layer, shapes, out))?;
            Ok(vec![output])
        }
        _ => Err(cannot_hold(format, Kind::Vectors)),
    }
}

/// Writes an animation in one file: a cache of points, or GLB. Returns the lines for the report and
/// warnings about what the format cannot hold.
pub fn write_animation(
    clip: &Clip,
    sink: &Sink,
    format: Format,
) -> Result<(Vec<Output>, Vec<Warning>)> {
    let writer: fn(&Clip, &mut dyn Write) -> std::io::Result<()> = match format {
        Format::Pc2 => pc2::write,
        Format::Mdd => mdd::write,
        Format::Glb => gltf::write_clip,
        Format::Sanim => {
            let problem = "is made by `compress-anim encode`, to an error that is asked for";
            return Err(Error::parameter("output-format", format.name(), problem));
        }
        _ => return Err(cannot_hold(format, Kind::Animation)),
    };
    let output = sink.write(format, |out| writer(clip, out))?;
    Ok((vec![output], dropped_of_clip(clip, format)))
}

/// Writes a volume. MHD writes two files: the header and, beside it, the data.
///
/// Formats that hold bits only take numbers too where all of them are 0 or 1; they then cost a
/// copy of one bit each.
pub fn write_volume(
    volume: &Volume,
    sink: &Sink,
    format: Format,
) -> Result<(Vec<Output>, Vec<Warning>)> {
    let writer: fn(&Volume, &mut dyn Write) -> std::io::Result<()> = match format {
        Format::Nrrd => nrrd::write,
        Format::Mha => metaimage::write,
        Format::Mhd => {
            return metaimage::write_pair(volume, sink).map(|outputs| (outputs, Vec::new()));
        }
        Format::Nifti => nifti::write,
        Format::Npy => npy::write,
        Format::Binvox => binvox::write,
        Format::Vti => vti::write,
        Format::Vdb => vdb::write,
        Format::Svo => svo::write,
        _ => return Err(cannot_hold(format, Kind::Volume)),
    };
    let packed = match format {
        Format::Svo | Format::Vdb | Format::Binvox => samples::as_bits(volume),
        _ => None,
    };
    let volume = packed.as_ref().unwrap_or(volume);
    if let Some(problem) = refusal(volume, format) {
        return Err(Error::parameter("output-format", format.name(), problem));
    }
    let output = sink.write(format, |out| writer(volume, out))?;
    Ok((vec![output], Vec::new()))
}

/// Bytes held while a volume is written, beside the volume itself: what is copied or expanded at a
/// time. A sparse grid of large sides needs room where the format is dense.
pub fn room_to_write(volume: &Volume, format: Format) -> u128 {
    let dims @ [_, ny, nz] = volume.frame.dims;
    let packed = match format {
        Format::Svo | Format::Vdb | Format::Binvox if !volume.is_binary() => {
            BitGrid::bytes_for(dims)
        }
        _ => 0,
    };
    let at_a_time = match format {
        Format::Binvox => BitGrid::bytes_for([ny, nz, binvox::PLANES]),
        Format::Svo | Format::Vdb => 0,
        _ if volume.is_binary() => samples::slab_bytes(dims),
        _ => 0,
    };
    packed + at_a_time
}

/// Why a volume cannot be held by a format, if it cannot.
fn refusal(volume: &Volume, format: Format) -> Option<String> {
    let binary = volume.is_binary();
    match format {
        Format::Svo | Format::Vdb | Format::Binvox if !binary => Some(format!(
            "holds bits only, and the voxels are {} with values other than 0 and 1",
            volume.data.sample_type()
        )),
        Format::Binvox => binvox::refusal(volume),
        Format::Svo if !volume.frame.is_straight() => {
            Some("holds grids along the coordinate axes only".into())
        }
        _ => None,
    }
}

/// The error of a format that a kind of thing cannot be written to.
fn cannot_hold(format: Format, kind: Kind) -> Error {
    Error::parameter(
        "output-format",
        format.name(),
        format!("does not hold {}, or is not written", kind.with_article()),
    )
}
