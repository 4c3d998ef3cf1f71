//! A simulation of any dimension behind one trait.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nicolson::model::Energies;
use nicolson::scene::Scene;
use nicolson::setup::Constraint;
use nicolson::simulation::{Checkpoint, Prepared, RunError, StepProblem, prepare, resume};
use nicolson_solvers::linear::{SparseMatrix, SparsePattern, Tangent};
use nicolson_solvers::nonlinear::{IterationRecord, NewtonMonitor};
use nicolson_solvers::time::{StepControl, StepReport, System, TimeState};

use crate::errors::Trouble;

/// Ends a Newton iteration when the flag is up.
struct Watch(Arc<AtomicBool>);

impl NewtonMonitor for Watch {
    fn point(&mut self, _: &IterationRecord) -> ControlFlow<()> {
        if self.0.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// What does not change in a simulation.
pub struct Fixed {
    pub dimension: usize,
    pub particles: usize,
    pub end: f64,
    pub scheme: &'static str,
    /// Nonlinear problems that a step solves one after the other.
    pub stages: usize,
    pub explicit_step_limit: f64,
    pub warnings: Vec<String>,
    /// Flat, particle by particle.
    pub reference_positions: Vec<f64>,
    pub masses: Vec<f64>,
    /// Whether a component of a velocity is free, flat.
    pub free: Vec<bool>,
}

/// Which nonlinear problem of the next step.
#[derive(Default)]
pub struct Which {
    /// Length of the step, s; default: that which will be tried.
    pub step: Option<f64>,
    /// Unknowns that solve the stages before, in their order.
    pub earlier: Vec<Vec<f64>>,
}

/// A checkpoint to go on from, and whether with another scene.
pub type From<'a> = (&'a Checkpoint, bool);

/// A simulation.
pub trait Engine: Send {
    /// What does not change.
    fn fixed(&self) -> Fixed;
    /// Time and state; the values may have been taken out, and must be back before anything else is called.
    fn state(&mut self) -> &mut TimeState;
    /// One accepted step, not past the target nor the next frame.
    fn step(&mut self, target: f64) -> Result<StepReport, Trouble>;
    fn energies(&self) -> Energies;
    fn rate(&mut self, time: f64, state: &[f64]) -> Result<Vec<f64>, Trouble>;
    /// Poses a problem of the next step and returns the start of Newton's method.
    fn start(&mut self, at: &Which) -> Result<Vec<f64>, Trouble>;
    fn residual(&mut self, y: &[f64], at: &Which) -> Result<Vec<f64>, Trouble>;
    fn matvec(&mut self, y: &[f64], vector: &[f64], at: &Which) -> Result<Vec<f64>, Trouble>;
    /// The tangent, and the places of its entries.
    fn matrix(&mut self, y: &[f64], at: &Which) -> Result<(SparseMatrix, Arc<SparsePattern>), Trouble>;
    fn finish(&mut self, y: &[f64], at: &Which) -> Result<Vec<f64>, Trouble>;
    /// Mass of every unknown.
    fn mass(&mut self) -> Result<Vec<f64>, Trouble>;
    /// Writes a checkpoint of the present state.
    fn checkpoint(&mut self, path: &Path) -> Result<(), Trouble>;
}

/// Prepares a scene, at its beginning or where a checkpoint was written.
///
/// # Errors
/// If it is impossible.
pub fn engine(scene: Scene, from: Option<From<'_>>, stop: &Arc<AtomicBool>) -> Result<Box<dyn Engine>, Trouble> {
    Ok(match scene.dimension() {
        1 => Box::new(Session::<1>::new(scene, from, stop)?),
        2 => Box::new(Session::<2>::new(scene, from, stop)?),
        _ => Box::new(Session::<3>::new(scene, from, stop)?),
    })
}

struct Session<const D: usize> {
    scene: Scene,
    prepared: Prepared<D>,
    stop: Arc<AtomicBool>,
    /// Frames passed, that at the start included.
    frames: usize,
    /// The checkpoint that this has gone on from; empty if from the beginning.
    parent: PathBuf,
    problem: Option<StepProblem<D>>,
    /// Step of the problem that is posed for the present state, s, and solutions of the stages before.
    posed: Option<(f64, Vec<Vec<f64>>)>,
    start: Vec<f64>,
    /// Where its derivatives were taken; empty if nowhere.
    linearised: Vec<f64>,
}

impl<const D: usize> Session<D> {
    fn new(scene: Scene, from: Option<From<'_>>, stop: &Arc<AtomicBool>) -> Result<Self, Trouble> {
        let (mut prepared, frames) = match from {
            Some((checkpoint, forced)) => resume::<D>(&scene, checkpoint, forced)?,
            None => {
                let mut prepared = prepare::<D>(&scene)?;
                // For checkpoints.
                prepared.model.keep_linearisation_points();
                (prepared, 1)
            }
        };
        if let Some(newton) = prepared.stepper.newton_mut() {
            newton.set_monitor(Some(Box::new(Watch(Arc::clone(stop)))));
        }
        Ok(Self {
            scene,
            prepared,
            stop: Arc::clone(stop),
            frames,
            parent: from.map(|(checkpoint, _)| checkpoint.path.clone()).unwrap_or_default(),
            problem: None,
            posed: None,
            start: Vec::new(),
            linearised: Vec::new(),
        })
    }

