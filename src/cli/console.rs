//! What the user sees of a run. The only place (with its neighbours) that prints.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is the command line's output")]

use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use nicolson_solvers::time::StepFailure;

use crate::output::{Report, Status};
use crate::simulation::{Monitor, Plan, Progress};

/// Seconds between two plain lines where there is no terminal.
const QUIET_SECONDS: u64 = 5;
/// Runs shorter than this, in s, are fast enough.
const WORTH_A_HINT: f64 = 1.0;

/// Prints an error message.
pub fn complain(message: &str) {
    // Names of files may hold anything; what a terminal would take for a command is left out.
    let shown: String = message.chars().map(|c| if c.is_control() && c != '\n' { '\u{fffd}' } else { c }).collect();
    eprintln!("error: {shown}");
}

/// A time for people: `8 s`, `12 min 5 s`, `3 h 40 min`, `2 d 5 h`.
pub fn duration(seconds: f64) -> String {
    if !seconds.is_finite() {
        return "?".to_owned();
    }
    if seconds < 9.95 {
        return format!("{seconds:.1} s");
    }
    let whole = seconds.round() as u64;
    let (days, hours, minutes, rest) = (whole / 86_400, whole / 3600 % 24, whole / 60 % 60, whole % 60);
    match (days, hours, minutes) {
        (0, 0, 0) => format!("{rest} s"),
        (0, 0, _) => format!("{minutes} min {rest} s"),
        (0, _, _) => format!("{hours} h {minutes} min"),
        _ => format!("{days} d {hours} h"),
    }
}

/// Prints a warning.
pub fn warn(message: &str) {
    eprintln!("warning: {message}");
}

/// Progress and summary of a run: a bar on a terminal, a plain line every few seconds elsewhere.
pub struct Console {
    quiet: bool,
    shows_progress: bool,
    directory: Option<PathBuf>,
    bar: Option<ProgressBar>,
    start: Instant,
    last: Instant,
    /// Time at which this run began, s.
    begun: Option<f64>,
    /// Whether time is a pseudo-time, which no explicit step could take.
    is_static: bool,
}

impl Console {
    /// A console; `quiet` prints errors only.
    pub fn new(quiet: bool, directory: Option<PathBuf>) -> Self {
        let (start, last) = (Instant::now(), Instant::now());
        Self { quiet, shows_progress: true, directory, bar: None, start, last, begun: None, is_static: false }
    }

    /// Neither a bar nor progress lines: something else tells of every step.
    pub fn leave_progress_out(&mut self) {
        self.shows_progress = false;
    }

    /// Where the run is, how its step compares with an explicit one, and how long it will take at this pace.
    fn line(&self, progress: &Progress<'_>) -> String {
        let step = progress.step;
        let newton =
            if step.newton.is_empty() { String::new() } else { format!("  Newton {}", step.newton_iterations) };
        let explicit = match self.is_static {
            true => String::new(),
            false => format!(" ({:.1} × explicit)", step.step / progress.explicit_step_limit),
        };
        format!(
            "t = {:.4e} s, {:.0} %  Δt = {:.3e} s{explicit}{newton}  {} so far, about {} left",
            progress.time,
            (100.0 * progress.time / progress.end).floor(),
            step.step,
            duration(self.start.elapsed().as_secs_f64()),
            duration(self.left(progress)),
        )
    }

    /// Seconds left at the pace of this run, which may have begun at a checkpoint.
    fn left(&self, progress: &Progress<'_>) -> f64 {
        let begun = self.begun.unwrap_or_default();
        let done = (progress.time - begun) / (progress.end - begun);
        if done > 0.0 { self.start.elapsed().as_secs_f64() * (1.0 - done) / done } else { f64::INFINITY }
    }
}

