//! Arrays of numpy as they come.

use numpy::{Element, PyArray, PyArrayMethods, PyReadonlyArray, PyUntypedArrayMethods, ndarray::Dimension};
use pyo3::prelude::*;

/// The array, or a copy of it where its numbers do not lie whole numbers apart, as a field of packed records does: such
/// an array cannot be seen as one of Rust.
pub fn aligned<'py, T, D>(array: PyReadonlyArray<'py, T, D>) -> PyResult<PyReadonlyArray<'py, T, D>>
where
    T: Element,
    D: Dimension,
{
    let size = size_of::<T>() as isize;
    let is_aligned = (array.data() as usize).is_multiple_of(align_of::<T>());
    if is_aligned && array.strides().iter().all(|stride| stride % size == 0) {
        return Ok(array);
    }
    let copied = array.call_method0("copy")?.cast_into::<PyArray<T, D>>()?;
    Ok(copied.readonly())
}
