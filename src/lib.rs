//! Implicit-first Total Lagrangian SPH.

pub mod cli;
pub mod discretisation;
pub mod expression;
pub mod geometry;
pub mod kernel;
pub mod material;
pub mod model;
pub mod output;
pub mod scene;
pub mod setup;
pub mod simulation;
pub mod stabilisation;
pub mod tensor;
