//! The shell around the Krylov methods: preparation, choice of the operator, checks and reports.
//!
//! Products come from the action of the operator, or from entries that were assembled at preparation.
//! Assembled entries are of that moment; before every solve one product is compared with that of the
//! operator, and if they differ (or the solution turns out to be inaccurate) the action takes over.

mod shown;

use std::sync::Arc;

use super::bicgstab::BiCgStab;
use super::cg::Cg;
use super::choice::{KrylovOptions, Operator, Preconditioner, PreconditionerMatrix};
use super::factor::check_entries;
use super::gmres::Gmres;
use super::iteration::{
    Action, ApproximateInverse, Limits, Outcome, Stop, System, check_vectors, is_known, misses, residual,
};
use super::minres::Minres;
use super::{
    LinearCounts, LinearError, LinearReport, LinearSolver, LinearSolverInfo, OperatorAge, SparseMatrix, SparsePattern,
    Symmetry, Tangent, precondition,
};
use crate::snapshot::{RestoreError, Snapshot};
use crate::vector::{axpy, dot, first_not_finite, max_norm, norm};
use shown::{Assembled, IsNeedOfEntries, WithoutEntries};

/// Assembled and matrix-free products of the same operator differ by rounding only.
const SAME_PRODUCT: f64 = 1e-9;

/// Which iteration.
pub(super) enum Method {
    Gmres { restart: usize, work: Gmres },
    BiCgStab(BiCgStab),
    Cg(Cg),
    Minres(Minres),
}

/// A Krylov method with its preconditioner.
pub(super) struct Krylov {
    method: Method,
    options: KrylovOptions,
    preconditioner: Box<dyn ApproximateInverse>,
    /// Whether this preconditioner reads all entries, so that they may serve for products as well.
    reads_entries: bool,
    pattern: Option<Arc<SparsePattern>>,
    matrix: Option<SparseMatrix>,
    assembled: bool,
    size: Option<usize>,
    right: Vec<f64>,
    work: [Vec<f64>; 2],
    counts: LinearCounts,
}

impl Krylov {
    /// A solver that is not prepared yet.
    pub(super) fn new(method: Method, options: KrylovOptions) -> Self {
        let definite = matches!(method, Method::Cg(_) | Method::Minres(_));
        let preconditioner = precondition::build(&options.preconditioner, options.preconditioner_matrix, definite);
        let reads_entries = options.preconditioner_matrix != PreconditionerMatrix::Sparser
            && !matches!(options.preconditioner, Preconditioner::None | Preconditioner::Multigrid(_));
        Self {
            method,
            options,
            preconditioner,
            reads_entries,
            pattern: None,
            matrix: None,
            assembled: false,
            size: None,
            right: Vec::new(),
            work: [Vec::new(), Vec::new()],
            counts: LinearCounts::default(),
        }
    }

    /// Limits the iterations of later solves.
    pub(super) fn limit(&mut self, iterations: usize) {
        self.options.max_iterations = iterations;
    }

    fn name(&self) -> String {
        let method = match &self.method {
            Method::Gmres { restart, .. } => format!("GMRES({restart})"),
            Method::BiCgStab(_) => "BiCGStab".to_owned(),
            Method::Cg(_) => "CG".to_owned(),
            Method::Minres(_) => "MINRES".to_owned(),
        };
        match self.preconditioner.name() {
            name if name.is_empty() => method,
            name => format!("{method} + {name}"),
        }
    }

    /// Assembles the entries if the settings ask for them.
    fn assemble(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        let wanted = match self.options.operator {
            Operator::Assembled => true,
            Operator::Auto => self.reads_entries,
            Operator::MatrixFree => false,
        };
        // Asking for a pattern may build it.
        let pattern = match if wanted { tangent.pattern() } else { None } {
            Some(pattern) => pattern,
            None if self.options.operator == Operator::Assembled => {
                return Err(LinearError::NeedsEntries { solver: self.name() });
            }
            None => {
                self.assembled = false;
                self.matrix = None;
                self.pattern = None;
                return Ok(());
            }
        };
        if pattern.size() != tangent.size() {
            return Err(LinearError::WrongLength { expected: tangent.size(), found: pattern.size() });
        }
        if !is_known(&self.pattern, pattern) {
            self.matrix = None;
        }
        let matrix = self.matrix.get_or_insert_with(|| SparseMatrix::zeros(pattern));
        tangent.fill(matrix.values_mut());
        check_entries(pattern, matrix.values())?;
        self.pattern = Some(Arc::clone(pattern));
        self.assembled = true;
        Ok(())
    }

