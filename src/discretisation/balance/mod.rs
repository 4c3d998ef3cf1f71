//! Balanced weights: constant stress is balanced by its boundary traction, exactly.
//!
//! The corrected gradient reproduces linear fields, but its transpose, the force, does not annihilate a
//! constant stress beside a boundary, and the order of convergence drops to 0.5–1. Here the weights
//! `Q_ab,I = V_a g_ab,I` are changed as little as possible (in the Euclidean norm) such that per direction `I`
//!
//! ```text
//! Q 1  = 0         Q X_J  = V δ_IJ                                gradients of linear fields stay exact
//! Qᵀ 1 = e_I       Qᵀ X_J = Σ_f a_f N_f,I r_f X_f,J − V δ_IJ      forces of constant and linear stress
//! e_I = Σ_f a_f N_f,I r_f
//! ```
//!
//! for faces `f` with area `a_f`, normal `N_f` and interpolation `r_f` to their point `X_f`. The condition on
//! linear stress is left out where faces meet at an edge. The force stays the transpose of the gradient, so
//! momentum, energy and symmetry are untouched: summation by parts on a cloud of points, as in Chiu, Wang,
//! Hu and Jameson (2012), "A conservative mesh-free scheme and generalized framework for conservation
//! laws", and Trask, Bochev and Perego (2020), "A conservative, consistent, and scalable meshfree mimetic
//! method".
//!
//! Only a band of particles around those whose conditions are not met already takes part. If the change
//! has died out at the inner rim of the band, the rest keeps its weights to the last bit: so it is on lattices
//! with h = Δx. If it has not (h = 1.2 Δx: the stencil reaches past the next neighbour, and a band would
//! need changes that grow with the number of particles), or if the band is too small, all take part. What the
//! wider stencil lacks is not weights but volumes that suit it ([`crate::geometry::stencil_volumes`]): with those a
//! band is enough again.
//!
//! Where particles are the corners of cells, equations are not needed at all ([`cells`]): that is how bodies of any size
//! are balanced, bent and perturbed ones too.
//!
//! Rejected: freeing only the nearest pairs (infeasible in 2D beyond h = Δx); weighting the change by the
//! kernel (moves the interior by 14 % instead of 5 % at h = 1.2 Δx); conjugate gradients (see `normal`).

mod boundary;
mod cells;
mod constraints;
mod failure;
mod least;
mod normal;
mod ordering;
mod step;

use super::{DiscretisationError, Gradient};
use crate::setup::{Body, Particles};
use crate::tensor::Vector;
pub(crate) use boundary::face_shares;
pub(super) use cells::of_body as cells_of_body;
use constraints::{Constraints, Side};
use least::least_change;

/// Unknowns of the largest system that is factored, in one or two and in three dimensions: beyond that
/// the factor would take some ten gigabytes.
const LARGEST: [usize; 2] = [2_000_000, 400_000];
/// The same for what is done unasked: some seconds.
const CHEAP: [usize; 2] = [200_000, 40_000];

/// A kernel that reaches no more than so many spacings sees next neighbours only, as cells do.
const NEXT_NEIGHBOURS: f64 = 2.1;

/// How weights may be balanced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effort {
    /// By the least change of the seed, up to what memory bears.
    Least,
    /// By cells, or not at all.
    Cells,
    /// By cells where the kernel sees no farther than they do; otherwise by the least change if that does not delay
    /// a run; otherwise by cells.
    Cheap,
}

impl Effort {
    fn most_unknowns(self, dimension: usize) -> usize {
        match self {
            Self::Least => LARGEST[usize::from(dimension == 3)],
            Self::Cheap | Self::Cells => CHEAP[usize::from(dimension == 3)],
        }
    }

    fn begins_with_cells(self, body: &Body) -> bool {
        let reach = crate::kernel::support(body.kernel) * body.smoothing;
        self == Self::Cells || (self == Self::Cheap && reach <= NEXT_NEIGHBOURS)
    }
}

/// What balancing the weights of a body took.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BalanceReport {
    /// Name of the body.
    pub body: String,
    /// Whether its weights are balanced.
    pub balanced: bool,
    /// Whether by its cells, without equations.
    pub cells: bool,
    /// Why not; empty if they are.
    pub note: String,
    /// Particles that missed a condition before.
    pub missed: usize,
    /// Particles that took part.
    pub band: usize,
    /// Unknowns of the equations, per direction.
    pub unknowns: usize,
    /// Iterations, those of a band that turned out too small included.
    pub iterations: usize,
    /// Largest residual of a condition, in units of a particle's face.
    pub residual: f64,
    /// Largest change of a weight over the largest weight.
    pub largest_change: f64,
    /// Wall-clock time, s.
    pub seconds: f64,
}

