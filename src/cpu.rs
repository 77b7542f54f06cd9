//! The CPU engine: columns of a batch, stepped a truck at a time by all cores.
//!
//! A truck's step reads and writes its own [`Row`] and reads the shared [`World`], so the number of threads and the place in the batch
//! cannot change a result.

pub mod collide;
pub mod count;
pub mod draw;
pub mod drive;
pub mod follow;
pub mod judge;
pub mod observe;
pub mod reset;
pub mod sense;
pub mod steer;

use std::time::{Duration, Instant};

use bytemuck::{cast_slice, cast_slice_mut};
use rayon::prelude::*;

use crate::cpu::count::Tally;
use crate::layout::{Clearance, Control, N_RAYS, N_VALUES, Progress, RewardTerms, Truck, constants};
use crate::stages::{STAGES, Stage};
use crate::world::World;

constants! {
    /// Threads of a workgroup.
    pub const WORKGROUP: u32 = 64;
}

/// Columns of a batch.
pub const N_COLUMNS: usize = 11;

/// One truck's share of the columns while a stage works on it.
#[derive(Debug)]
pub struct Row<'a> {
    /// The batch's seed.
    pub seed: u32,
    /// The truck's place in the batch.
    pub env: u32,
    /// Routes that episodes run on, as indices into the world's table.
    pub choice: &'a RouteChoice,
    /// Index into the action table.
    pub action: &'a mut u32,
    /// What drives the truck.
    pub control: &'a mut Control,
    /// The truck.
    pub truck: &'a mut Truck,
    /// Its distance to the kerbs.
    pub clearance: &'a mut Clearance,
    /// Its place along the route.
    pub progress: &'a mut Progress,
    /// Its distance sensors [m].
    pub ranges: &'a mut [f32; N_RAYS],
    /// What the next action sees.
    pub observation: &'a mut [f32; N_VALUES],
    /// What the last action led to.
    pub next_observation: &'a mut [f32; N_VALUES],
    /// Code of [`crate::layout::Ended`] for the step just made.
    pub ended: &'a mut u32,
    /// What the reward weighs.
    pub terms: &'a mut RewardTerms,
    /// The reward of the step just made.
    pub reward: &'a mut f32,
}

/// Which route an episode runs on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RouteChoice {
    /// Drawn anew for every episode, each as likely as the next. A held truck does not exist here: episodes follow each other.
    Drawn(Vec<u32>),
    /// Truck `env` runs `routes[env]`, once: when its episode has ended it is held until the batch is reset.
    Fixed(Vec<u32>),
}

/// The columns of a batch: `n_envs` rows each.
#[derive(Debug, Clone)]
pub struct Batch {
    seed: u32,
    choice: RouteChoice,
    /// What happened since the batch was made.
    pub(crate) tally: Tally,
    /// Index into the action table, `[n_envs]`.
    pub action: Vec<u32>,
    /// What drives each truck, `[n_envs]`.
    pub control: Vec<Control>,
    /// The trucks, `[n_envs]`.
    pub truck: Vec<Truck>,
    /// Distances to the kerbs, `[n_envs]`.
    pub clearance: Vec<Clearance>,
    /// Places along the routes, `[n_envs]`.
    pub progress: Vec<Progress>,
    /// Distance sensors [m], `[n_envs, 29]`.
    pub ranges: Vec<[f32; N_RAYS]>,
    /// What the next action sees, `[n_envs, 69]`.
    pub observation: Vec<[f32; N_VALUES]>,
    /// What the last action led to, `[n_envs, 69]`; differs from `observation` only where an episode ended.
    pub next_observation: Vec<[f32; N_VALUES]>,
    /// Codes of [`crate::layout::Ended`] for the step just made, `[n_envs]`.
    pub ended: Vec<u32>,
    /// What the reward weighs, `[n_envs]`.
    pub terms: Vec<RewardTerms>,
    /// Rewards of the step just made, `[n_envs]`.
    pub reward: Vec<f32>,
}

impl Batch {
    /// `n_envs` trucks that have yet to be reset.
    pub(crate) fn new(n_envs: usize, seed: u32, choice: RouteChoice) -> Batch {
        Batch {
            seed,
            choice,
            tally: Tally::default(),
            action: vec![0; n_envs],
            control: vec![Control::default(); n_envs],
            truck: vec![Truck::default(); n_envs],
            clearance: vec![Clearance::default(); n_envs],
            progress: vec![Progress::default(); n_envs],
            ranges: vec![[0.0; N_RAYS]; n_envs],
            observation: vec![[0.0; N_VALUES]; n_envs],
            next_observation: vec![[0.0; N_VALUES]; n_envs],
            ended: vec![0; n_envs],
            terms: vec![RewardTerms::default(); n_envs],
            reward: vec![0.0; n_envs],
        }
    }

    /// Trucks in the batch.
    pub fn n_envs(&self) -> usize {
        self.truck.len()
    }

    /// Which routes its episodes run on.
    pub fn choice(&self) -> &RouteChoice {
        &self.choice
    }

