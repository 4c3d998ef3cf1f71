//! Derivatives of every term at a frozen point, and the tangent's action without entries.
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

use std::time::Instant;

use nicolson_solvers::linear::{Effort, Places, SparsePattern, Symmetry, Tangent};
use rayon::prelude::*;

use super::assembly::{Buffers, OneRing};
use super::evaluation::{GRAIN, Point};
use super::slots::Slots;
use super::{Clocks, Model, Unknowns};
use crate::setup::CofactorChoice;
use crate::stabilisation::{PressurePair, PressureStates, VelocityPair};
use crate::tensor::{
    Tensor, Tensor4, Vector, add4, apply4, cofactor_variation, contract, outer, smallest_stretch, tensor4_of,
};

/// Derivatives at one particle.
#[derive(Debug, Clone)]
pub struct Frozen<const D: usize> {
    /// The point of linearisation.
    pub point: Point<D>,
    /// `V ∂P/∂F`, with J eliminated if it is not an unknown.
    pub stress_by_gradient: Tensor4<D>,
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
#[derive(Debug, Clone, Default)]
pub struct Linearisation<const D: usize> {
    /// Shift of the stage that was linearised.
    pub shift: f64,
    /// Whether it was an equilibrium.
    pub at_rest: bool,
    /// Derivatives, per particle.
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
}

/// Variations of the fields, full length.
struct Variation<'a, const D: usize> {
    displacement: &'a [f64],
    /// Of the displacements; empty without hourglass control.
    gradients: &'a [Tensor<D>],
    velocity: &'a [f64],
    volume: &'a [f64],
}

