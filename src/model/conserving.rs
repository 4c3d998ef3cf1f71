//! The energy–momentum step: the mid-point rule with a discrete-gradient stress (formulation, section 6;
//! Gonzalez 2000; Betsch, Janz and Hesch 2018).
//!
//! With means over the step marked by a bar and `ψ* = (ψ(J₁) − ψ(J₀))/(J₁ − J₀)`:
//!
//! ```text
//! u₁ − u₀ = Δt v̄,    m (v₁ − v₀)/Δt = −Σ V P* g + D_v(ū, v̄) + loads(t + Δt/2),    P* = ψ* H*
//! J₁ − J₀ = H* : (F₁ − F₀)    exactly
//! ```
//!
//! with the discrete cofactor H* of [`CofactorSecant`], and for solids the chords of their energies
//! ([`crate::material`]).
//!
//! Then `Σ V P* : ΔF = Σ V (ψ₁ − ψ₀)`: total energy is constant for any Δt, and falls by exactly the
//! upwinding's dissipation. `P* F̄ᵀ` is symmetric, so angular momentum is exact, too. With the evolved cofactor
//! `J F⁻ᵀ`, J and det F keep their ratio, by which `H*` is multiplied.
//!
//! The unknown is the mean velocity: the problem has the form of an implicit stage at the mid-point,
//! with shift `s = Δt/2` and base `(u₀, v₀)`, and shares its unknowns, pattern and assembly. Start
//! `v̄ = 0`, that is `v₁ = −v₀`, gives back the start's configuration and is always admissible.

use nicolson_solvers::EvaluationError;
use nicolson_solvers::time::{ConservingSystem, StageSystem, System};

use super::Model;
use super::law::{Failure, Point};
use crate::setup::{CofactorChoice, Constraint};
use crate::tensor::{CofactorSecant, Tensor, Tensor4, cofactor, contract, determinant, tensor4_of};

/// Configuration of a particle at the start of a conserving step.
#[derive(Debug, Clone, Copy)]
pub struct StepStart<const D: usize> {
    deformation: Tensor<D>,
    volume_ratio: f64,
    /// `J/det F`, constant in time for the evolved cofactor; 1 for the geometric one.
    ratio: f64,
}

impl<const D: usize> StepStart<D> {
    /// Numbers that it is made of.
    pub(super) const NUMBERS: usize = D * D + 2;

    /// The deformation gradient by columns, and the rest.
    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> {
        self.deformation.iter().copied().chain([self.volume_ratio, self.ratio])
    }

    /// From [`NUMBERS`](Self::NUMBERS) numbers.
    pub(super) fn from_numbers(numbers: &[f64]) -> Self {
        let (deformation, rest) = numbers.split_at(D * D);
        Self { deformation: Tensor::from_column_slice(deformation), volume_ratio: rest[0], ratio: rest[1] }
    }

    /// `H*/ratio` over the step to a mean configuration.
    pub(super) fn secant(&self, mean: &Tensor<D>) -> Option<CofactorSecant<D>> {
        CofactorSecant::new(self.deformation, *mean)
    }
}

impl<const D: usize> Model<D> {
    /// The law of a conserving step at one particle: `point.deformation` is `F̄`. Returns the part of the stress that
    /// does not come from J.
    pub(super) fn conserving_law(
        &self,
        a: usize,
        start: &StepStart<D>,
        shift: f64,
        point: &mut Point<D>,
    ) -> Result<Tensor<D>, Failure> {
        let material = self.material(a);
        let secant = start.secant(&point.deformation).ok_or(Failure::Determinant)?;
        let value = secant.value;
        let det = determinant(&secant.end);
        // F₁ − F₀ from the mean velocity, whose power the stress does: the difference of two determinants is
        // the same number, but after large shear it has lost its digits, and the energy with them.
        let increment = contract(&value, &point.velocity_gradient) * (2.0 * shift);
        point.volume_ratio = if material.evolves_volume() { start.volume_ratio + start.ratio * increment } else { det };
        let needs_domain = material.needs_positive_determinant() || D == 3 || start.ratio != 1.0;
        if needs_domain && det <= 0.0 {
            return Err(Failure::Determinant);
        }
        if material.needs_positive_ratio() && point.volume_ratio <= 0.0 {
            return Err(Failure::VolumeRatio);
        }
        point.pressure = -material.discrete_slope(start.volume_ratio, point.volume_ratio).0;
        point.cofactor = value * start.ratio;
        point.rate = start.ratio * increment / (2.0 * shift);
        point.wave_speed = material.wave_speed();
        let mut solid = material.solid.map_or_else(Tensor::zeros, |solid| solid.conserving_stress(&secant));
        if let Some(viscosity) = &material.viscosity {
            solid += viscosity.stress(&point.deformation, &point.velocity_gradient);
        }
        let finite = point.pressure.is_finite() && point.rate.is_finite();
        if finite && solid.iter().all(|value| value.is_finite()) { Ok(solid) } else { Err(Failure::NotFinite) }
    }

