//! What an iteration without a factor is preconditioned with: block Jacobi, or multigrid.
//!
//! Multigrid has a set-up, costs a little more per iteration, and takes about as many iterations for any step. Block Jacobi
//! takes more the longer the step is. So block Jacobi goes first, until what it has taken beyond multigrid's iterations has
//! cost as much as the set-up (the rule for renting skis, once more); an equilibrium has the longest step of all, and takes
//! multigrid at once. Multigrid that then takes longer than block Jacobi did (laws that do not resist shear) is given up.
//!
//! Counted in iterations with block Jacobi, so that rates of operators cancel. Measured with `benches/matrix_free.rs`
//! (`iterations 3 10000 100000`, no stabilisation, from 1 to 1000 critical steps).

/// Price of multigrid's set-up: the coarse matrices and their factor, 12 products for the smoother.
const SETUP: f64 = 40.0;
/// Iterations with multigrid per digit of the solution: 18 to 1e-3, 46 to 1e-8.
const PER_DIGIT: f64 = 6.0;
/// Price of an iteration with multigrid.
const WEIGHT: f64 = 1.2;
/// Equilibria may be worse conditioned than the longest step, by this factor.
const MARGIN: f64 = 3.0;

/// The choice, and what it was learnt from. Plain numbers: they can be saved and restored.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in super::super) struct Iterating {
    /// Whether multigrid may be taken: its operator has places, and it was not given up.
    possible: bool,
    /// Whether multigrid is taken.
    multigrid: bool,
    /// Iterations that block Jacobi has taken, in all solves, beyond what those with multigrid would have cost.
    surplus: f64,
    /// Iterations per digit with block Jacobi in the last solve; 0 before there was one.
    pace: f64,
}

fn digits(tolerance: f64) -> f64 {
    (-tolerance.log10()).max(0.5)
}

/// Price of a solve with multigrid.
pub(super) fn multigrid_solve(tolerance: f64) -> f64 {
    WEIGHT * PER_DIGIT * digits(tolerance)
}

impl Iterating {
    /// Block Jacobi; `possible` says whether multigrid may follow.
    pub(super) fn new(possible: bool) -> Self {
        Self { possible, ..Self::default() }
    }

    /// For checkpoints.
    pub(super) fn to_numbers(self) -> [f64; 4] {
        let flag = |flag: bool| f64::from(u8::from(flag));
        [flag(self.possible), flag(self.multigrid), self.surplus, self.pace]
    }

    pub(super) fn from_numbers([possible, multigrid, surplus, pace]: [f64; 4]) -> Self {
        Self { possible: possible != 0.0, multigrid: multigrid != 0.0, surplus, pace }
    }

    pub(super) fn is_multigrid(&self) -> bool {
        self.multigrid
    }

    /// Whether an equilibrium is better iterated than factored, where a factor costs so many iterations.
    pub(super) fn suits_equilibria(&self, factor: f64) -> bool {
        self.possible && factor > MARGIN * (SETUP + multigrid_solve(1e-8))
    }

    /// Price of one iteration with the present preconditioner.
    pub(super) fn weight(&self) -> f64 {
        if self.multigrid { WEIGHT } else { 1.0 }
    }

    /// Iterations with block Jacobi before multigrid is worth its set-up; `None` where it is not, or a factor costs less.
    pub(super) fn before_multigrid(&self, tolerance: f64, factor: f64) -> Option<f64> {
        let solve = multigrid_solve(tolerance);
        let worth = self.possible && !self.multigrid && factor > SETUP + solve;
        worth.then(|| solve + (SETUP - self.surplus).max(0.0))
    }

    /// Multigrid from now on. Returns the price of its set-up.
    pub(super) fn take_multigrid(&mut self) -> f64 {
        self.multigrid = self.possible;
        SETUP
    }

    /// Block Jacobi from now on.
    pub(super) fn give_up_multigrid(&mut self) {
        (self.possible, self.multigrid) = (false, false);
    }

    /// Whether block Jacobi has been tried before multigrid.
    pub(super) fn knows_block_jacobi(&self) -> bool {
        self.pace > 0.0
    }

    /// Takes note of a solve to `reached`. Returns whether multigrid has lost against block Jacobi.
    pub(super) fn learn(&mut self, iterations: usize, reached: f64) -> bool {
        let iterations = iterations as f64;
        if self.multigrid {
            return self.pace > 0.0 && iterations * WEIGHT > self.pace * digits(reached);
        }
        self.pace = iterations / digits(reached);
        self.surplus += (iterations - multigrid_solve(reached)).max(0.0);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Iterations of `benches/matrix_free.rs` to 1e-3 at 1, 5, 20 and 100 critical steps.
    #[test]
    fn longer_steps_turn_to_multigrid_and_short_ones_never_do() {
        let turns = |iterations: usize| {
            let mut state = Iterating::new(true);
            (0..1000).position(|_| {
                let left = state.before_multigrid(1e-3, 1e9).expect("worth it");
                state.learn(iterations, 1e-3);
                iterations as f64 > left
            })
        };
        assert_eq!([4, 16].map(turns), [None, None]);
        assert!(turns(44).is_some_and(|solves| (1..10).contains(&solves)), "{:?}", turns(44));
        assert_eq!(turns(200), Some(0));
    }

    #[test]
    fn a_cheap_factor_leaves_no_room_for_multigrid() {
        let mut state = Iterating::new(true);
        assert_eq!(state.before_multigrid(1e-3, 50.0), None);
        assert!(!state.suits_equilibria(50.0) && state.suits_equilibria(1e4));
        assert_eq!(Iterating::new(false).before_multigrid(1e-3, 1e4), None);
        state.learn(10, 1e-3);
        state.take_multigrid();
        assert!(!state.learn(8, 1e-3) && state.learn(9, 1e-3), "dearer than block Jacobi");
    }
}