    /// Time of the next frame, s, on which steps land as those of a run do.
    fn next_frame(&self) -> f64 {
        self.scene.output.interval.map_or(f64::INFINITY, |interval| interval * self.frames as f64)
    }

    /// Length that the next step will be tried with, s.
    fn next_step(&mut self) -> Result<f64, Trouble> {
        let Prepared { stepper, state, model, end, .. } = &mut self.prepared;
        let proposed = match stepper.control() {
            StepControl::Fixed { step } => step * state.memory.control.scale,
            StepControl::Cfl { factor } => factor * model.stable_step(state.time, &state.values),
            _ => state.memory.control.step,
        };
        let end = *end;
        let time = state.time;
        if proposed <= 0.0 {
            let what = "the controlled step is not known before the first: give dt";
            return Err(Trouble::Argument(what.into()));
        }
        let rest = end.min(self.next_frame()) - time;
        Ok(if rest > 0.0 { proposed.min(rest) } else { proposed })
    }

    fn problem(&mut self) -> Result<&mut StepProblem<D>, Trouble> {
        if self.problem.is_none() {
            self.problem = Some(StepProblem::new(&self.prepared).map_err(RunError::Model)?);
        }
        self.problem.as_mut().ok_or_else(|| Trouble::Panic("no problem".into()))
    }

    /// A problem of the next step.
    fn pose(&mut self, at: &Which) -> Result<&mut StepProblem<D>, Trouble> {
        let step = match at.step {
            Some(step) => step,
            None => self.next_step()?,
        };
        self.problem()?;
        let same = |posed: &(f64, Vec<Vec<f64>>)| posed.0.to_bits() == step.to_bits() && posed.1 == at.earlier;
        let known = self.posed.as_ref().is_some_and(same);
        let Self { problem, prepared, posed, start, linearised, .. } = self;
        let problem = problem.as_mut().ok_or_else(|| Trouble::Panic("no problem".into()))?;
        if !known {
            *posed = None;
            linearised.clear();
            *start = problem.pose_after(&prepared.state, step, &at.earlier)?;
            *posed = Some((step, at.earlier.clone()));
        }
        Ok(problem)
    }

