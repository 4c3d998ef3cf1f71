//! Tables and pictures of observed orders.

use std::fmt;
use std::path::{Path, PathBuf};

use super::cases::label;
use super::collect::{plain, write_csv};
use super::orders::{Level, Reference, levels};
use super::{Case, Convergence, Study};
use crate::output::{LinePlot, LineSeries, OutputError, PlotGrid, Slope, Style, number_text};

/// One quantity on all levels, for one row of the grid.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvergenceTable {
    /// Path of the quantity in the report.
    pub quantity: String,
    /// What is varied besides the size; empty for a study that only refines.
    pub row: String,
    /// What a size is: a key, or `size`.
    pub size_name: String,
    /// The levels, from coarse to fine.
    pub levels: Vec<Level>,
    /// What errors are measured against.
    pub reference: Reference,
}

/// The tables of a study, quantity by quantity.
pub(super) fn tables(
    study: &Study,
    wanted: &Convergence,
    value: &dyn Fn(&Case, &str) -> Option<f64>,
) -> Vec<ConvergenceTable> {
    let mut tables = Vec::new();
    for quantity in &wanted.quantities {
        for row in study.cases.chunk_by(|a, b| a.row == b.row) {
            let cases: Vec<(usize, f64)> = row.iter().map(|case| (case.index, wanted.sizes[case.level])).collect();
            let values: Vec<Option<f64>> = row.iter().map(|case| value(case, quantity)).collect();
            let (levels, reference) = levels(&cases, &values, quantity.starts_with("errors."), wanted.exact);
            let fixed = row[0].varied().len() - wanted.refined();
            let row = label(&row[0].varied()[..fixed]);
            let (quantity, size_name) = (quantity.clone(), wanted.size_name.clone());
            tables.push(ConvergenceTable { quantity, row, size_name, levels, reference });
        }
    }
    tables
}

impl fmt::Display for ConvergenceTable {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row = if self.row.is_empty() { String::new() } else { format!(" ({})", self.row) };
        writeln!(formatter, "{}{row}", self.quantity)?;
        let width = self.size_name.chars().count().max(10);
        let is_error = self.reference == Reference::Itself;
        let value_title = if is_error { String::new() } else { format!("  {:>16}", "value") };
        writeln!(
            formatter,
            "  {:>5}  {:>width$}{value_title}  {:>10}  {:>6}",
            "case", self.size_name, "error", "order"
        )?;
        for level in &self.levels {
            let Level { case, size, value, error, order } = level;
            let error = error.map_or_else(|| "–".to_owned(), |error| format!("{error:.3e}"));
            let order = order.map_or_else(|| "–".to_owned(), |order| format!("{order:.2}"));
            let value = match (is_error, value) {
                (true, _) => String::new(),
                (false, Some(value)) => format!("  {value:>16.9e}"),
                (false, None) => format!("  {:>16}", "–"),
            };
            writeln!(formatter, "  {case:>5}  {size:>width$}{value}  {error:>10}  {order:>6}")?;
        }
        match self.reference {
            Reference::Itself => Ok(()),
            Reference::Exact(value) => writeln!(formatter, "  errors against the exact value {value:e}"),
            Reference::Extrapolated { value, order } => writeln!(
                formatter,
                "  errors against {value:.9e}, extrapolated from the three finest levels with order {order:.2}"
            ),
            Reference::Unknown(why) => writeln!(formatter, "  no orders: {why}"),
        }
    }
}

/// Writes `convergence.csv`, `convergence.svg` and `convergence.png`.
pub(super) fn write(
    tables: &[ConvergenceTable],
    wanted: &Convergence,
    title: &str,
    directory: &Path,
) -> Result<Vec<PathBuf>, OutputError> {
    let file = directory.join("convergence.csv");
    let titles = ["quantity", "row", "case", "size", "value", "error", "order", "limit", "reference"];
    let mut rows = vec![titles.map(str::to_owned).to_vec()];
    for table in tables {
        let (limit, reference) = match table.reference {
            Reference::Itself => (String::new(), "itself"),
            Reference::Exact(value) => (number_text(value), "exact"),
            Reference::Extrapolated { value, .. } => (number_text(value), "extrapolated"),
            Reference::Unknown(_) => (String::new(), "unknown"),
        };
        for level in &table.levels {
            let cell = |value: Option<f64>| value.map(number_text).unwrap_or_default();
            rows.push(vec![
                table.quantity.clone(),
                table.row.clone(),
                level.case.to_string(),
                number_text(level.size),
                cell(level.value),
                cell(level.error),
                cell(level.order),
                limit.clone(),
                reference.to_owned(),
            ]);
        }
    }
    write_csv(&file, &rows)?;
    let plots = wanted.quantities.iter().map(|quantity| plot(tables, quantity, title)).collect();
    let [svg, png] = PlotGrid { columns: 2, plots }.write(&directory.join("convergence"))?;
    Ok(vec![file, svg, png])
}

/// Errors against sizes, with a triangle of the order that the finest two levels come nearest to.
fn plot(tables: &[ConvergenceTable], quantity: &str, title: &str) -> LinePlot {
    let mut series = Vec::new();
    let mut slopes: Vec<Slope> = Vec::new();
    let mut size_name = "size".to_owned();
    for table in tables.iter().filter(|table| table.quantity == quantity) {
        size_name.clone_from(&table.size_name);
        let points: Vec<(f64, f64)> = table
            .levels
            .iter()
            .filter_map(|level| Some((level.size, level.error.filter(|error| *error > 0.0)?)))
            .collect();
        if let (&[.., coarse, fine], Some(order)) =
            (&points[..], table.levels.iter().rev().find_map(|level| level.order))
        {
            let nominal = (2.0 * order).round() / 2.0;
            if nominal > 0.0 && !slopes.iter().any(|slope| slope.order == nominal) {
                slopes.push(Slope { order: nominal, from: fine, to: coarse.0 });
            }
        }
        series.push(LineSeries { name: plain(&table.row), points, style: Style::SolidWithPoints });
    }
    let errors = tables.iter().any(|table| table.quantity == quantity && table.reference != Reference::Itself);
    let y_label = if errors { format!("error of {quantity}") } else { quantity.to_owned() };
    LinePlot {
        title: title.to_owned(),
        x_label: size_name,
        y_label,
        series,
        log_x: true,
        log_y: true,
        slopes,
        ..LinePlot::default()
    }
}