/// Variations at one particle that its neighbours read.
#[derive(Clone, Copy)]
struct PointVariation<const D: usize> {
    stress: Tensor<D>,
    cofactor: Tensor<D>,
    pressure: f64,
    speed: f64,
    rate: f64,
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
        let points = &self.workspace.points;
        (0..n)
            .into_par_iter()
            .with_min_len(GRAIN)
            .map(|a| model.derivatives(a, points[a], shift))
            .collect_into_vec(&mut frozen.particles);
        frozen.viscous.clear();
        if self.terms.stress && self.materials.iter().any(|(law, _)| law.viscosity.is_some()) {
            frozen.viscous.extend((0..n).map(|a| model.viscous_tangent(a, &points[a])));
        }
        self.linearisation = frozen;
    }

    fn derivatives(&self, a: usize, point: Point<D>, shift: f64) -> Frozen<D> {
        let material = self.material(a);
        let volume = self.setup.particles.volumes[a];
        let evolves = self.evolves_volume(a);
        let evolved = evolves && self.cofactor_choice(a) == CofactorChoice::Evolved;
        let (stress, rate) = (self.terms.stress, self.terms.volume_rate && evolves);
        let along = |direction: &Tensor<D>| self.cofactor_along(a, &point, direction);

        let cofactor_by_volume = if evolved { point.cofactor / point.volume_ratio } else { Tensor::zeros() };
        let pressure_slope = material.pressure_slope(point.volume_ratio);
        let stress_by_volume = if stress {
            (point.cofactor * pressure_slope + cofactor_by_volume * point.pressure) * -volume
        } else {
            Tensor::zeros()
        };
        let (rate_by_gradient, rate_by_volume) = if rate {
            (along(&point.velocity_gradient), contract(&cofactor_by_volume, &point.velocity_gradient))
        } else {
            (Tensor::zeros(), 0.0)
        };
        let eliminated = self.unknowns.kind() == Unknowns::Velocity;
        let chain = if self.stage.at_rest || !evolves {
            // δJ = H : δF.
            point.cofactor
        } else if eliminated && rate {
            (point.cofactor + rate_by_gradient * shift) / (1.0 - shift * rate_by_volume)
        } else {
            Tensor::zeros()
        };
        let mut stress_by_gradient = [[Tensor::zeros(); D]; D];
        if stress {
            // A point without a tangent has no stress either, and was refused when it was evaluated.
            let start = self.stage.start.get(a).and_then(|start| Some((start, start.secant(&point.deformation)?)));
            if material.evolves_volume() {
                stress_by_gradient = match &start {
                    Some((start, step)) => self.conserving_tangent(a, start, step, point.volume_ratio),
                    None => tensor4_of(|direction| along(direction) * -point.pressure),
                };
                for entry in stress_by_gradient.iter_mut().flatten() {
                    *entry *= volume;
                }
                if eliminated && start.is_none() {
                    // P depends on F through J, too: ∂P/∂J ⊗ ∂J/∂F.
                    for (i, row) in stress_by_gradient.iter_mut().enumerate() {
                        for (j, entry) in row.iter_mut().enumerate() {
                            *entry += chain * stress_by_volume[(i, j)];
                        }
                    }
                }
            }
            if let Some(solid) = &material.solid {
                let tangent = match &start {
                    Some((_, step)) => Some(solid.conserving_tangent(step)),
                    None => solid.tangent(&point.deformation),
                };
                tangent.iter().for_each(|tangent| add4(&mut stress_by_gradient, tangent, volume));
            }
        }
        if stress && let Some(viscosity) = &material.viscosity {
            let (by_deformation, _) = viscosity.tangents(&point.deformation, &point.velocity_gradient);
            add4(&mut stress_by_gradient, &by_deformation, volume);
        }
        let deformed = self.upwind.as_ref().is_some_and(|upwind| upwind.options.deformed_wave_speed);
        let speed_by_gradient = if deformed {
            let (lambda, u) = smallest_stretch(&point.deformation);
            outer(&(point.deformation * u), &u) * (-point.wave_speed / lambda)
        } else {
            Tensor::zeros()
        };
        Frozen {
            point,
            stress_by_gradient,
            stress_by_volume,
            rate_by_gradient,
            rate_by_volume,
            cofactor_by_volume,
            pressure_slope,
            speed_by_gradient,
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

    /// Variations of the fields for a variation of the unknowns.
    fn vary_fields(&self, v: &[f64]) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let (n, s) = (self.particles(), self.linearisation.shift);
        let mut displacement = vec![0.0; n * D];
        let mut velocity = vec![0.0; n * D];
        let mut volume = Vec::new();
        if self.unknowns.kind() != Unknowns::Velocity {
            volume.resize(n, 0.0);
        }
        for a in 0..n {
            for i in 0..D {
                if let Some(unknown) = self.unknowns.velocity(a, i) {
                    velocity[a * D + i] = if self.linearisation.at_rest { 0.0 } else { v[unknown] };
                    displacement[a * D + i] = s * v[self.unknowns.displacement(a, i).unwrap_or(unknown)];
                }
            }
            if let Some(unknown) = self.unknowns.volume_ratio(a) {
                volume[a] = v[unknown] / self.volume_unit(a);
            }
        }
        (displacement, velocity, volume)
    }

    fn vary_point(&self, a: usize, field: &Variation<'_, D>) -> PointVariation<D> {
        let frozen = &self.linearisation.particles[a];
        let gradient = field.gradients.get(a).copied().unwrap_or_else(|| self.gradient.of(a, field.displacement));
        let mut out = PointVariation {
            stress: apply4(&frozen.stress_by_gradient, &gradient),
            cofactor: Tensor::zeros(),
            pressure: 0.0,
            speed: contract(&frozen.speed_by_gradient, &gradient),
            rate: 0.0,
        };
        if let Some(viscous) = self.linearisation.viscous.get(a) {
            out.stress += apply4(viscous, &self.gradient.of(a, field.velocity));
        }
        if let Some(control) = self.active_hourglass() {
            out.stress += control.stress(a, &self.gradient.neighbourhood, field.displacement, &gradient);
        }
        if let Some(&volume) = field.volume.get(a) {
            let velocity_gradient = self.gradient.of(a, field.velocity);
            out.stress += frozen.stress_by_volume * volume;
            out.cofactor = self.cofactor_along(a, &frozen.point, &gradient) + frozen.cofactor_by_volume * volume;
            out.pressure = frozen.pressure_slope * volume;
            if self.terms.volume_rate {
                out.rate = contract(&frozen.point.cofactor, &velocity_gradient)
                    + contract(&frozen.rate_by_gradient, &gradient)
                    + frozen.rate_by_volume * volume;
            }
        }
        out
    }

    /// Variation of the interface jumps' slopes, for reconstruction.
    fn vary_slopes(&self, velocity: &[f64], points: &[PointVariation<D>]) -> Vec<(Tensor<D>, Vector<D>)> {
        let Some(upwind) = self.upwind.as_ref().filter(|u| u.options.interface.reconstructs()) else {
            return Vec::new();
        };
        (0..points.len())
            .into_par_iter()
            .with_min_len(GRAIN)
            .map(|a| self.slopes_at(upwind, a, velocity, |b| points[b].pressure))
            .collect()
    }

    /// Variation of force and rate of J at one particle.
    fn vary_rates(
        &self,
        a: usize,
        field: &Variation<'_, D>,
        points: &[PointVariation<D>],
        stress: &[Tensor<D>],
        slopes: &[(Tensor<D>, Vector<D>)],
    ) -> (Vector<D>, f64) {
        let mut force = -self.gradient.transposed_of(a, stress);
        let mut rate = points[a].rate;
        if let Some(control) = self.active_hourglass() {
            let near = &self.gradient.neighbourhood;
            force += control.force(a, near, field.displacement, |b| field.gradients[b]);
        }
        let Some(upwind) = self.upwind.as_ref() else { return (force, rate) };
        for entry in self.gradient.neighbourhood.row(a) {
            let b = self.gradient.neighbourhood.neighbour(entry);
            let speed = 0.5 * (points[a].speed + points[b].speed);
            let separation = Vector::<D>::from_fn(|i, _| field.displacement[b * D + i] - field.displacement[a * D + i]);
            if let Some(pair) = self.frozen_velocity_pair(entry, a, b) {
                let jump = Self::velocity_jump(upwind, (a, b), field.velocity, slopes);
                force += pair.by_speed * speed + pair.by_separation * separation;
                force += pair.by_difference * jump.difference + pair.by_increment * jump.increment;
            }
            if let Some(pair) = self.frozen_pressure_pair(entry, a, b) {
                let PressureStates { particle, increment } =
                    Self::pressure_states(upwind, (a, b), [points[a].pressure, points[b].pressure], slopes);
                rate += pair.by_speed * speed
                    + pair.by_pressure[0] * particle[0]
                    + pair.by_pressure[1] * particle[1]
                    + pair.by_increment[0] * increment[0]
                    + pair.by_increment[1] * increment[1]
                    + contract(&pair.by_cofactor[0], &points[a].cofactor)
                    + contract(&pair.by_cofactor[1], &points[b].cofactor)
                    + pair.by_separation.dot(&separation);
            }
        }
        (force, rate)
    }
}

