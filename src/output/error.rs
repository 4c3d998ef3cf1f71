//! What can go wrong while results are written, said so that the user knows what to do next.

use std::io;
use std::path::{Path, PathBuf};

/// A result file that could not be written (or, in tests and tools, read back).
///
/// Every variant names the path, what was being done, and a remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The operating system refused.
    #[error("cannot {action} {}: {source}; {}", path.display(), remedy(source))]
    File {
        /// What was being done, as a verb and its object ("write the frame").
        action: &'static str,
        /// File or directory concerned.
        path: PathBuf,
        /// Answer of the operating system.
        source: io::Error,
    },
    /// The output directory is an existing file.
    #[error(
        "cannot use {} as the output directory: it is a file; remove it or choose another directory",
        path.display()
    )]
    NotADirectory {
        /// The path that was given as a directory.
        path: PathBuf,
    },
    /// A slice whose length does not fit the number of points or columns.
    #[error(
        "cannot {action} {}: `{what}` has {found} values where {expected} are needed; \
         give one entry for each point, component or column",
        path.display()
    )]
    WrongLength {
        /// What was being done.
        action: &'static str,
        /// File concerned.
        path: PathBuf,
        /// Name of the offending quantity.
        what: String,
        /// Values needed.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A value or name that the file format cannot hold.
    #[error("cannot {action} {}: {reason}; {remedy}", path.display())]
    Unsuitable {
        /// What was being done.
        action: &'static str,
        /// File concerned.
        path: PathBuf,
        /// What is wrong with the data.
        reason: String,
        /// What to change.
        remedy: &'static str,
    },
    /// A picture could not be drawn.
    #[error("cannot draw {}: {reason}; this is a fault of the program: report it with the data", path.display())]
    Drawing {
        /// File concerned.
        path: PathBuf,
        /// What the drawing library found.
        reason: String,
    },
    /// A file or directory that was to be read back cannot be read.
    #[error("cannot read {what} {}: {source}; {}", path.display(), remedy_reading(source))]
    Unreadable {
        /// What was to be read ("the frame").
        what: &'static str,
        /// File or directory concerned.
        path: PathBuf,
        /// Answer of the operating system.
        source: io::Error,
    },
    /// Something was asked for that there is not.
    #[error("{what}; {remedy}")]
    Request {
        /// What is wrong with it, with the path concerned.
        what: String,
        /// What to ask for instead.
        remedy: String,
    },
    /// A file that was read back does not hold what it should.
    #[error("cannot read {}: {reason}; it was damaged, or written by another version: run the case again", path.display())]
    Malformed {
        /// File concerned.
        path: PathBuf,
        /// What the parser found.
        reason: String,
    },
}

impl OutputError {
    /// For `map_err`: wraps an answer of the operating system.
    pub(crate) fn file(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::File { action, path, source }
    }

    /// For `map_err`: wraps a refusal to read.
    pub(crate) fn unreadable(what: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Unreadable { what, path, source }
    }

    /// A request for what there is not.
    pub(crate) fn request(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Request { what: what.into(), remedy: remedy.into() }
    }

    /// Whether what was asked for, or what was read, is at fault (exit code 2) rather than the disk that was to be
    /// written (exit code 3).
    pub fn is_input(&self) -> bool {
        matches!(self, Self::Unreadable { .. } | Self::Request { .. } | Self::Malformed { .. })
    }

    /// `Err` unless `found == expected`.
    pub(crate) fn check_length(
        action: &'static str,
        path: &Path,
        what: &str,
        expected: usize,
        found: usize,
    ) -> Result<(), Self> {
        if found == expected {
            return Ok(());
        }
        Err(Self::WrongLength { action, path: path.to_path_buf(), what: what.to_owned(), expected, found })
    }
}

/// What the user can do about a file that cannot be read.
fn remedy_reading(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "correct the path; `nicolson run` makes such directories",
        io::ErrorKind::PermissionDenied => "change its permissions",
        io::ErrorKind::NotADirectory => "give the directory of a run, not a file in it",
        _ => "check the path and the disk",
    }
}

/// What the user can do about a refusal of the operating system.
fn remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::PermissionDenied => "change its permissions or choose another output directory",
        io::ErrorKind::ReadOnlyFilesystem => "choose an output directory on a disk that can be written",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "free some space or write fewer frames",
        io::ErrorKind::NotFound => "create its directory first or correct the path",
        io::ErrorKind::NotADirectory => "a part of the path is a file: remove it or choose another directory",
        io::ErrorKind::IsADirectory => "a directory has that name: remove it or choose another output directory",
        io::ErrorKind::InvalidFilename => "choose a shorter name without special characters",
        _ => "check the path and the disk, or choose another output directory",
    }
}
