//! Everything a run leaves on disk, and the report.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nicolson_solvers::Snapshot;
use nicolson_solvers::time::{StepReport, TimeState};

use super::frames::{Frames, draw_particles};
use super::ledger::Ledger;
use super::probes::Gauge;
use super::{Clocks, Prepared, Rows, RunError, RunOptions};
use crate::output::{
    Bottleneck, HistoryColumns, ProbeColumns, Provenance, Report, Status, Table, WallSeconds, prepare_directory,
};
use crate::scene::Scene;

/// The table of energies, and that of probes.
pub(super) const HISTORY_FILE: &str = "history.csv";
/// See [`HISTORY_FILE`].
pub(super) const PROBES_FILE: &str = "probes.csv";

/// Columns of `history.csv`.
pub(super) const HISTORY: [&str; 10] =
    ["t", "dt", "kinetic", "internal", "external", "dissipated", "total", "newton_iterations", "rejected", "hourglass"];

/// Energy of the hourglass control over the internal energy that is worth a warning.
const MUCH_HOURGLASS: f64 = 0.05;

/// Writes histories, probes and frames as the run goes on, plots and report at its end.
pub struct Recorder<const D: usize> {
    pub(super) directory: Option<PathBuf>,
    pub(super) provenance: Provenance,
    pub(super) ledger: Ledger,
    pub(super) keeps_history: bool,
    pub(super) hourglass_warned: bool,
    pub(super) history: Option<Table>,
    pub(super) columns: HistoryColumns,
    pub(super) gauges: Vec<Gauge<D>>,
    pub(super) probe_table: Option<Table>,
    pub(super) probe_columns: ProbeColumns,
    pub(super) frames: Option<Frames>,
    pub(super) interval: Option<f64>,
    pub(super) frame_count: usize,
    pub(super) last_frame: f64,
    pub(super) plots: bool,
    /// Rows of both tables in memory, if they are wanted.
    pub(super) kept: Option<(Rows, Rows)>,
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
            recorder.begin_tables(directory)?;
            recorder.frames = Some(Frames::new(directory, &scene.output.fields, recorder.origin()));
        }
        recorder.row(prepared, 0.0, 0, 0)?;
        recorder.frame(prepared)?;
        recorder.writing = start.elapsed().saturating_sub(recorder.accounting);
        Ok(recorder)
    }

    /// A recorder that has written nothing.
    pub(super) fn new(scene: &Scene, options: &RunOptions, prepared: &Prepared<D>, ledger: Ledger) -> Self {
        let output = &scene.output;
        let model = &prepared.model;
        let mut recorder = Self {
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
            keeps_history: output.history,
            hourglass_warned: false,
            history: None,
            columns: HistoryColumns::default(),
            gauges: model.setup().probes.iter().map(|probe| Gauge::new(probe, model)).collect(),
            probe_table: None,
            probe_columns: ProbeColumns::default(),
            frames: None,
            interval: output.interval,
            frame_count: 0,
            last_frame: f64::NEG_INFINITY,
            plots: output.plots,
            kept: None,
            accounting: Duration::ZERO,
            writing: Duration::ZERO,
            earlier: WallSeconds::default(),
        };
        recorder.kept = options.keep_rows.then(|| {
            let history = if output.history { Rows::new(HISTORY) } else { Rows::default() };
            (history, Rows::new(recorder.probe_titles().iter().map(String::as_str)))
        });
        recorder.probe_columns.names = recorder.displacement_columns();
        recorder.probe_columns.values = vec![Vec::new(); recorder.probe_columns.names.len()];
        recorder
    }

    /// Begins the tables that are wanted and are not there yet.
    pub(super) fn begin_tables(&mut self, directory: &Path) -> Result<(), RunError> {
        if self.keeps_history && self.history.is_none() {
            self.history = Some(Table::create(&directory.join(HISTORY_FILE), &HISTORY)?);
        }
        if !self.gauges.is_empty() && self.probe_table.is_none() {
            let titles = self.probe_titles();
            let titles: Vec<&str> = titles.iter().map(String::as_str).collect();
            self.probe_table = Some(Table::create(&directory.join(PROBES_FILE), &titles)?);
        }
        Ok(())
    }

    /// Titles of all columns of `probes.csv`.
    pub(super) fn probe_titles(&self) -> Vec<String> {
        std::iter::once("t".to_owned()).chain(self.gauges.iter().flat_map(Gauge::columns)).collect()
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
        for (name, table) in [("history", &mut self.history), ("probes", &mut self.probe_table)] {
            if let Some(table) = table {
                saved.put_integers(name, vec![table.settle()?]);
            }
        }
        arrays.put_part("recorder", saved);
        if self.keeps_history {
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

    /// Titles of the plotted probe columns.
    fn displacement_columns(&self) -> Vec<String> {
        self.gauges.iter().flat_map(|gauge| gauge.columns().into_iter().take(D)).collect()
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
        if self.keeps_history {
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
        self.row(prepared, step.step, step.newton_iterations, step.rejected)?;
        if prepared.state.time >= self.next_frame() {
            self.frame(prepared)?;
        }
        self.writing += start.elapsed();
        Ok(())
    }

    /// A warning when the hourglass control holds much of the energy: once, at a time when that can be said.
    fn hourglass_warning(&mut self, time: f64) -> Option<String> {
        let fraction = self.ledger.hourglass_fraction().filter(|_| self.keeps_history && !self.hourglass_warned)?;
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

    fn row(&mut self, prepared: &Prepared<D>, dt: f64, newton: usize, rejected: usize) -> Result<(), RunError> {
        let t = prepared.state.time;
        if self.keeps_history {
            let e = self.ledger.entry();
            let counts = (newton as f64, rejected as f64);
            let row =
                [t, dt, e.kinetic, e.internal, e.external, e.dissipated, e.total, counts.0, counts.1, e.hourglass];
            if let Some(table) = &mut self.history {
                table.row(&row)?;
            }
            if let Some((history, _)) = &mut self.kept {
                history.values.extend(row);
            }
            if self.plots {
                self.columns.t.push(t);
                self.columns.kinetic.push(e.kinetic);
                self.columns.internal.push(e.internal);
                self.columns.external.push(e.external);
                self.columns.dissipated.push(e.dissipated);
                self.columns.total.push(e.total);
                if prepared.model.hourglass().is_some() {
                    self.columns.hourglass.push(e.hourglass);
                }
            }
        }
        if (self.directory.is_some() || self.kept.is_some()) && !self.gauges.is_empty() {
            let mut row = vec![t];
            let mut column = 0;
            self.probe_columns.t.push(t);
            for gauge in &self.gauges {
                let (u, v) = gauge.read(&prepared.model, &prepared.state.values);
                row.extend(u.iter().chain(v.iter()));
                for component in u.iter() {
                    self.probe_columns.values[column].push(*component);
                    column += 1;
                }
            }
            if let Some(table) = &mut self.probe_table {
                table.row(&row)?;
            }
            if let Some((_, probes)) = &mut self.kept {
                probes.values.extend(row);
            }
        }
        Ok(())
    }

    /// The rows of history and probes, if they were kept.
    pub fn take_rows(&mut self) -> (Rows, Rows) {
        self.kept.take().unwrap_or_default()
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
            if self.keeps_history {
                self.columns.write(&directory)?;
            }
            self.probe_columns.write(&directory)?;
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
