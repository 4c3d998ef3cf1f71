//! The Python module `nicolson._nicolson`; `nicolson/__init__.py` beside it is what users import.
//!
//! | file | purpose |
//! |---|---|
//! | `scene` | scenes: read, change, write |
//! | `run` | a whole run, from the beginning or a checkpoint, with a callback |
//! | `simulation` | a simulation step by step, its state and its nonlinear problem |
//! | `shared` | the lock around it, and the loan of its state to NumPy |
//! | `engine` | the same for every dimension behind one trait |
//! | `work` | work without the interpreter's lock, which Ctrl-C can stop |
//! | `arrays`, `values` | NumPy arrays, and Python values as TOML |
//! | `errors` | errors as exceptions |
//!
//! No unsafe code: the memory of a state is lent to NumPy by handing it over, and copied back by the next step.

mod arrays;
mod engine;
mod errors;
mod run;
mod scene;
mod shared;
mod simulation;
mod values;
mod work;

use pyo3::prelude::*;

/// The compiled part of nicolson.
#[pymodule]
mod _nicolson {
    #[pymodule_export]
    use super::errors::{SceneError, SimulationFailed};
    #[pymodule_export]
    use super::run::{RunResult, restart, run};
    #[pymodule_export]
    use super::scene::Scene;
    #[pymodule_export]
    use super::simulation::Simulation;
    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
