//! The parts of a glTF document that hold geometry, its container and its buffers.

use crate::error::Fault;
use crate::io::base64;
use crate::io::header::excerpt;
use crate::io::refusal::Refusal;
use crate::io::samples::warn_trailing;
use crate::io::source::Source;
use crate::report::Warning;
use serde::Deserialize;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// What a file says, as far as it is geometry. Indices are as they stand, unchecked.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
#[allow(missing_docs)]
pub struct Document {
    pub asset: Asset,
    pub scene: Option<usize>,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub meshes: Vec<MeshEntry>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffer_views: Vec<View>,
    #[serde(default)]
    pub buffers: Vec<BufferEntry>,
    #[serde(default)]
    pub extensions_required: Vec<String>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
#[allow(missing_docs)]
pub struct Asset {
    pub version: String,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct Scene {
    #[serde(default)]
    pub nodes: Vec<usize>,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct Node {
    #[serde(default)]
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    #[serde(default)]
    pub extensions: BTreeMap<String, serde::de::IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct MeshEntry {
    #[serde(default)]
    pub primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct Primitive {
    #[serde(default)]
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    #[serde(default = "triangles")]
    pub mode: u64,
    #[serde(default)]
    pub targets: Vec<serde::de::IgnoredAny>,
}

fn triangles() -> u64 {
    4
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
#[allow(missing_docs)]
pub struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u64,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<Sparse>,
}

#[derive(Debug, Deserialize)]
#[allow(missing_docs)]
pub struct Sparse {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
#[allow(missing_docs)]
pub struct SparseIndices {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
#[allow(missing_docs)]
pub struct SparseValues {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
#[allow(missing_docs)]
pub struct View {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<u64>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
#[allow(missing_docs)]
pub struct BufferEntry {
    pub uri: Option<String>,
    pub byte_length: u64,
}

/// Extensions that a file may require and that change how things look, not where they are; and the
/// one that only widens the component types that the accessors here take anyway.
fn is_supported(extension: &str) -> bool {
    matches!(
        extension,
        "KHR_mesh_quantization"
            | "KHR_texture_transform"
            | "KHR_texture_basisu"
            | "KHR_lights_punctual"
            | "KHR_xmp_json_ld"
            | "EXT_texture_webp"
            | "EXT_texture_avif"
            | "EXT_lights_image_based"
            | "MSFT_texture_dds"
    ) || extension.starts_with("KHR_materials_")
}

/// A file taken apart: the document and the binary chunk of a GLB.
pub struct Opened<'a> {
    /// What the file says.
    pub document: Document,
    /// The text that says it.
    pub json: &'a [u8],
    /// The binary chunk, where there is one.
    pub chunk: Option<&'a [u8]>,
}

/// Opens a `.gltf` or `.glb`, told apart by the first bytes.
///
/// A version other than 2 and a required extension that is not supported are faults.
pub fn open<'a>(bytes: &'a [u8], warnings: &mut Vec<Warning>) -> Result<Opened<'a>, Fault> {
    let (json, chunk, binary) = if bytes.starts_with(b"glTF") {
        let (json, chunk) = chunks(bytes, warnings)?;
        (json, chunk, true)
    } else {
        let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        (json, None, false)
    };
    let document: Document = serde_json::from_slice(json).map_err(|e| {
        let message = e.to_string();
        let problem = message.split(" at line ").next().unwrap_or_default();
        if binary {
            Fault::whole(format!(
                "the JSON chunk, line {} column {}: {problem}",
                e.line(),
                e.column()
            ))
        } else {
            Fault::line(e.line() as u64, format!("column {}: {problem}", e.column()))
        }
    })?;
    let version = &document.asset.version;
    if version.split('.').next() != Some("2") {
        return Err(Fault::whole(format!(
            "is of glTF version {:?}, but version 2 is read",
            excerpt(version)
        )));
    }
    if let Some(extension) = document
        .extensions_required
        .iter()
        .find(|e| !is_supported(e))
    {
        return Err(Fault::whole(format!(
            "requires the extension {}, which is not supported",
            excerpt(extension)
        ))
        .with_hint("export it without compression or extensions"));
    }
    Ok(Opened {
        document,
        json,
        chunk,
    })
}

type Chunks<'a> = (&'a [u8], Option<&'a [u8]>);

/// The JSON and the binary chunk of a GLB.
fn chunks<'a>(bytes: &'a [u8], warnings: &mut Vec<Warning>) -> Result<Chunks<'a>, Fault> {
    let word = |at: usize| {
        let bytes = bytes.get(at..)?.first_chunk::<4>()?;
        Some(u32::from_le_bytes(*bytes))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(Fault::byte(
            bytes.len(),
            "the file ends within its header of 12 bytes",
        ));
    };
    if version != 2 {
        return Err(Fault::byte(
            4,
            format!("is of GLB version {version}, but version 2 is read"),
        ));
    }
    let length = length as usize;
    if length > bytes.len() {
        return Err(Fault::byte(
            8,
            format!(
                "states a length of {length} bytes, but the file has {}",
                bytes.len()
            ),
        ));
    }
    if length < bytes.len() {
        warn_trailing(bytes.len() - length, warnings);
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while at + 8 <= length {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            break;
        };
        let body = at + 8;
        let end = body as u64 + u64::from(size);
        if end > length as u64 {
            return Err(Fault::byte(
                at,
                format!(
                    "a chunk of {size} bytes, but {} are left of the file",
                    length - body
                ),
            ));
        }
        let content = &bytes[body..end as usize];
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(content),
            b"BIN\0" if binary.is_none() => binary = Some(content),
            _ => {}
        }
        at = end as usize;
    }
    let json = json.ok_or_else(|| Fault::byte(12, "the file has no JSON chunk"))?;
    Ok((json, binary))
}

/// The bytes of the buffers, loaded when first asked for: images in buffers of their own are not.
pub struct Buffers<'a> {
    source: &'a Source,
    entries: &'a [BufferEntry],
    chunk: Option<&'a [u8]>,
    loaded: BTreeMap<usize, Cow<'a, [u8]>>,
}

impl<'a> Buffers<'a> {
    /// The buffers of an opened file.
    pub fn new(source: &'a Source, entries: &'a [BufferEntry], chunk: Option<&'a [u8]>) -> Self {
        Buffers {
            source,
            entries,
            chunk,
            loaded: BTreeMap::new(),
        }
    }

