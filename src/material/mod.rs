//! Constitutive laws.
//!
//! The stress of every material has up to three parts, each present only where the scene asks for it:
//!
//! ```text
//! P = −p(J) H  +  ∂ψ(F)/∂F  +  P_v(F, L)
//! ```
//!
//! | part | laws | file |
//! |---|---|---|
//! | volumetric, from the evolved volume ratio J | linear, hyperelastic | `volumetric*` |
//! | solid, from F | St Venant–Kirchhoff, neo-Hookean, Mooney–Rivlin, linear elastic | one file each |
//! | viscous, from F and L | Kelvin–Voigt | `kelvin_voigt` |
//!
//! The volumetric laws alone are the fluids of document 004. A nearly incompressible solid has both: its pressure
//! comes from the evolved J, and its deviator from F. To add an isotropic solid: one file that implements
//! [`IsotropicEnergy`] as a function of three invariants, one arm in [`SolidLaw`], one row in the shared test table.

pub mod chord;
mod isotropic;
mod kelvin_voigt;
mod linear_elastic;
mod mooney_rivlin;
mod neo_hookean;
mod solid;
mod st_venant_kirchhoff;
mod volumetric;
mod volumetric_hyperelastic;
mod volumetric_linear;

pub use isotropic::{Invariants, IsotropicEnergy, Response};
pub use kelvin_voigt::KelvinVoigt;
pub use linear_elastic::LinearElastic;
pub use mooney_rivlin::MooneyRivlin;
pub use neo_hookean::NeoHookean;
pub use solid::{Solid, SolidLaw, Transverse, VolumetricForm};
pub use st_venant_kirchhoff::StVenantKirchhoff;
pub use volumetric::Volumetric;
pub use volumetric_hyperelastic::HyperelasticVolumetric;
pub use volumetric_linear::LinearVolumetric;

/// A material: density and the parts of its stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Reference density, kg/m³.
    pub density: f64,
    /// Pressure from the evolved volume ratio.
    pub volumetric: Option<Volumetric>,
    /// Stress from the deformation gradient.
    pub solid: Option<Solid>,
    /// Stress from the rate of strain.
    pub viscosity: Option<KelvinVoigt>,
}

impl Material {
    /// A fluid with `p = −κ(J−1)`.
    pub fn linear_volumetric(density: f64, bulk_modulus: f64) -> Self {
        Self::volumetric(density, Volumetric::Linear(LinearVolumetric { density, bulk_modulus }))
    }

    /// A fluid with `p = κ(J^{−γ}−1)`, γ ≥ 1.
    pub fn hyperelastic_volumetric(density: f64, bulk_modulus: f64, exponent: f64) -> Self {
        let law = HyperelasticVolumetric { density, bulk_modulus, exponent };
        Self::volumetric(density, Volumetric::Hyperelastic(law))
    }

    fn volumetric(density: f64, law: Volumetric) -> Self {
        Self { density, volumetric: Some(law), solid: None, viscosity: None }
    }

    /// A solid whose stress comes from F alone.
    pub fn solid(density: f64, law: SolidLaw, transverse: Transverse) -> Self {
        Self { density, volumetric: None, solid: Some(Solid { law, transverse }), viscosity: None }
    }

    /// The same with viscosity.
    #[must_use]
    pub fn with_viscosity(self, viscosity: KelvinVoigt) -> Self {
        Self { viscosity: Some(viscosity), ..self }
    }

    /// Whether the pressure depends on the evolved volume ratio.
    pub fn evolves_volume(&self) -> bool {
        self.volumetric.is_some()
    }

    /// Bulk modulus of the part of J plus the moduli of the part of F, Pa: `(λ + 2μ, μ)` at rest.
    fn moduli(&self) -> (f64, f64) {
        let pressure = self.volumetric.map_or(0.0, |law| -law.pressure_slope(1.0));
        let (longitudinal, shear) = self.solid.map_or((0.0, 0.0), |solid| solid.moduli());
        (pressure + longitudinal, shear)
    }

    /// Speed of pressure waves at rest, m/s.
    pub fn wave_speed(&self) -> f64 {
        (self.moduli().0 / self.density).sqrt()
    }

    /// Speed of shear waves at rest, m/s; zero for a fluid.
    pub fn shear_wave_speed(&self) -> f64 {
        (self.moduli().1 / self.density).sqrt()
    }

    /// Shear modulus at rest, Pa; zero for a fluid.
    pub fn shear_modulus(&self) -> f64 {
        self.moduli().1
    }

    /// Modulus that scales the hourglass control, Pa: 2μ of a solid, `ρ c_p²` of a fluid.
    pub fn hourglass_modulus(&self) -> f64 {
        let (longitudinal, shear) = self.moduli();
        if shear > 0.0 { 2.0 * shear } else { longitudinal }
    }

    /// Largest speed of waves, m/s, as seen from reference coordinates: at rest times at least 1, from the smallest
    /// and largest principal stretches squared. The laws of J grow with the area ratio (3.57), St Venant–Kirchhoff
    /// with the stretch.
    pub fn largest_wave_speed(&self, smallest: f64, largest: f64) -> f64 {
        let compressed = 1.0 / smallest.sqrt();
        let factor = match &self.solid {
            None => compressed,
            Some(solid) => compressed.max(1.0).max(solid.stiffening(largest)),
        };
        self.wave_speed() * factor
    }

    /// Energy density of the part of J, J/m³. NaN or infinite outside the domain.
    pub fn energy(&self, j: f64) -> f64 {
        self.volumetric.map_or(0.0, |law| law.energy(j))
    }

    /// Pressure `p(J) = −dψ/dJ` of the part of J, Pa.
    pub fn pressure(&self, j: f64) -> f64 {
        self.volumetric.map_or(0.0, |law| law.pressure(j))
    }

    /// Slope `dp/dJ`, Pa.
    pub fn pressure_slope(&self, j: f64) -> f64 {
        self.volumetric.map_or(0.0, |law| law.pressure_slope(j))
    }

    /// Discrete derivative `(ψ(J₁) − ψ(J₀))/(J₁ − J₀)` of the part of J, Pa, and its derivative with respect to `J₁`.
    pub fn discrete_slope(&self, j0: f64, j1: f64) -> (f64, f64) {
        self.volumetric.map_or((0.0, 0.0), |law| law.discrete_slope(j0, j1))
    }

    /// The volume ratio at a given pressure; `None` if the law cannot reach it, or has no pressure of J.
    pub fn volume_ratio_at(&self, pressure: f64) -> Option<f64> {
        self.volumetric.and_then(|law| law.volume_ratio_at(pressure))
    }

    /// Whether the evolved J must be positive.
    pub fn needs_positive_ratio(&self) -> bool {
        self.volumetric.is_some_and(|law| law.needs_positive_volume())
    }

    /// Whether det F must be positive.
    pub fn needs_positive_determinant(&self) -> bool {
        self.needs_positive_ratio() || self.solid.is_some_and(|solid| solid.needs_positive_determinant())
    }

    /// Whether the stress is linear in J, or in F for a solid, at a constant cofactor.
    pub fn is_linear(&self) -> bool {
        self.viscosity.is_none()
            && self.volumetric.is_none_or(|law| law.is_linear())
            && self.solid.is_none_or(|solid| solid.is_linear())
    }
}
