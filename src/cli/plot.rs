//! `nicolson plot`: one quantity of several runs in one plot.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use std::path::PathBuf;

use clap::Args;

use super::DONE;
use super::render::report_output;
use crate::output::Comparison;

/// What to plot, as given on the command line.
#[derive(Debug, Args)]
pub struct PlotArguments {
    /// Directories of runs, finished or not.
    #[arg(value_name = "RUN_DIR", required = true)]
    runs: Vec<PathBuf>,
    /// Column of probes.csv: probe and component, as in tip.uy; may be repeated.
    #[arg(long = "probe", value_name = "PROBE.COMPONENT")]
    probes: Vec<String>,
    /// Column of history.csv, as total or newton_iterations; may be repeated.
    #[arg(long = "quantity", value_name = "COLUMN")]
    quantities: Vec<String>,
    /// Picture to write: .svg or .png [default: COLUMN.svg].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Plots, and prints the name of the file.
pub fn plot(arguments: PlotArguments) -> u8 {
    let PlotArguments { runs, probes, quantities, out } = arguments;
    match (Comparison { probes, quantities, out }).write(&runs) {
        Ok(file) => {
            println!("{}", file.display());
            DONE
        }
        Err(error) => report_output(&error),
    }
}
