//! The engine of a simulation behind a lock, and the loan of its state to NumPy.
//!
//! The values are handed over to an array (nothing is copied), of which all views are parts. The next step takes a copy
//! back, as every step copies its start anyway, and leaves the array to those who look at it. So a view never changes, and
//! no thread can see a state that is being written.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::ThreadId;

use nicolson_solvers::time::StepReport;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use rayon::ThreadPool;

use crate::arrays::{lend, view};
use crate::engine::{Engine, Fixed};
use crate::errors::Trouble;
use crate::work::{self, Caller, Ended};

/// What changes, behind one lock.
struct Changing {
    engine: Box<dyn Engine>,
    /// The values of the state, while they are lent to NumPy; the engine's are empty then.
    lent: Option<Py<PyArray1<f64>>>,
    /// Whether a step panicked: nothing can be said of the state then.
    broken: bool,
}

/// What a simulation holds.
pub struct Shared {
    changing: Mutex<Changing>,
    /// Thread that holds the lock: it may come again, from a signal handler.
    owner: Mutex<Option<ThreadId>>,
    stop: Arc<AtomicBool>,
    pool: Option<ThreadPool>,
    pub fixed: Fixed,
}

/// The lock, and the note of who holds it.
struct Held<'a> {
    guard: MutexGuard<'a, Changing>,
    owner: &'a Mutex<Option<ThreadId>>,
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        *self.owner.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

impl Shared {
    pub fn new(engine: Box<dyn Engine>, stop: Arc<AtomicBool>, pool: Option<ThreadPool>, fixed: Fixed) -> Self {
        let changing = Mutex::new(Changing { engine, lent: None, broken: false });
        Self { changing, owner: Mutex::new(None), stop, pool, fixed }
    }

    /// Present time, s.
    pub fn time(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(self.hold(py)?.guard.engine.state().time)
    }

    fn hold(&self, py: Python<'_>) -> PyResult<Held<'_>> {
        let own = std::thread::current().id();
        if *self.owner.lock().unwrap_or_else(PoisonError::into_inner) == Some(own) {
            return Err(PyRuntimeError::new_err(
                "this simulation is inside a step: a signal handler cannot use it until the step is over",
            ));
        }
        let guard = self.changing.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner);
        if guard.broken {
            return Err(PyRuntimeError::new_err("an internal error ended this simulation: make a new one"));
        }
        *self.owner.lock().unwrap_or_else(PoisonError::into_inner) = Some(own);
        Ok(Held { guard, owner: &self.owner })
    }

    /// Gives the values back to the engine. Views that exist keep the memory they show.
    fn settle(py: Python<'_>, changing: &mut Changing) {
        if let Some(lent) = changing.lent.take() {
            changing.engine.state().values = lent.bind(py).readonly().as_array().to_vec();
        }
    }

    /// Lends the values to NumPy: they change hands, not places.
    pub fn lent<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut held = self.hold(py)?;
        if let Some(lent) = &held.guard.lent {
            return Ok(lent.bind(py).clone());
        }
        let array = lend(py, std::mem::take(&mut held.guard.engine.state().values));
        held.guard.lent = Some(array.clone().unbind());
        Ok(array)
    }

    /// Short work on the engine.
    pub fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut dyn Engine) -> Result<T, Trouble> + Send,
    ) -> PyResult<T> {
        let mut held = self.hold(py)?;
        Self::settle(py, &mut held.guard);
        let engine = &mut *held.guard.engine;
        work::short(py, self.pool.as_ref(), || work(engine))
    }

    /// One accepted step towards a target (default: the end).
    pub fn advance(&self, py: Python<'_>, target: Option<f64>) -> PyResult<StepReport> {
        let mut held = self.hold(py)?;
        Self::settle(py, &mut held.guard);
        let changing = &mut *held.guard;
        let (time, end) = (changing.engine.state().time, self.fixed.end);
        let target = target.unwrap_or(end);
        if !target.is_finite() || target <= time {
            let what = format!(
                "the simulation stands at t = {time} s: give a later target than {target} s (it ends at {end} s)"
            );
            return Err(Trouble::Argument(what).raise(py));
        }
        let engine = &mut *changing.engine;
        let silent = |_: Python<'_>, (): ()| Ok(false);
        let advance = |_: &Caller<()>| engine.step(target);
        let Ended { outcome, raised } = work::long(py, self.pool.as_ref(), &self.stop, silent, advance);
        if matches!(outcome, Err(Trouble::Panic(_))) {
            changing.broken = true;
        }
        match (outcome, raised) {
            (_, Some(error)) => Err(error),
            (Ok(report), None) => Ok(report),
            (Err(trouble), None) => Err(trouble.raise(py)),
        }
    }

    /// Displacements, velocities or volume ratios: a view.
    pub fn part<'py>(&self, py: Python<'py>, part: usize) -> PyResult<Bound<'py, PyAny>> {
        let n = self.fixed.particles * self.fixed.dimension;
        match part {
            2 => view(&self.lent(py)?, 2 * n..2 * n + self.fixed.particles, 0),
            _ => view(&self.lent(py)?, part * n..(part + 1) * n, self.fixed.dimension),
        }
    }
}
