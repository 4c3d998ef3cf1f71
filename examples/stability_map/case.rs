//! One case of the map: a scene, a scheme, a step, with or without upwinding.

use std::time::Instant;

use nicolson::output::{Cell, Tone};
use nicolson::simulation::{Ledger, Prepared};

use super::scenes;

/// Total energy, over that at the start, from which on a run counts as blown up.
const GROWN: f64 = 10.0;

/// The scenes, inside the program, so that it runs anywhere.
pub const SCENES: [(&str, &str); 2] =
    [("piston", include_str!("../piston-hyperelastic.toml")), ("impact", include_str!("../impact-hyperelastic.toml"))];
/// Schemes by their names in a scene, as the map has them.
pub const SCHEMES: [&str; 5] = ["crank_nicolson", "midpoint", "generalised_alpha", "tr_bdf2", "energy_momentum"];
/// Steps over the explicit limit at the start.
pub const RATIOS: [f64; 9] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
/// Parameters of the upwinding of the velocity.
pub const UPWINDING: [f64; 2] = [0.0, 0.5];

/// What tells a case from others.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Name in [`SCENES`].
    pub scene: String,
    /// Name as in a scene.
    pub scheme: String,
    /// Parameter τ_v of the upwinding.
    pub upwinding: f64,
    /// Step over the explicit limit.
    pub ratio: f64,
    /// Time to reach, s.
    pub end: f64,
}

/// How a case ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// It reached its end.
    Completed,
    /// A step could not be done.
    Failed,
    /// The total energy reached a multiple of that at the start.
    Grown,
}

impl Ending {
    const NAMES: [(Self, &str); 3] = [(Self::Completed, "completed"), (Self::Failed, "failed"), (Self::Grown, "grown")];

    /// The word in the table of results.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(ending, _)| *ending == self).map_or("", |(_, name)| name)
    }

    /// The ending of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(_, known)| *known == name).map(|(ending, _)| *ending)
    }
}

/// What became of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The case.
    pub case: Case,
    /// Step, s.
    pub step: f64,
    /// How it ended.
    pub ending: Ending,
    /// Time reached, s.
    pub time: f64,
    /// Accepted steps.
    pub steps: usize,
    /// Iterations of Newton's method.
    pub iterations: usize,
    /// Largest `|total(t) − total(0)|` over the energy.
    pub drift: f64,
    /// Largest rise of the total energy above an earlier value, over the energy: what no scheme should do.
    pub rise: f64,
    /// Largest `|total(t) + dissipated(t) − total(0)|` over the energy.
    pub ledger: f64,
    /// Total energy at the end over that at the start.
    pub remaining: f64,
    /// Time on the clock, s.
    pub seconds: f64,
    /// Why it ended early.
    pub cause: String,
}

impl Outcome {
    /// The number that matters: without upwinding the drift, with it the rise.
    pub fn error(&self) -> f64 {
        if self.case.upwinding > 0.0 { self.rise } else { self.drift }
    }

    /// The cell of the figure and of the table.
    pub fn cell(&self) -> Cell {
        if self.ending != Ending::Completed {
            // The earlier the worse, on a scale of decades of time.
            let early = 1.0 - (1.0 + self.time).ln() / (1.0 + self.case.end).ln();
            return Cell { text: format!("{} s", short(self.time)), tone: Tone::Bad(early) };
        }
        // From rounding (0) to the energy itself (1).
        let size = 1.0 + self.error().max(1e-16).log10() / 16.0;
        let text = if self.error() == 0.0 { "0".into() } else { format!("{:.0e}", self.error()).replace('-', "−") };
        Cell { text, tone: Tone::Good(1.0 - size) }
    }
}

/// A time with two or three digits.
fn short(time: f64) -> String {
    if time < 9.95 { format!("{time:.1}") } else { format!("{time:.0}") }
}

impl Case {
    /// Runs it, without shorter steps for those that fail.
    ///
    /// # Errors
    /// In words, if the case cannot even begin.
    pub fn run(&self) -> Result<Outcome, String> {
        let (_, text) = SCENES.iter().find(|(name, _)| *name == self.scene).ok_or("no such scene")?;
        let limit = self.prepared(text, 1.0)?.explicit_step_limit;
        let step = self.ratio * limit;
        let Prepared { mut model, mut stepper, mut state, .. } = self.prepared(text, step)?;
        let clock = Instant::now();
        let mut ledger =
            Ledger::open(&mut model, state.time, &state.values).map_err(|error| format!("initial state: {error}"))?;
        let initial = ledger.entry().total;
        let (mut lowest, mut rise) = (initial, 0.0_f64);
        let (mut ending, mut cause) = (Ending::Completed, String::new());
        while state.time < self.end {
            if let Err(failure) = stepper.advance(&mut model, &mut state, self.end) {
                (ending, cause) = (Ending::Failed, failure.to_string());
                break;
            }
            match ledger.follow(&mut model, state.time, &state.values) {
                Err(error) => (ending, cause) = (Ending::Failed, error.to_string()),
                Ok(entry) if entry.total <= GROWN * initial => {
                    lowest = lowest.min(entry.total);
                    rise = rise.max(entry.total - lowest);
                    continue;
                }
                Ok(_) => {
                    (ending, cause) = (Ending::Grown, format!("the energy grew to {GROWN} times that at the start"))
                }
            }
            break;
        }
        let statistics = stepper.statistics();
        let summary = ledger.summary();
        Ok(Outcome {
            case: self.clone(),
            step,
            ending,
            time: state.time,
            steps: statistics.accepted,
            iterations: statistics.newton_iterations,
            drift: summary.drift,
            rise: rise / initial,
            ledger: summary.ledger_error,
            remaining: summary.totals.1 / initial,
            seconds: clock.elapsed().as_secs_f64(),
            cause,
        })
    }

    fn prepared(&self, text: &str, step: f64) -> Result<Prepared<2>, String> {
        let overrides = [
            ("time.scheme", format!("\"{}\"", self.scheme)),
            ("time.end", format!("{:e}", self.end)),
            ("time.step", format!("{step:e}")),
            ("time.minimum_step", format!("{step:e}")),
            ("stabilisation.tau_v", format!("{:e}", self.upwinding)),
            // As document 004; limited states dissipate next to nothing where the flow is smooth.
            ("stabilisation.interface", "constant".to_owned()),
        ];
        scenes::prepared::<2>(text, &self.scene, overrides)
    }
}
