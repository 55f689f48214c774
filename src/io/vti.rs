//! VTK image data in XML, written for viewers; not read.
//!
//! Voxels are cells: an image of nx x ny x nz cells has one point more along each axis, and its
//! `Origin` is the lower corner of voxel (0, 0, 0), half a step before the centre that a
//! [`Frame`](crate::volume::Frame) holds. Source: Kitware, "VTK XML Formats".

use super::header::join;
use super::samples::{self, SampleType};
use crate::numeric::vector::{add, normalize, scale};
use crate::volume::Volume;
use std::io::{self, Write};

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
mod tests {
    use super::*;
    use crate::volume::{Data, Frame};

    #[test]
    fn the_header_places_cells_and_the_data_follows_its_length() {
        let mut volume = Volume {
            frame: Frame::straight([2, 1, 1], [10.0, 20.0, 30.0], [2.0, 4.0, 8.0]),
            data: Data::I16(vec![-1, 2]),
        };
        let mut bytes = Vec::new();
        write(&volume, &mut bytes).unwrap();
        let start = bytes.windows(2).position(|w| w == b"\n_").unwrap() + 1;
        let header = std::str::from_utf8(&bytes[..start]).unwrap();
        assert!(header.contains(
            "<ImageData WholeExtent=\"0 2 0 1 0 1\" Origin=\"9 18 26\" Spacing=\"2 4 8\">"
        ));
        assert!(header.contains("type=\"Int16\" Name=\"voxels\""));
        assert_eq!(
            &bytes[start + 1..start + 13],
            &[4, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 2, 0]
        );
        assert!(bytes[start + 13..].starts_with(b"\n</AppendedData>"));
        volume.frame.axes = [[0.0, 2.0, 0.0], [-4.0, 0.0, 0.0], [0.0, 0.0, 8.0]];
        bytes.clear();
        write(&volume, &mut bytes).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(
            text.contains("Origin=\"12 19 26\" Spacing=\"2 4 8\" Direction=\"0 -1 0 1 0 0 0 0 1\"")
        );
    }
}
