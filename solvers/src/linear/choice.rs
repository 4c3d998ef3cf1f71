//! The choice of a linear solver as plain data.

use super::{LinearError, LinearSolver, SparseLu};

/// Which linear solver to use, and with what settings.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub enum LinearSolverChoice {
    /// Sparse LU: any matrix with entries.
    #[default]
    Lu,
}

impl LinearSolverChoice {
    /// Checks the settings.
    ///
    /// # Errors
    /// A setting out of its range, in words.
    pub fn validate(&self) -> Result<(), LinearError> {
        match self {
            Self::Lu => Ok(()),
        }
    }

    /// Builds the solver.
    pub fn build(&self) -> Box<dyn LinearSolver> {
        match self {
            Self::Lu => Box::new(SparseLu::new()),
        }
    }
}
