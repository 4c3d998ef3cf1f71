//! A dense linear solver, dense problems with counters, and numbers that carry their derivative.

use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nicolson_solvers::linear::{
    LinearCounts, LinearError, LinearReport, LinearSolver, LinearSolverInfo, SparsePattern, Symmetry, Tangent,
};
use nicolson_solvers::nonlinear::{Globalisation, NonlinearProblem};
use nicolson_solvers::vector::norm;
use nicolson_solvers::{EvaluationError, vector};

/// A number with one directional derivative and the size of the terms it was summed from.
#[derive(Debug, Clone, Copy)]
pub struct Dual {
    pub value: f64,
    pub slope: f64,
    pub size: f64,
}

pub fn constant(value: f64) -> Dual {
    Dual { value, slope: 0.0, size: value.abs() }
}

impl Dual {
    fn apply(self, value: f64, derivative: f64) -> Self {
        Self { value, slope: derivative * self.slope, size: value.abs() + derivative.abs() * self.size }
    }
    pub fn exp(self) -> Self {
        self.apply(self.value.exp(), self.value.exp())
    }
    pub fn ln(self) -> Self {
        self.apply(self.value.ln(), 1.0 / self.value)
    }
    pub fn sin(self) -> Self {
        self.apply(self.value.sin(), self.value.cos())
    }
    pub fn cos(self) -> Self {
        self.apply(self.value.cos(), -self.value.sin())
    }
    pub fn atan(self) -> Self {
        self.apply(self.value.atan(), 1.0 / (1.0 + self.value * self.value))
    }
    pub fn sqrt(self) -> Self {
        self.apply(self.value.sqrt(), 0.5 / self.value.sqrt())
    }
    pub fn cube(self) -> Self {
        self * self * self
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self { value: self.value + b.value, slope: self.slope + b.slope, size: self.size + b.size }
    }
}
impl Sub for Dual {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}
impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, slope: -self.slope, size: self.size }
    }
}
impl Mul for Dual {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self {
            value: self.value * b.value,
            slope: self.slope * b.value + self.value * b.slope,
            size: self.value.abs() * b.size + b.value.abs() * self.size,
        }
    }
}
impl Div for Dual {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let value = self.value / b.value;
        Self {
            value,
            slope: (self.slope - value * b.slope) / b.value,
            size: (self.size + value.abs() * b.size) / b.value.abs(),
        }
    }
}
impl Add<f64> for Dual {
    type Output = Self;
    fn add(self, b: f64) -> Self {
        self + constant(b)
    }
}
impl Sub<f64> for Dual {
    type Output = Self;
    fn sub(self, b: f64) -> Self {
        self - constant(b)
    }
}
impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, b: f64) -> Self {
        self * constant(b)
    }
}
impl Div<f64> for Dual {
    type Output = Self;
    fn div(self, b: f64) -> Self {
        self / constant(b)
    }
}

/// A dense matrix as a tangent with entries, or without.
pub struct DenseTangent {
    pub size: usize,
    pub entries: Vec<f64>,
    pub symmetry: Symmetry,
    pattern: Option<Arc<SparsePattern>>,
}

impl DenseTangent {
    pub fn new(size: usize) -> Self {
        let offsets = (0..=size).map(|row| row * size).collect();
        let columns = (0..size * size).map(|entry| entry % size).collect();
        let pattern = Some(Arc::new(SparsePattern::new(offsets, columns)));
        Self { size, entries: vec![0.0; size * size], symmetry: Symmetry::General, pattern }
    }

    pub fn without_entries(mut self) -> Self {
        self.pattern = None;
        self
    }
}

impl Tangent for DenseTangent {
    fn size(&self) -> usize {
        self.size
    }
    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }
    fn apply(&self, v: &[f64], out: &mut [f64]) {
        for (row, out) in self.entries.chunks(self.size).zip(out) {
            *out = vector::dot(row, v);
        }
    }
    fn pattern(&self) -> Option<&Arc<SparsePattern>> {
        self.pattern.as_ref()
    }
    fn fill(&self, values: &mut [f64]) {
        values.copy_from_slice(&self.entries);
    }
}

type Function = Box<dyn Fn(&[Dual]) -> Vec<Dual>>;
type Domain = Box<dyn Fn(&[f64]) -> Result<(), EvaluationError>>;
type Potential = Box<dyn Fn(&[f64]) -> f64>;

