//! Dominant eigenvalue of `∂f/∂u` by a power iteration on differences of the rate.

use super::super::attempt::{Attempt, Tools, evaluate};
use super::super::{RatePart, StepCause};
use crate::EvaluationError;
use crate::vector::{dot, norm};

/// Iterations at most.
const LIMIT: usize = 60;

/// Relative change of the spectral radius, twice in a row, at which the iteration ends.
const TOLERANCE: f64 = 0.01;

/// The eigenvalue of largest magnitude of the linearised system, as far as a stability limit cares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DominantEigenvalue {
    /// Magnitude `|λ|`.
    pub radius: f64,
    /// Damping ratio `−Re λ / |λ|`: 1 on the negative real axis, 0 for an undamped oscillation,
    /// negative where the solution grows.
    pub damping: f64,
}

impl DominantEigenvalue {
    /// Fits `z₂ ≈ p z₁ + q z₀` to three successive vectors `z₀`, `z₁ = A z₀`, `z₂ = A z₁`, and takes the
    /// larger root of `λ² = p λ + q`: exact for one real eigenvalue, for `±λ`, and for a complex
    /// pair, where the plain ratio of norms would oscillate for ever.
    ///
    /// The arguments are `z₀·z₀, z₀·z₁, z₀·z₂, z₁·z₁, z₁·z₂` and `z₂·z₂`.
    fn fit([a00, a01, a02, a11, a12, a22]: [f64; 6]) -> Self {
        let determinant = a00 * a11 - a01 * a01;
        if determinant <= 1e-10 * a00 * a11 {
            // z₁ is parallel to z₀: one real eigenvalue.
            return Self { radius: (a22 / a11).sqrt(), damping: if a01 > 0.0 { -1.0 } else { 1.0 } };
        }
        let p = (a00 * a12 - a01 * a02) / determinant;
        let q = (a11 * a02 - a01 * a12) / determinant;
        let discriminant = 0.25 * p * p + q;
        if discriminant < 0.0 {
            let radius = (-q).sqrt();
            return Self { radius, damping: -0.5 * p / radius };
        }
        let root = discriminant.sqrt();
        let radius = 0.5 * p.abs() + root;
        // With ±λ both are dominant; the growing one is of no interest for a stability limit.
        Self { radius, damping: if p > 1e-6 * root { -1.0 } else { 1.0 } }
    }
}

