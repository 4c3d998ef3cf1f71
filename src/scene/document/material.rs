//! `material.LAW` of a body.

use serde::Deserialize;
use toml::Spanned;

use super::Number;
use crate::material::{Transverse, VolumetricForm};

#[derive(Debug, Clone, Deserialize)]
#[serde(
    rename_all = "snake_case",
    expecting = "a material, such as `material.linear_volumetric = { density = 1000, bulk_modulus = 1e6 }`"
)]
pub(in crate::scene) enum MaterialText {
    LinearVolumetric(Spanned<LinearText>),
    HyperelasticVolumetric(Spanned<HyperelasticText>),
    LinearElastic(Spanned<SolidText>),
    StVenantKirchhoff(Spanned<SolidText>),
    NeoHookean(Spanned<NeoHookeanText>),
    MooneyRivlin(Spanned<MooneyRivlinText>),
    NearlyIncompressible(Spanned<NearlyIncompressibleText>),
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with `density` and two moduli")]
pub(in crate::scene) struct SolidText {
    pub density: Number,
    pub youngs_modulus: Option<Number>,
    pub poissons_ratio: Option<Number>,
    pub bulk_modulus: Option<Number>,
    pub shear_modulus: Option<Number>,
    pub lame_lambda: Option<Number>,
    pub transverse: Option<Spanned<TransverseText>>,
    pub shear_viscosity: Option<Number>,
    pub bulk_viscosity: Option<Number>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with `density` and two moduli")]
pub(in crate::scene) struct NeoHookeanText {
    pub density: Number,
    pub youngs_modulus: Option<Number>,
    pub poissons_ratio: Option<Number>,
    pub bulk_modulus: Option<Number>,
    pub shear_modulus: Option<Number>,
    pub lame_lambda: Option<Number>,
    #[serde(default)]
    pub volumetric_energy: VolumetricFormText,
    pub transverse: Option<Spanned<TransverseText>>,
    pub shear_viscosity: Option<Number>,
    pub bulk_viscosity: Option<Number>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with `density`, `c1`, `c2` and `bulk_modulus`")]
pub(in crate::scene) struct MooneyRivlinText {
    pub density: Number,
    pub c1: Number,
    pub c2: Number,
    pub bulk_modulus: Number,
    #[serde(default)]
    pub volumetric_energy: VolumetricFormText,
    pub transverse: Option<Spanned<TransverseText>>,
    pub shear_viscosity: Option<Number>,
    pub bulk_viscosity: Option<Number>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with `density` and two moduli")]
pub(in crate::scene) struct NearlyIncompressibleText {
    pub density: Number,
    pub youngs_modulus: Option<Number>,
    pub poissons_ratio: Option<Number>,
    pub bulk_modulus: Option<Number>,
    pub shear_modulus: Option<Number>,
    pub lame_lambda: Option<Number>,
    pub gamma: Option<Number>,
    pub shear_viscosity: Option<Number>,
    pub bulk_viscosity: Option<Number>,
}

/// What holds across the directions that are left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum TransverseText {
    Strain,
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

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum VolumetricFormText {
    #[default]
    Logarithmic,
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

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with `density` and a modulus")]
pub(in crate::scene) struct LinearText {
    pub density: Number,
    pub bulk_modulus: Option<Number>,
    pub youngs_modulus: Option<Number>,
    pub poissons_ratio: Option<Number>,
    pub wave_speed: Option<Number>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with `density`, `gamma` and a modulus")]
pub(in crate::scene) struct HyperelasticText {
    pub density: Number,
    pub gamma: Number,
    pub bulk_modulus: Option<Number>,
    pub youngs_modulus: Option<Number>,
    pub poissons_ratio: Option<Number>,
    pub wave_speed: Option<Number>,
}
