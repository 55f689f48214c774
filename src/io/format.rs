//! The formats: their names, extensions and kinds.

pub use super::holds::Holds;
pub use super::sniff::sniff;

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
    /// Heights on a map.
    Terrain,
    /// Features on a map.
    Vectors,
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
            Kind::Terrain => "terrain",
            Kind::Vectors => "vectors",
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
            Kind::Terrain => "a terrain",
            Kind::Vectors => "a layer of features",
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
    /// Heights on a map, in TIFF.
    GeoTiff,
    /// Heights on a map, of words.
    AsciiGrid,
    /// Heights of a square degree.
    Hgt,
    /// Features on a map, in JSON.
    GeoJson,
    /// Features on a map, as ESRI exchanges them.
    Shapefile,
    /// Features on a map, in a column of well-known text.
    WktCsv,
    /// Way points, routes and tracks.
    Gpx,
    /// JSON and JSON Lines.
    Json,
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
    Row {
        name: "geotiff",
        ..row(
            Format::GeoTiff,
            &["tif", "tiff", "gtiff"],
            Kind::Terrain,
            (true, true),
            "GeoTIFF: heights in strips or tiles, and their place on a map; written in strips with deflate",
        )
    },
    Row {
        name: "ascii-grid",
        ..row(
            Format::AsciiGrid,
            &["asc"],
            Kind::Terrain,
            (true, true),
            "ESRI ASCII grid: heights in rows from the north, and a .prj file",
        )
    },
    row(
        Format::Hgt,
        &["hgt"],
        Kind::Terrain,
        (true, false),
        "HGT: a square degree of heights, whose name says where",
    ),
    row(
        Format::GeoJson,
        &["geojson"],
        Kind::Vectors,
        (true, true),
        "GeoJSON: features of points, lines and polygons, with properties",
    ),
    Row {
        name: "shapefile",
        ..row(
            Format::Shapefile,
            &["shp"],
            Kind::Vectors,
            (true, false),
            "ESRI shapefile, with the .dbf, .prj and .cpg files beside it",
        )
    },
    Row {
        name: "wkt-csv",
        ..row(
            Format::WktCsv,
            &["csv"],
            Kind::Vectors,
            (true, false),
            "columns with names, one of them of well-known text",
        )
    },
    row(
        Format::Gpx,
        &["gpx"],
        Kind::Vectors,
        (true, false),
        "GPX: way points, routes and tracks, in degrees",
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
const SHARING: [Format; 5] = [
    Format::PointsCsv,
    Format::Splats,
    Format::Gaussians,
    Format::AsciiGrid,
    Format::WktCsv,
];

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
            (Format::SpheresCsv, Kind::Vectors) => Format::WktCsv,
            (Format::Xyz, Kind::Terrain) => Format::AsciiGrid,
            (Format::Json, Kind::Vectors) => Format::GeoJson,
            _ => self,
        }
    }
}
