//! What must hold for every scene, tried on random ones: momenta, energies, tangents, objectivity, conservation in time,
//! agreement of schemes. What fails is made as plain as it still fails, and its scene is printed.
//!
//! `NICOLSON_PROPERTY_CASES=10` tries ten times as many cases, `NICOLSON_PROPERTY_SEED=7` others.
#![allow(missing_docs, clippy::print_stdout, reason = "the worst figures are results, shown by --nocapture")]

#[path = "properties/case.rs"]
mod case;
#[path = "properties/motion.rs"]
mod motion;
#[path = "properties/statics.rs"]
mod statics;
#[path = "properties/text.rs"]
mod text;

use std::panic::{AssertUnwindSafe, catch_unwind};

use case::Case;

/// What a check found: a figure of which the worst is shown, no verdict (the scene is impossible), or a failure.
pub enum Verdict {
    /// It holds, with this figure.
    Holds(f64),
    /// There is no such scene, and why.
    Impossible(String),
    /// It does not hold, and why.
    Fails(String),
}

/// A number of the environment.
fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Tries a property on random cases.
fn holds_for_all(name: &str, cases: u64, make: fn(u64) -> Case, check: fn(&Case) -> Verdict) {
    let (first, cases) = (setting("NICOLSON_PROPERTY_SEED", 1) << 32, cases * setting("NICOLSON_PROPERTY_CASES", 1));
    let tried = |case: &Case| {
        let outcome = catch_unwind(AssertUnwindSafe(|| check(case)));
        outcome.unwrap_or_else(|_| Verdict::Fails("it panicked".into()))
    };
    let (mut worst, mut impossible, mut reason) = (0.0_f64, 0, String::new());
    for seed in first..first + cases {
        let case = make(seed);
        match tried(&case) {
            Verdict::Holds(figure) => worst = worst.max(figure),
            Verdict::Impossible(why) => {
                impossible += 1;
                reason = why;
            }
            Verdict::Fails(why) => {
                let (plain, why) = shrunk(case, why, &tried);
                panic!("{name}, seed {seed}: {why}\nfor the scene\n\n{}", plain.text());
            }
        }
    }
    println!("{name}: {cases} cases, {impossible} of them impossible, worst figure {worst:.1e}");
    assert!(impossible * 5 <= cases, "{name}: {impossible} of {cases} scenes cannot be built, such as: {reason}");
}

/// The plainest case that still fails.
fn shrunk(mut case: Case, mut why: String, tried: &dyn Fn(&Case) -> Verdict) -> (Case, String) {
    'next: loop {
        for other in case.simpler() {
            if let Verdict::Fails(reason) = tried(&other) {
                (case, why) = (other, reason);
                continue 'next;
            }
        }
        return (case, why);
    }
}

#[test]
fn internal_forces_have_no_resultant_and_no_moment() {
    holds_for_all("momenta", 300, Case::dissipative, statics::momenta);
}

#[test]
fn forces_are_gradients_of_the_energy() {
    holds_for_all("energy", 300, Case::random, statics::energy);
}

#[test]
fn turning_and_shifting_a_state_turns_its_forces() {
    holds_for_all("objectivity", 300, Case::dissipative, statics::objectivity);
}

#[test]
fn tangents_are_derivatives_and_as_symmetric_as_declared() {
    holds_for_all("tangent", 120, Case::dissipative, statics::tangent);
}

#[test]
fn energy_momentum_steps_conserve() {
    holds_for_all("energy–momentum", 60, motion::conserving_case, motion::conserves);
}

#[test]
fn explicit_and_implicit_schemes_agree_as_steps_shrink() {
    holds_for_all("agreement", 40, motion::agreeing_case, motion::agree);
}
