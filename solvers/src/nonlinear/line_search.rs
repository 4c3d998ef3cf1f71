//! Line searches: how far to go along a direction.
//!
//! The algorithms are argmin's; they see a function of one number. What they cannot do is done around
//! them: a trial outside the domain means "too long" (backtracking takes it as an infinite value, the
//! Wolfe searches are first given an interval in which everything is finite), the number of trials is
//! bounded, and whatever they return is only believed if it decreases the merit sufficiently —
//! otherwise the lowest trial that does, and failing that plain backtracking.
//!
//! J. E. Dennis and R. B. Schnabel, *Numerical Methods for Unconstrained Optimization and Nonlinear
//! Equations* (1983); J. J. Moré and D. J. Thuente, ACM TOMS 20 (1994) 286; W. W. Hager and H. Zhang,
//! SIAM J. Optim. 16 (2005) 170.

use std::cell::RefCell;
use std::collections::HashMap;

use argmin::core::{CostFunction, Error, Gradient, IterState, LineSearch, Problem, Solver, State, TerminationStatus};
use argmin::solver::linesearch::condition::ArmijoCondition;
use argmin::solver::linesearch::{BacktrackingLineSearch, HagerZhangLineSearch, MoreThuenteLineSearch};

use super::options::Globalisation;
use super::ray::{Ray, RayError, SUFFICIENT_DECREASE, Trial};
use crate::EvaluationError;

/// Curvature condition `|φ'(α)| ≤ c |φ'(0)|` of the Wolfe searches. Loose: Newton's own step is good.
const CURVATURE: f64 = 0.9;
/// Contraction of a step that left the domain.
const HALF: f64 = 0.5;
/// Shortest relative step worth trying.
const SHORTEST: f64 = 1e-12;

/// Why no step was found.
#[derive(Debug, Clone)]
pub(super) enum Blocked {
    Domain(EvaluationError),
    NoDecrease {
        trials: usize,
        smallest: f64,
    },
    /// The trust region needs a product that the tangent does not offer.
    NeedsTransposed,
}

type SearchState = IterState<f64, f64, (), (), (), f64>;

/// The ray as argmin wants to see it.
struct OnRay<'r, 'a> {
    ray: &'r RefCell<&'r mut Ray<'a>>,
    /// Report points outside the domain as infinite instead of ending the search.
    infinite_outside: bool,
}

fn interrupt(error: RayError) -> Error {
    match error {
        RayError::Evaluation(error) => error.into(),
        RayError::Exhausted => Error::msg("all trials are spent"),
    }
}

impl CostFunction for OnRay<'_, '_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, alpha: &f64) -> Result<f64, Error> {
        match self.ray.borrow_mut().at(*alpha) {
            Ok(trial) => Ok(trial.value),
            Err(RayError::Evaluation(_)) if self.infinite_outside => Ok(f64::INFINITY),
            Err(error) => Err(interrupt(error)),
        }
    }
}

impl Gradient for OnRay<'_, '_> {
    type Param = f64;
    type Gradient = f64;

    fn gradient(&self, alpha: &f64) -> Result<f64, Error> {
        self.ray.borrow_mut().slope(*alpha).map_err(interrupt)
    }
}

/// Chooses step lengths. Keeps argmin's table of counts, so that a search allocates nothing.
#[derive(Debug, Default)]
pub(super) struct LineSearcher {
    counts: HashMap<&'static str, u64>,
}

