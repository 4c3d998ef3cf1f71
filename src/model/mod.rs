//! The semi-discrete system: everything between a validated [`Setup`] and the traits of
//! `nicolson-solvers`.
//!
//! State: `[u | v | J]`, displacements, velocities and volume ratios of all particles, flat and
//! particle-major. Displacements instead of positions keep the digits of small deformations. The
//! equations (formulation, section 1), with gradient weights `g_ab` and quadrature volumes V:
//!
//! ```text
//! F_a = I + Σ_b u_b ⊗ g_ab          L_a = Σ_b v_b ⊗ g_ab
//! m_a v̇_a = −Σ_b V_b P_b g_ba + V_a D_v,a − ∂Π/∂u_a + loads        P = −p(J) H
//! J̇_a = H_a : L_a + D_p,a
//! u̇_a = v_a
//! ```
//!
//! Where D_p does not act and nobody asks for it, J is not evolved: `J_a = det F_a + const.` (`volume`).
//!
//! | file | purpose |
//! |---|---|
//! | `law` | the law at one particle |
//! | `evaluation` | the two sweeps that give forces and rates |
//! | `rate` | explicit rates of scenes without pair terms, block by block |
//! | `hourglass` | the control's forces and entries |
//! | `volume` | where the volume ratio comes from |
//! | `point` | where the equations were linearised, for restarts |
//! | `unknowns` | which numbers an implicit stage solves for |
//! | `stage`, `residual` | `u = ũ + s f(t, u)`: what time schemes ask of it, and the nonlinear problem |
//! | `conserving` | the discrete-gradient step that conserves energy |
//! | `linearisation`, `stress_tangents` | derivatives of every term |
//! | `action` | the tangent as an operator without entries |
//! | `diagonal`, `projection` | material for preconditioners without entries |
//! | `slots`, `rows`, `assembly` | the tangent's fixed pattern, one row of its blocks, and all its entries |
//! | `symmetry` | which terms of the tangent are symmetric |
//! | `balance` | energies, dissipation, momenta |
//! | `jacobian` | public checks of all derivatives |

mod action;
mod assembly;
mod balance;
mod build;
mod conserving;
mod diagonal;
mod evaluation;
mod hourglass;
mod jacobian;
mod law;
mod linearisation;
mod loads;
mod one_sweep;
mod point;
mod projection;
mod rate;
mod residual;
mod rows;
mod slots;
mod stage;
mod stress_tangents;
mod symmetry;
mod unknowns;
mod volume;

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use nicolson_solvers::EvaluationError;

pub use balance::Energies;
pub use build::ModelError;
pub use jacobian::{BlockTaylor, CheckPoint, DifferenceReport, Noise, TaylorReport, TaylorRow, WorstEntry};

pub use loads::Ramp;
pub use symmetry::{Declared, Problem};
pub use unknowns::Unknowns;

use crate::discretisation::{Gradient, describe_particle};
use crate::material::Material;
use crate::setup::{CofactorChoice, Setup};
use crate::stabilisation::{Hourglass, Upwind};
use crate::tensor::Vector;
use evaluation::Workspace;
use linearisation::Linearisation;
use loads::Loads;
use stage::Stage;

/// Which terms of the equations are evaluated; all of them, except in checks of single terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Terms {
    /// Stress divergence.
    pub stress: bool,
    /// Rate of J by the velocity gradient.
    pub volume_rate: bool,
    /// D_v.
    pub velocity_upwind: bool,
    /// D_p.
    pub pressure_upwind: bool,
    /// Hourglass control.
    pub hourglass: bool,
}

impl Terms {
    /// Every term.
    pub const ALL: Self =
        Self { stress: true, volume_rate: true, velocity_upwind: true, pressure_upwind: true, hourglass: true };
    /// No term.
    pub const NONE: Self =
        Self { stress: false, volume_rate: false, velocity_upwind: false, pressure_upwind: false, hourglass: false };
}

/// Time spent in the parts of a model, for the breakdown of a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct ModelTimes {
    /// Forces and rates, residuals included.
    pub rate: Duration,
    /// Linearisation and entries of the tangent.
    pub assembly: Duration,
}

/// Running totals behind [`ModelTimes`], nanoseconds; atomic because the tangent is shared.
#[derive(Debug, Default)]
struct Clocks {
    rate: AtomicU64,
    linearisation: AtomicU64,
    fill: AtomicU64,
}

impl Clocks {
    fn add(clock: &AtomicU64, start: Instant) {
        clock.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
    }

    fn read(&self) -> ModelTimes {
        let duration = |clock: &AtomicU64| Duration::from_nanos(clock.load(Ordering::Relaxed));
        ModelTimes { rate: duration(&self.rate), assembly: duration(&self.linearisation) + duration(&self.fill) }
    }
}

