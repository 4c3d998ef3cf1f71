//! A simulation step by step, its state as NumPy arrays, and the nonlinear problem of its next step.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nicolson::scene::Scene as Inner;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{lend, own, vector, view};
use crate::engine::{From, Which, engine};
use crate::run::find;
use crate::scene::{Scene, limited};
use crate::shared::Shared;
use crate::work;

/// Values, columns and offsets of a matrix in compressed rows.
type CompressedRows<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// A scene in motion: `step()` by `step()`, with its state as NumPy arrays.
///
/// `state`, `displacement`, `velocity` and `volume_ratio` are read-only views of the memory of the state; nothing is
/// copied. A view belongs to the moment it was taken at: later steps never change it, and it outlives the simulation.
///
/// Several threads may use a simulation; one waits for the other. Steps release the interpreter's lock. Ctrl-C ends a
/// step between two Newton iterations and leaves the state before it.
#[pyclass(module = "nicolson", frozen)]
pub struct Simulation {
    shared: Shared,
    reference: Py<PyArray1<f64>>,
    masses: Py<PyArray1<f64>>,
}

/// The problem that arguments mean.
fn which(step: Option<f64>, earlier: Option<Vec<Bound<'_, PyAny>>>) -> PyResult<Which> {
    let earlier: PyResult<Vec<_>> = earlier.unwrap_or_default().iter().map(vector).collect();
    Ok(Which { step, earlier: earlier? })
}

impl Simulation {
    /// Prepares a scene, at its beginning or where a checkpoint was written.
    fn prepared(py: Python<'_>, scene: Inner, from: Option<From<'_>>, threads: Option<usize>) -> PyResult<Self> {
        let pool = work::pool(threads).map_err(|trouble| trouble.raise(py))?;
        let stop = Arc::new(AtomicBool::new(false));
        let engine = work::short(py, pool.as_ref(), || engine(scene, from, &stop))?;
        let mut fixed = engine.fixed();
        let reference = lend(py, std::mem::take(&mut fixed.reference_positions)).unbind();
        let masses = lend(py, std::mem::take(&mut fixed.masses)).unbind();
        Ok(Self { shared: Shared::new(engine, stop, pool, fixed), reference, masses })
    }
}

#[pymethods]
impl Simulation {
    /// Prepares a scene: particles, neighbours, weights, initial state. `threads`: default all cores; results do not
    /// depend on it. A scene that needs more memory than there is is refused before anything is built, unless
    /// `ignore_memory`.
    #[new]
    #[pyo3(signature = (scene, threads = None, *, ignore_memory = false))]
    fn new(py: Python<'_>, scene: &Scene, threads: Option<usize>, ignore_memory: bool) -> PyResult<Self> {
        Self::prepared(py, limited(scene.inner.clone(), ignore_memory), None, threads)
    }

    /// The simulation of a checkpoint, written by `checkpoint` or by a run, at the time it was written: its next steps have
    /// the bits of one that never ended. `path`: a checkpoint, or a directory of results, whose newest checkpoint that can be
    /// read is taken.
    ///
    /// The scene is that of the checkpoint, or `scene`, with `changes` (a dict, as for `Scene.update`). One that differs is
    /// refused with the keys that do, unless `force`: then the state goes on, and scheme and solvers begin anew. The keys
    /// `time.end`, `output` and `checkpoint` may change.
    #[staticmethod]
    #[pyo3(signature = (path, threads = None, *, scene = None, changes = None, force = false, ignore_memory = false))]
    fn restart(
        py: Python<'_>,
        path: PathBuf,
        threads: Option<usize>,
        scene: Option<&Scene>,
        changes: Option<&Bound<'_, PyDict>>,
        force: bool,
        ignore_memory: bool,
    ) -> PyResult<Self> {
        let (checkpoint, scene) = find(py, &path, scene, changes)?;
        Self::prepared(py, limited(scene, ignore_memory), Some((&checkpoint, force)), threads)
    }

