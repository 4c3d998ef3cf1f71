//! The tangent as an operator: its action in two sweeps, without entries, and what solvers ask of it.
//!
//! The first sweep varies the gradient and the stress of every particle, the second gathers forces and rates and
//! writes the rows of their owner. Velocities vary with displacements, `δu = s δv`, so one gradient serves both
//! unless displacements are unknowns of their own. The work space is kept between calls.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use nicolson_solvers::linear::{CoarseMatrix, Effort, Geometry, Places, SparsePattern, Symmetry, Tangent, Tents};
use rayon::prelude::*;

use super::evaluation::GRAIN;
use super::{Clocks, Model, Unknowns};
use crate::stabilisation::PressureStates;
use crate::tensor::{Tensor, Vector, apply4, contract, vector_at};

/// Work space of actions that may run at the same time.
#[derive(Debug, Default)]
pub struct ScratchPool<const D: usize>(Mutex<Vec<Scratch<D>>>);

impl<const D: usize> ScratchPool<D> {
    fn take(&self) -> Scratch<D> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default()
    }

    fn give_back(&self, scratch: Scratch<D>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
    }
}

/// Variations of one action.
#[derive(Debug, Default)]
struct Scratch<const D: usize> {
    displacement: Vec<f64>,
    /// Empty where `δu/s` serves.
    velocity: Vec<f64>,
    /// Empty unless J is an unknown.
    volume: Vec<f64>,
    stress: Vec<Tensor<D>>,
    /// Of the displacements; empty without hourglass control.
    gradients: Vec<Tensor<D>>,
    /// Empty unless [`Frozen`](super::linearisation::Frozen) is there.
    coupled: Vec<Coupled<D>>,
    slopes: Vec<(Tensor<D>, Vector<D>)>,
}

/// Variations at one particle, beside the stress, that its neighbours read.
#[derive(Debug, Clone, Copy)]
struct Coupled<const D: usize> {
    cofactor: Tensor<D>,
    pressure: f64,
    speed: f64,
    rate: f64,
}

impl<const D: usize> Coupled<D> {
    fn zero() -> Self {
        Self { cofactor: Tensor::zeros(), pressure: 0.0, speed: 0.0, rate: 0.0 }
    }
}

impl<const D: usize> Model<D> {
    /// Whether displacements follow from velocities by the factor s alone.
    fn velocities_suffice(&self) -> bool {
        self.unknowns.kind() != Unknowns::Full
    }

    /// Variations of the fields for a variation of the unknowns.
    fn vary_fields(&self, v: &[f64], scratch: &mut Scratch<D>) {
        let (n, s, at_rest) = (self.particles(), self.linearisation.shift, self.linearisation.at_rest);
        scratch.displacement.resize(n * D, 0.0);
        scratch.displacement.par_chunks_mut(D).with_min_len(GRAIN).enumerate().for_each(|(a, displacement)| {
            for (i, displacement) in displacement.iter_mut().enumerate() {
                let unknown = self.unknowns.displacement(a, i).or_else(|| self.unknowns.velocity(a, i));
                *displacement = unknown.map_or(0.0, |unknown| s * v[unknown]);
            }
        });
        if self.upwind.is_some() || !self.velocities_suffice() {
            scratch.velocity.resize(n * D, 0.0);
            scratch.velocity.par_chunks_mut(D).with_min_len(GRAIN).enumerate().for_each(|(a, velocity)| {
                for (i, velocity) in velocity.iter_mut().enumerate() {
                    let unknown = self.unknowns.velocity(a, i).filter(|_| !at_rest);
                    *velocity = unknown.map_or(0.0, |unknown| v[unknown]);
                }
            });
        }
        if self.unknowns.kind() != Unknowns::Velocity {
            scratch.volume.resize(n, 0.0);
            for (a, volume) in scratch.volume.iter_mut().enumerate() {
                *volume = self.unknowns.volume_ratio(a).map_or(0.0, |unknown| v[unknown] / self.volume_unit(a));
            }
        }
    }

