//! Going on from a checkpoint: state and memory, and the files of the run cut back to it.
//!
//! Everything is looked at before anything is changed, and every change leaves files from which the same restart is
//! possible again.

use std::path::Path;
use std::time::Instant;

use nicolson_solvers::snapshot::unfit;
use nicolson_solvers::time::TimeState;
use nicolson_solvers::{RestoreError, Snapshot};

use super::checkpoint::Checkpoint;
use super::frames::Frames;
use super::ledger::Ledger;
use super::recorder::Recorder;
use super::tables::Wanted;
use super::{Prepared, RunError, RunOptions, same_place};
use crate::output::{OutputError, Table, prepare_directory, sweep_partial_files, write_atomically};
use crate::scene::Scene;

/// Whether a scene is that of the checkpoint, as far as it matters. One that is not is refused unless that is forced.
///
/// # Errors
/// [`RunError::Choice`] with all that differs.
pub(super) fn same_scene(scene: &Scene, checkpoint: &Checkpoint, forced: bool) -> Result<bool, RunError> {
    let differences = checkpoint.differences(scene);
    if differences.is_empty() || forced {
        return Ok(differences.is_empty());
    }
    Err(RunError::Choice(format!(
        "{}: the scene is not that of the checkpoint:\n  {}\nrestart without these changes, or with --force (in Python: \
         force=True): the state then goes on, and scheme and solvers begin anew",
        checkpoint.path.display(),
        differences.join("\n  ")
    )))
}

/// A checkpoint that does not fit what it is to be continued with.
pub(super) fn misfit(checkpoint: &Checkpoint, error: &RestoreError) -> RunError {
    RunError::Choice(format!(
        "{}: the checkpoint does not fit the scene: {error}; restart with the scene and the program that wrote it",
        checkpoint.path.display()
    ))
}

/// Puts a prepared scene where the checkpoint was. With `forced`, for a scene that is not the same, only the state is
/// taken: what scheme and solvers remember belongs to the other scene.
///
/// # Errors
/// [`RunError::Choice`] if the checkpoint does not fit the scene.
pub(super) fn restore<const D: usize>(
    prepared: &mut Prepared<D>,
    checkpoint: &Checkpoint,
    forced: bool,
) -> Result<(), RunError> {
    let mut attempt = || -> Result<(), RestoreError> {
        let saved = TimeState::restored(&checkpoint.arrays.part("state"))?;
        if saved.values.len() != prepared.state.values.len() {
            let expected = format!("the state of {} particles", prepared.model.particles());
            return Err(unfit("state/values", &expected));
        }
        let stepper = checkpoint.arrays.part("stepper");
        let Prepared { stepper: to, model, .. } = &mut *prepared;
        if forced {
            to.restore_statistics(&stepper)?;
            prepared.state = TimeState::new(saved.time, saved.values);
        } else {
            to.restore(model, &stepper)?;
            prepared.state = saved;
        }
        Ok(())
    };
    attempt().map_err(|error| misfit(checkpoint, &error))?;
    if prepared.end < prepared.state.time {
        return Err(RunError::Choice(format!(
            "time.end = {} s is before the checkpoint, which is at t = {} s; choose a later end or an older checkpoint",
            prepared.end, prepared.state.time
        )));
    }
    if !forced {
        prepared.warnings.clone_from(&checkpoint.about.warnings);
    }
    Ok(())
}

/// Frames that a simulation has passed at a time, with the interval of the scene that goes on.
pub(super) fn frames_passed(saved: &Snapshot, interval: Option<f64>, time: f64) -> Result<usize, RestoreError> {
    let [_, passed] = saved.counts("frames")?;
    let before = saved.reals("interval")?.first().copied();
    // The next multiple of another interval.
    let other = interval.filter(|interval| before != Some(*interval));
    Ok(other.map_or(passed, |interval| (time / interval).floor() as usize + 1))
}

impl<const D: usize> Recorder<D> {
    /// Goes on where the checkpoint was written: cuts the tables and the frames back to it.
    ///
    /// # Errors
    /// [`RunError::Choice`] and input errors if the files do not fit, before anything is changed; later only if the disk
    /// refuses.
    pub fn resume(
        scene: &Scene,
        options: &RunOptions,
        prepared: &mut Prepared<D>,
        checkpoint: &Checkpoint,
    ) -> Result<Self, RunError> {
        let start = Instant::now();
        let saved = checkpoint.arrays.part("recorder");
        let ledger = ledger(scene, prepared, checkpoint)?;
        let mut recorder = Self::new(scene, options, prepared, ledger);
        recorder.accounting = start.elapsed();
        recorder.provenance.parent_checkpoint = checkpoint.path.display().to_string();
        recorder.earlier.clone_from(&checkpoint.about.wall_seconds);
        recorder.take_back(&saved, prepared).map_err(|error| misfit(checkpoint, &error))?;
        if let Some(directory) = &options.directory {
            recorder.take_files_back(scene, prepared, checkpoint, &saved, directory)?;
            recorder.tables.begin(directory)?;
            let has_hourglass = recorder.ledger.has_hourglass();
            recorder.tables.read_columns(directory, has_hourglass)?;
        }
        recorder.writing = start.elapsed().saturating_sub(recorder.accounting);
        Ok(recorder)
    }

