//! The conditions on the weights `Q_ab = V_a g_ab`, and the space of changes that answers them.
//!
//! Per particle there are two sides with `1 + D` conditions each: its row `Q_ab` (gradients) and its
//! column `Q_ba` (forces). With `d_ab = (X_b − X_a)/s` and `s` the spacing,
//!
//! ```text
//! row:     Σ_b Q_ab = 0        Σ_b Q_ab ⊗ d_ab = V_a I / s
//! column:  Σ_b Q_ba = e(a)     Σ_b Q_ba ⊗ d_ab = (m(a) − V_a I) / s     (the second not at edges)
//! ```
//!
//! which is `Q X_J = V δ_IJ` and `Qᵀ X_J = Σ_f a_f N_f r_f X_f,J − V δ_IJ` seen from the particle, so
//! that no digits are lost far from the origin. The change of least norm is the transposed conditions
//! applied to multipliers `λ` (rows) and `μ` (columns): `ΔQ_ab = λ_a·(1, d_ab) + μ_b·(1, d_ba)`.

use std::ops::Range;

use rayon::prelude::*;

use super::super::{DiscretisationError, Neighbourhood};
use super::boundary::Boundary;
use crate::setup::{Body, Particles};
use crate::tensor::{Tensor, Vector, outer};

/// Relative residual that weights must reach; particles that meet it already need no change.
const EXACT: f64 = 1e-12;
/// The same where positions allow no better: in units of their rounding over the spacing.
const ROUNDINGS: f64 = 32.0;

/// One side of one particle for all directions at once: residuals or multipliers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side<const D: usize> {
    /// The part of `1`, one component per direction.
    pub constant: Vector<D>,
    /// The part of `d`; rows are directions.
    pub linear: Tensor<D>,
}

impl<const D: usize> Side<D> {
    /// Nothing.
    pub fn zero() -> Self {
        Self { constant: Vector::zeros(), linear: Tensor::zeros() }
    }

    /// Largest magnitude; NaN if any number is.
    pub fn largest(&self) -> f64 {
        let numbers = self.constant.iter().chain(self.linear.iter());
        numbers.fold(0.0, |m: f64, x| if x.is_nan() || m.is_nan() { f64::NAN } else { m.max(x.abs()) })
    }

    /// Component `j` of `(1, d)` in one direction.
    pub fn component(&self, direction: usize, j: usize) -> f64 {
        if j == 0 { self.constant[direction] } else { self.linear[(direction, j - 1)] }
    }

    /// Sets what [`component`](Self::component) reads.
    pub fn set(&mut self, direction: usize, j: usize, value: f64) {
        if j == 0 {
            self.constant[direction] = value;
        } else {
            self.linear[(direction, j - 1)] = value;
        }
    }
}

/// The conditions of one body. Particles and entries count from the first of the body.
pub(super) struct Constraints<'a, const D: usize> {
    neighbourhood: &'a Neighbourhood,
    particles: &'a Particles<D>,
    boundary: Boundary<D>,
    first: usize,
    first_entry: usize,
    count: usize,
    spacing: f64,
}

impl<'a, const D: usize> Constraints<'a, D> {
    /// The conditions that the faces of a body make.
    ///
    /// # Errors
    /// If the boundary is unsuited: see [`Boundary::new`].
    pub fn new(
        body: &Body,
        particles: &'a Particles<D>,
        neighbourhood: &'a Neighbourhood,
    ) -> Result<Self, DiscretisationError> {
        let boundary = Boundary::new(body, particles, neighbourhood)?;
        let first = body.particles.start;
        let first_entry = neighbourhood.row(first).start;
        Ok(Self {
            neighbourhood,
            particles,
            boundary,
            first,
            first_entry,
            count: body.particles.len(),
            spacing: body.spacing,
        })
    }

    /// Number of particles.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Entries of the row of a particle.
    pub fn row(&self, a: usize) -> Range<usize> {
        let row = self.neighbourhood.row(a + self.first);
        row.start - self.first_entry..row.end - self.first_entry
    }

    /// The particle at the other end of an entry.
    pub fn neighbour(&self, entry: usize) -> usize {
        self.neighbourhood.neighbour(entry + self.first_entry) - self.first
    }

    /// Reference position of a particle.
    pub fn position(&self, a: usize) -> Vector<D> {
        self.particles.positions[a + self.first]
    }

    /// `d_ab`.
    pub fn distance(&self, a: usize, b: usize) -> Vector<D> {
        (self.position(b) - self.position(a)) / self.spacing
    }

    /// Whether the column has its linear conditions.
    pub fn has_linear_column(&self, a: usize) -> bool {
        !self.boundary.edges[a]
    }

    /// Magnitude of the conditions: the largest face of a particle, m^(D−1).
    pub fn scale(&self) -> f64 {
        let volumes = &self.particles.volumes[self.first..self.first + self.count];
        volumes.iter().fold(0.0, |m: f64, volume| m.max(*volume)) / self.spacing
    }

    /// Residual up to which the conditions hold: a fixed part of their magnitude, or what the rounding of
    /// the positions leaves undetermined (a lattice of 1000 spacings has distances to 13 digits).
    pub fn tolerance(&self) -> f64 {
        let positions = &self.particles.positions[self.first..self.first + self.count];
        let farthest = positions.iter().fold(0.0, |m: f64, x| m.max(x.amax()));
        self.scale() * EXACT.max(ROUNDINGS * f64::EPSILON * farthest / self.spacing)
    }

    /// What row and column of every particle lack.
    pub fn residuals(&self, weights: &[Vector<D>]) -> Vec<[Side<D>; 2]> {
        let residual = |a: usize| {
            let volume = Tensor::identity() * self.particles.volumes[a + self.first];
            let wanted = [
                Side { constant: Vector::zeros(), linear: volume / self.spacing },
                Side { constant: self.boundary.areas[a], linear: (self.boundary.moments[a] - volume) / self.spacing },
            ];
            self.minus_sums(a, weights, wanted)
        };
        (0..self.count).into_par_iter().map(residual).collect()
    }

    /// What changes of the weights add to the sums of every row and column.
    pub fn effects(&self, changes: &[Vector<D>]) -> Vec<[Side<D>; 2]> {
        let effect = |a: usize| {
            self.minus_sums(a, changes, [Side::zero(); 2])
                .map(|side| Side { constant: -side.constant, linear: -side.linear })
        };
        (0..self.count).into_par_iter().map(effect).collect()
    }

    /// `wanted` minus the sums of a row and a column.
    fn minus_sums(&self, a: usize, weights: &[Vector<D>], wanted: [Side<D>; 2]) -> [Side<D>; 2] {
        let [mut row, mut column] = wanted;
        for entry in self.row(a) {
            let distance = self.distance(a, self.neighbour(entry));
            let twin = self.neighbourhood.twin(entry + self.first_entry) - self.first_entry;
            row.constant -= weights[entry];
            row.linear -= outer(&weights[entry], &distance);
            column.constant -= weights[twin];
            column.linear -= outer(&weights[twin], &distance);
        }
        if !self.has_linear_column(a) {
            column.linear = Tensor::zeros();
        }
        [row, column]
    }

    /// `ΔQ_ab` of multipliers per particle.
    pub fn change(&self, a: usize, entry: usize, multipliers: &[[Side<D>; 2]]) -> Vector<D> {
        let b = self.neighbour(entry);
        let distance = self.distance(a, b);
        let ([row, _], [_, column]) = (&multipliers[a], &multipliers[b]);
        row.constant + row.linear * distance + column.constant - column.linear * distance
    }
}
