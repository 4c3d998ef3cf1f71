//! One JSON object per line for programs.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

use nicolson_solvers::nonlinear::{IterationRecord, Merit, NewtonFailure, NewtonTotals};
use nicolson_solvers::time::{FailedTry, StepCause, StepFailure, StepReport};
use serde_json::{Map, Value, json};

use super::super::{Monitor, Plan, Progress};
use crate::output::Report;

/// Writes one JSON object per line, each in one piece as soon as it is known: `start`, then a `step` per
/// accepted step with the full history of its Newton solves and of its failed tries, a `warning` before the step that
/// gave rise to it, `failure` for a step that was given up, and `end`. A number that is not finite becomes `null`.
pub struct SolveLog<W> {
    to: W,
    steps: usize,
    /// Whether what it goes to has the beginning already.
    continues: bool,
    error: Option<io::Error>,
}

impl SolveLog<File> {
    /// Goes on in a file that a run has left, after `steps` steps: what came later is cut off. A file that is not there
    /// is begun.
    ///
    /// # Errors
    /// If the file cannot be read or written.
    pub fn reopen(path: &Path, steps: usize) -> io::Result<Self> {
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error),
        };
        let kept: usize = text
            .split_inclusive('\n')
            .take_while(|line| line.ends_with('\n') && is_before(line, steps))
            .map(str::len)
            .sum();
        let mut file = File::options().create(true).truncate(false).write(true).open(path)?;
        file.set_len(kept as u64)?;
        file.seek(SeekFrom::End(0))?;
        Ok(Self { continues: kept > 0, ..Self::new(file) })
    }
}

/// Whether a line tells of the first `steps` steps, or of what came before them.
fn is_before(line: &str, steps: usize) -> bool {
    let Ok(value) = serde_json::from_str::<Value>(line) else { return false };
    match value["event"].as_str() {
        Some("start") => true,
        Some("step" | "warning") => value["step"].as_u64().is_some_and(|step| step <= steps as u64),
        _ => false,
    }
}

impl<W: Write> SolveLog<W> {
    /// A log that goes to `to`.
    pub fn new(to: W) -> Self {
        Self { to, steps: 0, continues: false, error: None }
    }

    /// The first error of writing, if there was one; nothing was written after it.
    pub fn take_error(&mut self) -> Option<io::Error> {
        self.error.take()
    }

    /// What the log was written to.
    pub fn into_inner(self) -> W {
        self.to
    }

    fn write(&mut self, value: &Value) {
        if self.error.is_none() {
            let line = format!("{value}\n");
            self.error = self.to.write_all(line.as_bytes()).and_then(|()| self.to.flush()).err();
        }
    }
}

impl<W: Write> Monitor for SolveLog<W> {
    fn started(&mut self, plan: &Plan<'_>) {
        if let Some((steps, _)) = plan.resumed {
            self.steps = steps;
            if self.continues {
                return;
            }
        }
        self.write(&json!({
            "event": "start",
            "title": plan.title,
            "scheme": plan.scheme,
            "end": plan.end,
            "particles": plan.particles,
            "unknowns": plan.unknowns,
            "explicit_step_limit": plan.explicit_step_limit,
            "warnings": plan.warnings,
        }));
    }

    fn warned(&mut self, warning: &str) {
        self.write(&json!({ "event": "warning", "step": self.steps + 1, "message": warning }));
    }

    fn stepped(&mut self, progress: &Progress<'_>) {
        self.steps += 1;
        self.write(&step(self.steps, progress.step));
    }

    fn failed(&mut self, failure: &StepFailure) {
        self.write(&json!({
            "event": "failure",
            "step": self.steps + 1,
            "time": failure.time,
            "cause": failure.cause().map(StepCause::name),
            "message": failure.to_string(),
            "tries": tries(&failure.tries),
        }));
    }

    fn finished(&mut self, report: &Report) {
        self.write(&json!({
            "event": "end",
            "status": report.status,
            "message": report.message,
            "time": report.time_reached,
            "steps": report.steps,
            "newton": report.newton,
            "linear": report.linear,
            "rate_evaluations": report.rate_evaluations,
            "wall_seconds": report.wall_seconds,
        }));
    }
}

fn step(number: usize, step: &StepReport) -> Value {
    let solves: Vec<Value> = step
        .newton
        .iter()
        .map(|report| {
            json!({
                "iterations": report.iterations,
                "convergence": report.convergence.name(),
                "contraction": report.contraction(),
                "order": report.observed_order(),
                "work": work(&report.work),
                "history": history(&report.history),
            })
        })
        .collect();
    json!({
        "event": "step",
        "step": number,
        "time": step.time,
        "length": step.step,
        "newton_iterations": step.newton_iterations,
        "rejected": counts(step.rejections.iter()),
        "rate_evaluations": step.rate_evaluations,
        "partial_evaluations": step.partial_evaluations,
        "error_estimate": step.error_estimate,
        "stages": step.stages,
        "solves": solves,
        "failed_solves": step.failed_solves.iter().map(failed_solve).collect::<Vec<_>>(),
        "auxiliary_solves": step.auxiliary_solves,
        "tries": tries(&step.tries),
    })
}

fn tries(tries: &[FailedTry]) -> Vec<Value> {
    let entry = |tried: &FailedTry| {
        json!({
            "length": tried.step,
            "cause": tried.cause.name(),
            "message": tried.cause.to_string(),
            "solve": match &tried.cause {
                StepCause::Newton(failure) => failed_solve(failure),
                _ => Value::Null,
            },
        })
    };
    tries.iter().map(entry).collect()
}

fn failed_solve(failure: &NewtonFailure) -> Value {
    let worst = |unknown: &nicolson_solvers::nonlinear::WorstUnknown| json!({ "index": unknown.index, "residual": unknown.residual, "description": unknown.description });
    json!({
        "cause": failure.cause.name(),
        "message": failure.cause.to_string(),
        "worst": failure.worst.iter().map(worst).collect::<Vec<_>>(),
        "work": work(&failure.work),
        "history": history(&failure.history),
    })
}

fn work(work: &NewtonTotals) -> Value {
    json!({
        "residual_evaluations": work.residual_evaluations,
        "linearisations": work.linearisations,
        "factorisations": counts(work.factorisations.iter().map(|(cause, count)| (cause.name(), count))),
        "linear_solves": work.linear_solves,
        "linear_iterations": work.linear_iterations,
        "line_search_steps": work.line_search_steps,
        "rejected_steps": work.rejected_steps,
        "factorisation_seconds": work.factorisation_seconds,
        "solve_seconds": work.solve_seconds,
    })
}

/// Counts by cause.
fn counts(counts: impl Iterator<Item = (&'static str, usize)>) -> Map<String, Value> {
    counts.map(|(cause, count)| (cause.to_owned(), count.into())).collect()
}

fn history(records: &[IterationRecord]) -> Vec<Value> {
    let entry = |record: &IterationRecord| {
        json!({
            "iteration": record.iteration,
            "residual": record.residual,
            "relative": record.relative,
            "scale": record.scale,
            "contraction": record.contraction,
            "step": record.step,
            "step_length": record.step_length,
            "trials": record.trials,
            "merit": if record.merit == Merit::Potential { "potential" } else { "residual" },
            "tangent": record.tangent.map(|cause| cause.name()),
            "forcing": record.forcing,
            "linear_residual": record.linear_residual,
            "linear_iterations": record.linear_iterations,
        })
    };
    records.iter().map(entry).collect()
}
