//! Where the volume ratio of a particle comes from.
//!
//! With `H = cof F` the rate equation `J̇ = H:L` is the time derivative of det F, and with `H = J F⁻ᵀ` it is that of
//! `ln det F`. Without D_p it therefore has an integral,
//!
//! ```text
//! H = cof F:     J = det F + k,    k = J₀ − det F₀          P = −p(J) cof F   = ∂ψ(det F + k)/∂F
//! H = J F⁻ᵀ:     J = k det F,      k = J₀/det F₀            P = −p(J) k cof F = ∂ψ(k det F)/∂F
//! ```
//!
//! and there is nothing to evolve: a scheme has fewer equations, no gradient of the velocity is needed for J, and the
//! stress is the derivative of an energy of F, whose tangent is symmetric. Evolved, J carries the time error of the
//! scheme, which makes the tangent of an eliminated J slightly unsymmetric.
//!
//! The slots of J in a state are not used where J is not evolved, and keep their initial values.

use std::borrow::Cow;

use rayon::prelude::*;

use super::evaluation::GRAIN;
use super::{Model, Unknowns};
use crate::setup::{Body, CofactorChoice, VolumeRatioChoice};
use crate::tensor::{Tensor, determinant};

/// Whether the volume ratio of a body has to be evolved. `coupled`: D_p acts.
pub(super) fn is_evolved(body: &Body, unknowns: Unknowns, coupled: bool) -> bool {
    let solved_for = coupled || unknowns != Unknowns::Velocity;
    match body.volume_ratio {
        VolumeRatioChoice::Determinant => solved_for,
        _ if solved_for => true,
        // Nothing but the output reads it.
        _ if !body.material.evolves_volume() => false,
        VolumeRatioChoice::Evolved => true,
        VolumeRatioChoice::Auto => body.cofactor == CofactorChoice::Evolved,
    }
}

impl<const D: usize> Model<D> {
    /// Whether the volume ratio of a particle is a part of the state, with a rate of its own.
    pub fn evolves_volume(&self, particle: usize) -> bool {
        self.evolved[self.body_of[particle] as usize]
    }

    /// Whether a particle's law reads the velocity gradient; in a conserving step for the increment of J.
    #[inline]
    pub(super) fn needs_velocity_gradient(&self, particle: usize, conserving: bool) -> bool {
        let material = self.material(particle);
        material.viscosity.is_some() || self.evolves_volume(particle) || conserving && material.evolves_volume()
    }

    /// The constant k of the head of this file for a volume ratio at a determinant; `None` where there is none.
    pub(super) fn volume_constant(&self, particle: usize, ratio: f64, determinant: f64) -> Option<f64> {
        match self.cofactor_choice(particle) {
            CofactorChoice::Geometric => Some(ratio - determinant),
            CofactorChoice::Evolved => (determinant != 0.0).then(|| ratio / determinant),
        }
    }

    /// The constant k of a particle that follows the determinant.
    #[inline]
    pub(super) fn initial_volume_constant(&self, particle: usize) -> f64 {
        self.volume_constants.get(particle).copied().unwrap_or(match self.cofactor_choice(particle) {
            CofactorChoice::Geometric => 0.0,
            CofactorChoice::Evolved => 1.0,
        })
    }

    /// J at a determinant, and `H / cof F`, from the constant k.
    #[inline]
    pub(super) fn follow(&self, particle: usize, constant: f64, determinant: f64) -> (f64, f64) {
        match self.cofactor_choice(particle) {
            CofactorChoice::Geometric => (determinant + constant, 1.0),
            CofactorChoice::Evolved => (determinant * constant, constant),
        }
    }

    /// Volume ratio of a particle in a state, given its deformation gradient.
    pub(super) fn volume_ratio_in(&self, state: &[f64], particle: usize, deformation: &Tensor<D>) -> f64 {
        if self.evolves_volume(particle) {
            return state[2 * self.particles() * D + particle];
        }
        self.follow(particle, self.initial_volume_constant(particle), determinant(deformation)).0
    }

    /// Volume ratio of a particle in a state.
    pub fn volume_ratio(&self, state: &[f64], particle: usize) -> f64 {
        if self.evolves_volume(particle) {
            return state[2 * self.particles() * D + particle];
        }
        self.volume_ratio_in(state, particle, &self.deformation(state, particle))
    }

    /// Volume ratios of a state: those that are part of it, or those that follow from its displacements.
    pub fn volume_ratios<'a>(&self, state: &'a [f64]) -> Cow<'a, [f64]> {
        if self.evolved.iter().all(|&evolved| evolved) {
            return Cow::Borrowed(&state[2 * self.particles() * D..]);
        }
        let all = (0..self.particles()).into_par_iter().with_min_len(GRAIN);
        Cow::Owned(all.map(|a| self.volume_ratio(state, a)).collect())
    }
}
