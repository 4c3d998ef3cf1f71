//! Names in a scene ↔ choices of the solvers.

use nicolson_solvers::linear::{
    AutomaticOptions, EliminationOrder, KrylovOptions, LinearSolverChoice, MultigridOptions, Operator, Preconditioner,
    PreconditionerMatrix,
};
use nicolson_solvers::nonlinear::{Forcing, Globalisation, NewtonOptions, TangentPolicy};
use nicolson_solvers::time::{Adaptive, Effort, RkcOptions, RkcStages, Scheme, StepControl};

use super::RunError;
use crate::model::{Model, Unknowns};
use crate::scene::Scene;
use crate::scene::settings::{self, StepChoice, TimeSettings};
use crate::stabilisation::Upwind;

/// The time scheme.
pub fn scheme<const D: usize>(time: &TimeSettings, model: &Model<D>) -> Result<Scheme, RunError> {
    Ok(match time.scheme {
        settings::Scheme::ForwardEuler => Scheme::ForwardEuler,
        settings::Scheme::TvdRk2 => Scheme::TvdRk2,
        settings::Scheme::TvdRk3 => Scheme::TvdRk3,
        settings::Scheme::Rk4 => Scheme::Rk4,
        settings::Scheme::Rkc { stages: settings::RkcStages::SpectralRadius } => Scheme::Rkc(RkcOptions::default()),
        settings::Scheme::Rkc { stages: settings::RkcStages::Courant } => {
            let speed = (0..model.particles()).map(|a| model.material(a).wave_speed()).fold(0.0, f64::max);
            let stages = RkcStages::Courant { frequency: speed / model.smallest_distance() };
            Scheme::Rkc(RkcOptions { stages, ..RkcOptions::default() })
        }
        settings::Scheme::VelocityVerlet => Scheme::VelocityVerlet,
        settings::Scheme::BackwardEuler => Scheme::BackwardEuler,
        settings::Scheme::CrankNicolson => Scheme::CrankNicolson,
        settings::Scheme::Theta { theta } => Scheme::Theta(theta),
        settings::Scheme::Midpoint => Scheme::Midpoint,
        settings::Scheme::TrBdf2 => Scheme::TrBdf2,
        settings::Scheme::Sdirk3 => Scheme::Sdirk3,
        settings::Scheme::GeneralisedAlpha { spectral_radius } => Scheme::GeneralisedAlpha { spectral_radius },
        settings::Scheme::EnergyMomentum => Scheme::EnergyMomentum,
        settings::Scheme::Static => Scheme::Static,
    })
}

/// Refuses what the model cannot do.
pub fn possible<const D: usize>(scheme: Scheme, model: &Model<D>) -> Result<(), RunError> {
    let refuse = |what: String| Err(RunError::Choice(what));
    for body in &model.setup().bodies {
        let (name, law) = (&body.name, &body.material);
        if scheme == Scheme::Static && law.shear_modulus() == 0.0 {
            return refuse(format!(
                "time.scheme = \"static\" needs laws that resist shear, and that of body '{name}' does not: a fluid has no \
                 unique equilibrium; choose a solid, or a dynamic scheme"
            ));
        }
        if scheme == Scheme::EnergyMomentum && law.solid.is_some_and(|solid| !solid.has_conserving_stress::<D>()) {
            return refuse(format!(
                "time.scheme = \"energy_momentum\" has no discrete stress for plane (uniaxial) stress of body '{name}'; \
                 use transverse = \"strain\", the linear elastic law, or another scheme"
            ));
        }
        if model.upwind().is_some_and(Upwind::has_pressure) && !law.evolves_volume() {
            return refuse(format!(
                "stabilisation.tau_p acts on pressures that come from an evolved volume ratio, and body '{name}' has none; \
                 set tau_p = 0, or choose nearly_incompressible or a volumetric law"
            ));
        }
    }
    if scheme == Scheme::Static && model.unknowns() != Unknowns::Velocity {
        return refuse(
            "time.scheme = \"static\" solves for displacements alone; remove newton.unknowns and stabilisation.tau_p"
                .into(),
        );
    }
    Ok(())
}

/// The unknowns; `None` lets the model choose.
pub fn unknowns(choice: settings::Unknowns) -> Option<Unknowns> {
    match choice {
        settings::Unknowns::Auto => None,
        settings::Unknowns::Velocity => Some(Unknowns::Velocity),
        settings::Unknowns::VelocityJacobian => Some(Unknowns::VelocityJacobian),
        settings::Unknowns::Full => Some(Unknowns::Full),
    }
}

