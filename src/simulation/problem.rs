//! One implicit step as a nonlinear problem `R(y) = 0`, for programs that bring a solver of their own.
//!
//! The unknowns y are the free velocity components of the stage, particle after particle (with volume ratios or
//! displacements among them where [`crate::model::Unknowns`] says so). With shift s, base `(ũ, ṽ, J̃)` and time `t*`:
//!
//! ```text
//! R(y) = m (y − ṽ) − s f(t*, ũ + s y, y, J)                                        momenta, kg m/s
//!
//! θ-schemes            s = θΔt    t* = t + Δt     (ũ, ṽ, J̃) = (u, v, J) + (1 − θ)Δt (v, a, J̇)
//! mid-point            s = Δt/2   t* = t + Δt/2   (ũ, ṽ, J̃) = (u, v, J)
//! energy–momentum      the same, with the discrete stress of the step and the mean velocity y
//! generalised-α        s = α_f γ Δt/α_m   t* = t + α_f Δt   (ũ, ṽ, J̃) = (u, v, J) + α_f (1 − γ/α_m)Δt r
//! static               R(y) = −1 s · f(t + Δt, u + 1 s · y): y times 1 s is the increment of the displacement
//! ```
//!
//! The schemes of several stages solve such a problem for each of them, with `r_j = f(t_j, U_j)` of the stages before, each
//! found from the solution `y_j` of its own problem ([`StepProblem::pose_after`]); the last stage is the end of the step:
//!
//! ```text
//! stage i              s = a_ii Δt   t* = t + c_i Δt   (ũ, ṽ, J̃) = (u, v, J) + Δt Σ_{j<i} a_ij r_j
//! TR-BDF2, two         γ = 2 − √2, a_ii = γ/2, r₀ = f(t)
//!                      c₁ = γ, a₁₀ = γ/2;  c₂ = 1, a₂₀ = a₂₁ = √2/4
//! SDIRK3, three        a_ii = g = 0.435866521508459
//!                      c₁ = g;  c₂ = (1 + g)/2, a₂₁ = (1 − g)/2
//!                      c₃ = 1, a₃₁ = −3g²/2 + 4g − 1/4, a₃₂ = 3g²/2 − 5g + 5/4
//! ```
//!
//! [`StepProblem::pose_stage`] poses any other stage by hand.

mod stages;

use nicolson_solvers::EvaluationError;
use nicolson_solvers::linear::{SparseMatrix, Tangent};
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{ConservingSystem, EquilibriumSystem, Scheme, StageSystem, System, TimeState};

use super::{Prepared, RunError};
use crate::model::{Model, ModelError};

/// What the posed problem is, and so how its solution becomes a state.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Posed {
    /// Nothing yet.
    Nothing,
    /// A stage on its own, or one that lies at the end of the step.
    Stage,
    /// A stage at a fraction of the step; the end lies beyond it.
    Within {
        fraction: f64,
    },
    Conserving,
    Equilibrium,
}

/// The nonlinear problem of one implicit step, on a model of its own: a simulation that goes on beside it keeps its bits.
pub struct StepProblem<const D: usize> {
    model: Model<D>,
    scheme: Scheme,
    posed: Posed,
    start: Vec<f64>,
    /// End of the step, s.
    end: f64,
    shift: f64,
    stage_time: f64,
    base: Vec<f64>,
}

