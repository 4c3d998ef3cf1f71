//! How long a step is: fixed, CFL, by error, by Newton effort; and what happens after a failed try.

use super::StepperError;

/// Rule for the length of a step.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum StepControl {
    /// The same step throughout. After a failed try it is cut as [`Retries`] says and grows back to
    /// exactly this value, so that a kept factor of the tangent fits again.
    Fixed {
        /// Nominal step.
        step: f64,
    },
    /// `factor ×` [`System::stable_step`](super::System::stable_step), evaluated anew for every step.
    Cfl {
        /// Multiplies the system's own limit (1 takes it as it is).
        factor: f64,
    },
    /// By an estimate of the local error.
    Adaptive(Adaptive),
    /// By the effort of Newton's method (implicit schemes only).
    Effort(Effort),
}

/// Step control by an error estimate `e` with the weighted norm
/// `‖e‖ = √(mean over i of (eᵢ / (absoluteᵢ + relative · max(|u₀ᵢ|, |u₁ᵢ|)))²)`; a step is accepted if
/// `‖e‖ ≤ 1`.
///
/// With `e ~ Δtᵏ` the next step is `safety · ‖e‖^(−0.7/k) · ‖e_previous‖^(0.4/k)` times the present one
/// (PI control, Hairer & Wanner, *Solving ODEs II*, IV.2); after a rejection `safety · ‖e‖^(−1/k)`
/// times, and the step after a rejection does not grow.
#[derive(Debug, Clone, PartialEq)]
pub struct Adaptive {
    /// Relative tolerance.
    pub relative: f64,
    /// Absolute tolerance.
    pub absolute: f64,
    /// Absolute tolerance of every entry, in place of [`absolute`](Self::absolute): for a state whose
    /// entries have different units.
    pub absolute_entries: Option<Vec<f64>>,
    /// First step; by default estimated from two rates (Hairer, Nørsett & Wanner, *Solving ODEs I*, II.4).
    pub first: Option<f64>,
    /// No step is shorter than this, except to land on a target.
    pub smallest: f64,
    /// No step is longer than this.
    pub largest: f64,
    /// Factor of caution.
    pub safety: f64,
    /// Largest growth from one step to the next.
    pub growth: f64,
    /// Strongest cut of one rejection.
    pub cut: f64,
}

impl Adaptive {
    /// Control with the given tolerances, safety 0.9, growth at most 5, cut at most 0.2.
    pub fn new(relative: f64, absolute: f64) -> Self {
        Self {
            relative,
            absolute,
            absolute_entries: None,
            first: None,
            smallest: 0.0,
            largest: f64::INFINITY,
            safety: 0.9,
            growth: 5.0,
            cut: 0.2,
        }
    }

    /// Weighted norm of an error between the states `u0` and `u1`.
    pub(super) fn norm(&self, error: &[f64], u0: &[f64], u1: &[f64]) -> f64 {
        if error.is_empty() {
            return 0.0;
        }
        let weighted = |i: usize| {
            let absolute = self.absolute_entries.as_ref().map_or(self.absolute, |all| all[i]);
            error[i] / (absolute + self.relative * u0[i].abs().max(u1[i].abs()))
        };
        // An entry that is zero and must be exact gives 0/0: no error, no contribution.
        let sum: f64 = (0..error.len()).filter(|&i| error[i] != 0.0).map(|i| weighted(i).powi(2)).sum();
        (sum / error.len() as f64).sqrt()
    }

    /// Factor for the step after an accepted one; `power` is `k`, `previous` the error before (0: none).
    pub(super) fn factor_after_acceptance(&self, power: f64, error: f64, previous: f64) -> f64 {
        // Errors far below the tolerance say nothing more than "grow".
        let error = error.max(1e-8);
        let damping = if previous > 0.0 { previous.max(1e-8).powf(0.4 / power) } else { 1.0 };
        let exponent = if previous > 0.0 { 0.7 / power } else { 1.0 / power };
        (self.safety * error.powf(-exponent) * damping).clamp(self.cut, self.growth)
    }

    /// Factor for the next try after a rejected one.
    pub(super) fn factor_after_rejection(&self, power: f64, error: f64) -> f64 {
        let factor = self.safety * error.powf(-1.0 / power);
        if factor > self.cut { factor.min(0.9) } else { self.cut }
    }
}

