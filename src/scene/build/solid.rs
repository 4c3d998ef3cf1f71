//! Solid laws: density, two moduli, and what holds across the directions left out.

use crate::material::{
    HyperelasticVolumetric, KelvinVoigt, LinearElastic, LinearVolumetric, Material, MooneyRivlin, NeoHookean, Solid,
    SolidLaw, StVenantKirchhoff, Transverse, Volumetric, VolumetricForm,
};
use crate::scene::document::{
    Measure, Moduli, MooneyRivlinText, NearlyIncompressibleText, NeoHookeanText, SolidText, Spanned, TransverseText,
};
use crate::scene::findings::{Findings, Span};
use crate::scene::units::Viscosity;

/// The two Lamé parameters, Pa.
struct Lame {
    lambda: f64,
    shear: f64,
}

impl Lame {
    fn bulk(&self) -> f64 {
        self.lambda + 2.0 / 3.0 * self.shear
    }
}

const WAYS: &str = "give `youngs_modulus` and `poissons_ratio`, or `bulk_modulus` and `shear_modulus`, or `lame_lambda` \
                    and `shear_modulus`";

/// Lamé's parameters of what is given.
fn lame(given: &Moduli<'_>, table: Span, findings: &mut Findings<'_>) -> Option<Lame> {
    let lame = match (given.youngs, given.poissons, given.bulk, given.shear, given.lambda) {
        (Some(youngs), Some(poissons), None, None, None) => {
            let youngs = findings.positive(youngs, "youngs_modulus");
            let nu = findings
                .within(poissons, "poissons_ratio", "above -1 and below 0.5", |ratio| ratio > -1.0 && ratio < 0.5);
            let (youngs, nu) = (youngs?, nu?);
            let shear = youngs / (2.0 * (1.0 + nu));
            Lame { lambda: 2.0 * shear * nu / (1.0 - 2.0 * nu), shear }
        }
        (None, None, Some(bulk), Some(shear), None) => {
            let bulk = findings.positive(bulk, "bulk_modulus");
            let shear = findings.positive(shear, "shear_modulus");
            let (bulk, shear) = (bulk?, shear?);
            Lame { lambda: bulk - 2.0 / 3.0 * shear, shear }
        }
        (None, None, None, Some(shear), Some(lambda)) => {
            let shear = findings.positive(shear, "shear_modulus");
            let lambda_value = findings.within(lambda, "lame_lambda", "finite", |_| true);
            let (lambda_value, shear) = (lambda_value?, shear?);
            if lambda_value + 2.0 / 3.0 * shear <= 0.0 {
                findings.error(lambda.span(), "the bulk modulus λ + 2μ/3 is not positive", "give a larger λ");
                return None;
            }
            Lame { lambda: lambda_value, shear }
        }
        _ => {
            findings.error(table, "a solid needs exactly two elastic constants that go together", WAYS);
            return None;
        }
    };
    if lame.lambda.is_finite() && lame.shear.is_finite() && lame.shear > 0.0 {
        return Some(lame);
    }
    findings.error(
        table,
        format!("the Lamé parameters become {} and {} Pa", lame.lambda, lame.shear),
        "give values of a usual size in SI units",
    );
    None
}

fn transverse<const D: usize>(
    text: Option<&Spanned<TransverseText>>,
    findings: &mut Findings<'_>,
) -> Option<Transverse> {
    let Some(text) = text else { return Some(Transverse::default()) };
    if D == 3 {
        findings.error(
            text.span(),
            "`transverse` says what holds across a plane or a line; in three dimensions nothing is left out",
            "remove the key",
        );
        return None;
    }
    Some((*text.get_ref()).into())
}

/// Kelvin–Voigt viscosity; `Some(None)` if there is none.
fn viscosity(
    shear: &Option<Measure<Viscosity>>,
    bulk: &Option<Measure<Viscosity>>,
    findings: &mut Findings<'_>,
) -> Option<Option<KelvinVoigt>> {
    let mut read = |number: &Option<Measure<Viscosity>>, name: &str| match number {
        None => Some(0.0),
        Some(number) => findings.within(number, name, "at least 0", |value| value >= 0.0),
    };
    let (shear, bulk) = (read(shear, "shear_viscosity"), read(bulk, "bulk_viscosity"));
    let viscosity = KelvinVoigt { shear: shear?, bulk: bulk? };
    Some((viscosity.shear > 0.0 || viscosity.bulk > 0.0).then_some(viscosity))
}