    /// Shows the preconditioner the operator as it may see it.
    fn with_preconditioner<E: From<LinearError> + IsNeedOfEntries>(
        &mut self,
        tangent: &dyn Tangent,
        mut show: impl FnMut(&mut dyn ApproximateInverse, &mut LinearCounts, &dyn Tangent) -> Result<(), E>,
    ) -> Result<(), E> {
        let Self { preconditioner, counts, .. } = self;
        match self.matrix.as_ref().filter(|_| self.assembled) {
            Some(matrix) => show(&mut **preconditioner, counts, &Assembled { tangent, values: matrix.values() }),
            None if self.options.operator == Operator::MatrixFree => {
                match show(&mut **preconditioner, counts, &WithoutEntries { tangent }) {
                    // It cannot do without them: only the products are free of entries then.
                    Err(error) if error.is_need_of_entries() => show(&mut **preconditioner, counts, tangent),
                    outcome => outcome,
                }
            }
            None => show(&mut **preconditioner, counts, tangent),
        }
    }

    /// The work space of a prepared solver.
    fn make_room(&mut self, n: usize) {
        self.right.resize(n, 0.0);
        self.work.iter_mut().for_each(|w| w.resize(n, 0.0));
        self.size = Some(n);
    }

    /// The counters of a solver that does not take part at present.
    pub(super) fn set_counts(&mut self, counts: LinearCounts) {
        self.counts = counts;
    }

    /// Whether the assembled entries are still those of the operator, judged by one product.
    fn is_current(&mut self, tangent: &dyn Tangent) -> bool {
        let Some(matrix) = self.matrix.as_ref().filter(|_| self.assembled) else { return false };
        let [ours, theirs] = &mut self.work;
        matrix.apply(&self.right, ours);
        tangent.apply(&self.right, theirs);
        let size = max_norm(theirs);
        axpy(-1.0, theirs, ours);
        !misses(max_norm(ours), SAME_PRODUCT * size)
    }

    /// Runs the iteration on one form of the operator.
    fn iterate(&mut self, action: &Action<'_>, x: &mut [f64], limits: Limits) -> Outcome {
        let system = &mut System::new(action, &mut *self.preconditioner, &self.right, limits);
        match &mut self.method {
            Method::Gmres { work, .. } => work.solve(system, x),
            Method::BiCgStab(work) => work.solve(system, x),
            Method::Cg(work) => work.solve(system, x),
            Method::Minres(work) => work.solve(system, x),
        }
    }

    /// Solves with the right-hand side at hand (of length one).
    fn run(&mut self, tangent: &dyn Tangent, x: &mut [f64], limits: Limits) -> Outcome {
        let action = |v: &[f64], out: &mut [f64]| tangent.apply(v, out);
        let mut spent = 0;
        if self.is_current(tangent)
            && let Some(matrix) = self.matrix.take()
        {
            let outcome = self.iterate(&|v, out| matrix.apply(v, out), x, limits);
            self.matrix = Some(matrix);
            let true_residual = residual(&action, &self.right, x, &mut self.work[0]) / norm(&self.right);
            let converged = outcome.stop == Stop::Converged;
            if !converged || !misses(true_residual, limits.tolerance) {
                return Outcome { relative_residual: true_residual, ..outcome };
            }
            spent = outcome.iterations;
        }
        let rest = Limits { max_iterations: limits.max_iterations.saturating_sub(spent), ..limits };
        let outcome = self.iterate(&action, x, rest);
        Outcome { iterations: outcome.iterations + spent, ..outcome }
    }

