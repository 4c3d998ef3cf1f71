//! D_v of one pair: force on the owner and its derivatives. Formulas are in the head of the module above.

use super::Upwind;
use super::limiter::limiter;
use crate::setup::InterfaceChoice;
use crate::tensor::{Tensor, Vector, outer};

/// Velocities at the interface of a pair.
#[derive(Debug, Clone, Copy)]
pub struct Jump<const D: usize> {
    /// `v_b − v_a`, m/s.
    pub difference: Vector<D>,
    /// What reconstruction adds, `−½(𝒢_a + 𝒢_b)(X_b − X_a)`; zero for constant states.
    pub increment: Vector<D>,
}

/// What D_v does to one pair: the force on the owner and its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct VelocityPair<const D: usize> {
    /// Force on the owner, N.
    pub force: Vector<D>,
    /// Derivative with respect to the pair's wave speed.
    pub by_speed: Vector<D>,
    /// Derivative with respect to [`Jump::difference`].
    pub by_difference: Tensor<D>,
    /// Derivative with respect to [`Jump::increment`].
    pub by_increment: Tensor<D>,
    /// Derivative with respect to the relative displacement `u_b − u_a` (through n).
    pub by_separation: Tensor<D>,
}

impl<const D: usize> Upwind<D> {
    /// D_v of an entry (a, b), given the pair's wave speed and its velocities.
    pub fn velocity_pair(
        &self,
        entry: usize,
        (a, b): (usize, usize),
        displacement: &[f64],
        speed: f64,
        jump: &Jump<D>,
    ) -> VelocityPair<D> {
        let strength = self.velocity_strength[entry];
        let pair = self.separation(a, b, displacement);
        let n = pair.direction;
        let shear = self.shear_ratio(a);
        // With r = c_s/c, K = (1 − r) n⊗n + r I: f = β c K Δ, and ∂(K Δ)/∂n = (1 − r) [(n·Δ) I + n⊗Δ].
        let full = outer(&n, &n) * (1.0 - shear) + Tensor::identity() * shear;
        let turn = |delta: &Vector<D>| {
            let projector = (Tensor::identity() - outer(&n, &n)) / pair.distance;
            (projector * n.dot(delta) + outer(&n, &pair.pull_back(delta))) * (1.0 - shear)
        };
        let reconstructed = jump.difference + jump.increment;
        if self.options.interface != InterfaceChoice::Limited {
            let by_speed = full * reconstructed * strength;
            let by_jump = full * (strength * speed);
            let by_separation = turn(&reconstructed) * (strength * speed);
            return VelocityPair {
                force: by_speed * speed,
                by_speed,
                by_difference: by_jump,
                by_increment: by_jump,
                by_separation,
            };
        }
        // f = β c ψ(B/A) K Δ with A = Δ·KΔ and B = Δ·KΔ_r.
        let delta = &jump.difference;
        let (q, w) = (full * delta, full * reconstructed);
        let (size, along) = (delta.dot(&q), reconstructed.dot(&q));
        let (factor, slope) = limiter(along, size);
        let mut by_difference = full * factor;
        let mut by_increment = Tensor::zeros();
        let mut by_separation = turn(delta) * factor;
        if slope != 0.0 {
            let ratio = along / size;
            by_increment = outer(&q, &q) * (slope / size);
            by_difference += by_increment + outer(&q, &(w - q * (2.0 * ratio))) * (slope / size);
            let (normal, other) = (n.dot(delta), n.dot(&reconstructed));
            let by_normal = (delta * (other - 2.0 * ratio * normal) + reconstructed * normal) * (1.0 - shear);
            by_separation += outer(&q, &pair.pull_back(&by_normal)) * (slope / size);
        }
        let scale = strength * speed;
        VelocityPair {
            force: q * (factor * scale),
            by_speed: q * (factor * strength),
            by_difference: by_difference * scale,
            by_increment: by_increment * scale,
            by_separation: by_separation * scale,
        }
    }

    /// The force of [`velocity_pair`](Self::velocity_pair) alone.
    pub fn velocity_force(
        &self,
        entry: usize,
        (a, b): (usize, usize),
        displacement: &[f64],
        speed: f64,
        jump: &Jump<D>,
    ) -> Vector<D> {
        let n = self.separation(a, b, displacement).direction;
        let strength = self.velocity_strength[entry] * speed;
        let along = |delta: &Vector<D>| {
            if self.shear_ratio.is_empty() {
                return n * n.dot(delta);
            }
            let shear = self.shear_ratio(a);
            n * ((1.0 - shear) * n.dot(delta)) + delta * shear
        };
        let reconstructed = jump.difference + jump.increment;
        if self.options.interface != InterfaceChoice::Limited {
            return along(&reconstructed) * strength;
        }
        let q = along(&jump.difference);
        q * (strength * limiter(reconstructed.dot(&q), jump.difference.dot(&q)).0)
    }
}
