//! Upwind stabilisation of momentum and volume ratio (formulation, section 4; document 004,
//! (3.35)–(3.42) and (3.50)–(3.57) with their slips repaired).
//!
//! Per ordered pair (a, b), with reference direction N, current direction n, average gradient
//! `g = ½(∇̃W̃_b(X_a) − ∇̃W̃_a(X_b))`:
//!
//! ```text
//! force on a:    τ_v V_a V_b ρ [c n⊗n + c_s (I − n⊗n)] (v⁺ − v⁻) (N·g)
//! rate of J_a:   τ_p V_b (1/(ρ c)) [n·(P⁺ − P⁻)N] [n·½(H_a g̃_ab − H_b g̃_ba)]
//! ```
//!
//! # Interface states
//!
//! - Constant: `v⁻ = v_a`, `v⁺ = v_b`. Dissipation O(c Δx), too much wherever the flow is slow compared with c.
//! - Reconstructed to the mid-point by least-squares gradients: O(c Δx³), but the jump may have the other sign than
//!   `v_b − v_a`: a pair may feed energy.
//! - Limited, the default: the reconstructed jump times a factor, so that the force on a pair is
//!   `−β c ψ K (v_b − v_a)` with `0 ≤ ψ ≤ 1` and positive semi-definite `K = n⊗n + (c_s/c)(I − n⊗n)`, see `limiter.rs`. Every
//!   pair dissipates, the force stays along n for fluids (angular momentum is kept), and the tangent is exact within the
//!   two rings of the stress. Equations are no longer linear in the velocities.
//!
//! Dam break at c = 35, 70, 140 m/s, 11 × 11 and 21 × 21 particles, τ_v = 1, deformed wave speed, TVD-RK2: front in sides at
//! t √(g/a) = 1.19; roughness of the pressure (distance from the mean of four neighbours, L2, relative) at 0.65 s.
//! The last two lines are a prototype's, of the limiter of Zhang, Hu and Adams (2017), `β = min(3 |Δv·n|, c)` instead of c,
//! made differentiable as `β = c z/√(1 + z²)`:
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
//! noise from flow is not its size but its shape. The beam of CSM3 with τ_v = 1 (71 × 5): constant states take 200 % of the
//! largest kinetic energy in one period, reconstructed ones 0.17 %, limited ones 0.01 %.
//!
//! # Terms
//!
//! `c_s` is the speed of shear waves, zero for a fluid; its ratio to c is that at rest.
//!
//! The default jump in the second is `P⁺ − P⁻ = −(p⁺ − p⁻) ½(H_a + H_b)` with the plain gradient:
//! both brackets then share the factor `n·H̄N`, and each pair dissipates
//! `−½ K (p⁺ − p⁻)² (n·H̄N)² ≤ 0` whatever the deformation. The printed form with the full stresses
//! is [`stress_jump`](crate::setup::Stabilisation::stress_jump); its sign cannot be guaranteed.
//! The same limiter acts on the pressure jump.
//! Reconstruction of a stress jump reconstructs the pressures and keeps each particle's own cofactor,
//! so that the coupling never reaches further than two rings.

use super::limiter::{limited, limiter};
use crate::discretisation::{DiscretisationError, Gradient, least_squares_weights, plain_slope};
use crate::material::Material;
use crate::setup::{Body, InterfaceChoice, Particles, Stabilisation, WeightChoice};
use crate::tensor::{Tensor, Vector, outer};

/// Pair tables of the stabilisation: one entry per ordered pair of the neighbour list.
#[derive(Debug, Clone)]
pub struct Upwind<const D: usize> {
    /// What the scene asked for.
    pub options: Stabilisation,
    /// `τ_v V_a V_b ρ (N·g)`, kg/m; empty without D_v.
    velocity_strength: Vec<f64>,
    /// `c_s/c` at rest, per particle; empty without D_v or if all bodies are fluids.
    shear_ratio: Vec<f64>,
    /// `½ g̃_ab` of D_p, 1/m^(D+1), zero for self-entries; empty without D_p.
    half_gradients: Vec<Vector<D>>,
    /// `τ_p V_b / ρ`, per particle b; empty without D_p.
    pressure_strength: Vec<f64>,
    /// Least-squares weights of the reconstruction; empty for constant interface states.
    pub reconstruction: Vec<Vector<D>>,
    positions: Vec<Vector<D>>,
}

/// Velocities at the interface of a pair.
#[derive(Debug, Clone, Copy)]
pub struct Jump<const D: usize> {
    /// `v_b − v_a`, m/s.
    pub difference: Vector<D>,
    /// What reconstruction adds, `−½(𝒢_a + 𝒢_b)(X_b − X_a)`; zero for constant states.
    pub increment: Vector<D>,
}

/// Pressures at the interface of a pair; owner first, then the other.
#[derive(Debug, Clone, Copy)]
pub struct PressureStates {
    /// Those of the particles, Pa.
    pub particle: [f64; 2],
    /// What reconstruction adds, `±½ 𝒢·(X_b − X_a)`; zero for constant states.
    pub increment: [f64; 2],
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
                WeightChoice::Separate | WeightChoice::Balanced | WeightChoice::Auto => &particles.kernel_volumes,
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
                        gradient.weights[entry] / kernel_volumes[b]
                    } else {
                        normal * plain_slope::<D>(body, r)
                    };
                    if with_velocity {
                        let along = if a == b {
                            0.0
                        } else if options.corrected_gradient {
                            let other = gradient.weights[neighbourhood.twin(entry)] / kernel_volumes[a];
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
        let solid = materials.iter().any(|law| law.shear_wave_speed() > 0.0);
        let shear_ratio = if with_velocity && solid {
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

    /// `c_s/c` at rest; both particles of a pair belong to one body.
    fn shear_ratio(&self, particle: usize) -> f64 {
        self.shear_ratio.get(particle).copied().unwrap_or(0.0)
    }

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
