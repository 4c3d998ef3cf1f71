//! Corrected kernel gradients: Shepard normalisation and gradient correction (2.39)–(2.43).

use nalgebra::DMatrix;

use super::{DiscretisationError, Neighbourhood, describe_particle};
use crate::kernel;
use crate::setup::KernelChoice;
use crate::tensor::{Tensor, Vector, determinant, inverse, outer};

/// Kernel and weights of one body, as the correction needs them.
#[derive(Debug, Clone, Copy)]
pub struct KernelCorrection<'a> {
    /// Kernel.
    pub kernel: KernelChoice,
    /// Smoothing length h, m.
    pub smoothing_length: f64,
    /// Weights of all particles inside the kernel sums, m^D.
    pub kernel_volumes: &'a [f64],
}

/// Smallest singular value of the moment matrix that still counts as regular. On a regular cloud the
/// normalised moment is near the identity.
const SMALLEST_MOMENT: f64 = 1e-3;

impl KernelCorrection<'_> {
    /// Weights `V_b ∇̃W̃_b(X_a)` of one row, self-contribution included.
    ///
    /// With `S = Σ V_c W_c` and `γ = Σ V_c ∇W_c / S` the Shepard-normalised gradient (2.42) is
    /// `∇W̃_b = (∇W_b − W_b γ)/S`; it is not zero for `b = a` near a boundary. The correction
    /// `L = (Σ V_b ∇W̃_b ⊗ (X_b − X_a))⁻¹` makes linear fields exact.
    ///
    /// # Errors
    /// If the neighbours do not span space.
    pub fn row<const D: usize>(
        &self,
        a: usize,
        positions: &[Vector<D>],
        neighbourhood: &Neighbourhood,
    ) -> Result<Vec<Vector<D>>, DiscretisationError> {
        let mut row = Vec::new();
        self.append_row(a, positions, neighbourhood, &mut Vec::new(), &mut row)?;
        Ok(row)
    }

    /// Weights of consecutive rows, one after the other. A row that repeats the one before it, as nearly all do on a
    /// lattice, has its weights.
    pub(super) fn rows<const D: usize>(
        &self,
        particles: std::ops::Range<usize>,
        positions: &[Vector<D>],
        neighbourhood: &Neighbourhood,
    ) -> Result<Vec<Vector<D>>, DiscretisationError> {
        let entries = neighbourhood.row(particles.start).start..neighbourhood.row(particles.end - 1).end;
        let (mut weights, mut plain) = (Vec::with_capacity(entries.len()), Vec::new());
        // The particle that began the present run, and where its weights begin.
        let mut model = (particles.start, 0);
        for a in particles {
            let first = weights.len();
            if a > model.0 && self.repeats(model.0, a, positions, neighbourhood) {
                weights.extend_from_within(model.1..model.1 + neighbourhood.row(a).len());
            } else {
                self.append_row(a, positions, neighbourhood, &mut plain, &mut weights)?;
                model = (a, first);
            }
        }
        Ok(weights)
    }

    /// Whether two rows are the same but for rounding of the positions.
    fn repeats<const D: usize>(
        &self,
        model: usize,
        a: usize,
        positions: &[Vector<D>],
        neighbourhood: &Neighbourhood,
    ) -> bool {
        let (own, other) = (neighbourhood.of(a), neighbourhood.of(model));
        let shift = (a - model) as u32;
        if own.len() != other.len() || own.iter().zip(other).any(|(b, c)| *b != c + shift) {
            return false;
        }
        let moved = positions[a] - positions[model];
        let rounding = 8.0 * f64::EPSILON * positions[a].amax().max(positions[model].amax()).max(self.smoothing_length);
        own.iter().zip(other).all(|(&b, &c)| {
            let (b, c) = (b as usize, c as usize);
            self.kernel_volumes[b] == self.kernel_volumes[c] && (positions[b] - positions[c] - moved).amax() <= rounding
        })
    }

    /// [`row`](Self::row), appended to `weights`, with `plain` as space to work in.
    ///
    /// # Errors
    /// As [`row`](Self::row).
    pub(super) fn append_row<const D: usize>(
        &self,
        a: usize,
        positions: &[Vector<D>],
        neighbourhood: &Neighbourhood,
        plain: &mut Vec<(f64, f64, Vector<D>)>,
        weights: &mut Vec<Vector<D>>,
    ) -> Result<(), DiscretisationError> {
        let (here, h) = (positions[a], self.smoothing_length);
        let neighbours = neighbourhood.of(a);
        let mut shepard = 0.0;
        let mut slope = Vector::<D>::zeros();
        plain.clear();
        for &b in neighbours {
            let weight = self.kernel_volumes[b as usize];
            let towards = positions[b as usize] - here;
            let r = towards.norm();
            let value = kernel::value(self.kernel, D, r, h);
            let gradient = -towards * kernel::slope_over_distance(self.kernel, D, r, h);
            shepard += weight * value;
            slope += gradient * weight;
            plain.push((weight, value, gradient));
        }
        slope /= shepard;
        let mut moment = Tensor::<D>::zeros();
        let first = weights.len();
        for (&b, (weight, value, gradient)) in neighbours.iter().zip(plain.iter()) {
            let normalised = (gradient - slope * *value) * (*weight / shepard);
            moment += outer(&normalised, &(positions[b as usize] - here));
            weights.push(normalised);
        }
        let correction = inverse(&moment).filter(|_| is_regular(&moment));
        let Some(correction) = correction else {
            return Err(degenerate(a, &here, neighbours.len() - 1));
        };
        for weight in &mut weights[first..] {
            *weight = correction * *weight;
        }
        Ok(())
    }
}