impl LineSearcher {
    /// Finds a step length and leaves the ray's buffers there; says whether the problem's own last
    /// evaluation was there as well.
    pub(super) fn search(&mut self, method: Globalisation, ray: &mut Ray<'_>) -> Result<(Trial, bool), Blocked> {
        let found = match method {
            Globalisation::Backtracking => self.backtrack(ray, 1.0),
            Globalisation::MoreThuente | Globalisation::HagerZhang => {
                let longest = admissible(ray)?;
                let found = if ray.is_clearly_good(longest) {
                    Some(longest.alpha)
                } else if method == Globalisation::MoreThuente {
                    self.more_thuente(ray, longest.alpha)
                } else {
                    self.hager_zhang(ray, longest.alpha)
                };
                found.or_else(|| self.backtrack(ray, longest.alpha))
            }
            Globalisation::None | Globalisation::TrustRegion { .. } => Some(admissible(ray)?.alpha),
        };
        match found {
            Some(alpha) => ray.settle(alpha).map_err(Blocked::Domain),
            // If not even the shortest trial could be evaluated, the domain is to blame and not the merit.
            None => Err(match ray.take_error() {
                Some(error) => Blocked::Domain(error),
                None => Blocked::NoDecrease { trials: ray.trials(), smallest: ray.smallest() },
            }),
        }
    }

    /// argmin's Armijo backtracking, told by the interpolating polynomial how far to back off.
    fn backtrack(&mut self, ray: &mut Ray<'_>, first: f64) -> Option<f64> {
        let (value, slope) = (ray.start_value(), ray.start_slope());
        self.with_problem(ray, true, |problem| {
            let mut search = BacktrackingLineSearch::new(ArmijoCondition::new(SUFFICIENT_DECREASE)?);
            search.search_direction(1.0);
            search.initial_step_length(first)?;
            let (mut state, _) = search.init(problem, start(value, slope))?;
            let (mut alpha, mut previous) = (first, None);
            while !is_done(&mut search, problem, &state) {
                let now = (alpha, state.get_cost());
                let next = interpolate(value, slope, now, previous);
                if next < SHORTEST {
                    return Ok(None);
                }
                search = search.rho(next / alpha)?;
                (state, _) = search.next_iter(problem, state)?;
                previous = Some(now);
                // argmin multiplies by the factor itself; its own product is what was evaluated.
                alpha = state.get_param().copied().unwrap_or(next);
            }
            Ok(state.get_param().copied())
        })
    }

    fn more_thuente(&mut self, ray: &mut Ray<'_>, longest: f64) -> Option<f64> {
        let (value, slope) = (ray.start_value(), ray.start_slope());
        let found = self.with_problem(ray, false, |problem| {
            let mut search = MoreThuenteLineSearch::new()
                .with_c(SUFFICIENT_DECREASE, CURVATURE)?
                .with_bounds(SHORTEST * longest, longest)?;
            search.search_direction(1.0);
            search.initial_step_length(longest)?;
            drive(&mut search, problem, start(value, slope))
        });
        believe(ray, found)
    }

    fn hager_zhang(&mut self, ray: &mut Ray<'_>, longest: f64) -> Option<f64> {
        let (value, slope) = (ray.start_value(), ray.start_slope());
        let found = self.with_problem(ray, false, |problem| {
            let mut search = HagerZhangLineSearch::new().with_bounds(0.0, longest)?;
            search.search_direction(1.0);
            search.initial_step_length(longest)?;
            drive(&mut search, problem, start(value, slope))
        });
        believe(ray, found)
    }

    /// Lends the ray to argmin. A search that ends with an error has still left its trials.
    fn with_problem<'a>(
        &mut self,
        ray: &mut Ray<'a>,
        infinite_outside: bool,
        run: impl FnOnce(&mut Problem<OnRay<'_, 'a>>) -> Result<Option<f64>, Error>,
    ) -> Option<f64> {
        let ray = RefCell::new(ray);
        let mut problem = Problem::new(OnRay { ray: &ray, infinite_outside });
        problem.counts = std::mem::take(&mut self.counts);
        let found = run(&mut problem).ok().flatten();
        self.counts = std::mem::take(&mut problem.counts);
        found
    }
}

fn start(value: f64, slope: f64) -> SearchState {
    SearchState::new().param(0.0).cost(value).gradient(slope)
}

fn is_done<O, S: Solver<O, SearchState>>(search: &mut S, _problem: &Problem<O>, state: &SearchState) -> bool {
    state.terminated() || !matches!(search.terminate(state), TerminationStatus::NotTerminated)
}

