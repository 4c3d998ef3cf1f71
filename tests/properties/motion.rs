//! Properties of short runs.

use nicolson::scene::Scene;
use nicolson::simulation::{Ledger, Prepared, prepare};

use super::Verdict;
use super::case::{Case, Random};

/// The `[time]` and other tables of a case whose step counts in explicit limits.
fn timed(case: &Case, time: &str, step: f64, steps: usize) -> Result<Case, String> {
    let limit = match case.dimension {
        1 => built::<1>(case)?.explicit_step_limit,
        2 => built::<2>(case)?.explicit_step_limit,
        _ => built::<3>(case)?.explicit_step_limit,
    };
    let step = step * limit;
    let text = format!("[time]\nstep = {step:e}\nend = {:e}\n{time}\n{}", step * steps as f64, case.time);
    Ok(Case { time: text, ..case.clone() })
}

fn built<const D: usize>(case: &Case) -> Result<Prepared<D>, String> {
    // Before its time is known, a case has any.
    let has_time = case.time.contains("[time]");
    let text = if has_time { case.text() } else { format!("{}\n[time]\nend = 1.0\nstep = 1.0\n", case.text()) };
    let scene = Scene::parse(&text, "property.toml", "".as_ref(), &[]).map_err(|errors| errors.to_string())?;
    prepare::<D>(&scene).map_err(|error| error.to_string())
}

macro_rules! in_dimension {
    ($case:expr, $run:ident) => {
        match $case.dimension {
            1 => $run::<1>($case),
            2 => $run::<2>($case),
            _ => $run::<3>($case),
        }
    };
}

fn verdict(found: Result<Result<f64, String>, String>) -> Verdict {
    match found {
        Ok(Ok(figure)) => Verdict::Holds(figure),
        Ok(Err(why)) => Verdict::Fails(why),
        Err(why) => Verdict::Impossible(why),
    }
}

/// A body in motion, free or clamped, under its weight or not, for the scheme that conserves.
pub fn conserving_case(seed: u64) -> Case {
    let mut case = Case::random(seed);
    let random = &mut Random::new(seed ^ 0x99);
    case.law.plane_stress &= case.law.name == "linear_elastic";
    (case.strain, case.rate) = (random.between(0.01, 0.1), random.between(0.02, 0.1));
    case.clamped = random.chance(0.4);
    if random.chance(0.4) {
        case.gravity = random.between(0.0, 0.05);
    }
    case.time = solvers(random);
    case
}

/// Solvers that suit any tangent.
fn solvers(random: &mut Random) -> String {
    let linear = random.choose(&["auto", "lu", "gmres", "bicgstab"]);
    let tangent = random.choose(&["full", "modified", "lagged", "lbfgs", "broyden"]);
    format!(
        "[newton]\nrelative_tolerance = 1e-13\ntangent = \"{tangent}\"\nmax_iterations = 60\n\n[linear]\n\
         solver = \"{linear}\"\ntolerance = 1e-13\n"
    )
}

/// The books of energy close in every step of the energy–momentum scheme, and a free body keeps its momenta.
pub fn conserves(case: &Case) -> Verdict {
    let steps = Random::new(case.state ^ 0x31).between(0.5, 10.0);
    let run = timed(case, "scheme = \"energy_momentum\"", steps, 6);
    match run {
        Ok(case) => {
            let case = &case;
            verdict(in_dimension!(case, energy_and_momenta))
        }
        Err(why) => Verdict::Impossible(why),
    }
}

fn energy_and_momenta<const D: usize>(case: &Case) -> Result<Result<f64, String>, String> {
    let mut run = built::<D>(case)?;
    Ok(books(case, &mut run))
}

