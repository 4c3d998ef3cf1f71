//! The length of one step: proposal, cuts after failed tries, and what the next step inherits.

use super::attempt::{Tools, evaluate};
use super::state::ControlMemory;
use super::{Adaptive, RatePart, Retries, StepCause, StepControl, System, TimeState};

/// Outcome of the error control: weighted norm, and the power of the step that it behaves as.
pub(super) type Judged = Option<(f64, f64)>;

/// The length of the step in hand.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    /// The step to try, before it is fitted to the target.
    pub step: f64,
    /// What a fraction of the step is measured against.
    nominal: f64,
    /// Failed tries so far, other than by the error estimate.
    failures: usize,
}

/// What the rule for the next step wants to know of an accepted one.
pub(super) struct Accepted {
    pub step: f64,
    /// Shortened to land on the target.
    pub truncated: bool,
    pub judged: Judged,
    /// Newton iterations of its costliest solve.
    pub iterations: usize,
    /// Whether tries failed before.
    pub after_failures: bool,
}

impl Pace {
    /// The first try of a step.
    pub fn propose(
        control: &StepControl,
        system: &mut dyn System,
        begin: &mut TimeState,
        tools: &mut Tools,
        order: usize,
        remaining: f64,
    ) -> Result<Self, StepCause> {
        let kept = begin.memory.control;
        let (nominal, scale) = match control {
            StepControl::Fixed { step } => (*step, kept.scale),
            StepControl::Cfl { factor } => {
                let limit = factor * system.stable_step(begin.time, &begin.values);
                // No limit: one step to the target.
                (if limit == f64::INFINITY { remaining } else { limit }, kept.scale)
            }
            StepControl::Adaptive(adaptive) => {
                let step = match adaptive.first {
                    _ if kept.step > 0.0 => kept.step,
                    Some(first) => first,
                    None => first_step(adaptive, system, begin, tools, order, remaining)?,
                };
                (step.max(adaptive.smallest).min(adaptive.largest), 1.0)
            }
            StepControl::Effort(effort) => {
                let step = if kept.step > 0.0 { kept.step } else { effort.first };
                (step.max(effort.smallest).min(effort.largest), 1.0)
            }
        };
        // A scale from a checkpoint is foreign data.
        let scale = if scale > 0.0 && scale < 1.0 { scale } else { 1.0 };
        let step = nominal * scale;
        if step > 0.0 && step.is_finite() {
            Ok(Self { step, nominal, failures: 0 })
        } else {
            Err(StepCause::StepNotPositive { step })
        }
    }

    /// Shortens the step after a failed try of length `tried`; `false` if it would become too short.
    pub fn shorten(&mut self, control: &StepControl, retries: &Retries, tried: f64, cause: &StepCause) -> bool {
        let factor = match (control, cause) {
            (StepControl::Adaptive(adaptive), StepCause::ErrorTooLarge { estimate, power }) => {
                adaptive.factor_after_rejection(*power, *estimate)
            }
            _ => {
                self.failures += 1;
                if self.failures == 1 { retries.first_cut } else { retries.cut }
            }
        };
        let smallest = match control {
            StepControl::Adaptive(adaptive) => adaptive.smallest,
            StepControl::Effort(effort) => effort.smallest.max(retries.smallest_fraction * self.nominal),
            StepControl::Fixed { .. } | StepControl::Cfl { .. } => retries.smallest_fraction * self.nominal,
        };
        let next = (factor * tried).max(smallest);
        self.step = next;
        next < tried
    }

    /// What the next step inherits.
    pub fn next(
        &self,
        control: &StepControl,
        retries: &Retries,
        before: ControlMemory,
        done: &Accepted,
    ) -> ControlMemory {
        match control {
            // The cap at 1 makes the nominal step come back with all its bits.
            StepControl::Fixed { .. } | StepControl::Cfl { .. } => {
                ControlMemory { scale: (self.step / self.nominal * retries.growth).min(1.0), ..before }
            }
            StepControl::Adaptive(adaptive) => {
                let Some((error, power)) = done.judged else { return before };
                let mut factor = adaptive.factor_after_acceptance(power, error, before.error);
                if done.after_failures {
                    factor = factor.min(1.0);
                }
                let mut step = done.step * factor;
                // A step cut short to land tells nothing against the step that was planned.
                if done.truncated && !done.after_failures {
                    step = step.max(self.step);
                }
                ControlMemory { step: step.max(adaptive.smallest).min(adaptive.largest), error, ..before }
            }
            StepControl::Effort(effort) => {
                let (mut step, mut cheap_steps) = (self.step, 0);
                if done.iterations > effort.many {
                    step *= effort.cut;
                } else if done.iterations <= effort.few && !done.after_failures {
                    cheap_steps = before.cheap_steps + 1;
                    if cheap_steps >= effort.patience {
                        (step, cheap_steps) = (step * effort.growth, 0);
                    }
                }
                ControlMemory { step: step.max(effort.smallest).min(effort.largest), cheap_steps, ..before }
            }
        }
    }
}

/// First step of adaptive control (Hairer, Nørsett & Wanner, *Solving ODEs I*, II.4): from the size of `u`, of
/// `f` and of the change of `f` over a tiny step of Euler's method. Two rates, one of which is kept.
fn first_step(
    adaptive: &Adaptive,
    system: &mut dyn System,
    begin: &mut TimeState,
    tools: &mut Tools,
    order: usize,
    remaining: f64,
) -> Result<f64, StepCause> {
    let TimeState { time, values, memory, .. } = begin;
    if memory.rate.len() != values.len() {
        memory.rate.resize(values.len(), 0.0);
        if let Err(cause) = evaluate(system, &mut tools.counts, RatePart::All, *time, values, &mut memory.rate) {
            memory.rate.clear();
            return Err(cause);
        }
    }
    let norm = |vector: &[f64]| adaptive.norm(vector, values, values);
    let (size, speed) = (norm(values), norm(&memory.rate));
    let small = if size < 1e-5 || speed < 1e-5 { 1e-6 } else { 0.01 * size / speed };
    let small = if small.is_finite() { small.min(remaining) } else { return Ok(1e-6 * remaining) };
    let [rate, ..] = &mut tools.rates;
    let [point, ..] = &mut tools.stages;
    for vector in [&mut *rate, &mut *point] {
        vector.resize(values.len(), 0.0);
    }
    for ((p, u), f) in point.iter_mut().zip(values.iter()).zip(&memory.rate) {
        *p = u + small * f;
    }
    system.impose(*time + small, point);
    if evaluate(system, &mut tools.counts, RatePart::All, *time + small, point, rate).is_err() {
        return Ok(small);
    }
    for (f1, f0) in rate.iter_mut().zip(&memory.rate) {
        *f1 = (*f1 - f0) / small;
    }
    let bend = speed.max(norm(rate));
    let step = if bend > 1e-15 { (0.01 / bend).powf(1.0 / (order as f64 + 1.0)) } else { small * 1000.0 };
    Ok(if step.is_finite() { step.min(100.0 * small).min(remaining) } else { small })
}
