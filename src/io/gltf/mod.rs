//! glTF 2.0, as JSON (`.gltf`) and in one binary file (`.glb`).
//!
//! A mesh is what the default scene shows: every node that holds one, placed by the transforms
//! above it. An animation is the same, sampled over time: nodes that move, joints that pose skins,
//! morph targets that are blended. Source: Khronos Group, "glTF 2.0 Specification" (ISO/IEC 12113:2022), and the
//! extension KHR_mesh_quantization.

mod accessor;
mod animation;
mod assemble;
mod clip;
mod document;
mod pose;
mod scene;
mod sniff;
mod write;
mod write_clip;

use crate::io::refusal::Refusal;
use crate::io::source::Source;
use crate::mesh::Mesh;
use crate::report::Warning;

pub use clip::read_clip;
pub use sniff::is_document;
pub use write::write;
pub use write_clip::write_clip;

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
    let mut reader = accessor::Reader {
        document: &opened.document,
        buffers,
    };
    let assembled = assemble::assemble(&mut reader, &placed, source.limit())?;
    assembled.warn(warnings);
    Ok(assembled.mesh)
}

/// The names of the files that the buffers of a document refer to; none where it is not sound.
pub fn named_files(bytes: &[u8]) -> Vec<String> {
    let opened = document::open(bytes, &mut Vec::new());
    opened.map_or(Vec::new(), |opened| {
        document::Buffers::named_files(&opened.document.buffers)
    })
}

#[cfg(test)]
mod clip_tests;
#[cfg(test)]
mod tests;
