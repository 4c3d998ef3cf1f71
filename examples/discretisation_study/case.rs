//! One case of the study: a cloud, a kernel and weights, and its matrices.

use std::sync::Arc;
use std::time::Instant;

use nicolson::model::{Model, Terms, Unknowns};
use nicolson::scene::Scene;
use nicolson::setup::Setup;
use nicolson_solvers::linear::{LinearSolver, LinearSolverChoice, SparsePattern};
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{EquilibriumSystem, StageSystem};

/// Kernels by their names in a scene.
pub const KERNELS: [&str; 3] = ["cubic_spline", "wendland_c2", "quintic_spline"];
/// Smoothing lengths over spacings.
pub const SMOOTHING: [f64; 7] = [0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 2.0];
/// Coefficients of the hourglass control.
pub const CONTROL: [f64; 5] = [0.0, 0.5, 1.0, 2.0, 3.0];
/// Length of the beam, m; it is 1 m high.
pub const LENGTH: f64 = 4.0;
/// Inner and outer radius of the ring, m.
pub const RADII: [f64; 2] = [0.5, 1.0];
/// Poisson's ratio; Young's modulus is 1 Pa, the density 1 kg/m³.
pub const POISSON: f64 = 0.3;
/// Cells across the beam, and gaps of the ring.
pub const CELLS: [usize; 2] = [6, 5];
/// Cells along the edges of the square on which the cost is measured.
const COST_CELLS: usize = 40;

/// Where the particles are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cloud {
    /// A beam on a lattice.
    Lattice,
    /// A beam on a lattice of which the corners of the cells were moved by up to 20 % of a spacing.
    Perturbed,
    /// A ring of concentric rings.
    Ring,
}

impl Cloud {
    /// The word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lattice => "lattice",
            Self::Perturbed => "perturbed",
            Self::Ring => "rings",
        }
    }
}

/// What tells a case from others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    pub cloud: Cloud,
    /// `vertex`, `cell`, or `mixed`: vertices along, cells across.
    pub layout: &'static str,
    pub kernel: &'static str,
    /// Smoothing length over spacing.
    pub smoothing: f64,
    /// `separate`, `balanced`, or `balanced, stencil` with volumes that suit the stencil.
    pub weights: &'static str,
    /// Cells across the beam, or gaps of the ring.
    pub cells: usize,
}

/// A case as matrices.
pub struct Matrices {
    pub setup: Setup<2>,
    pub masses: Vec<f64>,
    pub pattern: Arc<SparsePattern>,
    /// Stiffness of the material.
    pub elastic: Vec<f64>,
    /// Stiffness of the hourglass control with α = 1.
    pub control: Vec<f64>,
    /// Neighbours of a particle on average, itself included.
    pub neighbours: f64,
    /// Particles that a row of the tangent couples to on average.
    pub row: f64,
    /// Time that balancing took, s.
    pub balancing: f64,
}

impl Case {
    fn body(&self) -> String {
        let spacing = match self.cloud {
            Cloud::Ring => (RADII[1] - RADII[0]) / self.cells as f64,
            _ => 1.0 / self.cells as f64,
        };
        let shape = match self.cloud {
            Cloud::Ring => format!("shape.ring = {{ centre = [0, 0], inner = {}, outer = {} }}", RADII[0], RADII[1]),
            _ => {
                let layout =
                    if self.layout == "mixed" { "[\"vertex\", \"cell\"]" } else { &format!("{:?}", self.layout) };
                format!("layout = {layout}\nshape.box = {{ lower = [0, -0.5], upper = [{LENGTH}, 0.5] }}")
            }
        };
        let perturb = if self.cloud == Cloud::Perturbed { "perturb = { amount = 0.2 }" } else { "" };
        let (weights, volumes) = match self.weights {
            "balanced, stencil" => ("balanced", "stencil"),
            weights => (weights, "cells"),
        };
        format!(
            "spacing = {spacing}\n{shape}\n{perturb}\nkernel = {:?}\nsmoothing = {}\nweights = {weights:?}\nvolumes = {volumes:?}",
            self.kernel, self.smoothing
        )
    }

