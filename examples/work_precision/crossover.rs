//! When implicit schemes pay: seconds to 1 % with stiffer materials and over longer times.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::basics::reason;
use super::case::{Length, Solution, Variant, distance};
use super::problem::{METHODS, Problem};
use super::results::{LEVEL, duration, write_table};
use super::sweep::{reference, seconds_to};

/// Scenes with the share of their duration that is taken once.
const SCENES: [(&str, f64); 3] = [("piston-elastic", 1.0), ("impact-hyperelastic", 0.5), ("csm3", 0.25)];
/// Stiffness and duration over those of the scene.
const VARIANTS: [(f64, f64); 5] = [(1.0, 1.0), (10.0, 1.0), (100.0, 1.0), (1.0, 4.0), (1.0, 16.0)];
/// Step of the reference.
const REFERENCE: Length = Length::Courant(1.0);
/// Explicit and implicit methods that compete.
const EXPLICIT: &str = "velocity Verlet";
const IMPLICIT: [&str; 3] = ["Crank–Nicolson", "Crank–Nicolson, lagged", "energy–momentum"];
/// Steps per sample at the first and at most.
const STEPS: (usize, usize) = (8, 8192);

const COLUMNS: [&str; 8] =
    ["scene", "stiffness", "duration", "method", "step", "time_error", "seconds", "rate_evaluations"];

struct Found {
    records: Vec<Vec<String>>,
    /// Best seconds, explicit and implicit, and the method of the latter.
    explicit: Option<(f64, bool)>,
    implicit: Option<(f64, bool)>,
    method: &'static str,
}

fn compete(variant: &Variant, short: bool) -> Result<Found, String> {
    let track = reference(variant, REFERENCE)?;
    let mut found = Found { records: Vec::new(), explicit: None, implicit: None, method: "" };
    let competitors = METHODS.into_iter().filter(|method| method.name == EXPLICIT || IMPLICIT.contains(&method.name));
    for method in competitors {
        let mut points = Vec::new();
        let mut steps = STEPS.0;
        loop {
            let length = match method.courant.get(points.len()) {
                Some(courant) => Length::Courant(*courant),
                None if method.is_implicit() => Length::Steps(steps),
                None => break,
            };
            steps *= 2;
            let solution = variant.run(&method, length, !short);
            let error = solution.as_ref().map_or(f64::INFINITY, |solution| distance(&solution.track, &track));
            let Solution { work, step, .. } = solution.unwrap_or_default();
            let numbers = [variant.stiffness, variant.duration].map(|value| value.to_string());
            let mut record: Vec<String> = vec![variant.problem.name.to_owned()];
            record.extend(numbers);
            record.push(method.name.to_owned());
            record.extend([step, error, work.seconds].map(|value| format!("{value:.4e}")));
            record.push(work.evaluations().to_string());
            found.records.push(record);
            points.push((error, work.seconds));
            if error <= LEVEL || steps > STEPS.1 || (short && points.len() == 2) {
                break;
            }
        }
        let seconds = seconds_to(LEVEL, &points);
        if !method.is_implicit() {
            found.explicit = seconds;
        } else if let Some((time, _)) = seconds
            && found.implicit.is_none_or(|(best, _)| time < best)
        {
            (found.implicit, found.method) = (seconds, method.name);
        }
    }
    Ok(found)
}

/// Writes `crossover.csv` and `.md`.
///
/// # Errors
/// In words.
pub fn write(directory: &Path, problems: &[Problem], short: bool) -> Result<Vec<PathBuf>, String> {
    let mut records = Vec::new();
    let mut text = format!(
        "Seconds of stepping to a time error of {} %, one thread; the best of {}.\n\n\
         | scene, s | stiffness | duration | {EXPLICIT} | implicit | by | ratio |\n|---|---|---|---|---|---|---|\n",
        100.0 * LEVEL,
        IMPLICIT.join("; ")
    );
    for (name, share) in SCENES {
        let Some(problem) = problems.iter().find(|problem| problem.name == name) else { continue };
        for (stiffness, duration_factor) in VARIANTS.into_iter().take(if short { 1 } else { VARIANTS.len() }) {
            let share = if short { 0.05 * share } else { share };
            let variant = Variant { problem: *problem, stiffness, duration: share * duration_factor };
            let found = compete(&variant, short)?;
            records.extend(found.records);
            let cell = |seconds: Option<(f64, bool)>| seconds.map_or_else(|| "–".to_owned(), duration);
            let ratio = match (found.explicit, found.implicit) {
                (Some((explicit, _)), Some((implicit, _))) => format!("{:.1}", explicit / implicit),
                _ => "–".into(),
            };
            let line = format!(
                "| {name}, {:.3} | × {stiffness} | × {duration_factor} | {} | {} | {} | {ratio} |",
                variant.end(),
                cell(found.explicit),
                cell(found.implicit),
                found.method
            );
            eprintln!("{line}");
            let _ = writeln!(text, "{line}");
        }
    }
    let (table, summary) = (directory.join("crossover.csv"), directory.join("crossover.md"));
    write_table(&table, &COLUMNS, &records)?;
    std::fs::write(&summary, text).map_err(reason(&summary))?;
    Ok(vec![table, summary])
}
