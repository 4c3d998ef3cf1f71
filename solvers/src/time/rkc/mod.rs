//! Runge–Kutta–Chebyshev of second order: explicit, with a real stability interval that grows with the
//! *square* of the number of stages.
//!
//! ```text
//! Y₀ = u₀,  Y₁ = Y₀ + μ̃₁ Δt F₀
//! Yₖ = μₖ Yₖ₋₁ + νₖ Yₖ₋₂ + (1 − μₖ − νₖ) Y₀ + μ̃ₖ Δt Fₖ₋₁ + γ̃ₖ Δt F₀,   k = 2 … s
//! u₁ = Yₛ,   Fₖ = f(t₀ + cₖ Δt, Yₖ)
//! ```
//!
//! Stability: `Δt σ ≤ β(s) ≈ 0.653 (s² − 1)` for a real spectrum in `[−σ, 0]`. **No interval of the imaginary
//! axis is stable**: undamped waves are amplified, see [`rkc_growth`]. The number of stages comes from
//! the spectral radius of the actual operator ([`DominantEigenvalue`]), not from an assumption on it.
//!
//! Sources: J. G. Verwer, W. H. Hundsdorfer, B. P. Sommeijer, *Numer. Math.* 57 (1990) 157–178;
//! B. P. Sommeijer, L. F. Shampine, J. G. Verwer, *J. Comput. Appl. Math.* 88 (1998) 315–326.

mod coefficients;
mod spectral;
mod step;

pub use coefficients::{RkcCoefficients, rkc_growth, rkc_stability_limit, rkc_stages, rkc_stages_by_courant};
pub use spectral::DominantEigenvalue;

use super::StepperError;

/// Options of Runge–Kutta–Chebyshev.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RkcOptions {
    /// Where the number of stages comes from.
    pub stages: RkcStages,
    /// Largest number of stages; a step that needs more fails and is cut.
    pub largest: usize,
}

/// Rule for the number of stages of a Runge–Kutta–Chebyshev step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum RkcStages {
    /// `s = 1 + ⌊√(1 + Δt σ / 0.653)⌋` with σ = `safety ×` the spectral radius found by a power iteration
    /// on differences of the rate.
    SpectralRadius {
        /// Factor of caution on the spectral radius (the iteration converges from below).
        safety: f64,
        /// Steps between two estimates.
        refresh: usize,
    },
    /// `s = 1 + ⌊√(1 + c Δt / (0.131 Δp))⌋`: assumes σ = 5c/Δp, the spectral radius of an artificial
    /// viscosity with α = 2.5. To reproduce published stage numbers.
    Courant {
        /// Wave speed over particle spacing, `c / Δp`.
        frequency: f64,
    },
    /// Always this number (at least 2).
    Fixed(usize),
}

impl Default for RkcOptions {
    fn default() -> Self {
        Self { stages: RkcStages::SpectralRadius { safety: 1.2, refresh: 10 }, largest: 200 }
    }
}

impl RkcOptions {
    pub(super) fn check(self) -> Result<(), StepperError> {
        let bad = |name, value, expected| Err(StepperError::Parameter { name, value, expected });
        if self.largest < 2 {
            return bad("largest number of stages", self.largest as f64, "at least 2");
        }
        match self.stages {
            RkcStages::SpectralRadius { safety, .. } if !(safety >= 1.0 && safety.is_finite()) => {
                bad("safety factor of the spectral radius", safety, "at least 1")
            }
            RkcStages::Courant { frequency } if !(frequency > 0.0 && frequency.is_finite()) => {
                bad("wave speed over spacing", frequency, "positive and finite")
            }
            RkcStages::Fixed(stages) if stages < 2 || stages > self.largest => {
                bad("number of stages", stages as f64, "at least 2, at most the largest number")
            }
            _ => Ok(()),
        }
    }
}
