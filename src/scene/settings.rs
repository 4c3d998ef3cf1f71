//! How a scene wants to be computed: time scheme, Newton's method, linear solver, output. Every field has one
//! documented default; every number has been checked.

use serde::Deserialize;

/// The table `[time]`.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeSettings {
    /// Time at which the computation ends, s; positive.
    pub end: f64,
    /// Scheme; default [`Scheme::CrankNicolson`].
    pub scheme: Scheme,
    /// Step; default [`StepChoice::Cfl`]`(0.3)` for explicit schemes, none for implicit ones.
    pub step: StepChoice,
    /// Step below which the computation gives up, s; default none: the program's own.
    pub minimum_step: Option<f64>,
    /// Control of the step by an error estimate; default none.
    pub adaptive: Option<Adaptive>,
}

/// The step size, or the first one if the step is adaptive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepChoice {
    /// In seconds; for [`Scheme::Static`] the increment of the pseudo-time.
    Fixed(f64),
    /// As a multiple of d_min / c_max, re-evaluated as the motion goes on.
    Cfl(f64),
}

/// The table `time.adaptive`: the step follows the error estimate of the scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    /// Key `tolerance`: error of a step relative to the size of each unknown; between 0 and 1.
    pub relative_tolerance: f64,
    /// Key `absolute`: error that never matters, in the unit of each unknown; default 0.
    pub absolute_tolerance: f64,
}

/// Time schemes with what only they need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// Explicit, order 1.
    ForwardEuler,
    /// Explicit, order 2, two stages, total variation diminishing.
    TvdRk2,
    /// Explicit, order 3, three stages, total variation diminishing.
    TvdRk3,
    /// Explicit, order 4, the classical one.
    Rk4,
    /// Explicit, order 2, stabilised Runge–Kutta–Chebyshev.
    Rkc,
    /// Explicit, order 2, leap-frog for motion without dissipation.
    VelocityVerlet,
    /// Implicit, order 1, damps everything.
    BackwardEuler,
    /// Implicit, order 2, trapezoidal rule.
    CrankNicolson,
    /// Implicit, between the two above.
    Theta {
        /// Weight of the new time; 0.5 (Crank–Nicolson) to 1 (backward Euler); default 0.5.
        theta: f64,
    },
    /// Implicit, order 2, mid-point rule.
    Midpoint,
    /// Implicit, order 2, two stages, strongly damping.
    TrBdf2,
    /// Implicit, order 3, singly diagonal.
    Sdirk3,
    /// Implicit, order 2, damps high frequencies as told.
    GeneralisedAlpha {
        /// Spectral radius at infinite frequency, 0 to 1; default 0.8.
        spectral_radius: f64,
    },
    /// Implicit, order 2, mid-point rule with a discrete gradient: conserves energy exactly.
    EnergyMomentum,
    /// No inertia: equilibrium at every increment of a pseudo-time.
    Static,
}

impl Scheme {
    /// Whether a step needs no equations solved.
    pub fn is_explicit(&self) -> bool {
        matches!(self, Self::ForwardEuler | Self::TvdRk2 | Self::TvdRk3 | Self::Rk4 | Self::Rkc | Self::VelocityVerlet)
    }

    /// Whether the scheme estimates its error, which an adaptive step needs.
    pub fn estimates_error(&self) -> bool {
        matches!(self, Self::Rkc | Self::TrBdf2 | Self::Sdirk3)
    }
}

/// The table `[newton]`.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonSettings {
    /// Residual relative to the first one; default 1e-8.
    pub relative_tolerance: f64,
    /// Residual relative to the size of its summands, where rounding ends all progress; default 1e-12.
    pub scale_tolerance: f64,
    /// Default 25.
    pub max_iterations: usize,
    /// Default [`LineSearch::Backtracking`].
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
            line_search: LineSearch::default(),
            tangent: TangentPolicy::default(),
            forcing: Forcing::default(),
            unknowns: Unknowns::default(),
            declared_linear: None,
        }
    }
}

/// How far to go along a Newton increment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
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
    /// Relative residual of iterative solvers; default 1e-10.
    pub tolerance: f64,
    /// Of iterative solvers; default 1000.
    pub max_iterations: usize,
    /// Iterations of GMRES before it starts afresh; default 50.
    pub restart: usize,
}

impl Default for LinearSettings {
    fn default() -> Self {
        Self {
            solver: SolverChoice::default(),
            preconditioner: PreconditionerChoice::default(),
            tolerance: 1e-10,
            max_iterations: 1000,
            restart: 50,
        }
    }
}

/// Linear solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
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
}

impl SolverChoice {
    /// Whether the matrix is factored.
    pub fn is_direct(&self) -> bool {
        matches!(self, Self::Lu | Self::Ldlt | Self::Cholesky)
    }
}

/// Preconditioners of iterative solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PreconditionerChoice {
    /// None.
    None,
    /// Diagonal.
    Jacobi,
    /// Diagonal blocks, one per particle.
    #[default]
    BlockJacobi,
    /// Incomplete LU without fill.
    Ilu0,
    /// Incomplete LU with a threshold.
    Ilut,
    /// The one-ring part of the tangent, factored.
    OneRing,
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

/// Fields of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
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
}

impl OutputField {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Pressure, Self::Jacobian, Self::Velocity, Self::Displacement, Self::DeformationGradient];
}
