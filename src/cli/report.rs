//! `nicolson report`: a run as one HTML file.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use std::path::PathBuf;

use clap::Args;

use super::DONE;
use super::render::report_output;
use crate::output::HtmlReport;

/// What to report, as given on the command line.
#[derive(Debug, Args)]
pub struct ReportArguments {
    /// Directory of a run, finished or not.
    #[arg(value_name = "RUN_DIR")]
    run: PathBuf,
    /// File to write [default: report.html in RUN_DIR].
    #[arg(long, value_name = "FILE.html")]
    out: Option<PathBuf>,
}

/// Writes the file and prints its name.
pub fn report(arguments: ReportArguments) -> u8 {
    match (HtmlReport { out: arguments.out }).write(&arguments.run) {
        Ok(file) => {
            println!("{}", file.display());
            DONE
        }
        Err(error) => report_output(&error),
    }
}
