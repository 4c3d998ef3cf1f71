//! Runs the cases of a study, several at a time, and none again that is done.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::{Case, ReadyCase, STUDY_FILE, Study};
use crate::output::{OutputError, Provenance, REPORT_FILE, Report, Status, prepare_directory, write_atomically};
use crate::scene::Scene;
use crate::simulation::{Checkpoint, Monitor, Progress, RunOptions, restart, run};

/// What is overridden in a case, in its directory.
pub(super) const CASE_FILE: &str = "case.toml";
/// Time between two words of a running case.
const TELLING: Duration = Duration::from_secs(1);

/// How a study is run.
#[derive(Debug, Clone)]
pub struct SweepOptions {
    /// Directory for the results.
    pub directory: PathBuf,
    /// Cases that run at the same time, if the memory suffices.
    pub jobs: usize,
    /// Threads of each of them. Results do not depend on it.
    pub threads: usize,
    /// Leave cases alone that failed before.
    pub keep_failed: bool,
    /// Command line, for the provenance.
    pub command: String,
}

/// What the directory of a case holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CaseState {
    /// The results of this very scene.
    Completed,
    /// A report that says why this very scene failed.
    Failed,
    /// A report of this very scene, interrupted.
    Interrupted,
    /// Results of another scene, or of other overrides.
    Outdated,
    /// No report, or one that cannot be read.
    Missing,
}

/// How a case ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Ending {
    /// Number of the case.
    pub case: usize,
    /// Completed, failed or interrupted.
    pub status: Status,
    /// Why it failed.
    pub message: Option<String>,
    /// Steps that were accepted.
    pub steps: usize,
    /// Wall-clock time in s.
    pub seconds: f64,
}

/// What happens in a sweep.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// Fewer cases than wanted run at the same time: those that need most memory do not fit beside each other.
    Fewer {
        /// How many there will be.
        jobs: usize,
        /// How many were wanted.
        wanted: usize,
        /// Memory that so many may need together, bytes.
        needed: f64,
        /// Memory that there is, bytes.
        available: u64,
    },
    /// A case begins.
    Started(usize),
    /// A case has come thus far.
    Running {
        /// Number of the case.
        case: usize,
        /// Time reached, s.
        time: f64,
        /// Time at which it ends, s.
        end: f64,
    },
    /// A case has ended.
    Ended(Ending),
}

/// What became of a sweep.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SweepSummary {
    /// Cases that were completed now.
    pub completed: usize,
    /// Cases that failed now.
    pub failed: usize,
    /// Cases that had been completed before.
    pub skipped: usize,
    /// Cases that had failed before, and were left alone.
    pub kept: usize,
    /// Whether the user stopped the sweep.
    pub interrupted: bool,
}

/// What the directory of a case holds, against the scene that it should.
pub fn state_of(directory: &Path, scene: &Scene) -> CaseState {
    match Report::read(directory) {
        Ok(report) if report.provenance.scene != scene.text() => CaseState::Outdated,
        Ok(report) => match report.status {
            Status::Completed => CaseState::Completed,
            Status::Failed => CaseState::Failed,
            Status::Interrupted => CaseState::Interrupted,
        },
        Err(_) => CaseState::Missing,
    }
}

/// Runs the cases that are not done, `jobs` at a time, each in its own pool of threads; `listener` hears of it in the
/// calling thread. Where the scenes have a [limit of memory](Scene::limit_memory), only so many run at a time as fit into it
/// whichever they are. A case that was interrupted goes on from its checkpoint. One that fails leaves a report that says why, and stops no other.
///
/// # Errors
/// If the directory cannot be written. What a disk refuses later is a failure of the case.
pub fn sweep(
    study: &Study,
    cases: &[ReadyCase],
    options: &SweepOptions,
    listener: &mut dyn FnMut(&Event),
    interrupt: &AtomicBool,
) -> Result<SweepSummary, OutputError> {
    prepare_directory(&options.directory)?;
    write_atomically(&options.directory.join(STUDY_FILE), |file| file.write_all(study.text.as_bytes()))?;
    let mut summary = SweepSummary::default();
    let mut waiting = Vec::new();
    for ready in cases {
        match state_of(&options.directory.join(ready.case.directory()), &ready.scene) {
            CaseState::Completed => summary.skipped += 1,
            CaseState::Failed if options.keep_failed => summary.kept += 1,
            _ => waiting.push(ready),
        }
    }
    let jobs = match fewer(&waiting, options.jobs.clamp(1, waiting.len().max(1))) {
        Ok(jobs) => jobs,
        Err((jobs, event)) => {
            listener(&event);
            jobs
        }
    };
    let next = AtomicUsize::new(0);
    let (sender, receiver) = channel();
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            let (sender, next, waiting) = (sender.clone(), &next, &waiting);
            scope.spawn(move || work(study, waiting, next, options, &sender, interrupt));
        }
        drop(sender);
        for event in receiver {
            if let Event::Ended(ending) = &event {
                match ending.status {
                    Status::Completed => summary.completed += 1,
                    Status::Failed => summary.failed += 1,
                    Status::Interrupted => {}
                }
            }
            listener(&event);
        }
    });
    summary.interrupted = interrupt.load(Ordering::Relaxed);
    Ok(summary)
}

