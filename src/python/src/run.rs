//! A whole run, from the beginning or from a checkpoint.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use nicolson::output::Status;
use nicolson::scene::Scene as Inner;
use nicolson::simulation::{self, Checkpoint, Monitor, Outcome, Progress, Rows, RunError, RunOptions};
use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{lend, view};
use crate::engine::From;
use crate::errors::{Trouble, failed};
use crate::scene::{Scene, limited, must_exist, overrides_of};
use crate::work::{self, Caller, Ended};

/// What a callback hears of a step.
struct Heard {
    time: f64,
    end: f64,
    step: f64,
    newton_iterations: usize,
    rejected: usize,
    explicit_step_limit: f64,
}

/// Passes every step on to the callback.
struct Relay<'a>(Option<&'a Caller<Heard>>);

impl Monitor for Relay<'_> {
    fn stepped(&mut self, progress: &Progress<'_>) {
        if let Some(caller) = self.0 {
            caller.call(Heard {
                time: progress.time,
                end: progress.end,
                step: progress.step.step,
                newton_iterations: progress.step.newton_iterations,
                rejected: progress.step.rejected,
                explicit_step_limit: progress.explicit_step_limit,
            });
        }
    }
}

/// What a run came to.
#[pyclass(module = "nicolson", frozen)]
pub struct RunResult {
    /// The report, as in `report.json`.
    #[pyo3(get)]
    report: Py<PyAny>,
    /// Columns of `history.csv` by name; empty if `output.history` is off.
    #[pyo3(get)]
    history: Py<PyDict>,
    /// Columns of `probes.csv` by name.
    #[pyo3(get)]
    probes: Py<PyDict>,
    /// Final state `[u | v | J]`, flat and particle by particle.
    #[pyo3(get)]
    state: Py<PyArray1<f64>>,
    /// Directory with the results, or None.
    #[pyo3(get)]
    out: Option<PathBuf>,
    particles: usize,
    dimension: usize,
}

impl RunResult {
    fn part<'py>(&self, py: Python<'py>, part: usize, width: usize) -> PyResult<Bound<'py, PyAny>> {
        let n = self.particles * self.dimension;
        let end = if part == 2 { 2 * n + self.particles } else { (part + 1) * n };
        view(self.state.bind(py), part * n..end, width)
    }
}

#[pymethods]
impl RunResult {
    /// "completed", or "interrupted" if the callback ended the run.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.report.bind(py).get_item("status")
    }

    /// Time reached, s.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.report.bind(py).get_item("time_reached")
    }

    /// Final displacements, m: (particles, dimension); a view of `state`.
    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.part(py, 0, self.dimension)
    }

    /// Final velocities, m/s: (particles, dimension); a view of `state`.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.part(py, 1, self.dimension)
    }

    /// Final volume ratios: (particles,); a view of `state`.
    #[getter]
    fn volume_ratio<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.part(py, 2, 0)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<nicolson.RunResult {}, t = {} s, {} particles>", self.status(py)?, self.time(py)?, self.particles))
    }
}

fn columns(py: Python<'_>, rows: &Rows) -> PyResult<Py<PyDict>> {
    let dict = PyDict::new(py);
    for (index, title) in rows.titles.iter().enumerate() {
        dict.set_item(title, rows.column(index).collect::<Vec<f64>>().into_pyarray(py))?;
    }
    Ok(dict.unbind())
}

fn result(py: Python<'_>, outcome: Outcome, dimension: usize, out: Option<PathBuf>) -> PyResult<RunResult> {
    let text =
        serde_json::to_string(&outcome.report).map_err(|e| pyo3::exceptions::PyValueError::new_err(e.to_string()))?;
    Ok(RunResult {
        report: py.import("json")?.call_method1("loads", (text,))?.unbind(),
        history: columns(py, &outcome.history)?,
        probes: columns(py, &outcome.probes)?,
        particles: outcome.report.particles,
        dimension,
        state: lend(py, outcome.state).unbind(),
        out,
    })
}

/// Runs a scene to its end: what `nicolson run` does, to the last bit.
///
/// `out`: directory for results; None writes nothing. `callback`: called after every step, in the calling thread, with a
/// dict (time, end, step, newton_iterations, rejected, explicit_step_limit); if it returns something true the run ends
/// there, as it does if it raises. `threads`: default all cores; results do not depend on it. A scene that needs more
/// memory than there is (in the machine, the control group, the address space) is refused before anything is built, unless
/// `ignore_memory`.
///
/// Raises SceneError, SimulationFailed (with what there is in `result`), OSError if the disk refuses, and
/// KeyboardInterrupt after the present step, with what there is in `result` and on disk.
#[pyfunction]
#[pyo3(signature = (scene, out = None, callback = None, threads = None, *, ignore_memory = false))]
pub fn run(
    py: Python<'_>,
    scene: &Scene,
    out: Option<PathBuf>,
    callback: Option<Py<PyAny>>,
    threads: Option<usize>,
    ignore_memory: bool,
) -> PyResult<RunResult> {
    let how = How { command: "nicolson.run", out, callback, threads };
    carry_out(py, &limited(scene.inner.clone(), ignore_memory), None, how)
}

