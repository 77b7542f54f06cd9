//! States of a road that episodes begin in: cars alone have driven there for a while.

use bytemuck::{bytes_of, cast_slice, cast_slice_mut};

use super::{Car, Demand, Network, Row, Rules, Run};
use crate::files::cache::Cache;
use crate::layout::shared::constants;
use crate::layout::{N_CARS, Stream};

constants! {
    /// States of a road and a demand.
    pub const N_SNAPSHOTS: usize = 64;
}

/// Steps from an empty road to the first: cars have driven through by then.
const UNTIL_FIRST: u32 = 600;
/// Steps from one to the next, after which most cars are others.
const BETWEEN: u32 = 200;
/// What the run of the snapshots is drawn from; any will do.
const STREAM: Stream = Stream { seed: 2026, env: 0 };
/// Counted up whenever the same tables give other snapshots, so that older entries are not used.
const FORM: u32 = 2;

/// What snapshots are made from.
#[derive(Debug, Clone, Copy)]
pub struct Snapshots<'a> {
    /// The road.
    pub network: &'a Network,
    /// The drivers.
    pub rules: &'a Rules,
    /// What comes.
    pub demand: &'a Demand,
}

impl Snapshots<'_> {
    /// The snapshots, [`N_SNAPSHOTS`] rows.
    pub fn baked(&self) -> Vec<Row> {
        let mut run = Run::new(self.network, self.rules, self.demand, N_CARS, STREAM);
        let snapshot = |index: usize| {
            let n_steps = if index == 0 { UNTIL_FIRST } else { BETWEEN };
            (0..n_steps).for_each(|_| run.step(|_, _| ()));
            let mut row = Row { backlog: run.backlog(), ..Row::EMPTY };
            row.cars.copy_from_slice(&run.cars);
            row
        };
        (0..N_SNAPSHOTS).map(snapshot).collect()
    }

    /// The same, from the cache if they were kept there before; else they are kept now.
    pub fn cached(&self, cache: &Cache) -> Vec<Row> {
        let key = self.key();
        let kept = cache.get("snapshots", &key).and_then(|bytes| self.parsed(&bytes));
        kept.unwrap_or_else(|| {
            let rows = self.baked();
            cache.put("snapshots", &key, cast_slice(&rows));
            rows
        })
    }

    /// The rows that these bytes are; none if a car is on no path of the road.
    fn parsed(&self, bytes: &[u8]) -> Option<Vec<Row>> {
        let mut rows = vec![Row::EMPTY; N_SNAPSHOTS];
        let words = cast_slice_mut(&mut rows);
        (bytes.len() == size_of_val::<[u8]>(words)).then(|| words.copy_from_slice(bytes))?;
        let is_on_road = |car: &Car| !car.is_there() || car.path() < self.network.paths.len();
        rows.iter().all(|row| row.cars.iter().all(is_on_road)).then_some(rows)
    }

    /// Everything that they are computed from.
    fn key(&self) -> Vec<u8> {
        let words = [self.network.words(), self.rules.all_words(), self.demand.words()].concat();
        [bytes_of(&FORM), cast_slice(&words)].concat()
    }
}
