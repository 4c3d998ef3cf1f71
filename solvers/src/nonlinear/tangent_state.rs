//! The life of the factor, over iterations, solves and time steps.
//!
//! A stale tangent is cheap as long as it contracts. It is renewed when its policy says so, when the
//! measured contraction `θ = ‖R₊‖ / ‖R‖` shows that it is not worth keeping (E. Hairer and G. Wanner,
//! *Solving Ordinary Differential Equations II*, IV.8), and always before a failure is declared: a
//! failure with stale data refreshes, a failure with fresh data is one (KINSOL's rule).

use super::tangent_policy::{TangentCause, TangentPolicy};
use crate::snapshot::{RestoreError, Snapshot};

/// What the present factor was made from.
#[derive(Debug, Clone, Copy)]
struct Factor {
    unknowns: usize,
    key: Option<u64>,
    /// Time steps begun since it was made.
    steps: usize,
    /// A solve with it has succeeded.
    proven: bool,
}

/// The life of the factor: over iterations, solves and time steps.
#[derive(Debug, Clone)]
pub(super) struct TangentState {
    policy: TangentPolicy,
    factor: Option<Factor>,
    /// Of the problem being solved.
    key: Option<u64>,
    /// The factor belongs to the present iterate.
    fresh: bool,
    /// The factor was made in this solve.
    made_in_solve: bool,
    /// The problem has been linearised in this solve.
    linearised: bool,
    /// Full Newton for the rest of this solve.
    escalated: bool,
    demanded: Option<TangentCause>,
}

impl TangentState {
    pub(super) fn new(policy: TangentPolicy) -> Self {
        Self {
            policy,
            factor: None,
            key: None,
            fresh: false,
            made_in_solve: false,
            linearised: false,
            escalated: false,
            demanded: None,
        }
    }

    pub(super) fn new_step(&mut self) {
        if let Some(factor) = &mut self.factor {
            factor.steps += 1;
        }
    }

    pub(super) fn forget(&mut self) {
        self.factor = None;
    }

    /// The solve failed: a factor made far from any solution is not worth keeping, unless it is that of
    /// a linear problem and works.
    pub(super) fn failed(&mut self, in_linear_solve: bool) {
        if self.key.is_none() || in_linear_solve {
            self.factor = None;
        }
    }

    /// What outlives a solve.
    pub(super) fn save(&self) -> Snapshot {
        let mut saved = Snapshot::new();
        if let Some(Factor { unknowns, key, steps, proven }) = self.factor {
            saved.put_counts("factor", &[unknowns, steps]);
            saved.put_flag("proven", proven);
            saved.put_integers("key", key.into_iter().collect::<Vec<_>>());
        }
        saved
    }

    pub(super) fn restore(&mut self, saved: &Snapshot) -> Result<(), RestoreError> {
        self.factor = None;
        if saved.has("factor") {
            let [unknowns, steps] = saved.counts("factor")?;
            let key = saved.integers("key")?.first().copied();
            self.factor = Some(Factor { unknowns, key, steps, proven: saved.flag("proven")? });
        }
        Ok(())
    }

    pub(super) fn begin_solve(&mut self, unknowns: usize, key: Option<u64>) {
        if self.factor.is_some_and(|factor| factor.unknowns != unknowns || factor.key != key) {
            self.factor = None;
        }
        self.key = key;
        self.fresh = false;
        self.made_in_solve = false;
        self.linearised = false;
        self.escalated = false;
        self.demanded = None;
    }

    /// Why the tangent must be renewed before the next direction, if it must.
    pub(super) fn due(&self) -> Option<TangentCause> {
        let Some(factor) = self.factor else { return Some(TangentCause::First) };
        if self.demanded.is_some() {
            return self.demanded;
        }
        if self.key.is_some() || self.fresh {
            return None;
        }
        if self.escalated {
            return Some(TangentCause::EveryIteration);
        }
        match self.policy {
            TangentPolicy::Full => Some(TangentCause::EveryIteration),
            TangentPolicy::Modified => (factor.steps > 0).then_some(TangentCause::NewStep),
            TangentPolicy::Lagged { steps, .. } | TangentPolicy::QuasiNewton { steps, .. } => {
                (factor.steps >= steps).then_some(TangentCause::Age)
            }
        }
    }

    /// A factor kept from an earlier solve of a linear problem belongs to this problem as well, but
    /// this problem may not have frozen its tangent yet.
    pub(super) fn must_linearise(&self) -> bool {
        self.key.is_some() && !self.linearised
    }

    pub(super) fn linearised(&mut self) {
        self.linearised = true;
    }

