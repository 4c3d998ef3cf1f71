//! One step of Runge–Kutta–Chebyshev.

use super::super::RatePart;
use super::super::StepCause;
use super::super::attempt::{Attempt, Estimate, Tools, evaluate};
use super::{RkcOptions, RkcStages, rkc_stages, rkc_stages_by_courant};

impl Attempt<'_> {
    /// One step. Error `⅘ (u₀ − u₁) + ⅖ Δt (F₀ + F₁)` (Sommeijer, Shampine & Verwer 1998); the rate `F₁` serves
    /// the next step.
    pub fn rkc(&mut self, options: RkcOptions) -> Result<Estimate, StepCause> {
        let step = self.span.step;
        let stages = match options.stages {
            RkcStages::Fixed(stages) => stages,
            RkcStages::Courant { frequency } => rkc_stages_by_courant(frequency * step),
            RkcStages::SpectralRadius { safety, refresh } => rkc_stages(step * safety * self.spectral_radius(refresh)?),
        };
        if stages > options.largest {
            return Err(StepCause::StageLimit { needed: stages, limit: options.largest });
        }
        self.know_start_rate()?;
        self.tools.chebyshev.set(stages);
        self.chebyshev_stages(stages)?;
        if !self.wants_estimate {
            return Ok(Estimate::None);
        }
        self.know_end_rate()?;
        let rates = self.start.memory.rate.iter().zip(&self.end.memory.rate);
        let values = self.start.values.iter().zip(&self.end.values);
        for ((e, (f0, f1)), (u0, u1)) in self.tools.estimate.iter_mut().zip(rates).zip(values) {
            *e = 0.8 * (u0 - u1) + 0.4 * step * (f0 + f1);
        }
        self.impose_on_estimate();
        Ok(Estimate::Embedded { power: 3.0 })
    }

    /// The recursion; `end.values` is always the last stage. Five vectors, whatever the number of stages.
    fn chebyshev_stages(&mut self, stages: usize) -> Result<(), StepCause> {
        let (start, step) = (self.start.time, self.span.step);
        let Tools { rates: [rate, ..], stages: [older, ..], chebyshev, counts, .. } = &mut *self.tools;
        let (u0, f0) = (&self.start.values, &self.start.memory.rate);
        let now = &mut self.end.values;
        older.copy_from_slice(u0);
        for ((y, u), f) in now.iter_mut().zip(u0).zip(f0) {
            *y = u + chebyshev.mu_rate[1] * step * f;
        }
        self.system.impose(start + chebyshev.c[1] * step, now);
        for k in 2..=stages {
            evaluate(self.system, counts, RatePart::All, start + chebyshev.c[k - 1] * step, now, rate)?;
            let (mu, nu) = (chebyshev.mu[k], chebyshev.nu[k]);
            let (new, old) = (chebyshev.mu_rate[k] * step, chebyshev.gamma_rate[k] * step);
            for (i, older) in older.iter_mut().enumerate() {
                // Written on differences from u₀: the weights add up to one exactly.
                let (y, z) = (now[i] - u0[i], *older - u0[i]);
                *older = u0[i] + (mu * y + nu * z + new * rate[i] + old * f0[i]);
            }
            std::mem::swap(older, now);
            let time = if k == stages { self.span.end } else { start + chebyshev.c[k] * step };
            self.system.impose(time, now);
        }
        Ok(())
    }
}
