//! One quantity of several runs in one plot.

use std::path::{Path, PathBuf};

use super::render::check_parent;
use super::stored_run::{check_directory, name_of};
use super::stored_table::StoredTable;
use super::{LinePlot, LineSeries, OutputError, Style};

/// Where the quantities are.
const HISTORY: &str = "history.csv";
const PROBES: &str = "probes.csv";

/// What is compared.
#[derive(Debug, Clone, Default)]
pub struct Comparison {
    /// Columns of `probes.csv` (`tip.uy`).
    pub probes: Vec<String>,
    /// Columns of `history.csv` (`total`).
    pub quantities: Vec<String>,
    /// File to write, `.svg` or `.png`; `None`: named after the first column, in the working directory.
    pub out: Option<PathBuf>,
}

impl Comparison {
    /// Plots the quantities of all runs and returns the file.
    ///
    /// # Errors
    /// [`OutputError::Unreadable`] and [`OutputError::Request`] for runs and columns that there are not;
    /// [`OutputError::Malformed`] for damaged tables; [`OutputError::File`] if the disk refuses.
    pub fn write(&self, runs: &[PathBuf]) -> Result<PathBuf, OutputError> {
        let plot = self.plot(runs)?;
        let first = self.probes.iter().chain(&self.quantities).next().map_or("plot", String::as_str);
        let out =
            self.out.clone().unwrap_or_else(|| PathBuf::from(format!("{}.svg", super::history::file_name(first))));
        check_parent(&out)?;
        plot.write_as(&out)?;
        Ok(out)
    }

    /// The plot, one curve for each run and column.
    ///
    /// # Errors
    /// As [`Comparison::write`].
    pub fn plot(&self, runs: &[PathBuf]) -> Result<LinePlot, OutputError> {
        let columns: Vec<(&str, &str)> = (self.probes.iter().map(|name| (PROBES, name.as_str())))
            .chain(self.quantities.iter().map(|name| (HISTORY, name.as_str())))
            .collect();
        runs.iter().try_for_each(|run| check_directory(run))?;
        if columns.is_empty() {
            return Err(nothing_chosen(runs));
        }
        let mut series = Vec::new();
        for &(file, column) in &columns {
            for (run, name) in runs.iter().zip(names(runs)) {
                let table = StoredTable::read(&run.join(file))?;
                let points = table.column("t")?.iter().copied().zip(table.column(column)?.iter().copied()).collect();
                let name = if columns.len() > 1 { format!("{name}: {column}") } else { name };
                // Curves that coincide can still be told apart.
                let style = [Style::Solid, Style::Dashed, Style::Dotted][series.len() % 3];
                series.push(LineSeries { name, points, style });
            }
        }
        let labels: Vec<String> = columns.iter().map(|&(_, column)| label(column)).collect();
        let y_label = match labels.as_slice() {
            [one] => one.clone(),
            several => {
                let unit = |label: &String| label.split_once('[').map(|(_, unit)| format!("[{unit}"));
                let common = several
                    .first()
                    .and_then(unit)
                    .filter(|own| several.iter().all(|label| unit(label).as_ref() == Some(own)));
                common.unwrap_or_default()
            }
        };
        let title = columns.iter().map(|(_, column)| *column).collect::<Vec<_>>().join(", ");
        Ok(LinePlot { title, x_label: "t [s]".to_owned(), y_label, series, ..LinePlot::default() })
    }
}

fn nothing_chosen(runs: &[PathBuf]) -> OutputError {
    let names = |file: &str| {
        let table = runs.first().and_then(|run| StoredTable::read(&run.join(file)).ok());
        table.map_or_else(|| "none".to_owned(), |table| table.names()[1.min(table.names().len())..].join(", "))
    };
    let remedy = format!("give --probe (there are: {}) or --quantity (there are: {})", names(PROBES), names(HISTORY));
    OutputError::request("nothing is chosen to be plotted", remedy)
}

