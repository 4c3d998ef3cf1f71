//! Hourglass control: an elastic energy of what the deformation gradients do not see.
//!
//! Gradients of a sawtooth vanish at the particles, so the stress does not resist it. This term does. With
//! `G = F − I` and, per *ordered* pair, the miss of the neighbour's place by the particle's own gradient,
//!
//! ```text
//! e_ab = F_a (X_b − X_a) − (x_b − x_a) = G_a X_ab − (u_b − u_a)
//! Π    = ½ Σ_a Σ_b ½ k_ab |e_ab|²,        k_ab = α ½(c_a + c_b) V_a V_b W_ab/|X_ab|²,    c a modulus, Pa
//! f_a  = −Σ_b ½ k_ab (e_ab − e_ba) − Σ_b T_b g_ba,        T_a = ½ Σ_b k_ab e_ab ⊗ X_ab
//! ```
//!
//! - Affine motion costs nothing, so constant stress stays in balance; rotation only turns e, so linear and
//!   angular momentum are kept. Π is quadratic in u: the force is linear, its matrix constant, symmetric, positive
//!   semi-definite and the same scalar for every component; at the mean of two states it conserves Π exactly, which
//!   is all that the energy–momentum scheme needs. Nothing is dissipated.
//! - Row a of the matrix stays within a's two-ring, the pattern of the stress.
//! - `T` is added to the stress times volume, the first sum is one gather over pairs. Bodies without it have no table.
//!
//! # The form
//!
//! It is the energy of the non-uniform part of a deformation that Silling (2017) adds to correspondence models.
//! Formulation section 5 has `½(F_a + F_b) X_ab − x_ab` per pair instead. The control most used in Total Lagrangian
//! SPH, Ganzenmüller's (2015), is the force `½ k (δ_ab + δ_ba) n` with `δ_ab = e_ab·n`. Errors of all three, measured by
//! `tests/hourglass_study.rs` with linear elasticity in plane strain, balanced weights, h = Δx; `none` is without
//! control:
//!
//! | | none | this one | average of both F | Ganzenmüller |
//! |---|---|---|---|---|
//! | matrix | | symmetric | symmetric | not; 1D bar, α = 2: complex frequencies, motion grows |
//! | couples a row to, in 2D | 25 | 25 particles | 49 | 25 |
//! | cantilever 6 × 1, ν = 0.3: tip at 4, 8 across | +9.3 %, +2.9 % | +0.4 %, +0.4 % | +8.4 %, +2.7 % | +8.6 %, +2.7 % |
//! | ν = 0.49 | +8.7 %, +2.9 % | −2.4 %, −0.4 % | +5.9 %, +2.1 % | +6.9 %, +2.3 % |
//! | the same in 3D between smooth walls, 4 across, ν = 0.3 | +7.9 % | +1.5 % | | |
//! | free square, 11 × 11, ν = 0.3: two lowest frequencies | −41 %, −47 % | −0.7 %, −2.7 % | −2.6 %, −5.0 % | |
//!
//! (α = 3 and c = 2μ; Ganzenmüller α = 1.) The average vanishes for quadratic fields,
//! and leaves bending as soft as integration at points makes it. This form does not: it gives back energy of the
//! strain's variation around a particle, which that integration drops, as naturally stabilised integration does on
//! purpose (Hillman and Chen 2016).
//!
//! # The coefficient, and the modulus
//!
//! In 1D (c = ρ c_p², clamped bar of 41 particles, h = 1.2 Δx) the second frequency is 53 % too low without control; with
//! α = 0.5, 1, 2, 4 it errs by −0.35, −0.32, −0.27, −0.18 %, the lowest by −6.6e-4, −5.6e-4, −4.5e-4, −3.1e-4, and at
//! h = Δx its order is 2.0 for all of them. So α decides over errors, not over success. It belongs to the discretisation,
//! not to the scene: what the control is to give back depends on the weights, and hence so does the default
//! ([`default_hourglass`]).
//!
//! - With c = 2μ, [`DEFAULT_HOURGLASS`] is where bending of a cantilever is neither too soft nor too stiff with balanced
//!   weights and h = Δx, for any Poisson's ratio. At h = 1.2 Δx they are softer (ν = 0.4; 4, 8 across): +27 %, +7.5 %
//!   without control, +11 %, +3.2 % with α = 3.
//! - Separate weights bend well by themselves. The same cantilever errs by −1.0, −2.5, −5.1, −7.6 % at 4 across and by −0.3,
//!   −0.8, −1.6, −2.4 % at 8 for α = 0.5, 1, 2, 3 at h = Δx, at h = 1.2 Δx by +3.9, +1.5, −2.7, −6.4 % at 4. But free
//!   bodies want more (`examples/discretisation_study`, 6 across, h = Δx): a lattice +1.6, +0.7, −0.9, −2.5 %, one that
//!   is perturbed by 20 % +12, +7.5, +2.9, +0.1 %. With [`DEFAULT_HOURGLASS_UNBALANCED`] the worst of these is 5 %.
//! - Lattices shaken by 20 % have no spurious low mode, with both kinds of weights (α = 0.5 and 3, h = 1.2 Δx).
//!
//! c must be a shear modulus where there is one: with `c = ρ c_p² = λ + 2μ` bending locks as ν → ½ (tip −56 % at
//! ν = 0.49, 4 across, α = 2). The volumetric laws have no other modulus than `ρ c_p²`, and no control unless asked.
//!
//! # Nearly incompressible laws
//!
//! A pressure that alternates from row to row makes no force inside a lattice, so nothing but compressibility opposes it
//! when something drives it. The control does: where the strain varies, as in bending, its energy ends at the surface
//! with a pair of opposite forces across the first two rows, as any energy of strain gradients does, and the row of
//! the pressure answers with a sawtooth of 0.15 α of its size (ν → ½; CSM1, 9 across; neither more particles nor another
//! pairing – least-squares gradients, pairs away from the surface only, forces along or across the pair, traceless
//! second gradients – lower it at the same stiffness). Hence the default coefficient times `9 μ/λ`, between 0.1 and 1:
//! whole up to ν = 0.45. Coarse bending of such bodies then is as soft as integration at points makes it. What would keep
//! both is a pressure that is its own unknown, with `(V/λ + R/μ) p = −V (J − 1)` and R the energy of what the gradients of p
//! do not see (a prototype: roughness 0.05, stiffness as with α = 3, at ν = 0.4999), but its pattern reaches four rings.
//!
//! # Explicit steps
//!
//! [`Hourglass::frequency`] bounds the frequency of the control alone. Squares of frequencies add up at most, so the
//! step is limited to `CFL/√((c/d)² + ¼ ω²)`. Measured ω Δt/2 at CFL 1, α = 0.5…16, h = 1.0 and 1.2 Δx: at most 0.88 in
//! 1D, 0.87 in 2D; in 3D 1.01 at α = 0.5, less than the 1.08 without control.