/// Equations written with [`Dual`] numbers.
pub struct Equations {
    pub function: Function,
    pub domain: Domain,
    pub potential: Option<Potential>,
    pub key: Option<u64>,
    pub tangent: DenseTangent,
    pub residuals: usize,
    pub linearisations: usize,
    pub last_residual_at: Vec<f64>,
    /// The residual evaluation with this number fails.
    pub fault_at: Option<usize>,
    /// All residual evaluations from this number on hold NaN.
    pub nan_from: Option<usize>,
    /// Factor that spoils the tangent.
    pub tangent_factor: f64,
}

impl Equations {
    pub fn new(unknowns: usize, function: impl Fn(&[Dual]) -> Vec<Dual> + 'static) -> Self {
        Self {
            function: Box::new(function),
            domain: Box::new(|_| Ok(())),
            potential: None,
            key: None,
            tangent: DenseTangent::new(unknowns),
            residuals: 0,
            linearisations: 0,
            last_residual_at: Vec::new(),
            fault_at: None,
            nan_from: None,
            tangent_factor: 1.0,
        }
    }

    pub fn inside(mut self, domain: impl Fn(&[f64]) -> Result<(), EvaluationError> + 'static) -> Self {
        self.domain = Box::new(domain);
        self
    }

    pub fn with_potential(mut self, potential: impl Fn(&[f64]) -> f64 + 'static) -> Self {
        self.potential = Some(Box::new(potential));
        self
    }
}

impl NonlinearProblem for Equations {
    fn unknowns(&self) -> usize {
        self.tangent.size
    }

    fn residual(&mut self, y: &[f64], out: &mut [f64]) -> Result<f64, EvaluationError> {
        self.residuals += 1;
        self.last_residual_at = y.to_vec();
        if self.fault_at == Some(self.residuals) {
            return Err(EvaluationError::outside_domain("injected fault", self.residuals, 0.0));
        }
        (self.domain)(y)?;
        let x: Vec<Dual> = y.iter().map(|&y| constant(y)).collect();
        let values = (self.function)(&x);
        for (out, value) in out.iter_mut().zip(&values) {
            *out = value.value;
        }
        if self.nan_from.is_some_and(|from| self.residuals >= from) {
            out[0] = f64::NAN;
        }
        let sizes: Vec<f64> = values.iter().map(|value| value.size).collect();
        Ok(norm(&sizes))
    }

    fn linearise(&mut self, y: &[f64]) -> Result<(), EvaluationError> {
        self.linearisations += 1;
        let n = y.len();
        for column in 0..n {
            let x: Vec<Dual> = y
                .iter()
                .enumerate()
                .map(|(i, &value)| Dual { slope: f64::from(u8::from(i == column)), ..constant(value) })
                .collect();
            for (row, value) in (self.function)(&x).iter().enumerate() {
                self.tangent.entries[row * n + column] = self.tangent_factor * value.slope;
            }
        }
        Ok(())
    }

    fn tangent(&self) -> &dyn Tangent {
        &self.tangent
    }

    fn constant_tangent(&self) -> Option<u64> {
        self.key
    }

    fn potential(&mut self, y: &[f64]) -> Option<Result<f64, EvaluationError>> {
        self.potential.as_ref().map(|potential| (self.domain)(y).map(|()| potential(y)))
    }

    fn describe(&self, unknown: usize) -> String {
        format!("component {unknown}")
    }
}

/// Gaussian elimination with partial pivoting and refinement against the present operator.
#[derive(Default)]
pub struct DenseLu {
    size: usize,
    factor: Vec<f64>,
    order: Vec<usize>,
    counts: LinearCounts,
    shared: Option<Arc<AtomicUsize>>,
}

impl DenseLu {
    /// Also counts its factorisations outside.
    pub fn counting(factorisations: Arc<AtomicUsize>) -> Self {
        Self { shared: Some(factorisations), ..Self::default() }
    }

    fn back_substitute(&self, b: &[f64]) -> Vec<f64> {
        let n = self.size;
        let mut x: Vec<f64> = self.order.iter().map(|&row| b[row]).collect();
        for row in 0..n {
            for column in 0..row {
                x[row] -= self.factor[row * n + column] * x[column];
            }
        }
        for row in (0..n).rev() {
            for column in row + 1..n {
                x[row] -= self.factor[row * n + column] * x[column];
            }
            x[row] /= self.factor[row * n + row];
        }
        x
    }
}

