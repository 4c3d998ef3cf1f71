//! Errors as exceptions, with what scripts need as attributes.

use nicolson::scene::SceneErrors;
use nicolson::simulation::RunError;
use nicolson_solvers::time::StepFailure;
use pyo3::create_exception;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

create_exception!(
    nicolson,
    SceneError,
    PyValueError,
    "A scene that is wrong or cannot be computed. Every mistake is in the message with its place and a remedy, and in \
     `mistakes`: dicts with origin, line, column, message, remedy."
);
create_exception!(
    nicolson,
    SimulationFailed,
    PyRuntimeError,
    "A step that could not be done. `time`: where it stood, s. `tries`: dicts with the step tried, s, and the cause. \
     `result`: what a run computed until then (None for a Simulation, whose state is still the one before the step)."
);

/// What may come out of work that is done without the interpreter.
#[derive(Debug)]
pub enum Trouble {
    /// The scene, the model or the disk.
    Run(RunError),
    /// A step failed: in words, and in all its tries.
    Step { message: String, failure: Box<StepFailure> },
    /// A wrong argument.
    Argument(String),
    /// A panic: a mistake of this program.
    Panic(String),
}

impl From<RunError> for Trouble {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

impl From<SceneErrors> for Trouble {
    fn from(errors: SceneErrors) -> Self {
        Self::Run(RunError::Scene(errors))
    }
}

impl Trouble {
    /// The exception.
    pub fn raise(self, py: Python<'_>) -> PyErr {
        let made = match self {
            Self::Run(RunError::Scene(errors)) => scene_errors(py, &errors),
            Self::Run(RunError::Outside { time, error }) => {
                failed(py, &format!("at t = {time} s: {error}"), time, Vec::new())
            }
            Self::Run(error) if error.is_input() => input(py, &error.to_string()),
            Self::Run(error) => Ok(PyOSError::new_err(error.to_string())),
            Self::Step { message, failure } => {
                let tries = failure.tries.iter().map(|tried| (tried.step, tried.cause.to_string())).collect();
                failed(py, &message, failure.time, tries)
            }
            Self::Argument(message) => Ok(PyValueError::new_err(message)),
            Self::Panic(message) => Ok(PyRuntimeError::new_err(format!(
                "internal error, a mistake of nicolson that should be reported: {message}"
            ))),
        };
        made.unwrap_or_else(|error| error)
    }
}

/// [`SceneError`] with its list of mistakes.
pub fn scene_errors(py: Python<'_>, errors: &SceneErrors) -> PyResult<PyErr> {
    let mistakes = PyList::empty(py);
    for error in errors {
        let mistake = PyDict::new(py);
        mistake.set_item("origin", &error.origin)?;
        mistake.set_item("line", error.line)?;
        mistake.set_item("column", error.column)?;
        mistake.set_item("message", &error.message)?;
        mistake.set_item("remedy", &error.remedy)?;
        mistakes.append(mistake)?;
    }
    let raised = SceneError::new_err(errors.to_string());
    raised.value(py).setattr("mistakes", mistakes)?;
    Ok(raised)
}

/// [`SceneError`] without places: what does not go together in a scene that is well written.
fn input(py: Python<'_>, message: &str) -> PyResult<PyErr> {
    let raised = SceneError::new_err(message.to_owned());
    raised.value(py).setattr("mistakes", PyList::empty(py))?;
    Ok(raised)
}

/// [`SimulationFailed`] with its attributes.
pub fn failed(py: Python<'_>, message: &str, time: f64, tries: Vec<(f64, String)>) -> PyResult<PyErr> {
    let list = PyList::empty(py);
    for (step, cause) in tries {
        let tried = PyDict::new(py);
        tried.set_item("step", step)?;
        tried.set_item("cause", cause)?;
        list.append(tried)?;
    }
    let raised = SimulationFailed::new_err(message.to_owned());
    let value = raised.value(py);
    value.setattr("time", time)?;
    value.setattr("tries", list)?;
    value.setattr("result", py.None())?;
    Ok(raised)
}
