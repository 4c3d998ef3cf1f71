//! When to stop.
//!
//! Only a residual can converge: `‖R‖ ≤ max(ε_r min(‖R₀‖, S), ε_s S)` with the scale `S` of the summands of
//! `R`. The relative test alone would never end when the start is already exact, an absolute one
//! stalls at round-off. Where the first residual is larger than the summands of the present one, the start
//! was far astray (next to a singularity, say) and is no measure of anything. A small step is no convergence; together with a residual small against `S` it
//! only tells that double precision can do no better.

use super::options::NewtonOptions;
use super::sample::Sample;

/// Why a solve has converged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Convergence {
    /// `‖R‖ ≤ relative_tolerance × min(‖R₀‖, scale)`.
    Relative,
    /// `‖R‖ ≤ scale_tolerance × scale`.
    Scale,
    /// The residual is at the rounding noise of its summands and falls no further, or it is small
    /// against them and the correction is too small to change `y`.
    PrecisionLimit,
}

impl Convergence {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Relative => "relative",
            Self::Scale => "scale",
            Self::PrecisionLimit => "precision limit",
        }
    }
}

/// Why a solve will not converge with the tangents it has had.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Trouble {
    Stagnation { iterations: usize },
    Divergence { growth: f64 },
}

/// A residual below this many units of rounding of its summands is noise.
const NOISE: f64 = 100.0 * f64::EPSILON;
/// A step below this many units of rounding of `y` changes nothing.
const SMALLEST_STEP: f64 = 4.0 * f64::EPSILON;
/// The residual must have fallen by this factor within the stagnation window.
const PROGRESS: f64 = 0.99;

/// The tests of one solve.
#[derive(Debug, Clone)]
pub(super) struct Criteria {
    relative_tolerance: f64,
    scale_tolerance: f64,
    divergence: f64,
    window: usize,
    first: f64,
    /// Smallest norm so far, as far as it counts as progress.
    best: f64,
    iterations_without_progress: usize,
}

impl Criteria {
    pub(super) fn new(options: &NewtonOptions, start: Sample) -> Self {
        Self {
            relative_tolerance: options.relative_tolerance,
            scale_tolerance: options.scale_tolerance,
            divergence: options.divergence,
            window: options.stagnation,
            first: start.norm,
            best: start.norm,
            iterations_without_progress: 0,
        }
    }

    pub(super) fn first(&self) -> f64 {
        self.first
    }

    /// The norm to reach.
    pub(super) fn target(&self, here: Sample) -> f64 {
        (self.relative_tolerance * self.reference(here)).max(self.scale_tolerance * here.scale)
    }

    /// The first residual, but no more than the summands of the present one (if their size is known).
    fn reference(&self, here: Sample) -> f64 {
        if here.scale > 0.0 { self.first.min(here.scale) } else { self.first }
    }

    pub(super) fn converged(&self, here: Sample) -> Option<Convergence> {
        if here.norm <= self.scale_tolerance * here.scale {
            Some(Convergence::Scale)
        } else if here.norm <= self.relative_tolerance * self.reference(here) {
            Some(Convergence::Relative)
        } else {
            None
        }
    }

    /// Whether nothing but rounding is left of a residual that a step did not reduce.
    pub(super) fn is_noise(&self, here: Sample) -> bool {
        here.norm <= NOISE * here.scale
    }

    /// Whether a step of norm `step` can still change a `y` of norm `size`.
    pub(super) fn step_vanishes(&self, step: f64, size: f64) -> bool {
        step <= SMALLEST_STEP * size
    }

    /// Whether a residual that no representable step can reduce counts as converged.
    pub(super) fn is_small(&self, here: Sample) -> bool {
        here.norm <= f64::EPSILON.sqrt() * here.scale
    }

    /// Judges the point that the last step led to.
    pub(super) fn judge(&mut self, here: Sample) -> Option<Trouble> {
        let growth = here.norm / self.first;
        if growth > self.divergence {
            return Some(Trouble::Divergence { growth });
        }
        if here.norm <= PROGRESS * self.best {
            self.best = here.norm;
            self.iterations_without_progress = 0;
            return None;
        }
        self.iterations_without_progress += 1;
        (self.iterations_without_progress >= self.window)
            .then_some(Trouble::Stagnation { iterations: self.iterations_without_progress })
    }

    /// A fresh tangent deserves a full window.
    pub(super) fn give_another_chance(&mut self) {
        self.iterations_without_progress = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(norm: f64, scale: f64) -> Sample {
        Sample { norm, scale, potential: None }
    }

    #[test]
    fn both_tests_and_neither() {
        let criteria = Criteria::new(&NewtonOptions::default(), at(2.0, 10.0));
        assert_eq!(criteria.converged(at(2e-8, 10.0)), Some(Convergence::Relative));
        assert_eq!(criteria.converged(at(1e-11, 10.0)), Some(Convergence::Scale));
        assert_eq!(criteria.converged(at(3e-8, 10.0)), None);
        assert_eq!(criteria.converged(at(f64::NAN, 10.0)), None);
        assert_eq!(criteria.target(at(1.0, 1e5)), 1e-7);
    }

    #[test]
    fn a_start_far_astray_does_not_loosen_the_test() {
        let criteria = Criteria::new(&NewtonOptions::default(), at(1e9, 1e9));
        assert_eq!(criteria.converged(at(1.0, 10.0)), None);
        assert_eq!(criteria.converged(at(1e-7, 10.0)), Some(Convergence::Relative));
        // Without a scale there is only the first residual.
        assert_eq!(criteria.converged(at(1.0, 0.0)), Some(Convergence::Relative));
    }

    #[test]
    fn stagnation_needs_a_whole_window_without_progress() {
        let options = NewtonOptions { stagnation: 3, ..Default::default() };
        let mut criteria = Criteria::new(&options, at(1.0, 1.0));
        assert_eq!(criteria.judge(at(5.0, 1.0)), None);
        assert_eq!(criteria.judge(at(0.999, 1.0)), None);
        assert_eq!(criteria.judge(at(0.5, 1.0)), None);
        assert_eq!(criteria.judge(at(0.499, 1.0)), None);
        assert_eq!(criteria.judge(at(0.498, 1.0)), None);
        assert_eq!(criteria.judge(at(0.497, 1.0)), Some(Trouble::Stagnation { iterations: 3 }));
    }

    #[test]
    fn divergence_is_relative_to_the_start() {
        let options = NewtonOptions { divergence: 1e3, ..Default::default() };
        let mut criteria = Criteria::new(&options, at(2.0, 1.0));
        assert_eq!(criteria.judge(at(1999.0, 1.0)), None);
        assert_eq!(criteria.judge(at(4000.0, 1.0)), Some(Trouble::Divergence { growth: 2000.0 }));
    }
}
