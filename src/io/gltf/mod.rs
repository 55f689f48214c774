//! glTF 2.0, as JSON (`.gltf`) and in one binary file (`.glb`).
//!
//! A mesh is what the default scene shows: every node that holds one, placed by the transforms
//! above it. Source: Khronos Group, "glTF 2.0 Specification" (ISO/IEC 12113:2022), and the
//! extension KHR_mesh_quantization.

mod accessor;
mod assemble;
mod document;
mod scene;
mod sniff;
mod write;

use crate::io::refusal::Refusal;
use crate::io::source::Source;
use crate::mesh::Mesh;
use crate::report::Warning;

pub use sniff::is_document;
pub use write::write;

/// Reads the default scene (scene 0 where none is named, all root nodes where there is no scene).
///
/// A mesh that several nodes use appears once for each; primitives of a node that share their
/// accessors share their vertices. Triangles of a node that mirrors are turned round, so that the
/// outside stays outside. Normals and colours are kept where every primitive has them. Skins and
/// morph targets are left out with a warning: a mesh is taken as stored.
///
/// Every index, length and count is checked against what is there before room is made; what the
/// nodes make of it must fit the limit of the source.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Mesh, Refusal> {
    let opened = document::open(source.bytes(), warnings)?;
    let placed = scene::placed(&opened.document)?;
    let buffers = document::Buffers::new(source, &opened.document.buffers, opened.chunk);
    let reader = accessor::Reader {
        document: &opened.document,
        buffers,
    };
    assemble::assemble(reader, &placed, source.limit(), warnings)
}

/// The names of the files that the buffers of a document refer to; none where it is not sound.
pub fn named_files(bytes: &[u8]) -> Vec<String> {
    let opened = document::open(bytes, &mut Vec::new());
    opened.map_or(Vec::new(), |opened| {
        document::Buffers::named_files(&opened.document.buffers)
    })
}

#[cfg(test)]
mod tests;
