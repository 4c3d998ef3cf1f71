//! Why every step took what it took: monitors that write a table or JSON lines, and several monitors as one.
//!
//! They write to whatever they are given; the library itself stays silent.

mod log;
mod table;
mod totals;

pub use log::SolveLog;
pub use table::SolveTable;

use nicolson_solvers::time::StepFailure;

use super::{Monitor, Plan, Progress};
use crate::output::Report;

/// Several monitors, told in order.
#[derive(Default)]
pub struct Monitors<'a> {
    all: Vec<&'a mut dyn Monitor>,
}

impl<'a> Monitors<'a> {
    /// Nobody listens yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a monitor.
    #[must_use]
    pub fn with(mut self, monitor: &'a mut dyn Monitor) -> Self {
        self.all.push(monitor);
        self
    }

    /// Adds a monitor if there is one.
    #[must_use]
    pub fn with_optional<M: Monitor>(self, monitor: Option<&'a mut M>) -> Self {
        match monitor {
            Some(monitor) => self.with(monitor),
            None => self,
        }
    }
}

impl Monitor for Monitors<'_> {
    fn started(&mut self, plan: &Plan<'_>) {
        self.all.iter_mut().for_each(|monitor| monitor.started(plan));
    }

    fn warned(&mut self, warning: &str) {
        self.all.iter_mut().for_each(|monitor| monitor.warned(warning));
    }

    fn stepped(&mut self, progress: &Progress<'_>) {
        self.all.iter_mut().for_each(|monitor| monitor.stepped(progress));
    }

    fn failed(&mut self, failure: &StepFailure) {
        self.all.iter_mut().for_each(|monitor| monitor.failed(failure));
    }

    fn finished(&mut self, report: &Report) {
        self.all.iter_mut().for_each(|monitor| monitor.finished(report));
    }
}
