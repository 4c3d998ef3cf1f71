//! Scenes: read, change, write.

use std::path::{Path, PathBuf};

use nicolson::machine::available_memory;
use nicolson::scene::{Scene as Inner, SceneErrors};
use nicolson::simulation::{Forecast, prepare};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::errors::{Trouble, scene_errors};
use crate::values::value;
use crate::work;

/// A scene: the text of a scene file, understood and checked.
///
/// Particles are made, and selectors applied, only by `run`, `Simulation` and `forecast`: what is wrong with those shows
/// there, as a `SceneError` as well.
#[pyclass(module = "nicolson")]
pub struct Scene {
    pub inner: Inner,
    name: String,
    base: PathBuf,
}

impl Scene {
    /// The scene with overrides.
    pub fn parse(&self, overrides: &[(String, String)]) -> Result<Inner, SceneErrors> {
        Inner::parse(self.inner.text(), &self.name, &self.base, overrides)
    }

    fn change(&mut self, py: Python<'_>, changes: Vec<(String, Bound<'_, PyAny>)>) -> PyResult<()> {
        let overrides = overrides(changes)?;
        // The scene stays as it was if the change does not fit.
        match self.parse(&overrides) {
            Ok(inner) => {
                self.inner = inner;
                Ok(())
            }
            Err(errors) => Err(scene_errors(py, &errors)?),
        }
    }
}

#[pymethods]
impl Scene {
    /// Reads a scene file. Files that the scene names are sought beside it.
    #[staticmethod]
    fn from_toml(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        must_exist(py, &path)?;
        match py.detach(|| Inner::read(&path, &[])) {
            Ok(inner) => {
                let base = path.parent().unwrap_or(Path::new("")).to_owned();
                Ok(Self { inner, name: path.display().to_string(), base })
            }
            Err(errors) => Err(scene_errors(py, &errors)?),
        }
    }

    /// Reads a scene from text; `name` stands in messages, and files that the scene names are sought in `base`.
    #[staticmethod]
    #[pyo3(signature = (text, name = "scene", base = None))]
    fn from_text(py: Python<'_>, text: &str, name: &str, base: Option<PathBuf>) -> PyResult<Self> {
        let base = base.unwrap_or_default();
        match py.detach(|| Inner::parse(text, name, &base, &[])) {
            Ok(inner) => Ok(Self { inner, name: name.to_owned(), base }),
            Err(errors) => Err(scene_errors(py, &errors)?),
        }
    }

    /// Changes one key, as `--set` does: `scene.set("body.0.spacing", 0.05)`.
    fn set(&mut self, py: Python<'_>, key: String, value: Bound<'_, PyAny>) -> PyResult<()> {
        self.change(py, vec![(key, value)])
    }

    /// Changes several keys at once; none of them if they do not fit together.
    fn update(&mut self, changes: &Bound<'_, PyDict>) -> PyResult<()> {
        self.change(changes.py(), entries(changes)?)
    }

    /// The text of the scene with all changes in it; reading it again gives the same scene.
    fn to_toml(&self) -> &str {
        self.inner.text()
    }

    /// An independent copy.
    fn copy(&self) -> Self {
        Self { inner: self.inner.clone(), name: self.name.clone(), base: self.base.clone() }
    }

    /// What a run will need: particles, unknowns, entries of the tangent, memory in bytes, steps and more. Builds the tables
    /// of a run; `ignore_memory` as for `run`.
    #[pyo3(signature = (*, ignore_memory = false))]
    fn forecast<'py>(&self, py: Python<'py>, ignore_memory: bool) -> PyResult<Bound<'py, PyDict>> {
        let scene = &limited(self.inner.clone(), ignore_memory);
        let forecast = work::short(py, None, || match scene.dimension() {
            1 => forecast::<1>(scene),
            2 => forecast::<2>(scene),
            _ => forecast::<3>(scene),
        })?;
        let dict = PyDict::new(py);
        dict.set_item("particles", forecast.particles)?;
        dict.set_item("unknowns", forecast.unknowns)?;
        dict.set_item("entries", forecast.entries)?;
        dict.set_item("mean_neighbours", forecast.mean_neighbours)?;
        dict.set_item("memory", forecast.memory)?;
        dict.set_item("explicit_step_limit", forecast.explicit_step_limit)?;
        dict.set_item("step", forecast.step)?;
        dict.set_item("steps", forecast.steps)?;
        dict.set_item("linear", forecast.linear)?;
        Ok(dict)
    }

    /// Title of the scene.
    #[getter]
    fn title(&self) -> &str {
        &self.inner.title
    }

    /// 1, 2 or 3.
    #[getter]
    fn dimension(&self) -> usize {
        self.inner.dimension()
    }

    fn __copy__(&self) -> Self {
        self.copy()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.copy()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let make = py.get_type::<Self>().getattr("from_text")?;
        let base = self.base.as_os_str();
        Ok((make, (self.inner.text(), &self.name, base).into_pyobject(py)?))
    }

    fn __repr__(&self) -> String {
        format!("<nicolson.Scene {:?}, {} dimension(s)>", self.inner.title, self.inner.dimension())
    }
}

/// A scene that is refused where it needs more memory than there is, unless that is to be ignored.
pub fn limited(mut scene: Inner, ignore_memory: bool) -> Inner {
    scene.limit_memory(if ignore_memory { None } else { available_memory() });
    scene
}

/// Python's own error for a file that is not there.
pub fn must_exist(py: Python<'_>, path: &Path) -> PyResult<()> {
    std::fs::metadata(path).map(drop).map_err(|error| {
        let raised = PyErr::from(error);
        let _ = raised.value(py).setattr("filename", path.as_os_str());
        raised
    })
}

/// Keys and values of a dict.
fn entries<'py>(changes: &Bound<'py, PyDict>) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    changes.iter().map(|(key, value)| Ok((key.extract()?, value))).collect()
}

fn overrides(changes: Vec<(String, Bound<'_, PyAny>)>) -> PyResult<Vec<(String, String)>> {
    changes.into_iter().map(|(key, object)| Ok((key, value(&object)?.to_string()))).collect()
}

/// Overrides from a dict of changes, if there is one.
pub fn overrides_of(changes: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, String)>> {
    overrides(changes.map(entries).transpose()?.unwrap_or_default())
}

fn forecast<const D: usize>(scene: &Inner) -> Result<Forecast, Trouble> {
    Ok(prepare::<D>(scene)?.forecast(scene))
}
