//! What a stepper and a state remember from step to step, for checkpoints.

use super::stage::as_problem;
use super::{ControlMemory, Memory, Rejections, Statistics, Stepper, System, TimeState};
use crate::nonlinear::NonlinearProblem;
use crate::snapshot::{RestoreError, Snapshot};

impl TimeState {
    /// Time, values and memory.
    pub fn save(&self) -> Snapshot {
        let mut saved = Snapshot::new();
        saved.put_real("time", self.time);
        saved.put_reals("values", &self.values[..]);
        saved.put_part("memory", self.memory.save());
        saved
    }

    /// The state that was saved.
    ///
    /// # Errors
    /// [`RestoreError`] if it is not one.
    pub fn restored(saved: &Snapshot) -> Result<Self, RestoreError> {
        Ok(Self {
            time: saved.real("time")?,
            values: saved.reals("values")?.to_vec(),
            memory: Memory::restored(&saved.part("memory"))?,
        })
    }
}

impl Memory {
    fn save(&self) -> Snapshot {
        let Self {
            rate,
            previous_rate,
            previous_step,
            algorithmic_rate,
            velocity_rate,
            dominant_direction,
            spectral_radius,
            dominant_damping,
            steps_since_estimate,
            time_remainder,
            control: ControlMemory { scale, step, error, cheap_steps },
            fingerprint,
        } = self;
        let mut saved = Snapshot::new();
        saved.put_reals("rate", &rate[..]);
        saved.put_reals("previous_rate", &previous_rate[..]);
        saved.put_real("previous_step", *previous_step);
        saved.put_reals("algorithmic_rate", &algorithmic_rate[..]);
        saved.put_reals("velocity_rate", &velocity_rate[..]);
        saved.put_reals("dominant_direction", &dominant_direction[..]);
        saved.put_reals("dominant", [*spectral_radius, *dominant_damping]);
        saved.put_counts("steps_since_estimate", &[*steps_since_estimate]);
        saved.put_real("time_remainder", *time_remainder);
        saved.put_reals("control", [*scale, *step, *error]);
        saved.put_counts("cheap_steps", &[*cheap_steps]);
        saved.put_integers("fingerprint", vec![*fingerprint]);
        saved
    }

    fn restored(saved: &Snapshot) -> Result<Self, RestoreError> {
        let [spectral_radius, dominant_damping] = saved.some_reals("dominant")?;
        let [scale, step, error] = saved.some_reals("control")?;
        Ok(Self {
            rate: saved.reals("rate")?.to_vec(),
            previous_rate: saved.reals("previous_rate")?.to_vec(),
            previous_step: saved.real("previous_step")?,
            algorithmic_rate: saved.reals("algorithmic_rate")?.to_vec(),
            velocity_rate: saved.reals("velocity_rate")?.to_vec(),
            dominant_direction: saved.reals("dominant_direction")?.to_vec(),
            spectral_radius,
            dominant_damping,
            steps_since_estimate: saved.count("steps_since_estimate")?,
            time_remainder: saved.real("time_remainder")?,
            control: ControlMemory { scale, step, error, cheap_steps: saved.count("cheap_steps")? },
            fingerprint: saved.integers("fingerprint")?.first().copied().unwrap_or_default(),
        })
    }
}

impl Statistics {
    fn save(&self) -> Snapshot {
        let Self {
            accepted,
            rejected: Rejections { evaluation, newton, not_finite, error, stages },
            failed,
            rate_evaluations,
            partial_evaluations,
            newton_iterations,
            smallest_step,
            largest_step,
        } = *self;
        let mut saved = Snapshot::new();
        saved.put_counts("steps", &[accepted, failed, rate_evaluations, partial_evaluations, newton_iterations]);
        saved.put_counts("rejected", &[evaluation, newton, not_finite, error, stages]);
        saved.put_reals("step", [smallest_step, largest_step]);
        saved
    }

    fn restored(saved: &Snapshot) -> Result<Self, RestoreError> {
        let [accepted, failed, rate_evaluations, partial_evaluations, newton_iterations] = saved.counts("steps")?;
        let [evaluation, newton, not_finite, error, stages] = saved.counts("rejected")?;
        let [smallest_step, largest_step] = saved.some_reals("step")?;
        Ok(Self {
            accepted,
            rejected: Rejections { evaluation, newton, not_finite, error, stages },
            failed,
            rate_evaluations,
            partial_evaluations,
            newton_iterations,
            smallest_step,
            largest_step,
        })
    }
}

impl Stepper {
    /// What it remembers, `system` being the one it integrates.
    pub fn save(&self, system: &mut dyn System) -> Snapshot {
        let mut saved = Snapshot::new();
        saved.put_part("statistics", self.statistics().save());
        if let (Some(newton), Some(problem)) = (self.newton(), problem(system)) {
            saved.put_part("newton", newton.save(problem));
        }
        saved
    }

    /// Makes a new stepper of the same scheme, control and options what that one was: the next step has the same bits.
    ///
    /// # Errors
    /// [`RestoreError`] if the snapshot is of another kind of stepper or system.
    pub fn restore(&mut self, system: &mut dyn System, saved: &Snapshot) -> Result<(), RestoreError> {
        self.restore_statistics(saved)?;
        if let (Some(newton), Some(problem)) = (self.newton_mut(), problem(system)) {
            newton.restore(problem, &saved.part("newton"))?;
        }
        Ok(())
    }

    /// Takes back the work so far and nothing else, for a stepper of another kind.
    ///
    /// # Errors
    /// As [`restore`](Self::restore).
    pub fn restore_statistics(&mut self, saved: &Snapshot) -> Result<(), RestoreError> {
        *self.statistics_mut() = Statistics::restored(&saved.part("statistics"))?;
        Ok(())
    }
}

/// The system as the problem that Newton's method solves.
fn problem(system: &mut dyn System) -> Option<&mut dyn NonlinearProblem> {
    if system.stages().is_some() {
        return system.stages().map(as_problem);
    }
    let system = system.equilibrium()?;
    Some(system)
}
