//! The swinging beam of Turek and Hron (CSM3) to t = 2 s: the fastest implicit run with trough and period of the tip within
//! 1 %, and what explicit schemes take at their stable steps.
//!
//! With the modulus of the benchmark trough and period are compared with the published ones; with a stiffer beam, for which
//! none are published, with those of the same particles in steps a fifth as long.
//!
//! An explicit run takes up to a million equal steps: some hundred of them are timed, and the time to the end follows. The
//! fastest mode has `ω Δt ≤ 2 C` at the Courant number C. Velocity Verlet bears `C = 1`. TVD-RK2 lets a mode grow by
//! `√(1 + (ωΔt)⁴/4)` a step: its stable step is the one with which rounding has grown to a thousandth by the end.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use nicolson::simulation::{Gauge, Prepared};

use super::basics::reason;
use super::problem::{METHODS, Method};
use super::results::write_table;
use super::scenes;

/// Time to reach, s.
const END: f64 = 2.0;
/// First trough of the tip, m, and mean period, s (see the head of the scene).
const PUBLISHED: (f64, f64) = (-0.12964, 0.9145);
/// Largest relative error of both.
const LEVEL: f64 = 0.01;
/// Young's modulus of the scene, Pa.
const MODULUS: f64 = 1.4e6;
/// Steps of an explicit run that are timed, and how often.
const TIMED: (usize, usize) = (200, 3);
/// Courant numbers of velocity Verlet, and of the program's default.
const VERLET: f64 = 0.9;
const DEFAULT: f64 = 0.3;
/// Implicit methods that compete, and their steps to the end for the beam as it is.
const IMPLICIT: [&str; 5] =
    ["Crank–Nicolson", "Crank–Nicolson, lagged", "mid-point, lagged", "SDIRK3, lagged", "energy–momentum"];
const STEPS: [usize; 9] = [24, 32, 40, 48, 64, 80, 100, 140, 200];

const COLUMNS: [&str; 8] = ["across", "stiffness", "method", "step", "steps", "seconds", "trough", "period"];

/// A beam with so many particles across.
#[derive(Debug, Clone, Copy)]
struct Beam {
    across: usize,
    stiffness: f64,
}

/// What the tip did.
#[derive(Debug, Clone, Copy)]
struct Swing {
    trough: f64,
    period: f64,
}

#[derive(Debug, Clone)]
struct Run {
    method: &'static str,
    step: f64,
    steps: usize,
    seconds: f64,
    swing: Option<Swing>,
}

impl Beam {
    fn prepared(&self, method: &Method, step: f64) -> Result<Prepared<2>, String> {
        let counts = format!("[{}, {}]", 70 * (self.across - 1) / 4 + 1, self.across);
        let own = [
            ("body.0.counts", counts),
            ("body.0.material.st_venant_kirchhoff.youngs_modulus", format!("{:e}", MODULUS * self.stiffness)),
            ("time.end", format!("{END:e}")),
            ("time.step", format!("{step:e}")),
        ];
        let given = method.keys.iter().map(|(key, value)| (*key, (*value).to_owned()));
        scenes::prepared::<2>(include_str!("../csm3.toml"), "csm3", own.into_iter().chain(given))
    }

    /// Runs to `end`; seconds with the set-up.
    fn run(&self, method: &Method, steps: usize, end: f64) -> Result<Run, String> {
        let step = END / steps as f64;
        let start = Instant::now();
        let Prepared { mut model, mut stepper, mut state, .. } = self.prepared(method, step)?;
        let probe = model.setup().probes.first().map(|probe| Gauge::new(probe, &model)).ok_or("no probe")?;
        let mut path = vec![(0.0, 0.0)];
        while state.time < end {
            stepper.advance(&mut model, &mut state, end).map_err(|failure| failure.to_string())?;
            path.push((state.time, probe.read(&model, &state.values).0[1]));
        }
        let seconds = start.elapsed().as_secs_f64();
        Ok(Run { method: method.name, step, steps, seconds, swing: swing(&path) })
    }