/// The semi-discrete system of one set-up.
pub struct Model<const D: usize> {
    setup: Setup<D>,
    gradient: Gradient<D>,
    upwind: Option<Upwind<D>>,
    hourglass: Option<Hourglass<D>>,
    /// Law and cofactor of each particle's body, by body.
    materials: Vec<(Material, CofactorChoice)>,
    /// Whether J is evolved, by body.
    evolved: Vec<bool>,
    /// Constants by which J follows det F; empty if J starts as det F everywhere.
    volume_constants: Vec<f64>,
    body_of: Vec<u32>,
    masses: Vec<f64>,
    /// `Σ_b |g_ab|`, 1/m: the size of a gradient's summands.
    reach: Vec<f64>,
    smallest_distance: f64,
    cfl: f64,
    unknowns: unknowns::Numbering,
    loads: Loads<D>,
    terms: Terms,
    linear: bool,
    /// Whether any law depends on the rate of strain.
    viscous: bool,
    workspace: Workspace<D>,
    rates: rate::RateSpace<D>,
    stage: Stage<D>,
    linearisation: Linearisation<D>,
    /// Whether points of linearisation are kept in mind.
    keeps_points: bool,
    clocks: Clocks,
}

impl<const D: usize> Model<D> {
    /// The set-up that the model was built from.
    pub fn setup(&self) -> &Setup<D> {
        &self.setup
    }

    /// The gradient operator.
    pub fn gradient(&self) -> &Gradient<D> {
        &self.gradient
    }

    /// The stabilisation, if the scene has any.
    pub fn upwind(&self) -> Option<&Upwind<D>> {
        self.upwind.as_ref()
    }

    /// Number of particles.
    pub fn particles(&self) -> usize {
        self.masses.len()
    }

    /// Masses, kg (per thickness in 2D, per area in 1D).
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Law of a particle.
    pub fn material(&self, particle: usize) -> &Material {
        &self.materials[self.body_of[particle] as usize].0
    }

    fn cofactor_choice(&self, particle: usize) -> CofactorChoice {
        self.materials[self.body_of[particle] as usize].1
    }

    /// Smallest distance of two neighbours, m.
    pub fn smallest_distance(&self) -> f64 {
        self.smallest_distance
    }

    /// Number of unknowns of an implicit stage.
    pub fn unknown_count(&self) -> usize {
        self.unknowns.count()
    }

    /// Which numbers an implicit stage solves for.
    pub fn unknowns(&self) -> Unknowns {
        self.unknowns.kind()
    }

    /// Whether the equations are linear in the state, by the structure of the scene.
    pub fn is_linear(&self) -> bool {
        self.linear
    }

    /// Takes the caller's word that the equations are linear, or are to be treated as if they were not.
    pub fn declare_linear(&mut self, linear: bool) {
        self.linear = linear;
    }

    /// Whether the pattern of the tangent has been built; an explicit run never needs it.
    pub fn has_pattern(&self) -> bool {
        self.linearisation.slots.get().is_some()
    }

    /// Stored entries of the tangent.
    pub fn pattern_entries(&self) -> usize {
        self.slots().pattern().entries()
    }

    /// Seconds spent writing the tangent's entries.
    pub fn fill_seconds(&self) -> f64 {
        self.clocks.fill.load(Ordering::Relaxed) as f64 * 1e-9
    }

    /// Time spent so far.
    pub fn times(&self) -> ModelTimes {
        self.clocks.read()
    }

    /// Lets all loads grow in proportion to the time, or no longer.
    pub fn set_ramp(&mut self, ramp: Option<Ramp>) {
        self.loads.set_ramp(ramp);
        self.stage.evaluated.clear();
    }

    /// Restricts the evaluation to some terms (for checks of single terms).
    pub fn select_terms(&mut self, terms: Terms) {
        self.terms = terms;
        self.linear = self.linear && terms == Terms::ALL;
        self.forget_linearisation();
    }

    /// Forgets the derivatives of a point: linear equations would keep those of other terms.
    pub(crate) fn forget_linearisation(&mut self) {
        self.linearisation.taken = false;
    }

    /// A particle in words.
    pub fn describe_particle(&self, particle: usize) -> String {
        describe_particle(particle, &self.setup.particles.positions[particle])
    }

    /// Displacements of a state.
    pub fn displacements<'a>(&self, state: &'a [f64]) -> &'a [f64] {
        &state[..self.particles() * D]
    }

    /// Velocities of a state.
    pub fn velocities_of<'a>(&self, state: &'a [f64]) -> &'a [f64] {
        &state[self.particles() * D..2 * self.particles() * D]
    }

    /// Current position of a particle.
    pub fn position(&self, state: &[f64], particle: usize) -> Vector<D> {
        self.setup.particles.positions[particle] + crate::tensor::vector_at::<D>(state, particle)
    }

    fn located(&self, error: EvaluationError) -> EvaluationError {
        let place = self.describe_particle(error.site);
        error.at(place)
    }
}
