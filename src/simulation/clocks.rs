//! Where the time of a run goes: clocks that touch each other, so that nothing falls between them.
//!
//! The loop of a run is set-up, then steps and records by turns, then the end. Inside a step model and Newton's method
//! read clocks of their own; what these do not see of it is the integration.

use std::time::{Duration, Instant};

use super::Prepared;
use crate::model::ModelTimes;
use crate::output::WallSeconds;

/// The clocks of a run.
#[derive(Debug, Clone)]
pub(super) struct Clocks {
    begin: Instant,
    setup: Duration,
    steps: Duration,
    /// What the model had spent when the set-up ended.
    before: (ModelTimes, f64),
    /// What Newton's method had spent then, in a part of the run before: on factorisations and on solves.
    newton: (f64, f64),
}

impl Clocks {
    /// Ends the set-up that began at `begin`.
    pub fn after_setup<const D: usize>(begin: Instant, prepared: &Prepared<D>) -> Self {
        let before = (prepared.model.times(), prepared.model.fill_seconds());
        let newton = prepared.stepper.newton().map_or((0.0, 0.0), |newton| {
            let totals = newton.totals();
            (totals.factorisation_seconds, totals.solve_seconds)
        });
        Self { begin, setup: begin.elapsed(), steps: Duration::ZERO, before, newton }
    }

    /// Adds a step that began at `start`.
    pub fn step(&mut self, start: Instant) {
        self.steps += start.elapsed();
    }

    /// The parts so far; `ledger` and `output` are what the recorder spent.
    pub fn read<const D: usize>(&self, prepared: &Prepared<D>, ledger: Duration, output: Duration) -> WallSeconds {
        let (before, filled) = self.before;
        let times = prepared.model.times();
        let rate = times.rate.saturating_sub(before.rate).as_secs_f64();
        let assembly = times.assembly.saturating_sub(before.assembly).as_secs_f64();
        // Newton's clocks hold the writing of entries, which the model counts as assembly.
        let fill = prepared.model.fill_seconds() - filled;
        let (factorisation, solve) = prepared.stepper.newton().map_or((0.0, 0.0), |newton| {
            let totals = newton.totals();
            let factorisation = (totals.factorisation_seconds - self.newton.0).max(0.0);
            let inside = fill.min(factorisation);
            (factorisation - inside, (totals.solve_seconds - self.newton.1 - (fill - inside)).max(0.0))
        });
        let integration = (self.steps.as_secs_f64() - rate - assembly - factorisation - solve).max(0.0);
        let mut seconds = WallSeconds {
            setup: self.setup.as_secs_f64(),
            rate,
            assembly,
            factorisation,
            solve,
            integration,
            ledger: ledger.as_secs_f64(),
            output: output.as_secs_f64(),
            other: 0.0,
            total: self.begin.elapsed().as_secs_f64(),
        };
        let known: f64 = seconds.parts().iter().map(|(_, part)| part).sum();
        seconds.other = (seconds.total - known).max(0.0);
        seconds
    }
}
