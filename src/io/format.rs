//! The formats, and telling them apart.

use crate::error::Fault;

/// The kinds of things a file can hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Triangles, polylines, points.
    Mesh,
    /// Discs with a field of normals.
    Splats,
    /// Voxels.
    Volume,
    /// Pixels.
    Image,
    /// Atoms.
    Molecule,
    /// A mesh, or a cloud, whose vertices move.
    Animation,
    /// What commands report, or any other JSON documents.
    Report,
}

impl Kind {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Mesh => "mesh",
            Kind::Splats => "splats",
            Kind::Volume => "volume",
            Kind::Image => "image",
            Kind::Molecule => "molecule",
            Kind::Animation => "animation",
            Kind::Report => "report",
        }
    }

    /// The name after `a` or `an`.
    pub fn with_article(self) -> &'static str {
        match self {
            Kind::Mesh => "a mesh",
            Kind::Splats => "a set of splats",
            Kind::Volume => "a volume",
            Kind::Image => "an image",
            Kind::Molecule => "a molecule",
            Kind::Animation => "an animation",
            Kind::Report => "a report",
        }
    }
}

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// Wavefront OBJ.
    Obj,
    /// Stanford PLY.
    Ply,
    /// STL.
    Stl,
    /// Object File Format.
    Off,
    /// glTF 2.0, JSON.
    Gltf,
    /// glTF 2.0, binary.
    Glb,
    /// Point Cloud Data of the Point Cloud Library.
    Pcd,
    /// Laser scans as the ASPRS exchanges them.
    Las,
    /// Laser scans packed by LASzip.
    Laz,
    /// Points, of words.
    Xyz,
    /// Points, of words parted by commas.
    PointsCsv,
    /// scantle's PLY of splats.
    Splats,
    /// PLY of 3D Gaussians.
    Gaussians,
    /// Nearly Raw Raster Data.
    Nrrd,
    /// MetaImage header with a data file.
    Mhd,
    /// MetaImage in one file.
    Mha,
    /// NIfTI-1 and NIfTI-2.
    Nifti,
    /// NumPy array.
    Npy,
    /// binvox.
    Binvox,
    /// VTK image data, XML.
    Vti,
    /// OpenVDB.
    Vdb,
    /// scantle's sparse voxel octree.
    Svo,
    /// Portable Network Graphics.
    Png,
    /// Protein Data Bank, of fixed columns.
    Pdb,
    /// Macromolecular Crystallographic Information File.
    Cif,
    /// PDB with charges and radii, of words.
    Pqr,
    /// Centres and radii, of words.
    Xyzr,
    /// Centres and radii, of words parted by commas.
    SpheresCsv,
    /// POINTCACHE2, a cache of points.
    Pc2,
    /// MDD, a cache of points.
    Mdd,
    /// scantle's stream of an animation.
    Sanim,
    /// JSON and JSON Lines.
    Json,
}

/// What of a mesh a format can hold beside triangles.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
pub struct Holds {
    pub faces: bool,
    pub polygons: bool,
    pub segments: bool,
    pub points: bool,
    pub normals: bool,
    pub colors: bool,
    pub classes: bool,
}

impl Holds {
    /// Triangles alone.
    const TRIANGLES: Holds = Holds {
        faces: true,
        polygons: false,
        segments: false,
        points: false,
        normals: false,
        colors: false,
        classes: false,
    };
    /// Vertices alone, with what they carry.
    const CLOUD: Holds = Holds {
        faces: false,
        points: true,
        normals: true,
        colors: true,
        classes: true,
        ..Holds::TRIANGLES
    };
}

/// A row of the table of formats.
struct Row {
    format: Format,
    name: &'static str,
    extensions: &'static [&'static str],
    kind: Kind,
    read: bool,
    write: bool,
    about: &'static str,
}

const fn row(
    format: Format,
    extensions: &'static [&'static str],
    kind: Kind,
    (read, write): (bool, bool),
    about: &'static str,
) -> Row {
    Row {
        format,
        name: extensions[0],
        extensions,
        kind,
        read,
        write,
        about,
    }
}

