//! A factored matrix: what LU, LDLᵀ and Cholesky have in common.
//!
//! One analysis per pattern; at every preparation the values are filled in place, checked, equilibrated
//! and factored. The factor is then *probed*, because a factorisation may succeed on a singular matrix
//! (faer's sparse LU returns `Ok` on a matrix of ones): with a fixed vector `v`, `y = A⁻¹ v` must be
//! finite, satisfy `A y = v` up to a backward error of rounding size, and not be as long as `1/ε`.
//! Where `y` is suspiciously long, one step of inverse iteration with `Aᵀ` gives the estimate
//! `‖A⁻¹‖ ≈ ‖A⁻ᵀ y‖ / ‖y‖` (Higham 2002, *Accuracy and Stability*, ch. 15), and `y` shows the null
//! vector: its largest component names the unknown.

use std::sync::Arc;

use super::effort::FactorSize;
use super::iteration::{ApproximateInverse, is_known, misses};
use super::scaling::Equilibration;
use super::{LinearCounts, LinearError, OperatorAge, SparsePattern, Symmetry, Tangent};
use crate::snapshot::{RestoreError, Snapshot};
use crate::vector::{first_not_finite, max_norm, norm};

/// Estimated condition above which a matrix counts as singular: no digit of a solution is left.
const SINGULAR: f64 = 1.0 / (8.0 * f64::EPSILON);
/// Condition of the probe that calls for the sharper estimate.
const SUSPICIOUS: f64 = 1e8;
/// Backward error of the probe that a stable factorisation stays far below.
const STABLE: f64 = 1e-8;
/// Backward error of the probe up to which refinement can still be trusted to repair the solution.
const REPAIRABLE: f64 = 1e-2;

/// More variants than any factorisation has.
const MOST_FALLS: usize = 8;

/// A sparse factorisation of one kind. Sizes are positive; values are finite and equilibrated.
pub(super) trait Factors: Send {
    /// Name in words.
    fn name(&self) -> &'static str;

    /// Whether a symmetric matrix is needed.
    fn needs_symmetry(&self) -> bool;

    /// Prepares for matrices on a new pattern, that of a tangent.
    fn analyse(&mut self, pattern: &SparsePattern, tangent: &dyn Tangent) -> Result<(), LinearError>;

    /// Factors a matrix on the pattern of the last analysis.
    fn factor(&mut self, pattern: &SparsePattern, values: &[f64]) -> Result<(), LinearError>;

    /// Turns to a more stable variant, if there is one. The next step is a new factorisation.
    ///
    /// # Errors
    /// Those of the analysis that the variant may need.
    fn fall_back(&mut self, pattern: &SparsePattern) -> Result<bool, LinearError> {
        let _ = pattern;
        Ok(false)
    }

    /// Goes back to the first variant.
    fn restore(&mut self) {}

    /// How many times it has fallen back from the first variant.
    fn falls(&self) -> usize {
        0
    }

    /// Whether the factor shows by itself that it is stable and far from singular.
    fn is_evidently_good(&self) -> bool {
        false
    }

    /// `x ← A⁻¹ x`.
    fn solve(&mut self, x: &mut [f64]);

    /// `x ← A⁻ᵀ x`.
    fn solve_transposed(&mut self, x: &mut [f64]);

    /// Stored entries of the factors (a bound where the library does not tell).
    fn fill(&self) -> usize;

    /// Size of the factor of the first variant, where the analysis tells.
    fn size(&self) -> Option<FactorSize> {
        None
    }
}

/// The factor of one matrix after another on the same pattern, with its scaling.
pub(super) struct FactoredMatrix {
    factors: Box<dyn Factors>,
    pattern: Option<Arc<SparsePattern>>,
    values: Vec<f64>,
    scaling: Equilibration,
    probe: Vec<f64>,
    product: Vec<f64>,
    /// `‖A‖∞` as filled.
    magnitude: f64,
    ready: bool,
}

impl FactoredMatrix {
    /// Nothing factored yet.
    pub(super) fn new(factors: Box<dyn Factors>) -> Self {
        Self {
            factors,
            pattern: None,
            values: Vec::new(),
            scaling: Equilibration::default(),
            probe: Vec::new(),
            product: Vec::new(),
            magnitude: 0.0,
            ready: false,
        }
    }

    /// Size of the factored matrix, once there is one.
    pub(super) fn size(&self) -> Option<usize> {
        self.pattern.as_ref().filter(|_| self.ready).map(|p| p.size())
    }

