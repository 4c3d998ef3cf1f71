//! The index that makes a time series out of frames (`fields.pvd`).

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::text::{number, xml_attribute};
use super::{OutputError, write_atomically};

/// A growing list of times and frame files, complete on disk after every frame: a run that is killed
/// leaves a series that opens.
#[derive(Debug, Clone)]
pub struct Series {
    path: PathBuf,
    entries: String,
    frames: usize,
}

impl Series {
    /// An empty series that will be written to `path` with the first frame.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_path_buf(), entries: String::new(), frames: 0 }
    }

    /// The first `frames` frames of the series that is in `path`, to go on after them; nothing is changed yet.
    ///
    /// # Errors
    /// [`OutputError::Unreadable`] if there is no such file, [`OutputError::Request`] if it has fewer frames.
    pub fn reopen(path: &Path, frames: usize) -> Result<Self, OutputError> {
        let text =
            crate::files::read_text(path, 1 << 30).map_err(OutputError::unreadable("the index of frames", path))?;
        let lines: Vec<&str> = text.lines().filter(|line| line.trim_start().starts_with("<DataSet ")).collect();
        let Some(kept) = lines.get(..frames) else {
            return Err(OutputError::request(
                format!(
                    "{} cannot be continued: it has {} frames, and had {frames} when the checkpoint was written",
                    path.display(),
                    lines.len()
                ),
                "restart into another directory with --out: what is missing then begins at the checkpoint",
            ));
        };
        let entries = kept.iter().map(|line| format!("{line}\n")).collect();
        Ok(Self { path: path.to_path_buf(), entries, frames })
    }

    /// Names of the files, as they stand in the index.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.entries.lines().filter_map(|line| line.split_once("file=\"")?.1.split_once('"').map(|(file, _)| file))
    }

    /// The same series in another directory.
    #[must_use]
    pub fn moved_to(self, path: &Path) -> Self {
        Self { path: path.to_path_buf(), ..self }
    }

    /// Writes the index as it is.
    ///
    /// # Errors
    /// [`OutputError::File`] if the disk refuses.
    pub fn write(&self) -> Result<(), OutputError> {
        write_atomically(&self.path, |index| {
            index.write_all(
                b"<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
                  <VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n  <Collection>\n",
            )?;
            index.write_all(self.entries.as_bytes())?;
            index.write_all(b"  </Collection>\n</VTKFile>\n")
        })
    }

    /// Adds a frame at `time` (s) and rewrites the index. `file` lies in the directory of the index or
    /// below it, given as such or relative to that directory; the index holds the relative name, so the
    /// whole directory can be moved.
    ///
    /// # Errors
    /// [`OutputError::Unsuitable`] if `file` is an absolute path elsewhere or the time is not finite;
    /// [`OutputError::File`] if the disk refuses; the frame then counts as not added.
    pub fn append(&mut self, time: f64, file: &Path) -> Result<(), OutputError> {
        let directory = self.path.parent().unwrap_or(Path::new(""));
        let relative = file.strip_prefix(directory).unwrap_or(file);
        let unsuitable = |reason: String, remedy: &'static str| OutputError::Unsuitable {
            action: "add a frame to",
            path: self.path.clone(),
            reason,
            remedy,
        };
        if relative.is_absolute() {
            let reason = format!("{} is not below its directory", file.display());
            return Err(unsuitable(reason, "write frames and index into one directory"));
        }
        if !time.is_finite() {
            return Err(unsuitable(format!("the time is {time}"), "write frames of accepted steps only"));
        }
        let before = self.entries.len();
        // VTK wants forward slashes on every system.
        let name: Vec<_> = relative.components().map(|part| part.as_os_str().to_string_lossy()).collect();
        // Writing to a String cannot fail.
        let _ = writeln!(
            self.entries,
            "    <DataSet timestep=\"{}\" group=\"\" part=\"0\" file=\"{}\"/>",
            number(time),
            xml_attribute(&name.join("/"))
        );
        let written = self.write();
        match written {
            Ok(()) => self.frames += 1,
            Err(_) => self.entries.truncate(before),
        }
        written
    }

    /// Frames in the index.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Where the index is written.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_index_is_complete_after_every_frame() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("fields.pvd");
        let mut series = Series::new(&path);
        series.append(0.0, &directory.path().join("frames/a & b.vtu")).unwrap();
        series.append(2.5e-7, Path::new("frames/1.vtu")).unwrap();
        let text = fs::read_to_string(series.path()).unwrap();
        assert!(text.contains("timestep=\"0\" group=\"\" part=\"0\" file=\"frames/a &amp; b.vtu\""), "{text}");
        assert!(text.contains("timestep=\"2.5e-7\""), "{text}");
        assert!(text.ends_with("</VTKFile>\n"));
        assert_eq!(series.frames(), 2);
    }

    #[test]
    fn a_frame_that_could_not_be_indexed_does_not_count() {
        let directory = tempfile::tempdir().unwrap();
        let mut series = Series::new(&directory.path().join("absent/fields.pvd"));
        assert!(series.append(0.0, Path::new("0.vtu")).is_err());
        assert!(series.append(f64::NAN, Path::new("0.vtu")).is_err());
        assert!(series.append(0.0, Path::new("/elsewhere/0.vtu")).unwrap_err().to_string().contains("elsewhere"));
        assert_eq!(series.frames(), 0);
        fs::create_dir(directory.path().join("absent")).unwrap();
        series.append(1.0, Path::new("1.vtu")).unwrap();
        assert!(!fs::read_to_string(series.path()).unwrap().contains("0.vtu"));
    }
}
