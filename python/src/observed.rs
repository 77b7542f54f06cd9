//! What is read of a batch after a step, and observations as Python sees them: the values, and behind them what the
//! benchmark observes beside: extras, and other vehicles.

use std::borrow::Cow;

use bytemuck::{AnyBitPattern, NoUninit};
use offtrack::layout::{Column, EXTRAS, N_AROUND, N_EXTRAS, N_VALUES};
use offtrack::simulator::{Autoreset, Batch, Error, Simulator, rows};
use offtrack::world::World;
use rayon::prelude::*;

/// Rows of observations that a thread copies at least.
const ROWS_MIN: usize = 64;
/// Values of an observation with all that may stand beside.
pub const N_VALUES_MAX: usize = N_VALUES + N_EXTRAS + N_AROUND;

/// What is observed: before the next action, and after the last one.
const BEFORE: [Column; 3] = [Column::Observation, Column::Extras, Column::Around];
const AFTER: [Column; 3] = [Column::NextObservation, Column::NextExtras, Column::NextAround];

/// What stands behind an observation's values.
#[derive(Debug, Clone, Copy)]
pub struct Beside {
    /// Extras.
    pub n_extras: usize,
    /// Whether other vehicles follow.
    pub has_vehicles: bool,
}

impl Beside {
    /// What a world's trucks observe.
    pub fn of(world: &World) -> Beside {
        Beside { n_extras: world.params.n_extras as usize, has_vehicles: world.observes_vehicles() }
    }

    /// Values of an observation in all.
    pub fn n_values(self) -> usize {
        N_VALUES + self.n_extras + self.n_around()
    }

    /// Values of other vehicles.
    fn n_around(self) -> usize {
        if self.has_vehicles { N_AROUND } else { 0 }
    }

    /// Whether nothing stands there.
    pub fn is_empty(self) -> bool {
        self.n_extras == 0 && !self.has_vehicles
    }

    /// Of three columns those that hold something.
    fn held(self, [values, extras, around]: [Column; 3]) -> Vec<Column> {
        let extras = (0 < self.n_extras).then_some(extras);
        [values].into_iter().chain(extras).chain(self.has_vehicles.then_some(around)).collect()
    }

    /// Columns of the observations before the next action.
    pub fn columns_of_observation(self) -> Vec<Column> {
        self.held(BEFORE)
    }

    /// What is read after a step; observations after the last action only where another episode may have replaced
    /// them.
    pub fn columns_of_step(self, autoreset: Autoreset) -> Vec<Column> {
        let after = if autoreset == Autoreset::SameStep { self.held(AFTER) } else { Vec::new() };
        [self.held(BEFORE), vec![Column::Reward, Column::Ended, Column::Truck], after].concat()
    }
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
    pub fn observed(&self, beside: Beside) -> Observed<'_> {
        self.observed_in(BEFORE, beside)
    }

    /// What trucks observed after the last action.
    pub fn observed_last(&self, beside: Beside) -> Observed<'_> {
        let was_read = self.columns.contains(&AFTER[0]);
        self.observed_in(if was_read { AFTER } else { BEFORE }, beside)
    }

    fn observed_in(&self, [values, extras, around]: [Column; 3], beside: Beside) -> Observed<'_> {
        Observed { values: self.rows(values), extras: self.rows(extras), around: self.rows(around), beside }
    }
}

/// Observations of all trucks.
pub struct Observed<'a> {
    values: Cow<'a, [[f32; N_VALUES]]>,
    /// Empty without extras.
    extras: Cow<'a, [[f32; N_EXTRAS]]>,
    /// Empty where no other vehicles are observed.
    around: Cow<'a, [[f32; N_AROUND]]>,
    beside: Beside,
}

impl<'a> Observed<'a> {
    /// What the trucks of a batch observe before the next action.
    pub fn of(batch: &'a Batch, beside: Beside) -> Observed<'a> {
        Observed {
            values: Cow::Borrowed(&batch.observation),
            extras: Cow::Borrowed(&batch.extras),
            around: Cow::Borrowed(&batch.around),
            beside,
        }
    }
}

impl Observed<'_> {
    /// A truck's observation; zeros behind it.
    pub fn row(&self, env: usize) -> [f32; N_VALUES_MAX] {
        let mut row = [0.0; N_VALUES_MAX];
        self.write_row(env, &mut row[..self.beside.n_values()]);
        row
    }

    fn write_row(&self, env: usize, row: &mut [f32]) {
        let (values, rest) = row.split_at_mut(N_VALUES);
        let (extras, around) = rest.split_at_mut(self.beside.n_extras);
        values.copy_from_slice(&self.values[env]);
        if !extras.is_empty() {
            extras.copy_from_slice(&self.extras[env][..extras.len()]);
        }
        if !around.is_empty() {
            around.copy_from_slice(&self.around[env]);
        }
    }

    /// Copies all observations, `[n_envs * n_values]`, on the threads of the caller's pool.
    pub fn write(&self, observation: &mut [f32]) {
        if self.beside.is_empty() {
            let (rows, _) = observation.as_chunks_mut::<N_VALUES>();
            rows.par_iter_mut().with_min_len(ROWS_MIN).zip(&*self.values).for_each(|(row, values)| *row = *values);
            return;
        }
        let rows = observation.par_chunks_exact_mut(self.beside.n_values()).with_min_len(ROWS_MIN);
        rows.enumerate().for_each(|(env, row)| self.write_row(env, row));
    }

    /// All observations as a new array, `[n_envs * n_values]`.
    pub fn to_vec(&self) -> Vec<f32> {
        if self.beside.is_empty() {
            let rows: Vec<[f32; N_VALUES]> = self.values.par_iter().with_min_len(ROWS_MIN).copied().collect();
            return rows.into_flattened();
        }
        let mut observation = vec![0.0; self.values.len() * self.beside.n_values()];
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

/// Names of the first so many extras.
pub fn names(n_extras: usize) -> Vec<&'static str> {
    EXTRAS[..n_extras].iter().map(|extra| extra.name).collect()
}