    /// Size of the factor, where the analysis tells.
    pub(super) fn size_of_factor(&self) -> Option<FactorSize> {
        self.factors.size()
    }

    /// Stored entries of the matrix.
    pub(super) fn entries(&self) -> usize {
        self.values.len()
    }

    /// `‖A‖∞` of the factored matrix.
    pub(super) fn magnitude(&self) -> f64 {
        self.magnitude
    }

    /// Analyses a pattern that is new.
    fn analyse(
        &mut self,
        pattern: &Arc<SparsePattern>,
        tangent: &dyn Tangent,
        counts: &mut LinearCounts,
    ) -> Result<(), LinearError> {
        if is_known(&self.pattern, pattern) {
            return Ok(());
        }
        self.pattern = None;
        let n = pattern.size();
        self.values.clear();
        self.values.resize(pattern.entries(), 0.0);
        self.scaling.resize(n);
        self.probe.resize(n, 0.0);
        self.product.resize(n, 0.0);
        counts.analyses += 1;
        if n > 0 {
            if let Some(row) = (0..n).find(|&row| pattern.row(row).is_empty()) {
                return Err(LinearError::Singular { unknown: Some(row) });
            }
            self.factors.analyse(pattern, tangent)?;
        }
        self.pattern = Some(Arc::clone(pattern));
        Ok(())
    }

    /// Judges the factor by one solve.
    fn probe(&mut self, pattern: &SparsePattern) -> Verdict {
        let matrix = norm_of_rows(pattern, &self.values);
        for (i, v) in self.probe.iter_mut().enumerate() {
            *v = scatter(i);
        }
        let right = max_norm(&self.probe);
        self.factors.solve(&mut self.probe);
        if first_not_finite(&self.probe).is_some() {
            return Verdict::Useless(LinearError::Singular { unknown: None });
        }
        let length = max_norm(&self.probe);
        let mut error = 0.0_f64;
        for row in 0..pattern.size() {
            let entries = self.values[pattern.stored(row)].iter().zip(pattern.row(row));
            let product: f64 = entries.map(|(a, &column)| a * self.probe[column]).sum();
            error = error.max((scatter(row) - product).abs());
        }
        let backward_error = error / (matrix * length + right);
        if !backward_error.is_finite() {
            return Verdict::Useless(LinearError::Singular { unknown: None });
        }
        if backward_error > REPAIRABLE {
            return Verdict::Useless(LinearError::Inaccurate { relative_residual: backward_error });
        }
        if backward_error > STABLE {
            return Verdict::Repairable;
        }
        if matrix * length > SUSPICIOUS * right {
            self.product.copy_from_slice(&self.probe);
            let scale = norm(&self.probe);
            self.product.iter_mut().for_each(|y| *y /= scale);
            self.factors.solve_transposed(&mut self.product);
            let inverse = norm(&self.product);
            // Not finite counts as singular, too.
            if misses(matrix * inverse, SINGULAR) {
                return Verdict::Singular { unknown: self.probe.iter().position(|y| y.abs() == length) };
            }
        }
        Verdict::Good
    }

    /// A pivot is told in the units of the matrix.
    fn unscaled(&self, error: LinearError) -> LinearError {
        match error {
            LinearError::NotPositiveDefinite { unknown: Some(unknown), value } => {
                let value = value / self.scaling.factor(unknown);
                LinearError::NotPositiveDefinite { unknown: Some(unknown), value }
            }
            other => other,
        }
    }

    /// Factors the scaled values, with more stable variants where the first one fails. The better
    /// variant stays if it was of use: the next matrix on this pattern is probably of the same kind.
    fn factor(&mut self, pattern: &SparsePattern, counts: &mut LinearCounts) -> Result<(), LinearError> {
        // The first variant that stumbles may know the unknown that the last one does not.
        let mut suspect = None;
        let error = loop {
            counts.factorisations += 1;
            let verdict = match self.factors.factor(pattern, &self.values) {
                Err(error) => Verdict::Useless(error),
                Ok(()) if self.factors.is_evidently_good() => Verdict::Good,
                Ok(()) => self.probe(pattern),
            };
            let error = match verdict {
                Verdict::Good => return Ok(()),
                // A factor that is accurate says so of the matrix, not of itself.
                Verdict::Singular { unknown } => break LinearError::Singular { unknown },
                Verdict::Repairable => None,
                Verdict::Useless(error) => Some(error),
            };
            if let Some(LinearError::Singular { unknown }) = error {
                suspect = suspect.or(unknown);
            }
            if !self.factors.fall_back(pattern)? {
                match error {
                    None => return Ok(()),
                    Some(error) => break error,
                }
            }
        };
        self.factors.restore();
        Err(match error {
            LinearError::Singular { unknown } => LinearError::Singular { unknown: unknown.or(suspect) },
            error => self.unscaled(error),
        })
    }
}