use std::ops::Range;

use rayon::prelude::*;

use crate::discretisation::{Gradient, Neighbourhood};
use crate::kernel;
use crate::material::Material;
use crate::setup::{Body, Particles};
use crate::tensor::{Tensor, Vector, outer, vector_at};

/// Coefficient α for laws with shear and balanced weights, with `c = 2μ`; see the head of the module.
pub const DEFAULT_HOURGLASS: f64 = 3.0;
/// The same for separate and single weights.
pub const DEFAULT_HOURGLASS_UNBALANCED: f64 = 2.0;

/// Ratio λ/μ up to which a law counts as compressible: that of ν = 0.45.
const COMPRESSIBLE: f64 = 9.0;
/// Least share of the coefficient, as ν → ½: enough against zero-energy modes.
const LEAST_SHARE: f64 = 0.1;

/// Coefficient where a scene says nothing. It belongs to the discretisation, not to the scene: what control gives back
/// depends on what the weights leave out. None for laws without shear, which are to change their shape freely.
/// Less for nearly incompressible laws, down to a tenth: see the head of the module.
pub fn default_hourglass(material: &Material, balanced: bool) -> f64 {
    let shear = material.shear_modulus();
    if shear <= 0.0 {
        return 0.0;
    }
    let coefficient = if balanced { DEFAULT_HOURGLASS } else { DEFAULT_HOURGLASS_UNBALANCED };
    let lame = material.density * material.wave_speed().powi(2) - 2.0 * shear;
    let compressibility = COMPRESSIBLE * shear / lame.max(f64::MIN_POSITIVE);
    coefficient * compressibility.clamp(LEAST_SHARE, 1.0)
}

/// The pairs of one body that has the control.
#[derive(Debug, Clone, PartialEq)]
struct Part {
    particles: Range<usize>,
    /// First entry of the body in the neighbour lists.
    first: usize,
    /// `k_ab` of every entry of the body, N/m; 0 for a particle with itself.
    stiffness: Vec<f64>,
}

