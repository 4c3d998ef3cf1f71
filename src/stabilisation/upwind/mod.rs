//! Upwind stabilisation of momentum and volume ratio (formulation, section 4; document 004,
//! (3.35)–(3.42) and (3.50)–(3.57) with their slips repaired).
//!
//! Per ordered pair (a, b), with reference direction N, current direction n, average gradient
//! `g = ½(∇̃W̃_b(X_a) − ∇̃W̃_a(X_b))`:
//!
//! ```text
//! force on a:    τ_v V_a V_b ρ c n⊗n (v⁺ − v⁻) (N·g)
//! rate of J_a:   τ_p V_b (1/(ρ c)) [n·(P⁺ − P⁻)N] [n·½(H_a g̃_ab − H_b g̃_ba)]
//! ```
//!
//! # Interface states
//!
//! - Constant: `v⁻ = v_a`, `v⁺ = v_b`. Dissipation O(c Δx), too much wherever the flow is slow compared with c.
//! - Reconstructed to the mid-point by least-squares gradients: O(c Δx³), but the jump may have the other sign than
//!   `v_b − v_a`: a pair may feed energy.
//! - Limited, the default: the reconstructed jump times a factor, so that the force on a pair is
//!   `β c ψ K (v_b − v_a)` with `0 ≤ ψ ≤ 1` and positive semi-definite `K = n⊗n`, see `limiter.rs`. Every
//!   pair dissipates, the force stays along n (angular momentum is kept), and the tangent is exact within the
//!   two rings of the stress. Equations are no longer linear in the velocities.
//!
//! Dam break at c = 35, 70, 140 m/s, 11 × 11 and 21 × 21 particles, τ_v = 1, deformed wave speed, TVD-RK2: front in sides at
//! t √(g/a) = 1.19; roughness of the pressure (distance from the mean of four neighbours, L2, relative) at 0.65 s.
//! The last two lines are a prototype's, of the limiter of Zhang, Hu and Adams (2017), `β = min(3 |Δv·n|, c)` instead of c,
//! made differentiable as `β = c z/√(1 + z²)`, `z = 3 |Δv·n|/c`:
//!
//! | | 11²: 35, 70, 140 | 21²: 35, 70 | roughness, 21²: 35, 70 |
//! |---|---|---|---|
//! | no D_v | –, 2.56, – | 2.38, 2.40 | 0.87, 0.75 |
//! | constant | –, 1.54, – | 1.77, 1.64 | 0.06, 0.10 |
//! | reconstructed | 2.25, 2.19, 2.12 | 2.29, 2.27 | 0.18, 0.24 |
//! | **limited** | 2.31, 2.28, 2.24 | 2.28, 2.27 | 0.17, 0.16 |
//! | Zhang et al., compression only | –, 2.55, – | 2.39, 2.41 | 0.76, 0.69 |
//! | the same for both signs | 2.23, 2.23, 2.23 | 2.23, 2.23 | 0.49, 0.45 |
//!
//! A strength that falls with the jump does not see the noise that a stiff pressure makes of small velocities; what tells
//! noise from flow is not its size but its shape. The beam of CSM3 with τ_v = 1 (71 × 5): up to the first trough, constant states
//! take 0.16 % of the largest kinetic energy, limited ones 0.01 %.
//!
//! # Terms
//!
//! The force of a pair is central: it keeps angular momentum as it keeps linear momentum, and neither rotation nor
//! interface states can make it resist one. It damps shear, too, because pairs point in all directions: on a square
//! lattice with h = Δx the sawtooth across its wave vector is damped with 0.26 of the strength of the one along it.
//! The source's Riemann states of a solid add `c_s (I − n⊗n)` to `c n⊗n`, with `c_s` the speed of shear waves; its ratio to
//! c is that at rest. That is [`transverse_shear`](crate::setup::Stabilisation::transverse_shear), for comparison: linear
//! momentum is exact with it, angular momentum is not, and constant interface states resist every rotation.
//!
//! The default jump in the second is `P⁺ − P⁻ = −(p⁺ − p⁻) ½(H_a + H_b)` with the plain gradient:
//! both brackets then share the factor `n·H̄N`, and each pair dissipates
//! `−½ K (p⁺ − p⁻)² (n·H̄N)² ≤ 0` whatever the deformation. The printed form with the full stresses
//! is [`stress_jump`](crate::setup::Stabilisation::stress_jump); its sign cannot be guaranteed.
//! The same limiter acts on the pressure jump.
//! Reconstruction of a stress jump reconstructs the pressures and keeps each particle's own cofactor,
//! so that the coupling never reaches further than two rings.

mod limiter;
mod pressure;
mod velocity;

pub use pressure::{PressurePair, PressureStates};
pub use velocity::{Jump, VelocityPair};

use crate::discretisation::{DiscretisationError, Gradient, least_squares_weights, plain_slope};
use crate::material::Material;
use crate::setup::{Body, Particles, Stabilisation, WeightChoice};
use crate::tensor::Vector;