/// So many cases at a time that even the largest of them fit into memory together: the wanted number, or fewer with the
/// word about it. One that does not fit alone has been refused before.
fn fewer(waiting: &[&ReadyCase], wanted: usize) -> Result<usize, (usize, Event)> {
    let Some(available) = waiting.iter().filter_map(|ready| ready.scene.memory_limit()).min() else {
        return Ok(wanted);
    };
    let mut largest: Vec<f64> = waiting.iter().map(|ready| ready.memory).collect();
    largest.sort_by(|a, b| b.total_cmp(a));
    let together = |jobs: usize| largest.iter().take(jobs).sum::<f64>();
    let jobs = (1..=wanted).rev().find(|jobs| together(*jobs) <= available as f64).unwrap_or(1);
    if jobs == wanted {
        Ok(jobs)
    } else {
        Err((jobs, Event::Fewer { jobs, wanted, needed: together(wanted), available }))
    }
}

/// Takes one case after the other.
fn work(
    study: &Study,
    waiting: &[&ReadyCase],
    next: &AtomicUsize,
    options: &SweepOptions,
    sender: &Sender<Event>,
    interrupt: &AtomicBool,
) {
    let pool = ThreadPoolBuilder::new().num_threads(options.threads).build();
    while !interrupt.load(Ordering::Relaxed) {
        let Some(ready) = waiting.get(next.fetch_add(1, Ordering::Relaxed)) else { return };
        // A listener that is gone is no reason to stop.
        let _ = sender.send(Event::Started(ready.case.index));
        let start = Instant::now();
        let (status, message, steps) = match &pool {
            Ok(pool) => one(study, ready, options, pool, sender, interrupt),
            Err(error) => (Status::Failed, Some(format!("cannot start the threads: {error}")), 0),
        };
        let seconds = start.elapsed().as_secs_f64();
        let _ = sender.send(Event::Ended(Ending { case: ready.case.index, status, message, steps, seconds }));
    }
}

/// Runs one case. Whatever prevents a report from being written writes one.
fn one(
    study: &Study,
    ready: &ReadyCase,
    options: &SweepOptions,
    pool: &ThreadPool,
    sender: &Sender<Event>,
    interrupt: &AtomicBool,
) -> (Status, Option<String>, usize) {
    let directory = options.directory.join(ready.case.directory());
    let checkpoint = checkpoint_of(&directory, &ready.scene);
    if let Err(error) = prepare(study, &ready.case, &directory) {
        return (Status::Failed, Some(error.to_string()), 0);
    }
    let run_options =
        RunOptions { directory: Some(directory.clone()), command: options.command.clone(), ..RunOptions::default() };
    let mut teller = Teller { case: ready.case.index, sender, last: Instant::now() };
    // Hours of other cases must not be lost to a fault in this one.
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        pool.install(|| {
            let gone_on = checkpoint
                .as_ref()
                .and_then(|from| restart(&ready.scene, from, false, &run_options, &mut teller, interrupt).ok());
            // Whatever does not fit together any more begins anew.
            let outcome = gone_on.map_or_else(|| run(&ready.scene, &run_options, &mut teller, interrupt), Ok);
            outcome.map(|outcome| outcome.report)
        })
    }));
    let message = match outcome {
        Ok(Ok(report)) => return (report.status, report.message, report.steps.accepted),
        Ok(Err(error)) => error.to_string(),
        Err(_) => "a fault of the program: report it with the scene".to_owned(),
    };
    if Report::read(&directory).is_err() {
        let provenance = Provenance {
            version: env!("CARGO_PKG_VERSION").into(),
            commit: option_env!("NICOLSON_COMMIT").unwrap_or_default().into(),
            threads: options.threads,
            scene: ready.scene.text().into(),
            command: options.command.clone(),
            ..Provenance::default()
        };
        let message = Some(message.clone());
        // If the disk refuses this as well, the case is run again: that is all that it is for.
        let _ = Report { status: Status::Failed, message, provenance, ..Report::default() }.write(&directory);
    }
    (Status::Failed, Some(message), 0)
}

/// The checkpoint that a case goes on from: that of this very scene, unless it failed.
fn checkpoint_of(directory: &Path, scene: &Scene) -> Option<Checkpoint> {
    if !matches!(state_of(directory, scene), CaseState::Interrupted | CaseState::Missing) {
        return None;
    }
    let (checkpoint, _) = Checkpoint::find(directory).ok()?;
    Some(checkpoint).filter(|checkpoint| checkpoint.about.scene == scene.text())
}

/// Makes the directory of a case: without the report of an earlier run, which would speak for one that is killed.
fn prepare(study: &Study, case: &Case, directory: &Path) -> Result<(), OutputError> {
    prepare_directory(directory)?;
    let report = directory.join(REPORT_FILE);
    match fs::remove_file(&report) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            return Err(OutputError::file("remove the old report", &report)(error));
        }
        _ => {}
    }
    write_atomically(&directory.join(CASE_FILE), |file| file.write_all(case_text(study, case).as_bytes()))
}

/// `case.toml`: what is overridden, and how to run the case alone.
fn case_text(study: &Study, case: &Case) -> String {
    let quote = |text: &str| format!("'{}'", text.replace('\'', "'\\''"));
    let mut command = format!("nicolson run {}", quote(&study.scene.display().to_string()));
    for one in &case.assignments {
        command += &format!(" --set {}", quote(&format!("{}={}", one.key, one.value)));
    }
    // No line of a comment must end early.
    let comment =
        format!("Case {} of {}. The same alone: {command}", case.index, study.title).replace(['\n', '\r'], " ");
    format!("# {comment}\nindex = {}\n\n{}", case.index, case.table())
}

/// Tells of a running case, not too often.
struct Teller<'a> {
    case: usize,
    sender: &'a Sender<Event>,
    last: Instant,
}

impl Monitor for Teller<'_> {
    fn stepped(&mut self, progress: &Progress<'_>) {
        if self.last.elapsed() > TELLING {
            self.last = Instant::now();
            let _ = self.sender.send(Event::Running { case: self.case, time: progress.time, end: progress.end });
        }
    }
}
