//! The least change of the weights that meets the conditions: in a band first, and everywhere if that is not enough.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::constraints::Constraints;
use super::failure::Failure;
use super::normal::NormalEquations;
use super::step::{Step, changes};
use super::{BalanceReport, Effort, count, worst};
use crate::tensor::Vector;

/// Part of the allowed residual at which the iteration ends.
const TARGET: f64 = 0.3;
/// The iteration also ends if the residual has not come down by this factor in so many steps, and in any
/// case after as many as this.
const PROGRESS: f64 = 0.5;
const PATIENCE: usize = 3;
const ITERATIONS: usize = 30;
/// Steps that the iteration remembers.
const MEMORY: usize = 8;
/// Rings of neighbours that take part around the particles that need a change.
const RINGS: usize = 2;
/// The change has died out if it is this much smaller at the rim than at its largest.
const DIED_OUT: f64 = 0.25;
/// The weights nearest to the seed that meet the conditions, changed around the particles of the `core`; if that is
/// not enough, everywhere.
pub(super) fn least_change<const D: usize>(
    constraints: &Constraints<'_, D>,
    seed: &[Vector<D>],
    core: Vec<bool>,
    effort: Effort,
    report: &mut BalanceReport,
) -> Result<Vec<Vector<D>>, Failure> {
    let inner = (1..RINGS).fold(core, |band, _| widened(constraints, &band));
    let mut band = widened(constraints, &inner);
    let whole = !band.contains(&false);
    let largest = effort.most_unknowns(D);
    let mut attempt = balanced(constraints, seed, &band, largest, report);
    if !whole && !attempt.as_ref().is_ok_and(|weights| has_died_out(constraints, seed, weights, &inner)) {
        band.fill(true);
        attempt = balanced(constraints, seed, &band, largest, report);
    }
    let weights = attempt?;
    report.band = count(&band);
    report.unknowns = report.band * 2 * (D + 1);
    Ok(weights)
}

/// A band and its neighbours.
fn widened<const D: usize>(constraints: &Constraints<'_, D>, band: &[bool]) -> Vec<bool> {
    let near = |a: usize| constraints.row(a).any(|entry| band[constraints.neighbour(entry)]);
    (0..band.len()).into_par_iter().map(near).collect()
}

/// Whether entries that reach out of the `inner` particles changed much less than the others.
fn has_died_out<const D: usize>(
    constraints: &Constraints<'_, D>,
    seed: &[Vector<D>],
    weights: &[Vector<D>],
    inner: &[bool],
) -> bool {
    let (mut largest, mut rim) = (0.0_f64, 0.0_f64);
    for a in 0..inner.len() {
        for entry in constraints.row(a) {
            let change = (weights[entry] - seed[entry]).amax();
            largest = largest.max(change);
            if !(inner[a] && inner[constraints.neighbour(entry)]) {
                rim = rim.max(change);
            }
        }
    }
    rim <= DIED_OUT * largest
}

/// The weights nearest to the seed that meet the conditions, changed within a band only.
fn balanced<const D: usize>(
    constraints: &Constraints<'_, D>,
    seed: &[Vector<D>],
    band: &[bool],
    largest: usize,
    report: &mut BalanceReport,
) -> Result<Vec<Vector<D>>, Failure> {
    let unknowns = count(band) * 2 * (D + 1);
    if unknowns > largest {
        return Err(Failure::TooLarge { unknowns, largest });
    }
    let solver = |error: nicolson_solvers::linear::LinearError| Failure::Solver(error.to_string());
    let mut equations = NormalEquations::new(constraints, band).map_err(solver)?;
    let (scale, tolerance) = (constraints.scale(), constraints.tolerance());
    let mut weights = seed.to_vec();
    let mut residuals = constraints.residuals(&weights);
    let mut best = worst(&residuals);
    let mut steps: VecDeque<Step<D>> = VecDeque::with_capacity(MEMORY);
    let (mut waited, mut milestone) = (0, best.1);
    for _ in 0..ITERATIONS {
        report.iterations += 1;
        let multipliers = equations.solve(&residuals).map_err(solver)?;
        let mut step = Step::new(constraints, changes(constraints, band, &multipliers));
        steps.iter().for_each(|earlier| step.avoid(earlier));
        let length = step.length(&residuals);
        for (weight, change) in weights.iter_mut().zip(&step.changes) {
            *weight += change.component_mul(&length);
        }
        residuals = constraints.residuals(&weights);
        if steps.len() == MEMORY {
            steps.pop_front();
        }
        steps.push_back(step);
        best = worst(&residuals);
        waited += 1;
        if best.1 < PROGRESS * milestone {
            (waited, milestone) = (0, best.1);
        }
        if waited > PATIENCE || best.1 <= TARGET * tolerance {
            break;
        }
    }
    let (particle, residual) = best;
    report.residual = residual / scale;
    if residual <= tolerance { Ok(weights) } else { Err(Failure::Infeasible { particle, residual: residual / scale }) }
}