impl Attempt<'_> {
    /// The spectral radius at the start of the step: kept for `refresh` steps, else estimated from the
    /// last eigenvector (at first from a fixed pseudo-random one).
    pub(super) fn spectral_radius(&mut self, refresh: usize) -> Result<f64, StepCause> {
        let memory = &self.start.memory;
        if memory.spectral_radius > 0.0 && memory.steps_since_estimate < refresh {
            return Ok(memory.spectral_radius);
        }
        self.know_start_rate()?;
        let found = self.dominant_eigenvalue()?;
        for memory in [&mut self.start.memory, &mut self.end.memory] {
            memory.spectral_radius = found.radius;
            memory.dominant_damping = found.damping;
        }
        self.start.memory.steps_since_estimate = 0;
        self.end.memory.steps_since_estimate = 1;
        self.end.memory.dominant_direction.clone_from(&self.start.memory.dominant_direction);
        Ok(found.radius)
    }

    fn dominant_eigenvalue(&mut self) -> Result<DominantEigenvalue, StepCause> {
        let n = self.start.values.len();
        let size = norm(&self.start.values);
        // Balances rounding (ε·size) against curvature, as in any directional difference quotient.
        let length = f64::EPSILON.sqrt() * if size > 0.0 { size } else { 1.0 };
        let direction = &mut self.start.memory.dominant_direction;
        if direction.len() != n {
            direction.clear();
            direction.extend((0..n as u64).map(pseudo_random));
        }
        let Tools { rates: [image, ..], stages: [point, older, newer], base: free, counts, .. } = &mut *self.tools;
        // Prescribed entries are no unknowns. They are those that `impose` does not leave alone.
        for (p, u) in point.iter_mut().zip(&self.start.values) {
            *p = u + (1.0 + u.abs());
        }
        free.copy_from_slice(point);
        self.system.impose(self.start.time, free);
        for (free, p) in free.iter_mut().zip(point.iter()) {
            *free = f64::from(u8::from(*free == *p));
        }
        newer.copy_from_slice(&self.start.memory.dominant_direction);
        normalise(newer, free);

        // `older` and `newer` are unit vectors with A·older = stretch·newer; `stretch` is 0 at first.
        let mut found = DominantEigenvalue { radius: 0.0, damping: 1.0 };
        let mut stretch = 0.0;
        let mut agreements = 0;
        for _ in 0..LIMIT {
            for ((p, u), d) in point.iter_mut().zip(&self.start.values).zip(newer.iter()) {
                *p = u + length * d;
            }
            evaluate(self.system, counts, RatePart::All, self.start.time, point, image)?;
            for (f, f0) in image.iter_mut().zip(&self.start.memory.rate) {
                *f = (*f - f0) / length;
            }
            let before = found;
            let had_fit = stretch > 0.0;
            if had_fit {
                for (f, free) in image.iter_mut().zip(free.iter()) {
                    *f *= free;
                }
                let square = stretch * stretch;
                found = DominantEigenvalue::fit([
                    1.0,
                    stretch * dot(older, newer),
                    stretch * dot(older, image),
                    square,
                    square * dot(newer, image),
                    square * dot(image, image),
                ]);
            }
            stretch = normalise(image, free);
            if !stretch.is_finite() || !found.radius.is_finite() {
                return Err(EvaluationError::not_finite("spectral radius of the rate", 0, stretch).into());
            }
            if stretch == 0.0 {
                break;
            }
            std::mem::swap(older, newer);
            newer.copy_from_slice(image);
            let close = had_fit && (found.radius - before.radius).abs() <= TOLERANCE * found.radius;
            agreements = if close { agreements + 1 } else { 0 };
            if agreements == 2 {
                break;
            }
        }
        self.start.memory.dominant_direction.copy_from_slice(newer);
        Ok(found)
    }
}

/// Sets the entries that are not free to zero, scales the rest to length 1 and returns its length before.
fn normalise(vector: &mut [f64], free: &[f64]) -> f64 {
    for (v, free) in vector.iter_mut().zip(free) {
        *v *= free;
    }
    let size = norm(vector);
    if size > 0.0 {
        for v in vector {
            *v /= size;
        }
    }
    size
}

/// A fixed number in `[−1, 1)` for every index (the finaliser of SplitMix64): the same run on every
/// machine, and no structure that an eigenvector could be orthogonal to.
fn pseudo_random(index: u64) -> f64 {
    let mut bits = index.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^= bits >> 31;
    (bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gram(z: [[f64; 3]; 3]) -> [f64; 6] {
        [
            dot(&z[0], &z[0]),
            dot(&z[0], &z[1]),
            dot(&z[0], &z[2]),
            dot(&z[1], &z[1]),
            dot(&z[1], &z[2]),
            dot(&z[2], &z[2]),
        ]
    }

    #[test]
    fn fit_finds_a_real_eigenvalue_and_a_damped_pair() {
        let real = DominantEigenvalue::fit(gram([[1.0, 2.0, 0.0], [-3.0, -6.0, 0.0], [9.0, 18.0, 0.0]]));
        assert!((real.radius - 3.0).abs() < 1e-12 && real.damping == 1.0);
        // x'' + 2ζω x' + ω² x = 0 as a first-order system: |λ| = ω, damping ratio ζ.
        let (omega, zeta) = (50.0, 0.3);
        let apply = |z: [f64; 3]| [z[1], -omega * omega * z[0] - 2.0 * zeta * omega * z[1], 0.0];
        let z0 = [1.0, 0.7, 0.0];
        let z1 = apply(z0);
        let pair = DominantEigenvalue::fit(gram([z0, z1, apply(z1)]));
        assert!((pair.radius - omega).abs() < 1e-6 * omega, "{pair:?}");
        assert!((pair.damping - zeta).abs() < 1e-6, "{pair:?}");
    }
}
