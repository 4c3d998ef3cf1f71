//! Checkpoints of a simulation that is stepped by hand, without the books and files of a run: written to any place, and gone
//! on from, by hand or by a run.

use std::path::{Path, PathBuf};

use nicolson_solvers::Snapshot;

use super::checkpoint::{About, Checkpoint, inputs};
use super::recorder::save_frames;
use super::resume::{frames_passed, misfit, restore, same_scene};
use super::{Prepared, RunError, prepare};
use crate::output::{OutputError, write_container};
use crate::scene::Scene;

impl<const D: usize> Prepared<D> {
    /// State, scheme and solvers, as a checkpoint holds them.
    pub(super) fn save(&mut self) -> Snapshot {
        let mut arrays = Snapshot::new();
        arrays.put_part("state", self.state.save());
        let Self { stepper, model, .. } = self;
        arrays.put_part("stepper", stepper.save(model));
        arrays
    }
}

impl Checkpoint {
    /// A checkpoint of a scene as it stands now. `frames` counts the frames passed so far, that at the start included:
    /// multiples of `output.interval`, on which steps are to land. `command` tells what wrote it, `parent` the checkpoint
    /// that the simulation had gone on from.
    ///
    /// A lagged tangent goes on to the same bits if its points were
    /// [kept](crate::model::Model::keep_linearisation_points) since before the first step.
    pub fn of<const D: usize>(
        scene: &Scene,
        prepared: &mut Prepared<D>,
        frames: usize,
        command: &str,
        parent: &Path,
    ) -> Self {
        let mut about = About { cause: "by hand".into(), inputs: inputs(scene), ..About::new(scene, command, parent) };
        about.stand(prepared);
        let mut arrays = prepared.save();
        // None of them is on disk.
        arrays.put_part("recorder", save_frames(0, frames, f64::NEG_INFINITY, scene.output.interval, false));
        Self { path: PathBuf::new(), about, arrays }
    }

    /// Writes the checkpoint as a whole or not at all.
    ///
    /// # Errors
    /// [`OutputError::File`] if the disk refuses.
    pub fn write_to(&self, path: &Path) -> Result<(), OutputError> {
        let text = serde_json::to_string(&self.about)
            .map_err(|error| OutputError::file("write the checkpoint", path)(std::io::Error::other(error)))?;
        write_container(path, &text, &self.arrays)
    }
}

/// A scene that stands where a checkpoint was written, by hand or by a run, ready for its next step; and the number of frames
/// passed so far. The steps are those of a simulation that never ended, bit by bit. `scene` and `forced` as for
/// [`restart`](super::restart); points of linearisation are [kept](crate::model::Model::keep_linearisation_points).
///
/// # Errors
/// As [`prepare`]; also if the scene is not that of the checkpoint and that is not forced, or if it does not fit.
pub fn resume<const D: usize>(
    scene: &Scene,
    checkpoint: &Checkpoint,
    forced: bool,
) -> Result<(Prepared<D>, usize), RunError> {
    let forced = !same_scene(scene, checkpoint, forced)?;
    let mut prepared = prepare::<D>(scene)?;
    prepared.model.keep_linearisation_points();
    restore(&mut prepared, checkpoint, forced)?;
    let recorded = checkpoint.arrays.part("recorder");
    let frames = frames_passed(&recorded, scene.output.interval, prepared.state.time);
    Ok((prepared, frames.map_err(|error| misfit(checkpoint, &error))?))
}
