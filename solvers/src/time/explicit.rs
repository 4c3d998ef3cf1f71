//! Explicit Runge–Kutta schemes: forward Euler, TVD-RK2, TVD-RK3, RK4.
//!
//! Every stage is a state of its own: prescribed entries are imposed in each, at its own time. That keeps
//! order 2; schemes of higher order fall back to about 2 next to an entry whose motion is not polynomial,
//! because their stages are less accurate than their result (M. H. Carpenter et al., *SIAM J. Sci. Comput.* 16
//! (1995) 1241–1252).
//!
//! TVD schemes: C.-W. Shu, S. Osher, *J. Comput. Phys.* 77 (1988) 439–471.

use super::StepCause;
use super::attempt::{Attempt, Estimate};
use crate::vector::combine;

impl Attempt<'_> {
    /// `u₁ = u₀ + Δt f₀`. Error `½Δt (f₁ − f₀) = ½Δt² u″ + O(Δt³)`; the rate `f₁` serves the next step.
    pub fn forward_euler(&mut self) -> Result<Estimate, StepCause> {
        self.euler_predictor()?;
        if !self.wants_estimate {
            return Ok(Estimate::None);
        }
        self.know_end_rate()?;
        let half = 0.5 * self.span.step;
        let rates = self.end.memory.rate.iter().zip(&self.start.memory.rate);
        for (e, (f1, f0)) in self.tools.estimate.iter_mut().zip(rates) {
            *e = half * (f0 - f1);
        }
        self.impose_on_estimate();
        Ok(Estimate::Embedded { power: 2.0 })
    }

    /// `Y₁ = u₀ + Δt f₀`, `u₁ = ½u₀ + ½(Y₁ + Δt f(Y₁))`. Error `u₁ − Y₁`: the pair Heun–Euler 2(1).
    pub fn tvd_rk2(&mut self) -> Result<Estimate, StepCause> {
        let step = self.span.step;
        self.euler_predictor()?;
        self.rate_of_end(self.span.end, 0)?;
        if self.wants_estimate {
            self.tools.estimate.copy_from_slice(&self.end.values);
        }
        let rate = &self.tools.rates[0];
        combine(&mut self.end.values, &self.start.values, rate, |u, u0, f| 0.5 * u0 + 0.5 * (u + step * f));
        self.system.impose(self.span.end, &mut self.end.values);
        if !self.wants_estimate {
            return Ok(Estimate::None);
        }
        for (e, u) in self.tools.estimate.iter_mut().zip(&self.end.values) {
            *e = u - *e;
        }
        Ok(Estimate::Embedded { power: 2.0 })
    }

    /// `Y₁ = u₀ + Δt f₀`, `Y₂ = ¾u₀ + ¼(Y₁ + Δt f(Y₁))` at `t₀ + Δt/2`, `u₁ = ⅓u₀ + ⅔(Y₂ + Δt f(Y₂))`.
    ///
    /// The result of TVD-RK2 is `2Y₂ − u₀`, so the pair 3(2) costs nothing: error `u₁ − (2Y₂ − u₀)`.
    pub fn tvd_rk3(&mut self) -> Result<Estimate, StepCause> {
        let step = self.span.step;
        let middle = self.start.time + 0.5 * step;
        self.euler_predictor()?;
        self.rate_of_end(self.span.end, 0)?;
        let rate = &self.tools.rates[0];
        combine(&mut self.end.values, &self.start.values, rate, |u, u0, f| 0.75 * u0 + 0.25 * (u + step * f));
        self.system.impose(middle, &mut self.end.values);
        if self.wants_estimate {
            let embedded = self.end.values.iter().zip(&self.start.values);
            for (e, (y, u0)) in self.tools.estimate.iter_mut().zip(embedded) {
                *e = 2.0 * y - u0;
            }
        }
        self.rate_of_end(middle, 0)?;
        let rate = &self.tools.rates[0];
        combine(&mut self.end.values, &self.start.values, rate, |u, u0, f| (u0 + 2.0 * (u + step * f)) / 3.0);
        self.system.impose(self.span.end, &mut self.end.values);
        if !self.wants_estimate {
            return Ok(Estimate::None);
        }
        self.system.impose(self.span.end, &mut self.tools.estimate);
        for (e, u) in self.tools.estimate.iter_mut().zip(&self.end.values) {
            *e = u - *e;
        }
        Ok(Estimate::Embedded { power: 3.0 })
    }

    /// The classical scheme: nodes 0, ½, ½, 1, weights ⅙, ⅓, ⅓, ⅙. No embedded estimate.
    pub fn rk4(&mut self) -> Result<Estimate, StepCause> {
        let step = self.span.step;
        self.know_start_rate()?;
        self.tools.rates[1].copy_from_slice(&self.start.memory.rate);
        let middle = self.start.time + 0.5 * step;
        // (time of the stage, distance of the stage along the rate before it, weight of its own rate)
        let stages = [(middle, 0.5, 2.0), (middle, 0.5, 2.0), (self.span.end, 1.0, 1.0)];
        self.tools.rates[0].copy_from_slice(&self.start.memory.rate);
        for (time, distance, weight) in stages {
            let rate = &self.tools.rates[0];
            combine(&mut self.end.values, &self.start.values, rate, |_, u0, f| u0 + distance * step * f);
            self.system.impose(time, &mut self.end.values);
            self.rate_of_end(time, 0)?;
            let [last, sum, _] = &mut self.tools.rates;
            for (sum, f) in sum.iter_mut().zip(last.iter()) {
                *sum += weight * f;
            }
        }
        let sum = &self.tools.rates[1];
        combine(&mut self.end.values, &self.start.values, sum, |_, u0, sum| u0 + step / 6.0 * sum);
        self.system.impose(self.span.end, &mut self.end.values);
        Ok(Estimate::None)
    }

    /// Writes `u₀ + Δt f₀`, imposed at the end of the step, to the end.
    fn euler_predictor(&mut self) -> Result<(), StepCause> {
        self.know_start_rate()?;
        let step = self.span.step;
        let rate = &self.start.memory.rate;
        combine(&mut self.end.values, &self.start.values, rate, |_, u0, f| u0 + step * f);
        self.system.impose(self.span.end, &mut self.end.values);
        Ok(())
    }
}