    /// What happened since the batch was made.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// The rows `indices` of this batch, in that order and as often as they are named: row `i` carries on as row `indices[i]` was.
    pub(crate) fn gathered(&self, indices: &[u32]) -> Batch {
        fn picked<T: Copy>(column: &[T], indices: &[u32]) -> Vec<T> {
            indices.iter().map(|&index| column[index as usize]).collect()
        }
        Batch {
            seed: self.seed,
            tally: self.tally,
            choice: match &self.choice {
                RouteChoice::Fixed(routes) => RouteChoice::Fixed(picked(routes, indices)),
                RouteChoice::Drawn(routes) => RouteChoice::Drawn(routes.clone()),
            },
            action: picked(&self.action, indices),
            control: picked(&self.control, indices),
            truck: picked(&self.truck, indices),
            clearance: picked(&self.clearance, indices),
            progress: picked(&self.progress, indices),
            ranges: picked(&self.ranges, indices),
            observation: picked(&self.observation, indices),
            next_observation: picked(&self.next_observation, indices),
            ended: picked(&self.ended, indices),
            terms: picked(&self.terms, indices),
            reward: picked(&self.reward, indices),
        }
    }

    /// Every column by its name, as the bytes it lies in: with them a batch goes on where it was, see [`crate::simulator::Simulator::restore`].
    pub fn columns(&self) -> [(&'static str, &[u8]); N_COLUMNS] {
        [
            ("action", cast_slice(&self.action)),
            ("control", cast_slice(&self.control)),
            ("truck", cast_slice(&self.truck)),
            ("clearance", cast_slice(&self.clearance)),
            ("progress", cast_slice(&self.progress)),
            ("ranges", cast_slice(self.ranges.as_flattened())),
            ("observation", cast_slice(self.observation.as_flattened())),
            ("next_observation", cast_slice(self.next_observation.as_flattened())),
            ("ended", cast_slice(&self.ended)),
            ("terms", cast_slice(&self.terms)),
            ("reward", cast_slice(&self.reward)),
        ]
    }

    /// The same to be written to.
    pub(crate) fn columns_mut(&mut self) -> [(&'static str, &mut [u8]); N_COLUMNS] {
        [
            ("action", cast_slice_mut(&mut self.action)),
            ("control", cast_slice_mut(&mut self.control)),
            ("truck", cast_slice_mut(&mut self.truck)),
            ("clearance", cast_slice_mut(&mut self.clearance)),
            ("progress", cast_slice_mut(&mut self.progress)),
            ("ranges", cast_slice_mut(self.ranges.as_flattened_mut())),
            ("observation", cast_slice_mut(self.observation.as_flattened_mut())),
            ("next_observation", cast_slice_mut(self.next_observation.as_flattened_mut())),
            ("ended", cast_slice_mut(&mut self.ended)),
            ("terms", cast_slice_mut(&mut self.terms)),
            ("reward", cast_slice_mut(&mut self.reward)),
        ]
    }

    /// Every row, all cores sharing them.
    fn rows(&mut self) -> impl ParallelIterator<Item = Row<'_>> {
        let (seed, choice) = (self.seed, &self.choice);
        (
            &mut self.action,
            &mut self.control,
            &mut self.truck,
            &mut self.clearance,
            &mut self.progress,
            &mut self.ranges,
            &mut self.observation,
            &mut self.next_observation,
            &mut self.ended,
            &mut self.terms,
            (&mut self.reward).into_par_iter().enumerate(),
        )
            .into_par_iter()
            .with_min_len(16)
            .map(
                move |(action, control, truck, clearance, progress, ranges, observation, next_observation, ended, terms, (env, reward))| {
                    Row {
                        seed,
                        env: env as u32,
                        choice,
                        action,
                        control,
                        truck,
                        clearance,
                        progress,
                        ranges,
                        observation,
                        next_observation,
                        ended,
                        terms,
                        reward,
                    }
                },
            )
    }

    /// Does `work` to every row.
    pub(crate) fn for_each_row(&mut self, work: impl Fn(&mut Row) + Sync) {
        self.rows().for_each(|mut row| work(&mut row));
    }

    /// Works on every row whose truck is not held; between `before` and `after` the step is counted.
    fn drive_on(&mut self, before: &(impl Fn(&mut Row) + Sync), after: &(impl Fn(&mut Row) + Sync)) {
        let driving = self.rows().filter(|row| row.truck.held == 0);
        let tally = driving.fold(Tally::default, |tally, mut row| {
            before(&mut row);
            let tally = tally.with(&row);
            after(&mut row);
            tally
        });
        let tally = tally.reduce(Tally::default, Tally::plus);
        self.tally = self.tally.plus(tally);
    }

    /// One step of every truck: all stages over a row while it is in the cache, then the next row.
    pub(crate) fn step(&mut self, world: &World) {
        let [stages @ .., last] = &STAGES;
        self.drive_on(&|row| stages.iter().for_each(|stage| (stage.cpu)(world, row)), &|row| (last.cpu)(world, row));
    }

    /// The same step a stage at a time over all rows: the time of each, in the order of [`STAGES`].
    pub(crate) fn step_by_stage(&mut self, world: &World) -> [Duration; STAGES.len()] {
        std::array::from_fn(|index| {
            let begun = Instant::now();
            self.run_stage(world, &STAGES[index]);
            begun.elapsed()
        })
    }

    /// One stage over all rows; with `judge` the step is counted.
    pub(crate) fn run_stage(&mut self, world: &World, stage: &Stage) {
        if stage.name == "judge" {
            self.drive_on(&|row| (stage.cpu)(world, row), &|_| ());
        } else {
            self.rows().filter(|row| row.truck.held == 0).for_each(|mut row| (stage.cpu)(world, &mut row));
        }
    }
}
