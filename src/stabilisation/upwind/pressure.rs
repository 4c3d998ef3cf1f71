//! D_p of one pair: rate of the owner's J and its derivatives. Formulas are in the head of the module above.

use super::Upwind;
use super::limiter::limited;
use crate::setup::InterfaceChoice;
use crate::tensor::{Tensor, Vector, outer};

/// Pressures at the interface of a pair; owner first, then the other.
#[derive(Debug, Clone, Copy)]
pub struct PressureStates {
    /// Those of the particles, Pa.
    pub particle: [f64; 2],
    /// What reconstruction adds, `±½ 𝒢·(X_b − X_a)`; zero for constant states.
    pub increment: [f64; 2],
}

/// What D_p does to one pair: the rate of the owner's J and its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct PressurePair<const D: usize> {
    /// Rate of the owner's volume ratio, 1/s.
    pub rate: f64,
    /// Derivative with respect to the pair's wave speed.
    pub by_speed: f64,
    /// Derivatives with respect to [`PressureStates::particle`].
    pub by_pressure: [f64; 2],
    /// Derivatives with respect to [`PressureStates::increment`].
    pub by_increment: [f64; 2],
    /// Derivatives with respect to the cofactors of the owner and of the other.
    pub by_cofactor: [Tensor<D>; 2],
    /// Derivative with respect to the relative displacement `u_b − u_a` (through n).
    pub by_separation: Vector<D>,
}

impl<const D: usize> Upwind<D> {
    /// D_p of an entry (a, b) whose partner entry is `twin`, given the pair's wave speed, the
    /// pressures and the two cofactors.
    pub fn pressure_pair(
        &self,
        (entry, twin): (usize, usize),
        (a, b): (usize, usize),
        displacement: &[f64],
        speed: f64,
        states: &PressureStates,
        cofactor: [&Tensor<D>; 2],
    ) -> PressurePair<D> {
        let pair = self.separation(a, b, displacement);
        let n = pair.direction;
        let reference = self.reference_separation(a, b);
        let normal = reference / reference.norm();
        let (own, other) = (self.half_gradients[entry], self.half_gradients[twin]);
        let strength = self.pressure_strength[b] / speed;

        // First bracket A = n·s with s = (P⁺ − P⁻)N, second bracket B = n·q.
        let q = cofactor[0] * own - cofactor[1] * other;
        let (pressure, slopes) = self.interface_pressures(states);
        let jump = pressure[1] - pressure[0];
        let (mut s, by_state, by_cofactor);
        if self.options.stress_jump {
            s = cofactor[0] * normal * pressure[0] - cofactor[1] * normal * pressure[1];
            by_state = [n.dot(&(cofactor[0] * normal)), -n.dot(&(cofactor[1] * normal))];
            by_cofactor = [pressure[0], -pressure[1]];
        } else {
            s = (cofactor[0] + cofactor[1]) * normal * 0.5;
            let along = n.dot(&s);
            s *= -jump;
            by_state = [along, -along];
            by_cofactor = [-0.5 * jump, -0.5 * jump];
        }
        let (first, second) = (n.dot(&s), n.dot(&q));
        let rate = strength * first * second;
        PressurePair {
            rate,
            by_speed: -rate / speed,
            by_pressure: slopes.of_particles(by_state).map(|slope| strength * second * slope),
            by_increment: slopes.of_increments(by_state).map(|slope| strength * second * slope),
            by_cofactor: [
                (outer(&n, &normal) * (by_cofactor[0] * second) + outer(&n, &own) * first) * strength,
                (outer(&n, &normal) * (by_cofactor[1] * second) - outer(&n, &other) * first) * strength,
            ],
            by_separation: pair.pull_back(&(s * second + q * first)) * strength,
        }
    }

    /// `p⁻` and `p⁺` at the interface of a pair.
    fn interface_pressures(&self, states: &PressureStates) -> ([f64; 2], InterfaceSlopes) {
        let ([own, other], increment) = (states.particle, states.increment);
        if self.options.interface != InterfaceChoice::Limited {
            return ([own + increment[0], other + increment[1]], InterfaceSlopes(None));
        }
        // The mean of the particles, and the limited jump.
        let (jump, slopes) = limited(other - own, other + increment[1] - own - increment[0]);
        let mean = 0.5 * (own + other);
        ([mean - 0.5 * jump, mean + 0.5 * jump], InterfaceSlopes(Some(slopes)))
    }
}

/// Derivatives of the limited pressure jump, if it is limited.
struct InterfaceSlopes(Option<[f64; 2]>);

impl InterfaceSlopes {
    /// Derivatives with respect to the pressures of the particles, from those with respect to the interface's.
    fn of_particles(&self, by_state: [f64; 2]) -> [f64; 2] {
        let Some([by_jump, by_reconstructed]) = self.0 else { return by_state };
        let mean = 0.5 * (by_state[0] + by_state[1]);
        let jump = 0.5 * (by_state[1] - by_state[0]) * (by_jump + by_reconstructed);
        [mean - jump, mean + jump]
    }

    /// Derivatives with respect to the increments, from those with respect to the interface's pressures.
    fn of_increments(&self, by_state: [f64; 2]) -> [f64; 2] {
        let Some([_, by_reconstructed]) = self.0 else { return by_state };
        let jump = 0.5 * (by_state[1] - by_state[0]) * by_reconstructed;
        [-jump, jump]
    }
}
