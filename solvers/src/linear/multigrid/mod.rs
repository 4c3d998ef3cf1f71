//! Multigrid without entries, for large steps and statics.
//!
//! The coarse space is spanned by tent functions on a lattice around each body, a few particle spacings wide: what
//! smoothed aggregation builds from a matrix, built from positions instead. They contain translations and linear
//! functions exactly, so rigid motions of any configuration, and the coarse matrix is the true `Pᵀ A P`, which the
//! operator [adds up](super::Tangent::project) particle by particle; fixed components are left out of P. From there
//! on lattices of double spacing follow, down to a direct factor.
//!
//! On the particles, a [`Chebyshev`] polynomial in block Jacobi smooths, with products that come from the action. The
//! sum of both corrections is symmetric positive definite, so it serves CG and MINRES. An operator that is not
//! symmetric is preconditioned by what belongs to its symmetric part.
//!
//! The coarse matrices are kept while they work: they are renewed when the diagonal blocks have changed by more than
//! 30 %, or when a solve takes half as many iterations again as the first one with them did.

mod chebyshev;
mod coarse;
mod coarsening;
mod hierarchy;
mod tents;

use std::sync::Arc;

pub use coarse::CoarseMatrix;
pub use tents::{Geometry, PointTents, Tents};

use super::choice::{InvalidChoice, refuse};
use super::iteration::{Action, ApproximateInverse};
use super::precondition::BlockInverses;
use super::{LinearCounts, LinearError, OperatorAge, SparsePattern, Tangent};
use crate::snapshot::{RestoreError, Snapshot};
use chebyshev::Chebyshev;
use hierarchy::Hierarchy;

/// A change of the diagonal blocks that makes new coarse matrices necessary.
const STALE: f64 = 1.3;
/// Ratio of the ends of the interval that the smoother damps, per lattice spacing squared.
const INTERVAL: f64 = 1.0;

/// Settings of [multigrid](super::Preconditioner::Multigrid).
///
/// [`Preconditioner::Multigrid`]: super::Preconditioner::Multigrid
#[derive(Debug, Clone, PartialEq)]
pub struct MultigridOptions {
    /// Spacing of the finest lattice in spacings of the particles.
    pub spacing: f64,
    /// Terms of the smoothing polynomial before and after the coarse correction, at twice as many products in all; 0
    /// adds the corrections of all lattices to that of block Jacobi instead, without any product. That takes twice the
    /// iterations of one term and two thirds of the time (`benches/matrix_free.rs`); default 0.
    pub smoothing: usize,
    /// Unknowns that the coarsest lattice may have.
    pub coarsest: usize,
}

impl Default for MultigridOptions {
    fn default() -> Self {
        Self { spacing: 4.0, smoothing: 0, coarsest: 1000 }
    }
}

impl MultigridOptions {
    pub(super) fn validate(&self) -> Result<(), InvalidChoice> {
        if !(self.spacing >= 1.0 && self.spacing <= 100.0) {
            return refuse("spacing", format!("must lie between 1 and 100, not {}", self.spacing));
        }
        if self.coarsest == 0 {
            return refuse("coarsest", "must be at least 1");
        }
        Ok(())
    }
}

/// The preconditioner.
pub(super) struct Multigrid {
    options: MultigridOptions,
    /// The coarse space, found once.
    tents: Option<(usize, Tents)>,
    coarse: Option<Kept>,
    smoother: Option<Chebyshev>,
    /// Whether the coarse matrices are those of an operator before the last.
    older: bool,
    applications: usize,
    residual: Vec<f64>,
    work: Vec<f64>,
    values: [Vec<f64>; 2],
    points: Vec<[f64; 3]>,
}

/// Coarse matrices, and what they were made for.
struct Kept {
    hierarchy: Hierarchy,
    /// Sum of the diagonal of the operator.
    trace: f64,
    /// Applications of the first solve.
    first: Option<usize>,
}

impl Multigrid {
    pub(super) fn new(options: MultigridOptions) -> Self {
        Self {
            options,
            tents: None,
            coarse: None,
            smoother: None,
            older: false,
            applications: 0,
            residual: Vec::new(),
            work: Vec::new(),
            values: [Vec::new(), Vec::new()],
            points: Vec::new(),
        }
    }

