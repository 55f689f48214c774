//! MetaImage: `.mha` in one file, `.mhd` with the data in a file beside it.
//!
//! `Offset` is the centre of voxel (0, 0, 0) and row i of `TransformMatrix` the direction of axis
//! i, as ITK has it; no axis is flipped. Source: Insight Software Consortium, "MetaIO".

use super::format::Format;
use super::header::{Field, Lines, excerpt, join};
use super::refusal::Refusal;
use super::samples::{self, ByteOrder, SampleType};
use super::sink::Sink;
use crate::error::{Error, Fault, Result};
use crate::io::source::Source;
use crate::numeric::vector::{Vec3, normalize, scale};
use crate::report::{Output, Warning};
use crate::volume::{Frame, Volume};
use flate2::read::ZlibDecoder;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Reads a volume of one channel: raw, text or packed with zlib, local or in one file beside the
/// header.
///
/// Three dimensions, or two (one slice). The data is measured against the header before room is
/// made for it.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Volume, Refusal> {
    let header = Header::parse(source.bytes())?;
    let sizes = header.sizes()?;
    let sample = header.sample_type()?;
    let order = header.byte_order()?;
    let (dims, wanted) = samples::extent(sizes, sample.bytes())?;
    let frame = header.frame(dims)?;
    let stored: Cow<[u8]> = match header.data_file()? {
        Some(name) => source.companion(name)?.into(),
        None => source.bytes()[header.end..].into(),
    };
    let packed = header.flag("CompressedData")?;
    let text = header.get("BinaryData").is_some() && !header.flag("BinaryData")?;
    let stored = header.after_own_header(&stored, (!packed && !text).then_some(wanted))?;
    let data = if text {
        samples::decode_text(stored, sample, wanted / sample.bytes())?
    } else if packed {
        let bytes = samples::unpack(ZlibDecoder::new(stored), wanted, source.limit())?;
        samples::decode(
            samples::take(&bytes, wanted, sizes, source.limit(), warnings)?,
            sample,
            order,
        )
    } else {
        samples::decode(
            samples::take(stored, wanted, sizes, source.limit(), warnings)?,
            sample,
            order,
        )
    };
    Ok(Volume { frame, data })
}

/// The name of the data file that a header gives, as it stands there; `None` for data of its own,
/// and where the header is not sound.
pub fn named_file(bytes: &[u8]) -> Option<String> {
    let header = Header::parse(bytes).ok()?;
    header.data_file().ok()?.map(str::to_owned)
}

/// Where [`write_pair`] puts the data of a header that goes to `path`.
pub fn data_path(path: &Path) -> PathBuf {
    path.with_extension("raw")
}

/// The tags of a header, in any order, up to `ElementDataFile`.
struct Header {
    tags: BTreeMap<String, Field>,
    /// Offset of the first byte after the header.
    end: usize,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Header, Fault> {
        let mut tags = BTreeMap::new();
        let mut lines = Lines::new(bytes);
        for (line, text) in &mut lines {
            if text.trim().is_empty() {
                continue;
            }
            let Some((name, value)) = text.split_once('=') else {
                return Err(Fault::line(
                    line,
                    format!(
                        "{:?} has no '=' between a tag and its value",
                        excerpt(&text)
                    ),
                ));
            };
            let field = Field {
                name: name.trim().to_owned(),
                text: value.trim().to_owned(),
                line,
            };
            let name = field.name.clone();
            let last = name == "ElementDataFile";
            if let Some(first) = tags.insert(name, field) {
                return Err(Fault::line(
                    line,
                    format!("{} stands twice, first in line {}", first.name, first.line),
                ));
            }
            if last {
                break;
            }
        }
        Ok(Header {
            tags,
            end: lines.offset(),
        })
    }

    fn get(&self, name: &str) -> Option<&Field> {
        self.tags.get(name)
    }

    fn need(&self, name: &str) -> Result<&Field, Fault> {
        self.get(name)
            .ok_or_else(|| Fault::whole(format!("the header has no tag {name}")))
    }