impl<const D: usize> StepProblem<D> {
    /// A problem of the same set-up and scheme as a simulation. Builds the tables of the model once more.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn new(prepared: &Prepared<D>) -> Result<Self, ModelError> {
        let original = &prepared.model;
        let mut model = Model::new(original.setup().clone(), Some(original.unknowns()), None)?;
        model.declare_linear(original.is_linear());
        model.set_ramp(prepared.ramp);
        Ok(Self {
            model,
            scheme: prepared.stepper.scheme(),
            posed: Posed::Nothing,
            start: Vec::new(),
            end: 0.0,
            shift: 0.0,
            stage_time: 0.0,
            base: Vec::new(),
        })
    }

    /// The model: rates, energies, masses. Posing a problem on it by hand makes this one forget its own.
    pub fn model_mut(&mut self) -> &mut Model<D> {
        self.posed = Posed::Nothing;
        &mut self.model
    }

    /// The model, to read from.
    pub fn model(&self) -> &Model<D> {
        &self.model
    }

    /// Shift s of the posed problem, s.
    pub fn shift(&self) -> f64 {
        self.shift
    }

    /// Time `t*` at which the posed problem evaluates forces, s.
    pub fn stage_time(&self) -> f64 {
        self.stage_time
    }

    /// Base `[ũ | ṽ | J̃]` of the posed stage, before prescribed values; empty for a static step.
    pub fn base(&self) -> &[f64] {
        &self.base
    }

    /// Poses the step of length `step` from a state, as the scheme of the scene takes it, and returns the start of
    /// Newton's method. Of a scheme of several [stages](Scheme::implicit_stages) it poses the first.
    ///
    /// # Errors
    /// [`RunError::Choice`] if the step is not positive, or the scheme is explicit;
    /// [`RunError::Outside`] if the rate at the start cannot be evaluated.
    pub fn pose(&mut self, state: &TimeState, step: f64) -> Result<Vec<f64>, RunError> {
        self.pose_after(state, step, &[])
    }

    /// [`pose`](Self::pose) for the stage that comes after those whose unknowns `earlier` gives, in their order. The rates
    /// of those stages are evaluated anew.
    ///
    /// # Errors
    /// As [`pose`](Self::pose); also if there is no such stage, or unknowns of an earlier one have the wrong length or are
    /// outside the domain of the law.
    pub fn pose_after(&mut self, state: &TimeState, step: f64, earlier: &[Vec<f64>]) -> Result<Vec<f64>, RunError> {
        let posed = self.pose_checked(state, step, earlier);
        if posed.is_err() {
            self.posed = Posed::Nothing;
        }
        posed
    }

    fn pose_checked(&mut self, state: &TimeState, step: f64, earlier: &[Vec<f64>]) -> Result<Vec<f64>, RunError> {
        self.posed = Posed::Nothing;
        if !(step.is_finite() && step > 0.0) {
            return Err(RunError::Choice(format!("a step of {step} s: give one that is positive")));
        }
        self.check_length(&state.values)?;
        if self.scheme.is_implicit() {
            self.check_earlier(earlier.len())?;
        }
        self.start.clone_from(&state.values);
        self.end = state.time + step;
        if let Some(tableau) = self.scheme.tableau() {
            return self.pose_diagonal(state, step, &tableau, earlier);
        }
        match self.scheme {
            Scheme::BackwardEuler => self.pose_theta(state, step, 1.0),
            Scheme::CrankNicolson => self.pose_theta(state, step, 0.5),
            Scheme::Theta(theta) => self.pose_theta(state, step, theta),
            Scheme::Midpoint => {
                let half = 0.5 * step;
                self.begin(state.time + half, half, state.values.clone(), Posed::Within { fraction: 0.5 });
                Ok(self.begin_at(&state.values))
            }
            Scheme::GeneralisedAlpha { spectral_radius } => self.pose_generalised_alpha(state, step, spectral_radius),
            Scheme::EnergyMomentum => {
                let mut y = vec![0.0; self.unknowns()];
                self.model.begin_conserving(state.time, step, &state.values);
                self.model.extrapolated_start(&mut y);
                (self.shift, self.stage_time) = (0.5 * step, state.time + 0.5 * step);
                self.base.clone_from(&state.values);
                self.posed = Posed::Conserving;
                Ok(y)
            }
            Scheme::Static => {
                let mut y = Vec::new();
                self.model.begin_equilibrium(self.end, &state.values, &mut y);
                (self.shift, self.stage_time) = (1.0, self.end);
                self.base.clear();
                self.posed = Posed::Equilibrium;
                Ok(y)
            }
            scheme => Err(RunError::Choice(format!(
                "{} is explicit: its step has no residual; choose an implicit scheme, such as time.scheme = \
                 \"crank_nicolson\"",
                scheme.name()
            ))),
        }
    }

    /// Poses the stage `u = ũ + s f(t, u)` and returns the start of Newton's method from its base.
    ///
    /// # Errors
    /// [`RunError::Choice`] if the shift is not positive or the base has another length than the state.
    pub fn pose_stage(&mut self, time: f64, shift: f64, base: &[f64]) -> Result<Vec<f64>, RunError> {
        if !(shift.is_finite() && shift > 0.0 && time.is_finite()) {
            let what = format!("a stage of shift {shift} s at t = {time} s: give a positive shift and a finite time");
            return Err(RunError::Choice(what));
        }
        self.check_length(base)?;
        self.begin(time, shift, base.to_vec(), Posed::Stage);
        self.start.clear();
        self.end = time;
        Ok(self.begin_at(base))
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        NonlinearProblem::unknowns(&self.model)
    }

    /// Mass of the particle of every unknown, kg.
    pub fn mass(&self) -> Vec<f64> {
        let starts = self.model.blocks();
        let per_particle = starts.windows(2).zip(self.model.masses());
        per_particle.flat_map(|(range, mass)| std::iter::repeat_n(*mass, range[1] - range[0])).collect()
    }

    /// Writes `R(y)`.
    ///
    /// # Errors
    /// If nothing is posed, `y` has the wrong length, or is outside the domain of the law.
    pub fn residual(&mut self, y: &[f64], out: &mut [f64]) -> Result<(), RunError> {
        self.check_unknowns(y)?;
        self.model.residual(y, out).map(drop).map_err(|error| self.outside(error))
    }

    /// Takes the derivatives at `y`, for [`apply`](Self::apply) and [`matrix`](Self::matrix).
    ///
    /// # Errors
    /// As [`residual`](Self::residual).
    pub fn linearise(&mut self, y: &[f64]) -> Result<(), RunError> {
        self.check_unknowns(y)?;
        self.model.linearise(y).map_err(|error| self.outside(error))
    }

    /// Writes the product of the tangent `∂R/∂y` at the last linearised point with a vector; no matrix is made.
    ///
    /// # Errors
    /// If the vector has the wrong length.
    pub fn apply(&self, vector: &[f64], out: &mut [f64]) -> Result<(), RunError> {
        self.check_unknowns(vector)?;
        Tangent::apply(&self.model, vector, out);
        Ok(())
    }

    /// The tangent `∂R/∂y` at the last linearised point, in compressed rows.
    pub fn matrix(&self) -> SparseMatrix {
        self.model.tangent_matrix()
    }

    /// The state `[u | v | J]` that unknowns stand for: that at the end of the step, or of the stage posed by hand; for a
    /// stage that others follow, that at its time.
    ///
    /// # Errors
    /// As [`residual`](Self::residual).
    pub fn finish(&mut self, y: &[f64]) -> Result<Vec<f64>, RunError> {
        self.check_unknowns(y)?;
        let mut state = if self.start.is_empty() { self.base.clone() } else { self.start.clone() };
        let outcome = match self.posed {
            Posed::Conserving => self.model.finish_conserving(y, &mut state),
            Posed::Equilibrium => self.model.finish_equilibrium(y, &mut state),
            _ => self.model.finish_stage(y, &mut state, &mut vec![0.0; self.model.len()]),
        };
        outcome.map_err(|error| self.outside(error))?;
        if let Posed::Within { fraction } = self.posed {
            for (end, start) in state.iter_mut().zip(&self.start) {
                *end = start + (*end - start) / fraction;
            }
        }
        self.model.impose(self.end, &mut state);
        Ok(state)
    }

    fn pose_theta(&mut self, state: &TimeState, step: f64, theta: f64) -> Result<Vec<f64>, RunError> {
        let mut base = state.values.clone();
        if theta < 1.0 {
            let rate = self.start_rate(state)?;
            nicolson_solvers::vector::axpy((1.0 - theta) * step, &rate, &mut base);
        }
        self.begin(self.end, theta * step, base, Posed::Stage);
        Ok(self.begin_at(&state.values))
    }

    fn pose_generalised_alpha(&mut self, state: &TimeState, step: f64, radius: f64) -> Result<Vec<f64>, RunError> {
        let alpha_m = 0.5 * (3.0 - radius) / (1.0 + radius);
        let alpha_f = 1.0 / (1.0 + radius);
        let gamma = 0.5 + alpha_m - alpha_f;
        let kept = &state.memory.algorithmic_rate;
        let is_current = state.memory.fingerprint == state.fingerprint() && kept.len() == state.values.len();
        let rate = if is_current { kept.clone() } else { self.start_rate(state)? };
        let mut base = state.values.clone();
        nicolson_solvers::vector::axpy(alpha_f * (1.0 - gamma / alpha_m) * step, &rate, &mut base);
        let (time, shift) = (state.time + alpha_f * step, alpha_f * gamma * step / alpha_m);
        self.begin(time, shift, base, Posed::Within { fraction: alpha_f });
        Ok(self.begin_at(&state.values))
    }

    fn begin(&mut self, time: f64, shift: f64, base: Vec<f64>, posed: Posed) {
        self.model.begin_stage(time, shift, &base);
        (self.stage_time, self.shift, self.base, self.posed) = (time, shift, base, posed);
    }

    /// The unknowns of a guess of the state.
    fn begin_at(&mut self, guess: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.unknowns()];
        self.model.start_from(guess, &mut y);
        y
    }

    fn start_rate(&mut self, state: &TimeState) -> Result<Vec<f64>, RunError> {
        let kept = &state.memory.rate;
        if state.memory.fingerprint == state.fingerprint() && kept.len() == state.values.len() {
            return Ok(kept.clone());
        }
        let mut rate = vec![0.0; state.values.len()];
        let outcome = self.model.rate(state.time, &state.values, &mut rate);
        outcome.map_err(|error| RunError::Outside { time: state.time, error })?;
        Ok(rate)
    }

    fn check_length(&self, values: &[f64]) -> Result<(), RunError> {
        let (found, expected) = (values.len(), self.model.len());
        if found == expected {
            return Ok(());
        }
        Err(RunError::Choice(format!("{found} values for a state [u | v | J] of {expected}")))
    }

    fn check_unknowns(&self, y: &[f64]) -> Result<(), RunError> {
        if self.posed == Posed::Nothing {
            return Err(RunError::Choice("no step is posed yet: pose one first".into()));
        }
        let (found, expected) = (y.len(), self.unknowns());
        if found == expected {
            return Ok(());
        }
        Err(RunError::Choice(format!("{found} values for {expected} unknowns")))
    }

    fn outside(&self, error: EvaluationError) -> RunError {
        RunError::Outside { time: self.stage_time, error }
    }
}