    /// A failure in the terms of the seam.
    fn failure(&mut self, tangent: &dyn Tangent, outcome: Outcome) -> LinearError {
        let iterations = outcome.iterations;
        let finite = outcome.relative_residual.is_finite();
        let relative_residual = if finite { outcome.relative_residual } else { f64::INFINITY };
        match outcome.stop {
            Stop::NegativeCurvature(value) => LinearError::NotPositiveDefinite { unknown: None, value },
            Stop::Singular => LinearError::Singular { unknown: None },
            Stop::Limit | Stop::Converged => LinearError::IterationLimit { iterations, relative_residual },
            Stop::Breakdown => LinearError::Breakdown { iterations, relative_residual },
            Stop::NotFinite => {
                // Either the operator is not finite, which one product shows, or the iteration overflowed.
                tangent.apply(&self.right, &mut self.work[0]);
                match first_not_finite(&self.work[0]) {
                    Some(row) => LinearError::EntryNotFinite { row },
                    None => LinearError::Breakdown { iterations, relative_residual },
                }
            }
        }
    }
}

impl LinearSolver for Krylov {
    fn info(&self) -> LinearSolverInfo {
        LinearSolverInfo {
            name: self.name(),
            unknowns: self.size.unwrap_or(0),
            entries: self.matrix.as_ref().map_or(0, |m| m.values().len()),
            fill: if self.size.is_some() { self.preconditioner.fill() } else { 0 },
            threads: rayon::current_num_threads(),
            reason: String::new(),
        }
    }

    fn counts(&self) -> LinearCounts {
        self.counts
    }

    fn prepare(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        self.size = None;
        if matches!(self.method, Method::Cg(_) | Method::Minres(_)) && tangent.symmetry() == Symmetry::General {
            return Err(LinearError::NeedsSymmetry { solver: self.name() });
        }
        self.assemble(tangent)?;
        self.with_preconditioner(tangent, |inverse, counts, tangent| inverse.prepare(tangent, counts))?;
        self.make_room(tangent.size());
        Ok(())
    }

    fn keeps_older_operator(&self) -> bool {
        self.size.is_some() && self.preconditioner.keeps_older_operator()
    }

    fn save(&self) -> Snapshot {
        let mut saved = self.counts.save();
        saved.put_flag("ready", self.size.is_some());
        saved.put_part("preconditioner", self.preconditioner.save());
        saved
    }

    fn restore(&mut self, saved: &Snapshot, tangent: &dyn Tangent, age: OperatorAge) -> Result<(), RestoreError> {
        if saved.flag("ready")? {
            self.assemble(tangent)?;
            let part = saved.part("preconditioner");
            self.with_preconditioner(tangent, |inverse, _, tangent| inverse.restore(&part, tangent, age))?;
            self.make_room(tangent.size());
        }
        self.counts = LinearCounts::restored(saved)?;
        Ok(())
    }

    fn solve(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        let n = self.size.ok_or(LinearError::NotPrepared)?;
        check_vectors(n, tangent, b, x)?;
        self.counts.solves += 1;
        x.fill(0.0);
        let scale = norm(b);
        if scale == 0.0 {
            return Ok(LinearReport { iterations: 0, relative_residual: 0.0 });
        }
        // A right-hand side of length one keeps the scalar products away from under- and overflow.
        self.right.copy_from_slice(b);
        self.right.iter_mut().for_each(|r| *r /= scale);
        let tolerance = self.options.tolerance.map_or(tolerance, |own| own.min(tolerance));
        let limits = Limits { tolerance, max_iterations: self.options.max_iterations };
        let outcome = self.run(tangent, x, limits);
        self.counts.iterations += outcome.iterations;
        if outcome.stop != Stop::Converged || misses(outcome.relative_residual, tolerance) {
            return Err(self.failure(tangent, outcome));
        }
        x.iter_mut().for_each(|x| *x *= scale);
        if !dot(x, x).is_finite() && first_not_finite(x).is_some() {
            return Err(LinearError::Singular { unknown: None });
        }
        Ok(LinearReport { iterations: outcome.iterations, relative_residual: outcome.relative_residual })
    }
}
