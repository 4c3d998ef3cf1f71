//! Implicit-first Total Lagrangian SPH.

pub mod expression;
pub mod geometry;
pub mod scene;
pub mod setup;
