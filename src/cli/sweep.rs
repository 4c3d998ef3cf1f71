//! `nicolson sweep`: the cases of a study.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is the command line's output")]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;

use super::collect::print_collected;
use super::console::{complain, duration, warn};
use super::render::report_output;
use super::signals::listen;
use super::{DONE, FAILED, INTERRUPTED, WRONG_INPUT, memory_limit};
use crate::output::{OutputError, Status};
use crate::study::{CaseState, Event, ReadyCase, Study, SweepOptions, SweepSummary, collect, state_of, sweep};

/// Time between two lines about running cases.
const TELLING: Duration = Duration::from_secs(10);

/// What to run, as given on the command line.
#[derive(Debug, Args)]
pub struct SweepArguments {
    /// Study file (TOML): a scene, and what varies in it.
    #[arg(value_name = "STUDY.toml")]
    study: PathBuf,
    /// Directory for results [default: results/STUDY].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Cases that run at the same time [default: as many as fill the cores]. Fewer do if the largest need more memory
    /// together than there is.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Threads of each case. Results do not depend on it.
    #[arg(long, value_name = "N", default_value_t = 1)]
    threads: usize,
    /// Run only the case of this number, counted from 1: for one job of an array.
    #[arg(long, value_name = "N")]
    index: Option<usize>,
    /// List the cases and what would be done with them; run nothing.
    #[arg(long)]
    dry_run: bool,
    /// Leave cases alone that failed before.
    #[arg(long)]
    keep_failed: bool,
    /// Go on even if a case, or several at the same time, seem to need more memory than there is.
    #[arg(long)]
    ignore_memory: bool,
    /// No progress, no summary: only errors.
    #[arg(long)]
    quiet: bool,
}

/// Runs the study and returns the exit code.
pub fn run_study(arguments: &SweepArguments, command: String) -> u8 {
    let SweepArguments { threads, index, dry_run, quiet, .. } = *arguments;
    if threads == 0 || arguments.jobs == Some(0) {
        complain("--jobs and --threads: at least one is needed");
        return WRONG_INPUT;
    }
    let mut study = match Study::read(&arguments.study) {
        Ok(study) => study,
        Err(errors) => return refused(&errors.to_string()),
    };
    study.limit_memory(memory_limit(arguments.ignore_memory));
    let chosen = match index {
        None => &study.cases[..],
        Some(index) => match index.checked_sub(1).and_then(|at| study.cases.get(at..=at)) {
            Some(one) => one,
            None => return refused(&format!("--index {index}: the cases are 1 to {}", study.cases.len())),
        },
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = arguments.jobs.unwrap_or((cores / threads).max(1)).min(chosen.len());
    let pool = match rayon::ThreadPoolBuilder::new().num_threads(jobs).build() {
        Ok(pool) => pool,
        Err(error) => return refused(&format!("cannot start the threads: {error}")),
    };
    let cases = match pool.install(|| study.ready(chosen)) {
        Ok(cases) => cases,
        Err(errors) => return refused(&errors.to_string()),
    };
    drop(pool);
    let stem = arguments.study.file_stem().unwrap_or_default();
    let directory = arguments.out.clone().unwrap_or_else(|| PathBuf::from("results").join(stem));
    if dry_run {
        list(&study, &cases, &directory, arguments.keep_failed);
        return DONE;
    }
    let signals = listen();
    let mut teller = Teller::new(&study, cases.len(), quiet);
    let options = SweepOptions { directory, jobs, threads, keep_failed: arguments.keep_failed, command };
    let summary = match sweep(&study, &cases, &options, &mut |event| teller.hear(event), &signals.interrupt) {
        Ok(summary) => summary,
        // Nothing was computed.
        Err(error @ (OutputError::NotADirectory { .. } | OutputError::File { .. })) => {
            return refused(&error.to_string());
        }
        Err(error) => return report_output(&error),
    };
    // Jobs of an array would write the same table at the same time.
    let collected = if index.is_none() { collect(&options.directory, None).map(Some) } else { Ok(None) };
    if !quiet {
        println!("{}", in_words(&summary));
        match &collected {
            Ok(Some(collected)) => print_collected(collected),
            _ => println!("results in {}", options.directory.display()),
        }
    }
    if let Err(error) = collected {
        return report_output(&error);
    }
    match summary {
        SweepSummary { interrupted: true, .. } => INTERRUPTED,
        SweepSummary { failed: 1.., .. } | SweepSummary { kept: 1.., .. } => FAILED,
        _ => DONE,
    }
}

fn refused(message: &str) -> u8 {
    complain(message);
    WRONG_INPUT
}

fn in_words(summary: &SweepSummary) -> String {
    let SweepSummary { completed, failed, skipped, kept, interrupted } = *summary;
    let mut text =
        format!("{}: {completed} completed, {failed} failed", if interrupted { "interrupted" } else { "done" });
    if skipped > 0 {
        text += &format!(", {skipped} completed before");
    }
    if kept > 0 {
        text += &format!(", {kept} failed before and left alone");
    }
    text
}

fn list(study: &Study, cases: &[ReadyCase], directory: &Path, keep_failed: bool) {
    println!("{}: {} cases of {} in {}", study.title, study.cases.len(), study.scene.display(), directory.display());
    for ReadyCase { case, scene, .. } in cases {
        let plan = match state_of(&directory.join(case.directory()), scene) {
            CaseState::Completed => "skip: completed",
            CaseState::Failed if keep_failed => "leave: failed",
            CaseState::Failed => "run again: failed",
            CaseState::Interrupted => "go on: interrupted",
            CaseState::Outdated => "run again: results of another scene",
            CaseState::Missing => "run",
        };
        println!("{}  {plan}  {}", case.directory(), case.label());
    }
}

/// Lines about a sweep on standard error.
struct Teller<'a> {
    study: &'a Study,
    quiet: bool,
    wanted: usize,
    ended: usize,
    begun: usize,
    start: Instant,
    told: Instant,
}

