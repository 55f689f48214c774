//! Where outputs go: beside the target and renamed, or to standard output.

use super::format::Format;
use crate::error::{Error, Result};
use crate::report::Output;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file to be written, or standard output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sink {
    /// A file; replaced in one step when all is written.
    File(PathBuf),
    /// Standard output.
    Stdout,
}

impl Sink {
    /// The sink of a command line word: `-` is standard output.
    pub fn new(word: &str) -> Self {
        if word == "-" {
            Sink::Stdout
        } else {
            Sink::File(PathBuf::from(word))
        }
    }

    /// The path as given.
    pub fn path(&self) -> &Path {
        match self {
            Sink::File(path) => path,
            Sink::Stdout => Path::new("-"),
        }
    }

    /// Whether the content is to be packed with gzip: the name ends in `.gz`.
    pub fn is_gzip(&self) -> bool {
        self.path()
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("gz"))
    }

    /// The format that the name asks for, looking below a final `.gz`.
    pub fn format(&self) -> Option<Format> {
        let path = self.path();
        let below = if self.is_gzip() {
            path.with_extension("")
        } else {
            path.to_owned()
        };
        Format::from_extension(below.extension()?.to_str()?)
    }

    /// Writes one file whole: nothing is left behind, and nothing is replaced, on failure.
    ///
    /// The content goes to a new file in the target's folder, is synced and renamed; a link is
    /// followed first. What is no file but a pipe or a device is written to as it is.
    pub fn write(
        &self,
        format: Format,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<Output> {
        self.write_as(format.name(), content)
    }

    /// As [`Sink::write`], for what is no geometry (reports, pictures): `name` is its format.
    pub fn write_as(
        &self,
        name: &str,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<Output> {
        let failed = |source| Error::Write {
            path: self.path().to_owned(),
            source,
        };
        let (bytes, sha256) = match self {
            Sink::Stdout => {
                fill(io::stdout().lock(), self.is_gzip(), content)
                    .map_err(failed)?
                    .1
            }
            Sink::File(path) => match fs::metadata(path) {
                Ok(about) if about.is_dir() => {
                    Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder"))
                }
                Ok(about) if !about.is_file() => fs::OpenOptions::new()
                    .write(true)
                    .open(path)
                    .and_then(|device| fill(device, self.is_gzip(), content))
                    .map(|(_, figures)| figures),
                old => replace(path, old.ok(), |file| fill(file, self.is_gzip(), content)),
            }
            .map_err(failed)?,
        };
        Ok(Output {
            path: self.path().display().to_string(),
            format: name.to_owned(),
            bytes,
            sha256,
        })
    }
}

/// Fills a new file in the folder of `path` and renames it to `path`, with the permissions of the
/// file that was there.
fn replace(
    path: &Path,
    old: Option<fs::Metadata>,
    content: impl FnOnce(NamedTempFile) -> io::Result<(NamedTempFile, Figures)>,
) -> io::Result<Figures> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let folder = target
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let file = tempfile::Builder::new()
        .prefix(".scantle-")
        .permissions_of_new_files()
        .tempfile_in(folder)
        .map_err(|e| without_path(&e))?;
    let (file, figures) = content(file)?;
    if let Some(old) = old {
        file.as_file().set_permissions(old.permissions())?;
    }
    file.as_file().sync_all()?;
    file.persist(target).map_err(|e| e.error)?;
    Ok(figures)
}

/// An error of a temporary file, without the name of that file: the user never gave it.
fn without_path(error: &io::Error) -> io::Error {
    let text = error.to_string();
    let said = text.split(" at path ").next().unwrap_or_default();
    io::Error::new(error.kind(), said)
}

/// New files get the permissions that the user's umask gives, not the private ones of temporary files.
trait PermissionsOfNewFiles {
    fn permissions_of_new_files(&mut self) -> &mut Self;
}

impl PermissionsOfNewFiles for tempfile::Builder<'_, '_> {
    #[cfg(unix)]
    fn permissions_of_new_files(&mut self) -> &mut Self {
        use std::os::unix::fs::PermissionsExt;
        self.permissions(fs::Permissions::from_mode(0o666))
    }

    #[cfg(not(unix))]
    fn permissions_of_new_files(&mut self) -> &mut Self {
        self
    }
}

/// Bytes written and their SHA-256.
type Figures = (u64, String);

fn fill<W: Write>(
    target: W,
    gzip: bool,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<(W, Figures)> {
    let mut out = BufWriter::with_capacity(
        1 << 18,
        Counted {
            target,
            hash: Sha256::new(),
            bytes: 0,
        },
    );
    if gzip {
        let mut packer = flate2::write::GzEncoder::new(&mut out, flate2::Compression::default());
        content(&mut packer)?;
        packer.finish()?;
    } else {
        content(&mut out)?;
    }
    let mut counted = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    counted.target.flush()?;
    Ok((
        counted.target,
        (counted.bytes, hexadecimal(&counted.hash.finalize())),
    ))
}

/// Counts and hashes what passes.
struct Counted<W> {
    target: W,
    hash: Sha256,
    bytes: u64,
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let written = self.target.write(buffer)?;
        self.hash.update(&buffer[..written]);
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.target.flush()
    }
}

/// Bytes as lower-case hexadecimal digits.
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes
        .iter()
        .fold(String::with_capacity(2 * bytes.len()), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        })
}
