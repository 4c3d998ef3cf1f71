//! How large a scene will be, before anything of it is made.

use super::MOST_PARTICLES;

/// A body as it is planned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodySize {
    /// Particles, about.
    pub particles: f64,
    /// Radius of the kernel, spacings.
    pub reach: f64,
}

/// Why a scene is too large.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// What is wrong; empty if it is not worth a word.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

/// Whether bodies of these sizes are to be made.
pub(super) type Accept<'a> = dyn Fn(&[BodySize]) -> Result<(), Refusal> + 'a;

/// Accepts so many particles.
pub(super) fn at_most(most: usize) -> impl Fn(&[BodySize]) -> Result<(), Refusal> {
    move |bodies| {
        let total: f64 = bodies.iter().map(|body| body.particles).sum();
        if total <= most as f64 {
            return Ok(());
        }
        Err(Refusal {
            message: format!("the bodies would have {total:.3e} particles, more than {most}"),
            remedy: "give a larger spacing or smaller counts".to_owned(),
        })
    }
}

/// Particles that are soon made.
const FEW: f64 = 1e6;

/// Accepts what is soon made; more is no mistake, but is not made.
pub(super) fn few(bodies: &[BodySize]) -> Result<(), Refusal> {
    at_most(MOST_PARTICLES)(bodies)?;
    let total: f64 = bodies.iter().map(|body| body.particles).sum();
    if total <= FEW { Ok(()) } else { Err(Refusal { message: String::new(), remedy: String::new() }) }
}
