//! The groups of entries of `report.json`.

use serde::{Deserialize, Deserializer, Serialize};

/// How a run ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// The final time was reached.
    Completed,
    /// The run stopped because something could not be computed or written.
    #[default]
    Failed,
    /// The user stopped the run.
    Interrupted,
}

/// Time steps.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Steps {
    /// Steps that advanced the time.
    pub accepted: usize,
    /// Steps that were tried and thrown away.
    pub rejected: usize,
}

/// Work of Newton's method, summed over the run (zeros for explicit schemes).
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NewtonWork {
    /// Nonlinear systems that were attacked.
    pub solves: usize,
    /// Nonlinear systems that were given up.
    pub failures: usize,
    /// Newton iterations.
    pub iterations: usize,
    /// Evaluations of the residual, including those of the globalisation.
    pub residual_evaluations: usize,
    /// Evaluations of the tangent.
    pub linearisations: usize,
}

/// Work of the linear solver, summed over the run.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinearWork {
    /// Solver in words; empty if none was needed.
    pub solver: String,
    /// Why `linear.solver = "auto"` chose it; empty for a solver that was named.
    pub reason: String,
    /// Symbolic analyses.
    pub analyses: usize,
    /// Numeric factorisations.
    pub factorisations: usize,
    /// Right-hand sides.
    pub solves: usize,
    /// Iterations of an iterative method or of refinement.
    pub iterations: usize,
    /// Stored entries of the factor or preconditioner.
    pub fill: usize,
}

/// What balancing the gradient weights of a body took.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BalanceWork {
    /// Name of the body.
    pub body: String,
    /// Whether its weights are balanced.
    pub balanced: bool,
    /// Whether by its cells, without equations.
    pub cells: bool,
    /// Why not; empty if they are.
    pub note: String,
    /// Particles that missed a condition before.
    pub missed: usize,
    /// Particles that took part.
    pub band: usize,
    /// Unknowns of the equations, per direction.
    pub unknowns: usize,
    /// Iterations.
    pub iterations: usize,
    /// Largest residual of a condition, in units of a particle's face.
    #[serde(deserialize_with = "number_or_null")]
    pub residual: f64,
    /// Largest change of a weight over the largest weight.
    #[serde(deserialize_with = "number_or_null")]
    pub largest_change: f64,
    /// Wall-clock time in s.
    #[serde(deserialize_with = "number_or_null")]
    pub seconds: f64,
}

/// Wall-clock time in s by what it was spent on.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WallSeconds {
    /// Building the discrete model.
    #[serde(deserialize_with = "number_or_null")]
    pub setup: f64,
    /// Evaluations of rates and residuals.
    #[serde(deserialize_with = "number_or_null")]
    pub rate: f64,
    /// Tangents and their sparse entries.
    #[serde(deserialize_with = "number_or_null")]
    pub assembly: f64,
    /// Factorisations and preconditioners.
    #[serde(deserialize_with = "number_or_null")]
    pub factorisation: f64,
    /// Linear solves.
    #[serde(deserialize_with = "number_or_null")]
    pub solve: f64,
    /// The rest of the steps: states of stages, starts of iterations, line searches, estimates of errors and of the
    /// stable step.
    #[serde(deserialize_with = "number_or_null")]
    pub integration: f64,
    /// Energies and momenta after every step.
    #[serde(deserialize_with = "number_or_null")]
    pub ledger: f64,
    /// Derived fields and files.
    #[serde(deserialize_with = "number_or_null")]
    pub output: f64,
    /// What none of these clocks saw: whoever listens to the run.
    #[serde(deserialize_with = "number_or_null")]
    pub other: f64,
    /// Everything.
    #[serde(deserialize_with = "number_or_null")]
    pub total: f64,
}

impl WallSeconds {
    /// The sum of two parts of a run.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            setup: self.setup + other.setup,
            rate: self.rate + other.rate,
            assembly: self.assembly + other.assembly,
            factorisation: self.factorisation + other.factorisation,
            solve: self.solve + other.solve,
            integration: self.integration + other.integration,
            ledger: self.ledger + other.ledger,
            output: self.output + other.output,
            other: self.other + other.other,
            total: self.total + other.total,
        }
    }

    /// The parts with their names, which add up to the total.
    pub fn parts(&self) -> [(&'static str, f64); 9] {
        [
            ("set-up", self.setup),
            ("rates", self.rate),
            ("assembly", self.assembly),
            ("factorisation", self.factorisation),
            ("linear solves", self.solve),
            ("integration", self.integration),
            ("ledger", self.ledger),
            ("output", self.output),
            ("other", self.other),
        ]
    }
}

/// What a run spent most of its time on, and what would help.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bottleneck {
    /// Name of the part, as in [`WallSeconds::parts`].
    pub part: String,
    /// Its share of the total.
    #[serde(deserialize_with = "number_or_null")]
    pub share: f64,
    /// What would help.
    pub hint: String,
}

/// Energy budget in J (J/m in 2D, J/m² in 1D).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnergyBudget {
    /// Kinetic plus internal plus hourglass energy, less the work of loads and moving constraints (zero then), at
    /// the start.
    #[serde(deserialize_with = "number_or_null")]
    pub initial: f64,
    /// Kinetic plus internal plus hourglass energy, less the work of loads and moving constraints, at the end.
    #[serde(deserialize_with = "number_or_null")]
    pub r#final: f64,
    /// Largest change of the total energy over its scale; `None` where that has no meaning.
    pub max_relative_drift: Option<f64>,
    /// Energy that was dissipated.
    #[serde(deserialize_with = "number_or_null")]
    pub dissipated: f64,
    /// What the ledger (change of energy + dissipation − work) fails to explain; `None` without a ledger.
    pub ledger_error: Option<f64>,
    /// Largest energy of the hourglass control over the largest internal energy; `None` without control or history.
    pub hourglass_max_fraction: Option<f64>,
}

/// Distance from an exact solution.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorNorms {
    /// Volume-weighted mean of the absolute error.
    #[serde(deserialize_with = "number_or_null")]
    pub l1: f64,
    /// Volume-weighted root mean square.
    #[serde(deserialize_with = "number_or_null")]
    pub l2: f64,
    /// Largest absolute error.
    #[serde(deserialize_with = "number_or_null")]
    pub linf: f64,
}

/// Final state of a probe; one entry per space dimension.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeState {
    /// Displacement in m.
    #[serde(deserialize_with = "numbers_or_null")]
    pub displacement: Vec<f64>,
    /// Velocity in m/s.
    #[serde(deserialize_with = "numbers_or_null")]
    pub velocity: Vec<f64>,
    /// Current position in m.
    #[serde(deserialize_with = "numbers_or_null")]
    pub position: Vec<f64>,
}

/// What is needed to repeat the run.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Version of this package.
    pub version: String,
    /// Commit it was built from; empty if unknown.
    pub commit: String,
    /// Threads used (the results do not depend on it).
    pub threads: usize,
    /// The scene file as text, with overrides applied.
    pub scene: String,
    /// The command line.
    pub command: String,
    /// The checkpoint that the last part of the run started from; empty for a run in one piece.
    #[serde(default)]
    pub parent_checkpoint: String,
}

/// Reads `null` as NaN, which is what was meant when it was written.
pub(super) fn number_or_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// [`number_or_null`] for lists.
fn numbers_or_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let numbers: Vec<Option<f64>> = Vec::deserialize(deserializer)?;
    Ok(numbers.into_iter().map(|number| number.unwrap_or(f64::NAN)).collect())
}
