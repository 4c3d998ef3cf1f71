//! Which numbers an implicit stage solves for, and where they sit in the vector of unknowns.
//!
//! All unknowns are measured as velocities, so that one norm serves the mixed system: J as `c⁰ J`, a
//! displacement as `u/s` with the stage's shift s. Residuals are momenta: `m` times the residual of
//! the scaled unknown.

use crate::setup::{Constraint, Setup};

/// Unknowns of an implicit stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknowns {
    /// Velocities only; u and J are eliminated. Needs τ_p = 0.
    Velocity,
    /// Velocities and volume ratios; u is eliminated.
    VelocityJacobian,
    /// Velocities, volume ratios and displacements: (4.6) as printed.
    Full,
}

/// Marks a component that is not an unknown.
const NONE: u32 = u32::MAX;

/// Positions of the unknowns: particle after particle, within a particle the free velocity
/// components, then J, then the free displacement components.
#[derive(Debug, Clone)]
pub struct Numbering {
    kind: Unknowns,
    dimension: usize,
    /// First unknown of every particle, and the number of unknowns.
    starts: Vec<usize>,
    /// Unknown of every velocity component, or [`NONE`].
    velocity: Vec<u32>,
}

impl Numbering {
    /// Numbers the unknowns of a set-up.
    pub fn new<const D: usize>(kind: Unknowns, setup: &Setup<D>) -> Self {
        let mut starts = Vec::with_capacity(setup.constraints.len() + 1);
        let mut velocity = Vec::with_capacity(setup.constraints.len() * D);
        let mut next = 0usize;
        for constraints in &setup.constraints {
            starts.push(next);
            let mut free = 0;
            for constraint in constraints {
                if *constraint == Constraint::Free {
                    velocity.push((next + free) as u32);
                    free += 1;
                } else {
                    velocity.push(NONE);
                }
            }
            next += match kind {
                Unknowns::Velocity => free,
                Unknowns::VelocityJacobian => free + 1,
                Unknowns::Full => 2 * free + 1,
            };
        }
        starts.push(next);
        Self { kind, dimension: D, starts, velocity }
    }

    /// Kind of unknowns.
    pub fn kind(&self) -> Unknowns {
        self.kind
    }

    /// Number of unknowns.
    pub fn count(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }

    /// First unknown of every particle, and the number of unknowns.
    pub fn starts(&self) -> &[usize] {
        &self.starts
    }

    /// Unknowns of a particle.
    pub fn of(&self, particle: usize) -> std::ops::Range<usize> {
        self.starts[particle]..self.starts[particle + 1]
    }

    /// Unknown of a velocity component, if it is free.
    #[inline]
    pub fn velocity(&self, particle: usize, component: usize) -> Option<usize> {
        let unknown = self.velocity[particle * self.dimension + component];
        (unknown != NONE).then_some(unknown as usize)
    }

    /// Number of free components of a particle.
    pub fn free(&self, particle: usize) -> usize {
        let own = self.starts[particle + 1] - self.starts[particle];
        match self.kind {
            Unknowns::Velocity => own,
            Unknowns::VelocityJacobian => own - 1,
            Unknowns::Full => (own - 1) / 2,
        }
    }

    /// Unknown of the volume ratio, if it is one.
    pub fn volume_ratio(&self, particle: usize) -> Option<usize> {
        (self.kind != Unknowns::Velocity).then(|| self.starts[particle] + self.free(particle))
    }

    /// Unknown of a displacement component, if it is one.
    pub fn displacement(&self, particle: usize, component: usize) -> Option<usize> {
        let velocity = self.velocity(particle, component)?;
        (self.kind == Unknowns::Full).then(|| velocity + self.free(particle) + 1)
    }

    /// The particle that an unknown belongs to.
    pub fn particle_of(&self, unknown: usize) -> usize {
        self.starts.partition_point(|&start| start <= unknown) - 1
    }

    /// Field and component of an unknown, in words.
    pub fn describe(&self, unknown: usize) -> String {
        let particle = self.particle_of(unknown);
        let axis = |component: usize| ["x", "y", "z"][component];
        for component in 0..self.dimension {
            if self.velocity(particle, component) == Some(unknown) {
                return format!("velocity {}", axis(component));
            }
            if self.displacement(particle, component) == Some(unknown) {
                return format!("displacement {}", axis(component));
            }
        }
        "volume ratio J".into()
    }
}