/// The column with its unit.
fn label(column: &str) -> String {
    let component = column.rsplit_once('.').map(|(_, component)| component);
    let unit = match (column, component.and_then(|component| component.chars().next())) {
        (_, Some('u')) => " [m]",
        (_, Some('v')) => " [m/s]",
        ("dt", _) => " [s]",
        ("kinetic" | "internal" | "external" | "dissipated" | "total" | "hourglass", _) => " [J]",
        _ => "",
    };
    format!("{column}{unit}")
}

/// The names of the directories, with as many of those above them as tell them apart.
fn names(runs: &[PathBuf]) -> Vec<String> {
    let parts = |run: &Path, count: usize| -> String {
        let whole = std::fs::canonicalize(run).unwrap_or_else(|_| run.to_path_buf());
        let all: Vec<_> = whole.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
        all[all.len().saturating_sub(count)..].join("/")
    };
    runs.iter()
        .map(|run| {
            let others = || runs.iter().filter(|other| *other != run);
            let enough = (1..8).find(|&count| others().all(|other| parts(other, count) != parts(run, count)));
            enough.map_or_else(|| name_of(run), |count| parts(run, count))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(directory: &Path, name: &str, rows: &str) -> PathBuf {
        let run = directory.join(name);
        std::fs::create_dir_all(&run).unwrap();
        std::fs::write(run.join(PROBES), format!("t,tip.ux,tip.uy,tip.vx\n{rows}")).unwrap();
        std::fs::write(run.join(HISTORY), format!("t,dt,total,kinetic\n{rows}")).unwrap();
        run
    }

    #[test]
    fn every_run_has_its_curve_and_its_name() {
        let directory = tempfile::tempdir().unwrap();
        let first = run(directory.path(), "coarse/späce out", "0,0,1,2\n1,2,3,4\n");
        let second = run(directory.path(), "fine/späce out", "0,0,5,6\n2,7,8,9\n3,1");
        let runs = [first, second];
        let comparison = Comparison { probes: vec!["tip.uy".into()], ..Comparison::default() };
        let plot = comparison.plot(&runs).unwrap();
        let found: Vec<_> = plot.series.iter().map(|series| (series.name.as_str(), &series.points[..])).collect();
        assert_eq!(
            found,
            [("coarse/späce out", &[(0.0, 1.0), (1.0, 3.0)][..]), ("fine/späce out", &[(0.0, 5.0), (2.0, 8.0)])]
        );
        assert_eq!((plot.y_label.as_str(), plot.title.as_str()), ("tip.uy [m]", "tip.uy"));
        let both = Comparison { quantities: vec!["total".into(), "kinetic".into()], ..Comparison::default() };
        let plot = both.plot(&runs).unwrap();
        assert_eq!((plot.series.len(), plot.y_label.as_str()), (4, "[J]"));
        assert_eq!(plot.series[1].name, "fine/späce out: total");
    }

    #[test]
    fn wrong_requests_name_what_there_is() {
        let directory = tempfile::tempdir().unwrap();
        let runs = [run(directory.path(), "a", "0,0,1,2\n")];
        let refusal = |probe: &str, runs: &[PathBuf]| {
            let probes = if probe.is_empty() { vec![] } else { vec![probe.to_owned()] };
            let error = Comparison { probes, ..Comparison::default() }.plot(runs).unwrap_err();
            assert!(error.is_input());
            error.to_string()
        };
        assert!(refusal("tip.uz", &runs).contains("did you mean `tip.u"), "{}", refusal("tip.uz", &runs));
        assert!(refusal("nose", &runs).contains("choose one of: tip.ux, tip.uy, tip.vx"));
        assert!(refusal("", &runs).contains("there are: dt, total, kinetic"));
        assert!(refusal("tip.ux", &[directory.path().join("absent")]).contains("correct the path"));
    }
}
