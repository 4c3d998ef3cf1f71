//! The gradient operator: neighbour lists, weights `g_ab`, and nothing else.

use std::time::Instant;

use rayon::prelude::*;

use super::{BalanceReport, DiscretisationError, KernelCorrection, Neighbourhood, balance};
use crate::kernel;
use crate::setup::{Body, Particles, WeightChoice};
use crate::tensor::{Tensor, Vector, outer};

/// Gradient weights of all particles on their neighbour lists.
#[derive(Debug, Clone)]
pub struct Gradient<const D: usize> {
    /// Who interacts with whom.
    pub neighbourhood: Neighbourhood,
    /// `g_ab` for every entry, 1/m.
    pub weights: Vec<Vector<D>>,
    /// What balancing did, for every body that asked for it.
    pub balance: Vec<BalanceReport>,
}

impl<const D: usize> Gradient<D> {
    /// Builds the operator of all bodies by the origin of weights that each one names.
    ///
    /// # Errors
    /// A located [`DiscretisationError`] for a particle whose neighbours are too few or degenerate,
    /// or where balanced weights do not exist.
    pub fn build(bodies: &[Body], particles: &Particles<D>) -> Result<Self, DiscretisationError> {
        let reach: Vec<_> = bodies
            .iter()
            .map(|body| (body.particles.clone(), kernel::support(body.kernel) * body.smoothing * body.spacing))
            .collect();
        let positions = &particles.positions;
        // Diagonals of bent cells may be longer than the support: with a kernel of zero, but neighbours all the same.
        let cells = bodies
            .iter()
            .filter(|body| matches!(body.weights, WeightChoice::Cells | WeightChoice::Auto))
            .flat_map(|body| balance::cells_of_body(body, particles));
        let neighbourhood = Neighbourhood::search(positions, &reach, cells);
        let mut weights = Vec::with_capacity(neighbourhood.pairs());
        for body in bodies {
            let kernel_volumes = match body.weights {
                WeightChoice::Single => &particles.volumes,
                _ => &particles.kernel_volumes,
            };
            let correction = KernelCorrection {
                kernel: body.kernel,
                smoothing_length: body.smoothing * body.spacing,
                kernel_volumes,
            };
            let rows: Vec<Vec<Vector<D>>> = body
                .particles
                .clone()
                .into_par_iter()
                .map(|a| correction.row(a, positions, &neighbourhood))
                .collect::<Result<_, _>>()?;
            weights.extend(rows.into_iter().flatten());
        }
        let mut gradient = Self { neighbourhood, weights, balance: Vec::new() };
        for body in bodies {
            let limit = match body.weights {
                WeightChoice::Single | WeightChoice::Separate => continue,
                WeightChoice::Balanced => balance::Effort::Least,
                WeightChoice::Cells => balance::Effort::Cells,
                WeightChoice::Auto => balance::Effort::Cheap,
            };
            let start = Instant::now();
            let report = match balance::balance(&mut gradient, body, particles, limit) {
                Ok(cost) => BalanceReport { seconds: start.elapsed().as_secs_f64(), ..cost },
                Err(error) if body.weights == WeightChoice::Auto => {
                    let seconds = start.elapsed().as_secs_f64();
                    BalanceReport { seconds, note: error.to_string(), ..BalanceReport::untouched(body) }
                }
                Err(error) => return Err(error),
            };
            gradient.balance.push(report);
        }
        Ok(gradient)
    }

    /// `Σ_b f_b ⊗ g_ab`: the gradient of a vector field at particle `a`.
    #[inline]
    pub fn of(&self, a: usize, field: &[f64]) -> Tensor<D> {
        let mut sum = Tensor::zeros();
        for entry in self.neighbourhood.row(a) {
            let b = self.neighbourhood.neighbour(entry) * D;
            let value = Vector::<D>::from_column_slice(&field[b..b + D]);
            sum += outer(&value, &self.weights[entry]);
        }
        sum
    }

    /// `Σ_b T_b g_ba`: the transposed operator at particle `a`, which turns (volume-weighted)
    /// stresses into forces.
    #[inline]
    pub fn transposed_of(&self, a: usize, field: &[Tensor<D>]) -> Vector<D> {
        let mut sum = Vector::zeros();
        for entry in self.neighbourhood.row(a) {
            let b = self.neighbourhood.neighbour(entry);
            sum += field[b] * self.weights[self.neighbourhood.twin(entry)];
        }
        sum
    }
}

/// `N · ∇W_b(X_a) = −W′(r) ≥ 0` of the plain kernel gradient, 1/m^(D+1), for a pair at distance `r`.
pub fn plain_slope<const D: usize>(body: &Body, r: f64) -> f64 {
    -kernel::slope_over_distance(body.kernel, D, r, body.smoothing * body.spacing) * r
}
