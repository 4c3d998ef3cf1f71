//! Matrices and operators for the tests of the linear solvers.

#![allow(dead_code, reason = "every test program uses its own part")]

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nicolson_solvers::linear::{
    AutomaticOptions, Effort, EliminationOrder, KrylovOptions, LinearSolverChoice, Places, Preconditioner,
    PreconditionerMatrix, SparsePattern, Symmetry, Tangent,
};
use nicolson_solvers::vector::norm;

/// A matrix with everything a tangent may offer.
#[derive(Clone)]
pub struct Matrix {
    pub pattern: Arc<SparsePattern>,
    pub values: Vec<f64>,
    pub symmetry: Symmetry,
    pub blocks: Vec<usize>,
    pub sparser: Option<Box<Matrix>>,
    pub matrix_free: bool,
    pub places: Option<Places>,
    pub effort: Option<Effort>,
    /// Products taken.
    pub products: Arc<AtomicUsize>,
}

impl Matrix {
    /// A matrix from its entries; those given twice are added.
    pub fn new(n: usize, symmetry: Symmetry, entries: impl IntoIterator<Item = (usize, usize, f64)>) -> Self {
        let mut rows = vec![BTreeMap::new(); n];
        for (row, column, value) in entries {
            *rows[row].entry(column).or_insert(0.0) += value;
        }
        let mut offsets = vec![0];
        for row in &rows {
            offsets.push(offsets[offsets.len() - 1] + row.len());
        }
        let columns = rows.iter().flat_map(|row| row.keys().copied()).collect();
        let values = rows.iter().flat_map(|row| row.values().copied()).collect();
        let pattern = Arc::new(SparsePattern::new(offsets, columns));
        Self {
            pattern,
            values,
            symmetry,
            blocks: Vec::new(),
            sparser: None,
            matrix_free: false,
            places: None,
            effort: None,
            products: Arc::default(),
        }
    }

    /// A dense matrix by rows.
    pub fn dense(symmetry: Symmetry, rows: &[&[f64]]) -> Self {
        let entries =
            rows.iter().enumerate().flat_map(|(i, row)| row.iter().enumerate().map(move |(j, &value)| (i, j, value)));
        Self::new(rows.len(), symmetry, entries)
    }

    /// The same pattern with other values of `(row, column, value)`.
    pub fn map(&self, f: impl Fn(usize, usize, f64) -> f64) -> Self {
        let mut other = self.clone();
        for row in 0..self.pattern.size() {
            for k in self.pattern.offsets()[row]..self.pattern.offsets()[row + 1] {
                other.values[k] = f(row, self.pattern.columns()[k], self.values[k]);
            }
        }
        other
    }

    /// Withholds the entries.
    pub fn without_entries(mut self) -> Self {
        self.matrix_free = true;
        self
    }

    /// Offers the entries that pass as the sparser operator.
    pub fn with_sparser(mut self, keep: impl Fn(usize, usize) -> bool) -> Self {
        let mut entries = Vec::new();
        for row in 0..self.pattern.size() {
            for k in self.pattern.offsets()[row]..self.pattern.offsets()[row + 1] {
                let column = self.pattern.columns()[k];
                if keep(row, column) {
                    entries.push((row, column, self.values[k]));
                }
            }
        }
        let mut sparser = Self::new(self.pattern.size(), self.symmetry, entries);
        sparser.blocks.clone_from(&self.blocks);
        self.sparser = Some(Box::new(sparser));
        self
    }

    /// `‖b − A x‖ / ‖b‖`, computed here.
    pub fn relative_residual(&self, b: &[f64], x: &[f64]) -> f64 {
        let mut product = vec![0.0; b.len()];
        self.apply(x, &mut product);
        let difference: Vec<f64> = b.iter().zip(&product).map(|(b, p)| b - p).collect();
        norm(&difference) / norm(b)
    }
}

impl Tangent for Matrix {
    fn size(&self) -> usize {
        self.pattern.size()
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        self.products.fetch_add(1, Ordering::Relaxed);
        for (row, out) in out.iter_mut().enumerate() {
            let start = self.pattern.offsets()[row];
            *out = self.pattern.row(row).iter().enumerate().map(|(k, &c)| self.values[start + k] * v[c]).sum();
        }
    }

    fn pattern(&self) -> Option<&Arc<SparsePattern>> {
        (!self.matrix_free).then_some(&self.pattern)
    }

    fn fill(&self, values: &mut [f64]) {
        values.copy_from_slice(&self.values);
    }

    fn blocks(&self) -> &[usize] {
        &self.blocks
    }

    fn places(&self) -> Option<Places> {
        self.places.clone()
    }

    fn effort(&self) -> Option<Effort> {
        self.effort
    }

    fn sparser(&self) -> Option<&dyn Tangent> {
        self.sparser.as_ref().map(|m| &**m as &dyn Tangent)
    }
}

