//! A checkpoint: what a run needs to go on, in one file.
//!
//! | part of the arrays | content |
//! |---|---|
//! | `state` | time, `[u \| v \| J]`, rates and control of the scheme (`TimeState`) |
//! | `stepper` | counters, Newton's method, linear solver, points of linearisation |
//! | `ledger`, `recorder` | sums, extremes and drifts; rows, frames and lengths of the files so far |
//!
//! What is not an array is in [`About`].

use std::path::{Path, PathBuf};

use nicolson_solvers::Snapshot;
use serde::{Deserialize, Serialize};

use super::Prepared;
use crate::output::{OutputError, WallSeconds, read_container, write_container};
use crate::scene::{Scene, SceneErrors, differences};

/// Folder of the checkpoints in a directory of results.
pub const FOLDER: &str = "checkpoints";
const PREFIX: &str = "step-";
const SUFFIX: &str = ".safetensors";

/// A file that the scene reads.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputFile {
    /// Path as the scene names it.
    pub file: String,
    /// BLAKE3 of its content; empty if it could not be read.
    pub blake3: String,
}

/// What a checkpoint says about itself.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct About {
    /// Version of the program that wrote it.
    pub version: String,
    /// Commit that the program was built from; empty if unknown.
    pub commit: String,
    /// Why it was written.
    pub cause: String,
    /// Title of the scene.
    pub title: String,
    /// Number of dimensions.
    pub dimension: usize,
    /// Number of particles.
    pub particles: usize,
    /// Accepted steps so far.
    pub step: usize,
    /// Time, s.
    pub time: f64,
    /// The scene as text, with its overrides.
    pub scene: String,
    /// File that the scene was read from.
    pub scene_file: String,
    /// Folder from which the scene's files are sought.
    pub scene_base: String,
    /// The files that the scene reads.
    pub inputs: Vec<InputFile>,
    /// Threads of the run that wrote it.
    pub threads: usize,
    /// Command line of the run that wrote it.
    pub command: String,
    /// The checkpoint from which that run had started; empty if from the beginning.
    pub parent: String,
    /// Where the solve log went; empty without.
    pub solve_log: String,
    /// Warnings so far.
    pub warnings: Vec<String>,
    /// Wall-clock time so far, over all parts of the run.
    pub wall_seconds: WallSeconds,
}

impl About {
    /// What does not change as a scene moves.
    pub(super) fn new(scene: &Scene, command: &str, parent: &Path) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            commit: option_env!("NICOLSON_COMMIT").unwrap_or_default().into(),
            title: scene.title.clone(),
            dimension: scene.dimension(),
            scene: scene.text().into(),
            scene_file: scene.name().into(),
            scene_base: absolute(scene.base()),
            threads: rayon::current_num_threads(),
            command: command.into(),
            parent: parent.display().to_string(),
            ..Self::default()
        }
    }

    /// Where the simulation stands.
    pub(super) fn stand<const D: usize>(&mut self, prepared: &Prepared<D>) {
        self.step = prepared.stepper.statistics().accepted;
        self.time = prepared.state.time;
        self.particles = prepared.model.particles();
        self.warnings.clone_from(&prepared.warnings);
    }
}

/// A checkpoint, read or made.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// Where it was read from; empty if it was made.
    pub path: PathBuf,
    /// What it says about itself.
    pub about: About,
    /// The rest.
    pub arrays: Snapshot,
}

impl Checkpoint {
    /// Reads a checkpoint.
    ///
    /// # Errors
    /// [`OutputError`] with what is wrong and, where there is one, the next older checkpoint.
    pub fn read(path: &Path) -> Result<Self, OutputError> {
        Self::read_alone(path).map_err(|error| {
            let OutputError::Request { what, remedy } = error else { return error };
            match path.parent().and_then(|folder| older(folder, path)) {
                Some(older) => {
                    OutputError::request(what, format!("{remedy}; the next older one is {}", older.display()))
                }
                None => OutputError::request(what, remedy),
            }
        })
    }

    fn read_alone(path: &Path) -> Result<Self, OutputError> {
        let (about, arrays) = read_container(path)?;
        let about = serde_json::from_str(&about).map_err(|error| {
            OutputError::request(format!("{}: the checkpoint is damaged: {error}", path.display()), "use an older one")
        })?;
        Ok(Self { path: path.to_path_buf(), about, arrays })
    }

