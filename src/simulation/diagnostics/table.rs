//! One line per step for people.

use std::io::{self, Write};

use nicolson_solvers::time::{FailedTry, StepFailure, StepReport};

use super::super::{Monitor, Plan, Progress};
use super::totals::Totals;
use crate::output::Report;

/// Lines after which the titles are repeated.
const PAGE: usize = 40;

/// Writes a line per step: length, iterations, mean contraction of the residual, line-search steps, iterations
/// of the linear solver, factorisations and rejected tries by cause; below it, every failed try and every
/// solve that needed another start. Explicit steps have rates and stages instead.
pub struct SolveTable<W> {
    to: W,
    implicit: bool,
    steps: usize,
    lines: usize,
    totals: Totals,
    error: Option<io::Error>,
}

impl<W: Write> SolveTable<W> {
    /// A table that goes to `to`.
    pub fn new(to: W) -> Self {
        Self { to, implicit: false, steps: 0, lines: 0, totals: Totals::default(), error: None }
    }

    /// The first error of writing, if there was one; nothing was written after it.
    pub fn take_error(&mut self) -> Option<io::Error> {
        self.error.take()
    }

    /// What the table was written to.
    pub fn into_inner(self) -> W {
        self.to
    }

    fn write(&mut self, text: &str) {
        if self.error.is_none() {
            self.error = self.to.write_all(text.as_bytes()).and_then(|()| self.to.flush()).err();
        }
    }

    fn titles(&self) -> String {
        let start = format!("{:>7} {:>13} {:>11}", "step", "t [s]", "Δt [s]");
        if self.implicit {
            format!(
                "{start} {:>6} {:>11} {:>6} {:>6}  {}\n",
                "newton", "contraction", "search", "linear", "factorisations; rejected"
            )
        } else {
            format!("{start} {:>6} {:>6}  {}\n", "rates", "stages", "rejected")
        }
    }

    fn line(&self, step: &StepReport, totals: &Totals) -> String {
        let mut line = format!("{:>7} {:>13.6e} {:>11.3e}", self.steps, step.time, step.step);
        if self.implicit {
            let contraction = totals.mean_contraction().map_or("-".into(), |rate| format!("{rate:.1e}"));
            line += &format!(
                " {:>6} {contraction:>11} {:>6} {:>6}  {}",
                totals.iterations,
                totals.line_search_steps,
                totals.linear_iterations,
                totals.factorisations_in_words()
            );
        } else {
            let stages = step.stages.map_or("-".into(), |stages| stages.to_string());
            line += &format!(" {:>6} {stages:>6}  {}", step.rate_evaluations, totals.rejections_in_words());
        }
        if self.implicit && step.rejected > 0 {
            line += &format!("; rejected {}", totals.rejections_in_words());
        }
        if let Some(error) = step.error_estimate {
            line += &format!("; error {error:.2} of the tolerance");
        }
        line + "\n"
    }
}

/// One line per try, with its cause.
fn tries_in_words(tries: &[FailedTry]) -> String {
    tries.iter().map(|tried| format!("        rejected Δt = {:.3e} s: {}\n", tried.step, tried.cause)).collect()
}

impl<W: Write> Monitor for SolveTable<W> {
    fn started(&mut self, plan: &Plan<'_>) {
        self.implicit = plan.unknowns > 0;
        self.steps = plan.resumed.map_or(0, |(steps, _)| steps);
        let head =
            format!("{}: {}, {} particles, {} unknowns\n", plan.title, plan.scheme, plan.particles, plan.unknowns);
        self.write(&head);
    }

    fn stepped(&mut self, progress: &Progress<'_>) {
        let step = progress.step;
        let totals = Totals::of_step(step);
        let mut text = if self.lines.is_multiple_of(PAGE) { self.titles() } else { String::new() };
        self.steps += 1;
        self.lines += 1;
        text += &self.line(step, &totals);
        text += &tries_in_words(&step.tries);
        for failure in &step.failed_solves {
            text += &format!("        another start after: {failure}\n");
        }
        if step.auxiliary_solves > 0 {
            text += &format!("        {} solves of shorter steps to find a start\n", step.auxiliary_solves);
        }
        self.totals.add(&totals);
        self.write(&text);
    }

    fn failed(&mut self, failure: &StepFailure) {
        self.totals.add(&Totals::of_tries(&failure.tries));
        let count = failure.tries.len();
        let text = format!("step {} from t = {:e} s failed after {count} tries:\n", self.steps + 1, failure.time);
        self.write(&(text + &tries_in_words(&failure.tries)));
    }

    fn finished(&mut self, report: &Report) {
        let totals = &self.totals;
        let mut text = format!("{} steps, rejected tries {}", self.steps, totals.rejections_in_words());
        if self.implicit {
            let rate = totals.mean_contraction().map_or("-".into(), |rate| format!("{rate:.1e}"));
            text += &format!(
                "; {} Newton solves ({} failed), {} iterations of mean contraction {rate}, {} line-search steps\n\
                 factorisations {}; {}: {} solves, {} iterations\n",
                report.newton.solves,
                report.newton.failures,
                report.newton.iterations,
                totals.line_search_steps,
                totals.factorisations_in_words(),
                report.linear.solver,
                report.linear.solves,
                report.linear.iterations
            );
        } else {
            text += &format!("; {} rates\n", report.rate_evaluations);
        }
        self.write(&text);
    }
}
