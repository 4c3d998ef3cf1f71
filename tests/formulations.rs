//! Different ways to the same step.
//!
//! 1. The condensed velocity system, the {v, J} system and the full {v, J, u} system of (4.6) give the
//!    same steps to 1e-10: with D_v all three, with D_p the latter two (there the first must be refused).
//! 2. So do the linear solvers: sparse LU, GMRES and BiCGStab with ILU(0), and, where the tangent is
//!    symmetric, LDLᵀ, Cholesky and conjugate gradients.
//!    The model announces symmetry where it holds, and nowhere else.
//! 3. The two cofactors, cof F and J F⁻ᵀ with the evolved J, differ by O(Δt²) only, once J starts as
//!    det F.

#![allow(clippy::print_stdout, reason = "the measured table is a result, shown by --nocapture")]

mod support;

use nicolson::model::Noise;
use nicolson::simulation::Prepared;
use nicolson_solvers::linear::Symmetry;
use nicolson_solvers::nonlinear::NonlinearProblem;
use support::scenes::{distance, march, number, orders, outcome, prepared};

/// Tight enough for the comparison: the last iteration of Newton's method squares what is left.
const TIGHT: [(&str, &str); 2] = [("newton.relative_tolerance", "1e-13"), ("newton.scale_tolerance", "1e-15")];

/// Largest relative differences of displacements, velocities and volume ratios of two states.
fn differences<const D: usize>(prepared: &Prepared<D>, a: &[f64], b: &[f64]) -> [f64; 3] {
    let model = &prepared.model;
    [
        distance(model.displacements(a), model.displacements(b)),
        distance(model.velocities_of(a), model.velocities_of(b)),
        distance(&model.volume_ratios(a), &model.volume_ratios(b)),
    ]
}

/// Final state of a few steps, and the number of unknowns.
fn few_steps<const D: usize>(name: &str, overrides: &[(&str, &str)]) -> (Prepared<D>, Vec<f64>) {
    let mut prepared = prepared::<D>(name, &[&TIGHT[..], overrides].concat());
    march(&mut prepared, |_, step| assert_eq!(step.rejected, 0, "{name} {overrides:?}"));
    let state = prepared.state.values.clone();
    (prepared, state)
}

/// Runs a scene with every system that it allows and compares the last with the others.
fn compare_systems<const D: usize>(what: &str, name: &str, overrides: &[(&str, &str)], systems: &[&str]) {
    // J of the condensed system is that of the others only if it has the same equation.
    let evolved = ("body.0.volume_ratio", "evolved");
    let solve = |unknowns: &str| few_steps::<D>(name, &[overrides, &[("newton.unknowns", unknowns), evolved]].concat());
    let (full, reference) = solve("full");
    for unknowns in systems {
        let (prepared, state) = solve(unknowns);
        assert!(prepared.unknowns() < full.unknowns());
        let found = differences(&full, &reference, &state);
        println!(
            "{what}: {} steps, {unknowns} ({}) against full ({}): u {:.1e}, v {:.1e}, J {:.1e}",
            prepared.stepper.statistics().accepted,
            prepared.unknowns(),
            full.unknowns(),
            found[0],
            found[1],
            found[2]
        );
        assert!(found.iter().all(|d| *d < 1e-10), "{what}, {unknowns}: {found:?}");
    }
}

const ALL: [&str; 2] = ["velocity", "velocity_jacobian"];

