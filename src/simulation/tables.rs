//! The rows of a run, energies and probes after every step: on disk, in memory, and as columns of the plots.

use std::path::Path;

use nicolson_solvers::Snapshot;

use super::ledger::Entry;
use super::probes::Gauge;
use super::{Prepared, Rows, RunError, RunOptions};
use crate::model::Model;
use crate::output::{HistoryColumns, ProbeColumns, StoredTable, Table};
use crate::scene::settings::OutputSettings;

/// The table of energies, and that of probes.
const HISTORY_FILE: &str = "history.csv";
/// See [`HISTORY_FILE`].
const PROBES_FILE: &str = "probes.csv";

/// Columns of `history.csv`.
const HISTORY: [&str; 10] =
    ["t", "dt", "kinetic", "internal", "external", "dissipated", "total", "newton_iterations", "rejected", "hourglass"];

/// A table that a run writes.
pub(super) struct Wanted {
    /// Its name in a checkpoint.
    pub(super) name: &'static str,
    pub(super) file: &'static str,
    pub(super) titles: Vec<String>,
}

/// Takes the rows, one a step.
pub(super) struct Tables<const D: usize> {
    pub(super) keeps_history: bool,
    pub(super) gauges: Vec<Gauge<D>>,
    /// Whether there is a directory, and whether there are plots in it.
    writes: bool,
    plots: bool,
    history: Option<Table>,
    columns: HistoryColumns,
    probes: Option<Table>,
    probe_columns: ProbeColumns,
    /// Rows of both tables in memory, if they are wanted.
    kept: Option<(Rows, Rows)>,
}

impl<const D: usize> Tables<D> {
    /// Tables without rows, none of them on disk.
    pub(super) fn new(output: &OutputSettings, options: &RunOptions, model: &Model<D>) -> Self {
        let gauges: Vec<_> = model.setup().probes.iter().map(|probe| Gauge::new(probe, model)).collect();
        let names: Vec<String> = gauges.iter().flat_map(|gauge| gauge.columns().into_iter().take(D)).collect();
        let mut tables = Self {
            keeps_history: output.history,
            gauges,
            writes: options.directory.is_some(),
            plots: output.plots,
            history: None,
            columns: HistoryColumns::default(),
            probes: None,
            probe_columns: ProbeColumns { values: vec![Vec::new(); names.len()], names, ..ProbeColumns::default() },
            kept: None,
        };
        tables.kept = options.keep_rows.then(|| {
            let history = if output.history { Rows::new(HISTORY) } else { Rows::default() };
            (history, Rows::new(tables.probe_titles().iter().map(String::as_str)))
        });
        tables
    }

    /// Titles of all columns of `probes.csv`.
    fn probe_titles(&self) -> Vec<String> {
        std::iter::once("t".to_owned()).chain(self.gauges.iter().flat_map(Gauge::columns)).collect()
    }

    /// The tables that the scene asks for.
    pub(super) fn wanted(&self) -> Vec<Wanted> {
        let history = Wanted { name: "history", file: HISTORY_FILE, titles: HISTORY.map(str::to_owned).to_vec() };
        let probes = Wanted { name: "probes", file: PROBES_FILE, titles: self.probe_titles() };
        let history = self.keeps_history.then_some(history);
        history.into_iter().chain((!self.gauges.is_empty()).then_some(probes)).collect()
    }

    /// The table of that [name](Wanted::name).
    pub(super) fn on_disk(&mut self, name: &str) -> &mut Option<Table> {
        if name == "history" { &mut self.history } else { &mut self.probes }
    }

    /// Begins the tables that are wanted and are not there yet.
    pub(super) fn begin(&mut self, directory: &Path) -> Result<(), RunError> {
        for Wanted { name, file, titles } in self.wanted() {
            let table = self.on_disk(name);
            if table.is_none() {
                let titles: Vec<&str> = titles.iter().map(String::as_str).collect();
                *table = Some(Table::create(&directory.join(file), &titles)?);
            }
        }
        Ok(())
    }

    /// Brings all rows to the disk, and notes the lengths of the files.
    pub(super) fn settle(&mut self, saved: &mut Snapshot) -> Result<(), RunError> {
        for (name, table) in [("history", &mut self.history), ("probes", &mut self.probes)] {
            if let Some(table) = table {
                saved.put_integers(name, vec![table.settle()?]);
            }
        }
        Ok(())
    }

    /// Adds the row of a step of `dt` to the present state.
    pub(super) fn row(
        &mut self,
        prepared: &Prepared<D>,
        e: Entry,
        dt: f64,
        newton: usize,
        rejected: usize,
    ) -> Result<(), RunError> {
        let t = prepared.state.time;
        if self.keeps_history {
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
        if (self.writes || self.kept.is_some()) && !self.gauges.is_empty() {
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
            if let Some(table) = &mut self.probes {
                table.row(&row)?;
            }
            if let Some((_, probes)) = &mut self.kept {
                probes.values.extend(row);
            }
        }
        Ok(())
    }

    /// The rows of history and probes, if they were kept.
    pub(super) fn take_rows(&mut self) -> (Rows, Rows) {
        self.kept.take().unwrap_or_default()
    }

    /// Draws the plots.
    pub(super) fn draw(&self, directory: &Path) -> Result<(), RunError> {
        if self.keeps_history {
            self.columns.write(directory)?;
        }
        self.probe_columns.write(directory)?;
        Ok(())
    }

    /// The columns for plots, from the tables as they are now.
    pub(super) fn read_columns(&mut self, directory: &Path, has_hourglass: bool) -> Result<(), RunError> {
        if !self.plots {
            return Ok(());
        }
        let column = |table: &StoredTable, name: &str| table.column(name).map(<[f64]>::to_vec);
        if self.history.is_some() {
            let table = StoredTable::read(&directory.join(HISTORY_FILE))?;
            self.columns.t = column(&table, "t")?;
            self.columns.kinetic = column(&table, "kinetic")?;
            self.columns.internal = column(&table, "internal")?;
            self.columns.external = column(&table, "external")?;
            self.columns.dissipated = column(&table, "dissipated")?;
            self.columns.total = column(&table, "total")?;
            if has_hourglass {
                self.columns.hourglass = column(&table, "hourglass")?;
            }
        }
        if self.probes.is_some() {
            let table = StoredTable::read(&directory.join(PROBES_FILE))?;
            self.probe_columns.t = column(&table, "t")?;
            for (name, values) in self.probe_columns.names.iter().zip(&mut self.probe_columns.values) {
                *values = column(&table, name)?;
            }
        }
        Ok(())
    }
}
