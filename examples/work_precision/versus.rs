//! Our schemes against diffsol's BDF, TR-BDF2 and ESDIRK34 on the same discrete system, at equal error.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use diffsol::{DiffsolError, FaerSparseLU, OdeBuilder, OdeSolverMethod, OdeSolverStopReason, Vector};

use super::basics::reason;
use super::case::{Length, SAMPLES, Solution, Track, Variant, distance};
use super::peer::{Entries, Peer};
use super::problem::{METHODS, Method, Problem};
use super::results::write_table;
use super::sweep::{reference, seconds_to};

/// Scenes with the share of their duration.
const SCENES: [(&str, f64); 3] = [("piston-hyperelastic", 1.0), ("impact-hyperelastic", 1.0), ("csm3", 0.5)];
/// Relative tolerances of diffsol.
const TOLERANCES: [f64; 6] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];
/// Our steps to the end.
const STEPS: [usize; 7] = [8, 16, 32, 64, 128, 256, 512];
/// Errors at which the times are compared.
const LEVELS: [f64; 3] = [1e-1, 1e-2, 1e-3];
/// Step of the reference.
const REFERENCE: Length = Length::Courant(0.5);
/// A run of diffsol is given up after this many steps.
const MOST_STEPS: usize = 100_000;

const PEERS: [&str; 3] = ["BDF", "TR-BDF2", "ESDIRK34"];
const COLUMNS: [&str; 8] =
    ["scene", "method", "step_or_tolerance", "time_error", "seconds", "evaluations", "assemblies", "ended_early"];

/// One run of diffsol.
struct PeerRun {
    track: Track,
    seconds: f64,
    counts: (usize, usize),
}

/// Steps a solver of diffsol to the end, and reads the displacements at the samples.
fn march<'a, const D: usize>(
    mut solver: impl OdeSolverMethod<'a, Peer<D>>,
    peer: &Peer<D>,
    end: f64,
) -> Result<Track, DiffsolError> {
    let mut track = Track::new();
    solver.set_stop_time(end)?;
    for _ in 0..MOST_STEPS {
        let stop = solver.step()?;
        while track.len() < SAMPLES - 1 {
            let sample = end * (track.len() + 1) as f64 / SAMPLES as f64;
            if solver.state().t < sample {
                break;
            }
            track.push(peer.displacements(&solver.interpolate(sample)?.clone_as_vec()));
        }
        if matches!(stop, OdeSolverStopReason::TstopReached) {
            track.push(peer.displacements(&solver.state().y.clone_as_vec()));
            break;
        }
    }
    Ok(track)
}

/// Runs diffsol with a tolerance; displacement and velocity are what the absolute tolerances are relative to.
fn run<const D: usize>(variant: &Variant, name: &str, tolerance: f64, sizes: (f64, f64)) -> Result<PeerRun, String> {
    let method = Method { name: "diffsol", keys: &[("newton.unknowns", "full")], courant: &[] };
    let peer = Peer::new(variant.prepared::<D>(&method, variant.end())?);
    let absolute = peer.absolute(tolerance, sizes.0, sizes.1);
    let failed = |error: DiffsolError| error.to_string();
    let builder: OdeBuilder<Entries> = OdeBuilder::new();
    let builder = builder.rtol(tolerance).atol(absolute).h0(1e-3 * variant.end());
    let problem = builder.build_from_eqn(peer).map_err(failed)?;
    let peer = problem.eqn();
    let start = Instant::now();
    let track = match name {
        "BDF" => problem.bdf::<FaerSparseLU<f64>>().and_then(|solver| march(solver, peer, variant.end())),
        "TR-BDF2" => problem.tr_bdf2::<FaerSparseLU<f64>>().and_then(|solver| march(solver, peer, variant.end())),
        _ => problem.esdirk34::<FaerSparseLU<f64>>().and_then(|solver| march(solver, peer, variant.end())),
    }
    .map_err(failed)?;
    if track.len() < SAMPLES {
        return Err(format!("more than {MOST_STEPS} steps"));
    }
    Ok(PeerRun { track, seconds: start.elapsed().as_secs_f64(), counts: peer.counts() })
}

