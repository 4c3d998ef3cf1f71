//! When checkpoints are written, and which are kept.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::checkpoint::{About, Checkpoint, FOLDER, InputFile, absolute, inputs, list};
use super::recorder::Recorder;
use super::{Clocks, Prepared, RunError, RunOptions};
use crate::output::sweep_partial_files;
use crate::scene::Scene;
use crate::scene::settings::CheckpointSettings;

/// Writes the checkpoints of a run.
pub struct Keeper {
    /// `None`: there are none to write.
    directory: Option<PathBuf>,
    settings: CheckpointSettings,
    request: Option<Arc<AtomicBool>>,
    /// What does not change.
    about: About,
    /// Files of the scene, marked when first needed: that reads them.
    inputs: Option<Vec<InputFile>>,
    last: Instant,
    /// Step of the last checkpoint.
    written: Option<usize>,
}

impl Keeper {
    /// A keeper for a run of `scene`, which goes on from `parent`. Checkpoints that another run left in the directory
    /// are removed.
    pub fn new(scene: &Scene, options: &RunOptions, parent: Option<&Checkpoint>) -> Self {
        let directory = options.directory.clone();
        if let Some(directory) = &directory {
            sweep_partial_files(directory);
            let folder = directory.join(FOLDER);
            sweep_partial_files(&folder);
            if !parent.is_some_and(|parent| super::same_place(&parent.directory(), directory)) {
                // Beside other tables they would pass for checkpoints of this run.
                list(&folder).into_iter().for_each(|(_, path)| drop(std::fs::remove_file(path)));
            }
        }
        let about = About {
            solve_log: options.solve_log.as_deref().map(absolute).unwrap_or_default(),
            ..About::new(scene, &options.command, parent.map_or(Path::new(""), |parent| &parent.path))
        };
        let directory = directory.filter(|_| scene.checkpoint.keep > 0);
        let (settings, request) = (scene.checkpoint.clone(), options.checkpoint_request.clone());
        Self { directory, settings, request, about, inputs: None, last: Instant::now(), written: None }
    }

    /// Why a checkpoint is due after `steps` steps, if one is.
    pub fn due(&self, steps: usize) -> Option<&'static str> {
        if self.request.as_ref().is_some_and(|request| request.swap(false, Ordering::Relaxed)) {
            return Some("signal");
        }
        if self.settings.every_steps.is_some_and(|every| steps.is_multiple_of(every)) {
            return Some("steps");
        }
        let time = self.settings.every_seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        time.is_some_and(|time| self.last.elapsed() >= time).then_some("seconds")
    }

    /// Why one is due at the end of a complete run, if one is.
    pub fn due_at_end(&self) -> Option<&'static str> {
        self.settings.at_end.then_some("end")
    }

    /// Writes a checkpoint, unless the step has one already, and removes those that are not to be kept.
    ///
    /// # Errors
    /// If the disk refuses. Older checkpoints are then still there.
    pub fn write<const D: usize>(
        &mut self,
        scene: &Scene,
        cause: &'static str,
        prepared: &mut Prepared<D>,
        recorder: &mut Recorder<D>,
        clocks: &Clocks,
    ) -> Result<(), RunError> {
        let Some(directory) = self.directory.clone() else { return Ok(()) };
        let step = prepared.stepper.statistics().accepted;
        if self.written == Some(step) {
            return Ok(());
        }
        let start = Instant::now();
        let mut arrays = prepared.save();
        recorder.save(&mut arrays)?;
        self.about.inputs = self.inputs.get_or_insert_with(|| inputs(scene)).clone();
        self.about.cause = cause.into();
        self.about.stand(prepared);
        self.about.wall_seconds = recorder.wall_seconds(prepared, clocks);
        let path = Checkpoint::write(&directory, &self.about, &arrays)?;
        self.written = Some(step);
        self.last = Instant::now();
        let all = list(&directory.join(FOLDER));
        for (_, old) in all.iter().rev().filter(|(_, other)| *other != path).skip(self.settings.keep - 1) {
            // One too many does no harm.
            let _ = std::fs::remove_file(old);
        }
        recorder.spent(start.elapsed());
        Ok(())
    }
}
