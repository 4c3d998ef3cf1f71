//! Energies, dissipation and momenta of a state.

use rayon::prelude::*;

use nicolson_solvers::EvaluationError;

use super::Model;
use super::evaluation::GRAIN;
use super::law::VolumeRatios;
use crate::setup::Constraint;
use crate::tensor::{Tensor, Vector, smallest_stretch};

/// Energies of a state, J (per thickness in 2D, per area in 1D).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energies {
    /// `Σ ½ m v²`.
    pub kinetic: f64,
    /// `Σ V ψ`.
    pub internal: f64,
    /// `Π` of the hourglass control.
    pub hourglass: f64,
}

impl Energies {
    /// All of it, J.
    pub fn total(&self) -> f64 {
        self.kinetic + self.internal + self.hourglass
    }
}

impl std::iter::Sum for Energies {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self::default(), |sum, term| Self {
            kinetic: sum.kinetic + term.kinetic,
            internal: sum.internal + term.internal,
            hourglass: sum.hourglass + term.hourglass,
        })
    }
}

/// Sums over particles in chunks of this length, in order: independent of the number of threads.
const CHUNK: usize = 1024;

impl<const D: usize> Model<D> {
    /// Sum over particles whose bits do not depend on the number of threads.
    pub(super) fn sum<T: Send + std::iter::Sum<T>>(&self, term: impl Fn(usize) -> T + Sync) -> T {
        let n = self.particles();
        let chunks: Vec<T> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| (chunk * CHUNK..((chunk + 1) * CHUNK).min(n)).map(&term).sum())
            .collect();
        chunks.into_iter().sum()
    }

    fn velocity(&self, state: &[f64], a: usize) -> Vector<D> {
        let start = (self.particles() + a) * D;
        Vector::from_column_slice(&state[start..start + D])
    }

    /// Kinetic and internal energy, and that of the hourglass control, in one sweep.
    pub fn energies(&self, state: &[f64]) -> Energies {
        let (displacement, near) = (self.displacements(state), &self.gradient.neighbourhood);
        self.sum(|a| {
            let material = self.material(a);
            let needed = material.solid.is_some() || self.hourglass.is_some();
            let gradient = needed.then(|| self.gradient.of(a, displacement));
            let density = match (&material.solid, &gradient) {
                (Some(solid), Some(gradient)) => {
                    let deformation = Tensor::identity() + gradient;
                    material.energy(self.volume_ratio_in(state, a, &deformation)) + solid.energy(&deformation)
                }
                _ => material.energy(self.volume_ratio(state, a)),
            };
            let control = self.hourglass.as_ref().zip(gradient.as_ref());
            Energies {
                kinetic: 0.5 * self.masses[a] * self.velocity(state, a).norm_squared(),
                internal: self.setup.particles.volumes[a] * density,
                hourglass: control.map_or(0.0, |(control, gradient)| control.energy(a, near, displacement, gradient)),
            }
        })
    }

    /// Linear momentum `Σ m v`, kg m/s.
    pub fn linear_momentum(&self, state: &[f64]) -> Vector<D> {
        self.sum(|a| self.velocity(state, a) * self.masses[a])
    }

    /// Angular momentum `Σ x × m v` about the origin, kg m²/s: (x, y, z) components, of which 2D has
    /// the last only and 1D none.
    pub fn angular_momentum(&self, state: &[f64]) -> [f64; 3] {
        let coordinates = crate::tensor::coordinates::<D>;
        let total = self.sum(|a| {
            let x = coordinates(&self.position(state, a));
            let p = coordinates(&(self.velocity(state, a) * self.masses[a]));
            nalgebra::Vector3::from(x).cross(&nalgebra::Vector3::from(p))
        });
        total.into()
    }

    /// Whether any load or constraint exchanges momentum with the surroundings.
    pub fn is_free(&self) -> bool {
        !self.loads.any() && self.setup.constraints.iter().flatten().all(|c| *c == Constraint::Free)
    }

    /// Whether any component follows a prescribed motion.
    pub fn has_moving_constraints(&self) -> bool {
        self.setup.constraints.iter().flatten().any(|c| matches!(c, Constraint::Moving(_)))
    }

    /// Whether any load acts.
    pub fn has_loads(&self) -> bool {
        self.loads.any()
    }

    /// Loads at time `t` on all particles, N, flat.
    ///
    /// # Errors
    /// If an expression gives a value that is not finite.
    pub fn loads_at(&mut self, t: f64, out: &mut Vec<f64>) -> Result<(), EvaluationError> {
        self.loads.update(&self.setup, &self.masses, t).map_err(|e| self.located(e))?;
        out.clear();
        for a in 0..self.particles() {
            out.extend(self.loads.on(a).iter());
        }
        Ok(())
    }

    /// Forces of all terms on all particles at a state, loads included, N, flat.
    ///
    /// # Errors
    /// If the state is outside the domain of the law.
    pub fn forces_at(&mut self, t: f64, state: &[f64], out: &mut Vec<f64>) -> Result<(), EvaluationError> {
        self.evaluate_state(t, state)?;
        out.clear();
        for point in &self.workspace.points {
            out.extend(point.force.iter());
        }
        Ok(())
    }

    /// Whether any term takes energy out.
    pub fn dissipates(&self) -> bool {
        self.upwind.is_some() || self.materials.iter().any(|(law, _)| law.viscosity.is_some())
    }

    /// Power that upwinding and viscosity take out, W: `−Σ v·V D_v + Σ V p D_p + Σ V P_v:L`. Zero without both.
    ///
    /// # Errors
    /// If the state is outside the domain of the law, which matters to D_p only.
    pub fn dissipation(&mut self, t: f64, state: &[f64]) -> Result<f64, EvaluationError> {
        let viscous = self.viscous_power(state);
        let Some(upwind) = self.upwind.as_ref() else { return Ok(viscous) };
        if !upwind.has_pressure() {
            self.evaluate_velocity_upwind(state);
            return Ok(viscous + self.sum(|a| -self.velocity(state, a).dot(&self.workspace.pairs[a].0)));
        }
        self.evaluate_state(t, state)?;
        Ok(viscous
            + self.sum(|a| {
                let (force, rate) = self.workspace.pairs[a];
                let volume = self.setup.particles.volumes[a];
                self.workspace.points[a].pressure * volume * rate - self.velocity(state, a).dot(&force)
            }))
    }

    /// `Σ V P_v:L`, W.
    fn viscous_power(&self, state: &[f64]) -> f64 {
        if self.materials.iter().all(|(law, _)| law.viscosity.is_none()) {
            return 0.0;
        }
        self.sum(|a| {
            let Some(viscosity) = self.material(a).viscosity else { return 0.0 };
            let velocity_gradient = self.gradient.of(a, self.velocities_of(state));
            self.setup.particles.volumes[a] * viscosity.dissipation(&self.deformation(state, a), &velocity_gradient)
        })
    }

    /// D_v alone. It needs no law but the wave speed, and so exists where the law does not: at the mean of two
    /// admissible states of a long step, where an energy–momentum step takes it.
    fn evaluate_velocity_upwind(&mut self, state: &[f64]) {
        self.stage.evaluated.clear();
        let (displacement, rest) = state.split_at(self.particles() * D);
        let velocity = &rest[..self.particles() * D];
        let deformed = self.upwind.as_ref().is_some_and(|upwind| upwind.options.deformed_wave_speed);
        let mut points = std::mem::take(&mut self.workspace.points);
        points.par_iter_mut().with_min_len(GRAIN).enumerate().for_each(|(a, point)| {
            point.wave_speed = self.material(a).wave_speed();
            if deformed {
                let deformation = Tensor::identity() + self.gradient.of(a, displacement);
                point.wave_speed /= smallest_stretch(&deformation).0.sqrt();
            }
        });
        self.workspace.points = points;
        if !self.workspace.slopes.is_empty() {
            self.reconstruct(velocity);
        }
        self.pair_terms(displacement, velocity);
    }

    fn evaluate_state(&mut self, t: f64, state: &[f64]) -> Result<(), EvaluationError> {
        let n = self.particles();
        self.stage.evaluated.clear();
        let (displacement, rest) = state.split_at(n * D);
        let (velocity, ratios) = rest.split_at(n * D);
        self.evaluate(t, displacement, velocity, VolumeRatios::Given(ratios))
    }

    /// Pressure `−⅓ tr σ` of every particle, Pa, without its viscous part; for a fluid `p(J)`.
    pub fn pressures(&self, state: &[f64]) -> Vec<f64> {
        let of = |(a, ratio): (usize, &f64)| {
            let material = self.material(a);
            let solid = material.solid.map_or(0.0, |solid| solid.pressure(&self.deformation(state, a)).1);
            material.pressure(*ratio) + solid
        };
        self.volume_ratios(state).iter().enumerate().map(of).collect()
    }

    /// Whether any body resists shear.
    pub fn has_solids(&self) -> bool {
        self.materials.iter().any(|(law, _)| law.solid.is_some())
    }

    /// Cauchy stress of a particle with its part across the directions left out, Pa, without viscosity.
    pub fn cauchy_stress(&self, state: &[f64], a: usize) -> Tensor<3> {
        let material = self.material(a);
        let mut stress = Tensor::<3>::identity() * -material.pressure(self.volume_ratio(state, a));
        let Some(solid) = material.solid else { return stress };
        let f = self.deformation(state, a);
        let (ratio, pressure) = solid.pressure(&f);
        let Some(piola) = solid.stress(&f) else { return Tensor::from_element(f64::NAN) };
        let inside = piola * f.transpose() / ratio;
        let across = if D < 3 { (-3.0 * pressure - inside.trace()) / (3 - D) as f64 } else { 0.0 };
        for i in 0..3 {
            for j in 0..3 {
                if i < D && j < D {
                    stress[(i, j)] += inside[(i, j)];
                } else if i == j {
                    stress[(i, j)] += across;
                }
            }
        }
        stress
    }

    /// [`cauchy_stress`](Self::cauchy_stress) of every particle.
    pub fn cauchy_stresses(&self, state: &[f64]) -> Vec<Tensor<3>> {
        (0..self.particles()).map(|a| self.cauchy_stress(state, a)).collect()
    }

    /// Deformation gradient of a particle.
    pub fn deformation(&self, state: &[f64], a: usize) -> Tensor<D> {
        Tensor::identity() + self.gradient.of(a, self.displacements(state))
    }
}
