//! `nicolson collect`: the reports of a study in one table.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use std::path::PathBuf;

use clap::Args;

use super::DONE;
use super::render::report_output;
use crate::study::{Collected, collect};

/// What to collect, as given on the command line.
#[derive(Debug, Args)]
pub struct CollectArguments {
    /// Directory of a study.
    #[arg(value_name = "STUDY_DIR")]
    study: PathBuf,
    /// Table to write [default: cases.csv in STUDY_DIR].
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
}

/// Collects, and prints what was found.
pub fn run_collect(arguments: &CollectArguments) -> u8 {
    match collect(&arguments.study, arguments.out.as_deref()) {
        Ok(collected) => {
            print_collected(&collected);
            DONE
        }
        Err(error) => report_output(&error),
    }
}

/// Prints tables of orders, and the names of the files.
pub fn print_collected(collected: &Collected) {
    collected.tables.iter().for_each(|table| println!("\n{table}"));
    println!("{} of {} cases completed", collected.completed, collected.cases);
    collected.files.iter().for_each(|file| println!("{}", file.display()));
}
