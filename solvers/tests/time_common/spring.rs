//! A mass on a nonlinear spring, condensed to its velocity, with a discrete energy:
//! `x' = v`, `v' = −ψ'(x) − c v + F(t)`.

use std::ops::Range;

use nicolson_solvers::EvaluationError;
use nicolson_solvers::linear::Tangent;
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{ConservingSystem, StageSystem, System};

use super::dense::DenseTangent;

/// The energy of the spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Potential {
    /// `½ k x² + ¼ b x⁴`.
    Quartic { k: f64, b: f64 },
    /// `k (½ (1 + x)² − ½ − ln(1 + x))`, defined for `x > −1`: a neo-Hookean bar of unit length.
    Barrier { k: f64 },
}

impl Potential {
    pub fn energy(self, x: f64) -> f64 {
        match self {
            Self::Quartic { k, b } => 0.5 * k * x * x + 0.25 * b * x.powi(4),
            Self::Barrier { k } => k * (x + 0.5 * x * x - x.ln_1p()),
        }
    }

    fn force(self, x: f64) -> f64 {
        match self {
            Self::Quartic { k, b } => k * x + b * x * x * x,
            Self::Barrier { k } => k * ((1.0 + x) - 1.0 / (1.0 + x)),
        }
    }

    fn stiffness(self, x: f64) -> f64 {
        match self {
            Self::Quartic { k, b } => k + 3.0 * b * x * x,
            Self::Barrier { k } => k * (1.0 + 1.0 / (1.0 + x).powi(2)),
        }
    }

    /// `(ψ(x₁) − ψ(x₀)) / (x₁ − x₀)` and its derivative by `x₁`.
    fn discrete_gradient(self, x0: f64, x1: f64) -> (f64, f64) {
        match self {
            Self::Quartic { k, b } => {
                let (sum, squares) = (x0 + x1, x0 * x0 + x1 * x1);
                (0.5 * k * sum + 0.25 * b * squares * sum, 0.5 * k + 0.25 * b * (2.0 * x1 * sum + squares))
            }
            Self::Barrier { k } => {
                let d = (x1 - x0) / (1.0 + x0);
                let (g, slope) = if d.abs() < 1e-5 {
                    (1.0 - 0.5 * d + d * d / 3.0, -0.5 + d / 1.5)
                } else {
                    let g = d.ln_1p() / d;
                    (g, (1.0 / (1.0 + d) - g) / d)
                };
                (k * (1.0 + 0.5 * (x0 + x1) - g / (1.0 + x0)), k * (0.5 - slope / (1.0 + x0).powi(2)))
            }
        }
    }

    fn check(self, x: f64) -> Result<(), EvaluationError> {
        match self {
            Self::Barrier { .. } if x <= -1.0 => Err(EvaluationError::outside_domain("stretch", 0, 1.0 + x)),
            _ => Ok(()),
        }
    }
}

enum Mode {
    Stage { time: f64, shift: f64, base: [f64; 2] },
    Conserving { time: f64, step: f64, from: [f64; 2] },
}

pub struct Spring {
    pub potential: Potential,
    pub damping: f64,
    pub force: fn(f64) -> f64,
    pub resting_starts: usize,
    pub admissible_starts: usize,
    mode: Mode,
    tangent: DenseTangent,
}

impl Spring {
    pub fn new(potential: Potential, damping: f64, force: fn(f64) -> f64) -> Self {
        let mode = Mode::Stage { time: 0.0, shift: 1.0, base: [0.0; 2] };
        let tangent = DenseTangent::zeros(1);
        Self { potential, damping, force, resting_starts: 0, admissible_starts: 0, mode, tangent }
    }

    pub fn energy(&self, u: &[f64]) -> f64 {
        0.5 * u[1] * u[1] + self.potential.energy(u[0])
    }