impl<const D: usize> Tangent for Model<D> {
    fn size(&self) -> usize {
        self.unknowns.count()
    }

    fn symmetry(&self) -> Symmetry {
        self.declared(self.problem()).symmetry
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        let (n, s) = (self.particles(), self.linearisation.shift);
        let (displacement, velocity, volume) = self.vary_fields(v);
        let gradients = self.hourglass_gradients(&displacement);
        let field =
            Variation { displacement: &displacement, gradients: &gradients, velocity: &velocity, volume: &volume };
        let points: Vec<PointVariation<D>> =
            (0..n).into_par_iter().with_min_len(GRAIN).map(|a| self.vary_point(a, &field)).collect();
        let stress: Vec<Tensor<D>> = points.iter().map(|point| point.stress).collect();
        let slopes = self.vary_slopes(&velocity, &points);
        let rates: Vec<(Vector<D>, f64)> = (0..n)
            .into_par_iter()
            .with_min_len(GRAIN)
            .map(|a| self.vary_rates(a, &field, &points, &stress, &slopes))
            .collect();
        for (a, (force, rate)) in rates.iter().enumerate() {
            let mass = if self.linearisation.at_rest { 0.0 } else { self.masses[a] };
            for i in 0..D {
                if let Some(row) = self.unknowns.velocity(a, i) {
                    out[row] = mass * v[row] - s * force[i];
                    if let Some(displacement) = self.unknowns.displacement(a, i) {
                        out[displacement] = mass * (v[displacement] - v[row]);
                    }
                }
            }
            if let Some(row) = self.unknowns.volume_ratio(a) {
                out[row] = mass * (v[row] - s * rate * self.volume_unit(a));
            }
        }
    }

    fn pattern(&self) -> Option<&std::sync::Arc<SparsePattern>> {
        Some(self.slots().pattern())
    }

    fn fill(&self, values: &mut [f64]) {
        let start = Instant::now();
        self.assemble(values);
        Clocks::add(&self.clocks.fill, start);
    }

    fn blocks(&self) -> &[usize] {
        self.unknowns.starts()
    }

    fn places(&self) -> Option<Places> {
        let coordinates = self.setup.particles.positions.iter().flat_map(|x| x.iter().copied()).collect();
        Some(Places { dimension: D, coordinates })
    }

    /// Measured per pair and per pair of pairs (`benches/factors.rs`).
    fn effort(&self) -> Option<Effort> {
        let neighbourhood = &self.gradient.neighbourhood;
        let (particles, pairs) = (self.particles().max(1) as f64, neighbourhood.pairs() as f64);
        let near = pairs / particles;
        let dimension = D as f64;
        let entries = match self.linearisation.slots.get() {
            Some(slots) => slots.pattern().entries() as f64,
            None => {
                let ring = (2.0 * near.powf(1.0 / dimension) - 1.0).powi(D as i32);
                (self.unknowns.count() as f64).powi(2) / particles * ring
            }
        };
        let terms = if self.upwind.is_some() { 2.0 } else { 1.0 };
        Some(Effort {
            action: terms * pairs * (40.0 * dimension + 10.0) * 1e-9,
            assembly: pairs * near * 12.0 * dimension * 1e-9,
            entries,
        })
    }

    fn sparser(&self) -> Option<&dyn Tangent> {
        Some(self.linearisation.one_ring.get_or_init(|| self.one_ring()))
    }
}
