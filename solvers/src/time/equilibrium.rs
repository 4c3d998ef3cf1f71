//! One increment of a static computation: the equilibrium under the loads at its end, from that at its start.

use super::StepCause;
use super::attempt::{Attempt, Estimate, Tools};
use super::stage::solve;

impl Attempt<'_> {
    /// The equilibrium of an [`EquilibriumSystem`](super::EquilibriumSystem) at the end of the step. A load that is too
    /// much for one increment fails the try, and the step is cut like any other. No embedded estimate.
    pub fn equilibrium(&mut self) -> Result<Estimate, StepCause> {
        let Tools { newton, unknowns, counts, .. } = &mut *self.tools;
        let newton = newton.as_mut().ok_or(StepCause::Capability("and a Newton solver"))?;
        let system = self.system.equilibrium().ok_or(StepCause::Capability("that can be solved without inertia"))?;
        system.begin_equilibrium(self.span.end, &self.start.values, unknowns);
        solve(newton, system, unknowns, counts)?;
        system.finish_equilibrium(unknowns, &mut self.end.values)?;
        Ok(Estimate::None)
    }
}