    /// Residual and derivative.
    fn evaluate(&self, v: f64) -> Result<(f64, f64, f64), EvaluationError> {
        let (c, potential) = (self.damping, self.potential);
        match self.mode {
            Mode::Stage { time, shift: s, base: [x0, v0] } => {
                let x = x0 + s * v;
                potential.check(x)?;
                let force = potential.force(x) - (self.force)(time);
                let scale = v.abs() + v0.abs() + s * force.abs();
                Ok((v - v0 + s * (force + c * v), 1.0 + s * c + s * s * potential.stiffness(x), scale))
            }
            Mode::Conserving { time, step: h, from: [x0, v0] } => {
                let x = x0 + 0.5 * h * (v0 + v);
                potential.check(x)?;
                let (gradient, slope) = potential.discrete_gradient(x0, x);
                let force = gradient - (self.force)(time + 0.5 * h);
                let scale = v.abs() + v0.abs() + h * force.abs();
                Ok((v - v0 + h * (force + 0.5 * c * (v0 + v)), 1.0 + 0.5 * h * c + 0.5 * h * h * slope, scale))
            }
        }
    }
}

impl System for Spring {
    fn len(&self) -> usize {
        2
    }

    fn rate(&mut self, t: f64, u: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        self.potential.check(u[0])?;
        out[0] = u[1];
        out[1] = -self.potential.force(u[0]) - self.damping * u[1] + (self.force)(t);
        Ok(())
    }

    fn velocities(&self) -> Option<Range<usize>> {
        Some(1..2)
    }

    fn stages(&mut self) -> Option<&mut dyn StageSystem> {
        Some(self)
    }

    fn conserving(&mut self) -> Option<&mut dyn ConservingSystem> {
        Some(self)
    }
}

impl NonlinearProblem for Spring {
    fn unknowns(&self) -> usize {
        1
    }

    fn residual(&mut self, y: &[f64], out: &mut [f64]) -> Result<f64, EvaluationError> {
        let (residual, _, scale) = self.evaluate(y[0])?;
        out[0] = residual;
        Ok(scale)
    }

    fn linearise(&mut self, y: &[f64]) -> Result<(), EvaluationError> {
        self.tangent = DenseTangent::new(1, vec![self.evaluate(y[0])?.1]);
        Ok(())
    }

    fn tangent(&self) -> &dyn Tangent {
        &self.tangent
    }
}

impl StageSystem for Spring {
    fn begin_stage(&mut self, time: f64, shift: f64, base: &[f64]) {
        self.mode = Mode::Stage { time, shift, base: [base[0], base[1]] };
    }

    fn start_from(&mut self, guess: &[f64], y: &mut [f64]) {
        y[0] = guess[1];
    }

    fn admissible_start(&mut self, u: &[f64], y: &mut [f64]) {
        self.admissible_starts += 1;
        if let Mode::Stage { shift, base, .. } = self.mode {
            y[0] = (u[0] - base[0]) / shift;
        }
    }

    fn finish_stage(&mut self, y: &[f64], u: &mut [f64], rate: &mut [f64]) -> Result<(), EvaluationError> {
        if let Mode::Stage { shift, base, .. } = self.mode {
            u[0] = base[0] + shift * y[0];
            u[1] = y[0];
            rate[0] = y[0];
            rate[1] = (y[0] - base[1]) / shift;
        }
        Ok(())
    }
}

impl ConservingSystem for Spring {
    fn begin_conserving(&mut self, time: f64, step: f64, from: &[f64]) {
        self.mode = Mode::Conserving { time, step, from: [from[0], from[1]] };
    }

    fn extrapolated_start(&mut self, y: &mut [f64]) {
        if let Mode::Conserving { from, .. } = self.mode {
            y[0] = from[1];
        }
    }

    fn resting_start(&mut self, y: &mut [f64]) {
        self.resting_starts += 1;
        if let Mode::Conserving { from, .. } = self.mode {
            y[0] = -from[1];
        }
    }

    fn finish_conserving(&mut self, y: &[f64], u: &mut [f64]) -> Result<(), EvaluationError> {
        if let Mode::Conserving { step, from, .. } = self.mode {
            u[0] = from[0] + 0.5 * step * (from[1] + y[0]);
            u[1] = y[0];
        }
        Ok(())
    }
}
