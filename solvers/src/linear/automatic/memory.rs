//! What the automatic solver remembers from operator to operator, for checkpoints.

use super::super::effort::Costs;
use super::super::{LinearCounts, LinearError, LinearSolver, OperatorAge, Symmetry, Tangent};
use super::iterating::Iterating;
use super::{Automatic, Path};
use crate::snapshot::{RestoreError, Snapshot, unfit};

const PATHS: [Path; 4] = [Path::Undecided, Path::Iterate, Path::Factor, Path::Lu];
const SYMMETRIES: [Symmetry; 3] = [Symmetry::PositiveDefinite, Symmetry::Symmetric, Symmetry::General];

fn place<T: PartialEq>(list: &[T], item: &T) -> usize {
    list.iter().position(|other| other == item).unwrap_or(0)
}

impl Costs {
    fn to_numbers(self) -> [f64; 6] {
        let Self { preparation, solve, action, iteration, general, bytes } = self;
        [preparation, solve, action, iteration, general, bytes]
    }

    fn from_numbers([preparation, solve, action, iteration, general, bytes]: [f64; 6]) -> Self {
        Self { preparation, solve, action, iteration, general, bytes }
    }
}

impl Automatic {
    /// Whether a factor is older than the operator.
    pub(super) fn has_older_operator(&self) -> bool {
        match self.path {
            Path::Factor => self.has_factor && self.stale,
            Path::Iterate => self.krylov.as_ref().is_some_and(LinearSolver::keeps_older_operator),
            Path::Undecided | Path::Lu => false,
        }
    }

    pub(super) fn saved(&self) -> Snapshot {
        let mut saved = self.counts.save();
        saved.put_counts("path", &[place(&PATHS, &self.path)]);
        saved.put_text("reason", self.reason.clone());
        if let Some((size, symmetry)) = self.chosen_for {
            saved.put_counts("chosen_for", &[size, place(&SYMMETRIES, &symmetry)]);
        }
        if let Some(costs) = self.costs {
            saved.put_reals("costs", costs.to_numbers());
        }
        saved.put_real("excess", self.excess);
        saved.put_reals("iterating", self.iterating.to_numbers());
        saved.put_flag("stale", self.stale);
        saved.put_flag("has_factor", self.has_factor);
        saved.put_flag("worn", self.worn);
        saved.put_counts("pause", &[self.pause, self.last_pause, self.kept]);
        saved.put_part("factor", self.factor.save());
        if let Some(krylov) = &self.krylov {
            saved.put_part("krylov", krylov.save());
        }
        if let Some(lu) = &self.lu {
            saved.put_part("lu", lu.save());
        }
        saved
    }

    pub(super) fn take_back(
        &mut self,
        saved: &Snapshot,
        tangent: &dyn Tangent,
        age: OperatorAge,
    ) -> Result<(), RestoreError> {
        let path = saved.count("path")?;
        self.path = *PATHS.get(path).ok_or_else(|| unfit("path", "one of the paths"))?;
        self.has_factor = saved.flag("has_factor")?;
        self.stale = saved.flag("stale")?;
        // First of all: it says what the iteration is preconditioned with.
        self.iterating = Iterating::from_numbers(saved.some_reals("iterating")?);
        let parts = [saved.part("krylov"), saved.part("lu")];
        match self.path {
            Path::Iterate => self.krylov(tangent).restore(&parts[0], tangent, age)?,
            Path::Lu if age == OperatorAge::Last => self.lu().restore(&parts[1], tangent, age)?,
            Path::Factor if self.has_factor && self.stale == (age == OperatorAge::Older) => {
                self.take_factor_back(&saved.part("factor"), tangent)?;
            }
            _ => {}
        }
        if age == OperatorAge::Older {
            return Ok(());
        }
        // Those that do not take part at present count, too.
        self.factor.set_counts(LinearCounts::restored(&saved.part("factor"))?);
        if self.path != Path::Iterate && !parts[0].is_empty() {
            self.krylov(tangent).set_counts(LinearCounts::restored(&parts[0])?);
        }
        if self.path != Path::Lu && !parts[1].is_empty() {
            self.lu().set_counts(LinearCounts::restored(&parts[1])?);
        }
        self.counts = LinearCounts::restored(saved)?;
        self.reason = saved.text("reason")?.to_owned();
        self.chosen_for = None;
        if saved.has("chosen_for") {
            let [size, symmetry] = saved.counts("chosen_for")?;
            let symmetry = SYMMETRIES.get(symmetry).ok_or_else(|| unfit("chosen_for", "a size and a symmetry"))?;
            self.chosen_for = Some((size, *symmetry));
        }
        self.costs = if saved.has("costs") { Some(Costs::from_numbers(saved.some_reals("costs")?)) } else { None };
        self.excess = saved.real("excess")?;
        self.worn = saved.flag("worn")?;
        [self.pause, self.last_pause, self.kept] = saved.counts("pause")?;
        Ok(())
    }

    fn take_factor_back(&mut self, saved: &Snapshot, tangent: &dyn Tangent) -> Result<(), RestoreError> {
        if !saved.flag("ready")? {
            return Err(LinearError::NotPrepared.into());
        }
        if tangent.symmetry() == Symmetry::General {
            let part = self.symmetric_part.of(tangent)?;
            self.factor.restore(saved, &part, OperatorAge::Last)
        } else {
            self.factor.restore(saved, tangent, OperatorAge::Last)
        }
    }
}
