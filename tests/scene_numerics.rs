//! Scheme, step control and tolerances as a scene chooses them, and what a run makes of them.

mod support;

use nicolson::scene::Scene;
use nicolson::scene::settings::{Effort, RkcStages, Scheme};
use nicolson::simulation::{Prepared, prepare};
use nicolson_solvers::time::StepControl;
use support::written::{self, SCHEMES};

/// A bar of five particles with the end of its `[time]` table still open.
fn scene(more: &str) -> Scene {
    let text = "dimension = 1\n[[body]]\nspacing = 0.25\nshape.box = { lower = [0], upper = [1] }\n\
                material.linear_volumetric = { density = 1000, bulk_modulus = 1e6 }\n[initial]\nvelocity = [\"X\"]\n\
                [time]\nend = 1\n";
    let step = if more.lines().any(|line| line.starts_with("step")) { "" } else { "step = 0.002\n" };
    written::scene(&format!("{text}{step}{more}"))
}

fn prepared(more: &str) -> Prepared<1> {
    prepare::<1>(&scene(more)).unwrap()
}

#[test]
fn the_scheme_decides_on_the_defaults_of_newton() {
    let tolerances = |more: &str| {
        let newton = scene(more).newton;
        (newton.relative_tolerance, newton.scale_tolerance, newton.final_corrections)
    };
    assert_eq!(tolerances(""), (1e-8, 1e-12, 0));
    assert_eq!(tolerances("scheme = \"energy_momentum\""), (1e-12, 1e-15, 2));
    let own = "scheme = \"energy_momentum\"\n[newton]\nrelative_tolerance = 1e-6\nscale_tolerance = 1e-9\nfinal_corrections = 0";
    assert_eq!(tolerances(own), (1e-6, 1e-9, 0));
}

#[test]
fn the_step_may_be_controlled() {
    let read = |more: &str| scene(more).time;
    let time = read("effort = { few = 3, many = 8, growth = 2.0, cut = 0.25 }\nmaximum_step = 0.4");
    assert_eq!(time.effort, Some(Effort { few: 3, many: 8, growth: 2.0, cut: 0.25 }));
    assert_eq!((time.maximum_step, time.adaptive), (Some(0.4), None));
    assert_eq!(read("effort = {}").effort, Some(Effort::default()));
    for scheme in ["forward_euler", "tvd_rk2", "velocity_verlet", "midpoint", "theta", "energy_momentum", "sdirk3"] {
        let time = read(&format!("scheme = \"{scheme}\"\nadaptive = {{ tolerance = 1e-3 }}"));
        assert!(time.adaptive.is_some(), "{scheme}");
    }
    assert_eq!(read("scheme = \"rkc\"").scheme, Scheme::Rkc { stages: RkcStages::SpectralRadius });
    let time = read("scheme = \"rkc\"\nrkc_stages = \"courant\"");
    assert_eq!(time.scheme, Scheme::Rkc { stages: RkcStages::Courant });
}

#[test]
fn every_scheme_can_follow_its_error() {
    for scheme in SCHEMES {
        let more = format!("scheme = \"{scheme}\"\nadaptive = {{ tolerance = 1e-3 }}\nmaximum_step = 0.01\n");
        let mut run = prepared(&more);
        let mut lengths = Vec::new();
        while run.state.time < 0.05 {
            let report = run.stepper.advance(&mut run.model, &mut run.state, 0.05).unwrap();
            assert!(report.error_estimate.is_some_and(|error| error <= 1.0), "{scheme}");
            lengths.push(report.step);
        }
        assert!(lengths.iter().any(|length| (length - 0.002).abs() > 1e-4), "{scheme}: {lengths:?}");
        assert!(lengths.iter().all(|length| *length <= 0.01), "{scheme}: {lengths:?}");
    }
}

