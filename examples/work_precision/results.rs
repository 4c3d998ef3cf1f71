//! The rows of the sweep as a CSV file, a table and figures.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nicolson::output::{LinePlot, LineSeries, PlotGrid, Style};

use super::basics::reason;
use super::case::Solution;
use super::problem::METHODS;
use super::sweep::{Row, seconds_to};

/// The error at which methods are compared.
pub const LEVEL: f64 = 0.01;

const COLUMNS: [&str; 20] = [
    "scene",
    "method",
    "implicit",
    "step",
    "steps",
    "time_error",
    "reference_error",
    "total_error",
    "seconds",
    "setup_seconds",
    "rate_seconds",
    "rate_equivalents",
    "rate_evaluations",
    "residual_evaluations",
    "newton_iterations",
    "assemblies",
    "factorisations",
    "linear_solves",
    "tangent_actions",
    "ended_early",
];

/// Writes a table of records.
///
/// # Errors
/// In words, with the file.
pub fn write_table(path: &Path, columns: &[&str], records: &[Vec<String>]) -> Result<(), String> {
    let mut writer = csv::Writer::from_path(path).map_err(reason(path))?;
    writer.write_record(columns).map_err(reason(path))?;
    records.iter().try_for_each(|record| writer.write_record(record)).map_err(reason(path))?;
    writer.flush().map_err(reason(path))
}

/// Writes `work-precision.csv`, `.md`, and the figures `work-precision-time` and `work-precision-evaluations`.
///
/// # Errors
/// In words, with the file.
pub fn write(directory: &Path, rows: &[Row]) -> Result<Vec<PathBuf>, String> {
    let stem = directory.join("work-precision");
    let (table, text) = (stem.with_extension("csv"), stem.with_extension("md"));
    write_table(&table, &COLUMNS, &rows.iter().map(record).collect::<Vec<_>>())?;
    std::fs::write(&text, markdown(rows)).map_err(reason(&text))?;
    let mut files = vec![table, text];
    let time = figure(rows, "time of stepping [s]", |solution| solution.work.seconds);
    let evaluations = figure(rows, "evaluations of rates and residuals", |solution| solution.work.evaluations() as f64);
    for (name, figure) in [("work-precision-time", time), ("work-precision-evaluations", evaluations)] {
        files.extend(figure.write(&directory.join(name)).map_err(|error| error.to_string())?);
    }
    Ok(files)
}

fn record(row: &Row) -> Vec<String> {
    let nothing = Solution::default();
    let Solution { total_error, work, step, .. } = row.solution.as_ref().unwrap_or(&nothing);
    let number = |value: f64| if value.is_finite() { format!("{value:.4e}") } else { String::new() };
    let mut record =
        vec![row.problem.name.to_owned(), row.method.name.to_owned(), row.method.is_implicit().to_string()];
    record.extend([number(*step), work.steps.to_string()]);
    record.extend([row.error, row.uncertainty, *total_error].map(number));
    record.extend([work.seconds, work.setup, work.rate_seconds, work.equivalents()].map(number));
    let counts =
        [work.rates, work.residuals, work.newton, work.assemblies, work.factorisations, work.solves, work.actions];
    record.extend(counts.map(|count| count.to_string()));
    record.push(row.solution.as_ref().err().cloned().unwrap_or_default());
    record
}

/// Errors and costs of a scene with a method, from the longest step to the shortest.
fn points(rows: &[Row], scene: &str, method: &str, cost: impl Fn(&Solution) -> f64) -> Vec<(f64, f64)> {
    rows.iter()
        .filter(|row| row.problem.name == scene && row.method.name == method)
        .map(|row| (row.error, row.solution.as_ref().map_or(f64::NAN, &cost)))
        .collect()
}

fn scenes(rows: &[Row]) -> Vec<&'static str> {
    let mut names: Vec<&str> = rows.iter().map(|row| row.problem.name).collect();
    names.dedup();
    names
}

/// A duration with its sign of being a bound: the longest step is below the error already.
pub fn duration((seconds, bounded): (f64, bool)) -> String {
    format!("{}{seconds:.2e} s", if bounded { "≤ " } else { "" })
}

/// Seconds to the level by scene and method, and the best explicit over the best implicit one.
fn markdown(rows: &[Row]) -> String {
    let mut text = format!("Seconds of stepping to a time error of {} %, one thread.\n\n| scene |", 100.0 * LEVEL);
    METHODS.iter().for_each(|method| _ = write!(text, " {} |", method.name));
    let _ = writeln!(text, " explicit / implicit |\n|---|{}---|", "---|".repeat(METHODS.len()));
    for scene in scenes(rows) {
        let _ = write!(text, "| {scene} |");
        let mut best = [f64::INFINITY; 2];
        for method in METHODS {
            let found = seconds_to(LEVEL, &points(rows, scene, method.name, |solution| solution.work.seconds));
            let _ = write!(text, " {} |", found.map_or_else(|| "–".to_owned(), duration));
            let best = &mut best[usize::from(method.is_implicit())];
            *best = best.min(found.map_or(f64::INFINITY, |(seconds, _)| seconds));
        }
        let _ = writeln!(text, " {:.1} |", best[0] / best[1]);
    }
    text
}

/// A diagram for every scene.
fn figure(rows: &[Row], label: &str, cost: impl Fn(&Solution) -> f64) -> PlotGrid {
    let plot = |scene: &str| {
        let series = METHODS.iter().map(|method| LineSeries {
            name: method.name.into(),
            points: points(rows, scene, method.name, &cost).into_iter().map(|(error, cost)| (cost, error)).collect(),
            style: if method.is_implicit() { Style::SolidWithPoints } else { Style::DashedWithPoints },
        });
        LinePlot {
            title: scene.to_owned(),
            x_label: label.to_owned(),
            y_label: "time error over the largest displacement".into(),
            // What blew up would hide the rest.
            series: series.map(shown).collect(),
            log_x: true,
            log_y: true,
            ..LinePlot::default()
        }
    };
    PlotGrid { columns: 2, plots: scenes(rows).into_iter().map(plot).collect() }
}

/// Without errors above 1.
fn shown(mut series: LineSeries) -> LineSeries {
    series.points.retain(|(_, error)| *error <= 1.0);
    series
}