    /// The first of several tags that say the same.
    fn any(&self, names: &[&str]) -> Option<&Field> {
        names.iter().find_map(|name| self.get(name))
    }

    fn flag(&self, name: &str) -> Result<bool, Fault> {
        let Some(field) = self.get(name) else {
            return Ok(false);
        };
        match field.text.as_bytes().first() {
            Some(b'T' | b't' | b'1') => Ok(true),
            Some(b'F' | b'f' | b'0') => Ok(false),
            _ => Err(field.fault(format!(
                "{:?} is neither True nor False",
                excerpt(&field.text)
            ))),
        }
    }

    fn dimensions(&self) -> Result<usize, Fault> {
        let field = self.need("NDims")?;
        match field.one("a number of dimensions")? {
            count @ (2 | 3) => Ok(count),
            count => Err(field.fault(format!("{count} dimensions, but 2 or 3 are read"))),
        }
    }

    fn sizes(&self) -> Result<[u64; 3], Fault> {
        if let Some(kind) = self.get("ObjectType").filter(|f| f.text != "Image") {
            return Err(kind.fault(format!("holds {:?}, not an Image", excerpt(&kind.text))));
        }
        if let Some(field) = self.get("ElementNumberOfChannels") {
            let channels: u64 = field.one("a number of channels")?;
            if channels != 1 {
                return Err(field.fault(format!("{channels} channels, but one is read")));
            }
        }
        let found: Vec<u64> = self.need("DimSize")?.list(self.dimensions()?, "a size")?;
        Ok(std::array::from_fn(|a| found.get(a).copied().unwrap_or(1)))
    }

    fn sample_type(&self) -> Result<SampleType, Fault> {
        let field = self.need("ElementType")?;
        // MET_LONG is four bytes in MetaIO, on every system.
        Ok(match field.text.as_str() {
            "MET_CHAR" | "MET_ASCII_CHAR" => SampleType::I8,
            "MET_UCHAR" => SampleType::U8,
            "MET_SHORT" => SampleType::I16,
            "MET_USHORT" => SampleType::U16,
            "MET_INT" | "MET_LONG" => SampleType::I32,
            "MET_UINT" | "MET_ULONG" => SampleType::U32,
            "MET_LONG_LONG" => SampleType::I64,
            "MET_ULONG_LONG" => SampleType::U64,
            "MET_FLOAT" => SampleType::F32,
            "MET_DOUBLE" => SampleType::F64,
            other => {
                return Err(field.fault(format!(
                    "{:?} is not one of the integer and float types",
                    excerpt(other)
                )));
            }
        })
    }

    fn byte_order(&self) -> Result<ByteOrder, Fault> {
        for name in ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"] {
            if self.flag(name)? {
                return Ok(ByteOrder::Big);
            }
        }
        Ok(ByteOrder::Little)
    }

    fn frame(&self, dims: [usize; 3]) -> Result<Frame, Fault> {
        let n = self.dimensions()?;
        let vector = |names: &[&str], default: f64| -> Result<Vec3, Fault> {
            let found: Vec<f64> = match self.any(names) {
                Some(field) => field.list(n, "a number")?,
                None => vec![default; n],
            };
            Ok(std::array::from_fn(|a| {
                found.get(a).copied().unwrap_or(default)
            }))
        };
        let spacing = vector(&["ElementSpacing", "ElementSize"], 1.0)?;
        let origin = vector(&["Offset", "Position", "Origin"], 0.0)?;
        let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        if let Some(field) = self.any(&["TransformMatrix", "Rotation", "Orientation"]) {
            let numbers: Vec<f64> = field.list(n * n, "a number")?;
            for (axis, row) in numbers.chunks(n).enumerate() {
                axes[axis][..n].copy_from_slice(row);
            }
        }
        for (axis, step) in axes.iter_mut().zip(spacing) {
            *axis = scale(*axis, step);
        }
        // Two dimensions leave the third axis and coordinate at their defaults.
        let origin = std::array::from_fn(|a| if a < n { origin[a] } else { 0.0 });
        Ok(Frame { dims, origin, axes })
    }

    /// The name of the one data file; `None` when the data follows the header.
    fn data_file(&self) -> Result<Option<&str>, Fault> {
        let field = self.need("ElementDataFile")?;
        let several = field.text.starts_with("LIST") || field.text.contains('%');
        if several {
            return Err(field
                .fault(format!(
                    "{:?} stands for several files, but data in one file is read",
                    excerpt(&field.text)
                ))
                .with_hint("store the slices in one file"));
        }
        Ok((!field.text.eq_ignore_ascii_case("local")).then_some(&field.text))
    }

    /// What follows the `HeaderSize` bytes of a foreign header; -1 is all but the last `wanted` bytes.
    fn after_own_header<'a>(
        &self,
        bytes: &'a [u8],
        wanted: Option<usize>,
    ) -> Result<&'a [u8], Fault> {
        let Some(field) = self.get("HeaderSize") else {
            return Ok(bytes);
        };
        let size: i64 = field.one("a number of bytes")?;
        let start = match (size, wanted) {
            (-1, Some(wanted)) => bytes.len().saturating_sub(wanted),
            (-1, None) => {
                return Err(field.fault("-1 goes with raw data alone, and this data is not raw"));
            }
            _ => usize::try_from(size).map_err(|_| field.fault(format!("{size} is negative")))?,
        };
        bytes.get(start..).ok_or_else(|| {
            field.fault(format!(
                "{size} bytes are to be skipped, but the data has {}",
                bytes.len()
            ))
        })
    }
}

