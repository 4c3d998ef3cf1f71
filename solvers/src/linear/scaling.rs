//! Equilibration before a direct factorisation: rows and columns are scaled by powers of two, so that
//! no entry is rounded and every row and column has its largest entry near one.
//!
//! Unknowns of different units (a velocity beside a volume ratio, say) put entries of many orders into
//! one matrix; thresholds on pivots and estimates of the condition mean something only after scaling.
//! Formulas: LAPACK Users' Guide, driver `DGESVX` (rows, then columns), and Ruiz (2001), "A scaling
//! algorithm to equilibrate both rows and columns norms in matrices", for the symmetric case.

use super::{LinearError, SparsePattern};

/// Scaling is left out if the row and column maxima agree within this factor (as in LAPACK).
const WELL_SCALED: f64 = 0.1;
/// Magnitudes beyond which squares may overflow; such a matrix is always scaled.
const MODERATE: std::ops::Range<f64> = 1e-100..1e100;
/// Passes of Ruiz' iteration; the maxima converge like `1 ± 2⁻ᵏ` in the exponent.
const SYMMETRIC_PASSES: usize = 4;

/// Diagonal scalings `R`, `C` of the factored matrix `R A C`.
#[derive(Debug, Default)]
pub(super) struct Equilibration {
    rows: Vec<f64>,
    columns: Vec<f64>,
    active: bool,
}

impl Equilibration {
    /// Room for a system of `n` unknowns.
    pub(super) fn resize(&mut self, n: usize) {
        self.rows.clear();
        self.rows.resize(n, 1.0);
        self.columns.clear();
        self.columns.resize(n, 1.0);
        self.active = false;
    }

    /// Replaces finite `values` of `A` by those of `R A C`; with `symmetric`, `R = C`.
    pub(super) fn scale(
        &mut self,
        pattern: &SparsePattern,
        values: &mut [f64],
        symmetric: bool,
    ) -> Result<(), LinearError> {
        self.rows.fill(1.0);
        self.columns.fill(1.0);
        // First the maxima of the unscaled matrix; they decide whether anything is to be done.
        let (mut row_max, mut column_max) = (std::mem::take(&mut self.rows), std::mem::take(&mut self.columns));
        maxima(pattern, values, &mut row_max, &mut column_max);
        let empty = row_max.iter().chain(&column_max).position(|&m| m == 0.0);
        let even = is_even(&row_max) && is_even(&column_max);
        (self.rows, self.columns) = (row_max, column_max);
        if let Some(index) = empty {
            return Err(LinearError::Singular { unknown: Some(index % pattern.size()) });
        }
        self.active = !even;
        if even {
            return Ok(());
        }
        if symmetric {
            self.scale_symmetric(pattern, values)
        } else {
            self.scale_general(pattern, values)
        }
        Ok(())
    }

    /// `R = 1 / max_j |a_ij|`, then `C = 1 / max_i |r_i a_ij|`.
    fn scale_general(&mut self, pattern: &SparsePattern, values: &mut [f64]) {
        self.rows.iter_mut().for_each(|m| *m = reciprocal(*m));
        self.columns.fill(0.0);
        for (row, &scale) in self.rows.iter().enumerate() {
            for (value, &column) in values[pattern.stored(row)].iter_mut().zip(pattern.row(row)) {
                *value *= scale;
                self.columns[column] = self.columns[column].max(value.abs());
            }
        }
        self.columns.iter_mut().for_each(|m| *m = reciprocal(*m));
        for (value, &column) in values.iter_mut().zip(pattern.columns()) {
            *value *= self.columns[column];
        }
    }

