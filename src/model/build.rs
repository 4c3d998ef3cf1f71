//! From a set-up to a model: everything that happens once per run.

use nicolson_solvers::time::System;

use super::evaluation::Workspace;
use super::linearisation::Linearisation;
use super::loads::Loads;
use super::rate::RateSpace;
use super::stage::Stage;
use super::unknowns::{Numbering, Unknowns};
use super::{Clocks, Model, Terms, volume};
use crate::discretisation::{DiscretisationError, Gradient, describe_particle};
use crate::material::Material;
use crate::setup::{Body, CofactorChoice, Constraint, InterfaceChoice, Setup, VolumeRatioChoice, WeightChoice};
use crate::stabilisation::{Hourglass, Upwind, default_hourglass};
use crate::tensor::{Tensor, determinant};

/// Why a set-up cannot become a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The cloud of particles cannot be discretised.
    #[error(transparent)]
    Discretisation(#[from] DiscretisationError),
    /// The initial state is impossible.
    #[error("initial state: {place}: {reason}; {remedy}")]
    InitialState {
        /// The particle, in words.
        place: String,
        /// What is wrong.
        reason: String,
        /// What to do.
        remedy: String,
    },
    /// The chosen unknowns do not suit the scene.
    #[error(
        "unknowns = \"velocity\" needs tau_p = 0: with D_p the volume ratios are coupled; use \"velocity_jacobian\" or \"auto\""
    )]
    UnknownsNeedJacobian,
    /// A volume ratio that follows the determinant, where it cannot.
    #[error(
        "body '{body}': volume_ratio = \"determinant\" needs tau_p = 0 and unknowns = \"velocity\"; use \"evolved\" or \"auto\""
    )]
    VolumeRatioIsCoupled {
        /// Name of the body.
        body: String,
    },
}

/// CFL factor of document 004, used where a scene gives none.
pub const DEFAULT_CFL: f64 = 0.3;

impl<const D: usize> Model<D> {
    /// Discretises a set-up. `unknowns: None` chooses the smallest system that is exact: velocities,
    /// or velocities and volume ratios where D_p couples the latter.
    ///
    /// # Errors
    /// [`ModelError`], located.
    pub fn new(mut setup: Setup<D>, unknowns: Option<Unknowns>, cfl: Option<f64>) -> Result<Self, ModelError> {
        let count = setup.particles.positions.len();
        let mut body_of = vec![0u32; count];
        for (index, body) in setup.bodies.iter().enumerate() {
            body_of[body.particles.clone()].fill(index as u32);
        }
        // Where nothing reads the evolved J, its cofactor would only bring in its drift.
        let cofactor = |body: &Body| match body.material.evolves_volume() {
            true => body.cofactor,
            false => CofactorChoice::Geometric,
        };
        let materials: Vec<(Material, CofactorChoice)> =
            setup.bodies.iter().map(|body| (body.material, cofactor(body))).collect();
        let laws: Vec<&Material> = body_of.iter().map(|&body| &materials[body as usize].0).collect();
        let coupled = setup.stabilisation.is_some_and(|s| s.tau_p != 0.0);
        let unknowns = match unknowns {
            None if coupled => Unknowns::VelocityJacobian,
            None => Unknowns::Velocity,
            Some(Unknowns::Velocity) if coupled => return Err(ModelError::UnknownsNeedJacobian),
            Some(kind) => kind,
        };
        if let Some(body) = setup.bodies.iter().find(|body| body.volume_ratio == VolumeRatioChoice::Determinant)
            && (coupled || unknowns != Unknowns::Velocity)
        {
            return Err(ModelError::VolumeRatioIsCoupled { body: body.name.clone() });
        }
        let evolved = setup.bodies.iter().map(|body| volume::is_evolved(body, unknowns, coupled)).collect();
        let masses: Vec<f64> = setup.particles.volumes.iter().zip(&laws).map(|(v, law)| v * law.density).collect();

        let gradient = Gradient::build(&setup.bodies, &setup.particles)?;
        // Only now it is known which bodies could be balanced; those that asked for it have a report.
        let mut reports = gradient.balance.iter();
        for body in &mut setup.bodies {
            let asked = !matches!(body.weights, WeightChoice::Separate | WeightChoice::Single);
            let balanced = asked && reports.next().is_some_and(|report| report.balanced);
            body.hourglass.get_or_insert(default_hourglass(&body.material, balanced));
        }
        let upwind = match setup.stabilisation.filter(|s| s.tau_v != 0.0 || s.tau_p != 0.0) {
            None => None,
            Some(options) => Some(Upwind::build(options, &setup.bodies, &setup.particles, &gradient, &laws)?),
        };
        let moduli: Vec<f64> = laws.iter().map(|law| law.hourglass_modulus()).collect();
        let hourglass = Hourglass::build(&setup.bodies, &setup.particles, &gradient.neighbourhood, &moduli, &masses);
        let neighbourhood = &gradient.neighbourhood;
        let reach = (0..count).map(|a| gradient.weights_of(a).iter().map(|weight| weight.norm()).sum()).collect();
        let positions = &setup.particles.positions;
        let smallest_distance = (0..count)
            .flat_map(|a| neighbourhood.of(a).iter().map(move |&b| (a, b as usize)))
            .filter(|(a, b)| a != b)
            .map(|(a, b)| (positions[b] - positions[a]).norm())
            .fold(f64::INFINITY, f64::min);
        let reconstructed = upwind.as_ref().is_some_and(|u| u.options.interface.reconstructs());
        let loads = Loads::new(&setup, &gradient.neighbourhood, &masses)?;
        let mut model = Self {
            unknowns: Numbering::new(unknowns, &setup),
            loads,
            workspace: Workspace::new(count, upwind.is_some(), reconstructed, hourglass.is_some()),
            viscous: materials.iter().any(|(law, _)| law.viscosity.is_some()),
            rates: RateSpace::new(&setup),
            stage: Stage::default(),
            linearisation: Linearisation::default(),
            keeps_points: false,
            linear: false,
            terms: Terms::ALL,
            cfl: cfl.unwrap_or(DEFAULT_CFL),
            clocks: Clocks::default(),
            setup,
            gradient,
            upwind,
            hourglass,
            materials,
            evolved,
            volume_constants: Vec::new(),
            body_of,
            masses,
            reach,
            smallest_distance,
        };
        model.linear = model.structurally_linear();
        Ok(model)
    }

