//! The layout of columns and observations, so that Python declares nothing twice.

use offtrack::layout::shared::{self, Named, sentence};
use offtrack::layout::{Column, EXTRAS, Ended, N_VALUES, OBSERVATION, VEHICLE_VALUES, Values, structs};
use pyo3::prelude::*;

/// A field of a row: name, type of numpy, number of values (0 for one that is no array), what it is.
type Field = (&'static str, &'static str, usize, String);

/// Neighbouring values: name, index of the first, number, least value, what each is.
type Group = (&'static str, usize, usize, f32, &'static str);

/// Every column with the fields of an element and the number of elements in a row (0 for one that is no array): a
/// single unnamed field where an element is a number. At the end what the column is.
#[pyfunction]
pub fn column_layouts() -> Vec<(&'static str, Vec<Field>, usize, String)> {
    let structs = structs();
    let layout = |column: &Column| {
        let element = column.element();
        let (fields, size) = match structs.iter().find(|found| found.name == element) {
            Some(found) => (found.fields.iter().map(of_field).collect(), found.size),
            None => {
                let (kind, length) = numpy_type(&element);
                (vec![("", kind, length, String::new())], size_of::<f32>())
            }
        };
        let n = column.width() / size;
        (Named::name(*column), fields, if n == 1 { 0 } else { n }, sentence(&[column.doc()]))
    };
    Column::ALL.iter().map(layout).collect()
}

fn of_field(field: &shared::Field) -> Field {
    let (kind, length) = numpy_type(&field.wgsl);
    (field.name, kind, length, field.doc.clone())
}

fn numpy_type(wgsl: &str) -> (&'static str, usize) {
    match wgsl {
        "u32" => ("<u4", 0),
        "vec2<f32>" => ("<f4", 2),
        _ => ("<f4", 0),
    }
}

/// Groups of an observation's values: name, index of the first, number, least value, what each is.
#[pyfunction]
pub fn observation_groups() -> Vec<Group> {
    OBSERVATION.iter().map(group).collect()
}

/// Groups of what is observed of other vehicles, in the same form; the first value has the index 0.
#[pyfunction]
pub fn vehicle_groups() -> Vec<Group> {
    VEHICLE_VALUES.iter().map(group).collect()
}

fn group(values: &Values) -> Group {
    (values.name, values.first, values.n, values.low, values.doc)
}

/// What may stand behind these, in the same form: a benchmark has the first so many. They are limited to -1..=1.
#[pyfunction]
pub fn extra_groups() -> Vec<Group> {
    EXTRAS.iter().enumerate().map(|(index, extra)| (extra.name, N_VALUES + index, 1, -1.0, extra.doc)).collect()
}

/// The codes of `ended` in their order, by name.
#[pyfunction]
pub fn end_codes() -> Vec<&'static str> {
    Ended::ALL.iter().map(|ended| ended.name()).collect()
}
