//! The part of a stress that comes from the deformation gradient.

use super::isotropic::{self, Invariants};
use super::{LinearElastic, MooneyRivlin, NeoHookean, StVenantKirchhoff, chord};
use crate::tensor::{CofactorSecant, Tensor, Tensor4, contract, determinant};

/// What holds across the directions that a one- or two-dimensional model leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Transverse {
    /// No strain: plane strain in 2D, uniaxial strain in 1D.
    #[default]
    Strain,
    /// No stress: plane stress in 2D, uniaxial stress in 1D.
    Stress,
}

/// Energy of volume changes per modulus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VolumetricForm {
    /// `½ ln²J`.
    #[default]
    Logarithmic,
    /// `½ (J − 1)²`.
    Quadratic,
}

impl VolumetricForm {
    /// U.
    pub fn energy(self, at: &Invariants) -> f64 {
        let measure = match self {
            Self::Logarithmic => at.dilation.ln_1p(),
            Self::Quadratic => at.dilation,
        };
        0.5 * measure * measure
    }

    /// U′ and U″.
    pub fn slopes(self, at: &Invariants) -> (f64, f64) {
        match self {
            Self::Logarithmic => {
                let log = at.dilation.ln_1p();
                (log / at.ratio, (1.0 - log) / (at.ratio * at.ratio))
            }
            Self::Quadratic => (at.dilation, 1.0),
        }
    }

    /// Chord of U and its derivative with respect to the end.
    pub fn chord(self, start: &Invariants, end: &Invariants) -> (f64, f64) {
        match self {
            Self::Logarithmic => chord::half_squared_logarithm(start.ratio, end.ratio),
            Self::Quadratic => (0.5 * (start.dilation + end.dilation), 0.5),
        }
    }
}

/// A stored energy of F.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SolidLaw {
    /// See [`LinearElastic`].
    LinearElastic(LinearElastic),
    /// See [`StVenantKirchhoff`].
    StVenantKirchhoff(StVenantKirchhoff),
    /// See [`NeoHookean`].
    NeoHookean(NeoHookean),
    /// See [`MooneyRivlin`].
    MooneyRivlin(MooneyRivlin),
}

/// A stored energy of F and what holds across the directions left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// The law.
    pub law: SolidLaw,
    /// Plane strain or plane stress.
    pub transverse: Transverse,
}

/// Calls a function of the isotropic laws; linear elasticity goes its own way.
macro_rules! isotropic {
    ($self:ident, $linear:ident => $other:expr, $law:ident => $body:expr) => {
        match &$self.law {
            SolidLaw::LinearElastic($linear) => $other,
            SolidLaw::StVenantKirchhoff($law) => $body,
            SolidLaw::NeoHookean($law) => $body,
            SolidLaw::MooneyRivlin($law) => $body,
        }
    };
}

impl Solid {
    /// `(λ + 2μ, μ)` at rest, Pa; in plane stress the smaller modulus of waves in the plane is not used: an upper
    /// bound serves the step limit and the upwinding.
    pub(super) fn moduli(&self) -> (f64, f64) {
        match &self.law {
            SolidLaw::LinearElastic(LinearElastic { lambda, shear_modulus })
            | SolidLaw::StVenantKirchhoff(StVenantKirchhoff { lambda, shear_modulus })
            | SolidLaw::NeoHookean(NeoHookean { lambda, shear_modulus, .. }) => {
                (lambda + 2.0 * shear_modulus, *shear_modulus)
            }
            SolidLaw::MooneyRivlin(law) => {
                let shear = 2.0 * (law.first + law.second);
                (law.bulk_modulus + 4.0 / 3.0 * shear, shear)
            }
        }
    }

    /// Growth of the wave speed along a stretch, of which the square is given.
    pub(super) fn stiffening(&self, squared: f64) -> f64 {
        match &self.law {
            SolidLaw::StVenantKirchhoff(_) => (1.5 * squared - 0.5).max(1.0).sqrt(),
            // The second invariant grows with the product of two stretches.
            SolidLaw::MooneyRivlin(law) if law.second > 0.0 => squared.max(1.0).sqrt(),
            _ => 1.0,
        }
    }

    pub(super) fn needs_positive_determinant(&self) -> bool {
        !matches!(self.law, SolidLaw::LinearElastic(_))
    }

    /// Whether P is linear in F.
    pub fn is_linear(&self) -> bool {
        matches!(self.law, SolidLaw::LinearElastic(_))
    }

    /// ψ, J/m³; NaN where the law has no value.
    pub fn energy<const D: usize>(&self, f: &Tensor<D>) -> f64 {
        isotropic!(self, law => law.energy(f), law => isotropic::energy(law, f, self.transverse).unwrap_or(f64::NAN))
    }

    /// P, Pa; `None` where the law has no value.
    pub fn stress<const D: usize>(&self, f: &Tensor<D>) -> Option<Tensor<D>> {
        isotropic!(self, law => Some(law.stress(f)), law => isotropic::stress(law, f, self.transverse))
    }

    /// `∂P/∂F`, Pa; `None` where the law has no value.
    pub fn tangent<const D: usize>(&self, f: &Tensor<D>) -> Option<Tensor4<D>> {
        isotropic!(self, law => Some(law.tangent()), law => isotropic::tangent(law, f, self.transverse))
    }

    /// J of the whole body and the pressure `−⅓ tr σ`, Pa; NaN where the law has no value.
    pub fn pressure<const D: usize>(&self, f: &Tensor<D>) -> (f64, f64) {
        let none = (f64::NAN, f64::NAN);
        isotropic!(self, law => {
            let strain = f.trace() - D as f64;
            let in_plane = contract(&law.stress(f), &Tensor::identity());
            let across = match self.transverse {
                Transverse::Strain => (3 - D) as f64 * law.lambda * strain,
                Transverse::Stress => 0.0,
            };
            (determinant(f), -(in_plane + across) / 3.0)
        }, law => isotropic::pressure(law, f, self.transverse).unwrap_or(none))
    }

    /// Whether the law has a stress that conserves energy over a step: all but those of plane stress whose outer
    /// stretch has to be found.
    pub fn has_conserving_stress<const D: usize>(&self) -> bool {
        D == 3 || self.transverse == Transverse::Strain || self.is_linear()
    }

    /// P* over a step, Pa: `P* : (F₁ − F₀) = ψ(F₁) − ψ(F₀)`.
    pub fn conserving_stress<const D: usize>(&self, step: &CofactorSecant<D>) -> Tensor<D> {
        // A linear stress at the mean does exactly the work of a quadratic energy.
        isotropic!(self, law => law.stress(&step.mean), law => isotropic::conserving_stress(law, step))
    }

    /// `∂P*/∂F̄`, Pa.
    pub fn conserving_tangent<const D: usize>(&self, step: &CofactorSecant<D>) -> Tensor4<D> {
        isotropic!(self, law => law.tangent(), law => isotropic::conserving_tangent(law, step))
    }
}