impl<'a> Teller<'a> {
    fn new(study: &'a Study, wanted: usize, quiet: bool) -> Self {
        Self { study, quiet, wanted, ended: 0, begun: 0, start: Instant::now(), told: Instant::now() }
    }

    fn label(&self, case: usize) -> String {
        let label = self.study.cases.get(case - 1).map(crate::study::Case::label).unwrap_or_default();
        if label.is_empty() { format!("case {case}") } else { format!("case {case} ({label})") }
    }

    fn hear(&mut self, event: &Event) {
        match event {
            Event::Fewer { jobs, wanted, needed, available } => {
                if !self.quiet {
                    warn(&format!(
                        "{jobs} instead of {wanted} cases run at the same time: {wanted} of them may need {:.2} GB of memory, \
                         and {:.2} GB are available; `--ignore-memory` runs {wanted} all the same",
                        needed / 1e9,
                        *available as f64 / 1e9
                    ));
                }
            }
            Event::Started(case) => {
                self.begun += 1;
                if !self.quiet {
                    eprintln!("[{}/{}] {}", self.begun, self.wanted, self.label(*case));
                }
            }
            Event::Running { case, time, end } => {
                if !self.quiet && self.told.elapsed() > TELLING {
                    self.told = Instant::now();
                    let percent = (100.0 * time / end).floor();
                    eprintln!(
                        "  case {case}: t = {time:.4e} s, {percent} %; {} of {} cases ended",
                        self.ended, self.wanted
                    );
                }
            }
            Event::Ended(ending) => {
                self.ended += 1;
                let label = self.label(ending.case);
                match ending.status {
                    Status::Failed => {
                        let message = ending.message.as_deref().unwrap_or_default();
                        complain(&format!("{label} failed after {}: {message}", duration(ending.seconds)));
                    }
                    _ if self.quiet => {}
                    Status::Interrupted => {
                        eprintln!("  {label}: {}", ending.message.as_deref().unwrap_or("interrupted"))
                    }
                    Status::Completed => {
                        let left =
                            self.start.elapsed().as_secs_f64() / self.ended as f64 * (self.wanted - self.ended) as f64;
                        let left = if self.ended < self.wanted {
                            format!("; about {} left", duration(left))
                        } else {
                            String::new()
                        };
                        eprintln!(
                            "  case {} done: {} steps in {}{left}",
                            ending.case,
                            ending.steps,
                            duration(ending.seconds)
                        );
                    }
                }
            }
        }
    }
}