const TABLE: &[Row] = &[
    row(
        Format::Obj,
        &["obj"],
        Kind::Mesh,
        (true, true),
        "Wavefront OBJ: faces, lines and points",
    ),
    row(
        Format::Ply,
        &["ply"],
        Kind::Mesh,
        (true, true),
        "Stanford PLY, ascii and binary of both byte orders; written binary",
    ),
    row(
        Format::Stl,
        &["stl"],
        Kind::Mesh,
        (true, true),
        "STL, ascii and binary; written binary",
    ),
    row(
        Format::Off,
        &["off", "coff"],
        Kind::Mesh,
        (true, true),
        "OFF and its variants with colours and normals",
    ),
    row(
        Format::Gltf,
        &["gltf"],
        Kind::Mesh,
        (true, false),
        "glTF 2.0: all nodes of the default scene, placed",
    ),
    row(
        Format::Glb,
        &["glb"],
        Kind::Mesh,
        (true, true),
        "glTF 2.0 in one binary file",
    ),
    row(
        Format::Pcd,
        &["pcd"],
        Kind::Mesh,
        (true, true),
        "PCD, point clouds in ascii, binary and binary_compressed; written binary",
    ),
    row(
        Format::Las,
        &["las"],
        Kind::Mesh,
        (true, true),
        "LAS 1.0 to 1.4, point formats 0 to 10; written as 1.4",
    ),
    row(
        Format::Laz,
        &["laz"],
        Kind::Mesh,
        (true, true),
        "LAZ: LAS whose points are packed by LASzip",
    ),
    row(
        Format::Xyz,
        &["xyz", "xyzn", "pts", "asc", "txt"],
        Kind::Mesh,
        (true, true),
        "XYZ: a point on each line, with a normal, a colour or both",
    ),
    Row {
        name: "points-csv",
        ..row(
            Format::PointsCsv,
            &["csv"],
            Kind::Mesh,
            (true, true),
            "points whose columns have names: x, y, z, nx, ny, nz, red, green, blue, classification",
        )
    },
    Row {
        name: "splats",
        ..row(
            Format::Splats,
            &["ply"],
            Kind::Splats,
            (true, true),
            "scantle's PLY of discs with a field of normals",
        )
    },
    Row {
        name: "gaussians",
        ..row(
            Format::Gaussians,
            &["ply"],
            Kind::Splats,
            (true, true),
            "PLY of 3D Gaussians of degree 0, in single precision",
        )
    },
    row(
        Format::Nrrd,
        &["nrrd"],
        Kind::Volume,
        (true, true),
        "NRRD, raw, gzip and ascii; written raw",
    ),
    row(
        Format::Mhd,
        &["mhd"],
        Kind::Volume,
        (true, true),
        "MetaImage: a header and a data file",
    ),
    row(
        Format::Mha,
        &["mha"],
        Kind::Volume,
        (true, true),
        "MetaImage in one file",
    ),
    row(
        Format::Nifti,
        &["nii"],
        Kind::Volume,
        (true, true),
        "NIfTI-1 and NIfTI-2, in one file or a pair; written in one",
    ),
    row(
        Format::Npy,
        &["npy"],
        Kind::Volume,
        (true, true),
        "NumPy array of three dimensions, indexed [z, y, x]",
    ),
    row(
        Format::Binvox,
        &["binvox"],
        Kind::Volume,
        (true, true),
        "binvox: bits of a cubic grid, run-length coded",
    ),
    row(
        Format::Vti,
        &["vti"],
        Kind::Volume,
        (true, true),
        "VTK image data in XML, ascii, base64 and appended, with zlib or none; written appended",
    ),
    row(
        Format::Vdb,
        &["vdb"],
        Kind::Volume,
        (false, true),
        "OpenVDB, a grid of bool",
    ),
    row(
        Format::Svo,
        &["svo"],
        Kind::Volume,
        (true, true),
        "scantle's sparse voxel octree: 8-bit child masks, breadth first",
    ),
    row(
        Format::Png,
        &["png"],
        Kind::Image,
        (true, true),
        "PNG: grey, colour and palette of up to 16 bits, with or without opacity",
    ),
    row(
        Format::Pdb,
        &["pdb", "ent", "pdb1"],
        Kind::Molecule,
        (true, true),
        "Protein Data Bank: atoms in fixed columns, and in hybrid-36 where numbers are large",
    ),
    row(
        Format::Cif,
        &["cif", "mmcif"],
        Kind::Molecule,
        (true, true),
        "PDBx/mmCIF: the atoms of its first data block that has any",
    ),
    row(
        Format::Pqr,
        &["pqr"],
        Kind::Molecule,
        (true, false),
        "PQR: atoms with charge and radius, parted by blanks; charges are not read",
    ),
    row(
        Format::Xyzr,
        &["xyzr"],
        Kind::Molecule,
        (true, true),
        "XYZR: centre and radius of a sphere on each line",
    ),
    Row {
        name: "spheres-csv",
        ..row(
            Format::SpheresCsv,
            &["csv"],
            Kind::Molecule,
            (true, true),
            "columns x, y, z, r, with a line of names or without",
        )
    },
    row(
        Format::Pc2,
        &["pc2"],
        Kind::Animation,
        (true, true),
        "POINTCACHE2: positions of points, frame by frame",
    ),
    row(
        Format::Mdd,
        &["mdd"],
        Kind::Animation,
        (true, true),
        "MDD: positions of points, frame by frame, with the time of each",
    ),
    row(
        Format::Sanim,
        &["sanim"],
        Kind::Animation,
        (true, true),
        "scantle's stream of an animation, made by `compress-anim encode`",
    ),
    row(
        Format::Json,
        &["json", "jsonl"],
        Kind::Report,
        (true, false),
        "JSON and JSON Lines: what every command reports in, and any other documents",
    ),
];

