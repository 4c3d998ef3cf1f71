//! From a cloud of particles to the one table that the equations need.
//!
//! [`Neighbourhood`] finds, once per run, who interacts with whom; `gradient` turns kernel and
//! volumes into gradient weights `g_ab`, such that for any field
//!
//! ```text
//! (∇f)_a = Σ_b f_b ⊗ g_ab        exactly, if f is linear
//! ```
//!
//! In the Total Lagrangian description these never change: kernel, smoothing length and search do
//! not appear in any step. The force uses the transposed weights `g_ba`, found through
//! [`Neighbourhood::twin`], which is what conserves momentum and makes tangents symmetric.

mod balance;
mod correction;
mod gradient;
mod neighbours;
mod stencils;
mod weights;

pub use balance::BalanceReport;
pub(crate) use balance::face_shares;
pub use correction::{KernelCorrection, least_squares_weights};
pub use gradient::{BLOCK, Columns, Gradient, plain_slope};
pub use neighbours::Neighbourhood;
pub use weights::Weights;

/// Why a cloud cannot be discretised: where, why, and what helps.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{place}: {reason}; {remedy}")]
pub struct DiscretisationError {
    /// The particle, in words.
    pub place: String,
    /// What is wrong.
    pub reason: String,
    /// What to do.
    pub remedy: String,
}

/// A particle in words: its number and reference position.
pub fn describe_particle<const D: usize>(index: usize, position: &crate::tensor::Vector<D>) -> String {
    let coordinates: Vec<String> = position.iter().map(|x| format!("{x:.6}")).collect();
    format!("particle {index} at ({})", coordinates.join(", "))
}