/// Sums over a particle's pairs for the size of rounding errors.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sums {
    /// `Σ k`, N/m.
    stiffness: f64,
    /// `Σ k |X|`, N.
    force: f64,
    /// `Σ k |X|²`, N m.
    moment: f64,
}

/// Pair table of the hourglass control.
#[derive(Debug, Clone, PartialEq)]
pub struct Hourglass<const D: usize> {
    parts: Vec<Part>,
    positions: Vec<Vector<D>>,
    sums: Vec<Sums>,
    frequency: f64,
}

impl<const D: usize> Hourglass<D> {
    /// Builds the table for the bodies that have a coefficient which is not zero; `None` if there is none. `moduli`
    /// and `masses` are those of the particles, Pa and kg.
    pub fn build(
        bodies: &[Body],
        particles: &Particles<D>,
        neighbourhood: &Neighbourhood,
        moduli: &[f64],
        masses: &[f64],
    ) -> Option<Self> {
        let positions = &particles.positions;
        let parts: Vec<Part> = bodies
            .iter()
            .filter_map(|body| body.hourglass.map(|coefficient| (body, coefficient)))
            .filter(|(body, coefficient)| *coefficient != 0.0 && !body.particles.is_empty())
            .map(|(body, coefficient)| {
                let length = body.smoothing * body.spacing;
                let pair = |a: usize, b: usize| {
                    if a == b {
                        return 0.0;
                    }
                    // Symmetric to the bit in a and b: the forces of a pair then cancel to the bit, too.
                    let squared = (positions[b] - positions[a]).norm_squared();
                    let volumes = particles.volumes[a] * particles.volumes[b];
                    let modulus = 0.5 * (moduli[a] + moduli[b]);
                    coefficient * modulus * volumes * kernel::value(body.kernel, D, squared.sqrt(), length) / squared
                };
                let stiffness = body
                    .particles
                    .clone()
                    .into_par_iter()
                    .flat_map_iter(|a| neighbourhood.of(a).iter().map(move |&b| pair(a, b as usize)))
                    .collect();
                Part {
                    particles: body.particles.clone(),
                    first: neighbourhood.row(body.particles.start).start,
                    stiffness,
                }
            })
            .collect();
        if parts.is_empty() {
            return None;
        }
        let mut table = Self { parts, positions: positions.clone(), sums: Vec::new(), frequency: 0.0 };
        table.sums = (0..positions.len()).map(|a| table.sums_at(a, neighbourhood)).collect();
        let largest = table.sums.iter().zip(masses).map(|(sums, m)| 2.0 * sums.stiffness / m).fold(0.0, f64::max);
        table.frequency = largest.sqrt();
        Some(table)
    }

    fn sums_at(&self, a: usize, neighbourhood: &Neighbourhood) -> Sums {
        self.pairs(a, neighbourhood).fold(Sums::default(), |sums, (_, k, separation)| Sums {
            stiffness: sums.stiffness + k,
            force: sums.force + k * separation.norm(),
            moment: sums.moment + k * separation.norm_squared(),
        })
    }

    /// `k_ab` of the entries of a particle's row, N/m; empty for a body without control.
    fn stiffness_of(&self, a: usize, neighbourhood: &Neighbourhood) -> &[f64] {
        let row = neighbourhood.row(a);
        match self.parts.iter().find(|part| part.particles.contains(&a)) {
            Some(part) => &part.stiffness[row.start - part.first..row.end - part.first],
            None => &[],
        }
    }