/// Goes on from a checkpoint to the end: what `nicolson restart` does, to the last bit.
///
/// `path`: a checkpoint, or a directory of results, whose newest checkpoint that can be read is taken. `out`: directory for
/// results; None writes nothing, and the directory of the checkpoint itself cuts its files back to the checkpoint and
/// continues them. Without it the columns of the result begin after the checkpoint.
///
/// The scene is that of the checkpoint, or `scene`, with `changes` (a dict, as for `Scene.update`). One that differs is
/// refused with the keys that do, unless `force`: then the state goes on, and scheme and solvers begin anew. The keys
/// `time.end`, `output` and `checkpoint` may change. The rest as for `run`; also raises FileNotFoundError.
#[pyfunction]
#[pyo3(signature = (
    path, out = None, callback = None, threads = None, *, scene = None, changes = None, force = false,
    ignore_memory = false
))]
#[allow(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn restart(
    py: Python<'_>,
    path: PathBuf,
    out: Option<PathBuf>,
    callback: Option<Py<PyAny>>,
    threads: Option<usize>,
    scene: Option<&Scene>,
    changes: Option<&Bound<'_, PyDict>>,
    force: bool,
    ignore_memory: bool,
) -> PyResult<RunResult> {
    let (checkpoint, scene) = find(py, &path, scene, changes)?;
    let how = How { command: "nicolson.restart", out, callback, threads };
    carry_out(py, &limited(scene, ignore_memory), Some((&checkpoint, force)), how)
}

/// A checkpoint, and the scene to go on with.
pub fn find(
    py: Python<'_>,
    path: &Path,
    scene: Option<&Scene>,
    changes: Option<&Bound<'_, PyDict>>,
) -> PyResult<(Checkpoint, Inner)> {
    must_exist(py, path)?;
    let found = py.detach(|| Checkpoint::find(path));
    let (checkpoint, passed) = found.map_err(|error| {
        let error = if error.is_input() { RunError::Choice(error.to_string()) } else { RunError::Output(error) };
        Trouble::Run(error).raise(py)
    })?;
    for error in passed {
        let text = CString::new(format!("passed over {error}").replace('\0', " ")).unwrap_or_default();
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    let changes = overrides_of(changes)?;
    let scene = match scene {
        Some(scene) if changes.is_empty() => Ok(scene.inner.clone()),
        Some(scene) => scene.parse(&changes),
        None => checkpoint.scene(&changes),
    };
    let scene = scene.map_err(|errors| Trouble::from(errors).raise(py))?;
    Ok((checkpoint, scene))
}

/// How a run is carried out.
struct How {
    command: &'static str,
    out: Option<PathBuf>,
    callback: Option<Py<PyAny>>,
    threads: Option<usize>,
}

/// Runs a scene, from the beginning or from a checkpoint.
fn carry_out(py: Python<'_>, scene: &Inner, from: Option<From<'_>>, how: How) -> PyResult<RunResult> {
    let How { command, out, callback, threads } = how;
    let pool = work::pool(threads).map_err(|trouble| trouble.raise(py))?;
    let options =
        RunOptions { directory: out.clone(), command: command.into(), keep_rows: true, ..RunOptions::default() };
    let stop = AtomicBool::new(false);
    let listens = callback.is_some();
    let tell = |py: Python<'_>, heard: Heard| -> PyResult<bool> {
        let Some(callback) = &callback else { return Ok(false) };
        let dict = PyDict::new(py);
        dict.set_item("time", heard.time)?;
        dict.set_item("end", heard.end)?;
        dict.set_item("step", heard.step)?;
        dict.set_item("newton_iterations", heard.newton_iterations)?;
        dict.set_item("rejected", heard.rejected)?;
        dict.set_item("explicit_step_limit", heard.explicit_step_limit)?;
        callback.bind(py).call1((dict,))?.is_truthy()
    };
    let Ended { outcome, raised } = work::long(py, pool.as_ref(), &stop, tell, |caller| {
        let mut relay = Relay(listens.then_some(caller));
        Ok(match from {
            None => simulation::run(scene, &options, &mut relay, &stop)?,
            Some((from, forced)) => simulation::restart(scene, from, forced, &options, &mut relay, &stop)?,
        })
    });
    let outcome = match (outcome, &raised) {
        (Ok(outcome), _) => outcome,
        (Err(trouble), None) => return Err(trouble.raise(py)),
        (Err(_), Some(error)) => return Err(error.clone_ref(py)),
    };
    let (status, time) = (outcome.report.status, outcome.report.time_reached);
    let message = outcome.report.message.clone().unwrap_or_default();
    let result = result(py, outcome, scene.dimension(), out)?;
    if let Some(error) = raised {
        // An exception that takes no attributes goes without.
        let _ = error.value(py).setattr("result", Py::new(py, result)?);
        return Err(error);
    }
    if status == Status::Failed {
        let error = failed(py, &message, time, Vec::new())?;
        error.value(py).setattr("result", Py::new(py, result)?)?;
        return Err(error);
    }
    Ok(result)
}