/// Pair tables of the stabilisation: one entry per ordered pair of the neighbour list.
#[derive(Debug, Clone)]
pub struct Upwind<const D: usize> {
    /// What the scene asked for.
    pub options: Stabilisation,
    /// `τ_v V_a V_b ρ (N·g)`, kg/m; empty without D_v.
    velocity_strength: Vec<f64>,
    /// `c_s/c` at rest, per particle; empty without D_v or if it is central.
    shear_ratio: Vec<f64>,
    /// `½ g̃_ab` of D_p, 1/m^(D+1), zero for self-entries; empty without D_p.
    half_gradients: Vec<Vector<D>>,
    /// `τ_p V_b / ρ`, per particle b; empty without D_p.
    pressure_strength: Vec<f64>,
    /// Least-squares weights of the reconstruction; empty for constant interface states.
    pub reconstruction: Vec<Vector<D>>,
    positions: Vec<Vector<D>>,
}

/// Current direction and distance of a pair.
struct Separation<const D: usize> {
    direction: Vector<D>,
    distance: f64,
}

impl<const D: usize> Separation<D> {
    /// `∂n/∂(u_b − u_a) = (I − n⊗n)/|x_b − x_a|` (6.17), applied to a covector.
    fn pull_back(&self, covector: &Vector<D>) -> Vector<D> {
        (covector - self.direction * self.direction.dot(covector)) / self.distance
    }
}

impl<const D: usize> Upwind<D> {
    /// Builds the pair tables for the terms whose coefficient is not zero.
    ///
    /// # Errors
    /// If interface states are to be reconstructed around a particle with degenerate neighbours.
    pub fn build(
        options: Stabilisation,
        bodies: &[Body],
        particles: &Particles<D>,
        gradient: &Gradient<D>,
        materials: &[&Material],
    ) -> Result<Self, DiscretisationError> {
        let neighbourhood = &gradient.neighbourhood;
        let positions = &particles.positions;
        let (with_velocity, with_pressure) = (options.tau_v != 0.0, options.tau_p != 0.0);
        let pairs = neighbourhood.pairs();
        let mut velocity_strength = Vec::with_capacity(if with_velocity { pairs } else { 0 });
        let mut half_gradients = Vec::with_capacity(if with_pressure { pairs } else { 0 });
        let mut reconstruction = Vec::with_capacity(if options.interface.reconstructs() { pairs } else { 0 });
        for body in bodies {
            let kernel_volumes = match body.weights {
                WeightChoice::Single => &particles.volumes,
                _ => &particles.kernel_volumes,
            };
            for a in body.particles.clone() {
                for entry in neighbourhood.row(a) {
                    let b = neighbourhood.neighbour(entry);
                    let d = positions[b] - positions[a];
                    let r = d.norm();
                    let normal = if r > 0.0 { d / r } else { Vector::zeros() };
                    // g̃_ab and the part of the average that N sees.
                    let own = if a == b {
                        Vector::zeros()
                    } else if options.corrected_gradient {
                        gradient.weights.at(a, entry) / kernel_volumes[b]
                    } else {
                        normal * plain_slope::<D>(body, r)
                    };
                    if with_velocity {
                        let along = if a == b {
                            0.0
                        } else if options.corrected_gradient {
                            let other = gradient.transposed_weight(entry) / kernel_volumes[a];
                            0.5 * normal.dot(&(own - other))
                        } else {
                            plain_slope::<D>(body, r)
                        };
                        let volumes = particles.volumes[a] * particles.volumes[b];
                        velocity_strength.push(options.tau_v * volumes * materials[a].density * along);
                    }
                    if with_pressure {
                        half_gradients.push(own * 0.5);
                    }
                }
                if options.interface.reconstructs() {
                    reconstruction.extend(least_squares_weights(a, positions, neighbourhood)?);
                }
            }
        }
        let pressure_strength = if with_pressure {
            particles.volumes.iter().zip(materials).map(|(v, law)| options.tau_p * v / law.density).collect()
        } else {
            Vec::new()
        };
        let transverse = options.transverse_shear && materials.iter().any(|law| law.shear_wave_speed() > 0.0);
        let shear_ratio = if with_velocity && transverse {
            materials.iter().map(|law| law.shear_wave_speed() / law.wave_speed()).collect()
        } else {
            Vec::new()
        };
        Ok(Self {
            options,
            velocity_strength,
            shear_ratio,
            half_gradients,
            pressure_strength,
            reconstruction,
            positions: positions.clone(),
        })
    }

    /// Whether D_v is present.
    pub fn has_velocity(&self) -> bool {
        !self.velocity_strength.is_empty()
    }

    /// Whether D_p is present.
    pub fn has_pressure(&self) -> bool {
        !self.pressure_strength.is_empty()
    }

    /// Pairs whose D_v would feed energy instead of dissipating it (`N·g < 0`); possible only with
    /// the corrected gradient.
    pub fn feeding_pairs(&self) -> usize {
        self.velocity_strength.iter().filter(|&&s| s < 0.0).count()
    }

    /// `X_b − X_a`, m.
    pub fn reference_separation(&self, a: usize, b: usize) -> Vector<D> {
        self.positions[b] - self.positions[a]
    }

    fn separation(&self, a: usize, b: usize, displacement: &[f64]) -> Separation<D> {
        let mut d = self.reference_separation(a, b);
        for i in 0..D {
            d[i] += displacement[b * D + i] - displacement[a * D + i];
        }
        // Two particles on top of each other have no direction; the tiny guard keeps the (then
        // vanishing) term finite.
        let distance = d.norm().max(f64::MIN_POSITIVE.sqrt());
        Separation { direction: d / distance, distance }
    }

    /// `c_s/c` at rest; both particles of a pair belong to one body.
    fn shear_ratio(&self, particle: usize) -> f64 {
        self.shear_ratio.get(particle).copied().unwrap_or(0.0)
    }
}