    /// Builds the case.
    ///
    /// # Errors
    /// In words; above all where weights cannot be balanced.
    pub fn matrices(&self) -> Result<Matrices, String> {
        let mut model = model(&self.body())?;
        let state = model.initial_state().map_err(in_words)?;
        let mut rest = Vec::new();
        model.begin_equilibrium(0.0, &state, &mut rest);
        let mut part = |terms: Terms| {
            model.select_terms(terms);
            model.linearise(&rest).map_err(in_words)?;
            Ok::<_, String>(model.tangent_matrix().values().to_vec())
        };
        let elastic = part(Terms { hourglass: false, ..Terms::ALL })?;
        let control = part(Terms { hourglass: true, ..Terms::NONE })?;
        let pattern = Arc::clone(model.tangent().pattern().ok_or("a tangent without entries")?);
        let count = model.particles() as f64;
        Ok(Matrices {
            masses: model.masses().iter().flat_map(|mass| [*mass; 2]).collect(),
            row: pattern.entries() as f64 / (4.0 * count),
            neighbours: model.gradient().neighbourhood.pairs() as f64 / count,
            balancing: model.gradient().balance.iter().map(|report| report.seconds).sum(),
            setup: model.setup().clone(),
            pattern,
            elastic,
            control,
        })
    }
}

fn in_words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// The model of a body with linear elasticity and hourglass control of α = 1, without constraints and loads.
fn model(body: &str) -> Result<Model<2>, String> {
    let text = format!(
        "dimension = 2\nhourglass = 1.0\n[[body]]\n{body}\n\
         material.linear_elastic = {{ density = 1, youngs_modulus = 1, poissons_ratio = {POISSON} }}\n\
         [time]\nscheme = \"static\"\nstep = 1\nend = 1\n"
    );
    let scene = Scene::parse(&text, "study", std::path::Path::new(""), &[]).map_err(in_words)?;
    let (setup, _) = scene.setup::<2>().map_err(in_words)?;
    Model::new(setup, Some(Unknowns::Velocity), None).map_err(in_words)
}

/// Assembles and factorises the tangent of an implicit step over and over, on a square of 41 × 41 particles with
/// hourglass control. Weights change no pattern, so neither do they change what this costs.
pub struct Stopwatch {
    model: Model<2>,
    solver: Box<dyn LinearSolver>,
    state: Vec<f64>,
    start: Vec<f64>,
}

impl Stopwatch {
    /// Builds the square, and does once what need not be repeated: pattern and analysis.
    ///
    /// # Errors
    /// In words.
    pub fn new(kernel: &str, smoothing: f64) -> Result<Self, String> {
        let mut model = model(&format!(
            "spacing = {}\nshape.box = {{ lower = [0, 0], upper = [1, 1] }}\nkernel = {kernel:?}\n\
             smoothing = {smoothing}\nweights = \"separate\"",
            1.0 / COST_CELLS as f64
        ))?;
        // Linear equations would be linearised once only.
        model.declare_linear(false);
        let state = model.initial_state().map_err(in_words)?;
        let start = vec![0.0; NonlinearProblem::unknowns(&model)];
        let mut watch = Self { model, solver: LinearSolverChoice::ldlt().build(), state, start };
        watch.seconds()?;
        Ok(watch)
    }

    /// Time of one assembly and factorisation, s.
    ///
    /// # Errors
    /// In words.
    pub fn seconds(&mut self) -> Result<f64, String> {
        self.model.begin_stage(0.0, 1.0, &self.state);
        self.model.start_from(&self.state, &mut self.start);
        let clock = Instant::now();
        self.model.linearise(&self.start).map_err(in_words)?;
        self.solver.prepare(self.model.tangent()).map_err(in_words)?;
        Ok(clock.elapsed().as_secs_f64())
    }
}