    /// `∂P*/∂F̄` of the part of J.
    pub(super) fn conserving_tangent(
        &self,
        a: usize,
        start: &StepStart<D>,
        secant: &CofactorSecant<D>,
        volume_ratio: f64,
    ) -> Tensor4<D> {
        let (slope, by_end) = self.material(a).discrete_slope(start.volume_ratio, volume_ratio);
        let by_determinant = cofactor(&secant.end) * (2.0 * by_end * start.ratio);
        tensor4_of(|direction| {
            // δF₁ = 2 δF̄.
            (secant.value * contract(&by_determinant, direction) + secant.variation(direction) * slope) * start.ratio
        })
    }
}

impl<const D: usize> ConservingSystem for Model<D> {
    fn begin_conserving(&mut self, t: f64, step: f64, from: &[f64]) {
        let shift = 0.5 * step;
        let n = self.particles();
        // A stage at the mid-point, whose prescribed entries are means over the step.
        self.begin_stage(t + shift, shift, from);
        let mut end = from.to_vec();
        self.impose(t + step, &mut end);
        for (a, constraints) in self.setup.constraints.iter().enumerate() {
            for (i, constraint) in constraints.iter().enumerate() {
                if *constraint != Constraint::Free {
                    let (u, v) = (a * D + i, (n + a) * D + i);
                    self.stage.base[u] = 0.5 * (from[u] + end[u]);
                    self.stage.base[v] = (end[u] - from[u]) / step;
                }
            }
        }
        let start = (0..n).map(|a| {
            let deformation = Tensor::identity() + self.gradient.of(a, &from[..n * D]);
            let determinant = determinant(&deformation);
            let volume_ratio = if self.evolves_volume(a) {
                from[2 * n * D + a]
            } else {
                self.follow(a, self.initial_volume_constant(a), determinant).0
            };
            let ratio = match self.cofactor_choice(a) {
                CofactorChoice::Geometric => 1.0,
                CofactorChoice::Evolved => volume_ratio / determinant,
            };
            StepStart { deformation, volume_ratio, ratio }
        });
        self.stage.start = start.collect();
    }

    fn extrapolated_start(&mut self, y: &mut [f64]) {
        let base = std::mem::take(&mut self.stage.base);
        self.start_from(&base, y);
        self.stage.base = base;
    }

    fn resting_start(&mut self, y: &mut [f64]) {
        y.fill(0.0);
    }

    fn finish_conserving(&mut self, y: &[f64], state: &mut [f64]) -> Result<(), EvaluationError> {
        self.evaluate_stage(y)?;
        let n = self.particles();
        let (base, trial) = (&self.stage.base, &self.stage.trial);
        for a in 0..n {
            for i in (0..D).filter(|&i| self.unknowns.velocity(a, i).is_some()) {
                let (u, v) = (a * D + i, (n + a) * D + i);
                // Means are base + s v̄ and v̄; the end lies as far beyond them as the start before.
                state[u] = 2.0 * trial[u] - base[u];
                state[v] = 2.0 * trial[v] - base[v];
            }
            if self.evolves_volume(a) {
                state[2 * n * D + a] = self.workspace.points[a].volume_ratio;
            }
        }
        let end = self.stage.time + self.stage.shift;
        self.impose(end, state);
        Ok(())
    }
}
