//! Tables 5.1 and 6.2 of document 004: the explicit step limits `α_CFL d / c`, α_CFL = 0.3, of the
//! refined bar and of the refined impact block, to the printed digits.

#![allow(clippy::print_stdout, reason = "the measured table is a result, shown by --nocapture")]

mod support;

use support::scenes::{number, prepared, report};

/// Whether a printed number is the value rounded or truncated to the printed digits; `digit` is the
/// value of its last one.
fn is_printed(value: f64, printed: f64, digit: f64) -> bool {
    let places = (printed / digit).round();
    (value / digit).round() == places || (value / digit).floor() == places
}

#[test]
fn table_5_1_bar() {
    // L = 10 m, κ = 1e6 Pa, ρ = 1000 kg/m³.
    for (spacing, printed) in [(1.0, 1e-2), (0.2, 2e-3), (0.02, 2e-4), (0.01, 1e-4)] {
        let limit = prepared::<1>("bar-smooth", &[("body.0.spacing", &number(spacing))]).explicit_step_limit;
        println!("d = {spacing:5} m  limit {limit:.4e} s  printed {printed:.0e} s");
        let exact = 0.3 * spacing / 1000.0_f64.sqrt();
        assert!((limit / exact - 1.0).abs() < 1e-11, "{limit} against {exact}");
        assert!(is_printed(limit, printed, printed_digit(printed)), "d = {spacing}: {limit:e}, printed {printed:e}");
    }
}

/// One printed digit: the digit is the power of ten itself.
fn printed_digit(printed: f64) -> f64 {
    10.0_f64.powi(printed.log10().floor() as i32)
}

#[test]
fn table_6_2_impact_block() {
    // E = 1e5 Pa, ν = 0.3: κ = E/(2(1 − ν)), c = 8.4515 m/s. The limit at d = 0.25 is 8.874e-3 s, of
    // which the source prints 8.8e-3: it truncated there, while 1.7748e-2 → 1.8e-2 is rounded.
    let table = [(0.5, 1.8e-2, 1e-3), (0.25, 8.8e-3, 1e-4), (0.125, 4.4e-3, 1e-4), (0.0625, 2.2e-3, 1e-4)];
    for (spacing, printed, digit) in table {
        let limit = prepared::<2>("impact-elastic", &[("body.0.spacing", &number(spacing))]).explicit_step_limit;
        println!("d = {spacing:6} m  limit {limit:.4e} s  printed {printed:.1e} s");
        let exact = 0.3 * spacing / (1e5_f64 / 1.4 / 1000.0).sqrt();
        assert!((limit / exact - 1.0).abs() < 1e-11, "{limit} against {exact}");
        assert!(is_printed(limit, printed, digit), "d = {spacing}: {limit:e}, printed {printed:e}");
    }
}

#[test]
fn the_report_holds_the_same_limit() {
    let step = [("time.end", "0.01"), ("time.step", "0.01")];
    let limit = prepared::<2>("impact-elastic", &step).explicit_step_limit;
    assert_eq!(report("impact-elastic", &step).explicit_step_limit, Some(limit));
}
