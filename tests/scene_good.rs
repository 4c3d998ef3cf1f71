//! Good scenes: what is read is what is written.

mod support;

use nicolson::material::{LinearVolumetric, Material, Volumetric};
use nicolson::scene::Scene;
use nicolson::scene::settings::{
    Forcing, LineSearch, OutputField, PreconditionerChoice, Scheme, SolverChoice, StepChoice, TangentPolicy, Unknowns,
};
use nicolson::setup::{
    CofactorChoice, Constraint, InterfaceChoice, KernelChoice, Stabilisation, VolumeRatioChoice, WeightChoice,
};
use support::written::{SCHEMES, scene, set_up};

/// Every key of a scene, in two dimensions.
const EVERYTHING: &str = r#"
title = "Everything"
dimension = 2
gravity = [0.0, -10]
body_force = ["0.1*X", 0]
hourglass = "none"

[[body]]
name = "column"
spacing = 0.5
layout = "vertex"
shape.box = { lower = [0, 0], upper = [2, 1.0] }
kernel = "wendland_c2"
smoothing = 1.3
weights = "balanced"
cofactor = "evolved"
volume_ratio = "evolved"
hourglass = 0.25
material.hyperelastic_volumetric = { density = 1000.0, gamma = 7.0, wave_speed = 10.0 }

[[body]]
name = "block"
counts = [3, 2]
layout = "cell"
shape.box = { lower = [5, 0], upper = [8, 2] }
material.linear_volumetric = { density = 10.0, youngs_modulus = 7e6, poissons_ratio = 0.3 }

[initial]
displacement = [0, "0.01*Y"]
velocity = ["1", "-1"]
hydrostatic = { level = 2.0 }

[[boundary]]
name = "base"
body = "column"
select.half_space = { point = [0, 0], normal = [0, -1] }
fix = ["x", "y"]

[[boundary]]
name = "lid"
body = "column"
select.where = "Y > 0.999"
displacement = { y = "0.1*sin(t)" }

[[boundary]]
name = "all of the block"
body = "block"
select = "all"
fix = ["x"]

[[boundary]]
body = "block"
select.box = { lower = [5, 0], upper = [6, 2] }
displacement = { y = 0 }

[[traction]]
name = "pull"
body = "column"
face = "upper_x"
value = ["1e4*sin(t)", 0]

[[traction]]
face = "lower_y"
select.where = "X > 4"
value = [0, "Y"]

[stabilisation]
tau_v = 0.5
tau_p = 0.25
wave_speed = "deformed"
gradient = "corrected"
interface = "reconstructed"
pressure_jump = "stress"

[time]
end = 1.0
step = 0.05
scheme = "generalised_alpha"
spectral_radius = 0.7
minimum_step = 1e-6

[newton]
relative_tolerance = 1e-9
scale_tolerance = 1e-13
max_iterations = 30
line_search = "more_thuente"
tangent = "lagged"
forcing = "eisenstat_walker_2"
unknowns = "velocity_jacobian"
linear = false

[linear]
solver = "gmres"
preconditioner = "ilu0"
tolerance = 1e-9
max_iterations = 200
restart = 30

[output]
interval = 0.1
fields = ["pressure", "deformation_gradient"]
plots = false
history = true

[[probe]]
name = "tip"
at = [2, 1]

[[probe]]
name = "inside"
at = [6.2, 0.9]
mode = "interpolated"
body = "block"

[exact]
displacement = ["0", "0.01*Y"]
velocity = [0, 0]
pressure = "1000*t"
"#;

