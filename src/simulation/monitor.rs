//! What a run tells of itself while it goes on.

use nicolson_solvers::time::{StepFailure, StepReport};

use crate::output::Report;

/// What a monitor hears before the first step.
#[derive(Debug, Clone)]
pub struct Plan<'a> {
    /// Title of the scene.
    pub title: &'a str,
    /// Time at which the run ends, s.
    pub end: f64,
    /// Number of particles.
    pub particles: usize,
    /// Unknowns of an implicit step; 0 for an explicit scheme.
    pub unknowns: usize,
    /// Name of the scheme.
    pub scheme: &'static str,
    /// Largest stable explicit step at the start, s.
    pub explicit_step_limit: f64,
    /// What the user should know.
    pub warnings: &'a [String],
    /// Steps done and time reached before, s, for a run that goes on from a checkpoint.
    pub resumed: Option<(usize, f64)>,
}

/// What a monitor hears of an accepted step.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Time reached, s.
    pub time: f64,
    /// Time at which the run ends, s.
    pub end: f64,
    /// Largest stable explicit step at the start, s.
    pub explicit_step_limit: f64,
    /// The step.
    pub step: &'a StepReport,
}

/// Hears what happens in a run.
pub trait Monitor {
    /// Before the first step.
    fn started(&mut self, plan: &Plan<'_>) {
        let _ = plan;
    }
    /// When something came up in the run that the user should know.
    fn warned(&mut self, warning: &str) {
        let _ = warning;
    }
    /// After an accepted step.
    fn stepped(&mut self, progress: &Progress<'_>) {
        let _ = progress;
    }
    /// After a step that failed for good.
    fn failed(&mut self, failure: &StepFailure) {
        let _ = failure;
    }
    /// At the end, however it came.
    fn finished(&mut self, report: &Report) {
        let _ = report;
    }
}

/// A monitor that does not listen.
pub struct Silent;

impl Monitor for Silent {}
