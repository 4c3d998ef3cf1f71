//! The gradient operator: neighbour lists, weights `g_ab`, and nothing else.

use std::time::Instant;

use rayon::prelude::*;

use super::stencils::{Runs, TILE, gather, spread};
use super::weights::Weights;
use super::{BalanceReport, DiscretisationError, KernelCorrection, Neighbourhood, balance};
use crate::kernel;
use crate::setup::{Body, Particles, WeightChoice};
use crate::tensor::{Tensor, Vector};

/// Gradient weights of all particles on their neighbour lists.
#[derive(Debug, Clone)]
pub struct Gradient<const D: usize> {
    /// Who interacts with whom.
    pub neighbourhood: Neighbourhood,
    /// `g_ab`, 1/m.
    pub weights: Weights<D>,
    /// What balancing did, for every body that asked for it.
    pub balance: Vec<BalanceReport>,
    /// Particles with the same row as those beside them, for the operator and for its transpose.
    runs: Runs<D>,
    transposed_runs: Runs<D>,
}

/// Particles whose weights one thread finds at a time.
const CHUNK: usize = 2048;

/// Particles that the block operations take at a time.
pub const BLOCK: usize = 64;

/// Gradients of a block: column d of all of its tensors, then the next.
pub type Columns<const D: usize> = [[[f64; D]; BLOCK]; D];

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
            let parts: Vec<Vec<Vector<D>>> = chunks(&body.particles)
                .into_par_iter()
                .map(|part| correction.rows(part, positions, &neighbourhood))
                .collect::<Result<_, _>>()?;
            parts.iter().for_each(|part| weights.extend_from_slice(part));
        }
        let weights = Weights::of_entries(weights, &neighbourhood);
        let (runs, transposed_runs) = (Runs::default(), Runs::default());
        let mut gradient = Self { neighbourhood, weights, balance: Vec::new(), runs, transposed_runs };
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
        gradient.find_runs(bodies, positions);
        gradient.weights.share(&gradient.neighbourhood);
        Ok(gradient)
    }

    /// Finds what repeats, and makes it equal to the bit.
    fn find_runs(&mut self, bodies: &[Body], positions: &[Vector<D>]) {
        let rows = &self.neighbourhood;
        let weights = self.weights.entries_mut();
        // A weight is about as steep as it is large over the spacing.
        let tolerances: Vec<(usize, f64)> = bodies
            .iter()
            .map(|body| {
                let own = body.particles.clone();
                let far = own.clone().map(|a| positions[a].amax()).fold(0.0, f64::max);
                let entries = own.clone().last().map_or(0..0, |last| rows.row(own.start).start..rows.row(last).end);
                let largest = weights[entries].iter().map(|g| g.amax()).fold(0.0, f64::max);
                (own.end, 32.0 * f64::EPSILON * (1.0 + far / body.spacing) * largest)
            })
            .collect();
        let tolerance = |a: usize| tolerances[tolerances.partition_point(|(end, _)| *end <= a)].1;
        self.runs = Runs::find(rows, |entry| weights[entry], tolerance);
        for (piece, stencil) in self.runs.pieces(0..rows.len()) {
            let Some(stencil) = stencil else { continue };
            for a in piece {
                for (entry, (_, weight)) in rows.row(a).zip(&stencil.entries) {
                    weights[entry] = Vector::from(*weight);
                }
            }
        }
        let weights = &*weights;
        self.transposed_runs = if self.runs.covered() == 0 {
            Runs::none(rows.len())
        } else {
            Runs::find(rows, |entry| weights[rows.twin(entry)], |_| 0.0)
        };
    }

    /// Particles that need no row of their own, of the operator and of its transpose.
    pub fn in_runs(&self) -> [usize; 2] {
        [self.runs.covered(), self.transposed_runs.covered()]
    }

    /// [`of`](Self::of) for at most [`BLOCK`] consecutive particles.
    #[inline(always)]
    pub fn of_block(&self, block: std::ops::Range<usize>, field: &[f64], out: &mut Columns<D>) {
        for (piece, stencil) in self.runs.pieces(block.clone()) {
            let local = piece.start - block.start..piece.end - block.start;
            match stencil {
                Some(stencil) if local.len() * D >= TILE => {
                    let columns = out.each_mut().map(|column| column[local.clone()].as_flattened_mut());
                    gather(stencil, piece.start, field, columns);
                }
                _ => {
                    for (a, at) in piece.zip(local) {
                        let sums = self.columns_of(a, field);
                        for d in 0..D {
                            out[d][at] = sums[d];
                        }
                    }
                }
            }
        }
    }

    /// Weights of a particle's row, in the order of its neighbours.
    #[inline(always)]
    pub fn weights_of(&self, a: usize) -> &[Vector<D>] {
        self.weights.row(a, self.neighbourhood.row(a))
    }

    /// `g_ba` of the entry (a, b).
    #[inline(always)]
    pub fn transposed_weight(&self, entry: usize) -> &Vector<D> {
        self.weights.at(self.neighbourhood.neighbour(entry), self.neighbourhood.twin(entry))
    }

    /// Columns of the gradient of a field at a particle.
    #[inline(always)]
    pub(crate) fn columns_of(&self, a: usize, field: &[f64]) -> [[f64; D]; D] {
        let mut sums = [[0.0; D]; D];
        for (&b, weight) in self.neighbourhood.of(a).iter().zip(self.weights_of(a)) {
            let b = b as usize * D;
            let Some(value) = field.get(b..).and_then(|rest| rest.first_chunk::<D>()) else { continue };
            for d in 0..D {
                let (sum, weight) = (&mut sums[d], weight[d]);
                for i in 0..D {
                    sum[i] += weight * value[i];
                }
            }
        }
        sums
    }

    /// The transposed operator for at most [`BLOCK`] consecutive particles, from the columns of all tensors.
    #[inline(always)]
    pub fn transposed_of_block(
        &self,
        block: std::ops::Range<usize>,
        columns: &[Vec<f64>; D],
        out: &mut [[f64; D]; BLOCK],
    ) {
        for (piece, stencil) in self.transposed_runs.pieces(block.clone()) {
            let local = piece.start - block.start..piece.end - block.start;
            match stencil {
                Some(stencil) if local.len() * D >= TILE => {
                    spread(stencil, piece.start, columns, out[local].as_flattened_mut());
                }
                _ => {
                    for (a, at) in piece.zip(local) {
                        out[at] = self.transposed_columns_of(a, columns);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn transposed_columns_of(&self, a: usize, columns: &[Vec<f64>; D]) -> [f64; D] {
        let mut sums = [0.0; D];
        for (&b, &twin) in self.neighbourhood.of(a).iter().zip(self.neighbourhood.twins_of(a)) {
            let weight = self.weights.at(b as usize, twin as usize);
            let b = b as usize * D;
            for d in 0..D {
                let Some(value) = columns[d].get(b..).and_then(|rest| rest.first_chunk::<D>()) else { continue };
                for i in 0..D {
                    sums[i] += weight[d] * value[i];
                }
            }
        }
        sums
    }

    /// `Σ_b f_b ⊗ g_ab`: the gradient of a vector field at particle `a`.
    #[inline]
    pub fn of(&self, a: usize, field: &[f64]) -> Tensor<D> {
        let columns = self.columns_of(a, field);
        Tensor::from_fn(|i, d| columns[d][i])
    }

    /// `Σ_b T_b g_ba`: the transposed operator at particle `a`, which turns (volume-weighted)
    /// stresses into forces.
    #[inline]
    pub fn transposed_of(&self, a: usize, field: &[Tensor<D>]) -> Vector<D> {
        let mut sum = Vector::zeros();
        for (&b, &twin) in self.neighbourhood.of(a).iter().zip(self.neighbourhood.twins_of(a)) {
            let (tensor, weight) = (&field[b as usize], self.weights.at(b as usize, twin as usize));
            for d in 0..D {
                for i in 0..D {
                    sum[i] += weight[d] * tensor[(i, d)];
                }
            }
        }
        sum
    }
}

/// Pieces of a range that one thread takes at a time.
fn chunks(range: &std::ops::Range<usize>) -> Vec<std::ops::Range<usize>> {
    range.clone().step_by(CHUNK).map(|start| start..(start + CHUNK).min(range.end)).collect()
}

/// `N · ∇W_b(X_a) = −W′(r) ≥ 0` of the plain kernel gradient, 1/m^(D+1), for a pair at distance `r`.
pub fn plain_slope<const D: usize>(body: &Body, r: f64) -> f64 {
    -kernel::slope_over_distance(body.kernel, D, r, body.smoothing * body.spacing) * r
}