/// Formats whose extension is that of another, which is the one that it tells.
const SHARING: [Format; 3] = [Format::PointsCsv, Format::Splats, Format::Gaussians];

impl Format {
    /// All formats, in the order of the table.
    pub fn all() -> impl Iterator<Item = Format> {
        TABLE.iter().map(|row| row.format)
    }

    fn row(self) -> &'static Row {
        TABLE
            .iter()
            .find(|row| row.format == self)
            .expect("every format has a row")
    }

    /// The name used by options and reports.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// File name extensions, the usual one first.
    pub fn extensions(self) -> &'static [&'static str] {
        self.row().extensions
    }

    /// What it holds.
    pub fn kind(self) -> Kind {
        self.row().kind
    }

    /// Whether its volumes have a place in space; those without are read as if at the origin.
    pub fn holds_place(self) -> bool {
        self != Format::Npy
    }

    /// Whether it is read.
    pub fn is_read(self) -> bool {
        self.row().read
    }

    /// Whether it is written.
    pub fn is_written(self) -> bool {
        self.row().write
    }

    /// One line about it.
    pub fn about(self) -> &'static str {
        self.row().about
    }

    /// The format of a name.
    pub fn from_name(name: &str) -> Option<Format> {
        TABLE
            .iter()
            .find(|row| row.name == name)
            .map(|row| row.format)
    }

    /// The format of a file name extension, in any case; see [`Format::holding`] for the extensions that
    /// formats of several kinds share.
    pub fn from_extension(extension: &str) -> Option<Format> {
        let wanted = extension.to_ascii_lowercase();
        TABLE
            .iter()
            .map(|row| (row.format, row.extensions))
            .filter(|(format, _)| !SHARING.contains(format))
            .find(|(_, extensions)| extensions.contains(&wanted.as_str()))
            .map(|(format, _)| format)
    }

    /// This format, or the one that files of its extension are in where they hold another kind.
    ///
    /// `.csv` may be of spheres or of points, `.ply` of a mesh or of splats.
    pub fn holding(self, kind: Kind) -> Format {
        match (self, kind) {
            (Format::Ply, Kind::Splats) => Format::Splats,
            (Format::SpheresCsv, Kind::Mesh) => Format::PointsCsv,
            _ => self,
        }
    }

    /// What a mesh may have beside triangles and be held by the writer of this format.
    pub fn holds(self) -> Holds {
        match self {
            Format::Obj => Holds {
                polygons: true,
                segments: true,
                points: true,
                colors: true,
                ..Holds::TRIANGLES
            },
            Format::Ply => Holds {
                polygons: true,
                segments: true,
                ..Holds {
                    faces: true,
                    ..Holds::CLOUD
                }
            },
            Format::Off => Holds {
                polygons: true,
                colors: true,
                ..Holds::TRIANGLES
            },
            Format::Glb => Holds {
                segments: true,
                points: true,
                normals: true,
                colors: true,
                ..Holds::TRIANGLES
            },
            Format::Pcd | Format::PointsCsv => Holds::CLOUD,
            Format::Las | Format::Laz => Holds {
                normals: false,
                ..Holds::CLOUD
            },
            Format::Xyz => Holds {
                classes: false,
                ..Holds::CLOUD
            },
            _ => Holds::TRIANGLES,
        }
    }
}

