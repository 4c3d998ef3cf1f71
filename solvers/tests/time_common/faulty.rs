//! A system that fails on purpose.

use std::ops::Range;

use nicolson_solvers::EvaluationError;
use nicolson_solvers::linear::Tangent;
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{RatePart, StageSystem, System};

/// How it fails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    Error,
    NotANumber,
}

/// Lets the calls number `from` up to (not including) `until` of rate or residual fail.
pub struct Faulty<S> {
    pub inner: S,
    pub fault: Fault,
    pub calls: usize,
    pub failing: Range<usize>,
}

impl<S> Faulty<S> {
    pub fn new(inner: S, fault: Fault, failing: Range<usize>) -> Self {
        Self { inner, fault, calls: 0, failing }
    }

    fn strike(&mut self, out: &mut [f64]) -> Result<(), EvaluationError> {
        let call = self.calls;
        self.calls += 1;
        if !self.failing.contains(&call) {
            return Ok(());
        }
        match self.fault {
            Fault::Error => Err(EvaluationError::outside_domain("volume ratio J", 0, -0.5)),
            Fault::NotANumber => {
                out[out.len() - 1] = f64::NAN;
                Ok(())
            }
        }
    }
}

impl<S: StageSystem> System for Faulty<S> {
    fn len(&self) -> usize {
        self.inner.len()
    }

    fn rate(&mut self, t: f64, u: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        self.inner.rate(t, u, out)?;
        self.strike(out)
    }

    fn rate_part(&mut self, part: RatePart, t: f64, u: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        self.inner.rate_part(part, t, u, out)?;
        if part == RatePart::Others { Ok(()) } else { self.strike(out) }
    }

    fn impose(&mut self, t: f64, u: &mut [f64]) {
        self.inner.impose(t, u);
    }

    fn velocities(&self) -> Option<Range<usize>> {
        self.inner.velocities()
    }

    fn stages(&mut self) -> Option<&mut dyn StageSystem> {
        Some(self)
    }
}

impl<S: StageSystem> NonlinearProblem for Faulty<S> {
    fn unknowns(&self) -> usize {
        self.inner.unknowns()
    }

    fn residual(&mut self, y: &[f64], out: &mut [f64]) -> Result<f64, EvaluationError> {
        let scale = self.inner.residual(y, out)?;
        self.strike(out)?;
        Ok(scale)
    }

    fn linearise(&mut self, y: &[f64]) -> Result<(), EvaluationError> {
        self.inner.linearise(y)
    }

    fn tangent(&self) -> &dyn Tangent {
        self.inner.tangent()
    }
}

impl<S: StageSystem> StageSystem for Faulty<S> {
    fn begin_stage(&mut self, t: f64, shift: f64, base: &[f64]) {
        self.inner.begin_stage(t, shift, base);
    }

    fn start_from(&mut self, guess: &[f64], y: &mut [f64]) {
        self.inner.start_from(guess, y);
    }

    fn admissible_start(&mut self, u: &[f64], y: &mut [f64]) {
        self.inner.admissible_start(u, y);
    }

    fn finish_stage(&mut self, y: &[f64], u: &mut [f64], rate: &mut [f64]) -> Result<(), EvaluationError> {
        self.inner.finish_stage(y, u, rate)
    }
}