    pub(super) fn renewed(&mut self, unknowns: usize) {
        self.factor = Some(Factor { unknowns, key: self.key, steps: 0, proven: false });
        self.fresh = true;
        self.made_in_solve = true;
        self.linearised = true;
        self.demanded = None;
    }

    /// A linear solve succeeded.
    pub(super) fn solved(&mut self) {
        if let Some(factor) = &mut self.factor {
            factor.proven = true;
        }
    }

    /// Whether this is the factor of a linear problem and has solved such a problem before.
    pub(super) fn is_proven(&self) -> bool {
        self.key.is_some() && self.factor.is_some_and(|factor| factor.proven)
    }

    /// Whether a direction from this tangent is poorer than one from a fresh tangent would be.
    pub(super) fn is_stale(&self) -> bool {
        self.key.is_none() && !self.fresh
    }

    /// Whether factoring again could help a linear solve that failed.
    pub(super) fn refactoring_may_help(&self) -> bool {
        self.is_stale() || !self.made_in_solve
    }

    pub(super) fn demand(&mut self, cause: TangentCause) {
        self.demanded = Some(cause);
    }

    /// Demands a fresh tangent now and in every iteration of the rest of this solve. `false` if that
    /// has been done already.
    pub(super) fn escalate(&mut self, cause: TangentCause) -> bool {
        let first = !self.escalated;
        self.escalated = true;
        self.demanded = Some(cause);
        first
    }

    /// A step was accepted that contracted the residual by `contraction`; `remaining` more iterations
    /// are allowed to reduce it by a further factor `reduction`.
    pub(super) fn moved(&mut self, contraction: f64, reduction: f64, remaining: usize) {
        self.fresh = false;
        if self.key.is_some() {
            return;
        }
        let remaining = i32::try_from(remaining).unwrap_or(i32::MAX);
        let (limit, linear) = match self.policy {
            TangentPolicy::Full => return,
            TangentPolicy::Modified => (1.0, true),
            TangentPolicy::Lagged { contraction, .. } => (contraction, true),
            // Secant updates accelerate, so that linear extrapolation would be too pessimistic.
            TangentPolicy::QuasiNewton { contraction, .. } => (contraction, false),
        };
        if contraction > limit || (linear && contraction.powi(remaining) > reduction) {
            self.demanded = Some(TangentCause::SlowContraction);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(policy: TangentPolicy) -> TangentState {
        let mut state = TangentState::new(policy);
        state.begin_solve(3, None);
        assert_eq!(state.due(), Some(TangentCause::First));
        state.renewed(3);
        state
    }

    #[test]
    fn full_renews_after_every_move() {
        let mut state = state(TangentPolicy::Full);
        assert_eq!(state.due(), None);
        state.moved(0.1, 1e-8, 20);
        assert_eq!(state.due(), Some(TangentCause::EveryIteration));
    }

    #[test]
    fn modified_renews_with_the_step() {
        let mut state = state(TangentPolicy::Modified);
        state.moved(0.1, 1e-3, 20);
        state.begin_solve(3, None);
        assert_eq!(state.due(), None);
        assert!(state.is_stale());
        state.new_step();
        assert_eq!(state.due(), Some(TangentCause::NewStep));
        state.begin_solve(4, None);
        assert_eq!(state.due(), Some(TangentCause::First));
    }

    #[test]
    fn lagged_renews_on_contraction_prediction_and_age() {
        let mut state = state(TangentPolicy::Lagged { contraction: 0.3, steps: 2 });
        state.moved(0.1, 1e-6, 10);
        assert_eq!(state.due(), None);
        state.moved(0.31, 1e-6, 100);
        assert_eq!(state.due(), Some(TangentCause::SlowContraction));
        state.renewed(3);
        state.moved(0.2, 1e-6, 3);
        assert_eq!(state.due(), Some(TangentCause::SlowContraction));
        state.renewed(3);
        state.moved(0.2, 1e-6, 30);
        state.new_step();
        assert_eq!(state.due(), None);
        state.new_step();
        assert_eq!(state.due(), Some(TangentCause::Age));
    }

    #[test]
    fn a_constant_key_outlives_steps_but_not_another_key() {
        let mut state = TangentState::new(TangentPolicy::Full);
        state.begin_solve(3, Some(7));
        state.renewed(3);
        for _ in 0..5 {
            state.new_step();
            state.moved(1e-12, 1.0, 1);
            state.begin_solve(3, Some(7));
            assert_eq!(state.due(), None);
            assert!(state.must_linearise() && !state.is_stale());
        }
        state.begin_solve(3, Some(8));
        assert_eq!(state.due(), Some(TangentCause::First));
        state.renewed(3);
        state.begin_solve(3, None);
        assert_eq!(state.due(), Some(TangentCause::First));
    }
}
