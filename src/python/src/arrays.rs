//! NumPy arrays in and out.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice};

/// A vector as an array that owns it: nothing is copied.
pub fn own<'py>(py: Python<'py>, values: Vec<f64>) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_vec(py, values)
}

/// The same, read-only for good.
pub fn lend<'py>(py: Python<'py>, values: Vec<f64>) -> Bound<'py, PyArray1<f64>> {
    let array = own(py, values);
    drop(array.readwrite().make_nonwriteable());
    array
}

/// A copy of anything that NumPy takes for numbers, row after row.
pub fn vector(values: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let py = values.py();
    let options = PyDict::new(py);
    options.set_item("dtype", "float64")?;
    let array = py.import("numpy")?.call_method("asarray", (values,), Some(&options))?;
    let flat: PyReadonlyArray1<'_, f64> = array.call_method1("reshape", (-1,))?.extract()?;
    Ok(flat.as_array().to_vec())
}

/// A view of a part, as rows of `width` (or flat if that is 0).
pub fn view<'py>(
    array: &Bound<'py, PyArray1<f64>>,
    part: std::ops::Range<usize>,
    width: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let slice = PySlice::new(array.py(), part.start as isize, part.end as isize, 1);
    let part = array.get_item(slice)?;
    if width == 0 { Ok(part) } else { part.call_method1("reshape", ((-1, width),)) }
}
