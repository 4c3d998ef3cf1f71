//! The frames of a run directory, whether the run has ended, was interrupted, or is still going on.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::particle_sizes::uncut;
use super::stored_frame::{StoredFrame, unescaped};
use super::{OutputError, REPORT_FILE};
use crate::files;

/// The index of the frames.
const INDEX: &str = "fields.pvd";
/// Largest index or report that is read, bytes.
const LARGEST: u64 = 1 << 30;
/// The field that tells the size of particles.
const VOLUME: &str = "volume";

/// A run that is read back from its directory.
#[derive(Debug, Clone)]
pub struct StoredRun {
    directory: PathBuf,
    frames: Vec<PathBuf>,
    title: String,
    dim: usize,
    scene: String,
    /// What volumes are multiplied by to get the sizes of particles.
    uncut: Vec<f64>,
}

impl StoredRun {
    /// Finds the frames of `directory` and reads the first: those of the index, or of all `.vtu` files by name where
    /// there is no index.
    ///
    /// # Errors
    /// [`OutputError::Unreadable`] if there is no such directory, [`OutputError::Request`] if it has no frames,
    /// [`OutputError::Malformed`] if the first frame is damaged.
    pub fn open(directory: &Path) -> Result<Self, OutputError> {
        let frames = match files::read_text(&directory.join(INDEX), LARGEST) {
            Ok(index) => indexed(directory, &index),
            Err(_) => found(directory)?,
        };
        let Some(first) = frames.first() else {
            let what = format!("there are no frames in {}", directory.display());
            return Err(OutputError::request(what, "give the directory of a run (`nicolson run SCENE --out DIR`)"));
        };
        let first = StoredFrame::read(first)?;
        let origin: Option<Value> = serde_json::from_str(first.provenance()).ok();
        let scene = origin.as_ref().and_then(|origin| origin["scene"].as_str()).unwrap_or_default().to_owned();
        let table: Option<toml::Table> = scene.parse().ok();
        let title = table.as_ref().and_then(|table| table.get("title")?.as_str());
        let told = table.as_ref().and_then(|table| usize::try_from(table.get("dimension")?.as_integer()?).ok());
        let dim = match told.filter(|dim| (1..=3).contains(dim)) {
            Some(dim) => dim,
            None => flat_dimension(&first.positions()?),
        };
        let title = title.map(str::to_owned).unwrap_or_else(|| name_of(directory));
        let mut run = Self { directory: directory.to_path_buf(), frames, title, dim, scene, uncut: Vec::new() };
        if let Some(volumes) = first.field(VOLUME)? {
            run.uncut = uncut(dim, &run.positions(&first)?, &volumes.values);
        }
        Ok(run)
    }

    /// The directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Title of the scene, or the name of the directory.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Number of space dimensions.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// The scene as text; empty if the frames do not tell.
    pub fn scene(&self) -> &str {
        &self.scene
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frames.len()
    }

    /// Reads a frame, counted from 0.
    ///
    /// # Errors
    /// [`OutputError::Request`] if there is no such frame; as [`StoredFrame::read`].
    pub fn frame(&self, index: usize) -> Result<StoredFrame, OutputError> {
        let path = self.frames.get(index).ok_or_else(|| {
            let what = format!("there is no frame {index} in {}", self.directory.display());
            OutputError::request(what, format!("it has frames 0 to {}", self.frames.len().saturating_sub(1)))
        })?;
        StoredFrame::read(path)
    }

    /// Volumes of a frame in m^dim as they are drawn: of particles on a boundary with the part beyond it. Empty if the
    /// frame has none.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] if they are damaged.
    pub(super) fn drawn_volumes(&self, frame: &StoredFrame) -> Result<Vec<f64>, OutputError> {
        let Some(volumes) = frame.field(VOLUME)? else { return Ok(Vec::new()) };
        let factors = self.uncut.iter().copied().chain(std::iter::repeat(1.0));
        Ok(volumes.values.iter().zip(factors).map(|(volume, factor)| volume * factor).collect())
    }

    /// Positions of a frame in m: `dim` components per particle.
    ///
    /// # Errors
    /// As [`StoredFrame::positions`].
    pub fn positions(&self, frame: &StoredFrame) -> Result<Vec<f64>, OutputError> {
        Ok(truncated(&frame.positions()?, self.dim))
    }
}

/// The first `dim` of three components per particle.
pub(super) fn truncated(padded: &[f64], dim: usize) -> Vec<f64> {
    padded.chunks_exact(3).flat_map(|vector| &vector[..dim]).copied().collect()
}

/// The name of a directory, also of `.` and of `results/..`.
pub(super) fn name_of(directory: &Path) -> String {
    let whole = fs::canonicalize(directory).unwrap_or_else(|_| directory.to_path_buf());
    whole.file_name().map_or_else(|| whole.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// Whether the directory exists and can be read; for messages before anything is looked for in it.
pub(super) fn check_directory(directory: &Path) -> Result<(), OutputError> {
    fs::read_dir(directory).map(|_| ()).map_err(OutputError::unreadable("the run in", directory))
}

fn indexed(directory: &Path, index: &str) -> Vec<PathBuf> {
    let files = index.split("file=\"").skip(1).filter_map(|rest| rest.split('"').next());
    files.map(|file| directory.join(unescaped(file))).collect()
}

fn found(directory: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let entries = fs::read_dir(directory).map_err(OutputError::unreadable("the run in", directory))?;
    let paths = entries.flatten().map(|entry| entry.path());
    let mut frames: Vec<PathBuf> = paths.filter(|path| path.extension().is_some_and(|kind| kind == "vtu")).collect();
    frames.sort();
    Ok(frames)
}

/// The number of directions in which anything lies off zero.
fn flat_dimension(positions: &[f64]) -> usize {
    let used = |axis: usize| positions.chunks_exact(3).any(|point| point[axis] != 0.0);
    (1..3).rev().find(|&axis| used(axis)).map_or(1, |axis| axis + 1)
}

/// `report.json` as it is; `None` while there is none (a run that goes on, or was killed).
///
/// # Errors
/// [`OutputError::Malformed`] if it is not JSON.
pub(super) fn report_of(directory: &Path) -> Result<Option<Value>, OutputError> {
    let path = directory.join(REPORT_FILE);
    match files::read_text(&path, LARGEST) {
        Err(_) => Ok(None),
        Ok(text) => serde_json::from_str(&text)
            .map(Some)
            .map_err(|error| OutputError::Malformed { path, reason: error.to_string() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dimensions_are_those_in_which_particles_lie() {
        assert_eq!(flat_dimension(&[1.0, 0.0, 0.0, 2.0, 0.0, 0.0]), 1);
        assert_eq!(flat_dimension(&[1.0, 0.0, 0.0, 2.0, 1.0, 0.0]), 2);
        assert_eq!(flat_dimension(&[1.0, 0.0, 0.0, 2.0, 0.0, 1.0]), 3);
        assert_eq!(flat_dimension(&[]), 1);
    }

    #[test]
    fn a_directory_without_frames_is_told_apart_from_none() {
        let directory = tempfile::tempdir().unwrap();
        let absent = directory.path().join("absent");
        assert!(StoredRun::open(&absent).unwrap_err().to_string().contains("correct the path"));
        assert!(StoredRun::open(directory.path()).unwrap_err().to_string().contains("there are no frames in"));
        fs::write(directory.path().join("fields-00000.vtu"), "nothing").unwrap();
        assert!(matches!(StoredRun::open(directory.path()), Err(OutputError::Malformed { .. })));
        assert_eq!(report_of(directory.path()).unwrap(), None);
    }
}
