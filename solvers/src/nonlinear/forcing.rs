//! How accurately the linear system of an iteration is solved: `‖R + J d‖ ≤ η ‖R‖`.
//!
//! Far from the solution the linear model is not worth an accurate solve; close to it the linear
//! tolerance decides the order of convergence. S. C. Eisenstat and H. F. Walker, *Choosing the forcing
//! terms in an inexact Newton method*, SIAM J. Sci. Comput. 17 (1996) 16–32. Only iterative linear
//! solvers gain; a direct solver with a fresh factor just solves.

use super::options::{NewtonOptionsError, require};

/// Tolerance `η` of the linear solves.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Forcing {
    /// The same in every iteration.
    Constant(f64),
    /// Choice 1: `η = |‖R‖ − ‖R₋ + J₋ s₋‖| / ‖R₋‖`, how well the last linear model predicted.
    EisenstatWalker1 {
        /// `η` of the first iteration.
        first: f64,
        /// Upper bound.
        largest: f64,
    },
    /// Choice 2: `η = γ (‖R‖ / ‖R₋‖)^α`, how fast the residual fell.
    EisenstatWalker2 {
        /// `η` of the first iteration.
        first: f64,
        /// Upper bound.
        largest: f64,
        /// Factor `γ` in (0, 1].
        gamma: f64,
        /// Exponent `α` in (1, 2].
        alpha: f64,
    },
}

impl Default for Forcing {
    fn default() -> Self {
        Self::Constant(1e-10)
    }
}

/// Nothing below this can be asked of a linear solve in double precision.
const SMALLEST: f64 = 1e-14;

impl Forcing {
    /// Choice 1 of Eisenstat and Walker, first `η` 0.1, at most 0.5.
    pub fn eisenstat_walker_1() -> Self {
        Self::EisenstatWalker1 { first: 0.1, largest: 0.5 }
    }

    /// Choice 2 of Eisenstat and Walker with `γ = 0.9`, `α = 2`, first `η` 0.1, at most 0.5.
    pub fn eisenstat_walker_2() -> Self {
        Self::EisenstatWalker2 { first: 0.1, largest: 0.5, gamma: 0.9, alpha: 2.0 }
    }

    pub(super) fn validate(self) -> Result<(), NewtonOptionsError> {
        let inside = |value: f64| require(value > 0.0 && value < 1.0, "forcing", value, "must be in (0, 1)");
        match self {
            Self::Constant(eta) => inside(eta),
            Self::EisenstatWalker1 { first, largest } => inside(first).and(inside(largest)),
            Self::EisenstatWalker2 { first, largest, gamma, alpha } => {
                inside(first).and(inside(largest))?;
                require(gamma > 0.0 && gamma <= 1.0, "forcing", gamma, "(gamma) must be in (0, 1]")?;
                require(alpha > 1.0 && alpha <= 2.0, "forcing", alpha, "(alpha) must be in (1, 2]")
            }
        }
    }
}

/// What the last step did, as far as forcing cares.
#[derive(Debug, Clone, Copy)]
struct LastStep {
    eta: f64,
    norm: f64,
    /// `‖R₋ + J₋ s₋‖` of the step actually taken.
    model: f64,
}

/// The forcing terms of one solve.
#[derive(Debug, Clone)]
pub(super) struct ForcingSequence {
    forcing: Forcing,
    last: Option<LastStep>,
}

impl ForcingSequence {
    pub(super) fn new(forcing: Forcing) -> Self {
        Self { forcing, last: None }
    }

    /// `η` for a residual of norm `norm` that has to come down to `target`.
    pub(super) fn next(&self, norm: f64, target: f64) -> f64 {
        let (first, largest) = match self.forcing {
            Forcing::Constant(eta) => return eta.max(SMALLEST),
            Forcing::EisenstatWalker1 { first, largest } | Forcing::EisenstatWalker2 { first, largest, .. } => {
                (first, largest)
            }
        };
        let Some(last) = self.last else { return first };
        // The safeguards keep one lucky step from asking for an accuracy that the next does not need.
        let (raw, safeguard) = match self.forcing {
            Forcing::EisenstatWalker2 { gamma, alpha, .. } => {
                (gamma * (norm / last.norm).powf(alpha), gamma * last.eta.powf(alpha))
            }
            _ => ((norm - last.model).abs() / last.norm, last.eta.powf(0.5 * (1.0 + 5.0_f64.sqrt()))),
        };
        let eta = if safeguard > 0.1 { raw.max(safeguard) } else { raw };
        // Kelley (1995), 6.3: the last iteration need not go far below the target.
        eta.max(0.5 * target / norm).min(largest).max(SMALLEST)
    }

    /// Learns from a step of length `alpha` times the direction, whose linear system was solved to
    /// `linear_residual` (relative).
    pub(super) fn observe(&mut self, eta: f64, norm: f64, alpha: f64, linear_residual: f64) {
        // R + α J d = (1 − α) R + α (R + J d), bounded by the triangle inequality.
        let alpha = alpha.clamp(0.0, 1.0);
        let model = (1.0 - alpha) * norm + alpha * linear_residual * norm;
        self.last = Some(LastStep { eta, norm, model });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_stays_constant() {
        let mut sequence = ForcingSequence::new(Forcing::Constant(1e-3));
        sequence.observe(1e-3, 1.0, 1.0, 1e-4);
        assert_eq!(sequence.next(0.5, 1e-8), 1e-3);
    }

    #[test]
    fn choice_1_measures_the_model() {
        let mut sequence = ForcingSequence::new(Forcing::eisenstat_walker_1());
        assert_eq!(sequence.next(1.0, 0.0), 0.1);
        sequence.observe(0.1, 1.0, 1.0, 0.08);
        assert!((sequence.next(0.09, 0.0) - 0.01).abs() < 1e-15);
        // The last η was large: 0.5^1.618 = 0.326 is above 0.1 and holds the next one up.
        sequence.observe(0.5, 1.0, 1.0, 0.08);
        assert!((sequence.next(0.09, 0.0) - 0.325_75).abs() < 1e-4);
    }

    #[test]
    fn choice_2_squares_the_reduction() {
        let mut sequence = ForcingSequence::new(Forcing::eisenstat_walker_2());
        sequence.observe(0.1, 1.0, 1.0, 0.05);
        assert!((sequence.next(0.1, 0.0) - 0.009).abs() < 1e-15);
        assert_eq!(sequence.next(10.0, 0.0), 0.5);
        // Nothing beyond the target is asked for.
        assert!((sequence.next(0.1, 0.02) - 0.1).abs() < 1e-15);
    }
}
