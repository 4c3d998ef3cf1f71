//! Derivatives of every term at a frozen point.
//!
//! Per particle, with `P = −p(J) H` and `H` a function of F (and of J in the evolved form):
//!
//! ```text
//! ∂P/∂F : A = −p (∂H/∂F : A)                 ∂P/∂J = −p′ H − p ∂H/∂J
//! ∂J̇/∂L = H,   ∂J̇/∂F = ∂H/∂F : L,   ∂J̇/∂J = ∂H/∂J : L
//! cof F:   ∂H/∂F : A = ∂cof(F) : A,  ∂H/∂J = 0
//! J F⁻ᵀ:   ∂H/∂F : A = −J F⁻ᵀ Aᵀ F⁻ᵀ,  ∂H/∂J = F⁻ᵀ
//! c_p:     ∂c/∂F = −c⁰ λ^{−3/2} (F u) ⊗ u     (λ, u smallest eigenpair of FᵀF; (6.22) with its slip mended)
//! ```
//!
//! All `∂H/∂F` are self-adjoint. Where J is eliminated from the stage, `δJ = (H + s ∂J̇/∂F) : δF / (1 −
//! s ∂J̇/∂J)`, because `δF = s δL`; that chain is folded into the derivative of the stress.

use std::sync::Arc;

use nicolson_solvers::Snapshot;
use nicolson_solvers::linear::SparsePattern;
use rayon::prelude::*;

use super::action::ScratchPool;
use super::assembly::{Buffers, OneRing};
use super::evaluation::GRAIN;
use super::law::Point;
use super::slots::Slots;
use super::stress_tangents::StressTangents;
use super::{Model, Unknowns};
use crate::setup::CofactorChoice;
use crate::stabilisation::{PressurePair, VelocityPair};
use crate::tensor::{Tensor, Tensor4, Vector, add4, cofactor_variation, contract, outer, smallest_stretch};

/// Derivatives at one particle beside that of the stress with respect to F.
#[derive(Debug, Clone)]
pub struct Frozen<const D: usize> {
    /// The point of linearisation.
    pub point: Point<D>,
    /// `V ∂P/∂J`; used only where J is an unknown.
    pub stress_by_volume: Tensor<D>,
    /// `∂J̇/∂F` of the term H:L.
    pub rate_by_gradient: Tensor<D>,
    /// `∂J̇/∂J` of the term H:L.
    pub rate_by_volume: f64,
    /// `∂H/∂J`.
    pub cofactor_by_volume: Tensor<D>,
    /// `dp/dJ`.
    pub pressure_slope: f64,
    /// `∂c/∂F`; zero for a constant wave speed.
    pub speed_by_gradient: Tensor<D>,
}

/// Volume times `∂P/∂L` of the viscosities, per particle; empty without any.
pub type ViscousTangents<const D: usize> = Vec<Tensor4<D>>;

/// The linearised system.
#[derive(Debug, Default)]
pub struct Linearisation<const D: usize> {
    /// Shift of the stage that was linearised.
    pub shift: f64,
    /// Whether it was an equilibrium.
    pub at_rest: bool,
    /// Whether derivatives of a point are there.
    pub taken: bool,
    /// The point, if it is to be kept in mind; see `point`.
    pub point: Option<Arc<Snapshot>>,
    /// `V ∂P/∂F` of all particles, with J eliminated if it is not an unknown.
    pub stress: StressTangents<D>,
    /// The other derivatives; empty where the stress is all there is: velocities alone, without stabilisation.
    pub particles: Vec<Frozen<D>>,
    /// See [`ViscousTangents`].
    pub viscous: ViscousTangents<D>,
    /// Displacements and velocities at the point; kept only for pair terms.
    pub displacement: Vec<f64>,
    /// See `displacement`.
    pub velocity: Vec<f64>,
    /// Reconstruction slopes at the point.
    pub slopes: Vec<(Tensor<D>, Vector<D>)>,
    /// Pattern of the entries and where the parts of a row go; built at the first request.
    pub slots: std::sync::OnceLock<Slots>,
    /// The hourglass control's part of the entries, see `hourglass`; built at the first assembly that has it.
    pub hourglass: std::sync::OnceLock<Vec<f64>>,
    /// Buffers of the assembly.
    pub buffers: Buffers<D>,
    /// One-ring part of the tangent at the point; built at the first request.
    pub one_ring: std::sync::OnceLock<OneRing>,
    /// Pattern of the one-ring part; built once.
    pub one_ring_pattern: std::sync::OnceLock<std::sync::Arc<SparsePattern>>,
    /// Work space of the tangent's action.
    pub scratch: ScratchPool<D>,
}