#[test]
fn every_key_reaches_its_setting() {
    let scene = scene(EVERYTHING);
    assert_eq!((scene.title.as_str(), scene.dimension(), scene.text()), ("Everything", 2, EVERYTHING));
    assert_eq!(scene.time.scheme, Scheme::GeneralisedAlpha { spectral_radius: 0.7 });
    assert_eq!((scene.time.end, scene.time.step, scene.time.minimum_step), (1.0, StepChoice::Fixed(0.05), Some(1e-6)));
    let newton = &scene.newton;
    assert_eq!((newton.relative_tolerance, newton.scale_tolerance, newton.max_iterations), (1e-9, 1e-13, 30));
    assert_eq!((newton.line_search, newton.tangent), (LineSearch::MoreThuente, TangentPolicy::Lagged));
    assert_eq!((newton.forcing, newton.unknowns), (Forcing::EisenstatWalker2, Unknowns::VelocityJacobian));
    assert_eq!(newton.declared_linear, Some(false));
    let linear = &scene.linear;
    assert_eq!((linear.solver, linear.preconditioner), (SolverChoice::Gmres, PreconditionerChoice::Ilu0));
    assert_eq!((linear.tolerance, linear.max_iterations, linear.restart), (1e-9, 200, 30));
    let output = &scene.output;
    assert_eq!((output.interval, output.plots, output.history), (Some(0.1), false, true));
    assert_eq!(output.fields, [OutputField::Pressure, OutputField::DeformationGradient]);
}

#[test]
fn every_key_reaches_the_set_up() {
    let (setup, warnings) = set_up::<2>(EVERYTHING);
    assert_eq!(setup.bodies.len(), 2);
    let (column, block) = (&setup.bodies[0], &setup.bodies[1]);
    assert_eq!((column.name.as_str(), column.particles.clone(), column.spacing), ("column", 0..15, 0.5));
    assert_eq!((column.kernel, column.smoothing), (KernelChoice::WendlandC2, 1.3));
    assert_eq!((column.weights, column.cofactor), (WeightChoice::Balanced, CofactorChoice::Evolved));
    assert_eq!((column.volume_ratio, block.volume_ratio), (VolumeRatioChoice::Evolved, VolumeRatioChoice::Auto));
    let expected = Material::hyperelastic_volumetric(1000.0, 1e5 / 7.0, 7.0);
    assert_eq!(column.material, expected);
    assert_eq!((block.particles.clone(), block.spacing), (15..21, 1.0));
    assert_eq!((block.kernel, block.smoothing), (KernelChoice::CubicSpline, 1.2));
    assert_eq!((block.weights, block.cofactor), (WeightChoice::Auto, CofactorChoice::Geometric));
    let Some(Volumetric::Linear(LinearVolumetric { density, bulk_modulus })) = block.material.volumetric else {
        panic!()
    };
    assert!(density == 10.0 && (bulk_modulus - 5e6).abs() < 1e-6);

    assert_eq!(setup.gravity.as_slice(), [0.0, -10.0]);
    assert_eq!(setup.body_force.as_ref().unwrap()[0].value([3.0, 0.0, 0.0], 0.0), 0.1 * 3.0);
    let stabilisation = Stabilisation {
        tau_v: 0.5,
        tau_p: 0.25,
        deformed_wave_speed: true,
        corrected_gradient: true,
        interface: InterfaceChoice::Reconstructed,
        stress_jump: true,
        transverse_shear: false,
    };
    assert_eq!(setup.stabilisation, Some(stabilisation));

    assert_eq!(setup.constraints[0], [Constraint::Fixed; 2]);
    assert_eq!(setup.constraints[5], [Constraint::Free; 2]);
    assert_eq!(setup.constraints[10], [Constraint::Free, Constraint::Moving(0)]);
    assert_eq!(setup.constraints[15], [Constraint::Fixed, Constraint::Moving(1)]);
    assert_eq!(setup.constraints[17], [Constraint::Fixed, Constraint::Free]);
    assert_eq!(setup.motions[0].value([0.0; 3], 1.0), 0.1 * 1.0_f64.sin());

    // Constraints win over initial values; a motion starts with its own speed.
    assert_eq!(setup.initial.velocity[0].as_slice(), [0.0, 0.0]);
    assert_eq!(setup.initial.velocity[5].as_slice(), [1.0, -1.0]);
    assert_eq!(setup.initial.velocity[10].as_slice(), [1.0, 0.1]);
    assert_eq!(setup.initial.displacement[5].as_slice(), [0.0, 0.005]);
    assert_eq!(setup.initial.displacement[10].as_slice(), [0.0, 0.0]);
    let pressure = setup.initial.pressure.as_ref().unwrap();
    assert_eq!((pressure[0], pressure[10], pressure[15]), (20_000.0, 10_000.0, 150.0));
    assert_eq!((column.hourglass, block.hourglass), (Some(0.25), Some(0.0)));
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].contains("hourglass control makes a fluid resist"), "{warnings:?}");
    assert!(warnings[1].contains("overrule the initial displacement"), "{warnings:?}");

    assert_eq!(setup.tractions.len(), 2);
    assert_eq!(setup.tractions[0].areas, [(4, 0.25), (9, 0.5), (14, 0.25)]);
    assert_eq!(setup.tractions[1].areas, [(15, 1.0), (16, 1.0), (17, 1.0)]);
    assert_eq!(setup.tractions[1].name, "traction 2");

    assert_eq!(setup.probes[0].particle, Some(14));
    assert_eq!((setup.probes[1].particle, setup.probes[1].body), (None, 1));
    let exact = setup.exact.unwrap();
    assert_eq!(exact.pressure.unwrap().value([0.0; 3], 2.0), 2000.0);
}

