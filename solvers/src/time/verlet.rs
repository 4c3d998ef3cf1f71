//! Velocity Verlet for a state split into velocities `v` and other entries `q`, with `v′ = a(t, q, v)` and
//! `q′ = g(t, q, v)`:
//!
//! ```text
//! v_½ = v₀ + Δt/2 a₀
//! q_½ = q₀ + Δt/2 g(t₀, q₀, v_½)
//! q₁  = q₀ + Δt g(t₀ + Δt/2, q_½, v_½)
//! a₁  = a(t₁, q₁, v_½ + Δt/2 a₀)
//! v₁  = v_½ + Δt/2 a₁
//! ```
//!
//! For `g = v` and `a = a(q)` this is the scheme of Swope et al. (*J. Chem. Phys.* 76 (1982) 637), symplectic,
//! one evaluation of the forces a step, because `a₁` is kept as the `a₀` of the next step. Where `a` depends on
//! the velocity, the argument `v_½ + Δt/2 a₀` differs from `v₁` by `Δt/2 (a₁ − a₀) = O(Δt²)`: keeping `a₁`
//! then costs no order (evaluating at `v_½`, as is often done, would leave first order). Damping makes
//! the kept value lag: pure damping `a = −c v` is stable for `cΔt < 1`, half the limit of Heun's method.

use super::attempt::{Attempt, Estimate, Tools, evaluate};
use super::{RatePart, StepCause};

impl Attempt<'_> {
    /// One step; no embedded estimate.
    pub fn velocity_verlet(&mut self) -> Result<Estimate, StepCause> {
        let n = self.start.values.len();
        let Some(velocities) = self.system.velocities().filter(|range| range.start <= range.end && range.end <= n)
        else {
            return Err(StepCause::Capability("of second order in time, with a range of velocities"));
        };
        self.know_velocity_rate()?;
        let (start, half) = (self.start.time, 0.5 * self.span.step);
        let middle = start + half;
        let kick = |u: &mut [f64], a: &[f64]| {
            for (u, a) in u[velocities.clone()].iter_mut().zip(&a[velocities.clone()]) {
                *u += half * a;
            }
        };

        // Velocities to the middle of the step: (q₀, v_½).
        kick(&mut self.end.values, &self.start.memory.velocity_rate);
        self.system.impose(middle, &mut self.end.values);
        // Prescribed entries other than velocities must be those of the time at which g is evaluated.
        let Tools { rates: [rate, ..], stages: [stage, ..], counts, .. } = &mut *self.tools;
        stage.copy_from_slice(&self.start.values);
        stage[velocities.clone()].copy_from_slice(&self.end.values[velocities.clone()]);
        evaluate(self.system, counts, RatePart::Others, start, stage, rate)?;
        let others = || (0..velocities.start).chain(velocities.end..n);
        for i in others() {
            stage[i] = self.start.values[i] + half * rate[i];
        }
        self.system.impose(middle, stage);
        evaluate(self.system, counts, RatePart::Others, middle, stage, rate)?;
        let end = &mut self.end.values;
        for i in others() {
            end[i] = self.start.values[i] + self.span.step * rate[i];
        }

        // The rate of the velocities where the new configuration is, at the velocities predicted there.
        stage.copy_from_slice(end);
        kick(stage, &self.start.memory.velocity_rate);
        self.system.impose(self.span.end, stage);
        let kept = &mut self.end.memory.velocity_rate;
        kept.resize(n, 0.0);
        evaluate(self.system, counts, RatePart::Velocities, self.span.end, stage, kept)?;
        kick(end, kept);
        self.system.impose(self.span.end, end);
        Ok(Estimate::None)
    }

    fn know_velocity_rate(&mut self) -> Result<(), StepCause> {
        let n = self.start.values.len();
        let memory = &mut self.start.memory;
        if memory.velocity_rate.len() == n {
            return Ok(());
        }
        if memory.rate.len() == n {
            memory.velocity_rate.clone_from(&memory.rate);
            return Ok(());
        }
        memory.velocity_rate.resize(n, 0.0);
        let (counts, rate) = (&mut self.tools.counts, &mut memory.velocity_rate);
        let done = evaluate(self.system, counts, RatePart::Velocities, self.start.time, &self.start.values, rate);
        if done.is_err() {
            memory.velocity_rate.clear();
        }
        done
    }
}
