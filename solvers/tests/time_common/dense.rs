//! Gaussian elimination with partial pivoting behind the seam of linear solvers.

use nicolson_solvers::linear::{LinearCounts, LinearError, LinearReport, LinearSolver, LinearSolverInfo, Tangent};

pub struct DenseTangent {
    size: usize,
    entries: Vec<f64>,
}

impl DenseTangent {
    pub fn zeros(size: usize) -> Self {
        Self::new(size, vec![0.0; size * size])
    }

    pub fn new(size: usize, entries: Vec<f64>) -> Self {
        assert_eq!(entries.len(), size * size);
        Self { size, entries }
    }
}

impl Tangent for DenseTangent {
    fn size(&self) -> usize {
        self.size
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        for (out, row) in out.iter_mut().zip(self.entries.chunks(self.size)) {
            *out = row.iter().zip(v).map(|(a, v)| a * v).sum();
        }
    }
}

/// Reads the matrix column by column through its action, and eliminates anew for every right-hand side.
#[derive(Default)]
pub struct DenseSolver {
    matrix: Vec<f64>,
    counts: LinearCounts,
}

impl LinearSolver for DenseSolver {
    fn info(&self) -> LinearSolverInfo {
        let unknowns = self.matrix.len().isqrt();
        let entries = self.matrix.len();
        LinearSolverInfo {
            name: "dense elimination".into(),
            unknowns,
            entries,
            fill: entries,
            threads: 1,
            reason: String::new(),
        }
    }

    fn counts(&self) -> LinearCounts {
        self.counts
    }

    fn prepare(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        let n = tangent.size();
        self.counts.factorisations += 1;
        self.matrix = vec![0.0; n * n];
        let (mut unit, mut column) = (vec![0.0; n], vec![0.0; n]);
        for j in 0..n {
            unit[j] = 1.0;
            tangent.apply(&unit, &mut column);
            unit[j] = 0.0;
            for (i, entry) in column.iter().enumerate() {
                self.matrix[i * n + j] = *entry;
            }
        }
        match self.matrix.iter().position(|a| !a.is_finite()) {
            Some(k) => Err(LinearError::EntryNotFinite { row: k / n }),
            None => Ok(()),
        }
    }

    fn solve(
        &mut self,
        _tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        _tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        let n = b.len();
        let mut a = self.matrix.clone();
        if a.len() != n * n {
            return Err(LinearError::NotPrepared);
        }
        self.counts.solves += 1;
        x.copy_from_slice(b);
        for k in 0..n {
            let pivot = (k..n).max_by(|&i, &j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs())).unwrap_or(k);
            if a[pivot * n + k] == 0.0 {
                return Err(LinearError::Singular { unknown: Some(k) });
            }
            for j in 0..n {
                a.swap(k * n + j, pivot * n + j);
            }
            x.swap(k, pivot);
            for i in k + 1..n {
                let factor = a[i * n + k] / a[k * n + k];
                for j in k..n {
                    a[i * n + j] -= factor * a[k * n + j];
                }
                x[i] -= factor * x[k];
            }
        }
        for k in (0..n).rev() {
            let known: f64 = (k + 1..n).map(|j| a[k * n + j] * x[j]).sum();
            x[k] = (x[k] - known) / a[k * n + k];
        }
        Ok(LinearReport { iterations: 0, relative_residual: 0.0 })
    }
}
