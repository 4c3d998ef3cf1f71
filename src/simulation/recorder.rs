//! Everything a run leaves on disk, and the report.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use nicolson_solvers::Snapshot;
use nicolson_solvers::time::{StepReport, TimeState};

use super::frames::{Frames, draw_particles};
use super::ledger::Ledger;
use super::tables::Tables;
use super::{Clocks, Prepared, Rows, RunError, RunOptions};
use crate::output::{Bottleneck, Provenance, Report, Status, WallSeconds, prepare_directory};
use crate::scene::Scene;

/// Energy of the hourglass control over the internal energy that is worth a warning.
const MUCH_HOURGLASS: f64 = 0.05;

/// Writes histories, probes and frames as the run goes on, plots and report at its end.
pub struct Recorder<const D: usize> {
    pub(super) directory: Option<PathBuf>,
    pub(super) provenance: Provenance,
    pub(super) ledger: Ledger,
    pub(super) hourglass_warned: bool,
    pub(super) tables: Tables<D>,
    pub(super) frames: Option<Frames>,
    pub(super) interval: Option<f64>,
    pub(super) frame_count: usize,
    pub(super) last_frame: f64,
    plots: bool,
    /// Time spent on the ledger, and on all the rest.
    pub(super) accounting: Duration,
    pub(super) writing: Duration,
    /// Wall-clock time of the parts of the run before.
    pub(super) earlier: WallSeconds,
}

impl<const D: usize> Recorder<D> {
    /// Opens all files and writes the initial state.
    ///
    /// # Errors
    /// If the directory or a file in it cannot be written.
    pub fn open(scene: &Scene, options: &RunOptions, prepared: &mut Prepared<D>) -> Result<Self, RunError> {
        let start = Instant::now();
        let ledger = Ledger::open(&mut prepared.model, prepared.state.time, &prepared.state.values)
            .map_err(|error| RunError::Choice(format!("initial state: {error}")))?;
        let mut recorder = Self::new(scene, options, prepared, ledger);
        recorder.accounting = start.elapsed();
        if let Some(directory) = &options.directory {
            prepare_directory(directory).map_err(|error| RunError::Choice(error.to_string()))?;
            recorder.tables.begin(directory)?;
            recorder.frames = Some(Frames::new(directory, &scene.output.fields, recorder.origin()));
        }
        recorder.tables.row(prepared, recorder.ledger.entry(), 0.0, 0, 0)?;
        recorder.frame(prepared)?;
        recorder.writing = start.elapsed().saturating_sub(recorder.accounting);
        Ok(recorder)
    }

    /// A recorder that has written nothing.
    pub(super) fn new(scene: &Scene, options: &RunOptions, prepared: &Prepared<D>, ledger: Ledger) -> Self {
        let output = &scene.output;
        Self {
            directory: options.directory.clone(),
            provenance: Provenance {
                version: env!("CARGO_PKG_VERSION").into(),
                commit: option_env!("NICOLSON_COMMIT").unwrap_or_default().into(),
                threads: rayon::current_num_threads(),
                scene: scene.text().into(),
                command: options.command.clone(),
                parent_checkpoint: String::new(),
            },
            ledger,
            hourglass_warned: false,
            tables: Tables::new(output, options, &prepared.model),
            frames: None,
            interval: output.interval,
            frame_count: 0,
            last_frame: f64::NEG_INFINITY,
            plots: output.plots,
            accounting: Duration::ZERO,
            writing: Duration::ZERO,
            earlier: WallSeconds::default(),
        }
    }

    /// What every frame says about where it comes from: neither threads nor command, so that frames are the same bytes
    /// however they were computed.
    pub(super) fn origin(&self) -> String {
        serde_json::json!({
            "program": "nicolson",
            "version": self.provenance.version,
            "commit": self.provenance.commit,
            "scene": self.provenance.scene,
        })
        .to_string()
    }