    /// An explicit run, from the time of some of its steps.
    fn timed(&self, method: &Method, courant: f64) -> Result<Run, String> {
        let limit = self.prepared(method, 1e-9)?.explicit_step_limit / DEFAULT;
        let step = courant * limit;
        let steps = (END / step).ceil() as usize;
        let mut shortest = f64::INFINITY;
        for _ in 0..TIMED.1 {
            let Prepared { mut model, mut stepper, mut state, .. } = self.prepared(method, step)?;
            let start = Instant::now();
            for _ in 0..TIMED.0 {
                stepper.advance(&mut model, &mut state, END).map_err(|failure| failure.to_string())?;
            }
            shortest = shortest.min(start.elapsed().as_secs_f64() / TIMED.0 as f64);
        }
        Ok(Run { method: method.name, step, steps, seconds: shortest * steps as f64, swing: None })
    }

    /// The largest Courant number at which TVD-RK2 bears the whole time.
    fn stable_courant(&self, method: &Method) -> Result<f64, String> {
        let limit = self.prepared(method, 1e-9)?.explicit_step_limit / DEFAULT;
        let growth = |courant: f64| 0.5 * END / (courant * limit) * (4.0 * courant.powi(4)).ln_1p();
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle: f64 = 0.5 * (low + high);
            // From 1e-16 to 1e-3.
            if growth(middle) < 1e13_f64.ln() { low = middle } else { high = middle }
        }
        Ok(low)
    }

    /// What a swing is compared with.
    fn target(&self) -> Result<Swing, String> {
        let (trough, period) = PUBLISHED;
        if self.stiffness == 1.0 {
            return Ok(Swing { trough, period });
        }
        let method = named("Crank–Nicolson, lagged")?;
        let steps = (5.0 * STEPS[STEPS.len() - 1] as f64 * self.stiffness.sqrt()) as usize;
        // Two swings and a little more.
        let end = 2.2 * period / self.stiffness.sqrt();
        self.run(&method, steps, end)?.swing.ok_or_else(|| "the stiff beam does not swing".into())
    }

    /// The fastest implicit run that is good enough.
    fn implicit(&self, short: bool) -> Result<Vec<Run>, String> {
        let target = self.target()?;
        let mut runs: Vec<Run> = Vec::new();
        for name in IMPLICIT.into_iter().take(if short { 1 } else { IMPLICIT.len() }) {
            let method = named(name)?;
            for steps in STEPS.into_iter().skip(if short { 6 } else { 0 }) {
                let steps = (steps as f64 * self.stiffness.sqrt()) as usize;
                let Ok(mut run) = self.run(&method, steps, END) else { continue };
                if run.swing.is_some_and(|swing| swing.misses(&target) <= LEVEL) {
                    run.seconds = run.seconds.min(self.run(&method, steps, END)?.seconds);
                    eprintln!("{self:?}: {run:?}");
                    runs.push(run);
                    break;
                }
            }
        }
        runs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        Ok(runs)
    }
}

impl Swing {
    /// The larger relative error.
    fn misses(&self, target: &Self) -> f64 {
        (self.trough / target.trough - 1.0).abs().max((self.period / target.period - 1.0).abs())
    }
}

fn named(name: &str) -> Result<Method, String> {
    METHODS.into_iter().find(|method| method.name == name).ok_or_else(|| format!("no method {name}"))
}

/// First trough and mean distance of the troughs of a path, each by a parabola through three points; `None` for less than
/// two troughs.
fn swing(path: &[(f64, f64)]) -> Option<Swing> {
    let lowest = path.iter().map(|(_, u)| *u).fold(0.0, f64::min);
    let troughs: Vec<(f64, f64)> = path
        .windows(3)
        .filter(|three| three[1].1 < three[0].1 && three[1].1 <= three[2].1 && three[1].1 < 0.5 * lowest)
        .map(|three| {
            let (left, right) = (three[0].1 - three[1].1, three[2].1 - three[1].1);
            let shift = 0.5 * (left - right) / (left + right);
            (three[1].0 + shift * (three[2].0 - three[1].0), three[1].1 - 0.25 * (left - right) * shift)
        })
        .collect();
    let ((first, trough), (last, _)) = (troughs.first()?, troughs.last()?);
    (troughs.len() > 1).then(|| Swing { trough: *trough, period: (last - first) / (troughs.len() - 1) as f64 })
}

