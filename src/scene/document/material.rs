//! `material.LAW` of a body.

use serde::Deserialize;

use super::{Measure, Number, Spanned};
use crate::material::{Transverse, VolumetricForm};
use crate::scene::units::{Density, Pressure, Velocity, Viscosity};

/// The law of a body, and its parameters.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    rename_all = "snake_case",
    expecting = "a material, such as `material.linear_volumetric = { density = 1000, bulk_modulus = 1e6 }`"
)]
pub(in crate::scene) enum MaterialText {
    /// A fluid, or anything without shear: the pressure is linear in the volume ratio.
    LinearVolumetric(Spanned<LinearText>),
    /// A fluid whose pressure follows a power of the volume ratio (Tait, Murnaghan).
    HyperelasticVolumetric(Spanned<HyperelasticText>),
    /// Linear elasticity: small strains and rotations.
    LinearElastic(Spanned<SolidText>),
    /// Linear in the Green–Lagrange strain: large rotations, small strains.
    StVenantKirchhoff(Spanned<SolidText>),
    /// Compressible neo-Hookean: large strains.
    NeoHookean(Spanned<NeoHookeanText>),
    /// Mooney–Rivlin: rubber.
    MooneyRivlin(Spanned<MooneyRivlinText>),
    /// Pressure from the evolved volume ratio, deviator from the isochoric neo-Hookean energy.
    NearlyIncompressible(Spanned<NearlyIncompressibleText>),
}

/// The five elastic constants of a solid, of which two that go together are given.
pub(in crate::scene) struct Moduli<'a> {
    pub youngs: &'a Option<Measure<Pressure>>,
    pub poissons: &'a Option<Number>,
    pub bulk: &'a Option<Measure<Pressure>>,
    pub shear: &'a Option<Measure<Pressure>>,
    pub lambda: &'a Option<Measure<Pressure>>,
}

/// A table with the keys that all solids with two moduli have, and its own. A macro, because serde cannot flatten a
/// table into another one and still refuse unknown keys.
macro_rules! solid {
    ($(#[$attributes:meta])* $name:ident { $($(#[$about:meta])* $key:ident: $type:ty,)* }) => {
        $(#[$attributes])*
        #[derive(Debug, Clone, Deserialize)]
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        #[serde(deny_unknown_fields, expecting = "a table with `density` and two moduli")]
        pub(in crate::scene) struct $name {
            /// Density at rest.
            pub density: Measure<Density>,
            /// Young's modulus E; with `poissons_ratio`.
            pub youngs_modulus: Option<Measure<Pressure>>,
            /// Poisson's ratio ν, above -1 and below 0.5; with `youngs_modulus`.
            pub poissons_ratio: Option<Number>,
            /// Bulk modulus κ; with `shear_modulus`.
            pub bulk_modulus: Option<Measure<Pressure>>,
            /// Shear modulus μ; with `bulk_modulus` or `lame_lambda`.
            pub shear_modulus: Option<Measure<Pressure>>,
            /// Lamé's first parameter λ; with `shear_modulus`.
            pub lame_lambda: Option<Measure<Pressure>>,
            /// Kelvin–Voigt viscosity of shear; default none.
            pub shear_viscosity: Option<Measure<Viscosity>>,
            /// Kelvin–Voigt viscosity of changes of volume; default none.
            pub bulk_viscosity: Option<Measure<Viscosity>>,
            $($(#[$about])* pub $key: $type,)*
        }

        impl $name {
            /// What is given of the elastic constants.
            pub fn moduli(&self) -> Moduli<'_> {
                Moduli {
                    youngs: &self.youngs_modulus,
                    poissons: &self.poissons_ratio,
                    bulk: &self.bulk_modulus,
                    shear: &self.shear_modulus,
                    lambda: &self.lame_lambda,
                }
            }
        }
    };
}

solid! {
    /// A solid given by its density and two moduli.
    SolidText {
        /// What holds across the directions that are left out in one and two dimensions.
        #[cfg_attr(test, schemars(extend("default" = TransverseText::Strain)))]
        transverse: Option<Spanned<TransverseText>>,
    }
}

solid! {
    /// A neo-Hookean solid given by its density and two moduli.
    NeoHookeanText {
        /// Energy of changes of volume.
        #[serde(default)]
        volumetric_energy: VolumetricFormText,
        /// What holds across the directions that are left out in one and two dimensions.
        #[cfg_attr(test, schemars(extend("default" = TransverseText::Strain)))]
        transverse: Option<Spanned<TransverseText>>,
    }
}

solid! {
    /// A nearly incompressible solid given by its density and two moduli.
    NearlyIncompressibleText {
        /// Exponent of the pressure law, at least 1; default: pressure linear in the volume ratio.
        gamma: Option<Number>,
    }
}

/// A Mooney–Rivlin solid.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table with `density`, `c1`, `c2` and `bulk_modulus`")]
pub(in crate::scene) struct MooneyRivlinText {
    /// Density at rest.
    pub density: Measure<Density>,
    /// First constant; the shear modulus is 2(c1 + c2).
    pub c1: Measure<Pressure>,
    /// Second constant.
    pub c2: Measure<Pressure>,
    /// Bulk modulus κ.
    pub bulk_modulus: Measure<Pressure>,
    /// Energy of changes of volume.
    #[serde(default)]
    pub volumetric_energy: VolumetricFormText,
    /// What holds across the directions that are left out in one and two dimensions.
    #[cfg_attr(test, schemars(extend("default" = TransverseText::Strain)))]
    pub transverse: Option<Spanned<TransverseText>>,
    /// Kelvin–Voigt viscosity of shear; default none.
    pub shear_viscosity: Option<Measure<Viscosity>>,
    /// Kelvin–Voigt viscosity of changes of volume; default none.
    pub bulk_viscosity: Option<Measure<Viscosity>>,
}

/// What holds across the directions that are left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum TransverseText {
    /// Plane strain, or uniaxial strain.
    Strain,
    /// Plane stress, or uniaxial stress; with `energy_momentum` for `linear_elastic` only.
    Stress,
}

impl From<TransverseText> for Transverse {
    fn from(text: TransverseText) -> Self {
        match text {
            TransverseText::Strain => Self::Strain,
            TransverseText::Stress => Self::Stress,
        }
    }
}

/// Energy of changes of volume.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum VolumetricFormText {
    /// In (ln J)².
    #[default]
    Logarithmic,
    /// In (J - 1)².
    Quadratic,
}

impl From<VolumetricFormText> for VolumetricForm {
    fn from(text: VolumetricFormText) -> Self {
        match text {
            VolumetricFormText::Logarithmic => Self::Logarithmic,
            VolumetricFormText::Quadratic => Self::Quadratic,
        }
    }
}

/// The ways of giving the modulus of a law of the volume ratio.
pub(in crate::scene) struct Modulus<'a> {
    pub bulk: &'a Option<Measure<Pressure>>,
    pub youngs: &'a Option<Measure<Pressure>>,
    pub poissons: &'a Option<Number>,
    pub wave_speed: &'a Option<Measure<Velocity>>,
}

