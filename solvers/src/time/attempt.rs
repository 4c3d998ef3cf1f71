//! One try of one step: what every scheme gets to work with.

use super::{DiagonalTableau, RatePart, RkcCoefficients, Scheme, StepCause, System, TimeState};
use crate::EvaluationError;
use crate::nonlinear::{NewtonFailure, NewtonReport, NewtonSolver};
use crate::vector::first_not_finite;

/// What lives from step to step: Newton's method and the work vectors.
#[derive(Default)]
pub(super) struct Tools {
    pub newton: Option<NewtonSolver>,
    /// Rates of the stages.
    pub rates: [Vec<f64>; 3],
    /// Values of stages.
    pub stages: [Vec<f64>; 3],
    /// Base of an implicit stage.
    pub base: Vec<f64>,
    /// Estimate of the local error of the last try that gave one.
    pub estimate: Vec<f64>,
    /// Unknowns of the nonlinear problem, and the start of its iteration.
    pub unknowns: Vec<f64>,
    pub first_unknowns: Vec<f64>,
    pub chebyshev: RkcCoefficients,
    pub counts: Counts,
}

/// Work of one call of `advance`.
#[derive(Default)]
pub(super) struct Counts {
    pub rate_evaluations: usize,
    pub partial_evaluations: usize,
    pub newton_iterations: usize,
    pub newton: Vec<NewtonReport>,
    /// Solves of the present try that failed; another start may have saved it.
    pub failed_solves: Vec<NewtonFailure>,
    /// Solves that only served to find a start.
    pub auxiliary_solves: usize,
}

/// Where a step leads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    pub step: f64,
    /// Time at the end: the target to the last bit, if the step lands on it.
    pub end: f64,
}

/// What a scheme says about its error after a try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Estimate {
    /// Nothing.
    None,
    /// It left an estimate that behaves as `Δtᵏ` in [`Tools::estimate`].
    Embedded {
        /// The power `k`.
        power: f64,
    },
}

/// One try of one step.
pub(super) struct Attempt<'a> {
    pub system: &'a mut dyn System,
    pub tools: &'a mut Tools,
    /// Where the step starts. The try may add to the memory (a rate evaluated for it), never change values.
    pub start: &'a mut TimeState,
    /// Where the result goes.
    pub end: &'a mut TimeState,
    pub span: Span,
    pub wants_estimate: bool,
}

impl Attempt<'_> {
    /// Runs the scheme. On success `end` is complete but for its control and fingerprint.
    pub fn run(&mut self, scheme: Scheme) -> Result<Estimate, StepCause> {
        self.prepare();
        if let Some(newton) = &mut self.tools.newton {
            newton.new_step();
        }
        let estimate = match scheme {
            Scheme::ForwardEuler => self.forward_euler(),
            Scheme::TvdRk2 => self.tvd_rk2(),
            Scheme::TvdRk3 => self.tvd_rk3(),
            Scheme::Rk4 => self.rk4(),
            Scheme::VelocityVerlet => self.velocity_verlet(),
            Scheme::Rkc(options) => self.rkc(options),
            Scheme::Theta(theta) => self.theta(theta),
            Scheme::BackwardEuler => self.theta(1.0),
            Scheme::CrankNicolson => self.theta(0.5),
            Scheme::Midpoint => self.midpoint(),
            Scheme::TrBdf2 => self.diagonal(&DiagonalTableau::tr_bdf2()),
            Scheme::Sdirk3 => self.diagonal(&DiagonalTableau::sdirk3()),
            Scheme::GeneralisedAlpha { spectral_radius } => self.generalised_alpha(spectral_radius),
            Scheme::EnergyMomentum => self.energy_momentum(),
            Scheme::Static => self.equilibrium(),
        }?;
        if let Some(index) = first_not_finite(&self.end.values) {
            return Err(StepCause::NotFinite { index, value: self.end.values[index] });
        }
        Ok(estimate)
    }

    /// Brings every vector to length (no allocation after the first step) and empties the end's memory.
    pub fn prepare(&mut self) {
        let n = self.start.values.len();
        let tools = &mut *self.tools;
        let vectors = tools.rates.iter_mut().chain(&mut tools.stages);
        for vector in vectors.chain([&mut tools.base, &mut tools.estimate]) {
            vector.resize(n, 0.0);
        }
        self.end.time = self.span.end;
        self.end.values.clone_from(&self.start.values);
        self.end.memory.forget_rates();
        self.end.memory.dominant_direction.clone_from(&self.start.memory.dominant_direction);
        self.end.memory.spectral_radius = self.start.memory.spectral_radius;
        self.end.memory.dominant_damping = self.start.memory.dominant_damping;
        self.end.memory.steps_since_estimate = self.start.memory.steps_since_estimate.saturating_add(1);
        self.end.memory.previous_step = self.span.step;
    }

    /// Makes `f` at the start known: kept from the last step, or evaluated once for all tries.
    pub fn know_start_rate(&mut self) -> Result<(), StepCause> {
        let n = self.start.values.len();
        if self.start.memory.rate.len() == n {
            return Ok(());
        }
        let rate = &mut self.start.memory.rate;
        rate.resize(n, 0.0);
        let done =
            evaluate(self.system, &mut self.tools.counts, RatePart::All, self.start.time, &self.start.values, rate);
        if done.is_err() {
            rate.clear();
        }
        done
    }

    /// Makes `f` at the end known, so that the next step need not evaluate it.
    pub fn know_end_rate(&mut self) -> Result<(), StepCause> {
        let rate = &mut self.end.memory.rate;
        rate.resize(self.end.values.len(), 0.0);
        evaluate(self.system, &mut self.tools.counts, RatePart::All, self.span.end, &self.end.values, rate)
    }

    /// Evaluates the rate at the values of the end (as far as they have come) into `rates[slot]`.
    pub fn rate_of_end(&mut self, t: f64, slot: usize) -> Result<(), StepCause> {
        let Tools { rates, counts, .. } = &mut *self.tools;
        evaluate(self.system, counts, RatePart::All, t, &self.end.values, &mut rates[slot])
    }

    /// Turns the raw error in [`Tools::estimate`] into the distance between two true states: the
    /// embedded solution gets its prescribed entries imposed like the result, so that they count for
    /// nothing (their rates may hold anything).
    pub fn impose_on_estimate(&mut self) {
        let estimate = &mut self.tools.estimate;
        for (e, u) in estimate.iter_mut().zip(&self.end.values) {
            *e = u - *e;
        }
        self.system.impose(self.span.end, estimate);
        for (e, u) in estimate.iter_mut().zip(&self.end.values) {
            *e = u - *e;
        }
    }
}

/// Evaluates one part of the rate, and counts. A value that is not finite is an error even if the system did
/// not notice: it must not be kept for the next try.
pub(super) fn evaluate(
    system: &mut dyn System,
    counts: &mut Counts,
    part: RatePart,
    t: f64,
    u: &[f64],
    out: &mut [f64],
) -> Result<(), StepCause> {
    counts.rate_evaluations += 1;
    match part {
        RatePart::All => system.rate(t, u, out)?,
        RatePart::Velocities => system.rate_part(part, t, u, out)?,
        RatePart::Others => {
            counts.partial_evaluations += 1;
            system.rate_part(part, t, u, out)?;
        }
    }
    match first_not_finite(out) {
        Some(index) => Err(EvaluationError::not_finite("rate", index, out[index]).into()),
        None => Ok(()),
    }
}
