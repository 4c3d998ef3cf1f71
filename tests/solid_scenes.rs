//! Scenes of solids: the ways of giving moduli agree, and mistakes are located with a remedy.

mod support;

use std::path::Path;

use nicolson::material::{LinearElastic, Material, SolidLaw, StVenantKirchhoff};
use nicolson::simulation::prepare;
use support::written::{parse, read, scene, set_up};

fn text(material: &str, rest: &str) -> String {
    format!(
        "dimension = 2\n[[body]]\ncounts = [5, 4]\nsmoothing = 1.0\nshape.box = {{ lower = [0, 0], upper = [4, 3] }}\n\
         material.{material}\n[[boundary]]\nselect.face = \"lower_x\"\nfix = [\"x\", \"y\"]\n{rest}"
    )
}

const DYNAMIC: &str = "[time]\nstep = 0.01\nend = 0.1\n";

fn material(material: &str) -> Material {
    set_up::<2>(&text(material, DYNAMIC)).0.bodies[0].material
}

#[test]
fn two_moduli_of_any_kind_give_the_same_law() {
    // E = 2.6 and ν = 0.3: μ = 1, λ = 1.5, κ = 1.5 + 2/3.
    let ways = [
        "youngs_modulus = 2.6, poissons_ratio = 0.3",
        "lame_lambda = 1.5, shear_modulus = 1.0",
        "bulk_modulus = 2.1666666666666667, shear_modulus = 1.0",
    ];
    for way in ways {
        let law = material(&format!("st_venant_kirchhoff = {{ density = 1.0, {way} }}")).solid.expect("a solid").law;
        let SolidLaw::StVenantKirchhoff(StVenantKirchhoff { lambda, shear_modulus }) = law else { panic!("{law:?}") };
        assert!((lambda - 1.5).abs() < 1e-12 && (shear_modulus - 1.0).abs() < 1e-12, "{way}: {law:?}");
    }
    let plane_stress =
        "linear_elastic = { density = 1.0, lame_lambda = 1.5, shear_modulus = 1.0, transverse = \"stress\" }";
    let law = material(plane_stress).solid.expect("a solid").law;
    let SolidLaw::LinearElastic(LinearElastic { lambda, .. }) = law else { panic!("{law:?}") };
    assert!((lambda - 3.0 / 3.5).abs() < 1e-12, "{lambda}");
    let nearly = material("nearly_incompressible = { density = 1.0, bulk_modulus = 9.0, shear_modulus = 3.0 }");
    assert!(nearly.evolves_volume() && nearly.shear_modulus() == 3.0);
    assert!((nearly.wave_speed() - 13.0_f64.sqrt()).abs() < 1e-12);
}

#[test]
fn mistakes_are_located_with_a_remedy() {
    let good = "youngs_modulus = 1e6, poissons_ratio = 0.3";
    let cases = [
        ("neo_hookean = { density = 1.0, youngs_modulus = 1e6 }".to_owned(), "two elastic constants", "give `youngs"),
        (
            "neo_hookean = { density = 1.0, youngs_modulus = 1e6, shear_modulus = 1e6 }".into(),
            "two elastic",
            "give `youngs",
        ),
        ("neo_hookean = { density = 1.0, youngs_modulus = 1e6, poissons_ratio = 0.5 }".into(), "below 0.5", ""),
        ("neo_hookean = { density = 1.0, lame_lambda = -1e6, shear_modulus = 1e6 }".into(), "not positive", "larger"),
        (format!("linear_elastic = {{ density = 1.0, {good}, gamma = 7.0 }}"), "gamma", ""),
        (format!("neo_hookean = {{ density = 1.0, {good}, transverse = \"plane\" }}"), "plane", ""),
        (format!("neo_hookean = {{ density = 1.0, {good}, shear_viscosity = -1.0 }}"), "shear_viscosity", ""),
        (
            "mooney_rivlin = { density = 1.0, c1 = 0.0, c2 = 0.0, bulk_modulus = 1e6 }".into(),
            "is zero",
            "positive `c1`",
        ),
    ];
    for (law, phrase, remedy) in cases {
        let found = read::<2>(&text(&law, DYNAMIC), Path::new("")).map(drop).expect_err(&law);
        let shown = found.to_string();
        assert!(shown.contains("scene.toml:6:"), "{law}: no place in\n{shown}");
        assert!(shown.contains(phrase) && shown.contains(remedy), "{law}:\n{shown}");
    }
}

#[test]
fn rough_pressures_are_announced() {
    let warned = |ratio: f64, rest: &str| {
        let law = format!("neo_hookean = {{ density = 1.0, youngs_modulus = 1e6, poissons_ratio = {ratio} }}");
        let scene = scene(&format!("{rest}{}", text(&law, DYNAMIC)));
        prepare::<2>(&scene).expect("possible").warnings.iter().any(|warning| warning.contains("nearly incompressible"))
    };
    let stiff = "hourglass = 3.0\n";
    assert!(warned(0.49, stiff) && warned(0.4999, stiff));
    assert!(!warned(0.45, stiff) && !warned(0.49, "") && !warned(0.4999, ""));
}

/// What only the whole scene shows to be impossible.
#[test]
fn impossible_combinations_are_refused_before_the_first_step() {
    let solid = "neo_hookean = { density = 1.0, youngs_modulus = 1e6, poissons_ratio = 0.3, transverse = \"stress\" }";
    let fluid = "linear_volumetric = { density = 1.0, bulk_modulus = 1e6 }";
    let conserving = "[time]\nscheme = \"energy_momentum\"\nstep = 0.01\nend = 0.1\n";
    let still = "[time]\nscheme = \"static\"\nstep = 0.5\nend = 1.0\n";
    let upwind = format!("[stabilisation]\ntau_p = 1.0\n{DYNAMIC}");
    let equilibrium = format!("[initial]\nequilibrium = true\n{DYNAMIC}");
    for (law, rest, phrase) in [
        (solid, conserving, "transverse = \"strain\""),
        (fluid, still, "no unique equilibrium"),
        (fluid, &equilibrium, "no unique equilibrium"),
        (solid, &upwind, "tau_p = 0"),
    ] {
        let error = prepare::<2>(&scene(&text(law, rest))).map(drop).expect_err(phrase).to_string();
        assert!(error.contains(phrase), "{error}");
    }
    let elsewhere = parse(&text(solid, "[time]\nstep = 0.01\nend = 0.1\nramp = true\n"));
    assert!(elsewhere.map(drop).expect_err("ramp").to_string().contains("static"));
}