/// Step control by the number of Newton iterations of the costliest solve of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// First step.
    pub first: f64,
    /// No step is shorter than this, except to land on a target.
    pub smallest: f64,
    /// No step is longer than this.
    pub largest: f64,
    /// A step with at most this many iterations is cheap.
    pub few: usize,
    /// A step with more iterations than this makes the next one shorter.
    pub many: usize,
    /// Growth after [`patience`](Self::patience) cheap steps in a row.
    pub growth: f64,
    /// Cut after a costly step.
    pub cut: f64,
    /// Cheap steps in a row before the step grows: every change of step costs a factorisation.
    pub patience: usize,
}

impl Effort {
    /// Starts at `first`; grows by 1.5 after 3 steps of at most 4 iterations; halves above 10.
    pub fn new(first: f64) -> Self {
        Self { first, smallest: 0.0, largest: f64::INFINITY, few: 4, many: 10, growth: 1.5, cut: 0.5, patience: 3 }
    }
}

/// What happens after a try that failed for a reason other than its error estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Retries {
    /// Factor after the first failure of a step.
    pub first_cut: f64,
    /// Factor after every further one.
    pub cut: f64,
    /// Factor by which a cut step grows back after every success.
    pub growth: f64,
    /// Give up below this fraction of the step first proposed (of the nominal step, where there is one);
    /// 1 lets the first failure end the step.
    pub smallest_fraction: f64,
    /// Give up after this many failed tries of one step, whatever their cause.
    pub limit: usize,
}

impl Default for Retries {
    fn default() -> Self {
        Self { first_cut: 0.25, cut: 0.5, growth: 2.0, smallest_fraction: 1e-6, limit: 100 }
    }
}

fn demand(good: bool, name: &'static str, value: f64, expected: &'static str) -> Result<(), StepperError> {
    if good { Ok(()) } else { Err(StepperError::Parameter { name, value, expected }) }
}

fn positive(name: &'static str, value: f64) -> Result<(), StepperError> {
    demand(value > 0.0 && value.is_finite(), name, value, "positive and finite")
}

fn bounds(smallest: f64, largest: f64) -> Result<(), StepperError> {
    demand(smallest >= 0.0 && smallest.is_finite(), "smallest step", smallest, "not negative, finite")?;
    demand(largest > 0.0 && largest >= smallest, "largest step", largest, "positive, not below the smallest")
}

fn shrinking(name: &'static str, value: f64) -> Result<(), StepperError> {
    demand(value > 0.0 && value < 1.0, name, value, "between 0 and 1")
}

fn growing(name: &'static str, value: f64) -> Result<(), StepperError> {
    demand(value > 1.0 && value.is_finite(), name, value, "more than 1")
}

impl StepControl {
    /// Checks the parameters.
    pub(super) fn check(&self) -> Result<(), StepperError> {
        match self {
            Self::Fixed { step } => positive("step", *step),
            Self::Cfl { factor } => positive("CFL factor", *factor),
            Self::Adaptive(a) => {
                let entries = a.absolute_entries.iter().flatten().copied();
                for absolute in std::iter::once(a.absolute).chain(entries) {
                    demand(absolute >= 0.0 && absolute.is_finite(), "absolute tolerance", absolute, "not negative")?;
                }
                demand(a.relative >= 0.0 && a.relative.is_finite(), "relative tolerance", a.relative, "not negative")?;
                let some = a.relative > 0.0 || a.absolute > 0.0 || a.absolute_entries.is_some();
                demand(some, "tolerance", 0.0, "positive, relative or absolute")?;
                a.first.map_or(Ok(()), |first| positive("first step", first))?;
                bounds(a.smallest, a.largest)?;
                demand(a.safety > 0.0 && a.safety <= 1.0, "safety factor", a.safety, "above 0, at most 1")?;
                growing("growth", a.growth)?;
                shrinking("cut", a.cut)
            }
            Self::Effort(e) => {
                positive("first step", e.first)?;
                bounds(e.smallest, e.largest)?;
                growing("growth", e.growth)?;
                shrinking("cut", e.cut)
            }
        }
    }
}

impl Retries {
    /// Checks the parameters.
    pub(super) fn check(&self) -> Result<(), StepperError> {
        shrinking("first cut", self.first_cut)?;
        shrinking("cut", self.cut)?;
        growing("growth after a cut", self.growth)?;
        let fraction = self.smallest_fraction;
        demand(fraction > 0.0 && fraction <= 1.0, "smallest fraction", fraction, "above 0, at most 1")
    }
}
