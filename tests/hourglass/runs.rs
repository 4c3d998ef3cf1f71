//! Runs: what is conserved, what stays linear, what is off, and the warning.

use super::digits;
use super::support::scenes::{distance, number, orders, outcome, prepared, report};

#[test]
fn a_spinning_body_keeps_its_momenta() {
    let base = [
        ("boundary", "[]"),
        ("body.0.spacing", "0.5"),
        ("body.0.hourglass", "2"),
        ("initial.velocity", r#"["-2*(Y-2.5) + 0.5*(X-1.5)^2 + 0.3", "2*(X-1.5) - 0.2*(Y-2.5)"]"#),
        ("time.end", "0.5"),
        ("time.scheme", "midpoint"),
        ("newton.relative_tolerance", "1e-13"),
    ];
    let report = report("impact-hyperelastic", &[&base[..], &[("stabilisation.tau_v", "0")]].concat());
    let (linear, angular) = (report.linear_momentum_drift.unwrap(), report.angular_momentum_drift.unwrap());
    println!("spinning block, mid-point: linear momentum drifts by {linear:.1e}, angular by {angular:.1e}");
    assert!(linear < 1e-13 && angular < 1e-13, "{linear:e} {angular:e}");
    assert!(report.energy.hourglass_max_fraction.unwrap() > 0.01, "the control must be at work");
}

#[test]
fn the_energy_momentum_scheme_conserves_the_total() {
    let base = [
        ("boundary", "[]"),
        ("body.0.hourglass", "2"),
        ("initial.velocity", r#"["-2*(Y-2.5) + 0.5*(X-1.5)^2", "2*(X-1.5)"]"#),
        ("time.scheme", "energy_momentum"),
        ("time.end", "1"),
    ];
    let plain = [("stabilisation.tau_v", "0")];
    for (name, more) in [
        ("impact-hyperelastic", [("body.0.spacing", "0.5"), ("time.step", "0.05")]),
        ("impact-elastic", [("body.0.spacing", "0.5"), ("time.step", "0.1")]),
    ] {
        let report = report(name, &[&base[..], &more, &plain].concat());
        let (drift, fraction) = (report.energy.max_relative_drift.unwrap(), report.energy.hourglass_max_fraction);
        println!("{name}, energy–momentum: |ΔE|/E {drift:.1e}, hourglass fraction {fraction:.2?}");
        assert!(drift < 1e-10, "{name}: {drift:e}");
        assert!(fraction.unwrap() > 0.01, "{name}: the control must be at work");
    }
    let velocity = r#"["0.3*Y*Z", "-0.2*X^2", "-0.5*sin(pi*Z/5)*(1+X*Y)"]"#;
    let block = [("hourglass", "2"), ("time.scheme", "energy_momentum"), ("initial.velocity", velocity)];
    let more = [("boundary", "[]"), ("time.end", "0.1"), ("time.step", "0.01"), ("body.0.spacing", "0.5")];
    let report = report("block-piston", &[&block[..], &more].concat());
    let drift = report.energy.max_relative_drift.unwrap();
    println!("3D block, energy–momentum: |ΔE|/E {drift:.1e}, {:.2?}", report.energy.hourglass_max_fraction);
    assert!(drift < 1e-10, "{drift:e}");
    assert!(report.energy.hourglass_max_fraction.unwrap() > 0.01, "the control must be at work");
}

#[test]
fn a_linear_scene_stays_linear_and_its_tangent_symmetric() {
    let control = [("hourglass", "2"), ("body.0.smoothing", "1.2")];
    let report = report("bar-smooth", &control);
    assert_eq!(report.newton.iterations, report.steps.accepted);
    assert_eq!((report.linear.analyses, report.linear.factorisations), (1, 1));
    assert!(report.energy.max_relative_drift.unwrap() < 1e-11, "{:?}", report.energy);
    let model = prepared::<1>("bar-smooth", &control).model;
    assert!(model.is_linear());
    assert_eq!(
        nicolson_solvers::linear::Tangent::symmetry(&model),
        nicolson_solvers::linear::Symmetry::PositiveDefinite
    );
}

#[test]
fn explicit_and_implicit_agree() {
    let base = [("hourglass", "2"), ("time.end", "0.25"), ("body.0.spacing", "0.5")];
    let run = |scheme: &str, step: &str| {
        outcome("impact-hyperelastic", &[&base[..], &[("time.scheme", scheme), ("time.step", step)]].concat()).state
    };
    let n = run("rk4", "0.0025");
    let particles = n.len() / 5;
    let gap = |step: &str| distance(&n[..2 * particles], &run("crank_nicolson", step)[..2 * particles]);
    let gaps = [gap("0.0125"), gap("0.00625")];
    println!("Crank–Nicolson against RK4, displacements: {}", digits(&gaps));
    assert!(gaps[1] < 1e-3, "{gaps:?}");
    assert!((orders(&[2.0, 1.0], &gaps)[0] - 2.0).abs() < 0.2, "{gaps:?}");
}

#[test]
fn what_is_off_costs_nothing() {
    assert!(prepared::<2>("impact-elastic", &[]).model.hourglass().is_none());
    assert!(prepared::<1>("bar-smooth", &[("hourglass", "0")]).model.hourglass().is_none());
    let on = prepared::<1>("bar-smooth", &[("hourglass", "1")]);
    let pairs = on.model.gradient().neighbourhood.pairs();
    assert_eq!(on.model.hourglass().map(|control| control.entries()), Some(pairs));
    let report = report("bar-smooth", &[("time.end", "0.1")]);
    assert_eq!(report.energy.hourglass_max_fraction, None);
}

#[test]
fn much_energy_in_the_control_is_said_once() {
    let saw = [("hourglass", "1"), ("body.0.smoothing", "1.2"), ("time.end", "0.2")];
    let smooth = report("bar-smooth", &saw);
    let warnings = |report: &nicolson::output::Report| -> Vec<String> {
        report.warnings.iter().filter(|warning| warning.contains("hourglass control")).cloned().collect()
    };
    assert_eq!(warnings(&smooth), Vec::<String>::new());
    assert!(smooth.energy.hourglass_max_fraction.unwrap() < 1e-3, "{:?}", smooth.energy);
    let step = number(0.002);
    let rough =
        report("bar-smooth", &[&saw[..], &[("initial.velocity", "[\"cos(4*pi*X)\"]"), ("time.step", &step)]].concat());
    let fraction = rough.energy.hourglass_max_fraction.unwrap();
    println!(
        "smooth {:.1e}, sawtooth {fraction:.2}: {:?}",
        smooth.energy.hourglass_max_fraction.unwrap(),
        warnings(&rough)
    );
    assert!(fraction > 0.05);
    // Half the bar starts at speed: at first the control holds a third of the little that is deformed. The control
    // takes 0.8 % of the energy at most, and that is no reason for a warning.
    let shock = [("hourglass", "2"), ("stabilisation.tau_v", "0"), ("stabilisation.tau_p", "0")];
    for end in ["0.5", "1.0"] {
        let shock = report("bar-shock", &[&shock[..], &[("time.end", end)]].concat());
        assert!((0.004..0.01).contains(&shock.energy.hourglass_max_fraction.unwrap()), "{:?}", shock.energy);
        assert_eq!(warnings(&shock), Vec::<String>::new());
    }
    let warnings = warnings(&rough);
    assert_eq!(warnings.len(), 1);
    for word in ["until t = ", " %", "lower `hourglass`"] {
        assert!(warnings[0].contains(word), "{warnings:?}");
    }
}
