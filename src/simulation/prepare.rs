//! Everything between reading a scene and its first step; also what `nicolson check` predicts.

use nicolson_solvers::nonlinear::NewtonSolver;
use nicolson_solvers::time::{Retries, Scheme, StageSystem, StepFailure, Stepper, System, TimeState};

use super::memory::{FittingSetup, fitting_setup};
use super::{RunError, amplification, choices, preload};
use crate::model::{CheckPoint, Model, Ramp};
use crate::scene::Scene;
use crate::scene::settings::{self, StepChoice};
use crate::setup::{Body, VolumeRatioChoice};

/// A scene ready for its first step.
pub struct Prepared<const D: usize> {
    /// The semi-discrete system.
    pub model: Model<D>,
    /// Scheme and step control.
    pub stepper: Stepper,
    /// Time and state.
    pub state: TimeState,
    /// Time at which the run ends, s.
    pub end: f64,
    /// Largest stable explicit step at the start, s: `α_CFL d_min / c_max` (4.3).
    pub explicit_step_limit: f64,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// How the loads of a static computation grow.
    pub ramp: Option<Ramp>,
}

/// What a run will need, as far as it can be said without running.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// Number of particles.
    pub particles: usize,
    /// Unknowns of an implicit step; 0 for an explicit scheme.
    pub unknowns: usize,
    /// Stored entries of the tangent; 0 for an explicit scheme.
    pub entries: usize,
    /// Neighbours of a particle on average, itself included.
    pub mean_neighbours: f64,
    /// Memory, bytes: tables, state, tangent and an estimate of its factor.
    pub memory: f64,
    /// Largest stable explicit step at the start, s.
    pub explicit_step_limit: f64,
    /// Step of the scene, s.
    pub step: f64,
    /// Steps to the end at that step.
    pub steps: f64,
    /// Whether the equations are linear: one factorisation serves the whole run.
    pub linear: bool,
}

/// What memory is taken for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counts {
    pub particles: f64,
    /// Entries of the lists of neighbours.
    pub pairs: f64,
    /// Gradient weights that are stored.
    pub weights: f64,
    pub unknowns: f64,
    /// Entries of the tangent; 0 where it is not assembled.
    pub entries: f64,
    pub hourglass_entries: f64,
    pub upwind: bool,
    pub implicit: bool,
    pub assembled: bool,
}

/// Builds model, initial state and stepper of a scene.
///
/// # Errors
/// [`RunError`] for an impossible scene.
pub fn prepare<const D: usize>(scene: &Scene) -> Result<Prepared<D>, RunError> {
    let FittingSetup { mut setup, mut warnings, .. } = fitting_setup::<D>(scene)?;
    let time = &scene.time;
    if time.scheme == settings::Scheme::EnergyMomentum {
        // Its step evolves J exactly and at no cost, and with more digits than a determinant after large shear.
        for body in setup.bodies.iter_mut().filter(|body| body.volume_ratio == VolumeRatioChoice::Auto) {
            body.volume_ratio = VolumeRatioChoice::Evolved;
        }
    }
    let cfl = match time.step {
        StepChoice::Cfl(factor) => Some(factor),
        StepChoice::Fixed(_) => None,
    };
    let mut model = Model::new(setup, choices::unknowns(scene.newton.unknowns), cfl)?;
    let scheme = choices::scheme(time, &model)?;
    choices::possible(scheme, &model)?;
    let mut values = model.initial_state()?;
    if model.setup().initial.equilibrium {
        preload::equilibrate(scene, &mut model, &mut values)?;
    }
    let ramp = (scheme == Scheme::Static && time.ramp).then_some(Ramp { end: time.end, frozen: None });
    if ramp.is_some() {
        model.set_ramp(ramp);
    }
    let explicit_step_limit = model.stable_step(0.0, &values);
    let newton = if scheme.is_implicit() {
        if let Some(declared) = scene.newton.declared_linear {
            declare(&mut model, &values, declared, first_step(time, explicit_step_limit))?;
        }
        let at_rest = scheme == Scheme::Static;
        Some(NewtonSolver::new(choices::newton(scene)?, choices::linear(scene, at_rest)?.build()))
    } else {
        None
    };
    if let Some(upwind) = model.upwind()
        && upwind.feeding_pairs() > 0
    {
        warnings.push(format!(
            "{} pairs have N·g < 0 with the corrected gradient: there D_v feeds energy instead of dissipating it; \
             stabilisation.gradient = \"plain\" is provably dissipative",
            upwind.feeding_pairs()
        ));
    }
    warnings.extend(model.setup().bodies.iter().filter_map(rough_pressure));
    let step = first_step(time, explicit_step_limit);
    if let Scheme::Rkc(options) = scheme {
        warnings.extend(amplification::warning(&mut model, &values, options, step, time.end));
    }
    let control = choices::control(time, step, &model);
    let mut retries = Retries::default();
    // A controlled step has its own bounds.
    if let (Some(minimum), None, None) = (time.minimum_step, time.adaptive, time.effort) {
        retries.smallest_fraction = (minimum / step).min(1.0);
    }
    // What was linearised so far is not where the run begins.
    model.forget_linearisation();
    let stepper = Stepper::new(scheme, control, newton)
        .and_then(|stepper| stepper.with_retries(retries))
        .map_err(|error| RunError::Choice(error.to_string()))?;
    Ok(Prepared {
        model,
        stepper,
        state: TimeState::new(0.0, values),
        end: time.end,
        explicit_step_limit,
        warnings,
        ramp,
    })
}

