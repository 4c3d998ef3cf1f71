//! How a scene wants to be computed: time scheme, Newton's method, linear solver, output, checkpoints. Every field has one
//! documented default; every number has been checked.

mod time;

use serde::Deserialize;

pub use time::{Adaptive, Effort, RkcStages, Scheme, StepChoice, TimeSettings};

/// The table `[newton]`.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonSettings {
    /// Residual relative to the first one; default 1e-8, and 1e-12 for [`Scheme::EnergyMomentum`], whose energy
    /// is as exact as its equations are solved.
    pub relative_tolerance: f64,
    /// Residual relative to the size of its summands; default 1e-12, and 1e-15 for [`Scheme::EnergyMomentum`]:
    /// until rounding ends all progress.
    pub scale_tolerance: f64,
    /// Default 25.
    pub max_iterations: usize,
    /// Corrections with the factor at hand that may follow convergence; default 0, and 2 for
    /// [`Scheme::EnergyMomentum`], whose energy changes by what is left of the residual.
    pub final_corrections: usize,
    /// Default [`LineSearch::Backtracking`], and [`LineSearch::None`] for [`Scheme::Static`]: a slender body bends by a
    /// first Newton step that stretches it, which is the way to go although the residual grows by orders of magnitude;
    /// steps that go too far leave the domain, or fail, and cut the increment.
    pub line_search: LineSearch,
    /// Default [`TangentPolicy::Full`].
    pub tangent: TangentPolicy,
    /// Tolerance of iterative linear solves; default [`Forcing::Constant`].
    pub forcing: Forcing,
    /// Default [`Unknowns::Auto`].
    pub unknowns: Unknowns,
    /// Key `linear`: what the scene declares about its equations, to be checked; default nothing.
    pub declared_linear: Option<bool>,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self {
            relative_tolerance: 1e-8,
            scale_tolerance: 1e-12,
            max_iterations: 25,
            final_corrections: 0,
            line_search: LineSearch::default(),
            tangent: TangentPolicy::default(),
            forcing: Forcing::default(),
            unknowns: Unknowns::default(),
            declared_linear: None,
        }
    }
}

impl NewtonSettings {
    /// The defaults for a scheme.
    pub fn of(scheme: Scheme) -> Self {
        let mut settings = Self::default();
        if scheme == Scheme::EnergyMomentum {
            (settings.relative_tolerance, settings.scale_tolerance) = (1e-12, 1e-15);
            settings.final_corrections = 2;
        }
        if scheme == Scheme::Static {
            settings.line_search = LineSearch::None;
        }
        settings
    }
}

/// How far to go along a Newton increment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub enum LineSearch {
    /// All the way.
    None,
    /// Halve until the residual falls.
    #[default]
    Backtracking,
    /// Moré and Thuente.
    MoreThuente,
    /// Hager and Zhang.
    HagerZhang,
    /// A trust region instead of a line.
    TrustRegion,
}

/// When the tangent is renewed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub enum TangentPolicy {
    /// In every iteration.
    #[default]
    Full,
    /// In the first iteration of a step.
    Modified,
    /// When convergence slows down.
    Lagged,
    /// Limited-memory BFGS updates.
    Lbfgs,
    /// Broyden updates.
    Broyden,
}

/// Tolerance of iterative linear solves inside Newton's method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub enum Forcing {
    /// That of the table `[linear]`.
    #[default]
    Constant,
    /// Eisenstat and Walker, first choice.
    #[serde(rename = "eisenstat_walker_1")]
    EisenstatWalker1,
    /// Eisenstat and Walker, second choice.
    #[serde(rename = "eisenstat_walker_2")]
    EisenstatWalker2,
}

/// Unknowns of the implicit system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub enum Unknowns {
    /// As few as the scene allows.
    #[default]
    Auto,
    /// Velocity alone; impossible with `tau_p`.
    Velocity,
    /// Velocity and volume ratio.
    VelocityJacobian,
    /// Velocity, volume ratio and position.
    Full,
}

/// The table `[linear]`.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearSettings {
    /// Default [`SolverChoice::Auto`].
    pub solver: SolverChoice,
    /// For iterative solvers; default [`PreconditionerChoice::BlockJacobi`].
    pub preconditioner: PreconditionerChoice,
    /// For iterative solvers; default [`OperatorChoice::Auto`].
    pub operator: OperatorChoice,
    /// Relative residual of iterative solvers; default 1e-10.
    pub tolerance: f64,
    /// Of iterative solvers; default 1000.
    pub max_iterations: usize,
    /// Iterations of GMRES before it starts afresh; default 50.
    pub restart: usize,
}