impl<const D: usize> Model<D> {
    /// `∂H/∂F : A` at a particle.
    pub(super) fn cofactor_along(&self, a: usize, point: &Point<D>, direction: &Tensor<D>) -> Tensor<D> {
        match self.cofactor_choice(a) {
            CofactorChoice::Geometric => cofactor_variation(&point.deformation, direction),
            // H = k cof F.
            CofactorChoice::Evolved if !self.evolves_volume(a) => {
                cofactor_variation(&point.deformation, direction) * self.initial_volume_constant(a)
            }
            CofactorChoice::Evolved => {
                // H = J F⁻ᵀ: −J F⁻ᵀ Aᵀ F⁻ᵀ = −H Aᵀ H / J.
                -(point.cofactor * direction.transpose() * point.cofactor) / point.volume_ratio
            }
        }
    }

    /// Takes the derivatives at the point of the workspace.
    pub(super) fn freeze(&mut self) {
        let mut frozen = std::mem::take(&mut self.linearisation);
        frozen.shift = self.stage.shift;
        frozen.at_rest = self.stage.at_rest;
        frozen.point = self.keeps_points.then(|| Arc::new(self.point()));
        frozen.one_ring.take();
        let n = self.particles();
        if self.upwind.is_some() {
            frozen.displacement.clear();
            frozen.displacement.extend_from_slice(&self.stage.trial[..n * D]);
            frozen.velocity.clear();
            frozen.velocity.extend_from_slice(&self.stage.trial[n * D..2 * n * D]);
            frozen.slopes.clone_from(&self.workspace.slopes);
        }
        let (model, shift) = (&*self, frozen.shift);
        model.freeze_stress(&mut frozen.stress, shift);
        let points = &self.workspace.points;
        let coupled = self.upwind.is_some() || self.unknowns.kind() != Unknowns::Velocity;
        (0..if coupled { n } else { 0 })
            .into_par_iter()
            .with_min_len(GRAIN)
            .map(|a| model.derivatives(a, points[a]))
            .collect_into_vec(&mut frozen.particles);
        frozen.viscous.clear();
        if self.terms.stress && self.materials.iter().any(|(law, _)| law.viscosity.is_some()) {
            frozen.viscous.extend((0..n).map(|a| model.viscous_tangent(a, &points[a])));
        }
        frozen.taken = true;
        self.linearisation = frozen;
    }

    /// `∂J̇/∂F` and `∂J̇/∂J` of the term H:L.
    fn rate_slopes(&self, a: usize, point: &Point<D>) -> (Tensor<D>, f64) {
        if !(self.terms.volume_rate && self.evolves_volume(a)) {
            return (Tensor::zeros(), 0.0);
        }
        let by_gradient = self.cofactor_along(a, point, &point.velocity_gradient);
        (by_gradient, contract(&self.cofactor_by_volume(a, point), &point.velocity_gradient))
    }

    /// `∂H/∂J`.
    fn cofactor_by_volume(&self, a: usize, point: &Point<D>) -> Tensor<D> {
        match self.cofactor_choice(a) {
            CofactorChoice::Evolved if self.evolves_volume(a) => point.cofactor / point.volume_ratio,
            CofactorChoice::Evolved | CofactorChoice::Geometric => Tensor::zeros(),
        }
    }

