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
//! | D | `H*` |
//! |---|---|
//! | 1 | 1 |
//! | 2 | `cof F̄` |
//! | 3 | `(I + K/4) cof F̄`, `K = cof(D)/3 + w⊗w`, with `ΔF F̄⁻¹ = D + w×`, D symmetric |
//!
//! Then `Σ V P* : ΔF = Σ V (ψ₁ − ψ₀)`: total energy is constant for any Δt, and falls by exactly the
//! upwinding's dissipation. `P* F̄ᵀ` is symmetric, so angular momentum is exact, too. In space that takes K: there
//! `ΔJ = cof F̄:ΔF + det(ΔF)/4`, and `det(D + w×) = det D + w·D w = K:D`. The simpler `cof F̄ + cof(ΔF)/12` would lose
//! angular momentum; the polynomial in C of Betsch, Janz and Hesch keeps it, too, but after shear of size s it is
//! nonlinear in `s³ ΔF` instead of `s ΔF`. In steps of 5 explicit ones a spinning body could not go beyond s = 18
//! with it, and goes beyond 60 with this one (measured). The price of K: the mean configuration must have a positive
//! volume. With the evolved cofactor `J F⁻ᵀ`, J and det F keep their ratio, by which `H*` is multiplied.
//!
//! The unknown is the mean velocity: the problem has the form of an implicit stage at the mid-point,
//! with shift `s = Δt/2` and base `(u₀, v₀)`, and shares its unknowns, pattern and assembly. Start
//! `v̄ = 0`, that is `v₁ = −v₀`, gives back the start's configuration and is always admissible.

use nicolson_solvers::EvaluationError;
use nicolson_solvers::time::{ConservingSystem, StageSystem, System};

use super::Model;
use super::evaluation::{Failure, Point};
use crate::setup::{CofactorChoice, Constraint};
use crate::tensor::{Tensor, Vector, cofactor, cofactor_variation, contract, determinant, inverse, outer};

/// Configuration of a particle at the start of a conserving step.
#[derive(Debug, Clone, Copy)]
pub struct StepStart<const D: usize> {
    deformation: Tensor<D>,
    volume_ratio: f64,
    /// `J/det F`, constant in time for the evolved cofactor; 1 for the geometric one.
    ratio: f64,
}

/// `H*/ratio` at a mean configuration, with what its variation needs.
struct Secant<const D: usize> {
    end: Tensor<D>,
    value: Tensor<D>,
    space: Option<SpaceSecant<D>>,
}

/// The parts of `H* = (I + K/4) cof F̄` in three dimensions.
struct SpaceSecant<const D: usize> {
    inverse: Tensor<D>,
    cofactor: Tensor<D>,
    /// `A = ΔF F̄⁻¹`, its symmetric part and the axial vector of the skew one.
    increment: Tensor<D>,
    strain: Tensor<D>,
    spin: Vector<D>,
    /// `I + K/4`.
    factor: Tensor<D>,
}

/// `None` in three dimensions if the mean configuration has no positive volume.
fn secant<const D: usize>(start: &StepStart<D>, mean: &Tensor<D>) -> Option<Secant<D>> {
    let end = mean * 2.0 - start.deformation;
    let cofactor = cofactor(mean);
    if D < 3 {
        return Some(Secant { end, value: cofactor, space: None });
    }
    let inverse = inverse(mean).filter(|_| determinant(mean) > 0.0)?;
    let increment = (end - start.deformation) * inverse;
    let (strain, spin) = parts(&increment);
    let factor = Tensor::identity() + (crate::tensor::cofactor(&strain) / 3.0 + outer(&spin, &spin)) * 0.25;
    let value = factor * cofactor;
    Some(Secant { end, value, space: Some(SpaceSecant { inverse, cofactor, increment, strain, spin, factor }) })
}

/// Symmetric part of a tensor in three dimensions, and the axial vector of the skew one.
fn parts<const D: usize>(a: &Tensor<D>) -> (Tensor<D>, Vector<D>) {
    let spin = Vector::from_fn(|i, _| 0.5 * (a[((i + 2) % D, (i + 1) % D)] - a[((i + 1) % D, (i + 2) % D)]));
    ((a + a.transpose()) * 0.5, spin)
}

impl<const D: usize> Secant<D> {
    /// Derivative of the value in a direction of F̄.
    fn variation(&self, mean: &Tensor<D>, direction: &Tensor<D>) -> Tensor<D> {
        let by_cofactor = cofactor_variation(mean, direction);
        let Some(space) = &self.space else { return by_cofactor };
        let (strain, spin) = parts(&((direction * 2.0 - space.increment * direction) * space.inverse));
        let change =
            cofactor_variation(&space.strain, &strain) / 3.0 + outer(&spin, &space.spin) + outer(&space.spin, &spin);
        change * space.cofactor * 0.25 + space.factor * by_cofactor
    }
}

impl<const D: usize> Model<D> {
    /// The law of a conserving step at one particle: `point.deformation` is `F̄`.
    pub(super) fn conserving_law(
        &self,
        a: usize,
        start: &StepStart<D>,
        shift: f64,
        point: &mut Point<D>,
    ) -> Result<(), Failure> {
        let material = self.material(a);
        let secant = secant(start, &point.deformation).ok_or(Failure::Determinant)?;
        let det = determinant(&secant.end);
        // F₁ − F₀ from the mean velocity, whose power the stress does: the difference of two determinants is
        // the same number, but after large shear it has lost its digits, and the energy with them.
        let increment = contract(&secant.value, &point.velocity_gradient) * (2.0 * shift);
        point.volume_ratio = start.volume_ratio + start.ratio * increment;
        let needs_domain = material.needs_positive_volume() || D == 3 || start.ratio != 1.0;
        if needs_domain && det <= 0.0 {
            return Err(Failure::Determinant);
        }
        if material.needs_positive_volume() && point.volume_ratio <= 0.0 {
            return Err(Failure::VolumeRatio);
        }
        point.pressure = -material.discrete_slope(start.volume_ratio, point.volume_ratio).0;
        point.cofactor = secant.value * start.ratio;
        point.rate = (point.volume_ratio - start.volume_ratio) / (2.0 * shift);
        point.wave_speed = material.wave_speed();
        if point.pressure.is_finite() && point.rate.is_finite() { Ok(()) } else { Err(Failure::NotFinite) }
    }

    /// `∂P*/∂F̄ : A`.
    pub(super) fn conserving_variation(
        &self,
        a: usize,
        start: &StepStart<D>,
        point: &Point<D>,
        direction: &Tensor<D>,
    ) -> Tensor<D> {
        // The evaluation before this one has been inside the domain.
        let Some(secant) = secant(start, &point.deformation) else { return Tensor::zeros() };
        // δF₁ = 2 δF̄.
        let end_variation = direction * 2.0;
        let det_variation = contract(&cofactor(&secant.end), &end_variation);
        let (slope, by_end) = self.material(a).discrete_slope(start.volume_ratio, point.volume_ratio);
        let value_variation = secant.variation(&point.deformation, direction);
        (secant.value * (by_end * start.ratio * det_variation) + value_variation * slope) * start.ratio
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
            let volume_ratio = from[2 * n * D + a];
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
            state[2 * n * D + a] = self.workspace.points[a].volume_ratio;
        }
        let end = self.stage.time + self.stage.shift;
        self.impose(end, state);
        Ok(())
    }
}