impl LinearSettings {
    /// Whether entries of the tangent, and their pattern, are never asked for.
    pub fn is_matrix_free(&self) -> bool {
        let iterative = !self.solver.is_direct() && self.solver != SolverChoice::Auto;
        iterative && self.operator == OperatorChoice::MatrixFree
    }
}

impl Default for LinearSettings {
    fn default() -> Self {
        Self {
            solver: SolverChoice::default(),
            preconditioner: PreconditionerChoice::default(),
            operator: OperatorChoice::default(),
            tolerance: 1e-10,
            max_iterations: 1000,
            restart: 50,
        }
    }
}

/// Linear solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub enum SolverChoice {
    /// The program's choice.
    #[default]
    Auto,
    /// Direct, any matrix.
    Lu,
    /// Direct, symmetric matrices.
    Ldlt,
    /// Direct, symmetric positive definite matrices.
    Cholesky,
    /// Iterative, any matrix.
    Gmres,
    /// Iterative, any matrix, little memory.
    Bicgstab,
    /// Iterative, symmetric positive definite matrices.
    Cg,
    /// Iterative, symmetric matrices.
    Minres,
}

/// Where the products of iterative solvers come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub enum OperatorChoice {
    /// Entries where the preconditioner needs them anyway, else the action of the tangent.
    #[default]
    Auto,
    /// Entries.
    Assembled,
    /// The action of the tangent; entries and their pattern are never built.
    MatrixFree,
}

impl SolverChoice {
    /// Whether the matrix is factored.
    pub fn is_direct(&self) -> bool {
        matches!(self, Self::Lu | Self::Ldlt | Self::Cholesky)
    }
}

/// Preconditioners of iterative solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub enum PreconditionerChoice {
    /// None.
    None,
    /// Diagonal.
    Jacobi,
    /// Diagonal blocks, one per particle.
    #[default]
    BlockJacobi,
    /// Multigrid on lattices of tent functions.
    Multigrid,
    /// Incomplete LU without fill.
    Ilu0,
    /// Incomplete LU with a threshold.
    Ilut,
    /// The one-ring part of the tangent, factored.
    OneRing,
    /// LDLᵀ of the symmetric part of the tangent, for those that are nearly symmetric.
    SymmetricPart,
}

/// The table `[output]`.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputSettings {
    /// Time between frames, s; default none: the first and the last frame only.
    pub interval: Option<f64>,
    /// Fields of the frames; default all.
    pub fields: Vec<OutputField>,
    /// Whether to draw plots; default yes.
    pub plots: bool,
    /// Whether to write the history of energies; default yes.
    pub history: bool,
}

impl Default for OutputSettings {
    fn default() -> Self {
        Self { interval: None, fields: OutputField::ALL.to_vec(), plots: true, history: true }
    }
}

/// The table `[checkpoint]`.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckpointSettings {
    /// Steps between checkpoints; default none.
    pub every_steps: Option<usize>,
    /// Wall-clock seconds between checkpoints; default none.
    pub every_seconds: Option<f64>,
    /// Checkpoints that are kept, the newest; 0 writes none at all. Default 2.
    pub keep: usize,
    /// Whether one is written when the run is complete: if the scene has the table. One that is interrupted or fails
    /// leaves one in any case.
    pub at_end: bool,
}

impl Default for CheckpointSettings {
    fn default() -> Self {
        Self { every_steps: None, every_seconds: None, keep: 2, at_end: false }
    }
}

/// Fields of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub enum OutputField {
    /// p, Pa.
    Pressure,
    /// J.
    Jacobian,
    /// v, m/s.
    Velocity,
    /// x − X, m.
    Displacement,
    /// F.
    DeformationGradient,
    /// Cauchy stress with its part across the plane, Pa, without viscosity; left out where there is no solid.
    Stress,
    /// √(3/2 s:s) of its deviator s, Pa; left out where there is no solid.
    VonMises,
    /// V J, m^D: pictures take the size of particles from it.
    Volume,
}

impl OutputField {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Pressure,
        Self::Jacobian,
        Self::Velocity,
        Self::Displacement,
        Self::DeformationGradient,
        Self::Stress,
        Self::VonMises,
        Self::Volume,
    ];
}
