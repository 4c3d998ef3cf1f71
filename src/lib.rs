//! Implicit-first Total Lagrangian SPH.

pub mod expression;
pub mod setup;