#[test]
fn defaults_are_those_documented() {
    let text = r#"
dimension = 1
[[body]]
counts = [11]
shape.box = { lower = [0], upper = [10] }
material.linear_volumetric = { density = 1000, wave_speed = 30 }
[time]
end = 1
scheme = "tvd_rk2"
"#;
    let scene = scene(text);
    assert_eq!(scene.title, "scene");
    assert_eq!(scene.time.step, StepChoice::Cfl(0.3));
    assert_eq!((scene.newton.line_search, scene.linear.solver), (LineSearch::Backtracking, SolverChoice::Auto));
    assert_eq!((scene.output.interval, scene.output.fields.len()), (None, 8));
    let (setup, warnings) = scene.setup::<1>().unwrap();
    assert!(warnings.is_empty());
    assert_eq!(setup.bodies[0].name, "body 1");
    assert_eq!(setup.bodies[0].material, Material::linear_volumetric(1000.0, 9e5));
    let (with, _) = set_up::<1>(&format!("{text}[stabilisation]\ntau_v = 1\n"));
    assert_eq!(with.stabilisation.unwrap().interface, InterfaceChoice::Limited);
    assert!(setup.stabilisation.is_none() && setup.body_force.is_none() && setup.exact.is_none());
    assert!(setup.initial.pressure.is_none() && setup.motions.is_empty() && setup.tractions.is_empty());
    assert_eq!(setup.particles.volumes.iter().sum::<f64>(), 10.0);
}

#[test]
fn implicit_schemes_have_their_parameters() {
    let text = |scheme: &str| {
        format!(
            "dimension = 1\n[[body]]\nspacing = 1\nshape.box = {{ lower = [0], upper = [10] }}\n\
             material.linear_volumetric = {{ density = 1, bulk_modulus = 1 }}\n[time]\nend = 1\nstep = 0.1\n{scheme}"
        )
    };
    let scheme = |scheme: &str| scene(&text(scheme)).time;
    assert_eq!(scheme("").scheme, Scheme::CrankNicolson);
    assert_eq!(scheme("scheme = 'theta'").scheme, Scheme::Theta { theta: 0.5 });
    assert_eq!(scheme("scheme = 'theta'\ntheta = 1").scheme, Scheme::Theta { theta: 1.0 });
    assert_eq!(scheme("scheme = 'generalised_alpha'").scheme, Scheme::GeneralisedAlpha { spectral_radius: 0.8 });
    let adaptive = scheme("scheme = 'tr_bdf2'\nadaptive = { tolerance = 1e-4 }").adaptive.unwrap();
    assert_eq!((adaptive.relative_tolerance, adaptive.absolute_tolerance), (1e-4, 0.0));
    for name in SCHEMES.into_iter().chain(["static"]) {
        scheme(&format!("scheme = '{name}'"));
    }
}

