//! The CPU engine: the columns of a batch, stepped a truck at a time by all cores.
//!
//! A truck's step reads and writes its own `Row` and reads the shared [`World`], so the number of threads, the truck's
//! index in the batch and the order in which trucks are stepped, that of their roads, cannot change a result.

pub mod along;
pub mod around;
pub mod collide;
pub mod copy_observation;
pub mod count;
pub mod draw;
pub mod drive;
pub mod follow;
pub mod judge;
pub mod observe;
pub mod perceive;
pub mod reset;
pub mod sense;
pub mod steer;
pub mod traffic;

use std::borrow::Cow;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::{Autoreset, Batch, EngineBatch, Error, Row, Tally, group};
use crate::engine::stages::{N_STAGES, STAGES, Stage};
use crate::layout::{BeginRow, Column, Command, Stream};
use crate::world::World;

/// Does a stage to one truck.
pub(super) type Entry = fn(&World, &mut Row);

/// The function of a stage.
pub(super) fn entry(stage: Stage) -> Entry {
    match stage {
        Stage::Steer => steer::steer,
        Stage::Drive => drive::drive,
        Stage::Traffic => traffic::traffic,
        Stage::Collide => collide::collide,
        Stage::Follow => follow::follow,
        Stage::Sense => sense::sense,
        Stage::Observe => observe::observe,
        Stage::Judge => judge::judge,
        Stage::Count => count::count,
        Stage::CopyObservation => copy_observation::copy_observation,
        Stage::Reset => reset::reset,
    }
}

/// Does `stages` to one truck.
fn run(world: &World, row: &mut Row, stages: &[Stage]) {
    stages.iter().for_each(|&stage| entry(stage)(world, row));
}

/// Does `stages` to every truck that is not held: all of them to one row while it is in the cache, then to the next.
/// Of them a held truck has the reset alone. Trucks that share a road go through them together.
fn run_all(world: &World, batch: &mut Batch, stages: &[Stage]) {
    if 1 < world.group() {
        return group::run_all(world, batch, stages);
    }
    let resets = stages.contains(&Stage::Reset);
    let tally = on_all(world, batch, |row| {
        if row.truck.held == 0 {
            run(world, row, stages);
        } else if resets {
            reset::reset(world, row);
        }
    });
    batch.tally = batch.tally.plus(tally);
}

/// Works on every row, on all cores; returns what the rows add to the tally.
fn on_all(world: &World, batch: &mut Batch, work: impl Fn(&mut Row) + Sync) -> Tally {
    let tallies = batch.blocks(world).map(|mut block| {
        let mut tally = Tally::default();
        for n in 0..block.places.len() {
            let mut row = block.row(block.places[n], &[]);
            work(&mut row);
            tally = tally.plus(row.tally);
        }
        tally
    });
    tallies.reduce(Tally::default, Tally::plus)
}

fn draw_all(world: &World, batch: &mut Batch) {
    on_all(world, batch, |row| draw::draw(world, row));
}

impl EngineBatch for Batch {
    fn n_envs(&self) -> usize {
        Batch::n_envs(self)
    }

    fn bytes(&self) -> usize {
        Batch::columns(self).iter().map(|(_, column)| column.len()).sum()
    }

    fn columns(&self) -> &Batch {
        self
    }

    fn tally(&self) -> Result<Tally, Error> {
        Ok(self.tally)
    }

    fn streams(&self) -> Vec<Stream> {
        Batch::streams(self).to_vec()
    }

    fn begin(&mut self, world: &World, begins: &[BeginRow], streams: Option<&[Stream]>) -> Result<(), Error> {
        streams.into_iter().for_each(|streams| self.set_streams(streams));
        if 1 < world.group() {
            group::begin_all(world, self, begins);
        } else {
            on_all(world, self, |row| reset::begin(world, row, &begins[row.env as usize]));
        }
        self.outdate_order();
        Ok(())
    }

    fn set_autoreset(&mut self, autoreset: Autoreset) {
        Batch::set_autoreset(self, autoreset);
    }

    fn read(&self, columns: &[Column]) -> Result<Vec<Cow<'_, [u8]>>, Error> {
        Ok(columns.iter().map(|&column| Cow::Borrowed(self.column(column))).collect())
    }

    fn gather(&mut self, _: &World, indices: &[u32]) -> Result<(), Error> {
        *self = self.gathered(indices)?;
        Ok(())
    }

    fn draw_from(&mut self, routes: &[u32]) {
        self.set_drawn(routes);
    }

    fn replace(&mut self, batch: Batch) -> Result<(), Error> {
        *self = batch;
        Ok(())
    }

    fn step(&mut self, world: &World, actions: &[u32]) -> Result<(), Error> {
        self.action.copy_from_slice(actions);
        run_all(world, self, &STAGES);
        Ok(())
    }

    fn step_with(&mut self, world: &World, commands: &[Command]) -> Result<(), Error> {
        self.command.copy_from_slice(commands);
        run_all(world, self, &STAGES);
        Ok(())
    }

    fn steps_at_random(&mut self, world: &World, n_steps: usize) {
        for _ in 0..n_steps {
            draw_all(world, self);
            run_all(world, self, &STAGES);
        }
    }

    fn step_at_random_by_stage(&mut self, world: &World) -> Result<[Duration; N_STAGES], Error> {
        draw_all(world, self);
        Ok(STAGES.map(|stage| {
            let start = Instant::now();
            self.run_stage(world, stage);
            start.elapsed()
        }))
    }

    fn step_at_random_by_kernel(&mut self) -> Result<Vec<(&'static str, Duration)>, Error> {
        Ok(Vec::new())
    }

    fn run_stage(&mut self, world: &World, stage: Stage) {
        run_all(world, self, &[stage]);
    }

    fn wait(&self) -> Result<(), Error> {
        Ok(())
    }
}