    /// First sweep: gradients and stresses.
    fn vary_points(&self, scratch: &mut Scratch<D>) {
        let n = self.particles();
        let frozen = &self.linearisation;
        let Scratch { displacement, velocity, volume, stress, gradients, coupled, .. } = scratch;
        stress.resize(n, Tensor::zeros());
        gradients.resize(if self.active_hourglass().is_some() { n } else { 0 }, Tensor::zeros());
        coupled.resize(frozen.particles.len(), Coupled::zero());
        let (displacement, velocity, volume) = (&*displacement, &*velocity, &*volume);
        let vary =
            |a: usize, stress: &mut Tensor<D>, kept: Option<&mut Tensor<D>>, coupled: Option<&mut Coupled<D>>| {
                let gradient = match (kept, self.active_hourglass()) {
                    (Some(kept), Some(control)) => {
                        let (gradient, controlled) = control.gradient_and_stress(a, &self.gradient, displacement);
                        *kept = gradient;
                        *stress = controlled;
                        gradient
                    }
                    _ => {
                        *stress = Tensor::zeros();
                        self.gradient.of(a, displacement)
                    }
                };
                *stress += frozen.stress.apply(a, &gradient);
                if frozen.viscous.is_empty() && coupled.is_none() {
                    return;
                }
                let velocity_gradient = if !self.velocities_suffice() {
                    self.gradient.of(a, velocity)
                } else if frozen.at_rest {
                    Tensor::zeros()
                } else {
                    gradient / frozen.shift
                };
                if let Some(viscous) = frozen.viscous.get(a) {
                    *stress += apply4(viscous, &velocity_gradient);
                }
                let (Some(out), Some(frozen)) = (coupled, frozen.particles.get(a)) else { return };
                *out = Coupled { speed: contract(&frozen.speed_by_gradient, &gradient), ..Coupled::zero() };
                if let Some(&volume) = volume.get(a) {
                    *stress += frozen.stress_by_volume * volume;
                    out.cofactor =
                        self.cofactor_along(a, &frozen.point, &gradient) + frozen.cofactor_by_volume * volume;
                    out.pressure = frozen.pressure_slope * volume;
                    if self.terms.volume_rate {
                        out.rate = contract(&frozen.point.cofactor, &velocity_gradient)
                            + contract(&frozen.rate_by_gradient, &gradient)
                            + frozen.rate_by_volume * volume;
                    }
                }
            };
        let own = stress.par_iter_mut().with_min_len(GRAIN).enumerate();
        match (gradients.is_empty(), coupled.is_empty()) {
            (true, true) => own.for_each(|(a, stress)| vary(a, stress, None, None)),
            (false, true) => own.zip(gradients).for_each(|((a, stress), kept)| vary(a, stress, Some(kept), None)),
            (true, false) => own.zip(coupled).for_each(|((a, stress), out)| vary(a, stress, None, Some(out))),
            (false, false) => own
                .zip(gradients)
                .zip(coupled)
                .for_each(|(((a, stress), kept), out)| vary(a, stress, Some(kept), Some(out))),
        }
    }

    /// Variation of the interface jumps' slopes, for reconstruction.
    fn vary_slopes(&self, scratch: &mut Scratch<D>) {
        let Some(upwind) = self.upwind.as_ref().filter(|u| u.options.interface.reconstructs()) else { return };
        scratch.slopes.resize(self.particles(), (Tensor::zeros(), Vector::zeros()));
        let (velocity, coupled) = (&scratch.velocity, &scratch.coupled);
        scratch.slopes.par_iter_mut().with_min_len(GRAIN).enumerate().for_each(|(a, slope)| {
            *slope = self.slopes_at(upwind, a, velocity, |b| coupled[b].pressure);
        });
    }