    /// Adds what a restart needs to a checkpoint, after everything written so far has reached the disk.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn save(&mut self, arrays: &mut Snapshot) -> Result<(), RunError> {
        let written = self.frames.as_ref().map_or(0, Frames::count);
        let mut saved = save_frames(written, self.frame_count, self.last_frame, self.interval, self.hourglass_warned);
        self.tables.settle(&mut saved)?;
        arrays.put_part("recorder", saved);
        if self.tables.keeps_history {
            arrays.put_part("ledger", self.ledger.save());
        } else {
            // The energy at the start is all that is told without a history.
            arrays.put_part("first_ledger", self.ledger.save());
        }
        Ok(())
    }

    /// Adds time spent on output.
    pub fn spent(&mut self, time: Duration) {
        self.writing += time;
    }

    /// Wall-clock time so far, that of the parts of the run before included.
    pub fn wall_seconds(&self, prepared: &Prepared<D>, clocks: &Clocks) -> WallSeconds {
        clocks.read(prepared, self.accounting, self.writing).plus(&self.earlier)
    }

    /// Time of the next frame, s.
    pub fn next_frame(&self) -> f64 {
        self.interval.map_or(f64::INFINITY, |interval| interval * self.frame_count as f64)
    }

    /// Records an accepted step.
    ///
    /// # Errors
    /// If the disk refuses, or the state is outside the domain of the law.
    pub fn record(&mut self, prepared: &mut Prepared<D>, step: &StepReport) -> Result<(), RunError> {
        let begin = Instant::now();
        if self.tables.keeps_history {
            // An explicit scheme accepts a state without evaluating it: the books may be the first to see
            // that it is outside the domain of the law. Then the run ends with the state before.
            let time = prepared.state.time;
            if let Err(error) = self.ledger.follow(&mut prepared.model, time, &prepared.state.values) {
                let (before, values) = self.ledger.last_state();
                prepared.state = TimeState::new(before, values.to_vec());
                return Err(RunError::Outside { time, error });
            }
        }
        let start = Instant::now();
        self.accounting += start - begin;
        if self.ledger.past_maximum() {
            prepared.warnings.extend(self.hourglass_warning(prepared.state.time));
        }
        self.tables.row(prepared, self.ledger.entry(), step.step, step.newton_iterations, step.rejected)?;
        if prepared.state.time >= self.next_frame() {
            self.frame(prepared)?;
        }
        self.writing += start.elapsed();
        Ok(())
    }

    /// A warning when the hourglass control holds much of the energy: once, at a time when that can be said.
    fn hourglass_warning(&mut self, time: f64) -> Option<String> {
        let fraction =
            self.ledger.hourglass_fraction().filter(|_| self.tables.keeps_history && !self.hourglass_warned)?;
        if fraction <= MUCH_HOURGLASS {
            return None;
        }
        self.hourglass_warned = true;
        Some(format!(
            "until t = {time:.4e} s the energy of the hourglass control reached {:.1} % of the largest internal energy: \
             the particles are too coarse for this motion; refine them, start from smoother fields, or lower \
             `hourglass`",
            100.0 * fraction
        ))
    }

    /// The rows of history and probes, if they were kept.
    pub fn take_rows(&mut self) -> (Rows, Rows) {
        self.tables.take_rows()
    }

    fn frame(&mut self, prepared: &Prepared<D>) -> Result<(), RunError> {
        if let Some(frames) = &mut self.frames {
            frames.write(&prepared.model, prepared.state.time, &prepared.state.values)?;
        }
        self.frame_count += 1;
        self.last_frame = prepared.state.time;
        Ok(())
    }

    /// Writes the last frame, the plots and the report.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn close(
        &mut self,
        prepared: &Prepared<D>,
        status: Status,
        message: Option<String>,
        clocks: &Clocks,
    ) -> Result<Report, RunError> {
        let start = Instant::now();
        // A disk that has no room for a picture may have some for the report.
        let drawn = self.draw(prepared);
        self.writing += start.elapsed();
        let mut report = self.report(prepared, status, message, clocks);
        report.bottleneck = Bottleneck::of(&report);
        report.warnings.extend(self.hourglass_warning(prepared.state.time));
        if let Some(directory) = &self.directory {
            report.write(directory)?;
        }
        drawn.map(|()| report)
    }

    /// Writes the last frame and the plots.
    fn draw(&mut self, prepared: &Prepared<D>) -> Result<(), RunError> {
        if self.last_frame < prepared.state.time {
            self.frame(prepared)?;
        }
        if let Some(directory) = self.directory.clone().filter(|_| self.plots) {
            self.tables.draw(&directory)?;
            draw_particles(&prepared.model, prepared.state.time, &prepared.state.values, &directory.join("particles"))?;
        }
        Ok(())
    }
}

/// How far frames have come, for a checkpoint: written ones, passed ones, time of the last, time between them.
pub(super) fn save_frames(
    written: usize,
    passed: usize,
    last: f64,
    interval: Option<f64>,
    hourglass_warned: bool,
) -> Snapshot {
    let mut saved = Snapshot::new();
    saved.put_counts("frames", &[written, passed]);
    saved.put_real("last_frame", last);
    saved.put_reals("interval", interval.into_iter().collect::<Vec<_>>());
    saved.put_flag("hourglass_warned", hourglass_warned);
    saved
}
