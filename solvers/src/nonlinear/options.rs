//! The choices that make up a Newton method, with one documented default each.

use super::forcing::Forcing;
use super::tangent_policy::TangentPolicy;

/// How the Newton step is turned into progress far from the solution.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub enum Globalisation {
    /// The full step. A trial point outside the domain is still shortened, by halving.
    None,
    /// Armijo backtracking with cubic interpolation (Dennis & Schnabel 1983, A6.3.1).
    #[default]
    Backtracking,
    /// The line search of Moré & Thuente (1994): strong Wolfe conditions.
    MoreThuente,
    /// The line search of Hager & Zhang (2005): approximate Wolfe conditions.
    HagerZhang,
    /// Powell's dogleg in a trust region (Nocedal & Wright 2006, algorithms 4.1 and 11.5). Needs the
    /// product with the transposed tangent: a symmetric tangent, or one with entries.
    TrustRegion {
        /// First radius in the units of `‖y‖`; `None`: the length of the first Newton step.
        initial_radius: Option<f64>,
    },
}

/// What a line search decreases.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Merit {
    /// `½ ‖R‖²`.
    #[default]
    Residual,
    /// The potential `Φ` with `R = ∇Φ`: slopes are then `R · d`, the energy slope. Where the problem
    /// has no potential, or the direction does not descend, or the expected decrease is below the
    /// rounding of `Φ`, the residual is used; the history says which.
    Potential,
}

/// Everything that [`NewtonSolver`](super::NewtonSolver) can be told.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonOptions {
    /// Converged when `‖R‖ ≤ relative_tolerance × min(‖R₀‖, scale)`, with the scale below. Default 1e-8.
    pub relative_tolerance: f64,
    /// Converged when `‖R‖ ≤ scale_tolerance × scale`, where the scale is the norm of the summands of
    /// `R` before they cancel. Default 1e-12.
    pub scale_tolerance: f64,
    /// Iterations allowed; once more as many with fresh tangents if the last was stale. Default 25.
    pub max_iterations: usize,
    /// When the tangent is renewed. Default: in every iteration.
    pub tangent: TangentPolicy,
    /// What is done about steps that are too long. Default: backtracking.
    pub globalisation: Globalisation,
    /// What a line search decreases. Default: the residual.
    pub merit: Merit,
    /// Tolerance of the linear solves. Default: constant 1e-10, which suits direct solvers.
    pub forcing: Forcing,
    /// Trial points per iteration of the globalisation. Default 30.
    pub max_trials: usize,
    /// Diverged when `‖R‖ > divergence ‖R₀‖`. Default 1e12: a full Newton step may well go far astray
    /// and come back, so this only ends what has run away for good.
    pub divergence: f64,
    /// Stagnated when the smallest residual norm has not fallen by one per cent in this many
    /// iterations. Default 8.
    pub stagnation: usize,
    /// Corrections with the factor at hand that may follow convergence, each only if it halves the residual: for
    /// conservation laws, which hold as exactly as the equations are solved. Default 0.
    pub final_corrections: usize,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self {
            relative_tolerance: 1e-8,
            scale_tolerance: 1e-12,
            max_iterations: 25,
            tangent: TangentPolicy::default(),
            globalisation: Globalisation::default(),
            merit: Merit::default(),
            forcing: Forcing::default(),
            max_trials: 30,
            divergence: 1e12,
            stagnation: 8,
            final_corrections: 0,
        }
    }
}

/// An option whose value makes no sense.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("option `{option}`: {reason}")]
pub struct NewtonOptionsError {
    /// Name of the option.
    pub option: &'static str,
    /// What is wrong with it.
    pub reason: String,
}

impl NewtonOptions {
    /// Checks every value, and that the choices go together.
    ///
    /// # Errors
    /// The first option that makes no sense.
    pub fn validate(&self) -> Result<(), NewtonOptionsError> {
        require(
            (0.0..1.0).contains(&self.relative_tolerance),
            "relative_tolerance",
            self.relative_tolerance,
            "must be in [0, 1)",
        )?;
        require(
            (0.0..1.0).contains(&self.scale_tolerance),
            "scale_tolerance",
            self.scale_tolerance,
            "must be in [0, 1)",
        )?;
        require(self.max_iterations > 0, "max_iterations", self.max_iterations, "must be at least 1")?;
        require(self.max_trials > 0, "max_trials", self.max_trials, "must be at least 1")?;
        require(self.divergence > 1.0, "divergence", self.divergence, "must be above 1")?;
        require(self.stagnation > 0, "stagnation", self.stagnation, "must be at least 1")?;
        self.tangent.validate()?;
        self.forcing.validate()?;
        if let Globalisation::TrustRegion { initial_radius } = self.globalisation {
            if let Some(radius) = initial_radius {
                require(radius > 0.0 && radius.is_finite(), "initial_radius", radius, "must be positive")?;
            }
            // The dogleg needs a model in which the Newton step and the gradient belong together.
            let quasi = matches!(self.tangent, TangentPolicy::QuasiNewton { .. });
            require(!quasi, "globalisation", "trust region", "cannot go with quasi-Newton updates: use a line search")?;
            let residual = self.merit == Merit::Residual;
            require(residual, "merit", "potential", "cannot go with the dogleg, which models ½‖R‖²")?;
        }
        Ok(())
    }
}

/// One rule for one option.
pub(super) fn require(
    holds: bool,
    option: &'static str,
    value: impl std::fmt::Display,
    rule: &str,
) -> Result<(), NewtonOptionsError> {
    if holds { Ok(()) } else { Err(NewtonOptionsError { option, reason: format!("{value} {rule}") }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_nonsense_is_named() {
        assert_eq!(NewtonOptions::default().validate(), Ok(()));
        let wrong = [
            (NewtonOptions { relative_tolerance: f64::NAN, ..Default::default() }, "relative_tolerance"),
            (NewtonOptions { scale_tolerance: -1.0, ..Default::default() }, "scale_tolerance"),
            (NewtonOptions { max_iterations: 0, ..Default::default() }, "max_iterations"),
            (NewtonOptions { max_trials: 0, ..Default::default() }, "max_trials"),
            (NewtonOptions { divergence: 0.5, ..Default::default() }, "divergence"),
            (NewtonOptions { stagnation: 0, ..Default::default() }, "stagnation"),
            (NewtonOptions { forcing: Forcing::Constant(2.0), ..Default::default() }, "forcing"),
        ];
        for (options, name) in wrong {
            let error = options.validate().expect_err(name);
            assert_eq!(error.option, name);
        }
    }

    #[test]
    fn combinations_that_cannot_work_are_refused() {
        let trust = Globalisation::TrustRegion { initial_radius: None };
        let quasi = NewtonOptions { globalisation: trust, tangent: TangentPolicy::broyden(), ..Default::default() };
        assert_eq!(quasi.validate().expect_err("refused").option, "globalisation");
        let potential = NewtonOptions { globalisation: trust, merit: Merit::Potential, ..Default::default() };
        assert_eq!(potential.validate().expect_err("refused").option, "merit");
    }
}