impl BalanceReport {
    /// Takes weights that cells gave with this residual.
    fn by_cells<const D: usize>(&mut self, (weights, residual): (Vec<Vector<D>>, f64)) -> Vec<Vector<D>> {
        *self = Self {
            cells: true,
            residual,
            missed: self.missed,
            balanced: true,
            body: std::mem::take(&mut self.body),
            ..Self::default()
        };
        weights
    }

    /// A body that keeps its weights.
    pub(super) fn untouched(body: &Body) -> Self {
        Self { body: body.name.clone(), ..Self::default() }
    }
}

/// Balances the weights of one body.
///
/// # Errors
/// If the body has no boundary description, its volumes and faces disagree, its stencils are too small, or it
/// would take more work than allowed.
pub(super) fn balance<const D: usize>(
    gradient: &mut Gradient<D>,
    body: &Body,
    particles: &Particles<D>,
    effort: Effort,
) -> Result<BalanceReport, DiscretisationError> {
    let mut report = BalanceReport { balanced: true, ..BalanceReport::untouched(body) };
    if body.particles.is_empty() {
        return Ok(report);
    }
    let constraints = Constraints::new(body, particles, &gradient.neighbourhood)?;
    let entries = entries(gradient, body);
    let volume = |a: usize| particles.volumes[a + body.particles.start];
    let mut seed = vec![Vector::zeros(); entries.len()];
    for a in 0..constraints.count() {
        for (entry, weight) in constraints.row(a).zip(gradient.weights_of(a + body.particles.start)) {
            seed[entry] = weight * volume(a);
        }
    }
    let residuals = constraints.residuals(&seed);
    report.residual = worst(&residuals).1 / constraints.scale();
    // A sweep over all particles: once, not once for each of them.
    let tolerance = constraints.tolerance();
    let core: Vec<bool> = residuals.iter().map(|r| misses(r, tolerance)).collect();
    report.missed = count(&core);
    if report.missed == 0 {
        return Ok(report);
    }
    let by_cells = || cells::weights(body, particles, &gradient.neighbourhood, &constraints, entries.len());
    let weights = if effort.begins_with_cells(body) {
        match by_cells() {
            Ok(found) => report.by_cells(found),
            Err(reason) if effort == Effort::Cells => return Err(reason.located(body, particles)),
            Err(_) => least_change(&constraints, &seed, core, effort, &mut report)
                .map_err(|failure| failure.located(body, particles))?,
        }
    } else {
        match least_change(&constraints, &seed, core, effort, &mut report) {
            Ok(weights) => weights,
            Err(failure) => match by_cells() {
                Ok(found) if effort == Effort::Cheap => report.by_cells(found),
                _ => return Err(failure.located(body, particles)),
            },
        }
    };
    let (mut change, mut size) = (0.0_f64, 0.0_f64);
    for a in 0..constraints.count() {
        for entry in constraints.row(a) {
            size = size.max(seed[entry].amax());
            // What did not change keeps its bits.
            if weights[entry] != seed[entry] {
                change = change.max((weights[entry] - seed[entry]).amax());
                gradient.weights.entries_mut()[entries.start + entry] = weights[entry] / volume(a);
            }
        }
    }
    report.largest_change = change / size;
    Ok(report)
}

fn count(band: &[bool]) -> usize {
    band.iter().filter(|inside| **inside).count()
}

/// Entries of the rows of a body.
fn entries<const D: usize>(gradient: &Gradient<D>, body: &Body) -> std::ops::Range<usize> {
    let rows = &gradient.neighbourhood;
    rows.row(body.particles.start).start..rows.row(body.particles.end - 1).end
}

/// Whether a condition is off by more than this.
fn misses<const D: usize>(residual: &[Side<D>; 2], tolerance: f64) -> bool {
    !residual.iter().all(|side| side.largest() <= tolerance)
}

/// The particle whose conditions are off most, and by how much.
fn worst<const D: usize>(residuals: &[[Side<D>; 2]]) -> (usize, f64) {
    let mut worst = (0, 0.0);
    for (a, side) in residuals.iter().enumerate().flat_map(|(a, sides)| sides.iter().map(move |side| (a, side))) {
        let size = side.largest();
        let size = if size.is_nan() { f64::INFINITY } else { size };
        if size > worst.1 {
            worst = (a, size);
        }
    }
    worst
}
