//! Implicit-first Total Lagrangian SPH.

pub mod discretisation;
pub mod expression;
pub mod kernel;
pub mod material;
pub mod model;
pub mod setup;
pub mod stabilisation;
pub mod tensor;
