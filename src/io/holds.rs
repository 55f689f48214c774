//! What of a mesh each format can hold.

use super::format::Format;

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

impl Format {
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