fn books<const D: usize>(case: &Case, run: &mut Prepared<D>) -> Result<f64, String> {
    let mut ledger = Ledger::open(&mut run.model, 0.0, &run.state.values).map_err(|error| error.to_string())?;
    while run.state.time < run.end {
        run.stepper
            .advance(&mut run.model, &mut run.state, run.end)
            .map_err(|failure| format!("step from {}: {failure}\n{}", run.state.time, case.text()))?;
        ledger.follow(&mut run.model, run.state.time, &run.state.values).map_err(|error| error.to_string())?;
    }
    let summary = ledger.summary();
    let mut worst = summary.ledger_error;
    if case.gravity == 0.0 {
        worst = worst.max(summary.drift);
    }
    let momenta = [summary.linear_momentum, summary.angular_momentum.filter(|_| case.law.name != "linear_elastic")];
    worst = momenta.into_iter().flatten().fold(worst, f64::max);
    if worst < 1e-9 { Ok(worst) } else { Err(format!("{summary:?}")) }
}

/// An undamped body for two schemes.
pub fn agreeing_case(seed: u64) -> Case {
    let mut case = conserving_case(seed);
    case.law.plane_stress = Case::random(seed).law.plane_stress;
    case
}

/// Scheme and order.
const EXPLICIT: [(&str, i32); 5] =
    [("velocity_verlet", 2), ("tvd_rk2", 2), ("tvd_rk3", 3), ("rk4", 4), ("forward_euler", 1)];
const IMPLICIT: [(&str, i32); 6] = [
    ("crank_nicolson", 2),
    ("midpoint", 2),
    ("tr_bdf2", 2),
    ("sdirk3", 3),
    ("generalised_alpha", 2),
    ("backward_euler", 1),
];

/// The difference of an explicit and an implicit run falls with the lower of their orders.
pub fn agree(case: &Case) -> Verdict {
    let random = &mut Random::new(case.state ^ 0x13);
    let (explicit, implicit) = (random.choose(&EXPLICIT), random.choose(&IMPLICIT));
    let order = explicit.1.min(implicit.1);
    let difference = |parts: usize| -> Result<Result<f64, String>, String> {
        let scheme = |name: &str| timed(case, &format!("scheme = \"{name}\""), 0.5 / parts as f64, 4 * parts);
        let (one, other) = (scheme(explicit.0)?, scheme(implicit.0)?);
        let (one, other) = (&one, &other);
        let one = in_dimension!(one, end)?;
        let other = in_dimension!(other, end)?;
        Ok(one.and_then(|one| other.map(|other| distance(case, &one, &other))))
    };
    let found = difference(2).and_then(|coarse| Ok((coarse, difference(8)?)));
    verdict(found.map(|(coarse, fine)| {
        let (coarse, fine) = (coarse?, fine?);
        let what = format!("{explicit:?} and {implicit:?}: {coarse:e}, with a quarter of the step {fine:e}");
        // A factor of 4^order, and half of it for what comes after the leading term; Newton's tolerance at the end.
        if fine <= coarse / (0.5 * 4.0_f64.powi(order)) + 1e-10 && fine < 0.2 { Ok(fine) } else { Err(what) }
    }))
}

/// The state at the end.
fn end<const D: usize>(case: &Case) -> Result<Result<(usize, Vec<f64>), String>, String> {
    let mut run = built::<D>(case)?;
    while run.state.time < run.end {
        if let Err(failure) = run.stepper.advance(&mut run.model, &mut run.state, run.end) {
            return Ok(Err(failure.to_string()));
        }
    }
    Ok(Ok((run.model.particles() * D, run.state.values)))
}

/// Root of the mean squared difference of displacements and velocities, over the body's size and speed of sound, and over
/// the strain of the case.
fn distance(case: &Case, one: &(usize, Vec<f64>), other: &(usize, Vec<f64>)) -> f64 {
    let n = one.0;
    let part = |from: usize, unit: f64| -> f64 {
        let squares = (from..from + n).map(|i| ((one.1[i] - other.1[i]) / unit).powi(2));
        (squares.sum::<f64>() / n as f64).sqrt()
    };
    (part(0, case.size()) + part(n, case.speed())) / case.strain.max(case.rate).max(1e-3)
}
