//! Watching a solve while it runs.

use std::ops::ControlFlow;

use super::report::{IterationRecord, NewtonFailure, NewtonReport};

/// Receives every point of a solve as it is reached, and may stop it.
///
/// The library prints nothing; a monitor may.
pub trait NewtonMonitor: Send {
    /// The start (record 0) or the point after an iteration. [`ControlFlow::Break`] ends the solve with
    /// [`NewtonCause::Stopped`](super::NewtonCause::Stopped).
    fn point(&mut self, record: &IterationRecord) -> ControlFlow<()>;

    /// The solve has ended.
    fn finished(&mut self, outcome: Result<&NewtonReport, &NewtonFailure>) {
        let _ = outcome;
    }
}
