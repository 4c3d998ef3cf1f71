//! Implicit schemes of one stage: the θ-family, the mid-point rule, generalised-α.

use super::StepCause;
use super::attempt::{Attempt, Estimate};
use super::stage::Guess;

impl Attempt<'_> {
    /// `u₁ = ũ + θΔt f(t₁, u₁)` with `ũ = u₀ + (1 − θ)Δt f₀`.
    ///
    /// The difference to the exact solution, by the trapezium rule with its remainder, is
    /// `(θ − ½)Δt (f₁ − f₀) + (Δt³/6) f[t₁, t₀, t₋₁]`, with the divided difference of the rates of the last two
    /// steps; a first step of its own has no estimate.
    pub fn theta(&mut self, theta: f64) -> Result<Estimate, StepCause> {
        let step = self.span.step;
        if theta < 1.0 {
            self.know_start_rate()?;
            let known = self.start.values.iter().zip(&self.start.memory.rate);
            for (b, (u, f)) in self.tools.base.iter_mut().zip(known) {
                *b = u + (1.0 - theta) * step * f;
            }
        } else {
            self.tools.base.copy_from_slice(&self.start.values);
        }
        self.solve_stage(self.span.end, theta * step, Guess::Start, 0)?;
        self.finish_at_stage(0);
        if !self.wants_estimate {
            return Ok(Estimate::None);
        }
        self.know_start_rate()?;
        self.end.memory.previous_rate.clone_from(&self.start.memory.rate);
        let (before, before_step) = (&self.start.memory.previous_rate, self.start.memory.previous_step);
        if before.len() != self.start.values.len() || before_step.is_nan() || before_step <= 0.0 {
            return Ok(Estimate::None);
        }
        let (first, second) = (theta - 0.5, step * step / 6.0 / (step + before_step));
        let rates = self.start.memory.rate.iter().zip(before).zip(&self.tools.rates[0]);
        for (e, ((f0, before), f1)) in self.tools.estimate.iter_mut().zip(rates) {
            let bend = (f1 - f0) - (f0 - before) * (step / before_step);
            *e = step * first * (f1 - f0) + second * bend;
        }
        self.impose_on_estimate();
        Ok(Estimate::Embedded { power: if first == 0.0 { 3.0 } else { 2.0 } })
    }

    /// `U = u₀ + Δt/2 f(t₀ + Δt/2, U)`, `u₁ = 2U − u₀`. No embedded estimate.
    pub fn midpoint(&mut self) -> Result<Estimate, StepCause> {
        let half = 0.5 * self.span.step;
        self.tools.base.copy_from_slice(&self.start.values);
        self.solve_stage(self.start.time + half, half, Guess::Start, 0)?;
        for (u, u0) in self.end.values.iter_mut().zip(&self.start.values) {
            *u = 2.0 * *u - u0;
        }
        self.system.impose(self.span.end, &mut self.end.values);
        Ok(Estimate::None)
    }

    /// Generalised-α for `u′ = f` (K. E. Jansen, C. H. Whiting, G. M. Hulbert, *Comput. Methods Appl. Mech.
    /// Eng.* 190 (2000) 305–319), with an algorithmic rate `r` besides `u`:
    ///
    /// ```text
    /// r_αm = f(t_αf, u_αf),   r_αm = r₀ + αm (r₁ − r₀),   u_αf = u₀ + αf (u₁ − u₀)
    /// u₁ = u₀ + Δt r₀ + γΔt (r₁ − r₀)
    /// αm = ½ (3 − ρ∞)/(1 + ρ∞),   αf = 1/(1 + ρ∞),   γ = ½ + αm − αf
    /// ```
    ///
    /// Eliminating `r₁` leaves the stage `u_αf = ũ + s f(t_αf, u_αf)` with `s = αf γ Δt/αm` and
    /// `ũ = u₀ + αf (1 − γ/αm)Δt r₀`. The first `r₀` is `f₀`. No embedded estimate. Every change of the step
    /// perturbs `r` by `O(Δt)(αf − αm)`, which costs accuracy where the step jumps often.
    pub fn generalised_alpha(&mut self, spectral_radius: f64) -> Result<Estimate, StepCause> {
        let step = self.span.step;
        let alpha_m = 0.5 * (3.0 - spectral_radius) / (1.0 + spectral_radius);
        let alpha_f = 1.0 / (1.0 + spectral_radius);
        let gamma = 0.5 + alpha_m - alpha_f;
        let n = self.start.values.len();
        if self.start.memory.algorithmic_rate.len() != n {
            self.know_start_rate()?;
            let memory = &mut self.start.memory;
            memory.algorithmic_rate.clone_from(&memory.rate);
        }
        let known = self.start.values.iter().zip(&self.start.memory.algorithmic_rate);
        for (b, (u, r)) in self.tools.base.iter_mut().zip(known) {
            *b = u + alpha_f * (1.0 - gamma / alpha_m) * step * r;
        }
        let time = self.start.time + alpha_f * step;
        self.solve_stage(time, alpha_f * gamma * step / alpha_m, Guess::Start, 0)?;
        for (u, u0) in self.end.values.iter_mut().zip(&self.start.values) {
            *u = u0 + (*u - u0) / alpha_f;
        }
        self.system.impose(self.span.end, &mut self.end.values);
        let kept = &mut self.end.memory.algorithmic_rate;
        kept.clone_from(&self.start.memory.algorithmic_rate);
        for (r, f) in kept.iter_mut().zip(&self.tools.rates[0]) {
            *r += (f - *r) / alpha_m;
        }
        Ok(Estimate::None)
    }
}
