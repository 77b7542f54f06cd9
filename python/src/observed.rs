//! What is read of a batch after a step, and observations as Python sees them: the values, and behind them the extras
//! that the benchmark observes.

use std::borrow::Cow;

use bytemuck::{AnyBitPattern, NoUninit};
use offtrack::layout::{Column, EXTRAS, N_EXTRAS, N_VALUES};
use offtrack::simulator::{Autoreset, Batch, Error, Simulator};
use rayon::prelude::*;

/// Rows of observations that a thread copies at least.
const ROWS_MIN: usize = 64;
/// Values of an observation with all extras.
pub const N_VALUES_MAX: usize = N_VALUES + N_EXTRAS;

/// What is observed: before the next action, and after the last one.
const BEFORE: [Column; 2] = [Column::Observation, Column::Extras];
const AFTER: [Column; 2] = [Column::NextObservation, Column::NextExtras];

/// Columns of the observations before the next action: extras only where a benchmark has some.
pub fn columns_of_observation(n_extras: usize) -> &'static [Column] {
    if n_extras == 0 { &BEFORE[..1] } else { &BEFORE }
}

/// What is read after a step; observations after the last action only where another episode may have replaced them.
pub fn columns_of_step(autoreset: Autoreset, n_extras: usize) -> Vec<Column> {
    let n = columns_of_observation(n_extras).len();
    let after = if autoreset == Autoreset::SameStep { &AFTER[..n] } else { &[] };
    [&BEFORE[..n], &[Column::Reward, Column::Ended, Column::Truck], after].concat()
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
        position.map_or(Cow::Borrowed(&[]), |position| rows_of(&self.bytes[position]))
    }

    /// What trucks observe before the next action.
    pub fn observed(&self, n_extras: usize) -> Observed<'_> {
        self.observed_in(BEFORE, n_extras)
    }

    /// What trucks observed after the last action.
    pub fn observed_last(&self, n_extras: usize) -> Observed<'_> {
        let was_read = self.columns.contains(&AFTER[0]);
        self.observed_in(if was_read { AFTER } else { BEFORE }, n_extras)
    }

    fn observed_in(&self, [values, extras]: [Column; 2], n_extras: usize) -> Observed<'_> {
        Observed { values: self.rows(values), extras: self.rows(extras), n_extras }
    }
}

/// Bytes as rows. Those read from a device need not be aligned.
pub fn rows_of<T: AnyBitPattern + NoUninit>(bytes: &[u8]) -> Cow<'_, [T]> {
    match bytemuck::try_cast_slice(bytes) {
        Ok(rows) => Cow::Borrowed(rows),
        Err(_) => Cow::Owned(bytemuck::pod_collect_to_vec(bytes)),
    }
}

/// Observations of all trucks.
pub struct Observed<'a> {
    values: Cow<'a, [[f32; N_VALUES]]>,
    /// Empty without extras.
    extras: Cow<'a, [[f32; N_EXTRAS]]>,
    n_extras: usize,
}

impl<'a> Observed<'a> {
    /// What the trucks of a batch observe before the next action.
    pub fn of(batch: &'a Batch, n_extras: usize) -> Observed<'a> {
        Observed { values: Cow::Borrowed(&batch.observation), extras: Cow::Borrowed(&batch.extras), n_extras }
    }
}

impl Observed<'_> {
    /// Values of a truck's observation, its extras among them.
    fn n_values(&self) -> usize {
        N_VALUES + self.n_extras
    }

    /// A truck's observation; zeros behind it.
    pub fn row(&self, env: usize) -> [f32; N_VALUES_MAX] {
        let mut row = [0.0; N_VALUES_MAX];
        row[..N_VALUES].copy_from_slice(&self.values[env]);
        if let Some(extras) = self.extras.get(env) {
            row[N_VALUES..self.n_values()].copy_from_slice(&extras[..self.n_extras]);
        }
        row
    }

    /// Copies all observations, `[n_envs * n_values]`, on the threads of the caller's pool.
    pub fn write(&self, observation: &mut [f32]) {
        if self.n_extras == 0 {
            let (rows, _) = observation.as_chunks_mut::<N_VALUES>();
            rows.par_iter_mut().with_min_len(ROWS_MIN).zip(&*self.values).for_each(|(row, values)| *row = *values);
            return;
        }
        let rows = observation.par_chunks_exact_mut(self.n_values()).with_min_len(ROWS_MIN);
        rows.zip(&*self.values).zip(&*self.extras).for_each(|((row, values), extras)| {
            let (first, rest) = row.split_at_mut(N_VALUES);
            first.copy_from_slice(values);
            rest.copy_from_slice(&extras[..self.n_extras]);
        });
    }

    /// All observations as a new array, `[n_envs * n_values]`.
    pub fn to_vec(&self) -> Vec<f32> {
        if self.n_extras == 0 {
            let rows: Vec<[f32; N_VALUES]> = self.values.par_iter().with_min_len(ROWS_MIN).copied().collect();
            return rows.into_flattened();
        }
        let mut observation = vec![0.0; self.values.len() * self.n_values()];
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