#[test]
fn systems_agree_without_d_p() {
    let quarter = ("time.end", "0.25");
    compare_systems::<2>("piston", "piston-hyperelastic", &[("time.end", "0.5")], &ALL);
    compare_systems::<2>("impact", "impact-hyperelastic", &[quarter], &ALL);
    compare_systems::<2>(
        "impact, evolved cofactor",
        "impact-hyperelastic",
        &[quarter, ("body.0.cofactor", "evolved")],
        &ALL,
    );
    compare_systems::<2>("impact, linear law", "impact-elastic", &[quarter], &ALL);
    compare_systems::<2>("impact, TR-BDF2", "impact-elastic", &[quarter, ("time.scheme", "tr_bdf2")], &ALL);
    compare_systems::<2>("dam break", "dam-break", &[("time.end", "0.05")], &ALL);
    let reconstructed = ("stabilisation.interface", "reconstructed");
    let coarse = ("body.0.spacing", "0.5");
    compare_systems::<2>("impact, reconstructed", "impact-hyperelastic", &[quarter, reconstructed, coarse], &ALL);
    let limited = ("stabilisation.interface", "limited");
    compare_systems::<2>("impact, limited", "impact-hyperelastic", &[quarter, limited, coarse], &ALL);
    let fluid = r#"{ density = 1000.0, gamma = 7.0, wave_speed = 10.0 }"#;
    let laws = [("body.0.material", &*format!("{{ hyperelastic_volumetric = {fluid} }}")), coarse];
    let block = [&laws[..], &[("time.end", "0.05"), ("time.step", "0.01"), ("boundary.0.fix", r#"["x"]"#)]].concat();
    compare_systems::<3>("block", "block-piston", &[&block[..], &[("stabilisation.tau_v", "0.5")]].concat(), &ALL);
}

#[test]
fn systems_agree_with_d_p() {
    let two = ["velocity_jacobian"];
    let tau_p = ("stabilisation.tau_p", "0.5");
    let quarter = ("time.end", "0.25");
    compare_systems::<1>("shock, D_v and D_p", "bar-shock", &[("time.end", "0.1")], &two);
    compare_systems::<2>("impact, D_v and D_p", "impact-hyperelastic", &[quarter, tau_p], &two);
    compare_systems::<2>("dam break, D_v and D_p", "dam-break", &[("time.end", "0.05"), tau_p], &two);
    let limited = ("stabilisation.interface", "limited");
    compare_systems::<2>("dam break, limited", "dam-break", &[("time.end", "0.05"), tau_p, limited], &two);
    let stress = ("stabilisation.pressure_jump", "stress");
    let corrected = ("stabilisation.gradient", "corrected");
    compare_systems::<2>("impact, as printed", "impact-hyperelastic", &[quarter, tau_p, stress, corrected], &two);
}

#[test]
fn the_velocity_system_is_refused_with_d_p() {
    let overrides = [("newton.unknowns".to_owned(), "velocity".to_owned())];
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/bar-shock.toml");
    let errors = nicolson::scene::Scene::read(&path, &overrides).expect_err("D_p couples the volume ratios");
    assert!(errors.to_string().contains("tau_p"), "{errors}");
}

#[test]
fn linear_solvers_agree() {
    let krylov = [("linear.preconditioner", "ilu0"), ("linear.tolerance", "1e-13")];
    let (coarse, tau_p) = (("body.0.spacing", "0.5"), ("stabilisation.tau_p", "0.5"));
    type Row<'a> = (&'a str, &'a str, &'a [(&'a str, &'a str)], &'a [&'a str]);
    let scenes: [Row<'_>; 4] = [
        ("impact, D_v", "impact-hyperelastic", &[("time.end", "0.25")], &["gmres", "bicgstab"]),
        ("impact, D_v and D_p", "impact-hyperelastic", &[("time.end", "0.25"), coarse, tau_p], &["gmres", "bicgstab"]),
        ("dam break", "dam-break", &[("time.end", "0.05")], &["gmres", "bicgstab"]),
        // Without stabilisation and with one direction of motion the tangent is M + s² K.
        (
            "piston, elastic",
            "piston-elastic",
            &[("time.end", "0.037416573867739413")],
            &["gmres", "bicgstab", "ldlt", "cholesky", "cg"],
        ),
    ];
    for (what, name, overrides, solvers) in scenes {
        let (direct, reference) = few_steps::<2>(name, &[overrides, &[("linear.solver", "lu")]].concat());
        for solver in solvers {
            let choice = [("linear.solver", *solver)];
            let iterative = !matches!(*solver, "ldlt" | "cholesky");
            // ILU(0) of a symmetric matrix is not symmetric to the last bit: conjugate gradients get Jacobi.
            let krylov = match *solver {
                "cg" => [("linear.preconditioner", "jacobi"), krylov[1]],
                _ => krylov,
            };
            let options: &[(&str, &str)] = if iterative { &krylov } else { &[] };
            let (prepared, state) = few_steps::<2>(name, &[overrides, &choice, options].concat());
            let found = differences(&direct, &reference, &state);
            let counts = prepared.stepper.newton().expect("implicit").linear().counts();
            println!(
                "{what}: {solver} against lu: u {:.1e}, v {:.1e}, J {:.1e} ({} solves, {} iterations)",
                found[0], found[1], found[2], counts.solves, counts.iterations
            );
            assert!(found.iter().all(|d| *d < 1e-10), "{what}, {solver}: {found:?}");
            assert_eq!(iterative, counts.iterations > 0, "{what}, {solver}");
        }
    }
}

#[test]
fn the_two_cofactors_agree_in_the_limit_of_small_steps() {
    let steps = [0.02, 0.01, 0.005, 0.0025];
    let differences: Vec<f64> = steps
        .iter()
        .map(|step| {
            let step = number(*step);
            let state = |cofactor: &str| {
                let overrides = [
                    ("time.end", "0.2"),
                    ("time.step", step.as_str()),
                    ("body.0.spacing", "0.5"),
                    ("body.0.cofactor", cofactor),
                    ("body.0.volume_ratio", "evolved"),
                ];
                outcome("impact-hyperelastic", &[&TIGHT[..], &overrides].concat()).state
            };
            distance(&state("geometric"), &state("evolved"))
        })
        .collect();
    let found = orders(&steps, &differences);
    for (step, difference) in steps.iter().zip(&differences) {
        println!("Δt = {step:6}: geometric against evolved {difference:.3e}");
    }
    println!("orders {found:.3?}");
    assert!(found.iter().all(|order| (order - 2.0).abs() < 0.1), "{found:?}");
}

/// Announced symmetry of a scene's tangent, and `|vᵀAw − wᵀAv|` over its size for random vectors.
fn asymmetry<const D: usize>(name: &str, overrides: &[(&str, &str)]) -> (Symmetry, f64) {
    let mut prepared = prepared::<D>(name, overrides);
    let model = &mut prepared.model;
    let at = model.check_point(0.0, 0.005, &prepared.state.values, 0.02, 1).expect("check point");
    model.linearise(&at.unknowns).expect("linearise");
    let (mut noise, n) = (Noise::new(4), at.unknowns.len());
    let vectors: [Vec<f64>; 2] = std::array::from_fn(|_| (0..n).map(|_| noise.next()).collect());
    let tangent = model.tangent();
    let form = |v: &[f64], w: &[f64]| {
        let mut product = vec![0.0; n];
        tangent.apply(w, &mut product);
        let size: f64 = v.iter().zip(&product).map(|(v, p)| (v * p).abs()).sum();
        (v.iter().zip(&product).map(|(v, p)| v * p).sum::<f64>(), size)
    };
    let ((one, size), (other, _)) = (form(&vectors[0], &vectors[1]), form(&vectors[1], &vectors[0]));
    (tangent.symmetry(), (one - other).abs() / size)
}

#[test]
fn only_symmetric_tangents_are_announced_as_symmetric() {
    let symmetric = [
        ("bar, smooth", asymmetry::<1>("bar-smooth", &[])),
        ("bar with D_v", asymmetry::<1>("bar-shock", &[("stabilisation.tau_p", "0")])),
        ("piston, elastic", asymmetry::<2>("piston-elastic", &[])),
        ("block", asymmetry::<3>("block-piston", &[])),
    ];
    for (what, (announced, found)) in symmetric {
        println!("{what}: {announced:?}, asymmetry {found:.1e}");
        assert_eq!(announced, Symmetry::PositiveDefinite, "{what}");
        assert!(found < 1e-14, "{what}: {found:e}");
    }
    let reconstructed = [("stabilisation.tau_p", "0"), ("stabilisation.interface", "reconstructed")];
    let limited = [("stabilisation.tau_p", "0"), ("stabilisation.interface", "limited")];
    let general = [
        ("bar with reconstructed D_v", asymmetry::<1>("bar-shock", &reconstructed)),
        ("bar with limited D_v", asymmetry::<1>("bar-shock", &limited)),
        ("bar, full system", asymmetry::<1>("bar-smooth", &[("newton.unknowns", "full")])),
        ("piston, hyperelastic", asymmetry::<2>("piston-hyperelastic", &[])),
        ("impact, elastic", asymmetry::<2>("impact-elastic", &[])),
    ];
    for (what, (announced, found)) in general {
        println!("{what}: {announced:?}, asymmetry {found:.1e}");
        assert_eq!(announced, Symmetry::General, "{what}");
    }
}
