//! Upwind (Riemann) stabilisation and hourglass control; built only for scenes that ask for them.

mod hourglass;
mod upwind;

pub use hourglass::{DEFAULT_HOURGLASS, Hourglass};
pub use upwind::{Jump, PressurePair, PressureStates, Upwind, VelocityPair};
