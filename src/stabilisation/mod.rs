//! Upwind (Riemann) stabilisation and hourglass control; built only for scenes that ask for them.

mod hourglass;
mod upwind;

pub use hourglass::{DEFAULT_HOURGLASS, DEFAULT_HOURGLASS_UNBALANCED, Hourglass, default_hourglass};
pub use upwind::{Jump, PressurePair, PressureStates, Upwind, VelocityPair};
