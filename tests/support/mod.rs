//! What tests share: a place to work in, runs of the binary, and the comparison of reports.

pub mod json;

use flate2::Compression;
use flate2::write::GzEncoder;
use std::ffi::OsStr;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;

/// The root of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A folder that looks like the repository root to a command line: `fixtures/` is there, and what
/// is written stays here and goes when the test ends.
pub struct Workplace {
    folder: tempfile::TempDir,
}

/// How a run ended.
#[derive(Debug)]
pub struct Ran {
    pub code: i32,
    pub stdout: Vec<u8>,
    pub stderr: String,
}

impl Workplace {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::os::unix::fs::symlink(root().join("fixtures"), folder.path().join("fixtures"))
            .expect("a link to the fixtures");
        Workplace { folder }
    }

    /// A path in this place.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file in this place.
    pub fn put(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).expect("a file in a temporary folder");
    }

    /// The names of what is in this place, beside the fixtures.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(self.folder.path())
            .expect("a temporary folder")
            .map(|entry| entry.expect("an entry").file_name().display().to_string())
            .filter(|name| name != "fixtures")
            .collect();
        names.sort();
        names
    }

    /// A run of the binary in this place, to be started.
    pub fn command(&self, words: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_scantle"));
        command.args(words).current_dir(self.folder.path());
        command.env_remove("SLURM_CPUS_PER_TASK");
        command.stdin(Stdio::null());
        command
    }

    /// Runs the binary in this place with the words of a line.
    pub fn run(&self, line: &str) -> Ran {
        ran(self.command(line.split_whitespace()).output())
    }

    /// Runs the binary in this place and writes to its standard input.
    pub fn run_with_input(&self, line: &str, input: Vec<u8>) -> Ran {
        let mut child = self
            .command(line.split_whitespace())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary starts");
        let mut stdin = child.stdin.take().expect("its standard input");
        // It may end without reading everything; that is for the test to judge.
        let writer = thread::spawn(move || stdin.write_all(&input).is_ok());
        let output = child.wait_with_output();
        writer.join().expect("the writer ends");
        ran(output)
    }

    /// Runs a line of shell in this place, with the binary first on the path.
    pub fn shell(&self, line: &str) -> Ran {
        let binary = Path::new(env!("CARGO_BIN_EXE_scantle"));
        let mut path = binary.parent().expect("its folder").as_os_str().to_owned();
        path.push(":");
        path.push(std::env::var_os("PATH").unwrap_or_default());
        let output = Command::new("bash")
            .args(["-e", "-o", "pipefail", "-c", line])
            .env("PATH", path)
            .current_dir(self.folder.path())
            .stdin(Stdio::null())
            .output();
        ran(output)
    }
}

impl Ran {
    /// Standard output as text.
    pub fn text(&self) -> String {
        String::from_utf8(self.stdout.clone()).expect("standard output is text")
    }

    /// The documents on standard output.
    pub fn documents(&self) -> Vec<serde_json::Value> {
        json::documents(&self.text())
    }

    /// The only document on standard output.
    pub fn document(&self) -> serde_json::Value {
        let mut documents = self.documents();
        assert_eq!(documents.len(), 1, "one document, not {}", self.text());
        documents.remove(0)
    }
}

/// The end of a run that was started by hand.
pub fn ran(output: std::io::Result<Output>) -> Ran {
    let output = output.expect("the program starts");
    Ran {
        code: output.status.code().expect("it ends by itself"),
        stdout: output.stdout,
        stderr: String::from_utf8(output.stderr).expect("standard error is text"),
    }
}

/// Bytes with a gzip layer.
pub fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::fast());
    packer.write_all(bytes).expect("memory can be written");
    packer.finish().expect("memory can be written")
}

/// All files below a folder, in the order of their names.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|entry| entry.expect("an entry").path())
        .collect();
    entries.sort();
    for entry in entries {
        if entry.is_dir() {
            found.extend(files_below(&entry));
        } else {
            found.push(entry);
        }
    }
    found
}

/// Whether expected results are to be rewritten rather than compared: `UPDATE_GOLDEN=1`.
pub fn updating(variable: &str) -> bool {
    std::env::var_os(variable).is_some_and(|value| value == "1")
}
