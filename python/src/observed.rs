//! What is read of a batch after a step, and observations as Python sees them: the values, and behind them what the
//! benchmark observes beside: extras, and other vehicles.

use std::borrow::Cow;

use bytemuck::{AnyBitPattern, NoUninit};
use offtrack::layout::{Column, N_AROUND, N_EXTRAS, N_VALUES, ObservationLayout};
use offtrack::simulator::{Autoreset, Batch, Error, Simulator, rows};
use rayon::prelude::*;

/// Rows of observations that a thread copies at least.
const ROWS_MIN: usize = 64;
/// Values of an observation with all that may stand beside.
pub const N_VALUES_MAX: usize = ObservationLayout::ALL.n_values();

/// What is observed: before the next action, and after the last one.
const BEFORE: [Column; 3] = [Column::Observation, Column::Extras, Column::Around];
const AFTER: [Column; 3] = [Column::NextObservation, Column::NextExtras, Column::NextAround];

/// Of three columns those that hold something.
fn held(layout: ObservationLayout, [values, extras, around]: [Column; 3]) -> Vec<Column> {
    let extras = (0 < layout.n_extras).then_some(extras);
    [values].into_iter().chain(extras).chain(layout.has_vehicles.then_some(around)).collect()
}

/// Columns of the observations before the next action.
pub fn columns_of_observation(layout: ObservationLayout) -> Vec<Column> {
    held(layout, BEFORE)
}

/// What is read after a step; observations after the last action only where another episode may have replaced them.
pub fn columns_of_step(layout: ObservationLayout, autoreset: Autoreset) -> Vec<Column> {
    let after = if autoreset == Autoreset::SameStep { held(layout, AFTER) } else { Vec::new() };
    [held(layout, BEFORE), vec![Column::Reward, Column::Ended, Column::Truck], after].concat()
}

/// Columns of a batch, as they were read.
pub struct Read<'a> {
    columns: &'a [Column],
    bytes: Vec<Cow<'a, [u8]>>,
}

impl<'a> Read<'a> {
    /// Reads columns.
    pub fn of(simulator: &'a Simulator, columns: &'a [Column]) -> Result<Read<'a>, Error> {
        Ok(Read { columns, bytes: simulator.read(columns)? })
    }

    /// The rows of a column, none where it was not read.
    pub fn rows<T: AnyBitPattern + NoUninit>(&self, column: Column) -> Cow<'_, [T]> {
        let position = self.columns.iter().position(|read| *read == column);
        position.map_or(Cow::Borrowed(&[]), |position| rows(Cow::Borrowed(self.bytes[position].as_ref())))
    }

    /// What trucks observe before the next action.
    pub fn observed(&self, layout: ObservationLayout) -> Observed<'_> {
        self.observed_in(BEFORE, layout)
    }

    /// What trucks observed after the last action.
    pub fn observed_last(&self, layout: ObservationLayout) -> Observed<'_> {
        let was_read = self.columns.contains(&AFTER[0]);
        self.observed_in(if was_read { AFTER } else { BEFORE }, layout)
    }

    fn observed_in(&self, [values, extras, around]: [Column; 3], layout: ObservationLayout) -> Observed<'_> {
        Observed { values: self.rows(values), extras: self.rows(extras), around: self.rows(around), layout }
    }
}

/// Observations of all trucks.
pub struct Observed<'a> {
    values: Cow<'a, [[f32; N_VALUES]]>,
    /// Empty without extras.
    extras: Cow<'a, [[f32; N_EXTRAS]]>,
    /// Empty where no other vehicles are observed.
    around: Cow<'a, [[f32; N_AROUND]]>,
    layout: ObservationLayout,
}

impl<'a> Observed<'a> {
    /// What the trucks of a batch observe before the next action.
    pub fn of(batch: &'a Batch, layout: ObservationLayout) -> Observed<'a> {
        Observed {
            values: Cow::Borrowed(&batch.observation),
            extras: Cow::Borrowed(&batch.extras),
            around: Cow::Borrowed(&batch.around),
            layout,
        }
    }
}

impl Observed<'_> {
    /// A truck's observation; zeros behind it.
    pub fn row(&self, env: usize) -> [f32; N_VALUES_MAX] {
        let mut row = [0.0; N_VALUES_MAX];
        self.write_row(env, &mut row[..self.layout.n_values()]);
        row
    }

    fn write_row(&self, env: usize, row: &mut [f32]) {
        self.layout.join(row, env, &self.values, &self.extras, &self.around);
    }

    /// Copies all observations, `[n_envs * n_values]`, on the threads of the caller's pool.
    pub fn write(&self, observation: &mut [f32]) {
        if self.layout.is_plain() {
            let (rows, _) = observation.as_chunks_mut::<N_VALUES>();
            rows.par_iter_mut().with_min_len(ROWS_MIN).zip(&*self.values).for_each(|(row, values)| *row = *values);
            return;
        }
        let rows = observation.par_chunks_exact_mut(self.layout.n_values()).with_min_len(ROWS_MIN);
        rows.enumerate().for_each(|(env, row)| self.write_row(env, row));
    }

    /// All observations as a new array, `[n_envs * n_values]`.
    pub fn to_vec(&self) -> Vec<f32> {
        if self.layout.is_plain() {
            let rows: Vec<[f32; N_VALUES]> = self.values.par_iter().with_min_len(ROWS_MIN).copied().collect();
            return rows.into_flattened();
        }
        let mut observation = vec![0.0; self.values.len() * self.layout.n_values()];
        self.write(&mut observation);
        observation
    }
}

/// The extras that stand behind an observation's values, for a message; nothing without extras.
pub fn described<'a>(extras: impl ExactSizeIterator<Item = &'a str>) -> String {
    if extras.len() == 0 {
        return String::new();
    }
    format!(", {N_VALUES} and the extras {}", extras.collect::<Vec<_>>().join(", "))
}
