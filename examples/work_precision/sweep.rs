//! Every scene with every method and a row of steps.

use super::case::{Length, Solution, Track, Variant, distance};
use super::problem::{METHODS, Method, Problem};

/// Courant number of the reference: two steps in each of 1.
const REFERENCE: Length = Length::Part(1.0, 2);
/// The same in steps twice as long.
const COARSER: Length = Length::Courant(1.0);
/// Share of its duration that a scene runs in short.
const SHORT: f64 = 0.04;

/// One run and its errors.
#[derive(Debug, Clone)]
pub struct Row {
    pub problem: Problem,
    pub method: Method,
    /// The run; why it ended early.
    pub solution: Result<Solution, String>,
    /// Distance from the reference, relative; infinite after an early end.
    pub error: f64,
    /// What the reference misses, relative.
    pub uncertainty: f64,
}

/// A reference, by RK4.
///
/// # Errors
/// If the run ends early.
pub fn reference(variant: &Variant, length: Length) -> Result<Track, String> {
    let method = Method { name: "reference", keys: &[("time.scheme", "rk4")], courant: &[1.0] };
    Ok(variant.run(&method, length, false)?.track)
}

/// The steps of a method, the longest first.
fn lengths(problem: &Problem, method: &Method) -> Vec<Length> {
    if method.is_implicit() {
        problem.steps.iter().map(|steps| Length::Steps(*steps)).collect()
    } else {
        method.courant.iter().map(|courant| Length::Courant(*courant)).collect()
    }
}

/// Runs everything.
///
/// # Errors
/// In words, if there is no reference.
pub fn sweep(problems: &[Problem], short: bool) -> Result<Vec<Row>, String> {
    let mut rows = Vec::new();
    for problem in problems {
        let variant = Variant { duration: if short { SHORT } else { 1.0 }, ..Variant::plain(*problem) };
        let track =
            reference(&variant, REFERENCE).map_err(|error| format!("reference of {}: {error}", problem.name))?;
        // Of fourth order: the distance to the coarser one is 15 times the error of the finer one.
        let uncertainty = distance(&reference(&variant, COARSER)?, &track) / 15.0;
        eprintln!("{}: reference known to {uncertainty:.1e}", problem.name);
        for method in METHODS {
            let mut lengths = lengths(problem, &method);
            if short {
                lengths.truncate(2);
            }
            for length in lengths {
                let solution = variant.run(&method, length, !short);
                let error = solution.as_ref().map_or(f64::INFINITY, |solution| distance(&solution.track, &track));
                if let Ok(Solution { step, work, .. }) = &solution {
                    eprintln!(
                        "{} {} Δt = {step:.2e} s: error {error:.1e}, {:.3} s",
                        problem.name, method.name, work.seconds
                    );
                }
                rows.push(Row { problem: *problem, method, solution, error, uncertainty });
            }
        }
    }
    Ok(rows)
}

/// Seconds at which a row of (error, seconds), from the longest step to the shortest, reaches a level, by interpolation
/// of logarithms; and whether the longest step is below the level already. `None` where none reaches it.
pub fn seconds_to(level: f64, points: &[(f64, f64)]) -> Option<(f64, bool)> {
    let first = points.iter().position(|(error, _)| *error <= level)?;
    let (below, seconds) = points[first];
    let before = first.checked_sub(1).map(|before| points[before]).filter(|(error, _)| error.is_finite());
    let Some((above, faster)) = before else { return Some((seconds, first == 0)) };
    let part = (level / above).ln() / (below / above).ln();
    Some(((faster.ln() + part * (seconds / faster).ln()).exp(), false))
}

#[cfg(test)]
mod tests {
    use super::super::problem::PROBLEMS;
    use super::*;

    #[test]
    fn the_time_to_an_error_is_interpolated() {
        let points = [(f64::INFINITY, 0.1), (0.1, 1.0), (0.001, 100.0)];
        let (seconds, bounded) = seconds_to(0.01, &points).unwrap();
        assert!((seconds - 10.0).abs() < 1e-12 && !bounded);
        assert_eq!(seconds_to(0.1, &points), Some((1.0, false)));
        assert_eq!(seconds_to(0.01, &points[2..]), Some((100.0, true)));
        assert_eq!(seconds_to(1e-9, &points), None);
        assert_eq!(seconds_to(0.01, &[(f64::NAN, 1.0)]), None);
    }

    /// Second order in time towards the reference, whatever the error in space.
    #[test]
    fn errors_are_those_of_the_time_alone() {
        let variant = Variant::plain(PROBLEMS[0]);
        let track = reference(&variant, REFERENCE).unwrap();
        let coarser = distance(&reference(&variant, COARSER).unwrap(), &track);
        let method = METHODS.into_iter().find(|method| method.name == "Crank–Nicolson").unwrap();
        let errors: Vec<f64> = [64, 128, 256]
            .into_iter()
            .map(|steps| distance(&variant.run(&method, Length::Steps(steps), false).unwrap().track, &track))
            .collect();
        for pair in errors.windows(2) {
            assert!((pair[0] / pair[1]).log2() > 1.9, "{errors:?}");
        }
        assert!(coarser < 0.01 * errors[2], "{coarser} {errors:?}");
    }

    #[test]
    fn counts_are_those_of_the_scheme() {
        let variant = Variant { duration: 0.1, ..Variant::plain(PROBLEMS[0]) };
        let of = |name: &str| METHODS.into_iter().find(|method| method.name == name).unwrap();
        let explicit = variant.run(&of("RK4"), Length::Courant(0.6), false).unwrap().work;
        assert_eq!((explicit.rates, explicit.residuals, explicit.factorisations), (4 * explicit.steps, 0, 0));
        let implicit = variant.run(&of("Crank–Nicolson"), Length::Steps(8), false).unwrap().work;
        assert_eq!((implicit.steps, implicit.rates, implicit.factorisations), (8, 1, 1));
        assert_eq!((implicit.newton, implicit.evaluations()), (8, 17));
        assert!(implicit.equivalents() > 0.0);
    }
}
