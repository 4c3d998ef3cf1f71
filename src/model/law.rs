//! The law at one particle: from F, L and J to cofactor, pressure and stress.

use nicolson_solvers::EvaluationError;

use super::Model;
use super::conserving::StepStart;
use crate::setup::CofactorChoice;
use crate::tensor::{Tensor, Vector, cofactor, contract, determinant, inverse};

/// Where the volume ratios of an evaluation come from.
#[derive(Debug, Clone, Copy)]
pub enum VolumeRatios<'a, const D: usize> {
    /// They are given, and their rates are wanted.
    Given(&'a [f64]),
    /// They solve the local stage equation `J = J̃ + s H:L`, and so do their rates.
    Stage {
        /// Base `J̃`.
        base: &'a [f64],
        /// Shift `s`.
        shift: f64,
    },
    /// All of them follow the determinant: what their rate equation integrates to.
    Equilibrium {
        /// The constants of that integral, see `volume`.
        constants: &'a [f64],
    },
    /// A discrete-gradient step: displacements and velocities are means over the step, and the stress
    /// is the one that conserves energy from this start.
    Conserving {
        /// Configuration at the start of the step.
        start: &'a [StepStart<D>],
        /// Half the step, s.
        shift: f64,
    },
}

/// What the first sweep finds at one particle.
#[derive(Debug, Clone, Copy)]
pub struct Point<const D: usize> {
    /// Deformation gradient F.
    pub deformation: Tensor<D>,
    /// Velocity gradient L with respect to reference positions, 1/s.
    pub velocity_gradient: Tensor<D>,
    /// Cofactor H.
    pub cofactor: Tensor<D>,
    /// Volume ratio J.
    pub volume_ratio: f64,
    /// `J̇`, 1/s; complete after the second sweep.
    pub rate: f64,
    /// Pressure, Pa.
    pub pressure: f64,
    /// Wave speed, m/s; the one at rest without a deformation-dependent stabilisation.
    pub wave_speed: f64,
    /// Force, N; complete after the second sweep.
    pub force: Vector<D>,
}

impl<const D: usize> Point<D> {
    /// A particle at rest.
    #[inline(always)]
    pub fn rest() -> Self {
        Self {
            deformation: Tensor::identity(),
            velocity_gradient: Tensor::zeros(),
            cofactor: Tensor::identity(),
            volume_ratio: 1.0,
            rate: 0.0,
            pressure: 0.0,
            wave_speed: 0.0,
            force: Vector::zeros(),
        }
    }
}

/// A failed evaluation at one particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Failure {
    VolumeRatio,
    Determinant,
    /// No outer stretch is free of stress.
    Transverse,
    NotFinite,
}

impl<const D: usize> Model<D> {
    /// The law at one particle: cofactor, J, its rate by H:L, and pressure, from F and L. Returns the part of the
    /// stress that does not come from J. Always inlined: a call of its own doubled the time of a 2D rate.
    #[inline(always)]
    pub(super) fn constitutive(
        &self,
        a: usize,
        volume_ratios: VolumeRatios<'_, D>,
        point: &mut Point<D>,
    ) -> Result<Tensor<D>, Failure> {
        if let VolumeRatios::Conserving { start, shift } = volume_ratios {
            return self.conserving_law(a, &start[a], shift, point);
        }
        let material = self.material(a);
        let f = &point.deformation;
        let l = &point.velocity_gradient;
        let det = determinant(f);
        let constant = match volume_ratios {
            VolumeRatios::Equilibrium { constants } => Some(constants[a]),
            _ if self.evolves_volume(a) => None,
            _ => Some(self.initial_volume_constant(a)),
        };
        match (constant, self.cofactor_choice(a)) {
            (Some(constant), _) => {
                let (ratio, factor) = self.follow(a, constant, det);
                point.volume_ratio = ratio;
                point.cofactor = cofactor(f) * factor;
                point.rate = 0.0;
            }
            (None, CofactorChoice::Geometric) => {
                point.cofactor = cofactor(f);
                point.rate = contract(&point.cofactor, l);
                point.volume_ratio = match volume_ratios {
                    VolumeRatios::Given(j) => j[a],
                    VolumeRatios::Stage { base, shift } => base[a] + shift * point.rate,
                    VolumeRatios::Equilibrium { .. } | VolumeRatios::Conserving { .. } => point.volume_ratio,
                };
            }
            (None, CofactorChoice::Evolved) => {
                let transposed = inverse(f).ok_or(Failure::Determinant)?.transpose();
                let divergence = contract(&transposed, l);
                point.volume_ratio = match volume_ratios {
                    VolumeRatios::Given(j) => j[a],
                    // J = J̃ + s J F⁻ᵀ:L, solved for J. Past the pole the step is too long.
                    VolumeRatios::Stage { base, shift } => {
                        let denominator = 1.0 - shift * divergence;
                        if denominator <= 0.0 && self.terms.volume_rate {
                            return Err(Failure::VolumeRatio);
                        }
                        base[a] / denominator
                    }
                    VolumeRatios::Equilibrium { .. } | VolumeRatios::Conserving { .. } => point.volume_ratio,
                };
                point.cofactor = transposed * point.volume_ratio;
                point.rate = point.volume_ratio * divergence;
            }
        }
        if !self.terms.volume_rate
            && constant.is_none()
            && let VolumeRatios::Stage { base, .. } = volume_ratios
        {
            point.volume_ratio = base[a];
        }
        if material.needs_positive_ratio() && point.volume_ratio <= 0.0 {
            return Err(Failure::VolumeRatio);
        }
        if material.needs_positive_determinant() && det <= 0.0 {
            return Err(Failure::Determinant);
        }
        point.pressure = material.pressure(point.volume_ratio);
        point.wave_speed = material.wave_speed();
        let mut solid = match &material.solid {
            Some(solid) => solid.stress(f).ok_or(Failure::Transverse)?,
            None => Tensor::zeros(),
        };
        if let Some(viscosity) = &material.viscosity {
            solid += viscosity.stress(f, l);
        }
        let finite = point.pressure.is_finite() && det.is_finite() && point.rate.is_finite();
        if finite && solid.iter().all(|value| value.is_finite()) { Ok(solid) } else { Err(Failure::NotFinite) }
    }

    /// The error of a particle whose law could not be evaluated.
    pub(super) fn explain(&self, a: usize, volume_ratios: VolumeRatios<'_, D>, mut point: Point<D>) -> EvaluationError {
        let det = determinant(&point.deformation);
        let error = match self.constitutive(a, volume_ratios, &mut point) {
            Err(Failure::Determinant) => EvaluationError::outside_domain("determinant of F", a, det),
            Err(Failure::VolumeRatio) => EvaluationError::outside_domain("volume ratio J", a, point.volume_ratio),
            Err(Failure::Transverse) => {
                EvaluationError::outside_domain("strain of plane stress: determinant of F", a, det)
            }
            _ => EvaluationError::not_finite("pressure, stress or velocity gradient", a, point.pressure),
        };
        self.located(error)
    }
}