    /// Whether the coarse matrices have become bad.
    fn is_stale(&mut self, trace: f64) -> bool {
        let Some(kept) = &mut self.coarse else { return true };
        let applications = std::mem::take(&mut self.applications);
        let changed = !(trace <= STALE * kept.trace && kept.trace <= STALE * trace);
        match kept.first {
            Some(first) => changed || applications > first + first / 2 + 2,
            None => {
                kept.first = (applications > 0).then_some(applications);
                changed
            }
        }
    }
}

impl Multigrid {
    /// Finds the coarse space of a new operator.
    fn find_tents(&mut self, tangent: &dyn Tangent, counts: &mut LinearCounts) -> Result<(), LinearError> {
        let n = tangent.size();
        if self.tents.as_ref().is_none_or(|(size, _)| *size != n) {
            self.tents = None;
            self.coarse = None;
            let geometry = tangent.geometry().ok_or(LinearError::NeedsGeometry)?;
            let tents = Tents::new(geometry, self.options.spacing).ok_or(LinearError::NeedsGeometry)?;
            counts.analyses += 1;
            let length = tents.nodes() * tents.dimension;
            self.values.iter_mut().for_each(|values| values.resize(length, 0.0));
            self.tents = Some((n, tents));
        }
        self.residual.resize(n, 0.0);
        self.work.resize(if self.options.smoothing > 0 { n } else { 0 }, 0.0);
        Ok(())
    }

    fn replace_inverses(&mut self, inverses: BlockInverses) {
        if let Some(smoother) = &mut self.smoother {
            smoother.inverses = inverses;
        }
    }

    /// Makes new coarse matrices.
    fn renew(&mut self, tangent: &dyn Tangent, inverses: BlockInverses, trace: f64) -> Result<(), LinearError> {
        let Some((n, tents)) = &self.tents else { return Err(LinearError::NotPrepared) };
        let coarse = project(tangent, tents)?;
        let hierarchy = Hierarchy::new(coarse, tents, self.options.coarsest)?;
        self.smoother = Some(Chebyshev::new(inverses, &|v, out| tangent.apply(v, out), *n));
        self.coarse = Some(Kept { hierarchy, trace, first: None });
        self.applications = 0;
        Ok(())
    }
}

/// Inverses of the diagonal blocks, and the sum of the diagonal.
fn inverse_blocks(tangent: &dyn Tangent) -> Result<(BlockInverses, f64), LinearError> {
    let n = tangent.size();
    let (bounds, blocks) = diagonal_blocks(tangent)?;
    if let Some(k) = crate::vector::first_not_finite(&blocks) {
        return Err(LinearError::EntryNotFinite { row: k * n / blocks.len().max(1) });
    }
    let mut start = 0;
    let sizes = bounds.windows(2).map(|b| b[1] - b[0]);
    let trace = sizes
        .map(|size| {
            let sum: f64 = (0..size).map(|i| blocks[start + i * size + i]).sum();
            start += size * size;
            sum
        })
        .sum();
    Ok((BlockInverses::definite(bounds, blocks), trace))
}

/// Diagonal blocks by rows, from the operator or from its entries.
fn diagonal_blocks(tangent: &dyn Tangent) -> Result<(Vec<usize>, Vec<f64>), LinearError> {
    let n = tangent.size();
    let bounds = if tangent.blocks().is_empty() { (0..=n).collect() } else { tangent.blocks().to_vec() };
    let mut blocks = vec![0.0; bounds.windows(2).map(|b| (b[1] - b[0]).pow(2)).sum()];
    if tangent.offers_diagonal_blocks() {
        tangent.diagonal_blocks(&mut blocks);
    } else {
        let (pattern, values) = entries(tangent)?;
        let mut start = 0;
        for bounds in bounds.windows(2) {
            let size = bounds[1] - bounds[0];
            for row in bounds[0]..bounds[1] {
                for (&column, value) in pattern.row(row).iter().zip(&values[pattern.stored(row)]) {
                    if (bounds[0]..bounds[1]).contains(&column) {
                        blocks[start + (row - bounds[0]) * size + column - bounds[0]] = *value;
                    }
                }
            }
            start += size * size;
        }
    }
    Ok((bounds, blocks))
}

/// All entries of an operator.
fn entries(tangent: &dyn Tangent) -> Result<(&Arc<SparsePattern>, Vec<f64>), LinearError> {
    let pattern = tangent.pattern().ok_or_else(|| LinearError::NeedsEntries { solver: "multigrid".to_owned() })?;
    let mut values = vec![0.0; pattern.entries()];
    tangent.fill(&mut values);
    super::factor::check_entries(pattern, &values)?;
    Ok((pattern, values))
}