/// What a probe tells about a factor.
enum Verdict {
    /// Accurate.
    Good,
    /// Not accurate, but a preconditioner for iterative refinement.
    Repairable,
    /// Of no use; the error to report if there is no better variant.
    Useless(LinearError),
    /// Accurate, and the matrix is singular.
    Singular { unknown: Option<usize> },
}

impl ApproximateInverse for FactoredMatrix {
    fn name(&self) -> String {
        self.factors.name().to_owned()
    }

    fn prepare(&mut self, tangent: &dyn Tangent, counts: &mut LinearCounts) -> Result<(), LinearError> {
        self.ready = false;
        let pattern = tangent.pattern().ok_or_else(|| LinearError::NeedsEntries { solver: self.name() })?;
        if self.factors.needs_symmetry() && tangent.symmetry() == Symmetry::General {
            return Err(LinearError::NeedsSymmetry { solver: self.name() });
        }
        if pattern.size() != tangent.size() {
            return Err(LinearError::WrongLength { expected: tangent.size(), found: pattern.size() });
        }
        self.analyse(pattern, tangent, counts)?;
        tangent.fill(&mut self.values);
        check_entries(pattern, &self.values)?;
        self.magnitude = norm_of_rows(pattern, &self.values);
        if pattern.size() > 0 {
            self.scaling.scale(pattern, &mut self.values, self.factors.needs_symmetry())?;
            self.factor(pattern, counts)?;
        } else {
            counts.factorisations += 1;
        }
        self.ready = true;
        Ok(())
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        z.copy_from_slice(r);
        if !z.is_empty() {
            self.scaling.scale_right_hand_side(z);
            self.factors.solve(z);
            self.scaling.unscale_solution(z);
        }
    }

    fn fill(&self) -> usize {
        if self.values.is_empty() { 0 } else { self.factors.fill() }
    }

    fn save(&self) -> Snapshot {
        let mut saved = Snapshot::new();
        saved.put_counts("falls", &[self.factors.falls()]);
        saved
    }

    fn restore(&mut self, saved: &Snapshot, tangent: &dyn Tangent, age: OperatorAge) -> Result<(), RestoreError> {
        if age == OperatorAge::Older {
            return Ok(());
        }
        let mut counts = LinearCounts::default();
        if let Some(pattern) = tangent.pattern().filter(|pattern| pattern.size() > 0) {
            // The variant stays from matrix to matrix, and so decides the bits.
            self.analyse(pattern, tangent, &mut counts)?;
            for _ in 0..saved.count("falls")?.min(MOST_FALLS) {
                self.factors.fall_back(pattern)?;
            }
        }
        Ok(self.prepare(tangent, &mut counts)?)
    }
}

/// Refuses NaN and infinity among the entries.
pub(super) fn check_entries(pattern: &SparsePattern, values: &[f64]) -> Result<(), LinearError> {
    match first_not_finite(values) {
        Some(k) => {
            let row = pattern.offsets().partition_point(|&start| start <= k).saturating_sub(1);
            Err(LinearError::EntryNotFinite { row })
        }
        None => Ok(()),
    }
}

/// `‖A‖∞`, the largest sum of magnitudes of a row.
fn norm_of_rows(pattern: &SparsePattern, values: &[f64]) -> f64 {
    (0..pattern.size()).map(|row| values[pattern.stored(row)].iter().map(|v| v.abs()).sum()).fold(0.0, f64::max)
}

/// Entry `i` of the probe vector: fixed, without structure, of magnitude ½ to 1 (the mixing function of
/// Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators").
pub(super) fn scatter(i: usize) -> f64 {
    let mut bits = (i as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    #[expect(clippy::cast_precision_loss, reason = "53 bits fit")]
    let fraction = (bits >> 11) as f64 / (1_u64 << 53) as f64;
    let magnitude = 0.5 + 0.5 * fraction;
    if bits & 1 == 0 { magnitude } else { -magnitude }
}