    /// Reads a checkpoint, or the newest readable one of a directory of results. Also says which were passed over.
    ///
    /// # Errors
    /// [`OutputError`] if there is none that can be read.
    pub fn find(path: &Path) -> Result<(Self, Vec<String>), OutputError> {
        if !path.is_dir() {
            return Ok((Self::read(path)?, Vec::new()));
        }
        let mut passed = Vec::new();
        for folder in [path.join(FOLDER), path.to_path_buf()] {
            for (_, path) in list(&folder).into_iter().rev() {
                match Self::read_alone(&path) {
                    Ok(checkpoint) => return Ok((checkpoint, passed)),
                    Err(error) => passed.push(error.to_string()),
                }
            }
        }
        let mut what = format!("there is no checkpoint that can be read in {}", path.display());
        passed.iter().for_each(|error| what += &format!("\n  {error}"));
        let remedy = "run the scene again; a table [checkpoint] in it writes checkpoints as the run goes on";
        Err(OutputError::request(what, remedy))
    }

    /// The scene of the checkpoint with overrides `(key.path, value)`.
    ///
    /// # Errors
    /// As [`Scene::parse`].
    pub fn scene(&self, overrides: &[(String, String)]) -> Result<Scene, SceneErrors> {
        let About { scene, scene_file, scene_base, .. } = &self.about;
        Scene::parse(scene, scene_file, Path::new(scene_base), overrides)
    }

    /// What of a scene is not as in the checkpoint and matters: keys other than `time.end`, `output` and `checkpoint`,
    /// and files. Where a load grows until `time.end`, that matters, too.
    pub fn differences(&self, scene: &Scene) -> Vec<String> {
        let ramp = scene.time.ramp && scene.time.scheme == crate::scene::settings::Scheme::Static;
        let free = |key: &str| {
            key == "time.end" && !ramp || key.starts_with("output.") || key.split('.').next() == Some("checkpoint")
        };
        let mut found = differences(&self.about.scene, scene.text(), free);
        let now = inputs(scene);
        for InputFile { file, blake3 } in &self.about.inputs {
            let content = now.iter().find(|other| other.file == *file).map(|other| other.blake3.as_str());
            match content {
                Some(content) if content == blake3 => {}
                Some("") => found.push(format!("{file}: cannot be read")),
                Some(content) => found.push(format!("{file}: its content has changed ({blake3} → {content})")),
                // The key that named it is among the differences.
                None => {}
            }
        }
        found
    }

    /// The directory of results that the checkpoint belongs to.
    pub fn directory(&self) -> PathBuf {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let in_folder =
            std::path::absolute(folder).ok().is_some_and(|folder| folder.file_name() == Some(FOLDER.as_ref()));
        let directory = if in_folder { folder.parent().unwrap_or(Path::new("..")) } else { folder };
        if directory.as_os_str().is_empty() { PathBuf::from(".") } else { directory.to_path_buf() }
    }

    /// Removes the checkpoints of the same run that came later.
    pub(super) fn remove_newer(&self) {
        for (_, path) in list(&self.directory().join(FOLDER)).into_iter().filter(|(step, _)| *step > self.about.step) {
            // It will be overwritten when the run gets there, at the latest.
            let _ = std::fs::remove_file(path);
        }
    }

    /// Writes `about` and `arrays` into the folder of a directory of results and returns the path.
    ///
    /// # Errors
    /// [`OutputError::File`] if the disk refuses.
    pub(super) fn write(directory: &Path, about: &About, arrays: &Snapshot) -> Result<PathBuf, OutputError> {
        let folder = directory.join(FOLDER);
        std::fs::create_dir_all(&folder).map_err(OutputError::file("create the folder of checkpoints", &folder))?;
        let path = folder.join(format!("{PREFIX}{:010}{SUFFIX}", about.step));
        let text = serde_json::to_string(about)
            .map_err(|error| OutputError::file("write the checkpoint", &path)(std::io::Error::other(error)))?;
        write_container(&path, &text, arrays)?;
        Ok(path)
    }
}

/// An absolute path as text.
pub(super) fn absolute(path: &Path) -> String {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf()).display().to_string()
}

/// The files of a scene with their marks.
pub(super) fn inputs(scene: &Scene) -> Vec<InputFile> {
    let mark = |file: String| {
        let content = crate::files::read(&scene.base().join(&file), 1 << 33);
        InputFile { file, blake3: content.map(|bytes| blake3::hash(&bytes).to_hex().to_string()).unwrap_or_default() }
    };
    scene.files().into_iter().map(mark).collect()
}

/// The checkpoints of a folder with their steps, oldest first.
pub(super) fn list(folder: &Path) -> Vec<(usize, PathBuf)> {
    let step = |path: &Path| -> Option<usize> {
        let name = path.file_name()?.to_str()?;
        let number = name.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?;
        number.bytes().all(|byte| byte.is_ascii_digit()).then(|| number.parse().ok())?
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<(usize, PathBuf)> = entries.filter_map(|path| Some((step(&path)?, path))).collect();
    found.sort();
    found
}

/// The readable checkpoint before this one.
fn older(folder: &Path, path: &Path) -> Option<PathBuf> {
    let before = list(folder).into_iter().rev().map(|(_, other)| other).skip_while(|other| other != path).skip(1);
    before.into_iter().find(|other| read_container(other).is_ok())
}