#[test]
fn the_step_grows_with_ease_up_to_its_bound() {
    let mut run = prepared("effort = { few = 4, many = 10, growth = 2.0 }\nmaximum_step = 0.012\n");
    assert!(matches!(run.stepper.control(), StepControl::Effort(effort) if effort.growth == 2.0));
    let mut lengths = Vec::new();
    for _ in 0..12 {
        lengths.push(run.stepper.advance(&mut run.model, &mut run.state, 1.0).unwrap().step);
    }
    assert_eq!(lengths[..3], [0.002; 3]);
    assert_eq!(lengths[3..6], [0.004; 3]);
    assert_eq!(lengths[11], 0.012);
}

/// Undamped motion grows with rkc, and the warning says how much; upwinding damps the fastest modes enough.
#[test]
fn rkc_warns_of_undamped_motion() {
    let warning = |more: &str| prepared(more).warnings.into_iter().find(|warning| warning.starts_with("rkc"));
    let text = warning("scheme = \"rkc\"\nstep = 0.005\n").expect("a warning");
    // c = √1000 m/s on a spacing of 0.25 m: ω of the order of c/Δp = 126 1/s, y = ωΔt about 1.
    let after = |mark: &str| -> f64 {
        let rest = &text[text.find(mark).expect(mark) + mark.len()..];
        rest.split([' ', ',']).find_map(|word| word.parse().ok()).expect(mark)
    };
    let (omega, growth) = (after("ω = "), after("by a factor of "));
    assert!((60.0..300.0).contains(&omega), "{text}");
    let stages = after("s and ") as usize;
    let expected = nicolson_solvers::time::rkc_growth(stages, 0.005 * omega);
    assert!(growth > 1.0 && (growth / expected - 1.0).abs() < 1e-3, "{growth} and {expected}: {text}");
    assert!(text.contains("rk4") && text.contains("tau_v"), "{text}");
    assert_eq!(warning("scheme = \"rk4\"\n"), None);
    let damped = |more: &str| warning(&format!("scheme = \"rkc\"\nstep = 0.002\n[stabilisation]\ntau_v = 2.0\n{more}"));
    assert_eq!(damped("interface = \"constant\"\n"), None);
    // Limited dissipation is no help against what begins infinitely small.
    assert!(damped("").is_some());
}

/// The growth that the warning names is what a run does.
#[test]
fn the_named_growth_is_real() {
    let mut run = prepared("scheme = \"rkc\"\nstep = 0.01\n");
    let energy = |run: &Prepared<1>| {
        let energies = run.model.energies(&run.state.values);
        energies.kinetic + energies.internal
    };
    let before = energy(&run);
    while run.state.time < 1.0 {
        run.stepper.advance(&mut run.model, &mut run.state, 1.0).unwrap();
    }
    assert!(energy(&run) > 10.0 * before, "{} from {before}", energy(&run));
}

#[test]
fn the_stage_rule_can_be_chosen() {
    // Rule (4.18): with c Δt / d_min = 1.5, s = 1 + ⌊√(1 + 1.5/0.131)⌋ = 4.
    let step = 1.5 * 0.25 / 1000.0_f64.sqrt();
    let stages = |rule: &str| {
        let mut run = prepared(&format!("scheme = \"rkc\"\nstep = {step}\nrkc_stages = \"{rule}\"\n"));
        run.stepper.advance(&mut run.model, &mut run.state, 1.0).unwrap().stages.unwrap()
    };
    assert_eq!(stages("courant"), 4);
    let own = stages("spectral_radius");
    assert!((2..4).contains(&own), "{own}");
}

/// A minimum as large as the step lets the first failure end the run.
#[test]
fn no_retries_if_the_minimum_is_the_step() {
    let text = "dimension = 1\n[[body]]\nspacing = 0.25\nshape.box = { lower = [0], upper = [1] }\n\
                material.hyperelastic_volumetric = { density = 1000, gamma = 7, wave_speed = 10 }\n[initial]\n\
                velocity = [\"-30*X\"]\n[time]\nend = 1\nscheme = \"rk4\"\nstep = 0.1\nminimum_step = 0.1\n";
    let mut run = prepare::<1>(&written::scene(text)).unwrap();
    let failure = run.stepper.advance(&mut run.model, &mut run.state, 1.0).unwrap_err();
    assert_eq!(failure.tries.len(), 1, "{failure}");
}
