//! Small test systems with dense tangents, and a dense linear solver.

#![allow(dead_code, reason = "every test file uses its own part")]

pub mod complex;
pub mod dense;
pub mod faulty;
pub mod spring;

use std::ops::Range;

use nicolson_solvers::EvaluationError;
use nicolson_solvers::linear::Tangent;
use nicolson_solvers::nonlinear::{NewtonOptions, NewtonSolver, NonlinearProblem};
use nicolson_solvers::time::{RatePart, Scheme, StageSystem, StepControl, Stepper, System, TimeState};

use dense::{DenseSolver, DenseTangent};

/// Equations `u' = f(t, u)` with a dense Jacobian.
pub trait Equations {
    fn len(&self) -> usize;
    fn rate(&self, t: f64, u: &[f64], out: &mut [f64]);
    /// Row by row.
    fn jacobian(&self, t: f64, u: &[f64]) -> Vec<f64>;
    fn velocities(&self) -> Option<Range<usize>> {
        None
    }
    fn impose(&self, _t: f64, _u: &mut [f64]) {}
    fn stable_step(&self, _t: f64) -> f64 {
        f64::INFINITY
    }
}

/// Equations as a system with stages in the full unknowns.
pub struct Full<E> {
    pub equations: E,
    pub rates: usize,
    pub velocity_rates: usize,
    pub residuals: usize,
    time: f64,
    shift: f64,
    base: Vec<f64>,
    tangent: DenseTangent,
}

impl<E: Equations> Full<E> {
    pub fn new(equations: E) -> Self {
        let tangent = DenseTangent::zeros(equations.len());
        let base = vec![0.0; equations.len()];
        Self { equations, rates: 0, velocity_rates: 0, residuals: 0, time: 0.0, shift: 0.0, base, tangent }
    }
}

impl<E: Equations> System for Full<E> {
    fn len(&self) -> usize {
        self.equations.len()
    }

    fn rate(&mut self, t: f64, u: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        self.rates += 1;
        self.equations.rate(t, u, out);
        Ok(())
    }

    fn rate_part(&mut self, part: RatePart, t: f64, u: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        let velocities = self.velocities().unwrap_or(0..0);
        let mut all = vec![0.0; u.len()];
        self.equations.rate(t, u, &mut all);
        self.velocity_rates += usize::from(part == RatePart::Velocities);
        for i in 0..u.len() {
            if part == RatePart::All || (part == RatePart::Velocities) == velocities.contains(&i) {
                out[i] = all[i];
            }
        }
        Ok(())
    }

    fn velocities(&self) -> Option<Range<usize>> {
        self.equations.velocities()
    }

    fn impose(&mut self, t: f64, u: &mut [f64]) {
        self.equations.impose(t, u);
    }

    fn stable_step(&mut self, t: f64, _u: &[f64]) -> f64 {
        self.equations.stable_step(t)
    }

    fn stages(&mut self) -> Option<&mut dyn StageSystem> {
        Some(self)
    }
}

impl<E: Equations> NonlinearProblem for Full<E> {
    fn unknowns(&self) -> usize {
        self.equations.len()
    }

    fn residual(&mut self, y: &[f64], out: &mut [f64]) -> Result<f64, EvaluationError> {
        self.residuals += 1;
        self.equations.rate(self.time, y, out);
        let mut scale = 0.0_f64;
        for i in 0..y.len() {
            let rate = self.shift * out[i];
            out[i] = y[i] - self.base[i] - rate;
            scale += (y[i].abs() + self.base[i].abs() + rate.abs()).powi(2);
        }
        Ok(scale.sqrt())
    }

    fn linearise(&mut self, y: &[f64]) -> Result<(), EvaluationError> {
        let n = y.len();
        let mut entries = self.equations.jacobian(self.time, y);
        for (k, entry) in entries.iter_mut().enumerate() {
            *entry = f64::from(u8::from(k / n == k % n)) - self.shift * *entry;
        }
        self.tangent = DenseTangent::new(n, entries);
        Ok(())
    }

    fn tangent(&self) -> &dyn Tangent {
        &self.tangent
    }
}

