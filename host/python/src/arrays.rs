//! Arrays of numpy, made of what Rust has computed without a copy, and read from what Python gives.

use numpy::{Element, IntoPyArray, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::UsageError;
use crate::row::{Layout, Row};

/// An array of this shape that takes over the memory of `values`.
pub fn shaped<T: Element>(py: Python<'_>, values: Vec<T>, shape: &[usize]) -> PyResult<Py<PyAny>> {
    let array = values.into_pyarray(py);
    Ok(array.reshape(shape.to_vec())?.into_any().unbind())
}

/// The same of real numbers in the precision of the model.
pub fn reals(
    py: Python<'_>,
    double: bool,
    values: impl Iterator<Item = f64>,
    shape: &[usize],
) -> PyResult<Py<PyAny>> {
    match double {
        true => shaped(py, values.collect(), shape),
        // Widened from single precision, so that no bit is lost.
        false => shaped(py, values.map(|x| x as f32).collect(), shape),
    }
}

/// Numbers of any array-like, with its shape.
pub fn numbers(given: &Bound<'_, PyAny>, name: &str) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let py = given.py();
    let options = PyDict::new(py);
    options.set_item("dtype", "float64")?;
    options.set_item("order", "C")?;
    let array = py.import("numpy")?.call_method("asarray", (given,), Some(&options));
    let array = array.map_err(|error| {
        UsageError::new_err(format!("{name}: {}\n  fix: give an array of numbers", error.value(py)))
    })?;
    let array: PyReadonlyArrayDyn<'_, f64> = array.extract()?;
    let shape = array.as_array().shape().to_vec();
    Ok((array.as_slice()?.to_vec(), shape))
}

/// Rows of drive positions. `leading`: the shape before the columns; `None` for any length.
pub fn rows(
    given: &Bound<'_, PyAny>,
    layout: Layout,
    reach_m: f64,
    leading: &[(&str, Option<usize>)],
) -> PyResult<(Vec<Row>, Vec<usize>)> {
    let (values, shape) = numbers(given, "positions")?;
    let columns = layout.columns();
    let fits = shape.len() == leading.len() + 1
        && shape.last() == Some(&columns.len())
        && leading.iter().zip(&shape).all(|((_, wanted), own)| wanted.is_none_or(|n| n == *own));
    if !fits {
        let wanted: Vec<String> = leading
            .iter()
            .map(|(name, wanted)| wanted.map_or_else(|| (*name).to_owned(), |n| n.to_string()))
            .chain([columns.len().to_string()])
            .collect();
        return Err(UsageError::new_err(format!(
            "positions have the shape {shape:?}, and this rig takes ({}): {}\n  fix: one column for each \
             drive, in this order",
            wanted.join(", "),
            columns.join(", ")
        )));
    }
    let read = |(index, numbers): (usize, &[f64])| {
        let row = layout.row(numbers).unwrap_or_default();
        let place = |error| UsageError::new_err(format!("positions, row {index}: {error}"));
        layout.check(&row, reach_m).map(|()| row).map_err(place)
    };
    let rows = values.chunks(columns.len()).enumerate().map(read).collect::<PyResult<_>>()?;
    Ok((rows, shape[..leading.len()].to_vec()))
}
