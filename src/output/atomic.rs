//! Files that are either complete or absent.
//!
//! A run can be killed at any moment, and a viewer may read while we write. So every file that is
//! written as a whole goes to a temporary name in the *same* directory (a rename across file systems
//! is a copy, not atomic), is forced to the disk, only then takes its name, and the name is forced to the disk as well.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

use super::OutputError;

/// Distinguishes the temporary files of one process.
static COUNTER: AtomicU64 = AtomicU64::new(0);

/// A temporary file that disappears unless it was given its final name, even if the writer panics.
struct Temporary {
    path: PathBuf,
    kept: bool,
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.kept {
            // Nothing better can be done about a failure here; the first failure is what is reported.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// A name in the directory of `path` that no other writer uses. Short on purpose: the final name may
/// already be as long as the file system permits.
fn temporary_beside(path: &Path) -> PathBuf {
    let count = COUNTER.fetch_add(1, Ordering::Relaxed);
    path.with_file_name(format!(".nicolson-{}-{count}.partial", process::id()))
}

/// Writes the file `path` as a whole or not at all; an existing file is replaced in one instant.
///
/// `write` receives a buffered writer. When it returns, the bytes are flushed and forced to the disk
/// before the file takes its name. On failure the temporary file is removed and an older file of that
/// name stays as it was.
///
/// # Errors
/// [`OutputError::File`] with the cause that `write` or the operating system gave.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), OutputError> {
    let mut temporary = Temporary { path: temporary_beside(path), kept: false };
    let file = File::create(&temporary.path).map_err(OutputError::file("create", path))?;
    let mut writer = BufWriter::new(file);
    write(&mut writer)
        .and_then(|()| writer.flush())
        .and_then(|()| writer.get_ref().sync_all())
        .map_err(OutputError::file("write", path))?;
    drop(writer);
    fs::rename(&temporary.path, path).map_err(OutputError::file("complete", path))?;
    temporary.kept = true;
    sync_directory(path).map_err(OutputError::file("complete", path))
}

/// Forces the name of a file to the disk, where directories can be.
fn sync_directory(path: &Path) -> io::Result<()> {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match File::open(parent) {
        Ok(directory) if cfg!(unix) => match directory.sync_all() {
            // Some file systems (of networks) know no such thing.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
            outcome => outcome,
        },
        // A directory that can be written but not read: the name is there, and will be on the disk soon.
        _ => Ok(()),
    }
}

/// Removes the temporary files that writers which were killed have left in a directory.
pub fn sweep_partial_files(directory: &Path) {
    for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(".nicolson-") && name.ends_with(".partial") {
            // What cannot be removed is not in the way.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Makes sure that `path` is a directory in which files can be created, *before* hours are spent on
/// results that could not be saved. Missing parents are created.
///
/// # Errors
/// [`OutputError::NotADirectory`] if a file has that name, [`OutputError::File`] if the directory cannot
/// be created or written.
pub fn prepare_directory(path: &Path) -> Result<(), OutputError> {
    if fs::metadata(path).is_ok_and(|found| !found.is_dir()) {
        return Err(OutputError::NotADirectory { path: path.to_path_buf() });
    }
    fs::create_dir_all(path).map_err(OutputError::file("create the output directory", path))?;
    // Permission bits do not tell the whole story (read-only mounts, quotas, network disks), so try.
    let probe = Temporary { path: temporary_beside(&path.join("probe")), kept: false };
    fs::write(&probe.path, b"probe").map_err(OutputError::file("write into the output directory", path))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_no_other() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("späce in name.txt");
        write_atomically(&path, |w| w.write_all(b"old")).unwrap();
        let error = write_atomically(&path, |w| {
            w.write_all(b"half")?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        })
        .unwrap_err();
        assert!(error.to_string().contains("späce in name.txt"), "{error}");
        assert!(error.to_string().contains("free some space"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(directory.path()), ["späce in name.txt"]);
        write_atomically(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
    }

    #[test]
    fn a_panic_of_the_writer_leaves_nothing() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        let outcome = std::panic::catch_unwind(|| write_atomically(&path, |_| panic!("on purpose")));
        assert!(outcome.is_err());
        assert!(names(directory.path()).is_empty());
    }

    #[test]
    fn missing_directories_and_odd_targets_are_reported() {
        let directory = tempfile::tempdir().unwrap();
        let error = write_atomically(&directory.path().join("absent/file"), |_| Ok(())).unwrap_err().to_string();
        assert!(error.contains("absent/file") && error.contains("create its directory"), "{error}");
        let occupied = directory.path().join("occupied");
        fs::create_dir(&occupied).unwrap();
        assert!(write_atomically(&occupied, |_| Ok(())).is_err());
        assert_eq!(names(directory.path()), ["occupied"]);
        assert!(write_atomically(Path::new("/"), |_| Ok(())).is_err());
    }

    #[test]
    fn directories_are_created_and_checked() {
        let directory = tempfile::tempdir().unwrap();
        let nested = directory.path().join("a/b/c");
        prepare_directory(&nested).unwrap();
        prepare_directory(&nested).unwrap();
        assert!(names(&nested).is_empty());
        let file = directory.path().join("file");
        fs::write(&file, b"").unwrap();
        let error = prepare_directory(&file).unwrap_err().to_string();
        assert!(error.contains("it is a file"), "{error}");
        let error = prepare_directory(&file.join("below")).unwrap_err().to_string();
        assert!(error.contains("a part of the path is a file"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_directory_without_write_permission_is_reported() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let locked = directory.path().join("locked");
        fs::create_dir(&locked).unwrap();
        fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
        // The superuser may write everywhere; then there is nothing to report.
        if fs::write(locked.join("try"), b"").is_err() {
            let error = prepare_directory(&locked).unwrap_err().to_string();
            assert!(error.contains("permissions"), "{error}");
        }
        fs::set_permissions(&locked, fs::Permissions::from_mode(0o755)).unwrap();
    }
}