/// Ratio of `λ + 2μ` to μ at ν = 0.49, from which the pressure feels the hourglass control (measured: `tests/solids.rs`).
const NEARLY_INCOMPRESSIBLE: f64 = 50.9;

/// Most hourglass control that its pressure bears: a little more than the default at ν = 0.49.
const SMOOTH: f64 = 0.6;

/// A warning for a nearly incompressible solid with more hourglass control than its pressure bears.
fn rough_pressure(body: &Body) -> Option<String> {
    let law = &body.material;
    let stiff = law.density * law.wave_speed().powi(2) >= NEARLY_INCOMPRESSIBLE * law.shear_modulus();
    let controlled = body.hourglass.is_some_and(|coefficient| coefficient > SMOOTH);
    (law.shear_modulus() > 0.0 && stiff && controlled).then(|| {
        format!(
            "body '{}' is nearly incompressible: with this hourglass control its displacements are good, but its pressures \
             vary from particle to particle; the default keeps them smooth, and is softer in bending",
            body.name
        )
    })
}

/// First step of a scene, s.
fn first_step(time: &settings::TimeSettings, limit: f64) -> f64 {
    match time.step {
        StepChoice::Fixed(step) => step,
        StepChoice::Cfl(_) => limit,
    }
}

/// Takes a scene's word that its equations are linear (or not), after checking it: the tangents at
/// two points in general position must agree.
fn declare<const D: usize>(model: &mut Model<D>, values: &[f64], declared: bool, step: f64) -> Result<(), RunError> {
    if declared && !model.is_linear() {
        let difference = tangent_difference(model, values, step).map_err(RunError::Choice)?;
        if difference > 1e-12 {
            return Err(RunError::Choice(format!(
                "newton.linear = true, but the tangent changes by {difference:.1e} (relative) between two states: \
                 the equations are not linear; remove the key"
            )));
        }
    }
    model.declare_linear(declared);
    Ok(())
}

fn tangent_difference<const D: usize>(model: &mut Model<D>, values: &[f64], step: f64) -> Result<f64, String> {
    let mut matrices = Vec::new();
    for seed in [1, 2] {
        let at = model.check_point(0.0, step, values, 0.02, seed).map_err(|e| e.to_string())?;
        let CheckPoint { time, shift, base, unknowns, .. } = at;
        model.begin_stage(time, shift, &base);
        nicolson_solvers::nonlinear::NonlinearProblem::linearise(model, &unknowns).map_err(|e| e.to_string())?;
        matrices.push(model.tangent_matrix());
    }
    let largest = matrices[0].values().iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let change = matrices[0].values().iter().zip(matrices[1].values()).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    Ok(change / largest.max(f64::MIN_POSITIVE))
}

impl<const D: usize> Prepared<D> {
    /// Unknowns of an implicit step; 0 for an explicit scheme.
    pub fn unknowns(&self) -> usize {
        if self.stepper.scheme().is_implicit() { self.model.unknown_count() } else { 0 }
    }

    /// A failed step in words: where it stood, why, and what to try.
    pub fn explain(&self, failure: &StepFailure) -> String {
        let mut text = failure.to_string();
        if let Some(nicolson_solvers::time::StepCause::NotFinite { index, .. }) = failure.cause() {
            let particle = self.model.particle_of_entry(*index);
            text = format!("{text}, at {}", self.model.describe_particle(particle));
        }
        self.advise(&text)
    }

    /// What went wrong, and what to try.
    pub(super) fn advise(&self, what: &str) -> String {
        let remedy = if self.stepper.scheme().is_implicit() {
            "try a smaller time.step, stabilisation, or scheme = \"energy_momentum\""
        } else {
            "try a smaller time.cfl or time.step, or an implicit scheme"
        };
        format!("{}; {remedy}", what.trim_end_matches('.'))
    }

    /// What the run will need.
    pub fn forecast(&self, scene: &Scene) -> Forecast {
        let model = &self.model;
        let pairs = model.gradient().neighbourhood.pairs() as f64;
        let particles = model.particles();
        let implicit = self.stepper.scheme().is_implicit();
        let assembled = implicit && !scene.linear.is_matrix_free();
        let entries = if assembled { model.pattern_entries() } else { 0 };
        let counts = Counts {
            particles: particles as f64,
            pairs,
            weights: model.gradient().weights.stored() as f64,
            unknowns: self.unknowns() as f64,
            entries: entries as f64,
            hourglass_entries: model.hourglass().map_or(0.0, |hourglass| hourglass.entries() as f64),
            upwind: model.upwind().is_some(),
            implicit,
            assembled,
        };
        let step = first_step(&scene.time, self.explicit_step_limit);
        Forecast {
            particles,
            unknowns: self.unknowns(),
            entries,
            mean_neighbours: pairs / particles.max(1) as f64,
            memory: counts.memory::<D>(),
            explicit_step_limit: self.explicit_step_limit,
            step,
            steps: (scene.time.end / step).ceil(),
            linear: implicit && model.is_linear(),
        }
    }
}
