//! Linear, nonlinear and time solvers on flat `&[f64]` vectors.
//!
//! Nothing in this package knows where its equations come from. Three layers, each with one seam:
//!
//! | layer | sees | seam |
//! |---|---|---|
//! | [`linear`] | a [`Tangent`](linear::Tangent): an action, and perhaps entries on a fixed pattern | [`LinearSolver`](linear::LinearSolver) |
//! | [`nonlinear`] | a [`NonlinearProblem`](nonlinear::NonlinearProblem): residual and tangent; no time | [`NewtonSolver`](nonlinear::NewtonSolver) |
//! | [`time`] | a [`System`](time::System) `u' = f(t, u)`; a [`StageSystem`](time::StageSystem) that can pose `u = ũ + s f(t, u)`; a [`ConservingSystem`](time::ConservingSystem) that has an energy | [`Stepper`](time::Stepper) by a [`Scheme`](time::Scheme) |
//!
//! Rules that hold everywhere: a numerical failure is a value that carries its cause and history, it
//! never panics and never leaves NaN behind; the library prints nothing; the same bits come out for
//! any number of threads. faer, sprs and argmin stay behind these seams: none of their types appears
//! in a public signature.

pub mod linear;
pub mod nonlinear;
pub mod time;

mod evaluation;
pub mod snapshot;
pub mod vector;

pub use evaluation::{EvaluationError, EvaluationFailure};
pub use snapshot::{RestoreError, Snapshot};