impl LinearSolver for DenseLu {
    fn info(&self) -> LinearSolverInfo {
        LinearSolverInfo {
            name: "dense LU".into(),
            unknowns: self.size,
            entries: self.factor.len(),
            fill: self.factor.len(),
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
        if let Some(shared) = &self.shared {
            shared.fetch_add(1, Ordering::Relaxed);
        }
        self.size = n;
        self.factor = vec![0.0; n * n];
        let (mut unit, mut image) = (vec![0.0; n], vec![0.0; n]);
        for column in 0..n {
            unit[column] = 1.0;
            tangent.apply(&unit, &mut image);
            unit[column] = 0.0;
            for (row, entry) in image.iter().enumerate() {
                self.factor[row * n + column] = *entry;
            }
        }
        if let Some(entry) = self.factor.iter().position(|entry| !entry.is_finite()) {
            return Err(LinearError::EntryNotFinite { row: entry / n });
        }
        self.order = (0..n).collect();
        for k in 0..n {
            let pivot = (k..n).max_by(|&a, &b| {
                let magnitude = |row: usize| self.factor[row * n + k].abs();
                magnitude(a).total_cmp(&magnitude(b))
            });
            let pivot = pivot.expect("a row is left");
            if self.factor[pivot * n + k] == 0.0 {
                return Err(LinearError::Singular { unknown: Some(k) });
            }
            self.order.swap(k, pivot);
            for column in 0..n {
                self.factor.swap(k * n + column, pivot * n + column);
            }
            for row in k + 1..n {
                let multiplier = self.factor[row * n + k] / self.factor[k * n + k];
                self.factor[row * n + k] = multiplier;
                for column in k + 1..n {
                    self.factor[row * n + column] -= multiplier * self.factor[k * n + column];
                }
            }
        }
        Ok(())
    }

    fn solve(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        self.counts.solves += 1;
        let mut residual = b.to_vec();
        x.fill(0.0);
        let mut image = vec![0.0; b.len()];
        for iterations in 0..20 {
            vector::axpy(1.0, &self.back_substitute(&residual), x);
            tangent.apply(x, &mut image);
            for ((residual, b), image) in residual.iter_mut().zip(b).zip(&image) {
                *residual = b - image;
            }
            let relative_residual = norm(&residual) / norm(b);
            if relative_residual <= tolerance {
                return Ok(LinearReport { iterations, relative_residual });
            }
        }
        Err(LinearError::Inaccurate { relative_residual: norm(&residual) / norm(b) })
    }
}

/// What is wrong with a [`Faulty`] solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// Every preparation fails.
    Prepare,
    /// The solve with this number fails.
    Solve(usize),
    /// Every solve fails like a Krylov method that stagnates.
    Stagnates,
    /// Every solve claims success and returns NaN.
    NotANumber,
    /// None, but every system is solved to the tolerance and no further.
    Inexact,
}

/// A dense solver with a fault.
pub struct Faulty {
    inner: DenseLu,
    fault: Fault,
}

impl Faulty {
    pub fn new(fault: Fault) -> Self {
        Self { inner: DenseLu::default(), fault }
    }
}

impl LinearSolver for Faulty {
    fn info(&self) -> LinearSolverInfo {
        self.inner.info()
    }

    fn counts(&self) -> LinearCounts {
        self.inner.counts()
    }

    fn prepare(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        if self.fault == Fault::Prepare {
            return Err(LinearError::Singular { unknown: Some(1) });
        }
        self.inner.prepare(tangent)
    }

    fn solve(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        let report = self.inner.solve(tangent, b, x, tolerance)?;
        match self.fault {
            Fault::Solve(number) if self.inner.counts.solves == number => {
                Err(LinearError::Breakdown { iterations: 3, relative_residual: 0.5 })
            }
            Fault::Stagnates => Err(LinearError::IterationLimit { iterations: 500, relative_residual: 0.3 }),
            Fault::NotANumber => {
                x[0] = f64::NAN;
                Ok(report)
            }
            Fault::Inexact => {
                // A x = (1 − η) b has the relative residual η.
                for x in x.iter_mut() {
                    *x *= 1.0 - tolerance;
                }
                Ok(LinearReport { iterations: 7, relative_residual: tolerance })
            }
            _ => Ok(report),
        }
    }
}

/// Every globalisation there is.
pub fn globalisations() -> [Globalisation; 5] {
    [
        Globalisation::None,
        Globalisation::Backtracking,
        Globalisation::MoreThuente,
        Globalisation::HagerZhang,
        Globalisation::TrustRegion { initial_radius: None },
    ]
}

/// `ln x = 0`, defined for positive `x`.
pub fn logarithm() -> Equations {
    Equations::new(1, |x| vec![x[0].ln()]).inside(|y| {
        if y[0] > 0.0 { Ok(()) } else { Err(EvaluationError::outside_domain("argument of the logarithm", 0, y[0])) }
    })
}
