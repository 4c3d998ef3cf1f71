//! The rows of the study as a CSV file, a table and a figure.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nicolson::output::{LinePlot, LineSeries, Style};

use super::basics::reason;
use super::case::{CONTROL, Case, Matrices};
use super::measure::{Found, Values};

const COLUMNS: [&str; 18] = [
    "cloud",
    "layout",
    "kernel",
    "smoothing",
    "weights",
    "alpha",
    "particles",
    "neighbours",
    "row",
    "entries_per_row",
    "cost",
    "balancing_seconds",
    "static_error",
    "frequency_error_1",
    "frequency_error_2",
    "frequency_error_3",
    "lowest_spurious",
    "impossible",
];

/// One case with one coefficient of the control.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub case: Case,
    pub alpha: f64,
    pub particles: usize,
    pub neighbours: f64,
    /// Particles in a row of the tangent.
    pub coupled: f64,
    /// Over the least of all.
    pub cost: f64,
    pub balancing: f64,
    /// Relative, positive if too soft.
    pub static_error: f64,
    /// Relative.
    pub frequency_errors: [f64; 3],
    /// Over the lowest physical frequency.
    pub spurious: f64,
    /// Why there are no numbers.
    pub impossible: String,
}

impl Row {
    /// Compares what was found.
    pub fn new(case: &Case, cost: f64, matrices: &Matrices, alpha: f64, found: Found, reference: &Values) -> Self {
        let lowest = reference.frequencies[0];
        Self {
            case: *case,
            alpha,
            particles: matrices.masses.len() / 2,
            neighbours: matrices.neighbours,
            coupled: matrices.row,
            cost,
            balancing: matrices.balancing,
            static_error: found.values.response / reference.response - 1.0,
            frequency_errors: std::array::from_fn(|i| found.values.frequencies[i] / reference.frequencies[i] - 1.0),
            spurious: found.spurious / lowest,
            impossible: String::new(),
        }
    }

    /// A case that cannot be.
    pub fn impossible(case: &Case, cost: f64, reason: String) -> Self {
        Self {
            case: *case,
            alpha: f64::NAN,
            particles: 0,
            neighbours: f64::NAN,
            coupled: f64::NAN,
            cost,
            balancing: f64::NAN,
            static_error: f64::NAN,
            frequency_errors: [f64::NAN; 3],
            spurious: f64::NAN,
            impossible: reason,
        }
    }

    /// The largest frequency error, with its sign.
    fn frequency_error(&self) -> f64 {
        self.frequency_errors
            .iter()
            .copied()
            .fold(0.0, |worst: f64, error| if error.abs() > worst.abs() || error.is_nan() { error } else { worst })
    }

    /// The larger one of both errors.
    fn error(&self) -> f64 {
        self.static_error.abs().max(self.frequency_error().abs())
    }
}

/// Writes `discretisation-study.csv`, `.md`, `.svg` and `.png`.
///
/// # Errors
/// In words, with the file.
pub fn write(directory: &Path, rows: &[Row]) -> Result<Vec<PathBuf>, String> {
    std::fs::create_dir_all(directory).map_err(reason(directory))?;
    let stem = directory.join("discretisation-study");
    let (table, text) = (stem.with_extension("csv"), stem.with_extension("md"));
    let mut writer = csv::Writer::from_path(&table).map_err(reason(&table))?;
    writer.write_record(COLUMNS).map_err(reason(&table))?;
    for row in rows {
        let Case { cloud, layout, kernel, smoothing, weights, .. } = row.case;
        let mut record: Vec<String> =
            [cloud.name(), layout, kernel, &smoothing.to_string(), weights].map(str::to_owned).into();
        record.extend([row.alpha.to_string(), row.particles.to_string()]);
        record.extend([row.neighbours, row.coupled, 2.0 * row.coupled, row.cost].map(|value| format!("{value:.2}")));
        record.extend([row.balancing, row.static_error].map(|value| format!("{value:.4e}")));
        record.extend(row.frequency_errors.map(|value| format!("{value:.4e}")));
        record.extend([format!("{:.4}", row.spurious), row.impossible.clone()]);
        writer.write_record(&record).map_err(reason(&table))?;
    }
    writer.flush().map_err(reason(&table))?;
    std::fs::write(&text, markdown(rows)).map_err(reason(&text))?;
    let figure = picture(rows).write(&stem).map_err(|error| error.to_string())?;
    Ok([table, text].into_iter().chain(figure).collect())
}

/// One line per case; errors for all coefficients of the control beside each other.
fn markdown(rows: &[Row]) -> String {
    let list = CONTROL.map(|alpha| alpha.to_string()).join(" / ");
    let mut text = format!(
        "Errors in % and lowest spurious frequency over the lowest physical one for hourglass coefficients {list}.\n\
         NaN: no such mode. An error of many % of a frequency: the mode was not found among spurious ones.\n\n\
         | cloud | layout | kernel | h/Δx | weights | neighbours | coupled | cost | static | frequency | spurious |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n"
    );
    for group in rows.chunk_by(|a, b| a.case == b.case) {
        let Some(first) = group.first() else { continue };
        let Case { cloud, layout, kernel, smoothing, weights, .. } = first.case;
        let start = format!("| {} | {layout} | {kernel} | {smoothing} | {weights} |", cloud.name());
        if !first.impossible.is_empty() {
            let _ = writeln!(text, "{start} | | {:.1} | impossible | | |", first.cost);
            continue;
        }
        let percent = |error: fn(&Row) -> f64| {
            group.iter().map(|row| format!("{:+.1}", 100.0 * error(row))).collect::<Vec<_>>().join(" / ")
        };
        let spurious: Vec<String> = group.iter().map(|row| format!("{:.2}", row.spurious)).collect();
        let _ = writeln!(
            text,
            "{start} {:.1} | {:.1} | {:.1} | {} | {} | {} |",
            first.neighbours,
            first.coupled,
            first.cost,
            percent(|row| row.static_error),
            percent(Row::frequency_error),
            spurious.join(" / ")
        );
    }
    text
}

/// The larger error against the cost, on straight and perturbed lattices of vertices.
fn picture(rows: &[Row]) -> LinePlot {
    let series = |name: &str, weights: &str, alpha: f64| LineSeries {
        name: name.into(),
        points: rows
            .iter()
            .filter(|row| row.case.layout == "vertex" && row.case.weights == weights && row.alpha == alpha)
            .map(|row| (row.cost, 100.0 * row.error()))
            .collect(),
        style: Style::Points,
    };
    LinePlot {
        title: "Error against cost: beam, perturbed beam and ring of vertices, all kernels and smoothing lengths"
            .into(),
        x_label: "time to assemble and factorise, over the least".into(),
        y_label: "larger one of static and frequency error [%]".into(),
        series: vec![
            series("separate, no control", "separate", 0.0),
            series("balanced, no control", "balanced", 0.0),
            series("separate, α = 2", "separate", 2.0),
            series("balanced, α = 3", "balanced", 3.0),
        ],
        log_x: true,
        log_y: true,
        ..LinePlot::default()
    }
}