    fn linearise(&mut self, y: &[f64], at: &Which) -> Result<&mut StepProblem<D>, Trouble> {
        self.pose(at)?;
        let Self { problem, linearised, .. } = self;
        let problem = problem.as_mut().ok_or_else(|| Trouble::Panic("no problem".into()))?;
        if linearised != y || y.is_empty() {
            linearised.clear();
            problem.linearise(y)?;
            linearised.extend_from_slice(y);
        }
        Ok(problem)
    }
}

impl<const D: usize> Engine for Session<D> {
    fn fixed(&self) -> Fixed {
        let Prepared { model, stepper, end, explicit_step_limit, warnings, .. } = &self.prepared;
        let setup = model.setup();
        Fixed {
            dimension: D,
            particles: model.particles(),
            end: *end,
            scheme: stepper.scheme().name(),
            stages: stepper.scheme().implicit_stages(),
            explicit_step_limit: *explicit_step_limit,
            warnings: warnings.clone(),
            reference_positions: setup.particles.positions.iter().flat_map(|x| x.iter().copied()).collect(),
            masses: model.masses().to_vec(),
            free: setup.constraints.iter().flatten().map(|kind| *kind == Constraint::Free).collect(),
        }
    }

    fn state(&mut self) -> &mut TimeState {
        &mut self.prepared.state
    }

    fn step(&mut self, target: f64) -> Result<StepReport, Trouble> {
        self.posed = None;
        let target = target.min(self.next_frame());
        let Prepared { stepper, model, state, .. } = &mut self.prepared;
        match stepper.advance(model, state, target) {
            Ok(report) => {
                if state.time >= self.next_frame() {
                    self.frames += 1;
                }
                Ok(report)
            }
            Err(failure) => {
                let message = if self.stop.load(Ordering::Relaxed) {
                    failure.to_string()
                } else {
                    self.prepared.explain(&failure)
                };
                Err(Trouble::Step { message, failure })
            }
        }
    }

    fn energies(&self) -> Energies {
        self.prepared.model.energies(&self.prepared.state.values)
    }

    fn rate(&mut self, time: f64, state: &[f64]) -> Result<Vec<f64>, Trouble> {
        (self.posed, self.linearised) = (None, Vec::new());
        let model = self.problem()?.model_mut();
        if state.len() != model.len() {
            let what = format!("{} values for a state [u | v | J] of {}", state.len(), model.len());
            return Err(Trouble::Argument(what));
        }
        let mut rate = vec![0.0; state.len()];
        model.rate(time, state, &mut rate).map_err(|error| RunError::Outside { time, error })?;
        Ok(rate)
    }

    fn start(&mut self, at: &Which) -> Result<Vec<f64>, Trouble> {
        self.pose(at)?;
        Ok(self.start.clone())
    }

    fn residual(&mut self, y: &[f64], at: &Which) -> Result<Vec<f64>, Trouble> {
        let problem = self.pose(at)?;
        let mut out = vec![0.0; problem.unknowns()];
        problem.residual(y, &mut out)?;
        Ok(out)
    }

    fn matvec(&mut self, y: &[f64], vector: &[f64], at: &Which) -> Result<Vec<f64>, Trouble> {
        let problem = self.linearise(y, at)?;
        let mut out = vec![0.0; problem.unknowns()];
        problem.apply(vector, &mut out)?;
        Ok(out)
    }

    fn matrix(&mut self, y: &[f64], at: &Which) -> Result<(SparseMatrix, Arc<SparsePattern>), Trouble> {
        let problem = self.linearise(y, at)?;
        let pattern =
            problem.model().pattern().ok_or_else(|| Trouble::Argument("the tangent has no entries".into()))?;
        Ok((problem.matrix(), Arc::clone(pattern)))
    }

    fn finish(&mut self, y: &[f64], at: &Which) -> Result<Vec<f64>, Trouble> {
        Ok(self.pose(at)?.finish(y)?)
    }

    fn mass(&mut self) -> Result<Vec<f64>, Trouble> {
        Ok(self.problem()?.mass())
    }

    fn checkpoint(&mut self, path: &Path) -> Result<(), Trouble> {
        let Self { scene, prepared, frames, parent, .. } = self;
        let checkpoint = Checkpoint::of(scene, prepared, *frames, "nicolson.Simulation.checkpoint", parent);
        Ok(checkpoint.write_to(path).map_err(RunError::Output)?)
    }
}