/// Tells the format by the first bytes, and by the extension where they do not tell.
///
/// JSON that its extension does not name is glTF where it has the member `asset` of one. Errors
/// when neither tells. Cost: linear in the bytes for such JSON, else constant.
pub fn sniff(bytes: &[u8], extension: Option<&str>) -> Result<Format, Fault> {
    let by_name = extension.and_then(Format::from_extension);
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Ok(super::splats::kind_of(bytes).unwrap_or(Format::Ply));
    }
    if bytes.starts_with(b"glTF") {
        return Ok(Format::Glb);
    }
    if bytes.starts_with(b"NRRD000") {
        return Ok(Format::Nrrd);
    }
    if bytes.starts_with(b"\x93NUMPY") {
        return Ok(Format::Npy);
    }
    if bytes.starts_with(b"#binvox") {
        return Ok(Format::Binvox);
    }
    if let Some(is_packed) = super::las::is_packed(bytes) {
        return Ok(if is_packed { Format::Laz } else { Format::Las });
    }
    if super::pcd::is_document(bytes) {
        return Ok(Format::Pcd);
    }
    if bytes.starts_with(super::svo::MAGIC) {
        return Ok(Format::Svo);
    }
    if bytes.starts_with(super::png::MAGIC) {
        return Ok(Format::Png);
    }
    if bytes.starts_with(super::vdb::MAGIC) {
        return Ok(Format::Vdb);
    }
    if bytes.starts_with(super::pc2::MAGIC) {
        return Ok(Format::Pc2);
    }
    if crate::anim::compress::is_stream(bytes) {
        return Ok(Format::Sanim);
    }
    if super::nifti::is_header(bytes) {
        return Ok(Format::Nifti);
    }
    if by_name == Some(Format::Mdd) {
        // Its length may by chance be that of a binary STL.
        return Ok(Format::Mdd);
    }
    if by_name == Some(Format::Stl) || super::stl::is_binary(bytes) {
        return Ok(Format::Stl);
    }
    if by_name == Some(Format::SpheresCsv) && super::xyz::is_document(bytes) {
        return Ok(Format::PointsCsv);
    }
    // Names such as `.txt` tell little: whatever text is known goes before them.
    if let Some(format) = by_name.filter(|format| *format != Format::Xyz) {
        return Ok(format);
    }
    if super::mdd::is_exact(bytes) {
        return Ok(Format::Mdd);
    }
    let text = bytes.trim_ascii_start();
    if text.starts_with(b"solid") {
        return Ok(Format::Stl);
    }
    if super::off::has_keyword(text) {
        return Ok(Format::Off);
    }
    let text = super::json::unmarked(text);
    if super::vti::is_document(text) {
        return Ok(Format::Vti);
    }
    if text.starts_with(b"{") || text.starts_with(b"[") {
        let is_gltf = super::gltf::is_document(text);
        return Ok(if is_gltf { Format::Gltf } else { Format::Json });
    }
    if super::mmcif::is_document(text) {
        return Ok(Format::Cif);
    }
    if super::pdb::is_document(text) {
        let is_pqr = super::pqr::is_document(text);
        return Ok(if is_pqr { Format::Pqr } else { Format::Pdb });
    }
    if super::xyzr::is_document(text) {
        return Ok(Format::SpheresCsv);
    }
    if by_name == Some(Format::Xyz) || super::xyz::is_document(text) {
        return Ok(Format::Xyz);
    }
    let names: Vec<_> = Format::all()
        .filter(|f| f.is_read())
        .map(Format::name)
        .collect();
    Err(
        Fault::whole("neither its first bytes nor its name tell the format").with_hint(format!(
            "name it with --input-format, one of: {}",
            names.join(", ")
        )),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_is_told_from_gltf_by_its_name_and_else_by_what_it_holds() {
        let gltf = br#"{"asset": {"version": "2.0"}}"#.as_slice();
        let report = br#" {"schema": 1, "scantle": "0.1.0"}"#.as_slice();
        let marked = b"\xef\xbb\xbf{}".as_slice();
        for (bytes, extension, format) in [
            (gltf, None, Format::Gltf),
            (gltf, Some("txt"), Format::Gltf),
            (gltf, Some("gltf"), Format::Gltf),
            (gltf, Some("JSON"), Format::Json),
            (report, None, Format::Json),
            (report, Some("log"), Format::Json),
            (report, Some("jsonl"), Format::Json),
            (report, Some("gltf"), Format::Gltf),
            (b"[1, 2]", None, Format::Json),
            (b"12", Some("json"), Format::Json),
            (marked, None, Format::Json),
            (b"ply\n", Some("json"), Format::Ply),
        ] {
            assert_eq!(sniff(bytes, extension), Ok(format), "{extension:?}");
        }
        assert!(sniff(b"12", None).is_err());
    }

    #[test]
    fn caches_of_points_are_told_by_magic_or_by_size() {
        let pc2 = b"POINTCACHE2\0\x01\0\0\0".as_slice();
        assert_eq!(sniff(pc2, Some("bin")), Ok(Format::Pc2));
        let mut mdd = vec![0; 8 + 4 + 12];
        mdd[3] = 1;
        mdd[7] = 1;
        assert_eq!(sniff(&mdd, None), Ok(Format::Mdd));
        assert_eq!(sniff(&mdd[..20], Some("mdd")), Ok(Format::Mdd));
        assert!(sniff(&mdd[..20], None).is_err());
    }

    #[test]
    fn nifti_and_vti_are_told_by_their_first_bytes() {
        let mut nifti = vec![0; 348];
        nifti[..2].copy_from_slice(&348u16.to_le_bytes());
        nifti[344..].copy_from_slice(b"n+1\0");
        let vti = b"\xef\xbb\xbf<?xml version=\"1.0\"?>\n<!-- a -->\n<VTKFile type=\"ImageData\">";
        for extension in [None, Some("img"), Some("obj")] {
            assert_eq!(sniff(&nifti, extension), Ok(Format::Nifti), "{extension:?}");
        }
        assert_eq!(sniff(vti, None), Ok(Format::Vti));
        assert_eq!(sniff(&vti[3..], Some("xml")), Ok(Format::Vti));
        // Without its magic it is whatever its name says.
        nifti[344] = 0;
        assert_eq!(sniff(&nifti, Some("nii")), Ok(Format::Nifti));
        assert!(sniff(&nifti, None).is_err());
        assert!(sniff(b"<svg>", None).is_err());
    }
}