    /// `V ∂P/∂J`.
    pub(super) fn stress_by_volume(&self, a: usize, point: &Point<D>) -> Tensor<D> {
        if !self.terms.stress {
            return Tensor::zeros();
        }
        let slope = self.material(a).pressure_slope(point.volume_ratio);
        (point.cofactor * slope + self.cofactor_by_volume(a, point) * point.pressure) * -self.setup.particles.volumes[a]
    }

    /// `∂J/∂F` where J is eliminated, else zero.
    pub(super) fn volume_chain(&self, a: usize, point: &Point<D>, shift: f64) -> Tensor<D> {
        let eliminated = self.unknowns.kind() == Unknowns::Velocity;
        if self.stage.at_rest || !self.evolves_volume(a) {
            // δJ = H : δF.
            point.cofactor
        } else if eliminated && self.terms.volume_rate {
            let (by_gradient, by_volume) = self.rate_slopes(a, point);
            (point.cofactor + by_gradient * shift) / (1.0 - shift * by_volume)
        } else {
            Tensor::zeros()
        }
    }

    fn derivatives(&self, a: usize, point: Point<D>) -> Frozen<D> {
        let (rate_by_gradient, rate_by_volume) = self.rate_slopes(a, &point);
        let deformed = self.upwind.as_ref().is_some_and(|upwind| upwind.options.deformed_wave_speed);
        let speed_by_gradient = if deformed {
            let (lambda, u) = smallest_stretch(&point.deformation);
            outer(&(point.deformation * u), &u) * (-point.wave_speed / lambda)
        } else {
            Tensor::zeros()
        };
        Frozen {
            stress_by_volume: self.stress_by_volume(a, &point),
            rate_by_gradient,
            rate_by_volume,
            cofactor_by_volume: self.cofactor_by_volume(a, &point),
            pressure_slope: self.material(a).pressure_slope(point.volume_ratio),
            speed_by_gradient,
            point,
        }
    }

    /// Volume times `∂P_v/∂L`.
    fn viscous_tangent(&self, a: usize, point: &Point<D>) -> Tensor4<D> {
        let mut out = [[Tensor::zeros(); D]; D];
        if let Some(viscosity) = &self.material(a).viscosity {
            let (_, by_rate) = viscosity.tangents(&point.deformation, &point.velocity_gradient);
            add4(&mut out, &by_rate, self.setup.particles.volumes[a]);
        }
        out
    }

    /// D_v of an entry at the frozen point; `None` without D_v or for a self-entry.
    pub(super) fn frozen_velocity_pair(&self, entry: usize, a: usize, b: usize) -> Option<VelocityPair<D>> {
        let upwind = self.upwind.as_ref().filter(|u| a != b && u.has_velocity() && self.terms.velocity_upwind)?;
        let frozen = &self.linearisation;
        let speed = 0.5 * (frozen.particles[a].point.wave_speed + frozen.particles[b].point.wave_speed);
        let jump = Self::velocity_jump(upwind, (a, b), &frozen.velocity, &frozen.slopes);
        Some(upwind.velocity_pair(entry, (a, b), &frozen.displacement, speed, &jump))
    }

    /// D_p of an entry at the frozen point; `None` without D_p or for a self-entry.
    pub(super) fn frozen_pressure_pair(&self, entry: usize, a: usize, b: usize) -> Option<PressurePair<D>> {
        let upwind = self.upwind.as_ref().filter(|u| a != b && u.has_pressure() && self.terms.pressure_upwind)?;
        let frozen = &self.linearisation;
        let (own, other) = (&frozen.particles[a].point, &frozen.particles[b].point);
        let speed = 0.5 * (own.wave_speed + other.wave_speed);
        let pressure = Self::pressure_states(upwind, (a, b), [own.pressure, other.pressure], &frozen.slopes);
        let entries = (entry, self.gradient.neighbourhood.twin(entry));
        let cofactors = [&own.cofactor, &other.cofactor];
        Some(upwind.pressure_pair(entries, (a, b), &frozen.displacement, speed, &pressure, cofactors))
    }
}