#[test]
fn points_come_from_a_file_beside_the_scene() {
    let folder = tempfile::Builder::new().prefix("scène with späce").tempdir().unwrap();
    std::fs::write(folder.path().join("cloud.csv"), "x,y,volume\n0,0,1\n1,0,2\n0,1,3\n").unwrap();
    let path = folder.path().join("cloud.toml");
    let text = "dimension = 2\n[[body]]\npoints = { file = 'cloud.csv', spacing = 1 }\n\
                material.linear_volumetric = { density = 1, bulk_modulus = 1 }\n\
                [[probe]]\nname = 'p'\nat = [0.9, 0.1]\n[time]\nend = 1\nstep = 0.1\n";
    std::fs::write(&path, text).unwrap();
    let scene = Scene::read(&path, &[]).unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(scene.title, "cloud");
    let (setup, _) = scene.setup::<2>().unwrap();
    assert_eq!(setup.particles.volumes, [1.0, 2.0, 3.0]);
    assert_eq!(setup.particles.kernel_volumes, [1.0; 3]);
    assert_eq!(setup.probes[0].particle, Some(1));
    assert!(setup.particles.faces.is_empty());
}

#[test]
fn a_third_dimension_works() {
    let text = r#"
dimension = 3
gravity = [0, 0, -9.81]
[[body]]
counts = [3, 4, 5]
shape.box = { lower = [0, 0, 0], upper = [1, 1.5, 2] }
kernel = "quintic_spline"
material.linear_volumetric = { density = 1000, youngs_modulus = 3e6, poissons_ratio = 0 }
[initial]
pressure = "1000*9.81*(2 - Z)"
[[boundary]]
select.where = "Z == 0"
fix = ["x", "y", "z"]
[[traction]]
face = "upper_z"
value = [0, 0, -1]
[time]
end = 1
step = 0.1
"#;
    let (setup, _) = set_up::<3>(text);
    assert_eq!(setup.particles.positions.len(), 60);
    let Some(Volumetric::Linear(LinearVolumetric { bulk_modulus, .. })) = setup.bodies[0].material.volumetric else {
        panic!()
    };
    assert!((bulk_modulus - 1e6).abs() < 1e-6);
    assert_eq!(setup.constraints.iter().filter(|kinds| kinds[2] == Constraint::Fixed).count(), 12);
    let area: f64 = setup.tractions[0].areas.iter().map(|(_, area)| area).sum();
    assert!((area - 1.5).abs() < 1e-12);
    assert!(setup.initial.pressure.is_some());
}

#[test]
fn what_may_not_be_meant_is_warned_of() {
    let text = r#"
dimension = 1
gravity = [-9.81]
[[body]]
spacing = 0.3
shape.box = { lower = [0], upper = [1] }
material.linear_volumetric = { density = 1000, bulk_modulus = 1e6 }
[initial]
hydrostatic = { level = 0.5 }
[stabilisation]
[time]
end = 1
step = 2
[linear]
solver = "lu"
preconditioner = "jacobi"
[output]
interval = 3
"#;
    let (setup, warnings) = set_up::<1>(text);
    assert!(setup.stabilisation.is_none());
    let expected = [
        ("13:8", "longer than the whole computation"),
        ("16:18", "does not use a preconditioner"),
        ("18:12", "longer than the computation"),
        ("5:11", "does not divide the box along x"),
        ("10:1", "does nothing"),
        ("9:15", "above the level 0.5"),
    ];
    assert_eq!(warnings.len(), expected.len(), "{warnings:#?}");
    for (warning, (place, phrase)) in warnings.iter().zip(expected) {
        assert!(warning.starts_with(&format!("scene.toml:{place}: ")) && warning.contains(phrase), "{warnings:#?}");
    }
}

#[test]
fn the_scenes_of_the_documentation_are_good() {
    let reference = include_str!("../src/scene/reference.md");
    let text = reference.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let (setup, warnings) = set_up::<2>(text);
    assert_eq!((setup.bodies.len(), warnings.len()), (2, 0), "{warnings:?}");

    let head = include_str!("../src/scene/mod.rs");
    let text = head.split("//! ```toml\n").nth(1).unwrap().split("//! ```\n").next().unwrap();
    let (setup, warnings) = set_up::<2>(&text.replace("//! ", "").replace("//!", ""));
    assert_eq!((setup.particles.positions.len(), warnings.len()), (121, 0));
}

#[test]
fn marks_of_other_systems_are_accepted() {
    let text = EVERYTHING.replace('\n', "\r\n");
    assert_eq!(set_up::<2>(&text).0.bodies.len(), 2);
    let text = format!("\u{feff}{}", EVERYTHING.trim_start());
    assert_eq!(set_up::<2>(&text).0.bodies.len(), 2);
}
