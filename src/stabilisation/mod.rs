//! Upwind (Riemann) stabilisation; built only for scenes that ask for it.

mod upwind;

pub use upwind::{PressurePair, Upwind, VelocityPair};
