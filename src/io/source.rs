//! Where inputs come from: mapped files, standard input, and what lies below a gzip layer.

use super::refusal::{RAISE, Refusal, expect_room};
use super::sink::hexadecimal;
use crate::error::{Error, Fault, Result};
use flate2::read::MultiGzDecoder;
use memmap2::Mmap;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

/// An input, opened.
#[derive(Debug)]
pub struct Source {
    path: PathBuf,
    name: String,
    stored: Bytes,
    unpacked: Option<Vec<u8>>,
    limit: u64,
    skips_bad: bool,
}

#[derive(Debug)]
enum Bytes {
    Mapped(Mmap),
    Held(Vec<u8>),
}

impl Bytes {
    fn get(&self) -> &[u8] {
        match self {
            Bytes::Mapped(map) => map,
            Bytes::Held(bytes) => bytes,
        }
    }
}

impl Source {
    /// Opens a file, or reads standard input when `word` is `-`.
    ///
    /// What is held in memory (standard input, unpacked gzip) may take `limit` bytes; over that
    /// the source is refused.
    pub fn open(word: &str, limit: u64) -> Result<Source> {
        let path = PathBuf::from(word);
        let failed = |source| Error::Read {
            path: path.clone(),
            source,
        };
        let stored = if word == "-" {
            Bytes::Held(read_limited(io::stdin().lock(), limit, "reading it")?.map_err(failed)?)
        } else {
            open_bytes(&path, limit)?
        };
        Source::new(path, stored, limit)
    }

    /// A source of bytes held in memory, for tests.
    pub fn from_bytes(name: &str, bytes: Vec<u8>) -> Result<Source> {
        Source::new(PathBuf::from(name), Bytes::Held(bytes), u64::MAX)
    }

    fn new(path: PathBuf, stored: Bytes, limit: u64) -> Result<Source> {
        let name = path.display().to_string();
        let unpacked = if stored.get().starts_with(&[0x1f, 0x8b]) {
            let malformed = |e: io::Error| Error::Malformed {
                path: path.clone(),
                fault: Fault::whole(format!("the gzip layer is damaged: {e}")),
            };
            Some(
                read_limited(MultiGzDecoder::new(stored.get()), limit, "unpacking it")?
                    .map_err(malformed)?,
            )
        } else {
            None
        };
        Ok(Source {
            path,
            name,
            stored,
            unpacked,
            limit,
            skips_bad: false,
        })
    }

    /// The path as given; `-` for standard input.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path as given, for reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The content, with a gzip layer taken off.
    pub fn bytes(&self) -> &[u8] {
        self.unpacked
            .as_deref()
            .unwrap_or_else(|| self.stored.get())
    }

    /// Size as stored.
    pub fn stored_bytes(&self) -> u64 {
        self.stored.get().len() as u64
    }

    /// SHA-256 of the bytes as stored, in hexadecimal.
    pub fn sha256(&self) -> String {
        hexadecimal(&Sha256::digest(self.stored.get()))
    }

    /// The extension of the name, looking below a final `.gz`.
    pub fn extension(&self) -> Option<&str> {
        let extension = self.path.extension()?.to_str()?;
        if extension.eq_ignore_ascii_case("gz") {
            Path::new(self.path.file_stem()?).extension()?.to_str()
        } else {
            Some(extension)
        }
    }

    /// The same source, of whose clouds the points that have a number which is not finite are left out,
    /// with a counted warning, when `skips` is true. Else, as without this, they are refused.
    pub fn skipping_bad(mut self, skips: bool) -> Self {
        self.skips_bad = skips;
        self
    }

    /// Whether points that have a number which is not finite are left out of clouds.
    pub fn skips_bad(&self) -> bool {
        self.skips_bad
    }

    /// How many bytes a reader may hold at most.
    pub fn limit(&self) -> u64 {
        self.limit
    }

