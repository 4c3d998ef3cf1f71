//! The report of a run, from its books and counters.

use super::recorder::Recorder;
use super::{Clocks, Prepared, comparison};
use crate::discretisation::BalanceReport;
use crate::output::{BalanceWork, Bottleneck, EnergyBudget, LinearWork, NewtonWork, Report, Status, Steps};

impl<const D: usize> Recorder<D> {
    /// What is known at present.
    pub(super) fn report(
        &self,
        prepared: &Prepared<D>,
        status: Status,
        message: Option<String>,
        clocks: &Clocks,
    ) -> Report {
        let Prepared { model, stepper, state, .. } = prepared;
        let statistics = stepper.statistics();
        let newton = stepper.newton();
        let totals = newton.map(|newton| *newton.totals()).unwrap_or_default();
        let counts = newton.map(|newton| newton.linear().counts()).unwrap_or_default();
        let info = newton.map(|newton| newton.linear().info());
        let ledger = self.ledger.summary();
        Report {
            status,
            message,
            time_reached: state.time,
            particles: model.particles(),
            unknowns: prepared.unknowns(),
            steps: Steps { accepted: statistics.accepted, rejected: statistics.rejected.total() },
            geometry: model.setup().geometry.clone(),
            balance: model.gradient().balance.iter().map(balance_work).collect(),
            newton: NewtonWork {
                solves: totals.solves,
                failures: totals.failures,
                iterations: totals.iterations,
                residual_evaluations: totals.residual_evaluations,
                linearisations: totals.linearisations,
            },
            linear: LinearWork {
                solver: info.as_ref().map(|info| info.name.clone()).unwrap_or_default(),
                reason: info.as_ref().map(|info| info.reason.clone()).unwrap_or_default(),
                analyses: counts.analyses,
                factorisations: counts.factorisations,
                solves: counts.solves,
                iterations: counts.iterations,
                fill: info.map(|info| info.fill).unwrap_or_default(),
            },
            rate_evaluations: statistics.rate_evaluations,
            explicit_step_limit: Some(prepared.explicit_step_limit),
            wall_seconds: self.wall_seconds(prepared, clocks),
            bottleneck: Bottleneck::default(),
            energy: EnergyBudget {
                initial: ledger.totals.0,
                r#final: ledger.totals.1,
                max_relative_drift: self.tables.keeps_history.then_some(ledger.drift),
                dissipated: ledger.dissipated,
                ledger_error: self.tables.keeps_history.then_some(ledger.ledger_error),
                hourglass_max_fraction: ledger.hourglass_fraction.filter(|_| self.tables.keeps_history),
            },
            linear_momentum_drift: ledger.linear_momentum.filter(|_| self.tables.keeps_history),
            angular_momentum_drift: ledger.angular_momentum.filter(|_| self.tables.keeps_history),
            errors: comparison::errors(model, state.time, &state.values),
            probes: self
                .tables
                .gauges
                .iter()
                .map(|gauge| (gauge.name().to_owned(), gauge.final_state(model, &state.values)))
                .collect(),
            warnings: prepared.warnings.clone(),
            provenance: self.provenance.clone(),
        }
    }
}

fn balance_work(report: &BalanceReport) -> BalanceWork {
    BalanceWork {
        body: report.body.clone(),
        balanced: report.balanced,
        cells: report.cells,
        note: report.note.clone(),
        missed: report.missed,
        band: report.band,
        unknowns: report.unknowns,
        iterations: report.iterations,
        residual: report.residual,
        largest_change: report.largest_change,
        seconds: report.seconds,
    }
}
