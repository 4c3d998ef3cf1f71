//! The reports of all cases in one table.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::convergence::{self, ConvergenceTable};
use super::quantity::find;
use super::sweep::CASE_FILE;
use super::{Case, STUDY_FILE, Study};
use crate::output::{OutputError, Report, Status, write_atomically};

/// Name of the table, unless another is wanted.
const TABLE: &str = "cases.csv";
/// Columns behind the varied keys, as titles and paths in the report.
const COLUMNS: [(&str, &str); 9] = [
    ("time", "time_reached"),
    ("particles", "particles"),
    ("unknowns", "unknowns"),
    ("steps", "steps.accepted"),
    ("rejected_steps", "steps.rejected"),
    ("newton_iterations", "newton.iterations"),
    ("linear_iterations", "linear.iterations"),
    ("wall_seconds", "wall_seconds.total"),
    ("energy_drift", "energy.max_relative_drift"),
];

/// What was collected.
#[derive(Debug, Clone)]
pub struct Collected {
    /// The files that were written, the table first.
    pub files: Vec<PathBuf>,
    /// Number of cases of the study.
    pub cases: usize,
    /// Those that were completed.
    pub completed: usize,
    /// Observed orders, of a convergence study.
    pub tables: Vec<ConvergenceTable>,
}

/// Writes a table with a row for every case: its number, the varied keys, how it ended, what it took, `errors.*`, the
/// final state of the probes, and a message. Columns are named like `--set` keys and paths in `report.json`. The status is
/// that of the report; `outdated` if it is that of other overrides; `missing` if there is none. Also writes the orders of
/// a convergence study.
///
/// # Errors
/// [`OutputError::Request`] if the directory is not that of a study; [`OutputError::File`] if the disk refuses.
pub fn collect(directory: &Path, out: Option<&Path>) -> Result<Collected, OutputError> {
    let copy = directory.join(STUDY_FILE);
    if !copy.is_file() {
        let what = format!("there is no {STUDY_FILE} in {}", directory.display());
        return Err(OutputError::request(
            what,
            "give the directory of a study (`nicolson sweep STUDY.toml --out DIR`)",
        ));
    }
    let study =
        Study::read(&copy).map_err(|errors| OutputError::Malformed { path: copy, reason: errors.to_string() })?;
    let found: Vec<Found> = study.cases.iter().map(|case| look(directory, case)).collect();
    let file = out.map_or_else(|| directory.join(TABLE), Path::to_path_buf);
    write_table(&study, &found, &file)?;
    let mut files = vec![file];
    let mut tables = Vec::new();
    if let Some(wanted) = &study.convergence {
        let value = |case: &Case, path: &str| {
            found.get(case.index - 1).and_then(|found| found.completed()).and_then(|report| find(report, path))
        };
        tables = convergence::tables(&study, wanted, &value);
        files.extend(convergence::write(&tables, wanted, &study.title, directory)?);
    }
    let completed = found.iter().filter(|found| found.status == "completed").count();
    Ok(Collected { files, cases: study.cases.len(), completed, tables })
}

/// What the directory of a case holds.
struct Found {
    status: &'static str,
    report: Option<Value>,
}

impl Found {
    fn completed(&self) -> Option<&Value> {
        self.report.as_ref().filter(|_| self.status == "completed")
    }
}

fn look(directory: &Path, case: &Case) -> Found {
    let directory = directory.join(case.directory());
    let Some(report) = Report::read(&directory).ok() else { return Found { status: "missing", report: None } };
    let overridden = std::fs::read_to_string(directory.join(CASE_FILE)).unwrap_or_default();
    if !overridden.ends_with(&case.table()) {
        return Found { status: "outdated", report: None };
    }
    let status = match report.status {
        Status::Completed => "completed",
        Status::Failed => "failed",
        Status::Interrupted => "interrupted",
    };
    Found { status, report: serde_json::to_value(report).ok() }
}

fn write_table(study: &Study, found: &[Found], file: &Path) -> Result<(), OutputError> {
    let mut measured = BTreeSet::new();
    for report in found.iter().filter_map(|found| found.report.as_ref()) {
        for group in ["errors", "probes"] {
            paths(&report[group], group.to_owned(), &mut measured);
        }
    }
    let mut rows = vec![vec!["case".to_owned()]];
    rows[0].extend(study.keys.iter().cloned());
    rows[0].push("status".to_owned());
    rows[0].extend(COLUMNS.iter().map(|(title, _)| (*title).to_owned()));
    rows[0].extend(measured.iter().cloned());
    rows[0].push("message".to_owned());
    for (case, Found { status, report }) in study.cases.iter().zip(found) {
        let cell = |path: &str| {
            let number = report.as_ref().and_then(|report| find(report, path));
            number.map(crate::output::number_text).unwrap_or_default()
        };
        let mut row = vec![case.index.to_string()];
        let value = |key: &String| case.varied().iter().find(|one| one.key == *key).map(|one| plain(&one.value));
        row.extend(study.keys.iter().map(|key| value(key).unwrap_or_default()));
        row.push((*status).to_owned());
        row.extend(COLUMNS.iter().map(|(_, path)| cell(path)));
        row.extend(measured.iter().map(|path| cell(path)));
        let message = report.as_ref().and_then(|report| report["message"].as_str()).unwrap_or_default();
        row.push(message.to_owned());
        rows.push(row);
    }
    write_csv(file, &rows)
}

/// Writes rows of text as CSV, as a whole or not at all.
pub(super) fn write_csv(file: &Path, rows: &[Vec<String>]) -> Result<(), OutputError> {
    write_atomically(file, |writer| {
        let mut table = csv::Writer::from_writer(writer);
        for row in rows {
            table.write_record(row)?;
        }
        table.flush()
    })
}

/// A text without its quotes; anything else as it is.
pub(super) fn plain(value: &str) -> String {
    match value.parse::<toml_edit::Value>() {
        Ok(toml_edit::Value::String(text)) => text.into_value(),
        _ => value.to_owned(),
    }
}

/// Paths of all numbers below an entry.
fn paths(value: &Value, place: String, found: &mut BTreeSet<String>) {
    match value {
        Value::Number(_) => {
            found.insert(place);
        }
        Value::Object(entries) => entries.iter().for_each(|(key, entry)| paths(entry, format!("{place}.{key}"), found)),
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(at, entry)| paths(entry, format!("{place}.{at}"), found))
        }
        _ => {}
    }
}