    /// The bytes of a file that this one names, in the same folder or below, as stored.
    ///
    /// No gzip layer is taken off: the header says how the data is packed, and raw samples may
    /// begin with any bytes.
    ///
    /// A name that is absolute or leads out of the folder is refused, as is any name in an input
    /// that has no folder.
    pub fn companion(&self, name: &str) -> Result<Vec<u8>, Refusal> {
        let path = self.beside(name)?;
        let what = || format!("the data file {name:?}");
        let limit = self.limit;
        match open_bytes(&path, limit) {
            Ok(bytes) => {
                let bytes = bytes.get();
                expect_room(what, bytes.len() as u128, limit, RAISE)?;
                Ok(bytes.to_vec())
            }
            Err(Error::Limit { .. }) => Err(Refusal::OverMemory {
                what: what(),
                needed: u128::from(limit) + 1,
                limit,
                hint: RAISE,
            }),
            Err(error) => {
                Err(Fault::whole(format!("names the data file {name:?}: {error}")).into())
            }
        }
    }

    /// The bytes of the file with the same name but this extension, in lower case or in capitals, if it
    /// is there; see [`Source::companion`].
    pub fn sibling(&self, extension: &str) -> Result<Option<Vec<u8>>, Refusal> {
        match self.sibling_name(extension) {
            Some(name) => self.companion(&name).map(Some),
            None => Ok(None),
        }
    }

    /// The name of the file with the same name but this extension, if it is there.
    pub fn sibling_name(&self, extension: &str) -> Option<String> {
        if self.name == "-" {
            return None;
        }
        let mut spelled = [extension.to_owned(), extension.to_ascii_uppercase()].into_iter();
        spelled.find_map(|extension| {
            let below = match self.path.extension() {
                Some(last) if last.eq_ignore_ascii_case("gz") => self.path.with_extension(""),
                _ => self.path.clone(),
            };
            let path = below.with_extension(extension);
            let name = path.file_name()?.to_str()?.to_owned();
            path.is_file().then_some(name)
        })
    }

    /// Where a file that this one names is, by the rules of [`Source::companion`]; it need not be
    /// there.
    pub fn beside(&self, name: &str) -> Result<PathBuf, Fault> {
        let relative = Path::new(name);
        if name.is_empty()
            || !relative
                .components()
                .all(|c| matches!(c, Component::Normal(_) | Component::CurDir))
        {
            return Err(Fault::whole(format!(
                "names the data file {name:?}, which is not in its own folder or below"
            )));
        }
        if self.name == "-" {
            return Err(Fault::whole(format!(
                "names the data file {name:?}, but standard input has no folder"
            )));
        }
        Ok(self.path.parent().unwrap_or(Path::new("")).join(relative))
    }
}

fn open_bytes(path: &Path, limit: u64) -> Result<Bytes> {
    let failed = |source| Error::Read {
        path: path.to_owned(),
        source,
    };
    let file = File::open(path).map_err(failed)?;
    let about = file.metadata().map_err(failed)?;
    if about.is_dir() {
        return Err(failed(io::Error::new(
            io::ErrorKind::IsADirectory,
            "is a folder",
        )));
    }
    if about.is_file() && about.len() > 0 {
        return map(&file).map(Bytes::Mapped).map_err(failed);
    }
    Ok(Bytes::Held(
        read_limited(file, limit, "reading it")?.map_err(failed)?,
    ))
}

#[allow(unsafe_code)]
fn map(file: &File) -> io::Result<Mmap> {
    // A mapping spares a copy of the file and lets parts be parsed on all threads. What makes it
    // unsafe is another process that cuts the file short meanwhile; scantle itself never writes
    // into a file in place, but renames over it.
    unsafe { Mmap::map(file) }
}

fn read_limited(reader: impl Read, limit: u64, what: &str) -> Result<io::Result<Vec<u8>>> {
    let mut bytes = Vec::new();
    match reader.take(limit.saturating_add(1)).read_to_end(&mut bytes) {
        Ok(read) if read as u64 > limit => {
            let needed = u128::from(limit) + 1;
            Err(Error::over_memory(what, needed, limit, Some(RAISE)))
        }
        Ok(_) => Ok(Ok(bytes)),
        Err(e) => Ok(Err(e)),
    }
}