    /// Writes a checkpoint of the present state, with all that scheme and solvers remember, in the format of the
    /// checkpoints of runs: for `Simulation.restart`, `nicolson.restart` and the command `nicolson restart PATH --out DIR`.
    /// A file that exists is replaced as a whole or not at all. Raises OSError if the disk refuses.
    ///
    /// It holds neither energies nor probes until now: tables of a run that goes on from it begin there.
    fn checkpoint(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.shared.with(py, |engine| engine.checkpoint(&path))
    }

    /// One accepted step, not past `target` (default: the end) nor the next frame of the scene, so that the states are
    /// those of a run. Returns a dict: time, step, newton_iterations, rejected.
    ///
    /// Raises SimulationFailed and KeyboardInterrupt with the state still the one before the step, and ValueError if the
    /// target is not ahead.
    #[pyo3(signature = (target = None))]
    fn step<'py>(&self, py: Python<'py>, target: Option<f64>) -> PyResult<Bound<'py, PyDict>> {
        let report = self.shared.advance(py, target)?;
        let dict = PyDict::new(py);
        dict.set_item("time", report.time)?;
        dict.set_item("step", report.step)?;
        dict.set_item("newton_iterations", report.newton_iterations)?;
        dict.set_item("rejected", report.rejected)?;
        Ok(dict)
    }

    /// Steps until `time` (s), which is hit exactly; returns the number of steps. `callback`: called with this simulation
    /// after every step; if it returns something true, that was the last.
    #[pyo3(signature = (time, callback = None))]
    fn run_until(slf: &Bound<'_, Self>, time: f64, callback: Option<Py<PyAny>>) -> PyResult<usize> {
        let (py, this) = (slf.py(), slf.get());
        let mut steps = 0;
        while this.time(py)? < time {
            this.shared.advance(py, Some(time))?;
            steps += 1;
            if let Some(callback) = &callback
                && callback.bind(py).call1((slf,))?.is_truthy()?
            {
                break;
            }
        }
        Ok(steps)
    }

    /// Present time, s.
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        self.shared.time(py)
    }

    /// Time at which the scene ends, s.
    #[getter]
    fn end(&self) -> f64 {
        self.shared.fixed.end
    }

    /// Whether the end of the scene is reached.
    #[getter]
    fn finished(&self, py: Python<'_>) -> PyResult<bool> {
        Ok(self.time(py)? >= self.shared.fixed.end)
    }

    /// The state `[u | v | J]`, flat and particle by particle; a view.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let n = self.shared.fixed.particles * (2 * self.shared.fixed.dimension + 1);
        view(&self.shared.lent(py)?, 0..n, 0)
    }

    /// Displacements, m: (particles, dimension); a view.
    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.shared.part(py, 0)
    }

    /// Velocities, m/s: (particles, dimension); a view.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.shared.part(py, 1)
    }

    /// Volume ratios J: (particles,); a view.
    #[getter]
    fn volume_ratio<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.shared.part(py, 2)
    }

    /// Reference positions X, m: (particles, dimension); read-only.
    #[getter]
    fn reference_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (n, dimension) = (self.shared.fixed.particles, self.shared.fixed.dimension);
        view(self.reference.bind(py), 0..n * dimension, dimension)
    }

    /// Present positions X + u, m: (particles, dimension); a new array.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.reference_positions(py)?.add(self.displacement(py)?)
    }

    /// Masses, kg (per thickness in 2D, per area in 1D): (particles,); read-only.
    #[getter]
    fn masses<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.masses.bind(py).clone()
    }

    /// Which components of the velocities are free, not prescribed: (particles, dimension). Where the unknowns are
    /// velocities alone, they are `velocity[free]`.
    #[getter]
    fn free<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let free = self.shared.fixed.free.clone().into_pyarray(py);
        free.call_method1("reshape", ((-1, self.shared.fixed.dimension),))
    }

    /// Number of particles.
    #[getter]
    fn particles(&self) -> usize {
        self.shared.fixed.particles
    }

    /// 1, 2 or 3.
    #[getter]
    fn dimension(&self) -> usize {
        self.shared.fixed.dimension
    }

    /// Name of the scheme.
    #[getter]
    fn scheme(&self) -> &'static str {
        self.shared.fixed.scheme
    }

    /// Nonlinear problems that a step solves one after the other: 2 for TR-BDF2, 3 for SDIRK3, 1 for the other implicit
    /// schemes, 0 for explicit ones.
    #[getter]
    fn stages(&self) -> usize {
        self.shared.fixed.stages
    }

    /// Largest stable explicit step at the start, s.
    #[getter]
    fn explicit_step_limit(&self) -> f64 {
        self.shared.fixed.explicit_step_limit
    }

    /// What the user should know.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.shared.fixed.warnings.clone()
    }

    /// Energies of the present state, J: dict with kinetic, internal, hourglass.
    fn energies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let energies = self.shared.with(py, |engine| Ok(engine.energies()))?;
        let dict = PyDict::new(py);
        dict.set_item("kinetic", energies.kinetic)?;
        dict.set_item("internal", energies.internal)?;
        dict.set_item("hourglass", energies.hourglass)?;
        Ok(dict)
    }

    /// The rate `[v | f/m | J̇]` of a state `[u | v | J]` (default: the present one) at a time (default: the present one);
    /// zero for prescribed velocities.
    #[pyo3(signature = (state = None, time = None))]
    fn rate<'py>(
        &self,
        py: Python<'py>,
        state: Option<Bound<'py, PyAny>>,
        time: Option<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let state = state.map(|state| vector(&state)).transpose()?;
        let rate = self.shared.with(py, |engine| {
            let present = engine.state();
            let time = time.unwrap_or(present.time);
            let state = state.unwrap_or_else(|| present.values.clone());
            engine.rate(time, &state)
        })?;
        Ok(own(py, rate))
    }

    /// The unknowns that Newton's method starts from in the next step, or in its stage after `earlier` (see `residual`).
    #[pyo3(signature = (dt = None, earlier = None))]
    fn unknowns<'py>(
        &self,
        py: Python<'py>,
        dt: Option<f64>,
        earlier: Option<Vec<Bound<'py, PyAny>>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let at = which(dt, earlier)?;
        Ok(own(py, self.shared.with(py, |engine| engine.start(&at))?))
    }

    /// The residual `R(y)` of the next implicit step, momenta in kg m/s: zero where `y` solves it.
    ///
    /// The unknowns `y` are the free velocity components of the stage that the scheme solves in a step of length `dt`
    /// (default: the step that `step()` would try), measured in m/s:
    ///
    ///     R(y) = m (y − ṽ) − s f(t*, ũ + s y, y, J)
    ///
    ///     backward Euler, θ, Crank–Nicolson (θ = ½)
    ///                       s = θ dt   t* = t + dt     ũ = u + (1 − θ) dt v,  ṽ = v + (1 − θ) dt f(t)/m
    ///     mid-point         s = dt/2   t* = t + dt/2   ũ = u,  ṽ = v
    ///     energy–momentum   the same, f with the discrete stress that conserves energy; y is the mean velocity
    ///     generalised-α     s = α_f γ dt/α_m,  t* = t + α_f dt,  ũ, ṽ = u, v + α_f (1 − γ/α_m) dt r
    ///     static            R(y) = −1 s · f(t + dt, u + 1 s · y)
    ///
    /// TR-BDF2 and SDIRK3 solve such a problem for each of their stages, one after the other. `earlier` lists the solutions
    /// `y` of the stages before: none for the first stage, `[y0]` for the second, `[y0, y1]` for the third (`stages` says how
    /// many there are). With the rates r_i = [v | f/m | J̇] of those stages and r(t) of the present state, and c, a per stage,
    ///
    ///     ũ, ṽ = u, v + dt Σ a_i r_i,   t* = t + c dt
    ///
    ///     TR-BDF2, γ = 2 − √2:          s = γ dt/2
    ///       first (trapezium rule)      c = γ          γ/2 r(t)
    ///       second (BDF2)               c = 1          √2/4 r(t) + √2/4 r0
    ///     SDIRK3, g = 0.435866521508459: s = g dt
    ///       first                       c = g          nothing
    ///       second                      c = (1 + g)/2  (1 − g)/2 r0
    ///       third                       c = 1          (−3g²/2 + 4g − 1/4) r0 + (3g²/2 − 5g + 5/4) r1
    ///
    /// `mass` has m, `end_state(y)` the state that `y` leads to. With D_p (tau_p > 0) or `newton.unknowns`, volume ratios
    /// (times the wave speed) and displacements (over s) are unknowns, too. Explicit schemes raise SceneError. The simulation
    /// itself is not disturbed: a second model is built by the first call.
    #[pyo3(signature = (unknowns, dt = None, earlier = None))]
    fn residual<'py>(
        &self,
        py: Python<'py>,
        unknowns: Bound<'py, PyAny>,
        dt: Option<f64>,
        earlier: Option<Vec<Bound<'py, PyAny>>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (y, at) = (vector(&unknowns)?, which(dt, earlier)?);
        Ok(own(py, self.shared.with(py, |engine| engine.residual(&y, &at))?))
    }

    /// The product of the tangent `∂R/∂y` at `unknowns` with a vector; no matrix is made. `earlier` as for `residual`.
    #[pyo3(signature = (unknowns, vector, dt = None, earlier = None))]
    fn tangent_matvec<'py>(
        &self,
        py: Python<'py>,
        unknowns: Bound<'py, PyAny>,
        vector: Bound<'py, PyAny>,
        dt: Option<f64>,
        earlier: Option<Vec<Bound<'py, PyAny>>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (y, direction) = (crate::arrays::vector(&unknowns)?, crate::arrays::vector(&vector)?);
        let at = which(dt, earlier)?;
        Ok(own(py, self.shared.with(py, |engine| engine.matvec(&y, &direction, &at))?))
    }

    /// The tangent `∂R/∂y` at `unknowns` as (data, indices, indptr), for `scipy.sparse.csr_matrix`. `earlier` as for
    /// `residual`.
    #[pyo3(signature = (unknowns, dt = None, earlier = None))]
    fn tangent_csr<'py>(
        &self,
        py: Python<'py>,
        unknowns: Bound<'py, PyAny>,
        dt: Option<f64>,
        earlier: Option<Vec<Bound<'py, PyAny>>>,
    ) -> PyResult<CompressedRows<'py>> {
        let (y, at) = (vector(&unknowns)?, which(dt, earlier)?);
        let (matrix, pattern) = self.shared.with(py, |engine| engine.matrix(&y, &at))?;
        // Both of one kind, as SciPy wants them.
        let narrow = i32::try_from(pattern.entries()).is_ok();
        let integers = |list: &[usize]| -> Bound<'py, PyAny> {
            if narrow {
                list.iter().map(|&i| i as i32).collect::<Vec<_>>().into_pyarray(py).into_any()
            } else {
                list.iter().map(|&i| i as i64).collect::<Vec<_>>().into_pyarray(py).into_any()
            }
        };
        let (indices, indptr) = (integers(pattern.columns()), integers(pattern.offsets()));
        Ok((own(py, matrix.values().to_vec()), indices, indptr))
    }

    /// The state `[u | v | J]` at the end of the step that `unknowns` solve; the simulation stays where it is. With `earlier`
    /// as for `residual`; for a stage that others follow it is the state at the time of the stage.
    #[pyo3(signature = (unknowns, dt = None, earlier = None))]
    fn end_state<'py>(
        &self,
        py: Python<'py>,
        unknowns: Bound<'py, PyAny>,
        dt: Option<f64>,
        earlier: Option<Vec<Bound<'py, PyAny>>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (y, at) = (vector(&unknowns)?, which(dt, earlier)?);
        Ok(own(py, self.shared.with(py, |engine| engine.finish(&y, &at))?))
    }

    /// Mass of the particle of every unknown, kg.
    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(own(py, self.shared.with(py, |engine| engine.mass())?))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (time, fixed) = (self.time(py)?, &self.shared.fixed);
        Ok(format!(
            "<nicolson.Simulation {}, {} particles, t = {time} of {} s>",
            fixed.scheme, fixed.particles, fixed.end
        ))
    }
}
