//! Python values as TOML.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use toml_edit::{Array, InlineTable, Value};

/// Deepest nesting of lists and dicts.
const DEEPEST: usize = 64;

/// A value: bool, int, float, str, path, list, tuple, dict with texts as keys, or what NumPy turns into those.
pub fn value(object: &Bound<'_, PyAny>) -> PyResult<Value> {
    nested(object, 0)
}

fn nested(object: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if depth > DEEPEST {
        return Err(PyValueError::new_err(format!("lists nested deeper than {DEEPEST} have no place in a scene")));
    }
    // bool before int: True is an int, too.
    if object.is_instance_of::<PyBool>() {
        return Ok(object.extract::<bool>()?.into());
    }
    if object.is_instance_of::<PyInt>() {
        return Ok(object.extract::<i64>()?.into());
    }
    if object.is_instance_of::<PyFloat>() {
        return Ok(object.extract::<f64>()?.into());
    }
    if object.is_instance_of::<PyString>() {
        return Ok(object.extract::<String>()?.into());
    }
    if object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>() {
        let mut list = Array::new();
        for element in object.try_iter()? {
            list.push(nested(&element?, depth + 1)?);
        }
        return Ok(list.into());
    }
    if let Ok(dict) = object.cast::<PyDict>() {
        let mut table = InlineTable::new();
        for (key, element) in dict {
            table.insert(key.extract::<String>()?, nested(&element, depth + 1)?);
        }
        return Ok(table.into());
    }
    if object.hasattr("tolist")? {
        return nested(&object.call_method0("tolist")?, depth + 1);
    }
    if object.hasattr("__fspath__")? {
        return nested(&object.call_method0("__fspath__")?, depth + 1);
    }
    let kind = object.get_type().name()?.to_string();
    Err(PyTypeError::new_err(format!(
        "a {kind} has no place in a scene: give a bool, int, float, str, path, list, dict or NumPy array"
    )))
}