    /// `d_i ← d_i / √(max_j |d_i a_ij d_j|)`, a few times.
    fn scale_symmetric(&mut self, pattern: &SparsePattern, values: &mut [f64]) {
        self.columns.fill(1.0);
        for pass in 0..SYMMETRIC_PASSES {
            if pass > 0 {
                for (row, largest) in self.rows.iter_mut().enumerate() {
                    *largest = values[pattern.stored(row)].iter().fold(0.0, |m: f64, v| m.max(v.abs()));
                }
            }
            // The rows hold the maxima, then the factors of this pass.
            self.rows.iter_mut().for_each(|m| *m = reciprocal(m.sqrt()));
            for row in 0..pattern.size() {
                for (value, &column) in values[pattern.stored(row)].iter_mut().zip(pattern.row(row)) {
                    *value *= self.rows[row] * self.rows[column];
                }
            }
            for (total, factor) in self.columns.iter_mut().zip(&self.rows) {
                *total *= factor;
            }
        }
        self.rows.copy_from_slice(&self.columns);
    }

    /// `r_i c_i`, by which the diagonal entry (and the pivot) of an unknown was multiplied.
    pub(super) fn factor(&self, unknown: usize) -> f64 {
        if self.active { self.rows[unknown] * self.columns[unknown] } else { 1.0 }
    }

    /// `b ← R b`.
    pub(super) fn scale_right_hand_side(&self, b: &mut [f64]) {
        if self.active {
            b.iter_mut().zip(&self.rows).for_each(|(b, r)| *b *= r);
        }
    }

    /// `x ← C x`.
    pub(super) fn unscale_solution(&self, x: &mut [f64]) {
        if self.active {
            x.iter_mut().zip(&self.columns).for_each(|(x, c)| *x *= c);
        }
    }
}

/// Largest magnitudes of the rows and columns.
fn maxima(pattern: &SparsePattern, values: &[f64], rows: &mut [f64], columns: &mut [f64]) {
    columns.fill(0.0);
    for (row, largest) in rows.iter_mut().enumerate() {
        *largest = 0.0;
        for (value, &column) in values[pattern.stored(row)].iter().zip(pattern.row(row)) {
            *largest = largest.max(value.abs());
            columns[column] = columns[column].max(value.abs());
        }
    }
}

/// Whether positive maxima agree within the factor that needs no scaling.
fn is_even(maxima: &[f64]) -> bool {
    let (smallest, largest) = maxima.iter().fold((f64::INFINITY, 0.0_f64), |(s, l), &m| (s.min(m), l.max(m)));
    smallest >= WELL_SCALED * largest && MODERATE.contains(&largest)
}

/// The power of two nearest to `1 / x` in the exponent; `x > 0`.
fn reciprocal(x: f64) -> f64 {
    // Exponents are limited so that products of two factors stay finite and normal.
    let exponent = x.log2().round().clamp(-500.0, 500.0);
    #[expect(clippy::cast_possible_truncation, reason = "clamped to ±500 just above")]
    let exponent = exponent as i32;
    2.0_f64.powi(-exponent)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dense(n: usize) -> SparsePattern {
        SparsePattern::new((0..=n).map(|i| i * n).collect(), (0..n * n).map(|k| k % n).collect())
    }

    #[test]
    fn scaled_maxima_are_near_one() {
        let pattern = dense(3);
        for symmetric in [false, true] {
            let mut values = vec![1e9, 1e3, 1e-4, 1e3, 2e-2, 3e-7, 1e-4, 3e-7, 1e-14];
            let mut scaling = Equilibration::default();
            scaling.resize(3);
            scaling.scale(&pattern, &mut values, symmetric).expect("not singular");
            for row in values.chunks(3) {
                let largest = row.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                assert!((0.2..5.0).contains(&largest), "symmetric {symmetric}: {largest}");
            }
        }
    }

    #[test]
    fn an_even_matrix_is_left_alone_and_a_zero_row_named() {
        let pattern = dense(2);
        let mut scaling = Equilibration::default();
        scaling.resize(2);
        let mut values = vec![2.0, 1.0, 0.5, 3.0];
        scaling.scale(&pattern, &mut values, false).expect("not singular");
        assert_eq!(values, [2.0, 1.0, 0.5, 3.0]);
        let mut values = vec![2.0, 1.0, 0.0, 0.0];
        let error = scaling.scale(&pattern, &mut values, false).expect_err("zero row");
        assert_eq!(error, LinearError::Singular { unknown: Some(1) });
    }
}