/// St Venant–Kirchhoff, or linear elasticity.
pub(super) fn elastic<const D: usize>(
    text: &SolidText,
    linear: bool,
    table: Span,
    findings: &mut Findings<'_>,
) -> Option<Material> {
    let density = findings.positive(&text.density, "density");
    let lame = lame(&text.moduli(), table, findings);
    let transverse = transverse::<D>(text.transverse.as_ref(), findings);
    let viscosity = viscosity(&text.shear_viscosity, &text.bulk_viscosity, findings);
    let (density, lame, transverse) = (density?, lame?, transverse?);
    let law = if linear {
        // Without stress across the plane (the line), λ is replaced by λ*, and the law stays linear.
        let Lame { lambda, shear } = lame;
        let lambda = match (transverse, D) {
            (Transverse::Strain, _) | (_, 3) => lambda,
            (Transverse::Stress, 2) => 2.0 * lambda * shear / (lambda + 2.0 * shear),
            (Transverse::Stress, _) => lambda * shear / (lambda + shear),
        };
        SolidLaw::LinearElastic(LinearElastic { lambda, shear_modulus: shear })
    } else {
        SolidLaw::StVenantKirchhoff(StVenantKirchhoff { lambda: lame.lambda, shear_modulus: lame.shear })
    };
    Some(Material { viscosity: viscosity?, ..Material::solid(density, law, transverse) })
}

/// Compressible neo-Hookean.
pub(super) fn neo_hookean<const D: usize>(
    text: &NeoHookeanText,
    table: Span,
    findings: &mut Findings<'_>,
) -> Option<Material> {
    let density = findings.positive(&text.density, "density");
    let lame = lame(&text.moduli(), table, findings);
    let transverse = transverse::<D>(text.transverse.as_ref(), findings);
    let viscosity = viscosity(&text.shear_viscosity, &text.bulk_viscosity, findings);
    let (density, lame, transverse) = (density?, lame?, transverse?);
    let volumetric = text.volumetric_energy.into();
    let law = SolidLaw::NeoHookean(NeoHookean { lambda: lame.lambda, shear_modulus: lame.shear, volumetric });
    Some(Material { viscosity: viscosity?, ..Material::solid(density, law, transverse) })
}

/// Mooney–Rivlin.
pub(super) fn mooney_rivlin<const D: usize>(text: &MooneyRivlinText, findings: &mut Findings<'_>) -> Option<Material> {
    let density = findings.positive(&text.density, "density");
    let first = findings.within(&text.c1, "c1", "at least 0", |c| c >= 0.0);
    let second = findings.within(&text.c2, "c2", "at least 0", |c| c >= 0.0);
    let bulk_modulus = findings.positive(&text.bulk_modulus, "bulk_modulus");
    let transverse = transverse::<D>(text.transverse.as_ref(), findings);
    let viscosity = viscosity(&text.shear_viscosity, &text.bulk_viscosity, findings);
    let (density, first, second, bulk_modulus, transverse) = (density?, first?, second?, bulk_modulus?, transverse?);
    if first + second <= 0.0 {
        findings.error(text.c1.span(), "the shear modulus 2(c1 + c2) is zero", "give a positive `c1`");
        return None;
    }
    let law = MooneyRivlin { first, second, bulk_modulus, volumetric: text.volumetric_energy.into() };
    Some(Material { viscosity: viscosity?, ..Material::solid(density, SolidLaw::MooneyRivlin(law), transverse) })
}

/// Pressure from the evolved volume ratio, deviator from the isochoric neo-Hookean energy of F.
pub(super) fn nearly_incompressible(
    text: &NearlyIncompressibleText,
    table: Span,
    findings: &mut Findings<'_>,
) -> Option<Material> {
    let density = findings.positive(&text.density, "density");
    let lame = lame(&text.moduli(), table, findings);
    let gamma = text.gamma.as_ref().map(|gamma| findings.within(gamma, "gamma", "at least 1", |gamma| gamma >= 1.0));
    let viscosity = viscosity(&text.shear_viscosity, &text.bulk_viscosity, findings);
    let (density, lame) = (density?, lame?);
    let volumetric = match gamma {
        None => Volumetric::Linear(LinearVolumetric { density, bulk_modulus: lame.bulk() }),
        Some(gamma) => {
            let exponent = gamma?;
            let bulk_modulus = lame.bulk() / exponent;
            Volumetric::Hyperelastic(HyperelasticVolumetric { density, bulk_modulus, exponent })
        }
    };
    let volumetric_form = VolumetricForm::default();
    let law = MooneyRivlin { first: 0.5 * lame.shear, second: 0.0, bulk_modulus: 0.0, volumetric: volumetric_form };
    let solid = Solid { law: SolidLaw::MooneyRivlin(law), transverse: Transverse::Strain };
    Some(Material { density, volumetric: Some(volumetric), solid: Some(solid), viscosity: viscosity? })
}
