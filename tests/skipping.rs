//! What a scene does not need is not done: counters of every example scene, in a quick variant.
//!
//! No stabilisation: no pair table. Explicit: no pattern of the tangent, nothing assembled, nothing
//! factored. Linear equations at a constant step: one assembly, one analysis and one factorisation for
//! the whole run. Nonlinear: one analysis for the whole run, one factorisation per Newton iteration.

#![allow(clippy::print_stdout, reason = "the measured table is a result, shown by --nocapture")]

mod support;

use std::time::Duration;

use nicolson::simulation::Prepared;
use support::scenes::{march, number, prepared, report, scene};

const UNSTABILISED: [(&str, &str); 2] = [("stabilisation.tau_v", "0"), ("stabilisation.tau_p", "0")];

#[test]
fn no_stabilisation_no_pair_table() {
    assert!(prepared::<1>("bar-smooth", &[]).model.upwind().is_none());
    assert!(prepared::<2>("piston-elastic", &[]).model.upwind().is_none());
    assert!(prepared::<2>("piston-hyperelastic", &[]).model.upwind().is_none());
    assert!(prepared::<3>("block-piston", &[]).model.upwind().is_none());
    // Zero coefficients count as none.
    assert!(prepared::<1>("bar-shock", &UNSTABILISED).model.upwind().is_none());
    assert!(prepared::<2>("dam-break", &UNSTABILISED[..1]).model.upwind().is_none());
}

#[test]
fn a_term_without_coefficient_has_no_table() {
    let only_v = prepared::<2>("impact-elastic", &[]);
    let upwind = only_v.model.upwind().expect("D_v");
    assert!(upwind.has_velocity() && !upwind.has_pressure() && upwind.reconstruction.is_empty());
    let only_p = prepared::<2>("impact-elastic", &[("stabilisation.tau_v", "0"), ("stabilisation.tau_p", "0.5")]);
    let upwind = only_p.model.upwind().expect("D_p");
    assert!(!upwind.has_velocity() && upwind.has_pressure());
    // D_p couples the volume ratios, D_v alone does not: 13 × 21 particles, 13 held in y.
    assert_eq!(only_v.unknowns(), 2 * 273 - 13);
    assert_eq!(only_p.unknowns(), 3 * 273 - 13);
}

fn explicit_run_has_no_tangent<const D: usize>(name: &str, overrides: &[(&str, &str)]) {
    let mut prepared = prepared::<D>(name, overrides);
    march(&mut prepared, |_, _| {});
    assert!(prepared.stepper.newton().is_none());
    assert!(!prepared.model.has_pattern(), "{name}");
    assert_eq!(prepared.model.times().assembly, Duration::ZERO);
    let forecast = prepared.forecast(&scene(name, overrides));
    assert_eq!((forecast.unknowns, forecast.entries), (0, 0));
    assert!(!prepared.model.has_pattern(), "{name}: the forecast must not build it either");
}

#[test]
fn an_explicit_run_has_no_pattern_and_factors_nothing() {
    for scheme in ["tvd_rk2", "rk4", "velocity_verlet"] {
        let common = [("time.scheme", scheme), ("time.step", "0.002")];
        let with = |end| [&common[..], &[("time.end", end)]].concat();
        explicit_run_has_no_tangent::<1>("bar-smooth", &with("0.1"));
        explicit_run_has_no_tangent::<2>("impact-hyperelastic", &with("0.02"));
        explicit_run_has_no_tangent::<3>("block-piston", &with("0.02"));
    }
}

/// Assembles in the first step and never again, to the nanosecond.
fn assembles_once<const D: usize>(mut prepared: Prepared<D>, what: &str) {
    assert!(prepared.model.is_linear(), "{what}");
    let mut first = None;
    march(&mut prepared, |prepared, step| {
        let spent = prepared.model.times().assembly;
        assert!(spent > Duration::ZERO, "{what}");
        assert_eq!(*first.get_or_insert(spent), spent, "{what}, t = {}: assembled again", step.time);
        let newton = prepared.stepper.newton().expect("implicit");
        let counts = newton.linear().counts();
        assert_eq!((counts.analyses, counts.factorisations), (1, 1), "{what}, t = {}", step.time);
        assert_eq!(newton.totals().factorisations.total(), 1, "{what}");
        assert_eq!(step.newton_iterations, 1, "{what}, t = {}", step.time);
    });
    assert!(prepared.stepper.statistics().accepted >= 10, "{what}");
}