impl<E: Equations> StageSystem for Full<E> {
    fn begin_stage(&mut self, t: f64, shift: f64, base: &[f64]) {
        self.time = t;
        self.shift = shift;
        self.base.copy_from_slice(base);
    }

    fn start_from(&mut self, guess: &[f64], y: &mut [f64]) {
        y.copy_from_slice(guess);
    }

    fn admissible_start(&mut self, u: &[f64], y: &mut [f64]) {
        y.copy_from_slice(u);
    }

    fn finish_stage(&mut self, y: &[f64], u: &mut [f64], rate: &mut [f64]) -> Result<(), EvaluationError> {
        u.copy_from_slice(y);
        for i in 0..y.len() {
            rate[i] = (y[i] - self.base[i]) / self.shift;
        }
        Ok(())
    }
}

/// `q'' = -ω² q` as `(q, v)`.
pub struct Oscillator {
    pub omega: f64,
}

impl Equations for Oscillator {
    fn len(&self) -> usize {
        2
    }

    fn rate(&self, _t: f64, u: &[f64], out: &mut [f64]) {
        out[0] = u[1];
        out[1] = -self.omega * self.omega * u[0];
    }

    fn jacobian(&self, _t: f64, _u: &[f64]) -> Vec<f64> {
        vec![0.0, 1.0, -self.omega * self.omega, 0.0]
    }

    fn velocities(&self) -> Option<Range<usize>> {
        Some(1..2)
    }
}

/// A forced, damped, nonlinear oscillator with a known solution:
/// `q' = v − a sin q + g(t)`, `v' = −q − ½q³ − c v + F(t)`, `q = 0.8 sin(1.3 t + 0.2)`, `v = 0.6 cos(0.9 t)`.
pub struct Forced {
    pub a: f64,
    pub c: f64,
}

impl Forced {
    pub fn exact(t: f64) -> [f64; 2] {
        [0.8 * (1.3 * t + 0.2).sin(), 0.6 * (0.9 * t).cos()]
    }

    fn own(&self, q: f64, v: f64) -> [f64; 2] {
        [v - self.a * q.sin(), -q - 0.5 * q * q * q - self.c * v]
    }
}

impl Equations for Forced {
    fn len(&self) -> usize {
        2
    }

    fn rate(&self, t: f64, u: &[f64], out: &mut [f64]) {
        let [q, v] = Self::exact(t);
        let there = self.own(q, v);
        let here = self.own(u[0], u[1]);
        out[0] = here[0] - there[0] + 1.04 * (1.3 * t + 0.2).cos();
        out[1] = here[1] - there[1] - 0.54 * (0.9 * t).sin();
    }

    fn jacobian(&self, _t: f64, u: &[f64]) -> Vec<f64> {
        vec![-self.a * u[0].cos(), 1.0, -1.0 - 1.5 * u[0] * u[0], -self.c]
    }

    fn velocities(&self) -> Option<Range<usize>> {
        Some(1..2)
    }
}

/// Newton's method to rounding, with the dense solver.
pub fn newton() -> NewtonSolver {
    let options = NewtonOptions { relative_tolerance: 0.0, scale_tolerance: 1e-15, ..NewtonOptions::default() };
    NewtonSolver::new(options, Box::new(DenseSolver::default()))
}

/// A stepper with Newton's method if the scheme needs it.
pub fn stepper(scheme: Scheme, control: StepControl) -> Stepper {
    let newton = scheme.is_implicit().then(newton);
    Stepper::new(scheme, control, newton).expect("valid set-up")
}

/// Advances to `target`; returns the number of steps.
pub fn run(stepper: &mut Stepper, system: &mut dyn System, state: &mut TimeState, target: f64) -> usize {
    let mut steps = 0;
    while state.time < target {
        stepper.advance(system, state, target).unwrap_or_else(|failure| panic!("{failure}"));
        steps += 1;
    }
    assert_eq!(state.time.to_bits(), target.to_bits());
    steps
}

/// Bits of a state, time included.
pub fn bits(state: &TimeState) -> Vec<u64> {
    std::iter::once(&state.time).chain(&state.values).map(|value| value.to_bits()).collect()
}