/// Writes `csm3.csv` and `.md`.
///
/// # Errors
/// In words.
pub fn write(directory: &Path, short: bool) -> Result<Vec<PathBuf>, String> {
    let mut text = String::from(
        "CSM3 to t = 2 s, trough and period within 1 %, one thread, set-up included. Δt and time; over that of the best \
         implicit run, in brackets.\n\n\
         | across | E | best implicit | velocity Verlet, C = 0.9 | TVD-RK2, stable to the end | TVD-RK2, C = 0.3 |\n\
         |---|---|---|---|---|---|\n",
    );
    let mut records = Vec::new();
    let beams = if short { vec![(3, 1.0)] } else { vec![(9, 1.0), (17, 1.0), (9, 100.0), (17, 100.0)] };
    for (across, stiffness) in beams {
        let beam = Beam { across, stiffness };
        let (verlet, tvd) = (named("velocity Verlet")?, named("TVD-RK2")?);
        let implicit = beam.implicit(short)?;
        let best = implicit.first().map_or(f64::NAN, |run| run.seconds);
        let _ = write!(text, "| {across} | × {stiffness} |");
        let Some(first) = implicit.first() else { continue };
        let Swing { trough, period } = first.swing.unwrap_or(Swing { trough: f64::NAN, period: f64::NAN });
        let _ = write!(
            text,
            " {}, {:.2e} s, {} steps: **{:.2} s** ({:.2} mm, {:.4} s) |",
            first.method,
            first.step,
            first.steps,
            best,
            1e3 * trough,
            period
        );
        let explicit =
            [(verlet, VERLET), (tvd, beam.stable_courant(&tvd)?), (tvd, DEFAULT)].map(|(method, courant)| {
                let run = beam.timed(&method, courant)?;
                let _ = write!(text, " {:.2e} s: {:.1} s ({:.1}) |", run.step, run.seconds, run.seconds / best);
                Ok::<Run, String>(run)
            });
        text.push('\n');
        let explicit: Vec<Run> = explicit.into_iter().collect::<Result<_, _>>()?;
        for run in implicit.iter().chain(&explicit) {
            let mut record = vec![across.to_string(), stiffness.to_string(), run.method.to_owned()];
            record.extend([format!("{:.4e}", run.step), run.steps.to_string(), format!("{:.4e}", run.seconds)]);
            let of =
                |value: fn(Swing) -> f64| run.swing.map_or_else(String::new, |swing| format!("{:.6e}", value(swing)));
            record.extend([of(|swing| swing.trough), of(|swing| swing.period)]);
            records.push(record);
        }
    }
    eprintln!("{text}");
    let (table, summary) = (directory.join("csm3.csv"), directory.join("csm3.md"));
    write_table(&table, &COLUMNS, &records)?;
    std::fs::write(&summary, text).map_err(reason(&summary))?;
    Ok(vec![table, summary])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn troughs_are_found_between_points() {
        // −1 + cos(2πt/0.9145), in steps of a twentieth of the period.
        let path: Vec<(f64, f64)> = (0..45)
            .map(|i| 0.0457 * f64::from(i))
            .map(|t| (t, (std::f64::consts::TAU * t / 0.9145).cos() - 1.0))
            .collect();
        let found = swing(&path).unwrap();
        assert!((found.trough + 2.0).abs() < 1e-3 && (found.period - 0.9145).abs() < 1e-3, "{found:?}");
        assert!(swing(&path[..20]).is_none());
        let target = Swing { trough: -2.0, period: 0.9 };
        assert!((Swing { trough: -2.0, period: 0.918 }.misses(&target) - 0.02).abs() < 1e-12);
    }

    #[test]
    fn the_stable_step_of_tvd_rk2_lets_rounding_grow_to_a_thousandth() {
        let beam = Beam { across: 3, stiffness: 1.0 };
        let tvd = named("TVD-RK2").unwrap();
        let courant = beam.stable_courant(&tvd).unwrap();
        let step = courant * beam.prepared(&tvd, 1e-9).unwrap().explicit_step_limit / DEFAULT;
        let growth = (1.0 + 4.0 * courant.powi(4)).sqrt().powf(END / step);
        assert!((growth.log10() - 13.0).abs() < 1e-6, "{growth:e} at {courant}");
    }
}
