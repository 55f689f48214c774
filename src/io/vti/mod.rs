//! VTK image data in XML.
//!
//! Samples are at the points of an image, which are then the centres of voxels, or in its cells,
//! which then are the voxels: the first has its centre half a step from the corner at `Origin`.
//! `Direction` holds the axes as columns. An extent may begin anywhere; `Origin` is the place of
//! the point (0, 0, 0) even where that is not in it. Axes of one point have one cell, in their
//! plane. Files are written with cells, so that viewers show voxels as boxes: nx x ny x nz of them
//! have one point more along each axis. Source: Kitware, "VTK XML Formats".

mod data;
mod document;

use super::header::join;
use super::refusal::{RAISE, Refusal, expect_room};
use super::samples::{self, SampleType};
use crate::io::source::Source;
use crate::numeric::vector::{add, normalize, scale};
use crate::report::Warning;
use crate::volume::{Data, Volume};
use document::Image;
use std::io::{self, Write};

/// Reads a volume of one sample at each point or in each cell: as text, base64 or raw, inline or
/// appended, as it is or packed with zlib, of both byte orders.
///
/// It is the array that `Scalars` names, of the points before that of the cells; else the first
/// array of one component. Others are left out with a warning. Errs where the document is no XML or
/// no image in one piece, and where an array holds more or less than the image asks for; no room is
/// made before. A file that [`write()`] made comes back as it was, its place to the last digit of
/// the coordinates of its corner. Cost: linear in the bytes.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Volume, Refusal> {
    let image = Image::parse(source.bytes())?;
    let array = image.chosen(warnings)?;
    let sample = array.sample_type()?;
    let sizes = image.sizes(array.place);
    let (dims, wanted) = samples::extent(sizes, sample.bytes())?;
    let [x, y, z] = sizes;
    let what = || format!("a grid of {x} x {y} x {z} voxels");
    expect_room(what, wanted as u128, source.limit(), RAISE)?;
    let data = if array.is_text() {
        samples::decode_text(&array.text, sample, wanted / sample.bytes())?
    } else {
        let bytes = data::bytes(&image, array, wanted)?;
        match sample {
            SampleType::U8 => Data::U8(bytes.into_owned()),
            _ => samples::decode(&bytes, sample, image.order),
        }
    };
    let frame = image.frame(array.place, dims);
    Ok(Volume { frame, data })
}

/// Whether a text begins as a VTK file in XML does.
pub fn is_document(text: &[u8]) -> bool {
    document::is_document(text)
}

/// Writes a volume as the cell data `voxels`, appended raw and little endian; bits as bytes of 0
/// and 1.
///
/// Axes that are turned are given in `Direction`, whose columns they are. Bits are expanded a few
/// slices at a time.
pub fn write(volume: &Volume, out: &mut dyn Write) -> io::Result<()> {
    let frame = &volume.frame;
    let [nx, ny, nz] = frame.dims;
    let kind = match SampleType::of(&volume.data) {
        SampleType::U8 => "UInt8",
        SampleType::I8 => "Int8",
        SampleType::U16 => "UInt16",
        SampleType::I16 => "Int16",
        SampleType::U32 => "UInt32",
        SampleType::I32 => "Int32",
        SampleType::U64 => "UInt64",
        SampleType::I64 => "Int64",
        SampleType::F32 => "Float32",
        SampleType::F64 => "Float64",
    };
    let corner = frame
        .axes
        .iter()
        .fold(frame.origin, |p, axis| add(p, scale(*axis, -0.5)));
    let direction = if frame.is_straight() {
        String::new()
    } else {
        let axes = frame.axes.map(normalize);
        let rows: [[f64; 3]; 3] = std::array::from_fn(|row| axes.map(|axis| axis[row]));
        format!(" Direction=\"{}\"", join(rows.as_flattened(), " "))
    };
    write!(
        out,
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <ImageData WholeExtent=\"0 {nx} 0 {ny} 0 {nz}\" Origin=\"{}\" Spacing=\"{}\"{direction}>\n\
         <Piece Extent=\"0 {nx} 0 {ny} 0 {nz}\">\n\
         <CellData Scalars=\"voxels\">\n\
         <DataArray type=\"{kind}\" Name=\"voxels\" format=\"appended\" offset=\"0\"/>\n\
         </CellData>\n\
         </Piece>\n\
         </ImageData>\n\
         <AppendedData encoding=\"raw\">\n_",
        join(&corner, " "),
        join(&frame.spacing(), " "),
    )?;
    out.write_all(&samples::raw_length(volume).to_le_bytes())?;
    samples::write_raw(volume, out)?;
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}

#[cfg(test)]
mod tests;