    /// Second sweep: variation of force and rate of J at one particle.
    #[inline]
    fn vary_rates(&self, a: usize, scratch: &Scratch<D>) -> (Vector<D>, f64) {
        let mut force = match self.active_hourglass() {
            Some(control) => {
                control.variation(a, &self.gradient, &scratch.displacement, &scratch.stress, &scratch.gradients)
            }
            None => -self.gradient.transposed_of(a, &scratch.stress),
        };
        let (Some(own), true) = (scratch.coupled.get(a), !scratch.coupled.is_empty()) else { return (force, 0.0) };
        let mut rate = own.rate;
        let Some(upwind) = self.upwind.as_ref() else { return (force, rate) };
        let points = &scratch.coupled;
        for entry in self.gradient.neighbourhood.row(a) {
            let b = self.gradient.neighbourhood.neighbour(entry);
            let speed = 0.5 * (points[a].speed + points[b].speed);
            let separation = vector_at::<D>(&scratch.displacement, b) - vector_at::<D>(&scratch.displacement, a);
            if let Some(pair) = self.frozen_velocity_pair(entry, a, b) {
                let jump = Self::velocity_jump(upwind, (a, b), &scratch.velocity, &scratch.slopes);
                force += pair.by_speed * speed + pair.by_separation * separation;
                force += pair.by_difference * jump.difference + pair.by_increment * jump.increment;
            }
            if let Some(pair) = self.frozen_pressure_pair(entry, a, b) {
                let pressure = [points[a].pressure, points[b].pressure];
                let PressureStates { particle, increment } =
                    Self::pressure_states(upwind, (a, b), pressure, &scratch.slopes);
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

    /// Writes the rows of a range of particles, whose first one is row `first` of the operator.
    fn write_action(&self, range: std::ops::Range<usize>, v: &[f64], out: &mut [f64], scratch: &Scratch<D>) {
        let first = self.unknowns.of(range.start).start;
        if range.len() > GRAIN {
            let middle = range.start + range.len() / 2;
            let (left, right) = out.split_at_mut(self.unknowns.of(middle).start - first);
            rayon::join(
                || self.write_action(range.start..middle, v, left, scratch),
                || self.write_action(middle..range.end, v, right, scratch),
            );
            return;
        }
        let s = self.linearisation.shift;
        for a in range {
            if self.unknowns.of(a).is_empty() {
                continue;
            }
            let (force, rate) = self.vary_rates(a, scratch);
            let mass = if self.linearisation.at_rest { 0.0 } else { self.masses[a] };
            for i in 0..D {
                if let Some(row) = self.unknowns.velocity(a, i) {
                    out[row - first] = mass * v[row] - s * force[i];
                    if let Some(displacement) = self.unknowns.displacement(a, i) {
                        out[displacement - first] = mass * (v[displacement] - v[row]);
                    }
                }
            }
            if let Some(row) = self.unknowns.volume_ratio(a) {
                out[row - first] = mass * (v[row] - s * rate * self.volume_unit(a));
            }
        }
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
        let mut scratch = self.linearisation.scratch.take();
        self.vary_fields(v, &mut scratch);
        self.vary_points(&mut scratch);
        self.vary_slopes(&mut scratch);
        self.write_action(0..self.particles(), v, out, &scratch);
        self.linearisation.scratch.give_back(scratch);
    }

    fn pattern(&self) -> Option<&Arc<SparsePattern>> {
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

    fn offers_diagonal_blocks(&self) -> bool {
        self.knows_diagonal()
    }

    fn diagonal_blocks(&self, values: &mut [f64]) {
        self.write_diagonal(values);
    }

    fn places(&self) -> Option<Places> {
        let coordinates = self.setup.particles.positions.iter().flat_map(|x| x.iter().copied()).collect();
        Some(Places { dimension: D, coordinates })
    }

    fn geometry(&self) -> Option<Geometry> {
        self.unknown_places()
    }

    fn project(&self, tents: &Tents, coarse: &mut CoarseMatrix) -> bool {
        self.project_onto(tents, coarse)
    }

    /// Measured per pair (66 to 90 ns in 2D, 82 to 85 ns in 3D, hourglass control included) and per pair of pairs (4.7 ns;
    /// 8.6 to 14 ns) by `benches/factors.rs` with the cases 2d-1, 2d-10, 3d-1 and 3d-4, on the machine of the other rates.
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
            action: terms * pairs * (50.0 + 11.0 * dimension) * 1e-9,
            assembly: pairs * near * (6.0 * dimension - 7.0).max(2.0) * 1e-9,
            entries,
        })
    }

    fn sparser(&self) -> Option<&dyn Tangent> {
        Some(self.linearisation.one_ring.get_or_init(|| self.one_ring()))
    }
}