    /// Bytes of the file itself, without data beside it.
    pub fn file_bytes(&self) -> u64 {
        self.source.bytes().len() as u64
    }

    /// The names of the files that the entries refer to, as they stand there decoded.
    pub fn named_files(entries: &[BufferEntry]) -> Vec<String> {
        let uris = entries.iter().filter_map(|entry| entry.uri.as_deref());
        uris.filter(|uri| !uri.starts_with("data:"))
            .filter_map(|uri| percent_decoded(uri).ok())
            .collect()
    }

    /// The bytes of a buffer, as many as it states.
    pub fn get(&mut self, index: usize) -> Result<&[u8], Refusal> {
        if !self.loaded.contains_key(&index) {
            let bytes = self.load(index)?;
            self.loaded.insert(index, bytes);
        }
        Ok(&self.loaded[&index])
    }

    fn load(&self, index: usize) -> Result<Cow<'a, [u8]>, Refusal> {
        let fault = |problem: String| Fault::element("buffer", index, problem);
        let Some(entry) = self.entries.get(index) else {
            return Err(fault(format!(
                "is referred to, but there are {}",
                self.entries.len()
            ))
            .into());
        };
        let bytes: Cow<'a, [u8]> = match (&entry.uri, self.chunk) {
            (Some(uri), _) if uri.starts_with("data:") => data_uri(uri).map_err(fault)?.into(),
            (Some(uri), _) => {
                let name = percent_decoded(uri).map_err(fault)?;
                let bytes = self.source.companion(&name);
                let bytes = bytes.map_err(|refusal| match refusal {
                    Refusal::Fault(found) => fault(found.problem).into(),
                    over => over,
                });
                bytes?.into()
            }
            (None, Some(chunk)) if index == 0 => chunk.into(),
            (None, _) => {
                return Err(fault("has no data: no uri and no binary chunk".into()).into());
            }
        };
        let found = bytes.len();
        match usize::try_from(entry.byte_length) {
            Ok(length) if length <= found => Ok(match bytes {
                Cow::Borrowed(bytes) => bytes[..length].into(),
                Cow::Owned(mut bytes) => {
                    bytes.truncate(length);
                    bytes.into()
                }
            }),
            _ => Err(fault(format!(
                "states {} bytes, but its data has {found}",
                entry.byte_length
            ))
            .into()),
        }
    }
}

/// The bytes of a `data:` URI, which must be base64.
fn data_uri(uri: &str) -> Result<Vec<u8>, String> {
    match uri.split_once(',') {
        Some((head, text)) if head.ends_with(";base64") => base64::decode(text),
        _ => Err(format!("the URI {:?} is not base64", excerpt(uri))),
    }
}

/// A URI with each `%41` as the byte it stands for.
fn percent_decoded(uri: &str) -> Result<String, String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        let hex = |b: u8| (b as char).to_digit(16);
        match (first, after) {
            (b'%', [high, low, after @ ..]) if hex(*high).is_some() && hex(*low).is_some() => {
                let value = hex(*high).unwrap_or(0) * 16 + hex(*low).unwrap_or(0);
                bytes.push(value as u8);
                rest = after;
            }
            _ => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    String::from_utf8(bytes).map_err(|_| format!("the URI {:?} is not UTF-8", excerpt(uri)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_that_are_none_are_named() {
        assert_eq!(percent_decoded("a%20b%zz%C3%A9").unwrap(), "a b%zzé");
        assert!(percent_decoded("%ff").is_err());
        assert!(data_uri("data:text/plain,hello").is_err());
    }
}
