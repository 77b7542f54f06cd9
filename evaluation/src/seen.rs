//! What an evaluation looks at after a step. From a device these columns alone are read: no observation leaves it.

use std::borrow::Cow;

use offtrack::layout::{Clearance, Column, Command, Control, N_CAR_WORDS, Progress, RewardTerms, Truck};
use offtrack::simulator::{Error, Simulator, rows};

const COLUMNS: [Column; 9] = [
    Column::Action,
    Column::Command,
    Column::Control,
    Column::Truck,
    Column::Clearance,
    Column::Progress,
    Column::Ended,
    Column::Reward,
    Column::Terms,
];

/// Columns of a batch, `[n_envs]` rows each.
#[derive(Debug)]
pub(crate) struct Seen<'a> {
    pub(crate) action: Cow<'a, [u32]>,
    pub(crate) command: Cow<'a, [Command]>,
    pub(crate) control: Cow<'a, [Control]>,
    pub(crate) truck: Cow<'a, [Truck]>,
    pub(crate) clearance: Cow<'a, [Clearance]>,
    pub(crate) progress: Cow<'a, [Progress]>,
    pub(crate) ended: Cow<'a, [u32]>,
    pub(crate) reward: Cow<'a, [f32]>,
    pub(crate) terms: Cow<'a, [RewardTerms]>,
    /// Where there are other vehicles.
    pub(crate) cars: Option<Cow<'a, [[u32; N_CAR_WORDS]]>>,
}

impl<'a> Seen<'a> {
    /// Reads them.
    pub(crate) fn of(simulator: &'a Simulator) -> Result<Seen<'a>, Error> {
        let cars = simulator.world().traffic.is_some().then_some(Column::Cars);
        let columns: Vec<Column> = COLUMNS.into_iter().chain(cars).collect();
        let mut read = simulator.read(&columns)?.into_iter();
        // As many as were asked for, in their order.
        let mut next = || read.next().unwrap_or_default();
        Ok(Seen {
            action: rows(next()),
            command: rows(next()),
            control: rows(next()),
            truck: rows(next()),
            clearance: rows(next()),
            progress: rows(next()),
            ended: rows(next()),
            reward: rows(next()),
            terms: rows(next()),
            cars: cars.map(|_| rows(next())),
        })
    }
}

/// The codes of how the last step ended each truck's episode.
pub(crate) fn ended(simulator: &Simulator) -> Result<Cow<'_, [u32]>, Error> {
    Ok(rows(simulator.read(&[Column::Ended])?.pop().unwrap_or_default()))
}