impl Monitor for Console {
    fn started(&mut self, plan: &Plan<'_>) {
        self.is_static = plan.scheme == "static";
        if self.quiet {
            return;
        }
        for warning in plan.warnings {
            eprintln!("warning: {warning}");
        }
        let unknowns = if plan.unknowns > 0 { format!(", {} unknowns", plan.unknowns) } else { String::new() };
        eprintln!(
            "{}: {} particles{unknowns}, {} to t = {} s (explicit limit Δt = {:.3e} s)",
            plan.title, plan.particles, plan.scheme, plan.end, plan.explicit_step_limit
        );
        if let Some((steps, time)) = plan.resumed {
            eprintln!("going on from step {steps} at t = {time} s");
        }
        if self.shows_progress && std::io::stderr().is_terminal() {
            let bar = ProgressBar::new(1000);
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}") {
                bar.set_style(style);
            }
            self.bar = Some(bar);
        }
        (self.start, self.last) = (Instant::now(), Instant::now());
    }

    fn warned(&mut self, warning: &str) {
        match &self.bar {
            _ if self.quiet => {}
            Some(bar) => bar.suspend(|| eprintln!("warning: {warning}")),
            None => eprintln!("warning: {warning}"),
        }
    }

    fn stepped(&mut self, progress: &Progress<'_>) {
        self.begun.get_or_insert(progress.time - progress.step.step);
        if self.quiet || !self.shows_progress {
            return;
        }
        match &self.bar {
            Some(bar) if self.last.elapsed() > Duration::from_millis(100) => {
                bar.set_position((1000.0 * progress.time / progress.end) as u64);
                bar.set_message(self.line(progress));
                self.last = Instant::now();
            }
            None if self.last.elapsed() > Duration::from_secs(QUIET_SECONDS) => {
                eprintln!("{}", self.line(progress));
                self.last = Instant::now();
            }
            _ => {}
        }
    }

    fn failed(&mut self, failure: &StepFailure) {
        if !self.quiet && self.shows_progress {
            for tried in failure.tries.iter().take(3) {
                eprintln!("rejected Δt = {:.3e} s: {}", tried.step, tried.cause);
            }
        }
    }

    fn finished(&mut self, report: &Report) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        if let Some(message) = &report.message {
            complain(message);
        }
        if self.quiet {
            return;
        }
        let state = match report.status {
            Status::Completed => "done",
            Status::Failed => "failed",
            Status::Interrupted => "interrupted",
        };
        println!(
            "{state}: t = {} s, {} steps ({} rejected), {} Newton iterations, {} factorisations, {:.2} s",
            report.time_reached,
            report.steps.accepted,
            report.steps.rejected,
            report.newton.iterations,
            report.linear.factorisations,
            report.wall_seconds.total
        );
        if let Some(explicit) = explicit_steps(report).filter(|_| !self.is_static) {
            println!("an explicit scheme would have taken {explicit:.0} steps to this time");
        }
        if let Some(drift) = report.energy.max_relative_drift {
            println!(
                "energy: {:.6e} J at the start, {:.6e} J at the end, {:.6e} J dissipated; largest drift {drift:.1e}",
                report.energy.initial, report.energy.r#final, report.energy.dissipated
            );
        }
        for (field, e) in &report.errors {
            println!("error of {field}: L1 {:.4e}  L2 {:.4e}  L∞ {:.4e}", e.l1, e.l2, e.linf);
        }
        for (name, probe) in &report.probes {
            println!("probe {name}: u = {:?} m", probe.displacement);
        }
        if !report.linear.reason.is_empty() {
            println!("linear solver: {}; {}", report.linear.solver, report.linear.reason);
        }
        println!("{}", breakdown(report));
        if let Some(directory) = &self.directory {
            println!("results in {}", directory.display());
        }
    }
}

/// Steps of the explicit limit to the time that an implicit run has reached.
fn explicit_steps(report: &Report) -> Option<f64> {
    let limit = report.explicit_step_limit.filter(|limit| report.unknowns > 0 && *limit > 0.0)?;
    let steps = (report.time_reached / limit).ceil();
    (steps > report.steps.accepted as f64).then_some(steps)
}

/// Where the time went, and what would help.
fn breakdown(report: &Report) -> String {
    let total = report.wall_seconds.total.max(f64::MIN_POSITIVE);
    let share = |(name, seconds): (&str, f64)| {
        let percent = (100.0 * seconds / total).round();
        (percent > 0.0).then(|| format!("{name} {percent} %"))
    };
    let parts: Vec<String> = report.wall_seconds.parts().into_iter().filter_map(share).collect();
    let mut text = format!("time: {}", parts.join(", "));
    if !report.bottleneck.hint.is_empty() && total > WORTH_A_HINT {
        text += &format!("\nmost of it is {}: {}", report.bottleneck.part, report.bottleneck.hint);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::duration;

    #[test]
    fn times_are_told_in_units_of_their_size() {
        let told = [0.04, 9.94, 9.96, 59.4, 59.6, 3599.0, 3600.0, 86_399.0, 200_000.0, f64::INFINITY].map(duration);
        let words =
            ["0.0 s", "9.9 s", "10 s", "59 s", "1 min 0 s", "59 min 59 s", "1 h 0 min", "23 h 59 min", "2 d 7 h", "?"];
        assert_eq!(told, words);
    }
}