/// Writes a volume with its data in the same file; bits as bytes of 0 and 1, all little endian.
///
/// Bits are expanded a few slices at a time.
pub fn write(volume: &Volume, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(header(volume, "LOCAL").as_bytes())?;
    samples::write_raw(volume, out)
}

/// Writes a header and, beside it, the data: `NAME.mhd` and `NAME.raw`.
///
/// The data goes first, so that a header never names a file that is not there. Standard output
/// holds one file and is refused, as is a name that ends in `.gz`.
pub fn write_pair(volume: &Volume, sink: &Sink) -> Result<Vec<Output>> {
    let refuse = |problem: &str| Err(Error::parameter("output", sink.path().display(), problem));
    let Sink::File(path) = sink else {
        return refuse("mhd is two files, which standard output cannot hold; mha is one");
    };
    if sink.is_gzip() {
        return refuse("an mhd header names its data file and is not packed; use mha");
    }
    let beside = data_path(path);
    let Some(name) = beside.file_name().and_then(|name| name.to_str()) else {
        return refuse("the name of the data file must be text that a header can hold");
    };
    if *path == beside || name.contains(['\n', '\r', '%']) || name.trim() != name {
        return refuse("the header cannot name its data file beside it; choose NAME.mhd");
    }
    let text = header(volume, name);
    let data =
        Sink::File(beside.clone()).write(Format::Mhd, |out| samples::write_raw(volume, out))?;
    let header = sink.write(Format::Mhd, |out| out.write_all(text.as_bytes()))?;
    Ok(vec![header, data])
}