    /// Neighbour, `k_ab` and `X_b − X_a` of all pairs of a particle in the order of its row, itself included
    /// with zeros; none for a body without control.
    #[inline]
    pub fn pairs<'a>(
        &'a self,
        a: usize,
        neighbourhood: &'a Neighbourhood,
    ) -> impl Iterator<Item = (usize, f64, Vector<D>)> + 'a {
        let here = self.positions[a];
        let row = neighbourhood.of(a).iter().zip(self.stiffness_of(a, neighbourhood));
        row.map(move |(&b, &k)| (b as usize, k, self.positions[b as usize] - here))
    }

    /// `T_a`, N m, from displacements and `G_a = F_a − I`; or its variation, from theirs.
    #[inline]
    pub fn stress(&self, a: usize, near: &Neighbourhood, displacement: &[f64], gradient: &Tensor<D>) -> Tensor<D> {
        let mut sum = Tensor::zeros();
        for (b, k, separation) in self.pairs(a, near) {
            let miss = gradient * separation - jump::<D>(displacement, a, b);
            sum += outer(&miss, &(separation * (0.5 * k)));
        }
        sum
    }

    /// The pair forces `−Σ_b ½ k_ab (e_ab − e_ba)` on a particle, N, from displacements and all `G_b = F_b − I`;
    /// or their variation. The force of `T` comes with that of the stress.
    #[inline]
    pub fn force(
        &self,
        a: usize,
        near: &Neighbourhood,
        displacement: &[f64],
        gradient: impl Fn(usize) -> Tensor<D>,
    ) -> Vector<D> {
        let own = gradient(a);
        let mut sum = Vector::zeros();
        for (b, k, separation) in self.pairs(a, near) {
            let mean = (own + gradient(b)) * 0.5;
            sum -= (mean * separation - jump::<D>(displacement, a, b)) * k;
        }
        sum
    }

    /// Gradient of displacements at a particle, and its `T`, in one pass over the neighbours.
    #[inline]
    pub fn gradient_and_stress(
        &self,
        a: usize,
        gradient: &Gradient<D>,
        displacement: &[f64],
    ) -> (Tensor<D>, Tensor<D>) {
        let near = &gradient.neighbourhood;
        let stiffness = self.stiffness_of(a, near);
        if stiffness.is_empty() {
            return (gradient.of(a, displacement), Tensor::zeros());
        }
        let (here, own) = (self.positions[a], vector_at::<D>(displacement, a));
        let (mut out, mut jumps, mut spread) = (Tensor::zeros(), Tensor::zeros(), Tensor::zeros());
        for ((&b, weight), k) in near.of(a).iter().zip(gradient.weights_of(a)).zip(stiffness) {
            let there = vector_at::<D>(displacement, b as usize);
            let separation = self.positions[b as usize] - here;
            let scaled = separation * (0.5 * k);
            out += outer(&there, weight);
            jumps += outer(&(there - own), &scaled);
            spread += outer(&separation, &scaled);
        }
        (out, out * spread - jumps)
    }

    /// Force on a particle by stresses times volume, T included, and by its pairs, in one pass over the neighbours.
    #[inline]
    pub fn variation(
        &self,
        a: usize,
        gradient: &Gradient<D>,
        displacement: &[f64],
        stress: &[Tensor<D>],
        gradients: &[Tensor<D>],
    ) -> Vector<D> {
        let near = &gradient.neighbourhood;
        let stiffness = self.stiffness_of(a, near);
        if stiffness.is_empty() {
            return -gradient.transposed_of(a, stress);
        }
        let (here, own, mean) = (self.positions[a], vector_at::<D>(displacement, a), gradients[a]);
        let (mut sum, mut around) = (Vector::zeros(), Vector::zeros());
        for (entry, &k) in near.row(a).zip(stiffness) {
            let b = near.neighbour(entry);
            let scaled = (self.positions[b] - here) * (0.5 * k);
            around += scaled;
            sum += (vector_at::<D>(displacement, b) - own) * k;
            sum -= gradients[b] * scaled + stress[b] * gradient.transposed_weight(entry);
        }
        sum - mean * around
    }

    /// The particle's part of Π, J.
    #[inline]
    pub fn energy(&self, a: usize, near: &Neighbourhood, displacement: &[f64], gradient: &Tensor<D>) -> f64 {
        let miss =
            |b: usize, separation: Vector<D>| (gradient * separation - jump::<D>(displacement, a, b)).norm_squared();
        self.pairs(a, near).map(|(b, k, separation)| 0.25 * k * miss(b, separation)).sum()
    }

    /// Bound of the frequency that the control alone gives to the particles, 1/s: `ω² = max_a 2 Σ_b k_ab/m_a`,
    /// which a sawtooth attains where gradients do not see it at all.
    pub fn frequency(&self) -> f64 {
        self.frequency
    }

    /// Size of a particle's summands before they cancel, N: gradients of norm `stretch` over a reach of
    /// `Σ_b |g_ab|`, displacements of size `moved`, m.
    pub fn summands(&self, a: usize, stretch: f64, moved: f64, reach: f64) -> f64 {
        let sums = &self.sums[a];
        stretch * sums.force + moved * sums.stiffness + 0.5 * reach * (stretch * sums.moment + moved * sums.force)
    }

    /// Entries of the table.
    pub fn entries(&self) -> usize {
        self.parts.iter().map(|part| part.stiffness.len()).sum()
    }
}

/// `u_b − u_a`.
#[inline]
fn jump<const D: usize>(displacement: &[f64], a: usize, b: usize) -> Vector<D> {
    Vector::from_fn(|i, _| displacement[b * D + i] - displacement[a * D + i])
}