/// `Pᵀ A P` from the operator, or from its entries.
fn project(tangent: &dyn Tangent, tents: &Tents) -> Result<CoarseMatrix, LinearError> {
    let d = tents.dimension;
    let mut coarse = CoarseMatrix::zeros(d, tents.nodes());
    if tangent.project(tents, &mut coarse) {
        return Ok(coarse);
    }
    let (pattern, values) = entries(tangent)?;
    let owners = tents.owners(tangent.size());
    for row in 0..pattern.size() {
        let (point, i) = owners[row];
        let own = tents.at(point as usize);
        for (&column, value) in pattern.row(row).iter().zip(&values[pattern.stored(row)]) {
            let (other, j) = owners[column];
            for (to, left) in own.iter() {
                for (from, right) in tents.at(other as usize).iter() {
                    coarse.block_mut(to, from)[usize::from(i) * d + usize::from(j)] += left * value * right;
                }
            }
        }
    }
    Ok(coarse)
}

impl ApproximateInverse for Multigrid {
    fn name(&self) -> String {
        match self.options.smoothing {
            0 => "additive multigrid".to_owned(),
            degree => format!("multigrid({degree})"),
        }
    }

    fn prepare(&mut self, tangent: &dyn Tangent, counts: &mut LinearCounts) -> Result<(), LinearError> {
        self.find_tents(tangent, counts)?;
        let (inverses, trace) = inverse_blocks(tangent)?;
        self.older = !self.is_stale(trace);
        if self.older {
            self.replace_inverses(inverses);
            return Ok(());
        }
        counts.factorisations += 1;
        self.renew(tangent, inverses, trace)
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        // Without products there is no smoothing but that of block Jacobi.
        let smoothing = std::mem::take(&mut self.options.smoothing);
        self.apply_within(&|_, _| (), r, z);
        self.options.smoothing = smoothing;
    }

    fn apply_within(&mut self, action: &Action<'_>, r: &[f64], z: &mut [f64]) {
        let (Some((_, tents)), Some(kept), Some(smoother)) = (&self.tents, &mut self.coarse, &mut self.smoother) else {
            return z.copy_from_slice(r);
        };
        self.applications += 1;
        let degree = self.options.smoothing;
        let ratio = INTERVAL * self.options.spacing.powi(2);
        let [right, left] = &mut self.values;
        self.residual.copy_from_slice(r);
        z.fill(0.0);
        if degree > 0 {
            smoother.smooth(action, &mut self.residual, z, degree, ratio);
            action(z, &mut self.work);
            self.residual.iter_mut().zip(r).zip(&self.work).for_each(|((out, r), product)| *out = r - product);
        }
        tents.restrict(&self.residual, right);
        kept.hierarchy.solve(right, left);
        tents.prolong(left, z, &mut self.points);
        self.residual.copy_from_slice(r);
        if degree > 0 {
            action(z, &mut self.work);
            self.residual.iter_mut().zip(&self.work).for_each(|(out, product)| *out -= product);
        }
        smoother.smooth(action, &mut self.residual, z, degree.max(1), ratio);
    }

    fn fill(&self) -> usize {
        let coarse = self.coarse.as_ref().map_or(0, |kept| kept.hierarchy.entries());
        coarse + self.smoother.as_ref().map_or(0, |smoother| smoother.inverses.entries())
    }

    fn keeps_older_operator(&self) -> bool {
        self.older
    }

    fn save(&self) -> Snapshot {
        let mut saved = Snapshot::new();
        saved.put_flag("older", self.older);
        saved.put_counts("applications", &[self.applications]);
        saved.put_counts("first", &self.coarse.iter().filter_map(|kept| kept.first).collect::<Vec<_>>());
        saved
    }

    fn restore(&mut self, saved: &Snapshot, tangent: &dyn Tangent, age: OperatorAge) -> Result<(), RestoreError> {
        self.find_tents(tangent, &mut LinearCounts::default())?;
        let (inverses, trace) = inverse_blocks(tangent)?;
        self.older = saved.flag("older")?;
        if age == OperatorAge::Last && self.older {
            self.replace_inverses(inverses);
        } else {
            self.renew(tangent, inverses, trace)?;
        }
        self.applications = saved.count("applications")?;
        if let Some(kept) = &mut self.coarse {
            kept.first = saved.integers("first")?.first().and_then(|first| usize::try_from(*first).ok());
        }
        Ok(())
    }
}