/// The header of a volume whose data is in `file`.
fn header(volume: &Volume, file: &str) -> String {
    let frame = &volume.frame;
    let [nx, ny, nz] = frame.dims;
    let kind = match SampleType::of(&volume.data) {
        SampleType::U8 => "MET_UCHAR",
        SampleType::I8 => "MET_CHAR",
        SampleType::U16 => "MET_USHORT",
        SampleType::I16 => "MET_SHORT",
        SampleType::U32 => "MET_UINT",
        SampleType::I32 => "MET_INT",
        SampleType::U64 => "MET_ULONG_LONG",
        SampleType::I64 => "MET_LONG_LONG",
        SampleType::F32 => "MET_FLOAT",
        SampleType::F64 => "MET_DOUBLE",
    };
    let directions = frame.axes.map(normalize);
    format!(
        "ObjectType = Image\n\
         NDims = 3\n\
         BinaryData = True\n\
         BinaryDataByteOrderMSB = False\n\
         CompressedData = False\n\
         TransformMatrix = {}\n\
         Offset = {}\n\
         CenterOfRotation = 0 0 0\n\
         ElementSpacing = {}\n\
         DimSize = {nx} {ny} {nz}\n\
         ElementType = {kind}\n\
         ElementDataFile = {file}\n",
        join(directions.as_flattened(), " "),
        join(&frame.origin, " "),
        join(&frame.spacing(), " "),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::written_volume::{
        Parsed, damaged, parsed, raw, same_axes, twelve, volumes, written,
    };
    use crate::volume::Data;
    use proptest::prelude::*;

    fn parse(bytes: &[u8]) -> Parsed {
        parsed("a.mha", bytes, read)
    }

    proptest! {
        #[test]
        fn what_is_written_comes_back(volume in volumes()) {
            let (back, warnings) = parse(&written(&volume, write)).unwrap();
            prop_assert!(warnings.is_empty());
            prop_assert_eq!(back.frame.dims, volume.frame.dims);
            prop_assert_eq!(back.frame.origin, volume.frame.origin);
            prop_assert!(same_axes(&back.frame, &volume.frame));
            prop_assert_eq!(raw(&back), raw(&volume));
        }

        #[test]
        fn any_bytes_are_read_or_refused(cut in 0usize..400, at in 0usize..400, byte in any::<u8>()) {
            let _ = parse(&damaged(written(&twelve(), write), at, byte, cut));
        }
    }

    #[test]
    fn a_pair_reads_back_and_stands_in_no_stream() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a b.mhd");
        let volume = Volume {
            frame: Frame::straight([2, 1, 2], [1.0, 2.0, 3.0], [0.5; 3]),
            data: Data::F32(vec![1.0, 2.0, 3.0, -4.5]),
        };
        let outputs = write_pair(&volume, &Sink::File(path.clone())).unwrap();
        assert_eq!(outputs.len(), 2);
        assert!(outputs[1].path.ends_with("a b.raw") && outputs[1].bytes == 16);
        let source = Source::open(path.to_str().unwrap(), u64::MAX).unwrap();
        assert_eq!(read(&source, &mut Vec::new()).unwrap(), volume);
        let refused = write_pair(&volume, &Sink::Stdout).unwrap_err();
        assert_eq!(
            refused.to_string(),
            "--output -: mhd is two files, which standard output cannot hold; mha is one"
        );
        let packed = Sink::File(folder.path().join("a.mhd.gz"));
        assert!(matches!(
            write_pair(&volume, &packed),
            Err(Error::Parameter { .. })
        ));
    }

    #[test]
    fn packed_text_and_swapped_data_hold_the_same() {
        let head = |extra: &str| {
            format!(
                "ObjectType = Image\nNDims = 2\nDimSize = 2 1\nElementType = MET_SHORT\n\
                 ElementSize = 3 4\nPosition = 5 6\n{extra}\nElementDataFile = LOCAL\n"
            )
        };
        let wanted = Volume {
            frame: Frame::straight([2, 1, 1], [5.0, 6.0, 0.0], [3.0, 4.0, 1.0]),
            data: Data::I16(vec![-2, 258]),
        };
        let join = |head: String, data: &[u8]| [head.as_bytes(), data].concat();
        let plain = join(head("HeaderSize = 3"), &[7, 7, 7, 0xfe, 0xff, 2, 1]);
        assert_eq!(parse(&plain).unwrap().0, wanted);
        let last = join(head("HeaderSize = -1"), &[7, 7, 7, 0xfe, 0xff, 2, 1]);
        assert_eq!(parse(&last).unwrap().0, wanted);
        let swapped = join(head("ElementByteOrderMSB = True"), &[0xff, 0xfe, 1, 2]);
        assert_eq!(parse(&swapped).unwrap().0, wanted);
        let text = join(head("BinaryData = False"), b"-2 258\n");
        assert_eq!(parse(&text).unwrap().0, wanted);
        let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        packer.write_all(&[0xfe, 0xff, 2, 1]).unwrap();
        let packed = join(head("CompressedData = True"), &packer.finish().unwrap());
        assert_eq!(parse(&packed).unwrap().0, wanted);
    }
}