/// Largest displacement and velocity of a track: a velocity is a change over the time between samples, or that of the
/// start.
fn sizes<const D: usize>(variant: &Variant, track: &Track) -> Result<(f64, f64), String> {
    let prepared = variant.prepared::<D>(&METHODS[3], variant.end())?;
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let displacement = track.iter().map(|sample| largest(sample)).fold(0.0, f64::max);
    let velocity = largest(prepared.model.velocities_of(&prepared.state.values));
    Ok((displacement, velocity.max(displacement / variant.end() * SAMPLES as f64)))
}

struct Row {
    method: &'static str,
    parameter: f64,
    error: f64,
    seconds: f64,
    counts: (usize, usize),
    cause: String,
}

fn compare<const D: usize>(variant: &Variant, short: bool) -> Result<Vec<Row>, String> {
    let track = reference(variant, REFERENCE)?;
    let sizes = sizes::<D>(variant, &track)?;
    let mut rows = Vec::new();
    let few = if short { 2 } else { usize::MAX };
    for name in PEERS {
        for tolerance in TOLERANCES.into_iter().take(few) {
            let found = run::<D>(variant, name, tolerance, sizes);
            let cause = found.as_ref().err().cloned().unwrap_or_default();
            let (error, seconds, counts) = found.map_or((f64::INFINITY, f64::NAN, (0, 0)), |found| {
                (distance(&found.track, &track), found.seconds, found.counts)
            });
            eprintln!(
                "{} diffsol {name} {tolerance:.0e}: error {error:.1e}, {seconds:.3} s {cause}",
                variant.problem.name
            );
            rows.push(Row { method: name, parameter: tolerance, error, seconds, counts, cause });
        }
    }
    for method in METHODS.into_iter().filter(|method| method.is_implicit()) {
        for steps in STEPS.into_iter().take(few) {
            let found = variant.run(&method, Length::Steps(steps), !short);
            let cause = found.as_ref().err().cloned().unwrap_or_default();
            let error = found.as_ref().map_or(f64::INFINITY, |found| distance(&found.track, &track));
            let Solution { work, step, .. } = found.unwrap_or_default();
            let counts = (work.evaluations(), work.assemblies);
            rows.push(Row { method: method.name, parameter: step, error, seconds: work.seconds, counts, cause });
        }
    }
    Ok(rows)
}

/// The shortest time to an error among some methods, and the method.
fn best(rows: &[Row], level: f64, ours: bool) -> Option<(f64, &'static str)> {
    let mut names: Vec<&str> = rows.iter().map(|row| row.method).collect();
    names.dedup();
    let seconds = |name: &'static str| {
        let points: Vec<_> = rows.iter().filter(|row| row.method == name).map(|row| (row.error, row.seconds)).collect();
        seconds_to(level, &points).map(|(seconds, _)| (seconds, name))
    };
    let wanted = names.into_iter().filter(|name| PEERS.contains(name) != ours);
    wanted.filter_map(seconds).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Writes `diffsol.csv` and `.md`.
///
/// # Errors
/// In words.
pub fn write(directory: &Path, problems: &[Problem], short: bool) -> Result<Vec<PathBuf>, String> {
    let mut records = Vec::new();
    let mut text = String::from(
        "Seconds to a time error on the same rates and derivatives, one thread; diffsol's best of BDF, TR-BDF2 and ESDIRK34 \
         with sparse LU of faer.\n\n| scene | error | diffsol | ours | ratio |\n|---|---|---|---|---|\n",
    );
    for (name, share) in SCENES {
        let Some(problem) = problems.iter().find(|problem| problem.name == name) else { continue };
        let share = if short { 0.04 * share } else { share };
        let variant = Variant { duration: share, ..Variant::plain(*problem) };
        let rows = compare::<2>(&variant, short)?;
        for level in LEVELS {
            let (theirs, ours) = (best(&rows, level, false), best(&rows, level, true));
            let cell =
                |found: Option<(f64, &str)>| found.map_or("–".into(), |(time, by)| format!("{time:.3} s, {by}"));
            let ratio = theirs.zip(ours).map_or("–".into(), |(theirs, ours)| format!("{:.1}", theirs.0 / ours.0));
            let _ = writeln!(text, "| {name} | {level} | {} | {} | {ratio} |", cell(theirs), cell(ours));
        }
        records.extend(rows.iter().map(|row| {
            let numbers = [row.parameter, row.error, row.seconds].map(|value| format!("{value:.4e}"));
            let mut record = vec![name.to_owned(), row.method.to_owned()];
            record.extend(numbers);
            record.extend([row.counts.0.to_string(), row.counts.1.to_string(), row.cause.clone()]);
            record
        }));
    }
    eprintln!("{text}");
    let (table, summary) = (directory.join("diffsol.csv"), directory.join("diffsol.md"));
    write_table(&table, &COLUMNS, &records)?;
    std::fs::write(&summary, text).map_err(reason(&summary))?;
    Ok(vec![table, summary])
}