fn drive<O, S: Solver<O, SearchState>>(
    search: &mut S,
    problem: &mut Problem<O>,
    state: SearchState,
) -> Result<Option<f64>, Error> {
    let (mut state, _) = search.init(problem, state)?;
    while !is_done(search, problem, &state) {
        (state, _) = search.next_iter(problem, state)?;
    }
    Ok(state.get_param().copied())
}

/// What a Wolfe search returned, if it decreases the merit; else the best of what it tried.
fn believe(ray: &mut Ray<'_>, found: Option<f64>) -> Option<f64> {
    let found = found.and_then(|alpha| ray.at(alpha).ok()).filter(|trial| ray.is_sufficient(*trial));
    found.or(ray.best()).map(|trial| trial.alpha)
}

/// The longest step `1, ½, ¼, …` at which the equations can be evaluated.
fn admissible(ray: &mut Ray<'_>) -> Result<Trial, Blocked> {
    let mut alpha = 1.0;
    loop {
        match ray.at(alpha) {
            Ok(trial) => return Ok(trial),
            Err(RayError::Evaluation(error)) if alpha * HALF < SHORTEST => return Err(Blocked::Domain(error)),
            Err(RayError::Evaluation(_)) => alpha *= HALF,
            Err(RayError::Exhausted) => {
                return Err(match ray.take_error() {
                    Some(error) => Blocked::Domain(error),
                    None => Blocked::NoDecrease { trials: ray.trials(), smallest: ray.smallest() },
                });
            }
        }
    }
}

/// The minimiser of the parabola through `φ(0), φ'(0), φ(α)`, or of the cubic that also meets the trial
/// before, kept within `[α/10, α/2]` (Dennis & Schnabel, A6.3.1). A value that is not finite halves.
fn interpolate(value: f64, slope: f64, now: (f64, f64), previous: Option<(f64, f64)>) -> f64 {
    let (alpha, phi) = now;
    if !phi.is_finite() {
        return HALF * alpha;
    }
    let excess = |(alpha, phi): (f64, f64)| (phi - value - alpha * slope) / (alpha * alpha);
    let parabola = -slope / (2.0 * excess(now));
    let next = match previous.filter(|(_, phi)| phi.is_finite()) {
        None => parabola,
        Some(before) => {
            let a = (excess(now) - excess(before)) / (alpha - before.0);
            let b = (alpha * excess(before) - before.0 * excess(now)) / (alpha - before.0);
            if a == 0.0 { parabola } else { (-b + (b * b - 3.0 * a * slope).sqrt()) / (3.0 * a) }
        }
    };
    // NaN (a negative discriminant) also ends at the upper bound.
    if next.is_nan() { HALF * alpha } else { next.clamp(0.1 * alpha, HALF * alpha) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_finds_the_minimum_of_a_parabola_and_of_a_cubic() {
        // φ = (α − 0.3)²
        let parabola = |a: f64| (a - 0.3) * (a - 0.3);
        assert!((interpolate(0.09, -0.6, (1.0, parabola(1.0)), None) - 0.3).abs() < 1e-14);
        // φ = α³ − 0.1 α: minimum at √(1/30)
        let cubic = |a: f64| a * a * a - 0.1 * a;
        let next = interpolate(0.0, -0.1, (0.5, cubic(0.5)), Some((1.0, cubic(1.0))));
        assert!((next - (1.0_f64 / 30.0).sqrt()).abs() < 1e-14);
    }

    #[test]
    fn interpolation_is_safeguarded() {
        assert_eq!(interpolate(1.0, -1.0, (1.0, f64::INFINITY), None), 0.5);
        assert_eq!(interpolate(1.0, -1e-9, (1.0, 1e9), None), 0.1);
        assert_eq!(interpolate(1.0, -1.0, (1.0, 0.999_99), None), 0.5);
        assert_eq!(
            interpolate(1.0, -1.0, (0.5, 2.0), Some((1.0, f64::INFINITY))),
            interpolate(1.0, -1.0, (0.5, 2.0), None)
        );
    }
}