/// A table with the keys that both laws of the volume ratio have, and its own.
macro_rules! volumetric {
    ($(#[$attributes:meta])* $name:ident { $($(#[$about:meta])* $key:ident: $type:ty,)* }) => {
        #[derive(Debug, Clone, Deserialize)]
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        #[serde(deny_unknown_fields)]
        $(#[$attributes])*
        pub(in crate::scene) struct $name {
            /// Density at rest.
            pub density: Measure<Density>,
            $($(#[$about])* pub $key: $type,)*
            /// Bulk modulus κ; or one of the other two ways.
            pub bulk_modulus: Option<Measure<Pressure>>,
            /// Young's modulus E of a solid as stiff; with `poissons_ratio`.
            pub youngs_modulus: Option<Measure<Pressure>>,
            /// Poisson's ratio ν, above -1 and below 0.5; with `youngs_modulus`.
            pub poissons_ratio: Option<Number>,
            /// Wave speed at rest.
            pub wave_speed: Option<Measure<Velocity>>,
        }

        impl $name {
            /// What is given of the modulus.
            pub fn modulus(&self) -> Modulus<'_> {
                Modulus {
                    bulk: &self.bulk_modulus,
                    youngs: &self.youngs_modulus,
                    poissons: &self.poissons_ratio,
                    wave_speed: &self.wave_speed,
                }
            }
        }
    };
}

volumetric! {
    /// Pressure linear in the volume ratio: density, and one of the three ways of giving the modulus.
    #[serde(expecting = "a table with `density` and a modulus")]
    LinearText {}
}

volumetric! {
    /// Pressure as a power of the volume ratio: density, gamma, and one of the three ways of giving the modulus.
    #[serde(expecting = "a table with `density`, `gamma` and a modulus")]
    HyperelasticText {
        /// Exponent of the pressure law, at least 1; 7 for water.
        gamma: Number,
    }
}