#[cfg(test)]
mod tests {
    use diffsol::{ConstantOp, FaerVec, Matrix, NonLinearOp, NonLinearOpJacobian, OdeEquations, Op};

    use super::super::problem::PROBLEMS;
    use super::*;

    fn problem(name: &str) -> Problem {
        PROBLEMS.into_iter().find(|problem| problem.name == name).unwrap()
    }

    /// Their matrix is the derivative of their rate: every column against central differences.
    #[test]
    fn derivatives_are_those_of_the_rate() {
        for name in ["piston-hyperelastic", "csm3"] {
            let size: &[(&str, &str)] = if name == "csm3" { &[("body.0.counts", "[36, 3]")] } else { &[] };
            let variant = Variant::plain(Problem { size, ..problem(name) });
            let method = Method { name: "diffsol", keys: &[("newton.unknowns", "full")], courant: &[] };
            let peer = Peer::new(variant.prepared::<2>(&method, 1.0).unwrap());
            let size = peer.nstates();
            let context = *peer.context();
            let mut noise = nicolson::model::Noise::new(3);
            let mut at = ConstantOp::call(&peer.init(), 0.0).clone_as_vec();
            at.iter_mut().for_each(|value| *value += 1e-3 * noise.next());
            let at = FaerVec::from_vec(at, context);
            let matrix = peer.rhs().jacobian(&at, 0.0);
            let mut largest = 0.0_f64;
            let mut worst = 0.0_f64;
            for column in (0..size).step_by(7) {
                let h = 1e-6;
                let [up, down] = [h, -h].map(|h| {
                    let mut moved = at.clone();
                    moved.set_index(column, at.get_index(column) + h);
                    peer.rhs().call(&moved, 0.0).clone_as_vec()
                });
                let mut unit = FaerVec::zeros(size, context);
                unit.set_index(column, 1.0);
                let mut product = FaerVec::zeros(size, context);
                Matrix::gemv(&matrix, 1.0, &unit, 0.0, &mut product);
                let action = peer.rhs().jac_mul(&at, 0.0, &unit).clone_as_vec();
                for (row, product) in product.clone_as_vec().into_iter().enumerate() {
                    let difference = (up[row] - down[row]) / (2.0 * h);
                    largest = largest.max(product.abs());
                    worst = worst.max((product - difference).abs()).max((product - action[row]).abs());
                }
            }
            assert!(worst < 1e-6 * largest, "{name}: {worst} of {largest}");
        }
    }

    /// With a strict tolerance they arrive where our reference does.
    #[test]
    fn both_solve_the_same_system() {
        let variant = Variant { duration: 0.1, ..Variant::plain(problem("piston-hyperelastic")) };
        let track = reference(&variant, REFERENCE).unwrap();
        let sizes = sizes::<2>(&variant, &track).unwrap();
        for name in PEERS {
            let found = run::<2>(&variant, name, 1e-6, sizes).unwrap();
            assert!(distance(&found.track, &track) < 1e-4, "{name}: {}", distance(&found.track, &track));
            assert!(found.counts.0 > 0 && found.counts.1 > 0);
        }
    }
}
