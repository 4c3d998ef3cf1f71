//! Diagonally implicit Runge–Kutta schemes: TR-BDF2 and SDIRK3.
//!
//! `Yᵢ = u₀ + Δt Σⱼ aᵢⱼ f(t₀ + cⱼΔt, Yⱼ)`, `j ≤ i`, with the same `aᵢᵢ` in every implicit stage (one tangent) and
//! `u₁` equal to the last stage. The error is `Δt Σ (bᵢ − b̂ᵢ) fᵢ` with the weights `b̂` of an embedded scheme.

use super::attempt::{Attempt, Estimate};
use super::stage::Guess;
use super::{Scheme, StepCause};

/// A diagonally implicit scheme of three stages, lower triangle by rows; the first stage is explicit if its entry is 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiagonalTableau {
    /// `cᵢ`: times of the stages, in steps.
    pub nodes: [f64; 3],
    /// `aᵢⱼ`; the last row is that of the result.
    pub rows: [[f64; 3]; 3],
    /// `b − b̂`: weights of the estimate of the error.
    pub error: [f64; 3],
}

impl DiagonalTableau {
    /// TR-BDF2: with `γ = 2 − √2`, the trapezium rule to `t₀ + γΔt`, then BDF2 to `t₁` (R. E. Bank et al., *IEEE
    /// Trans. CAD* 4 (1985) 436), written as a Runge–Kutta scheme with embedded order 3 by M. E. Hosea and
    /// L. F. Shampine, *Appl. Numer. Math.* 20 (1996) 21–37. The rate at the end serves the next step.
    pub(super) fn tr_bdf2() -> Self {
        let gamma = 2.0 - std::f64::consts::SQRT_2;
        let (d, w) = (0.5 * gamma, 0.25 * std::f64::consts::SQRT_2);
        let embedded = [(1.0 - w) / 3.0, (3.0 * w + 1.0) / 3.0, d / 3.0];
        Self {
            nodes: [0.0, gamma, 1.0],
            rows: [[0.0, 0.0, 0.0], [d, d, 0.0], [w, w, d]],
            error: [w - embedded[0], w - embedded[1], d - embedded[2]],
        }
    }

    /// SDIRK3: three stages, order 3, L-stable (R. Alexander, *SIAM J. Numer. Anal.* 14 (1977) 1006–1021).
    /// `γ` is the root 0.4358… of `6γ³ − 18γ² + 9γ − 1`. The embedded scheme of order 2 uses the first two
    /// stages only; its stability function tends to −0.96 at infinity, so stiff parts leave the estimate
    /// bounded.
    pub(super) fn sdirk3() -> Self {
        let g = SDIRK3_DIAGONAL;
        let b1 = -1.5 * g * g + 4.0 * g - 0.25;
        let b2 = 1.5 * g * g - 5.0 * g + 1.25;
        let embedded = [g / (1.0 - g), (1.0 - 2.0 * g) / (1.0 - g)];
        Self {
            nodes: [g, 0.5 * (1.0 + g), 1.0],
            rows: [[g, 0.0, 0.0], [0.5 * (1.0 - g), g, 0.0], [b1, b2, g]],
            error: [b1 - embedded[0], b2 - embedded[1], g],
        }
    }
}

impl Scheme {
    /// The stages of TR-BDF2 or SDIRK3; `None` for a scheme that is not diagonally implicit in several stages.
    pub fn tableau(&self) -> Option<DiagonalTableau> {
        match self {
            Self::TrBdf2 => Some(DiagonalTableau::tr_bdf2()),
            Self::Sdirk3 => Some(DiagonalTableau::sdirk3()),
            _ => None,
        }
    }

    /// Nonlinear problems that a step solves one after the other; 0 for an explicit scheme.
    pub fn implicit_stages(&self) -> usize {
        match self.tableau() {
            Some(tableau) => tableau.rows.iter().enumerate().filter(|(i, row)| row[*i] != 0.0).count(),
            None => usize::from(self.is_implicit()),
        }
    }
}

impl Attempt<'_> {
    /// A step of a diagonally implicit scheme.
    pub fn diagonal(&mut self, tableau: &DiagonalTableau) -> Result<Estimate, StepCause> {
        let step = self.span.step;
        let mut guess = Guess::Start;
        for (i, row) in tableau.rows.iter().enumerate() {
            if row[i] == 0.0 {
                self.know_start_rate()?;
                self.tools.rates[i].copy_from_slice(&self.start.memory.rate);
                continue;
            }
            let base = &mut self.tools.base;
            base.copy_from_slice(&self.start.values);
            for (weight, rate) in row[..i].iter().zip(&self.tools.rates) {
                crate::vector::axpy(weight * step, rate, base);
            }
            let time = if i == 2 { self.span.end } else { self.start.time + tableau.nodes[i] * step };
            self.solve_stage(time, row[i] * step, guess, i)?;
            guess = Guess::Last;
        }
        self.finish_at_stage(2);
        if !self.wants_estimate {
            return Ok(Estimate::None);
        }
        let [f0, f1, f2] = &self.tools.rates;
        for (i, e) in self.tools.estimate.iter_mut().enumerate() {
            *e = step * (tableau.error[0] * f0[i] + tableau.error[1] * f1[i] + tableau.error[2] * f2[i]);
        }
        self.impose_on_estimate();
        Ok(Estimate::Embedded { power: 3.0 })
    }
}

/// The root of `6γ³ − 18γ² + 9γ − 1` between ⅙ and ½.
const SDIRK3_DIAGONAL: f64 = 0.435_866_521_508_459;