#[test]
fn a_linear_scene_assembles_and_factors_once() {
    assembles_once(prepared::<1>("bar-smooth", &[]), "bar-smooth");
    assembles_once(prepared::<1>("bar-shock", &[]), "bar-shock");
    assembles_once(prepared::<2>("piston-elastic", &[]), "piston-elastic");
    assembles_once(prepared::<3>("block-piston", &[("time.end", "0.034641016151377548")]), "block-piston");
    assembles_once(prepared::<2>("piston-elastic", &[("time.scheme", "midpoint")]), "piston-elastic, mid-point");
    assembles_once(prepared::<2>("piston-elastic", &[("time.scheme", "backward_euler")]), "piston-elastic, Euler");
}

#[test]
fn a_nonlinear_scene_is_not_taken_for_linear() {
    assert!(!prepared::<2>("impact-elastic", &[]).model.is_linear(), "cof F turns");
    assert!(!prepared::<2>("piston-hyperelastic", &[]).model.is_linear());
    assert!(!prepared::<2>("piston-elastic", &[("body.0.cofactor", "evolved")]).model.is_linear());
    assert!(!prepared::<1>("bar-shock", &[("stabilisation.wave_speed", "deformed")]).model.is_linear());
}

/// Steps, Newton iterations, analyses, factorisations, linear solves, evaluations of the rate.
type Counts = [usize; 6];

#[test]
fn counters_of_the_examples() {
    let rk2 = ("time.scheme", "tvd_rk2");
    let small = ("time.step", "0.005");
    fn end(end: &str) -> (&str, &str) {
        ("time.end", end)
    }
    let block_end = number(10.0 * 0.003_464_101_615_137_754_8);
    type Row<'a> = (&'a str, &'a [(&'a str, &'a str)], usize, Counts);
    let table: [Row<'_>; 12] = [
        ("bar-smooth", &[], 40, [1265, 1265, 1, 1, 1265, 1]),
        ("bar-shock", &[], 79, [200, 200, 1, 1, 200, 1]),
        ("piston-elastic", &[], 110, [100, 100, 1, 1, 100, 1]),
        ("block-piston", &[end(&block_end)], 250, [10, 10, 1, 1, 10, 1]),
        ("piston-hyperelastic", &[end("0.5")], 110, [5, 15, 1, 15, 15, 1]),
        ("impact-elastic", &[end("0.2")], 533, [4, 12, 1, 12, 12, 1]),
        ("impact-hyperelastic", &[end("0.2")], 533, [4, 15, 1, 15, 15, 1]),
        ("dam-break", &[end("0.1")], 220, [10, 22, 1, 22, 22, 1]),
        ("impact-elastic", &[end("0.2"), rk2, small], 0, [40, 0, 0, 0, 0, 80]),
        ("impact-hyperelastic", &[end("0.2"), rk2, small], 0, [40, 0, 0, 0, 0, 80]),
        ("dam-break", &[end("0.1"), rk2, small], 0, [20, 0, 0, 0, 0, 40]),
        ("bar-smooth", &[end("1"), rk2, small], 0, [200, 0, 0, 0, 0, 400]),
    ];
    let mut wrong = Vec::new();
    for (name, overrides, unknowns, expected) in table {
        let report = report(name, overrides);
        let found = [
            report.steps.accepted,
            report.newton.iterations,
            report.linear.analyses,
            report.linear.factorisations,
            report.linear.solves,
            report.rate_evaluations,
        ];
        println!("{name} {overrides:?}: {} unknowns, {found:?}", report.unknowns);
        if (report.unknowns, found) != (unknowns, expected) {
            wrong.push(format!(
                "{name} {overrides:?}: {} unknowns, {found:?} instead of {unknowns}, {expected:?}",
                report.unknowns
            ));
        }
        assert_eq!((report.steps.rejected, report.newton.failures), (0, 0), "{name} {overrides:?}");
        // One evaluation at the start of a solve, one after every iteration: no line search was needed.
        assert_eq!(report.newton.residual_evaluations, report.newton.solves + report.newton.iterations, "{name}");
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
