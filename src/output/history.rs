//! The plots of a finished run: energies and probes against time.

use std::path::{Path, PathBuf};

use super::{LinePlot, LineSeries, OutputError, Style};

/// Share of the largest energy below which a curve would be a line along zero.
const INVISIBLE: f64 = 1e-6;

/// Energies at the recorded times, as in `history.csv`. All columns have the length of `t`; pairs beyond
/// the shortest column are ignored, as those of a run that was killed in the middle of a row would be.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HistoryColumns {
    /// Time in s.
    pub t: Vec<f64>,
    /// Kinetic energy in J.
    pub kinetic: Vec<f64>,
    /// Internal (strain) energy in J.
    pub internal: Vec<f64>,
    /// Work done by external forces since the start in J.
    pub external: Vec<f64>,
    /// Energy dissipated since the start in J.
    pub dissipated: Vec<f64>,
    /// Energy of the hourglass control in J; empty without.
    pub hourglass: Vec<f64>,
    /// Total: kinetic plus internal plus hourglass, or what the run conserves, in J.
    pub total: Vec<f64>,
}

/// Displacement components of the probes at the recorded times, as in `probes.csv`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ProbeColumns {
    /// Time in s.
    pub t: Vec<f64>,
    /// Names of the columns: probe and component (`"tip.ux"`).
    pub names: Vec<String>,
    /// Displacements in m: one column for each name.
    pub values: Vec<Vec<f64>>,
}

fn against_time(t: &[f64], name: &str, column: &[f64], style: Style) -> LineSeries {
    let points = t.iter().copied().zip(column.iter().copied()).collect();
    LineSeries { name: name.to_owned(), points, style }
}

impl HistoryColumns {
    /// The energies against time, but those that nobody could tell from zero. The total is drawn last, dashed: where it hides nothing it can be seen,
    /// where it coincides with another curve both can be.
    pub fn plot(&self) -> LinePlot {
        let mut columns = vec![
            ("kinetic", &self.kinetic, Style::Solid),
            ("internal", &self.internal, Style::Solid),
            ("external work", &self.external, Style::Solid),
            ("dissipated", &self.dissipated, Style::Dotted),
        ];
        if !self.hourglass.is_empty() {
            columns.push(("hourglass", &self.hourglass, Style::Dotted));
        }
        columns.push(("total", &self.total, Style::Dashed));
        let largest = |column: &[f64]| {
            column.iter().map(|value| value.abs()).filter(|value| value.is_finite()).fold(0.0, f64::max)
        };
        let scale = columns.iter().map(|(_, column, _)| largest(column)).fold(0.0, f64::max);
        columns.retain(|(name, column, _)| *name == "total" || largest(column) > INVISIBLE * scale);
        LinePlot {
            title: "Energy".to_owned(),
            x_label: "t [s]".to_owned(),
            y_label: "energy [J]".to_owned(),
            series: columns
                .into_iter()
                .map(|(name, column, style)| against_time(&self.t, name, column, style))
                .collect(),
            ..LinePlot::default()
        }
    }

    /// Writes `energy.svg` and `energy.png` into `directory` and returns their paths.
    ///
    /// # Errors
    /// As [`LinePlot::write`].
    pub fn write(&self, directory: &Path) -> Result<[PathBuf; 2], OutputError> {
        self.plot().write(&directory.join("energy"))
    }
}

impl ProbeColumns {
    /// One plot for each probe, with its name, in the order in which the probes first appear.
    pub fn plots(&self) -> Vec<(String, LinePlot)> {
        let mut plots: Vec<(String, LinePlot)> = Vec::new();
        for (name, column) in self.names.iter().zip(&self.values) {
            // A probe may have a dot in its own name; the component never has.
            let (probe, component) = name.rsplit_once('.').unwrap_or((name, name));
            let series = against_time(&self.t, component, column, Style::Solid);
            if let Some((_, plot)) = plots.iter_mut().find(|(known, _)| known == probe) {
                plot.series.push(series);
                continue;
            }
            let plot = LinePlot {
                title: format!("Displacement of {probe}"),
                x_label: "t [s]".to_owned(),
                y_label: "displacement [m]".to_owned(),
                series: vec![series],
                ..LinePlot::default()
            };
            plots.push((probe.to_owned(), plot));
        }
        plots
    }

