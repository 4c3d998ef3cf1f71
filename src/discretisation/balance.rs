//! Balanced weights.
use super::{DiscretisationError, Gradient};
use crate::setup::{Body, Particles};
pub fn balance<const D: usize>(
    _gradient: &mut Gradient<D>,
    _body: &Body,
    _particles: &Particles<D>,
) -> Result<(), DiscretisationError> {
    Ok(())
}