/// A repeatable number in [−1, 1] (linear congruences; Knuth).
pub fn scatter(seed: u64) -> f64 {
    let mut state = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    state ^= state >> 33;
    state = state.wrapping_mul(0xff51_afd7_ed55_8ccd);
    state ^= state >> 33;
    (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// A right-hand side of magnitude one.
pub fn right_hand_side(n: usize) -> Vec<f64> {
    (0..n).map(|i| scatter(i as u64 + 77)).collect()
}

/// Two unknowns at each node of an `m × m` grid, coupled to all nodes within `reach` (the two-ring
/// stencil of particles): a symmetric stiffness that vanishes with the distance, plus `shift` on the
/// diagonal, plus a skew part for `skew > 0`.
pub fn grid(m: usize, reach: f64, shift: f64, skew: f64) -> Matrix {
    let mut entries = Vec::new();
    let radius = reach.floor() as isize;
    for node in 0..m * m {
        let (i, j) = ((node / m) as isize, (node % m) as isize);
        for (di, dj) in (-radius..=radius).flat_map(|di| (-radius..=radius).map(move |dj| (di, dj))) {
            let (oi, oj) = (i + di, j + dj);
            let distance = ((di * di + dj * dj) as f64).sqrt();
            let inside = (0..m as isize).contains(&oi) && (0..m as isize).contains(&oj);
            if distance == 0.0 || distance > reach || !inside {
                continue;
            }
            let other = (oi as usize) * m + oj as usize;
            let direction = [di as f64 / distance, dj as f64 / distance];
            let stiffness = (1.0 - distance / (reach + 1.0)).powi(2);
            for a in 0..2 {
                for b in 0..2 {
                    // A spring along the pair with a little resistance across it.
                    let unit = if a == b { 0.3 } else { 0.0 };
                    let k = stiffness * (direction[a] * direction[b] + unit);
                    let sign = if node < other { 1.0 } else { -1.0 };
                    entries.push((2 * node + a, 2 * other + b, -k + skew * sign * stiffness));
                    entries.push((2 * node + a, 2 * node + b, k));
                }
            }
        }
        for a in 0..2 {
            entries.push((2 * node + a, 2 * node + a, shift));
        }
    }
    let symmetry = match () {
        () if skew != 0.0 => Symmetry::General,
        () if shift >= 0.0 => Symmetry::PositiveDefinite,
        () => Symmetry::Symmetric,
    };
    let mut matrix = Matrix::new(2 * m * m, symmetry, entries);
    matrix.blocks = (0..=m * m).map(|i| 2 * i).collect();
    let coordinates = (0..m * m).flat_map(|node| [(node / m) as f64, (node % m) as f64]).collect();
    matrix.places = Some(Places { dimension: 2, coordinates });
    matrix
}

/// Every preconditioner.
pub fn preconditioners() -> Vec<Preconditioner> {
    let order = EliminationOrder::default;
    vec![
        Preconditioner::None,
        Preconditioner::Jacobi,
        Preconditioner::BlockJacobi,
        Preconditioner::Ilu0,
        Preconditioner::ilut(),
        Preconditioner::Lu,
        Preconditioner::Ldlt { order: order() },
        Preconditioner::Cholesky { order: order() },
    ]
}

/// Every Krylov method with the settings.
pub fn krylov_methods(krylov: &KrylovOptions) -> Vec<LinearSolverChoice> {
    let all = vec![
        LinearSolverChoice::Gmres { restart: 40, krylov: krylov.clone() },
        LinearSolverChoice::BiCgStab { krylov: krylov.clone() },
        LinearSolverChoice::Cg { krylov: krylov.clone() },
        LinearSolverChoice::Minres { krylov: krylov.clone() },
    ];
    all.into_iter().filter(|choice| choice.validate().is_ok()).collect()
}

/// The direct solvers.
pub fn direct_solvers() -> Vec<LinearSolverChoice> {
    vec![LinearSolverChoice::Lu, LinearSolverChoice::ldlt(), LinearSolverChoice::cholesky()]
}

/// Every solver × preconditioner.
pub fn all_solvers() -> Vec<LinearSolverChoice> {
    let mut all = direct_solvers();
    all.push(LinearSolverChoice::automatic());
    all.push(LinearSolverChoice::Automatic(AutomaticOptions { direct: true, ..Default::default() }));
    for preconditioner in preconditioners() {
        all.extend(krylov_methods(&KrylovOptions { preconditioner, ..Default::default() }));
    }
    let symmetric_part = KrylovOptions {
        preconditioner: Preconditioner::Ldlt { order: EliminationOrder::default() },
        preconditioner_matrix: PreconditionerMatrix::SymmetricPart,
        ..Default::default()
    };
    let symmetric_only = |choice: &LinearSolverChoice| {
        matches!(choice, LinearSolverChoice::Cg { .. } | LinearSolverChoice::Minres { .. })
    };
    all.extend(krylov_methods(&symmetric_part).into_iter().filter(|choice| !symmetric_only(choice)));
    all
}

/// Whether a solver, or its preconditioner, works on symmetric matrices only.
pub fn needs_symmetry(choice: &LinearSolverChoice) -> bool {
    let text = format!("{choice:?}");
    if text.contains("SymmetricPart") {
        return false;
    }
    let method = matches!(choice, LinearSolverChoice::Cg { .. } | LinearSolverChoice::Minres { .. });
    method || text.contains("Ldlt") || text.contains("Cholesky")
}

/// Whether a solver works on positive definite matrices only.
pub fn needs_definiteness(choice: &LinearSolverChoice) -> bool {
    matches!(choice, LinearSolverChoice::Cg { .. }) || format!("{choice:?}").contains("Cholesky")
}
