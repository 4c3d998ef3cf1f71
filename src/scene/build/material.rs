//! Constitutive laws: density and one way of giving the modulus.

use super::solid;
use crate::material::Material;
use crate::scene::document::{MaterialText, Modulus, Spanned};
use crate::scene::findings::{Findings, Span};

/// Densities, wave speeds and moduli beyond this or its inverse have squares, or squares of these, that are no numbers: an
/// energy or a norm would overflow in the first step.
const LARGEST: f64 = 1e75;

/// The law with its parameters; `None` if a mistake was noted.
pub(super) fn read<const D: usize>(text: &MaterialText, findings: &mut Findings<'_>) -> Option<Material> {
    let (material, table) = match text {
        MaterialText::LinearVolumetric(table) => {
            let text = table.get_ref();
            let density = findings.positive(&text.density, "density");
            let bulk_modulus = modulus::<D>(&text.modulus(), density, 1.0, table.span(), findings);
            (Material::linear_volumetric(density?, bulk_modulus?), table.span())
        }
        MaterialText::HyperelasticVolumetric(table) => {
            let text = table.get_ref();
            let density = findings.positive(&text.density, "density");
            let exponent = findings.within(&text.gamma, "gamma", "at least 1", |gamma| gamma >= 1.0);
            // A wrong exponent is one mistake; the modulus is still looked at.
            let bulk_modulus = modulus::<D>(&text.modulus(), density, exponent.unwrap_or(1.0), table.span(), findings);
            (Material::hyperelastic_volumetric(density?, bulk_modulus?, exponent?), table.span())
        }
        MaterialText::LinearElastic(table) => {
            (solid::elastic::<D>(table.get_ref(), true, table.span(), findings)?, table.span())
        }
        MaterialText::StVenantKirchhoff(table) => {
            (solid::elastic::<D>(table.get_ref(), false, table.span(), findings)?, table.span())
        }
        MaterialText::NeoHookean(table) => {
            (solid::neo_hookean::<D>(table.get_ref(), table.span(), findings)?, table.span())
        }
        MaterialText::MooneyRivlin(table) => (solid::mooney_rivlin::<D>(table.get_ref(), findings)?, table.span()),
        MaterialText::NearlyIncompressible(table) => {
            (solid::nearly_incompressible(table.get_ref(), table.span(), findings)?, table.span())
        }
    };
    let (density, speed) = (material.density, material.wave_speed());
    let stiffness = density * speed * speed;
    let sizes = [("density", density, "kg/m³"), ("wave speed", speed, "m/s"), ("stiffness", stiffness, "Pa")];
    for (what, size, unit) in sizes {
        if !(1.0 / LARGEST..=LARGEST).contains(&size) {
            findings.error(
                table,
                format!("the {what} of the material is {size:e} {unit}, too extreme to be computed with"),
                "give values of a usual size in SI units, or as text with another unit",
            );
            return None;
        }
    }
    Some(material)
}

/// κ itself; or from E and ν, κ = E / (D (1 − (D − 1) ν)), which is E/(2(1 − ν)) in two and E/(3(1 − 2ν)) in
/// three dimensions; or from the wave speed at rest, κ = ρc²/γ (γ = 1 for the linear law).
fn modulus<const D: usize>(
    given: &Modulus<'_>,
    density: Option<f64>,
    exponent: f64,
    table: Span,
    findings: &mut Findings<'_>,
) -> Option<f64> {
    let ways = "give `bulk_modulus`, or `youngs_modulus` and `poissons_ratio`, or `wave_speed`: one of the three";
    let youngs = given.youngs.as_ref().map(Spanned::span);
    let elastic = youngs.or(given.poissons.as_ref().map(Spanned::span));
    let places = [given.bulk.as_ref().map(Spanned::span), elastic, given.wave_speed.as_ref().map(Spanned::span)];
    let present: Vec<Span> = places.into_iter().flatten().collect();
    let [only] = present.as_slice() else {
        match present.last() {
            None => findings.error(table, "the material has no modulus", ways),
            // The last in the text is the one too many.
            Some(_) => {
                let surplus = present.into_iter().max_by_key(|span| span.start).unwrap_or(table);
                findings.error(surplus, "the modulus is given in more than one way", ways);
            }
        }
        return None;
    };
    let modulus = match (given.bulk, given.youngs, given.poissons, given.wave_speed) {
        (Some(bulk), ..) => findings.positive(bulk, "bulk_modulus")?,
        (_, Some(youngs), Some(poissons), _) => {
            let youngs = findings.positive(youngs, "youngs_modulus");
            let poissons = findings
                .within(poissons, "poissons_ratio", "above -1 and below 0.5", |ratio| ratio > -1.0 && ratio < 0.5);
            let dimension = D as f64;
            youngs? / (dimension * (1.0 - (dimension - 1.0) * poissons?))
        }
        (_, Some(alone), None, _) => {
            findings.error(alone.span(), "`youngs_modulus` needs `poissons_ratio`", "add `poissons_ratio = 0.3`");
            return None;
        }
        (_, None, Some(alone), _) => {
            findings.error(
                alone.span(),
                "`poissons_ratio` needs `youngs_modulus`",
                "add `youngs_modulus = 1e6`, in Pa",
            );
            return None;
        }
        (.., Some(speed)) => {
            let speed = findings.positive(speed, "wave_speed")?;
            density? * speed * speed / exponent
        }
        (None, None, None, None) => return None,
    };
    if modulus.is_finite() && modulus > 0.0 {
        return Some(modulus);
    }
    findings.error(
        only.clone(),
        format!("the bulk modulus becomes {modulus} Pa"),
        "give values of a usual size in SI units",
    );
    None
}