    fn take_back(&mut self, saved: &Snapshot, prepared: &Prepared<D>) -> Result<(), RestoreError> {
        self.frame_count = frames_passed(saved, self.interval, prepared.state.time)?;
        self.last_frame = saved.real("last_frame")?;
        self.hourglass_warned = saved.flag("hourglass_warned")?;
        Ok(())
    }

    fn take_files_back(
        &mut self,
        scene: &Scene,
        prepared: &mut Prepared<D>,
        checkpoint: &Checkpoint,
        saved: &Snapshot,
        directory: &Path,
    ) -> Result<(), RunError> {
        let source = checkpoint.directory();
        prepare_directory(directory).map_err(|error| RunError::Choice(error.to_string()))?;
        sweep_partial_files(directory);
        let same = same_place(&source, directory);
        let frames = saved.counts::<2>("frames").map_err(|error| misfit(checkpoint, &error))?[0];
        if frames == 0 {
            // Every run writes a frame at its start: this was written by hand.
            return self.begin_files(scene, prepared, checkpoint, directory, same);
        }
        let mut tables = Vec::new();
        let wanted = self.tables.wanted();
        for Wanted { name, file, titles } in &wanted {
            if saved.has(name) {
                let bytes = saved.count(name).map_err(|error| misfit(checkpoint, &error))? as u64;
                let columns: Vec<&str> = titles.iter().map(String::as_str).collect();
                let table = Table::reopen(&source.join(file), &columns, bytes);
                tables.push((*name, *file, columns, bytes, table));
            }
        }
        let series = Frames::reopen(&source, &scene.output.fields, self.origin(), frames);
        // In another directory what cannot be found is begun anew; in place it must be there.
        let mut lost = Vec::new();
        let mut found = Vec::new();
        for (name, file, columns, bytes, table) in tables {
            match table {
                Ok(table) => found.push((name, file, columns, bytes, table)),
                Err(error) if !same => lost.push(error.to_string()),
                Err(error) => return Err(RunError::Choice(error.to_string())),
            }
        }
        let series = match series {
            Ok(series) => Some(series),
            Err(error) if !same => {
                lost.push(error.to_string());
                None
            }
            Err(error) => return Err(RunError::Choice(error.to_string())),
        };
        if same {
            // Checkpoints beyond the end of the tables must never be seen.
            checkpoint.remove_newer();
        }
        for (name, file, columns, bytes, mut table) in found {
            if same {
                table.cut(bytes)?;
            } else {
                let (from, to) = (source.join(file), directory.join(file));
                let content = std::fs::read(&from).map_err(OutputError::unreadable("the table", &from))?;
                let whole = content.get(..usize::try_from(bytes).unwrap_or(usize::MAX)).unwrap_or(&content);
                write_atomically(&to, |file| file.write_all(whole))?;
                table = Table::reopen(&to, &columns, bytes)?;
                table.cut(bytes)?;
            }
            *self.tables.on_disk(name) = Some(table);
        }
        self.frames = Some(match series {
            Some(mut series) => {
                series.begin(directory, same)?;
                series
            }
            None => Frames::new(directory, &scene.output.fields, self.origin()),
        });
        if !lost.is_empty() {
            prepared.warnings.push(format!("tables or frames begin at the checkpoint: {}", lost.join("; ")));
        }
        Ok(())
    }

    /// Begins the files of a run from a checkpoint that has none.
    fn begin_files(
        &mut self,
        scene: &Scene,
        prepared: &mut Prepared<D>,
        checkpoint: &Checkpoint,
        directory: &Path,
        same: bool,
    ) -> Result<(), RunError> {
        if same {
            return Err(RunError::Choice(format!(
                "{}: the checkpoint was written by hand and has no tables and frames to go on with, and what is in {} is \
                 not to be lost: give another directory with --out",
                checkpoint.path.display(),
                directory.display()
            )));
        }
        self.frames = Some(Frames::new(directory, &scene.output.fields, self.origin()));
        prepared.warnings.push("tables and frames begin at the checkpoint, which was written by hand".into());
        Ok(())
    }
}

/// The books of the checkpoint, or, where they were not kept or belong to another model, new ones.
fn ledger<const D: usize>(
    scene: &Scene,
    prepared: &mut Prepared<D>,
    checkpoint: &Checkpoint,
) -> Result<Ledger, RunError> {
    let name = if scene.output.history { "ledger" } else { "first_ledger" };
    let saved = checkpoint.arrays.part(name);
    let state = &prepared.state;
    if !saved.is_empty() {
        let restored = Ledger::restored(&prepared.model, &state.values, &saved);
        return restored.map_err(|error| misfit(checkpoint, &error));
    }
    let opened = Ledger::open(&mut prepared.model, state.time, &state.values);
    opened.map_err(|error| RunError::Choice(format!("state of the checkpoint: {error}")))
}