/// Whether the smallest singular value is large enough. It is at least `|det|/|M|^(D−1)`, which is enough of an answer
/// nearly everywhere.
fn is_regular<const D: usize>(m: &Tensor<D>) -> bool {
    let least = determinant(m).abs() / m.norm().powi(D as i32 - 1);
    least > SMALLEST_MOMENT || smallest_singular_value(m) > SMALLEST_MOMENT
}

fn smallest_singular_value<const D: usize>(m: &Tensor<D>) -> f64 {
    let dynamic = DMatrix::from_fn(D, D, |i, j| m[(i, j)]);
    dynamic.singular_values().iter().copied().fold(f64::INFINITY, f64::min)
}

fn degenerate<const D: usize>(a: usize, here: &Vector<D>, count: usize) -> DiscretisationError {
    let needed = D;
    let reason = if count < needed {
        format!("has {count} neighbours, at least {needed} are needed in {D}D")
    } else {
        format!("its {count} neighbours do not span {D}D space (they lie on a line or plane)")
    };
    DiscretisationError {
        place: describe_particle(a, here),
        reason,
        remedy: "increase `smoothing`, or add particles around it".into(),
    }
}

/// Weights `ℓ_ab` of the least-squares gradient (3.53) that reconstructs interface states:
/// `𝒢_a = Σ_b (u_b − u_a) ⊗ ℓ_ab` with `ℓ_ab = (Σ N⊗N)⁻¹ N_ab/|d_ab|`; zero for the self-entry.
///
/// # Errors
/// If the neighbours do not span space.
pub fn least_squares_weights<const D: usize>(
    a: usize,
    positions: &[Vector<D>],
    neighbourhood: &Neighbourhood,
) -> Result<Vec<Vector<D>>, DiscretisationError> {
    let here = positions[a];
    let directions: Vec<Vector<D>> = neighbourhood
        .of(a)
        .iter()
        .map(|&b| {
            let d = positions[b as usize] - here;
            if b as usize == a { Vector::zeros() } else { d / d.norm_squared() }
        })
        .collect();
    let mut moment = Tensor::<D>::zeros();
    for d in &directions {
        let length = d.norm();
        if length > 0.0 {
            moment += outer(d, d) / (length * length);
        }
    }
    let inverse = inverse(&moment).filter(|_| is_regular(&moment));
    let Some(inverse) = inverse else {
        return Err(degenerate(a, &here, directions.len() - 1));
    };
    Ok(directions.iter().map(|d| inverse * d).collect())
}
