//! What the solves of one step, or of a whole run, add up to.

use std::collections::BTreeMap;

use nicolson_solvers::nonlinear::{NewtonTotals, TangentCause};
use nicolson_solvers::time::{FailedTry, StepCause, StepReport};

/// Sums over Newton solves, failed ones included.
#[derive(Debug, Clone, Default)]
pub struct Totals {
    /// Newton solves that succeeded as parts of steps.
    pub solves: usize,
    /// Newton solves that failed.
    pub failures: usize,
    /// Iterations; those of auxiliary solves are known to the step alone, see [`StepReport::newton_iterations`].
    pub iterations: usize,
    /// Sum of the logarithms of the contractions, and their number.
    contraction: (f64, usize),
    /// Trial points of the globalisation beyond the first of every iteration.
    pub line_search_steps: usize,
    /// Factorisations by cause.
    pub factorisations: BTreeMap<TangentCause, usize>,
    /// Iterations inside the linear solves.
    pub linear_iterations: usize,
    /// Failed or rejected tries by cause.
    pub rejections: BTreeMap<&'static str, usize>,
    /// Evaluations of the rate.
    pub rate_evaluations: usize,
}

impl Totals {
    /// Those of one accepted step.
    pub fn of_step(step: &StepReport) -> Self {
        let mut totals = Self { rate_evaluations: step.rate_evaluations, ..Self::default() };
        for report in &step.newton {
            totals.add_work(&report.work);
            totals.solves += 1;
            for record in report.history.iter().filter(|record| record.iteration > 0 && record.contraction > 0.0) {
                totals.contraction.0 += record.contraction.ln();
                totals.contraction.1 += 1;
            }
        }
        for failure in &step.failed_solves {
            totals.add_work(&failure.work);
            totals.failures += 1;
        }
        totals.add_tries(&step.tries);
        totals.iterations = step.newton_iterations;
        totals
    }

    /// Those of tries that led to no step.
    pub fn of_tries(tries: &[FailedTry]) -> Self {
        let mut totals = Self::default();
        totals.add_tries(tries);
        totals
    }

    fn add_tries(&mut self, tries: &[FailedTry]) {
        for tried in tries {
            *self.rejections.entry(tried.cause.name()).or_default() += 1;
            if let StepCause::Newton(failure) = &tried.cause {
                self.add_work(&failure.work);
                self.failures += 1;
            }
        }
    }

    fn add_work(&mut self, work: &NewtonTotals) {
        self.iterations += work.iterations;
        self.line_search_steps += work.line_search_steps;
        self.linear_iterations += work.linear_iterations;
        for (cause, count) in work.factorisations.iter() {
            *self.factorisations.entry(cause).or_default() += count;
        }
    }

    /// Adds another sum.
    pub fn add(&mut self, other: &Self) {
        self.solves += other.solves;
        self.failures += other.failures;
        self.iterations += other.iterations;
        self.contraction.0 += other.contraction.0;
        self.contraction.1 += other.contraction.1;
        self.line_search_steps += other.line_search_steps;
        self.linear_iterations += other.linear_iterations;
        self.rate_evaluations += other.rate_evaluations;
        for (cause, count) in &other.factorisations {
            *self.factorisations.entry(*cause).or_default() += count;
        }
        for (cause, count) in &other.rejections {
            *self.rejections.entry(cause).or_default() += count;
        }
    }

    /// Geometric mean of the contractions of the residual in the solves that succeeded.
    pub fn mean_contraction(&self) -> Option<f64> {
        let (sum, count) = self.contraction;
        (count > 0).then(|| (sum / count as f64).exp())
    }

    /// `4 (every iteration 3, first 1)`.
    pub fn factorisations_in_words(&self) -> String {
        by_cause(self.factorisations.iter().map(|(cause, count)| (cause.name(), *count)))
    }

    /// The same of rejected tries.
    pub fn rejections_in_words(&self) -> String {
        by_cause(self.rejections.iter().map(|(cause, count)| (*cause, *count)))
    }
}

/// The sum, and the causes with their counts, the most frequent first.
fn by_cause(counts: impl Iterator<Item = (&'static str, usize)>) -> String {
    let mut counts: Vec<_> = counts.collect();
    let total: usize = counts.iter().map(|(_, count)| count).sum();
    if total == 0 {
        return "0".into();
    }
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let list: Vec<String> = counts.iter().map(|(cause, count)| format!("{cause} {count}")).collect();
    format!("{total} ({})", list.join(", "))
}