    /// State at `t = 0`. The volume ratio starts from the initial pressure where there is one, and as
    /// `det F` otherwise.
    ///
    /// # Errors
    /// A pressure that the law cannot reach, or an initial state outside the law's domain.
    pub fn initial_state(&mut self) -> Result<Vec<f64>, ModelError> {
        let count = self.particles();
        let mut state = vec![0.0; count * (2 * D + 1)];
        for a in 0..count {
            for i in 0..D {
                state[a * D + i] = self.setup.initial.displacement[a][i];
                state[(count + a) * D + i] = self.setup.initial.velocity[a][i];
            }
        }
        self.impose(0.0, &mut state);
        let mut constants = Vec::with_capacity(count);
        for a in 0..count {
            let place = || describe_particle(a, &self.setup.particles.positions[a]);
            let material = self.material(a);
            let det = determinant(&(Tensor::identity() + self.gradient.of(a, &state)));
            let ratio = match &self.setup.initial.pressure {
                Some(pressure) if material.evolves_volume() => {
                    material.volume_ratio_at(pressure[a]).ok_or_else(|| ModelError::InitialState {
                        place: place(),
                        reason: format!("the law cannot reach a pressure of {:e} Pa", pressure[a]),
                        remedy: "the largest tension is the bulk modulus; reduce the initial pressure's magnitude"
                            .into(),
                    })?
                }
                _ => det,
            };
            if (material.needs_positive_ratio() && ratio <= 0.0)
                || (material.needs_positive_determinant() && det <= 0.0)
            {
                return Err(ModelError::InitialState {
                    place: place(),
                    reason: format!("volume ratio {ratio:e} and det F = {det:e} must be positive"),
                    remedy: "reduce the initial displacement".into(),
                });
            }
            state[2 * count * D + a] = ratio;
            constants.push(self.volume_constant(a, ratio, det).unwrap_or(1.0));
        }
        let prestressed = self.setup.initial.pressure.is_some() && self.evolved.contains(&false);
        self.volume_constants = if prestressed { constants } else { Vec::new() };
        Ok(state)
    }

    /// Whether the equations are linear by structure: a linear law with the geometric cofactor, in
    /// one dimension, or with all but one direction of motion held still everywhere (H is then
    /// constant along the motion), and no upwinding along a direction that turns, with a speed that
    /// changes or with a limiter. Linear elasticity is linear in every dimension.
    pub(super) fn structurally_linear(&self) -> bool {
        let laws =
            self.materials.iter().all(|(law, cofactor)| law.is_linear() && *cofactor == CofactorChoice::Geometric);
        if !laws {
            return false;
        }
        if self.materials.iter().all(|(law, _)| !law.evolves_volume()) {
            // P is linear in F in any dimension; an evolved J would not be.
            return self.upwind.is_none() && self.unknowns.kind() == Unknowns::Velocity;
        }
        let steady_upwind = self.upwind.as_ref().is_none_or(|u| {
            D == 1 && !u.options.deformed_wave_speed && u.options.interface != InterfaceChoice::Limited
        });
        let still = |component: usize| {
            self.setup
                .constraints
                .iter()
                .zip(&self.setup.initial.displacement)
                .all(|(constraint, u)| constraint[component] == Constraint::Fixed && u[component] == 0.0)
        };
        let moving = (0..D).filter(|&i| !still(i)).count();
        steady_upwind && (D == 1 || moving <= 1)
    }
}
