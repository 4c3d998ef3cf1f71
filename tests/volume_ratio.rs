//! Volume ratios that follow the determinant against volume ratios that are evolved: the same in continuous time, so
//! that what they differ by is the time error; and the books of energy close with both.
#![allow(clippy::print_stdout, reason = "the measured table is a result, shown by --nocapture")]

mod support;
#[path = "support/trajectory.rs"]
#[allow(dead_code, reason = "every test file uses its own part of this module")]
mod trajectory;

use support::scenes::{distance, march, number, orders, prepared};
use trajectory::{every, example, follow};

const CHOICES: [&str; 2] = ["determinant", "evolved"];

fn list(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:.1e}")).collect::<Vec<_>>().join(", ")
}

/// Displacements and volume ratios at the end of a scene.
fn last<const D: usize>(name: &str, overrides: &[(&str, &str)]) -> (Vec<f64>, Vec<f64>) {
    let mut prepared = prepared::<D>(name, overrides);
    march(&mut prepared, |_, _| {});
    let (model, state) = (&prepared.model, &prepared.state.values);
    (model.displacements(state).to_vec(), model.volume_ratios(state).into_owned())
}

fn second_order(what: &str, name: &str, overrides: &[(&str, &str)], steps: &[f64]) {
    let differences: Vec<[f64; 2]> = steps
        .iter()
        .map(|step| {
            let step = number(*step);
            let [one, other] = CHOICES.map(|choice| {
                let own = [("time.step", step.as_str()), ("body.0.volume_ratio", choice)];
                last::<2>(name, &[overrides, &own].concat())
            });
            [distance(&one.0, &other.0), distance(&one.1, &other.1)]
        })
        .collect();
    for (field, title) in ["displacements", "volume ratios"].iter().enumerate() {
        let found: Vec<f64> = differences.iter().map(|d| d[field]).collect();
        let order = orders(steps, &found);
        println!("{what}, {title}: differences {}, orders {order:.2?}", list(&found));
        assert!(order.iter().all(|order| *order > 1.8), "{what}, {title}: {found:?}, {order:?}");
    }
}

#[test]
fn they_differ_by_the_time_error() {
    let (coarse, evolved) = (("body.0.spacing", "0.5"), ("body.0.cofactor", "evolved"));
    let steps = [0.01, 0.005, 0.0025];
    second_order("impact", "impact-hyperelastic", &[("time.end", "0.2"), coarse], &steps);
    second_order("impact, J F⁻ᵀ", "impact-hyperelastic", &[("time.end", "0.2"), coarse, evolved], &steps);
    second_order("impact, linear law", "impact-elastic", &[("time.end", "0.2"), coarse], &steps);
    // Here J does not start as det F.
    second_order("dam break", "dam-break", &[("time.end", "0.1"), coarse], &steps);
    second_order("dam break, J F⁻ᵀ", "dam-break", &[("time.end", "0.1"), coarse, evolved], &steps);
    let explicit = ("time.scheme", "tvd_rk2");
    let shorter = steps.map(|step| 0.5 * step);
    second_order("dam break, TVD-RK2", "dam-break", &[("time.end", "0.1"), coarse, explicit], &shorter);
}

#[test]
fn they_agree_to_rounding_where_the_cofactor_does_not_change() {
    // One direction of motion: cof F : L is the rate of the determinant over a whole step, whatever its length.
    let [one, other] = CHOICES.map(|choice| {
        let exactly =
            [("newton.relative_tolerance", "1e-13"), ("newton.final_corrections", "2"), ("linear.solver", "lu")];
        let overrides = [&[("body.0.volume_ratio", choice), ("time.end", "0.5")][..], &exactly].concat();
        last::<2>("piston-hyperelastic", &overrides)
    });
    let found = [distance(&one.0, &other.0), distance(&one.1, &other.1)];
    println!("piston: differences {}", list(&found));
    assert!(found.iter().all(|difference| *difference < 1e-12), "{found:?}");
}

#[test]
fn the_energy_ledger_closes_with_both() {
    let steps = ["0.02", "0.01"];
    for (name, overrides) in [
        ("impact-hyperelastic", &[("time.end", "0.4")][..]),
        ("piston-hyperelastic", &[("time.end", "0.4")]),
        ("dam-break", &[("time.end", "0.4")]),
    ] {
        let [determinant, evolved] = CHOICES.map(|choice| {
            steps.map(|step| {
                let own = [("time.step", step), ("body.0.volume_ratio", choice)];
                let run = follow::<2>(&example(name, &[overrides, &own].concat()), &every(0.1, 0.4));
                run.ledger_error() / run.entries[0].total
            })
        });
        println!("{name}: ledger with the determinant {}, evolved {}", list(&determinant), list(&evolved));
        // Of second order with both, and of the same size.
        assert!(determinant[1] < 0.35 * determinant[0] && determinant[0] < 2e-2, "{name}: {determinant:?}");
        assert!(determinant[1] < 3.0 * evolved[1], "{name}: {determinant:?} and {evolved:?}");
    }
}

#[test]
fn an_energy_momentum_step_keeps_energy_with_both() {
    for choice in CHOICES {
        for cofactor in ["geometric", "evolved"] {
            let overrides =
                [("time.scheme", "energy_momentum"), ("body.0.volume_ratio", choice), ("body.0.cofactor", cofactor)];
            let report = support::scenes::report("piston-hyperelastic", &overrides);
            let drift = report.energy.max_relative_drift.expect("free of dissipation");
            println!("{choice}, {cofactor}: drift {drift:.1e}");
            assert!(drift < 1e-11, "{choice}, {cofactor}: {drift:e}");
        }
    }
}

#[test]
fn what_nothing_reads_is_not_evolved() {
    let evolves = |name: &str, overrides: &[(&str, &str)]| prepared::<2>(name, overrides).model.evolves_volume(0);
    assert!(!evolves("csm3", &[]) && !evolves("csm3", &[("time", "{ scheme = \"tvd_rk2\", end = 1 }")]));
    assert!(!evolves("dam-break-c70", &[]));
    let auto = ("body.0.volume_ratio", "auto");
    assert!(!evolves("impact-hyperelastic", &[auto]));
    assert!(evolves("impact-hyperelastic", &[auto, ("stabilisation.tau_p", "0.5")]));
    assert!(evolves("impact-hyperelastic", &[auto, ("newton.unknowns", "full")]));
    assert!(evolves("impact-hyperelastic", &[auto, ("body.0.cofactor", "evolved")]));
    assert!(evolves("impact-hyperelastic", &[("body.0.volume_ratio", "evolved")]));
    assert!(evolves("piston-hyperelastic", &[auto, ("time.scheme", "energy_momentum")]));
}

#[test]
fn the_determinant_is_refused_where_the_volume_ratio_is_coupled_or_an_unknown() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/impact-hyperelastic.toml");
    for (key, value) in [("stabilisation.tau_p", "0.5"), ("newton.unknowns", "velocity_jacobian")] {
        let overrides = [(key, value), ("body.0.volume_ratio", "determinant")].map(|(k, v)| (k.into(), v.into()));
        let errors = nicolson::scene::Scene::read(&path, &overrides).expect_err(key).to_string();
        assert!(errors.contains("volume_ratio") && errors.contains("evolved"), "{errors}");
    }
}
