//! Why a body could not be balanced, and what to do about it.

use super::super::{DiscretisationError, describe_particle};
use crate::setup::{Body, Particles};

/// Why weights could not be found.
pub(super) enum Failure {
    /// The conditions of a particle stay off by this part of their size.
    Infeasible { particle: usize, residual: f64 },
    /// The equations have more unknowns than a factorisation can bear.
    TooLarge { unknowns: usize, largest: usize },
    /// The equations could not be solved.
    Solver(String),
    /// Cells do not give the weights.
    NoCells(&'static str),
}

impl Failure {
    pub(super) fn located<const D: usize>(self, body: &Body, particles: &Particles<D>) -> DiscretisationError {
        match self {
            Self::Infeasible { particle, residual } => {
                let a = particle + body.particles.start;
                DiscretisationError {
                    place: describe_particle(a, &particles.positions[a]),
                    reason: format!(
                        "no weights on the {:.2} spacings that `smoothing` = {} reaches balance constant and linear \
                         stress with these volumes (off by {residual:.1e})",
                        crate::kernel::support(body.kernel) * body.smoothing,
                        body.smoothing
                    ),
                    remedy:
                        "raise `smoothing` (layout = \"cell\" needs 1.2), use layout = \"vertex\" with volumes that \
                             fit the boundary, or weights = \"separate\""
                            .into(),
                }
            }
            Self::TooLarge { unknowns, largest } => DiscretisationError {
                place: format!("body `{}`", body.name),
                reason: format!("balancing its weights takes {unknowns} unknowns, more than {largest}"),
                remedy:
                    "use a box, bent or not, with layout = \"vertex\" and weights = \"cells\" or \"auto\", which solve \
                         no equations; or volumes = \"stencil\", or weights = \"separate\""
                        .into(),
            },
            Self::NoCells(reason) => DiscretisationError {
                place: format!("body `{}`", body.name),
                reason: format!("its weights cannot be those of cells: {reason}"),
                remedy: "use a box, bent or not, with layout = \"vertex\" and volumes = \"cells\", or \
                         weights = \"balanced\""
                    .into(),
            },
            Self::Solver(reason) => DiscretisationError {
                place: format!("body `{}`", body.name),
                reason: format!("the equations of the balanced weights could not be solved: {reason}"),
                remedy: "use weights = \"separate\"".into(),
            },
        }
    }
}