/// Newton's method.
pub fn newton(scene: &Scene) -> Result<NewtonOptions, RunError> {
    let newton = &scene.newton;
    let linear_is_automatic = scene.linear.solver == settings::SolverChoice::Auto;
    let options = NewtonOptions {
        relative_tolerance: newton.relative_tolerance,
        scale_tolerance: newton.scale_tolerance,
        max_iterations: newton.max_iterations,
        final_corrections: newton.final_corrections,
        tangent: match newton.tangent {
            settings::TangentPolicy::Full => TangentPolicy::default(),
            settings::TangentPolicy::Modified => TangentPolicy::Modified,
            settings::TangentPolicy::Lagged => TangentPolicy::lagged(),
            settings::TangentPolicy::Lbfgs => TangentPolicy::limited_bfgs(),
            settings::TangentPolicy::Broyden => TangentPolicy::broyden(),
        },
        globalisation: match newton.line_search {
            settings::LineSearch::None => Globalisation::None,
            settings::LineSearch::Backtracking => Globalisation::Backtracking,
            settings::LineSearch::MoreThuente => Globalisation::MoreThuente,
            settings::LineSearch::HagerZhang => Globalisation::HagerZhang,
            settings::LineSearch::TrustRegion => Globalisation::TrustRegion { initial_radius: None },
        },
        forcing: match newton.forcing {
            // A factor solves exactly whatever is asked. What iterates need not outrun Newton's method by far; nor may it
            // cost an iteration of it.
            settings::Forcing::Constant if linear_is_automatic => {
                Forcing::EisenstatWalker2 { first: 1e-6, largest: 1e-2, gamma: 0.1, alpha: 2.0 }
            }
            settings::Forcing::Constant => Forcing::Constant(scene.linear.tolerance),
            settings::Forcing::EisenstatWalker1 => Forcing::eisenstat_walker_1(),
            settings::Forcing::EisenstatWalker2 => Forcing::eisenstat_walker_2(),
        },
        ..NewtonOptions::default()
    };
    options.validate().map_err(|error| RunError::Choice(format!("[newton]: {error}")))?;
    Ok(options)
}

/// The linear solver. An equilibrium is ill-conditioned, and wants a factor where there can be one.
pub fn linear(scene: &Scene, at_rest: bool) -> Result<LinearSolverChoice, RunError> {
    let linear = &scene.linear;
    let krylov = KrylovOptions {
        preconditioner: match linear.preconditioner {
            settings::PreconditionerChoice::None => Preconditioner::None,
            settings::PreconditionerChoice::Jacobi => Preconditioner::Jacobi,
            settings::PreconditionerChoice::BlockJacobi => Preconditioner::BlockJacobi,
            settings::PreconditionerChoice::Multigrid => Preconditioner::Multigrid(MultigridOptions::default()),
            settings::PreconditionerChoice::Ilu0 | settings::PreconditionerChoice::OneRing => Preconditioner::Ilu0,
            settings::PreconditionerChoice::Ilut => Preconditioner::ilut(),
            settings::PreconditionerChoice::SymmetricPart => {
                Preconditioner::Ldlt { order: EliminationOrder::default() }
            }
        },
        preconditioner_matrix: match linear.preconditioner {
            settings::PreconditionerChoice::OneRing => PreconditionerMatrix::Sparser,
            settings::PreconditionerChoice::SymmetricPart => PreconditionerMatrix::SymmetricPart,
            _ => PreconditionerMatrix::Auto,
        },
        operator: match linear.operator {
            settings::OperatorChoice::Auto => Operator::Auto,
            settings::OperatorChoice::Assembled => Operator::Assembled,
            settings::OperatorChoice::MatrixFree => Operator::MatrixFree,
        },
        max_iterations: linear.max_iterations,
        ..KrylovOptions::default()
    };
    let choice = match linear.solver {
        settings::SolverChoice::Auto => LinearSolverChoice::Automatic(AutomaticOptions {
            direct: at_rest,
            restart: linear.restart,
            max_iterations: linear.max_iterations,
            ..AutomaticOptions::default()
        }),
        settings::SolverChoice::Lu => LinearSolverChoice::Lu,
        settings::SolverChoice::Ldlt => LinearSolverChoice::ldlt(),
        settings::SolverChoice::Cholesky => LinearSolverChoice::cholesky(),
        settings::SolverChoice::Gmres => LinearSolverChoice::Gmres { restart: linear.restart, krylov },
        settings::SolverChoice::Bicgstab => LinearSolverChoice::BiCgStab { krylov },
        settings::SolverChoice::Cg => LinearSolverChoice::Cg { krylov },
        settings::SolverChoice::Minres => LinearSolverChoice::Minres { krylov },
    };
    choice.validate().map_err(|error| RunError::Choice(format!("[linear]: {error}")))?;
    Ok(choice)
}

/// The rule for the step, of which `first` is the first.
pub fn control<const D: usize>(time: &TimeSettings, first: f64, model: &Model<D>) -> StepControl {
    let (smallest, largest) = (time.minimum_step.unwrap_or(0.0), time.maximum_step.unwrap_or(f64::INFINITY));
    if let Some(settings::Effort { few, many, growth, cut }) = time.effort {
        return StepControl::Effort(Effort { smallest, largest, few, many, growth, cut, ..Effort::new(first) });
    }
    match (&time.adaptive, time.step) {
        (Some(adaptive), _) => {
            let mut control = Adaptive::new(adaptive.relative_tolerance, adaptive.absolute_tolerance);
            (control.first, control.smallest, control.largest) = (Some(first), smallest, largest);
            // Entries of the state have different units: each is measured against its own natural size.
            let n = model.particles() * D;
            let size = |i: usize| match i / n {
                0 => model.smallest_distance(),
                1 => model.material(i % n / D).wave_speed(),
                _ => 1.0,
            };
            control.absolute_entries = Some(
                (0..n * 2 + model.particles())
                    .map(|i| adaptive.absolute_tolerance.max(1e-2 * adaptive.relative_tolerance * size(i)))
                    .collect(),
            );
            StepControl::Adaptive(control)
        }
        (None, StepChoice::Fixed(step)) => StepControl::Fixed { step },
        // The model's limit contains the factor already.
        (None, StepChoice::Cfl(_)) => StepControl::Cfl { factor: 1.0 },
    }
}
