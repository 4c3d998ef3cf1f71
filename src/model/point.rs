//! Where the equations were linearised, as plain numbers: for a restart, which makes the same tangent again.
//!
//! A tangent is a function of the stage and of the unknowns in it, so that these are all there is to keep; it is far less
//! than the derivatives of every particle, or a factor.

use nicolson_solvers::snapshot::unfit;
use nicolson_solvers::{RestoreError, Snapshot};

use super::Model;
use super::conserving::StepStart;

impl<const D: usize> Model<D> {
    /// Keeps in mind where the equations are linearised, from now on.
    pub fn keep_linearisation_points(&mut self) {
        self.keeps_points = true;
    }

    /// The point that was evaluated last.
    pub(super) fn point(&self) -> Snapshot {
        let stage = &self.stage;
        let mut point = Snapshot::new();
        point.put_flag("at_rest", stage.at_rest);
        point.put_reals("stage", [stage.time, stage.shift]);
        point.put_reals("base", &stage.base[..]);
        point.put_reals("unknowns", &stage.evaluated[..]);
        point.put_reals("start", stage.start.iter().flat_map(StepStart::numbers).collect::<Vec<_>>());
        point
    }

    /// Linearises where a [`point`](Self::point) says.
    pub(super) fn linearise_at(&mut self, point: &Snapshot) -> Result<(), RestoreError> {
        let n = self.particles();
        let start = point.reals("start")?;
        let width = StepStart::<D>::NUMBERS;
        if start.len() != n * width && !start.is_empty() {
            return Err(unfit("start", "one configuration per particle"));
        }
        let [time, shift] = point.some_reals("stage")?;
        self.stage.at_rest = point.flag("at_rest")?;
        (self.stage.time, self.stage.shift) = (time, shift);
        self.stage.base = point.reals_of("base", n * (2 * D + 1))?.to_vec();
        self.stage.start = start.chunks_exact(width).map(StepStart::from_numbers).collect();
        self.stage.evaluated.clear();
        let unknowns = point.reals_of("unknowns", self.unknown_count())?;
        self.evaluate_stage(unknowns)?;
        self.freeze();
        Ok(())
    }
}