    /// Writes `probe-NAME.svg` and `probe-NAME.png` for each probe into `directory` and returns all
    /// paths. Characters that a file name should not have become `_`.
    ///
    /// # Errors
    /// As [`LinePlot::write`].
    pub fn write(&self, directory: &Path) -> Result<Vec<PathBuf>, OutputError> {
        let mut paths = Vec::new();
        let mut stems: Vec<String> = Vec::new();
        for (probe, plot) in self.plots() {
            let mut stem = format!("probe-{}", file_name(&probe));
            while stems.contains(&stem) {
                stem.push('_');
            }
            paths.extend(plot.write(&directory.join(&stem))?);
            stems.push(stem);
        }
        Ok(paths)
    }
}

/// A name that every file system takes and no shell interprets.
pub(super) fn file_name(name: &str) -> String {
    let safe = |character: char| character.is_alphanumeric() || matches!(character, '-' | '_' | '.');
    name.chars().map(|character| if safe(character) { character } else { '_' }).take(60).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_become_one_plot_for_each_probe() {
        let names = ["tip.ux", "tip.uy", "a.b.ux", "bare"].map(str::to_owned).to_vec();
        let columns = ProbeColumns { t: vec![0.0, 1.0], names, values: vec![vec![0.0, 2.0]; 4] };
        let plots = columns.plots();
        let found: Vec<_> = plots.iter().map(|(name, plot)| (name.as_str(), plot.series.len())).collect();
        assert_eq!(found, [("tip", 2), ("a.b", 1), ("bare", 1)]);
        assert_eq!(plots[0].1.series[1].name, "uy");
        assert_eq!(plots[0].1.series[1].points, [(0.0, 0.0), (1.0, 2.0)]);
    }

    #[test]
    fn probes_whose_file_names_would_agree_get_different_files() {
        let directory = tempfile::tempdir().unwrap();
        let names = ["a/b.ux", "a b.ux"].map(str::to_owned).to_vec();
        let columns = ProbeColumns { t: vec![0.0, 1.0], names, values: vec![vec![0.0, 2.0]; 2] };
        let mut paths = columns.write(directory.path()).unwrap();
        assert!(paths.iter().all(|path| path.parent() == Some(directory.path())));
        paths.dedup();
        assert_eq!(paths.len(), 4);
    }

    #[test]
    fn columns_of_a_killed_run_still_give_a_plot() {
        let columns = HistoryColumns { t: vec![0.0, 1.0, 2.0], kinetic: vec![1.0, 0.5], ..HistoryColumns::default() };
        let plot = columns.plot();
        let names: Vec<_> = plot.series.iter().map(|series| (&*series.name, series.points.len())).collect();
        assert_eq!(names, [("kinetic", 2), ("total", 0)]);
    }

    #[test]
    fn energies_that_cannot_be_told_from_zero_are_left_out() {
        let names =
            |columns: &HistoryColumns| columns.plot().series.into_iter().map(|series| series.name).collect::<Vec<_>>();
        let t = vec![0.0, 1.0];
        let some = |value: f64| vec![0.0, value];
        let mut columns = HistoryColumns { t, kinetic: some(1.0), internal: some(1e-3), ..HistoryColumns::default() };
        (columns.external, columns.dissipated, columns.total) = (some(0.0), some(-1e-12), some(1.0));
        assert_eq!(names(&columns), ["kinetic", "internal", "total"]);
        columns.hourglass = some(0.1);
        columns.external = vec![0.0, -2.0];
        assert_eq!(names(&columns), ["kinetic", "internal", "external work", "hourglass", "total"]);
        assert_eq!(names(&HistoryColumns { total: some(0.0), ..HistoryColumns::default() }), ["total"]);
    }
}
